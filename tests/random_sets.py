"""Random valid planetary sets: in phase, out of phase and unequally spaced, two to seven planets."""

import math
from dataclasses import dataclass

import numpy as np

from femgear.case.gear_set import planetary_set
from femgear.case.sections import Case
from femgear.errors import GeometryError
from femgear.trains.elastic.checks import MOST_WINDING
from femgear.trains.reading import parse_case

KINDS = ("in phase", "out of phase", "unequal")
PLANETS = (2, 3, 4, 5, 6, 7)
# what the dynamics are asked for "at rest" [rpm of the input]
REST = 0.01
# another set is drawn where femgear refuses the geometry; so many refusals tell of a bad draw
MOST_DRAWS = 25


@dataclass(frozen=True)
class RandomSet:
    """A case that femgear accepts, and the codes of the sets that it refused before."""

    case: Case
    kind: str
    refused: tuple[str, ...]


def random_set(seed: int) -> RandomSet:
    """The valid set of a seed: kind and number of planets follow from it, all else is drawn.

    Other errors than refused geometry (`GeometryError` of the gears) are not caught.
    """
    rng = np.random.default_rng(seed)
    kind, planets = KINDS[seed % len(KINDS)], PLANETS[seed // len(KINDS) % len(PLANETS)]
    refused = []
    for _ in range(MOST_DRAWS):
        case = parse_case(_text(rng, kind, planets, f"random set {seed}: {kind}"), name=f"seed {seed}")
        try:
            planetary_set(case)
        except GeometryError as error:
            refused.append(error.code)
        else:
            return RandomSet(case, kind, tuple(refused))
    raise AssertionError(f"seed {seed}: no valid set in {MOST_DRAWS} draws, refused {refused}")


def symmetry(angles, teeth_sum: int) -> int:
    """Largest g for which a rotation by 2 pi/g takes every planet to the place of a planet."""
    places = _places(angles, teeth_sum)
    return max(
        g
        for g in range(1, len(places) + 1)
        if teeth_sum % g == 0 and {(p + teeth_sum // g) % teeth_sum for p in places} == set(places)
    )


def equal_planets(angles, teeth_sum: int) -> list[list[int]]:
    """Groups of planets (numbers from 0) that rotations of the whole arrangement take to one another."""
    places = _places(angles, teeth_sum)
    step = teeth_sum // symmetry(angles, teeth_sum)
    groups = {}
    for planet, place in enumerate(places):
        groups.setdefault(place % step, []).append(planet)
    return list(groups.values())


def _places(angles, teeth_sum: int) -> list[int]:
    """Assembly positions of the planets, counted from the first."""
    turns = (np.asarray(angles) - angles[0]) * teeth_sum / (2 * math.pi)
    return [int(place) % teeth_sum for place in np.rint(turns)]


def _text(rng, kind: str, planets: int, title: str) -> str:
    """Case file of one draw."""
    sun, planet, ring, angles = _arrangement(rng, kind, planets)
    module, alpha = 1e-3 * _log(rng, 0.5, 6.0), rng.uniform(17.5, 25.0)
    width = module * rng.uniform(6.0, 16.0)
    rack = {"addendum": rng.uniform(0.85, 1.0), "dedendum": rng.uniform(1.15, 1.3)}
    # the tool's tip has room for less rounding the larger the pressure angle
    room = (math.pi / 4 - rack["dedendum"] * math.tan(math.radians(alpha))) * math.cos(math.radians(alpha))
    rounding = min(0.38, 0.9 * room / (1 - math.sin(math.radians(alpha))))
    rack["root_radius"] = rng.uniform(0.4, 1.0) * rounding
    planet_shift = rng.uniform(0.0, 0.5)
    excess = 0.5 * (ring - sun - 2 * planet)  # what planet and ring ask for beyond sun and planet [modules]
    opening = rng.uniform(0.0, 1.0) * excess + rng.uniform(0.0, 0.6)
    find_both = rng.random() < 0.7  # the shifts of sun and ring, or the centre distance and that of the ring
    distance = module * (0.5 * (sun + planet) + opening)
    sun_root = 0.5 * sun + opening - planet_shift - rack["dedendum"]
    planet_root = 0.5 * planet + planet_shift - rack["dedendum"]
    ring_root = 0.5 * ring + planet_shift + opening - excess + 1.4
    sun_bore, planet_bore = (module * r * rng.uniform(0.45, 0.85) for r in (sun_root, planet_root))
    outer = module * (ring_root + rng.uniform(1.0, 4.5))
    young, poisson = _log(rng, 70e9, 215e9), rng.uniform(0.24, 0.35)
    density = rng.uniform(2700.0, 8000.0)
    # loads of usual gears: force per face width and module of one sun-planet mesh [N/m^2]
    force = _log(rng, 10e6, 80e6) * width * module * young / 206e9
    sign = 1.0 if rng.random() < 0.5 else -1.0
    sun_torque = sign * planets * force * 0.5 * module * sun * math.cos(math.radians(alpha))
    driven = "sun" if rng.random() < 0.5 else "carrier"
    torque = sun_torque if driven == "sun" else -sun_torque * (1 + ring / sun)
    # turns of the input in one mesh period
    turns = (sun + ring) / (sun * ring) if driven == "sun" else 1.0 / ring
    speed = 60.0 * turns * _log(rng, 100.0, 2000.0)
    # stiffnesses of two decades about that of one mesh, 15e9 N/m^2 for steel
    mesh = 15e9 * width * young / 206e9
    support, carrier, bearing = (mesh * _log(rng, 0.3, 30.0) for _ in range(3))
    if kind != "unequal" and planets > 2 and rng.random() < 0.15:
        support = 0.0  # three or more equally spaced planets hold a floating sun
    radial, tangential = (mesh * _log(rng, 0.3, 30.0) / (outer * width) for _ in range(2))
    area = math.pi * density * width
    sun_mass = area * ((0.5 * module * sun) ** 2 - sun_bore**2)
    planet_mass = area * ((0.5 * module * planet) ** 2 - planet_bore**2)
    sun_inertia = 0.5 * sun_mass * ((0.5 * module * sun) ** 2 + sun_bore**2)
    planet_inertia = 0.5 * planet_mass * ((0.5 * module * planet) ** 2 + planet_bore**2)
    carrier_mass = planets * planet_mass * rng.uniform(0.5, 3.0)
    carrier_inertia = carrier_mass * distance**2 * rng.uniform(0.4, 0.8)
    at_sun, at_carrier = (sun_inertia, sun_torque), (carrier_inertia, -sun_torque * (1 + ring / sun))
    lines = [
        f'title = "{title}"',
        "[set]",
        f"planets = {planets}",
        *([f'centre_distance = "{1e3 * distance!r} mm"'] if find_both else []),
        f'face_width = "{1e3 * width!r} mm"',
        *([] if angles is None else [f"planet_angles = {angles}".replace("'", '"')]),
        *([f'backlash = "{1e3 * module * rng.uniform(0.01, 0.06)!r} mm"'] if rng.random() < 0.5 else []),
        "[rack]",
        *(f"{key} = {value!r}" for key, value in rack.items()),
        "[material]",
        f'youngs_modulus = "{young!r} Pa"',
        f"poisson_ratio = {poisson!r}",
        f'density = "{density!r} kg/m^3"',
        "[sun]",
        f"teeth = {sun}",
        f'module = "{1e3 * module!r} mm"',
        f'pressure_angle = "{alpha!r} deg"',
        *([] if find_both else [f"profile_shift = {opening - planet_shift!r}"]),
        f'bore_radius = "{sun_bore!r} m"',
        f'mass = "{sun_mass!r} kg"',
        f'inertia = "{sun_inertia!r} kg m^2"',
        f'support_stiffness = "{support!r} N/m"',
        "[planet]",
        f"teeth = {planet}",
        f"profile_shift = {planet_shift!r}",
        f'bore_radius = "{planet_bore!r} m"',
        f'mass = "{planet_mass!r} kg"',
        f'inertia = "{planet_inertia!r} kg m^2"',
        f'bearing_stiffness = "{bearing!r} N/m"',
        "[ring]",
        f"teeth = {ring}",
        f'outer_radius = "{outer!r} m"',
        f'foundation_radial = "{radial!r} N/m^3"',
        f'foundation_tangential = "{tangential!r} N/m^3"',
        "[carrier]",
        f'mass = "{carrier_mass!r} kg"',
        f'inertia = "{carrier_inertia!r} kg m^2"',
        f'support_stiffness = "{carrier!r} N/m"',
        *_machine(rng, "motor", *(at_sun if driven == "sun" else at_carrier)),
        *_machine(rng, "brake", *(at_carrier if driven == "sun" else at_sun)),
        "[operation]",
        f'input = "{driven}"',
        'fixed = "ring"',
        f'torque = "{torque!r} N m"',
        f'speeds = ["{REST} rpm", "{speed!r} rpm"]',
        "[static]",
        "flank_elements = 5",
        "stresses = false",
        *(['members = "elastic"'] if rng.random() < 0.5 else []),
        "[dynamics]",
        f"damping_ratio = {_log(rng, 0.005, 0.08)!r}",
        "[housing]",
        f'sensor_angle = "{rng.uniform(-180.0, 180.0)!r} deg"',
    ]
    return "\n".join(lines) + "\n"


def _log(rng, low: float, high: float) -> float:
    """Value whose logarithm is equally distributed."""
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def _machine(rng, name: str, inertia: float, torque: float) -> list[str]:
    """Rotor on a coupling with a torsional frequency of 20 to 500 Hz, or none.

    The coupling is stiffer where the torque would wind it up by more than a radian: no coupling stands that,
    and deflections of a micrometre beside hundreds of turns have no digits left for their symmetry.
    """
    rotor, frequency = inertia * _log(rng, 1.0, 100.0), _log(rng, 20.0, 500.0)
    if rng.random() < 0.4:
        return []
    stiffness = max(inertia * (2 * math.pi * frequency) ** 2, abs(torque) / MOST_WINDING)
    return [f"[{name}]", f'inertia = "{rotor!r} kg m^2"', f'coupling_stiffness = "{stiffness!r} N m/rad"']


def _arrangement(rng, kind: str, planets: int):
    """Tooth numbers of sun, planet and ring that assemble, and angles of the planets [deg] or None."""
    while True:
        sun, planet = int(rng.integers(16, 43)), int(rng.integers(15, 31))
        ring = sun + 2 * planet + int(rng.integers(-1, 3))
        total = sun + ring
        # tips of neighbouring planets, a little shifted, at equal spacing
        closest = 2 * math.asin(min((planet + 3.0) / (sun + planet + 0.5), 1.0))
        if planets * closest > 2 * math.pi or ring > 96:
            continue
        if kind == "unequal":
            places = _unequal_places(rng, planets, total, math.ceil(closest / (2 * math.pi) * total))
            if places is None:
                continue
            first = rng.uniform(-180.0, 0.0)
            return sun, planet, ring, [f"{first + 360.0 * place / total!r} deg" for place in places]
        if total % planets or (sun % planets == 0) != (kind == "in phase"):
            continue
        if rng.random() < 0.5:
            return sun, planet, ring, None
        first = rng.uniform(-180.0, 0.0)
        return sun, planet, ring, [f"{first + 360.0 * n / planets!r} deg" for n in range(planets)]


def _unequal_places(rng, planets: int, total: int, closest: int) -> list[int] | None:
    """Assembly positions 0 .. total - 1, not all equally far apart; None where they do not fit.

    Some arrangements repeat two or three times around: opposite pairs, three pairs.
    """
    g = int(rng.choice([1, *(g for g in (2, 3) if planets % g == 0 and planets > g)]))
    if total % g:
        return None
    count, room = planets // g, total // g
    free = room - count * closest
    if free < 1:
        return None
    # the room that is left is shared at random, at most so much that the load of the widest gap finds planets
    cuts = np.sort(rng.integers(0, free + 1, count - 1))
    gaps = closest + np.diff(np.concatenate([[0], cuts, [free]]))
    if len(set(gaps.tolist())) == 1 or gaps.max() > 0.55 * total:
        return None
    places = np.concatenate([[0], np.cumsum(gaps)[:-1]])
    return [int(p + repeat * room) for repeat in range(g) for p in places]
