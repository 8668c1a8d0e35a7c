"""Torques with losses: efficiencies of Willis' sets, balances of powers, directions of power."""

import pytest

from femgear.gears.power_flow import pair_condition, planetary_condition, power_flow
from femgear.gears.power_losses import FrictionTorque, basic_efficiency, lossy_flow, planetary_efficiency

ETA = (0.99, 0.995)


def flows(condition, shafts, speeds, torques, outputs, *, held=(), joined=(), efficiencies=None, friction=()):
    """Flow with and without losses."""
    conditions = condition if isinstance(condition, list) else [condition]
    given = {"torques": torques, "outputs": outputs, "held": held, "joined": joined}
    ideal = power_flow(shafts, conditions, speeds=speeds, **given)
    efficiencies = efficiencies or {each.name: ETA for each in conditions}
    return ideal, lossy_flow(
        shafts, conditions, speeds=ideal.speed, efficiencies=efficiencies, friction=friction, **given
    )


@pytest.mark.parametrize("torque", [100.0, -100.0])
def test_a_set_with_the_ring_held_has_the_efficiency_of_its_closed_form(torque):
    condition = planetary_condition("set", "sun", "carrier", None, 27, 108)
    _, flow = flows(condition, ["sun", "carrier"], {"sun": 300.0}, {"sun": torque}, ["carrier"])
    expected = planetary_efficiency(basic_efficiency(ETA), 4.0, sun_drives=torque > 0.0)
    assert flow.efficiency == pytest.approx(expected, rel=1e-12)
    assert flow.first_drives["set"] is (torque > 0.0)
    assert abs(flow.imbalance) < 1e-12


def test_with_a_held_carrier_both_ways_have_one_efficiency():
    condition = planetary_condition("set", "sun", None, "ring", 27, 108)
    for torque in (100.0, -100.0):
        _, flow = flows(condition, ["sun", "ring"], {"sun": 300.0}, {"sun": torque}, ["ring"])
        assert flow.efficiency == pytest.approx(0.99 * 0.995, rel=1e-12)


@pytest.mark.parametrize("torque", [400.0, -400.0])
def test_a_set_with_the_sun_held_lets_less_power_roll(torque):
    """With i_0 = 4 the ring drives with (eta_0 + 4)/5, the carrier with 5/(1/eta_0 + 4)."""
    condition = planetary_condition("set", None, "carrier", "ring", 27, 108)
    _, flow = flows(condition, ["carrier", "ring"], {"ring": 300.0}, {"ring": torque}, ["carrier"])
    basic = basic_efficiency(ETA)
    expected = (basic + 4.0) / 5.0 if torque > 0.0 else 5.0 / (1.0 / basic + 4.0)
    assert flow.efficiency == pytest.approx(expected, rel=1e-12)
    assert flow.rolling_power["set"] == pytest.approx(0.2 * flow.input_power, rel=0.02)


def test_losses_add_up_meshes_and_bearings_in_a_train_of_stages():
    conditions = [
        pair_condition("first", "a", "b", 20, 61),
        planetary_condition("set", "b", "c", None, 21, 87),
        pair_condition("last", "c", "d", 33, 50, internal=True),
    ]
    friction = (FrictionTorque("outer", ("a", None), 0.5), FrictionTorque("between", ("b", "c"), 0.8))
    ideal, flow = flows(
        conditions,
        ["a", "b", "c", "d"],
        {"a": 400.0},
        {"a": 50.0},
        ["d"],
        efficiencies={"first": (0.99,), "set": ETA, "last": (0.985,)},
        friction=friction,
    )
    assert abs(flow.imbalance) < 1e-12
    assert flow.friction_loss["outer"] == pytest.approx(200.0)
    assert flow.friction_loss["between"] == pytest.approx(0.8 * abs(ideal.speed["b"] - ideal.speed["c"]))
    product = 0.99 * planetary_efficiency(basic_efficiency(ETA), 87 / 21) * 0.985
    _, alone = flows(
        conditions,
        ["a", "b", "c", "d"],
        {"a": 400.0},
        {"a": 50.0},
        ["d"],
        efficiencies={"first": (0.99,), "set": ETA, "last": (0.985,)},
    )
    assert alone.efficiency == pytest.approx(product, rel=1e-12) and flow.efficiency < alone.efficiency


