"""Who may import whom, and what must stay unimported until it is used."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "femgear"
LAYERS = (
    ("errors",),
    ("files", "system", "threads"),
    ("gears", "fe", "casefile", "netcdf", "solvers"),
    ("contact", "models", "housing", "case"),
    ("storage", "datasets", "plots", "scene", "dependencies", "frequency_limit"),
    ("analysis", "design", "summary"),
    ("report", "optimisation", "validation", "pictures"),
    ("run",),
    ("cli",),
)
RANK = {part: rank for rank, parts in enumerate(LAYERS) for part in parts}
HEAVY = {"gmsh", "pyvista", "vtk", "matplotlib", "dask", "skfem", "pint"}
MODULES = sorted(PACKAGE.rglob("*.py"))


def family(name: str) -> str:
    """``scene`` for ``scene_drawing``: a module split in two keeps its first name and its layer."""
    return name if name in RANK else name.split("_")[0] or name


def part_of(path: Path) -> str:
    return family(path.relative_to(PACKAGE).parts[0].removesuffix(".py"))


def imports(path: Path):
    """Import statements of a file, wherever they stand, but for those that only type checkers see."""
    pending = [ast.parse(path.read_text(encoding="utf-8"))]
    while pending:
        node = pending.pop()
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield node
        elif not (isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"):
            pending += ast.iter_child_nodes(node)


def imported_parts(path: Path) -> set[str]:
    """First name below ``femgear`` of everything that a file imports."""
    found = set()
    for node in imports(path):
        if isinstance(node, ast.Import):
            found |= {
                family(alias.name.split(".")[1]) for alias in node.names if alias.name.startswith("femgear.")
            }
            continue
        assert node.level == 0, f"{path}:{node.lineno}: relative import"
        if node.module == "femgear":
            found |= {family(alias.name) for alias in node.names if alias.name != "__version__"}
        elif node.module.startswith("femgear."):
            found.add(family(node.module.split(".")[1]))
    return found


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_imports_go_downwards_only(path):
    part = part_of(path)
    if part == "__init__":
        return
    assert part in RANK, f"{part} has no layer"
    for other in imported_parts(path) - {part}:
        assert other in RANK, f"{path} imports femgear.{other}, which has no layer"
        assert RANK[other] < RANK[part], f"{part} may not import {other}"


def test_solvers_know_nothing_but_the_waist():
    for path in (PACKAGE / "solvers").rglob("*.py"):
        assert imported_parts(path) <= {"errors", "system", "solvers"}
        for node in imports(path):
            names = (
                [node.module] if isinstance(node, ast.ImportFrom) else [alias.name for alias in node.names]
            )
            outside = {name.split(".")[0] for name in names} - set(sys.stdlib_module_names)
            assert outside <= {"femgear", "numpy", "scipy"}


def heavy_after(code: str) -> set[str]:
    script = f"import sys\n{code}\nprint()\nprint('|'.join({HEAVY!r} & sys.modules.keys()))"
    run = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=120, check=True
    )
    return set(filter(None, run.stdout.splitlines()[-1].split("|")))


@pytest.mark.parametrize(
    "code",
    [
        "import femgear",
        "import femgear.case.case",
        "import femgear.storage.results",
        "from femgear.cli import main; main(['--help'])",
        "from femgear.cli import main; main(['--version'])",
    ],
)
def test_heavy_libraries_are_imported_late(code):
    assert heavy_after(code) == set()
