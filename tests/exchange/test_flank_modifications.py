"""Modifications of flanks out of REXS files and into them."""

import math
from pathlib import Path

import numpy as np
import pytest
from rexs_stage import MM, NONE, Gearbox

from femgear.case.gear_set import planetary_set
from femgear.case.teeth import flank_form
from femgear.exchange.flank_modifications import READ
from femgear.exchange.planetary_stage import case_tables, stage_model
from femgear.exchange.rexs import model_text, read_model
from femgear.findings import DOUBT
from femgear.gears.modifications import form_deviation, lead_deviation
from femgear.trains.drafts import draft_text
from femgear.trains.reading import parse_case, read_case, with_values

CASES = Path(__file__).parents[2] / "cases"
UM = "mum"
SUN_BASE = 0.034 * math.cos(math.radians(20.0))


def with_parts(*parts, gear=53, sides=(2000, 3000)):
    """The gearbox with modifications of type and attributes on flanks of a gear, by default of the sun."""
    box = Gearbox()
    for number, (kind, attributes) in enumerate(parts):
        box.add(9000 + 10 * sides[0] + number, kind, **attributes)
        for side in sides:
            box.relate("reference", origin=side + gear, referenced=9000 + 10 * sides[0] + number)
    return box


def imported(box, tmp_path):
    """Model and case of a gearbox."""
    model = read_model(box.write(tmp_path / "stage.rexs"))
    return model, parse_case(draft_text(*case_tables(model), word="assumed"))


def tables_of(box, tmp_path, gear="sun"):
    model = read_model(box.write(tmp_path / "stage.rexs"))
    return case_tables(model)[0][gear].get("modifications", []), model.findings


def removed(case, roll=None, place=None, height=0.0, gear="sun", side="both"):
    """Material that is missing [m], at roll lengths or at places of the width [m]."""
    body = getattr(planetary_set(case), gear)
    form = flank_form(case, body, side)
    if roll is not None:
        return form_deviation(form, body, np.asarray(roll))
    return lead_deviation(form, body.face_width, np.asarray(place), height)


def test_crowning_of_profile_and_lead(tmp_path):
    box = with_parts(
        ("profile_crowning", {"profile_crowning_at_tip": (5.0, UM), "profile_crowning_at_root": (5.0, UM)}),
        (
            "helix_crowning",
            {"helix_crowning_amount_datum_face": (5.0, UM), "helix_crowning_amount_non_datum_face": (5.0, UM)},
        ),
    )
    model, case = imported(box, tmp_path)
    assert [one.kind for one in case.sun.modifications] == ["profile crowning", "lead crowning"]
    assert [one.amount for one in case.sun.modifications] == [5e-6, 5e-6]
    assert case.static.slices == 25 and not case.ring.modifications
    assert not [one for one in model.findings if "modifications" in one.key]


def test_amounts_that_differ_at_both_ends_are_there_at_both_ends(tmp_path):
    box = with_parts(
        ("profile_crowning", {"profile_crowning_at_tip": (8.0, UM), "profile_crowning_at_root": (2.0, UM)}),
        (
            "helix_crowning",
            {
                "helix_crowning_amount_datum_face": (6.0, UM),
                "helix_crowning_amount_non_datum_face": (2.0, UM),
                "coordinate_where_helix_crowning_is_specified_datum_face": (-25.0, MM),
                "coordinate_where_helix_crowning_is_specified_non_datum_face": (12.5, MM),
            },
        ),
    )
    case = imported(box, tmp_path)[1]
    gear = planetary_set(case).sun
    rolls = [gear.form_roll, 0.5 * (gear.form_roll + gear.tip_roll), gear.tip_roll]
    assert removed(case, rolls) == pytest.approx([2e-6, 0.0, 8e-6], abs=1e-15)
    # a parabola of 2 um at a quarter of the width has 8 um at its end
    assert removed(case, place=[-0.025, 0.0, 0.025]) == pytest.approx([6e-6, 0.0, 8e-6], abs=1e-15)


