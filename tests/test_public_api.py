"""What users may rely on changes only together with the list of it, and with a line in CHANGELOG.md."""

import ast
import importlib
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "validation" / "tools"))

import public_api

REMEDY = """the public interface is not that of tests/public_api.txt.
Where this is meant, run `python validation/tools/public_api.py` and add a line under "Unreleased" in CHANGELOG.md;
a name that goes or is renamed stays for one minor release with a DeprecationWarning (CONTRIBUTING.md).
"""


def test_names_and_signatures_are_those_of_the_list():
    listed, found = public_api.FILE.read_text(encoding="utf-8").splitlines(), public_api.lines()
    gone, new = set(listed) - {*found}, set(found) - {*listed}
    assert not gone and not new, "\n".join(
        [REMEDY, *(f"- {one}" for one in sorted(gone)), *(f"+ {one}" for one in sorted(new))]
    )


def test_every_name_of_the_list_can_be_imported():
    import femgear

    names = [line.split(" = ")[0] for line in public_api.FILE.read_text(encoding="utf-8").splitlines()]
    assert {f"femgear.{name}" for name in femgear.__all__} - {"femgear.__version__"} <= {*names}
    for name in (line.split("(")[0] for line in names):
        module, _, attribute = name.rpartition(".")
        if module.rpartition(".")[2][0].islower():  # else a method
            assert hasattr(importlib.import_module(module), attribute), name


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("def solve(case", "def solve(problem"),
        ("only: str | None = None, *,", "only: str | None = 'modes', *,"),
        ("def solve(case", "def _solve(case"),
        ("-> Solution:", "-> dict:"),
    ],
)
def test_a_changed_signature_is_seen(monkeypatch, before, after):
    text = (public_api.ROOT / "femgear" / "run.py").read_text(encoding="utf-8")
    assert before in text
    tree = public_api._tree
    changed = ast.parse(text.replace(before, after))
    monkeypatch.setattr(public_api, "_tree", lambda name: changed if name == "femgear.run" else tree(name))
    with pytest.raises(AssertionError, match="Unreleased"):
        test_names_and_signatures_are_those_of_the_list()
