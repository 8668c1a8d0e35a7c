"""A case whose ring stands on supports: both ways and one way, lines and sound on disk, refusals."""

from pathlib import Path

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.housing.sensor import stored_lines
from femgear.housing.sound import pressure_level, stored_sound
from femgear.trains.elastic.stages import solve_dynamics, solve_housing, solve_modes
from femgear.trains.reading import read_case, with_values
from femgear.trains.static.stages import solve_static

FEET = [
    {"angle": f"{angle} deg", "radial_stiffness": "4e8 N/m", "tangential_stiffness": "2e8 N/m"}
    for angle in (35, 145, 215, 325)
]
SMALL = {
    "static.positions": 8, "static.flank_elements": 6, "static.stresses": False, "housing.published": [],
    "dynamics.mesh_harmonics": 2, "operation.speeds": ["400 rpm", "3100 rpm"], "runup.count": 0,
}  # fmt: skip
WEAK = [{"angle": "10 deg", "radial_stiffness": "1 N/m", "tangential_stiffness": "1 N/m", "width": "9 mm"}]


def reference(**entries):
    file = Path(__file__).parents[3] / "cases" / "planetary_27_40_108.toml"
    return with_values(read_case(file), SMALL | entries)


@pytest.fixture(scope="module")
def before():
    """Static solution and modes of sets of one kind."""

    def solved(case):
        static = solve_static(case)
        return static, solve_modes(case, static)

    return solved(reference())


def heard(case, static, modes):
    return solve_housing(case, solve_dynamics(case, static, modes))


def test_next_to_no_support_is_the_ring_on_its_foundation(before):
    """Hardly damped: modal damping of the set is not that of gears and ring apart."""
    present = reference(**{"dynamics.damping_ratio": 1e-4, "operation.speeds": ["400 rpm"]})
    case = with_values(present, {"housing.support": WEAK})
    modes = solve_modes(case, before[0])
    dynamics = solve_dynamics(case, before[0], modes)
    assert dynamics.fixed is not None
    data, other = (one.dataset() for one in (solve_housing(case, dynamics), heard(present, before[0], modes)))
    np.testing.assert_allclose(data["level"], data["one_way_level"], rtol=1e-6)
    np.testing.assert_allclose(data["level"], other["level"], rtol=0.01)
    for name in ("pressure_level", "power_level", "equivalent_power_level"):
        # nodal diameters to 14, and waves that run around in the frame of the carrier
        np.testing.assert_allclose(data[name], other[name], atol=0.3)
    mean = dynamics.response.force[:, [0, 3], 0]
    np.testing.assert_allclose(dynamics.fixed[1].force[..., 0], mean, rtol=1e-6)


def test_feet_change_the_level_and_the_file_holds_what_is_heard(before):
    case = reference(**{"housing.support": FEET})
    data = heard(case, *before).dataset()
    assert abs(data["level"] / data["one_way_level"] - 1.0).max() > 0.2
    assert data["two_way_residual"].max() < 1e-10
    assert data["order_tail"].max() < 0.1
    lines, pressure = stored_sound(data)
    assert lines.method == "supports" == stored_lines(data).method
    assert not (lines.order % 3).any()
    np.testing.assert_allclose(pressure_level(pressure, lines.frequency), data["pressure_level"], atol=1e-4)


def test_planets_that_differ_make_all_orders():
    pin = {"planet": 1, "tangential": "3 um"}
    case = reference(**{"housing.support": FEET, "set.pin_errors": [pin], "housing.nodal_diameters": 6})
    case = with_values(case, {"dynamics.mesh_harmonics": 1, "dynamics.response_harmonics": 2})
    static = solve_static(case)
    lines = heard(case, static, solve_modes(case, static)).exact
    size = np.abs(lines.acceleration[1])
    assert size[lines.order % 3 != 0].max() > 1e-3 * size.max()


@pytest.mark.parametrize(
    ("entries", "code"),
    [
        ({"housing.support": [FEET[0], {**FEET[1], "angle": "-325 deg"}]}, "E-DUPLICATE"),
        ({"housing.support": FEET, "housing.form": "linear"}, "E-CHOICE"),
        ({"housing.support": FEET, "housing.nodal_diameters": 18}, "E-RANGE"),
        ({"housing.support": [{**FEET[0], "width": "1 m"}]}, "E-SUPPORT"),
        (
            {"housing.support": FEET, "dynamics.mesh_harmonics": 20, "dynamics.response_harmonics": 120},
            "E-MEMORY",
        ),
    ],
)
def test_refused(before, entries, code):
    with pytest.raises(CaseError) as error:
        case = reference(**entries)
        static, modes = before
        solve_modes(case, static)
        solve_dynamics(case, static, modes)
    assert error.value.code == code
