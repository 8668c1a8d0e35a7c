"""Former names of modules, functions and classes."""

import subprocess
import sys
from dataclasses import dataclass
from importlib import import_module

import pytest

from femgear.moved import MOVED, former_keywords, former_names

FORMER = """
femgear.trains.protocol femgear.stages.protocol StageResult
femgear.trains.static.stages femgear.stages.static solve_static
femgear.trains.gear_pair.model femgear.trains.impacts.model ImpactPair
femgear.housing.casing_files femgear.exchange.casing_files read_casing
"""


def test_former_names_are_the_modules_by_their_new_ones():
    """In a process of its own, where nothing is imported yet."""
    script = f"""
import importlib, warnings
for line in {FORMER.strip().splitlines()!r}:
    former, new, name = line.split()
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        old = importlib.import_module(former)
    assert getattr(old, name) is getattr(importlib.import_module(new), name), line
    messages = [str(one.message) for one in told if one.category is DeprecationWarning]
    assert messages[-1] == f"{{former}} is called {{new}} now", line
"""
    subprocess.run([sys.executable, "-c", script], check=True, timeout=60)


def test_new_names_exist_and_former_ones_have_no_file():
    from importlib.util import find_spec

    for former, new in MOVED.items():
        assert find_spec(new) is not None
        assert find_spec(former).origin is None


@pytest.mark.parametrize(
    ("module", "former", "new"),
    [
        ("femgear.solvers.linear.modal", "solve_modes", "undamped_modes"),
        ("femgear.solvers", "solve_modes", "undamped_modes"),
        ("femgear.study.objectives", "Quantity", "StudyQuantity"),
    ],
)
def test_former_functions_and_classes_are_those_by_their_new_names(module, former, new):
    place = import_module(module)
    with pytest.warns(DeprecationWarning, match=f"{former} is called {new} now"):
        assert getattr(place, former) is getattr(place, new)


def test_another_name_is_not_there():
    with pytest.raises(AttributeError, match="no attribute"):
        former_names("femgear.curves", {"older": pytest})("newer")


def test_former_names_of_parameters_are_taken_with_a_warning():
    @former_keywords(told="progress")
    def integrate(steps, *, progress=None):
        return steps, progress

    @former_keywords(heard="response")
    @dataclass(frozen=True)
    class Result:
        response: int

    assert integrate(2, progress=3) == (2, 3) and Result(4) == Result(response=4)
    with pytest.warns(DeprecationWarning, match="told of integrate is called progress now"):
        assert integrate(2, told=3) == (2, 3)
    with pytest.warns(DeprecationWarning, match="heard of Result is called response now"):
        assert Result(heard=4) == Result(4)
    with pytest.raises(TypeError):
        integrate(2, asked=3)
