"""Flank compliance of a body that is one sector of a gear."""

import numpy as np

from femgear.contact.bodies import FlankCompliance, _without_half_plane, observed_flanks
from femgear.fe.compliance import condense_sector
from femgear.fe.elasticity import Material
from femgear.fe.grid import Grid
from femgear.gears.gear import Gear


def held_sector_compliance(
    grid: Grid, gear: Gear, material: Material, stiffness, *, held: str, depth: float | None = None
) -> FlankCompliance:
    """Regular flank compliance of a body that is one sector, held at both cuts as well as at `held`.

    Parameters and errors are those of `femgear.contact.bodies.flank_compliance`; the result counts one tooth.
    """
    stations, depths, loads, seen = observed_flanks(grid, gear, depth)
    sector = condense_sector(grid, stiffness, count=gear.teeth, rim=held, loads=loads, observations=seen)
    even, odd = sector.supported().compliance
    held_compliance = np.block([[even + odd, even - odd], [even - odd, even + odd]])[None]
    widths = (gear.face_width,) * 2
    return _without_half_plane(gear, material, stations, depths, held_compliance, len(grid.points), widths)
