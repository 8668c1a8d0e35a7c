"""Figures of impacts: what is dashed, coloured and marked."""

import numpy as np
import xarray as xr
from impacts import line_spectrum
from matplotlib.colors import to_hex

from femgear.report.style import png_bytes
from femgear.trains.impacts.figures import (
    STATE_COLOURS,
    amplitude_and_mean,
    bifurcation_and_exponent,
    phase_sections,
    state_bands,
)

RATIO = np.arange(7.0)


def test_unstable_segments_are_dashed_in_both_panels():
    stable = np.array([1, 1, 0, 0, 1, 1, 1], bool)
    curves = [("curve", RATIO, RATIO**2, -RATIO, stable)]
    figure = amplitude_and_mean(curves, [("sweep", RATIO, RATIO, RATIO)])
    for ax, value in zip(figure.axes, (RATIO**2, -RATIO)):
        drawn = {"-": [], "--": []}
        for line in ax.get_lines():
            if len(line.get_xdata()) and line.get_linestyle() in drawn:
                drawn[line.get_linestyle()].append(line.get_xdata().tolist())
                np.testing.assert_array_equal(line.get_ydata(), value[line.get_xdata().astype(int)])
        assert drawn == {"-": [[0, 1], [4, 5, 6]], "--": [[1, 2, 3, 4]]}
    assert "not stable" in [text.get_text() for text in figure.legends[0].get_texts()]
    assert png_bytes(figure).startswith(b"\x89PNG")


def test_bands_have_the_colours_of_their_states():
    figure = state_bands([("down", RATIO[::-1], [2, 2, 1, 1, 0, 0, 0])])
    bars = [patch for patch in figure.axes[0].patches if patch.get_width() > 0]
    assert sum(bar.get_width() for bar in bars) == 6.0
    colours = [to_hex(bar.get_facecolor()).lower() for bar in sorted(bars, key=lambda b: b.get_x())]
    assert colours == [STATE_COLOURS[state].lower() for state in (0, 0, 0, 1, 1, 2, 2)]


def test_bifurcation_diagram_shows_every_point_and_error():
    points = np.random.default_rng(0).standard_normal((7, 5))
    columns = {"exponent": RATIO, "error": 0.1 * RATIO, "lowest": -RATIO, "highest": RATIO}
    data = {name: ("ratio", column) for name, column in columns.items()} | {"point": (("ratio", "period"), points)}
    figure = bifurcation_and_exponent(xr.Dataset(data, coords={"ratio": RATIO}))
    top, bottom = figure.axes
    np.testing.assert_array_equal(top.get_lines()[0].get_ydata(), points.ravel())
    segments = bottom.collections[0].get_segments()
    np.testing.assert_allclose([np.ptp(s[:, 1]) for s in segments], 0.2 * RATIO)


def test_sections_that_repeat_are_large_dots():
    rng = np.random.default_rng(1)
    cloud, dot = rng.standard_normal((2, 300)), np.full((2, 300), 0.4)
    data = {f"section_{name}": ("section", [1.0, 2.0]) for name in ("ratio", "exponent", "error")}
    for name, motion in zip(("deflection", "velocity"), zip(cloud, dot)):
        data[f"section_{name}"] = ("section", "run"), np.array(motion)
    figure = phase_sections(xr.Dataset(data))
    small, large = (ax.get_lines()[0].get_markersize() for ax in figure.axes)
    assert small < large and np.ptp(figure.axes[1].get_xlim()) == 2.0


def test_spectrum_leaves_out_what_is_below_the_floor():
    figure = line_spectrum([("one", [0.0, 1.0, 2.0], [3.0, 1e-9, 0.5])], y="force [N]")
    np.testing.assert_array_equal(figure.axes[0].get_lines()[0].get_xdata(), [0.0, 2.0])
