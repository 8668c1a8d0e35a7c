"""The case file: everything that can be wrong with it is refused with key, number and remedy."""

import json
import math
import os
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from femgear.case import text as case_text
from femgear.case.gear_set import planetary_set
from femgear.errors import CaseError, GeometryError
from femgear.trains.reading import (
    case_schema,
    parse_case,
    parse_comparable,
    read_case,
    to_toml,
    with_value,
    with_values,
)

CASE = Path(__file__).parents[2] / "cases" / "planetary_27_40_108.toml"
TEXT = CASE.read_text(encoding="utf-8")


def replaced(old: str, new: str, text: str = TEXT) -> str:
    assert old in text
    return text.replace(old, new, 1)


def refused(text: str | bytes, tmp_path: Path) -> CaseError:
    path = tmp_path / "case.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(CaseError) as info:
        read_case(path)
    assert info.value.exit_code == 2
    assert "case.toml" in str(info.value)
    return info.value


def changed(key: str, value: object) -> CaseError:
    with pytest.raises(CaseError) as info:
        with_value(parse_case(TEXT, name="case.toml"), key, value)
    assert info.value.exit_code == 2
    return info.value


# --- what a good file gives -----------------------------------------------------------------------


def test_the_reference_case_in_si_units():
    case = read_case(CASE)
    assert (case.sun.teeth, case.planet.teeth, case.ring.teeth, case.set.planets) == (27, 40, 108, 3)
    assert case.sun.module == 0.0015
    assert case.set.centre_distance == 0.051
    assert case.sun.pressure_angle == pytest.approx(math.pi / 9, rel=1e-15)
    assert case.material.youngs_modulus == 206e9
    assert case.material.density == 7850
    assert case.sun.inertia == 1e-4
    assert case.ring.foundation_radial == 1e10
    assert case.motor.coupling_stiffness == 400
    assert case.operation.torque == 100
    assert case.operation.speeds == pytest.approx([250 * math.pi / 30, 3100 * math.pi / 30], rel=1e-14)
    # the reach of the excitation is found
    assert case.mesh_harmonics is None and case.response_harmonics is None
    assert case.notices == ()


def test_optional_sections_have_defaults_and_motor_and_brake_may_be_left_out():
    text = TEXT[: TEXT.index("[static]")]
    start, end = text.index("[motor]"), text.index("[operation]")
    case = parse_case(text[:start] + text[end:])
    assert case.motor is None and case.brake is None
    assert (case.static.positions, case.static.contact, case.housing.points) == (64, "profile", 54)
    assert case.housing.form == "exact" and case.dynamics.up_to is None
    assert with_value(case, "dynamics.mesh_harmonics", 5).response_harmonics == 15


def test_the_commented_entries_of_the_reference_case_are_valid():
    text, count = re.subn(r"(?m)^# ([a-z_]+ = )", r"\1", TEXT)
    case = parse_case(text)
    assert count == 9 and case != parse_case(TEXT)
    gears = planetary_set(case)
    assert gears.sun.tip_diameter == 0.04508043 and gears.sun.rack.root_radius == 0.3
    # half of 0.1 mm from either gear, along the line of action
    assert gears.backlash_planet_ring == pytest.approx(1e-4 * math.cos(math.pi / 9), rel=1e-6)


def test_the_case_cannot_be_changed():
    with pytest.raises(ValueError, match="frozen"):
        read_case(CASE).sun.teeth = 28


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("100 N m", 100.0),
        ("100 N*m", 100.0),
        ("100 N·m", 100.0),
        ("0.1 kN m", 100.0),
        ("1e5 N mm", 100.0),
        ("-1.5kN m", -1500.0),
        ("+.5 N m", 0.5),
    ],
)
def test_spellings_of_a_torque(text, value):
    assert with_value(read_case(CASE), "operation.torque", text).operation.torque == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize("text", ["1e-4 kg m^2", "1e-4 kg*m**2", "1e-4 kg m²", "100 kg mm^2", "1 kg cm^2"])
def test_spellings_of_an_inertia(text):
    assert with_value(read_case(CASE), "sun.inertia", text).sun.inertia == pytest.approx(1e-4, rel=1e-14)


