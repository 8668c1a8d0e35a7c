"""Speeds and torques of any graph of shafts and gear stages, without losses.

A stage ties the speeds of its shafts: the sum of weight times speed is zero, ``z_1 w_1 + z_2 w_2 = 0`` of two
external gears, Willis' equation of planetary ones (R. Willis, Principles of Mechanism, 1841; J. Müller,
Die Umlaufgetriebe, 1998). The torques that a stage puts on its shafts do no work on such motions, so that they are
the same weights times one unknown, and every shaft is in balance.

Tooth numbers are whole. What the graph determines, leaves free, locks or contradicts is found in fractions
(`ShaftGraph`), never by rounding.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise
from numbers import Integral, Rational, Real

import numpy as np

from femgear.errors import CaseError, GeometryError, several
from femgear.gears.exact_linear import ExactSolution, reduce_rows
from femgear.gears.kinematics import willis_weights
from femgear.gears.shaft_graph import EXTERNAL, INTERNAL, ShaftGraph, SpeedCondition, StageGears, connected_sets

_RPM = math.pi / 30.0  # [rad/s]
AGREEMENT = 1e-9
"""Given speeds and torques contradict where they miss a ratio by more than this, relative to the largest term."""
Ratios = Mapping[str, Mapping[str, Fraction]]


@dataclass(frozen=True)
class PowerFlow:
    """Speeds and torques of a graph of shafts.

    Parameters
    ----------
    speed : mapping
        By shaft [rad/s].
    torque : mapping
        External torque by shaft [N m], reactions of held shafts and torques of outputs among them.
    stage_torque : mapping
        By stage and shaft: the torque that the stage puts on the shaft [N m].
    speed_ratio : mapping
        By shaft: exact share of every given speed in its speed [1].
    torque_ratio : mapping
        By shaft: exact share of every given torque in its external torque [1].
    side_by_side : tuple of tuples of str
        Stages that share a torque as the balance leaves open, set by set; their torques have the least squares of
        power, by which equal stages have equal shares.
    """

    speed: Mapping[str, float]
    torque: Mapping[str, float]
    stage_torque: Mapping[str, Mapping[str, float]]
    speed_ratio: Ratios
    torque_ratio: Ratios
    side_by_side: tuple[tuple[str, ...], ...] = ()

    @property
    def power(self) -> dict[str, float]:
        """External power by shaft [W], positive where it flows in; without losses the sum is zero."""
        return {shaft: torque * self.speed[shaft] for shaft, torque in self.torque.items()}


def disagree(terms: Iterable[float], tolerance: float = AGREEMENT) -> bool:
    """Tell whether terms miss a sum of zero by more than a share of the largest."""
    sizes = [*terms]
    return abs(math.fsum(sizes)) > tolerance * max(map(abs, sizes))


def pair_condition(
    name: str,
    first: str | None,
    second: str | None,
    teeth_1: int,
    teeth_2: int,
    internal: bool = False,
    carrier: str | None = None,
) -> SpeedCondition:
    """Tie the speeds of two shafts by a pair of gears: ``z_1 w_1 + z_2 w_2 = 0``, or minus if one is internal.

    Speeds are those against the ``carrier`` of planets, where one is named (Willis). A shaft that is None is the
    casing. GeometryError: tooth numbers that are not positive whole numbers (E-TEETH).
    """
    _check_teeth(name, {"teeth_1": teeth_1, "teeth_2": teeth_2})
    sense = INTERNAL if internal else EXTERNAL
    gears = StageGears(
        {"gear 1": teeth_1, "gear 2": teeth_2},
        {"gear 1": first, "gear 2": second} | ({} if carrier is None else {"carrier": carrier}),
        (("gear 1", "gear 2", sense),),
    )
    weights = willis_weights(teeth_1, -sense * teeth_2)
    return _condition(name, tuple(zip((first, second, carrier), weights, strict=True)), gears)


def planetary_condition(
    name: str,
    sun: str | None,
    carrier: str | None,
    ring: str | None,
    sun_teeth: int,
    ring_teeth: int,
    double: bool = False,
) -> SpeedCondition:
    """Tie the speeds of a planetary set (Willis): ``z_s (w_s - w_c) +- z_r (w_r - w_c) = 0``.

    Plus with single planets, minus with ``double`` ones, two in mesh with each other between sun and ring. A shaft
    that is None is the casing.

    GeometryError: tooth numbers that are not positive whole numbers, or a ring inside its sun (E-TEETH).
    """
    _check_teeth(name, {"sun_teeth": sun_teeth, "ring_teeth": ring_teeth})
    _check_ring(name, sun_teeth, ring_teeth)
    sign = -1 if double else 1
    return _condition(
        name,
        tuple(zip((sun, ring, carrier), willis_weights(sun_teeth, sign * ring_teeth), strict=True)),
        StageGears(
            {"sun": sun_teeth, "ring": ring_teeth},
            {"sun": sun, "carrier": carrier, "ring": ring},
            _planet_meshes(*(("sun", "inner planet", "outer planet", "ring") if double else ("sun", "planet", "ring"))),
        ),
    )


def power_flow(
    shafts: Sequence[str],
    conditions: Sequence[SpeedCondition],
    *,
    speeds: Mapping[str, float],
    torques: Mapping[str, float],
    held: Sequence[str] = (),
    outputs: Sequence[str] = (),
    joined: Sequence[Sequence[str]] = (),
    share: bool = False,
    planets: Collection[str] = (),
) -> PowerFlow:
    """Compute the speeds and torques of all shafts.

    Parameters
    ----------
    shafts : sequence of str
        Their names.
    conditions : sequence of SpeedCondition
        Stages between them.
    speeds : mapping
        Given speeds by shaft [rad/s].
    torques : mapping
        Given external torques by shaft [N m]; on shafts that stand nowhere here no torque acts.
    held : sequence of str
        Shafts that stand still and take what torque they must.
    outputs : sequence of str
        Shafts whose external torque is found.
    joined : sequence of sequences of str
        Shafts that couplings join rigidly.
    share : bool
        Stages side by side, whose shares of a torque follow from their stiffness, get equal ones; without it they are
        refused.
    planets : collection of str
        Shafts that refusals ask last for a speed.

    Raises
    ------
    CaseError
        All that is wrong at once (``problems``): names that no shaft has (E-CHOICE) or that stand twice
        (E-DUPLICATE), values that are no finite numbers (E-FINITE); shafts that are free, stages that lock
        (E-MECHANISM); speeds that contradict (E-SPEED); torques that do not balance (E-LOAD-BALANCE) or that the
        graph does not determine (E-TORQUE).
    """
    problems = _wrong_entries(shafts, conditions, speeds, torques, held, outputs, joined)
    if problems:
        raise several(problems)
    graph = ShaftGraph(tuple(shafts), tuple(conditions), tuple(held), tuple(map(tuple, joined)))
    locks, locked = _locks(graph)
    turning = graph.speeds([*speeds])
    given, unknown = [*torques], [*held, *outputs]
    balance = graph.torques(given, unknown)
    problems = [
        *locks,
        *_free(graph, turning, [*speeds], planets),
        *_contradictions(graph, turning, speeds, locked),
        *_undetermined(graph, balance, held, outputs, locked, share=share),
        *_unbalanced(graph, balance, torques, unknown, [shaft for shaft in speeds if shaft not in torques], locked),
    ]
    if problems:
        raise several(problems)
    flow = _flow(graph, turning, balance, speeds, torques, unknown)
    return (
        replace(flow, stage_torque={**flow.stage_torque, **_side_by_side(graph, balance, flow)})
        if balance.open
        else flow
    )


def _side_by_side(graph: ShaftGraph, balance: ExactSolution, flow: PowerFlow) -> dict[str, dict[str, float]]:
    """Torques of stages that the balance leaves open, with the least squares of their powers [N m]."""
    balanced = np.zeros((graph.count, len(graph.conditions)))
    for number, row in enumerate(graph.rows):
        for group, weight in row.items():
            balanced[group, number] = float(weight)
    outside = np.zeros(graph.count)
    for shaft, torque in flow.torque.items():
        outside[graph.group[shaft]] += torque
    sizes = np.ones(len(graph.conditions))
    for number, condition in enumerate(graph.conditions):
        powers = [abs(float(weight) * flow.speed[shaft]) for shaft, weight in condition.weights.items()]
        sizes[number] = max(powers) or max(abs(float(weight)) for weight in condition.weights.values())
    scales = np.linalg.lstsq(balanced / sizes, -outside, rcond=None)[0] / sizes
    return {
        graph.conditions[number].name: {
            shaft: float(weight) * float(scales[number]) for shaft, weight in graph.conditions[number].weights.items()
        }
        for number in balance.open
    }


def _flow(
    graph: ShaftGraph,
    turning: ExactSolution,
    balance: ExactSolution,
    speeds: Mapping[str, float],
    torques: Mapping[str, float],
    unknown: Sequence[str],
) -> PowerFlow:
    """Values of a graph that determines everything."""
    giver = {graph.group[shaft]: shaft for shaft in reversed([*speeds])}
    shares = {
        group: {giver[other]: share for other, share in turning.ratio[group].items()} for group in turning.ratio
    } | {group: {shaft: Fraction(1)} for group, shaft in giver.items()}
    shares |= {group: {} for group in graph.standing}
    speed_ratio = {shaft: shares[graph.group[shaft]] for shaft in graph.shafts}
    given, first_given = [*torques], len(graph.conditions) + len(unknown)

    def named(column: int) -> dict[str, Fraction]:
        # an open one is found by what it shares
        return {given[other - first_given]: share for other, share in balance.ratio.get(column, {}).items()}

    torque_ratio: dict[str, dict[str, Fraction]] = {shaft: {} for shaft in graph.shafts}
    for shaft in given:
        torque_ratio[shaft][shaft] = Fraction(1)
    for place, shaft in enumerate(unknown, len(graph.conditions)):
        for other, share in named(place).items():
            torque_ratio[shaft][other] = torque_ratio[shaft].get(other, Fraction(0)) + share
    stage_torque = {}
    for number, condition in enumerate(graph.conditions):
        scale = _total(named(number), torques)
        stage_torque[condition.name] = {shaft: float(weight * scale) for shaft, weight in condition.weights.items()}
    return PowerFlow(
        {shaft: float(_total(ratios, speeds)) for shaft, ratios in speed_ratio.items()},
        {shaft: float(_total(ratios, torques)) for shaft, ratios in torque_ratio.items()},
        stage_torque,
        speed_ratio,
        torque_ratio,
        tuple(
            tuple(graph.conditions[number].name for number in sorted(cluster))
            for cluster in connected_sets([{column, *others} for column, others in balance.open.items()])
        ),
    )


def _total(ratios: Mapping[str, Fraction], values: Mapping[str, float]) -> Fraction:
    """Sum of shares of given values; floats are fractions, too."""
    return sum((share * _exact(values[shaft]) for shaft, share in ratios.items()), Fraction(0))


def _exact(value: float) -> Fraction:
    return Fraction(value) if isinstance(value, Rational) else Fraction(float(value))


def _condition(name: str, terms: Iterable[tuple[str | None, int]], gears: StageGears) -> SpeedCondition:
    weights: dict[str, Fraction] = {}
    for shaft, weight in terms:
        if shaft is not None:
            weights[shaft] = weights.get(shaft, Fraction(0)) + int(weight)
    return SpeedCondition(name, weights, gears)


def _planet_meshes(*gears: str) -> tuple[tuple[str, str, int], ...]:
    """Meshes of a chain of gears from the sun to the ring, the last one internal."""
    pairs = [*pairwise(gears)]
    return tuple((*pair, INTERNAL if pair is pairs[-1] else EXTERNAL) for pair in pairs)


def _check_teeth(name: str, teeth: Mapping[str, int]) -> None:
    for key, count in teeth.items():
        if not isinstance(count, Integral) or count < 1:
            raise GeometryError(
                f"stage {name!r}: a gear with {count} teeth",
                code="E-TEETH",
                key=key,
                value=count,
                limit="whole numbers from 1 on, also of internal gears",
                remedy="give the number of teeth without a sign",
            )


def _check_ring(name: str, sun_teeth: int, ring_teeth: int) -> None:
    if ring_teeth <= sun_teeth:
        raise GeometryError(
            f"stage {name!r}: a ring with {ring_teeth} teeth around a sun with {sun_teeth}",
            code="E-TEETH",
            key="ring_teeth",
            value=ring_teeth,
            limit=f"more than {sun_teeth}",
            remedy="check which gear is the ring",
        )


def _wrong_entries(shafts, conditions, speeds, torques, held, outputs, joined) -> list[CaseError]:
    """Names that do not exist or stand twice, and values that are no finite numbers."""
    problems = []
    uses = {
        "speeds": [*speeds],
        "torques": [*torques],
        "held": [*held],
        "outputs": [*outputs],
        "joined": [shaft for group in joined for shaft in group],
    }
    uses |= {f"stage {condition.name!r}": [*condition.weights] for condition in conditions}
    for place, names in uses.items():
        for shaft in dict.fromkeys(names):
            if shaft not in shafts:
                remedy = f"one of {', '.join(map(repr, shafts))}" if shafts else "name the shafts"
                text = f"{place}: there is no shaft {shaft!r}"
                problems.append(CaseError(text, code="E-CHOICE", value=shaft, remedy=remedy))
    stages = [condition.name for condition in conditions]
    lists = {"shaft": [*shafts], "stage": stages, "held shaft": [*held], "output": [*outputs]}
    lists |= {"shaft both held and output": [*{*held}, *{*outputs}]}
    lists |= {"shaft with a given torque that is an output": [*torques, *{*outputs}]}
    for what, names in lists.items():
        for name in dict.fromkeys(again for again in names if names.count(again) > 1):
            text = f"{what} {name!r} stands twice" if " " not in what or what == "held shaft" else f"{what}: {name!r}"
            problems.append(CaseError(text, code="E-DUPLICATE", value=name, remedy="leave one of them out"))
    for what, values, unit in (("speed", speeds, "rad/s"), ("torque", torques, "N m")):
        for shaft, value in values.items():
            if not isinstance(value, Real) or isinstance(value, bool) or not math.isfinite(value):
                text = f"the {what} of shaft {shaft!r} is no finite number"
                problems.append(CaseError(text, code="E-FINITE", value=value, limit=f"a finite number in {unit}"))
    return problems


def _locks(graph: ShaftGraph) -> tuple[list[CaseError], set[int]]:
    """Stages that lock each other, parts in which nothing turns for what is held, and the groups in both."""
    problems, locked = [], set()
    loops = {group: stages for group, (stages, held) in _stopped(graph, set()).items() if not held}
    for cluster in connected_sets(loops.values()):
        loop = min((members for members in loops.values() if members & cluster), key=len)
        groups = {group for group, stages in loops.items() if stages & cluster}
        locked |= groups | {group for stage in cluster for group in graph.rows[stage]}
        text = f"{_stages(graph, loop)} lock{'s' * (len(loop) == 1)}: {_shafts(graph.names(groups))} cannot turn"
        problems.append(
            CaseError(
                text,
                code="E-MECHANISM",
                limit="stages whose ratios around every loop multiply to one",
                remedy="leave out a stage of the loop or a coupling, or give teeth whose ratios fit",
            )
        )
    stopped = _stopped(graph, graph.standing)
    for part in graph.parts:
        groups = {group for stage in part for group in graph.rows[stage]}
        turnable = groups - graph.standing
        if not turnable or not turnable <= stopped.keys() or groups & locked:
            continue
        locked |= groups
        holds = sorted({shaft for group in turnable for shaft in graph.names(stopped[group][1])} & {*graph.held})
        text = f"{_stages(graph, part)} cannot turn with {_shafts(holds)} held"
        limit = "shafts held so that the stages can turn"
        problems.append(CaseError(text, code="E-MECHANISM", limit=limit, remedy="hold one shaft less"))
    return problems, locked


def _stopped(graph: ShaftGraph, standing: Collection[int]) -> dict[int, tuple[frozenset[int], frozenset[int]]]:
    """Groups that stand whatever the others do: the numbers of the stages and the held groups that stop each."""
    # the columns behind those of the groups tell of which stages an equation is made
    marked = [{**row, graph.count + number: Fraction(1)} for number, row in enumerate(graph.rows)]
    pivots, _ = reduce_rows(marked, [group for group in range(graph.count) if group not in standing])
    stopped = {}
    for group, row in pivots.items():
        others = {column for column in row if column < graph.count and column != group}
        if others <= {*standing}:
            stages = frozenset(column - graph.count for column in row if column >= graph.count)
            stopped[group] = (stages, frozenset(others))
    return stopped


def _free(graph: ShaftGraph, turning: ExactSolution, given: Sequence[str], planets: Collection[str]) -> list[CaseError]:
    """Shafts whose speed nothing decides."""
    problems = []
    for cluster in connected_sets([{group, *others} for group, others in turning.open.items()]):
        shafts = graph.names(cluster)
        missing = sum(group in cluster for group in turning.parameters)
        free = _settling(graph, given, sorted(shafts, key=lambda shaft: shaft in planets), missing)
        more = "a speed is" if len(free) == 1 else f"{len(free)} speeds are"
        problems.append(
            CaseError(
                f"{_shafts(shafts)} turn{'s' * (len(shafts) == 1)} freely: {more} missing",
                code="E-MECHANISM",
                limit="one given speed for every way in which the shafts turn",
                remedy=(f"give the speed of {_listed(free)}", f"hold {_listed(free)}"),
            )
        )
    return problems


def _settling(graph: ShaftGraph, given: Sequence[str], shafts: Sequence[str], missing: int) -> list[str]:
    """Choose the first of shafts whose speeds, so many as are missing, decide all others."""
    chosen, open_ways = list[str](), len(graph.speeds(given).parameters)
    for shaft in shafts:
        left = len(graph.speeds([*given, *chosen, shaft]).parameters)
        if left < open_ways and len(chosen) < missing:
            chosen, open_ways = [*chosen, shaft], left
    return chosen


def _contradictions(
    graph: ShaftGraph, turning: ExactSolution, speeds: Mapping[str, float], locked: Collection[int]
) -> list[CaseError]:
    """Given speeds that do not go with each other, or with what is held."""
    problems, giver = [], {}
    for shaft, speed in speeds.items():
        group = graph.group[shaft]
        first = giver.setdefault(group, shaft)
        if group in graph.standing and speed:
            holder = next(held for held in graph.held if graph.group[held] == group)
            problems.append(_speed_problem(shaft, speed, 0.0, f"that of {holder!r}, which is held"))
        elif abs(speed - speeds[first]) > AGREEMENT * abs(speeds[first]):
            problems.append(_speed_problem(shaft, speed, speeds[first], f"that of {first!r}, which is joined with it"))
    for relation in turning.relations:
        terms = {group: float(share) * speeds[giver[group]] for group, share in relation.items()}
        if {*relation} & {*locked} or not disagree(terms.values()):
            continue
        last = max(relation, key=[*giver].index)
        fits = float(
            -_total(
                {giver[group_there]: share for group_there, share in relation.items() if group_there != last}, speeds
            )
        )
        others = [giver[group_there] for group_there in giver if group_there in relation and group_there != last]
        against = f"{'those' if len(others) > 1 else 'that'} of {_shafts(others)}" if others else "what is held"
        problems.append(_speed_problem(giver[last], speeds[giver[last]], fits, against))
    return problems


def _speed_problem(shaft: str, speed: float, fits: float, against: str) -> CaseError:
    return CaseError(
        f"the speed of shaft {shaft!r} does not fit {against}",
        code="E-SPEED",
        value=f"{speed:.9g} rad/s, {speed / _RPM:.6g} rpm",
        limit=f"{fits:.9g} rad/s, {fits / _RPM:.6g} rpm",
        remedy=f"leave the speed of {shaft!r} out",
    )


def _undetermined(
    graph: ShaftGraph,
    balance: ExactSolution,
    held: Sequence[str],
    outputs: Sequence[str],
    locked: Collection[int],
    *,
    share: bool,
) -> list[CaseError]:
    """Torques that the balance leaves open, but those of stages side by side where these ``share`` them."""
    problems, count = [], len(graph.conditions)
    for cluster in connected_sets([{column, *others} for column, others in balance.open.items()]):
        stages = [number for number in sorted(cluster) if number < count]
        outside = [([*held, *outputs])[column - count] for column in sorted(cluster) if column >= count]
        groups = {group for stage in stages for group in graph.rows[stage]} | {graph.group[shaft] for shaft in outside}
        if groups & {*locked}:
            continue
        free = [shaft for shaft in outside if shaft in outputs]
        if free:
            text = f"the torques of {_shafts(outside)} do not follow from the given ones"
            remedy = f"give the torque of {_listed(free[-1:])}, which is then no output"
        elif outside:
            text, remedy = f"{_shafts(outside)} are held against the same motion", "hold one shaft less"
        elif share:
            continue
        else:
            text = f"{_stages(graph, stages)} carry torque that tooth numbers do not share out"
            remedy = "leave out one of the stages, or the coupling that closes the loop"
        limit = "torques that follow from the given ones and the tooth numbers"
        problems.append(CaseError(text, code="E-TORQUE", limit=limit, remedy=remedy))
    return problems


def _unbalanced(
    graph: ShaftGraph,
    balance: ExactSolution,
    torques: Mapping[str, float],
    unknown: Sequence[str],
    driven: Sequence[str],
    locked: Collection[int],
) -> list[CaseError]:
    """Given torques that drive a motion which no output brakes; ``driven`` shafts have a given speed, but no torque."""
    problems, first_given, given = [], len(graph.conditions) + len(unknown), [*torques]
    settled = {graph.group[shaft] for shaft in (*torques, *unknown)}
    open_shafts = [shaft for shaft in driven if graph.group[shaft] not in settled]
    for relation in balance.relations:
        shares = {given[column - first_given]: share for column, share in relation.items()}
        groups = {graph.group[shaft] for shaft in shares}
        if groups & {*locked} or not disagree(float(share) * torques[shaft] for shaft, share in shares.items()):
            continue
        last = max(shares, key=given.index)
        fits = float(-_total({shaft: share for shaft, share in shares.items() if shaft != last}, torques))
        alone = len(shares) == 1
        names = sorted(shares, key=given.index)
        text = f"nothing takes the torque on shaft {last!r}"
        text = text if alone else f"the torques on {_shafts(names)} do not balance"
        remedy = "name the shaft that takes the power as an output" if alone else f"make {last!r} an output"
        remedy += "" if alone else ", whose torque is found"
        if alone and open_shafts:
            text += f"; {_shafts(open_shafts)} of given speed {'have' if len(open_shafts) > 1 else 'has'} no torque"
            remedy = f"give the torque of {_listed(open_shafts)}, or name its load an output, whose torque is found"
        problems.append(
            CaseError(
                text,
                code="E-LOAD-BALANCE",
                value=float(torques[last]),
                limit=f"{fits:.9g} N m",
                remedy=remedy,
            )
        )
    return problems


def _listed(names: Sequence[str]) -> str:
    quoted = [repr(name) for name in names]
    return " and ".join([", ".join(quoted[:-1]), quoted[-1]] if len(quoted) > 1 else quoted)


def _shafts(names: Sequence[str]) -> str:
    return f"shaft{'s' * (len(names) != 1)} {_listed(names)}"


def _stages(graph: ShaftGraph, numbers: Iterable[int]) -> str:
    names = [graph.conditions[number].name for number in sorted(numbers)]
    return f"stage{'s' * (len(names) != 1)} {_listed(names)}"
