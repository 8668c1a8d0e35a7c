"""Time integration: period errors, stability limits, order and energy, all measured on marched steps."""

from __future__ import annotations

import numpy as np

from femgear.errors import CaseError
from femgear.solvers.continuation.branches import Branch
from femgear.solvers.time.steps import (
    AVERAGE_ACCELERATION,
    CENTRAL_DIFFERENCE,
    FOX_GOODWIN,
    LINEAR_ACCELERATION,
    StepRule,
    stability_limit,
)
from femgear.solvers.time.stroboscopic import sweep_response
from femgear.solvers.time.transient import solve_transient
from validation.nonlinear import duffing, oscillator, response_curve
from validation.reference.step_rules import numerical_damping, period_error
from validation.rows import REPEATED, Row, at_most, counted, printed, within

HUGHES = "T. J. R. Hughes, The Finite Element Method (2000), Eq. 9.1.22"
STEP = f"eigenvalues of the step ({REPEATED})"
# m = 1, c = 0.1, k = 4, p = cos 3 t, start (1, 0): the closed form at t = 10
END = 0.2650852834949518


def marched_roots(ratio: float, method: str, **options) -> np.ndarray:
    """Roots (2,) of ``x_(k+2) = (z1 + z2) x_(k+1) - z1 z2 x_k``, which marched steps h / T = ratio obey."""
    motion = solve_transient(
        oscillator(stiffness=(2.0 * np.pi) ** 2),
        0.0,
        ratio * np.arange(40),
        start=([1.0], [0.3]),
        method=method,
        step=ratio,
        **options,
    )
    # of Newmark's family the third root is zero: it acts in the first step only
    x = motion.displacement[2:, 0]
    first, second = np.linalg.lstsq(np.column_stack([x[1:-1], x[:-2]]), x[2:], rcond=None)[0]
    return np.roots([1.0, -first, -second]).astype(complex)


def period_errors() -> tuple[Row, ...]:
    """I1: period and damping of free vibration."""
    rows = []
    for method, rule in (
        ("average acceleration", AVERAGE_ACCELERATION),
        ("linear acceleration", LINEAR_ACCELERATION),
        ("central difference", CENTRAL_DIFFERENCE),
    ):
        for ratio in (0.01, 0.05, 0.1, 0.2):
            square = (2.0 * np.pi * ratio) ** 2
            angle = np.arccos(1.0 - 0.5 * square / (1.0 + rule.beta * square))
            turn = np.abs(np.angle(marched_roots(ratio, method))).max()
            quantity = f"{method}, h/T = {ratio:g}: relative error of the period"
            expected, ours = (2.0 * np.pi * ratio / value - 1.0 for value in (angle, turn))
            source = "w h / arccos(1 - (w h)^2 / 2 / (1 + beta (w h)^2)) - 1"
            rows.append(within("I1", source, quantity, expected, ours, 1e-10, relative=False))
    roots = marched_roots(0.1, "newmark", gamma=0.6, beta=0.3025)
    turn, size = np.abs(np.angle(roots)).max(), np.abs(roots[0])
    name = "gamma = 0.6, beta = 0.3025, h/T = 0.1:"
    ours = 0.2 * np.pi / turn - 1.0, -np.log(size) / turn
    rule = StepRule(0.6, 0.3025)
    formula = float(period_error(rule, 0.1)), float(numerical_damping(rule, 0.1))
    return (
        *rows,
        printed("I1", STEP, f"{name} relative error of the period", "0.0329459", ours[0]),
        printed("I1", STEP, f"{name} damping ratio", "0.0295125", ours[1]),
        within("I1", "marched steps", f"{name} period error of the formula", ours[0], formula[0], 1e-9),
        within("I1", "marched steps", f"{name} damping ratio of the formula", ours[1], formula[1], 1e-9),
    )


def stability_limits() -> tuple[Row, ...]:
    """I2: limits from marched steps, and whether they are kept."""
    rows = []
    for method, rule, value in (
        ("linear acceleration", LINEAR_ACCELERATION, "0.5513288954"),
        ("central difference", CENTRAL_DIFFERENCE, "0.3183098862"),
        ("Fox-Goodwin", FOX_GOODWIN, "0.3898484006"),
    ):
        # 1 / (2 - z1 - z2) = 1 / (w h)^2 + beta; the limit is where z1 + z2 = -2
        ratio = 0.3
        beta = 1.0 / (2.0 - marched_roots(ratio, method).sum().real) - 1.0 / (2.0 * np.pi * ratio) ** 2
        limit = 1.0 / (2.0 * np.pi * np.sqrt(0.25 - beta))
        rows.append(printed("I2", HUGHES, f"{method}: limit of h/T, marched", value, limit))
        rows.append(printed("I2", HUGHES, f"{method}: limit of h/T, formula", value, stability_limit(rule)))
        problem, step = oscillator(stiffness=(2.0 * np.pi) ** 2), float(value)
        motion = solve_transient(
            problem,
            0.0,
            0.999 * step * np.arange(2001),
            start=([1.0], [0.0]),
            method=method,
            step=0.999 * step,
        )
        largest = np.abs(motion.displacement).max()
        rows.append(at_most("I2", "theory", f"{method}: largest motion at 0.999 of the limit", 100.0, largest))
        refused = 0
        try:
            solve_transient(problem, 0.0, [0.0, 100.1 * step], method=method, step=1.001 * step)
        except CaseError as error:
            refused = int(error.code == "E-RANGE")
        rows.append(counted("I2", "theory", f"{method}: 1.001 of the limit refused (1 yes)", 1, refused))
    return tuple(rows)


