"""Wind turbine sets of NREL/CP-5000-55355: frequencies, weight, bearing clearance, tooth wedging.

The references of the nonlinear runs are computed again by `independent_weight`; the paper's own figures are
not legible enough. docs/nrel.md explains every reading.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from published.wind_turbine import (
    BACKLASH_B,
    TEETH_B,
    TORQUE_A,
    bearing_problem_a,
    drive_reduction,
    extended_problem_b,
    gravity_problem_b,
    wind_turbine_a,
    wind_turbine_b,
)
from published.wind_turbine_response import (
    contact_shares,
    member_rms,
    resonance,
    wedging_map,
    wedging_onset,
    weight_branch,
)

from femgear.errors import ConvergenceError
from femgear.solvers.periodic.harmonic_balance import displacements, solve_harmonic_balance
from femgear.solvers.time.transient import solve_transient
from femgear.stages.lumped_set import gear_set_modes
from femgear.system.fourier import side_bands
from validation import independent, independent_weight
from validation.rows import Row, at_most, information, within

PAPER = "Guo, Keller and Parker, NREL/CP-5000-55355, 2012"
# peaks and limit points lie between points of a branch, where both computations put a parabola
INTERPOLATION = 1e-4
# kind, number among the modes of its kind, as printed [Hz]
FREQUENCIES_B = (
    ("translational", 0, 40.75),
    ("rotational", 0, 69.49),
    ("translational", 1, 157.53),
    ("rotational", 1, 301.46),
)
# a gate from the digits of the inputs that is wider than this is none [relative]
USELESS = 5e-3
FREQUENCIES_A = (
    ("translational", 165.0),
    ("rotational", 292.0),
    ("translational", 311.0),
    ("translational", 796.0),
)
# shares of the nominal play
FOLDS_B = (1.0, 2.0 / 3.0, 1.0 / 3.0)
# radial clearance [m], range to look in [Hz]
RING_A = (
    (0.0, (100.0, 170.0)),
    (100e-6, (20.0, 110.0)),
    (400e-6, (15.0, 60.0)),
    (None, (15.0, 60.0)),
)


def frequencies() -> tuple[Row, ...]:
    """Natural frequencies of both sets beside the paper's."""
    rows = []
    expected, moved = _springs_b(independent.wind_turbine_b()), independent.moved_by_digits(_springs_b)
    for printed, words in ((False, "shipped reading"), (True, "as printed")):
        frequencies = _by_kind(wind_turbine_b(as_printed=printed))
        for k, (kind, number, paper) in enumerate(FREQUENCIES_B):
            name, value = f"set B, {words}: {kind} mode {number + 1} [Hz]", frequencies[kind][number]
            if printed:
                rows.append(information("PG-B", PAPER, name, paper, value))
                continue
            # half a unit of the printed frequency too
            gate, note = (moved[k] + 0.005) / paper, "half a unit of all printed digits moves it by as much"
            if gate < USELESS:
                rows.append(within("PG-B", PAPER, name, paper, value, gate, note="gate: " + note))
            else:
                note = f"no gate: half a unit of the printed digits moves it by {100 * gate:.2g} %"
                rows.append(information("PG-B", PAPER, name, paper, value, note=note))
            rows.append(within("PG-B", independent.SOURCE, name, expected[k], value, 1e-9))
    for reduced, words in ((True, "I / r^2"), (False, "polar inertias")):
        frequencies = _by_kind(wind_turbine_a(reduced_inertia=reduced))
        for kind, paper in FREQUENCIES_A:
            value = frequencies[kind][np.argmin(np.abs(frequencies[kind] - paper))]
            name = f"set A, {words}: nearest {kind} mode [Hz]"
            rows.append(information("PG-A", PAPER, name, paper, value, note="no reading reaches it"))
    return tuple(rows)


def _springs_b(net) -> np.ndarray:
    """Frequencies [Hz] of `FREQUENCIES_B`: two pairs and two single ones, ascending but for their kinds."""
    first, _, rotational, second, _, two = net.frequencies(independent.PLANAR)[:6]
    return np.array([first, rotational, second, two])


