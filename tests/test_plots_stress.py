"""Root stresses as dataset and as figures."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from femgear.contact.root_stress import RootCycle
from femgear.datasets_stress import root_stress_dataset
from femgear.plots.stress import root_stress_history, root_stress_profile
from femgear.plots.style import png_bytes

MESHES = ["sun-planet 1", "sun-planet 2", "planet 1-ring", "planet 2-ring"]
P = 8


def cycle(mesh, gear, *, periods=1, reverse=False):
    """Smooth stresses of four slots; planets have more root points than sun and ring."""
    kind = ("sun", "planet", "planet", "ring")[2 * (mesh >= 2) + gear]
    points = 14 if kind == "planet" else 10
    positions = P * periods
    turn = np.arange(positions) % P / P
    path = np.arange(-2, 2)[:, None] + (-(-turn % 1) if reverse else turn)
    arc = np.linspace(0, 1e-3, points)
    bump = np.sin(np.pi * np.arange(points) / (points - 1)) + 0.05
    load = np.exp(-((path - 0.3) ** 2)) * (1000 + mesh)
    # one period of a long record is worse than the others
    load = load * (1 + 0.5 * (np.arange(positions) // P == periods - 1))
    stress = 1e5 * load[..., None, None] * np.array([1.0, -1.2])[:, None] * bump
    slope = np.linspace(0.1, 1.5, points)
    return RootCycle(kind, mesh, gear, path, load, stress, arc, slope, periods, reverse)


def cycles(**options):
    return tuple(cycle(mesh, gear, **options) for mesh in range(4) for gear in (0, 1))


@pytest.fixture(scope="module")
def stress():
    return root_stress_dataset(cycles(), MESHES)


def test_dataset_holds_the_extremes(stress):
    assert dict(stress.sizes) == {"mesh": 4, "gear": 2, "step": 4 * P, "root": 2, "point": 14}
    for variable in stress.variables.values():
        assert {"units", "long_name"} <= set(variable.attrs)
    for root in cycles():
        row = stress.isel(mesh=root.mesh, gear=root.gear)
        assert float(row.root_tension.max()) == root.stress.max()
        assert float(row.root_compression.min()) == root.stress.min()
        assert np.isfinite(row.root_arc.values).sum() == len(root.arc)
        assert np.nanmax(row.root_profile.sel(root="loaded").values) == root.stress.max()
        assert np.diff(row.root_path.values) == pytest.approx(1 / P)


@pytest.mark.parametrize("reverse", [False, True])
def test_the_worst_tooth_of_a_long_record_is_followed(reverse):
    roots = cycles(periods=3, reverse=reverse)
    stress = root_stress_dataset(roots, MESHES)
    assert stress.sizes["step"] == 4 * P
    for root in roots:
        row = stress.isel(mesh=root.mesh, gear=root.gear)
        assert float(row.root_tension.max()) == root.stress.max()
        if not reverse:
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
    for ax, (mesh, gear) in zip(history.axes, ((0, 0), (0, 1), (2, 0), (2, 1)), strict=True):
        drawn = ax.lines[0].get_ydata().max()
        assert drawn == pytest.approx(1e-6 * float(stress.root_tension[mesh, gear].max()))
        assert f"{drawn:.3g}" in ax.get_title(loc="left")
    profile = root_stress_profile(stress)
    assert [len(ax.lines[0].get_xdata()) for ax in profile.axes] == [14] * 4
    # the critical sections: 30 deg and, on the ring, 60 deg between slopes of 0.1 and 1.5 rad
    for ax, angle in zip(profile.axes, (30, 30, 30, 60), strict=True):
        place = ax.lines[-1].get_xdata()[0]
        assert place == pytest.approx((np.radians(angle) - 0.1) / 1.4, rel=1e-6)


def test_a_root_without_critical_section_has_no_mark(stress):
    flat = stress.assign(root_slope=0.0 * stress.root_slope + 0.2)
    assert all(len(ax.lines) == 3 for ax in root_stress_profile(flat).axes)
