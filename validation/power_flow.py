"""Speeds and torques of graphs of shafts and gear stages, against closed forms in fractions and printed ratios."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction as F

from set_conditions import ravigneaux_conditions, stepped_condition

from femgear.errors import CaseError
from femgear.gears.power_flow import (
    PowerFlow,
    SpeedCondition,
    pair_condition,
    planetary_condition,
    power_flow,
)
from femgear.gears.stage_frequencies import stage_frequencies
from validation.rows import Row, at_most, counted, printed, within

WILLIS = "Willis, closed form"
MULLER = "Müller, Die Umlaufgetriebe: closed form"


@dataclass(frozen=True)
class Graph:
    """A graph of shafts with what it must give.

    ``speed`` and ``torque`` are exact shares of given speeds and torques by shaft, of some of the ``shafts``;
    ``printed`` is a ratio of ``in`` over ``out`` as its source prints it.
    """

    name: str
    source: str
    shafts: str
    conditions: tuple[SpeedCondition, ...]
    speed: Mapping[str, Mapping[str, F]] = field(default_factory=dict)
    torque: Mapping[str, Mapping[str, F]] = field(default_factory=dict)
    held: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ("out",)
    joined: tuple[tuple[str, ...], ...] = ()
    speeds: Mapping[str, float] = field(default_factory=lambda: {"in": 150.0})
    torques: Mapping[str, float] = field(default_factory=lambda: {"in": 7.0})
    printed: str = ""

    def solve(self) -> PowerFlow:
        """Solve it by femgear."""
        return power_flow(
            self.shafts.split(),
            self.conditions,
            speeds=self.speeds,
            torques=self.torques,
            held=self.held,
            outputs=self.outputs,
            joined=self.joined,
        )


def geared(name: str, source: str, shafts: str, conditions, ratio: F, **more) -> Graph:
    """Make a graph whose input turns ``ratio`` times as fast as its output; power gives the torque."""
    speed, torque = {"out": {"in": 1 / ratio}}, {"out": {"in": -ratio}}
    return Graph(name, source, shafts, tuple(conditions), speed, torque, **more)


def willis_table(name: str, condition, inner: F, source: str) -> list[Graph]:
    """Make the six graphs of a set with one driven and one held member.

    ``inner`` is the speed of the sun over that of the ring with the carrier held.
    """
    ratios = {
        ("sun", "ring"): 1 - inner,
        ("carrier", "ring"): 1 / (1 - inner),
        ("sun", "carrier"): inner,
        ("ring", "carrier"): 1 / inner,
        ("ring", "sun"): 1 - 1 / inner,
        ("carrier", "sun"): 1 / (1 - 1 / inner),
    }
    graphs = []
    for (driven, held), ratio in ratios.items():
        (output,) = {"sun", "carrier", "ring"} - {driven, held}
        names = {driven: "in", held: "held", output: "out"}
        stage = condition(*(names[member] for member in ("sun", "carrier", "ring")))
        graphs.append(
            Graph(
                f"{name}: {driven} drives, {held} held",
                source,
                "in held out",
                (stage,),
                {"out": {"in": 1 / ratio}, "held": {}},
                {"out": {"in": -ratio}, "held": {"in": ratio - 1}},
                held=("held",),
            )
        )
    return graphs


def single_sets() -> list[Graph]:
    """Make one planetary set of every kind, every member held in turn."""
    return [
        *willis_table(
            "single planets", lambda s, c, r: planetary_condition("set", s, c, r, 27, 108), F(-108, 27), WILLIS
        ),
        *willis_table(
            "double planets",
            lambda s, c, r: planetary_condition("set", s, c, r, 30, 72, double=True),
            F(72, 30),
            WILLIS,
        ),
        *willis_table(
            "stepped planets",
            lambda s, c, r: stepped_condition("set", s, c, r, 23, 41, 17, 81),
            -F(41, 23) * F(81, 17),
            MULLER,
        ),
    ]


def simpson() -> list[Graph]:
    """Make the gears of a Simpson set of equal rows 33/72: common sun, front carrier and rear ring at the output."""
    sun, ring = 33, 72
    stages = (
        planetary_condition("front", "sun", "out", "front-ring", sun, ring),
        planetary_condition("rear", "sun", "rear-carrier", "out", sun, ring),
    )
    shafts, source = "in sun front-ring rear-carrier out", "Simpson set, closed form"
    drive = ("in", "front-ring")
    return [
        geared("Simpson 1", source, shafts, stages, 2 + F(sun, ring), held=("rear-carrier",), joined=(drive,)),
        geared("Simpson 2", source, shafts, stages, 1 + F(sun, ring), held=("sun",), joined=(drive,)),
        geared("Simpson 3", source, shafts, stages, F(1), joined=(drive, ("in", "sun"))),
        geared("Simpson R", source, shafts, stages, -F(ring, sun), held=("rear-carrier",), joined=(("in", "sun"),)),
    ]


def ravigneaux() -> list[Graph]:
    """Make the gears of a Ravigneaux set 30/36/72."""
    small, large, ring = 30, 36, 72
    stages = ravigneaux_conditions("set", "small", "large", "carrier", "out", small, large, ring)
    source, shafts = "Ford AOD, teeth and ratios of a service bulletin", "in small large carrier out"
    first, second = ("in", "small"), F(small + large, small) * F(ring, ring + large)
    return [
        geared(
            "Ravigneaux 1", source, shafts, stages, F(ring, small), held=("carrier",), joined=(first,), printed="2.40"
        ),
        geared("Ravigneaux 2", source, shafts, stages, second, held=("large",), joined=(first,), printed="1.47"),
        geared("Ravigneaux 3", source, shafts, stages, F(1), joined=(first, ("in", "carrier")), printed="1.00"),
        geared(
            "Ravigneaux 4",
            source,
            shafts,
            stages,
            F(ring, ring + large),
            held=("large",),
            joined=(("in", "carrier"),),
            printed="0.67",
        ),
        geared(
            "Ravigneaux R",
            source,
            shafts,
            stages,
            -F(ring, large),
            held=("carrier",),
            joined=(("in", "large"),),
            printed="-2.00",
        ),
    ]


def lepelletier() -> list[Graph]:
    """Make the gears of a Lepelletier train: a set 37/71 with a held sun before a Ravigneaux set 31/38/85."""
    small, large, ring, slow = 31, 38, 85, 1 + F(37, 71)
    stages = (
        planetary_condition("front", None, "slow", "in", 37, 71),
        *ravigneaux_conditions("rear", "small", "large", "carrier", "out", small, large, ring),
    )
    on_small, on_large, direct = ("slow", "small"), ("slow", "large"), ("in", "carrier")
    second = F(small + large, small) * F(ring, ring + large)
    gears: dict[str, tuple] = {
        "1": (slow * F(ring, small), ("carrier",), (on_small,), "4.17"),
        "2": (slow * second, ("large",), (on_small,), "2.34"),
        "3": (slow, (), (on_small, on_large), "1.52"),
        "4": (ring * slow / (small + (ring - small) * slow), (), (on_small, direct), "1.14"),
        "5": (ring * slow / ((ring + large) * slow - large), (), (on_large, direct), "0.87"),
        "6": (F(ring, ring + large), ("large",), (direct,), "0.69"),
        "R": (-slow * F(ring, large), ("carrier",), (on_large,), "-3.40"),
    }
    source, shafts = "Ford 6R80, ratios of the workshop manual", "in slow small large carrier out"
    return [
        geared(f"Lepelletier {gear}", source, shafts, stages, ratio, held=held, joined=joined, printed=text)
        for gear, (ratio, held, joined, text) in gears.items()
    ]


def crossed_sets() -> list[Graph]:
    """Make the gears of two sets 26/62 and 42/74, each carrier at the ring of the other."""
    stages = (
        planetary_condition("front", "front-sun", "middle", "out", 26, 62),
        planetary_condition("rear", "rear-sun", "out", "middle", 42, 74),
    )
    source, shafts = "GM THM 440-T4, teeth and ratios of a service bulletin", "in front-sun rear-sun middle out"
    low, middle, sun = (F(62, 26) * 42 + 42 + 74) / 74, ("in", "middle"), ("in", "front-sun")
    return [
        geared("crossed sets 1", source, shafts, stages, low, held=("rear-sun",), joined=(sun,), printed="2.92"),
        geared(
            "crossed sets 2", source, shafts, stages, F(116, 74), held=("rear-sun",), joined=(middle,), printed="1.57"
        ),
        geared("crossed sets 4", source, shafts, stages, F(62, 88), held=("front-sun",), joined=(middle,)),
        geared("crossed sets R", source, shafts, stages, -F(62, 26), held=("middle",), joined=(sun,)),
    ]


def three_gears() -> list[Graph]:
    """Make Wolfrom's sets: sun and first ring, second ring at the output."""
    shafts, held = "in carrier fixed out", ("fixed",)
    first = planetary_condition("first ring", "in", "carrier", "fixed", 18, 72)
    plain = planetary_condition("second ring", "in", "carrier", "out", 18, 75)
    stepped = stepped_condition("second ring", "in", "carrier", "out", 18, 27, 26, 71)
    return [
        geared("Wolfrom", MULLER, shafts, (first, plain), (1 + F(72, 18)) / (1 - F(72, 75)), held=held),
        geared(
            "Wolfrom, stepped planets",
            MULLER,
            shafts,
            (first, stepped),
            (1 + F(72, 18)) / (1 - F(72, 27) * F(26, 71)),
            held=held,
        ),
    ]


