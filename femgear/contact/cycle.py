"""One walk through the mesh cycle: all 2N meshes of a planetary set solved together at each position."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femgear.contact.assembly import (
    Bodies,
    ContactProblem,
    MeshWindows,
    assemble_contact,
    mesh_windows,
    rotation_approach,
)
from femgear.contact.solve import solve_contact, tangent_stiffness
from femgear.contact.supports import RIGID, MovingMembers, Supports, moving_members
from femgear.errors import ContactError

if TYPE_CHECKING:
    from femgear.gears import PlanetarySet
    from femgear.gears.deviations import SetDeviations


@dataclass(frozen=True)
class MeshCycle:
    """Static solution over one mesh period or several; meshes in the order sun-planet 1..N, planet 1..N-ring.

    Parameters
    ----------
    position : (P,) array
        In mesh periods.
    deflection : (2N, P) array
        Static transmission error of every mesh along its line of action: the approach of the flanks
        by the motions of their gears, deviations included [m].
    sun_arc : (P,) array
        Rotation of the sun behind the unloaded, exact set, as an arc on its base circle [m].
    force : (2N, P) array
        Force on the drive flanks of the mesh, torque over base radius [N].
    back_force : (2N, P) array
        Force on its back flanks [N]; zero where they were not looked at.
    stiffness : (2N, P) array
        Tangent mesh stiffness dF/d delta at constant loads of the other meshes [N/m].
    tooth_load : (2N, T, P) array
        Load of each simultaneous tooth pair, in the order of the path coordinate [N].
    path : (2N, T, P) array
        Path coordinate of each tooth pair, from the pitch point in the direction of motion [m].
    tooth : (2, 2N, T) int array
        Tooth numbers of the pairs on gear 1 and gear 2 in the first mesh period, see `tooth_zero_angles`.
    max_pressure : (2N, P) array
        Largest pressure of the contacts that do not reach the end of a flank [Pa]: under a sharp edge the
        pressure has no limit, it grows with every halving of the cells.
    edge_contact : (2N, P) bool array
        Whether a contact of the mesh reaches a tip corner or the start of the involute.
    open_planets : (N, P) bool array
        Planets that carry nothing.
    residual : (P,) array
        Largest relative violation of the contact conditions and of equilibrium.
    iterations : (P,) int array
    member_motion : (m, P) array
        Displacement of the axes of floating or sprung members [m], named by `member_names`.
    member_names : tuple of str
        Such as ``"sun: x"``.
    periods : int
        Mesh periods in the record.
    contact : str
        ``"profile"`` or ``"line_of_action"``.
    unknowns : int
        Largest number of pressure cells at one position.
    message : str
    """

    position: np.ndarray
    deflection: np.ndarray
    sun_arc: np.ndarray
    force: np.ndarray
    back_force: np.ndarray
    stiffness: np.ndarray
    tooth_load: np.ndarray
    path: np.ndarray
    tooth: np.ndarray
    max_pressure: np.ndarray
    edge_contact: np.ndarray
    open_planets: np.ndarray
    residual: np.ndarray
    iterations: np.ndarray
    member_motion: np.ndarray
    member_names: tuple[str, ...]
    periods: int
    contact: str
    unknowns: int
    message: str

    @property
    def overall_deflection(self) -> np.ndarray:
        """Transmission error from sun to ring over every planet, shape (N, P) [m].

        With fixed centres the sum of the two mesh deflections; moving members add their part.
        """
        return np.broadcast_to(self.sun_arc, (len(self.deflection) // 2, len(self.sun_arc)))

    @property
    def secant_stiffness(self) -> np.ndarray:
        """Force over deflection, zero where a mesh carries nothing, shape (2N, P) [N/m]."""
        loaded = (self.force > 0) & (self.deflection > 0)
        return np.divide(self.force, self.deflection, out=np.zeros_like(self.force), where=loaded)

    @property
    def load_share(self) -> np.ndarray:
        """Share of every planet in the sun's torque, shape (N, P); zero without load."""
        n = len(self.force) // 2
        carried = self.force[:n] - self.back_force[:n]
        total = carried.sum(axis=0)
        return np.divide(carried, total, out=np.zeros((n, len(total))), where=total > 0)

    @property
    def wedged(self) -> np.ndarray:
        """Meshes that are loaded on both flanks at once, shape (2N, P)."""
        return (self.force > 0) & (self.back_force > 0)


