"""Two-way response of a planetary set and a housing that stands still, in orders of the carrier.

Gears and carrier do not change with time in the frame of the carrier, ring and casing do not in space. Mesh j
stands at the housing angle ``phi_j + s theta``, ``theta = |Omega_c| t``, s the sense of the carrier, and
everything repeats after a turn. With ``x(t) = sum_L x[L] exp(i L theta)``, modes m of the structure, their
receptances H_m and circumferential coefficients P (`femgear.housing.structure.FixedStructure`)

    q_m[K] = H_m(K Omega) sum_j sum_n conj(P[m, n]) exp(-i n phi_j) f_j[K + s n]
    u_j[L] = sum_m sum_n P[m, n] exp(i n phi_j) q_m[L - s n]                   (what the ring gives way)
    d_j[L] = d_load delta_L0 - sum_k T_jk(L Omega) (f - k0 d)_k[L]             (gears against a rigid ring)
    f_j    = F_j + k_j (d_j - u_j - ste_j),

a harmonic transfer function (N. M. Wereley, Analysis and Control of Linear Periodically Time Varying Systems,
PhD thesis, MIT, 1991). k, F and ste have orders that are multiples of z_ring: the gears couple L with L + p
z_ring alone, the structure the side bands of one mesh harmonic. Orders are ``h z_ring + r``, |h| <= H,
|r| <= 2 n_max. A set that is the same after a turn by ``2 pi/N`` repeats itself in time, ``f_j(theta) =
f_i(theta + s (phi_j - phi_i))``: one of N planets is solved for, and q_m[K] vanishes unless N divides K, on
any structure.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import lu_factor, lu_solve
from scipy.sparse.linalg import LinearOperator, gmres

from femgear.errors import CaseError, ConvergenceError, checked_count
from femgear.housing.sensor import ReadOnlyArrays
from femgear.housing.set_damping import SetDamping, complex_times, set_damping
from femgear.housing.structure import FixedStructure
from femgear.solvers.periodic.spectral import compliance
from femgear.system.system import MeshExcitation, Modes, mesh_harmonics

_EQUAL, _RESIDUAL = 1e-9, 1e-8
"""Part of the largest harmonic by which meshes that repeat others may differ; residual that is refused."""
_KRYLOV, _STEPS = 3e-11, 100
"""Residual of the forces of the damping, and the Krylov steps that may take."""
_MEMORY, _MOST, _BYTES = 6e7, 4e9, 130
"""Size of the speeds that are solved together, of one at most, and of one unknown times one [bytes]."""


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


@dataclass(frozen=True)
class TwoWayResponse(ReadOnlyArrays):
    """Forces of the meshes over carrier orders: ``Re sum_k force[k] exp(i order[k] |carrier_speed| t)``.

    Parameters
    ----------
    carrier_speed : (n_speeds,) array
        [rad/s], counter-clockwise positive.
    order : (n_orders,) int array
        From 0 upwards.
    force : (n_speeds, 2 G, n_orders) complex array
        Of the sun-planet, then the planet-ring meshes of the G planets that the others repeat [N].
    residual : (n_speeds,) array
        Of the planet-ring forces in their equations, over their norm.
    tail : (n_speeds,) array
        Share of the fluctuating planet-ring forces beyond n_max side bands (root of energies), a measure of
        truncation.
    harmonics, side_bands : int
        Mesh harmonics H, and side bands on either side of each.
    paths : MeshPaths
    drag : (n_speeds, n_lines, m) complex array, optional
        Two-sided modal forces on the structure [N kg^-1/2] by the damping of the set beyond that of its
        modes, at the orders of `structure_lines`.
    """

    carrier_speed: np.ndarray
    order: np.ndarray
    force: np.ndarray
    residual: np.ndarray
    tail: np.ndarray
    harmonics: int
    side_bands: int
    paths: MeshPaths
    drag: np.ndarray | None = None


def solve_two_way(
    gears: Modes,
    excitation: MeshExcitation,
    structure: FixedStructure,
    paths: MeshPaths,
    carrier_speed,
    *,
    harmonics: tuple[int, int] = (6, 12),
    side_bands: int | None = None,
    damping=None,
) -> TwoWayResponse:
    """Solve for the mesh forces of a set in a housing that stands still, at all speeds.

    Parameters
    ----------
    gears : Modes
        Of gears and carrier with mean mesh stiffnesses against a rigid ring: N sun-planet, then N planet-ring
        meshes. Without `damping` what damps them acts against the ring at rest.
    excitation : MeshExcitation
        Of the 2N meshes, over one mesh period; their stiffness without what the structure is elastic.
    structure : FixedStructure
    paths : MeshPaths
    carrier_speed : (n_speeds,) array
        [rad/s], counter-clockwise positive, all of one direction.
    harmonics : (int, int)
        Mesh harmonics kept in the data, and in the response.
    side_bands : int, optional
        Of every harmonic of the forces; default ``2 n_max``. An axisymmetric structure makes none.
    damping : (n, n) array, optional
        Of gears and ring as a whole, see `femgear.housing.set_damping.set_damping` [N s/m, ...]; without it
        gears and structure have each the modal damping of its own.

    Raises
    ------
    CaseError
        Data that do not belong together, planets that do not repeat one another (E-SYMMETRY), E-MEMORY.
    """
    n_max, angles = structure.max_diameter, np.asarray(paths.planet_angles, float)
    speeds = _checked(gears, excitation, carrier_speed, paths, n_max, harmonics)
    groups, bands = planet_groups(angles, paths.symmetry), 2 * n_max if side_bands is None else side_bands
    orders = _Orders(paths, harmonics[1], n_max, bands, int(np.sign(speeds[0])))
    one_sided = mesh_harmonics(excitation, harmonics[0])
    _check_repeated(one_sided, orders, *groups)
    known, place = _Gears.build(gears, one_sided, orders, *groups), angles[groups[0]] + paths.load_angle
    count, n_orders = len(place), len(orders.positive)
    size = _checked_size(count, n_orders)
    # without side bands what the ring gives way takes more than the unknowns
    step = max(int(_MEMORY / (size + _BYTES * (2 * n_max + 1) ** 3)), 1)
    drag, (order, to, back) = None, orders.meeting()
    if damping is not None:
        placed: Any = {"symmetry": paths.symmetry, "sense": orders.sense}
        damping = set_damping(damping, gears, structure, orders.upper, order, to, back, **placed)
        drag = np.empty((len(speeds), (order >= 0).sum(), len(structure.natural_frequency)), complex)
    force = np.empty((len(speeds), 2 * count, n_orders), complex)
    residual, tail = np.empty((2, len(speeds)))

    def solve(first: int) -> None:
        speed = np.abs(speeds[first : first + step])
        for i, found in enumerate(_solve(known, structure, place, orders, speed, damping), first):
            force[i], residual[i], tail[i] = found[:3]
            if drag is not None:
                drag[i] = found[3][order >= 0]

    workers = max(min(os.cpu_count() or 1, int(_MOST / 10 / (size * step))), 1)
    with ThreadPoolExecutor(workers) as pool:  # BLAS and LAPACK do not hold up one another
        list(pool.map(solve, range(0, len(speeds), step)))
    _check_residual(residual, speeds)
    return TwoWayResponse(speeds, orders.positive, force, residual, tail, harmonics[1], bands, paths, drag)


def structure_lines(structure: FixedStructure, response: TwoWayResponse) -> tuple[np.ndarray, np.ndarray]:
    """Compute the lines of the sensors of a structure under forces that run around in it.

    Carrier orders (n_orders,) from 0, multiples of the symmetry, and displacements
    (n_speeds, n_sensors, n_orders) [m] of ``u(t) = Re sum_k u[k] exp(i order[k] |carrier_speed| t)``. The
    sensors stand still: nothing is modulated after that.
    """
    paths, H, speed = response.paths, response.harmonics, np.abs(response.carrier_speed)
    leaders = planet_groups(paths.planet_angles, paths.symmetry)[0]
    sense = int(np.sign(response.carrier_speed[0]))
    orders = _Orders(paths, H, structure.max_diameter, response.side_bands, sense)
    order, _, back = orders.meeting()
    back, order = back[order >= 0], order[order >= 0]
    place = np.array(paths.planet_angles)[leaders] + paths.load_angle
    ring = _mirrored(response.force[:, len(place) :] * np.where(response.order == 0, 1.0, 0.5))
    ring = ring[..., -len(orders.upper) :]
    lines = np.empty((len(speed), len(order), structure.sensor_shape.shape[1]), complex)
    for i in range(len(speed)):  # one by one: modes at all orders of all speeds would fill the memory
        load = orders.load(ring[i], place, back)
        modal = load @ structure.ring_shape.conj().T
        if response.drag is not None:
            modal += response.drag[i]
        modal *= _receptance(structure, speed[i], order)
        lines[i] = load @ structure.sensor_residual.T + modal @ structure.sensor_shape
    lines = np.swapaxes(lines, 1, 2) * np.where(order == 0, 1.0, 2.0)
    return order, np.where(order == 0, np.real(lines), lines)


def _checked(gears, excitation, carrier_speed, paths, n_max, harmonics) -> np.ndarray:
    """Speeds (n_speeds,) [rad/s] of data that belong together."""
    checked_count(harmonics[0], "excitation harmonics", code="E-HARMONICS")
    checked_count(harmonics[1], "response harmonics", code="E-HARMONICS", least=harmonics[0])
    teeth = checked_count(paths.z_ring, "ring teeth", code="E-TEETH")
    if teeth <= 6 * n_max:
        message = f"side bands of {n_max} nodal diameters overlap between the harmonics of {teeth} teeth"
        raise CaseError(message, code="E-RANGE", limit=f"up to {(teeth - 1) // 6} nodal diameters")
    if excitation.periods != 1:
        message = f"the excitation spans {excitation.periods} mesh periods"
        raise CaseError(message, code="E-PERIODS", limit="one")
    meshes = len(gears.mesh_stiffness), len(excitation.stiffness), 2 * len(paths.planet_angles)
    if len({*meshes}) > 1:
        message = f"modes, excitation and planets of {meshes} meshes do not fit each other"
        raise CaseError(message, code="E-SHAPE", limit="two meshes a planet")
    speeds = np.atleast_1d(np.asarray(carrier_speed, float))
    sense = np.unique(np.sign(speeds))
    if speeds.ndim != 1 or len(sense) != 1 or sense[0] == 0 or not np.isfinite(speeds).all():
        message, limit = "speeds of the carrier must be one list", "finite, of one direction, none zero"
        raise CaseError(message, code="E-SPEED", key="carrier_speed", value=carrier_speed, limit=limit)
    return speeds


def _check_residual(residual: np.ndarray, speeds: np.ndarray) -> None:
    """Refuse equations that are singular at a speed (n_speeds,) [rad/s] (E-RESONANCE)."""
    if not (residual < _RESIDUAL).all():
        worst = int(np.argmax(np.where(np.isfinite(residual), residual, np.inf)))
        message = f"residual {residual[worst]:.3e} of the two-way equations at {speeds[worst]:.6g} rad/s"
        remedy = "give gears and structure some damping"
        raise ConvergenceError(message, code="E-RESONANCE", limit=f"{_RESIDUAL:g}", remedy=remedy)


def _checked_size(planets: int, orders: int) -> float:
    """Memory of one speed [bytes], refused where it is too much (E-MEMORY)."""
    size = _BYTES * (planets * orders) ** 2
    if size > _MOST:
        message = f"{planets} planets with {orders} carrier orders need {size / 1e9:.2g} GB"
        raise CaseError(message, code="E-MEMORY", remedy="take fewer mesh harmonics or nodal diameters")
    return size


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
class _Orders:
    """Carrier orders ``h z_ring + r`` and how the structure connects them, with the sense of the carrier."""

    paths: MeshPaths
    harmonics: int
    n_max: int
    side_bands: int
    sense: int

    @property
    def n(self) -> np.ndarray:
        """Circumferential orders."""
        return np.arange(-self.n_max, self.n_max + 1)

    @property
    def every(self) -> np.ndarray:
        """All orders (2 H + 1, R), ascending; the one at the same place from the end is the negative."""
        h = np.arange(-self.harmonics, self.harmonics + 1)
        return h[:, None] * self.paths.z_ring + np.arange(-self.side_bands, self.side_bands + 1)

    @property
    def positive(self) -> np.ndarray:
        """Orders from 0 upwards."""
        return self.every.ravel()[self.every.size // 2 :]

    @property
    def upper(self) -> np.ndarray:
        """Orders of the harmonics from 0 upwards, those of harmonic 0 with both signs."""
        return self.every[self.harmonics :].ravel()

    def meeting(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Orders K of the structure near harmonics from 0 upwards, and where they meet the `upper` orders L.

        K (n_K,), places (n_L, 2 n_max + 1) of ``L - s n`` among the K and (n_K, 2 n_max + 1) of ``K + s n``
        among the L, their number where there are none.
        """
        near = [(h * self.paths.z_ring + r, h, one) for h in range(self.harmonics + 1)
                for r, one in self.scatter(h)]  # fmt: skip
        width, bands = len(self.n), 2 * self.side_bands + 1
        to = np.full((len(self.upper), width), len(near))
        back = np.full((len(near), width), len(self.upper))
        for i, (_, h, (into, of)) in enumerate(near):
            back[i, of], to[h * bands + into, of] = h * bands + into, i
        return np.array([K for K, *_ in near]), to, back

    def load(self, ring: np.ndarray, place: np.ndarray, back: np.ndarray) -> np.ndarray:
        """Circumferential components (n_K, 2 n_max + 1) of all planets' forces by the leaders' (G, n_L)."""
        wave = self.paths.symmetry * np.exp(-1j * np.outer(place, self.n))
        padded = np.concatenate([ring, np.zeros((len(ring), 1))], axis=1)
        return np.sum([one[back] * turned for one, turned in zip(padded, wave)], axis=0)

    def scatter(self, h: int):
        """Side bands r_K of the structure's orders near a harmonic; which r and n stand for ``r_K + s n``."""
        reach = self.side_bands + self.n_max
        for r in range(-reach, reach + 1):
            if (h * self.paths.z_ring + r) % self.paths.symmetry == 0:
                place = r + self.sense * self.n + self.side_bands
                of = np.flatnonzero((place >= 0) & (place <= 2 * self.side_bands))
                yield r, (place[of], of)


