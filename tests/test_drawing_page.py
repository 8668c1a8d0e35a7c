"""docs/drawing_to_ste.md: its snippets make valid cases, its tolerances those of the named formulas."""

import re
from pathlib import Path

import numpy as np
import pytest

from femgear.case.case import planetary_set, set_deviations
from femgear.trains.reading import parse_case

ROOT = Path(__file__).resolve().parents[1]
PAGE = (ROOT / "docs" / "drawing_to_ste.md").read_text(encoding="utf-8")
FIRST, *OTHERS = re.findall(r"^```toml\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)


def test_the_first_snippet_is_a_whole_case_of_ideal_gears():
    case = parse_case(FIRST)
    assert set_deviations(case).ideal
    assert planetary_set(case).sun.profile_shift == pytest.approx(0.52681, abs=1e-5)


@pytest.mark.parametrize("number", range(len(OTHERS)))
def test_every_other_snippet_may_be_added_to_it(number):
    case = parse_case(FIRST + "\n" + OTHERS[number])
    assert case != parse_case(FIRST)
    set_deviations(case)


def test_all_snippets_together_are_one_case():
    assert len(OTHERS) >= 4
    found = set_deviations(parse_case("\n".join([FIRST, *OTHERS])))
    assert found.sun.modifications and found.pin_errors.any() and found.sun_pitch.any()


def test_the_pitch_errors_use_up_the_tolerance_of_the_page():
    """ISO 1328-1:2013, formulas (5) and (6), class 6, as the page writes them."""
    errors = next(e for e in (parse_case(FIRST + "\n" + o).sun.errors for o in OTHERS) if e is not None)
    values, (d, m) = 1e6 * np.array(errors.cumulative_pitch), (40.5, 1.5)
    total = (0.002 * d + 0.55 * d**0.5 + 0.7 * m + 12) * 2**0.5
    assert np.ptp(values) == pytest.approx(total, rel=0.03)
    assert np.abs(np.diff(values)).max() < (0.001 * d + 0.4 * m + 5) * 2**0.5
    assert f"{total:.1f}" in PAGE


def test_commands_of_the_page_exist():
    commands = re.findall(r"scripts/(\w+\.py)", PAGE)
    assert commands
    assert all((ROOT / "scripts" / name).is_file() for name in commands)
