"""Wind turbine sets under their weight once more: harmonic balance of its own on `independent`'s springs.

The references of rows "springs between points, harmonic balance of its own": nothing of femgear's models or
solvers. ``M q'' + C q' + K q + sum k w max(w.q - g, 0) = torque + weight`` with sines and cosines up to a
number of harmonics, contact forces sampled over one period, Newton's method, and a chord of given length
from point to point.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from validation.independent import PLANAR, Network, wind_turbine_a, wind_turbine_b

SOURCE = "springs between points, harmonic balance of its own (validation/independent_weight.py)"
GRAVITY = 9.80665
SMOOTHING = 0.3e-6
DAMPING_B = (0.0548, 0.0526, 0.0743, 0.0519)
# size of a displacement [m] and of a frequency [rad/s] on the chord
LENGTH, TURN = 1e-3, 2.0 * math.pi * 50.0


@dataclass
class Weighed:
    """A plane set under torque and weight.

    Parameters
    ----------
    M : (n,) array
    C, K : (n, n) arrays
        Without meshes and clearances.
    W : (m, n) array
        Compression of every flank per unit of the coordinates.
    k, play : (m,) arrays
        Stiffness [N/m] and way to contact [m] of every flank.
    still : (n,) array
        Torque.
    swing : (2, n) array
        Weight times the cosine and the sine of its angle.
    clearance : float or None
        Of a radial bearing between carrier and ring [m].
    bearing : float
        Its stiffness [N/m].
    """

    M: np.ndarray
    C: np.ndarray
    K: np.ndarray
    W: np.ndarray
    k: np.ndarray
    play: np.ndarray
    still: np.ndarray
    swing: np.ndarray
    names: list
    clearance: float | None = None
    bearing: float = 0.0

    def number(self, body: str, axis: int) -> int:
        """Coordinate x, y or rotation (0, 1, 2) of a body."""
        return 3 * self.names.index(body) + axis


def weighed(drive: Network, *, torque: float, turning: float, ratios, back=None, play=math.inf, bearing=None):
    """Model of a set in the frame of its carrier.

    Parameters
    ----------
    drive : Network
        With the flanks that the torque loads.
    torque : float
        On the carrier [N m].
    turning : {1, -1}
        Sense in which the carrier turns.
    ratios : sequence of float
        Damping ratios of different frequencies, ascending, the last one for all others.
    back : Network, optional
        With the other flanks; None puts them on the lines of the first.
    play : float
        Along the line of action [m].
    bearing : (stiffness, clearance), optional
        Between carrier and ring; the clearance None leaves the closed bearing to the damping alone.
    """
    names, n = list(drive.places), 3 * len(drive.places)
    M, _, kept = drive.matrices(PLANAR)
    flanks = [(row.ravel()[kept], k) for kind, row, k in drive.springs if kind in ("sun", "ring")]
    others = [(row.ravel()[kept], k) for kind, row, k in drive.springs if kind not in ("sun", "ring")]
    K = sum(k * np.outer(row, row) for row, k in others)
    W, k = np.array([row for row, _ in flanks]), np.array([k for _, k in flanks])
    closed = K + (W.T * k) @ W
    if bearing is not None:
        for axis in (0, 1):
            row = np.zeros(n)
            row[3 * names.index("carrier") + axis], row[3 * names.index("ring") + axis] = 1.0, -1.0
            closed = closed + bearing[0] * np.outer(row, row)
    plays = np.zeros(len(k))
    if math.isfinite(play):
        mirrored = (
            -W
            if back is None
            else np.array([row.ravel()[kept] for kind, row, _ in back.springs if kind in ("sun", "ring")])
        )
        W, k = np.vstack([W, mirrored]), np.tile(k, 2)
        plays = np.concatenate([plays, np.full(len(plays), play)])
    still, swing = np.zeros(n), np.zeros((2, n))
    still[3 * names.index("carrier") + 2] = torque
    # downwards along -y at the start, turning against the carrier
    swing[0, 1::3] = -GRAVITY * M[1::3]
    swing[1, 0::3] = -turning * GRAVITY * M[0::3]
    stiffness, clearance = bearing if bearing is not None else (0.0, None)
    return Weighed(M, _modal(M, closed, ratios), K, W, k, plays, still, swing, names, clearance, stiffness)


def _modal(M, K, ratios) -> np.ndarray:
    """Viscous damping matrix with a ratio for every different frequency."""
    from scipy.linalg import eigh

    values, shapes = eigh(K, np.diag(M))
    omega = np.sqrt(np.maximum(values, 0.0))
    moving = omega > 1e-6 * omega[-1]
    number = np.cumsum(np.diff(omega[moving], prepend=0.0) > 1e-6 * omega[moving]) - 1
    zeta = np.zeros(len(omega))
    zeta[moving] = np.asarray(ratios)[np.minimum(number, len(ratios) - 1)]
    return (M[:, None] * shapes * (2.0 * zeta * omega)) @ shapes.T * M


class Balance:
    """Residual and derivatives of the balance; unknowns are coefficients (2H + 1, n), mean first."""

    def __init__(self, model: Weighed, harmonics: int, samples: int):
        self.model, self.H = model, harmonics
        angle = 2.0 * np.pi * np.arange(samples) / samples
        h = np.arange(1, harmonics + 1)
        self.waves = np.hstack([np.ones((samples, 1)), np.cos(angle[:, None] * h), np.sin(angle[:, None] * h)])
        self.back = self.waves.T * 2.0 / samples
        self.back[0] /= 2.0
        n = len(model.M)
        self.load = np.zeros((2 * harmonics + 1, n))
        self.load[0], self.load[1], self.load[1 + harmonics] = model.still, *model.swing

    def linear(self, omega: float, wanted: int = 0) -> np.ndarray:
        """Dynamic stiffness (P, n, P, n), or its derivative by the frequency."""
        m, H = self.model, self.H
        n, P = len(m.M), 2 * H + 1
        Z = np.zeros((P, n, P, n))
        if not wanted:
            Z[0, :, 0] = m.K
        for h in range(1, H + 1):
            a, b = h, H + h
            if wanted:
                diagonal, cross = -2.0 * h**2 * omega * np.diag(m.M), h * m.C
            else:
                diagonal, cross = m.K - (h * omega) ** 2 * np.diag(m.M), h * omega * m.C
            Z[a, :, a] = Z[b, :, b] = diagonal
            Z[a, :, b], Z[b, :, a] = cross, -cross
        return Z

    def contact(self, c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Coefficients of the contact forces and their derivative."""
        m, E, B = self.model, self.waves, self.back
        x = E @ c @ m.W.T - m.play
        root = np.sqrt(x * x + SMOOTHING**2)
        force, slope = 0.5 * m.k * (x + root), 0.5 * m.k * (1.0 + x / root)
        n = c.shape[1]
        J = self._spread(slope.T, m.W, m.W)
        F = B @ force @ m.W
        if m.clearance is not None:
            columns = np.zeros((2, n))
            for axis in (0, 1):
                columns[axis, m.number("carrier", axis)], columns[axis, m.number("ring", axis)] = 1.0, -1.0
            u = E @ c @ columns.T
            r = np.maximum(np.hypot(*u.T), 1e-30)
            force, rise = _bearing(r, m.clearance)
            e = u / r[:, None]
            F = F + B @ (m.bearing * force[:, None] * e) @ columns
            both = np.einsum("si,sj->sij", e, e)
            T = rise[:, None, None] * both + (force / r)[:, None, None] * (np.eye(2) - both)
            pairs = [(a, b) for a in (0, 1) for b in (0, 1)]
            slopes = m.bearing * np.array([T[:, a, b] for a, b in pairs])
            J = J + self._spread(slopes, *(columns[list(rows)] for rows in zip(*pairs)))
        return F, J

    def _spread(self, slopes, left, right) -> np.ndarray:
        """Derivative (P, n, P, n) of forces along `left` by motions along `right`, slopes (e, samples)."""
        parts = (self.back[None] * slopes[:, None, :]) @ self.waves
        P, n = self.waves.shape[1], left.shape[1]
        both = np.einsum("ei,ej->eij", left, right).reshape(len(left), -1)
        full = (parts.reshape(len(left), -1).T @ both).reshape(P, P, n, n)
        return full.transpose(0, 2, 1, 3)

    def residual(self, c: np.ndarray, omega: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Residual (N,), derivative by the coefficients (N, N) and by the frequency (N,)."""
        F, J = self.contact(c)
        Z = self.linear(omega)
        rest = np.einsum("piqj,qj->pi", Z, c) + F - self.load
        by_omega = np.einsum("piqj,qj->pi", self.linear(omega, 1), c)
        return rest.ravel(), (Z + J).reshape(c.size, c.size), by_omega.ravel()


def _bearing(r, clearance: float) -> tuple[np.ndarray, np.ndarray]:
    """Force and its rise over the stiffness: springs all around push where the shaft leaves its clearance.

    ``F = (2 / pi) int max(r cos phi - c, 0) cos phi dphi``, which is r without clearance, by Gauss points.
    """
    nodes, weights = np.polynomial.legendre.leggauss(24)
    half = np.arccos(np.minimum(clearance / r, 1.0))
    cosine = np.cos(half[:, None] * nodes)
    share = 2.0 / math.pi * half[:, None] * weights
    return ((r[:, None] * cosine - clearance) * cosine * share).sum(axis=1), (cosine**2 * share).sum(axis=1)


def branch(
    model: Weighed,
    limits,
    *,
    harmonics: int,
    samples: int = 512,
    step: float = 0.02,
    most: int = 3000,
    stop=None,
) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (p,) [Hz] and coefficients (p, 2H + 1, n) along the response from one limit to the other.

    Parameters
    ----------
    model : Weighed
    limits : (float, float)
        [Hz]
    harmonics, samples : int
    step : float
        Longest chord, with displacements in `LENGTH` and frequencies in `TURN`.
    most : int
        Points.
    stop : callable, optional
        Ends the branch, given its frequencies [rad/s].

    Raises
    ------
    RuntimeError
        Newton's method does not converge, however short the chord.
    """
    balance = Balance(model, harmonics, samples)
    omega = 2.0 * math.pi * limits[0]
    c = np.zeros((2 * harmonics + 1, len(model.M)))
    # from closed drive flanks, where a set without its weight rests
    c[0] = np.linalg.solve(model.K + (model.W.T * np.where(model.play > 0.0, 0.0, model.k)) @ model.W, model.still)
    scale = np.abs(balance.load).max()
    for share in np.linspace(0.05, 1.0, 20):
        balance.load[1], balance.load[1 + harmonics] = share * model.swing
        c = _newton(balance, c, omega, scale)
    way = math.copysign(1.0, limits[1] - limits[0])
    tangent = np.zeros(c.size + 1)
    tangent[-1] = way
    points, length = [(omega, c)], step
    low, high = 2.0 * math.pi * np.array([min(limits) - 1e-6, max(limits) + 1e-6])
    while low <= omega <= high and len(points) < most and not (stop and stop([frequency for frequency, _ in points])):
        _, J, by_omega = balance.residual(c, omega)
        new = np.linalg.solve(
            np.vstack([np.column_stack([J * LENGTH, by_omega * TURN]), tangent]),
            np.append(np.zeros(c.size), 1.0),
        )
        tangent = new / np.linalg.norm(new)
        while True:
            point = _corrected(balance, c, omega, tangent, length, scale)
            if point is not None:
                break
            length *= 0.5
            if length < 1e-7:
                raise RuntimeError("the branch is lost")
        c, omega, steps = point
        points.append((omega, c))
        length = min(step, length * (1.4 if steps <= 4 else 1.0))
    return np.array([omega for omega, _ in points]) / (2.0 * math.pi), np.array([c for _, c in points])


def _newton(balance, c, omega, scale):
    for _ in range(60):
        rest, J, _ = balance.residual(c, omega)
        if np.abs(rest).max() < 1e-9 * scale:
            return c
        c = c - np.linalg.solve(J, rest).reshape(c.shape)
    raise RuntimeError("no start")


def _corrected(balance, c, omega, tangent, length, scale):
    """Point at a chord's length along the tangent, across which Newton's method corrects."""
    old = np.append(c.ravel() / LENGTH, omega / TURN)
    y = old + length * tangent
    for steps in range(12):
        rest, J, by_omega = balance.residual(y[:-1].reshape(c.shape) * LENGTH, y[-1] * TURN)
        if np.abs(rest).max() < 1e-9 * scale:
            return y[:-1].reshape(c.shape) * LENGTH, y[-1] * TURN, steps
        A = np.vstack([np.column_stack([J * LENGTH, by_omega * TURN]), tangent])
        y = y - np.linalg.solve(A, np.append(rest, tangent @ (y - old) - length))
    return None


def upper_fold(play: float, turning: float) -> float:
    """Highest limit point [Hz] of set B between 25 and 90 Hz, 9 harmonics; see docs/nrel.md."""
    model = weighed(
        wind_turbine_b(flank=-1.0),
        torque=180e3,
        turning=turning,
        ratios=DAMPING_B,
        play=play,
        back=wind_turbine_b(flank=1.0),
    )

    def fallen(omega):
        # half a hertz behind a limit point above the lower ones
        return max(omega) > 2.0 * math.pi * 50.0 and omega[-1] < max(omega) - math.pi

    hertz, _ = branch(model, (25.0, 90.0), harmonics=9, step=0.05, stop=fallen)
    return _top(np.arange(len(hertz), dtype=float), hertz)[1]


def peak_without_wedging(play: float) -> tuple[float, float]:
    """Peak [Hz] and r.m.s. of the carrier's x [m] of set B, back flanks on the lines of the drive flanks."""
    model = weighed(wind_turbine_b(flank=-1.0), torque=180e3, turning=1.0, ratios=DAMPING_B, play=play)
    return _peak(model, (40.0, 41.5), "carrier", harmonics=3, step=0.02)


def ring_peak(clearance: float | None, limits) -> float:
    """Frequency [Hz] of the largest motion of set A's ring, 9 harmonics, 5 % damping."""
    model = weighed(
        wind_turbine_a(flank=-1.0), torque=322610.0, turning=1.0, ratios=(0.05,), bearing=(3.2e9, clearance)
    )
    return _peak(model, limits, "ring", harmonics=9, step=0.02)[0]


def _peak(model, limits, body, **options):
    hertz, c = branch(model, limits, **options)
    return _top(hertz, np.sqrt(0.5 * (c[:, 1:, model.number(body, 0)] ** 2).sum(axis=1)))


def _top(x, y) -> tuple[float, float]:
    """Place and height of a maximum by a parabola through the three highest points."""
    top = int(np.argmax(y))
    near = slice(top - 1, top + 2)
    a, b, c = np.polyfit(x[near] - x[top], y[near], 2)
    return float(x[top] - 0.5 * b / a), float(c - 0.25 * b * b / a)
