"""femgear/commands/program.py: kinds of options."""

import shlex

import pytest

from femgear import cli
from femgear.commands.program import app

WITH_EXAMPLES = ("export", "faults", "measured", "new", "optimise", "run", "sweep")


@pytest.mark.parametrize("given", [["--teeth", "27.5", "40", "108"], ["--planets", "3.5"]])
def test_numbers_that_are_not_whole_are_refused_and_not_rounded(given, tmp_path, capsys):
    assert cli.main(["new", "planetary", *given, "-o", str(tmp_path / "a.toml")]) == 2
    assert "is no whole number" in capsys.readouterr().err and not (tmp_path / "a.toml").exists()


def test_help_shows_defaults_that_say_something(capsys):
    assert cli.main(["harris", "--help"]) == 0
    text = " ".join(capsys.readouterr().out.replace("│", " ").split())
    assert "[default: 0 um, 2 um, 4 um, 6 um, 8 um]" in text and "[default: 1.0]" in text
    assert "[default: ()]" not in text and "[default: False]" not in text and "[default: None]" not in text


@pytest.mark.parametrize("command", WITH_EXAMPLES)
def test_help_ends_with_whole_commands_that_can_be_copied(command, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert cli.main([command, "--help"]) == 0
    shown = capsys.readouterr().out.partition("Examples:\n")[2].splitlines()
    # as a shell reads them: lines that end with a backslash go on, others are whole at this width
    lines = "\n".join(line.strip() for line in shown if line.strip()).replace("\\\n", " ").splitlines()
    commands = [shlex.split(line, comments=True) for line in lines if not line.startswith("#")]
    assert commands
    for words in commands:
        assert words[:2] == ["femgear", command] and any("." in word or word.endswith("results") for word in words)
        app.parse_args(words[1:], exit_on_error=False, print_error=False)


def test_the_examples_of_new_are_drafts(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["new", "--help"]) == 0
    for line in capsys.readouterr().out.splitlines():
        if line.strip().startswith("femgear new"):
            assert cli.main(shlex.split(line)[1:]) == 0
    assert {path.name for path in tmp_path.iterdir()} == {"set.toml", "pair.toml"}
