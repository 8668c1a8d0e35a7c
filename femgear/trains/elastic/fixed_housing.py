"""Elastic set in a housing that stands still: a ring on supports, or a casing of a file, and what is heard.

The set turns in a structure without symmetry (`femgear.housing.two_way`); sensors and microphone stand on and
beside it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.gear_set import planetary_set, set_deviations
from femgear.findings import Finding
from femgear.gears.deviations import no_deviations, rotational_symmetry
from femgear.housing.carrier_orders import MeshPaths
from femgear.housing.casing_files import may_lack_compliance, missing_compliance
from femgear.housing.orders import order_level
from femgear.housing.sensor import SensorLines
from femgear.housing.sound import equivalent_sound, surface_sound
from femgear.housing.structure import FixedStructure, supported_ring
from femgear.housing.turn_stability import turn_stability
from femgear.housing.turning_errors import mean_excitation
from femgear.housing.two_way import TwoWayResponse, solve_two_way, structure_lines
from femgear.solvers.linear.modal import modal_damping, solve_modes
from femgear.trains.elastic.checks import (
    checked_speeds,
    fastest_mesh_frequency,
    fixed_diameters,
    housing_supports,
    imported_casing,
    record_periods,
)
from femgear.trains.elastic.excitation_limit import MODES_ABOVE
from femgear.trains.elastic.model import gears_alone, mesh_springs, ring_mesh_compliance
from femgear.trains.elastic.results import DynamicsResult, FixedHousing, HousingResult, ModesResult
from femgear.trains.elastic.runup import HeardSpeeds, heard_speeds

if TYPE_CHECKING:
    from femgear.case.sections import Case

_MOST_ORDERS = 2500
"""Carrier orders of the forces in a housing that stands still up to which more harmonics are looked at:
0.8 GB."""
_FEW_SPEEDS = 20
"""Speeds, at most, that are solved with twelve mesh harmonics in a housing that stands still."""
_JUDGED = 6
"""Mesh harmonics of the stiffness in the verdict of a housing that stands still, at most."""
_TURNING = 0.3
"""What a thousand unknowns of a seed and pattern take [s]."""
_STANDING = 42e3
"""What a mesh harmonic of a planet takes at one speed [bytes]."""


def fixed_part(case: Case, modes: ModesResult, carrier: np.ndarray, own: np.ndarray) -> FixedHousing:
    """Housing that stands still at some of the speeds (n_speeds,) of the carrier [rad/s].

    The first and the last of all are solved with more mesh harmonics too, some get a verdict.
    """
    count = len(carrier)
    wider, judged = (
        np.flatnonzero(np.isin(own, some)) for some in (checked_speeds(count, 2), checked_speeds(count))
    )
    return fixed_housing(case, modes, carrier[own], wider_at=wider, judged_at=judged)


def fixed_harmonics(case: Case, speeds: int | None = None) -> tuple[int, int]:
    """Choose the mesh harmonics of excitation and response of a ring on supports, the same at all speeds.

    Of the speeds of the case unless their number is given: of many, of planets that differ, and with errors
    that turn fewer harmonics, for the equations take time with their third power.
    """
    gears, deviations = planetary_set(case), set_deviations(case)
    alike = rotational_symmetry(deviations, gears) == gears.n_planets
    few = alike and (len(case.operation.speeds) if speeds is None else speeds) <= _FEW_SPEEDS
    excited = case.dynamics.mesh_harmonics or (12 if few else 6)
    return excited, case.dynamics.response_harmonics or 2 * excited


def fixed_housing(
    case: Case,
    modes: ModesResult,
    carrier: np.ndarray,
    *,
    both: bool = True,
    wider_at: Any = (),
    judged_at: Any = (),
    harmonics: tuple[int, int] | None = None,
) -> FixedHousing:
    """Make the structure of ring and casing, and solve for forces at speeds of the carrier [rad/s].

    Of the set in it, and if ``both`` in the ring on its foundation alone. The meshes keep what higher
    diameters give. At the speeds number ``wider_at`` also for forces of more mesh harmonics;
    those number ``judged_at`` get a Floquet verdict. With errors that turn the latter, and
    damping, are those of the mean of all planets and mesh periods.
    Supports damp nothing: gears and ring have the damping of the set without them. Gears in a casing of a
    file, which brings its own, have modal damping against a rigid ring.
    """
    gears, ring, n_max = planetary_set(case), modes.ring, fixed_diameters(case)
    low = {name: getattr(ring, name)[: n_max + 1] for name in ("compliance", "held_compliance")}
    excitation, flexibility = mesh_springs(gears, replace(ring, **low), modes.state)
    harmonics, damping = harmonics or fixed_harmonics(case), case.dynamics.damping_ratio
    highest = MODES_ABOVE * max(modes.reach, harmonics[1] * fastest_mesh_frequency(case, gears))
    paths = MeshPaths(gears.ring.teeth, tuple(gears.planet_angles), ring.load_angle, modes.symmetry)
    even = excitation
    if excitation.periods > 1:
        paths = replace(paths, symmetry=rotational_symmetry(no_deviations(gears), gears))
        even = mean_excitation(excitation, paths, int(np.sign(carrier[0])))
    mean, directions = even.stiffness.mean(axis=1), modes.model.system.W.copy()
    alone = solve_modes(
        gears_alone(modes.model, flexibility), mean, damping_ratio=damping, max_frequency=highest
    )
    directions[modes.model.ring_slice][modes.model.ring_diameter > n_max] = 0.0
    whole = replace(modes.model.system, W=directions, flexibility=flexibility)
    damped = modal_damping(whole, mean, damping)
    known: Any = {"max_diameter": n_max, "max_frequency": highest, "damping_ratio": damping}
    missing, own = "", paths
    if case.housing.structure:
        own = replace(paths, load_angle=0.0)
        structure, sensors, forces, missing = _casing(case, low["compliance"], highest)
    else:
        structure, sensors, forces = _ring_on_supports(case, modes, known)
    solved = partial(solve_two_way, alone, carrier_speed=carrier, harmonics=harmonics)
    joint = None if case.housing.structure else damped
    plain, one_way = supported_ring(ring.modes, (), **known), None
    if both:
        one_way = solved(excitation, plain, paths=paths, side_bands=0, damping=damped)
        one_way = replace(one_way, paths=replace(own, symmetry=one_way.paths.symmetry))
        drag = None if joint is None else one_way.drag @ (plain.wave_shape @ structure.wave_shape.conj().T)
        one_way = replace(one_way, drag=drag)
    two_way, wider = solved(excitation, structure, paths=own, damping=joint), list[TwoWayResponse]()
    # twice as many, or half as many again
    most = _MOST_ORDERS // (gears.n_planets // own.symmetry * (4 * n_max + 1))
    further: Any = next((more for half in (4, 3) if (more := _times(harmonics, half))[1] <= most), None)
    wider_at = np.asarray(wider_at if further else (), int)
    if len(wider_at):
        some: Any = {"carrier_speed": carrier[wider_at], "paths": own, "damping": joint}
        first = two_way.at(wider_at) if excitation.periods == 1 else solved(even, structure, **some)
        wider = [first, solved(even, structure, harmonics=further, **some)]
    multiplier = np.full(len(carrier), np.nan)
    if len(judged_at):
        multiplier[judged_at] = turn_stability(
            alone, excitation, structure, own, carrier[judged_at], damping=joint,
            harmonics=min(harmonics[0], _JUDGED),
        ).modulus  # fmt: skip
    multiplier **= 1.0 / two_way.turns
    told = sensors, forces, missing, tuple(wider), wider_at, multiplier
    excited = harmonics[0], further[0] if further else 0
    return FixedHousing(structure, two_way, one_way, excited, *told)


def _times(harmonics: tuple[int, int], half: int) -> tuple[int, ...]:
    return tuple(-(-half * h // 2) for h in harmonics)


def _casing(
    case: Case, compliance: np.ndarray, highest: float
) -> tuple[FixedStructure, tuple[str, ...], tuple[str, ...], str]:
    """Structure of a file with modes up to a frequency [Hz], and what static compliance it lacks.

    With the names of its sensors and of forces on the ground; compliance of the ring by nodal diameter.
    """
    expected = 1.0 / ring_mesh_compliance(compliance, case.ring.teeth, [0.0])[0, 0]
    known: Any = {"max_frequency": highest, "expected_stiffness": expected}
    structure, sensors, forces = imported_casing(case, planetary_set(case), **known)
    missing, given = "", case.housing.structure
    if given and may_lack_compliance(Path(case.name).parent / given.file):
        missing = " ".join(one.text for one in missing_compliance(structure, expected))
    return structure, sensors, forces, missing


def _ring_on_supports(
    case: Case, modes: ModesResult, known: Mapping[str, Any]
) -> tuple[FixedStructure, tuple[str, ...], tuple[str, ...]]:
    """Structure of a ring on supports with sensors all around, those of the case, and forces on the ground.

    Names of the latter two.
    """
    supports, points = housing_supports(case), 4 * (modes.max_diameter + 1)
    places = [(2 * np.pi * i / points, 0.0, 0.0, 1.0) for i in range(points)]
    places += [(one.angle, one.direction, 0.0, 1.0) for one in case.housing.sensor]
    for one in supports:
        for turned, stiffness in ((0.0, one.radial_stiffness), (0.5 * np.pi, one.tangential_stiffness)):
            places.append((one.angle, turned, one.width, stiffness))
    angle, turned, width, factor = np.array(places).T
    structure = supported_ring(
        modes.ring.modes, supports, **known, sensor_angles=angle, sensor_directions=turned,
        sensor_widths=width,
    )  # fmt: skip
    ways = [f"support {i} {way}" for i in range(1, len(supports) + 1) for way in ("radial", "tangential")]
    return structure.combined(np.diag(factor)), tuple(one.name for one in case.housing.sensor), tuple(ways)


def lines_in_housing(
    case: Case, dynamics: DynamicsResult, found: HousingResult, fixed: FixedHousing
) -> HousingResult:
    """What sensors and the microphone hear of the structure, by the forces of both routes."""
    structure, exact, top = fixed.structure, found.exact, dynamics.ring_radial.shape[-1] // 2
    count, first = structure.sensor_shape.shape[1], _radial_sensor(fixed, exact.sensor_angle, top)
    points = count - len(fixed.sensors) - len(fixed.forces)
    n, place = np.arange(-top, top + 1), 2 * np.pi * np.arange(points) / max(points, 1)
    wave = np.exp(1j * np.outer(place, n)) / max(points, 1)
    weights = np.column_stack([first, np.eye(count)[:, points:]])  # then all that have names
    named, sound = structure.combined(weights), None
    order, moved = structure_lines(named, fixed.two_way)
    lines = replace(exact, order=order, displacement=moved[:, 0], method=fixed_method(case))
    by_kind = moved[:, 1:][:, : len(fixed.sensors)], moved[:, 1 + len(fixed.sensors) :]
    outputs = dict(zip(("sensor", "force"), zip((fixed.sensors, fixed.forces), by_kind)))
    assert fixed.one_way is not None
    change, compared = np.full((2, len(lines.carrier_speed)), np.nan)
    if fixed.wider:
        at, levels = fixed.wider_at, list[np.ndarray]()
        for one in fixed.wider:
            order, wider = structure_lines(structure.combined(weights[:, :1]), one)
            here = replace(lines, order=order, displacement=wider[:, 0], turns=one.turns)
            levels.append(order_level(replace(here, carrier_speed=lines.carrier_speed[at])))
        change[at], compared[at] = 20.0 * np.log10(levels[1] / levels[0]), fixed.excited[1]
    order, one_way = structure_lines(structure.combined(weights[:, :1]), fixed.one_way)
    if points:
        around = structure.combined(np.eye(count)[:, :points])
        sound = _sound_around(around, fixed.two_way, lines, n, wave, found)
    elif structure.sensor_area is not None:
        velocity = 1j * np.outer(lines.base_speed, lines.order)[..., None] * np.swapaxes(moved[:, 1:], 1, 2)
        air = found.cylinder.density, found.cylinder.sound_speed
        pressure, power = equivalent_sound(velocity, structure.sensor_area, *air, found.microphone.distance)
        sound = pressure, None, power
    level = order_level(replace(lines, order=order, displacement=one_way[:, 0]))
    with np.errstate(divide="ignore", invalid="ignore"):  # of a sensor that stands still
        apart = 20.0 * np.log10(order_level(lines) / level)
    told = {
        "harmonics_change": change, "compared_harmonics": compared, "turn_multiplier": fixed.multiplier,
        "one_way_level": level, "one_way_difference": apart,
        "two_way_residual": fixed.two_way.residual, "order_tail": fixed.two_way.tail,
    }  # fmt: skip
    return replace(
        found, exact=lines, supported=told, missing=fixed.missing,
        outputs={kind: one for kind, one in outputs.items() if one[0]},
        sound=sound,
        excitation_limit=dynamics.response.mesh_frequency * fixed.excited[0],
    )  # fmt: skip


def _radial_sensor(fixed: FixedHousing, angle: float, top: int) -> np.ndarray:
    """Weights (n_sensors, ) of those of a structure that make the radial displacement at an angle [rad].

    Of the sensors around a ring, by waves up to a nodal diameter; of a casing its first sensor.
    """
    count = fixed.structure.sensor_shape.shape[1]
    points, weights = count - len(fixed.sensors) - len(fixed.forces), np.eye(count)[0]
    if points:
        n, place = np.arange(-top, top + 1), 2 * np.pi * np.arange(points) / points
        weights[:points] = (
            np.real(np.exp(1j * np.subtract.outer(angle, place)[:, None] * n).sum(axis=1)) / points
        )
    return weights


def heard_in_housing(
    case: Case, modes: ModesResult, carrier: np.ndarray, harmonics: tuple[int, int]
) -> HeardSpeeds:
    """What is kept of the run-up at speeds of the carrier [rad/s] in a housing that stands still."""
    fixed, place = (
        fixed_housing(case, modes, carrier, both=False, harmonics=harmonics),
        (case.housing.sensor_angle, case.ring.teeth),
    )
    first = _radial_sensor(fixed, place[0], modes.max_diameter)[:, None]
    order, moved = structure_lines(fixed.structure.combined(first), fixed.two_way)
    lines = SensorLines(order, moved[:, 0], carrier, *place, fixed_method(case))
    orders, some = fixed.two_way.order, fixed.two_way.force
    force = np.zeros((*some.shape[:2], orders[-1] + 1), complex)
    force[..., orders] = some
    return heard_speeds(force, lines)


def fixed_method(case: Case) -> str:
    """Name how the lines of a sensor are found, see `SensorLines`."""
    return "casing" if case.housing.structure else "supports" if case.housing.support else "exact"


def _sound_around(
    around: FixedStructure, two_way: TwoWayResponse, lines: SensorLines, n, wave, found: HousingResult
) -> tuple[np.ndarray, ...]:
    """Sound of a structure by its sensors around the outer surface, with waves (points, n)."""
    sound = list[tuple[np.ndarray, ...]]()
    speeds = np.arange(len(lines.base_speed))
    for some in np.array_split(speeds, -(-len(speeds) // 20)):  # fit into memory
        here = two_way.at(some)
        velocity = 1j * np.outer(lines.base_speed[some], lines.order)[..., None]
        waves = velocity * np.swapaxes(structure_lines(around, here)[1], 1, 2) @ wave.conj()
        sound.append(surface_sound(waves, n, lines.frequency[some], found.cylinder, found.microphone))
    return tuple(np.concatenate(parts) for parts in zip(*sound))


def housing_memory(case: Case, modes: ModesResult) -> float:
    """Estimate what one speed takes in a housing that stands still [bytes]."""
    planets = planetary_set(case).n_planets / modes.symmetry
    return _STANDING * planets * (fixed_harmonics(case)[1] + 1)


def turning_errors_time(case: Case) -> Iterator[Finding]:
    """Warn of minutes that errors which turn take in a housing that stands still (W-SIZE)."""
    gears, speeds = planetary_set(case), len(case.operation.speeds)
    periods = record_periods(case, gears)
    if not case.housing.stands_still or periods == 1:
        return
    unknowns = (2 * fixed_harmonics(case)[1] + 1) * (4 * fixed_diameters(case) + 1)
    seconds = speeds * (periods // 2 + 1) * gears.n_planets * (unknowns / 1e3) ** 2 * _TURNING
    if seconds > 60.0:
        yield Finding(
            "W-SIZE", "housing.support" if case.housing.support else "housing.structure",
            f"errors that turn over {periods} mesh periods may take up to {seconds / 60.0:.0f} min in a "
            f"housing that stands still, at {speeds} speeds",
            remedy="fewer speeds, mesh harmonics or nodal diameters, if that is too much",
        )  # fmt: skip
