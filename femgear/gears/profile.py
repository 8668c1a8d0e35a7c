"""Tooth profiles: involute relations, and the root fillets that racks and pinion cutters generate.

Lengths share one unit (metres elsewhere in femgear), angles are radians. Internal gears have positive
tooth numbers, and their profile shift is positive when it moves the flank outwards, to larger radii
(ISO 21771 prints the opposite sign).

A fillet is the envelope of the rounded tip of its tool. A circle of radius ``rounding`` is fixed in the tool;
gear and tool roll on their pitch circles. The circle touches its envelope where the common normal passes
through the pitch point (law of gearing), so the direction ``theta`` of that normal, measured from the line of
centres, is a parameter of the fillet: 0 at the root circle and ``end_angle`` where the tool's flank begins.
Gear frame: tooth centreline on the x axis; the fillet is that of the left flank (y > 0), its gap is centred
at ``gap_angle``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from femgear.errors import GeometryError

# coefficients of x^19, x^17, .. x^3 in the Taylor series of tan(x) (DLMF 4.19.3)
_TANGENT_SERIES = (
    443861162 / 1856156927625,
    6404582 / 10854718875,
    929569 / 638512875,
    21844 / 6081075,
    1382 / 155925,
    62 / 2835,
    17 / 315,
    2 / 15,
    1 / 3,
)


_SERIES_BELOW = 0.15
"""Pressure angle [rad]."""


def inv(angle) -> Any:
    """Compute the involute function ``tan(angle) - angle`` [rad] (ISO 21771, eq. 9).

    The pressure angle [rad], float or array, lies between ``-pi/2`` and ``pi/2``.
    """
    if isinstance(angle, float):
        return _inv_of_float(angle)
    a = np.asarray(angle, dtype=float)
    # the difference loses digits below 0.15 rad, where these terms of the series are exact to rounding
    return _plain(np.where(np.abs(a) < _SERIES_BELOW, a**3 * np.polyval(_TANGENT_SERIES, a * a), np.tan(a) - a))


def _inv_of_float(angle: float) -> float:
    """Compute `inv` of a single angle, without the arrays that take a hundred times as long."""
    if abs(angle) >= _SERIES_BELOW:
        return float(np.tan(angle)) - angle
    square, series = angle * angle, 0.0
    for coefficient in _TANGENT_SERIES:
        series = series * square + coefficient
    return float(np.power(angle, 3)) * series


def _plain(value: np.ndarray) -> Any:
    """A float for an array without dimensions."""
    return float(value) if value.ndim == 0 else value


def arcinv(value) -> Any:
    """Find the pressure angle [rad] in [0, pi/2) of an involute [rad] (array of any shape), inverse of `inv`.

    Raises
    ------
    GeometryError
        Negative or not finite value: no such flank point (E-GEOMETRY).
    """
    v = np.asarray(value, dtype=float)
    if not np.all(np.isfinite(v)) or np.any(v < 0.0):
        raise GeometryError(
            f"no pressure angle has the involute {float(np.min(v)):.6g} rad",
            code="E-GEOMETRY",
            limit="inv(angle) >= 0",
            remedy="increase the sum of the profile shifts or the centre distance",
        )
    # start: small-angle root below one, tan(a) = v + a with a near pi/2 above
    a = np.where(v < 1.0, np.cbrt(3.0 * v) / (1.0 + 0.26 * np.cbrt(v) ** 2), np.arctan(v + math.pi / 2))
    for _ in range(30):
        tangent = np.tan(a)
        slope = np.where(tangent == 0.0, 1.0, tangent * tangent)
        step = (np.asarray(inv(a)) - v) / slope
        a = np.clip(a - step, 0.0, np.nextafter(math.pi / 2, 0.0))
        if np.all(np.abs(step) <= 2e-16 * np.maximum(a, 1e-300)):
            break
    return _plain(np.where(v == 0.0, 0.0, a))


def pressure_angle_at(radius, base_radius: float) -> Any:
    """Compute the pressure angle [rad] of an involute at a radius [m], ``cos(alpha) = r_b / r``.

    ``radius`` (float or array) must not be smaller than ``base_radius`` [m].
    """
    return _plain(np.arctan2(roll(radius, base_radius), base_radius))


def roll(radius, base_radius: float) -> Any:
    """Compute the roll length ``sqrt(r^2 - rb^2)`` [m] from the base tangent point to the flank point.

    At radii (...) [m] of the base radius [m] or more.
    """
    r = np.asarray(radius, dtype=float)
    return _plain(np.sqrt(np.maximum((r - base_radius) * (r + base_radius), 0.0)))


def undercut_shift(teeth: int, pressure_angle: float) -> float:
    """Compute the least profile shift [modules] without undercut, ``1 - z sin^2(alpha)/2``.

    For a rack one module deep, the pressure angle alpha in rad.
    """
    return 1.0 - 0.5 * teeth * math.sin(pressure_angle) ** 2


def transverse_angle(normal_pressure_angle: float, helix_angle: float) -> float:
    """Compute the transverse pressure angle, ``tan(alpha_t) = tan(alpha_n) / cos(beta)``, all in rad."""
    return math.atan(math.tan(normal_pressure_angle) / math.cos(helix_angle))


def transverse_tool(module: float, pressure_angle: float, helix_angle: float) -> tuple[float, float]:
    """Compute ``m_t = m_n / cos(beta)`` [m] and `transverse_angle` [rad] (ISO 21771, section 4.2)."""
    return module / math.cos(helix_angle), transverse_angle(pressure_angle, helix_angle)


def base_helix_angle(normal_pressure_angle: float, helix_angle: float) -> float:
    """Compute the helix angle on the base cylinder, ``sin(beta_b) = sin(beta) cos(alpha_n)``, all in rad."""
    return math.asin(math.sin(helix_angle) * math.cos(normal_pressure_angle))


def overlap_ratio(face_width: float, normal_module: float, helix_angle: float) -> float:
    """Compute the overlap ratio ``b sin|beta| / (pi m_n)``, width and module in m, helix angle in rad."""
    return face_width * math.sin(abs(helix_angle)) / (math.pi * normal_module)


@dataclass(frozen=True)
class BasicRack:
    """Basic rack; the defaults are profile C of ISO 53.

    ``addendum``, ``dedendum`` and ``root_radius``, the radius of the rounding that cuts the fillet, are in modules.
    ``stretch`` is how much wider than high the rounded tip is: 1, and ``1/cos(beta)`` in the transverse
    section of helical teeth, in which the circle of the normal section is an ellipse.
    """

    addendum: float = 1.0
    dedendum: float = 1.25
    root_radius: float = 0.25
    stretch: float = 1.0


ISO_53_C = BasicRack()


@dataclass(frozen=True)
class PinionCutter:
    """Pinion cutter of so many ``teeth`` that generates the gaps of an internal gear.

    ``profile_shift`` in modules is 0 when it is half worn, ``tip_radius`` in modules rounds its tips; None
    takes the basic rack's ``root_radius``.
    """

    teeth: int
    profile_shift: float = 0.0
    tip_radius: float | None = None


def transverse_rack(rack: BasicRack, helix_angle: float) -> BasicRack:
    """Make the transverse basic rack of a normal one: coefficients times cos(beta), beta in rad.

    Heights are the same lengths in both sections (ISO 21771, section 4.2): the rounded tip is an ellipse in
    the transverse section, as high as the circle of the normal section and ``1/cos(beta)`` times as wide.
    """
    factor = math.cos(helix_angle)
    heights = (rack.addendum * factor, rack.dedendum * factor, rack.root_radius * factor)
    return BasicRack(*heights, stretch=rack.stretch / factor)


def normal_of_ellipse(angle, stretch: float) -> Any:
    """Find the direction [rad] of a stretched circle's normal where that of the circle is ``angle`` [rad].

    Both against the axis in which nothing is stretched, in -pi/2 .. pi/2. A stretch below one leads back.
    """
    return np.arctan2(np.sin(angle), stretch * np.cos(angle))


@dataclass(frozen=True)
class RackTip:
    """Rounded tip of a rack that generates an external gear (lengths in m, angles in rad).

    ``pitch_radius`` is that of the gear, ``gap_angle`` its half pitch. ``centre_depth`` and ``centre_offset``
    place the rounding's centre under the rolling line and beside the centreline of the rack tooth; the fillet
    begins at ``end_angle``, see the head of the module. ``rounding`` is half the height of the rounding,
    whose width is ``stretch`` times that, see `BasicRack`.
    """

    pitch_radius: float
    centre_depth: float
    centre_offset: float
    rounding: float
    gap_angle: float
    end_angle: float
    stretch: float = 1.0

    @property
    def room(self) -> float:
        """Space between the rounded corners of the tip [m]; none where negative."""
        return self.centre_offset

    def fillet_point(self, theta) -> tuple[np.ndarray, np.ndarray]:
        """Compute radius [m] and angle [rad] (...) of fillet points at theta (...) [rad]: `CutterTip.fillet_point`."""
        theta = np.asarray(theta, dtype=float)
        rounded = normal_of_ellipse(theta, 1.0 / self.stretch)
        depth = self.centre_depth + self.rounding * np.cos(rounded)
        # tool centreline at tangential travel s from the pitch point; the gear has turned by s / r
        y = -depth * np.tan(theta)
        lateral = y + self.stretch * self.rounding * np.sin(rounded)
        travel = (lateral + self.centre_offset) / self.pitch_radius
        x = self.pitch_radius - depth
        return np.hypot(x, y), np.arctan2(y, x) + self.gap_angle - travel

    @property
    def junction_roll(self) -> float:
        """Roll length [m] of the gear's involute where the tool's flank ends and its rounding begins.

        Negative for a rack that reaches below the base circle's tangent point: the tooth is undercut. The
        rounding ends ``rho (1 - sin(alpha_n))`` above the tip of the tool (ISO 21771, root form diameter).
        """
        sine = math.cos(self.end_angle)  # of the working pressure angle of generation
        rounded = float(normal_of_ellipse(self.end_angle, 1.0 / self.stretch))
        return self.pitch_radius * sine - (self.centre_depth + self.rounding * math.cos(rounded)) / sine

    def undercut_end(self, base_radius: float, base_half_angle: float) -> float:
        """Find the direction ``theta`` [rad] where the fillet of an undercut tooth crosses the involute.

        From the base radius [m] and the half-thickness angle there [rad]. The crossing is bracketed on the
        part of the fillet outside the base circle and refined by bisection to the last bit.
        """

        def excess(radius, angle):
            return angle - (base_half_angle - inv(pressure_angle_at(radius, base_radius)))

        theta = np.linspace(0.0, self.end_angle, 4001)
        radius, angle = self.fillet_point(theta)
        value = np.where(radius >= base_radius, excess(radius, angle), -np.inf)
        first = int(np.argmax(value >= 0.0))
        low, high = theta[max(first - 1, 0)], theta[first]
        for _ in range(100):
            middle = 0.5 * (low + high)
            radius, angle = self.fillet_point(middle)
            inside = float(radius) < base_radius or float(excess(radius, angle)) < 0.0
            if middle == (low if inside else high):
                break
            low, high = (middle, high) if inside else (low, middle)
        return float(high)


@dataclass(frozen=True)
class CutterTip:
    """Rounded tip of a pinion cutter that generates an internal gear.

    Parameters
    ----------
    pitch_radius, cutter_pitch_radius : float
        Radii of the circles of gear and cutter that roll on each other [m].
    cutter_base_radius : float
        Base radius of the cutter [m].
    centre_distance : float
        Distance of the axes of gear and cutter [m].
    centre_radius, centre_angle : float
        Polar coordinates of the centre of the rounding in the frame of the cutter tooth [m], [rad].
    rounding : float
        Half the height of the rounding [m].
    gap_angle : float
        Angle of the gap's centreline from that of the tooth, half a pitch of the gear [rad].
    end_angle : float
        Direction of the normal where the fillet ends at the flank [rad].
    stretch : float
        Width of the rounding, at right angles to the radius through its centre, over its height [1].
    """

    pitch_radius: float
    cutter_pitch_radius: float
    cutter_base_radius: float
    centre_distance: float
    centre_radius: float
    centre_angle: float
    rounding: float
    gap_angle: float
    end_angle: float
    stretch: float = 1.0

    @property
    def room(self) -> float:
        """Angle between the rounded corners of the tip [rad]; none where negative."""
        return self.centre_angle if self.centre_radius > self.cutter_base_radius else -1.0

    def fillet_point(self, theta) -> tuple[np.ndarray, np.ndarray]:
        """Compute radius [m] and angle [rad] in the gear frame of fillet points, from the law of gearing.

        The direction `theta` [rad] of the normal, of any shape, is 0 at the root circle and `end_angle` at
        the flank (Litvin, Gear Geometry and Applied Theory, ch. 6).
        """
        theta = np.asarray(theta, dtype=float)
        r = self.cutter_pitch_radius
        normal, along, _ = cutter_rounding(r * np.sin(theta), self.centre_radius, self.rounding, self.stretch)
        reach = along - r * np.cos(theta)  # from the pitch point
        cutter_angle = normal - theta + self.centre_angle
        travel = cutter_angle * r / self.pitch_radius
        x = self.pitch_radius + reach * np.cos(theta)
        y = -reach * np.sin(theta)
        return np.hypot(x, y), np.arctan2(y, x) + self.gap_angle - travel

    @property
    def junction_roll(self) -> float:
        """Roll length [m] of the gear's involute where the tool's flank ends and its rounding begins."""
        _, cutter_roll, _ = cutter_rounding(self.cutter_base_radius, self.centre_radius, self.rounding, self.stretch)
        return float(cutter_roll) + self.centre_distance * math.cos(self.end_angle)


def cutter_rounding(distance, centre_radius: float, rounding: float, stretch: float) -> tuple[Any, Any, Any]:
    """Find the point of a cutter's rounded tip whose normal passes the axis of the cutter at a distance.

    Parameters
    ----------
    distance : float or (...) array
        Between normal and axis [m], from 0 to the centre's radius; beyond it the nearest point is given.
    centre_radius, rounding, stretch : float
        As of `CutterTip` [m, m, 1].

    Returns
    -------
    normal, along, angle : float or (...) array
        Angle of the normal against the radius through the centre of the rounding [rad], place of the point
        along the normal from the foot of the perpendicular from the axis [m], and angle of the point at the
        axis from that radius [rad].
    """
    distance = np.asarray(distance, dtype=float)
    rounded = np.arcsin(np.minimum(distance / centre_radius, 1.0))
    if stretch != 1.0:
        rounded = normal_of_ellipse(rounded, 1.0 / stretch)
    for _ in range(0 if stretch == 1.0 else 50):
        normal = normal_of_ellipse(rounded, stretch)
        radial, lateral = centre_radius + rounding * np.cos(rounded), rounding * stretch * np.sin(rounded)
        excess = radial * np.sin(normal) - lateral * np.cos(normal) - distance
        turning = stretch / (stretch**2 * np.cos(rounded) ** 2 + np.sin(rounded) ** 2)
        along = radial * np.cos(normal) + lateral * np.sin(normal)
        speed = rounding * np.hypot(np.sin(rounded), stretch * np.cos(rounded))
        step = excess / np.maximum(along * turning - speed, 1e-3 * centre_radius)
        rounded = np.clip(rounded - step, 0.0, 0.5 * math.pi)
        if np.all(np.abs(step) < 1e-15):
            break
    normal = normal_of_ellipse(rounded, stretch)
    radial, lateral = centre_radius + rounding * np.cos(rounded), rounding * stretch * np.sin(rounded)
    along = radial * np.cos(normal) + lateral * np.sin(normal)
    return normal, along, np.arctan2(lateral, radial)
