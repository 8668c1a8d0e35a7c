"""Whole REXS units as gearboxes: places of shafts, bearings, loads, load cases, senses."""

import math
import os
from pathlib import Path

import numpy as np
import pytest
from rexs_stage import DEG, ParallelUnit, both_units
from rexs_units import IndustrialUnit, ThreeStageUnit, planetary_unit
from trains.test_imports import drafts_of

from femgear.exchange.cylindrical_stage import pair_tables
from femgear.exchange.gear_unit import case_flows, stage_components
from femgear.exchange.gearbox_unit import gearbox_tables
from femgear.exchange.rexs import read_model
from femgear.exchange.unit_shafts import NoGearbox
from femgear.findings import DOUBT
from femgear.trains.gearbox.case_file import DeflectionSection
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.geometry import pair_sizes
from femgear.trains.gearbox.power import gearbox_flow
from femgear.trains.imports import case_drafts
from femgear.trains.reading import parse_case, read_case

pytestmark = pytest.mark.usefixtures("coarse_states")


def tables_of(box, tmp_path) -> tuple[dict, dict, list]:
    """Tables, remarks and findings of a unit."""
    box.write(tmp_path / "unit.rexs")
    model = read_model(tmp_path / "unit.rexs")
    flows = case_flows(model, None)
    pairs = {stage.id: pair_tables(model, stage, None, flows)[0] for stage in stage_components(model)}
    model.findings.clear()
    return *gearbox_tables(model, pairs), model.findings


def test_shafts_lie_where_stages_put_them(tmp_path):
    tables, _, _ = tables_of(ParallelUnit(), tmp_path)
    case = read_case(tables)
    # 75 mm along w = y, then 120 mm at 90 deg around -u, from w to v = x
    assert [shaft.axis for shaft in case.shaft] == [
        pytest.approx(axis, abs=1e-12) for axis in ((0.0, 0.0), (0.0, 0.075), (0.12, 0.075))
    ]
    # middles of gears: 80 and 35 mm, 85 and 100 mm from the left ends
    assert [shaft.start for shaft in case.shaft] == pytest.approx([0.0, 0.045, 0.03], abs=1e-12)
    assert [shaft.length for shaft in case.shaft] == pytest.approx([0.16, 0.12, 0.2])


def test_internal_pairs_lie_alike_whichever_gear_is_named_first(tmp_path):
    box = ParallelUnit().set(44, number_of_teeth=(60, "none")).set(52, center_distance=(60.0, "mm"))
    box.components[44]["type"] = "ring_gear"
    box.components[31]["attributes"] |= {f"outer_diameter_{end}": (220.0, "mm") for end in ("begin", "end")}
    for flank in (1044, 2044):
        box = box.set(flank, addendum_coefficient_basic_profile=(0.8, "none"))
    ring_first = box.set(52, rotating_angle_around_neg_u_axis=(270.0, DEG))
    ring_first.relations = [
        (kind, roles | {"gear_1": 44, "gear_2": 43} if roles.get("stage") == 52 else roles)
        for kind, roles in ring_first.relations
    ]
    for unit in (box, ring_first):
        shafts = read_case(tables_of(unit, tmp_path)[0]).shaft
        # 60 mm at 90 deg around -u, from w to v = x
        assert shafts[2].axis == pytest.approx((0.06, 0.075), abs=1e-12)


def test_in_format_1_0_places_of_gears_are_their_left_faces(tmp_path):
    box = ParallelUnit()
    box.version = "1.0"
    case = read_case(tables_of(box, tmp_path)[0])
    assert case.pair[0].positions == pytest.approx((0.080 + 0.012, 0.035 + 0.012))


