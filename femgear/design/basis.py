"""What all variants of a design share: the gears of a case, their compliance, supports and deviations."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from femgear.case import Case, planetary_set, set_deviations
from femgear.contact.supports import RIGID, Supports
from femgear.errors import CaseError
from femgear.threads import one_blas_thread

if TYPE_CHECKING:
    from femgear.contact.assembly import Bodies
    from femgear.gears import PlanetarySet
    from femgear.gears.deviations import SetDeviations


@dataclass(frozen=True, eq=False)
class DesignBasis:
    """Gears, flank compliances, supports as the case's static problem has them, deviations (None: ideal)."""

    gears: PlanetarySet
    bodies: Bodies
    supports: Supports
    deviations: SetDeviations | None


@one_blas_thread()
def design_basis(case: Case, *, cache: Path | None = None) -> DesignBasis:
    """The compliance of a case, computed once for all variants.

    Parameters
    ----------
    case : Case
    cache : path, optional
        Folder of generated grids.

    Raises
    ------
    GeometryError, GridError
    """
    from femgear.contact.bodies import make_bodies, make_sectors
    from femgear.fe.elasticity import Material, foundation

    gears, deviations = planetary_set(case), set_deviations(case)
    material = Material(case.material.youngs_modulus, case.material.poisson_ratio, case.material.density)
    sectors = make_sectors(gears, material, flank_elements=case.static.flank_elements, cache=cache)
    springs = None
    if case.static.members == "elastic":
        grid, ring = sectors.ring.grid, case.ring
        stiffness = ring.foundation_radial, ring.foundation_tangential
        springs = foundation(grid, "rim", *stiffness, thickness=gears.ring.face_width)
    bodies = make_bodies(sectors, material, depth=case.static.depth, ring_foundation=springs)
    supports = RIGID if case.static.members == "fixed" else case_supports(case)
    return DesignBasis(gears, bodies, supports, None if deviations.ideal else deviations)


def case_supports(case: Case) -> Supports:
    """Supports of sun, carrier and planets with the stiffnesses and the bearing clearance of the case."""
    return Supports(
        sun=case.sun.support_stiffness,
        carrier=case.carrier.support_stiffness,
        planet=case.planet.bearing_stiffness,
        planet_clearance=case.planet.bearing_clearance,
    )


def sun_torque(case: Case, gears: PlanetarySet, torque: float | None = None) -> float:
    """Torque on the sun [N m] under a torque on the input of the case, by default that of the case.

    Raises
    ------
    CaseError
        E-TORQUE: without torque there is nothing to design for.
    """
    from femgear.gears import torques

    value = case.operation.torque if torque is None else torque
    if value == 0:
        raise CaseError("without torque no tooth bends", code="E-TORQUE", key="operation.torque")
    return torques(gears, member=case.operation.input, torque=value).sun


def relief_snippet(gears: PlanetarySet, *, amount: float, length: float, power: float, back: bool) -> str:
    """Tables of a case file for the tip relief of `relief.with_tip_relief`, to be pasted at its end."""
    import math

    from femgear.design.relief import relief_starts

    side = "ring side" if back else "sun side"
    lines = []
    for gear, start, flank in zip((gears.sun, gears.planet), relief_starts(gears, length=length), ("", side)):
        lines += [f"[[{gear.name}.modifications]]", 'kind = "tip relief"']
        lines += [f'flank = "{flank}"'] if flank else []
        diameter = 2e3 * math.hypot(start, gear.base_radius)
        lines += [f'amount = "{amount * 1e6:.3f} um"', f'start_diameter = "{diameter:.5f} mm"']
        lines += [f"power = {power:g}", ""]
    return "\n".join(lines)