def forced_error(method: str, count: int, **options) -> float:
    """Error at t = 10 of the forced oscillator in ``count`` steps."""
    problem = oscillator(damping=0.1, stiffness=4.0, forces=[(1.0, (1,))])
    motion = solve_transient(
        problem, 3.0, [0.0, 10.0], start=([1.0], [0.0]), method=method, step=10.0 / count, **options
    )
    return float(motion.displacement[-1, 0] - END)


def order() -> tuple[Row, ...]:
    """I3: error of a forced motion over the number of steps."""
    rows, closed = [], "closed form of the forced oscillator"
    counts = 100, 200, 400, 800
    errors = [forced_error("average acceleration", count) for count in counts]
    for count, error, value in zip(
        counts, errors, ("0.04471915", "0.01136473", "0.00285250", "0.000713829"), strict=True
    ):
        rows.append(printed("I3", closed, f"average acceleration, {count} steps: error", value, error))
    for method, expected, options in (
        ("average acceleration", "1.999", {}),
        ("Fox-Goodwin", "1.99", {}),
        ("newmark", "0.84", {"gamma": 0.6, "beta": 0.3025}),
    ):
        low, high = (forced_error(method, count, **options) for count in (400, 800))
        name = "gamma = 0.6, beta = 0.3025" if options else method
        rows.append(printed("I3", closed, f"{name}: order between 400 and 800 steps", expected, np.log2(low / high)))
    for method in ("linear acceleration", "central difference", "generalised alpha", "modal"):
        low, high = (abs(forced_error(method, count)) for count in (400, 800))
        quantity = f"{method}: order between 400 and 800 steps"
        rows.append(within("I3", "theory", quantity, 2.0, np.log2(low / high), 0.01))
    problem = oscillator(damping=0.1, stiffness=4.0, forces=[(1.0, (1,))])
    for method in ("DOP853", "Radau", "LSODA"):
        motion = solve_transient(problem, 3.0, [0.0, 10.0], start=([1.0], [0.0]), method=method, tolerance=1e-9)
        error = motion.displacement[-1, 0] - END
        rows.append(at_most("I3", closed, f"{method}, tolerance 1e-9: error", 1e-7, error))
    return tuple(rows)


def energy() -> tuple[Row, ...]:
    """I4: energy after 1e5 steps."""
    steps = 100_000
    motion = solve_transient(
        oscillator(stiffness=1.0),
        0.0,
        0.1 * np.array([0.0, 0.5 * steps, steps]),
        start=([1.0], [0.0]),
        step=0.1,
    )
    total = (motion.velocity**2 + motion.displacement**2)[:, 0]
    quantity = "average acceleration, 1e5 steps of 0.1: relative drift of the energy"
    return (at_most("I4", "theory: the rule keeps the energy", quantity, 5e-13, np.abs(total - 1.0).max()),)


def sweeps() -> tuple[Row, ...]:
    """H2: sweeps up and down fall off the branches where continuation finds the folds."""
    branch = response_curve(11)
    rows, width = [], 0.002
    for name, fold, ends in (
        ("up", branch.folds[0], (1.258, 1.278)),
        ("down", branch.folds[1], (1.126, 1.106)),
    ):
        omega = branch.parameter[fold]
        number = round(abs(ends[1] - ends[0]) / width) + 1
        start = start_on(branch, ends[0], branch.folds, name)
        sweep = sweep_response(duffing(), np.linspace(*ends, number), start=start, steps=200, most=300, tolerance=1e-4)
        jumps = sweep.jumps(0.3)
        rows.append(counted("H2", "continuation", f"Duffing, sweep {name}: number of jumps", 1, len(jumps)))
        ends_of_jump = sweep.frequency[[jumps[0], jumps[0] + 1]] if len(jumps) else np.full(2, np.nan)
        place, quantity = (
            ends_of_jump.mean(),
            f"Duffing, sweep {name} in steps of {width:g}: frequency of the jump",
        )
        rows.append(within("H2", "fold by continuation", quantity, omega, place, width, relative=False))
    return tuple(rows)


def start_on(branch: Branch, omega: float, folds, name: str):
    """Displacement and velocity on the branch that a sweep follows, at its point nearest to a frequency."""
    part = slice(0, folds[0]) if name == "up" else slice(folds[1] + 1, None)
    index = int(np.argmin(np.abs(branch.parameter[part] - omega))) + (part.start or 0)
    lines, orders = branch.lines[index], branch.orders[:, 0]
    rate = 1j * orders * branch.parameter[index]
    return lines.sum(axis=1).real, (lines * rate).sum(axis=1).real
