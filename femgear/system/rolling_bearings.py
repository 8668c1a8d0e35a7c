"""Rolling bearings from their geometry: force and stiffness of a motion of the rings (ISO/TS 16281:2008).

A ball moves in the plane through its centre and the axis. The centres of curvature of its two grooves are
``X = A cos a - s/2 + d_r`` apart along the radius and ``Y = A sin a + p + d_a`` along the axis, ``A = r_i + r_e -
D_w``; its deflection is ``|(X, Y)| - A`` and its load ``c_p`` times the power 3/2 of it. A roller is cut into laminae
of load ``35948 L^(8/9) / n`` times the power 10/9 of their deflection [N, mm]. Displacements of the ring are small:
both loads have a potential, and the stiffness is its symmetric second derivative. ISO/TS 16281 lets tilts act with the
radius of the groove centre in the deflection and half the pitch diameter in the moment, which has no potential; here
both have half the pitch diameter.

Sense along the axis: with a contact angle above 0 the inner ring carries a force along +z, below 0 one along -z, with
a contact angle of 0 (deep groove) both. Two rows carry both: of the first row the inner ring is pushed along +z.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NoReturn

import numpy as np

from femgear.errors import CaseError, checked_count, checked_numbers

KINDS = ("cylindrical", "needle", "tapered", "spherical")
PROFILES = ("logarithmic", "none")
LINE_STIFFNESS = 35948.0 * 1e3 ** (8.0 / 9.0 + 10.0 / 9.0)
"""Of a steel roller of 1 m (ISO/TS 16281, 35 948 N and mm): ``c_L = LINE_STIFFNESS L^(8/9)`` [N/m^(10/9)]."""
LINE_EXPONENT = 10.0 / 9.0
STEEL_MODULUS, STEEL_POISSON = 2.1e11, 0.3
THRUST_ANGLE = math.radians(45.0)
"""Above this contact angle a bearing is a thrust bearing (ISO 281)."""
_POINT_COEFFICIENT = math.pi * math.sqrt(2.0) / 3.0
_STEPS, _CLOSE = 300, 1e-4
_SLIDES = 60


@dataclass(frozen=True)
class BallBearing:
    """A ball bearing, all lengths in m.

    CaseError: numbers that no bearing can have (E-BEARING).

    Parameters
    ----------
    balls : int
        Balls of one row, three or more.
    ball_diameter, pitch_diameter : float
        D_w and D_pw, that of the circle of ball centres.
    contact_angle : float
        Without load and clearance, -pi/2 to pi/2 [rad]; 0 is a deep groove bearing. Above 0 the inner ring is pushed
        along +z, below 0 along -z.
    clearance : float
        Radial internal clearance in operation: the whole way between the rings; negative is a tight fit.
    inner_osculation, outer_osculation : float
        Groove radius over ball diameter, above 0.5.
    youngs_modulus, poisson_ratio : float
        Of balls and rings [Pa, 1].
    axial_preload : float
        Way by which the rings of every row are pushed together along the axis, in the sense in which they carry.
    rows : int
        1 or 2 equal rows.
    row_distance : float
        Between the two rows; above 0 back to back (O), below 0 face to face (X).
    """

    balls: int
    ball_diameter: float
    pitch_diameter: float
    contact_angle: float = 0.0
    clearance: float = 0.0
    inner_osculation: float = 0.52
    outer_osculation: float = 0.53
    youngs_modulus: float = STEEL_MODULUS
    poisson_ratio: float = STEEL_POISSON
    axial_preload: float = 0.0
    rows: int = 1
    row_distance: float = 0.0

    def __post_init__(self):
        _check_common(self, "balls", self.balls, "ball_diameter", self.ball_diameter)
        for name in ("inner_osculation", "outer_osculation"):
            if not 0.5 < getattr(self, name) < 1.0:
                _refuse(name, getattr(self, name), "above 0.5, below 1: groove radius over ball diameter")
        if self.youngs_modulus <= 0.0 or not 0.0 <= self.poisson_ratio < 0.5:
            _refuse("youngs_modulus", (self.youngs_modulus, self.poisson_ratio), "modulus above 0, ratio 0 to 0.5")
        if self.clearance >= 2.0 * self.groove_distance * math.cos(self.contact_angle) and self.clearance > 0.0:
            limit = 2.0 * self.groove_distance * math.cos(self.contact_angle)
            _refuse("clearance", self.clearance, f"below {1e3 * limit:.4g} mm: the balls must reach both grooves")

    @property
    def elements(self) -> int:
        """Balls of one row."""
        return self.balls

    @property
    def element_diameter(self) -> float:
        """Diameter of a ball [m]."""
        return self.ball_diameter

    @property
    def groove_distance(self) -> float:
        """Distance A of the centres of curvature of both grooves [m], where a ball just touches them."""
        return (self.inner_osculation + self.outer_osculation - 1.0) * self.ball_diameter


@dataclass(frozen=True)
class RollerBearing:
    """A bearing with steel rollers, all lengths in m.

    Cylindrical and needle bearings carry no force along the axis, whatever their flanges; the spherical kind aligns
    itself and carries no moment. CaseError: numbers that no bearing can have (E-BEARING, E-CHOICE).

    Parameters
    ----------
    kind : str
        "cylindrical", "needle", "tapered" or "spherical".
    rollers : int
        Rollers of one row, three or more.
    effective_length, pitch_diameter, roller_diameter : float
        L_we, D_pw, and D_we at the middle of the roller.
    contact_angle : float
        Of the contacts of the outer ring [rad]; its sign as of `BallBearing`. None of cylindrical and needle bearings.
    clearance : float
        Radial internal clearance in operation: the whole way between the rings; negative is a tight fit.
    laminae : int
        Of a roller, two or more.
    profile : str
        "logarithmic", the drop of ISO/TS 16281 (that of spherical rollers as of cylindrical ones), or "none".
    axial_preload : float
        Way by which the rings of every row are pushed together along the axis, in the sense in which they carry.
    rows : int
        1 or 2 equal rows.
    row_distance : float
        Between the two rows; above 0 back to back (O), below 0 face to face (X).
    """

    kind: str
    rollers: int
    effective_length: float
    pitch_diameter: float
    roller_diameter: float
    contact_angle: float = 0.0
    clearance: float = 0.0
    laminae: int = 30
    profile: str = "logarithmic"
    axial_preload: float = 0.0
    rows: int = 1
    row_distance: float = 0.0

    def __post_init__(self):
        for name, choices in (("kind", KINDS), ("profile", PROFILES)):
            if getattr(self, name) not in choices:
                text = f"{name} of a roller bearing is {getattr(self, name)!r}"
                raise CaseError(text, code="E-CHOICE", key=name, limit=", ".join(choices))
        _check_common(self, "rollers", self.rollers, "roller_diameter", self.roller_diameter)
        checked_count(self.laminae, "laminae", code="E-BEARING", least=2)
        if self.effective_length <= 0.0:
            _refuse("effective_length", self.effective_length, "above 0 m")
        radial = self.kind in ("cylindrical", "needle")
        if radial and self.contact_angle:
            _refuse("contact_angle", self.contact_angle, f"0: a {self.kind} bearing has none")
        if radial and self.axial_preload:
            _refuse("axial_preload", self.axial_preload, f"0: a {self.kind} bearing has no stiffness along the axis")

    @property
    def elements(self) -> int:
        """Rollers of one row."""
        return self.rollers

    @property
    def element_diameter(self) -> float:
        """Diameter of a roller [m]."""
        return self.roller_diameter


Bearing = BallBearing | RollerBearing


@dataclass(frozen=True, eq=False)
class BearingState:
    """Loads in a bearing whose rings are held at a motion.

    Parameters
    ----------
    bearing : BallBearing or RollerBearing
    motion : (6,) array
        Of the inner ring relative to the outer one, at the middle of the bearing: x, y, z [m], tilt x, tilt y,
        rotation [rad].
    force : (6,) array
        On the inner ring from outside, which holds the motion [N, N m]; it grows with the motion.
    stiffness : (6, 6) array
        Derivative of the force by the motion, symmetric; nothing holds the rotation [N/m, N, N m/rad].
    load : (rows, elements) array
        Normal loads [N].
    angle : (rows, elements) array
        Contact angles [rad], above 0 where the inner ring is pushed along +z.
    pressure : float
        Largest pressure of Hertz, of rollers in their laminae [Pa].
    lamina_load : (rows, elements, laminae) array
        Normal loads of the laminae of rollers; a ball is one lamina [N].
    """

    bearing: Bearing
    motion: np.ndarray
    force: np.ndarray
    stiffness: np.ndarray
    load: np.ndarray
    angle: np.ndarray
    pressure: float
    lamina_load: np.ndarray


@dataclass(frozen=True)
class PointContact:
    """Hertz contact of a ball with both rings.

    Parameters
    ----------
    stiffness : float
        c_p: load over deflection to the power 3/2 [N/m^1.5].
    pressure : float
        Larger of both rings: pressure over the cube root of the load [Pa/N^(1/3)].
    axis_ratios : tuple of float
        Larger over smaller axis of the contact ellipse, inner and outer ring.
    """

    stiffness: float
    pressure: float
    axis_ratios: tuple[float, float]


def bearing_state(bearing: Bearing, motion: Sequence[float] | np.ndarray, *, first_angle: float = 0.0) -> BearingState:
    """Compute force, stiffness and element loads of a motion of the inner ring.

    Parameters
    ----------
    bearing : BallBearing or RollerBearing
        With a contact angle above 0 the inner ring carries a force along +z. The elements of both rows stand at the
        same angles.
    motion : (6,) array
        Of the inner ring relative to the outer one, at the middle of the bearing: x, y, z [m], tilt x, tilt y,
        rotation [rad].
    first_angle : float
        Of the first element from the x axis [rad]; the rotation of the ring does not move the elements.

    Returns
    -------
    BearingState
        Force and stiffness are continuous where elements lose contact.
    """
    held = checked_numbers(motion, "motion of a bearing", code="E-SHAPE", unit="m")
    if held.shape != (6,) or not np.isfinite(held).all():
        raise CaseError(f"motion of a bearing of shape {held.shape}", code="E-SHAPE", limit="six finite numbers")
    return _solved(bearing, held, first_angle)[1]


def sliding_state(bearing: Bearing, motion: Sequence[float] | np.ndarray, sense: int) -> BearingState:
    """Compute force and stiffness of a bearing of which a ring slides in its seat where it has no shoulder.

    Parameters
    ----------
    bearing : BallBearing or RollerBearing
    motion : (6,) array
        As of `bearing_state`.
    sense : {1, -1, 0}
        Of the thrust on the inner ring that the seat takes: towards +z, -z or none.

    Returns
    -------
    BearingState
        Of the motion that is left where the ring slid until it carries no thrust; with ``K`` its stiffness,
        ``K - K_z K_z^T / K_zz`` is that of the other motions. With thrust that the seat takes that of
        `bearing_state`.
    """
    state = bearing_state(bearing, motion)
    if state.stiffness[2, 2] <= 0.0 or sense * state.force[2] > 0.0:
        return state
    # where elements have lost contact the tangent reaches too far
    held, reach = np.array(motion, float), 0.1 * bearing.element_diameter
    for _ in range(_SLIDES):
        thrust, stiffness = state.force[2], state.stiffness[2, 2]
        if stiffness <= 0.0 or abs(thrust) <= 1e-12 * max(np.abs(state.force[:3]).max(), 1e-9):
            break
        held[2] += min(max(-thrust / stiffness, -reach), reach)
        state = bearing_state(bearing, held)
    force, full = state.force.copy(), state.stiffness
    row = full[2]
    reduced = full - np.outer(row, row) / row[2] if row[2] > 0.0 else full.copy()
    reduced[2], reduced[:, 2], force[2] = 0.0, 0.0, 0.0
    return replace(state, force=force, stiffness=reduced)


def solve_motion(
    bearing: Bearing, load: Sequence[float] | np.ndarray, *, first_angle: float = 0.0, relative_tolerance: float = 1e-9
) -> BearingState:
    """Find the motion of the inner ring under a load, by damped Newton steps on the potential energy.

    A direction in which nothing acts and nothing holds keeps a motion of zero. CaseError: the bearing cannot carry
    the load (E-BEARING).

    Parameters
    ----------
    bearing : BallBearing or RollerBearing
    load : (6,) array
        On the inner ring at the middle of the bearing [N, N m]; its last entry, the torque, must be zero.
    first_angle : float
        See `bearing_state`.
    relative_tolerance : float
        Largest error of the balance, over the load and what the elements carry.

    Returns
    -------
    BearingState
    """
    checked = checked_numbers(load, "load of a bearing", code="E-SHAPE", unit="N")
    if checked.shape != (6,) or checked[5]:
        raise CaseError(
            f"load of a bearing of shape {checked.shape}",
            code="E-SHAPE",
            value=checked.tolist(),
            limit="six numbers, no torque about the axis",
        )
    scale = np.array([1.0, 1.0, 1.0, *2 * (2.0 / bearing.pitch_diameter,)])
    wanted, far = checked[:5] * scale, 0.5 * bearing.element_diameter

    def at(place: np.ndarray) -> tuple[float, BearingState, np.ndarray, float]:
        energy, state = _solved(bearing, np.append(place * scale, 0.0), first_angle)
        missing = wanted - state.force[:5] * scale
        size = max(float(np.abs(wanted).max()), float(state.load.sum()), 1e-300)
        return energy - float(wanted @ place), state, missing, float(np.abs(missing).max()) / size

    place = np.zeros(5)
    energy, state, missing, error = at(place)
    damping = max(float(np.abs(missing).max()), 1e-12) / (1e-3 * bearing.element_diameter)
    for _ in range(_STEPS):
        if error <= 1e-13:
            break
        tangent = state.stiffness[:5, :5] * np.outer(scale, scale)
        step = np.linalg.solve(tangent + damping * np.eye(5), missing)
        # a step into free play is not longer than a quarter of the way that counts as apart
        step *= min(1.0, 0.25 * far / max(float(np.abs(step).max()), 1e-300))
        trial = at(place + step)
        # close to the solution differences of energies are rounding
        if trial[0] < energy or (error < _CLOSE and trial[3] < error):
            place = place + step
            energy, state, missing, error = trial
            damping *= 0.1
            if np.abs(place).max() > far:
                break
        elif error <= relative_tolerance and damping <= 1e-6 * np.abs(tangent).max():
            break
        else:
            damping *= 10.0
        damping = max(damping, 1e-13 * float(np.abs(tangent).max()), 1e-12)
    if error > relative_tolerance or np.abs(place).max() > far:
        raise CaseError(
            "the bearing cannot carry this load: its rings would move apart",
            code="E-BEARING",
            value=[float(f"{value:.6g}") for value in checked],
            limit="radial forces, thrust in the sense of the contact angle, moments",
            remedy=("turn the sign of the contact angle", "use two rows", "take a kind that carries this direction"),
        )
    return state


def _solved(bearing: Bearing, motion: np.ndarray, first_angle: float) -> tuple[float, BearingState]:
    """Potential energy [J] and state."""
    if isinstance(bearing, BallBearing):
        return _ball_state(bearing, motion, first_angle)
    return _roller_state(bearing, motion, first_angle)


def _ball_state(bearing: BallBearing, motion: np.ndarray, first_angle: float) -> tuple[float, BearingState]:
    senses, heights = _rows(bearing)
    contact = point_contact(bearing)
    radial, axial = _gradients(bearing, first_angle, heights, 0.5 * bearing.pitch_diameter)
    axial = senses[:, None, None] * axial
    free, angle = bearing.groove_distance, abs(bearing.contact_angle)
    along = free * math.cos(angle) - 0.5 * bearing.clearance + radial @ motion
    across = free * math.sin(angle) + bearing.axial_preload + axial @ motion
    if bearing.contact_angle:
        # no shoulder on the other side of the groove's bottom
        behind = across < 0.0
        across = np.where(behind, 0.0, across)
        axial = np.where(behind[..., None], 0.0, axial)
    # far away the ring leaves the ball: nothing pushes from the other side of the axis of the groove
    radial = np.where((along > 0.0)[..., None], radial, 0.0)
    along = np.maximum(along, 0.0)
    distance = np.maximum(np.hypot(along, across), 1e-3 * free)
    deflection = np.maximum(distance - free, 0.0)
    root = np.sqrt(deflection)
    load, tangent = contact.stiffness * deflection * root, 1.5 * contact.stiffness * root
    normal_r, normal_a = along / distance, across / distance
    turn = load / distance
    gradients = np.stack((radial, axial)).reshape(2, -1, 6)
    forces = np.stack((load * normal_r, load * normal_a)).reshape(2, -1)
    mixed = (tangent - turn) * normal_r * normal_a
    second = np.stack(
        (tangent * normal_r**2 + turn * normal_a**2, mixed, mixed, tangent * normal_a**2 + turn * normal_r**2)
    )
    force, stiffness = _assembled(gradients, forces, second.reshape(2, 2, -1))
    energy = 0.4 * float((load * deflection).sum())
    pressure = contact.pressure * float(load.max()) ** (1.0 / 3.0)
    angles = senses[:, None] * np.arctan2(across, along)
    return energy, BearingState(bearing, motion, force, stiffness, load, angles, pressure, load[..., None])


def _roller_state(bearing: RollerBearing, motion: np.ndarray, first_angle: float) -> tuple[float, BearingState]:
    senses, heights = _rows(bearing)
    angle = abs(bearing.contact_angle)
    places, drops, stiffness_of_lamina = _laminae(bearing)
    radial, axial = _gradients(bearing, first_angle, heights, 0.5 * bearing.pitch_diameter)
    normal = math.cos(angle) * radial + math.sin(angle) * senses[:, None, None] * axial
    if bearing.kind == "spherical":
        # the contacts are normal to a sphere about the middle of the bearing
        normal[..., 3:] = 0.0
        tilt = np.zeros_like(normal)
    else:
        tilt = np.zeros_like(normal)
        tilt[..., 3], tilt[..., 4] = -radial[..., 1], radial[..., 0]
    base = normal @ motion - 0.5 * bearing.clearance * math.cos(angle) + bearing.axial_preload * math.sin(angle)
    deflection = np.maximum(base[..., None] + (tilt @ motion)[..., None] * places - drops, 0.0)
    slope = stiffness_of_lamina * np.cbrt(np.cbrt(deflection))
    lamina_load, tangent = slope * deflection, LINE_EXPONENT * slope
    load = lamina_load.sum(axis=-1)
    gradients = np.stack((normal, tilt)).reshape(2, -1, 6)
    forces = np.stack((load, lamina_load @ places)).reshape(2, -1)
    mixed = tangent @ places
    second = np.stack((tangent.sum(axis=-1), mixed, mixed, tangent @ places**2)).reshape(2, 2, -1)
    force, stiffness = _assembled(gradients, forces, second)
    energy = float((lamina_load * deflection).sum()) / (LINE_EXPONENT + 1.0)
    pressure = _line_pressure(bearing) * math.sqrt(
        float(lamina_load.max()) * bearing.laminae / bearing.effective_length
    )
    angles = np.broadcast_to(senses[:, None] * angle, load.shape)
    return energy, BearingState(bearing, motion, force, stiffness, load, angles, pressure, lamina_load)


def _rows(bearing: Bearing) -> tuple[np.ndarray, np.ndarray]:
    """Sense (rows,) in which each row carries along the axis, and its height (rows,) above the middle [m]."""
    first = -1.0 if bearing.contact_angle < 0.0 else 1.0
    senses = np.array([first, -first][: bearing.rows])
    return senses, -0.5 * bearing.row_distance * senses if bearing.rows == 2 else np.zeros(1)


def _gradients(
    bearing: Bearing, first_angle: float, heights: np.ndarray, radius: float
) -> tuple[np.ndarray, np.ndarray]:
    """Radial and axial displacement at every element by the motion of the ring, (rows, elements, 6) each."""
    angles = first_angle + 2.0 * math.pi / bearing.elements * np.arange(bearing.elements)
    cosine, sine = np.cos(angles), np.sin(angles)
    radial = np.zeros((len(heights), bearing.elements, 6))
    axial = np.zeros_like(radial)
    radial[..., 0], radial[..., 1] = cosine, sine
    radial[..., 3], radial[..., 4] = -np.outer(heights, sine), np.outer(heights, cosine)
    axial[..., 2], axial[..., 3], axial[..., 4] = 1.0, radius * sine, -radius * cosine
    return radial, axial


def _assembled(gradients: np.ndarray, forces: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Force (6,) and stiffness (6, 6) of two displacements (2, elements, 6) whose energy has these derivatives."""
    force = forces[0] @ gradients[0] + forces[1] @ gradients[1]
    weighted = (second[:, :, :, None] * gradients[None]).sum(axis=1)
    stiffness = gradients[0].T @ weighted[0] + gradients[1].T @ weighted[1]
    return force, 0.5 * (stiffness + stiffness.T)


