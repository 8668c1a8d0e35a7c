"""What the phases of meshes excite: shares of motions of the planets, loads on the coordinates of a model."""

from __future__ import annotations

import numpy as np

from femgear.gears.phasing import ZERO, MeshPhasing, check_harmonics, phase_factors, planet_sums


def phased_errors(amplitudes, phases) -> np.ndarray:
    """Transmission errors (n_meshes, H) of meshes that follow each other, ``e_j(tau) = e(tau + phi_j)``.

    Parameters
    ----------
    amplitudes : (H,) complex array
        Harmonics 1 to H at phase zero [m].
    phases : (n_meshes,) array
        phi_j as fractions of the mesh period.
    """
    return amplitudes * np.exp(2j * np.pi * np.outer(phases, np.arange(1, len(amplitudes) + 1)))


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
        with k = mod(h z_s, N): which of the planet modes of `phase_shares` it can excite.
        At unequal spacing the motions overlap, and several entries differ from 0.
    """
    harmonics, N = check_harmonics(harmonics), phasing.n_planets
    orders = np.arange(N // 2 + 1)
    size = [
        np.abs(planet_sums(turns, phasing.positions, phasing.teeth_sum, harmonics, sense * orders))
        for turns in phasing.turns
        for sense in (1, -1)
    ]
    shares = np.max(size, axis=0)
    return np.where(shares < ZERO, 0.0, shares)


def mesh_loads(directions, phasing: MeshPhasing, harmonics) -> np.ndarray:
    """Loads of unit mesh forces with their phases on all coordinates of a model, by family of meshes.

    Parameters
    ----------
    directions : (n, 2N) array
        Mesh columns of a model, such as `femgear.system.mesh_directions.mesh_directions`.
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
