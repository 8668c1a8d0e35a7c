"""Slices in a case file: what the stages store, draw, warn of and refuse."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from page_examples import check_documented

from femgear.case.dependencies import Steps
from femgear.contact.root_stress import body_stress
from femgear.contact.tooth_loads import loaded_teeth
from femgear.contact.width_waves import condensed_waves
from femgear.errors import CaseError, FemgearError
from femgear.stages import static as stages
from femgear.stages.static import solve_static, solve_stress
from femgear.stages.static_figures import contact_pattern, face_load, root_stress_over_width
from femgear.stages.static_results import HELIX_VARIABLES, describe_static, describe_stress, static_warnings
from femgear.trains.elastic.stages import solve_modes
from femgear.trains.reading import read_case, with_value, with_values

pytestmark = pytest.mark.usefixtures("coarse_states")

ROOT = Path(__file__).parents[2]
WIND_UP = {"carrier.wind_up_stiffness": "1e5 N m/rad", "carrier.torque_end": "front"}
SLOPE = {"kind": "lead slope", "amount": "10 um"}


def said(data) -> str:
    return " ".join(map(str, static_warnings(data)))


@pytest.fixture(scope="module")
def case():
    coarse = {"static.positions": 8, "static.flank_elements": 6, "static.slices": 7}
    return with_values(read_case(ROOT / "cases" / "planetary_27_40_108.toml"), coarse)


@pytest.fixture(scope="module")
def straight(case):
    return solve_static(case)


@pytest.fixture(scope="module")
def misaligned(case):
    case = with_values(case, {"sun.modifications": [SLOPE, {"kind": "lead crowning", "amount": "2 um"}]})
    return case, solve_static(case)


def test_static_results_hold_the_load_over_the_width(misaligned):
    data = misaligned[1].dataset()
    assert data["slice_load"].dims == ("mesh", "tooth", "slice", "position")
    assert data["slice"].values == pytest.approx(25e-3 * (np.arange(7) - 3) / 7)
    mean = data["slice_load"].mean("slice")
    assert np.abs(mean - data["tooth_load"]).max() < 1e-9 * data["tooth_load"].max()
    # more material at z > 0 carries more
    first = data["slice_load"].values[0].sum(axis=(0, 2))
    assert (np.diff(first) >= 0).all() and first[-1] > 2 * first[0]
    factor = data["face_load_factor"].values
    assert factor[:3] == pytest.approx(factor[0], rel=1e-6) and factor[0] > 1.5
    block = describe_static(data)
    assert block.rows[0][block.header.index("K_Hbeta")] == f"{factor[0]:.3f}"
    assert "W-FACE-LOAD" in said(data) and "take 25 slices or more" in said(data)
    idle = describe_static(data.assign(mesh_force=data.mesh_force * (data.mesh != "sun-planet 1")))
    assert [row[block.header.index("K_Hbeta")] == "-" for row in idle.rows] == [True] + 5 * [False]
    check_documented(data, "## static.nc", others=HELIX_VARIABLES)


def test_the_load_over_the_width_is_drawn(misaligned):
    figure = face_load(misaligned[1].dataset())
    image = figure.axes[0].collections[0].get_array()
    width, load = 25.0, misaligned[1].cycle.slice_load[0]
    assert image.max() == pytest.approx(load.max() / width) and np.ma.count_masked(image)
    pressure = misaligned[1].cycle.slice_pressure[0]
    drawn = contact_pattern(misaligned[1].dataset()).axes[0].collections[-1].get_array()
    assert drawn.max() == pytest.approx(pressure.max() * 1e-6)
    # the largest pressure is that of the load as it goes on to the end of the width
    largest = misaligned[1].cycle.max_pressure[0].max()
    assert pressure.max() <= largest * (1 + 1e-12) < 1.1 * pressure.max()  # equal but for rounding


@pytest.mark.slow
def test_root_stresses_of_a_load_without_leads_are_those_of_the_plane(case, straight):
    """In every slice, over the whole record and in the range over a turn."""
    plane = with_values(case, {"static.slices": 0})
    plane, sliced = solve_stress(plane, solve_static(plane)), solve_stress(case, straight)
    for a, b in zip(plane.roots, sliced.roots, strict=True):
        assert b.over_width.shape[-1] == 7 and b.face_load_factor == pytest.approx(1.0, rel=1e-9)
        assert np.abs(b.over_width - a.over_width).max() < 1e-9 * a.over_width.max()
        assert np.abs(b.stress - a.stress).max() < 1e-9 * a.over_width.max()
    for a, b in zip(plane.ranges, sliced.ranges, strict=True):
        assert (b.maximum, b.minimum, b.point) == pytest.approx((a.maximum, a.minimum, a.point), rel=1e-9)
        assert b.history == pytest.approx(a.history, abs=1e-9 * a.maximum)


def test_root_stresses_follow_the_load_over_the_width(misaligned):
    """Their mean is the plane stress of the mean load, since all slices touch at one place."""
    case, static = misaligned
    result = solve_stress(case, static)
    gears, cycle, roots, numbers = static.planetary_set, static.cycle, result.influences, np.arange(6)
    # one body of every gear: planets are alike
    bodies = {id(root): (root, acting) for _, root, acting in roots.of_bodies(gears)}
    assert len(bodies) >= 3
    for root, acting in bodies.values():
        loads = roots.loads(gears, cycle, reverse=False)
        field = body_stress(gears, root, acting, loads, np.arange(8), numbers)
        mean = [loaded_teeth(cycle, reverse=False)]
        plane = body_stress(gears, replace(root, waves=None), acting, mean, np.arange(8), numbers)
        assert np.abs(field.mean(axis=2) - plane[:, :, 0]).max() < 1e-9 * plane.max()
    data = result.dataset()
    factor = data["root_face_factor"].values
    contact = static.cycle.face_load_factor
    # bending spreads the load: less than K_H-beta, more than one
    assert (factor[:3] < contact[:3, None]).all() and factor[:3].min() > 1.4
    # the record follows one tooth at equidistant positions, the largest may lie between
    shown = data["root_over_width"].max(("step", "slice")) / data["root_worst"]
    assert 0.9 < shown.min() and shown.max() < 1.0 + 1e-9
    assert (np.diff(data["root_over_width"].max("step").values[:3], axis=-1) > 0).all()
    height = 1.0 / (1.0 + (h := 3.375e-3 / 25e-3) + h**2)
    assert data["iso_face_factor"].values[:3] == pytest.approx(contact[:3] ** height, rel=1e-2)
    block = describe_stress(data)
    assert all(len(row) == len(block.header) for row in block.rows)
    assert block.rows[2][block.header.index("K_Fbeta")] == f"{factor[0, 0]:.3f}"
    image = root_stress_over_width(data).axes[0].collections[0].get_array()
    assert image.max() == pytest.approx(float(data["root_over_width"][0, 0].max()) * 1e-6)


@pytest.mark.slow
def test_modes_follow_the_softer_meshes(case, misaligned):
    """Loads on part of the width: sun-planet meshes are softer, those with the ring as they were."""
    plane = with_values(case, {"static.slices": 0})
    found = [solve_modes(one, static).dataset() for one, static in (misaligned, (plane, solve_static(plane)))]
    soft, stiff = (one["mesh_stiffness"].values for one in found)
    assert (soft[:3] < 0.9 * stiff[:3]).all() and np.abs(soft[3:] / stiff[3:] - 1).max() < 1e-3


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"static.slices": 0, "sun.modifications": [SLOPE]}, "sun.modifications[0]"),
        ({"static.slices": 0, "sun.misalignment": {"x": "0.1 mrad"}}, "sun.misalignment"),
        ({"static.slices": 0, "planet.tilt_stiffness": "0 N m/rad"}, "planet.tilt_stiffness"),
        ({"static.slices": 0, "sun.torque_end": "back"}, "sun.torque_end"),
        ({"static.slices": 0, **WIND_UP}, "carrier.wind_up_stiffness"),
        ({"static.back_flanks": True}, "static.back_flanks"),
        ({"static.members": "elastic", "planet.bearing_clearance": "5 um"}, "planet.bearing_clearance"),
        ({"static.slices": 100}, "static.slices"),
    ],
)
def test_what_slices_cannot_do_is_refused(case, changes, key):
    with pytest.raises(CaseError) as caught:
        solve_static(with_values(case, changes))
    assert caught.value.code == "E-SLICES" and caught.value.key == key and caught.value.file


@pytest.mark.parametrize(
    ("section", "code"),
    [
        ({"kind": "end relief", "amount": "5 um"}, "E-KEY-MISSING"),
        ({"kind": "lead slope"}, "E-KEY-MISSING"),
        ({"kind": "lead crowning", "amount": "5 um", "start_diameter": "41 mm"}, "E-MODIFICATION"),
        ({"kind": "profile slope", "amount": "5 um", "length": "3 mm"}, "E-MODIFICATION"),
        ({"kind": "flank twist", "amount": "5 um", "end_diameter": "41 mm"}, "E-MODIFICATION"),
        ({"kind": "measured lead", "deviations": ["1 um"]}, "E-MODIFICATION"),
        ({"kind": "measured profile", "places": ["1 mm"], "deviations": ["1 um"]}, "E-MODIFICATION"),
        ({"kind": "measured lead", "places": ["1 mm"], "deviations": ["1 um"]}, "E-COUNT"),
    ],
)
def test_leads_have_their_own_entries(case, section, code):
    with pytest.raises(CaseError) as caught:
        with_values(case, {"sun.modifications": [section]})
    assert caught.value.code == code


@pytest.mark.parametrize(
    ("changes", "code", "key"),
    [
        ({"carrier.wind_up_stiffness": "1e5 N m/rad"}, "E-KEY-MISSING", "carrier.torque_end"),
        ({"sun.torsion_diameter": "20 mm"}, "E-KEY-MISSING", "sun.torque_end"),
        ({"carrier.torque_end": "back"}, "E-KEY-MISSING", "carrier.wind_up_stiffness"),
        ({"sun.torque_end": "front", "sun.torsion_diameter": "17 mm"}, "E-RANGE", "sun.torsion_diameter"),
        ({"planet.misalignment": [{"planet": 4}]}, "E-RANGE", "planet.misalignment[0].planet"),
        ({"sun.misalignment": {"x": "19 mrad"}}, "E-RANGE", "sun.misalignment"),
        (
            {"planet.tilt_stiffness": "0 N m/rad", "carrier.tilt_stiffness": "0 N m/rad"},
            "E-MECHANISM",
            "carrier.tilt_stiffness",
        ),
    ],
)
def test_tilts_and_twists_that_cannot_be_are_refused(case, changes, code, key):
    with pytest.raises(FemgearError) as caught:
        solve_static(with_values(case, changes))
    assert caught.value.code == code and caught.value.key == key


@pytest.mark.slow
def test_axes_askew_in_a_case(case):
    """Any unit of an angle; an end that lifts is named with the share of the width that carries."""
    askew = {"sun.misalignment": {"x": "0.8 mrad"}, "sun.tilt_stiffness": "1e5 N m/rad"}
    data = solve_static(with_values(case, askew)).dataset()
    other = solve_static(with_values(case, askew | {"sun.misalignment": {"x": "8e-4 rad"}})).dataset()
    assert data.equals(other) and list(data["tilt"].values) == ["sun: x", "sun: y"]
    assert "W-LIFTED" in said(data) and "one end is lifted" in said(data)
    block = describe_static(data)
    found = float(block.rows[1][block.header.index("misaligned [um]")])
    assert found == pytest.approx(data["mesh_misalignment"].values[1].mean() * 1e6, abs=0.006)


@pytest.mark.slow
def test_an_offset_of_leads_is_no_deflection(case, straight):
    """A lead measured 200 um off its datum: flanks approach by that, teeth do not bend by it."""
    line = {"kind": "measured lead", "places": ["-1 mm", "1 mm"], "deviations": ["-200 um", "-200 um"]}
    plain = straight.dataset()
    offset = solve_static(with_values(case, {"sun.modifications": [line]})).dataset()
    rise = offset["ste"].values[:3] - plain["ste"].values[:3]
    assert rise == pytest.approx(np.full(rise.shape, 200e-6), rel=1e-9)
    assert "W-DEFLECTION" not in said(offset)


@pytest.mark.slow
def test_modes_know_tilts_and_twists(case, straight):
    """Of the loaded state: wind-up and torsion are in series with the meshes."""
    soft = {"sun.torque_end": "front", "planet.tilt_stiffness": "1e4 N m/rad", **WIND_UP}
    yielding = with_values(case, soft)
    found = [
        solve_modes(*one).dataset()["mesh_stiffness"].values
        for one in ((yielding, solve_static(yielding)), (case, straight))
    ]
    assert (found[0] < found[1]).all()


@pytest.mark.slow
@pytest.mark.parametrize("members", ["fixed", "elastic"])
def test_gears_are_condensed_for_waves_once(case, members, monkeypatch):
    """The modal stage takes them from the static one, and cases with another ring those of sun and planet."""
    condensed = []

    def counted(sector, *rest):
        condensed.append(sector.gear.name)
        return condensed_waves(sector, *rest)

    monkeypatch.setattr(stages, "condensed_waves", counted)
    coarse = {"static.flank_elements": 4, "static.slices": 5, "static.stresses": False}
    steps, case = Steps(), with_values(case, {"sun.modifications": [SLOPE], "static.members": members} | coarse)
    static = solve_static(case, steps=steps)
    modes = solve_modes(case, static)
    assert sorted(condensed) == ["planet", "ring", "sun"]
    other = with_value(case, "ring.outer_radius", "95 mm")
    solve_static(other, steps=steps)
    assert condensed[3:] == ["ring"]
    # the same as with waves of its own
    alone = solve_modes(case, replace(static, waves=None))
    assert np.abs(alone.state.stiffness / modes.state.stiffness - 1.0).max() < 1e-12
