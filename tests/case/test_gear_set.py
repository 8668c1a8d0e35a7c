"""Deviations in the case file: what they become, and every refusal with its line."""

import math
from pathlib import Path

import numpy as np
import pytest

from femgear.case.gear_set import planetary_set, set_deviations
from femgear.errors import CaseError, FemgearError, GeometryError
from femgear.gears.deviations import Ovality, Runout, body_separation, common_period
from femgear.gears.modifications import ProfileCrowning, ProfileSlope, RootRelief, TipRelief, form_deviation
from femgear.stages.static_results import set_warnings
from femgear.trains.reading import parse_case, read_case, to_toml, with_value

CASE = Path(__file__).parents[2] / "cases" / "planetary_27_40_108.toml"
TEXT = CASE.read_text(encoding="utf-8")
UM = 1e-6
RELIEF = '\n[[sun.modifications]]\nkind = "tip relief"\namount = "12 um"\nstart_diameter = "43.5 mm"\n'


def case_of(extra: str):
    return parse_case(TEXT + extra, name="case.toml")


def refused(extra: str, kind=CaseError) -> FemgearError:
    with pytest.raises(kind) as info:
        set_deviations(case_of(extra))
    assert info.value.exit_code == 2
    assert "case.toml" in str(info.value)
    return info.value


# --- what a good file gives ---------------------------------------------------------------------------


def test_a_case_without_deviations_is_ideal():
    d = set_deviations(read_case(CASE))
    assert d.ideal
    assert d.sun_pitch.shape == (27,) and d.planet_pitch.shape == (3, 40) and d.ring_pitch.shape == (108,)


def test_reliefs_by_diameter_roll_angle_and_roll_length():
    case = case_of(
        RELIEF
        + 'shape = "parabolic"\n'
        + '[[planet.modifications]]\nflank = "sun side"\nkind = "root relief"\namount = "8 um"\n'
        + 'start_roll_angle = "17 deg"\nend_roll_length = "6 mm"\npower = 1.5\n'
        + '[[planet.modifications]]\nkind = "profile crowning"\namount = "2 um"\n'
        + '[[ring.modifications]]\nkind = "profile slope"\namount = "-3 um"\n'
    )
    gears, d = planetary_set(case), set_deviations(case)
    start = math.sqrt(0.02175**2 - gears.sun.base_radius**2)
    (relief,) = d.sun.modifications
    assert isinstance(relief, TipRelief) and relief.start == pytest.approx(start, rel=1e-12)
    assert (relief.amount, relief.end, relief.power) == (pytest.approx(12 * UM), None, 2.0)
    root, crowning = d.planet_sun_side.modifications
    assert isinstance(root, RootRelief) and isinstance(crowning, ProfileCrowning)
    assert root.start == pytest.approx(math.radians(17) * gears.planet.base_radius, rel=1e-14)
    assert (root.end, root.power) == (pytest.approx(6e-3), 1.5)
    assert d.planet_ring_side.modifications == (crowning,)
    assert d.ring.modifications == (ProfileSlope(pytest.approx(-3 * UM)),)
    tip = form_deviation(d.sun, gears.sun, gears.sun.tip_roll)
    assert tip == pytest.approx(12 * UM, rel=1e-12)
    assert common_period(d, gears)[0] == 1 and not d.ideal


