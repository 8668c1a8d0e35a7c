"""Rows of the validation: a pair with a cracked tooth against whole gears of CalculiX in contact."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femgear.case.gear_set import gear_material, material_of
from femgear.contact.cracked_flanks import cracked_flanks
from femgear.contact.cycle import walk_mesh_cycle
from femgear.gears.deviations import no_deviations
from femgear.gears.faults import LEFT, Crack
from validation import calculix
from validation.calculix_rows import PLANE_STRAIN, SOURCE, contact_of_gears, femgear_pair, where_installed
from validation.rows import Row, within

POSITIONS = {2.0e-3: (0.1, 0.25, 0.5, 0.8, 1.05), 3.0e-3: (0.5,)}
"""Of the mesh, by depths of cracks in a tooth of 3 mm module [m]: it carries beside others, and alone."""
GATES = 0.02, 0.02


@where_installed
def cracked_pair() -> tuple[Row, ...]:
    """Pair 24/36 with a crack at the root of a tooth of gear 1, while it carries: approach and tangent stiffness."""
    rows = list[Row]()
    case, static, _ = femgear_pair("24/36")
    gears, sector = static.planetary_set, static.sectors.gears[0]
    material = gear_material(case, "gear_1")
    for depth, positions in POSITIONS.items():
        crack = Crack(0, 0, 0, LEFT, None, float(calculix.CRACK_ANGLE), depth)
        flanks = cracked_flanks(sector, material_of(case, "gear_1"), crack, flank_elements=case.static.flank_elements)
        first = replace(static.bodies.gears[0], cracks=(flanks,))
        cycle = walk_mesh_cycle(
            gears,
            static.bodies.with_gear(0, first),
            sun_torque=static.sun_torque,
            positions=np.array(positions),
            deviations=replace(no_deviations(gears), faults=(crack,)),
            periods=gears.gears[0].teeth,
        )
        for number, position in enumerate(positions):
            ours = 1e6 * cycle.deflection[0, number], 1e-6 * cycle.stiffness[0, number]
            theirs = contact_of_gears(
                gears,
                material,
                torque=static.sun_torque,
                position=position,
                approach=cycle.deflection[0, number],
                states=(PLANE_STRAIN, PLANE_STRAIN),
                crack=(0, depth),
            )[:2]
            for words, gate, reference, value in zip(
                ("transmission error [um]", "tangent stiffness [N/um]"), GATES, theirs, ours, strict=True
            ):
                text = f"24/36, crack of {1e3 * depth:g} mm, position {position:g}: {words}"
                rows.append(within("CalculiX, crack", SOURCE, text, float(reference), float(value), gate))
    return tuple(rows)
