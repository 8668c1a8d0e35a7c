"""The pipeline of a drivetrain case: modes, transient -> spectrum.

Spectra of mesh forces are windowed and averaged, over frequency and over orders of the first body. Lines are
named for what makes them: mesh harmonics, side bands of the turning carriers, sums and differences of two
meshes.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from femgear.curves import not_a_knot
from femgear.errors import ConvergenceError
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.linear.tracking import campbell_data
from femgear.stages.protocol import FiguresOf, Progress, Stage, Train, modes_verdict, one_blas_thread, silent
from femgear.trains.drivetrain.case_file import DrivetrainCase, settle_time, torque_histories
from femgear.trains.drivetrain.checks import (
    check_drivetrain,
    check_spectrum,
    check_turning,
    drivetrain_warnings,
    record_every,
    record_rate,
)
from femgear.trains.drivetrain.model import BENDING, TORSIONAL, DrivetrainModel, case_model
from femgear.trains.drivetrain.results import (
    WINDOW,
    AveragedSpectrum,
    DrivetrainModesResult,
    MeshLine,
    SpectrumResult,
    TransientResult,
    describe_drivetrain,
    describe_drivetrain_modes,
    describe_spectrum,
    describe_transient,
)
from femgear.trains.drivetrain.simulation import PASS_BAND, DrivetrainRun, Records, march_drivetrain

if TYPE_CHECKING:
    from femgear.storage.results import Results

# Campbell diagram: speeds, and modes up to so many times those of operation and mesh lines.
_SPEEDS, _FASTEST, _HIGHEST, _MOST_BRANCHES = 21, 10.0 / 3.0, 2.5, 40
# Orders are read off up to this share of the record rate: beyond it the interpolation takes more than 1.4 %.
_ORDERS = 0.25
# Mesh harmonics and side bands of the carrier's turn that have names.
_HARMONICS, _SIDE_BANDS = 3, 3
# Half the main lobe of Hann's window in lines (F. J. Harris, Proc. IEEE 66, 1978, 51-83).
_LOBE = 2.0
# Growth of the free motion from which linear meshes are asked whether the motion means anything, and the
# vibration of a body over its own speed that means nothing.
_GROWN, _WILD = 1e3, 100.0


@one_blas_thread()
def solve_drivetrain_modes(case: DrivetrainCase) -> DrivetrainModesResult:
    """Solve for natural frequencies and modes, and the Campbell diagram with the mesh lines."""
    model, speed = check_drivetrain(case), case.operation.speed
    modes = undamped_modes(model.still, model.mean_stiffness)
    still = replace(model.still, gyroscopic=model.system.gyroscopic)
    orders = model.base_ratio[np.unique(model.mesh_base)]
    top = _HIGHEST * speed * orders.max(initial=1.0) / (2.0 * np.pi)
    most = min(_MOST_BRANCHES, len(modes.frequency) - 1)
    count = int(np.clip(np.count_nonzero(modes.frequency < top), min(2, most), most))
    speeds = np.linspace(0.0, _FASTEST * speed, _SPEEDS)
    campbell = campbell_data(lambda _: still, speeds, model.mean_stiffness, orders=orders, count=count)
    ratio = np.where(modes.frequency > 0.0, case.simulation.damping_ratio, 0.0)
    return DrivetrainModesResult(model, replace(modes, damping_ratio=ratio), campbell, speed)


@one_blas_thread()
def solve_transient_run(case: DrivetrainCase, *, progress: Progress = silent) -> TransientResult:
    """Integrate the motion of a case in time; records are low-passed before they are thinned out.

    ConvergenceError: the motion outgrows the numbers, or all sense (E-DIVERGED).
    """
    check_drivetrain(case)
    variants = (BENDING, TORSIONAL) if case.simulation.torsional else (BENDING,)
    models, runs, torques = {}, {}, ()
    for done, variant in enumerate(variants):
        model = models[variant] = case_model(case, variant)
        torques = torque_histories(case, model.ratio)
        tell_share = lambda share, done=done: progress("transient", done + share, len(variants))  # noqa: E731
        runs[variant] = _run(case, variant, model, torques, tell_share)
    return TransientResult(models, runs, torques)


def _run(case: DrivetrainCase, variant: str, model, torques, tell_share) -> DrivetrainRun:
    s = case.simulation
    try:
        run = march_drivetrain(
            model,
            torques,
            duration=s.duration,
            step=1.0 / s.rate,
            speed=case.operation.speed,
            start=s.start,
            outputs=[f"{body.name}: rotation" for body in model.train.bodies],
            records=Records(record_every(case, model), lowpass=True, told=tell_share),
            contact_loss=s.contact_loss,
        )
    except ConvergenceError as error:
        if error.code == "E-DIVERGED":
            error.key, error.message = "simulation.damping_ratio", f"{variant}: {error.message}"
        raise
    _check_sense(run, variant, list(model.ratio.values()))
    return run


def _check_sense(run: DrivetrainRun, variant: str, ratio) -> None:
    """Refuse motions that have grown beyond sense, however exact their balances are."""
    if not run.gain > _GROWN:
        return
    fastest = np.abs(run.spin_speed).max() * np.abs(ratio)
    vibration = np.abs(run.velocity).max(axis=0)
    worst = int(np.argmax(vibration - _WILD * fastest))
    if vibration[worst] <= _WILD * fastest[worst]:
        return
    body = run.outputs[worst].split(":")[0]
    cause, remedy = (
        ", a parametric resonance",
        "another speed, or write contact_loss = true: real meshes separate",
    )
    if run.contact_loss:
        # impacts feed energy into a step rule that is too coarse for them
        cause, remedy = ": an unstable motion, or steps too long for its impacts", "a higher simulation.rate"
    raise ConvergenceError(
        f"{variant}: {body} vibrates with {vibration[worst]:.3g} rad/s beside {fastest[worst]:.3g} rad/s of "
        f"its own speed: the free motion grows {run.gain:.2g} times within the run{cause}",
        code="E-DIVERGED",
        key="simulation.damping_ratio",
        limit=f"vibration below {_WILD:g} times the speed of the body, where motions grow",
        remedy=f"give more damping, or {remedy}",
    )


def solve_spectrum(case: DrivetrainCase, transient: TransientResult) -> SpectrumResult:
    """Compute spectra of the mesh forces after the start, over frequency and orders of the first body.

    Refuses what `check_spectrum` does.
    """
    model = transient.models[BENDING]
    check_spectrum(case, model)
    first, settle = next(iter(transient.runs.values())), settle_time(case)
    rate = record_rate(case, model)
    late, step = first.time >= settle, 1.0 / rate
    span = float(np.ptp(first.time[late]))
    resolution = case.simulation.resolution or max(0.1, 4.0 / span)
    speed = float(first.spin_speed[late].mean())
    turns = float(np.ptp(first.spin[late])) / (2.0 * np.pi)
    slowest = min(float(run.spin_speed[late].min()) for run in transient.runs.values())
    check_turning(slowest, speed)
    lines = mesh_lines(model)
    per_turn = int(np.ceil(2.0 * np.pi * rate / slowest))
    distance = 1.0 / (0.99 * turns)
    spectra, tracked, amplitudes = {}, {}, {}
    for variant, run in transient.runs.items():
        force, angle = run.force[late], run.spin[late]
        spectra[variant] = averaged_spectrum(force, step, resolution=resolution)
        spectrum = angle_spectrum(force, angle, resolution=distance, per_turn=per_turn)
        kept = spectrum.frequency <= _ORDERS * rate * 2.0 * np.pi / run.spin_speed[late].max()
        tracked[variant] = replace(
            spectrum, frequency=spectrum.frequency[kept], amplitude=spectrum.amplitude[..., kept]
        )
        amplitudes[variant] = line_amplitudes(force, angle, run.spin_speed[late], lines, record_rate=rate)
    resolved = resolved_lines(model, lines, distance)
    return SpectrumResult(transient, settle, speed, spectra, tracked, lines, amplitudes, distance, resolved)


def mesh_lines(model: DrivetrainModel) -> tuple[MeshLine, ...]:
    """List mesh harmonics, side bands of the carrier's turn, sums and differences of two meshes."""
    count, planets = len(model.bases), len(model.geometry.even)
    meshes = [base for base in range(count) if base % 2 or base >= 2 * planets]
    lines = []

    def add(name: str, orders: dict[int, int]) -> None:
        vector = np.zeros(count, int)
        vector[list(orders)] = list(orders.values())
        order = float(vector @ model.base_ratio)
        if order:
            lines.append(MeshLine(name, tuple(int(o) for o in vector), abs(order)))

    for base in meshes:
        text = model.bases[base]
        if base < 2 * planets:
            add(model.bases[base - 1], {base - 1: 1})
        for h in range(1, _HARMONICS + 1):
            add(text if h == 1 else f"{h} x {text}", {base: h})
        for k in (*range(-_SIDE_BANDS, 0), *range(1, _SIDE_BANDS + 1)) if base < 2 * planets else ():
            words = f"{'+' if k > 0 else '-'} {abs(k)} turn{'s' if abs(k) > 1 else ''}"
            add(f"{text} {words}", {base: 1, base - 1: k})
    for first, second in itertools.combinations(meshes, 2):
        for sign, word in ((1, "+"), (-1, "-")):
            add(f"{model.bases[second]} {word} {model.bases[first]}", {second: 1, first: sign})
    return tuple(lines)


