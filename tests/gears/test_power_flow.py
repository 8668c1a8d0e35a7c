"""Speeds and torques of graphs of shafts against closed forms in fractions, and what is refused."""

import itertools
import math
from fractions import Fraction
from random import Random
from typing import Any

import numpy as np
import pytest
from set_conditions import stepped_condition

from femgear.errors import CaseError, GeometryError
from femgear.gears.kinematics import torque_ratios
from femgear.gears.power_flow import (
    SpeedCondition,
    pair_condition,
    planetary_condition,
    power_flow,
)
from validation.power_flow import (
    all_graphs,
    missed_shares,
    power_of_shares,
    refused_graphs,
    unbalanced_shafts,
)

GRAPHS = all_graphs()
REFUSED = refused_graphs()


@pytest.mark.parametrize("graph", GRAPHS, ids=lambda graph: graph.name)
def test_a_graph_has_the_ratios_of_its_closed_form(graph):
    flow = graph.solve()
    assert missed_shares(graph, flow) == []
    assert power_of_shares(flow) == {0}
    assert unbalanced_shafts(graph, flow) < 1e-14
    assert math.fsum(flow.power.values()) == pytest.approx(0.0, abs=1e-12 * max(map(abs, flow.power.values())))
    if graph.printed:
        digits = len(graph.printed.partition(".")[2])
        assert flow.speed["in"] / flow.speed["out"] == pytest.approx(float(graph.printed), abs=0.501 * 10**-digits)


@pytest.mark.parametrize("graph", GRAPHS, ids=lambda graph: graph.name)
def test_stages_do_no_work_and_planetary_sets_pass_no_torque_to_the_casing(graph):
    flow = graph.solve()
    for stage in graph.conditions:
        torque = flow.stage_torque[stage.name]
        largest = max(map(abs, torque.values()))
        work = [value * flow.speed[shaft] for shaft, value in torque.items()]
        assert math.fsum(work) == pytest.approx(0.0, abs=1e-12 * (1.0 + max(map(abs, work))))
        if "carrier" in stage.gears.shafts and None not in stage.gears.shafts.values():
            assert math.fsum(torque.values()) == pytest.approx(0.0, abs=1e-12 * (1.0 + largest))


@pytest.mark.parametrize("graph", GRAPHS, ids=lambda graph: graph.name)
def test_the_speeds_satisfy_every_stage_in_fractions(graph):
    flow = graph.solve()
    for stage in graph.conditions:
        for given in graph.speeds:
            terms = (weight * flow.speed_ratio[shaft].get(given, 0) for shaft, weight in stage.weights.items())
            assert sum(terms) == 0


@pytest.mark.parametrize("seed", range(30))
def test_order_and_names_do_not_matter(seed):
    random = Random(seed)
    graph = GRAPHS[random.randrange(len(GRAPHS))]
    shafts = graph.shafts.split()
    new = dict(zip(shafts, random.sample([f"shaft {n}" for n in range(99)], len(shafts)), strict=True))
    stages = [SpeedCondition(one.name, {new[s]: w for s, w in one.weights.items()}) for one in graph.conditions]
    flow, before = (
        power_flow(
            random.sample([*new.values()], len(new)),
            random.sample(stages, len(stages)),
            speeds={new[shaft]: value for shaft, value in graph.speeds.items()},
            torques={new[shaft]: value for shaft, value in graph.torques.items()},
            held=[new[shaft] for shaft in graph.held],
            outputs=[new[shaft] for shaft in graph.outputs],
            joined=[[new[shaft] for shaft in group] for group in graph.joined],
        ),
        graph.solve(),
    )
    assert {shaft: flow.speed[new[shaft]] for shaft in shafts} == before.speed
    assert {shaft: flow.torque[new[shaft]] for shaft in shafts} == before.torque


