"""docs/impacts.md: its examples print what it says, its pictures and the names in it exist."""

import importlib
import re
from functools import cache

import pytest
from page_examples import ROOT, read_page, run_examples

from femgear.solvers.stability.lyapunov import LyapunovExponents

PAGE, EXAMPLES, PRINTED = read_page("impacts.md")
MODULES = (
    "published.transmission_errors",
    "femgear.system.fourier",
    "femgear.trains.impacts.model",
    "femgear.trains.impacts.model",
    "femgear.trains.impacts.case_file",
    "femgear.trains.impacts.figures",
    "femgear.solvers.linear.modal",
    "femgear.solvers.stability.lyapunov",
    "femgear.solvers.continuation.branches",
    "femgear.solvers.time.stroboscopic",
)


@cache
def outputs(count):
    return run_examples("impacts.md", EXAMPLES[:count])


def test_every_example_has_its_output():
    assert len(EXAMPLES) == len(PRINTED) == 3


def test_the_first_example_prints_what_the_page_says():
    assert outputs(1) == PRINTED[:1]


@pytest.mark.slow
@pytest.mark.parametrize("number", range(1, len(EXAMPLES)))
def test_examples_print_what_the_page_says(number):
    assert outputs(len(EXAMPLES))[number] == PRINTED[number]


def test_pictures_exist_and_come_from_the_script():
    pictures = re.findall(r"!\[[^\]]+\]\(images/(impacts|gear_pair\w*)/(\w+)\.png\)", PAGE)
    script = (ROOT / "scripts" / "impacts.py").read_text(encoding="utf-8")
    assert len(pictures) >= 5
    # what a case draws as well stands where its pictures are
    for folder, name in pictures:
        assert (ROOT / "docs" / "images" / folder / f"{name}.png").stat().st_size > 5000
        assert f'"{name}.png"' in script or f'"{name}"' in script


def test_named_functions_exist():
    prose = re.sub(r"^```.*?^```", "", PAGE, flags=re.MULTILINE | re.DOTALL)
    # the keys of the case file are compared with its schema
    prose = re.sub(r"^## Case file.*?^## ", "## ", prose, flags=re.MULTILINE | re.DOTALL)
    known = set()
    for module in MODULES:
        known |= set(vars(importlib.import_module(module)))
    named = set(re.findall(r"`([A-Za-z_]\w+)`", prose))
    assert {"ImpactPair", "with_errors", "lyapunov_exponents", "range_states"} <= named
    # fields of the result, which are no functions
    fields = {"chaotic", "verdict", "error", "scatter", "step_error"}
    assert fields <= set(dir(LyapunovExponents)) | set(LyapunovExponents.__dataclass_fields__)
    assert named <= known | fields
