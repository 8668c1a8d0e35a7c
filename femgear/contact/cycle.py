"""One walk through the mesh cycle: all 2N meshes of a planetary set solved together at each position."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femgear.contact.assembly import Bodies, ContactProblem, MeshWindows, assemble_contact, mesh_windows
from femgear.contact.solve import solve_contact, tangent_stiffness
from femgear.errors import ContactError

if TYPE_CHECKING:
    from femgear.gears.planetary import PlanetarySet


@dataclass(frozen=True)
class MeshCycle:
    """Static solution over one mesh period; meshes in the order sun-planet 1..N, planet 1..N-ring.

    Parameters
    ----------
    position : (P,) array
        Fraction of one mesh period.
    deflection : (2N, P) array
        Static transmission error of every mesh along its line of action [m].
    force : (2N, P) array
        Mesh force, torque over base radius [N].
    stiffness : (2N, P) array
        Tangent mesh stiffness dF/d delta at constant loads of the other meshes [N/m].
    tooth_load : (2N, T, P) array
        Load of each simultaneous tooth pair, in the order of the path coordinate [N].
    path : (2N, T, P) array
        Path coordinate of each tooth pair, from the pitch point in the direction of motion [m].
    tooth : (2, 2N, T) int array
        Tooth numbers of the pairs on gear 1 and gear 2, see `tooth_zero_angles`.
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
    contact : str
        ``"profile"`` or ``"line_of_action"``.
    unknowns : int
        Largest number of pressure cells at one position.
    message : str
    """

    position: np.ndarray
    deflection: np.ndarray
    force: np.ndarray
    stiffness: np.ndarray
    tooth_load: np.ndarray
    path: np.ndarray
    tooth: np.ndarray
    max_pressure: np.ndarray
    edge_contact: np.ndarray
    open_planets: np.ndarray
    residual: np.ndarray
    iterations: np.ndarray
    contact: str
    unknowns: int
    message: str

    @property
    def overall_deflection(self) -> np.ndarray:
        """Sum of the two mesh deflections of every planet, shape (N, P) [m]."""
        n = len(self.deflection) // 2
        return self.deflection[:n] + self.deflection[n:]

    @property
    def secant_stiffness(self) -> np.ndarray:
        """Force over deflection, zero where a mesh carries nothing, shape (2N, P) [N/m]."""
        loaded = (self.force > 0) & (self.deflection > 0)
        return np.divide(self.force, self.deflection, out=np.zeros_like(self.force), where=loaded)

    @property
    def load_share(self) -> np.ndarray:
        """Share of every planet in the sun's torque, shape (N, P); zero without load."""
        n = len(self.force) // 2
        total = self.force[:n].sum(axis=0)
        return np.divide(self.force[:n], total, out=np.zeros((n, len(total))), where=total > 0)


