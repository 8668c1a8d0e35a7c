"""One walk through the mesh cycle: all 2N meshes of a planetary set solved together at each position."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from femgear.contact.assembly import (
    Bodies,
    ContactProblem,
    MeshWindows,
    assemble_contact,
    cycle_positions,
    mesh_windows,
    rotation_approach,
)
from femgear.contact.bearings import BearingSprings, bearing_springs, pin_forces, solve_position
from femgear.contact.candidates import equal_cells
from femgear.contact.record import MeshCycle, cycle_without_load
from femgear.contact.solve import mesh_tangent_matrix, tangent_stiffness
from femgear.contact.supports import RIGID, MovingMembers, Supports, moving_members
from femgear.errors import ContactError

if TYPE_CHECKING:
    from femgear.gears import PlanetarySet
    from femgear.gears.deviations import SetDeviations

__all__ = ["MeshCycle", "walk_mesh_cycle"]

ROUGH_STIFFNESS = 10e9
"""Stiffness of a mesh per face width, to size windows [N/m^2]."""
HELD = 2.56
"""A window is 3.2 half widths wide: it holds the contact of this many times the force that sized it."""
LARGEST_RESIDUAL = 1e-9
"""Of contact conditions and equilibrium; rounding leaves 1e-14."""


def walk_mesh_cycle(
    planetary_set: PlanetarySet,
    bodies: Bodies,
    *,
    sun_torque: float,
    positions: int | np.ndarray = 64,
    contact: str = "profile",
    cells: int = 36,
    deviations: SetDeviations | None = None,
    supports: Supports = RIGID,
    periods: int = 1,
    planet_gaps=None,
    both_flanks: bool = False,
    pressures: bool = False,
    held_bodies: Bodies | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> MeshCycle:
    """Static transmission error, load sharing and mesh stiffness over the mesh cycle.

    Sun and planets are held at their bores, the ring at its outer surface. At every position one
    complementarity problem holds for the pressures of all meshes: no penetration, no tension, equilibrium
    of every planet and of every floating member, and the sun's torque.

    Parameters
    ----------
    planetary_set : PlanetarySet
    bodies : Bodies
        Flank compliances and material.
    sun_torque : float
        Torque on the sun [N m], not negative (mirror the set for the other flanks).
    positions : int or (P,) array
        Number of equidistant positions in one mesh period, or the positions themselves [mesh periods].
    contact : {"profile", "line_of_action"}
        Candidates on the whole profiles, or only on the theoretical path of contact.
    cells : int
        Pressure cells in a contact window.
    deviations : SetDeviations, optional
        Micro-geometry and errors.
    supports : Supports
        Members whose axes move; by default all are fixed.
    periods : int
        Mesh periods in the record; errors that belong to teeth or turn with a member need
        `gears.deviations.common_period` of them.
    planet_gaps : (N,) array, optional
        Extra separation of the sun-side flanks of each planet [m].
    both_flanks : bool
        Look for contact on the back flanks as well. Without torque, only these can be loaded: both flanks
        of teeth that are wedged.
    pressures : bool
        Keep the pressure distributions of the drive flanks.
    held_bodies : Bodies, optional
        The bodies with the ring held at its outer surface: keep stiffness and compliance between all meshes
        of the same contact with these bodies.
    progress : callable, optional
        Called with (positions done, positions).

    Returns
    -------
    MeshCycle

    Raises
    ------
    ContactError
        When the contact problem cannot be solved or no window size contains the contact.
    """
    N = planetary_set.n_planets
    position = cycle_positions(positions, periods=periods)
    nothing = cycle_without_load(
        N, position, periods=periods, contact=contact, cells=cells, pressures=pressures
    )
    if not (sun_torque > 0 or both_flanks):
        return nothing
    members = moving_members(planetary_set, supports, both_flanks=both_flanks)
    springs = bearing_springs(planetary_set, supports, members)
    width = bodies.face_width
    # without torque the windows begin with what one micrometre of wedging may carry
    share = sun_torque / (planetary_set.sun.base_radius * N) or 1e-6 * ROUGH_STIFFNESS * width
    enlarge, nearest = 1.0, 3.0 * share / (ROUGH_STIFFNESS * width)
    for _ in range(8):
        setup = mesh_windows(
            planetary_set,
            bodies,
            share=share * enlarge**2,
            positions=positions,
            cells=cells,
            nearest=nearest,
            contact=contact,
            periods=periods,
            deviations=deviations,
            planet_gaps=planet_gaps,
            both_flanks=both_flanks,
        )
        found, overflow, missed = _walk(
            planetary_set, bodies, setup, sun_torque, members, springs, pressures, held_bodies, progress
        )
        missed = missed if contact == "profile" else 0.0
        if not overflow and missed <= nearest:
            cycle = replace(nothing, **found)
            return cycle if cycle.force.any() else nothing
        if overflow:
            enlarge = _enlarged(enlarge, share, max(found["force"].max(), found["back_force"].max()))
        nearest = max(nearest, 1.2 * missed)
    raise ContactError(
        "the contact windows do not contain the contact after seven enlargements",
        code="E-CONTACT-WINDOW",
        remedy="reduce operation.torque or the errors",
    )


def _enlarged(enlarge: float, share: float, force: float) -> float:
    """Twice the window width, and twice again until windows sized by `share` hold the largest force."""
    enlarge *= 2.0
    while share * enlarge**2 < force / HELD:
        enlarge *= 2.0
    return enlarge


def _walk(
    planetary_set, bodies, setup: MeshWindows, sun_torque, members, springs, pressures, held_bodies, progress
) -> tuple[dict, bool, float]:
    """All positions with one set of windows, as fields of `MeshCycle`.

    Also whether a contact ran into the end of its window, and the `nearest` that would have held all pairs.
    """
    N, P = planetary_set.n_planets, setup.positions
    load = np.zeros(N + 1 + int(members.free.sum()))
    load[N] = sun_torque / planetary_set.sun.base_radius
    out = _empty_record(setup, members, pressures, held_bodies is not None)
    previous, overflow, missed = None, False, 0.0
    for p in range(P):
        problem = assemble_contact(setup, bodies, p, members)
        start = None if previous is None else _warm_start(problem, *previous)
        state, active = solve_position(problem, springs, load, start=start)
        previous = (problem, active)
        _collect(problem, state, setup, members, out, p)
        if held_bodies is not None:
            _collect_held(assemble_contact(setup, held_bodies, p), state, setup, out, p)
        out["unknowns"] = max(out["unknowns"], len(problem.gap))
        overflow |= problem.touches_window_end(state.active, setup)
        missed = max(missed, _penetrated_outsider(setup, p, out["deflection"][:, p]))
        if progress is not None:
            progress(p + 1, P)
    return _finished(planetary_set, setup, springs, out), overflow, missed


def _warm_start(problem: ContactProblem, previous: ContactProblem, active) -> np.ndarray:
    """Cells that touched at the previous position, and the same springs of the bearings."""
    cells = len(previous.gap)
    return np.concatenate([problem.warm_start(previous, active[:cells]), active[cells:]])


def _empty_record(setup: MeshWindows, members: MovingMembers, pressures: bool, coupling: bool) -> dict:
    """Arrays that `_collect` fills; those of teeth and cells lead with all meshes, back sides included."""
    N, P, meshes = setup.n_planets, setup.positions, setup.near.shape[0]
    out = {name: np.zeros((2 * N, P)) for name in ("deflection", "force", "back_force", "stiffness")}
    out |= {
        "max_pressure": np.zeros((meshes, P)),
        "edge_contact": np.zeros((meshes, P), bool),
        "tooth_load": np.zeros((meshes, setup.pairs, P)),
        "member_motion": np.zeros((len(members.names), P)),
        "sun_arc": np.zeros(P),
        "residual": np.zeros(P),
        "iterations": np.zeros(P, int),
        "member_names": members.names,
        "unknowns": 0,
    }
    if pressures:
        out["pressure"] = np.zeros((2 * N, setup.pairs, setup.gap.shape[-1], P))
    if coupling:
        out |= {"held_stiffness": np.zeros((2 * N, P)), "held_compliance": np.zeros((2 * N, 2 * N, P))}
    return out


def _finished(planetary_set, setup: MeshWindows, springs: BearingSprings | None, out: dict) -> dict:
    """The record with what follows from it: sides of the teeth apart, pins, messages."""
    N = setup.n_planets
    drive, back = slice(0, 2 * N), slice(2 * N, 4 * N)
    load, path, tooth = out.pop("tooth_load"), np.moveaxis(setup.zeta, 2, 1), np.stack(setup.tooth)
    for name in ("max_pressure", "edge_contact"):
        out[name] = out[name][drive]
    out |= {"tooth_load": load[drive], "path": path[drive], "tooth": tooth[:, drive]}
    looked = len(load) > 2 * N
    out |= {
        "back_tooth_load": load[back] if looked else np.zeros_like(load),
        "back_path": path[back] if looked else np.zeros_like(path),
        "back_tooth": tooth[:, back] if looked else np.zeros_like(tooth),
    }
    if "pressure" in out:
        cells = setup.gap.shape[-1]
        out["pressure_offset"] = (np.arange(cells) + 0.5 - 0.5 * cells) * setup.cell[drive, None]
        out["pressure_centre"] = np.moveaxis(setup.centre[drive], 2, 1)
    out["bearing_force"] = pin_forces(planetary_set, out["force"], out["back_force"])
    out["open_planets"] = out["force"][:N] + out["back_force"][:N] <= 0.0
    message = "all positions by the active set"
    if out["open_planets"].any():
        message += "; some planets lose all load"
        message += ", their places within the clearance of their bearings are not determined" * bool(springs)
    wedged = (out["force"] > 0) & (out["back_force"] > 0)
    if wedged.any():
        message += "; some teeth are wedged between both flanks"
    if (out["back_force"][~wedged] > 0).any():
        message += "; some meshes carry on their back flanks alone"
    return out | {"message": message}


def _collect(problem: ContactProblem, state, setup: MeshWindows, members: MovingMembers, out, p):
    """Mesh quantities of one position."""
    N, meshes = problem.n_planets, setup.near.shape[0]
    loads = state.loads
    force = np.bincount(problem.mesh, weights=loads, minlength=meshes)
    out["force"][:, p] = force[: 2 * N]
    out["back_force"][: meshes - 2 * N, p] = force[2 * N :]
    out["sun_arc"][p] = state.motions[N]
    if not state.residual <= LARGEST_RESIDUAL:
        raise ContactError(
            f"the contact solution at position {p} violates its conditions by {state.residual:.2g}",
            code="E-CONTACT-RESIDUAL",
            value=state.residual,
            limit=f"{LARGEST_RESIDUAL:g} of the largest load and displacement",
            remedy="look for stiffnesses, clearances or separations of very different size",
        )
    out["residual"][p], out["iterations"][p] = state.residual, state.iterations
    # sprung members yield under the mesh forces, free ones are unknowns of the problem
    motion = np.zeros(len(members.names))
    motion[members.free] = state.motions[N + 1 :]
    sprung = ~members.free
    motion[sprung] = -(members.approach[:, sprung].T @ force) / members.stiffness[sprung]
    out["member_motion"][:, p] = motion
    moved = members.approach[: 2 * N] @ motion
    out["deflection"][:, p] = rotation_approach(N) @ state.motions[: N + 1] + moved
    out["stiffness"][:, p] = _tangents(problem, state, setup)
    np.add.at(out["tooth_load"][:, :, p], (problem.mesh, problem.pair), loads)
    at_edge = problem.at_flank_end(state.active, setup)
    np.logical_or.at(out["edge_contact"][:, p], problem.mesh, at_edge)
    pressure = _equal_cell_pressure(problem, loads, setup, p)
    inside = np.ones(pressure.shape[:2], bool)
    inside[problem.mesh[at_edge], problem.pair[at_edge]] = False
    out["max_pressure"][:, p] = np.where(inside, pressure.max(axis=2), 0.0).max(axis=1)
    if "pressure" in out:
        out["pressure"][..., p] = pressure[: 2 * N]


def _equal_cell_pressure(problem: ContactProblem, loads, setup: MeshWindows, p) -> np.ndarray:
    """Mean pressures of equal cells, however the windows are divided, (meshes, pairs, cells) [Pa]."""
    carries = np.flatnonzero(loads)
    mesh, pair, cell = problem.mesh[carries], problem.pair[carries], problem.cell[carries]
    pressure = np.zeros((setup.near.shape[0], setup.pairs, setup.gap.shape[-1]))
    shares = equal_cells(pressure.shape[2])[setup.layout[mesh, p, pair], :, cell]
    area = setup.cell_area[mesh].mean(axis=(1, 2))
    np.add.at(pressure, (mesh, pair), shares * (loads[carries] / area)[:, None])
    return pressure


def _tangents(problem: ContactProblem, state, setup: MeshWindows) -> np.ndarray:
    """Tangent stiffness of every mesh (2N,), both flanks together [N/m]."""
    window = problem.mesh * setup.pairs + problem.pair
    meshes = setup.near.shape[0]
    found = tangent_stiffness(problem.H, state, problem.mesh, window, problem.cell, meshes)
    return found.reshape(-1, 2 * problem.n_planets).sum(axis=0)


def _collect_held(problem: ContactProblem, state, setup: MeshWindows, out, p):
    """Stiffness and compliance between the meshes of the same contact with other bodies."""
    meshes = 2 * problem.n_planets
    out["held_stiffness"][:, p] = _tangents(problem, state, setup)
    if (out["force"][:, p] > 0).all():
        drive = state.active & (problem.mesh < meshes)
        tangent = mesh_tangent_matrix(problem.H, drive, problem.mesh, meshes)
        out["held_compliance"][..., p] = np.linalg.inv(tangent)


def _penetrated_outsider(setup: MeshWindows, p, deflection) -> float:
    """Separation from the nearest pair within which no omitted pair penetrates [m]; zero if none does."""
    gap = setup.smallest_gap[:, p]
    # a back flank approaches when its drive flank parts
    deflection = np.concatenate([deflection, -deflection])[: len(gap)]
    penetrates = ~setup.near[:, p] & (gap < deflection[:, None])
    relative = deflection - gap.min(axis=1)
    return float(relative[penetrates.any(axis=1)].max(initial=0.0))