def test_speeds_as_a_range_and_in_other_units():
    case = with_value(read_case(CASE), "operation.speeds", {"from": "100 rpm", "to": "300 rpm", "count": 5})
    assert case.operation.speeds == pytest.approx([n * math.pi / 30 for n in (100, 150, 200, 250, 300)], rel=1e-14)
    case = with_value(case, "operation.speeds", ["10 rad/s", "2 turn/s"])
    assert case.operation.speeds == pytest.approx([10, 4 * math.pi], rel=1e-14)


def test_crlf_tabs_and_trailing_blanks(tmp_path):  # bad input 18
    path = tmp_path / "case.toml"
    path.write_bytes(TEXT.replace("\n", " \t\r\n").encode())
    assert read_case(path) == read_case(CASE)


def test_byte_order_mark(tmp_path):  # bad input 2
    path = tmp_path / "case.toml"
    path.write_bytes(b"\xef\xbb\xbf" + TEXT.encode())
    assert read_case(path) == read_case(CASE)


def test_a_changed_case_can_be_written_and_read_again():
    case = with_value(with_value(read_case(CASE), "operation.torque", "50 N m"), "sun.rack", {"addendum": 0.9})
    assert case.operation.torque == 50 and case.sun.rack.addendum == 0.9
    assert read_case(CASE).operation.torque == 100
    assert parse_case(to_toml(case)) == case
    assert to_toml(read_case(CASE)) == TEXT


def test_entries_can_be_left_out_and_numpy_numbers_are_numbers():
    case = with_value(read_case(CASE), "motor", None)
    assert case.motor is None and read_case(CASE).motor is not None
    assert with_value(case, "sun.teeth", np.int64(30)).sun.teeth == 30
    assert with_value(case, "dynamics.damping_ratio", np.float64(0.02)).dynamics.damping_ratio == 0.02
    assert with_value(case, "operation.speeds", ("1 rpm", "2 rpm")).operation.speeds[1] > 0.2


def test_negative_ring_teeth_mean_internal_and_are_echoed():  # bad input 32
    case = with_value(read_case(CASE), "ring.teeth", -108)
    assert case.ring.teeth == 108
    assert "ring.teeth = -108" in case.notices[0].text and "ISO 21771" in case.notices[0].text


def test_zero_and_negative_torque_are_read():  # bad input 24, 25
    assert with_value(read_case(CASE), "operation.torque", "0 N m").operation.torque == 0
    assert with_value(read_case(CASE), "operation.torque", "-100 N m").operation.torque == -100


def test_schema_names_every_key_and_is_json():
    schema = json.loads(json.dumps(case_schema()))
    assert schema["additionalProperties"] is False
    assert {"set", "sun", "planet", "ring", "operation"} <= set(schema["required"])
    assert "length" in schema["$defs"]["SunSection"]["properties"]["module"]["description"]


_scalars = st.one_of(
    st.booleans(),
    st.integers(-(10**12), 10**12),
    st.floats(allow_nan=False, allow_infinity=False),
    st.text(st.characters(exclude_categories=("Cs",)), max_size=20),
)
_values = st.recursive(
    _scalars,
    lambda inner: st.one_of(
        st.lists(inner, max_size=3),
        st.dictionaries(st.text('ab_-. "é', min_size=1, max_size=5), inner, max_size=3),
    ),
    max_leaves=12,
)


@settings(max_examples=60, deadline=None)
@given(st.dictionaries(st.text("abcXYZ09_- .\"'\n", min_size=1, max_size=8), _values, max_size=4))
def test_writing_and_reading_toml_are_inverse(data):
    assert case_text.parse(case_text.write(data), "") == data


# --- files and syntax ----------------------------------------------------------------------------


def test_not_utf8_names_the_offset(tmp_path):  # bad input 1
    data = TEXT.encode()
    offset = data.index(b"27/40/108")
    error = refused(data[:offset] + b"\xff" + data[offset:], tmp_path)
    assert error.code == "E-FILE-ENC" and f"offset {offset}" in str(error) and "0xff" in str(error)


