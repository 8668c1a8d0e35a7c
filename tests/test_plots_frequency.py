"""Figures over frequency and speed: what they draw, and that every axis says its unit."""

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.report import frequency as figures
from femgear.report.style import png_bytes


def responses():
    f = np.linspace(1.0, 400.0, 1200)
    modes = [1.0 / (a**2 - f**2 + 2j * 0.02 * a * f) for a in (90.0, 230.0)]
    return f, np.column_stack([modes[0] + modes[1], modes[0] - modes[1]])


def duffing():
    """x'' + 0.05 x' + x + 0.1 x^3 = 0.18 cos, one harmonic, with the amplitude as parameter."""
    a = np.linspace(0.19, 2.8412, 400)
    stiffness = 1 + 0.075 * a**2
    middle = stiffness - 0.5 * 0.05**2
    spread = np.sqrt(middle**2 - stiffness**2 + (0.18 / a) ** 2)
    x = np.sqrt(np.concatenate([middle - spread, (middle + spread)[::-1]]))
    return x, np.concatenate([a, a[::-1]])


def falls(x):
    """First and last point between the folds."""
    back = np.flatnonzero(np.diff(x) < 0.0)
    return back[0], back[-1] + 1


def henon(n=4000):
    points = np.zeros((n, 2))
    for i in range(1, n):
        x, y = points[i - 1]
        points[i] = 1 - 1.4 * x * x + y, 0.3 * x
    return points[50:].T


def meissner(d, e):
    """Largest multiplier of x'' + (d + e sgn cos t) x = 0 from its trace."""
    d, e = np.meshgrid(d, e)
    w1, w2 = np.sqrt(d + e + 0j), np.sqrt(d - e + 0j)
    A, B = np.pi * w1, np.pi * w2
    trace = (2 * np.cos(A) * np.cos(B) - (w1 / w2 + w2 / w1) * np.sin(A) * np.sin(B)).real
    return np.abs(np.abs(trace) / 2 + np.sqrt(trace**2 / 4 - 1 + 0j))


def waterfall_data():
    speed, f = np.linspace(500, 3000, 18), np.linspace(0, 2000, 801)
    lines = [
        sum(
            np.exp(-((f - h * n * 27 / 60) ** 2) / 80) / (0.05 + abs(h * n * 27 / 60 - 900) / 900)
            for h in (1, 2)
        )
        for n in speed
    ]
    return speed, f, 1e-6 * np.array(lines)


def all_figures():
    f, H = responses()
    speed = np.linspace(0, 300, 40)
    modes = np.column_stack([743 - speed / 7, 743 + speed / 7, 1475 + 0 * speed])
    x, y = duffing()
    stable = np.ones(len(x), bool)
    first, last = falls(x)
    stable[first + 1 : last] = False
    d, e = np.linspace(0.013, 2.5, 160), np.linspace(0.004, 0.8, 90)
    return {
        "frequency_response": figures.frequency_response(
            f, H, names=["sun: u", "planet 1: u"], peaks=[(90.0, 3.4e-3)]
        ),
        "campbell": figures.campbell(
            speed, modes, orders=[73 / (2 * np.pi), 146 / (2 * np.pi)], order_names=["mesh", "2 x mesh"],
            whirl=np.tile([-1.0, 1.0, 0.0], (40, 1)), critical=[(62.0, 735.0)],
        ),
        "campbell_plain": figures.campbell(speed, modes),
        "waterfall": figures.waterfall(*waterfall_data()),
        "branch": figures.branch(
            x, y, stable, folds=[(x[first], y[first]), (x[last], y[last])], parameter_unit="rad/s",
            others=[("time integration", [1.2, 1.2], [2.5, 0.42])],
        ),
        "poincare": figures.poincare_section(*henon()),
        "poincare_few": figures.poincare_section(
            [[0.1, 0.2], [0.3, 0.35]], [[0.0, 1.0], [0.5, 0.2]], names=["period 2", "other period 2"]
        ),
        "stability": figures.stability_chart(d, e, meissner(d, e), x_label="d [1]", y_label="e [1]"),
        "stability_all_stable": figures.stability_chart([0, 1], [0, 1], np.full((2, 2), 0.5)),
    }  # fmt: skip