def _by_kind(data) -> dict[str, np.ndarray]:
    modes = gear_set_modes(data)
    kinds = np.array(modes.kind)
    pairs = modes.frequency[kinds == "translational"][::2]
    return {"rotational": modes.frequency[kinds == "rotational"], "translational": pairs}


def upper_fold(problem, *, harmonics: int = 9) -> float:
    """Highest limit point [Hz] between 25 and 90 Hz.

    Raises
    ------
    ConvergenceError
        The branch does not reach the end of the range (E-CONVERGENCE).
    """
    branch = weight_branch(problem, (25.0, 90.0), harmonics=harmonics)
    if not branch.complete or not len(branch.folds):
        raise ConvergenceError(f"no fold found: {branch.message}", code="E-CONVERGENCE")
    return float(branch.parameter[branch.folds].max() / (2.0 * math.pi))


def linear_peak() -> tuple[Row, ...]:
    """Response to the weight without wedging: back flanks on the line of the drive flanks."""
    problem = gravity_problem_b(own_lines=False)
    branch = weight_branch(problem, (35.0, 46.0), harmonics=3, largest=0.03)
    hertz, size = resonance(branch, member_rms(problem, branch.solutions, "carrier")[:, 0])
    source, name = independent_weight.SOURCE, "set B under weight, no wedging: peak at [Hz]"
    at, high = independent_weight.peak_without_wedging(BACKLASH_B)
    return (
        within("PG-B", source, name, at, hertz, INTERPOLATION),
        within("PG-B", source, "its carrier x [um r.m.s.]", 1e6 * high, 1e6 * size, INTERPOLATION),
    )


def folds() -> tuple[Row, ...]:
    """Hardening by tooth wedging: upper folds of set B with 9 harmonics."""
    rows = []
    for share in FOLDS_B:
        play = share * BACKLASH_B
        for driven, words in ((False, "against"), (True, "with")):
            name = f"set B, play {play * 1e6:.0f} um, torque {words} the turning: upper fold, 9 harmonics [Hz]"
            value = upper_fold(gravity_problem_b(backlash=play, driven=driven))
            reference = independent_weight.upper_fold(play, 1.0 if driven else -1.0)
            rows.append(within("PG-B", independent_weight.SOURCE, name, reference, value, INTERPOLATION))
    return tuple(rows)


def small_plays() -> tuple[Row, ...]:
    """Set B with little play: how far wedging shifts the resonance, further folds, contact loss."""
    rows = []
    for play in (161e-6, 60e-6):
        problem = gravity_problem_b(backlash=play, driven=False)
        branch = weight_branch(problem, (20.0, 95.0))
        if not branch.complete:
            raise ConvergenceError(f"no whole branch: {branch.message}", code="E-CONVERGENCE")
        folds = branch.parameter[branch.folds] / (2.0 * math.pi)
        closed = min(float(contact_shares(problem, solution)[:6].min()) for solution in branch.solutions)
        name = f"set B, play {play * 1e6:.0f} um, torque against the turning:"
        rows += [
            information("PG-B", PAPER, f"{name} resonance shifted to, upper fold [Hz]", 84.0, folds.max()),
            information("PG-B", PAPER, f"{name} folds from 20 to 43 Hz", 0, np.sum(folds < 43.0)),
            information(
                "PG-B",
                f"{PAPER}: contact loss at 70 to 85 Hz",
                f"{name} least share of the cycle in which drive flanks touch",
                None,
                closed,
            ),
        ]
    return tuple(rows)


def sun_support() -> tuple[Row, ...]:
    """Set A: back flanks in contact with a floating and with a supported sun, at 22.2 rpm."""
    rows, data = [], wind_turbine_a()
    for support in (data.sun.support, 1e8, 1e9):
        held = replace(data, sun=replace(data.sun, support=support))
        problem = bearing_problem_a(200e-6, backlash=150e-6, data=held)
        solution = solve_harmonic_balance(
            problem,
            2.0 * math.pi * 0.37,
            harmonics=20,
            samples=1024,
            reduction=drive_reduction(problem),
            stability=False,
        )
        back = float(contact_shares(problem, solution)[6:12].max()) if solution.converged else math.nan
        name = f"set A, play 150 um, clearance 200 um, sun support {support:.0e} N/m: share of the cycle"
        note = "Fig. 11 says that a stiffer support raises wedging"
        rows.append(information("PG-A", PAPER, f"{name} with back flanks in contact", None, back, note=note))
    return tuple(rows)