def resolved_lines(model: DrivetrainModel, lines, distance: float) -> np.ndarray:
    """Tell whether Hann's window parts lines (L,) from one another and harmonics; distance of orders."""
    order = np.array([line.order for line in lines])
    harmonics = np.outer(np.arange(1, 11), model.base_ratio[np.unique(model.mesh_base)]).ravel()
    apart = np.abs(order[:, None] - np.concatenate([order, harmonics]))
    # the line itself, twice where it is a mesh harmonic
    apart[apart < 1e-9 * order.max(initial=1.0)] = np.inf
    return apart.min(axis=1, initial=np.inf) >= _LOBE * distance


def line_amplitudes(signal, angle, speed, lines, *, record_rate: float) -> np.ndarray:
    """Compute amplitudes (L, c) of lines in signals (n, c), by projection on them at their exact orders.

    The signals are records of equal distance in time, ``record_rate`` [Hz]; angle (n,) [rad] and speed (n,)
    [rad/s] are those of the first body. Hann's window over the angle; the mean is taken off. NaN beyond the
    pass band of the records.
    """
    part = (angle - angle[0]) / (angle[-1] - angle[0])
    weight = (0.5 - 0.5 * np.cos(2.0 * np.pi * part)) * speed
    weight = weight / weight.sum()
    signal = np.asarray(signal, float)
    signal = signal - weight @ signal
    amplitudes = np.full((len(lines), signal.shape[1]), np.nan)
    for row, line in enumerate(lines):
        if line.order * np.abs(speed).max() / (2.0 * np.pi) <= 0.5 * PASS_BAND * record_rate:
            amplitudes[row] = 2.0 * np.abs((weight * np.exp(-1j * line.order * angle)) @ signal)
    return amplitudes


