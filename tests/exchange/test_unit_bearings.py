"""Bearings of a REXS unit: stiffness, geometry, what is assumed and told of them."""

import pytest
from rexs_stage import NONE, ParallelUnit

from femgear.exchange.rexs import read_model
from femgear.exchange.unit_bearings import BearingReader, coupling_table, engaged, kind_of

MM = "mm"


def read(tmp_path, attributes, *, turned=False, elements=None):
    """Table, remarks and findings of bearing 12 with other attributes."""
    box = ParallelUnit()
    box.components[12]["attributes"] = dict(attributes)
    if elements is not None:
        box.add(700, "rolling_bearing_row", **elements[0])
        box.add(701, "rolling_element", **elements[1])
        box.relate("ordered_assembly", assembly=12, part=700)
        box.relate("ordered_assembly", assembly=700, part=701)
    model = read_model(box.write(tmp_path / "unit.rexs"))
    reader = BearingReader(model, {})
    table = reader.table(model.components["12"], "bearing[0]", 1e8, turned=turned)
    reader.finish()
    return table, reader.remarks, [one.text for one in model.findings]


def test_stiffnesses_are_kept(tmp_path):
    table, remarks, findings = read(
        tmp_path,
        {
            "radial_stiffness": (2e8, "N / m"),
            "axial_stiffness": (5e7, "N / m"),
            "bending_stiffness": (2e6, "N mm / rad"),
            "axial_force_absorption": ("negative", NONE),
        },
    )
    assert table == {
        "radial": "200000000 N/m",
        "axial": "50000000 N/m",
        "axial_sense": "negative",
        "tilt": "2000 N m/rad",
    }
    assert not remarks and not findings


def test_a_shaft_around_its_bearing_turns_the_sense(tmp_path):
    given = {"radial_stiffness": (2e8, "N / m"), "axial_force_absorption": ("negative", NONE)}
    assert read(tmp_path, given, turned=True)[0]["axial_sense"] == "positive"


def test_rolling_elements_of_the_file_are_taken(tmp_path):
    row = {"number_of_rolling_elements": (9, NONE), "pitch_diameter": (46.0, MM)}
    ball = {"diameter_of_rolling_element": (9.5, MM)}
    given = {
        "bearing_type": ("radial_grooved_ball_bearing", NONE),
        "radial_stiffness": (1e20, "N / m"),
        "operating_radial_bearing_clearance": (10.0, "mum"),
        "radial_dynamic_load_rating": (19.5, "kN"),
        "axial_force_absorption": ("no_direction", NONE),
        "raceway_radius_of_inner_ring": (4.94, MM),
    }
    table, remarks, findings = read(tmp_path, given, elements=(row, ball))
    assert table == {
        "kind": "ball",
        "rolling_elements": 9,
        "element_diameter": "9.5 mm",
        "pitch_diameter": "46 mm",
        "inner_osculation": 0.52,
        "axial_sense": "none",
        "clearance": "0.01 mm",
        "dynamic_rating": "19500 N",
    }
    assert not remarks and not findings


def test_tapered_rollers_of_known_rings_take_thrust_one_way(tmp_path):
    given = {
        "bearing_type": ("radial_tapered_roller_bearing", NONE),
        "inner_diameter": (60.0, MM),
        "outer_diameter": (95.0, MM),
        "width": (27.0, MM),
        "axial_force_absorption": ("negative", NONE),
    }
    table, remarks, findings = read(tmp_path, given)
    assert (table["kind"], table["contact_angle"], table["estimated"]) == ("tapered", "-14 deg", True)
    assert remarks["bearing[0].contact_angle"] == "assumed" and "axial_sense" not in table
    assert findings == ["bearing 12: no stiffness in the file: elements of assumed size from bore and outer diameter"]


def test_rigid_bearings_without_sizes_stay_rigid_and_are_told(tmp_path):
    table, _, findings = read(tmp_path, {"radial_stiffness": (1e20, "N / m"), "axial_stiffness": (1e20, "N / m")})
    assert table == {"radial": "rigid", "axial": "rigid"}
    assert "rigid in the file" in findings[0]


@pytest.mark.parametrize(
    ("word", "kind"),
    [
        ("radial_needle_roller_bearing", "needle"),
        ("radial_spherical_roller_bearing", "spherical"),
        ("radial_roller_bearing", "cylindrical"),
        ("slide_bearing", None),
    ],
)
def test_kinds(word, kind):
    assert kind_of(word) == kind


def test_couplings(tmp_path):
    box = ParallelUnit()
    box.add(60, "coupling", rotational_stiffness=(2e6, "N mm / rad"), radial_stiffness=(1e20, "N / m"))
    box.add(61, "switchable_coupling", is_engaged=("false", NONE))
    model = read_model(box.write(tmp_path / "unit.rexs"))
    assert coupling_table(model, model.components["60"]) == {"torsion": "2000 N m/rad", "radial": "rigid"}
    assert engaged(model, model.components["60"]) and not engaged(model, model.components["61"])
