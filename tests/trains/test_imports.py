"""Cases of the stages of REXS files: pairs, planetary stages and the gearbox of parallel shafts."""

import math
from pathlib import Path

import pytest
from rexs_stage import MM, NONE, Gearbox, ParallelUnit, both_units
from rexs_units import ThreeStageUnit, planetary_unit

from femgear import cli
from femgear.case import text as case_text
from femgear.case.gear_set import planetary_set
from femgear.errors import CaseError, FemgearError
from femgear.exchange.rexs import read_model
from femgear.findings import DOUBT
from femgear.trains.imports import case_drafts
from femgear.trains.reading import parse_case, read_case
from femgear.trains.registry import train_of


def drafts_of(box, tmp_path, **options):
    model = read_model(box.write(tmp_path / "unit.rexs"))
    return {one.suffix: one for one in case_drafts(model, "unit.toml", **options)}, model.findings


def written(box, tmp_path, monkeypatch, *more):
    """Run femgear import in a folder; what it printed decides nothing."""
    monkeypatch.chdir(tmp_path)
    box.write(Path("unit.rexs"))
    assert cli.main(["import", "unit.rexs", "-o", "unit.toml", *more]) == 0


def test_two_parallel_stages_are_one_gearbox(tmp_path, monkeypatch, capsys):
    written(ParallelUnit(), tmp_path, monkeypatch)
    told = capsys.readouterr()
    assert "written: unit.toml" in told.out and "unit_51" not in told.out
    assert "no load on shaft 30" in told.err
    box = read_case("unit.toml")
    assert (box.train, len(box.shaft), len(box.bearing)) == ("gearbox", 3, 6)
    flow = train_of(box).describe_case(box)[1]
    assert [row[:2] for row in flow.rows] == [("shaft 10", "1500"), ("shaft 20", "-750"), ("shaft 30", "250")]
    first, second = (parse_case(case_text.write(stage.teeth)) for stage in box.pair)
    assert (first.operation.torque, second.operation.torque) == (100.0, pytest.approx(200.0))
    assert planetary_set(second).centre_distance == 0.12 and second.gear_2.teeth == 60
    # the bearings of the gearbox hold the gears
    assert first.gear_1.bearing_stiffness is None


def test_planetary_and_parallel_stages(tmp_path):
    found, findings = drafts_of(both_units(), tmp_path)
    assert list(found) == [""]
    case = parse_case(found[""].text)
    assert [one.name for one in (*case.pair, *case.planetary)] == ["stage 50051", "stage 50052", "stage 9"]
    assert any("is one rigid body" in one.text and one.severity == DOUBT for one in findings)


def test_one_stage_of_several(tmp_path):
    found, findings = drafts_of(both_units(), tmp_path, stage="50052")
    assert list(found) == [""] and parse_case(found[""].text).gear_2.teeth == 60
    assert findings[0].severity == DOUBT
    assert all(words in findings[0].text for words in ("not taken", "planetary_stage 9", "25/50"))
    with pytest.raises(CaseError, match="E-CHOICE") as caught:
        drafts_of(both_units(), tmp_path, stage="7")
    assert caught.value.key == "--stage" and "planetary_stage 9" in caught.value.limit


def test_a_stage_that_makes_no_case_is_said_first(tmp_path):
    box = ParallelUnit()
    box.components[44]["attributes"]["tip_diameter"] = (172.0, "mm")
    found, findings = drafts_of(box, tmp_path)
    assert list(found) == ["_51"]
    assert "cylindrical_stage 52 20/60" in findings[0].text and "not taken" in findings[0].text
    # with the attribute of the file that stands in the way, and its value
    assert "cylindrical_gear 44, tip_diameter" in findings[0].text and " 172 mm: " in findings[0].text
    bevel = ParallelUnit()
    bevel.components[52]["type"] = "bevel_stage"
    found, findings = drafts_of(bevel, tmp_path)
    assert list(found) == ["_51"] and "bevel_stage 52" in findings[0].text
    for one, tip in ((41, 44.0), (43, 52.0)):
        box.components[one]["attributes"]["tip_diameter"] = (tip, "mm")
    with pytest.raises(FemgearError, match="E-TIP") as caught:
        drafts_of(box, tmp_path)
    assert caught.value.file == str(tmp_path / "unit.rexs")


