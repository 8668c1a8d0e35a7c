"""Parametric stability by the general solvers: boundaries of charts, verdicts on periodic solutions."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.solvers.periodic.shooting import solve_shooting
from femgear.solvers.periodic.solution import FloquetVerdict, PeriodicSolution
from femgear.solvers.stability.floquet import floquet_verdict
from femgear.system.force_laws import GearMeshes
from femgear.system.fourier import FourierSeries, StepSeries
from femgear.system.system import NonlinearSystem
from validation.nonlinear import oscillator
from validation.parametric import EXACT, NATURAL, RATIO, SOFT
from validation.reference.hill import hill_verdict
from validation.reference.stability_boundary import stability_boundary
from validation.rows import REPEATED, Row, at_most, counted, printed, within

RECTANGLE = StepSeries([[1.0, SOFT]], [0.0, RATIO])


def loaded(stiffness, *, damping: float = 0.0, load: float = 1.0) -> NonlinearSystem:
    """Unit mass on one mesh that never parts, with a steady load."""
    return oscillator(GearMeshes([0], stiffness, separates=False), damping=damping, load=load)


def verdict_at(problem: NonlinearSystem, frequency: float, judge=floquet_verdict) -> FloquetVerdict:
    """Verdict on the periodic solution at a frequency [rad/s]."""
    return judge(problem, solve_harmonic_balance(problem, frequency, harmonics=8))


def rest(frequency: float) -> PeriodicSolution:
    """The unloaded state at rest: a solution also where the loaded one would be a resonance."""
    none = np.zeros((1, 2))
    return PeriodicSolution([frequency], [[0], [1]], none, none, True, 0.0, 0, 0, 0.0, "at rest")


def mathieu_boundaries() -> tuple[Row, ...]:
    """G1, G3: depths at which Mathieu's equation changes its stability."""
    rows = []
    for q, name, a, share in (
        (1.0, "a0", -0.4551386041, 0.2),
        (1.0, "a1", 1.8591080725, 0.2),
        (1.0, "a2", 4.3713009827, 0.2),
        (1.0, "b1", -0.1102488170, 0.2),
        (1.0, "b2", 3.9170247730, 0.2),
        # a0 and b1 lie so close here that a wider search would meet both
        (5.0, "a0", -5.8000460209, 5e-4),
        (5.0, "a1", 1.8581875415, 5e-4),
        (5.0, "b1", -5.7900805986, 5e-4),
        (5.0, "b2", 2.0994604455, 5e-4),
    ):
        between = q * (1.0 - share), q * (1.0 + share)
        wave = FourierSeries([[a, -2.0]])
        border = stability_boundary(oscillator(), wave, between, frequency=2.0)
        quantity = f"Mathieu, a = {name}({q:g}): q at the boundary of stability"
        rows.append(within("G1", "scipy.special.mathieu_a, mathieu_b", quantity, q, border, 1e-9))
    for damping, q in ((0.1, "0.1000546711"), (0.2, "0.2004369763")):
        wave = FourierSeries([[1.0, -2.0]])
        border = stability_boundary(oscillator(damping=damping), wave, (0.02, 0.4), frequency=2.0)
        quantity = f"damped Mathieu a = 1, c = {damping}: threshold q"
        source = f"threshold by DOP853 ({REPEATED})"
        rows.append(printed("G3", source, quantity, q, border))
    return tuple(rows)


def mathieu_verdicts() -> tuple[Row, ...]:
    """G2: verdicts on Mathieu's equation by splitting and by Hill's method."""
    rows = []
    for judge in (partial(floquet_verdict, tolerance=1e-11), hill_verdict):
        verdict = verdict_at(loaded(FourierSeries([[1.0, -2.0]])), 2.0, judge)
        name, source = f"({verdict.method})", f"independent integration, DOP853 ({REPEATED})"
        low, high = np.sort(verdict.multipliers.real)
        rows += [
            printed("G2", source, f"Mathieu a = 1, q = 1: larger multiplier {name}", "-4.15605494", low),
            printed("G2", source, f"Mathieu a = 1, q = 1: smaller multiplier {name}", "-.2406128", high),
            counted("G2", "theory", f"Mathieu a = 1, q = 1: loss through -1 {name}", 1, verdict.loss == "flip"),
        ]
        verdict = verdict_at(loaded(FourierSeries([[2.5, -2.0]])), 2.0, judge)
        largest = abs(verdict.multipliers[0])
        rows.append(within("G2", "theory", f"Mathieu a = 2.5, q = 1: modulus {name}", 1.0, largest, 1e-9))
        for damping in (0.1, 0.3):
            problem = loaded(FourierSeries([[1.0, -2.0]]), damping=damping)
            verdict = verdict_at(problem, 2.0, judge)
            quantity = f"Mathieu a = 1, q = 1, c = {damping}: product of the multipliers {name}"
            product = np.prod(verdict.multipliers).real
            rows.append(within("G2", "exp(-c T)", quantity, math.exp(-damping * math.pi), product, 1e-10))
    return tuple(rows)