@lru_cache(maxsize=256)
def point_contact(bearing: BallBearing) -> PointContact:
    """Find c_p and the pressure of a ball between its grooves (Hertz; ISO/TS 16281, section 4).

    The standard rounds pi sqrt(2) / 3 = 1.48096 of c_p to 1.48.
    """
    from scipy.special import ellipe, ellipk

    gamma = bearing.ball_diameter * math.cos(bearing.contact_angle) / bearing.pitch_diameter
    modulus = bearing.youngs_modulus / (1.0 - bearing.poisson_ratio**2)
    total, pressures, ratios = 0.0, [], []
    for sign, osculation in ((1.0, bearing.inner_osculation), (-1.0, bearing.outer_osculation)):
        rolling = sign * gamma / (1.0 - sign * gamma)
        groove = 0.5 / osculation
        curvature = 2.0 / bearing.ball_diameter * (2.0 + rolling - groove)
        ratio = _axis_ratio((rolling + groove) / (2.0 + rolling - groove))
        first, second = float(ellipk(1.0 - ratio**-2)), float(ellipe(1.0 - ratio**-2))
        total += first * (curvature / (ratio**2 * second)) ** (1.0 / 3.0)
        half_axes = (6.0 * second / (math.pi * ratio * modulus * curvature)) ** (1.0 / 3.0)
        pressures.append(1.5 / (math.pi * ratio * half_axes**2))
        ratios.append(ratio)
    return PointContact(_POINT_COEFFICIENT * modulus * total**-1.5, max(pressures), (ratios[0], ratios[1]))


