"""Figures of the helical set: what is drawn where."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from published.planetary_sets import kahraman_set

from femgear.errors import CaseError
from femgear.report.style import png_bytes
from femgear.stages.lumped_set import gear_set_modes, in_space
from femgear.system.mesh_directions import free_motions, gear_set_system
from femgear.system.mode_kinds import gear_set_motions, phasing
from femgear.trains.helical.figures import spatial_mode_shapes

GEARS = ("sun", "planet", "ring")


def modes_file(data, modes):
    """What a figure reads of modes.nc."""
    shape, dofs = in_space(data, modes.shape)
    names = phasing(gear_set_motions(data, modes.shape))
    variables = {
        "frequency": ("mode", modes.frequency),
        "kind": ("mode", list(modes.kind)),
        "phasing": ("mode", list(names)),
        "shape": (("dof", "mode"), shape),
    }
    return xr.Dataset(variables, coords={"dof": dofs})


def geared(data):
    """Gears with the radii of the set."""
    gears = {name: SimpleNamespace(base_radius=getattr(data, f"{name}_radius")) for name in GEARS}
    return SimpleNamespace(
        **gears,
        n_planets=data.n_planets,
        centre_distance=data.centre_distance,
        planet_angles=data.planet_angles,
        working_pressure_angle_sun_planet=data.pressure_angle_sun_planet,
        working_pressure_angle_planet_ring=data.pressure_angle_planet_ring,
    )


def drawn(data, dof, value):
    """Figure of one mode whose shape moves one coordinate alone."""
    system, modes = gear_set_system(data), gear_set_modes(data)
    shape = value * (np.array(system.dofs) == dof)[:, None]
    one = replace(modes, frequency=np.ones(1), kind=("rotational-axial",), shape=shape)
    return spatial_mode_shapes(modes_file(data, one), geared(data), scale=0.1)


def test_front_view_shows_where_the_bodies_go():
    """Planet 2 stands on the y axis: outwards is along y."""
    data = kahraman_set()
    figure = drawn(data, "planet 2: radial", 0.7)
    front, side = figure.axes
    circles = [line for line in front.get_lines() if len(line.get_xdata()) > 2 and line.get_label() == "planets"]
    centre = [np.mean([line.get_xdata()[:-1], line.get_ydata()[:-1]], axis=1) for line in circles]
    expected = data.centre_distance * np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
    expected[1, 1] += 0.1 * data.ring_radius
    np.testing.assert_allclose(centre, expected, atol=1e-12)
    assert all(np.ptp(line.get_ydata()) == 0.0 for line in side.get_lines())
    assert png_bytes(figure).startswith(b"\x89PNG")


def test_bodies_at_rest_touch_and_planets_stay_inside_the_ring():
    data = kahraman_set()
    front = drawn(data, "sun: u", 1.0).axes[0]
    rest = [line for line in front.get_lines() if line.get_label() == "at rest" and len(line.get_xdata()) > 2]
    points = [(line.get_xdata(), line.get_ydata()) for line in rest]
    circles = [(np.mean(x[:-1]), np.mean(y[:-1]), 0.5 * np.ptp(x)) for x, y in points]
    (_, _, _), (*_, ring), (*_, sun), *planets = circles
    assert len(planets) == 4
    for x, y, radius in planets:
        distance = np.hypot(x, y)
        assert distance - radius == pytest.approx(sun, rel=1e-3)
        assert distance + radius == pytest.approx(ring, rel=1e-3)
        assert distance + radius <= ring * (1.0 + 1e-9)


def test_side_view_shows_tilt_and_axial_motion():
    """The sun turns about y by a positive angle: its end at positive x goes down, phi x r = -phi r z."""
    data = kahraman_set()
    for dof, ends in (("sun: tilt y", (1.0, -1.0)), ("sun: z", (1.0, 1.0))):
        figure = drawn(data, dof, 0.4)
        lines = [line for line in figure.axes[1].get_lines() if line.get_color() == "#D55E00"]
        (sun,) = lines
        pitch = 1.0 / np.cos(data.pressure_angle_sun_planet)
        np.testing.assert_allclose(sun.get_xdata(), pitch * data.sun_radius * np.array([-1, 1]), rtol=1e-3)
        # tilts are arcs on the base circle, drawn out to the pitch circle
        size = 0.1 * data.ring_radius * (sun.get_xdata()[1] / data.sun_radius if "tilt" in dof else 1.0)
        rest = [line for line in figure.axes[1].get_lines() if line.get_color() == "0.82"]
        assert len(rest) == 7 and all(np.ptp(line.get_ydata()) == 0.0 for line in rest)
        (level,) = {line.get_ydata()[0] for line in rest if np.array_equal(line.get_xdata(), sun.get_xdata())}
        np.testing.assert_allclose(sun.get_ydata() - level, size * np.array(ends), rtol=1e-12)
    assert free_motions(data).shape == (42, 42)


def test_eight_shapes_have_two_views_each_and_pairs_stand_once():
    data = kahraman_set()
    modes = gear_set_modes(data)
    figure = spatial_mode_shapes(modes_file(data, modes), geared(data))
    titles = [ax.get_title() for ax in figure.axes]
    assert len(figure.axes) == 16 and "modes 2 and 3: 644.4 Hz" in titles[0]
    assert "translational-tilting" in titles[0]
    numbers = [word for title in titles for word in title.split(":")[0].split() if word.isdigit()]
    assert len(set(numbers)) == len(numbers) and numbers[:2] == ["2", "3"]
    rest = replace(modes, frequency=0.0 * modes.frequency)
    with pytest.raises(CaseError, match="E-MODES"):
        spatial_mode_shapes(modes_file(data, rest), geared(data))
