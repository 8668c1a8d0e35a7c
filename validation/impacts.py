"""Impacts of a gear pair and Lyapunov exponents: closed forms, published numbers, integration."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from small_trains import example_pair, level_crossings, lightly_loaded_pair

from femgear.solvers.continuation.branches import parameter_curve
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.solvers.stability.lyapunov import lyapunov_exponents
from femgear.solvers.time.stroboscopic import sweep_response
from femgear.system.force_laws import GearMeshes, PolynomialSprings
from femgear.system.fourier import FourierSeries, constant
from femgear.system.system import HarmonicForce, NonlinearSystem
from femgear.trains.impacts.model import (
    BACK,
    DRIVE,
    ImpactPair,
    impact_borders,
    range_states,
    separation_ratios,
)
from validation.nonlinear import oscillator
from validation.reference.adaptive_lyapunov import adaptive_exponents
from validation.rows import Row, at_most, counted, information, within

KAHRAMAN = "Kahraman and Singh (1990)"
INTEGRATION = "average acceleration, sweep"


def dead_zone_balance(mean: float, amplitude: float) -> tuple[float, float]:
    """Mean and first harmonic of the force of a dead zone from -1 to 1 (A. Kahraman and R. Singh 1990)."""

    def g(mu):
        c = min(max(mu, -1.0), 1.0)
        return 2.0 / math.pi * (c * math.asin(c) + math.sqrt(1.0 - c * c)) if abs(mu) < 1.0 else abs(mu)

    def h(mu):
        c = min(max(mu, -1.0), 1.0)
        return 2.0 / math.pi * (math.asin(c) + c * math.sqrt(1.0 - c * c))

    up, down = (1.0 - mean) / amplitude, (-1.0 - mean) / amplitude
    return mean + 0.5 * amplitude * (g(up) - g(down)), amplitude * (1.0 - 0.5 * (h(up) - h(down)))


def linear_exponents() -> tuple[Row, ...]:
    """Largest exponents of linear systems."""
    spring = oscillator(GearMeshes([0], constant([4.0]), separates=False), damping=0.4, forces=[(0.3, (1,))])
    plain = adaptive_exponents(spring, 1.3, points=150, skip=20)
    # exp(-ct/2) times the solution of Mathieu's equation with a = q = 1, multiplier -4.15605494
    mesh = GearMeshes([0], FourierSeries([[1.01, -2.0]]), separates=False)
    mathieu = adaptive_exponents(oscillator(mesh, damping=0.2), 2.0, points=20, skip=15)
    floquet = math.log(4.15605494) / math.pi - 0.1
    # multipliers of nearly one size: the first directions turn slowly
    stable = GearMeshes([0], FourierSeries([[1.01, -0.2]]), separates=False)
    calm = adaptive_exponents(oscillator(stable, damping=0.4), 2.0, points=16, skip=60)
    multiplier = np.abs(
        solve_harmonic_balance(
            oscillator(stable, damping=0.4, forces=[(1.0, (1,))]), 2.0, harmonics=4
        ).verdict.multipliers
    ).max()
    return (
        within(
            "exponents",
            "-zeta omega_n",
            "linear oscillator, zeta 0.1, omega_n 2 [1/s]",
            -0.2,
            plain.largest,
            1e-6,
            relative=False,
        ),
        within(
            "exponents",
            "Floquet, log|mu|/T",
            "damped Mathieu equation a = 1.01, q = 1, c = 0.2 [1/s]",
            floquet,
            mathieu.largest,
            1e-6,
            relative=False,
        ),
        within(
            "exponents",
            "Floquet, log|mu|/T",
            "the same with q = 0.1, c = 0.4 [1/s]",
            math.log(multiplier) / math.pi,
            calm.largest,
            1e-6,
            relative=False,
        ),
    )


def one_term_balance() -> tuple[Row, ...]:
    """One harmonic of the pair, solved here and with the published describing functions."""
    from scipy.optimize import fsolve

    rows, zeta, load, error = [], 0.09, 0.9, 0.72
    pair = ImpactPair(damping_ratio=zeta, load=load, tooth_error=(error,))
    for ratio, guess in ((1.5, (1.9, 1.2)), (0.8, (1.2, 3.5)), (0.5, (1.9, 0.3))):

        def equations(unknown, ratio=ratio):
            force, first = dead_zone_balance(*unknown)
            size = math.hypot(first - ratio**2 * unknown[1], 2.0 * zeta * ratio * unknown[1])
            return force - load, size - error * ratio**2

        mean, amplitude = fsolve(equations, guess, xtol=1e-12)
        deflection = solve_harmonic_balance(
            pair.problem(ratio), 1.0, harmonics=1, samples=32768, start=[[mean, amplitude]], stability=False
        ).deflection[0]
        name = f"one harmonic, zeta 0.09, ratio {ratio}:"
        rows += [
            within("impacts", KAHRAMAN, f"{name} mean", mean, deflection[0].real, 1e-6),
            within("impacts", KAHRAMAN, f"{name} amplitude", amplitude, abs(deflection[1]), 1e-6),
        ]
    for ratio in separation_ratios(damping_ratio=0.15, load=load, error=error):
        pair = ImpactPair(damping_ratio=0.15, load=load, tooth_error=(error,))
        ratios = ratio * np.linspace(0.99, 1.01, 5)
        run = sweep_response(lambda r, pair=pair: (pair.problem(r), 1.0), ratios, most=150, tolerance=1e-8)
        ours = level_crossings(ratios, run.lowest[:, 0], DRIVE)[0]
        rows.append(within("impacts", "closed form", "ratio at which flanks part, zeta 0.15", ratio, ours, 1e-3))
    return tuple(rows)


def damping_and_impacts() -> tuple[Row, ...]:
    """Folds and borders of impact for two damping ratios, harmonic balance against integration."""
    rows, peaks, branches = [], {}, {}
    half = "half of the range of the deflection"
    for zeta, folds in ((0.15, 0), (0.09, 2)):
        pair = example_pair(zeta)
        branch = parameter_curve(pair.problem, (3.5, 0.1), 1.0, harmonics=12, samples=1024, radius=False)
        branches[zeta] = branch
        sizes = [0.5 * np.ptp(s.at(2.0 * np.pi * np.arange(512) / 512)) for s in branch.solutions]
        peaks[zeta] = max(sizes)
        source = "jumps of the sweeps below" if folds else "one answer at every ratio"
        rows += [
            counted("impacts", source, f"zeta {zeta}: limit points", folds, len(branch.folds)),
            information("impacts", half, f"zeta {zeta}: largest amplitude [half backlash]", None, peaks[zeta]),
        ]
    name, share = "amplitude of zeta 0.15 over that of 0.09", peaks[0.15] / peaks[0.09]
    rows.append(at_most("impacts", "less damping, more motion", name, 0.9, share))
    # the sweeps come from ratios with one answer: lower branch from below, upper branch from above
    places = (
        (0.15, 0.73, DRIVE, [0.68], "one-sided impacts begin"),
        (0.15, 2.55, DRIVE, [], "one-sided impacts end"),
        (0.09, 0.71, DRIVE, [0.6, 0.68], "one-sided impacts begin, from below"),
        (0.09, 2.6, DRIVE, [], "one-sided impacts end"),
        (0.09, 0.89, BACK, [1.2, 1.0], "two-sided impacts end"),
    )
    for zeta, near, level, before, name in places:
        pair = example_pair(zeta)
        borders = impact_borders(pair, branches[zeta], level)
        ours = borders[np.argmin(np.abs(borders - near))]
        ratios = np.concatenate([before, ours + np.linspace(-0.008, 0.008, 5)])
        run = sweep_response(lambda r, pair=pair: (pair.problem(r), 1.0), ratios, steps=400, most=400, tolerance=1e-7)
        border = level_crossings(ratios[-5:], run.lowest[-5:, 0], level)[0]
        rows.append(within("impacts", INTEGRATION, f"zeta {zeta}: {name}, ratio", border, ours, 2e-3))
    low, high = np.sort(branches[0.09].parameter[branches[0.09].folds])
    pair = example_pair(0.09)
    for name, ratios, states in (
        ("up", [0.6, 0.68, high - 0.02, high - 0.002, high + 0.002], [0, 0, 1, 1, 2]),
        ("down", [low + 0.1, low + 0.03, low + 0.002, low - 0.002], [2, 2, 2, 0]),
    ):
        run = sweep_response(lambda r, pair=pair: (pair.problem(r), 1.0), ratios, steps=400, most=500)
        border = range_states(run.lowest[:, 0], run.highest[:, 0])
        fold = high if name == "up" else low
        text = f"zeta 0.09: sweep {name} jumps within 0.002 of the limit point {fold:.4f}"
        rows.append(counted("impacts", INTEGRATION, text, 1, int(border.tolist() == states)))
    return tuple(rows)


def over_two_periods(problem: NonlinearSystem) -> NonlinearSystem:
    """The same problem with half its base frequency."""
    (mesh,) = problem.elements
    mesh = replace(mesh, stiffness=FourierSeries(mesh.stiffness.amplitudes, (2,)))
    forces = tuple(HarmonicForce(force.force, (2 * force.orders[0],)) for force in problem.forces)
    return replace(problem, elements=(mesh,), forces=forces)


def period_two() -> tuple[Row, ...]:
    """Two-sided impacts of the motion of two tooth periods that coexists with that of one, zeta 0.09."""
    from scipy.optimize import brentq

    pair, before = example_pair(0.09), [1.973, 1.755]
    steps = {"periods": 2, "steps": 800, "most": 300, "tolerance": 1e-7, "harmonics": 32}
    run = sweep_response(lambda r: (pair.problem(r), 1.0), [*before, 1.65, 1.63], **steps)
    phase, start = 4.0 * np.pi * np.arange(2048) / 2048, run.lines[-1]

    def lowest(ratio):
        problem = over_two_periods(pair.problem(ratio))
        subharmonic = solve_harmonic_balance(problem, 0.5, harmonics=32, samples=2048, start=start, stability=False)
        return float(subharmonic.at(phase).min())

    ours = brentq(lambda ratio: lowest(ratio) - BACK, 1.63, 1.66, xtol=1e-6)
    ratios = np.concatenate([before, ours + np.linspace(0.008, -0.008, 5)])
    run = sweep_response(lambda r: (pair.problem(r), 1.0), ratios, **steps)
    border = level_crossings(ratios[2:], run.lowest[2:, 0], BACK)[0]
    name = "zeta 0.09, two tooth periods:"
    text = f"{name} two-sided impacts begin from above, ratio"
    rows = [within("impacts", INTEGRATION, text, border, ours, 2e-3)]
    for ratio in (1.6, 1.55):
        run = sweep_response(lambda r: (pair.problem(r), 1.0), [*before, 1.65, ratio], **steps)
        start = run.lines[-1]
        text = f"{name} smallest deflection at {ratio}"
        rows.append(within("impacts", INTEGRATION, text, run.lowest[-1, 0], lowest(ratio), 5e-3))
    return tuple(rows)


def runge_kutta_exponent(force, slope, damping, push, members: int, periods: int, skip: int, steps: int):
    """Mean exponent and its error of ``x'' = push(t) - force(x) - damping x'`` from many starts, period 2 pi.

    Classical Runge-Kutta of fourth order with one small motion, all starts at once; nothing of femgear.
    """
    rng, h = np.random.default_rng(3), 2.0 * np.pi / steps
    y = np.stack([rng.uniform(1.0, 2.0, members), *np.zeros((1, members)), *np.ones((2, members))])

    def rate(t, y):
        x, v, a, b = y
        return np.stack([v, push(t) - force(x) - damping * v, b, -slope(x) * a - damping * b])

    growth = np.zeros(members)
    for period in range(skip + periods):
        for i in range(steps):
            t = i * h
            k1 = rate(t, y)
            k2 = rate(t + 0.5 * h, y + 0.5 * h * k1)
            k3 = rate(t + 0.5 * h, y + 0.5 * h * k2)
            k4 = rate(t + h, y + h * k3)
            y = y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        size = np.hypot(y[2], y[3])
        y[2:] /= size
        growth += np.log(size) if period >= skip else 0.0
    rates = growth / (2.0 * np.pi * periods)
    return rates.mean(), rates.std(ddof=1) / math.sqrt(members)


def chaos() -> tuple[Row, ...]:
    """Ueda's attractor and the lightly loaded pair: exponents, sections, another integration."""
    ueda = oscillator(PolynomialSprings([0], [[0.0, 0.0, 1.0]]), damping=0.05, forces=[(7.5, (1,))])
    exponents = lyapunov_exponents(ueda, 1.0, count=2, points=1000, skip=50)
    zeta, load, error, ratio = 0.05, 0.1, 0.2, 1.5
    pair = lightly_loaded_pair(zeta)
    ours = lyapunov_exponents(pair.problem(ratio), 1.0, count=2, points=600, skip=60)
    other, scatter = runge_kutta_exponent(
        lambda x: (x - np.clip(x, -1.0, 1.0)) / ratio**2,
        lambda x: (np.abs(x) > 1.0) / ratio**2,
        2.0 * zeta / ratio,
        lambda t: load / ratio**2 + error * np.cos(t),
        60,
        150,
        60,
        200,
    )
    calm = lyapunov_exponents(pair.problem(2.2), 1.0, points=100, skip=100)
    both = math.hypot(ours.scatter[0], scatter)
    name = "lightly loaded pair, zeta 0.05, ratio 1.5:"
    return (
        within(
            "chaos",
            "one long run elsewhere",
            "Ueda's attractor (1979): largest exponent [1/s]",
            0.0999,
            exponents.largest,
            3.0 * exponents.scatter[0],
            relative=False,
            note="gate: three errors of the mean",
        ),
        within(
            "chaos",
            "-c",
            "Ueda's attractor: sum of both exponents [1/s]",
            -0.05,
            exponents.exponents.sum(),
            1e-3,
            relative=False,
        ),
        within(
            "chaos",
            "Runge-Kutta, 60 starts",
            f"{name} largest exponent [1/theta]",
            other,
            ours.largest,
            3.0 * both,
            relative=False,
            note="gate: three errors of both means",
        ),
        within(
            "chaos",
            "-2 zeta / ratio",
            f"{name} sum of both exponents",
            -2.0 * zeta / ratio,
            ours.exponents.sum(),
            1e-3,
            relative=False,
        ),
        counted("chaos", "theory", f"{name} exponent clearly positive", 1, int(ours.chaotic is True)),
        counted(
            "chaos", "theory", f"{name} periods after which the section repeats", 0, ours.section.repeats_after(1e-3)
        ),
        counted("chaos", "theory", "the same at ratio 2.2: exponent clearly negative", 1, int(calm.chaotic is False)),
        counted(
            "chaos",
            "theory",
            "the same at ratio 2.2: periods after which the section repeats",
            1,
            calm.section.repeats_after(1e-3),
        ),
    )
