"""Displacement of a whole cyclic body under loads on any of its sectors, from one sector."""

from __future__ import annotations

import numpy as np

from femgear.fe.compliance import cut_rotation, split_sector, symmetric_factor


def cyclic_displacement(grid, stiffness, loads, *, held) -> np.ndarray:
    """Static displacement of every sector in its own frame.

    The loads are transformed over the sectors, each harmonic is solved on the sector with its cuts tied
    (see `femgear.fe.compliance`), and the solutions are transformed back.

    Parameters
    ----------
    grid : Grid
        Sector with boundaries ``cut_left``, ``cut_right`` and `held`.
    stiffness : (2n, 2n) sparse matrix
        [N/m].
    loads : (count, 2n) array
        Nodal forces of each sector in its own frame [N].
    held : str or None
        Boundary that cannot move.

    Returns
    -------
    (count, n, 2) array
        [m].
    """
    count, size = loads.shape
    inner, right, left = split_sector(grid, held)
    cut = np.concatenate([right, left])
    stiffness = stiffness.tocsc()
    K_ib = stiffness[inner][:, cut].toarray()
    harmonics = np.fft.rfft(loads, axis=0)
    n_h, nb = len(harmonics), len(right)
    forces = harmonics[:, inner].T
    solved = symmetric_factor(stiffness[inner][:, inner]).solve(np.hstack([K_ib, forces.real, forces.imag]))
    X_b, X_f = solved[:, : 2 * nb], solved[:, 2 * nb : 2 * nb + n_h] + 1j * solved[:, 2 * nb + n_h :]
    S = stiffness[cut][:, cut].toarray() - K_ib.T @ X_b
    on_cut = harmonics[:, cut] - (K_ib.T @ X_f).T
    tie = np.empty((n_h, 2 * nb, nb), complex)
    tie[:, :nb] = np.eye(nb)
    phase = np.exp(2j * np.pi * np.arange(n_h) / count)
    tie[:, nb:] = phase[:, None, None] * cut_rotation(count, nb)
    adjoint = tie.conj().transpose(0, 2, 1)
    u_right = np.linalg.solve(adjoint @ S @ tie, (adjoint @ on_cut[:, :, None]))
    u_cut = (tie @ u_right)[:, :, 0]
    field = np.zeros((n_h, size), complex)
    field[:, inner] = (X_f - X_b @ u_cut.T).T
    field[:, cut] = u_cut
    return np.fft.irfft(field, n=count, axis=0).reshape(count, -1, 2)
