"""Where two flanks may touch: windows of pressure cells with their true separations.

Both flanks are exact involutes. The separation of a point ``P`` of flank 1 from flank 2 is measured along
the normal of flank 2 through ``P``, which is tangent to the base circle of gear 2: involutes of one base
circle are parallel curves, so the distance is the base radius times the angle between their origins. The
formula holds off the line of action and at tip corners as well. Deviations add separations of profiles along
the flanks (`profile_form`) and of whole tooth pairs (`pair_separations`).

Gear 1 drives. Its flank is drawn as a left flank; roll lengths on gear 1 grow with the path coordinate. Which
teeth a pair consists of, and where tooth number zero of every gear stands, is told by `tooth_numbers` and
`tooth_zero_angles`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femgear.errors import ContactError

if TYPE_CHECKING:
    from femgear.gears.gear import Gear
    from femgear.gears.planetary import PlanetarySet

WINDOW_NODES = np.array([0.0, 0.5, 1.0])


@dataclass(frozen=True)
class FlankPair:
    """Geometry of two mating flanks at a fixed centre distance.

    Parameters
    ----------
    base_radius_1, base_radius_2 : float
        [m].
    centre_distance, pressure_angle : float
        Working values [m], [rad].
    sign : float
        +1 for two external gears, -1 when gear 2 is internal.
    limits_1, limits_2 : tuple of float
        Smallest and largest roll length of the two flanks [m].
    """

    base_radius_1: float
    base_radius_2: float
    centre_distance: float
    pressure_angle: float
    sign: float
    limits_1: tuple[float, float]
    limits_2: tuple[float, float]

    @property
    def pitch_roll_1(self) -> float:
        """Roll length of flank 1 at the pitch point [m]."""
        return self.base_radius_1 * np.tan(self.pressure_angle)

    @property
    def pitch_roll_2(self) -> float:
        """Roll length of flank 2 at the pitch point [m]."""
        return self.base_radius_2 * np.tan(self.pressure_angle)

    @property
    def path(self) -> tuple[float, float]:
        """Ends of the path of contact, measured from the pitch point in the direction of motion [m]."""
        roll_2 = sorted(self.sign * (self.pitch_roll_2 - r) for r in self.limits_2)
        start = max(self.limits_1[0] - self.pitch_roll_1, roll_2[0])
        return start, min(self.limits_1[1] - self.pitch_roll_1, roll_2[1])

    def roll_on(self, gear: int, zeta):
        """Roll length [m] on gear 1 (0) or gear 2 (1) at path coordinates, kept on the path of contact."""
        zeta = np.clip(zeta, *self.path)
        return self.pitch_roll_1 + zeta if gear == 0 else self.pitch_roll_2 - self.sign * zeta


def flank_pair(gear_1: Gear, gear_2: Gear, centre_distance: float, pressure_angle: float) -> FlankPair:
    """Two mating flanks; gear 2 may be internal."""
    ends_1 = sorted((_roll(gear_1, gear_1.form_radius), _roll(gear_1, gear_1.tip_radius)))
    ends_2 = sorted((_roll(gear_2, gear_2.form_radius), _roll(gear_2, gear_2.tip_radius)))
    return FlankPair(
        base_radius_1=gear_1.base_radius,
        base_radius_2=gear_2.base_radius,
        centre_distance=centre_distance,
        pressure_angle=pressure_angle,
        sign=-1.0 if gear_2.internal else 1.0,
        limits_1=(ends_1[0], ends_1[1]),
        limits_2=(ends_2[0], ends_2[1]),
    )


def separation(pair: FlankPair, zeta, roll_1):
    """Separation of flank 1 from flank 2 and the roll length of the foot point on flank 2.

    Parameters
    ----------
    pair : FlankPair
    zeta : array
        Path coordinate of the tooth pair [m].
    roll_1 : array, broadcast with `zeta`
        Roll length of the point on flank 1 [m].

    Returns
    -------
    gap, roll_2 : arrays
        Separation along the normal of flank 2 [m] and roll length of the foot point [m].
    """
    rb1, rb2, sign = pair.base_radius_1, pair.base_radius_2, pair.sign
    # polar angle of an involute point: origin angle less the involute function of its pressure angle
    origin = (pair.pitch_roll_1 + zeta) / rb1 - pair.pressure_angle
    angle = origin - (roll_1 / rb1 - np.arctan2(roll_1, rb1))
    radius = np.hypot(rb1, roll_1)
    x = sign * (sign * pair.centre_distance - radius * np.cos(angle))
    y = -sign * radius * np.sin(angle)
    length = np.sqrt(np.maximum(x**2 + y**2 - rb2**2, 0.0))
    involute = length / rb2 - np.arctan2(length, rb2)
    origin_2 = (pair.pitch_roll_2 - sign * zeta) / rb2 - pair.pressure_angle
    gap = sign * rb2 * (np.arctan2(y, x) + involute - origin_2)
    return gap, length - sign * gap


def admissible_arcs(pair: FlankPair, zeta):
    """Range of arc length on flank 1 whose points and foot points both lie on the flanks.

    Parameters
    ----------
    pair : FlankPair
    zeta : array

    Returns
    -------
    low, high : arrays of the shape of `zeta`
        Arc lengths measured from the base circle along flank 1 [m].
    """
    zeta = np.asarray(zeta, float)
    rb1 = pair.base_radius_1
    low = np.full(zeta.shape, pair.limits_1[0] ** 2 / (2 * rb1))
    high = np.full(zeta.shape, pair.limits_1[1] ** 2 / (2 * rb1))
    for bound in range(2):
        arc = _arc_of_foot(pair, zeta, pair.limits_2[bound])
        # along flank 1 the foot point moves down an external flank 2 and up an internal one
        if (bound == 0) == (pair.sign > 0):
            high = np.minimum(high, arc)
        else:
            low = np.maximum(low, arc)
    return low, high


@dataclass(frozen=True)
class Windows:
    """Windows of pressure cells for many positions of one mesh; leading shape (..., pairs).

    Parameters
    ----------
    zeta : (...,) array
        Path coordinate of the tooth pair [m].
    near : (...,) bool array
        Whether the pair comes near enough to be a candidate.
    start : (...,) array
        Arc length on flank 1 of the first cell edge [m].
    centre : (...,) array
        Arc length from the point on the path of contact to the middle of the window [m].
    cell : float
        Mean width of a cell [m].
    layout : (...,) int array
        How the cells are divided, see `cell_edges`.
    gap : (..., cells) array
        Separation at the cell centres [m]; infinite outside the flanks.
    roll_1, roll_2 : (..., nodes) arrays
        Roll lengths at the window nodes on both flanks [m].
    at_low_edge, at_high_edge : (...,) bool arrays
        Whether that end of the window is an end of a flank (a tip corner or the start of the involute).
    """

    zeta: np.ndarray
    near: np.ndarray
    start: np.ndarray
    centre: np.ndarray
    cell: float
    layout: np.ndarray
    gap: np.ndarray
    roll_1: np.ndarray
    roll_2: np.ndarray
    at_low_edge: np.ndarray
    at_high_edge: np.ndarray


def windows(
    pair: FlankPair,
    zeta,
    *,
    width: float,
    cells: int,
    nearest: float,
    line_of_action: bool,
    form: Callable | None = None,
    shift=0.0,
) -> Windows:
    """Cells around the point of smallest separation of every tooth pair.

    Parameters
    ----------
    pair : FlankPair
    zeta : array
        Path coordinates [m].
    width : float
        Width of a window [m].
    cells : int
        Number of pressure cells in it.
    nearest : float
        Pairs (last axis) whose smallest separation exceeds that of the nearest pair by more than this [m]
        are no candidates.
    line_of_action : bool
        Only pairs on the theoretical path of contact, as for rigid gears.
    form : callable, optional
        Separation that deviations of both profiles add, from the roll lengths on flank 1 and 2 [m].
    shift : array, broadcast with `zeta`
        Separation that errors of position add to a whole pair [m].
    """
    zeta = np.asarray(zeta, float)
    low, high = admissible_arcs(pair, zeta)
    nominal = np.maximum(pair.pitch_roll_1 + zeta, 0.0) ** 2 / (2 * pair.base_radius_1)
    tip_to_form = low < high
    centre = np.clip(nominal, low, np.maximum(low, high))
    if form is not None:
        centre = _nearest_arc(pair, zeta, centre, low, high, 6.0 * width, form)
    start = np.clip(centre - 0.5 * width, low, np.maximum(low, high - width))
    cell = width / cells
    tiny = 1e-9 * width
    at_low_edge, at_high_edge = start <= low + tiny, start + width >= high - tiny
    layout = at_low_edge + 2 * at_high_edge
    arc = start[..., None] + width * cell_centres(cells)[layout]
    gap = _separation_at(pair, zeta[..., None], arc, form) + np.asarray(shift)[..., None]
    gap = np.where(arc < high[..., None], gap, np.inf)
    node_arc = np.minimum(start[..., None] + WINDOW_NODES * width, np.maximum(high, low + width)[..., None])
    roll_1 = np.sqrt(2 * pair.base_radius_1 * node_arc)
    roll_2 = separation(pair, zeta[..., None], roll_1)[1]
    begin, end = pair.path
    on_path = (zeta >= begin) & (zeta <= end)
    smallest = gap.min(axis=-1)
    smallest = np.where(tip_to_form, smallest, np.inf)
    near = on_path if line_of_action else smallest - smallest.min(axis=-1, keepdims=True) < nearest
    return Windows(
        zeta=zeta,
        near=near,
        start=start,
        centre=start + 0.5 * width - nominal,
        cell=cell,
        layout=layout,
        gap=gap,
        roll_1=roll_1,
        roll_2=roll_2,
        at_low_edge=at_low_edge,
        at_high_edge=at_high_edge,
    )


def cell_edges(cells: int) -> np.ndarray:
    """Cell edges as fractions of a window: inside a flank, at its low end, at its high end, at both.

    Where flanks end they meet at an angle: a light load is carried within some micrometres of the corner, so
    that the cells there shrink to ``1 / cells^2`` of the window.

    Returns
    -------
    (4, cells + 1) array
    """
    t = np.linspace(0.0, 1.0, cells + 1)
    return np.stack([t, t**2, 1.0 - (1.0 - t) ** 2, np.sin(0.5 * np.pi * t) ** 2])


def cell_centres(cells: int) -> np.ndarray:
    """Middles of the cells as fractions of a window, shape (4, cells)."""
    edges = cell_edges(cells)
    return 0.5 * (edges[:, 1:] + edges[:, :-1])


def equal_cells(cells: int) -> np.ndarray:
    """Share of every cell (last axis) of the layouts that lies in each of equal cells, (4, cells, cells)."""
    edges, equal = cell_edges(cells), np.linspace(0.0, 1.0, cells + 1)
    low, high = edges[:, None, :-1], edges[:, None, 1:]
    overlap = np.minimum(high, equal[1:, None]) - np.maximum(low, equal[:-1, None])
    return np.maximum(overlap, 0.0) / (high - low)


def window_polynomials(cells: int) -> np.ndarray:
    """Quadratic Lagrange polynomials of the window nodes at the cell centres, shape (4, cells, 3)."""
    t = cell_centres(cells)
    return np.stack([(2 * t - 1) * (t - 1), 4 * t * (1 - t), t * (2 * t - 1)], axis=-1)


def profile_form(planetary_set, deviations, kind, back):
    """Separation by deviations of the profiles as a function of both roll lengths, or None."""
    # on the back side a planet meets sun and ring with its other flanks
    planet = "planet_sun_side" if (kind == 0) != back else "planet_ring_side"
    forms = (planet, "ring" if kind else "sun")
    if deviations is None or not any(getattr(deviations, name).modifications for name in forms):
        return None
    from femgear.gears.deviations import profile_separation

    return lambda roll_1, roll_2: profile_separation(
        deviations, planetary_set, kind, roll_1, roll_2, back=back
    )


def pair_separations(planetary_set, deviations, tooth, turns, tau, *, back) -> np.ndarray:
    """Separations of whole tooth pairs by errors of pitch and position, shape (2N, P, pairs) [m]."""
    N = planetary_set.n_planets
    shift = np.zeros((2 * N, len(tau), tooth[0].shape[1]))
    if deviations is not None:
        from femgear.gears.deviations import body_separation, tooth_separation

        shift += body_separation(deviations, planetary_set, tau, back=back)[:, :, None]
        for mesh in range(2 * N):
            # with every mesh period the sun's teeth move on by one, those of planets and ring back
            sign = -1 if mesh < N else 1
            first = tooth[0][mesh][None, :] + sign * turns[:, None]
            second = tooth[1][mesh][None, :] + turns[:, None]
            shift[mesh] += tooth_separation(deviations, mesh, first, second, back=back)
    return shift


def tooth_numbers(planetary_set: PlanetarySet, index: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tooth numbers on gear 1 and gear 2 of the pairs `index` (2N, pairs), counted in each body's frame.

    A pair of mesh j with index i touches at the pitch point when the position is ``-(phase_j + i)``; the
    tooth is then at the planet's angle, less its half thickness, which fixes its place on the body.
    """
    from femgear.gears.gear import half_thickness_angle

    s, N = planetary_set, planetary_set.n_planets
    psi = np.asarray(s.planet_angles) - s.planet_angles[0]
    turns = np.asarray(s.mesh_phases)[:, None] + index
    sun = psi[:, None] / s.sun.pitch_angle + turns[:N] - s.mesh_phases[0]
    ring = psi[:, None] / s.ring.pitch_angle - (turns[N:] - s.mesh_phases[N])
    radius_s = s.planet.base_radius / np.cos(s.working_pressure_angle_sun_planet)
    radius_r = s.planet.base_radius / np.cos(s.working_pressure_angle_planet_ring)
    thickness = half_thickness_angle(s.planet, radius_s) + half_thickness_angle(s.planet, radius_r)
    first = np.asarray(s.mesh_phases)[:N, None]
    planet_sun = -(turns[:N] - first)
    planet_ring = (thickness - np.pi) / s.planet.pitch_angle - (turns[N:] - first)
    exact = np.concatenate([sun, planet_ring]), np.concatenate([planet_sun, ring])
    rounded = tuple(np.rint(e).astype(int) for e in exact)
    if max(np.abs(e - r).max() for e, r in zip(exact, rounded)) > 1e-3:
        raise ContactError(
            "the phases of the meshes and the positions of the teeth contradict one another",
            code="E-CONTACT-PHASE",
            remedy="planet angles must be whole multiples of 360/(z_sun + z_ring) degrees from one another",
        )
    return rounded


