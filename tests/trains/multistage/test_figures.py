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
    }
)


def response(speed, excited_by=(1,), **variables):
    """Contents of response.nc as far as the figures read them."""
    dims = {"mesh_frequency": ("excited_by", "speed"), "first_force": ("excited_by", "speed", "stage")}
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
    speed = np.array([100.0, 200.0])
    mesh = np.array([[8.0, 2.0], [16.0, 4.0]])
    (ax,) = mesh_orders(MODES, response(speed, (1, 2), mesh_frequency=mesh.T)).axes
    levels = [line.get_ydata()[0] for line in ax.lines if len(set(line.get_ydata())) == 1]
    assert levels == [10.0, 20.0, 20.0, 30.0]
    slopes = [line.get_ydata() for line in ax.lines if len(set(line.get_ydata())) > 1]
    assert slopes == pytest.approx(np.array([[8, 16], [16, 32], [2, 4], [4, 8]], float))


def test_forces_of_every_stage_with_points_beside_them():
    speed = np.linspace(100.0, 200.0, 5)
    total = np.outer(np.arange(1.0, 6.0), [1.0, 10.0])
    other = response([150.0], total_force=np.array([[3.0, 30.0]]))
    figure = stage_forces(response(speed, total_force=total, first_force=np.ones((1, 5, 2))), other)
    for stage, ax in enumerate(figure.axes):
        assert ax.lines[0].get_ydata() == pytest.approx(total[:, stage])
        assert ax.lines[2].get_ydata() == pytest.approx([3.0 * 10.0**stage])
        assert ax.get_ylim()[1] > 50.0 if stage else ax.get_ylim()[1] < 50.0
    assert figure.axes[0].get_title(loc="left") == "sun-planet 1 of stage 1"