def test_duplicate_key_names_both_lines(tmp_path):  # bad input 3
    first = TEXT.splitlines().index("teeth = 27") + 1
    error = refused(replaced("teeth = 27\n", "teeth = 27\nbore_radius = '8 mm'\nteeth = 28\n"), tmp_path)
    assert error.code == "E-TOML" and error.key == "sun.teeth"
    assert f"lines {first} and {first + 2}" in str(error)


def test_duplicate_section_names_both_lines(tmp_path):  # bad input 3
    error = refused(TEXT + "\n[sun]\nteeth = 3\n", tmp_path)
    lines = [n for n, line in enumerate((TEXT + "\n[sun]\n").splitlines(), 1) if line == "[sun]"]
    assert error.code == "E-TOML" and error.key == "sun"
    assert f"lines {lines[0]} and {lines[1]}" in str(error)


def test_duplicate_in_the_last_line(tmp_path):  # bad input 3: tomllib says "at end of document"
    error = refused("title = 'a'\ntitle = 'b'", tmp_path)
    assert error.code == "E-TOML" and "lines 1 and 2" in str(error)


@pytest.mark.parametrize("literal", ["nan", "inf", "-inf", "1e999", "+nan"])  # bad input 10, 11
def test_numbers_that_are_not_finite(literal, tmp_path):
    error = refused(replaced("poisson_ratio = 0.3", f"poisson_ratio = {literal}"), tmp_path)
    assert error.code == "E-FINITE" and error.key == "material.poisson_ratio"


@pytest.mark.parametrize("literal", ["nan N m", "inf N m", "1e999 N m", "-1e400 kN m"])  # bad input 10, 11, 23
def test_torques_that_are_not_finite(literal):  # bad input 10, 11, 23
    error = changed("operation.torque", literal)
    assert error.code in ("E-FINITE", "E-UNIT") and error.key == "operation.torque"


def test_an_integer_of_5000_digits(tmp_path):  # bad input 12
    error = refused(replaced("teeth = 27", "teeth = " + "1" * 5000), tmp_path)
    assert error.code == "E-TOML" and "4300 digits" in str(error)


def test_an_integer_of_4000_digits(tmp_path):  # bad input 12
    error = refused(replaced("teeth = 27", "teeth = " + "1" * 4000), tmp_path)
    assert error.code == "E-RANGE" and error.key == "sun.teeth" and len(str(error)) < 500


def test_an_integer_of_4000_digits_as_a_number(tmp_path):  # bad input 12
    error = refused(replaced("poisson_ratio = 0.3", "poisson_ratio = " + "1" * 4000), tmp_path)
    assert error.code == "E-RANGE" and len(str(error)) < 500


@pytest.mark.parametrize(
    "text",
    [
        "a = " + "[" * 3000 + "]" * 3000,
        "a = " + "[" * 40 + "]" * 40,
        "a = " + "{a = " * 3000 + "1" + "}" * 3000,
        "a." * 3000 + "a = 1",
        "[" + "a." * 100_000 + "a]",
        '"a" . ' * 3000 + "a = 1",
    ],
)  # bad input 13
def test_deep_nesting(text, tmp_path):
    error = refused(text, tmp_path)
    assert error.code == "E-TOML" and "32" in error.limit


def test_too_long_a_file(tmp_path):  # bad input 13
    error = refused("# " + "x" * 1_000_000, tmp_path)
    assert error.code == "E-FILE" and "1000000 bytes" in error.limit


def test_syntax_error_with_line_and_column(tmp_path):
    error = refused("title = 'a'\n[set\nplanets = 3\n", tmp_path)
    assert error.code == "E-TOML" and "line 2, column 5" in str(error)


@pytest.mark.parametrize(("text", "line"), [("x = [\n", 1), ('a = 1\nx = """\nb\n', 2), ("[set]\nx =", 2)])
def test_what_is_open_at_the_end_of_the_file(tmp_path, text, line):
    error = refused(text, tmp_path)
    assert error.code == "E-TOML" and f"entry in line {line}," in error.remedy


def test_a_case_cut_off_anywhere_is_read_or_refused():
    refusals = 0
    for end in range(0, len(TEXT), 5):
        try:
            case_text.parse(TEXT[:end], "cut.toml")
        except CaseError as error:
            refusals += error.code == "E-TOML"
    assert refusals > len(TEXT) / 50


