"""What must hold between entries of a case: published lines, entries that cannot both be left out."""

from trains.test_reading import CASE, refused, replaced

from femgear.trains.reading import parse_case, read_case, to_toml, with_value


def test_centre_distance_and_both_shifts_cannot_be_left_out(tmp_path):
    text = replaced('centre_distance = "51 mm"', "")
    assert parse_case(text).set.centre_distance is None
    start, end = text.index("[ring]"), text.index("[carrier]")
    text = text[:start] + replaced("profile_shift = 0.0", "#", text[start:end]) + text[end:]
    assert parse_case(text).ring.profile_shift is None
    error = refused(replaced("profile_shift = 0.52681\n", "", text), tmp_path)
    assert error.key == "set.centre_distance" and "sun.profile_shift" in error.remedy


def test_published_lines_need_their_speed_and_harmonic(tmp_path):
    error = refused(replaced('speeds = ["250 rpm", "3100 rpm"]', 'speeds = ["250 rpm"]'), tmp_path)
    assert [p.key for p in error.problems] == [f"housing.published[{i}].speed" for i in (1, 2)]
    assert {p.code for p in error.problems} == {"E-PUBLISHED"} and error.problems[0].value == "3100 rpm"
    six = replaced("tolerance = 1e-6", "tolerance = 1e-6\nmesh_harmonics = 6")
    error = refused(replaced("harmonic = 6\norders", "harmonic = 19\norders", six), tmp_path)
    assert error.key == "housing.published[2].harmonic" and "1 to 18" in error.limit


def test_published_lines_that_a_change_leaves_behind_are_dropped_and_said():
    case = with_value(read_case(CASE), "operation.speeds", ["250 rpm"])
    assert [entry.harmonic for entry in case.housing.published] == [1]
    assert any("2 of 3 entries housing.published" in notice.text for notice in case.notices)
    assert parse_case(to_toml(case)) == case
