"""Periodic and quasi-periodic solutions as lines of a spectrum."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from femgear.solvers.verdict import FloquetVerdict, open_verdict


def _not_asked() -> FloquetVerdict:
    return open_verdict("not asked for")


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
    residual : float
        Largest violation of the harmonic equations relative to the largest deflection, of which a mean that
        runs away counts up to a million times the static one; one where nothing carries the mean load.
    iterations : int
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
    verdict: FloquetVerdict = field(default_factory=_not_asked)

    def __post_init__(self):
        for name, kind in (
            ("frequency", float),
            ("orders", int),
            ("deflection", complex),
            ("force", complex),
        ):
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
        """Deflections (..., n_columns) at the instants ``time`` (...) [s]."""
        wave = np.exp(1j * np.asarray(time, float)[..., None] * self.line_frequency)
        return (wave @ self.deflection.T).real
