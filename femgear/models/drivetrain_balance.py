"""Settled motion of a drivetrain whose meshes keep contact: linear harmonic balance over several bases.

With the stiffness of the simple motions ``G(theta) = S k S^T = mean + rest`` and their receptance F with
the mean
stiffness, the lines of the motion obey ``x + F(i omega) (rest * x) = x_static`` with * the convolution over
the lattice of orders. The system is linear and there are no samples in time, of which
four bases would need millions.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError, ConvergenceError
from femgear.models.drivetrain import DrivetrainModel, torque_vector
from femgear.solvers.lines import checked_lines, distinct_lines
from femgear.solvers.series import FourierSeries

# A torque that drives the spin, relative to the largest: no settled motion.
_UNBALANCED = 1e-9
# Allowed residual of the equations, relative to the largest line.
_RESIDUAL = 1e-8


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
    residual : float
        Of the linear equations, relative to the largest line.
    tail : float
        Largest line at the border of the lattice over the largest line that is not the mean.
    """

    model: DrivetrainModel
    orders: np.ndarray
    frequency: np.ndarray
    motion: np.ndarray
    displacement: np.ndarray
    residual: float
    tail: float

    @property
    def line_frequency(self) -> np.ndarray:
        """(L,) [rad/s], negative where a side band lies beyond zero."""
        return self.orders @ self.frequency

    def at(self, times) -> tuple[np.ndarray, np.ndarray]:
        """Approach [m] and force [N] of the meshes (n_times, n_meshes)."""
        theta = np.asarray(times, float)[:, None] * self.frequency
        x = (np.exp(1j * theta @ self.orders.T) @ self.motion.T).real
        geometry, model = self.model.geometry, self.model
        turns = theta[:, : 2 * len(geometry.even) : 2] * float(model.turning)
        approach = np.einsum("tmj,tm->tj", geometry.selection(turns), x)
        series = FourierSeries(model.stiffness)
        k = np.empty_like(approach)
        for base in np.unique(model.mesh_base):
            own = model.mesh_base == base
            k[:, own] = series.at(theta[:, base : base + 1])[:, own]
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
    model: DrivetrainModel, torques: dict[str, float], *, speed: float, orders=None, gyroscopic: bool = True
) -> SettledMotion:
    """Motion under constant torques that balance, at a constant speed of the first body.

    Parameters
    ----------
    model : DrivetrainModel
    torques : dict
        On bodies [N m].
    speed : float
        [rad/s]
    orders : (L, n_bases) int array, optional
        From `drivetrain_lines`, its defaults when not given.
    gyroscopic : bool
        With the gyroscopic terms at this speed.

    Raises
    ------
    CaseError
        Torques that drive the spin (E-LOAD-BALANCE).
    ConvergenceError
        The equations are singular: an unstable parametric resonance, or no damping.
    """
    load = model.system.load + torque_vector(model, torques)
    size = np.abs(model.rigid * load).max(initial=0.0)
    if abs(model.rigid @ load) > _UNBALANCED * max(size, 1e-300):
        raise CaseError(
            f"the torques leave {model.rigid @ load:.6g} N m that drive the spin", code="E-LOAD-BALANCE",
            remedy="balance them (balanced_torque), or integrate in time",
        )  # fmt: skip
    orders = checked_lines(drivetrain_lines(model) if orders is None else orders)
    frequency = model.frequencies(speed)
    both = np.vstack([orders, -orders[1:]])
    rest, mean = stiffness_lines(model)
    receptance, solve = receptances(model, mean, both @ frequency, speed if gyroscopic else 0.0)
    m = model.geometry.basic.shape[1]
    coupling = _coupling(both, rest, m)
    static = np.zeros(len(both) * m, complex)
    static[:m] = model.geometry.basic.T @ solve(0, load)
    x, residual = _solved(receptance, coupling, static)
    if not residual < _RESIDUAL:
        raise ConvergenceError(
            f"the lines of the settled motion have a residual of {residual:.2g}", code="E-SINGULAR",
            remedy="add damping, or change the speed",
        )  # fmt: skip
    forces = (coupling @ x).reshape(len(both), m)
    lines = x.reshape(len(both), m)[: len(orders)].T.copy()
    # two-sided to one-sided lines
    lines[:, 1:] *= 2.0
    q = [solve(l, (load if l == 0 else 0.0) - model.geometry.basic @ forces[l]) for l in range(len(orders))]
    q = np.array(q).T
    q[:, 1:] *= 2.0
    return SettledMotion(model, orders, frequency, lines, q, residual, _tail(orders, lines))


