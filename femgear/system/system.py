"""The dynamic waist: every model ends in these types, every solver starts from them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np


def freeze(obj, *names):
    """Turn the named array fields of a frozen dataclass into read-only contiguous arrays."""
    for name in names:
        value = getattr(obj, name)
        if value is not None:
            array = np.array(value)
            array.setflags(write=False)
            object.__setattr__(obj, name, array)


@dataclass(frozen=True)
class MechanicalSystem:
    """``M q'' + (C + Omega G) q' + K q + W f(W^T q, t) = load``.

    ``K`` holds the linear part without the gear meshes; each mesh is a column of ``W`` and its
    spring deflection, positive in compression, is ``W^T q``.

    Parameters
    ----------
    M, C, K : (n, n) arrays
        Mass [kg, kg m^2], viscous damping [N s/m, ...] and stiffness [N/m, ...].
    W : (n, n_meshes) array
        Mesh directions.
    load : (n,) array
        Constant external load [N, N m].
    dofs : tuple of str
        One name a degree of freedom, such as ``"planet 2: x"``.
    gyroscopic : (n, n) array, optional
        Skew-symmetric matrix that multiplies the speed of rotation [rad/s].
    flexibility : (n_meshes, n_meshes) array, optional
        Static compliance of bodies that are rigid in the coordinates, from the force of every mesh to the
        deflection of every other [m/N]: the spring deflections are then ``W^T q - flexibility f``.
    """

    M: np.ndarray
    C: np.ndarray
    K: np.ndarray
    W: np.ndarray
    load: np.ndarray
    dofs: tuple[str, ...]
    gyroscopic: np.ndarray | None = None
    flexibility: np.ndarray | None = None

    def __post_init__(self):
        freeze(self, "M", "C", "K", "W", "load", "gyroscopic", "flexibility")


@dataclass(frozen=True)
class MeshExcitation:
    """Gear meshes linearised about their loaded static state, over one common period.

    The force of mesh ``j`` is ``f_j(t) = force_j(t) + stiffness_j(t) (W_j^T q - deflection_j(t))``:
    the tangent line at the static state, so that the quasi-static dynamic solution is the static one.

    Parameters
    ----------
    stiffness : (n_meshes, n_positions) array
        Tangent mesh stiffness [N/m] at equidistant positions of the period (end point excluded).
    deflection : (n_meshes, n_positions) array
        Static deflection of the mesh spring [m] (the static transmission error for rigid bodies).
    force : (n_meshes, n_positions) array
        Static mesh force [N].
    backlash : (n_meshes,) array
        Total play along the line of action [m].
    periods : int
        Number of mesh periods that the record spans.
    """

    stiffness: np.ndarray
    deflection: np.ndarray
    force: np.ndarray
    backlash: np.ndarray
    periods: int = 1

    def __post_init__(self):
        freeze(self, "stiffness", "deflection", "force", "backlash")


@dataclass(frozen=True)
class Modes:
    """Modal basis of a system whose meshes have their mean stiffness.

    Parameters
    ----------
    frequency : (n_modes,) array
        Undamped natural frequencies [Hz], ascending; zero for rigid-body modes.
    damping_ratio : (n_modes,) array
    shape : (n_dofs, n_modes) array
        Mass-normalised mode shapes.
    mesh_stiffness : (n_meshes,) array
        Mean mesh stiffness [N/m] that the modes contain.
    mesh_deflection : (n_meshes, n_modes) array
        Deflection of the mesh springs, ``W^T shape`` without `MechanicalSystem.flexibility`.
    residual : (n_meshes, n_meshes) array
        Static flexibility of what the modes leave out, ``W^T K^+ W - sum r r^T / omega^2`` and
        `MechanicalSystem.flexibility` [m/N].
    load_deflection : (n_meshes,) array
        Static mesh deflection under the constant external load, ``W^T K^+ load`` [m], all modes included.
    kind : tuple of str
        Such as ``"rigid"``, ``"rotational"``, ``"translational"``, ``"planet"``, ``"ring"``.
    nodal_diameter : (n_modes,) int array
        Dominant number of nodal diameters of the ring, -1 where there is no ring.
    modal_load : (n_modes,) array, optional
        ``shape^T load``: what the constant external load does on each mode; ``None`` means no load.
    """

    frequency: np.ndarray
    damping_ratio: np.ndarray
    shape: np.ndarray
    mesh_stiffness: np.ndarray
    mesh_deflection: np.ndarray
    residual: np.ndarray
    load_deflection: np.ndarray
    kind: tuple[str, ...]
    nodal_diameter: np.ndarray
    dofs: tuple[str, ...] = field(default=())
    modal_load: np.ndarray | None = None

    def __post_init__(self):
        freeze(
            self,
            "frequency",
            "damping_ratio",
            "shape",
            "mesh_stiffness",
            "mesh_deflection",
            "residual",
            "load_deflection",
            "nodal_diameter",
            "modal_load",
        )


@dataclass(frozen=True)
class Response:
    """Periodic response at one or many speeds, as complex harmonics of the mesh frequency.

    ``x(t) = Re sum_{h=0..H} X_h exp(i h omega t)`` with ``omega = 2 pi mesh_frequency / periods``.

    Parameters
    ----------
    mesh_frequency : (n_speeds,) array
        Mesh frequency [Hz].
    deflection : (n_speeds, n_meshes, H + 1) complex array
        Mesh spring deflection ``W^T q`` [m].
    force : (n_speeds, n_meshes, H + 1) complex array
        Mesh force [N].
    modal : (n_speeds, n_modes, H + 1) complex array
        Modal coordinates of the modes that were kept (without the residual part).
    converged : (n_speeds,) bool array
    residual : (n_speeds,) array
        Relative residual of the harmonic equations.
    iterations : (n_speeds,) int array
        Iterations of the fixed point; 0 where the direct solution was used alone.
    spectral_radius : (n_speeds,) array
        Spectral radius of the fixed-point operator; the iteration contracts below one.
    tail : (n_speeds,) array
        Share of the amplitude in the upper half of the harmonics, a measure of truncation.
    method : tuple of str
        ``"fixed point"`` or ``"direct"``, one a speed.
    message : str
    periods : int
        Mesh periods in one period of the excitation record: harmonic ``h`` has the frequency
        ``h mesh_frequency / periods``.
    """

    mesh_frequency: np.ndarray
    deflection: np.ndarray
    force: np.ndarray
    modal: np.ndarray
    converged: np.ndarray
    residual: np.ndarray
    iterations: np.ndarray
    spectral_radius: np.ndarray
    tail: np.ndarray
    method: tuple[str, ...]
    message: str
    periods: int = 1

    def __post_init__(self):
        freeze(
            self,
            "mesh_frequency",
            "deflection",
            "force",
            "modal",
            "converged",
            "residual",
            "iterations",
            "spectral_radius",
            "tail",
        )
