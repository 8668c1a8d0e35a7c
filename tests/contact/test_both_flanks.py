"""Back flanks: their clearance and teeth from geometry, reversal, wedging."""

from dataclasses import replace

import numpy as np
import pytest

from femgear.contact.assembly import contact_candidates
from femgear.contact.bodies import make_bodies, make_sectors
from femgear.contact.cycle import CycleOptions, walk_mesh_cycle
from femgear.contact.flank_pairs import BACK_SIDE, DRIVE_SIDE, flank_side, mesh_pairs, side_teeth
from femgear.contact.supports import Supports
from femgear.contact.windows import mesh_windows
from femgear.fe.elasticity import Material
from femgear.gears.deviations import no_deviations
from femgear.gears.gear import half_thickness_angle
from femgear.gears.kinematics import orientations
from validation.planetary import reference_set

pytestmark = pytest.mark.decisive

STEEL = Material(206e9, 0.3, 7850.0)
TORQUE = 100.0
BOTH = CycleOptions(both_flanks=True)


@pytest.fixture(scope="module")
def gears():
    """The reference set with all teeth 40 um thinner."""
    exact = reference_set()
    return replace(
        exact,
        **{n: replace(getattr(exact, n), thickness_allowance=40e-6) for n in ("sun", "planet", "ring")},
    )


@pytest.fixture(scope="module")
def bodies(gears):
    return make_bodies(make_sectors(gears, STEEL, flank_elements=12), STEEL)


def test_clearance_of_the_back_flanks_is_the_backlash(gears, bodies):
    """80 um less thickness on two gears' reference circles is 80 cos(20 deg) um along the normal."""
    setup = mesh_windows(
        gears,
        bodies,
        share=2000.0,
        positions=16,
        cells=36,
        nearest=20e-6,
        contact="profile",
        both_flanks=True,
    )
    nearest = setup.listed.gap.min(axis=2)
    assert nearest[:6] == pytest.approx(0.0, abs=1e-7)
    assert nearest[6:] == pytest.approx(80e-6 * np.cos(np.deg2rad(20)), abs=2e-7)


@pytest.mark.parametrize("direction", [DRIVE_SIDE, BACK_SIDE])
@pytest.mark.parametrize("angles", [None, (0.0, 34, 67, 101)])
def test_teeth_stand_where_their_flanks_touch(gears, direction, angles):
    """Number, zero angle and rotation give the tooth's centre; its flank must pass the point of contact."""
    if angles is not None:
        gears = replace(gears, planet_angles=tuple(np.array(angles) * 2 * np.pi / 135))
    N = gears.n_planets
    phase, _ = flank_side(gears, direction)
    index = np.floor(-phase).astype(int)[:, None] + np.arange(-1, 3)
    teeth = side_teeth(gears, index, direction)
    tau = 0.3
    zeta = gears.base_pitch * (direction * tau + phase[:, None] + index)
    zero = orientations(gears, tau)
    for j in range(2 * N):
        kind, n = divmod(j, N)
        pair = mesh_pairs(gears)[kind]
        alpha, psi = pair.pressure_angle, gears.planet_angles[n]
        roll_1 = pair.pitch_roll_1 + zeta[j]
        roll_2 = pair.pitch_roll_2 - pair.sign * zeta[j]
        # polar angle of the contact from the line of centres, counted with the rotation of gear 1
        place_1 = np.arctan2(roll_1, pair.base_radius_1) - alpha
        place_2 = np.arctan2(roll_2, pair.base_radius_2) - alpha
        first, second = (gears.sun, gears.planet) if kind == 0 else (gears.planet, gears.ring)
        turn = direction if kind == 0 else -direction
        towards_1 = psi
        towards_2 = psi + np.pi if kind == 0 else psi
        centre_1 = towards_1 + turn * (place_1 - half_thickness_angle(first, np.hypot(pair.base_radius_1, roll_1)))
        flank_2 = half_thickness_angle(second, np.hypot(pair.base_radius_2, roll_2))
        # external gear 2 carries on the flank of the same hand; a ring's flank faces the planet
        centre_2 = towards_2 + turn * (place_2 - flank_2 if kind == 0 else place_2 + flank_2)
        zero_1 = zero.sun if kind == 0 else zero.planets[n]
        zero_2 = zero.planets[n] if kind == 0 else zero.ring
        slack = 40e-6 * 2 / first.reference_radius
        for zero_of, teeth_of, centre, gear in (
            (zero_1, teeth[0][j], centre_1, first),
            (zero_2, teeth[1][j], centre_2, second),
        ):
            off = np.mod(zero_of + teeth_of * gear.pitch_angle - centre + np.pi, 2 * np.pi) - np.pi
            assert np.abs(off).max() < (1e-9 if direction > 0 else slack)


