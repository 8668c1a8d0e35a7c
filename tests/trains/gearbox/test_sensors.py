"""Sensors on casings: u + phi x r on a rigid one, the motion of the node in a file; refusals, results."""

import numpy as np
import pytest
from casings import CENTRE, casing_paths, casing_tables, rigid_tables, write_casing_file

from femgear.case import text
from femgear.errors import CaseError
from femgear.trains.gearbox.casing_file import elastic_casing
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.model import gearbox_model
from femgear.trains.gearbox.modes import solve_gearbox_modes
from femgear.trains.gearbox.results import describe_deflection
from femgear.trains.gearbox.sensors import (
    check_sensors,
    describe_modes_at_sensors,
    gearbox_sensors,
    sensor_notices,
    sensor_rows,
)
from femgear.trains.gearbox.stages import solve_box_modes, solve_deflections
from femgear.trains.reading import read_case
from femgear.trains.registry import check_case

SEAT, FOOT = (3e8, 3e8, 5e8, 7e4, 7e4, 9e4), (4e8, 6e8, 2e8)
PLACES = {"top": (0.06, 0.09, 0.04), "flange": (-0.07, 0.0, 0.095)}
TOP = {"name": "top", "position": ["60 mm", "90 mm", "40 mm"], "direction": "y"}
FLANGE = {"name": "flange", "position": ["-70 mm", "0 mm", "95 mm"], "direction": [0.6, 0.0, -0.8]}


def on_rigid(*sensors, **changes):
    return rigid_tables() | {"sensor": list(sensors or (TOP, FLANGE))} | changes


def refused(tables) -> dict[tuple[str | None, str], CaseError]:
    """Refusals by key and code."""
    with pytest.raises(CaseError) as error:
        read_case(tables) if isinstance(tables, dict) else check_case(tables)
    return {(one.key, one.code): one for one in error.value.problems}


def test_a_sensor_on_a_rigid_casing_moves_by_its_shift_and_turn():
    model = gearbox_model(read_case(on_rigid()))
    rows, station = sensor_rows(model), 6 * model.casing.station
    motion = np.random.default_rng(1).normal(size=model.assembly.count)
    u, phi = np.split(motion[station : station + 6], 2)
    for row, place, direction in zip(rows, PLACES.values(), ((0.0, 1.0, 0.0), (0.6, 0.0, -0.8)), strict=True):
        expected = np.dot(direction, u + np.cross(phi, np.array(place) - CENTRE))
        assert row @ motion == pytest.approx(expected, rel=1e-12)
    others = np.delete(rows, np.arange(station, station + 6), axis=1)
    assert not others.any()


@pytest.mark.parametrize("word", ["x", "-x", "y", "-y", "z", "-z"])
def test_words_for_directions_are_vectors(word):
    vector = [(-1.0 if word.startswith("-") else 1.0) * (axis == word[-1]) for axis in "xyz"]
    by_word, by_numbers = (
        sensor_rows(gearbox_model(read_case(on_rigid(TOP | {"direction": way})))) for way in (word, vector)
    )
    assert (by_word == by_numbers).all()
    assert by_word.any()


def test_a_direction_of_any_length_counts_as_a_unit_vector():
    long, short = (gearbox_sensors(read_case(on_rigid(TOP | {"direction": [0.3 * f, 0.4 * f, 0]})))[0] for f in (2, 1))
    assert long.direction == pytest.approx([0.6, 0.8, 0.0], rel=1e-15)
    assert short.direction == pytest.approx(long.direction, rel=1e-15)


def test_a_sensor_on_a_foot_moves_as_its_force_says():
    position = ["-80 mm", "-100 mm", "0 mm"]
    sensors = [{"name": way, "position": position, "direction": way} for way in "xyz"]
    found = solve_deflection(read_case(on_rigid(*sensors, casing=casing_tables((1.1e8, 2.3e8, 0.7e8)))))
    moved = sensor_rows(found.model) @ found.motion
    assert -moved * (1.1e8, 2.3e8, 0.7e8) == pytest.approx(found.foot_force[0], rel=1e-9)


