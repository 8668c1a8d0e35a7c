"""Fixed time steps: Newmark's family, the generalised-alpha method and steps of the modes that are exact.

Every scheme is a linear map of the state and of the column forces: ``x_1 = x_free - A g_1`` with x the
deflections of the columns at the end of the step, ``g = f - c x`` their forces beyond the reference stiffness
and ``A`` a matrix of n_columns rows that does not change. The linear system is stepped exactly or by a rule,
and only these few equations are solved by Newton iterations (`march`).

Rules on all coordinates: N. M. Newmark, J. Eng. Mech. Div. ASCE 85 (1959) 67-94; J. Chung and G. M. Hulbert,
J. Appl. Mech. 60 (1993) 371-375; forces that are not linear averaged as loads are: S. Erlicher,
L. Bonaventura and O. S. Bursi, Comput. Mech. 28 (2002) 83-104.

Modal steps are exact for forces that are linear between the instants, so that a linear system has no period
error and no damping of the step; the column forces beyond the reference stiffness are of second order. Modes
that are left out count as static flexibility. N. C. Nigam and P. C. Jennings, Bull. Seism. Soc. Am. 59 (1969)
909-922; A. K. Chopra, Dynamics of Structures, section 5.2. Their coefficients are taken from one matrix
exponential (C. F. Van Loan, IEEE Trans. Autom. Control 23 (1978) 395-404), which also covers rigid,
critically and overdamped modes without cancellation.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import linalg
from scipy.linalg import expm, get_lapack_funcs

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.linear.modal import mass_error, output_load, residual_output, undamped_modes
from femgear.system.fourier import phase_of
from femgear.system.system import Law, NonlinearSystem, external_force, tabulated_law

# Numbers held in the states of one block of steps.
_BLOCK_NUMBERS = 2_000_000
# LU solution of small systems without the checks of `scipy.linalg.solve`, which cost more than it.
(_gesv,) = get_lapack_funcs(("gesv",), dtype=np.float64)


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
                f"a step rule with gamma = {self.gamma}, beta = {self.beta}",
                code="E-RANGE",
                limit="finite numbers, beta of 0 or more, weights below 1",
            )
        # below this the rule feeds energy in at every step length
        if self.gamma < 0.5 - self.mass + self.force - 1e-12:
            raise CaseError(
                f"a step rule with gamma = {self.gamma} has negative damping",
                code="E-RANGE",
                limit=f"gamma of {0.5 - self.mass + self.force:.4g} or more",
                remedy="take gamma = 1/2",
            )

    def predictor(self, h: float) -> np.ndarray:
        """Make rows (6, 3) on (q, v, a) for a step h [s].

        q, v and a without ``a_1``, then q, v and inertia of the force balance.
        """
        predict = np.array([[1.0, h, h * h * (0.5 - self.beta)], [0.0, 1.0, h * (1.0 - self.gamma)], [0.0] * 3])
        mixed = (1.0 - self.force) * predict[:2] + self.force * np.eye(3)[:2]
        return np.vstack([predict, mixed, [0.0, 0.0, self.mass]])


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
    """Make the rule whose spectral radius at infinite frequency is ``radius`` (Chung and Hulbert 1993).

    Unconditionally stable and of second order; 1 loses no energy, 0 kills the highest modes in one step.
    """
    if not 0.0 <= radius <= 1.0:
        raise CaseError(f"a spectral radius of {radius} at infinite frequency", code="E-RANGE", limit="0 to 1")
    mass, force = (2.0 * radius - 1.0) / (radius + 1.0), radius / (radius + 1.0)
    return StepRule(0.5 - mass + force, 0.25 * (1.0 - mass + force) ** 2, mass, force)


def stability_limit(rule: StepRule) -> float:
    """Find the largest stable ``h / T`` of a rule for an undamped mode of period T; infinite where any is.

    T. J. R. Hughes, The Finite Element Method (2000), Eq. 9.1.22, for Newmark's family: linear acceleration
    0.5513, central difference 0.3183, Fox-Goodwin 0.3898. `generalised_alpha` makes rules that are
    unconditionally stable.
    """
    short = 0.5 * rule.gamma - rule.beta
    if rule.mass or rule.force or short <= 1e-15:
        return np.inf
    return np.sqrt(short) / short / (2.0 * np.pi)


class RuleScheme:
    """A step rule on all degrees of freedom; the state is (q, v, a), (3, n). See `Scheme`.

    ``(1 - mass) M + (1 - force) (gamma h C + beta h^2 (K + W c W^T))``, with c the reference stiffnesses, is
    factorised once; a singular one is refused (E-MASS).
    """

    factorisations = 2

    def __init__(self, problem: NonlinearSystem, rule: StepRule, step: float):
        system, part = problem.system, 1.0 - rule.force
        stiffness, damping = problem.stiffness, problem.damping
        matrix = (1.0 - rule.mass) * system.M + part * step * (rule.gamma * damping + rule.beta * step * stiffness)
        factor = linalg.lu_factor(matrix, check_finite=True)
        pivots = np.abs(np.diag(factor[0]))
        if not np.all(np.isfinite(pivots)) or pivots.min() <= 1e-14 * pivots.max():
            raise ConvergenceError(
                "the matrix of the time step is singular",
                code="E-MASS",
                remedy="give every degree of freedom some mass or condense it",
            )
        blocks = [stiffness, damping, system.M] if rule.mass else [stiffness, damping]
        loads = np.stack([system.load.astype(complex), *(f.force for f in problem.forces)])
        self.problem, self.rule, self.step, self.stiffness = problem, rule, step, stiffness
        self.rows = np.ascontiguousarray(system.W.T)
        self.predictor = rule.predictor(step)[: 3 + len(blocks)]
        self.weights = np.array([rule.beta * step * step, rule.gamma * step, 1.0])[:, None]
        self.balance = linalg.lu_solve(factor, np.hstack(blocks))
        self.carried = linalg.lu_solve(factor, system.W)
        self.drawn = (part * self.weights[:, None] * self.carried).reshape(-1, self.carried.shape[1])
        self.flexibility = part * rule.beta * step * step * (system.W.T @ self.carried)
        self.forces = linalg.lu_solve(factor, loads.T).T

    def start(self, q, v, theta, law):
        """Make the state, with the acceleration that the equation of motion asks for, and column forces."""
        system = self.problem.system
        g, _ = law(0, self.rows @ q)
        force = external_force(self.problem, theta[0]) - self.problem.damping @ v - self.stiffness @ q - system.W @ g
        return np.stack([q, v, linalg.solve(system.M, force, assume_a="pos")]), g

    def table(self, theta):
        """Compute the accelerations (n, dofs) [m/s^2] that the loads give in n steps."""
        wave = _load_waves(self.problem, theta)
        mixed = (1.0 - self.rule.force) * wave[:, 1:] + self.rule.force * wave[:, :-1]
        return np.real(mixed.T @ self.forces)

    def free(self, state, g, load):
        both = self.predictor @ state
        acceleration = load - self.balance @ both[3:].ravel()
        if self.rule.force:
            acceleration -= self.rule.force * (self.carried @ g)
        return both[:3] + self.weights * acceleration

    def deflection(self, state, load):
        return self.rows @ state[0]

    def finish(self, state, g):
        return state - (self.drawn @ g).reshape(state.shape)

    def columns(self, states, g, theta):
        return states[..., 0, :] @ self.rows.T

    def motion(self, states, g, theta):
        return states[:, 0], states[:, 1], states[:, 2]

    def local_error(self, states, g):
        """Estimate the error of q in every step: ``h^2 (beta - 1/6) da + h^2 (beta / 2 - 1/24) d(da)``.

        The Taylor series of the step against the exact one (Zienkiewicz and Xie, Earthquake Eng. Struct. Dyn.
        20 (1991) 871-887, have its first term).
        """
        change = np.diff(states[:, 2], axis=0)
        bend = np.diff(change, axis=0, prepend=change[:1])
        beta, square = self.rule.beta, self.step * self.step
        error = square * np.abs((beta - 1.0 / 6.0) * change) + square * np.abs((0.5 * beta - 1.0 / 24.0) * bend)
        return np.sqrt(np.abs(np.einsum("ti,ij,tj->t", error, self.problem.system.M, error, optimize=True)))


class ModalScheme:
    """Exact steps of modes with the reference stiffnesses of the columns; the state is (y, v), (2, m).

    See `Scheme`. Damping that couples the modes, gyroscopic terms and negative reference stiffnesses are
    refused, see `undamped_modes`.
    """

    factorisations = 1

    def __init__(self, problem: NonlinearSystem, step: float, *, count: int | None = None):
        system = problem.system
        if system.gyroscopic is not None and problem.speed and np.any(system.gyroscopic):
            raise CaseError(
                "modal steps cannot carry gyroscopic terms",
                code="E-CHOICE",
                key="method",
                remedy='take method "average acceleration" or "generalised alpha"',
            )
        system = replace(system, gyroscopic=None)
        modes = undamped_modes(system, problem.reference, count=count)
        natural, every = 2.0 * np.pi * modes.frequency, np.eye(len(system.M))
        transition, first, last = step_matrices(natural, modes.damping_ratio, step)
        self.problem, self.step, self.modes, self.rows = problem, step, modes, modes.mesh_deflection
        self.transition, self.first, self.last = (
            np.ascontiguousarray(transition.transpose(1, 2, 0)),
            first.T,
            last.T,
        )
        self.pushed, self.drawn = (
            (part[:, :, None] * self.rows.T).reshape(-1, len(self.rows)) for part in (first.T, last.T)
        )
        self.residual = residual_output(system, modes, every)
        self.flexibility = self.rows @ self.drawn[: len(natural)] + system.W.T @ self.residual
        loads, static = [modes.modal_load], [output_load(system, modes, every)]
        for force in problem.forces:
            loads.append(modes.shape.T @ force.force)
            real, imaginary = (
                output_load(replace(system, load=part), modes, every)
                for part in (np.real(force.force), np.imag(force.force))
            )
            static.append(real + 1j * imaginary)
        elastic = np.where(natural > 0.0, natural, np.inf)
        self.loads = np.array(loads, complex)
        self.static = np.array(static) - (self.loads / elastic**2) @ modes.shape.T
        self.static_columns = self.static @ system.W

    def start(self, q, v, theta, law):
        """Make the modal state of a motion; the part of modes that are left out is dropped."""
        carried = self.problem.system.M @ self.modes.shape
        state = np.stack([q @ carried, v @ carried])
        x = self.rows @ state[0] + np.real(self._waves(theta[:1]) @ self.static_columns)[0]
        g, _ = law(0, x)
        return state, g

    def _waves(self, theta) -> NDArray[np.complex128]:
        return _load_waves(self.problem, theta).T

    def table(self, theta):
        """Compute what loads add in n steps, (n, 2 m + n_c): to y and v, then to the columns at the ends."""
        wave = self._waves(theta)
        modal = np.real(wave @ self.loads)
        push = modal[:-1, None] * self.first + modal[1:, None] * self.last
        static = np.real(wave[1:] @ self.static_columns)
        return np.hstack([push.reshape(len(push), -1), static])

    def free(self, state, g, load):
        out = (self.transition * state).sum(axis=1)
        out -= (self.pushed @ g).reshape(out.shape)
        out += load[: out.size].reshape(out.shape)
        return out

    def deflection(self, state, load):
        """Compute the columns (n_c,) [m] but for the static flexibility under their own forces."""
        return self.rows @ state[0] + load[state.size :]

    def finish(self, state, g):
        return state - (self.drawn @ g).reshape(state.shape)

    def columns(self, states, g, theta):
        static_answer = self.problem.system.W.T @ self.residual
        return states[..., 0, :] @ self.rows.T - g @ static_answer + np.real(self._waves(theta) @ self.static_columns)

    def motion(self, states, g, theta):
        """Compute displacements and velocities (n, dofs); modes left out count in displacements only."""
        static = np.real(self._waves(theta) @ self.static) - g @ self.residual.T
        return states[:, 0] @ self.modes.shape.T + static, states[:, 1] @ self.modes.shape.T, None

    def local_error(self, states, g):
        """Estimate by modal norm what a parabola through three column forces would add: ``drawn d(dg) / 12``.

        The linear interpolation misses ``g'' t (h - t) / 2``, whose mean is ``h^2 g'' / 12``.
        """
        if len(g) < 3:
            return np.zeros(len(g) - 1)
        bend = np.diff(g, n=2, axis=0)
        bend = np.vstack([bend[:1], bend])
        return np.linalg.norm(bend @ (self.drawn + self.pushed)[: len(self.rows.T)].T, axis=1) / 12.0


def step_matrices(natural, damping_ratio, step: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compute the exact step of ``y'' + 2 zeta w y' + w^2 y = p`` with p linear in it, state ``(y, v)``.

    Of natural frequencies w (m,) [rad/s], zero for rigid modes, damping ratios zeta (m,), above one too, and
    a step [s]: transition (m, 2, 2), first (m, 2) and last (m, 2) of
    ``state_1 = transition state_0 + first p_0 + last p_1``.
    """
    natural = np.asarray(natural, float)
    turn, scale = natural * step, np.array([1.0, 1.0 / step])
    matrix = np.zeros((len(natural), 4, 4))
    matrix[:, 0, 1] = matrix[:, 1, 2] = matrix[:, 2, 3] = 1.0
    matrix[:, 1, 0], matrix[:, 1, 1] = -turn * turn, -2.0 * np.asarray(damping_ratio) * turn
    # in (y, h v, h^2 p, h^2 change of p) and the time t / h
    exact = expm(matrix)[:, :2]
    transition = scale[:, None] * exact[:, :, :2] / scale
    constant, ramp = exact[:, :, 2] * scale * step**2, exact[:, :, 3] * scale * step**2
    return transition, constant - ramp, ramp


