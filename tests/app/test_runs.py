"""Runs, comparisons, new cases and imports, as the app asks for them."""

import re
from pathlib import Path

import pytest

from femgear.app.runs import COMPARED, Runs
from femgear.errors import FemgearError
from femgear.trains.reading import open_results

CASES = Path(__file__).parents[2] / "cases"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("runs")


@pytest.fixture(scope="module")
def text(folder):
    """A pair without teeth, and without what takes long."""
    long = re.compile(r"^\[(chaos|sweep)\]\n(?:[^\[\n].*\n|\n)*", re.MULTILINE)
    return long.sub("", (CASES / "gear_pair.toml").read_text("utf-8"))


@pytest.mark.slow
def test_runs_are_those_of_the_command_and_tell_how_far_they_are(folder, text):
    told = []
    runs = Runs(folder, tell=told.append)
    data = runs.run(text, "a.toml", "one", False)
    assert data["complete"] and open_results(folder / "one").manifest.complete
    assert (folder / "one" / "report.html").exists()
    assert told[-1]["done"] == told[-1]["total"] and {"stage", "done", "total"} == {*told[0]}
    with pytest.raises(FemgearError):
        runs.run(text, "a.toml", "one", False)
    assert any(name.endswith(".csv") for name in runs.export("one", ["csv"])) and list(
        folder.glob("one/exported/*.csv")
    )
    runs.run(text, "a.toml", "two", False)
    assert runs.compare("one", "two") == f"one_and_two/{COMPARED}" and (folder / "one_and_two" / COMPARED).exists()


def test_a_file_that_is_no_rexs_is_refused(folder):
    (folder / "model.rexs").write_text("<nothing/>")
    with pytest.raises(FemgearError):
        Runs(folder).imported(str(folder / "model.rexs"), "box")
