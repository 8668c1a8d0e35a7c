"""What cannot be assembled or run is refused with numbers; what is unusual is warned about."""

import math
from dataclasses import replace

import numpy as np
import pytest

from femgear.errors import GeometryError
from femgear.gears.checks import _backlash, check_passing_tips, check_set, tip_clearances, tip_margin
from femgear.gears.gear import Gear
from femgear.gears.planetary import (
    PlanetarySet,
    close_set,
    equal_planet_angles,
    feasible_angles,
    zero_backlash_shift,
)
from femgear.gears.profile import BasicRack
from validation.reference.gear_limits import neighbour_limit

ALPHA = math.radians(20.0)


def gears(teeth, *, module=1.5e-3, shifts=(0.0, 0.0, 0.0), rack=BasicRack(), tip=None):  # noqa: B008
    outer = module * (teeth[2] / 2 + 5)
    rims = module * (teeth[0] / 2 - 4), module * (teeth[1] / 2 - 4), outer
    sun, planet, ring = (
        Gear(z, module, ALPHA, x, 25e-3, rim, internal=rim == outer, rack=rack)
        for z, x, rim in zip(teeth, shifts, rims, strict=True)
    )
    return sun, planet, ring if tip is None else replace(ring, tip_diameter=2 * tip)


def standard(teeth, planets=1, angles=(), **options):
    return close_set(*gears(teeth, **options), planet_angles=angles or equal_planet_angles(planets))


REFERENCE = PlanetarySet(*gears((27, 40, 108), shifts=(0.52681, 0.0, 0.0)), 51e-3, planet_angles=equal_planet_angles(3))


def refusal(planetary):
    with pytest.raises(GeometryError) as caught:
        check_set(planetary)
    error = caught.value
    assert error.exit_code == 2 and error.limit and error.remedy and error.key
    return error


def codes(planetary):
    return [w.code for w in check_set(planetary)]


def test_reference_set_passes_without_a_word():
    """Its shift is rounded to five decimals: 4.5 nm of overlap, within the stated tolerance."""
    assert check_set(REFERENCE) == ()
    assert REFERENCE.backlash_sun_planet == pytest.approx(-4.5e-9, abs=1e-10)


def test_four_planets_on_126_teeth_are_refused_with_the_feasible_angles():
    """BENCHMARK D8: OH-58, 27/99, (27 + 99)/4 = 31.5."""
    error = refusal(standard((27, 36, 99), planets=4, rack=BasicRack(root_radius=0.15)))
    assert error.code == "E-ASSEMBLY"
    assert "31.5" in str(error)
    for angle in ("91.428571", "180.000000", "271.428571"):
        assert angle in error.remedy


def test_feasible_angles_assemble():
    wanted = feasible_angles(126, equal_planet_angles(4))
    made = replace(standard((27, 36, 99), rack=BasicRack(root_radius=0.15)), planet_angles=wanted)
    assert check_set(made) == ()
    rounded = tuple(math.radians(round(math.degrees(a), 6)) for a in wanted)
    assert check_set(replace(made, planet_angles=rounded)) == ()


def test_overlapping_planets_are_refused():
    error = refusal(replace(REFERENCE, planet_angles=equal_planet_angles(5)))
    assert error.code == "E-NEIGHBOURS"
    # chord of 72 deg on 51 mm minus two tip radii of 31.5 mm
    assert f"{63 - 102 * math.sin(math.radians(36)):.4f}" in str(error)
    assert error.limit == "at most 4 equally spaced planets"
    assert refusal(replace(REFERENCE, planet_angles=equal_planet_angles(1000))).code == "E-NEIGHBOURS"
    assert refusal(replace(REFERENCE, planet_angles=(0.0, 1.0, 3.0))).code == "E-NEIGHBOURS"
    # the last and the first planet are neighbours too
    error = refusal(replace(REFERENCE, planet_angles=(0.0, 3.0, 6.0)))
    assert (error.code, error.key, error.value) == ("E-NEIGHBOURS", "set.planet_angles", "16.2253 deg")
    assert "planets 3 and 1, 16.2253 deg apart" in error.message
    assert f"{63 - 102 * math.sin(math.pi - 3.0):.4f} mm" in error.message
    least = math.degrees(2.0 * math.asin(31.5 / 51.0))
    assert error.limit == f"more than {least:.4f} deg between neighbours"


