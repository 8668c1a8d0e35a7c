"""Planet bearings with clearance: rings of one-sided springs in the contact problem.

A planet that moves by ``u`` against its pin closes the radial clearance ``g`` in the direction ``e`` where
``e u = g``. With n springs around the pin, ``w = g + p / k_s - e u >= 0, p >= 0, p w = 0`` is the condition
of any other contact: gap ``g``, compliance ``1 / k_s`` on the diagonal, arms ``e`` on the two free motions
of the planet. ``k_s = 4 k / n`` gives a ring without clearance the stiffness ``k``, because half its springs
carry and ``sum e e^T = n/4``. Many springs tend to a Winkler foundation around the pin, see `bearing_law`.
Planetary sets with clearance in their bearings: Guo, Keller and Parker, "Dynamic analysis of wind turbine
planetary gears using an extended harmonic balance approach", NREL/CP-5000-55355, 2012.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from femgear.contact.solve import ContactState, solve_contact

if TYPE_CHECKING:
    from femgear.contact.assembly import ContactProblem
    from femgear.contact.supports import MovingMembers, Supports
    from femgear.gears.planetary import PlanetarySet


@dataclass(frozen=True)
class BearingSprings:
    """One-sided springs of all planet bearings.

    Parameters
    ----------
    clearance : float
        Radial [m].
    compliance : float
        Of one spring [m/N].
    count : int
        Springs around one pin, n.
    arms : (N n, m) array
        Approach of planet and pin at every spring per unit free motion, in the order of
        `MovingMembers.names` without sprung motions.
    """

    clearance: float
    compliance: float
    count: int
    arms: np.ndarray


def bearing_springs(
    planetary_set: PlanetarySet, supports: Supports, members: MovingMembers
) -> BearingSprings | None:
    """The springs of all planets, or None for bearings without clearance.

    The first spring of a planet points away from the centre of the set, so that turned and mirrored sets
    have turned and mirrored springs.
    """
    if not supports.planet_clearance:
        return None
    N, n = planetary_set.n_planets, supports.planet_springs
    names = [name for name, free in zip(members.names, members.free, strict=True) if free]
    angle = np.asarray(planetary_set.planet_angles)[:, None] + 2 * np.pi * np.arange(n) / n
    arms = np.zeros((N, n, len(names)))
    for planet in range(N):
        column = names.index(f"planet {planet + 1}: x")
        arms[planet, :, column], arms[planet, :, column + 1] = np.cos(angle[planet]), np.sin(angle[planet])
    compliance = n / (4.0 * supports.planet)
    return BearingSprings(supports.planet_clearance, compliance, n, arms.reshape(N * n, -1))


def solve_position(
    problem: ContactProblem, springs: BearingSprings | None, load, *, start=None
) -> tuple[ContactState, np.ndarray]:
    """Solution of all meshes and bearings at one position.

    Parameters
    ----------
    problem : ContactProblem
        Of the meshes.
    springs : BearingSprings, optional
        Of the bearings; their motions are the last columns of ``problem.G``.
    load : (m,) array
        External load on the motions [N].
    start : bool array, optional
        Candidates thought to touch: cells, then springs.

    Returns
    -------
    state : ContactState
        Of the pressure cells alone, with all motions.
    active : bool array
        Cells and springs that carry load, the ``start`` of the next position.

    Raises
    ------
    ContactError
        As `solve_contact`.
    """
    if springs is None:
        state = solve_contact(problem.compliance, problem.gap, problem.G, load, start=start)
        return state, state.active
    cells = len(problem.gap)
    near = np.ones(len(springs.arms), bool) if start is None else _beside(start[cells:], springs.count)
    while True:
        H, gap, G = _with_springs(problem, springs, near)
        guess = None if start is None else np.concatenate([start[:cells], start[cells:][near]])
        state = solve_contact(H, gap, G, load, start=guess)
        moved = springs.arms @ state.motions[-springs.arms.shape[1] :]
        # those left out must be open; where one is not, all are asked
        if near.all() or (moved[~near] <= springs.clearance).all():
            break
        near = np.ones(len(near), bool)
    active = np.concatenate([state.active[:cells], np.zeros(len(near), bool)])
    active[cells:][near] = state.active[cells:]
    meshes = {name: getattr(state, name)[:cells] for name in ("loads", "gaps", "active")}
    return replace(state, **meshes), active


def pin_forces(planetary_set: PlanetarySet, force, back_force) -> np.ndarray:
    """Force of every pin on its planet [N], shape (N, 2, P), in the frame of the carrier.

    What balances the mesh forces on the planet, whatever holds it: ``-(n_sp F_sp - n_pr F_pr)`` with the
    normals of `femgear.gears.kinematics.mesh_normals` on either side of the teeth.

    Parameters
    ----------
    planetary_set : PlanetarySet
    force, back_force : (2N, P) arrays
        On drive and back flanks [N].
    """
    from femgear.gears.kinematics import mesh_normals

    N = planetary_set.n_planets
    result = np.zeros((N, 2, np.shape(force)[1]))
    for back, carried in ((False, force), (True, back_force)):
        along = mesh_normals(planetary_set, back=back)[:, :, None] * np.asarray(carried)[:, None, :]
        result += along[N:] - along[:N]
    return result


def bearing_law(displacement, stiffness: float, clearance: float):
    """Force of a bearing that is elastic all round, ``(2 k/pi) [r (p + sin p cos p) - 2 g sin p]``.

    Parameters
    ----------
    displacement : array
        Of the planet against its pin, r [m].
    stiffness : float
        Without clearance, k [N/m].
    clearance : float
        Radial, g [m].

    Returns
    -------
    array
        [N]; zero within the clearance. The bearing carries over the arc from -p to p, ``cos p = g/r``; its
        foundation of stiffness ``2 k/pi`` per angle is pressed by ``r cos t - g`` (Winkler; Johnson,
        "Contact Mechanics", 1985, section 4.3), and ``F = (2 k/pi) integral (r cos t - g) cos t dt``.
    """
    r = np.maximum(np.asarray(displacement, float), clearance)
    half_arc = np.arccos(np.divide(clearance, r, out=np.zeros_like(r), where=r > 0))
    carried = r * (half_arc + np.sin(half_arc) * np.cos(half_arc)) - 2 * clearance * np.sin(half_arc)
    return 2 * stiffness / np.pi * carried


def _beside(active: np.ndarray, count: int) -> np.ndarray:
    """Springs that carried and three on either side of them, around every pin of `count` springs."""
    around = active.reshape(-1, count)
    return np.logical_or.reduce([np.roll(around, k, axis=1) for k in range(-3, 4)]).ravel()


def _with_springs(problem: ContactProblem, springs: BearingSprings, near: np.ndarray):
    """Compliance, gaps and arms of the cells and then of the springs `near`."""
    cells, arms = len(problem.gap), springs.arms[near]
    H = np.zeros((cells + len(arms), cells + len(arms)))
    H[:cells, :cells] = problem.compliance
    H[range(cells, len(H)), range(cells, len(H))] = springs.compliance
    others = np.zeros((len(arms), problem.G.shape[1] - arms.shape[1]))
    G = np.vstack([problem.G, np.hstack([others, arms])])
    return H, np.concatenate([problem.gap, np.full(len(arms), springs.clearance)]), G
