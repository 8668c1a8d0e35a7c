"""docs/solvers.md: its examples print what it says, the functions that it names exist."""

import importlib
import inspect
import re

import pytest
from page_examples import ROOT, read_page, run_examples

PAGE, EXAMPLES, PRINTED = read_page("solvers.md")
# options, fields and parameters, which are no functions
WORDS = {
    "converged",
    "residual",
    "tail",
    "spectral_radius",
    "message",
    "samples",
    "start",
    "start_at",
    "folds",
    "complete",
    "stable",
    "loss",
    "largest_multiplier",
    "settled",
    "settle",
    "orders",
    "tolerance",
    "fold",
    "flip",
    "MechanicalSystem",
}


@pytest.fixture(scope="module")
def outputs():
    return run_examples("solvers.md", EXAMPLES)


def test_every_example_has_its_output():
    assert len(EXAMPLES) == len(PRINTED) >= 5


@pytest.mark.parametrize("number", range(len(EXAMPLES)))
def test_examples_print_what_the_page_says(outputs, number):
    assert outputs[number] == PRINTED[number]


def public_names() -> set[str]:
    """Functions and classes of `femgear.solvers`, and of what it solves."""
    found = set()
    paths = [path for path in (ROOT / "femgear" / "solvers").rglob("*.py") if path.stem != "__init__"]
    assert len(paths) >= 19
    paths += [ROOT / "femgear" / "system" / f"{name}.py" for name in ("force_laws", "fourier", "system")]
    for path in paths:
        module = importlib.import_module(".".join(path.relative_to(ROOT).with_suffix("").parts))
        found |= {
            name for name, value in inspect.getmembers(module) if getattr(value, "__module__", "") == module.__name__
        }
    return found


def test_named_functions_exist():
    prose = re.sub(r"^```.*?^```", "", PAGE, flags=re.MULTILINE | re.DOTALL)
    named = set(re.findall(r"`(\w+)(?:\([^`]*\)(?:\.\w+\(\))?)?`", prose))
    assert named - public_names() <= WORDS
    assert {"solve_spectral", "periodic_response", "frequency_response_curve", "solve_transient"} <= named


def test_options_that_the_page_names_exist():
    from femgear.solvers.continuation.branches import Branch, CurveOptions
    from femgear.solvers.periodic.harmonic_balance import PeriodicResponse
    from femgear.solvers.periodic.shooting import solve_shooting
    from femgear.solvers.periodic.solution import FloquetVerdict, PeriodicSolution
    from femgear.solvers.time.transient import METHODS, solve_transient

    def options(function):
        return set(inspect.signature(function).parameters)

    assert {"converged", "residual", "message"} <= set(PeriodicSolution.__dataclass_fields__)
    assert {"stable", "loss", "multipliers"} <= set(FloquetVerdict.__dataclass_fields__)
    assert all(hasattr(PeriodicResponse, name) for name in ("tail", "spectral_radius", "stable"))
    for name in (
        "converged",
        "residual",
        "tail",
        "stable",
        "loss",
        "largest_multiplier",
        "folds",
        "complete",
    ):
        assert hasattr(Branch, name)
    assert {"start", "start_at", "samples"} <= options(CurveOptions)
    assert "settle" in options(solve_shooting)
    assert "events" in options(solve_transient) and {"modal", "DOP853"} <= set(METHODS)
