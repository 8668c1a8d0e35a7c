"""Fixtures of the tests of commands."""

import pytest
from command_stand_ins import fake_run

from femgear import cli
from femgear import run as run_module


@pytest.fixture
def check(tmp_path, capsys):
    """Run ``femgear check`` on a text; gives exit code, standard output and standard error."""

    def run(text: str, *options: str):
        path = tmp_path / "case.toml"
        path.write_text(text, encoding="utf-8")
        code = cli.main(["check", str(path), *options])
        printed = capsys.readouterr()
        return code, printed.out, printed.err

    return run


@pytest.fixture
def pipeline(monkeypatch):
    def use(function):
        monkeypatch.setattr(run_module, "run_case", function, raising=False)

    use(fake_run)
    return use
