"""Where the bodies of a planetary set stand, how they turn, what torques they carry and what holds them.

`unheld_members` tells whether the flanks of the planets alone keep members without a support in place.
Contacts only push: forces of the loaded flanks, none below zero, must balance the torque and leave no force
on a member that floats. By Farkas' lemma (1902) there are such forces, or there is a motion that the load
drives and no flank stops. A member that floats alone must not slide past all flanks either.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np

from femgear.errors import GeometryError
from femgear.gears.pair import GearSet
from femgear.gears.planetary import PlanetarySet

MEMBERS = ("sun", "carrier", "ring")
TOLERANCE = 1e-9
"""Of the forces of flanks for a unit load, and of singular values of matrices whose columns are near one."""


@dataclass(frozen=True)
class Orientations:
    """Angles ``gears`` [rad] of one tooth centreline of every body, a tuple a gear of the set, in the carrier frame."""

    gears: tuple[tuple[float, ...], ...]

    sun = property(lambda self: self.gears[0][0])
    bodies = property(lambda self: tuple(chain(*self.gears)))
    planets = property(lambda self: self.gears[1])
    ring = property(lambda self: self.gears[2][0])


@dataclass(frozen=True)
class Speeds:
    """Absolute speeds of ``sun``, ``ring`` and ``carrier`` and of each ``planet`` about its own axis [rad/s].

    ``mesh_frequency`` is that of all meshes [Hz].
    """

    sun: float
    planet: float
    ring: float
    carrier: float
    mesh_frequency: float


@dataclass(frozen=True)
class Torques:
    """External torques on ``sun``, ``ring`` and ``carrier`` [N m]; without losses they add up to zero."""

    sun: float
    ring: float
    carrier: float


def orientations(planetary: GearSet, position: float = 0.0) -> Orientations:
    """Compute the rotations [rad] of all bodies at a position tau, loaded flanks touching.

    tau is a fraction of one mesh period (may exceed 1): the sun turns by ``+2 pi tau / z_s``, a planet by
    ``-2 pi tau / z_p`` and the ring by ``-2 pi tau / z_r``; gears of a pair as their senses say.
    """
    s, phase = planetary, planetary.mesh_phases.tolist()
    angles: list[list[float]] = [[] for _ in s.gears]
    for number, body in enumerate(s.bodies):
        # every body by the first mesh in which it takes part
        first, mesh = next((j, mesh) for j, mesh in enumerate(s.meshes) if number in mesh.bodies)
        start, lean = pitch_tooth(s, mesh.kind, mesh.bodies.index(number))
        turn = (position + phase[first]) * s.gears[body.gear].pitch_angle
        angles[body.gear].append(mesh.angle + start + lean + s.senses[body.gear] * turn)
    return Orientations(tuple(map(tuple, angles)))


def pitch_tooth(gears: GearSet, kind: int, place: int) -> tuple[float, float]:
    """Find the tooth of gear 1 or 2 (0, 1) of a kind of mesh whose loaded flank is at the pitch point.

    The angle of that flank [rad] from the direction in which gear 1 sees the pitch point, and that of the
    tooth's centreline from its flank [rad].
    """
    number, eta = gears.mates[kind][place], gears.kinds[kind].half_angles[place]
    opposite = place == 1 and not gears.gears[number].internal
    return math.pi if opposite else 0.0, (gears.senses[number] if place else -gears.senses[number]) * eta


def speeds(planetary: PlanetarySet, *, input: str, fixed: str, speed: float) -> Speeds:
    """Compute the speeds [rad/s] of every body from one driven and one held member (Willis).

    ``z_s (w_s - w_c) = -z_r (w_r - w_c) = -z_p (w_p - w_c)``; the mesh frequency is
    ``|w_s - w_c| z_s / (2 pi)``. ``input`` and ``fixed`` are two of "sun", "carrier" and "ring", refused
    where they are one (GeometryError, E-MECHANISM); ``speed`` is that of the driven member [rad/s].
    """
    if input == fixed:
        raise GeometryError(
            f"the {input} is both driven and held, which leaves two members free",
            code="E-MECHANISM",
            key="operation.fixed",
            value=input,
            limit="one driven, one held and one output member out of sun, carrier and ring",
            remedy='for example input = "sun", fixed = "ring"',
        )
    zs, zp, zr = planetary.sun.teeth, planetary.planet.teeth, planetary.ring.teeth
    speed_of = {input: speed, fixed: 0.0}
    sun, ring, carrier = willis_weights(zs, zr)
    weight = {"sun": sun, "ring": ring, "carrier": carrier}
    (free,) = (member for member in MEMBERS if member not in speed_of)
    speed_of[free] = -sum(weight[member] * value for member, value in speed_of.items()) / weight[free]
    planet, mesh_frequency = planet_motion(speed_of["sun"], speed_of["carrier"], zs, zp)
    return Speeds(planet=planet, mesh_frequency=mesh_frequency, **speed_of)


def willis_weights(first: Any, second: Any) -> tuple[Any, Any, Any]:
    """Compute the weights of the speeds of two gears of a carrier, and of the carrier, in Willis' equation.

    ``z_1 (w_1 - w_c) + z_2 (w_2 - w_c) = 0``, so ``z_1 w_1 + z_2 w_2 - (z_1 + z_2) w_c = 0``: of sun and ring with
    planets between them, of two external gears in mesh, and with a negative size of the second of an internal one and
    of sun and ring with double planets (R. Willis, Principles of Mechanism, 1841). Without losses the torques have
    the same ratios. Sizes are tooth numbers or base radii, numbers or arrays.
    """
    return first, second, -(first + second)


def planet_motion(sun: Any, carrier: Any, sun_teeth: Any, planet_teeth: Any) -> tuple[Any, Any]:
    """Compute the speed of the planets about their own axes [rad/s] and the mesh frequency [Hz].

    From the speeds of sun and carrier [rad/s] and the teeth, all numbers or arrays (S,) of several sets.
    """
    relative = sun - carrier
    return carrier - relative * sun_teeth / planet_teeth, abs(relative) * sun_teeth / (2.0 * math.pi)


def sun_ratio(sun_teeth: Any, ring_teeth: Any) -> Any:
    """Compute the speed of the sun over that of the carrier with the ring held, ``1 + z_r/z_s``, numbers or arrays."""
    return -willis_weights(1.0, ring_teeth / sun_teeth)[2]


def torque_ratios(sun_teeth: int, ring_teeth: int) -> dict[str, float]:
    """Compute the torques of sun, ring and carrier over that of the sun, the weights of their speeds, too.

    Willis: without losses ``T_s : T_r : T_c = 1 : z_r/z_s : -(1 + z_r/z_s)``, and
    ``T_s w_s + T_r w_r + T_c w_c = 0``.
    """
    sun, ring, carrier = willis_weights(1.0, ring_teeth / sun_teeth)
    return {"sun": sun, "ring": ring, "carrier": carrier}


def torques(planetary: PlanetarySet, *, member: str, torque: float) -> Torques:
    """Compute the external torques [N m] on sun, ring and carrier from that on one `member` [N m]."""
    share = torque_ratios(planetary.sun.teeth, planetary.ring.teeth)
    sun = torque / share[member]
    return Torques(sun=sun, ring=sun * share["ring"], carrier=sun * share["carrier"])


def mesh_normals(planetary_set: GearSet, *, back: bool = False) -> np.ndarray:
    """Compute the unit vectors (meshes, 2) of the force of gear 1 on gear 2 in every mesh.

    Its line of action: sun on planet at ``psi + pi/2 - alpha_w``, planet on ring at ``psi - pi/2 + alpha_w``
    (carrier frame); the back flanks, with `back`, at ``psi - pi/2 + alpha_w`` and ``psi + pi/2 - alpha_w``.
    """
    s = planetary_set
    sides = [-s.senses[body_1] if back else s.senses[body_1] for body_1, _ in s.mates]
    leans = [side * (0.5 * np.pi - kind.working_pressure_angle) for side, kind in zip(sides, s.kinds, strict=True)]
    return unit_vectors(s.mesh_angles + s.of_kinds(leans))


def unit_vectors(angles: np.ndarray) -> np.ndarray:
    """Compute the unit vectors (..., 2) along x and y in directions (...) [rad]."""
    return np.stack([np.cos(angles), np.sin(angles)], axis=-1)


def across(vectors: np.ndarray) -> np.ndarray:
    """Turn vectors (..., 2) along x and y by a right angle, counter-clockwise, to (..., 2)."""
    return np.stack([-vectors[..., 1], vectors[..., 0]], axis=-1)


def body_approach(gears: GearSet, *, back: bool = False) -> np.ndarray:
    """Compute the approach (M, B, 3) of the flanks of all meshes per unit motion of every body.

    Per motion along x and y [1] and per counter-clockwise rotation [m/rad], in the frame of the carrier:
    ``n . (u_1 - u_2)`` with the normal n of `mesh_normals`, and the base radius of a gear that turns as the loaded
    flanks drive it, minus that of one that turns against it. `back` is for the back flanks.
    """
    approach, side = np.zeros((len(gears.meshes), len(gears.bodies), 3)), -1.0 if back else 1.0
    for mesh, normal, effect in zip(gears.meshes, mesh_normals(gears, back=back), approach, strict=True):
        # gear 1 moves along the normal into gear 2, gear 2 away
        for body, push in zip(mesh.bodies, (1.0, -1.0), strict=True):
            number = gears.bodies[body].gear
            effect[body, :2] = push * normal
            effect[body, 2] = push * side * gears.senses[number] * gears.gears[number].base_radius
    return approach


def member_approach(planetary_set: GearSet, *, back: bool = False) -> dict[str, np.ndarray]:
    """Compute the approach (M, 2) of all flanks per unit motion of the members along x and y, by their names.

    Of a planetary set sun, carrier and ring. A number without unit; `back` is for the back flanks, as in
    `mesh_normals`.
    """
    s, effect = planetary_set, body_approach(planetary_set, back=back)[..., :2]
    number = np.array([body.gear for body in s.bodies])
    return {name: effect[:, np.isin(number, gears)].sum(axis=1) for name, gears in s.members.items()}


def sliding_directions(gears: GearSet) -> np.ndarray:
    """Compute the unit vectors (M, 2) along which flank 1 of every mesh moves over the tangent while gear 1 drives."""
    sense = np.array([gears.senses[gears.bodies[mesh.bodies[0]].gear] for mesh in gears.meshes])
    return sense[:, None] * across(mesh_normals(gears))


def member_sliding(planetary_set: GearSet) -> dict[str, np.ndarray]:
    """Compute the sliding (M, 2) of flank 1 on flank 2 per unit motion of the members along x and y, by their names.

    Along `sliding_directions`, as `member_approach` has it along the normals.
    """
    s, effect = planetary_set, np.zeros((len(planetary_set.meshes), len(planetary_set.bodies), 2))
    for mesh, direction, row in zip(s.meshes, sliding_directions(s), effect, strict=True):
        for body, push in zip(mesh.bodies, (1.0, -1.0), strict=True):
            row[body] = push * direction
    number = np.array([body.gear for body in s.bodies])
    return {name: effect[:, np.isin(number, gears)].sum(axis=1) for name, gears in s.members.items()}


def unheld_members(planetary_set: GearSet, floating: Sequence[str], *, both_flanks: bool = False) -> tuple[str, ...]:
    """Find the members that float without being held by the planets.

    Of members without a radial support, any of "sun", "carrier" and "ring": the first one that the planets
    cannot hold though the others stand still; all of them when they can hold each but not all at once; none
    when everything is held. With ``both_flanks`` the back flanks carry too.
    """
    for name in floating:
        if not _held(planetary_set, (name,), both_flanks):
            return (name,)
    # sun and carrier may slide together at constant loads: these are known, their common place is free
    if len(floating) < 2 or _held(planetary_set, tuple(floating), both_flanks):
        return ()
    return tuple(floating)


def _held(s: GearSet, floating: tuple[str, ...], both_flanks: bool) -> bool:
    """Whether forces of the flanks keep the members in equilibrium, and a single one from sliding."""
    from scipy.optimize import nnls

    turns = s.rotation_approach
    approach = []
    for back in (False, True)[: 1 + both_flanks]:
        motions = member_approach(s, back=back)
        approach.append(np.hstack([-turns if back else turns, *(motions[name] for name in floating)]))
    approach = np.vstack(approach)
    slides = np.linalg.matrix_rank(approach, tol=TOLERANCE) < approach.shape[1]
    if len(floating) == 1 and slides:
        return False
    load = np.zeros(approach.shape[1])
    load[turns.shape[1] - 1] = 1.0  # the torque of the sun, which everything else must pass on
    return bool(nnls(approach.T, load)[1] < TOLERANCE)
