"""Misalignment in slices: tilts, axes askew, torsion of the sun, wind-up, twist, and points of contact."""

from dataclasses import replace

import numpy as np
import pytest
from contact.test_cycle import STEEL, TORQUE, reference_set
from contact.test_slices import spring_newton, spring_slices
from scipy.optimize import minimize_scalar

from femgear.contact.bodies import make_bodies, make_sectors
from femgear.contact.cycle import CycleOptions, walk_mesh_cycle
from femgear.contact.supports import UPRIGHT, TiltingMembers, WidthSupports, tilting_members
from femgear.contact.width_waves import width_waves
from femgear.errors import ContactError
from femgear.fe.elasticity import Material
from femgear.gears.deviations import lead_separation, least_play, misaligned_approach, no_deviations
from femgear.gears.kinematics import member_approach
from femgear.gears.modifications import FlankForm, FlankTwist, LeadCrowning, LeadSlope, MeasuredLead

SLICES, WIDTH = 9, 25e-3
PLACE = WIDTH * ((np.arange(SLICES) + 0.5) / SLICES - 0.5)
ASKEW = np.array([2e-4, -3e-4])


def set_of(material):
    gears = reference_set()
    bodies = make_bodies(make_sectors(gears, material, flank_elements=12), material)
    waves = width_waves(make_sectors(gears, material, flank_elements=6, refine=0.5), material, SLICES)
    return gears, bodies, waves


@pytest.fixture(scope="module")
def steel():
    return set_of(STEEL)


@pytest.fixture(scope="module")
def rigid():
    return set_of(Material(1e9 * STEEL.youngs_modulus, STEEL.poisson_ratio, STEEL.density))


def walk(parts, supports=UPRIGHT, *, torque=TORQUE, positions=2, **deviations):
    gears, bodies, waves = parts
    options = CycleOptions(waves=waves, slices=SLICES, width_supports=supports)
    errors = {"deviations": replace(no_deviations(gears), **deviations), "options": options}
    return walk_mesh_cycle(gears, bodies, sun_torque=torque, positions=positions, **errors)


def moments(cycle, mesh):
    """First moment of the load over the width of a mesh (P,) [N m]."""
    return PLACE @ cycle.slice_load[mesh].sum(axis=0) / SLICES


# --- closed forms ----------------------------------------------------------------------------------


def one_tilt(stiffness):
    return TiltingMembers(
        ("gear: x",),
        (2 * PLACE / WIDTH)[None, :, None],
        np.array([stiffness / (WIDTH / 2) ** 2]),
        np.array([2 / WIDTH]),
        np.zeros((1, SLICES, 1, SLICES)),
    )


def test_tilts_follow_in_the_tangent():
    """``k/N (S_0 - k S_1^2/(k S_2 + N k_t))`` with the sums ``S_i`` of ``z^i`` of slices that carry."""
    mesh, k = 3e8, 1e4
    options = dict(stiffness=mesh, load=2e3, slices=SLICES, tilting=one_tilt(k))
    newton = spring_newton(3e-3 * PLACE, **options)
    force = newton.solve()[0][0, :, 0]
    bodies = newton.smooth[None], newton.across[None] * newton.unit
    together, alone, _ = newton.tangents([bodies, bodies])
    S = [(PLACE[force > 0] ** i).sum() for i in range(3)]
    expected = mesh / SLICES * (S[0] - mesh * S[1] ** 2 / (mesh * S[2] + SLICES * k))
    assert 0 < S[0] < SLICES
    assert [together.item(), alone.item()] == pytest.approx([expected, expected], rel=1e-9)


def test_wind_up_is_in_series_with_the_teeth_in_the_tangent(steel):
    """A mesh with the compliance 1/k and a wall that turns by 1/k_w under the force: k k_w/(k + k_w).

    Planets that tilt freely hold the loads even, so that half of a force winds the carrier up; the pin of the
    planet passes on the projections of both of its meshes.
    """
    radius = steel[0].centre_distance
    stiff, soft = (walk(steel, WidthSupports(planet=0.0, wind_up=k, wind_up_end=1)) for k in (1e12, 2e5))
    along = np.array([member_approach(steel[0])["carrier"][mesh] for mesh in (0, 3)])
    # the tangential part of the approach by half of what the wall moves
    angle = steel[0].planet_angles[0]
    moved = 0.5 * along @ [-np.sin(angle), np.cos(angle)]
    added = moved**2 * radius**2 / 2e5
    expected = 1.0 / (1.0 / stiff.stiffness[[0, 3]] + added[:, None])
    assert soft.stiffness[[0, 3]] == pytest.approx(expected, rel=0.02)
    plane = walk(steel)
    assert stiff.stiffness == pytest.approx(plane.stiffness, rel=1e-4)


