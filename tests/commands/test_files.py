"""femgear/commands/files.py: names of files that are written."""

import pytest
from command_stand_ins import CASE

from femgear import cli


@pytest.mark.parametrize("name", ["a\nb.toml", "con.toml", "a:b.toml", "x" * 98 + ".toml"])
def test_files_are_written_under_names_that_run_takes(tmp_path, capsys, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["rexs", str(CASE), "-o", "stage.rexs"]) == 0
    for command in (["import", "stage.rexs", "-o", name], ["new", "pair", "-o", name]):
        assert cli.main(command) == 2
        said = capsys.readouterr().err
        assert "E-CHOICE" in said and "--output" in said
    assert [path.name for path in tmp_path.iterdir()] == ["stage.rexs"]
