"""What deflection.nc, tables, verdict and picture have of a casing on feet."""

from types import SimpleNamespace

import numpy as np
import pytest
from casings import FEET, casing_tables
from small_gearbox import pair_tables

from femgear.fe.beam import rigid_link
from femgear.trains.gearbox.casing_results import (
    casing_coordinates,
    casing_variables,
    describe_feet,
    largest_foot_force,
)
from femgear.trains.gearbox.figures import deflected_shafts
from femgear.trains.gearbox.results import describe_deflection
from femgear.trains.gearbox.stages import solve_deflections
from femgear.trains.gearbox.verdict import gearbox_verdict
from femgear.trains.reading import read_case


def tables():
    found = pair_tables(helix="15 deg") | {"casing": casing_tables(), "gravity": {}}
    found["casing"]["stands_still"] = ["D"]
    return found


@pytest.fixture(scope="module")
def data():
    return solve_deflections(read_case(tables())).dataset()


def test_feet_and_casing_are_in_the_file(data):
    assert list(data["foot"].values) == list(FEET)
    assert data["foot_place"].values == pytest.approx(np.array(list(FEET.values())) / 1e3)
    assert data["foot_force"].dims == ("load_case", "foot", "axis")
    casing = data.sel(station="casing")
    assert casing["member"].item() == "casing"
    assert (data["casing_motion"].values == casing["displacement"].values).all()
    seats, own = data["seat_displacement"].values[0], data["casing_motion"].values[0]
    assert (seats[3] == 0.0).all()
    offset = data["bearing_place"].values[1] - casing["place"].values
    assert seats[1] == pytest.approx((rigid_link(offset) @ own)[:3])


def test_the_table_of_the_feet_has_every_force(data):
    (block,) = describe_feet(data, 0, "")
    assert [row[0] for row in block.rows] == list(FEET)
    written = np.array([[float(text) for text in row[1:]] for row in block.rows])
    assert written == pytest.approx(data["foot_force"].values[0], rel=1e-4)
    assert describe_deflection(data)[-1].title == "Feet"


def test_the_verdict_names_the_foot_that_carries_most(data):
    ((text, value),) = largest_foot_force(data)
    size = np.linalg.norm(data["foot_force"].values[0], axis=1)
    assert float(value.split()[0]) == pytest.approx(size.max(), rel=1e-3)
    assert value.endswith(f"foot {list(FEET)[int(size.argmax())]}")
    results = SimpleNamespace(case=SimpleNamespace(pair=()), stages=("deflection",), deflection=data, findings=())
    assert text in [row[0] for block in gearbox_verdict(results) for row in block.rows]


def test_the_picture_has_the_casing_where_the_bearings_are(data):
    for way, ax in enumerate(deflected_shafts(data).axes):
        (line,) = (line for line in ax.lines if line.get_label() == "casing at its bearings")
        assert line.get_ydata() == pytest.approx(1e6 * data["seat_displacement"].values[0, :, way])
        # a line across every bearing, to its shaft
        ends = np.array([segment[1] for lines in ax.collections for segment in lines.get_segments()])
        assert ends[:, 1] == pytest.approx(1e6 * data["bearing_displacement"].values[0, :, way])


def test_without_a_casing_there_is_nothing_of_it():
    result = solve_deflections(read_case(pair_tables()))
    assert casing_variables(result.states) == casing_coordinates(result.state) == {}
    data = result.dataset()
    assert not list(describe_feet(data, 0, ""))
    assert not list(largest_foot_force(data))
    assert "casing at its bearings" not in [line.get_label() for line in deflected_shafts(data).axes[0].lines]