def box(folder, rows=(), sensors=(), seats=SEAT):
    """Case of the rigid gears in a casing of a file, with rows for sensors at its seats."""
    tables = rigid_tables() | {"sensor": list(sensors)}
    tables["casing"] = write_casing_file(folder, casing_paths(seats, FOOT))
    table = folder / "nodes.csv"
    head, *lines = table.read_text().splitlines()
    lines = [f"{line}," for line in lines] + [f"{number},sensor {name},,,,,{way}" for number, name, way in rows]
    table.write_text("\n".join([f"{head},direction", *lines]))
    path = folder / "box.toml"
    path.write_text(text.write(tables))
    return read_case(str(path))


def test_sensors_of_a_file_move_as_their_nodes(tmp_path):
    """Those on seats as these, and one at the body that the seats hang on as the matrices say."""
    rows = [(2, "A up", "y"), (4, "C along", "-z")]
    case = box(tmp_path, rows, [{"name": "body", "direction": [0.6, 0.8, 0.0]}])
    names = [sensor.name for sensor in gearbox_sensors(case)]
    assert names == ["body", "A up", "C along"]
    found = solve_deflection(case)
    moved, stations = sensor_rows(found.model) @ found.motion, found.motion.reshape(-1, 6)
    own = found.model.casing.seat_stations
    assert moved[1] == pytest.approx(stations[own["A"], 1], rel=1e-9)
    assert moved[2] == pytest.approx(-stations[own["C"], 2], rel=1e-9)
    # in balance the body is where its springs to seats and feet hold it: their forces sum to zero
    feet = found.model.casing.feet
    assert len(feet) == 4
    sides = [spring_motion(found, name) for name in own]
    body = body_motion(found)
    assert moved[0] == pytest.approx(np.dot([0.6, 0.8, 0.0], body[:3]), rel=1e-9)
    pull = np.zeros(3)
    for place, motion in sides:
        pull += np.array(SEAT[:3]) * (motion[:3] - body[:3] - np.cross(body[3:], place - CENTRE))
    assert pull == pytest.approx(-found.foot_force.sum(axis=0), rel=1e-6, abs=1e-6)


def spring_motion(found, name):
    station = found.model.casing.seat_stations[name]
    return np.asarray(found.model.assembly.places)[station], found.motion.reshape(-1, 6)[station]


def body_motion(found) -> np.ndarray:
    """Motion (6,) of the node of the body of the file."""
    casing, body = found.model.casing, elastic_casing(found.model.case)[1]
    motion = found.motion.reshape(-1, 6)
    u, phi = np.split(motion[casing.station], 2)
    elastic = body.shape[1] @ motion[list(casing.elastic)].ravel()[: body.shape[1].shape[1]]
    return np.append(u + np.cross(phi, CENTRE - casing.centre), phi) + elastic


def test_results_have_the_motion_of_every_sensor():
    case = read_case(on_rigid())
    deflection = solve_deflections(case)
    data = deflection.dataset()
    assert list(data["sensor"].values) == ["top", "flange"]
    assert data["sensor_displacement"].dims == ("load_case", "sensor")
    rows = sensor_rows(deflection.state.model)
    assert data["sensor_displacement"].values[0] == pytest.approx(rows @ deflection.state.motion)
    assert data["sensor_place"].values == pytest.approx(np.array(list(PLACES.values())))
    assert data["sensor_direction"].values[1] == pytest.approx([0.6, 0.0, -0.8])
    table = next(block for block in describe_deflection(data) if block.title == "Sensors")
    assert [row[0] for row in table.rows] == ["top", "flange"]
    assert float(table.rows[0][-1]) == pytest.approx(1e6 * data["sensor_displacement"].values[0, 0], rel=1e-3)
    modes = solve_box_modes(case, deflection)
    shapes = modes.dataset()
    assert shapes["sensor_shape"].dims == ("sensor", "mode")
    assert shapes["sensor_shape"].values == pytest.approx(rows @ modes.gearbox_modes.motion)
    (block,) = describe_modes_at_sensors(shapes)
    size, hertz = np.abs(shapes["sensor_shape"].values[0]), shapes["frequency"].values
    first = int(np.where(hertz > 0.0, size, 0.0).argmax())
    assert block.rows[0][-1].startswith(f"{first + 1} ({hertz[first]:.0f} Hz")