def _axis_ratio(difference: float) -> float:
    """Axis ratio of the contact ellipse of two bodies with a relative difference of curvatures."""
    from scipy.optimize import brentq
    from scipy.special import ellipe, ellipk

    def missing(logarithm: float) -> float:
        m = -math.expm1(-2.0 * logarithm)
        # (K / E - 1) / (chi^2 - 1) with chi^2 - 1 = m / (1 - m)
        return 1.0 - 2.0 * (1.0 - m) / m * (ellipk(m) / ellipe(m) - 1.0) - difference

    return math.exp(brentq(missing, 1e-4, 12.0, xtol=1e-14))  # type: ignore[arg-type]


@lru_cache(maxsize=256)
def _laminae(bearing: RollerBearing) -> tuple[np.ndarray, np.ndarray, float]:
    """Places (n,) and drops (n,) of both contacts [m], and the stiffness of a lamina [N/m^(10/9)]."""
    length, diameter, count = bearing.effective_length, bearing.roller_diameter, bearing.laminae
    places = (np.arange(count) - 0.5 * (count - 1)) * length / count
    drops = np.zeros(count)
    if bearing.profile == "logarithmic":
        share = np.abs(2.0 * places / length)
        if bearing.kind == "tapered":
            drops = -0.00045 * diameter * np.log1p(-(share**2))
        elif length <= 2.5 * diameter:
            drops = -0.00035 * diameter * np.log1p(-(share**2))
        else:
            ends = np.maximum((2.0 * np.abs(places) - (length - 2.5 * diameter)) / (2.5 * diameter), 0.0)
            drops = -0.0005 * diameter * np.log1p(-(ends**2))
    return places, 2.0 * drops, LINE_STIFFNESS * length ** (8.0 / 9.0) / count


