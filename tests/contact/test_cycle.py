"""The mesh cycle of whole sets: equilibrium, symmetry, sharing, limits."""

from dataclasses import fields, replace

import numpy as np
import pytest

from femgear.contact import batch as batch_module
from femgear.contact.assembly import assemble_contact
from femgear.contact.bodies import make_bodies, make_sectors
from femgear.contact.cycle import CycleOptions, shorter_steps, walk_mesh_cycle
from femgear.contact.solve import solve_contact
from femgear.contact.supports import Supports
from femgear.contact.windows import mesh_windows
from femgear.fe.elasticity import Material
from femgear.gears.deviations import no_deviations
from femgear.gears.gear import Gear
from femgear.gears.iso6336_stiffness import mesh_stiffness_method_b
from femgear.gears.planetary import PlanetarySet, close_set, equal_planet_angles
from validation.reference.tangent import mesh_tangent_matrix, tangent_stiffness

STEEL = Material(206e9, 0.3, 7850.0)
ALPHA = np.deg2rad(20)
TORQUE = 100.0


def reference_set():
    common = dict(module=1.5e-3, pressure_angle=ALPHA, face_width=0.025)
    return PlanetarySet(
        Gear(teeth=27, profile_shift=0.52681, rim_radius=0.009, **common),
        Gear(teeth=40, profile_shift=0.0, rim_radius=0.018, **common),
        Gear(teeth=108, profile_shift=0.0, rim_radius=0.1, internal=True, **common),
        centre_distance=0.051,
        planet_angles=equal_planet_angles(3),
    )


@pytest.fixture(scope="module")
def gears():
    return reference_set()


@pytest.fixture(scope="module")
def bodies(gears):
    return make_bodies(make_sectors(gears, STEEL), STEEL)


@pytest.fixture(scope="module")
def cycle(gears, bodies):
    return walk_mesh_cycle(gears, bodies, sun_torque=TORQUE, positions=32)


def test_equilibrium(gears, cycle):
    total = TORQUE / gears.sun.base_radius
    assert np.abs(cycle.force[:3].sum(axis=0) / total - 1).max() < 1e-12
    assert np.abs(cycle.force[:3] - cycle.force[3:]).max() < 1e-12 * total
    assert np.abs(cycle.tooth_load.sum(axis=1) - cycle.force).max() < 1e-12 * total
    assert np.abs(cycle.load_share.sum(axis=0) - 1).max() < 1e-12
    assert cycle.residual.max() < 1e-9


def test_identical_planets_share_equally(cycle):
    assert np.abs(cycle.load_share - 1 / 3).max() < 1e-9
    assert np.abs(cycle.deflection[0] - cycle.deflection[1]).max() < 1e-9 * cycle.deflection.max()


def test_stiffness_against_iso_6336(gears, cycle):
    """c_gamma of method B: its polynomial is a fit to pairs of solid external gears.

    It knows no bore (1 % for sun and planet), and counts a ring on its rim as a rack (7 %).
    """
    meshes = ((gears.sun, gears.planet, 0.01), (gears.planet, gears.ring, 0.07))
    for first, (*pair, apart) in enumerate(meshes):
        ratio = (gears.contact_ratio_sun_planet, gears.contact_ratio_planet_ring)[first]
        standard = mesh_stiffness_method_b(
            pair[0].teeth,
            np.inf if pair[1].internal else pair[1].teeth,
            pair[0].profile_shift,
            pair[1].profile_shift,
            contact_ratio=ratio,
            dedendum=1.25,
        )[1]
        ours = cycle.stiffness[3 * first].mean() / gears.sun.face_width
        assert ours == pytest.approx(standard, rel=apart)


def solved(gears, bodies, position, *, torque=TORQUE, gaps=(0.0, 0.0, 0.0), coupled=True):
    """Contact problem and solution at one of eight positions; uncoupled meshes see only themselves."""
    share = TORQUE / gears.sun.base_radius / 3
    setup = mesh_windows(
        gears,
        bodies,
        share=2 * share,
        positions=8,
        cells=36,
        nearest=20e-6,
        contact="profile",
    ).with_planet_gaps(gaps)
    problem = assemble_contact(setup, bodies, position)
    if not coupled:
        problem = replace(problem, H=problem.H * (problem.mesh[:, None] == problem.mesh))
    load = np.array([0.0, 0.0, 0.0, torque / gears.sun.base_radius])
    return problem, solve_contact(problem.H, problem.gap, problem.G, load)


