"""What the phases of the meshes do to the harmonics of a set, and tooth numbers nearby, as tables."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from femgear.gears.phasing import KINDS, phasing_of_set
from femgear.gears.phasing_tables import ZERO, phasing_table
from femgear.gears.tooth_choice import ToothChoices, neighbouring_teeth
from femgear.summary_block import Block

if TYPE_CHECKING:
    from femgear.gears import PlanetarySet

HARMONICS = 6
DISTANCE, TOLERANCE = 3, 0.02
ROWS = 8
_SHORT = dict(zip(KINDS, ("in", "counter", "sequential", "unequal")))


def describe_phasing(planetary_set: PlanetarySet) -> tuple[Block, ...]:
    """Phasing of the first harmonics of the mesh frequency, and of neighbouring tooth numbers.

    Parameters
    ----------
    planetary_set : PlanetarySet
        Of a case that `femgear.gears.check_set` accepts.

    Returns
    -------
    tuple of Block
    """
    return _harmonics(planetary_set), _neighbours(planetary_set)


def _harmonics(s: PlanetarySet) -> Block:
    phasing = phasing_of_set(s)
    table = phasing_table(phasing, range(1, HARMONICS + 1))
    rows = [
        (
            str(h),
            kind,
            "-" if k < 0 else str(k),
            _share(size[:, 0].max()),
            _share(size[:, 1].max()),
            ", ".join(modes),
        )
        for h, kind, k, size, modes in zip(
            table.harmonics, table.kind, table.cyclic, table.members, table.excited
        )
    ]
    header = ("harmonic", "planets are", "k", "torque", "lateral force", "can excite modes")
    common = math.gcd(s.sun.teeth, s.planet.teeth), math.gcd(s.planet.teeth, s.ring.teeth)
    notes = (
        "k = mod(h z_sun, N); torque, lateral force: what is left of equal mesh forces on sun, ring, carrier",
        f"a planet's ring mesh follows its sun mesh by {phasing.lag:.4f} periods",
        f"common divisors of the teeth: sun and planet {common[0]}, planet and ring {common[1]}",
    )
    return Block("Mesh phasing", header, tuple(rows), notes)


def _share(value: float) -> str:
    return "cancelled" if value < ZERO else f"{100.0 * value:.1f} %"


def _neighbours(s: PlanetarySet) -> Block:
    wanted = (s.sun.teeth, s.planet.teeth, s.ring.teeth)
    closure = max(1, abs(wanted[2] - wanted[0] - 2 * wanted[1]))
    found = neighbouring_teeth(
        *wanted, s.n_planets, distance=DISTANCE, ratio_tolerance=TOLERANCE, closure=min(closure, 10)
    )
    found = found.only(np.any(found.teeth != np.array(wanted), axis=1))
    # sets with equal spacing first, each group by its ratio
    found = found.only(np.argsort(~found.equally_spaced, kind="stable"))
    rows = tuple(_row(found, i) for i in range(min(len(found), ROWS)))
    header = ("teeth", "ratio", "change", "spacing", "harmonics 1 to 4", "hunting", "room [modules]")
    notes = (
        f"{len(found)} within {DISTANCE} teeth and {100 * TOLERANCE:g} % of the ratio; room: unshifted tips",
    )
    return Block("Neighbouring tooth numbers", header, rows, notes)


def _row(found: ToothChoices, i: int) -> tuple[str, ...]:
    kinds = [_SHORT[name] for name in found.kind_names[i]]
    off = f"off by {math.degrees(found.spacing_error[i]):.2f} deg"
    return (
        "/".join(str(z) for z in found.teeth[i]),
        f"{found.ratio[i]:.4f}",
        f"{100.0 * found.ratio_change[i]:+.2f} %",
        "equal" if found.equally_spaced[i] else off,
        kinds[0] if len(set(kinds)) == 1 else ", ".join(kinds),
        "yes" if found.hunting[i] else "no",
        f"{found.room[i]:.2f}",
    )
