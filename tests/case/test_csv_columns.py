"""Measured profiles of a case: spellings of the CSV files, and every refusal with its file and line."""

import math
import os
from pathlib import Path

import numpy as np
import pytest

from femgear.case.csv_columns import read_profile
from femgear.case.gear_set import planetary_set, set_deviations
from femgear.errors import CaseError, GeometryError
from femgear.gears.modifications import MeasuredLead, MeasuredProfile
from femgear.stages.static_results import set_warnings
from femgear.trains.reading import parse_case, read_case, to_toml, with_value

TEXT = (Path(__file__).parents[2] / "cases" / "planetary_27_40_108.toml").read_text(encoding="utf-8")
UM = 1e-6
MEASURED = '\n[[sun.modifications]]\nkind = "measured profile"\nfile = "data/left.csv"\n'
GOOD = "# machine 7\nroll angle [deg], deviation [um]\n\n15, -2.5\n20, 1.5\n 30 , -4e0\n"


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "data").mkdir()

    def write(csv: str | bytes, extra: str = MEASURED) -> Path:
        data = csv if isinstance(csv, bytes) else csv.encode()
        (tmp_path / "data" / "left.csv").write_bytes(data)
        path = tmp_path / "case.toml"
        path.write_text(TEXT + extra, encoding="utf-8")
        return path

    return write


def measured(path):
    case = read_case(path)
    (profile,) = set_deviations(case).sun.modifications
    assert isinstance(profile, MeasuredProfile)
    return profile, planetary_set(case).sun


def test_a_measured_profile_has_material_positive(folder):
    profile, sun = measured(folder(GOOD))
    # the points stand in the case with 13 digits
    assert profile.roll == pytest.approx(np.radians([15, 20, 30]) * sun.base_radius, rel=5e-13)
    assert profile.removed == pytest.approx([2.5 * UM, -1.5 * UM, 4 * UM], rel=1e-14)


@pytest.mark.parametrize(
    "csv",
    [
        "\ufeffroll angle [deg];deviation [µm]\r\n15;-2,5\r\n20;1,5\r\n30;-4\r\n",
        "roll_angle [deg]\tdeviation [mm]\n30\t-0,004\n20\t,0015\n15\t-0,0025\n",
        "Deviation (um), Roll Angle (rad)\n-2.5,.2617993877991\n1.5,.3490658503989\n-4,.5235987755983",
    ],
    ids=["semicolons", "tabs, descending", "columns exchanged"],
)
def test_spellings_of_a_measured_profile(folder, csv):
    want, _ = measured(folder(GOOD))
    got, _ = measured(folder(csv))
    assert got.roll == pytest.approx(want.roll, rel=1e-12)
    assert got.removed == pytest.approx(want.removed, rel=1e-12)


def test_a_profile_over_diameters(folder):
    profile, sun = measured(folder("diameter [mm], deviation [um]\n40, 1\n44, 2\n"))
    assert np.hypot(profile.roll, sun.base_radius) == pytest.approx([0.020, 0.022], rel=1e-12)


def test_the_points_are_kept_with_the_case(folder, tmp_path):
    path = folder(GOOD)
    case = read_case(path)
    want = set_deviations(case).sun
    (tmp_path / "data" / "left.csv").unlink()
    assert set_deviations(with_value(case, "operation.torque", "50 N m")).sun == want
    again = parse_case(to_toml(case))
    assert set_deviations(again).sun == want and again == case
    with pytest.raises(CaseError, match="cannot open"):
        read_case(path)


