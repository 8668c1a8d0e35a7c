"""Planet bearings with clearance: the law of one bearing, limits, sharing, reversal, open planets."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from femgear.contact.bodies import make_bodies, make_sectors
from femgear.contact.cycle import CycleOptions, walk_mesh_cycle
from femgear.contact.supports import SPRINGS, Supports
from femgear.fe.elasticity import Material
from femgear.gears.deviations import no_deviations
from femgear.gears.kinematics import mesh_normals
from validation.planetary import reference_set

STEEL = Material(206e9, 0.3, 7850.0)
TORQUE = 100.0
K = 3e8


@pytest.fixture(scope="module")
def gears():
    return reference_set()


@pytest.fixture(scope="module")
def bodies(gears):
    return make_bodies(make_sectors(gears, STEEL, flank_elements=12), STEEL)


def walk(gears, bodies, clearance, *, torque=TORQUE, positions=4, **options):
    held = Supports(planet=K, planet_clearance=clearance, **options.pop("held", {}))
    deviations = options.pop("deviations", None)
    return walk_mesh_cycle(
        gears,
        bodies,
        sun_torque=torque,
        positions=positions,
        supports=held,
        deviations=deviations,
        options=CycleOptions(**options),
    )


@pytest.fixture(scope="module")
def linear(gears, bodies):
    return walk(gears, bodies, 0.0)


def bearing_law(displacement, stiffness: float, clearance: float):
    """Force of a bearing that is elastic all round, ``(2 k/pi) [r (p + sin p cos p) - 2 g sin p]``.

    Parameters
    ----------
    displacement : array
        Of the planet against its pin, r [m].
    stiffness : float
        Without clearance, k [N/m].
    clearance : float
        Radial, g [m].

    Returns
    -------
    array
        [N]; zero within the clearance. The bearing carries over the arc from -p to p, ``cos p = g/r``; its
        foundation of stiffness ``2 k/pi`` per angle is pressed by ``r cos t - g`` (Winkler; Johnson,
        "Contact Mechanics", 1985, section 4.3), and ``F = (2 k/pi) integral (r cos t - g) cos t dt``.
    """
    r = np.maximum(np.asarray(displacement, float), clearance)
    half_arc = np.arccos(np.divide(clearance, r, out=np.zeros_like(r), where=r > 0))
    carried = r * (half_arc + np.sin(half_arc) * np.cos(half_arc)) - 2 * clearance * np.sin(half_arc)
    return 2 * stiffness / np.pi * carried


def planet_motion(cycle):
    """Displacement of every planet against its pin, (N, 2, P)."""
    rows = [i for i, name in enumerate(cycle.member_names) if name.startswith("planet")]
    return cycle.member_motion[rows].reshape(-1, 2, cycle.member_motion.shape[1])


def test_law_is_the_integral_of_its_foundation():
    """2 k/pi per angle, pressed by r cos t - g where that is positive, by quadrature."""
    for ratio in (0.2, 1.05, 2.0, 50.0):
        pressed = quad(
            lambda t, r=ratio: max(r * np.cos(t) - 1.0, 0.0) * np.cos(t),
            -np.pi,
            np.pi,
            limit=400,
            epsabs=1e-12,
        )[0]
        law = bearing_law(ratio * 20e-6, K, 20e-6)
        assert law == pytest.approx(2 * K / np.pi * pressed * 20e-6, rel=1e-8, abs=1e-9)
    assert bearing_law(30e-6, K, 0.0) == pytest.approx(K * 30e-6, rel=1e-12)
    assert bearing_law(0.0, K, 0.0) == 0.0


@pytest.mark.parametrize("clearance", [1e-6, 10e-6, 40e-6, 150e-6])
def test_every_bearing_follows_the_continuous_law(gears, bodies, clearance):
    """Force from the equilibrium of the meshes, displacement from the ring of springs."""
    cycle = walk(gears, bodies, clearance, planet_gaps=[3e-6, 0.0, 1e-6])
    moved, force = planet_motion(cycle), cycle.bearing_force
    distance, size = np.hypot(moved[:, 0], moved[:, 1]), np.hypot(force[:, 0], force[:, 1])
    assert (distance > 1.1 * clearance).all()
    assert bearing_law(distance, K, clearance) == pytest.approx(size, rel=1e-3)
    # the pin pushes the planet back along its displacement
    assert (moved * force).sum(axis=1) == pytest.approx(-distance * size, rel=1e-5)
    assert cycle.residual.max() < 1e-9


def test_ripple_is_below_its_stated_limit():
    """Springs alone against the law, the displacement in any direction."""
    n = SPRINGS
    angle = 2 * np.pi * np.arange(n) / n
    for ratio, limit in ((1.05, 4e-3), (1.1, 1e-3), (1.2, 1e-3), (1.5, 1e-3), (3.0, 1e-3), (100.0, 1e-3)):
        directions = np.cos(angle - np.linspace(0.0, 2 * np.pi / n, 41)[:, None])
        forces = 4 * K / n * (np.maximum(ratio * directions - 1.0, 0.0) * directions).sum(axis=1)
        ripple = np.abs(forces / bearing_law(ratio, K, 1.0) - 1).max()
        assert ripple < 1.01 * limit
        # where the limit is the ripple itself, not above it
        assert ripple > 0.99 * limit or ratio > 1.05


@pytest.mark.parametrize("torque", [1e-3, 1.0])
def test_light_loads_find_the_place_of_the_planet(gears, bodies, torque):
    """Few springs carry; the planet is where the law says, to the height of the polygon's corners."""
    clearance = 40e-6
    cycle = walk(gears, bodies, clearance, torque=torque)
    moved, force = planet_motion(cycle), cycle.bearing_force
    size = np.hypot(force[:, 0], force[:, 1])
    places = clearance * (1 + np.geomspace(1e-9, 1.0, 4000))
    expected = np.interp(size, bearing_law(places, K, clearance), places)
    distance = np.hypot(moved[:, 0], moved[:, 1])
    assert np.abs(distance - expected).max() < 0.5 * (np.pi / 120) ** 2 * clearance
    # the planet lies along the force, to half the angle between two springs
    along = -(moved * force).sum(axis=1) / (distance * size)
    assert np.arccos(np.minimum(along, 1.0)).max() < 1.01 * np.pi / 120