def test_errors_of_members_and_pins():
    case = case_of(
        '\n[sun.errors]\nrunout_amplitude = "5 um"\nrunout_phase = "30 deg"\n'
        '[ring.errors]\nthickness_reduction = "3 um"\n'
        'ovality = { nodal_diameter = 2, amplitude = "20 um", phase = "10 deg", inextensional = true }\n'
        '[carrier.errors]\nrunout_amplitude = "4 um"\n'
        '[[set.pin_errors]]\nplanet = 3\ntangential = "20 um"\nradial = "-1 um"\n'
        '[planet.errors]\nrunout_amplitude = "1 um"\nrunout_phase = "5 deg"\n'
        '[[planet.individual]]\nplanet = 2\nrunout_amplitude = "2 um"\nthickness_reduction = "8 um"\n'
    )
    d = set_deviations(case)
    assert d.sun_runout == Runout(pytest.approx(5 * UM), pytest.approx(math.radians(30)))
    assert d.carrier_runout == Runout(pytest.approx(4 * UM), 0.0) and d.ring_runout == Runout()
    one, two = Runout(UM, math.radians(5)), Runout(2 * UM, math.radians(5))
    assert [r.amplitude for r in d.planet_runout] == pytest.approx([1e-6, 2e-6, 1e-6])
    assert [r.phase for r in d.planet_runout] == pytest.approx([one.phase, two.phase, one.phase])
    np.testing.assert_allclose(d.pin_errors, np.array([[0, 0], [0, 0], [-1, 20]]) * UM, rtol=1e-12)
    assert d.ovality == Ovality(2, pytest.approx(20 * UM), pytest.approx(math.radians(10)), True)
    assert (d.sun_thickness, d.ring_thickness) == (0.0, pytest.approx(3 * UM))
    np.testing.assert_allclose(d.planet_thickness, [0, 8 * UM, 0])


def texts(values):
    return "[" + ", ".join(f'"{value} um"' for value in values) + "]"


def test_a_tooth_that_stands_further_on_comes_nearer_with_its_left_flank():
    cumulative = np.zeros(40)
    cumulative[7] = 6.0
    case = case_of(f"\n[planet.errors]\ncumulative_pitch = {texts(cumulative)}\n")
    d = set_deviations(case)
    along = 6 * UM * math.cos(math.radians(20))
    assert np.flatnonzero(d.planet_pitch[1]).tolist() == [7]
    assert d.planet_pitch[:, 7] == pytest.approx([-along] * 3, rel=1e-12)
    assert d.planet_ring_side_pitch[:, 7] == pytest.approx([along] * 3, rel=1e-12)
    assert not d.sun_pitch.any()


def test_single_pitches_give_the_cumulative_ones_and_individual_planets_replace_them():
    single, cumulative = np.zeros(40), np.zeros(40)
    single[[5, 6]], cumulative[5] = [4.0, -4.0], 4.0
    other = np.roll(cumulative, 3)
    case = case_of(
        f"\n[planet.errors]\npitch = {texts(single)}\n"
        f"[[planet.individual]]\nplanet = 3\ncumulative_pitch = {texts(other)}\n"
    )
    d = set_deviations(case)
    same = set_deviations(case_of(f"\n[planet.errors]\ncumulative_pitch = {texts(cumulative)}\n"))
    assert np.allclose(d.planet_pitch[:2], same.planet_pitch[:2], atol=1e-18)
    assert np.allclose(d.planet_pitch[2], np.roll(same.planet_pitch[2], 3), atol=1e-18)


def test_deviations_can_be_changed_and_written():
    case = case_of(RELIEF + '[[set.pin_errors]]\nplanet = 1\ntangential = "20 um"\n')
    more = with_value(case, "sun.modifications[0].amount", "20 um")
    assert set_deviations(more).sun.modifications[0].amount == pytest.approx(20 * UM)
    moved = with_value(more, "set.pin_errors[0].tangential", "-5 um")
    assert set_deviations(moved).pin_errors[0, 1] == pytest.approx(-5 * UM)
    assert parse_case(to_toml(moved)) == moved
    for key in (
        "sun.modifications[1].amount",
        "sun.modifications.amount",
        "sun.teeth[0].x",
        "sun.modifications[0]",
    ):
        with pytest.raises(CaseError) as info:
            with_value(case, key, "20 um")
        assert info.value.key == key
    assert with_value(case, "sun.modifications", None).sun.modifications == ()


def test_pin_errors_separate_both_meshes_of_the_planet():
    case = case_of('\n[[set.pin_errors]]\nplanet = 2\ntangential = "20 um"\n')
    gears, d = planetary_set(case), set_deviations(case)
    got = body_separation(d, gears, 0.0)[:, 0]
    sun_side = 20 * UM * math.cos(gears.working_pressure_angle_sun_planet)
    ring_side = 20 * UM * math.cos(gears.working_pressure_angle_planet_ring)
    assert got == pytest.approx([0, sun_side, 0, 0, ring_side, 0], abs=1e-17)


