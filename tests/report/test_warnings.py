"""Warnings of cases and of results: one place gathers them, terminal and report show them once."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from femgear import cli
from femgear.findings import DOUBT, NOTE
from femgear.trains.gearbox.transient_results import describe_transient, transient_warnings
from femgear.trains.reading import open_results, read_case, with_value
from femgear.trains.registry import train_of

pytestmark = pytest.mark.usefixtures("pictures_undrawn", "coarse_states")

CASES = Path(__file__).parents[2] / "cases"


def warned(printed: str) -> list[str]:
    return [line.removeprefix("warning: ") for line in printed.splitlines() if line.startswith("warning: ")]


@pytest.mark.parametrize(
    ("name", "key", "value", "words"),
    [
        ("planetary_27_40_108", "sun.tip_diameter", "45.6 mm", "[W-CLEARANCE]"),
        ("nrel_pga", "title", "given stiffness", "[W-UNUSED] static, dynamics.mesh_harmonics"),
        ("helical_30_20_70", "operation.torque", "-10 N m", "[W-TORQUE]"),
        ("own_chain", "transient.rate", "15 kHz", "[W-RATE]"),
        ("own_chain", "modes.damping_ratio", 0.0, "[W-DAMPING]"),
    ],
)
def test_warnings_are_those_of_check(name, key, value, words):
    case = with_value(read_case(CASES / f"{name}.toml"), key, value)
    found = [str(one) for one in train_of(case).case_warnings(case)]
    assert any(text.startswith(words) for text in found) and len(set(found)) == len(found)
    assert set(found) == set(train_of(case).describe_case(case)[-1].notes)


@pytest.mark.parametrize("name", ["nrel_pga", "wind_turbine_drivetrain"])
def test_run_prints_warnings_of_the_case_once(name, tmp_path, capsys):
    case = read_case(CASES / f"{name}.toml")
    path = tmp_path / "case.toml"
    path.write_text((CASES / f"{name}.toml").read_text(encoding="utf-8"), encoding="utf-8")
    assert cli.main(["run", str(path), "-o", str(tmp_path / "out"), "--only", "modes", "--no-pictures"]) == 0
    printed = capsys.readouterr()
    assert warned(printed.err) == [str(one) for one in train_of(case).case_warnings(case)] != []
    assert "warning:" not in printed.out


@pytest.mark.slow
def test_run_and_report_say_what_results_say_against_themselves(tmp_path, capsys):
    """The rigid hammering of an undamped chain: its mesh pulls, and the step is coarse."""
    case = with_value(read_case(CASES / "own_chain.toml"), "modes.damping_ratio", 0.0)
    still = [{"load": load, "torque": "0 N m"} for load in ("motor", "fan")]
    in_time = {"duration": "0.1 s", "rate": "10 kHz", "start": "zero", "torque": still}
    case = with_value(case, "transient", in_time)
    path = tmp_path / "case.toml"
    path.write_text(case.source, encoding="utf-8")
    out = tmp_path / "out"
    assert cli.main(["run", str(path), "-o", str(out)]) == 0
    found = warned(capsys.readouterr().err)
    results = open_results(out)
    said = [str(one) for one in train_of(results.case).result_warnings(results)]
    warned_of = [str(one) for one in train_of(case).case_warnings(case)]
    assert found == [str(one) for one in results.findings] == [*warned_of, *said]
    assert len(set(found)) == len(found)
    assert any("[W-RATE]" in text for text in found) and any(
        "[W-PULL]" in text and "pulls for" in text for text in said
    )
    page = (out / "report.html").read_text(encoding="utf-8")
    warnings = page.split('<ul class="warnings">')[1].split("</ul>")[0]
    assert warnings.count("<li ") == len(found)
    for text in found:
        # quotes and angles may be escaped
        assert warnings.count(text.split("'")[0][:60]) == 1


def transient(
    *,
    growth=-3.0,
    gain=1.0,
    contact="linear",
    energy=1e-12,
    momentum=1e-14,
    pulling=0.0,
    lost=0.0,
    least=-200.0,
    settled=-200.0,
) -> xr.Dataset:
    """What the summary reads of a run of 2 s: one variant, one mesh."""
    vm, one = ("variant", "mesh"), np.ones((1, 1))
    return xr.Dataset(
        {
            "mesh_force": (("variant", "time", "mesh"), np.full((1, 3, 1), 1500.0)),
            "least_force": (vm, least * one),
            "settled_force": (vm, settled * one),
            "largest_force": (vm, 4000.0 * one),
            "pulling": (vm, pulling * one),
            "lost": (vm, lost * one),
            "growth": (("variant",), [growth]),
            "gain": (("variant",), [gain]),
            "energy_error": (("variant",), [energy]),
            "momentum_error": (("variant",), [momentum]),
            "speed": (("variant", "time", "shaft"), np.full((1, 3, 1), 10.0)),
        },
        {"variant": ["with bending"], "mesh": ["a-b"], "shaft": ["a"]},
        {
            "steps": 40_000,
            "step": 5e-5,
            "every": 1,
            "contact": contact,
            "damping_ratio": 0.02,
            "shaft_of_speed": "a",
            "mesh_mode": 0.0,
            "settle": 0.6,
        },
    )


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, []),
        # e^(1.1 * 2) = 9.0, e^(1.2 * 2) = 11
        ({"growth": 1.1}, []),
        ({"growth": 1.2}, ["[W-GROWTH] with bending: the free motion grows with 1.2 1/s, 11 times"]),
        ({"growth": 1e4}, ["1e8686 times"]),
        ({"gain": 900.0}, []),
        (
            {"gain": 1100.0, "least": 1.0},
            ["free motion decays in the mean, but grows 1.1e+03 times on the way"],
        ),
        (
            {"gain": np.inf},
            ["grows 1e308 times on the way: a parametric resonance; these forces mean nothing"],
        ),
        ({"gain": 1e9, "contact": "separating", "growth": -1.0}, []),
        ({"lost": 1.0, "contact": "separating"}, ["[W-PARTED] with bending: the teeth of a-b never touch"]),
        ({"lost": 0.999, "contact": "separating"}, []),
        (
            {"growth": 5.0, "contact": "separating", "pulling": 0.1, "lost": 0.2},
            ["[W-CHAOS] with bending: neighbouring motions move apart with 5 1/s"],
        ),
        ({"growth": 1.1, "contact": "separating"}, []),
        ({"energy": 2e-6}, ["[W-BALANCE] the balance of energy misses 2.0e-06"]),
        ({"momentum": 1e-3}, ["[W-BALANCE] the balance of angular momentum misses 1.0e-03"]),
        ({"energy": np.nan}, ["[W-BALANCE] the balance of energy misses nan"]),
        (
            {"pulling": 0.25},
            ["[W-PULL] with bending: a-b pulls for 25.00 % of the time, with up to 0.2 kN"],
        ),
    ],
)
def test_what_a_run_says_against_itself(changes, words):
    found = [str(one) for one in transient_warnings(transient(**changes))]
    assert len(found) == len(words) and all(word in text for word, text in zip(words, found))


def test_a_pull_before_the_settling_time_alone_is_a_note():
    (late,) = transient_warnings(transient(pulling=0.25, settled=-1.0))
    assert late.severity == DOUBT and "settle" not in str(late)
    (early,) = transient_warnings(transient(pulling=0.25, settled=1.0))
    assert early.severity == NOTE and "but only before 0.6 s (transient.settle)" in str(early)


def test_table_of_a_run_that_keeps_contact_and_of_one_that_loses_it():
    kept = describe_transient(transient(pulling=0.25))
    assert kept.header[-1] == "pulling [% of time]" and kept.rows[0][-1] == "25.00"
    assert any("decays with 3 1/s" in note for note in kept.notes)
    assert any("real teeth part" in note for note in kept.notes)
    lost = describe_transient(transient(pulling=0.05, lost=0.125, contact="separating", growth=2.0))
    assert lost.header[-2:] == ("no contact [% of time]", "back flank [% of time]")
    assert lost.rows[0][-2:] == ("12.50", "5.00")
    assert any("move apart" in note and "exponent 2 1/s" in note for note in lost.notes)
    assert not any("real teeth part" in note for note in lost.notes)
