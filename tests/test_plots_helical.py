"""Figures of the helical set: what is drawn where."""

from dataclasses import replace

import numpy as np
import pytest
from published.planetary_sets import cases, kahraman_set

from femgear.errors import CaseError
from femgear.report.style import png_bytes
from femgear.system.assembler import free_motions, gear_set_system
from femgear.trains.helical.figures import helical_mode_shapes, mesh_force_spectra
from femgear.trains.helical.model import helical_modes, modal_error_response, phased_errors


def with_shape(data, dof, value):
    """Modes of the set whose first shape moves one coordinate alone."""
    system, modes = gear_set_system(data), helical_modes(data)
    shape = modes.shape.copy()
    shape[:, 1] = value * (np.array(system.dofs) == dof)
    return replace(modes, shape=shape)


def test_front_view_shows_where_the_bodies_go():
    """Planet 2 stands on the y axis: outwards is along y."""
    data = kahraman_set()
    modes = with_shape(data, "planet 2: radial", 0.7)
    figure = helical_mode_shapes(data, modes, shown=[1], scale=0.1)
    front, side = figure.axes
    circles = [
        line for line in front.get_lines() if len(line.get_xdata()) > 2 and line.get_label() == "planets"
    ]
    centre = [np.mean([line.get_xdata()[:-1], line.get_ydata()[:-1]], axis=1) for line in circles]
    expected = data.centre_distance * np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
    expected[1, 1] += 0.1 * data.ring_radius
    np.testing.assert_allclose(centre, expected, atol=1e-12)
    assert all(np.ptp(line.get_ydata()) == 0.0 for line in side.get_lines())
    assert png_bytes(figure).startswith(b"\x89PNG")


def test_bodies_at_rest_touch_and_planets_stay_inside_the_ring():
    data = kahraman_set()
    front = helical_mode_shapes(data, helical_modes(data), shown=[1]).axes[0]
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
        figure = helical_mode_shapes(data, with_shape(data, dof, 0.4), shown=[1], scale=0.1)
        lines = [line for line in figure.axes[1].get_lines() if line.get_color() == "#D55E00"]
        (sun,) = lines
        pitch = 1.0 / np.cos(data.pressure_angle_sun_planet)
        np.testing.assert_allclose(sun.get_xdata(), pitch * data.sun_radius * np.array([-1, 1]), rtol=1e-3)
        # tilts are arcs on the base circle, drawn out to the pitch circle
        size = 0.1 * data.ring_radius * (sun.get_xdata()[1] / data.sun_radius if "tilt" in dof else 1.0)
        np.testing.assert_allclose(sun.get_ydata(), size * np.array(ends), rtol=1e-12)
    assert free_motions(data).shape == (42, 42)


def test_modes_that_are_not_there_are_refused():
    data = kahraman_set()
    with pytest.raises(CaseError, match="E-MODES"):
        helical_mode_shapes(data, helical_modes(data), shown=[42])


def test_twelve_modes_have_two_views_each():
    data = kahraman_set()
    figure = helical_mode_shapes(data, helical_modes(data))
    assert len(figure.axes) == 24 and "644.35 Hz" in figure.axes[0].get_title()
    assert "translational-tilting" in figure.axes[0].get_title()


def test_spectra_lie_over_the_frequency_of_their_harmonic():
    data = kahraman_set()
    hertz = np.array([100.0, 200.0, 300.0])
    error = np.array([phased_errors(np.full(2, 1e-6), case.phases) for case in cases().values()][:3])
    found = modal_error_response(gear_set_system(data), helical_modes(data, damping_ratio=0.05), hertz, error)
    meshes = [("sun-planet 1", 0), ("planet 1-ring", 4)]
    figure = mesh_force_spectra(found, ["a", "b", "c"], meshes=meshes, marks=[("IP modes", [250.0, 3116.0])])
    lines = figure.axes[1].get_lines()
    assert [line.get_label() for line in lines[:2]] == [
        "harmonic 1, sun-planet 1",
        "harmonic 1, planet 1-ring",
    ]
    np.testing.assert_allclose(lines[3].get_xdata(), 2 * hertz)
    np.testing.assert_allclose(lines[3].get_ydata(), np.abs(found.force[1, :, 1, 4]))
    # marks beyond the axis are left out
    assert list(lines[4].get_xdata()) == [250.0]
    assert png_bytes(figure).startswith(b"\x89PNG")
    with pytest.raises(CaseError, match="E-SHAPE"):
        mesh_force_spectra(found, ["a"])
