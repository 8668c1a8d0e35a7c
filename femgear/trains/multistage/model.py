"""Planetary stages in series as one mechanical system: data, speeds and torques, matrices.

The stages are lumped sets (`femgear.system.mesh_directions`), each in the frame of its own carrier; the
shafts between members are springs or rigid. One rotation is the same in all frames, so that torsional
couplings are exact at any speed. The centres of two members meet in the fixed frame: with ``z = x + i y`` in
frames at the angles psi the lateral spring sees ``z_1 exp(i psi_1) - z_2 exp(i psi_2)``. It is a constant
spring where both frames turn at one speed, or stand; otherwise its columns stay in ``W`` for the periodic
element `femgear.system.force_laws.TurningSprings`. D. R. Kiracofe and R. G. Parker (J. Vib. Acoust. 129,
2007, 1-16) couple stages with the same springs.

Speeds and torques follow from Willis' equation of every stage in one linear system: with the speeds ``w`` of
all central members, every stage, coupling, and fixed member is one row of ``A w = 0``. Ideal torques follow
from the same rows: those that the outside gives the members are ``A^T lambda`` (principle of virtual work),
so that speeds and torques balance in power by construction.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg import block_diag

from femgear.errors import CaseError
from femgear.gears.kinematics import planet_motion, torque_ratios
from femgear.system.mesh_directions import dof_names, free_motions, gear_set_system, mesh_directions
from femgear.system.rigid_bodies import (
    CENTRAL,
    PlanarSet,
    PlanarTorque,
    flank_sign,
    member_radius,
    torque_shares,
)
from femgear.system.system import MechanicalSystem

# radii of base circles may be rounded; tooth numbers that differ by more are another set
_RADII = 1e-3
# singular values below this share of the largest one count as none
_RANK = 1e-12

# difference of two carrier speeds, relative to the largest one, that is rounding
_SAME_SPEED = 1e-12
# entry of a rigid coupling, relative to its largest one, that is rounding
_ROUNDING = 1e-12


@dataclass(frozen=True, order=True)
class Member:
    """A central member of a ``stage``, counted from 1; its ``name`` is "carrier", "ring" or "sun"."""

    stage: int
    name: str

    def __str__(self) -> str:
        return f"stage {self.stage} {self.name}"

    @property
    def place(self) -> int:
        """Number among the central members of all stages, from 0."""
        return 3 * (self.stage - 1) + CENTRAL.index(self.name)


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanetaryStage:
    """One planetary set of the train.

    CaseError: tooth numbers that do not fit the base radii (E-TEETH), a fixed member that nothing holds
    (E-MECHANISM).

    Parameters
    ----------
    data : PlanarSet
        Rigid bodies, base radii, supports and mesh stiffnesses of the set.
    teeth : (3,) tuple of int, optional
        Of sun, planet and ring (positive); speeds and mesh frequencies need them.
    fixed : {"carrier", "ring", "sun"}, optional
        Member that the housing holds; None where all three turn.
    phases : (2N,) array, optional
        Mesh phases as fractions of the mesh period, as in `femgear.gears.planetary.PlanetarySet.mesh_phases`.
    angle : float
        Angle of the stage's x axis against the common frame at time zero [rad]; lateral couplings see it.
    """

    data: PlanarSet
    teeth: tuple[int, ...] | None = None
    fixed: str | None = "ring"
    phases: Sequence[float] | np.ndarray | None = None
    angle: float = 0.0

    def __post_init__(self):
        if self.fixed is not None and not getattr(self.data, self.fixed).torsional_support > 0.0:
            raise CaseError(
                f"the {self.fixed} is fixed but has no torsional support",
                code="E-MECHANISM",
                key=f"{self.fixed}.torsional_support",
                limit="above 0, or infinite",
            )
        if self.teeth is None:
            return
        data, (sun, planet, ring) = self.data, self.teeth
        for name, ratio, radii in (
            ("planet", planet / sun, data.planet_radius / data.sun_radius),
            ("ring", ring / sun, data.ring_radius / data.sun_radius),
        ):
            if abs(radii / ratio - 1.0) > _RADII:
                raise CaseError(
                    f"{name} and sun have {ratio:.6g} as ratio of teeth and {radii:.6g} as ratio of base radii",
                    code="E-TEETH",
                    key="teeth",
                    value=self.teeth,
                    limit="the same to 0.1 %",
                )


@dataclass(frozen=True)
class StageCoupling:
    """A shaft between two members.

    CaseError: members of one stage (E-RANGE).

    Parameters
    ----------
    first, second : Member
        Of different stages.
    torsional : float
        Stiffness against their relative rotation [N m/rad]; infinite makes one rotation of both. Not zero:
        what does not transmit torque is no coupling of speeds.
    lateral : float
        Isotropic stiffness between their centres [N/m]: two equal springs, without tilt. Infinite joins the
        centres, which only a train at rest can have, or members in frames of one speed.
    """

    first: Member
    second: Member
    torsional: float = math.inf
    lateral: float = 0.0

    def __post_init__(self):
        if self.first.stage == self.second.stage:
            raise CaseError(
                f"a coupling inside stage {self.first.stage}", code="E-RANGE", limit="members of two stages"
            )


@dataclass(frozen=True, kw_only=True, eq=False)
class MultistageSet:
    """Planetary stages and their couplings.

    CaseError: one member for input and output, or one that is fixed (E-MECHANISM).

    Parameters
    ----------
    stages : tuple of PlanetaryStage
        In the order of their numbers.
    couplings : tuple of StageCoupling
        `in_series` makes those of a plain train. None: stages side by side.
    input, output : Member
        Where the external torques act.
    """

    stages: tuple[PlanetaryStage, ...]
    couplings: tuple[StageCoupling, ...]
    input: Member
    output: Member

    def __post_init__(self):
        for member in (self.input, self.output):
            if self.input == self.output or self.stages[member.stage - 1].fixed == member.name:
                raise CaseError(
                    f"input {self.input} and output {self.output}",
                    code="E-MECHANISM",
                    limit="two members that turn",
                )

    @property
    def n_meshes(self) -> int:
        """Number of the meshes of all stages."""
        return sum(2 * stage.data.n_planets for stage in self.stages)


def in_series(stages: Sequence[PlanetaryStage], *, torsional: float = math.inf, lateral: float = 0.0) -> MultistageSet:
    """Join stages one after the other: each carrier turns the next sun.

    All couplings have the same torsional [N m/rad] and lateral [N/m] stiffness, see `StageCoupling`.
    """
    couplings = tuple(
        StageCoupling(Member(n, "carrier"), Member(n + 1, "sun"), torsional, lateral) for n in range(1, len(stages))
    )
    ends = {"input": Member(1, "sun"), "output": Member(len(stages), "carrier")}
    return MultistageSet(stages=tuple(stages), couplings=couplings, **ends)


@dataclass(frozen=True, eq=False)
class TrainSpeeds:
    """Speeds of S stages, all (S,) arrays.

    Absolute speeds of ``sun``, ``ring``, ``carrier`` and of each ``planet`` about its own axis [rad/s], and
    ``mesh_frequency`` [Hz].
    """

    sun: np.ndarray
    ring: np.ndarray
    carrier: np.ndarray
    planet: np.ndarray
    mesh_frequency: np.ndarray

    def of(self, member: Member) -> float:
        """Read the speed of a member [rad/s]."""
        return float(getattr(self, member.name)[member.stage - 1])


@dataclass(frozen=True, eq=False)
class TrainTorques:
    """Torques without losses [N m], positive counter-clockwise.

    What couplings, housing, input and output give ``sun``, ``ring`` and ``carrier``, (S,) arrays which add up to zero
    in every stage; ``output`` is that on the output member.
    """

    sun: np.ndarray
    ring: np.ndarray
    carrier: np.ndarray
    output: float


def train_speeds(data: MultistageSet, speed: float) -> TrainSpeeds:
    """Compute the speeds of all bodies from that of the input member [rad/s], with the teeth of every stage.

    ``z_s (w_s - w_c) = -z_r (w_r - w_c) = -z_p (w_p - w_c)`` in every stage (Willis).

    Parameters
    ----------
    data : MultistageSet
        The train.
    speed : float
        Of the input member [rad/s], positive counter-clockwise.

    Raises
    ------
    CaseError
        A stage without teeth (E-TEETH), members that are free or held twice (E-MECHANISM).
    """
    rows = np.vstack([_rows(data, _tooth_weights(data)), _unit(data, data.input)])
    right = np.zeros(len(rows))
    right[-1] = speed
    carrier, ring, sun = _solved(data, rows, right).reshape(-1, 3).T
    sun_teeth, planet_teeth, _ = np.array([stage.teeth for stage in data.stages], float).T
    planet, mesh_frequency = planet_motion(sun, carrier, sun_teeth, planet_teeth)
    return TrainSpeeds(sun, ring, carrier, planet, mesh_frequency)


def train_torques(data: MultistageSet, torque: float, *, radii: bool = False) -> TrainTorques:
    """Compute the torques on all members from that on the input, without losses.

    Parameters
    ----------
    data : MultistageSet
        The train.
    torque : float
        On the input member [N m], positive counter-clockwise.
    radii : bool
        Take the balance of the lumped sets, from base radii and pressure angles (`torque_shares`), instead of that
        of tooth numbers. Both agree where the radii close.

    Raises
    ------
    CaseError
        A stage without teeth (E-TEETH), members that are free or held twice (E-MECHANISM).
    """
    weights = _radius_weights(data) if radii else _tooth_weights(data)
    # unknown: lambda of every row, and the torque of the output
    matrix = np.vstack([_rows(data, weights), -_unit(data, data.output)]).T
    solution = _solved(data, matrix, torque * _unit(data, data.input))
    carrier, ring, sun = (solution[: len(data.stages), None] * weights).T
    return TrainTorques(sun, ring, carrier, float(solution[-1]))


def speed_ratio(data: MultistageSet) -> float:
    """Compute the speed of the input of a train over that of its output [1].

    CaseError: an output that stands (E-MECHANISM), and what `train_speeds` refuses.
    """
    output = train_speeds(data, 1.0).of(data.output)
    if abs(output) < 1e-12:
        message = f"the output, {data.output}, stands still"
        raise CaseError(message, code="E-MECHANISM", key="operation.output", remedy="name a member that turns")
    return 1.0 / output


def check_turns(data: MultistageSet) -> None:
    """Refuse loops of couplings and fixed members: trains that are locked, or held twice (E-MECHANISM)."""
    rows = _rows(data, _radius_weights(data))
    rank = np.linalg.matrix_rank(rows, tol=_RANK * np.linalg.norm(rows, 2))
    if rank < len(rows) or rank == rows.shape[1]:
        what = "cannot turn" if rank == rows.shape[1] else "is held twice in a loop"
        raise CaseError(
            f"the train {what}: {len(data.stages)} stages, {len(data.couplings)} couplings and "
            f"{sum(stage.fixed is not None for stage in data.stages)} fixed members",
            code="E-MECHANISM",
            limit="couplings and fixed members that close no loop",
            remedy="leave out a coupling, or hold one member less",
        )


def _rows(data: MultistageSet, weights: np.ndarray) -> np.ndarray:
    """Stages, couplings (first less second), and fixed members (rows, 3 S)."""
    couplings = [_unit(data, coupling.first) - _unit(data, coupling.second) for coupling in data.couplings]
    held = [
        _unit(data, Member(number, stage.fixed))
        for number, stage in enumerate(data.stages, 1)
        if stage.fixed is not None
    ]
    return np.vstack([np.asarray(block_diag(*weights)), *couplings, *held])


def _tooth_weights(data: MultistageSet) -> np.ndarray:
    """Weights (S, 3) of the speeds of carrier, ring and sun in Willis' equation of every stage."""
    weights = []
    for number, stage in enumerate(data.stages, 1):
        if stage.teeth is None:
            raise CaseError(
                f"no tooth numbers in stage {number}",
                code="E-TEETH",
                key=f"stages[{number - 1}].teeth",
                remedy="give the teeth of sun, planet and ring",
            )
        ratios = torque_ratios(stage.teeth[0], stage.teeth[2])
        weights.append([ratios[name] for name in CENTRAL])
    return np.array(weights)


