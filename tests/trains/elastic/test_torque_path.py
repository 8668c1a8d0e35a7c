"""The way of `operation.torque` from the case file to the signal of the housing, traced through a run.

Print it with ``python tests/trains/elastic/test_torque_path.py``.

The torque is used in five places: where its text becomes a number, in the contact problem, in the modes of
the loaded set, in the periodic response and in the lines of the fixed sensor. A function of femgear is on the
way when it is one of these, or when one of these is called from inside it, lambdas and nested functions
included. Responses and lines that no stage keeps are left out: they belong to the search for how far the
excitation reaches, which hands on numbers of harmonics and the level beyond them. Neither is counted what is
called on the way and calls none of the five, such as the mesh springs of a loaded state, nor what lies inside
the five.
"""

import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

import pytest

import femgear
from femgear.case.quantities import to_si
from femgear.contact.cycle import walk_mesh_cycle
from femgear.housing.sensor import component_lines
from femgear.run import run_case
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.trains.elastic.results import DynamicsResult, HousingResult
from femgear.trains.reading import parse_case, read_case

pytestmark = pytest.mark.usefixtures("coarse_states")

ROOT = Path(__file__).parents[3]
CASE = ROOT / "cases" / "planetary_27_40_108.toml"
TORQUE = "100 N m"
USES = (to_si, walk_mesh_cycle, undamped_modes, solve_spectral, component_lines)
CHAIN = (
    "trains.reading.read_case",
    "trains.reading.parse_case",
    "case.quantities.to_si",
    "run.run_case",
    "run._compute",
    "stages.static.solve_static",
    "contact.cycle.walk_mesh_cycle",
    "trains.elastic.stages.solve_modes",
    "contact.loaded_period.loaded_period",
    "solvers.linear.modal.undamped_modes",
    "trains.elastic.stages.dynamics_parts",
    "solvers.periodic.spectral.solve_spectral",
    "trains.elastic.stages.solve_housing",
    "housing.sensor.component_lines",
)


def code_of(function: Any) -> CodeType:
    """Code of a function, below its decorators."""
    return getattr(function, "__wrapped__", function).__code__


def name_of(code: CodeType) -> str:
    """Module and name of a function, such as ``run.solve``; empty where it is none of femgear."""
    folder = Path(femgear.__file__).parent
    path = Path(code.co_filename)
    if folder not in path.parents:
        return ""
    return ".".join([*path.relative_to(folder).with_suffix("").parts, code.co_qualname])


def torque_path(folder: Path) -> list[str]:
    """Functions on the way of the torque, in the order in which they are called."""
    uses = {code_of(use) for use in USES}
    searched = {code_of(solve_spectral), code_of(component_lines)}
    calls: list[tuple[list[CodeType], Any]] = []
    kept: list[Any] = []

    def watch(frame: FrameType, event: str, result: Any) -> None:
        if event != "return":
            return
        # a part of the response comes with its case
        result = result[1] if type(result) is tuple and len(result) == 2 else result
        if isinstance(result, DynamicsResult):
            kept.append(result.response)
        elif isinstance(result, HousingResult):
            kept.append(result.exact)
        elif frame.f_code in uses and frame.f_locals.get("value", TORQUE) == TORQUE:
            stack, at = [], frame
            while at is not None:
                stack.insert(0, at.f_code)
                at = at.f_back
            calls.append((stack, result))

    traced(watch, lambda: run_case(small_case(folder), folder, pictures=False))
    found = {
        code: name_of(code)
        for stack, result in calls
        if stack[-1] not in searched or any(result is one for one in kept)
        for code in stack
    }
    return [name for name in found.values() if name]


def small_case(folder: Path) -> femgear.Case:
    """The reference case with a coarse grid and one speed, read from a file."""
    text = CASE.read_text(encoding="utf-8").partition("[[housing.published]]")[0]
    text = text.replace('["250 rpm", "3100 rpm"]', '["3100 rpm"]').replace("positions = 64", "positions = 14")
    text = text.replace("# flank_elements = 24", "stresses = false\nflank_elements = 8")
    path = folder / "small.toml"
    path.write_text(text, encoding="utf-8")
    return read_case(path)


def traced(watch: Callable, run: Callable[[], object]) -> None:
    """Run with a profiler, and put back the one that was there."""
    before = sys.getprofile()
    sys.setprofile(watch)
    try:
        run()
    finally:
        sys.setprofile(before)


def test_the_torque_passes_fourteen_functions(tmp_path):
    found = torque_path(tmp_path)
    assert tuple(found) == CHAIN
    assert len(found) == 14


def test_no_function_after_reading_goes_back_to_the_text(tmp_path):
    """Once a case is read, neither its run nor a variant under another torque writes or reads a case text."""
    from femgear.case.dependencies import Steps
    from femgear.study.objectives import under_torque
    from femgear.trains.live import Answer

    answer = Answer(small_case(tmp_path), Steps())
    texts = {code_of(one) for one in (read_case, parse_case, to_si, femgear.with_values)}
    again = []

    def watch(frame: FrameType, event: str, _: Any) -> None:
        if event == "call" and frame.f_code in texts:
            again.append(name_of(frame.f_code))

    traced(watch, lambda: run_case(answer.case, tmp_path, pictures=False))
    other = under_torque(answer, 50.0)
    traced(watch, lambda: other.static)
    assert again == [] and other.static.sun_torque == 50.0


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        print(*torque_path(Path(place)), sep="\n")
