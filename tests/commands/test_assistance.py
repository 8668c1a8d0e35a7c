"""femgear/commands/assistance.py: codes, schema and the app."""

import json
import sys

import pytest

from femgear import cli


@pytest.mark.parametrize(
    ("code", "words"),
    (
        ("W-PULL", "Severity: doubt"),
        ("W-TAIL", "What to do: Raise the number"),
        ("[e-mass]", "A refusal"),
        ("W-LIFE", "Severity: fault"),
    ),
)
def test_a_code_is_explained(capsys, code, words):
    assert cli.main(["explain", code]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith(code.strip("[]").upper()) and words in printed


def test_a_code_that_is_none_is_refused_with_those_that_are_near(capsys):
    assert cli.main(["explain", "W-PUL"]) == 2
    assert "W-PULL" in capsys.readouterr().err


def test_schema_is_json(capsys):
    assert cli.main(["schema"]) == 0
    assert "properties" in json.loads(capsys.readouterr().out)


def test_the_app_says_what_it_needs(tmp_path, capsys, monkeypatch):
    assert cli.main(["app", str(tmp_path / "none"), "--no-browser"]) == 2
    assert "there is no such folder" in capsys.readouterr().err
    monkeypatch.delitem(sys.modules, "femgear.app.server", raising=False)
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    assert cli.main(["app", str(tmp_path), "--no-browser"]) != 0
    err = capsys.readouterr().err
    assert "[E-LIBRARY]" in err and 'pip install "femgear[app]"' in err
