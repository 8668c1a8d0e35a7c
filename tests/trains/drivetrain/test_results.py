"""Two stages between the same bodies: names, and the series and results of either."""

import numpy as np
import pytest

from femgear.trains.drivetrain.figures import stiffness_figure
from femgear.trains.drivetrain.model import BENDING, case_model
from femgear.trains.drivetrain.parts import numbered
from femgear.trains.drivetrain.results import chosen_meshes
from femgear.trains.drivetrain.stages import solve_transient_run
from femgear.trains.reading import parse_case

TEXT = """
    model = "drivetrain"
    title = "two pairs of gears side by side"
    body = [{name = "a", inertia = "0.25 kg m^2", mass = "20 kg", tilts = false},
            {name = "b", inertia = "2 kg m^2", mass = "60 kg", tilts = false}]
    bearing = [{body = "a", radial = "2e8 N/m"}, {body = "b", radial = "1e8 N/m"}]
    operation = {speed = "1000 rpm", torque = [{body = "a", torque = "60 N m"}, {body = "b", share = 1.0}]}
    simulation = {duration = "0.1 s", damping_ratio = 0.03}
    [[parallel]]
    between = ["a", "b"]
    teeth = [23, 71]
    module = "3 mm"
    mesh = {stiffness = "3e8 N/m", contact_ratio = 1.7}
    [[parallel]]
    between = ["a", "b"]
    teeth = [23, 71]
    module = "3 mm"
    mesh = {stiffness = "1e8 N/m", contact_ratio = 1.3}
"""


def test_numbers_are_free_ones():
    assert numbered(["a-b", "c", "a-b", "a-b"]) == ["a-b", "c", "a-b 2", "a-b 3"]
    assert numbered(["a-b 2", "a-b", "a-b"]) == ["a-b 2", "a-b", "a-b 3"]
    assert numbered([]) == []


@pytest.fixture(scope="module")
def case():
    return parse_case(TEXT)


def test_every_mesh_is_found_by_its_name(case):
    result = solve_transient_run(case)
    data = result.dataset()
    assert list(data["mesh"].values) == ["a-b", "a-b 2"]
    run = result.runs[BENDING]
    for number, name in enumerate(("a-b", "a-b 2")):
        assert np.array_equal(data["mesh_force"].sel(mesh=name).values[0], run.force[:, number])
    assert chosen_meshes(data) == [0, 1]
    # a third of the stiffness takes about a third of the force of the other
    first, second = data["mesh_force"].values[0].mean(axis=0)
    assert 0.2 < second / first < 0.45


def test_every_panel_shows_its_own_series(case):
    panels = stiffness_figure(case_model(case)).axes
    for ax, mean in zip(panels, (300.0, 100.0), strict=True):
        wave, series, level = (line.get_ydata() for line in ax.get_lines())
        assert np.trapezoid(series, dx=1.0 / 800) == pytest.approx(mean, rel=1e-3)
        assert level[0] == pytest.approx(mean, rel=1e-6) and f"mean {mean:g} N/µm" in ax.get_title(loc="left")
        # the series follows its rectangle
        assert np.mean(np.abs(series - wave)) < 0.05 * np.mean(wave)
