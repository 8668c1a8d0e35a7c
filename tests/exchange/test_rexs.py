"""REXS files: planetary stages in and out, and files that are refused."""

import math
import os
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest
from rexs_stage import DEG, MM, NONE, Gearbox
from steels import NO_STEELS

from femgear import cli
from femgear.case.gear_set import planetary_set
from femgear.case.sections import face_width, gear_material
from femgear.errors import CaseError, FemgearError
from femgear.exchange.planetary_stage import case_tables, named, stage_model
from femgear.exchange.rexs import MOST_BYTES, model_text, read_model
from femgear.trains.drafts import draft_text
from femgear.trains.reading import parse_case, read_case, with_values

CASES = Path(__file__).parents[2] / "cases"
IRON_RING = {
    "ring.material.youngs_modulus": "110 GPa",
    "ring.material.density": "7100 kg/m^3",
    "ring.material.root_stress_limit": "140 MPa",
    "planet.material.contact_stress_limit": "1400 MPa",
    "planet.face_width": "27 mm",
    "ring.face_width": "24 mm",
}
STRENGTH = {"material.root_stress_limit": "430 MPa", "material.contact_stress_limit": "1.4 GPa"}
OWN = os.environ.get("FEMGEAR_REXS")  # a file of FVA's example, for whoever has it


def imported(path, stage=None):
    """Text and case of the planetary stage of a file."""
    model = read_model(path)
    tables = case_tables(model, stage)
    with named(model, stage):
        text = draft_text(*tables, word="assumed")
    return text, parse_case(text)


def check_numbers(case):
    """What is printed in the file and what follows from it in closed form."""
    gears, alpha = planetary_set(case), math.radians(20.0)
    assert (gears.sun.teeth, gears.planet.teeth, gears.ring.teeth, gears.n_planets) == (17, 22, 61, 3)
    assert case.module == 4e-3 and case.set.face_width == 0.05 and gears.centre_distance == 0.078
    assert case.pressure_angle == alpha
    assert [g.profile_shift for g in gears.gears] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    assert [2e3 * g.reference_radius for g in gears.gears] == pytest.approx([68.0, 88.0, 244.0], rel=1e-14)
    assert [2e3 * g.rim_radius for g in gears.gears] == pytest.approx([34.0, 58.0, 280.0], rel=1e-14)
    assert [2e3 * g.root_radius for g in gears.gears[:2]] == pytest.approx([58.0, 78.0], rel=1e-12)
    # ISO 21771, eq. 74: the sun's flank is undercut by its tool, which takes nothing from this path
    roll = sum(math.sqrt((r + 4.0) ** 2 - (r * math.cos(alpha)) ** 2) for r in (34.0, 44.0))
    ratio = (roll - 78.0 * math.sin(alpha)) / (math.pi * 4.0 * math.cos(alpha))
    assert gears.contact_ratio_sun_planet == pytest.approx(ratio, rel=1e-3)
    assert case.material.youngs_modulus == 210e9 and case.material.density == pytest.approx(7850.0)
    operation = case.operation
    assert (operation.input, operation.fixed) == ("sun", "ring")
    assert operation.torque * operation.speeds[0] == pytest.approx(250e3, rel=1e-9)  # 250 kW at 1500 rpm


