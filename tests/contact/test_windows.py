"""Windows of pressure cells: how wide a contact is taken to be, and pairs that errors hold apart."""

from dataclasses import replace

import numpy as np
import pytest

from femgear.contact.bodies import make_bodies, make_sectors
from femgear.contact.flank_pairs import flank_pair
from femgear.contact.windows import _contact_half_width, mesh_windows, windows
from femgear.fe.elasticity import Material
from femgear.gears.deviations import no_deviations
from femgear.gears.faults import LEFT, Spall, missing_length
from femgear.gears.gear import Gear
from validation.planetary import reference_set

ALPHA = np.deg2rad(20)


def make(teeth, internal=False):
    rim = 2e-3 * (teeth / 2 + 5 if internal else teeth / 2 - 4)
    return Gear(teeth, 2e-3, ALPHA, 0.0, 0.02, rim, internal=internal)


@pytest.fixture(params=["external", "internal"])
def pair(request):
    if request.param == "external":
        return flank_pair(make(24), make(37), 2e-3 * 61 / 2, ALPHA)
    return flank_pair(make(24), make(75, internal=True), 2e-3 * 51 / 2, ALPHA)


def test_half_width_is_that_of_the_flattest_contact(pair):
    """Johnson, eq. 4.43: a^2 = 4 P R / (pi E*), 1/R = 1/rho_1 +- 1/rho_2, 1/E* = 2 (1 - nu^2)/E."""
    zeta = np.linspace(*pair.path, 2001)
    rho_1 = pair.base_radius_1 * np.tan(ALPHA) + zeta
    rho_2 = pair.base_radius_2 * np.tan(ALPHA) - pair.sign * zeta
    radius = (1.0 / (1.0 / rho_1 + pair.sign / rho_2)).max()
    exact = np.sqrt(4 * 2e5 * radius / (np.pi * 206e9 / (2 * (1 - 0.3**2))))
    steel = Material(206e9, 0.3, 7850.0)
    assert _contact_half_width(pair, 2e5, steel.contact_modulus(steel)) == pytest.approx(exact, rel=2e-2)


def test_errors_of_position_add_to_the_separation_of_a_whole_pair(pair):
    """Three pairs, the second one 7 um further apart than its teeth: no candidate within 5 um any more."""
    middle = 0.5 * sum(pair.path)
    zeta = np.array([middle - 1e-4, middle, middle + 1e-4])
    options = {"width": 4e-4, "cells": 11, "nearest": 5e-6, "line_of_action": False}
    plain, held = windows(pair, zeta, **options), windows(pair, zeta, shift=[0.0, 7e-6, 0.0], **options)
    assert held.gap - plain.gap == pytest.approx(np.array([0, 7e-6, 0])[:, None] * np.ones(11), abs=1e-18)
    assert plain.near.tolist() == [True, True, True] and held.near.tolist() == [True, False, True]


def test_cells_beyond_a_flank_shorter_than_a_window_still_have_nodes_of_their_own(pair):
    """Both ends of the window and its middle: two at one place would have no parabola through them."""
    zeta = np.array([0.5 * sum(pair.path)])
    options = {"width": 4e-4, "cells": 11, "nearest": 5e-6, "line_of_action": False}
    whole = windows(pair, zeta, **options)
    roll = whole.roll[0, 0, 1]
    ends = np.array([roll - 1e-5, roll + 1e-5])
    limits = np.stack([ends, np.array([0.0, 1.0])])[..., None]
    short = windows(pair, zeta, limits=limits, **options)
    arcs = short.roll[0, 0] ** 2 / (2 * pair.base_radius_1)
    assert np.diff(arcs) == pytest.approx([2e-4, 2e-4], rel=1e-6)


def test_windows_reach_over_a_pit_to_both_sides_of_it():
    """By its length to either side, with more cells; those of meshes whose teeth are whole stay."""
    gears, steel = reference_set(), Material(206e9, 0.3, 7850.0)
    bodies = make_bodies(make_sectors(gears, steel, flank_elements=6), steel)
    pit = Spall(0, 0, 3, LEFT, low=8.4e-3, high=8.6e-3, depth=40e-6)
    options = {"share": 4e3, "nearest": 20e-6, "positions": 2}
    whole = mesh_windows(gears, bodies, **options)
    over = mesh_windows(gears, bodies, **options, deviations=replace(no_deviations(gears), faults=(pit,)))
    widths = [setup.cell_area[:, 0].sum(axis=-1) / gears.sun.face_width for setup in (whole, over)]
    assert widths[1][:3] - widths[0][:3] == pytest.approx(2.0 * missing_length([pit], gears, 0, 0.0), rel=1e-9)
    assert widths[1][3:] == pytest.approx(widths[0][3:], rel=1e-9) and over.cells > whole.cells
