"""Torques of a graph of shafts and gear stages with the losses of their meshes and of bearings.

Speeds are those without losses (`femgear.gears.power_flow`). A mesh passes on ``eta = 1 - mu H_V`` of the power that
rolls through it in the frame of its carrier. Where the first gear of a stage drives in that frame, the torque of its
last gear is that without losses times the product eta_0 of its meshes, where it is driven, divided by it; the carrier
takes the rest, the casing where there is none. Friction torques act between two shafts against their relative motion.

With the ring held and the sun driving that is ``eta = (1 + i_0 eta_0) / (1 + i_0)`` with ``i_0 = z_r / z_s``, and
``1 / eta = (1 + i_0 / eta_0) / (1 + i_0)`` where the carrier drives (J. Müller, Die Umlaufgetriebe, 1998).

Which way power rolls follows from the torques, and these from that: both are found in turn. Loads, coefficients of
friction and loss factors are those without losses: 1 % of torque changes mu by 0.2 %.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from femgear.errors import ConvergenceError
from femgear.gears.shaft_graph import ShaftGraph, SpeedCondition

_ROUNDS = 20
_IDLE = 1e-12
"""Power of a stage over the largest one of any that is rounding."""
BALANCED = 1e-9
"""Power that balances may miss, over the largest one."""


@dataclass(frozen=True)
class FrictionTorque:
    """A torque between two shafts, one of which may be the casing (None), against their relative motion.

    Parameters
    ----------
    name : str
        Of the bearing.
    shafts : tuple of str or None
        Of its rings.
    torque : float
        [N m]
    """

    name: str
    shafts: tuple[str | None, str | None]
    torque: float


@dataclass(frozen=True)
class LossyFlow:
    """Torques and powers of a graph with losses.

    Parameters
    ----------
    torque : mapping
        External torque by shaft [N m], reactions of held shafts and of outputs among them.
    stage_torque : mapping
        By stage and shaft: what the stage puts on the shaft [N m].
    rolling_power : mapping
        By stage: power that enters its teeth in the frame of the carrier [W].
    mesh_loss : mapping
        By stage: losses of its meshes, from the first gear to the last [W].
    friction_loss : mapping
        By friction torque [W].
    first_drives : mapping
        By stage: whether the first gear drives in the frame of the carrier; None where nothing rolls.
    input_power, output_power : float
        External power that enters and that leaves [W], both positive.
    """

    torque: Mapping[str, float]
    stage_torque: Mapping[str, Mapping[str, float]]
    rolling_power: Mapping[str, float]
    mesh_loss: Mapping[str, tuple[float, ...]]
    friction_loss: Mapping[str, float]
    first_drives: Mapping[str, bool | None]
    input_power: float
    output_power: float

    @property
    def loss(self) -> float:
        """All losses [W]."""
        return math.fsum((*(value for of_stage in self.mesh_loss.values() for value in of_stage),)) + math.fsum(
            self.friction_loss.values()
        )

    @property
    def efficiency(self) -> float:
        """Power that leaves over power that enters; NaN where none enters."""
        return self.output_power / self.input_power if self.input_power > 0.0 else math.nan

    @property
    def imbalance(self) -> float:
        """Power that enters less output and losses, over what enters [1]."""
        missing = self.input_power - self.output_power - self.loss
        return missing / self.input_power if self.input_power > 0.0 else missing


def basic_efficiency(mesh_efficiencies: Sequence[float]) -> float:
    """Compute eta_0 of a stage with its carrier held: the product of its meshes."""
    return math.prod(mesh_efficiencies)


def planetary_efficiency(basic: float, ratio: float, *, sun_drives: bool = True) -> float:
    """Compute the efficiency of a planetary set with the ring held, from eta_0 and ``i_0 = z_r / z_s``.

    ``(1 + i_0 eta_0) / (1 + i_0)``, and ``(1 + i_0) / (1 + i_0 / eta_0)`` where the carrier drives.
    """
    return (1.0 + ratio * basic) / (1.0 + ratio) if sun_drives else (1.0 + ratio) / (1.0 + ratio / basic)


def lossy_flow(  # noqa: PLR0913
    shafts: Sequence[str],
    conditions: Sequence[SpeedCondition],
    *,
    speeds: Mapping[str, float],
    torques: Mapping[str, float],
    efficiencies: Mapping[str, Sequence[float]],
    held: Sequence[str] = (),
    outputs: Sequence[str] = (),
    joined: Sequence[Sequence[str]] = (),
    friction: Sequence[FrictionTorque] = (),
    lossless: Mapping[str, Mapping[str, float]] | None = None,
) -> LossyFlow:
    """Compute the torques of all shafts with losses.

    Parameters
    ----------
    shafts, conditions, held, outputs, joined
        As for `femgear.gears.power_flow.power_flow`.
    speeds : mapping
        Of all shafts [rad/s], as the stages tie them.
    torques : mapping
        Given external torques by shaft [N m].
    efficiencies : mapping
        By stage: eta of its meshes from the first gear to the last; 1 where a stage has none here.
    friction : sequence of FrictionTorque
        Of bearings.
    lossless : mapping, optional
        By stage and shaft its torques without losses [N m], by whose shares stages side by side share theirs; by
        default with the least squares of torques.

    Raises
    ------
    ConvergenceError
        E-CONVERGENCE: no direction of power goes with its own torques, as where losses lock a stage.
    """
    graph = ShaftGraph(tuple(shafts), tuple(conditions), tuple(held), tuple(map(tuple, joined)))
    given = {shaft: float(torque) for shaft, torque in torques.items()}
    for loss in friction:
        relative = _speed(speeds, loss.shafts[0]) - _speed(speeds, loss.shafts[1])
        for shaft, sense in zip(loss.shafts, (-1.0, 1.0), strict=True):
            if shaft is not None:
                given[shaft] = given.get(shaft, 0.0) + sense * math.copysign(loss.torque, relative) * (relative != 0.0)
    near = np.array([_factor(condition, (lossless or {}).get(condition.name, {})) for condition in conditions])
    drives: list[bool | None] = [None] * len(conditions)
    for _ in range(_ROUNDS):
        members = [
            _member_weights(condition, way, efficiencies.get(condition.name, ()))
            for condition, way in zip(conditions, drives, strict=True)
        ]
        scale, reactions = _balance(graph, members, given, (*held, *outputs), near)
        rolling = [
            _rolling_power(condition, weights, factor, speeds)
            for condition, weights, factor in zip(conditions, members, scale, strict=True)
        ]
        least = _IDLE * max(map(abs, rolling), default=0.0)
        ways = [power > 0.0 if abs(power) > least else None for power in rolling]
        if ways == drives:
            external = dict.fromkeys(graph.shafts, 0.0)
            for shaft, torque in (*torques.items(), *reactions.items()):
                external[shaft] += float(torque)
            stages = members, scale, rolling, ways
            return _collected(graph, stages, external, speeds, efficiencies, friction)
        drives = ways
    raise ConvergenceError(
        "no direction of power goes with the torques that its losses leave: a stage locks itself",
        code="E-CONVERGENCE",
        key="losses.friction",
        limit="losses below the power that a stage passes on",
        remedy="a smaller coefficient of friction, or drive the stage from its other side",
    )


def _speed(speeds: Mapping[str, float], shaft: str | None) -> float:
    return 0.0 if shaft is None else speeds.get(shaft, 0.0)


def _central(condition: SpeedCondition) -> tuple[str, str]:
    """First and last central gear of a stage."""
    assert condition.gears is not None
    first, *_ = condition.gears.meshes
    return first[0], condition.gears.meshes[-1][1]


def _member_weights(
    condition: SpeedCondition, first_drives: bool | None, efficiencies: Sequence[float]
) -> tuple[tuple[str | None, float], ...]:
    """Shafts of first gear, last gear and carrier with the ratios of their torques."""
    gears = condition.gears
    assert gears is not None
    (first, last), basic = _central(condition), basic_efficiency(efficiencies)
    sense = math.prod(mesh[2] for mesh in gears.meshes)
    passed = 1.0 if first_drives is None else basic if first_drives else 1.0 / basic
    weight_1, weight_2 = float(gears.teeth[first]), -sense * float(gears.teeth[last]) * passed
    return (
        (gears.shafts[first], weight_1),
        (gears.shafts[last], weight_2),
        (gears.shafts.get("carrier"), -(weight_1 + weight_2)),
    )


def _rolling_power(condition: SpeedCondition, members, scale: float, speeds: Mapping[str, float]) -> float:
    """Power that the first gear brings into the teeth in the frame of the carrier [W]."""
    assert condition.gears is not None
    first, _ = _central(condition)
    carrier = _speed(speeds, condition.gears.shafts.get("carrier"))
    return -float(scale) * members[0][1] * (_speed(speeds, condition.gears.shafts[first]) - carrier)


def _factor(condition: SpeedCondition, torques: Mapping[str, float]) -> float:
    """Torque of a stage on a shaft over its weight there; zero of torques that are not known."""
    return next((torque / float(condition.weights[shaft]) for shaft, torque in torques.items()), 0.0)


def _balance(graph: ShaftGraph, members, given: Mapping[str, float], unknown: Sequence[str], near: np.ndarray):
    """Solve for the factors of all stages, where they are open those ``near`` others, and the unknown torques."""
    count = len(graph.conditions)
    matrix, right = np.zeros((graph.count, count + len(unknown))), np.zeros(graph.count)
    for stage, weights in enumerate(members):
        for shaft, weight in weights:
            if shaft is not None:
                matrix[graph.group[shaft], stage] += weight
    for place, shaft in enumerate(unknown, count):
        matrix[graph.group[shaft], place] += 1.0
    for shaft, torque in given.items():
        right[graph.group[shaft]] -= torque
    # tooth numbers make columns of stages tens of times as long as those of torques
    length = np.linalg.norm(matrix, axis=0)
    length[length == 0.0] = 1.0
    first = np.concatenate([near, np.zeros(len(unknown))])
    solution = first + np.linalg.lstsq(matrix / length, right - matrix @ first, rcond=None)[0] / length
    return solution[:count], dict(zip(unknown, solution[count:].tolist(), strict=True))


def _collected(graph: ShaftGraph, stages, external: dict[str, float], speeds, efficiencies, friction) -> LossyFlow:
    """Collect powers and losses from weights, factors, rolling powers and directions of the stages."""
    stage_torque, mesh_loss, rolling_power, drives = {}, {}, {}, {}
    for condition, weights, factor, power, first_drives in zip(graph.conditions, *stages, strict=True):
        on_shafts: dict[str, float] = {}
        for shaft, weight in weights:
            if shaft is not None:
                on_shafts[shaft] = on_shafts.get(shaft, 0.0) + float(weight * factor)
        name, each = condition.name, tuple(efficiencies.get(condition.name, ()))
        entering = power if power >= 0.0 else -power / basic_efficiency(each)
        losses, left = [], entering
        for efficiency in each if power >= 0.0 else each[::-1]:
            losses.append(left * (1.0 - efficiency))
            left *= efficiency
        stage_torque[name], rolling_power[name] = on_shafts, float(entering)
        mesh_loss[name] = tuple(map(float, losses if power >= 0.0 else losses[::-1]))
        drives[name] = first_drives
    power = [torque * _speed(speeds, shaft) for shaft, torque in external.items()]
    lost = {
        loss.name: loss.torque * abs(_speed(speeds, loss.shafts[0]) - _speed(speeds, loss.shafts[1]))
        for loss in friction
    }
    return LossyFlow(
        external,
        stage_torque,
        rolling_power,
        mesh_loss,
        lost,
        drives,
        math.fsum(value for value in power if value > 0.0),
        -math.fsum(value for value in power if value < 0.0),
    )
