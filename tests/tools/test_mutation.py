"""validation/tools/mutation.py, mutants.py: what is changed, what kills it, and no file of the tree is touched."""

import ast
import json
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

TOOLS = Path(__file__).parents[2] / "validation" / "tools"
sys.path.append(str(TOOLS))

from mutants import CORE, ROOT, drawn, modules, mutants, mutated  # noqa: E402
from mutation import equivalents  # noqa: E402

SOURCE = '''
def law(x: float = 1e-9, *, n: int = -1) -> "list[3]":
    """Multiply by 2."""
    if n < 1 and x is not None:
        raise ValueError(f"{n + 1} is " + "below" + str(2 * n))
    total = -x * 3 + abs(x[-1] - x[2, 0])
    total -= np.where(x > 0.5, min(x, 7), np.sum(x, axis=0).conj())
    return total.reshape(-1, 5) if n else not total
'''
WHERE = "np.where(x > 0.5, min(x, 7), np.sum(x, axis=0).conj())"
CHANGES = {
    ("sign", "-1", "1"),
    ("comparison", "n < 1", "n >= 1"),
    ("comparison", "n < 1", "n <= 1"),
    ("constant", "1", "2"),
    ("logic", "n < 1 and x is not None", "n < 1 or x is not None"),
    ("raise", "raise ValueError(f'{n + 1} is ' + 'below' + str(2 * n))", "pass"),
    ("sign", "-x * 3 + abs(x[-1] - x[2, 0])", "-x * 3 - abs(x[-1] - x[2, 0])"),
    ("factor", "-x * 3", "-x / 3"),
    ("sign", "-x", "x"),
    ("constant", "3", "6"),
    ("dropped", "abs(x[-1] - x[2, 0])", "x[-1] - x[2, 0]"),
    ("index", "-1", "-2"),
    ("index", "2", "3"),
    ("sign", f"total -= {WHERE}", f"total += {WHERE}"),
    ("branch", WHERE, "np.where(x > 0.5, np.sum(x, axis=0).conj(), min(x, 7))"),
    ("comparison", "x > 0.5", "x <= 0.5"),
    ("constant", "0.5", "1.0"),
    ("constant", "7", "14"),
    ("extreme", "min(x, 7)", "max(x, 7)"),
    ("axis", "0", "1"),
    ("dropped", "np.sum(x, axis=0).conj()", "np.sum(x, axis=0)"),
    ("size", "5", "6"),
    ("branch", "total.reshape(-1, 5) if n else not total", "not total if n else total.reshape(-1, 5)"),
    ("logic", "not total", "total"),
}


def test_every_kind_of_change_and_no_other():
    """No message, annotation or tolerance is changed; of four signs in line 6 two are."""
    found = mutants("law.py", SOURCE)
    assert {(one.kind, one.before, one.after) for one in found} == CHANGES
    assert max(Counter((one.line, one.kind) for one in found).values()) == 2
    assert {one.function for one in found} == {"law"}


def test_a_mutant_differs_in_its_expression_only():
    original = ast.unparse(ast.parse(SOURCE)).splitlines()
    for one in mutants("law.py", SOURCE):
        tree = mutated(SOURCE, one.number)
        compile(tree, "law.py", "exec")
        wrong = [(old, new) for old, new in zip(original, ast.unparse(tree).splitlines()) if old != new]
        assert len(wrong) == 1, one
        assert one.before in wrong[0][0] and one.after in wrong[0][1]


def test_a_seed_draws_a_third_of_signs_and_more_of_them_begin_alike():
    found = mutants("phasing.py", (TOOLS.parents[1] / "femgear/gears/phasing.py").read_text())
    few, more = drawn(found, 12, 1), drawn(found, 60, 1)
    assert more[:12] == few
    assert sum(one.kind == "sign" for one in more) == 20
    assert len(set(more)) == 60
    assert drawn(found, 12, 2) != few
    assert sorted(one.number for one in drawn(found, 10**6, 1)) == [one.number for one in found]


@pytest.mark.slow
def test_mutants_that_change_nothing_are_there():
    """An entry whose function or expression has another name would be met again as a survivor."""
    listed = {*equivalents()}
    sources = {module: (ROOT / "femgear" / module).read_text(encoding="utf-8") for module, *_ in listed}
    there = {mutant.name for module, source in sources.items() for mutant in mutants(module, source)}
    assert listed and listed <= there, listed - there


