"""Modes of planetary stages in series: their kinds, and the stage in which each one lives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from femgear.errors import CaseError
from femgear.models.kinds import class_energies, named_kinds
from femgear.models.multistage import (
    joined_motions,
    mean_mesh_stiffness,
    mesh_columns,
    multistage_system,
    stage_slices,
)
from femgear.models.multistage_data import MultistageSet
from femgear.models.planar import planar_system
from femgear.models.planar_modes import planar_motions
from femgear.solvers.entries import checked_numbers
from femgear.solvers.modal import solve_modes
from femgear.system import MechanicalSystem, Modes

# relative distance of frequencies that count as one
_MULTIPLE = 1e-7


@dataclass(frozen=True, eq=False)
class MultistageModes:
    """Modes of the whole train.

    Parameters
    ----------
    modes : Modes
        ``kind``: ``rigid``; ``rotational``, ``translational`` or ``planet`` where at least 99 % of the
        kinetic energy belongs to that class in all stages together; else ``mixed``. With equally spaced
        planets every mode is pure: rotational and translational modes reach over all stages, a planet mode
        stays in one (Kiracofe and Parker, J. Vib. Acoust. 129, 2007).
    share : (S, m) array
        Of every stage in the kinetic energy.
    strain : (S + 1, m) array
        Of every stage's meshes in the strain energy, and of everything else (supports, bearings, couplings)
        in the last row; zero for rigid motions.
    """

    modes: Modes
    share: np.ndarray
    strain: np.ndarray

    @property
    def stage(self) -> np.ndarray:
        """Stage (m,) with most of the kinetic energy, from 1."""
        return self.share.argmax(axis=0) + 1

    @property
    def labels(self) -> tuple[str, ...]:
        """Such as ``"planet, stage 2 (100 %)"``."""
        return tuple(
            f"{kind}, stage {stage} ({100.0 * share[stage - 1]:.0f} %)"
            for kind, stage, share in zip(self.modes.kind, self.stage.tolist(), self.share.T)
        )


def multistage_modes(
    data: MultistageSet, *, mesh_stiffness=None, damping_ratio: float | Sequence[float] = 0.0
) -> MultistageModes:
    """Modes of the train at rest, with their kinds and stages.

    Parameters
    ----------
    data : MultistageSet
    mesh_stiffness : (n_meshes,) array, optional
        Of all stages [N/m]; that of the sets when not given.
    damping_ratio : float or (m,) array
    """
    k = mean_mesh_stiffness(data)
    if mesh_stiffness is not None:
        k = checked_numbers(mesh_stiffness, "mesh_stiffness", code="E-SHAPE", unit="N/m")
    if k.shape != (data.n_meshes,) or not np.all(np.isfinite(k)):
        raise CaseError(
            f"mesh stiffnesses of shape {k.shape}", code="E-SHAPE", key="mesh_stiffness",
            limit=f"{data.n_meshes} finite numbers, one a mesh",
        )  # fmt: skip
    system = multistage_system(data)
    modes = solve_modes(system, k, damping_ratio=damping_ratio)
    masses = stage_masses(data)
    modes = _by_stage(modes, masses)
    share = stage_shares(masses, modes.shape)
    kinds = multistage_kinds(data, modes.shape, frequency=modes.frequency)
    return MultistageModes(replace(modes, kind=kinds), share, _strain(data, system, modes))


def stage_masses(data: MultistageSet) -> np.ndarray:
    """Mass matrix of every stage in the coordinates of the train, (S, n, n)."""
    Z = joined_motions(data)
    return np.array(
        [
            Z[rows].T @ planar_system(stage.data).M @ Z[rows]
            for stage, rows in zip(data.stages, stage_slices(data))
        ]
    )


def stage_shares(masses, shape) -> np.ndarray:
    """Share (S, m) of every stage in the kinetic energy of shapes (n, m), real or complex.

    ``masses`` (S, n, n) as from `stage_masses`.
    """
    shape = np.asarray(shape)
    energy = (shape.conj() * (np.asarray(masses) @ shape)).sum(axis=1).real
    return energy / energy.sum(axis=0)


def multistage_kinds(data: MultistageSet, shape, *, frequency) -> tuple[str, ...]:
    """Kind of every mode from its shape (n, m) in the coordinates of `multistage_system`.

    The classes of `femgear.models.kinds.class_energies`, added over the stages.

    Parameters
    ----------
    data : MultistageSet
    shape : (n, m) array
    frequency : (m,) array
        Zero for rigid motions.
    """
    full = joined_motions(data) @ np.asarray(shape)
    classes, total = 0.0, 0.0
    for stage, rows in zip(data.stages, stage_slices(data)):
        motions = planar_motions(stage.data, full[rows])
        central = np.einsum("ba,bam->m", motions.central_mass, np.abs(motions.central) ** 2)
        classes = classes + class_energies(motions)
        total = total + central + (np.abs(motions.weighted) ** 2).sum(axis=(0, 1))
    return named_kinds(classes / total, frequency)


def _by_stage(modes: Modes, masses: np.ndarray) -> Modes:
    """Modes of one frequency, mixed so that each belongs to one stage as far as it can.

    Within a frequency the shapes may be mixed at will. The orthogonal mixture that diagonalises ``sum_s s
    M_s`` parts stages that do not know of each other.
    """
    size, shape = len(modes.frequency), modes.shape
    Q = np.eye(size)
    apart = np.diff(modes.frequency) > _MULTIPLE * modes.frequency[1:]
    for group in np.split(np.arange(size), np.flatnonzero(apart) + 1):
        if len(group) > 1:
            own = shape[:, group]
            weighted = sum(number * own.T @ mass @ own for number, mass in enumerate(masses, 1))
            Q[np.ix_(group, group)] = np.linalg.eigh(weighted)[1]
    return replace(
        modes, shape=shape @ Q, mesh_deflection=modes.mesh_deflection @ Q,
        modal_load=None if modes.modal_load is None else modes.modal_load @ Q,
    )  # fmt: skip


def _strain(data: MultistageSet, system: MechanicalSystem, modes: Modes) -> np.ndarray:
    """Shares (S + 1, m) of the meshes of every stage, and of ``K``, in the strain energy."""
    meshes = modes.mesh_stiffness[:, None] * modes.mesh_deflection**2
    parts = [meshes[columns].sum(axis=0) for columns in mesh_columns(data)]
    parts.append(np.einsum("im,ij,jm->m", modes.shape, system.K, modes.shape))
    elastic = modes.frequency > 0.0
    total = np.where(elastic, sum(parts), 1.0)
    return np.where(elastic, np.array(parts) / total, 0.0)
