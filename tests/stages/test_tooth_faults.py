"""What is said of faults of teeth."""

from pathlib import Path

import pytest

from femgear.stages.tooth_faults import fault_findings, sun_fault_step
from femgear.trains.reading import read_case, with_values
from validation.planetary import reference_set

CASES = Path(__file__).parents[2] / "cases"
WEAR = {"kind": "wear", "tooth": 3, "depth": "5 um"}


@pytest.fixture(scope="module")
def healthy():
    return read_case(CASES / "planetary_27_40_108.toml")


def texts(case):
    return [str(finding) for finding in fault_findings(case)]


def test_a_whole_set_has_nothing_to_say(healthy):
    assert texts(healthy) == []


def test_faults_say_what_is_left_out(healthy):
    spall = {"kind": "spall", "tooth": 3, "flank": "left", "diameter": "42 mm", "length": "1 mm", "depth": "40 um"}
    (said,) = texts(with_values(healthy, {"sun.fault": [spall]}))
    assert said.startswith("[W-FAULT] sun.fault[0]: a pit that only separates flanks")


def test_a_fault_on_an_idle_flank_is_told(healthy):
    right, left = ({"sun.fault": [WEAR | {"flank": flank}]} for flank in ("right", "left"))
    assert texts(with_values(healthy, left)) == []
    (said,) = texts(with_values(healthy, right))
    assert "carries nothing" in said
    backwards = {"operation.torque": "-100 N m"}
    assert texts(with_values(healthy, right | backwards)) == []
    assert len(texts(with_values(healthy, left | backwards))) == 1


def test_a_fault_of_the_ring_makes_no_new_lines(healthy):
    (said,) = texts(with_values(healthy, {"ring.fault": [WEAR | {"flank": "left"}]}))
    assert "no new lines" in said


@pytest.mark.parametrize(("sun", "planet", "ring", "planets", "step"), [(24, 24, 72, 4, 4.0), (27, 40, 108, 3, 1.0)])
def test_lines_of_a_faulty_sun_tooth_lie_at_multiples_of_a_step(sun, planet, ring, planets, step):
    gears = reference_set()
    if (sun, planets) != (27, 3):
        from types import SimpleNamespace

        gears = SimpleNamespace(gears=[SimpleNamespace(teeth=z) for z in (sun, planet, ring)], n_planets=planets)
    assert sun_fault_step(gears) == pytest.approx(step)
