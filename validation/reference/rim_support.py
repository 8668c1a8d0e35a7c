"""Support stiffness K = F/X of a gear's body: its teeth coupled to a centre node, its rim supported."""

from __future__ import annotations

from typing import TYPE_CHECKING

from femgear.errors import GridError

if TYPE_CHECKING:
    from femgear.contact.bodies import Sector

TOOTHED_SIDE = tuple(f"{part}_{side}" for part in ("tip", "flank", "fillet", "root") for side in ("left", "right"))


def rim_support_stiffness(sector: Sector, *, foundation=None) -> float:
    """Radial stiffness between the teeth, which move as one rigid surface, and the support of the rim [N/m].

    The rim is the bore of an external gear and the outer surface of a ring. The teeth do not yield: their
    compliance belongs to the meshes.

    Parameters
    ----------
    sector : Sector
        Of one of the gears, see `femgear.contact.bodies.make_sectors`.
    foundation : sparse matrix, optional
        Stiffness of an elastic foundation of one sector [N/m]; the rim is held where there is none.

    Raises
    ------
    GridError
        A foundation without stiffness (E-GRID-FREE).
    """
    from validation.reference.support_stiffness import cyclic_support_stiffness

    names = tuple(name for name in TOOTHED_SIDE if name in sector.grid.boundaries)
    if not names:
        raise GridError("the sector has no teeth", code="E-GRID", limit=", ".join(TOOTHED_SIDE))
    held = ("rim",) if foundation is None else ()
    stiffness = sector.stiffness if foundation is None else sector.stiffness + foundation
    return cyclic_support_stiffness(sector.grid, stiffness, sector.gear.teeth, names, held)
