"""The pipeline with an elastic ring: static, stress -> modes -> dynamics -> housing. Read this first.

Each stage takes the case and what came before, and returns a frozen result whose ``dataset()`` is what goes
to disk. `ELASTIC` at the end is the train: the table of its stages, with what the report says and draws of
each.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from femgear import second_process
from femgear.case.dependencies import (
    Entries,
    Steps,
    check_entries,
    dynamic_entries,
    heard_entries,
    modal_entries,
    response_entries,
    ring_entries,
    runup_entries,
    state_entries,
    static_entries,
)
from femgear.case.gear_set import material_of, planetary_set, set_deviations
from femgear.case.planetary import Case
from femgear.case.tooth_friction import acting_friction, friction_acts
from femgear.contact.bodies import Bodies, with_ring
from femgear.contact.cycle import CycleOptions, walk_mesh_cycle
from femgear.contact.loaded_period import LoadedPeriod, loaded_period
from femgear.contact.supports import Supports
from femgear.errors import ConvergenceError
from femgear.fe.elasticity import mass
from femgear.findings import Finding
from femgear.gears.deviations import common_period, rotational_symmetry
from femgear.gears.planetary import PlanetarySet
from femgear.housing.orders import order_level
from femgear.housing.sensor import SensorLines, component_lines
from femgear.housing.sound import Cylinder, Microphone, component_sound
from femgear.remembered import remembered
from femgear.report.tables import RESPONSE_DOUBTS, describe_modes, describe_response
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.linear.resonances import (
    ONE_FREQUENCY,
    crossings,
    merged_speeds,
    modal_forces,
    refined_speeds,
    unresolved,
)
from femgear.solvers.periodic.spectral import joint_message, solve_spectral
from femgear.solvers.stability.parametric import decisive_harmonics
from femgear.stages.assumptions import Assumption, AssumptionsResult, describe_assumptions, solve_assumptions
from femgear.stages.duty import set_duty
from femgear.stages.friction_source import balanced_source
from femgear.stages.gears_in_space import case_bodies
from femgear.stages.heat import HEAT
from femgear.stages.life import LIFE
from femgear.stages.losses import LOSSES
from femgear.stages.lumped_set import member_speeds, parts_of_speeds
from femgear.stages.protocol import (
    FiguresOf,
    Progress,
    Recorded,
    Stage,
    Train,
    counting_on,
    modes_verdict,
    one_blas_thread,
    response_verdict,
    silent,
)
from femgear.stages.static import (
    STATIC,
    STRESS,
    case_supports,
    foundation_entries,
    gear_entries,
    loaded_over_width,
    loaded_set,
    record_positions,
    ring_foundation,
    solve_static,
    with_cracks,
)
from femgear.stages.static_results import StaticResult, describe_set
from femgear.stages.tooth_figures import tooth_key_figures
from femgear.system.mode_kinds import mode_kinds
from femgear.system.system import Response
from femgear.trains.elastic.checks import (
    HIGHEST_RESPONSE,
    case_warnings,
    check_dynamic_case,
    check_reach,
    check_rim_speed,
    checked_speeds,
    fastest_mesh_frequency,
    max_nodal_diameter,
    no_runup,
    response_findings,
    runup_ends,
    slowest_wave,
)
from femgear.trains.elastic.excitation_limit import (
    HARMONICS,
    MODES_ABOVE,
    FrequencyLimit,
    Heard,
    excitation_end,
    first_limit,
    highest_excitation,
    limited,
    lines_on_foundation,
    lost_level,
)
from femgear.trains.elastic.judgements import set_with_ring_judgements
from femgear.trains.elastic.model import (
    RADIAL,
    TANGENTIAL,
    RingModel,
    elastic_set,
    highest_mesh_mode,
    mesh_springs,
    record_count,
    ring_field,
    ring_model,
)
from femgear.trains.elastic.outputs import (
    elastic_dynamic_model,
    lines_method,
    lines_of_field,
    mesh_and_ring_outputs,
    named_sensors,
    sensor_lines,
)
from femgear.trains.elastic.results import (
    BEARING_FACTORS,
    DynamicsResult,
    FixedHousing,
    HousingResult,
    Judged,
    ModesResult,
    describe_housing,
    level_changes,
    level_doubts,
    measured_lines,
    mesh_bands,
    order_cuts,
    remarks_of_casing,
    ring_shapes,
    sensor_signals,
    sensor_spectra,
    signal_extent,
    verdict,
)
from femgear.trains.elastic.runup import (
    HeardSpeeds,
    RunupResult,
    describe_runup,
    heard_speeds,
    joined_speeds,
    mode_levels,
    resonances,
)

_FEW_SPEEDS = 8
"""Speeds of a run-up that one process solves for."""
_PART, _HARMONIC = 100e6, 4e3
"""Size of the speeds that are in memory at a time, and that of a mesh harmonic of one of them [bytes]."""
_LINES_TOGETHER = 8000
"""Harmonics of the run-up's speeds that are in memory at a time."""
_MOSTLY_COMPARED = 5
"""Operating speeds over those that are compared up to which all are solved before."""
_COMPARED = 4
"""Operating speeds at most at which levels in a housing that stands still are compared, and of a run-up."""
_BELOW_WAVES = 0.9
"""The run-up ends, unless the case says otherwise, so far below the slowest wave around the ring."""
_NOTICED, _PACKED, _SECONDS = 2e9, 2.5, 1.5e-5
"""Size of files that is said before, and that of a number in compressed ones [bytes]; what a harmonic of one
speed takes (2 GHz, one core) [s]."""
_ASSUMPTIONS = (
    Assumption("damping", ("dynamics.damping_ratio",)),
    Assumption("foundation of the ring", ("ring.foundation_radial", "ring.foundation_tangential")),
    Assumption("bearings of the planets", ("planet.bearing_stiffness",)),
    Assumption("supports of sun and carrier", ("sun.support_stiffness", "carrier.support_stiffness")),
)
"""What levels rest on, and what nobody knows before the gearbox is built."""
_SHARING_POSITIONS = 8
"""Positions of a mesh period from which mean shares at other bearing stiffnesses are taken."""
_EQUAL = 0.005
"""Mean shares that differ less from one another than this are equal."""
_LINES = ("deflection", "force", "modal", "source")
"""What a response has of every harmonic."""


