"""Two-way response of a set in a housing that stands still, all harmonics and side bands in one linear system.

The equations at the head of `femgear.housing.two_way.response` as they stand: the stiffness is not split into a mean
and what fluctuates, nothing is iterated upon, no block of one harmonic is formed. The cost grows with the third
power of the number of harmonics, so that this serves for few of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.housing.two_way.carrier_orders import MeshPaths, planet_groups
from femgear.housing.two_way.response import TwoWayResponse
from femgear.housing.two_way.structure import FixedStructure, ring_waves
from femgear.system.fourier import harmonics_of
from femgear.system.system import MeshExcitation, Modes


@dataclass(frozen=True)
class Lines:
    """Carrier orders of forces, two-sided.

    Parameters
    ----------
    teeth : int
        Of the ring.
    periods : int
        Mesh periods after which the meshes repeat.
    highest : int
        Highest line, in parts 1/periods of the mesh frequency.
    bands : int
        Side bands on either side of each line.
    """

    teeth: int
    periods: int
    highest: int
    bands: int

    @property
    def line(self) -> np.ndarray:
        """Line (n_L,) of every order."""
        return np.repeat(np.arange(-self.highest, self.highest + 1), 2 * self.bands + 1)

    @property
    def band(self) -> np.ndarray:
        """Side band (n_L,) of every order."""
        return np.tile(np.arange(-self.bands, self.bands + 1), 2 * self.highest + 1)

    @property
    def number(self) -> np.ndarray:
        """Orders (n_L,) in multiples of 1/periods."""
        return self.line * self.teeth + self.band * self.periods

    def product(self, harmonics: np.ndarray) -> np.ndarray:
        """Matrix (n_L, n_L) of the product with a real signal by its one-sided harmonics (H + 1,)."""
        apart = np.subtract.outer(self.line, self.line)
        same = np.equal.outer(self.band, self.band) & (np.abs(apart) < len(harmonics))
        value = 0.5 * harmonics[np.where(same, np.abs(apart), 0)]
        value = np.where(apart < 0, value.conj(), np.where(apart == 0, np.real(harmonics[0]), value))
        return np.where(same, value, 0.0)

    def signal(self, harmonics: np.ndarray) -> np.ndarray:
        """Amplitudes (n_L,) of a real signal by its one-sided harmonics (H + 1,)."""
        return self.product(harmonics)[:, (self.line == 0) & (self.band == 0)][:, 0]


def direct_forces(
    gears: Modes,
    excitation: MeshExcitation,
    structure: FixedStructure,
    paths: MeshPaths,
    speed: float,
    *,
    harmonics: tuple[int, int],
    coupled: int,
) -> tuple[Lines, np.ndarray]:
    """Solve for the two-sided forces (J, n_L) of the leading meshes [N] at a speed of the carrier [rad/s].

    ``harmonics`` of the excitation and of the response; waves beyond ``coupled`` nodal diameters act on themselves.
    """
    periods, sense = excitation.periods, int(np.sign(speed))
    lines = Lines(paths.z_ring, periods, harmonics[1] * periods, 2 * coupled)
    angle = np.asarray(paths.planet_angles, float)
    leaders, group, _ = planet_groups(angle, paths.symmetry)
    G, count = len(leaders), len(lines.line)
    meshes = np.concatenate([leaders, len(angle) + leaders])
    owner = np.concatenate([group, G + group])
    # f_j[L] = f_leader[L] exp(i L s (phi_j - phi_leader))
    lag = np.tile(angle - angle[leaders][group], 2)
    turned = np.exp(1j * sense * np.outer(lag, lines.number / periods))
    member = owner == np.arange(2 * G)[:, None]
    flexibility = _gears(gears, meshes, abs(speed) * lines.number / periods)
    folded = np.einsum("ljk,kl,gk->ljg", flexibility, turned, member)
    mean, size = gears.mesh_stiffness[meshes], 2 * G * count
    load = np.outer(gears.load_deflection[meshes], lines.number == 0).astype(complex)
    # gears without their meshes may be a mechanism: unknown are the forces beyond those of the mean stiffness
    to_force = np.zeros((2 * G, count, 2 * G, count), complex)
    motion = np.zeros_like(to_force)
    to_force[:, range(count), :, range(count)] = np.eye(2 * G) - mean[:, None] * folded
    motion[:, range(count), :, range(count)] = -folded
    ring = _ring(structure, paths, lines, speed, coupled, (leaders, group)).reshape(G * count, G * count)
    motion[G:] -= (ring @ to_force[G:].reshape(G * count, size)).reshape(motion[G:].shape)
    still = mean[:, None] * load
    load[G:] -= (ring @ still[G:].ravel()).reshape(G, count)
    of_meshes = (signal[meshes] for signal in (excitation.stiffness, excitation.deflection, excitation.force))
    stiffness, deflection, force = (harmonics_of(signal, harmonics[0] * periods) for signal in of_meshes)
    right, matrix = np.empty((2 * G, count), complex), np.array(to_force)
    for j in range(2 * G):
        product = lines.product(stiffness[j])
        right[j] = lines.signal(force[j]) + product @ (load[j] - lines.signal(deflection[j])) - still[j]
        matrix[j] -= np.tensordot(product, motion[j], axes=1)
    beyond = np.linalg.solve(matrix.reshape(size, size), right.ravel())
    return lines, still + (to_force.reshape(size, size) @ beyond).reshape(2 * G, count)


def _gears(gears: Modes, meshes: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """Flexibility (n_L, J, 2N) of gears and carrier against a rigid ring, with the mean stiffnesses [m/N]."""
    elastic = gears.frequency > 0.0  # what turns freely moves no mesh
    natural, ratio, approach = (
        2 * np.pi * gears.frequency[elastic],
        gears.damping_ratio[elastic],
        gears.mesh_deflection[:, elastic],
    )
    modal = 1.0 / (natural**2 - omega[:, None] ** 2 + 2j * ratio * natural * omega[:, None])
    return np.einsum("jm,lm,km->ljk", approach[meshes], modal, approach) + gears.residual[meshes]


def _ring(structure: FixedStructure, paths: MeshPaths, lines: Lines, speed: float, coupled: int, groups) -> np.ndarray:
    """What the ring gives way at the leading meshes per force of the leaders (G, n_L, G, n_L) [m/N]."""
    leaders, group = groups
    sense, angle, n_max = int(np.sign(speed)), np.asarray(paths.planet_angles, float), structure.max_diameter
    waves, P, number = np.arange(-n_max, n_max + 1), structure.ring_shape, lines.number
    at = {int(value): i for i, value in enumerate(number)}
    place = angle + paths.load_angle
    lag = angle - angle[leaders][group]
    coupling = np.zeros((len(leaders), len(number), len(leaders), len(number)), complex)
    for K in np.unique(np.subtract.outer(number, sense * lines.periods * waves)):
        waves_at_order = [(i, at[L]) for i, n in enumerate(waves) if (L := int(K + sense * lines.periods * n)) in at]
        i, L = (np.array(part) for part in zip(*waves_at_order, strict=True))
        omega, natural = abs(speed) * K / lines.periods, structure.natural_frequency
        modal = 1.0 / (natural**2 - omega**2 + 2j * structure.damping_ratio * natural * omega)
        both = (P[:, i].T * modal) @ P[:, i].conj() + structure.residual[np.ix_(i, i)]
        near = np.abs(waves[i]) <= coupled
        both = np.where(np.logical_and.outer(near, near) | np.eye(len(i), dtype=bool), both, 0.0)
        out = np.exp(1j * np.outer(place[leaders], waves[i]))
        into = np.exp(1j * (sense * np.outer(lag, number[L] / lines.periods) - np.outer(place, waves[i])))
        into = np.array([into[group == g].sum(axis=0) for g in range(len(leaders))])
        for g, k in np.ndindex(len(leaders), len(leaders)):
            np.add.at(coupling[g, :, k], np.ix_(L, L), out[g][:, None] * both * into[k])
    return coupling


@dataclass(frozen=True)
class _Damped:
    """Damping of gears and ring as a whole, for waves exp(i n phi) of the ring.

    Parameters
    ----------
    on_gears : (p, p) array
        Between the modes of the gears [1/s].
    to_gears : (p, W) complex array
        Force on the modes of the gears by the velocity of every wave [1/s].
    on_waves : (W, W) complex array
        Between waves, without what acts at each order of the structure alone [1/s].
    on_modes : (m, m) array
        Between the modes of the structure, that of each order alone [1/s].
    """

    on_gears: np.ndarray
    to_gears: np.ndarray
    on_waves: np.ndarray
    on_modes: np.ndarray

    @classmethod
    def of(cls, matrix: np.ndarray, gears: Modes, structure: FixedStructure) -> _Damped:
        """Take a matrix of the coordinates of gears and ring apart."""
        dofs, shape, S = len(gears.shape), gears.shape, structure.wave_shape
        to_waves = ring_waves(structure.wave_order).conj().T
        on_waves = to_waves.conj().T @ matrix[dofs:, dofs:] @ to_waves
        mean = np.real(np.diag(on_waves))
        return cls(
            shape.T @ matrix[:dofs, :dofs] @ shape,
            shape.T @ matrix[:dofs, dofs:] @ to_waves,
            on_waves - np.diag(mean),
            np.real((S.conj() * mean) @ S.T),
        )


def direct_damped_forces(
    gears: Modes,
    excitation: MeshExcitation,
    structure: FixedStructure,
    paths: MeshPaths,
    speed: float,
    matrix: np.ndarray,
    *,
    harmonics: tuple[int, int],
) -> tuple[Lines, np.ndarray]:
    """Solve for the two-sided forces (2N, n_L) of all meshes [N] of a set that is damped as a whole.

    Unknown are the forces, the modes of the gears and those of the structure, each at all its orders. ``matrix`` is
    that of `femgear.housing.two_way.set_damping.set_damping`; no modes may be left out, of gears or of the structure.
    """
    periods, sense, N = excitation.periods, int(np.sign(speed)), len(paths.planet_angles)
    lines = Lines(paths.z_ring, periods, harmonics[1] * periods, 2 * structure.max_diameter)
    number, count, step = lines.number, len(lines.number), sense * periods
    waves = np.arange(-structure.max_diameter, structure.max_diameter + 1)
    reached = np.unique(np.subtract.outer(number, step * waves))
    p, m, first = gears.shape.shape[1], len(structure.natural_frequency), 2 * N * count
    of_gears = first + p * np.arange(count)[:, None] + np.arange(p)
    of_modes = first + p * count + m * np.arange(len(reached))[:, None] + np.arange(m)
    size = first + p * count + m * len(reached)
    equations, right = np.zeros((size, size), complex), np.zeros(size, complex)
    signals = (excitation.stiffness, excitation.deflection, excitation.force)
    stiffness, deflection, force = (harmonics_of(signal, harmonics[0] * periods) for signal in signals)
    approach, mean = gears.mesh_deflection, gears.mesh_stiffness
    still, damped = np.outer(gears.load_deflection, number == 0), _Damped.of(matrix, gears, structure)
    omega, turned = abs(speed) * number / periods, abs(speed) * reached / periods
    place = np.asarray(paths.planet_angles) + paths.load_angle
    for j in range(2 * N):
        here, product = slice(j * count, (j + 1) * count), lines.product(stiffness[j])
        equations[here, here] += np.eye(count)
        right[here] = lines.signal(force[j]) + product @ (still[j] - lines.signal(deflection[j]))
        for L in range(count):
            equations[here, of_gears[L]] -= np.outer(product[:, L], approach[j])
            equations[of_gears[L], j * count + L] += approach[j]
        for n, P in zip(waves, structure.ring_shape.T, strict=True) if j >= N else ():
            path, orders = np.exp(1j * n * place[j - N]) * P, np.searchsorted(reached, number - step * n)
            for L, K in enumerate(orders):
                equations[here, of_modes[K]] += np.outer(product[:, L], path)
                equations[of_modes[K], j * count + L] -= path.conj()
    natural = 2 * np.pi * gears.frequency
    for L in range(count):
        rows = of_gears[L]
        # the modes contain the mean stiffness, the forces are whole
        block = np.diag(natural**2 - omega[L] ** 2) - (approach.T * mean) @ approach
        equations[np.ix_(rows, rows)] += block + 1j * omega[L] * damped.on_gears
        right[rows] += approach.T @ (mean * still[:, L])
    for K, rows in enumerate(of_modes):
        block = np.diag(structure.natural_frequency**2 - turned[K] ** 2)
        equations[np.ix_(rows, rows)] += block + 1j * turned[K] * damped.on_modes
    # waves move with the ring's material, of the order K = L - s n
    for L in range(count):
        at = np.searchsorted(reached, number[L] - step * structure.wave_order)
        for i, K in enumerate(at):
            S = structure.wave_shape[:, i]
            velocity, on_gears = 1j * turned[K] * S, damped.to_gears[:, i]
            equations[np.ix_(of_gears[L], of_modes[K])] += np.outer(on_gears, velocity)
            equations[np.ix_(of_modes[K], of_gears[L])] += 1j * omega[L] * np.outer(S.conj(), on_gears.conj())
            for k, other in enumerate(at):
                shape = structure.wave_shape[:, k]
                equations[np.ix_(of_modes[other], of_modes[K])] += damped.on_waves[k, i] * np.outer(
                    shape.conj(), velocity
                )
    return lines, np.linalg.solve(equations, right)[:first].reshape(2 * N, count)


def farthest_apart(response: TwoWayResponse, speed: int, lines: Lines, force: np.ndarray) -> float:
    """Largest difference of forces at a speed from two-sided ones (J, n_L), over the largest that fluctuates."""
    orders = np.rint(response.order * response.turns).astype(int)
    scale = response.turns // lines.periods if lines.periods > 1 else 1
    expected = np.zeros_like(response.force[speed])
    for L, number in enumerate(lines.number * scale):
        if number >= 0:
            expected[:, orders == number] += np.where(number == 0, 1.0, 2.0) * force[:, [L]]
    return float(np.abs(response.force[speed] - expected).max() / np.abs(expected[:, orders > 0]).max())