@pytest.mark.parametrize("wrong", REFUSED, ids=lambda wrong: wrong.words[0])
def test_what_the_graph_does_not_determine_is_refused_by_name(wrong):
    with pytest.raises(CaseError) as caught:
        wrong.graph.solve()
    problems = caught.value.problems
    assert tuple(problem.code for problem in problems) == wrong.codes
    assert all(word in problems[0].message for word in wrong.words)
    if wrong.limit is not None:
        assert str(problems[0].limit).startswith(wrong.limit)


def test_a_loop_is_recognised_exactly():
    """Ratios that differ by 1e-12 lock, equal ones share their torque in a way that nothing tells."""
    big = 10**6
    for teeth, code in (
        ((big, big + 1, big - 1, big), "E-MECHANISM"),
        ((big, big + 1, 2 * big, 2 * big + 2), "E-TORQUE"),
    ):
        stages = (pair_condition("1", "a", "b", *teeth[:2]), pair_condition("2", "a", "b", *teeth[2:]))
        with pytest.raises(CaseError) as caught:
            power_flow("ab", stages, speeds={"a": 1.0}, torques={"a": 1.0}, outputs="b")
        assert caught.value.code == code


def random_graph(random):
    """Shafts, stages, held ones, outputs, given speeds and torques: many free or locked, some right."""
    shafts = [*"abcdef"[: random.randint(2, 6)]]
    stages = []
    for number in range(random.randint(1, len(shafts) - 1)):
        a, b, c = random.sample((*shafts, *shafts, None), 3)
        few, many = random.choice((20, 30, 40)), random.choice((60, 90))
        if random.random() < 0.5:
            stages.append(pair_condition(str(number), a, b, few, many, random.random() < 0.3))
        else:
            stages.append(planetary_condition(str(number), a, b, c, few, many, random.random() < 0.3))
    order = random.sample(shafts, len(shafts))
    held, outputs = order[: random.choice((0, 0, 1))], order[1:][: random.randint(1, 2)]
    rest = [shaft for shaft in shafts if shaft not in held and shaft not in outputs]
    speeds = {shaft: random.uniform(-9.0, 9.0) for shaft in random.sample(shafts, random.randint(0, 2))}
    return shafts, stages, held, outputs, speeds, {shaft: random.uniform(-9.0, 9.0) for shaft in rest[:2]}


def codes_by_ranks(shafts, stages, held, outputs, speeds, torques):
    """What is wrong with a graph by ranks of matrices of floats, the locks without their remaining mistakes."""
    unit = dict(zip(shafts, np.eye(len(shafts)), strict=True))
    table = np.array(
        [sum((float(w) * unit[s] for s, w in one.weights.items()), np.zeros(len(shafts))) for one in stages]
    )

    def rank(*rows):
        rows = np.array([one / (np.linalg.norm(one) or 1.0) for one in rows]).reshape(-1, len(shafts))
        return np.linalg.matrix_rank(rows, tol=1e-9) if len(rows) else 0

    fixed = [unit[shaft] for shaft in held]
    if any(rank(*table, unit[shaft]) == rank(*table) for shaft in shafts):
        return {"lock"}
    found = set()
    if rank(*table, *fixed, *(unit[shaft] for shaft in speeds)) < len(shafts):
        found.add("E-MECHANISM")
    given = np.array([*speeds.values()])
    rows = np.array([*table, *fixed, *(unit[shaft] for shaft in speeds)])
    right = np.concatenate([np.zeros(len(rows) - len(given)), given])
    if np.abs(rows @ np.linalg.lstsq(rows, right, rcond=1e-12)[0] - right).max() > 1e-8:
        found.add("E-SPEED")
    columns = [*table, *fixed, *(unit[shaft] for shaft in outputs)]
    if rank(*columns) < len(columns):
        found.add("E-TORQUE")
    load = sum((value * unit[shaft] for shaft, value in torques.items()), np.zeros(len(shafts)))
    if np.abs(np.array(columns).T @ np.linalg.lstsq(np.array(columns).T, load, rcond=1e-12)[0] - load).max() > 1e-8:
        found.add("E-LOAD-BALANCE")
    return found


