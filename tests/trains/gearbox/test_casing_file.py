"""Casings from files: a rigid one is the rigid casing, elastic paths are springs of the case; refusals."""

from dataclasses import replace

import numpy as np
import pytest
from casings import (
    CENTRE,
    MASS,
    STIFFNESS,
    TENSOR,
    Path,
    body_matrices_of,
    casing_paths,
    rigid_tables,
    write_casing_file,
)
from random_gearboxes import random_casing, random_gearbox
from scipy.linalg import eigh

from femgear import cli
from femgear.case import text
from femgear.errors import CaseError
from femgear.system.assembly import GROUND
from femgear.trains.gearbox.casing import casing_seats
from femgear.trains.gearbox.casing_file import (
    casing_element,
    casing_notices,
    check_casing_file,
    describe_casing,
    elastic_casing,
)
from femgear.trains.gearbox.deflection import Deflection, solve_deflection
from femgear.trains.gearbox.model import bearing_places
from femgear.trains.gearbox.modes import solve_gearbox_modes
from femgear.trains.gearbox.stages import describe_gearbox, solve_box_modes, solve_deflections
from femgear.trains.reading import read_case
from femgear.trains.registry import check_case

pytestmark = pytest.mark.usefixtures("pictures_undrawn", "coarse_states")

LARGEST = 1e-9
# beyond what counts as rigid
STIFF = 1e18


def apart(found, expected) -> float:
    """Largest difference over the largest value."""
    return float(np.abs(found - expected).max() / np.abs(expected).max())


def feet_tables(stiffness=STIFFNESS):
    return [
        {"name": foot["name"], "stiffness": [f"{value!r} N/m" for value in stiffness]}
        for foot in rigid_tables()["casing"]["foot"]
    ]


def box(folder, paths, foot=None, matrices=None, **changes):
    """Case of the rigid gears in a casing of a file."""
    tables = rigid_tables() | {"gravity": {}} | changes
    tables["casing"] = write_casing_file(folder, paths, matrices) | {"foot": feet_tables() if foot is None else foot}
    return tables


def read(folder, tables):
    """Read tables as a case beside the files of its casing."""
    path = folder / "box.toml"
    path.write_text(text.write(tables))
    return read_case(str(path))


def solved(folder, tables) -> Deflection:
    return solve_deflection(read(folder, tables))


