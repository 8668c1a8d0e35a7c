"""Tolerances of entries of a case file: laws, draws, and what is refused by name."""

import numpy as np
import pytest
from scipy.stats import kstest
from small_gearbox import pair_tables

from femgear.errors import CaseError
from femgear.study.entry_tolerances import draw_entries, entry_shares, read_entry_tolerances
from femgear.trains.reading import read_case, with_values

STIFF = '[[tolerance]]\nkey = ["bearing[0].radial", "bearing[1].radial"]\ndistribution = "normal"\nsigma = "10 %"\n'
AXIS = '[[tolerance]]\nkey = "shaft[1].axis[1]"\ndistribution = "uniform"\nmean = "10 um"\nlimit = "30 um"\n'


@pytest.fixture(scope="module")
def box():
    tables = pair_tables()
    tables["bearing"][1]["radial"] = "4e8 N/m"
    return read_case(tables)


def entries_of(box, folder, text):
    path = folder / "tolerances.toml"
    path.write_text(text, encoding="utf-8")
    return read_entry_tolerances(path, box)[0]


def test_errors_add_to_what_the_case_has(box, tmp_path):
    stiff, axis = entries = entries_of(box, tmp_path, STIFF + AXIS)
    assert stiff.value == (2e8, 4e8) and axis.value == (0.0,)
    # one draw for both, each by its own share
    assert stiff.errors(np.array([0.8413447])) == pytest.approx(np.array([[2e7, 4e7]]), rel=1e-6)
    assert axis.errors(np.array([0.0, 0.75, 1.0])).ravel() == pytest.approx([-0.02, 0.025, 0.04])
    (point,) = draw_entries(entries, 7, 5, 1)
    share = entry_shares(entries, 7, 5, 1)[0]
    keys = [key for entry in entries for key in entry.variable.keys]
    drawn = with_values(box, dict(zip(keys, point, strict=True)))
    assert drawn.bearing[0].radial == pytest.approx(2e8 + stiff.errors(share[:1])[0, 0], rel=1e-8)
    assert drawn.shaft[1].axis[1] == pytest.approx(1e-3 * axis.errors(share[1:])[0, 0], abs=1e-12)
    assert drawn.shaft[1].axis[0] == box.shaft[1].axis[0]


def test_sample_i_is_the_same_whatever_else_is_drawn(box, tmp_path):
    entries = entries_of(box, tmp_path, STIFF + AXIS)
    every = draw_entries(entries, 1, 0, 40)
    assert draw_entries(entries, 1, 17, 3) == every[17:20] and draw_entries(entries, 2, 0, 1) != every[:1]
    assert kstest(entry_shares(entries, 1, 0, 400)[:, 1], "uniform").pvalue > 0.01


@pytest.mark.parametrize(
    ("text", "code", "words"),
    [
        ("# none", "E-KEY-MISSING", "no entry has a tolerance"),
        (AXIS + 'sigma = "1 um"\n', "E-CHOICE", "no sigma"),
        (STIFF.replace('sigma = "10 %"', 'limit = "10 %"'), "E-KEY-MISSING", "needs its sigma"),
        (STIFF.replace("10 %", "-10 %"), "E-RANGE", "no less than 0"),
        (AXIS.replace("30 um", "30 N"), "E-UNIT", "not a unit"),
        (AXIS.replace("axis[1]", "axis[2]"), "E-KEY-MISSING", "leaves this entry out"),
        (AXIS.replace("shaft[1].axis[1]", "bearing[0].clearance"), "E-KEY-MISSING", "leaves this entry out"),
        (AXIS.replace("shaft[1].axis[1]", "shaft[1].name"), "E-VARIABLE", "not a number"),
        (AXIS + AXIS, "E-DUPLICATE", "two tolerances"),
        (STIFF.replace("10 %", "30 %"), "E-RANGE", "within the tolerance"),
        (AXIS.replace("limit", "limits"), "E-KEY-UNKNOWN", "limits"),
    ],
)
def test_refused_tolerances(box, tmp_path, text, code, words):
    with pytest.raises(CaseError) as info:
        entries_of(box, tmp_path, text)
    problems = [str(problem) for problem in info.value.problems]
    assert any(code in problem and words in problem for problem in problems), problems
    assert all(problem.file.startswith(str(tmp_path)) for problem in info.value.problems)
