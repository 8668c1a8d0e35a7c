"""femgear/commands/program.py: kinds of options."""

import pytest

from femgear import cli


@pytest.mark.parametrize("given", [["--teeth", "27.5", "40", "108"], ["--planets", "3.5"]])
def test_numbers_that_are_not_whole_are_refused_and_not_rounded(given, tmp_path, capsys):
    assert cli.main(["new", "planetary", *given, "-o", str(tmp_path / "a.toml")]) == 2
    assert "is no whole number" in capsys.readouterr().err and not (tmp_path / "a.toml").exists()
