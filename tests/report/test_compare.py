"""Runs compared: entries and numbers that differ, modes of one shape, and the page with all."""

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from small_gearbox import pair_tables

from femgear.report import compare
from femgear.report.tables import Block
from femgear.run import run_case
from femgear.storage.results import run_folder
from femgear.trains.reading import open_results, read_case, with_value, with_values
from femgear.trains.registry import train_of

pytestmark = pytest.mark.usefixtures("coarse_states")

CASE = Path(__file__).resolve().parents[2] / "cases" / "planetary_27_40_108.toml"


def test_entries_have_their_whole_names():
    case = {"gears": {"sun": {"teeth": 27}}, "bodies": [{"mass": 1}, {"mass": 2}], "speeds": [1, 2]}
    expected = [("gears.sun.teeth", 27), ("bodies[0].mass", 1), ("bodies[1].mass", 2), ("speeds", [1, 2])]
    assert list(compare._flat(case)) == expected


def test_entries_differ_by_what_they_say():
    case = with_value(read_case(CASE), "sun.modifications", [{"kind": "profile crowning", "amount": "5 um"}])

    def found(one, two):
        return [*compare._entries(*((one.source, one.model_dump(by_alias=True)) for one in (one, two)))]

    words = {"operation.torque": "0.1 kN m", "static.members": "fixed", "ring.teeth": -108}
    assert found(case, with_values(case, words)) == []
    other = with_values(case, {"sun.modifications[0].amount": "6 um", "operation.torque": "101 N m"})
    assert found(case, other) == [
        ("operation.torque", "100 N m", "101 N m"),
        ("sun.modifications[0].amount", "5 um", "6 um"),
    ]
    assert ("sun.modifications[0].amount", "5 um", "not given") in found(case, read_case(CASE))
    machine = {"inertia": "1 kg m^2", "coupling_stiffness": "1e6 N m/rad"}
    assert len(found(case, with_value(case, "motor", machine))) == 2
    # a range is read as its speeds
    speeds = [{"from": "1000 rpm", "to": f"{to} rpm", "count": 3} for to in (2000, 3000)]
    speeds.append(["1000 1/min", "1500 1/min", "2000 1/min"])
    one, two, three = (with_value(case, "operation.speeds", values) for values in speeds)
    assert found(one, three) == [] and len(found(two, three)) == 4
    assert found(one, two) == [("operation.speeds.to", "2000 rpm", "3000 rpm")]


def test_cells_that_differ_come_with_their_change():
    first = Block("Static", ("mesh", "STE", "form"), (("a", "2.0", "x"), ("b", "1.0", "x")))
    second = Block("Static", ("mesh", "STE", "form"), (("a", "2.5", "y"), ("b", "1.0", "x")))
    found = compare._differences(first, second)
    assert found.rows == (("mesh a", "STE", "2.0", "2.5", "+25 %"), ("mesh a", "form", "x", "y", ""))
    assert compare._differences(first, first).notes == ("the same",)
    other = Block("Static", ("mesh", "STE"), (("c", "2.0"),))
    assert "other rows" in compare._differences(first, other).notes[0]
    part = compare._differences(first, Block("Static", ("mesh", "STE", "form"), (("a", "2.5", "x"), ("c", "9", "x"))))
    assert part.rows == (("mesh a", "STE", "2.0", "2.5", "+25 %"),)
    assert part.notes == ("rows that not all runs have: b, c",)
    wider = Block("Static", ("mesh", "one way", "STE"), (("a", "9", "2.5"), ("b", "9", "1.0")))
    shared = ("mesh a", "STE", "2.0", "2.5", "+25 %")
    assert compare._differences(first, wider).rows == (shared,)


def test_levels_of_unlike_excitation_are_told():
    def table(end):
        return Block("Housing", ("speed [rpm]", "excited up to [kHz]"), (("1500", end),))

    assert "NO LIKE LEVELS" in compare._differences(table("19.60"), table("5.60")).notes[0]
    assert compare._differences(table("19.60"), table("19.50")).notes == ()


