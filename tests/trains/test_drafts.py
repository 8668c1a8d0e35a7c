"""Cases that ``femgear new`` writes."""

import pytest

from femgear import solve
from femgear.case.gear_set import planetary_set
from femgear.case.text import parse, write
from femgear.errors import CaseError, FemgearError
from femgear.trains.drafts import KINDS, new_case
from femgear.trains.reading import parse_case, read_case, with_values
from femgear.trains.registry import check_case, train_of

TRAINS = {"planetary": "elastic"}


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_without_numbers(kind):
    text = new_case(kind)
    case = read_case(text)
    assert train_of(case).name == TRAINS.get(kind, kind)
    check_case(case)
    assert not [one for one in case.notices if one.code == "W-ESTIMATED"]
    entries = [line for line in text.splitlines() if " = " in line]
    marked = [line.split(" = ")[0] for line in entries if "  # estimated: " in line]
    known = ("mass", "inertia", "stiffness", "foundation", "bore_radius", "outer_radius", "radial", "tilt")
    wanted = [line.split(" = ")[0] for line in entries if any(one in line.split(" = ")[0] for one in known)]
    assert wanted and not set(wanted) - set(marked)


@pytest.mark.parametrize("kind", ["planetary", "planar", "helical"])
def test_what_is_written_is_what_would_be_estimated(kind):
    case = read_case(new_case(kind))
    left = {f"{name}.{key}": None for name in ("sun", "planet") for key in ("mass", "inertia")}
    again = with_values(case, left | {"carrier": None})
    for name in ("sun", "planet", "carrier"):
        for key in ("mass", "inertia"):
            given = getattr(getattr(case, name), key)
            assert getattr(getattr(again, name), key) == pytest.approx(given, rel=1e-3)


def test_numbers_that_are_given():
    text = new_case(
        "planetary",
        teeth=(24, 30, 84),
        module="3 mm",
        torque="250 Nm",
        speed="1450 1/min",
        planets=4,
        face_width="40 mm",
    )
    case = read_case(text)
    gears = planetary_set(case)
    assert (gears.sun.teeth, gears.planet.teeth, gears.ring.teeth, gears.n_planets) == (24, 30, 84, 4)
    assert case.module == 3e-3 and case.set.face_width == 0.04
    assert case.operation.torque == 250.0 and case.operation.speeds[0] == pytest.approx(151.8436, rel=1e-6)
    assert gears.centre_distance == pytest.approx(81e-3)
    for line in text.splitlines():
        assert "estimated" not in line or not line.startswith(("torque", "face_width", "planets"))


@pytest.mark.parametrize(
    ("teeth", "planets"), [((27, 40, 108), 3), ((30, 20, 70), 4), ((20, 30, 81), 1), ((21, 30, 79), 4)]
)
def test_sets_close_with_teeth_left_over_or_missing(teeth, planets):
    gears = planetary_set(read_case(new_case("planetary", teeth=teeth)))
    assert gears.n_planets == planets
    assert abs(gears.backlash_sun_planet) + abs(gears.backlash_planet_ring) < 1e-9
    assert min(gears.contact_ratio_sun_planet, gears.contact_ratio_planet_ring) > 1.0


@pytest.mark.parametrize(
    ("kind", "numbers", "code"),
    [
        ("bevel", {}, "E-CHOICE"),
        ("planetary", {"teeth": (27, 40)}, "E-COUNT"),
        ("pair", {"teeth": (27, 40, 108)}, "E-COUNT"),
        ("pair", {"teeth": (27, -40)}, "E-COUNT"),
        ("pair", {"module": "2"}, "E-UNIT"),
        ("drivetrain", {"module": "2 kg"}, "E-UNIT"),
        ("planetary", {"torque": "12 N"}, "E-UNIT"),
        ("planetary", {"planets": 4}, "E-ASSEMBLY"),
        ("planetary", {"planets": 0}, "E-RANGE"),
        ("pair", {"planets": 3}, "E-ARGUMENTS"),
    ],
)
def test_numbers_that_make_no_case(kind, numbers, code):
    with pytest.raises(FemgearError) as caught:
        new_case(kind, **numbers)
    assert caught.value.code == code and (caught.value.limit or caught.value.remedy)


def test_remarks_do_not_change_the_tables():
    tables = {"a": 1, "b": {"c": [1, 2], "d": {"e": "x"}}, "f": [{"g": 1, "h": {"i": 2.5}}, {"g": 3}]}
    text = write(tables, {"b.c": "why\nnot", "f[1].g": "last"})
    assert parse(text, "") == tables == parse(write(tables), "")
    assert "c = [1, 2]  # why\\nnot" in text and "g = 3  # last" in text and text.count("[[f]]") == 2
    with pytest.raises(CaseError, match="E-TYPE"):
        write({1: 2})


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["planetary", "planar", "helical", "pair"])
def test_new_cases_have_modes(kind):
    coarse = {"static.positions": 16, "static.flank_elements": 8}
    found = solve(with_values(parse_case(new_case(kind)), coarse), "modes")
    assert found["modes"].modes.frequency.max() > 500.0