def ring_resonance() -> tuple[Row, ...]:
    """Set A: resonance of the ring over the clearance of the bearing between carrier and ring."""
    rows = []
    for clearance, limits in RING_A:
        problem = bearing_problem_a(clearance)
        # flat peaks: eight times the points of the default put the parabola within 5e-5
        branch = weight_branch(problem, limits, harmonics=9, largest=0.0025, max_points=5000)
        hertz, _ = resonance(branch, member_rms(problem, branch.solutions, "ring")[:, 0])
        words = "no carrier bearing" if clearance is None else f"clearance {clearance * 1e6:.0f} um"
        name = f"set A, {words}: ring resonance [Hz]"
        reference = independent_weight.ring_peak(clearance, limits)
        rows.append(within("PG-A", independent_weight.SOURCE, name, reference, hertz, INTERPOLATION))
    return tuple(rows)


def wedging() -> tuple[Row, ...]:
    """Set A: where back flanks begin to touch, over the clearance of the carrier bearing."""
    backlash, ratios = 150e-6, np.arange(1.10, 1.36, 0.01)
    shares = wedging_map((0.37, 2.0, 5.0, 10.0), ratios * backlash, backlash=backlash)
    onset = wedging_onset(shares) / backlash
    reference, source = 0.5 / math.sin(wind_turbine_a().pressure_angle_sun_planet), "1 / (2 sin alpha), rigid"
    name = "set A, clearance over play where back flanks begin to touch"
    note = "the loaded teeth give way and leave more play"
    rows = [
        information("PG-A", source, f"{name}, weight at {hertz:g} Hz", reference, value, note=note)
        for hertz, value in zip(shares.frequency, onset)
    ]
    rows.append(at_most("PG-A", source, f"{name}: spread over frequency", 0.02, float(np.ptp(onset))))
    left, closed = play_left(backlash, backlash)
    name = "set A, clearance = play: least play left at the ring [um]"
    source = "b + F / k_rp - 2 e sin alpha"
    rows.append(within("PG-A", source, name, 1e6 * closed, 1e6 * left, 1e-2))
    return tuple(rows)


def play_left(clearance: float, backlash: float, *, frequency: float = 0.37) -> tuple[float, float]:
    """Least play of the ring's back flanks over a turn [m], and that of the geometry without wedging.

    Both flanks of a tooth close by ``e sin alpha`` when carrier and ring lie e apart; the load F of the
    drive flanks opens the back ones by ``F / k_rp``.
    """
    problem, data = bearing_problem_a(clearance, backlash=backlash), wind_turbine_a()
    solution = solve_harmonic_balance(
        problem,
        2.0 * math.pi * frequency,
        harmonics=7,
        samples=512,
        reduction=drive_reduction(problem),
        stability=False,
    )
    x = solution.at(np.linspace(0.0, 1.0 / frequency, 721))
    apart, angle = np.hypot(x[:, -2], x[:, -1]).max(), data.pressure_angle_planet_ring
    force = TORQUE_A / (3.0 * data.centre_distance * 2.0 * math.cos(angle))
    closed = backlash + force / data.stiffness_planet_ring[0] - 2.0 * apart * math.sin(angle)
    return float(backlash - x[:, 9:12].max()), float(closed)


