"""The pipeline with an elastic ring: static, stress -> modes -> dynamics -> housing. Read this first.

Each stage takes the case and what came before, and returns a frozen result whose ``dataset()`` is what goes
to disk. `ELASTIC` at the end is the train: the table of its stages, with what the report says and draws of
each.

Mesh stiffness jumps where tooth pairs begin and cease to carry: its harmonics fall like one over their order,
while the acceleration of the housing grows towards the modes in which meshes are the springs. A fixed number
of mesh harmonics ends below those modes at low speed. The excitation therefore ends at a frequency, the same
at all speeds, and the level of the housing is computed again with twice that frequency.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy import linalg

from femgear.case.dependencies import (
    Steps,
    check_entries,
    dynamic_entries,
    modal_entries,
    ring_entries,
    state_entries,
    static_entries,
)
from femgear.case.gear_set import material_of, planetary_set, set_deviations
from femgear.case.quantities import RPM
from femgear.case.sections import Case
from femgear.contact.bodies import Bodies, with_ring
from femgear.contact.cycle import CycleOptions
from femgear.contact.loaded_period import LoadedPeriod, loaded_period
from femgear.contact.supports import Supports
from femgear.errors import Finding
from femgear.fe.elasticity import mass
from femgear.gears.deviations import common_period, no_deviations, rotational_symmetry
from femgear.gears.planetary import PlanetarySet, mesh_names
from femgear.housing.carrier_orders import MeshPaths
from femgear.housing.casing_files import may_lack_compliance, missing_compliance
from femgear.housing.orders import order_level
from femgear.housing.sensor import SensorLines, component_lines
from femgear.housing.sound import Cylinder, Microphone, component_sound, equivalent_sound, surface_sound
from femgear.housing.structure import FixedStructure, supported_ring
from femgear.housing.turn_stability import turn_stability
from femgear.housing.turning_errors import mean_excitation
from femgear.housing.two_way import TwoWayResponse, solve_two_way, structure_lines
from femgear.report.tables import describe_modes, describe_response, pulling_meshes, pulls_of
from femgear.solvers.linear.modal import modal_damping, output_load, output_response, residual_output
from femgear.solvers.linear.modal import solve_modes as solve_eigenproblem
from femgear.solvers.linear.resonances import (
    ONE_FREQUENCY,
    crossings,
    modal_forces,
    refined_speeds,
    unresolved,
)
from femgear.solvers.periodic.spectral import joint_message, solve_spectral
from femgear.solvers.stability.parametric import decisive_harmonics, stability
from femgear.system.mode_kinds import mode_kinds
from femgear.system.system import MeshExcitation, Response
from femgear.trains.elastic.checks import (
    HIGHEST_RESPONSE,
    NOTICEABLE,
    case_warnings,
    check_dynamic_case,
    check_reach,
    check_rim_speed,
    checked_speeds,
    dynamics_warnings,
    fastest_mesh_frequency,
    fixed_diameters,
    housing_supports,
    housing_warnings,
    imported_casing,
    max_nodal_diameter,
    missing_level,
    no_runup,
    record_periods,
    runup_ends,
    slowest_wave,
)
from femgear.trains.elastic.figures import FIGURES
from femgear.trains.elastic.model import (
    RADIAL,
    TANGENTIAL,
    RingModel,
    body_flexibility,
    elastic_set,
    gears_alone,
    highest_mesh_mode,
    mesh_excitation,
    ring_field,
    ring_mesh_compliance,
    ring_model,
)
from femgear.trains.elastic.results import (
    DynamicsResult,
    FixedHousing,
    HousingResult,
    ModesResult,
    describe_housing,
    mesh_bands,
    order_cuts,
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
    joined,
    mode_levels,
    resonances,
    runup_warnings,
)
from femgear.trains.protocol import (
    Progress,
    Recorded,
    Stage,
    Train,
    modes_verdict,
    one_blas_thread,
    response_verdict,
    silent,
)
from femgear.trains.rigid import member_speeds, parts_of_speeds
from femgear.trains.static.results import StaticResult, describe_set
from femgear.trains.static.stages import (
    STATIC,
    STRESS,
    case_supports,
    mesh_backlash,
    over_width,
    record_positions,
    ring_foundation,
)

_LOWEST = 20e3
"""The excitation reaches the end of hearing at least [Hz]."""
_ABOVE_MESHES = 1.4
"""And this many times the highest natural frequency of the rigid gears on their meshes."""
_STEP = 2500.0
"""In whole steps, so that variants of one set are excited alike [Hz]."""
HARMONICS = 512
"""The record of the static state carries this many harmonics: the jumps are 2^-13 of a period wide. Slower
speeds are excited less far, and `_lost_level` tells what they lose."""
_PART, _HARMONIC, _STANDING = 100e6, 4e3, 42e3
"""Size of the speeds that are in memory at a time, that of a mesh harmonic of one of them, and what it takes
more for a planet in a housing that stands still [bytes]."""
_LINES_TOGETHER = 8000
"""Harmonics of the run-up's speeds that are in memory at a time."""
_MOST_ORDERS = 2500
"""Carrier orders of the forces in a housing that stands still up to which more harmonics are looked at:
0.8 GB."""
_FEW_SPEEDS = 20
"""Speeds, at most, that are solved with twelve mesh harmonics in a housing that stands still."""
_JUDGED = 6
"""Mesh harmonics of the stiffness in the verdict of a housing that stands still, at most."""
_SPEEDS_IN_HOUSING = 40
"""Speeds of the run-up in a housing that stands still that are in memory at a time."""
_BELOW_WAVES = 0.9
"""The run-up ends, unless the case says otherwise, so far below the slowest wave around the ring."""
_NOTICED, _PACKED, _SECONDS = 2e9, 2.5, 1.5e-5
"""Size of files that is said before, and that of a number in compressed ones [bytes]; what a harmonic of one
speed takes (2 GHz, one core) [s]."""
_TURNING = 0.3
"""What a thousand unknowns of a seed and pattern take [s]."""


