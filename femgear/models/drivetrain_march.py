"""Newmark's method for a drivetrain whose meshes keep contact: a linear system with varying stiffness.

A step is linear in the state and in the loads. The meshes, few against the coordinates, enter by the
Woodbury formula: with ``A = M + gamma h C + beta h^2 K`` factorised once and ``F = beta h^2 U^T A^-1 U``
the mesh
forces at the end of a step are ``(k^-1 + S^T F S)^-1 S^T x`` with x the motion without them, so that only
small matrices, made for many instants at once, change from step to step. The free spin is integrated apart:
it
takes the mean acceleration, turns the mesh phases, and cannot drift into the deviations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError
from femgear.models.drivetrain import DrivetrainModel
from femgear.models.drivetrain_books import Books, Ledger
from femgear.models.drivetrain_record import Record
from femgear.models.drivetrain_torque import TorqueHistory
from femgear.solvers.newmark import AVERAGE_ACCELERATION, StepRule
from femgear.solvers.series import FourierSeries

_BLOCK = 4096
# Points of the table of a mesh period, between which the stiffness is linear.
_TABLE = 8192


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
        Of the meshes [m], [N].
    spin, spin_speed : (n,) arrays
        Angle and speed of the first body without its deviation [rad], [rad/s].
    meshes, ledger
        Names, energies.
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
        Share of the steps with a negative force.
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
    ledger: Ledger
    drift: float
    momentum: float
    steps: int
    step: float
    extremes: np.ndarray
    pulling: np.ndarray


def march_drivetrain(
    model: DrivetrainModel,
    torques: Sequence[TorqueHistory],
    *,
    duration: float,
    step: float,
    speed: float,
    start="static",
    outputs: Sequence[str] | None = None,
    every: int = 1,
    lowpass: bool = False,
    rule: StepRule = AVERAGE_ACCELERATION,
    separate_spin: bool = True,
) -> DrivetrainRun:
    """Step a drivetrain through time.

    Parameters
    ----------
    model : DrivetrainModel
    torques : sequence of TorqueHistory
    duration, step : float
        [s]
    speed : float
        Of the first body at the start [rad/s]; gyroscopic terms keep this value.
    start : {"static", "zero"} or pair of (n,) arrays
        Deviations and their velocities: static under the first loads, none (loads set in suddenly), or given.
    outputs : sequence of str, optional
        Coordinates to record; all rotations when not given.
    every : int
        Steps between records.
    lowpass : bool
        Records are low-passed (`femgear.models.drivetrain_record.Decimator`), so that nothing beyond half
        their rate appears as something else; False takes the motion at these instants as it is.
    rule : StepRule
        Newmark's gamma and beta; without the averaging of generalised alpha.
    separate_spin : bool
        False integrates the spin with the rest, to show what it does.

    Raises
    ------
    CaseError
        Steps and durations that are none, an explicit or averaged rule (E-STEP, E-STEP-RULE), a start that
        does
        not fit (E-START).
    """
    _check(duration, step, every, rule)
    count = max(1, round(duration / step))
    track = _Spin(model, torques, step, speed, separate_spin)
    scheme = _Scheme.of(model, rule, step, speed, track.directions)
    names = _outputs(model, outputs)
    at = np.array([model.index(name) for name in names], int)
    state = _start(model, scheme, track, start)
    record = Record(model, count, every, at, lowpass=lowpass)
    books = Books(model, scheme, track, state)
    for first in range(0, count, _BLOCK):
        number = min(_BLOCK, count - first)
        block = track.block(first, number)
        states = _march(scheme, block, state)
        record.take(first, number, states, block)
        books.add(states, block)
        state = books.without_drift(states[-1]) if separate_spin else states[-1].copy()
    return DrivetrainRun(
        step * every * np.arange(count // every + 1), names, *record.columns(), model.meshes, books.ledger(),
        books.drift, books.momentum_error(), count, step,
        record.extremes, record.pulled / record.steps,
    )  # fmt: skip


def _check(duration, step, every, rule) -> None:
    if not (np.isfinite(duration) and np.isfinite(step) and 0.0 < step <= duration):
        raise CaseError(
            f"{duration} s in steps of {step} s", code="E-STEP", limit="0 < step <= duration", key="step"
        )
    if int(every) != every or every < 1:
        raise CaseError(f"every {every} steps", code="E-STEP", key="every", limit="1 or more")
    if rule.mass or rule.force or rule.beta < 0.25 or rule.gamma < 0.5:
        raise CaseError(
            f"the rule {rule} is not stable for any step", code="E-STEP-RULE",
            limit="Newmark's rules with gamma of 1/2 or more and beta of 1/4 or more",
        )  # fmt: skip


def _outputs(model, outputs) -> tuple[str, ...]:
    if outputs is None:
        return tuple(name for name in model.system.dofs if name.endswith("rotation"))
    return tuple(outputs)


@dataclass(frozen=True)
class _Block:
    """Loads and meshes at the instants of a block, its start included."""

    loads: np.ndarray
    selection: np.ndarray
    stiffness: np.ndarray
    angle: np.ndarray
    speed: np.ndarray
    torque: np.ndarray


class _Spin:
    """The free spin, exact for torques that are linear in a step, and the loads that are left."""

    def __init__(self, model, torques, step, speed, separate):
        self.model, self.torques, self.step, self.separate = model, tuple(torques), step, separate
        self.angle, self.speed = 0.0, float(speed)
        carried = model.system.M @ model.rigid
        self.inertia = float(model.rigid @ carried)
        columns = [np.eye(len(carried))[model.index(f"{t.body}: rotation")] for t in self.torques]
        self.share = np.array([column @ model.rigid for column in columns])
        kept = [c - carried * (s / self.inertia if separate else 0.0) for c, s in zip(columns, self.share)]
        self.directions = np.column_stack([model.system.load, *kept])
        self.table = np.zeros((_TABLE + 1, 0))
        if len(model.meshes):
            phase = 2.0 * np.pi * np.arange(_TABLE + 1)[:, None] / _TABLE
            self.table = np.array(FourierSeries(model.stiffness).at(phase))

    def block(self, first, count) -> _Block:
        times = self.step * np.arange(first, first + count + 1)
        values = np.stack([one.at(times) for one in self.torques], axis=1) if self.torques else None
        values = np.zeros((count + 1, 0)) if values is None else values
        torque, h = values @ self.share, self.step
        rate = torque / self.inertia
        speed = self.speed + np.append(0.0, np.cumsum(0.5 * h * (rate[1:] + rate[:-1])))
        moved = h * speed[:-1] + h * h * (2.0 * rate[:-1] + rate[1:]) / 6.0
        angle = self.angle + np.append(0.0, np.cumsum(moved))
        self.angle, self.speed = angle[-1], speed[-1]
        loads = np.hstack([np.ones((count + 1, 1)), values])
        selection, stiffness = self._meshes(angle)
        return _Block(loads, selection, stiffness, angle, speed, torque)

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
    """One step as ``(q, v, x) = step (q, v, g) + loads`` without the mesh forces g at its end."""

    transition: np.ndarray
    loads_before: np.ndarray
    loads_after: np.ndarray
    drawn: np.ndarray
    flexibility: np.ndarray
    basic: np.ndarray
    n: int

    @classmethod
    def of(cls, model, rule, h, speed, directions) -> _Scheme:
        from scipy import linalg

        system, U = model.system, model.geometry.basic
        M, K, n = system.M, system.K, len(system.M)
        D = system.C + speed * system.gyroscopic
        # columns: q, v, g, loads before, loads after, mesh forces after
        one, none = np.eye(n), np.zeros((n, n))
        widths = [n, n, U.shape[1], directions.shape[1], directions.shape[1], U.shape[1]]
        ends = np.cumsum(widths)
        blank = np.zeros((n, ends[-1]))
        q, v, force, after = blank.copy(), blank.copy(), blank.copy(), blank.copy()
        q[:, :n], v[:, n : ends[1]] = one, one
        force[:, ends[1] : ends[2]], force[:, ends[2] : ends[3]] = -U, directions
        after[:, ends[3] : ends[4]], after[:, ends[4] :] = directions, -U
        begin = linalg.solve(M, force - D @ v - K @ q + none @ q, assume_a="pos")
        q_free = q + h * v + h * h * (0.5 - rule.beta) * begin
        v_free = v + h * (1.0 - rule.gamma) * begin
        A = M + rule.gamma * h * D + rule.beta * h * h * K
        end = linalg.solve(A, after - D @ v_free - K @ q_free)
        q_end, v_end = q_free + rule.beta * h * h * end, v_free + rule.gamma * h * end
        whole = np.vstack([q_end, v_end, U.T @ q_end])
        return cls(
            np.ascontiguousarray(whole[:, : ends[2]]), whole[:, ends[2] : ends[3]].T,
            whole[:, ends[3] : ends[4]].T, np.ascontiguousarray(-whole[: 2 * n, ends[4] :]),
            -whole[2 * n :, ends[4] :], U, n,
        )  # fmt: skip


def _march(scheme: _Scheme, block: _Block, state):
    """States (count + 1, 2 n + m) with the column forces."""
    S, k = block.selection[1:], block.stiffness[1:]
    inner = np.matmul(np.swapaxes(S, 1, 2), np.matmul(scheme.flexibility, S)) * k[:, None, :]
    inner = np.swapaxes(inner, 1, 2)
    inner[:, np.arange(inner.shape[1]), np.arange(inner.shape[1])] += 1.0
    # forces on the simple motions: S (1 + k S^T F S)^-1 k S^T
    mesh = np.linalg.solve(inner, k[:, :, None] * np.swapaxes(S, 1, 2))
    matrices = np.matmul(S, mesh)
    loads = block.loads[:-1] @ scheme.loads_before + block.loads[1:] @ scheme.loads_after
    count, width = len(loads), scheme.transition.shape[1]
    states = np.empty((count + 1, width))
    states[0] = state
    n2, step, drawn = 2 * scheme.n, scheme.transition, scheme.drawn
    ahead = np.empty(n2 + scheme.flexibility.shape[0])
    for i in range(count):
        np.dot(step, states[i], out=ahead)
        ahead += loads[i]
        after = states[i + 1]
        g = np.dot(matrices[i], ahead[n2:])
        after[n2:] = g
        np.subtract(ahead[:n2], np.dot(drawn, g), out=after[:n2])
    return states


def _start(model, scheme, track, start):
    """State with the column forces at the first instant."""
    n, U = scheme.n, scheme.basic
    block = track.block(0, 1)
    track.angle, track.speed = 0.0, float(block.speed[0])
    S, k = block.selection[0], block.stiffness[0]
    W = U @ S
    total = model.system.K + (W * k) @ W.T
    if isinstance(start, str):
        q, v = np.zeros((2, n))
        if start == "static":
            carried = model.system.M @ model.rigid
            size = np.abs(total).max() / np.abs(carried).max() ** 2
            load = track.directions @ block.loads[0]
            load = load - carried * (model.rigid @ load) / track.inertia
            q = np.linalg.solve(total + size * np.outer(carried, carried), load)
        elif start != "zero":
            raise CaseError(f"a start {start!r}", code="E-START", limit="static, zero or two arrays")
    else:
        q, v = (np.asarray(one, float) for one in start)
        if q.shape != (n,) or v.shape != (n,):
            raise CaseError(f"a start of shapes {q.shape}, {v.shape}", code="E-START", limit=f"two ({n},)")
    return np.concatenate([q, v, S @ (k * (W.T @ q))])
