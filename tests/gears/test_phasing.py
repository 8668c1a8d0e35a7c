"""Mesh phases against tooth outlines and mirrored sets; phasing of harmonics against published rules."""

import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from phase_patterns import cyclic_shares

from femgear.contact.flank_pairs import flank_side
from femgear.errors import GeometryError
from femgear.gears.gear import Gear
from femgear.gears.kinematics import orientations
from femgear.gears.phasing import (
    ZERO,
    MeshPhasing,
    coaxial_teeth,
    cyclic_harmonic,
    mesh_phasing,
    phase_factors,
    phasing_of_set,
    phasing_table,
    planet_sums,
    standard_lag,
)
from femgear.gears.planetary import close_set, equal_planet_angles


def geared(sun, planet, ring, angles, /, **shifts):
    """Closed set of module 2 mm; what does not fit the teeth is left to the shift of the ring."""
    alpha, width = math.radians(20), 20e-3
    gears = [
        Gear(z, 2e-3, alpha, shifts.get(name, 0.0), width, rim, internal=name == "ring")
        for name, z, rim in (
            ("sun", sun, 5e-3),
            ("planet", planet, 5e-3),
            ("ring", ring, 2e-3 * (ring / 2 + 8)),
        )
    ]
    return close_set(*gears, planet_angles=angles, find=("ring",))


def unequal(total, *positions):
    return tuple(2 * math.pi * m / total for m in positions)


SETS = {
    "standard": lambda: geared(30, 20, 70, equal_planet_angles(4)),
    "odd planets": lambda: geared(29, 21, 71, equal_planet_angles(4)),
    "shifted": lambda: geared(24, 21, 67, unequal(91, 0, 20, 47, 66), sun=0.3, planet=0.2),
    "three": lambda: geared(27, 40, 108, equal_planet_angles(3), planet=0.1),
}


@pytest.fixture(params=SETS)
def any_set(request):
    return SETS[request.param]()


def apart(one, two):
    """Largest distance of phases on the circle."""
    difference = np.mod(np.asarray(one) - np.asarray(two) + 0.5, 1.0) - 0.5
    return np.abs(difference).max()


def test_phases_are_those_of_the_set(any_set):
    assert apart(phasing_of_set(any_set).phases, any_set.mesh_phases) < 1e-9


def test_turning_back_meets_the_same_contacts_in_opposite_order(any_set, arcs_to_tooth):
    """Sun clockwise: position -tau; a pair stands at its pitch point where tau + phase is whole."""
    s = any_set
    phases = replace(phasing_of_set(s), rotation=-1).phases
    for j, phase in enumerate(phases):
        state = orientations(s, phase)
        gear, turn = (s.sun, state.sun) if j < s.n_planets else (s.ring, state.ring)
        angle = (s.working_pressure_angle_sun_planet, s.working_pressure_angle_planet_ring)[j >= s.n_planets]
        pitch_point = gear.base_radius / math.cos(angle) * np.exp(1j * (s.planet_angles[j % s.n_planets] + 1e-12))
        assert abs(arcs_to_tooth(gear, turn, np.array([pitch_point]), 1.0)[0]) < 2e-9


def test_other_flanks_are_those_of_the_mirror_image(any_set):
    """Against the phases of the back flanks that the contact problem takes from the mirrored set."""
    back = flank_side(any_set, -1)[0]
    # there a pair touches where its path coordinate, which runs backwards, plus the phase is whole
    assert apart(replace(phasing_of_set(any_set), flank=-1).phases, back[0] - back) < 1e-9
    both = replace(phasing_of_set(any_set), rotation=-1, flank=-1).phases
    assert apart(both, back - back[0]) < 1e-9


def test_lag_of_standard_planets():
    for planet, name in ((20, "standard"), (21, "odd planets")):
        assert apart(phasing_of_set(SETS[name]()).lag, standard_lag(planet)) < 1e-9


def test_conventions_agree_on_the_ring_and_reverse_the_sun():
    options = dict(planet_angles=unequal(100, 0, 22, 50, 72), lag=0.5)
    turning, printed = (mesh_phasing(29, 71, convention=c, **options) for c in ("rotation", "printed"))
    psi = np.array(options["planet_angles"])
    assert apart(turning.phases, np.concatenate([-29 * psi, 71 * psi - np.pi]) / (2 * np.pi)) < 1e-12
    assert apart(printed.phases, np.concatenate([29 * psi, 71 * psi - np.pi]) / (2 * np.pi)) < 1e-12
    # at assembly positions the phases of turning teeth differ by the lag alone
    assert apart(turning.phases[:4] - 0.5, turning.phases[4:]) < 1e-12
    assert apart(printed.phases[:4] - 0.5, printed.phases[4:]) > 0.2


TYPES = {0: "in-phase", 1: "sequentially phased", 2: "counter-phased", 3: "sequentially phased"}


