"""Contents of the four result files: names, dimensions, units, and that they say what was computed."""

from pathlib import Path
from unittest.mock import MagicMock

import numpy as np
import pytest
from page_examples import check_documented

from femgear.housing.orders import order_level
from femgear.housing.sensor import fixed_sensor_signal, stored_lines
from femgear.stages.static import solve_static
from femgear.stages.static_results import HELIX_VARIABLES, SLICE_VARIABLES
from femgear.storage.results import _attribute, response_variables
from femgear.trains.elastic.stages import solve_dynamics, solve_housing, solve_modes
from femgear.trains.reading import read_case, with_value

pytestmark = pytest.mark.usefixtures("coarse_states")

ROOT = Path(__file__).parents[2]
PLACES = {
    "static": {
        "ste": ("mesh", "position"),
        "ste_overall": ("planet", "position"),
        "mesh_force": ("mesh", "position"),
        "mesh_stiffness": ("mesh", "position"),
        "mesh_stiffness_secant": ("mesh", "position"),
        "tooth_load": ("mesh", "tooth", "position"),
        "load_share": ("planet", "position"),
        "max_pressure": ("mesh", "position"),
    },
    "modes": {
        "frequency": ("mode",),
        "damping_ratio": ("mode",),
        "kind": ("mode",),
        "nodal_diameter": ("mode",),
        "shape": ("dof", "mode"),
        "ring_shape_real": ("mode", "circumferential"),
        "ring_shape_imag": ("mode", "circumferential"),
    },
    "dynamics": {
        "dte_real": ("speed", "mesh", "harmonic"),
        "dte_imag": ("speed", "mesh", "harmonic"),
        "mesh_force_real": ("speed", "mesh", "harmonic"),
        "mesh_force_imag": ("speed", "mesh", "harmonic"),
        "converged": ("speed",),
        "iterations": ("speed",),
        "spectral_radius": ("speed",),
        "floquet_multiplier": ("speed",),
        "mesh_frequency": ("speed",),
        "ring_real": ("harmonic", "circumferential"),
        "ring_tangential_imag": ("harmonic", "circumferential"),
    },
    "housing": {
        "lines_real": ("speed", "order"),
        "lines_imag": ("speed", "order"),
        "level": ("speed",),
        "carrier_speed": ("speed",),
    },
}
UNITS = {"ste": "m", "mesh_force": "N", "mesh_stiffness": "N/m", "load_share": "1", "frequency": "Hz"}
UNITS |= {"dte_real": "m", "mesh_force_real": "N", "lines_real": "m", "level": "m/s^2"}


@pytest.fixture(scope="module")
def results():
    case = with_value(read_case(ROOT / "cases" / "planetary_27_40_108.toml"), "static.positions", 16)
    case = with_value(case, "static.flank_elements", 8)
    static = solve_static(case)
    modes = solve_modes(case, static)
    dynamics = solve_dynamics(case, static, modes)
    return {
        "static": static,
        "modes": modes,
        "dynamics": dynamics,
        "housing": solve_housing(case, dynamics),
    }


@pytest.fixture(scope="module")
def datasets(results):
    return {name: result.dataset() for name, result in results.items()}


@pytest.mark.parametrize("stage", PLACES)
def test_names_and_dimensions(datasets, stage):
    for name, dims in PLACES[stage].items():
        assert datasets[stage][name].dims == dims, name


@pytest.mark.parametrize("stage", PLACES)
def test_everything_has_units_and_a_name_and_is_finite(datasets, stage):
    for name, variable in datasets[stage].variables.items():
        assert variable.attrs["units"] and variable.attrs["long_name"], name
        assert variable.attrs["units"] == UNITS.get(name, variable.attrs["units"])
        if variable.dtype.kind == "f":
            assert np.isfinite(variable.values).all(), name


@pytest.mark.parametrize("stage", PLACES)
def test_results_page_names_every_variable_and_attribute(datasets, stage):
    others = SLICE_VARIABLES | HELIX_VARIABLES if stage == "static" else ()
    check_documented(datasets[stage], f"## {stage}.nc", others=others)
    page = (ROOT / "docs" / "results.md").read_text(encoding="utf-8")
    # of modes and dynamics the page names the attributes that need words
    if stage not in ("modes", "dynamics"):
        for attribute in set(datasets[stage].attrs) - {"title", "fourier_convention"}:
            assert f"`{attribute}`" in page, attribute


