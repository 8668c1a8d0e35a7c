"""Spectra of the mesh forces of a gearbox in time, and the stages that integrate it and make them.

Spectra are windowed and averaged, over frequency and over orders of the shaft that gives the speed. Lines are named for
what makes them: mesh harmonics, side bands of turning carriers, sums and differences of two meshes.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.dependencies import Steps
from femgear.curves import not_a_knot
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.time.free_turn import SpeedRange
from femgear.solvers.time.low_pass import PASS_BAND
from femgear.solvers.time.spun_system import DRIVE
from femgear.stages.protocol import Progress, one_blas_thread, silent
from femgear.trains.gearbox.case_file import GearboxCase
from femgear.trains.gearbox.transient import (
    ALL_MOTIONS,
    TORSIONAL,
    GearboxInTime,
    gearbox_in_time,
    integrate,
    torsional_state,
)
from femgear.trains.gearbox.transient_checks import check_turning, run_outline
from femgear.trains.gearbox.transient_results import (
    WINDOW,
    AveragedSpectrum,
    MeshLine,
    SpectrumResult,
    TransientResult,
    bases_of_meshes,
)

if TYPE_CHECKING:
    from femgear.storage.results import Results

# Share of its strain energy that a mode has in the meshes where they drive it noticeably.
_MESH_SHARE = 0.1
# Orders are read off up to this share of the record rate: beyond it the interpolation takes more than 1.4 %.
_ORDERS = 0.25
# Mesh harmonics and side bands of the carrier's turn that have names.
_HARMONICS, _SIDE_BANDS = 3, 3
# Half the main lobe of Hann's window in lines (F. J. Harris, Proc. IEEE 66, 1978, 51-83).
_LOBE = 2.0


@one_blas_thread()
def solve_box_transient(
    case: GearboxCase, deflection: Any, *, progress: Progress = silent, steps: Steps | None = None
) -> TransientResult:
    """Integrate the motion of a gearbox in time; records are low-passed before they are thinned out.

    ConvergenceError: the motion outgrows the numbers, or all sense (E-DIVERGED).
    """
    transient, state = case.transient, deflection.of(case).state
    assert transient is not None
    outline, motions, mode = run_outline(case), {}, 0.0
    variants = (ALL_MOTIONS, TORSIONAL) if transient.torsional else (ALL_MOTIONS,)
    for done, variant in enumerate(variants):
        linearised = state if variant == ALL_MOTIONS else torsional_state(state, steps=steps)
        model = gearbox_in_time(linearised, transient, steps=steps)
        if variant == ALL_MOTIONS:
            mode = mesh_mode(model, outline.highest_mesh * transient.harmonics)
        tell_share = lambda share, done=done: progress("transient", done + share, len(variants))  # noqa: E731
        motions[variant] = integrate(model, every=outline.every, progress=tell_share)
    return TransientResult(motions, mode)


def mesh_mode(model: GearboxInTime, limit: float) -> float:
    """Find the frequency of the highest mode that the meshes drive noticeably [Hz]; 0 without any.

    Modes with mean mesh stiffnesses; the share of the meshes in the strain energy of a mode ``phi`` is ``sum(k (w^T
    phi)^2) / omega^2`` (R. G. Parker and J. Lin, J. Vib. Acoust. 126, 2004, 68-76). Modes above the limit, the highest
    line of the mesh stiffness [Hz], answer it as springs do, not by resonance.
    """
    spun = model.spun.kept_together
    if not len(spun.side):
        return 0.0
    W = spun.basic @ spun.selection(np.zeros(1))[0]
    stiffness = spun.stiffness[:-1].mean(axis=0) if len(spun.stiffness) > 1 else spun.stiffness[0]
    plain = replace(spun.system, W=W, C=0.0 * spun.system.C, load=0.0 * spun.system.load)
    modes = undamped_modes(plain, stiffness)
    of_meshes = np.where(spun.side == DRIVE, stiffness, 0.0)
    driven = of_meshes @ modes.mesh_deflection**2 > _MESH_SHARE * (2.0 * np.pi * modes.frequency) ** 2
    return float(modes.frequency[driven & (modes.frequency <= limit)].max(initial=0.0))


def solve_box_spectrum(case: GearboxCase, transient: TransientResult) -> SpectrumResult:
    """Compute spectra of the mesh forces after the start, over frequency and orders of the shaft that gives the speed.

    CaseError: a shaft that nearly stops or turns back (E-SPECTRUM).
    """
    given, outline = case.transient, run_outline(case)
    assert given is not None
    first, model, settle, rate = transient.first.run, transient.first.model, given.settled, outline.record_rate
    late, step = first.time >= settle, 1.0 / rate
    span = float(np.ptp(first.time[late]))
    resolution = given.resolution or max(0.1, 4.0 / span)
    runs = {variant: motion.run for variant, motion in transient.motions.items()}
    sense = np.sign(model.speed)
    speed = float(sense * first.speed[late].mean())
    turns = float(np.ptp(first.angle[late])) / (2.0 * np.pi)
    slowest = min(float((sense * run.speed[late]).min()) for run in runs.values())
    check_turning(outline.shaft, SpeedRange(speed, speed, slowest, speed, speed))
    lines = mesh_lines(model)
    per_turn = int(np.ceil(2.0 * np.pi * rate / slowest))
    distance = 1.0 / (0.99 * turns)
    spectra, tracked, amplitudes = {}, {}, {}
    for variant, run in runs.items():
        force, angle, turning = run.force[late], sense * run.angle[late], sense * run.speed[late]
        spectra[variant] = averaged_spectrum(force, step, resolution=resolution)
        spectrum = angle_spectrum(force, angle, resolution=distance, per_turn=per_turn)
        kept = spectrum.frequency <= _ORDERS * rate * 2.0 * np.pi / turning.max()
        tracked[variant] = replace(
            spectrum, frequency=spectrum.frequency[kept], amplitude=spectrum.amplitude[..., kept]
        )
        amplitudes[variant] = line_amplitudes(force, angle, turning, lines, record_rate=rate)
    resolved = resolved_lines(model, lines, distance)
    return SpectrumResult(transient, settle, speed, spectra, tracked, lines, amplitudes, distance, resolved)


def mesh_lines(model: GearboxInTime) -> tuple[MeshLine, ...]:
    """List mesh harmonics, side bands of the carrier's turn, sums and differences of two meshes."""
    names, ratio, lines = model.box.bases, np.abs(model.base_ratio), []

    def add(name: str, orders: dict[int, int]) -> None:
        vector = np.zeros(len(names), int)
        vector[list(orders)] = list(orders.values())
        order = float(vector @ ratio)
        if order:
            lines.append(MeshLine(name, tuple(int(o) for o in vector), abs(order)))

    for stage in model.stages:
        mesh, turn = stage.mesh_base, stage.turn_base
        text = names[mesh]
        if stage.turns:
            add(f"{names[turn]} turn", {turn: 1})
        for h in range(1, _HARMONICS + 1):
            add(text if h == 1 else f"{h} x {text}", {mesh: h})
        for k in (*range(-_SIDE_BANDS, 0), *range(1, _SIDE_BANDS + 1)) if stage.turns else ():
            words = f"{'+' if k > 0 else '-'} {abs(k)} turn{'s' if abs(k) > 1 else ''}"
            add(f"{text} {words}", {mesh: 1, turn: k})
    for first, second in itertools.combinations([stage.mesh_base for stage in model.stages], 2):
        for sign, word in ((1, "+"), (-1, "-")):
            add(f"{names[second]} {word} {names[first]}", {second: 1, first: sign})
    return tuple(lines)


