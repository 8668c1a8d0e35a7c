"""Entries of a sweep that go together: how they are written, what is computed, what is refused."""

import csv
from pathlib import Path

import pytest
from script_runs import run_femgear

from femgear.errors import CaseError
from femgear.study.objectives import contact_ratio
from femgear.study.sweep import parse_over, sweep
from femgear.trains.reading import read_case, with_values

CASE = Path(__file__).resolve().parents[2] / "cases" / "planetary_27_40_108.toml"
TEETH = "sun.teeth", "planet.teeth", "ring.teeth"
FREE = {
    "set.centre_distance": None,
    "sun.tip_diameter": None,
    "planet.tip_diameter": None,
    "ring.tip_diameter": None,
    "sun.profile_shift": 0.0,
    "planet.profile_shift": 0.0,
    "ring.profile_shift": 0.0,
}


@pytest.fixture(scope="module")
def free():
    """Gears without shift, whose centre distance follows from their teeth."""
    return with_values(read_case(CASE), FREE)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("sun.teeth=27,30", ("sun.teeth", [27, 30])),
        ("sun.teeth, planet.teeth = 27/40, 30/39", (("sun.teeth", "planet.teeth"), [(27, 40), (30, 39)])),
        ("a,b=1e8 N/m/2e8 N/m,0 N/m/-1 N/m", (("a", "b"), [("1e8 N/m", "2e8 N/m"), ("0 N/m", "-1 N/m")])),
        ("a,b=0 um..3 um/3", (("a", "b"), [("0 um", "0 um"), ("1.5 um", "1.5 um"), ("3 um", "3 um")])),
        ("a,b=fixed/true,elastic/false", (("a", "b"), [("fixed", True), ("elastic", False)])),
    ],
)
def test_words_of_entries_that_go_together(text, expected):
    assert parse_over(text) == expected


@pytest.mark.parametrize("text", ["a,b=1,2", "a,b=1/2/3", "a,=1/2", "a,b=1/,2/3"])
def test_values_have_a_part_for_every_entry(text):
    with pytest.raises(CaseError, match="E-VARIABLE") as info:
        parse_over(text)
    assert info.value.limit and info.value.remedy and info.value.key == "--over"


def test_teeth_that_go_together_are_one_case_each(free, tmp_path):
    sets = [(27, 40, 107), (30, 40, 110), (27, 39, 105)]
    over = {TEETH: sets, "operation.torque": ["50 N m", "60 N m"]}
    found = sweep(free, over, [contact_ratio("sun-planet")], journal=tmp_path / "sweep.jsonl")
    assert found.keys == (*TEETH, "operation.torque") and len(found.points) == 6
    assert found.points[2] == (30, 40, 110, "50 N m")
    for point, values in zip(found.points, found.values, strict=True):
        alone = sweep(
            with_values(free, dict(zip(found.keys, point, strict=True))),
            {"sun.teeth": [point[0]]},
            [contact_ratio("sun-planet")],
        )
        assert values == pytest.approx(alone.values[0], rel=1e-12) or (values != values).all()
    again = sweep(free, over, [contact_ratio("sun-planet")], journal=tmp_path / "sweep.jsonl")
    assert again.computed == 0


def test_the_command_writes_a_column_for_every_entry(free, tmp_path):
    (tmp_path / "case.toml").write_text(free.source, encoding="utf-8")
    over = f"{','.join(TEETH)}=27/39/105,30/39/108"
    words = ("--over", over, "--of", "contact ratio sun-planet", "-o", "out")
    done = run_femgear("sweep", "case.toml", *words, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    with open(tmp_path / "out" / "sweep.csv", newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert [[row[key] for key in TEETH] for row in rows] == [["27", "39", "105"], ["30", "39", "108"]]
    assert all(float(row["contact ratio, sun-planet [1]"]) > 1.5 for row in rows)
    assert (tmp_path / "out" / "sweep.png").stat().st_size > 5000
