"""Tooth numbers for a wanted ratio: what assembles, how large it has to be for a torque, how its meshes are phased.

Every set is closed with the profile shifts of `femgear.gears.shifts.share_shifts`, stepped ones without shifts, and
rated by ISO 6336-2 and 6336-3 for long life with one factor for all load factors. Of similar gears the stress of roots
goes with T/m^3, that of flanks with the root of it: both give the module that a torque needs, and so the size.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from typing import Any

from femgear.errors import GeometryError
from femgear.gears.gear import Gear
from femgear.gears.iso6336 import contact_safety, nominal_contact_stress, root_safety, single_pair_factors
from femgear.gears.iso6336_root import nominal_root_stress
from femgear.gears.pair import GearPair
from femgear.gears.paired_planets import PAIRED, have_room, paired_ratio, paired_teeth, planet_places
from femgear.gears.planet_assembly import assembly_step, stepped_gears
from femgear.gears.profile import BasicRack
from femgear.gears.shifts import share_shifts

KINDS = {
    "planetary": ("sun", "planet", "ring"),
    "pair": ("gear 1", "gear 2"),
    "stepped": ("sun", "first planet", "second planet", "ring"),
    "double": ("sun", "inner planet", "outer planet", "ring"),
    "ravigneaux": ("small sun", "large sun", "short planet", "long planet", "ring"),
}
"""Kinds of gears that are searched, with the names of their gears."""
LEAST_TEETH, MOST_SUN_TEETH, MOST_PLANET_TEETH, MOST_TEETH = 14, 60, 120, 300
"""Fewest teeth of a gear, most of a sun or pinion (of a second planet gear too), of planets, of any gear."""
LARGEST_TOLERANCE = 0.2
"""Of the ratio that is asked for, relative to it."""
LEAST_UNSHIFTED = 17
"""Fewest teeth without shift: fewer are undercut at 20 degrees."""
_MESHES = {
    "planetary": ((0, 1), (1, 2)),
    "pair": ((0, 1),),
    "stepped": ((0, 1), (2, 3)),
    "double": ((0, 1), (1, 2), (2, 3)),
    "ravigneaux": ((0, 2), (2, 3), (1, 3), (3, 4)),
}
"""Both gears of every mesh by their numbers; the ring comes last."""
_TWO_MESHES = ("planet", "inner planet", "outer planet", "short planet", "long planet")
"""Planets whose teeth are bent both ways."""
_PLANES = {"ravigneaux": 2}
"""Gear planes of sets whose gears have one width, where these are several."""
MODULE_RATIOS = (0.6, 1.6)
"""Module of the second gear of a stepped planet over that of the first."""
_ANGLE, _RACK, _UNIT, _RIM = math.radians(20.0), BasicRack(1.0, 1.25, 0.25), 1e-3, 3.0
_STEEL = (206e9, 0.3)


@dataclass(frozen=True)
class ToothDemand:
    """What is asked of gears.

    Parameters
    ----------
    ratio : float
        Speed of the driving member over that of the driven one, without sign: above 1.
    kind : str
        Of `KINDS`.
    tolerance : float
        Largest relative deviation from the ratio.
    planets : tuple of int
        Numbers of planets to try, equally spaced.
    fixed : {"ring", "carrier", "sun"}, optional
        Member of a set that stands; the sun drives, or the ring where the sun stands. Of a Ravigneaux set the small sun
        drives and ``sun`` is the large one. By default the ring, of a Ravigneaux set the large sun.
    torque : float
        On sun or gear 1 [N m]; the sizes go with its third root, their order does not depend on it.
    width_ratio : float
        Face width of a mesh over the reference diameter of its smaller external gear.
    contact_limit, root_limit : float
        sigma_Hlim and sigma_Flim [Pa].
    load_factor : float
        Product of all load factors K.
    contact_safety, root_safety : float
        Least S_H and S_F.
    most : int
        Of sets to rate: of more those nearest to the ratio.
    """

    ratio: float
    kind: str = "planetary"
    tolerance: float = 0.02
    planets: tuple[int, ...] = (3,)
    fixed: str | None = None
    torque: float = 100.0
    width_ratio: float = 0.8
    contact_limit: float = 1500e6
    root_limit: float = 425e6
    load_factor: float = 1.5
    contact_safety: float = 1.1
    root_safety: float = 1.4
    most: int = 10_000

    @property
    def stands(self) -> str:
        """Member of a set that stands."""
        return self.fixed or ("sun" if self.kind == "ravigneaux" else "ring")


@dataclass(frozen=True)
class SizedTeeth:
    """Tooth numbers with the size that the torque asks for.

    Parameters
    ----------
    kind : str
        Of `KINDS`.
    teeth : tuple of int
        In the order of the names of the kind.
    planets : int
        Number of branches; 1 of a pair.
    ratio : float
        See `ToothDemand`.
    torques : tuple of float
        On the first gear of every mesh of one branch, without losses [N m].
    modules : tuple of float
        Of every mesh with one of its own [m].
    widths : tuple of float
        Face width of every mesh that has one of its own [m].
    diameter, volume : float
        Of the cylinder around the set, whose ring has a rim of three modules; of a pair the length over both gears and
        the volume of both [m], [m^3].
    decides : str
        Where the stress is that asks for this size.
    contact_ratio : tuple of float
        Transverse contact ratio of every mesh.
    left : tuple of str
        What the first mesh harmonic of sun and ring meshes leaves on the central members: "torque", "lateral force",
        or "nothing"; of a pair nothing is said.
    hunting : bool
        Whether every tooth meets every tooth of its mate.
    lacks : tuple of str
        Codes of what the teeth are warned of.
    """

    kind: str
    teeth: tuple[int, ...]
    planets: int
    ratio: float
    torques: tuple[float, ...]
    modules: tuple[float, ...]
    widths: tuple[float, ...]
    diameter: float
    volume: float
    decides: str
    contact_ratio: tuple[float, ...]
    left: tuple[str, ...]
    hunting: bool
    lacks: tuple[str, ...]


@dataclass(frozen=True)
class _UnitMesh:
    """A mesh of gears of a module of 1 mm, under a unit force over a unit width.

    Parameters
    ----------
    pair : GearPair
        Both gears.
    root : (2,) tuple of float
        Nominal root stress of either gear by the tangential force over the face width [Pa m/N].
    flank : float
        Nominal contact stress at the place that decides, squared, by the same [Pa^2 m/N].
    scale : float
        Module of this mesh over that of the first one of its set [1].
    """

    pair: GearPair
    root: tuple[float, float]
    flank: float
    scale: float = 1.0


def search_teeth(
    demand: ToothDemand, *, progress: Callable[[int, int], None] | None = None
) -> tuple[list[SizedTeeth], int]:
    """Find all tooth numbers that assemble and close, the smallest first, and count those beyond ``most``.

    Equally spaced planets, tips a module apart at least.

    Raises
    ------
    GeometryError
        A demand that nothing can meet (E-CHOICE, E-RANGE), or that no teeth meet (E-CHOICE).
    """
    _check(demand)
    listed, sized = candidates(demand), []
    wanted = listed[: demand.most]
    for number, (teeth, planets) in enumerate(wanted):
        try:
            sized.append(size_of(demand, teeth, planets))
        except GeometryError:  # does not close, or its neighbours touch
            continue
        finally:
            if progress is not None:
                progress(number + 1, len(wanted))
    if not sized:
        raise GeometryError(
            f"no {demand.kind} teeth with the ratio {demand.ratio:g}",
            code="E-CHOICE",
            key="--ratio",
            value=demand.ratio,
            limit=f"within {demand.tolerance:.3g} of it, gears of {LEAST_TEETH} to {MOST_TEETH} teeth that close",
            remedy=_remedy(demand),
        )
    return sorted(sized, key=lambda choice: choice.volume), len(listed) - len(wanted)


def _remedy(demand: ToothDemand) -> str:
    """Say what ratios the kind has, and where there may be teeth of the wanted one."""
    reach = _reach(demand)
    words = f"{demand.kind} teeth of this search have ratios of {reach[0]:.3g} to {reach[1]:.3g}; " if reach else ""
    first = "a larger --tolerance" if demand.tolerance < LARGEST_TOLERANCE else "another --ratio"
    return f"{words}{first}, another number of planets, or another kind"


def _reach(demand: ToothDemand) -> tuple[float, float] | None:
    """Least and largest ratio that limits of teeth and room leave to pairs and to simple and stepped sets."""
    sine = math.sin(math.pi / min(demand.planets))
    if demand.kind == "pair":
        return 1.0, MOST_TEETH / LEAST_TEETH
    if demand.kind == "planetary":
        suns, planets = range(LEAST_TEETH, MOST_SUN_TEETH + 1), range(LEAST_TEETH, MOST_PLANET_TEETH + 1)
        sets = [(s, p, p, s + 2 * p) for s, p in product(suns, planets) if (s + p) * sine >= p + 3]
    elif demand.kind == "stepped":
        few = range(LEAST_UNSHIFTED, MOST_SUN_TEETH // 2 + 1)
        low, high = MODULE_RATIOS
        sets = []
        for sun, second in product(few, few):
            for first in range(second + 1, MOST_PLANET_TEETH + 1):
                total = sun + first
                least = max(second + LEAST_UNSHIFTED + 1, second + math.ceil(total / high))
                if total * sine >= first + 3:
                    sets += [(sun, first, second, ring) for ring in (least, second + int(total / low))]
    else:
        return None
    inner = [ring * first / (sun * second) for sun, first, second, ring in sets if ring <= MOST_TEETH]
    ratios = [{"ring": 1.0 + share, "carrier": share, "sun": 1.0 + 1.0 / share}[demand.stands] for share in inner]
    return min(ratios), max(ratios)


def candidates(demand: ToothDemand) -> list[tuple[tuple[int, ...], int]]:
    """List teeth and numbers of planets of the ratio that assemble, nearest ratio first."""
    kinds = {"pair": _pairs, "planetary": _sets, "stepped": _stepped_sets}
    listed = kinds.get(demand.kind, _paired_sets)(demand)
    return sorted(listed, key=lambda teeth: (round(abs(_ratio(demand, teeth[0]) / demand.ratio - 1.0), 9), teeth))


def size_of(demand: ToothDemand, teeth: tuple[int, ...], planets: int) -> SizedTeeth:
    """Compute the size that gears need for the torque.

    GeometryError: teeth that do not close, are out of the range of ISO 6336, or planets that come nearer to one another
    than a module (E-NEIGHBOURS).
    """
    meshes, lacks = _closed(demand.kind, teeth)
    of_set, own_widths = demand.kind != "pair", demand.kind == "stepped"
    if demand.kind in PAIRED:
        _check_paired(teeth, planets)
    else:
        _check_room(meshes, planets)
    widths = [
        demand.width_ratio * 2.0 * m.scale * min(g.reference_radius for g in m.pair.gears if not g.internal)
        for m in meshes
    ]
    widths = widths if own_widths else [min(widths)] * len(meshes)
    torques = tuple(demand.torque / planets * share for share in _torques(demand, teeth))
    scale, decides = max(_needs(demand, meshes, widths, torques))
    of_modules, widths = (meshes, widths) if own_widths else (meshes[:1], widths[:1])
    along = widths * _PLANES.get(demand.kind, 1)
    diameter, volume = _envelope(meshes, along) if of_set else _pair_envelope(meshes[0].pair, widths[0])
    return SizedTeeth(
        kind=demand.kind,
        teeth=teeth,
        planets=planets,
        ratio=_ratio(demand, teeth),
        torques=torques,
        modules=tuple(scale * mesh.scale * mesh.pair.gear_1.module for mesh in of_modules),
        widths=tuple(scale * width for width in widths),
        diameter=scale * diameter,
        volume=scale**3 * volume,
        decides=decides,
        contact_ratio=tuple(mesh.pair.contact_ratio for mesh in meshes),
        left=tuple(_left(z, planets) for z in _central_teeth(demand.kind, teeth)),
        hunting=all(math.gcd(*(gear.teeth for gear in mesh.pair.gears)) == 1 for mesh in meshes),
        lacks=lacks,
    )


def _pairs(demand: ToothDemand) -> Iterator[tuple[tuple[int, ...], int]]:
    for first in range(LEAST_TEETH, MOST_SUN_TEETH + 1):
        yield from (((first, second), 1) for second in _near(demand, first))


def _sets(demand: ToothDemand) -> Iterator[tuple[tuple[int, ...], int]]:
    for sun, planets in product(range(LEAST_TEETH, MOST_SUN_TEETH + 1), demand.planets):
        for ring in _near(demand, sun):
            if (sun + ring) % planets == 0:
                for planet in sorted({(ring - sun) // 2, (ring - sun + 1) // 2}):
                    if LEAST_TEETH <= planet <= MOST_PLANET_TEETH:
                        yield (sun, planet, ring), planets


def _stepped_sets(demand: ToothDemand) -> Iterator[tuple[tuple[int, ...], int]]:
    low, high = MODULE_RATIOS
    few = range(LEAST_UNSHIFTED, MOST_SUN_TEETH // 2 + 1)
    for sun, second in product(few, few):
        for first in range(second + 1, MOST_PLANET_TEETH + 1):
            for ring in _near(demand, sun * second / first):
                if ring <= second + LEAST_UNSHIFTED or not low <= (sun + first) / (ring - second) <= high:
                    continue
                total = 1 / assembly_step(stepped_gears(sun, first, second, ring))
                yield from (((sun, first, second, ring), n) for n in demand.planets if (total / n).denominator == 1)


def _paired_sets(demand: ToothDemand) -> Iterator[tuple[tuple[int, ...], int]]:
    suns = range(LEAST_UNSHIFTED, MOST_SUN_TEETH + 1)
    others = range(LEAST_UNSHIFTED, MOST_SUN_TEETH // 2 + 1)
    return paired_teeth(demand.kind, demand.stands, _limits(demand), demand.planets, suns, others)


def _limits(demand: ToothDemand) -> tuple[float, float]:
    """Least and largest ratio that is taken."""
    away = demand.tolerance + 1e-12
    return demand.ratio * (1.0 - away), demand.ratio * (1.0 + away)


def _near(demand: ToothDemand, unit: float) -> range:
    """Teeth of the last gear whose ratio with those of all others, as one number, is near the wanted one."""
    ratios = [demand.ratio * (1.0 + side * demand.tolerance) for side in (-1.0, 1.0)]
    if demand.kind != "pair":
        ratios = sorted(_inner_ratio(ratio, demand.stands) for ratio in ratios)
    return range(
        max(math.ceil(ratios[0] * unit - 1e-9), LEAST_TEETH), min(int(ratios[1] * unit + 1e-9), MOST_TEETH) + 1
    )


def _inner_ratio(ratio: float, fixed: str) -> float:
    """Speed of the sun over that of the ring against the carrier, without sign, from the ratio."""
    return {"ring": ratio - 1.0, "carrier": ratio, "sun": 1.0 / max(ratio - 1.0, 1e-9)}[fixed]


def _ratio(demand: ToothDemand, teeth: tuple[int, ...]) -> float:
    if demand.kind == "pair":
        return teeth[1] / teeth[0]
    if demand.kind in PAIRED:
        return paired_ratio(teeth, demand.stands)
    inner = teeth[-1] / teeth[0] * (teeth[1] / teeth[2] if demand.kind == "stepped" else 1.0)
    return {"ring": 1.0 + inner, "carrier": inner, "sun": 1.0 + 1.0 / inner}[demand.stands]


def _central_teeth(kind: str, teeth: tuple[int, ...]) -> tuple[int, ...]:
    """Teeth of suns and rings."""
    numbers = (n for n, name in enumerate(KINDS[kind]) if name.endswith(("sun", "ring")))
    return tuple(teeth[number] for number in numbers)


def _left(teeth: int, planets: int) -> str:
    """What planets in the phases of a central gear leave of equal forces in the first mesh harmonic."""
    cyclic = teeth % planets
    return "torque" if cyclic == 0 else "lateral force" if cyclic in (1, planets - 1) else "nothing"


@lru_cache(maxsize=20_000)
def _closed(kind: str, teeth: tuple[int, ...]) -> tuple[tuple[_UnitMesh, ...], tuple[str, ...]]:
    """Meshes of closed gears, and what these lack."""
    if kind in ("planetary", "pair"):
        shared = share_shifts(teeth, _ANGLE, _RACK)
        return tuple(_unit_mesh(pair) for pair in shared.gears.kinds), shared.lacks
    names, meshes = KINDS[kind], list[_UnitMesh]()
    for first, second in _MESHES[kind]:
        # a stepped planet has one centre distance, whatever the teeth of its second gear
        step = (teeth[0] + teeth[1]) / (teeth[3] - teeth[2]) if (kind, first) == ("stepped", 2) else 1.0
        mesh = _standard_mesh((teeth[first], teeth[second]), internal=names[second] == "ring")
        meshes.append(replace(mesh, scale=step))
    return tuple(meshes), ()


@lru_cache(maxsize=20_000)
def _standard_mesh(teeth: tuple[int, int], *, internal: bool) -> _UnitMesh:
    """Gears without shift at their reference centre distance."""
    gears = [
        Gear(
            z,
            _UNIT,
            _ANGLE,
            0.0,
            10.0 * _UNIT,
            _UNIT * (0.5 * z + 8.0 if inside else 0.05 * z),
            internal=inside,
            rack=_RACK,
            name=f"gear_{number}",
            tip_open=True,
        )
        for number, (z, inside) in enumerate(zip(teeth, (False, internal), strict=True), start=1)
    ]
    return _unit_mesh(GearPair(gears[0], gears[1], 0.5 * _UNIT * (teeth[1] - teeth[0] if internal else sum(teeth))))


def _unit_mesh(pair: GearPair) -> _UnitMesh:
    """Rate a mesh under a unit force."""
    gears = pair.gears
    # on the width of the gears
    force: dict[str, Any] = {"contact_ratio": pair.contact_ratio, "tangential_force": pair.face_width}
    root = tuple(nominal_root_stress(gear, **force).stress for gear in gears)
    first, second = gears if gears[1].internal else sorted(gears, key=lambda gear: gear.teeth)
    working, steel = pair.working_pressure_angle, dict(zip(("youngs_modulus", "poisson_ratio"), _STEEL, strict=True))
    flank = nominal_contact_stress(first, second, working_angle=working, **force, **steel)
    flank *= max(single_pair_factors(*gears, working_angle=working, path=pair.path))
    return _UnitMesh(pair, (root[0], root[1]), flank**2)


def _torques(demand: ToothDemand, teeth: tuple[int, ...]) -> Iterator[float]:
    """Torque on the first gear of every mesh over that on the sun, without losses [1]."""
    if (demand.kind, demand.stands) == ("ravigneaux", "sun"):
        small, _, short, long, ring = teeth
        ratio = _ratio(demand, teeth)
        # the carrier has no torque: those of both suns and the ring balance
        yield from (1.0, short / small, ratio - 1.0, ratio * long / ring)
        return
    # one tangential force from the driven sun to the ring, a second sun turns along
    for first, _ in _MESHES[demand.kind]:
        idle = (demand.kind, first) == ("ravigneaux", 1)
        driver = 1 if (demand.kind, first) == ("stepped", 2) else first
        yield 0.0 if idle else teeth[driver] / teeth[0]


def _needs(
    demand: ToothDemand, meshes: Sequence[_UnitMesh], widths: Sequence[float], torques: Sequence[float]
) -> Iterator[tuple[float, str]]:
    """Scale of these gears at which every mesh of a branch has each of its safeties, with the place of the stress."""
    for mesh, width, numbers, torque in zip(meshes, widths, _MESHES[demand.kind], torques, strict=True):
        if not torque:
            continue
        names = [KINDS[demand.kind][number] for number in numbers]
        over_width = torque / (mesh.scale * mesh.pair.gear_1.reference_radius) / width
        for name, stress in zip(names, mesh.root, strict=True):
            both_ways = name in _TWO_MESHES
            safety = root_safety(
                demand.root_limit, stress / mesh.scale * over_width, demand.load_factor, reversed_bending=both_ways
            )
            yield (demand.root_safety / safety) ** (1.0 / 3.0), f"root of {name}"
        safety = contact_safety(
            demand.contact_limit, math.sqrt(mesh.flank / mesh.scale * over_width), demand.load_factor
        )
        yield (demand.contact_safety / safety) ** (2.0 / 3.0), f"flanks {'-'.join(names)}"


def _check_paired(teeth: tuple[int, ...], planets: int) -> None:
    """Refuse planets in mesh that do not reach each other, or whose tips come nearer to others than a module."""
    places = planet_places(teeth)
    if places is None or not have_room(places, teeth[0], teeth[-1], planets):
        raise GeometryError(f"{planets} branches have no room", code="E-NEIGHBOURS", limit="a module between tips")


def _check_room(meshes: Sequence[_UnitMesh], planets: int) -> None:
    """Refuse neighbours whose tips are less than a module apart."""
    if planets == 1:
        return
    centres = 2.0 * meshes[0].pair.centre_distance * math.sin(math.pi / planets)
    planets_of = [(meshes[0].pair.gear_2, 1.0), *((mesh.pair.gear_1, mesh.scale) for mesh in meshes[1:])]
    for planet, scale in planets_of:
        if centres < scale * (2.0 * planet.tip_radius + planet.module):
            raise GeometryError(f"{planets} planets have no room", code="E-NEIGHBOURS", limit="a module between tips")


def _envelope(meshes: Sequence[_UnitMesh], widths: Sequence[float]) -> tuple[float, float]:
    """Diameter and volume of the cylinder around a set [m, m^3]: ring and rim, or what planets reach beyond."""
    planet, ring, scale = meshes[0].pair.gear_2, meshes[-1].pair.gear_2, meshes[-1].scale
    reach = meshes[0].pair.centre_distance + planet.tip_radius
    outer = max(scale * (ring.root_radius + _RIM * ring.module), reach)
    return 2.0 * outer, math.pi * outer**2 * sum(widths)


def _pair_envelope(pair: GearPair, width: float) -> tuple[float, float]:
    """Length over both gears and their volume [m, m^3]."""
    tips = [gear.tip_radius for gear in pair.gears]
    return sum(tips) + pair.centre_distance, math.pi * sum(tip**2 for tip in tips) * width


def _check(demand: ToothDemand) -> None:
    """Refuse what nobody can ask for."""
    if demand.kind not in KINDS:
        message, limit = f"teeth of a {demand.kind!r}", ", ".join(KINDS)
        raise GeometryError(message, code="E-CHOICE", key="--kind", value=demand.kind, limit=limit)
    if demand.stands not in ("ring", "carrier", "sun"):
        message, limit = "no member of a set", "ring, carrier, sun"
        raise GeometryError(message, code="E-CHOICE", key="--fixed", value=demand.stands, limit=limit)
    if (demand.kind, demand.stands) == ("double", "sun"):
        message, limit = "a ring that drives its carrier slower than this turns", "ring, carrier"
        raise GeometryError(message, code="E-CHOICE", key="--fixed", value=demand.stands, limit=limit)
    numbers = {
        "--ratio": (demand.ratio, 1.0, 100.0),
        "--tolerance": (demand.tolerance, 0.0, LARGEST_TOLERANCE),
        "--torque": (demand.torque, 1e-3, 1e9),
        "--width-ratio": (demand.width_ratio, 0.05, 5.0),
        "--contact-limit": (demand.contact_limit, 1e6, 1e10),
        "--root-limit": (demand.root_limit, 1e6, 1e10),
        "--load-factor": (demand.load_factor, 1.0, 20.0),
        "--contact-safety": (demand.contact_safety, 0.1, 10.0),
        "--root-safety": (demand.root_safety, 0.1, 10.0),
        "--most": (demand.most, 1, 1_000_000),
    }
    ranges = [(key, *of_key) for key, of_key in numbers.items()]
    for key, value, low, high in (*ranges, *(("--planets", count, 2, 12) for count in demand.planets)):
        if not low <= value <= high:
            message = "a number that no teeth are searched for"
            raise GeometryError(message, code="E-RANGE", key=key, value=value, limit=f"{low:g} to {high:g}")
