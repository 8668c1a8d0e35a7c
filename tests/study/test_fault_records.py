"""Records of drawn machines: the same alone, those of a run of their case, and what is refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.run import grid_cache, solve
from femgear.study.fault_records import (
    fault_plan,
    longest_first,
    machine_case,
    machine_times,
    record_case,
    solve_machine,
)
from femgear.study.fault_request import FaultRequest
from femgear.trains.reading import parse_case, read_case, with_values

pytestmark = pytest.mark.usefixtures("coarse_states")

CASES = Path(__file__).parents[2] / "cases"
STILL = CASES / "tolerances" / "still.toml"
SHORT = {"each": 2, "seed": 7, "duration": "0.05 s", "gears": ("planet",)}


@pytest.fixture(scope="module")
def case():
    coarse = {"static.flank_elements": 8, "static.positions": 8, "dynamics.up_to": "2 kHz"}
    return with_values(read_case(CASES / "planetary_27_40_108.toml"), coarse)


@pytest.fixture(scope="module")
def plan(case):
    return fault_plan(case, FaultRequest(kinds=("healthy,wear",), **SHORT), STILL, cache=grid_cache())


@pytest.fixture(scope="module")
def worn(plan):
    return solve_machine(plan, 1)


def test_a_machine_is_the_same_alone(case, plan, worn):
    alone = fault_plan(case, FaultRequest(kinds=("healthy,wear",), **SHORT), STILL, cache=grid_cache())
    again = solve_machine(alone, 1)
    assert alone.fingerprint == plan.fingerprint
    assert again.fault == worn.fault
    assert np.array_equal(again.signal, worn.signal)
    assert np.array_equal(again.lines.displacement, worn.lines.displacement)


def check_same(run, lines, share):
    """Lines of a run at the second speed; of the machine's speeds another one may reach higher orders."""
    ours, count = lines.acceleration[1], len(run.order)
    assert np.array_equal(run.order, lines.order[:count])
    assert not ours[count:].any()
    assert np.abs(run.acceleration[0] - ours[:count]).max() < share * np.abs(ours).max()


def test_a_record_is_that_of_a_run_of_its_case(plan, worn):
    assert not worn.error
    run = solve(parse_case(record_case(plan, 3), name="record.toml"), "housing")["housing"].exact
    check_same(run, worn.lines, 1e-9)


@pytest.mark.slow
def test_a_cracked_machine_is_the_same_alone(case):
    signals, request = [], FaultRequest(kinds=("healthy", "crack"), **SHORT | {"gears": ("sun",)})
    for machines in ((0, 1), (1,)):  # after another one, and alone
        plan = fault_plan(case, request, STILL, cache=grid_cache())
        signals.append([solve_machine(plan, machine).signal for machine in machines][-1])
    assert np.isfinite(signals[0]).all()
    assert np.array_equal(*signals)


def test_speeds_of_a_machine_are_never_rounded_to_one(case):
    """Of 20 speeds within 2 rpm some are alike to six figures."""
    request = FaultRequest(kinds=("healthy",), seed=7, each=20, speeds=("1000 rpm", "1002 rpm"))
    assert len(set(machine_case(fault_plan(case, request, cache=grid_cache()), 0)[0].operation.speeds)) == 20


@pytest.mark.slow
def test_a_record_of_a_pit_is_that_of_a_run_of_its_case(case):
    request = FaultRequest(kinds=("spall",), **SHORT | {"gears": ("sun",)})
    plan = fault_plan(case, request, STILL, cache=grid_cache())
    records = solve_machine(plan, 0)
    run = solve(parse_case(record_case(plan, 1), name="record.toml"), "housing")["housing"].exact
    check_same(run, records.lines, 1e-6)


def test_the_signal_is_the_lines_and_the_noise(plan, worn):
    lines, time = worn.lines, np.arange(plan.samples) / plan.rate
    phase = lines.order[:, None] * (lines.base_speed[0] * time + worn.angle[0])
    heard = (lines.acceleration[0][:, None] * np.exp(1j * phase)).real.sum(axis=0)
    noise = worn.signal[0] - heard
    assert np.sqrt(np.mean(noise**2)) == pytest.approx(10**-1.5 * np.sqrt(np.mean(heard**2)), rel=0.1)