@dataclass(frozen=True)
class _FrequencyLimit:
    """Harmonics of excitation and response, int, and highest excitation frequency [Hz], all (n_speeds,)."""

    excitation: np.ndarray
    response: np.ndarray
    frequency: np.ndarray

    def options(self, case: Case, some: Any = slice(None)) -> dict[str, Any]:
        """What `solve_spectral` takes at some of the speeds beside modes, excitation and frequencies."""
        kept = {"excitation_harmonics": self.excitation[some], "response_harmonics": self.response[some]}
        return {**kept, "tolerance": case.dynamics.tolerance}


def highest_excitation(case: Case, mesh_mode: float, mesh_frequency: float) -> float:
    """Choose the frequency to which the excitation reaches unless the case says less [Hz].

    From the highest natural frequency of the rigid gears on their meshes, and the mesh frequency of the
    fastest speed [Hz].
    """
    lowest = _STEP * math.ceil(max(_LOWEST, _ABOVE_MESHES * mesh_mode, 3 * mesh_frequency) / _STEP)
    given = max((case.dynamics.mesh_harmonics or 0) * mesh_frequency, case.dynamics.up_to or 0.0)
    return max(min(lowest, 0.5 * HIGHEST_RESPONSE), given)


def limited(case: Case, mesh_frequency, up_to: float, *, given: int | None = None) -> _FrequencyLimit:
    """Count the harmonics (n_speeds,) up to a frequency, or take a given number of them.

    Mesh frequencies (n_speeds,) and limit are in Hz; the number is that of the excitation at all speeds.
    """
    frequency = np.asarray(mesh_frequency, float)
    if given is None:
        excitation = np.clip(np.floor(up_to / frequency * (1 + 1e-12)), 1, HARMONICS).astype(int)
    else:
        excitation = np.full(len(frequency), given)
    # products with the low harmonics of the stiffness reach beyond the excitation
    beyond = excitation + 2 * np.minimum(excitation, 6)
    response = np.maximum(case.dynamics.response_harmonics or beyond, excitation)
    return _FrequencyLimit(excitation, response, excitation * frequency)


def _excitation_end(
    case: Case, modes: ModesResult, frequency: np.ndarray, carrier: np.ndarray, some: np.ndarray
) -> tuple[float, float, np.ndarray]:
    """Choose where the excitation ends, from some of the speeds, so that the level has converged if it may.

    Frequency [Hz], that to which the level was compared [Hz], and its changes at those speeds [dB]; mesh
    frequencies [Hz] and speeds of the carrier [rad/s] are (n_speeds,).
    """
    given, up_to = case.dynamics.mesh_harmonics, case.dynamics.up_to or modes.reach
    while True:
        limit = limited(case, frequency, up_to, given=given)
        response = solve_spectral(modes.modes, modes.excitation, frequency[some], **limit.options(case, some))
        beyond = max(2.0 * (up_to if given is None else float(limit.frequency.max())), modes.reach)
        change, short = _level_change(case, modes, carrier[some], response, beyond)
        if not short or given is not None or up_to != modes.reach or case.dynamics.up_to is not None:
            return up_to, beyond, change
        up_to = beyond  # once: the modal basis carries no more


def _level_change(
    case: Case, modes: ModesResult, carrier: np.ndarray, response: Response, beyond: float
) -> tuple[np.ndarray, bool]:
    """What the level of the housing changes when the excitation reaches a frequency beyond [dB].

    The changes (n_speeds,) at the speeds of a response and of the carrier [rad/s], and whether one of those
    whose excitation comes as far is worth it.
    """
    frequency = response.mesh_frequency
    further = limited(case, frequency, beyond)
    wider = solve_spectral(modes.modes, modes.excitation, frequency, **further.options(case))
    level, wider_level = (order_level(_sensor_lines(case, modes, one, carrier)) for one in (response, wider))
    change = 20.0 * np.log10(wider_level / level)
    reached = further.frequency > beyond - frequency
    return change, bool(np.abs(change[reached]).max(initial=0.0) >= NOTICEABLE)


def _lost_level(case: Case, modes: ModesResult, frequency, beyond: float, sense: float) -> np.ndarray:
    """What the level loses that ends at frequencies (n,) instead of beyond, of the slowest speed [Hz] [dB].

    Harmonics of a stiffness that jumps fall as one over their order, so that lines of a slower speed are
    weaker and closer by the same factor: the share of the level below a frequency depends little on the
    speed (within 1 dB from 250 to 60 rpm of the reference set).
    """
    fast = np.array([beyond / HARMONICS * (1.0 + 1e-9)])
    options = limited(case, fast, beyond).options(case)
    response = solve_spectral(modes.modes, modes.excitation, fast, **options)
    lines = _sensor_lines(case, modes, response, sense * 2.0 * np.pi * fast / case.ring.teeth)
    power = np.cumsum(np.abs(lines.acceleration[0]) ** 2)
    place = np.searchsorted(lines.frequency[0], frequency, side="right") - 1
    return -20.0 * np.log10(np.maximum(np.sqrt(power[place] / power[-1]), 1e-10))


def _sensor_lines(case: Case, modes: ModesResult, response: Response, carrier: np.ndarray) -> SensorLines:
    """Lines of the fixed sensor at speeds of the carrier [rad/s]."""
    field = mesh_and_ring_outputs(modes, response)[1]
    angle = case.housing.sensor_angle
    known = {"symmetry": modes.symmetry, "periods": response.periods}
    return component_lines(field, case.ring.teeth, carrier, angle, **known)


