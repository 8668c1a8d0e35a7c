"""Period error and numerical damping of step rules, from the eigenvalues of a step.

K. J. Bathe, Finite Element Procedures, 2nd ed., section 9.4; T. J. R. Hughes, The Finite Element Method
(2000), section 9.1.
"""

from __future__ import annotations

import numpy as np

from femgear.solvers.time.steps import StepRule


def period_error(rule: StepRule, ratio) -> np.ndarray:
    """Relative error of the period of an undamped mode stepped with ``h / T = ratio``, below the limit."""
    ratio = np.asarray(ratio, float)
    return 2.0 * np.pi * ratio / np.abs(np.angle(_principal(rule, ratio))) - 1.0


def numerical_damping(rule: StepRule, ratio) -> np.ndarray:
    """``-ln |z| / arg z`` of an undamped mode stepped with ``h / T = ratio``."""
    value = _principal(rule, np.asarray(ratio, float))
    return -np.log(np.abs(value)) / np.abs(np.angle(value))


def _principal(rule: StepRule, ratio) -> np.ndarray:
    """Complex eigenvalue of the amplification matrix of ``a + w^2 q = 0`` in (q, h v, h^2 a)."""
    square = (2.0 * np.pi * np.atleast_1d(ratio)) ** 2
    predict, mix = rule.predictor(1.0)[:3], rule.predictor(1.0)[3:]
    inertia = 1.0 - rule.mass + (1.0 - rule.force) * rule.beta * square
    taken = -(mix[2] + square[:, None] * mix[0]) / inertia[:, None]
    matrix = predict + np.array([rule.beta, rule.gamma, 1.0])[:, None] * taken[:, None, :]
    values = np.linalg.eigvals(matrix)
    best = np.argmax(np.where(np.abs(values.imag) > 1e-12, np.abs(values), -1.0), axis=1)
    chosen = values[np.arange(len(values)), best]
    return chosen.reshape(np.shape(ratio))
