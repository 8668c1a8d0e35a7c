"""What a handle takes to answer after a change, beside a fresh computation in the same run."""

from itertools import count
from time import process_time

import pytest

GROUP = "Answers after a change: static solution, dynamics and lines of the housing at 50 speeds (reference set)"
# time of one process on one core: what else the machine does must not count
pytestmark = pytest.mark.benchmark(group=GROUP, timer=process_time)
SPEEDS = {"to": "3000 rpm", "count": 50}
RELIEF = {"kind": "tip relief", "start_diameter": "43 mm"}
BOLT = {"radial_stiffness": "2e8 N/m", "tangential_stiffness": "2e8 N/m"}
BOLTS = [BOLT | {"angle": f"{60 * i} deg"} for i in range(6)]
# by what is changed, the entries as they are in the n-th change, never the same twice
CHANGES = {
    "damping": lambda n: {"dynamics.damping_ratio": 0.04 + 1e-4 * n},
    "speeds": lambda n: {"operation.speeds": {"from": f"{300 + n} rpm", **SPEEDS}},
    "mass of the carrier": lambda n: {"carrier.mass": f"{2 + 0.01 * n} kg"},
    "support of the sun": lambda n: {"sun.support_stiffness": f"{4e7 + 1e5 * n} N/m"},
    "torque": lambda n: {"operation.torque": f"{90 + 0.1 * n} N m"},
    "tip relief": lambda n: {"sun.modifications": [RELIEF | {"amount": f"{4 + 0.01 * n} um"}]},
    "pin error": lambda n: {"set.pin_errors": [{"planet": 1, "tangential": f"{4 + 0.01 * n} um"}]},
    "tip of the planet (new teeth)": lambda n: {"planet.tip_diameter": f"{62.9 - 0.001 * n} mm"},
}
# what keeps the set as it was for the changes that follow
BACK = {"tip relief": {"sun.modifications": None}, "pin error": {"set.pin_errors": None}}
LIMITS = dict.fromkeys(
    ("damping", "speeds", "mass of the carrier", "support of the sun", "torque", "tip relief", "pin error"), 0.15
)
LIMITS["tip of the planet (new teeth)"] = 1.0
"""CPU [s] that the project promises."""
STAGES = ("static", "modes", "dynamics", "housing")


@pytest.fixture(scope="module")
def case():
    from femgear.trains.reading import read_case, with_values

    speeds = {"operation.speeds": {"from": "300 rpm", **SPEEDS}, "housing.published": None}
    return with_values(read_case("cases/planetary_27_40_108.toml"), speeds)


@pytest.fixture(scope="module")
def handle(case):
    import femgear

    found = femgear.live(case)
    lines(found.answer)
    return found


def lines(answer):
    """Static solution and lines at all speeds, without tables and verdicts on stability."""
    assert len(answer.static.cycle.position) >= 64
    return answer.housing.exact.displacement


def record(benchmark, title, note, limit=None):
    benchmark.extra_info.update(title=title, note=note, limit=limit)


def test_fresh(benchmark, case):
    from femgear.case.dependencies import Steps
    from femgear.run import grid_cache
    from femgear.trains.live import Answer

    found = benchmark.pedantic(lambda: lines(Answer(case, Steps(), cache=grid_cache())), rounds=5)
    assert len(found) == 50
    record(benchmark, "nothing known, grids cached", "static solution, modes, response, lines")


@pytest.mark.parametrize("name", CHANGES)
def test_change(benchmark, handle, name):
    numbers = count(1)
    found = benchmark.pedantic(lambda: lines(handle.change(CHANGES[name](next(numbers)))), rounds=5, warmup_rounds=1)
    assert len(found) == 50
    new = ", ".join(stage for stage in STAGES if handle.changed[stage])
    if name in BACK:
        handle.change(BACK[name])
    record(benchmark, f"changed: {name}", f"anew: {new}", LIMITS.get(name))


def test_damping_on_bolts(benchmark, case):
    """In a housing that stands still: its response takes what it takes, the rest is kept."""
    import femgear

    speeds = {"from": "1000 rpm", "to": "3000 rpm", "count": 5}
    handle = femgear.live(case)
    lines(handle.change({"housing.support": BOLTS, "operation.speeds": speeds}))
    numbers = count(1)
    found = benchmark.pedantic(
        lambda: lines(handle.change({"dynamics.damping_ratio": 0.04 + 1e-4 * next(numbers)})), rounds=2
    )
    assert len(found) == 5
    record(benchmark, "changed: damping, on six bolts, 5 speeds", "anew: modes, dynamics, housing")