# --- refusals -----------------------------------------------------------------------------------------

HEAD = '\n[[sun.modifications]]\nkind = "tip relief"\namount = "12 um"\n'


@pytest.mark.parametrize(
    ("extra", "code", "key"),
    [
        (HEAD, "E-KEY-MISSING", "sun.modifications[0]"),
        ('\n[[sun.modifications]]\nkind = "tip relief"\n', "E-KEY-MISSING", "sun.modifications[0]"),
        ('\n[[sun.modifications]]\namount = "1 um"\n', "E-KEY-MISSING", "sun.modifications[0].kind"),
        (RELIEF.replace("12 um", "12"), "E-UNIT", "sun.modifications[0].amount"),
        (RELIEF.replace("12 um", "12 deg"), "E-UNIT", "sun.modifications[0].amount"),
        (RELIEF.replace("12 um", "0.4 mm"), "E-RANGE", "sun.modifications[0].amount"),
        (RELIEF.replace("12 um", "12 mm"), "E-RANGE", "sun.modifications[0].amount"),
        (RELIEF.replace("tip relief", "tip releif"), "E-CHOICE", "sun.modifications[0].kind"),
        (RELIEF + 'flank = "both"\n', "E-KEY-UNKNOWN", "sun.modifications[0].flank"),
        (RELIEF + 'start_roll_angle = "20 deg"\n', "E-DUPLICATE", "sun.modifications[0]"),
        (RELIEF + 'power = 2\nshape = "linear"\n', "E-DUPLICATE", "sun.modifications[0]"),
        (RELIEF + "power = 0\n", "E-RANGE", "sun.modifications[0].power"),
        (RELIEF + 'deviations = ["1 um"]\n', "E-MODIFICATION", "sun.modifications[0]"),
        (
            RELIEF.replace("tip relief", "profile slope") + "power = 2\n",
            "E-MODIFICATION",
            "sun.modifications[0]",
        ),
        (RELIEF.replace("tip relief", "measured profile"), "E-MODIFICATION", "sun.modifications[0]"),
        (
            '\n[[sun.modifications]]\nkind = "measured profile"\ndiameters = ["4 cm", "5 cm"]\ndeviations = ["1 um"]\n',
            "E-COUNT",
            "sun.modifications[0]",
        ),
        (
            '\n[[sun.modifications]]\nkind = "measured profile"\ndiameters = ["4 cm", "4 cm"]\n'
            'deviations = ["1 um", "1 um"]\n',
            "E-RANGE",
            "sun.modifications[0]",
        ),
        ('\n[sun.errors]\npitch = ["1 um", "-1 um"]\n', "E-COUNT", "sun.errors.pitch"),
        (f"\n[sun.errors]\npitch = {texts([1.0] + [0.0] * 26)}\n", "", ""),
        (f"\n[sun.errors]\npitch = {texts([2.0] + [0.0] * 26)}\n", "E-RANGE", "sun.errors.pitch"),
        (
            f"\n[sun.errors]\npitch = {texts([0.0] * 27)}\ncumulative_pitch = {texts([0.0] * 27)}\n",
            "E-DUPLICATE",
            "sun.errors",
        ),
        ('\n[sun.errors]\nrunout_amplitude = "-1 um"\n', "E-RANGE", "sun.errors.runout_amplitude"),
        ('\n[sun.errors]\nrunout_amplitude = "0.31 mm"\n', "E-RANGE", "sun.errors.runout_amplitude"),
        ('\n[sun.errors]\nrunout = "1 um"\n', "E-KEY-UNKNOWN", "sun.errors.runout"),
        ('\n[carrier.errors]\npitch = ["1 um"]\n', "E-KEY-UNKNOWN", "carrier.errors.pitch"),
        ('\n[[set.pin_errors]]\nplanet = 4\nradial = "1 um"\n', "E-RANGE", "set.pin_errors[0].planet"),
        ('\n[[set.pin_errors]]\nplanet = 0\nradial = "1 um"\n', "E-RANGE", "set.pin_errors[0].planet"),
        ("\n[[set.pin_errors]]\nplanet = 1\n" * 2, "E-DUPLICATE", "set.pin_errors[1].planet"),
        ('\n[[set.pin_errors]]\nplanet = 1\nradial = "1 mm"\n', "E-RANGE", "set.pin_errors[0].radial"),
        ("\n[[planet.individual]]\nplanet = 5\n", "E-RANGE", "planet.individual[0].planet"),
        ('\n[[planet.individual]]\nplanet = 1\npitch = ["0 um"]\n', "E-COUNT", "planet.individual[0].pitch"),
        (
            '\n[ring.errors]\novality = { amplitude = "1 um" }\n',
            "E-KEY-MISSING",
            "ring.errors.ovality.nodal_diameter",
        ),
        (
            '\n[ring.errors]\novality = { nodal_diameter = 0, amplitude = "1 um" }\n',
            "E-RANGE",
            "ring.errors.ovality.nodal_diameter",
        ),
        (
            '\n[ring.errors]\novality = { nodal_diameter = 2, amplitude = "1 um", inextensional = "yes" }\n',
            "E-TYPE",
            "ring.errors.ovality.inextensional",
        ),
    ],
)
def test_refusals(extra, code, key):
    if not code:  # what rounding leaves is spread
        assert set_deviations(case_of(extra)).sun_pitch[0] == 0.0
        return
    error = refused(extra)
    assert error.code == code and error.key == key


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("43.5 mm", "36 mm", "inside the base circle"),
        ("43.5 mm", "38.5 mm", "starts outside the involute flank"),
        ("43.5 mm", "60 mm", "starts outside the involute flank"),
        ('"43.5 mm"', '"43.5 mm"\nend_diameter = "42 mm"', "exchanged"),
    ],
)
def test_places_off_the_flank(old, new, text):
    extra = RELIEF.replace(old, new)
    error = refused(extra, GeometryError)
    line = (TEXT + extra).splitlines().index("[[sun.modifications]]") + 1
    assert error.code == "E-MODIFICATION" and text in str(error)
    assert str(error).startswith(f"[E-MODIFICATION] case.toml:{line}: sun.modifications[0]")


