"""Tables of the results of an elastic set."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from report.test_figures import synthetic

from femgear.case.quantities import RPM
from femgear.housing.sensor import stored_lines
from femgear.stages import static_figures as static_figures
from femgear.trains.elastic.results import (
    describe_housing,
    factors_of_speeds,
    known_factors,
    measured_lines,
    remarks_of_casing,
)
from femgear.trains.reading import read_case

CASES = Path(__file__).parents[3] / "cases"


def test_the_table_of_the_housing_has_both_sensors():
    block = describe_housing(synthetic.housing())
    column = block.header.index("microphone [dB(A) re 20 µPa]")
    assert [row[column] for row in block.rows] == ["50.9", "87.7"]
    assert "1 m from the ring" in block.notes[-1] and "over its face width" in block.notes[-1]


def test_load_factors_are_the_largest_of_all_speeds_also_of_those_that_tables_leave_out():
    """Forces 2 + a cos at twelve speeds, a = 0.5 and 1.5 at the seventh of them; one mesh has more than its share."""
    speeds, lines = 12, np.zeros((12, 4, 3), complex)
    lines[..., 0], lines[..., 1] = 2.0, 0.5
    lines[6, 2, 1] = 1.5
    lines[5, 0, 0] = 3.0
    dims = "speed", "mesh", "harmonic"
    parts = {"mesh_force_real": (dims, lines.real), "mesh_force_imag": (dims, lines.imag)}
    meshes = ["sun-planet 1", "sun-planet 2", "planet 1-ring", "planet 2-ring"]
    dynamics = xr.Dataset(parts, {"speed": np.arange(speeds), "mesh": meshes})
    results = SimpleNamespace(stages=("dynamics",), dynamics=dynamics)
    assert factors_of_speeds(results).shape == (speeds, 2)
    factors = known_factors(results)
    assert factors["K_v"] == pytest.approx([1.25, 1.75], rel=1e-12)
    assert factors["K_gamma"] == pytest.approx([3.0 / 2.5, 1.0], rel=1e-12)
    housing = xr.Dataset({"dynamic_factor": (("speed", "mesh_kind"), np.full((speeds, 2), 1.9))})
    fixed = SimpleNamespace(stages=("dynamics", "housing"), dynamics=dynamics, housing=housing)
    assert known_factors(fixed)["K_v"] == pytest.approx([1.9, 1.9])


def test_without_a_response_the_shares_of_the_static_solution_give_the_load_factor():
    """Planet 1 carries nothing, the others half each: 1.5 of the equal share, as in the life over load cases."""
    share = np.array([[0.0, 0.0], [0.4, 0.6], [0.6, 0.4]])
    static = xr.Dataset({"load_share": (("planet", "position"), share)}, {"planet": [1, 2, 3]})
    results = SimpleNamespace(stages=("static",), static=static)
    assert known_factors(results)["K_gamma"] == pytest.approx([1.5, 1.5], rel=1e-12)


def test_measured_lines_stand_beside_the_computed_ones_of_their_order():
    housing = synthetic.housing()
    rpm, lines = float(housing["speed"][1]), stored_lines(housing.isel(speed=1))
    k = int(np.abs(lines.acceleration).argmax())
    order, height = float(lines.order[k]), abs(lines.acceleration[k])
    entry = SimpleNamespace(
        speed=rpm * RPM, source="rig", orders=(order + 0.01, order + 0.5), accelerations=(2 * height, height)
    )
    case = SimpleNamespace(housing=SimpleNamespace(measured=(entry,)))
    (block,) = measured_lines(SimpleNamespace(case=case, housing=housing))
    assert [row[0] for row in block.rows] == ["rig", "rig"]
    assert [row[-1] for row in block.rows] == ["+6.0", "-"] and block.rows[1][4] == "-"
    case.housing.measured = ()
    assert measured_lines(SimpleNamespace(case=case, housing=housing)) == ()


def test_captions_name_a_casing_of_a_file_where_the_case_has_one_alone():
    in_casing, on_foundation = (
        SimpleNamespace(case=read_case(CASES / name)) for name in ("in_a_casing.toml", "planetary_27_40_108.toml")
    )
    (words,) = remarks_of_casing(in_casing, "microphone_spectrum_250_rpm")
    assert "casing radiates" in words
    assert not [*remarks_of_casing(in_casing, "order_spectrum_250_rpm")]
    assert not [*remarks_of_casing(on_foundation, "microphone_spectrum_250_rpm")]
