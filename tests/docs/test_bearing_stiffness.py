"""docs/bearing_stiffness.md: its table and numbers are those of its script, its example prints what stands there."""

import re
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from page_examples import read_page, run_examples

from femgear.system.bearing_life import reference_rating_life
from femgear.system.rolling_bearings import solve_motion

ROOT = Path(__file__).resolve().parents[2]
PAGE, EXAMPLES, PRINTED = read_page("bearing_stiffness.md")


@pytest.fixture
def script(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    import bearing_stiffness

    yield bearing_stiffness
    sys.modules.pop("bearing_stiffness", None)


def test_the_table_is_that_of_the_script(script):
    rows = re.findall(r"(?m)^\| ([a-z][^|]*) \| ([\d.]+) \| ([^`\n]*) \|$", PAGE)
    printed = {name: [first, *(cell.strip() for cell in rest.split("|"))] for name, first, rest in rows}
    wanted = {}
    for name, bearing in script.BEARINGS.items():
        wanted[name] = [*script.shown(script.stiffness_row(bearing, 5000.0))]
    assert printed == wanted


def test_numbers_in_the_text(script):
    text = " ".join(PAGE.split())
    tight, loose = (
        solve_motion(replace(script.DEEP, clearance=clearance), (5000, 0, 0, 0, 0, 0)) for clearance in (0.0, 30e-6)
    )
    assert f"from {tight.load.max():.0f} N without clearance to {loose.load.max():.0f} N with 30 µm" in text
    fall = 1.0 - reference_rating_life(loose, 45e3) / reference_rating_life(tight, 45e3)
    assert f"The life falls by {fall:.0%}".replace("%", " %") in text
    for name, words in (("deep groove ball", "ball"), ("cylindrical roller", "roller")):
        half, full, twice = (script.stiffness_row(script.BEARINGS[name], load)[2] for load in (2.5e3, 5e3, 1e4))
        changes = f"{half / full - 1.0:+.0%} and {twice / full - 1.0:+.0%}".replace("%", " %")
        assert re.search(rf"{words} bearing (above changes )?by {re.escape(changes)}", text)
    lives = []
    for way in (0.0, 10e-6, 20e-6):
        state = solve_motion(replace(script.ANGULAR, axial_preload=way), (5000, 0, 0, 0, 0, 0))
        lives.append(reference_rating_life(state, 60e3))
    assert f"raises the life of those rows by {lives[1] / lives[0] - 1.0:.0%}".replace("%", " %") in text
    assert f"20 µm cut it by {1.0 - lives[2] / lives[0]:.0%}".replace("%", " %") in text
    rows = replace(script.ANGULAR, axial_preload=10e-6)
    idle, loaded = (script.stiffness_row(rows, load) for load in (1.0, 1500.0))
    assert (
        loaded[-1] == 1.0 and f"10 µm of preload change by {1.0 - loaded[2] / idle[2]:.0%}".replace("%", " %") in text
    )
    back, face = (script.stiffness_row(script.BEARINGS[name], 5e3)[4] for name in list(script.BEARINGS)[3:5])
    assert round(back / face) == 4 and "four times better than face to face" in text
    more = replace(script.DEEP, balls=script.DEEP.balls * 12 // 10 + 1)
    ratio = script.stiffness_row(more, 5e3)[2] / script.stiffness_row(script.DEEP, 5e3)[2]
    assert ratio == pytest.approx((more.balls / script.DEEP.balls) ** (2.0 / 3.0), rel=0.02)


def test_the_example_prints_what_stands_there():
    assert run_examples("bearing_stiffness.md", EXAMPLES) == PRINTED


def test_sentences_are_short():
    prose = re.sub(r"(?ms)^```.*?^```", "", PAGE)
    prose = "\n".join(line for line in prose.splitlines() if not re.match(r"[|#!]", line))
    for sentence in re.split(r"(?<=[.:?])\s+|\n\n|\n\* ", prose):
        assert len(sentence.split()) <= 25, sentence
