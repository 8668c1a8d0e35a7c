"""Mesh stiffness of ISO 6336-1, method B."""

from __future__ import annotations

import math

from femgear.gears.gear import Gear
from femgear.gears.iso6336_stiffness import mesh_stiffness_method_b, pair_mesh_stiffness, theoretical_single_stiffness
from femgear.gears.pair import GearPair
from femgear.gears.profile import BasicRack, transverse_rack, transverse_tool
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
        rows.append(printed("E1", source, f"{z1}/{z2}: single stiffness c' [N/(mm um)]", value, UNIT * single))
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
    outer, inner = (
        [0.862 * stiffness for stiffness in mesh_stiffness_method_b(*pair, dedendum=1.25)] for pair in pairs
    )
    rows = []
    for name, value, ours in (
        ("sun-planet, c'", 12.240, outer[0]),
        ("planet-ring, c'", 14.053, inner[0]),
        ("sun-planet, c_gamma", 15.640, outer[1]),
        ("planet-ring, c_gamma", 20.563, inner[1]),
    ):
        rows.append(within("D6", KISSSOFT, f"{name} [N/(mm um)]", value, UNIT * ours, 1e-3, note=NOTE))
    return tuple(rows)


def helical_pair(teeth, shifts, *, module, degrees, distance, rack, tips=(None, None)) -> GearPair:
    """Make a pair of helical gears from their normal section; lengths in mm."""
    beta = math.radians(degrees)
    transverse, angle = transverse_tool(module * 1e-3, math.radians(20.0), beta)
    gears = (
        Gear(
            z,
            transverse,
            angle,
            x * math.cos(beta),
            0.1,
            0.3 * z * transverse,
            rack=transverse_rack(rack, beta),
            tip_diameter=tip and tip * 1e-3,
        )
        for z, x, tip in zip(teeth, shifts, tips, strict=True)
    )
    return GearPair(*gears, distance * 1e-3)


def wind_pair() -> GearPair:
    """Third stage of the published wind gearbox: its pinion has the smaller shift."""
    return helical_pair(
        (24, 95),
        (0.48, 0.6691),
        module=14,
        degrees=10,
        distance=861,
        rack=BasicRack(1.0, 1.25, 0.38),
        tips=(380.747, 1395.376),
    )


def helical_stiffness() -> tuple[Row, ...]:
    """Helical pairs of the examples to the standard and of the published report."""
    source, beta = "ISO/TR 6336-30:2017, worked example 1 (17/103, m_n 8, 15.8 deg)", math.radians(15.8)
    example = helical_pair(
        (17, 103), (0.145, 0.0), module=8, degrees=15.8, distance=500, rack=BasicRack(1.0, 1.4, 0.39)
    )
    solid = theoretical_single_stiffness(17, 103, 0.145, 0.0, helix_angle=beta)
    single, mean = pair_mesh_stiffness(example, beta)
    rounded = "contact ratio from diameters of two decimals there"
    rows = [
        printed("E1", source, "c'_th, virtual teeth by the base helix [N/(mm um)]", "17.85584", UNIT * solid),
        printed("E1", source, "c' [N/(mm um)]", "12.37047", UNIT * single),
        within("E1", source, "c_gamma_alpha [N/(mm um)]", 17.46485, UNIT * mean, 2e-4, note=rounded),
    ]
    kisssoft, note = (
        "KISSsoft report, NREL 5 MW gearbox, stage 3 (24/95, 10 deg)",
        "with the printed C_R 0.898",
    )
    single, mean = pair_mesh_stiffness(wind_pair(), math.radians(10.0))
    for name, value, ours in (("c'", "13.832", single), ("c_gamma_alpha", "18.632", mean)):
        quantity = f"{name}, pinion with the smaller shift [N/(mm um)]"
        rows.append(printed("D6", kisssoft, quantity, value, 0.898 * UNIT * ours, note=note))
    return tuple(rows)


def form_circles() -> tuple[Row, ...]:
    """Where the involutes of helical gears begin, root form diameters of ISO 21771."""
    source = f"ISO 21771, rack-shaped tools: 24/95, m_n 14, 10 deg, rho 0.38; evaluated independently ({REPEATED})"
    return tuple(
        printed("D5", source, f"root form diameter of {gear.teeth} teeth [mm]", value, 2e3 * gear.form_radius)
        for gear, value in zip(wind_pair().gears, ("328.991", "1341.487"), strict=True)
    )
