"""Where the energy of modes sits: kinetic energy in groups of coordinates, strain energy in springs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from femgear.errors import CaseError

# Strain energy relative to the sum of the absolute terms below which a motion has none.
_UNSTRAINED = 1e-12


def kinetic_shares(mass, shape, groups: Mapping[str, Sequence[int]]) -> dict[str, np.ndarray]:
    """Shares (m,) of groups of coordinates in the kinetic energy of every mode.

    ``Re sum_i conj(x_i) (M x)_i / x^H M x`` over the group (Geradin and Rixen, Mechanical Vibrations, 3rd
    ed., section 2.3). They add up to one.

    Parameters
    ----------
    mass : (n, n) array
    shape : (n, m) array
        Real or complex; complex ones by their mean over a period.
    groups : mapping of str to indices
        Every coordinate in one group; `body_groups` makes them from names.

    Raises
    ------
    CaseError
        Coordinates that are in no group or in two (E-SHAPE).
    """
    shape = np.asarray(shape)
    places = np.concatenate([np.asarray(rows, int) for rows in groups.values()])
    if not np.array_equal(np.sort(places), np.arange(len(shape))):
        raise CaseError(
            f"{len(places)} coordinates in groups, of {len(shape)}", code="E-SHAPE",
            limit="every coordinate in one group",
        )  # fmt: skip
    energy = (shape.conj() * (np.asarray(mass) @ shape)).real
    total = energy.sum(axis=0)
    return {name: energy[np.asarray(rows, int)].sum(axis=0) / total for name, rows in groups.items()}


def strain_shares(parts: Mapping[str, tuple[np.ndarray, np.ndarray]], shape) -> dict[str, np.ndarray]:
    """Shares (m,) of springs in the strain energy of every mode.

    ``sum_c k_c |w_c^T x|^2 / total`` of each part. They add up to one; of a motion that strains nothing all
    are zero.

    Parameters
    ----------
    parts : mapping of str to (columns (n, g), stiffness (g,))
        Springs ``k`` along the columns ``w``: meshes are columns of W, supports unit columns. Together they
        must be the whole stiffness, which `stiffness_of` gives for comparison.
    shape : (n, m) array
        Real or complex; complex ones by their mean over a period.
    """
    shape = np.asarray(shape)
    energy, bound = {}, np.zeros(shape.shape[1])
    for name, (columns, stiffness) in parts.items():
        k = np.asarray(stiffness, float)
        energy[name] = k @ np.abs(columns.T @ shape) ** 2
        bound += np.abs(k) @ (np.abs(columns).T @ np.abs(shape)) ** 2
    total = sum(energy.values())
    strained = np.abs(total) > _UNSTRAINED * bound
    return {
        name: np.where(strained, one / np.where(strained, total, 1.0), 0.0) for name, one in energy.items()
    }


def stiffness_of(parts: Mapping[str, tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """``sum w k w^T`` (n, n) of all parts."""
    return sum((columns * stiffness) @ columns.T for columns, stiffness in parts.values())


def body_groups(dofs: Sequence[str]) -> dict[str, np.ndarray]:
    """Coordinates of every body, from names such as ``"planet 2: x"``."""
    groups: dict[str, list[int]] = {}
    for place, name in enumerate(dofs):
        groups.setdefault(name.split(":")[0], []).append(place)
    return {name: np.array(rows) for name, rows in groups.items()}