@pytest.fixture(scope="module")
def drawn():
    return all_figures()


def test_every_figure_is_a_picture_with_units(drawn):
    for name, figure in drawn.items():
        data = png_bytes(figure)
        assert data.startswith(b"\x89PNG") and 5_000 < len(data) < 600_000, name
        labels = [t for ax in figure.axes for t in (ax.get_xlabel(), ax.get_ylabel()) if t]
        assert len(labels) >= 2 and all("[" in text for text in labels), name


def test_response_shows_amplitude_and_phase(drawn):
    f, H = responses()
    top, bottom = drawn["frequency_response"].axes
    assert top.lines[0].get_ydata() == pytest.approx(np.abs(H[:, 0]))
    phase = bottom.lines[1].get_ydata()
    kept = np.isfinite(phase)
    assert np.exp(1j * np.radians(phase[kept])) == pytest.approx(H[kept, 1] / np.abs(H[kept, 1]))
    assert top.get_yscale() == "log" and len(f) == len(phase)


def test_campbell_tells_whirl_by_colour_and_dash(drawn):
    texts = [text.get_text() for text in drawn["campbell"].legends[0].get_texts()]
    assert texts == ["backward whirl", "forward whirl", "no whirl", "mesh", "2 x mesh", "critical speed"]
    back, forth, *_ = drawn["campbell"].axes[0].lines
    assert back.get_color() != forth.get_color() and back.get_linestyle() != forth.get_linestyle()


def test_branch_is_dashed_where_unstable(drawn):
    x, _ = duffing()
    lines = drawn["branch"].axes[0].lines
    dashed = [line for line in lines if line.get_linestyle() == "--"]
    through = [line for line in lines if line.get_linestyle() == "-"]
    assert len(dashed) == 1 and len(through) == 2
    # a segment with one unstable end is unstable; together they cover every segment once
    first, last = falls(x)
    assert dashed[0].get_xdata() == pytest.approx(x[first : last + 1])
    assert sum(len(line.get_xdata()) - 1 for line in dashed + through) == len(x) - 1
    (folds,) = (line for line in lines if line.get_label() == "fold")
    assert folds.get_ydata() == pytest.approx([2.8362225966, 1.0840801128], rel=3e-3)


def test_waterfall_shifts_by_speed(drawn):
    speed, _, amplitude = waterfall_data()
    lines = drawn["waterfall"].axes[0].lines[: len(speed)]
    scale = 0.25 * np.ptp(speed) / amplitude.max()
    assert lines[0].get_ydata() == pytest.approx(speed[-1] + scale * amplitude[-1])
    # slower spectra are in front
    assert lines[-1].get_zorder() > lines[0].get_zorder()


def test_stability_chart_draws_only_what_is_unstable(drawn):
    (mesh,) = (c for c in drawn["stability"].axes[0].collections if hasattr(c, "get_coordinates"))
    values = mesh.get_array()
    assert values.min() > 1.0 and values.mask.any()
    assert len(drawn["stability_all_stable"].axes) == 1


def test_wrong_shapes_are_refused():
    for call in (
        lambda: figures.frequency_response([1, 2], np.ones((3, 1)), names=["a"]),
        lambda: figures.branch([1, 2], [1, 2], [True]),
        lambda: figures.poincare_section([1, 2], [1]),
        lambda: figures.stability_chart([1, 2], [1, 2, 3], np.ones((2, 3))),
        lambda: figures.waterfall([1.0, 2.0], [1.0, 2.0], np.ones((3, 2))),
    ):
        with pytest.raises(CaseError, match="E-SHAPE"):
            call()
