"""Places and sections of the shafts of a REXS unit."""

import math

import pytest
from rexs_stage import ParallelUnit
from rexs_units import IndustrialUnit

from femgear.exchange.rexs import read_model
from femgear.exchange.unit_shafts import (
    NoGearbox,
    Piece,
    file_pieces,
    file_places,
    joined_pieces,
    misses,
    stage_way,
    walked_places,
)


def piece(start, end, outer, inner=0.0):
    return Piece(start, end, (outer, outer), (inner, inner))


def test_angles_and_coordinates_of_a_published_unit_agree():
    """SEW's first stage: 53 mm at 117.477 deg around -u, and the coordinates v, w of its second shaft."""
    x, y, _ = stage_way(53.0, math.radians(117.47677801890632), 0.0)
    assert (x, y) == pytest.approx((47.02148907341676, -24.45362069957225), abs=1e-9)


@pytest.mark.parametrize("suffix", ["rexs", "rexsj"])
def test_coordinates_are_read_from_xml_and_json(tmp_path, suffix):
    box = IndustrialUnit()
    model = read_model(box.write(tmp_path / f"unit.{suffix}"))
    places = file_places(model, [model.components[id] for id in ("12", "13", "14")])
    assert places == {"12": (0.0, 0.0, -0.07), "13": (0.0, -0.19, -0.025), "14": (0.0, 0.0, 0.09)}
    box.components[13]["vectors"] = {}
    model = read_model(box.write(tmp_path / f"unit.{suffix}"))
    assert file_places(model, [model.components["13"]]) is None


def test_coordinates_count_from_what_they_refer_to(tmp_path):
    box = IndustrialUnit()
    box.components[14]["vectors"]["support_vector"] = (160.0, 1.0, 2.0)
    box.components[14]["attributes"]["reference_component_for_position"] = (12, "none")
    model = read_model(box.write(tmp_path / "unit.rexs"))
    assert file_places(model, [model.components["14"]])["14"] == pytest.approx((1e-3, 2e-3, 0.09))


def test_shafts_across_the_unit_make_no_gearbox(tmp_path):
    box = ParallelUnit()
    box.components[10]["vectors"] = {"u_axis_vector": (0.0, 1.0, 0.0)}
    model = read_model(box.write(tmp_path / "unit.rexs"))
    with pytest.raises(NoGearbox, match="shaft 10 does not lie along"):
        file_places(model, [model.components["10"]])


def test_ways_are_walked_both_ways_and_from_every_group():
    ways = [("b", "a", (1.0, 0.0, 2.0)), ("c", "d", (0.0, 3.0, 0.0))]
    places = walked_places(["a", "b", "c", "d"], ways)
    assert places == {"a": (0.0, 0.0, 0.0), "b": (-1.0, 0.0, -2.0), "c": (0.0, 0.0, 0.0), "d": (0.0, 3.0, 0.0)}
    assert misses(places | {"d": (0.0, 3.1, 0.0)}, ways) == pytest.approx(0.1)


def test_sections_on_top_of_each_other_and_gaps():
    found, gaps = joined_pieces([piece(0.0, 0.1, 0.08, 0.06), piece(0.09, 0.1, 0.2, 0.08), piece(0.12, 0.2, 0.05)])
    assert [(one.start, one.end, one.outer[0], one.inner[0]) for one in found] == [
        (0.0, 0.09, 0.08, 0.06),
        (0.09, 0.1, 0.2, 0.06),
        (0.1, 0.12, 0.05, 0.0),
        (0.12, 0.2, 0.05, 0.0),
    ]
    assert gaps == pytest.approx(0.02)


def test_a_cone_keeps_its_ends():
    (cone,), gaps = joined_pieces([Piece(0.0, 0.1, (0.04, 0.06), (0.01, 0.02))])
    assert cone.table == {
        "length": "100 mm",
        "outer_diameter": "40 mm",
        "inner_diameter": "10 mm",
        "end_outer_diameter": "60 mm",
        "end_inner_diameter": "20 mm",
    }
    assert gaps == 0.0


def test_sections_without_sizes_are_left_out_and_told(tmp_path):
    box = IndustrialUnit()
    box.components[12001]["attributes"]["length"] = (-80.0, "mm")
    box.components[12002]["attributes"]["outer_diameter_begin"] = (0.0, "mm")
    model = read_model(box.write(tmp_path / "unit.rexs"))
    (left,) = file_pieces(model, model.components["12"], 0.1)
    assert (left.start, left.end) == pytest.approx((0.1, 0.18))
    assert [one.text.split(" of ")[0] for one in model.findings] == ["shaft_section 12001", "shaft_section 12002"]
