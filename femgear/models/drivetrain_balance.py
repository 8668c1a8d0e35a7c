"""Settled motion of a drivetrain whose meshes keep contact: linear harmonic balance over several bases.

With the stiffness of the simple motions ``G(theta) = S k S^T = mean + rest`` and their receptance F with
the mean stiffness, the lines of the motion obey ``x + F(i omega) (rest * x) = x_static`` with * the
convolution over the lattice of orders. The system is linear and there are no samples in time, of which four
bases would need millions. Lines that are given are solved for so; where lines are searched, the unknowns are
the mesh forces (`femgear.models.drivetrain_force_lines`), which need fewer.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from femgear.errors import CaseError, ConvergenceError
from femgear.models.drivetrain import DrivetrainModel, torque_vector
from femgear.models.drivetrain_checks import check_free_spin
from femgear.models.drivetrain_coupling import LineProblem, line_problem
from femgear.models.drivetrain_force_lines import ForceEquations, force_equations
from femgear.models.drivetrain_line_solver import line_equations
from femgear.models.drivetrain_refinement import Estimate, estimate, refined, strong_lines, with_feedback
from femgear.solvers.lines import checked_lines, distinct_lines
from femgear.solvers.series import FourierSeries

# Estimated error of the forces, and lines at most.
TOLERANCE, MAX_LINES = 1e-2, 20_000
_FINEST = 1e-6
# A torque that drives the spin, relative to the largest: no settled motion.
_UNBALANCED = 1e-9
# Residual of the equations on given lines; while lines are searched and at the end, over the tolerance.
_GIVEN, _SEARCH, _FOUND = 1e-11, 1.0, 0.2
# Residuals above which there is no solution, and no converged one, over the one that was asked for.
_LOST, _ENOUGH = 10.0, 1.5
# First harmonics that the search starts with, and its longest way.
_START, _ROUNDS = 3, 25
# Feedback that is accepted, over the tolerance: an upper estimate, two or three times what is found.
_FEEDBACK = 3.0
# Smaller target of the search where the feedback of what is left out is too large, or the remainder goes
# down by less than this in a round.
_CLOSER, _SLOW = 0.6, 0.5
# Alternating force that the search begins with, over the mean.
_GUESS = 1e-2
# Values of waves at once.
_VALUES = 4_000_000


@dataclass(frozen=True)
class SettledMotion:
    """Lines of the simple motions, ``x(t) = Re sum_l X_l exp(i orders_l . theta)``.

    Parameters
    ----------
    model : DrivetrainModel
    orders : (L, n_bases) int array
        Line 0 is the mean.
    frequency : (n_bases,) array
        [rad/s]
    motion : (m, L) complex array
    displacement : (n, L) complex array
        Of all coordinates, the spin's deviation of the mean being zero.
    force : (n_meshes, L) complex array or None
        Of the meshes [N], where lines are searched; approaches follow from them and have more lines.
    residual : float
        Of the linear equations, relative to the static motion where lines are given (units of energy), to
        the alternating forces of the meshes where they are searched.
    remainder : (n_meshes,) array
        Estimated r.m.s. force of all lines left out over that of the alternating force of the mesh, of
        first order.
    feedback : (n_meshes,) array
        Estimate of what these do to the lines kept, likewise: large near the border of an unstable
        parametric resonance. Mostly two to three times
        too large.
    converged : bool
        Whether the remainder of every mesh is within the tolerance and its feedback within three times this.
    rounds : int
        Solutions until the lines were found, one for given lines.
    message : str
    """

    model: DrivetrainModel
    orders: np.ndarray
    frequency: np.ndarray
    motion: np.ndarray
    displacement: np.ndarray
    force: np.ndarray | None
    residual: float
    remainder: np.ndarray
    feedback: np.ndarray
    converged: bool
    rounds: int
    message: str

    @property
    def line_frequency(self) -> np.ndarray:
        """(L,) [rad/s], negative where a side band lies beyond zero."""
        return self.orders @ self.frequency

    def at(self, times) -> tuple[np.ndarray, np.ndarray]:
        """Approach [m] and force [N] of the meshes (n_times, n_meshes)."""
        times, geometry, model = np.asarray(times, float), self.model.geometry, self.model
        theta, omega = times[:, None] * self.frequency, self.line_frequency
        lines = self.motion if self.force is None else self.force
        values = np.empty((len(times), len(lines)))
        block = max(1, _VALUES // len(omega))
        for first in range(0, len(times), block):
            waves = np.exp(1j * np.multiply.outer(times[first : first + block], omega))
            values[first : first + block] = (waves @ lines.T).real
        series = FourierSeries(model.stiffness)
        k = np.empty((len(times), len(model.meshes)))
        for base in np.unique(model.mesh_base):
            own = model.mesh_base == base
            k[:, own] = series.at(theta[:, base : base + 1])[:, own]
        if self.force is not None:
            return values / k, values
        turns = theta[:, : 2 * len(geometry.even) : 2] * float(model.turning)
        approach = np.einsum("tmj,tm->tj", geometry.selection(turns), values)
        return approach, k * approach


def drivetrain_lines(
    model: DrivetrainModel, *, harmonics=30, bands: int = 2, mixed=3, triple: int = 1, mixed_bands: int = 0
) -> np.ndarray:
    """Lines worth keeping: mesh harmonics, side bands of the carriers' turn, low mixtures of mesh lines.

    Parameters
    ----------
    model : DrivetrainModel
    harmonics : int or sequence of int
        Of all meshes, or one a base that is a mesh. Twice the terms of the mesh stiffness are not too many:
        its highest terms meet the motion at low ones.
    bands : int
        Orders of a carrier's turn beside the mesh lines of its own stage.
    mixed : int or sequence of int
        Largest orders of the partners in ``n f_1 +- m f_2``, one a base that is a mesh.
    triple : int
        Largest orders in mixtures of three meshes.
    mixed_bands : int
        Orders of the turn beside these and beside the lines of the other stages.

    Returns
    -------
    (L, n_bases) int array
    """
    n, planets = len(model.bases), len(model.geometry.even)
    turn = [2 * p for p in range(planets)] if model.turning else []
    mesh = [b for b in range(n) if b % 2 or b >= 2 * planets]
    counts = np.broadcast_to(harmonics, len(mesh))
    lines = []

    def add(pairs, bands):
        pairs = tuple(pairs)
        for shift in itertools.product(range(-bands, bands + 1), repeat=len(turn)):
            order = [0] * n
            for base, value in (*zip(turn, shift), *pairs):
                order[base] += value
            lines.append(order)

    for base, count in zip(mesh, counts):
        for h in range(count + 1):
            add([(base, h)], bands if base < 2 * planets else mixed_bands)
    most = dict(zip(mesh, np.broadcast_to(mixed, len(mesh))))
    for one, two in itertools.combinations(mesh, 2):
        for h, g in itertools.product(range(1, most[one] + 1), range(-most[two], most[two] + 1)):
            add([(one, h), (two, g)], mixed_bands)
    for three in itertools.combinations(mesh, 3):
        for shares in itertools.product(range(-triple, triple + 1), repeat=3):
            if all(shares):
                add(zip(three, shares), mixed_bands)
    return distinct_lines(np.array(lines))


def settled_motion(
    model: DrivetrainModel,
    torques: dict[str, float],
    *,
    speed: float,
    orders=None,
    tolerance: float = TOLERANCE,
    max_lines: int = MAX_LINES,
    gyroscopic: bool = True,
) -> SettledMotion:
    """Motion under constant torques that balance, at a constant speed of the first body.

    It obeys the equations; whether a small disturbance dies out is not asked.

    Parameters
    ----------
    model : DrivetrainModel
    torques : dict
        On bodies [N m].
    speed : float
        [rad/s]
    orders : (L, n_bases) int array, optional
        Lines, for example from `drivetrain_lines`; when not given they are searched.
    tolerance : float
        Of the `remainder` of every mesh.
    max_lines : int
        Where the search stops; `converged` and `message` tell.
    gyroscopic : bool
        With the gyroscopic terms at this speed.

    Raises
    ------
    CaseError
        Torques that drive the spin (E-LOAD-BALANCE), a tolerance or number of lines that is none (E-RANGE),
        orders that are no lines or too high (E-LINES), bearings that hold the rotation (E-BEARING), a mesh
        whose stiffness comes near zero (E-STIFFNESS).
    ConvergenceError
        The equations are singular (E-SINGULAR, E-RESONANCE): no damping, or the border of an unstable
        parametric resonance.
    """
    _check(tolerance, max_lines)
    check_free_spin(model)
    problem = line_problem(model, _balanced_load(model, torques), speed, gyroscopic=gyroscopic)
    given = orders is not None
    if not given:
        found = _searched(problem, tolerance, int(max_lines))
        orders = distinct_lines(problem.codes.orders(found.lines))
    else:
        orders = checked_lines(orders)
        found = _given(problem, orders, tolerance)
    codes = orders @ problem.codes.stride
    at, turned = np.searchsorted(found.lines, np.abs(codes)), codes < 0
    sides = np.where(codes == 0, 1.0, 2.0)
    x, q, force = (
        (np.where(turned[:, None], v[at].conj(), v[at]) * sides[:, None]).T
        for v in (found.x, _displacements(problem, found), found.forces)
    )
    left, fed_back = found.estimate.remainder, found.estimate.feedback
    converged = bool(left.max() <= tolerance and fed_back.max() <= _FEEDBACK * tolerance and found.solved)
    message = _message(model, found, converged, tolerance, max_lines)
    if not given:
        message += _pulling(model, force[:, 0].real)
    return SettledMotion(
        model, orders, problem.frequency, x, q, None if given else force, found.residual, left, fed_back,
        converged, found.rounds, message,
    )  # fmt: skip


def _pulling(model, mean) -> str:
    """Meshes that pull in the mean: the torques press their other flanks."""
    names = [model.meshes[i] for i in np.flatnonzero(mean < -_UNBALANCED * np.abs(mean).max(initial=0.0))]
    if not names:
        return ""
    return f"; {', '.join(names)} pull in the mean: the other flank is loaded, name the driver of the stage"


def _check(tolerance, max_lines) -> None:
    if not (np.isscalar(tolerance) and np.isreal(tolerance) and _FINEST <= tolerance < 1.0):
        raise CaseError(
            f"a tolerance of {tolerance!r}", code="E-RANGE", key="tolerance", limit=f"{_FINEST:g} to below 1"
        )
    if not (np.isscalar(max_lines) and np.isreal(max_lines) and 1 <= max_lines <= 1e6):
        raise CaseError(f"{max_lines!r} lines", code="E-RANGE", key="max_lines", limit="1 to 1 000 000")


def _balanced_load(model: DrivetrainModel, torques) -> np.ndarray:
    if not model.meshes:
        raise CaseError(
            "a chain without gears has no lines", code="E-DRIVETRAIN", limit="one mesh or more",
            remedy="it stands at its static deflection",
        )  # fmt: skip
    load = model.system.load + torque_vector(model, torques)
    size = np.abs(model.rigid * load).max(initial=0.0)
    if abs(model.rigid @ load) > _UNBALANCED * max(size, 1e-300):
        raise CaseError(
            f"the torques leave {model.rigid @ load:.6g} N m that drive the spin", code="E-LOAD-BALANCE",
            remedy="balance them (balanced_torque), or integrate in time",
        )  # fmt: skip
    return load


@dataclass(frozen=True)
class _Solution:
    lines: np.ndarray
    forces: np.ndarray
    residual: float
    estimate: Estimate
    rounds: int
    solved: bool
    x: np.ndarray | None = None
    on_motions: np.ndarray | None = None


def _given(problem: LineProblem, orders, tolerance) -> _Solution:
    lines = problem.codes.of(orders)
    if not np.all(np.abs(orders) <= problem.codes.largest):
        raise CaseError(
            f"orders up to {np.abs(orders).max(axis=0).tolist()}", code="E-LINES", key="orders",
            limit=f"{problem.codes.largest.tolist()}, one a base",
        )  # fmt: skip
    equations = line_equations(problem, lines)
    x, residual = equations.solve(_GIVEN)
    _check_residual(residual, _GIVEN)
    forces = equations.table.mesh_forces(x, lines)
    found = with_feedback(force_equations(problem, lines), estimate(problem, lines, forces, tolerance))
    return _Solution(
        lines, forces, residual, found, 1, residual <= _ENOUGH * _GIVEN, x, equations.table.forces(x)
    )


def _searched(problem: LineProblem, tolerance, most: int) -> _Solution:
    """Solve, estimate what is beyond, take in what matters, until what is left does not matter."""
    lines = np.unique(np.multiply.outer(np.arange(_START + 1), problem.codes.stride))[:most]
    forces = np.zeros((len(lines), len(problem.stiffness)), complex)
    accuracy, finest, target, unit = _SEARCH * tolerance, _FOUND * tolerance, tolerance, None
    equations, before, share = force_equations(problem, lines), np.inf, 1.0
    for rounds in range(1, _ROUNDS + 1):
        fine, full = accuracy == finest, rounds > 1 and len(lines) == most
        found = _solution(equations, forces, accuracy, tolerance, rounds, feedback=fine, unit=unit)
        unit, left = found.estimate.alternating, found.estimate.remainder.max()
        if fine and left <= tolerance and found.estimate.feedback.max() <= _FEEDBACK * tolerance:
            break
        # the neighbours were small enough, what they do is not
        target = _CLOSER * min(target, left) if fine else target
        # where lines that are left out change the others their estimates are too small
        share *= _CLOSER if left > max(target, _SLOW * before) else 1.0
        before = left
        wider, forces = refined(problem, lines, found.forces, found.estimate, share * target, most)
        stuck = full or np.array_equal(wider, lines) or rounds >= _ROUNDS - 1
        if fine and stuck:
            break
        if stuck or left <= target:
            accuracy, forces = finest, found.forces
        else:
            accuracy, lines = _SEARCH * tolerance, wider
            equations = force_equations(problem, lines, strong_lines(forces, unit, share * target))
    x = equations.table.motions(found.forces)
    pushed = equations.table.on_motions(found.forces) - x @ sum(one.mean for one in problem.families)
    x, pushed = x[equations.table.at], pushed[equations.table.at]
    return replace(found, x=x, on_motions=pushed)


def _solution(equations: ForceEquations, start, accuracy, tolerance, rounds, *, feedback, unit) -> _Solution:
    problem, lines = equations.problem, equations.lines
    right = equations.table.through(equations.table.still())
    if unit is None:
        size = np.abs(right[0])
        unit = _GUESS * np.maximum(size, max(_GUESS * size.max(), np.finfo(float).tiny))
    forces, residual = equations.solve(right, start, unit, accuracy)
    _check_residual(residual, accuracy)
    found = estimate(problem, lines, forces, tolerance)
    found = with_feedback(equations, found) if feedback else found
    return _Solution(lines, forces, residual, found, rounds, residual <= _ENOUGH * accuracy)


def _check_residual(residual: float, accuracy: float) -> None:
    if not residual <= _LOST * accuracy:
        raise ConvergenceError(
            f"the lines of the settled motion have a residual of {residual:.2g}", code="E-SINGULAR",
            limit=f"{accuracy:.1g}", remedy="add damping, or change the speed",
        )  # fmt: skip


def _displacements(problem: LineProblem, found: _Solution) -> np.ndarray:
    """Two-sided lines (L, n) of all coordinates."""
    q = -problem.response(found.lines, found.on_motions, np.eye(len(problem.basic)))
    q[0] += problem.displaced
    return q


def _message(model, found: _Solution, converged: bool, tolerance, max_lines) -> str:
    left, fed_back = found.estimate.remainder, found.estimate.feedback
    worst = int(np.argmax(np.maximum(left, fed_back / _FEEDBACK)))
    text = f"{len(found.lines)} lines leave out {left[worst]:.2g} of the alternating force of "
    text += f"{model.meshes[worst]}, which changes the rest by {fed_back[worst]:.2g}"
    if converged:
        return text
    if not found.solved:
        return f"{text}; GMRES stopped at a residual of {found.residual:.2g}"
    why = f"max_lines is {max_lines}" if len(found.lines) >= max_lines else f"after {found.rounds} rounds"
    return f"{text}; the tolerance is {tolerance:g}, {why}"
