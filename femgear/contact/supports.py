"""Members that move: springs, free motions and bearing clearances of sun, carrier, planets and ring.

A motion ``u`` of a member's axis changes the approach of the flanks at mesh ``j`` by ``B_j u``. A support of
stiffness ``k`` carries ``B^T F = -k u`` (F the mesh forces), so its elasticity is the mesh compliance
``B k^-1 B^T``, one more term of H; a free motion is one more column of G with the equilibrium ``B^T F = 0``.

A planet bearing with radial clearance ``g`` is a ring of one-sided springs. A planet that moves by ``u``
against its pin closes the clearance in the direction ``e`` where ``e u = g``. With n springs around the pin,
``w = g + p / k_s - e u >= 0, p >= 0, p w = 0`` is the condition of any other contact: gap ``g``, compliance
``1 / k_s`` on the diagonal, arms ``e`` on the two free motions of the planet. ``k_s = 4 k / n`` gives a ring
without clearance the stiffness ``k``, because half its springs carry and ``sum e e^T = n/4``. Many springs
tend to a Winkler foundation around the pin.
Planetary sets with clearance in their bearings: Guo, Keller and Parker, "Dynamic analysis of wind turbine
planetary gears using an extended harmonic balance approach", NREL/CP-5000-55355, 2012.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femgear.errors import ContactError
from femgear.gears.kinematics import (
    across,
    member_approach,
    member_sliding,
    mesh_normals,
    sliding_directions,
    unheld_members,
    unit_vectors,
)
from femgear.gears.pair import BRANCH, GearSet

SPRINGS = 120
"""One-sided springs of a planet bearing with clearance: even, so that they are their own mirror image.

The force then differs by less than 0.1 % from that of the continuous bearing where the planet moves by 1.1
clearances or more, 0.4 % at 1.05 clearances. Under lighter loads the pin rests in a corner of the polygon:
its place is never off by more than ``(pi/n)^2/2`` clearances, 0.04 % of them.
"""


@dataclass(frozen=True)
class Supports:
    """Radial stiffness of the supports [N/m]: None is rigid, 0 floats.

    Parameters
    ----------
    sun, carrier, ring : float, optional
        Between the member and the ground.
    planet : float, optional
        Bearing between each planet and its pin on the carrier; a planet cannot float.
    planet_clearance : float
        Radial clearance of these bearings [m], not of rigid ones; see `bearing_springs`.
    """

    sun: float | None = None
    carrier: float | None = None
    planet: float | None = None
    ring: float | None = None
    planet_clearance: float = 0.0


RIGID = Supports()


@dataclass(frozen=True)
class MovingMembers:
    """Supports as the contact problem takes them.

    Parameters
    ----------
    names : tuple of str
        One a motion, such as ``"sun: x"``.
    approach : (2N, m) or, with back flanks, (4N, m) array
        Approach of the flanks of every mesh per unit motion [1].
    stiffness : (m,) array
        [N/m], 0 for free motions.
    sliding : (2N, m) array
        Sliding of flank 1 on flank 2 of every mesh per unit motion [1], see
        `femgear.gears.kinematics.member_sliding`.
    """

    names: tuple[str, ...]
    approach: np.ndarray
    stiffness: np.ndarray
    sliding: np.ndarray

    @property
    def free(self) -> np.ndarray:
        """Motions without a spring, boolean (m,)."""
        return self.stiffness == 0.0

    @property
    def compliance(self) -> np.ndarray:
        """Compliance of all sprung motions between the meshes, (2N, 2N) [m/N]."""
        sprung = self.approach[:, ~self.free]
        return (sprung / self.stiffness[~self.free]) @ sprung.T


@dataclass(frozen=True)
class BearingSprings:
    """One-sided springs of all planet bearings.

    Parameters
    ----------
    clearance, compliance : float
        Radial clearance [m], and compliance of one spring [m/N].
    arms : (N n, m) array
        Approach of planet and pin at each of the n springs around every pin per unit free motion, in the
        order of `MovingMembers.names` without sprung motions.
    """

    clearance: float
    compliance: float
    arms: np.ndarray

    def joined(self, H, gap, G) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Compliance (k, k), gaps (k,) and arms (k, m) of pressure cells and all springs, see `solve_contact`."""
        cells, count = len(gap), len(self.arms)
        whole = np.zeros((cells + count, cells + count))
        whole[:cells, :cells] = H
        whole[range(cells, len(whole)), range(cells, len(whole))] = self.compliance
        arms = np.pad(self.arms, ((0, 0), (G.shape[1] - self.arms.shape[1], 0)))
        return whole, np.append(gap, np.full(count, self.clearance)), np.vstack([G, arms])