def whole_body(paths) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass, centre of mass and tensor about it of the body with its nodes."""
    masses = np.array([MASS, *(path.mass for path in paths)])
    places = np.array([CENTRE, *(path.place for path in paths)])
    centre = masses @ places / masses.sum()
    tensor = TENSOR.copy()
    for path in paths:
        tensor = tensor + np.eye(3) * path.mass * 1e-4 * (len(path.stiffness) == 6)
    for mass, place in zip(masses, places - centre, strict=True):
        tensor = tensor + mass * (place @ place * np.eye(3) - np.outer(place, place))
    return float(masses.sum()), centre, tensor


def test_the_file_of_a_rigid_body_on_feet_is_the_rigid_casing(tmp_path):
    paths = casing_paths([STIFF] * 6, [STIFF] * 3)
    of_file = solved(tmp_path, box(tmp_path, paths))
    mass, centre, tensor = whole_body(paths)
    tables = rigid_tables() | {"gravity": {}}
    tables["casing"] |= {
        "mass": f"{mass!r} kg",
        "centre": [f"{value!r} m" for value in centre.tolist()],
        "inertia": [f"{value!r} kg m^2" for value in np.diag(tensor).tolist()],
        "products": [f"{-float(tensor[i, j])!r} kg m^2" for i, j in ((0, 1), (0, 2), (1, 2))],
    }
    rigid = solve_deflection(read_case(tables))
    assert apart(of_file.foot_force, rigid.foot_force) <= LARGEST
    assert apart(of_file.bearing_force, rigid.bearing_force) <= LARGEST
    assert apart(of_file.motion[:18], rigid.motion[:18]) <= LARGEST
    frequency = [solve_gearbox_modes(one).modes.frequency for one in (of_file, rigid)]
    assert len(frequency[0]) == len(frequency[1]) == 18
    assert apart(frequency[0][1:], frequency[1][1:]) <= LARGEST


def series(*stiffness) -> float:
    return 1.0 / sum(1.0 / value for value in stiffness)


def test_paths_of_the_file_are_springs_of_the_case(tmp_path):
    seat, foot = (3e8, 3e8, 5e8, 7e4, 7e4, 9e4), (4e8, 6e8, 2e8)
    paths = casing_paths(seat, foot)
    of_file = solved(tmp_path, box(tmp_path, paths))
    tables = rigid_tables()
    for bearing in tables["bearing"]:
        bearing |= {"radial": f"{series(2e8, 3e8)!r} N/m", "axial": f"{series(1e8, 5e8)!r} N/m"}
        bearing["tilt"] = f"{series(3e4, 7e4)!r} N m/rad"
    for one in tables["casing"]["foot"]:
        one["stiffness"] = [f"{series(a, b)!r} N/m" for a, b in zip(foot, STIFFNESS, strict=True)]
    without = box(tmp_path, paths)
    del without["gravity"]
    light, springs = solved(tmp_path, without), solve_deflection(read_case(tables))
    assert apart(light.foot_force, springs.foot_force) <= LARGEST
    assert apart(light.bearing_force, springs.bearing_force) <= LARGEST
    assert apart(light.motion[:12], springs.motion[:12]) <= LARGEST
    # with weight, feet carry all of it
    mass = MASS + 9.0 + 0.05 * len(paths)
    assert of_file.foot_force[:, 1].sum() == pytest.approx(9.80665 * mass, rel=LARGEST)


def test_modes_are_those_of_the_whole_system_written_out(tmp_path):
    seat, foot = (3e8, 3e8, 5e8, 7e4, 7e4, 9e4), (4e8, 6e8, 2e8)
    paths = casing_paths(seat, foot)
    found = solve_gearbox_modes(solved(tmp_path, box(tmp_path, paths)))
    K, M = body_matrices_of(paths)
    count = len(K)
    stiffness, mass = np.zeros((12 + count, 12 + count)), np.zeros((12 + count, 12 + count))
    stiffness[12:, 12:], mass[12:, 12:] = K, M
    for body, (m, polar, transverse) in enumerate(((3.0, 4e-3, 5e-3), (6.0, 9e-3, 8e-3))):
        own = slice(6 * body, 6 * body + 6)
        mass[own, own] = np.diag([m, m, m, transverse, transverse, polar])
    for number in range(4):
        body, z = number // 2, (-0.04, 0.04)[number % 2]
        rows = np.zeros((6, 12 + count))
        cross = np.array([[0.0, z, 0.0], [-z, 0.0, 0.0], [0.0, 0.0, 0.0]])
        rows[:, 6 * body : 6 * body + 6] = np.block([[np.eye(3), cross], [np.zeros((3, 3)), np.eye(3)]])
        rows[:, 18 + 6 * number : 24 + 6 * number] = -np.eye(6)
        stiffness += rows.T @ np.diag([2e8, 2e8, 1e8, 3e4, 3e4, 0.0]) @ rows
    for number in range(4):
        own = np.arange(42 + 3 * number, 45 + 3 * number)
        stiffness[own, own] += STIFFNESS
    alpha = np.radians(20.0)
    approach = np.zeros(12 + count)
    normal = np.array([np.sin(alpha), np.cos(alpha), 0.0])
    for body, x in ((0, 0.036), (1, -0.054)):
        sign = 1.0 - 2.0 * body
        approach[6 * body : 6 * body + 3] = sign * normal
        approach[6 * body + 5] = sign * normal[1] * x
    stiffness += 4e8 * np.outer(approach, approach)
    square = eigh(stiffness, mass, eigvals_only=True)
    assert len(found.modes.frequency) <= len(square)
    expected = np.sqrt(square[1 : len(found.modes.frequency)]) / (2.0 * np.pi)
    assert apart(found.modes.frequency[1:], expected) <= LARGEST
    # lowest one against itself
    assert found.modes.frequency[1:8] == pytest.approx(expected[:7], rel=1e-8)


SEAT, FOOT = (3e8, 3e8, 5e8, 7e4, 7e4, 9e4), (4e8, 6e8, 2e8)


def edited(folder, old: str, new: str) -> None:
    path = folder / "nodes.csv"
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))


def problems(folder, tables) -> dict[tuple[str | None, str], CaseError]:
    """Refusals of a run by key and code."""
    case = read(folder, tables)
    with pytest.raises(CaseError) as error:
        check_case(case)
    return {(one.key, one.code): one for one in error.value.problems}


def test_seats_without_a_node_too_many_and_far_ones_are_named_at_once(tmp_path):
    tables = box(tmp_path, casing_paths(SEAT, FOOT, "ABC"))
    edited(tmp_path, "seat B", "seat b")
    edited(tmp_path, "seat C,0.09,0.0,-0.04", "seat C,0.09,0.0,-0.044")
    tables["casing"]["foot"][1]["name"] = "left back"
    found = problems(tmp_path, tables)
    missing = found["casing.nodes", "E-KEY-MISSING"]
    assert missing.value == "B, D"
    assert "did you mean B" in (found["casing.nodes", "E-CHOICE"].remedy or "")
    far = found["casing.nodes", "E-RANGE"]
    assert "seat C" in far.message
    assert "4 mm off" in str(far.value)
    assert str(far.limit).startswith("2.6 mm")
    assert "left rear" in (found["casing.foot[1].name", "E-CHOICE"].remedy or "")
    # the turns of a body with a node off its place strain it
    assert ("casing.file", "E-SUPPORT") in found
    assert len(found) == 5
    assert far.file is not None
    assert far.file.endswith("nodes.csv")
    assert found["casing.file", "E-SUPPORT"].file == str(tmp_path / "casing.npz")


def test_a_seat_stands_still_only_if_the_case_says_so(tmp_path):
    tables = box(tmp_path, casing_paths(SEAT, FOOT, "ABC"))
    assert list(problems(tmp_path, tables)) == [("casing.nodes", "E-KEY-MISSING")]
    tables["casing"]["stands_still"] = ["D"]
    found = solved(tmp_path, tables)
    assert found.model.bearings[3].stations[0] == GROUND
    weight = 9.80665 * (MASS + 9.0 + 7 * 0.05)
    assert found.foot_force[:, 1].sum() + found.bearing_force[3, 1] == pytest.approx(weight, rel=LARGEST)
    tables = box(tmp_path, casing_paths(SEAT, FOOT))
    tables["casing"]["stands_still"] = ["D"]
    assert list(problems(tmp_path, tables)) == [("casing.stands_still[0]", "E-CHOICE")]


def test_feet_that_are_not_listed_are_rigid(tmp_path):
    tables = box(tmp_path, casing_paths(SEAT, FOOT), foot=[])
    rigid = solved(tmp_path, tables)
    tables["casing"]["foot"] = [
        {"name": name, "stiffness": ["rigid"] * 3} for name in ("left front", "left rear", "right front", "right")
    ]
    assert (solved(tmp_path, tables).foot_force == rigid.foot_force).all()
    feet = rigid.model.casing.feet
    assert [foot.name for foot in feet] == ["left front", "left rear", "right front", "right"]
    for springs in feet:
        at = [6 * station + way for station in springs.stations if station != GROUND for way in range(6)]
        assert np.abs(springs.rows[:3, 6:] @ rigid.motion[at]).max() <= 1e-15


def test_a_node_off_its_seat_is_bridged_by_a_rigid_link(tmp_path):
    paths = casing_paths([STIFF] * 6, [STIFF] * 3)
    there = solved(tmp_path, box(tmp_path, paths))
    moved = [
        replace(path, place=(*path.place[:2], path.place[2] + 2e-3)) if path.name == "B" else path for path in paths
    ]
    off = solved(tmp_path, box(tmp_path, moved))
    assert apart(off.foot_force[:, [0, 2]], there.foot_force[:, [0, 2]]) <= 1e-4
    assert apart(off.bearing_force, there.bearing_force) <= LARGEST


def test_a_ring_in_the_casing_of_a_file(tmp_path):
    planetary = {
        "name": "set",
        "sun": "input",
        "carrier": "output",
        "ring": "casing",
        "gears": {"teeth": [36, 24, 84], "module": "1.5 mm", "helix_angle": "10 deg", "face_width": "20 mm"},
        "sun_mesh": {"stiffness": "3e8 N/m"},
        "ring_mesh": {"stiffness": "3e8 N/m"},
        "planet": {"mass": "0.4 kg", "inertia": "1e-4 kg m^2"},
    }
    names = ("A", "B", "C", "D")
    paths = [replace(p, place=(0.0, *p.place[1:])) if p.role == "seat" else p for p in casing_paths(SEAT, FOOT, names)]
    paths.append(Path("seat", "ring of set", (0.0, 0.0, 0.0), (5e8, 5e8, 5e8, 5e6, 5e6, 5e6)))
    tables = box(tmp_path, paths, planetary=[planetary], pair=[])
    tables["shaft"][1].pop("axis")
    del tables["gravity"]
    found = solved(tmp_path, tables)
    ring = found.motion.reshape(-1, 6)[found.model.casing.seat_stations["ring of set"]]
    # the torque of the ring turns its seat by that of its path beyond the casing
    torque = found.model.load.reshape(-1, 6)[:2, 5].sum()
    station = found.model.casing.station
    assert ring[5] - found.motion.reshape(-1, 6)[station, 5] == pytest.approx(torque / 5e6, rel=1e-3)
    feet = np.cross(found.model.casing.foot_places, found.foot_force)[:, 2].sum()
    assert feet == pytest.approx(-torque, rel=LARGEST)
    data = solve_deflections(read(tmp_path, tables)).dataset()
    stations = list(data["station"].values)
    assert not [name for name in stations if "elastic" in name]
    assert {"casing", "seat A", "seat ring of set"} <= set(stations)
    motion = data["displacement"].sel(station="seat A").values[0, :3]
    assert data["seat_displacement"].values[0, 0] == pytest.approx(motion)
    modes = solve_box_modes(read(tmp_path, tables), solve_deflections(read(tmp_path, tables)))
    found = modes.gearbox_modes
    assert found.kinetic.sum(axis=0) == pytest.approx(np.ones(found.kinetic.shape[1]), rel=1e-9)
    elastic = found.modes.frequency > 0.0
    assert found.strain.sum(axis=0)[elastic] == pytest.approx(np.ones(elastic.sum()), rel=1e-9)
    assert "casing" in found.parts
    assert len(modes.dataset()["station"]) == len(stations)


def test_seats_of_three_directions_are_told(tmp_path):
    paths = casing_paths(SEAT[:3], FOOT)
    case = read(tmp_path, box(tmp_path, paths))
    (finding,) = casing_notices(case)
    assert finding.code == "W-BEARING"
    assert "A, B, C, D" in finding.text
    # moments of the bearings act on the casing as a whole
    assert solve_deflection(case).residual < 1e-9
    assert not list(casing_notices(read(tmp_path, box(tmp_path, casing_paths(SEAT, FOOT)))))
    assert not list(casing_notices(read_case(rigid_tables())))


def test_check_tells_what_the_casing_is(tmp_path):
    tables = box(tmp_path, casing_paths(SEAT, FOOT))
    case = read(tmp_path, tables)
    (block,) = describe_casing(case)
    rows = dict(block.rows)
    assert rows["mass"] == f"{MASS + 8 * 0.05:g} kg"
    assert rows["sits in it"] == "A, B, C, D"
    assert rows["feet"] == "left front, left rear, right front, right"
    first = np.sqrt(eigh(*body_matrices_of(casing_paths(SEAT, FOOT)), eigvals_only=True)[6]) / (2.0 * np.pi)
    assert f"30 + 6 elastic motions, first mode {first:.4g} Hz" in rows["gives way"].replace("36", "30 + 6")
    rigid = rigid_tables()
    rigid["casing"]["stands_still"] = ["C"]
    (block,) = describe_casing(read_case(rigid))
    assert dict(block.rows)["gives way"] == "rigid"
    assert dict(block.rows)["sits in it"] == "A, B, D"
    assert dict(block.rows)["stands still"] == "C"
    del rigid["casing"]
    assert not list(describe_casing(read_case(rigid)))
    assert [block.title for block in describe_gearbox(case)][-1] == "Casing"


def test_pages_of_a_run_need_no_file(tmp_path):
    """Beside results there is the case without the files of its casing."""
    case = read(tmp_path, box(tmp_path, casing_paths(SEAT[:3], FOOT)))
    away = tmp_path / "out"
    away.mkdir()
    (away / "case.toml").write_text(case.source)
    moved = read_case(str(away / "case.toml"))
    (block,) = describe_casing(moved)
    assert dict(block.rows) == {"file": "casing.npz", "sits in it": "A, B, C, D"}
    assert not list(casing_notices(moved))
    with pytest.raises(CaseError, match="E-FILE"):
        check_case(moved)


def test_a_run_writes_its_page(tmp_path):
    tables = box(tmp_path, casing_paths(SEAT, FOOT))
    read(tmp_path, tables)
    assert cli.main(["run", str(tmp_path / "box.toml"), "-o", str(tmp_path / "out")]) == 0
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "largest foot force" in page
    assert cli.main(["report", str(tmp_path / "out")]) == 0


def test_other_files_than_those_that_were_read_are_refused(tmp_path):
    case = read(tmp_path, box(tmp_path, casing_paths(SEAT, FOOT)))
    write_casing_file(tmp_path, casing_paths((4e8, *SEAT[1:]), FOOT))
    with pytest.raises(CaseError, match="E-OTHER-CASE"):
        casing_element(case)
    check_casing_file(read_case(rigid_tables()))


def test_files_are_named_by_their_entries(tmp_path):
    tables = box(tmp_path, casing_paths(SEAT, FOOT))
    (tmp_path / "nodes.csv").unlink()
    with pytest.raises(CaseError, match=r"casing\.nodes"):
        read(tmp_path, tables)
    del tables["casing"]["nodes"]
    tables["casing"] |= {"mass": "1 kg"}
    tables["casing"]["foot"][0]["position"] = ["0 m", "0 m", "0 m"]
    with pytest.raises(CaseError) as error:
        read(tmp_path, tables)
    assert [one.key for one in error.value.problems] == ["casing.mass", "casing.nodes", "casing.foot[0].position"]


@pytest.mark.parametrize(
    ("entry", "content", "words"),
    [
        ("nodes", "node,role".encode("utf-16"), "not text in UTF-8"),
        ("file", b"", "no archive"),
        ("file", bytes(range(256)), "no archive"),
    ],
)
def test_damaged_files_are_named_with_a_remedy(tmp_path, entry, content, words):
    tables = box(tmp_path, casing_paths(SEAT, FOOT))
    (tmp_path / tables["casing"][entry]).write_bytes(content)
    with pytest.raises(CaseError) as error:
        casing_element(read(tmp_path, tables))
    assert (error.value.code, error.value.key) == ("E-FILE", f"casing.{entry}")
    assert words in error.value.message and error.value.remedy


def test_a_folder_is_no_file_of_a_casing(tmp_path):
    tables = box(tmp_path, casing_paths(SEAT, FOOT))
    (tmp_path / "folder").mkdir()
    tables["casing"]["file"] = "folder"
    with pytest.raises(CaseError) as error:
        read(tmp_path, tables)
    assert (error.value.key, error.value.message) == ("casing.file", "this is a folder")


def test_a_limit_of_frequency_leaves_what_the_interface_gives_way(tmp_path):
    tables = box(tmp_path, casing_paths(SEAT, FOOT))
    whole = elastic_casing(read(tmp_path, tables))[1]
    tables["casing"]["max_frequency"] = "10 Hz"
    less = elastic_casing(read(tmp_path, tables))[1]
    assert len(whole.stiffness) - len(less.stiffness) == 6
    without = {name: value for name, value in tables.items() if name != "gravity"}
    few = solved(tmp_path, without)
    del without["casing"]["max_frequency"]
    assert apart(few.foot_force, solved(tmp_path, without).foot_force) <= LARGEST


@pytest.mark.parametrize("seed", [0, 3, 11])
def test_a_random_gearbox_in_the_casing_of_a_file_balances(tmp_path, seed):
    """Nodes of seats with and without rotations, up to half a millimetre off; weight, held shafts and rings."""
    tables, rng = random_gearbox(seed, 2), np.random.default_rng([seed, 44])
    tables["casing"] = random_casing(tables, rng)
    standing = tables["casing"].get("stands_still", [])
    case = read_case(tables)
    size = 3 if seed else 6
    paths = [
        Path(
            "seat",
            name,
            tuple((place + rng.uniform(-5e-4, 5e-4, 3)).tolist()),
            tuple(np.append(10.0 ** rng.uniform(8.0, 9.5, 3), 10.0 ** rng.uniform(4.0, 6.0, 3))[:size].tolist()),
        )
        for name, place in casing_seats(case).items()
        if name not in standing
    ]
    for name, foot in zip(case.casing.foot_names, case.casing.foot, strict=True):
        paths.append(Path("foot", name, foot.position, tuple((10.0 ** rng.uniform(8.0, 9.5, 3)).tolist())))
    feet = [{name: foot[name] for name in ("name", "stiffness")} for foot in tables["casing"]["foot"]]
    tables["casing"] = write_casing_file(tmp_path, paths) | {"foot": feet, "stands_still": standing}
    found = solved(tmp_path, tables)
    load, places = found.model.load.reshape(-1, 6), np.asarray(found.model.assembly.places)
    force, at = [found.foot_force], [found.model.casing.foot_places]
    still = [name in standing for name in found.model.bearing_names]
    force.append(found.bearing_force[still][:, :3])
    at.append(bearing_places(found.model)[still])
    moment = (load[:, 3:] + np.cross(places, load[:, :3])).sum(axis=0) + found.bearing_force[still][:, 3:].sum(axis=0)
    moment = moment + np.cross(np.vstack(at), np.vstack(force)).sum(axis=0)
    total = load[:, :3].sum(axis=0) + np.vstack(force).sum(axis=0)
    assert np.abs(np.append(total, moment)).max() <= 1e-8 * max(np.abs(load).max(), found.mesh_force.max())
