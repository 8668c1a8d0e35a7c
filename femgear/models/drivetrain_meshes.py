"""Gear meshes of a drivetrain: directions that turn with the carrier, rectangular stiffness, forces."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError
from femgear.models.drivetrain_coordinates import Coordinates
from femgear.models.drivetrain_data import Drivetrain, MeshWave, ParallelStage, PlanetaryStage
from femgear.models.drivetrain_names import numbered
from femgear.models.planar import PlanarBody, PlanarSet, mesh_directions, pin_directions
from femgear.solvers.elements import positive_part
from femgear.solvers.series import FourierSeries, phase_of


def rectangular_series(wave: MeshWave, harmonics: int) -> np.ndarray:
    """Complex harmonics 0 to H (H + 1,) of the rectangular mesh stiffness [N/m].

    With ``low`` pairs always in contact and one more for the share ``e = ratio - low`` of the period, centred
    at phase zero, ``k = k_low + (k_high - k_low) (e + sum_h 2 / (pi h) sin(pi h e) cos(h omega t))``
    (Parker and Lin, J. Mech. Des. 126, 2004, 68-76, take the same wave).
    """
    if harmonics < 0 or int(harmonics) != harmonics:
        raise CaseError(f"{harmonics} harmonics", code="E-HARMONICS", limit="a whole number, 0 or more")
    low, high, share = stiffness_levels(wave)
    h = np.arange(1, harmonics + 1)
    waves = 2.0 * (high - low) / (math.pi * h) * np.sin(math.pi * h * share)
    return np.append(wave.stiffness, waves * np.exp(2j * np.pi * h * wave.phase)).astype(complex)


def stiffness_levels(wave: MeshWave) -> tuple[float, float, float]:
    """Lower and upper stiffness [N/m], and the share of the period with the upper one."""
    pairs = math.floor(wave.contact_ratio)
    share = wave.contact_ratio - pairs
    ratio = pairs / (pairs + 1.0) if wave.low_share is None else wave.low_share
    high = wave.stiffness / (ratio + (1.0 - ratio) * share)
    return ratio * high, high, share


def gibbs_overshoot(wave: MeshWave, harmonics: int) -> float:
    """Largest overshoot of the cut series beyond the upper stiffness, over the jump.

    Without end 0.0895 (J. W. Gibbs, Nature 59, 1899); the maximum is searched on a fine grid.
    """
    low, high, _ = stiffness_levels(wave)
    phase = np.linspace(0.0, 2.0 * np.pi, 400 * harmonics + 1)[:, None]
    return float((FourierSeries(rectangular_series(wave, harmonics)).at(phase).max() - high) / (high - low))


@dataclass(frozen=True)
class MeshGeometry:
    """Approach of the flanks of all meshes.

    The approach of mesh j is ``S_j(phase)^T U^T q``: ``U`` holds simple motions, ``S = fixed + sum_p
    (cos phi_p even_p + sin phi_p odd_p)`` with ``phi_p`` the angle of carrier p.

    Parameters
    ----------
    names : tuple of str
    basic : (n, m) array
        ``U``, among all coordinates or the free ones.
    fixed : (m, n_meshes) array
    even, odd : (P, m, n_meshes) arrays
    stage : (n_meshes,) int array
        Number of the stage, planetary ones first.
    """

    names: tuple[str, ...]
    basic: np.ndarray
    fixed: np.ndarray
    even: np.ndarray
    odd: np.ndarray
    stage: np.ndarray

    def selection(self, angles) -> np.ndarray:
        """``S`` (..., m, n_meshes) at carrier angles (..., P) [rad]."""
        angles = np.asarray(angles, float)
        whole = np.empty((*angles.shape[:-1], *self.fixed.shape))
        whole[...] = self.fixed
        # few entries turn
        turns = np.any((self.even != 0.0) | (self.odd != 0.0), axis=0)
        whole[..., turns] += np.cos(angles) @ self.even[:, turns] + np.sin(angles) @ self.odd[:, turns]
        return whole

    @property
    def frozen(self) -> np.ndarray:
        """Directions (n, n_meshes) with all carriers at angle zero."""
        return self.basic @ self.selection(np.zeros(len(self.even)))


def mesh_geometry(train: Drivetrain, place: Coordinates, spin: np.ndarray) -> MeshGeometry:
    """Directions of the drive flanks of all meshes among all coordinates; the planetary stages come first."""
    names, stages = [], []
    for number, stage in enumerate(train.planetary):
        n = len(stage.planet_angles)
        names += [f"{stage.sun}-planet {p + 1}" for p in range(n)]
        names += [f"planet {p + 1}-ring of {stage.carrier}" for p in range(n)]
        stages += [number] * (2 * n)
    names += [stage.name for stage in train.parallel]
    stages += range(len(train.planetary), len(train.planetary) + len(train.parallel))
    total = flank_directions(train, place, spin)
    return _split(numbered(names), total, np.array(stages, int), planar_places(train, place))


def flank_directions(train: Drivetrain, place: Coordinates, spin, *, back: bool = False) -> np.ndarray:
    """Approaches (n, n_meshes) of the drive or the back flanks, with the carriers at angle zero."""
    columns, side = [np.zeros((place.count, 0))], -1 if back else 1
    for number, stage in enumerate(train.planetary):
        flank = side * stage.flank
        # the flank of a sun that drives turns with it, that of one that is driven against it
        driven = -flank if spin[place.body[stage.carrier] + 4] > 0.0 else flank
        columns.append(lumped_map(stage, place, number).T @ mesh_directions(planar_of(train, stage), driven))
    for stage in train.parallel:
        columns.append(parallel_direction(stage, place, spin, flank=side * stage.flank)[:, None])
    return np.hstack(columns)


def planar_places(train: Drivetrain, place: Coordinates) -> list[list[int]]:
    """Per planetary stage the places of x and y of the carrier and the sun."""
    firsts = [(place.body[stage.carrier], place.body[stage.sun]) for stage in train.planetary]
    return [[one, one + 1, two, two + 1] for one, two in firsts]


def turned_directions(direction) -> tuple[np.ndarray, np.ndarray]:
    """Even and odd part (4, ...) of directions along x, y of carrier and sun that turn with the carrier."""
    # a direction (a, b) turned by phi is cos phi (a, b) + sin phi (-b, a)
    return direction, (direction[[1, 0, 3, 2]].T * np.array([-1.0, 1.0, -1.0, 1.0])).T


def _split(names, total, stages, planar) -> MeshGeometry:
    """Simple motions: the part of every mesh that does not turn, then x and y of carriers and suns."""
    count = total.shape[1]
    extra = 4 * len(planar)
    basic = np.hstack([total, np.zeros((len(total), extra))])
    even, odd = np.zeros((2, len(planar), count + extra, count))
    for number, places in enumerate(planar):
        at = count + 4 * number + np.arange(4)
        basic[places, at] = 1.0
        own = np.flatnonzero(stages == number)
        basic[np.ix_(places, own)] = 0.0
        even[number][np.ix_(at, own)], odd[number][np.ix_(at, own)] = turned_directions(
            total[np.ix_(places, own)]
        )
    fixed = np.vstack([np.eye(count), np.zeros((extra, count))])
    return MeshGeometry(tuple(names), basic, fixed, even, odd, stages)


def planar_of(train: Drivetrain, stage: PlanetaryStage) -> PlanarSet:
    """The stage as a lumped set with a held ring; supports are those of the chain, hence none here."""
    cosine = math.cos(stage.pressure_angle)
    bodies = {
        key: PlanarBody(train.body(name).mass, train.body(name).inertia)
        for key, name in (("carrier", stage.carrier), ("sun", stage.sun))
    }
    return PlanarSet(
        ring=PlanarBody(1.0, 1.0, math.inf, math.inf),
        planet=PlanarBody(stage.planet_mass, stage.planet_inertia),
        sun_radius=stage.sun_radius * cosine, ring_radius=stage.ring_radius * cosine,
        planet_radius=stage.planet_radius * cosine, centre_distance=stage.centre_distance,
        planet_angles=stage.planet_angles, pressure_angle_sun_planet=stage.pressure_angle,
        pressure_angle_planet_ring=stage.pressure_angle, stiffness_sun_planet=stage.sun_mesh.stiffness,
        stiffness_planet_ring=stage.ring_mesh.stiffness, planet_bearing=stage.planet_bearing, **bodies,
    )  # fmt: skip


def lumped_map(stage: PlanetaryStage, place: Coordinates, number: int) -> np.ndarray:
    """Coordinates of the lumped set (3 (N + 3), n) per unit of those of the chain, carrier at angle zero."""
    own, cosine = place.planets[number], math.cos(stage.pressure_angle)
    B = np.zeros((9 + 3 * len(own), place.count))
    for row, name, radius in (
        (0, stage.carrier, stage.centre_distance),
        (6, stage.sun, stage.sun_radius * cosine),
    ):
        first = place.body[name]
        B[row, first] = B[row + 1, first + 1] = 1.0
        B[row + 2, first + 4] = radius
    for p, planet in enumerate(own):
        B[11 + 3 * p, planet[2]] = stage.planet_radius * cosine
        if math.isfinite(stage.planet_bearing):
            B[9 + 3 * p, planet[0]] = B[10 + 3 * p, planet[1]] = 1.0
    if math.isinf(stage.planet_bearing):
        cosines, sines = np.cos(stage.planet_angles), np.sin(stage.planet_angles)
        x, y, u = B[:3]
        B[9::3] = np.outer(cosines, x) + np.outer(sines, y)
        B[10::3] = np.outer(cosines, y) - np.outer(sines, x) + u
    return B


def planet_bearing_rows(train: Drivetrain, stage: PlanetaryStage, place, number: int) -> np.ndarray:
    """Deflections (2N, n) of planet bearings of finite stiffness."""
    pins = pin_directions(planar_of(train, stage)).reshape(-1, 2 * len(stage.planet_angles))
    return pins.T @ lumped_map(stage, place, number)


def parallel_direction(stage: ParallelStage, place: Coordinates, spin, *, flank: int) -> np.ndarray:
    """Approach (n,) of the flanks of two gears at the pitch point, tilts and helix included.

    A point P of a body moves by ``t + tilt x (P - C)``; with n the normal into the second gear the
    coordinates get ``n`` and ``(P - C) x n``, the second gear the opposite. On the other flank (-1), that of
    a second gear that drives, the tangential and the axial part of n are reversed; the radial part pushes the
    gears apart on both (ISO 21771, left and right lines of action).
    """
    sense = 1.0 if spin[place.body[stage.first] + 4] > 0.0 else -1.0
    along = np.array([math.cos(stage.direction), math.sin(stage.direction)])
    across = flank * sense * np.array([-along[1], along[0]])
    plane = math.cos(stage.pressure_angle) * across + math.sin(stage.pressure_angle) * along
    # the normal leans along z by the base helix angle: tan(beta_b) = tan(beta) cos(alpha_t)
    lean = flank * math.tan(stage.helix_angle) * math.cos(stage.pressure_angle)
    normal = np.append(plane, lean) / math.hypot(1.0, lean)
    w = np.zeros(place.count)
    for name, radius, offset, sign in (
        (stage.first, stage.first_radius, stage.first_offset, 1.0),
        (stage.second, -stage.second_radius, stage.second_offset, -1.0),
    ):
        arm = np.append(radius * along, offset)
        moment = np.cross(arm, normal)
        first = place.body[name]
        w[first : first + 5] += sign * np.array([normal[0], normal[1], *moment])
    return w


@dataclass(frozen=True)
class TurningMeshes:
    """Meshes of one stage, or one of their flanks, as elements on simple motions.

    Parameters
    ----------
    columns : (g, d) int array
        Columns that every mesh takes part in.
    fixed, even, odd : (g, d) arrays
        ``S = fixed + cos phi even + sin phi odd``.
    stiffness : FourierSeries
        [N/m]
    turn : tuple of int
        Orders of the carrier's angle ``phi`` in the base frequencies.
    gap : (g,) array
        Of flanks that separate: ``k max(x - gap, 0)`` [m].
    separates : bool
        False: ``k x``.
    """

    columns: np.ndarray
    fixed: np.ndarray
    even: np.ndarray
    odd: np.ndarray
    stiffness: FourierSeries
    turn: tuple[int, ...]
    gap: np.ndarray
    separates: bool = False

    @property
    def reference(self) -> np.ndarray:
        """Mean stiffness of the columns by themselves (g, d) [N/m]."""
        square = self.fixed**2 + 0.5 * (self.even**2 + self.odd**2)
        return self.stiffness.mean[:, None] * square

    def evaluate(self, x, theta):
        """Forces (..., g, d) and tangents (..., g, d, d)."""
        phi = phase_of(theta, self.turn)[..., None, None]
        S = self.fixed + np.cos(phi) * self.even + np.sin(phi) * self.odd
        k, approach = self.stiffness.at(theta), (S * x).sum(axis=-1)
        if self.separates:
            overlap, closed = positive_part(approach - self.gap)
            force, slope = k * overlap, k * closed
        else:
            force, slope = k * approach, np.broadcast_to(k, approach.shape)
        return force[..., None] * S, slope[..., None, None] * S[..., :, None] * S[..., None, :]


def mesh_force(x, k, backlash, *, separates: bool) -> tuple[np.ndarray, np.ndarray]:
    """Force and tangent of meshes with the stiffness k at the approach x; drive side from ``x = 0`` on.

    The back side is that of gears whose axes keep their distance: its approach is -x.
    """
    if not separates:
        return k * x, np.broadcast_to(k, np.shape(x))
    drive, closed = positive_part(x)
    back, behind = positive_part(-x - backlash)
    return k * (drive - back), k * (closed + behind)
