"""Gears with several mates: an idler between two gears, and a gear that drives two."""

import copy

import numpy as np
import pytest
from small_gearbox import pair_tables

from femgear.gears.gear_steels import GEAR_STEELS
from femgear.stages.strength import rate_case
from femgear.trains.gearbox.shared_gears import shared_gears
from femgear.trains.gearbox.stages import solve_deflections
from femgear.trains.gearbox.strength import rated_stages
from femgear.trains.gearbox.tooth_life import stage_spectra
from femgear.trains.reading import read_case

pytestmark = pytest.mark.usefixtures("coarse_states")

STEEL = {"treatment": "case hardened steel", "hardness": 720}
LINES = GEAR_STEELS["case hardened steel"]
HOUR = 3600.0


def idler_tables(*torques: tuple[str, float], both: bool = False) -> dict:
    """Tables of 24, 36 and 24 teeth on three shafts; ``both`` has the torque enter on the middle one and leave on both.

    Load cases are torques with their shares at 1000 rpm of the first shaft.
    """
    tables = pair_tables(teeth=True) | {"deflection": {"slices": 1, "passes": 2}}
    first = tables["pair"][0]
    first["teeth"]["static"] = {"positions": 8, "flank_elements": 4}
    first["teeth"]["material"] |= STEEL
    third = {"name": "third", "axis": ["180 mm", "0 mm"], "part": [{"length": "90 mm", "outer_diameter": "30 mm"}]}
    tables["shaft"].append(third)
    for bearing in tables["bearing"][:2]:
        more = copy.deepcopy(bearing)
        tables["bearing"].append(more | {"shaft": "third", "name": {"A": "E", "B": "F"}[bearing["name"]]})
    second = copy.deepcopy(first) | {"name": "second", "shafts": ["output", "third"]}
    gears = second["teeth"]
    gears["gear_1"], gears["gear_2"] = gears["gear_2"], gears["gear_1"]
    tables["pair"].append(second)
    port = {"name": "brake", "shaft": "third", "position": "90 mm"}
    if both:
        tables["load"] = [
            {"name": "brake", "shaft": "input", "position": "0 mm"},
            {"name": "motor", "shaft": "output", "position": "0 mm"},
            port | {"name": "fan"},
        ]
        loads = [{"motor": torque, "fan": "40 N m"} for torque, _ in torques]
    else:
        tables["load"] = [{"name": "motor", "shaft": "input", "position": "0 mm"}, port]
        loads = [{"motor": torque} for torque, _ in torques]
    tables["operation"] = {
        "output": ["brake"],
        "load_case": [
            {"name": f"case {number}", "torque": load, "speed": {"input": "1000 rpm"}, "share": share}
            for number, (load, (_, share)) in enumerate(zip(loads, torques, strict=True))
        ],
    }
    return tables


@pytest.fixture(scope="module")
def idler():
    return solve_deflections(read_case(idler_tables(("400 N m", 0.25), ("-150 N m", 0.75))))


def test_gears_at_one_place_of_a_shaft_are_one_gear(idler):
    (gear,) = shared_gears(idler.case)
    assert (gear.shaft, gear.teeth, gear.places) == ("output", 36, (("stage", 1), ("second", 0)))
    assert [gear.pushes(state.model.flow) for state in idler.states] == [(-1, 1), (1, -1)]
    apart = idler_tables(("400 N m", 1.0))
    apart["pair"][1]["positions"] = ["60 mm", "60 mm"]
    assert not shared_gears(read_case(apart))


def ratings_of(state):
    """Root and flank safeties of the idler by its mates in a loaded state, without Y_M, by the contact alone."""
    pairs = []
    for stage, number in (("stage", 1), ("second", 0)):
        contact = state.contacts[stage]
        rated = rate_case(contact.case, torque=contact.result.sun_torque, face=contact.face_load_factor)
        pairs.append(rated.flanks[number])
    return pairs


def test_an_idler_bends_both_ways_and_each_flank_has_its_own_mate(idler):
    """By hand: Y_M 0.7 and one cycle a turn of the larger stress; flanks of forward and reversed load cases change."""
    spectra = {(rated.kind, rated.name): rated.spectrum for rated in stage_spectra(idler.states)}
    name = "output gear (stage, second)"
    root, front, back = spectra["root", name], spectra["flank", name], spectra["flank", f"{name}, back flank"]
    turns = HOUR * 1000.0 / 60.0 * 24 / 36 * np.array([0.25, 0.75])
    both = [ratings_of(state) for state in idler.states]
    bending = [max(1.0 / flank.root_safety for flank in flanks) / 0.7 for flanks in both]
    assert root.largest_ratio == pytest.approx(bending, rel=1e-12) and root.all_cycles == pytest.approx(turns)
    stands = LINES.root_life.cycles_at(np.array(bending))
    assert root.damage == pytest.approx(turns / stands, rel=1e-12)
    # the flank that the first mate presses forwards is pressed by the second one when the torque turns round
    pressed = [1.0 / both[0][0].contact_safety, 1.0 / both[1][1].contact_safety]
    assert front.largest_ratio == pytest.approx(pressed, rel=1e-12) and front.all_cycles == pytest.approx(turns)
    others = [1.0 / both[0][1].contact_safety, 1.0 / both[1][0].contact_safety]
    assert back.largest_ratio == pytest.approx(others, rel=1e-12)
    assert front.damage == pytest.approx(turns / LINES.contact_life.cycles_at(np.array(pressed)), rel=1e-12)
    # the gears at its sides keep their own spectra, the idler has none by its stages
    assert {"gear 1 of stage", "gear 2 of second"} <= {name for _, name in spectra}
    assert not {"gear 2 of stage", "gear 1 of second"} & {name for _, name in spectra}


def test_safeties_of_an_idler_have_the_factor_of_alternating_bending(idler):
    ratings, (first, second) = rated_stages(idler.states[0]), ratings_of(idler.states[0])
    assert ratings["stage"].flanks[1].root_safety == pytest.approx(0.7 * first.root_safety, rel=1e-12)
    assert ratings["second"].flanks[0].root_safety == pytest.approx(0.7 * second.root_safety, rel=1e-12)
    assert not ratings["stage"].flanks[0].reversed_bending
    data = idler.contents()
    assert "Y_M = 0.7 of output gear (stage, second)" in data.attrs["iso_notes"]


def test_a_gear_that_drives_two_has_the_damage_of_both_on_one_flank():
    result = solve_deflections(read_case(idler_tables(("300 N m", 1.0), both=True)))
    (state,), (gear,) = result.states, shared_gears(result.case)
    assert gear.pushes(state.model.flow) in ((1, 1), (-1, -1))
    spectra = {(rated.kind, rated.name): rated.spectrum for rated in stage_spectra(result.states)}
    turns, flanks = HOUR * 1000.0 / 60.0 * 24 / 36, ratings_of(state)
    for kind, line in (("root", LINES.root_life), ("flank", LINES.contact_life)):
        spectrum, safety = spectra[kind, gear.name], "root_safety" if kind == "root" else "contact_safety"
        stands = line.cycles_at(np.array([1.0 / getattr(flank, safety) for flank in flanks]))
        assert spectrum.damage == pytest.approx([(turns / stands).sum()], rel=1e-12)
        assert spectrum.all_cycles == pytest.approx([2.0 * turns])
    assert ("flank", f"{gear.name}, back flank") not in spectra