def _line_pressure(bearing: RollerBearing) -> float:
    """Pressure of a roller on the inner ring over the square root of its load per length (Hertz)."""
    gamma = bearing.roller_diameter * math.cos(bearing.contact_angle) / bearing.pitch_diameter
    modulus = 0.5 * STEEL_MODULUS / (1.0 - STEEL_POISSON**2)
    radius = 0.5 * bearing.roller_diameter * (1.0 - gamma)
    return math.sqrt(modulus / (math.pi * radius))


def _check_common(bearing: Bearing, count_name: str, count: int, diameter_name: str, diameter: float) -> None:
    checked_count(count, count_name, code="E-BEARING", least=3)
    names = ("pitch_diameter", "contact_angle", "clearance", "axial_preload", "row_distance")
    for name, value in ((diameter_name, diameter), *((name, getattr(bearing, name)) for name in names)):
        if not math.isfinite(value):
            _refuse(name, value, "a finite number")
    if diameter <= 0.0:
        _refuse(diameter_name, diameter, "above 0 m")
    if bearing.pitch_diameter * math.sin(math.pi / count) < diameter:
        least = diameter / math.sin(math.pi / count)
        _refuse("pitch_diameter", bearing.pitch_diameter, f"{least:.6g} m or more: {count} elements touch each other")
    if abs(bearing.contact_angle) > 0.5 * math.pi:
        _refuse("contact_angle", bearing.contact_angle, "-pi/2 to pi/2 rad")
    if bearing.rows not in (1, 2):
        _refuse("rows", bearing.rows, "1 or 2")
    if bearing.rows == 1 and bearing.row_distance:
        _refuse("row_distance", bearing.row_distance, "0 with one row")


def _refuse(name: str, value: object, limit: str) -> NoReturn:
    raise CaseError(f"{name} of a bearing is {value}", code="E-BEARING", key=name, value=value, limit=limit)
