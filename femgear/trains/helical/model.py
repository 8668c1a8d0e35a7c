"""Helical planetary set of rigid bodies that move in space: data, excitation, modes, forced response.

Carrier, ring, sun and N planets have three translations and three rotations each, 6 (N + 3) coordinates.
A. Kahraman, Planetary Gear Train Dynamics, J. Mech. Des. 116, 1994, 713-720: rigid bodies, gear meshes as
springs along the tooth normals, supports and planet pins in all directions, without terms of the carrier's
speed. The matrices are those of `femgear.system.assembler.gear_set_system`; with the meshes as elements,
`helical_problem`, they have a stiffness that changes, play and contact loss.

The mesh stiffness follows from that of spur teeth. A helical gear is cut across its axis into thin slices,
each of them a spur gear that is turned by the helix against its neighbour, and the slices carry side by side
without any coupling between them (thin-slice approximation, J. D. Smith, Gear Noise and Vibration, 2nd ed.,
2003). It leaves out that loaded slices draw unloaded neighbours along, and that teeth are softer at their
ends. Each slice has the stiffness of the spur gear of its normal section, per length of the contact line.

The forced response to transmission errors is a modal summation, which also gives the loads of meshes, pins
and bearings.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.errors import CaseError, ConvergenceError
from femgear.gears import profile
from femgear.solvers.linear.modal import residual_output, solve_modes, viscous_damping
from femgear.solvers.linear.receptance import MeshErrorResponse
from femgear.system.assembler import check_mesh_columns, gear_set_system, mesh_elements
from femgear.system.elements import GearMeshes
from femgear.system.mode_kinds import gear_set_kinds, gear_set_motions, phase_basis
from femgear.system.rigid_bodies import (
    ContactLines,
    HelicalSupport,
    PlanarTorque,
    RigidSet,
    check_support,
    gear_geometry,
    refuse,
)
from femgear.system.system import MechanicalSystem, MeshExcitation, Modes, NonlinearSystem

if TYPE_CHECKING:
    from femgear.gears.planetary import PlanetarySet

CONTACT_POINTS = ("pitch_point", "base_circles")
# Rounded numbers miss each other by less than 1 %, other distances or angles than those of the gears by more.
LARGEST_CLOSURE = 0.1

# Relative distance of frequencies that rounding alone makes.
_ONE_FREQUENCY = 1e-9

# Distance to an undamped pole, relative to it, below which the response is infinite.
_RESONANT = 1e-12


@dataclass(frozen=True, kw_only=True, eq=False)
class HelicalSet(RigidSet):
    """Data of the helical set; the centres of all bodies lie in one plane.

    Bodies, radii, angles and mesh stiffnesses as in `RigidSet`; a stiffness of zero leaves a mesh out.

    Parameters
    ----------
    base_helix_angle : float
        Angle of the tooth normals to the transverse section [rad], beta_b with ``sin beta_b = sin beta cos
        alpha_n``; positive for a right-handed sun, whose planets and ring are then left-handed.
    planet_bearing : HelicalSupport
        Between planet and carrier, of numbers or (N,) arrays; infinite ties the planet to its pin.
    contact_points : {"pitch_point", "base_circles"}
        Where the mesh force acts in the transverse section. ``pitch_point``: on both gears at the pitch
        point. ``base_circles``: on each gear where the line of action touches its own base circle, as in
        A. Kahraman, J. Mech. Des. 116, 1994, 713-720 (Eqs. 7a, 7b: arms of base radii); the two points
        differ, so that a common tilt of both gears strains the mesh.
    slices : int
        Number S of equal slices of the face width, each of them one column of ``W`` with ``1/S`` of the
        stiffness, at mid-height of the slice.
    face_width : float
        [m], needed for more than one slice.

    Raises
    ------
    CaseError
        Numbers that no set can have, planet angles that are none, unordered or span more than a turn, or
        radii, centre distance and pressure angles that miss each other by more than 10 % (E-RANGE).
        `closure` tells by how much they do.
    """

    base_helix_angle: float
    planet_bearing: HelicalSupport
    contact_points: str = "pitch_point"
    slices: int = 1
    face_width: float = 0.0

    def __post_init__(self):
        super().__post_init__()
        if self.ring_radius <= self.planet_radius:
            allowed = f"above the {self.planet_radius} m of the planets"
            refuse("ring_radius", self.ring_radius, "m", allowed)
        if not abs(self._numbers("base_helix_angle", 0)) < 0.5 * math.pi:
            allowed = "between -pi/2 and pi/2"
            refuse("base_helix_angle", self.base_helix_angle, "rad", allowed, remedy="give radians")
        check_support("planet_bearing", self.planet_bearing, count=self.n_planets)
        _check_contact(self)
        _check_closure(self)

    @property
    def column_stiffness(self) -> np.ndarray:
        """Mean stiffness of the 2N S columns of ``W`` [N/m], the slices of a mesh side by side."""
        return self.per_column(self.mesh_stiffness) / self.slices

    @property
    def slice_heights(self) -> np.ndarray:
        """Height (S,) of the slices above mid-face [m]."""
        return self.face_width * ((np.arange(self.slices) + 0.5) / self.slices - 0.5)

    @property
    def pin_stiffness(self) -> np.ndarray:
        """Of the planet bearings, (N, 6): radial, tangential, axial [N/m], two tilts, torsional [N m/rad]."""
        return np.broadcast_to(self.planet_bearing.stiffness, (self.n_planets, 6))

    @property
    def contact_lines(self) -> ContactLines:
        """Helix, slices and contact points of the meshes."""
        heights = tuple(self.slice_heights.tolist())
        return ContactLines(self.base_helix_angle, heights, self.contact_points == "base_circles")

    def per_column(self, values) -> np.ndarray:
        """Values (2N, ...) of the meshes repeated for their slices, (2N S, ...)."""
        return np.repeat(np.asarray(values), self.slices, axis=0)


def helical_from_set(planetary_set: PlanetarySet, *, helix_angle: float, **data: Any) -> HelicalSet:
    """Make a helical set with the radii and angles of a geared one.

    Parameters
    ----------
    planetary_set : PlanetarySet
        Its gears in the transverse section: transverse module and pressure angle.
    helix_angle : float
        beta at the reference circle [rad], positive for a right-handed sun; ``tan beta_b = tan beta cos
        alpha_t`` (ISO 21771, section 4.2.6).
    **data
        Bodies, stiffnesses, bearing, contact points and slices of `HelicalSet`.
    """
    base = math.atan(math.tan(helix_angle) * math.cos(planetary_set.sun.pressure_angle))
    return HelicalSet(base_helix_angle=base, **data, **gear_geometry(planetary_set))


def contact_ratios(planetary_set: PlanetarySet, *, helix_angle: float, face_width: float) -> np.ndarray:
    """Transverse and overlap contact ratio (2, 2) of the sun-planet and the planet-ring mesh.

    ``eps_gamma = eps_alpha + eps_beta``, ``eps_beta = b sin|beta| / (pi m_n)`` (ISO 21771, sections 5.4.2.3
    and 5.4.4); a row is one mesh.

    Parameters
    ----------
    planetary_set : PlanetarySet
        Its gears in the transverse section.
    helix_angle : float
        [rad]
    face_width : float
        That both gears of a mesh have in common [m].
    """
    s = planetary_set
    normal_module = s.sun.module * math.cos(helix_angle)
    overlap = profile.overlap_ratio(face_width, normal_module, helix_angle)
    return np.array([[s.contact_ratio_sun_planet, overlap], [s.contact_ratio_planet_ring, overlap]])


def _check_contact(data: HelicalSet) -> None:
    if data.contact_points not in CONTACT_POINTS:
        refuse("contact_points", repr(data.contact_points), "", " or ".join(CONTACT_POINTS))
    if isinstance(data.slices, bool) or int(data.slices) != data.slices or data.slices < 1:
        refuse("slices", data.slices, "", "a whole number of 1 or more")
    if not (math.isfinite(data.face_width) and data.face_width >= 0.0):
        refuse("face_width", data.face_width, "m", "finite, 0 or more")
    if data.slices > 1 and not data.face_width:
        refuse("face_width", data.face_width, "m", "above 0 for several slices")


def _check_closure(data: HelicalSet) -> None:
    worst = max(data.closure, key=abs)
    if abs(worst) > LARGEST_CLOSURE:
        refuse(
            "centre_distance", data.centre_distance, "m",
            f"(r_s + r_p) / cos alpha_sp and (r_r - r_p) / cos alpha_pr, within {LARGEST_CLOSURE:.0%}",
            remedy=f"radii, centre distance and pressure angles miss each other by {abs(worst):.3g}",
        )  # fmt: skip


def helical_problem(
    data: HelicalSet,
    *,
    meshes: GearMeshes | None = None,
    torque: PlanarTorque | None = None,
    damping: float | np.ndarray | None = None,
) -> NonlinearSystem:
    """Helical set with its meshes as elements, for harmonic balance and time integration.

    Back flanks act on the line of the drive flanks: there is no wedging.

    Parameters
    ----------
    data : HelicalSet
    meshes : GearMeshes, optional
        From `mesh_elements`; constant stiffnesses without back side when not given.
    torque : PlanarTorque, optional
    damping : float, (n_modes,) array or (n, n) array, optional
        Damping ratio of all modes, or one a mode, with mean stiffnesses; or the matrix ``C``.

    Raises
    ------
    CaseError
        A load that accelerates the set (E-LOAD-BALANCE), arrays that do not fit (E-SHAPE).
    """
    meshes = mesh_elements(data) if meshes is None else meshes
    check_mesh_columns(data, meshes)
    system = gear_set_system(data, torque=torque)
    reference = NonlinearSystem(system, (meshes,)).reference
    # refuses a load that nothing takes up before a solver drifts away with it
    solve_modes(system, reference)
    return NonlinearSystem(replace(system, C=viscous_damping(system, reference, damping)), (meshes,))


def helical_excitation(
    record: MeshExcitation, overlap_ratio, *, slices: int = 1, hand: int = 1
) -> MeshExcitation:
    """Record of helical meshes, or of their slices, from that of spur meshes with the same mesh period.

    Height z above mid-face runs ahead of it by ``eps_beta z / b`` mesh periods, so that

    ``k(tau) = 1 / eps_beta int k_spur(tau + s) ds``, s from ``-eps_beta / 2`` to ``eps_beta / 2``,

    which multiplies harmonic h by ``sin(pi h eps_beta) / (pi h eps_beta)``: nothing is left of it where
    ``h eps_beta`` is a whole number. Tangent lines add up: the mesh force is the mean of the forces of the
    slices, and the deflection at which their tangents together carry it is the mean weighted by stiffness.

    Parameters
    ----------
    record : MeshExcitation or MeshCycle
        Of the spur gears of the normal section, all of it loaded as the whole helical mesh; stiffnesses and
        deflections along the tooth normals. Their teeth are as long as the contact lines, so that the face
        width is ``b / cos beta_b`` (ISO 6336-1, method B: ``c' b cos beta_b`` in the transverse section).
        Mesh phases are those at mid-face. A `femgear.contact.cycle.MeshCycle` knows no backlash, which is
        then zero.
    overlap_ratio : float or (n_meshes,) array
        eps_beta, 0 or more.
    slices : int
        Number S of equal slices of the face width; each has a row of its own with its part of stiffness and
        force, in the order of the columns of `mesh_directions`.
    hand : {1, -1}
        1 where height +z runs ahead: a right-handed sun that turns counter-clockwise against the carrier, or
        a left-handed one that turns clockwise. Only slices see it.

    Returns
    -------
    MeshExcitation
        (n_meshes S) rows.

    Raises
    ------
    CaseError
        Overlap ratios, slices or a hand that cannot be (E-RANGE), a slice that loses its stiffness
        (E-STIFFNESS).
    """
    count = len(record.stiffness)
    ahead = slice_phases(np.zeros(count), overlap_ratio, slices=slices, hand=hand).reshape(count, slices)
    overlap = _overlap(overlap_ratio, count)
    backlash = np.broadcast_to(getattr(record, "backlash", 0.0), count)
    filtered = [
        _sliced(values, record.periods, ahead, overlap / slices) / slices
        for values in (record.stiffness, record.force, record.stiffness * record.deflection)
    ]
    stiffness, force, weighted = (values.reshape(-1, values.shape[-1]) for values in filtered)
    if np.any(stiffness <= 0.0):
        raise CaseError(
            "the spur record has positions without stiffness for a whole slice", code="E-STIFFNESS",
            remedy="give a record whose meshes stay closed",
        )  # fmt: skip
    return MeshExcitation(
        stiffness=stiffness,
        deflection=weighted / stiffness,
        force=force,
        backlash=np.repeat(backlash, slices),
        periods=record.periods,
    )


def slice_phases(phases, overlap_ratio, *, slices: int, hand: int = 1) -> np.ndarray:
    """Phases (n_meshes S,) of the slices of meshes, as fractions of the mesh period.

    Parameters
    ----------
    phases : (n_meshes,) array
        At mid-face.
    overlap_ratio, slices, hand
        See `helical_excitation`.
    """
    phases = np.asarray(phases, float)
    overlap = _overlap(overlap_ratio, len(phases))
    if isinstance(slices, bool) or int(slices) != slices or slices < 1:
        raise CaseError(f"{slices} slices of the face width", code="E-RANGE", limit="1 or more")
    if hand not in (1, -1):
        raise CaseError(f"a hand of {hand}", code="E-RANGE", limit="1 or -1")
    height = (np.arange(slices) + 0.5) / slices - 0.5
    return (phases[:, None] + hand * overlap[:, None] * height).ravel()


def _sliced(values: np.ndarray, periods: int, ahead: np.ndarray, width: np.ndarray) -> np.ndarray:
    """Means (n, S, P) of (n, P) samples of `periods` mesh periods over windows of `width` around `ahead`.

    Exact for the trigonometric polynomial through the samples.
    """
    count = values.shape[-1]
    order = np.fft.rfftfreq(count, 1.0 / count) / periods  # in cycles a mesh period
    shift = np.exp(2j * np.pi * order * ahead[..., None]) * np.sinc(order * width[:, None, None])
    return np.fft.irfft(np.fft.rfft(values)[:, None] * shift, n=count)


def _overlap(overlap_ratio, meshes: int) -> np.ndarray:
    overlap = np.asarray(overlap_ratio, float)
    if overlap.shape not in ((), (meshes,)) or not np.all(np.isfinite(overlap)) or np.any(overlap < 0.0):
        raise CaseError(
            f"overlap ratios {overlap.tolist()}", code="E-RANGE", key="overlap_ratio",
            limit=f"one number of 0 or more, or {meshes}", remedy="give b sin|beta| / (pi m_n)",
        )  # fmt: skip
    return np.broadcast_to(overlap, (meshes,))


def helical_modes(
    data: HelicalSet,
    *,
    system: MechanicalSystem | None = None,
    mesh_stiffness=None,
    damping_ratio: float = 0.0,
    max_frequency: float | None = None,
) -> Modes:
    """Solve for the modes of the set at standstill, with their kinds.

    Parameters
    ----------
    data : HelicalSet
    system : MechanicalSystem, optional
        `gear_set_system` of the set, with the flanks that a torque loads; without torque when not given.
    mesh_stiffness : (2N S,) array, optional
        Of the columns [N/m]; that of the set when not given.
    damping_ratio : float
        Of all modes.
    max_frequency : float, optional
        Keep the modes up to this frequency [Hz]; all when not given.

    Returns
    -------
    Modes
        ``kind`` from `gear_set_kinds`; modes of one frequency have one phasing each.
    """
    system = gear_set_system(data) if system is None else system
    stiffness = data.column_stiffness if mesh_stiffness is None else mesh_stiffness
    modes = solve_modes(system, stiffness, damping_ratio=damping_ratio, max_frequency=max_frequency)
    # tilts of the planets that no mesh feels have one frequency in several classes
    Q = phase_basis(gear_set_motions(data, modes.shape), modes.frequency, tolerance=_ONE_FREQUENCY)
    shape = modes.shape @ Q
    return replace(
        modes,
        shape=shape,
        mesh_deflection=modes.mesh_deflection @ Q,
        modal_load=None if modes.modal_load is None else Q.T @ modes.modal_load,
        kind=gear_set_kinds(data, shape, frequency=modes.frequency),
    )


def modal_error_response(
    system: MechanicalSystem, modes: Modes, mesh_frequency, error, *, harmonics=None, outputs=None
) -> MeshErrorResponse:
    """Response to transmission errors ``e_j(t) = Re sum_h error_jh exp(i h omega_m t)`` by summing modes.

    ``q = sum phi (phi^T W k e) / (omega_k^2 - omega^2 + 2 i zeta_k omega_k omega)``, with the static
    flexibility of modes that were left out (Geradin and Rixen, Mechanical Vibrations, 3rd ed., section 2.9;
    A. Kahraman, J. Mech. Des. 116, 1994, 713-720, sums all modes). Many cases share one gain. A transmission
    error does no work on rigid motions, so that these stay at rest.
    `femgear.solvers.linear.receptance.direct_response` is the direct solution.

    Parameters
    ----------
    system : MechanicalSystem
    modes : Modes
        Of that system; ``modes.mesh_stiffness`` are the stiffnesses ``k`` of the columns of ``W``.
    mesh_frequency : (F,) array
        [Hz]
    error : (n_columns, H) or (n_cases, n_columns, H) complex array
        [m]; of one case the result has a first axis of length one. For phases phi_j as fractions of the mesh
        period, ``k_j(tau) = k(tau + phi_j)``, it is ``e_h exp(2 pi i h phi_j)``, see `phased_errors`.
    harmonics : (H,) int array, optional
        Whole numbers from 1; 1 to H when not given.
    outputs : (n_outputs, n) array, optional
        ``L``, such as the rows of `spring_loads`; none when not given.

    Returns
    -------
    MeshErrorResponse
        With a first axis of the cases: deflection and force (n_cases, F, H, n_columns), output (n_cases, F,
        H, n_outputs).

    Raises
    ------
    CaseError
        Errors or harmonics that do not fit (E-SHAPE), harmonics or frequencies that are none (E-HARMONICS,
        E-RANGE).
    ConvergenceError
        An undamped resonance (E-RESONANCE).
    """
    k, count = modes.mesh_stiffness, len(system.M)
    error, harmonics = _errors(error, harmonics, len(k))
    frequency = _frequencies(mesh_frequency)
    rows = np.empty((0, count)) if outputs is None else np.atleast_2d(np.asarray(outputs, float))
    elastic = modes.frequency > 0.0
    left = np.vstack([system.W.T, rows]) @ modes.shape[:, elastic]
    gain = _gain(modes, elastic, np.outer(frequency, harmonics))
    # forces k e of the errors on the meshes, and on the modes
    push = k[:, None] * error
    modal = np.einsum("jm,cjh->chm", modes.mesh_deflection[:, elastic], push)
    static = np.zeros((len(error), len(harmonics), len(left)))
    if modes.shape.shape[1] < count:
        rest = np.vstack([modes.residual, residual_output(system, modes, rows)])
        static = np.einsum("oj,cjh->cho", rest, push)
    answer = np.empty((len(error), len(frequency), len(harmonics), len(left)), complex)
    for h in range(len(harmonics)):
        answer[:, :, h] = (gain[:, h] * modal[:, None, h]) @ left.T + static[:, None, h]
    deflection, output = answer[..., : len(k)], answer[..., len(k) :]
    force = k * (deflection - error.transpose(0, 2, 1)[:, None])
    return MeshErrorResponse(frequency, harmonics, deflection, force, output)


def phased_errors(amplitudes, phases) -> np.ndarray:
    """Transmission errors (n_meshes, H) of meshes that follow each other.

    Parameters
    ----------
    amplitudes : (H,) or (n_meshes, H) complex array
        Harmonics 1 to H at phase zero [m].
    phases : (n_meshes,) array
        phi_j as fractions of the mesh period, ``e_j(tau) = e(tau + phi_j)``: `PlanetarySet.mesh_phases`.
    """
    amplitudes, phases = np.asarray(amplitudes, complex), np.asarray(phases, float)
    turns = phases[:, None] * np.arange(1, amplitudes.shape[-1] + 1)
    return amplitudes * np.exp(2j * np.pi * turns)


def spring_loads(springs: Mapping[str, tuple[np.ndarray, np.ndarray]]) -> tuple[tuple[str, ...], np.ndarray]:
    """Names and rows (n_outputs, n) that read the loads of springs from the coordinates.

    Parameters
    ----------
    springs : mapping of str to (columns (n, g), stiffness (g,))
        Columns and stiffnesses by name; those of meshes give ``k W^T q`` without the
        transmission error, whose force is in `MeshErrorResponse.force`.

    Returns
    -------
    names : tuple of str
        The name of the spring, with ``1`` and ``2`` behind it where it has two columns or more.
    rows : (n_outputs, n) array
        [N/m, N m/rad and the like]
    """
    names, rows = [], []
    for name, (columns, stiffness) in springs.items():
        several = len(stiffness) > 1
        names += [f"{name} {i + 1}" if several else name for i in range(len(stiffness))]
        rows.append((columns * stiffness).T)
    return tuple(names), np.vstack(rows)


def _errors(error, harmonics, columns: int) -> tuple[np.ndarray, np.ndarray]:
    error = np.asarray(error, complex)
    error = error[None] if error.ndim == 2 else error
    harmonics = np.arange(1, error.shape[-1] + 1) if harmonics is None else np.atleast_1d(harmonics)
    if harmonics.ndim != 1 or harmonics.dtype.kind not in "iu" or np.any(harmonics < 1):
        raise CaseError(
            f"harmonics {harmonics.tolist()} of the mesh frequency", code="E-HARMONICS", key="harmonics",
            limit="whole numbers from 1", remedy="the mean of a transmission error is a static load",
        )  # fmt: skip
    if error.shape[1:] != (columns, len(harmonics)) or not np.all(np.isfinite(error)):
        raise CaseError(
            f"transmission errors of shape {error.shape}", code="E-SHAPE",
            limit=f"(cases, {columns} meshes, {len(harmonics)} harmonics), finite",
        )  # fmt: skip
    return error, harmonics


def _frequencies(mesh_frequency) -> np.ndarray:
    frequency = np.atleast_1d(np.asarray(mesh_frequency, float))
    if frequency.ndim != 1 or not np.all(np.isfinite(frequency)) or np.any(frequency < 0.0):
        raise CaseError(
            f"mesh frequencies of shape {frequency.shape}", code="E-RANGE", key="mesh_frequency",
            limit="a list of numbers >= 0 Hz",
        )  # fmt: skip
    return frequency


def _gain(modes: Modes, elastic: np.ndarray, frequency: np.ndarray) -> np.ndarray:
    """``1 / (omega_k^2 - omega^2 + 2 i zeta_k omega_k omega)`` (F, H, m)."""
    natural, w = 2.0 * np.pi * modes.frequency[elastic], 2.0 * np.pi * frequency[..., None]
    below = natural**2 - w**2 + 2j * modes.damping_ratio[elastic] * natural * w
    bad = np.abs(below) <= _RESONANT * np.maximum(natural**2, w**2)
    if np.any(bad):
        mode = int(np.argwhere(bad)[0, -1])
        raise ConvergenceError(
            f"undamped resonance at {natural[mode] / (2 * np.pi):.6g} Hz: infinite response",
            code="E-RESONANCE", remedy="give the motion some damping or move the frequency",
        )  # fmt: skip
    return 1.0 / below
