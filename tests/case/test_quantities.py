"""Units of case files."""

import functools
import math
from functools import partial
from types import FunctionType

import pytest

from femgear.case import quantities
from femgear.case.quantities import LENGTH, MASS, Count, Number, to_si
from femgear.errors import CaseError


def test_usual_units_are_those_of_pint():
    """Every spelling of every unit that is known without pint: the same dimension, the same factor."""
    spellings = [("", "")], [(" ", "*"), ("^", "**")], [(" ", " · "), ("^2", "²"), ("^3", "³")]
    for si, usual in quantities._FACTORS.items():
        dimension = quantities.Dimension("a quantity", si, si, 1.0)
        base = quantities._root(si)
        assert base is not None
        for unit, factor in usual.items():
            for changes in spellings:
                spelt = functools.reduce(lambda text, change: text.replace(*change), changes, unit)
                found = quantities._root(spelt)
                assert found is not None and found[1] == base[1], spelt
                assert found[0] / base[0] == factor == quantities.to_si(f"1 {spelt}", dimension), spelt


@pytest.mark.parametrize("read", [partial(to_si, dimension=MASS), Number(0.0, 1.0).read])
def test_numbers_next_to_none_are_refused_and_zero_is_not(read):
    def given(number):
        return number if isinstance(read, FunctionType) else f"{number!r} kg"

    assert read(given(0.0)) == 0.0 and read(given(1e-99)) == 1e-99
    for small in (5e-324, 1e-310, 9e-101):
        with pytest.raises(CaseError, match="next to none") as caught:
            read(given(small))
        assert caught.value.code == "E-RANGE" and "1e-100" in caught.value.limit


def test_units_of_messages_are_what_they_say():
    """The SI value of one shown unit, as texts with that unit are read."""
    shown = [one for one in vars(quantities).values() if isinstance(one, quantities.Dimension)]
    assert len(shown) > 10
    for dimension in shown:
        read = quantities.to_si(f"1 {dimension.shown}", dimension)
        assert dimension.scale == pytest.approx(read, rel=1e-15), dimension.name
        assert quantities.to_si(f"1 {dimension.si}", dimension) == 1.0
    assert quantities.MODULUS.window(1e9, 206e9) == "1 GPa to 206 GPa"


@pytest.mark.parametrize(
    ("text", "si", "value"),
    [
        ("120 Nm", "N m", 120.0),
        ("120 N*m", "N m", 120.0),
        ("3 kNm", "N m", 3e3),
        ("5 N mm / rad", "N m/rad", 5e-3),
        ("30 rev/min", "rad/s", math.pi),
        ("30 1/min", "rad/s", math.pi),
        ("30 1 / min", "rad/s", math.pi),
        ("2 kN/mm", "N/m", 2e6),
        ("20 °", "rad", math.radians(20.0)),
        ("4 µm", "m", 4e-6),
        ("4 μm", "m", 4e-6),
        ("4 mum", "m", 4e-6),
        ("7.85 kg / dm^3", "kg/m^3", 7850.0),
    ],
)
def test_words_of_drawings_and_other_programs(text, si, value):
    dimension = quantities.Dimension("a quantity", si, si, 1.0)
    assert quantities.to_si(text, dimension) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    ("given", "named", "remedy"),
    [
        (21.5, "21.5", None),
        ("21.5", "21.5", None),
        (27.0, "27.0", "write 27"),
        ("27.0", "27.0", "write 27"),
        ("27", "a text", "write it without quotes"),
        ("27 teeth", "a text", None),
        ("many", "a text", None),
        (float("nan"), "a number", None),
        (True, "true or false", None),
    ],
)
def test_what_is_no_whole_number_is_named(given, named, remedy):
    """What the remedy says is accepted, and what no remedy mends has none."""
    with pytest.raises(CaseError, match=f"a whole number is needed, not {named}\n") as caught:
        Count(5, 5000).read(given)
    assert caught.value.code == "E-TYPE" and caught.value.limit == "5 to 5000" and caught.value.remedy == remedy