@pytest.mark.parametrize(
    ("csv", "text", "line"),
    [
        ("15, -2.5\n20, 1.5\n30, 1\n", "no known name", 1),
        ("roll angle, deviation\n15, 1\n20, 2\n", "no known name", 1),
        ("roll angle [mm], deviation [um]\n15, 1\n20, 2\n", "not a unit of angle", 1),
        ("roll angle [deg], diameter [mm]\n15, 1\n20, 2\n", "the columns are", 1),
        ("roll angle [deg], deviation [um], x [mm]\n15, 1\n20, 2\n", "no known name", 1),
        ("roll angle [deg], deviation [um]\n15, 1\n20, 2, 3\n", "3 entries", 3),
        ("roll angle [deg]; deviation [um]\n15; 1,5\n20; 1.500\n", "decimal commas and points", 3),
        ("roll angle [deg], deviation [um]\n15, 1\n20, abc\n", "not a finite number", 3),
        ("roll angle [deg], deviation [um]\n15, nan\n20, 1\n", "not a finite number", 2),
        ("roll angle [deg], deviation [um]\n15, 1e999\n20, 1\n", "not a finite number", 2),
        ("roll angle [deg], deviation [um]\n15, 1\n2_0, 1\n", "not a finite number", 3),
        ("roll angle [deg], deviation [um]\n15, 1\n\u0662\u0660, 1\n", "not a finite number", 3),
        ("roll angle [deg], deviation [um]\n15, 1\n\n20, 1\n18, 1\n", "neither ascending", 5),
        ("roll angle [deg], deviation [um]\n15, 1\n15, 1\n", "neither ascending", 3),
        ("roll angle [deg], deviation [um]\n15, 1\n", "1 points", None),
        ("roll angle [deg], deviation [um]\n" + "1, 1\n" * 2001, "2001 points", None),
        ("", "empty", None),
        (b"roll angle [deg], deviation [\xb5m]\n15, 1\n20, 1\n", "not UTF-8", None),
        ("x" * 1_000_001, "too long", None),
    ],
)
def test_bad_profiles_name_file_and_line(folder, csv, text, line):
    with pytest.raises(CaseError, match=text) as info:
        read_case(folder(csv))
    place = str(info.value).splitlines()[0]
    assert "left.csv" in place and (line is None or f"left.csv:{line}:" in place)
    assert info.value.key == "sun.modifications[0].file" and info.value.exit_code == 2


@pytest.mark.parametrize("name", ["/etc/hostname", "../left.csv", "data/../../x.csv", "data", "none.csv", ""])
def test_bad_profile_paths(folder, name):
    path = folder(GOOD, MEASURED.replace("data/left.csv", name))
    with pytest.raises(CaseError) as info:
        read_case(path)
    assert info.value.code == "E-FILE" and info.value.key == "sun.modifications[0].file"


def test_a_link_or_pipe_in_place_of_a_profile(folder, tmp_path):
    path = folder(GOOD)
    (tmp_path / "outside").mkdir()
    home = tmp_path / "home"
    home.mkdir()
    path.rename(home / "case.toml")
    (tmp_path / "data").rename(home / "data")
    left, outside = home / "data" / "left.csv", tmp_path / "outside" / "left.csv"
    left.rename(home / "measured.csv")
    left.symlink_to("../measured.csv")
    assert measured(home / "case.toml")
    (home / "measured.csv").rename(outside)

    def refused(text):
        with pytest.raises(CaseError, match=text) as info:
            read_case(home / "case.toml")
        assert info.value.code == "E-FILE" and info.value.key == "sun.modifications[0].file"
        assert info.value.remedy

    left.unlink()
    left.symlink_to(outside)
    refused("must lie in the folder of the case")
    left.unlink()
    (home / "data").rmdir()
    (home / "data").symlink_to(outside.parent, target_is_directory=True)
    refused("must lie in the folder of the case")
    (home / "data").unlink()
    (home / "data").mkdir()
    left.symlink_to("/dev/zero")
    refused("must lie in the folder of the case")
    left.unlink()
    os.mkfifo(left)
    refused("not a regular file")
    left.unlink()
    left.symlink_to(left)
    refused("cannot open")


def test_a_table_is_read_without_a_case(tmp_path):
    path = tmp_path / "p.csv"
    path.write_text("diameter [mm], deviation [um]\n40, 1\n44, 2\n")
    assert read_profile(path) == {
        "diameters": pytest.approx([0.04, 0.044]),
        "deviations": pytest.approx([1e-6, 2e-6]),
    }


