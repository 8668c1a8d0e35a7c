"""Where the energy of modes sits: kinetic energy in groups of coordinates, strain energy in springs.

With the springs of planetary sets by name, and the planes in which their bodies whirl.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from femgear.errors import CaseError
from femgear.gears.planetary import mesh_names
from femgear.system.mesh_directions import free_motions, mesh_directions, pin_directions
from femgear.system.mode_kinds import SetMotions
from femgear.system.rigid_bodies import CENTRAL, ROTATIONS, RigidSet

# Strain energy relative to the sum of the absolute terms below which a motion has none.
_UNSTRAINED = 1e-12
# Names of the springs of a bearing or support, and their places among the motions of its body.
_IN_THE_PLANE = {"{}": (0, 1), "torsional {}": (2,)}
_IN_SPACE = {"{}, radial": (0, 1), "{}, axial": (2,), "{}, tilt": (3, 4), "{}, torsional": (5,)}


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
            f"{len(places)} coordinates in groups, of {len(shape)}",
            code="E-SHAPE",
            limit="every coordinate in one group",
        )
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
    return {name: np.where(strained, part / np.where(strained, total, 1.0), 0.0) for name, part in energy.items()}


def stiffness_of(parts: Mapping[str, tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """``sum w k w^T`` (n, n) of all parts."""
    return sum((columns * stiffness) @ columns.T for columns, stiffness in parts.values())


def body_groups(dofs: Sequence[str]) -> dict[str, np.ndarray]:
    """Coordinates of every body, from names such as ``"planet 2: x"``."""
    groups: dict[str, list[int]] = {}
    for place, name in enumerate(dofs):
        groups.setdefault(name.split(":")[0], []).append(place)
    return {name: np.array(rows) for name, rows in groups.items()}


def gear_set_springs(data: RigidSet, *, mesh_stiffness=None) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Springs of the set by name, for `strain_shares`.

    Parameters
    ----------
    data : RigidSet
    mesh_stiffness : (n_columns,) array, optional
        Of the mesh columns [N/m]; that of the set when not given.

    Returns
    -------
    dict of str to (columns (n, g), stiffness (g,))
        Meshes one by one (a column a slice), planet bearings one by one, supports of the central members, in
        [m] and [rad]; in space bearings and supports by direction: ``radial`` (two columns), ``axial``,
        ``tilt`` (two) and ``torsional``. What is held or free has no spring.
    """
    T, N = free_motions(data), data.n_planets
    k = np.asarray(data.column_stiffness if mesh_stiffness is None else mesh_stiffness, float)
    k = k.reshape(2 * N, -1)
    meshes = (T.T @ mesh_directions(data)).reshape(T.shape[1], 2 * N, -1)
    springs = {name: (meshes[:, j], k[j]) for j, name in enumerate(mesh_names(N))}
    pins = pin_directions(data)
    for n in range(N):
        springs |= _by_direction(data, f"bearing of planet {n + 1}", T.T @ pins[:, n], data.pin_stiffness[n])
    axes = len(data.axes)
    scale = np.where(np.isin(data.axes, ROTATIONS), data.radii[:, None], 1.0)
    for row, name in enumerate(CENTRAL):
        columns = T[axes * row : axes * (row + 1)].T / scale[row]
        springs |= _by_direction(data, f"support of the {name}", columns, data.support_stiffness[row])
    return springs


def _by_direction(data: RigidSet, name: str, columns: np.ndarray, stiffness: np.ndarray) -> dict:
    """Springs that are finite and not zero, by the directions of the set."""
    there = np.isfinite(stiffness) & (stiffness > 0.0)
    return {
        direction.format(name): (columns[:, list(places)], stiffness[list(places)])
        for direction, places in (_IN_SPACE if len(data.axes) > 3 else _IN_THE_PLANE).items()
        if places[0] < len(stiffness) and there[places[0]]
    }


def motion_planes(dofs: Sequence[str]) -> np.ndarray:
    """Rows (k, 2) of x and y, or radial and tangential, of every body that has both, for `whirl`."""
    place = {name: i for i, name in enumerate(dofs)}
    planes = []
    for first, second in (("x", "y"), ("radial", "tangential")):
        for name, i in place.items():
            body, _, axis = name.partition(": ")
            if axis == first and (partner := place.get(f"{body}: {second}")) is not None:
                planes.append((i, partner))
    return np.array(planes, int).reshape(-1, 2)


def signed_phase_shares(motions: SetMotions) -> np.ndarray:
    """Shares (N, m) of the harmonics ``exp(i j psi_n)`` in the kinetic energy of equally spaced planets.

    They tell harmonic j from N - j; real shapes hold equal parts of both.
    """
    energy = (np.abs(np.fft.fft(motions.weighted, axis=0)) ** 2).sum(axis=1)
    return energy / (np.abs(motions.weighted) ** 2).sum(axis=(0, 1)) / len(energy)
