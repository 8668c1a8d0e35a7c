"""The 36-dof drivetrain of "Dynamic analysis of the wind turbine drivetrain considering shaft bending
effect".

Rotor, planetary stage, two parallel stages and generator. `PRINTED` holds what the paper gives, `ASSUMED`
what it
does not print and what had to be chosen; nothing else is put in.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

RPM = math.pi / 30.0


@dataclass(frozen=True)
class Printed:
    """Data of the paper: inertias about the axis [kg m^2], springs [N m/rad], meshes [N/m], radii [m]."""

    rotor: float = 4.18e6
    carrier: float = 57.72
    planet: float = 1.12
    sun: float = 0.86
    gear_1: float = 14.32
    gear_2: float = 1.62
    gear_3: float = 0.20
    generator: float = 93.22
    low_speed: tuple[float, float] = (1.34e8, 7.19e7)
    intermediate: tuple[float, float] = (2.48e7, 1.40e7)
    high_speed: tuple[float, float] = (2.83e6, 0.15e7)
    planetary_mesh: float = 0.73e8
    mesh_12: float = 2.02e9
    mesh_23: float = 0.11e8
    carrier_radius: float = 0.270
    planet_radius: float = 0.160
    sun_radius: float = 0.110
    gear_1_radius: float = 0.290
    gear_2_radii: tuple[float, float] = (0.095, 0.185)
    gear_3_radius: float = 0.080
    pressure_angle: float = math.radians(20.0)
    ratio: float = 34.654
    speed: float = 6.0 * RPM
    torque: float = 15_000.0
    generator_share: float = 0.30
    lines: tuple[float, float, float] = (18.31, 63.12, 128.6)


@dataclass(frozen=True)
class Assumed:
    """What the paper does not print.

    Parameters
    ----------
    ring_teeth, sun_teeth, gear_1_teeth, gear_2_teeth : int
        `line_teeth`: the whole numbers that come nearest to the printed mesh lines and the radii; gear_2 is
        the large wheel of gear 2.
    planetary_contact_ratio, ring_contact_ratio, contact_ratio_12, contact_ratio_23 : float
        Spur gears of about these tooth numbers, ISO 21771.
    ring_phase : float
        Of the planet-ring against the sun-planet mesh, fraction of the mesh period.
    rotor_mass, generator_mass, generator_transverse : float
        [kg], [kg m^2]; the rotor's as that of a blade set whose radius of gyration is 12.5 m.
        Carrier, planets and gears are taken as flat discs of the printed inertia and radius: mass
        ``2 I / r^2``, half the inertia about a diameter.
    shaft_lengths : tuple of float
        Low-speed (rotor to carrier), intermediate (sun to gear 1), high-speed (gear 3 to generator) [m].
    shear_ratio : float
        ``Phi`` of all shafts, for the shear of the joints.
    rotor_bearing, carrier_bearing, sun_bearing, gear_bearing, generator_bearing : float
        Across the axis [N/m]; the sun floats on its shaft but for a weak centring.
    tilt_bearing : float
        Of all bodies that tilt but rotor and sun [N m/rad]; the rotor's main bearing has `rotor_tilt`.
    damping_ratio : float
        Of all elastic modes.
    direction_12, direction_23 : float
        Angle from the axis of the driving to that of the driven gear [rad].
    backlash : float
        Of every mesh [m], used only where teeth may separate.
    """

    ring_teeth: int = 184
    sun_teeth: int = 47
    gear_1_teeth: int = 128
    gear_2_teeth: int = 86
    planetary_contact_ratio: float = 1.75
    ring_contact_ratio: float = 1.90
    contact_ratio_12: float = 1.78
    contact_ratio_23: float = 1.75
    ring_phase: float = 0.0
    rotor_mass: float = 26_750.0
    generator_mass: float = 1_500.0
    generator_transverse: float = 120.0
    shaft_lengths: tuple[float, float, float] = (2.0, 0.8, 0.8)
    shear_ratio: float = 0.3
    rotor_bearing: float = 2.0e9
    rotor_tilt: float = 1.0e9
    carrier_bearing: float = 1.0e9
    sun_bearing: float = 1.0e7
    gear_bearing: float = 5.0e8
    generator_bearing: float = 5.0e8
    tilt_bearing: float = 1.0e7
    damping_ratio: float = 0.02
    direction_12: float = 0.0
    direction_23: float = 0.5 * math.pi
    backlash: float = 200e-6


PRINTED, ASSUMED = Printed(), Assumed()


def wind_turbine_drivetrain(assumed: Assumed = ASSUMED, *, gravity: float = 9.80665) -> dict[str, Any]:
    """The chain of the paper: rotor 5, carrier 5, planets 3, sun 5, gear 1 5, gear 2 3, gear 3 5, generator 5.

    The tables are those of a file with model = "drivetrain", as `femgear.read_case` reads it.

    Parameters
    ----------
    assumed : Assumed
    gravity : float
        [m/s^2]
    """
    p, a = PRINTED, assumed
    length = dict(zip(("low", "intermediate", "high"), a.shaft_lengths))

    def body(name, inertia, mass, transverse, **others):
        return {
            "name": name,
            "inertia": f"{inertia!r} kg m^2",
            "mass": f"{mass!r} kg",
            "transverse_inertia": f"{transverse!r} kg m^2",
            **others,
        }

    def wheel(name, inertia, radius, **others):
        # a flat disc: mass 2 I / r^2, half the polar inertia about a diameter
        return body(name, inertia, 2.0 * inertia / radius**2, 0.5 * inertia, **others)

    def mesh(stiffness, ratio, phase=0.0):
        given = {"stiffness": f"{stiffness!r} N/m", "contact_ratio": ratio, "phase": phase}
        return given | ({"backlash": f"{a.backlash!r} m"} if math.isfinite(a.backlash) else {})

    def shaft(first, second, name, springs):
        bending, torsion = (f"{spring!r} N m/rad" for spring in springs)
        springs = {"bending": bending, "torsion": torsion, "shear_ratio": a.shear_ratio}
        return {"between": [first, second], "length": f"{length[name]!r} m", **springs}

    def stage(first, second, radii, teeth, wave, direction):
        # the second gear has the whole number of teeth nearest to the ratio of the radii
        return {
            "between": [first, second],
            "teeth": [teeth, round(teeth * radii[1] / radii[0])],
            "radii": [f"{radius!r} m" for radius in radii],
            "mesh": wave,
            "pressure_angle": f"{p.pressure_angle!r} rad",
            "direction": f"{direction!r} rad",
        }

    def bearing(body, radial, tilt=0.0):
        return {"body": body, "radial": f"{radial!r} N/m"} | ({"tilt": f"{tilt!r} N m/rad"} if tilt else {})

    planets = {
        "carrier": "carrier",
        "sun": "sun",
        "sun_radius": f"{p.sun_radius!r} m",
        "planet_radius": f"{p.planet_radius!r} m",
        "ring_teeth": a.ring_teeth,
        "sun_teeth": a.sun_teeth,
        "planet_mass": f"{2.0 * p.planet / p.planet_radius**2!r} kg",
        "planet_inertia": f"{p.planet!r} kg m^2",
        "planet_transverse_inertia": f"{0.5 * p.planet!r} kg m^2",
        "sun_mesh": mesh(p.planetary_mesh, a.planetary_contact_ratio),
        "ring_mesh": mesh(p.planetary_mesh, a.ring_contact_ratio, a.ring_phase),
        "pressure_angle": f"{p.pressure_angle!r} rad",
    }
    small, large = p.gear_2_radii
    first = mesh(p.mesh_12, a.contact_ratio_12)
    second = mesh(p.mesh_23, a.contact_ratio_23)
    return {
        "model": "drivetrain",
        "title": "Wind turbine drivetrain with shaft bending, 36 dof",
        "body": [
            # a rotor of three blades or more has half its polar inertia about a diameter
            body("rotor", p.rotor, a.rotor_mass, 0.5 * p.rotor),
            wheel("carrier", p.carrier, p.carrier_radius),
            wheel("sun", p.sun, p.sun_radius),
            wheel("gear 1", p.gear_1, p.gear_1_radius),
            wheel("gear 2", p.gear_2, p.gear_2_radii[1], tilts=False),
            wheel("gear 3", p.gear_3, p.gear_3_radius),
            body("generator", p.generator, a.generator_mass, a.generator_transverse),
        ],
        "shaft": [
            shaft("rotor", "carrier", "low", p.low_speed),
            shaft("sun", "gear 1", "intermediate", p.intermediate),
            shaft("gear 3", "generator", "high", p.high_speed),
        ],
        "planetary": [planets],
        "parallel": [
            stage("gear 1", "gear 2", (p.gear_1_radius, small), a.gear_1_teeth, first, a.direction_12),
            stage("gear 2", "gear 3", (large, p.gear_3_radius), a.gear_2_teeth, second, a.direction_23),
        ],
        "bearing": [
            bearing("rotor", a.rotor_bearing, a.rotor_tilt),
            bearing("carrier", a.carrier_bearing, a.tilt_bearing),
            bearing("sun", a.sun_bearing),
            bearing("gear 1", a.gear_bearing, a.tilt_bearing),
            bearing("gear 2", a.gear_bearing),
            bearing("gear 3", a.gear_bearing, a.tilt_bearing),
            bearing("generator", a.generator_bearing, a.tilt_bearing),
        ],
        "gravity": {"acceleration": f"{gravity!r} m/s^2"},
        "operation": {
            "speed": f"{p.speed!r} rad/s",
            "torque": [
                {"body": "rotor", "torque": f"{p.torque!r} N m"},
                {"body": "generator", "share": p.generator_share},
            ],
        },
        "simulation": {
            "duration": "60 s",
            "rate": "20 kHz",
            "start": "zero",
            "harmonics": 15,
            "damping_ratio": a.damping_ratio,
            "torsional": True,
        },
    }


def ratio_of_radii() -> float:
    """Generator over rotor speed by the printed radii, without sign."""
    p = PRINTED
    ring = p.sun_radius + 2.0 * p.planet_radius
    return (1.0 + ring / p.sun_radius) * p.gear_1_radius / p.gear_2_radii[0] * p.gear_2_radii[1] / p.gear_3_radius


@dataclass(frozen=True)
class ToothNumbers:
    """Teeth of ring, planet, sun, gear 1, gear 2 (small, large) and gear 3."""

    ring: int
    planet: int
    sun: int
    gear_1: int
    gear_2_small: int
    gear_2_large: int
    gear_3: int

    @property
    def ratio(self) -> float:
        """Of these teeth."""
        stages = self.gear_1 / self.gear_2_small * self.gear_2_large / self.gear_3
        return (1.0 + self.ring / self.sun) * stages

    def lines(self, speed: float = PRINTED.speed) -> np.ndarray:
        """Mesh frequencies (3,) [Hz] at a speed of the rotor [rad/s], by the speeds of the printed radii."""
        p = PRINTED
        sun = 1.0 + (p.sun_radius + 2.0 * p.planet_radius) / p.sun_radius
        second = sun * p.gear_1_radius / p.gear_2_radii[0]
        return speed / (2.0 * math.pi) * np.array([self.ring, self.gear_1 * sun, self.gear_2_large * second])

    def mismatch(self) -> np.ndarray:
        """Relative error (3,) of the printed lines."""
        return self.lines() / PRINTED.lines - 1.0

    @property
    def assembles(self) -> bool:
        """Whether three planets can be equally spaced."""
        return (self.ring + self.sun) % 3 == 0


# module 5 mm divides every printed radius: ratio and radii are exact, the printed lines are not met
RADII_TEETH = ToothNumbers(172, 64, 44, 116, 38, 74, 32)


def line_teeth() -> ToothNumbers:
    """Whole numbers nearest to the printed lines, with the ratios of the printed radii.

    For every stage the first gear comes within one tooth of its line, and of the numbers that are possible
    for
    the second the pair whose ratio is nearest to that of the radii is taken; planets must assemble at 120
    degrees.
    """
    p = PRINTED
    exact = ToothNumbers(1, 1, 1, 1, 1, 1, 1).lines()
    wanted = np.array(p.lines) / exact
    ring_ratio = (p.sun_radius + 2.0 * p.planet_radius) / p.sun_radius
    ring, sun = _nearest(wanted[0], ring_ratio, lambda r, s: (r + s) % 3 == 0)
    first = _nearest(wanted[1], p.gear_1_radius / p.gear_2_radii[0])
    second = _nearest(wanted[2], p.gear_2_radii[1] / p.gear_3_radius)
    # an odd difference takes the smaller planet, with a profile shift for the missing half tooth
    return ToothNumbers(ring, (ring - sun) // 2, sun, *first, *second)


def _nearest(wanted: float, ratio: float, allowed=lambda a, b: True) -> tuple[int, int]:
    """Whole numbers (a, b) with the smallest sum of the relative errors of a and of a / b."""
    best = min(
        (abs(a / wanted - 1.0) + abs(a / b / ratio - 1.0), a, b)
        for a in range(math.floor(wanted) - 1, math.ceil(wanted) + 2)
        for b in range(math.floor(a / ratio) - 1, math.ceil(a / ratio) + 2)
        if allowed(a, b)
    )
    return best[1], best[2]


def varied(name: str, factor: float) -> Assumed:
    """The assumptions with one number (or every member of one tuple) multiplied."""
    value = getattr(ASSUMED, name)
    changed = tuple(factor * v for v in value) if isinstance(value, tuple) else factor * value
    return replace(ASSUMED, **{name: changed})


def assumption_names() -> tuple[str, ...]:
    """Names of the assumed numbers."""
    return tuple(entry.name for entry in fields(Assumed))
