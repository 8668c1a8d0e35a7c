"""Modes and response of planetary stages in series.

Modes come with their kinds and the stage in which each one lives; the response is that to transmission errors
of every stage, by modal summation, or that of the nonlinear train. No case file describes such a train: there
is no table of stages, and the functions are called from Python.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from femgear.errors import CaseError, checked_numbers
from femgear.solvers.linear.modal import solve_modes, viscous_damping
from femgear.solvers.linear.receptance import MeshErrorResponse, modal_response
from femgear.system.assembler import gear_set_system, mesh_elements
from femgear.system.elements import GearMeshes
from femgear.system.mode_kinds import class_energies, gear_set_motions, named_kinds
from femgear.system.system import MechanicalSystem, Modes, NonlinearSystem
from femgear.trains.multistage.model import (
    MultistageSet,
    Stage,
    TurningSprings,
    joined_motions,
    mean_mesh_stiffness,
    mesh_columns,
    multistage_system,
    stage_slices,
    train_speeds,
    turning_couplings,
    turning_wave,
)

# relative distance of frequencies that count as one
_MULTIPLE = 1e-7


@dataclass(frozen=True, eq=False)
class MultistageModes:
    """Modes of the whole train.

    Parameters
    ----------
    modes : Modes
        ``kind``: ``rigid``; ``rotational``, ``translational`` or ``planet`` where at least 99 % of the
        kinetic energy belongs to that class in all stages together; else ``mixed``. With equally spaced
        planets every mode is pure: rotational and translational modes reach over all stages, a planet mode
        stays in one (Kiracofe and Parker, J. Vib. Acoust. 129, 2007).
    share : (S, m) array
        Of every stage in the kinetic energy.
    strain : (S + 1, m) array
        Of every stage's meshes in the strain energy, and of everything else (supports, bearings, couplings)
        in the last row; zero for rigid motions.
    """

    modes: Modes
    share: np.ndarray
    strain: np.ndarray

    @property
    def stage(self) -> np.ndarray:
        """Stage (m,) with most of the kinetic energy, from 1."""
        return self.share.argmax(axis=0) + 1

    @property
    def labels(self) -> tuple[str, ...]:
        """Such as ``"planet, stage 2 (100 %)"``."""
        return tuple(
            f"{kind}, stage {stage} ({100.0 * share[stage - 1]:.0f} %)"
            for kind, stage, share in zip(self.modes.kind, self.stage.tolist(), self.share.T)
        )


def multistage_modes(
    data: MultistageSet, *, mesh_stiffness=None, damping_ratio: float | Sequence[float] = 0.0
) -> MultistageModes:
    """Modes of the train at rest, with their kinds and stages.

    Parameters
    ----------
    data : MultistageSet
    mesh_stiffness : (n_meshes,) array, optional
        Of all stages [N/m]; that of the sets when not given.
    damping_ratio : float or (m,) array
    """
    k = mean_mesh_stiffness(data)
    if mesh_stiffness is not None:
        k = checked_numbers(mesh_stiffness, "mesh_stiffness", code="E-SHAPE", unit="N/m")
    if k.shape != (data.n_meshes,) or not np.all(np.isfinite(k)):
        raise CaseError(
            f"mesh stiffnesses of shape {k.shape}", code="E-SHAPE", key="mesh_stiffness",
            limit=f"{data.n_meshes} finite numbers, one a mesh",
        )  # fmt: skip
    system = multistage_system(data)
    modes = solve_modes(system, k, damping_ratio=damping_ratio)
    masses = stage_masses(data)
    modes = _by_stage(modes, masses)
    share = stage_shares(masses, modes.shape)
    kinds = multistage_kinds(data, modes.shape, frequency=modes.frequency)
    return MultistageModes(replace(modes, kind=kinds), share, _strain(data, system, modes))


def stage_masses(data: MultistageSet) -> np.ndarray:
    """Mass matrix of every stage in the coordinates of the train, (S, n, n)."""
    Z = joined_motions(data)
    return np.array(
        [
            Z[rows].T @ gear_set_system(stage.data).M @ Z[rows]
            for stage, rows in zip(data.stages, stage_slices(data))
        ]
    )


def stage_shares(masses, shape) -> np.ndarray:
    """Share (S, m) of every stage in the kinetic energy of shapes (n, m), real or complex.

    ``masses`` (S, n, n) as from `stage_masses`.
    """
    shape = np.asarray(shape)
    energy = (shape.conj() * (np.asarray(masses) @ shape)).sum(axis=1).real
    return energy / energy.sum(axis=0)


def multistage_kinds(data: MultistageSet, shape, *, frequency) -> tuple[str, ...]:
    """Kind of every mode from its shape (n, m) in the coordinates of `multistage_system`.

    The classes of `femgear.system.mode_kinds.class_energies`, added over the stages.

    Parameters
    ----------
    data : MultistageSet
    shape : (n, m) array
    frequency : (m,) array
        Zero for rigid motions.
    """
    full = joined_motions(data) @ np.asarray(shape)
    classes, total = 0.0, 0.0
    for stage, rows in zip(data.stages, stage_slices(data)):
        motions = gear_set_motions(stage.data, full[rows])
        central = np.einsum("ba,bam->m", motions.central_mass, np.abs(motions.central) ** 2)
        classes = classes + class_energies(motions)
        total = total + central + (np.abs(motions.weighted) ** 2).sum(axis=(0, 1))
    return named_kinds(classes / total, frequency)


def _by_stage(modes: Modes, masses: np.ndarray) -> Modes:
    """Modes of one frequency, mixed so that each belongs to one stage as far as it can.

    Within a frequency the shapes may be mixed at will. The orthogonal mixture that diagonalises ``sum_s s
    M_s`` parts stages that do not know of each other.
    """
    size, shape = len(modes.frequency), modes.shape
    Q = np.eye(size)
    apart = np.diff(modes.frequency) > _MULTIPLE * modes.frequency[1:]
    for group in np.split(np.arange(size), np.flatnonzero(apart) + 1):
        if len(group) > 1:
            own = shape[:, group]
            weighted = sum(number * own.T @ mass @ own for number, mass in enumerate(masses, 1))
            Q[np.ix_(group, group)] = np.linalg.eigh(weighted)[1]
    return replace(
        modes, shape=shape @ Q, mesh_deflection=modes.mesh_deflection @ Q,
        modal_load=None if modes.modal_load is None else modes.modal_load @ Q,
    )  # fmt: skip


def _strain(data: MultistageSet, system: MechanicalSystem, modes: Modes) -> np.ndarray:
    """Shares (S + 1, m) of the meshes of every stage, and of ``K``, in the strain energy."""
    meshes = modes.mesh_stiffness[:, None] * modes.mesh_deflection**2
    parts = [meshes[columns].sum(axis=0) for columns in mesh_columns(data)]
    parts.append(np.einsum("im,ij,jm->m", modes.shape, system.K, modes.shape))
    elastic = modes.frequency > 0.0
    total = np.where(elastic, sum(parts), 1.0)
    return np.where(elastic, np.array(parts) / total, 0.0)


def stage_error(stage: Stage, sun_planet, planet_ring) -> np.ndarray:
    """Transmission errors (2N, H) of all meshes of a stage from one wave of each kind and the mesh phases.

    Parameters
    ----------
    stage : Stage
        With phases phi_j.
    sun_planet, planet_ring : (H,) complex arrays
        Harmonics 1 to H at phase zero [m]; ``e_j(tau) = e(tau + phi_j)`` (Parker and Lin, J. Mech. Des. 126,
        2004).

    Raises
    ------
    CaseError
        A stage without phases (E-PHASES), waves of different length (E-SHAPE).
    """
    if stage.phases is None:
        raise CaseError(
            "the stage has no mesh phases", code="E-PHASES", key="phases",
            remedy="give phases, or make the stage with stage_of_set",
        )  # fmt: skip
    waves = np.array([np.atleast_1d(one) for one in (sun_planet, planet_ring)], complex)
    h = np.arange(1, waves.shape[1] + 1)
    shift = np.exp(2j * np.pi * np.asarray(stage.phases)[:, None] * h)
    return np.repeat(waves, stage.data.n_planets, axis=0) * shift


def error_response(
    data: MultistageSet,
    speed,
    errors: Mapping[int, np.ndarray],
    *,
    damping_ratio: float = 0.0,
    modes: Modes | None = None,
    outputs=None,
) -> dict[int, MeshErrorResponse]:
    """Response of the whole train to transmission errors of its stages, by modal summation.

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
        Of the stages named (from 1), harmonics 1 to H of every mesh [m]: `stage_error`.
    damping_ratio : float
        Of all modes; ignored where modes are given.
    modes : Modes, optional
        Of the train at rest, such as `MultistageModes.modes` with damping; all when not given.
    outputs : (n_outputs, n) array, optional

    Returns
    -------
    dict of int to MeshErrorResponse
        By the stage that excites; deflection and force of all meshes of the train.

    Raises
    ------
    CaseError
        Stages that are not there, errors that do not fit (E-SHAPE), as `train_speeds`.
    """
    speed = np.atleast_1d(np.asarray(speed, float))
    system, k = multistage_system(data), mean_mesh_stiffness(data)
    if modes is None:
        modes = multistage_modes(data, damping_ratio=damping_ratio).modes
    frequencies, forward = _mesh_frequencies(data, speed)
    rows = np.empty((0, len(system.M))) if outputs is None else np.atleast_2d(np.asarray(outputs, float))
    seen, found = np.vstack([system.W.T, rows]), {}
    for number, columns in enumerate(mesh_columns(data), 1):
        if number not in errors:
            continue
        error = _checked_error(errors[number], number, len(columns))
        # where the sun turns backwards the mesh runs through its period from the end
        error = error if forward[number - 1] else error.conj()
        found[number] = _stage_response(system, modes, frequencies[:, number - 1], columns, error, k, seen)
    if unknown := set(errors) - set(found):
        raise CaseError(
            f"transmission errors of stage {sorted(unknown)[0]}", code="E-SHAPE", key="errors",
            limit=f"stages 1 to {len(data.stages)}",
        )  # fmt: skip
    return found


def _checked_error(error, number: int, meshes: int) -> np.ndarray:
    """Transmission errors (meshes, H) of a stage."""
    error = np.asarray(error, complex)
    if error.ndim != 2 or len(error) != meshes or not np.all(np.isfinite(error)):
        raise CaseError(
            f"transmission errors of shape {error.shape} in stage {number}", code="E-SHAPE",
            key=f"errors[{number}]", limit=f"({meshes}, harmonics), finite",
        )  # fmt: skip
    return error


def base_frequencies(data: MultistageSet, speed: float) -> np.ndarray:
    """Base frequencies of `multistage_problem` [rad/s]: meshes of every stage, frames that turn apart."""
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
    """The train with its meshes as elements: a base frequency a stage, and a pair of frames that turn apart.

    Parameters
    ----------
    data : MultistageSet
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
        turning coupling held by its spring; or the matrix ``C``.

    Returns
    -------
    NonlinearSystem
        Its base frequencies are those of `base_frequencies`, its lines those of
        `femgear.system.fourier.harmonic_lines` with as many bases, or any combination of their orders.

    Raises
    ------
    CaseError
        A load that accelerates the train (E-LOAD-BALANCE), meshes of stages or columns that are not there
        (E-SHAPE), as `multistage_system`.
    """
    turning = turning_couplings(data, speed)
    bases = len(data.stages) + len(turning)
    forward = np.ones(len(data.stages), bool)
    if speed:
        turns = train_speeds(data, speed)
        forward = turns.sun > turns.carrier
    elements = _stage_elements(data, dict(meshes or {}), forward, bases)
    turned = _turning_elements(data, turning, bases)
    still = multistage_system(data, torque=torque)
    # refuses a load that nothing takes up before a solver drifts away with it
    solve_modes(still, NonlinearSystem(still, elements).reference)
    system = multistage_system(data, torque=torque, speed=speed)
    problem = NonlinearSystem(system, elements + turned, speed=speed)
    if damping is None:
        return problem
    # standing frames with the columns of the turning ones
    centred = replace(system, K=_standing(data, turning), gyroscopic=None)
    return replace(problem, system=replace(system, C=viscous_damping(centred, problem.reference, damping)))


def _standing(data: MultistageSet, turning) -> np.ndarray:
    """``K`` without centripetal terms and without the lateral couplings that turn."""
    couplings = tuple(
        replace(one, lateral=0.0) if number in turning else one for number, one in enumerate(data.couplings)
    )
    return multistage_system(replace(data, couplings=couplings)).K


def _stage_response(system, modes, mesh_frequency, columns, error, k, seen) -> MeshErrorResponse:
    harmonics = np.arange(1, error.shape[1] + 1)
    inputs = system.W[:, columns] * k[columns]
    transfer = modal_response(system, modes, np.outer(mesh_frequency, harmonics).ravel(), inputs, seen)
    transfer = transfer.reshape(len(mesh_frequency), len(harmonics), len(seen), len(columns))
    answer = np.einsum("fhoj,jh->fho", transfer, error)
    deflection, force = answer[..., : len(k)], np.empty((*answer.shape[:2], len(k)), complex)
    force[:] = k * deflection
    force[..., columns] -= k[columns] * error.T
    return MeshErrorResponse(mesh_frequency, harmonics, deflection, force, answer[..., len(k) :])


def _mesh_frequencies(data: MultistageSet, speed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(F, S) [Hz], proportional to the speed, and whether suns turn forwards against their carriers (S,)."""
    if speed.ndim != 1 or not np.all(np.isfinite(speed)) or np.any(speed == 0.0):
        raise CaseError(
            "speeds of the input must be finite and not zero", code="E-VALUE", key="speed", limit="rad/s"
        )
    if speed.min() < 0.0 < speed.max():
        raise CaseError("speeds of both signs", code="E-VALUE", key="speed", limit="one sense of rotation")
    unit = train_speeds(data, math.copysign(1.0, speed[0]))
    return np.abs(speed)[:, None] * unit.mesh_frequency, unit.sun > unit.carrier


