"""Root stresses as dataset and as figures."""

import numpy as np
import pytest
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg

from femgear.contact.root_stress import RootCycle
from femgear.report.style import png_bytes
from femgear.stages.static_figures import (
    draw_contact_pressure,
    draw_load_spectrum,
    planet_bending,
    root_stress_history,
    root_stress_profile,
)
from femgear.stages.static_results import STRESS_VARIABLES, root_values
from femgear.storage.results import dataset, declared

MESHES = ["sun-planet 1", "sun-planet 2", "planet 1-ring", "planet 2-ring"]
P = 8


def cycle(mesh, gear, *, periods=1):
    """Smooth stresses of four slots; planets have more root points than sun and ring."""
    kind = ("sun", "planet", "planet", "ring")[2 * (mesh >= 2) + gear]
    points = 14 if kind == "planet" else 10
    positions = P * periods
    turn = np.arange(positions) % P / P
    path = np.arange(-2, 2)[:, None] + turn
    arc = np.linspace(0, 1e-3, points)
    bump = np.sin(np.pi * np.arange(points) / (points - 1)) + 0.05
    load = np.exp(-((path - 0.3) ** 2)) * (1000 + mesh)
    # one period of a long record is worse than the others
    load = load * (1 + 0.5 * (np.arange(positions) // P == periods - 1))
    stress = 1e5 * load[..., None, None] * np.array([1.0, -1.2])[:, None] * bump
    slope = np.linspace(0.1, 1.5, points)
    over_width = stress[:, :, 0].max(axis=-1)[..., None]
    return RootCycle(kind, mesh, gear, path, load, stress, arc, slope, periods, over_width)


def cycles(**options):
    return tuple(cycle(mesh, gear, **options) for mesh in range(4) for gear in (0, 1))


def root_stress_dataset(roots, meshes):
    data = dataset(declared(STRESS_VARIABLES, root_values(roots)), {}, {})
    return data.assign_coords(mesh=meshes, gear=["first", "second"], root=["loaded", "back"])


@pytest.fixture(scope="module")
def stress():
    return root_stress_dataset(cycles(), MESHES)


def test_dataset_holds_the_extremes(stress):
    assert dict(stress.sizes) == {"mesh": 4, "gear": 2, "step": 4 * P, "root": 2, "point": 14}
    for variable in stress.data_vars.values():
        assert {"units", "long_name"} <= set(variable.attrs)
    for root in cycles():
        row = stress.isel(mesh=root.mesh, gear=root.gear)
        assert float(row.root_tension.max()) == root.stress.max()
        assert float(row.root_compression.min()) == root.stress.min()
        assert np.isfinite(row.root_arc.values).sum() == len(root.arc)
        assert np.nanmax(row.root_profile.sel(root="loaded").values) == root.stress.max()
        assert np.diff(row.root_path.values) == pytest.approx(1 / P)


def test_the_worst_tooth_of_a_long_record_is_followed():
    roots = cycles(periods=3)
    stress = root_stress_dataset(roots, MESHES)
    assert stress.sizes["step"] == 4 * P
    for root in roots:
        row = stress.isel(mesh=root.mesh, gear=root.gear)
        assert float(row.root_tension.max()) == root.stress.max()
        assert np.diff(row.root_path.values) == pytest.approx(1 / P)


def test_figures_are_drawn_with_units(stress):
    for figure in (root_stress_history(stress), root_stress_profile(stress)):
        assert png_bytes(figure).startswith(b"\x89PNG")
        assert len(figure.axes) == 4
        assert all("[MPa]" in ax.get_ylabel() for ax in figure.axes[::2])
        assert all("[" in ax.get_xlabel() for ax in figure.axes[2:])
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        legend = figure.legends[0].get_window_extent(canvas.renderer)
        assert all(not legend.overlaps(ax.get_tightbbox(canvas.renderer)) for ax in figure.axes)


def test_figures_show_the_numbers(stress):
    history = root_stress_history(stress)
    for ax, (mesh, gear) in zip(history.axes, ((1, 0), (1, 1), (3, 0), (3, 1)), strict=True):
        drawn = ax.lines[0].get_ydata().max()
        assert drawn == pytest.approx(1e-6 * float(stress.root_tension[mesh, gear].max()))
        assert f"{drawn:.3g}" in ax.get_title(loc="left")
    # the second planet carries more
    assert history.axes[1].get_title(loc="left").startswith("planet 2, sun side")
    profile = root_stress_profile(stress)
    assert [len(ax.lines[0].get_xdata()) for ax in profile.axes] == [14] * 4
    # the critical sections: 30 deg and, on the ring, 60 deg between slopes of 0.1 and 1.5 rad
    for ax, angle in zip(profile.axes, (30, 30, 30, 60), strict=True):
        place = ax.lines[-1].get_xdata()[0]
        assert place == pytest.approx((np.radians(angle) - 0.1) / 1.4, rel=1e-6)


def test_a_root_without_critical_section_has_no_mark(stress):
    flat = stress.assign(root_slope=0.0 * stress.root_slope + 0.2)
    assert all(len(ax.lines) == 3 for ax in root_stress_profile(flat).axes)


PAIRS, CELLS, BINS, PITCH = 3, 24, 10, 4.4e-3


@pytest.fixture(scope="module")
def whole(stress):
    """Root stresses with nominal values, semi-elliptic pressures, a spectrum and the turn of a planet."""
    path = PITCH * (np.arange(PAIRS)[:, None] - 1 + np.arange(P) / P)
    offset = np.linspace(-9e-5, 9e-5, CELLS)
    peak = np.where(np.abs(path) < 0.9 * PITCH, 8e8 + 1e11 * path, 0.0)
    shape = np.sqrt(np.maximum(1 - (offset / 6e-5) ** 2, 0.0))
    pressure = np.broadcast_to(peak[:, None] * shape[:, None], (4, PAIRS, CELLS, P))
    by_pair = ("mesh", "pair", "position")
    turn = np.linspace(-0.25, 0.75, 200, endpoint=False)
    bumps = np.exp(-((turn / 0.02) ** 2)) - 0.6 * np.exp(-(((turn - 0.49) / 0.02) ** 2))
    history = 1e8 * np.outer([1.0, 1.1, -0.9, -1.2], bumps)
    share = np.zeros((4, BINS))
    share[:, 4], share[:, 9] = 0.75, 0.25
    edges = np.linspace(0, 1000, BINS + 1)
    return stress.assign(
        iso_root_stress=(("mesh", "gear"), np.full((4, 2), 9.5e7)),
        iso_contact_stress=("mesh", [7e8, 7e8, 3e8, 3e8]),
        contact_pressure=(("mesh", "position"), pressure.max(axis=(1, 2))),
        pressure_distribution=(("mesh", "pair", "cell", "position"), pressure),
        pressure_offset=(("mesh", "cell"), np.tile(offset, (4, 1))),
        pressure_centre=(by_pair, np.zeros((4, PAIRS, P))),
        pressure_path=(by_pair, np.tile(path, (4, 1, 1))),
        load_bin_low=("load_bin", edges[:-1]),
        load_bin_high=("load_bin", edges[1:]),
        load_time_share=(("mesh", "load_bin"), share),
        load_cycle_share=(("mesh", "load_bin"), np.eye(BINS)[[9] * 4]),
        load_cycles=(("mesh", "gear"), [[2, 1], [2, 1], [1, 2], [1, 2]]),
        planet_root_stress=(("mesh", "turn"), history),
        turn=("turn", turn),
    )


def test_nominal_stress_is_drawn_where_it_is_known(whole, stress):
    for ax in root_stress_history(whole).axes:
        assert any(np.allclose(line.get_ydata(), 95.0) for line in ax.lines)
    assert all(len(ax.lines) == 3 for ax in root_stress_history(stress).axes)
    unknown = whole.assign(iso_root_stress=np.nan * whole.iso_root_stress)
    assert all(len(ax.lines) == 3 for ax in root_stress_history(unknown).axes)


def test_pressure_is_drawn_over_the_path_of_one_pair(whole):
    figure = draw_contact_pressure(whole)
    for ax, nominal in zip(figure.axes[:2], (700.0, 300.0), strict=True):
        path, pressure = ax.lines[0].get_data()
        assert (np.diff(path) > 0).all() and pressure[0] == pressure[-1] == 0.0
        assert pressure.max() == pytest.approx(1e-6 * float(whole.pressure_distribution.max()))
        assert ax.lines[1].get_ydata() == pytest.approx([nominal, nominal])
    for ax in figure.axes[2:4]:
        (image,) = ax.collections
        values = np.ma.asarray(image.get_array()).reshape(CELLS, -1)
        assert values.max() == pytest.approx(1e-6 * float(whole.pressure_distribution.max()))
        # cells without pressure are left blank, and the picture reaches as far as there is any
        assert values.mask[0].all() and 60 < ax.get_ylim()[1] < 70


def test_spectrum_and_bending_show_the_numbers(whole):
    left, right = draw_load_spectrum(whole).axes
    for ax in (left, right):
        time, cycles = (patch.get_data() for patch in ax.patches)
        assert time.values == pytest.approx(100 * whole.load_time_share.values[0])
        assert cycles.values.argmax() == 9 and cycles.edges[-1] == 1000
    assert "sun 2, planet 1" in left.get_title(loc="left")
    assert "planet 1, ring 2" in right.get_title(loc="left")
    (ax,) = planet_bending(whole).axes
    assert ax.get_title(loc="left") == "planet 2"  # the wider of the two ranges
    assert ax.lines[0].get_ydata() == pytest.approx(1e-6 * whole.planet_root_stress.values[1])
    assert ax.lines[1].get_ydata() == pytest.approx(1e-6 * whole.planet_root_stress.values[3])


def test_new_figures_hide_nothing(whole):
    for figure in (draw_contact_pressure(whole), draw_load_spectrum(whole), planet_bending(whole)):
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        legend = figure.legends[0].get_window_extent(canvas.renderer)
        assert all(not legend.overlaps(ax.get_tightbbox(canvas.renderer)) for ax in figure.axes)
        assert all("[" in ax.get_ylabel() + ax.get_xlabel() for ax in figure.axes[-2:])


def test_the_planet_that_carries_is_shown_and_named(whole):
    """Planet 1 carries nothing, as when its pin stands back: figures of planet 2, not empty ones."""
    loaded = np.array([0.0, 1.0, 0.0, 1.0])
    spans = (
        "contact_pressure",
        "pressure_distribution",
        "load_time_share",
        "load_cycle_share",
        "load_cycles",
    )
    names = (*spans, "root_tension", "root_compression")
    case = whole.assign({name: whole[name] * xr.DataArray(loaded, dims="mesh") for name in names})
    figure = draw_contact_pressure(case)
    for ax, mesh in zip(figure.axes[:2], ("sun-planet 2", "planet 2-ring"), strict=True):
        assert ax.get_title(loc="left").startswith(mesh)
        assert ax.lines[0].get_ydata().max() == pytest.approx(1e-6 * float(whole.pressure_distribution.max()))
    for ax, mesh in zip(draw_load_spectrum(case).axes, ("sun-planet 2", "planet 2-ring"), strict=True):
        assert ax.get_title(loc="left").startswith(mesh)
        assert ax.patches[0].get_data().values.max() == 75.0
    for figure in (root_stress_history(case), root_stress_profile(case)):
        assert figure.axes[1].get_title(loc="left").startswith("planet 2")
    higher = xr.DataArray([1.0, 1.0, 1.0, 1.1], dims="mesh")
    more = whole.assign(contact_pressure=whole.contact_pressure * higher)
    assert draw_contact_pressure(more).axes[0].get_title(loc="left").startswith("sun-planet 2")
    # the first planet never reaches the highest load class
    often = whole.load_time_share.values.copy()
    often[[0, 2]] = np.eye(BINS)[4]
    shown = draw_load_spectrum(whole.assign(load_time_share=(("mesh", "load_bin"), often)))
    assert shown.axes[0].get_title(loc="left").startswith("sun-planet 2")


def test_a_set_without_any_load_shows_the_first_planet(whole):
    case = whole.assign({name: 0.0 * whole[name] for name in ("contact_pressure", "pressure_distribution")})
    assert draw_contact_pressure(case).axes[0].get_title(loc="left").startswith("sun-planet 1")
