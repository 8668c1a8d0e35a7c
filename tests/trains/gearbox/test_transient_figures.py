"""Figures of gearboxes in time show the numbers they are given."""

import warnings
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from femgear.report.style import png_bytes
from femgear.trains.gearbox.spectrum import sign_of_forces, solve_box_spectrum, solve_box_transient
from femgear.trains.gearbox.stages import solve_deflections
from femgear.trains.gearbox.transient_figures import band, over_time, spectra, spectrum_figures, transient_figures
from femgear.trains.reading import read_case, with_value, with_values

pytestmark = pytest.mark.usefixtures("coarse_states")

CASE = Path(__file__).parents[3] / "cases" / "own_chain.toml"

TIME = np.linspace(0.0, 1.0, 50)


def drawn(figure):
    """(x, y) of all lines by panel."""
    return [[line.get_xydata() for line in ax.get_lines()] for ax in figure.axes]


def test_curves_and_units():
    panels = [("one", [("a", TIME), ("b", 2.0 * TIME)]), ("two", [("a", TIME**2)])]
    motion = drawn(over_time(TIME, panels, unit="mrad", factor=1e3))
    assert len(motion) == 2 and np.allclose(motion[0][1][:, 1], 2e3 * TIME)


def test_spectra_mark_their_lines():
    figure = spectra(TIME, [("mesh", [("a", 1.0 + TIME)])], lines=[("f", 0.5), ("out", 3.0)], unit="N")
    assert [text.get_text() for text in figure.axes[0].texts] == ["f"]
    assert figure.axes[0].get_yscale() == "log"
    assert any(np.allclose(line[:, 0], 0.5) for line in drawn(figure)[0])


def test_bars_start_at_one(monkeypatch):
    monkeypatch.syspath_prepend(str(CASE.parents[1] / "scripts"))
    from drivetrain_figures import input_ratios

    figure = input_ratios(["mass", "length"], [("line", [[0.5, 2.0], [1.0, 1.5]])])
    bars = figure.axes[0].patches
    assert {bar.get_x() for bar in bars} <= {1.0, 0.5} or all(bar.get_x() == 1.0 for bar in bars)
    assert sorted(round(bar.get_width(), 9) for bar in bars) == [-0.5, 0.0, 0.5, 1.0]


def test_many_instants_become_a_band():
    time = np.linspace(0.0, 1.0, 20_000)
    fast, slow = np.sin(5e3 * time), 0.2 * time
    middle, low, high = band(time, fast, 100)
    inside = [(time >= t - 0.004) & (time <= t + 0.004) for t in middle]
    assert all(fast[i].min() >= b and fast[i].max() <= t for i, b, t in zip(inside, low, high))
    assert low.min() == fast.min() and high.max() == fast.max()
    figure = over_time(time, [("one", [("a", fast), ("b", slow)])], unit="N", factor=2.0)
    front, back = figure.axes[0].collections
    assert front.get_zorder() > back.get_zorder()
    assert front.get_paths()[0].get_extents().ymax == pytest.approx(2.0)
    assert back.get_paths()[0].get_extents().ymax == pytest.approx(0.4)


def test_changes_far_from_zero_are_seen():
    figure = over_time(TIME, [("speed", [("a", 100.0 + 5.0 * TIME)])], unit="rpm", zero=False)
    low, high = figure.axes[0].get_ylim()
    assert 99.0 < low <= 100.0 and 105.0 <= high < 106.0
    # rounding is no change
    still = over_time(TIME, [("speed", [("a", 100.0 + 1e-12 * TIME)])], unit="rpm", zero=False)
    assert still.axes[0].get_ylim() == pytest.approx((99.0, 101.0), rel=1e-2)


def test_names_of_lines_stand_apart():
    lines = [("a", 0.50), ("b", 0.501), ("c", 0.502), ("d", 0.9)]
    figure = spectra(TIME, [("mesh", [("a", 1.0 + TIME)])], lines=lines, unit="N")
    texts = figure.axes[0].texts
    places = np.array([text.get_position()[0] for text in texts])
    assert [text.get_text() for text in texts] == list("abcd") and np.diff(places).min() > 0.016
    assert [text.xy[0] for text in texts] == [at for _, at in lines]
    assert places[:3].mean() == pytest.approx(0.501) and places[3] == pytest.approx(0.9)


@pytest.mark.parametrize(
    "top", [0.0, *(pytest.param(top, marks=pytest.mark.slow) for top in (5.9e35, 1e99, 1e300, np.inf)), 1.7e308, np.nan]
)
def test_no_number_stops_a_figure(top):
    values, many = np.full(50, top), np.full(20_000, top)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for curves in ([("a", values)], [("a", values), ("b", TIME)]):
            png_bytes(over_time(TIME, [("one", curves)], unit="kN", factor=1e3))
            png_bytes(over_time(TIME, [("one", curves)], unit="rpm", zero=False))
            png_bytes(spectra(TIME, [("one", curves)], unit="kN", factor=1e3, lines=[("f", 0.5)]))
        png_bytes(over_time(np.linspace(0.0, 1.0, 20_000), [("one", [("a", many)])], unit="kN", factor=1e3))


