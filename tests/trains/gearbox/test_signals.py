"""Signals of the sensors of a gearbox have the lines of its response."""

import warnings

import numpy as np
import pytest
import xarray as xr

from femgear.errors import CaseError
from femgear.exchange.formats import write_functions
from femgear.exchange.sampling import Sampling
from femgear.trains.gearbox.signals import (
    GEARBOX_RECORDED,
    gearbox_order_tables,
    gearbox_shapes,
    gearbox_signal_extent,
    gearbox_signals,
    gearbox_spectra,
    sensor_file_names,
)

ORDER = np.array([25.0, 6.065, 0.35])
SPEEDS = np.array([3000.0, 6000.0])
HOW = Sampling(rate=8000, duration=1.0, run_up=2.0)


class Stored(dict):
    """Contents of the files of a run by stage."""

    @property
    def stages(self):
        return tuple(self)


def lines(speeds: np.ndarray) -> xr.Dataset:
    rng = np.random.default_rng(len(speeds))
    values = rng.normal(size=(2, len(speeds), 2, len(ORDER)))
    return xr.Dataset(
        {
            "lines_real": (("speed", "sensor", "line"), values[0]),
            "lines_imag": (("speed", "sensor", "line"), values[1]),
            "order": ("line", ORDER),
            "lowest_force": (("speed", "stage"), np.full((len(speeds), 1), 100.0)),
        },
        {"speed": speeds, "sensor": ["top left", "side"]},
    )


@pytest.fixture
def results():
    return Stored(dynamics=lines(SPEEDS[1:]), runup=lines(SPEEDS))


def test_a_signal_at_one_speed_is_the_sum_of_its_lines(results):
    signals = {signal.name: signal for signal in gearbox_signals(results, HOW)}
    assert [*signals] == [
        "sensor_top_left_6000_rpm",
        "sensor_side_6000_rpm",
        "sensor_top_left_run_up",
        "sensor_side_run_up",
    ]
    signal, data = signals["sensor_side_6000_rpm"], results["dynamics"]
    assert (signal.unit, signal.rate, signal.steady, len(signal.values)) == ("m/s^2", 8000, True, 8000)
    amplitude = (data["lines_real"] + 1j * data["lines_imag"]).values[0, 1]
    turns = 100.0 * np.arange(8000) / 8000
    direct = (amplitude @ np.exp(2j * np.pi * np.outer(ORDER, turns))).real
    assert signal.values == pytest.approx(direct, abs=1e-8)


def test_a_run_up_sweeps_the_lines_of_all_speeds(results):
    signal = next(signal for signal in gearbox_signals(results, HOW) if signal.name == "sensor_top_left_run_up")
    amplitude = (results["runup"]["lines_real"] + 1j * results["runup"]["lines_imag"]).values[:, 0]
    time = np.arange(16_000) / 8000
    turns = 50.0 * time + 0.5 * 25.0 * time**2
    share = (time / 2.0)[:, None]
    lines_then = amplitude[0] * (1.0 - share) + amplitude[1] * share
    direct = (lines_then * np.exp(2j * np.pi * np.outer(turns, ORDER))).sum(axis=1).real
    assert not signal.steady
    assert signal.values == pytest.approx(direct, abs=1e-8)


def test_the_extent_is_that_of_the_loudest_speed(results):
    largest = max(
        np.hypot(data["lines_real"], data["lines_imag"]).values.sum(axis=2).max() for data in results.values()
    )
    extent = gearbox_signal_extent(results, 8000.0)
    assert extent["m/s^2"][0] == pytest.approx(largest)
    assert extent["m/s^2"][1] == 0.0
    lost, level = gearbox_signal_extent(results, 2000.0)["m/s^2"][1:]
    assert 0.0 < lost < level


def test_signals_are_counted_by_sensor(results):
    assert GEARBOX_RECORDED.each(results) == 2
    silent = Stored(dynamics=results["dynamics"].drop_vars(["lines_real", "lines_imag"]))
    assert not [*gearbox_signals(silent, HOW)]


def test_a_gearbox_without_sensors_is_refused_with_a_remedy():
    silent = Stored(dynamics=lines(SPEEDS[:1])[["lowest_force"]])
    with pytest.raises(CaseError) as caught:
        gearbox_signal_extent(silent, 8000.0)
    assert (caught.value.code, caught.value.key) == ("E-STAGE", "sensor")
    assert "[[sensor]]" in caught.value.remedy


