"""Two base frequencies against long integration, the limit of one tone, and another package."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.solvers.time.transient import solve_transient
from femgear.system.force_laws import GearMeshes, PolynomialSprings
from femgear.system.fourier import FourierSeries, harmonic_lines
from femgear.system.system import HarmonicForce
from validation.nonlinear import duffing, first, oscillator
from validation.rows import Row, at_most, information, printed, within

PACKAGE = "PyPI package harmonicbalance 0.2.0"
SETTLED, END = 150.0, 750.0


def fitted_lines(times: np.ndarray, signal: np.ndarray, frequency: np.ndarray) -> np.ndarray:
    """Complex lines of a sampled signal at given frequencies, the mean first, by least squares."""
    wave = np.exp(1j * times[:, None] * frequency)
    fit = np.linalg.lstsq(np.hstack([wave.real, -wave.imag[:, 1:]]), signal, rcond=None)[0]
    lines = fit[: len(frequency)].astype(complex)
    lines[1:] += 1j * fit[len(frequency) :]
    return lines


def two_tones() -> tuple[Row, ...]:
    """A Duffing oscillator under two forces whose frequencies have no common period."""
    frequency = np.array([0.7, 0.7 * math.sqrt(3.0)])
    problem = oscillator(PolynomialSprings([0], [[1.0, 0.0, 0.3]]), damping=0.4, forces=[(0.4, (1, 0)), (0.3, (0, 1))])
    solution = solve_harmonic_balance(problem, frequency, orders=harmonic_lines(13, 2))
    times = np.concatenate([[0.0], np.linspace(SETTLED, END, 6001)])
    run = solve_transient(problem, frequency, times, method="DOP853", tolerance=1e-10)
    other = solve_transient(problem, frequency, times[:2], start=([1.0], [-1.0]), method="DOP853", tolerance=1e-10)
    gap = np.abs(other.displacement[1] - run.displacement[1])[0]
    lines = fitted_lines(times[1:], run.displacement[1:, 0], solution.line_frequency)
    size = np.abs(lines).max()
    error = np.abs(lines - solution.deflection[0])
    source, name = "DOP853, 150 s to 750 s, fitted", "Duffing, two tones, orders up to 13:"
    mixed = int(np.flatnonzero(np.all(solution.orders == [2, 1], axis=1))[0])
    combined = abs(solution.deflection[0, mixed])
    signal = np.abs(solution.at(times[1:])[:, 0] - run.displacement[1:, 0]).max()
    return (
        at_most("two tones", source, f"{name} error of all lines over the largest", 1e-4, error.max() / size),
        within("two tones", source, f"{name} line 2 w1 + w2", abs(lines[mixed]), combined, 1e-4),
        at_most("two tones", source, f"{name} error in time over the largest line", 1e-3, signal / size),
        at_most(
            "two tones",
            "theory: one motion from any start",
            f"{name} gap at 150 s between two starts, over the largest line",
            1e-9,
            gap / size,
            note="the transient has died out",
        ),
        at_most("two tones", "theory", f"{name} upper half of the lines", 1e-3, solution.tail),
    )


def one_tone() -> tuple[Row, ...]:
    """Two bases with one force only."""
    single = solve_harmonic_balance(duffing(), 1.2, harmonics=7)
    orders, rows = harmonic_lines(7, 2), []
    for base, frequency in ((0, [1.2, 1.2 * math.sqrt(2.0)]), (1, [0.5, 1.2])):
        force = [0.0, 0.0]
        force[base] = 0.18
        forces = (HarmonicForce([force[0]], (1, 0)), HarmonicForce([force[1]], (0, 1)))
        solution = solve_harmonic_balance(replace(duffing(), forces=forces), frequency, orders=orders)
        alone = orders[:, 1 - base] == 0
        name = f"two bases, force on base {base + 1} only:"
        error = np.abs(solution.deflection[0, alone] - single.deflection[0]).max() / first(single.deflection)
        beside = np.abs(solution.deflection[0, ~alone]).max()
        rows += [
            at_most("two tones", "one base", f"{name} error of the lines over the largest", 1e-11, error),
            at_most("two tones", "theory", f"{name} largest other line", 1e-13, beside),
        ]
    return tuple(rows)


def other_package() -> tuple[Row, ...]:
    """``x'' + 0.1 x' + (1 + 0.2 cos w t) x + 0.3 x^3 = 0.2 cos w t`` at w = 1.1 with 12 harmonics."""
    count, omega = 12, 1.1
    mesh = GearMeshes([0], FourierSeries([[1.0, 0.2]]), separates=False)
    problem = oscillator(mesh, PolynomialSprings([0], [[0.0, 0.0, 0.3]]), damping=0.1, forces=[(0.2, (1,))])
    start = np.zeros((1, count + 1), complex)
    start[0, 1] = 1.0
    lines = solve_harmonic_balance(problem, omega, harmonics=count, start=start).deflection[0]
    name = "parametric Duffing, 12 harmonics:"
    values = ("1.22096098", "0.02960864", "0.01465221")
    rows = [printed("package", PACKAGE, f"{name} mean", "-.0598195866", lines[0].real)]
    for h, value in enumerate(values, 1):
        rows.append(printed("package", PACKAGE, f"{name} amplitude of harmonic {h}", value, abs(lines[h])))
    try:
        theirs = package_lines(count, omega)
    except ImportError:
        note = "the package is not installed here: compared with its printed numbers only"
        return (
            *rows,
            information("package", PACKAGE, f"{name} largest line", None, first(lines[None]), note=note),
        )
    error = np.abs(lines - theirs).max() / np.abs(theirs).max()
    return (*rows, at_most("package", PACKAGE, f"{name} error of all lines over the largest", 1e-9, error))


def package_lines(count: int, omega: float) -> np.ndarray:
    """Complex lines of the same oscillator by the package.

    Raises
    ------
    ImportError
        The package is not installed; it is needed for tests only.
    """
    from harmonicbalance.fourier import Fourier
    from scipy.optimize import root

    cosine = Fourier(0.0, np.eye(count)[0], np.zeros(count), omega=omega, n=count)

    def equations(coefficients):
        x = Fourier.from_coeffs(coefficients, omega)
        return (x.dt().dt() + 0.1 * x.dt() + x + 0.2 * cosine * x + 0.3 * x**3 - 0.2 * cosine).coeffs()

    begin = Fourier(0.0, np.eye(count)[0], 0.1 * np.eye(count)[0], omega=omega, n=count)
    series = Fourier.from_coeffs(root(equations, begin.coeffs(), tol=1e-12).x, omega)
    # its derivative turns (cos, sin) into (-omega sin, omega cos): the lines are cos + i sin
    return np.append(series.coeff_dc, np.array(series.coeffs_cos) + 1j * np.array(series.coeffs_sin))
