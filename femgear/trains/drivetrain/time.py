"""Newmark's method for a drivetrain through time, with meshes that are linear or separate.

`march_drivetrain` takes the steps. What it works with stands below it: the start, one step with the loads and
meshes of many, flanks that part, the free motion, the balances of energy and momentum, and the records.

A step is a linear map of the state and the loads. The meshes, few against the coordinates, enter by the
Woodbury formula: with ``A = M + gamma h C + beta h^2 K`` factorised once and ``F = beta h^2 U^T A^-1 U`` the
approaches at the end of a step are ``S^T x - S^T F S f`` with x the motion without the mesh forces f there,
so that only small matrices, made for many instants at once, change from step to step. The free spin is
integrated apart: it takes the mean acceleration, turns the mesh phases, and cannot drift into the deviations.

Meshes that separate add the search for the flanks that touch. Drive and back flanks are contacts of their own
(`femgear.trains.drivetrain.model`) with the force ``k max(u, 0)`` of their overlap u, the approach less the
gap. With the contacts known that touch, the overlaps at the end of a step obey a small linear system. The
forces do not fall with the overlap and the flexibility takes no energy back, so that there is one solution.
Changing the wrong contacts and solving again mostly ends after one round; where it does not, only the first
wrong one changes, which always ends (K. G. Murty, Opsearch 11, 1974, 123-130).

Beside the motion goes the free one without loads, whose growth tells a parametric resonance. It takes the
same steps, with the tangents of the meshes, and is brought back to size one every few steps; the slope of the
logarithm of its size is the largest Lyapunov exponent (G. Benettin, L. Galgani, A. Giorgilli and
J.-M. Strelcyn, Meccanica 15, 1980, 9-30). The weights exp(-1 / (s (1 - s))) over the run take the oscillation
of the size out of the mean (S. Das, Y. Saiki, E. Sander and J. A. Yorke, Nonlinearity 30, 2017, 4111-4140).
With linear meshes at a constant speed it is the largest Floquet exponent, at any load.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.time.steps import AVERAGE_ACCELERATION
from femgear.system.fourier import FourierSeries
from femgear.trains.drivetrain.data import TorqueHistory
from femgear.trains.drivetrain.model import DrivetrainModel, FlankContacts, contact_model
from femgear.trains.drivetrain.records import Record

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

# Points of the table of a mesh period, between which the stiffness is linear.
_TABLE = 8192

# Rounding of an overlap relative to the largest one without mesh forces.
_OVERLAP_ROUNDING = 1e-12
# Rounds of changing all wrong contacts, and of changing one.
_ROUNDS, _SINGLE = 12, 10_000
# Steps that are tried at once with all drive flanks and no others in touch, first and last.
_FEW, _MANY = 8, 64

# Stiffness of a parted mesh over its own: bodies that it alone holds stay findable.
_SLIGHT = 1e-12
# Force that this stiffness may carry, over those of the loads.
_CARRIED = 1e-6

# Steps whose loads and meshes are made at once.
_BLOCK = 4096


@dataclass(frozen=True)
class Records:
    """What a run keeps of its steps.

    Parameters
    ----------
    every : int
        Steps a record.
    lowpass : bool
        Records are low-passed (`femgear.trains.drivetrain.records.Decimator`), so that nothing beyond half
        their rate appears as something else; False takes the motion at these instants as it is.
    """

    every: int = 1
    lowpass: bool = False


@dataclass(frozen=True)
class DrivetrainRun:
    """Motion of a drivetrain, recorded every few steps.

    Parameters
    ----------
    time : (n,) array
        [s]
    outputs : tuple of str
    motion, velocity : (n, n_outputs) arrays
        Deviations from the free spin [m, rad].
    approach, force : (n, n_meshes) arrays
        Of the drive flanks [m]; of the meshes, drive less back flank [N].
    spin, spin_speed : (n,) arrays
        Angle and speed of the first body without its deviation [rad], [rad/s].
    meshes : tuple of str
    energy_balance : EnergyBalance
    drift : float
        Largest spin found in the deviations after a block, before it was taken out [rad].
    momentum : float
        Error of the angular momentum about the first body's axis, over the largest impulse or momentum.
    steps : int
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
    """Step a drivetrain through time.

    Parameters
    ----------
    model : DrivetrainModel
    torques : sequence of TorqueHistory
    duration, step : float
        [s]. Any step is taken; cases are refused below four steps a mesh period
        (`femgear.trains.drivetrain.checks.check_drivetrain`, E-RATE), and warned of below thirty and of modes
        that the step lowers (W-RATE).
    speed : float
        Of the first body at the start [rad/s]; gyroscopic terms keep this value.
    start : {"static", "zero"} or pair of (n,) arrays
        Deviations and their velocities: static under the first loads, none (loads set in suddenly), or given.
    outputs : sequence of str, optional
        Coordinates to record; all rotations when not given.
    records : Records
    contact_loss : bool
        Drive flanks part, and back flanks touch after the backlash; False lets meshes pull.

    Raises
    ------
    CaseError
        Steps and durations that are none (E-RANGE); loads that part flanks behind which nothing holds the
        gears, or a start that is no text of these (E-START).
    ConvergenceError
        The motion outgrows the numbers (E-DIVERGED); no flanks fit a step (E-CONTACT).
    """
    if not 0.0 < step <= duration < np.inf:
        raise CaseError(
            f"{duration} s in steps of {step} s", code="E-RANGE", limit="0 < step <= duration", key="step"
        )
    count = max(1, round(duration / step))
    stepped = contact_model(model) if contact_loss else model
    spin = _Spin(stepped, torques, step, speed)
    scheme = _Scheme.of(stepped, step, speed, spin.directions)
    if outputs is None:
        outputs = [name for name in model.system.dofs if name.endswith("rotation")]
    at = np.array([model.index(name) for name in outputs], int)
    record = Record(model, count, at, every=records.every, lowpass=records.lowpass, contact_loss=contact_loss)
    with np.errstate(over="ignore", invalid="ignore"):
        motion = _Motion(model, scheme, spin, start, count, contact_loss)
        balances = _Balances(stepped, scheme, spin, motion.state)
        for first in range(0, count, _BLOCK):
            states, block = motion.block(first, min(_BLOCK, count - first))
            balances.add(states, block)
            balances.check(states, block, first, free=motion.free, contact_loss=contact_loss)
            record.take(first, states, block)
            motion.state = balances.without_drift(states[-1])
    return DrivetrainRun(
        outputs=tuple(outputs), **record.columns(step), meshes=model.meshes, energy_balance=balances.works(),
        drift=balances.drift, momentum=balances.momentum_error(), steps=count, step=step,
        contact_loss=contact_loss, growth=motion.free.growth(), gain=motion.free.gain(),
    )  # fmt: skip