def test_signals_of_flanks_that_would_part_say_so(results):
    results["runup"]["lowest_force"].values[0] = -1.0
    with pytest.warns(UserWarning, match="W-PULL"):
        assert len([*gearbox_signals(results, HOW)]) == 4
    results["runup"]["lowest_force"].values[0] = 1.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert len([*gearbox_signals(results, HOW)]) == 4


def test_file_names_are_plain_and_differ():
    names = sensor_file_names(["top: left/right", "Top left right", "a", "a_no_2", "A", "Gehäuse", "..", "?"])
    assert names[0] == "sensor_top_left_right"
    assert names[1] == "sensor_Top_left_right_no_2"
    assert names[5:7] == ["sensor_Gehäuse", "sensor_unnamed"]
    assert len({name.lower() for name in names}) == len(names)


def test_shapes_are_motions_of_the_stations():
    motion = np.arange(36.0).reshape(2, 6, 3)
    modes = xr.Dataset(
        {
            "motion": (("station", "way", "mode"), motion),
            "place": (("station", "axis"), np.eye(3)[:2]),
            "frequency": ("mode", [0.0, 10.0, 20.0]),
            "damping_ratio": ("mode", [0.0, 0.03, 0.03]),
        }
    )
    shapes = gearbox_shapes(Stored(modes=modes))
    assert shapes.shape.shape == (3, 2, 3)
    assert shapes.shape[2, 1] == pytest.approx(motion[1, :3, 2])
    assert shapes.points == pytest.approx(np.eye(3)[:2])
    assert shapes.words == "stations of shafts and planets"


def with_origins(data: xr.Dataset) -> xr.Dataset:
    """The same lines of two stages, the last two of one order, with their level."""
    size = np.hypot(data["lines_real"], data["lines_imag"])
    named = {
        "order": ("line", np.array([25.0, 6.065, 6.065])),
        "origin": ("line", ["first", "first", "second"]),
        "harmonic": ("line", [4, 1, 2]),
        "side_band": ("line", [0, 0, -1]),
        "level": (("speed", "sensor"), np.sqrt(0.5 * (size**2).sum("line").values)),
    }
    return data.assign(named)


def test_lines_of_one_frequency_are_one_in_the_spectrum_that_a_universal_file_holds(results, tmp_path):
    pyuff = pytest.importorskip("pyuff")
    data = results["dynamics"] = with_origins(results["dynamics"])
    lines = (data["lines_real"] + 1j * data["lines_imag"]).values[0, 1]
    write_functions((), gearbox_spectra(results), tmp_path / "a.uff")
    top, side = pyuff.UFF(str(tmp_path / "a.uff")).read_sets()[1:]
    assert (top["id1"], side["id1"]) == ("sensor_top_left_lines", "sensor_side_lines")
    assert side["x"] == pytest.approx([606.5, 2500.0], rel=1e-5) and side["abscissa_spacing"] == 0
    assert side["data"] == pytest.approx([lines[1] + lines[2], lines[0]], rel=1e-9)
    assert side["ordinate_axis_units_lab"].strip() == "m/s^2"


def test_the_order_table_has_every_line_with_its_origin(results):
    data = results["dynamics"] = with_origins(results["dynamics"])
    results["modes"] = xr.Dataset({"frequency": ("mode", [0.0, 590.0, 2600.0])})
    ((name, header, rows),) = gearbox_order_tables(results)
    table = [dict(zip(header, row, strict=True)) for row in rows]
    assert name == "order_table" and len(table) == 6
    side = [row for row in table if row["sensor"] == "side"]
    amplitudes = np.hypot(data["lines_real"], data["lines_imag"]).values[0, 1]
    assert [row["amplitude [m/s^2]"] for row in side] == pytest.approx(np.sort(amplitudes)[::-1])
    assert sum(row["share of the power [1]"] for row in side) == pytest.approx(1.0)
    first = next(row for row in side if row["mesh harmonic [1]"] == 4)
    assert (first["frequency [Hz]"], first["stage"], first["nearest mode [Hz]"]) == (2500.0, "first", 2600.0)
    level = 20.0 * np.log10(amplitudes[0] / np.sqrt(2.0) / 1e-6)
    assert first["level, r.m.s. re 1e-6 m/s^2 [dB]"] == pytest.approx(level)
    assert not [*gearbox_order_tables(Stored())]