@one_blas_thread()
def solve_modes(
    case: Case,
    static: StaticResult,
    *,
    progress: Progress = silent,
    steps: Steps | None = None,
    over_bearings: bool = True,
) -> ModesResult:
    """Solve for the modal basis of the set with its elastic ring and mean mesh stiffnesses.

    Its loaded state, from which the meshes take stiffness and excitation, is that of the set on its supports
    and of the ring on its foundation, whatever ``static.members`` shows.

    Parameters
    ----------
    case : Case
        A planetary set whose ring is its housing.
    static : StaticResult
        Of `solve_static`.
    progress : callable
        Called with (stage, done, total).
    steps : Steps, optional
        Compliances, loaded states and ring models of other cases, taken where they are those of this one.
    over_bearings : bool
        Whether load shares at other bearing stiffnesses are computed, which reports show.

    Returns
    -------
    ModesResult
        ``modes`` holds natural frequencies [Hz] and mass-normalised shapes, ``excitation`` mesh stiffness [N/m],
        deflection [m] and force [N].

    Raises
    ------
    CaseError
        No torque, a ring that is not the fixed member, or a static solution of another case (E-OTHER-CASE).
    """
    check_entries(static, StaticResult, static_entries(case), "static solution")
    check_dynamic_case(case, static.planetary_set)
    steps, gears, torque = steps or Steps(), static.planetary_set, static.sun_torque
    bodies, deviations = _ring_bodies(case, static, steps), set_deviations(case)
    friction, entries = acting_friction(case, gears), state_entries(case)
    loading, name = partial(_loading, case, static, steps, counting_on(progress, "modes")), "loaded state"
    state = steps.kept(name, entries) or steps.keep(name, entries, loaded_period(gears, *bodies, **loading(friction)))
    stiffness = state.resampled("held_stiffness", record_count(gears, state.periods)).mean(axis=1)
    mesh_mode = highest_mesh_mode(case, gears, stiffness, sun_torque=torque)
    reach = highest_excitation(case, mesh_mode, fastest_mesh_frequency(case, gears))
    ring, entries = _ring_of_case(case, static, bodies, steps, reach), {**entries, "reach": reach}
    springs = steps.kept("mesh springs", entries)
    excitation, flexibility = springs or steps.keep("mesh springs", entries, mesh_springs(gears, ring, state))
    frictionless = None
    if friction is not None:
        name, entries = f"{name} without friction", state_entries(case)
        without = steps.kept(name, entries) or steps.keep(name, entries, loaded_period(gears, *bodies, **loading(None)))
        frictionless = mesh_springs(gears, ring, without)[0]
    model = elastic_set(case, gears, ring, sun_torque=torque, flexibility=flexibility)
    modes = undamped_modes(
        model.system,
        excitation.stiffness.mean(axis=1),
        damping_ratio=case.dynamics.damping_ratio,
        max_frequency=MODES_ABOVE * reach,
    )
    kinds, diameters = mode_kinds(
        modes.shape,
        np.diag(model.system.M),
        model.system.dofs,
        frequency=modes.frequency,
        ring_diameter=model.ring_diameter,
        ring_slice=model.ring_slice,
        planet_angles=model.planet_angles,
    )
    modes = replace(modes, kind=kinds, nodal_diameter=diameters)
    symmetry = rotational_symmetry(deviations, gears)
    sharing = _sharing_over_bearings(case, gears, bodies[0], state, steps) if over_bearings else None
    made = model, balanced_source(excitation, modes), modes, bodies, state, reach, symmetry, modal_entries(case)
    return ModesResult(ring, *made, sharing, frictionless)


def _loading(case: Case, static: StaticResult, steps: Steps, progress: Any, friction: Any) -> dict[str, Any]:
    """Collect how the set on its supports is loaded, with friction of every kind of mesh or without."""
    gears, deviations = static.planetary_set, set_deviations(case)
    width = loaded_over_width(case, gears, static.waves, steps)
    return {
        "sun_torque": static.sun_torque,
        "positions": record_positions(case, gears),
        "contact": case.static.contact,
        "deviations": None if deviations.ideal else deviations,
        "supports": linear_supports(case),
        "options": CycleOptions(friction=friction, progress=progress, **width),
    }


