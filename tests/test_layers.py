"""Who may import whom, and what must stay unimported until it is used."""

import ast
import subprocess
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator
from functools import cache
from itertools import chain
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "femgear"
LAYERS = (
    ("curves", "errors", "moved", "remembered"),
    ("findings", "second_process"),
    ("gears", "fe"),
    ("contact", "system"),
    ("solvers",),
    ("housing",),
    ("case",),
    ("storage",),
    ("report", "exchange"),
    ("measured",),
    ("stages",),
    ("trains",),
    ("study",),
    ("run",),
    ("rigs", "causes"),
    ("assistant",),
    ("app",),
    ("commands",),
    ("cli",),
    ("__main__",),
)
RANK = {part: rank for rank, parts in enumerate(LAYERS) for part in parts}
STUDY = {"trains.elastic"}  # whose stages a study runs
HEAVY = {"gmsh", "pyvista", "vtk", "matplotlib", "dask", "skfem", "pint", "xarray", "pandas"}
DRAWING = {
    f"femgear.{name}"
    for name in ("report.page", "report.scene", "trains.elastic.figures", "trains.elastic.fixed_housing")
}
SOLVING = {"scipy.linalg", "scipy.sparse", "femgear.stages.protocol"}
MODULES = sorted(PACKAGE.rglob("*.py"))
WITHOUT_TEST_FILE = {
    "app/dialogs.py": "what a window asks for, in a browser: tests/browser/test_app.py",
    "app/window.py": "a window, in a browser: tests/browser/test_app.py",
    "__main__.py": "calls the command line and nothing else: tests/test_cli.py",
    "exchange/_cad_worker.py": "a process of its own, which test_cad.py starts",
    "fe/_gmsh_worker.py": "a process of its own, which test_meshing.py starts",
    "report/explorer.py": "data of a page's script, from a whole run-up: tests/trains/elastic/test_runup.py",
    "trains/elastic/outputs.py": "rows of the models of a whole set: test_stages.py, test_excitation_limit.py",
    "trains/helical/results.py": "tables of a whole run, which is made once: tests/trains/helical/test_stages.py",
}


def place(path: Path) -> str:
    return str(path.relative_to(PACKAGE))


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def walked(path: Path) -> dict[type, list[ast.AST]]:
    """All nodes of a file by their kind, the outer ones first."""
    kinds = defaultdict(list)
    for node in ast.walk(tree(path)):
        kinds[type(node)].append(node)
    return kinds


def of_kinds(path: Path, *kinds: type) -> Iterator[ast.AST]:
    """All nodes of some kinds in a file."""
    return chain.from_iterable(walked(path)[kind] for kind in kinds)


@cache
def nodes(path: Path, *, typed: bool) -> tuple[ast.Import | ast.ImportFrom, ...]:
    """Import statements of a file, wherever they stand; `typed` adds those that only type checkers see."""
    pending, found = [tree(path)], []
    while pending:
        node = pending.pop()
        if isinstance(node, ast.Import | ast.ImportFrom):
            found.append(node)
        elif typed or not (isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"):
            # no expression holds an import
            pending += [one for one in ast.iter_child_nodes(node) if not isinstance(one, ast.expr)]
    return tuple(found)


@cache
def imported(path: Path, *, typed: bool = False) -> frozenset[str]:
    """Names below ``femgear`` of all modules that a file imports: ``contact.solve``."""
    found = set()
    for node in nodes(path, typed=typed):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names if alias.name.startswith("femgear.")}
            continue
        assert node.level == 0, f"{path}:{node.lineno}: relative import"
        if node.module == "femgear":
            found |= {f"femgear.{alias.name}" for alias in node.names if alias.name != "__version__"}
        elif node.module.startswith("femgear."):
            below = PACKAGE.joinpath(*node.module.split(".")[1:])
            for alias in node.names:
                is_module = (below / f"{alias.name}.py").exists() or (below / alias.name).is_dir()
                found.add(f"{node.module}.{alias.name}" if is_module else node.module)
    return frozenset(name.removeprefix("femgear.") for name in found)


def test_imports_go_downwards_only():
    wrong = []
    for path in MODULES:
        part = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
        if part == "__init__":
            continue
        assert part in RANK, f"{part} has no layer"
        for other in {name.split(".")[0] for name in imported(path)} - {part}:
            assert other in RANK, f"{path} imports femgear.{other}, which has no layer"
            if RANK[other] >= RANK[part]:
                wrong.append(f"{place(path)} imports femgear.{other}")
    assert wrong == []


def test_only_the_registry_knows_a_train():
    """And a train none of the others."""
    wrong = []
    for path in MODULES:
        if place(path) in ("__init__.py", "trains/registry.py"):
            continue
        own = ".".join(path.relative_to(PACKAGE).parts[:2]) if path.parent.parent.name == "trains" else None
        allowed = STUDY if path.relative_to(PACKAGE).parts[0] == "study" else set()
        for name in imported(path, typed=True):
            train = ".".join(name.split(".")[:2])
            known = train == own or train in allowed
            if name.startswith("trains.") and name.count(".") == 2 and not known:
                wrong.append(f"{place(path)} knows {train}")
    assert wrong == []