def test_stiffness_is_the_derivative_of_the_force(gears, bodies):
    """Central differences of the loads against the tangent matrix of the active set, all meshes coupled."""
    for position in (0, 2, 5):
        problem, state = solved(gears, bodies, position)
        K = mesh_tangent_matrix(problem.H, state.active, problem.mesh, 6)
        step = 1e-6
        change = []
        for sign in (1, -1):
            other = solved(gears, bodies, position, torque=TORQUE * (1 + sign * step))[1]
            assert np.array_equal(other.active, state.active)
            forces = np.bincount(problem.mesh, weights=other.loads, minlength=6)
            sun, planets = other.motions[-1], other.motions[:-1]
            change.append((forces, np.concatenate([sun - planets, planets])))
        d_force, d_deflection = (np.subtract(*parts) for parts in zip(*change))
        assert K @ d_deflection == pytest.approx(d_force, rel=1e-6)
        # alone, at constant loads of the others, each mesh is as stiff as the cycle says
        window = problem.mesh * 1000 + problem.pair
        own = tangent_stiffness(problem.H, state, problem.mesh, window, problem.cell, 6)
        alone = 1 / np.diag(np.linalg.inv(K))
        # a cell that joins the contact changes the slope of the load by a per cent
        assert own == pytest.approx(alone, rel=1e-2)


def test_no_torque_is_a_defined_empty_contact(gears, bodies):
    empty = walk_mesh_cycle(gears, bodies, sun_torque=0.0, positions=8)
    assert not empty.force.any() and not empty.stiffness.any() and not empty.load_share.any()
    assert not empty.secant_stiffness.any()
    assert "no torque" in empty.message


def test_other_flanks_are_the_mirror_image(gears, bodies, cycle):
    """With equal planets in phase the back flanks give the same cycle run backwards."""
    back = walk_mesh_cycle(gears, bodies, sun_torque=-TORQUE, positions=32)
    turned = -np.arange(32) % 32
    assert np.abs(back.deflection - cycle.deflection[:, turned]).max() < 1e-12
    assert np.abs(back.tooth_load.sum(axis=1) - back.force).max() < 1e-6


def test_gap_stays_with_its_planet_on_the_other_flanks(gears, bodies):
    gaps = [0.0, 3e-6, 0.0]
    back = walk_mesh_cycle(gears, bodies, sun_torque=-TORQUE, positions=8, options=CycleOptions(planet_gaps=gaps))
    assert (back.load_share[1] < 0.3).all() and (back.load_share[[0, 2]] > 0.35).all()


def test_line_of_action_differs_only_near_the_ends_of_the_path(gears, bodies, cycle):
    rigid = walk_mesh_cycle(gears, bodies, sun_torque=TORQUE, positions=32, contact="line_of_action")
    assert rigid.contact == "line_of_action" and cycle.contact == "profile"
    same = np.abs(rigid.deflection[0] - cycle.deflection[0]) < 1e-10
    assert 10 < same.sum() < 32
    assert np.ptp(rigid.deflection[0]) >= np.ptp(cycle.deflection[0]) - 1e-9


@pytest.mark.parametrize("gap", [1e-6, 3e-6])
@pytest.mark.parametrize("position", [0, 3, 6])
def test_gap_on_one_planet_shares_as_the_closed_form(gears, bodies, gap, position):
    """Delta = (F + sum c/s)/sum(1/s), F_n = (Delta - c_n)/s_n with s, c from the active sets alone.

    a_j = 1' H_jj^-1 1 and b_j = 1' H_jj^-1 e on the active cells of mesh j, body coupling between meshes left
    out (springs in series and parallel with gaps; elementary statics).
    """
    problem, state = solved(gears, bodies, position, gaps=(gap, 0.0, 0.0), coupled=False)
    a, b = np.zeros(6), np.zeros(6)
    for j in range(6):
        cells = state.active & (problem.mesh == j)
        inverse = np.linalg.inv(problem.H[np.ix_(cells, cells)])
        a[j], b[j] = inverse.sum(), (inverse @ problem.gap[cells]).sum()
    s = 1 / a[:3] + 1 / a[3:]
    c = b[:3] / a[:3] + b[3:] / a[3:]
    common = (TORQUE / gears.sun.base_radius + (c / s).sum()) / (1 / s).sum()
    expected = (common - c) / s
    ours = np.bincount(problem.mesh, weights=state.loads, minlength=6)
    assert ours[:3] == pytest.approx(expected, rel=1e-9)
    assert state.motions[-1] == pytest.approx(common, rel=1e-9)
    assert ours[0] < ours[1]


