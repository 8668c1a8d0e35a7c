"""One step of Newmark's method for a drivetrain as a linear map, and the loads and meshes of many steps.

The meshes, few against the coordinates, enter by the Woodbury formula: with ``A = M + gamma h C + beta h^2
K`` factorised once and ``F = beta h^2 U^T A^-1 U`` the approaches at the end of a step are
``S^T x - S^T F S f`` with x the motion without the mesh forces f there, so that only small matrices, made for
many instants at once, change from step to step. The free spin is integrated apart: it takes the mean
acceleration, turns the mesh phases, and cannot drift into the deviations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.solvers.series import FourierSeries

# Points of the table of a mesh period, between which the stiffness is linear.
_TABLE = 8192


@dataclass(frozen=True)
class Block:
    """Loads and meshes at the instants of a block of steps, its start included.

    Parameters
    ----------
    loads : (t, d) array
        One for the weight, then the torques [N m].
    selection : (t, m, n_meshes) array
        ``S`` of `femgear.models.drivetrain_meshes.MeshGeometry`.
    stiffness : (t, n_meshes) array
        [N/m]
    angle, speed : (t,) arrays
        Of the spin [rad], [rad/s].
    torque : (t,) array
        On the spin [N m].
    effort : (t,) array
        The same without regard to signs [N m].
    """

    loads: np.ndarray
    selection: np.ndarray
    stiffness: np.ndarray
    angle: np.ndarray
    speed: np.ndarray
    torque: np.ndarray
    effort: np.ndarray


class Spin:
    """The free spin, exact for torques that are linear in a step, and the loads that are left."""

    def __init__(self, model, torques, step, speed, separate):
        self.model, self.torques, self.step, self.separate = model, tuple(torques), step, separate
        self.angle, self.speed = 0.0, float(speed)
        carried = model.system.M @ model.rigid
        self.inertia = float(model.rigid @ carried)
        columns = [np.eye(len(carried))[model.index(f"{t.body}: rotation")] for t in self.torques]
        self.carried = carried
        self.share = np.array([column @ model.rigid for column in columns])
        kept = [c - carried * (s / self.inertia if separate else 0.0) for c, s in zip(columns, self.share)]
        self.directions = np.column_stack([model.system.load, *kept])
        self.table = np.zeros((_TABLE + 1, 0))
        if len(model.meshes):
            phase = 2.0 * np.pi * np.arange(_TABLE + 1)[:, None] / _TABLE
            self.table = np.array(FourierSeries(model.stiffness).at(phase))

    def block(self, first: int, count: int) -> Block:
        """The next `count` steps, which begin with step `first`; the spin moves on to their end."""
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
        effort = np.abs(values) @ np.abs(self.share)
        return Block(loads, *self._meshes(angle), angle, speed, torque, effort)

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
class Scheme:
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
    def of(cls, model, rule, h, speed, directions) -> Scheme:
        from scipy import linalg

        system, U = model.system, model.geometry.basic
        M, K, n = system.M, system.K, len(system.M)
        D = system.C + speed * system.gyroscopic
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
class MeshBlock:
    """Small matrices of the ends of the steps of a block.

    Parameters
    ----------
    selection : (t, m, c) array
        Of the meshes, or of all contacts of those that separate.
    stiffness : (t, c) array
    closed : (t, m, m) array
        From x without mesh forces (a row) to the forces on the simple motions when all drive flanks touch.
    """

    selection: np.ndarray
    stiffness: np.ndarray
    closed: np.ndarray

    @classmethod
    def of(cls, scheme: Scheme, block: Block, meshes: int) -> MeshBlock:
        """Of a block whose first `meshes` contacts are drive flanks."""
        S, k = np.ascontiguousarray(block.selection[1:, :, :meshes]), block.stiffness[1:, :meshes]
        St = np.swapaxes(S, 1, 2)
        # transposed: x S k (1 + (S^T F S)^T k)^-1 S^T
        inner = np.matmul(np.swapaxes(np.matmul(scheme.flexibility, S), 1, 2), S) * k[:, None, :]
        inner[:, np.arange(inner.shape[1]), np.arange(inner.shape[1])] += 1.0
        forces = np.linalg.solve(np.swapaxes(inner, 1, 2), k[:, :, None] * St)
        closed = np.matmul(np.swapaxes(forces, 1, 2), St)
        return cls(block.selection[1:], block.stiffness[1:], closed)


def march_closed(scheme: Scheme, meshes: MeshBlock, loads, rows, steps: range) -> None:
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