def test_thousand_random_graphs_are_judged_as_by_ranks_of_matrices():
    random, solved, judged = Random(7), 0, set()
    for _ in range(1000):
        shafts, stages, held, outputs, speeds, torques = graph = random_graph(random)
        expected = codes_by_ranks(*graph)
        try:
            flow = power_flow(shafts, stages, speeds=speeds, torques=torques, held=held, outputs=outputs)
        except CaseError as error:
            messages = [problem.message for problem in error.problems]
            codes = {problem.code for problem in error.problems}
            if any("cannot turn with" in message for message in messages):
                continue  # a part that stands for what is held: its other mistakes are not told
            if expected == {"lock"}:
                assert any(" lock" in message for message in messages)
            else:
                assert codes == expected
            judged |= codes
            continue
        assert expected == set()
        solved += 1
        largest = max(map(abs, flow.torque.values())) or 1.0
        for shaft in shafts:
            balance = flow.torque[shaft] + sum(stage.get(shaft, 0.0) for stage in flow.stage_torque.values())
            assert balance == pytest.approx(0.0, abs=1e-12 * largest)
        for stage in stages:
            terms = [float(weight) * flow.speed[shaft] for shaft, weight in stage.weights.items()]
            assert math.fsum(terms) == pytest.approx(0.0, abs=1e-12 * (1.0 + max(map(abs, terms), default=0.0)))
    assert solved > 30 and judged == {"E-MECHANISM", "E-SPEED", "E-TORQUE", "E-LOAD-BALANCE"}


def test_a_long_chain_keeps_its_ratio():
    names = [f"shaft {number}" for number in range(101)]
    stages = [pair_condition(f"{a}-{b}", a, b, 19, 31) for a, b in itertools.pairwise(names)]
    flow = power_flow(names, stages, speeds={names[0]: 1.0}, torques={names[0]: 1.0}, outputs=names[-1:])
    assert flow.speed_ratio[names[-1]] == {names[0]: Fraction(19, 31) ** 100}


def test_a_stage_beside_a_held_shaft_may_stand():
    """A braked motor stops its pair; the rest of the train turns."""
    stages = (pair_condition("motor", "motor", "sun", 20, 40), planetary_condition("set", "sun", "out", "in", 30, 70))
    flow = power_flow(
        ["motor", "sun", "in", "out"], stages, speeds={"in": 10.0}, torques={"in": 7.0}, held=["motor"], outputs=["out"]
    )
    assert flow.speed == {"motor": 0.0, "sun": 0.0, "in": 10.0, "out": 7.0}
    assert flow.torque["out"] == -10.0
    # 3 N m at the sun, half of it and turned round at the motor
    assert flow.torque["motor"] == pytest.approx(-1.5)


def test_a_coupling_alone_passes_torque():
    flow = power_flow("ab", (), speeds={"a": 3.0}, torques={"a": 2.0}, outputs="b", joined=["ab"])
    assert flow.speed == {"a": 3.0, "b": 3.0} and flow.torque == {"a": 2.0, "b": -2.0}
    assert flow.power == {"a": 6.0, "b": -6.0}


def test_torque_on_a_held_shaft_adds_to_its_reaction():
    stage = planetary_condition("set", "s", "c", "r", 20, 60)
    flow = power_flow("scr", (stage,), speeds={"s": 4.0}, torques={"s": 1.0, "r": 5.0}, held="r", outputs="c")
    assert flow.torque == {"s": 1.0, "c": -4.0, "r": 3.0}