def _stage_elements(data: MultistageSet, meshes: dict[int, GearMeshes], forward, bases: int):
    """The meshes of all stages on their columns, each with its own base frequency."""
    elements = []
    for number, (stage, columns) in enumerate(zip(data.stages, mesh_columns(data)), 1):
        made = meshes.pop(number, None) or mesh_elements(stage.data)
        if not np.array_equal(made.columns[:, 0], np.arange(len(columns))):
            raise CaseError(
                f"meshes of stage {number} on columns {made.columns[:, 0].tolist()}", code="E-SHAPE",
                key=f"meshes[{number}]", limit=f"columns 0 to {len(columns) - 1} in order",
                remedy="make them with mesh_elements of the stage's set",
            )  # fmt: skip
        sense = 1 if forward[number - 1] else -1
        own = {name: _on_base(getattr(made, name), number - 1, bases, sense)
               for name in ("stiffness", "deflection", "force")}  # fmt: skip
        elements.append(replace(made, columns=columns, **own))
    if meshes:
        raise CaseError(
            f"meshes of stage {sorted(meshes)[0]}", code="E-SHAPE", key="meshes",
            limit=f"stages 1 to {len(data.stages)}",
        )  # fmt: skip
    return tuple(elements)


def _on_base(series, base: int, bases: int, sense: int):
    """The series with its single order moved to a base."""
    if any(series.orders[1:]):
        raise CaseError(
            f"a mesh series of orders {series.orders}", code="E-ORDERS", key="meshes",
            limit="multiples of the stage's own mesh frequency, such as (1,)",
        )  # fmt: skip
    orders = [0] * bases
    orders[base] = sense * series.orders[0]
    return replace(series, orders=tuple(orders))


def _turning_elements(data: MultistageSet, turning: dict[int, float], bases: int):
    elements = []
    for place, (number, relative) in enumerate(turning.items()):
        one = data.couplings[number]
        orders = [0] * bases
        orders[len(data.stages) + place] = 1 if relative > 0.0 else -1
        phase = data.stages[one.second.stage - 1].angle - data.stages[one.first.stage - 1].angle
        first = data.n_meshes + 4 * place
        wave = turning_wave(tuple(orders), phase=phase)
        elements.append(TurningSprings(np.arange(first, first + 4)[None], [one.lateral], wave))
    return tuple(elements)