def test_kinds_come_in_turn_and_draws_differ(plan):
    cases, faults, errors = zip(*(machine_case(plan, machine) for machine in range(4)), strict=True)
    assert [fault.kind for fault in faults] == ["healthy", "wear"] * 2
    assert len({case.operation.torque for case in cases}) == 4
    assert len({speed for case in cases for speed in case.operation.speeds}) == 8
    assert len({error.tobytes() for error in errors}) == 4
    assert all(50.0 <= case.operation.torque <= 100.0 for case in cases)


@pytest.mark.decisive
def test_machines_that_take_longest_are_begun_first(case):
    plan = fault_plan(case, FaultRequest(count=80, each=2, seed=3, duration="0.05 s"), cache=grid_cache())
    order = longest_first(machine_times(plan, range(40)))
    assert sorted(order) == list(range(40))
    faults = [machine_case(plan, machine)[1] for machine in order]
    rings = [fault.kind == "crack" and fault.gear == "ring" for fault in faults]
    assert any(rings) and rings == sorted(rings, reverse=True)
    kinds = [fault.kind for fault in faults if fault.kind != "crack"]
    assert list(dict.fromkeys(kinds))[:3] == ["missing", "broken corner", "spall"]
    assert set(kinds[-8:]) == {"healthy", "wear"}


def test_noise_may_be_none(case):
    plan = fault_plan(case, FaultRequest(kinds=("healthy",), noise="none", **SHORT), cache=grid_cache())
    assert plan.noise == 0.0
    assert plan.model is None


def test_the_end_of_the_forces_is_that_of_the_case_unless_another_one_is_given(case):
    of_case = with_values(case, {"dynamics.up_to": None, "dynamics.mesh_harmonics": 5})
    request = FaultRequest(kinds=("healthy",), **SHORT)
    dynamics = fault_plan(of_case, request, cache=grid_cache()).case.dynamics
    assert (dynamics.mesh_harmonics, dynamics.up_to) == (5, None)
    dynamics = fault_plan(of_case, replace(request, up_to="2 kHz"), cache=grid_cache()).case.dynamics
    assert (dynamics.mesh_harmonics, dynamics.up_to) == (None, 2000.0)


@pytest.mark.parametrize(
    ("values", "request_", "code"),
    [
        ({"operation.fixed": "carrier"}, {}, "E-FIXED-MEMBER"),
        ({"sun.fault": [{"kind": "missing", "tooth": 1}]}, {}, "E-FAULT"),
        ({"operation.torque": "0 N m"}, {}, "E-NO-LOAD"),
        ({}, {"noise": "-30"}, "E-RANGE"),
        ({}, {"noise": "loud dB"}, "E-RANGE"),
        ({}, {"speeds": ("900 rpm", "-900 rpm")}, "E-RANGE"),
        ({}, {"torques": ("100 N m", "9 N m")}, "E-RANGE"),
        ({}, {"torques": ("1 rpm", "9 N m")}, "E-UNIT"),
        ({}, {"count": 0}, "E-RANGE"),
        ({}, {"kinds": ("creak",)}, "E-CHOICE"),
        ({}, {"duration": "1 h"}, "E-RANGE"),
        ({}, {"kinds": ("crack",), "sizes": ("crack=1 mm..50 mm",)}, "E-RANGE"),
        ({}, {"kinds": ("wear",), "sizes": ("wear=1 um..5 mm",)}, "E-RANGE"),
    ],
)
def test_what_cannot_be_recorded_is_refused(case, values, request_, code):
    with pytest.raises(CaseError) as caught:
        fault_plan(with_values(case, values), FaultRequest(**request_))
    assert caught.value.code == code


def test_bolted_rings_are_refused():
    with pytest.raises(CaseError) as caught:
        fault_plan(read_case(CASES / "on_six_bolts.toml"), FaultRequest())
    assert caught.value.key.startswith("housing.")
