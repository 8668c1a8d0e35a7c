"""femgear/commands/program.py: kinds of options."""

import pytest

from femgear import cli


@pytest.mark.parametrize("given", [["--teeth", "27.5", "40", "108"], ["--planets", "3.5"]])
def test_numbers_that_are_not_whole_are_refused_and_not_rounded(given, tmp_path, capsys):
    assert cli.main(["new", "planetary", *given, "-o", str(tmp_path / "a.toml")]) == 2
    assert "is no whole number" in capsys.readouterr().err and not (tmp_path / "a.toml").exists()


def test_help_shows_defaults_that_say_something(capsys):
    assert cli.main(["harris", "--help"]) == 0
    text = " ".join(capsys.readouterr().out.replace("│", " ").split())
    assert "[default: 0 um, 2 um, 4 um, 6 um, 8 um]" in text and "[default: 1.0]" in text
    assert "[default: ()]" not in text and "[default: False]" not in text and "[default: None]" not in text