def mesh_and_ring_outputs(
    result: ModesResult, response: Response, output: int = RADIAL
) -> tuple[np.ndarray, np.ndarray]:
    """Compute the dynamic transmission error of every mesh, and the radial or tangential field of the ring.

    Both complex [m], (S, 2N, H + 1), and (S, H + 1, 2 n_max + 1) of the outer surface, see
    `femgear.trains.elastic.model.ring_field`, of a response at S speeds with H harmonics.
    """
    model, basis, n_max = result.model, result.modes, result.max_diameter
    ring_rows = np.eye(len(model.system.M))[model.ring_slice]
    field = ring_field(result.ring.modes, np.eye(len(ring_rows)), output, n_max).T
    heard, n_meshes = np.ones(2 * n_max + 1, bool), model.rigid_directions.shape[1]
    if result.ring.modes.count % result.symmetry == 0:
        # planets in phase, of which one follows the other after a turn
        heard = np.arange(-n_max, n_max + 1) % result.symmetry == 0
    rows: Any = linalg.block_diag(np.eye(n_meshes), field[heard])
    outputs = np.vstack([model.rigid_directions.T, ring_rows])
    values = output_response(
        basis, response, rows @ (outputs @ basis.shape),
        residual=rows @ residual_output(model.system, basis, outputs),
        load=rows @ output_load(model.system, basis, outputs),
    )  # fmt: skip
    found = np.zeros((len(values), values.shape[-1], len(heard)), complex)
    found[..., heard] = np.swapaxes(values[:, n_meshes:], 1, 2)
    return values[:, :n_meshes], found


_LINES = ("deflection", "force", "modal")
"""What a response has of every harmonic."""
_RECORD = 2**13
"""Positions of the excitation in one mesh period at least."""
_MODES_ABOVE = 4.0
"""The modal basis reaches this many times the excitation: the excitation may be doubled once, and modes up to
twice a frequency carry the response there."""


