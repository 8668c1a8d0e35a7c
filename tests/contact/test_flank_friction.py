"""Friction in the equilibrium of the contact: closed forms, balances of every body, power, other solvers."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from femgear.contact import batch
from femgear.contact.bodies import make_bodies, make_sectors
from femgear.contact.cycle import CycleOptions, walk_mesh_cycle
from femgear.contact.flank_friction import friction_of_record, path_sense, rolls_over_radii
from femgear.contact.loaded_period import loaded_period
from femgear.contact.supports import RIGID, Supports
from femgear.contact.width_waves import width_waves
from femgear.fe.elasticity import Material
from femgear.gears.friction import path_speeds
from femgear.gears.gear import Gear
from femgear.gears.kinematics import across, mesh_normals, speeds, unit_vectors
from femgear.gears.pair import GearPair
from validation.planetary import reference_set

STEEL = Material(206e9, 0.3, 7850.0)
TORQUE, MU = 100.0, (0.05, 0.07)
PLACES = np.linspace(0.0, 1.0, 13)[:-1] + 0.0013


def made(gears):
    return gears, make_bodies(make_sectors(gears, STEEL, flank_elements=8), STEEL)


def waves_of(gears, slices):
    return width_waves(make_sectors(gears, STEEL, flank_elements=6), STEEL, slices)


@pytest.fixture(scope="module")
def pair():
    common = {"module": 3e-3, "pressure_angle": np.deg2rad(20.0), "face_width": 0.02}
    gears = (
        Gear(teeth=24, profile_shift=0.3, rim_radius=0.015, **common),
        Gear(teeth=36, profile_shift=0.25, rim_radius=0.025, **common),
    )
    return made(GearPair(*gears, centre_distance=0.0915))


@pytest.fixture(scope="module")
def planets():
    return made(reference_set())


@pytest.fixture(scope="module")
def uneven():
    """Planets at places where the sun meets them out of phase, and not equally spaced."""
    step = 2.0 * np.pi / 135
    return made(reference_set().with_planet_angles((0.0, 44 * step, 91 * step)))


def rubbed(gears, bodies, torque=TORQUE, mu=MU, *, supports=RIGID, places=PLACES, **options):
    friction = tuple(np.sign(torque) * value for value in mu) if mu else None
    given = CycleOptions(friction=friction, **options)
    return walk_mesh_cycle(gears, bodies, sun_torque=torque, positions=places, supports=supports, options=given)


def moments(gears, cycle, torque=TORQUE, mu=MU):
    """Moments of all meshes on gear 1 and gear 2 (M, P) by their loads, levers and signs, as the flanks drive."""
    path = np.sign(torque) * cycle.path
    mesh = np.broadcast_to(np.arange(len(path))[:, None, None], path.shape)
    levers = rolls_over_radii(gears, path, mesh)
    slip = np.sign(torque) * gears.of_kinds(mu)[:, None, None] * path_sense(path, gears.base_pitch)
    radii = gears.of_kinds([[gear.base_radius for gear in kind.gears] for kind in gears.kinds])
    return [radii[:, place, None] * (cycle.tooth_load * (1.0 + slip * levers[place])).sum(axis=1) for place in (0, 1)]


def test_one_pair_in_contact_has_the_closed_form(pair):
    gears, bodies = pair
    cycle = rubbed(gears, bodies, mu=(0.06,))
    (kind,), gear = gears.kinds, gears.gears[0]
    load, path = cycle.tooth_load[0], cycle.path[0]
    alone = (load > 0).sum(axis=0) == 1
    zeta = np.where(load > 0, path, 0.0).sum(axis=0)[alone]
    roll = gear.base_radius * np.tan(kind.working_pressure_angle) + zeta
    assert cycle.force[0, alone] == pytest.approx(TORQUE / (gear.base_radius + 0.06 * np.sign(zeta) * roll), rel=1e-12)
    assert alone.sum() > 2


@pytest.mark.parametrize("torque", [TORQUE, -TORQUE])
def test_pairs_together_share_as_without_friction_under_the_torque_that_is_left(pair, torque):
    gears, bodies = pair
    cycle = rubbed(gears, bodies, torque, mu=(0.06,))
    for place in (0, 3, 7):
        left = np.sign(torque) * cycle.force[0, place] * gears.gears[0].base_radius
        plain = rubbed(gears, bodies, left, mu=(), places=PLACES[place : place + 1])
        shared, alone = (loads[loads > 0.0] for loads in (cycle.tooth_load[0, :, place], plain.tooth_load[0, :, 0]))
        assert shared == pytest.approx(alone, rel=1e-4)  # windows of another size have other cells
        assert cycle.deflection[0, place] == pytest.approx(plain.deflection[0, 0], rel=1e-4)
    assert ((cycle.tooth_load[0, :, [0, 3, 7]] > 0).sum(axis=1) == 2).any()


SUPPORTS = (
    RIGID,
    Supports(sun=0.0),
    Supports(sun=5e7, carrier=2e8, planet=3e8),
    Supports(sun=5e7, planet=3e8, planet_clearance=15e-6),
)


@pytest.mark.parametrize("supports", SUPPORTS)
@pytest.mark.parametrize("torque", [TORQUE, -TORQUE])
def test_every_body_of_a_set_is_in_balance_and_no_power_is_lost_but_by_friction(planets, uneven, supports, torque):
    for gears, bodies in (planets, uneven):
        cycle, N = rubbed(gears, bodies, torque, supports=supports), gears.n_planets
        first, second = moments(gears, cycle, torque)
        assert first[:N].sum(axis=0) == pytest.approx(np.full(len(PLACES), abs(torque)), rel=1e-11)
        assert np.abs(second[:N] - first[N:]).max() < 1e-11 * abs(torque)
        out = second[N:].sum(axis=0) + abs(torque)
        radial = unit_vectors(np.asarray(gears.planet_angles))
        of_pins = gears.centre_distance * np.einsum("ni,nip->p", across(radial), cycle.bearing_force)
        assert np.abs(of_pins) == pytest.approx(out, rel=1e-11)
        turning = speeds(gears, input="sun", fixed="ring", speed=1.0)
        sliding = [
            np.abs(path_speeds(gears.kinds[kind], path, turning.mesh_frequency).sliding)
            for kind, path in zip(gears.mesh_kind, cycle.path)
        ]
        lost = (gears.of_kinds(MU)[:, None, None] * cycle.tooth_load * sliding).sum(axis=(0, 1))
        power = np.sign(torque) * (abs(torque) * turning.sun - out * turning.carrier)
        assert power == pytest.approx(lost, rel=1e-9)
        assert cycle.residual.max() < 1e-12


@pytest.mark.parametrize("torque", [TORQUE, -TORQUE])
def test_a_sun_that_floats_is_in_balance_across_the_lines_of_action_too(uneven, torque):
    gears, bodies = uneven
    cycle, N = rubbed(gears, bodies, torque, supports=Supports(sun=0.0)), gears.n_planets
    normal = mesh_normals(gears, back=torque < 0)[:N]
    # the sun drives along the force where its torque turns it, and its flank moves over the tangent as it turns
    tangent = np.sign(torque) * across(normal)
    along, plain = np.einsum("mi,mp->ip", normal, cycle.force[:N]), cycle.force[:N].max()
    rest = along + np.einsum("mi,mp->ip", tangent, cycle.friction_force[:N])
    assert np.abs(rest).max() < 1e-11 * plain
    assert np.abs(along).max() > 1e-4 * plain


def test_positions_by_themselves_agree(uneven, monkeypatch):
    gears, bodies = uneven
    for supports in SUPPORTS[2:]:
        together = rubbed(gears, bodies, supports=supports, places=PLACES[::4])
        with monkeypatch.context() as patch:
            patch.setattr(batch, "MOST_STEPS", 1)
            alone = rubbed(gears, bodies, supports=supports, places=PLACES[::4])
        assert alone.force == pytest.approx(together.force, rel=1e-9)
        assert alone.iterations.sum() != together.iterations.sum()


def test_friction_of_slices_has_the_arms_of_their_own_paths():
    """Two slices of a helical tooth, the second one 0.3 base pitches ahead: before the pitch point, and beyond it."""
    gears: Any = SimpleNamespace(base_pitch=0.01, of_kinds=np.array)
    load = np.array([5.0, 8.0]).reshape(1, 1, 2, 1)
    record = SimpleNamespace(path=np.full((1, 1, 1), -0.001), tooth_load=load.sum(axis=2) / 2, slice_load=load)
    found = friction_of_record(gears, (0.1,), record, np.array([0.0, 0.3]))
    assert found["friction_force"] == pytest.approx(np.array([[0.1 * (8.0 - 5.0) / 2]]))
    assert found["friction_moment"] == pytest.approx(np.array([[0.1 * (8.0 * 0.002 + 5.0 * 0.001) / 2]]))


def test_no_friction_is_none(planets):
    gears, bodies = planets
    without, zero = rubbed(gears, bodies, mu=()), rubbed(gears, bodies, mu=(0.0, 0.0))
    assert zero.force == pytest.approx(without.force, rel=1e-13)
    assert without.friction_force is None
    assert not zero.friction_force.any()


def test_the_mirror_image_driven_backwards_is_the_same(planets):
    gears, bodies = planets
    there, back = (
        rubbed(gears, bodies),
        rubbed(gears, bodies, -TORQUE, mu=tuple(-mu for mu in MU), places=-PLACES[::-1]),
    )
    assert back.force[:, ::-1] == pytest.approx(there.force, rel=1e-10)
    for name in ("friction_force", "friction_moment"):
        assert getattr(back, name)[:, ::-1] == pytest.approx(getattr(there, name), rel=1e-9)


def test_slices_that_are_alike_have_the_friction_of_the_plane(planets):
    gears, bodies = planets
    places = PLACES[::3]
    plane = rubbed(gears, bodies, supports=SUPPORTS[2], places=places)
    sliced = rubbed(gears, bodies, supports=SUPPORTS[2], places=places, waves=waves_of(gears, 5), slices=5)
    for name in ("force", "friction_force", "friction_moment", "deflection", "member_motion"):
        values = getattr(plane, name)
        assert getattr(sliced, name) == pytest.approx(values, rel=1e-9, abs=1e-9 * np.abs(values).max()), name


def test_slices_of_helical_teeth_are_in_balance(planets):
    gears, bodies = planets
    slices = 5
    ahead, waves = 0.8 * ((np.arange(slices) + 0.5) / slices - 0.5), waves_of(gears, slices)
    for supports in (RIGID, SUPPORTS[2]):
        cycle = rubbed(gears, bodies, supports=supports, places=PLACES[::3], waves=waves, slices=slices, ahead=ahead)
        N, path = gears.n_planets, cycle.path[:, :, None] + gears.base_pitch * ahead[:, None]
        mesh = np.broadcast_to(np.arange(len(path))[:, None, None, None], path.shape)
        levers = rolls_over_radii(gears, path, mesh)
        slip = gears.of_kinds(MU)[:, None, None, None] * path_sense(path, gears.base_pitch)
        arcs = [(cycle.slice_load * (1.0 + slip * lever)).mean(axis=2).sum(axis=1) for lever in levers]
        assert arcs[0][:N].sum(axis=0) * gears.sun.base_radius == pytest.approx(np.full(4, TORQUE), rel=1e-9)
        assert arcs[1][:N] == pytest.approx(arcs[0][N:], rel=1e-9)


def test_the_loaded_state_has_jumps_at_the_pitch_point_enclosed(planets):
    gears, bodies = planets
    state = loaded_period(gears, bodies, bodies, sun_torque=TORQUE, options=CycleOptions(friction=MU))
    force, apart = state.friction_force[0], np.diff(state.position, append=1.0)
    turned = np.flatnonzero(np.abs(np.roll(force, -1) - force) > 0.5 * np.abs(force).max())
    assert len(turned)
    assert apart[turned].max() < 1.01 * 2.0**-13
    walked = rubbed(gears, bodies, places=state.position[::20])
    assert state.friction_moment[:, ::20] == pytest.approx(walked.friction_moment, rel=1e-9)


def test_peaks_beside_jumps_are_found(planets):
    gears, bodies = planets
    coarse, fine = (rubbed(gears, bodies, places=count, peaks=True) for count in (16, 64))
    assert coarse.between.doubt < 0.011
    assert coarse.peak_to_peak() == pytest.approx(fine.peak_to_peak(), rel=0.02)
    assert replace(coarse, between=None).peak_to_peak().max() <= coarse.peak_to_peak().max()
