"""Newmark's method for a drivetrain through time, with meshes that are linear or separate.

Beside the motion goes the free one without loads, whose growth tells a parametric resonance. It takes the
same steps (`femgear.trains.drivetrain.integrator`), with the tangents of the meshes, and is brought back to
size one every few steps; the slope of the logarithm of its size is the largest Lyapunov exponent
(G. Benettin, L. Galgani, A. Giorgilli and J.-M. Strelcyn, Meccanica 15, 1980, 9-30). The weights
exp(-1 / (s (1 - s))) over the run take the oscillation of the size out of the mean (S. Das, Y. Saiki,
E. Sander and J. A. Yorke, Nonlinearity 30, 2017, 4111-4140). With linear meshes at a constant speed it is
the largest Floquet exponent, at any load.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from femgear.errors import CaseError, ConvergenceError
from femgear.trains.drivetrain.integrator import (
    ChainScheme,
    MeshBlock,
    Separating,
    Spin,
    StepBlock,
    march_pairs,
    solve_overlaps,
)
from femgear.trains.drivetrain.kinematics import FlankContacts
from femgear.trains.drivetrain.model import DrivetrainModel, contact_model, static_flexibility
from femgear.trains.drivetrain.parts import TorqueHistory

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

# The pass band ends at this share of half the record rate, where the stop band begins.
PASS_BAND = 0.8
# Attenuation of the stop band [dB].
_STOP = 80.0

# Steps whose loads and meshes are made at once.
_BLOCK = 4096


@dataclass(frozen=True)
class Records:
    """What a run keeps of its steps: one record of ``every`` so many.

    With ``lowpass`` they are low-passed (`Decimator`), so that nothing beyond half their rate appears as
    something else; otherwise they are the motion at these instants as it is. ``told`` is called with the
    share of the steps that are done.
    """

    every: int = 1
    lowpass: bool = False
    told: Callable[[float], object] = lambda share: None


@dataclass(frozen=True)
class DrivetrainRun:
    """Motion of a drivetrain, recorded every few steps.

    Parameters
    ----------
    time : (n,) array
        [s]
    outputs : tuple of str
        Names of the n_outputs motions recorded.
    motion, velocity : (n, n_outputs) arrays
        Deviations from the free spin [m, rad].
    approach, force : (n, n_meshes) arrays
        Of the drive flanks [m]; of the meshes, drive less back flank [N].
    spin, spin_speed : (n,) arrays
        Angle and speed of the first body without its deviation [rad], [rad/s].
    meshes : tuple of str
        Names of the n_meshes meshes.
    energy_balance : EnergyBalance
        Energies at both ends, and the work between.
    drift : float
        Largest spin found in the deviations after a block, before it was taken out [rad].
    momentum : float
        Error of the angular momentum about the first body's axis, over the largest impulse or momentum.
    steps : int
        Steps taken.
    step : float
        [s]
    extremes : (2, n_meshes) array
        Least and largest force at any step [N], whatever is recorded.
    pulling : (n_meshes,) array
        Share of the steps with a negative force: of a linear mesh that pulls, or of a back flank that pushes
        more than the drive flank.
    lost : (n_meshes,) array
        Share of the steps in which no flank touches; zeros where meshes are linear.
    contact_loss : bool
        Whether flanks may part; else the meshes are linear.
    growth : float
        Mean rate of the logarithm of the free motion after the first third of the run [1/s]; NaN where
        nothing moves but the spin.
    gain : float
        Largest growth of the free motion between any two instants of the run, as a factor; NaN likewise.
    """

    time: np.ndarray
    outputs: tuple[str, ...]
    motion: np.ndarray
    velocity: np.ndarray
    approach: np.ndarray
    force: np.ndarray
    spin: np.ndarray
    spin_speed: np.ndarray
    meshes: tuple[str, ...]
    energy_balance: EnergyBalance
    drift: float
    momentum: float
    steps: int
    step: float
    extremes: np.ndarray
    pulling: np.ndarray
    lost: np.ndarray
    contact_loss: bool
    growth: float
    gain: float


def march_drivetrain(
    model: DrivetrainModel,
    torques: Sequence[TorqueHistory],
    *,
    duration: float,
    step: float,
    speed: float,
    start="static",
    outputs: Sequence[str] | None = None,
    records: Records = Records(),
    contact_loss: bool = False,
) -> DrivetrainRun:
    """Integrate the motion of a drivetrain in time by average acceleration.

    Parameters
    ----------
    duration, step : float
        [s]. Any step is taken; cases are refused below four steps a mesh period
        (`femgear.trains.drivetrain.checks.check_drivetrain`, E-RATE), and warned of below thirty and of modes
        that the step lowers (W-RATE).
    speed : float
        Of the first body at the start [rad/s]; gyroscopic terms keep this value.
    start : {"static", "zero"} or pair of (n,) arrays
        Deviations [m, rad] and their velocities: static under the first loads, none (loads set in suddenly),
        or given.
    outputs : sequence of str, optional
        Coordinates to record; all rotations when not given.
    contact_loss : bool
        Drive flanks part, and back flanks touch after the backlash; False lets meshes pull.

    Raises
    ------
    CaseError
        Steps and durations that are none (E-RANGE); loads that part flanks behind which nothing holds the
        gears (E-START).
    ConvergenceError
        The motion outgrows the numbers (E-DIVERGED); no flanks fit a step (E-CONTACT).
    """
    if not 0.0 < step <= duration < np.inf:
        raise CaseError(f"{duration} s in steps of {step} s", code="E-RANGE", limit="0 < step <= duration", key="step")
    count = max(1, round(duration / step))
    stepped = contact_model(model) if contact_loss else model
    spin = Spin(stepped, torques, step, speed)
    scheme = ChainScheme.of(stepped, step, speed, spin.directions)
    if outputs is None:
        outputs = [name for name in model.system.dofs if name.endswith("rotation")]
    at = np.array([model.index(name) for name in outputs], int)
    record = _Record(model, count, records, at, contact_loss=contact_loss)
    with np.errstate(over="ignore", invalid="ignore"):
        motion = _Motion(model, scheme, spin, start, count, contact_loss)
        balances = _Balances(stepped, scheme, spin, motion.state)
        for first in range(0, count, _BLOCK):
            states, block = motion.block(first, min(_BLOCK, count - first))
            balances.add(states, block)
            balances.check(states, block, first, free=motion.free, contact_loss=contact_loss)
            record.take(first, states, block)
            motion.state = balances.without_drift(states[-1])
            records.told(min(first + _BLOCK, count) / count)
    return DrivetrainRun(
        outputs=tuple(outputs),
        **record.columns(step),
        meshes=model.meshes,
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

    def __init__(self, model: DrivetrainModel, scheme: ChainScheme, spin: Spin, start, count: int, contact_loss):
        self.scheme, self.spin, self.meshes = scheme, spin, len(model.meshes)
        # steps between two sizes of the free motion
        self.piece = max(1, min(PIECE, count // _SIZES))
        self.state = _start_state(model, scheme, spin, start, model.contacts if contact_loss else None)
        self.free = FreeMotion(model, scheme)
        self.free_row = self.free.start()
        self.march, self.whole = march_pairs, self.piece % 2 == 0
        if contact_loss and model.meshes:
            self.march, self.whole = Separating(model.contacts.gap, self.meshes).march, False

    def block(self, first: int, number: int):
        """States (number + 1, 2 n + m) of the next steps, and their loads and meshes."""
        scheme, h = self.scheme, self.spin.step
        block = self.spin.block(first, number)
        meshes = MeshBlock.of(scheme, block, self.meshes)
        loads = block.loads[:-1] @ scheme.loads_before + block.loads[1:] @ scheme.loads_after
        rows = np.empty((number + 1, 2, len(scheme.advance)))
        rows[0] = scheme.row(self.state), self.free_row
        ends = np.append(np.arange(self.piece, number, self.piece), number)
        for begin, end in pairwise([0, number] if self.whole else [0, *ends]):
            self.march(scheme, meshes, loads, rows, range(begin, end))
        self.free_row = self.free.renewed(rows[ends, 1], h * (first + ends))
        return scheme.states(rows[:, 0]), block


def _start_state(
    model: DrivetrainModel, scheme: ChainScheme, spin: Spin, start, contacts: FlankContacts | None
) -> np.ndarray:
    """State ``(q, v, g)`` at the first instant; with `contacts` meshes separate."""
    n, U = scheme.n, scheme.basic
    angle, speed = spin.angle, spin.speed
    block = spin.block(0, 1)
    spin.angle, spin.speed = angle, speed
    S, k = block.selection[0], block.stiffness[0]
    if isinstance(start, str):
        q, v = np.zeros((2, n))
        if start == "static":
            load = spin.directions @ block.loads[0]
            load = load - spin.carried * (model.rigid @ load) / spin.inertia
            q = _static_deviations(model, U @ S, k, load, contacts)
    else:
        q, v = (np.asarray(array, float) for array in start)
    approach = (U @ S).T @ q
    force = k * (approach if contacts is None else np.maximum(approach - contacts.gap, 0.0))
    return np.concatenate([q, v, S @ force])


def _static_deviations(model: DrivetrainModel, W, k, load, contacts: FlankContacts | None) -> np.ndarray:
    """Deviations (n,) under a load that does not drive the spin, meshes or contacts W (n, c) at one instant.

    Drive flanks that part, and back flanks that touch, are found as corrections of drive flanks that all
    touch.
    """
    meshes = len(model.meshes)
    stiffness, flexible = k[:meshes], static_flexibility(model, W[:, :meshes], k[:meshes])
    q = flexible @ load
    if contacts is None:
        return q
    free, first = W.T @ q - contacts.gap, np.arange(len(k)) < meshes
    if np.array_equal(free >= 0.0, first):
        return q
    touching, parted = np.where(first, 0.0, k), np.where(first, -(1.0 - _SLIGHT) * k, 0.0)
    drawn = flexible @ W
    u, closed = solve_overlaps(W.T @ drawn, free, first, touching, parted)
    loose = _SLIGHT * stiffness * np.abs(u[:meshes])
    loose[closed[:meshes] | np.isfinite(model.backlash)] = 0.0
    scale = (k * (np.abs(W).T @ (np.abs(flexible) @ np.abs(load)))).max()
    if loose.max() > _CARRIED * scale:
        raise CaseError(
            f"the first loads part the flanks of {model.meshes[int(np.argmax(loose))]}, and nothing else"
            " holds the gears",
            code="E-START",
            key="operation.torque",
            limit="loads that close the drive flanks, or a backlash",
            remedy='name the driver of the stage that these loads press, give the mesh a backlash, or start = "zero"',
        )
    return q - drawn @ (np.where(closed, touching, parted) * u)


class FreeMotion:
    """Size of the free motion: the root of twice its energy, meshes included and the spin left out."""

    def __init__(self, model: DrivetrainModel, scheme: ChainScheme):
        self.system, self.rigid, self.scheme = model.system, model.rigid, scheme
        self.carried, self.inertia = model.system.M @ model.rigid, model.inertia
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
            part -= np.outer(part @ self.carried / self.inertia, self.rigid)
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
    """Energy and momentum of the deviations and of the spin."""

    def __init__(self, model: DrivetrainModel, scheme: ChainScheme, spin: Spin, state):
        self.model, self.scheme, self.spin = model, scheme, spin
        self.carried = model.system.M @ model.rigid
        self.loads = self.damping = self.meshes = self.drift = self.impulse = 0.0
        self.effort = self.swing = self.missed = 0.0
        self.before = self.after = self.energy(state, spin.speed)
        self.momentum = self.first_momentum = self._momentum(state, spin.speed)
        self.largest = abs(self.momentum)

    def energy(self, state, speed: float) -> float:
        """Kinetic energy and strain of a state, without the meshes [J]."""
        n, system = self.scheme.n, self.model.system
        q, v = state[:n], state[n : 2 * n]
        spin = 0.5 * self.spin.inertia * speed**2
        return float(0.5 * v @ system.M @ v + 0.5 * q @ system.K @ q + spin)

    def _momentum(self, state, speed: float) -> float:
        return float(self.carried @ state[self.scheme.n : 2 * self.scheme.n]) + self.spin.inertia * speed

    def add(self, states, block: StepBlock) -> None:
        """Add the works and impulses of a block of steps."""
        n, h, spin = self.scheme.n, self.spin.step, self.spin
        moved = np.diff(states[:, :n], axis=0)
        mean = 0.5 * (block.loads[1:] + block.loads[:-1])
        self.loads += float(np.sum((moved @ spin.directions) * mean))
        half = 0.5 * (block.torque[1:] + block.torque[:-1])
        # exact for a torque that is linear in the step
        self.loads += float(h * half @ (0.5 * (block.speed[1:] + block.speed[:-1])))
        self.damping += float(np.sum((moved @ self.model.system.C) * moved)) / h
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
        """The state less the spin that rounding has put into the deviations."""
        n, rigid = self.scheme.n, self.model.rigid
        angle, rate = (float(self.carried @ part) / self.spin.inertia for part in (state[:n], state[n : 2 * n]))
        self.drift = max(self.drift, abs(angle))
        state = state.copy()
        state[:n] -= angle * rigid
        state[n : 2 * n] -= rate * rigid
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
            f"the motion has outgrown the numbers by t = {self.spin.step * (first + last):.4g} s ({missed})"
            f"{self._mesh(states[last], block, last)}; the free motion {_rate(free.growth())}",
            code="E-DIVERGED",
            limit=f"balances of energy and momentum to {BALANCE:g}",
            remedy=remedy,
        )

    def _mesh(self, state, block: StepBlock, last: int) -> str:
        """The mesh with the most strain energy."""
        if not self.model.meshes:
            return ""
        # of size one, so that its square is finite
        approach = (state[: self.scheme.n] @ self.scheme.basic) @ block.selection[last]
        strain = block.stiffness[last] * (approach / max(np.abs(approach).max(), 1e-300)) ** 2
        return f", most in mesh {self.model.meshes[int(np.argmax(strain))]}"


def _rate(growth: float) -> str:
    if not np.isfinite(growth):
        return "is not known"
    if growth <= 0.0:
        return f"decays with {-growth:.4g} 1/s: the loads are too large"
    return f"grows with {growth:.4g} 1/s: a parametric resonance"


class Decimator:
    """Low pass and decimation of columns that come in blocks, without delay.

    A linear-phase filter (Kaiser window; J. F. Kaiser and R. W. Schafer, IEEE Trans. Acoust. Speech Signal
    Process. 28, 1980, 105-107) with 80 dB between 0.8 and 1.0 of half the record rate. Beyond both ends the
    columns go on as their mirror image about a ramp. Its slope is that of the parabola of least squares
    through two records (A. Savitzky and M. J. E. Golay, Anal. Chem. 36, 1964, 1627-1639), so that constants
    and ramps pass unchanged. Near an end both bands suffer. Of a tone at 0.1, 0.3 and 0.5 times half the
    record rate the end record misses 0.2, 5 and 20 % (r.m.s. over its phases), of one at 2, 6 and 12 times
    it keeps 36, 11 and 7 %; the next three keep 5 % and less.

    Parameters
    ----------
    every : int
        Steps a record; 1 passes everything.
    count : int
        Steps in all; rows 0 to `count` come.
    """

    def __init__(self, every: int, count: int):
        from scipy.signal import firwin, kaiserord, savgol_coeffs

        self.every, self.count, self.seen = every, count, 0
        self.rows = count // every + 1
        length, beta = kaiserord(_STOP, (1.0 - PASS_BAND) / every)
        # the continuation needs as many rows as it adds
        half = min(length // 2, count) if every > 1 else 0
        self.half = half
        middle = 0.5 * (1.0 + PASS_BAND) / every
        window = ("kaiser", beta)
        self.weights = firwin(2 * half + 1, middle, window=window) if half else np.ones(1)  # type: ignore
        # of rows for the slope, at the first one, of their parabola; of a line for two
        steps = min(half, 2 * every)
        slope = savgol_coeffs(steps + 1, min(2, steps), deriv=1, pos=0, use="dot") if half else np.zeros(1)
        # ramps exactly, whatever the least squares round
        self.slope = slope / (slope @ np.arange(steps + 1.0)) if half else slope
        self.buffer, self.first, self.done = np.zeros((0, 0)), 0, 0

    def push(self, rows) -> np.ndarray:
        """Take further rows (n, c), and give the records (k, c) that become complete with them."""
        rows = np.asarray(rows, float)
        self.buffer = np.vstack([self.buffer, rows]) if self.seen else rows.copy()
        self.seen += len(rows)
        half, last = self.half, self.seen == self.count + 1
        if self.done == 0 and self.first == 0:
            if len(self.buffer) <= half and not last:
                return np.empty((0, rows.shape[1]))
            ahead = self._mirrored(self.buffer[: half + 1])
            self.buffer, self.first = np.vstack([ahead[::-1], self.buffer]), -half
        if last and half:
            self.buffer = np.vstack([self.buffer, self._mirrored(self.buffer[-1 - half :][::-1])])
        return self._filtered()

    def _mirrored(self, rows) -> np.ndarray:
        """Rows (half, c) beyond the end at which `rows` (half + 1, c) begin."""
        slope = self.slope @ (rows[: len(self.slope)] - rows[0])
        return rows[1:] - 2.0 * np.outer(np.arange(1, len(rows)), slope)

    def _filtered(self) -> np.ndarray:
        """Records whose whole window is in the buffer."""
        reach = self.first + len(self.buffer) - 1 - self.half
        stop = min(reach // self.every + 1, self.rows)
        if stop <= self.done:
            return np.empty((0, self.buffer.shape[1]))
        begin, number = self.done * self.every - self.half - self.first, stop - self.done
        wanted = self.buffer[begin : begin + (number - 1) * self.every + 2 * self.half + 1]
        filtered = _weighted(wanted, self.weights, self.every)
        self.done = stop
        keep = max(stop * self.every - self.half - self.first, 0)
        self.buffer, self.first = self.buffer[keep:].copy(), self.first + keep
        return filtered


def _weighted(rows, weights, every: int) -> np.ndarray:
    """Sums (k, c) of rows (n, c) weighted (w,) from every so many of them on, as far as the rows go.

    Rows in groups of ``every`` are weighted by products of matrices, whose parts then add up.
    """
    number, groups = (len(rows) - len(weights)) // every + 1, -(-len(weights) // every)
    filled = np.zeros(((number - 1 + groups) * every, rows.shape[1]))
    filled[: min(len(rows), len(filled))] = rows[: len(filled)]
    by_group = np.pad(weights, (0, groups * every - len(weights))).reshape(groups, every)
    parts = by_group @ filled.reshape(-1, every, rows.shape[1])
    along, across, column = parts.strides
    shape, strides = (number, groups, rows.shape[1]), (along, along + across, column)
    return np.lib.stride_tricks.as_strided(parts, shape, strides).sum(axis=1)


class _Record:
    """What a run keeps: coordinates, meshes, spin."""

    def __init__(self, model: DrivetrainModel, count: int, records: Records, at, *, contact_loss: bool):
        self.every, self.at = records.every, at
        self.contacts = model.contacts if contact_loss else None
        self.basic = (self.contacts or model).geometry.basic
        rows, meshes = count // self.every + 1, len(model.meshes)
        widths = [len(at), len(at), meshes, meshes, 1, 1]
        self.cuts = np.cumsum(widths)[:-1]
        self.table = np.empty((rows, sum(widths)))
        self.decimator = Decimator(self.every, count) if records.lowpass and self.every > 1 else None
        self.filled, self.steps = 0, 0
        self.extremes = np.array([np.full(meshes, np.inf), np.full(meshes, -np.inf)])
        self.pulled, self.lost = np.zeros((2, meshes))

    def take(self, first: int, states, block: StepBlock) -> None:
        """Rows of the states and the `Block` of some steps; that of their start with the first one alone."""
        begin = min(first, 1)
        approach = np.einsum("tmj,tm->tj", block.selection, states[:, : len(self.basic)] @ self.basic)
        force, touched = block.stiffness * approach, np.ones((1, 1), bool)
        if self.contacts is not None:
            force, touched = self.contacts.mesh_forces(approach, block.stiffness)
            approach = approach[:, : force.shape[1]]
        self._count(force[begin:], touched[begin:])
        if self.decimator is None:
            at = (-first % self.every) or self.every if first else 0
            kept = slice(at, None, self.every)
        else:
            kept = slice(begin, None)
        n = len(self.basic)
        motion, velocity = states[kept, :n][:, self.at], states[kept, n : 2 * n][:, self.at]
        spin = block.angle[kept, None], block.speed[kept, None]
        new = np.hstack([motion, velocity, approach[kept], force[kept], *spin])
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
        """Arrays of a `DrivetrainRun`."""
        *tables, angle, speed = np.split(self.table, self.cuts, axis=1)
        names = ("motion", "velocity", "approach", "force")
        return {
            **{name: np.ascontiguousarray(table) for name, table in zip(names, tables)},
            "time": step * self.every * np.arange(len(self.table)),
            "spin": angle[:, 0].copy(),
            "spin_speed": speed[:, 0].copy(),
            "extremes": self.extremes,
            "pulling": self.pulled / self.steps,
            "lost": self.lost / self.steps,
        }
