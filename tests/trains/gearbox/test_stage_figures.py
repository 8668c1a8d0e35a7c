"""Pictures of several stages show where modes live, and which stage makes the mesh forces of which."""

import numpy as np
import pytest
import xarray as xr

from femgear.trains.gearbox.stage_figures import draw_stage_energy, draw_stage_forces

STAGES = ["first", "second"]


def modes_data() -> xr.Dataset:
    """Modes of two stages: a pair of translational ones, two rotational ones, a rigid one."""
    energy = np.array([[1.0, 0.2, 0.4, 0.9, 0.3], [0.0, 0.8, 0.6, 0.1, 0.7]])
    return xr.Dataset(
        {
            "frequency": ("mode", [0.0, 100.0, 100.0 + 1e-7, 250.0, 400.0]),
            "planet_kind": ("mode", ["rigid", "translational", "translational", "rotational", "rotational"]),
            "stage_energy": (("stage", "mode"), energy),
        },
        {"stage": STAGES},
    )


def forces_data() -> xr.Dataset:
    """Forces of a set and a pair at three speeds."""
    force = np.arange(1.0, 19.0).reshape(3, 3, 2)
    meshes = ["first sun-planet 1", "first planet 1-ring", "second"]
    coords = {"speed": [100.0, 200.0, 300.0], "mesh": meshes, "stage": STAGES}
    of_stage = "mesh", ["first", "first", "second"]
    forces = {"mesh_force_by_stage": (("speed", "mesh", "stage"), force), "stage_of_mesh": of_stage}
    return xr.Dataset(forces, coords, {"reference": "input"})


def test_every_class_has_a_panel_with_the_shares_of_the_stages():
    figure = draw_stage_energy(modes_data())
    assert [ax.get_title(loc="left") for ax in figure.axes] == ["rotational modes", "translational modes"]
    heights = [[patch.get_height() for patch in ax.patches] for ax in figure.axes]
    assert heights[0] == pytest.approx([0.9, 0.3, 0.1, 0.7])
    # two modes of one frequency are one bar
    assert heights[1] == pytest.approx([0.3, 0.7])
    assert [text.get_text() for text in figure.axes[1].get_xticklabels()] == ["100"]


def test_one_stage_or_no_planets_have_no_picture_of_shares():
    assert draw_stage_energy(modes_data().isel(stage=[0])) is None
    data = modes_data()
    data["planet_kind"] = ("mode", [""] * 5)
    assert draw_stage_energy(data) is None


def test_the_first_mesh_of_every_stage_has_a_panel_with_a_curve_of_every_stage():
    data = forces_data()
    figure = draw_stage_forces(data)
    force = data["mesh_force_by_stage"].values
    for ax, mesh in zip(figure.axes, (0, 2), strict=True):
        curves = {line.get_label(): line.get_ydata() for line in ax.lines}
        assert curves["first"] == pytest.approx(force[:, mesh, 0])
        assert curves["second"] == pytest.approx(force[:, mesh, 1])
        assert curves["all stages"] == pytest.approx(np.hypot(*force[:, mesh].T))
        assert ax.get_yscale() == "log" and str(data["mesh"].values[mesh]) in ax.get_title(loc="left")
    assert figure.axes[-1].get_xlabel() == "speed of input [rpm]"


def test_a_stage_that_excites_alone_has_no_picture_of_forces():
    assert draw_stage_forces(forces_data().drop_vars("mesh_force_by_stage")) is None


def test_a_run_up_of_one_speed_has_markers_and_an_axis_with_a_width():
    ax = draw_stage_forces(forces_data().isel(speed=[1])).axes[0]
    assert ax.get_xlim() == pytest.approx((180.0, 220.0))
    assert {line.get_marker() for line in ax.lines} == {"o", "s", "^"}
    several = draw_stage_forces(forces_data()).axes[0]
    assert several.get_xlim() == (100.0, 300.0) and {line.get_marker() for line in several.lines} == {"None"}
