"""Cases whose members float: refused before anything is meshed where the planets cannot hold them."""

from pathlib import Path

import pytest

from femgear.case.gear_set import planetary_set
from femgear.case.planetary import check_floating
from femgear.cli import main
from femgear.errors import GeometryError
from femgear.stages.static import solve_static
from femgear.trains.reading import parse_case, with_value

TEXT = (Path(__file__).parents[2] / "cases" / "planetary_27_40_108.toml").read_text(encoding="utf-8")
ELASTIC = TEXT.replace("[static]", '[static]\nmembers = "elastic"')
SUN = ('support_stiffness = "5e7 N/m"', 'support_stiffness = "0 N/m"')
CARRIER = ('support_stiffness = "2e8 N/m"', 'support_stiffness = "0 N/m"')
TWO = ("planets = 3", 'planets = 2\nplanet_angles = ["0 deg", "178.6666666666667 deg"]')
HALF = (
    "planets = 3",
    'planets = 3\nplanet_angles = ["0 deg", "90.6666666666667 deg", "178.6666666666667 deg"]',
)


def edited(*changes):
    text = ELASTIC
    for old, new in changes:
        assert text.count(old) == 1
        text = text.replace(old, new)
    return text


@pytest.mark.parametrize("planets", [("planets = 3", "planets = 1"), TWO, HALF], ids=["one", "two", "half"])
@pytest.mark.parametrize(("member", "change"), [("sun", SUN), ("carrier", CARRIER)])
def test_a_member_that_the_planets_cannot_hold(member, change, planets, monkeypatch):
    def no_mesh(*_, **__):
        raise AssertionError("meshed before it was refused")

    monkeypatch.setattr("femgear.stages.static.make_sectors", no_mesh)
    text = edited(change, planets)
    case = parse_case(text, name="case.toml")
    for refuses in (planetary_set, solve_static):
        with pytest.raises(GeometryError) as info:
            refuses(case)
        error = info.value
        assert (error.code, error.key) == ("E-MECHANISM", f"{member}.support_stiffness")
        line = text.splitlines().index(next(x for x in text.splitlines() if x.startswith(change[1]))) + 1
        assert error.file == f"case.toml:{line}"
        assert f"cannot hold a floating {member}" in str(error) and f"[{member}]" in error.remedy
    # what the remedy says helps
    assert planetary_set(with_value(case, f"{member}.support_stiffness", "5e7 N/m"))
    assert planetary_set(with_value(case, "static.members", "fixed"))


def test_members_that_are_held_may_float():
    for changes in ((SUN,), (CARRIER,), (SUN, CARRIER), (TWO,)):
        assert planetary_set(parse_case(edited(*changes))).n_planets >= 2
    # with back flanks two planets hold the sun within its play
    both = edited(SUN, TWO).replace("[static]", "[static]\nback_flanks = true")
    assert planetary_set(parse_case(both)).n_planets == 2


def test_members_always_move_in_the_dynamic_model():
    case = parse_case(edited(SUN, TWO).replace('members = "elastic"', 'members = "fixed"'), name="case.toml")
    gears = planetary_set(case)
    with pytest.raises(GeometryError, match="cannot hold a floating sun") as info:
        check_floating(case, gears, dynamic=True)
    assert info.value.key == "sun.support_stiffness"
    check_floating(with_value(case, "sun.support_stiffness", "1 N/m"), gears, dynamic=True)


def test_a_ring_that_nothing_keeps_from_turning():
    loose = edited(
        ('foundation_tangential = "1e10 N/m^3"', 'foundation_tangential = "0 N/m^3"'),
        ('fixed = "ring"', 'fixed = "carrier"'),
    )
    with pytest.raises(GeometryError, match="keeps the ring from turning") as info:
        planetary_set(parse_case(loose, name="case.toml"))
    assert (info.value.code, info.value.key) == ("E-MECHANISM", "ring.foundation_tangential")
    assert planetary_set(parse_case(loose.replace('"elastic"', '"fixed"')))


def test_check_refuses_it_on_the_command_line(tmp_path, capsys):
    path = tmp_path / "case.toml"
    path.write_text(edited(SUN, TWO), encoding="utf-8")
    assert main(["check", str(path)]) == 2
    said = capsys.readouterr().err
    assert said.startswith("[E-MECHANISM]") and "sun.support_stiffness" in said and "case.toml:" in said