def test_no_circle_of_imports_not_even_of_types():
    graph = defaultdict(set)
    for path in MODULES:
        name = place(path).removesuffix(".py").removesuffix("/__init__").replace("/", ".")
        graph[name] |= imported(path, typed=True) - {name}
    done = set()
    while free := {name for name in graph if name not in done and graph[name] & graph.keys() <= done}:
        done |= free
    assert sorted(graph.keys() - done) == []


def test_solvers_know_nothing_but_systems():
    for path in (PACKAGE / "solvers").rglob("*.py"):
        assert {name.split(".")[0] for name in imported(path)} <= {"errors", "moved", "system", "solvers"}
        for node in nodes(path, typed=False):
            names = [node.module] if isinstance(node, ast.ImportFrom) else [alias.name for alias in node.names]
            outside = {name.split(".")[0] for name in names} - set(sys.stdlib_module_names)
            assert outside <= {"femgear", "numpy", "scipy"}


def test_small_modules_are_few():
    """A module under 100 lines with one importer is part of another one, or has a reason to stand alone.

    What several trains have under one name is found there in each of them.
    """
    parts = Counter(path.name for path in MODULES if path.parent.parent.name == "trains")
    importers = defaultdict(set)
    for path in MODULES:
        for name in imported(path, typed=True):
            importers[name].add(place(path))
    small = []
    for path in MODULES:
        name = place(path).removesuffix(".py").replace("/", ".")
        lines = len(path.read_text(encoding="utf-8").splitlines())
        of_trains = path.parent.parent.name == "trains" and parts[path.name] > 2
        if path.stem != "__init__" and lines < 100 and len(importers[name]) <= 1 and not of_trains:
            small.append(place(path))
    # where the program begins; a process of its own: a signal or a crash of Gmsh ends it alone
    assert small == ["__main__.py", "cli.py", "fe/_gmsh_worker.py"]


def test_every_module_has_the_test_file_of_its_name():
    """`tests/contact/test_cycle.py` tests `femgear/contact/cycle.py`; few exceptions have a reason."""
    tests = PACKAGE.parent / "tests"
    without = set()
    for path in MODULES:
        own = tests / path.relative_to(PACKAGE).with_name(f"test_{path.name}")
        if path.stem != "__init__" and not (own.exists() and "\ndef test_" in own.read_text(encoding="utf-8")):
            without.add(place(path))
    assert without == WITHOUT_TEST_FILE.keys()


def loaded_after(*steps: str) -> list[set[str]]:
    """Names of the modules that a process has loaded after each of some steps, which follow one another."""
    told = "print('\\0', *sys.modules, sep='|')"
    script = "\n".join(["import sys", *(f"{step}\n{told}" for step in steps)])
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120, check=True)
    return [set(line.split("|")) for line in run.stdout.splitlines() if line.startswith("\0")]


CASE = PACKAGE.parent / "cases" / "planetary_27_40_108.toml"
STEPS = {
    "import femgear": HEAVY,
    "from femgear.cli import main; main(['--version'])": HEAVY,
    "main(['--help'])": HEAVY | {"numpy", "scipy.linalg", "scipy.sparse", "scipy.special", "scipy.interpolate"},
    "import femgear.case.gear_set": HEAVY,
    "import femgear.storage.results": HEAVY,
    f"femgear.read_case({str(CASE)!r})": HEAVY | SOLVING,
    f"main(['check', {str(CASE)!r}])": HEAVY,
}
"""What a user does, and what is not loaded then: libraries that draw or solve, of stages none to read a case."""


def test_heavy_libraries_are_imported_late():
    loaded = loaded_after(*STEPS)
    assert len(loaded) == len(STEPS)
    assert {step: late & names for (step, late), names in zip(STEPS.items(), loaded) if late & names} == {}