def resolved_lines(model: GearboxInTime, lines, distance: float) -> np.ndarray:
    """Tell whether Hann's window parts lines (L,) from one another and harmonics; distance of orders."""
    order = np.array([line.order for line in lines])
    meshes = np.abs(model.base_ratio)[np.unique(bases_of_meshes(model))]
    harmonics = np.outer(np.arange(1, 11), meshes).ravel()
    apart = np.abs(order[:, None] - np.concatenate([order, harmonics]))
    # the line itself, twice where it is a mesh harmonic
    apart[apart < 1e-9 * order.max(initial=1.0)] = np.inf
    return apart.min(axis=1, initial=np.inf) >= _LOBE * distance


def line_amplitudes(signal, angle, speed, lines, *, record_rate: float) -> np.ndarray:
    """Compute amplitudes (L, c) of lines in signals (n, c), by projection on them at their exact orders.

    The signals are records of equal distance in time, ``record_rate`` [Hz]; angle (n,) [rad] and speed (n,) [rad/s]
    are those of the shaft that gives the speed. Hann's window over the angle; the mean is taken off. NaN beyond the
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


def transient_verdict(result: TransientResult) -> dict:
    """Tell steps, balances, and the shares of steps in which meshes pull or touch behind, for the manifest."""
    runs = {variant: motion.run for variant, motion in result.motions.items()}
    return {
        "steps": result.first.run.steps,
        "energy": max(run.energy_balance.error for run in runs.values()),
        "momentum": max(run.momentum for run in runs.values()),
        "pulling": {variant: float(np.max(run.pulling, initial=0.0)) for variant, run in runs.items()},
    }


def spectrum_verdict(result: SpectrumResult) -> dict:
    """Count lines and segments, for the manifest."""
    return {
        "lines": len(result.lines),
        "segments": min(spectrum.segments for spectrum in result.spectra.values()),
    }


def sign_of_forces(results: Results, stem: str) -> Iterator[str]:
    """Tell what a force without its usual sign means, for the caption of its picture."""
    transient = results.case.transient
    if stem == "transient_forces" and transient is not None:
        if transient.contact_loss:
            yield "Zero: the teeth are apart; negative: their back flanks touch."
        else:
            yield "Negative: the mesh is linear and pulls; real teeth would part."