def tooth_zero_angles(planetary_set: PlanetarySet, position: float = 0.0):
    """Angles of the centre of tooth number 0 of every gear, as `tooth_numbers` counts them [rad].

    Parameters
    ----------
    planetary_set : PlanetarySet
    position : float
        Fraction of one mesh period.

    Returns
    -------
    sun : float
    planets : (N,) array
        In the frame of the set, about each planet's own centre.
    ring : float
    """
    from femgear.gears.gear import half_thickness_angle

    s = planetary_set
    N, psi = s.n_planets, np.asarray(s.planet_angles)
    turned = position + np.asarray(s.mesh_phases)

    def half_angle(gear, pressure_angle):
        return float(half_thickness_angle(gear, gear.base_radius / np.cos(pressure_angle)))

    sun_angle, ring_angle = s.working_pressure_angle_sun_planet, s.working_pressure_angle_planet_ring
    sun = psi[0] - half_angle(s.sun, sun_angle) + turned[0] * s.sun.pitch_angle
    planets = psi + np.pi - half_angle(s.planet, sun_angle) - turned[:N] * s.planet.pitch_angle
    ring = psi[0] - half_angle(s.ring, ring_angle) - turned[N] * s.ring.pitch_angle
    return float(sun), planets, float(ring)


def _roll(gear: Gear, radius: float) -> float:
    return float(np.sqrt(max(radius**2 - gear.base_radius**2, 0.0)))


