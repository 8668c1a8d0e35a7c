"""Which resultants the planets cancel, and which modes a harmonic of the mesh frequency can excite."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from femgear.gears.phasing import (
    KINDS,
    MeshPhasing,
    check_harmonics,
    cyclic_harmonic,
    phase_factors,
    phase_kinds,
    planet_sums,
)

MEMBERS = ("sun", "ring", "carrier")
RESULTANTS = ("torque", "lateral force", "thrust", "tilting moment")
PLANET_RESULTANTS = ("torque", "tangential force", "radial force", "thrust", "tilting moment")
MODES = ("rotational", "translational", "planet")
ZERO = 1e-9
"""Share of the mesh forces below which a sum counts as cancelled."""


@dataclass(frozen=True, eq=False)
class PhasingTable:
    """What a set makes of harmonics of the mesh frequency, when the mesh forces of all planets are equal.

    Parameters
    ----------
    harmonics : (H,) int array
    kind : tuple of str
        One of `femgear.gears.phasing.KINDS` for every harmonic, the same for sun and ring meshes.
    cyclic : (H,) int array
        k = mod(h z_s, N); -1 for unequally spaced planets.
    sums : (H, 2, 3) complex array
        Mean over the planets of ``exp(2 pi i h gamma_n) exp(i q psi_n)`` for sun and ring meshes, q = 0, 1
        and -1.
    members : (H, 3, 4) array
        Resultants on `MEMBERS` by `RESULTANTS` as shares of what they were if all planets acted alike and in
        the worst direction: 0 cancelled, 1 everything adds up.
    planets : (H, N, 5) array
        Resultants of the two meshes of each planet by `PLANET_RESULTANTS`, 0 to 1, for equal forces in both
        meshes and equal pressure angles.
    modes : (H, 3) array
        How much of the phase pattern belongs to the kinds of `MODES`, 0 to 1.
    separate : bool
        Whether rotational and translational modes exist apart from each other, ``sum exp(i psi_n) = 0``.
    """

    harmonics: np.ndarray
    kind: tuple[str, ...]
    cyclic: np.ndarray
    sums: np.ndarray
    members: np.ndarray
    planets: np.ndarray
    modes: np.ndarray
    separate: bool

    @property
    def cancelled(self) -> np.ndarray:
        """Whether a resultant vanishes on sun, ring, carrier, (H, 3, 4) bool."""
        return self.members < ZERO

    @property
    def excited(self) -> tuple[tuple[str, ...], ...]:
        """Kinds of modes that every harmonic can excite.

        Where rotational and translational modes do not exist apart they are named together.
        """
        found = []
        for row in self.modes > ZERO:
            names = [name for name, on in zip(MODES, row) if on]
            if not self.separate and (row[0] or row[1]):
                names = ["rotational-translational"] + (["planet"] if row[2] else [])
            found.append(tuple(names))
        return tuple(found)


def phasing_table(phasing: MeshPhasing, harmonics=range(1, 7)) -> PhasingTable:
    """Cancellation of resultants and excitation of modes for harmonics of the mesh frequency.

    The mesh forces of one harmonic act on sun and ring along directions that turn with psi_n, and at points
    that do. Torque and thrust are their plain sum (q = 0); lateral forces, and tilting moments of the axial
    forces, are sums with ``exp(+-i psi_n)``. The carrier takes the pin forces of the planets, the sum of both
    meshes, so that its resultant is sure to vanish where those of sun and ring both do. A. Kahraman (J. Mech.
    Des. 116, 1994, 713-720, Table 1) has the case of four equal planets, R. G. Parker (J. Sound Vib. 236,
    2000, 561-573) the sums for equal spacing.

    Parameters
    ----------
    phasing : MeshPhasing
    harmonics : (H,) sequence of int

    Returns
    -------
    PhasingTable

    Raises
    ------
    GeometryError
        Harmonics that are no whole numbers from 1 (E-HARMONICS).
    """
    harmonics = _whole(harmonics)
    turns, N = np.array(phasing.turns), phasing.n_planets
    positions = np.array([phasing.positions] * 2)
    total = np.full(2, phasing.teeth_sum)
    sums = planet_sums(turns, positions, total, harmonics, (0, 1, -1)).swapaxes(0, 1)
    size = np.abs(sums)
    plain, turning = size[..., 0], size[..., 1:].max(axis=-1)  # (H, 2)
    both = [np.column_stack([part, part.max(axis=1)]) for part in (plain, turning)]
    kinds = phase_kinds(turns[0], positions[0], total[0], harmonics)
    return PhasingTable(
        harmonics=harmonics,
        kind=tuple(KINDS[k] for k in kinds),
        cyclic=cyclic_harmonic(phasing, harmonics),
        sums=sums,
        members=np.stack([both[0], both[1], both[0], both[1]], axis=-1),
        planets=_planet_resultants(phasing, harmonics),
        modes=_mode_shares(phase_factors(phasing, harmonics).reshape(-1, 2, N), phasing.planet_angles, size),
        separate=bool(abs(np.exp(1j * phasing.planet_angles).mean()) < ZERO),
    )


def cyclic_shares(phasing: MeshPhasing, harmonics=range(1, 7)) -> np.ndarray:
    """Shares of the motions ``exp(i j psi_n)``, j = 0 to N // 2 and both senses, in the phase pattern.

    Parameters
    ----------
    phasing : MeshPhasing
    harmonics : (H,) sequence of int

    Returns
    -------
    (H, N // 2 + 1) array
        The larger of sun and ring meshes. With equal spacing one entry of a row is 1, at ``min(k, N - k)``
        with k = mod(h z_s, N): which of the planet modes of `femgear.models.kinds.phase_shares` it can
        excite. At unequal spacing the motions overlap, and several entries differ from 0.
    """
    harmonics, N = _whole(harmonics), phasing.n_planets
    orders = np.arange(N // 2 + 1)
    size = [
        np.abs(planet_sums(turns, phasing.positions, phasing.teeth_sum, harmonics, sense * orders))
        for turns in phasing.turns
        for sense in (1, -1)
    ]
    shares = np.max(size, axis=0)
    return np.where(shares < ZERO, 0.0, shares)


def _whole(harmonics) -> np.ndarray:
    return check_harmonics(list(harmonics) if isinstance(harmonics, range) else harmonics)


def _planet_resultants(phasing: MeshPhasing, harmonics: np.ndarray) -> np.ndarray:
    """Sums and differences of the two meshes of each planet, (H, N, 5).

    Meshes of equal forces push the planet the same way along the carrier's circle and turn it opposite ways;
    a planet of one hand feels opposite thrusts from sun and ring, which tilt it.
    """
    between = (phasing.phases[phasing.n_planets :] - phasing.phases[: phasing.n_planets]) * np.pi
    sums, differences = (
        np.abs(np.cos(np.outer(harmonics, between))),
        np.abs(np.sin(np.outer(harmonics, between))),
    )
    order = (differences, sums, differences, differences, sums)
    table = np.stack(order, axis=-1)
    return np.where(table < ZERO, 0.0, table)


def _mode_shares(factors: np.ndarray, psi: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Shares (H, 3) of the phase pattern in 1, in ``exp(+-i psi_n)`` and in neither.

    In planet modes the central members rest, which asks of the planets' amplitudes w_n ``sum w_n = sum w_n
    exp(i psi_n) = 0``, at unequal spacing too (J. Lin and R. G. Parker, J. Sound Vib. 233, 2000, 921-928).
    """
    basis = np.exp(1j * np.outer((0, 1, -1), psi)).T
    left, value, _ = np.linalg.svd(basis, full_matrices=False)
    left = left[:, value > 1e-9 * value[0]]
    rest = factors - (factors @ left.conj()) @ left.T
    planet = np.linalg.norm(rest, axis=-1).max(axis=1) / math.sqrt(len(psi))
    shares = np.column_stack([size[..., 0].max(axis=1), size[..., 1:].max(axis=(1, 2)), planet])
    return np.where(shares < ZERO, 0.0, shares)


def mesh_loads(directions, phasing: MeshPhasing, harmonics) -> np.ndarray:
    """Loads of unit mesh forces with their phases on all coordinates of a model, by family of meshes.

    Parameters
    ----------
    directions : (n, 2N) array
        Mesh columns of a model, such as `femgear.models.planar.mesh_directions`.
    phasing : MeshPhasing
    harmonics : (H,) sequence of int

    Returns
    -------
    (H, 2, n) complex array
        Loads by the sun meshes and by the ring meshes.
    """
    directions, N = np.asarray(directions), phasing.n_planets
    factors = phase_factors(phasing, harmonics).reshape(-1, 2, N)
    return np.einsum("nfj,hfj->hfn", directions.reshape(len(directions), 2, N), factors)
