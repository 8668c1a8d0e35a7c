"""Linear systems under force histories, by three routes that can be compared: full, modal and condensed."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from validation.reference.guyan import choose_masters, condense

from femgear.errors import CaseError
from femgear.solvers.linear.modal import modal_damping, residual_output, solve_modes
from femgear.solvers.time.convolution import equidistant, modal_history, state_history
from femgear.system.system import MechanicalSystem

ROUTES = ("full", "modal", "guyan")


@dataclass(frozen=True)
class ForceResponse:
    """Motion of a linear system at the instants of its force history.

    Parameters
    ----------
    time : (n_times,) array
        [s].
    displacement, velocity : (n_times, n) arrays
        All degrees of freedom, whatever the route.
    deflection : (n_times, n_columns) array
        ``W^T q`` [m].
    route : str
    unknowns : int
        Modes or degrees of freedom that were integrated.
    """

    time: np.ndarray
    displacement: np.ndarray
    velocity: np.ndarray
    deflection: np.ndarray
    route: str
    unknowns: int

    def __post_init__(self):
        for name in ("time", "displacement", "velocity", "deflection"):
            array = np.array(getattr(self, name), float)
            array.setflags(write=False)
            object.__setattr__(self, name, array)


def solve_force_history(
    system: MechanicalSystem,
    times,
    force,
    *,
    route: str = "modal",
    mesh_stiffness=None,
    damping_ratio=None,
    start=None,
    count: int | None = None,
    max_frequency: float | None = None,
    masters=None,
) -> ForceResponse:
    """``M q'' + C q' + (K + W k W^T) q = load + force(t)``, exact for forces linear between the instants.

    Parameters
    ----------
    system : MechanicalSystem
    times : (n_times,) array
        Equidistant [s].
    force : (n_times, n) array
        Force history [N, N m], added to the constant load of the system.
    route : str
        "full": all degrees of freedom, any damping; "modal": superposition of the modes with the static
        answer of those left out; "guyan": on masters, see `guyan`, the others following statically.
    mesh_stiffness : (n_columns,) array, optional
        Of the columns [N/m]; zero when not given.
    damping_ratio : float or (n_modes,) array, optional
        Of the modes, instead of the damping matrix, for all routes the same.
    start : pair of (n,) arrays, optional
        Displacement and velocity at the first instant; at rest when not given.
    count, max_frequency : optional
        Modes kept, as in `solve_modes`; with "guyan", ``count`` is a number of masters to be chosen.
    masters : (n_masters,) int array, optional
        For "guyan".

    Raises
    ------
    CaseError
        Instants that are not equidistant, shapes that do not fit, an unknown route, what `solve_modes`,
        `condense` refuse.
    """
    step = equidistant(times)
    n, columns = system.W.shape
    force = np.asarray(force, float)
    if force.shape != (len(times), n) or not np.all(np.isfinite(force)):
        raise CaseError(
            f"a force history of shape {force.shape}", code="E-SHAPE", key="force",
            limit=f"finite numbers ({len(times)}, {n})",
        )  # fmt: skip
    stiffness = np.zeros(columns) if mesh_stiffness is None else np.asarray(mesh_stiffness, float)
    start = np.zeros((2, n)) if start is None else np.array(start, float)
    total = force + system.load
    if route == "modal":
        keep = {"damping_ratio": damping_ratio, "count": count, "max_frequency": max_frequency}
        q, v, unknowns = _modal(system, stiffness, step, total, start, keep)
    elif route in ROUTES:
        if damping_ratio is not None:
            system = replace(system, C=modal_damping(system, stiffness, damping_ratio))
        if route == "full":
            q, v = _direct(system, stiffness, step, total, start)
            unknowns = n
        else:
            chosen = (
                choose_masters(system, count or n, mesh_stiffness=stiffness) if masters is None else masters
            )
            q, v, unknowns = _condensed(system, stiffness, step, total, start, chosen)
    else:
        raise CaseError(f"no route {route}", code="E-METHOD", key="route", limit=", ".join(ROUTES))
    return ForceResponse(times, q, v, q @ system.W, route, unknowns)


def _direct(system, stiffness, step, force, start):
    total = system.K + (system.W * stiffness) @ system.W.T
    return state_history(system.M, system.C, total, step, force, start=start)


def _modal(system, stiffness, step, force, start, keep):
    """The meshes are springs here, and the load is in the force history: rigid motions may be driven."""
    n = len(system.M)
    total = system.K + (system.W * stiffness) @ system.W.T
    linear = replace(system, K=total, W=np.zeros((n, 0)), load=np.zeros(n), gyroscopic=None)
    modes = solve_modes(linear, np.zeros(0), **keep)
    natural, shape = 2.0 * np.pi * modes.frequency, modes.shape
    begin = start @ (system.M @ shape)
    y, v = modal_history(natural, modes.damping_ratio, step, force @ shape, start=begin)
    q = y @ shape.T
    if shape.shape[1] < n:
        q += _left_out(linear, modes, force)
    return q, v @ shape.T, shape.shape[1]


def _left_out(system, modes, force):
    """Static displacement (n_times, n) of the modes left out."""
    n = len(system.M)
    # a column for every degree of freedom: the residual of the columns is that of all motions
    columns = replace(system, W=np.eye(n))
    known = replace(modes, mesh_stiffness=np.zeros(n), mesh_deflection=modes.shape)
    return force @ residual_output(columns, known, np.eye(n)).T


def _condensed(system, stiffness, step, force, start, masters):
    reduction = condense(system, masters, mesh_stiffness=stiffness)
    back = reduction.transformation
    q, v = _direct(reduction.system, stiffness, step, force @ back, start[:, reduction.masters])
    return q @ back.T, v @ back.T, len(reduction.masters)
