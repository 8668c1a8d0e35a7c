"""Nonlinear vibration: free and forced Duffing oscillator, dead zone, snap-through, manufactured solutions.

The forced oscillator is example 1 of NLvib (M. Krack and J. Gross, Harmonic Balance for Nonlinear Vibration
Problems, 2019): ``x'' + 0.05 x' + x + 0.1 x^3 = 0.18 cos(Omega t)``.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
from scipy.integrate import solve_ivp

from femgear.solvers.continuation.arclength import continue_curve
from femgear.solvers.continuation.branches import Branch, frequency_response_curve
from femgear.solvers.continuation.corrector import StepOptions
from femgear.solvers.linear.modal import modal_damping
from femgear.solvers.periodic.equations import harmonic_balance
from femgear.solvers.periodic.harmonic_balance import displacements, solve_harmonic_balance
from femgear.solvers.periodic.shooting import ShootingSolution, solve_shooting
from femgear.solvers.stability.floquet import floquet_verdict
from femgear.system.force_laws import PolynomialSprings
from femgear.system.fourier import harmonics_of
from femgear.system.system import HarmonicForce, MechanicalSystem, NonlinearSystem
from validation.reference.branch_switching import branch_maximum
from validation.reference.cornered_springs import PiecewiseSprings
from validation.reference.free_vibration import solve_free_vibration
from validation.reference.hill import hill_verdict
from validation.rows import Row, at_most, counted, printed, within

NLVIB = "computed for example 1 of NLvib (Krack and Gross, 2019), confirmed by time integration"
ELLIPTIC = "elliptic integral, omega = pi sqrt(1 + A^2) / (2 K(m)), m = A^2 / (2 (1 + A^2))"
CLOSED = "closed form"
# first harmonic at Omega = 1.2, multiplier with positive imaginary part or the larger one, its conjugate or
# the smaller one
MOTIONS = (
    ("upper", "2.5091975811", 0.80986415 + 0.33732103j, 0.80986415 - 0.33732103j),
    ("middle", "2.2605488905", 1.31490727, 0.58533817),
    ("lower", "0.4175204536", None, None),
)


def oscillator(*elements, damping=0.0, stiffness=0.0, load=0.0, forces=()) -> NonlinearSystem:
    """Unit mass with springs; ``forces`` are pairs of complex force and orders."""
    unit = np.ones((1, 1))
    system = MechanicalSystem(unit, damping * unit, stiffness * unit, unit, np.array([load]), ("x",))
    return NonlinearSystem(system, elements, tuple(HarmonicForce([f], orders) for f, orders in forces))


def duffing(force: float = 0.18, damping: float = 0.05, cubic: float = 0.1) -> NonlinearSystem:
    """``x'' + damping x' + x + cubic x^3 = force cos(Omega t)``."""
    return oscillator(PolynomialSprings([0], [[1.0, 0.0, cubic]]), damping=damping, forces=[(force, (1,))])


def one_harmonic(amplitude: float, frequency: float, force=0.18, damping=0.05, cubic=0.1) -> complex:
    """First line of `duffing` with the given amplitude, the phase as of a single harmonic."""
    stiffness = 1.0 - frequency**2 + 0.75 * cubic * amplitude**2
    return amplitude * np.exp(1j * np.angle(force / (stiffness + 1j * damping * frequency)))


def first(lines: np.ndarray) -> float:
    """Amplitude of the first harmonic of the first column."""
    return float(np.abs(lines[0, 1]))


def balanced_at_condition(balance, lines, omega: float, condition) -> tuple[np.ndarray, float]:
    """Lines and frequency that obey the harmonic equations and the linear ``condition(lines) = 0``."""
    y = balance.unknowns(lines)
    row = np.array([condition(balance.lines(unit)) - condition(0 * lines) for unit in np.eye(len(y))])
    for _ in range(30):
        error, jacobian, slope = balance.evaluate(y, [omega])
        matrix = np.block([[jacobian, slope], [row[None], np.zeros((1, 1))]])
        defect = np.append(error, condition(balance.lines(y)))
        # without damping the sines are free and stay where they are
        step = np.linalg.lstsq(matrix, -defect, rcond=1e-11)[0]
        y, omega = y + step[:-1], omega + float(step[-1])
        if np.abs(step).max() < 1e-13 * max(1.0, np.abs(y).max()):
            break
    return balance.lines(y), omega


