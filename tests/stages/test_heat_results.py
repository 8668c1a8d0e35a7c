"""Tables and rows of temperatures, whatever they come from."""

from dataclasses import replace

import numpy as np
import pytest

from femgear.report.tables import Marks
from femgear.stages.heat_results import HeatResult, MeshHeat, describe_heat, heat_rows, heat_tables, hottest_point


def mesh(safety=2.0, film=0.4):
    """A kind of mesh with flash temperatures that rise from the pitch point to both ends."""
    path = np.linspace(-1e-2, 1e-2, 5)
    rise = 2e3 * np.abs(path) + 100.0 * (path > 5e-3)
    sliding = np.stack([path / 2e-2, -path / 1e-2])
    ones = np.ones(5)
    films = film * (1.0 + np.arange(5.0))
    return MeshHeat(
        path,
        1e5 * ones,
        1e9 * ones,
        sliding,
        ones,
        rise,
        0.9 * rise,
        films,
        (0.05, 0.06),
        (360.0, 365.0),
        650.0,
        safety,
        353.15,
    )


class Results:
    """Results of a run with temperatures."""

    stages = ("heat",)

    def __init__(self, result):
        self.heat, self.findings = result.contents(), result.findings


def result(*kinds, permissible=0.3):
    names = tuple(f"kind {number}" for number in range(len(kinds)))
    return HeatResult((kinds,), names, "load_case", ["nominal"], 353.15, permissible)


def test_tables_show_the_numbers_of_the_file():
    data = result(mesh(), mesh(safety=1.5)).contents()
    block = describe_heat(data)
    rows = [dict(zip(block.header, row, strict=True)) for row in block.rows]
    assert [row["S_B"] for row in rows] == ["2.00", "1.50"] and rows[0]["mesh"] == "kind 0"
    assert float(rows[0]["contact [°C]"]) == pytest.approx(360.0 + 120.0 - 273.15, abs=0.06)
    (table,) = heat_tables(data)
    row = dict(zip(table.header, table.rows[0], strict=True))
    assert row["hottest [mm]"] == "+10.000" and row["thinnest film [mm]"] == "-10.000"


def test_where_on_the_path_is_told_of_the_hottest_operating_point():
    cool = replace(mesh(), flash=0.5 * mesh().flash, bulk=(350.0, 355.0))
    both = HeatResult(((mesh(),), (cool,)), ("pair",), "load_case", ["full", "coasting"], 353.15, 0.3).contents()
    assert hottest_point(both) == (0, "full")
    (table,) = heat_tables(both)
    assert table.notes[0].startswith("at full;") and float(table.rows[0][3]) == pytest.approx(0.9 * 120.0)
    found = type("Results", (), {"stages": ("heat",), "heat": both})()
    assert dict(heat_rows(found, Marks(())))["hottest contact, ISO/TS 6336-20"].endswith("pair, full")


def test_rows_of_the_verdict_are_the_worst_kinds_and_marked_below_one():
    found = result(mesh(), mesh(safety=0.8, film=0.2))
    results = Results(found)
    rows = dict(heat_rows(results, Marks(results.findings)))
    assert rows["smallest scuffing safety S_B, ISO/TS 6336-20"].endswith("kind 1") and "0.80" in " ".join(rows.values())
    assert rows["smallest film safety S_lambda, ISO/TS 6336-22"].startswith("0.67")
    assert [finding.key for finding in found.findings] == ["lubricant.fzg_stage", "lubricant.permissible_film"]
    assert not list(heat_rows(type("Nothing", (), {"stages": ()})(), Marks(())))
    assert result(mesh(), permissible=np.nan).findings == ()
