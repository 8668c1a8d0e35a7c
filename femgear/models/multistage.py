"""Planetary stages in series as one mechanical system: every stage in the frame of its own carrier.

The stages are lumped sets (`femgear.models.planar`), the shafts between members springs or rigid. One
rotation is the same in all frames, so that torsional couplings are exact at any speed. The centres of two
members meet in the fixed frame: with ``z = x + i y`` in frames at the angles psi the lateral spring sees
``z_1 exp(i psi_1) - z_2 exp(i psi_2)``. It is a constant spring where both frames turn at one speed, or
stand; otherwise its columns stay in ``W`` for the periodic element of `femgear.models.multistage_turning`.
D. R. Kiracofe and R. G. Parker (J. Vib. Acoust. 129, 2007, 1-16) couple stages with the same springs.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from femgear.errors import CaseError
from femgear.models.multistage_data import Member, MultistageSet, StageCoupling
from femgear.models.multistage_motion import check_turns, train_speeds, train_torques
from femgear.models.planar import free_motions, mesh_directions, planar_dofs, planar_system
from femgear.models.planar_data import CENTRAL, PlanarTorque, flank_sign, member_radius
from femgear.models.planar_modes import planar_springs
from femgear.system import MechanicalSystem

# difference of two carrier speeds, relative to the largest one, that is rounding
_SAME_SPEED = 1e-12
# entry of a rigid coupling, relative to its largest one, that is rounding
_ROUNDING = 1e-12


def multistage_system(data: MultistageSet, *, torque: float = 0.0, speed: float = 0.0) -> MechanicalSystem:
    """Matrices of the train; meshes and turning lateral couplings are columns of ``W`` and not in ``K``.

    Parameters
    ----------
    data : MultistageSet
    torque : float
        On the input [N m]; it reacts on the output and on the fixed members, and chooses the loaded flanks
        of every stage. Zero: flanks of suns that drive counter-clockwise.
    speed : float
        Of the input [rad/s], for gyroscopic matrices, centripetal stiffness and centrifugal load in every
        carrier frame, so that the rotation of the whole train stays free.

    Returns
    -------
    MechanicalSystem
        ``gyroscopic`` multiplies the speed of the input and is None for zero. Columns: the 2N meshes of
        every stage, then four for every coupling of `turning_couplings`, x and y of its first and of its
        second member. ``C`` is zero.

    Raises
    ------
    CaseError
        A torque on a held member, a train that is not determined or locked (E-MECHANISM), centres joined
        rigidly between frames of different speeds (E-COUPLING).
    """
    from scipy.linalg import block_diag

    check_turns(data)
    turning = turning_couplings(data, speed)
    carrier = train_speeds(data, speed).carrier if speed else np.zeros(len(data.stages))
    parts = [planar_system(one.data, carrier_speed=w) for one, w in zip(data.stages, carrier.tolist())]
    Z = joined_motions(data)
    K = block_diag(*(part.K for part in parts)) + _centrifugal_stiffness(data, carrier)
    for number, coupling in enumerate(data.couplings):
        columns, stiffness = _springs(data, coupling, lateral=number not in turning)
        K += (columns * stiffness) @ columns.T
    meshes = [free_motions(one.data).T @ mesh_directions(one.data, sign)
              for one, sign in zip(data.stages, stage_flanks(data, torque))]  # fmt: skip
    W = np.hstack([block_diag(*meshes), *(_ends(data, data.couplings[number]) for number in turning)])
    load = np.concatenate([part.load for part in parts]) + _torque_load(data, torque)
    return MechanicalSystem(
        M=Z.T @ block_diag(*(part.M for part in parts)) @ Z,
        C=np.zeros((Z.shape[1], Z.shape[1])),
        K=Z.T @ K @ Z,
        W=Z.T @ W,
        load=Z.T @ load,
        dofs=_names(data, Z),
        gyroscopic=Z.T @ _gyroscopic(parts, carrier / speed) @ Z if speed else None,
    )


def mesh_columns(data: MultistageSet) -> tuple[np.ndarray, ...]:
    """Columns of ``W`` with the 2N meshes of every stage."""
    ends = np.cumsum([0] + [2 * stage.data.n_planets for stage in data.stages])
    return tuple(np.arange(first, last) for first, last in pairwise(ends))


def mean_mesh_stiffness(data: MultistageSet) -> np.ndarray:
    """Of all meshes of all stages [N/m], in the order of `mesh_columns`."""
    return np.concatenate([stage.data.mesh_stiffness for stage in data.stages])


def stage_flanks(data: MultistageSet, torque: float) -> tuple[int, ...]:
    """Loaded flanks of every stage: 1 where the sun drives counter-clockwise, else -1."""
    if not torque:
        return (1,) * len(data.stages)
    on_sun = train_torques(data, torque, radii=True).sun
    return tuple(flank_sign(one.data, PlanarTorque(float(t))) for one, t in zip(data.stages, on_sun))


def turning_couplings(data: MultistageSet, speed: float) -> dict[int, float]:
    """Lateral couplings between frames that turn against one another.

    Parameters
    ----------
    data : MultistageSet
    speed : float
        Of the input [rad/s].

    Returns
    -------
    dict of int to float
        Number of the coupling (from 0): speed of the second frame less that of the first [rad/s].

    Raises
    ------
    CaseError
        Centres joined rigidly between such frames (E-COUPLING).
    """
    if not speed or not any(one.lateral for one in data.couplings):
        return {}
    carrier = train_speeds(data, speed).carrier
    found = {}
    for number, one in enumerate(data.couplings):
        relative = carrier[one.second.stage - 1] - carrier[one.first.stage - 1]
        if not one.lateral or abs(relative) <= _SAME_SPEED * np.abs(carrier).max():
            continue
        if math.isinf(one.lateral):
            raise CaseError(
                f"the centres of {one.first} and {one.second} are one, in frames of different speeds",
                code="E-COUPLING", key=f"couplings[{number}].lateral", limit="a finite stiffness",
                remedy="give the stiffness of the shaft, see shaft_stiffness",
            )  # fmt: skip
        found[number] = float(relative)
    return found


def joined_motions(data: MultistageSet) -> np.ndarray:
    """Coordinates of all stages (n_stages, n) per unit of those that rigid couplings leave free.

    The rows are those of the `planar_system` of every stage, one after the other. Of two joined coordinates
    that of the earlier place stays.
    """
    size = sum(free_motions(stage.data).shape[1] for stage in data.stages)
    Z = np.eye(size)
    for coupling in data.couplings:
        for row in _rigid_rows(data, coupling):
            row = row @ Z
            moved = np.flatnonzero(np.abs(row) > _ROUNDING * np.abs(row).max(initial=0.0))
            if not len(moved):
                continue
            # the last coordinate follows the others
            keep = np.delete(np.arange(Z.shape[1]), moved[-1])
            Z = Z[:, keep] - np.outer(Z[:, moved[-1]], row[keep] / row[moved[-1]])
    return Z


def stage_slices(data: MultistageSet) -> tuple[slice, ...]:
    """Rows of `joined_motions` that belong to every stage."""
    ends = np.cumsum([0] + [free_motions(stage.data).shape[1] for stage in data.stages])
    return tuple(slice(int(a), int(b)) for a, b in pairwise(ends))


def multistage_springs(data: MultistageSet) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Springs of the train at rest by name, for `femgear.solvers.mode_energy.strain_shares`.

    Returns
    -------
    dict of str to (columns (n, g), stiffness (g,))
        Those of `planar_springs` of every stage, and the elastic couplings.
    """
    Z, springs = joined_motions(data), {}
    for number, (stage, rows) in enumerate(zip(data.stages, stage_slices(data)), 1):
        for name, (columns, stiffness) in planar_springs(stage.data).items():
            springs[f"stage {number} {name}"] = (Z[rows].T @ columns, stiffness)
    for coupling in data.couplings:
        columns, stiffness = _springs(data, coupling, lateral=True)
        if len(stiffness):
            springs[f"{coupling.first} to {coupling.second}"] = (Z.T @ columns, stiffness)
    return springs