def test_body_coupling_moves_little_load(gears, bodies):
    """What the sun's torsion between its bore and its teeth does to the sharing under a 3 um gap."""
    gaps = (3e-6, 0.0, 0.0)
    shares = [
        np.bincount(problem.mesh, weights=state.loads)[:3] / state.loads[problem.mesh < 3].sum()
        for problem, state in (solved(gears, bodies, 0, gaps=gaps, coupled=c) for c in (True, False))
    ]
    assert 1e-4 < np.abs(shares[0] - shares[1]).max() < 0.02


def test_planet_far_away_carries_nothing(gears, bodies):
    cycle = walk_mesh_cycle(
        gears, bodies, sun_torque=TORQUE, positions=8, options=CycleOptions(planet_gaps=[100e-6, 0.0, 0.0])
    )
    assert cycle.open_planets[0].all() and not cycle.open_planets[1:].any()
    assert not cycle.force[[0, 3]].any() and not cycle.stiffness[[0, 3]].any()
    # through the sun's body a load acts on its neighbours, not alike in both directions of rotation
    assert cycle.load_share[1:] == pytest.approx(0.5, abs=1e-3)
    assert "lose all load" in cycle.message


@pytest.mark.slow
def test_unequally_spaced_sequentially_phased_planets():
    """z 30/21/72 with N = 3 at multiples of 360/102 deg: the phases differ and loads stay near one third."""
    common = dict(module=2e-3, pressure_angle=ALPHA, face_width=0.02)
    step = 2 * np.pi / 102
    gears = close_set(
        Gear(teeth=30, profile_shift=0.0, rim_radius=0.018, **common),
        Gear(teeth=21, profile_shift=0.0, rim_radius=0.012, **common),
        Gear(teeth=72, profile_shift=0.0, rim_radius=0.085, internal=True, **common),
        centre_distance=0.051,
        planet_angles=(0.0, 33 * step, 69 * step),
    )
    bodies = make_bodies(make_sectors(gears, STEEL, flank_elements=16), STEEL)
    cycle = walk_mesh_cycle(gears, bodies, sun_torque=60.0, positions=24)
    phases = np.asarray(gears.mesh_phases)
    assert np.ptp(phases[:3]) > 0.1
    assert np.abs(cycle.load_share.sum(axis=0) - 1).max() < 1e-12
    assert np.abs(cycle.load_share - 1 / 3).max() < 0.1
    assert cycle.residual.max() < 1e-9
    # a rigid sun on fixed centres: every planet's path deflects by the same amount
    assert np.abs(np.ptp(cycle.overall_deflection, axis=0)).max() < 1e-12


@pytest.mark.slow
def test_face_width_scales_out(gears, bodies):
    """Twice the width and torque give the same deflections."""
    wide_gears = replace(
        gears,
        **{n: replace(getattr(gears, n), face_width=0.05) for n in ("sun", "planet", "ring")},
    )
    wide = make_bodies(make_sectors(wide_gears, STEEL), STEEL)
    one = walk_mesh_cycle(gears, bodies, sun_torque=TORQUE, positions=8)
    two = walk_mesh_cycle(wide_gears, wide, sun_torque=2 * TORQUE, positions=8)
    assert two.deflection == pytest.approx(one.deflection, rel=1e-9)
    assert two.stiffness == pytest.approx(2 * one.stiffness, rel=1e-9)


@pytest.fixture(scope="module")
def five():
    """Five planets out of phase, and their bodies."""
    common = dict(module=2e-3, pressure_angle=ALPHA, face_width=0.024, profile_shift=0.0)
    gears = PlanetarySet(
        Gear(teeth=36, rim_radius=0.018, **common),
        Gear(teeth=24, rim_radius=0.012, **common),
        Gear(teeth=84, rim_radius=0.1, internal=True, **common),
        centre_distance=0.06,
        planet_angles=equal_planet_angles(5),
    )
    return gears, make_bodies(make_sectors(gears, STEEL, flank_elements=6), STEEL)


@pytest.mark.parametrize("torque", [TORQUE, -TORQUE])
def test_planets_that_come_to_the_same_states_are_solved_once(five, torque, monkeypatch):
    gears, bodies = five
    solved, options = [], CycleOptions(pressures=True, cells=20, held_bodies=bodies)
    given = {"sun_torque": torque, "supports": Supports(sun=0.0, planet=1e8), "options": options}
    every = walk_mesh_cycle(gears, bodies, positions=np.arange(20) / 20, **given)
    batch = batch_module.solve_batch
    monkeypatch.setattr(
        batch_module,
        "solve_batch",
        lambda found, *rest: solved.append(len(found.position)) or batch(found, *rest),
    )
    once = walk_mesh_cycle(gears, bodies, positions=20, **given)
    assert set(solved) == {4} and np.abs(once.member_motion).max() > 1e-8
    for field in fields(once):
        values, expected = getattr(once, field.name), getattr(every, field.name)
        if field.name not in ("residual", "iterations") and isinstance(values, np.ndarray):
            size = np.abs(np.asarray(expected, float)).max(initial=0.0)
            apart = np.asarray(values, float) - np.asarray(expected, float)
            assert np.abs(apart).max(initial=0.0) <= 1e-9 * size, field.name