def highest_frequency(problem: NonlinearSystem, mesh_stiffness) -> float:
    """Find the largest undamped natural frequency [rad/s] with column stiffnesses (n_columns,) [N/m]."""
    system, n = problem.system, len(problem.system.M)
    total = system.K + (system.W * mesh_stiffness) @ system.W.T
    try:
        value = linalg.eigh(total, system.M, eigvals_only=True, subset_by_index=(n - 1, n - 1))[0]
    except linalg.LinAlgError as error:
        raise mass_error() from error
    return float(np.sqrt(max(value, 0.0)))


class Scheme(Protocol):
    """A rule for one step of a given length [s], with its matrices factorised.

    ``flexibility`` (n_c, n_c) [m/N]: ``A``. ``start(q, v, theta, law)``: first state and g (n_c,) [N] of a
    motion (dofs,) [m, m/s]. ``table(theta)``: from phases (n + 1, n_bases) [rad] what the loads do in n
    steps, first axis n. ``free(state, g, load)``: state after the step without ``g_1``,
    ``deflection(state, load)`` its columns (n_c,) [m], ``finish(state, g_1)`` state with it.
    ``columns(states, g, theta)`` (..., n_c) [m], ``motion(states, g, theta)``: displacements, velocities and,
    where the rule knows them, accelerations (n + 1, dofs) [m, m/s, m/s^2]. ``local_error(states, g)`` (n,):
    estimated error of the displacements in the steps, in the norm of the mass matrix [m kg^1/2].
    """

    step: float
    factorisations: int
    flexibility: np.ndarray

    def start(self, q, v, theta, law: Law) -> tuple[np.ndarray, np.ndarray]: ...

    def table(self, theta) -> np.ndarray: ...

    def free(self, state, g, load) -> np.ndarray: ...

    def deflection(self, state, load) -> np.ndarray: ...

    def finish(self, state, g) -> np.ndarray: ...

    def columns(self, states, g, theta) -> np.ndarray: ...

    def motion(self, states, g, theta) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]: ...

    def local_error(self, states, g) -> np.ndarray: ...


