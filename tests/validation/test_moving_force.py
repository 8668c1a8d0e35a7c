"""The travelling load of the ring and its exact motion; two routes against it."""

import numpy as np
import pytest

from validation.moving_force import DAMPING, DIAMETERS, ELEMENTS, FORCE, HARMONICS, moving_force, run
from validation.planetary import reference_set


@pytest.fixture(scope="module")
def case():
    return moving_force()


@pytest.fixture(scope="module")
def points():
    """Nodes in the order of the degrees of freedom."""
    from validation.mapped import mapped_grid, ring_mapping

    ring = reference_set().ring
    return mapped_grid(ring_mapping(ring.root_radius, ring.rim_radius), 1, ELEMENTS, closed=True).points


def test_moment_of_the_load(case, points):
    gears = reference_set()
    times = np.linspace(0.0, 2 * case.mesh_period, 17)
    force = case.force(times).reshape(len(times), -1, 2)
    moment = (points[:, 0] * force[..., 1] - points[:, 1] * force[..., 0]).sum(axis=1)
    phase = gears.ring.teeth * case.carrier * times
    sizes = sum(share * np.cos(h * phase) for h, share in enumerate(HARMONICS))
    arm = gears.ring.root_radius * np.cos(gears.working_pressure_angle_planet_ring)
    np.testing.assert_allclose(moment, 3 * FORCE * arm * sizes, rtol=1e-5)


def test_load_travels_with_the_carrier(case, points):
    # one element of the ring holds a whole number of teeth, so that the mesh phase is that of the start
    gears, angle = reference_set(), 2 * np.pi / ELEMENTS
    assert gears.ring.teeth % ELEMENTS == 0
    first, later = case.force(np.array([0.0, angle / case.carrier])).reshape(2, -1, 2)
    c, s = np.cos(angle), np.sin(angle)
    turned = first @ np.array([[c, s], [-s, c]])
    place = points @ np.array([[c, s], [-s, c]])
    to = np.array([np.hypot(*(points - p).T).argmin() for p in place])
    np.testing.assert_allclose(later[to], turned, atol=1e-9 * np.abs(first).max())
    # the radial push of planet 1 lies around it, spread as it should be
    radial = (first * points).sum(axis=1) / np.hypot(*points.T)
    about = np.abs(np.arctan2(points[:, 1], points[:, 0])) < np.radians(42.5)
    x = np.radians(np.linspace(-180.0, 180.0, 36001))
    bump = np.cos(0.5 * x) ** (2 * DIAMETERS)
    share = bump[np.abs(x) < np.radians(42.5)].sum() / bump.sum()
    assert radial[about].sum() == pytest.approx(share * radial.sum() / 3, rel=0.01)


def test_exact_motion_starts_at_rest_and_obeys_the_equation(case):
    step = 1e-3 / case.modes.frequency[-1]
    times = np.array([0.0, step])
    q = case.exact(times)
    size = np.abs(case.exact(case.times(4))).max()
    assert np.abs(q[0]).max() < 1e-12 * size
    # at rest: the displacement after a short time is that of the acceleration alone
    system = case.damped.system
    acceleration = np.linalg.solve(system.M, case.force(times[:1])[0])
    np.testing.assert_allclose(q[1], 0.5 * step**2 * acceleration, atol=1e-2 * np.abs(q[1]).max())
    # later: M q'' + C q' + K q = force, by central differences of low modes
    low = case.modes.shape[:, :6]
    h, middle = 1e-7, 2.3 * case.mesh_period
    before, now, after = case.exact(middle + h * np.array([-1.0, 0.0, 1.0])) @ (system.M @ low)
    natural = 2 * np.pi * case.modes.frequency[:6]
    left = (after - 2 * now + before) / h**2
    left += 2 * DAMPING * natural * (after - before) / (2 * h) + natural**2 * now
    force = case.force(np.array([middle])) @ low
    np.testing.assert_allclose(left, force[0], atol=1e-3 * np.abs(force).max())


def test_routes_close_in_on_the_exact_motion(case):
    coarse, fine = (run("modal", steps, count=20) for steps in (32, 64))
    assert fine.error < 2e-3 < coarse.error < 8e-3
    newmark = run("average acceleration", 32)
    assert 0.05 < newmark.error < 0.25
    assert newmark.unknowns == len(case.damped.system.M)
