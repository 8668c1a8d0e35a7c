"""Figures: what they draw, that nothing hides anything, and that every axis says its unit."""

import importlib.util
import itertools
from pathlib import Path

import numpy as np
import pytest
from matplotlib.text import Text
from scipy.ndimage import maximum_filter1d

from femgear.report import response, style
from femgear.report.style import WIDTH, _highest
from femgear.report.tables import describe_response
from femgear.stages import static_figures as static_figures
from femgear.stages.static_results import describe_static
from femgear.trains.elastic import figures as elastic_figures

_HERE = Path(__file__).parents[1]
_SPEC = importlib.util.spec_from_file_location("synthetic_results", _HERE / "synthetic_results.py")
synthetic = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(synthetic)


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


@pytest.fixture(scope="module")
def pictures(figures):
    """Bytes of the figures with fewer pixels, which are laid out then as they are written."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(style, "_DPI", style._DPI // 2)
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


def line_of(figure, text):
    return next(line for ax in figure.axes for line in ax.get_lines() if line.get_label() == text)


def test_transmission_error_is_drawn_about_its_mean_in_micrometres_over_a_closed_period(figures):
    ste = synthetic.static()["ste"].values
    line = line_of(figures["ste"], "all sun-planet meshes (identical)")
    np.testing.assert_allclose(line.get_ydata(), (np.append(ste[0], ste[0, 0]) - ste[0].mean()) * 1e6, rtol=1e-12)
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


def test_rigid_modes_are_left_out(figures):
    titles = [ax.get_title() for ax in figures["shapes"].axes]
    assert titles[0].startswith("mode 2: 310 Hz") and titles[1].startswith("modes 3, 4: 840 Hz")
    # one of every pair
    assert len([title for title in titles if title]) == len(np.unique(synthetic.modes()["frequency"])) - 1


def test_sweep_draws_the_rms_of_the_fluctuation(figures):
    x = synthetic.dynamics(speeds=np.linspace(100, 6000, 60))
    tau = np.arange(64) / 64
    dte = (x["dte_real"] + 1j * x["dte_imag"]).values[11, 0]
    signal = (dte[1:, None] * np.exp(2j * np.pi * np.arange(1, 13)[:, None] * tau)).real.sum(axis=0) * 1e6
    line = line_of(figures["sweep"], "all sun-planet meshes (identical)")
    assert line.get_ydata()[11] == pytest.approx(np.sqrt(np.mean(signal**2)), rel=1e-12)


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


@pytest.mark.parametrize(("defect", "words"), [(0.0, "all 3 planets carry 33.33 %"), (0.2, "planet 3 carries up")])
def test_load_sharing_says_what_the_planets_carry(defect, words):
    static = synthetic.static(defect=defect)
    ax = static_figures.load_sharing(static).axes[0]
    share = static["load_share"].values
    title = ax.get_title(loc="left")
    factor, _, held = title.rpartition("= ")[2].partition(", ")
    assert held == ("gear axes fixed" if defect else "")
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
    assert "gear axes fixed, K_gamma = 1.0" in unequal and "K_gamma" not in equal
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
