"""Case files that would take long, or much memory, to refuse: each is refused within a second of CPU time."""

import os
import re
from pathlib import Path

import numpy as np
import pytest

from femgear.case.text import check_tree, dotted, parse, read_text
from femgear.errors import MOST_SHOWN, CaseError, GeometryError
from femgear.trains.reading import parse_case, read_case
from femgear.trains.registry import train_of
from validation.soak.trials import metered

CASES = Path(__file__).resolve().parents[2] / "cases"
SET = (CASES / "planetary_27_40_108.toml").read_text(encoding="utf-8")
SECONDS, MEGABYTES = 1.0, 100.0


def refused(text: str, name: str = "case.toml") -> CaseError:
    """The refusal of a text, asserted to come soon and to be short: the fastest of three, other work slows one."""
    for _ in range(3):
        with metered(5.0) as meter, pytest.raises(CaseError) as caught:
            parse_case(text, name=name)
        if meter.seconds < SECONDS:
            break
    shown = str(caught.value)
    assert meter.seconds < SECONDS and meter.megabytes < MEGABYTES and len(shown) < 5000
    assert len(re.findall(r"^\[E-", shown, re.MULTILINE)) <= 1 + MOST_SHOWN
    return caught.value


def many(count: int, line: str) -> str:
    """So many lines with their numbers."""
    return "".join(line.format(i=i) + "\n" for i in range(count))


def letters(i: int) -> str:
    """A number in letters, as a name of a unit has them."""
    return "".join("abcdefghij"[int(digit)] for digit in str(i))


@pytest.mark.parametrize(
    ("text", "code"),
    [
        (many(30_000, "[[sun.modifications]]"), "E-RANGE"),
        ('model = "drivetrain"\n' + many(300, "[[parallel]]"), "E-KEY-MISSING"),
        ("[[planet.individual]]\n" + many(5_000, "[[planet.individual]]"), "E-RANGE"),
        (many(900, "[[planet.individual]]\nk{i} = 1\nl = 1\nm = 1\nn = 1\no = 1\np = 1"), "E-CASE"),
        (many(900, "[[housing.published]]\norders = []"), "E-CASE"),
        ("a = [\n" + " " * 30_000, "E-TOML"),
        ("x\n" + (" " * 3_000 + "\n") * 9 + "a = [\n" + " " * 30_000, "E-TOML"),
        (many(15_000, "[[k{i}]]") + "a = [", "E-TOML"),
        (many(50_000, "[k{i}]"), "E-RANGE"),
        (many(900, "k{i} = nan"), "E-FINITE"),
        ("k = [" + "nan, " * 100_000 + "]", "E-FINITE"),
        ("[" + "k" * 200_000 + "]\na = [" + "nan, " * 20_000 + "]", "E-FINITE"),
        ("[" + "k" * 200_000 + "]\n" + many(900, "k{i} = 1"), "E-CASE"),
        ("k = [" + "1, " * 130_000 + "]", "E-RANGE"),
        (many(13_000, "a{i}." + "a." * 30 + "b = 1"), "E-TOML"),
        ("title = [" + "1, " * 119_000 + "]", "E-CASE"),
        ("[sun]\nmodifications = [" + "1, " * 60_000 + "]", "E-CASE"),
        ("[operation]\nspeeds = [" + ", ".join(f'"1 z{letters(i)}"' for i in range(40_000)) + "]", "E-CASE"),
        ("[set]\nplanet_angles = [" + ", ".join(f'"1 z{letters(i)}"' for i in range(40_000)) + "]", "E-CASE"),
        ("[sun]\n" + "k" * 900_000 + " = 1", "E-CASE"),
        ('# """\nx = """\n' + many(20_000, "a = 1") + '"""\na = 1\na = 1', "E-TOML"),
        ("\n" * 990_000 + "k = 1", "E-CASE"),
        ("#\n" * 490_000 + "k = 1", "E-CASE"),
    ],
    ids=range(23),
)
def test_what_takes_long_to_refuse(text, code):
    assert refused(text).code == code