@dataclass(frozen=True)
class _Gears:
    """Gears and excitation of the leading meshes, 2 G of them, at two-sided harmonics."""

    modes: Modes
    rows: np.ndarray  # (2 G, n_modes) deflections of the leaders
    folded: np.ndarray  # (N, 2 G, n_modes) of all that repeat them, by the residue of the order modulo N
    residual: np.ndarray  # (N, 2 G, 2 G) [m/N]
    load: np.ndarray  # (2 G,) deflection by the constant load [m]
    mean: np.ndarray  # (2 G,) stiffness that the modes contain [N/m]
    product: np.ndarray  # (2 G, 2 H + 1, 2 H + 1) convolution with the stiffness [N/m]
    forcing: np.ndarray  # (2 G, 2 H + 1) F - k ste [N]

    @classmethod
    def build(cls, modes: Modes, one_sided, orders: _Orders, leaders, group, turn) -> _Gears:
        """From harmonics (2N, count + 1) of stiffness, deflection and force of all meshes."""
        N, H = orders.paths.symmetry, orders.harmonics
        meshes = np.concatenate([leaders, len(group) + leaders])
        owner = np.concatenate([group, len(leaders) + group])
        phase = np.exp(2j * np.pi * (orders.sense * np.outer(np.arange(N), turn) % N) / N)
        member = (owner == np.arange(len(meshes))[:, None]) * np.tile(phase, 2)[:, None]
        stiffness, deflection, force = (_two_sided(values[meshes]) for values in one_sided)
        count = stiffness.shape[1] // 2
        apart = np.subtract.outer(np.arange(2 * H + 1), np.arange(2 * H + 1))
        inside = np.abs(apart) <= count
        product = np.where(inside, stiffness[:, np.where(inside, apart, 0) + count], 0.0)
        wide = ((0, 0), (H - count, H - count))
        forcing = np.pad(force, wide) - np.einsum("mhk,mk->mh", product, np.pad(deflection, wide))
        return cls(
            modes, modes.mesh_deflection[meshes], member @ modes.mesh_deflection,
            np.swapaxes(member @ modes.residual[:, meshes], 1, 2), modes.load_deflection[meshes],
            modes.mesh_stiffness[meshes], product, forcing,
        )  # fmt: skip

    def seen(self, orders: _Orders, speed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Deflections ``d = inverse (b + T k u)`` of the meshes over what the ring gives way, by side band.

        ``inverse`` (S, R, 2 G (2 H + 1), 2 G (2 H + 1)) takes deflections of the meshes by other forces;
        ``inverse [T k, b]`` (S, R, 2 G (2 H + 1), G (2 H + 1) + 1) has columns of the harmonics of u, then
        what the excitation does.
        """
        every, N = orders.every, orders.paths.symmetry
        (S, R), (n, size), G = (len(speed), every.shape[1]), self.forcing.shape, len(self.rows) // 2
        T = np.empty((S, R, size, n, n), complex)
        for c in range(N):
            h, r = np.nonzero(every % N == c)
            pairs = (self.rows[:, None] * self.folded[c]).reshape(n * n, -1)
            modal = compliance(self.modes, speed[:, None] * every[h, r])
            T[:, r, h] = (modal @ pairs.T).reshape(S, -1, n, n) + self.residual[c]
        # unknowns (mesh, harmonic): d + T (k - mean) d = d_load - T F' + T k u
        fluctuating = self.product - self.mean[:, None, None] * np.eye(size)
        whole = (S, R, n * size)
        left = np.einsum("srhij,jhk->srihjk", T, fluctuating).reshape(*whole, n * size)
        left += np.eye(n * size)
        moved = np.einsum("srhij,jhk->srihjk", T[..., G:], self.product[G:]).reshape(*whole, G * size)
        still = -np.einsum("shij,jh->sih", T[:, R // 2], self.forcing)
        still[:, :, size // 2] += self.load
        middle = np.zeros((S, R, n * size, 1), complex)
        middle[:, R // 2, :, 0] = still.reshape(S, -1)
        inverse = np.linalg.inv(left)
        return inverse, inverse @ np.concatenate([moved, middle], axis=-1)

    def forces(self, d: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Forces (2 G, 2 H + 1, R) by deflections (R, 2 G, 2 H + 1), and by u (R, G, 2 H + 1)."""
        G = u.shape[1]
        force = self.product @ d.transpose(1, 2, 0)
        force[G:] -= self.product[G:] @ u.transpose(1, 2, 0)
        force[..., len(d) // 2] += self.forcing
        return force


def _two_sided(one_sided: np.ndarray) -> np.ndarray:
    """Coefficients -H .. H of exp(i h omega t) of harmonics (..., H + 1) of Re sum X exp(i h omega t)."""
    half = 0.5 * one_sided[..., 1:]
    return np.concatenate([half[..., ::-1].conj(), np.real(one_sided[..., :1]), half], axis=-1)


def _check_repeated(one_sided, orders: _Orders, leaders, group, turn) -> None:
    """Refuse planets whose meshes do not repeat those of their leaders (E-SYMMETRY)."""
    N, harmonic = orders.paths.symmetry, np.arange(one_sided[0].shape[1])
    # whole turns have no rounding
    whole = turn[:, None] * harmonic * (orders.sense * orders.paths.z_ring % N)
    shift = np.exp(2j * np.pi * (whole % N) / N)
    for name, values in zip(("stiffness", "deflection", "force"), one_sided):
        apart = max(np.abs(half - shift * half[leaders][group]).max() for half in np.split(values, 2))
        if apart > _EQUAL * np.abs(values).max():
            raise CaseError(
                f"the {name} of equal planets differs by {apart / np.abs(values).max():.2e} of its largest "
                "harmonic", code="E-SYMMETRY", key="symmetry", value=N, limit=f"{_EQUAL:g}",
                remedy="take symmetry 1, which solves for every planet",
            )  # fmt: skip


def _receptance(structure: FixedStructure, speed: np.ndarray, order: np.ndarray) -> np.ndarray:
    """Modal receptances (S, n_orders, m) [s^2] at whole orders of speeds (S,) [rad/s]."""
    natural, omega = structure.natural_frequency, np.multiply.outer(speed, order)[..., None]
    return 1.0 / (natural**2 - omega**2 + 2j * structure.damping_ratio * natural * omega)


def _ring(structure: FixedStructure, orders: _Orders, place: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """What the ring gives way at the leaders per force, harmonics 0 .. H: (S, H + 1, G, R, G, R) [m/N]."""
    P, n, R, G = structure.ring_shape, orders.n, orders.every.shape[1], len(place)
    low, top = np.triu_indices(len(n))  # of (n', n) the modes' product is conjugate
    pairs = P[:, low] * P[:, top].conj()
    pairs, count = np.hstack([np.real(pairs), np.imag(pairs)]), len(low)
    wave = np.exp(1j * np.outer(place, n))
    found = np.zeros((len(speed), orders.harmonics + 1, G, R, G, R), complex)
    for h in range(orders.harmonics + 1):
        places = list(orders.scatter(h))
        order = h * orders.paths.z_ring + np.array([r for r, _ in places])
        both = complex_times(_receptance(structure, speed, order), pairs)
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
                    found[:, h, g, to, k, to] += turned * block
    return found


def _solve(
    gears: _Gears, structure: FixedStructure, place, orders: _Orders, speed: np.ndarray, damping
) -> Iterator[tuple]:
    """Forces (2 G, n_orders), residual, tail and modal forces by the damping, one speed [rad/s] a time."""
    inverse, seen = gears.seen(orders, speed)
    half = _ring(structure, orders, place, speed)
    # of negative harmonics: both side bands change their sign
    R = np.concatenate([half[:, :0:-1, :, ::-1, :, ::-1].conj(), half], axis=1)
    (size, bands), S, G, H = orders.every.shape, len(speed), len(place), orders.harmonics
    middle = size * bands // 2
    Y = np.einsum("jhk,srjkc->srjhc", gears.product[G:], seen.reshape(S, bands, 2 * G, size, -1)[:, :, G:])
    Y = Y[..., :-1].reshape(S, bands, G, size, G, size)
    for g in range(G):
        Y[:, :, g, :, g] -= gears.product[G + g]
    left = np.zeros((S, G, H + 1, bands, G, size, bands), complex)
    for g in range(G):
        for b in range(G):
            of = np.moveaxis(Y[:, :, g, H:, b], 1, 2)
            for k in range(G):
                left[:, g, :, :, k] -= of[..., None] * np.moveaxis(R[:, :, b, :, k], 1, 2)[:, None]
    left = left.reshape(S, G, (H + 1) * bands, G, size * bands)[:, :, bands // 2 :]
    row = np.arange(middle + 1)
    for g in range(G):
        left[:, g, row, g, middle + row] += 1.0
    R, meeting = R.reshape(S, size, G * bands, G * bands), orders.meeting()
    for i, matrix in enumerate(_real(left)):
        own = compliance(gears.modes, speed[i] * orders.upper), _receptance(structure, speed[i], meeting[0])
        factors = lu_factor(matrix, overwrite_a=True, check_finite=False)
        one = _Speed(
            gears, structure, orders, place, meeting, damping, speed[i], inverse[i], seen[i], R[i], factors,
            own,
        )  # fmt: skip
        force, residual, drag = one.solve()
        kept = force.reshape(2 * G, -1)[:, middle:]
        kept = kept * np.where(np.arange(middle + 1) == 0, 1, 2)
        energy = (np.abs(kept[G:]) ** 2).sum(axis=0)[1:]
        z, half_band = orders.paths.z_ring, orders.paths.z_ring // 2
        beyond = np.abs((orders.positive[1:] + half_band) % z - half_band) > orders.n_max
        total = max(energy.sum(), np.finfo(float).tiny)
        yield kept, residual, np.sqrt(energy[beyond].sum() / total), drag


@dataclass(frozen=True)
class _Speed:
    """Equations of one speed [rad/s], with the factors of those of the leaders' planet-ring forces."""

    gears: _Gears
    structure: FixedStructure
    orders: _Orders
    place: np.ndarray
    meeting: tuple[np.ndarray, np.ndarray, np.ndarray]
    damping: SetDamping | None
    speed: float
    inverse: np.ndarray
    seen: np.ndarray
    ring: np.ndarray
    factors: tuple[np.ndarray, np.ndarray]
    receptance: tuple[np.ndarray, np.ndarray]  # of the modes of gears and structure, (n_L or n_K, modes)

    def solve(self) -> tuple[np.ndarray, float, np.ndarray | None]:
        """Forces (2 G, 2 H + 1, R), residual, and modal forces by the damping of the set on the structure."""
        gears, structure = (np.zeros_like(one) for one in self.receptance)
        damping = self.damping
        if damping is None:
            force, residual = self.respond(gears, structure)[:2]
            return force, residual, None

        def split(flat: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            values = flat.view(complex)
            return values[: gears.size].reshape(gears.shape), values[gears.size :].reshape(structure.shape)

        def changed(flat: np.ndarray) -> tuple[np.ndarray, float, np.ndarray]:
            force, residual, *motions = self.respond(*split(flat))
            damped = damping.forces(self.speed, *motions)
            return force, residual, np.concatenate([one.ravel() for one in damped]).view(float)

        start = changed(np.zeros(2 * (gears.size + structure.size)))[2]
        operator: Any = LinearOperator
        product = operator(
            (start.size,) * 2, matvec=lambda flat: flat + start - changed(flat)[2], dtype=float
        )
        flat = gmres(product, start, rtol=_KRYLOV, restart=_STEPS, maxiter=1)[0]
        force, residual, again = changed(flat)
        apart = np.linalg.norm(again - flat) / max(np.linalg.norm(flat), np.finfo(float).tiny)
        return force, max(residual, float(apart)), split(flat)[1]

    def respond(self, on_gears: np.ndarray, on_structure: np.ndarray):
        """Forces (2 G, 2 H + 1, R), residual, and motions (n_L or n_K, modes) by such forces on the modes."""
        gears, orders, (_, to, back), P = self.gears, self.orders, self.meeting, self.structure.ring_shape
        (size, bands), G, H = orders.every.shape, len(self.place), orders.harmonics
        compliant, receptance = self.receptance
        path = np.vstack([(receptance * on_structure) @ P, np.zeros(P.shape[1])])
        path = path[to, np.arange(P.shape[1])] @ np.exp(1j * np.outer(orders.n, self.place))
        given = self._both(path)
        d = (self.inverse @ self._both((compliant * on_gears) @ gears.rows.T).reshape(bands, -1, 1))[..., 0]
        d[bands // 2] += self.seen[bands // 2, :, -1]

        def deflections(u: np.ndarray) -> np.ndarray:
            moved = (self.seen[..., :-1] @ u.reshape(bands, -1, 1))[..., 0]
            return (d + moved).reshape(bands, 2 * G, size)

        source = gears.forces(deflections(given), given)[G:].reshape(G, -1)
        found = _mirrored(_solve_real(self.factors, source[:, size * bands // 2 :])).reshape(G, size, bands)
        moved = self.ring @ found.transpose(1, 0, 2).reshape(size, -1, 1)
        u = given + moved.reshape(size, G, bands).transpose(2, 1, 0)
        d = deflections(u)
        force = gears.forces(d, u)
        residual = float(np.linalg.norm(force[G:] - found) / np.linalg.norm(found))
        excess = force - gears.mean[:, None, None] * d.transpose(1, 2, 0)
        excess, load = excess[:, H:].reshape(2 * G, -1).T, np.empty_like(on_gears)
        for c, folded in enumerate(gears.folded):
            own = orders.upper % len(gears.folded) == c
            load[own] = excess[own] @ folded
        modal = orders.load(found[:, H:].reshape(G, -1), self.place, back) @ P.conj().T
        return force, residual, compliant * (on_gears - load), receptance * (on_structure + modal)

    def _both(self, upper: np.ndarray) -> np.ndarray:
        """Harmonics of both signs (R, n, 2 H + 1) of those from 0 upwards (n_L, n) of a real signal."""
        bands = self.orders.every.shape[1]
        half = upper.reshape(-1, bands, upper.shape[1])
        return np.concatenate([half[:0:-1, ::-1].conj(), half]).transpose(1, 2, 0)


def _mirrored(half: np.ndarray) -> np.ndarray:
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
