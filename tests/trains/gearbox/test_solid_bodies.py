"""Bodies of a gearbox in space: where its gears are, teeth in the gaps of their mates, motions of the files."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from casings import answer_in_a_casing
from matplotlib.path import Path as Outline

from femgear.report.space import SPACE, SpaceBody
from femgear.stages.gears_in_space import case_bodies
from femgear.stages.protocol import Drawn
from femgear.trains.gearbox.case_file import CASING
from femgear.trains.gearbox.judgements import gearbox_faults
from femgear.trains.gearbox.solid_bodies import _casing_box, gearbox_bodies, write_space
from femgear.trains.gearbox_of_case import gearbox_of_case
from femgear.trains.reading import read_case, with_value

pytestmark = pytest.mark.usefixtures("coarse_states")

CASES = Path(__file__).parents[3] / "cases"


def outline(body) -> np.ndarray:
    """Polygon of a gear at mid-width, (n, 2) [m]."""
    turns = body.angle + 0.5 * body.twist + 2.0 * np.pi * np.arange(body.teeth) / body.teeth
    turned = [body.section @ np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]]) for a in turns]
    return np.vstack(turned) + body.axis


def overlap(body, mate) -> float:
    """Share of the points of the teeth of a gear near its mate that lie inside of the material of the mate."""
    points, other = outline(body), outline(mate)
    inside = Outline(other).contains_points(points, radius=0.0)
    inside = ~inside if mate.internal else inside
    return float(inside.mean())


@pytest.fixture(scope="module")
def axle():
    return read_case(CASES / "e_axle.toml")


def test_teeth_stand_in_the_gaps_of_their_mates(axle):
    bodies = {body.name: body for body in gearbox_bodies(axle, {}) if body.kind == "gear"}
    pinion, wheel = bodies["gear 1 of first stage"], bodies["gear 2 of first stage"]
    sun, ring = bodies["sun of second stage"], bodies["ring of second stage"]
    planets = [bodies[f"second stage planet {number}"] for number in (1, 2, 3)]
    mates = [(pinion, wheel), *((sun, planet) for planet in planets), *((planet, ring) for planet in planets)]
    for body, mate in mates:
        turned = replace(body, angle=body.angle + np.pi / body.teeth)
        # edges of hollow flanks are chords, into which points of contact reach; half a pitch away teeth overlap
        assert overlap(body, mate) < 0.01 < 0.02 < overlap(turned, mate), (body.name, mate.name)


def test_helical_mates_have_opposite_hands_and_one_base_helix(axle):
    helical = with_value(axle, "pair[0].teeth.helix_angle", "12 deg") if axle.pair[0].teeth is None else axle
    pinion, wheel = (body for body in gearbox_bodies(helical, {}) if body.name.startswith("gear"))
    assert pinion.twist * wheel.twist < 0.0
    # the lead of both is the same over the base radii, which go with the teeth
    assert pinion.twist * pinion.teeth == pytest.approx(-wheel.twist * wheel.teeth)


def test_parts_of_shafts_and_bearings_lie_along_their_axes(axle):
    bodies = list(gearbox_bodies(axle, {}))
    parts = [body for body in bodies if body.kind == "shaft"]
    assert len(parts) == sum(len(shaft.part) for shaft in axle.shaft)
    for shaft in axle.shaft:
        own = [body for body in parts if body.member == shaft.name]
        assert own[0].ends[0] == pytest.approx(shaft.start)
        assert own[-1].ends[1] == pytest.approx(shaft.start + shaft.length)
        assert all(body.axis == pytest.approx(shaft.axis) for body in own)
    bearings = [body for body in bodies if body.kind == "bearing"]
    assert len(bearings) == len(axle.bearing)


def test_motions_are_deflections_and_modes_of_the_run(tmp_path):
    answer = answer_in_a_casing()
    data = {name: answer[name].contents() for name in ("deflection", "modes")}
    assert write_space(Drawn(answer.case, data), tmp_path) == [SPACE]
    model = json.loads((tmp_path / SPACE).read_text(encoding="utf-8"))
    cases, elastic = data["deflection"].sizes["load_case"], (data["modes"]["frequency"].values > 0.0).sum()
    swings = [motion["swings"] for motion in model["motions"]]
    assert swings == [False] * cases + [True] * min(elastic, 40)
    kinds = [body["kind"] for body in model["bodies"]]
    assert {"gear", "shaft", "sensor", "foot"} <= {*kinds}
    at_casing = data["deflection"]["station"].values[data["deflection"]["member"].values == CASING].tolist()
    assert model["casing_members"] == at_casing and model["casing_members"]
    movers = {body["member"] for body in model["bodies"]}
    assert movers <= model["members"].keys()
    assert write_space(Drawn(answer.case, {}), tmp_path) == []


def test_the_box_of_a_casing_holds_gears_feet_and_sensors():
    gear = SpaceBody("gear", "gear", "a", (0.1, 0.0), (0.0, 0.02), ((0.0, 0.05), (0.0, 0.05)))
    foot = SpaceBody("foot", "foot", CASING, (-0.1, -0.2), (0.09, 0.11), ((0.0, 0.01), (0.0, 0.01)))
    # shafts stand out of it
    shaft = SpaceBody("shaft", "shaft", "a", (0.1, 0.0), (-1.0, 1.0), ((0.0, 0.01), (0.0, 0.01)))
    low, high = _casing_box([gear, foot, shaft])
    assert low == pytest.approx([-0.1, -0.2, 0.0]) and high == pytest.approx([0.15, 0.05, 0.1])


def test_faulty_teeth_of_a_stage_are_marked_where_those_of_the_set_are():
    cracked = read_case(CASES / "cracked_planet.toml")
    alone = {body.name: body for body in case_bodies(cracked)}
    box = read_case(gearbox_of_case(cracked).tables)
    marked = {body.name: body for body in gearbox_bodies(box, {}) if body.marked}
    assert list(marked) == ["set planet 1"]
    ((tooth, words),) = marked["set planet 1"].marked
    assert words == "set planet 1, tooth 3: crack of 1.5 mm" and gearbox_faults(box) == [words]
    # at the same angle to the line between the axes, in a set that may be turned as a whole
    at = [
        body.angle + 2.0 * np.pi * number / 40 - np.arctan2(body.axis[1], body.axis[0])
        for body, number in ((marked["set planet 1"], tooth), (alone["planet 1"], alone["planet 1"].marked[0][0]))
    ]
    assert np.angle(np.exp(1j * (at[0] - at[1]))) == pytest.approx(0.0, abs=1e-6)


def test_teeth_roll_on_one_another(axle):
    """Where two gears touch both move alike: seen from the carrier of planets, and from the casing of a pair."""
    bodies = {body.name: body for body in gearbox_bodies(axle, {}) if body.kind == "gear"}
    pinion, wheel = bodies["gear 1 of first stage"], bodies["gear 2 of first stage"]
    assert wheel.turns == pytest.approx(-pinion.turns * pinion.teeth / wheel.teeth) and abs(pinion.turns) == 1.0
    sun, planet, ring = (
        bodies[f"{name}second stage{end}"] for name, end in (("sun of ", ""), ("", " planet 1"), ("ring of ", ""))
    )
    x, y, carrier = planet.orbit
    assert (x, y) == sun.axis and carrier != 0.0
    relative = [body.turns - carrier for body in (sun, planet, ring)]
    assert relative[1] == pytest.approx(-relative[0] * sun.teeth / planet.teeth)
    assert relative[2] == pytest.approx(relative[1] * planet.teeth / ring.teeth)