def test_leading_zero(tmp_path):  # bad input 8
    error = refused(replaced("teeth = 27", "teeth = 027"), tmp_path)
    assert error.code == "E-TOML" and "leading zeros" in error.remedy


@pytest.mark.parametrize(
    ("written", "remedy"),
    [
        ("27,5", "use a decimal point"),
        ("-0,3  # shift", "use a decimal point"),
        ("\u201c3 mm\u201d", "straight quotation marks"),
        ("\u201e3 mm\u201c", "straight quotation marks"),
        ('"3 mm\u201d', "straight quotation marks"),
        ('"3 mm', "close the quotation mark"),
        ('"1,5\u201d" 3', "stand in quotation marks"),
        ("3 mm  # \u201cnot 1,5\u201d", "stand in quotation marks"),
    ],
)
def test_slips_of_the_keyboard_are_named(written, remedy, tmp_path):
    error = refused(replaced("teeth = 27", f"teeth = {written}"), tmp_path)
    assert error.code == "E-TOML" and remedy in error.remedy


def test_empty_file(tmp_path):  # bad input 15
    assert "empty" in refused(" \n\n", tmp_path).message


@pytest.mark.parametrize("path", ["/dev/zero", "/dev/null", "."])  # bad input 15
def test_devices_and_folders(path):
    if not os.path.exists(path):
        pytest.skip(f"no {path} here")
    with pytest.raises(CaseError) as info:
        read_case(path)
    assert info.value.code == "E-FILE" and info.value.exit_code == 2


def test_a_pipe_does_not_block(tmp_path):  # bad input 15
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(CaseError, match="not a regular file"):
        read_case(tmp_path / "pipe")


def test_missing_file_and_symlink_loop(tmp_path):  # bad input 16
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    for name in ("absent.toml", "loop", "nul\0"):
        with pytest.raises(CaseError) as info:
            read_case(tmp_path / name)
        assert info.value.code == "E-FILE"


def test_names_with_control_characters_stay_on_one_line(tmp_path):
    with pytest.raises(CaseError) as info:
        read_case(tmp_path / "a\nb\x1b[31m.toml")
    first, *rest = str(info.value).split("\n")
    assert "\x1b" not in first and rest == ["  remedy:  check its name and permissions"]
    error = refused(TEXT + '\n["x\\ny\\u001b"]\na = 1\n', tmp_path)
    assert "\x1b" not in str(error) and "x\\ny" in error.key


def test_a_newer_format_is_refused(tmp_path):  # bad input 17
    error = refused(replaced("format = 1", "format = 2\nunheard_of = 1"), tmp_path)
    assert error.code == "E-FORMAT" and error.value == 2 and "update femgear" in error.remedy


# --- units and values ----------------------------------------------------------------------------

