"""Charts hold what Matplotlib drew: curves, areas, bars, fields, words; pages run their own scripts alone."""

import base64
import json
import re
import zlib

import numpy as np
import pytest

from femgear.report.charts import chart
from femgear.report.page import document
from femgear.report.style import label, new_figure, stems


def panel(draw, **options):
    figure, (ax,) = new_figure(**options)
    draw(ax)
    found = chart(figure)
    json.dumps(found, allow_nan=False)
    return found["panels"][0]


def points(trace):
    """Coordinates of a trace, those of an even abscissa written out."""
    y = np.array([np.nan if v is None else v for v in trace["y"]])
    x = trace["x0"] + trace["dx"] * np.arange(len(y)) if "x0" in trace else trace["x"]
    return np.array([np.nan if v is None else v for v in x]), y


def test_curve_axes_and_names():
    def draw(ax):
        ax.semilogy([1.0, 2.0, 3.0], [1.0, np.nan, 100.0], "--o", color="#0072B2", label="k", linewidth=2)
        label(ax, "x [1]", "y [N]", "title")

    found = panel(draw)
    (trace,) = found["traces"]
    assert trace["name"] == "k" and trace["mode"] == "lines+markers" and trace["line"]["dash"] == "dash"
    assert trace["x"] == [1.0, 2.0, 3.0] and trace["y"] == [1.0, None, 100.0]
    assert found["x"]["title"] == "x [1]" and found["y"] | {"range": 0} == {
        "title": "y [N]",
        "log": True,
        "range": 0,
    }
    assert found["title"] == "title"


def test_names_of_ticks_stay_names_and_numbers_numbers():
    def draw(ax):
        ax.bar([0, 1], [1.0, 2.0])
        ax.set_xticks([0, 1], ["122 Hz\ntorsional", "258 Hz\nmixed"], rotation=90)
        ax.set_yticks([0.0, 2.0])

    panel_drawn = panel(draw)
    assert panel_drawn["x"]["ticks"] == [0, 1] and panel_drawn["x"]["angle"] == -90.0
    assert panel_drawn["x"]["texts"] == ["122 Hz\ntorsional", "258 Hz\nmixed"]
    assert "texts" not in panel_drawn["y"]


def test_long_curves_keep_their_extremes():
    x = np.linspace(0.0, 1.0, 100_001)
    y = np.sin(5000 * x)
    y[54_321] = 7.0
    (trace,) = panel(lambda ax: ax.plot(x, y))["traces"]
    at, found = points(trace)
    assert len(found) <= 4002 and found.max() == 7.0 and found.min() == pytest.approx(y.min(), abs=1e-4)
    assert at[found.argmax()] == pytest.approx(x[54_321], abs=1e-5)


