"""Rolling bearings: motions and lives that another program prints, integrals, formulas of books, invariances."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from femgear.system.bearing_life import (
    basic_rating_life,
    life_factor,
    load_factors,
    passing_orders,
    reference_rating_life,
)
from femgear.system.rolling_bearings import BallBearing, BearingState, RollerBearing, bearing_state, solve_motion
from validation.rows import Row, at_most, information, printed, within

MASTA = "MASTA, as printed by the tests of github.com/minzhun/ISO16281"
ISO_281 = "ISO 281:2007"
DEEP = BallBearing(7, 11.5e-3, 43.5e-3)
LOOSE = replace(DEEP, clearance=10e-6)
RATING = 23400.0
ANGULAR = BallBearing(12, 10e-3, 60e-3, contact_angle=math.radians(25.0))
CYLINDRICAL = RollerBearing("cylindrical", 18, 20e-3, 100e-3, 12e-3)
PLAIN = replace(CYLINDRICAL, profile="none")
TAPERED = RollerBearing("tapered", 17, 16e-3, 62e-3, 9e-3, contact_angle=math.radians(14.0))
KINDS = {
    "deep groove": LOOSE,
    "two angular contact rows": replace(ANGULAR, rows=2, row_distance=20e-3, axial_preload=5e-6),
    "cylindrical": CYLINDRICAL,
    "needle": RollerBearing("needle", 20, 15e-3, 30e-3, 3e-3, clearance=8e-6),
    "tapered": TAPERED,
    "spherical": RollerBearing(
        "spherical", 15, 14e-3, 75e-3, 13e-3, contact_angle=math.radians(11.0), rows=2, row_distance=-25e-3
    ),
}
MOTION = np.array([20e-6, 5e-6, 12e-6, 2e-4, -3e-4, 0.1])
# load (F_x, F_z [N], M_x [N m]), clearance, then radial way [um], axial way [um], tilt [mrad] and life as printed
PRINTED = (
    ("F_r 1 kN, s 0", DEEP, (1000, 0, 0), 15.1101, None, None, 13163.019),
    ("F_a 1 kN, s 0", DEEP, (0, 1000, 0), None, 133.5381, None, 2222.7318),
    ("F_r 1 kN, s 10 µm", LOOSE, (1000, 0, 0), 21.223, None, None, 10795.7948),
    ("F_a 1 kN, s 10 µm", LOOSE, (0, 1000, 0), None, 149.1717, None, 3115.8781),
    ("F_r and F_a 1 kN, s 10 µm", LOOSE, (1000, 1000, 0), 19.5923, 146.4603, 2.6872, 1630.5367),
    ("M 1 N m across the first ball, s 0", DEEP, (0, 0, 1), None, None, 3.6957, 785144.7521),
    ("F_r, F_a 1 kN and M 1 N m across, s 10 µm", LOOSE, (1000, 1000, 1), 19.7144, 146.3084, 2.7239, 1627.7479),
)


def another_program() -> tuple[Row, ...]:
    """Deep groove bearing with seven balls under forces and a moment."""
    rows = []
    for text, bearing, (radial, axial, moment), *motions, life in PRINTED:
        state = solve_motion(bearing, (radial, 0, axial, moment, 0, 0))
        ours = (
            1e6 * math.hypot(*state.motion[:2]),
            1e6 * state.motion[2],
            1e3 * math.hypot(*state.motion[3:5]),
        )
        for name, wanted, value in zip(("radial [µm]", "axial [µm]", "tilt [mrad]"), motions, ours):
            if wanted is not None:
                rows.append(within("7 balls", MASTA, f"{text}: {name}", wanted, value, 5e-4))
        value = reference_rating_life(state, RATING)
        rows.append(within("7 balls", MASTA, f"{text}: L10r [million turns]", life, value, 5e-4))
    state = solve_motion(DEEP, (0, 0, 0, 0, 1, 0))
    text = "M 1 N m in the plane of the first ball, s 0: L10r [million turns]"
    note = "the moment that is printed acts across the plane of the radial load"
    rows.append(information("7 balls", MASTA, text, life_of(5), reference_rating_life(state, RATING), note=note))
    return tuple(rows)


def life_of(number: int) -> float:
    """Printed life of a row."""
    return float(PRINTED[number][-1])


def sjoevall(exponent: float, power: float) -> float:
    """Integral J of the loaded half of the circle: a beta function."""
    half = 0.5 * (exponent + power)
    return math.gamma(half + 0.5) / (math.gamma(half + 1.0) * 2.0 * math.sqrt(math.pi))


def rollers() -> tuple[Row, ...]:
    """Sjoevall's integral, motion and stiffness of a roller bearing, tapered rollers, rollers that pass."""
    exponent, force = 10.0 / 9.0, 50e3
    integral = sjoevall(exponent, 1)
    source = "H. Sjövall, load distribution (1933)"
    stiffness = 35948.0 * 20.0 ** (8.0 / 9.0)
    way = 1e3 * (force / 18.0 / integral / stiffness) ** 0.9
    bearings = [replace(PLAIN, clearance=s) for s in (0.0, 20e-6)]
    states = [solve_motion(bearing, (force, 0, 0, 0, 0, 0)) for bearing in bearings]
    tight, loose = (_passing(bearing, force) for bearing in bearings)
    mean = 1e6 * float(np.mean([state.motion[0] for state in tight]))
    rows = [
        printed("18 rollers", source, "J_r(0.5) of line contact", "0.244799", integral),
        within("18 rollers", source, "50 kN, s 0: motion, mean as rollers pass [µm]", way, mean, 1e-4),
        within("18 rollers", source, "s 0: largest load [N]", force / 18.0 / integral, states[0].load.max(), 1e-3),
    ]
    slope, wanted = 1e-6 * states[0].stiffness[0, 0], 1e-6 * exponent * force / states[0].motion[0]
    rows.append(within("18 rollers", "10/9 F / d", "s 0: stiffness [N/µm]", wanted, slope, 1e-9))
    rows += [row for state in states for row in _one_unknown(state)]
    slopes = [state.stiffness[0, 0] for state in loose]
    text, origin = "s 20 µm: variation of the stiffness as rollers pass", "the same formulas, written independently"
    rows.append(within("18 rollers", origin, text, 0.0100, float(np.ptp(slopes) / np.mean(slopes)), 0.05))
    many = replace(TAPERED, rollers=101, pitch_diameter=0.4, profile="none")
    push = bearing_state(many, (25e-6, 0, 0, 0, 0, 0)).force
    ratio = push[2] / push[0] / math.tan(many.contact_angle)
    text = "101 tapered rollers, half of them loaded: F_a / (F_r tan a)"
    rows.append(within("tapered", "J_a / J_r", text, sjoevall(exponent, 0) / integral, ratio, 1e-4))
    rows.append(information("tapered", "NSK E728g, 5.1, exponent 1.1", text, 1.260, ratio))
    return tuple(rows)