@pytest.mark.parametrize("teeth, link, drives", [(33, 0.98, True), (31, 0.98, True), (31, 0.9, False)])
def test_power_that_circulates_loses_many_times_what_goes_through(teeth, link, drives):
    """A set whose ring is driven by its own carrier: it turns the sun slowly, and may lock when that drives."""
    conditions = [
        planetary_condition("set", "sun", "carrier", "ring", 30, 90),
        pair_condition("link", "carrier", "ring", 40, teeth, internal=True),
    ]
    _, flow = flows(
        conditions,
        ["sun", "carrier", "ring"],
        {"sun": 100.0},
        {"sun": 10.0},
        ["carrier"],
        efficiencies={"set": ETA, "link": (link,)},
    )
    assert abs(flow.imbalance) < 1e-10
    assert flow.rolling_power["link"] > 10.0 * flow.input_power or not drives
    # one that locks takes power at both its ends
    assert (flow.output_power > 0.0) is drives
    assert flow.efficiency < 0.8


def test_an_idle_stage_loses_nothing():
    conditions = [pair_condition("first", "a", "b", 20, 61), pair_condition("idle", "b", "c", 30, 31)]
    _, flow = flows(conditions, ["a", "b", "c"], {"a": 1.0}, {"a": 1.0}, ["b"])
    assert flow.mesh_loss["idle"] == pytest.approx((0.0, 0.0), abs=1e-12) and flow.first_drives["idle"] is None


def test_stages_side_by_side_lose_by_the_shares_that_they_have():
    pairs = [pair_condition(name, "a", "b", 20, 40) for name in ("one", "two")]
    known = {"speeds": {"a": 10.0, "b": -5.0}, "torques": {"a": 90.0}, "outputs": ["b"]}
    without = {"one": {"a": -60.0, "b": -120.0}, "two": {"a": -30.0, "b": -60.0}}
    flow = lossy_flow(["a", "b"], pairs, efficiencies={"one": (0.99,), "two": (0.98,)}, lossless=without, **known)
    # 600 W and 300 W; what the losses change of the shares is small as these are
    assert flow.mesh_loss["one"][0] == pytest.approx(6.0, rel=0.02)
    assert flow.mesh_loss["two"][0] == pytest.approx(6.0, rel=0.02)
    assert flow.imbalance == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("torque", [10.0, -10.0])
def test_branches_of_planets_as_pairs_on_a_carrier_lose_what_a_set_loses(torque):
    shafts, numbers = ["sun", "carrier", "ring", "p1", "p2", "p3"], (1, 2, 3)
    pairs = [pair_condition(f"s{n}", "sun", f"p{n}", 27, 39, carrier="carrier") for n in numbers]
    pairs += [pair_condition(f"r{n}", f"p{n}", "ring", 39, 105, internal=True, carrier="carrier") for n in numbers]
    given = {"torques": {"sun": torque}, "held": ["ring"], "outputs": ["carrier"]}
    flow = power_flow(shafts, pairs, speeds={"sun": 100.0}, share=True, **given)
    efficiencies = {f"s{n}": [0.98] for n in numbers} | {f"r{n}": [0.99] for n in numbers}
    lossy = lossy_flow(shafts, pairs, speeds=flow.speed, efficiencies=efficiencies, lossless=flow.stage_torque, **given)
    expected = planetary_efficiency(0.98 * 0.99, 105 / 27, sun_drives=torque > 0.0)
    assert lossy.efficiency == pytest.approx(expected, rel=1e-12)
    assert abs(lossy.imbalance) < 1e-12