def test_the_core_has_all_its_modules():
    names = modules(CORE)
    assert {"gears/profile.py", "contact/solve.py", "solvers/time/steps.py", "case/text.py"} <= set(names)
    assert not any(name.endswith("__init__.py") for name in names)
    with pytest.raises(SystemExit, match="femgear has no such module or folder"):
        modules(["gears/nothing"])


TOY = """
def difference(a, b):
    return a - b

def count(n):
    while n > 0:
        n -= 1
    return n

def weak(a):
    return 3.0 * a

def unused(a):
    return -a

def same(a):
    return abs(a) ** 2
"""
TOY_TEST = """
import os
from pathlib import Path
import pytest
from femgear.gears import toy

def test_difference():
    assert toy.difference(3, 1) == 2

def test_count():
    assert toy.count(3) == 0

@pytest.fixture(scope="module")
def triple():
    return toy.weak(1.0)

def test_a_file_may_be_left_behind():
    Path("left").write_text("in the folder of the mutant")
    (Path(os.environ["FEMGEAR_MESHES"]) / "left").write_text("there, too")

def test_weak(triple):
    assert triple > 0 and toy.same(-2) == 4
"""
COMMAND = """
import sys
import mutation
mutation.LIBRARIES, mutation.PATIENCE = ["pytest", "coverage", "hypothesis", "_hypothesis_pytestplugin"], 0.5
sys.exit(mutation.main(["--modules", "gears", "--count", "99", "--jobs", "1"]))
"""


@pytest.fixture
def toy(tmp_path):
    for name in ("mutation.py", "mutants.py"):
        (tmp_path / "validation/tools").mkdir(parents=True, exist_ok=True)
        shutil.copy(TOOLS / name, tmp_path / "validation/tools")
    equivalent = "gears/toy.py ;; same ;; abs(a) ;; a ;; a square has no sign\n"
    (tmp_path / "validation/tools/equivalent_mutants.txt").write_text(equivalent)
    (tmp_path / "femgear/gears").mkdir(parents=True)
    (tmp_path / "tests/gears").mkdir(parents=True)
    shutil.copy(TOOLS.parents[1] / "pyproject.toml", tmp_path)
    for name in ("femgear/__init__.py", "femgear/gears/__init__.py"):
        (tmp_path / name).touch()
    (tmp_path / "femgear/gears/toy.py").write_text(TOY)
    (tmp_path / "tests/gears/test_toy.py").write_text(TOY_TEST)
    return tmp_path


def _campaign(folder):
    path = folder / "validation" / "tools"
    done = subprocess.run(
        [sys.executable, "-B", "-c", COMMAND],
        cwd=path,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    lines = (folder / "out/mutants/results.jsonl").read_text().splitlines()
    return done, [json.loads(line) for line in lines]


def _outcomes(entries):
    return {(entry["place"], entry["change"]): entry["outcome"] for entry in entries}


@pytest.mark.slow
def test_a_campaign_finds_the_gaps_and_goes_on_when_tests_are_added(toy):
    before = {path: path.read_bytes() for path in toy.rglob("*") if path.is_file()}
    done, entries = _campaign(toy)
    outcomes = _outcomes(entries)
    assert done.returncode == 1, done.stderr
    assert outcomes["gears/toy.py:3", "a - b  ->  a + b"] == "killed"
    assert outcomes["gears/toy.py:7", "n -= 1  ->  n += 1"] == "timeout"
    assert outcomes["gears/toy.py:11", "3.0  ->  6.0"] == "survived"
    page = (toy / "out/mutants/report.md").read_text()
    assert "gears/toy.py:14 sign in `unused`: `-a` -> `a`: no test runs the line" in page
    assert "gears/toy.py:17 `abs(a)` -> `a`: a square has no sign" in page
    written = {path for path in toy.rglob("*") if path.is_file() and "out" not in path.parts}
    assert written == before.keys()
    assert all(path.read_bytes() == content for path, content in before.items())

    path = toy / "tests/gears/test_toy.py"
    path.write_text(path.read_text() + "\ndef test_all():\n    assert (toy.weak(2), toy.unused(1)) == (6, -1)\n")
    done, more = _campaign(toy)
    assert _outcomes(more)["gears/toy.py:11", "3.0  ->  6.0"] == "killed"
    assert _outcomes(more)["gears/toy.py:14", "-a  ->  a"] == "killed"
    # the others are not done twice
    assert {entry["place"] for entry in more[len(entries) :]} == {f"gears/toy.py:{n}" for n in (11, 14)}
    assert "sign flips killed |\n" in (toy / "out/mutants/report.md").read_text()