def test_a_limit_that_is_searched_for_is_told_soon():
    """The largest rounding of a tool that fits three gears, the ring cut far too deep."""
    text = (CASES / "nrel_pgb.toml").read_text(encoding="utf-8")
    text = text.replace("teeth = 68\nprofile_shift = 0.0", "teeth = 68\nprofile_shift = -1")
    # more than fits any cutter of this ring: below 0.3 modules the nearest that can make it is taken
    text = text.replace("root_radius = 0.2", "root_radius = 0.38")
    case = parse_case(text.replace("profile_shift = 0.0\n", "", 1))
    with metered(5.0) as meter, pytest.raises(GeometryError, match="E-ROOT-RADIUS") as caught:
        train_of(case).describe_case(case)
    assert meter.seconds < SECONDS
    assert "nor does any other" not in caught.value.message and "<= 0.29" in caught.value.limit


def test_limits_of_a_text_are_those_that_its_refusal_names():
    """What is allowed is read; one more is refused."""
    for most, text, limit in (
        (1_000, lambda n: many(n, "[[a]]"), "1000 of a table"),
        (1_000, lambda n: "[a]\n" + many(n, "k{i} = 1"), "1000 of a table"),
        (120_000, lambda n: f"a = [{'1,' * (n - 1)}]", "120000 of all together"),
        (100, lambda n: many(n, "a.b.c.d.e.f.g.k{i} = 1"), "32 levels"),
        (
            30_000,
            lambda n: "".join(many(1_000, f"[[a{j}]]") for j in range(n // 1000)) + many(n % 1000, "[b{i}]"),
            "30000 keys",
        ),
    ):
        parse(text(most), "case.toml")
        with pytest.raises(CaseError, match=limit):
            parse(text(most + 1), "case.toml")


def test_the_first_of_many_mistakes_are_shown_with_their_number():
    error = refused(SET + many(500, '[[set.pin_errors]]\nplanet = 999\nradial = "1 um"'))
    assert f": 999 problems, the first {MOST_SHOWN} of them\n" in str(error) and len(error.problems) == 999
    error = refused(SET + many(500, "[[set.pin_errors]]\nplanet = 'x'\nradial = 1"))
    assert f": 1000 problems, the first {MOST_SHOWN} of them\n" in str(error)
    assert "set.pin_errors[0].planet" in str(error) and error.problems[0].file == f"case.toml:{SET.count(chr(10)) + 2}"
    error = refused("k = [" + "nan, " * 20 + "]")
    assert "nor is k[9] (line 1), nor are 10 others" in str(error)


def test_published_lines_are_so_many():
    published = '[[housing.published]]\nspeed = "7 rpm"\nharmonic = 1\norders = [1]\nsource = "x"'
    speeds = re.sub(r"(?m)^speeds = .*", 'speeds = { from = "1 rpm", to = "9 rpm", count = 30000 }', SET)
    assert refused(speeds + many(600, published)).key == "housing.published"
    assert refused(speeds + many(97, published)).code == "E-PUBLISHED"


@pytest.mark.parametrize("name", ["a" + "_" * 130_000 + "a", "a" + " " * 130_000 + "a"])
def test_a_heading_that_takes_long(name, tmp_path):
    (tmp_path / "table.csv").write_text(f"{name},deviation [um]\n1,1\n2,2\n")
    table = '[[sun.modifications]]\nkind = "measured profile"\nfile = "table.csv"\n'
    error = refused(SET + table, str(tmp_path / "case.toml"))
    assert error.code == "E-FILE" and "no known name" in str(error)


def test_a_file_that_is_named_many_times(tmp_path):
    points = "".join(f"{10 + i / 1000},{i % 7}\n" for i in range(2000))
    (tmp_path / "table.csv").write_text("roll angle [deg],deviation [um]\n" + points)
    table = '[[sun.modifications]]\nkind = "measured profile"\nfile = "table.csv"'
    assert refused(SET + many(900, table), str(tmp_path / "case.toml")).code == "E-RANGE"


def test_usual_cases_are_far_from_the_limits():
    for path in sorted(CASES.glob("*.toml")):
        with metered(5.0) as meter:
            read_case(path)
        assert meter.seconds < SECONDS


def test_a_system_that_always_waits_for_files_reads_them(tmp_path, monkeypatch):
    """Windows has no O_NONBLOCK."""
    monkeypatch.delattr(os, "O_NONBLOCK")
    path = tmp_path / "case.toml"
    path.write_text("a = 1\n")
    assert read_text(path) == "a = 1\n"


def test_tables_without_toml_form_are_refused_by_name():
    tables = parse(SET, "")
    number = np.int64(tables["sun"]["teeth"])
    assert read_case({**tables, "sun": {**tables["sun"], "teeth": number}}) == read_case(SET)
    for wrong in (None, b"27", {27}, np.complex128(1j), np.array([None]), np.datetime64("2000-01-01")):
        with pytest.raises(CaseError) as caught:
            read_case({**tables, "sun": {**tables["sun"], "teeth": wrong}})
        assert (caught.value.code, caught.value.key) == ("E-TYPE", "sun.teeth")
    endless: list = []
    endless.append(endless)
    for loop in ({"sun": tables}, {"speeds": endless}):
        tables["sun"] = tables
        with pytest.raises(CaseError, match="nested too deeply"):
            read_case(loop)


# Limits of a case text: what they allow is read, one more is limit_of_refusal.


# the table of the file and the number are the first and the last level
DEEP = {
    "lists": lambda levels: "a = " + "[" * (levels - 2) + "1" + "]" * (levels - 2),
    "tables": lambda levels: "[" + ".".join(["a"] * (levels - 2)) + "]\nb = 1",
}


def limit_of_refusal(text, code):
    with pytest.raises(CaseError) as caught:
        parse(text, "case.toml")
    assert caught.value.code == code
    return caught.value.limit


@pytest.mark.parametrize("line", ["[[a]]\n", "[k{i}]\n", "k{i} = 1\n"], ids=["list of tables", "tables", "numbers"])
def test_entries_of_a_table_or_list_of_tables(line):
    lines = [line.format(i=i) for i in range(1001)]
    read = parse("".join(lines[:1000]), "")
    assert len(read.get("a", read)) == 1000
    assert "at most 1000 of a table" in limit_of_refusal("".join(lines), "E-RANGE")


@pytest.mark.parametrize("other", [0, 50_000])
def test_entries_of_all_lists_together(other):
    """The lists are entries themselves."""
    data = {"a": [1] * (119_998 - other), "b": [1] * other}
    assert check_tree(data, "") == []
    data["a"].append(1)
    with pytest.raises(CaseError, match="too many") as caught:
        check_tree(data, "")
    assert "120000 of all together" in caught.value.limit


def test_keys():
    assert limit_of_refusal("b = 1\n" * 30_001, "E-RANGE") == "30000 keys and tables"
    # repeated, and only therefore limit_of_refusal
    limit_of_refusal("b = 1\n" * 30_000, "E-TOML")


@pytest.mark.parametrize("part", ["a", '"a b"', "'a'"])
def test_long_keys(part):
    """Of eight parts, seven of which end in a dot."""
    lines = [".".join([part] * 7) + f".k{i} = 1\n" for i in range(101)]
    parse("".join(lines[:100]), "")
    assert limit_of_refusal("".join(lines), "E-TOML") == "32 levels"
    # six dots are no long key
    parse("".join(line.replace(part + ".", "", 1) for line in lines), "")


@pytest.mark.parametrize("kind", DEEP)
def test_levels(kind):
    parse(DEEP[kind](32), "")
    assert limit_of_refusal(DEEP[kind](33), "E-TOML") == "32 levels"


def test_bytes_of_a_file(tmp_path):
    path = tmp_path / "case.toml"
    path.write_bytes(b"#" * 1_000_000)
    assert len(read_text(path)) == 1_000_000
    path.write_bytes(b"#" * 1_000_001)
    with pytest.raises(CaseError, match="too long") as caught:
        read_text(path)
    assert caught.value.limit == "1000000 bytes"


def test_characters_of_a_key_that_are_shown():
    assert dotted(("a" * 200, 3, "b" * 201)) == "a" * 200 + "[3]." + "b" * 200