def test_a_run_loads_xarray_without_dask_and_pint():
    """Which come when somebody asks for them; xarray reads and computes as before."""
    code = (
        "import sys\nfrom femgear.commands.run import load_xarray\nload_xarray()\nload_xarray()\nimport xarray as xr\n"
        "data = xr.Dataset({'a': (('t', 'u'), [[1.0, 2.0]])}, coords={'t': [1], 'u': ['v', 'w']})\n"
        "assert data.isel(u=1)['a'].item() == data['a'].max() == 2.0\n"
        "assert not {'dask', 'pint'} & sys.modules.keys()\nimport dask.base, pint\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def test_a_run_loads_scipy_without_tests_and_fortran():
    """Which come when somebody asks for them."""
    code = (
        "import sys\nfrom femgear.commands.run import load_scipy\nload_scipy()\nload_scipy()\n"
        "import numpy as np\nimport scipy.linalg\n"
        "assert scipy.linalg.det(np.eye(2)) == 1.0\n"
        "assert not {'numpy.f2py', 'numpy.testing', 'unittest'} & sys.modules.keys()\n"
        "np.testing.assert_allclose(1.0, 1.0)\nassert np.f2py.__name__ == 'numpy.f2py'\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def test_a_run_without_pictures_loads_neither_xarray_nor_what_draws(tmp_path):
    from femgear.trains.reading import read_case, with_values

    case, quick = tmp_path / "case.toml", {"static.positions": 8, "static.flank_elements": 6, "runup.count": 2}
    quick |= {"dynamics.mesh_harmonics": 2, "operation.speeds": ["250 rpm"]}
    case.write_text(with_values(read_case(CASE), quick).source, encoding="utf-8")
    arguments = ["run", str(case), "-o", str(tmp_path / "out"), "--no-pictures"]
    (loaded,) = loaded_after(f"from femgear.cli import main; main({arguments!r})")
    assert (HEAVY - {"skfem"} | DRAWING) & loaded == set()


def test_no_function_is_longer_than_70_lines():
    """Without its docstring, which is as long as it must be."""
    functions = ast.FunctionDef, ast.AsyncFunctionDef
    long = {}
    for path in MODULES:
        for node in of_kinds(path, *functions):
            described = ast.get_docstring(node) is not None
            first = node.body[0].end_lineno if described else node.lineno
            if node.end_lineno - first >= 70:
                long[f"{place(path)}:{node.name}"] = node.end_lineno - first
    assert not long


FOREIGN = {
    "case/text.py": "where a TOML file is wrong, the library tells in words alone",
    "commands/process.py": "so does Python, of a thread that cannot be started",
}
"""Modules that read messages of others, for want of anything else."""


def read_texts(path: Path) -> list[ast.expr]:
    """Expressions in which words are looked for, or which are cut or changed."""
    reading = {"startswith", "endswith", "removesuffix", "removeprefix", "replace", "partition", "rpartition"}
    reading |= {"split", "rsplit", "find", "index", "count"}
    texts = []
    for node in of_kinds(path, ast.Call):
        if not isinstance(node.func, ast.Attribute):
            continue
        if node.func.attr in reading and (node.func.attr != "split" or node.args):  # which puts a text on one line
            texts.append(node.func.value)
        elif node.func.attr in ("match", "search", "fullmatch") and ast.unparse(node.func.value) == "re":
            texts.append(node.args[1])
    comparisons = of_kinds(path, ast.Compare)
    return texts + [node.comparators[0] for node in comparisons if isinstance(node.ops[0], ast.In | ast.NotIn)]


def is_prose(text: ast.expr, remedies: set[str]) -> bool:
    """Whether a text is that of a refusal or a finding; ``remedies`` are names of single ones."""
    errors = ("error", "finding", "problem", "fault", "one", "reason", "first", "exception")
    if isinstance(text, ast.Attribute):
        of_error = isinstance(text.value, ast.Name) and text.value.id in errors
        return text.attr in ("message", "remedy") or (text.attr in ("limit", "text") and of_error)
    if isinstance(text, ast.Call) and ast.unparse(text.func) == "str" and text.args:
        return isinstance(text.args[0], ast.Name) and text.args[0].id in errors
    return isinstance(text, ast.Name) and text.id in {"message", "remedy", *remedies}


def test_no_module_reads_prose():
    """Refusals and findings are data: no condition hangs on words of a message, a remedy or a limit."""
    wrong = defaultdict(list)
    for path in MODULES:
        loops = of_kinds(path, ast.For, ast.comprehension)
        of_remedies = (loop.target for loop in loops if ast.unparse(loop.iter).endswith("remedies"))
        remedies = {target.id for target in of_remedies if isinstance(target, ast.Name)}
        for text in read_texts(path):
            if is_prose(text, remedies):
                wrong[place(path)].append(f"{text.lineno}: {ast.unparse(text)}")
    assert {name: texts for name, texts in wrong.items() if name not in FOREIGN} == {}
    assert wrong.keys() >= FOREIGN.keys()


def test_a_public_name_is_defined_once():
    """Functions and classes, methods and private names aside: no two modules call two things alike."""
    places = defaultdict(set)
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in tree(path).body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
                places[node.name].add(path)
    assert {name: sorted(map(place, paths)) for name, paths in places.items() if len(paths) > 1} == {}


SAYS_NOTHING = {"found", "one", "own", "some", "told", "known", "asked", "heard", "met"}
"""Names that could hold anything."""


def test_variables_fields_and_parameters_say_what_they_hold():
    wrong = []
    scripts, programs = (sorted((PACKAGE.parent / folder).rglob("*.py")) for folder in ("scripts", "validation"))
    assert len(scripts) > 40 and len(programs) > 150  # examples, published sets and references among them
    for path in (*MODULES, *scripts, *programs):
        names = [(node.id, node) for node in of_kinds(path, ast.Name) if isinstance(node.ctx, ast.Store)]
        names += [(node.attr, node) for node in of_kinds(path, ast.Attribute) if isinstance(node.ctx, ast.Store)]
        names += [(node.arg, node) for node in of_kinds(path, ast.arg)]
        wrong += [f"{path.name}:{node.lineno}: {name}" for name, node in names if name in SAYS_NOTHING]
    assert wrong == []
