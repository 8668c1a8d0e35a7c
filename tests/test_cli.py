"""The program as a shell starts it: its libraries, its memory, its end."""

import os
import signal
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

import femgear
from femgear import cli
from femgear.commands import LOADING


def test_the_installed_program(tmp_path):
    program = Path(sys.executable).with_name("femgear")

    def started(*arguments):
        return subprocess.run([program, *arguments], capture_output=True, text=True, timeout=60, check=False)

    run = started("--help")
    assert run.returncode == 0
    for command in ("check", "run", "report", "sweep", "schema"):
        assert command in run.stdout
    run = subprocess.run([program, "check", "absent.toml"], capture_output=True, text=True, timeout=60, check=False)
    assert run.returncode == 2 and "E-FILE" in run.stderr and run.stdout == ""


def test_no_arguments_and_version(capsys):
    assert cli.main([]) == 0
    assert "Usage" in capsys.readouterr().out
    assert cli.main(["--version"]) == 0
    assert capsys.readouterr().out.strip() == version("femgear") == femgear.__version__


def test_python_runs_the_package_as_the_program():
    done = subprocess.run([sys.executable, "-m", "femgear", "--version"], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout.strip()) == (0, femgear.__version__)
    refused = [sys.executable, "-m", "femgear", "check", "absent.toml"]
    assert subprocess.run(refused, capture_output=True, timeout=60).returncode == 2


def _started(program="import sys; from femgear.cli import main; sys.exit(main())", *words, **options):
    return subprocess.run(
        [sys.executable, "-c", program, *words], capture_output=True, text=True, check=False, **options
    )


@pytest.mark.parametrize(
    ("failure", "code", "said"),
    [
        ("raise KeyboardInterrupt", 130, "interrupted\n"),
        ("raise ImportError('libx.so: no such file')", 5, "[E-LIBRARY] ImportError: libx.so: no such file\n"),
        ("raise MemoryError", 5, "[E-LIBRARY] MemoryError: \n"),
    ],
)
def test_failures_while_the_program_is_loaded(tmp_path, failure, code, said):
    (tmp_path / "cyclopts.py").write_text(f"{failure}\n")
    done = _started(env=os.environ | {"PYTHONPATH": str(tmp_path)})
    remedy = f"  remedy:  {LOADING}\n" if code == 5 else ""
    assert done.returncode == code and done.stderr == said + remedy


@pytest.mark.parametrize("limit", ["RLIMIT_AS", "RLIMIT_DATA"])
def test_a_process_that_may_use_too_little_memory_does_not_begin(limit):
    resource = pytest.importorskip("resource")
    number = getattr(resource, limit)
    done = _started(preexec_fn=lambda: resource.setrlimit(number, (200_000_000, resource.RLIM_INFINITY)))
    assert done.returncode == 3 and "[E-MEMORY]" in done.stderr and "found:   200 MB" in done.stderr
    assert "ulimit" in done.stderr and "Traceback" not in done.stderr


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_when_the_command_has_ended_change_nothing(number):
    program = (
        "import atexit, os, sys; from femgear.cli import main;"
        f"atexit.register(os.kill, os.getpid(), {int(number)}); sys.exit(main())"
    )
    done = _started(program, "--version")
    assert done.returncode == 0 and not done.stderr