def test_angles_that_are_offered_leave_room_between_the_planets():
    """Five equal planets clear each other, not so on 74 teeth: 360/74 deg times 14 is less than 72 deg."""
    rack = BasicRack(root_radius=0.15)
    error = refusal(standard((18, 19, 56), planets=5, rack=rack))
    assert error.code == "E-ASSEMBLY" and "a multiple of 5" in error.remedy
    assert "68.1081 deg apart" in error.remedy and "planet_angles" not in error.remedy
    offered = feasible_angles(74, equal_planet_angles(5))
    assert refusal(standard((18, 19, 56), rack=rack, angles=offered)).code == "E-NEIGHBOURS"


def test_neighbour_limit_allows_what_the_check_allows():
    for sun, planet, limit in ((20, 30, 4), (27, 35, 4), (12, 42, 3), (30, 20, 6)):
        assert math.floor(neighbour_limit(sun, planet)) == limit
    assert neighbour_limit(6, 40) == pytest.approx(math.pi / math.asin(42 / 46))


@pytest.mark.parametrize("count", [1, 2])
def test_one_or_two_planets_are_warned_about(count):
    angles = feasible_angles(135, equal_planet_angles(count))
    assert codes(replace(REFERENCE, planet_angles=angles)) == ["W-PLANETS"]


def test_shift_that_does_not_close_the_set_is_refused_or_warned_about():
    tight = replace(REFERENCE, sun=replace(REFERENCE.sun, profile_shift=0.6))
    error = refusal(tight)
    assert (error.code, error.key) == ("E-BACKLASH", "sun.profile_shift")
    loose = replace(REFERENCE, sun=replace(REFERENCE.sun, profile_shift=0.0))
    assert "W-BACKLASH" in codes(loose)


def test_uneven_backlash_names_the_centre_distance_of_the_shifts():
    """Sun 0.3, planet 0.1 on 82.5 mm, the ring's shift found: zero play at 82.142 mm (ISO 21771, eq. 60)."""
    made = gears((24, 30, 84), module=3e-3, shifts=(0.3, 0.1, 0.0))

    def closed(allowance, find=("ring",)):
        thin = [replace(gear, thickness_allowance=allowance) for gear in made]
        return close_set(*thin, planet_angles=equal_planet_angles(3), centre_distance=82.5e-3, find=find)

    for allowance in (0.0, 50e-6):
        (found,) = [w for w in check_set(closed(allowance)) if w.code == "W-BACKLASH"]
        assert found.key == "set.centre_distance" and "82.142 mm" in found.text
        needed = zero_backlash_shift(made[0], made[1], 82.5e-3)
        assert f"82.5 mm needs x_sun + x_planet = {needed:.4f}" in found.text
        assert "W-BACKLASH" not in codes(closed(allowance, find=("sun", "ring")))
    # the play of thinner teeth of one gear alone is asked for
    even = closed(0.0, find=("sun", "ring"))
    assert "W-BACKLASH" not in codes(replace(even, sun=replace(even.sun, thickness_allowance=0.3e-3)))
    apart = replace(even, sun=replace(even.sun, profile_shift=-1.3))
    assert any("suit no centre distance" in w.text for w in _backlash(apart))


def test_negative_play_names_the_gear_whose_shift_is_wrong():
    assert refusal(replace(REFERENCE, ring=replace(REFERENCE.ring, profile_shift=-0.1))).key == "ring.profile_shift"