@pytest.mark.parametrize("shape", ["linear", "parabolic", "circular", None])
def test_reliefs_by_diameters_and_by_lengths(tmp_path, shape):
    shapes = {} if shape is None else {"shape_of_relief": (shape, NONE)}
    tip = math.sqrt(0.038**2 - SUN_BASE**2)
    start = 2e3 * math.hypot(tip - 2e-3, SUN_BASE)
    sizes = {"tip_diameter": (76.0, MM)}
    found = []
    for place in ({"tip_relief_datum_diameter": (start, MM)}, {"tip_relief_datum_length": (2.0, MM)}):
        box = with_parts(("tip_relief", {"tip_relief_depth": (12.0, UM), **place, **shapes})).set(53, **sizes)
        case = imported(box, tmp_path)[1]
        power = 2.0 if shape in ("parabolic", "circular") else 1.0
        found.append(removed(case, [tip - 3e-3, tip - 2e-3, tip - 1e-3, tip]))
        assert found[-1] == pytest.approx([0.0, 0.0, 12e-6 * 0.5**power, 12e-6], abs=1e-12)
    root = {
        "root_relief_depth": (7.0, UM),
        "root_relief_datum_diameter": (68.0, MM),
        "root_relief_evaluation_reference": (66.0, MM),
    }
    case = imported(with_parts(("root_relief", root)), tmp_path)[1]
    rolls = [math.sqrt(r**2 - SUN_BASE**2) for r in (0.034, 0.033)]
    assert removed(case, rolls) == pytest.approx([0.0, 7e-6], abs=1e-12)


def test_end_reliefs_of_one_end_and_of_both(tmp_path):
    def end(face, depth, length, shape="parabolic"):
        return f"end_relief_{face}", {
            f"end_relief_depth_{face}": (depth, UM),
            f"end_relief_length_{face}": (length, MM),
            "shape_of_relief": (shape, NONE),
        }

    both = imported(with_parts(end("datum_face", 9, 4), end("non_datum_face", 9, 4)), tmp_path)[1]
    assert [one.kind for one in both.sun.modifications] == ["end relief"]
    assert removed(both, place=[-0.025, -0.023, 0.0, 0.025]) == pytest.approx([9e-6, 2.25e-6, 0, 9e-6])
    one = imported(with_parts(end("datum_face", 9, 4), end("non_datum_face", 6, 3, "linear")), tmp_path)[1]
    assert [part.kind for part in one.sun.modifications] == ["measured lead"]
    places = [-0.025, -0.023, 0.0, 0.0235, 0.025]
    assert removed(one, place=places) == pytest.approx([9e-6, 2.25e-6, 0, 3e-6, 6e-6], abs=1e-9)
    # the datum face at the other end
    box = with_parts(end("datum_face", 9, 4)).set(53, datum_face_orientation=("positive", NONE))
    other = imported(box, tmp_path)[1]
    assert removed(other, place=[-0.025, 0.025]) == pytest.approx([0.0, 9e-6])


def test_slopes_and_twist(tmp_path):
    box = with_parts(
        ("profile_slope", {"profile_slope": (4.0, UM)}),
        (
            "helix_slope",
            {"helix_slope": (6.0, UM), "helix_evaluation_start": (-20.0, MM), "helix_evaluation_end": (20.0, MM)},
        ),
        ("profile_twist", {"profile_twist": (3.0, UM)}),
    )
    model, case = imported(box, tmp_path)
    gear = planetary_set(case).sun
    # more material at the tip, at the non-datum face; evaluated over 40 of 50 mm
    assert removed(case, [gear.form_roll, gear.tip_roll]) == pytest.approx([2e-6, -2e-6])
    ends = removed(case, place=[-0.025, 0.025], height=0.0)
    assert ends == pytest.approx([3.75e-6, -3.75e-6])
    corner = removed(case, place=[0.025], height=0.5) - removed(case, place=[0.025], height=-0.5)
    assert corner == pytest.approx([-1.5e-6])
    told = [one for one in model.findings if "ISO 1328-1" in one.text]
    assert len(told) == 1 and told[0].severity == DOUBT


def test_flanks_that_differ(tmp_path):
    """The datum face lies at z < 0, from where the right flank of the sun carries under a positive torque."""
    box = with_parts(("profile_slope", {"profile_slope": (4.0, UM)}), sides=(2000,))
    for sign, count in ((1.0, 0), (-1.0, 1)):
        own = box.set(38, torque_around_u_axis=(sign * 1500.0, "N m"))
        tables, findings = tables_of(own, tmp_path)
        assert len(tables) == count
        assert [one.severity for one in findings if "differ" in one.text] == [DOUBT]
    # of planets each side has its own: the right one is that towards the sun
    box = Gearbox()
    box.add(9999, "profile_crowning", profile_crowning_at_tip=(5.0, UM), profile_crowning_at_root=(5.0, UM))
    for planet in range(240, 243):
        box.relate("reference", origin=3000 + planet, referenced=9999)
    tables, findings = tables_of(box, tmp_path, "planet")
    assert [(one["flank"], one["kind"]) for one in tables] == [("sun side", "profile crowning")]
    assert not [one for one in findings if "planets have different" in one.text]
    box.relations.pop()
    assert [one for one in tables_of(box, tmp_path, "planet")[1] if "planets have different" in one.text]


