"""docs/drawing_to_ste.md: its snippets make valid cases, its tolerances those of the named formulas."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from femgear.case.gear_set import planetary_set, set_deviations
from femgear.trains.reading import parse_case

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "drawing_to_ste.md").read_text(encoding="utf-8")
FIRST, *OTHERS = re.findall(r"^```toml\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)
PRINTED = re.findall(r"^```text\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)


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


def printed(*arguments: str, folder: Path) -> str:
    """Standard output of a command of the page."""
    name, *rest = arguments
    program = ["-m", "femgear.cli"] if name == "femgear" else [str(ROOT / "scripts" / name)]
    command = [sys.executable, *program, *rest]
    run = subprocess.run(command, capture_output=True, text=True, cwd=folder, timeout=900)
    assert run.returncode == 0, run.stderr
    return run.stdout


def blocks() -> list[tuple[str, str]]:
    """Every block of the page that prints something, and what the page adds to the first case for it."""
    first, relief, pitch, pin, elastic = (FIRST, *OTHERS[:4])
    assert 'kind = "tip relief"' in relief and "cumulative_pitch" in pitch
    assert "pin_errors" in pin and 'members = "elastic"' in elastic
    coarse = "[static]\npositions = 16\n"
    cases = (first, first, first + relief, first, first, first + pitch + coarse, first + pin, first)
    return list(zip(PRINTED, (*cases, first + pin + elastic), strict=True))


def commands() -> list[list[str]]:
    """Commands of the page; one that is not written again is that of the static run."""
    written = [
        shlex.split(text.replace("\\\n", " "))
        for text in re.findall(r"^```sh\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)
    ]
    names = [
        [Path(words[1]).name, *words[2:]] if "python" in words[0] else ["femgear", *words[1:]] for words in written
    ]
    check, run, harris, relief, pins = names
    return [check, run, run, harris, relief, run, run, pins, run]


def lines(text: str) -> list[str]:
    """Lines as words; durations and residuals differ from machine to machine."""
    masked = re.sub(r"\d+\.\d+ s\b|\d\.\de-1\d", "#", text)
    return [" ".join(line.split()) for line in masked.splitlines() if line.strip()]


@pytest.mark.slow
@pytest.mark.parametrize("number", range(len(PRINTED)))
def test_printed_numbers_are_those_of_the_commands(number, tmp_path):
    text, case = blocks()[number]
    (tmp_path / "drawing.toml").write_text(case, encoding="utf-8")
    found = printed(*commands()[number], folder=tmp_path)
    rest = iter(lines(found))  # in this order, with others between them
    assert [line for line in lines(text) if line not in rest] == []
