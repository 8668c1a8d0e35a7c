"""Figures of stages in series show what they are given."""

import numpy as np
import pytest
import xarray as xr

from femgear.trains.multistage.figures import mesh_orders, stage_energy, stage_forces

KINDS = ["rigid", "rotational", "translational", "translational", "rotational"]
SHARE = np.array([[1.0, 0.25, 0.4, 0.8, 1.0], [0.0, 0.75, 0.6, 0.2, 0.0]])
MODES = xr.Dataset(
    {
        "frequency": ("mode", [0.0, 10.0, 20.0, 20.0, 30.0]),
        "kind": ("mode", KINDS),
        "energy": (("stage", "mode"), SHARE),
        "mesh_deflection": (("mesh", "mode"), [[0.0, 1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 1.0, 1.0]]),
    }
)


def response(speed, excited_by=(1,), **variables):
    """Contents of response.nc as far as the figures read them."""
    dims = {"mesh_frequency": ("excited_by", "speed"), "first_force": ("excited_by", "speed", "stage")}
    force = ("excited_by", "speed", "harmonic", "mesh")
    dims |= {"mesh_force_real": force, "mesh_force_imag": force}
    data = {name: (dims.get(name, ("speed", "stage")), value) for name, value in variables.items()}
    return xr.Dataset(data, coords={"speed": speed, "harmonic": [1, 2], "excited_by": list(excited_by)})


def test_bars_stack_the_shares_and_double_modes_stand_once():
    figure = stage_energy(MODES)
    rotational, translational = figure.axes
    assert [bar.get_height() for bar in rotational.patches] == pytest.approx([0.25, 1.0, 0.75, 0.0])
    assert [bar.get_y() for bar in rotational.patches][2:] == pytest.approx([0.25, 1.0])
    assert [bar.get_height() for bar in translational.patches] == pytest.approx([0.6, 0.4])
    assert [text.get_text() for text in rotational.get_xticklabels()] == ["10", "30"]
    assert [text.get_text() for text in translational.get_xticklabels()] == ["20"]
    assert rotational.get_title(loc="left") == "rotational modes"


def test_lines_of_mesh_frequencies_and_modes_in_reach():
    speed = np.array([100.0, 120.0, 200.0])
    mesh = np.array([[8.0, 2.0], [9.8, 2.4], [16.0, 4.0]])
    force = np.ones((2, 3, 2, 2))
    # harmonic 1 of stage 1 has a peak near the mode at 10 Hz, in the mesh that the mode moves
    force[0, 1, 0, 0] = 50.0
    data = response(speed, (1, 2), mesh_frequency=mesh.T, mesh_force_real=force, mesh_force_imag=np.zeros_like(force))
    (ax,) = mesh_orders(MODES, data).axes
    levels = [line.get_ydata()[0] for line in ax.lines if len(line.get_ydata()) == 2]
    assert levels == [10.0, 20.0, 20.0, 30.0]
    # stage 2 stays below all modes: it is told, not drawn
    slopes = [line.get_ydata() for line in ax.lines if len(line.get_ydata()) == 3]
    assert slopes == pytest.approx(np.array([[8, 9.8, 16], [16, 19.6, 32]], float))
    assert "stage 2: all harmonics below the first mode, 10 Hz" in ax.get_title(loc="left")
    (peak,) = [line for line in ax.lines if len(line.get_ydata()) == 1]
    assert (peak.get_xdata()[0], peak.get_ydata()[0]) == (120.0, 9.8)
    assert [text.get_text() for text in ax.texts] == [" 1 f1", "10", " 2 f1"]


def test_forces_of_every_stage_with_points_beside_them():
    speed = np.linspace(100.0, 200.0, 5)
    total = np.outer(np.arange(1.0, 6.0), [1.0, 10.0])
    other = response([150.0], total_force=np.array([[3.0, 30.0]]))
    figure = stage_forces(response(speed, total_force=total, first_force=np.ones((1, 5, 2))), other)
    for stage, ax in enumerate(figure.axes):
        assert ax.lines[0].get_ydata() == pytest.approx(total[:, stage])
        assert ax.lines[2].get_ydata() == pytest.approx([3.0 * 10.0**stage])
        assert ax.get_ylim()[1] > 50.0 if stage else ax.get_ylim()[1] < 50.0
    words = "sun-planet 1 of stage 1: at most 5 N r.m.s., at 200 rpm"
    assert figure.axes[0].get_title(loc="left") == words