@pytest.mark.parametrize(
    ("suffix", "version", "addendum"),
    [
        ("rexs", "1.1", None),
        ("rexsj", "1.1", 0.9),
        ("rexsz", "1.1", 0.9),
        ("rexs", "2.0", 0.9),
        ("rexs", "1.7", 0.9),
    ],
)
def test_a_stage_of_every_form_and_version(tmp_path, suffix, version, addendum):
    box = Gearbox(version, addendum=addendum)
    text, case = imported(box.write(tmp_path / f"stage.{suffix}"))
    # where nothing gives the height of the ring's teeth it is that of the rack
    assert case.ring.rack and case.ring.rack.addendum == (addendum or 1.0)
    check_numbers(case)
    assumed = {line.split(" = ")[0] for line in text.splitlines() if "# assumed" in line}
    assert {"mass", "inertia", "addendum"} <= assumed
    assert not {"bearing_stiffness", "support_stiffness"} & assumed
    assert not {"teeth", "module", "face_width", "dedendum", "torque", "speeds", "bore_radius"} & assumed
    assert text.count("rigid: 2 bearings of 1e+20 N/m in the file") == 3
    # 10,000 times 20 N/(mm um) times the width, which moves natural frequencies by less than 0.1 %
    rigid = [case.planet.bearing_stiffness, case.sun.support_stiffness, case.carrier.support_stiffness]
    assert rigid == pytest.approx([1e4 * 20e9 * 0.05 * 210 / 206] * 3, rel=1e-2)
    assert "no play at the distance of the file, hence the profile shift of sun and ring" in text
    one = box.set(280, radial_stiffness=(2e20, "N / m")).write(tmp_path / f"one.{suffix}")
    assert "rigid: 1 bearing of 2e+20 N/m, 1 bearing of 1e+20 N/m in the file" in imported(one)[0]
    # one rigid bearing beside a soft one holds its member
    soft = box.set(280, radial_stiffness=(1e8, "N / m")).write(tmp_path / f"soft.{suffix}")
    assert imported(soft)[1].planet.bearing_stiffness == case.planet.bearing_stiffness


@pytest.mark.skipif(OWN is None, reason="FEMGEAR_REXS names no file of FVA's example")
def test_the_published_file():
    check_numbers(imported(OWN)[1])


@pytest.mark.slow
def test_an_imported_stage_runs_through(tmp_path):
    from femgear import solve

    coarse = {
        "static.positions": 12,
        "static.flank_elements": 8,
        "runup.count": 0,
        "dynamics.mesh_harmonics": 4,
    }
    case = with_values(imported(Gearbox().write(tmp_path / "stage.rexs"))[1], coarse)
    found = solve(case)
    assert {"static", "modes", "dynamics", "housing"} <= found.keys()
    # helical flanks aside, the pitch-point stiffness is what ISO 6336-1 expects within its usual spread
    k = found["static"].dataset()["mesh_stiffness"].sel(mesh="sun-planet 1").mean()
    assert 0.7 < float(k) / (20e9 * 0.05) < 1.3
    assert np.all(found["dynamics"].response.converged)


def test_what_is_not_used_is_told(tmp_path):
    model = read_model(Gearbox().write(tmp_path / "stage.rexs"))
    case_tables(model)
    unused = dict(line.split(": ", 1) for line in model.unused())
    assert unused["lubricant (1)"] == "density_at_15_degree_celsius"
    assert unused["switchable_coupling (1)"] == "rotational_stiffness"
    assert not any(line.startswith(("cylindrical_gear ", "material ", "shaft_section ")) for line in unused)


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("planetary_27_40_108", {}),
        ("planetary_27_40_108", {"planet.rack": {"root_radius": 0.26}, "ring.cutter_profile_shift": 0.1}),
        ("planetary_27_40_108", {"operation.input": "carrier", "operation.torque": "-80 N m"}),
        ("planetary_27_40_108", {"operation.input": "ring", "operation.fixed": "carrier"}),
        ("planetary_27_40_108", {"set.planet_angles": ["0 deg", "120 deg", "245.3333333333333 deg"]}),
        ("planetary_27_40_108", {**NO_STEELS, "sun.tip_diameter": "44.9 mm", **STRENGTH}),
        ("planetary_27_40_108", IRON_RING),
        ("helical_30_20_70", {}),
    ],
)
def test_a_case_comes_back(tmp_path, name, changes):
    case = with_values(read_case(CASES / f"{name}.toml"), changes)
    path = tmp_path / "stage.rexs"
    path.write_text(model_text(stage_model(case, path.name), "femgear", "0"), encoding="utf-8")
    back = imported(path)[1]
    gears, same = planetary_set(case), planetary_set(back)
    for one, other in zip(gears.gears, same.gears, strict=True):
        assert (one.teeth, one.internal, one.cutter is None) == (
            other.teeth,
            other.internal,
            other.cutter is None,
        )
        for key in ("module", "profile_shift", "tip_radius", "root_radius", "form_radius", "rim_radius"):
            assert getattr(one, key) == pytest.approx(getattr(other, key), rel=1e-9, abs=1e-12), key
    assert same.centre_distance == pytest.approx(gears.centre_distance, rel=1e-11)
    assert same.planet_angles == pytest.approx(gears.planet_angles, abs=1e-9)
    for gear in case.gear_names:
        assert gear_material(back, gear) == gear_material(case, gear)
        assert face_width(back, gear) == pytest.approx(face_width(case, gear), rel=1e-12)
    assert (back.operation.input, back.operation.fixed) == (case.operation.input, case.operation.fixed)
    assert back.operation.torque == pytest.approx(case.operation.torque, rel=1e-11)
    assert back.operation.speeds == pytest.approx(case.operation.speeds, rel=1e-11)
    for member, key in (("planet", "bearing"), ("sun", "support"), ("carrier", "support")):
        given = getattr(getattr(case, member), f"{key}_stiffness")
        assert getattr(getattr(back, member), f"{key}_stiffness") == pytest.approx(given, rel=1e-9)


