"""Equations of the two-way response at one speed, see `femgear.housing.two_way`.

With errors that turn the forces of the meshes have orders ``L = K + seed``, K whole. Where the set without
them is the same after a turn by ``2 pi/N``, its planets move in patterns: with t_j turns from its leader
planet j has

    f_j[L] = f[L] exp(2 pi i s t_j (K + pattern)/N),

so that the structure moves at orders whose K has the residue of -pattern modulo N alone. Neither seeds nor
patterns know of one another. Without errors that turn there is one, seed and pattern zero, of real signals.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.linalg import lu_factor, lu_solve
from scipy.sparse.linalg import LinearOperator, gmres

from femgear.errors import CaseError, checked_count
from femgear.housing.set_damping import SetDamping, complex_times
from femgear.housing.structure import FixedStructure
from femgear.solvers.periodic.spectral import compliance
from femgear.system.system import Modes

_KRYLOV, _STEPS, _TINY = 3e-11, 100, np.finfo(float).tiny
"""Residual of the forces of the damping, and the Krylov steps that may take."""


@dataclass(frozen=True)
class MeshPaths:
    """How the planet-ring meshes run around in the structure.

    Parameters
    ----------
    z_ring : int
        Teeth of the ring, more than ``6 n_max``: side bands of neighbouring mesh harmonics stay apart.
    planet_angles : tuple of float
        In the frame of the carrier, which is the housing's at time zero [rad].
    load_angle : float
        From a planet to the place of its force on the ring [rad].
    symmetry : int
        Turns by ``2 pi/symmetry`` map every planet on one like it; 1 solves for all of them.
    """

    z_ring: int
    planet_angles: tuple[float, ...]
    load_angle: float = 0.0
    symmetry: int = 1


def planet_groups(planet_angles, symmetry: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Find the planets that others repeat after turns by ``2 pi/symmetry``.

    Leaders (G,), group (N,) of every planet, and its turns (N,) from its leader. CaseError: turns that do not
    map the angles [rad] on one another (E-SYMMETRY).
    """
    angles = np.asarray(planet_angles, float)
    checked_count(symmetry, "symmetry", code="E-SYMMETRY")
    apart = (angles[:, None] - angles) * symmetry / (2 * np.pi)
    turns = np.rint(apart)
    alike = np.abs(apart - turns) < 1e-6
    leader = alike.argmax(axis=1)
    leaders, group = np.unique(leader, return_inverse=True)
    turn = turns[np.arange(len(angles)), leader].astype(int) % symmetry
    if sorted(zip(group, turn)) != [(g, t) for g in range(len(leaders)) for t in range(symmetry)]:
        message = f"turns by 360/{symmetry} deg do not map planets at {np.degrees(angles)} deg on one another"
        remedy = "take symmetry 1, which solves for every planet"
        raise CaseError(message, code="E-SYMMETRY", key="symmetry", remedy=remedy)
    return leaders, group, turn