@dataclass
class Marched:
    """States of a block of steps, the one before the first included.

    ``states`` (n + 1, ...), ``excess`` (n + 1, n_c) [N] column forces beyond the reference, ``steps`` done,
    ``residual`` the largest violation of the column equations relative to the deflections, ``iterations``.
    """

    states: np.ndarray
    excess: np.ndarray
    steps: int
    residual: float
    iterations: int


def march(scheme: Scheme, law: Law, loads, state, g, count, *, tolerance, max_iterations, size=0.0) -> Marched:
    """Take ``count`` steps; stops early where the columns do not converge or the numbers overflow.

    Parameters
    ----------
    law : callable
        Of the instants 0 .. count, from `tabulated_law`; instant 0 is the start.
    loads : (count, ...) array
        From ``scheme.table``.
    state, g : (...), (n_c,) arrays
        State of the scheme and column forces beyond the reference [N] at the start.
    tolerance : float
        Of the column equations, relative to the largest free deflection so far.
    max_iterations : int
        Newton iterations a step.
    size : float
        Square of the largest free deflection before this block [m^2].
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


def march_times(
    problem: NonlinearSystem, scheme: Scheme, frequency, state, g, *, begin, step, count, **options
) -> Iterator[tuple[int, Marched, np.ndarray]]:
    """March ``count`` steps of length ``step`` [s] from ``begin`` [s] on, in blocks that fit in memory.

    From a state and its column forces g (n_c,) of ``scheme.start``, at base frequencies (n_bases,) [rad/s];
    options are those of `march`. Yields (first step, Marched, phases (n + 1, n_bases)).
    """
    frequency = np.atleast_1d(np.asarray(frequency, float))
    block_length = int(np.clip(_BLOCK_NUMBERS // state.size, 64, 8192))
    done, size = 0, 0.0
    while done < count:
        number = min(block_length, count - done)
        theta = (begin + step * np.arange(done, done + number + 1))[:, None] * frequency
        block = march(
            scheme, tabulated_law(problem, theta), scheme.table(theta), state, g, number, size=size, **options
        )
        yield done, block, theta
        if block.steps < number:
            return
        state, g, done = block.states[-1], block.excess[-1], done + number
        x = scheme.columns(block.states, block.excess, theta)
        size = max(size, float(np.square(x).sum(axis=1).max(initial=0.0)))


def _load_waves(problem: NonlinearSystem, theta) -> NDArray[np.complex128]:
    """Amplitude one of the constant load and ``exp(i phase)`` of the harmonic forces, (1 + n_forces, n)."""
    wave = np.array([np.exp(1j * phase_of(theta, f.orders)) for f in problem.forces])
    return np.vstack([np.ones((1, len(theta)), np.complex128), wave.reshape(-1, len(theta))])


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
        x = x + _gesv(matrix + unit, error)[2]
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