@pytest.mark.parametrize(
    ("kind", "attributes", "words"),
    [
        ("triangular_tip_relief", {"triangular_tip_relief_depth": (5.0, UM)}, "triangular_tip_relief"),
        ("topographical_modification", {}, "topographical_modification"),
        ("tip_relief", {"tip_relief_depth": (5.0, UM), "shape_of_relief": ("logarithmic", NONE)}, "logarithmic"),
        ("tip_relief", {"tip_relief_depth": (5.0, UM)}, "neither its diameter"),
        (
            "tip_relief",
            {
                "tip_relief_depth": (5.0, UM),
                "tip_relief_datum_diameter": (74.0, MM),
                "specify_tangential_transition": ("true", NONE),
            },
            "tangential transition",
        ),
    ],
)
def test_what_no_case_has_is_said(tmp_path, kind, attributes, words):
    _, findings = tables_of(with_parts((kind, attributes)), tmp_path)
    (told,) = [one for one in findings if one.key == "sun.modifications"]
    assert words in told.text and told.severity == DOUBT and findings[0] == told


ALL = [
    {"kind": "tip relief", "amount": "12 um", "start_diameter": "42.5 mm", "shape": "parabolic"},
    {"kind": "root relief", "amount": "5 um", "start_diameter": "40 mm", "end_diameter": "39.5 mm"},
    {"kind": "profile slope", "amount": "-3 um"},
    {"kind": "profile crowning", "amount": "4 um"},
    {"kind": "lead slope", "amount": "6 um"},
    {"kind": "lead crowning", "amount": "5 um"},
    {"kind": "end relief", "amount": "8 um", "length": "3 mm"},
    {"kind": "flank twist", "amount": "2 um"},
]


@pytest.mark.parametrize("gear", ["sun", "planet", "ring"])
def test_all_kinds_come_back_as_they_were(tmp_path, gear):
    case = read_case(CASES / "planetary_27_40_108.toml")
    body = getattr(planetary_set(case), gear)
    middle = math.hypot(0.5 * (body.form_roll + body.tip_roll), body.base_radius)
    end = math.hypot(0.8 * body.form_roll + 0.2 * body.tip_roll, body.base_radius)
    parts = [dict(one) for one in ALL]
    parts[0]["start_diameter"] = parts[1]["start_diameter"] = f"{2e3 * middle:.9g} mm"
    parts[1]["end_diameter"] = f"{2e3 * end:.9g} mm"
    if gear == "planet":
        parts[0]["flank"], parts[3]["flank"] = "sun side", "ring side"
    case = with_values(case, {f"{gear}.modifications": parts, "static.slices": 25})
    model = stage_model(case, "stage.rexs")
    assert not model.findings
    assert {one.type for one in model.components.values()} >= set(READ)
    path = tmp_path / "stage.rexs"
    path.write_text(model_text(model, "femgear", "0"), encoding="utf-8")
    again = parse_case(draft_text(*case_tables(read_model(path)), word="assumed"))
    roll = np.linspace(body.form_roll, body.tip_roll, 41)
    place = np.linspace(-0.5, 0.5, 41) * body.face_width
    for side in ("sun side", "ring side") if gear == "planet" else ("both",):
        for where in ({"roll": roll}, {"place": place, "height": 0.5}, {"place": place, "height": -0.5}):
            wanted = removed(case, gear=gear, side=side, **where)
            assert np.abs(wanted).max() > 1e-6
            assert removed(again, gear=gear, side=side, **where) == pytest.approx(wanted, abs=1e-11)


def test_what_rexs_has_no_form_for_is_said():
    part = {"kind": "tip relief", "amount": "12 um", "start_diameter": "42.5 mm", "power": 1.5}
    case = with_values(read_case(CASES / "planetary_27_40_108.toml"), {"sun.modifications": [part]})
    (told,) = stage_model(case, "stage.rexs").findings
    assert (told.key, told.code) == ("sun.modifications", "W-REXS") and "tip relief" in told.text