def walk_mesh_cycle(
    planetary_set: PlanetarySet,
    bodies: Bodies,
    *,
    sun_torque: float,
    positions: int = 64,
    contact: str = "profile",
    cells: int = 36,
    deviations: SetDeviations | None = None,
    supports: Supports = RIGID,
    periods: int = 1,
    planet_gaps=None,
    both_flanks: bool = False,
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
    positions : int
        Number of equidistant positions in one mesh period.
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
        Look for contact on the back flanks as well.
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
    if not sun_torque > 0:
        return _unloaded(N, positions * periods, periods, contact)
    members = moving_members(planetary_set, supports, both_flanks=both_flanks)
    share = sun_torque / (planetary_set.sun.base_radius * N)
    enlarge, nearest = 1.0, 3.0 * share / (10e9 * planetary_set.sun.face_width)
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
        cycle, overflow, missed = _walk(
            planetary_set, bodies, setup, sun_torque, members, contact, periods, progress
        )
        if not overflow and missed <= nearest:
            return cycle
        enlarge *= 2.0 if overflow else 1.0
        nearest = max(nearest, 1.2 * missed)
    raise ContactError(
        "the contact windows do not contain the contact after seven enlargements",
        code="E-CONTACT-WINDOW",
        remedy="reduce operation.torque or the errors",
    )


def _unloaded(N: int, positions: int, periods: int, contact: str) -> MeshCycle:
    """The defined result without load: nothing touches, nothing is stiff."""
    zero = np.zeros((2 * N, positions))
    return MeshCycle(
        position=np.arange(positions) * periods / positions,
        deflection=zero,
        sun_arc=np.zeros(positions),
        force=zero,
        back_force=zero,
        stiffness=zero,
        tooth_load=np.zeros((2 * N, 1, positions)),
        path=np.zeros((2 * N, 1, positions)),
        tooth=np.zeros((2, 2 * N, 1), int),
        max_pressure=zero,
        edge_contact=np.zeros((2 * N, positions), bool),
        open_planets=np.ones((N, positions), bool),
        residual=np.zeros(positions),
        iterations=np.zeros(positions, int),
        member_motion=np.zeros((0, positions)),
        member_names=(),
        periods=periods,
        contact=contact,
        unknowns=0,
        message="no torque: no tooth carries load and the mesh stiffness is zero",
    )


def _walk(planetary_set, bodies, setup: MeshWindows, sun_torque, members, contact, periods, progress):
    """All positions with one set of windows; also whether a contact ran into the end of its window."""
    N, P = planetary_set.n_planets, setup.positions
    load = np.zeros(N + 1 + int(members.free.sum()))
    load[N] = sun_torque / planetary_set.sun.base_radius
    out = {name: np.zeros((2 * N, P)) for name in ("deflection", "force", "back_force", "stiffness")}
    meshes = setup.near.shape[0]
    out["max_pressure"], out["edge_contact"] = np.zeros((meshes, P)), np.zeros((meshes, P), bool)
    out["tooth_load"] = np.zeros((meshes, setup.pairs, P))
    out["member_motion"] = np.zeros((len(members.names), P))
    out["sun_arc"] = np.zeros(P)
    residual, iterations = np.zeros(P), np.zeros(P, int)
    previous, unknowns, overflow, missed = None, 0, False, 0.0
    for p in range(P):
        problem = assemble_contact(setup, bodies, p, members)
        start = None if previous is None else problem.warm_start(*previous)
        state = solve_contact(problem.compliance, problem.gap, problem.G, load, start=start)
        previous = (problem, state.active)
        _collect(problem, state, setup, members, out, p)
        residual[p], iterations[p] = state.residual, state.iterations
        unknowns = max(unknowns, len(problem.gap))
        overflow |= problem.touches_window_end(state.active, setup)
        missed = max(missed, _penetrated_outsider(setup, p, out["deflection"][:, p], contact))
        if progress is not None:
            progress(p + 1, P)
    open_planets = out["force"][:N] + out["back_force"][:N] <= 0.0
    wedged = (out["force"] > 0) & (out["back_force"] > 0)
    message = "all positions by the active set"
    message += "; some planets lose all load" if open_planets.any() else ""
    message += "; some teeth are wedged between both flanks" if wedged.any() else ""
    for name in ("tooth_load", "max_pressure", "edge_contact"):
        out[name] = out[name][: 2 * N]
    cycle = MeshCycle(
        position=np.arange(P) * periods / P,
        path=np.moveaxis(setup.zeta[: 2 * N], 2, 1),
        tooth=np.stack(setup.tooth)[:, : 2 * N],
        open_planets=open_planets,
        residual=residual,
        iterations=iterations,
        member_names=members.names,
        periods=periods,
        contact=contact,
        unknowns=unknowns,
        message=message,
        **out,
    )
    return cycle, overflow, missed


def _collect(problem: ContactProblem, state, setup: MeshWindows, members: MovingMembers, out, p):
    """Mesh quantities of one position."""
    N, meshes = problem.n_planets, setup.near.shape[0]
    loads = state.loads
    force = np.bincount(problem.mesh, weights=loads, minlength=meshes)
    out["force"][:, p] = force[: 2 * N]
    out["back_force"][: meshes - 2 * N, p] = force[2 * N :]
    out["sun_arc"][p] = state.motions[N]
    # sprung members yield under the mesh forces, free ones are unknowns of the problem
    motion = np.zeros(len(members.names))
    motion[members.free] = state.motions[N + 1 :]
    sprung = ~members.free
    motion[sprung] = -(members.approach[:, sprung].T @ force) / members.stiffness[sprung]
    out["member_motion"][:, p] = motion
    moved = members.approach[: 2 * N] @ motion
    out["deflection"][:, p] = rotation_approach(N) @ state.motions[: N + 1] + moved
    tangents = tangent_stiffness(problem.H, state.active, problem.mesh, meshes)
    out["stiffness"][:, p] = tangents.reshape(-1, 2 * N).sum(axis=0)
    np.add.at(out["tooth_load"][:, :, p], (problem.mesh, problem.pair), loads)
    at_edge = problem.at_flank_end(state.active, setup)
    np.logical_or.at(out["edge_contact"][:, p], problem.mesh, at_edge)
    pressure = np.where(at_edge, 0.0, loads / setup.cell_area[problem.mesh])
    np.maximum.at(out["max_pressure"][:, p], problem.mesh, pressure)


def _penetrated_outsider(setup: MeshWindows, p, deflection, contact) -> float:
    """Separation from the nearest pair within which no omitted pair penetrates [m]; zero if none does."""
    if contact == "line_of_action":
        return 0.0
    gap = setup.smallest_gap[:, p]
    # a back flank approaches when its drive flank parts
    deflection = np.concatenate([deflection, -deflection])[: len(gap)]
    penetrates = ~setup.near[:, p] & (gap < deflection[:, None])
    relative = deflection - gap.min(axis=1)
    return float(relative[penetrates.any(axis=1)].max(initial=0.0))
