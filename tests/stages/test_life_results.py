"""Tables, rows of a verdict and findings on lives."""

import math

import pytest
import xarray as xr

from femgear.findings import Finding
from femgear.report.tables import Marks
from femgear.stages.life_results import (
    LIFE_FIGURES,
    describe_damage,
    describe_life,
    hours_text,
    life_findings,
    life_rows,
)


@pytest.fixture
def data():
    """Two roots, one of which fails early, and a flank without damage, over two load cases."""
    both = ("load_case", "root"), ("load_case", "flank")
    return xr.Dataset(
        {
            "share": ("load_case", [0.1, 0.9]),
            "root_life": ("root", [5000.0, 400.0]),
            "root_damage": ("root", [0.2, 2.5]),
            "root_spectrum_safety": ("root", [1.3, 0.9]),
            "root_equivalent_torque": ("root", [90.0, 90.0]),
            "root_damage_share": (both[0], [[1.0, 0.75], [0.0, 0.25]]),
            "root_stress_ratio": (both[0], [[0.8, 1.1], [0.3, 0.9]]),
            "root_load_cycles": (both[0], [[1e3, 1e3], [9e3, 9e3]]),
            "flank_life": ("flank", [math.inf]),
            "flank_damage": ("flank", [0.0]),
            "flank_spectrum_safety": ("flank", [1.6]),
            "flank_equivalent_torque": ("flank", [95.0]),
            "flank_damage_share": (both[1], [[0.0], [0.0]]),
            "flank_stress_ratio": (both[1], [[0.6], [0.5]]),
            "flank_load_cycles": (both[1], [[1e3], [9e3]]),
        },
        coords={"load_case": ["start", "run"], "root": ["gear 1", "gear 2"], "flank": ["gear 1"]},
    )


def test_the_verdict_names_what_fails_first_and_by_which_load_case(data):
    (finding,) = life_findings(data)
    assert finding.severity == "fault" and "gear 2" in finding.text and "75 % of the damage in start" in finding.text
    (_, life), (_, root), (_, flank) = life_rows(data, Marks([finding]))
    assert life == "400 h†, root of gear 2: 75 % of the damage in start"
    # what fails too soon is marked alone
    assert root.startswith("0.90†, root of gear 2: damage 2.5") and flank.startswith("1.60, flank of gear 1: damage 0")


def test_doubts_of_load_factors_mark_lives_and_safeties_over_them(data):
    marks = Marks([Finding("W-STIFFNESS", "", "text", stage="deflection")])
    assert all("†" in text.split(",")[0] for _, text in life_rows(data, marks, of=("deflection",)))
    assert "W-STIFFNESS" in LIFE_FIGURES[0].codes


def test_what_fails_at_once_is_told_by_its_code_and_has_no_share_of_a_damage(data):
    data["root_life"].values[1], data["root_damage"].values[1] = 0.0, math.inf
    data["root_damage_share"].values[:, 1] = 0.5, 0.5
    (finding,) = life_findings(data)
    assert (finding.code, finding.severity) == ("W-STRENGTH", "fault")
    assert "gear 2 fails at once in start, run" in finding.text
    (_, life), (_, root), _ = life_rows(data, Marks([finding]))
    assert life.startswith("0 h†, root of gear 2: fails at once in start, run") and "%" not in life
    assert root.startswith("0.90†, root of gear 2: fails at once")
    (damage,) = describe_damage(data)
    assert [row[3] for row in damage.rows] == ["fails at once", "fails at once"]
    # without a life asked for there is no damage, but what breaks is told all the same
    data["root_damage"] = ("root", [math.nan, math.nan])
    assert [finding.code for finding in life_findings(data)] == ["W-STRENGTH"]


def test_without_damage_or_a_life_asked_for_the_verdict_says_less(data):
    data = data[[name for name in data if str(name).startswith(("share", "flank"))]]
    data["flank_spectrum_safety"] = ("flank", [math.nan])
    ((_, text),) = life_rows(data, Marks(()))
    assert text.startswith("none fails") and not list(life_findings(data))
    assert not list(life_rows(xr.Dataset(), Marks(()))) and not list(describe_life(xr.Dataset()))


def test_tables_have_a_row_a_root_and_a_row_a_load_case(data):
    (lives,) = describe_life(data)
    assert [row[0] for row in lives.rows] == ["root of gear 1", "root of gear 2", "flank of gear 1"]
    assert lives.rows[1][1:3] == ("400", "2.5") and lives.rows[2][-1] == "-"
    (damage,) = describe_damage(data)
    assert [row[:2] for row in damage.rows] == [("start", "0.1"), ("run", "0.9")]
    assert "75.00 %" in damage.rows[0] and not list(describe_damage(data.isel(load_case=[0])))


def test_hours_in_words():
    assert [hours_text(value) for value in (math.inf, 0.0, 12345.6)] == ["no damage", "0", "1.235e+04"]


def test_roots_that_are_bent_both_ways_are_told_with_their_factor(data):
    assert not any(finding.code == "W-REVERSAL" for finding in life_findings(data))
    assert "Y_M, reversed" not in next(describe_life(data)).header
    data["root_reversal_factor"] = ("root", [1.0, 0.7])
    data["root_reversed"] = (("load_case", "root"), [[0, 0], [0, 1]])
    finding = next(finding for finding in life_findings(data) if finding.code == "W-REVERSAL")
    assert finding.key == "strength.reversal_factor" and finding.severity == "note"
    assert finding.text.startswith("roots of gear 2 are bent back in run: they have Y_M 0.7")
    block = next(describe_life(data))
    assert [row[block.header.index("Y_M, reversed")] for row in block.rows] == ["1", "0.7", "-"]
