"""One walk through the mesh cycle: all 2N meshes of a planetary set solved together at each position.

It gives loads, motions and stiffness of the meshes (`MeshCycle`). A negative torque loads the other flanks:
it is the mirror image of a set under a positive one (`walk_either_flank`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeVar

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
from femgear.contact.sides import mirrored_set
from femgear.contact.solve import mesh_tangent_matrix, tangent_stiffness
from femgear.contact.supports import RIGID, MovingMembers, Supports, moving_members
from femgear.errors import ContactError
from femgear.gears.deviations import mirrored_deviations

if TYPE_CHECKING:
    from femgear.gears.deviations import SetDeviations
    from femgear.gears.planetary import PlanetarySet

Found = TypeVar("Found")
ROUGH_STIFFNESS = 10e9
"""Stiffness of a mesh per face width, to size windows [N/m^2]."""
HELD = 2.56
"""A window is 3.2 half widths wide: it holds the contact of this many times the force that sized it."""
LARGEST_RESIDUAL = 1e-9
"""Of contact conditions and equilibrium; rounding leaves 1e-14."""


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
        Load of each simultaneous tooth pair, in the order of the path coordinate [N]; from one mesh period to
        the next a pair goes on to the next place, whatever the sign of the torque.
    path : (2N, T, P) array
        Path coordinate of each tooth pair, from the pitch point in the direction of motion [m].
    tooth : (2, 2N, T) int array
        Tooth numbers of the pairs on gear 1 and gear 2 in the first mesh period, see `tooth_zero_angles`.
    back_tooth_load : (2N, T, P) array
        Load of each tooth pair on the back flanks [N]; the T places are those of the back side's own pairs.
        This and the next two are zero where back flanks were not looked at.
    back_path : (2N, T, P) array
        Path coordinate of these pairs [m], on the line of action of the back flanks: it falls with the
        position, and grows towards the tip of gear 1 as that of the drive flanks does (with a negative
        torque, both towards its root).
    back_tooth : (2, 2N, T) int array
        Their tooth numbers, counted as those of `tooth`.
    bearing_force : (N, 2, P) array
        Force of the pin on each planet, x and y in the frame of the carrier [N].
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
        Displacement of the axes of floating or sprung members [m], named by `member_names`; that of a planet
        is measured from its pin. Inside the clearance of its bearing the place of a planet that carries
        nothing is not determined: the smallest motion without penetration stands for it.
    member_names : tuple of str
        Such as ``"sun: x"``.
    periods : int
        Mesh periods in the record.
    contact : str
        ``"profile"`` or ``"line_of_action"``.
    unknowns : int
        Largest number of pressure cells at one position.
    message : str
    pressure : (2N, T, C, P) array, optional
        Pressure in the cells of the drive flanks [Pa], where it was asked for.
    pressure_offset : (2N, C) array, optional
        Place of these cells along the common tangent [m], positive towards growing path coordinates, from
        the middle of their window.
    pressure_centre : (2N, T, P) array, optional
        Place of the middle of each window from the point on the path [m]: zero but for windows that end at
        the end of a flank or follow modified profiles. To be added to `pressure_offset`.
    held_stiffness : (2N, P) array, optional
        As `stiffness`, with the ring held at its outer surface [N/m].
    held_compliance : (2N, 2N, P) array, optional
        Tangent compliance between the meshes through their common bodies, the ring held, supports left out
        [m/N]; zero where a mesh carries nothing.
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
    back_tooth_load: np.ndarray
    back_path: np.ndarray
    back_tooth: np.ndarray
    bearing_force: np.ndarray
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
    pressure: np.ndarray | None = None
    pressure_offset: np.ndarray | None = None
    pressure_centre: np.ndarray | None = None
    held_stiffness: np.ndarray | None = None
    held_compliance: np.ndarray | None = None

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
        """Share of every planet in the sun's torque, shape (N, P); zero without torque."""
        n = len(self.force) // 2
        carried = self.force[:n] - self.back_force[:n]
        total = carried.sum(axis=0)
        # teeth may be wedged without torque: what is left of their forces is then rounding
        loaded = total > 1e-9 * (self.force[:n] + self.back_force[:n]).sum(axis=0)
        return np.divide(carried, total, out=np.zeros((n, len(total))), where=loaded)

    @property
    def wedged(self) -> np.ndarray:
        """Meshes that are loaded on both flanks at once, shape (2N, P)."""
        return (self.force > 0) & (self.back_force > 0)


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

    def attempt(share: float, nearest: float):
        setup = mesh_windows(
            planetary_set,
            bodies,
            share=share,
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
            return found, share, nearest
        wider = _enlarged(share, max(found["force"].max(), found["back_force"].max())) if overflow else share
        return found, wider, max(nearest, 1.2 * missed)

    cycle = replace(nothing, **in_windows(attempt, share, 3.0 * share / (ROUGH_STIFFNESS * width)))
    return cycle if cycle.force.any() else nothing


def in_windows(
    attempt: Callable[[float, float], tuple[Found, float, float]], share: float, nearest: float
) -> Found:
    """What is found in windows that contain the contact; they are enlarged until they do.

    Parameters
    ----------
    attempt : callable
        ``(share, nearest) -> found, share, nearest``: what is found in these windows, and the windows to
        try next; the same ones where they contain the contact.
    share, nearest : float
        Of the first windows, as `mesh_windows` takes them [N], [m].

    Raises
    ------
    ContactError
        E-CONTACT-WINDOW
    """
    for _ in range(8):
        found, *wider = attempt(share, nearest)
        if wider == [share, nearest]:
            return found
        share, nearest = wider
    raise ContactError(
        "the contact windows do not contain the contact after seven enlargements",
        code="E-CONTACT-WINDOW",
        remedy="reduce operation.torque or the errors",
    )


def walk_either_flank(
    planetary_set,
    bodies,
    *,
    sun_torque,
    positions=64,
    contact="profile",
    deviations=None,
    supports=RIGID,
    periods=1,
    planet_gaps=None,
    both_flanks=False,
    pressures=False,
    held_bodies=None,
    progress=None,
) -> MeshCycle:
    """`walk_mesh_cycle` for a torque of either sign; results keep the order of planets and positions.

    For a negative torque the right flanks of the sun carry. Position zero is then where the right flanks of
    "sun-planet 1" touch at the pitch point, and positions still run with the rotation of the sun. The
    mirror image turns the other way: its record ends at position zero, so that records which do not close
    hold the same configurations too.
    """
    options = {
        "contact": contact,
        "supports": supports,
        "periods": periods,
        "both_flanks": both_flanks,
        "pressures": pressures,
        "held_bodies": held_bodies,
        "progress": progress,
    }
    if sun_torque >= 0:
        return walk_mesh_cycle(
            planetary_set,
            bodies,
            sun_torque=sun_torque,
            positions=positions,
            deviations=deviations,
            planet_gaps=planet_gaps,
            **options,
        )
    mirrored, order = mirrored_set(planetary_set)
    turned = None if planet_gaps is None else np.asarray(planet_gaps, float)[order]
    if deviations is not None:
        deviations = mirrored_deviations(deviations, planetary_set, mirrored, order)
    cycle = walk_mesh_cycle(
        mirrored,
        bodies,
        sun_torque=-sun_torque,
        deviations=deviations,
        planet_gaps=turned,
        positions=-cycle_positions(positions, periods=periods)[::-1],
        **options,
    )
    return _seen_from_front(cycle, planetary_set, order)


def _seen_from_front(cycle: MeshCycle, planetary_set, order) -> MeshCycle:
    """Results of the mirror image in the order of planets and positions of the original."""
    planet = np.argsort(order)
    mesh, axis = np.concatenate([planet, planet + len(order)]), planetary_set.planet_angles[0]
    by_mesh = ("deflection", "force", "back_force", "stiffness", "max_pressure", "edge_contact")
    found = {name: getattr(cycle, name)[mesh][:, ::-1] for name in by_mesh}
    found |= {name: getattr(cycle, name)[::-1] for name in ("sun_arc", "residual", "iterations")}
    # the pair that comes first along the path leaves first when the rotation is seen from behind
    for side in ("", "back_"):
        found[f"{side}tooth_load"] = getattr(cycle, f"{side}tooth_load")[mesh][:, ::-1, ::-1]
        found[f"{side}path"] = -getattr(cycle, f"{side}path")[mesh][:, ::-1, ::-1]
        found[f"{side}tooth"] = -getattr(cycle, f"{side}tooth")[:, mesh][:, :, ::-1]
    if cycle.pressure is not None:
        found["pressure"] = cycle.pressure[mesh][:, ::-1, ::-1, ::-1]
        found["pressure_offset"] = -cycle.pressure_offset[mesh][:, ::-1]
        found["pressure_centre"] = -cycle.pressure_centre[mesh][:, ::-1, ::-1]
    if cycle.held_stiffness is not None:
        found["held_stiffness"] = cycle.held_stiffness[mesh][:, ::-1]
        found["held_compliance"] = cycle.held_compliance[mesh][:, mesh][:, :, ::-1]
    return replace(
        cycle,
        position=0.0 - cycle.position[::-1],
        open_planets=cycle.open_planets[planet][:, ::-1],
        bearing_force=_reflected(cycle.bearing_force, axis)[planet][:, :, ::-1],
        member_motion=_reflected_motion(cycle, axis, planet)[:, ::-1],
        **found,
    )


def _reflected(vectors: np.ndarray, axis: float) -> np.ndarray:
    """Vectors (m, 2, P) reflected in the line at the angle `axis`."""
    c, s = np.cos(2 * axis), np.sin(2 * axis)
    return np.einsum("ij,mjp->mip", np.array([[c, s], [s, -c]]), vectors)


def _reflected_motion(cycle: MeshCycle, axis: float, back) -> np.ndarray:
    """Motions of the members reflected in the line through the first planet, planets in their own order."""
    vectors = _reflected(cycle.member_motion.reshape(-1, 2, cycle.member_motion.shape[1]), axis)
    names = [name.split(":")[0] for name in cycle.member_names[::2]]
    planets = [i for i, name in enumerate(names) if name.startswith("planet")]
    if planets:
        vectors[planets] = vectors[planets][back]
    return vectors.reshape(cycle.member_motion.shape)


def cycle_without_load(
    n_planets: int,
    position: np.ndarray,
    *,
    periods: int,
    contact: str,
    cells: int,
    pressures: bool = False,
) -> MeshCycle:
    """The defined result without load: nothing touches, nothing is stiff, no pressure has a place."""
    N, positions = n_planets, len(position)
    zero, teeth = np.zeros((2 * N, positions)), np.zeros((2 * N, 1, positions))
    found = {}
    if pressures:
        found = {
            "pressure": np.zeros((2 * N, 1, cells, positions)),
            "pressure_offset": np.zeros((2 * N, cells)),
            "pressure_centre": teeth,
        }
    return MeshCycle(
        position=position,
        deflection=zero,
        sun_arc=np.zeros(positions),
        force=zero,
        back_force=zero,
        stiffness=zero,
        tooth_load=teeth,
        path=teeth,
        tooth=np.zeros((2, 2 * N, 1), int),
        back_tooth_load=teeth,
        back_path=teeth,
        back_tooth=np.zeros((2, 2 * N, 1), int),
        bearing_force=np.zeros((N, 2, positions)),
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
        **found,
    )


def _enlarged(share: float, force: float) -> float:
    """Load that sizes windows twice as wide, and twice again until they hold the largest force."""
    share *= 4.0
    while share < force / HELD:
        share *= 4.0
    return share


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