@pytest.mark.parametrize("stiffness", [0.0, 3e3, 1e6])
def test_a_sprung_tilt_under_the_moment_of_a_misalignment(stiffness):
    """Slope ``M/(k_t + k_mesh b^2/12 (1 - 1/N^2))`` of one mesh of linear slices of their own."""
    mesh, slope = 3e8, 2e-4
    load = 2e4
    options = dict(stiffness=mesh, load=load, slices=SLICES, tilting=one_tilt(stiffness))
    found = spring_slices(slope * PLACE, **options)
    turning = mesh * WIDTH**2 / 12 * (1 - 1 / SLICES**2)
    left = slope - slope * turning / (stiffness + turning)
    assert found == pytest.approx(1 - left * PLACE * mesh / load, rel=1e-9)


@pytest.mark.parametrize("end", [-1, 1])
def test_the_sun_twists_under_a_uniform_load(end):
    """theta = T b/(G J) (zeta - zeta^2/2), zeta from the end of the torque; means over slices."""
    gears, rigidity = reference_set(), 4e3
    found = tilting_members(gears, WidthSupports(sun_rigidity=rigidity, sun_end=end), SLICES)
    force, rb = 500.0, gears.sun.base_radius
    moved = found.coupling.sum(axis=3)[:, :, 0] * force
    zeta = np.arange(SLICES + 1) / SLICES
    theta = force * rb * WIDTH / rigidity * np.diff(zeta**2 / 2 - zeta**3 / 6) * SLICES
    assert moved[1][::-end] == pytest.approx(rb * theta, rel=1e-12) and not moved[3:].any()


def test_rigid_sets_touch_where_leads_and_axes_let_them(rigid):
    """The planet whose flanks come nearest carries: the sun turns until its two smallest gaps are closed."""
    gears = rigid[0]
    errors = dict(
        sun=FlankForm((LeadSlope(8e-6),)),
        ring=FlankForm((LeadSlope(-3e-6),)),
        sun_misalignment=ASKEW,
        planet_misalignment=[[1e-4, 0], [0, -2e-4], [0, 0]],
    )
    found = walk(rigid, **errors)
    apart = lead_separation(replace(no_deviations(gears), **errors), gears, SLICES).min(axis=1)
    assert found.sun_arc == pytest.approx((apart[:3] + apart[3:]).min(), rel=1e-6)


def test_free_planets_straighten_what_is_askew(steel):
    """Slopes alone leave no moment: planets turn until both meshes are parallel, and the load is uniform."""
    gears = steel[0]
    errors = dict(sun_misalignment=ASKEW, carrier_misalignment=(-1e-4, 2e-4))
    found = walk(steel, WidthSupports(planet=0.0), **errors)
    assert np.abs(found.face_load_factor - 1).max() < 1e-8
    approach = misaligned_approach(replace(no_deviations(gears), **errors), gears)
    for n, tilt in enumerate(found.member_tilt.reshape(3, 2, -1)):
        rows = member_approach(gears)["carrier"][[n, n + 3]]
        expected = -np.linalg.solve(rows, approach[[n, n + 3]])
        assert tilt == pytest.approx(np.tile(expected[:, None], 2), rel=1e-7, abs=1e-12)
    assert np.abs(found.mesh_misalignment).max() < 1e-12


def test_wind_up_under_half_of_every_pin_force(steel):
    """psi = T_c/(2 k) between the walls; free planets straighten the slopes r_c psi / b of their pins."""
    gears, k = steel[0], 3e5
    found = walk(steel, WidthSupports(planet=0.0, wind_up=k, wind_up_end=-1))
    carrier = TORQUE * (1 + gears.ring.teeth / gears.sun.teeth)
    assert found.tilt_names[-1] == "carrier: wind-up"
    assert found.member_tilt[-1] == pytest.approx(carrier / (2 * k), rel=1e-8)
    slope = gears.centre_distance * carrier / (2 * k) / WIDTH
    tilts = found.member_tilt[:-1].reshape(3, 2, -1)[..., 0]
    tangent = np.stack([-np.sin(gears.planet_angles), np.cos(gears.planet_angles)], axis=1)
    assert tilts == pytest.approx(-slope * tangent, rel=1e-7, abs=1e-10)


