"""From which size on faults stand out: levels of made lines, and a command on a coarse set."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.housing.sensor import SensorLines
from femgear.run import grid_cache
from femgear.study import fault_limits
from femgear.study.fault_limits import (
    NEW_LINES,
    FaultLimit,
    describe_limits,
    draw_limits,
    fault_limits_into,
    limit_faults,
    line_levels,
    standing_out,
)
from femgear.study.fault_records import fault_plan
from femgear.study.fault_request import FaultRequest
from femgear.trains.reading import read_case, with_values

pytestmark = pytest.mark.usefixtures("coarse_states")

CASES = Path(__file__).parents[2] / "cases"
WHOLE, BETWEEN = NEW_LINES
GEARS = SimpleNamespace(rotations=3, ring=SimpleNamespace(teeth=108))


def made(orders, accelerations):
    order = np.array(orders, float)
    displacement = -np.array([accelerations], complex) / np.where(order > 0, order, 1.0) ** 2
    return SensorLines(order, displacement, np.array([1.0]), 0.0, 108, "exact", 1)


def test_levels_are_those_of_the_lines():
    levels = line_levels(made([0, 105, 108, 108.5, 109, 216], [9.0, 3.0, 4.0, 0.1, 0.5, 12.0]), GEARS, 1e-6)
    together = np.sqrt(9 + 16 + 0.01 + 0.25 + 144)
    assert levels["mesh 1"] == pytest.approx(20 * np.log10(5.0 / together))
    assert levels["mesh 2"] == pytest.approx(20 * np.log10(12.0 / together))
    assert levels[WHOLE] == pytest.approx(20 * np.log10(0.5 / together))
    assert levels[BETWEEN] == pytest.approx(20 * np.log10(0.1 / together))


def test_lines_below_the_noise_are_none():
    levels = line_levels(made([108, 109], [1.0, 1e-6]), GEARS, 1e-3)
    assert levels[WHOLE] == levels[BETWEEN] == pytest.approx(-60.0)


def test_a_set_stands_out_by_what_healthy_ones_have_not():
    none = {BETWEEN: -60.0, "mesh 1": -1.0}
    healthy = [none | {"mesh 2": -9.0, WHOLE: -50.0}, none | {"mesh 2": -8.0, WHOLE: -46.0}]
    assert standing_out(healthy[0] | {WHOLE: -40.0}, healthy) == (6.0, WHOLE)
    assert standing_out(healthy[0] | {BETWEEN: -50.0}, healthy) == (10.0, BETWEEN)
    assert standing_out(healthy[0] | {"mesh 2": -5.0}, healthy) == (2.0, "mesh 2")
    assert standing_out(healthy[0] | {"mesh 2": -13.0}, healthy) == (3.0, "mesh 2")
    excess, _ = standing_out(healthy[0], healthy)
    assert excess <= 0.0


def test_the_least_size_is_that_from_which_on_all_stand_out():
    size = np.array([1e-4, 2e-4, 4e-4])
    limits = [
        FaultLimit("crack", "sun", size, np.array(excess), ("mesh 1",) * 3) for excess in ([1, -1, 2], [1, 2, -1])
    ]
    assert limits[0].least == 4e-4
    assert np.isnan(limits[1].least)
    rows = describe_limits(limits).rows
    assert rows[0][3] == "0.4"
    assert rows[1][3] == "none of these"
    assert len(draw_limits(limits).axes) == 1


@pytest.fixture(scope="module")
def plan():
    coarse = {"static.flank_elements": 8, "static.positions": 8, "dynamics.up_to": "2 kHz"}
    case = with_values(read_case(CASES / "planetary_27_40_108.toml"), coarse)
    request = FaultRequest(kinds=("wear",), gears=("sun",), sizes=("wear=1 um..30 um",), duration="0.5 s")
    return fault_plan(case, request, CASES / "tolerances" / "still.toml", cache=grid_cache())


def test_faults_are_those_of_all_kinds_and_sizes(plan):
    faults = limit_faults(plan, 3)
    assert [fault.size for fault in faults] == pytest.approx([1e-6, 30e-6**0.5 * 1e-3, 30e-6], rel=1e-5)
    assert {fault.tooth for fault in faults} == {-1}


def test_limits_are_written_and_taken_up_again(plan, tmp_path, monkeypatch):
    monkeypatch.setattr(fault_limits, "HEALTHY_SETS", 2)
    (block,), names = fault_limits_into(plan, tmp_path, 1)
    assert block.rows[0][:2] == ("wear", "sun")
    assert all((tmp_path / name).exists() for name in names)

    def never(*_, **__):
        raise AssertionError

    monkeypatch.setattr(fault_limits, "solved_lines", never)
    assert fault_limits_into(plan, tmp_path, 1)[0][0].rows == block.rows


def test_drawn_errors_are_needed(plan, tmp_path):
    with pytest.raises(CaseError) as caught:
        fault_limits_into(SimpleNamespace(model=None), tmp_path, 1)
    assert caught.value.key == "--tolerances"