@pytest.mark.parametrize("stage", PLACES)
def test_exported_attributes_have_units(datasets, stage):
    ratios = {"contact_ratio_sun_planet", "contact_ratio_planet_ring", "overlap_ratio"}
    pure = ratios | {"mesh_phases", "free_ends", "peak_doubt", "peaks_cut_off", "profile_shift"}
    for name, value in datasets[stage].attrs.items():
        if np.asarray(value).dtype.kind == "f" and name not in pure:
            assert _attribute(name, value)[2] not in ("", "1"), name


def test_static_attributes_and_labels(datasets):
    static = datasets["static"]
    assert list(static.mesh.values) == [f"sun-planet {n}" for n in (1, 2, 3)] + [f"planet {n}-ring" for n in (1, 2, 3)]
    assert np.degrees(static.attrs["working_pressure_angle_sun_planet"]) == pytest.approx(22.1995, abs=5e-5)
    assert np.degrees(static.attrs["working_pressure_angle_planet_ring"]) == pytest.approx(20.0, abs=5e-5)
    assert static.attrs["contact_ratio_sun_planet"] == pytest.approx(1.5507, abs=5e-5)
    assert static.attrs["contact_ratio_planet_ring"] == pytest.approx(1.9301, abs=5e-5)
    assert static.attrs["contact"] == "profile"
    assert list(static.position.values) == [i / 16 for i in range(16)]


def test_static_variables_belong_together(datasets):
    static = datasets["static"]
    assert static.tooth_load.sum("tooth").values == pytest.approx(static.mesh_force.values, rel=1e-12)
    assert static.load_share.sum("planet").values == pytest.approx(1.0, rel=1e-12)
    assert (static.ste[:3].values + static.ste[3:].values) == pytest.approx(static.ste_overall.values)
    secant = static.mesh_force / static.ste
    assert secant.values == pytest.approx(static.mesh_stiffness_secant.values, rel=1e-12)


def test_speeds_in_rpm_and_mesh_frequency(datasets):
    dynamics = datasets["dynamics"]
    assert dynamics.speed.values == pytest.approx([250.0, 3100.0], rel=1e-12)
    assert dynamics.speed.attrs["units"] == "rpm"
    assert dynamics.mesh_frequency.values == pytest.approx([90.0, 1116.0], rel=1e-12)
    assert datasets["housing"].speed.values == pytest.approx([250.0, 3100.0], rel=1e-12)


def test_ring_shapes_are_real_fields(datasets):
    modes = datasets["modes"]
    shape = modes.ring_shape_real.values + 1j * modes.ring_shape_imag.values
    assert shape[:, ::-1] == pytest.approx(shape.conj(), abs=1e-12 * np.abs(shape).max())
    assert list(modes.circumferential.values) == list(range(-26, 27))


def test_housing_lines_are_those_of_the_result_and_make_the_signal(results, datasets):
    housing, exact = datasets["housing"], results["housing"].exact
    assert housing.lines_real.dtype == np.float32 and not (housing.order.values % 3).any()
    for s in (0, 1):
        lines = stored_lines(housing.isel(speed=s))
        # up to the last order that is heard at this speed
        count = len(lines.order)
        assert np.array_equal(lines.order, exact.order[:count]) and not exact.displacement[s, count:].any()
        largest = np.abs(exact.acceleration[s]).max()
        assert np.abs(lines.acceleration - exact.acceleration[s, :count]).max() < 1e-7 * largest
        assert float(housing.level[s]) == pytest.approx(order_level(lines), rel=1e-7)
        signal = fixed_sensor_signal(lines)
        assert np.sqrt(np.mean(signal.acceleration**2)) == pytest.approx(order_level(lines), rel=1e-12)
        samples = len(signal.seconds)
        assert signal.seconds[-1] * samples / (samples - 1) == pytest.approx((108 / 90.0, 108 / 1116.0)[s], rel=1e-12)
    assert housing.attrs["sensor_angle"] == 0.0


@pytest.mark.parametrize("stage", PLACES)
def test_results_cannot_be_changed(results, stage):
    with pytest.raises(AttributeError):
        results[stage].extra = 1


def test_a_multiplier_is_stored_as_its_size():
    """Where a period doubles the multiplier is a negative number."""
    multiplier = np.array([-1.2, 0.3 + 0.4j])
    result = MagicMock(speeds=[], stability=MagicMock(multiplier=multiplier))
    np.testing.assert_allclose(response_variables(result)["floquet_multiplier"][1], [1.2, 0.5], rtol=1e-15)