class _Motion:
    """The motion and the free motion beside it, block by block."""

    def __init__(self, model: DrivetrainModel, scheme: _Scheme, spin: _Spin, start, count: int, contact_loss):
        self.scheme, self.spin, self.meshes = scheme, spin, len(model.meshes)
        # steps between two sizes of the free motion
        self.piece = max(1, min(PIECE, count // _SIZES))
        self.state = _start_state(model, scheme, spin, start, model.contacts if contact_loss else None)
        self.free = FreeMotion(model, scheme)
        self.free_row = self.free.start()
        self.march = _march_closed
        if contact_loss and model.meshes:
            self.march = _Separating(model.contacts.gap, self.meshes).march

    def block(self, first: int, number: int):
        """States (number + 1, 2 n + m) of the next steps, and their loads and meshes."""
        scheme, h = self.scheme, self.spin.step
        block = self.spin.block(first, number)
        meshes = _MeshBlock.of(scheme, block, self.meshes)
        loads = block.loads[:-1] @ scheme.loads_before + block.loads[1:] @ scheme.loads_after
        rows = np.empty((number + 1, 2, len(scheme.advance)))
        rows[0] = scheme.row(self.state), self.free_row
        for begin in range(0, number, self.piece):
            end = min(begin + self.piece, number)
            self.march(scheme, meshes, loads, rows, range(begin, end))
            rows[end, 1] = self.free.renewed(rows[end, 1], h * (first + end))
        self.free_row = rows[-1, 1].copy()
        return scheme.states(rows[:, 0]), block


def _start_state(
    model: DrivetrainModel, scheme: _Scheme, spin: _Spin, start, contacts: FlankContacts | None
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
            q = static_deviations(model, U @ S, k, load, contacts=contacts)
        elif start != "zero":
            raise CaseError(f"a start {start!r}", code="E-START", limit="static, zero or two arrays")
    else:
        q, v = (np.asarray(one, float) for one in start)
    approach = (U @ S).T @ q
    force = k * (approach if contacts is None else np.maximum(approach - contacts.gap, 0.0))
    return np.concatenate([q, v, S @ force])


def static_deviations(model: DrivetrainModel, W, k, load, *, contacts: FlankContacts | None = None):
    """Deviations (n,) under a load that does not drive the spin, meshes or contacts W (n, c) at one instant.

    Drive flanks that part, and back flanks that touch, are found as corrections of drive flanks that all
    touch.
    """
    meshes = len(model.meshes)
    drive, stiffness = W[:, :meshes], k[:meshes]
    carried, total = model.system.M @ model.rigid, model.system.K + (drive * stiffness) @ drive.T
    size = (np.abs(total).max() or 1.0) / np.abs(carried).max() ** 2
    flexible = np.linalg.inv(total + size * np.outer(carried, carried))
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
            " holds the gears", code="E-START", limit="loads that close the drive flanks, or a backlash",
            remedy="name the driver of the stage that these loads press, give the mesh a backlash, or"
            " start = \"zero\"",
        )  # fmt: skip
    return q - drawn @ (np.where(closed, touching, parted) * u)


@dataclass(frozen=True)
class _Block:
    """Loads and meshes at the instants (t,) of a block of steps, its start included.

    ``loads`` (t, d): one for the weight, then the torques [N m]; ``selection`` (t, m, n_meshes): ``S`` of
    `femgear.trains.drivetrain.model.MeshGeometry`; ``stiffness`` (t, n_meshes) [N/m]; of the spin ``angle``
    [rad], ``speed`` [rad/s], ``torque`` and, without regard to signs, ``effort`` [N m].
    """

    loads: np.ndarray
    selection: np.ndarray
    stiffness: np.ndarray
    angle: np.ndarray
    speed: np.ndarray
    torque: np.ndarray
    effort: np.ndarray


class _Spin:
    """The free spin, exact for torques that are linear in a step, and the loads that are left."""

    def __init__(self, model: DrivetrainModel, torques: Sequence[TorqueHistory], step: float, speed: float):
        self.model, self.torques, self.step = model, tuple(torques), step
        self.angle, self.speed = 0.0, float(speed)
        carried = model.system.M @ model.rigid
        self.inertia = float(model.rigid @ carried)
        columns = [np.eye(len(carried))[model.index(f"{t.body}: rotation")] for t in self.torques]
        self.carried = carried
        self.share = np.array([column @ model.rigid for column in columns])
        kept = [c - carried * (s / self.inertia) for c, s in zip(columns, self.share)]
        self.directions = np.column_stack([model.system.load, *kept])
        self.table = np.zeros((_TABLE + 1, 0))
        if len(model.meshes):
            phase = 2.0 * np.pi * np.arange(_TABLE + 1)[:, None] / _TABLE
            self.table = np.array(FourierSeries(model.stiffness).at(phase))

    def block(self, first: int, count: int) -> _Block:
        """The next `count` steps, which begin with step `first`; the spin moves on to their end."""
        times = self.step * np.arange(first, first + count + 1)
        values = np.zeros((count + 1, len(self.torques)))
        for column, one in enumerate(self.torques):
            values[:, column] = one.at(times)
        torque, h = values @ self.share, self.step
        rate = torque / self.inertia
        speed = self.speed + np.append(0.0, np.cumsum(0.5 * h * (rate[1:] + rate[:-1])))
        moved = h * speed[:-1] + h * h * (2.0 * rate[:-1] + rate[1:]) / 6.0
        angle = self.angle + np.append(0.0, np.cumsum(moved))
        self.angle, self.speed = angle[-1], speed[-1]
        loads = np.hstack([np.ones((count + 1, 1)), values])
        effort = np.abs(values) @ np.abs(self.share)
        return _Block(loads, *self._meshes(angle), angle, speed, torque, effort)

    def _meshes(self, angle):
        model = self.model
        planets = len(model.geometry.even)
        turns = angle[:, None] * model.base_ratio[: 2 * planets : 2] * float(model.turning)
        place = (np.abs(angle[:, None] * model.base_ratio[model.mesh_base]) / (2.0 * np.pi) % 1.0) * _TABLE
        low = np.minimum(place.astype(int), _TABLE - 1)
        part, column = place - low, np.arange(len(model.mesh_base))
        k = (1.0 - part) * self.table[low, column] + part * self.table[low + 1, column]
        return model.geometry.selection(turns), k


@dataclass(frozen=True)
class _Scheme:
    """One step, mesh forces g on the simple motions at its end left open.

    Rows ``z = (q, v without g, g)`` go on by ``(q, v without g, x without g) = z advance + loads``; the state
    is ``(q, v) = z[:2n] - drawn g``, and ``x = U^T q`` becomes ``x without g - flexibility g``.
    """

    advance: np.ndarray
    loads_before: np.ndarray
    loads_after: np.ndarray
    drawn: np.ndarray
    flexibility: np.ndarray
    basic: np.ndarray
    n: int

    @classmethod
    def of(cls, model: DrivetrainModel, h: float, speed: float, directions) -> _Scheme:
        """Factorise average acceleration in steps h [s] at a speed of the first body [rad/s]."""
        from scipy import linalg

        rule, system, U = AVERAGE_ACCELERATION, model.system, model.geometry.basic
        M, K, n = system.M, system.K, len(system.M)
        D = system.C if system.gyroscopic is None else system.C + speed * system.gyroscopic
        # columns: q, v, g, loads before, loads after, mesh forces after
        ends = np.cumsum([n, n, U.shape[1], directions.shape[1], directions.shape[1], U.shape[1]])
        blank = np.zeros((n, ends[-1]))
        q, v, force, after = blank.copy(), blank.copy(), blank.copy(), blank.copy()
        q[:, :n], v[:, n : ends[1]] = np.eye(n), np.eye(n)
        force[:, ends[1] : ends[2]], force[:, ends[2] : ends[3]] = -U, directions
        after[:, ends[3] : ends[4]], after[:, ends[4] :] = directions, -U
        begin = linalg.solve(M, force - D @ v - K @ q, assume_a="pos")
        q_free = q + h * v + h * h * (0.5 - rule.beta) * begin
        v_free = v + h * (1.0 - rule.gamma) * begin
        A = M + rule.gamma * h * D + rule.beta * h * h * K
        end = linalg.solve(A, after - D @ v_free - K @ q_free)
        q_end, v_end = q_free + rule.beta * h * h * end, v_free + rule.gamma * h * end
        whole = np.vstack([q_end, v_end, U.T @ q_end])
        drawn = -whole[: 2 * n, ends[4] :]
        moved = whole[:, : 2 * n]
        advance = np.hstack([moved, whole[:, 2 * n : ends[2]] - moved @ drawn])
        return cls(
            np.ascontiguousarray(advance.T), whole[:, ends[2] : ends[3]].T,
            whole[:, ends[3] : ends[4]].T, np.ascontiguousarray(drawn.T),
            -whole[2 * n :, ends[4] :], U, n,
        )  # fmt: skip

    def states(self, rows) -> np.ndarray:
        """``(q, v, g)`` of rows ``z`` (..., 2 n + m)."""
        out = np.array(rows)
        out[..., : 2 * self.n] -= rows[..., 2 * self.n :] @ self.drawn
        return out

    def row(self, state) -> np.ndarray:
        """``z`` of states ``(q, v, g)``."""
        out = np.array(state)
        out[..., : 2 * self.n] += state[..., 2 * self.n :] @ self.drawn
        return out


@dataclass(frozen=True)
class _MeshBlock:
    """Small matrices of the ends of the t steps of a block, c contacts on m simple motions.

    ``selection`` (t, m, c) and ``stiffness`` (t, c) of the meshes, or of all contacts of those that separate;
    ``closed`` (t, m, m) from x without mesh forces (a row) to the forces on the simple motions when all drive
    flanks touch.
    """

    selection: np.ndarray
    stiffness: np.ndarray
    closed: np.ndarray

    @classmethod
    def of(cls, scheme: _Scheme, block: _Block, meshes: int) -> _MeshBlock:
        """Of a block whose first `meshes` contacts are drive flanks."""
        S, k = np.ascontiguousarray(block.selection[1:, :, :meshes]), block.stiffness[1:, :meshes]
        St = np.swapaxes(S, 1, 2)
        # transposed: x S k (1 + (S^T F S)^T k)^-1 S^T
        inner = np.matmul(np.swapaxes(np.matmul(scheme.flexibility, S), 1, 2), S) * k[:, None, :]
        inner[:, np.arange(inner.shape[1]), np.arange(inner.shape[1])] += 1.0
        forces = np.linalg.solve(np.swapaxes(inner, 1, 2), k[:, :, None] * St)
        closed = np.matmul(np.swapaxes(forces, 1, 2), St)
        return cls(block.selection[1:], block.stiffness[1:], closed)


def _march_closed(scheme: _Scheme, meshes: _MeshBlock, loads, rows, steps: range) -> None:
    """Fill ``rows[i + 1]`` (2, 2 n + m), the motion and the free motion, from ``rows[i]`` for i in `steps`.

    All meshes are linear; `loads` (t, 2 n + m) act on the motion alone.
    """
    advance, closed, at = scheme.advance, meshes.closed, 2 * scheme.n
    dot = np.dot
    for i in steps:
        after = rows[i + 1]
        dot(rows[i], advance, out=after)
        after[0] += loads[i]
        drawn = after[:, at:]
        drawn[:] = dot(drawn, closed[i])


def solve_overlaps(
    flexibility, free, closed, touching, parted: np.ndarray | float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Solve ``u + flexibility force(u) = free`` for overlaps u and the contacts that touch (n,).

    Parameters
    ----------
    flexibility : (n, n) array
        With a symmetric part that is not negative [m/N].
    free : (n,) array
        Overlaps without the forces [m].
    closed : (n,) bool array
        First guess.
    touching, parted : (n,) arrays
        Forces over overlaps of contacts that touch, and of the others [N/m].

    Raises
    ------
    ConvergenceError
        No contacts fit (E-CONTACT).
    """
    rounding = _OVERLAP_ROUNDING * np.abs(free).max(initial=0.0)
    for number in range(_ROUNDS + _SINGLE):
        slopes = np.where(closed, touching, parted)
        u = np.linalg.solve(np.eye(len(free)) + flexibility * slopes, free)
        found = _changed(u, closed, rounding)
        wrong = np.flatnonzero(found != closed)
        if not len(wrong):
            return u, closed
        # all that are wrong, or the first one alone
        wrong = wrong if number < _ROUNDS else wrong[:1]
        closed = closed.copy()
        closed[wrong] = found[wrong]
    raise ConvergenceError(
        "no contacts of the meshes fit the end of a step", code="E-CONTACT",
        remedy="take shorter steps, or the start \"zero\"",
    )  # fmt: skip


def _changed(u, closed, rounding: float) -> np.ndarray:
    """The contacts that touch with overlaps u; within rounding as before."""
    return np.where(closed, u >= -rounding, u > rounding)


class _Separating:
    """Steps of meshes that separate; of the contacts with these gaps (n,) [m] the first are drive flanks."""

    def __init__(self, gap, meshes: int):
        from scipy.linalg import get_lapack_funcs

        self.gap = gap
        (self.dgesv,) = get_lapack_funcs(("gesv",), dtype=float)
        self.drive = np.arange(len(gap)) < meshes
        # what leaves the drive flanks, and no others, in touch is not below zero
        self.sense = np.where(self.drive, 1.0, -1.0)
        self.tries = _FEW
        self._take(self.drive)

    def _take(self, closed) -> None:
        """Keep the contacts that touch, and the overlaps from `least` to `most` that fit them."""
        self.closed, self.drives = closed, np.array_equal(closed, self.drive)
        self.touching = np.flatnonzero(closed)
        self.play = self.gap[self.touching]
        self.least = np.where(closed, 0.0, -np.inf)
        self.most = np.where(closed, np.inf, 0.0)

    def march(self, scheme: _Scheme, meshes: _MeshBlock, loads, rows, steps: range) -> None:
        """As `_march_closed`, with the contacts that touch."""
        i, stop = steps.start, steps.stop
        while i < stop:
            if self.drives:
                tried = range(i, min(i + self.tries, stop))
                _march_closed(scheme, meshes, loads, rows, tried)
                kept = self._kept(scheme, meshes, rows, tried)
                i += kept
                self.tries = min(2 * self.tries, _MANY)
                if kept == len(tried):
                    continue
                self.tries = _FEW
            self._step(scheme, i, meshes, loads, rows)
            i += 1

    def _kept(self, scheme, meshes, rows, steps) -> int:
        """Steps until the first drive flank parts or back flank touches."""
        at, n = 2 * scheme.n, scheme.n
        z = rows[steps.start + 1 : steps.stop + 1, 0]
        x = z[:, :n] @ scheme.basic - z[:, at:] @ scheme.flexibility.T
        approach = np.einsum("tmj,tm->tj", meshes.selection[steps.start : steps.stop], x)
        wrong = ((approach - self.gap) * self.sense < 0.0).any(axis=1)
        return int(np.argmax(wrong)) if wrong.any() else len(z)

    def _step(self, scheme, i, meshes, loads, rows) -> None:
        after = rows[i + 1]
        np.dot(rows[i], scheme.advance, out=after)
        after[0] += loads[i]
        drawn = after[:, 2 * scheme.n :]
        drawn[:] = self._forces(scheme, meshes, i, drawn)

    def _forces(self, scheme, meshes, i, x):
        """Forces and their tangents (2, m) on the simple motions from these motions (2, m) without them."""
        forces, u = self._solved(scheme, meshes, i, x)
        if ((u >= self.least) & (u <= self.most)).all():
            return forces
        if not np.isfinite(x).all():
            return np.full_like(x, np.nan)
        S = meshes.selection[i]
        free = np.dot(x[0], S) - self.gap
        found = _changed(u, self.closed, _OVERLAP_ROUNDING * np.abs(free).max())
        if np.array_equal(found, self.closed):
            return forces
        flexibility = np.dot(S.T, np.dot(scheme.flexibility, S))
        self._take(solve_overlaps(flexibility, free, found, meshes.stiffness[i])[1])
        return self._solved(scheme, meshes, i, x)[0]

    def _solved(self, scheme, meshes, i, x):
        """Forces and tangents with the present contacts, and the overlaps (n,) that they lead to."""
        S, k = meshes.selection[i], meshes.stiffness[i][self.touching]
        if not len(k):
            return np.zeros_like(x), np.dot(x[0], S) - self.gap
        own, flexible = S.take(self.touching, axis=1), scheme.flexibility.T
        inner = np.dot(np.dot(own.T, flexible), own) * k
        inner.ravel()[:: len(k) + 1] += 1.0
        right = np.dot(x, own)
        right[0] -= self.play
        right *= k
        # rows in C order are columns in that of Fortran: nothing is copied
        forces = np.dot(self.dgesv(inner.T, right.T, overwrite_a=True, overwrite_b=True)[2].T, own.T)
        return forces, np.dot(x[0] - np.dot(forces[0], flexible), S) - self.gap


class FreeMotion:
    """Size of the free motion: the root of twice its energy, meshes included and the spin left out."""

    def __init__(self, model: DrivetrainModel, scheme: _Scheme, *, seed: int = 0):
        self.system, self.rigid, self.scheme = model.system, model.rigid, scheme
        self.carried, self.inertia, self.seed = model.system.M @ model.rigid, model.inertia, seed
        self.times, self.sizes = [0.0], [0.0]

    def start(self) -> np.ndarray:
        """Row ``z`` (2 n + m,) of random velocities of like energy."""
        n = self.scheme.n
        state = np.zeros(len(self.scheme.advance))
        state[n : 2 * n] = np.random.default_rng(self.seed).standard_normal(n) / np.sqrt(
            np.diag(self.system.M)
        )
        return self._scaled(state)[0]

    def renewed(self, row, time: float) -> np.ndarray:
        """The row at size one; its size at this time [s] is kept."""
        row, size = self._scaled(self.scheme.states(row))
        self.times.append(time)
        with np.errstate(divide="ignore"):
            self.sizes.append(self.sizes[-1] + np.log(size))
        return row

    def _scaled(self, state):
        n, system = self.scheme.n, self.system
        q, v, g = state[:n], state[n : 2 * n], state[2 * n :]
        q -= (self.carried @ q) / self.inertia * self.rigid
        v -= (self.carried @ v) / self.inertia * self.rigid
        twice = v @ system.M @ v + q @ system.K @ q + (q @ self.scheme.basic) @ g
        size = np.sqrt(max(twice, 0.0))
        return self.scheme.row(state / size if size > 0.0 else 0.0 * state), size

    def gain(self) -> float:
        """Largest growth between any two instants of the run, as a factor; NaN without a free motion.

        ``exp(max over t of (log size(t) - its least value before))``: a resonance that the speed passes
        shows here, though the mean over the run decays. Infinite beyond all numbers.
        """
        sizes = np.array(self.sizes)
        if len(sizes) < 2 or not np.all(np.isfinite(sizes)):
            return float("nan")
        with np.errstate(over="ignore"):
            return float(np.exp((sizes - np.minimum.accumulate(sizes)).max()))

    def growth(self) -> float:
        """Mean rate of the logarithm of the size [1/s] after the first third; NaN without a free motion."""
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
    """Energies [J] of a run: what was there at the ends, and the work in between."""

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

    def __init__(self, model: DrivetrainModel, scheme: _Scheme, spin: _Spin, state):
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

    def add(self, states, block: _Block) -> None:
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
        angle, rate = (
            float(self.carried @ part) / self.spin.inertia for part in (state[:n], state[n : 2 * n])
        )
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

    def check(self, states, block: _Block, first: int, *, free: FreeMotion, contact_loss: bool) -> None:
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

    def _mesh(self, state, block: _Block, last: int) -> str:
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
