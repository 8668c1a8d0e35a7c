"""The loaded state over one mesh period: jumps enclosed, equal planets equal, what couples the meshes."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from femgear.contact.bodies import make_bodies, make_sectors
from femgear.contact.cycle import CycleOptions, planet_symmetry, walk_mesh_cycle
from femgear.contact.loaded_period import SHORTEST, LoadedPeriod, _repetition, loaded_period
from femgear.contact.supports import Supports
from femgear.fe.elasticity import Material
from femgear.gears.deviations import Runout, no_deviations, planet_shift
from femgear.gears.gear import Gear
from femgear.gears.planetary import PlanetarySet, close_set, equal_planet_angles

STEEL = Material(206e9, 0.3, 7850.0)
TORQUE = 150.0
SUPPORTS = Supports(sun=5e7, carrier=2e8, planet=3e8)
# opposite pairs at assembly positions, multiples of 360/80 degrees
PAIRS = tuple(np.deg2rad([0.0, 81.0, 180.0, 261.0]))


def small_set(angles) -> PlanetarySet:
    """21 + 59 teeth: four equally spaced planets are a quarter of a period apart."""
    common = dict(profile_shift=0.0, module=2e-3, pressure_angle=np.deg2rad(20), face_width=0.02)
    return close_set(
        Gear(teeth=21, rim_radius=0.008, **common),
        Gear(teeth=19, rim_radius=0.009, **common),
        Gear(teeth=59, rim_radius=0.075, internal=True, **common),
        planet_angles=tuple(angles),
        centre_distance=0.0401,
        find=("sun", "ring"),
    )


@pytest.fixture(scope="module")
def bodies():
    sectors = make_sectors(small_set(equal_planet_angles(4)), STEEL, flank_elements=8)
    return make_bodies(sectors, STEEL)


@pytest.fixture(scope="module", params=[equal_planet_angles(4), PAIRS], ids=["four", "two pairs"])
def solved(request, bodies):
    gears = small_set(request.param)
    options = dict(sun_torque=TORQUE, positions=24, supports=SUPPORTS)
    return gears, loaded_period(gears, bodies, bodies, **options)


def test_planets_that_a_rotation_maps_onto_one_another_are_equal_to_rounding(solved):
    gears, found = solved
    N, symmetry = gears.n_planets, planet_symmetry(gears)
    assert symmetry == (4 if gears.planet_angles[1] > 1.5 else 2)
    count = 840
    phase = gears.mesh_phases
    for name in ("force", "deflection", "stiffness"):
        lines = np.fft.rfft(found.resampled(name, count), axis=1) / count
        own = lines * np.exp(-2j * np.pi * np.outer(phase, np.arange(lines.shape[1])))
        size = np.abs(lines).max()
        for n in range(N):
            other = (n + N // symmetry) % N
            for offset in (0, N):
                assert own[offset + n] == pytest.approx(own[offset + other], abs=1e-12 * size)


def test_record_is_the_walk_at_its_positions(solved, bodies):
    """Positions all over the period, of which only the first part was solved."""
    gears, found = solved
    some = np.arange(len(found.position))[3::17]
    walk = walk_mesh_cycle(gears, bodies, sun_torque=TORQUE, positions=found.position[some], supports=SUPPORTS)
    for name in ("force", "deflection", "stiffness"):
        assert np.array_equal(found.held_stiffness, found.stiffness)
        expected = getattr(walk, name)
        assert getattr(found, name)[:, some] == pytest.approx(expected, rel=2e-5)


def test_five_planets_that_come_after_the_next_but_one_have_the_states_of_a_walk(coarse):
    """Sun of 22 teeth, 4.4 a planet: planet 4 is where planet 1 was after a fifth of the period, not planet 2.

    The mean compliance is that of straight lines between the positions.
    """
    common = dict(profile_shift=0.0, module=2e-3, pressure_angle=np.deg2rad(20), face_width=0.02)
    gears = close_set(
        Gear(teeth=22, rim_radius=0.008, **common),
        Gear(teeth=18, rim_radius=0.009, **common),
        Gear(teeth=58, rim_radius=0.075, internal=True, **common),
        planet_angles=equal_planet_angles(5),
        centre_distance=0.0401,
        find=("sun", "ring"),
    )
    bodies = make_bodies(make_sectors(gears, STEEL, flank_elements=6), STEEL)
    found = loaded_period(gears, bodies, bodies, sun_torque=TORQUE, positions=5, supports=SUPPORTS)
    options = dict(supports=SUPPORTS, options=CycleOptions(held_bodies=bodies))
    walk = walk_mesh_cycle(gears, bodies, sun_torque=TORQUE, positions=found.position, **options)
    for name in ("force", "deflection", "stiffness"):
        expected = getattr(walk, name)
        assert np.abs(getattr(found, name) - expected).max() < 1e-9 * np.abs(expected).max()
    closed = np.concatenate([walk.held_compliance, walk.held_compliance[..., :1]], axis=-1)
    mean = np.trapezoid(closed, np.append(found.position, 1.0))
    assert found.held_compliance == pytest.approx(mean, abs=1e-9 * mean.max())


def test_every_jump_of_the_stiffness_is_enclosed(solved):
    """No interval wider than the shortest holds more than the change that is allowed between neighbours."""
    _, found = solved
    k = np.hstack([found.stiffness, found.stiffness[:, :1]])
    gap = np.diff(np.append(found.position, 1.0))
    change = np.abs(np.diff(k)) / k.max(axis=1)[:, None]
    assert change[:, gap > SHORTEST].max() <= 0.02
    # sixteen jumps: two pairs begin and two cease to carry in each of the eight meshes ... once a period
    assert (change.max(axis=0) > 0.02).sum() >= 8


def test_equilibrium_holds_at_all_positions(solved):
    gears, found = solved
    total = TORQUE / gears.sun.base_radius
    assert found.force[:4].sum(axis=0) == pytest.approx(total, rel=1e-10)
    assert found.force[4:] == pytest.approx(found.force[:4], rel=1e-10)


def test_negative_torque_is_the_mirror_image(bodies):
    gears = small_set(equal_planet_angles(4))
    options = dict(positions=24, supports=SUPPORTS)
    one, two = (loaded_period(gears, bodies, bodies, sun_torque=t, **options) for t in (TORQUE, -TORQUE))
    planet = [0, 3, 2, 1]
    mesh = [*planet, *(4 + n for n in planet)]
    for name in ("force", "stiffness"):
        turned = one.resampled(name, 240)[mesh][:, -np.arange(240) % 240]
        assert two.resampled(name, 240) == pytest.approx(turned, rel=5e-3)
    assert two.held_compliance == pytest.approx(one.held_compliance[np.ix_(mesh, mesh)], rel=1e-3, abs=1e-13)


def test_an_error_of_one_planet_breaks_the_symmetry():
    gears = small_set(equal_planet_angles(4))
    none = no_deviations(gears)
    assert planet_symmetry(gears, none) == 4
    for pins, expected in (
        ([[0, 5e-6]] + [[0, 0]] * 3, 1),
        ([[0, 5e-6], [0, 0]] * 2, 2),
        ([[0, 5e-6]] * 4, 4),
    ):
        assert planet_symmetry(gears, replace(none, pin_errors=np.array(pins, float))) == expected


def test_coupling_through_the_sun_is_what_a_changed_load_shows(bodies):
    """Diagonal and rest of the compliance against central differences of the loaded state."""
    gears = small_set(equal_planet_angles(4))
    options = dict(positions=np.array([0.1]), options=CycleOptions(held_bodies=bodies))
    found, less, more = (walk_mesh_cycle(gears, bodies, sun_torque=TORQUE * f, **options) for f in (1.0, 0.98, 1.02))
    change = (more.deflection - less.deflection)[:, 0]
    force = (more.force - less.force)[:, 0]
    predicted = found.held_compliance[..., 0] @ force
    # the active set is frozen in the prediction: a cell more or less is a per cent of the local part
    assert predicted == pytest.approx(change, rel=0.01)
    alone = np.diag(found.held_compliance[..., 0]) * force
    assert np.abs(alone[:4] / change[:4] - 1).min() > 0.03


def test_positions_meet_equal_planets_alike():
    common = dict(profile_shift=0.0, module=2e-3, pressure_angle=np.deg2rad(20), face_width=0.02)
    for teeth, N, wanted, expected in (
        ((27, 40, 108), 3, 64, 64),
        ((21, 19, 59), 4, 64, 64),
        ((21, 19, 59), 5, 64, 65),
        ((28, 41, 110), 3, 64, 66),
    ):
        sun, planet, ring = (
            Gear(teeth=z, rim_radius=0.3 if i == 2 else 0.005, internal=i == 2, **common) for i, z in enumerate(teeth)
        )
        gears = PlanetarySet(sun, planet, ring, 1e-3 * (teeth[0] + teeth[1]), equal_planet_angles(N))
        assert gears.equal_positions(wanted) == expected
    # pairs: 21 x 18 of 80 pitches apart, fortieths of a period
    assert small_set(PAIRS).equal_positions(64) == 80


def test_cubics_between_the_positions_keep_enclosed_jumps():
    """A smooth function with and without a jump: far better than straight lines, the jump as high."""
    for jump in (0.0, 1.0):
        tau = np.sort(np.append(np.arange(48) / 48, 0.375 + 2.0**-13))

        def exact(x, jump=jump):
            return np.cos(2 * np.pi * x) + 0.3 * np.sin(4 * np.pi * x) + jump * (x > 0.375) * (1.0 - x)

        values = exact(tau)[None]
        period = LoadedPeriod(tau, values, values, values, values, np.zeros((2, 2)))
        found, at = period.resampled("force", 400)[0], np.arange(400) / 400
        # at the ends of a piece the slopes are of one side alone
        inner = np.abs(at - 0.375) > 2 / 48 if jump else np.ones(400, bool)
        straight = np.interp(at, tau, values[0], period=1.0)
        assert np.abs(found - exact(at))[inner].max() < 0.4 * np.abs(straight - exact(at))[inner].max()
        assert np.abs(found - exact(at))[at != 0.375].max() < 5e-3


def test_a_smooth_record_may_begin_anywhere():
    """Planets half a period apart have the same record between its positions too."""
    position = np.arange(34) / 34
    values = np.exp(np.sin(2 * np.pi * (position + np.array([[0.0], [0.5], [3 / 34]]))))
    period = LoadedPeriod(position, values, values, values, values, np.zeros((3, 3)))
    first, second, third = period.resampled("force", 340)
    assert np.roll(first, -170) == pytest.approx(second, rel=1e-12)
    assert np.roll(first, -30) == pytest.approx(third, rel=1e-12)
    assert first == pytest.approx(np.exp(np.sin(2 * np.pi * np.arange(340) / 340)), abs=5e-3)


# --- errors that turn -----------------------------------------------------------------------------------


@pytest.fixture
def coarse(monkeypatch):
    """Records of few positions: what is compared here holds for any of them."""
    for name, value in (("SHORTEST", 0.02), ("SMOOTHEST", 0.05), ("STEEP", 0.2), ("MISSED", 0.05)):
        monkeypatch.setattr(f"femgear.contact.loaded_period.{name}", value)


def _pattern(*values, teeth=21):
    return np.resize(1e-6 * np.array(values, float), teeth)


def _mounted():
    """One tooth of every planet with an error, so that after 14 1/4 mesh periods the next planet has it."""
    phases = small_set(equal_planet_angles(4)).mesh_phases[:4]
    turned = np.rint(14.25 * np.arange(4) + phases - phases[0]).astype(int)
    return np.array([np.roll(3e-6 * (np.arange(19) == 0), n) for n in turned])


MOUNTED = _mounted()


@pytest.mark.parametrize(
    ("torque", "angles", "changes", "periods", "parts"),
    [
        pytest.param(-TORQUE, 4, {"sun_runout": Runout(4e-6, 0.3)}, 21, 4, marks=pytest.mark.slow),
        (TORQUE, 4, {"sun_pitch": _pattern(2, -1, 0)}, 3, 4),
        (-TORQUE, PAIRS, {"sun_pitch": _pattern(2, -1, 0), "pin_errors": [[0, 3e-6], [0, 0]] * 2}, 3, 2),
        pytest.param(
            TORQUE,
            4,
            {"sun_pitch": _pattern(2, -1, 0), "pin_errors": [[0, 3e-6]] + [[0, 0]] * 3},
            3,
            1,
            marks=pytest.mark.slow,
        ),
        pytest.param(TORQUE, 4, {"planet_pitch": MOUNTED}, 19, 4, marks=pytest.mark.slow),
        pytest.param(-TORQUE, 4, {"planet_ring_side_pitch": MOUNTED}, 19, 4, marks=pytest.mark.slow),
    ],
)
def test_planets_repeat_one_another_where_errors_turn(bodies, coarse, torque, angles, changes, periods, parts):
    """Of the record one part is solved: all of it is what a walk finds at its positions."""
    gears = small_set(equal_planet_angles(4) if angles == 4 else angles)
    d = replace(no_deviations(gears), **changes)
    assert (_repetition(gears, torque, d, periods)[1] / periods).denominator == parts
    options = dict(sun_torque=torque, supports=SUPPORTS, deviations=d)
    found = loaded_period(gears, bodies, bodies, positions=8, **options)
    assert found.periods == periods and found.position[-1] < periods
    first = found.position[found.position < periods / parts - 1e-9]
    assert len(found.position) == parts * len(first)
    some = np.arange(len(found.position))[1 :: 5 if periods < 10 else 37]
    walk = walk_mesh_cycle(gears, bodies, positions=found.position[some], periods=periods, **options)
    for name in ("force", "deflection", "stiffness"):
        expected = getattr(walk, name)
        difference = np.abs(getattr(found, name)[:, some] - expected).max()
        assert difference < 1e-8 * np.abs(expected).max()
    # between the positions the record goes through its own values
    again = found.resampled("force", 64 * periods)
    assert again[:4].sum(axis=0) == pytest.approx(abs(torque) / gears.sun.base_radius, rel=1e-3)


def test_planets_alike_but_for_the_tooth_that_begins_do_not_repeat_one_another():
    """Errors of planets count from tooth 0, which meets the sun at its own time: the mounting decides."""
    gears = small_set(equal_planet_angles(4))
    even = no_deviations(gears)
    alike = replace(even, planet_runout=(Runout(4e-6),) * 4)
    assert planet_shift(alike, gears, 4, 19) is None
    assert planet_shift(replace(even, sun_runout=Runout(4e-6)), gears, 4, 21) == Fraction(21, 4)
    assert planet_shift(replace(even, planet_pitch=MOUNTED), gears, 4, 19) == Fraction(57, 4)
    assert planet_shift(replace(even, planet_pitch=MOUNTED, sun_runout=Runout(4e-6)), gears, 4, 399)
    other = MOUNTED.copy()
    other[2] = np.roll(other[2], 1)
    assert planet_shift(replace(even, planet_pitch=other), gears, 4, 19) is None


@pytest.mark.slow
def test_runout_of_the_sun_shares_the_load_as_the_meshes_are_soft(bodies, coarse):
    """Sun on rigid bearings, its runout e small: planets take up ``e cos`` of their angle, in closed form.

    The arcs of all planets behind the sun are one, and runout separates them by ``e cos(a - psi_j)``, whose
    sum vanishes: to first order the sun keeps its angle and the planets share ``f = -s/c``, with c the
    compliance of a planet's two meshes to forces that go around like ``exp(i psi_j)``.
    """
    gears, size = small_set(equal_planet_angles(4)), 0.05e-6
    d = replace(no_deviations(gears), sun_runout=Runout(size))
    options = dict(sun_torque=TORQUE, positions=48)
    found = loaded_period(gears, bodies, bodies, deviations=d, **options)
    force = np.fft.rfft(found.resampled("force", 21 * 840), axis=1)[:, 1] * 2 / (21 * 840)
    position = np.arange(84) / 84
    one = walk_mesh_cycle(
        gears, bodies, sun_torque=TORQUE, positions=position, options=CycleOptions(held_bodies=bodies)
    )
    C = one.held_compliance.reshape(2, 4, 2, 4, -1).sum(axis=(0, 2))
    wave = np.exp(1j * np.asarray(gears.planet_angles))
    expected = size * np.array([np.linalg.solve(C[..., p], wave) for p in range(84)]).mean(axis=0)
    assert np.abs(force[:4]) == pytest.approx(np.abs(expected), rel=0.02)
    assert np.abs(force[:4]) == pytest.approx(np.full(4, np.abs(force[0])), rel=1e-9)
