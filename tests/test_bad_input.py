"""Bad sets, loads and contact problems: every one is refused with what to do, or has a defined result."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femgear.case.gear_set import materials_of, planetary_set, set_deviations
from femgear.case.quantities import RPM
from femgear.cli import main
from femgear.contact.bodies import flank_load_columns, flank_stations, make_sectors
from femgear.contact.solve import solve_contact
from femgear.errors import CaseError, ContactError, FemgearError, GridError
from femgear.fe.compliance import condense_sector, interpolation, node_dofs
from femgear.fe.elasticity import Material, stiffness
from femgear.fe.grid import mirror
from femgear.fe.meshing import mesh_outline
from femgear.gears.checks import check_set
from femgear.gears.deviations import check_deviations
from femgear.gears.tooth import half_sector
from femgear.stages.static import solve_static
from femgear.stages.static_results import describe_static
from femgear.storage.results import coordinates
from femgear.trains.reading import read_case, with_value, with_values
from validation.reference.plane_elasticity import edge_load

pytestmark = pytest.mark.usefixtures("coarse_states")

CASE = Path(__file__).parents[1] / "cases" / "planetary_27_40_108.toml"
TEXT = CASE.read_text(encoding="utf-8")


def edited(*changes: tuple[str, str]) -> str:
    """The text of the reference case with lines changed, each the first one of its kind."""
    text = TEXT
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    return text


def case_of(tmp_path, text: str):
    path = tmp_path / "set.toml"
    path.write_text(text, encoding="utf-8")
    return path


ANGLES = '# planet_angles = ["0 deg", "120 deg", "240 deg"]'
DISTANCE = 'centre_distance = "51 mm"'

REFUSED = {
    # the defect: changes, code, key, then parts of the message that name value, limit and remedy
    "bore larger than the root circle of the sun": (
        [('bore_radius = "9 mm"', 'bore_radius = "20 mm"')],
        ("E-RIM", "sun.bore_radius", "found:   '20 mm'", "< 19.1652 mm", "reduce the bore radius"),
    ),
    "bore larger than the root circle of the planet": (
        [('bore_radius = "18 mm"', 'bore_radius = "28.2 mm"')],
        ("E-RIM", "planet.bore_radius", "28.2000 mm", "< 28.1250 mm", "reduce the bore radius"),
    ),
    "outer surface of the ring inside its root circle": (
        [('outer_radius = "100 mm"', 'outer_radius = "82 mm"')],
        ("E-RIM", "ring.outer_radius", "-0.8750 mm", "> 82.8750 mm", "enlarge the outer radius"),
    ),
    "centre distance at which the base circles leave no line of action": (
        [(DISTANCE, 'centre_distance = "45 mm"')],
        ("E-CENTRE-DISTANCE", "set.centre_distance", "found:   '45 mm'", ">= 47.2196 mm", "increase"),
    ),
    "negative backlash": (
        [('# backlash = "0.1 mm"', 'backlash = "-0.1 mm"')],
        ("E-RANGE", "set.backlash", "-0.1 mm", "0 mm to 10 mm"),
    ),
    "backlash that leaves the sun no tip": (
        [('# backlash = "0.1 mm"', 'backlash = "3 mm"')],
        ("E-POINTED", "set.backlash", "found:   '3 mm'", "up to 1.463 mm for these gears", "reduce the back"),
    ),
    "backlash beyond the module, beside planets that overlap": (
        [('# backlash = "0.1 mm"', 'backlash = "5 mm"'), ("planets = 3", "planets = 5")],
        ("E-ALLOWANCE", "set.backlash", "found:   '5 mm'", "check its unit"),
    ),
    "profile shift whose flanks overlap": (
        [("profile_shift = 0.52681", "profile_shift = 0.6")],
        ("E-BACKLASH", "sun.profile_shift", "75.102 um", ">= -0.15 um", "leave sun.profile_shift out"),
    ),
    "four equally spaced planets on 135 teeth": (
        [("planets = 3", "planets = 4")],
        ("E-ASSEMBLY", "set.planets", "33.75", "2.666667 deg", "0.000000, 90.666667, 181.333333, 269.333333"),
    ),
    "five planets whose tips overlap": (
        [("planets = 3", "planets = 5")],
        ("E-NEIGHBOURS", "set.planets", "3.0459 mm", "at most 4 equally spaced", "fewer planets"),
    ),
    "meshes that ask for different centre distances": (
        [(DISTANCE, ""), ("profile_shift = 0.52681", "profile_shift = 0.0")],
        ("E-COAXIAL", "set.centre_distance", "27 + 2 x 40 = 107, ring 108", "one centre distance", "26/40/106"),
    ),
    "no planet": ([("planets = 3", "planets = 0")], ("E-RANGE", "set.planets", "0", "1 to 1000")),
    "a thousand planets": (
        [("planets = 3", "planets = 1000")],
        ("E-NEIGHBOURS", "set.planets", "0.3600 deg", "at most 4", "fewer planets"),
    ),
    "more planets than can be numbered": (
        [("planets = 3", "planets = 1001")],
        ("E-RANGE", "set.planets", "1001", "1 to 1000"),
    ),
    "two planets at one angle": (
        [(ANGLES, 'planet_angles = ["0 deg", "120 deg", "120 deg"]')],
        ("E-RANGE", "set.planet_angles", "two of them are equal", "ascending", "sort"),
    ),
    "fewer angles than planets": (
        [(ANGLES, 'planet_angles = ["0 deg", "120 deg"]')],
        ("E-COUNT", "set.planet_angles", "found:   2", "3 angles", "leave planet_angles out"),
    ),
    "planet angles out of order": (
        [(ANGLES, 'planet_angles = ["0 deg", "240 deg", "120 deg"]')],
        ("E-RANGE", "set.planet_angles", "not in ascending order", "ascending", "sort"),
    ),
    "planet angles in radians that are degrees": (
        [(ANGLES, 'planet_angles = ["0 rad", "1 rad", "240 rad"]')],
        ("E-RANGE", "set.planet_angles[2]", "240 rad", "-360 deg to 360 deg", "degrees and radians"),
    ),
    "planet angle without a unit": (
        [(ANGLES, 'planet_angles = ["0 deg", 120, "240 deg"]')],
        ("E-UNIT", "set.planet_angles[1]", "120", '"120 deg"'),
    ),
    "one member both driven and held": (
        [('fixed = "ring"', 'fixed = "sun"')],
        (
            "E-MECHANISM",
            "operation.fixed",
            "driven and held",
            "one member driven",
            "drive the sun and hold the ring",
        ),
    ),
    "no member held": (
        [('fixed = "ring"', "")],
        ("E-KEY-MISSING", "operation.fixed", "sun or ring or carrier"),
    ),
    "two members driven": (
        [('input = "sun"', 'input = ["sun", "carrier"]')],
        ("E-CHOICE", "operation.input", "carrier", "'sun', 'ring' or 'carrier'"),
    ),
    "held ring that nothing keeps from turning": (
        [('foundation_tangential = "1e10 N/m^3"', 'foundation_tangential = "0 N/m^3"')],
        ("E-MECHANISM", "ring.foundation_tangential", "0 N/m^3", "above 0", "give a tangential"),
    ),
}


@pytest.mark.parametrize("defect", REFUSED)
def test_refused_before_anything_is_computed(defect, tmp_path, capsys):
    changes, (code, key, *parts) = REFUSED[defect]
    path = case_of(tmp_path, edited(*changes))
    with pytest.raises(FemgearError) as caught:
        set_deviations(read_case(path))
    error = caught.value
    assert (error.code, error.key, error.exit_code) == (code, key, 2)
    text = str(error)
    for part in parts:
        assert part in text
    assert error.limit or error.remedy
    # the file and, where the entry stands in it, its line
    assert re.match(rf"\[{code}\] \S*set\.toml(:\d+)?: ", text)
    assert main(["check", str(path)]) == 2
    assert f"[{code}]" in capsys.readouterr().err


# --- what deserves a warning and has a defined result ------------------------------------------------


@pytest.mark.parametrize("angles", ["planets = 1", 'planets = 2\nplanet_angles = ["0 deg", "181.333333333 deg"]'])
def test_one_or_two_planets_are_a_warning(angles, tmp_path):
    gears = planetary_set(read_case(case_of(tmp_path, edited(("planets = 3", angles)))))
    assert [warning.code for warning in check_set(gears)] == ["W-PLANETS"]


def test_pin_errors_beyond_the_backlash_are_a_warning_with_the_amount(tmp_path):
    pins = '\n[[set.pin_errors]]\nplanet = 1\ntangential = "40 um"\n'
    case = read_case(case_of(tmp_path, edited(('# backlash = "0.1 mm"', 'backlash = "20 um"')) + pins))
    (warning,) = check_deviations(set_deviations(case), planetary_set(case))
    assert (warning.code, warning.key) == ("W-WEDGING", "set.backlash")
    (amount,) = re.findall(r"exceed the backlash by ([0-9.]+) um", str(warning))
    assert float(amount) > 0 and warning.limit


def test_a_pitch_error_that_separates_a_planet_is_computed_and_said():
    """Teeth of planet 2 that stand 60 um back while they meet the sun leave their planet without load."""
    teeth = ["0 um"] * 40
    for tooth in (*range(5), *range(34, 40)):
        teeth[tooth] = "-60 um"
    case = with_value(read_case(CASE), "planet.individual", [{"planet": 2, "cumulative_pitch": teeth}])
    for key, value in (
        ("static.flank_elements", 8),
        ("static.positions", 16),
        ("static.longest_record", 4),
        ("operation.torque", "20 N m"),
    ):
        case = with_value(case, key, value)
    static = solve_static(case)
    cycle = static.cycle
    assert cycle.open_planets[1].any() and not cycle.open_planets[[0, 2]].any()
    assert np.isfinite(cycle.stiffness).all() and not cycle.force[1][cycle.open_planets[1]].any()
    assert any("[W-OPEN] planet 2" in str(warning) for warning in static.findings)
    # the table marks it where it carries at others
    data = static.dataset()
    data["mesh_force"].loc[{"mesh": "sun-planet 2", "position": data.position[0]}] = 1.0
    for row in describe_static(data).rows:
        assert [cell.endswith("*") for cell in row[1:3]] == [row[0] == "sun-planet 2"] * 2


def test_a_planet_that_never_carries_shows_no_transmission_error():
    """A pin 50 um behind leaves the load to the two other planets; without torque all is zero and shown."""
    settings = {"static.flank_elements": 8, "static.positions": 16}
    case = with_values(read_case(CASE), settings)
    behind = with_value(case, "set.pin_errors", [{"planet": 1, "tangential": "50 um"}])
    for one, shown in ((behind, "-"), (with_value(case, "operation.torque", "0 N m"), "0.0000")):
        static = solve_static(one)
        block = describe_static(static.dataset())
        assert {row[1:3] for row in block.rows if "planet 1" in row[0]} == {(shown, shown)}
        assert any("a dash where it never carries" in one.text for one in static.findings) == (shown == "-")


# --- loads and linear algebra -------------------------------------------------------------------------


@pytest.fixture(scope="module")
def sun():
    gear = planetary_set(read_case(CASE)).sun
    grid = mirror(mesh_outline(half_sector(gear, flank_elements=8, refine=0.5)))
    return gear, grid, stiffness(grid, Material(206e9, 0.3, 7850.0), thickness=gear.face_width)


def test_loads_and_points_outside_the_flank(sun):
    gear, grid, matrix = sun
    with pytest.raises(GridError) as caught:
        edge_load(grid, "flank", [1.0, 0.0])
    assert caught.value.code == "E-GRID" and "flank_left" in caught.value.limit
    beyond = np.array([[gear.tip_radius + 1e-3, 0.0]])
    with pytest.raises(GridError) as caught:
        interpolation(grid, beyond)
    assert caught.value.code == "E-GRID" and f"{beyond[0, 0]:.6g}" in str(caught.value)
    assert caught.value.remedy
    loads = flank_load_columns(grid, flank_stations(grid, gear))
    loads[node_dofs(np.unique(grid.boundaries["cut_left"]))] = 1.0
    with pytest.raises(GridError) as caught:
        condense_sector(grid, matrix, count=27, rim="rim", loads=loads, observations=loads).supported()
    assert caught.value.code == "E-GRID"


def test_a_joining_depth_within_one_element_of_the_flank():
    case = with_value(with_value(read_case(CASE), "static.flank_elements", 8), "static.depth", "0.01 mm")
    with pytest.raises(FemgearError) as caught:
        solve_static(case)
    error = caught.value
    assert (error.code, error.key, error.exit_code) == ("E-RANGE", "static.depth", 2)
    assert "0.01 mm" in str(error) and "at least half an element" in error.limit and error.remedy


H = np.array([[2.0, 1.0], [1.0, 2.0]])
BAD_CONTACT = {
    "indefinite": (np.array([[1.0, 2.0], [2.0, 1.0]]), "E-CONTACT-COMPLIANCE"),
    "singular": (np.ones((2, 2)), "E-CONTACT-COMPLIANCE"),
    "not symmetric": (np.array([[2.0, 1.0], [0.5, 2.0]]), "E-CONTACT-COMPLIANCE"),
    "not finite": (np.array([[2.0, np.nan], [np.nan, 2.0]]), "E-SHAPE"),
    "of another shape": (np.eye(3), "E-SHAPE"),
}


@pytest.mark.parametrize("kind", BAD_CONTACT)
def test_contact_compliance_that_is_none(kind):
    matrix, code = BAD_CONTACT[kind]
    with pytest.raises(ContactError) as caught:
        solve_contact(matrix, np.zeros(2), np.ones((2, 1)), [1.0])
    assert (caught.value.code, caught.value.exit_code) == (code, 3)


def test_a_load_that_no_contact_can_balance():
    with pytest.raises(ContactError) as caught:
        solve_contact(H, np.zeros(2), np.ones((2, 1)), [-1.0])
    assert caught.value.code == "E-CONTACT-OPEN" and caught.value.remedy


def test_an_active_set_that_is_cut_short_falls_back_to_the_general_solver():
    """Steps are bounded; with one step a stage daqp finds what the active set finds."""
    rng = np.random.default_rng(64)
    fallen = 0
    for _ in range(20):
        root = rng.normal(size=(30, 30))
        compliance, gap = root @ root.T + 0.1 * np.eye(30), rng.uniform(0.0, 3.0, 30)
        arms = np.ones((30, 1))
        whole = solve_contact(compliance, gap, arms, [5.0])
        cut = solve_contact(compliance, gap, arms, [5.0], max_steps=1)
        fallen += cut.method == "daqp"
        assert cut.loads == pytest.approx(whole.loads, abs=1e-9 * whole.loads.max())
        assert whole.iterations <= 3 * 200 + 50
        assert replace(whole).residual < 1e-9
    assert fallen >= 10


# --- what a message names ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "key", "line_with", "words"),
    [
        (
            ("[material]\n", '[material]\nroot_stress_limit = "1 Pa"\n'),
            "material.root_stress_limit",
            "root_stress_limit",
            "a stress of 1e-06 MPa",
        ),
        (
            ("[housing]\n", '[housing]\nmicrophone = {distance = "-1 m"}\n'),
            "housing.microphone.distance",
            "microphone",
            "a length",
        ),
        (
            ('speeds = ["250 rpm", "3100 rpm"]', 'speeds = {from = "250 rpm", to = "3100 rpm", count = 1}'),
            "operation.speeds.count",
            "count = 1}",
            "out of range",
        ),
    ],
)
def test_a_refusal_names_quantity_and_line(change, key, line_with, words, tmp_path):
    text = edited(change)
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    with pytest.raises(CaseError, match=words) as caught:
        read_case(tmp_path / "case.toml")
    lines = [number for number, line in enumerate(text.splitlines(), 1) if line.startswith(line_with)]
    lines += [number for number, line in enumerate(text.splitlines(), 1) if line_with in line]
    assert caught.value.key == key and caught.value.file.endswith(f"case.toml:{lines[0]}")


def test_a_grid_that_a_thin_rim_spoils_names_the_rim(tmp_path):
    case = read_case(case_of(tmp_path, edited(('outer_radius = "100 mm"', 'outer_radius = "82.9 mm"'))))
    with pytest.raises(GridError) as caught:
        make_sectors(planetary_set(case), materials_of(case))
    assert caught.value.key == "ring.outer_radius"
    assert "rim is 0.017 modules thick" in caught.value.remedy


def test_an_empty_file_of_tolerances_is_no_case_file(tmp_path, capsys):
    (tmp_path / "tolerances.toml").write_text("")
    file, out = str(tmp_path / "tolerances.toml"), str(tmp_path / "out")
    assert main(["samples", str(CASE), "--tolerances", file, "-o", out]) == 2
    said = capsys.readouterr().err
    assert "tolerances.toml: the file is empty" in said and "case file" not in said


def test_speeds_are_stored_as_they_are_written():
    speeds = np.arange(1.0, 5001.0)
    found = coordinates(speed=speeds * RPM / RPM)["speed"][1]
    assert (speeds * RPM / RPM != speeds).any() and (found == speeds).all()
    assert coordinates(speed=[1000.0 / 3.0])["speed"][1] == pytest.approx(1000.0 / 3.0, rel=1e-12)
