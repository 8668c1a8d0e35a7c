"""Planetary sets: the reference set of the modulation paper, a published report, assembly."""

from __future__ import annotations

import math

import numpy as np

from femgear.gears.checks import check_set
from femgear.gears.gear import Gear
from femgear.gears.kinematics import speeds, torques
from femgear.gears.planetary import PlanetarySet, close_set, equal_planet_angles, feasible_angles
from femgear.gears.profile import BasicRack
from validation.reference.gear_limits import neighbour_limit
from validation.reference.hertz import contact_modulus, hertz_line, relative_radius
from validation.rows import REPEATED, Row, at_most, counted, printed, within

ALPHA = math.radians(20.0)
KISSSOFT = "KISSsoft report, NREL 5 MW gearbox, planetary stage 2"


def reference_set() -> PlanetarySet:
    """The set 27/40/108 of the modulation paper, closed at 51 mm."""
    rack = BasicRack(addendum=1.0, dedendum=1.25, root_radius=0.25)

    def gear(teeth, shift, rim, internal=False):
        return Gear(teeth, 1.5e-3, ALPHA, shift, 25e-3, rim, internal=internal, rack=rack)

    return close_set(
        gear(27, 0.52681, 9e-3),
        gear(40, 0.0, 18e-3),
        gear(108, 0.0, 0.1, internal=True),
        planet_angles=equal_planet_angles(3),
        centre_distance=51e-3,
    )


def nrel_set() -> PlanetarySet:
    """Planetary stage 2 of the NREL 5 MW gearbox."""
    rack = BasicRack(addendum=1.0, dedendum=1.25, root_radius=0.38)
    ring_rack = BasicRack(addendum=1.0, dedendum=1.25, root_radius=0.30)

    def gear(teeth, shift, tip, root, rim, rack, internal=False):
        return Gear(
            teeth,
            21e-3,
            ALPHA,
            shift,
            0.55,
            rim,
            internal=internal,
            rack=rack,
            tip_diameter=tip,
            root_diameter=root,
        )

    return PlanetarySet(
        sun=gear(18, 0.3890, 0.432838, 0.341838, 0.5 * 0.19432, rack),
        planet=gear(36, 0.5039, 0.815663, 0.724663, 0.5 * 0.57696, rack),
        # ISO 21771 prints the shift of an internal gear with the opposite sign
        ring=gear(93, -0.1171, 1.906081, 2.000581, 0.5 * 2.14882, ring_rack, internal=True),
        centre_distance=0.584,
        planet_angles=equal_planet_angles(3),
    )


def reference_geometry() -> tuple[Row, ...]:
    """Working pressure angles, contact ratios, speeds and phases of the reference set."""
    s = reference_set()
    source = f"cos(alpha_w) = a_0 cos(alpha)/a, path of contact over base pitch; independently ({REPEATED})"
    name = "27/40/108 at 51 mm: "
    rows = [
        printed(
            "set",
            source,
            name + "working angle sun-planet [deg]",
            "22.1995",
            math.degrees(s.working_pressure_angle_sun_planet),
        ),
        printed(
            "set",
            source,
            name + "working angle planet-ring [deg]",
            "20.0000",
            math.degrees(s.working_pressure_angle_planet_ring),
        ),
        printed("set", source, name + "contact ratio sun-planet", "1.5507", s.contact_ratio_sun_planet),
        printed("set", source, name + "contact ratio planet-ring", "1.9301", s.contact_ratio_planet_ring),
    ]
    for rpm, value in ((250, 90.0), (3100, 1116.0)):
        turning = speeds(s, input="sun", fixed="ring", speed=rpm * 2 * math.pi / 60)
        quantity = name + f"mesh frequency at {rpm} rpm [Hz]"
        rows.append(within("set", "Willis", quantity, value, turning.mesh_frequency, 1e-12))
    phases = s.mesh_phases
    spread = max(np.ptp(phases[:3]), np.ptp(phases[3:]))
    rows.append(at_most("set", "tooth numbers", name + "spread of the planets' mesh phases", 1e-9, spread))
    rows.append(counted("set", "definition", name + "warnings of the geometry checks", 0, len(check_set(s))))
    return tuple(rows)


