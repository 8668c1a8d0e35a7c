"""Mesh stiffness of ISO 6336-1, method B."""

from __future__ import annotations

import math

from femgear.gears.iso6336 import mesh_stiffness_method_b, theoretical_single_stiffness
from validation.planetary import KISSSOFT, nrel_set
from validation.rows import REPEATED, Row, printed, within

UNIT = 1e-9  # N/m^2 in N/(mm um)
NOTE = "with the printed C_R 0.862, C_M 0.8, C_B 0.975; C_R has three digits"


def single_pairs() -> tuple[Row, ...]:
    """E1: standard pairs."""
    source = f"ISO 6336-1, method B, evaluated independently ({REPEATED})"
    rows = [
        printed(
            "E1",
            source,
            "20/40: theoretical single stiffness [N/(mm um)]",
            "16.2725324",
            UNIT * theoretical_single_stiffness(20, 40, 0.0, 0.0),
        )
    ]
    for z1, z2, value in ((20, 40, "13.0180259"), (17, 17, "11.1811762"), (50, 50, "14.4148300")):
        single = mesh_stiffness_method_b(z1, z2, 0.0, 0.0, 1.5)[0]
        rows.append(
            printed("E1", source, f"{z1}/{z2}: single stiffness c' [N/(mm um)]", value, UNIT * single)
        )
    mean = mesh_stiffness_method_b(20, 40, 0.0, 0.0, 1.6351859635714576)[1]
    rows.append(printed("E1", source, "20/40: mesh stiffness c_gamma [N/(mm um)]", "19.2196764", UNIT * mean))
    return tuple(rows)


def nrel_stiffness() -> tuple[Row, ...]:
    """D6: stiffnesses of the published report."""
    s = nrel_set()
    # the report prints the blank factor C_R = 0.862, of webs a quarter of the face width
    pairs = (
        (18, 36, 0.3890, 0.5039, s.contact_ratio_sun_planet),
        (36, math.inf, 0.5039, 0.1171, s.contact_ratio_planet_ring),
    )
    # the standard takes the ring's shift with the sign of ISO 21771
    outer, inner = ([0.862 * one for one in mesh_stiffness_method_b(*pair, dedendum=1.25)] for pair in pairs)
    rows = []
    for name, value, ours in (
        ("sun-planet, c'", 12.240, outer[0]),
        ("planet-ring, c'", 14.053, inner[0]),
        ("sun-planet, c_gamma", 15.640, outer[1]),
        ("planet-ring, c_gamma", 20.563, inner[1]),
    ):
        rows.append(within("D6", KISSSOFT, f"{name} [N/(mm um)]", value, UNIT * ours, 1e-3, note=NOTE))
    return tuple(rows)
