"""Write tests/public_api.txt: names and signatures that users may rely on.

They are what `femgear`, `femgear.solvers` and `femgear.study` offer, and what README, docs and examples
import.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FILE = ROOT / "tests" / "public_api.txt"
PACKAGES = ("femgear", "femgear.solvers", "femgear.study")


def lines() -> list[str]:
    """Write the names of the packages with their homes, then the signature of every home, sorted."""
    offered = dict(name for package in PACKAGES for name in _offered(package))
    homes = {*offered.values()} | {name for name in documented() if name not in offered}
    constants = [f"{name} = {home}" for name, home in sorted(offered.items())]
    return constants + [line for home in sorted(homes) for line in _signatures(*home.rsplit(".", 1))]


def documented() -> set[str]:
    """Find the names that README, docs and examples import."""
    paths = (ROOT / "README.md", *ROOT.glob("docs/**/*.md"), *ROOT.glob("scripts/examples/*.py"))
    text = "\n".join(path.read_text(encoding="utf-8") for path in paths)
    imports = re.findall(r"(?m)^\s*from (femgear[\w.]*) import (\([^)]*\)|.*)$", text)
    return {f"{module}.{name}" for module, names in imports for name in re.findall(r"\w+", names)}


@cache
def _tree(module: str) -> ast.Module:
    path = ROOT / module.replace(".", "/")
    path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    return ast.parse(path.read_text(encoding="utf-8"))


def _offered(package: str) -> Iterator[tuple[str, str]]:
    """Names that a package takes from its modules, those for type checkers among them, with their homes."""
    for node in ast.walk(_tree(package)):
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith("femgear."):
            yield from ((f"{package}.{alias.name}", f"{node.module}.{alias.name}") for alias in node.names)


def _signatures(module: str, name: str) -> list[str]:
    """Signature of a function, a class with those of its methods, or the name of a constant."""
    for node in _tree(module).body:
        if isinstance(node, ast.FunctionDef) and node.name == name:
            return [f"{module}.{_function(node)}"]
        if isinstance(node, ast.ClassDef) and node.name == name:
            fields = (ast.unparse(annotated) for annotated in node.body if isinstance(annotated, ast.AnnAssign))
            shown = ", ".join(field for field in fields if not field.startswith("_"))
            methods = (method for method in node.body if isinstance(method, ast.FunctionDef))
            public = (method for method in methods if method.name == "__init__" or method.name[0] != "_")
            return [f"{module}.{name}({shown})", *(f"{module}.{name}.{_function(method)}" for method in public)]
    return [f"{module}.{name}"]


def _function(node: ast.FunctionDef) -> str:
    returns = f" -> {ast.unparse(node.returns)}" if node.returns else ""
    return f"{node.name}({ast.unparse(node.args)}){returns}"


if __name__ == "__main__":
    FILE.write_text("\n".join(lines()) + "\n", encoding="utf-8")
    print(f"{FILE.relative_to(ROOT)}: {len(lines())} lines")
