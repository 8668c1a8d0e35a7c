"""Fixtures of the benchmarks, and the table that a run of them prints or writes."""

import os
import sys
from pathlib import Path
from time import process_time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.extend(str(Path(__file__).parents[1] / name) for name in ("benchmarks", "scripts", "tests", "."))

import pytest
from table import page, rows_of


def pytest_addoption(parser):
    parser.addoption("--page", type=Path, help="write the table to this Markdown file")


@pytest.fixture(scope="session", autouse=True)
def one_thread():
    from femgear.stages.protocol import one_blas_thread

    with one_blas_thread():
        yield


@pytest.fixture(autouse=True)
def one_process_where_its_time_counts(request, monkeypatch):
    """Time of the process knows nothing of a second one: what is measured by it is computed in one."""
    from femgear import second_process

    mark = request.node.get_closest_marker("benchmark")
    if mark is not None and mark.kwargs.get("timer") is process_time:
        monkeypatch.setattr(second_process, "second_core", lambda: False)


@pytest.fixture(scope="session")
def reference():
    from stages import Reference

    return Reference()


def pytest_terminal_summary(terminalreporter, config):
    session = getattr(config, "_benchmarksession", None)
    rows = rows_of(session.benchmarks) if session else []
    if not rows:
        return
    text = page(rows)
    terminalreporter.write_line("")
    terminalreporter.write_line(text)
    if config.option.page:
        config.option.page.write_text(text, encoding="utf-8")