def meissner_verdicts() -> tuple[Row, ...]:
    """G4: Meissner's equation through step series."""
    rows = []
    closed = "2 cos A cos B - (w1/w2 + w2/w1) sin A sin B"
    for d, e, value in ((0.25, 0.1, "-2.15946099"), (1.0, 0.3, "2.01491540"), (0.5, 0.2, "-.79900962")):
        steps = StepSeries([[d + e, d - e]], [0.0, 0.5])
        verdict = floquet_verdict(loaded(steps, load=0.0), rest(1.0))
        quantity = f"Meissner d = {d}, e = {e}: sum of the multipliers ({verdict.method})"
        rows.append(printed("G4", closed, quantity, value, np.sum(verdict.multipliers).real))
    for d, between in ((0.3678177281, (0.1, 0.3)), (0.9900288140, (0.1, 0.3)), (1.0290305698, (0.1, 0.3))):
        # depth 1 of these steps is e = 1
        steps = StepSeries([[d + 1.0, d - 1.0]], [0.0, 0.5])
        verdict = stability_boundary(oscillator(), steps, between, frequency=1.0)
        rows.append(within("G4", closed, f"Meissner d = {d}: e at the boundary", 0.2, verdict, 1e-8))
    return tuple(rows)


def rectangular_bands() -> tuple[Row, ...]:
    """G5: edges of the unstable bands and damped multipliers of the rectangular mesh stiffness."""
    rows = []
    for low, inside, high in (
        ("1.884253", 2.0, "2.113835"),
        ("0.964393", 1.0, "1.026547"),
        ("0.660884", 0.6632, "0.665614"),
        ("0.491420", 0.498, "0.504073"),
    ):
        for edge, side in ((low, -0.004), (high, 0.004)):
            between = (float(edge) + side) * NATURAL, inside * NATURAL
            border = stability_boundary(oscillator(), RECTANGLE, between, depth=1.0) / NATURAL
            quantity = f"edge of the unstable band around {inside:g}, w_m/w_n"
            rows.append(printed("G5", EXACT, quantity, edge, border))
    for damping, ratio, value in (
        (0.02, 2.0, "1.1198031"),
        (0.02, 1.0, "1.0608524"),
        (0.02, 0.5, ".8858646"),
        (0.05, 2.0, "1.0124401"),
        (0.05, 1.0, ".8660985"),
    ):
        border = verdict_at(loaded(RECTANGLE, damping=2.0 * damping), ratio * NATURAL)
        quantity = f"decay {damping}, w_m/w_n = {ratio:g}: largest multiplier of the verdict ({border.method})"
        rows.append(printed("G5", EXACT, quantity, value, abs(border.multipliers[0])))
        name = f"decay {damping}, w_m/w_n = {ratio:g}: stable (1 yes)"
        rows.append(counted("G5", EXACT, name, int(float(value) < 1.0), border.stable is True))
    return tuple(rows)


def verdict_against_fixed_point() -> tuple[Row, ...]:
    """G6: the verdict where the fixed point of the spectral iteration says nothing about stability."""
    rows, radius = [], {2.0: ".096", 1.0: "1.022", 0.5: ".579"}
    for ratio, value in ((2.0, "1.090"), (1.0, "1.005")):
        verdict = verdict_at(loaded(RECTANGLE, damping=0.06 * NATURAL), ratio * NATURAL)
        name = f"damping ratio 0.03, w_m/w_n = {ratio:g}:"
        note = f"the fixed point has the radius {radius[ratio]}"
        quantity = f"{name} largest multiplier of the verdict"
        source = f"operator of 200 harmonics, exponentials ({REPEATED})"
        rows.append(printed("G6", source, quantity, value, abs(verdict.multipliers[0]), note=note))
        rows.append(counted("G6", source, f"{name} stable (1 yes)", 0, verdict.stable is True, note=note))
    verdict = verdict_at(loaded(RECTANGLE, damping=0.06 * NATURAL), 0.5 * NATURAL)
    quantity = "damping ratio 0.03, w_m/w_n = 0.5: stable (1 yes)"
    rows.append(
        counted("G6", f"operator of 200 harmonics, exponentials ({REPEATED})", quantity, 1, verdict.stable is True)
    )
    quantity = "damping ratio 0.03, w_m/w_n = 2: largest multiplier by shooting less that of the verdict"
    rows.append(at_most("G6", "verdict", quantity, 1e-9, shooting_gap()))
    return tuple(rows)


def shooting_gap() -> float:
    """Largest multiplier by shooting less that of the verdict at w_m/w_n = 2, damping ratio 0.03."""
    problem, omega = loaded(RECTANGLE, damping=0.06 * NATURAL), 2.0 * NATURAL
    shot = solve_shooting(problem, omega, settle=0, harmonics=1)
    return abs(shot.multipliers[0]) - abs(verdict_at(problem, omega).multipliers[0])