def test_a_table_without_header_is_compared_too():
    runs = (Block("Verdict", rows=(("K_v", value), ("K_gamma", "1.0"))) for value in ("1.1", "1.2"))
    assert compare._differences(*runs).rows == (("K_v", "", "1.1", "1.2", "+9.09 %"),)


def test_resonances_are_paired_by_mode_kind_and_harmonic():
    header = ("speed [rpm]", "mode", "kind", "[Hz]", "mesh harmonic", "alone [m/s²]")
    one = (("2000.0", "11", "rotational", "3137.6", "4", "60"), ("2500.0", "33", "ring", "9000.0", "3", "50"))
    two = (("2550.0", "33", "ring", "9180.0", "3", "55"), ("2600.0", "33", "ring", "9180.0", "5", "9"))
    found = compare._differences(Block("Run-up", header, one), Block("Run-up", header, two)).rows
    same = "mode 33, kind ring, mesh harmonic 3"
    assert found == (
        ("mode 11, kind rotational, mesh harmonic 4", "", "listed", "-", ""),
        (same, "speed [rpm]", "2500.0", "2550.0", "+2 %"),
        (same, "[Hz]", "9000.0", "9180.0", "+2 %"),
        (same, "alone [m/s²]", "50", "55", "+10 %"),
        ("mode 33, kind ring, mesh harmonic 5", "", "-", "listed", ""),
    )


def test_curves_lie_over_each_other_within_joint_limits():
    def chart(low, high, name):
        axis = {"title": "", "log": False, "range": [low, high]}
        return {"panels": [{"x": axis, "y": axis, "traces": [{"name": name, "y": [1.0]}], "words": [{"text": "w"}]}]}

    found = compare._overlaid(chart(0, 2, "k"), chart(-1, 1, "k"))
    panel = found["panels"][0]
    assert panel["x"]["range"] == [-1, 2] and [trace["name"] for trace in panel["traces"]] == [
        "k",
        "k, second",
    ]
    assert panel["traces"][1]["opacity"] < 1.0 and panel["words"] == []
    field = chart(0, 1, "")
    field["panels"][0]["traces"] = [{"type": "heatmap"}]
    assert compare._overlaid(field, field) is None
    json.dumps(found, allow_nan=False)


def test_a_bound_has_no_change_and_marks_keep_their_meaning():
    """More than 1 against 20.14 is no change of +1910 %; a dagger is explained of the run that has it."""
    header, meaning = (
        ("speed [rpm]", "level [m/s²]", "K_v"),
        "W-EXCITATION, doubt: it ends early",
    )
    short = Block("Levels", header, (("1000", "> 1", "1.001†"),), ("1 speed", f"† {meaning}", "‡ W-PULL, ..."))
    whole = Block("Levels", header, (("1000", "20.14", "1.058"),), ("1 speed",))
    found = compare._differences(short, whole)
    assert [row[1:] for row in found.rows] == [
        ("level [m/s²]", "> 1", "20.14", "-"),
        ("K_v", "1.001†", "1.058", "+5.69 %"),
    ]
    assert found.notes[0].startswith("-: one of both is a bound") and found.notes[1:] == (f"first: † {meaning}",)
    back = compare._differences(whole, short)
    assert back.rows[0][-1] == "-" and back.notes[-1] == f"second: † {meaning}"


