"""Pictures of the response of a gearbox show its levels, lines and mesh forces."""

from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from femgear.report.charts import chart
from femgear.report.style import BLACK
from femgear.stages.protocol import Drawn
from femgear.trains.gearbox.figures import FIGURES
from femgear.trains.gearbox.response_figures import (
    LINES_NAMED,
    SENSORS_DRAWN,
    draw_flank_forces,
    draw_run_up_forces,
    draw_run_up_levels,
    draw_sensor_spectra,
    short_origin,
)

pytestmark = pytest.mark.usefixtures("coarse_states")

STAGES = ["first", "second"]


def response_data(*, speeds=5, sensors=2) -> xr.Dataset:
    """Response of a pair and a planetary stage at speeds, with eight lines."""
    rng = np.random.default_rng(1)
    parts = rng.uniform(0.1, 1.0, (speeds, sensors, 2))
    lines = rng.uniform(0.01, 1.0, (2, speeds, sensors, 8))
    factor = rng.uniform(1.0, 1.2, (speeds, 2, 2))
    factor[:, 0, 1] = np.nan
    order = np.array([25.0, 50.0, 75.0, 6.0, 12.0, 11.9, 12.1, 18.0])
    return xr.Dataset(
        {
            "level": (("speed", "sensor"), np.sqrt((parts**2).sum(axis=2))),
            "level_of_stage": (("speed", "sensor", "stage"), parts),
            "lines_real": (("speed", "sensor", "line"), lines[0]),
            "lines_imag": (("speed", "sensor", "line"), lines[1]),
            "dynamic_factor": (("speed", "stage", "kind"), factor),
            "mesh_force_by_stage": (("speed", "mesh", "stage"), rng.uniform(1.0, 9.0, (speeds, 2, 2))),
            "stage_of_mesh": ("mesh", STAGES),
            "order": ("line", order),
            "origin": ("line", ["first"] * 3 + ["second"] * 5),
            "harmonic": ("line", [1, 2, 3, 1, 2, 2, 2, 0]),
            "side_band": ("line", [0, 0, 0, 0, 0, -1, 1, 3]),
        },
        {
            "speed": np.linspace(1000.0, 3000.0, speeds) if speeds > 1 else [2000.0],
            "stage": STAGES,
            "kind": ["sun", "ring"],
            "mesh": ["first", "second sun-planet 1"],
            "sensor": [f"s{number}" for number in range(sensors)],
        },
        {"reference": "rotor"},
    )


def test_weighted_levels_have_an_ordinate_at_the_right():
    data = response_data(sensors=1)
    weighted = np.array([60.0, 70.0, -np.inf, 80.0, 75.0])
    data["weighted_level"] = ("speed", "sensor"), weighted[:, None]
    left, right = draw_run_up_levels(data, 2000.0).axes
    curve = right.lines[0].get_ydata()
    assert curve[[0, 1, 3, 4]] == pytest.approx([60.0, 70.0, 80.0, 75.0]) and np.isnan(curve[2])
    assert "dB(A)" in right.get_ylabel() and left.get_zorder() > right.get_zorder()


def curves_of(ax) -> dict[str, np.ndarray]:
    return {line.get_label(): line.get_ydata() for line in ax.lines if not line.get_label().startswith("_")}


def test_every_sensor_has_a_chart_with_the_level_and_the_part_of_every_stage():
    data = response_data()
    figure = draw_run_up_levels(data, 2000.0)
    # as the sentence of page one, which is about the loudest sensor at the load case
    loudest = np.argsort(-data["level"].sel(speed=2000.0, method="nearest").values)
    assert [ax.get_title(loc="left") for ax in figure.axes] == [f"sensor s{number}" for number in loudest]
    for sensor, ax in zip(loudest, figure.axes, strict=True):
        curves = curves_of(ax)
        assert curves["all stages"] == pytest.approx(data["level"].values[:, sensor])
        for number, stage in enumerate(STAGES):
            assert curves[stage] == pytest.approx(data["level_of_stage"].values[:, sensor, number])
        drawn = np.concatenate([values for name, values in curves.items() if "speed" not in name])
        # a decade may have one tick
        assert ax.get_yscale() == ("log" if drawn.min() < 0.1 * drawn.max() else "linear")
        low, high = ax.get_ylim()
        assert all(low < values.min() and values.max() < high for name, values in curves.items() if "speed" not in name)
        assert ax.get_ylabel() == "level, r.m.s. [m/s²]"
    assert figure.axes[-1].get_xlabel() == "speed of rotor [rpm]"
    assert chart(figure) is not None