@dataclass(frozen=True)
class WidthSupports:
    """What holds members against tilting and twisting over the face width: None is rigid, 0 free.

    Parameters
    ----------
    sun, carrier, planet : float, optional
        Tilt stiffness between sun or carrier and the ground, and of every planet on its pin [N m/rad].
    wind_up : float, optional
        Torsional stiffness between the walls of the carrier at the ends of the width [N m/rad].
    wind_up_end : int
        End at which the torque leaves the carrier, -1 at z < 0, 1 at z > 0.
    sun_rigidity : float, optional
        Torsional rigidity G J of the sun [N m^2].
    sun_end : int
        End at which the torque enters the sun.
    """

    sun: float | None = None
    carrier: float | None = None
    planet: float | None = None
    wind_up: float | None = None
    wind_up_end: int = 1
    sun_rigidity: float | None = None
    sun_end: int = -1


UPRIGHT = WidthSupports()


@dataclass(frozen=True)
class TiltingMembers:
    """Motions that differ from slice to slice, as the contact in S slices takes them.

    Parameters
    ----------
    names : tuple of str
        One a motion, such as ``"sun: x"``, the direction in which the end z > 0 moves.
    approach : (2N, S, k) array
        Approach of the flanks per unit motion, the displacement of an end of the width [m].
    stiffness : (k,) array
        [N/m], 0 for free motions.
    angle : (k,) array
        Slope, or angle of wind-up, per unit motion [rad/m].
    coupling : (2N, S, 2N, S) array
        Compliance between forces over the whole width in the slices of all meshes [m/N].
    """

    names: tuple[str, ...]
    approach: np.ndarray
    stiffness: np.ndarray
    angle: np.ndarray
    coupling: np.ndarray


def tilting_members(planetary_set: GearSet, supports: WidthSupports, slices: int) -> TiltingMembers | None:
    """List tilts and twists that the supports allow, with their effect on every slice; None without any.

    A member that tilts displaces its section at z like a motion by slope times z; across the flanks of spur
    teeth nothing else does. Of the pin forces the wall of the carrier at which no torque leaves takes the
    shares ``zeta`` in 0 .. 1, their distance from the other wall over the width, and turns against that by
    ``psi = r_c sum(zeta F_t)/k``; the pins slope by ``r_c psi / b``, so that planets move by ``r_c psi
    zeta``. The sun turns at the distance ``x`` from the end of its torque, under forces at ``x'``, by
    ``r_b F min(x, x')/(G J)`` (St Venant), here as means over slices.

    ContactError: E-MECHANISM: free tilts that move no flank.
    """
    if supports == UPRIGHT:
        return None
    s, width = planetary_set, planetary_set.mesh_widths[0]
    along = 2.0 * (np.arange(slices) + 0.5) / slices - 1.0
    tilts = _one_side(s, Supports(supports.sun, supports.carrier, supports.planet), False)
    free = tilts.approach[:, tilts.free]
    if np.linalg.matrix_rank(free, tol=1e-9) < free.shape[1]:
        loose = [name.split(":")[0].split()[0] for name in np.array(tilts.names)[tilts.free]]
        raise ContactError(
            f"nothing holds a common tilt of {' and '.join(dict.fromkeys(loose))}",
            code="E-MECHANISM",
            key=f"{loose[0]}.tilt_stiffness",
            value="0 N m/rad",
            limit="above 0 N m/rad",
            remedy="give it a tilt stiffness, or leave the entry out for a rigid one",
        )
    names, stiffness = list(tilts.names), tilts.stiffness / (0.5 * width) ** 2
    approach, angle = tilts.approach[:, None] * along[:, None], np.full(len(names), 2.0 / width)
    if supports.wind_up is not None:
        tangent, radius = across(unit_vectors(s.mesh_angles)), s.centre_distance
        share = 0.5 * (1.0 - supports.wind_up_end * along)
        moved = (member_approach(s)["carrier"] * tangent).sum(axis=1)[:, None] * share
        approach = np.concatenate([approach, moved[..., None]], axis=-1)
        stiffness, angle = np.append(stiffness, supports.wind_up / radius**2), np.append(angle, 1.0 / radius)
        names.append("carrier: wind-up")
    coupling, driven = np.zeros((len(s.meshes), slices) * 2), s.kind_rows[0]
    if supports.sun_rigidity is not None:
        reach = 0.5 * width * (1.0 - supports.sun_end * along)
        shorter = np.minimum.outer(reach, reach) - np.eye(slices) * width / (6 * slices)
        coupling[driven, :, driven] = s.gears[0].base_radius ** 2 / (supports.sun_rigidity * slices) * shorter[:, None]
    if not names and not coupling.any():
        return None
    return TiltingMembers(tuple(names), approach, stiffness, angle, coupling)


