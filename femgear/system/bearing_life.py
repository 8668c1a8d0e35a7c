"""Life of rolling bearings (ISO 281:2007, ISO/TS 16281:2008), and the orders at which their parts pass.

The basic rating life takes forces and a dynamic rating from a catalogue. The reference rating life takes the load of
every rolling element, and with it clearance, preload, tilt and the stiffness around the bearing. Both are for 90 %
reliability, in millions of turns of the rings relative to each other. `life_factor` multiplies either.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError
from femgear.gears.micropitting import kinematic_viscosity
from femgear.system.rolling_bearings import THRUST_ANGLE, BallBearing, Bearing, BearingState

LARGEST_LIFE_FACTOR = 50.0
VISCOSITY_RATIOS = (0.1, 4.0)
"""Range of kappa in ISO 281; above it the upper end counts."""
_MILLION_NEWTON = 1e6  # N/m^2 in N/mm^2, in which ISO 281 gives relative axial loads
# ISO 281, Table 3: relative axial load F_a / (i Z D_w^2) [N/mm^2], with the nominal angle 0, else F_a / (Z D_w^2)
_AXIAL = (0.172, 0.345, 0.689, 1.03, 1.38, 2.07, 3.45, 5.17, 6.89)
# contact angle [deg]: e, X and Y of one row above e, then Y below e, X and Y above e of two rows
_BALL_FACTORS = {
    0: (
        (0.19, 0.22, 0.26, 0.28, 0.30, 0.34, 0.38, 0.42, 0.44),
        0.56,
        (2.30, 1.99, 1.71, 1.55, 1.45, 1.31, 1.15, 1.04, 1.00),
        0.0,
        0.56,
        (2.30, 1.99, 1.71, 1.55, 1.45, 1.31, 1.15, 1.04, 1.00),
    ),
    5: (
        (0.23, 0.26, 0.30, 0.34, 0.36, 0.40, 0.45, 0.50, 0.52),
        0.56,
        (2.30, 1.99, 1.71, 1.55, 1.45, 1.31, 1.15, 1.04, 1.00),
        (2.78, 2.40, 2.07, 1.87, 1.75, 1.58, 1.39, 1.26, 1.21),
        0.78,
        (3.74, 3.23, 2.78, 2.52, 2.36, 2.13, 1.87, 1.69, 1.63),
    ),
    10: (
        (0.29, 0.32, 0.36, 0.38, 0.40, 0.44, 0.49, 0.54, 0.54),
        0.46,
        (1.88, 1.71, 1.52, 1.41, 1.34, 1.23, 1.10, 1.01, 1.00),
        (2.18, 1.98, 1.76, 1.63, 1.55, 1.42, 1.27, 1.17, 1.16),
        0.75,
        (3.06, 2.78, 2.47, 2.29, 2.18, 2.00, 1.79, 1.64, 1.63),
    ),
    15: (
        (0.38, 0.40, 0.43, 0.46, 0.47, 0.50, 0.55, 0.56, 0.56),
        0.44,
        (1.47, 1.40, 1.30, 1.23, 1.19, 1.12, 1.02, 1.00, 1.00),
        (1.65, 1.57, 1.46, 1.38, 1.34, 1.26, 1.14, 1.12, 1.12),
        0.72,
        (2.39, 2.28, 2.11, 2.00, 1.93, 1.82, 1.66, 1.63, 1.63),
    ),
    20: (0.57, 0.43, 1.00, 1.09, 0.70, 1.63),
    25: (0.68, 0.41, 0.87, 0.92, 0.67, 1.41),
    30: (0.80, 0.39, 0.76, 0.78, 0.63, 1.24),
    35: (0.95, 0.37, 0.66, 0.66, 0.60, 1.07),
    40: (1.14, 0.35, 0.57, 0.55, 0.57, 0.93),
    45: (1.34, 0.33, 0.50, 0.47, 0.54, 0.81),
}
# ISO 281, 9.3.3: lower end of the range of kappa, minuend b, its subtrahend c / kappa^d; balls, then rollers
_BALL_LIFE = ((0.1, 2.5671, 2.2649, 0.054381), (0.4, 2.5671, 1.9987, 0.19087), (1.0, 2.5671, 1.9987, 0.071739))
_ROLLER_LIFE = ((0.1, 1.5859, 1.3993, 0.054381), (0.4, 1.5859, 1.2348, 0.19087), (1.0, 1.5859, 1.2348, 0.071739))


@dataclass(frozen=True)
class LoadFactors:
    """Factors of the equivalent load ``P = X F_r + Y F_a`` (ISO 281).

    Parameters
    ----------
    limit : float
        e: the load ratio F_a / F_r up to which the factors below it hold.
    below, above : (float, float)
        X and Y up to e, and beyond it.
    """

    limit: float
    below: tuple[float, float]
    above: tuple[float, float]


@dataclass(frozen=True)
class PassingOrders:
    """Orders of a bearing without slip, per turn of the inner ring relative to the outer one.

    Parameters
    ----------
    elements : int
        Rolling elements of one row.
    cage : float
        Turns of the cage relative to the outer ring.
    outer, inner : float
        Elements that pass a point of the outer, and of the inner ring.
    spin : float
        Turns of an element about its own axis in the cage. A defect of it strikes twice as often.
    """

    elements: int
    cage: float
    outer: float
    inner: float
    spin: float

    def cage_speed(self, inner_speed: float, outer_speed: float = 0.0) -> float:
        """Find the speed of the cage in space from those of the rings, in their unit."""
        return outer_speed + self.cage * (inner_speed - outer_speed)

    def frequencies(self, inner_speed: float, outer_speed: float = 0.0) -> dict[str, float]:
        """List the frequencies "cage", "outer", "inner" and "spin" of two speeds of the rings.

        All in the unit of the speeds and positive. The cage's is that in space; the others see the rings and the
        cage, whatever these do in space.
        """
        relative = abs(inner_speed - outer_speed)
        parts = {"outer": self.outer, "inner": self.inner, "spin": self.spin}
        return {"cage": abs(self.cage_speed(inner_speed, outer_speed))} | {k: v * relative for k, v in parts.items()}


def passing_orders(bearing: Bearing) -> PassingOrders:
    """Find the orders of cage, rings and rolling elements from the geometry, all rolling without slip."""
    ratio = _diameter_ratio(bearing)
    count = bearing.elements
    spin = 0.5 * bearing.pitch_diameter / bearing.element_diameter * (1.0 - ratio**2)
    return PassingOrders(count, 0.5 * (1.0 - ratio), 0.5 * count * (1.0 - ratio), 0.5 * count * (1.0 + ratio), spin)


def life_exponent(bearing: Bearing) -> float:
    """Exponent p of ``L = (C / P)^p``: 3 of ball and 10/3 of roller bearings."""
    return 3.0 if isinstance(bearing, BallBearing) else 10.0 / 3.0


def load_factors(bearing: Bearing, axial: float) -> LoadFactors:
    """Look up X, Y and e of ISO 281 (Tables 3, 5, 7 and 8), between its angles and loads by straight lines.

    Parameters
    ----------
    bearing : BallBearing or RollerBearing
        Two rows are those of a double-row bearing, or of a pair back to back or face to face.
    axial : float
        Thrust of the whole bearing [N], of which the factors of ball bearings below 20 degrees depend.
    """
    angle = abs(bearing.contact_angle)
    sine, tangent = math.sin(angle), math.tan(min(angle, 0.5 * math.pi - 1e-9))
    if isinstance(bearing, BallBearing):
        if angle <= THRUST_ANGLE:
            return _ball_factors(bearing, axial)
        below = (20.0 / 13.0 * tangent * (1.0 - sine / 3.0), 10.0 / 13.0 * (1.0 - sine / 3.0))
        return _thrust_factors(bearing, 1.25 * tangent, below, (1.25 * tangent * (1.0 - 2.0 / 3.0 * sine), 1.0))
    if angle > THRUST_ANGLE:
        return _thrust_factors(bearing, 1.5 * tangent, (1.5 * tangent, 0.67), (tangent, 1.0))
    if angle == 0.0:
        return LoadFactors(math.inf, (1.0, 0.0), (1.0, 0.0))
    if bearing.rows == 1:
        return LoadFactors(1.5 * tangent, (1.0, 0.0), (0.4, 0.4 / tangent))
    return LoadFactors(1.5 * tangent, (1.0, 0.45 / tangent), (0.67, 0.67 / tangent))


def equivalent_load(bearing: Bearing, radial: float, axial: float) -> float:
    """Find the equivalent dynamic load P [N] of ISO 281.

    Parameters
    ----------
    bearing : BallBearing or RollerBearing
    radial, axial : float
        Sizes of the forces on the whole bearing [N]. A cylindrical or needle bearing has no factor for a thrust.
    """
    if not (math.isfinite(radial) and math.isfinite(axial) and radial >= 0.0 and axial >= 0.0):
        raise CaseError(f"forces of {radial} N and {axial} N", code="E-RANGE", limit="0 N or more")
    factors = load_factors(bearing, axial)
    x, y = factors.above if axial > factors.limit * radial else factors.below
    return x * radial + y * axial


def basic_rating_life(bearing: Bearing, radial: float, axial: float, dynamic_rating: float) -> float:
    """Compute L10 of ISO 281 in millions of turns.

    Parameters
    ----------
    bearing : BallBearing or RollerBearing
    radial, axial : float
        Sizes of the forces on the whole bearing [N].
    dynamic_rating : float
        Basic dynamic load rating C of the whole bearing, from a catalogue [N].

    Returns
    -------
    float
        Infinite without load.
    """
    load = equivalent_load(bearing, radial, axial)
    return math.inf if load == 0.0 else (_checked_rating(dynamic_rating) / load) ** life_exponent(bearing)


def reference_rating_life(
    states: BearingState | Sequence[BearingState], dynamic_rating: float, *, rotating: str = "inner"
) -> float:
    """Compute L10r of ISO/TS 16281 in millions of turns from the load of every rolling element.

    Parameters
    ----------
    states : BearingState or sequence of it
        One state, or states over a turn, each as long as the others.
    dynamic_rating : float
        Basic dynamic load rating C of the whole bearing, from a catalogue [N].
    rotating : str
        "inner" or "outer": the ring that turns against the load.

    Returns
    -------
    float
        Infinite without load.
    """
    chosen = [states] if isinstance(states, BearingState) else list(states)
    if not chosen or any(state.bearing != chosen[0].bearing for state in chosen):
        raise CaseError(f"{len(chosen)} states of bearings", code="E-COUNT", limit="one or more, of one bearing")
    if rotating not in ("inner", "outer"):
        raise CaseError(f"rotating ring {rotating!r}", code="E-CHOICE", limit="inner or outer")
    bearing, rating = chosen[0].bearing, _checked_rating(dynamic_rating)
    # (states * elements, rows, laminae)
    loads = np.concatenate([np.moveaxis(state.lamina_load, 0, 1) for state in chosen])
    if isinstance(bearing, BallBearing):
        weibull, turning, still = 10.0 / 9.0, 3.0, 10.0 / 3.0
        capacities, rises = _ball_capacities(bearing, rating), np.ones(1)
    else:
        weibull, turning, still = 9.0 / 8.0, 4.0, 4.5
        capacities, rises = _lamina_capacities(bearing, rating), _edge_factors(bearing.laminae)
    exponents = (turning, still) if rotating == "inner" else (still, turning)
    damage = 0.0
    for capacity, exponent in zip(capacities, exponents):
        mean = ((rises * loads) ** exponent).mean(axis=0) ** (1.0 / exponent)
        damage += float(((mean / capacity) ** (turning * weibull)).sum())
    return math.inf if damage == 0.0 else damage ** (-1.0 / weibull)


def reference_load(bearing: Bearing, life: float, dynamic_rating: float) -> float:
    """Find the load P_ref [N] whose basic rating life is a given one [millions of turns] (ISO/TS 16281)."""
    return 0.0 if math.isinf(life) else _checked_rating(dynamic_rating) / life ** (1.0 / life_exponent(bearing))


def life_factor(bearing: Bearing, viscosity_ratio: float, contamination: float, load_ratio: float) -> float:
    """Compute the life modification factor a_ISO of ISO 281.

    CaseError: a viscosity ratio below 0.1, which ISO 281 leaves out, or another number out of its range (E-RANGE).

    Parameters
    ----------
    bearing : BallBearing or RollerBearing
        Radial bearing up to a contact angle of 45 degrees, else thrust bearing.
    viscosity_ratio : float
        kappa, viscosity in operation over the one needed; 0.1 or more, above 4 as 4.
    contamination : float
        e_C, from 0 (severe) to 1 (extreme cleanliness).
    load_ratio : float
        Fatigue load limit over equivalent load, C_u / P.

    Returns
    -------
    float
        0.1 to 50.
    """
    for name, value, most in (
        ("viscosity_ratio", viscosity_ratio, math.inf),
        ("contamination", contamination, 1.0),
        ("load_ratio", load_ratio, math.inf),
    ):
        least = VISCOSITY_RATIOS[0] if name == "viscosity_ratio" else 0.0
        if not least <= value <= most:
            limit = f"{least:g} to 1" if most == 1.0 else f"{least:g} or more"
            raise CaseError(f"{name} of {value}", code="E-RANGE", key=name, value=value, limit=limit)
    balls, thrust = isinstance(bearing, BallBearing), abs(bearing.contact_angle) > THRUST_ANGLE
    kappa = min(viscosity_ratio, VISCOSITY_RATIOS[1])
    ranges = _BALL_LIFE if balls else _ROLLER_LIFE
    _, minuend, coefficient, power = [row for row in ranges if kappa >= row[0]][-1]
    lubrication = (minuend - coefficient / kappa**power) ** (0.83 if balls else 1.0)
    divisor, share, exponent = (
        ((3.0 if thrust else 1.0), 1.0 / 3.0, -9.3) if balls else ((2.5 if thrust else 1.0), 0.4, -9.185)
    )
    bracket = 1.0 - lubrication * (contamination * load_ratio / divisor) ** share
    return LARGEST_LIFE_FACTOR if bracket <= 0.0 else min(0.1 * bracket**exponent, LARGEST_LIFE_FACTOR)


def reference_viscosity(pitch_diameter: float, speed: float) -> float:
    """Compute the viscosity nu_1 that a bearing needs [m^2/s] (ISO 281), from its pitch diameter [m] and speed [rad/s].

    ``nu_1 = 45000 n^-0.83 D_pw^-0.5`` below 1000 rpm, ``4500 n^-0.5 D_pw^-0.5`` from there on [mm^2/s, rpm, mm].
    """
    if not (pitch_diameter > 0.0 and speed > 0.0):
        raise CaseError(f"a pitch diameter of {pitch_diameter} m and {speed} rad/s", code="E-RANGE", limit="above 0")
    turns = speed * 30.0 / math.pi
    factor = 45000.0 * turns**-0.83 if turns < 1000.0 else 4500.0 * turns**-0.5
    return 1e-6 * factor / math.sqrt(1e3 * pitch_diameter)


def oil_viscosity(at_40: float, at_100: float, temperature: float) -> float:
    """Compute the kinematic viscosity of an oil [m^2/s] at a temperature [degrees Celsius] (ASTM D341).

    ``lg lg (nu + 0.7) = A - B lg T`` [mm^2/s, K] through those at 40 and 100 degrees.
    """
    if not (at_40 > at_100 > 0.3e-6 and temperature > -273.0):
        message = f"{1e6 * at_40:g} mm^2/s at 40, {1e6 * at_100:g} at 100, asked at {temperature:g} degrees"
        raise CaseError(message, code="E-RANGE", limit="an oil that is thinner when it is hot, above 0.3 mm^2/s")
    return float(kinematic_viscosity(at_40, at_100, temperature + 273.15))


def _ball_factors(bearing: BallBearing, axial: float) -> LoadFactors:
    """Radial and angular contact ball bearings: ISO 281, Table 3."""
    degrees = math.degrees(abs(bearing.contact_angle))
    angles = list(_BALL_FACTORS)
    lower = max(angle for angle in angles if angle <= degrees + 1e-9)
    upper = min(angle for angle in angles if angle >= degrees - 1e-9)
    share = 0.0 if upper == lower else (degrees - lower) / (upper - lower)
    place = axial / (bearing.balls * bearing.ball_diameter**2) / _MILLION_NEWTON

    def column(angle: int) -> np.ndarray:
        relative = place / bearing.rows if angle == 0 else place
        limit, x, y, y_below, x_two, y_two = (
            np.interp(relative, _AXIAL, np.broadcast_to(part, 9)) for part in _BALL_FACTORS[angle]
        )
        if bearing.rows == 1:
            return np.array([limit if angle != 5 else np.interp(relative, _AXIAL, _BALL_FACTORS[0][0]), 0.0, x, y])
        return np.array([limit, y_below, x_two, y_two])

    limit, y_below, x, y = ((1.0 - share) * column(lower) + share * column(upper)).tolist()
    return LoadFactors(limit, (1.0, y_below), (x, y))


def _thrust_factors(
    bearing: Bearing, limit: float, below: tuple[float, float], above: tuple[float, float]
) -> LoadFactors:
    """Thrust bearings; one row has no factors up to e, where it cannot run, and takes those above."""
    if math.isclose(abs(bearing.contact_angle), 0.5 * math.pi):
        return LoadFactors(math.inf, (0.0, 1.0), (0.0, 1.0))
    return LoadFactors(limit, above if bearing.rows == 1 else below, above)


def _ball_capacities(bearing: BallBearing, rating: float) -> tuple[float, float]:
    """Loads Q_ci and Q_ce of one ball that both rings survive for a million turns (ISO/TS 16281, 4.3)."""
    ratio, angle = _diameter_ratio(bearing), abs(bearing.contact_angle)
    inner, outer = 2.0 * bearing.inner_osculation, 2.0 * bearing.outer_osculation
    grooves = (inner / outer * (outer - 1.0) / (inner - 1.0)) ** 0.41
    rolling = ((1.0 - ratio) / (1.0 + ratio)) ** 1.72 * grooves
    if angle > THRUST_ANGLE:
        shares, coefficients, lever = rolling, (1.0, 1.0), math.sin(angle)
    else:
        shares, coefficients, lever = 1.044 * rolling, (0.407, 0.389), math.cos(angle)
    single = rating / bearing.rows**0.7 / (bearing.balls * lever)
    return (
        single / coefficients[0] * (1.0 + shares ** (10.0 / 3.0)) ** 0.3,
        single / coefficients[1] * (1.0 + shares ** (-10.0 / 3.0)) ** 0.3,
    )


def _lamina_capacities(bearing, rating: float) -> tuple[float, float]:
    """Loads of a lamina that both rings survive for a million turns (ISO/TS 16281, 5.3).

    The factors 0.83 and 0.73 take out what the catalogue rating loses to edge loads.
    """
    ratio, angle = _diameter_ratio(bearing), abs(bearing.contact_angle)
    rolling = ((1.0 - ratio) / (1.0 + ratio)) ** (143.0 / 108.0)
    if angle > THRUST_ANGLE:
        shares, coefficients, lever, reduction = rolling, (1.0, 1.0), math.sin(angle), 0.73
    else:
        shares, coefficients, lever, reduction = 1.038 * rolling, (0.378, 0.364), math.cos(angle), 0.83
    single = rating / reduction / bearing.rows ** (7.0 / 9.0) / (bearing.rollers * lever)
    single *= bearing.laminae ** (-7.0 / 9.0)
    return (
        single / coefficients[0] * (1.0 + shares**4.5) ** (2.0 / 9.0),
        single / coefficients[1] * (1.0 + shares**-4.5) ** (2.0 / 9.0),
    )


def _edge_factors(count: int) -> np.ndarray:
    """Stress concentration towards the ends of a roller (ISO/TS 16281, 5.4, approximate function), (laminae,)."""
    places = np.abs(2.0 * np.arange(1, count + 1) - count - 1.0) / (2.0 * count - 2.0)
    # the lamina in the middle of an odd number has the limit, 1
    return 1.0 - 0.01 / np.log(1.985 * np.maximum(places, 1e-300))


def _diameter_ratio(bearing: Bearing) -> float:
    """gamma = D_w cos a / D_pw."""
    return bearing.element_diameter * math.cos(bearing.contact_angle) / bearing.pitch_diameter


def _checked_rating(rating: float) -> float:
    if not (math.isfinite(rating) and rating > 0.0):
        raise CaseError(f"a dynamic rating of {rating} N", code="E-RANGE", key="dynamic_rating", limit="above 0 N")
    return float(rating)
