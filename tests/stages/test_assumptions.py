"""The level with half and twice of what a case assumes."""

import numpy as np
import pytest

import femgear
from femgear.report.tables import Marks
from femgear.stages.assumptions import (
    FACTORS,
    Assumption,
    AssumptionsResult,
    assumed,
    assumption_rows,
    describe_assumptions,
    draw_assumptions,
    level_change,
    scaled,
)
from femgear.trains.reading import read_case, with_values

COARSE = {
    "static.positions": 8,
    "static.flank_elements": 6,
    "static.stresses": False,
    "dynamics.up_to": "4 kHz",
    "operation.speeds": ["900 rpm"],
}
DAMPING = Assumption("damping", ("dynamics.damping_ratio",))
SUPPORTS = Assumption("supports", ("sun.support_stiffness", "carrier.support_stiffness"))


@pytest.fixture(scope="module")
def case():
    return with_values(read_case("cases/planetary_27_40_108.toml"), COARSE)


@pytest.fixture(scope="module")
def result(case):
    return femgear.solve(case, "assumptions")["assumptions"]


@pytest.fixture
def given():
    known = np.array([[[4.0, 1.0], [2.0, 3.0]], [[8.0, 2.0], [4.0, 4.0]]])
    return AssumptionsResult((DAMPING, SUPPORTS), np.array([90.0, 130.0]), np.array([2.0, 4.0]), known)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "factor", "changes"),
    [
        ("damping", 0.5, {"dynamics.damping_ratio": 0.025}),
        pytest.param("bearings of the planets", 2.0, {"planet.bearing_stiffness": "6e8 N/m"}, marks=pytest.mark.slow),
    ],
)
def test_a_changed_level_is_that_of_a_run_with_the_changed_entry(case, result, name, factor, changes):
    housing = femgear.solve(with_values(case, changes), "housing")["housing"].dataset()
    data = result.dataset()
    found = data["changed_level"].sel(assumption=name, factor=factor)
    assert found.values == pytest.approx(housing["level"].values, rel=1e-9, abs=0)
    assert np.abs(found.values / data["assumed_level"].values - 1.0).min() > 1e-3


@pytest.mark.slow
def test_the_level_itself_is_that_of_the_housing(case, result):
    level = femgear.solve(case, "housing")["housing"].dataset()["level"].values
    assert result.level == pytest.approx(level, rel=1e-12, abs=0)
    # damping bounds resonances: less of it is louder
    change = level_change(result.dataset())
    assert change.shape == (1, 4, 2) and (change[:, 0, 0] > 0.0).all() and (change[:, 0, 1] < 0.0).all()


def test_what_a_case_has_not_is_left_out(case):
    assert assumed(case, [DAMPING, SUPPORTS]) == (DAMPING, SUPPORTS)
    loose = with_values(case, {"sun.support_stiffness": "0 N/m"})
    assert assumed(loose, [SUPPORTS]) == (Assumption("supports", ("carrier.support_stiffness",)),)
    assert assumed(with_values(case, {"dynamics.damping_ratio": 0.0}), [DAMPING]) == ()
    assert assumed(with_values(case, {"dynamics.damping_ratio": 0.6}), [DAMPING]) == ()


def test_entries_are_scaled_together_and_the_case_stays(case):
    twice = scaled(case, SUPPORTS, FACTORS[1])
    assert twice.sun.support_stiffness == 2.0 * case.sun.support_stiffness
    assert twice.carrier.support_stiffness == 2.0 * case.carrier.support_stiffness
    assert twice.planet == case.planet and case.sun.support_stiffness == 5e7


def test_table_row_and_picture_have_every_change(given):
    data = given.dataset()
    block = describe_assumptions(data)
    assert [row[0] for row in block.rows] == ["damping", "supports"]
    assert block.rows[0][2:] == ("+6.0", "-6.0", "+6.0", "-6.0") and block.rows[1][2:] == (
        "+0.0",
        "+3.5",
        "+0.0",
        "+0.0",
    )

    class Results:
        stages, assumptions = ("assumptions",), data

    (row,) = assumption_rows(Results, Marks(()))
    assert row[1] == "damping +6.0 and -6.0 dB; supports +0.0 and +0.0 dB"
    figure = draw_assumptions(data)
    bars = [bar.get_width() for bar in figure.axes[0].patches]
    # of the loudest speed, the most decisive on top
    assert sorted(bars) == pytest.approx(sorted(level_change(data)[1].ravel()))
    assert [text.get_text() for text in figure.axes[0].get_yticklabels()] == ["supports", "damping"]


def test_a_run_has_the_stage_where_it_is_asked_for(case):
    assert "assumptions" not in [stage.name for stage in femgear.trains.registry.stages_of(case)]
    asked = with_values(case, {"housing.assumptions": True})
    assert "assumptions" in [stage.name for stage in femgear.trains.registry.stages_of(asked)]
