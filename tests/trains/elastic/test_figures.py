"""Figures of an elastic set: ring, sensors, motion of the housing, spectra."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from report.test_figures import line_of, synthetic

from femgear.housing.orders import OrderSpectrum
from femgear.housing.sensor import fixed_sensor_signal, stored_lines
from femgear.housing.sound import Cylinder, pressure_transfer
from femgear.report import style
from femgear.stages import static_figures as static_figures
from femgear.trains.elastic import figures as elastic_figures

TEETH = synthetic.RING


def drawn(figure):
    """Renderer of a figure that was just laid out."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return canvas.renderer


def test_ring_deflection_of_two_nodal_diameters():
    dynamics = synthetic.dynamics()
    for part in ("real", "imag"):
        dynamics[f"ring_{part}"].values[:] = 0
    n = dynamics["circumferential"].values
    dynamics["ring_real"].values[0, np.abs(n) == 2] = 1e-6
    figure = elastic_figures.ring_mean_deflection(dynamics, synthetic.planetary_set())
    line = line_of(figure, "outer surface, outwards positive")
    np.testing.assert_allclose(line.get_ydata(), 2 * np.cos(2 * line.get_xdata()), atol=1e-12)


def heard(lines: dict[int, float], *, top: int = 6 * TEETH):
    """Housing data of acceleration lines [m/s^2], ``amplitude cos(order angle)`` of the carrier."""
    housing, order = synthetic.housing().drop_dims("order"), np.arange(top + 1)
    wave = np.zeros((2, top + 1))
    wave[:, list(lines)] = list(lines.values())
    wave /= -np.maximum((order * housing["carrier_speed"].values[:, None]) ** 2, 1e-12)
    housing = housing.assign_coords(order=order).assign_attrs(form="exact")
    return housing.assign(lines_real=(("speed", "order"), wave), lines_imag=(("speed", "order"), 0.0 * wave))


def modulated(depth: float, lobes: int):
    """Housing data of an amplitude-modulated carrier at order 5 z."""
    centre = 5 * TEETH
    return heard({centre - lobes: depth / 2, centre: 1.0, centre + lobes: depth / 2})


def test_polar_modulation_of_an_amplitude_modulated_signal():
    figure = elastic_figures.modulation_polar(modulated(0.8, 4))
    (ax,) = figure.axes
    assert "mesh harmonic 5: 4 lobes up to 1.8 m/s²" in ax.get_title()
    line = line_of(figure, "envelope")
    np.testing.assert_allclose(line.get_ydata(), 1 + 0.8 * np.cos(4 * line.get_xdata()), atol=1e-9)


def test_measured_lines_stand_over_the_computed_ones():
    """In every panel at their orders, those below its floor left out, and the tallest inside the frame."""
    housing = heard({TEETH - 3: 1.0, 2 * TEETH: 0.5})
    orders, accelerations = (TEETH - 3.0, TEETH + 1.0, 2.0 * TEETH), (40.0, 0.2, 1e-9)
    entry = SimpleNamespace(source="rig", orders=orders, accelerations=accelerations)
    figure = elastic_figures.draw_order_spectrum(housing, [entry])
    drawn = [[line for line in ax.get_lines() if line.get_label() == "measured: rig"] for ax in figure.axes[:3]]
    hertz = 1e-3 * float(housing["carrier_speed"][0]) / (2 * np.pi)
    assert drawn[0][0].get_xdata() == pytest.approx([abs(hertz) * order for order in orders[:2]])
    assert drawn[1][0].get_xydata().tolist() == [[TEETH - 3.0, 40.0], [TEETH + 1.0, 0.2]]
    assert len(drawn[2][0].get_xdata()) == 0 and figure.axes[1].get_ylim()[1] > 40.0