def _sharing_over_bearings(
    case: Case, gears: PlanetarySet, bodies: Bodies, state: LoadedPeriod, steps: Steps
) -> np.ndarray | None:
    """Compute mean shares (2N, 2) of the meshes with `BEARING_FACTORS` of the planets' bearing stiffness.

    Means over a few positions, of plane contact: within 0.5 % of those of the record. None where planets
    share equally, or their bearings are rigid.
    """
    share = _shares(state.resampled("force", record_count(gears, state.periods)))
    supports, entries = linear_supports(case), state_entries(case)
    if supports.planet is None or np.abs(share - 1.0).max() < _EQUAL:
        return None
    deviations = set_deviations(case)
    if (kept := steps.kept("sharing over bearings", entries)) is not None:
        return kept
    sharing = [
        _shares(
            walk_mesh_cycle(
                gears,
                bodies,
                sun_torque=case.torque_on_first_gear(),
                positions=gears.equal_positions(_SHARING_POSITIONS),
                contact=case.static.contact,
                deviations=None if deviations.ideal else deviations,
                supports=replace(supports, planet=factor * supports.planet),
                periods=state.periods,
                options=CycleOptions(friction=acting_friction(case, gears)),
            ).force
        )
        for factor in BEARING_FACTORS
    ]
    return steps.keep("sharing over bearings", entries, np.array(sharing).T)


def _shares(force: np.ndarray) -> np.ndarray:
    """Mean forces (2N,) of meshes (2N, P), over those of all of their kind."""
    mean = force.mean(axis=1)
    return np.concatenate([half / half.mean() for half in np.split(mean, 2)])


def _ring_bodies(case: Case, static: StaticResult, steps: Steps) -> tuple[Bodies, Bodies]:
    """Flank compliances with the ring on its foundation, and with the ring held; one is the static one's."""
    fixed, gears = case.static.members == "fixed", static.planetary_set
    entries = {**gear_entries(case, gears, 2), **(foundation_entries(case) if fixed else {})}
    ring = steps.kept("flanks of the ring", entries) or steps.keep(
        "flanks of the ring",
        entries,
        with_ring(static.bodies, ring_foundation(case, static.sectors.ring) if fixed else None).ring,
    )
    other = static.bodies.with_gear(-1, ring)
    other = with_cracks(case, gears, static.sectors, other, elastic=fixed, steps=steps)
    return (other, static.bodies) if fixed else (static.bodies, other)


def linear_supports(case: Case) -> Supports:
    """Make the supports of the members without clearance: bearings of the dynamic model are linear."""
    return replace(case_supports(case), planet_clearance=0.0)


def _ring_of_case(
    case: Case, static: StaticResult, bodies: tuple[Bodies, Bodies], steps: Steps, reach: float
) -> RingModel:
    """Cyclic modes of the ring on its foundation for excitation up to a frequency [Hz]."""
    gears, sector, side = static.planetary_set, static.sectors.ring, 1.0 if static.sun_torque >= 0 else -1.0
    entries = {**ring_entries(case), "reach": reach, "side": side, "friction": friction_acts(case)}
    return steps.kept("ring model", entries) or steps.keep(
        "ring model",
        entries,
        ring_model(
            gears,
            sector,
            mass(sector.grid, material_of(case, "ring"), gears.ring.face_width),
            ring_foundation(case, sector),
            (bodies[0].ring, bodies[1].ring),
            max_diameter=max_nodal_diameter(case),
            max_frequency=MODES_ABOVE * reach,
            side=side,
            friction=friction_acts(case),
        ),
    )


@one_blas_thread()
def solve_dynamics(
    case: Case, static: StaticResult, modes: ModesResult, *, progress: Progress = silent
) -> DynamicsResult:
    """Solve for the periodic response at the case's speeds by the spectral method, a Floquet verdict at each.

    The response is compared with that to excitation up to a higher frequency. Where the case sets no limit it
    is doubled once where that changes the level by 1 dB or more.

    Parameters
    ----------
    case : Case
        As for `solve_modes`.
    static, modes : StaticResult, ModesResult
        Of `solve_static` and `solve_modes` for this case.
    progress : callable
        Called with (stage, done, total).

    Returns
    -------
    DynamicsResult
        ``response`` holds complex harmonics of mesh deflection [m] and mesh force [N] at every speed.

    Raises
    ------
    CaseError
        A carrier that runs around the ring faster than its waves (E-SPEED); results of another case.
    ConvergenceError
        Equations without a solution, at an undamped resonance.
    """
    return next(dynamics_parts(case, static, modes, progress=progress, memory=math.inf))[1]


