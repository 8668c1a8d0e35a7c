"""Orders of the faults of single teeth, and which of them make no line that a whole set has not."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from femgear.case.gear_set import need_set, planetary_set
from femgear.errors import CaseError
from femgear.gears.kinematics import speeds
from femgear.report.tables import Block
from femgear.stages.tooth_faults import fault_frequencies

if TYPE_CHECKING:
    from femgear.gears.planetary import PlanetarySet

NEW, UNSEEN = "new lines", "no new lines: levels alone tell"
_WHOLE = 1e-9


def need_fixed_ring(case: Any) -> PlanetarySet:
    """Give the gears of a set whose ring stands still; refuse others (CaseError, E-MODEL, E-FIXED-MEMBER)."""
    need_set(case)
    if case.operation.fixed != "ring":
        message, remedy = "a sensor beside the ring hears carrier orders where the ring stands still", "fix the ring"
        raise CaseError(message, code="E-FIXED-MEMBER", key="operation.fixed", limit='"ring"', remedy=remedy)
    return planetary_set(case)


def makes_new_lines(gears: PlanetarySet, gear: str) -> bool:
    """Tell whether a faulty tooth of sun, planet or ring makes lines where a whole set has none.

    With g turns that map the planets on one another a whole set has multiples of g orders. A faulty tooth of the sun
    has multiples of ``gcd(g, g m (z_s + z_r)/(g z_s))`` over all m, one of a planet all ``q + m z_r/z_p``, and one of
    the ring, which stands still, those of the whole set.
    """
    if gear == "ring":
        return False
    if gear == "planet":
        return gears.n_planets > 1 or gears.ring.teeth % gears.planet.teeth != 0
    return abs(sun_line_step(gears) % gears.rotations) > _WHOLE


def sun_line_step(gears: PlanetarySet) -> float:
    """Find the carrier orders of whose multiples a faulty sun tooth makes lines.

    ``g gcd((z_s + z_r)/g, z_s)/z_s`` for a set that g turns map on itself, see
    `femgear.stages.tooth_faults.sun_fault_step`.
    """
    sun, both, turns = gears.sun.teeth, gears.sun.teeth + gears.ring.teeth, gears.rotations
    return math.gcd(both, turns * sun) / sun if both % turns else turns * math.gcd(both // turns, sun) / sun


def describe_fault_orders(case: Any, speed: float | None = None) -> Iterator[Block]:
    """Tabulate orders and frequencies of faulty teeth at a speed of the input [rad/s], by default the first.

    CaseError: as `need_fixed_ring`.
    """
    gears = need_fixed_ring(case)
    speed = float(case.operation.speeds[0] if speed is None else speed)
    turning = speeds(gears, input=case.operation.input, fixed=case.operation.fixed, speed=speed)
    carrier, mesh, ring = abs(turning.carrier) / (2.0 * math.pi), turning.mesh_frequency, gears.ring.teeth
    meets, g = fault_frequencies(gears, mesh), gears.rotations
    rows = [
        ("carrier", carrier, 1.0, f"{g} q" if g > 1 else "q", "a whole set"),
        ("mesh", mesh, float(ring), f"{ring} m", "a whole set"),
    ]
    places = {
        "sun": f"multiples of {sun_line_step(gears):.6g}",
        "planet": f"q + {ring / gears.planet.teeth:.6g} m",
        "ring": f"{g} q" if g > 1 else "q",
    }
    for name, text in places.items():
        seen = NEW if makes_new_lines(gears, name) else UNSEEN
        rows.append((f"a tooth of the {name}", meets[name], meets[name] / carrier, text, seen))
    table = tuple((name, f"{hertz:.6g}", f"{order:.6g}", text, seen) for name, hertz, order, text, seen in rows)
    equal = g == gears.n_planets
    often = "" if equal else ", as often as this on average: the planets do not stand at equal angles"
    notes = (
        f"a tooth of sun or ring meets any of the planets{often}; one of a planet meets the sun",
        "orders: of the carrier, as a sensor beside the ring hears them, with planets alike; q and m are whole numbers",
    )
    yield Block("Orders of faults", ("what", "frequency [Hz]", "order", "lines at orders", "shows by"), table, notes)