def walk_mesh_cycle(
    planetary_set: PlanetarySet,
    bodies: Bodies,
    *,
    sun_torque: float,
    positions: int = 64,
    contact: str = "profile",
    cells: int = 36,
    planet_gaps=None,
    progress: Callable[[int, int], None] | None = None,
) -> MeshCycle:
    """Static transmission error, load sharing and mesh stiffness over one mesh period.

    Sun and planets are held at their bores, the ring at its outer surface, all centres fixed. At every
    position one complementarity problem holds for the pressures of all meshes: no penetration, no
    tension, equilibrium of every planet, and the sun's torque.

    Parameters
    ----------
    planetary_set : PlanetarySet
    bodies : Bodies
        Flank compliances and material.
    sun_torque : float
        Torque on the sun [N m], not negative (mirror the set for the other flanks).
    positions : int
        Number of equidistant positions in the period.
    contact : {"profile", "line_of_action"}
        Candidates on the whole profiles, or only on the theoretical path of contact.
    cells : int
        Pressure cells in a contact window.
    planet_gaps : (N,) array, optional
        Extra separation of the sun-side flanks of each planet [m].
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
    gaps = np.zeros(N) if planet_gaps is None else np.asarray(planet_gaps, float)
    if not sun_torque > 0:
        return _unloaded(N, positions, contact)
    share = sun_torque / (planetary_set.sun.base_radius * N)
    enlarge, nearest = 1.0, 3.0 * share / (10e9 * planetary_set.sun.face_width) + gaps.max()
    for _ in range(5):
        setup = mesh_windows(
            planetary_set,
            bodies,
            share=share * enlarge**2,
            positions=positions,
            cells=cells,
            nearest=nearest,
            contact=contact,
        )
        cycle, overflow, missed = _walk(planetary_set, bodies, setup, sun_torque, gaps, contact, progress)
        if not overflow and missed <= nearest:
            return cycle
        enlarge *= 1.5 if overflow else 1.0
        nearest = max(nearest, 1.2 * missed)
    raise ContactError(
        "the contact windows do not contain the contact after four enlargements",
        code="E-CONTACT-WINDOW",
        remedy="reduce operation.torque or the planet errors",
    )


def _unloaded(N: int, positions: int, contact: str) -> MeshCycle:
    """The defined result without load: nothing touches, nothing is stiff."""
    zero = np.zeros((2 * N, positions))
    return MeshCycle(
        position=np.arange(positions) / positions,
        deflection=zero,
        force=zero,
        stiffness=zero,
        tooth_load=np.zeros((2 * N, 1, positions)),
        path=np.zeros((2 * N, 1, positions)),
        tooth=np.zeros((2, 2 * N, 1), int),
        max_pressure=zero,
        edge_contact=np.zeros((2 * N, positions), bool),
        open_planets=np.ones((N, positions), bool),
        residual=np.zeros(positions),
        iterations=np.zeros(positions, int),
        contact=contact,
        unknowns=0,
        message="no torque: no tooth carries load and the mesh stiffness is zero",
    )


def _walk(planetary_set, bodies, setup: MeshWindows, sun_torque, gaps, contact, progress):
    """All positions with one set of windows; also whether a contact ran into the end of its window."""
    N, P = planetary_set.n_planets, setup.positions
    load = np.append(np.zeros(N), sun_torque / planetary_set.sun.base_radius)
    out = {name: np.zeros((2 * N, P)) for name in ("deflection", "force", "stiffness", "max_pressure")}
    out["edge_contact"] = np.zeros((2 * N, P), bool)
    tooth_load = np.zeros((2 * N, setup.pairs, P))
    open_planets = np.zeros((N, P), bool)
    residual, iterations = np.zeros(P), np.zeros(P, int)
    previous, unknowns, overflow, missed = None, 0, False, 0.0
    for p in range(P):
        problem = assemble_contact(setup, bodies, p, gaps)
        start = None if previous is None else problem.warm_start(*previous)
        state = solve_contact(problem.H, problem.gap, problem.G, load, start=start)
        previous = (problem, state.active)
        _collect(problem, state, setup, out, tooth_load, p)
        open_planets[:, p] = out["force"][:N, p] <= 0.0
        residual[p], iterations[p] = state.residual, state.iterations
        unknowns = max(unknowns, len(problem.gap))
        overflow |= problem.touches_window_end(state.active, setup)
        missed = max(missed, _penetrated_outsider(setup, p, out["deflection"][:, p], gaps, contact))
        if progress is not None:
            progress(p + 1, P)
    method = "all positions by the active set"
    cycle = MeshCycle(
        position=np.arange(P) / P,
        tooth_load=tooth_load,
        path=np.moveaxis(setup.zeta, 2, 1),
        tooth=np.stack(setup.tooth),
        open_planets=open_planets,
        residual=residual,
        iterations=iterations,
        contact=contact,
        unknowns=unknowns,
        message=method if not open_planets.any() else f"{method}; some planets lose all load",
        **out,
    )
    return cycle, overflow, missed


def _collect(problem: ContactProblem, state, setup: MeshWindows, out, tooth_load, p):
    """Mesh quantities of one position."""
    n_meshes = 2 * problem.n_planets
    loads = state.loads
    out["force"][:, p] = np.bincount(problem.mesh, weights=loads, minlength=n_meshes)
    sun, planets = state.motions[-1], state.motions[:-1]
    out["deflection"][:, p] = np.concatenate([sun - planets, planets])
    out["stiffness"][:, p] = tangent_stiffness(problem.H, state.active, problem.mesh, n_meshes)
    np.add.at(tooth_load[:, :, p], (problem.mesh, problem.pair), loads)
    at_edge = problem.at_flank_end(state.active, setup)
    np.logical_or.at(out["edge_contact"][:, p], problem.mesh, at_edge)
    pressure = np.where(at_edge, 0.0, loads / setup.cell_area[problem.mesh])
    np.maximum.at(out["max_pressure"][:, p], problem.mesh, pressure)


def _penetrated_outsider(setup: MeshWindows, p, deflection, gaps, contact) -> float:
    """Largest separation needed so that no pair left out of the candidates would penetrate [m]."""
    if contact == "line_of_action":
        return 0.0
    shift = np.append(gaps, np.zeros_like(gaps))
    outside = np.where(setup.near[:, p], np.inf, setup.smallest_gap[:, p] + shift[:, None])
    penetrates = outside < deflection[:, None]
    return float(deflection.max()) if penetrates.any() else 0.0
