"""The pipeline with an elastic ring: static, stress -> modes -> dynamics -> housing. Read this first.

Each stage takes the case and what came before, and returns a frozen result whose ``dataset()`` is what goes
to disk. `ELASTIC` at the end is the train: the table of its stages, with what the report says and draws of
each.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.case import planetary_set, set_deviations
from femgear.case.dependencies import (
    Steps,
    check_entries,
    dynamic_entries,
    modal_entries,
    ring_entries,
    state_entries,
    static_entries,
)
from femgear.case.sections import CarrierSection, Case, MachineSection, SunSection
from femgear.errors import Finding, remark
from femgear.report.tables import describe_modes, describe_response
from femgear.trains.elastic.checks import (
    case_warnings,
    check_dynamic_case,
    check_reach,
    check_rim_speed,
    dynamics_warnings,
    fastest_mesh_frequency,
    max_nodal_diameter,
)
from femgear.trains.elastic.results import (
    DynamicsResult,
    HousingResult,
    ModesResult,
    describe_housing,
    mesh_bands,
)
from femgear.trains.protocol import Figures, Progress, Stage, Train, one_blas_thread
from femgear.trains.static.description import describe_case
from femgear.trains.static.results import StaticResult
from femgear.trains.static.stages import (
    STATIC,
    STRESS,
    case_supports,
    material_of,
    mesh_backlash,
    response_verdict,
    ring_foundation,
)

if TYPE_CHECKING:
    from femgear.contact.bodies import Bodies
    from femgear.contact.loaded_period import LoadedPeriod
    from femgear.gears.kinematics import Speeds
    from femgear.gears.planetary import PlanetarySet
    from femgear.system.system import Modes, Response
    from femgear.trains.elastic.checks import FrequencyLimit
    from femgear.trains.elastic.model import ElasticSet, RigidBodies, RingModel

RECORD = 2**13
"""Positions of the excitation in one mesh period at least."""
MODES_ABOVE = 4.0
"""The modal basis reaches this many times the excitation: the excitation may be doubled once, and modes up to
twice a frequency carry the response there."""


@one_blas_thread()
def solve_modes(
    case: Case, static: StaticResult, *, progress: Progress | None = None, steps: Steps | None = None
) -> ModesResult:
    """Modal basis of the set with its elastic ring and mean mesh stiffnesses.

    Its loaded state, from which the meshes take stiffness and excitation, is that of the set on its supports
    and of the ring on its foundation, whatever ``static.members`` shows.

    Parameters
    ----------
    case : Case
    static : StaticResult
    progress : callable, optional
        Called with (stage, done, total).
    steps : Steps, optional
        Compliances, loaded states and ring models of other cases, taken where they are those of this one.

    Raises
    ------
    CaseError
        Without torque, or when the ring, which is the housing of this model, is not the fixed member.
    """
    check_entries(static, StaticResult, static_entries(case), "static solution")
    check_dynamic_case(case, static.planetary_set)
    steps, entries = steps or Steps(), ring_entries(case)
    bodies = _ring_states(case, static, steps)
    state = steps.take(
        "loaded state",
        state_entries(case),
        lambda: state_on_supports(case, bodies, static.sun_torque, progress=progress),
    )
    reach, side = excitation_reach(case, state, static.sun_torque), 1.0 if static.sun_torque >= 0 else -1.0
    ring = steps.take(
        "ring model",
        {**entries, "reach": reach, "side": side},
        lambda: ring_of_case(case, static, reach=reach, side=side),
    )
    return modal_basis(case, ring, bodies, state, sun_torque=static.sun_torque, reach=reach)


def _ring_states(case: Case, static: StaticResult, steps: Steps) -> tuple[Bodies, Bodies]:
    """Flank compliances with the ring on its foundation, and with the ring held; one is the static one's."""
    from femgear.contact.bodies import with_ring

    fixed = case.static.members == "fixed"

    def other() -> Bodies:
        springs = ring_foundation(case, static.sectors.ring) if fixed else None
        return with_ring(static.bodies, static.sectors, depth=case.static.depth, ring_foundation=springs)

    found = steps.take("ring compliances", ring_entries(case), other)
    return (found, static.bodies) if fixed else (static.bodies, found)


