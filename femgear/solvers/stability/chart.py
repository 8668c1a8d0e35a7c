"""Charts of parametric stability over frequency and depth of a periodic stiffness, and their boundaries."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError, ConvergenceError, checked_numbers, checked_tolerance
from femgear.solvers.periodic.solution import CIRCLE, loss_of
from femgear.solvers.stability.floquet import Frame, frame_of, frame_of_modes, passage
from femgear.system.elements import tangent_jumps
from femgear.system.fourier import FourierSeries, StepSeries, series_of
from femgear.system.system import MeshExcitation, Modes, NonlinearSystem

# Cells of a chart treated together.
_BATCH = 64


@dataclass(frozen=True)
class StabilityChart:
    """Largest Floquet multipliers over frequency and depth.

    Parameters
    ----------
    frequency : (n_f,) array
        Base frequency of the stiffness [rad/s].
    depth : (n_d,) array
        Factor of the fluctuation about the mean.
    multiplier : (n_f, n_d) complex array
        Multiplier of largest modulus over one period.
    loss : (n_f, n_d) str array
        ``""`` where stable, otherwise ``"fold"``, ``"flip"`` or ``"Neimark-Sacker"`` (combination resonance).
    error : (n_f, n_d) array
        Estimated relative error of the monodromy matrices.
    """

    frequency: np.ndarray
    depth: np.ndarray
    multiplier: np.ndarray
    loss: np.ndarray
    error: np.ndarray

    @property
    def stable(self) -> np.ndarray:
        """(n_f, n_d) bool: no perturbation grows (modulus at most 1 within 1e-6)."""
        return np.abs(self.multiplier) <= 1.0 + CIRCLE


def stability_chart(
    system: Modes | NonlinearSystem,
    stiffness: FourierSeries | StepSeries | MeshExcitation,
    frequency,
    depth,
    *,
    harmonics: int = 6,
    tolerance: float = 1e-8,
) -> StabilityChart:
    """Stability of ``M q'' + C q' + K q + W (mean + depth (k(t) - mean)) W^T q = 0`` on a grid.

    Parameters
    ----------
    system : Modes or NonlinearSystem
        Of the latter the linear part; the stiffness stands for its elements.
    stiffness : FourierSeries, StepSeries or MeshExcitation
        ``k`` of every column [N/m]. Of an excitation the stiffness, cut to ``harmonics`` mesh harmonics; its
        base frequency is the mesh frequency over ``periods``.
    frequency : (n_f,) array
        Base frequencies [rad/s], positive.
    depth : (n_d,) array
        Factors of the fluctuation, 1 for the stiffness as given.
    harmonics : int
    tolerance : float
        Relative error of the monodromy matrices.

    Raises
    ------
    CaseError
        Frequencies that are not positive, a stiffness that does not fit the columns.
    ConvergenceError
        Modes left out of a modal basis are too flexible.
    """
    tolerance = checked_tolerance(tolerance)
    frequency = np.atleast_1d(checked_numbers(frequency, "frequency", code="E-FREQUENCY", unit="rad/s"))
    depth = np.atleast_1d(checked_numbers(depth, "depth", code="E-CHART", unit=""))
    frame, series, breaks = _prepared(system, stiffness, harmonics)
    f, d = (grid.ravel() for grid in np.meshgrid(frequency, depth, indexing="ij"))
    multiplier, error = _largest(frame, series, breaks, f, d, tolerance)
    shape = (len(frequency), len(depth))
    loss = [loss_of(value) if abs(value) > 1.0 + CIRCLE else "" for value in multiplier]
    return StabilityChart(
        frequency, depth, multiplier.reshape(shape), np.array(loss).reshape(shape), error.reshape(shape)
    )


def stability_boundary(
    system: Modes | NonlinearSystem,
    stiffness: FourierSeries | StepSeries | MeshExcitation,
    between: tuple[float, float],
    *,
    frequency: float | None = None,
    depth: float | None = None,
    harmonics: int = 6,
    tolerance: float = 1e-11,
) -> float:
    """Where the stability changes along a line of the chart.

    The root of ``log |multiplier|``. Without damping the stable side has the modulus one throughout, so there
    the line is halved to 1e-13 of its end; next to the boundary the modulus leaves one like a square root.

    Parameters
    ----------
    system, stiffness, harmonics, tolerance
        As for :func:`stability_chart`.
    between : (a, b)
        Frequencies [rad/s], or depths, one stable and the other not.
    frequency, depth : float
        The one that is held; the other one varies.

    Raises
    ------
    CaseError
        Not exactly one of frequency and depth, or no change between the two ends.
    """
    from scipy.optimize import brentq

    if (frequency is None) == (depth is None):
        raise CaseError("hold the frequency or the depth", code="E-CHART", limit="exactly one of the two")
    tolerance = checked_tolerance(tolerance)
    frame, series, breaks = _prepared(system, stiffness, harmonics)

    def growth(value: float) -> float:
        f, d = (value, depth) if frequency is None else (frequency, value)
        largest, _ = _largest(frame, series, breaks, np.array([f]), np.array([d]), tolerance)
        return float(np.log(np.abs(largest[0])))

    ends = np.array([growth(value) for value in between])
    if np.count_nonzero(ends > CIRCLE) != 1:
        raise CaseError(
            f"largest multipliers {np.exp(ends).tolist()} at {list(between)}", code="E-CHART", key="between",
            limit="one end stable, the other one not",
        )  # fmt: skip
    if ends.min() < -CIRCLE:
        return float(brentq(growth, *between, xtol=1e-14, rtol=1e-13))
    low, high = between
    unstable_low = ends[0] > CIRCLE
    while abs(high - low) > 1e-13 * abs(high):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if (growth(middle) > CIRCLE) == unstable_low else (low, middle)
    return 0.5 * (low + high)


def _prepared(system, stiffness, harmonics: int) -> tuple[Frame, FourierSeries | StepSeries, np.ndarray]:
    """Modes, the stiffness as a series, and the fractions of the period at which it jumps."""
    frame = frame_of_modes(system) if isinstance(system, Modes) else frame_of(system)
    if isinstance(stiffness, MeshExcitation):
        stiffness = series_of(stiffness.stiffness, harmonics * stiffness.periods)
    if len(stiffness.mean) != len(frame.rows):
        raise CaseError(
            f"stiffness of {len(stiffness.mean)} meshes for {len(frame.rows)} columns", code="E-SHAPE",
            limit="one series a column",
        )  # fmt: skip
    breaks = np.zeros(0)
    if isinstance(stiffness, StepSeries):
        fluctuation, eye = _fluctuation(stiffness), np.eye(len(frame.rows))
        breaks = tangent_jumps(lambda f, states: fluctuation(f)[..., None] * eye, np.arange(1))[0]
    return frame, stiffness, breaks


def _largest(
    frame: Frame, series, breaks, frequency, depth, tolerance: float
) -> tuple[np.ndarray, np.ndarray]:
    """Multiplier of largest modulus and error (p,) of pairs of frequency and depth."""
    if not np.all(np.isfinite(depth)) or not np.all(np.isfinite(frequency)) or np.any(frequency <= 0.0):
        raise CaseError(
            "a chart needs positive frequencies and finite depths", code="E-FREQUENCY", limit="> 0 rad/s"
        )
    eye, mean, fluctuation = np.eye(len(frame.rows)), series.mean, _fluctuation(series)
    multiplier, error = np.empty(len(frequency), complex), np.zeros(len(frequency))
    # cells of similar period take similar steps
    order = np.argsort(frequency, kind="stable")
    for part in np.array_split(order, -(-len(order) // _BATCH)):

        def tangents(f, states, part=part):
            k = mean + depth[part[states], None, None] * fluctuation(f)
            return k[..., None] * eye

        period = 2.0 * np.pi / frequency[part]
        if isinstance(series, StepSeries):
            matrix = _exponentials(frame, period, tangents, breaks)
        else:
            found = passage(frame, period, tangents, [breaks] * len(part), tolerance=tolerance)
            matrix, error[part] = found.matrix, found.error
        values = np.linalg.eigvals(matrix)
        multiplier[part] = values[np.arange(len(part)), np.abs(values).argmax(axis=1)]
    if np.any(error > 1e3 * tolerance):
        raise ConvergenceError(
            f"the monodromy matrix has an error of {error.max():.1e}, aimed at {tolerance:.1e}",
            code="E-MONODROMY", remedy="take a looser tolerance or fewer harmonics",
        )  # fmt: skip
    return multiplier, error


def _exponentials(frame: Frame, period, tangents, breaks) -> np.ndarray:
    """Monodromy matrices (p, 2 n, 2 n) of tangents that are constant between the breaks, exactly."""
    from scipy.linalg import expm

    ends = np.concatenate([[0.0], breaks, [1.0]])
    middle = np.broadcast_to(0.5 * (ends[1:] + ends[:-1]), (len(period), len(ends) - 1))
    matrices = frame.state_matrices(frame.kappa(tangents(middle, np.arange(len(period)))))
    n, unit = len(frame.square), frame.fastest or 1.0
    both = np.concatenate([np.ones(n), np.full(n, unit)])
    steps = expm(matrices * (both / both[:, None]) * (period[:, None] * np.diff(ends))[..., None, None])
    out = steps[:, 0]
    for piece in range(1, steps.shape[1]):
        out = steps[:, piece] @ out
    return out


def _fluctuation(series):
    """Function: fluctuation (..., n_c) of the stiffness about its mean at fractions (...) of the period."""
    return lambda fraction: series.at(2.0 * np.pi * np.asarray(fraction)[..., None]) - series.mean
