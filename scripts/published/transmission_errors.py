"""Errors of a planetary set as mesh deflections in the carrier frame, and its dampers from damping ratios.

Every error has its own frequency. Teeth whose axis stands off the axis of rotation by an eccentricity turn
with their member. In the frame of the carrier the sun, the planets and the ring turn with the mesh frequency
over their numbers of teeth. The approach of flanks is that of the mesh columns, so that an eccentricity E of
the sun changes the deflections at which the flanks of mesh n touch unloaded by ``E sin(psi_n - alpha -
phi)``, phi its direction (Kahraman, J. Mech. Des. 116 (1994) 713-720, errors of the teeth; Mech. Mach. Theory
29 (1994) 1151-1165, runout). The carrier's own eccentricity stands still in its frame: see `carrier_pins`.

Viscous dampers of meshes and supports follow from damping ratios, spring by spring: ``c = 2 xi sqrt(k m_1 m_2
/ (m_1 + m_2))`` for a mesh between two gears and ``c = 2 xi sqrt(k m)`` for a support. Each spring with its
own masses alone would be damped by xi (S. S. Rao, Mechanical Vibrations, section 2.6, critical damping, with
the reduced mass of two bodies). In the whole set the ratio of a mode comes out of all dampers;
`femgear.solvers.linear.modal.modal_damping` gives every mode a ratio instead.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from femgear.errors import CaseError, checked_numbers
from femgear.system.assembly import stiffness_matrix
from femgear.system.force_laws import GearMeshes
from femgear.system.fourier import FourierSeries, StepSeries, SummedSeries, distinct_lines
from femgear.system.mesh_directions import (
    free_motions,
    mesh_directions,
    pin_directions,
    support_diagonal,
)
from femgear.system.rigid_bodies import CENTRAL, PlanarSet, body_masses
from femgear.system.system import HarmonicForce, NonlinearSystem

# sense of the rotation relative to the carrier where the sun turns counter-clockwise in its frame
SENSE = {"sun": 1, "planet": -1, "ring": -1}
# base radii of published sets are rounded; ratios of teeth that differ by more are another set
_RADII = 1e-2
# difference of two line frequencies, relative to the highest one, below which they are one
_COINCIDE = 1e-9


@dataclass(frozen=True)
class Eccentricity:
    """Teeth beside the axis of rotation.

    Parameters
    ----------
    amplitude : float, or (N,) array for planets
        [m]
    phase : float, or (N,) array for planets
        Direction when the member's phase is zero, counter-clockwise from the x axis, for planets from the
        radial direction outwards [rad].
    """

    amplitude: float | np.ndarray
    phase: float | np.ndarray = 0.0


@dataclass(frozen=True, kw_only=True, eq=False)
class TransmissionErrors:
    """Errors of a set; bases are the mesh frequency and then those of the eccentric members in use.

    Parameters
    ----------
    data : PlanarSet
    teeth : dict
        Numbers of teeth of ``sun``, ``planet`` and ``ring``, in the ratio of the base radii to 1 % (those of
        published sets are rounded).
    sun, planet, ring : Eccentricity, optional
    tooth : (2N, H) complex array, optional
        Harmonics 1 to H of the tooth-frequency error of every mesh, its phase included: the deflection at
        which the flanks touch unloaded [m]. `tooth_lines` makes it from one wave and the mesh phases.
    flank : int
        1, or -1 when the torque loads the other flanks.
    direction : int
        1 where the sun turns counter-clockwise relative to the carrier, else -1.
    """

    data: PlanarSet
    teeth: dict[str, int]
    sun: Eccentricity | None = None
    planet: Eccentricity | None = None
    ring: Eccentricity | None = None
    tooth: np.ndarray | None = None
    flank: int = 1
    direction: int = 1
    bases: tuple[str, ...] = field(init=False)

    def __post_init__(self):
        if self.flank not in (1, -1) or self.direction not in (1, -1):
            raise CaseError(
                f"errors on flank {self.flank}, direction {self.direction}", code="E-RANGE", limit="1 or -1"
            )
        _check_teeth(self.data, self.teeth)
        used = tuple(name for name in SENSE if getattr(self, name) is not None)
        object.__setattr__(self, "bases", ("mesh", *used))
        for name in used:
            self._vector(name)
        if self.tooth is not None:
            lines = checked_numbers(self.tooth, "tooth", code="E-SHAPE", unit="m", kind=complex)
            if lines.ndim != 2 or len(lines) != 2 * self.data.n_planets or not np.all(np.isfinite(lines)):
                raise CaseError(
                    f"tooth errors of shape {lines.shape}",
                    code="E-SHAPE",
                    key="tooth",
                    limit=f"({2 * self.data.n_planets}, harmonics), finite",
                )
            object.__setattr__(self, "tooth", lines)

    def frequency(self, mesh_frequency: float) -> np.ndarray:
        """Base frequencies (n_bases,) at a mesh frequency, in its unit."""
        return mesh_frequency / np.array([1.0, *(self.teeth[name] for name in self.bases[1:])])

    @property
    def series(self) -> SummedSeries:
        """Deflections (2N) at which the flanks touch unloaded [m]."""
        count = len(self.bases)
        parts = [self.member_series(name) for name in self.bases[1:]]
        if self.tooth is not None:
            mean = np.zeros((2 * self.data.n_planets, 1))
            parts.insert(0, FourierSeries(np.hstack([mean, self.tooth]), _unit(0, count)))
        return SummedSeries(tuple(parts or [FourierSeries(np.zeros((2 * self.data.n_planets, 1)))]))

    def member_series(self, name: str) -> FourierSeries:
        """The part of one eccentric member, of its own base frequency."""
        W = mesh_directions(self.data, self.flank)
        vector, n = self._vector(name), np.arange(self.data.n_planets)
        if name == "planet":
            rows = 9 + 3 * n
            approach = np.zeros((W.shape[1], len(n)), complex)
            approach[:, n] = (W[rows] * vector[:, :1] + W[rows + 1] * vector[:, 1:]).T
            total = approach.sum(axis=1)
        else:
            first = 3 * CENTRAL.index(name)
            total = W[first : first + 2].T @ vector
        lines = np.stack([np.zeros_like(total), -total], axis=1)
        return FourierSeries(lines, _unit(self.bases.index(name), len(self.bases)))

    def lines(self, *, mesh: int, member: int = 1, bands: int = 1) -> np.ndarray:
        """Lines (L, n_bases) for harmonic balance: mesh harmonics, member harmonics, side bands of each.

        Parameters
        ----------
        mesh, member : int
            Harmonics of the mesh frequency and of every member's frequency.
        bands : int
            Side bands of every mesh harmonic at multiples of each member's frequency.
        """
        count = len(self.bases)
        rows = [np.zeros(count, int)]
        for h in range(mesh + 1):
            rows.append(h * np.eye(count, dtype=int)[0])
            for base in range(1, count):
                reach = member if h == 0 else bands
                for q in range(-reach, reach + 1):
                    rows.append(h * np.eye(count, dtype=int)[0] + q * np.eye(count, dtype=int)[base])
        return distinct_lines(np.array(rows))

    def _vector(self, name: str) -> np.ndarray:
        """Complex displacement (2,) of the teeth in x and y; planets (N, 2), radial and tangential."""
        given = getattr(self, name)
        if not isinstance(given, Eccentricity):
            raise CaseError(
                f"an eccentricity given as {given!r}",
                code="E-RANGE",
                key=name,
                limit="an Eccentricity",
                remedy=f"{name}=Eccentricity(5e-6)",
            )
        amplitude = checked_numbers(given.amplitude, f"{name}.amplitude", code="E-RANGE", unit="m")
        phase = checked_numbers(given.phase, f"{name}.phase", code="E-RANGE", unit="rad")
        size = (self.data.n_planets,) if name == "planet" else ()
        sense = SENSE[name] * self.direction
        try:
            turned = np.broadcast_to(amplitude * np.exp(1j * sense * phase), size)
        except ValueError:
            turned = np.array(np.nan)
        if not np.all(np.isfinite(turned)) or np.any(amplitude < 0.0):
            raise CaseError(
                f"an eccentricity of {amplitude.tolist()} m at {phase.tolist()} rad",
                code="E-RANGE",
                key=name,
                limit="0 m or more, finite, one value, for planets also one each",
            )
        return np.stack([turned, -1j * sense * turned], axis=-1)


def series_spectrum(series: FourierSeries | SummedSeries, frequency) -> tuple[np.ndarray, np.ndarray]:
    """Lines of a series at given base frequencies, ascending; lines that coincide are added.

    Parameters
    ----------
    series : FourierSeries or SummedSeries
    frequency : float or (n_bases,) array
        [rad/s]

    Returns
    -------
    line_frequency : (L,) array
        Not negative; the mean first [rad/s].
    amplitude : (n, L) complex array
        ``Re sum_l A_l exp(i omega_l t)``.
    """
    frequency = np.atleast_1d(checked_numbers(frequency, "frequency", code="E-RANGE", unit="rad/s"))
    if frequency.ndim != 1 or not np.all(np.isfinite(frequency)):
        raise CaseError(
            f"base frequencies of shape {frequency.shape}",
            code="E-RANGE",
            key="frequency",
            limit="finite numbers, one a base",
        )
    parts = series.parts if isinstance(series, SummedSeries) else (series,)
    rates, lines = [np.zeros(1)], [np.zeros((len(parts[0].amplitudes), 1), complex)]
    for part in parts:
        base = float(np.dot(part.orders[: len(frequency)], frequency[: len(part.orders)]))
        rate = base * np.arange(part.amplitudes.shape[1])
        rates.append(np.abs(rate))
        lines.append(np.where(rate < 0.0, part.amplitudes.conj(), part.amplitudes))
    rates, lines = np.concatenate(rates), np.concatenate(lines, axis=1)
    order = np.argsort(rates, kind="stable")
    rates, lines = rates[order], lines[:, order]
    first = np.flatnonzero(np.diff(rates, prepend=-np.inf) > _COINCIDE * rates.max(initial=0.0))
    total = np.add.reduceat(lines, first, axis=1)
    total[:, 0] = np.real(total[:, 0])
    return rates[first], total


def with_errors(
    problem: NonlinearSystem, errors: TransmissionErrors, *, dampers=None, mesh_frequency: float | None = None
) -> NonlinearSystem:
    """A problem of `gear_set_problem` with the errors added to the deflections of its drive flanks.

    Parameters
    ----------
    problem : NonlinearSystem
        With one base, the mesh frequency; its meshes act on both flanks or have no back side.
    errors : TransmissionErrors
    dampers : (2N,) array, optional
        Mesh dampers in ``C`` [N s/m], as of `planar_mesh_dampers`: they act on the rate of the deflection
        less the error, ``c (w^T q' - e')``, so that ``W c e'`` joins the forces.
    mesh_frequency : float, optional
        [rad/s], needed with dampers, since their forces grow with it.

    Raises
    ------
    CaseError
        Back flanks on their own lines, stepwise series (E-RANGE), dampers without a frequency (E-RANGE).
    """
    drive, *others = problem.elements
    stiffness = drive.state[0] if isinstance(drive, GearMeshes) else None
    several = any(isinstance(element, GearMeshes) for element in others)
    if (
        not isinstance(drive, GearMeshes)
        or stiffness is None
        or isinstance(stiffness, StepSeries)
        or several
        or len(drive.columns) != 2 * errors.data.n_planets
    ):
        raise CaseError(
            "errors need one element of all meshes with Fourier series",
            code="E-RANGE",
            remedy="build the problem with gear_set_problem, without back flanks on their own lines",
        )
    series = errors.series
    parts = stiffness.parts if isinstance(stiffness, SummedSeries) else (stiffness,)
    elements = (replace(drive, deflection=SummedSeries((*parts, *series.parts))), *others)
    forces = problem.forces
    if dampers is not None:
        if mesh_frequency is None:
            raise CaseError("mesh dampers without the mesh frequency", code="E-RANGE", key="mesh_frequency")
        dampers = checked_numbers(dampers, "dampers", code="E-SHAPE", unit="N s/m")
        rate = checked_numbers(mesh_frequency, "mesh_frequency", code="E-RANGE", unit="rad/s")
        if dampers.shape != (len(drive.columns),) or rate.ndim or not np.all(np.isfinite([*dampers, rate])):
            raise CaseError(
                f"mesh dampers of shape {dampers.shape} at {rate.tolist()} rad/s",
                code="E-SHAPE",
                key="dampers",
                limit=f"{len(drive.columns)} finite numbers and one mesh frequency",
            )
        pushes = problem.system.W[:, drive.columns[:, 0]] * dampers
        forces = (*forces, *_rates(pushes, series, errors.frequency(mesh_frequency)))
    return replace(problem, elements=elements, forces=forces)


def carrier_pins(data: PlanarSet, amplitude: float, phase: float = 0.0) -> np.ndarray:
    """Pin displacements (N, 2), radial and tangential [m], of a pin circle beside the carrier's axis.

    Parameters
    ----------
    data : PlanarSet
    amplitude : float
        [m]
    phase : float
        Direction from the x axis of the carrier [rad].
    """
    given = {"amplitude": amplitude, "phase": phase}
    for name, value in given.items():
        number = checked_numbers(value, name, code="E-RANGE", unit="")
        if number.ndim or not np.isfinite(number):
            raise CaseError(f"a {name} of {value}", code="E-RANGE", key=name, limit="one finite number")
    angle = phase - data.angles
    return amplitude * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def mesh_dampers(stiffness, mass_1, mass_2, ratio) -> np.ndarray:
    """``2 xi sqrt(k m_1 m_2 / (m_1 + m_2))`` [N s/m].

    Parameters
    ----------
    stiffness : array
        Mean mesh stiffness [N/m].
    mass_1, mass_2 : arrays
        Of the gears along the line of action, ``I / r_b^2`` for their rotations [kg]; infinite for a gear
        that is held.
    ratio : array

    Raises
    ------
    CaseError
        Negative or undefined values, masses that are not above zero (E-DAMPING).
    """
    given = {"stiffness": stiffness, "mass_1": mass_1, "mass_2": mass_2, "ratio": ratio}
    k, m1, m2, xi = (_numbers(name, value) for name, value in given.items())
    _not_negative("mesh stiffness", k)
    _not_negative("damping ratio", xi)
    if not (np.all(m1 > 0.0) and np.all(m2 > 0.0)):
        raise CaseError("a mesh between gears without mass", code="E-DAMPING", limit="masses above 0 kg")
    flexibility = 1.0 / m1 + 1.0 / m2
    if np.any(flexibility == 0.0):
        raise CaseError("a mesh between two gears that are held", code="E-DAMPING", limit="one finite mass a mesh")
    return 2.0 * xi * np.sqrt(k / flexibility)


def support_dampers(stiffness, mass, ratio) -> np.ndarray:
    """``2 xi sqrt(k m)`` [N s/m]; [N m s] of a torsional stiffness and a polar inertia.

    Raises
    ------
    CaseError
        Negative or undefined values (E-DAMPING).
    """
    given = {"stiffness": stiffness, "mass": mass, "ratio": ratio}
    k, m, xi = (_numbers(name, value) for name, value in given.items())
    for name, value in (("support stiffness", k), ("mass", m), ("damping ratio", xi)):
        _not_negative(name, value)
    return 2.0 * xi * np.sqrt(k * m)


def planar_mesh_dampers(data: PlanarSet, ratio) -> np.ndarray:
    """Dampers (2N,) of the meshes with the masses ``I / r_b^2`` of the gears [N s/m].

    Parameters
    ----------
    data : PlanarSet
    ratio : float or (2N,) array
    """
    if _numbers("mesh_ratio", ratio).shape not in ((), (2 * data.n_planets,)):
        raise CaseError(
            f"mesh damping ratios of shape {np.shape(ratio)}",
            code="E-DAMPING",
            key="mesh_ratio",
            limit=f"one, or {2 * data.n_planets}: one a mesh",
        )
    turning = body_masses(data)[:, 2]
    held = {name: math.isinf(getattr(data, name).torsional_support) for name in CENTRAL}
    sun, ring = (math.inf if held[n] else turning[CENTRAL.index(n)] for n in ("sun", "ring"))
    central = np.repeat([sun, ring], data.n_planets)
    return mesh_dampers(data.mesh_stiffness, central, turning[-1], ratio)


def equivalent_damping(data: PlanarSet, *, mesh_ratio, support_ratio, flank: int = 1) -> np.ndarray:
    """Damping matrix of a set in the coordinates of `gear_set_system`, for ``gear_set_problem(damping=)``.

    Parameters
    ----------
    data : PlanarSet
        Infinite stiffnesses hold their coordinates and have no dampers.
    mesh_ratio : float or (2N,) array
        Of the meshes.
    support_ratio : float
        Of all supports, torsional ones and planet bearings (with the planet's mass) included.
    flank : int
        1, or -1 when the torque loads the other flanks, see `flank_sign`.

    Returns
    -------
    (n, n) array
        ``sum c w w^T`` over the springs' directions w [N s/m].
    """
    if flank not in (1, -1):
        raise CaseError(f"flank {flank}", code="E-DAMPING", key="flank", limit="1 or -1")
    if _numbers("support_ratio", support_ratio).ndim:
        raise CaseError("several support damping ratios", code="E-DAMPING", key="support_ratio", limit="one")
    W, T, pins = mesh_directions(data, flank), free_motions(data), pin_directions(data)
    C = (W * planar_mesh_dampers(data, mesh_ratio)) @ W.T
    C += np.diag(support_dampers(support_diagonal(data), body_masses(data), support_ratio).ravel())
    bearings = np.where(np.isfinite(data.pin_stiffness), data.pin_stiffness, 0.0)
    dampers = support_dampers(bearings, data.planet.mass, support_ratio)
    C += stiffness_matrix(pins.reshape(len(pins), -1), dampers.ravel())
    return T.T @ C @ T


def _check_teeth(data: PlanarSet, teeth) -> None:
    """Refuse numbers that are no teeth, or not those of the base radii."""
    names = ("sun", "planet", "ring")
    values = [teeth.get(name) for name in names] if isinstance(teeth, dict) else [None]
    numbers = [z for z in values if isinstance(z, int | float | np.number) and float(z).is_integer() and z >= 1]
    if len(numbers) != 3:
        raise CaseError(
            f"errors of gears with teeth {teeth}",
            code="E-RANGE",
            key="teeth",
            limit="whole numbers of sun, planet and ring, 1 or more",
        )
    for name, count, radius in zip(names[1:], numbers[1:], (data.planet_radius, data.ring_radius)):
        teeth_ratio, radii_ratio = count / numbers[0], radius / data.sun_radius
        if abs(radii_ratio / teeth_ratio - 1.0) > _RADII:
            raise CaseError(
                f"{name} and sun have {teeth_ratio:.5g} as ratio of teeth and {radii_ratio:.5g} as ratio of base radii",
                code="E-TEETH",
                key="teeth",
                value=tuple(numbers),
                limit="the same to 1 %",
                remedy="give the teeth of the set",
            )


def _rates(pushes, series: SummedSeries, frequency):
    """Forces ``pushes e'`` of every harmonic of every part."""
    for part in series.parts:
        rate = float(np.dot(part.orders, frequency[: len(part.orders)]))
        for h, line in enumerate(part.amplitudes.T):
            if h and np.any(line):
                yield HarmonicForce(pushes @ (1j * h * rate * line), tuple(h * o for o in part.orders))


def _unit(base: int, count: int) -> tuple[int, ...]:
    return tuple(int(place == base) for place in range(count))


def _numbers(name: str, value) -> np.ndarray:
    return checked_numbers(value, name, code="E-DAMPING", unit="")


def _not_negative(name: str, value: np.ndarray) -> None:
    if not (np.all(np.isfinite(value)) and np.all(value >= 0.0)):
        raise CaseError(f"{name} {value.tolist()}", code="E-DAMPING", limit="finite, 0 or more")