@pytest.mark.parametrize(
    ("text", "dimension", "near"),
    [
        ("3 nm", quantities.TORQUE, "Nm"),
        ("3 rmp", quantities.SPEED, "rpm"),
        ("3 Nm/deg", quantities.TORSION, "Nm/rad"),
        ("3 kN/m^2", quantities.STIFFNESS, "kN/mm"),
        ("3 gPa", quantities.MODULUS, "GPa"),
    ],
)
def test_wrong_units_name_near_ones(text, dimension, near):
    with pytest.raises(CaseError) as caught:
        quantities.to_si(text, dimension)
    error = caught.value
    assert error.code == "E-UNIT" and error.limit == f"units convertible to {dimension.si}"
    assert error.remedy.startswith("did you mean ") and near in error.remedy.split("?")[0].split()


@pytest.mark.parametrize(
    ("text", "dimension", "slip", "usual"),
    [
        ("1 200 rpm", quantities.SPEED, "a blank", '"1200 rpm"'),
        ("12 345 678 N/m", quantities.STIFFNESS, "a blank", '"12345678 N/m"'),
        ("−300 N m", quantities.TORQUE, "a typographic minus", '"-300 N m"'),
        ("1e−4 kg m^2", quantities.INERTIA, "a typographic minus", '"1e-4 kg m^2"'),
        ("1,5 mm", quantities.LENGTH, "a comma", "decimal point"),
    ],
)
def test_slips_in_numbers_are_named(text, dimension, slip, usual):
    with pytest.raises(CaseError, match=f"has {slip}") as caught:
        quantities.to_si(text, dimension)
    assert caught.value.code == "E-UNIT" and usual in caught.value.remedy
    assert quantities.to_si("1450 1/min", quantities.SPEED) == pytest.approx(1450 * quantities.RPM)


@pytest.mark.parametrize(
    ("text", "usual"), [("5 %", "write 0.05"), ("5", "without quotes"), ("5 mm", "without unit"), ("five", None)]
)
def test_numbers_in_quotes(text, usual):
    with pytest.raises(CaseError, match="a number is needed") as caught:
        Number(0.0, 1.0).read(text)
    assert usual in caught.value.remedy if usual else caught.value.remedy is None


@pytest.mark.parametrize(
    ("text", "dimension", "near"),
    [
        ("400 N/mm2", quantities.STRESS, "N/mm^2"),
        ("7850 kg/m3", quantities.DENSITY, "kg/m^3"),
        ("3 kg m2", quantities.INERTIA, "kg m^2"),
        ("1000 min-1", quantities.SPEED, "min^-1"),
    ],
)
def test_powers_without_their_sign_name_units_that_work(text, dimension, near):
    with pytest.raises(CaseError, match="not a product of units") as caught:
        quantities.to_si(text, dimension)
    assert near in caught.value.remedy.removeprefix("did you mean ").split("?")[0].split(" or ")
    assert quantities.to_si(f"{text.split()[0]} {near}", dimension) > 0.0


def test_absorbed_doses_are_no_angles():
    with pytest.raises(CaseError, match="'rads' is not a unit of angle"):
        quantities.to_si("0.3 rads", quantities.ANGLE)


def test_other_units_than_usual_ones_are_known():
    assert quantities.to_si("2 inch", quantities.LENGTH) == 2 * 0.0254
    assert "inch" not in quantities._FACTORS["m"]


@pytest.mark.parametrize("text", ["1e-6 mm", "1e-9 m", "0.001 um", "20 um", "0.02 mm", "2e-5 m"])
def test_ends_of_a_window_are_in_it_in_every_unit(text):
    assert to_si(text, LENGTH, low=1e-9, high=2e-5) in (1e-9, 2e-5)
    for beyond in ("0.9999999 nm", "20.000001 um"):
        with pytest.raises(CaseError):
            to_si(beyond, LENGTH, low=1e-9, high=2e-5)


def test_whole_parts_of_a_unit_are_divided_to_the_last_digit():
    """51 times 0.001 is not the number 0.051."""
    assert 51 * 0.001 != 0.051 and to_si("51 mm", LENGTH) == 0.051