@pytest.mark.parametrize("count", [5, 100])
def test_orders_of_lines_stand_above_measured_ones_and_inside_the_frame(count):
    """Whether few or many are measured, none of their marks lies on the name of a line."""
    sides = {side: 10 ** (-abs(side) / 10) for side in (-9, -6, -3, 0, 3, 6, 9)}
    lines = {TEETH * harmonic + side: height for harmonic in (1, 3) for side, height in sides.items()}
    draws = np.random.default_rng(count)
    orders = np.concatenate([[*lines][:count], draws.uniform(TEETH - 9, 3 * TEETH + 9, max(count - len(lines), 0))])
    heights = np.array([lines.get(round(order), 0.1) for order in orders]) * draws.uniform(1.0, 3.0, len(orders))
    entry = SimpleNamespace(source="rig", orders=tuple(orders.tolist()), accelerations=tuple(heights.tolist()))
    figure = elastic_figures.draw_order_spectrum(heard(lines), [entry])
    figure.canvas.draw()
    named = 0
    for ax in figure.axes[1:3]:
        frame = ax.get_window_extent()
        (marks,) = (line for line in ax.get_lines() if line.get_label() == "measured: rig")
        pixels = ax.transData.transform(marks.get_xydata())
        for text in ax.texts:
            named += 1
            box = text.get_window_extent()
            assert box.y1 < frame.y1
            assert not any(box.contains(*place) for place in pixels)
    assert named == 14


@pytest.mark.parametrize("turn", [1.0, -1.0])
@pytest.mark.parametrize("start", [0.0, 0.7])
def test_a_planet_that_is_heard_as_it_passes_stands_on_its_arm(turn, start):
    """Loudest when the planet at 110 degrees of the carrier is at the sensor, whichever way it turns."""
    psi = np.radians(110.0)
    # the planet is at the sensor when the carrier has turned by start - psi
    passing = (turn * (start - psi)) % (2 * np.pi)
    housing = modulated(0.9, 1).assign_attrs(sensor_angle=start, form="exact")
    housing["carrier_speed"] = turn * np.abs(housing["carrier_speed"])
    phase = np.exp(-1j * housing["order"].values * passing)
    lines = housing["lines_real"].values * phase
    housing["lines_real"].values[:], housing["lines_imag"].values[:] = lines.real, lines.imag
    heard_lines = stored_lines(housing.isel(speed=0))
    spectrum = OrderSpectrum(heard_lines.order, heard_lines.acceleration)
    figure = elastic_figures.modulation_polar(housing, [psi], windowed=spectrum)
    for name in ("envelope", "Hanning-window model, scaled"):
        angle, value = line_of(figure, name).get_data()
        assert np.cos(angle[np.argmax(value)] - psi) == pytest.approx(1.0, abs=1e-4), name
    assert line_of(figure, "carrier arms").get_xdata() == pytest.approx([psi, psi])
    assert line_of(figure, "sensor at the start").get_xdata() == pytest.approx([start])


def test_microphone_hears_less_of_many_nodal_diameters():
    """Lines of equal acceleration and n = 0, 3 and 6: both sensors, each relative to its strongest line."""
    housing = heard({TEETH - 6: 1.0, TEETH - 3: 1.0, TEETH: 1.0}).isel(speed=[1])
    band = elastic_figures.microphone_spectrum(housing).axes[1]
    accelerometer, microphone = (
        {round(float(line[0, 0])): float(line[1, 1]) for line in bars.get_segments()} for bars in band.collections
    )
    assert accelerometer == pytest.approx(dict.fromkeys((TEETH - 6, TEETH - 3, TEETH), 0.0), abs=1e-9)
    order, n = TEETH - np.array([6, 3, 0]), np.array([6, 3, 0])
    frequency = order * float(housing["carrier_speed"][0]) / (2 * np.pi)
    cylinder = Cylinder(synthetic.OUTER, synthetic.FACE_WIDTH, 1.2, 343.0)
    pressure = np.abs(pressure_transfer(n, frequency, cylinder, 1.0)) / order
    level = 20 * np.log10(pressure / pressure.max())
    assert level[0] < -40.0 and -8.0 < level[1] < -4.0
    assert microphone == pytest.approx({k: one for k, one in zip(order, level) if one > -50.0}, abs=1e-9)
    assert [text.get_text() for text in band.texts] == ["6", "3", "0"]