def ring_of_case(case: Case, static: StaticResult, *, reach: float, side: float) -> RingModel:
    """Cyclic modes of the ring on its foundation for excitation up to a frequency [Hz].

    ``side`` is the sign of the sun's torque.
    """
    from femgear.contact.bodies import active_flank_load
    from femgear.fe.elasticity import mass
    from femgear.trains.elastic.model import ring_model

    gears, sector = static.planetary_set, static.sectors.ring
    return ring_model(
        gears,
        sector.grid,
        sector.stiffness,
        mass(sector.grid, material_of(case), gears.ring.face_width),
        ring_foundation(case, sector),
        active_flank_load(sector.grid, gears, side),
        max_diameter=max_nodal_diameter(case),
        max_frequency=MODES_ABOVE * reach,
        side=side,
    )


def state_on_supports(case: Case, bodies, sun_torque: float, *, progress=None) -> LoadedPeriod:
    """Loaded state of the set on its supports, over one mesh period.

    ``bodies`` are flank compliances with the ring on its foundation, and with the ring held.
    """
    from femgear.contact.loaded_period import loaded_period

    deviations = set_deviations(case)
    return loaded_period(
        planetary_set(case),
        *bodies,
        sun_torque=sun_torque,
        positions=case.static.positions,
        contact=case.static.contact,
        deviations=None if deviations.ideal else deviations,
        # the bearings of the dynamic model are linear
        supports=replace(case_supports(case), planet_clearance=0.0),
        progress=None if progress is None else lambda done, total: progress("modes", done, total),
    )


def excitation_reach(case: Case, state: LoadedPeriod, sun_torque: float) -> float:
    """Frequency to which the excitation reaches [Hz], see `highest_excitation`."""
    from femgear.trains.elastic.checks import highest_excitation
    from femgear.trains.elastic.model import highest_mesh_mode

    gears, stiffness = planetary_set(case), state.resampled("held_stiffness", RECORD).mean(axis=1)
    mesh_mode = highest_mesh_mode(gears, stiffness, rigid_bodies(case), sun_torque=sun_torque)
    return highest_excitation(case, mesh_mode, fastest_mesh_frequency(case, gears))


