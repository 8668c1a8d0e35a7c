"""Steps in time: Newmark's family and the generalised-alpha method, with Newton iterations on the columns.

Every rule is a linear map of the state and of the column forces: ``x_1 = x_free - A g_1`` with x the
deflections of the columns at the end of the step, ``g = f - c x`` their forces beyond the reference stiffness
and ``A`` a matrix of n_columns rows that does not change. The linear system is marched exactly or by a rule,
and only these few equations are iterated (`march`).

N. M. Newmark, J. Eng. Mech. Div. ASCE 85 (1959) 67-94; J. Chung and G. M. Hulbert, J. Appl. Mech. 60 (1993)
371-375; forces that are not linear averaged as loads are: S. Erlicher, L. Bonaventura and O. S. Bursi,
Comput. Mech. 28 (2002) 83-104.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.linalg.lapack import dgesv

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.linear.modal import mass_error
from femgear.system.fourier import phase_of
from femgear.system.system import Law, NonlinearSystem, external_force, tabulated_law

# Numbers held in the states of one block of steps.
_BLOCK_NUMBERS = 2_000_000


@dataclass(frozen=True)
class StepRule:
    """Parameters of ``M a + C v + K q = p`` stepped in time.

    ``q_1 = q_0 + h v_0 + h^2 ((1/2 - beta) a_0 + beta a_1)``, ``v_1 = v_0 + h ((1 - gamma) a_0 +
    gamma a_1)``; the inertia is taken at ``mass a_0 + (1 - mass) a_1``, the other forces with the weight
    ``force`` at the start and ``1 - force`` at the end of the step.
    """

    gamma: float
    beta: float
    mass: float = 0.0
    force: float = 0.0

    def __post_init__(self):
        numbers = np.array([self.gamma, self.beta, self.mass, self.force], float)
        if not np.all(np.isfinite(numbers)) or self.beta < 0.0 or max(self.mass, self.force) >= 1.0:
            raise CaseError(
                f"a step rule with gamma = {self.gamma}, beta = {self.beta}", code="E-STEP-RULE",
                limit="finite numbers, beta of 0 or more, weights below 1",
            )  # fmt: skip
        # below this the rule feeds energy in at every step length
        if self.gamma < 0.5 - self.mass + self.force - 1e-12:
            raise CaseError(
                f"a step rule with gamma = {self.gamma} has negative damping", code="E-STEP-RULE",
                limit=f"gamma of {0.5 - self.mass + self.force:.4g} or more", remedy="take gamma = 1/2",
            )  # fmt: skip


AVERAGE_ACCELERATION = StepRule(0.5, 0.25)
LINEAR_ACCELERATION = StepRule(0.5, 1.0 / 6.0)
FOX_GOODWIN = StepRule(0.5, 1.0 / 12.0)
CENTRAL_DIFFERENCE = StepRule(0.5, 0.0)
RULES = {
    "average acceleration": AVERAGE_ACCELERATION,
    "linear acceleration": LINEAR_ACCELERATION,
    "Fox-Goodwin": FOX_GOODWIN,
    "central difference": CENTRAL_DIFFERENCE,
}


def generalised_alpha(radius: float) -> StepRule:
    """The rule whose spectral radius at infinite frequency is ``radius`` (Chung and Hulbert 1993).

    Unconditionally stable and of second order; 1 loses no energy, 0 kills the highest modes in one step.
    """
    if not 0.0 <= radius <= 1.0:
        raise CaseError(
            f"a spectral radius of {radius} at infinite frequency", code="E-STEP-RULE", limit="0 to 1"
        )
    mass, force = (2.0 * radius - 1.0) / (radius + 1.0), radius / (radius + 1.0)
    return StepRule(0.5 - mass + force, 0.25 * (1.0 - mass + force) ** 2, mass, force)


def stability_limit(rule: StepRule, damping_ratio: float = 0.0) -> float:
    """Largest ``h / T`` of a rule for a mode of period T; infinite for unconditionally stable ones.

    T. J. R. Hughes, The Finite Element Method (2000), Eq. 9.1.22, for Newmark's family; without damping:
    linear acceleration 0.5513, central difference 0.3183, Fox-Goodwin 0.3898.
    """
    if rule.mass or rule.force:
        # the methods of Chung and Hulbert are made to be unconditionally stable
        stable = rule.mass <= rule.force <= 0.5 and rule.beta >= 0.25 + 0.5 * (rule.force - rule.mass) - 1e-12
        return np.inf if stable else np.nan
    short = 0.5 * rule.gamma - rule.beta
    if short <= 1e-15:
        return np.inf
    lag = damping_ratio * (rule.gamma - 0.5)
    return (lag + np.sqrt(short + lag * lag)) / short / (2.0 * np.pi)


def period_error(rule: StepRule, ratio) -> np.ndarray:
    """Relative error of the period of an undamped mode stepped with ``h / T = ratio``, below the limit.

    From the eigenvalues of the step (Bathe, Finite Element Procedures, 2nd ed., section 9.4). Their damping
    is `numerical_damping`.
    """
    ratio = np.asarray(ratio, float)
    return 2.0 * np.pi * ratio / np.abs(np.angle(_principal(rule, ratio))) - 1.0


def numerical_damping(rule: StepRule, ratio) -> np.ndarray:
    """``-ln |z| / arg z`` of an undamped mode stepped with ``h / T = ratio`` (Hughes 2000, section 9.1)."""
    value = _principal(rule, np.asarray(ratio, float))
    return -np.log(np.abs(value)) / np.abs(np.angle(value))


@dataclass(frozen=True)
class RuleScheme:
    """A step rule on all degrees of freedom; the state is (q, v, a), (3, n). See `Scheme`."""

    rule: StepRule
    step: float
    predictor: np.ndarray
    weights: np.ndarray
    balance: np.ndarray
    carried: np.ndarray
    drawn: np.ndarray
    flexibility: np.ndarray
    forces: np.ndarray
    problem: NonlinearSystem
    stiffness: np.ndarray
    rows: np.ndarray
    factorisations: int = 2

    def start(self, q, v, theta, law):
        """State with the acceleration that the equation of motion asks for, and the column forces."""
        from scipy import linalg

        system = self.problem.system
        g, _ = law(0, self.rows @ q)
        force = (
            external_force(self.problem, theta[0])
            - self.problem.damping @ v
            - self.stiffness @ q
            - system.W @ g
        )
        return np.stack([q, v, linalg.solve(system.M, force, assume_a="pos")]), g

    def table(self, theta):
        """Accelerations (n, dofs) that the loads give in n steps."""
        wave = np.array([np.exp(1j * phase_of(theta, f.orders)) for f in self.problem.forces])
        wave = np.vstack([np.ones((1, len(theta))), wave.reshape(-1, len(theta))])
        mixed = (1.0 - self.rule.force) * wave[:, 1:] + self.rule.force * wave[:, :-1]
        return (mixed.T @ self.forces).real

    def free(self, state, g, load):
        """(q, v, a) at the end of the step without the column forces there."""
        both = self.predictor @ state
        acceleration = load - self.balance @ both[3:].ravel()
        if self.rule.force:
            acceleration -= self.rule.force * (self.carried @ g)
        return both[:3] + self.weights * acceleration

    def deflection(self, state, load):
        """Columns (n_c,)."""
        return self.rows @ state[0]

    def finish(self, state, g):
        """(q, v, a) at the end of the step."""
        return state - (self.drawn @ g).reshape(state.shape)

    def columns(self, states, g, theta):
        """(..., n_c)."""
        return states[..., 0, :] @ self.rows.T

    def motion(self, states, g, theta):
        """Displacements, velocities and accelerations (n, dofs)."""
        return states[:, 0], states[:, 1], states[:, 2]

    def local_error(self, states, g):
        """Error of q in every step: ``h^2 (beta - 1/6) da + h^2 (beta / 2 - 1/24) d(da)``.

        The Taylor series of the step against the exact one (Zienkiewicz and Xie, Earthquake Eng. Struct. Dyn.
        20 (1991) 871-887, have its first term).
        """
        change = np.diff(states[:, 2], axis=0)
        bend = np.diff(change, axis=0, prepend=change[:1])
        beta, square = self.rule.beta, self.step * self.step
        error = square * np.abs((beta - 1.0 / 6.0) * change) + square * np.abs(
            (0.5 * beta - 1.0 / 24.0) * bend
        )
        return np.sqrt(np.abs(np.einsum("ti,ij,tj->t", error, self.problem.system.M, error, optimize=True)))


def rule_scheme(problem: NonlinearSystem, rule: StepRule, step: float) -> RuleScheme:
    """Factorise the matrix of a step rule once.

    ``(1 - mass) M + (1 - force) (gamma h C + beta h^2 (K + W c W^T))`` with c the reference stiffnesses.

    Raises
    ------
    ConvergenceError
        The matrix is singular.
    """
    from scipy import linalg

    system, part = problem.system, 1.0 - rule.force
    stiffness, damping = problem.stiffness, problem.damping
    matrix = (1.0 - rule.mass) * system.M + part * step * (
        rule.gamma * damping + rule.beta * step * stiffness
    )
    factor = linalg.lu_factor(matrix, check_finite=True)
    pivots = np.abs(np.diag(factor[0]))
    if not np.all(np.isfinite(pivots)) or pivots.min() <= 1e-14 * pivots.max():
        raise ConvergenceError(
            "the matrix of the time step is singular", code="E-MASS",
            remedy="give every degree of freedom some mass or condense it",
        )  # fmt: skip
    blocks = [stiffness, damping, system.M] if rule.mass else [stiffness, damping]
    predictor = _predictor(rule, step)[: 3 + len(blocks)]
    weights = np.array([rule.beta * step * step, rule.gamma * step, 1.0])[:, None]
    carried = linalg.lu_solve(factor, system.W)
    loads = np.stack([system.load.astype(complex), *(f.force for f in problem.forces)])
    forces = linalg.lu_solve(factor, loads.T).T
    return RuleScheme(
        rule, step, predictor, weights, linalg.lu_solve(factor, np.hstack(blocks)), carried,
        (part * weights[:, None] * carried).reshape(-1, carried.shape[1]),
        part * rule.beta * step * step * (system.W.T @ carried), forces, problem, stiffness,
        np.ascontiguousarray(system.W.T),
    )  # fmt: skip


def highest_frequency(problem: NonlinearSystem, mesh_stiffness) -> float:
    """Largest undamped natural frequency [rad/s] with the given stiffnesses of the columns."""
    from scipy import linalg

    system, n = problem.system, len(problem.system.M)
    total = system.K + (system.W * mesh_stiffness) @ system.W.T
    try:
        value = linalg.eigh(total, system.M, eigvals_only=True, subset_by_index=(n - 1, n - 1))[0]
    except linalg.LinAlgError as error:
        raise mass_error() from error
    return float(np.sqrt(max(value, 0.0)))


class Scheme(Protocol):
    """A rule for one step of a given length.

    ``flexibility`` (n_c, n_c): ``A``. ``start(q, v, theta, law)``: first state and g. ``table(theta)``: from
    phases (n + 1, n_bases) what the loads do in n steps, first axis n. ``free(state, g, load)``: state after
    the step without ``g_1``, ``deflection(state, load)`` its columns, ``finish(state, g_1)`` state with it.
    ``columns(states, g, theta)`` (..., n_c), ``motion(states, g, theta)``: displacements, velocities and,
    where the rule knows them, accelerations (n + 1, n). ``local_error(states, g)`` (n,): estimated error of
    the displacements in the steps, in the norm of the mass matrix.
    """

    flexibility: np.ndarray

    def start(self, q, v, theta, law): ...

    def table(self, theta): ...

    def free(self, state, g, load): ...

    def deflection(self, state, load): ...

    def finish(self, state, g): ...

    def columns(self, states, g, theta): ...

    def motion(self, states, g, theta): ...

    def local_error(self, states, g): ...


@dataclass
class Marched:
    """States of a block of steps, the one before the first included.

    ``states`` (n + 1, ...), ``excess`` (n + 1, n_c) column forces beyond the reference, ``steps`` done,
    ``residual`` the largest violation of the column equations relative to the deflections, ``iterations``.
    """

    states: np.ndarray
    excess: np.ndarray
    steps: int
    residual: float
    iterations: int


def march(scheme, law: Law, loads, state, g, count, *, tolerance, max_iterations, size=0.0) -> Marched:
    """Take ``count`` steps; stops early where the columns do not converge or the numbers overflow.

    Parameters
    ----------
    scheme : Scheme
    law : callable
        Of the instants 0 .. count, from `tabulated_law`; instant 0 is the start.
    loads : (count, ...) array
        From ``scheme.table``.
    state, g : arrays
        At the start.
    count : int
    tolerance : float
        Of the column equations, relative to the largest free deflection so far.
    max_iterations : int
        Newton iterations a step.
    size : float
        Square of the largest free deflection before this block.
    """
    states, excess = np.empty((count + 1, *state.shape)), np.empty((count + 1, len(g)))
    states[0], excess[0] = state, g
    flexibility, unit, worst, total = scheme.flexibility, np.eye(len(g)), 0.0, 0
    free, deflection, finish = scheme.free, scheme.deflection, scheme.finish
    options = tolerance * tolerance, max_iterations
    for i in range(count):
        state = free(state, g, loads[i])
        aim = deflection(state, loads[i])
        size = max(size, float(aim @ aim))
        g, share, size, iterations = _solve_columns(law, i + 1, flexibility, unit, aim, g, size, options)
        total += iterations
        if not share <= options[0]:
            return Marched(states[: i + 1], excess[: i + 1], i, np.inf, total)
        worst = max(worst, share)
        state = finish(state, g)
        states[i + 1], excess[i + 1] = state, g
    return Marched(states, excess, count, float(np.sqrt(worst)), total)


def march_times(problem: NonlinearSystem, scheme, frequency, state, g, *, begin, step, count, **options):
    """Blocks of at most `block_length` steps from ``begin`` [s] on: yields (first step, Marched, phases)."""
    frequency = np.atleast_1d(np.asarray(frequency, float))
    done, size = 0, 0.0
    while done < count:
        number = min(block_length(state), count - done)
        theta = (begin + step * np.arange(done, done + number + 1))[:, None] * frequency
        block = march(
            scheme, tabulated_law(problem, theta), scheme.table(theta), state, g, number, size=size, **options
        )
        yield done, block, theta
        if block.steps < number:
            return
        state, g, done = block.states[-1], block.excess[-1], done + number
        size = max(size, largest_square(scheme.columns(block.states, block.excess, theta)))


def block_length(state) -> int:
    """Steps that are kept in memory together."""
    return int(np.clip(_BLOCK_NUMBERS // state.size, 64, 8192))


def largest_square(x) -> float:
    """Largest ``|x|^2`` over the instants of x (n, n_c)."""
    return float(np.square(x).sum(axis=1).max(initial=0.0))


def _principal(rule: StepRule, ratio) -> np.ndarray:
    """Complex eigenvalue of the amplification matrix of ``a + w^2 q = 0`` in (q, h v, h^2 a)."""
    square = (2.0 * np.pi * np.atleast_1d(ratio)) ** 2
    predict, mix = _predictor(rule, 1.0)[:3], _predictor(rule, 1.0)[3:]
    inertia = 1.0 - rule.mass + (1.0 - rule.force) * rule.beta * square
    taken = -(mix[2] + square[:, None] * mix[0]) / inertia[:, None]
    matrix = predict + np.array([rule.beta, rule.gamma, 1.0])[:, None] * taken[:, None, :]
    values = np.linalg.eigvals(matrix)
    best = np.argmax(np.where(np.abs(values.imag) > 1e-12, np.abs(values), -1.0), axis=1)
    found = values[np.arange(len(values)), best]
    return found.reshape(np.shape(ratio))


def _predictor(rule: StepRule, h: float) -> np.ndarray:
    """Rows on (q, v, a): q, v, a without ``a_1``; then q, v and inertia of the force balance."""
    predict = np.array([[1.0, h, h * h * (0.5 - rule.beta)], [0.0, 1.0, h * (1.0 - rule.gamma)], [0.0] * 3])
    weight = rule.force
    mixed = (1.0 - weight) * predict[:2] + weight * np.eye(3)[:2]
    return np.vstack([predict, mixed, [0.0, 0.0, rule.mass]])


def _solve_columns(law, i, flexibility, unit, aim, g, size, options):
    """Solve ``x + A g(x) = aim`` by Newton iterations that are shortened where they do not help.

    Returns g, the square of the violation relative to ``size``, that size (square of the largest deflection),
    and the number of iterations.
    """
    tolerance, most = options
    x = last = aim - flexibility @ g
    before = np.inf
    for iteration in range(most + 1):
        g, slope = law(i, x)
        error = aim - x - flexibility @ g
        square = float(error @ error)
        if not square < before:
            x, g, slope = _shortened(law, i, flexibility, aim, x, last, before)
            error = aim - x - flexibility @ g
            square = float(error @ error)
        scale = max(size, float(x @ x))
        if square <= tolerance * scale or iteration == most:
            break
        before, last = square, x
        matrix = flexibility * slope if slope.ndim == 1 else flexibility @ slope
        x = x + dgesv(matrix + unit, error)[2]
    return g, square / scale if scale else square, scale, iteration


def _shortened(law, i, flexibility, aim, x, last, before):
    """Half the Newton step until the column equations get better; the last try when none does."""
    for _ in range(30):
        x = 0.5 * (x + last)
        g, slope = law(i, x)
        error = aim - x - flexibility @ g
        if float(error @ error) < before:
            break
    return x, g, slope
