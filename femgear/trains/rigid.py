"""What cases of planetary sets of rigid bodies have in common, in their plane or in space.

Refusals, notices, supports of the members, speeds and mesh stiffness.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from femgear.case.case import set_deviations
from femgear.case.sections import Case, MeshStiffnessSection, RigidCase, output_member
from femgear.errors import CaseError
from femgear.gears.deviations import common_period
from femgear.gears.kinematics import Speeds, speeds
from femgear.system.rigid_bodies import PlanarTorque

if TYPE_CHECKING:
    from femgear.gears.planetary import PlanetarySet

Entry = TypeVar("Entry")


def listed(names: list[str]) -> str:
    """Entries of a case file with their verb, "a, b have"."""
    return f"{', '.join(names)} {'has' if len(names) == 1 else 'have'}"


def entries_without_effect(data: dict, others: Sequence[str] = ()) -> list[str]:
    """Entries that no set of rigid bodies takes up: machines and housing, others, foundation of the ring.

    Parameters
    ----------
    data : dict
        Tables of a case file that was checked.
    others : sequence of str
        Further entries without effect.
    """
    machines = [name for name in ("motor", "brake", "housing") if name in data]
    keys = ("foundation_radial", "foundation_tangential")
    return [*machines, *others, *(f"ring.{key}" for key in keys if key in data["ring"])]


def flank_entries(data: dict) -> list[str]:
    """Entries of flanks and errors, which act on the static solution alone."""
    return [
        f"{name}.{key}"
        for name in ("sun", "planet", "ring", "carrier")
        for key in ("modifications", "errors", "individual")
        if data.get(name, {}).get(key)
    ]


def rigid_refusals(case: RigidCase, kind: str, *, without_torque: str) -> Iterator[CaseError]:
    """Refusals of elastic supports of the static solution, and of a torque of zero.

    Parameters
    ----------
    case : RigidCase
    kind : str
        "planar" or "helical".
    without_torque : str
        What a torque of zero means.
    """
    if case.static.members == "elastic":
        yield CaseError(
            f"the supports belong to the {kind} model: the static solution is that of the gears alone",
            code="E-CHOICE",
            key="static.members",
            value="elastic",
            limit=f'"fixed" in a {kind} case',
            remedy="leave static.members out",
        )
    if case.operation.torque == 0.0:
        yield CaseError(
            f"without torque no tooth carries load{without_torque}",
            code="E-NO-LOAD",
            key="operation.torque",
            limit=f"not zero in a {kind} case",
        )


def unheld_member(case: RigidCase, key: str, remedy: str) -> CaseError:
    """Refusal of a fixed member whose torsional support is zero."""
    return CaseError(
        f"the {case.operation.fixed} is the fixed member but nothing keeps it from turning",
        code="E-MECHANISM",
        key=key,
        value="0 N m/rad",
        limit="above 0 N m/rad",
        remedy=remedy,
    )


def check_one_period(case: Case, gears: PlanetarySet, takes: str) -> None:
    """Refuse errors whose static record spans several mesh periods (E-PERIODS).

    Parameters
    ----------
    case : Case
    gears : PlanetarySet
    takes : str
        "the planar model takes", or whatever takes one period alone.
    """
    # whatever the longest record: one period cut out of many is no period
    periods, _ = common_period(set_deviations(case), gears, limit=sys.maxsize)
    if periods > 1:
        raise CaseError(
            f"the errors of this set span {periods} mesh periods; {takes} one",
            code="E-PERIODS",
            key="operation.speeds",
            limit="errors that repeat with every tooth",
            remedy="run with --only static, or leave pitch errors and runouts out",
        )


def needed(entry: Entry | None, name: str) -> Entry:
    """What a stage cannot do without: an entry, or the result of a stage before it (E-KEY-MISSING)."""
    if entry is None:
        raise CaseError(f"{name} is needed here", code="E-KEY-MISSING", key=name)
    return entry


def torsional_support(case: RigidCase, member: str, given: float | None) -> float:
    """Torsional stiffness of a member [N m/rad]: the fixed one is held where it has none, others are free."""
    if given is not None:
        return given
    return math.inf if member == case.operation.fixed else 0.0


def torsion_text(case: RigidCase, member: str, given: float | None) -> str:
    """The torsional support of a member in a table."""
    if given is not None:
        return f"{given:.6g}"
    return "held" if member == case.operation.fixed else "0"


def mesh_stiffnesses(given: MeshStiffnessSection | None, mean: np.ndarray | None) -> dict[str, Any]:
    """Stiffness of both kinds of mesh [N/m]: as given, else the means (2N,) of the static solution."""
    if given is not None:
        return {"stiffness_sun_planet": given.sun_planet, "stiffness_planet_ring": given.planet_ring}
    sun_planet, planet_ring = np.split(np.asarray(mean), 2)
    return {"stiffness_sun_planet": sun_planet, "stiffness_planet_ring": planet_ring}


def stiffness_text(given: MeshStiffnessSection) -> str:
    """The given mesh stiffness in a note."""
    return f"sun-planet {given.sun_planet:.6g}, planet-ring {given.planet_ring:.6g} N/m, as given"


def driving_torque(case: RigidCase, *, reacts: bool = True) -> PlanarTorque:
    """The driving torque, which the member that is neither driven nor held takes up, or the supports."""
    return PlanarTorque(case.operation.torque, case.operation.input, output_member(case) if reacts else None)


def member_speeds(case: Case, gears: PlanetarySet, speed: float = 1.0) -> Speeds:
    """Speeds of all members at a speed of the input [rad/s]."""
    return speeds(gears, input=case.operation.input, fixed=case.operation.fixed, speed=speed)


def rotation_sense(case: RigidCase, gears: PlanetarySet) -> int:
    """1 where the sun turns counter-clockwise against the carrier, else -1."""
    found = member_speeds(case, gears)
    return 1 if found.sun > found.carrier else -1


def modes_verdict(result: Any) -> dict:
    """Numbers of modes and of coordinates for the manifest."""
    return {"modes": len(result.modes.frequency), "degrees_of_freedom": len(result.modes.shape)}
