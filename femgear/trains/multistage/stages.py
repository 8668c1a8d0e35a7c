"""The pipeline of a multistage case: modes -> response, and balance.

Modes come with their kinds and the stage in which each one lives; the response is that to transmission errors
of every stage, by modal summation; harmonic balance has the stiffnesses k(t) of all meshes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from femgear.solvers.linear.modal import undamped_modes, viscous_damping
from femgear.solvers.linear.receptance import MeshErrorResponse, modal_error_response
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.stages.lumped_set import mixed_modes
from femgear.stages.protocol import FiguresOf, Progress, Stage, Train, one_blas_thread, silent
from femgear.system.force_laws import GearMeshes, TurningSprings, turning_wave
from femgear.system.fourier import FourierSeries, distinct_lines, harmonics_of, orders_of, sample, tooth_lines
from femgear.system.mesh_directions import gear_set_system, mesh_elements
from femgear.system.mode_kinds import class_energies, gear_set_motions, mixture, named_kinds
from femgear.system.system import MechanicalSystem, Modes, NonlinearSystem
from femgear.trains.multistage.case_file import (
    MultistageCase,
    StagesOperationSection,
    StagesResponseSection,
    multistage_of,
    stage_gears,
)
from femgear.trains.multistage.model import (
    MultistageSet,
    joined_motions,
    mean_mesh_stiffness,
    mesh_columns,
    multistage_system,
    stage_slices,
    train_speeds,
    train_torques,
    turning_couplings,
)
from femgear.trains.multistage.results import (
    BalanceResult,
    MultistageModes,
    StagesResponseResult,
    describe_forces,
    describe_multistage,
    describe_stage_modes,
    multistage_warnings,
)


def multistage_modes(data: MultistageSet, *, damping_ratio: float | Sequence[float] = 0.0) -> MultistageModes:
    """Solve for the modes of the train at rest with mean mesh stiffnesses, their kinds and stages.

    ``damping_ratio`` is that of all modes, or one a mode (m,).
    """
    system = multistage_system(data)
    modes = undamped_modes(system, mean_mesh_stiffness(data), damping_ratio=damping_ratio)
    # mass matrices of the stages in the coordinates of the train
    Z, parts = joined_motions(data), zip(data.stages, stage_slices(data))
    masses = np.array([Z[rows].T @ gear_set_system(stage.data).M @ Z[rows] for stage, rows in parts])
    modes = _by_stage(modes, masses)
    energy = (modes.shape * (masses @ modes.shape)).sum(axis=1)
    kinds = _multistage_kinds(data, modes.shape, frequency=modes.frequency)
    share, strain = energy / energy.sum(axis=0), _strain(data, system, modes)
    return MultistageModes(data, replace(modes, kind=kinds), share, strain)


def _multistage_kinds(data: MultistageSet, shape, *, frequency) -> tuple[str, ...]:
    """Kind of every mode (n, m): `femgear.system.mode_kinds.class_energies`, added over the stages."""
    full = joined_motions(data) @ np.asarray(shape)
    classes, total = 0.0, 0.0
    for stage, rows in zip(data.stages, stage_slices(data)):
        motions = gear_set_motions(stage.data, full[rows])
        classes = classes + class_energies(motions)
        total = total + motions.energy
    return named_kinds(classes / total, frequency)


def _by_stage(modes: Modes, masses: np.ndarray) -> Modes:
    """Modes of one frequency, mixed so that each belongs to one stage as far as it can.

    The mixture of ``sum_s s M_s`` parts stages that do not know of each other.
    """

    def weighted(group: np.ndarray) -> np.ndarray:
        shapes = modes.shape[:, group]
        return np.sum([number * shapes.T @ mass @ shapes for number, mass in enumerate(masses, 1)], axis=0)

    return mixed_modes(modes, mixture(modes.frequency, weighted))


def _strain(data: MultistageSet, system: MechanicalSystem, modes: Modes) -> np.ndarray:
    """Shares (S + 1, m) of the meshes of every stage, and of ``K``, in the strain energy."""
    meshes = modes.mesh_stiffness[:, None] * modes.mesh_deflection**2
    parts = [meshes[columns].sum(axis=0) for columns in mesh_columns(data)]
    parts.append(np.einsum("im,ij,jm->m", modes.shape, system.K, modes.shape))
    elastic = modes.frequency > 0.0
    total = np.where(elastic, sum(parts), 1.0)
    return np.where(elastic, np.array(parts) / total, 0.0)


def error_response(
    data: MultistageSet,
    speed,
    errors: Mapping[int, np.ndarray],
    *,
    damping_ratio: float = 0.0,
    modes: Modes | None = None,
) -> dict[int, MeshErrorResponse]:
    """Compute the response of the whole train to transmission errors of its stages, by modal summation.

    A mesh transmits ``k_j (W_j^T q - e_j)``, so that its error drives the train by ``W_j k_j e_j`` at the
    harmonics of its own stage's mesh frequency. The train is linear: the answers to the stages add up in
    time, each at its own frequencies. Modes at rest: carriers turn slowly against their meshes (once in z_r
    mesh periods where the ring is held), and what turning frames add is left to `multistage_problem`.

    Parameters
    ----------
    data : MultistageSet
        With teeth.
    speed : (F,) array
        Of the input [rad/s], not zero, of one sign.
    errors : mapping of int to (2N, H) complex array
        Of the stages named (from 1), harmonics 1 to H of every mesh [m], as of
        `femgear.system.fourier.tooth_lines` with the phases of the stage: ``e_j(tau) = e(tau +
        phi_j)`` (Parker and Lin, J. Mech. Des. 126, 2004).
    damping_ratio : float
        Of all modes; ignored where modes are given.
    modes : Modes, optional
        Of the train at rest, such as `MultistageModes.modes` with damping; all when not given.

    Returns
    -------
    dict of int to MeshErrorResponse
        By the stage that excites; deflection and force of all meshes of the train.
    """
    speed = np.atleast_1d(np.asarray(speed, float))
    if modes is None:
        modes = multistage_modes(data, damping_ratio=damping_ratio).modes
    unit, answers = train_speeds(data, math.copysign(1.0, speed[0])), {}
    for number, error in errors.items():
        hertz = np.abs(speed) * unit.mesh_frequency[number - 1]
        forward = unit.sun[number - 1] > unit.carrier[number - 1]
        every = np.zeros((data.n_meshes, np.shape(error)[1]), complex)
        # where the sun turns backwards the mesh runs through its period from the end
        every[mesh_columns(data)[number - 1]] = error if forward else np.conj(error)
        answer = modal_error_response(modes, hertz, every)
        answers[number] = replace(answer, deflection=answer.deflection[0], force=answer.force[0])
    return answers


def base_frequencies(data: MultistageSet, speed: float) -> np.ndarray:
    """Compute the base frequencies (n_bases,) [rad/s] of a train at a ``speed`` of its input [rad/s].

    Those of the meshes of every stage come first, then those of lateral couplings between frames that turn against
    one another.

    CaseError: what `train_speeds` and `turning_couplings` refuse.
    """
    mesh = 2.0 * np.pi * train_speeds(data, speed).mesh_frequency
    return np.concatenate([mesh, np.abs(list(turning_couplings(data, speed).values()))])


def multistage_problem(
    data: MultistageSet,
    *,
    meshes: Mapping[int, GearMeshes] | None = None,
    torque: float = 0.0,
    speed: float = 0.0,
    damping: float | np.ndarray | None = None,
) -> NonlinearSystem:
    """Assemble the train, meshes as elements, a base frequency a stage and pair of frames that turn apart.

    Parameters
    ----------
    meshes : mapping of int to GearMeshes, optional
        By stage (from 1), from `mesh_elements` of its set with orders ``(1,)`` of the stage's own mesh
        frequency; a stage that is not named has constant stiffnesses and meshes that part.
    torque : float
        On the input [N m], see `multistage_system`.
    speed : float
        Of the input [rad/s]: gyroscopic terms, lateral couplings that turn, and the sense in which meshes
        run through their period. Zero keeps all frames at rest, whatever the base frequencies that a solver
        is given, with suns that turn counter-clockwise against their carriers: the model of `error_response`.
    damping : float, (m,) array or (n, n) array, optional
        Damping ratio of all modes, or one a mode, at rest with mean mesh stiffnesses, each end of a
        turning coupling held by its spring; or the matrix ``C`` [N s/m].

    Returns
    -------
    NonlinearSystem
        Its base frequencies are those of `base_frequencies`, its lines those of
        `femgear.system.fourier.harmonic_lines` with as many bases, or any combination of their orders.

    Raises
    ------
    CaseError
        A load that accelerates the train (E-LOAD-BALANCE), as `multistage_system`.
    """
    turning = turning_couplings(data, speed)
    bases = len(data.stages) + len(turning)
    forward = np.ones(len(data.stages), bool)
    if speed:
        turns = train_speeds(data, speed)
        forward = turns.sun > turns.carrier
    elements = tuple(_stage_elements(data, meshes or {}, forward, bases))
    turned = tuple(_turning_elements(data, turning, bases))
    still = multistage_system(data, torque=torque)
    # refuses a load that nothing takes up before a solver drifts away with it
    undamped_modes(still, NonlinearSystem(still, elements).reference)
    system = multistage_system(data, torque=torque, speed=speed)
    problem = NonlinearSystem(system, elements + turned, speed=speed)
    if damping is None:
        return problem
    # frames at rest, without the lateral springs that turn: these are columns
    couplings = tuple(
        replace(coupling, lateral=0.0) if number in turning else coupling
        for number, coupling in enumerate(data.couplings)
    )
    standing = multistage_system(replace(data, couplings=couplings)).K
    centred = replace(system, K=standing, gyroscopic=None)
    return replace(problem, system=replace(system, C=viscous_damping(centred, problem.reference, damping)))


def _stage_elements(data: MultistageSet, meshes: Mapping[int, GearMeshes], forward, bases: int) -> Iterator[GearMeshes]:
    """The meshes of all stages on their columns, each with its own base frequency."""
    for number, (stage, columns) in enumerate(zip(data.stages, mesh_columns(data)), 1):
        made = meshes.get(number) or mesh_elements(stage.data)
        orders, series_of = orders_of(number - 1, bases, 1 if forward[number - 1] else -1), {}
        for name in ("stiffness", "deflection", "force"):
            series = getattr(made, name)
            series_of[name] = replace(series, orders=tuple(series.orders[0] * order for order in orders))
        yield replace(made, columns=columns, **series_of)


def _turning_elements(data: MultistageSet, turning: dict[int, float], bases: int) -> Iterator[TurningSprings]:
    """Lateral springs between frames that turn apart, each with its own base frequency."""
    for place, (number, relative) in enumerate(turning.items()):
        coupling = data.couplings[number]
        orders = orders_of(len(data.stages) + place, bases, 1 if relative > 0.0 else -1)
        phase = data.stages[coupling.second.stage - 1].angle - data.stages[coupling.first.stage - 1].angle
        first = data.n_meshes + 4 * place
        wave = turning_wave(orders, phase=phase)
        yield TurningSprings(np.arange(first, first + 4)[None], np.array([coupling.lateral]), wave)


def solve_multistage_modes(case: MultistageCase) -> MultistageModes:
    """Solve for natural frequencies, modes, their kinds and stages."""
    ratio = 0.0 if case.response is None else case.response.damping_ratio
    return multistage_modes(multistage_of(case), damping_ratio=ratio)


@one_blas_thread()
def solve_stages_response(case: MultistageCase, modes: MultistageModes) -> StagesResponseResult:
    """Solve for the response to errors that the changing number of tooth pairs makes under the torque."""
    _, given = _asked(case)
    speed = np.linspace(given.lowest, given.highest, given.points)
    errors = loaded_errors(case, modes.data)
    return StagesResponseResult(modes.data, speed, error_response(modes.data, speed, errors, modes=modes.modes))


@one_blas_thread()
def solve_balance(case: MultistageCase, *, progress: Progress = silent) -> BalanceResult:
    """Solve by harmonic balance with k(t) of all meshes, first orders of two stages together."""
    train, (operation, given) = multistage_of(case), _asked(case)
    stages, unit = len(train.stages), np.eye(len(train.stages), dtype=int)
    orders = [h * unit[n] for n in range(stages) for h in range(1, given.harmonics + 1)]
    orders += [unit[n] + sign * unit[m] for n in range(stages) for m in range(n) for sign in (-1, 1)]
    problem = multistage_problem(
        train, meshes=_wave_meshes(case, train), torque=operation.torque, damping=given.damping_ratio
    )
    speeds = np.linspace(given.lowest, given.highest, given.balance_points + 2)[1:-1]
    solutions = []
    for number, speed in enumerate(speeds):
        progress("balance", number, len(speeds))
        frequency = base_frequencies(train, speed)[:stages]
        solutions.append(solve_harmonic_balance(problem, frequency, orders=distinct_lines(orders), stability=False))
    force, converged = (
        np.array([solution.force for solution in solutions]),
        np.array([solution.converged for solution in solutions]),
    )
    return BalanceResult(train, speeds, solutions[0].orders, force, converged)


def _stiffness_waves(case: MultistageCase, number: int) -> tuple[np.ndarray, np.ndarray]:
    """Harmonics (H,) of sun-planet and planet-ring stiffness over its mean, at phase zero; stages from 1.

    Stiffness in proportion to the number of tooth pairs in contact: a pair is, from the start s to the end e
    of its path in base pitches from the pitch point, so that ``k_h / k_0 = (exp(-2 pi i h s) - exp(-2 pi i h
    e)) / (pi i h (e - s))``.
    """
    geared, h = stage_gears(case.stage[number - 1]), np.arange(1, _asked(case)[1].harmonics + 1)
    waves = []
    for path in (geared.path_sun_planet, geared.path_planet_ring):
        start, end = (end_of_path / geared.base_pitch for end_of_path in path)
        wave = np.exp(-2j * np.pi * h * start) - np.exp(-2j * np.pi * h * end)
        waves.append(wave / (1j * np.pi * h * (end - start)))
    return waves[0], waves[1]


def loaded_errors(case: MultistageCase, train: MultistageSet) -> dict[int, np.ndarray]:
    """Compute transmission errors (2N, H) [m] of every stage: its meshes deflect under their mean force.

    ``e = F / k(t)`` without its mean. It stands for the stiffness k(t) in linear models where the dynamic
    forces are small beside F.
    """
    errors = {}
    on_sun = train_torques(train, _asked(case)[0].torque).sun
    for number, stage in enumerate(train.stages, 1):
        data, waves = stage.data, _stiffness_waves(case, number)
        force = abs(on_sun[number - 1]) / (data.n_planets * data.sun_radius)
        first, second = (force / k * _inverse(wave) for k, wave in zip(data.mesh_stiffness[[0, -1]], waves))
        errors[number] = tooth_lines(first, second, stage.phases)
    return errors


def _inverse(wave: np.ndarray) -> np.ndarray:
    """Harmonics 1 to H of ``1 / (1 + wave)``."""
    samples = 32 * len(wave)
    return harmonics_of(1.0 / sample(np.concatenate([[1.0], wave]), samples), len(wave))[1:]


def _wave_meshes(case: MultistageCase, train: MultistageSet) -> dict[int, GearMeshes]:
    """Meshes with the stiffness waves, for `multistage_problem`; they do not part."""
    made = {}
    for number, stage in enumerate(train.stages, 1):
        mean = stage.data.mesh_stiffness
        lines = np.column_stack([np.ones(len(mean)), tooth_lines(*_stiffness_waves(case, number), stage.phases)])
        stiffness = FourierSeries(mean[:, None] * lines)
        made[number] = mesh_elements(stage.data, stiffness=stiffness, separates=False)
    return made


def _asked(case: MultistageCase) -> tuple[StagesOperationSection, StagesResponseSection]:
    """Operation and response of a case that has both, which `_no_response` sees to."""
    assert case.operation is not None and case.response is not None
    return case.operation, case.response


def _no_response(case: MultistageCase) -> str:
    if case.operation is None or case.response is None:
        return "it needs the sections operation and response"
    return "" if case.geared else "every stage needs its table gears"


def _no_balance(case: MultistageCase) -> str:
    return _no_response(case) or ("" if _asked(case)[1].balance_points else "response.balance_points is 0")


MULTISTAGE = Train(
    name="multistage",
    words="a multistage case",
    stages=(
        Stage(
            name="modes",
            title="Modes",
            solve=solve_multistage_modes,
            verdict=lambda result: {"modes": len(result.modes.frequency)},
            describe=lambda results: describe_stage_modes(results.modes),
        ),
        Stage(
            name="response",
            title="Response",
            solve=solve_stages_response,
            takes=("modes",),
            verdict=lambda result: {"speeds": len(result.speed)},
            describe=lambda results: describe_forces(results.response, "Response"),
            unavailable=_no_response,
        ),
        Stage(
            name="balance",
            title="Harmonic balance",
            solve=solve_balance,
            options=("progress",),
            verdict=lambda result: {"speeds": len(result.speed)},
            describe=lambda results: describe_forces(results.balance, "Harmonic balance"),
            unavailable=_no_balance,
            warnings=BalanceResult.warnings,
        ),
    ),
    describe=describe_multistage,
    warnings=multistage_warnings,
    figures=FiguresOf("femgear.trains.multistage.figures:FIGURES"),
)