WRONG = [
    # key, value, code, part of the message
    ("sun.module", "0 mm", "E-RANGE", "0.05 mm to 100 mm"),  # 19
    ("sun.module", "-1.5 mm", "E-RANGE", "0.05 mm to 100 mm"),  # 19
    ("sun.module", 1.5, "E-UNIT", '"1.5 mm"'),  # 20
    ("sun.module", "1.5", "E-UNIT", "needs its unit"),  # 20
    ("sun.module", "1.5 m", "E-RANGE", "0.001"),  # 20
    ("sun.module", "1.5 kg", "E-UNIT", "not a unit of length"),  # 20
    ("sun.module", "1,5 mm", "E-UNIT", "decimal point"),
    ("sun.module", "1.5 milimetre", "E-UNIT", "unknown unit"),
    ("sun.module", "1.5 mm**9**9**9**9", "E-UNIT", "not a product of units"),
    ("sun.module", "1.5 __import__('os')", "E-UNIT", "not a product of units"),
    ("sun.module", "mm 1.5", "E-UNIT", "start with a number"),
    ("set.face_width", "0 mm", "E-RANGE", "0.1 mm"),  # 28
    ("set.face_width", "25 m", "E-RANGE", "0.001"),  # 20
    ("material.youngs_modulus", "206000 Pa", "E-RANGE", "1e+06"),  # 21
    ("material.youngs_modulus", "206 MPa", "E-RANGE", "1000"),  # 21
    ("material.youngs_modulus", "206 kg/m^3", "E-UNIT", "modulus"),
    ("material.density", "7.85 kg/m^3", "E-RANGE", "1000"),  # 21
    ("sun.pressure_angle", "20 rad", "E-RANGE", "degrees and radians"),  # 21
    ("sun.pressure_angle", "0.349 deg", "E-RANGE", "degrees and radians"),  # 21
    ("sun.pressure_angle", 20, "E-UNIT", '"20 deg"'),  # 21
    ("sun.pressure_angle", "20 %", "E-UNIT", ""),
    ("sun.pressure_angle", "0 deg", "E-RANGE", "5 deg to 45 deg"),  # 30
    ("sun.pressure_angle", "90 deg", "E-RANGE", "5 deg to 45 deg"),  # 30
    ("operation.speeds", ["5 Hz"], "E-UNIT", "rad/s"),  # 21: 5 Hz are not 5 rad/s
    ("operation.speeds", ["250 rpm", 3100], "E-UNIT", "operation.speeds[1]"),  # 21
    ("operation.speeds", ["0 rpm"], "E-RANGE", "0.001 rpm"),
    ("operation.speeds", ["250 rpm", "250 rpm"], "E-DUPLICATE", "twice"),
    ("operation.speeds", [], "E-TYPE", "empty"),
    ("operation.speeds", "250 rpm", "E-TYPE", "list"),
    ("operation.speeds", {"from": "1 rpm", "to": "2 rpm", "count": 10**9}, "E-RANGE", "100000"),
    ("operation.torque", "100 N m/rad", "E-UNIT", "not a unit of torque"),
    ("motor.coupling_stiffness", "400 N m", "E-UNIT", "torsional stiffness"),
    ("material.poisson_ratio", 0.5, "E-RANGE", "incompressible"),  # 22
    ("material.poisson_ratio", 0.6, "E-RANGE", "below 0.5"),  # 22
    ("material.poisson_ratio", -1, "E-RANGE", "above -1"),  # 22
    ("material.poisson_ratio", "0.3", "E-TYPE", "without quotes"),
    ("material.poisson_ratio", True, "E-TYPE", "true or false"),
    ("sun.teeth", 2.5, "E-TYPE", "whole number"),  # 26
    ("sun.teeth", 27.0, "E-TYPE", "whole number"),  # 26
    ("sun.teeth", True, "E-TYPE", "whole number"),  # 26
    ("sun.teeth", "27", "E-TYPE", "without quotes"),  # 26
    ("sun.teeth", -27, "E-RANGE", "5 to 5000"),
    ("sun.teeth", 0, "E-RANGE", "5 to 5000"),
    ("ring.teeth", 1_000_000, "E-RANGE", "4000 unknowns"),  # 27
    ("dynamics.damping_ratio", -0.05, "E-RANGE", "from 0"),  # 29
    ("set.backlash", "-0.1 mm", "E-RANGE", "0 mm"),  # 43
    ("set.planets", 0, "E-RANGE", "1 to 1000"),  # 47
    ("set.planets", 2.5, "E-TYPE", "whole number"),  # 47
    ("set.planet_angles", ["0 deg", "120 deg"], "E-COUNT", "3 angles"),  # 48
    ("set.planet_angles", [0, 120, 240], "E-UNIT", "set.planet_angles[1]"),  # 48
    ("set.planet_angles", ["0 rad", "120 rad", "240 rad"], "E-RANGE", "degrees and radians"),  # 48
    ("operation.fixed", "sun", "E-MECHANISM", "both driven and held"),  # 49
    ("operation.fixed", "planet", "E-CHOICE", "'carrier'"),  # 49
    ("ring.foundation_tangential", "0 N/m^3", "E-MECHANISM", "turning"),  # 49
    ("static.contact", "hertz", "E-CHOICE", "line_of_action"),
    ("dynamics", {"mesh_harmonics": 6, "response_harmonics": 5}, "E-RANGE", "12 or more"),
    ("dynamics", {"mesh_harmonics": 6, "up_to": "20 kHz"}, "E-RANGE", "given twice"),
    ("dynamics", {"response_harmonics": 18}, "E-RANGE", "together with dynamics.mesh_harmonics"),
    ("dynamics.up_to", "300 kHz", "E-RANGE", "200000 Hz"),
    ("housing", {"form": "linear", "points": 55}, "E-SYMMETRY", "multiple of 3"),
    ("housing.form", "hat", "E-CHOICE", "'linear'"),
    ("dynamics.damping_ratio", math.nan, "E-FINITE", "dynamics.damping_ratio"),  # 10
    pytest.param("dynamics.damping_ratio", 10**5000, "E-RANGE", "too long", id="5000 digits"),  # 12
    pytest.param("sun.teeth", 10**1000, "E-RANGE", "5 to 5000", id="1000 digits"),  # 12
    ("sun.teeth", np.bool_(True), "E-TYPE", "whole number"),  # 26
    ("sun.teeth", np.float64(27), "E-TYPE", "whole number"),  # 26
    ("sun.teeth", object(), "E-TYPE", "object"),
    ("title", "two\nlines", "E-RANGE", "printable"),
    ("title", 3, "E-TYPE", "text"),
    ("sun", 3, "E-TYPE", "[sun]"),
    ("sun.modul", "1.5 mm", "E-KEY-UNKNOWN", "module?"),
    ("sun.tip.diameter", "1.5 mm", "E-KEY-UNKNOWN", "tip_diameter"),
    ("title.x", 1, "E-TYPE", "not a table"),
]