def test_a_measured_lead_may_be_a_file(folder):
    """As a measured profile; places beyond the width of 25 mm are refused with the file."""
    extra = MEASURED.replace("profile", "lead")
    path = folder("place [mm]; deviation [um]\n12,5; -2,5\n-12,5; 4\n", extra)
    (lead,) = set_deviations(read_case(path)).sun.modifications
    assert lead == MeasuredLead((-12.5e-3, 12.5e-3), (-4e-6, 2.5e-6))
    with pytest.raises(GeometryError, match=r"data/left\.csv") as info:
        set_deviations(read_case(folder("place [mm], deviation [um]\n0, 1\n25, 2\n", extra)))
    assert info.value.value == "25 mm" and "-12.5 to 12.5 mm" in info.value.limit
    with pytest.raises(CaseError, match="no known name"):
        read_case(folder("diameter [mm], deviation [um]\n40, 1\n44, 2\n", extra))


def test_profiles_too_many_for_one_case_are_refused(folder):
    rows = "".join(f"{15 + i / 200:.9f}, {math.sin(i):.9f}\n" for i in range(2000))
    path = folder("roll angle [deg], deviation [um]\n" + rows, MEASURED * 3)
    assert len(set_deviations(read_case(path)).sun.modifications) == 3
    with pytest.raises(CaseError, match="too long with the points") as info:
        read_case(folder("roll angle [deg], deviation [um]\n" + rows, MEASURED * 20))
    assert info.value.code == "E-FILE"


def test_points_in_the_case_itself():
    case = parse_case(
        TEXT + '\n[[ring.modifications]]\nkind = "measured profile"\n'
        'diameters = ["160 mm", "163 mm"]\ndeviations = ["2 um", "-1 um"]\n'
    )
    (profile,) = set_deviations(case).ring.modifications
    assert np.hypot(profile.roll, planetary_set(case).ring.base_radius) == pytest.approx([0.08, 0.0815])
    assert profile.removed == pytest.approx([-2 * UM, 1 * UM])


BESIDE = "roll angle [deg], deviation [um]\n100, 1\n150, -2\n200, 1\n"


def test_a_profile_beside_the_flank_is_refused_with_its_file_and_both_ranges(folder):
    """The flank of the sun spans roll angles of 13 to 36 deg: nothing of the profile would be used."""
    path = folder(BESIDE)
    case = read_case(path)
    gear = planetary_set(case).sun
    ends = [math.degrees(roll / gear.base_radius) for roll in (gear.form_roll, gear.tip_roll)]
    with pytest.raises(GeometryError, match=r"data/left\.csv") as info:
        set_deviations(case)
    error = info.value
    line = path.read_text().splitlines().index("[[sun.modifications]]") + 1
    assert (error.code, error.key) == ("E-MODIFICATION", "sun.modifications[0]")
    assert error.file == f"{path}:{line}"
    assert "roll angles 100 to 200 deg" in error.value
    assert "roll angles {:.4g} to {:.4g} deg".format(*ends) in error.limit
    # the name stays with the case, as long as the profile does
    with pytest.raises(GeometryError, match=r"data/left\.csv"):
        set_deviations(with_value(case, "operation.torque", "50 N m"))
    with pytest.raises(GeometryError, match="no part of the measured profile lies"):
        set_deviations(parse_case(to_toml(case)))
    assert with_value(case, "sun.modifications", None).profile_files == {}


def test_a_profile_that_meets_the_flank_is_taken(folder):
    """Two points on either side of the flank span it; the ring's roll lengths fall towards the tip."""
    profile, _ = measured(folder("roll angle [deg], deviation [um]\n5, 1\n60, 2\n"))
    assert len(profile.roll) == 2
    ring = MEASURED.replace("sun", "ring")
    with pytest.raises(GeometryError, match="ring: no part of"):
        set_deviations(read_case(folder(BESIDE, ring)))