def test_key_figures_of_two_runs_are_compared_by_name(tmp_path):
    case = read_case(pair_tables())
    runs = []
    for name, changed in (("a", case), ("b", with_value(case, "bearing[0].radial", "1e8 N/m"))):
        with run_folder(tmp_path / name) as place:
            run_case(changed, place, pictures=False)
        runs.append(open_results(tmp_path / name))
    blocks = {block.title: block for block in compare.compared(train_of(case), *runs)}
    answers = {row[0]: row[1:] for row in blocks[compare.ANSWERS].rows}
    assert next(iter(blocks)) == compare.ANSWERS and "Is it strong enough?" in answers
    assert all(word[0] in "✓▲✕○" for both in answers.values() for word in both)
    assert [row[0] for row in blocks["Cases"].rows] == ["bearing[0].radial"]
    rows = {row[0]: row[1:] for row in blocks["Key figures"].rows}
    slopes = [float(np.abs(run.deflection["mesh_misalignment"].values).max()) for run in runs]
    shown, other, change = rows["misalignment [um]"]
    assert [float(shown), float(other)] == pytest.approx([1e6 * slope for slope in slopes], rel=1e-4)
    assert float(change.split()[0]) == pytest.approx(100.0 * (slopes[1] / slopes[0] - 1.0), rel=1e-2)
    # the mesh force follows the torque: of the whole it stays, of parts it is left out
    assert rows["mesh force [N]"][2] == "" and "mesh force stage [N]" not in rows
    # both tables of stages, each with its own of the other run
    assert {"Meshes", "Modes", compare.MODES} <= blocks.keys()
    matched = blocks[compare.MODES].rows
    assert matched[0][0] and all(row[4] == "" or 0.5 <= float(row[4]) <= 1.0 for row in matched)
    three = {block.title: block for block in compare.compared(train_of(case), *runs, runs[0])}
    again = {row[0]: row[1:] for row in three["Key figures"].rows}
    assert again["misalignment [um]"] == (shown, other, change, shown, "")
    assert compare.compare_page(train_of(case), *runs).count("<table>") >= 4


def test_runs_under_other_loads_say_so_first(tmp_path):
    case, runs = read_case(pair_tables()), []
    for name, changed in (("a", case), ("b", with_value(case, "operation.load_case[0].speed", {"input": "900 rpm"}))):
        with run_folder(tmp_path / name) as place:
            run_case(changed, place, only="deflection", pictures=False)
        runs.append(open_results(tmp_path / name))
    first, *others = compare.compared(train_of(case), *runs)
    assert first.title == compare.OPERATION and first.rows[0][1:] == tuple(train_of(case).duty(r.case) for r in runs)
    assert first.notes == ("operation.load_case[0].speed.input differ: forces, levels and lives do by that alone",)
    alone = compare.compared(train_of(case), runs[0], runs[0])
    assert all(block.title != compare.OPERATION for block in alone) and others[0].title == compare.ANSWERS


def test_entries_that_differ_begin_with_the_operation_and_leave_out_published_values():
    rows = (("a.b", "1", "2"), ("housing.published[0].speed", "1", "2"), ("operation.torque", "1", "2"))
    block = compare._differing_entries((("title", "x", "y"), *rows), ("one", "two"))
    assert [row[0] for row in block.rows] == ["operation.torque", "a.b", "title"]
    assert block.notes == ("1 entries of published values that differ are left out",)
    assert compare._differing_entries((), ("one", "two")).notes == ("the same",)


def test_a_terminal_shows_few_rows_of_the_tables_that_decide():
    rows = tuple((f"{number}", "1") for number in range(12))
    tables = Block("Key figures", ("figure", "one"), rows), Block("Static", ("mesh", "STE"), rows[:1]), Block("Modes")
    figures, more = compare.in_brief(tables)
    assert figures.rows == rows[:10] and figures.notes == ("2 more rows by --verbose and on the page",)
    assert more.notes == ("by --verbose and on the page: Static",)
    assert compare.in_brief(tables[2:]) == ()