def results(contact="linear", last=1.0, step=1e-4):
    """transient.nc and spectrum.nc of one mesh at 100 Hz in records of 1 kHz; the speed ends ``last`` up."""
    import xarray as xr

    time = np.arange(2001) * 1e-3
    speed = 2.0 * np.pi * (1.0 + (last - 1.0) * time / 2.0)
    spin = np.append(0.0, np.cumsum(0.5e-3 * (speed[1:] + speed[:-1])))
    both, mesh = {"shaft": ["a", "b"], "variant": ["all motions"], "time": time}, {"mesh": ["a-b"]}
    transient = xr.Dataset(
        {
            "spin": (("variant", "time"), spin[None]),
            "speed": (("variant", "time", "shaft"), np.stack([speed, speed], axis=1)[None]),
            "deviation": (("variant", "time", "shaft"), np.zeros((1, 2001, 2))),
            "mesh_force": (("variant", "time", "mesh"), np.ones((1, 2001, 1))),
            "lost": (("variant", "mesh"), [[0.0123]]),
            "ratio": (("shaft",), [1.0, -3.0]),
        },
        both | mesh,
        {"step": step, "every": 10, "filter": "low pass", "contact": contact, "shaft_of_speed": "a"},
    )
    frequency = np.linspace(0.0, 500.0, 1001)
    spectrum = xr.Dataset(
        {
            "amplitude": (("variant", "mesh", "frequency"), np.ones((1, 1, 1001))),
            "line_frequency": (("line",), [100.0]),
            "line_orders": (("line", "base"), [[1]]),
            "mesh_base": (("mesh",), [0]),
            "turns": (("base",), [False]),
        },
        mesh | {"variant": ["all motions"], "frequency": frequency, "base": ["a-b mesh"]},
        {"settle": 1.0, "speed": speed[1000:].mean(), "resolution": 1.0, "shaft_of_speed": "a"},
    )
    return transient, spectrum


def texts_of(figure) -> str:
    return " ".join(text.get_text() for text in figure.texts)


def test_spectra_reach_the_third_harmonic_or_the_pass_band():
    transient, spectrum = results()
    figure = spectrum_figures(spectrum, transient)["mesh_force_spectrum"]
    assert [text.get_text() for text in figure.axes[0].texts] == ["f1", "2 f1", "3 f1"]
    assert 300.0 < figure.axes[0].get_xlim()[1] < 320.0
    assert "a at 60 rpm" in texts_of(figure) and "smear" not in texts_of(figure)
    spectrum["line_frequency"] = ("line", [150.0])
    figure = spectrum_figures(spectrum, transient)["mesh_force_spectrum"]
    assert figure.axes[0].get_xlim()[1] == pytest.approx(400.0)
    assert [text.get_text() for text in figure.axes[0].texts] == ["f1", "2 f1"]


def test_spectra_tell_that_the_speed_changes():
    transient, spectrum = results(last=1.4)
    figure = spectrum_figures(spectrum, transient)["mesh_force_spectrum"]
    assert "after 1 s, a from 72 to 84 rpm: lines smear over frequency" in texts_of(figure)
    assert "mean speed 78 rpm" in texts_of(spectrum_figures(spectrum)["mesh_force_spectrum"])


@pytest.mark.parametrize(
    ("contact", "words"), [("linear", "linear meshes keep"), ("separating", "part, for up to 1.23 %")]
)
def test_titles_follow_the_contact_and_the_low_pass(contact, words):
    figures = transient_figures(results(contact)[0])
    assert words in texts_of(figures["transient_forces"])
    assert all("low-passed to 400 Hz" in texts_of(figure) for figure in figures.values())


def test_captions_follow_the_contact():
    case = read_case(CASE)
    assert "real teeth would part" in " ".join(sign_of_forces(SimpleNamespace(case=case), "transient_forces"))
    parted = with_value(case, "transient.contact_loss", True)
    assert "back flanks touch" in " ".join(sign_of_forces(SimpleNamespace(case=parted), "transient_forces"))
    assert not list(sign_of_forces(SimpleNamespace(case=case), "transient_speeds"))


def test_window_of_the_first_separation(monkeypatch):
    monkeypatch.syspath_prepend(str(CASE.parents[1] / "scripts"))
    from drivetrain_figures import first_separation

    time = 1e-3 * np.arange(1000)
    # loads set in suddenly: the first zeros are no separation
    force = np.where(time < 0.01, 0.0, 1.0)
    force[300:310] = 0.0
    run = SimpleNamespace(time=time, force=force[:, None])
    shown, first = first_separation(run, 0, 0.02)
    assert first == 300 and time[shown][0] == pytest.approx(0.26) and time[shown][-1] == pytest.approx(0.42)


def test_side_bands_are_drawn_where_there_are_planets():
    entries = {"transient.settle": "1 s", "transient.duration": "25 s", "transient.rate": "1 kHz"}
    entries |= {"transient.record": "500 Hz", "transient.torsional": False}
    case = with_values(read_case(CASE.parent / "wind_turbine_drivetrain.toml"), entries)
    figures = spectrum_figures(solve_box_spectrum(case, solve_box_transient(case, solve_deflections(case))).dataset())
    assert {"mesh_force_spectrum", "side_bands_carrier-sun", "side_bands_gear_1-gear_2"} <= set(figures)
    (ax,) = figures["side_bands_carrier-sun"].axes
    order, _ = ax.get_lines()[0].get_data()
    assert order[0] < 184.0 < order[-1] and len(ax.texts) == 7