@pytest.mark.parametrize(
    ("rho", "refused"),
    [(0.25, False), (0.26, False), (0.38, False), (0.30, True), pytest.param(0.38, True, marks=pytest.mark.slow)],
)
def test_ring_tip_on_planet_fillet(rho, refused, mesh_gaps):
    """Against placed outlines: the largest overlap over one mesh period is the one that is told.

    Up to 0.005 modules it is a warning with its size; tips 0.1 mm longer overlap by more.
    """
    rack = BasicRack(root_radius=rho)
    made = [replace(g, rack=rack) for g in (REFERENCE.sun, REFERENCE.planet, REFERENCE.ring)]
    s = close_set(*made, planet_angles=(0.0,), centre_distance=51e-3, find=("sun",))
    if refused:
        s = replace(s, ring=replace(s.ring, tip_diameter=2.0 * s.ring.tip_radius - 0.2e-3))
    overlap = -min(np.min(mesh_gaps(s, tau)[1, 0]) for tau in np.linspace(0.0, 1.0, 121))
    if refused:
        error = refusal(s)
        assert (error.code, error.key) == ("E-FILLET", "rack.root_radius")
        assert "ring's tip runs into the planet's root fillet" in str(error)
        told = float(str(error).split("overlap ")[1].split(" um")[0]) * 1e-6
        assert told == pytest.approx(overlap, rel=0.05)  # arcs about planet and ring centres
        allowed = float(error.remedy.split(">= ")[1].split(" mm")[0]) * 1e-3
        assert check_set(replace(s, ring=replace(s.ring, tip_diameter=allowed + 1e-7)))[0].code == "W-PLANETS"
    else:
        assert overlap < 0.005 * s.planet.module
        said = [one for one in check_set(s) if one.code == "W-FILLET"]
        assert len(said) == (overlap > 1e-9)
        for finding in said:
            told = float(finding.text.split("overlap ")[1].split(" um")[0]) * 1e-6
            assert told == pytest.approx(overlap, rel=0.05, abs=2e-8)  # it lasts for few positions
            assert finding.severity == ("doubt" if overlap > 1e-4 * s.planet.module else "note")


def test_sun_tip_on_planet_fillet_is_refused():
    s = standard((60, 20, 100), rack=BasicRack(root_radius=0.38), tip=74e-3)
    assert codes(s) == ["W-PLANETS"]
    error = refusal(replace(s, sun=replace(s.sun, tip_diameter=93.6e-3)))
    assert error.code == "E-FILLET"
    assert "sun's tip runs into the planet's root fillet" in str(error)


def test_involute_interference_of_the_standard_18_72_pair():
    """BENCHMARK D: the line of action is 0.77 mm short at m = 3."""
    error = refusal(standard((36, 18, 72), module=3e-3, rack=BasicRack(root_radius=0.38)))
    assert error.code == "E-INTERFERENCE"
    assert "0.7698 mm" in str(error)


@pytest.mark.parametrize("ring", [44, 45, 46, 47, 48, 49, 50, 52])
def test_passing_tips_against_rolled_outlines(ring):
    """Ring tips shortened to be free of involute interference: only the passing of the tips remains."""
    base = 0.5e-3 * math.cos(ALPHA) * np.array([40, ring])
    distance = 0.5e-3 * (ring - 40)
    tip = max(math.hypot(base[1], distance * math.sin(ALPHA)) + 2e-5, 0.5e-3 * (ring - 2))
    pair = _planet_and_ring(ring, tip)
    assert (tip_margin(*pair, distance) < 0.0) is _tips_strike(*pair, distance)


def test_passing_tips_are_refused():
    """No sun fits a ring of 46 teeth around a planet of 40, so the pair is checked alone."""
    planet = Gear(40, 1e-3, ALPHA, 0.0, 1e-2, 15e-3)
    ring = Gear(46, 1e-3, ALPHA, 0.0, 1e-2, 40e-3, internal=True)
    with pytest.raises(GeometryError) as caught:
        check_passing_tips(planet, ring, 3e-3)
    assert caught.value.code == "E-INTERFERENCE"


def _planet_and_ring(ring_teeth, tip):
    """A planet of 40 teeth, and a ring with a given tip radius."""
    planet = Gear(40, 1e-3, ALPHA, 0.0, 1e-2, 15e-3)
    return planet, Gear(ring_teeth, 1e-3, ALPHA, 0.0, 1e-2, 40e-3, internal=True, tip_diameter=2 * tip)