def free_duffing() -> tuple[Row, ...]:
    """H1: frequency of ``x'' + x + x^3 = 0`` over the amplitude, two routes."""
    rows = []
    problem = oscillator(PolynomialSprings([0], [[1.0, 0.0, 1.0]]))
    for amplitude, value in (
        (0.1, "1.0037418361777"),
        (0.5, "1.0891581787791"),
        (1.0, "1.3177760649655"),
        (2.0, "1.9760163640713"),
        (5.0, "4.3574618565228"),
    ):
        guess = np.sqrt(1.0 + 0.75 * amplitude**2)
        vibration = solve_free_vibration(problem, ([amplitude], [0.0]), 2 * np.pi / guess, harmonics=1)
        start = np.zeros((1, 26), complex)
        start[0, 1] = amplitude
        _, omega = balanced_at_condition(
            harmonic_balance(problem, harmonics=25), start, guess, lambda x, a=amplitude: x.real.sum() - a
        )
        name = f"free Duffing, A = {amplitude:g}: frequency by"
        rows += [
            within("H1", ELLIPTIC, f"{name} harmonic balance, 25 harmonics", float(value), omega, 1e-12),
            within("H1", ELLIPTIC, f"{name} shooting", float(value), vibration.solution.frequency[0], 1e-10),
        ]
    start = np.array([[0.0, 1.0]], complex)
    _, omega = balanced_at_condition(harmonic_balance(problem, harmonics=1), start, 1.3, lambda x: x.real.sum() - 1.0)
    error = omega / 1.3177760649655 - 1.0
    rows.append(printed("H1", ELLIPTIC, "free Duffing, A = 1: error of one harmonic", "3.9e-3", error))
    return tuple(rows)


@cache
def response_curve(harmonics: int, stability: bool = True) -> Branch:
    """`duffing` from 0.8 to 1.5 rad/s."""
    return frequency_response_curve(
        duffing(), (0.8, 1.5), harmonics=harmonics, stability=stability, options=StepOptions(largest=0.2)
    )


def limit_points() -> tuple[Row, ...]:
    """H2: folds of the forced oscillator, its largest amplitude and its stability between the folds."""
    rows = []
    for harmonics, folds in (
        (11, (("1.2696019555", "2.8250167129"), ("1.1157002518", "1.0818703234"))),
        (1, (("1.2675369595", "2.8362225966"), ("1.1155859272", "1.0840801128"))),
    ):
        branch = response_curve(harmonics)
        for index, (omega, amplitude), name in zip(branch.folds, folds, ("upper", "lower"), strict=True):
            name = f"Duffing, {harmonics} harmonics: {name} fold,"
            frequency = branch.parameter[index], first(branch.lines[index])
            rows.append(within("H2", NLVIB, f"{name} frequency", float(omega), frequency[0], 1e-9))
            rows.append(within("H2", NLVIB, f"{name} first harmonic", float(amplitude), frequency[1], 1e-8))
    branch = response_curve(11)
    upper, lower = branch.folds
    wrong = ~branch.stable[:upper], branch.stable[upper + 1 : lower], ~branch.stable[lower + 1 :]
    wrong = sum(int(np.sum(part)) for part in wrong)
    rows.append(counted("H2", "theory", "Duffing: verdicts that do not change at the folds", 0, wrong))
    return (*rows, *largest_amplitude(branch), *phase_resonance())


def largest_amplitude(branch: Branch) -> tuple[Row, ...]:
    """H2: the top of the curve between its points; shooting confirms it on both sides and on top."""
    omega, amplitude, top = branch_maximum(branch, first)
    near = solve_harmonic_balance(duffing(), 1.26869, harmonics=11, start=top)
    quantity = "Duffing, 11 harmonics: first harmonic at Omega = 1.26869"
    rows = [printed("H2", NLVIB, quantity, "2.830197", first(near.deflection))]
    line = top.deflection[0, 1]
    start = ([line.real], [-omega * line.imag])
    # close to the fold two solutions lie near each other: the start is the balanced motion
    low, here, high = (
        first(solve_shooting(duffing(), w, start=start, harmonics=11).solution.deflection)
        for w in (omega - 3e-5, omega, omega + 3e-5)
    )
    quantity = f"Duffing, 11 harmonics: largest first harmonic, at Omega = {omega:.7f}"
    rows.append(within("H2", "shooting at the same frequency", quantity, here, amplitude, 1e-9))
    # the vertex of the parabola through the three amplitudes
    vertex = omega + 1.5e-5 * (high - low) / (2.0 * here - low - high)
    quantity = "Duffing, 11 harmonics: frequency of the largest first harmonic"
    rows.append(within("H2", "parabola through three shootings", quantity, vertex, omega, 1e-6))
    return tuple(rows)


