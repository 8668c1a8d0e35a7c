"""Random valid planetary sets: in phase, out of phase and unequally spaced, two to seven planets.

Some have tip reliefs, materials and widths of single gears, leads, misalignments or helical teeth in slices
over the width, and supports of the ring; all have 8 to 64 positions and torques of either sign.
"""

import math
from dataclasses import dataclass

import numpy as np

from femgear.case.gear_set import set_deviations
from femgear.case.planetary import Case
from femgear.errors import GeometryError
from femgear.trains.elastic.checks import MOST_WINDING
from femgear.trains.reading import parse_case, with_values

KINDS = ("in phase", "out of phase", "unequal")
PLANETS = (2, 3, 4, 5, 6, 7)
# what the dynamics are asked for "at rest" [rpm of the input]
REST = 0.01
# another set is drawn where femgear refuses the geometry; so many refusals tell of a bad draw
MOST_DRAWS = 25
# of spur teeth, and of sets on supports: 500 sets are solved in less than an hour
MOST_SLICES, HARMONICS = 8, 12.0
# mesh frequency times module of sets on supports at least [m/s]
SLOWEST = 2.5


@dataclass(frozen=True)
class RandomSet:
    """A case that femgear accepts, the codes of the sets that it refused before, and `turn_of` its seed."""

    case: Case
    kind: str
    refused: tuple[str, ...]
    turn: int = 0

    @property
    def alike(self) -> bool:
        """Whether planets differ in their places alone: no axis is askew."""
        return not (self.case.planet.misalignment or self.case.sun.misalignment)

    @property
    def features(self) -> str:
        """What the set has beside plain spur gears on an even foundation, in words."""
        case = self.case
        gears = case.sun, case.planet, case.ring
        has = {
            "relief": any(one.kind == "tip relief" for gear in gears for one in gear.modifications),
            "materials": any(gear.material for gear in gears),
            "widths": any(gear.face_width for gear in gears),
            "slices": case.static.slices > 1,
            "askew": not self.alike,
            "helix": bool(case.set.helix_angle),
            "supports": bool(case.housing.support),
        }
        return ", ".join(name for name, here in has.items() if here) or "plain"