def _centrifugal_stiffness(data: MultistageSet, carrier: np.ndarray) -> np.ndarray:
    """What makes the centripetal stiffness of the planets leave the rotation of the train free.

    Lin and Parker take ``m Omega^2`` from all tangential motion eta of the planets, also where the set turns
    as a whole. The pins turn with the carrier: with the planet at ``(a + zeta + i (eta - u_c)) exp(i (Omega t
    + u_c / a))`` Lagrange's equations have the same gyroscopic terms, and the centripetal ones of zeta and
    ``eta - u_c``. The difference is ``m Omega^2 (eta^2 - (eta - u_c)^2)`` a planet.
    """
    from scipy.linalg import block_diag

    blocks = []
    for stage, speed in zip(data.stages, carrier.tolist()):
        T, N = free_motions(stage.data), stage.data.n_planets
        tangential, turned = T[10 + 3 * np.arange(N)], T[2]
        apart = tangential - turned
        blocks.append(stage.data.planet.mass * speed**2 * (tangential.T @ tangential - apart.T @ apart))
    return block_diag(*blocks)


def _gyroscopic(parts: list[MechanicalSystem], ratio: np.ndarray) -> np.ndarray:
    """Matrix per unit of the input's speed; ``ratio`` (S,) of the carriers' speeds to it."""
    from scipy.linalg import block_diag

    still = (np.zeros_like(part.M) if part.gyroscopic is None else part.gyroscopic for part in parts)
    return block_diag(*(one * matrix for one, matrix in zip(ratio, still)))