def test_the_load_that_the_file_lacks_takes_the_power(tmp_path):
    tables, _, findings = tables_of(ParallelUnit(), tmp_path)
    case = read_case(tables)
    assert case.operation.output == ("output",)
    assert case.load[-1].shaft == "shaft 30" and case.load[-1].position == pytest.approx(0.2)
    assert any("takes the power" in one.text for one in findings)


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_the_thrust_of_helical_gears_has_its_sense(tmp_path, sense):
    """A right-handed pinion that drives counter-clockwise is pushed along its axis, its wheel against it."""
    box = ParallelUnit().set(10, rotational_speed=(sense * 1500.0, "1 / min"))
    box = box.set(5, torque_around_u_axis=(sense * 100.0, "N m"))
    box = box.set(41, helix_angle_reference_diameter=(10.0, DEG))
    box = box.set(42, helix_angle_reference_diameter=(-10.0, DEG))
    box = box.set(51, center_distance=(75.0 / math.cos(math.radians(10.0)), "mm"))
    tables, _, _ = tables_of(box, tmp_path)
    found = solve_deflection(read_case(tables | {"deflection": {"contact": False}}))
    radius = 0.5 * 25 * 2.0e-3 / math.cos(math.radians(10.0))
    thrust = sense * 100.0 / radius * math.tan(math.radians(10.0))
    # bearings hold against the thrust
    assert found.bearing_force[:2, 2].sum() == pytest.approx(-thrust, rel=1e-6)


def test_rigid_bearings_of_known_size_become_bearings_of_assumed_elements(tmp_path):
    box = ParallelUnit()
    box.components[12]["attributes"] |= {
        "radial_stiffness": (1e22, "N / m"),
        "inner_diameter": (30.0, "mm"),
        "outer_diameter": (62.0, "mm"),
        "bearing_type": ("radial_grooved_ball_bearing", ""),
        "dynamic_capacity": (19.5, "kN"),
    }
    tables, remarks, findings = tables_of(box, tmp_path)
    bearing = read_case(tables).bearing[0]
    assert (bearing.kind, bearing.estimated, bearing.dynamic_rating) == ("ball", True, 19500.0)
    # a real one of this size has 9 balls of 9.5 mm on 46 mm
    assert bearing.pitch_diameter == pytest.approx(0.046)
    assert bearing.element_diameter == pytest.approx(9.5e-3, rel=0.05)
    assert bearing.rolling_elements == 9
    assert "bearing[0].element_diameter" in remarks
    assert any("assumed size" in one.text for one in findings)


def test_load_cases_bring_torques_forces_and_shares(tmp_path):
    box = ParallelUnit()
    box.write(tmp_path / "unit.rexs")
    text = (tmp_path / "unit.rexs").read_text(encoding="utf-8")
    case = """<load_case id="{0}">
    <component id="1"><attribute id="load_duration_fraction" unit="%">{3}</attribute></component>
    <component id="10"><attribute id="rotational_speed" unit="1 / min">{1}</attribute></component>
    <component id="5"><attribute id="torque_around_u_axis" unit="N m">{2}</attribute>
    <attribute id="force_v_direction" unit="N">456</attribute></component></load_case>"""
    spectrum = f'<load_spectrum id="1">{case.format(1, 500, 80, 20)}{case.format(2, 900, 40, 80)}</load_spectrum>'
    (tmp_path / "unit.rexs").write_text(text.replace("</model>", f"{spectrum}</model>"), encoding="utf-8")
    model = read_model(tmp_path / "unit.rexs")
    flows = case_flows(model, None)
    pairs = {stage.id: pair_tables(model, stage, None, flows)[0] for stage in stage_components(model)}
    found = read_case(gearbox_tables(model, pairs, 2)[0])
    assert [one.torque["load 5"] for one in found.operation.load_case] == [80.0, 40.0]
    assert [one.share for one in found.operation.load_case] == [0.2, 0.8]
    assert found.load_case.speed["shaft 10"] == pytest.approx(900.0 * math.pi / 30.0)
    assert found.load_case.force["load 5"] == (456.0, 0.0, 0.0)
    assert found.operation.first == 2
    state = solve_deflection(read_case(gearbox_tables(model, pairs, 2)[0] | {"deflection": {"contact": False}}))
    assert np.isfinite(state.bearing_force).all()


def test_units_without_sections_or_torque_make_no_gearbox(tmp_path):
    box = ParallelUnit()
    del box.components[5]["attributes"]["torque_around_u_axis"]
    with pytest.raises(NoGearbox, match="torque"):
        tables_of(box, tmp_path)


def closed(case) -> float:
    """Largest distance by which axes of shafts miss the centre distance of a pair."""
    axis = {shaft.name: shaft.axis for shaft in case.shaft}
    return max(
        abs(math.dist(axis[pair.shafts[0]], axis[pair.shafts[1]]) - pair_sizes(pair).centre_distance)
        for pair in case.pair
    )


