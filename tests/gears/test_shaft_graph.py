"""Groups, parts and equations of graphs of shafts, by hand."""

from fractions import Fraction

from femgear.gears.power_flow import pair_condition
from femgear.gears.shaft_graph import ShaftGraph, connected_sets

STAGES = tuple(pair_condition(f"{a}{b}", a, b, 2, 3) for a, b in ("ab", "cd", "bc", "ef"))
SHAFTS = tuple("abcdef")


def test_parts_of_a_graph_hang_together_by_shafts():
    assert ShaftGraph(SHAFTS, STAGES).parts == [(0, 1, 2), (3,)]
    assert ShaftGraph(SHAFTS, STAGES, joined=(("d", "e"),)).parts == [(0, 1, 2, 3)]
    assert connected_sets([{1}, {2}, {3, 1}, {3, 2}]) == [{1, 2, 3}]


def test_joined_shafts_are_one_group():
    graph = ShaftGraph(SHAFTS, STAGES, joined=(("d", "e"), ("e", "f")), held=("f",))
    assert graph.count == 4
    assert graph.group["d"] == graph.group["e"] == graph.group["f"]
    assert graph.standing == {graph.group["d"]}
    assert graph.names(graph.standing) == ["d", "e", "f"]


def test_speeds_are_determined_as_far_as_given_ones_reach():
    graph = ShaftGraph(SHAFTS, STAGES)
    solution = graph.speeds(["a"])
    # z_b w_b = -z_a w_a twice: w_c = (2/3)^2 w_a
    assert solution.ratio[graph.group["c"]] == {graph.group["a"]: Fraction(4, 9)}
    assert set(graph.names(solution.open)) == {"e", "f"}


def test_the_balance_of_some_stages_leaves_the_others_out():
    graph = ShaftGraph(SHAFTS, STAGES)
    solution = graph.torques(["e", "a"], ["f", "d"], [3])
    # stage, torque on f; the torques on a and d act elsewhere
    assert solution.ratio.keys() == {3, 4}
    assert not solution.open and not solution.relations