def two_inputs() -> list[Graph]:
    """Make graphs with two speeds or torques: a hybrid's power split and differentials."""
    source = "Toyota P410, teeth as published; closed form"
    stages = (
        planetary_condition("split", "mg1", "engine", "ring", 30, 78),
        planetary_condition("reduction", "mg2", None, "ring", 22, 58),
        pair_condition("counter", "ring", "counter", 54, 55),
        pair_condition("final", "counter", "wheel", 24, 77),
    )
    drop, shafts = F(54, 55) * F(24, 77), "engine mg1 mg2 ring counter wheel"
    split = Graph(
        "power split",
        source,
        shafts,
        stages,
        {
            "wheel": {"engine": F(108, 78) * drop, "mg1": -F(30, 78) * drop},
            "mg2": {"engine": -F(58, 22) * F(108, 78), "mg1": F(58, 22) * F(30, 78)},
        },
        {"mg1": {"engine": -F(30, 108)}, "wheel": {"engine": -F(78, 108) / drop, "mg2": F(58, 22) / drop}},
        outputs=("mg1", "wheel"),
        speeds={"engine": 210.0, "mg1": 350.0},
        torques={"engine": 120.0, "mg2": -40.0},
    )
    braked = replace(
        split,
        name="power split, generator braked",
        speed={"wheel": {"engine": F(108, 78) * drop}, "mg1": {}},
        torque={"mg1": {"engine": -F(30, 108)}, "wheel": {"engine": -F(78, 108) / drop}},
        held=("mg1",),
        outputs=("wheel",),
        speeds={"engine": 210.0},
        torques={"engine": 120.0},
    )
    # a ring with twice the teeth of its sun around double planets turns at the mean of sun and carrier
    equal = planetary_condition("differential", "left", "right", "cage", 36, 72, double=True)
    bevel = pair_condition("final", "in", "cage", 11, 43)
    differential = Graph(
        "differential",
        "mean of two speeds, equal torques",
        "in cage left right",
        (equal, bevel),
        {"right": {"in": -F(2 * 11, 43), "left": F(-1)}, "cage": {"in": -F(11, 43)}},
        {"left": {"in": F(43, 22)}, "right": {"in": F(43, 22)}},
        outputs=("left", "right"),
        speeds={"in": 100.0, "left": -30.0},
    )
    one_wheel = replace(
        differential,
        name="differential, one wheel held",
        speed={"right": {"in": -F(2 * 11, 43)}},
        held=("left",),
        outputs=("right",),
        speeds={"in": 100.0},
    )
    return [split, braked, differential, one_wheel]