def _radius_weights(data: MultistageSet) -> np.ndarray:
    """The same (S, 3) from the balance of forces on ``u`` of the lumped sets."""
    weights = []
    for stage in data.stages:
        shares = torque_shares(stage.data)
        weights.append([shares[name] * member_radius(stage.data, name) for name in CENTRAL])
    table = np.array(weights)
    return table / table[:, [CENTRAL.index("sun")]]


def _unit(data: MultistageSet, member: Member) -> np.ndarray:
    return np.eye(3 * len(data.stages))[member.place]


def _solved(data: MultistageSet, matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solution of a square system of full rank; refuses trains that are not determined."""
    rows, columns = matrix.shape
    size = np.linalg.svd(matrix, compute_uv=False)
    if rows != columns or size[-1] < _RANK * size[0]:
        fixed = sum(stage.fixed is not None for stage in data.stages)
        raise CaseError(
            f"{len(data.stages)} stages, {len(data.couplings)} couplings and {fixed} fixed members do not "
            "determine all speeds and torques",
            code="E-MECHANISM",
            limit="stages + couplings + fixed members + 1 = 3 x stages, none of them idle",
            remedy="hold one member of every stage of a plain train",
        )
    solution = np.linalg.solve(matrix, right)
    # one step of refinement: ratios of hundreds keep their last digits
    return solution + np.linalg.solve(matrix, right - matrix @ solution)


def multistage_system(data: MultistageSet, *, torque: float = 0.0, speed: float = 0.0) -> MechanicalSystem:
    """Assemble the matrices of the train; meshes and turning lateral couplings are columns of ``W`` alone.

    CaseError: a torque on a held member, a train that is not determined or locked (E-MECHANISM), centres
    joined rigidly between frames of different speeds (E-RANGE).

    Parameters
    ----------
    torque : float
        On the input [N m]; it reacts on the output and on the fixed members, and chooses the loaded flanks
        of every stage. Zero: flanks of suns that drive counter-clockwise.
    speed : float
        Of the input [rad/s], for gyroscopic matrices, centripetal stiffness and centrifugal load in every
        carrier frame, so that the rotation of the whole train stays free.

    Returns
    -------
    MechanicalSystem
        ``gyroscopic`` multiplies the speed of the input and is None for zero. Columns: the 2N meshes of
        every stage, then four for every coupling of `turning_couplings`, x and y of its first and of its
        second member. ``C`` is zero.
    """
    check_turns(data)
    turning = turning_couplings(data, speed)
    carrier = train_speeds(data, speed).carrier if speed else np.zeros(len(data.stages))
    parts = [gear_set_system(stage.data, carrier_speed=w) for stage, w in zip(data.stages, carrier.tolist())]
    motions, Z = _member_motions(data), joined_motions(data)
    K = block_diag(*(part.K for part in parts)) + _centrifugal_stiffness(data, carrier)
    for number, coupling in enumerate(data.couplings):
        columns, stiffness = _springs(data, motions, coupling, lateral=number not in turning)
        K += (columns * stiffness) @ columns.T
    # torques that load the flanks of every stage; without any those of suns that drive counter-clockwise
    on_sun = train_torques(data, torque, radii=True).sun if torque else np.ones(len(data.stages))
    flanks = [flank_sign(stage.data, PlanarTorque(float(t))) for stage, t in zip(data.stages, on_sun)]
    meshes = [
        free_motions(stage.data).T @ mesh_directions(stage.data, flank) for stage, flank in zip(data.stages, flanks)
    ]
    turned = [member for n in turning for member in (data.couplings[n].first, data.couplings[n].second)]
    ends = [motions[member][:2].T for member in turned]
    load = np.concatenate([part.load for part in parts]) + _torque_load(data, motions, torque)
    return MechanicalSystem(
        M=Z.T @ block_diag(*(part.M for part in parts)) @ Z,
        C=np.zeros((Z.shape[1], Z.shape[1])),
        K=Z.T @ K @ Z,
        W=Z.T @ np.hstack([np.asarray(block_diag(*meshes)), *ends]),
        load=Z.T @ load,
        dofs=_names(data, Z),
        gyroscopic=Z.T @ _gyroscopic(parts, carrier / speed) @ Z if speed else None,
    )


def mesh_columns(data: MultistageSet) -> tuple[np.ndarray, ...]:
    """Number the columns (2N,) of ``W`` with the meshes of every stage."""
    ends = np.cumsum([0] + [2 * stage.data.n_planets for stage in data.stages])
    return tuple(np.arange(first, last) for first, last in pairwise(ends))


def mean_mesh_stiffness(data: MultistageSet) -> np.ndarray:
    """List the mean stiffness (n_meshes,) of all meshes [N/m], in the order of `mesh_columns`."""
    return np.concatenate([stage.data.mesh_stiffness for stage in data.stages])


def turning_couplings(data: MultistageSet, speed: float) -> dict[int, float]:
    """Find the lateral couplings between frames that turn against one another, at an input's speed [rad/s].

    By the number of the coupling (from 0) the speed of the second frame less that of the first [rad/s].

    CaseError: centres joined rigidly between such frames (E-RANGE).
    """
    if not speed or not any(coupling.lateral for coupling in data.couplings):
        return {}
    carrier = train_speeds(data, speed).carrier
    turning = {}
    for number, coupling in enumerate(data.couplings):
        relative = carrier[coupling.second.stage - 1] - carrier[coupling.first.stage - 1]
        if not coupling.lateral or abs(relative) <= _SAME_SPEED * np.abs(carrier).max():
            continue
        if math.isinf(coupling.lateral):
            raise CaseError(
                f"the centres of {coupling.first} and {coupling.second} are one, in frames of different speeds",
                code="E-RANGE",
                key=f"couplings[{number}].lateral",
                limit="a finite stiffness",
                remedy="give the stiffness of the shaft",
            )
        turning[number] = float(relative)
    return turning


def joined_motions(data: MultistageSet) -> np.ndarray:
    """Compute coordinates of all stages (n_all, n) per unit of those that rigid couplings leave free.

    The rows are those of the `gear_set_system` of every stage, one after the other. Of two joined coordinates
    that of the earlier place stays.
    """
    motions = _member_motions(data)
    Z = np.eye(motions[data.input].shape[1])
    for coupling in data.couplings:
        rows = [_twist(motions, coupling)] if math.isinf(coupling.torsional) else []
        rows += list(_shift(data, motions, coupling).T) if math.isinf(coupling.lateral) else []
        for row in rows:
            row = row @ Z
            moved = np.flatnonzero(np.abs(row) > _ROUNDING * np.abs(row).max(initial=0.0))
            if not len(moved):
                continue
            # the last coordinate follows the others
            keep = np.delete(np.arange(Z.shape[1]), moved[-1])
            Z = Z[:, keep] - np.outer(Z[:, moved[-1]], row[keep] / row[moved[-1]])
    return Z


def stage_slices(data: MultistageSet) -> tuple[slice, ...]:
    """Find the rows of `joined_motions` that belong to every stage."""
    ends = np.cumsum([0] + [free_motions(stage.data).shape[1] for stage in data.stages])
    return tuple(slice(int(a), int(b)) for a, b in pairwise(ends))


def _stage_motions(data: MultistageSet) -> np.ndarray:
    """All coordinates of all stages, held ones included, per unit of those that are free in each stage."""
    return np.asarray(block_diag(*(free_motions(stage.data) for stage in data.stages)))


def _centrifugal_stiffness(data: MultistageSet, carrier: np.ndarray) -> np.ndarray:
    """What makes the centripetal stiffness of the planets leave the rotation of the train free.

    Lin and Parker take ``m Omega^2`` from all tangential motion eta of the planets, also where the set turns
    as a whole. The pins turn with the carrier: with the planet at ``(a + zeta + i (eta - u_c)) exp(i (Omega t
    + u_c / a))`` Lagrange's equations have the same gyroscopic terms, and the centripetal ones of zeta and
    ``eta - u_c``. The difference is ``m Omega^2 (eta^2 - (eta - u_c)^2)`` a planet.
    """
    blocks = []
    for stage, speed in zip(data.stages, carrier.tolist()):
        T, N = free_motions(stage.data), stage.data.n_planets
        tangential, turned = T[10 + 3 * np.arange(N)], T[2]
        apart = tangential - turned
        blocks.append(stage.data.planet.mass * speed**2 * (tangential.T @ tangential - apart.T @ apart))
    return np.asarray(block_diag(*blocks))


def _gyroscopic(parts: list[MechanicalSystem], ratio: np.ndarray) -> np.ndarray:
    """Matrix per unit of the input's speed; ``ratio`` (S,) of the carriers' speeds to it."""
    still = (np.zeros_like(part.M) if part.gyroscopic is None else part.gyroscopic for part in parts)
    return np.asarray(block_diag(*(factor * matrix for factor, matrix in zip(ratio, still))))


def _member_motions(data: MultistageSet) -> dict[Member, np.ndarray]:
    """x, y and rotation [rad] (3, n) of every member per coordinate of `_stage_motions`; zero where held."""
    T, motions, first = _stage_motions(data), {}, 0
    for number, stage in enumerate(data.stages, 1):
        for name in CENTRAL:
            motions[Member(number, name)] = T[first : first + 3].copy()
            motions[Member(number, name)][2] /= member_radius(stage.data, name)
            first += 3
        first += 3 * stage.data.n_planets
    return motions


def _twist(motions: dict[Member, np.ndarray], coupling: StageCoupling) -> np.ndarray:
    """Rotation of the first member less that of the second, per coordinate."""
    return motions[coupling.first][2] - motions[coupling.second][2]


def _shift(data: MultistageSet, motions: dict[Member, np.ndarray], coupling: StageCoupling) -> np.ndarray:
    """x and y (n, 2) of the first centre less the second, in the first frame, both as they stand."""
    turn = data.stages[coupling.second.stage - 1].angle - data.stages[coupling.first.stage - 1].angle
    c, s = math.cos(turn), math.sin(turn)
    return motions[coupling.first][:2].T - motions[coupling.second][:2].T @ np.array([[c, s], [-s, c]])


def _springs(data: MultistageSet, motions: dict[Member, np.ndarray], coupling: StageCoupling, *, lateral):
    """Columns (n, g) and stiffnesses (g,) of what is elastic in a coupling, `lateral` among it or not."""
    columns, stiffness = [np.empty((motions[coupling.first].shape[1], 0))], []
    if math.isfinite(coupling.torsional):
        columns.append(_twist(motions, coupling)[:, None])
        stiffness.append(coupling.torsional)
    if lateral and coupling.lateral and math.isfinite(coupling.lateral):
        columns.append(_shift(data, motions, coupling))
        stiffness += [coupling.lateral] * 2
    return np.hstack(columns), np.array(stiffness)


def _torque_load(data: MultistageSet, motions: dict[Member, np.ndarray], torque: float) -> np.ndarray:
    """Forces on ``u`` of input and output."""
    load = np.zeros(motions[data.input].shape[1])
    if not torque:
        return load
    output = train_torques(data, torque, radii=True).output
    for member, value in ((data.input, torque), (data.output, output)):
        rotation = motions[member][2]
        if not np.any(rotation):
            raise CaseError(
                f"the torque acts on the {member}, which is held",
                code="E-MECHANISM",
                remedy="choose members that can turn",
            )
        load += rotation * value
    return load


def _names(data: MultistageSet, Z: np.ndarray) -> tuple[str, ...]:
    """Name of every coordinate that is left: its own row of ``Z`` is a unit row."""
    names = [f"stage {n} {name}" for n, stage in enumerate(data.stages, 1) for name in dof_names(stage.data)]
    largest = np.argmax(_stage_motions(data) == 1.0, axis=0)
    return tuple(names[largest[row]] for row in np.argmax(Z == 1.0, axis=0))
