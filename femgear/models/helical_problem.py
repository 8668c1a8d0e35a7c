"""Helical planetary set with mesh stiffness that changes, play and contact loss."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femgear.errors import CaseError
from femgear.models.helical import HelicalSet, helical_system
from femgear.models.planar_data import PlanarTorque
from femgear.models.planar_problem import damping_matrix, mesh_elements
from femgear.solvers.elements import GearMeshes
from femgear.solvers.modal import solve_modes
from femgear.solvers.nonlinear import NonlinearSystem
from femgear.solvers.series import FourierSeries, StepSeries
from femgear.system import MeshExcitation


def helical_meshes(
    data: HelicalSet,
    *,
    stiffness: FourierSeries | StepSeries | MeshExcitation | None = None,
    harmonics: int | None = None,
    orders: tuple[int, ...] = (1,),
    backlash: float | np.ndarray | None = None,
    separates: bool = True,
    smoothing: float = 0.0,
) -> GearMeshes:
    """The slices of the 2N meshes as elements, each of them separating by itself.

    Parameters
    ----------
    data : HelicalSet
    stiffness : FourierSeries, StepSeries or MeshExcitation, optional
        Of the 2N S columns [N/m], or their record as from
        `femgear.models.helical_excitation.helical_excitation`; the constant stiffnesses of the set when not
        given.
    harmonics, orders
        Of a record, see `femgear.solvers.elements.gear_meshes`.
    backlash : float or (2N S,) array, optional
        Play along the tooth normal [m]. None takes that of the record; without one, or where it is zero
        there, the meshes have no back side.
    separates, smoothing
        See `femgear.solvers.elements.GearMeshes`.

    Raises
    ------
    CaseError
        A record without the number of its harmonics (E-HARMONICS), values for another number of columns
        (E-SHAPE).
    """
    made = mesh_elements(stiffness, data.column_stiffness, harmonics, orders, record="record")
    backlash = made.backlash if backlash is None else backlash
    return replace(made, backlash=backlash, separates=separates, smoothing=smoothing)


def helical_problem(
    data: HelicalSet,
    *,
    meshes: GearMeshes | None = None,
    torque: PlanarTorque | None = None,
    damping: float | np.ndarray | None = None,
) -> NonlinearSystem:
    """Helical set with its meshes as elements, for harmonic balance and time integration.

    Back flanks act on the line of the drive flanks: there is no wedging.

    Parameters
    ----------
    data : HelicalSet
    meshes : GearMeshes, optional
        From `helical_meshes`; constant stiffnesses without back side when not given.
    torque : PlanarTorque, optional
    damping : float, (n_modes,) array or (n, n) array, optional
        Damping ratio of all modes, or one a mode, with mean stiffnesses; or the matrix ``C``.

    Raises
    ------
    CaseError
        A load that accelerates the set (E-LOAD-BALANCE), arrays that do not fit (E-SHAPE).
    """
    meshes = helical_meshes(data) if meshes is None else meshes
    columns = np.arange(2 * data.n_planets * data.slices)
    if not np.array_equal(meshes.columns[:, 0], columns):
        raise CaseError(
            f"meshes on columns {meshes.columns[:, 0].tolist()}", code="E-SHAPE", key="meshes",
            limit=f"columns 0 to {len(columns) - 1} in order", remedy="make them with helical_meshes",
        )  # fmt: skip
    system = helical_system(data, torque=torque)
    reference = NonlinearSystem(system, (meshes,)).reference
    # refuses a load that nothing takes up before a solver drifts away with it
    solve_modes(system, reference)
    return NonlinearSystem(replace(system, C=damping_matrix(system, reference, damping)), (meshes,))