def nrel_report() -> tuple[Row, ...]:
    """D6: a set with a published report."""
    s = nrel_set()
    load = torques(s, member="sun", torque=162105.5)
    path = [1e3 * (end - start) for start, end in (s.path_sun_planet, s.path_planet_ring)]
    force = load.sun / (3 * s.sun.base_radius)
    values = (
        ("working angle sun-planet [deg]", "24.169", math.degrees(s.working_pressure_angle_sun_planet)),
        ("working angle planet-ring [deg]", "15.630", math.degrees(s.working_pressure_angle_planet_ring)),
        ("path of contact sun-planet [mm]", "84.952", path[0]),
        ("path of contact planet-ring [mm]", "100.284", path[1]),
        ("contact ratio sun-planet", "1.370", s.contact_ratio_sun_planet),
        ("contact ratio planet-ring", "1.618", s.contact_ratio_planet_ring),
    )
    # the report prints to one unit of the last digit: 84.95251 stands as 84.952, 15.62949 as 15.630
    rows = [printed("D6", KISSSOFT, name, value, ours, digits=2) for name, value, ours in values]
    rows.append(within("D6", KISSSOFT, "normal force of a mesh [N]", 304248.9, force, 1e-6))
    rows.append(within("D6", KISSSOFT, "ring torque [N m]", 837545.3, load.ring, 1e-6))
    rows.append(within("D6", KISSSOFT, "carrier torque [N m]", 999650.9, -load.carrier, 1e-6))
    return (*rows, *_pitch_point_pressure(s, force))


def _pitch_point_pressure(s, force):
    """Nominal contact stress at the pitch point without the contact-ratio factor."""
    modulus = contact_modulus(206e9, 0.3, 206e9, 0.3)
    meshes = (
        ("sun-planet", s.sun, s.planet, s.working_pressure_angle_sun_planet, 573.40 / 0.936),
        ("planet-ring", s.planet, s.ring, s.working_pressure_angle_planet_ring, 312.44 / 0.891),
    )
    rows = []
    for name, first, two, angle, reference in meshes:
        radii = [gear.base_radius * math.tan(angle) for gear in (first, two)]
        radius = relative_radius(radii[0], -radii[1] if two.internal else radii[1])
        pressure = hertz_line(force / s.sun.face_width, radius, modulus).peak_pressure * 1e-6
        quantity = f"contact pressure at the pitch point, {name} [MPa]"
        note = "sigma_H0 over Z_epsilon, both printed; Z_epsilon has three digits"
        rows.append(within("D6", KISSSOFT, quantity, reference, pressure, 1e-3, note=note))
    return tuple(rows)


def assembly() -> tuple[Row, ...]:
    """D8: equal spacing, feasible positions and neighbours."""
    rows = []
    for sun, ring, planets, fits in ((18, 93, 3, 1), (20, 80, 4, 1), (27, 99, 4, 0)):
        equal = equal_planet_angles(planets)
        ours = np.abs(np.subtract(feasible_angles(sun + ring, equal), equal)).max() < 1e-9
        quantity = f"sun {sun}, ring {ring}: {planets} planets equally spaced (1 yes, 0 no)"
        rows.append(counted("D8", "(z_s + z_r)/N whole", quantity, fits, ours))
    positions = np.degrees(feasible_angles(126, equal_planet_angles(4)))
    for number, value in ((2, "91.428571"), (3, "180.000000"), (4, "271.428571")):
        quantity = f"sun 27, ring 99: position of planet {number} [deg]"
        rows.append(printed("D8", "multiples of 360/(z_s + z_r)", quantity, value, positions[number - 1]))
    for sun, planet, value in ((20, 30, "4.52"), (27, 35, "4.91"), (12, 42, "3.30"), (30, 20, "6.90")):
        quantity = f"sun {sun}, planet {planet}: planets that just touch"
        source = "pi/asin((z_p + 2)/(z_s + z_p))"
        rows.append(printed("D8", source, quantity, value, neighbour_limit(sun, planet)))
    return tuple(rows)