def extended_errors(lines=((3, 3, 3), (3, 8, 3)), *, speed: float = 30.0, steps: int = 400) -> list[float]:
    """Extended harmonic balance of set B against integration over the second turn of the carrier from rest.

    Parameters
    ----------
    lines : sequence of (carrier, mesh, bands)
        See `side_bands`.
    speed : float
        Of the carrier [rpm].
    steps : int
        Of the integration, a mesh period.

    Returns
    -------
    list of float
        Largest r.m.s. difference of a mesh force over the largest r.m.s. fluctuation of one. Deflections
        are a weaker measure: most of their fluctuation is the constant load over k(t).
    """
    problem, turns = extended_problem_b(), speed / 60.0
    frequency = 2.0 * math.pi * turns * np.array([1.0, TEETH_B[1]])
    times = np.append(0.0, np.linspace(1.0, 2.0, TEETH_B[1] * 32, endpoint=False) / turns)
    solutions, reduction = [], drive_reduction(problem)
    for counts in lines:
        solution = solve_harmonic_balance(
            problem, frequency, orders=side_bands(*counts), reduction=reduction, stability=False
        )
        solutions.append(solution)
    moved = solve_transient(problem, frequency, times, method="modal", step=1.0 / (turns * TEETH_B[1] * steps))
    force, errors = moved.force[1:], []
    for counts in solutions:
        wave = np.exp(1j * times[1:, None] * counts.line_frequency)
        errors.append(np.sqrt(((force - (wave @ counts.force.T).real) ** 2).mean(axis=0)).max())
    return [float(error / force.std(axis=0).max()) for error in errors]


def extended() -> tuple[Row, ...]:
    """Weight and mesh frequency together."""
    rows, source = [], "time integration, second turn of the carrier"
    # the first mesh harmonic meets the first mode at 35.5 to 36.5 rpm
    for speed in (30.0, 33.0, 36.0):
        few, many = extended_errors(speed=speed, steps=1000)
        name = f"set B, weight and k(t) at {speed:g} rpm: mesh forces, difference with"
        rows.append(at_most("PG-B", source, f"{name} 8 mesh harmonics", 1e-3, many))
        note = "truncation of load over k(t)"
        rows.append(information("PG-B", source, f"{name} 3 mesh harmonics", None, few, note=note))
    return tuple(rows)


def weight_against_stiffness() -> tuple[Row, ...]:
    """R.m.s. motion of set B by its weight and by k(t), at resonances of mesh harmonics."""
    problem = extended_problem_b()
    reduction = drive_reduction(problem)
    outputs = np.zeros((2, len(problem.system.M)))
    outputs[0, 0] = outputs[1, 3] = 1.0  # x of carrier and ring
    rows = []
    for speed, mode in ((18.0, "2nd, 40.8 Hz"), (36.0, "1st, 40.8 Hz"), (138.0, "1st, 156.9 Hz")):
        frequency = 2.0 * math.pi * speed / 60.0 * np.array([1.0, TEETH_B[1]])
        solution = solve_harmonic_balance(
            problem, frequency, orders=side_bands(3, 8, 3), reduction=reduction, stability=False
        )
        lines = np.abs(displacements(problem, solution, outputs, reduction=reduction)) ** 2 / 2.0
        carrier, mesh = solution.orders.T
        for name, chosen in (("weight", (mesh == 0) & (carrier != 0)), ("k(t)", mesh != 0)):
            for member, share in zip(("carrier", "ring"), lines):
                quantity = f"set B, {speed:g} rpm ({mode}): {member} x by {name}, r.m.s. [um]"
                size = 1e6 * math.sqrt(share[chosen].sum())
                rows.append(information("PG-B", "definition", quantity, None, size))
    return tuple(rows)


def ring_motion() -> tuple[Row, ...]:
    """Set A: largest r.m.s. motion of the ring over the frequency, with clearance over without."""
    largest = []
    for clearance in (0.0, 400e-6):
        problem = bearing_problem_a(clearance)
        branch = weight_branch(problem, (10.0, 180.0), harmonics=5, largest=0.03)
        largest.append(float(member_rms(problem, branch.solutions, "ring")[:, 0].max()))
    note = "the clearance that the printed number belongs to is not legible"
    quantity = "set A, ring x, largest r.m.s. over the frequency: clearance of 400 um over none"
    return (information("PG-A", PAPER, quantity, 4.6, largest[1] / largest[0], note=note),)
