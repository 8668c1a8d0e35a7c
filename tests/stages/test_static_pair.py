"""A pair against a planetary set, its symmetries, errors of its gears."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from trains.pair.test_case_file import INTERNAL, pair_case

from femgear.contact.bodies import Bodies, make_bodies, make_sectors
from femgear.contact.cycle import walk_mesh_cycle
from femgear.fe.elasticity import Material
from femgear.gears.pair import GearPair
from femgear.stages.static import solve_static, solve_stress
from validation.planetary import reference_set

STEEL, TAU = Material(206e9, 0.3, 7850.0), np.arange(8) / 8


LARGE_TIPS = {"gear_1.tip_diameter": 159.6, "gear_2.tip_diameter": 230.7572}


@cache
def solved(gear_1, gear_2, distance, torque):
    pair = GearPair(gear_1, gear_2, distance)
    bodies = make_bodies(make_sectors(pair, STEEL, flank_elements=12), STEEL)
    return walk_mesh_cycle(pair, bodies, sun_torque=torque, positions=TAU)


def test_a_set_whose_planet_does_not_couple_its_flanks_is_two_pairs():
    """The meshes of a planet see one another only by what one flank yields under load on the other."""
    s = replace(reference_set(), planet_angles=(0.0,))
    bodies = make_bodies(make_sectors(s, STEEL, flank_elements=12), STEEL)
    apart, n = bodies.planet.regular.copy(), len(bodies.planet.roll)
    apart[:, :n, n:] = apart[:, n:, :n] = 0.0
    bodies = bodies.with_gear(1, replace(bodies.planet, regular=apart))
    whole, force = walk_mesh_cycle(s, bodies, sun_torque=30.0, positions=TAU), 30.0 / s.sun.base_radius
    sets = (
        ((s.sun, bodies.sun), (s.planet, bodies.planet)),
        ((s.planet, bodies.planet), (s.ring, bodies.ring)),
    )
    for mesh, ((one, body_1), (two, body_2)) in enumerate(sets):
        cycle = walk_mesh_cycle(
            GearPair(one, two, s.centre_distance),
            Bodies((body_1, body_2), (one.face_width,)),
            sun_torque=force * one.base_radius,
            positions=TAU + s.mesh_phases[mesh],
        )
        for name in ("deflection", "stiffness", "force"):
            expected = getattr(whole, name)[mesh]
            np.testing.assert_allclose(getattr(cycle, name)[0], expected, rtol=1e-9, err_msg=name)


def test_driver_and_driven_gear_exchange_their_places():
    one, two = solve_static(pair_case()).planetary_set.gears
    there = solved(one, two, 91.5e-3, 200.0)
    back = solved(two, one, 91.5e-3, 300.0)
    reversed_path = -np.arange(8) % 8
    # pressure cells are those of gear 1
    np.testing.assert_allclose(back.deflection[0, reversed_path], there.deflection[0], rtol=1e-3)
    np.testing.assert_allclose(back.stiffness[0, reversed_path], there.stiffness[0], rtol=1e-2)


@pytest.mark.parametrize("changes", [{}, INTERNAL], ids=["external", "internal"])
def test_a_negative_torque_is_the_mirror_image(changes):
    there = solve_static(pair_case(changes)).dataset()
    back = solve_static(pair_case({**changes, "operation.torque": "-200 N m"})).dataset()
    for name in ("ste", "mesh_stiffness", "mesh_force"):
        np.testing.assert_allclose(back[name][:, -np.arange(8) % 8], there[name], rtol=1e-10)


@pytest.mark.slow
def test_twice_the_size_under_eight_times_the_torque():
    case = {"set.module": 6, "set.face_width": 40, "set.centre_distance": 183, "gear_1.bore_radius": 30}
    large = {key: f"{value} mm" for key, value in {**case, "gear_2.bore_radius": 50, **LARGE_TIPS}.items()}
    one, two = solve_static(pair_case()), solve_static(pair_case({**large, "operation.torque": "1600 N m"}))
    np.testing.assert_allclose(two.cycle.deflection, 2.0 * one.cycle.deflection, rtol=1e-6)
    np.testing.assert_allclose(two.cycle.stiffness, 2.0 * one.cycle.stiffness, rtol=1e-6)
    changes = {}, {**large, "operation.torque": "1600 N m"}
    first, second = (solve_stress(pair_case(c), s).dataset() for c, s in zip(changes, (one, two), strict=True))
    for name in ("root_worst", "contact_pressure", "iso_root_stress", "iso_contact_stress"):
        np.testing.assert_allclose(second[name], first[name], rtol=1e-6)
    nominal = first.iso_root_stress.values
    assert (0.7 < first.root_worst / nominal).all() and (first.root_worst / nominal < 1.1).all()


@pytest.mark.parametrize("changes", [{}, pytest.param(INTERNAL, marks=pytest.mark.slow)], ids=["external", "internal"])
@pytest.mark.parametrize("torque", ["200 N m", "-200 N m"])
@pytest.mark.parametrize("gear", ["gear_1", "gear_2"])
def test_runout_turns_with_its_gear(gear, torque, changes):
    """The component of a turning vector along a line: a cosine of its length over the teeth of the gear."""
    error = {f"{gear}.errors": {"runout_amplitude": "10 um"}, "operation.torque": torque}
    cycle = solve_static(pair_case({**changes, **error, "static.longest_record": 60})).cycle
    wave = np.fft.rfft(cycle.sun_arc) * 2.0 / len(cycle.sun_arc)
    assert abs(wave[1]) == pytest.approx(10e-6, rel=0.02)
    assert cycle.periods == getattr(pair_case(changes), gear).teeth


@pytest.mark.parametrize(("changes", "sign"), [({}, -1.0), (INTERNAL, 1.0)], ids=["external", "internal"])
def test_a_displaced_tooth_of_gear_2(changes, sign):
    """Counter-clockwise it meets an external pinion earlier, and goes ahead of one inside it."""
    teeth = pair_case(changes).gear_2.teeth
    pitch = ["4 um"] + ["0 um"] * (teeth - 1)
    error = {"gear_2.errors": {"cumulative_pitch": pitch}, "static.longest_record": 60}
    arc, plain = (solve_static(pair_case({**changes, **e})).cycle.sun_arc for e in (error, {}))
    away = arc.reshape(-1, 8) - plain
    assert sign * away[np.abs(away).argmax() // 8].sum() > 0.0
    assert (np.abs(away).max(axis=1) > 1e-8).sum() in (2, 3)