@dataclass(frozen=True)
class CarrierOrders:
    """Orders ``h z_ring + r + seed``, |h| <= harmonics, |r| <= side_bands, and how a structure connects them.

    With the sense of the carrier; n_max is the largest circumferential order of the structure.
    """

    paths: MeshPaths
    harmonics: int
    n_max: int
    side_bands: int
    sense: int
    seed: float = 0.0
    pattern: int = 0

    @property
    def real(self) -> bool:
        """Whether coefficients of negative orders are the conjugates of the positive ones."""
        return self.seed == 0.0 and self.pattern == 0

    @property
    def lowest(self) -> int:
        """Lowest mesh harmonic that is solved for."""
        return 0 if self.real else -self.harmonics

    @property
    def n(self) -> np.ndarray:
        """Circumferential orders."""
        return np.arange(-self.n_max, self.n_max + 1)

    @property
    def every(self) -> np.ndarray:
        """All whole parts K (2 H + 1, R), ascending; those at the same place from the end are negative."""
        h = np.arange(-self.harmonics, self.harmonics + 1)
        return h[:, None] * self.paths.z_ring + np.arange(-self.side_bands, self.side_bands + 1)

    @property
    def positive(self) -> np.ndarray:
        """Whole orders from 0 upwards."""
        return self.every.ravel()[self.every.size // 2 :]

    @property
    def solved(self) -> np.ndarray:
        """Whole parts of the harmonics from `lowest` upwards, those of harmonic 0 with both signs."""
        return self.every[self.harmonics + self.lowest :].ravel()

    def meeting(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Whole parts K of the structure near harmonics from `lowest` upwards, where they meet `solved` L.

        K (n_K,), places (n_L, 2 n_max + 1) of ``L - s n`` among the K and (n_K, 2 n_max + 1) of ``K + s n``
        among the L, their number where there are none.
        """
        near = [(h * self.paths.z_ring + r, h - self.lowest, one)
                for h in range(self.lowest, self.harmonics + 1) for r, one in self.scatter(h)]  # fmt: skip
        width, bands = len(self.n), 2 * self.side_bands + 1
        to = np.full((len(self.solved), width), len(near))
        back = np.full((len(near), width), len(self.solved))
        for i, (_, row, (into, of)) in enumerate(near):
            back[i, of], to[row * bands + into, of] = row * bands + into, i
        return np.array([K for K, *_ in near]), to, back

    def scatter(self, h: int):
        """Side bands r_K of the structure's orders near a harmonic; which r and n stand for ``r_K + s n``."""
        reach = self.side_bands + self.n_max
        for r in range(-reach, reach + 1):
            if (h * self.paths.z_ring + r + self.pattern) % self.paths.symmetry == 0:
                place = r + self.sense * self.n + self.side_bands
                of = np.flatnonzero((place >= 0) & (place <= 2 * self.side_bands))
                yield r, (place[of], of)


def ring_load(symmetry: int, ring: np.ndarray, place: np.ndarray, n: np.ndarray, back: np.ndarray):
    """Circumferential components (n_K, 2 n_max + 1) of all planets' forces by the leaders' (G, n_L)."""
    wave = symmetry * np.exp(-1j * np.outer(place, n))
    padded = np.concatenate([ring, np.zeros((len(ring), 1))], axis=1)
    return np.sum([one[back] * turned for one, turned in zip(padded, wave)], axis=0)


@dataclass(frozen=True)
class LeadingMeshes:
    """Gears and stiffness of the leading meshes, 2 G of them, at two-sided harmonics.

    ``folded`` and ``residual`` are of all meshes that repeat them, by the residue of K + pattern modulo N.
    """

    modes: Modes
    rows: np.ndarray  # (2 G, n_modes) deflections of the leaders
    folded: np.ndarray  # (N, 2 G, n_modes)
    residual: np.ndarray  # (N, 2 G, 2 G) [m/N]
    load: np.ndarray  # (2 G,) deflection by the constant load [m]
    mean: np.ndarray  # (2 G,) stiffness that the modes contain [N/m]
    product: np.ndarray  # (2 G, 2 H + 1, 2 H + 1) convolution with the stiffness [N/m]

    @classmethod
    def build(cls, modes: Modes, stiffness: np.ndarray, orders: CarrierOrders, leaders, group, turn):
        """From harmonics (2 G, 2 count + 1) of the stiffness of the leaders, two-sided."""
        N = orders.paths.symmetry
        meshes = np.concatenate([leaders, len(group) + leaders])
        owner = np.concatenate([group, len(leaders) + group])
        phase = np.exp(2j * np.pi * (orders.sense * np.outer(np.arange(N), turn) % N) / N)
        member = (owner == np.arange(len(meshes))[:, None]) * np.tile(phase, 2)[:, None]
        return cls(
            modes, modes.mesh_deflection[meshes], member @ modes.mesh_deflection,
            np.swapaxes(member @ modes.residual[:, meshes], 1, 2), modes.load_deflection[meshes],
            modes.mesh_stiffness[meshes], convolution(stiffness, orders.harmonics),
        )  # fmt: skip

    def seen(self, orders: CarrierOrders, speed: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Deflections ``d = inverse (b + T k u)`` of the meshes over what the ring gives way, by side band.

        ``inverse`` (S, R, 2 G (2 H + 1), 2 G (2 H + 1)) takes deflections of the meshes by other forces,
        ``inverse T k`` (S, R, 2 G (2 H + 1), G (2 H + 1)) the harmonics of u; and T.
        """
        every, N = orders.every, orders.paths.symmetry
        (S, R), (n, size), G = (len(speed), every.shape[1]), self.product.shape[:2], len(self.rows) // 2
        T = np.empty((S, R, size, n, n), complex)
        for c in range(N):
            h, r = np.nonzero((every + orders.pattern) % N == c)
            pairs = (self.rows[:, None] * self.folded[c]).reshape(n * n, -1)
            modal = compliance(self.modes, speed[:, None] * (every[h, r] + orders.seed))
            T[:, r, h] = (modal @ pairs.T).reshape(S, -1, n, n) + self.residual[c]
        # unknowns (mesh, harmonic): d + T (k - mean) d = d_load - T F' + T k u
        fluctuating = self.product - self.mean[:, None, None] * np.eye(size)
        left = np.einsum("srhij,jhk->srihjk", T, fluctuating).reshape(S, R, n * size, n * size)
        left += np.eye(n * size)
        moved = np.einsum("srhij,jhk->srihjk", T[..., G:], self.product[G:])
        inverse = np.linalg.inv(left)
        return inverse, inverse @ moved.reshape(S, R, n * size, G * size), T

    def forces(self, d: np.ndarray, u: np.ndarray, source: np.ndarray) -> np.ndarray:
        """Forces (2 G, 2 H + 1, R) by deflections (R, 2 G, 2 H + 1), by u (R, G, 2 H + 1), and the source."""
        G = u.shape[1]
        force = self.product @ d.transpose(1, 2, 0) + source
        force[G:] -= self.product[G:] @ u.transpose(1, 2, 0)
        return force


def convolution(stiffness: np.ndarray, harmonics: int) -> np.ndarray:
    """Matrices (n, 2 H + 1, 2 H + 1) that multiply harmonics by those of a stiffness (n, 2 count + 1)."""
    count, size = stiffness.shape[1] // 2, 2 * harmonics + 1
    apart = np.subtract.outer(np.arange(size), np.arange(size))
    inside = np.abs(apart) <= count
    return np.where(inside, stiffness[:, np.where(inside, apart, 0) + count], 0.0)


def two_sided(one_sided: np.ndarray) -> np.ndarray:
    """Coefficients -H .. H of exp(i h omega t) of harmonics (..., H + 1) of Re sum X exp(i h omega t)."""
    half = 0.5 * one_sided[..., 1:]
    return np.concatenate([half[..., ::-1].conj(), np.real(one_sided[..., :1]), half], axis=-1)


def receptance(structure: FixedStructure, speed: np.ndarray, order: np.ndarray) -> np.ndarray:
    """Modal receptances (S, n_orders, m) [s^2] at orders of speeds (S,) [rad/s]."""
    natural, omega = structure.natural_frequency, np.multiply.outer(speed, order)[..., None]
    return 1.0 / (natural**2 - omega**2 + 2j * structure.damping_ratio * natural * omega)


def _ring(structure: FixedStructure, orders: CarrierOrders, place: np.ndarray, speed: np.ndarray):
    """What the ring gives way at the leaders per force, all harmonics: (S, 2 H + 1, G, R, G, R) [m/N]."""
    P, n, R, G = structure.ring_shape, orders.n, orders.every.shape[1], len(place)
    low, top = np.triu_indices(len(n))  # of (n', n) the modes' product is conjugate
    pairs = P[:, low] * P[:, top].conj()
    pairs, count = np.hstack([np.real(pairs), np.imag(pairs)]), len(low)
    wave = np.exp(1j * np.outer(place, n))
    found = np.zeros((len(speed), orders.harmonics + 1 - orders.lowest, G, R, G, R), complex)
    for row, h in enumerate(range(orders.lowest, orders.harmonics + 1)):
        places = list(orders.scatter(h))
        order = h * orders.paths.z_ring + np.array([r for r, _ in places]) + orders.seed
        both = complex_times(receptance(structure, speed, order), pairs)
        every = np.empty((len(speed), len(order), len(n), len(n)), complex)
        every[..., top, low] = both[..., :count] - 1j * both[..., count:]
        every[..., low, top] = both[..., :count] + 1j * both[..., count:]
        every = orders.paths.symmetry * (every + structure.residual)
        for one, (_, (r, of)) in zip(np.moveaxis(every, 1, 0), places):
            # places rise or fall by one
            to, part = slice(r.min(), r.max() + 1), of[np.argsort(r)]
            block = one[:, part[:, None], part]
            for g in range(G):
                for k in range(G):
                    turned = wave[g, part, None] * wave[k, part].conj()
                    found[:, row, g, to, k, to] += turned * block
    if not orders.real:
        return found
    # of negative harmonics: both side bands change their sign
    return np.concatenate([found[:, :0:-1, :, ::-1, :, ::-1].conj(), found], axis=1)


def equations(
    gears: LeadingMeshes, structure: FixedStructure, place: np.ndarray, orders: CarrierOrders,
    speed: np.ndarray, damping: SetDamping | None,
) -> Iterator[SpeedEquations]:  # fmt: skip
    """Make the equations of the leaders at places (G,) [rad] of their forces, factored, one speed a time.

    Speeds of the carrier (S,) [rad/s], positive.
    """
    inverse, seen, T = gears.seen(orders, speed)
    R = _ring(structure, orders, place, speed)
    (size, bands), S, G = orders.every.shape, len(speed), len(place)
    first, rows = orders.harmonics + orders.lowest, orders.harmonics + 1 - orders.lowest
    Y = np.einsum("jhk,srjkc->srjhc", gears.product[G:], seen.reshape(S, bands, 2 * G, size, -1)[:, :, G:])
    Y = Y.reshape(S, bands, G, size, G, size)
    for g in range(G):
        Y[:, :, g, :, g] -= gears.product[G + g]
    left = np.zeros((S, G, rows, bands, G, size, bands), complex)
    for g in range(G):
        for b in range(G):
            of = np.moveaxis(Y[:, :, g, first:, b], 1, 2)
            for k in range(G):
                left[:, g, :, :, k] -= of[..., None] * np.moveaxis(R[:, :, b, :, k], 1, 2)[:, None]
    skipped = bands // 2 if orders.real else 0
    left = left.reshape(S, G, rows * bands, G, size * bands)[:, :, skipped:]
    row, column = np.arange(left.shape[2]), first * bands + skipped
    for g in range(G):
        left[:, g, row, g, column + row] += 1.0
    matrices = _real(left) if orders.real else left.reshape(S, G * len(row), -1)
    R, meeting = R.reshape(S, size, G * bands, G * bands), orders.meeting()
    for i, matrix in enumerate(matrices):
        own = (
            compliance(gears.modes, speed[i] * (orders.solved + orders.seed)),
            receptance(structure, speed[i], meeting[0] + orders.seed),
        )
        factors = lu_factor(matrix, overwrite_a=True, check_finite=False)
        yield SpeedEquations(
            gears, structure, orders, place, meeting, damping, speed[i], inverse[i], seen[i], T[i], R[i],
            factors, own,
        )  # fmt: skip


@dataclass(frozen=True)
class SpeedEquations:
    """Equations of one speed [rad/s], with the factors of those of the leaders' planet-ring forces."""

    gears: LeadingMeshes
    structure: FixedStructure
    orders: CarrierOrders
    place: np.ndarray
    meeting: tuple[np.ndarray, np.ndarray, np.ndarray]
    damping: SetDamping | None
    speed: float
    inverse: np.ndarray
    seen: np.ndarray
    compliance: np.ndarray
    ring: np.ndarray
    factors: tuple[np.ndarray, np.ndarray]
    receptance: tuple[np.ndarray, np.ndarray]  # of the modes of gears and structure, (n_L or n_K, modes)

    def solve(self, source: np.ndarray, near: Motion | None = None, loose: float = 1.0) -> Motion:
        """Solve for the motion by forces of the meshes (2 G, 2 H + 1, R) [N], and by the load (real signals).

        The forces of the meshes are the source and what the stiffness makes of their deflection. Those of the
        damping start from a motion nearby; their residual may be so many times that of other sources.
        """
        gears, structure = (np.zeros_like(one) for one in self.receptance)
        damping, by_source = self.damping, self._moved_by(source)
        if damping is None:
            return self._respond(source, by_source, gears, structure)

        def split(flat: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            values = flat.view(complex)
            return values[: gears.size].reshape(gears.shape), values[gears.size :].reshape(structure.shape)

        def changed(flat: np.ndarray) -> tuple[Motion, np.ndarray]:
            found = self._respond(source, by_source, *split(flat))
            damped = damping.forces(self.speed, *found.modal)
            return found, np.concatenate([one.ravel() for one in damped]).view(float)

        start = changed(np.zeros(2 * (gears.size + structure.size)))[1]
        operator: Any = LinearOperator
        product = operator(
            (start.size,) * 2, matvec=lambda flat: flat + start - changed(flat)[1], dtype=float
        )
        known: Any = {"x0": None if near is None else near.damped, "rtol": min(loose * _KRYLOV, 0.1)}
        flat = gmres(product, start, restart=_STEPS, maxiter=1, **known)[0]
        found, again = changed(flat)
        apart = float(np.linalg.norm(again - flat) / max(np.linalg.norm(flat), _TINY))
        residual = max(found.residual, apart / loose)
        return replace(found, residual=residual, damped=flat, drag=split(flat)[1])

    def _moved_by(self, source: np.ndarray) -> np.ndarray:
        """Deflections (R, 2 G (2 H + 1)) by a source (2 G, 2 H + 1, R) and the load, the ring at rest."""
        some = np.flatnonzero(source.any(axis=(0, 1)))
        still = np.zeros((source.shape[2], *source.shape[:2]), complex)
        still[some] = -np.einsum("rhij,jhr->rih", self.compliance[some], source[..., some])
        if self.orders.real:
            still[len(still) // 2, :, source.shape[1] // 2] += self.gears.load
        return (self.inverse @ still.reshape(len(still), -1, 1))[..., 0]

    def _respond(
        self, source: np.ndarray, by_source: np.ndarray, on_gears: np.ndarray, on_structure: np.ndarray
    ) -> Motion:
        """Motion by a source and by forces on the modes, (n_L or n_K, modes)."""
        gears, orders, (_, to, back), P = self.gears, self.orders, self.meeting, self.structure.ring_shape
        (size, bands), G, first = orders.every.shape, len(self.place), orders.harmonics + orders.lowest
        compliant, receptance = self.receptance
        path = np.vstack([(receptance * on_structure) @ P, np.zeros(P.shape[1])])
        path = path[to, np.arange(P.shape[1])] @ np.exp(1j * np.outer(orders.n, self.place))
        given = self._both(path)
        d = (self.inverse @ self._both((compliant * on_gears) @ gears.rows.T).reshape(bands, -1, 1))[..., 0]
        d += by_source

        def deflections(u: np.ndarray) -> np.ndarray:
            moved = (self.seen @ u.reshape(bands, -1, 1))[..., 0]
            return (d + moved).reshape(bands, 2 * G, size)

        ring = gears.forces(deflections(given), given, source)[G:].reshape(G, -1)
        if orders.real:
            found = mirrored(_solve_real(self.factors, ring[:, size * bands // 2 :]))
        else:
            found = lu_solve(self.factors, ring.ravel(), check_finite=False)
        found = found.reshape(G, size, bands)
        moved = self.ring @ found.transpose(1, 0, 2).reshape(size, -1, 1)
        u = given + moved.reshape(size, G, bands).transpose(2, 1, 0)
        d = deflections(u)
        force = gears.forces(d, u, source)
        residual = float(np.linalg.norm(force[G:] - found) / max(np.linalg.norm(found), _TINY))
        deflection = d.transpose(1, 2, 0)
        excess = force - gears.mean[:, None, None] * deflection
        excess, load = excess[:, first:].reshape(2 * G, -1).T, np.empty_like(on_gears)
        for c, folded in enumerate(gears.folded):
            own = (orders.solved + orders.pattern) % len(gears.folded) == c
            load[own] = excess[own] @ folded
        components = ring_load(
            orders.paths.symmetry, found[:, first:].reshape(G, -1), self.place, orders.n, back
        )
        modal = components @ P.conj().T
        motions = compliant * (on_gears - load), receptance * (on_structure + modal)
        return Motion(force, deflection, u.transpose(1, 2, 0), residual, motions)

    def _both(self, solved: np.ndarray) -> np.ndarray:
        """Harmonics of both signs (R, n, 2 H + 1) of those that are solved for (n_L, n)."""
        bands = self.orders.every.shape[1]
        found = solved.reshape(-1, bands, solved.shape[1])
        if self.orders.real:
            found = np.concatenate([found[:0:-1, ::-1].conj(), found])
        return found.transpose(1, 2, 0)


@dataclass(frozen=True)
class Motion:
    """Two-sided forces and motions at one speed.

    Parameters
    ----------
    force : (2 G, 2 H + 1, R) complex array
        [N].
    deflection : (2 G, 2 H + 1, R) complex array
        Of the meshes over a ring at rest [m].
    way : (G, 2 H + 1, R) complex array
        What the ring gives way [m].
    modal : tuple of arrays
        Motions of the modes of gears (n_L, modes) and structure (n_K, modes), without a load [m kg^1/2].
    damped : array, optional
        Forces of the damping of the set beyond that of the modes of gears and structure, as real numbers.
    drag : (n_K, modes) complex array, optional
        Of them those on the modes of the structure [N kg^-1/2].
    """

    force: np.ndarray
    deflection: np.ndarray
    way: np.ndarray
    residual: float
    modal: tuple[np.ndarray, np.ndarray]
    damped: np.ndarray | None = None
    drag: np.ndarray | None = None


def mirrored(half: np.ndarray) -> np.ndarray:
    """Two-sided coefficients of real signals, of those from 0 upwards (..., n)."""
    return np.concatenate([half[..., :0:-1].conj(), half], axis=-1)


def _real(left: np.ndarray) -> np.ndarray:
    """Equations (S, n_unknowns, n_unknowns) of real and imaginary parts of real signals.

    Of coefficients from 0 upwards, left (S, G, n, G, 2 n - 1) two-sided: those of negative orders are the
    conjugates.
    """
    S, G, n = left.shape[:3]
    plus, minus = left[..., n - 1 :], left[..., n - 1 :: -1]
    same, other = plus + minus, plus[..., 1:] - minus[..., 1:]
    same[..., 0] = plus[..., 0]
    matrix = np.empty((S, G, 2 * n - 1, G, 2 * n - 1))
    matrix[:, :, :n, :, :n], matrix[:, :, :n, :, n:] = np.real(same), -np.imag(other)
    matrix[:, :, n:, :, :n], matrix[:, :, n:, :, n:] = np.imag(same[:, :, 1:]), np.real(other[:, :, 1:])
    return matrix.reshape(S, G * (2 * n - 1), -1)


def _solve_real(factors, source: np.ndarray) -> np.ndarray:
    """Coefficients (G, n) from 0 upwards, by the factors of the matrix that `_real` makes."""
    right = np.concatenate([np.real(source), np.imag(source[:, 1:])], axis=-1)
    found = lu_solve(factors, right.ravel(), check_finite=False).reshape(right.shape)
    n = source.shape[1]
    return found[:, :n] + 1j * np.pad(found[:, n:], ((0, 0), (1, 0)))