@pytest.mark.parametrize(("key", "value", "code", "part"), WRONG)
def test_wrong_values(key, value, code, part):
    error = changed(key, value)
    assert error.code == code
    assert part in str(error)
    assert all(problem.key.startswith(key.split(".")[0]) for problem in getattr(error, "problems", [error]))
    if len(getattr(error, "problems", [error])) == 1:
        assert error.limit or error.remedy or error.code in ("E-TYPE", "E-DUPLICATE")


def test_fixed_member_must_be_named(tmp_path):  # bad input 49
    error = refused(replaced('fixed = "ring"\n', ""), tmp_path)
    assert error.key == "operation.fixed" and "sun or ring or carrier" in error.remedy


def test_a_date_is_named_as_such(tmp_path):  # bad input 9
    error = refused(replaced('torque = "100 N m"', "torque = 2026-01-01"), tmp_path)
    assert error.code == "E-TYPE" and "date" in str(error)


# --- messages that say what the file says ----------------------------------------------------------


def test_an_angle_beyond_a_turn_is_not_taken_for_radians():
    error = changed("housing.sensor_angle", "480 deg")
    assert error.code == "E-RANGE" and error.remedy is None and error.limit == "-360 deg to 360 deg"
    assert "rad would be plausible" in changed("sun.pressure_angle", "0.35 deg").remedy
    assert "deg would be plausible" in changed("sun.pressure_angle", "20 rad").remedy


def test_numbers_that_are_not_finite_are_shown_with_their_lines(tmp_path):
    text = replaced("damping_ratio = 0.05", "damping_ratio = 1e999").replace("tolerance = 1e-6", "tolerance = nan")
    error = refused(text, tmp_path)
    lines = text.splitlines()
    first, second = (1 + next(i for i, t in enumerate(lines) if t.startswith(k)) for k in ("damping", "tolerance"))
    assert error.code == "E-FINITE" and error.value == math.inf
    assert error.file.endswith(f":{first}") and f"dynamics.tolerance (line {second})" in str(error)


def test_integers_are_shown_as_numbers(tmp_path):
    assert "found:   4\n" in str(changed("sun.teeth", 4))
    assert "found:   99\n" in str(refused(replaced("format = 1", "format = 99"), tmp_path))


