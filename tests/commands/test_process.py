"""femgear/commands/process.py: exit codes, interrupts, and that no traceback is ever shown."""

import contextlib
import errno
import os
import signal
import time
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from command_stand_ins import CASE, STAGES, fake_run, interrupted_run, synthetic

from femgear import cli
from femgear.commands import process, run
from femgear.errors import ConvergenceError
from femgear.trains.elastic.stages import ELASTIC
from femgear.trains.reading import open_results

pytestmark = pytest.mark.usefixtures("pictures_undrawn")


@pytest.mark.parametrize(
    "arguments",
    [["chek"], ["run"], ["compare", "x", "y"], ["run", "x.toml", "-o", "y", "--only", "all"], ["check"]],
)
def test_wrong_arguments(arguments, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main(arguments) == 2
    err = capsys.readouterr().err
    assert "[E-ARGUMENTS]" in err and "--help" in err


def test_an_argument_that_is_missing_is_named(capsys):
    cli.main(["compare", "x", "y"])
    assert "--output is required" in capsys.readouterr().err
    cli.main(["run", "x.toml", "-o"])
    assert "-o requires an argument" in capsys.readouterr().err


def test_force_keeps_the_old_results_until_the_new_ones_are_there(tmp_path, capsys, pipeline):
    out = tmp_path / "out"
    assert cli.main(["run", str(CASE), "-o", str(out), "--only", "static"]) == 0
    for function, code in ((_diverge, 3), (interrupted_run, 130), (_fill, 4)):
        pipeline(function)
        assert cli.main(["run", str(CASE), "-o", str(out), "--force"]) == code
        assert open_results(out).stages == ("static",) and len(list(out.iterdir())) == 3
    pipeline(fake_run)
    assert cli.main(["run", str(CASE), "-o", str(out), "--force"]) == 0
    assert open_results(out).stages == STAGES
    assert f"results: {out}\n" in capsys.readouterr().out


def test_two_runs_on_one_folder(tmp_path, capsys, pipeline):
    def second(case, out, **options):
        assert cli.main(["run", str(CASE), "-o", str(tmp_path / "out"), "--force"]) == 4
        fake_run(case, out, **options)

    pipeline(second)
    assert cli.main(["run", str(CASE), "-o", str(tmp_path / "out"), "--only", "static"]) == 0
    assert "E-LOCKED" in capsys.readouterr().err


def test_an_interrupted_run_says_how_far_it_came(tmp_path, capsys, monkeypatch):
    data = synthetic()

    def solve(name):
        if name == "dynamics":
            raise KeyboardInterrupt
        dataset = getattr(data, name)()
        for name in dataset.coords:
            dataset[name].attrs |= {"units": "1", "long_name": str(name)}
        return SimpleNamespace(dataset=lambda: dataset)

    stages = tuple(
        replace(one, solve=lambda *_, name=one.name, **__: solve(name), parts=None, verdict=lambda _: {})
        for one in ELASTIC.stages
    )
    monkeypatch.setattr("femgear.run.write_result", lambda result, path, **_: path.write_bytes(b""))
    monkeypatch.setattr("femgear.trains.elastic.stages.ELASTIC", replace(ELASTIC, stages=stages))
    out = tmp_path / "out"
    assert cli.main(["run", str(CASE), "-o", str(out)]) == 130
    assert cli.main(["report", str(out)]) == 4
    err = capsys.readouterr().err
    assert "the run was interrupted after: static, stress, modes" in err
    assert f"femgear run {out / 'case.toml'} -o {out}" in err
    with pytest.warns(UserWarning, match="interrupted after: static, stress, modes"):
        results = open_results(out)
    assert results.static.sizes["planet"] == 3 and results.case.title == "Planetary set 27/40/108"


def test_an_interrupt_while_the_last_words_are_shown_changes_nothing(monkeypatch, capsys):
    flush = process._Stream.flush
    monkeypatch.setattr(process._Stream, "flush", lambda self: os.kill(os.getpid(), signal.SIGINT) or flush(self))
    monkeypatch.setattr(process, "_called", lambda *_: print("said") or 0)
    assert cli.main(["--version"]) == 0
    assert capsys.readouterr().out == "said\n" and signal.getsignal(signal.SIGINT) == signal.default_int_handler


def test_an_interrupt_of_which_compiled_code_makes_an_error_is_one(tmp_path, capsys, pipeline):
    """Extensions clear what was raised beneath them, and raise what they know."""
    out = tmp_path / "out"

    def changed(*_, number=signal.SIGINT, **__):
        with contextlib.suppress(KeyboardInterrupt):
            os.kill(os.getpid(), number)
            time.sleep(1.0)
        raise ValueError("Invalid bounding box")

    for number in (signal.SIGINT, signal.SIGTERM):
        pipeline(partial(changed, number=number))
        assert cli.main(["run", str(CASE), "-o", str(out)]) == 130
        said = f"interrupted; the same command goes on from what {out} holds"
        assert capsys.readouterr().err.splitlines()[-1] == said
    # without an interrupt it is a defect
    pipeline(partial(changed, number=0))
    with pytest.raises(ValueError, match="bounding box"):
        cli.main(["run", str(CASE), "-o", str(out)])
    assert signal.getsignal(signal.SIGINT) == signal.default_int_handler


def test_an_interrupt_behind_the_results_says_that_they_are_complete(tmp_path, capsys, pipeline, monkeypatch):
    out = tmp_path / "out"
    monkeypatch.setattr(run, "print_briefly", interrupted_run)
    assert cli.main(["run", str(CASE), "-o", str(out)]) == 130
    assert capsys.readouterr().err.splitlines()[-1] == f"interrupted; the results in {out} are complete"
    pipeline(interrupted_run)
    assert cli.main(["run", str(CASE), "-o", str(out), "--force"]) == 130
    said = f"interrupted; the same command goes on from what {out} holds"
    assert capsys.readouterr().err.splitlines()[-1] == said


def test_an_interrupt_that_python_drops_comes_once_more(tmp_path, capsys, pipeline):
    class Cleared:
        def __del__(self):
            raise KeyboardInterrupt

    def interrupted(*_, **__):
        Cleared()
        for _ in range(500):
            time.sleep(0.01)

    pipeline(interrupted)
    start = time.monotonic()
    assert cli.main(["run", str(CASE), "-o", str(tmp_path / "out")]) == 130
    assert time.monotonic() - start < 4.0 and "ignored" not in capsys.readouterr().err


def _diverge(*_, **__):
    raise ConvergenceError("no solution at 1 rpm", code="E-CONVERGENCE")


def _terminate(*_, **__):
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(10)


def _exhaust(*_, **__):
    np.empty(2**50)


def _crowd(*_, **__):
    raise RuntimeError("can't start new thread")


def _differ(*_, **__):
    np.linalg.cholesky(-np.eye(2))


def _lack(*_, **__):
    raise ImportError("No module named 'h5py'")


def _fill(*_, **__):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "static.nc")


@pytest.mark.parametrize(
    ("function", "code", "words"),
    [
        (_diverge, 3, "no solution"),
        (_exhaust, 3, "E-MEMORY"),
        (_crowd, 3, "E-MEMORY"),
        (_differ, 3, "E-SOLVE"),
        (_lack, 5, "E-LIBRARY"),
        (interrupted_run, 130, "interrupted"),
        (_terminate, 130, "interrupted"),
        (_fill, 4, "E-DISK-FULL"),
    ],
)
def test_exit_codes(tmp_path, capsys, pipeline, function, code, words):
    pipeline(function)
    assert cli.main(["run", str(CASE), "-o", str(tmp_path / "out")]) == code
    printed = capsys.readouterr()
    assert words in printed.err and "Traceback" not in printed.err
    # what an interrupted run leaves behind does not stand in the way of the next
    pipeline(fake_run)
    assert cli.main(["run", str(CASE), "-o", str(tmp_path / "out"), "--only", "static"]) == 0


@pytest.mark.parametrize("columns", ["", "0", "1", "02"])
def test_terminals_without_columns_have_a_help(columns, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", columns)
    assert cli.main(["new", "--help"]) == 0
    assert "--teeth STR" in capsys.readouterr().out