def test_motion_of_the_housing_is_that_of_one_cosine():
    """2 m/s^2 at order z: velocity and displacement are over omega and omega^2, r.m.s. over the root of 2."""
    housing = heard({TEETH: 2.0}).isel(speed=[1])
    omega = TEETH * abs(float(housing["carrier_speed"][0]))
    figure = elastic_figures.housing_signal(housing)
    for row, (unit, size) in enumerate((("m/s²", 2.0), ("mm/s", 2e3 / omega), ("µm", 2e6 / omega**2))):
        left, right = figure.axes[2 * row : 2 * row + 2]
        words = f"{size / np.sqrt(2):.4g} {unit} r.m.s., {2 * size:.4g} peak to peak"
        assert left.get_title(loc="left") == words and f"[{unit}]" in left.get_ylabel()
        time, values = right.get_lines()[0].get_data()
        assert time[-1] == pytest.approx(4e3 * 2 * np.pi / omega)
        phase = omega * 1e-3 * time
        assert np.abs(values) == pytest.approx(size * np.abs([np.cos, np.sin][row % 2](phase)), abs=2e-3 * size)


@pytest.mark.slow
def test_silent_housing_is_drawn():
    housing = synthetic.housing()
    for name in ("lines_real", "lines_imag"):
        housing[name].values[:] = 0.0
    for draw in (
        elastic_figures.housing_signal,
        elastic_figures.draw_order_spectrum,
        elastic_figures.modulation_polar,
        elastic_figures.microphone_spectrum,
    ):
        assert style.png_bytes(draw(housing)).startswith(b"\x89PNG")


def shifted(dataset, names):
    """The dataset with every mesh its own: rows rolled by different amounts."""
    found = dataset.copy(deep=True)
    for name in names:
        for row in range(found.sizes["mesh"]):
            found[name].values[row] = np.roll(found[name].values[row], 3 * row + 1, axis=-1) * (1 + 0.01 * row)
    return found