def _tail(orders, lines) -> float:
    top = np.abs(orders).max(axis=0)
    border = np.any((np.abs(orders) == top) & (top > 2), axis=1)
    size = np.abs(lines[:, 1:]).max(initial=0.0)
    return float(np.abs(lines[:, border]).max(initial=0.0) / size) if size else 0.0


def stiffness_lines(model: DrivetrainModel):
    """Two-sided lines {orders: (m, m)} of ``S k S^T`` less its mean, and the mean."""
    geometry, n = model.geometry, len(model.bases)
    total: dict[tuple, np.ndarray] = {}
    for j, base in enumerate(model.mesh_base):
        stage = geometry.stage[j]
        half = model.stiffness[j].copy()
        half[1:] *= 0.5
        waves = [(h, half[h]) for h in range(len(half))] + [(-h, half[h].conj()) for h in range(1, len(half))]
        for shift, direction in _direction_lines(model, j, stage):
            for h, k in waves:
                order = [0] * n
                order[base] += h
                if shift:
                    order[2 * stage] += shift
                key = tuple(order)
                total[key] = total.get(key, 0.0) + k * direction
    size = max(np.abs(t).max() for t in total.values())
    total = {key: t for key, t in total.items() if np.abs(t).max() > 1e-15 * size}
    mean = total.pop((0,) * n)
    return total, mean.real


def _direction_lines(model, j, stage):
    """Lines of ``S_j S_j^T`` over the carrier's turn: (order, (m, m))."""
    geometry = model.geometry
    fixed = geometry.fixed[:, j]
    if stage >= len(geometry.even):
        return [(0, np.outer(fixed, fixed))]
    even, odd = geometry.even[stage][:, j], geometry.odd[stage][:, j]
    if not model.turning:
        return [(0, np.outer(fixed + even, fixed + even))]
    vectors = {0: fixed, 1: 0.5 * (even - 1j * odd), -1: 0.5 * (even + 1j * odd)}
    lines: dict[int, np.ndarray] = {}
    for (a, u), (b, v) in itertools.product(vectors.items(), vectors.items()):
        lines[a + b] = lines.get(a + b, 0.0) + np.outer(u, v)
    return list(lines.items())


def receptances(model, mean, omega, speed):
    """``U^T Z^-1 U`` (lines, m, m) with the mean stiffness, and a solver for one line."""
    system, U = model.system, model.geometry.basic
    K = system.K + U @ mean @ U.T
    D = system.C + speed * system.gyroscopic
    carried = system.M @ model.rigid
    # no force of a mesh acts on the spin: any stiffness that holds its mean does
    held = K + np.abs(K).max() / np.abs(carried).max() ** 2 * np.outer(carried, carried)
    dynamic = K - omega[:, None, None] ** 2 * system.M + 1j * omega[:, None, None] * D
    dynamic[omega == 0.0] = held
    table = np.matmul(U.T, np.linalg.solve(dynamic, np.broadcast_to(U, (len(omega), *U.shape))))
    return table, lambda line, force: np.linalg.solve(dynamic[line], force)


def _coupling(orders, rest, m: int):
    """The convolution with ``rest`` as a sparse matrix over lines and simple motions."""
    from scipy import sparse

    at = {tuple(order): number for number, order in enumerate(orders.tolist())}
    rows, columns, values = [], [], []
    for key, stiffness in rest.items():
        i, j = np.nonzero(stiffness)
        pairs = [(at.get(tuple(a + b for a, b in zip(order, key))), column) for order, column in at.items()]
        row, column = np.array([pair for pair in pairs if pair[0] is not None], int).reshape(-1, 2).T
        rows.append((row[:, None] * m + i).ravel())
        columns.append((column[:, None] * m + j).ravel())
        values.append(np.tile(stiffness[i, j], len(row)))
    size = len(orders) * m
    table = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
    return sparse.coo_array(table, shape=(size, size)).tocsr()


def _solved(receptance, coupling, static):
    """Lines (2 L - 1, m) of ``x + F (rest * x) = static`` by one sparse factorisation, and the residual."""
    from scipy import sparse
    from scipy.sparse.linalg import splu

    transfer = sparse.block_diag(list(receptance), format="csr")
    matrix = (sparse.eye_array(static.size, format="csr") + transfer @ coupling).tocsc()
    x = splu(matrix).solve(static)
    return x, float(np.abs(matrix @ x - static).max() / np.abs(x).max())