def dynamics_parts(
    case: Case,
    static: StaticResult,
    modes: ModesResult,
    *,
    progress: Progress = silent,
    memory: float = _PART,
) -> Iterator[tuple[Case, DynamicsResult]]:
    """Solve as `solve_dynamics` for some speeds after the others, each with the case that has them alone.

    The harmonics of some speeds fill so much memory [bytes]. The numbers are those of all speeds at once but
    for rounding; what is said of all comes with the last.
    """
    check_entries(static, StaticResult, static_entries(case), "static solution")
    check_entries(modes, ModesResult, modal_entries(case), "modal basis")
    check_reach(case, modes.reach, fastest_mesh_frequency(case, static.planetary_set))
    basis, excitation, gears = modes.modes, modes.excitation, static.planetary_set
    speeds, (frequency, carrier) = np.array(case.operation.speeds), _turning_speeds(case, modes)
    compared, heard_lines = _compared_speeds(case), _heard_lines(case, modes)
    first, early, level = first_limit(case, modes, frequency), None, None
    if _solved_before(case, modes, first, memory):
        response = solve_spectral(basis, excitation, frequency, **first.options(case))
        early = response, *mesh_and_ring_outputs(modes, response)
        level = order_level(lines_of_field(case, modes, early[2][compared], carrier[compared]))
    up_to, beyond, change = _excitation_end(case, modes, level)
    limit = limited(case, frequency, up_to, given=case.dynamics.mesh_harmonics)
    if (first.excitation != limit.excitation).any():
        early = None
    level_change = np.full(len(speeds), np.nan)
    level_change[compared] = change
    _estimate_slow(level_change, heard_lines, case, frequency, carrier, limit, beyond)
    decisive, responses = decisive_harmonics(basis, excitation, int(limit.excitation.max())), list[Response]()
    room = _HARMONIC * limit.response * excitation.periods
    if case.housing.stands_still:
        from femgear.trains.elastic.fixed_housing import housing_memory

        room = room + housing_memory(case, modes, limit)
    for numbers, part in parts_of_speeds(case, room, memory):
        if early is None:
            response = solve_spectral(basis, excitation, frequency[numbers], **limit.options(case, numbers))
            dte, radial = mesh_and_ring_outputs(modes, response)
        else:
            response, dte, radial = early
        responses.append(response.without_lines())
        rubbing = _friction_change(case, modes, radial, carrier[numbers], frequency[numbers], limit.at(numbers))
        if numbers[-1] + 1 == len(speeds) and part is not case:
            response = replace(response, message=joint_message(responses))
        kept = {name: lines[-1:] for name in _LINES if (lines := getattr(response, name)) is not None}
        last = replace(response, **kept)
        kept_response = response if any(math.sin(sensor.direction) for sensor in case.housing.sensor) else last
        yield (
            part,
            DynamicsResult(
                input_speed=speeds[numbers],
                response=response,
                dte=dte,
                ring_radial=radial,
                speeds=tuple(member_speeds(case, gears, speed) for speed in part.operation.speeds),
                judged=Judged(basis, excitation, frequency[numbers], decisive),
                ring_tangential=mesh_and_ring_outputs(modes, kept_response, TANGENTIAL)[1],
                ring_teeth=gears.ring.teeth,
                symmetry=modes.symmetry,
                harmonics=int(limit.response.max()),
                excitation_limit=limit.frequency[numbers],
                level_change=level_change[numbers],
                compared_to=beyond,
                friction_change=rubbing,
                entries=dynamic_entries(part),
                fixed=_fixed_part(case, modes, carrier, limit, numbers) if case.housing.stands_still else None,
            ),
        )
        progress("dynamics", float(numbers[-1] + 1), float(len(speeds)))


def _friction_change(
    case: Case, modes: ModesResult, field: np.ndarray, carrier: np.ndarray, frequency: np.ndarray, limit: FrequencyLimit
) -> np.ndarray | None:
    """Compute by how much friction changes the levels (n_speeds,) [dB]; None without friction."""
    if modes.frictionless is None:
        return None
    without = solve_spectral(modes.modes, modes.frictionless, frequency, **limit.options(case), radius=False)
    fields = field, mesh_and_ring_outputs(modes, without)[1]
    level, level_without = (order_level(lines_of_field(case, modes, radial, carrier)) for radial in fields)
    return 20.0 * np.log10(level / level_without)


@one_blas_thread()
def solve_response(case: Case, modes: ModesResult) -> Response:
    """Solve for the periodic response at the case's speeds, without stability and fields.

    CaseError: E-SPEED, as `solve_dynamics`.
    """
    frequency = _turning_speeds(case, modes)[0]
    limit = first_limit(case, modes, frequency)
    return solve_spectral(modes.modes, modes.excitation, frequency, **limit.options(case))


@one_blas_thread()
def solve_lines(case: Case, modes: ModesResult) -> SensorLines:
    """Solve for the lines of the fixed sensor at the case's speeds, on a foundation, and nothing that a report adds.

    The excitation ends at ``dynamics.up_to``, where that is given as in `solve_dynamics`. CaseError: E-SPEED.
    """
    frequency, carrier = _turning_speeds(case, modes)
    return lines_on_foundation(case, modes, frequency, carrier, first_limit(case, modes, frequency))