def test_no_clearance_is_the_limit_of_little(gears, bodies, linear):
    """The rest is of the size of the clearance itself: the planet takes it up first."""
    for clearance in (1e-8, 1e-10):
        cycle = walk(gears, bodies, clearance, planet_gaps=None)
        assert np.abs(cycle.member_motion - linear.member_motion).max() < 1.5 * clearance
        assert np.abs(cycle.sun_arc - linear.sun_arc).max() < 3.0 * clearance
        assert cycle.force == pytest.approx(linear.force, rel=1e-9)
        assert cycle.stiffness == pytest.approx(linear.stiffness, rel=1e-9)
        assert cycle.tooth_load == pytest.approx(linear.tooth_load, rel=1e-6, abs=1e-6)


def test_equal_clearances_only_turn_the_sun_further(gears, bodies, linear):
    """The sun follows the planets' displacement along the lines of action; flanks approach as before."""
    cycle = walk(gears, bodies, 40e-6)
    on_planet, on_ring = np.split(mesh_normals(gears), 2)
    further = (planet_motion(cycle) - planet_motion(linear))[0]
    assert cycle.sun_arc - linear.sun_arc == pytest.approx((on_planet[0] - on_ring[0]) @ further, rel=1e-6)
    assert cycle.deflection == pytest.approx(linear.deflection, abs=1e-10)
    assert cycle.force == pytest.approx(linear.force, rel=1e-8)
    assert cycle.stiffness == pytest.approx(linear.stiffness, rel=1e-6)


