"""Figures: what they draw, that nothing hides anything, and that every axis says its unit."""

import importlib.util
import itertools
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text
from scipy.ndimage import maximum_filter1d

from femgear.errors import StorageError
from femgear.housing.orders import OrderSpectrum
from femgear.housing.sensor import fixed_sensor_signal, stored_lines
from femgear.housing.sound import Cylinder, pressure_transfer
from femgear.report import response, style, waterfall
from femgear.report.response import campbell
from femgear.report.style import COLOURS, WIDTH, _highest, drawn_lines
from femgear.report.tables import describe_response
from femgear.stages import static_figures as static_figures
from femgear.stages.static_results import describe_static
from femgear.trains.elastic import figures as elastic_figures
from femgear.trains.elastic.results import describe_housing

_HERE = Path(__file__).parents[1]
_SPEC = importlib.util.spec_from_file_location("synthetic_results", _HERE / "synthetic_results.py")
synthetic = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(synthetic)
TEETH = synthetic.RING


def all_figures():
    static, modes, dynamics, housing = (getattr(synthetic, n)() for n in ("static", "modes", "dynamics", "housing"))
    gears = synthetic.planetary_set()
    unequal = synthetic.static(defect=0.2)
    return {
        "ste": static_figures.static_transmission_error(static),
        "ste unequal": static_figures.static_transmission_error(unequal),
        "stiffness": static_figures.draw_mesh_stiffness(static, face_width=synthetic.FACE_WIDTH),
        "sharing": static_figures.load_sharing(static),
        "sharing unequal": static_figures.load_sharing(unequal),
        "teeth": static_figures.tooth_loads(static),
        "shapes": response.mode_shapes(modes, gears),
        "frequencies": elastic_figures.natural_frequencies(modes),
        "forces": response.mesh_force_period(dynamics),
        "dte": elastic_figures.transmission_error_period(dynamics, static),
        "dte of four speeds": elastic_figures.transmission_error_period(
            synthetic.dynamics(speeds=np.arange(500, 3000, 500))
        ),
        "dte spectrum": response.transmission_error_spectrum(dynamics),
        "sweep": response.speed_sweep(synthetic.dynamics(speeds=np.linspace(100, 6000, 60))),
        "deflection": elastic_figures.ring_mean_deflection(dynamics, gears),
        "signal": elastic_figures.housing_signal(housing.isel(speed=[1])),
        "orders": elastic_figures.draw_order_spectrum(housing.isel(speed=[1])),
        "modulation": elastic_figures.modulation_polar(housing.isel(speed=[1]), gears.planet_angles),
        "microphone": elastic_figures.microphone_spectrum(housing.isel(speed=[1])),
    }


@pytest.fixture(scope="module")
def figures():
    return all_figures()