def _axis(data: MultistageSet, member: Member, axis: int) -> np.ndarray:
    """Unit column of x, y or u of a member in the coordinates of all stages; zero where it is held."""
    blocks = []
    for number, stage in enumerate(data.stages, 1):
        T = free_motions(stage.data)
        rows = T[3 * CENTRAL.index(member.name) + axis] if number == member.stage else np.zeros(T.shape[1])
        blocks.append(rows)
    return np.concatenate(blocks)


def _twist(data: MultistageSet, coupling: StageCoupling) -> np.ndarray:
    """Rotation of the first member less that of the second, per coordinate."""
    one, other = (
        _axis(data, member, 2) / member_radius(data.stages[member.stage - 1].data, member.name)
        for member in (coupling.first, coupling.second)
    )
    return one - other


def _shift(data: MultistageSet, coupling: StageCoupling) -> np.ndarray:
    """x and y (n, 2) of the first centre less the second, in the first frame, both as they stand."""
    turn = data.stages[coupling.second.stage - 1].angle - data.stages[coupling.first.stage - 1].angle
    ends, c, s = _ends(data, coupling), math.cos(turn), math.sin(turn)
    return ends[:, :2] - ends[:, 2:] @ np.array([[c, s], [-s, c]])


def _ends(data: MultistageSet, coupling: StageCoupling) -> np.ndarray:
    """x and y of the first and of the second member (n, 4)."""
    return np.stack([_axis(data, m, k) for m in (coupling.first, coupling.second) for k in (0, 1)], axis=1)


def _springs(data: MultistageSet, coupling: StageCoupling, *, lateral: bool):
    """Columns (n, g) and stiffnesses (g,) of what is elastic in a coupling."""
    columns, stiffness = [], []
    if math.isfinite(coupling.torsional):
        columns, stiffness = [_twist(data, coupling)[:, None]], [coupling.torsional]
    if lateral and coupling.lateral and math.isfinite(coupling.lateral):
        columns.append(_shift(data, coupling))
        stiffness += [coupling.lateral] * 2
    size = sum(free_motions(stage.data).shape[1] for stage in data.stages)
    return np.hstack([np.empty((size, 0)), *columns]), np.array(stiffness)


def _rigid_rows(data: MultistageSet, coupling: StageCoupling) -> list[np.ndarray]:
    rows = [_twist(data, coupling)] if math.isinf(coupling.torsional) else []
    return rows + (list(_shift(data, coupling).T) if math.isinf(coupling.lateral) else [])


def _torque_load(data: MultistageSet, torque: float) -> np.ndarray:
    """Forces on ``u`` of input and output."""
    if not torque:
        return np.zeros(sum(free_motions(stage.data).shape[1] for stage in data.stages))
    output = train_torques(data, torque, radii=True).output
    load = 0.0
    for member, value in ((data.input, torque), (data.output, output)):
        column = _axis(data, member, 2)
        if not np.any(column):
            raise CaseError(
                f"the torque acts on the {member}, which is held", code="E-MECHANISM",
                remedy="choose members that can turn",
            )  # fmt: skip
        load = load + column * value / member_radius(data.stages[member.stage - 1].data, member.name)
    return load


def _names(data: MultistageSet, Z: np.ndarray) -> tuple[str, ...]:
    """Name of every coordinate that is left: its own row of ``Z`` is a unit row."""
    names = []
    for number, stage in enumerate(data.stages, 1):
        T = free_motions(stage.data)
        own = np.argmax(T == 1.0, axis=0)
        all_names = planar_dofs(stage.data.n_planets)
        names += [f"stage {number} {all_names[row]}" for row in own]
    return tuple(names[row] for row in np.argmax(Z == 1.0, axis=0))
