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

from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError, ConvergenceError, checked_count
from femgear.housing.sensor import ReadOnlyArrays
from femgear.housing.structure import FixedStructure
from femgear.solvers.periodic.spectral import compliance
from femgear.system.system import MeshExcitation, Modes, mesh_harmonics

_EQUAL, _RESIDUAL = 1e-9, 1e-8
"""Part of the largest harmonic by which meshes that repeat others may differ; residual that is refused."""
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
    """

    carrier_speed: np.ndarray
    order: np.ndarray
    force: np.ndarray
    residual: np.ndarray
    tail: np.ndarray
    harmonics: int
    side_bands: int
    paths: MeshPaths


def solve_two_way(
    gears: Modes,
    excitation: MeshExcitation,
    structure: FixedStructure,
    paths: MeshPaths,
    carrier_speed,
    *,
    harmonics: tuple[int, int] = (6, 12),
    side_bands: int | None = None,
) -> TwoWayResponse:
    """Solve for the mesh forces of a set in a housing that stands still, at all speeds.

    Parameters
    ----------
    gears : Modes
        Of gears and carrier with mean mesh stiffnesses against a rigid ring: N sun-planet, then N planet-ring
        meshes. What damps them acts against the ring at rest.
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
    size = _BYTES * (count * n_orders) ** 2
    if size > _MOST:
        message = f"{count} planets with {n_orders} carrier orders need {size / 1e9:.2g} GB"
        raise CaseError(message, code="E-MEMORY", remedy="take fewer mesh harmonics or nodal diameters")
    # without side bands what the ring gives way takes more than the unknowns
    step = max(int(_MEMORY / (size + _BYTES * (2 * n_max + 1) ** 3)), 1)
    force = np.empty((len(speeds), 2 * count, n_orders), complex)
    residual, tail = np.empty((2, len(speeds)))
    for first in range(0, len(speeds), step):
        some = slice(first, first + step)
        found = _solve(known, structure, place, orders, np.abs(speeds[some]))
        force[some], residual[some], tail[some] = found
    if not (residual < _RESIDUAL).all():  # singular
        worst = int(np.argmax(np.where(np.isfinite(residual), residual, np.inf)))
        message = f"residual {residual[worst]:.3e} of the two-way equations at {speeds[worst]:.6g} rad/s"
        remedy = "give gears and structure some damping"
        raise ConvergenceError(message, code="E-RESONANCE", limit=f"{_RESIDUAL:g}", remedy=remedy)
    return TwoWayResponse(speeds, orders.positive, force, residual, tail, harmonics[1], bands, paths)


