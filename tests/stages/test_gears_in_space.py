"""Pairs and sets in space: teeth in gaps, hands of helices, modes of the files."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.path import Path as Outline

from femgear.case.gear_set import planetary_set
from femgear.contact.flank_pairs import tooth_numbers
from femgear.gears.faults import MissingTooth
from femgear.report.solid import SOLID
from femgear.report.space import SPACE
from femgear.stages.gears_in_space import gear_bodies, gear_hands, teeth_zero, tooth_angles, write_gears_in_space
from femgear.stages.protocol import Drawn
from femgear.trains.reading import read_case

CASES = Path(__file__).parents[2] / "cases"


def overlap(body, mate) -> float:
    """Share of the points of the teeth of a gear that lie in the material of its mate, at mid-width."""

    def outline(gear):
        turns = gear.angle + 0.5 * gear.twist + 2.0 * np.pi * np.arange(gear.teeth) / gear.teeth
        turned = [gear.section @ np.array([[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]]) for a in turns]
        return np.vstack(turned) + gear.axis

    inside = Outline(outline(mate)).contains_points(outline(body))
    return float((~inside if mate.internal else inside).mean())


@pytest.mark.parametrize("name", ("planetary_27_40_108", "spur_pair", "helical_30_20_70"))
def test_teeth_stand_in_the_gaps_of_their_mates(name):
    gears = planetary_set(read_case(CASES / f"{name}.toml"))
    bodies = list(gear_bodies(gears, 0.2))
    by_gear = [[body for body in bodies if body.stage == number] for number in range(len(gears.gears))]
    for first, second in gears.mates:
        for copy in range(max(len(by_gear[first]), len(by_gear[second]))):
            body, mate = (by_gear[number][copy if gears.repeated[number] else 0] for number in (first, second))
            turned = replace(body, angle=body.angle + np.pi / body.teeth)
            # edges of hollow flanks are chords, into which points of contact reach
            assert overlap(body, mate) < 0.012 < 0.015 < overlap(turned, mate), (body.name, mate.name)
            hand = 1.0 if mate.internal else -1.0
            assert mate.twist * mate.teeth / mate.ends[1] == pytest.approx(
                hand * body.twist * body.teeth / body.ends[1]
            )
    assert gear_hands(gears)[0] == 1.0 and len(tooth_angles(gears)) == len(gears.gears)


def test_modes_are_those_of_the_file_and_rigid_ones_are_left_out(tmp_path):
    case = read_case(CASES / "spur_pair.toml")
    shape = [[1.0, 0.5], [1.0, -2.0]]
    modes = xr.Dataset(
        {
            "frequency": ("mode", [0.0, 900.0]),
            "kind": ("mode", ["rigid", "rotational"]),
            "shape": (("dof", "mode"), shape),
        },
        {"dof": ["gear 1: rotation", "gear 2: rotation"]},
    )
    assert write_gears_in_space(Drawn(case, {"modes": modes}), tmp_path) == [SPACE]
    model = json.loads((tmp_path / SPACE).read_text(encoding="utf-8"))
    (motion,) = model["motions"]
    assert motion["title"] == "mode 2: 900 Hz, rotational"
    assert [body["member"] for body in model["bodies"]] == ["gear 1", "gear 2"]
    assert motion["turned"]["unit"] * 32767 == pytest.approx(2.0)


def test_what_is_drawn_with_its_static_state_is_not_drawn_twice(tmp_path):
    (tmp_path / SOLID).touch()
    assert write_gears_in_space(Drawn(read_case(CASES / "spur_pair.toml"), {}), tmp_path) == []


@pytest.mark.parametrize("name", ("planetary_27_40_108", "spur_pair", "helical_30_20_70"))
def test_drawn_teeth_have_the_numbers_that_mesh(name):
    gears = planetary_set(read_case(CASES / f"{name}.toml"))
    angles, zero = tooth_angles(gears), teeth_zero(gears)
    first, second = tooth_numbers(gears, np.zeros((len(gears.meshes), 1), int))
    for mesh, pair in zip(gears.meshes, np.hstack([first, second]), strict=True):
        turned = []
        for place, (body, tooth) in enumerate(zip(mesh.bodies, pair.tolist(), strict=True)):
            number, copy = gears.bodies[body].gear, gears.bodies[body].copy
            gear = gears.gears[number]
            at = angles[number][copy] + (tooth + zero[number][copy]) * gear.pitch_angle
            opposite = place == 1 and not gear.internal
            away = np.angle(np.exp(1j * (at - mesh.angle - (np.pi if opposite else 0.0))))
            turned.append(gears.senses[number] * away / gear.pitch_angle)
        # the pair that touches at the pitch point at some position is as far from there on both gears
        assert turned[0] == pytest.approx(turned[1], abs=0.75)


def test_short_teeth_are_drawn_in_their_places():
    gears = planetary_set(read_case(CASES / "planetary_27_40_108.toml"))
    bodies = {body.name: body for body in gear_bodies(gears, 0.0, [MissingTooth(1, 1, 7, None)])}
    (short,) = bodies["planet 2"].short
    assert short == ((7 + teeth_zero(gears)[1][1]) % 40, gears.planet.root_radius)
    assert not bodies["planet 1"].short
    assert not bodies["sun"].short
    # without words no tooth has a mark
    assert not bodies["planet 2"].marked
    said = {body.name: body for body in gear_bodies(gears, 0.0, [MissingTooth(1, 1, 7, None)], ["missing"])}
    assert said["planet 2"].marked == ((short[0], "missing"),) and not said["planet 1"].marked
