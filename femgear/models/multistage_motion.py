"""Speeds and torques of planetary stages in series: Willis for every stage, one linear system for the train.

With the speeds ``w`` of all central members, every stage, coupling, and fixed member is one row of ``A w =
0``. Ideal torques follow from the same rows: those that the outside gives the members are ``A^T lambda``
(principle of virtual work), so that speeds and torques balance in power by construction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError
from femgear.models.multistage_data import Member, MultistageSet
from femgear.models.planar_data import CENTRAL, member_radius, torque_shares

# singular values below this share of the largest one count as none
_RANK = 1e-12


@dataclass(frozen=True, eq=False)
class TrainSpeeds:
    """Absolute speeds [rad/s] and mesh frequencies [Hz], one a stage.

    Parameters
    ----------
    sun, ring, carrier, planet : (S,) arrays
        The planet's about its own axis, in the fixed frame.
    mesh_frequency : (S,) array
    """

    sun: np.ndarray
    ring: np.ndarray
    carrier: np.ndarray
    planet: np.ndarray
    mesh_frequency: np.ndarray

    def of(self, member: Member) -> float:
        """Speed of a member [rad/s]."""
        return float(getattr(self, member.name)[member.stage - 1])


@dataclass(frozen=True, eq=False)
class TrainTorques:
    """Torques without losses [N m], positive counter-clockwise.

    Parameters
    ----------
    sun, ring, carrier : (S,) arrays
        What couplings, housing, input and output give the members; they add up to zero in every stage.
    coupling : (C,) array
        On the second member of every coupling, its reaction on the first.
    housing : (S,) array
        On the fixed member of every stage; zero where there is none.
    output : float
        On the output member.
    """

    sun: np.ndarray
    ring: np.ndarray
    carrier: np.ndarray
    coupling: np.ndarray
    housing: np.ndarray
    output: float


def train_speeds(data: MultistageSet, speed: float) -> TrainSpeeds:
    """Speeds of all bodies from that of the input member.

    Parameters
    ----------
    data : MultistageSet
        With the teeth of every stage.
    speed : float
        Of the input [rad/s].

    Returns
    -------
    TrainSpeeds
        ``z_s (w_s - w_c) = -z_r (w_r - w_c) = -z_p (w_p - w_c)`` in every stage (Willis).

    Raises
    ------
    CaseError
        A stage without teeth (E-TEETH), members that are free or held twice (E-MECHANISM), a speed that is
        not finite (E-VALUE).
    """
    _check_finite("speed", speed, "rad/s")
    weights = _tooth_weights(data)
    rows = np.vstack([_rows(data, weights), _unit(data, data.input)])
    right = np.zeros(len(rows))
    right[-1] = speed
    w = _solved(data, rows, right).reshape(-1, 3)
    carrier, ring, sun = (w[:, CENTRAL.index(name)] for name in ("carrier", "ring", "sun"))
    teeth = np.array([stage.teeth for stage in data.stages], float)
    relative = sun - carrier
    return TrainSpeeds(
        sun=sun,
        ring=ring,
        carrier=carrier,
        planet=carrier - relative * teeth[:, 0] / teeth[:, 1],
        mesh_frequency=np.abs(relative) * teeth[:, 0] / (2.0 * math.pi),
    )


def train_torques(data: MultistageSet, torque: float, *, radii: bool = False) -> TrainTorques:
    """Torques on all members from that on the input, without losses.

    Parameters
    ----------
    data : MultistageSet
    torque : float
        On the input [N m].
    radii : bool
        Balance of the lumped sets, from base radii and pressure angles (see `torque_shares`), instead of
        tooth numbers. Both agree where the radii close.

    Raises
    ------
    CaseError
        As `train_speeds`.
    """
    _check_finite("torque", torque, "N m")
    weights = _radius_weights(data) if radii else _tooth_weights(data)
    rows = _rows(data, weights)
    # unknown: lambda of every row, and the torque of the output
    matrix = np.vstack([rows, -_unit(data, data.output)]).T
    right = torque * _unit(data, data.input)
    solution = _solved(data, matrix, right)
    count, stages = len(data.couplings), len(data.stages)
    on_stage = (solution[:stages, None] * weights).T
    housing = np.zeros(stages)
    held = [n for n, stage in enumerate(data.stages) if stage.fixed is not None]
    housing[held] = -solution[stages + count : -1]
    carrier, ring, sun = on_stage
    return TrainTorques(
        sun=sun,
        ring=ring,
        carrier=carrier,
        coupling=solution[stages : stages + count],
        housing=housing,
        output=float(solution[-1]),
    )


def speed_ratio(data: MultistageSet) -> float:
    """Speed of the input over that of the output.

    Raises
    ------
    CaseError
        As `train_speeds`, and an output that stands (E-MECHANISM).
    """
    output = train_speeds(data, 1.0).of(data.output)
    if abs(output) < 1e-12:
        raise CaseError(f"the output, {data.output}, stands still", code="E-MECHANISM")
    return 1.0 / output


def check_turns(data: MultistageSet) -> None:
    """Refuse loops of couplings and fixed members: trains that are locked, or held twice.

    Raises
    ------
    CaseError
        E-MECHANISM.
    """
    rows = _rows(data, _radius_weights(data))
    rank = np.linalg.matrix_rank(rows, tol=_RANK * np.linalg.norm(rows, 2))
    if rank < len(rows) or rank == rows.shape[1]:
        what = "cannot turn" if rank == rows.shape[1] else "is held twice in a loop"
        raise CaseError(
            f"the train {what}: {len(data.stages)} stages, {len(data.couplings)} couplings and "
            f"{sum(stage.fixed is not None for stage in data.stages)} fixed members", code="E-MECHANISM",
            limit="couplings and fixed members that close no loop",
            remedy="leave out a coupling, or hold one member less",
        )  # fmt: skip


def _rows(data: MultistageSet, weights: np.ndarray) -> np.ndarray:
    """Stages, couplings (first less second), and fixed members (rows, 3 S)."""
    rows = np.zeros((len(data.stages), 3 * len(data.stages)))
    for n, weight in enumerate(weights):
        rows[n, 3 * n : 3 * n + 3] = weight
    couplings = [_unit(data, one.first) - _unit(data, one.second) for one in data.couplings]
    held = [
        _unit(data, Member(n + 1, stage.fixed))
        for n, stage in enumerate(data.stages)
        if stage.fixed is not None
    ]
    return np.vstack([rows, *couplings, *held])


def _tooth_weights(data: MultistageSet) -> np.ndarray:
    """Carrier, ring and sun (S, 3) of ``z_s w_s + z_r w_r - (z_s + z_r) w_c = 0``, per tooth of the sun."""
    missing = [n + 1 for n, stage in enumerate(data.stages) if stage.teeth is None]
    if missing:
        raise CaseError(
            f"no tooth numbers in stage {missing[0]}", code="E-TEETH", key=f"stages[{missing[0] - 1}].teeth",
            remedy="give the teeth of sun, planet and ring",
        )  # fmt: skip
    return np.array(
        [(-(1.0 + ring / sun), ring / sun, 1.0) for sun, _, ring in (s.teeth for s in data.stages)]
    )


def _radius_weights(data: MultistageSet) -> np.ndarray:
    """The same (S, 3) from the balance of forces on ``u`` of the lumped sets."""
    weights = []
    for stage in data.stages:
        shares = torque_shares(stage.data)
        weights.append([shares[name] * member_radius(stage.data, name) for name in CENTRAL])
    table = np.array(weights)
    return table / table[:, [CENTRAL.index("sun")]]


def _unit(data: MultistageSet, member: Member) -> np.ndarray:
    unit = np.zeros(3 * len(data.stages))
    unit[3 * (member.stage - 1) + CENTRAL.index(member.name)] = 1.0
    return unit


def _solved(data: MultistageSet, matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solution of a square system of full rank; refuses trains that are not determined."""
    rows, columns = matrix.shape
    size = np.linalg.svd(matrix, compute_uv=False)
    if rows != columns or size[-1] < _RANK * size[0]:
        fixed = sum(stage.fixed is not None for stage in data.stages)
        raise CaseError(
            f"{len(data.stages)} stages, {len(data.couplings)} couplings and {fixed} fixed members do not "
            "determine all speeds and torques", code="E-MECHANISM",
            limit="stages + couplings + fixed members + 1 = 3 x stages, none of them idle",
            remedy="hold one member of every stage of a plain train",
        )  # fmt: skip
    solution = np.linalg.solve(matrix, right)
    # one step of refinement: ratios of hundreds keep their last digits
    return solution + np.linalg.solve(matrix, right - matrix @ solution)


def _check_finite(name: str, value: float, unit: str) -> None:
    if not math.isfinite(value):
        raise CaseError(f"a {name} of {value} {unit}", code="E-VALUE", key=name, limit="finite")