def moving_members(planetary_set: GearSet, supports: Supports, *, both_flanks: bool = False) -> MovingMembers:
    """List the motions that the supports allow, each with its effect on the approach of every mesh.

    ContactError: E-MECHANISM: members float that the planets cannot hold.
    """
    if supports == RIGID:
        count, sides = len(planetary_set.mesh_names), 1 + both_flanks
        return MovingMembers((), np.zeros((sides * count, 0)), np.zeros(0), np.zeros((count, 0)))
    floating = [name for name in planetary_set.members if getattr(supports, name) == 0.0]
    loose = unheld_members(planetary_set, floating, both_flanks=both_flanks)
    if loose:
        planets = planetary_set.n_planets
        raise ContactError(
            f"{planets} planet{'s' * (planets > 1)} cannot hold a floating {' and '.join(loose)}",
            code="E-MECHANISM",
            value="0 N/m",
            limit="above 0 N/m where the forces of the planets do not balance in every direction",
            remedy=f"give Supports.{loose[-1]} a stiffness [N/m], or None for a rigid support",
        )
    sides = [_one_side(planetary_set, supports, back) for back in (False, True)[: 1 + both_flanks]]
    return replace(sides[0], approach=np.vstack([side.approach for side in sides]))


def bearing_springs(planetary_set: GearSet, supports: Supports, members: MovingMembers) -> BearingSprings | None:
    """Springs of all planet bearings, or None for bearings without clearance.

    The first spring of a planet points away from the centre of the set, so that turned and mirrored sets
    have turned and mirrored springs.
    """
    if supports.planet is None or not supports.planet_clearance:
        return None
    N, n = planetary_set.n_planets, SPRINGS
    names = [name for name, free in zip(members.names, members.free, strict=True) if free]
    angle = np.asarray(planetary_set.planet_angles)[:, None] + 2 * np.pi * np.arange(n) / n
    arms = np.zeros((N, n, len(names)))
    for planet in range(N):
        column = names.index(f"planet {planet + 1}: x")
        arms[planet, :, column : column + 2] = unit_vectors(angle[planet])
    compliance = n / (4.0 * supports.planet)
    return BearingSprings(supports.planet_clearance, compliance, arms.reshape(N * n, -1))


def pin_forces(planetary_set: GearSet, force, back_force, friction_force=None) -> np.ndarray:
    """Compute the force of every pin on its planet [N], shape (N, 2, P), in the frame of the carrier.

    What balances the mesh forces on the planet, whatever holds it: ``-(n_sp F_sp - n_pr F_pr)`` with the
    normals of `femgear.gears.kinematics.mesh_normals` on either side of the teeth. Of a pair it is the force
    of its bearing on gear 2.

    ``force`` and ``back_force`` (meshes, P) [N] are those on drive and back flanks, ``friction_force`` that along
    `femgear.gears.kinematics.sliding_directions`, none where left out.
    """
    s = planetary_set
    result = np.zeros((s.n_planets, 2, np.shape(force)[1]))
    acting = [(mesh_normals(s), force), (mesh_normals(s, back=True), back_force)]
    if friction_force is not None:
        acting.append((sliding_directions(s), friction_force))
    for directions, carried in acting:
        along, pins = directions[:, :, None] * np.asarray(carried)[:, None, :], np.zeros(result.shape)
        for mesh, on_gears in zip(s.meshes, along, strict=True):
            for body, push in zip(mesh.bodies, (1.0, -1.0), strict=True):
                if s.bodies[body].gear == BRANCH:
                    pins[s.bodies[body].copy] += push * on_gears
        result += pins
    return result


def _one_side(planetary_set: GearSet, supports: Supports, back: bool) -> MovingMembers:
    """Motions and their approach (2N, m) on one side of the teeth."""
    s, motions, slides = planetary_set, member_approach(planetary_set, back=back), member_sliding(planetary_set)
    moved = [(name, getattr(supports, name), (effect, slides[name])) for name, effect in motions.items()]
    # with clearance the springs of the bearing are candidates of the contact problem instead
    bearing = 0.0 if supports.planet_clearance else supports.planet
    branch, pins = np.array([mesh.copy for mesh in s.meshes])[:, None], (motions["carrier"], slides["carrier"])
    moved += [
        (f"planet {n + 1}", bearing, tuple(np.where(branch == n, effect, 0.0) for effect in pins))
        for n in range(s.n_planets)
    ]
    yielding = [(name, value, effects) for name, value, effects in moved if value is not None]
    approach, sliding = (
        np.hstack([np.zeros((len(s.meshes), 0)), *(effects[kind] for _, _, effects in yielding)]) for kind in (0, 1)
    )
    return MovingMembers(
        names=tuple(f"{name}: {axis}" for name, _, _ in yielding for axis in "xy"),
        approach=approach,
        stiffness=np.array([value for _, value, _ in yielding for _ in "xy"], float),
        sliding=sliding,
    )
