"""Units of case files."""

from functools import partial
from types import FunctionType

import pytest

from femgear.case import quantities
from femgear.case.quantities import MASS, Number, to_si
from femgear.errors import CaseError


def test_common_units_are_those_of_pint():
    """Every name with every prefix, one or several: none is another unit in all of pint's definitions."""
    lines = [[part.strip() for part in line.split("=")] for line in quantities._COMMON.strip().splitlines()]
    named = [[line[0], *line[2:]] for line in lines if line[0] != "pi"]
    prefixes = [name.rstrip("-") for names in named if names[0].endswith("-") for name in names]
    units = [name for names in named if not names[0].endswith("-") for name in names if name != "_"]
    assert {"m", "mm", "kN", "GPa", "rpm", "um"} < {p + u for p in ["", *prefixes] for u in units}
    for unit in (p + u for p in ["", *prefixes] for u in units):
        common = quantities._root(unit, "common")
        assert common is not None and common == quantities._root(unit, "all"), unit
        several = quantities._root(f"{unit}s", "common")
        assert several is None or several == quantities._root(f"{unit}s", "all"), unit
    for unit in ("N m/rad", "kg mm^2", "kN/um", "rad/s", "kg m^2"):
        assert quantities._root(unit, "common") == quantities._root(unit, "all")


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


def test_absorbed_doses_are_no_angles():
    with pytest.raises(CaseError, match="'rads' is not a unit of angle"):
        quantities.to_si("0.3 rads", quantities.ANGLE)


def test_other_units_than_common_ones_are_known():
    assert quantities.to_si("2 inch", quantities.LENGTH) == 2 * 0.0254
    assert quantities._root("inch", "common") is None