def test_estimates_come_back_as_such(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    box = Gearbox()
    for bearing in (36, 37, 59, 60, *range(280, 283), *range(290, 293)):
        box = box.set(bearing, radial_stiffness=None)
    box.write(Path("stage.rexs"))
    assert cli.main(["import", "stage.rexs", "-o", "case.toml"]) == 0
    assert cli.main(["rexs", "case.toml", "-o", "back.rexs"]) == 0
    assert cli.main(["import", "back.rexs", "-o", "again.toml"]) == 0
    first, again = (
        {(line.split(" = ")[0], line.split("  #")[0]): line for line in Path(name).read_text().splitlines()}
        for name in ("case.toml", "again.toml")
    )
    kept = [one for one in first if one[0] in ("title", "bearing_stiffness", "support_stiffness")]
    assert len(kept) == 3 and all(one in again for one in kept)
    assert all("# assumed" in again[one] for one in kept if one[0] != "title")


def test_other_endings_are_not_written(tmp_path, capsys):
    for name in ("back.rexsj", "back.rexsz", "back"):
        assert cli.main(["rexs", str(CASES / "planetary_27_40_108.toml"), "-o", str(tmp_path / name)]) == 2
        said = capsys.readouterr().err
        assert "E-OUTPUT" in said and name in said and ".rexs\n" in said and not (tmp_path / name).exists()


FURLONGS = {id: {"normal_module": (4.0, "furlong")} for id in (53, 58, 240, 241, 242)}
OUTWARDS = {id: {"center_distance": (-78.0, MM)} for id in (*range(210, 213), *range(220, 223))}


@pytest.mark.parametrize(
    ("changes", "code", "keys"),
    [
        (FURLONGS, "E-RANGE", ["cylindrical_gear 53, normal_module (sun.module)", "ring.outer_radius"]),
        (OUTWARDS, "E-RANGE", ["cylindrical_stage 210, center_distance (set.centre_distance)"]),
        ({210: OUTWARDS[210]}, "E-REXS", ["cylindrical_stage 210, center_distance"]),
        ({53: {"number_of_teeth": (-17, NONE)}}, "E-RANGE", ["cylindrical_gear 53, number_of_teeth (sun.teeth)"]),
        ({53: {"number_of_teeth": (18, NONE)}}, "E-ASSEMBLY", ["set.planets"]),
        ({86: {"density": (7850.0, "kg / dm^3")}}, "E-RANGE", ["material 86, density (material.density)"]),
        (
            {38: {"torque_around_u_axis": (1e20, "N m")}},
            "E-RANGE",
            ["external_load 38, torque_around_u_axis (operation.torque)"],
        ),
    ],
)
def test_refusals_of_the_case_name_file_component_and_attribute(tmp_path, changes, code, keys):
    box = Gearbox()
    for id, attributes in changes.items():
        box = box.set(id, **attributes)
    path = box.write(tmp_path / "stage.rexs")
    with pytest.raises(FemgearError) as caught:
        imported(path)
    assert caught.value.code == code and caught.value.file == str(path)
    assert [one.key for one in caught.value.problems][: len(keys)] == keys
    assert {one.file for one in caught.value.problems} == {str(path)}


def two_stages():
    box = Gearbox()
    box.add(10, "planetary_stage")
    return box


def test_several_stages_are_listed(tmp_path):
    path = two_stages().write(tmp_path / "two.rexs")
    with pytest.raises(CaseError, match="2 planetary stages") as caught:
        imported(path)
    assert caught.value.code == "E-CHOICE" and "9 (planetary_stage [9]), 10" in caught.value.limit
    assert "--stage 9" in caught.value.remedy
    check_numbers(imported(path, "9")[1])
    for stage, code in (("11", "E-CHOICE"), ("10", "E-REXS")):
        with pytest.raises(CaseError, match=code):
            imported(path, stage)


def without_stage():
    box = Gearbox()
    box.components[9]["type"] = "cylindrical_stage"
    return box


def looped():
    box = Gearbox()
    box.relate("assembly", assembly=3, part=1)
    return box


def related_to_nothing():
    box = Gearbox()
    box.relate("assembly", assembly=1, part=777)
    return box


def second_sun():
    box = Gearbox()
    box.gear(500, 17, "cylindrical_gear", 501, 34.0, 83)
    box.add(510, "cylindrical_stage", center_distance=(78.0, MM))
    box.relate("assembly", assembly=9, part=510)
    box.relate("stage", stage=510, gear_1=500, gear_2=240)
    return box


@pytest.mark.parametrize(
    ("box", "code", "where"),
    [
        (Gearbox().set(53, normal_module=(4.0, None)), "E-UNIT", "cylindrical_gear 53, normal_module"),
        (Gearbox().set(53, normal_module=(4.0, "kg")), "E-UNIT", "cylindrical_gear 53, normal_module"),
        (Gearbox().set(53, normal_module=(4.0, "none")), "E-UNIT", "cylindrical_gear 53, normal_module"),
        (Gearbox().set(53, normal_module=("four", MM)), "E-UNIT", "cylindrical_gear 53, normal_module"),
        (Gearbox().set(53, normal_module=(-4.0, MM)), "E-REXS", "cylindrical_gear 53, normal_module"),
        (Gearbox().set(53, normal_module=("nan", MM)), "E-UNIT", "cylindrical_gear 53, normal_module"),
        (Gearbox().set(53, number_of_teeth=(17, MM)), "E-UNIT", "cylindrical_gear 53, number_of_teeth"),
        (Gearbox().set(53, number_of_teeth=("inf", NONE)), "E-UNIT", "cylindrical_gear 53, number_of_teeth"),
        (Gearbox().set(53, number_of_teeth=(17.5, NONE)), "E-REXS", "cylindrical_gear 53, number_of_teeth"),
        (
            Gearbox().set(53, number_of_teeth=(0, NONE)).set(38, torque_around_u_axis=None),
            "E-REXS",
            "cylindrical_gear 53, number_of_teeth",
        ),
        (Gearbox().set(53, number_of_teeth=None), "E-REXS", "cylindrical_gear 53, number_of_teeth"),
        (Gearbox().set(53, normal_module=(3.0, MM)), "E-REXS", "cylindrical_gear 53, normal_module"),
        (Gearbox().set(241, number_of_teeth=(23, NONE)), "E-REXS", "cylindrical_gear 240, number_of_teeth"),
        (Gearbox().set(53, helix_angle_reference_diameter=(9.0, DEG)), "E-REXS", "helix_angle"),
        (Gearbox().set(34, rotational_speed=(25.0, "Hz")), "E-UNIT", "shaft 34, rotational_speed"),
        (Gearbox().set(86, elastic_modulus=(210.0, "N / m")), "E-UNIT", "material 86, elastic_modulus"),
        (Gearbox("3.0"), "E-FORMAT", "version"),
        (Gearbox("1.8"), "E-FORMAT", "version"),
        (without_stage(), "E-REXS", "components"),
        (looped(), "E-REXS", "relation assembly"),
        (related_to_nothing(), "E-REXS", "relation assembly, part"),
        (second_sun(), "E-REXS", "planetary_stage 9"),
    ],
)
@pytest.mark.parametrize("suffix", ["rexs", "rexsj"])
def test_files_that_make_no_case(tmp_path, box, code, where, suffix):
    path = box.write(tmp_path / f"stage.{suffix}")
    with pytest.raises(CaseError) as caught:
        imported(path)
    error = caught.value
    assert error.code == code and where in error.key and error.file == str(path)
    assert error.limit or error.remedy


GOOD = Gearbox().xml()


@pytest.mark.parametrize(
    ("text", "code", "words"),
    [
        ('<!DOCTYPE x [<!ENTITY a "b">]>' + GOOD.split("\n", 1)[1], "E-FILE", "entities"),
        ('<!doctype model SYSTEM "file:///etc/passwd">' + GOOD.split("\n", 1)[1], "E-FILE", "entities"),
        (GOOD[:5000], "E-FILE", "neither XML"),
        ("nonsense", "E-FILE", "neither XML"),
        ("<html/>", "E-FILE", "html"),
        ("{}", "E-FILE", "JSON"),
        ('{"model": [1]}', "E-FORMAT", "version"),
        ('{"model": {"version": "1.1", "components": [3, {}]}}', "E-REXS", "id"),
        ("[" * 100_000, "E-FILE", "neither"),
        ('{"model": ' + "[" * 100_000, "E-FILE", "JSON"),
        ("<model version='1.1'/>", "E-REXS", "no planetary stage"),
        (GOOD.replace('<component id="58"', '<component id="53"'), "E-REXS", "twice"),
        (GOOD.replace('<component id="58"', "<component"), "E-REXS", "has no id"),
        (GOOD.replace('type="ring_gear"', ""), "E-REXS", "has no type"),
        ("<model version='1.1'>" + "<a>" * 200_000 + "</a>" * 200_000 + "</model>", "E-REXS", "no planetary"),
        ("", "E-FILE", "empty"),
    ],
)
def test_hostile_files(tmp_path, text, code, words):
    path = tmp_path / "stage.rexs"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(CaseError) as caught:
        imported(path)
    assert caught.value.code == code and words in str(caught.value) and str(path) in str(caught.value)


TORQUE = '<attribute id="torque_around_u_axis" unit="N m">'
CASES_TWICE = """<load_spectrum id="1"><load_case id="1"><component id="34" type="shaft">{}</component>
<component id="{}" type="shaft"/></load_case></load_spectrum></model>"""
SPEED = '<attribute id="rotational_speed" unit="1 / min">9</attribute>'
TORQUE_JSON = '{"id": "torque_around_u_axis"'
GOOD_JSON = Gearbox().json()


@pytest.mark.parametrize(
    ("text", "key"),
    [
        (GOOD.replace(TORQUE, f"{TORQUE}15</attribute>{TORQUE}"), "external_load 38, torque_around_u_axis"),
        (GOOD.replace("</model>", CASES_TWICE.format(SPEED, 34)), "load case 1, component 34"),
        (
            GOOD.replace("</model>", CASES_TWICE.format(2 * SPEED, 4)),
            "load case 1, component 34, rotational_speed",
        ),
        (GOOD_JSON.replace('{"version"', '{"version": "1.0", "version"'), "version"),
        (
            GOOD_JSON.replace('"floating_point": 1591.', '"floating_point": 1, "floating_point": 1591.'),
            "torque_around_u_axis, floating_point",
        ),
        (
            GOOD_JSON.replace(TORQUE_JSON, f'{TORQUE_JSON}, "integer": 15}}, {TORQUE_JSON}'),
            "external_load 38, torque_around_u_axis",
        ),
    ],
)
def test_what_is_given_twice_is_refused(tmp_path, text, key):
    assert text not in (GOOD, GOOD_JSON)
    path = tmp_path / "stage.rexs"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(CaseError, match="given twice") as caught:
        read_model(path)
    assert (caught.value.code, caught.value.key, caught.value.file) == ("E-REXS", key, str(path))


def test_files_that_are_too_long_or_no_text(tmp_path):
    path = tmp_path / "stage.rexs"
    with open(path, "wb") as stream:
        stream.truncate(100_000_000)
    with pytest.raises(CaseError, match="too long"):
        read_model(path)
    path.write_bytes(GOOD.encode("utf-8") + b"\xfc")
    with pytest.raises(CaseError, match="E-FILE-ENC"):
        read_model(path)
    with pytest.raises(CaseError, match="E-FILE"):
        read_model(tmp_path)


NAMED = GOOD.replace('name="gear_unit [1]"', 'name="Pr\xfcfstand 2 \xb5m"')


@pytest.mark.parametrize(
    ("declared", "codec"),
    [
        ("UTF-8", "utf-8"),
        ("UTF-8", "utf-8-sig"),
        ("ISO-8859-1", "latin-1"),
        ("iso-8859-1", "latin-1"),
        ("ISO-8859-15", "iso8859-15"),
        ("windows-1252", "cp1252"),
        ("UTF-16", "utf-16"),
        ("UTF-16", "utf-16-le"),
        ("UTF-16", "utf-16-be"),
        ("UTF-16LE", "utf-16-le"),
    ],
)
def test_declared_encodings_are_read(tmp_path, declared, codec):
    path = tmp_path / "stage.rexs"
    path.write_bytes(NAMED.replace('"UTF-8"', f'"{declared}"').encode(codec))
    model = read_model(path)
    assert model.components["1"].name == "Pr\xfcfstand 2 \xb5m"
    assert case_tables(model)[0]["sun"]["teeth"] == 17


@pytest.mark.parametrize(
    ("declared", "codec", "words"),
    [
        ("EBCDIC-CP-FR", "latin-1", "is not read"),
        ("utf-7", "latin-1", "is not read"),
        ("UTF-16", "latin-1", "does not fit"),
        ("us-ascii", "latin-1", "does not fit"),
        ("UTF-8", "latin-1", "not UTF-8"),
    ],
)
def test_other_encodings_are_refused(tmp_path, declared, codec, words):
    path = tmp_path / "stage.rexs"
    path.write_bytes(NAMED.replace('"UTF-8"', f'"{declared}"').encode(codec))
    with pytest.raises(CaseError, match=words) as caught:
        read_model(path)
    assert caught.value.code == "E-FILE-ENC"


@pytest.mark.parametrize("codec", ["utf-16", "latin-1"])
def test_entities_are_refused_in_every_encoding(tmp_path, codec):
    path = tmp_path / "stage.rexs"
    bomb = '<!DOCTYPE x [<!ENTITY a "b">]>' + NAMED.split("\n", 1)[1]
    declared = codec.replace("latin-1", "ISO-8859-1")
    path.write_bytes(f'<?xml version="1.0" encoding="{declared}"?>{bomb}'.encode(codec))
    with pytest.raises(CaseError, match="entities"):
        read_model(path)


@pytest.mark.parametrize(
    ("before", "element", "count", "behind"),
    [
        ("<model version='1.4'>", "<a/>", 4_700_000, "</model>"),
        ('{"model": {"version": "1.4", "components": [', "{},", 6_300_000, "{}]}}"),
    ],
    ids=["xml", "json"],
)
def test_files_of_nothing_but_elements_are_refused_at_once(tmp_path, before, element, count, behind):
    path = tmp_path / "stage.rexs"
    path.write_text(before + element * count + behind, encoding="utf-8")
    start = time.process_time()
    with pytest.raises(CaseError, match="are too many") as caught:
        read_model(path)
    assert caught.value.code == "E-FILE" and time.process_time() - start < 5.0


def test_zips(tmp_path):
    path = tmp_path / "stage.rexsz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("bomb.rexs", b" " * (MOST_BYTES + 1000))
    assert path.stat().st_size < 100_000
    with pytest.raises(CaseError, match="too long"):
        read_model(path)
    for names, words in ((("a.txt",), "0 REXS files"), (("a.rexs", "b.rexsj"), "2 REXS files")):
        with zipfile.ZipFile(path, "w") as archive:
            for name in names:
                archive.writestr(name, GOOD)
        with pytest.raises(CaseError, match=words):
            read_model(path)
    path.write_text(GOOD, encoding="utf-8")
    with pytest.raises(CaseError, match="not a zip file"):
        read_model(path)
    whole = Gearbox().write(path).read_bytes()
    for broken in (whole[:1000], whole[:200] + b"\0" * 50 + whole[250:]):
        path.write_bytes(broken)
        with pytest.raises(CaseError, match="cannot be unpacked"):
            read_model(path)