@pytest.mark.parametrize(("sun", "planet"), [*product(range(27, 35), (18, 19, 20, 21))])
def test_four_equal_planets(sun, planet):
    """Table 1 of Kahraman (1994): (a) z_s / 4 whole, (b) z_s / 2 odd, (c) z_s odd; harmonic h as h z_s."""
    ring = sun + 2 * planet
    if (sun + ring) % 4:
        with pytest.raises(GeometryError, match="E-ASSEMBLY"):
            mesh_phasing(sun, ring, equal_planet_angles(4))
        return
    for convention in ("rotation", "printed"):
        phasing = mesh_phasing(sun, ring, equal_planet_angles(4), convention=convention)
        table = phasing_table(phasing, range(1, 9))
        assert table.kind == tuple(TYPES[h * sun % 4] for h in range(1, 9))
        assert np.array_equal(table.cyclic, [h * sun % 4 for h in range(1, 9)])
        for kind, gone, modes in zip(table.kind, table.members < ZERO, table.excited):
            torque, lateral, thrust, tilt = gone.all(axis=0)
            assert np.all(gone == gone[0])
            assert (torque, thrust) == (kind != "in-phase",) * 2
            assert (lateral, tilt) == (kind != "sequentially phased",) * 2
            assert modes == ({"in-phase": "rotational", "counter-phased": "planet"}.get(kind, "translational"),)


@pytest.mark.parametrize("planets", [3, 4, 5, 6, 7, 8])
def test_equal_spacing_follows_the_published_rule(planets):
    """Parker (2000): k = mod(h z_s, N); torque for k = 0, lateral force for k = 1 and N - 1, else neither."""
    for sun in range(20, 20 + planets):
        ring = 4 * planets + (-sun) % planets + 20 // planets * planets + planets
        phasing = mesh_phasing(sun, ring, equal_planet_angles(planets))
        table = phasing_table(phasing, range(1, 2 * planets + 1))
        shares = cyclic_shares(phasing, range(1, 2 * planets + 1))
        for h, k, size, modes, share in zip(table.harmonics, table.cyclic, table.members, table.modes, shares):
            assert k == h * sun % planets
            torque, lateral = float(k == 0), float(k in (1, planets - 1))
            assert size == pytest.approx(np.tile([torque, lateral, torque, lateral], (3, 1)), abs=1e-12)
            assert modes == pytest.approx([torque, lateral, 1 - torque - lateral], abs=1e-9)
            assert share[min(k, planets - k)] == pytest.approx(1) and np.count_nonzero(share) == 1


def test_unequal_spacing_by_plain_sums():
    """Phases and angles as floats, planet by planet."""
    positions, sun, ring = (0, 17, 45, 60, 81), 31, 72
    phasing = MeshPhasing(sun, ring, positions)
    table = phasing_table(phasing, range(1, 12))
    assert not table.separate and set(table.cyclic) == {-1} and set(table.kind) == {"unequally phased"}
    for h, size in zip(table.harmonics, table.members[:, 0]):
        torque = lateral = 0
        for m in positions:
            psi = 2 * math.pi * m / (sun + ring)
            force = np.exp(-1j * h * sun * psi)
            torque, lateral = (
                torque + force,
                lateral + force * np.array([np.exp(1j * psi), np.exp(-1j * psi)]),
            )
        assert size[0] == pytest.approx(abs(torque) / 5, rel=1e-10)
        assert size[1] == pytest.approx(max(abs(lateral)) / 5, rel=1e-10)
    # after Z harmonics the phases are whole again
    assert phasing_table(phasing, [sun + ring]).kind == ("in-phase",)


def test_two_pairs_of_opposite_planets():
    """An even sun puts opposite planets in phase: no lateral force however the pairs stand."""
    table = phasing_table(MeshPhasing(30, 72, (0, 20, 51, 71)))
    assert table.separate and np.all(table.members[:, :, 1] < ZERO)
    assert all("translational" not in modes for modes in table.excited)
    odd = phasing_table(MeshPhasing(31, 71, (0, 20, 51, 71)))
    assert np.all(odd.members[::2, :, 0] < ZERO) and np.all(odd.members[1::2, :, 1] < ZERO)


def test_planet_between_its_two_meshes():
    """A lag of half a period swaps what adds up and what cancels at odd harmonics."""
    together = phasing_table(MeshPhasing(30, 70, (0, 25, 50, 75), lag=0.0), [1, 2]).planets
    assert np.array_equal(together, np.tile([0.0, 1, 0, 0, 1], (2, 4, 1)))
    apart_ = phasing_table(MeshPhasing(30, 70, (0, 25, 50, 75), lag=0.5), [1, 2]).planets
    assert apart_[0] == pytest.approx(np.tile([1.0, 0, 1, 1, 0], (4, 1)), abs=1e-12)
    assert apart_[1] == pytest.approx(together[1], abs=1e-12)


