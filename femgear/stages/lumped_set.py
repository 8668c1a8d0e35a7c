"""Planetary sets of rigid bodies, in their plane or in space: what their cases and their models share.

Of cases: refusals, notices, supports of the members, speeds and mesh stiffness. Of models: `gear_set_modes`
gives the modes at standstill with their kinds. `gear_set_problem` joins a set with its elements and forces
for harmonic balance and time integration: mesh stiffness, play, bearings with clearance, weight, pin errors.
Both take any `RigidSet`: the number of directions of a body is that of the set.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from femgear.case.gear_set import set_deviations
from femgear.case.planetary import Case, RigidCase, output_member
from femgear.case.sections import MeshStiffnessSection
from femgear.errors import CaseError
from femgear.fe.beam import AXES
from femgear.gears.deviations import common_period
from femgear.gears.kinematics import Speeds, speeds
from femgear.solvers.linear.modal import modal_damping, undamped_modes, viscous_damping
from femgear.storage.contents import Contents
from femgear.storage.results import coordinates, mode_entries, shape_entries
from femgear.system.force_laws import GearMeshes, RadialBearings
from femgear.system.fourier import FourierSeries, Series, StepSeries, SummedSeries, series_of, tooth_lines
from femgear.system.mesh_directions import (
    check_mesh_columns,
    free_motions,
    gear_set_system,
    mesh_directions,
    mesh_elements,
)
from femgear.system.mode_kinds import gear_set_kinds, gear_set_motions, phase_basis
from femgear.system.rigid_bodies import CENTRAL, PlanarTorque, RigidSet, flank_sign
from femgear.system.system import HarmonicForce, MechanicalSystem, Modes, NonlinearSystem

if TYPE_CHECKING:
    from femgear.gears.planetary import PlanetarySet

Entry = TypeVar("Entry")
AnyCase = TypeVar("AnyCase", bound=Any)


def entries_with_verb(names: list[str]) -> str:
    """Write entries of a case file with their verb, "a, b have"."""
    return f"{', '.join(names)} {'has' if len(names) == 1 else 'have'}"


def entries_without_effect(data: dict, others: Sequence[str] = (), *, lives: bool = False) -> list[str]:
    """List entries that no set of rigid bodies takes up: machines, housing, run-up, foundation of the ring, others.

    ``data`` are the tables of a case file that was checked; load cases have an effect where ``lives`` are computed.
    """
    machines = [name for name in ("motor", "brake", "housing", "runup") if name in data]
    keys = ("foundation_radial", "foundation_tangential")
    foundation = (f"ring.{key}" for key in keys if key in data["ring"])
    spectrum = [f"operation.{key}" for key in ("load_case", "required_hours") if key in data["operation"]]
    spectrum += [f"planet.{key}" for key in ("dynamic_rating", "bearing_kind") if key in data["planet"]]
    return [*machines, *others, *foundation, *(() if lives else spectrum)]


def flank_entries(data: dict) -> list[str]:
    """List the entries of flanks and errors, which act on the static solution alone."""
    return [
        f"{name}.{key}"
        for name in ("sun", "planet", "ring", "carrier")
        for key in ("modifications", "errors", "individual")
        if data.get(name, {}).get(key)
    ]


def rigid_refusals(case: RigidCase, kind: str, *, without_torque: str) -> Iterator[CaseError]:
    """Refuse elastic supports of the static solution, and a torque of zero.

    ``kind`` is "planar" or "helical", ``without_torque`` tells what a torque of zero means.
    """
    if case.static.members == "elastic":
        yield CaseError(
            f"the supports belong to the {kind} model: the static solution is that of the gears alone",
            code="E-CHOICE",
            key="static.members",
            value="elastic",
            limit=f'"fixed" in a {kind} case',
            remedy="leave static.members out",
        )
    if case.operation.torque == 0.0:
        yield CaseError(
            f"without torque no tooth carries load{without_torque}",
            code="E-NO-LOAD",
            key="operation.torque",
            limit=f"not zero in a {kind} case",
        )


def unheld_member(case: RigidCase, key: str, remedy: str) -> CaseError:
    """Make the refusal of a fixed member whose torsional support, the entry ``key``, is zero."""
    return CaseError(
        f"the {case.operation.fixed} is the fixed member but nothing keeps it from turning",
        code="E-MECHANISM",
        key=key,
        value="0 N m/rad",
        limit="above 0 N m/rad",
        remedy=remedy,
    )


def check_one_period(
    case: Case,
    gears: PlanetarySet,
    takes: str,
    *,
    key: str = "operation.speeds",
    remedy: str = "run with --only static",
) -> None:
    """Refuse errors whose static record spans several mesh periods (E-PERIODS).

    ``takes`` is "the planar model takes", or whatever takes one period alone.
    """
    # whatever the longest record: one period cut out of many is no period
    periods, _ = common_period(set_deviations(case), gears, limit=sys.maxsize)
    if periods > 1:
        raise CaseError(
            f"the errors of this set span {periods} mesh periods; {takes} one",
            code="E-PERIODS",
            key=key,
            limit="errors that repeat with every tooth",
            remedy=f"{remedy}, or leave pitch errors and runouts out",
        )


def needed(entry: Entry | None, name: str) -> Entry:
    """Refuse the absence of an entry, or of the result of a stage, that is needed here (E-KEY-MISSING)."""
    if entry is None:
        remedy = "add it, or compute the stage before"
        raise CaseError(f"{name} is needed here", code="E-KEY-MISSING", key=name, remedy=remedy)
    return entry


def torsional_support(case: RigidCase, member: str, given: float | None) -> float:
    """Choose the torsional stiffness of a member [N m/rad]; not given the fixed one is held, others free."""
    if given is not None:
        return given
    return math.inf if member == case.operation.fixed else 0.0


def torsion_text(case: RigidCase, member: str, given: float | None) -> str:
    """Write the torsional support of a member [N m/rad] in a table."""
    value = torsional_support(case, member, given)
    return "held" if math.isinf(value) else f"{value:.6g}"


def mesh_stiffnesses(given: MeshStiffnessSection | None, mean: np.ndarray | None) -> dict[str, Any]:
    """Choose the stiffness of both kinds of mesh [N/m]: as given, else the static means (2N,) [N/m]."""
    if given is not None:
        return {"stiffness_sun_planet": given.sun_planet, "stiffness_planet_ring": given.planet_ring}
    sun_planet, planet_ring = np.split(np.asarray(mean), 2)
    return {"stiffness_sun_planet": sun_planet, "stiffness_planet_ring": planet_ring}


def stiffness_text(given: MeshStiffnessSection) -> str:
    """Write the given mesh stiffness [N/m] in a note."""
    return f"sun-planet {given.sun_planet:.6g}, planet-ring {given.planet_ring:.6g} N/m, as given"


def driving_torque(case: RigidCase, *, reacts: bool = True) -> PlanarTorque:
    """Make the driving torque [N m], which the output takes up, or without ``reacts`` the supports."""
    return PlanarTorque(case.operation.torque, case.operation.input, output_member(case) if reacts else None)


def member_speeds(case: Case, gears: PlanetarySet, speed: float = 1.0) -> Speeds:
    """Compute the speeds of all members [rad/s] at a speed of the input [rad/s]."""
    return speeds(gears, input=case.operation.input, fixed=case.operation.fixed, speed=speed)


def parts_of_speeds(case: AnyCase, sizes, most: float) -> Iterator[tuple[np.ndarray, AnyCase]]:
    """Split the speeds of a case into parts: their numbers, and the case that has them alone.

    Every speed of a part takes as much room as the largest of them, of sizes (n_speeds,); together `most`.
    """
    speeds, first, largest = case.operation.speeds, 0, 0.0
    for last, size in enumerate(sizes, 1):
        largest = max(largest, size)
        following = max(largest, sizes[last]) if last < len(speeds) else math.inf
        if (last + 1 - first) * following > most or last == len(speeds):
            operation = case.operation.model_copy(update={"speeds": speeds[first:last]})
            whole = last - first == len(speeds)
            yield np.arange(first, last), case if whole else case.model_copy(update={"operation": operation})
            first, largest = last, 0.0


def rotation_sense(case: RigidCase, gears: PlanetarySet) -> int:
    """Tell the sense of the sun against the carrier: 1 counter-clockwise, -1 clockwise."""
    turning = member_speeds(case, gears)
    return 1 if turning.sun > turning.carrier else -1


# natural frequencies closer than this, relative to the frequency, count as one
_SAME = 1e-3
# the same, of what rounding alone tells apart
_ONE_FREQUENCY = 1e-9


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


@dataclass(frozen=True)
class MemberBearing:
    """A radial bearing between two central members, or between one and the housing.

    ``stiffness`` [N/m] and radial ``clearance`` from the centred position [m], None for columns without a
    bearing; ``inner`` and ``outer`` are "carrier", "ring" or "sun", ``outer`` also "housing".
    """

    stiffness: float
    clearance: float | None = 0.0
    inner: str = "carrier"
    outer: str = "housing"


@dataclass(frozen=True)
class Bearings:
    """Bearings that act on columns of their own, as elements; their stiffness is not in ``K``.

    Parameters
    ----------
    planet_clearance : float or (N,) array, optional
        Radial clearance of the planet bearings, from the centred position [m]; None leaves them linear.
    members : tuple of MemberBearing
        Beside the supports of the members; on the last columns, x and y of the inner less the outer member.
    """

    planet_clearance: float | np.ndarray | None = None
    members: tuple[MemberBearing, ...] = ()

    def columns(self, data: RigidSet, *, back_flanks: bool) -> dict[str, np.ndarray]:
        """Number the columns of ``W``, of meshes and back flanks (n,), of planets and members (g, 2)."""
        meshes, planets = len(data.column_stiffness), self.planet_clearance is not None
        counts = [meshes, meshes * back_flanks, 2 * data.n_planets * planets, 2 * len(self.members)]
        drive, back, pins, members = np.split(np.arange(sum(counts)), np.cumsum(counts)[:-1])
        return {
            "meshes": drive,
            "back flanks": back,
            "planets": pins.reshape(-1, 2),
            "members": members.reshape(-1, 2),
        }

    def join(self, data: RigidSet, system: MechanicalSystem) -> MechanicalSystem:
        """Add the columns of the members to ``W`` of the system of a set."""
        T, columns = free_motions(data), [system.W]
        for member in self.members:
            first, *other = (
                T[len(data.axes) * CENTRAL.index(name) :][:2].T
                for name in (member.inner, member.outer)
                if name in CENTRAL
            )
            columns.append(first - sum(other))
        return replace(system, W=np.hstack(columns))

    def elements(self, data: RigidSet, groups: dict[str, np.ndarray]) -> tuple[RadialBearings, ...]:
        """Make the bearings of a set on their places; ``groups`` (g, 2) of columns are those of `columns`."""
        elements = []
        if self.planet_clearance is not None:
            stiffness = data.pin_stiffness[:, 0]
            elements.append(RadialBearings(groups["planets"], stiffness, self.planet_clearance))
        for place, member in zip(groups["members"], self.members):
            if member.clearance is not None:
                elements.append(RadialBearings(place[None], member.stiffness, member.clearance))
        return tuple(elements)


def gear_set_modes(
    data: RigidSet,
    *,
    system: MechanicalSystem | None = None,
    mesh_stiffness=None,
    damping_ratio: float = 0.0,
    max_frequency: float | None = None,
) -> Modes:
    """Solve for the modes of a set at standstill, with their kinds.

    Parameters
    ----------
    data : RigidSet
        Bodies, supports and mesh stiffnesses.
    system : MechanicalSystem, optional
        `gear_set_system` of the set, with the flanks that a torque loads; without torque when not given.
    mesh_stiffness : (n_columns,) array, optional
        Of the columns of ``W`` [N/m]; that of the set when not given.
    damping_ratio : float
        Of all modes.
    max_frequency : float, optional
        Keep the modes up to this frequency [Hz]; all when not given.

    Returns
    -------
    Modes
        ``kind`` from `gear_set_kinds`; of bodies in space modes of one frequency have one phasing each.
    """
    system = gear_set_system(data) if system is None else system
    stiffness = data.column_stiffness if mesh_stiffness is None else mesh_stiffness
    modes = undamped_modes(system, stiffness, damping_ratio=damping_ratio, max_frequency=max_frequency)
    if len(data.axes) > 3:
        # tilts of the planets that no mesh feels have one frequency in several classes
        Q = phase_basis(gear_set_motions(data, modes.shape), modes.frequency, tolerance=_ONE_FREQUENCY)
        modes = mixed_modes(modes, Q)
    return replace(modes, kind=gear_set_kinds(data, modes.shape, frequency=modes.frequency))


def mixed_modes(modes: Modes, Q: np.ndarray) -> Modes:
    """Mix modes of like natural frequencies by an orthogonal matrix (n_modes, n_modes)."""
    return replace(
        modes,
        shape=modes.shape @ Q,
        mesh_deflection=modes.mesh_deflection @ Q,
        modal_load=None if modes.modal_load is None else Q.T @ modes.modal_load,
        source_load=None if modes.source_load is None else Q.T @ modes.source_load,
    )


def gear_set_problem(
    data: RigidSet,
    *,
    meshes: GearMeshes | None = None,
    back_flanks: bool = False,
    torque: PlanarTorque | None = None,
    bearings: Bearings | None = None,
    gravity: Gravity | None = None,
    pin_errors=None,
    carrier_speed: float = 0.0,
    damping: float | Sequence[float] | np.ndarray | None = None,
) -> NonlinearSystem:
    """Assemble a lumped set with its elements and forces.

    Parameters
    ----------
    data : RigidSet
        Bodies, supports and mesh stiffnesses.
    meshes : GearMeshes, optional
        From `mesh_elements`; constant stiffnesses without back side when not given.
    back_flanks : bool
        The back flanks act on their own lines of action, with the stiffness of the drive side, so that teeth
        can wedge; otherwise they act on the line of the drive flanks.
    torque : PlanarTorque, optional
        On the central members [N m], and what reacts to it.
    bearings, gravity : Bearings, Gravity, optional
        Bearings with clearance, and the weight of the bodies.
    pin_errors : (N, 2) array, optional
        Radial (outwards) and tangential (counter-clockwise) displacement of the pins [m], from which the
        coordinates of the planets then count. Not to be given again when the static record holds them.
    carrier_speed : float
        [rad/s], see `gear_set_system`.
    damping : float, sequence of float or (n, n) array, optional
        Damping ratio of all modes at standstill, or one a natural frequency as of `mode_ratios`, with the
        stiffnesses of `working_springs`; or the matrix ``C`` [N s/m].

    Raises
    ------
    CaseError
        A load that accelerates the set (E-LOAD-BALANCE), back flanks without backlash (E-BACKLASH), arrays
        that do not fit (E-SHAPE).
    """
    bearings = bearings or Bearings()
    pins = np.zeros((data.n_planets, 2)) if pin_errors is None else _pins(data, pin_errors)
    groups = bearings.columns(data, back_flanks=back_flanks)
    meshes = mesh_elements(data) if meshes is None else meshes
    check_mesh_columns(data, meshes)
    elements = _mesh_elements(data, meshes, pins, flank_sign(data, torque), groups)
    elements += bearings.elements(data, groups)
    options = {
        "torque": torque,
        "back_flanks": back_flanks,
        "planet_bearings": bearings.planet_clearance is not None,
    }
    still = bearings.join(data, gear_set_system(data, **options))
    springs = working_springs(NonlinearSystem(still, elements), bearings.members)
    # refuses a load that nothing takes up before a solver drifts away with it
    modes = undamped_modes(still, springs)
    if damping is None or np.ndim(damping) > 1:
        C = viscous_damping(still, springs, damping)
    else:
        C = modal_damping(still, springs, mode_ratios(modes.frequency, damping))
    system = bearings.join(data, gear_set_system(data, carrier_speed=carrier_speed, **options))
    steady, forces = _weight(data, gravity)
    # centrifugal force of the planets by the displacement of their pins
    thrown = _of_planets(data, carrier_speed**2 * data.planet.mass * pins)
    load = system.load + steady + free_motions(data).T @ thrown
    return NonlinearSystem(replace(system, load=load, C=C), elements, forces, speed=carrier_speed)


def working_springs(problem: NonlinearSystem, members: Sequence[MemberBearing] = ()) -> np.ndarray:
    """Choose springs (n_columns,) [N/m] near which a set works: bearings closed, back flanks open.

    The elements' own reference counts back flanks on their own lines as closed, far from where the set works.
    Those of ``members`` stand on the last columns of a `gear_set_problem`; closed whatever their clearance.
    """
    springs = problem.reference
    for element in problem.elements[1:]:
        if isinstance(element, GearMeshes):
            springs[element.columns] = 0.0
    for number, member in enumerate(members, -len(members)):
        springs[[2 * number, 2 * number + 1]] = member.stiffness
    return springs


def mode_ratios(frequency: np.ndarray, ratios: float | Sequence[float] | np.ndarray) -> np.ndarray:
    """Assign damping ratios (m,) to modes of ascending frequency (m,) [Hz], from one of all modes or several.

    Several ``ratios`` (r,) are one a natural frequency (a pair of modes has one), ascending, the last for the rest.
    Motions at frequency zero have none and do not count.
    """
    given = np.atleast_1d(np.asarray(ratios, float))
    moving = frequency > 0.0
    steps = np.diff(frequency[moving], prepend=0.0) > _SAME * frequency[moving]
    number = np.clip(np.cumsum(steps) - 1, 0, len(given) - 1)
    out = np.zeros(len(frequency))
    out[moving] = given[number]
    return out


def pin_deflections(data: RigidSet, pin_errors, *, flank: int = 1) -> np.ndarray:
    """Compute the approach of the flanks (n_columns,) [m] by displaced pins, all bodies at rest in bearings.

    Pin errors (N, 2) [m] are those of `gear_set_problem`, ``flank`` (1 or -1) that of `mesh_directions`.
    """
    return mesh_directions(data, flank).T @ _of_planets(data, _pins(data, pin_errors))


def phased_series(sun_planet, planet_ring, phases, *, mean, orders: tuple[int, ...] = (1,)) -> FourierSeries:
    """Make the stiffness of the 2N meshes from one wave of each kind, shifted by the mesh phases.

    Parameters
    ----------
    sun_planet, planet_ring : (H,) complex arrays
        Harmonics 1 to H of the stiffness over its mean, at phase zero; the shorter one is filled with zeros.
    phases : (2N,) array
        phi_j as fractions of the mesh period, ``k_j(tau) = k(tau + phi_j)``: `PlanetarySet.mesh_phases`
        (Parker and Lin, J. Mech. Des. 126, 2004).
    mean : (2N,) array
        [N/m], such as `RigidSet.mesh_stiffness`.
    orders : tuple of int
        Multiples of the base frequencies that make the mesh frequency.

    Raises
    ------
    CaseError
        Other numbers of mean stiffnesses and phases (E-SHAPE).
    """
    lines, mean = tooth_lines(sun_planet, planet_ring, phases), np.asarray(mean, float)
    if mean.shape != (len(lines),):
        raise CaseError(f"{mean.size} mean stiffnesses for {len(lines)} phases", code="E-SHAPE", limit="2N of each")
    return FourierSeries(mean[:, None] * np.column_stack([np.ones(len(lines)), lines]), orders)


def _mesh_elements(data: RigidSet, meshes: GearMeshes, pins, flank: int, groups) -> tuple:
    """The meshes with the approach by the pins, and the back flanks on their own lines."""
    drive = replace(meshes, deflection=_raised(meshes.state[0], -pin_deflections(data, pins, flank=flank)))
    if not len(groups["back flanks"]):
        return (drive,)
    if not np.all(np.isfinite(meshes.backlash)) or not meshes.separates:
        raise CaseError(
            "back flanks need the backlash of every mesh, and meshes that separate",
            code="E-BACKLASH",
            key="backlash",
            remedy="give a finite backlash, or leave the back flanks out",
        )
    behind = meshes.backlash - pin_deflections(data, pins, flank=-flank)
    start = _raised(_unloaded(meshes), behind, sign=-1.0)
    back = replace(meshes, columns=groups["back flanks"], deflection=start, force=None, backlash=np.inf)
    return replace(drive, backlash=np.inf), back


def _unloaded(meshes: GearMeshes) -> Series:
    """Deflection at which the mesh line carries nothing, ``deflection - force / k``."""
    deflection, force = meshes.state
    if isinstance(force, FourierSeries) and not np.any(force.amplitudes):
        return deflection
    series = [series_ for series_ in (meshes.stiffness, deflection, force) if isinstance(series_, FourierSeries)]
    if len(series) < 3:
        raise CaseError(
            "back flanks cannot follow a stepwise record that holds mesh forces",
            code="E-BACKLASH",
            remedy="give Fourier series, or the unloaded deflection with no force",
        )
    # the quotient of two series has no last harmonic: sample finely, keep what the samples resolve
    count = max(series_.amplitudes.shape[1] for series_ in series)
    phase = 2.0 * np.pi * np.arange(16 * count)[:, None] / (16 * count)
    k, deflection, force = (replace(series_, orders=(1,)).at(phase) for series_ in series)
    return series_of((deflection - force / k).T, 4 * count, orders=series[0].orders)


def _raised(series: Series, offset, *, sign: float = 1.0) -> Series:
    """The series times a sign, with a constant (n_columns,) added."""
    if isinstance(series, StepSeries):
        return replace(series, values=sign * series.values + offset[:, None])
    if isinstance(series, SummedSeries):
        offsets = [offset] + [np.zeros_like(offset)] * (len(series.parts) - 1)
        parts = (_raised(series_part, part, sign=sign) for series_part, part in zip(series.parts, offsets))
        return SummedSeries(tuple(part for part in parts if isinstance(part, FourierSeries)))
    amplitudes = sign * series.amplitudes
    amplitudes[:, 0] += offset
    return replace(series, amplitudes=amplitudes)


def _weight(data: RigidSet, gravity: Gravity | None) -> tuple[np.ndarray, tuple[HarmonicForce, ...]]:
    """Steady load (n,) and harmonic forces of the weight.

    In the carrier frame the weight stands at ``direction - theta_c``. On x and y of a member it is the real
    part of ``m g (1, -i) exp(i (direction - theta_c))``, which is order -1 of the carrier; its conjugate
    with order +1 is the same force.
    """
    T = free_motions(data)
    if gravity is None:
        return np.zeros(T.shape[1]), ()
    force = np.zeros((data.n_planets + 3, len(data.axes)), complex)
    masses = [getattr(data, name).mass for name in CENTRAL] + [data.planet.mass] * data.n_planets
    axis = np.concatenate([np.zeros(3), data.planet_angles])
    force[:, 0] = np.array(masses) * gravity.acceleration * np.exp(1j * (gravity.direction - axis))
    force[:, 1] = -1j * force[:, 0]
    reduced = T.T @ force.ravel()
    if gravity.orders is None:
        return np.real(reduced), ()
    return np.zeros(T.shape[1]), (HarmonicForce(reduced.conj(), gravity.orders),)


def _pins(data: RigidSet, pin_errors) -> np.ndarray:
    pins = np.asarray(pin_errors, float)
    if pins.shape != (data.n_planets, 2) or not np.all(np.isfinite(pins)):
        raise CaseError(
            f"pin errors of shape {pins.shape}",
            code="E-SHAPE",
            key="pin_errors",
            limit=f"({data.n_planets}, 2) finite numbers, radial and tangential",
        )
    return pins


def _of_planets(data: RigidSet, values: np.ndarray) -> np.ndarray:
    """Radial and tangential values (N, 2) of the planets in all coordinates (n_all,)."""
    vectors = np.zeros((data.n_planets + 3, len(data.axes)))
    vectors[3:, :2] = values
    return vectors.ravel()


def modes_dataset(
    data: RigidSet,
    gears: PlanetarySet,
    modes: Modes,
    *,
    attrs: dict,
    phasing: tuple[str, ...] = (),
    along: str = "",
) -> Contents:
    """Collect modes.nc: frequencies, kinds and shapes of all bodies, mesh deflections, no elastic ring.

    The number of unknowns is added behind the title in the attributes of the file; ``phasing`` (m,) is that
    of every mode, ``along`` what the descriptions of stiffness and deflection of the meshes end with.
    """
    shape, dofs = in_space(data, modes.shape)
    count, slices = 2 * data.n_planets, len(data.contact_lines.heights)
    stiffness = modes.mesh_stiffness[: count * slices].reshape(count, slices).sum(axis=1)
    deflection = modes.mesh_deflection[: count * slices].reshape(count, slices, -1).mean(axis=1)
    variables = mode_entries(modes)
    if phasing:
        variables["phasing"] = ("mode", list(phasing), "1", "phasing of the planets in the mode")
    rigid = "nodal diameter: -1, the ring is rigid"
    variables["nodal_diameter"] = ("mode", modes.nodal_diameter, "1", rigid)
    variables |= shape_entries(shape, stiffness, deflection, along)
    coords = coordinates(mode=np.arange(1, len(modes.frequency) + 1), dof=dofs, mesh=gears.mesh_names)
    named = {"title": attrs["title"], "unknowns": len(modes.shape)}
    return Contents(variables, coords=coords, attrs=named | attrs)


def in_space(data: RigidSet, shape: np.ndarray) -> tuple[np.ndarray, list[str]]:
    """Compute motions of all bodies along and about the axes of the set, held ones included.

    Of shapes (n, m) in the coordinates of `gear_set_system` the motions (n_all, m) [m] and [rad] per unit,
    and their names: body and motion, as in "planet 2: tilt x".
    """
    N, axes = data.n_planets, len(data.axes)
    full = (free_motions(data) @ shape).reshape(N + 3, axes, -1)
    cosine, sine = np.cos(data.planet_angles)[:, None], np.sin(data.planet_angles)[:, None]
    for first in range(0, axes, 3):
        radial, tangential = full[3:, first].copy(), full[3:, first + 1].copy()
        full[3:, first] = radial * cosine - tangential * sine
        full[3:, first + 1] = radial * sine + tangential * cosine
    full[:, -(axes // 2) :] /= data.radii[:, None, None]
    bodies = [*CENTRAL, *(f"planet {n + 1}" for n in range(N))]
    names = [f"{body}: {AXES[axis]}" for body in bodies for axis in data.axes]
    return full.reshape(len(names), -1), names