def modal_basis(case: Case, ring: RingModel, bodies, state: LoadedPeriod, *, sun_torque, reach):
    """Modes of the set with the ring given and the meshes of the loaded state."""
    from femgear.solvers.linear import modal
    from femgear.trains.elastic.model import (
        body_flexibility,
        elastic_set,
        mesh_excitation,
        ring_mesh_compliance,
    )

    gears, diameters = planetary_set(case), np.arange(len(ring.compliance))
    held, compliance = (
        ring_mesh_compliance(values, diameters, gears.ring.teeth, gears.planet_angles)
        for values in (ring.held_compliance, ring.compliance)
    )
    flexibility = body_flexibility(state.held_compliance, held)
    # equal planets are equal to rounding when their phases are among the positions
    record = gears.n_planets * -(-RECORD // gears.n_planets)
    excitation = mesh_excitation(
        state.resampled("held_stiffness", record),
        state.resampled("deflection", record),
        state.resampled("force", record),
        held,
        ring_compliance=compliance,
        flexibility=flexibility,
        backlash=mesh_backlash(gears),
    )
    model = elastic_set(
        gears,
        ring,
        rigid_bodies(case),
        sun_torque=sun_torque,
        driven=case.operation.input,
        flexibility=flexibility,
    )
    modes = modal.solve_modes(
        model.system,
        excitation.stiffness.mean(axis=1),
        damping_ratio=case.dynamics.damping_ratio,
        max_frequency=MODES_ABOVE * reach,
    )
    return ModesResult(
        ring=ring,
        model=model,
        excitation=excitation,
        modes=_named(modes, model),
        max_diameter=int(diameters[-1]),
        bodies=bodies,
        state=state,
        reach=reach,
        entries=modal_entries(case),
    )


@one_blas_thread()
def solve_dynamics(
    case: Case, static: StaticResult, modes: ModesResult, *, progress: Progress | None = None
) -> DynamicsResult:
    """Periodic response at the case's speeds by the spectral method, with a Floquet verdict at each.

    Raises
    ------
    CaseError
        A carrier that runs around the ring faster than its waves (E-SPEED).
    ConvergenceError
    """
    from femgear.solvers.stability.parametric import decisive_harmonics
    from femgear.solvers.stability.parametric import stability as floquet_verdict

    check_entries(static, StaticResult, static_entries(case), "static solution")
    check_entries(modes, ModesResult, modal_entries(case), "modal basis")
    gears, basis = static.planetary_set, modes.modes
    all_speeds = turning_speeds(case, gears)
    check_reach(case, modes.reach, fastest_mesh_frequency(case, gears))
    check_rim_speed(modes.ring.modes, [s.carrier for s in all_speeds])
    limit, response, change, compared_to = _checked_response(case, modes, all_speeds)
    if progress is not None:
        progress("dynamics", 1, 2)
    stability = floquet_verdict(
        basis,
        modes.excitation,
        response.mesh_frequency,
        excitation_harmonics=decisive_harmonics(basis, modes.excitation, int(limit.excitation.max())),
    )
    if progress is not None:
        progress("dynamics", 2, 2)
    dte, field = _outputs(modes, response)
    return DynamicsResult(
        input_speed=np.array(case.operation.speeds),
        speeds=all_speeds,
        response=response,
        stability=stability,
        dte=dte,
        ring_radial=field[0],
        ring_tangential=field[1],
        mesh_names=gears.mesh_names,
        ring_teeth=gears.ring.teeth,
        excitation_limit=limit.frequency,
        level_change=change,
        compared_to=compared_to,
        entries=dynamic_entries(case),
    )


@one_blas_thread()
def solve_response(case: Case, modes: ModesResult) -> Response:
    """Periodic response at the speeds of the case, without stability and fields of `solve_dynamics`.

    Raises
    ------
    CaseError
        E-SPEED, as there.
    """
    found = turning_speeds(case, planetary_set(case))
    check_rim_speed(modes.ring.modes, [s.carrier for s in found])
    frequency = np.array([s.mesh_frequency for s in found])
    up_to = case.dynamics.up_to or modes.reach
    return periodic_response(case, modes, frequency, up_to, given=case.dynamics.mesh_harmonics)[1]


def turning_speeds(case: Case, gears: PlanetarySet) -> tuple[Speeds, ...]:
    """Speeds of all members at the speeds of the input."""
    from femgear.gears.kinematics import speeds

    return tuple(
        speeds(gears, input=case.operation.input, fixed="ring", speed=s) for s in case.operation.speeds
    )


def periodic_response(
    case: Case, modes: ModesResult, mesh_frequency, up_to: float, *, given: int | None
) -> tuple[FrequencyLimit, Response]:
    """Periodic response to excitation up to a frequency, or of a given number of mesh harmonics.

    Parameters
    ----------
    case : Case
    modes : ModesResult
    mesh_frequency : (n_speeds,) array
        [Hz]
    up_to, given
        As for `femgear.trains.elastic.checks.limited`.
    """
    from femgear.solvers.periodic.spectral import solve_spectral
    from femgear.trains.elastic.checks import limited

    limit = limited(case, planetary_set(case), mesh_frequency, up_to, given=given)
    response = solve_spectral(
        modes.modes,
        modes.excitation,
        mesh_frequency,
        excitation_harmonics=limit.excitation,
        response_harmonics=limit.response,
        tolerance=case.dynamics.tolerance,
    )
    return limit, response


def _checked_response(case: Case, modes: ModesResult, all_speeds):
    """Response, its frequency limit, what the level changes beyond it [dB], and the limit compared with [Hz].

    Where the case sets no limit it is doubled once where that changes the level by 1 dB or more.
    """
    from femgear.trains.elastic.checks import NOTICEABLE, checked_speeds

    frequency = np.array([s.mesh_frequency for s in all_speeds])
    given, up_to = case.dynamics.mesh_harmonics, case.dynamics.up_to or modes.reach
    automatic = given is None and case.dynamics.up_to is None
    some = checked_speeds(len(frequency))
    limit, response = periodic_response(case, modes, frequency, up_to, given=given)
    while True:
        beyond = max(2.0 * (up_to if given is None else float(limit.frequency.max())), modes.reach)
        further, wider = periodic_response(case, modes, frequency[some], beyond, given=None)
        levels = [_level(case, modes, one, all_speeds, some) for one in (response, wider)]
        change = np.full(len(frequency), np.nan)
        change[some] = 20.0 * np.log10(levels[1] / levels[0])
        reached = further.frequency > beyond - frequency[some]
        doubted = np.abs(change[some][reached]).max(initial=0.0) >= NOTICEABLE
        if not (automatic and doubted) or up_to > modes.reach:
            return limit, response, _slow_speeds(case, modes, all_speeds, limit, change, beyond), beyond
        up_to = beyond
        if len(some) == len(frequency):
            limit, response = further, wider
        else:
            limit, response = periodic_response(case, modes, frequency, up_to, given=None)


def _slow_speeds(case: Case, modes: ModesResult, all_speeds, limit, change, beyond: float) -> np.ndarray:
    """Changes of the level [dB], estimated where no run reaches the frequency compared with.

    By the slowest speed that does reach it, see `femgear.trains.elastic.checks.levels_below`.
    """
    from femgear.housing.sensor import fixed_sensor_lines
    from femgear.trains.elastic.checks import HARMONICS, levels_below

    frequency = np.array([s.mesh_frequency for s in all_speeds])
    slow = frequency * HARMONICS < beyond - frequency
    if not slow.any():
        return change
    fast = beyond / HARMONICS * (1.0 + 1e-9)
    _, response = periodic_response(case, modes, np.array([fast]), beyond, given=None)
    teeth = planetary_set(case).ring.teeth
    carrier = np.sign(all_speeds[0].carrier) * 2.0 * np.pi * fast / teeth
    field = _outputs(modes, response)[1][0][0]
    lines = fixed_sensor_lines(field, teeth, carrier, case.housing.sensor_angle)
    change = change.copy()
    change[slow] = -20.0 * np.log10(np.maximum(levels_below(lines, limit.frequency[slow]), 1e-10))
    return change


def _level(case: Case, modes: ModesResult, response: Response, all_speeds, some) -> np.ndarray:
    """Root mean square of the acceleration of the sensor at some of the speeds [m/s^2]."""
    from femgear.housing.orders import order_level
    from femgear.housing.sensor import fixed_sensor_lines

    if len(response.force) > len(some):
        parts = {name: getattr(response, name)[some] for name in ("deflection", "force", "modal")}
        response = replace(response, **parts)
    carrier = np.array([all_speeds[i].carrier for i in some])
    field = _outputs(modes, response)[1][0]
    teeth = planetary_set(case).ring.teeth
    return order_level(fixed_sensor_lines(field, teeth, carrier, case.housing.sensor_angle))


def _outputs(result: ModesResult, response: Response):
    """Dynamic transmission error of every mesh, and radial and tangential field of the ring."""
    from femgear.solvers.linear.modal import output_load, output_response, residual_output
    from femgear.trains.elastic.model import RADIAL, TANGENTIAL, ring_field

    model, basis = result.model, result.modes
    ring_rows = np.eye(len(model.system.M))[model.ring_slice]
    outputs = np.vstack([model.rigid_directions.T, ring_rows])
    values = output_response(
        basis,
        response,
        outputs @ basis.shape,
        residual=residual_output(model.system, basis, outputs),
        load=output_load(model.system, basis, outputs),
    )
    n_meshes = model.rigid_directions.shape[1]
    coordinates = np.swapaxes(values[:, n_meshes:], 1, 2)
    field = [
        ring_field(model, result.ring.modes, coordinates, output, result.max_diameter)
        for output in (RADIAL, TANGENTIAL)
    ]
    return values[:, :n_meshes], field


@one_blas_thread()
def solve_housing(case: Case, dynamics: DynamicsResult) -> HousingResult:
    """Signal and carrier orders of a sensor fixed on the ring while the carrier turns past it.

    With ``housing.form = "linear"`` the static deflection (harmonic zero) is carried exactly all the same:
    its images, where the teeth of the ring are a multiple of the number of points, would fall on the mesh
    orders.
    """
    from femgear.housing.sensor import fixed_sensor_lines, fixed_sensor_signal, heaviside_linear_lines

    check_entries(dynamics, DynamicsResult, dynamic_entries(case), "dynamic response")
    carrier = np.array([s.carrier for s in dynamics.speeds])
    arguments = (dynamics.ring_teeth, carrier, case.housing.sensor_angle)
    lines = exact = fixed_sensor_lines(dynamics.ring_radial, *arguments)
    if case.housing.form == "linear":
        static = np.zeros_like(dynamics.ring_radial)
        static[:, 0] = dynamics.ring_radial[:, 0]
        moving = heaviside_linear_lines(dynamics.ring_radial - static, *arguments, points=case.housing.points)
        still = fixed_sensor_lines(static, *arguments)
        lines = replace(moving, displacement=moving.displacement + still.displacement)
    return HousingResult(
        input_speed=np.array(case.operation.speeds),
        lines=lines,
        exact=exact,
        signal=fixed_sensor_signal(lines),
        form=case.housing.form,
        points=case.housing.points,
        excitation_limit=dynamics.excitation_limit,
    )


def rigid_bodies(case: Case) -> RigidBodies:
    """Rigid bodies of a case, with motor and brake where it has them."""
    from femgear.trains.elastic.model import BodyData, RigidBodies, ShaftData

    def supported(section: SunSection | CarrierSection) -> BodyData:
        # given, or found from the shaft by the reader of the case
        assert section.support_stiffness is not None
        return BodyData(section.mass, section.inertia, section.support_stiffness)

    def shaft(section: MachineSection | None) -> ShaftData | None:
        return None if section is None else ShaftData(section.inertia, section.coupling_stiffness)

    planet = BodyData(case.planet.mass, case.planet.inertia, case.planet.bearing_stiffness)
    ends = shaft(case.motor), shaft(case.brake)
    return RigidBodies(supported(case.sun), supported(case.carrier), planet, *ends)


def _named(modes: Modes, model: ElasticSet) -> Modes:
    """The modes with their kinds and nodal diameters."""
    from femgear.system.mode_kinds import mode_kinds

    kinds, diameters = mode_kinds(
        modes.shape,
        np.diag(model.system.M),
        model.system.dofs,
        frequency=modes.frequency,
        ring_diameter=model.ring_diameter,
        ring_slice=model.ring_slice,
        planet_angles=model.planet_angles,
    )
    return replace(modes, kind=kinds, nodal_diameter=diameters)


def _figures() -> Mapping[str, Figures]:
    from femgear.trains.elastic.figures import FIGURES

    return FIGURES


def _notices(data: dict) -> Iterator[Finding]:
    if "bearing_clearance" in data["planet"] and data.get("static", {}).get("members", "fixed") == "fixed":
        yield remark(
            'planet.bearing_clearance has no effect while static.members is "fixed": write '
            'static.members = "elastic"'
        )


ELASTIC = Train(
    name="elastic",
    words="a case with an elastic ring",
    model=Case,
    stages=(
        STATIC,
        STRESS,
        Stage(
            name="modes",
            title="Modes",
            solve=lambda case, results, context: solve_modes(
                case, results["static"], progress=context.progress
            ),
            verdict=lambda result: {
                "modes": len(result.modes.frequency), "degrees_of_freedom": len(result.model.system.M),
            },
            describe=lambda results: describe_modes(results.modes),
            needs=lambda case: ("static", "stress") if case.static.stresses else ("static",),
            check=lambda case: check_dynamic_case(case, planetary_set(case)),
        ),
        Stage(
            name="dynamics",
            title="Dynamics",
            solve=lambda case, results, context: solve_dynamics(
                case, results["static"], results["modes"], progress=context.progress
            ),
            verdict=response_verdict,
            describe=lambda results: describe_response(results.dynamics),
            needs=lambda case: ("modes",),
        ),
        Stage(
            name="housing",
            title="Housing",
            solve=lambda case, results, _: solve_housing(case, results["dynamics"]),
            verdict=lambda result: {"form": result.form},
            describe=lambda results: describe_housing(results.housing),
            needs=lambda case: ("dynamics",),
            tables=lambda results: (mesh_bands(results),),
        ),
    ),
    describe=lambda case: describe_case(case, warnings=case_warnings(case)),
    warnings=case_warnings,
    result_warnings=lambda results: (
        dynamics_warnings(results.dynamics) if "dynamics" in results.stages else ()
    ),
    figures=_figures,
    notices=_notices,
)  # fmt: skip