def _passing(bearing: RollerBearing, force: float) -> list[BearingState]:
    """States as the rollers move on by one."""
    angles = np.linspace(0.0, 2.0 * math.pi / bearing.rollers, 24, endpoint=False)
    return [solve_motion(bearing, (force, 0, 0, 0, 0, 0), first_angle=angle) for angle in angles]


def _one_unknown(state: BearingState) -> list[Row]:
    """Balance of the rollers, the first one under the load, by a root of one equation."""
    from scipy.optimize import brentq

    cosines = np.cos(2.0 * math.pi / 18.0 * np.arange(18))
    stiffness, gap = 35948.0 * 20.0 ** (8.0 / 9.0), 500.0 * state.bearing.clearance

    def carried(way: float) -> float:
        return float((np.maximum(way * cosines - gap, 0.0) ** (10.0 / 9.0) * cosines).sum()) * stiffness

    way = float(brentq(lambda way: carried(way) - 50e3, 0.01, 0.2, xtol=1e-14))  # type: ignore[arg-type]
    slope = 10.0 / 9.0 * float((np.maximum(way * cosines - gap, 0.0) ** (1.0 / 9.0) * cosines**2).sum()) * stiffness
    source, text = "balance of one unknown, N and mm", f"s {1e6 * state.bearing.clearance:.0f} µm"
    return [
        within("18 rollers", source, f"50 kN, {text}: motion [µm]", 1e3 * way, 1e6 * state.motion[0], 1e-9),
        within(
            "18 rollers",
            source,
            f"{text}: stiffness in the balance [N/µm]",
            1e-3 * slope,
            1e-6 * state.stiffness[0, 0],
            1e-7,
        ),
    ]


def invariances() -> tuple[Row, ...]:
    """Slope of the force, turning by one element, mirror, and the way from a load back to its motion."""
    rows = []
    for name, bearing in KINDS.items():
        state = bearing_state(bearing, MOTION)
        steps = np.array([1e-10, 1e-10, 1e-10, 1e-8, 1e-8, 1e-3])
        slopes = np.array(
            [
                (bearing_state(bearing, MOTION + s).force - bearing_state(bearing, MOTION - s).force) / (2.0 * s.max())
                for s in np.diag(steps)
            ]
        )
        scale = np.sqrt(np.outer(*2 * (np.array([1.0, 1.0, 1.0, 0.02, 0.02, 1.0]) ** 2,)))
        missed = np.abs((slopes - state.stiffness) / scale).max() / np.abs(state.stiffness / scale).max()
        rows.append(at_most(name, "central differences", "stiffness, error over its largest entry", 1e-6, missed))
        angle = 2.0 * math.pi / bearing.elements
        turn = np.eye(6)
        turn[:2, :2] = turn[3:5, 3:5] = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
        turned, size = bearing_state(bearing, turn @ MOTION).force, np.abs(state.force).max()
        missed = np.abs(turned - turn @ state.force).max() / size
        rows.append(at_most(name, "symmetry", "turned by one element, force", 1e-10, missed))
        side = np.array([1, -1, 1, -1, 1, -1])
        missed = np.abs(bearing_state(bearing, side * MOTION).force - side * state.force).max() / size
        rows.append(at_most(name, "symmetry", "mirrored, force", 1e-10, missed))
        back = solve_motion(bearing, state.force).force
        missed = np.abs(back - state.force).max() / size
        rows.append(at_most(name, "balance", "motion solved from its force", 1e-9, missed))
    return tuple(rows)