def averaged_spectrum(signal, step: float, *, resolution: float) -> AveragedSpectrum:
    """Compute the spectrum of a signal (n, ...) sampled every ``step`` [s], segments under Hann's window.

    P. D. Welch, IEEE Trans. Audio Electroacoust. 15, 1967, 70-73, of amplitudes instead of densities; the
    segments overlap by half, take ``1 / resolution`` seconds of the signal for lines ``resolution`` [Hz]
    apart, and the mean of every one is taken off. With steps in turns the lines are orders.
    """
    from scipy.signal import welch, windows

    signal = np.asarray(signal, float)
    length = round(1.0 / (resolution * step))
    hop = max(1, round(0.5 * length))
    weight = np.asarray(windows.get_window(WINDOW, length))
    options = {"window": weight, "noverlap": length - hop, "detrend": "constant", "scaling": "spectrum"}
    frequency, power = welch(signal, 1.0 / step, nperseg=length, axis=0, return_onesided=False, **options)
    kept = length // 2 + 1
    amplitude = 2.0 * np.sqrt(np.moveaxis(power[:kept], 0, -1))
    bandwidth = float(np.sum(weight**2) / weight.sum() ** 2 / step)
    segments = (len(signal) - length) // hop + 1
    return AveragedSpectrum(np.abs(frequency[:kept]), amplitude, 1.0 / (length * step), bandwidth, segments)


