"""Modes followed over a parameter, and the Campbell diagram.

Modes are assigned by shape and eigenvalue, and steps are refined where modes veer (`track_modes`). Over the
speed they make a Campbell diagram, where lines of excitation meet them (`campbell_data`).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import polar

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.linear.modal import ComplexModes, complex_modes, whirl
from femgear.system.system import MechanicalSystem, freeze

# Relative distance of eigenvalues that belong to one multiple eigenvalue, whose vectors are free.
_MULTIPLE = 1e-7
# Lowest MAC over one step, and how often a step is halved to reach it.
_AGREEMENT, _MOST_HALVINGS = 0.9, 14
# Relative distance at which two branches may pass each other: closer ones count as crossing.
_CROSSING = 1e-6
# Cost of a relative distance of eigenvalues, and its bound, against 1 - MAC.
_CONTINUITY, _BOUND = 10.0, 0.5


@dataclass(frozen=True)
class TrackedModes:
    """Branches of modes.

    Parameters
    ----------
    value : (p,) array
        Parameter, with the values that the refinement inserted.
    given : (p,) bool array
        The values that were asked for.
    eigenvalue : (p, m) complex array
        [1/s]; a branch is a column.
    shape : (p, n, m) complex array
        Mass-normalised; within a multiple eigenvalue turned to fit the neighbours.
    agreement : (p - 1, m) array
        MAC with mass weighting over each step; of multiple eigenvalues that with their space.
    unresolved : tuple of (float, float)
        Steps of the smallest size over which some branch still agrees less than asked.
    """

    value: np.ndarray
    given: np.ndarray
    eigenvalue: NDArray[np.complex128]
    shape: np.ndarray
    agreement: np.ndarray
    unresolved: tuple[tuple[float, float], ...]

    def __post_init__(self):
        freeze(self)

    @property
    def frequency(self) -> np.ndarray:
        """``|lambda| / 2 pi`` (p, m) [Hz]."""
        return np.abs(self.eigenvalue) / (2.0 * np.pi)

    @property
    def damping_ratio(self) -> np.ndarray:
        """``-Re lambda / |lambda|`` (p, m)."""
        size = np.abs(self.eigenvalue)
        return -self.eigenvalue.real / np.where(size > 0.0, size, 1.0)


@dataclass(frozen=True)
class CriticalSpeed:
    """Speed at which a line of excitation meets a natural frequency.

    ``order`` times the ``speed`` [rad/s] is the ``frequency`` [Hz] of the mode number ``branch``.
    """

    speed: float
    frequency: float
    branch: int
    order: float


@dataclass(frozen=True)
class CampbellData:
    """Modes over the speed.

    Parameters
    ----------
    tracked : TrackedModes
        Its parameter is the speed [rad/s].
    whirl : (p, m) array
        Sense of the orbits, see `modal.whirl`; zero without planes.
    orders : (k,) array
        Lines of excitation, ``order speed / 2 pi`` [Hz].
    critical : tuple of CriticalSpeed
        By speed.
    """

    tracked: TrackedModes
    whirl: np.ndarray
    orders: np.ndarray
    critical: tuple[CriticalSpeed, ...]

    @property
    def speed(self) -> np.ndarray:
        """Speeds (p,) [rad/s]."""
        return self.tracked.value

    @property
    def frequency(self) -> np.ndarray:
        """Natural frequencies (p, m) [Hz], those of free damped motion."""
        return self.tracked.eigenvalue.imag / (2.0 * np.pi)

    @property
    def damping_ratio(self) -> np.ndarray:
        """Damping ratios (p, m)."""
        return self.tracked.damping_ratio


def track_modes(
    family: Callable[[float], tuple[np.ndarray, np.ndarray]], values, mass, *, count: int | None = None
) -> TrackedModes:
    """Follow eigenvalues [1/s] and modes from one parameter value to the next.

    Each step assigns modes by ``1 - MAC`` and the distance to the extrapolated eigenvalue
    (`scipy.optimize.linear_sum_assignment`). A step is refined where a branch agrees less than asked, and
    where two branches change places without having been seen within 1e-6 of each other: a step that jumps
    over a veering looks like a crossing.

    Parameters
    ----------
    family : callable
        ``family(value)`` returns eigenvalues (m,) [1/s] and shapes (n, m), as many or more at every value.
    values : (k,) array
        Ascending or descending.
    mass : (n, n) array
        [kg, kg m^2]
    count : int, optional
        Lowest modes of the first value to follow; all when not given.

    Raises
    ------
    CaseError
        Values that do not ascend or descend (E-RANGE).
    ConvergenceError
        Fewer modes at a value than are followed (E-MODES).
    """
    values = np.asarray(values, float)
    steps = np.diff(np.ravel(values))
    monotonic = np.all(steps > 0) or np.all(steps < 0)
    if values.ndim != 1 or len(values) < 2 or not monotonic:
        raise CaseError("parameter values must ascend or descend", code="E-RANGE", limit="two or more")
    root = np.linalg.cholesky(np.asarray(mass, float)).T
    first = _solved(family, float(values[0]), root)
    order = np.argsort(np.abs(first.eigenvalue), kind="stable")[:count]
    points = [_Point(first.value, first.eigenvalue[order], first.vector[:, order])]
    agreements, unresolved = [], []
    for start, end in itertools.pairwise(values):
        smallest = 1.5 * abs(end - start) / 2.0**_MOST_HALVINGS
        pending = [_solved(family, float(end), root)]
        while pending:
            old = points[-1]
            new, fits = _assigned(old, pending[-1])
            between = _refined(old, new, fits)
            if between is not None and abs(new.value - old.value) > smallest:
                pending.append(_solved(family, between, root))
                continue
            if fits.min() < _AGREEMENT:
                unresolved.append((old.value, new.value))
            if len(points) == 1:
                points[0] = _turned(old, new)
            points.append(new)
            agreements.append(fits)
            pending.pop()
    value = np.array([point.value for point in points])
    return TrackedModes(
        value=value,
        given=np.isin(value, values),
        eigenvalue=np.array([point.eigenvalue for point in points]),
        # the vectors are weighted with the masses
        shape=np.linalg.solve(root, np.array([point.vector for point in points])),
        agreement=np.array(agreements),
        unresolved=tuple(unresolved),
    )


def oscillating(modes: ComplexModes) -> tuple[np.ndarray, np.ndarray]:
    """Take eigenvalues (m,) [1/s] and right vectors (n, m) of the modes with a frequency."""
    return modes.eigenvalue[modes.paired], modes.right[:, modes.paired]


def campbell_data(
    system_at: Callable[[float], MechanicalSystem],
    speeds,
    mesh_stiffness,
    *,
    orders=(),
    planes=None,
    count: int | None = None,
) -> CampbellData:
    """Follow the natural frequencies [Hz] over the speed [rad/s], and find the critical speeds.

    Parameters
    ----------
    system_at : callable
        The system at a speed [rad/s], of constant mass; ``lambda speed: system`` where only the gyroscopic
        term, which is multiplied by the speed here, depends on it.
    speeds : (k,) array
        [rad/s], ascending or descending.
    mesh_stiffness : (n_meshes,) array
        [N/m]
    orders : (k,) array
        Lines of excitation in multiples of the speed; the h-th harmonic of the meshes of a set with a fixed
        ring of z teeth is ``h z`` over the speed of the carrier.
    planes : (k, 2) int array, optional
        Rows of x and y of bodies, for the sense of whirl.
    count : int, optional
        Lowest modes to follow.

    Raises
    ------
    CaseError
        Fewer than two speeds, or speeds that do not ascend or descend (E-RANGE).

    Notes
    -----
    Critical speeds are roots of the monotone cubic interpolation (`scipy.interpolate.PchipInterpolator`) of
    each branch less the line: their error falls with the third power of the speed step.
    """
    speeds = np.asarray(speeds, float)
    if speeds.ndim != 1 or len(speeds) < 2 or not np.all(np.isfinite(speeds)):
        raise CaseError(
            f"a Campbell diagram over speeds of shape {speeds.shape}",
            code="E-RANGE",
            key="speeds",
            limit="two or more finite speeds [rad/s], ascending or descending",
            remedy="list the speeds at which the modes are wanted",
        )
    mass = np.asarray(system_at(float(speeds[0])).M)
    tracked = track_modes(
        lambda speed: oscillating(complex_modes(system_at(speed), mesh_stiffness, speed=speed)),
        speeds,
        mass,
        count=count,
    )
    senses = np.zeros(tracked.eigenvalue.shape)
    if planes is not None:
        senses = np.array([whirl(shape, np.diag(mass), planes) for shape in tracked.shape])
    orders = np.atleast_1d(np.asarray(orders, float))
    return CampbellData(tracked, senses, orders, _critical(tracked, orders))


@dataclass(frozen=True)
class _Point:
    """Modes at one ``value`` of the parameter.

    ``eigenvalue`` (m,) are those of the branches followed, ``vector`` (n, m) their unit vectors by the root of the
    mass matrix, ``slope`` (m,) their change per unit of the parameter since the point before, None at the first.
    """

    value: float
    eigenvalue: NDArray[np.complex128]
    vector: np.ndarray
    slope: np.ndarray | None = None


def _solved(family, value: float, root: np.ndarray) -> _Point:
    eigenvalue, shape = family(value)
    vector = root @ np.asarray(shape)
    return _Point(value, np.asarray(eigenvalue, complex), vector / np.linalg.norm(vector, axis=0))


def _assigned(old: _Point, new: _Point) -> tuple[_Point, np.ndarray]:
    """The new modes in the order of the old branches, and their agreement (m,)."""
    from scipy.optimize import linear_sum_assignment

    m, value = len(old.eigenvalue), new.eigenvalue
    if len(value) < m:
        raise ConvergenceError(
            f"{m} modes are followed, {len(value)} are there at {new.value:.6g}",
            code="E-MODES",
            remedy="end before it, or follow fewer modes: one became rigid, overdamped or unstable",
        )
    plain = np.abs(old.vector.conj().T @ new.vector) ** 2
    space = _space_agreement(old, new)
    ahead = old.eigenvalue if old.slope is None else old.eigenvalue + old.slope * (new.value - old.value)
    distance = np.abs(value[None, :] - ahead[:, None]) / np.maximum(np.abs(ahead), 1e-300)[:, None]
    cost = 1.0 - space + 0.1 * (1.0 - plain) + np.minimum(_CONTINUITY * distance, _BOUND)
    _, place = linear_sum_assignment(cost)
    vector = _matched(old.vector, new.vector[:, place], value[place])
    slope = (value[place] - old.eigenvalue) / (new.value - old.value)
    return _Point(new.value, value[place], vector, slope), space[np.arange(m), place]


def _space_agreement(old: _Point, new: _Point) -> np.ndarray:
    """MAC (m, m') in which multiple eigenvalues count with the space of their vectors."""
    fits = np.abs(old.vector.conj().T @ new.vector) ** 2
    for group in _groups(old.eigenvalue):
        basis = np.linalg.qr(old.vector[:, group])[0]
        fits[group] = (np.abs(basis.conj().T @ new.vector) ** 2).sum(axis=0)
    for group in _groups(new.eigenvalue):
        basis = np.linalg.qr(new.vector[:, group])[0]
        fits[:, group] = (np.abs(basis.conj().T @ old.vector) ** 2).sum(axis=0)[:, None]
    return fits


def _groups(eigenvalue: np.ndarray) -> list[np.ndarray]:
    """Members of every multiple eigenvalue."""
    order = np.argsort(np.abs(eigenvalue), kind="stable")
    close = np.abs(np.diff(eigenvalue[order])) <= _MULTIPLE * np.abs(eigenvalue[order][1:])
    groups = np.split(order, np.flatnonzero(~close) + 1)
    return [group for group in groups if len(group) > 1]


def _matched(old: np.ndarray, new: np.ndarray, eigenvalue: np.ndarray) -> np.ndarray:
    """New vectors with the phase of the old ones; vectors of a multiple eigenvalue turned onto them."""
    new = new.astype(complex)
    for group in _groups(eigenvalue):
        basis = np.linalg.qr(new[:, group])[0]
        new[:, group] = basis @ polar(basis.conj().T @ old[:, group])[0]
    overlap = np.einsum("im,im->m", new.conj(), old)
    size = np.abs(overlap)
    return new * np.where(size > 1e-8, overlap / np.where(size > 0.0, size, 1.0), 1.0)


def _turned(first: _Point, second: _Point) -> _Point:
    """The first point with the vectors of multiple eigenvalues turned onto those of the second."""
    vector = first.vector.astype(complex)
    for group in _groups(first.eigenvalue):
        vector[:, group] = _matched(second.vector[:, group], vector[:, group], first.eigenvalue[group])
    return _Point(first.value, first.eigenvalue, vector, second.slope)


def _refined(old: _Point, new: _Point, fits: np.ndarray) -> float | None:
    """A value between two points at which to look first, or None where the step is good."""
    a, b = old.eigenvalue.imag, new.eigenvalue.imag
    before, after = a[:, None] - a, b[:, None] - b
    near = _CROSSING * np.maximum(np.abs(a), np.abs(b))
    passes = (before * after < 0.0) & (np.minimum(np.abs(before), np.abs(after)) > near[:, None])
    step = new.value - old.value
    if np.any(passes):
        i, j = np.argwhere(passes)[0]
        share = before[i, j] / (before[i, j] - after[i, j])
        # an end that is hit exactly would repeat a point
        return float(old.value + step * min(max(share, 0.02), 0.98))
    return float(old.value + 0.5 * step) if fits.min() < _AGREEMENT else None


def _critical(tracked: TrackedModes, orders) -> tuple[CriticalSpeed, ...]:
    from scipy.interpolate import PchipInterpolator

    rising = np.argsort(tracked.value)
    speed, angular = tracked.value[rising], tracked.eigenvalue.imag[rising]
    speeds = []
    apart = 1e-9 * np.ptp(speed)
    for order in orders:
        curves = PchipInterpolator(speed, angular - order * speed[:, None])
        for branch, roots in enumerate(map(np.sort, curves.roots(extrapolate=False))):
            # a root at a knot is found from both sides
            for s in roots[np.append(True, np.diff(roots) > apart)[: len(roots)]]:
                speeds.append(CriticalSpeed(float(s), float(order * s / (2 * np.pi)), branch, float(order)))
    return tuple(sorted(speeds, key=lambda critical: critical.speed))