def phase_resonance() -> tuple[Row, ...]:
    """H2: one harmonic in quadrature with the force."""
    start = np.array([[0.0, -2.8j]])
    lines, omega = balanced_at_condition(harmonic_balance(duffing(), harmonics=1), start, 1.26, lambda x: x[0, 1].real)
    name = "Duffing, 1 harmonic: phase resonance,"
    closed = 0.18 / (0.05 * omega), np.sqrt(1.0 + 0.075 * first(lines) ** 2)
    return (
        printed("H2", NLVIB, f"{name} amplitude", "2.8412229", first(lines)),
        printed("H2", NLVIB, f"{name} frequency", "1.2670600", omega),
        within("H2", "P / (zeta Omega)", f"{name} amplitude", closed[0], first(lines), 1e-11),
        within("H2", "sqrt(1 + 3 gamma a^2 / 4)", f"{name} frequency", closed[1], omega, 1e-11),
    )


def shooting_motion(amplitude: float) -> ShootingSolution:
    """`duffing` at 1.2 rad/s from the start of a single harmonic."""
    line = one_harmonic(amplitude, 1.2)
    start = ([line.real], [-1.2 * line.imag])
    return solve_shooting(duffing(), 1.2, start=start, harmonics=15, integration=1e-12, tolerance=1e-11)


def three_motions() -> tuple[Row, ...]:
    """H2: the three solutions at one frequency and their multipliers, two routes."""
    rows = []
    for name, amplitude, *multipliers in MOTIONS:
        lines = np.zeros((1, 16), complex)
        lines[0, 1] = one_harmonic(float(amplitude), 1.2)
        solution = solve_harmonic_balance(duffing(), 1.2, harmonics=15, start=lines)
        shot = shooting_motion(float(amplitude))
        floquet = floquet_verdict(duffing(), solution, tolerance=1e-11)
        hill = hill_verdict(duffing(), solution)
        stable = int(name != "middle")
        label = f"Duffing, Omega = 1.2, {name} solution:"
        for route, deflection, values, verdict in (
            ("harmonic balance", solution.deflection, floquet.multipliers, floquet.stable),
            ("Hill's method", solution.deflection, hill.multipliers, hill.stable),
            ("shooting", shot.solution.deflection, shot.multipliers, shot.stable),
        ):
            if route != "Hill's method":
                quantity = f"{label} first harmonic by {route}"
                rows.append(printed("H2", NLVIB, quantity, amplitude, first(deflection), digits=2))
            rows.append(counted("H2", NLVIB, f"{label} stable by {route} (1 yes)", stable, verdict))
            product = np.prod(values).real
            quantity = f"{label} product of the multipliers, {route}"
            rows.append(within("H2", "exp(-zeta T)", quantity, 0.7696654125, product, 2e-10))
            if multipliers[0] is not None:
                # each reference against the nearest one: rounding may order a pair either way
                error = np.abs(values[:, None] - np.array(multipliers)).min(axis=0).max()
                rows.append(at_most("H2", NLVIB, f"{label} error of the multipliers, {route}", 1e-8, error))
    return tuple(rows)


def dead_zone() -> tuple[Row, ...]:
    """H4: free vibration over a dead zone."""
    rows = []
    problem = oscillator(PiecewiseSprings([0], [-1.0, 1.0], [1.0, 0.0, 1.0]))
    for amplitude, period in ((2.0, "10.283185307"), (1.5, "14.283185307"), (5.0, "7.283185307")):
        vibration = solve_free_vibration(problem, ([amplitude], [0.0]), 0.9 * float(period), harmonics=1)
        quantity = f"backlash b = 1, A = {amplitude:g}: period by shooting"
        rows.append(printed("H4", "2 pi + 4 b / (A - b)", quantity, period, vibration.period))
        error = abs(np.linalg.det(vibration.monodromy) - 1.0)
        quantity = f"backlash b = 1, A = {amplitude:g}: determinant of the monodromy less one"
        rows.append(at_most("H4", "no damping", quantity, 1e-9, error))
    return tuple(rows)