def test_little_of_the_flank_is_a_warning(folder):
    """A measured profile is constant beyond its points: most of this flank is not what was measured."""
    case = read_case(folder("roll angle [deg], deviation [um]\n34, 1\n35, 2\n60, 3\n"))
    found = [str(one) for one in set_warnings(case) if one.code == "W-PROFILE"]
    assert len(found) == 1 and "roll angles 34 to 60 deg" in found[0] and "sun.modifications" in found[0]
    case = read_case(folder(GOOD))
    assert not [str(one) for one in set_warnings(case) if one.code == "W-PROFILE"]


def test_files_that_cannot_be_read_hide_no_other_mistake(folder):
    """Nor one another; the tables that lack their points are not refused for that as well."""
    wrong = TEXT.replace("teeth = 27", "teeth = 27.5").replace('fixed = "ring"', 'fixed = "rnig"')
    for gear, file, more in (
        ("sun", "one.csv", ""),
        ("planet", "two.csv", "foo = 1"),
        ("ring", "../x.csv", ""),
    ):
        wrong += f'\n[[{gear}.modifications]]\nkind = "measured profile"\nfile = "{file}"\n{more}\n'
    path = folder("diameter [mm],deviation [um]\n40,0\n44,0\n")
    path.write_text(wrong, encoding="utf-8")
    with pytest.raises(CaseError) as caught:
        read_case(path)
    found = [(one.code, one.key) for one in caught.value.problems]
    assert found == [
        ("E-FILE", "sun.modifications[0].file"),
        ("E-FILE", "planet.modifications[0].file"),
        ("E-FILE", "ring.modifications[0].file"),
        ("E-TYPE", "sun.teeth"),
        ("E-KEY-UNKNOWN", "planet.modifications[0].foo"),
        ("E-CHOICE", "operation.fixed"),
    ]
    text = str(caught.value)
    assert "one.csv: sun.mod" in text and f"{path}:{wrong[: wrong.index('../x.csv')].count(chr(10)) + 1}: " in text


LINES = "order,amplitude [m/s^2],level [dB],verdict\n105.0001,0.5,-6,normal\n111,1.25,0,normal\n"
OVER = '\n[[housing.measured]]\nfile = "data/left.csv"\nspeed = "3100 rpm"\n'


def test_measured_lines_are_kept_with_the_case(folder, tmp_path):
    case = read_case(folder(LINES, OVER))
    (entry,) = case.housing.measured
    assert entry.orders == (105.0001, 111.0) and entry.accelerations == (0.5, 1.25)
    assert entry.source == "data/left.csv" and parse_case(to_toml(case)) == case
    named = read_case(folder(LINES, OVER + 'source = "rig, June"\n'))
    assert named.housing.measured[0].source == "rig, June"


@pytest.mark.parametrize(
    ("csv", "extra", "code", "words"),
    [
        (LINES.replace("m/s^2", "V"), OVER, "E-FILE", "--unit"),
        (LINES.replace("order", "Hz"), OVER, "E-FILE", "no measured lines in m/s^2"),
        (LINES.splitlines()[0], OVER, "E-FILE", "lower --threshold"),
        (LINES.replace("1.25", "nan"), OVER, "E-FILE", "left.csv:3"),
        (LINES, OVER.replace("3100", "3000"), "E-PUBLISHED", "this speed is not computed"),
        (LINES, OVER.replace("left", "none"), "E-FILE", "housing.measured[0].file"),
        (LINES, OVER.replace("speed", "orders = [1, 2]\naccelerations = ['1 m/s^2']\nspeed"), "E-CASE", "unknown key"),
    ],
)
def test_measured_lines_that_are_refused(folder, csv, extra, code, words):
    with pytest.raises(CaseError) as refused:
        read_case(folder(csv, extra))
    assert words in str(refused.value) and refused.value.code == code


def test_measured_lines_of_a_speed_that_a_change_leaves_behind_are_dropped_and_said(folder):
    case = with_value(read_case(folder(LINES, OVER)), "operation.speeds", ["250 rpm"])
    assert case.housing.measured == ()
    assert any("1 of 1 entries housing.measured and 2 of 3 entries housing.published" in x.text for x in case.notices)
