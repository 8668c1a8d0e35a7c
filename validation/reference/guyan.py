"""Static condensation on chosen degrees of freedom.

R. J. Guyan, AIAA Journal 3 (1965) 380; B. M. Irons, AIAA Journal 3 (1965) 961-962. Choice of the masters:
R. D. Henshell and J. H. Ong, Earthquake Eng. Struct. Dyn. 3 (1975) 375-383.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femgear.errors import CaseError, ConvergenceError
from femgear.system.system import MechanicalSystem


@dataclass(frozen=True)
class Condensation:
    """A system on its masters and the way back.

    Parameters
    ----------
    system : MechanicalSystem
        ``T^T M T``, ``T^T C T``, ``T^T K T``, ``T^T W``, ``T^T load`` on the masters.
    transformation : (n, n_masters) array
        ``T``: displacements of all degrees of freedom from those of the masters.
    masters : (n_masters,) int array
        Degrees of freedom kept, ascending.
    mesh_stiffness : (n_columns,) array
        Stiffness of the columns with which the others follow statically [N/m].
    """

    system: MechanicalSystem
    transformation: np.ndarray
    masters: np.ndarray
    mesh_stiffness: np.ndarray


@dataclass(frozen=True)
class CondensationError:
    """Natural frequencies of a condensed system beside the true ones.

    Parameters
    ----------
    frequency : (n_modes,) array
        Of the full system [Hz].
    condensed : (n_modes,) array
        Of the condensed one, never lower [Hz].
    error : (n_modes,) array
        Relative; zero for rigid modes.
    """

    frequency: np.ndarray
    condensed: np.ndarray
    error: np.ndarray


def condense(system: MechanicalSystem, masters, *, mesh_stiffness=None) -> Condensation:
    """Guyan reduction: the other degrees of freedom follow the masters as they would at rest.

    Static solutions for loads on the masters are exact, frequencies are upper bounds. Loads and column
    forces on the other degrees of freedom are moved to the masters, their own deflection is lost.

    Parameters
    ----------
    system : MechanicalSystem
    masters : (n_masters,) int array
    mesh_stiffness : (n_columns,) array, optional
        Stiffness [N/m] of the columns in the static solution; none when not given.

    Raises
    ------
    CaseError
        Masters that are not degrees of freedom or appear twice.
    ConvergenceError
        The degrees of freedom left out can move without strain when the masters are held.
    """
    from scipy import linalg

    n = len(system.M)
    kept = np.unique(np.asarray(masters))
    whole = np.issubdtype(kept.dtype, np.integer) and kept.size == np.size(masters)
    if not whole or not len(kept) or kept[0] < 0 or kept[-1] >= n:
        raise CaseError(
            "masters must be different degrees of freedom",
            code="E-MASTERS",
            key="masters",
            value=np.asarray(masters).tolist(),
            limit=f"0 to {n - 1}, each once",
        )
    columns = np.zeros(system.W.shape[1]) if mesh_stiffness is None else np.asarray(mesh_stiffness, float)
    stiffness = system.K + (system.W * columns) @ system.W.T
    others = np.setdiff1d(np.arange(n), kept)
    transformation = np.zeros((n, len(kept)))
    transformation[kept, range(len(kept))] = 1.0
    if len(others):
        inner = stiffness[np.ix_(others, others)]
        _check_held(system, inner, others)
        transformation[others] = -linalg.solve(inner, stiffness[np.ix_(others, kept)], assume_a="sym")
    reduced = replace(
        system,
        **{name: transformation.T @ getattr(system, name) @ transformation for name in ("M", "C", "K")},
        W=transformation.T @ system.W,
        load=transformation.T @ system.load,
        dofs=tuple(system.dofs[i] for i in kept) if system.dofs else (),
        gyroscopic=None if system.gyroscopic is None else transformation.T @ system.gyroscopic @ transformation,
    )
    return Condensation(reduced, transformation, kept, columns)


def choose_masters(system: MechanicalSystem, count: int, *, mesh_stiffness=None) -> np.ndarray:
    """``count`` masters (ascending): the others go one by one, always the largest ``k_ii / m_ii``.

    The diagonal is that of the system already condensed (Henshell and Ong 1975), so each step leaves out the
    degree of freedom that follows the rest with the least inertia.
    """
    n = len(system.M)
    if not 1 <= count <= n:
        raise CaseError(f"{count} masters of {n} degrees of freedom", code="E-MASTERS", limit=f"1 to {n}")
    columns = np.zeros(system.W.shape[1]) if mesh_stiffness is None else np.asarray(mesh_stiffness, float)
    stiffness = system.K + (system.W * columns) @ system.W.T
    mass, left = np.array(system.M), np.arange(n)
    while len(left) > count:
        diagonal = np.diag(stiffness)
        ratio = np.where(diagonal > 1e-12 * diagonal.max(), diagonal / np.diag(mass), -np.inf)
        out = int(np.argmax(ratio))
        if not np.isfinite(ratio[out]):
            raise ConvergenceError("no stiffness left to condense with", code="E-MASTERS")
        keep = np.delete(np.arange(len(left)), out)
        follow = -stiffness[out, keep] / stiffness[out, out]
        cross = np.outer(mass[keep, out], follow)
        mass = mass[np.ix_(keep, keep)] + cross + cross.T + mass[out, out] * np.outer(follow, follow)
        stiffness = stiffness[np.ix_(keep, keep)] + np.outer(stiffness[keep, out], follow)
        left = left[keep]
    return left


def condensation_error(system: MechanicalSystem, reduction: Condensation) -> CondensationError:
    """Frequencies of the condensed system against those of the full one, meshes included."""
    full = _frequencies(system, reduction.mesh_stiffness)
    small = _frequencies(reduction.system, reduction.mesh_stiffness)
    true = full[: len(small)]
    floor = 1e-6 * full[-1]
    error = np.where(true > floor, (small - true) / np.where(true > floor, true, 1.0), 0.0)
    return CondensationError(true, small, error)


def _frequencies(system: MechanicalSystem, mesh_stiffness) -> np.ndarray:
    from scipy import linalg

    values = linalg.eigh(system.K + (system.W * mesh_stiffness) @ system.W.T, system.M, eigvals_only=True, driver="gvd")
    return np.sqrt(np.maximum(values, 0.0)) / (2.0 * np.pi)


def _check_held(system: MechanicalSystem, inner, others) -> None:
    size = np.diag(inner)
    if np.any(size <= 0.0):
        loose = int(others[np.argmin(size)])
        name = system.dofs[loose] if system.dofs else str(loose)
        raise ConvergenceError(
            f"nothing holds degree of freedom {name} when the masters are held",
            code="E-MASTERS",
            remedy="make it a master or give the meshes their stiffness",
        )
    scaled = inner / np.sqrt(np.outer(size, size))
    if np.linalg.eigvalsh(scaled)[0] <= 1e-12:
        raise ConvergenceError(
            "the degrees of freedom left out can move together without strain",
            code="E-MASTERS",
            remedy="make one of them a master or give the meshes their stiffness",
        )
