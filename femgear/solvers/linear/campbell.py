"""Campbell diagram: natural frequencies over the speed, and where lines of excitation meet them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError
from femgear.solvers.linear.modal import complex_modes, whirl
from femgear.solvers.linear.tracking import TrackedModes, oscillating, track_modes
from femgear.system.system import MechanicalSystem


@dataclass(frozen=True)
class CriticalSpeed:
    """A line of excitation at a natural frequency.

    Parameters
    ----------
    speed : float
        [rad/s]
    frequency : float
        [Hz]
    branch : int
    order : float
        Of the line, in multiples of the speed.
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
        """(p,) [rad/s]."""
        return self.tracked.value

    @property
    def frequency(self) -> np.ndarray:
        """(p, m) [Hz], those of free damped motion."""
        return self.tracked.eigenvalue.imag / (2.0 * np.pi)

    @property
    def damping_ratio(self) -> np.ndarray:
        """(p, m)."""
        return self.tracked.damping_ratio


def campbell_data(
    system_at: Callable[[float], MechanicalSystem],
    speeds,
    mesh_stiffness,
    *,
    orders=(),
    planes=None,
    count: int | None = None,
) -> CampbellData:
    """Natural frequencies over the speed, followed as branches, with their critical speeds.

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
        Fewer than two speeds, or speeds that do not ascend or descend (E-VALUES).

    Notes
    -----
    Critical speeds are roots of the monotone cubic interpolation (`scipy.interpolate.PchipInterpolator`) of
    each branch less the line: their error falls with the third power of the speed step.
    """
    speeds = np.asarray(speeds, float)
    if speeds.ndim != 1 or len(speeds) < 2 or not np.all(np.isfinite(speeds)):
        raise CaseError(
            f"a Campbell diagram over speeds of shape {speeds.shape}", code="E-VALUES", key="speeds",
            limit="two or more finite speeds [rad/s], ascending or descending",
            remedy="list the speeds at which the modes are wanted",
        )  # fmt: skip
    mass = np.asarray(system_at(float(speeds[0])).M)
    tracked = track_modes(
        lambda speed: oscillating(complex_modes(system_at(speed), mesh_stiffness, speed=speed)),
        speeds, mass, count=count,
    )  # fmt: skip
    senses = np.zeros(tracked.eigenvalue.shape)
    if planes is not None:
        senses = np.array([whirl(shape, np.diag(mass), planes) for shape in tracked.shape])
    orders = np.atleast_1d(np.asarray(orders, float))
    return CampbellData(tracked, senses, orders, _critical(tracked, orders))


def _critical(tracked: TrackedModes, orders) -> tuple[CriticalSpeed, ...]:
    from scipy.interpolate import PchipInterpolator

    rising = np.argsort(tracked.value)
    speed, angular = tracked.value[rising], tracked.eigenvalue.imag[rising]
    found = []
    apart = 1e-9 * np.ptp(speed)
    for order in orders:
        for branch, one in enumerate(angular.T):
            roots = np.sort(PchipInterpolator(speed, one - order * speed).roots(extrapolate=False))
            # a root at a knot is found from both sides
            for s in roots[np.append(True, np.diff(roots) > apart)[: len(roots)]]:
                found.append(CriticalSpeed(float(s), float(order * s / (2 * np.pi)), branch, float(order)))
    return tuple(sorted(found, key=lambda one: one.speed))
