"""The pipeline of a drivetrain case: modes, transient -> spectrum.

`DRIVETRAIN` at the end is the train: the table of its stages, with what the report says and draws of each,
and the case file of its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from femgear.errors import ConvergenceError
from femgear.threads import one_blas_thread
from femgear.trains.drivetrain.results import (
    DrivetrainModesResult,
    SpectrumResult,
    TransientResult,
    describe_drivetrain,
    describe_drivetrain_modes,
    describe_spectrum,
    describe_transient,
    drivetrain_warnings,
    transient_warnings,
)
from femgear.trains.drivetrain.section import (
    DrivetrainCase,
    build_drivetrain,
    is_drivetrain,
    settle_time,
)
from femgear.trains.drivetrain.setup import (
    BENDING,
    TORSIONAL,
    case_model,
    check_drivetrain,
    check_spectrum,
    check_turning,
    record_every,
    record_rate,
    torque_histories,
)
from femgear.trains.protocol import Figures, OwnFile, Progress, Stage, Train

if TYPE_CHECKING:
    from femgear.storage.results import Results
    from femgear.trains.drivetrain.time import DrivetrainRun

# Campbell diagram: speeds, and modes up to so many times those of operation and mesh lines.
_SPEEDS, _FASTEST, _HIGHEST, _MOST_BRANCHES = 21, 10.0 / 3.0, 2.5, 40
# Orders are read off up to this share of the record rate: beyond it the interpolation takes more than 1.4 %.
_ORDERS = 0.25
# Growth of the free motion from which linear meshes are asked whether the motion means anything, and the
# vibration of a body over its own speed that means nothing.
GROWN, _WILD = 1e3, 100.0


@one_blas_thread()
def solve_drivetrain_modes(case: DrivetrainCase) -> DrivetrainModesResult:
    """Natural frequencies and modes, and the Campbell diagram with the mesh lines."""
    from femgear.solvers.linear.modal import solve_modes
    from femgear.solvers.linear.tracking import campbell_data

    model, speed = check_drivetrain(case), case.operation.speed
    modes = solve_modes(model.still, model.mean_stiffness)
    still = replace(model.still, gyroscopic=model.system.gyroscopic)
    orders = model.base_ratio[np.unique(model.mesh_base)]
    top = _HIGHEST * speed * orders.max(initial=1.0) / (2.0 * np.pi)
    most = min(_MOST_BRANCHES, len(modes.frequency) - 1)
    count = int(np.clip(np.count_nonzero(modes.frequency < top), min(2, most), most))
    speeds = np.linspace(0.0, _FASTEST * speed, _SPEEDS)
    found = campbell_data(lambda _: still, speeds, model.mean_stiffness, orders=orders, count=count)
    ratio = np.where(modes.frequency > 0.0, case.simulation.damping_ratio, 0.0)
    return DrivetrainModesResult(model, replace(modes, damping_ratio=ratio), found, speed)


@one_blas_thread()
def solve_transient_run(case: DrivetrainCase, *, progress: Progress | None = None) -> TransientResult:
    """Integrate the case; records are low-passed before they are thinned out.

    Raises
    ------
    ConvergenceError
        The motion outgrows the numbers, or all sense (E-DIVERGED).
    """
    check_drivetrain(case)
    variants = (BENDING, TORSIONAL) if case.simulation.torsional else (BENDING,)
    models, runs, torques = {}, {}, ()
    for done, variant in enumerate(variants):
        model = models[variant] = case_model(case, variant)
        torques = torque_histories(case, model.ratio)
        runs[variant] = _run(case, variant, model, torques)
        if progress is not None:
            progress("transient", done + 1, len(variants))
    return TransientResult(models, runs, torques)


def _run(case: DrivetrainCase, variant: str, model, torques) -> DrivetrainRun:
    from femgear.trains.drivetrain.time import march_drivetrain

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
            every=record_every(case, model),
            lowpass=True,
            contact_loss=s.contact_loss,
        )
    except ConvergenceError as error:
        if error.code == "E-DIVERGED":
            error.key, error.message = "simulation.damping_ratio", f"{variant}: {error.message}"
        raise
    _check_sense(run, variant, list(model.ratio.values()))
    return run


def _check_sense(run: DrivetrainRun, variant: str, ratio) -> None:
    """Refuse motions that have grown beyond sense, however exact their books are."""
    if not run.gain > GROWN:
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
        code="E-DIVERGED", key="simulation.damping_ratio",
        limit=f"vibration below {_WILD:g} times the speed of the body, where motions grow",
        remedy=f"give more damping, or {remedy}",
    )  # fmt: skip


def solve_spectrum(case: DrivetrainCase, transient: TransientResult) -> SpectrumResult:
    """Spectra of the mesh forces after the start, over frequency and over orders of the first body.

    Raises
    ------
    CaseError
        As `femgear.trains.drivetrain.setup.check_spectrum`.
    """
    from femgear.trains.drivetrain.spectra import (
        averaged_spectrum,
        line_amplitudes,
        mesh_lines,
        order_spectrum,
    )

    check_spectrum(case, transient.models[BENDING])
    first, settle = next(iter(transient.runs.values())), settle_time(case)
    rate = record_rate(case, transient.models[BENDING])
    late, step = first.time >= settle, 1.0 / rate
    span = float(np.ptp(first.time[late]))
    resolution = case.simulation.resolution or max(0.1, 4.0 / span)
    speed = float(first.spin_speed[late].mean())
    turns = float(np.ptp(first.spin[late])) / (2.0 * np.pi)
    slowest = min(float(run.spin_speed[late].min()) for run in transient.runs.values())
    check_turning(slowest, speed)
    lines = mesh_lines(transient.models[BENDING])
    per_turn = int(np.ceil(2.0 * np.pi * rate / slowest))
    distance = 1.0 / (0.99 * turns)
    spectra, tracked, amplitudes = {}, {}, {}
    for variant, run in transient.runs.items():
        force, angle = run.force[late], run.spin[late]
        spectra[variant] = averaged_spectrum(force, step, resolution=resolution)
        found = order_spectrum(force, angle, resolution=distance, per_turn=per_turn)
        kept = found.frequency <= _ORDERS * rate * 2.0 * np.pi / run.spin_speed[late].max()
        tracked[variant] = replace(
            found, frequency=found.frequency[kept], amplitude=found.amplitude[..., kept]
        )
        amplitudes[variant] = line_amplitudes(force, angle, run.spin_speed[late], lines, record_rate=rate)
    return SpectrumResult(transient, settle, speed, spectra, tracked, lines, amplitudes, distance)


def _transient_verdict(result: TransientResult) -> dict:
    runs = result.runs.values()
    return {
        "steps": next(iter(runs)).steps,
        "energy": max(run.ledger.error for run in runs),
        "momentum": max(run.momentum for run in runs),
        "pulling": {variant: float(np.max(run.pulling, initial=0.0)) for variant, run in result.runs.items()},
    }


def _figures() -> Mapping[str, Figures]:
    from femgear.trains.drivetrain.figures import FIGURES

    return FIGURES


def remarks(results: Results, stem: str) -> Iterator[str]:
    """What a force without its usual sign means, for the caption of its picture."""
    if stem == "transient_forces":
        if results.case.simulation.contact_loss:
            yield "Zero: the teeth are apart; negative: their back flanks touch."
        else:
            yield "Negative: the mesh is linear and pulls; real teeth would part."


DRIVETRAIN = Train(
    name="drivetrain",
    words="a drivetrain",
    model=DrivetrainCase,
    own_file=OwnFile(is_drivetrain, build_drivetrain, DrivetrainCase.model_json_schema),
    stages=(
        Stage(
            name="modes",
            title="Modes",
            solve=lambda case, *_: solve_drivetrain_modes(case),
            verdict=lambda result: {
                "modes": len(result.modes.frequency), "degrees_of_freedom": len(result.modes.shape),
            },
            describe=lambda results: describe_drivetrain_modes(results.modes),
            check=check_drivetrain,
        ),
        Stage(
            name="transient",
            title="Transient",
            solve=lambda case, _, context: solve_transient_run(case, progress=context.progress),
            verdict=_transient_verdict,
            describe=lambda results: describe_transient(results.transient),
            check=check_drivetrain,
        ),
        Stage(
            name="spectrum",
            title="Spectrum",
            solve=lambda case, results, _: solve_spectrum(case, results["transient"]),
            verdict=lambda result: {
                "lines": len(result.lines),
                "segments": min(one.segments for one in result.spectra.values()),
            },
            describe=lambda results: describe_spectrum(results.spectrum),
            unavailable=lambda case: "" if case.parallel or case.planetary else "the chain has no gears",
            needs=lambda case: ("transient",),
            check=lambda case: check_spectrum(case, case_model(case)),
        ),
    ),
    describe=describe_drivetrain,
    warnings=drivetrain_warnings,
    result_warnings=lambda results: (
        transient_warnings(results.transient) if "transient" in results.stages else ()
    ),
    figures=_figures,
    remarks=remarks,
)  # fmt: skip