def two_masses() -> NonlinearSystem:
    """Ground, spring, 1 kg, spring, 1 kg, and a gap of 0.1 mm on both sides of the second mass; 30 N."""
    stiffness = 1e6 * np.array([[2.0, -1.0], [-1.0, 1.0]])
    system = MechanicalSystem(
        np.eye(2), 0.0 * stiffness, stiffness, np.array([[0.0], [1.0]]), np.zeros(2), ("x1", "x2")
    )
    system = replace(system, C=modal_damping(system, np.zeros(1), 0.008))
    stops = PiecewiseSprings([0], [-1e-4, 1e-4], [5e6, 0.0, 5e6], 1e-6)
    return NonlinearSystem(system, (stops,), (HarmonicForce([30.0, 0.0]),))


def stops() -> tuple[Row, ...]:
    """H4: two masses with stops from 40 to 250 Hz, past two losses of symmetry and two folds."""
    problem, name = two_masses(), "two masses with stops:"
    ends = 2.0 * np.pi * np.array([40.0, 250.0])
    branch = frequency_response_curve(problem, ends, harmonics=25, options=StepOptions(largest=0.2))
    first_point, other = branch.branch_points
    top, bottom = branch.folds
    legs = np.split(branch.stable, [first_point, other, top, bottom])
    # next to the borders the largest multiplier is one to rounding
    wrong = sum(int(np.sum(leg[2:-2] != stable)) for leg, stable in zip(legs, (True, False) * 3))
    rows = [
        counted("H4", "theory", f"{name} branch reaches 250 Hz (1 yes)", 1, branch.complete),
        counted("H4", "theory", f"{name} verdicts that do not change at branch points and folds", 0, wrong),
    ]
    for hertz, part in (
        (105.0, np.arange(first_point)),
        (200.0, np.arange(other, top)),
        (200.0, np.arange(bottom, len(branch.parameter))),
    ):
        i = part[np.argmin(np.abs(branch.parameter[part] - 2.0 * np.pi * hertz))]
        settled, line = settled_line(problem, branch.solutions[i]), branch.lines[i][0, 1]
        side = "up to the loss of symmetry" if part[0] == 0 else "upper" if part[-1] < bottom else "lower"
        quantity = f"{name} {side}, {branch.parameter[i] / 2 / np.pi:.2f} Hz: error of the first harmonic"
        error = abs(line - settled) / abs(settled)
        rows.append(at_most("H4", "integration in time by SciPy's DOP853", quantity, 1e-5, error))
    return tuple(rows)


def settled_line(problem: NonlinearSystem, solution, periods: int = 300, samples: int = 128) -> complex:
    """First harmonic of the first column after many periods, from the motion of a solution 1 % too large."""
    system, omega = problem.system, float(solution.frequency[0])
    lines = displacements(problem, solution)
    velocity = 1j * solution.line_frequency * lines
    start = 1.01 * np.concatenate([lines.sum(axis=1).real, velocity.sum(axis=1).real])
    inverse, n = np.linalg.inv(system.M), len(system.M)
    matrix = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ system.K, -inverse @ system.C]])
    push = np.concatenate([np.zeros(n), inverse @ problem.forces[0].force.real])
    column = np.concatenate([np.zeros(n), inverse @ system.W[:, 0]])
    stop = problem.elements[0]
    gap, stiffness, soft = stop.breaks[1], stop.slopes[0], stop.smoothing

    def rate(t, y):
        x = float(system.W[:, 0] @ y[:n])
        over, under = (0.5 * (d + math.sqrt(d * d + soft * soft)) for d in (x - gap, -x - gap))
        return matrix @ y + math.cos(omega * t) * push - stiffness * (over - under) * column

    times = 2.0 * np.pi / omega * (periods + np.arange(samples) / samples)
    run = solve_ivp(rate, (0.0, times[-1]), start, method="DOP853", rtol=1e-9, atol=1e-12, t_eval=times)
    return complex(np.fft.rfft(system.W[:, 0] @ run.y[:n])[1] * 2.0 / samples)