def chains() -> list[Graph]:
    """Make chains and trees of pairs, with idlers, internal gears and stages in series."""
    source = "product of teeth"
    sew = [
        pair_condition(f"stage {n}", a, b, p, q) for n, a, b, p, q in ((1, "in", "b", 23, 67), (2, "b", "c", 13, 76))
    ]
    branches = (pair_condition("left", "in", "a", 20, 50), pair_condition("right", "in", "out", 20, 30))
    ratio = (1 + F(56, 19)) * (1 + F(70, 20)) * -F(100, 23)
    wind = (
        planetary_condition("first", "b", "in", None, 19, 56),
        planetary_condition("second", "c", "b", None, 20, 70),
        pair_condition("third", "c", "out", 100, 23),
    )
    return [
        geared("external pair", source, "in out", (pair_condition("pair", "in", "out", 17, 54),), -F(54, 17)),
        geared("internal pair", source, "in out", (pair_condition("pair", "in", "out", 17, 54, True),), F(54, 17)),
        geared(
            "two idlers",
            source,
            "in a b out",
            (
                pair_condition("1", "in", "a", 21, 34),
                pair_condition("2", "a", "b", 34, 55),
                pair_condition("3", "b", "out", 55, 89),
            ),
            -F(89, 21),
        ),
        geared(
            "external and internal pair",
            source,
            "in a out",
            (pair_condition("1", "in", "a", 19, 41), pair_condition("2", "a", "out", 22, 90, internal=True)),
            -F(41, 19) * F(90, 22),
        ),
        geared(
            "three pairs",
            source,
            "in b c out",
            (*sew, pair_condition("stage 3", "c", "out", 14, 87)),
            -F(67 * 76 * 87, 23 * 13 * 14),
        ),
        geared(
            "countershaft",
            source,
            "in counter main out",
            (
                pair_condition("constant mesh", "in", "counter", 22, 37),
                pair_condition("second", "counter", "main", 21, 31),
            ),
            F(37 * 31, 22 * 21),
            joined=(("main", "out"),),
        ),
        Graph(
            "tree with two outputs",
            source,
            "in a out",
            branches,
            {"a": {"in": -F(2, 5)}, "out": {"in": -F(2, 3)}},
            {"out": {"in": F(3, 2), "a": -F(3, 5)}},
            torques={"in": 30.0, "a": 12.0},
        ),
        geared("wind turbine", "product of Willis' ratios", "in b c out", wind, 1 / ratio),
    ]