def _arc_of_foot(pair: FlankPair, zeta, roll_2):
    """Arc length on flank 1 of the point whose foot on flank 2 has the roll length `roll_2` (secant)."""
    rb1, rb2 = pair.base_radius_1, pair.base_radius_2
    target = roll_2**2 / (2 * rb2)
    contact_1 = np.maximum(pair.pitch_roll_1 + zeta, 0.0) ** 2 / (2 * rb1)
    contact_2 = np.maximum(pair.pitch_roll_2 - pair.sign * zeta, 0.0) ** 2 / (2 * rb2)
    arc = contact_1 + pair.sign * (contact_2 - target)
    for _ in range(12):
        roll_1 = np.sqrt(2 * rb1 * np.maximum(arc, 0.0))
        foot = separation(pair, zeta, roll_1)[1]
        error = foot * np.abs(foot) / (2 * rb2) - target
        arc = arc + pair.sign * error
        if np.abs(error).max(initial=0.0) < 1e-15:
            break
    return arc


def _separation_at(pair: FlankPair, zeta, arc, form):
    """Separation at arc lengths on flank 1, deviations of the profiles included."""
    roll_1 = np.sqrt(2 * pair.base_radius_1 * np.maximum(arc, 0.0))
    gap, roll_2 = separation(pair, zeta, roll_1)
    return gap if form is None else gap + form(roll_1, roll_2)


def _nearest_arc(pair: FlankPair, zeta, centre, low, high, reach, form):
    """Arc length of the smallest separation within `reach` of the contact of the unmodified flanks."""
    begin = np.maximum(centre - reach, low)
    end = np.maximum(np.minimum(centre + reach, high), begin)
    arc = begin[..., None] + (end - begin)[..., None] * np.linspace(0.0, 1.0, 97)
    best = _separation_at(pair, zeta[..., None], arc, form).argmin(axis=-1)
    return np.take_along_axis(arc, best[..., None], axis=-1)[..., 0]
