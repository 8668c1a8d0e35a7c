"""Drafts of sets with planets of any kind: they assemble, turn as Willis says, and are loaded as usual."""

import math

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.trains.drafts import ToothForm, new_case
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.planet_shafts import pair_phases
from femgear.trains.gearbox.power import gearbox_flow
from femgear.trains.gearbox.results import gearbox_warnings
from femgear.trains.gearbox.solid_bodies import gearbox_bodies
from femgear.trains.planets_draft import PLANET_KINDS
from femgear.trains.reading import parse_case, with_values

RATIOS = {
    "stepped": ("sun", "carrier", 1 + 57 * 108 / (24 * 27)),
    "double": ("sun", "carrier", 1 - 84 / 24),
    "ravigneaux": ("small sun", "ring", 22 / 15),
    "wolfrom": ("sun", "second ring", (1 + 72 / 18) / (1 - 72 * 26 / (27 * 71))),
}


@pytest.mark.parametrize("kind", PLANET_KINDS)
def test_a_draft_turns_as_its_teeth_say_and_carries_its_load(kind):
    case = with_values(parse_case(new_case(kind)), {"deflection.contact": False})
    driven, output, ratio = RATIOS[kind]
    flow = gearbox_flow(case)
    assert flow.speed[driven] / flow.speed[output] == pytest.approx(ratio)
    assert flow.port_torque["load"] == pytest.approx(-ratio * flow.port_torque["motor"])
    found = solve_deflection(case)
    for stage, force in zip(found.model.stages, found.mesh_force, strict=True):
        expected = abs(flow.first_torque(stage.section)) / stage.sizes.base_radii[0]
        assert force == pytest.approx(expected, rel=1e-3)
    # the branches are alike
    forces = found.mesh_force.reshape(3, -1)
    np.testing.assert_allclose(forces, np.broadcast_to(forces[0], forces.shape), rtol=1e-3)


def test_branches_of_a_double_set_follow_one_another_by_their_teeth():
    case = parse_case(new_case("double"))
    phases = pair_phases(case, gearbox_flow(case))
    for number in (2, 3):
        apart = phases[f"sun-inner planet {number}"] + 24 * (number - 1) / 3 - phases["sun-inner planet 1"]
        assert apart == pytest.approx(round(apart), abs=1e-9)
        lags = [phases[f"outer planet {n}-ring"] - phases[f"sun-inner planet {n}"] for n in (1, number)]
        # both sides of every branch are as far apart as those of the first one
        assert lags[0] - lags[1] == pytest.approx(round(lags[0] - lags[1]), abs=1e-9)


def test_stepped_planets_may_have_two_modules():
    case = parse_case(new_case("stepped", teeth=(25, 52, 18, 69)))
    modules = {stage.name: stage.teeth["set"]["module"] for stage in case.pair}
    assert float(modules["planet 1-ring"].split()[0]) == pytest.approx(2.0 * (25 + 52) / (69 - 18))
    flow = gearbox_flow(case)
    assert flow.speed["sun"] / flow.speed["carrier"] == pytest.approx(1 + 52 * 69 / (25 * 18))


def test_a_sun_that_turns_along_carries_nothing():
    """First gear of a Ravigneaux set: the carrier stands, the large sun has no torque."""
    case = parse_case(new_case("ravigneaux").replace('fixed = ["large sun"]', 'fixed = ["carrier"]'))
    flow = gearbox_flow(case)
    assert flow.speed["small sun"] / flow.speed["ring"] == pytest.approx(72 / 30)
    assert flow.speed["large sun"] / flow.speed["ring"] == pytest.approx(-72 / 36)
    found = solve_deflection(with_values(case, {"deflection.contact": False}))
    idle = ["large sun" in stage.name for stage in found.model.stages]
    assert np.abs(found.mesh_force[idle]).max() < 1e-6 * found.mesh_force.max()


@pytest.mark.parametrize(
    ("kind", "options", "words"),
    [
        ("stepped", {"planets": 5}, "cannot be equally spaced"),
        ("stepped", {"teeth": (24, 57, 27)}, "needs 4 numbers of teeth"),
        ("stepped", {"form": ToothForm(shifts=(0.1, 0.2))}, "spur gears without profile shift"),
        ("stepped", {"teeth": (24, 57, 60, 63)}, "do not mesh with planets"),
        ("double", {"teeth": (24, 18, 80, 84)}, "do not reach each other"),
        ("ravigneaux", {"teeth": (30, 36, 18, 20, 72)}, "do not mesh with planets"),
    ],
)
def test_what_makes_no_set_is_refused(kind, options, words):
    with pytest.raises(CaseError, match=words):
        new_case(kind, **options)


