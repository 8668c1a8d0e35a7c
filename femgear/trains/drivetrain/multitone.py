"""Settled motion of a drivetrain whose meshes keep contact: linear harmonic balance over several bases.

With the stiffness of the simple motions ``G(theta) = S k S^T = mean + rest`` and their receptance F with the
mean stiffness, the lines of the motion obey ``x + F(i omega) (rest * x) = x_static`` with * the convolution
over the lattice of orders. The system is linear and there are no samples in time, of which four bases would
need millions. Lines that are given are solved for so (`LineEquations`); where lines are searched, the
unknowns are the mesh forces (`ForceEquations`), which need fewer.

Lines over several bases are packed into whole numbers (`LineCodes`): sums and mirror images of orders become
those of codes. A set of lines is the ascending array of the codes that are not negative; the mean has the
code zero, and the mirror image of a line the negative code.

With the directions ``S``, constant but for shifts by one turn of the carrier, the mesh forces on the simple
motions are ``S * (k * (S^T * x))``: three convolutions, each sparse, in place of one with the harmonics of
``S k S^T``. The linear equations are solved by GMRES (Saad and Schultz, SIAM J. Sci. Stat. Comput. 7 (1986)
856).

Where shafts are soft the mesh forces follow from the torques and hardly alternate, whatever the stiffness k
does: the motion gives way, by very many lines whose forces cancel. With the mean stiffness k_0,
``r = k_0 / k - 1``, the directions S and the receptance G of the chain with k_0 the approaches are
``S^T x = (1 + r) f / k_0``, the motions ``x = x_static + G S (r * f)``, and the forces obey
``f + D (r * f) = k_0 S^T x_static`` with ``D = 1 - k_0 S^T G S``. D is small where the chain gives way, one
where its bodies stay at rest, large at its resonances; few lines carry forces. GMRES is then preconditioned
with every mesh by itself, its stiffness varying: blocks of lines that the harmonics of this mesh connect.

The search takes in those lines beside the present ones whose estimate matters (`Estimate`). On a line beyond
those solved for, the mesh forces are ``-D (r * f)`` to first order: one convolution and one pass through the
chain. Adding what has the largest estimate is the adaptive Galerkin method of A. Cohen, W. Dahmen and
R. DeVore, Math. Comput. 70 (2001) 27-75: solve, estimate, mark, refine, coarsen.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.linear.receptance import Reduction, reduce_problem, respond
from femgear.system.fourier import FourierSeries, checked_lines, distinct_lines
from femgear.system.system import NonlinearSystem
from femgear.trains.drivetrain.data import check_free_spin
from femgear.trains.drivetrain.model import DrivetrainModel, torque_vector

# Bits of a code, and those for the turn of a carrier.
_BITS, _TURN_BITS = 62, 7

# Points of a mesh period for the compliance, and harmonics of it that are none.
_POINTS, _NONE = 8192, 1e-7
# Stiffness of a mesh over its mean below which its compliance has no series.
_SOFTEST = 1e-3

# Products before GMRES starts again, and how often.
_PRODUCTS, _STARTS = 250, 4
# Stiffness that is none, over the largest.
_ROUNDING = 1e-14

# Root of the sum of squares of what the neighbours that are not looked at get, over the tolerance.
_OVERLOOKED = 0.1
# And of the lines that are left out on purpose.
_LEFT = 0.5
# And of the lines beside which no motion but their own is looked at.
_STRONG = 1.0
# Accuracy of the feedback of what is left out.
_FEEDBACK = 0.3
# Alternating force, relative to the largest mean force, below which there is none.
_STILL = 1e-9

# Estimated error of the forces, and lines at most.
TOLERANCE, MAX_LINES = 1e-2, 20_000
# Smallest tolerance.
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
_ACCEPTED_FEEDBACK = 3.0
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
    converged = bool(
        left.max() <= tolerance and fed_back.max() <= _ACCEPTED_FEEDBACK * tolerance and found.solved
    )
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
        if fine and left <= tolerance and found.estimate.feedback.max() <= _ACCEPTED_FEEDBACK * tolerance:
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
    worst = int(np.argmax(np.maximum(left, fed_back / _ACCEPTED_FEEDBACK)))
    text = f"{len(found.lines)} lines leave out {left[worst]:.2g} of the alternating force of "
    text += f"{model.meshes[worst]}, which changes the rest by {fed_back[worst]:.2g}"
    if converged:
        return text
    if not found.solved:
        return f"{text}; GMRES stopped at a residual of {found.residual:.2g}"
    why = f"max_lines is {max_lines}" if len(found.lines) >= max_lines else f"after {found.rounds} rounds"
    return f"{text}; the tolerance is {tolerance:g}, {why}"


@dataclass(frozen=True)
class LineCodes:
    """Places of the orders in the bits of a code.

    Parameters
    ----------
    width : (n_bases,) int array
        Bits of every base.
    """

    width: np.ndarray

    @property
    def stride(self) -> np.ndarray:
        """(n_bases,) codes of the first harmonics."""
        return np.left_shift(np.int64(1), np.append(0, np.cumsum(self.width[:-1])).astype(np.int64))

    @property
    def largest(self) -> np.ndarray:
        """(n_bases,) orders that a line may have; two shifts of this size more still fit."""
        return 2 ** (self.width - 3)

    def of(self, orders) -> np.ndarray:
        """Ascending codes of lines (L, n_bases), of a line and its mirror image the one not negative."""
        return np.unique(np.abs(np.asarray(orders, np.int64) @ self.stride))

    def orders(self, codes) -> np.ndarray:
        """(L, n_bases) int array."""
        left, orders = np.asarray(codes, np.int64), []
        for width in self.width[:-1].tolist():
            half = 1 << (width - 1)
            orders.append(((left + half) & ((1 << width) - 1)) - half)
            left = (left - orders[-1]) >> width
        return np.stack([*orders, left], axis=1)

    def admitted(self, codes) -> np.ndarray:
        """Whether the orders are small enough for a line (L,)."""
        return np.all(np.abs(self.orders(codes)) <= self.largest, axis=1)


def line_codes(model: DrivetrainModel) -> LineCodes:
    """Codes for the bases of a drivetrain.

    Raises
    ------
    CaseError
        More bases, or terms of the mesh stiffness, than fit in 62 bits (E-LINES).
    """
    n, planets = len(model.bases), len(model.geometry.even)
    turn = (np.arange(n) < 2 * planets) & (np.arange(n) % 2 == 0)
    width = np.where(turn, _TURN_BITS, 0)
    meshes = int(np.count_nonzero(~turn))
    each = (_BITS - int(width.sum())) // max(meshes, 1)
    codes = LineCodes(np.where(turn, _TURN_BITS, min(each, 31)).astype(np.int64))
    terms, fits = model.stiffness.shape[1] - 1, 2 ** max(each - 3, 0)
    if terms > fits:
        raise CaseError(
            f"{terms} terms of the mesh stiffness on {n} base frequencies", code="E-LINES",
            limit=f"{fits} terms with so many stages", remedy="take fewer terms",
        )  # fmt: skip
    return codes


def mirrored(values: np.ndarray) -> np.ndarray:
    """Lines (L, ...) with their mirror images before them (2 L - 1, ...)."""
    return np.concatenate([values[:0:-1].conj(), values])


def mirrored_codes(codes: np.ndarray) -> np.ndarray:
    """Codes (2 L - 1,), ascending."""
    return np.concatenate([-codes[:0:-1], codes])


def places(codes: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Where the wanted codes stand among ascending ones, -1 for those that do not."""
    at = np.minimum(np.searchsorted(codes, wanted), len(codes) - 1)
    return np.where(codes[at] == wanted, at, -1)


