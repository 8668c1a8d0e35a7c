"""Elastic set in a housing that stands still: a ring on supports, or a casing of a file, and what is heard.

The set turns in a structure without symmetry (`femgear.housing.two_way.response`); sensors and microphone stand on and
beside it.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.gear_set import planetary_set, set_deviations
from femgear.exchange.casing_files import may_lack_compliance, missing_compliance
from femgear.findings import Finding
from femgear.gears.deviations import common_period, no_deviations, rotational_symmetry
from femgear.housing.orders import order_level
from femgear.housing.sensor import SensorLines
from femgear.housing.sound import equivalent_sound, surface_sound
from femgear.housing.two_way.carrier_orders import MeshPaths, mean_excitation
from femgear.housing.two_way.response import TwoWayResponse, solve_two_way, structure_lines
from femgear.housing.two_way.set_damping import with_set_damping
from femgear.housing.two_way.structure import FixedStructure, equal_sectors, supported_ring
from femgear.solvers.linear.modal import modal_damping, undamped_modes
from femgear.stages.lumped_set import member_speeds
from femgear.trains.elastic.checks import (
    fixed_diameters,
    housing_supports,
    imported_casing,
)
from femgear.trains.elastic.excitation_limit import (
    MODES_ABOVE,
    FrequencyLimit,
    highest_excitation,
    limited,
)
from femgear.trains.elastic.model import gears_alone, mesh_springs, ring_mesh_compliance
from femgear.trains.elastic.outputs import lines_method
from femgear.trains.elastic.results import DynamicsResult, FixedHousing, HousingResult, JudgedTurn, ModesResult
from femgear.trains.elastic.runup import HeardSpeeds, heard_speeds, mesh_factors

if TYPE_CHECKING:
    from femgear.case.planetary import Case
    from femgear.system.system import MeshExcitation, Modes

_JUDGED = 6
"""Mesh harmonics of the stiffness in the verdict of a housing that stands still, at most."""
_ACCURACY, _ROUGH = 1e-1, 1e-4
"""Residual of the two-way response over the tolerance of the case (levels are then within 1e-6 of theirs); of
levels that are compared."""
_PRODUCTS, _FLOPS = 60, 1e10
"""Products of a solution with its blocks, and operations of one core in a second, roughly."""


@dataclass(frozen=True)
class _Surroundings:
    """Set, ring and casing for the two-way response.

    Parameters
    ----------
    gears : Modes
        Modes of gears and carrier without the ring.
    excitation : MeshExcitation
        Of the meshes, over their record.
    structure : FixedStructure
        Ring and casing that stand still.
    paths : MeshPaths
        Ways of the meshes around the ring.
    damping : matrix or None
        Damping of gears and ring together; where it is known, ``gears`` and ``structure`` have what it gives each
        of their modes.
    coupled : int
        Largest nodal diameter in which ring and meshes act both ways.
    """

    gears: Modes
    excitation: MeshExcitation
    structure: FixedStructure
    paths: MeshPaths
    damping: np.ndarray | None
    coupled: int

    def solve(self, carrier: np.ndarray, limit: FrequencyLimit, tolerance: float, **options) -> TwoWayResponse:
        """Solve for the forces at speeds of the carrier (n_speeds,) [rad/s], with a limit of each."""
        return solve_two_way(
            self.gears,
            self.excitation,
            self.structure,
            self.paths,
            carrier,
            damping=self.damping,
            harmonics=(limit.excitation, limit.response),
            tolerance=tolerance,
            **{"coupled_diameters": self.coupled} | options,
        )


class HousingModel:
    """Set that turns in a ring on supports or in a casing, at any speeds.

    Waves of a ring on supports beyond the nodal diameters that act on one another act on themselves alone; in
    a casing of a file the meshes keep what they give. Supports damp nothing: gears and ring have the damping
    of the set without them. Gears in a casing of a file, which brings its own, have modal damping against a
    rigid ring.

    Parameters
    ----------
    case : Case
        With a housing that stands still.
    modes : ModesResult
        Modes of the set on its ring.
    sense : float
        Of the carrier: its sign.
    """

    def __init__(self, case: Case, modes: ModesResult, sense: float):
        self.case, self.modes, self.sense = case, modes, int(np.sign(sense))
        self.highest, n_max = MODES_ABOVE * modes.reach, fixed_diameters(case)
        self.missing, ratio, top = "", case.dynamics.damping_ratio, modes.max_diameter
        options: Any = {"max_frequency": self.highest, "damping_ratio": ratio, "max_diameter": top}
        self.ring = supported_ring(modes.ring.modes, (), **options)
        if case.housing.structure:
            low = {name: getattr(modes.ring, name)[: n_max + 1] for name in ("compliance", "held_compliance")}
            casing = _casing(case, low["compliance"], self.highest)
            self.structure, self.sensors, self.forces, self.missing = casing
            self.springs = mesh_springs(planetary_set(case), replace(modes.ring, **low), modes.state)
        else:
            self.structure, self.sensors, self.forces = _ring_on_supports(case, modes, options)
            self.springs = modes.excitation, modes.model.system.flexibility

    def paths(self, *, even: bool = True) -> MeshPaths:
        """Paths of the meshes in the ring; ``even`` where errors that turn are left out."""
        gears, symmetry = planetary_set(self.case), self.modes.symmetry
        if self.modes.excitation.periods > 1:
            symmetry = rotational_symmetry(no_deviations(gears), gears)
        return MeshPaths(gears.ring.teeth, tuple(gears.planet_angles), self.modes.ring.load_angle, symmetry)

    def in_ring(self) -> _Surroundings:
        """The set in the ring on its foundation, without supports or casing."""
        return self._surroundings(self.ring, (self.modes.excitation, self.modes.model.system.flexibility), 0)

    @cached_property
    def housing(self) -> _Surroundings:
        """The set in its housing, made once for all parts of a run-up."""
        return self.in_housing()

    def in_housing(self, *, even: bool = False) -> _Surroundings:
        """The set in its housing; with the mean of errors that turn if ``even``."""
        around = self._surroundings(self.structure, self.springs, fixed_diameters(self.case))
        if even:
            around = replace(around, excitation=self._even(around.excitation))
        # the ring of a file is loaded where flanks touch
        return replace(around, paths=self.lines_paths)

    @property
    def lines_paths(self) -> MeshPaths:
        """Paths of the meshes in the housing."""
        return replace(self.paths(), load_angle=0.0) if self.case.housing.structure else self.paths()

    def _even(self, excitation: MeshExcitation) -> MeshExcitation:
        return mean_excitation(excitation, self.paths(), self.sense) if excitation.periods > 1 else excitation

    def _surroundings(self, structure: FixedStructure, springs, coupled: int) -> _Surroundings:
        (excitation, flexibility), ratio = springs, self.case.dynamics.damping_ratio
        mean, system = self._even(excitation).stiffness.mean(axis=1), self.modes.model.system
        alone = gears_alone(self.modes.model, flexibility)
        gears = undamped_modes(alone, mean, damping_ratio=ratio, max_frequency=self.highest)
        damping = None
        if len(structure.wave_order):
            damping = modal_damping(system, mean, ratio)
            gears, structure = with_set_damping(damping, gears, structure)
        return _Surroundings(gears, excitation, structure, self.paths(), damping, coupled)


def fixed_housing(
    case: Case, modes: ModesResult, carrier: np.ndarray, limit: FrequencyLimit, *, judged_at: object = ()
) -> FixedHousing:
    """Make the structure of ring and casing, and solve for forces at speeds (n,) of the carrier [rad/s].

    Of the set in it, and in the ring on its foundation alone; the excitation has a limit at every speed.
    Those number ``judged_at`` get a Floquet verdict.
    """
    model = HousingModel(case, modes, carrier[0])
    housing, ring, tolerance = model.in_housing(), model.in_ring(), _ACCURACY * case.dynamics.tolerance
    one_way, drag = ring.solve(carrier, limit, tolerance, side_bands=0), None
    if housing.damping is not None and one_way.drag is not None:
        drag = one_way.drag @ (ring.structure.wave_shape @ housing.structure.wave_shape.conj().T)
    paths = replace(model.lines_paths, symmetry=one_way.paths.symmetry)
    one_way = replace(one_way, paths=paths, drag=drag)
    two_way = housing.solve(carrier, limit, tolerance)
    judged = JudgedTurn(
        housing.gears,
        housing.excitation,
        housing.structure,
        housing.paths,
        housing.damping,
        carrier_speed=carrier,
        at=np.asarray(judged_at, int),
        turns=two_way.turns,
        harmonics=min(int(limit.excitation.min()), _JUDGED),
    )
    named = model.sensors, model.forces, model.missing
    return FixedHousing(housing.structure, two_way, one_way, *named, judged)


def lines_at_sensor(
    case: Case, modes: ModesResult, frequency: np.ndarray, carrier: np.ndarray, limit: FrequencyLimit
) -> SensorLines:
    """Compute lines of the sensor that has the level in a housing that stands still, roughly.

    At mesh frequencies (n,) [Hz] and speeds (n,) of the carrier [rad/s].

    See `femgear.trains.elastic.excitation_limit.Heard`; of errors that turn the mean alone.
    """
    model = HousingModel(case, modes, carrier[0])
    housing = model.in_housing(even=True)
    # a level that is compared is not worth minutes: nearly singular equations are told as such
    response = housing.solve(carrier, limit, _ROUGH, cycles=1)
    return _first_lines(case, modes, model, housing.structure, response)


def _first_lines(case: Case, modes: ModesResult, model, structure, two_way: TwoWayResponse) -> SensorLines:
    """Lines of the sensor that has the level; ``model`` knows the names of the others."""
    first = _radial_sensor(structure, model, case.housing.sensor_angle, modes.max_diameter)[:, None]
    order, moved = structure_lines(structure.combined(first), two_way)
    place = case.housing.sensor_angle, case.ring.teeth
    return SensorLines(order, moved[:, 0], two_way.carrier_speed, *place, lines_method(case), turns=two_way.turns)


def _casing(
    case: Case, compliance: np.ndarray, highest: float
) -> tuple[FixedStructure, tuple[str, ...], tuple[str, ...], str]:
    """Structure of a file with modes up to a frequency [Hz], and what static compliance it lacks.

    With the names of its sensors and of forces on the ground; compliance of the ring by nodal diameter.
    """
    expected = 1.0 / ring_mesh_compliance(compliance, case.ring.teeth, [0.0])[0, 0]
    options: Any = {"max_frequency": highest, "expected_stiffness": expected}
    structure, sensors, forces = imported_casing(case, planetary_set(case), **options)
    missing, given = "", case.housing.structure
    if given and may_lack_compliance(Path(case.name).parent / given.file):
        missing = " ".join(finding.text for finding in missing_compliance(structure, expected))
    return structure, sensors, forces, missing


def _ring_on_supports(
    case: Case, modes: ModesResult, options: Any
) -> tuple[FixedStructure, tuple[str, ...], tuple[str, ...]]:
    """Structure of a ring on supports with sensors all around, those of the case, and forces on the ground.

    Names of the latter two.
    """
    supports, points = housing_supports(case), 4 * (modes.max_diameter + 1)
    places = [(2 * np.pi * i / points, 0.0, 0.0, 1.0) for i in range(points)]
    radius = case.ring.outer_radius
    places += [(sensor.angle, sensor.direction, sensor.width / radius, 1.0) for sensor in case.housing.sensor]
    for support in supports:
        for turned, stiffness in ((0.0, support.radial_stiffness), (0.5 * np.pi, support.tangential_stiffness)):
            places.append((support.angle, turned, support.width, stiffness))
    angle, turned, width, factor = np.array(places).T
    # those around are asked for places between them
    waves = np.where(np.arange(len(angle)) < points, modes.max_diameter, np.inf)
    structure = supported_ring(
        modes.ring.modes,
        supports,
        **options,
        sensor_angles=angle,
        sensor_directions=turned,
        sensor_widths=width,
        sensor_waves=waves,
        rim=modes.ring.rim_compliance,
    )
    ways = [f"support {i} {way}" for i in range(1, len(supports) + 1) for way in ("radial", "tangential")]
    return structure.combined(np.diag(factor)), tuple(sensor.name for sensor in case.housing.sensor), tuple(ways)


def lines_in_housing(
    case: Case, dynamics: DynamicsResult, housing: HousingResult, fixed: FixedHousing
) -> HousingResult:
    """What sensors and the microphone hear of the structure, by the forces of both routes."""
    structure, exact, top = fixed.structure, housing.exact, dynamics.ring_radial.shape[-1] // 2
    count, first = structure.sensor_shape.shape[1], _radial_sensor(structure, fixed, exact.sensor_angle, top)
    points = count - len(fixed.sensors) - len(fixed.forces)
    n, place = np.arange(-top, top + 1), 2 * np.pi * np.arange(points) / max(points, 1)
    wave = np.exp(1j * np.outer(place, n)) / max(points, 1)
    weights = np.column_stack([first, np.eye(count)[:, points:]])  # then all that have names
    named, sound = structure.combined(weights), None
    order, moved = structure_lines(named, fixed.two_way)
    lines = replace(exact, order=order, displacement=moved[:, 0], method=lines_method(case))
    by_kind = moved[:, 1:][:, : len(fixed.sensors)], moved[:, 1 + len(fixed.sensors) :]
    outputs = dict(zip(("sensor", "force"), zip((fixed.sensors, fixed.forces), by_kind)))
    order, one_way = structure_lines(structure.combined(weights[:, :1]), fixed.one_way)
    if points:
        around = structure.combined(np.eye(count)[:, :points])
        sound = _sound_around(around, fixed.two_way, lines, n, wave, housing)
    elif structure.sensor_area is not None:
        velocity = 1j * np.outer(lines.base_speed, lines.order)[..., None] * np.swapaxes(moved[:, 1:], 1, 2)
        air = housing.cylinder.density, housing.cylinder.sound_speed
        pressure, power = equivalent_sound(velocity, structure.sensor_area, *air, housing.microphone.distance)
        sound = pressure, None, power
    level = order_level(replace(lines, order=order, displacement=one_way[:, 0]))
    with np.errstate(divide="ignore", invalid="ignore"):  # of a sensor that stands still
        apart = 20.0 * np.log10(order_level(lines) / level)
    attributes = {
        "one_way_level": level,
        "one_way_difference": apart,
        "two_way_residual": fixed.two_way.residual,
        "order_tail": fixed.two_way.tail,
        "two_way_radius": fixed.two_way.spectral_radius,
        "two_way_products": fixed.two_way.products,
        "dynamic_factor": two_way_factors(fixed.two_way),
    }
    return replace(
        housing,
        exact=lines,
        supported=attributes,
        judged=fixed.judged,
        missing=fixed.missing,
        outputs={kind: output for kind, output in outputs.items() if output[0]},
        sound=sound,
    )


def _radial_sensor(structure: FixedStructure, named, angle: float, top: int) -> np.ndarray:
    """Weights (n_sensors, ) of those of a structure that make the radial displacement at an angle [rad].

    Of the sensors around a ring, by waves up to a nodal diameter; of a casing its first sensor. ``named``
    knows the names of the others.
    """
    count = structure.sensor_shape.shape[1]
    points, weights = count - len(named.sensors) - len(named.forces), np.eye(count)[0]
    if points:
        n, place = np.arange(-top, top + 1), 2 * np.pi * np.arange(points) / points
        weights[:points] = np.real(np.exp(1j * np.subtract.outer(angle, place)[:, None] * n).sum(axis=1)) / points
    return weights


def heard_in_housing(
    model: HousingModel, carrier: np.ndarray, limit: FrequencyLimit, workers: int | None = None
) -> HeardSpeeds:
    """What is kept of the run-up at speeds (S,) of the carrier [rad/s] in a housing that stands still.

    By so many threads, default one for every core.
    """
    case, housing = model.case, model.housing
    two_way = housing.solve(carrier, limit, _ACCURACY * case.dynamics.tolerance, workers=workers)
    lines = _first_lines(case, model.modes, model, housing.structure, two_way)
    return heard_speeds(_forces_of_orders(two_way), lines)


def _forces_of_orders(two_way: TwoWayResponse) -> np.ndarray:
    """Mesh forces (n_speeds, n, K + 1) at all orders from 0 up [N], whole turns of the carrier for one order."""
    places = np.rint(two_way.order * two_way.turns).astype(int)
    force = np.zeros((*two_way.force.shape[:2], places[-1] + 1), complex)
    force[..., places] = two_way.force
    return force


def two_way_factors(two_way: TwoWayResponse) -> np.ndarray:
    """Compute K_v (n_speeds, 2) of sun-planet and planet-ring meshes, largest force over mean, speed by speed."""
    speeds = np.arange(len(two_way.force))
    parts = (_forces_of_orders(two_way.at(slice(i, i + 1))) for i in speeds)
    return np.concatenate([mesh_factors(force) for force in parts]) if len(speeds) else np.zeros((0, 2))


def _sound_around(
    around: FixedStructure, two_way: TwoWayResponse, lines: SensorLines, n, wave, housing: HousingResult
) -> tuple[np.ndarray, ...]:
    """Sound of a structure by its sensors around the outer surface, with waves (points, n)."""
    sound = list[tuple[np.ndarray, ...]]()
    speeds = np.arange(len(lines.base_speed))
    for numbers in np.array_split(speeds, -(-len(speeds) // 20)):  # fit into memory
        here = two_way.at(numbers)
        velocity = 1j * np.outer(lines.base_speed[numbers], lines.order)[..., None]
        waves = velocity * np.swapaxes(structure_lines(around, here)[1], 1, 2) @ wave.conj()
        sound.append(surface_sound(waves, n, lines.frequency[numbers], housing.cylinder, housing.microphone))
    return tuple(np.concatenate(parts) for parts in zip(*sound))


def housing_memory(case: Case, modes: ModesResult, limit: FrequencyLimit) -> np.ndarray:
    """Estimate what the results of each speed (n_speeds,) take in a housing that stands still [bytes]."""
    gears, periods = planetary_set(case), modes.excitation.periods
    reach, sectors = 2 * fixed_diameters(case), 1
    if not case.housing.structure:
        sectors = equal_sectors(housing_supports(case), reach + 1)
    of_meshes = 2 * (reach // sectors) + 1
    moved = 2 * reach + 1 + 2 * modes.max_diameter
    alike = modes.symmetry if periods == 1 else 1
    lines = moved * (2 * len(modes.ring.modes.frequency) + 4 * (modes.max_diameter + 1)) / alike
    return 16.0 * limit.response * periods * (2 * of_meshes * gears.n_planets / alike + 2 * lines)


def turning_errors_time(case: Case) -> Iterator[Finding]:
    """Warn of minutes that errors which turn take in a housing that stands still (W-SIZE)."""
    gears, speeds = planetary_set(case), np.array(case.operation.speeds)
    periods = common_period(set_deviations(case), gears, limit=sys.maxsize)[0]
    # a longer record is refused by the stages that need it
    if not case.housing.stands_still or not 1 < periods <= case.static.longest_record:
        return
    first = member_speeds(case, gears, speeds[0]).mesh_frequency
    frequency = first * speeds / speeds[0]
    up_to = case.dynamics.up_to or highest_excitation(case, 0.0, float(frequency.max()))
    kept = limited(case, frequency, up_to, given=case.dynamics.mesh_harmonics).response
    bands = 4 * fixed_diameters(case) + 1
    seconds = kept.sum() * periods * gears.n_planets * bands**2 * (8 * bands + 20 * _PRODUCTS) / _FLOPS
    if seconds > 60.0:
        yield Finding(
            "W-SIZE",
            "housing.support" if case.housing.support else "housing.structure",
            f"errors that turn over {periods} mesh periods may take up to {seconds / 60.0:.0f} min in a "
            f"housing that stands still, at {len(speeds)} speeds",
            remedy="fewer speeds or nodal diameters, or a lower dynamics.up_to, if that is too much",
        )