@one_blas_thread()
def findings_of_response(case: Case, modes: ModesResult, response: Response) -> Iterator[Finding]:
    """List what speaks against the result of `solve_response`: levels are compared as in `solve_dynamics`."""
    frequency, carrier = _turning_speeds(case, modes)
    limit, change = first_limit(case, modes, frequency), np.full(len(frequency), np.nan)
    up_to, beyond, change[_compared_speeds(case)] = _excitation_end(case, modes)
    _estimate_slow(change, _heard_lines(case, modes), case, frequency, carrier, limit, beyond)
    wider = limited(case, frequency, up_to, given=case.dynamics.mesh_harmonics)
    if (wider.excitation != limit.excitation).any():
        text = f"the excitation ends at {limit.frequency.max():.4g} Hz; a run takes it up to {up_to:.4g} Hz"
        yield Finding("W-EXCITATION", "", text, remedy="give dynamics.up_to")
    yield from response_findings(case, response, change, limit.frequency, beyond)


def _estimate_slow(change, heard_lines: Heard, case: Case, frequency, carrier, limit, beyond: float) -> None:
    """Put changes [dB] by `lost_level` into those of all speeds where these end with the record."""
    slow = frequency * HARMONICS < beyond - frequency
    if slow.any():
        change[slow] = lost_level(case, heard_lines, limit.frequency[slow], beyond, np.sign(carrier[0]))


def _fixed_part(case: Case, modes: ModesResult, carrier, limit: FrequencyLimit, numbers) -> FixedHousing:
    """Housing that stands still at some speeds of all (n_speeds,) of the carrier [rad/s]."""
    judged = np.flatnonzero(np.isin(numbers, checked_speeds(len(carrier))))
    from femgear.trains.elastic.fixed_housing import fixed_housing

    return fixed_housing(case, modes, carrier[numbers], limit.at(numbers), judged_at=judged)


def _compared_speeds(case: Case) -> np.ndarray:
    """Choose the numbers (n,) of operating speeds at which levels are compared, few where that takes time."""
    return checked_speeds(len(case.operation.speeds), *([_COMPARED] if case.housing.stands_still else []))


def _solved_before(case: Case, modes: ModesResult, limit: FrequencyLimit, memory: float) -> bool:
    """Whether all speeds are solved before levels are compared, so that most are not solved twice."""
    room = _HARMONIC * limit.response.max() * modes.excitation.periods * len(limit.response)
    few = len(limit.response) <= _MOSTLY_COMPARED * len(_compared_speeds(case))
    return not (case.housing.stands_still or _known_ends(case, modes)) and few and room <= memory


def _excitation_end(case: Case, modes: ModesResult, level: np.ndarray | None = None) -> tuple[float, float, np.ndarray]:
    """Choose where the excitation ends by the operating speeds, for run-up and dynamics alike.

    With the ``level`` (n,) at those that are compared where it is known.
    """
    if not (ends := _known_ends(case, modes)):
        frequency, carrier = (values[_compared_speeds(case)] for values in _turning_speeds(case, modes))
        end = excitation_end(case, modes, _heard_lines(case, modes), frequency, carrier, level)
        ends.append(end)
    return ends[0]


@remembered(latest=2)
def _known_ends(case: Case, modes: ModesResult) -> list[tuple[float, float, np.ndarray]]:
    """Where the excitation ends, once that is found."""
    return []


def _heard_lines(case: Case, modes: ModesResult) -> Heard:
    """Choose what computes the lines of the sensor that has the level."""
    lines = lines_on_foundation
    if case.housing.stands_still:
        from femgear.trains.elastic.fixed_housing import lines_at_sensor as lines
    return partial(lines, case, modes)


def _turning_speeds(case: Case, modes: ModesResult) -> tuple[np.ndarray, np.ndarray]:
    """Mesh frequency [Hz] and speed of the carrier [rad/s], refused where the ring has no modes for them."""
    turning, speeds = member_speeds(case, planetary_set(case)), np.array(case.operation.speeds)
    check_rim_speed(modes.ring.modes, turning.carrier * speeds)
    return turning.mesh_frequency * speeds, turning.carrier * speeds


@one_blas_thread()
def solve_housing(case: Case, dynamics: DynamicsResult) -> HousingResult:
    """Compute the carrier orders that a sensor fixed on the ring hears while the carrier turns past it.

    Parameters
    ----------
    case : Case
        As for `solve_modes`; its table ``housing`` places the sensor.
    dynamics : DynamicsResult
        Of `solve_dynamics` for this case.

    Returns
    -------
    HousingResult
        ``lines`` holds carrier orders and complex displacements [m]; sound is in Pa.

    Raises
    ------
    CaseError
        A response of another case (E-OTHER-CASE), or none (E-TYPE).
    """
    check_entries(dynamics, DynamicsResult, dynamic_entries(case), "dynamic response")
    place = dynamics.ring_teeth, np.array([s.carrier for s in dynamics.speeds]), case.housing.sensor_angle
    options = {"symmetry": dynamics.symmetry, "periods": dynamics.response.periods}
    microphone, width = case.housing.microphone, planetary_set(case).ring.face_width
    angle = case.housing.sensor_angle if microphone.angle is None else microphone.angle
    housing = HousingResult(
        input_speed=np.array(case.operation.speeds),
        exact=component_lines(dynamics.ring_radial, *place, **options),
        form=case.housing.form,
        points=case.housing.points,
        harmonics=dynamics.harmonics,
        symmetry=dynamics.symmetry,
        excitation_limit=dynamics.excitation_limit,
        cylinder=Cylinder(case.ring.outer_radius, width),
        microphone=Microphone(microphone.distance, angle),
    )
    if case.housing.sensor:
        housing = replace(housing, outputs={"sensor": named_sensors(case, dynamics)})
    if (periods := dynamics.response.periods) > 1:
        radiating = *place[:2], housing.cylinder, housing.microphone
        housing = replace(housing, sound=component_sound(dynamics.ring_radial, *radiating, periods=periods))
    if dynamics.fixed is None:
        return housing
    from femgear.trains.elastic.fixed_housing import lines_in_housing

    return lines_in_housing(case, dynamics, housing, dynamics.fixed)


