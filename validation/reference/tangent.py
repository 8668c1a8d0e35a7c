"""Tangent stiffness of meshes from the whole compliance matrix of one position.

The counter-proof of `femgear.contact.batch.ContactTangents` by Cholesky factors of all touching candidates.
"""

from __future__ import annotations

import numpy as np

from femgear.contact.active_set import factor, forward
from femgear.contact.solve import ContactState


def tangent_stiffness(H, state: ContactState, mesh, window, cell, n_meshes) -> np.ndarray:
    """Tangent stiffness of every mesh at constant loads of the other meshes.

    ``K_A = 1^T (H_jj,AA)^-1 1`` over the loaded candidates A of mesh j, which all approach by the same small
    amount. The load over approach of cells is piecewise linear: ``K_A`` jumps by about a per cent whenever a
    cell is added at an end of a contact. Between the load at which the last cell ``a`` of an end began to
    carry and that at which the next one, ``b``, will, the slope goes from the mean of ``K_A-a`` and ``K_A``
    to the mean of ``K_A`` and ``K_A+b``, in proportion to how far the load has come. The first cell of a
    tooth pair comes all at once.

    Parameters
    ----------
    H, state : (n, n) array, ContactState
        Compliance between the candidates [m/N], and their solution.
    mesh, window, cell : (n,) integer arrays
        Mesh, 0 to ``n_meshes - 1``, of every candidate, number of its contact window and place in it, both
        ascending.

    Returns
    -------
    (n_meshes,) array
        [N/m]; zero where no candidate of the mesh carries load.

    Raises
    ------
    ContactError
        E-CONTACT-COMPLIANCE when the compliance of the touching candidates is not positive definite.
    """
    H, mesh, window, cell = (np.asarray(a) for a in (H, mesh, window, cell))
    stiffness = np.zeros(n_meshes)
    for j in range(n_meshes):
        index = np.flatnonzero(state.active & (mesh == j))
        if len(index):
            stiffness[j] = _smooth_tangent(H, state, index, _ends_of_contacts(state, index, window, cell))
    return stiffness


def mesh_tangent_matrix(H, active, mesh_of_candidate, n_meshes) -> np.ndarray:
    """Tangent stiffness of all meshes together, with the coupling through their common bodies.

    ``g^T (H_AA)^-1 g`` with one indicator column of ``g`` a mesh: the increments of the mesh forces per
    unit approach of each mesh while the others hold theirs.

    Arguments and errors are those of `tangent_stiffness`. The (n_meshes, n_meshes) array [N/m] is symmetric;
    rows and columns of meshes without load are zero.
    """
    index = np.flatnonzero(active)
    if not len(index):
        return np.zeros((n_meshes, n_meshes))
    columns = (np.asarray(mesh_of_candidate)[index, None] == np.arange(n_meshes)).astype(float)
    half = forward(factor(np.asarray(H, float)[np.ix_(index, index)]), columns)
    return half.T @ half


def _ends_of_contacts(state: ContactState, index, window, cell) -> np.ndarray:
    """Places in `index` of the last loaded cells of every end, and the open candidates next to them.

    A row of the second kind is -1 where the window or the flank ends, shape (2, ends).
    """
    edge = np.flatnonzero(np.diff(window[index]))
    first, last = np.append(0, edge + 1), np.append(edge, len(index) - 1)
    loaded = np.concatenate([first, last])
    beside = index[loaded] + np.repeat([-1, 1], len(first))
    inside = (beside >= 0) & (beside < len(cell))
    beside = np.where(inside, beside, index[loaded])
    same = window[beside] == window[index[loaded]]
    next_cell = np.abs(cell[beside] - cell[index[loaded]]) == 1
    return np.stack([loaded, np.where(same & next_cell & ~state.active[beside], beside, -1)])


def _smooth_tangent(H, state: ContactState, index, ends) -> float:
    """Slope of the load over the common approach of the candidates `index` [N/m]."""
    first, last = np.split(ends[0], 2)
    alone = np.tile(first == last, 2)[ends[1] >= 0]
    loaded, beside = ends[:, ends[1] >= 0]
    lower = factor(H[np.ix_(index, index)])
    columns = np.zeros((len(index), 1 + 2 * len(loaded)))
    columns[:, 0] = 1.0
    columns[loaded, 1 + np.arange(len(loaded))] = 1.0
    columns[:, 1 + len(loaded) :] = H[np.ix_(index, beside)]
    half = forward(lower, columns)
    under_unit, unit, reach = half[:, 0], half[:, 1 : 1 + len(loaded)], half[:, 1 + len(loaded) :]
    rate, closing = under_unit @ unit, 1.0 - under_unit @ reach
    # what the slope loses without the last cell, and gains with the next one
    lost = np.where(alone, 0.0, rate**2 / (unit**2).sum(axis=0))
    gained = closing**2 / (H[beside, beside] - (reach**2).sum(axis=0))
    come, left = state.loads[index[loaded]] * closing, state.gaps[beside] * rate
    usable = (closing > 0) & (rate > 0) & (come + left > 0)
    share = np.divide(come, come + left, out=np.full(len(come), 0.5), where=usable)
    change = 0.5 * (share * gained - (1.0 - share) * lost)
    return float(under_unit @ under_unit + change[usable].sum())