def of_planets(dataset, planets):
    """The dataset with so many planets, meshes repeated."""
    rows = np.concatenate([np.zeros(planets, int), np.full(planets, dataset.sizes["mesh"] // 2)])
    found = dataset.isel(mesh=rows)
    names = [f"sun-planet {n + 1}" for n in range(planets)] + [f"planet {n + 1}-ring" for n in range(planets)]
    return found.assign_coords(mesh=names)


def looks(lines):
    """Colour, dash and width of lines that hold something."""
    return [(one.get_color(), one.get_linestyle(), one.get_linewidth()) for one in lines if len(one.get_xdata())]


@pytest.mark.parametrize("planets", [3, 4, 7])
def test_meshes_that_differ_have_lines_that_differ(planets):
    """Colour and dash of all meshes, thick and thin of both kinds of stiffness."""
    static = shifted(of_planets(synthetic.static(), planets), ("ste", "mesh_stiffness", "mesh_stiffness_secant"))
    left = static_figures.static_transmission_error(static).axes[0]
    assert len(set(looks(left.get_lines()))) == 2 * planets
    figure = static_figures.draw_mesh_stiffness(static)
    assert len(figure.axes) == 2
    drawn = [look for ax in figure.axes for look in looks(ax.get_lines())]
    assert len(set(drawn)) == len(drawn) == 4 * planets
    dynamics = of_planets(synthetic.dynamics(), planets)
    for row in range(2 * planets):
        dynamics["dte_real"].values[:, row] *= 1.0 + 0.05 * row
    figure = elastic_figures.transmission_error_period(dynamics, static)
    for ax in figure.axes:
        dynamic = [one for one in ax.get_lines() if one.get_linewidth() == 2.0]
        assert len({look[:2] for look in looks(dynamic)}) == len(looks(dynamic)) == planets
    renderer = drawn_with_legend(figure)
    assert all(ax.get_window_extent(renderer).height > 150 for ax in figure.axes)


def drawn_with_legend(figure):
    renderer = drawn(figure)
    (legend,) = figure.legends
    box = legend.get_window_extent(renderer)
    assert not any(box.overlaps(ax.get_window_extent(renderer)) for ax in figure.axes)
    return renderer


def test_static_curve_has_the_harmonics_of_the_excitation():
    """Ringing of cut series is in both curves; a static curve with all harmonics is the record itself."""
    static, dynamics = synthetic.static(), synthetic.dynamics()
    frequency = dynamics["mesh_frequency"].values
    ste = static["ste"].values[0] - static["ste"].values[0].mean()
    lines = np.fft.rfft(ste)[1:6] / len(ste) * 2.0
    for limit, expected in ((5.5, 5), (1.0, 1)):
        cut = dynamics.assign(excitation_limit=("speed", limit * frequency))
        figure = elastic_figures.transmission_error_period(cut, static)
        thin = next(one for one in figure.axes[0].get_lines() if one.get_linewidth() == 0.9)
        tau = thin.get_xdata()
        wave = np.exp(2j * np.pi * np.outer(np.arange(1, expected + 1), tau))
        # the record is linear between its positions: lines h are lower by sinc^2(h / P)
        size = np.sinc(np.arange(1, expected + 1) / len(ste)) ** 2
        np.testing.assert_allclose(thin.get_ydata(), 1e6 * ((lines[:expected] * size) @ wave).real, atol=1e-9)
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts == ["dynamic", "static, harmonics of the excitation"]


def test_signals_are_curves_through_their_samples_and_extremes():
    """An unsymmetric signal on a slow one: its largest values above, its smallest below, steps nowhere."""
    housing = heard({3: 0.01, TEETH: 1.0, 2 * TEETH: 0.5, 2 * TEETH + 3: 0.1}).isel(speed=[1])
    axes = elastic_figures.housing_signal(housing).axes
    acceleration, _, displacement = (ax.get_lines()[0].get_data() for ax in axes[::2])
    assert acceleration[1].max() == pytest.approx(1.61, rel=1e-3)
    assert acceleration[1].min() == pytest.approx(-0.86, abs=0.03)
    signal = fixed_sensor_signal(stored_lines(housing.isel(speed=0)))
    turn = np.append(signal.revolution, 1.0)
    for (x, y), name, unit in ((acceleration, "acceleration", 1.0), (displacement, "displacement", 1e6)):
        values = unit * np.append(getattr(signal, name), getattr(signal, name)[0])
        np.testing.assert_allclose(y, np.interp(x, turn, values), rtol=0.0, atol=1e-9 * np.ptp(values))
        assert np.all(np.diff(x) > 0.0)  # where steps would go up and down at one place


def test_spectra_of_hundreds_of_harmonics_stay_legible():
    """Numbers of mesh harmonics above the order spectrum keep apart."""
    housing = heard({TEETH * h - 3: 1.0 / h for h in range(1, 220)}, top=220 * TEETH)
    figure = elastic_figures.draw_order_spectrum(housing.isel(speed=[1]))
    renderer = drawn(figure)
    (top,) = figure.axes[0].child_axes
    boxes = [text.get_window_extent(renderer) for text in top.get_xticklabels()]
    assert 5 < len(boxes) <= 20 and not any(a.overlaps(b) for a, b in itertools.pairwise(boxes))


def test_order_spectrum_says_what_its_lines_are():
    """Exact lines are called so and drawn once; how far the excitation reaches stands above."""
    housing = synthetic.housing()
    names = [text.get_text() for text in elastic_figures.draw_order_spectrum(housing).legends[0].get_texts()]
    assert names == ["Heaviside, linear interpolation", "exact circumferential Fourier"]
    housing.attrs["form"] = "exact"
    housing["excitation_limit"] = ("speed", [1080.0, 2500.0])
    figure = elastic_figures.draw_order_spectrum(housing.isel(speed=[1]))
    assert not figure.legends
    assert [len(ax.get_lines()) for ax in figure.axes] == [1] * len(figure.axes)
    assert "excited up to 2.5 kHz" in figure.get_suptitle()
