"""Figures of drivetrains show the numbers they are given."""

import numpy as np

from femgear.plots.drivetrain import backlash_forces, over_time, sensitivity, spectra, stiffness_series

TIME = np.linspace(0.0, 1.0, 50)


def drawn(figure):
    """(x, y) of all lines by panel."""
    return [[line.get_xydata() for line in ax.get_lines()] for ax in figure.axes]


def test_curves_and_units():
    wave = 1e8 * (1.0 + 0.2 * np.sin(TIME))
    stiffness = drawn(stiffness_series(TIME, [("mesh", wave)], [("mesh", 0.9 * wave)]))
    assert np.allclose(stiffness[0][0][:, 1], 90.0 * (1.0 + 0.2 * np.sin(TIME)))
    assert np.allclose(stiffness[0][1][:, 1], 1e-6 * wave)
    panels = [("one", [("a", TIME), ("b", 2.0 * TIME)]), ("two", [("a", TIME**2)])]
    motion = drawn(over_time(TIME, panels, unit="mrad", factor=1e3))
    assert len(motion) == 2 and np.allclose(motion[0][1][:, 1], 2e3 * TIME)
    forces = drawn(backlash_forces(TIME, [("linear", -TIME)]))
    assert np.allclose(forces[0][0][:, 1], -1e-3 * TIME)


def test_spectra_mark_their_lines():
    figure = spectra(TIME, [("mesh", [("a", 1.0 + TIME)])], lines=[("f", 0.5), ("out", 3.0)], unit="N")
    assert [text.get_text() for text in figure.axes[0].texts] == ["f"]
    assert figure.axes[0].get_yscale() == "log"
    assert any(np.allclose(line[:, 0], 0.5) for line in drawn(figure)[0])


def test_bars_start_at_one():
    figure = sensitivity(["mass", "length"], [("line", [[0.5, 2.0], [1.0, 1.5]])])
    bars = figure.axes[0].patches
    assert {bar.get_x() for bar in bars} <= {1.0, 0.5} or all(bar.get_x() == 1.0 for bar in bars)
    assert sorted(round(bar.get_width(), 9) for bar in bars) == [-0.5, 0.0, 0.5, 1.0]


def test_picture_of_a_mode(tmp_path):
    import imageio.v3 as iio

    from femgear.scene.drivetrain import drivetrain_picture

    path = tmp_path / "mode.png"
    wheels = [((0.0, 0.0, 0.0), 0.3, 0.1, 0), ((0.0, 0.0, 1.0), 0.2, 0.1, 1)]
    options = {"wheels": wheels, "centres": [w[0] for w in wheels], "shafts": [(0, 1)], "size": 300}
    scale = drivetrain_picture(
        path, move=[[0.0, 1.0, 0.0], [0.0] * 3], turn=np.zeros((2, 3)), names=("one", "two"), **options
    )
    image = iio.imread(path)
    # the disc moves by the share of the length, 1.1 m from face to face
    assert np.isclose(scale, 0.12 * 1.1, rtol=1e-6)
    assert image.shape[:2] == (300, 300) and np.ptp(image) > 100
