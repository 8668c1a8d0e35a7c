"""Periodic and quasi-periodic solutions as lines of a spectrum, and the verdict on their stability.

The verdict has the Floquet multipliers, whether the solution is stable, and how stability is lost.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

# Multipliers beyond the unit circle by less than this are taken as on it (undamped systems).
CIRCLE = 1e-6
# A multiplier is real when its imaginary part is smaller than this share of it.
_REAL = 1e-7
# Distance of a real multiplier from one that integration cannot tell.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class PeriodicSolution:
    """``x(t) = Re sum_l X_l exp(i (orders_l . omega) t)`` for the deflections of the elements.

    Parameters
    ----------
    frequency : (n_bases,) array
        Base frequencies ``omega`` [rad/s].
    orders : (L, n_bases) int array
        Line 0 is the mean; of a line and its mirror image only one is there.
    deflection : (n_columns, L) complex array
        ``W^T q`` [m].
    force : (n_columns, L) complex array
        Forces of the elements [N].
    converged : bool
        Whether the residual is within the tolerance asked for.
    residual : float
        Largest violation of the harmonic equations relative to the largest deflection, of which a mean that
        runs away counts up to a million times the static one; one where nothing carries the mean load.
    iterations : int
        Newton iterations; of the points of a curve those of its correction.
    factorisations : int
        Matrices factorised on the way.
    tail : float
        Share of the fluctuating amplitude in the upper half of the lines: a measure of truncation; zero
        where nothing fluctuates.
    message : str
        What happened and, where it did not converge, what to do.
    history : tuple of float
        Relative residual at every iteration.
    spectral_radius : float
        Of the fixed point ``X <- T_load S - T (F - reference X)`` at the solution: below one the plain
        iteration converges. It says nothing on stability. NaN where it was not asked for or where there is
        no such iteration; the message says why.
    verdict : FloquetVerdict
        Whether disturbances grow; its message says "not asked for", "not covered" or "not determined" where
        ``stable`` is None.
    """

    frequency: np.ndarray
    orders: np.ndarray
    deflection: np.ndarray
    force: np.ndarray
    converged: bool
    residual: float
    iterations: int
    factorisations: int
    tail: float
    message: str
    history: tuple[float, ...] = field(default=())
    spectral_radius: float = np.nan
    verdict: FloquetVerdict = field(default_factory=lambda: open_verdict("not asked for"))

    def __post_init__(self):
        kinds = {"frequency": float, "orders": int, "deflection": complex, "force": complex}
        for name, kind in kinds.items():
            array = np.array(getattr(self, name), kind)
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @property
    def stable(self) -> bool | None:
        """Whether no disturbance grows; None where the verdict is open."""
        return self.verdict.stable

    @property
    def line_frequency(self) -> np.ndarray:
        """Angular frequency of every line, (L,) [rad/s]."""
        return self.orders @ self.frequency

    def at(self, time) -> np.ndarray:
        """Compute the deflections (..., n_columns) [m] at the instants ``time`` (...) [s]."""
        wave = np.exp(1j * np.asarray(time, float)[..., None] * self.line_frequency)
        return np.real(wave @ self.deflection.T)


@dataclass(frozen=True)
class FloquetVerdict:
    """Whether a periodic solution is stable.

    Parameters
    ----------
    multipliers : (m,) complex array
        Of one period of the base frequency, largest modulus first; empty where there is no verdict.
    exponents : (m,) complex array
        ``log(multiplier) / period`` [1/s].
    stable : bool or None
        None where the method does not cover the solution, its period is too long for the fastest mode, the
        error leaves the question open, or the largest multiplier is +1 or -1 to 1e-6: on the border, where
        the linear equations do not decide. Complex pairs on the circle (no damping) do not grow: stable.
    loss : str
        ``""`` when stable; how the largest multiplier leaves the unit circle: ``"fold"`` (through +1: limit
        point, pitchfork, transcritical), ``"flip"`` (through -1) or ``"Neimark-Sacker"`` (complex pair).
    method : str
        ``"exact exponentials"``, ``"splitting"``, ``"shooting"`` or ``""``.
    message : str
        How the verdict was reached, or why there is none.
    error : float
        Estimated relative error of the monodromy matrix.
    """

    multipliers: np.ndarray
    exponents: np.ndarray
    stable: bool | None
    loss: str
    method: str
    message: str
    error: float = 0.0


def of_solution(name: str, text: str) -> property:
    """Make a property of a result that its ``solution`` has, with its text."""
    return property(lambda result: getattr(result.solution, name), doc=text)


def open_verdict(reason: str) -> FloquetVerdict:
    """Make the verdict that stays open for a reason."""
    return FloquetVerdict(np.zeros(0, complex), np.zeros(0, complex), None, "", "", reason, np.nan)


def verdict_of(
    multipliers,
    period: float,
    method: str,
    error: float,
    tolerance: float,
    *,
    positions: int = 0,
    velocities: int = 0,
    drift=(),
) -> FloquetVerdict:
    """Judge stability by the multipliers of one period.

    Parameters
    ----------
    multipliers : (m,) complex array
        Eigenvalues of the monodromy matrix.
    period : float
        [s].
    error, tolerance : float
        Estimated and allowed relative error of the monodromy matrix.
    positions : int
        Free positions among the multipliers: as many as are one, the nearest to it are left out.
    velocities : int
        Velocities of free motions among the multipliers: a slow decay of theirs is not the border.
    drift : (r,) array
        Rates [1/s] at which the velocities of free motions decay, or grow where they are negative; their
        multipliers ``exp(-rate period)`` are added.
    """
    multipliers = np.asarray(multipliers, complex)
    multipliers = multipliers[np.argsort(np.abs(multipliers - 1.0), kind="stable")[positions:]]
    border = _on_border(multipliers, velocities)
    with np.errstate(over="ignore"):
        decay = np.exp(-np.asarray(drift, float) * period)
    multipliers = np.concatenate([multipliers, decay])
    size = np.abs(multipliers)
    # of a complex pair the one with positive imaginary part first, whatever rounding does to the moduli
    rounded = np.round(size / max(size.max(initial=0.0), 1e-300), 9)
    multipliers = multipliers[np.lexsort((-np.imag(multipliers), -rounded))]
    largest = float(np.abs(multipliers[0])) if len(multipliers) else 0.0
    with np.errstate(divide="ignore"):
        exponents = np.log(multipliers) / period
    stable: bool | None = largest <= 1.0 + CIRCLE
    message = f"largest multiplier {largest:.6g}"
    if error > tolerance and abs(largest - 1.0) <= max(10.0 * error, CIRCLE):
        stable = None
        message += f", undecided: error of the monodromy matrix {error:.1e}, aimed at {tolerance:.1e}"
    if stable and border is not None:
        stable = None
        message += f", on the border: the multiplier {border.real:+.6g} is on the unit circle to {CIRCLE:.0e}"
    loss = "" if stable is not False else loss_of(multipliers[0])
    outside = int(np.sum(np.abs(multipliers) > 1.0 + CIRCLE))
    if loss:
        message += f" ({loss}); {outside} outside the unit circle"
    return FloquetVerdict(multipliers, exponents, stable, loss, method, message, error)


def loss_of(multiplier: complex) -> str:
    """Tell how a multiplier outside the unit circle left it: "fold", "flip" or "Neimark-Sacker"."""
    if abs(multiplier.imag) > _REAL * abs(multiplier):
        return "Neimark-Sacker"
    return "fold" if multiplier.real > 0.0 else "flip"


def _on_border(multipliers: np.ndarray, velocities: int) -> complex | None:
    """A multiplier that is +1 or -1 to the accuracy of the unit circle, if there is one.

    Multipliers are sorted by their distance from one; of free motions with damping the velocities are among
    the first, inside the circle by more than rounding.
    """
    near = np.minimum(np.abs(multipliers - 1.0), np.abs(multipliers + 1.0)) <= CIRCLE
    slow = np.flatnonzero(near & (np.abs(multipliers) < 1.0 - _ROUNDING) & (np.real(multipliers) > 0.0))
    near[slow[:velocities]] = False
    return multipliers[np.argmax(near)] if np.any(near) else None
