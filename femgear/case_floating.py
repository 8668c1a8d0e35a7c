"""Members of a case that float though nothing holds them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from femgear.errors import GeometryError
from femgear.gears.floating import unheld_members

if TYPE_CHECKING:
    from femgear.casefile.sections import Case
    from femgear.gears import PlanetarySet


def check_floating(case: Case, planetary: PlanetarySet, *, dynamic: bool = False) -> None:
    """Refuse members that float though the planets cannot hold them.

    Parameters
    ----------
    case : Case
    planetary : PlanetarySet
    dynamic : bool
        For modes and dynamics, where members move whatever static.members says.

    Raises
    ------
    GeometryError
        E-MECHANISM, with the support stiffness that is zero, or the foundation of a loose ring.
    """
    if case.static.members == "fixed" and not dynamic:
        return
    if case.ring.foundation_tangential == 0.0:
        _mechanism(
            case,
            "ring.foundation_tangential",
            "nothing keeps the ring from turning under the load of the planets",
            value="0 N/m^3",
            remedy='give it a tangential foundation, or write static.members = "fixed"',
        )
    names = [name for name in ("sun", "carrier") if getattr(case, name).support_stiffness == 0.0]
    # the dynamic model has no back flanks
    both_flanks = case.static.back_flanks and not dynamic
    loose = unheld_members(planetary, names, both_flanks=both_flanks)
    if not loose:
        return
    N = planetary.n_planets
    if len(loose) > 1:
        message = f"{N} planets cannot hold a floating sun and a floating carrier at once"
    else:
        angles = ", ".join(f"{math.degrees(angle):.6g}" for angle in planetary.planet_angles[:12])
        where = f"{N} planet{'s' * (N > 1)} at {angles} deg"
        message = f"{where} cannot hold a floating {loose[0]}: their forces leave it free to move aside"
    _mechanism(
        case,
        f"{loose[-1]}.support_stiffness",
        message,
        value="0 N/m",
        remedy=f'write support_stiffness = "5e7 N/m" or the like in [{loose[-1]}], or '
        'run with static.members = "fixed" and --only static; three equally spaced planets hold it',
    )


def _mechanism(case: Case, key: str, message: str, *, value: str, remedy: str):
    raise GeometryError(
        message,
        code="E-MECHANISM",
        key=key,
        value=value,
        limit=f"above {value}",
        remedy=remedy,
        file=case.location(key),
    )