def angle_spectrum(signal, angle, *, resolution: float, per_turn: int) -> AveragedSpectrum:
    """Compute the spectrum of a signal over orders of an angle that need not grow evenly.

    The signal is taken at equal steps of the angle by cubic splines (K. R. Fyfe and E. D. S. Munck, Mech.
    Syst. Signal Process. 11, 1997, 187-205), then as in `averaged_spectrum`.

    Parameters
    ----------
    signal : (n, ...) array
        Samples at the angles, in any unit, which the spectrum keeps.
    angle : (n,) array
        Ascending, 4 samples or more [rad].
    resolution : float
        Distance of orders [1].
    per_turn : int
        Samples a turn, more than twice the highest order; orders above a half of it alias.
    """
    angle = np.asarray(angle, float)
    count = int((angle[-1] - angle[0]) / (2.0 * np.pi) * per_turn)
    even = angle[0] + 2.0 * np.pi / per_turn * np.arange(count)
    tracked = not_a_knot(angle, np.asarray(signal, float), even)
    return averaged_spectrum(tracked, 1.0 / per_turn, resolution=resolution)


def _transient_verdict(result: TransientResult) -> dict:
    runs = result.runs.values()
    return {
        "steps": next(iter(runs)).steps,
        "energy": max(run.energy_balance.error for run in runs),
        "momentum": max(run.momentum for run in runs),
        "pulling": {variant: float(np.max(run.pulling, initial=0.0)) for variant, run in result.runs.items()},
    }


def remarks(results: Results, stem: str) -> Iterator[str]:
    """Tell what a force without its usual sign means, for the caption of its picture."""
    if stem == "transient_forces":
        if results.case.simulation.contact_loss:
            yield "Zero: the teeth are apart; negative: their back flanks touch."
        else:
            yield "Negative: the mesh is linear and pulls; real teeth would part."


DRIVETRAIN = Train(
    name="drivetrain",
    words="a drivetrain",
    stages=(
        Stage(
            name="modes",
            title="Modes",
            solve=solve_drivetrain_modes,
            verdict=modes_verdict,
            describe=lambda results: describe_drivetrain_modes(results.modes),
            check=check_drivetrain,
        ),
        Stage(
            name="transient",
            title="Transient",
            solve=solve_transient_run,
            options=("progress",),
            verdict=_transient_verdict,
            describe=lambda results: describe_transient(results.transient),
            check=check_drivetrain,
            warnings=TransientResult.warnings,
        ),
        Stage(
            name="spectrum",
            title="Spectrum",
            solve=solve_spectrum,
            takes=("transient",),
            verdict=lambda result: {
                "lines": len(result.lines),
                "segments": min(spectrum.segments for spectrum in result.spectra.values()),
            },
            describe=lambda results: describe_spectrum(results.spectrum),
            unavailable=lambda case: "" if case.parallel or case.planetary else "the chain has no gears",
            check=lambda case: check_spectrum(case, case_model(case)),
        ),
    ),
    describe=describe_drivetrain,
    warnings=drivetrain_warnings,
    figures=FiguresOf("femgear.trains.drivetrain.figures:FIGURES"),
    remarks=remarks,
)