def _tips_strike(planet, ring, distance):
    """Roll the planet of 40 teeth in the ring and look for tip corners of the planet inside ring teeth."""
    ring_teeth = ring.teeth
    half = math.pi / 80 + math.tan(ALPHA) - ALPHA
    corner = half - (math.tan(b := math.acos(planet.base_radius / planet.tip_radius)) - b)
    turns = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 40001)
    # at the pitch point: planet tooth half a pitch from the ring tooth, both half a pitch thick
    worst = 0.0
    for side in (1.0, -1.0):
        point = distance + planet.tip_radius * np.exp(1j * (turns + side * corner))
        r = np.abs(point)
        local = np.angle(point) - turns * 40 / ring_teeth - math.pi / ring_teeth
        pitch = ring.pitch_angle
        local = np.abs((local + 0.5 * pitch) % pitch - 0.5 * pitch)
        ok = (r >= ring.tip_radius) & (r > ring.base_radius)
        pressure = np.arccos(ring.base_radius / r[ok])
        width = math.pi / (2 * ring_teeth) - (math.tan(ALPHA) - ALPHA) + np.tan(pressure) - pressure
        worst = max(worst, float(np.max(width - local[ok], initial=0.0)))
    return worst > 1e-7


def test_negative_tip_clearance_is_refused():
    deep = standard((24, 36, 96), rack=BasicRack(addendum=1.2, dedendum=1.1, root_radius=0.05))
    error = refusal(deep)
    assert error.code in ("E-CLEARANCE", "E-FILLET")
    assert min(tip_clearances(deep).values()) == pytest.approx(-0.1 * 1.5e-3)


def test_clearances_of_the_standard_rack_are_a_quarter_module():
    values = tip_clearances(standard((24, 36, 96)))
    assert list(values.values()) == pytest.approx([0.375e-3] * 4)


def test_contact_ratio_under_one_is_refused():
    stub = standard((24, 36, 96), rack=BasicRack(addendum=0.5))
    error = refusal(stub)
    assert error.code == "E-CONTACT-RATIO" and "tip_diameter" not in error.remedy
    short = replace(stub.sun, tip_diameter=2.0 * stub.sun.tip_radius)
    assert "leave sun.tip_diameter out" in refusal(replace(stub, sun=short)).remedy
    # the overlap of helical teeth in slices keeps them in contact
    said = [one for one in check_set(stub, overlap=0.9) if one.code == "W-CONTACT-RATIO"]
    assert said and all(one.severity == "doubt" and "0.9000 alone" in one.text for one in said)
    with pytest.raises(GeometryError, match="contact ratio"):
        check_set(stub, overlap=0.05)
    assert "W-CONTACT-RATIO" in codes(standard((24, 36, 96), rack=BasicRack(addendum=0.65)))


def test_undercut_is_flagged_with_the_least_shift():
    s = standard((12, 36, 84), rack=BasicRack(root_radius=0.2))
    (warning,) = [w for w in check_set(s) if w.code == "W-UNDERCUT"]
    assert warning.key == "sun.profile_shift"
    assert "0.2981" in str(warning)  # x_min(12) of a tool flank one module deep
    assert s.contact_ratio_sun_planet < 1.6


def test_thin_tips_and_thin_rims_are_warned_about():
    thin_rim = replace(REFERENCE, ring=replace(REFERENCE.ring, rim_radius=85e-3))
    assert codes(thin_rim) == ["W-RIM"]
    (warning,) = check_set(thin_rim)
    assert 'static.members = "fixed"' in warning.text and "stiffer as it thins" in warning.text
    planet_rim = replace(REFERENCE, planet=replace(REFERENCE.planet, rim_radius=26e-3))
    (warning,) = check_set(planet_rim)
    assert "hold its bore rigid" in warning.text and "Y_B = 2.03" in warning.text  # 1.6 ln(2.242 x 3.375/2.125)
    sun = Gear(27, 1.5e-3, ALPHA, 1.2, 25e-3, 9e-3)
    planet = replace(REFERENCE.planet, tip_diameter=62e-3)
    planet = replace(planet, profile_shift=zero_backlash_shift(sun, planet, 51.5e-3) - sun.profile_shift)
    thin_tip = close_set(sun, planet, REFERENCE.ring, planet_angles=(0.0,), centre_distance=51.5e-3, find=("ring",))
    assert "W-TIP-THIN" in codes(thin_tip)


def test_warnings_say_where_and_how_much():
    (warning,) = check_set(replace(REFERENCE, planet_angles=(0.0,)))
    assert str(warning).startswith("[W-PLANETS] set.planets: 1 planet")
