"""femgear/commands/design.py: cases are written."""

from pathlib import Path

import pytest
from command_stand_ins import CASE

from femgear import cli
from femgear.trains.reading import read_case


def test_a_new_case_is_written_once_and_can_be_checked(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    numbers = ["--teeth", "24", "30", "84", "--module", "3 mm", "--torque", "120 Nm"]
    assert cli.main(["new", "planetary", *numbers]) == 0
    out = capsys.readouterr().out
    assert "written: planetary.toml" in out and "next:    femgear run planetary.toml" in out
    assert "Assumed: --planets 3 --face-width" in out and "--teeth" not in out
    case = read_case("planetary.toml")
    assert case.module == 3e-3 and case.operation.torque == 120.0 and case.ring.teeth == 84
    assert cli.main(["check", "planetary.toml"]) == 0
    before = Path("planetary.toml").read_bytes()
    assert cli.main(["new", "planetary"]) == 2
    err = capsys.readouterr().err
    assert "E-OUTPUT" in err and "planetary.toml" in err and "--force" in err
    assert Path("planetary.toml").read_bytes() == before
    assert cli.main(["new", "pair", "-o", "planetary.toml", "--force"]) == 0
    assert read_case("planetary.toml").model == "pair"
    assert cli.main(["new", "bevel", "-o", "b.toml"]) == 2 and not Path("b.toml").exists()
    assert cli.main(["new", "planetary", "--torque", "-70 N m", "-o", "c.toml"]) == 0
    assert read_case("c.toml").operation.torque == -70.0
    assert "drivetrain" in capsys.readouterr().err


def test_options_that_new_has_not_are_entries_of_the_file(capsys):
    assert cli.main(["new", "planetary", "--backlash", "51 um"]) == 2
    assert "remedy:  femgear new --help; other entries are written into the file" in capsys.readouterr().err


def test_new_refuses_a_centre_distance_at_which_nothing_closes(tmp_path, capsys):
    given = ["--centre-distance", "51 mm", "-o", str(tmp_path / "a.toml")]
    assert cli.main(["new", "planetary", *given]) == 2
    assert "--centre-distance: no profile shifts close" in capsys.readouterr().err


@pytest.mark.parametrize("name", ("spur_pair", "nrel_pga", "own_chain"))
def test_pairs_sets_and_files_of_former_models_become_gearboxes_in_a_casing(name, tmp_path):
    for path in CASE.parent.glob(f"{name}*"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    assert cli.main(["casing", str(tmp_path / f"{name}.toml")]) == 0
    case = read_case(tmp_path / f"{name}_in_casing.toml")
    assert case.train == "gearbox" and len(case.casing.foot) == 4 and len(case.sensor) >= 2
    assert cli.main(["check", str(tmp_path / f"{name}_in_casing.toml")]) == 0


def test_a_gearbox_gets_a_casing_and_a_set_with_a_sensor_none(tmp_path, capsys):
    box = tmp_path / "box.toml"
    assert cli.main(["new", "gearbox", "-o", str(box)]) == 0
    assert cli.main(["casing", str(box)]) == 0
    assert "W-ESTIMATED" in capsys.readouterr().err
    case = read_case(tmp_path / "box_in_casing.toml")
    assert len(case.casing.foot) == 4 and len(case.sensor) == 3 and case.runup.count
    assert cli.main(["casing", str(CASE), "-o", str(tmp_path / "set.toml")]) == 2
    assert "levels are those at its sensors" in capsys.readouterr().err
