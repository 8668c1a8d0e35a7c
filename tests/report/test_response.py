"""Figures of a response: forces, modes of the ring, sweeps, Campbell diagram."""

import numpy as np
import pytest
from report.test_figures import line_of, synthetic

from femgear.report import response, style
from femgear.report.response import campbell
from femgear.stages import static_figures as static_figures


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


def test_sweep_marks_speeds_without_convergence():
    dynamics = synthetic.dynamics(speeds=np.linspace(100, 6000, 30))
    dynamics["converged"].values[[3, 7]] = False
    line = line_of(response.speed_sweep(dynamics), "not converged")
    np.testing.assert_allclose(line.get_xdata(), dynamics["speed"].values[[3, 7]])


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