@pytest.mark.parametrize("kind", PLANET_KINDS)
def test_in_the_picture_every_tooth_stands_in_a_gap_of_its_mate(kind):
    """In closed chains too, where the last mesh has no freedom left."""
    case = parse_case(new_case(kind))
    gears = [body for body in gearbox_bodies(case, {}) if body.kind == "gear"]
    for stage in case.pair:
        mates = []
        for number, (shaft, place) in enumerate(zip(stage.shafts, stage.positions, strict=True), start=1):
            middle, teeth = case.shaft_named(shaft).start + place, stage.teeth[f"gear_{number}"]["teeth"]
            on_shaft = [gear for gear in gears if gear.member == shaft and gear.teeth == teeth]
            mates.append(min(on_shaft, key=lambda gear: abs(sum(gear.ends) / 2 - middle)))
        first, second = mates
        line = math.atan2(second.axis[1] - first.axis[1], second.axis[0] - first.axis[0])
        touch = line + math.pi if second.internal else line
        passed = first.teeth * (touch - first.angle)
        passed += second.teeth * ((second.angle - touch) if second.internal else (touch + math.pi - second.angle))
        away = passed / (2.0 * math.pi) - 0.5
        assert away == pytest.approx(round(away), abs=1e-8), stage.name
    if kind == "ravigneaux":
        assert {gear.angle for gear in gears if gear.member == "long planet 1"} == {
            next(gear.angle for gear in gears if gear.member == "long planet 1")
        }


@pytest.mark.parametrize("kind", PLANET_KINDS)
def test_gears_of_a_draft_have_a_usual_treatment_that_is_told_once(kind):
    case = parse_case(new_case(kind))
    assert {stage.teeth["material"]["treatment"] for stage in case.pair} == {"case hardened steel"}
    (finding,) = [finding for finding in gearbox_warnings(case) if finding.code == "W-MATERIAL"]
    assert f"({len(case.pair)} stages)" in finding.text


@pytest.mark.parametrize(
    ("kind", "options"),
    [("stepped", {"planets": 4}), ("double", {"planets": 6}), ("double", {"teeth": (24, 18, 20, 60)})],
)
def test_gears_without_room_are_told_at_the_head_of_the_draft(kind, options):
    text = new_case(kind, **options)
    head = " ".join(line.lstrip("# ") for line in text.split("format")[0].splitlines())
    assert "overlap by" in head
    size = head.split("overlap by ")[1].split(":")[0]
    # the same depth as femgear check finds between shafts and gears
    case = parse_case(text)
    assert any(f.code == "W-OVERLAP" and f.text.endswith(f"by {size}") for f in gearbox_warnings(case))


@pytest.mark.parametrize("kind", PLANET_KINDS)
def test_numbers_of_planets_that_are_offered_make_cases_without_overlaps(kind):
    with pytest.raises(CaseError, match="planets around its carrier") as refused:
        new_case(kind, planets=0)
    assert refused.value.code == "E-RANGE"
    numbers = [int(word) for word in refused.value.limit.split(", ")]
    found = gearbox_warnings(parse_case(new_case(kind, planets=max(numbers))))
    assert 3 in numbers and "W-OVERLAP" not in [finding.code for finding in found]


def test_most_planets_are_those_whose_pairs_a_gearbox_takes():
    with pytest.raises(CaseError, match="20 pairs at most"):
        new_case("stepped", teeth=(100, 20, 20, 140), planets=12)
    assert len(parse_case(new_case("stepped", teeth=(100, 20, 20, 140), planets=10)).pair) == 20


def test_planets_that_do_not_assemble_are_refused_with_the_nearest_teeth():
    with pytest.raises(CaseError) as refused:
        new_case("stepped", teeth=(24, 40, 16, 80), planets=3)
    assert (refused.value.code, refused.value.limit) == ("E-ASSEMBLY", "1, 2, 4")
    offered = refused.value.remedy.split("--teeth ")[1].split(" or ")
    for teeth in offered:
        new_case("stepped", teeth=tuple(map(int, teeth.split())), planets=3)
    # three is not among them: four is the next usual number
    assert "planet 4" in new_case("stepped", teeth=(24, 40, 16, 80))


def test_the_teeth_of_a_ring_may_be_negative():
    assert new_case("stepped", teeth=(24, 57, 27, -108)) == new_case("stepped", teeth=(24, 57, 27, 108))
    assert new_case("wolfrom", teeth=(18, 27, -72, 26, -71)) == new_case("wolfrom", teeth=(18, 27, 72, 26, 71))


def test_rings_that_turn_alike_make_no_wolfrom_set():
    with pytest.raises(CaseError, match="ratio is infinite"):
        new_case("wolfrom", teeth=(18, 27, 72, 27, 72))


@pytest.mark.parametrize("teeth", [(28, 36, 17, 18, 72), (30, 38, 18, 18, 74)])
def test_shafts_of_short_planets_pass_the_large_sun(teeth):
    case = parse_case(new_case("ravigneaux", teeth=teeth, planets=4))
    assert not [finding for finding in gearbox_warnings(case) if finding.code == "W-OVERLAP"]
    short = next(shaft for shaft in case.shaft if shaft.name == "short planet 1")
    # two of half the teeth of small sun and short planet, less the tip of the large sun and a quarter of a module
    room = 2e-3 * ((teeth[0] + teeth[2]) / 2 - (teeth[1] / 2 + 1) - 0.25)
    assert short.part[0].outer_diameter == pytest.approx(2 * room)
