"""Forces of the elements at known instants: what depends on time alone is tabulated once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from femgear.solvers.elements import Element, GearMeshes, PolynomialSprings
from femgear.solvers.nonlinear import NonlinearSystem

Law = Callable[[int, np.ndarray], tuple[np.ndarray, np.ndarray]]


def tabulated_law(problem: NonlinearSystem, theta) -> Law:
    """A function of instant number and deflections: forces and tangents beyond the reference stiffness.

    Parameters
    ----------
    problem : NonlinearSystem
    theta : (n_times, n_bases) array
        Phases of the instants [rad].

    Returns
    -------
    callable
        ``law(i, x (n_columns,)) -> (f - c x (n_columns,), df/dx - c)`` with ``c`` the
        reference of the problem; the second is (n_columns,) where every element acts on single
        columns, else (n_columns, n_columns).
    """
    theta, reference = np.asarray(theta, float), problem.reference
    every = np.arange(len(reference))
    parts = [(element.columns, _single(element, theta)) for element in problem.elements]
    if not parts:
        nothing = np.zeros(len(reference))
        return lambda i, x: (nothing, nothing)
    if any(columns.shape[1] > 1 for columns, _ in parts):
        return _coupled(problem, theta)
    if len(parts) == 1 and np.array_equal(parts[0][0][:, 0], every):
        only = parts[0][1]

        def whole(i, x):
            force, slope = only(i, x)
            return force - reference * x, slope - reference

        return whole
    indices = [columns[:, 0] for columns, _ in parts]

    def summed(i, x):
        total, tangent = -reference * x, -reference
        for columns, (_, part) in zip(indices, parts):
            force, slope = part(i, x[columns])
            np.add.at(total, columns, force)
            np.add.at(tangent, columns, slope)
        return total, tangent

    return summed


def _single(element: Element, theta) -> Law:
    """Forces (g,) and slopes (g,) of an element on single columns."""
    if type(element) is GearMeshes:
        return _meshes(element, theta)
    if type(element) is PolynomialSprings:
        return _polynomial(element)

    def general(i, x):
        force, slope = element.evaluate(x[:, None], theta[i])
        return force[:, 0], slope[:, 0, 0]

    return general


def _polynomial(element: PolynomialSprings) -> Law:
    """``PolynomialSprings.evaluate`` with the coefficients of force and slope ready for Horner's rule."""
    force_terms = list(element.coefficients.T[::-1])
    slope_terms = [c * (len(force_terms) - d) for d, c in enumerate(force_terms)]

    def law(i, x):
        force, slope = force_terms[0], slope_terms[0]
        for f, s in zip(force_terms[1:], slope_terms[1:]):
            force, slope = force * x + f, slope * x + s
        return force * x, slope

    return law


def _meshes(element: GearMeshes, theta) -> Law:
    """``GearMeshes.evaluate`` with its series tabulated."""
    k = np.array(element.stiffness.at(theta))
    offset = element.force.at(theta) - k * element.deflection.at(theta)
    if not element.separates:
        return lambda i, x: (offset[i] + k[i] * x, k[i])
    has_back = np.isfinite(element.backlash)
    play = k * np.where(has_back, element.backlash, 0.0)
    play[:, ~has_back] = np.inf
    if element.smoothing:
        return _smooth_meshes(k, offset, play, element.smoothing)
    if not np.any(has_back):

        def drive(i, x):
            stiffness = k[i]
            line = offset[i] + stiffness * x
            closed = line > 0.0
            return line * closed, stiffness * closed

        return drive

    def both(i, x):
        stiffness = k[i]
        line = offset[i] + stiffness * x
        behind = line + play[i]
        drive, back = line > 0.0, behind < 0.0
        return np.maximum(line, 0.0) + np.minimum(behind, 0.0), stiffness * (drive | back)

    return both


def _smooth_meshes(k, offset, play, smoothing) -> Law:
    length = smoothing * k
    square = length * length
    finite = np.isfinite(play[0])
    gap = np.where(finite, play, 0.0)

    def smooth(i, x):
        line = offset[i] + k[i] * x
        root = np.sqrt(line * line + square[i])
        force, slope = 0.5 * (line + root), 0.5 * (1.0 + line / root)
        behind = np.where(finite, -line - gap[i], 0.0)
        root = np.sqrt(behind * behind + square[i])
        back, back_slope = 0.5 * (behind + root), 0.5 * (1.0 + behind / root)
        return force - finite * back, k[i] * (slope + finite * back_slope)

    return smooth


def _coupled(problem: NonlinearSystem, theta) -> Law:
    """Elements on groups of columns, evaluated as they are."""
    reference = np.diag(problem.reference)

    def law(i, x):
        total, tangent = -reference @ x, -reference
        for element in problem.elements:
            force, slope = element.evaluate(x[element.columns], theta[i])
            for columns, f, t in zip(element.columns, force, slope):
                total[columns] += f
                tangent[columns[:, None], columns] += t
        return total, tangent

    return law