def random_set(seed: int) -> RandomSet:
    """The valid set of a seed: kind and number of planets follow from it, all else is drawn.

    Other errors than refused geometry (`GeometryError` of the gears) are not caught.
    """
    rng = np.random.default_rng(seed)
    kind, planets = KINDS[seed % len(KINDS)], PLANETS[seed // len(KINDS) % len(PLANETS)]
    refused = []
    for _ in range(MOST_DRAWS):
        plain = parse_case(_text(rng, kind, planets, f"random set {seed}: {kind}"), name=f"seed {seed}")
        try:
            case = with_values(plain, _features(rng, plain))
            # reliefs of tips that are shortened may begin beyond them
            set_deviations(case)
        except GeometryError as error:
            refused.append(error.code)
        else:
            return RandomSet(case, kind, tuple(refused), turn_of(seed))
    raise AssertionError(f"seed {seed}: no valid set in {MOST_DRAWS} draws, refused {refused}")


def turn_of(seed: int) -> int:
    """How often all kinds with all numbers of planets have been drawn before a seed."""
    return seed // (len(KINDS) * len(PLANETS))


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


def _features(rng, case: Case) -> dict[str, object]:
    """Entries that make a plain case of spur gears on an even foundation another one."""
    changed: dict[str, object] = {"static.positions": int(rng.integers(8, 65))}
    over_width = rng.random() < 0.3
    helical = over_width and rng.random() < 0.5
    modifications = {gear: [] for gear in case.gear_names}
    if rng.random() < 0.4:
        for gear in ("sun", "planet"):
            modifications[gear].append(_tip_relief(rng, case, gear))
    if rng.random() < 0.25:
        changed["planet.material"] = {
            "youngs_modulus": f"{case.material.youngs_modulus * rng.uniform(0.6, 1.4)!r} Pa",
            "density": f"{case.material.density * rng.uniform(0.6, 1.4)!r} kg/m^3",
        }
    if rng.random() < 0.25:
        # slices need meshes of one common width
        least = {"planet": 0.9, "sun": 1.0 if over_width else 0.9, "ring": 1.0 if over_width else 0.9}
        most = {"planet": 1.0 if over_width else 1.2, "sun": 1.2, "ring": 1.2}
        for gear in case.gear_names:
            width = 1e3 * case.set.face_width * rng.uniform(least[gear], most[gear])
            changed[f"{gear}.face_width"] = f"{width!r} mm"
    if over_width:
        changed |= _helix(rng, case) if helical else _askew(rng, case)
        for gear in case.gear_names:
            modifications[gear] += _leads(rng, case)
    changed |= {f"{gear}.modifications": tables for gear, tables in modifications.items() if tables}
    if rng.random() < 0.25:
        supports = [_support(rng, case) for _ in range(rng.integers(1, 5))]
        changed["housing.support"] = _apart(supports, case.ring.outer_radius)
        changed |= _few_harmonics(case)
    return changed


def _few_harmonics(case: Case) -> dict[str, object]:
    """Entries that leave one speed and few mesh harmonics: a housing that stands still takes long.

    So does the comparison with the whole excitation, whose end is in proportion to 1/module, at low speeds.
    """
    sun, ring = case.sun.teeth, case.ring.teeth
    a_turn = sun * ring / (sun + ring) if case.operation.input == "sun" else ring
    speed = max(case.operation.speeds[-1], 2.0 * math.pi / a_turn * SLOWEST / case.module)
    end = HARMONICS * a_turn * speed / (2.0 * math.pi)
    return {"operation.speeds": [f"{speed!r} rad/s"], "dynamics.up_to": f"{end!r} Hz"}


def _micrometres(rng, case: Case, low: float, high: float) -> str:
    """Length of so many micrometres at a module of 2 mm, in proportion for others."""
    return f"{rng.uniform(low, high) * case.module / 2e-3!r} um"


def _tip_relief(rng, case: Case, gear: str) -> dict[str, object]:
    """Relief that begins between the reference circle and the tip of a rack without shift."""
    share = rng.uniform(0.3, 0.8)
    diameter = case.module * (getattr(case, gear).teeth + 2.0 * case.rack.addendum * share)
    diameter += 2.0 * case.module * (getattr(case, gear).profile_shift or 0.0)
    return {
        "kind": "tip relief",
        "amount": _micrometres(rng, case, 1.0, 10.0),
        "start_diameter": f"{1e3 * diameter!r} mm",
        "shape": str(rng.choice(["linear", "parabolic"])),
    }


def _leads(rng, case: Case) -> list[dict[str, object]]:
    """One modification over the width of a gear, or none."""
    kind = str(rng.choice(["lead slope", "lead crowning", "end relief", "flank twist", "none", "none"]))
    if kind == "none":
        return []
    signed = kind in ("lead slope", "flank twist")
    table = {"kind": kind, "amount": _micrometres(rng, case, -6.0 if signed else 1.0, 6.0)}
    if kind == "end relief":
        table["length"] = f"{1e3 * case.set.face_width * rng.uniform(0.1, 0.3)!r} mm"
    return [table]


def _helix(rng, case: Case) -> dict[str, object]:
    """Helical teeth, with circles that grow as the transverse module does."""
    angle = math.radians(rng.uniform(5.0, 20.0))
    overlap = 1.2 * case.set.face_width * math.sin(angle) / (math.pi * case.module)
    changed: dict[str, object] = {
        "set.helix_angle": f"{math.degrees(angle) * (1.0 if rng.random() < 0.5 else -1.0)!r} deg",
        "ring.outer_radius": f"{case.ring.outer_radius / math.cos(angle)!r} m",
        "static.slices": max(int(rng.integers(5, 10)), math.ceil(6.0 * overlap) + 1),
    }
    if case.set.centre_distance is not None:
        changed["set.centre_distance"] = f"{1e3 * case.set.centre_distance / math.cos(angle)!r} mm"
    return changed


def _askew(rng, case: Case) -> dict[str, object]:
    """Slices of spur teeth; axes that are askew by some micrometres over the width, or that may tilt."""
    # slices cost most of the time: few of them stand for more
    changed: dict[str, object] = {"static.slices": min(int(rng.integers(5, 14)), MOST_SLICES)}

    def slope() -> str:
        return f"{rng.uniform(-3e-3, 3e-3) * case.module / case.set.face_width!r} rad"

    if rng.random() < 0.4:
        changed["sun.misalignment"] = {"x": slope(), "y": slope()}
    if rng.random() < 0.4:
        askew = int(rng.integers(1, case.set.planets + 1))
        changed["planet.misalignment"] = [{"planet": askew, "radial": slope(), "tangential": slope()}]
    if rng.random() < 0.3:
        stiffness = 15e9 * case.set.face_width**3 / 12 * case.material.youngs_modulus / 206e9
        changed["planet.tilt_stiffness"] = f"{stiffness * _log(rng, 1.0, 30.0)!r} N m/rad"
    return changed


def _support(rng, case: Case) -> dict[str, object]:
    """Foot or bolt of the ring, as stiff as some meshes."""
    mesh = 15e9 * case.set.face_width * case.material.youngs_modulus / 206e9
    area = case.ring.outer_radius * case.set.face_width
    return {
        "angle": f"{rng.uniform(-180.0, 180.0)!r} deg",
        "radial_stiffness": f"{mesh * _log(rng, 0.03, 3.0)!r} N/m",
        "tangential_stiffness": f"{mesh * _log(rng, 0.03, 3.0)!r} N/m",
        "width": f"{1e3 * case.module * rng.uniform(0.0, 8.0)!r} mm",
        "mass": f"{case.material.density * area * case.module * rng.uniform(0.0, 1.0)!r} kg",
    }


def _apart(supports: list[dict[str, object]], radius: float) -> list[dict[str, object]]:
    """Supports without those that overlap one before them on a circle of a radius [m]."""
    kept: list[dict[str, object]] = []
    places: list[tuple[float, float]] = []
    for support in supports:
        angle, width = (float(str(support[key]).partition(" ")[0]) for key in ("angle", "width"))
        angle, width = math.radians(angle), 1e-3 * width / radius
        away = [abs(math.remainder(angle - other, 2.0 * math.pi)) - 0.5 * (width + b) for other, b in places]
        if min(away, default=1.0) > 1e-3:
            kept.append(support)
            places.append((angle, width))
    return kept


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
