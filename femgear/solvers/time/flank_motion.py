"""Newmark's method for gearboxes through time, with meshes that are linear or separate.

Beside the motion goes the free one without loads, whose growth tells a parametric resonance. It takes the
same steps (`femgear.solvers.time.flank_steps`), with the tangents of the meshes, and is brought back to
size one every few steps; the slope of the logarithm of its size is the largest Lyapunov exponent
(G. Benettin, L. Galgani, A. Giorgilli and J.-M. Strelcyn, Meccanica 15, 1980, 9-30). The weights
exp(-1 / (s (1 - s))) over the run take the oscillation of the size out of the mean (S. Das, Y. Saiki,
E. Sander and J. A. Yorke, Nonlinearity 30, 2017, 4111-4140). With linear meshes at a constant speed it is
the largest Floquet exponent, at any load.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.time.flank_steps import FlankScheme, MeshBlock, Separating, Yielding, march_pairs, solve_overlaps
from femgear.solvers.time.free_turn import FreeTurn, StepBlock, TorqueHistory
from femgear.solvers.time.low_pass import Decimator
from femgear.solvers.time.spun_system import SPRING, SpunSystem

# Errors of the balances, relative, beyond which a run is refused.
BALANCE = 1e-6
# Share of the energy below which works are rounding.
_WORK_ROUNDING = 1e-6

# Steps after which the free motion is brought back to size one.
PIECE = 64
# Sizes that a run gives at least, where it has that many steps.
_SIZES = 30
# Share of the run in which the strongest motion wins.
_START = 1.0 / 3.0

# Stiffness of a parted mesh over its own: bodies that it alone holds stay findable.
_SLIGHT = 1e-12
# Force that this stiffness may carry, over those of the loads.
_CARRIED = 1e-6

# Newton steps for laws in the first state, the shortest one, their accuracy, and springs over those of the laws that
# hold what floats.
_STATIC_STEPS, _SHORTEST, _SETTLED, _SOFT = 200, 1e-3, 1e-11, 1e-9

# Steps whose loads and meshes are made at once.
_BLOCK = 4096


@dataclass(frozen=True)
class Records:
    """What a run keeps of its steps: one record of ``every`` so many.

    With ``lowpass`` they are low-passed (`Decimator`), so that nothing beyond half their rate appears as
    something else; otherwise they are the motion at these instants as it is. ``progress`` is called with the
    share of the steps that are done. The motion has settled after ``settle`` [s].
    """

    every: int = 1
    lowpass: bool = False
    settle: float = 0.0
    progress: Callable[[float], object] = lambda share: None


@dataclass(frozen=True)
class MarchedRun:
    """Motion of a system on a common rotation, recorded every few steps.

    Parameters
    ----------
    time : (n,) array
        [s]
    motion, velocity : (n, n_outputs) arrays
        Deviations from the rigid-body rotation that were asked for [m, rad].
    approach, force : (n, n_meshes) arrays
        Of the drive flanks [m]; of the meshes, drive less back flank [N].
    angle, speed : (n,) arrays
        Of the shaft that gives the speed, without its deviation [rad], [rad/s].
    meshes : tuple of str
        Names of the n_meshes meshes.
    energy_balance : EnergyBalance
        Energies at both ends, and the work between.
    drift : float
        Largest rotation found in the deviations after a block, before it was taken out [rad].
    momentum : float
        Error of the angular momentum about the axis of this shaft, over the largest impulse or momentum.
    steps : int
        Steps taken.
    step : float
        [s]
    extremes : (2, n_meshes) array
        Least and largest force at any step [N], whatever is recorded.
    settled_least : (n_meshes,) array
        Least force at any step after the settling time [N]; infinite where no step comes after it.
    pulling : (n_meshes,) array
        Share of the steps with a negative force: of a linear mesh that pulls, or of a back flank that pushes more
        than the drive flank.
    lost : (n_meshes,) array
        Share of the steps in which no flank touches; zeros where meshes are linear.
    contact_loss : bool
        Whether flanks may part; else the meshes are linear.
    growth : float
        Mean rate of the logarithm of the free motion after the first third of the run [1/s]; NaN where nothing moves
        but the rotation.
    gain : float
        Largest growth of the free motion between any two instants of the run, as a factor; NaN likewise.
    """

    time: np.ndarray
    motion: np.ndarray
    velocity: np.ndarray
    approach: np.ndarray
    force: np.ndarray
    angle: np.ndarray
    speed: np.ndarray
    meshes: tuple[str, ...]
    energy_balance: EnergyBalance
    drift: float
    momentum: float
    steps: int
    step: float
    extremes: np.ndarray
    settled_least: np.ndarray
    pulling: np.ndarray
    lost: np.ndarray
    contact_loss: bool
    growth: float
    gain: float


def march_flanks(
    spun: SpunSystem,
    torques: Sequence[tuple[TorqueHistory, np.ndarray]] = (),
    *,
    duration: float,
    step: float,
    speed: float,
    start: str | tuple[np.ndarray, np.ndarray] = "static",
    outputs: np.ndarray | None = None,
    records: Records = Records(),
    contact_loss: bool = False,
) -> MarchedRun:
    """Integrate the motion of a system on a common rotation in time by average acceleration.

    Parameters
    ----------
    spun : SpunSystem
        What moves.
    torques : sequence of TorqueHistory with (n,) array
        Loads over time, each with the direction along which it acts.
    duration, step : float
        [s]; any step is taken.
    speed : float
        Of the shaft that gives it, at the start [rad/s].
    start : {"static", "zero"} or pair of (n,) arrays
        Deviations [m, rad] and their velocities: static under the first loads, none (loads set in suddenly), or given.
    outputs : (n_outputs, n) array, optional
        Motions to record per unit of the coordinates; all of these when not given.
    contact_loss : bool
        Drive flanks part, and back flanks touch; False lets meshes pull.

    Raises
    ------
    CaseError
        Steps and durations that are none (E-RANGE); loads that part flanks behind which nothing holds the gears
        (E-START).
    ConvergenceError
        The motion outgrows the numbers (E-DIVERGED); no flanks fit a step (E-CONTACT).
    """
    if not 0.0 < step <= duration < np.inf:
        raise CaseError(f"{duration} s in steps of {step} s", code="E-RANGE", limit="0 < step <= duration", key="step")
    count = max(1, round(duration / step))
    spun = spun if contact_loss else spun.kept_together
    turn = FreeTurn(spun, torques, step, speed)
    scheme = FlankScheme.of(spun, step, turn.directions)
    outputs = np.eye(scheme.n) if outputs is None else np.asarray(outputs, float)
    record = _Record(spun, count, records, outputs, step=step, contact_loss=contact_loss)
    with np.errstate(over="ignore", invalid="ignore"):
        motion = _Motion(spun, scheme, turn, start, count, contact_loss)
        balances = _Balances(spun, scheme, turn, motion.state)
        for first in range(0, count, _BLOCK):
            states, block = motion.block(first, min(_BLOCK, count - first))
            balances.add(states, block)
            balances.check(states, block, first, free=motion.free, contact_loss=contact_loss)
            record.take(first, states, block)
            motion.state = balances.without_drift(states[-1])
            records.progress(min(first + _BLOCK, count) / count)
    return MarchedRun(
        **record.columns(step),
        meshes=spun.meshes,
        energy_balance=balances.works(),
        drift=balances.drift,
        momentum=balances.momentum_error(),
        steps=count,
        step=step,
        contact_loss=contact_loss,
        growth=motion.free.growth(),
        gain=motion.free.gain(),
    )


class _Motion:
    """The motion and the free motion beside it, block by block."""

    def __init__(self, spun: SpunSystem, scheme: FlankScheme, turn: FreeTurn, start, count: int, contact_loss: bool):
        self.scheme, self.turn, self.closed = scheme, turn, spun.closed
        # steps between two sizes of the free motion
        self.piece = max(1, min(PIECE, count // _SIZES))
        self.state = _start_state(spun, scheme, turn, start, contact_loss=contact_loss)
        self.free = FreeMotion(spun, scheme)
        self.free_row = self.free.start()
        self.march, self.whole = march_pairs, self.piece % 2 == 0
        if spun.laws:
            self.march, self.whole = (
                Yielding(spun, self.state[: scheme.n] @ scheme.basic, parts=contact_loss).march,
                False,
            )
        elif contact_loss and spun.meshes:
            self.march, self.whole = Separating(spun.side).march, False

    def block(self, first: int, number: int):
        """States (number + 1, 2 n + m) of the next steps, and their loads and meshes."""
        scheme, h = self.scheme, self.turn.step
        block = self.turn.block(first, number)
        meshes = MeshBlock.of(scheme, block, self.closed)
        loads = block.loads[:-1] @ scheme.loads_before + block.loads[1:] @ scheme.loads_after
        rows = np.empty((number + 1, 2, len(scheme.advance)))
        rows[0] = scheme.row(self.state), self.free_row
        ends = np.append(np.arange(self.piece, number, self.piece), number)
        for begin, end in pairwise([0, number] if self.whole else [0, *ends]):
            self.march(scheme, meshes, loads, rows, range(begin, end))
        self.free_row = self.free.renewed(rows[ends, 1], h * (first + ends))
        return scheme.states(rows[:, 0]), block


def _start_state(spun: SpunSystem, scheme: FlankScheme, turn: FreeTurn, start, *, contact_loss: bool) -> np.ndarray:
    """State ``(q, v, g)`` at the first instant."""
    n, U = scheme.n, scheme.basic
    angle, speed = turn.angle, turn.speed
    block = turn.block(0, 1)
    turn.angle, turn.speed = angle, speed
    S, k, gap = block.selection[0], block.stiffness[0], block.gap[0]
    if isinstance(start, str):
        q, v = np.zeros((2, n))
        if start == "static":
            load = spun.without_drive(turn.directions @ block.loads[0])
            q = _static_state(spun, U @ S, k, gap, load, contact_loss=contact_loss)
    else:
        q, v = (np.asarray(array, float) for array in start)
    overlap = (U @ S).T @ q - gap
    pulls = (spun.side == SPRING) | (not contact_loss)
    force = k * np.where(pulls, overlap, np.maximum(overlap, 0.0))
    return np.concatenate([q, v, S @ force + spun.law_forces(U.T @ q)[0]])


def _static_state(spun: SpunSystem, W, k, gap, load, *, contact_loss: bool) -> np.ndarray:
    """Deviations (n,) as `_static_deviations`, with the forces of laws: Newton's method, shortened where it overshoots.

    ConvergenceError: no balance (E-CONVERGENCE).
    """
    if not spun.laws:
        return _static_deviations(spun, W, k, gap, load, contact_loss=contact_loss)
    U, system, springs = spun.basic, spun.system, np.diag(spun.law_springs)
    q, offset, tangent = np.zeros(len(load)), np.zeros(len(springs)), springs
    # forces that are out of balance, none known at first
    rest, left = np.zeros(len(springs)), np.inf
    for _ in range(_STATIC_STEPS):
        softened = replace(system, K=system.K + U @ tangent @ U.T)
        straight = replace(spun, laws=(), system=softened)
        goal = _static_deviations(straight, W, k, gap, load - U @ offset, contact_loss=contact_loss)
        share = 1.0
        while True:
            trial = q + share * (goal - q)
            force, slope = spun.law_forces(U.T @ trial)
            missed = force - (offset + tangent @ (U.T @ trial)) + (1.0 - share) * rest
            if np.abs(missed).max() < left or share < _SHORTEST:
                break
            share *= 0.5
        if share == 1.0 and np.abs(missed).max() <= _SETTLED * max(np.abs(force).max(), np.abs(load).max()):
            return goal
        q, rest, left = trial, missed, float(np.abs(missed).max())
        # what floats in its play is held softly on the way
        tangent = slope + _SOFT * springs
        offset = force - tangent @ (U.T @ q)
    raise ConvergenceError(
        "the first loads find no balance in the bearings with play",
        code="E-CONVERGENCE",
        limit="loads, weight among them, that bearings and meshes carry",
        remedy='a smaller clearance, or start = "zero"',
    )


def _static_deviations(spun: SpunSystem, W, k, gap, load, *, contact_loss: bool) -> np.ndarray:
    """Deviations (n,) under a load that does not drive the rotation, contacts W (n, c) at one instant.

    Drive flanks that part, and back flanks that touch, are found as corrections of drive flanks that all touch.
    """
    closed_first = spun.closed
    front = slice(closed_first)
    flexible = spun.static_flexibility(W[:, front], k[front])
    q = flexible @ (load + W[:, front] @ (k * gap)[front])
    if not contact_loss:
        return q
    free, first = W.T @ q - gap, np.arange(len(k)) < closed_first
    spring = spun.side == SPRING
    if np.array_equal((free >= 0.0) | spring, first):
        return q
    touching, parted = np.where(first, 0.0, k), np.where(first, -(1.0 - _SLIGHT) * k, 0.0)
    drawn = flexible @ W
    u, closed = solve_overlaps(W.T @ drawn, free, first, touching, parted, always=spring)
    loose = _SLIGHT * k * np.abs(u)
    loose[closed | ~first | spring] = 0.0
    held = np.isin(spun.mesh, spun.mesh[closed_first:]) & first
    loose[held] = 0.0
    scale = (k * (np.abs(W).T @ (np.abs(flexible) @ np.abs(load)))).max(initial=0.0)
    if loose.max(initial=0.0) > _CARRIED * scale:
        raise CaseError(
            f"the first loads part the flanks of {spun.meshes[spun.mesh[int(np.argmax(loose))]]}, and nothing else"
            " holds the gears",
            code="E-START",
            limit="loads that close the drive flanks, or a backlash",
            remedy='give torques that press these flanks, a backlash to the mesh, or start = "zero"',
        )
    return q - drawn @ (np.where(closed, touching, parted) * u)


class FreeMotion:
    """Size of the free motion: the root of twice its energy, meshes included and the rotation left out."""

    def __init__(self, spun: SpunSystem, scheme: FlankScheme):
        self.system, self.spin, self.scheme = spun.system, spun.spin, scheme
        self.carried, self.inertia = spun.carried, spun.inertia
        self.times, self.sizes = [0.0], [0.0]

    def start(self) -> np.ndarray:
        """Make the row ``z`` (2 n + m,) of random velocities of like energy."""
        n = self.scheme.n
        state = np.zeros(len(self.scheme.advance))
        state[n : 2 * n] = np.random.default_rng(0).standard_normal(n) / np.sqrt(np.diag(self.system.M))
        return self._scaled(state[None])[0]

    def renewed(self, rows, times) -> np.ndarray:
        """Bring the last of rows (k, 2 n + m) back to size one; all sizes, at times (k,) [s], are kept."""
        state, size = self._scaled(self.scheme.states(rows))
        self.times += times.tolist()
        with np.errstate(divide="ignore"):
            self.sizes += (self.sizes[-1] + np.log(size)).tolist()
        return state

    def _scaled(self, states) -> tuple[np.ndarray, np.ndarray]:
        """Row of the last of some states (k, 2 n + m) at size one, and the sizes of all (k,)."""
        n, system = self.scheme.n, self.system
        q, v, g = states[:, :n], states[:, n : 2 * n], states[:, 2 * n :]
        for part in (q, v):
            part -= np.outer(part @ self.carried / self.inertia, self.spin)
        twice = ((v @ system.M) * v + (q @ system.K) * q).sum(axis=1)
        twice += ((q @ self.scheme.basic) * g).sum(axis=1)
        size = np.sqrt(np.maximum(twice, 0.0))
        state = states[-1]
        return self.scheme.row(state / size[-1] if size[-1] > 0.0 else 0.0 * state), size

    def gain(self) -> float:
        """Find the largest growth between two instants of the run, as a factor; NaN without a free motion.

        ``exp(max over t of (log size(t) - its least value before))``: a resonance that the speed passes
        shows here, though the mean over the run decays. Infinite beyond all numbers.
        """
        sizes = np.array(self.sizes)
        if len(sizes) < 2 or not np.all(np.isfinite(sizes)):
            return float("nan")
        with np.errstate(over="ignore"):
            return float(np.exp((sizes - np.minimum.accumulate(sizes)).max()))

    def growth(self) -> float:
        """Compute the mean rate of log size [1/s] after the first third; NaN without a free motion."""
        times, sizes = np.array(self.times), np.array(self.sizes)
        late = times >= _START * times[-1]
        if np.count_nonzero(late) < 2:
            late[:] = True
        times, sizes = times[late], sizes[late]
        if len(times) < 2 or not np.all(np.isfinite(sizes)):
            return float("nan")
        place = (0.5 * (times[1:] + times[:-1]) - times[0]) / (times[-1] - times[0])
        weight = np.exp(-1.0 / (place * (1.0 - place)))
        return float(weight @ (np.diff(sizes) / np.diff(times)) / weight.sum())


@dataclass(frozen=True)
class EnergyBalance:
    """Energies of a run ``before`` its first step and ``after`` its last [J], and the work in between.

    ``loads`` is the work of torques and weight, ``damping`` and ``meshes`` what these take [J].
    """

    before: float
    after: float
    loads: float
    damping: float
    meshes: float

    @property
    def error(self) -> float:
        """What ``kinetic + strain = work of the torques and weight - damping - meshes`` misses.

        Over the largest of its terms; average acceleration keeps the balance exactly.
        """
        rest = self.after - self.before - self.loads + self.damping + self.meshes
        terms = [self.after - self.before, self.loads, self.damping, self.meshes]
        size = max(*map(abs, terms), _WORK_ROUNDING * self.before, _WORK_ROUNDING * self.after) or 1.0
        return abs(rest) / size


class _Balances:
    """Energy and momentum of the deviations and of the rotation."""

    def __init__(self, spun: SpunSystem, scheme: FlankScheme, turn: FreeTurn, state):
        self.spun, self.scheme, self.turn = spun, scheme, turn
        self.carried = spun.carried
        self.loads = self.damping = self.meshes = self.drift = self.impulse = 0.0
        self.effort = self.swing = self.missed = 0.0
        self.before = self.after = self.energy(state, turn.speed)
        self.momentum = self.first_momentum = self._momentum(state, turn.speed)
        self.largest = abs(self.momentum)

    def energy(self, state, speed: float) -> float:
        """Kinetic energy and strain of a state, without the meshes [J]."""
        n, system = self.scheme.n, self.spun.system
        q, v = state[:n], state[n : 2 * n]
        rotation = 0.5 * self.turn.energy_inertia * speed**2
        return float(0.5 * v @ system.M @ v + 0.5 * q @ system.K @ q + rotation)

    def _momentum(self, state, speed: float) -> float:
        return float(self.carried @ state[self.scheme.n : 2 * self.scheme.n]) + self.turn.energy_inertia * speed

    def add(self, states, block: StepBlock) -> None:
        """Add the works and impulses of a block of steps."""
        n, h, turn = self.scheme.n, self.turn.step, self.turn
        moved = np.diff(states[:, :n], axis=0)
        mean = 0.5 * (block.loads[1:] + block.loads[:-1])
        self.loads += float(np.sum((moved @ turn.directions) * mean))
        half = 0.5 * (block.torque[1:] + block.torque[:-1])
        # exact for a torque that is linear in the step
        self.loads += float(h * half @ (0.5 * (block.speed[1:] + block.speed[:-1])))
        self.damping += float(np.sum((moved @ self.spun.system.C) * moved)) / h
        forces = 0.5 * (states[1:, 2 * n :] + states[:-1, 2 * n :])
        self.meshes += float(np.sum((moved @ self.scheme.basic) * forces))
        self.impulse += float(h * half.sum())
        self.effort += float(h * block.effort.sum())
        self.after = self.energy(states[-1], block.speed[-1])
        self.momentum = self._momentum(states[-1], block.speed[-1])
        self.largest = max(self.largest, abs(self.impulse), abs(self.momentum))
        self.swing = max(self.swing, float(np.abs(self.carried) @ np.abs(states[-1, n : 2 * n])))
        # what is missed by then goes out with the drift; NaN stays
        missed = abs(self.momentum - self.first_momentum - self.impulse)
        self.missed = missed if not missed <= self.missed else self.missed

    def without_drift(self, state):
        """The state less the rotation that rounding has put into the deviations."""
        n, spin = self.scheme.n, self.spun.spin
        angle, rate = (float(self.carried @ part) / self.spun.inertia for part in (state[:n], state[n : 2 * n]))
        self.drift = max(self.drift, abs(angle))
        state = state.copy()
        state[:n] -= angle * spin
        state[n : 2 * n] -= rate * spin
        return state

    def works(self) -> EnergyBalance:
        """Energies up to here."""
        return EnergyBalance(self.before, self.after, self.loads, self.damping, self.meshes)

    def momentum_error(self) -> float:
        """Largest error after any block, over the largest momentum or impulse of the torques."""
        size = max(self.largest, self.effort) or self.swing
        return self.missed / size if self.missed else 0.0

    def check(self, states, block: StepBlock, first: int, *, free: FreeMotion, contact_loss: bool) -> None:
        """Refuse motions that have outgrown the numbers (E-DIVERGED), states (t, 2 n + m) from `first` on."""
        finite = np.isfinite(states).all(axis=1)
        energy, momentum = self.works().error, self.momentum_error()
        if finite.all() and energy <= BALANCE and momentum <= BALANCE:
            return
        last = len(states) - 1 if finite.all() else max(int(np.argmin(finite)) - 1, 0)
        missed = f"energy missed by {energy:.2g}, momentum by {momentum:.2g}" if finite.all() else "overflow"
        remedy = "give more damping, or another speed"
        if not contact_loss:
            remedy += ", or write contact_loss = true: real meshes separate"
        raise ConvergenceError(
            f"the motion has outgrown the numbers by t = {self.turn.step * (first + last):.4g} s ({missed})"
            f"{self._mesh(states[last], block, last)}; the free motion {_rate(free.growth())}",
            code="E-DIVERGED",
            limit=f"balances of energy and momentum to {BALANCE:g}",
            remedy=remedy,
        )

    def _mesh(self, state, block: StepBlock, last: int) -> str:
        """The mesh with the most strain energy."""
        if not self.spun.meshes:
            return ""
        # of size one, so that its square is finite
        approach = (state[: self.scheme.n] @ self.scheme.basic) @ block.selection[last]
        strain = block.stiffness[last] * (approach / max(np.abs(approach).max(), 1e-300)) ** 2
        return f", most in mesh {self.spun.meshes[int(np.argmax(strain[self.spun.drives]))]}"


def _rate(growth: float) -> str:
    if not np.isfinite(growth):
        return "is not known"
    if growth <= 0.0:
        return f"decays with {-growth:.4g} 1/s: the loads are too large"
    return f"grows with {growth:.4g} 1/s: a parametric resonance"


class _Record:
    """What a run keeps: motions, meshes, rotation."""

    def __init__(
        self, spun: SpunSystem, count: int, records: Records, outputs: np.ndarray, *, step: float, contact_loss: bool
    ):
        self.spun, self.every, self.outputs, self.parts = spun, records.every, outputs.T, contact_loss
        rows, meshes = count // self.every + 1, len(spun.meshes)
        widths = [len(outputs), len(outputs), meshes, meshes, 1, 1]
        self.cuts = np.cumsum(widths)[:-1]
        self.table = np.empty((rows, sum(widths)))
        self.decimator = Decimator(self.every, count) if records.lowpass and self.every > 1 else None
        self.filled, self.steps = 0, 0
        self.extremes = np.array([np.full(meshes, np.inf), np.full(meshes, -np.inf)])
        self.pulled, self.lost = np.zeros((2, meshes))
        self.settled_from, self.settled_least = records.settle / step, np.full(meshes, np.inf)

    def take(self, first: int, states, block: StepBlock) -> None:
        """Rows of the states and the `StepBlock` of some steps; that of their start with the first one alone."""
        begin, spun, n = min(first, 1), self.spun, len(self.outputs)
        approach = np.einsum("tmj,tm->tj", block.selection, states[:, :n] @ spun.basic)
        force = spun.mesh_forces(approach, block.stiffness, block.gap, parts=self.parts)
        touched = spun.touching(approach, block.gap) if self.parts else np.ones((len(force), 1), bool)
        self._count(force[begin:], touched[begin:])
        settled = first + np.arange(len(force)) >= self.settled_from - 1e-9
        self.settled_least = np.minimum(self.settled_least, force[settled].min(axis=0, initial=np.inf))
        if self.decimator is None:
            at = (-first % self.every) or self.every if first else 0
            kept = slice(at, None, self.every)
        else:
            kept = slice(begin, None)
        motion, velocity = states[kept, :n] @ self.outputs, states[kept, n : 2 * n] @ self.outputs
        rotation = block.angle[kept, None], block.speed[kept, None]
        new = np.hstack([motion, velocity, approach[kept][:, spun.drives], force[kept], *rotation])
        if self.decimator is not None:
            new = self.decimator.push(new)
        self.table[self.filled : self.filled + len(new)] = new
        self.filled += len(new)

    def _count(self, force, touched) -> None:
        self.extremes[0] = np.minimum(self.extremes[0], force.min(axis=0, initial=np.inf))
        self.extremes[1] = np.maximum(self.extremes[1], force.max(axis=0, initial=-np.inf))
        self.pulled += np.count_nonzero(force < 0.0, axis=0)
        self.lost += np.count_nonzero(~touched, axis=0)
        self.steps += len(force)

    def columns(self, step: float) -> dict[str, np.ndarray]:
        """Fields of a `MarchedRun` by their names, with the shapes that stand there."""
        *tables, angle, speed = np.split(self.table, self.cuts, axis=1)
        names = ("motion", "velocity", "approach", "force")
        return {
            **{name: np.ascontiguousarray(table) for name, table in zip(names, tables)},
            "time": step * self.every * np.arange(len(self.table)),
            "angle": angle[:, 0].copy(),
            "speed": speed[:, 0].copy(),
            "extremes": self.extremes,
            "settled_least": self.settled_least,
            "pulling": self.pulled / self.steps,
            "lost": self.lost / self.steps,
        }
