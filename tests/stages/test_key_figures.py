"""Numbers of files by which cases are compared: which one is read, how it is asked for, how a change is written."""

import math
import pickle

import numpy as np
import pytest
import xarray as xr

from femgear.findings import DOUBT, NOTE, Finding
from femgear.stages.key_figures import DECIBEL, NUMBER, KeyFigure, Stored, figure_of

DATA = xr.Dataset(
    {
        "slope": (("load_case", "mesh"), [[1.0, -5.0, np.nan], [3.0, 2.0, np.nan]]),
        "level": (("speed", "sensor"), [[1e-3, 2e-3], [1e-2, 0.0]]),
    },
    coords={"mesh": ["a", "b", "c"], "sensor": ["top", "side"]},
)


@pytest.mark.parametrize(
    ("stored", "number"),
    [
        (Stored("slope"), 3.0),
        (Stored("slope", pick="size"), 5.0),
        (Stored("slope", pick="smallest", factor=10.0), -50.0),
        (Stored("slope", "mesh", ("a",)), 3.0),
        (Stored("slope", "mesh", ("b", "c"), "size"), 5.0),
        (Stored("level", "sensor", ("top",), decibel=True), 80.0),
        (Stored("level", "sensor", ("side",)), 2e-3),
    ],
)
def test_the_extreme_of_a_variable_and_of_its_parts(stored, number):
    assert pickle.loads(pickle.dumps(stored))(DATA) == pytest.approx(number, rel=1e-12)


def test_nothing_is_no_number():
    assert all(math.isnan(stored(DATA)) for stored in (Stored("slope", "mesh", ("c",)), Stored("none")))
    assert math.isnan(Stored("level", decibel=True)(DATA * 0.0))


def test_names_are_found_as_written_before_other_capitals():
    figures = [KeyFigure(name, NUMBER, "s", Stored("slope")) for name in ("force A", "force a", "K_Hbeta")]
    asked = {"force a": "force a", "force  A": "force A", "k_hbeta": "K_Hbeta", "FORCE A": "force A"}
    assert {words: figure_of(figures, words).name for words in asked} == asked
    assert figure_of(figures, "force") is None


def test_changes_and_findings():
    figure = KeyFigure("a", NUMBER, "s", Stored("slope"), ("W-PULL",))
    assert figure.change(2.0, 3.0) == "+50 %" and figure.change(0.0, 3.0) == "" and figure.show(2.0) == "2"
    assert KeyFigure("b", DECIBEL, "s", Stored("level")).change(80.0, 77.5) == "-2.50 dB"
    findings = [Finding(code, "", "", severity=kind) for code in ("W-PULL", "W-TAIL") for kind in (NOTE, DOUBT)]
    assert [finding.code for finding in figure.concerned(findings)] == ["W-PULL"]
    assert len([*KeyFigure("c", NUMBER, "s", Stored("slope")).concerned(findings)]) == 2