def test_every_mesh_carries_on_its_own_flank_of_each_gear(gears, bodies):
    """Bodies whose compliance tells nothing but the flanks: 1 left-left, 2 left-right, 4 right-right.

    Driving, sun and ring carry on their left flanks, a planet on the left one in the sun and the right one in
    the ring; on the back side everything is the other way round.
    """

    def flanks_only(body, unit):
        n = len(body.roll)
        return replace(body, regular=unit * np.kron([[1.0, 2.0], [2.0, 4.0]], np.ones((len(body.regular), n, n))))

    names = ("sun", "planet", "ring")
    told = replace(bodies, gears=tuple(flanks_only(body, 10.0**k) for k, body in enumerate(bodies.gears)))
    options = dict(share=2000.0, cells=6, nearest=20e-6, both_flanks=True)
    found = contact_candidates(mesh_windows(gears, bodies, positions=2, **options), told, [0, 1])
    right = {
        "sun": np.repeat([0, -1, 1, -1], 3),
        "planet": np.repeat([0, 1, 1, 0], 3),
        "ring": np.repeat([-1, 0, -1, 1], 3),
    }
    expected = np.zeros((12, 12))
    for unit, name in zip((1.0, 10.0, 100.0), names):
        flank = right[name]
        same = (flank[:, None] >= 0) & (flank >= 0)
        if name == "planet":
            same &= np.arange(12)[:, None] % 3 == np.arange(12) % 3
        expected += np.where(same, unit * 2.0 ** (flank[:, None] + flank), 0.0)
    between = found.smooth.transpose(0, 1, 3, 2, 4)
    wanted = np.broadcast_to(expected[found.mesh[:, None], found.mesh][..., None, None], between.shape)
    np.testing.assert_allclose(between, wanted, rtol=1e-12)


def test_backlash_keeps_the_back_flanks_out(gears, bodies):
    one = walk_mesh_cycle(gears, bodies, sun_torque=TORQUE, positions=8)
    two = walk_mesh_cycle(gears, bodies, sun_torque=TORQUE, positions=8, options=BOTH)
    assert not two.back_force.any() and not two.wedged.any()
    assert one.message == two.message == "all positions by the active set"
    assert two.deflection == pytest.approx(one.deflection, rel=1e-9)
    assert two.stiffness == pytest.approx(one.stiffness, rel=1e-9)


def test_a_floating_sun_pushed_into_the_teeth_is_wedged(gears, bodies):
    """A light torque, planets moved towards the sun by more than the backlash: both flanks carry."""
    pushed = no_deviations(gears)
    pushed = replace(pushed, pin_errors=np.array([[-105e-6, 0.0], [-105e-6, 0.0], [-105e-6, 0.0]]))
    cycle = walk_mesh_cycle(gears, bodies, sun_torque=5.0, positions=4, options=BOTH, deviations=pushed)
    assert cycle.wedged[:3].all()
    assert "wedged" in cycle.message
    net = cycle.force - cycle.back_force
    assert net[:3].sum(axis=0) == pytest.approx(5.0 / gears.sun.base_radius, rel=1e-9)
    assert net[:3] == pytest.approx(net[3:], rel=1e-6)
    assert cycle.residual.max() < 1e-9


def test_a_planet_further_ahead_than_the_backlash_works_against_the_others(gears, bodies):
    pins = replace(no_deviations(gears), pin_errors=np.array([[0.0, -100e-6], [0.0, 0.0], [0.0, 0.0]]))
    cycle = walk_mesh_cycle(gears, bodies, sun_torque=TORQUE, positions=2, options=BOTH, deviations=pins)
    assert (cycle.force[0] > 0).all() and not cycle.force[1:3].any() and not cycle.wedged.any()
    assert not cycle.back_force[0].any() and (cycle.back_force[1:3] > 0).all()
    assert cycle.message.endswith("; some meshes carry on their back flanks alone")


def test_floating_sun_rests_on_both_flanks_where_it_must(gears, bodies):
    cycle = walk_mesh_cycle(gears, bodies, sun_torque=TORQUE, positions=4, options=BOTH, supports=Supports(sun=0.0))
    assert cycle.load_share == pytest.approx(1 / 3, abs=1e-9)
    assert not cycle.wedged.any()