def test_redundant_speeds_that_agree_are_taken():
    stage = pair_condition("pair", "a", "b", 3, 7)
    flow = power_flow("ab", (stage,), speeds={"a": 1.0, "b": -3.0 / 7.0}, torques={}, outputs="b")
    assert flow.speed["b"] == pytest.approx(-3.0 / 7.0, rel=1e-15)
    assert set(flow.torque.values()) == {0.0}


def test_numbers_of_numpy_are_numbers():
    stage = pair_condition("pair", "a", "b", 1, 2)
    numbers: Any = {"a": np.float32(2.0)}, {"a": np.int64(3)}
    flow = power_flow("ab", (stage,), speeds=numbers[0], torques=numbers[1], outputs=["b"])
    assert flow.speed["b"] == -1.0 and flow.torque["b"] == 6.0


@pytest.mark.parametrize(
    "make",
    (
        lambda: pair_condition("x", "a", "b", 0, 3),
        lambda: pair_condition("x", "a", "b", 20, -30, internal=True),
        lambda: pair_condition("x", "a", "b", 20, 30.5),  # type: ignore[arg-type]
        lambda: planetary_condition("x", "a", "b", "c", 40, 40),
    ),
)
def test_teeth_that_no_gear_has_are_refused(make):
    with pytest.raises(GeometryError) as caught:
        make()
    assert caught.value.code == "E-TEETH" and "'x'" in caught.value.message


def test_weights_are_those_of_the_torques_of_a_set():
    weights = planetary_condition("set", "sun", "carrier", "ring", 27, 108).weights
    shares = torque_ratios(27, 108)
    assert {shaft: float(weight / weights["sun"]) for shaft, weight in weights.items()} == shares


def test_shafts_of_one_body_add_their_weights():
    assert planetary_condition("set", "a", "a", None, 20, 60).weights == {"a": Fraction(-60)}


def test_stepped_planets_of_equal_gears_are_single_ones():
    stepped = stepped_condition("set", "s", "c", "r", 20, 30, 30, 80)
    single = planetary_condition("set", "s", "c", "r", 20, 80)
    assert {shaft: weight / 30 for shaft, weight in stepped.weights.items()} == single.weights


def test_stages_side_by_side_share_equally_where_they_may():
    pairs = [pair_condition(name, "a", "b", 20, 40) for name in ("one", "two", "three")]
    given = {"speeds": {"a": 10.0}, "torques": {"a": 90.0}, "outputs": ["b"]}
    flow = power_flow(["a", "b"], pairs, share=True, **given)
    assert flow.side_by_side == (("one", "two", "three"),)
    for torques in flow.stage_torque.values():
        assert torques == pytest.approx({"a": -30.0, "b": -60.0}, rel=1e-12)
    assert flow.torque["b"] == pytest.approx(180.0, rel=1e-12)
    with pytest.raises(CaseError) as refused:
        power_flow(["a", "b"], pairs, **given)
    assert refused.value.code == "E-TORQUE"


def test_a_second_input_without_a_torque_is_named():
    with pytest.raises(CaseError) as refused:
        power_flow(
            ["sun", "carrier", "ring"],
            [planetary_condition("set", "sun", "carrier", "ring", 24, 72)],
            speeds={"sun": 100.0, "ring": 10.0},
            torques={"sun": 58.4},
            outputs=["carrier"],
        )
    assert refused.value.code == "E-LOAD-BALANCE"
    assert "'ring'" in str(refused.value) and refused.value.remedy.startswith("give the torque of 'ring'")


def test_members_are_asked_for_a_missing_speed_before_planets():
    with pytest.raises(CaseError) as refused:
        power_flow(
            ["sun", "ring", "carrier", "planet"],
            [
                pair_condition("outside", "sun", "planet", 24, 24, carrier="carrier"),
                pair_condition("inside", "planet", "ring", 24, 72, internal=True, carrier="carrier"),
            ],
            speeds={},
            torques={},
            planets=["planet"],
        )
    assert refused.value.remedy.startswith("give the speed of 'sun' and 'ring'")
