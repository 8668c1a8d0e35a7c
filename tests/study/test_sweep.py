"""Entries of a sweep that go together: how they are written, what is computed, what is refused."""

import csv
from pathlib import Path

import numpy as np
import pytest
from script_runs import run_femgear
from small_gearbox import pair_tables

from femgear.case.dependencies import Steps
from femgear.errors import CaseError
from femgear.study.objectives import contact_ratio, named_quantity
from femgear.study.sweep import parse_over, sweep, sweep_into
from femgear.trains.live import Answer
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


@pytest.fixture
def box():
    """A gearbox whose meshes have a stiffness: no contact to solve."""
    return read_case(pair_tables())


def test_a_gearbox_is_swept_over_its_bearings_with_its_key_figures(box, tmp_path):
    over = ["bearing[0].radial=1e8 N/m,2e8 N/m", "operation.load_case[0].torque.motor=50 N m,100 N m"]
    of = ["bearing force A", "misalignment", "natural frequency 3"]
    swept, names = sweep_into(box, tmp_path / "out", over=over, of=of)
    assert not any(swept.errors) and {*names} == {path.name for path in (tmp_path / "out").glob("sweep.*")}
    direct = Answer(with_values(box, dict(zip(swept.keys, swept.points[2], strict=True))), Steps())
    force = direct.deflection.contents()
    assert swept.values[2, 0] == pytest.approx(
        np.hypot(*(force[f"{w}_force"].values[0, 0] for w in ("radial", "axial")))
    )
    assert swept.values[2, 2] == pytest.approx(direct.modes.modes.frequency[2])
    # twice the torque, twice the force of a linear gearbox
    assert swept.values[[1, 3], :2] == pytest.approx(2.0 * swept.values[[0, 2], :2], rel=1e-6)
    again, _ = sweep_into(box, tmp_path / "out", over=over, of=of)
    assert again.computed == 0 and (again.values == swept.values).all()


def test_quantities_that_a_gearbox_has_not_are_refused_by_name(box, tmp_path):
    for words, code, remedy in (
        ("ste", "E-OBJECTIVE", None),
        ("bearing forse A", "E-OBJECTIVE", "did you mean bearing force A?"),
    ):
        with pytest.raises(CaseError, match=code) as info:
            sweep_into(box, tmp_path, over=["bearing[0].radial=1e8 N/m,2e8 N/m"], of=[words])
        assert remedy is None or info.value.remedy == remedy
    assert not [*tmp_path.iterdir()]
    with pytest.raises(CaseError, match="E-STAGE"):
        named_quantity("run-up force factor", case=read_case(pair_tables(teeth=True)))


@pytest.mark.parametrize("count", [1, 3, 4, 5])
def test_any_number_of_quantities_is_drawn(box, tmp_path, count):
    of = ["misalignment", "mesh force", "bearing force", "bearing force A", "bearing force B"][:count]
    sweep_into(box, tmp_path, over=["bearing[0].radial=1e8 N/m,2e8 N/m"], of=of)
    assert (tmp_path / "sweep.png").stat().st_size > 5000