def test_lines_of_entries_in_lists_of_tables():
    extra = RELIEF + RELIEF.replace("12 um", "13 deg") + RELIEF.replace("12 um", "14 kg")
    error = refused(extra)
    lines = (TEXT + extra).splitlines()
    for problem, amount in zip(error.problems, ("13 deg", "14 kg"), strict=True):
        line = lines.index('amount = "' + amount + '"') + 1
        assert problem.file == f"case.toml:{line}"


def test_misspelt_keys_of_a_modification_are_recognised():
    error = refused(RELIEF + 'shpe = "linear"\n')
    assert error.code == "E-KEY-UNKNOWN" and "shape" in error.remedy


def test_all_mistakes_at_once():
    error = refused(
        RELIEF.replace("12 um", "0.4 mm")
        + '[[set.pin_errors]]\nplanet = 9\n[sun.errors]\nrunout_amplitude = "0.5 mm"\n'
    )
    assert [problem.key for problem in error.problems] == [
        "set.pin_errors[0].planet",
        "sun.modifications[0].amount",
        "sun.errors.runout_amplitude",
    ]


# --- what no single entry shows -----------------------------------------------------------------------


def line_of(extra: str, text: str) -> int:
    return (TEXT + extra).splitlines().index(text) + 1


def test_modifications_of_a_flank_are_limited_in_sum():
    """20 x 0.28 mm on a module of 1.5 mm: every entry is below 0.2 modules, the tip would lose 5.6 mm."""
    extra = RELIEF.replace("12 um", "280 um") * 20
    error = refused(extra, GeometryError)
    assert (error.code, error.key, error.value) == ("E-MODIFICATION", "sun.modifications", "5600 um")
    assert error.file == f"case.toml:{line_of(extra, '[[sun.modifications]]')}"
    assert "20 modifications together take off 5600 um" in str(error) and "300 um" in error.limit
    # what one adds the other may take off, and what stands on different ends of a flank does not add up
    slope = '\n[[sun.modifications]]\nkind = "profile slope"\namount = "250 um"\n'
    root = RELIEF.replace("tip relief", "root relief").replace("12 um", "280 um").replace("43.5", "42")
    tip = RELIEF.replace("12 um", "280 um")
    for fine in (tip + slope, tip + root):
        d, gears = set_deviations(case_of(fine)), planetary_set(case_of(fine))
        roll = np.linspace(gears.sun.form_roll, gears.sun.tip_roll, 5001)
        assert np.abs(form_deviation(d.sun, gears.sun, roll)).max() <= 300 * UM
    assert refused(tip + tip, GeometryError).value == "560 um"