def test_without_sensors_results_are_as_before():
    deflection = solve_deflections(read_case(rigid_tables()))
    data = deflection.dataset()
    assert not [name for name in (*data, *data.coords) if "sensor" in str(name)]
    assert not list(describe_modes_at_sensors(solve_box_modes(read_case(rigid_tables()), deflection).dataset()))
    alone = {name: value for name, value in rigid_tables().items() if name != "casing"}
    model = gearbox_model(read_case(alone))
    assert sensor_rows(model).shape == (0, model.assembly.count)


def test_modes_of_a_file_at_its_sensors_do_not_hang_on_the_sensors(tmp_path):
    (tmp_path / "with").mkdir()
    (tmp_path / "without").mkdir()
    heard = box(tmp_path / "with", [(2, "A up", "y")], [{"name": "body", "direction": "x"}])
    silent = box(tmp_path / "without")
    frequencies = [solve_gearbox_modes(solve_deflection(case)).modes.frequency for case in (heard, silent)]
    assert (frequencies[0] == frequencies[1]).all()


def test_a_sensor_without_a_casing_that_moves_is_refused_with_what_to_do():
    tables = on_rigid()
    del tables["casing"]
    problem = refused(tables)["casing", "E-KEY-MISSING"]
    assert "[[casing.foot]]" in (problem.remedy or "")


def test_what_is_wrong_with_sensors_is_told_at_once():
    bare = {"name": "bare"}
    found = refused(on_rigid(TOP, TOP, bare, FLANGE | {"direction": [0.0, 0.0, 0.0]}))
    assert set(found) == {
        ("sensor[1].name", "E-DUPLICATE"),
        ("sensor[2].position", "E-KEY-MISSING"),
        ("sensor[2].direction", "E-KEY-MISSING"),
        ("sensor[3].direction", "E-RANGE"),
    }


def test_a_word_that_is_no_direction_is_refused():
    ((key, _),) = refused(on_rigid(TOP | {"direction": "up"}))
    assert key == "sensor[0].direction"


def test_sensors_that_nothing_moves_are_refused():
    case = read_case(on_rigid(TOP | {"direction": "z"}, motions="plane"))
    assert refused(case)[("sensor", "E-CHOICE")].value == "top"
    held = read_case(on_rigid(casing=casing_tables("rigid")))
    assert refused(held)[("sensor", "E-CHOICE")].value == "top, flange"
    check_sensors(read_case(on_rigid()))


def test_names_places_and_directions_of_a_file_are_checked(tmp_path):
    case = box(tmp_path, [(2, "A up", "y"), (2, "A up", "x")], [{"name": "body", "direction": "x"}, {"name": "a up"}])
    found = refused(case)
    assert "did you mean A up" in (found["sensor[1].name", "E-CHOICE"].remedy or "")
    assert found["casing.nodes", "E-DUPLICATE"].value == "A up"
    assert (found["casing.nodes", "E-DUPLICATE"].file or "").endswith("nodes.csv")
    with pytest.raises(CaseError, match=r"sensor\[0\]\.position"):
        box(tmp_path, sensors=[TOP])


def test_a_node_that_does_not_move_as_its_sensor_feels_is_refused(tmp_path):
    case = box(tmp_path)
    table = tmp_path / "nodes.csv"
    K, M = (np.load(tmp_path / "casing.npz")[name] for name in ("stiffness", "mass"))
    # a node of its own that keeps x alone, sprung to the body
    K, M = np.pad(K, (0, 1)), np.pad(M, (0, 1))
    K[[0, -1], [0, -1]] += 1e8
    K[[0, -1], [-1, 0]] -= 1e8
    M[-1, -1] = 0.1
    np.savez(tmp_path / "casing.npz", stiffness=K, mass=M)
    table.write_text(table.read_text() + f"\n99,sensor cover,{','.join(map(repr, CENTRE.tolist()))},1,y")
    case = read_case(str(tmp_path / "box.toml"))
    assert refused(case)["casing.nodes", "E-SHAPE"].value == "node 99, without y"
    table.write_text(table.read_text().replace(",1,y", ",1,x"))
    check_sensors(read_case(str(tmp_path / "box.toml")))


def test_sensors_without_a_direction_are_told(tmp_path):
    (finding,) = sensor_notices(box(tmp_path))
    assert finding.code == "W-UNUSED"
    assert "body" in finding.text
    assert not list(sensor_notices(box(tmp_path, sensors=[{"name": "body", "direction": "x"}])))
    assert not list(sensor_notices(read_case(on_rigid())))
