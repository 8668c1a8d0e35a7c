"""The lumped planetary set in its plane: mesh stiffness, play, bearings, weight, pin errors, modes, motions.

`planar_problem` joins a lumped set with its elements and forces for harmonic balance and time integration;
`with_bearing` adds a bearing between two central members, or between one and the housing; `planar_modes`
gives the modes at standstill with their kinds. `PlanarModel` and what follows it tell what the set does in a
periodic solution: orbits, forces, contact of its flanks.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from femgear.errors import CaseError
from femgear.solvers.continuation.branches import Branch, frequency_response_curve
from femgear.solvers.continuation.corrector import StepOptions
from femgear.solvers.linear.modal import modal_damping, solve_modes, viscous_damping
from femgear.solvers.linear.receptance import Reduction, reduce_problem
from femgear.solvers.periodic.harmonic_balance import displacements
from femgear.solvers.periodic.solution import FloquetVerdict, PeriodicSolution
from femgear.solvers.stability.floquet import floquet_verdicts
from femgear.system.assembler import (
    check_mesh_columns,
    column_groups,
    free_motions,
    gear_set_system,
    mesh_directions,
    mesh_elements,
    pin_directions,
)
from femgear.system.elements import GearMeshes, RadialBearings
from femgear.system.fourier import (
    FourierSeries,
    Series,
    StepSeries,
    SummedSeries,
    line_tail,
    series_of,
    tooth_lines,
)
from femgear.system.mode_kinds import gear_set_kinds
from femgear.system.rigid_bodies import CENTRAL, PlanarSet, PlanarTorque, flank_sign
from femgear.system.system import HarmonicForce, Modes, NonlinearSystem, element_forces

# natural frequencies closer than this, relative to the frequency, count as one
_SAME = 1e-3

TAIL_LIMIT = 0.05
"""Share of the amplitude in the upper half of the lines beyond which what they add up to is wrong."""
# limit points closer than this, relative to the frequency, are one: corners of contact split them
_SAME_FOLD = 2e-3
# deflection [m] that counts as much as the whole range of frequencies along a branch
_SCALE = 2e-3
# instants of a period; with two base frequencies of either phase
_SAMPLES = 2880
_GRID = (256, 48)
# relative errors of the monodromy matrices, and solutions judged together
_COARSE, _FINE, _BATCH = 1e-3, 1e-6, 32
# fluctuation of a force, relative to its mean, below which there is none: residual of the equations
_STILL = 1e-6
# what a curve holds of every point
_ALONG = ("points", "parameter", "tangent", "iterations", "error")


@dataclass(frozen=True)
class Clearances:
    """Radial clearances of the bearings, from the centred position [m]; None leaves a bearing linear.

    Parameters
    ----------
    carrier, ring, sun : float, optional
        Of the member's support in the housing.
    planets : float or (N,) array, optional
        Of the planet bearings.
    springs : int, optional
        Number of springs of each bearing, see `RadialBearings`; they turn with the carrier.
    smoothing : float
        [m]
    """

    carrier: float | None = None
    ring: float | None = None
    sun: float | None = None
    planets: float | np.ndarray | None = None
    springs: int | None = None
    smoothing: float = 0.0

    @property
    def bearings(self) -> tuple[str, ...]:
        """The bearings that have a clearance."""
        return tuple(name for name in (*CENTRAL, "planets") if getattr(self, name) is not None)


@dataclass(frozen=True)
class Gravity:
    """Weight of all bodies, which turns backwards in the carrier frame.

    Parameters
    ----------
    acceleration : float
        [m/s^2]
    direction : float
        Angle of the weight from the x axis when the carrier's phase is zero [rad]; downwards along -y.
    orders : tuple of int, optional
        Multiples of the base frequencies that make the carrier's phase; None for a carrier that stands.
        With a counter-clockwise carrier ``(0, 1)`` says that it turns with the second base frequency.
    """

    acceleration: float = 9.80665
    direction: float = -0.5 * math.pi
    orders: tuple[int, ...] | None = (0, 1)


def planar_problem(
    data: PlanarSet,
    *,
    meshes: GearMeshes | None = None,
    back_flanks: bool = False,
    torque: PlanarTorque | None = None,
    clearances: Clearances | None = None,
    gravity: Gravity | None = None,
    pin_errors=None,
    carrier_speed: float = 0.0,
    damping: float | np.ndarray | None = None,
) -> NonlinearSystem:
    """Lumped set with its elements and forces.

    Parameters
    ----------
    data : PlanarSet
    meshes : GearMeshes, optional
        From `mesh_elements`; constant stiffnesses without back side when not given.
    back_flanks : bool
        The back flanks act on their own lines of action, with the stiffness of the drive side, so that teeth
        can wedge; otherwise they act on the line of the drive flanks.
    torque : PlanarTorque, optional
    clearances : Clearances, optional
        A bearing with a clearance acts on columns of its own; its stiffness is not in ``K``.
    gravity : Gravity, optional
    pin_errors : (N, 2) array, optional
        Radial (outwards) and tangential (counter-clockwise) displacement of the pins [m], from which the
        coordinates of the planets then count. Not to be given again when the static record holds them.
    carrier_speed : float
        See `gear_set_system`.
    damping : float, (n_modes,) array or (n, n) array, optional
        Damping ratio of all modes, or one a mode, at standstill with mean stiffnesses and closed bearings;
        or the matrix ``C``.

    Raises
    ------
    CaseError
        A load that accelerates the set (E-LOAD-BALANCE), back flanks without backlash (E-BACKLASH), a
        bearing without stiffness (E-BEARING), arrays that do not fit (E-SHAPE).
    """
    bearings = clearances.bearings if clearances else ()
    pins = np.zeros((data.n_planets, 2)) if pin_errors is None else _pins(data, pin_errors)
    groups = column_groups(data, back_flanks=back_flanks, bearings=bearings)
    meshes = mesh_elements(data) if meshes is None else meshes
    check_mesh_columns(data, meshes)
    elements = _mesh_elements(data, meshes, pins, flank_sign(data, torque), groups)
    elements += _bearing_elements(data, clearances, groups)
    options = {"torque": torque, "back_flanks": back_flanks, "bearings": bearings}
    still = gear_set_system(data, **options)
    reference = NonlinearSystem(still, elements).reference
    # teeth in the middle of the drive flanks do not touch their back flanks
    reference[groups.get("back flanks", np.arange(0))] = 0.0
    # refuses a load that nothing takes up before a solver drifts away with it
    solve_modes(still, reference)
    system = gear_set_system(data, carrier_speed=carrier_speed, **options)
    steady, forces = _weight(data, gravity)
    load = system.load + steady + _pin_inertia(data, pins, carrier_speed)
    system = replace(system, load=load, C=viscous_damping(still, reference, damping))
    return NonlinearSystem(system, elements, forces, speed=carrier_speed)


def pin_deflections(data: PlanarSet, pin_errors, *, flank: int = 1) -> np.ndarray:
    """Approach of the flanks (2N,) [m] by displaced pins (N, 2), all bodies resting in their bearings."""
    shifted = np.zeros((data.n_planets + 3, 3))
    shifted[3:, :2] = _pins(data, pin_errors)
    return mesh_directions(data, flank).T @ shifted.ravel()


def phased_series(sun_planet, planet_ring, phases, *, mean, orders: tuple[int, ...] = (1,)) -> FourierSeries:
    """Stiffness of the 2N meshes from one wave of each kind, shifted by the mesh phases.

    Parameters
    ----------
    sun_planet, planet_ring : (H,) complex arrays
        Harmonics 1 to H of the stiffness over its mean, at phase zero; the shorter one is filled with zeros.
    phases : (2N,) array
        phi_j as fractions of the mesh period, ``k_j(tau) = k(tau + phi_j)``: `PlanetarySet.mesh_phases`
        (Parker and Lin, J. Mech. Des. 126, 2004).
    mean : (2N,) array
        [N/m], such as `PlanarSet.mesh_stiffness`.
    orders : tuple of int
        Multiples of the base frequencies that make the mesh frequency.
    """
    phases, mean = np.asarray(phases, float), np.asarray(mean, float)
    if phases.ndim != 1 or len(phases) % 2 or phases.shape != mean.shape:
        raise CaseError(
            f"{phases.size} phases and {mean.size} mean stiffnesses", code="E-SHAPE", limit="2N of each"
        )
    lines = tooth_lines(sun_planet, planet_ring, phases)
    return FourierSeries(mean[:, None] * np.column_stack([np.ones(len(phases)), lines]), orders)


def _mesh_elements(data: PlanarSet, meshes: GearMeshes, pins, flank: int, groups) -> tuple[GearMeshes, ...]:
    """The meshes with the approach by the pins, and the back flanks on their own lines."""
    drive = replace(meshes, deflection=_raised(meshes.state[0], -pin_deflections(data, pins, flank=flank)))
    if "back flanks" not in groups:
        return (drive,)
    if not np.all(np.isfinite(meshes.backlash)) or not meshes.separates:
        raise CaseError(
            "back flanks need the backlash of every mesh, and meshes that separate", code="E-BACKLASH",
            key="backlash", remedy="give a finite backlash, or leave the back flanks out",
        )  # fmt: skip
    behind = meshes.backlash - pin_deflections(data, pins, flank=-flank)
    start = _raised(_unloaded(meshes), behind, sign=-1.0)
    back = replace(meshes, columns=groups["back flanks"], deflection=start, force=None, backlash=np.inf)
    return replace(drive, backlash=np.inf), back


def _unloaded(meshes: GearMeshes) -> Series:
    """Deflection at which the mesh line carries nothing, ``deflection - force / k``."""
    deflection, force = meshes.state
    if isinstance(force, FourierSeries) and not np.any(force.amplitudes):
        return deflection
    series = [one for one in (meshes.stiffness, deflection, force) if isinstance(one, FourierSeries)]
    if len(series) < 3:
        raise CaseError(
            "back flanks cannot follow a stepwise record that holds mesh forces", code="E-BACKLASH",
            remedy="give Fourier series, or the unloaded deflection with no force",
        )  # fmt: skip
    # the quotient of two series has no last harmonic: sample finely, keep what the samples resolve
    count = max(one.amplitudes.shape[1] for one in series)
    phase = 2.0 * np.pi * np.arange(16 * count)[:, None] / (16 * count)
    k, deflection, force = (replace(one, orders=(1,)).at(phase) for one in series)
    return series_of((deflection - force / k).T, 4 * count, orders=series[0].orders)


def _raised(series: Series, offset, *, sign: float = 1.0) -> Series:
    """The series times a sign, with a constant (2N,) added."""
    if isinstance(series, StepSeries):
        return replace(series, values=sign * series.values + offset[:, None])
    if isinstance(series, SummedSeries):
        offsets = [offset] + [np.zeros_like(offset)] * (len(series.parts) - 1)
        parts = (_raised(one, part, sign=sign) for one, part in zip(series.parts, offsets))
        return SummedSeries(tuple(one for one in parts if isinstance(one, FourierSeries)))
    amplitudes = sign * series.amplitudes
    amplitudes[:, 0] += offset
    return replace(series, amplitudes=amplitudes)


def _bearing_elements(data: PlanarSet, clearances: Clearances | None, groups) -> tuple[RadialBearings, ...]:
    elements = []
    if clearances is None:
        return ()
    for name in clearances.bearings:
        stiffness = data.planet_bearing if name == "planets" else getattr(data, name).support
        if np.any(np.asarray(stiffness) == 0.0):
            raise CaseError(
                f"the bearing of the {name} has a clearance but no stiffness", code="E-BEARING",
                remedy="give it a support stiffness, or leave the clearance out",
            )  # fmt: skip
        options = {"springs": clearances.springs, "smoothing": clearances.smoothing}
        elements.append(RadialBearings(groups[name], stiffness, getattr(clearances, name), **options))
    return tuple(elements)


def _weight(data: PlanarSet, gravity: Gravity | None) -> tuple[np.ndarray, tuple[HarmonicForce, ...]]:
    """Steady load (n,) and harmonic forces of the weight.

    In the carrier frame the weight stands at ``direction - theta_c``. On x and y of a member it is the real
    part of ``m g (1, -i) exp(i (direction - theta_c))``, which is order -1 of the carrier; its conjugate
    with order +1 is the same force.
    """
    T = free_motions(data)
    if gravity is None:
        return np.zeros(T.shape[1]), ()
    force = np.zeros((data.n_planets + 3, 3), complex)
    masses = [getattr(data, name).mass for name in CENTRAL] + [data.planet.mass] * data.n_planets
    axis = np.concatenate([np.zeros(3), data.planet_angles])
    force[:, 0] = np.array(masses) * gravity.acceleration * np.exp(1j * (gravity.direction - axis))
    force[:, 1] = -1j * force[:, 0]
    reduced = T.T @ force.ravel()
    if gravity.orders is None:
        return np.real(reduced), ()
    return np.zeros(T.shape[1]), (HarmonicForce(reduced.conj(), gravity.orders),)


def _pins(data: PlanarSet, pin_errors) -> np.ndarray:
    pins = np.asarray(pin_errors, float)
    if pins.shape != (data.n_planets, 2) or not np.all(np.isfinite(pins)):
        raise CaseError(
            f"pin errors of shape {pins.shape}", code="E-SHAPE", key="pin_errors",
            limit=f"({data.n_planets}, 2) finite numbers, radial and tangential",
        )  # fmt: skip
    return pins


def _pin_inertia(data: PlanarSet, pins: np.ndarray, carrier_speed: float) -> np.ndarray:
    """Centrifugal force (n,) of the planets by the displacement of their pins."""
    force = np.zeros((data.n_planets + 3, 3))
    force[3:, :2] = carrier_speed**2 * data.planet.mass * pins
    return free_motions(data).T @ force.ravel()


@dataclass(frozen=True)
class MemberBearing:
    """A radial bearing between two central members, or between one and the housing.

    Parameters
    ----------
    stiffness : float
        [N/m]
    clearance : float or None
        Radial, from the centred position [m]; None leaves the columns without a bearing.
    inner, outer : str
        ``"carrier"``, ``"ring"`` or ``"sun"``; ``outer`` also ``"housing"``.
    """

    stiffness: float
    clearance: float | None = 0.0
    inner: str = "carrier"
    outer: str = "housing"

    def __post_init__(self):
        if self.inner not in CENTRAL or self.outer not in (*CENTRAL, "housing") or self.inner == self.outer:
            raise CaseError(
                f"a bearing between {self.inner!r} and {self.outer!r}", code="E-BEARING",
                limit="two of carrier, ring, sun, or one of them and the housing",
            )  # fmt: skip


def with_bearing(problem: NonlinearSystem, data: PlanarSet, bearing: MemberBearing) -> NonlinearSystem:
    """The set with one more bearing, on the two last columns: x and y of the inner less the outer member.

    Parameters
    ----------
    problem : NonlinearSystem
        From `planar_problem`.
    data : PlanarSet
    bearing : MemberBearing

    Returns
    -------
    NonlinearSystem
        Its damping is that of ``problem``; see `bearing_damping_matrix` for that of the closed bearing.
    """
    columns = np.zeros((3 * (data.n_planets + 3), 2))
    for name, sign in ((bearing.inner, 1.0), (bearing.outer, -1.0)):
        if name in CENTRAL:
            first = 3 * CENTRAL.index(name)
            columns[[first, first + 1], [0, 1]] = sign
    count = problem.system.W.shape[1]
    W = np.hstack([problem.system.W, free_motions(data).T @ columns])
    elements = problem.elements
    if bearing.clearance is not None:
        place = np.array([[count, count + 1]])
        elements += (RadialBearings(place, bearing.stiffness, bearing.clearance),)
    return replace(problem, system=replace(problem.system, W=W), elements=elements)


def closed_springs(
    problem: NonlinearSystem, data: PlanarSet, bearing: MemberBearing | None = None
) -> np.ndarray:
    """Springs (n_columns,) [N/m] near which the set works: bearings closed, back flanks open.

    The elements' own reference counts back flanks as closed, far from where the set works.

    Parameters
    ----------
    problem : NonlinearSystem
    data : PlanarSet
    bearing : MemberBearing, optional
        On the last two columns; closed whatever its clearance.
    """
    reference = open_back_flanks(problem, data.n_planets)
    if bearing is not None:
        reference[-2:] = bearing.stiffness
    return reference


def open_back_flanks(problem: NonlinearSystem, n_planets: int) -> np.ndarray:
    """Reference springs (n_columns,) [N/m] of the elements, without those of the columns of back flanks."""
    reference, meshes = problem.reference, 2 * n_planets
    for element in problem.elements[1:]:
        if isinstance(element, GearMeshes) and element.columns[0, 0] == meshes:
            reference[meshes : 2 * meshes] = 0.0
    return reference


def bearing_damping_matrix(
    problem: NonlinearSystem, springs: np.ndarray, ratios: float | Sequence[float]
) -> np.ndarray:
    """Viscous damping ``C`` (n, n) of modal ratios, for the modes at standstill with given springs.

    Parameters
    ----------
    problem : NonlinearSystem
        At standstill.
    springs : (n_columns,) array
        Such as `closed_springs` [N/m].
    ratios : float or sequence of float
        Of all modes; a sequence gives one a natural frequency (a pair of modes has one), ascending, the last
        one for the rest. Motions at frequency zero have none and do not count.
    """
    bare = replace(problem.system, C=np.zeros_like(problem.system.C))
    frequency = solve_modes(bare, springs).frequency
    return modal_damping(bare, springs, mode_ratios(frequency, ratios))


def mode_ratios(frequency: np.ndarray, ratios: float | Sequence[float]) -> np.ndarray:
    """Damping ratio (m,) of every mode from one a natural frequency; see `bearing_damping_matrix`."""
    given = np.atleast_1d(np.asarray(ratios, float))
    moving = frequency > 0.0
    steps = np.diff(frequency[moving], prepend=0.0) > _SAME * frequency[moving]
    number = np.clip(np.cumsum(steps) - 1, 0, len(given) - 1)
    out = np.zeros(len(frequency))
    out[moving] = given[number]
    return out


def planar_modes(data: PlanarSet, *, mesh_stiffness=None, damping_ratio: float = 0.0) -> Modes:
    """Modes of the set at standstill, with their kinds.

    Parameters
    ----------
    data : PlanarSet
    mesh_stiffness : (2N,) array, optional
        [N/m]; that of the set when not given.
    damping_ratio : float
        Of all modes.

    Returns
    -------
    Modes
        ``kind`` from `gear_set_kinds`.
    """
    stiffness = data.mesh_stiffness if mesh_stiffness is None else mesh_stiffness
    modes = solve_modes(gear_set_system(data), stiffness, damping_ratio=damping_ratio)
    return replace(modes, kind=gear_set_kinds(data, modes.shape, frequency=modes.frequency))


@dataclass(frozen=True, eq=False)
class PlanarModel:
    """A lumped set ready to be solved, and where its elements act.

    Parameters
    ----------
    data : PlanarSet
    problem : NonlinearSystem
    back_flanks : bool
        The back flanks have columns of their own.
    planet_clearance : bool
        The planet bearings are elements.
    bearing : MemberBearing, optional
        On the last two columns.
    """

    data: PlanarSet
    problem: NonlinearSystem
    back_flanks: bool = False
    planet_clearance: bool = False
    bearing: MemberBearing | None = None

    @cached_property
    def springs(self) -> np.ndarray:
        """Springs (n_columns,) [N/m] near which the set works."""
        return closed_springs(self.problem, self.data, self.bearing)

    @cached_property
    def reduction(self) -> Reduction:
        """Reduction with these springs."""
        return reduce_problem(self.problem, reference=self.springs)

    @property
    def groups(self) -> dict[str, np.ndarray]:
        """Places of the columns, see `column_groups`; the carrier bearing as ``carrier bearing``."""
        bearings = ("planets",) if self.planet_clearance else ()
        groups = column_groups(self.data, back_flanks=self.back_flanks, bearings=bearings)
        if self.bearing is not None:
            count = self.problem.system.W.shape[1]
            groups["carrier bearing"] = np.array([[count - 2, count - 1]])
        return groups


@dataclass(frozen=True)
class MotionLines:
    """Lines of a solution, and the share of the time in which flanks touch.

    Parameters
    ----------
    member : (3, 2, L) complex array
        x and y of carrier, ring and sun in the carrier frame [m].
    mesh_force, back_force : (2N, L) complex arrays
        Along the line of action of the drive flanks, and of the back flanks [N].
    planet_bearing : (N, 2, L) complex array
        Force of the pin on the planet, radially outwards and tangentially [N].
    carrier_bearing : (2, L) complex array
        x and y of the force of the carrier bearing on the carrier [N]; zero without one.
    drive_contact, back_contact : (2N,) arrays
    motion : float
        Farthest that the centre of carrier, ring or sun moves from its place [m].
    approach : float
        Largest deflection of a mesh [m].
    force_tail : float
        Share of the fluctuating force in the upper half of the lines, of the kind of mesh, sun-planet or
        planet-ring with both flanks, that has more of it; see `femgear.system.fourier.line_tail`.
    """

    member: np.ndarray
    mesh_force: np.ndarray
    back_force: np.ndarray
    planet_bearing: np.ndarray
    carrier_bearing: np.ndarray
    drive_contact: np.ndarray
    back_contact: np.ndarray
    motion: float
    approach: float
    force_tail: float


def weight_curve(
    problem: NonlinearSystem,
    limits: tuple[float, float],
    *,
    reduction: Reduction,
    harmonics: int = 9,
    stability: bool = False,
    radius: bool = False,
    largest: float = 0.1,
    max_points: int = 600,
) -> Branch:
    """Periodic responses over the frequency of the weight in the carrier frame.

    Parameters
    ----------
    problem : NonlinearSystem
        With the weight as the only base frequency.
    limits : (first, last)
        [Hz]
    reduction : Reduction
        With back flanks open, as `PlanarModel.reduction`.
    harmonics, stability, radius
        As for `frequency_response_curve`.
    largest : float
        Longest step, see `StepOptions`.
    max_points : int
    """
    return frequency_response_curve(
        problem,
        (2.0 * np.pi * limits[0], 2.0 * np.pi * limits[1]),
        harmonics=harmonics,
        stability=stability,
        radius=radius,
        tolerance=1e-5,
        samples=max(1024, 128 * harmonics),
        reduction=reduction,
        scale=_SCALE,
        options=StepOptions(largest=largest, max_points=max_points),
    )


def judged_branch(
    problem: NonlinearSystem, branch: Branch, progress: Callable[[int, int], None] = lambda done, total: None
) -> Branch:
    """A branch with Floquet verdicts: coarse first, fine where that is open or near the unit circle.

    Parameters
    ----------
    problem : NonlinearSystem
    branch : Branch
        Followed without stability.
    progress : callable, optional
        Called with (done, total).
    """
    solutions = branch.solutions
    found = []
    for first in range(0, len(solutions), _BATCH):
        part = solutions[first : first + _BATCH]
        verdicts = list(floquet_verdicts(problem, part, tolerance=_COARSE))
        close = [i for i, verdict in enumerate(verdicts) if _open(verdict)]
        fine = floquet_verdicts(problem, [part[i] for i in close], tolerance=_FINE) if close else ()
        for i, verdict in zip(close, fine):
            verdicts[i] = verdict
        found += verdicts
        progress(len(found), len(solutions))
    judged = tuple(replace(solution, verdict=verdict) for solution, verdict in zip(solutions, found))
    return replace(branch, solutions=judged, stability=True)


def _open(verdict: FloquetVerdict) -> bool:
    if verdict.stable is None or not len(verdict.multipliers):
        return verdict.stable is None
    return abs(abs(verdict.multipliers[0]) - 1.0) < 100.0 * verdict.error + _COARSE


def member_rows(data: PlanarSet, member: str) -> np.ndarray:
    """Rows (2, n) that give x and y of the carrier, ring or sun; zero where its axis is held."""
    first = 3 * CENTRAL.index(member)
    return free_motions(data)[first : first + 2]


def motion_lines(model: PlanarModel, solution: PeriodicSolution) -> MotionLines:
    """Lines of all that is looked at in a solution."""
    data, groups, N = model.data, model.groups, model.data.n_planets
    pins = (free_motions(data).T @ pin_directions(data).reshape(-1, 2 * N)).T
    rows = np.vstack([*(member_rows(data, name) for name in CENTRAL), pins])
    x = displacements(model.problem, solution, rows, reduction=model.reduction)
    if model.planet_clearance:
        pin_force = -solution.force[groups["planets"]]
    else:
        pin_force = -data.pin_stiffness[..., None] * x[6:].reshape(N, 2, -1)
    back = np.zeros((2 * N, x.shape[1]), complex)
    if model.back_flanks:
        back = solution.force[groups["back flanks"]]
    bearing = np.zeros((2, x.shape[1]), complex)
    if model.bearing is not None:
        bearing = -solution.force[groups["carrier bearing"][0]]
    member, mesh = x[:6].reshape(3, 2, -1), solution.force[groups["meshes"]]
    wave = np.exp(1j * (_phases(solution.orders) @ solution.orders.T))
    path = np.real(member @ wave.T)
    deflection = np.real(wave @ solution.deflection[groups["meshes"]].T)
    kinds = (np.vstack([mesh[part], back[part]]) for part in (slice(0, N), slice(N, 2 * N)))
    return MotionLines(
        member,
        mesh,
        back,
        pin_force,
        bearing,
        *flank_contact(model.problem, solution, N),
        motion=float(np.hypot(path[:, 0], path[:, 1]).max()),
        approach=float(deflection.max()),
        force_tail=max(line_tail(forces, solution.orders, rounding=_STILL) for forces in kinds),
    )


def flank_forces(model: PlanarModel, solution: PeriodicSolution, theta) -> tuple[np.ndarray, np.ndarray]:
    """Forces (n, 2N) [N] of drive flanks and of back flanks on lines of their own, from the element laws.

    The deflections are those of the solution. Its force lines, cut at the last one, would ring beside a short
    contact; the law of a one-sided contact does not.

    Parameters
    ----------
    model : PlanarModel
    solution : PeriodicSolution
    theta : (n, n_bases) array
        Phases of the base frequencies [rad].
    """
    x = np.real(np.exp(1j * (theta @ solution.orders.T)) @ solution.deflection.T)
    force, groups = element_forces(model.problem, x, theta)[0], model.groups
    drive = force[:, groups["meshes"]]
    return drive, force[:, groups["back flanks"]] if model.back_flanks else np.zeros_like(drive)


def cut_branch(branch: Branch, count: int, message: str) -> Branch:
    """The first points of a branch, which then did not reach an end of its range."""
    known = branch.curve
    curve = replace(
        known,
        **{name: getattr(known, name)[:count] for name in _ALONG},
        **{name: getattr(known, name)[getattr(known, name) < count] for name in ("folds", "branch_points")},
        closed=False,
        complete=False,
        message=message,
    )
    return replace(
        branch, parameter=branch.parameter[:count], solutions=branch.solutions[:count], curve=curve
    )


def flank_contact(
    problem: NonlinearSystem, solution: PeriodicSolution, n_planets: int
) -> tuple[np.ndarray, np.ndarray]:
    """Shares of the time (2N,) in which drive flanks, and back flanks, of every mesh touch.

    Parameters
    ----------
    problem : NonlinearSystem
    solution : PeriodicSolution
    n_planets : int
    """
    share = column_contact(problem, solution)
    meshes = slice(0, 2 * n_planets)
    if share.shape[1] >= 4 * n_planets and np.isfinite(share[0, 2 * n_planets : 4 * n_planets]).all():
        return share[0, meshes], share[0, 2 * n_planets : 4 * n_planets]
    return share[0, meshes], share[1, meshes]


def column_contact(problem: NonlinearSystem, solution: PeriodicSolution) -> np.ndarray:
    """Share of the time (2, n_columns) in which the flanks of every column press, and pull.

    Columns without a mesh are nan. A mesh with play on one line of action pulls where its back flanks touch.
    A smoothed contact counts as closed beyond half its force scale, the force at the corner itself.
    """
    theta = _phases(solution.orders)
    x = np.real(np.exp(1j * (theta @ solution.orders.T)) @ solution.deflection.T)
    force = element_forces(problem, x, theta)[0]
    out = np.full((2, x.shape[1]), np.nan)
    for element in problem.elements:
        if isinstance(element, GearMeshes):
            place = element.columns[:, 0]
            least = 0.5 * element.smoothing * element.stiffness.mean
            out[0, place] = (force[:, place] > least).mean(axis=0)
            out[1, place] = (force[:, place] < -least).mean(axis=0)
    return out


def _phases(orders: np.ndarray) -> np.ndarray:
    """Instants (n, bases) [rad] that fill the phases evenly; one phase of a base that no line has."""
    used = np.any(orders != 0, axis=0)
    counts = np.where(used, _GRID[: len(used)] if used.sum() > 1 else _SAMPLES, 1)
    axes = [2.0 * np.pi * np.arange(count) / count for count in counts]
    return np.stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")], axis=1)


def shown_points(rms: np.ndarray, back: np.ndarray, stable: np.ndarray) -> list[tuple[int, str]]:
    """Points of a branch that are drawn over the phase, in order, and what they are; the last one is the top.

    Parameters
    ----------
    rms : (p,) array
        Amplitude along the branch.
    back : (p,) array
        Share of the cycle in which back flanks touch.
    stable : (p,) int array
        1 where known to be stable, 0 where known not to be, -1 where not known.
    """
    sure = stable == 1
    top, words = int(np.argmax(rms)), "largest response"
    if sure.any():
        top, words = int(np.argmax(np.where(sure, rms, -1.0))), "largest stable response"
    points = [(0, "start")] if top else []
    if back[top] > 0.0:
        free = np.flatnonzero(back[:top] == 0.0)
        points += [(int(free[-1]), "before back flanks touch")] if len(free) and free[-1] else []
    return [*points, (top, words)]


def fluctuation(lines: np.ndarray) -> np.ndarray:
    """Root mean square about the mean of lines (..., L), mean first."""
    return np.sqrt(0.5 * (np.abs(lines[..., 1:]) ** 2).sum(axis=-1))


def stacked(found: Sequence[MotionLines]) -> dict[str, np.ndarray]:
    """The lines of several solutions by name, the solutions along the first axis."""
    return {name: np.array([getattr(one, name) for one in found]) for name in MotionLines.__annotations__}


def merged_folds(frequency: np.ndarray, fold: np.ndarray) -> np.ndarray:
    """Points of the limit points of a branch, neighbours at one frequency as one: the outermost of them.

    Parameters
    ----------
    frequency : (p,) array
        Along the branch.
    fold : (p,) bool array
    """
    groups: list[list[int]] = []
    for point in np.flatnonzero(fold):
        if groups and abs(frequency[point] / frequency[groups[-1][0]] - 1.0) < _SAME_FOLD:
            groups[-1].append(int(point))
        else:
            groups.append([int(point)])
    # the branch runs towards a fold: the outermost point lies farthest in that sense
    sense = [1.0 if frequency[group[0]] >= frequency[max(group[0] - 1, 0)] else -1.0 for group in groups]
    return np.array([max(group, key=lambda i: s * frequency[i]) for group, s in zip(groups, sense)], int)
