"""Figures of the lumped set: what is drawn dashed, closed orbits, contact maps."""

import numpy as np
from published.wind_turbine_figures import contact_map, contact_over_frequency, response_branches

from femgear.report.style import png_bytes
from femgear.trains.planar.figures import bearing_forces, orbits


def test_unstable_segments_are_dashed_and_nothing_is_left_out():
    hertz, size = np.arange(7.0), 1e-6 * np.arange(7.0)
    stable = np.array([1, 1, 0, 0, 1, 1, 1], bool)
    figure = response_branches([("curve", hertz, size, stable)], [("sweep", hertz, size)], quantity="x")
    lines = {"-": [], "--": []}
    for line in figure.axes[0].get_lines()[:-1]:
        lines[line.get_linestyle()].append(line.get_xdata().tolist())
    assert lines == {"-": [[0, 1], [4, 5, 6]], "--": [[1, 2, 3, 4]]}
    assert png_bytes(figure).startswith(b"\x89PNG")


def test_orbit_is_closed():
    phase = np.linspace(0, 2 * np.pi, 8, endpoint=False)
    line = orbits([("carrier", 1e-6 * np.array([np.cos(phase), np.sin(phase)]))]).axes[0].get_lines()[0]
    assert line.get_xdata()[0] == line.get_xdata()[-1] and len(line.get_xdata()) == 9


def test_forces_are_sizes_in_kilonewton():
    force = np.array([[3000.0, 0.0], [4000.0, 1000.0]])
    line = bearing_forces(np.array([0.0, np.pi]), [("planet 1", force)]).axes[0].get_lines()[0]
    np.testing.assert_allclose(line.get_ydata(), [5.0, 1.0])
    np.testing.assert_allclose(line.get_xdata(), [0.0, 180.0])


def test_contact_figures_show_every_flank_and_point():
    share = np.array([[0.0, 1.0], [0.5, 0.25], [1.0, 0.0]])
    figure = contact_over_frequency([1.0, 2.0, 3.0], share, ("drive", "back"))
    for line, column in zip(figure.axes[0].get_lines(), share.T, strict=True):
        np.testing.assert_array_equal(line.get_ydata(), column)
    figure = contact_map([1.0, 2.0, 3.0], [1e-6, 2e-6], [("back", share)], line=("rigid", 1.5e-6))
    np.testing.assert_array_equal(figure.axes[0].collections[0].get_array().reshape(2, 3), share.T)
    assert figure.axes[0].get_lines()[0].get_ydata()[0] == 1.5