def test_the_published_two_stage_unit(tmp_path):
    found, findings = drafts_of(IndustrialUnit(), tmp_path)
    case = parse_case(found[""].text)
    assert [one.share for one in case.operation.load_case] == [0.2, 0.3, 0.35, 0.15]
    for load_case, (speed, torque) in zip(
        case.operation.load_case, ((543, 567), (3456, 345), (1234, 456), (789, 789)), strict=True
    ):
        flow = gearbox_flow(case, load_case)
        turns = [flow.speed[f"shaft {id}"] * 30.0 / math.pi for id in (12, 13, 14)]
        assert turns == pytest.approx([speed, -speed * 9 / 17, speed * 207 / 578], rel=1e-12)
        assert flow.port_torque["load 41"] == pytest.approx(-torque * 578 / 207, rel=1e-11)
        assert flow.stage_torque["stage 19"]["shaft 13"] == pytest.approx(-torque * 17 / 9, rel=1e-11)
    first = gearbox_flow(case, case.operation.load_case[0])
    assert [*first.mesh_frequency.values()] == pytest.approx([244.35, 110.19706], rel=1e-6)
    assert closed(case) < 1e-9
    # the input shaft ends inside the hollow output shaft, in a needle bearing
    needle = next(one for one in case.bearing if one.outer_shaft is not None)
    assert (needle.shaft, needle.outer_shaft) == ("shaft 12", "shaft 14")
    # forces across the plane of the axes stay across it
    assert case.operation.load_case[0].force["load 42"] == (456.0, 0.0, 0.0)
    assert [shaft.axis for shaft in case.shaft] == [(0.0, 0.0), (0.0, -0.19), (0.0, 0.0)]
    doubts = " ".join(one.text for one in findings if one.severity == DOUBT)
    assert "tip diameter 1 mm" in doubts
    assert "bearings 36, 37, 38: 1e+12 N m/rad against tilt" in doubts
    assert "neither stiffness nor sizes" in doubts


def test_the_published_three_stage_unit(tmp_path):
    found, findings = drafts_of(ThreeStageUnit(), tmp_path)
    case = parse_case(found[""].text)
    flow = gearbox_flow(case)
    ratio = 67 / 23 * 76 / 13 * 87 / 14
    assert abs(flow.port_torque["load 68"]) == pytest.approx(4.724562306435156 * ratio, rel=1e-11)
    assert abs(flow.port_torque["load 68"]) == pytest.approx(500.0, rel=1e-6)
    assert [*flow.mesh_frequency.values()] == pytest.approx([536.6667, 104.1294, 19.18172], rel=1e-5)
    assert closed(case) < 1e-6
    start = {shaft.name: shaft.start for shaft in case.shaft}
    middles = [
        [start[shaft] + place for shaft, place in zip(pair.shafts, pair.positions, strict=True)] for pair in case.pair
    ]
    # mid planes of two stages are 2.5 mm apart
    assert [b - a for a, b in middles] == pytest.approx([2.5e-3, 2.5e-3, 0.0], abs=1e-9)
    assert [one.axial_sense for one in case.bearing] == [
        None, "none", "negative", "positive", "negative", None, "positive", "none", None,
    ]  # fmt: skip
    assert all(one.estimated and one.dynamic_rating and one.static_rating for one in case.bearing)
    assert any("bearings 20, 21, 32, 33, 49, 50, 51, 66, 67: rigid in the file" in one.text for one in findings)


@pytest.mark.parametrize("unit", [IndustrialUnit, ThreeStageUnit])
def test_bearings_of_published_units_balance_their_loads(tmp_path, unit):
    tables = parse_case(drafts_of(unit(), tmp_path)[0][""].text)
    case = tables.model_copy(update={"deflection": tables.deflection.model_copy(update={"contact": False})})
    state = solve_deflection(case)
    given = np.zeros(3)
    for forces in case.load_case.force.values():
        given += np.asarray(forces)
    inside = [number for number, one in enumerate(case.bearing) if one.outer_shaft is None]
    size = np.abs(state.bearing_force).max()
    assert state.bearing_force[inside, :3].sum(axis=0) == pytest.approx(-given, abs=1e-9 * size)