def test_the_sum_is_that_of_each_flank_of_the_planets():
    relief = RELIEF.replace("sun", "planet").replace("12 um", "200 um").replace("43.5 mm", "61.5 mm")
    sides = [relief + f'flank = "{side} side"\n' for side in ("sun", "ring")]
    assert len(set_deviations(case_of("".join(sides))).planet_sun_side.modifications) == 1
    error = refused(sides[1] * 2, GeometryError)
    assert "planet, ring side: 2 modifications" in str(error) and error.key == "planet.modifications"


def test_a_relief_that_goes_on_beyond_its_end_is_limited_too():
    extra = RELIEF.replace("12 um", "250 um") + 'end_diameter = "43.9 mm"\n'
    error = refused(extra, GeometryError)
    assert error.code == "E-MODIFICATION" and "goes on beyond its end" in str(error)


@pytest.mark.parametrize("kind", ["tip relief", "root relief", "profile crowning"])
def test_negative_amounts_of_reliefs_are_a_warning(kind):
    start = "" if kind == "profile crowning" else 'start_diameter = "43.5 mm"\n'
    extra = f'\n[[sun.modifications]]\nkind = "{kind}"\namount = "-12 um"\n{start}'
    case = case_of(RELIEF + extra)
    found = [str(one) for one in set_warnings(case) if one.code == "W-RELIEF-SIGN"]
    assert len(found) == 1 and "sun.modifications[1].amount" in found[0] and "-12 um" in found[0]
    assert not with_value(case, "sun.modifications[1].amount", "12 um").notices
    slope = RELIEF.replace("tip relief", "profile slope").replace("12 um", "-12 um")
    assert not case_of(slope).notices


@pytest.mark.parametrize(
    ("table", "key", "teeth"),
    [
        ("[sun.errors]", "sun.errors.pitch", 27),
        ("[planet.errors]", "planet.errors.pitch", 40),
        ("[[planet.individual]]\nplanet = 2", "planet.individual[0].pitch", 40),
    ],
)
def test_single_pitches_are_limited_in_sum(table, key, teeth):
    """One half of the pitches 0.29 mm too long, the other too short: no entry is above 0.2 modules."""
    half = teeth // 2
    values = [290.0] * half + [0.0] * (teeth % 2) + [-290.0] * half
    extra = f"\n{table}\npitch = {texts(values)}\n"
    error = refused(extra)
    assert (error.code, error.key) == ("E-RANGE", key)
    assert error.file == f"case.toml:{line_of(extra, f'pitch = {texts(values)}')}"
    # tooth 0 stays: the pitches of teeth 1 to half - 1 add up
    assert f"{290 * (half - 1)} um at tooth {half - 1}" in str(error) and "300 um" in error.limit
    assert "metres" not in str(error)


def test_single_pitches_up_to_the_limit_are_taken():
    """The tooth that stands furthest off is that of the separations, projected on the base circle."""
    values = [0.0, 145.0, 145.0, -145.0, -145.0] + [0.0] * 22
    d = set_deviations(case_of(f"\n[sun.errors]\npitch = {texts(values)}\n"))
    assert -d.sun_pitch.min() == pytest.approx(290 * UM * math.cos(math.radians(20)), rel=1e-12)
    values[1] = 160.0
    values[3] = -160.0
    assert "305 um at tooth 2" in str(refused(f"\n[sun.errors]\npitch = {texts(values)}\n"))
