"""femgear/commands/recordings.py: what is printed without a recording, and what is refused."""

import pytest
from command_stand_ins import CASE

from femgear import cli


def test_orders_of_faults_are_tabulated_where_no_folder_is_named(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["faults", str(CASE)]) == 0
    printed = capsys.readouterr().out
    # a tooth of the sun meets three planets a turn of the sun against the carrier: 3 (1 + 108 / 27) - 3 of the carrier
    assert "a tooth of the sun" in printed and " 12 " in printed and not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "options", [["--limits", "2"], ["--index", "5"], ["--wav"], ["--kinds", "foo"], ["--tolerances", "absent.toml"]]
)
def test_records_without_a_folder_are_refused(options, capsys):
    assert cli.main(["faults", str(CASE), *options]) == 2
    printed = capsys.readouterr()
    assert "E-ARGUMENTS" in printed.err and "name one by -o" in printed.err and not printed.out


def test_causes_of_a_gearbox_are_those_of_the_case_of_its_teeth(capsys):
    box = CASE.with_name("grc_like_drivetrain.toml")
    assert cli.main(["measured", str(box), "absent.csv", "--stage", "carrier-sun", "--causes"]) == 2
    assert "--causes: causes are those of a set of its own" in capsys.readouterr().err
