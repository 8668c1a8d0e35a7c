"""Orders of the carrier in the two-way response, and how meshes and structure meet at them.

Forces of the meshes have lines ``q = 0 .. Q``, multiples of ``z_ring/periods`` carrier orders, each with the
side bands ``r``; those of negative q are the conjugates. An order ``L = K + seed`` has the whole part
``K = base + r``. Where a set without errors that turn is the same after a turn by ``2 pi/N``, its planets
move in patterns: with t_j turns from its leader planet j has

    f_j[L] = f[L] exp(2 pi i s t_j (K + pattern)/N),

so that the structure moves at orders whose K has the residue of -pattern modulo N alone. Neither lines nor
patterns know of one another until the stiffness of the meshes varies. A block is one line in one pattern.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from femgear.errors import CaseError, checked_count
from femgear.housing.two_way.structure import FixedStructure
from femgear.system.system import MeshExcitation, Modes


@dataclass(frozen=True)
class MeshPaths:
    """How the planet-ring meshes run around in the structure.

    Parameters
    ----------
    z_ring : int
        Teeth of the ring, more than six times the nodal diameters that the structure couples: side bands of
        neighbouring mesh harmonics stay apart.
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
    """Orders of B blocks, each of R = 2 side_bands + 1 side bands, and how a structure connects these.

    Parameters
    ----------
    paths : MeshPaths
        Ways of the meshes around the ring.
    lines : int
        Highest line Q of the forces.
    max_diameter : int
        Largest circumferential order of the structure.
    side_bands : int
        On either side of each line.
    sense : int
        Of the carrier, 1 or -1.
    periods : int
        Mesh periods after which the meshes repeat.
    patterns : int
        Patterns of the planets that are solved for: the first, or all N.
    spacing : int
        Side bands are its multiples: the equal sectors of the structure.
    """

    paths: MeshPaths
    lines: int
    max_diameter: int
    side_bands: int
    sense: int
    periods: int = 1
    patterns: int = 1
    spacing: int = 1

    @cached_property
    def diameters(self) -> np.ndarray:
        """Circumferential orders n (W,)."""
        return np.arange(-self.max_diameter, self.max_diameter + 1)

    @cached_property
    def bands(self) -> np.ndarray:
        """Side bands r (R,)."""
        return self.spacing * np.arange(-self.middle, self.middle + 1)

    @property
    def middle(self) -> int:
        """Place of the side band 0."""
        return self.side_bands // self.spacing

    @cached_property
    def pattern(self) -> np.ndarray:
        """Pattern (B,) of every block, all lines of the first one first."""
        return np.repeat(np.arange(self.patterns), self.lines + 1)

    @cached_property
    def base(self) -> np.ndarray:
        """Whole part (B,) of the order in the middle of every block."""
        return np.tile(np.arange(self.lines + 1) * self.paths.z_ring // self.periods, self.patterns)

    @cached_property
    def seed(self) -> np.ndarray:
        """What the whole part lacks (B,)."""
        part = np.arange(self.lines + 1) * self.paths.z_ring % self.periods / self.periods
        return np.tile(part, self.patterns)

    @cached_property
    def residue(self) -> np.ndarray:
        """Residue (B,) of base and pattern modulo N."""
        return (self.base + self.pattern) % self.paths.symmetry

    @cached_property
    def order(self) -> np.ndarray:
        """Orders L (B, R) of the forces."""
        return self.base[:, None] + self.bands + self.seed[:, None]

    @cached_property
    def structure_order(self) -> np.ndarray:
        """Orders (B, S) of the structure, some of them beyond what any wave reaches."""
        bands = np.array([self.structure_bands(residue) for residue in range(self.paths.symmetry)])
        return self.base[:, None] + bands[self.residue] + self.seed[:, None]

    def structure_bands(self, residue: int) -> np.ndarray:
        """Side bands (S,) at which the structure moves in blocks of a residue."""
        reach, N = int(self.bands[-1]) + self.max_diameter, self.paths.symmetry
        first = -reach + (reach - residue) % N
        return first + N * np.arange(2 * reach // N + 1)

    def meeting(self, residue: int) -> tuple[np.ndarray, np.ndarray]:
        """Places (R, W) of ``L - s n`` among the orders of the structure, (S, W) of ``K + s n`` among the L.

        In blocks of a residue; the number of these orders where there are none.
        """
        N, in_structure, waves = self.paths.symmetry, self.structure_bands(residue), self.sense * self.diameters
        apart = self.bands[:, None] - waves - in_structure[0]
        inside = (apart % N == 0) & (apart >= 0) & (apart // N < len(in_structure))
        return np.where(inside, apart // N, len(in_structure)), self.place(in_structure[:, None] + waves)

    def place(self, band: np.ndarray) -> np.ndarray:
        """Places (...) of side bands r (...), their number R where there is none."""
        there = (np.abs(band) <= self.bands[-1]) & (band % self.spacing == 0)
        return np.where(there, band // self.spacing + self.middle, len(self.bands))

    def blocks(self, residue: int) -> np.ndarray:
        """Numbers (b,) of the blocks of a residue."""
        return np.flatnonzero(self.residue == residue)

    def numbers(self, turns: int) -> np.ndarray:
        """Orders (Q + 1, R) of the forces in multiples of 1/turns, int."""
        line = np.arange(self.lines + 1)[:, None] * (self.paths.z_ring * turns // self.periods)
        return line + turns * self.bands


def ring_load(symmetry: int, ring: np.ndarray, place: np.ndarray, n: np.ndarray, back: np.ndarray):
    """Circumferential components (..., n_K, W) of all planets' forces by the leaders' (G, ..., n_L).

    Places (G,) of the leaders' forces [rad], orders n (W,), places ``back`` (n_K, W) among the n_L.
    """
    wave = symmetry * np.exp(-1j * np.outer(place, n))
    padded = np.concatenate([ring, np.zeros((*ring.shape[:-1], 1))], axis=-1)
    return np.sum([leader[..., back] * turned for leader, turned in zip(padded, wave)], axis=0)


@dataclass(frozen=True)
class LeadingMeshes:
    """Gears and mean stiffness of the leading meshes, J = 2 G of them, which all others repeat.

    Parameters
    ----------
    modes : Modes
        Modes of gears and carrier.
    rows : (J, n_modes) array
        Deflections of the leading meshes by these modes [kg^-1/2].
    folded : (N, J, n_modes) complex array
        Deflections of each leader and all that repeat it, by the residue of K + pattern modulo N.
    residual : (N, J, J) complex array
        Static flexibility beyond the modes [m/N], by the same residue.
    load : (J,) array
        Deflection by the constant load [m].
    mean : (J,) array
        Mesh stiffness that the modes contain [N/m].
    """

    modes: Modes
    rows: np.ndarray
    folded: np.ndarray
    residual: np.ndarray
    load: np.ndarray
    mean: np.ndarray

    @classmethod
    def build(cls, modes: Modes, paths: MeshPaths, sense: int, groups) -> LeadingMeshes:
        """Of the modes of gears and carrier, with the groups of `planet_groups`."""
        (leaders, group, turn), N = groups, paths.symmetry
        meshes = np.concatenate([leaders, len(group) + leaders])
        owner = np.concatenate([group, len(leaders) + group])
        phase = np.exp(2j * np.pi * (sense * np.outer(np.arange(N), turn) % N) / N)
        member = (owner == np.arange(len(meshes))[:, None]) * np.tile(phase, 2)[:, None]
        return cls(
            modes,
            modes.mesh_deflection[meshes],
            member @ modes.mesh_deflection,
            np.swapaxes(member @ modes.residual[:, meshes], 1, 2),
            modes.load_deflection[meshes],
            modes.mesh_stiffness[meshes],
        )


def mean_excitation(excitation: MeshExcitation, paths: MeshPaths, sense: int) -> MeshExcitation:
    """Average the meshes over their periods, and over planets that repeat one another by their places.

    ``sense`` is that of the carrier, 1 or -1. Of errors that turn what they do on an average remains.
    """
    groups = planet_groups(paths.planet_angles, paths.symmetry)
    count, averaged = excitation.stiffness.shape[1] // excitation.periods, dict[str, np.ndarray]()
    for name in ("stiffness", "deflection", "force", "source"):
        if (values := getattr(excitation, name)) is None:
            continue
        turn, owner = _meshes(groups, len(values) // len(groups[1]))
        alike, whole = owner[:, None] == owner, sense * turn[:, None] * np.arange(count // 2 + 1)
        phase = np.exp(2j * np.pi * (whole * (paths.z_ring % paths.symmetry) % paths.symmetry) / paths.symmetry)
        lines = np.fft.rfft(values.reshape(len(values), -1, count).mean(axis=1)) / phase
        averaged[name] = np.fft.irfft(phase * (alike @ lines) / alike.sum(axis=1)[:, None], count)
    return replace(excitation, **averaged, periods=1)


def _meshes(groups, kinds: int) -> tuple[np.ndarray, np.ndarray]:
    """Turns (kinds N,) of all meshes from their leaders, and the numbers (kinds N,) of these."""
    leaders, group, turn = groups
    return np.tile(turn, kinds), np.concatenate([kind * len(leaders) + group for kind in range(kinds)])


def receptance(structure: FixedStructure, omega: np.ndarray) -> np.ndarray:
    """Compute modal receptances (..., m) [s^2] of a structure at angular frequencies (...) [rad/s]."""
    return modal_receptance(structure.natural_frequency, structure.damping_ratio, omega)


def modal_receptance(natural: np.ndarray, ratio: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """Compute receptances (..., m) [s^2] of modes at angular frequencies ``omega`` (...) [rad/s].

    ``natural`` (m,) are their natural angular frequencies [rad/s], ``ratio`` (m,) their damping ratios [1].
    """
    omega = np.asarray(omega)[..., None]
    stiffness = np.empty((*omega.shape[:-1], len(natural)), complex)
    stiffness.real, stiffness.imag = natural**2 - omega**2, 2.0 * ratio * natural * omega
    return np.reciprocal(stiffness, out=stiffness)
