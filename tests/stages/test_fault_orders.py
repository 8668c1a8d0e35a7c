"""Orders of faults of single teeth: closed numbers of a set, and lines of a signal that is made of its turns."""

import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.stages.fault_orders import describe_fault_orders, makes_new_lines, need_fixed_ring, sun_line_step
from femgear.trains.drafts import ToothForm, new_case
from femgear.trains.reading import parse_case, read_case, with_values

CASES = Path(__file__).parents[2] / "cases"
GEARS = "sun", "planet", "ring"


def gear_set(sun, planet, ring, planets):
    """Teeth alone, of equal planets."""
    gears = {name: SimpleNamespace(teeth=teeth) for name, teeth in zip(GEARS, (sun, planet, ring), strict=True)}
    return SimpleNamespace(**gears, rotations=planets, n_planets=planets)


def test_frequencies_of_a_set_are_the_known_ones():
    numbers = {"teeth": (17, 37, 91), "module": "2 mm", "speed": "800 rpm", "planets": 3, "torque": None}
    case = parse_case(new_case("planetary", **numbers, face_width=None, form=ToothForm()), name="set.toml")
    (block,) = describe_fault_orders(case)
    found = {row[0]: float(row[1]) for row in block.rows}
    expected = {"carrier": 2.0988, "mesh": 190.99, "a tooth of the sun": 33.70, "a tooth of the planet": 5.162}
    for name, hertz in expected.items():
        assert found[name] == pytest.approx(hertz, rel=2e-4)


@pytest.mark.parametrize(
    "teeth", [(24, 24, 72, 4), (27, 40, 108, 3), (18, 27, 72, 3), (20, 40, 100, 4), (17, 37, 91, 3), (28, 36, 100, 4)]
)
def test_lines_of_the_sun_are_those_of_a_signal_made_of_turns(teeth):
    sun, planet, ring, planets = teeth
    angles = 2 * np.pi * np.arange(planets) / planets
    turns = sun // math.gcd(sun, ring)  # of the carrier, after which all repeats
    carrier = 2 * np.pi * np.arange(1 << 14) / (1 << 14) * turns
    against = carrier * (ring / sun)  # turns of the sun against the carrier

    def pulse(angle, width):
        return np.exp((np.cos(angle) - 1.0) / width)

    heard = sum(pulse(against - psi, 0.05) * pulse(carrier + psi - 0.3, 0.5) for psi in angles)
    lines = np.abs(np.fft.rfft(heard))[: 40 * turns]
    there = np.flatnonzero(lines > 1e-6 * lines.max())
    step = np.gcd.reduce(there[there > 0]) / turns
    assert sun_line_step(gear_set(sun, planet, ring, planets)) == pytest.approx(step)


def test_what_no_new_line_tells():
    assert not makes_new_lines(gear_set(24, 24, 72, 4), "sun")
    assert makes_new_lines(gear_set(24, 24, 72, 4), "planet")
    for gears in (gear_set(24, 24, 72, 4), gear_set(27, 40, 108, 3)):
        assert not makes_new_lines(gears, "ring")
    assert makes_new_lines(gear_set(27, 40, 108, 3), "sun")


def test_the_table_tells_both(capsys):
    (block,) = describe_fault_orders(read_case(CASES / "planetary_27_40_108.toml"), speed=100.0)
    shows = {row[0]: row[-1] for row in block.rows}
    assert shows["a tooth of the sun"] == "new lines"
    assert shows["a tooth of the ring"].startswith("no new lines")


def test_sets_whose_ring_turns_are_refused():
    case = with_values(read_case(CASES / "planetary_27_40_108.toml"), {"operation.fixed": "carrier"})
    with pytest.raises(CaseError) as caught:
        need_fixed_ring(case)
    assert caught.value.code == "E-FIXED-MEMBER"
