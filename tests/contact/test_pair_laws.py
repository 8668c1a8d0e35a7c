"""Tooth pairs by themselves: contacts of Hertz, growing contacts and active sets."""

import numpy as np
import pytest

from femgear.contact import pair_laws
from femgear.contact.local_compliance import surface_displacement
from femgear.fe.elasticity import Material

STEEL = Material(206e9, 0.3, 7850.0)


def rolling_windows(cells=41, *, kink=0.0):
    """Compliance, separations and candidates of windows of a roll on a flat, of radii of 5 to 20 mm.

    Beyond a quarter of the window the flank may fall back by a ``kink`` and rise again.
    """
    width, length, constants = 1.6e-3, 25e-3, (STEEL.shear_modulus, STEEL.poisson_ratio)
    x = width * (np.arange(cells) + 0.5 - 0.5 * cells) / cells
    local = 2.0 * surface_displacement(x[:, None] - x, 0.5 * width / cells, *constants) / length
    radius, shift = np.array([5e-3, 10e-3, 20e-3]), np.array([0.0, 0.1e-3, -0.23e-3])
    beyond = (x - shift[:, None]) ** 2 / (2.0 * radius[:, None])
    beyond += kink * (np.abs(x - shift[:, None] - 0.25 * width) < 0.05 * width)
    # a rigid part that holds the logarithms positive
    local = np.tile(local + 1e-8, (3, 1, 1))
    return x, radius, local, beyond - beyond.min(axis=1, keepdims=True), np.ones(beyond.shape, bool)


def test_windows_by_themselves_are_contacts_of_hertz():
    """Half width and largest pressure of a roll on a flat, K. L. Johnson, Contact Mechanics, section 4.2."""
    x, radius, *windows = rolling_windows(321)
    force = np.array([400.0, 1600.0])
    _, loads = pair_laws._single_pairs(*windows, force)
    assert loads.sum(axis=-1) == pytest.approx(np.broadcast_to(force, (3, 2)))
    step = x[1] - x[0]
    half = np.sqrt(4.0 * force / 25e-3 * radius[:, None] / (np.pi * STEEL.contact_modulus(STEEL)))
    assert (loads > 0.0).sum(axis=-1) * step / 2 == pytest.approx(half, abs=step)
    assert loads.max(axis=-1) / step == pytest.approx(2.0 * force / (np.pi * half), rel=3e-3)


@pytest.mark.parametrize("kink", [0.0, 2e-6, -2e-6])
def test_contacts_that_grow_are_those_of_active_sets(kink):
    *_, local, beyond, cells = rolling_windows(kink=kink)
    force = np.geomspace(1.0, 3000.0, 24)
    approach, loads = pair_laws._growing_contacts(local, beyond, cells, force)
    expected = pair_laws._single_active_sets(local, beyond, cells, force)
    assert approach == pytest.approx(expected[0], rel=1e-11, abs=0)
    assert loads == pytest.approx(expected[1], rel=0, abs=1e-11 * force[-1])
    # what has no room to touch carries nothing
    cells[:, 20:] = False
    beyond = np.where(cells, beyond - beyond[:, :20].min(axis=1, keepdims=True), np.inf)
    approach, loads = pair_laws._growing_contacts(local, beyond, cells, force)
    expected = pair_laws._single_active_sets(local, beyond, cells, force)
    assert approach == pytest.approx(expected[0], rel=1e-11, abs=0) and not loads[:, :, 20:].any()


def test_contacts_that_let_go_are_solved_by_active_sets():
    """Loads on both sides of a cell take it over."""
    local = np.array([[[1.0, 0.8, 0.8], [0.8, 1.0, 0.5], [0.8, 0.5, 1.0]]])
    beyond, cells, force = np.array([[0.0, 0.1, 0.4]]), np.ones((1, 3), bool), np.geomspace(0.1, 9.0, 7)
    approach, loads = pair_laws._single_pairs(local, beyond, cells, force)
    assert (loads >= 0.0).all() and loads[0].sum(axis=-1) == pytest.approx(force)
    gap = beyond + loads[0] @ local[0] - approach[0][:, None]
    assert np.abs(gap[loads[0] > 0.0]).max() < 1e-12 and gap.min() > -1e-12
    assert (pair_laws._growing_contacts(local, beyond, cells, force)[1] < 0.0).any()