def test_a_run_up_of_one_speed_has_points():
    data = response_data(speeds=1)
    for figure in (draw_run_up_levels(data, 2000.0), draw_run_up_forces(data, 2000.0)):
        for ax in figure.axes:
            assert ax.get_xlim() == pytest.approx((1800.0, 2200.0))
            named = [line for line in ax.lines if line.get_label() != "speed of the load case"]
            assert named and len({line.get_marker() for line in named} - {"None"}) == len(named)
            assert all(ax.get_ylim()[0] <= line.get_ydata()[0] < ax.get_ylim()[1] for line in named)


def test_levels_over_few_decades_have_plain_numbers():
    def numbers(largest: float) -> list[str]:
        data = response_data(sensors=1).isel(stage=[0])
        data["level"].values[:, 0] = data["level_of_stage"].values[:, 0, 0] = np.geomspace(2.0, largest, 5)
        figure = draw_run_up_levels(data)
        figure.draw_without_rendering()
        low, high = figure.axes[0].get_ylim()
        axis = figure.axes[0].yaxis
        ticks = zip(axis.get_ticklocs(minor=False), axis.get_majorticklabels(), strict=True)
        small = zip(axis.get_ticklocs(minor=True), axis.get_minorticklabels(), strict=True)
        return [text.get_text() for place, text in (*ticks, *small) if low <= place <= high and text.get_text()]

    assert numbers(60.0) == ["10", "2", "5", "20", "50"]
    assert numbers(6000.0) == ["10", "100", "1000"]


def test_the_speed_of_the_load_case_is_marked_where_the_run_up_passes_it():
    names = {text.get_text() for text in draw_run_up_levels(response_data(), 2000.0).legends[0].get_texts()}
    assert names == {"all stages", *STAGES, "speed of the load case"}
    names = {text.get_text() for text in draw_run_up_levels(response_data(), 9000.0).legends[0].get_texts()}
    assert names == {"all stages", *STAGES}


def test_one_stage_alone_has_one_curve():
    ax = draw_run_up_levels(response_data().isel(stage=[0])).axes[0]
    assert [*curves_of(ax)] == ["level"]


def test_the_loudest_of_many_sensors_are_drawn_and_the_picture_says_so():
    data = response_data(sensors=9)
    data["level"].values[2, 8] = 50.0
    data["level"].values[:, 0] = 1e-3
    for figure in (draw_run_up_levels(data), draw_sensor_spectra(data)):
        titles = [ax.get_title(loc="left") for ax in figure.axes]
        assert len(titles) == SENSORS_DRAWN
        assert titles[0].startswith("sensor s8")
        assert not any(title.startswith("sensor s0") for title in titles)
        assert figure.get_suptitle() == "the loudest 6 of 9 sensors"


def test_a_silent_sensor_has_an_empty_chart():
    data = response_data()
    for name in ("level", "level_of_stage", "lines_real", "lines_imag"):
        data[name].values[:] = 0.0
    draw_run_up_levels(data).draw_without_rendering()
    draw_sensor_spectra(data).draw_without_rendering()


def test_mesh_forces_have_a_curve_for_every_kind_of_mesh():
    data = response_data()
    ax = draw_run_up_forces(data, 2000.0).axes[0]
    curves = curves_of(ax)
    assert [*curves] == ["first", "second, sun", "second, ring", "speed of the load case"]
    assert curves["second, ring"] == pytest.approx(data["dynamic_factor"].values[:, 1, 1])
    assert ax.get_ylim()[0] == 1.0