def structure_lines(structure: FixedStructure, response: TwoWayResponse) -> tuple[np.ndarray, np.ndarray]:
    """Compute the lines of the sensors of a structure under forces that run around in it.

    Carrier orders (n_orders,) from 0, multiples of the symmetry, and displacements
    (n_speeds, n_sensors, n_orders) [m] of ``u(t) = Re sum_k u[k] exp(i order[k] |carrier_speed| t)``. The
    sensors stand still: nothing is modulated after that.
    """
    paths, H, speed = response.paths, response.harmonics, np.abs(response.carrier_speed)
    s, leaders = (
        int(np.sign(response.carrier_speed[0])),
        planet_groups(paths.planet_angles, paths.symmetry)[0],
    )
    orders = _Orders(paths, H, structure.max_diameter, response.side_bands, s)
    place = np.array(paths.planet_angles)[leaders] + paths.load_angle
    ring = _mirrored(response.force[:, len(place) :] * np.where(response.order == 0, 1.0, 0.5))
    ring = ring.reshape(len(speed), len(place), 2 * H + 1, -1)
    wave = paths.symmetry * np.exp(-1j * np.outer(place, orders.n))
    near = [(h, *one) for h in range(H + 1) for one in orders.scatter(h)]
    near = [(K, h, into, of) for h, r, (into, of) in near if (K := h * paths.z_ring + r) >= 0]
    load = np.zeros((len(speed), len(near), len(orders.n)), complex)
    for i, (_, h, into, of) in enumerate(near):
        load[:, i, of] = np.einsum("gn,sgn->sn", wave[:, of], ring[:, :, h + H, into])
    order = np.array([K for K, *_ in near])
    lines = load @ structure.sensor_residual.T
    for i in range(len(speed)):  # one by one: modes at all orders of all speeds would fill the memory
        modal = _receptance(structure, speed[i : i + 1], order)[0] * (load[i] @ structure.ring_shape.conj().T)
        lines[i] += modal @ structure.sensor_shape
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
        """Forces ``f = a + Y u`` of the meshes over what the ring gives way, harmonics of one side band.

        ``a`` (S, 2 G, 2 H + 1), which has no side bands, and ``Y`` (S, R, 2 G, 2 H + 1, G, 2 H + 1).
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
        d = np.linalg.solve(left, np.concatenate([moved, middle], axis=-1)).reshape(S, R, n, size, -1)
        force = np.einsum("jhk,srjkc->srjhc", self.product, d)
        Y = force[..., :-1].reshape(S, R, n, size, G, size)
        for g in range(G):
            Y[:, :, G + g, :, g] -= self.product[G + g]
        return self.forcing + force[:, R // 2, :, :, -1], Y


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
    pairs = (P[:, :, None] * P[:, None].conj()).reshape(len(P), -1)
    wave = np.exp(1j * np.outer(place, n))
    found = np.zeros((len(speed), orders.harmonics + 1, G, R, G, R), complex)
    for h in range(orders.harmonics + 1):
        places = list(orders.scatter(h))
        order = h * orders.paths.z_ring + np.array([r for r, _ in places])
        every = (_receptance(structure, speed, order) @ pairs).reshape(len(speed), len(order), len(n), len(n))
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


def _solve(gears: _Gears, structure: FixedStructure, place, orders: _Orders, speed: np.ndarray):
    """Forces (S, 2 G, n_orders), residuals (S,) and tails (S,) at some speeds [rad/s]."""
    a, Y = gears.seen(orders, speed)
    half = _ring(structure, orders, place, speed)
    # of negative harmonics: both side bands change their sign
    R = np.concatenate([half[:, :0:-1, :, ::-1, :, ::-1].conj(), half], axis=1)
    (size, bands), S, G, H = orders.every.shape, len(speed), len(place), orders.harmonics
    middle = size * bands // 2
    source = np.zeros((S, G, size, bands), complex)
    source[..., bands // 2] = a[:, G:]
    source = source.reshape(S, G, -1)[..., middle:]
    left = np.zeros((S, G, H + 1, bands, G, size, bands), complex)
    for g in range(G):
        for b in range(G):
            seen = np.moveaxis(Y[:, :, G + g, H:, b], 1, 2)
            for k in range(G):
                left[:, g, :, :, k] -= seen[..., None] * np.moveaxis(R[:, :, b, :, k], 1, 2)[:, None]
    left = left.reshape(S, G, (H + 1) * bands, G, size * bands)[:, :, bands // 2 :]
    row = np.arange(middle + 1)
    for g in range(G):
        left[:, g, row, g, middle + row] += 1.0
    ring = _solve_real(left, source)
    two_sided = _mirrored(ring).reshape(S, G, size, bands)
    moved = np.einsum("shgrkt,skht->sghr", R, two_sided, optimize=True)
    every = np.einsum("srmhgk,sgkr->smhr", Y, moved, optimize=True)
    every[..., bands // 2] += a
    force = every.reshape(S, 2 * G, -1)[..., middle:] * np.where(np.arange(middle + 1) == 0, 1, 2)
    norm = np.linalg.norm(two_sided.reshape(S, -1), axis=1)
    residual = np.linalg.norm((every[:, G:] - two_sided).reshape(S, -1), axis=1) / norm
    energy = (np.abs(force[:, G:]) ** 2).sum(axis=1)[:, 1:]
    z, half_band = orders.paths.z_ring, orders.paths.z_ring // 2
    beyond = np.abs((orders.positive[1:] + half_band) % z - half_band)
    total = np.maximum(energy.sum(axis=1), np.finfo(float).tiny)
    return force, residual, np.sqrt(energy[:, beyond > orders.n_max].sum(axis=1) / total)


def _mirrored(half: np.ndarray) -> np.ndarray:
    """Two-sided coefficients of real signals, of those from 0 upwards (..., n)."""
    return np.concatenate([half[..., :0:-1].conj(), half], axis=-1)


def _solve_real(left: np.ndarray, source: np.ndarray) -> np.ndarray:
    """Solve for real signals: coefficients (S, G, n) from 0 upwards, left (S, G, n, G, 2 n - 1) two-sided.

    Coefficients of negative orders are the conjugates, so that real and imaginary parts are the unknowns.
    """
    S, G, n = source.shape
    plus, minus = left[..., n - 1 :], left[..., n - 1 :: -1]
    same, other = plus + minus, plus[..., 1:] - minus[..., 1:]
    same[..., 0] = plus[..., 0]
    matrix = np.empty((S, G, 2 * n - 1, G, 2 * n - 1))
    matrix[:, :, :n, :, :n], matrix[:, :, :n, :, n:] = np.real(same), -np.imag(other)
    matrix[:, :, n:, :, :n], matrix[:, :, n:, :, n:] = np.imag(same[:, :, 1:]), np.real(other[:, :, 1:])
    right = np.concatenate([np.real(source), np.imag(source[..., 1:])], axis=-1)
    unknowns = G * (2 * n - 1)
    found = np.linalg.solve(matrix.reshape(S, unknowns, unknowns), right.reshape(S, unknowns, 1))
    found = found.reshape(S, G, -1)
    return found[..., :n] + 1j * np.pad(found[..., n:], ((0, 0), (0, 0), (1, 0)))