def test_the_best_crowning_of_slices_of_their_own():
    """C = sqrt(3)/4 F and K = 1 + (c/w) F/(2 sqrt 3) while the whole width carries; means over slices."""
    slices, misaligned, mesh, load = 400, 6e-6, 2.5e8, 2.5e3
    along = (np.arange(slices) + 0.5) / slices - 0.5

    def factor(crowning):
        apart = crowning * 4 * along**2 - misaligned * along
        return spring_slices(apart, stiffness=mesh, load=load, slices=slices).max()

    best = minimize_scalar(factor, bounds=(0.0, misaligned), method="bounded", options={"xatol": 1e-12})
    assert best.x == pytest.approx(np.sqrt(3) / 4 * misaligned, rel=0.01)
    assert best.fun - 1 == pytest.approx(mesh * misaligned / load / (2 * np.sqrt(3)), rel=1e-3)


# --- equilibrium -----------------------------------------------------------------------------------


def test_moments_balance(steel):
    """Of free planets in either mesh, whatever the leads; of a sprung sun with its support."""
    k = 2e4
    lead = FlankForm((LeadSlope(9e-6), MeasuredLead((0.0, 5e-3, 12e-3), (0.0, -2e-6, 6e-6))))
    found = walk(steel, WidthSupports(planet=0.0, sun=k), sun=lead, sun_misalignment=ASKEW)
    whole = TORQUE / steel[0].sun.base_radius * WIDTH
    assert max(np.abs(moments(found, mesh)).max() for mesh in range(6)) < 1e-9 * whole
    found = walk(steel, WidthSupports(sun=k), sun=lead, sun_misalignment=ASKEW)
    pulled = member_approach(steel[0])["sun"].T @ [moments(found, mesh) for mesh in range(6)]
    assert np.abs(pulled + k * found.member_tilt).max() < 1e-9 * whole
    assert found.tilt_names == ("sun: x", "sun: y") and np.abs(pulled).max() > 1e-4 * whole


def test_torsion_loads_the_end_of_the_torque(steel):
    """A sun that hardly twists turns by ``T b/(3 G J)`` on the mean over a uniform load."""
    rb, plain = steel[0].sun.base_radius, walk(steel)
    soft, stiff = (walk(steel, WidthSupports(sun_rigidity=rigidity)) for rigidity in (2e3, 2e6))
    assert (np.diff(soft.slice_load[:3].sum(axis=(0, 1, 3))) < 0).all()
    assert stiff.sun_arc - plain.sun_arc == pytest.approx(rb * TORQUE * WIDTH / 2e6 / 3, rel=1e-2)
    softer = 1 / stiff.stiffness[:3] - 1 / plain.stiffness[:3]
    assert softer == pytest.approx(rb**2 * WIDTH / 2e6 / 3, rel=1e-2)


# --- invariances -----------------------------------------------------------------------------------

FULL = WidthSupports(sun=1e4, carrier=5e4, planet=1e4, wind_up=2e5, sun_rigidity=2e3)


def errors_of(sun=ASKEW, carrier=(1e-4, 0.0), planets=((1e-4, 5e-5), (0, 0), (0, -1e-4)), slope=5e-6):
    return dict(
        sun_misalignment=sun,
        carrier_misalignment=carrier,
        planet_misalignment=planets,
        sun=FlankForm((LeadSlope(slope), LeadCrowning(2e-6))),
    )


def test_the_mirrored_width(steel):
    flipped = errors_of(*(-np.array(one) for one in list(errors_of().values())[:3]), slope=-5e-6)
    ends = replace(FULL, wind_up_end=-FULL.wind_up_end, sun_end=-FULL.sun_end)
    one, two = walk(steel, FULL, **errors_of()), walk(steel, ends, **flipped)
    assert np.abs(one.slice_load - two.slice_load[:, :, ::-1]).max() < 1e-8 * one.slice_load.max()
    assert one.mesh_misalignment == pytest.approx(-two.mesh_misalignment, rel=1e-7, abs=1e-13)
    assert np.abs(one.stiffness - two.stiffness).max() < 1e-7 * one.stiffness.max()