def test_three_tables_are_compared_with_the_first():
    tables = [Block("Static", ("mesh", "STE"), (("a", value),)) for value in ("2.0", "2.5", "> 1")]
    found = compare._differences(*tables, names=("x", "y", "z"))
    assert found.header == ("row", "column", "x", "y", "change", "z", "change")
    assert found.rows == (("mesh a", "STE", "2.0", "2.5", "+25 %", "> 1", "-"),) and "bound" in found.notes[0]
    same = [Block("Static", ("mesh", "STE"), (("a", value),)) for value in ("2.0", "2.0", "3.0")]
    assert compare._differences(*same).rows == (("mesh a", "STE", "2.0", "2.0", "+0 %", "3.0", "+50 %"),)


def modes(frequency, shape, dof=("sun: x", "sun: y", "ring: x")):
    """Contents of modes.nc, as far as shapes are matched."""
    variables = {"frequency": ("mode", frequency), "shape": (("dof", "mode"), np.array(shape, float))}
    return xr.Dataset(variables, coords={"dof": list(dof)})


def test_modes_are_matched_by_their_shapes():
    """Modes that change places are found again, and a pair of one frequency whatever its directions."""
    first = modes([0.0, 10.0, 10.0, 30.0], [[1, 1, 0, 0], [1, 0, 1, 0], [1, 0, 0, 1]])
    c, s = np.cos(0.7), np.sin(0.7)
    turned = modes([0.0, 20.0, 40.0, 40.0], [[1, 0, c, -s], [1, 0, s, c], [1, 1, 0, 0]])
    found = compare.match_modes(first, turned)
    assert {mode: other for mode, (other, _) in found.items()} == {1: 2, 2: 3, 3: 1}
    assert [alike for _, alike in found.values()] == pytest.approx([1.0] * 3)
    # units of the coordinates do not matter, as a ring in mm beside a sun in m
    scaled = turned.assign(shape=turned["shape"] * np.array([[1.0], [1.0], [1e3]]))
    assert compare.match_modes(first, scaled).keys() == {1, 2, 3}
    other = modes([10.0], [[1.0], [1.0], [1.0]])
    assert compare.match_modes(modes([10.0], [[1.0], [-1.0], [0.0]]), other) == {}
    assert compare.match_modes(first, modes([10.0], [[1.0]] * 3, ("a", "b", "c"))) == {}, "nothing in common"


def test_curves_of_three_runs_are_told_apart():
    def drawn(level):
        line = {"color": "#000000", "dash": "solid"}
        traces = [{"name": "level", "y": [level], "line": line}]
        axis = {"range": [level, level + 1.0]}
        return {"panels": [{"x": {"range": [0, 1]}, "y": axis, "traces": traces, "words": []}]}

    panel = compare._overlaid(*map(drawn, (1.0, 2.0, 3.0)), names=("x", "y", "z"))["panels"][0]
    assert [trace["name"] for trace in panel["traces"]] == ["level", "level, y", "level, z"]
    assert [trace["line"]["dash"] for trace in panel["traces"]] == ["solid", "dash", "dot"]
    assert panel["y"]["range"] == [1.0, 4.0]
    unnamed = [drawn(level) for level in (1.0, 2.0)]
    for chart in unnamed:
        chart["panels"][0]["traces"][0]["name"] = ""
    panel = compare._overlaid(*unnamed, names=("x", "y"))["panels"][0]
    assert [trace["name"] for trace in panel["traces"]] == ["x", "y"]


def test_charts_of_areas_are_not_laid_over_each_other():
    curve = {"x": [0.0, 1.0], "y": [1.0, 2.0], "name": "level"}
    area = curve | {"hoverinfo": "skip", "fill": "toself"}

    def drawn(*traces):
        return {"panels": [{"x": {"range": [0, 1]}, "y": {"range": [0, 2]}, "traces": [*traces], "words": []}]}

    both = compare._overlaid(drawn(curve), drawn(curve | {"y": [2.0, 3.0]}))
    assert [trace["name"] for trace in both["panels"][0]["traces"]] == ["level", "level, second"]
    assert compare._overlaid(drawn(area), drawn(area)) is None