def truss() -> tuple[Row, ...]:
    """H5: von Mises truss, half span 1, height 0.1, EA = 1."""
    height, rest = 0.1, np.hypot(1.0, 0.1)

    def balance(v, load):
        rise = height - v[0]
        length = np.hypot(1.0, rise)
        force = 2.0 * (1.0 / length - 1.0 / rest) * rise
        slope = -2.0 * (1.0 / length - 1.0 / rest - rise**2 / length**3)
        return np.array([force - load]), np.array([[slope]]), np.array([-1.0])

    curve = continue_curve(balance, [0.0], 0.0, limits=(-1e-3, 1e-3), scale=0.1)
    first_fold, two = curve.folds
    place, load = curve.points[first_fold, 0], curve.parameter[first_fold]
    source, name = "h - sqrt(L^(2/3) - 1), L the length at rest", "von Mises truss:"
    return (
        printed("H5", CLOSED, f"{name} limit load", "3.81087190e-4", load),
        printed("H5", source, f"{name} displacement at the limit load", "0.0423607465", place),
        within("H5", "symmetry", f"{name} second limit load", -load, curve.parameter[two], 1e-11),
        counted("H5", "theory", f"{name} curve reaches the load 1e-3 (1 yes)", 1, curve.parameter[-1] == 1e-3),
    )


def manufactured() -> tuple[Row, ...]:
    """H6: error of harmonic balance against a motion chosen beforehand."""
    omega, samples = 0.7, 8192
    tau = 2.0 * np.pi * np.arange(samples) / samples
    springs = PiecewiseSprings([0], [-0.5, 0.5], [2.0, 0.3, 2.0])
    smooth = manufactured_errors(
        PolynomialSprings([0], [[1.0, 0.5, 0.8]]), 1.0 / (1.5 - np.cos(tau)), omega, (8, 16, 32)
    )
    # the acceleration that balances the corners of the force has corners too
    corners = np.cos(tau) + 0.05 * np.abs(np.sin(1.5 * tau)) ** 3
    piecewise = manufactured_errors(springs, corners, omega, (24, 48, 96, 192))
    rows = []
    decay = np.log((3.0 + np.sqrt(5.0)) / 2.0)
    for low, high, error, two in zip((8, 16), (16, 32), smooth, smooth[1:]):
        quantity = f"smooth law: decay of the error a harmonic, {low} to {high} harmonics"
        source = "lines of 1 / (1.5 - cos) fall by 0.381966 a harmonic"
        rows.append(within("H6", source, quantity, decay, np.log(error / two) / (high - low), 0.05))
    for low, error, two in zip((24, 48, 96), piecewise, piecewise[1:]):
        quantity = f"piecewise law: order of the error, {low} to {2 * low} harmonics"
        source = "lines fall with the fourth power, their sum with the third"
        rows.append(within("H6", source, quantity, 3.0, np.log2(error / two), 0.2, relative=False))
    return tuple(rows)


def manufactured_errors(law, motion: np.ndarray, omega: float, counts) -> list[float]:
    """Largest error in time, for every number of harmonics, under the force that the motion needs."""
    samples = len(motion)
    top = samples // 4
    tau = 2.0 * np.pi * np.arange(samples) / samples
    lines, order = harmonics_of(motion, top), 1j * omega * np.arange(top + 1)
    padded = np.zeros(samples // 2 + 1, complex)
    padded[: top + 1] = lines * (order**2 + 0.1 * order) * samples / 2
    force = law.evaluate(motion[:, None, None], tau[:, None])[0][:, 0, 0]
    load = harmonics_of(np.fft.irfft(padded, n=samples) + force, top)
    errors = []
    for count in counts:
        forces = [(load[h], (h,)) for h in range(1, count + 1)]
        problem = oscillator(law, damping=0.1, load=load[0].real, forces=forces)
        start = lines[None, : count + 1]
        solution = solve_harmonic_balance(problem, omega, harmonics=count, start=start, samples=samples)
        errors.append(float(np.abs(solution.at(tau / omega)[:, 0] - motion).max()))
    return errors
