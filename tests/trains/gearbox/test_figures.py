"""Pictures of a gearbox show its curves, arrows and names."""

import numpy as np
import pytest
from small_gearbox import pair_tables

from femgear.trains.gearbox.figures import deflected_shafts, gearbox_campbell, load_patterns, mode_energy
from femgear.trains.gearbox.stages import solve_box_modes, solve_deflections
from femgear.trains.reading import read_case

pytestmark = pytest.mark.usefixtures("coarse_states")


@pytest.fixture(scope="module")
def data():
    case = read_case(pair_tables())
    deflection = solve_deflections(case)
    return deflection.dataset(), solve_box_modes(case, deflection).dataset()


def test_every_shaft_has_a_curve_in_both_planes_and_bearings_their_forces(data):
    figure = deflected_shafts(data[0])
    assert [ax.get_ylabel() for ax in figure.axes] == ["deflection along x [µm]", "deflection along y [µm]"]
    for way, ax in enumerate(figure.axes):
        drawn = {line.get_label(): line.get_ydata() for line in ax.lines}
        assert {"input", "output"} <= drawn.keys()
        own = data[0]["member"].values == "input"
        moved = data[0]["displacement"].values[0, own, way]
        assert np.abs(drawn["input"]).max() == pytest.approx(1e6 * np.abs(moved).max(), rel=1e-9)
        assert {text.get_text().split("\n")[0] for text in ax.texts if text.get_text()} == {"A", "B", "C", "D"}


def test_of_many_bearings_those_with_the_largest_forces_are_named(data):
    from femgear.trains.gearbox import figures

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figures, "_MOST_NAMED", 2)
        figure = deflected_shafts(data[0])
    force = np.abs(data[0]["bearing_force"].values[0])
    for way, ax in enumerate(figure.axes):
        expected = {"ABCD"[i] for i in np.argsort(force[:, way])[-2:]}
        named = {text.get_text().split("\n")[0] for text in ax.texts if text.get_text()}
        assert named <= expected and named


def test_shafts_that_stay_where_they_are_have_no_picture(data):
    still = data[0].copy(deep=True)
    still["displacement"][..., :2] = 1e-15
    assert deflected_shafts(still) is None


SLOW = [pytest.param(forces, marks=pytest.mark.slow) for forces in ("alike", "one of them small")]


@pytest.mark.parametrize("forces", ["near one another", *SLOW])
def test_no_name_of_a_bearing_lies_on_another_or_on_an_arrow(data, forces):
    near = data[0].copy(deep=True)
    near["bearing_displacement"][:] = 0.0
    near["bearing_force"][:] = 2e4
    if forces == "alike":
        near["bearing_place"][:] = near["bearing_place"][0]
    elif forces == "near one another":
        near["bearing_place"][..., 2] = [0.0, 0.002, 0.06, 0.06]
        near["bearing_displacement"][..., :2] = np.array([1e-6, 3e-6, 0.0, 0.0])[:, None]
    else:
        near["bearing_force"][0] = 1e3
    figure = deflected_shafts(near)
    figure.draw_without_rendering()
    for ax in figure.axes:
        names = [text for text in ax.texts if text.get_text()]
        assert [text.get_text().split("\n")[0] for text in names] == [*"ABCD"]
        boxes = [text.get_window_extent() for text in names]
        boxes += [text.arrow_patch.get_window_extent() for text in ax.texts if text.arrow_patch is not None]
        named = range(len(names))
        assert not any(boxes[i].overlaps(box) for i in named for k, box in enumerate(boxes) if k > i)


def test_loads_over_the_width_integrate_to_the_force(data):
    (ax,) = load_patterns(data[0]).axes
    line = ax.lines[0]
    step = line.get_xdata()[1] - line.get_xdata()[0]
    force = float(data[0]["mesh_force"].values[0, 0])
    assert line.get_ydata().sum() * step == pytest.approx(force, rel=1e-9)


def test_energies_fill_their_bars_and_equal_modes_have_one(data):
    twice = data[1].copy(deep=True)
    twice["frequency"][-1] = twice["frequency"][-2]
    (ax,) = mode_energy(data[1]).axes
    assert len(ax.get_xticks()) == len(mode_energy(twice).axes[0].get_xticks()) + 1 <= 24
    tops = {}
    for bar in ax.patches:
        tops[round(bar.get_x(), 3)] = max(tops.get(round(bar.get_x(), 3), 0.0), bar.get_y() + bar.get_height())
    assert list(tops.values()) == pytest.approx([1.0] * len(tops))


def test_the_campbell_diagram_has_modes_by_kind_lines_by_name_and_the_speed_of_operation(data):
    ax = gearbox_campbell(data[1]).axes[0]
    names = {line.get_label() for line in ax.lines}
    assert {"bending", "axial", "critical speed", "speed of operation"} <= names
    assert {"harmonic 2 of stage mesh", "harmonic 3 of stage mesh"} <= {text.get_text() for text in ax.texts}
    operation = next(line for line in ax.lines if line.get_label() == "speed of operation")
    assert operation.get_xdata() == pytest.approx([1000.0, 1000.0])
    assert ax.get_xlabel() == "speed of input [rpm]"


def test_a_campbell_diagram_ends_above_the_lines_and_counts_the_modes_beyond(data):
    modes = data[1].copy(deep=True)
    hertz = np.sort(modes["frequency"].values[modes["frequency"].values > 0.0])
    # the highest line reaches the middle between two modes, over 1.3
    reach = 0.5 * (hertz[len(hertz) // 2 - 1] + hertz[len(hertz) // 2])
    modes["order"].values[:] *= 60.0 * reach / 1.3 / float(modes["campbell_speed"].max() * modes["order"].max())
    ax = gearbox_campbell(modes).axes[0]
    assert ax.get_ylim()[1] == pytest.approx(reach)
    assert ax.get_title(loc="left") == f"{(hertz > reach).sum()} modes above, which no line comes near"


def test_names_of_lines_of_excitation_do_not_lie_on_one_another(data):
    modes = data[1].copy(deep=True)
    # all leave at the right end, half way up
    middle = 30.0 * float(modes["campbell_frequency"].max() / modes["campbell_speed"].max())
    modes["order"].values[:] = middle * (1.0 + 0.01 * np.arange(modes.sizes["line"]))
    figure = gearbox_campbell(modes)
    figure.canvas.draw()
    boxes = [text.get_window_extent() for text in figure.axes[0].texts]
    assert len(boxes) == modes.sizes["line"] > 2
    assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[:i])