@one_blas_thread()
def solve_modes(
    case: Case, static: StaticResult, *, progress: Progress = silent, steps: Steps | None = None
) -> ModesResult:
    """Solve for the modal basis of the set with its elastic ring and mean mesh stiffnesses.

    Its loaded state, from which the meshes take stiffness and excitation, is that of the set on its supports
    and of the ring on its foundation, whatever ``static.members`` shows. ``progress`` is called with (stage,
    done, total); compliances, loaded states and ring models of other cases are taken from ``steps`` where
    they are those of this one.

    CaseError: no torque, or the ring, which is the housing of this model, is not the fixed member.
    """
    check_entries(static, StaticResult, static_entries(case), "static solution")
    check_dynamic_case(case, static.planetary_set)
    steps, gears, torque = steps or Steps(), static.planetary_set, static.sun_torque
    bodies, deviations, known = _ring_bodies(case, static, steps), set_deviations(case), state_entries(case)
    state = steps.kept("loaded state", known) or steps.keep(
        "loaded state",
        known,
        loaded_period(
            gears,
            *bodies,
            sun_torque=torque,
            positions=record_positions(case, gears),
            contact=case.static.contact,
            deviations=None if deviations.ideal else deviations,
            supports=linear_supports(case),
            options=CycleOptions(progress=partial(progress, "modes"), **over_width(case, gears, loaded=True)),
        ),
    )
    stiffness = state.resampled("held_stiffness", _RECORD * state.periods).mean(axis=1)
    mesh_mode = highest_mesh_mode(case, gears, stiffness, sun_torque=torque)
    reach = highest_excitation(case, mesh_mode, fastest_mesh_frequency(case, gears))
    ring = _ring_of_case(case, static, bodies, steps, reach)
    excitation, flexibility = _excitation(gears, ring, state)
    model = elastic_set(case, gears, ring, sun_torque=torque, flexibility=flexibility)
    modes = solve_eigenproblem(
        model.system,
        excitation.stiffness.mean(axis=1),
        damping_ratio=case.dynamics.damping_ratio,
        max_frequency=_MODES_ABOVE * reach,
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
    return ModesResult(ring, model, excitation, modes, bodies, state, reach, symmetry, modal_entries(case))


def _ring_bodies(case: Case, static: StaticResult, steps: Steps) -> tuple[Bodies, Bodies]:
    """Flank compliances with the ring on its foundation, and with the ring held; one is the static one's."""
    fixed, known = case.static.members == "fixed", ring_entries(case)
    other = steps.kept("ring compliances", known) or steps.keep(
        "ring compliances",
        known,
        with_ring(static.bodies, ring_foundation(case, static.sectors.ring) if fixed else None),
    )
    return (other, static.bodies) if fixed else (static.bodies, other)


def linear_supports(case: Case) -> Supports:
    """Make the supports of the members without clearance: bearings of the dynamic model are linear."""
    return replace(case_supports(case), planet_clearance=0.0)


def _ring_of_case(
    case: Case, static: StaticResult, bodies: tuple[Bodies, Bodies], steps: Steps, reach: float
) -> RingModel:
    """Cyclic modes of the ring on its foundation for excitation up to a frequency [Hz]."""
    gears, sector, side = static.planetary_set, static.sectors.ring, 1.0 if static.sun_torque >= 0 else -1.0
    known = {**ring_entries(case), "reach": reach, "side": side}
    return steps.kept("ring model", known) or steps.keep(
        "ring model",
        known,
        ring_model(
            gears,
            sector,
            mass(sector.grid, material_of(case), gears.ring.face_width),
            ring_foundation(case, sector),
            (bodies[0].ring, bodies[1].ring),
            max_diameter=max_nodal_diameter(case),
            max_frequency=_MODES_ABOVE * reach,
            side=side,
        ),
    )


def _excitation(
    gears: PlanetarySet, ring: RingModel, state: LoadedPeriod
) -> tuple[MeshExcitation, np.ndarray]:
    """Mesh springs of the loaded state, and the compliance (2N, 2N) of the bodies between them [m/N]."""
    held, compliance = (
        ring_mesh_compliance(values, gears.ring.teeth, gears.planet_angles)
        for values in (ring.held_compliance, ring.compliance)
    )
    flexibility = body_flexibility(state.held_compliance, held)
    # equal planets are equal to rounding when their phases are among the positions
    record = gears.n_planets * -(-_RECORD // gears.n_planets) * state.periods
    excitation = mesh_excitation(
        state.resampled("held_stiffness", record),
        state.resampled("deflection", record),
        state.resampled("force", record),
        held,
        ring_compliance=compliance,
        flexibility=flexibility,
        backlash=mesh_backlash(gears),
        periods=state.periods,
    )
    return excitation, flexibility


@one_blas_thread()
def solve_dynamics(
    case: Case, static: StaticResult, modes: ModesResult, *, progress: Progress = silent
) -> DynamicsResult:
    """Solve for the periodic response at the case's speeds by the spectral method, a Floquet verdict at each.

    The response is compared with that to excitation up to a higher frequency. Where the case sets no limit it
    is doubled once where that changes the level by 1 dB or more.

    CaseError: a carrier that runs around the ring faster than its waves (E-SPEED). ConvergenceError.
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
    names, pulls, some = mesh_names(gears.n_planets), list[np.ndarray](), checked_speeds(len(speeds))
    up_to, beyond, change = _excitation_end(case, modes, frequency, carrier, some)
    limit = limited(case, frequency, up_to, given=case.dynamics.mesh_harmonics)
    level_change = np.full(len(speeds), np.nan)
    level_change[some] = change
    slow = frequency * HARMONICS < beyond - frequency
    if slow.any():
        level_change[slow] = _lost_level(case, modes, limit.frequency[slow], beyond, np.sign(carrier[0]))
    short_of = missing_level(speeds / RPM, level_change, limit.frequency, beyond)
    decisive, told = decisive_harmonics(basis, excitation, int(limit.excitation.max())), list[Response]()
    room = _HARMONIC * limit.response * excitation.periods
    if case.housing.stands_still:
        room = room + _STANDING * gears.n_planets / modes.symmetry * (fixed_harmonics(case)[1] + 1)
    for own, part in parts_of_speeds(case, room, memory):
        response = solve_spectral(basis, excitation, frequency[own], **limit.options(case, own))
        told.append(response.without_lines())
        pulls.append(pulls_of(response.force))
        if (complete := own[-1] + 1 == len(speeds)) and part is not case:
            response = replace(response, message=joint_message(told))
        last = replace(response, **{name: getattr(response, name)[-1:] for name in _LINES})
        heard = response if any(math.sin(one.direction) for one in case.housing.sensor) else last
        dte, radial = mesh_and_ring_outputs(modes, response)
        yield part, DynamicsResult(
            input_speed=speeds[own], response=response, dte=dte, ring_radial=radial,
            speeds=tuple(member_speeds(case, gears, speed) for speed in part.operation.speeds),
            stability=stability(basis, excitation, frequency[own], excitation_harmonics=decisive),
            ring_tangential=mesh_and_ring_outputs(modes, heard, TANGENTIAL)[1],
            ring_teeth=gears.ring.teeth, symmetry=modes.symmetry, harmonics=int(limit.response.max()),
            excitation_limit=limit.frequency[own], level_change=level_change[own], compared_to=beyond,
            warnings=(*short_of, *pulling_meshes(speeds / RPM, names, pulls)) if complete else (),
            entries=dynamic_entries(part),
            fixed=_fixed_part(case, modes, carrier, own) if case.housing.stands_still else None,
        )  # fmt: skip
        progress("dynamics", float(own[-1] + 1), float(len(speeds)))


def _fixed_part(case: Case, modes: ModesResult, carrier: np.ndarray, own: np.ndarray) -> FixedHousing:
    """Housing that stands still at some of the speeds (n_speeds,) of the carrier [rad/s].

    The first and the last of all are solved with more mesh harmonics too, some get a verdict.
    """
    count = len(carrier)
    wider, judged = (
        np.flatnonzero(np.isin(own, some)) for some in (checked_speeds(count, 2), checked_speeds(count))
    )
    return fixed_housing(case, modes, carrier[own], wider_at=wider, judged_at=judged)


def fixed_harmonics(case: Case, speeds: int | None = None) -> tuple[int, int]:
    """Choose the mesh harmonics of excitation and response of a ring on supports, the same at all speeds.

    Of the speeds of the case unless their number is given: of many, of planets that differ, and with errors
    that turn fewer harmonics, for the equations take time with their third power.
    """
    gears, deviations = planetary_set(case), set_deviations(case)
    alike = rotational_symmetry(deviations, gears) == gears.n_planets
    few = alike and (len(case.operation.speeds) if speeds is None else speeds) <= _FEW_SPEEDS
    excited = case.dynamics.mesh_harmonics or (12 if few else 6)
    return excited, case.dynamics.response_harmonics or 2 * excited


def fixed_housing(
    case: Case,
    modes: ModesResult,
    carrier: np.ndarray,
    *,
    both: bool = True,
    wider_at: Any = (),
    judged_at: Any = (),
    harmonics: tuple[int, int] | None = None,
) -> FixedHousing:
    """Make the structure of ring and casing, and solve for forces at speeds of the carrier [rad/s].

    Of the set in it, and if ``both`` in the ring on its foundation alone. The meshes keep what higher
    diameters give. At the speeds number ``wider_at`` also for forces of more mesh harmonics;
    those number ``judged_at`` get a Floquet verdict. With errors that turn the latter, and
    damping, are those of the mean of all planets and mesh periods.
    Supports damp nothing: gears and ring have the damping of the set without them. Gears in a casing of a
    file, which brings its own, have modal damping against a rigid ring.
    """
    gears, ring, n_max = planetary_set(case), modes.ring, fixed_diameters(case)
    low = {name: getattr(ring, name)[: n_max + 1] for name in ("compliance", "held_compliance")}
    excitation, flexibility = _excitation(gears, replace(ring, **low), modes.state)
    harmonics, damping = harmonics or fixed_harmonics(case), case.dynamics.damping_ratio
    highest = _MODES_ABOVE * max(modes.reach, harmonics[1] * fastest_mesh_frequency(case, gears))
    paths = MeshPaths(gears.ring.teeth, tuple(gears.planet_angles), ring.load_angle, modes.symmetry)
    even = excitation
    if excitation.periods > 1:
        paths = replace(paths, symmetry=rotational_symmetry(no_deviations(gears), gears))
        even = mean_excitation(excitation, paths, int(np.sign(carrier[0])))
    mean, directions = even.stiffness.mean(axis=1), modes.model.system.W.copy()
    alone = solve_eigenproblem(
        gears_alone(modes.model, flexibility), mean, damping_ratio=damping, max_frequency=highest
    )
    directions[modes.model.ring_slice][modes.model.ring_diameter > n_max] = 0.0
    whole = replace(modes.model.system, W=directions, flexibility=flexibility)
    damped = modal_damping(whole, mean, damping)
    known: Any = {"max_diameter": n_max, "max_frequency": highest, "damping_ratio": damping}
    missing, own = "", paths
    if case.housing.structure:
        own = replace(paths, load_angle=0.0)
        structure, sensors, forces, missing = _casing(case, low["compliance"], highest)
    else:
        structure, sensors, forces = _ring_on_supports(case, modes, known)
    solved = partial(solve_two_way, alone, carrier_speed=carrier, harmonics=harmonics)
    joint = None if case.housing.structure else damped
    plain, one_way = supported_ring(ring.modes, (), **known), None
    if both:
        one_way = solved(excitation, plain, paths=paths, side_bands=0, damping=damped)
        one_way = replace(one_way, paths=replace(own, symmetry=one_way.paths.symmetry))
        drag = None if joint is None else one_way.drag @ (plain.wave_shape @ structure.wave_shape.conj().T)
        one_way = replace(one_way, drag=drag)
    two_way, wider = solved(excitation, structure, paths=own, damping=joint), list[TwoWayResponse]()
    # twice as many, or half as many again
    most = _MOST_ORDERS // (gears.n_planets // own.symmetry * (4 * n_max + 1))
    further: Any = next((more for half in (4, 3) if (more := _times(harmonics, half))[1] <= most), None)
    wider_at = np.asarray(wider_at if further else (), int)
    if len(wider_at):
        some: Any = {"carrier_speed": carrier[wider_at], "paths": own, "damping": joint}
        first = two_way.at(wider_at) if excitation.periods == 1 else solved(even, structure, **some)
        wider = [first, solved(even, structure, harmonics=further, **some)]
    multiplier = np.full(len(carrier), np.nan)
    if len(judged_at):
        multiplier[judged_at] = turn_stability(
            alone, excitation, structure, own, carrier[judged_at], damping=joint,
            harmonics=min(harmonics[0], _JUDGED),
        ).modulus  # fmt: skip
    multiplier **= 1.0 / two_way.turns
    told = sensors, forces, missing, tuple(wider), wider_at, multiplier
    excited = harmonics[0], further[0] if further else 0
    return FixedHousing(structure, two_way, one_way, excited, *told)


def _times(harmonics: tuple[int, int], half: int) -> tuple[int, ...]:
    return tuple(-(-half * h // 2) for h in harmonics)


def _casing(
    case: Case, compliance: np.ndarray, highest: float
) -> tuple[FixedStructure, tuple[str, ...], tuple[str, ...], str]:
    """Structure of a file with modes up to a frequency [Hz], and what static compliance it lacks.

    With the names of its sensors and of forces on the ground; compliance of the ring by nodal diameter.
    """
    expected = 1.0 / ring_mesh_compliance(compliance, case.ring.teeth, [0.0])[0, 0]
    known: Any = {"max_frequency": highest, "expected_stiffness": expected}
    structure, sensors, forces = imported_casing(case, planetary_set(case), **known)
    missing, given = "", case.housing.structure
    if given and may_lack_compliance(Path(case.name).parent / given.file):
        missing = " ".join(one.text for one in missing_compliance(structure, expected))
    return structure, sensors, forces, missing


def _ring_on_supports(
    case: Case, modes: ModesResult, known: Mapping[str, Any]
) -> tuple[FixedStructure, tuple[str, ...], tuple[str, ...]]:
    """Structure of a ring on supports with sensors all around, those of the case, and forces on the ground.

    Names of the latter two.
    """
    supports, points = housing_supports(case), 4 * (modes.max_diameter + 1)
    places = [(2 * np.pi * i / points, 0.0, 0.0, 1.0) for i in range(points)]
    places += [(one.angle, one.direction, 0.0, 1.0) for one in case.housing.sensor]
    for one in supports:
        for turned, stiffness in ((0.0, one.radial_stiffness), (0.5 * np.pi, one.tangential_stiffness)):
            places.append((one.angle, turned, one.width, stiffness))
    angle, turned, width, factor = np.array(places).T
    structure = supported_ring(
        modes.ring.modes, supports, **known, sensor_angles=angle, sensor_directions=turned,
        sensor_widths=width,
    )  # fmt: skip
    ways = [f"support {i} {way}" for i in range(1, len(supports) + 1) for way in ("radial", "tangential")]
    return structure.combined(np.diag(factor)), tuple(one.name for one in case.housing.sensor), tuple(ways)


@one_blas_thread()
def solve_response(case: Case, modes: ModesResult) -> Response:
    """Solve for the periodic response at the case's speeds, without stability and fields.

    CaseError: E-SPEED, as `solve_dynamics`.
    """
    frequency = _turning_speeds(case, modes)[0]
    limit = limited(case, frequency, case.dynamics.up_to or modes.reach, given=case.dynamics.mesh_harmonics)
    return solve_spectral(modes.modes, modes.excitation, frequency, **limit.options(case))


def _turning_speeds(case: Case, modes: ModesResult) -> tuple[np.ndarray, np.ndarray]:
    """Mesh frequency [Hz] and speed of the carrier [rad/s], refused where the ring has no modes for them."""
    one, speeds = member_speeds(case, planetary_set(case)), np.array(case.operation.speeds)
    check_rim_speed(modes.ring.modes, one.carrier * speeds)
    return one.mesh_frequency * speeds, one.carrier * speeds


@one_blas_thread()
def solve_housing(case: Case, dynamics: DynamicsResult) -> HousingResult:
    """Compute the carrier orders that a sensor fixed on the ring hears while the carrier turns past it."""
    check_entries(dynamics, DynamicsResult, dynamic_entries(case), "dynamic response")
    place = dynamics.ring_teeth, np.array([s.carrier for s in dynamics.speeds]), case.housing.sensor_angle
    known = {"symmetry": dynamics.symmetry, "periods": dynamics.response.periods}
    heard, width = case.housing.microphone, planetary_set(case).ring.face_width
    angle = case.housing.sensor_angle if heard.angle is None else heard.angle
    found = HousingResult(
        input_speed=np.array(case.operation.speeds),
        exact=component_lines(dynamics.ring_radial, *place, **known),
        form=case.housing.form, points=case.housing.points, harmonics=dynamics.harmonics,
        symmetry=dynamics.symmetry, excitation_limit=dynamics.excitation_limit,
        cylinder=Cylinder(case.ring.outer_radius, width), microphone=Microphone(heard.distance, angle),
    )  # fmt: skip
    if case.housing.sensor:
        found = replace(found, outputs={"sensor": _named_sensors(case, dynamics)})
    if (periods := dynamics.response.periods) > 1:
        radiating = *place[:2], found.cylinder, found.microphone
        found = replace(found, sound=component_sound(dynamics.ring_radial, *radiating, periods=periods))
    return found if dynamics.fixed is None else _standing_still(case, dynamics, found, dynamics.fixed)


def _named_sensors(case: Case, dynamics: DynamicsResult) -> tuple[tuple[str, ...], np.ndarray]:
    """Names and lines (speeds, n_sensors, n_orders) [m] of the sensors of a case on the ring."""
    carrier, lines = np.array([s.carrier for s in dynamics.speeds]), list[np.ndarray]()
    for one in case.housing.sensor:
        field = math.cos(one.direction) * dynamics.ring_radial
        if math.sin(one.direction):
            field = field + math.sin(one.direction) * dynamics.ring_tangential
        place = dynamics.ring_teeth, carrier, one.angle
        known = {"symmetry": dynamics.symmetry, "periods": dynamics.response.periods}
        lines.append(component_lines(field, *place, **known).displacement)
    return tuple(one.name for one in case.housing.sensor), np.stack(lines, axis=1)


def _standing_still(
    case: Case, dynamics: DynamicsResult, found: HousingResult, fixed: FixedHousing
) -> HousingResult:
    """What sensors and the microphone hear of the structure, by the forces of both routes."""
    structure, exact, top = fixed.structure, found.exact, dynamics.ring_radial.shape[-1] // 2
    count, first = structure.sensor_shape.shape[1], _radial_sensor(fixed, exact.sensor_angle, top)
    points = count - len(fixed.sensors) - len(fixed.forces)
    n, place = np.arange(-top, top + 1), 2 * np.pi * np.arange(points) / max(points, 1)
    wave = np.exp(1j * np.outer(place, n)) / max(points, 1)
    weights = np.column_stack([first, np.eye(count)[:, points:]])  # then all that have names
    named, sound = structure.combined(weights), None
    order, moved = structure_lines(named, fixed.two_way)
    lines = replace(exact, order=order, displacement=moved[:, 0], method=fixed_method(case))
    by_kind = moved[:, 1:][:, : len(fixed.sensors)], moved[:, 1 + len(fixed.sensors) :]
    outputs = dict(zip(("sensor", "force"), zip((fixed.sensors, fixed.forces), by_kind)))
    assert fixed.one_way is not None
    change, compared = np.full((2, len(lines.carrier_speed)), np.nan)
    if fixed.wider:
        at, levels = fixed.wider_at, list[np.ndarray]()
        for one in fixed.wider:
            order, wider = structure_lines(structure.combined(weights[:, :1]), one)
            here = replace(lines, order=order, displacement=wider[:, 0], turns=one.turns)
            levels.append(order_level(replace(here, carrier_speed=lines.carrier_speed[at])))
        change[at], compared[at] = 20.0 * np.log10(levels[1] / levels[0]), fixed.excited[1]
    order, one_way = structure_lines(structure.combined(weights[:, :1]), fixed.one_way)
    if points:
        around = structure.combined(np.eye(count)[:, :points])
        sound = _sound_around(around, fixed.two_way, lines, n, wave, found)
    elif structure.sensor_area is not None:
        velocity = 1j * np.outer(lines.base_speed, lines.order)[..., None] * np.swapaxes(moved[:, 1:], 1, 2)
        air = found.cylinder.density, found.cylinder.sound_speed
        pressure, power = equivalent_sound(velocity, structure.sensor_area, *air, found.microphone.distance)
        sound = pressure, None, power
    level = order_level(replace(lines, order=order, displacement=one_way[:, 0]))
    with np.errstate(divide="ignore", invalid="ignore"):  # of a sensor that stands still
        apart = 20.0 * np.log10(order_level(lines) / level)
    told = {
        "harmonics_change": change, "compared_harmonics": compared, "turn_multiplier": fixed.multiplier,
        "one_way_level": level, "one_way_difference": apart,
        "two_way_residual": fixed.two_way.residual, "order_tail": fixed.two_way.tail,
    }  # fmt: skip
    return replace(
        found, exact=lines, supported=told, missing=fixed.missing,
        outputs={kind: one for kind, one in outputs.items() if one[0]},
        sound=sound,
        excitation_limit=dynamics.response.mesh_frequency * fixed.excited[0],
    )  # fmt: skip


def _radial_sensor(fixed: FixedHousing, angle: float, top: int) -> np.ndarray:
    """Weights (n_sensors, ) of those of a structure that make the radial displacement at an angle [rad].

    Of the sensors around a ring, by waves up to a nodal diameter; of a casing its first sensor.
    """
    count = fixed.structure.sensor_shape.shape[1]
    points, weights = count - len(fixed.sensors) - len(fixed.forces), np.eye(count)[0]
    if points:
        n, place = np.arange(-top, top + 1), 2 * np.pi * np.arange(points) / points
        weights[:points] = (
            np.real(np.exp(1j * np.subtract.outer(angle, place)[:, None] * n).sum(axis=1)) / points
        )
    return weights


def _heard_in_housing(
    case: Case, modes: ModesResult, carrier: np.ndarray, harmonics: tuple[int, int]
) -> HeardSpeeds:
    """What is kept of the run-up at speeds of the carrier [rad/s] in a housing that stands still."""
    fixed, place = (
        fixed_housing(case, modes, carrier, both=False, harmonics=harmonics),
        (case.housing.sensor_angle, case.ring.teeth),
    )
    first = _radial_sensor(fixed, place[0], modes.max_diameter)[:, None]
    order, moved = structure_lines(fixed.structure.combined(first), fixed.two_way)
    lines = SensorLines(order, moved[:, 0], carrier, *place, fixed_method(case))
    orders, some = fixed.two_way.order, fixed.two_way.force
    force = np.zeros((*some.shape[:2], orders[-1] + 1), complex)
    force[..., orders] = some
    return heard_speeds(force, lines)


def fixed_method(case: Case) -> str:
    """Name how the lines of a sensor are found, see `SensorLines`."""
    return "casing" if case.housing.structure else "supports" if case.housing.support else "exact"


def _sound_around(
    around: FixedStructure, two_way: TwoWayResponse, lines: SensorLines, n, wave, found: HousingResult
) -> tuple[np.ndarray, ...]:
    """Sound of a structure by its sensors around the outer surface, with waves (points, n)."""
    sound = list[tuple[np.ndarray, ...]]()
    speeds = np.arange(len(lines.base_speed))
    for some in np.array_split(speeds, -(-len(speeds) // 20)):  # fit into memory
        here = two_way.at(some)
        velocity = 1j * np.outer(lines.base_speed[some], lines.order)[..., None]
        waves = velocity * np.swapaxes(structure_lines(around, here)[1], 1, 2) @ wave.conj()
        sound.append(surface_sound(waves, n, lines.frequency[some], found.cylinder, found.microphone))
    return tuple(np.concatenate(parts) for parts in zip(*sound))


@one_blas_thread()
def solve_runup(case: Case, modes: ModesResult, *, progress: Progress = silent) -> RunupResult:
    """Follow sensor and mesh forces over the speeds of the run-up, without stability.

    The excitation ends where that of `solve_dynamics` does. In a housing that stands still level, forces and
    lines are those of the set in it, while modes, and levels by one of them alone, are those on the
    foundation. CaseError: E-SPEED as there. ConvergenceError.
    """
    check_entries(modes, ModesResult, modal_entries(case), "modal basis")
    one, basis, excitation = member_speeds(case, planetary_set(case)), modes.modes, modes.excitation
    operating, given = np.array(case.operation.speeds), case.dynamics.mesh_harmonics
    some = checked_speeds(len(operating))
    up_to = _excitation_end(case, modes, *_turning_speeds(case, modes), some)[0]
    first, last = _runup_ends(case, modes)
    slowest, fastest = first * one.mesh_frequency, last * one.mesh_frequency
    count = int(limited(case, [slowest], up_to, given=given).excitation[0])
    if case.housing.stands_still:
        count = fixed_harmonics(case, case.runup.count)[0]
    motions = basis.shape[modes.model.ring_slice].T
    field = ring_field(modes.ring.modes, motions, RADIAL, modes.max_diameter)
    forces = modal_forces(basis, excitation, count, output=field)
    met = crossings(forces, slowest, fastest, up_to if given is None else math.inf)
    resonance = met.mesh_frequency / one.mesh_frequency
    heard, damping = forces.heard[met.row, met.harmonic - 1], forces.damping_ratio[met.row]
    speeds = refined_speeds(np.linspace(first, last, case.runup.count), resonance, heard, damping)
    speeds = np.union1d(speeds, operating[some][(operating[some] >= first) & (operating[some] <= last)])
    beside = operating[np.abs(operating[:, None] - resonance).argmin(axis=0)]
    found = resonances(basis, forces, met, resonance, beside)
    alike = np.abs(basis.frequency[:, None] / found["frequency"] - 1.0) <= ONE_FREQUENCY
    nearest = [np.abs(speeds[:, None] - at).argmin(axis=0) for at in (resonance, beside)]
    frequency, carrier, parts = one.mesh_frequency * speeds, one.carrier * speeds, list[HeardSpeeds]()
    alone, n = np.zeros((2, len(resonance))), np.arange(-modes.max_diameter, modes.max_diameter + 1)
    limit = limited(case, frequency, up_to, given=given)
    cuts = np.flatnonzero(np.diff(np.cumsum(limit.response) // _LINES_TOGETHER)) + 1
    for own in np.split(np.arange(len(speeds)), cuts):
        response = solve_spectral(basis, excitation, frequency[own], **limit.options(case, own))
        if not case.housing.stands_still:
            lines = _sensor_lines(case, modes, response, carrier[own])
            parts.append(heard_speeds(response.force, lines, response.lowest_force))
        order = np.arange(response.force.shape[-1])[:, None] * case.ring.teeth - np.sign(one.carrier) * n
        turning = carrier[own][:, None, None] * order
        for level, at in zip(alone, nearest):
            inside = np.where((at >= own[0]) & (at <= own[-1]), at - own[0], -1)
            level += mode_levels(response, field, alike, met.harmonic, turning, inside)
        progress("runup", float(own[-1] + 1), float(len(speeds)))
    if case.housing.stands_still:
        limit = replace(limit, frequency=frequency * fixed_harmonics(case, len(frequency))[0])
        for own in np.array_split(np.arange(len(speeds)), -(-len(speeds) // _SPEEDS_IN_HOUSING)):
            parts.append(_heard_in_housing(case, modes, carrier[own], fixed_harmonics(case, len(carrier))))
            progress("runup", float(own[-1] + 1), float(len(speeds)))
    return RunupResult(
        input_speed=speeds,
        mesh_frequency=frequency,
        excitation_limit=limit.frequency,
        carrier_speed=carrier,
        heard=joined(parts),
        resonances={**found, "resonance_alone": alone[0], "operating_alone": alone[1]},
        ring_teeth=case.ring.teeth,
        sensor_angle=case.housing.sensor_angle,
        operating_speeds=operating,
        unresolved=unresolved(speeds, resonance, heard, damping),
        method=fixed_method(case),
    )


def _runup_ends(case: Case, modes: ModesResult) -> tuple[float, float]:
    """First and last speed of the run-up [rad/s]; a default does not leave the range of the model."""
    one, (first, last) = member_speeds(case, planetary_set(case)), runup_ends(case)
    if case.runup.to is not None:
        check_rim_speed(modes.ring.modes, one.carrier * last)
        return first, last
    highest = min(HIGHEST_RESPONSE / (case.response_harmonics or 3), case.dynamics.up_to or math.inf)
    wave = _BELOW_WAVES * slowest_wave(modes.ring.modes)[0]
    allowed = min(highest / one.mesh_frequency, wave / abs(one.carrier))
    return first, max(min(last, allowed), *case.operation.speeds)


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
            "W-SIZE", "operation.speeds",
            f"{len(speeds)} speeds with up to {most} harmonics each fill about {size / 1e9:.2g} GB and "
            f"take about {max(kept.sum() * _SECONDS / 60.0, 1.0):.0f} min of one core",
            remedy="fewer speeds, or a lower dynamics.up_to, if that is too much",
        )  # fmt: skip
    periods, N = record_periods(case, planetary_set(case)), planetary_set(case).n_planets
    if case.housing.stands_still and periods > 1:
        unknowns = (2 * fixed_harmonics(case)[1] + 1) * (4 * fixed_diameters(case) + 1)
        minutes = len(speeds) * (periods // 2 + 1) * N * (unknowns / 1e3) ** 2 * _TURNING / 60.0
        if minutes > 1.0:
            key = "housing.support" if case.housing.support else "housing.structure"
            yield Finding(
                "W-SIZE", key,
                f"errors that turn over {periods} mesh periods may take up to {minutes:.0f} min in a housing "
                f"that stands still, at {len(speeds)} speeds",
                remedy="fewer speeds, mesh harmonics or nodal diameters, if that is too much",
            )  # fmt: skip


_FORMATS = {"wav": ("housing",), "uff": ("housing", "modes"), "quality": ("housing",)}
"""Formats of what a test bench would record, and the stages that they take."""


ELASTIC = Train(
    name="elastic", words="a case with an elastic ring",
    stages=(
        STATIC,
        STRESS,
        Stage(
            name="modes", title="Modes", solve=solve_modes, takes=("static",), options=("progress",),
            verdict=modes_verdict, describe=lambda results: describe_modes(results.modes),
            needs=lambda case: ("static", "stress") if case.static.stresses else ("static",),
            check=lambda case: check_dynamic_case(case, planetary_set(case)),
        ),
        Stage(
            name="runup",
            title="Run-up",
            solve=solve_runup,
            takes=("modes",),
            options=("progress",),
            verdict=lambda result: {"speeds": len(result.input_speed)},
            describe=lambda results: describe_runup(results.runup),
            warnings=runup_warnings,
            unavailable=no_runup,
        ),
        Stage(
            name="dynamics", title="Dynamics", solve=solve_dynamics, parts=dynamics_parts,
            takes=("static", "modes"), options=("progress",), verdict=response_verdict,
            describe=lambda results: describe_response(results.dynamics), warnings=dynamics_warnings,
        ),
        Stage(
            name="housing", title="Housing", solve=solve_housing, takes=("dynamics",),
            verdict=lambda result: {"form": result.form},
            describe=lambda results: describe_housing(results.housing),
            tables=lambda results: (mesh_bands(results),), warnings=housing_warnings,
        ),
    ),
    describe=describe_set, warnings=_warnings, figures=FIGURES, verdict=verdict,
    recorded=Recorded(
        sensor_signals, signal_extent, _FORMATS, 2, sensor_spectra, ring_shapes, order_cuts
    ),
)  # fmt: skip
