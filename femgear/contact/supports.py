"""Members that move: springs and free motions of sun, carrier, planets and ring in the static problem.

A motion ``u`` of a member's axis changes the approach of the flanks at mesh ``j`` by ``B_j u``. A support of
stiffness ``k`` carries ``B^T F = -k u`` (F the mesh forces), so its elasticity is the mesh compliance
``B k^-1 B^T``, one more term of H; a free motion is one more column of G with the equilibrium ``B^T F = 0``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femgear.errors import ContactError

if TYPE_CHECKING:
    from femgear.gears.planetary import PlanetarySet


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
        Radial clearance of these bearings [m]; see `femgear.contact.bearings`.
    planet_springs : int
        Springs that then stand for a bearing. With 120 the force differs by less than 0.1 % from that of
        the continuous bearing where the planet moves by 1.1 clearances or more, 0.4 % at 1.05 clearances.
        Under lighter loads the pin rests in a corner of the polygon: its place is never off by more than
        ``(pi/n)^2/2`` clearances, 0.04 % of them.
    """

    sun: float | None = None
    carrier: float | None = None
    planet: float | None = None
    ring: float | None = None
    planet_clearance: float = 0.0
    planet_springs: int = 120

    def __post_init__(self):
        for name in ("sun", "carrier", "planet", "ring"):
            value = getattr(self, name)
            if value is not None and not (value >= 0 and np.isfinite(value)):
                raise ContactError(
                    f"the support of the {name} has a stiffness of {value} N/m",
                    code="E-SUPPORT",
                    limit="None (rigid), 0 N/m (floating) or above",
                )
        if self.planet == 0.0:
            raise ContactError("a planet without bearing has no place", code="E-SUPPORT", limit="above 0 N/m")
        self._check_clearance()

    def _check_clearance(self):
        clearance, springs = self.planet_clearance, self.planet_springs
        if not (clearance >= 0 and np.isfinite(clearance)):
            raise ContactError(
                f"the planet bearings have a radial clearance of {clearance} m",
                code="E-SUPPORT",
                value=clearance,
                limit="0 m or above",
            )
        if clearance and self.planet is None:
            raise ContactError(
                f"rigid planet bearings with a clearance of {clearance} m",
                code="E-SUPPORT",
                value=clearance,
                limit="a stiffness of the planet bearings above 0 N/m where they have clearance",
                remedy="give Supports.planet, or no clearance",
            )
        # even numbers are their own mirror image; four springs are the fewest with one stiffness all round
        if springs < 4 or springs % 2:
            raise ContactError(
                f"{springs} springs in a planet bearing",
                code="E-SUPPORT",
                value=springs,
                limit="an even number, 4 or more",
            )


RIGID = Supports()


@dataclass(frozen=True)
class MovingMembers:
    """Supports as the contact problem takes them.

    Parameters
    ----------
    names : tuple of str
        One a motion, such as ``"sun: x"``.
    approach : (2N, m) or, with back flanks, (4N, m) array
        Approach of the flanks of every mesh per unit motion.
    stiffness : (m,) array
        [N/m], 0 for free motions.
    """

    names: tuple[str, ...]
    approach: np.ndarray
    stiffness: np.ndarray

    @property
    def free(self) -> np.ndarray:
        """Motions without a spring, boolean (m,)."""
        return self.stiffness == 0.0

    @property
    def compliance(self) -> np.ndarray:
        """Compliance of all sprung motions between the meshes, (2N, 2N) [m/N]."""
        sprung = self.approach[:, ~self.free]
        return (sprung / self.stiffness[~self.free]) @ sprung.T


def force_directions(planetary_set: PlanetarySet, *, back: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Unit forces on the planets (from the sun) and on the ring (from the planets), each of shape (N, 2).

    For the flanks that a positive torque on the sun loads, or the back flanks, in the frame of the carrier.
    """
    from femgear.gears.kinematics import mesh_normals

    normals = mesh_normals(planetary_set, back=back)
    return normals[: planetary_set.n_planets], normals[planetary_set.n_planets :]


def moving_members(
    planetary_set: PlanetarySet, supports: Supports, *, both_flanks: bool = False
) -> MovingMembers:
    """The motions that the supports allow, each with its effect on every mesh.

    Raises
    ------
    ContactError
        E-MECHANISM: members float that the planets cannot hold.
    """
    from femgear.gears.kinematics import unheld_members

    floating = [name for name in ("sun", "carrier", "ring") if getattr(supports, name) == 0.0]
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
    names, _, stiffness = sides[0]
    return MovingMembers(names, np.vstack([approach for _, approach, _ in sides]), stiffness)


def _one_side(planetary_set, supports, back):
    """Names, approach (2N, m) and stiffness of the motions for one side of the teeth."""
    N = planetary_set.n_planets
    on_planet, on_ring = force_directions(planetary_set, back=back)
    zero = np.zeros((N, 2))
    names, columns, stiffness = [], [], []
    for member, value, effect in (
        ("sun", supports.sun, np.vstack([on_planet, zero])),
        ("carrier", supports.carrier, np.vstack([-on_planet, on_ring])),
        ("ring", supports.ring, np.vstack([zero, -on_ring])),
    ):
        if value is not None:
            names += [f"{member}: x", f"{member}: y"]
            columns.append(effect)
            stiffness += [value, value]
    if supports.planet is not None:
        for n in range(N):
            effect = np.zeros((2 * N, 2))
            effect[n], effect[N + n] = -on_planet[n], on_ring[n]
            names += [f"planet {n + 1}: x", f"planet {n + 1}: y"]
            columns.append(effect)
            # with clearance the springs of the bearing are candidates of the contact problem instead
            stiffness += [0.0 if supports.planet_clearance else supports.planet] * 2
    approach = np.hstack(columns) if columns else np.zeros((2 * N, 0))
    return tuple(names), approach, np.array(stiffness, float)
