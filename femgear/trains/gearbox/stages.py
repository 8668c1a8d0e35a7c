"""The pipeline of a gearbox case: deflection -> modes, response, run-up; its power flow stands before it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import islice
from pathlib import Path

import numpy as np

from femgear.case.dependencies import Steps, box_entries, load_case_entries
from femgear.case.quantities import RPM
from femgear.errors import CaseError
from femgear.report.tables import Block, merged_names, tabulate
from femgear.stages.drawing_tables import describe_drawing
from femgear.stages.duty import ShaftEnd, duty_sentence, in_digits, teeth_words
from femgear.stages.protocol import FiguresOf, Progress, Stage, Train, modes_verdict, one_blas_thread, silent
from femgear.stages.wear import MeshingTeeth
from femgear.trains.gearbox.balance import (
    GearboxBalanceResult,
    balance_tables,
    balance_warnings,
    check_balance,
    describe_balance,
    solve_balance,
)
from femgear.trains.gearbox.case_file import GearboxCase, LoadCaseSection, teeth_of
from femgear.trains.gearbox.casing_draft import draft_casing
from femgear.trains.gearbox.casing_file import check_casing_file, describe_casing
from femgear.trains.gearbox.deflection import Deflection, check_held, solve_deflection
from femgear.trains.gearbox.dynamic_model import check_dynamic_model, gearbox_dynamic_model
from femgear.trains.gearbox.entry_checks import check_shafts_have_mass
from femgear.trains.gearbox.friction import box_friction_findings, friction_excites
from femgear.trains.gearbox.judgements import gearbox_judgements
from femgear.trains.gearbox.key_figures import gearbox_key_figures
from femgear.trains.gearbox.longer_excitation import longer_excitation
from femgear.trains.gearbox.losses import BOX_HEAT, BOX_LOSSES, idle_loss_entries, unknown_mesh_losses
from femgear.trains.gearbox.model import reference_shaft
from femgear.trains.gearbox.modes import solve_gearbox_modes
from femgear.trains.gearbox.planet_branches import describe_branches
from femgear.trains.gearbox.power import gearbox_flow, heard_stages, port_shafts, turns_in_words
from femgear.trains.gearbox.resonance_table import describe_resonances
from femgear.trains.gearbox.response import solve_gearbox_response
from femgear.trains.gearbox.response_results import (
    GearboxResponseResult,
    describe_gearbox_response,
    gearbox_response_warnings,
    response_tables,
)
from femgear.trains.gearbox.results import (
    ESTIMATES,
    DeflectionResult,
    GearboxModesResult,
    deflection_warnings,
    describe_deflection,
    describe_gearbox_modes,
    gearbox_modes_warnings,
    gearbox_warnings,
)
from femgear.trains.gearbox.run_up_speeds import gearbox_resonances, run_up_speeds
from femgear.trains.gearbox.sensors import check_sensors, describe_modes_at_sensors, gearbox_sensors
from femgear.trains.gearbox.signals import GEARBOX_RECORDED
from femgear.trains.gearbox.silence import why_no_balance, why_silent
from femgear.trains.gearbox.solid_bodies import gearbox_bodies
from femgear.trains.gearbox.spectrum import (
    sign_of_forces,
    solve_box_spectrum,
    solve_box_transient,
    spectrum_verdict,
    transient_verdict,
)
from femgear.trains.gearbox.stress import (
    box_stress_warnings,
    describe_box_stress,
    solve_box_stress,
    why_no_stress,
)
from femgear.trains.gearbox.transient_checks import check_spectrum, check_transient, why_no_motion
from femgear.trains.gearbox.transient_results import TransientResult, describe_spectrum, describe_transient
from femgear.trains.gearbox.verdict import gearbox_verdict

_MOST_MESHES = 4
"""Mesh frequencies that the sentence of page one names."""


@one_blas_thread()
def solve_deflections(
    case: GearboxCase, *, progress: Progress = silent, steps: Steps | None = None
) -> DeflectionResult:
    """Solve for the loaded states of all load cases: shafts, bearings and teeth together."""
    steps, states = steps or Steps(), []
    cases, chosen = case.operation.load_case, case.operation.first - 1
    factors = ESTIMATES if any(bearing.estimated for bearing in case.bearing) else ()
    for number, load_case in enumerate(cases):
        progress("deflection", number, len(cases) + len(factors))
        states.append(_load_case_state(case, load_case, steps))
    estimates = []
    for number, factor in enumerate(factors, len(cases)):
        progress("deflection", number, len(cases) + len(factors))
        start = states[chosen].slopes[-1]
        estimates.append(solve_deflection(case, cases[chosen], slopes=start, steps=steps, estimate=factor))
    return DeflectionResult(case, tuple(states), chosen, tuple(estimates))


def _load_case_state(case: GearboxCase, load_case: LoadCaseSection, steps: Steps) -> Deflection:
    """Loaded state of a load case: as it was kept, whatever the others are, or solved now."""
    entries = load_case_entries(case, load_case)
    if (kept := steps.kept("state of a load case", entries)) is not None:
        return replace(kept, model=replace(kept.model, case=case))
    return steps.keep("state of a load case", entries, solve_deflection(case, load_case, steps=steps))


@one_blas_thread()
def solve_box_modes(
    case: GearboxCase, deflection: DeflectionResult, *, steps: Steps | None = None
) -> GearboxModesResult:
    """Solve for the modes of the gearbox about the loaded state of its chosen load case."""
    return GearboxModesResult(solve_gearbox_modes(deflection.of(case).state, steps=steps))


@one_blas_thread()
def solve_box_dynamics(
    case: GearboxCase, deflection: DeflectionResult, *, progress: Progress = silent, steps: Steps | None = None
) -> GearboxResponseResult:
    """Solve for the response to all stages at the speeds of the chosen load case."""
    state = deflection.of(case).state
    speed = [abs(state.model.flow.speed[reference_shaft(state.model)])]
    response = solve_gearbox_response(state, speed, steps=steps, progress=progress, by_path=True)
    without = solve_gearbox_response(state, speed, steps=steps, friction=False) if friction_excites(case) else None
    longer = longer_excitation(response, steps=steps)
    return GearboxResponseResult(response, whole=True, frictionless=without, longer=longer)


@one_blas_thread()
def solve_box_runup(
    case: GearboxCase, deflection: DeflectionResult, *, progress: Progress = silent, steps: Steps | None = None
) -> GearboxResponseResult:
    """Follow the response to all stages over the speed of the reference shaft, at the torques of the load case.

    Resonances whose peaks are narrower than the steps get speeds of their own.
    """
    state = deflection.of(case).state
    nominal = abs(state.model.flow.speed[reference_shaft(state.model)])
    start, stop = case.runup.start or 0.25 * nominal, case.runup.to or 1.25 * nominal
    equal_steps = np.linspace(start, stop, case.runup.count)
    resonances = gearbox_resonances(state, start, stop, steps=steps)
    speeds, missed = run_up_speeds(equal_steps, resonances)
    response = solve_gearbox_response(state, speeds, steps=steps, progress=progress, stage="runup")
    longer = longer_excitation(response, steps=steps)
    return GearboxResponseResult(response, whole=False, unresolved=missed, resonances=resonances, longer=longer)


@one_blas_thread()
def solve_box_balance(
    case: GearboxCase, deflection: DeflectionResult, *, progress: Progress = silent, steps: Steps | None = None
) -> GearboxBalanceResult:
    """Solve for motions with teeth that part at the speed of the chosen load case, stage by stage."""
    rings = tuple(f"ring of {stage.name}" for stage in case.planetary if stage.elastic_ring)
    state, sensors = deflection.of(case).state, gearbox_sensors(case)
    # rings are rigid here: sensors on them hear nothing that could be told
    on_casing = [number for number, sensor in enumerate(sensors) if not sensor.ring]
    solved = solve_balance(state, steps=steps, progress=progress)
    stages = tuple(replace(stage, acceleration=stage.acceleration[on_casing]) for stage in solved)
    return GearboxBalanceResult(
        stages, rings, tuple(sensors[number].name for number in on_casing), case.balance.together
    )


def _no_balance(case: GearboxCase) -> str:
    return why_no_balance(case) or ("" if case.balance.harmonics else "[balance] gives no harmonics")


def _no_spectrum(case: GearboxCase) -> str:
    return why_no_motion(case) or ("" if case.pair or case.planetary else "the gearbox has no gears")


def _no_runup(case: GearboxCase) -> str:
    return why_silent(case) or ("" if case.runup.count else "[runup] gives no speeds")


def check_before_run(case: GearboxCase) -> None:
    """Refuse files of a casing that are none of this case, shafts that the model leaves loose, and idle sensors."""
    check_casing_file(case)
    check_held(case)
    check_sensors(case)


def describe_gearbox(case: GearboxCase) -> tuple[Block, ...]:
    """Tabulate the power flow of all load cases, and what drawings carry of the gears of stages that have teeth."""
    blocks = []
    for load_case in case.operation.load_case[:12]:
        blocks += list(_flow_blocks(case, load_case))
    return (*blocks, *describe_branches(case), *_drawing_blocks(case), *describe_casing(case))


def _drawing_blocks(case: GearboxCase) -> Iterator[Block]:
    """Tabulate what drawings carry of all teeth, once where stages have the same, as those of equal planets."""
    stages = dict[Block, list[str]]()
    for stage in (*case.pair, *case.planetary):
        if (teeth := teeth_of(stage)) is not None:
            for block in describe_drawing(teeth):
                stages.setdefault(block, []).append(stage.name)
    for block, names in stages.items():
        yield replace(block, title=f"{block.title}, {merged_names(names)}")


def gearbox_duty(case: GearboxCase) -> str:
    """Write what a gearbox does in its chosen load case."""
    load_cases, shafts = case.operation.load_case, port_shafts(case)
    flow = gearbox_flow(case, case.load_case)
    ends = [ShaftEnd(name, torque, (flow.speed[shafts[name]],)) for name, torque in flow.port_torque.items()]
    if not any(end.torque for end in ends):
        return "No torque acts: its modes alone are known."
    frequencies = (abs(frequency) for frequency in flow.mesh_frequency.values() if frequency)
    hertz = [*dict.fromkeys(f"{in_digits(frequency)} Hz" for frequency in frequencies)]
    words = " and ".join(filter(None, (", ".join(hertz[:-1]), *hertz[-1:])))
    sizes = (teeth_of(stage) or stage.gears for stage in (*case.pair, *case.planetary))
    helices = [gears.helix_angle for gears in sizes if gears is not None]
    facts = [f"{teeth_words(helices)} mesh at {words}"] if 0 < len(hertz) <= _MOST_MESHES else []
    facts += [f"{case.load_case.name}, one of {len(load_cases)} load cases"] if load_cases[1:] else []
    return duty_sentence(ends, ", ".join(facts))


def _flow_blocks(case: GearboxCase, load_case: LoadCaseSection) -> Iterator[Block]:
    flow = gearbox_flow(case, load_case)
    many = len(case.operation.load_case) > 1
    title = f"Power flow, {load_case.name}" if many else "Power flow"
    power = {name: torque * flow.speed[port_shafts(case)[name]] for name, torque in flow.port_torque.items()}
    rows = [
        (shaft.name, f"{flow.speed[shaft.name] / RPM:.6g}", *_port_texts(case, flow, power, shaft.name))
        for shaft in case.shaft
    ]
    yield Block(title, ("shaft", "speed [rpm]", "torque from outside [N m]", "power [kW]"), tuple(rows))
    columns = {
        "stage": lambda name: name,
        "torques of the meshes on the shafts [N m]": lambda name: ", ".join(
            f"{shaft} {torque:.6g}" for shaft, torque in flow.stage_torque[name].items()
        ),
        "mesh [Hz]": lambda name: f"{flow.mesh_frequency[name]:.6g}",
        "planets [rpm]": lambda name: f"{flow.planet_speed[name] / RPM:.6g}" if name in flow.planet_speed else "-",
        "same teeth meet after": lambda name: turns_in_words(flow.frequencies[name]),
    }
    notes = tuple(
        f"{merged_names(names)} stand side by side: equal shares here, those of their stiffness in deflection"
        for names in flow.side_by_side
    )
    yield tabulate(f"Stages, {load_case.name}" if many else "Stages", flow.stage_torque, columns, notes)


def _port_texts(case, flow, power, shaft: str) -> tuple[str, str]:
    ports = [name for name in flow.port_torque if port_shafts(case)[name] == shaft]
    if not ports:
        return "-", "-"
    torque = sum(flow.port_torque[name] for name in ports)
    return f"{torque:.6g} ({', '.join(ports)})", f"{1e-3 * sum(power[name] for name in ports):.6g}"


def _response_verdict(result: GearboxResponseResult) -> dict:
    return {"speeds": len(result.response.speed), "stages": [stage.name for stage in result.response.stages]}


def loaded_stages(
    case: GearboxCase, speed: float | None = None, *, cache: Path | None = None, steps: Steps | None = None
) -> tuple[MeshingTeeth, ...]:
    """Solve the contact of the teeth of all stages that carry, under the load case that the case names first.

    CaseError: a speed beside that of the load case (E-ARGUMENTS); no stage whose contact is solved (E-FAULT).
    """
    if speed is not None:
        message, remedy = "a gearbox has the speeds of its load case", "leave it out, or change operation.load_case"
        raise CaseError(message, code="E-ARGUMENTS", key="--speed", remedy=remedy)
    state = solve_deflection(case, steps=steps)
    flow, loaded = state.model.flow, list[MeshingTeeth]()
    for kind in ("pair", "planetary"):
        for number, section in enumerate(getattr(case, kind)):
            if (contact := state.contacts.get(section.name)) is not None:
                prefix, frequency = f"{kind}[{number}].teeth.", abs(flow.mesh_frequency[section.name])
                loaded.append(MeshingTeeth(prefix, contact.result, frequency))
    if not loaded:
        message, remedy = "no stage has teeth whose contact is solved", "give teeth to a stage that carries load"
        remedies = (remedy, "leave deflection.contact out")
        raise CaseError(message, code="E-FAULT", key="deflection.contact", remedy=remedies)
    return tuple(loaded)


GEARBOX = Train(
    name="gearbox",
    words="a gearbox case",
    meshing_teeth=loaded_stages,
    stages=(
        Stage(
            name="deflection",
            decided_by=partial(box_entries, "deflection"),
            title="System deflection",
            solve=solve_deflections,
            options=("progress", "steps"),
            check=check_before_run,
            verdict=lambda result: {"load_cases": len(result.states)},
            describe=lambda results: describe_deflection(results.deflection)[0],
            tables=lambda results: describe_deflection(results.deflection)[1:],
            warnings=deflection_warnings,
        ),
        BOX_LOSSES,
        BOX_HEAT,
        Stage(
            name="stress",
            decided_by=partial(box_entries, "stress"),
            title="Stresses",
            solve=solve_box_stress,
            takes=("deflection",),
            options=("progress",),
            wanted=lambda case: not why_no_stress(case),
            unavailable=why_no_stress,
            verdict=lambda result: {"stages": [stage.name for stage in result.stages]},
            describe=lambda results: next(describe_box_stress(results.stress, results.findings)),
            tables=lambda results: islice(describe_box_stress(results.stress, results.findings), 1, None),
            warnings=box_stress_warnings,
        ),
        Stage(
            name="modes",
            decided_by=partial(box_entries, "modes"),
            title="Modes",
            solve=solve_box_modes,
            takes=("deflection",),
            options=("steps",),
            check=check_shafts_have_mass,
            verdict=modes_verdict,
            describe=lambda results: describe_gearbox_modes(results.modes),
            tables=lambda results: tuple(describe_modes_at_sensors(results.modes)),
            warnings=gearbox_modes_warnings,
        ),
        Stage(
            name="dynamics",
            decided_by=partial(box_entries, "dynamics"),
            title="Response",
            solve=solve_box_dynamics,
            takes=("deflection",),
            options=("progress", "steps"),
            wanted=lambda case: not why_silent(case),
            unavailable=why_silent,
            check=check_shafts_have_mass,
            verdict=_response_verdict,
            describe=lambda results: describe_gearbox_response(results.dynamics),
            tables=lambda results: response_tables(results.dynamics),
            warnings=gearbox_response_warnings,
        ),
        Stage(
            name="runup",
            decided_by=partial(box_entries, "runup"),
            title="Run-up",
            solve=solve_box_runup,
            takes=("deflection",),
            options=("progress", "steps"),
            wanted=lambda case: not _no_runup(case),
            unavailable=_no_runup,
            check=check_shafts_have_mass,
            verdict=_response_verdict,
            describe=lambda results: describe_gearbox_response(results.runup, "Run-up of the stages"),
            tables=lambda results: (
                *describe_resonances(results.runup, results.modes if "modes" in results.stages else None),
                *response_tables(results.runup),
            ),
            warnings=gearbox_response_warnings,
        ),
        Stage(
            name="balance",
            decided_by=partial(box_entries, "balance"),
            title="Teeth that part",
            solve=solve_box_balance,
            takes=("deflection",),
            options=("progress", "steps"),
            wanted=lambda case: not _no_balance(case),
            unavailable=_no_balance,
            check=check_balance,
            verdict=lambda result: {"stages": [stage.name for stage in result.stages]},
            describe=lambda results: describe_balance(results.balance),
            tables=lambda results: balance_tables(results.balance),
            warnings=balance_warnings,
        ),
        Stage(
            name="transient",
            decided_by=partial(box_entries, "transient"),
            title="Motion in time",
            solve=solve_box_transient,
            takes=("deflection",),
            options=("progress", "steps"),
            wanted=lambda case: not why_no_motion(case),
            unavailable=why_no_motion,
            verdict=transient_verdict,
            describe=lambda results: describe_transient(results.transient),
            check=check_transient,
            warnings=TransientResult.warnings,
        ),
        Stage(
            name="spectrum",
            decided_by=partial(box_entries, "transient"),
            title="Spectrum",
            solve=solve_box_spectrum,
            takes=("transient",),
            wanted=lambda case: not _no_spectrum(case),
            unavailable=_no_spectrum,
            verdict=spectrum_verdict,
            describe=lambda results: describe_spectrum(results.spectrum),
            check=check_spectrum,
        ),
    ),
    describe=describe_gearbox,
    warnings=lambda case: (
        *gearbox_warnings(case),
        *idle_loss_entries(case),
        *unknown_mesh_losses(case),
        *box_friction_findings(case),
    ),
    bodies=lambda case: gearbox_bodies(case, {}),
    draft_casing=draft_casing,
    dynamic_model=gearbox_dynamic_model,
    check_model=check_dynamic_model,
    recorded_stages=heard_stages,
    stands_in={"static": "deflection", "life": "deflection", "housing": "dynamics"},
    judgements=gearbox_judgements,
    duty=gearbox_duty,
    front=(
        ("run_up_levels", 0),
        ("run_up_forces", 0),
        ("sensor_spectra", 0),
        ("transient_forces", 0),
        ("load_patterns", 0),
        ("campbell", 0),
    ),
    figures=FiguresOf("femgear.trains.gearbox.figures:FIGURES"),
    recorded=GEARBOX_RECORDED,
    verdict=gearbox_verdict,
    key_figures=gearbox_key_figures,
    remarks=sign_of_forces,
)