def test_far_harmonics_stay_exact():
    table = phasing_table(MeshPhasing(29, 71, (0, 25, 50, 75)), [4 * 10**6 + 1])
    assert table.members[0, :, 0] == pytest.approx(0, abs=1e-14)
    assert table.members[0, :, 1] == pytest.approx(1, abs=1e-14)


def test_whirl_goes_against_the_phase_that_the_planets_gain():
    """Four planets and z_s = 29, each a quarter period later: q = -1 (or 3) adds up, -2 in harmonic 2."""
    sums = planet_sums(29, np.array([0, 25, 50, 75]), 100, [1, 2, 3], [0, 1, -1, 2, 3])
    assert sums == pytest.approx(np.array([[0, 0, 1, 0, 1], [0, 0, 0, 1, 0], [0, 1, 0, 0, 0]], complex), abs=1e-12)
    # the other way round, and unequal spacing, planet by planet
    positions = np.array([0, 17, 45, 60, 81])
    psi = 2 * np.pi * positions / 103
    for turns in (31, -31):
        for h, q in ((1, 1), (1, -1), (2, 3)):
            exact = np.exp(1j * (h * turns + q) * psi).mean()
            assert planet_sums(turns, positions, 103, [h], [q])[0, 0] == pytest.approx(exact, abs=1e-12)


def test_factors_turn_with_the_phases():
    phasing = MeshPhasing(29, 71, (0, 25, 50, 75))
    assert phase_factors(phasing, [1])[0, :4] == pytest.approx([1, -1j, -1, 1j], abs=1e-12)
    assert np.array_equal(cyclic_harmonic(phasing, [1, 2, 3, 4]), [1, 2, 3, 0])


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (dict(sun_teeth=30.0), "E-RANGE"),
        (dict(sun_teeth=2), "E-RANGE"),
        (dict(ring_teeth=5001), "E-RANGE"),
        (dict(rotation=0), "E-RANGE"),
        (dict(flank=2), "E-RANGE"),
        (dict(convention="other"), "E-RANGE"),
        (dict(lag=math.nan), "E-RANGE"),
        (dict(sun_teeth=71, ring_teeth=29), "E-RANGE"),
        (dict(positions=(0, 25, 20)), "E-RANGE"),
        (dict(positions=(0, 100)), "E-RANGE"),
        (dict(positions=()), "E-RANGE"),
    ],
)
def test_what_describes_no_set_is_refused(arguments, code):
    with pytest.raises(GeometryError, match=code):
        MeshPhasing(**(dict(sun_teeth=30, ring_teeth=70, positions=(0, 25, 50, 75)) | arguments))


@pytest.mark.parametrize("harmonics", [[0, 1], [1.5], [], [[1]]])
def test_harmonics_are_whole_numbers(harmonics):
    with pytest.raises(GeometryError, match="E-HARMONICS"):
        phasing_table(MeshPhasing(30, 70, (0, 25, 50, 75)), harmonics)


def test_angles_that_do_not_assemble_name_those_that_do():
    with pytest.raises(GeometryError, match=r"E-ASSEMBLY(.|\n)*118.8") as refused:
        mesh_phasing(30, 70, equal_planet_angles(3))
    assert "241.2" in refused.value.remedy


@pytest.mark.parametrize("teeth", [-3, 0, 20.5, 4, True, "20"])
def test_the_lag_of_no_planet_is_refused(teeth):
    with pytest.raises(GeometryError, match="E-RANGE"):
        standard_lag(teeth)


def test_a_small_miss_is_told_with_its_digits():
    angles = np.add(equal_planet_angles(4), [0.0, 2e-6, 0.0, 0.0])
    with pytest.raises(GeometryError, match=r"by 3\.18e-05 teeth"):
        mesh_phasing(30, 70, angles)


@pytest.mark.parametrize(("teeth", "planets"), [((17, 30, 91), 3), ((20, 30, 60), 4), ((27, 45, 108), 2)])
def test_coaxial_teeth_make_sets_of_unshifted_gears(teeth, planets):
    """Gears made of them run without play at one distance, at equal angles, and their tips stay apart."""
    near = coaxial_teeth(*teeth, planets)
    assert len(near) >= 3 and len({*near}) == len(near)
    for sun, planet, ring in near[:4]:
        geared_set = geared(sun, planet, ring, equal_planet_angles(planets))
        assert geared_set.ring.profile_shift == pytest.approx(0.0, abs=1e-9)
        step = 2.0 * geared_set.centre_distance * math.sin(math.pi / planets)
        assert mesh_phasing(sun, ring, equal_planet_angles(planets)).equally_spaced
        assert step > geared_set.planet.module * (planet + 2)
    changed = [sum(new != old for new, old in zip(choice, teeth, strict=True)) for choice in near]
    assert changed == sorted(changed)


def test_planets_without_room_have_no_coaxial_teeth():
    assert coaxial_teeth(17, 37, 91, 5) == []