@pytest.mark.slow
def test_peaks_between_positions_are_those_of_every_planet(five):
    gears, bodies = five
    peaks = walk_mesh_cycle(gears, bodies, sun_torque=TORQUE, positions=20, options=CycleOptions(peaks=True, cells=20))
    fine = walk_mesh_cycle(
        gears, bodies, sun_torque=TORQUE, positions=np.arange(400) / 400, options=CycleOptions(cells=20)
    )
    assert np.allclose(peaks.peak_to_peak(), np.ptp(fine.deflection, axis=1), rtol=3e-3)
    assert np.allclose(peaks.peak_to_peak("sun_arc"), np.ptp(fine.sun_arc), rtol=3e-3)


def test_progress_tells_the_positions_done(gears, bodies, monkeypatch):
    told = []
    monkeypatch.setattr("femgear.contact.cycle._TOGETHER", 3)
    options = CycleOptions(progress=lambda *done: told.append(done))
    walk_mesh_cycle(gears, bodies, sun_torque=TORQUE, positions=8, options=options)
    assert told[-3:] == [(3, 8), (6, 8), (8, 8)]


def test_unknowns_are_those_of_the_position_with_the_most(gears, bodies, monkeypatch):
    """However many positions are solved together."""
    found = []
    for together in (1, 3, 8):
        monkeypatch.setattr("femgear.contact.cycle._TOGETHER", together)
        cycle = walk_mesh_cycle(gears, bodies, sun_torque=TORQUE, positions=8)
        found.append(cycle.unknowns)
        # a window of 36 cells for each pair in contact
        assert cycle.unknowns >= (cycle.tooth_load > 0).sum(axis=(0, 1)).max()
    assert found[0] == found[1] == found[2]


def test_windows_too_small_at_one_position_are_enlarged_however_many_are_solved_together(gears, bodies, monkeypatch):
    """A tooth of the sun that stands out by 10 um carries nearly all at the second of two positions."""
    deviations = replace(no_deviations(gears), sun_pitch=-10e-6 * (np.arange(27) == 2))
    given = {"sun_torque": 0.5 * TORQUE, "positions": [0.3, 16.3], "periods": 27, "deviations": deviations}
    together = walk_mesh_cycle(gears, bodies, **given)
    assert together.force[:3, 1].max() > 2.0 * together.force[:3, 0].max()
    monkeypatch.setattr("femgear.contact.cycle._TOGETHER", 1)
    alone = walk_mesh_cycle(gears, bodies, **given)
    for name in ("force", "deflection", "max_pressure"):
        assert getattr(alone, name) == pytest.approx(getattr(together, name), rel=1e-9)


def test_meshes_are_coupled_under_the_lightest_load(gears, bodies):
    """A thousandth of a newton on every mesh: the torsion of the sun between them is the same."""
    light, usual = (
        walk_mesh_cycle(
            gears, bodies, sun_torque=torque, positions=[0.4], options=CycleOptions(held_bodies=bodies)
        ).held_compliance[..., 0]
        for torque in (1e-4, TORQUE)
    )
    own = np.diag(usual)
    apart = ~np.eye(6, dtype=bool)
    assert (np.diag(light) > own).all()
    assert np.abs(light - usual)[apart].max() < 0.1 * np.abs(usual[apart]).max() > 0.0


def test_steps_of_a_fixed_point_that_swings_shorten_until_it_rests():
    """F(x) = 3 - s x rests at 3/(1 + s): with s = 1 it would swing for ever, with s = 2 run away."""
    slope = np.array([0.4, 1.0, 2.0])
    turned, step, before = np.zeros((1, 3)), np.ones(3), np.zeros((1, 3))
    for _ in range(30):
        missed = 3.0 - slope * turned - turned
        step = shorter_steps(step, missed, before)
        turned, before = turned + step * missed, missed
    assert turned[0] == pytest.approx(3.0 / (1.0 + slope), rel=1e-5)
    # what shrinks by more than half of itself keeps whole steps
    assert step[0] == 1.0 and (step[1:] == 0.5).all()