@one_blas_thread()
def solve_runup(case: Case, modes: ModesResult, *, progress: Progress = silent) -> RunupResult:
    """Follow sensor and mesh forces over the speeds of the run-up, without stability.

    The excitation ends where that of `solve_dynamics` does. In a housing that stands still level, forces and
    lines are those of the set in it, while modes, and levels by one of them alone, are those on the
    foundation. CaseError: E-SPEED as there. ConvergenceError.
    """
    check_entries(modes, ModesResult, modal_entries(case), "modal basis")
    speed_of, basis, excitation = member_speeds(case, planetary_set(case)), modes.modes, modes.excitation
    operating, given = np.array(case.operation.speeds), case.dynamics.mesh_harmonics
    checked, up_to = checked_speeds(len(operating)), _excitation_end(case, modes)[0]
    first, last = _runup_ends(case, modes)
    slowest, fastest = first * speed_of.mesh_frequency, last * speed_of.mesh_frequency
    count = int(limited(case, [slowest], up_to, given=given).excitation[0])
    motions = basis.shape[modes.model.ring_slice].T
    field = ring_field(modes.ring.modes, motions, RADIAL, modes.max_diameter)
    forces = modal_forces(basis, excitation, count, output=field)
    crossed = crossings(forces, slowest, fastest, up_to if given is None else math.inf)
    resonance = crossed.mesh_frequency / speed_of.mesh_frequency
    expected_level, damping = forces.output_level[crossed.row, crossed.harmonic - 1], forces.damping_ratio[crossed.row]
    speeds = refined_speeds(np.linspace(first, last, case.runup.count), resonance, expected_level, damping)
    speeds = merged_speeds(operating[checked][(operating[checked] >= first) & (operating[checked] <= last)], speeds)
    beside = operating[np.abs(operating[:, None] - resonance).argmin(axis=0)]
    resonances_ = resonances(basis, forces, crossed, resonance, beside)
    alike = np.abs(basis.frequency[:, None] / resonances_["frequency"] - 1.0) <= ONE_FREQUENCY
    nearest = [np.abs(speeds[:, None] - at).argmin(axis=0) for at in (resonance, beside)]
    frequency, carrier, parts = speed_of.mesh_frequency * speeds, speed_of.carrier * speeds, list[HeardSpeeds]()
    alone, n = np.zeros((2, len(resonance))), np.arange(-modes.max_diameter, modes.max_diameter + 1)
    limit = limited(case, frequency, up_to, given=given)
    cuts = np.flatnonzero(np.diff(np.cumsum(limit.response) // _LINES_TOGETHER)) + 1

    def followed(numbers: np.ndarray) -> tuple[HeardSpeeds | None, list[np.ndarray]]:
        """What is kept of some speeds, and the levels of single modes at those of their resonances."""
        response, expected_level = (
            solve_spectral(basis, excitation, frequency[numbers], radius=False, **limit.options(case, numbers)),
            None,
        )
        if not case.housing.stands_still:
            lines = sensor_lines(case, modes, response, carrier[numbers])
            expected_level = heard_speeds(response.force, lines, response.lowest_force)
        order = np.arange(response.force.shape[-1])[:, None] * case.ring.teeth - np.sign(speed_of.carrier) * n
        turning, levels = carrier[numbers][:, None, None] * order, []
        for at in nearest:
            inside = np.where((at >= numbers[0]) & (at <= numbers[-1]), at - numbers[0], -1)
            levels.append(mode_levels(response, field, alike, crossed.harmonic, turning, inside))
        if not case.housing.stands_still:  # else the speeds in the housing are told
            progress("runup", float(numbers[-1] + 1), float(len(speeds)))  # to nobody from a second process
        return expected_level, levels

    tasks = [partial(followed, numbers) for numbers in np.split(np.arange(len(speeds)), cuts)]
    for heard_part, levels in reversed(second_process.shared(tasks[::-1])):
        parts += [heard_part] if heard_part is not None else []
        alone += levels
    if case.housing.stands_still:
        parts = _heard_in_housing(case, modes, carrier, limit, progress)
    levels = joined_speeds(parts)
    change, compared_to = _run_up_change(case, modes, speeds, limit, levels.level)
    return RunupResult(
        input_speed=speeds,
        mesh_frequency=frequency,
        excitation_limit=limit.frequency,
        level_change=change,
        compared_to=compared_to,
        carrier_speed=carrier,
        response=levels,
        resonances={**resonances_, "resonance_alone": alone[0], "operating_alone": alone[1]},
        ring_teeth=case.ring.teeth,
        sensor_angle=case.housing.sensor_angle,
        operating_speeds=operating,
        unresolved=unresolved(speeds, resonance, expected_level, damping),
        method=lines_method(case),
    )


def _heard_in_housing(
    case: Case, modes: ModesResult, carrier: np.ndarray, limit: FrequencyLimit, progress: Progress
) -> list[HeardSpeeds]:
    """What is kept of a run-up in a housing that stands still, part by part, in two processes if it is long.

    Threads wait for one another between the many small steps of a speed; processes do not.
    """
    from femgear.trains.elastic.fixed_housing import HousingModel, heard_in_housing, housing_memory

    model, count = HousingModel(case, modes, carrier[0]), len(carrier)
    processes = 2 if second_process.second_core() and count > _FEW_SPEEDS else 1
    room = np.cumsum(housing_memory(case, modes, limit)) // _PART
    blocks = np.split(np.arange(count), np.flatnonzero(np.diff(room)) + 1)
    workers = max((os.cpu_count() or 1) // processes, 1)
    _ = model.housing  # made before the process is copied

    def heard(block: np.ndarray) -> HeardSpeeds:
        heard_lines = heard_in_housing(model, carrier[block], limit.at(block), workers)
        progress("runup", float(block[-1] + 1), float(count))  # to nobody from a second process
        return heard_lines

    # the slowest speeds, which take longest, come first
    tasks = [partial(heard, block) for block in reversed(blocks)]
    parts = second_process.shared(tasks) if processes > 1 else [task() for task in reversed(tasks)][::-1]
    return parts[::-1]


def _run_up_change(
    case: Case, modes: ModesResult, speeds: np.ndarray, limit: FrequencyLimit, level: np.ndarray
) -> tuple[np.ndarray, float]:
    """Compute what a longer excitation changes the levels (n_speeds,) of a run-up [dB], and its end [Hz].

    At operating speeds as there, at slow ones as `lost_level` has it, at some others and the loudest one by
    solving again; NaN at all others. Speeds are those of the input [rad/s], in ascending order.
    """
    of_speed, heard_lines = member_speeds(case, planetary_set(case)), _heard_lines(case, modes)
    _, beyond, changes = _excitation_end(case, modes)
    frequency, carrier = of_speed.mesh_frequency * speeds, of_speed.carrier * speeds
    change = np.full(len(speeds), np.nan)
    for speed, value in zip(np.array(case.operation.speeds)[_compared_speeds(case)], changes):
        change[speeds == speed] = value
    _estimate_slow(change, heard_lines, case, frequency, carrier, limit, beyond)
    checked = np.union1d(checked_speeds(len(speeds), _COMPARED), level.argmax())
    checked = checked[np.isnan(change[checked]) & (limit.frequency[checked] < beyond - frequency[checked])]
    if len(checked):
        longer = limited(case, frequency[checked], beyond)
        with suppress(ConvergenceError):  # nearly singular: what these lose is not known
            wider = order_level(heard_lines(frequency[checked], carrier[checked], longer))
            change[checked] = 20.0 * np.log10(wider / level[checked])
    return change, beyond


def _runup_ends(case: Case, modes: ModesResult) -> tuple[float, float]:
    """First and last speed of the run-up [rad/s]; a default does not leave the range of the model."""
    turning, (first, last) = member_speeds(case, planetary_set(case)), runup_ends(case)
    if case.runup.to is not None:
        check_rim_speed(modes.ring.modes, turning.carrier * last)
        return first, last
    highest = min(HIGHEST_RESPONSE / (case.response_harmonics or 3), case.dynamics.up_to or math.inf)
    wave = _BELOW_WAVES * slowest_wave(modes.ring.modes)[0]
    allowed = min(highest / turning.mesh_frequency, wave / abs(turning.carrier))
    return first, max(min(last, allowed), *case.operation.speeds)


def solve_level_assumptions(
    case: Case, static: StaticResult, *, progress: Progress = silent, steps: Steps | None = None
) -> AssumptionsResult:
    """Compute the level at some operating speeds with half and twice of what the case assumes.

    Parameters
    ----------
    case : Case
        As for `solve_modes`.
    static : StaticResult
        Of `solve_static` for this case; members that move change it, and are solved again.
    progress : callable
        Called with (stage, done, total).
    steps : Steps, optional
        As for `solve_modes`.
    """
    steps, numbers = steps or Steps(), checked_speeds(len(case.operation.speeds), _COMPARED)
    speeds = tuple(case.operation.speeds[number] for number in numbers)
    few = case.model_copy(update={"operation": case.operation.model_copy(update={"speeds": speeds})})

    def level(changed: Case) -> np.ndarray:
        same = static_entries(changed) == static_entries(case)
        state = static if same else solve_static(changed, steps=steps)
        modes = solve_modes(changed, state, steps=steps)
        return order_level(solve_housing(changed, solve_dynamics(changed, state, modes)).lines)

    return solve_assumptions(few, _ASSUMPTIONS, level, np.array(speeds), progress=progress)


def _warnings(case: Case) -> Iterator[Finding]:
    """List what deserves a look in the case, and the size of the results of many speeds."""
    yield from case_warnings(case)
    speeds, meshes = case.operation.speeds, 2 * planetary_set(case).n_planets
    first = member_speeds(case, planetary_set(case), speeds[0]).mesh_frequency
    frequency = first * np.array(speeds) / speeds[0]
    # whether the excitation is doubled is known with the modes
    up_to = case.dynamics.up_to or 2.0 * highest_excitation(case, 0.0, float(frequency.max()))
    kept = limited(case, frequency, up_to, given=case.dynamics.mesh_harmonics).response
    kept = kept * common_period(set_deviations(case), planetary_set(case))[0]
    most, symmetry = int(kept.max()), rotational_symmetry(set_deviations(case), planetary_set(case))
    # files of speeds that are not in memory together are compressed, and zeros of slow ones with them
    numbers = _PACKED * kept.sum() if _HARMONIC * most * len(kept) > _PART else 8.0 * most * len(kept)
    size = numbers * (2 * meshes + (2 * max_nodal_diameter(case) + 1) / symmetry)
    if size > _NOTICED:
        yield Finding(
            "W-SIZE",
            "operation.speeds",
            f"{len(speeds)} speeds with up to {most} harmonics each fill about {size / 1e9:.2g} GB and "
            f"take about {max(kept.sum() * _SECONDS / 60.0, 1.0):.0f} min of one core",
            remedy="fewer speeds, or a lower dynamics.up_to, if that is too much",
        )
    if case.housing.stands_still:
        from femgear.trains.elastic.fixed_housing import turning_errors_time

        yield from turning_errors_time(case)


def _basis_entries(case: Case) -> Entries:
    """List all that decides the last digit of the modal basis: its entries, and the excitation it is for."""
    fastest = fastest_mesh_frequency(case, planetary_set(case))
    return {**modal_entries(case), "excitation": highest_excitation(case, 0.0, fastest)}


_FORMATS = {"wav": ("housing",), "uff": ("housing", "modes"), "quality": ("housing",)}
"""Formats of what a test bench would record, and the stages that they take."""


ELASTIC = Train(
    name="elastic",
    words="a case with an elastic ring",
    meshing_teeth=loaded_set,
    stages=(
        STATIC,
        STRESS,
        LOSSES,
        HEAT,
        LIFE,
        Stage(
            name="modes",
            title="Modes",
            solve=solve_modes,
            takes=("static",),
            options=("progress", "steps"),
            decided_by=_basis_entries,
            verdict=modes_verdict,
            describe=lambda results: describe_modes(results.modes),
            needs=lambda case: ("static", "stress") if case.static.stresses else ("static",),
            check=lambda case: check_dynamic_case(case, planetary_set(case)),
        ),
        Stage(
            name="runup",
            title="Run-up",
            solve=solve_runup,
            takes=("modes",),
            options=("progress",),
            decided_by=runup_entries,
            verdict=lambda result: {"speeds": len(result.input_speed)},
            describe=lambda results: describe_runup(results.runup, results.findings),
            warnings=RunupResult.warnings,
            concerned_by={"": ("W-DAMPING", "W-FRICTION")},
            unavailable=no_runup,
        ),
        Stage(
            name="dynamics",
            title="Dynamics",
            solve=solve_dynamics,
            parts=dynamics_parts,
            takes=("static", "modes"),
            options=("progress",),
            decided_by=response_entries,
            verdict=response_verdict,
            describe=lambda results: describe_response(results.dynamics, results.findings),
            warnings=DynamicsResult.warnings,
            concerned_by={"": ("W-DAMPING", "W-FRICTION")},
        ),
        Stage(
            name="housing",
            title="Housing",
            solve=solve_housing,
            takes=("dynamics",),
            decided_by=heard_entries,
            verdict=lambda result: {"form": result.form},
            describe=lambda results: describe_housing(
                results.housing, level_changes(results), results.findings, level_doubts(results)
            ),
            tables=lambda results: (mesh_bands(results), *measured_lines(results)),
            warnings=HousingResult.warnings,
            concerned_by={"": ("W-DAMPING", "W-FRICTION", "W-POINTS"), "dynamics": ("W-EXCITATION", *RESPONSE_DOUBTS)},
        ),
        Stage(
            name="assumptions",
            title="What the level rests on",
            solve=solve_level_assumptions,
            takes=("static",),
            needs=lambda case: ("static", "housing"),
            options=("progress", "steps"),
            decided_by=heard_entries,
            wanted=lambda case: case.housing.assumptions,
            verdict=lambda result: {"assumptions": len(result.assumptions)},
            describe=lambda results: describe_assumptions(results.assumptions),
            concerned_by={"": ("W-DAMPING", "W-FRICTION")},
        ),
    ),
    describe=describe_set,
    warnings=_warnings,
    verdict=verdict,
    key_figures=tooth_key_figures,
    dynamic_model=elastic_dynamic_model,
    bodies=case_bodies,
    judgements=set_with_ring_judgements,
    duty=set_duty,
    front=(("run_up_levels", 0), ("static_transmission_error", 0), ("load_sharing", 0)),
    figures=FiguresOf("femgear.trains.elastic.figures:FIGURES"),
    remarks=remarks_of_casing,
    recorded=Recorded(
        sensor_signals, signal_extent, _FORMATS, lambda results: 2, sensor_spectra, ring_shapes, order_cuts
    ),
)