def test_load_cases_of_pairs(tmp_path):
    case = """<load_case id="{0}">
    <component id="10"><attribute id="rotational_speed" unit="1 / min">{1}</attribute></component>
    <component id="5"><attribute id="torque_around_u_axis" unit="N m">{2}</attribute></component>
    </load_case>"""
    spectrum = "".join(case.format(*one) for one in ((1, 1000, 50), (2, 3000, 80)))
    path = tmp_path / "unit.rexs"
    text = ParallelUnit().xml().replace("</model>", f'<load_spectrum id="1">{spectrum}</load_spectrum></model>')
    path.write_text(text, encoding="utf-8")
    model = read_model(path)
    second = parse_case(case_drafts(model, "u.toml", stage="52", load_case=2)[0].text)
    assert second.operation.torque == pytest.approx(160.0)
    assert [one * 30 / math.pi for one in second.operation.speeds] == pytest.approx([1500.0])
    assert any(one.key == "52: operation" and "1: 500 rpm, 100 N m" in one.text for one in model.findings)
    with pytest.raises(CaseError, match="no such load case"):
        case_drafts(read_model(path), "u.toml", load_case=3)


def test_files_that_are_there_are_kept(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("unit_52.toml").write_text("mine", encoding="utf-8")
    # without a torque there is no gearbox of both
    ParallelUnit().set(5, torque_around_u_axis=None).write(Path("unit.rexs"))
    assert cli.main(["import", "unit.rexs", "-o", "unit.toml"]) == 2
    assert "unit_52.toml" in capsys.readouterr().err and not Path("unit.toml").exists()
    assert Path("unit_52.toml").read_text(encoding="utf-8") == "mine"


def test_a_planetary_stage_takes_what_flows_through_the_unit(tmp_path):
    """The torque acts on a spur pinion whose wheel sits on the shaft of the sun."""
    box = Gearbox("1.4")
    box.relations.remove(("assembly", {"assembly": 34, "part": 38}))
    del box.components[34]["attributes"]["rotational_speed"]
    box.add(700, "shaft", rotational_speed=(-3000.0, "1 / min"))
    box.relate("assembly", assembly=700, part=38)
    ParallelUnit.wheel(box, 701, 700, 20, 3.0, 30.0, 0.0)
    ParallelUnit.wheel(box, 702, 34, 40, 3.0, 30.0, 80.0)
    ParallelUnit.mesh(box, 710, 701, 702, 90.0, 0.0)
    box = box.set(38, torque_around_u_axis=(-100.0, "N m"))
    operation, pair = (parse_case(drafts_of(box, tmp_path, stage=one)[0][""].text).operation for one in ("9", "710"))
    assert operation.input == "sun" and operation.torque == pytest.approx(200.0)
    assert operation.speeds[0] * 30 / math.pi == pytest.approx(1500.0)
    assert pair.torque == pytest.approx(100.0)


def test_ids_are_no_paths(tmp_path, monkeypatch):
    box = ParallelUnit()
    names = {51: "../51", 52: "/x\\y:52", 41: "a gear!", 12: "a/b", 13: "a_b", 5: "\u00fc" * 60}
    box.components = {names.get(id, id): one for id, one in box.components.items()}
    box.relations = [(type, {role: names.get(id, id) for role, id in roles.items()}) for type, roles in box.relations]
    written(box, tmp_path, monkeypatch)
    assert {path.name for path in tmp_path.iterdir()} == {"unit.rexs", "unit.toml"}
    box = read_case("unit.toml")
    assert [one.name for one in box.pair] == ["stage ___51", "stage _x_y_52"]
    assert {"bearing a_b", "bearing a_b-2"} <= {one.name for one in box.bearing}


def test_ends_beside_the_flank_are_left_out(tmp_path):
    box = Gearbox()
    at = {
        "diameter_where_profile_crowning_root_is_specified": (60.0, "mm"),
        "diameter_where_profile_crowning_tip_is_specified": (90.0, "mm"),
    }
    box.add(9999, "profile_crowning", profile_crowning_at_tip=(5.0, "mum"), profile_crowning_at_root=(5.0, "mum"), **at)
    for flank in (2053, 3053):
        box.relate("reference", origin=flank, referenced=9999)
    found, findings = drafts_of(box, tmp_path)
    (part,) = parse_case(found[""].text).sun.modifications
    assert part.amount == 5e-6 and part.start_diameter is None and part.end_diameter is None
    told = [one for one in findings if one.key == "sun.modifications"]
    assert len(told) == 1 and told[0].severity == DOUBT and "taken to the end of the flank" in told[0].text
    # a relief that starts beside it is none
    box.components[9999] = {
        "type": "tip_relief",
        "name": "",
        "attributes": {"tip_relief_depth": (5.0, "mum"), "tip_relief_datum_diameter": (90.0, "mm")},
    }
    found, findings = drafts_of(box, tmp_path)
    assert not parse_case(found[""].text).sun.modifications
    assert any("tip relief is not taken" in one.text for one in findings)


def test_too_many_stages_and_load_cases_are_refused(tmp_path):
    box = ParallelUnit()
    for number in range(50):
        box.add(100 + number, "cylindrical_stage")
    with pytest.raises(CaseError, match="52 stages are too many"):
        drafts_of(box, tmp_path)
    path = tmp_path / "unit.rexs"
    spectrum = '<load_spectrum id="1">' + '<load_case id="1"/>' * 1001 + "</load_spectrum></model>"
    path.write_text(ParallelUnit().xml().replace("</model>", spectrum), encoding="utf-8")
    with pytest.raises(CaseError, match="1001 load cases are too many"):
        read_model(path)


def test_names_without_an_ending(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ParallelUnit().write(Path("unit.rexs"))
    assert cli.main(["import", "unit.rexs", "-o", "unit"]) == 0
    assert len(read_case("unit").pair) == 2


BAD_BEARINGS = {
    "too many balls": {
        "number_of_rolling_elements": (100, NONE),
        "diameter_of_rolling_element": (9.0, MM),
        "pitch_diameter": (25.0, MM),
    },
    "a bore below zero": {"inner_diameter": (-5.0, MM)},
    "a rating below zero": {"dynamic_capacity": (-3.0, "kN")},
    "a clearance of 50 mm": {"radial_bearing_clearance": (50.0, MM)},
    "a unit that is none": {"radial_stiffness": (5.0, "furlong")},
    "no number": {"radial_stiffness": ("stiff", "N / m")},
}


@pytest.mark.parametrize("what", BAD_BEARINGS)
def test_a_bearing_that_cannot_be_taken_leaves_the_gearbox_whole(tmp_path, what):
    box = ThreeStageUnit()
    box.components[32]["attributes"] |= BAD_BEARINGS[what]
    found, findings = drafts_of(box, tmp_path)
    case = parse_case(found[""].text)
    assert case.train == "gearbox" and len(case.bearing) == 9
    # said before all else, with what stands in its place: it takes thrust one way, as that of the file
    assert findings[0].text.startswith("rolling_bearing_with_catalog_geometry 32 is not taken: ")
    assert "a bearing of 92000000 N/m stands in its place" in findings[0].text
    (bearing,) = (one for one in case.bearing if one.radial is not None)
    assert (bearing.radial, bearing.axial, bearing.axial_sense, bearing.estimated) == (92e6, 92e6, "negative", True)
    assert sum("is not taken" in one.text for one in findings) == 1


def test_two_bad_bearings_are_both_replaced(tmp_path):
    box = ThreeStageUnit()
    box.components[32]["attributes"] |= BAD_BEARINGS["too many balls"]
    box.components[51]["attributes"] |= BAD_BEARINGS["no number"]
    found, findings = drafts_of(box, tmp_path)
    assert parse_case(found[""].text).train == "gearbox"
    assert sum("stands in its place" in one.text for one in findings) == 2


def test_places_that_the_file_does_not_have_are_named(tmp_path):
    box = ThreeStageUnit()
    del box.components[32]["attributes"]["u_coordinate_on_shaft_inner_side"]
    found, findings = drafts_of(box, tmp_path)
    case = parse_case(found[""].text)
    assert case.train == "gearbox" and case.bearing[2].position == 0.0
    (told,) = (one for one in findings if one.key == "seats")
    assert "catalog_geometry 32, u_coordinate_on_shaft_inner_side: the attribute is missing" in told.text
    # of a gear: it does not face its mate
    box = ThreeStageUnit()
    del box.components[38]["attributes"]["u_coordinate_on_shaft"]
    found, findings = drafts_of(box, tmp_path)
    assert "" not in found
    texts = " ".join(one.text for one in findings)
    assert "cylindrical_gear 38, u_coordinate_on_shaft: the attribute is missing" in texts
    assert "do not face each other along their axes, found middles at z = " in texts


def test_bearings_that_nothing_joins_are_told(tmp_path):
    box = ThreeStageUnit()
    box.relations = [one for one in box.relations if not (one[0] == "side" and one[1]["assembly"] == 32)]
    found, findings = drafts_of(box, tmp_path)
    assert len(parse_case(found[""].text).bearing) == 8
    assert any("bearing 32: no relation of the type side" in one.text for one in findings)


@pytest.mark.parametrize(("teeth", "code"), [(60, "E-ASSEMBLY"), (610, "E-CENTRE-DISTANCE")])
def test_teeth_of_a_ring_that_do_not_suit_are_named(tmp_path, teeth, code):
    box = planetary_unit().set(58, number_of_teeth=(teeth, NONE))
    with pytest.raises(FemgearError) as error:
        drafts_of(box, tmp_path)
    assert error.value.code == code
    wanted = (
        f"check number_of_teeth of ring_gear 58: {teeth}, where a sun of 17 and planets of 22 teeth without profile"
    )
    assert error.value.remedy.startswith(wanted) and "ask for 61" in error.value.remedy