def beside(codes: np.ndarray, turn: int) -> np.ndarray:
    """The lines and those one turn above and below; a turn of zero adds none."""
    if not turn:
        return codes
    both = mirrored_codes(codes)
    wider = np.unique(np.concatenate([both - turn, both, both + turn]))
    return wider[wider >= 0]


@dataclass(frozen=True)
class MeshFamily:
    """Meshes whose stiffness has the same base.

    Parameters
    ----------
    meshes : (g,) int array
    step, turn : int
        Codes of the base and of the carrier's turn; a turn of zero where directions stay.
    directions : dict
        {shift by turns: (m, g) complex array}, the lines of ``S``.
    waves : (g, 2 H + 1) complex array
        Two-sided harmonics of the stiffness [N/m].
    compliance : (g, N) complex array
        Two-sided harmonics of ``mean / k - 1``.
    compliance_orders : (N,) int array
    mean : (m, m) array
        Of ``S k S^T``.
    """

    meshes: np.ndarray
    step: int
    turn: int
    directions: dict[int, np.ndarray]
    waves: np.ndarray
    compliance: np.ndarray
    compliance_orders: np.ndarray
    mean: np.ndarray

    @property
    def harmonics(self) -> np.ndarray:
        """(2 H + 1,) orders of the waves."""
        half = self.waves.shape[1] // 2
        return np.arange(-half, half + 1)

    @property
    def stiffness(self) -> np.ndarray:
        """(g,) mean stiffness [N/m]."""
        return self.waves[:, self.waves.shape[1] // 2].real


@dataclass(frozen=True)
class LineProblem:
    """``x + F(i omega) (rest * x) = x_static`` for the simple motions x.

    Parameters
    ----------
    codes : LineCodes
    frequency : (n_bases,) array
        [rad/s]
    families : tuple of MeshFamily
    reduction : Reduction
        Receptance F of the simple motions with the mean stiffness.
    basic : (n, m) array
        Simple motions.
    displaced : (n,) array
        Static displacement under the constant loads with the mean stiffness.
    scale : (m,) array
        Square roots of the stiffness of the simple motions: all motions in units of energy.
    """

    codes: LineCodes
    frequency: np.ndarray
    families: tuple[MeshFamily, ...]
    reduction: Reduction
    basic: np.ndarray
    displaced: np.ndarray
    scale: np.ndarray

    @property
    def stiffness(self) -> np.ndarray:
        """(n_meshes,) mean stiffness [N/m]."""
        out = np.empty(sum(len(one.meshes) for one in self.families))
        for one in self.families:
            out[one.meshes] = one.stiffness
        return out

    @property
    def static(self) -> np.ndarray:
        """(m,) simple motions of `displaced`."""
        return self.basic.T @ self.displaced

    def omega(self, lines) -> np.ndarray:
        """(L,) [rad/s]"""
        return self.codes.orders(lines) @ self.frequency

    def receptance(self, lines) -> np.ndarray:
        """``U^T Z^-1 U`` (L, m, m) [m/N]."""
        return self.reduction.at(self.omega(lines))[0][:, :, : self.basic.shape[1]]

    def response(self, lines, forces, outputs) -> np.ndarray:
        """Outputs (L, n_outputs) of forces (L, m) on the simple motions."""
        inputs = np.vstack([forces.T, np.zeros(len(forces))])
        return respond(self.reduction, outputs, self.omega(lines), inputs).T


def line_problem(model: DrivetrainModel, load, speed: float, *, gyroscopic: bool) -> LineProblem:
    """The equations at one speed of the first body [rad/s], with constant loads (n,) that balance."""
    U, codes = model.geometry.basic, line_codes(model)
    families = tuple(_family(model, codes, base) for base in np.unique(model.mesh_base))
    mean = sum((one.mean for one in families), np.zeros((U.shape[1],) * 2))
    K, carried = model.system.K + U @ mean @ U.T, model.system.M @ model.rigid
    # no force of a mesh acts on the spin: any stiffness that holds its mean does
    held = K + np.abs(K).max() / np.abs(carried).max() ** 2 * np.outer(carried, carried)
    system = replace(model.system, K=0.5 * (K + K.T), W=U, load=np.zeros(len(U)))
    reduction = reduce_problem(
        NonlinearSystem(system, (), speed=speed if gyroscopic else 0.0), reference=np.zeros(U.shape[1])
    )
    scale = np.sqrt(np.diag(mean))
    return LineProblem(
        codes, model.frequencies(speed), families, reduction, U, np.linalg.solve(held, load),
        np.where(scale > 0.0, scale, 1.0),
    )  # fmt: skip


def _family(model: DrivetrainModel, codes: LineCodes, base: int) -> MeshFamily:
    geometry, own = model.geometry, np.flatnonzero(model.mesh_base == base)
    stage, turn = geometry.stage[own[0]], 0
    # a simple motion that moves nothing, of held axes, has no direction
    moves = np.any(geometry.basic != 0.0, axis=0)[:, None]
    directions = {0: geometry.fixed[:, own] * moves}
    if stage < len(geometry.even):
        even, odd = geometry.even[stage][:, own] * moves, geometry.odd[stage][:, own] * moves
        if not model.turning:
            directions[0] = directions[0] + even
        elif even.any() or odd.any():
            turn = int(codes.stride[2 * stage])
            directions |= {1: 0.5 * (even - 1j * odd), -1: 0.5 * (even + 1j * odd)}
    k = model.stiffness[own]
    waves = np.hstack([0.5 * k[:, :0:-1].conj(), k[:, :1].real, 0.5 * k[:, 1:]])
    mean = sum((v.conj() * k[:, 0].real) @ v.T for v in directions.values()).real
    return MeshFamily(own, int(codes.stride[base]), turn, directions, waves, *_compliance(model, own), mean)


def _compliance(model: DrivetrainModel, own) -> tuple[np.ndarray, np.ndarray]:
    """Two-sided harmonics (g, N) of mean / k - 1 and their orders (N,)."""
    phase = 2.0 * np.pi * np.arange(_POINTS)[:, None] / _POINTS
    k = np.array(FourierSeries(model.stiffness[own]).at(phase))
    mean = model.mean_stiffness[own]
    low = k.min(axis=0) / mean
    if low.min() < _SOFTEST:
        raise CaseError(
            f"the stiffness of {model.meshes[own[np.argmin(low)]]} falls to {low.min():.3g} of its mean",
            code="E-STIFFNESS", limit=f"{_SOFTEST:g} of the mean or more at any time",
            remedy="take a larger low_share, or more harmonics",
        )  # fmt: skip
    waves = np.fft.fft(mean / k - 1.0, axis=0).T / _POINTS
    half = int(np.flatnonzero(np.abs(waves[:, : _POINTS // 2]).max(axis=0) > _NONE).max(initial=0))
    orders = np.arange(-half, half + 1)
    return waves[:, orders], orders


@dataclass(frozen=True)
class FamilyCoupling:
    """Tables of one family from motions on some lines to forces on others.

    Parameters
    ----------
    family : MeshFamily
    outer : (E',) int array
        Lines of the mesh forces.
    gather, scatter : dict
        {shift: rows of the motions for every approach}, {shift: rows of the mesh forces for every row}.
    varying : tuple of sparse arrays
        One a mesh: convolution with what varies, from all lines to those of the mesh forces.
    """

    family: MeshFamily
    outer: np.ndarray
    gather: dict[int, np.ndarray]
    scatter: dict[int, np.ndarray]
    varying: tuple

    def approach(self, motion) -> np.ndarray:
        """(E, g) of the two-sided motions with a row of zeros behind them."""
        return sum((motion @ v)[self.gather[a]] for a, v in self.family.directions.items())

    def times(self, values) -> np.ndarray:
        """Convolution (E', g) of the lines (E, g): approaches by the stiffness, forces by the compliance."""
        both = np.asfortranarray(mirrored(values))
        return np.stack([k @ both[:, j] for j, k in enumerate(self.varying)], axis=1)

    def pushed(self, force) -> np.ndarray:
        """Forces on the simple motions (rows, m)."""
        both = with_nothing(mirrored(force))
        return sum(both[self.scatter[a]] @ v.T for a, v in self.family.directions.items())


@dataclass(frozen=True)
class Coupling:
    """``rest * x`` on rows, from the simple motions on lines.

    Parameters
    ----------
    own : (rows,) int array
        Place of every row among the two-sided lines, the place behind them for none.
    mean : (m, m) array
        Stiffness that the receptance holds.
    families : tuple of FamilyCoupling
    """

    own: np.ndarray
    mean: np.ndarray
    families: tuple[FamilyCoupling, ...]

    def forces(self, x) -> np.ndarray:
        """(rows, m) [N] of the motions (L, m)."""
        motion = with_nothing(mirrored(x))
        total = -motion[self.own] @ self.mean
        for one in self.families:
            total += one.pushed(one.times(one.approach(motion)))
        return total

    def mesh_forces(self, x, lines) -> np.ndarray:
        """(L, n_meshes) [N], of these lines."""
        motion = with_nothing(mirrored(x))
        out = np.empty((len(lines), sum(len(one.family.meshes) for one in self.families)), complex)
        for one in self.families:
            out[:, one.family.meshes] = one.times(one.approach(motion))[places(one.outer, lines)]
        return out


def coupling(problem: LineProblem, lines) -> Coupling:
    """Tables from the lines, ascending codes, to themselves."""
    both = mirrored_codes(lines)
    mean, parts = sum(one.mean for one in problem.families), []
    for family in problem.families:
        wide = beside(lines, family.turn)
        table = convolution(family, wide, wide, family.harmonics, family.waves)
        parts.append(FamilyCoupling(family, wide, *_turned(family, lines, wide), table))
    return Coupling(places(both, lines), mean, tuple(parts))


def _turned(family: MeshFamily, lines, wide) -> tuple[dict, dict]:
    """Rows of the two-sided lines for every wide one, and the reverse, a turn apart."""
    both, widened = mirrored_codes(lines), mirrored_codes(wide)
    gather = {a: places(both, wide - a * family.turn) for a in family.directions}
    return gather, {a: places(widened, lines - a * family.turn) for a in family.directions}


def force_couplings(problem: LineProblem, lines, rows, motions) -> tuple[FamilyCoupling, ...]:
    """Tables from mesh forces on lines to what they change on rows, and from there to motions and back."""
    return tuple(
        FamilyCoupling(
            one, rows, *_turned(one, motions, rows),
            convolution(one, lines, rows, one.compliance_orders, one.compliance),
        )
        for one in problem.families
    )  # fmt: skip


def pairs(family: MeshFamily, codes, rows, orders) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows, columns among the codes and numbers of the orders that lead from one to the other."""
    found = []
    for number, order in enumerate(orders):
        column = places(codes, rows - order * family.step)
        row = np.flatnonzero(column >= 0)
        found.append((row, column[row], np.full(len(row), number)))
    return tuple(np.concatenate(part) for part in zip(*found))


def convolution(family: MeshFamily, lines, rows, orders, waves) -> tuple:
    """Sparse arrays (R, 2 L - 1), one a mesh, of the waves (g, N)."""
    from scipy import sparse

    codes = mirrored_codes(lines)
    used = np.flatnonzero(np.any(waves != 0.0, axis=0))
    used = used if len(used) else np.array([0])
    row, column, number = pairs(family, codes, rows, orders[used])
    table = sparse.csr_array((number + 1, (row, column)), shape=(len(rows), len(codes)))
    return tuple(
        sparse.csr_array((wave[used][table.data - 1], table.indices, table.indptr), shape=table.shape)
        for wave in waves
    )


def with_nothing(values: np.ndarray) -> np.ndarray:
    """With a last row of zeros, which the place -1 takes."""
    return np.concatenate([values, np.zeros_like(values[:1])])


@dataclass(frozen=True)
class Chain:
    """The chain with mean mesh stiffness on some lines, which meet only by the turn of a carrier.

    Parameters
    ----------
    receptance : (L, m, m) complex array
        [m/N]
    mirrors : (N,) int array
        Lines near zero whose mirror images are neighbours of lines, in descending order.
    factors
        Of the equations on these mirror images and the lines; None where nothing turns.
    """

    receptance: np.ndarray
    mirrors: np.ndarray
    factors: object

    def solve(self, right) -> np.ndarray:
        """Motions (L, m) from those (L, m) without the turn."""
        if self.factors is None:
            return right
        both = np.concatenate([right[self.mirrors].conj(), right])
        return self.factors.solve(both.ravel()).reshape(both.shape)[len(self.mirrors) :]

    def pushed(self, forces) -> np.ndarray:
        """Motions (L, m) under forces on the simple motions (L, m) [N]."""
        return self.solve(np.matmul(self.receptance, forces[:, :, None])[:, :, 0])


def constant_chain(problem: LineProblem, lines) -> Chain:
    """The chain on the codes of lines (L,)."""
    near = 64 * max(one.turn for one in problem.families)
    mirrors = np.flatnonzero((lines > 0) & (lines < near))[::-1]
    receptance, turning = problem.receptance(lines), _turning_stiffness(problem)
    if not turning:
        return Chain(receptance, mirrors, None)
    both = np.concatenate([receptance[mirrors].conj(), receptance])
    codes = np.concatenate([-lines[mirrors], lines])
    return Chain(receptance, mirrors, _without_time(codes, both, turning))


@dataclass(frozen=True)
class LineEquations:
    """The equations on one set of lines, ready to be solved.

    Parameters
    ----------
    problem : LineProblem
    lines : (L,) int array
        Codes.
    table : Coupling
        From these lines to themselves.
    chain : Chain
    """

    problem: LineProblem
    lines: np.ndarray
    table: Coupling
    chain: Chain

    def left_side(self, x) -> np.ndarray:
        """``x + F (rest * x)`` (L, m)."""
        return x + np.matmul(self.chain.receptance, self.table.forces(x)[:, :, None])[:, :, 0]

    def solve(self, accuracy: float):
        """Two-sided lines (L, m) of the simple motions, and their residual over the size.

        Motions are taken in units of energy (``problem.scale``).

        Parameters
        ----------
        accuracy : float
            Of the residual, over the right side.
        """
        right = np.zeros((len(self.lines), len(self.problem.scale)), complex)
        right[0] = self.problem.static
        size = max(float(np.linalg.norm(right * self.problem.scale)), np.finfo(float).tiny)
        start, unit = np.zeros_like(right), size / self.problem.scale
        return krylov(self.left_side, self.chain.solve, right, start, unit, accuracy)


def krylov(left_side, prepared, right, start, unit, accuracy: float) -> tuple[np.ndarray, float]:
    """Solution (L, c) of linear equations and its residual, in units (c,) of the unknowns.

    Mirror images are conjugate, so that the equations are linear over real numbers only. The preconditioner
    stands on the right: GMRES sees the residual of the equations themselves.
    """
    from scipy.sparse.linalg import LinearOperator, gmres

    shape = right.shape

    def vector_of(x):
        return np.ascontiguousarray(x / unit).reshape(-1).view(float)

    def motion_of(vector):
        return prepared(vector.view(complex).reshape(shape) * unit)

    error = vector_of(right - left_side(start))
    operator = LinearOperator(
        (len(error),) * 2, matvec=lambda v: vector_of(left_side(motion_of(v))), dtype=float
    )
    found, _ = gmres(operator, error, rtol=0.0, atol=accuracy, restart=_PRODUCTS, maxiter=_STARTS)
    x = start + motion_of(found)
    return x, float(np.linalg.norm(vector_of(right - left_side(x))))


def line_equations(problem: LineProblem, lines) -> LineEquations:
    """Tables and factors for the codes of lines (L,)."""
    return LineEquations(problem, lines, coupling(problem, lines), constant_chain(problem, lines))


def _without_time(lines, receptance, turning):
    """Factors of the equations with constant mesh stiffness: lines meet only by the turn of a carrier."""
    from scipy import sparse
    from scipy.sparse.linalg import splu

    m, size = receptance.shape[1], receptance.shape[0] * receptance.shape[1]
    one = np.arange(m)
    entries = [(np.arange(size), np.arange(size), np.ones(size, complex))]
    for shift, stiffness in turning.items():
        column = places(lines, lines - shift)
        row = np.flatnonzero(column >= 0)
        block = receptance[row] @ stiffness
        at = np.broadcast_arrays(
            row[:, None, None] * m + one[:, None], column[row][:, None, None] * m + one, block
        )
        used = block != 0.0
        entries.append(tuple(part[used] for part in at))
    row, column, value = (np.concatenate(part) for part in zip(*entries))
    matrix = sparse.coo_array((value, (row, column)), shape=(size, size)).tocsc()
    return splu(matrix, permc_spec="NATURAL")


def _turning_stiffness(problem: LineProblem) -> dict[int, np.ndarray]:
    """{code of the shift: (m, m)} lines of ``S k S^T`` with the mean of k, without the mean itself."""
    total: dict[int, np.ndarray] = {}
    for one in problem.families:
        for a, u in one.directions.items():
            for b, v in one.directions.items():
                shift = (a + b) * one.turn
                if shift:
                    total[shift] = total.get(shift, 0.0) + (u * one.stiffness) @ v.T
    # of planets that are alike most of it cancels
    none = _ROUNDING * max((np.abs(one.mean).max() for one in problem.families), default=0.0)
    total = {shift: np.where(np.abs(k) > none, k, 0.0) for shift, k in total.items()}
    return {shift: k for shift, k in total.items() if k.any()}


@dataclass(frozen=True)
class ForceTable:
    """From mesh forces on lines to those that the chain answers with, on rows.

    Parameters
    ----------
    problem : LineProblem
    lines : (R,) int array
        Codes of the rows.
    families : tuple of FamilyCoupling
    at : (R,) int array
        Place of the rows among the lines of the motions.
    chain : Chain
        On these.
    """

    problem: LineProblem
    lines: np.ndarray
    families: tuple[FamilyCoupling, ...]
    at: np.ndarray
    chain: Chain

    def changed(self, forces) -> np.ndarray:
        """``r * f`` (R, n_meshes) [N] of the forces (L, n_meshes)."""
        out = np.empty((len(self.lines), forces.shape[1]), complex)
        for one in self.families:
            out[:, one.family.meshes] = one.times(forces[:, one.family.meshes])
        return out

    def on_motions(self, forces) -> np.ndarray:
        """Forces (M, m) of the meshes (R, n_meshes) on the simple motions, ``S f``."""
        return sum(one.pushed(forces[:, one.family.meshes]) for one in self.families)

    def through(self, x) -> np.ndarray:
        """Forces (R, n_meshes) of motions (M, m) with the mean stiffness, ``k_0 S^T x``."""
        motion, k = with_nothing(mirrored(x)), self.problem.stiffness
        out = np.empty((len(self.lines), len(k)), complex)
        for one in self.families:
            out[:, one.family.meshes] = one.approach(motion)
        return out * k

    def answered(self, forces) -> np.ndarray:
        """``D (r * f)`` (R, n_meshes)."""
        changed = self.changed(forces)
        return changed - self.through(self.chain.pushed(self.on_motions(changed)))

    def still(self) -> np.ndarray:
        """Motions (M, m) with the mean stiffness; the first row is the mean."""
        right = np.zeros(self.chain.receptance.shape[:2], complex)
        right[0] = self.problem.static
        return self.chain.solve(right)

    def motions(self, forces) -> np.ndarray:
        """Motions (M, m) under the forces and the loads."""
        return self.still() + self.chain.pushed(self.on_motions(self.changed(forces)))


def force_table(problem: LineProblem, lines, rows, motions) -> ForceTable:
    """Tables from forces on lines to forces on rows by motions: ascending codes that begin with the mean."""
    families = force_couplings(problem, lines, rows, motions)
    return ForceTable(problem, rows, families, places(motions, rows), constant_chain(problem, motions))


@dataclass(frozen=True)
class ForceEquations:
    """The equations on one set of lines, ready to be solved.

    Parameters
    ----------
    problem : LineProblem
    lines : (L,) int array
        Codes.
    table : ForceTable
        From these lines to themselves.
    blocks : tuple
        Factors of every mesh by itself.
    motions : (M,) int array
        Lines of the motions: the turn of a carrier reaches some that the forces do without.
    """

    problem: LineProblem
    lines: np.ndarray
    table: ForceTable
    blocks: tuple
    motions: np.ndarray

    def left_side(self, forces) -> np.ndarray:
        """``f + D (r * f)`` (L, n_meshes)."""
        return forces + self.table.answered(forces)

    def prepared(self, forces) -> np.ndarray:
        """Solution (L, n_meshes) with every mesh by itself."""
        both, out = mirrored(forces), np.empty_like(forces)
        for mesh, chosen, at, turned, factors in self.blocks:
            found = factors.solve(np.ascontiguousarray(both[chosen, mesh]))[at]
            out[:, mesh] = np.where(turned, found.conj(), found)
        return out

    def solve(self, right, start, unit, accuracy: float) -> tuple[np.ndarray, float]:
        """Forces (L, n_meshes) and their residual in units (n_meshes,) [N]."""
        return krylov(self.left_side, self.prepared, right, start, unit, accuracy)


def force_equations(problem: LineProblem, lines, strong=slice(None)) -> ForceEquations:
    """Tables and factors for the codes of lines (L,); the turn of a carrier is seen beside strong ones."""
    motions = lines
    for one in problem.families:
        motions = np.union1d(motions, beside(lines[strong], one.turn))
    table = force_table(problem, lines, lines, motions)
    own = _own_answer(problem, table.chain.receptance[table.at])
    blocks = tuple(b for one in problem.families for b in _mesh_blocks(problem, one, lines, own))
    return ForceEquations(problem, lines, table, blocks, motions)


def _own_answer(problem: LineProblem, receptance) -> np.ndarray:
    """D of every mesh to itself (L, n_meshes), the turn left out."""
    out = np.empty((len(receptance), len(problem.stiffness)), complex)
    for one in problem.families:
        x = sum(((receptance @ v) * v.conj()).sum(axis=1) for v in one.directions.values())
        out[:, one.meshes] = 1.0 - one.stiffness * x
    return out


def _mesh_blocks(problem: LineProblem, family: MeshFamily, lines, own):
    """Factors of ``1 + D r`` of single meshes: of two mirror images of a block of lines one is enough."""
    from scipy import sparse
    from scipy.sparse.linalg import splu

    both = mirrored_codes(lines)
    base = int(np.flatnonzero(problem.codes.stride == family.step)[0])
    chosen = np.flatnonzero(both - problem.codes.orders(both)[:, base] * family.step >= 0)
    codes, n = both[chosen], len(chosen)
    at = places(codes, lines)
    turned = at < 0
    at = np.where(turned, places(codes, -lines), at)
    row, column, number = pairs(family, codes, codes, family.compliance_orders)
    place = np.concatenate([np.arange(n), row]), np.concatenate([np.arange(n), column])
    for j, mesh in enumerate(family.meshes):
        value = mirrored(own[:, mesh])[chosen][row] * family.compliance[j][number]
        block = sparse.coo_array((np.append(np.ones(n), value), place), shape=(n, n))
        yield mesh, chosen, at, turned, splu(block.tocsc())


@dataclass(frozen=True)
class Estimate:
    """What is known beside a solution on some lines.

    Parameters
    ----------
    alternating : (n_meshes,) array
        Root mean square of the alternating force [N].
    effect : (L, n_meshes) array
        Squares of the forces on the lines, over the mean square of the alternating force.
    beyond : (C,) int array
        Codes of the neighbours.
    force : (C, n_meshes) complex array
        Their estimated mesh forces.
    left : (C, n_meshes) array
        Effects of the neighbours.
    missed : (L, n_meshes) complex array
        Residual of the equations with all motions of the neighbours.
    fed_back : (n_meshes,) array
        Effect of the neighbours by way of the lines solved for.
    """

    alternating: np.ndarray
    effect: np.ndarray
    beyond: np.ndarray
    force: np.ndarray
    left: np.ndarray
    missed: np.ndarray
    fed_back: np.ndarray

    @property
    def remainder(self) -> np.ndarray:
        """(n_meshes,) r.m.s. force of all neighbours over that of the alternating force."""
        return np.sqrt(self.left.sum(axis=0))

    @property
    def feedback(self) -> np.ndarray:
        """(n_meshes,) r.m.s. force that the neighbours make by way of the lines solved for, likewise."""
        return np.sqrt(self.fed_back)


def estimate(problem: LineProblem, lines, forces, tolerance: float) -> Estimate:
    """Effects of the lines and of their neighbours.

    Parameters
    ----------
    problem : LineProblem
    lines : (L,) int array
        Codes.
    forces : (L, n_meshes) complex array
        Two-sided lines of the mesh forces, their solution.
    tolerance : float
        Neighbours that get a small share of this are not looked at.
    """
    alternating = np.sqrt(2.0 * (np.abs(forces[1:]) ** 2).sum(axis=0))
    still = max(_STILL * np.abs(forces[0]).max(), np.finfo(float).tiny)
    alternating = np.maximum(alternating, still)
    effect = 2.0 * np.abs(forces / alternating) ** 2
    effect[0] = 0.0
    beyond = _neighbours(problem, lines, forces / alternating, _OVERLOOKED * tolerance)
    both = np.union1d(lines, beyond)
    table = force_table(problem, lines, both, both)
    answer = table.through(table.still()) - table.answered(forces)
    found, missed = answer[places(both, beyond)], answer[places(both, lines)] - forces
    left = 2.0 * np.abs(found / alternating) ** 2
    return Estimate(alternating, effect, beyond, found, left, missed, np.zeros(len(alternating)))


def with_feedback(equations: ForceEquations, found: Estimate) -> Estimate:
    """With what the neighbours do to the lines solved for: large where these are nearly in resonance.

    One more solution, to three tenths of the feedback.
    """
    lines = equations.lines
    both = np.union1d(lines, found.beyond)
    forces = np.zeros((len(both), len(found.alternating)), complex)
    forces[places(both, found.beyond)] = found.force
    right = found.missed - force_table(equations.problem, both, lines, equations.motions).answered(forces)
    unit = found.alternating * max(np.linalg.norm(right / found.alternating), np.finfo(float).tiny)
    change, _ = equations.solve(right, np.zeros_like(right), unit, _FEEDBACK)
    return replace(found, fed_back=2.0 * (np.abs(change[1:] / found.alternating) ** 2).sum(axis=0))


def refined(problem: LineProblem, lines, forces, found: Estimate, tolerance: float, most: int):
    """The fewest lines that leave half the tolerance out, at most so many; their forces.

    Returns
    -------
    lines : (L,) int array
    forces : (L, n_meshes) complex array
        Solved or estimated.
    """
    kept = problem.codes.admitted(found.beyond)
    codes = np.concatenate([lines, found.beyond[kept]])
    forces = np.concatenate([forces, found.force[kept]])
    effect = np.concatenate([found.effect, found.left[kept]])
    size = effect.max(axis=1)
    # the mean stays
    size[0] = np.inf
    order = np.argsort(size, kind="stable")
    left = np.cumsum(effect[order], axis=0).max(axis=1)
    first = min(np.searchsorted(left, (_LEFT * tolerance) ** 2), len(codes) - 1)
    chosen = order[max(first, len(codes) - most) :]
    chosen = chosen[np.argsort(codes[chosen])]
    return codes[chosen], forces[chosen]


def strong_lines(forces, alternating, tolerance: float) -> np.ndarray:
    """Whether lines (L,) are not among the small ones whose forces add up to some tolerances."""
    effect = 2.0 * (np.abs(forces / alternating) ** 2).max(axis=1)
    effect[0] = np.inf
    order = np.argsort(effect)
    strong = np.empty(len(effect), bool)
    strong[order] = np.cumsum(effect[order]) > (_STRONG * tolerance) ** 2
    return strong


def _neighbours(problem: LineProblem, lines, size, share) -> np.ndarray:
    """Codes of the lines outside that the relative forces (L, n_meshes) reach, but for a share of these."""
    both, size, found = mirrored_codes(lines), np.abs(mirrored(size)), []
    for one in problem.families:
        product = (size[:, None, one.meshes] * np.abs(one.compliance.T)).max(axis=2)
        ordered = np.sort(product, axis=None)
        small = np.searchsorted(np.cumsum(ordered**2), share**2)
        if small < len(ordered):
            at, number = np.nonzero(product >= ordered[small])
            found.append(both[at] + one.compliance_orders[number] * one.step)
    # what a turn of the carrier adds to lines that are not solved for is smaller still
    found += [beside(lines, one.turn) for one in problem.families]
    reached = np.unique(np.abs(np.concatenate(found)))
    return reached[places(lines, reached) < 0]