def drawn(figure):
    """Renderer of a figure that was just laid out."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return canvas.renderer


@pytest.fixture(scope="module")
def pictures(figures):
    """Bytes of the figures, which are laid out then as they are written."""
    return {name: style.png_bytes(figure) for name, figure in figures.items()}


def test_every_figure_is_a_picture(pictures):
    for name, data in pictures.items():
        assert data.startswith(b"\x89PNG"), name
        assert 10_000 < len(data) < 600_000, name


def test_nothing_is_cut_off(figures, pictures):
    for name, figure in figures.items():
        box, (width, height) = figure.get_tightbbox(), figure.get_size_inches()
        assert box.x0 >= 0.0 and box.y0 >= 0.0 and box.x1 <= width and box.y1 <= height, (name, box)


def test_axes_do_not_reach_into_one_another(figures, pictures):
    for name, figure in figures.items():
        renderer = figure.canvas.get_renderer()
        boxes = [(ax.get_tightbbox(renderer), ax.get_title() or ax.get_ylabel()) for ax in figure.axes]
        for one, other in itertools.combinations([box for box in boxes if box[0] is not None], 2):
            assert not one[0].overlaps(other[0]), (name, one, other)


def test_every_axis_has_a_unit(figures):
    for name, figure in figures.items():
        for ax in figure.axes:
            if ax.name == "polar":
                assert "[" in ax.get_title() and "]" in ax.get_title(), name
            elif ax.axison:
                # axes that share a scale say it once, at the edge of the figure
                for group, text in (
                    (ax.get_shared_x_axes(), "get_xlabel"),
                    (ax.get_shared_y_axes(), "get_ylabel"),
                ):
                    siblings = group.get_siblings(ax)
                    assert any("[" in getattr(one, text)() for one in siblings), (name, text)


def test_legends_stand_outside_the_axes(figures, pictures):
    for name, figure in figures.items():
        renderer = figure.canvas.get_renderer()
        for legend in figure.legends:
            box = legend.get_window_extent(renderer)
            assert figure.bbox.x0 <= box.x0 and box.x1 <= figure.bbox.x1 + 1, name
            for ax in figure.axes:
                assert not box.overlaps(ax.get_window_extent(renderer)), name
        assert all(ax.get_legend() is None for ax in figure.axes), name


def test_text_is_legible_on_paper(figures, pictures):
    """On 170 mm of paper no letter is smaller than 8 pt."""
    for name, figure in figures.items():
        on_paper = min(1.0, 170 / 25.4 / figure.get_figwidth())
        for text in figure.findobj(Text):
            assert not text.get_text() or text.get_fontsize() * on_paper > 7.9, (name, text)
        assert figure.get_figwidth() <= WIDTH, name


def test_no_legend_has_one_entry(figures):
    for name, figure in figures.items():
        assert all(len(legend.get_texts()) > 1 for legend in figure.legends), name


def test_texts_of_the_order_spectrum_do_not_overlap(figures, pictures):
    figure = figures["orders"]
    renderer = figure.canvas.get_renderer()
    for ax in figure.axes:
        boxes = [text.get_window_extent(renderer) for text in ax.texts]
        for i, box in enumerate(boxes):
            assert not any(box.overlaps(other) for other in boxes[:i])
            assert box.y1 <= ax.get_window_extent(renderer).y1 + 2


def test_order_labels_name_harmonic_and_nodal_diameter(figures):
    texts = [text.get_text() for ax in figures["orders"].axes for text in ax.texts]
    assert "537\n−3" in texts and "543\n+3" in texts and "540" in texts
    titles = [ax.get_title(loc="left") for ax in figures["orders"].axes]
    assert any(title.startswith("mesh harmonic 5 (order 5·108 = 540): largest line 5") for title in titles)


def test_identical_meshes_are_drawn_once():
    values = np.ones((6, 8))
    names = synthetic.MESHES
    assert drawn_lines(names, values) == [
        ("all sun-planet meshes (identical)", 0),
        ("all planet-ring meshes (identical)", 3),
    ]
    values[1, 3] = 1.1
    assert [text for text, _ in drawn_lines(names, values)] == [
        *synthetic.MESHES[:3],
        "all planet-ring meshes (identical)",
    ]
    alone = drawn_lines(["sun-planet 1", "planet 1-ring"], values[:2])
    assert alone == [("sun-planet 1", 0), ("planet 1-ring", 1)]


def test_meshes_of_a_family_that_agree_are_drawn_once():
    names = [*(f"sun-planet {n}" for n in (1, 2, 3, 4)), *(f"planet {n}-ring" for n in (1, 2, 3, 4))]
    one, other = np.sin(np.arange(9.0)), np.cos(np.arange(9.0))
    lines = drawn_lines(names, [one, other, one, other, one, one, one, one], partly=True)
    assert lines == [
        ("sun-planet 1, sun-planet 3 (identical)", 0),
        ("sun-planet 2, sun-planet 4 (identical)", 1),
        ("all planet-ring meshes (identical)", 4),
    ]
    lines = drawn_lines(names, np.diag(np.arange(1.0, 9.0)), partly=True)
    assert lines == [(name, row) for row, name in enumerate(names)]


def line_of(figure, text):
    return next(line for ax in figure.axes for line in ax.get_lines() if line.get_label() == text)


def test_transmission_error_is_drawn_in_micrometres_over_a_closed_period(figures):
    ste = synthetic.static()["ste"].values
    line = line_of(figures["ste"], "all sun-planet meshes (identical)")
    np.testing.assert_allclose(line.get_ydata(), np.append(ste[0], ste[0, 0]) * 1e6, rtol=1e-14)
    assert line.get_xdata()[0] == 0 and line.get_xdata()[-1] == 1


def test_stiffness_axes_agree(figures):
    """500 N/µm on 25 mm are 20 N/(mm µm)."""
    figures["stiffness"].draw_without_rendering()
    ax = figures["stiffness"].axes[0]
    second = next(child for child in ax.child_axes)
    low, high = ax.get_ylim()
    np.testing.assert_allclose(second.get_ylim(), (low / 25, high / 25), rtol=1e-12)


def test_one_tooth_pair_carries_over_the_contact_ratio(figures):
    for ax, ratio in zip(figures["teeth"].axes, (1.5507, 1.9301)):
        line = ax.get_lines()[0]
        carrying = line.get_xdata()[line.get_ydata() > 0]
        assert np.ptp(carrying) == pytest.approx(ratio, abs=2 / 64)


def test_dynamic_error_over_the_period_is_the_fourier_sum(figures):
    x = synthetic.dynamics()
    dte = (x["dte_real"] + 1j * x["dte_imag"]).values[0, 0]
    line = line_of(figures["dte"], "dynamic")
    tau = line.get_xdata()[37]
    expected = sum((dte[h] * np.exp(2j * np.pi * h * tau)).real for h in range(1, 13)) * 1e6
    assert line.get_ydata()[37] == pytest.approx(expected, rel=1e-12)
    first = figures["dte"].axes[0].get_title(loc="left")
    assert f"peak to peak {np.ptp(line.get_ydata()):.3g}, static" in first


def test_mesh_forces_are_drawn_whole_with_their_dynamic_factor():
    """1 kN and a wave of 200 N on every mesh, one of the planet-ring meshes with 500 N."""
    dynamics = synthetic.dynamics()
    lines = np.zeros(dynamics["dte_real"].shape)
    lines[..., 0], lines[..., 3], lines[1, 4, 3] = 1000.0, 200.0, -500.0
    for part, values in (("real", lines), ("imag", 0.0 * lines)):
        dynamics[f"mesh_force_{part}"] = (("speed", "mesh", "harmonic"), values)
    at = np.arange(64) / 64
    figure = response.mesh_force_period(dynamics, (at, 900.0 + 100.0 * np.abs(at - 0.5) * np.ones((6, 1))))
    titles = [ax.get_title(loc="left").split("\n")[1] for ax in figure.axes]
    assert titles == ["K_v = 1.200", "K_v = 1.200", "K_v = 1.200", "K_v = 1.500"]
    dynamic, rest = figure.axes[0].get_lines()[:2]
    tau = dynamic.get_xdata()
    np.testing.assert_allclose(dynamic.get_ydata(), 1000 + 200 * np.cos(6 * np.pi * tau), rtol=1e-12)
    assert np.mean(rest.get_ydata()[:-1]) == pytest.approx(925.0, rel=1e-3) and np.ptp(rest.get_ydata()) > 35.0


def test_ring_deflection_of_two_nodal_diameters():
    dynamics = synthetic.dynamics()
    for part in ("real", "imag"):
        dynamics[f"ring_{part}"].values[:] = 0
    n = dynamics["circumferential"].values
    dynamics["ring_real"].values[0, np.abs(n) == 2] = 1e-6
    figure = elastic_figures.ring_mean_deflection(dynamics, synthetic.planetary_set())
    line = line_of(figure, "outer surface, outwards positive")
    np.testing.assert_allclose(line.get_ydata(), 2 * np.cos(2 * line.get_xdata()), atol=1e-12)


def test_ring_mode_of_three_nodal_diameters():
    """Bent without being stretched: three lobes u_r = cos 3 phi move by u_t = -sin(3 phi)/3 along the rim."""
    modes = synthetic.modes()
    mode = int(np.flatnonzero(modes["nodal_diameter"].values == 3)[0])
    figure = response.mode_shapes(modes, synthetic.planetary_set(), shown=[mode], scale=0.1)
    x, y = line_of(figure, "ring, outer surface").get_data()
    phi = np.linspace(0.0, 2 * np.pi, len(x))
    moved = 0.1 * np.exp(1j * phi) * (1 + 0.1 * np.cos(3 * phi) - 0.1j / 3 * np.sin(3 * phi))
    np.testing.assert_allclose(x + 1j * y, moved, atol=1e-12)


def test_modes_along_the_rim_move_its_marks():
    """A ring that turns as a whole stays a circle; its marks move along it."""
    modes = synthetic.modes()
    mode = int(np.flatnonzero(modes["nodal_diameter"].values == 0)[-1])
    parts = ("ring_shape_real", "ring_shape_imag", "ring_tangential_shape_imag")
    for name in (*parts, "ring_tangential_shape_real", "shape"):
        modes[name].values[{"shape": np.s_[:, mode]}.get(name, mode)] = 0.0
    modes["ring_tangential_shape_real"].values[mode, modes["circumferential"].values == 0] = 2.0
    figure = response.mode_shapes(modes, synthetic.planetary_set(), shown=[mode], scale=0.1)
    black = [line for line in figure.axes[0].get_lines() if line.get_color() == style.BLACK]
    marks = [complex(*(values[-1] for values in line.get_data())) for line in black if len(line.get_xdata()) == 2]
    at_rest = np.arange(len(marks)) * 2 * np.pi / len(marks)
    assert len(marks) == 12
    np.testing.assert_allclose(np.array(marks) * np.exp(-1j * at_rest), 0.1 * (1 + 0.1j), atol=1e-12)


def test_rigid_modes_are_left_out(figures):
    titles = [ax.get_title() for ax in figures["shapes"].axes]
    assert titles[0].startswith("mode 2: 310 Hz") and titles[1].startswith("modes 3, 4: 840 Hz")
    # one of every pair
    assert len([title for title in titles if title]) == len(np.unique(synthetic.modes()["frequency"])) - 1


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


def test_the_table_of_the_housing_has_both_sensors():
    block = describe_housing(synthetic.housing())
    column = block.header.index("microphone [dB(A)]")
    assert [row[column] for row in block.rows] == ["50.9", "87.7"]
    assert "1 m from the ring" in block.notes[-1] and "over its face width" in block.notes[-1]


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


def test_sweep_marks_speeds_without_convergence():
    dynamics = synthetic.dynamics(speeds=np.linspace(100, 6000, 30))
    dynamics["converged"].values[[3, 7]] = False
    line = line_of(response.speed_sweep(dynamics), "not converged")
    np.testing.assert_allclose(line.get_xdata(), dynamics["speed"].values[[3, 7]])


def test_sweep_draws_the_rms_of_the_fluctuation(figures):
    x = synthetic.dynamics(speeds=np.linspace(100, 6000, 60))
    tau = np.arange(64) / 64
    dte = (x["dte_real"] + 1j * x["dte_imag"]).values[11, 0]
    signal = (dte[1:, None] * np.exp(2j * np.pi * np.arange(1, 13)[:, None] * tau)).real.sum(axis=0) * 1e6
    line = line_of(figures["sweep"], "all sun-planet meshes (identical)")
    assert line.get_ydata()[11] == pytest.approx(np.sqrt(np.mean(signal**2)), rel=1e-12)


def test_colours_differ_for_deuteranopes():
    """Vienot, Brettel and Mollon (1999): colours of lines stay apart when red and green are confused."""
    to_lms = np.array([[17.8824, 43.5161, 4.11935], [3.45565, 27.1554, 3.86714], [0.0299566, 0.184309, 1.46709]])
    rgb = np.array([[int(c[i : i + 2], 16) / 255 for i in (1, 3, 5)] for c in COLOURS]) ** 2.2
    lms = rgb @ to_lms.T
    lms[:, 1] = 0.494207 * lms[:, 0] + 1.24827 * lms[:, 2]
    seen = np.clip(lms @ np.linalg.inv(to_lms).T, 0, 1) ** (1 / 2.2)
    distance = np.linalg.norm(seen[:, None] - seen[None], axis=2) + np.eye(len(seen))
    assert distance.min() > 0.15


def test_a_figure_is_written_whole_or_not_at_all(tmp_path):
    figure = static_figures.load_sharing(synthetic.static())
    style.save_figure(figure, tmp_path / "a.png")
    style.save_figure(figure, tmp_path / "b.png")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.png", "b.png"]
    with pytest.raises(StorageError):
        style.save_figure(figure, tmp_path / "missing" / "a.png")


def test_figures_do_without_pyplot():
    package = Path(style.__file__).parents[1]
    drawing = {path for path in package.rglob("*.py") if "matplotlib" in path.read_text(encoding="utf-8")}
    drawing |= set(package.rglob("figures.py"))
    names = [".".join(path.relative_to(package.parent).with_suffix("").parts) for path in sorted(drawing)]
    assert {"femgear.report.style", "femgear.report.response"} <= set(names)
    assert len([name for name in names if name.startswith("femgear.trains.")]) >= 7
    code = f"import sys, {', '.join(names)}; sys.exit('matplotlib.pyplot' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], timeout=60).returncode == 0


def test_campbell_diagram_names_its_lines_and_marks_the_critical_speeds():
    speed = np.linspace(0, 300, 40)
    modes = np.column_stack([743 - speed / 7, 743 + speed / 7, 1475 + 0 * speed])
    figure = campbell(
        speed,
        modes,
        orders=np.array([73, 146]) / (2 * np.pi),
        order_names=["mesh", "2 x mesh"],
        critical=[(62.0, 735.0)],
        speed_unit="rpm",
    )
    (ax,) = figure.axes
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts == ["mode", "mesh", "2 x mesh", "critical speed"]
    assert ax.lines[1].get_ydata() == pytest.approx(modes[:, 1])
    assert ax.lines[4].get_ydata()[-1] == pytest.approx(146 * 300 / (2 * np.pi))
    assert ax.get_xlabel() == "speed [rpm]" and ax.get_ylabel() == "natural frequency [Hz]"
    assert style.png_bytes(figure).startswith(b"\x89PNG")


def test_unloaded_set_is_drawn_flat():
    """Without torque everything is zero: figures show that, without warnings of divisions."""
    static = synthetic.static()
    for name in static.data_vars:
        static[name].values[:] = 0.0
    for draw in (
        static_figures.static_transmission_error,
        static_figures.draw_mesh_stiffness,
        static_figures.load_sharing,
        static_figures.tooth_loads,
    ):
        assert style.png_bytes(draw(static)).startswith(b"\x89PNG")


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


@pytest.mark.parametrize("harmonics", [12, 300])
def test_no_line_is_drawn_where_there_is_none(harmonics):
    """Lines at rounding are not there: neither bar nor marker, however many harmonics there are."""
    dynamics = synthetic.dynamics()
    h = np.arange(harmonics + 1)
    lines = np.zeros((2, 6, harmonics + 1), complex)
    lines[..., 1:] = 1e-6 / h[1:]
    lines[:, :3, h % 3 == 0] = 1e-17
    lines[:, 3:, h > 6] = 0.0
    dynamics = dynamics.drop_dims("harmonic").assign_coords(harmonic=h)
    dynamics["dte_real"] = (("speed", "mesh", "harmonic"), lines.real)
    dynamics["dte_imag"] = (("speed", "mesh", "harmonic"), lines.imag)
    figure = response.transmission_error_spectrum(dynamics)
    for speed, ax in enumerate(figure.axes):
        low, high = ax.get_ylim()
        (line,) = ax.get_lines()
        hertz = 1e-3 * float(dynamics["mesh_frequency"][speed // 2])
        # stems from the floor with gaps between them
        drawn_lines = np.column_stack(line.get_data()).reshape(-1, 3, 2)[:, 1] / (hertz, 1.0)
        sun = [(k, 1.0 / k) for k in h[1:] if k % 3]
        ring = [(k, 1.0 / k) for k in range(1, 7)]
        np.testing.assert_allclose(drawn_lines, np.array((sun, ring)[speed % 2]), rtol=1e-12)
        assert low < drawn_lines[:, 1].min() and drawn_lines[:, 1].max() < high
        last = 1e-3 * float(dynamics["mesh_frequency"].max()) * (sun[-1][0] + 0.5)
        assert ax.get_xlim()[0] < hertz and sun[-1][0] * hertz < ax.get_xlim()[1] < last
    assert len(style.png_bytes(figure)) < 600_000


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


def test_both_panels_hold_their_tooth_loads():
    """The panels share one scale: it holds the larger loads, whichever panel has them."""
    for larger in (0, 3):
        static = synthetic.static()
        for name in ("tooth_load", "mesh_force"):
            static[name].values[larger] *= 3.0
        for ax in static_figures.tooth_loads(static).axes:
            low, high = ax.get_ylim()
            for line in ax.get_lines():
                assert low <= np.min(line.get_ydata()) and np.max(line.get_ydata()) < high


def test_a_tooth_pair_is_followed_through_several_mesh_periods():
    """Three periods of a record that grows: a pair carries in the period of its place."""
    one = synthetic.static()
    three = one.isel(position=np.tile(np.arange(64), 3)).assign_coords(position=np.arange(192) / 64)
    three.attrs["mesh_periods"] = 3
    three["tooth_load"] = three["tooth_load"] * (1.0 + np.arange(192) // 64)
    for ax, row in zip(static_figures.tooth_loads(three).axes, (0, 3)):
        line = ax.get_lines()[0]
        # positions follow one another by 1/64 and the loads of places are those of their own periods
        assert np.diff(line.get_xdata()) == pytest.approx(1 / 64)
        load = one["tooth_load"].values[row] * (1.0 + np.arange(one.sizes["tooth"]) % 3)[:, None]
        assert np.max(line.get_ydata()) == pytest.approx(load.max())
    ste = static_figures.static_transmission_error(three).axes[0].get_lines()[0].get_xdata()
    assert np.all(np.diff(ste) > 0) and ste[-1] == 3.0


def test_equal_planets_that_mesh_one_after_the_other_are_drawn_once():
    """Curves of one shape: the first of a kind, and the page says so; another shape is drawn beside it."""
    dynamics, h = synthetic.dynamics(), synthetic.dynamics()["harmonic"].values
    lines = np.zeros(dynamics["dte_real"].shape, complex)
    lines[..., 1:4] = np.array([3e-6, 2e-6, 1e-6])
    lines *= np.exp(2j * np.pi * h * np.tile(np.arange(3) / 3, 2)[:, None])
    for change, count in ((1.0, 1), (1.0005, 1), (1.02, 3)):
        lines[0, 1] *= change
        dynamics["dte_real"].values[:], dynamics["dte_imag"].values[:] = lines.real, lines.imag
        figure = response.transmission_error_period(dynamics)
        ax = figure.axes[0]
        assert len([line for line in ax.get_lines() if len(line.get_xdata())]) == count
        assert ("others shifted" in ax.get_title(loc="left")) == (count == 1)


@pytest.mark.parametrize(("defect", "words"), [(0.0, "all 3 planets carry 33.33 %"), (0.2, "planet 3 carries up")])
def test_load_sharing_says_what_the_planets_carry(defect, words):
    static = synthetic.static(defect=defect)
    ax = static_figures.load_sharing(static).axes[0]
    share = static["load_share"].values
    title = ax.get_title(loc="left")
    factor, _, held = title.rpartition("= ")[2].partition(", ")
    assert held == ("all centres held" if defect else "")
    assert float(factor) == pytest.approx(3.0 * share.mean(axis=1).max(), abs=6e-4)
    most = int(share.max(axis=1).argmax()) + 1
    assert title.startswith(words.replace("planet 3", f"planet {most}"))


def test_a_picture_of_shares_says_when_members_move():
    static = synthetic.static(defect=0.2)
    static["member_motion"] = (("member", "position"), np.zeros((2, static.sizes["position"])))
    title = static_figures.load_sharing(static).axes[0].get_title(loc="left")
    assert title.endswith(", on supports and bearings")


def test_the_table_of_meshes_shows_soft_ones():
    """Teeth of rubber: 0.00497 N/um is no 0.005."""
    soft = synthetic.static().assign(mesh_stiffness=lambda data: 1e-5 * data["mesh_stiffness"])
    block = describe_static(soft)
    column = list(block.header).index("k mean [N/um]")
    shown = [float(row[column]) for row in block.rows]
    expected = 1e-6 * soft["mesh_stiffness"].mean("position").values[: len(shown)]
    np.testing.assert_allclose(shown, expected, rtol=2e-4)


def test_tables_explain_what_holds_the_members_and_what_the_solver_says():
    unequal, equal = (describe_static(synthetic.static(defect=one)).notes[0] for one in (0.2, 0.0))
    assert "all centres held, K_gamma = 1.0" in unequal and "K_gamma" not in equal
    words = " ".join(describe_response(synthetic.dynamics()).notes)
    assert "radius: by what a step of the fixed point multiplies the error" in words
    assert "Floquet: largest growth of a disturbance" in words and "dynamic transmission error" in words


def test_names_lie_on_no_curve():
    """The upper curve dips to the lower one below its end, and rises before its end: both names above it."""
    _, (ax,) = style.new_figure()
    x = np.linspace(0.0, 1.0, 200)
    curves = {"sun-planet": 13.0 + x, "planet-ring": 14.8 + 2.2 * np.clip((x - 0.93) / 0.07, 0.0, 1.0)}
    for name, values in curves.items():
        ax.plot(x, values, label=name)
    ax.set_xlim(0.0, 1.0)
    ax.set_ylim(0.0, 20.0)
    style.name_curves(ax)
    height, beside = 0.085 * 20.0, x > 0.9
    for text in ax.texts:
        bottom = text.xy[1]
        assert all((v[beside] <= bottom + 1e-9).all() or (v[beside] > bottom + height).all() for v in curves.values())
    assert [text.get_text() for text in sorted(ax.texts, key=lambda one: one.xy[1])] == list(curves)


def test_the_run_up_explains_its_numbers_and_its_excitation():
    runup = synthetic.runup()
    title = waterfall.runup_levels(runup).axes[0].get_title(loc="left")
    assert title == "a × b: mode a at mesh harmonic b; dots: operating speeds"
    runup.attrs["method"] = "supports"
    runup["excitation_limit"] = 6.0 * runup["mesh_frequency"]
    title = waterfall.runup_levels(runup).axes[0].get_title(loc="left")
    assert title.endswith("excited up to 1.08 kHz")


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


def test_order_spectra_draw_the_highest_of_lines_too_close_to_part():
    order, floor = np.arange(200_000), 1e-4
    amplitude = 1e-3 * np.random.default_rng(2).random(len(order))
    amplitude[[7, 123_456]] = 1.0
    kept = _highest(order, amplitude, amplitude > floor)
    assert {7, 123_456} <= set(kept.tolist()) and len(kept) <= 4001 and np.all(np.diff(kept) > 0)
    # nothing that is left out stands above what is drawn beside it
    drawn_lines = np.zeros(len(order))
    drawn_lines[kept] = amplitude[kept]
    assert np.all(maximum_filter1d(drawn_lines, 101) >= amplitude * (amplitude > floor))
    few = _highest(order[:3000], amplitude[:3000], amplitude[:3000] > floor)
    assert few.tolist() == np.flatnonzero(amplitude[:3000] > floor).tolist()


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