def test_stems_reach_the_amplitudes_of_their_stage_at_the_loudest_speed():
    data = response_data()
    data["level"].values[3, 0] = 10.0
    figure = draw_sensor_spectra(data)
    size = np.hypot(data["lines_real"].values, data["lines_imag"].values)[3]
    hertz = data["order"].values * data["speed"].values[3] / 60.0
    for sensor, ax in enumerate(figure.axes):
        assert ax.get_title(loc="left") == f"sensor s{sensor}, 2,500 rpm"
        drawn = {line.get_label(): line for line in ax.lines if not line.get_label().startswith("_")}
        for stage in STAGES:
            own = np.flatnonzero(data["origin"].values == stage)
            assert drawn[stage].get_ydata()[1::3] == pytest.approx(size[sensor, own])
            assert 1e3 * drawn[stage].get_xdata()[1::3] == pytest.approx(hertz[own])
            assert drawn[stage].get_color() != BLACK
    assert chart(figure) is not None


def test_the_largest_lines_are_named_and_no_name_lies_on_another_or_on_a_leader():
    data = response_data(speeds=1)
    figure = draw_sensor_spectra(data)
    figure.draw_without_rendering()
    size = np.hypot(data["lines_real"].values, data["lines_imag"].values)[0]
    for sensor, ax in enumerate(figure.axes):
        largest = np.argsort(-size[sensor])[:LINES_NAMED]
        assert [text.get_text() for text in ax.texts] == [short_origin(data, i) for i in largest], "the largest first"
        boxes = [text.get_window_extent() for text in ax.texts]
        numbers = range(len(boxes))
        assert not any(boxes[i].overlaps(boxes[k]) for i in numbers for k in numbers if k > i)
        leaders = [line for line in ax.lines if line.get_label().startswith("_")]
        paths = [line.get_transform().transform_path(line.get_path()) for line in leaders]
        assert len(paths) == LINES_NAMED
        assert all(line.get_linestyle() == ":" for line in leaders), "none looks like a part of the spectrum"
        assert not any(path.intersects_bbox(box) for path in paths for box in boxes)


def test_few_lines_stand_in_front_of_many():
    data = response_data(speeds=1)
    lines = {line.get_label(): line for line in draw_sensor_spectra(data).axes[0].lines}
    assert lines["first"].get_zorder() > lines["second"].get_zorder()


def test_lines_are_named_by_stage_harmonic_and_turns_of_the_carrier():
    data = response_data()
    assert [short_origin(data, i) for i in (0, 5, 6, 7)] == ["first, 1", "second, 2 −1", "second, 2 +1", "second, 0 +3"]


def test_the_pictures_of_both_stages_are_among_those_of_a_gearbox():
    drawn = Drawn(SimpleNamespace(sensor=()), {"dynamics": response_data(speeds=1), "runup": response_data()})
    for stage in ("dynamics", "runup"):
        assert FIGURES[stage].captions.keys() == FIGURES[stage].draw(drawn).keys()
    silent = {stage: data.drop_vars(["level", "level_of_stage"]) for stage, data in drawn.data.items()}
    assert not FIGURES["dynamics"].draw(Drawn(None, silent))
    assert [*FIGURES["runup"].draw(Drawn(SimpleNamespace(sensor=()), {"runup": silent["runup"]}))] == [
        "run_up_forces",
        "stage_forces",
    ]


def test_back_flanks_are_drawn_below_zero_and_every_mesh_of_its_stage():
    instant = np.arange(8) / 8
    drive = np.maximum(np.sin(2.0 * np.pi * (instant + np.arange(3)[:, None] / 3)), 0.0)
    back = np.zeros_like(drive)
    back[2] = 0.5 * np.maximum(-np.sin(2.0 * np.pi * instant), 0.0)
    data = xr.Dataset(
        {
            "drive_force": (("mesh", "instant"), drive),
            "back_force": (("mesh", "instant"), back),
            "largest_back_force": ("mesh", back.max(axis=1)),
            "stage_of_mesh": ("mesh", ["pair", "set", "set"]),
        },
        {"mesh": ["pair", "set sun-planet 1", "set planet 1-ring"], "stage": ["pair", "set"], "instant": instant},
    )
    figure = draw_flank_forces(data)
    curves = [[line.get_ydata() for line in ax.lines if len(line.get_xdata()) == 8] for ax in figure.axes]
    assert [len(lines) for lines in curves] == [1, 3]
    np.testing.assert_array_equal(curves[0][0], drive[0])
    np.testing.assert_array_equal(curves[1][2], -back[2])