def books() -> tuple[Row, ...]:
    """Formulas of books, which know neither groove radii nor pitch diameters."""
    rows = []
    state = solve_motion(DEEP, (1000, 0, 0, 0, 0, 0))
    largest = float(state.load.max())
    source = "T. Harris, Rolling Bearing Analysis, after A. Palmgren"
    way = 0.436e-3 * (largest**2 / 11.5) ** (1.0 / 3.0) * 1e3
    text = "deep groove, 1 kN: motion [µm]"
    rows.append(information("7 balls", source, text, way, 1e6 * state.motion[0]))
    rolling = solve_motion(PLAIN, (50e3, 0, 0, 0, 0, 0))
    way = 0.0768e-3 * float(rolling.load.max()) ** 0.9 / 20.0**0.8 * 1e3
    rows.append(information("18 rollers", source, "50 kN: motion [µm]", way, 1e6 * rolling.motion[0]))
    source = "E. Krämer, Dynamics of Rotors and Foundations (1993), as in ROSS 2.3.0"
    stiffness = 13.0e6 * 7.0 ** (2.0 / 3.0) * (11.5e-3 * 1000.0) ** (1.0 / 3.0) * 1e-6
    text = "deep groove, 1 kN: stiffness [N/µm]"
    rows.append(information("7 balls", source, text, stiffness, 1e-6 * state.stiffness[0, 0]))
    stiffness = 1.0e9 * 18.0**0.9 * 20e-3**0.8 * 50e3**0.1 * 1e-6
    ours = 1e-6 * rolling.stiffness[0, 0]
    rows.append(information("18 rollers", source, "50 kN: stiffness [N/µm]", stiffness, ours))
    return tuple(rows)


def lives() -> tuple[Row, ...]:
    """Factors of catalogues and charts, continuity of a_ISO, two rows, the basic life."""
    rows = []
    forty = load_factors(replace(ANGULAR, contact_angle=math.radians(40.0)), 1000.0)
    for name, wanted, ours in (
        ("e", "1.14", forty.limit),
        ("X", "0.35", forty.above[0]),
        ("Y", "0.57", forty.above[1]),
    ):
        rows.append(printed("40 degrees", "catalogue of a 7206 B bearing", name, wanted, ours))
    for ratio, chart in ((0.005, 0.38), (0.02, 0.95), (0.05, 2.5), (0.1, 7.0)):
        text = f"balls, kappa 4, e_C C_u / P {ratio:g}: a_ISO"
        ours = life_factor(DEEP, 4.0, 1.0, ratio)
        rows.append(within("a_ISO", "chart of SKF, read by hand", text, chart, ours, 0.05))
    for name, bearing in (("balls", DEEP), ("rollers", CYLINDRICAL)):
        steps = [
            abs(life_factor(bearing, edge - 1e-9, 0.5, 0.2) / life_factor(bearing, edge, 0.5, 0.2) - 1.0)
            for edge in (0.4, 1.0)
        ]
        rows.append(at_most("a_ISO", ISO_281, f"{name}: step between ranges of kappa", 2e-3, max(steps)))
    for single, exponent, slope in ((DEEP, 0.7, 0.9), (PLAIN, 7.0 / 9.0, 8.0 / 9.0)):
        alone, both = (
            reference_rating_life(bearing_state(bearing, (2e-5, 0, 0, 0, 0, 0)), rating)
            for bearing, rating in ((single, 1e4), (replace(single, rows=2), 1e4 * 2.0**exponent))
        )
        text = f"{single.elements} elements, L10r of two rows over that of one, equal loads"
        rows.append(within("two rows", "ISO 281, Weibull's slope", text, 2.0**-slope, both / alone, 1e-12))
    state = solve_motion(DEEP, (1000, 0, 0, 0, 0, 0))
    basic = basic_rating_life(DEEP, 1000.0, 0.0, RATING)
    ours = reference_rating_life(state, RATING)
    rows.append(information("7 balls", ISO_281, "F_r 1 kN: L10r beside L10 [million turns]", basic, ours))
    return tuple(rows)


def orders() -> tuple[Row, ...]:
    """Passing orders of a bearing whose faults are measured everywhere."""
    orders = passing_orders(BallBearing(9, 0.3126 * 25.4e-3, 1.537 * 25.4e-3))
    source = "Case Western Reserve University, bearing data center, 6205"
    values = ((0.39828, orders.cage), (3.5848, orders.outer), (5.4152, orders.inner), (4.7135, 2.0 * orders.spin))
    names = ("cage", "outer ring", "inner ring", "ball, both rings")
    return tuple(
        within("6205", source, f"{name}, per turn", *pair, 2e-4, note="diameters have four digits")
        for name, pair in zip(names, values)
    )