def loops() -> list[Graph]:
    """Make graphs whose stages close a loop that turns."""
    sun, ring = 24, 72
    share = F(sun + ring) / (sun - ring * F(20, 50))
    looped = (
        planetary_condition("set", "in", "out", "ring", sun, ring),
        pair_condition("bypass", "in", "ring", 20, 50),
    )
    block = (planetary_condition("set", "in", "out", "ring", sun, ring),)
    return [
        geared("set with a bypass", "Willis and power", "in ring out", looped, share),
        geared("set turning as a block", "all speeds equal", "in ring out", block, F(1), joined=(("in", "ring"),)),
    ]


def all_graphs() -> tuple[Graph, ...]:
    """List the graphs that must be solved."""
    return (
        *single_sets(),
        *simpson(),
        *ravigneaux(),
        *lepelletier(),
        *crossed_sets(),
        *three_gears(),
        *two_inputs(),
        *chains(),
        *loops(),
    )


@dataclass(frozen=True)
class Refused:
    """A graph that must be refused, by ``codes`` in their order and ``words`` of the first problem."""

    graph: Graph
    codes: tuple[str, ...]
    words: tuple[str, ...]
    limit: str | None = None


def refused_graphs() -> tuple[Refused, ...]:
    """List graphs that are free, locked, contradictory or open."""
    free, lock, speed = ("E-MECHANISM",), ("E-MECHANISM",), ("E-SPEED",)
    balance, share = ("E-LOAD-BALANCE",), ("E-TORQUE",)
    a_set = planetary_condition("set", "in", "out", "ring", 27, 108)

    first, other = pair_condition("one", "in", "out", 20, 30), pair_condition("other", "in", "out", 20, 31)
    equal = pair_condition("other", "in", "out", 40, 60)
    triangle = (
        pair_condition("1", "in", "b", 20, 30),
        pair_condition("2", "b", "out", 30, 40),
        pair_condition("3", "out", "in", 40, 20),
    )

    def graph(shafts: str, *conditions: SpeedCondition, **more) -> Graph:
        return Graph("refused", "", shafts, conditions, **more)

    return (
        Refused(
            graph("in out ring", a_set, outputs=("out", "ring")), free, ("'out' and 'ring' turn freely", "a speed")
        ),
        Refused(graph("in out loose", first), free, ("'loose' turns freely",)),
        Refused(graph("in out", first, other), lock, ("'one' and 'other' lock", "'in' and 'out' cannot turn")),
        Refused(graph("in b out", *triangle), lock, ("'1', '2' and '3' lock",)),
        Refused(graph("in out", first, joined=(("in", "out"),)), lock, ("'one' locks",)),
        Refused(
            graph("in out more", first, other, pair_condition("tail", "out", "more", 9, 9)),
            lock,
            ("'one' and 'other' lock",),
        ),
        Refused(graph("in out ring", a_set, held=("ring", "in"), speeds={}), lock, ("'in' and 'ring' held",)),
        Refused(
            graph("in out", first, speeds={"in": 30.0, "out": 20.0}), speed, ("'out' does not fit that of",), "-20 "
        ),
        Refused(graph("in out", first, speeds={"in": 3.0, "out": -2.0 - 1e-8}), speed, ("'out' does not fit",), "-2 "),
        Refused(
            graph("in out end", first, joined=(("out", "end"),), speeds={"out": 3.0, "end": -3.0}),
            speed,
            ("'end' does not fit", "joined"),
            "3 ",
        ),
        Refused(
            graph("in out ring", a_set, held=("ring",), speeds={"in": 5.0, "ring": 1.0}),
            speed,
            ("'ring'", "held"),
            "0 ",
        ),
        Refused(
            graph("in out", first, outputs=(), torques={"in": 10.0, "out": 14.0}), balance, ("'in' and 'out'",), "15 "
        ),
        Refused(graph("in out", first, outputs=()), balance, ("nothing takes the torque on shaft 'in'",), "0 "),
        Refused(graph("in out", first, outputs=("in", "out"), torques={}), share, ("'in' and 'out' do not follow",)),
        Refused(graph("in out", first, equal), share, ("'one' and 'other' carry torque",)),
        Refused(
            graph("in out end", first, outputs=("out", "end"), joined=(("out", "end"),)), share, ("'out' and 'end'",)
        ),
        Refused(graph("in out ring", a_set, held=("ring",), outputs=("out", "in"), torques={}), share, ("'ring'",)),
        Refused(
            graph("in out loose", first, equal, speeds={"in": 1.0, "out": 1.0}),
            ("E-MECHANISM", "E-SPEED", "E-TORQUE"),
            ("'loose'",),
        ),
        Refused(graph("in out", first, held=("x",)), ("E-CHOICE",), ("no shaft 'x'",)),
        Refused(graph("in out in", first), ("E-DUPLICATE",), ("shaft 'in' stands twice",)),
        Refused(graph("in out", first, held=("out",)), ("E-DUPLICATE",), ("both held and output",)),
        Refused(graph("in out", first, torques={"in": 1.0, "out": 2.0}), ("E-DUPLICATE",), ("given torque",)),
        Refused(graph("in out", first, torques={"in": math.nan}), ("E-FINITE",), ("torque of shaft 'in'",)),
    )


