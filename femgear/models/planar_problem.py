"""The lumped planetary set with its mesh stiffness, play, bearing clearance, weight and pin errors."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from femgear.errors import CaseError
from femgear.models.planar import (
    CENTRAL,
    PlanarSet,
    PlanarTorque,
    column_groups,
    flank_sign,
    free_motions,
    mesh_directions,
    planar_system,
)
from femgear.solvers.elements import GearMeshes, RadialBearings, gear_meshes
from femgear.solvers.modal import solve_modes
from femgear.solvers.nonlinear import HarmonicForce, NonlinearSystem, modal_damping
from femgear.solvers.series import FourierSeries, StepSeries, constant, series_of
from femgear.system import MechanicalSystem, MeshExcitation


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


def planar_meshes(
    data: PlanarSet,
    *,
    stiffness: FourierSeries | StepSeries | MeshExcitation | None = None,
    harmonics: int | None = None,
    orders: tuple[int, ...] = (1,),
    backlash: float | np.ndarray | None = None,
    separates: bool = True,
    smoothing: float = 0.0,
) -> GearMeshes:
    """The 2N meshes as elements.

    Parameters
    ----------
    data : PlanarSet
    stiffness : FourierSeries, StepSeries or MeshExcitation, optional
        Of the meshes [N/m], or their static record; the constant stiffnesses of the set when not given.
    harmonics, orders
        Of a static record, see `femgear.solvers.elements.gear_meshes`.
    backlash : float or (2N,) array, optional
        Play along the line of action [m]. None takes that of the static record; without one, or where it
        is zero there, the meshes have no back side.
    separates, smoothing
        See `femgear.solvers.elements.GearMeshes`.

    Raises
    ------
    CaseError
        A static record without the number of its harmonics (E-HARMONICS), values for another number of
        meshes (E-SHAPE).
    """
    made = mesh_elements(stiffness, data.mesh_stiffness, harmonics, orders, record="static record")
    backlash = made.backlash if backlash is None else backlash
    return replace(made, backlash=backlash, separates=separates, smoothing=smoothing)


def mesh_elements(stiffness, mean: np.ndarray, harmonics, orders, *, record: str) -> GearMeshes:
    """Elements on the first columns of ``W``, of mean stiffness where none is given; see `planar_meshes`."""
    columns = np.arange(len(mean))
    if not isinstance(stiffness, MeshExcitation):
        return GearMeshes(columns, constant(mean) if stiffness is None else stiffness)
    if harmonics is None:
        raise CaseError(
            f"the mesh harmonics of the {record} are not said", code="E-HARMONICS", key="harmonics",
            limit="a whole number of 1 or more",
        )  # fmt: skip
    return gear_meshes(stiffness, harmonics=harmonics, columns=columns, orders=orders)


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
        From `planar_meshes`; constant stiffnesses without back side when not given.
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
        See `planar_system`.
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
    meshes = planar_meshes(data) if meshes is None else meshes
    if not np.array_equal(meshes.columns[:, 0], groups["meshes"]):
        raise CaseError(
            f"meshes on columns {meshes.columns[:, 0].tolist()}", code="E-SHAPE", key="meshes",
            limit=f"columns 0 to {2 * data.n_planets - 1} in order", remedy="make them with planar_meshes",
        )  # fmt: skip
    elements = _mesh_elements(data, meshes, pins, flank_sign(data, torque), groups)
    elements += _bearing_elements(data, clearances, groups)
    options = {"torque": torque, "back_flanks": back_flanks, "bearings": bearings}
    still = planar_system(data, **options)
    reference = NonlinearSystem(still, elements).reference
    # teeth in the middle of the drive flanks do not touch their back flanks
    reference[groups.get("back flanks", np.arange(0))] = 0.0
    # refuses a load that nothing takes up before a solver drifts away with it
    solve_modes(still, reference)
    system = planar_system(data, carrier_speed=carrier_speed, **options)
    steady, forces = _weight(data, gravity)
    load = system.load + steady + _pin_inertia(data, pins, carrier_speed)
    system = replace(system, load=load, C=damping_matrix(still, reference, damping))
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
    waves = [np.atleast_1d(np.asarray(wave, complex)) for wave in (sun_planet, planet_ring)]
    if phases.ndim != 1 or len(phases) % 2 or phases.shape != mean.shape:
        raise CaseError(
            f"{phases.size} phases and {mean.size} mean stiffnesses", code="E-SHAPE", limit="2N of each"
        )
    count = max(len(wave) for wave in waves)
    table = np.array([np.pad(wave, (0, count - len(wave))) for wave in waves])
    shift = np.exp(2j * np.pi * phases[:, None] * np.arange(1, count + 1))
    lines = np.repeat(table, len(phases) // 2, axis=0) * shift
    return FourierSeries(mean[:, None] * np.column_stack([np.ones(len(phases)), lines]), orders)


def _mesh_elements(data: PlanarSet, meshes: GearMeshes, pins, flank: int, groups) -> tuple[GearMeshes, ...]:
    """The meshes with the approach by the pins, and the back flanks on their own lines."""
    drive = replace(meshes, deflection=_raised(meshes.deflection, -pin_deflections(data, pins, flank=flank)))
    if "back flanks" not in groups:
        return (drive,)
    if not np.all(np.isfinite(meshes.backlash)) or not meshes.separates:
        raise CaseError(
            "back flanks need the backlash of every mesh, and meshes that separate", code="E-BACKLASH",
            key="backlash", remedy="give a finite backlash, or leave the back flanks out",
        )  # fmt: skip
    start = _raised(_negative(_unloaded(meshes)), meshes.backlash - pin_deflections(data, pins, flank=-flank))
    back = replace(meshes, columns=groups["back flanks"], deflection=start, force=None, backlash=np.inf)
    return replace(drive, backlash=np.inf), back


def _unloaded(meshes: GearMeshes) -> FourierSeries | StepSeries:
    """Deflection at which the mesh line carries nothing, ``deflection - force / k``."""
    series = (meshes.stiffness, meshes.deflection, meshes.force)
    if isinstance(meshes.force, FourierSeries) and not np.any(meshes.force.amplitudes):
        return meshes.deflection
    if any(isinstance(one, StepSeries) for one in series):
        raise CaseError(
            "back flanks cannot follow a stepwise record that holds mesh forces", code="E-BACKLASH",
            remedy="give Fourier series, or the unloaded deflection with no force",
        )  # fmt: skip
    # the quotient of two series has no last harmonic: sample finely, keep what the samples resolve
    count = max(one.amplitudes.shape[1] for one in series)
    phase = 2.0 * np.pi * np.arange(16 * count)[:, None] / (16 * count)
    k, deflection, force = (replace(one, orders=(1,)).at(phase) for one in series)
    return series_of((deflection - force / k).T, 4 * count, orders=meshes.stiffness.orders)


def _negative(series):
    if isinstance(series, StepSeries):
        return replace(series, values=-series.values)
    return replace(series, amplitudes=-series.amplitudes)


def _raised(series, offset):
    """The series with a constant (2N,) added."""
    if isinstance(series, StepSeries):
        return replace(series, values=series.values + offset[:, None])
    amplitudes = series.amplitudes.copy()
    amplitudes[:, 0] += offset
    return replace(series, amplitudes=amplitudes)


def _bearing_elements(data: PlanarSet, clearances: Clearances | None, groups) -> tuple[RadialBearings, ...]:
    elements = []
    for name in clearances.bearings if clearances else ():
        stiffness = data.planet_bearing if name == "planets" else getattr(data, name).support
        if np.any(np.asarray(stiffness) == 0.0):
            raise CaseError(
                f"the bearing of the {name} has a clearance but no stiffness", code="E-BEARING",
                remedy="give it a support stiffness, or leave the clearance out",
            )  # fmt: skip
        clearance = getattr(clearances, name)
        elements.append(
            RadialBearings(
                groups[name],
                stiffness,
                clearance,
                springs=clearances.springs,
                smoothing=clearances.smoothing,
            )
        )
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
        return reduced.real, ()
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


def damping_matrix(still: MechanicalSystem, reference: np.ndarray, damping) -> np.ndarray:
    """``C`` as given, or of modal ratios."""
    if damping is None:
        return still.C
    array = np.asarray(damping, float)
    if array.ndim < 2:
        return modal_damping(still, reference, damping)
    if array.shape != still.M.shape or not np.all(np.isfinite(array)):
        raise CaseError(
            f"a damping matrix of shape {array.shape}", code="E-SHAPE", key="damping",
            limit=f"{still.M.shape} finite numbers",
        )  # fmt: skip
    return array
