"""The pipeline of a planar case: static (where no mesh stiffness is given) -> modes -> branch, response.

`PLANAR` at the end is the train: the table of its stages, with what the report says and draws of each.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.case import planetary_set
from femgear.case.dependencies import check_entries, static_entries
from femgear.errors import Finding
from femgear.report.tables import describe_modes
from femgear.trains.planar.checks import (
    bounded_branch,
    check_branch_damping,
    check_planar_case,
    check_response_damping,
    check_response_motions,
    check_smoothing,
    end_of_branch,
)
from femgear.trains.planar.results import (
    BranchResult,
    PlanarModesResult,
    PlanarResponseResult,
    describe_branch,
    describe_planar,
    describe_response,
    planar_verdicts,
    published_modes,
    remarks,
)
from femgear.trains.planar.section import PlanarCase, check_planar, planar_notices
from femgear.trains.protocol import Figures, Progress, Stage, Train, one_blas_thread
from femgear.trains.rigid import (
    driving_torque,
    member_speeds,
    mesh_stiffnesses,
    modes_verdict,
    needed,
    rotation_sense,
    torsional_support,
)
from femgear.trains.static.description import describe_case, set_warnings
from femgear.trains.static.results import StaticResult
from femgear.trains.static.stages import STATIC, STRESS

if TYPE_CHECKING:
    from femgear.gears.planetary import PlanetarySet
    from femgear.report.tables import Block
    from femgear.storage.results import Results
    from femgear.system.elements import GearMeshes
    from femgear.system.rigid_bodies import PlanarSet
    from femgear.trains.planar.model import PlanarModel


@one_blas_thread()
def solve_planar_modes(case: PlanarCase, static: StaticResult | None = None) -> PlanarModesResult:
    """Natural frequencies, modes and their kinds.

    Parameters
    ----------
    case : Case
        With a section planar.
    static : StaticResult, optional
        Needed where the case gives no mesh stiffness.

    Raises
    ------
    CaseError
        What `check_planar_case` refuses, a load that accelerates the set.
    """
    from femgear.solvers.linear.modal import solve_modes
    from femgear.system.mode_kinds import gear_set_kinds
    from femgear.trains.planar.model import mode_ratios

    gears = planetary_set(case)
    check_planar_case(case, gears)
    model = planar_model(case, gears, static)
    bare = replace(model.problem.system, C=np.zeros_like(model.problem.system.C))
    modes = solve_modes(bare, model.springs)
    ratios = np.where(modes.frequency > 0.0, mode_ratios(modes.frequency, _ratios(case)), 0.0)
    kinds = gear_set_kinds(model.data, modes.shape, frequency=modes.frequency)
    return PlanarModesResult(gears, model.data, replace(modes, kind=kinds, damping_ratio=ratios))


@one_blas_thread()
def solve_branch(
    case: PlanarCase, static: StaticResult | None = None, *, progress: Progress | None = None
) -> BranchResult:
    """Periodic responses to the weight, past limit points, with a Floquet verdict at each.

    Mesh stiffnesses are constant: the given ones, or the mean of the static solution's. The branch ends
    before motions that the model of small displacements does not hold for.

    Raises
    ------
    CaseError
        What `check_planar_case` refuses, a range over an undamped natural frequency (E-RESONANCE).
    ConvergenceError
        No response at the start, or one that moves too far (E-MOTION).
    """
    from femgear.trains.planar.model import judged_branch, motion_lines, weight_curve

    gears, wanted = planetary_set(case), needed(case.planar.branch, "planar.branch")
    check_planar_case(case, gears)
    model = planar_model(case, gears, static)
    check_smoothing(case, gears, model)
    check_branch_damping(case, model)
    branch = weight_curve(
        model.problem,
        (wanted.start, wanted.to),
        reduction=model.reduction,
        harmonics=wanted.harmonics,
        radius=True,
        max_points=wanted.points,
    )
    branch, lines = bounded_branch(branch, (motion_lines(model, one) for one in branch.solutions), gears)
    if wanted.stability:
        tell = progress or (lambda stage, done, total: None)
        branch = judged_branch(
            model.problem, branch, lambda done, total: tell("branch", 0.3 * total + 0.7 * done, total)
        )
    ending = end_of_branch(branch, wanted)
    return BranchResult(gears, model, branch, lines, carrier_sense(case, gears), ending)


@one_blas_thread()
def solve_planar_response(
    case: PlanarCase, static: StaticResult | None = None, *, progress: Progress | None = None
) -> PlanarResponseResult:
    """Responses to weight and mesh frequency together at the speeds of the operation.

    Raises
    ------
    CaseError
        What `check_planar_case` refuses, a line on an undamped natural frequency (E-RESONANCE).
    ConvergenceError
        Speeds without a solution, or with one that moves too far (E-MOTION).
    """
    from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
    from femgear.trains.planar.model import motion_lines

    gears = planetary_set(case)
    check_planar_case(case, gears)
    operation, orders = case.operation, _response_lines(case, gears, static)
    turning = tuple(member_speeds(case, gears, speed) for speed in operation.speeds)
    solutions, lines, model = [], [], None
    for number, speed in enumerate(turning):
        if model is None or case.planar.gyroscopic:
            carrier = speed.carrier if case.planar.gyroscopic else 0.0
            model = planar_model(case, gears, static, mesh_frequency=True, carrier_speed=carrier)
            check_smoothing(case, gears, model)
        frequency = np.array([abs(speed.carrier), 2.0 * np.pi * speed.mesh_frequency])
        check_response_damping(case, model, frequency, orders)
        found = None
        options = {"orders": orders, "reduction": model.reduction, "radius": len(orders) < 60}
        if solutions and solutions[-1].converged:
            found = solve_harmonic_balance(model.problem, frequency, start=solutions[-1], **options)
        if found is None or not found.converged:
            found = solve_harmonic_balance(model.problem, frequency, **options)
        solutions.append(found)
        lines.append(motion_lines(model, found))
        if progress is not None:
            progress("response", number + 1, len(turning))
    check_response_motions(operation.speeds, solutions, lines, gears)
    return PlanarResponseResult(gears, np.array(operation.speeds), turning, tuple(solutions), tuple(lines))


def planar_data(case: PlanarCase, gears: PlanetarySet, static: StaticResult | None = None) -> PlanarSet:
    """Lumped set of a case: bodies and supports of its entries, radii and angles of its gears.

    Parameters
    ----------
    case : Case
    gears : PlanetarySet
    static : StaticResult, optional
        Its mean stiffnesses are taken where the case gives none.
    """
    from femgear.system.rigid_bodies import PlanarBody, planar_from_set

    planar, bodies = case.planar, {}
    for name, one in (("carrier", case.carrier), ("ring", planar.ring), ("sun", case.sun)):
        torsional = torsional_support(case, name, getattr(planar.torsion, name))
        support = needed(one.support_stiffness, f"{name}.support_stiffness")
        bodies[name] = PlanarBody(one.mass, one.inertia, support, torsional)
    given = planar.mesh_stiffness
    mean = needed(static, "static").cycle.stiffness.mean(axis=1) if given is None else None
    return planar_from_set(
        gears,
        **bodies,
        planet=PlanarBody(case.planet.mass, case.planet.inertia),
        **mesh_stiffnesses(given, mean),
        planet_bearing=case.planet.bearing_stiffness,
    )


def planar_model(
    case: PlanarCase,
    gears: PlanetarySet,
    static: StaticResult | None = None,
    *,
    mesh_frequency: bool = False,
    carrier_speed: float = 0.0,
) -> PlanarModel:
    """The lumped set of a case with its elements, forces and damping.

    Parameters
    ----------
    case : Case
    gears : PlanetarySet
    static : StaticResult, optional
        Needed where the case gives no mesh stiffness.
    mesh_frequency : bool
        The base frequencies are those of carrier and mesh, and the mesh stiffness of a static result varies;
        otherwise the only base frequency is that of the weight, and mesh stiffnesses are constant.
    carrier_speed : float
        Of the gyroscopic terms [rad/s].
    """
    from femgear.trains.planar.model import (
        Clearances,
        MemberBearing,
        PlanarModel,
        bearing_damping_matrix,
        closed_springs,
        planar_problem,
        with_bearing,
    )

    if static is not None:
        check_entries(static, StaticResult, static_entries(case), "static solution")
    planar = case.planar
    data = planar_data(case, gears, static)
    clearance = case.planet.bearing_clearance or None
    options = {
        "meshes": _meshes(case, gears, data, static, mesh_frequency),
        "back_flanks": planar.back_flanks,
        "torque": driving_torque(case, reacts=planar.reaction == "output"),
        "clearances": None if clearance is None else Clearances(planets=clearance),
        "gravity": _gravity(case, gears, mesh_frequency),
        "pin_errors": _pin_errors(case, gears.n_planets) if planar.mesh_stiffness else None,
    }
    still = planar_problem(data, **options)
    bearing = None
    if (one := planar.carrier_bearing) is not None:
        bearing = MemberBearing(one.stiffness, one.clearance, "carrier", one.on)
        still = with_bearing(still, data, bearing)
    C = bearing_damping_matrix(still, closed_springs(still, data, bearing), _ratios(case))
    problem = replace(still, system=replace(still.system, C=C))
    if carrier_speed:
        problem = planar_problem(data, **options, carrier_speed=carrier_speed, damping=C)
        problem = problem if bearing is None else with_bearing(problem, data, bearing)
    return PlanarModel(data, problem, planar.back_flanks, clearance is not None, bearing)


def carrier_sense(case: PlanarCase, gears: PlanetarySet) -> int:
    """1 where the carrier turns counter-clockwise, -1 where clockwise, 0 where it stands."""
    return int(np.sign(member_speeds(case, gears).carrier))


def _ratios(case: PlanarCase):
    return case.planar.damping_ratios or case.dynamics.damping_ratio


def _meshes(case, gears, data, static, varying: bool) -> GearMeshes:
    """Mesh elements: constant, or along the static record over the mesh phase."""
    from femgear.system.assembler import mesh_elements
    from femgear.system.elements import GearMeshes
    from femgear.system.fourier import constant
    from femgear.system.system import MeshExcitation

    planar, N = case.planar, gears.n_planets
    backlash = planar.line_backlash
    if backlash is None:
        play = np.repeat([gears.backlash_sun_planet, gears.backlash_planet_ring], N)
        backlash = np.where(play > 0.0, play, np.inf)
    if planar.mesh_stiffness is not None:
        return mesh_elements(data, backlash=backlash, smoothing=planar.smoothing)
    cycle = needed(static, "static").cycle
    if not varying:
        stiffness, deflection, force = (
            getattr(cycle, name).mean(axis=1) for name in ("stiffness", "deflection", "force")
        )
        unloaded = constant(deflection - force / stiffness)
        return GearMeshes(
            np.arange(2 * N), constant(stiffness), unloaded, backlash=backlash, smoothing=planar.smoothing
        )
    record = MeshExcitation(cycle.stiffness, cycle.deflection, cycle.force, np.zeros(2 * N))
    return mesh_elements(
        data,
        stiffness=record,
        harmonics=case.mesh_harmonics,
        # positions of the record run with the sun against the carrier
        orders=(0, rotation_sense(case, gears)),
        backlash=backlash,
        smoothing=planar.smoothing,
    )


def _gravity(case: PlanarCase, gears: PlanetarySet, mesh_frequency: bool):
    from femgear.trains.planar.model import Gravity

    given, sense = case.planar.gravity, carrier_sense(case, gears)
    if given is None:
        return None
    orders = None if sense == 0 else (sense, 0) if mesh_frequency else (sense,)
    return Gravity(given.acceleration, given.direction, orders)


def _pin_errors(case: PlanarCase, n_planets: int) -> np.ndarray:
    pins = np.zeros((n_planets, 2))
    for pin in case.set.pin_errors:
        pins[pin.planet - 1] = pin.radial, pin.tangential
    return pins


def _response_lines(case: PlanarCase, gears: PlanetarySet, static: StaticResult | None) -> np.ndarray:
    """Lines of weight and mesh frequency; none of the weight where it does not turn, none of the mesh
    frequency where the mesh stiffness is constant."""
    from femgear.system.fourier import side_bands

    wanted = needed(case.planar.response, "planar.response")
    turns = case.planar.gravity is not None and carrier_sense(case, gears) != 0
    carrier, bands = (wanted.carrier_harmonics, wanted.side_bands) if turns else (0, 0)
    mesh = case.response_harmonics if case.planar.mesh_stiffness is None else 0
    return side_bands(carrier, mesh, bands)


def _branch_verdict(result: BranchResult) -> dict:
    branch = result.branch
    return {
        "converged": bool(np.all(branch.converged)),
        "complete": bool(branch.complete),
        "points": len(branch.parameter),
        "folds": len(branch.folds),
        "residual": float(np.max(branch.residual)),
        "message": result.ending,
        **_truncation(branch.solutions, result.lines),
    }


def _response_verdict(result: PlanarResponseResult) -> dict:
    return {
        "converged": all(one.converged for one in result.solutions),
        "residual": max(one.residual for one in result.solutions),
        **_truncation(result.solutions, result.lines),
    }


def _truncation(solutions, lines) -> dict:
    """Largest shares of the amplitude in the upper half of the lines."""
    return {
        "tail": float(max(one.tail for one in solutions)),
        "force_tail": float(max(one.force_tail for one in lines)),
    }


def _needs_static(case: PlanarCase) -> tuple[str, ...]:
    return ("static",) if case.planar.mesh_stiffness is None else ()


def _lacks(section: str) -> Callable[[PlanarCase], str]:
    return lambda case: "" if getattr(case.planar, section) else f"the case has no section planar.{section}"


def _figures() -> Mapping[str, Figures]:
    from femgear.trains.planar.figures import FIGURES

    return FIGURES


def _result_warnings(results: Results) -> Iterator[Finding]:
    branch, response = (
        results.stage(name) if name in results.stages else None for name in ("branch", "response")
    )
    return planar_verdicts(branch, response)


def _published(results: Results) -> tuple[Block, ...]:
    block = published_modes(results.case, results.modes)
    return () if block is None else (block,)


PLANAR = Train(
    name="planar",
    words="a planar case",
    model=PlanarCase,
    section="planar",
    stages=(
        replace(STATIC, wanted=lambda case: bool(_needs_static(case))),
        replace(STRESS, wanted=lambda case: bool(_needs_static(case)) and case.static.stresses),
        Stage(
            name="modes",
            title="Modes",
            solve=lambda case, results, _: solve_planar_modes(case, results.get("static")),
            verdict=modes_verdict,
            describe=lambda results: describe_modes(results.modes),
            needs=_needs_static,
            check=lambda case: check_planar_case(case, planetary_set(case)),
            tables=_published,
        ),
        Stage(
            name="branch",
            title="Response to the weight",
            solve=lambda case, results, context: solve_branch(
                case, results.get("static"), progress=context.progress
            ),
            verdict=_branch_verdict,
            describe=lambda results: describe_branch(results.branch),
            unavailable=_lacks("branch"),
            needs=lambda case: ("modes",),
        ),
        Stage(
            name="response",
            title="Weight and mesh frequency",
            solve=lambda case, results, context: solve_planar_response(
                case, results.get("static"), progress=context.progress
            ),
            verdict=_response_verdict,
            describe=lambda results: describe_response(results.response),
            unavailable=_lacks("response"),
            needs=lambda case: ("modes",),
        ),
    ),
    describe=lambda case: describe_case(
        case, model=(describe_planar(case, planetary_set(case)),), warnings=set_warnings(case)
    ),
    warnings=set_warnings,
    result_warnings=_result_warnings,
    figures=_figures,
    remarks=remarks,
    cross_check=check_planar,
    notices=planar_notices,
)  # fmt: skip