def missed_shares(graph: Graph, flow: PowerFlow) -> list[str]:
    """List shafts whose exact shares are not the expected ones."""
    speed = [shaft for shaft, shares in graph.speed.items() if flow.speed_ratio[shaft] != shares]
    return speed + [shaft for shaft, shares in graph.torque.items() if flow.torque_ratio[shaft] != shares]


def power_of_shares(flow: PowerFlow) -> set[F]:
    """Sum the exact power over all shafts, for every given speed and every given torque alone."""
    given = {name for shares in flow.speed_ratio.values() for name in shares}
    loads = {name for shares in flow.torque_ratio.values() for name in shares}
    shafts = flow.speed_ratio
    return {
        sum(
            (flow.speed_ratio[shaft].get(speed, F(0)) * flow.torque_ratio[shaft].get(load, F(0)) for shaft in shafts),
            F(0),
        )
        for speed in given
        for load in loads
    }


def unbalanced_shafts(graph: Graph, flow: PowerFlow) -> float:
    """Find the largest torque left over on a group of shafts, relative to the largest torque."""
    groups = {shaft: {shaft} for shaft in graph.shafts.split()}
    for joint in graph.joined:
        merged = set().union(*(groups[shaft] for shaft in joint))
        groups |= dict.fromkeys(merged, merged)
    largest = max(map(abs, flow.torque.values()))
    rest = []
    for group in groups.values():
        terms = [flow.torque[shaft] for shaft in group]
        terms += [stage.get(shaft, 0.0) for stage in flow.stage_torque.values() for shaft in group]
        rest.append(abs(math.fsum(terms)))
    return max(rest) / largest


