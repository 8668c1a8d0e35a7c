"""Bodies, supports and sets that cannot be, and the equilibrium that contact points leave."""

import math
from dataclasses import replace

import numpy as np
import pytest
from published.planetary_sets import kahraman_set, lin_parker_set

from femgear.errors import CaseError
from femgear.system.mesh_directions import gear_set_system
from femgear.system.rigid_bodies import CENTRAL, HelicalBody, HelicalSupport, PlanarTorque


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: HelicalSupport(radial=-1.0), "radial of -1.0 N/m"),
        (lambda: HelicalSupport(tilt=math.nan), "tilt of nan N m/rad"),
        (lambda: HelicalSupport(axial="stiff"), "axial of 'stiff'"),
        (lambda: HelicalBody(math.nan, 1.0, 1.0), "mass of nan kg"),
        (lambda: HelicalBody(1.0, 1.0, 0.0), "diametral inertia of 0.0"),
        (lambda: HelicalBody("1 kg", 1.0, 1.0), "mass of '1 kg'"),
        (lambda: HelicalBody(1.0, 1.0, 1.0, HelicalSupport(np.ones(3))), "3 values"),
        (lambda: kahraman_set(contact_points="pitch"), "contact points of 'pitch'"),
        (lambda: kahraman_set(base_helix_angle=20.0), "base helix angle of 20.0 rad"),
    ],
)
def test_bodies_and_supports_that_cannot_be_are_refused(make, text):
    with pytest.raises(CaseError, match="E-RANGE") as caught:
        make()
    assert text in caught.value.message


def test_closure_tells_by_how_much_radii_and_distance_miss_each_other():
    data = kahraman_set()
    assert data.closure == pytest.approx((0.0, 0.0), abs=1e-12)
    wide = kahraman_set(centre_distance=1.01 * data.centre_distance)
    assert wide.closure == pytest.approx((1 / 1.01 - 1,) * 2, rel=1e-9)


def test_a_set_that_is_held_in_every_motion_is_refused():
    data, rigid = kahraman_set(), HelicalSupport(*[math.inf] * 4)
    held = {name: replace(getattr(data, name), support=rigid) for name in CENTRAL}
    with pytest.raises(CaseError, match="E-MECHANISM"):
        gear_set_system(kahraman_set(planet_bearing=rigid, **held))


@pytest.mark.parametrize(("points", "left"), [("pitch_point", 0.0), ("base_circles", 0.3)])
def test_tilting_moments_of_one_planet_are_in_equilibrium_at_the_pitch_point_alone(points, left):
    """All supports together take up the torque and nothing else; on base circles moments are left over."""
    data = kahraman_set(planet_angles=[0.0], contact_points=points)
    data = replace(data, sun=replace(data.sun, support=HelicalSupport(1e8, 1e8, 1e6)))
    data = replace(data, carrier=replace(data.carrier, support=HelicalSupport(1e8, 1e8, 1e6, 1e6)))
    system = gear_set_system(data, torque=PlanarTorque(100.0, "sun", None))
    stiffness = system.K + (system.W * data.column_stiffness) @ system.W.T
    q = np.linalg.solve(stiffness, system.load)[:18].reshape(3, 6)
    springs = np.array([getattr(data, name).support.stiffness for name in CENTRAL])
    radii = np.array([data.centre_distance, data.ring_radius, data.sun_radius])
    assert np.abs((springs * q)[:, :3].sum(axis=0)).max() < 1e-6 * np.abs(springs * q)[:, :3].max()
    moments = (springs * q)[:, 3:5] / radii[:, None]
    remainder = np.linalg.norm(moments.sum(axis=0)) / np.linalg.norm(moments, axis=1).max()
    assert remainder < 1e-9 if left == 0.0 else remainder > left


# Angles of planets that no set can have.


@pytest.mark.parametrize(
    "angles", [[0.0, 2.0, 2.0], [0.0, 3.0, 1.0], [0.0, 2.0, 2 * np.pi], [1.0, 2.0, 1.0 + 2 * np.pi]]
)
def test_planets_in_the_same_place_or_out_of_order_are_refused(angles):
    with pytest.raises(CaseError, match="within one turn"):
        replace(lin_parker_set(3), planet_angles=np.array(angles))


def test_planets_over_almost_a_turn_are_taken():
    angles = np.array([-3.0, 0.0, 3.2])
    assert np.array_equal(replace(lin_parker_set(3), planet_angles=angles).planet_angles, angles)
