"""Runs scripts as a user does, inside this process: what they import is loaded once for many of them."""

import contextlib
import io
import os
import runpy
import subprocess
import sys
import time
from pathlib import Path

from femgear import cli

SCRIPTS = Path(__file__).resolve().parents[1] / "scripts"


def run_script(name, *arguments, folder):
    """Exit code and output of a script, run from a folder that is not the repository."""
    path, output, errors = str(SCRIPTS / name), io.StringIO(), io.StringIO()
    words = [path, *map(str, arguments)]
    before = sys.argv, os.environ.get("COLUMNS")
    sys.argv, os.environ["COLUMNS"] = words, "160"
    try:
        with (
            contextlib.chdir(folder),
            contextlib.redirect_stdout(output),
            contextlib.redirect_stderr(errors),
        ):
            code = _code(path)
    finally:
        sys.argv = before[0]
        if before[1] is None:
            del os.environ["COLUMNS"]
        else:
            os.environ["COLUMNS"] = before[1]
    return subprocess.CompletedProcess(words, code, output.getvalue(), errors.getvalue())


def _code(path: str) -> int:
    try:
        runpy.run_path(path, run_name="__main__")
    except SystemExit as end:
        return end.code or 0
    return 0


def wait_for_lines(journal, lines, program, *, seconds=60.0):
    """Wait until a program (`soak.programs.Program`) that runs has written so many lines of a journal."""
    until = time.monotonic() + seconds
    while not journal.exists() or journal.read_bytes().count(b"\n") < lines:
        ended = os.waitid(os.P_PID, program.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT)
        if ended or time.monotonic() > until:
            raise AssertionError(f"{journal.name} has no {lines} lines: {program.wait()}")
        time.sleep(0.002)


def run_femgear(*arguments, folder):
    """Exit code and output of femgear in this process, run from a folder."""
    output, errors = io.StringIO(), io.StringIO()
    words = [*map(str, arguments)]
    with (
        contextlib.chdir(folder),
        contextlib.redirect_stdout(output),
        contextlib.redirect_stderr(errors),
    ):
        code = cli.main(words)
    return subprocess.CompletedProcess(words, code, output.getvalue(), errors.getvalue())