def ratios() -> tuple[Row, ...]:
    """Ratios of all graphs."""
    rows, missed, power, left = [], [], set(), []
    graphs = all_graphs()
    for graph in graphs:
        flow = graph.solve()
        missed += missed_shares(graph, flow)
        power |= power_of_shares(flow)
        left.append(unbalanced_shafts(graph, flow))
        if graph.printed:
            name = f"{graph.name}: speed of the input over that of the output"
            rows.append(printed("PF", graph.source, name, graph.printed, flow.speed["in"] / flow.speed["out"]))
        for shaft, shares in graph.speed.items():
            exact = float(sum(share * F(graph.speeds[given]) for given, share in shares.items()))
            if exact and not graph.printed:
                name = f"{graph.name}: speed of {shaft} [rad/s]"
                rows.append(within("PF", graph.source, name, exact, flow.speed[shaft], 1e-15))
    return (
        *rows,
        counted(
            "PF", "closed forms", f"{len(graphs)} graphs: shares of speeds and torques that differ", 0, len(missed)
        ),
        counted(
            "PF", "power balance", "graphs: sum of the power of all shafts is 0 in fractions", 1, int(power == {F(0)})
        ),
        at_most("PF", "balance of every shaft", "largest torque left over, relative", 1e-14, max(left)),
    )


def refusals() -> tuple[Row, ...]:
    """Graphs that are free, locked, contradictory or open."""
    right = 0
    graphs = refused_graphs()
    for wrong in graphs:
        try:
            wrong.graph.solve()
        except CaseError as error:
            right += tuple(problem.code for problem in error.problems) == wrong.codes
    return (
        counted(
            "PF", "by hand", "graphs that are free, locked, contradictory or open: refused as such", len(graphs), right
        ),
    )


def frequencies() -> tuple[Row, ...]:
    """Mesh, passing and hunting tooth frequencies of the reference set at 3100 rpm of the sun."""
    stage = planetary_condition("set", "in", "out", "ring", 27, 108)
    flow = power_flow(
        ("in", "out", "ring"),
        (stage,),
        speeds={"in": 3100.0 * math.pi / 30.0},
        torques={"in": 1.0},
        held=("ring",),
        outputs=("out",),
    )
    frequencies = stage_frequencies(stage, flow.speed, planet_teeth={"planet": 40}, planets=3)
    carrier = 3100.0 / 60.0 / 5.0
    paper = "housing modulation paper: 1116 Hz at 3100 rpm"
    return (
        within(
            "PF",
            paper,
            "27/40/108: mesh of sun and planet [Hz]",
            1116.0,
            frequencies.mesh_frequency["sun-planet"],
            1e-14,
        ),
        within(
            "PF",
            paper,
            "27/40/108: mesh of planet and ring [Hz]",
            1116.0,
            frequencies.mesh_frequency["planet-ring"],
            1e-14,
        ),
        within(
            "PF",
            "3 carrier turns",
            "three planets past a sensor [Hz]",
            3 * carrier,
            frequencies.passing_frequency["casing"],
            1e-14,
        ),
        within(
            "PF",
            "rolling",
            "planet about its pin [Hz]",
            -1116.0 / 40,
            frequencies.planet_spin["planet"] / math.tau,
            1e-14,
        ),
        within(
            "PF",
            "27 x 40 teeth",
            "hunting tooth period [s]",
            27 * 40 / 1116.0,
            frequencies.hunting_time["sun-planet"],
            1e-14,
        ),
    )