def test_pin_forces_balance_the_planets(gears, bodies, linear):
    """Also without clearance, and with rigid bearings: force of every pin from the spring or from statics."""
    spring = -K * planet_motion(linear)
    assert linear.bearing_force == pytest.approx(spring, rel=1e-9, abs=1e-6)
    rigid = walk_mesh_cycle(gears, bodies, sun_torque=TORQUE, positions=4)
    on_planet, on_ring = np.split(mesh_normals(gears), 2)
    expected = on_ring[:, :, None] * rigid.force[3:, None] - on_planet[:, :, None] * rigid.force[:3, None]
    assert rigid.bearing_force == pytest.approx(expected, rel=1e-12)
    # the carrier's torque is that of sun and ring together
    arm = gears.centre_distance * np.array([[-np.sin(a), np.cos(a)] for a in gears.planet_angles])
    torque = -(arm[:, :, None] * rigid.bearing_force).sum(axis=(0, 1))
    assert torque == pytest.approx(TORQUE * (1 + 108 / 27), rel=1e-9)


def test_clearance_evens_out_what_stiff_bearings_do_not(gears, bodies, linear):
    """With a gap at one planet a bearing that is softer at first lets the others give way further."""
    gaps = [3e-6, 0.0, 0.0]
    stiff = walk(gears, bodies, 0.0, planet_gaps=gaps).load_share[0]
    loose = walk(gears, bodies, 40e-6, planet_gaps=gaps).load_share[0]
    # the stiffness of the bearing at its load, by differences of the law, is below that without clearance
    r = 1e-6 * np.linspace(41, 90, 500)
    force = 2 * TORQUE / gears.sun.base_radius / 3
    tangent = np.interp(force, bearing_law(r, K, 40e-6), np.gradient(bearing_law(r, K, 40e-6), r))
    assert tangent < 0.9 * K
    assert np.all(np.abs(loose - 1 / 3) < np.abs(stiff - 1 / 3))


def test_a_planet_without_load_stays_within_its_clearance(gears, bodies):
    cycle = walk(gears, bodies, 40e-6, planet_gaps=[120e-6, 0.0, 0.0])
    assert cycle.open_planets[0].all() and not cycle.open_planets[1:].any()
    assert "clearance" in cycle.message and "not determined" in cycle.message
    assert not cycle.bearing_force[0].any()
    moved = planet_motion(cycle)
    assert np.hypot(*moved[0]).max() <= 40e-6 * (1 + 1e-9)
    assert (np.hypot(moved[1:, 0], moved[1:, 1]) > 40e-6).all()


def test_reverse_torque_is_the_mirror_image(gears, bodies):
    pins = np.array([[2e-6, 5e-6], [-1e-6, 0.0], [3e-6, -2e-6]])
    errors = replace(no_deviations(gears), pin_errors=pins)
    mirrored = replace(no_deviations(gears), pin_errors=pins[[0, 2, 1]] * np.array([1.0, -1.0]))
    held = {"sun": 5e7, "carrier": 2e8}
    one = walk(gears, bodies, 25e-6, deviations=errors, held=held)
    two = walk(gears, bodies, 25e-6, torque=-TORQUE, deviations=mirrored, held=held)
    order, back = [0, 2, 1], -np.arange(4) % 4
    flip = np.array([1.0, -1.0])[:, None]
    assert two.member_names == one.member_names
    assert two.force[[*order, 3, 5, 4]][:, back] == pytest.approx(one.force, rel=1e-9)
    mirrored_force = two.bearing_force[order][:, :, back] * flip
    assert mirrored_force == pytest.approx(one.bearing_force, rel=1e-8, abs=1e-6)
    assert planet_motion(two)[order][:, :, back] * flip == pytest.approx(planet_motion(one), abs=1e-13)


def test_back_flanks_that_do_not_touch_change_nothing(gears, bodies):
    with_play = replace(
        gears,
        **{n: replace(getattr(gears, n), thickness_allowance=40e-6) for n in ("sun", "planet", "ring")},
    )
    one, two = (walk(with_play, bodies, 20e-6, both_flanks=both) for both in (False, True))
    assert not two.back_force.any()
    assert two.bearing_force == pytest.approx(one.bearing_force, rel=1e-9)
    assert two.member_motion == pytest.approx(one.member_motion, rel=1e-9)
    assert two.stiffness == pytest.approx(one.stiffness, rel=1e-9)