@pytest.mark.parametrize(
    ("speeds", "remedy"),
    [
        (["100 rpm", "0 rpm"], "a negative torque loads the other flanks"),
        ({"from": "-5 rpm", "to": "100 rpm", "count": 3}, "give speeds above zero"),
        ([f"{speed} rpm" for speed in range(1, 100_002)], "leave some out"),
        ({"from": "1 rpm", "to": "2 rpm", "count": 100_001}, "take fewer"),
        ({"from": "1 rpm", "to": "2 rpm", "count": 1}, "a single speed stands in a list"),
    ],
)
def test_refused_speeds_come_with_what_to_do(speeds, remedy):
    error = changed("operation.speeds", speeds)
    assert error.code == "E-RANGE" and remedy in error.remedy


def test_empty_orders_and_entries_that_are_no_tables(tmp_path):
    error = refused(replaced("orders = [105, 111]", "orders = []"), tmp_path)
    assert error.code == "E-RANGE" and "0 entries are too few" in str(error) and "Tuple" not in str(error)
    error = refused(TEXT.split("[[housing.published]]")[0] + "published = [3]\n", tmp_path)
    assert "[[housing.published]]" in error.remedy


@pytest.mark.parametrize("torque", ["1e-300 N m", "-9e-7 N m"])
def test_a_torque_of_next_to_nothing(torque):
    assert changed("operation.torque", torque).code == "E-RANGE"


def test_the_joining_depth_has_a_least_value():
    assert changed("static.depth", "1e-9 mm").limit == "0.001 mm to 100 mm"


def test_several_entries_change_at_once():
    """Input and fixed member cannot be swapped one by one: half way one member is both."""
    case = read_case(CASE)
    with pytest.raises(CaseError, match="E-MECHANISM"):
        with_value(case, "operation.fixed", case.operation.input)
    swapped = {"operation.input": "ring", "operation.fixed": "sun"}
    changed = with_values(case, swapped)
    assert (changed.operation.input, changed.operation.fixed) == ("ring", "sun")
    assert with_values(case, {}).source == with_value(case, "title", case.title).source
    assert with_values(case, {"operation.torque": "50 N m"}) == with_value(case, "operation.torque", "50 N m")
    with pytest.raises(CaseError, match="E-KEY-UNKNOWN"):
        with_values(case, swapped | {"operation.speed": "1 rpm"})


@pytest.mark.parametrize("open_shifts", [("ring",), ("sun",), ("sun", "ring")])
def test_largest_root_radius_is_accepted_as_printed(open_shifts):
    """The limit holds for all gears, with the shifts that close the set, and is rounded down."""
    changes = {"sun.pressure_angle": "25 deg"}
    changes |= {f"{name}.profile_shift": None for name in open_shifts}
    changes |= {"sun.tip_diameter": None, "planet.tip_diameter": None}
    case = with_values(read_case(CASE), changes)
    with pytest.raises(GeometryError, match="E-ROOT-RADIUS") as caught:
        planetary_set(case)
    limit = float(re.search(r"<= ([0-9.]+) modules", caught.value.limit)[1])
    assert _root_radius_code(case, limit) not in ("E-ROOT-RADIUS", "E-FILLET")
    assert _root_radius_code(case, limit + 1e-4) in ("E-ROOT-RADIUS", "E-FILLET")


def _root_radius_code(case, value):
    try:
        planetary_set(with_value(case, "rack.root_radius", value))
    except GeometryError as error:
        return error.code
    return None


@pytest.mark.parametrize("ending", [".rexs", ".REXSZ"])
def test_a_rexs_file_is_to_be_imported(ending, tmp_path):
    with pytest.raises(CaseError) as error:
        read_case(tmp_path / f"unit{ending}")
    assert error.value.code == "E-FILE" and "femgear import" in error.value.remedy


def test_published_lines_that_are_not_computed_are_left_out_where_that_is_asked():
    changed = TEXT.replace('"3100 rpm"', '"3090 rpm"', 1)
    with pytest.raises(CaseError, match="this speed is not computed"):
        parse_case(changed)
    case = parse_comparable(changed)
    assert len(case.housing.published) < len(parse_case(TEXT).housing.published)
    assert any("are left out" in notice.text for notice in case.notices)
    assert parse_comparable(TEXT).source == TEXT
    with pytest.raises(CaseError, match="E-"):
        parse_comparable(changed.replace("planets = 3", "planets = 0"))