def test_a_planetary_stage_and_two_parallel_ones_are_one_gearbox(tmp_path):
    found, findings = drafts_of(both_units(), tmp_path)
    case = parse_case(found[""].text)
    (stage,) = case.planetary
    assert (stage.sun, stage.carrier, stage.ring) == ("shaft 34", "shaft 4", "casing")
    # two trains that nothing joins: two speeds, two outputs
    flow = gearbox_flow(case)
    assert flow.speed["shaft 4"] == pytest.approx(1500.0 * 17 / 78 * math.pi / 30.0)
    assert sorted(flow.port_torque.values())[0] == pytest.approx(-1591.5494309 * 78 / 17)
    assert len(case.operation.output) == 2 and len(case.operation.load_case[0].speed) == 2
    assert any("shaft 4 has no sections" in one.text for one in findings)


def test_a_planetary_stage_on_whole_shafts_is_a_gearbox(tmp_path):
    found, findings = drafts_of(planetary_unit(), tmp_path)
    case = parse_case(found[""].text)
    (stage,) = case.planetary
    carrier = case.shaft_named("shaft 4")
    # a shaft in a plate, a tube for the struts, the other plate on its ring: z from -100 to 58 mm
    sizes = [(1e3 * one.length, 1e3 * one.outer_diameter, 1e3 * one.inner_diameter) for one in carrier.part]
    assert sizes == [pytest.approx(one) for one in ((92, 80, 60), (8, 219, 60), (50, 219, 110), (8, 219, 88))]
    assert (carrier.start, stage.carrier_position, stage.sun_position) == pytest.approx((-0.1, 0.125, 0.025))
    assert stage.ring == "casing" and stage.pins.diameter == pytest.approx(0.0432)
    # half of what is free between the plates
    assert stage.pins.length == pytest.approx(0.025)
    assert {one.shaft for one in case.bearing} == {"shaft 34", "shaft 4"}
    assert any("struts" in one.text for one in findings)
    flow = gearbox_flow(case)
    # Willis with the ring held
    assert flow.speed["shaft 4"] / flow.speed["shaft 34"] == pytest.approx(17 / 78)


def test_planets_stand_where_their_meshes_do(tmp_path):
    """Planet 1 of a mesh at 0 deg around -u lies along w, the y axis."""
    case = parse_case(drafts_of(planetary_unit(), tmp_path)[0][""].text)
    assert case.planetary[0].angle == pytest.approx(0.5 * math.pi)


def test_struts_of_their_own_are_parts_of_the_carrier(tmp_path):
    box = planetary_unit()
    box.add(260, "shaft")
    box.components[260]["vectors"] = {"support_vector": (0.0, 0.0, 0.0)}
    box.add(
        261,
        "shaft_section",
        length=(50.0, "mm"),
        outer_diameter_begin=(164.25, "mm"),
        inner_diameter_begin=(109.5, "mm"),
        inner_diameter_end=(109.5, "mm"),
    )
    box.relate("assembly", assembly=260, part=261)
    for joint, shaft in ((263, 4), (264, 6)):
        box.add(joint, "coupling")
        box.relate("side", assembly=joint, inner_part=shaft, outer_part=260)
    found, findings = drafts_of(box, tmp_path)
    case = parse_case(found[""].text)
    assert [one.name for one in case.shaft] == ["shaft 34", "shaft 4"] and not case.coupling
    assert 1e3 * case.shaft_named("shaft 4").part[2].outer_diameter == pytest.approx(164.25)
    assert not any("struts" in one.text for one in findings)


UNITS = os.environ.get("FEMGEAR_REXS_UNITS")


@pytest.mark.skipif(UNITS is None, reason="FEMGEAR_REXS_UNITS names no folder of REXS units")
def test_units_of_a_folder_are_gearboxes():
    files = [one for one in sorted(Path(UNITS or "").iterdir()) if one.suffix in (".rexs", ".rexsj", ".rexsz")]
    assert files
    for file in files:
        case = parse_case(case_drafts(read_model(file), "unit.toml")[0].text)
        assert case.train == "gearbox", file.name
        state = solve_deflection(case.model_copy(update={"deflection": DeflectionSection(contact=False)}))
        assert state.residual < 1e-7, file.name