def test_turned_planets(steel):
    """By a third of a turn everything moves on by a planet."""
    turn = np.exp(2j * np.pi / 3)
    sun, carrier = (turn * complex(*one) for one in (ASKEW, (1e-4, 0.0)))
    planets = np.roll(errors_of()["planet_misalignment"], 1, axis=0)
    two = walk(steel, FULL, **errors_of((sun.real, sun.imag), (carrier.real, carrier.imag), planets))
    one, order = walk(steel, FULL, **errors_of()), [2, 0, 1, 5, 3, 4]
    assert np.abs(one.slice_load[order] - two.slice_load).max() < 1e-8 * one.slice_load.max()


def test_a_reversed_torque_is_the_mirror_image(steel):
    """At the line through planet 1, the x axis: slopes across it change sign."""
    sun, carrier = (np.array(one) * [1, -1] for one in (ASKEW, (1e-4, 0.0)))
    planets = (np.array(errors_of()["planet_misalignment"]) * [1, -1])[[0, 2, 1]]
    one = walk(steel, FULL, positions=np.zeros(1), **errors_of())
    two = walk(steel, FULL, positions=np.zeros(1), torque=-TORQUE, **errors_of(sun, carrier, planets))
    order = [0, 2, 1, 3, 5, 4]
    assert two.face_load_factor[order] == pytest.approx(one.face_load_factor, rel=1e-7)
    assert two.mesh_misalignment[order] == pytest.approx(one.mesh_misalignment, rel=1e-6)
    mirrored = one.member_tilt[:-1].reshape(5, 2, -1)[[0, 1, 2, 4, 3]] * np.array([1, -1])[:, None]
    assert two.member_tilt[:-1] == pytest.approx(mirrored.reshape(10, -1), rel=1e-6, abs=1e-12)
    assert two.member_tilt[-1] == pytest.approx(-one.member_tilt[-1], rel=1e-7)


# --- leads -----------------------------------------------------------------------------------------


def test_twist_and_measured_leads():
    """A twist is a lead slope of its share at either end of the profile, a line of points one of its rise."""
    gears = reference_set()
    rolls = np.array([[[g.form_roll, g.tip_roll]] * 6 for g in (gears.sun, gears.planet)])
    for form, shares in (
        (FlankForm((FlankTwist(8e-6),)), (-0.5, 0.5)),
        (FlankForm((MeasuredLead((-WIDTH / 2, WIDTH / 2), (4e-6, -4e-6)),)), (1, 1)),
    ):
        found = lead_separation(replace(no_deviations(gears), sun=form), gears, SLICES, rolls)
        expected = -8e-6 * np.outer(shares, PLACE / WIDTH)
        assert found[0] == pytest.approx(expected, abs=1e-18) and not found[3:].any()


def test_a_twist_turns_the_load_from_end_to_end(steel):
    """Where the tip of the sun touches, pairs lean to z > 0, where its root touches to z < 0."""
    found = walk(steel, sun=FlankForm((FlankTwist(20e-6),)), positions=8)
    lean = np.einsum("s,psq->pq", PLACE, found.slice_load[0]) / found.slice_load[0].sum(axis=1).clip(1e-9)
    carries = found.tooth_load[0] > 0.05 * found.force[0].max()
    far = np.abs(found.path[0]) > 1.5e-3
    some = carries & far
    assert (np.sign(lean[some]) == np.sign(found.path[0][some])).all() and some.sum() > 4


def test_leads_and_tilts_take_play(steel):
    """Both flanks of the sun stand out at one end: a slope of 10 um takes 10 um."""
    gears = steel[0]
    plain, leaning = (
        least_play(replace(no_deviations(gears), sun=FlankForm(lead)), gears)[0] for lead in ((), (LeadSlope(10e-6),))
    )
    assert plain - leaning == pytest.approx(10e-6, rel=0.02)


# --- refusals --------------------------------------------------------------------------------------


def test_tilts_that_nothing_holds_are_refused():
    with pytest.raises(ContactError) as caught:
        tilting_members(reference_set(), WidthSupports(carrier=0.0, planet=0.0), SLICES)
    assert caught.value.code == "E-MECHANISM" and caught.value.key == "carrier.tilt_stiffness"


def test_points_of_contact_are_refused(steel):
    with pytest.raises(ContactError, match="not for points") as caught:
        walk(steel, sun=FlankForm((LeadCrowning(3e-3),)), torque=2 * TORQUE)
    assert caught.value.code == "E-SLICES"