@pytest.mark.parametrize("count", (10, 1334, 4000, 30_000))
def test_lines_of_spectra_stay_lines_however_many_there_are(count):
    """Every drawn line rises from the floor to its tip; no stem stands higher than one that is drawn."""
    order, floor = np.arange(1.0, count + 1.0), 1e-4
    amplitude = np.random.default_rng(3).uniform(2e-4, 1.0, count)
    amplitude[count // 3] = 5.0

    def draw(ax):
        stems(ax, order, amplitude, floor, text="lines")
        ax.set_yscale("log")

    (trace,) = panel(draw)["traces"]
    x, y = points(trace)
    rising = np.isfinite(y[:-1]) & np.isfinite(y[1:])
    at, tip = x[:-1][rising], y[1:][rising]
    assert len(tip) == (count if count <= 4000 else pytest.approx(4000, abs=2))
    np.testing.assert_allclose(tip, amplitude[np.rint(at).astype(int) - 1], rtol=1e-5)
    assert np.all(y[:-1][rising] == floor) and tip.max() == 5.0


def test_long_curves_with_gaps_keep_their_parts_and_extremes():
    x = np.arange(60_001) / 1e4
    y = np.sin(500 * x)
    y[[10_000, 10_001, 40_000]] = np.nan
    y[25_000] = 3.0
    (trace,) = panel(lambda ax: ax.plot(x, y))["traces"]
    at, found = points(trace)
    assert np.isnan(found).sum() == 2 and np.nanmax(found) == 3.0 and 3000 < len(found) < 4100
    assert np.nanmin(found) == pytest.approx(-1.0, abs=1e-4)
    known = np.isfinite(found)
    np.testing.assert_allclose(found[known], y[np.rint(1e4 * at[known]).astype(int)], atol=1e-5)


def test_scattered_points_keep_their_sizes():
    """Areas in pt^2 become diameters in pixels, open ones stay open."""

    def draw(ax):
        ax.scatter([1.0, 2.0, 3.0], [1.0, 2.0, 3.0], s=[16.0, 64.0, 256.0], facecolor="none", edgecolor="k")

    (trace,) = panel(draw)["traces"]
    assert trace["marker"]["size"] == pytest.approx([1.2 * 4.0, 1.2 * 8.0, 1.2 * 16.0])
    assert trace["marker"]["symbol"] == "circle-open" and trace["marker"]["line"]["width"] > 0.0


def test_lines_across_bundles_areas_bars_and_stairs():
    def draw(ax):
        ax.set_xlim(0.0, 10.0)
        ax.axhline(3.0, label="limit")
        ax.vlines([1.0, 2.0], 0.0, [5.0, 6.0])
        ax.fill_between([0.0, 1.0], 0.0, [1.0, 2.0])
        ax.bar([4.0], [2.0], width=1.0, label="bars")
        ax.stairs([1.0, 2.0], [6.0, 7.0, 8.0], fill=True)
        ax.set_ylim(0.0, 8.0)

    area, bundle, limit, bar, stairs = _by_kind(panel(draw)["traces"])
    assert limit["x"] == [0.0, 10.0] and limit["y"] == [3.0, 3.0] and limit["name"] == "limit"
    assert bundle["x"] == [1.0, 1.0, None, 2.0, 2.0, None] and bundle["y"][1] == 5.0
    assert area["fill"] == "toself" and max(area["y"]) == 2.0
    assert (min(bar["x"]), max(bar["x"]), max(bar["y"]), bar["name"]) == (3.5, 4.5, 2.0, "bars")
    assert stairs["fill"] == "toself" and (min(stairs["x"]), max(stairs["y"])) == (6.0, 2.0)


def _by_kind(traces):
    """Areas, bundles, lines, bars, stairs."""
    collections = [one for one in traces if one["name"] == ""]
    area = next(one for one in collections if one.get("fill") and max(one["x"]) == 1.0)
    bundle = next(one for one in collections if None in one["x"])
    stairs = next(one for one in collections if one.get("fill") and max(one["x"]) == 8.0)
    named = {one["name"]: one for one in traces if one["name"]}
    return area, bundle, named["limit"], named["bars"], stairs


def test_polar_curves_lie_in_the_plane():
    def draw(ax):
        ax.plot([0.0, np.pi / 2, np.pi], [1.0, 2.0, 3.0], label="envelope")
        ax.set_ylim(0.0, 4.0)

    found = panel(draw, polar=True)
    curve = next(one for one in found["traces"] if one.get("name") == "envelope")
    np.testing.assert_allclose(points(curve), [[1.0, 0.0, -3.0], [0.0, 2.0, 0.0]], atol=1e-4)
    assert found["square"] and found["x"]["hidden"]


def test_field_with_its_colour_bar():
    figure, (ax,) = new_figure()
    image = ax.pcolormesh([0.0, 1.0, 2.0], [0.0, 5.0], [[1.0, 2.0]], vmin=0.0, vmax=4.0)
    figure.colorbar(image, label="pressure [MPa]")
    found = chart(figure)
    assert len(found["panels"]) == 1
    (trace,) = found["panels"][0]["traces"]
    assert trace["z"] == [[1.0, 2.0]] and trace["zmax"] == 4.0 and trace["text"] == "pressure [MPa]"


def test_what_has_no_words_stays_a_picture():
    figure, (ax,) = new_figure()
    ax.tricontourf([0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 2.0, 3.0])
    assert chart(figure) is None


def test_words_stand_where_they_stood():
    def draw(ax):
        ax.plot([0.0, 1.0], [0.0, 1.0])
        ax.annotate("peak", (0.5, 0.5), xytext=(0, 7), textcoords="offset points", rotation=90)
        ax.text(0.1, 0.2, "inside", transform=ax.transAxes)
        ax.set_xlim(0.0, 10.0)
        ax.annotate("mode 3", (0.1, 0.7), xycoords=("axes fraction", "data"), bbox={"facecolor": "white"})

    peak, inside, mixed = panel(draw)["words"]
    assert (mixed["x"], mixed["y"], mixed["ground"]) == (1.0, 0.7, True) and not peak["ground"]
    assert (peak["text"], peak["x"], peak["shift"], peak["angle"]) == ("peak", 0.5, [0.0, -7.0], -90.0)
    assert inside["paper"] and inside["x"] == 0.1


def test_axes_with_an_ordinate_at_the_right_lie_over_their_panel():
    figure, (upper, lower) = new_figure(rows=2, sharex=True)
    upper.plot([0, 1], [2, 3])
    lower.plot([0, 1], [4, 5])
    upper.twinx().plot([0, 1], [60, 70], color="#0072B2")
    panels = chart(figure)["panels"]
    assert [one.get("over") for one in panels] == [None, None, 0]
    assert panels[2]["place"] == panels[0]["place"] and panels[2]["traces"][0]["y"] == [60.0, 70.0]


def test_document_names_the_checksums_of_its_scripts_and_hides_hostile_text():
    hostile = "</script><script>alert(1)</script>"
    text = document(hostile, "<h1>x</h1>", {"charts": {"a": {"title": hostile}}})
    later = text.count('class="later">')
    assert text.count("<script>") == 1 and text.count("'sha256-") == 1 + later == 3 and "alert(1)</script>" not in text
    packed = re.search(r'id="data">([^<]*)<', text)[1]
    assert json.loads(zlib.decompress(base64.b64decode(packed)))["charts"]["a"]["title"] == hostile
    assert "script-src 'none'" in document("x", "", None)


def test_rounding_takes_no_word_beyond_the_end_of_its_axis():
    """A browser drops words outside: the end of an axis may lie below its own rounding."""
    end = np.nextafter(1500.0, 0.0)

    def draw(ax):
        ax.set_xlim(0.0, end)
        ax.annotate("at the end", (end, 0.5), (4, 0), textcoords="offset points")
        ax.annotate("beyond", (1501.0, 0.5), (4, 0), textcoords="offset points")

    there, beyond = panel(draw)["words"]
    assert there["x"] == end and beyond["x"] == 1501.0


def test_a_curve_that_is_drawn_for_the_legend_alone_has_a_point_that_is_nowhere():
    (trace,) = panel(lambda ax: ax.plot([], [], label="second gear"))["traces"]
    assert trace["name"] == "second gear" and trace["x"] == trace["y"] == [None]
