"""What a release is made of: dependencies, versions, recipe, hooks and the paper say the same as the code."""

import re
import sys
import tomllib
from functools import cache
from importlib.metadata import packages_distributions, requires
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
CHANGES = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
RELEASED = re.findall(r"(?m)^## \[(\d+\.\d+\.\d+)\]", CHANGES)
# names of conda-forge that are not those of PyPI
CONDA = {
    "gmsh": ("gmsh", "python-gmsh"),
    "matplotlib": ("matplotlib-base",),
    "h5netcdf": ("h5netcdf", "h5py"),
}


def read(name):
    return (ROOT / name).read_text(encoding="utf-8")


def names(requirements):
    return {Requirement(one).name.lower() for one in requirements}


@cache
def imported():
    """Distributions of all that femgear imports, anywhere."""
    modules, owners = set(), packages_distributions()
    for path in (ROOT / "femgear").rglob("*.py"):
        # lines that look like imports; those of sentences name no module that is installed
        modules |= {*re.findall(r"(?m)^ *(?:import|from) (\w+)", path.read_text(encoding="utf-8"))}
    modules -= sys.stdlib_module_names | {"femgear"}
    return {owners[one][0].lower().replace("_", "-") for one in modules if one in owners}


def test_what_is_imported_is_declared_and_what_is_declared_is_imported():
    core, extras = names(PROJECT["dependencies"]), PROJECT["optional-dependencies"]
    optional = set().union(*(names(extras[extra]) for extra in ("app", "assistant", "cad", "cluster", "nvh")))
    # by pyvista, xarray, h5netcdf, dask, pydantic and nicegui
    brought = {"vtk", "pandas", "h5py", "distributed", "pydantic-core", "fastapi", "uvicorn"}
    assert imported() - brought <= core | optional
    # h5netcdf is the engine that xarray is told by name
    assert core - imported() == {"h5netcdf"} and not core & optional


def test_pictures_cost_no_package_that_pyvista_does_not_bring():
    """An extra for pictures would leave nothing out."""
    without = (one for one in requires("pyvista") or () if "extra ==" not in one)
    assert {"matplotlib", "pillow"} <= names(without)


def test_versions_of_the_files_of_a_release_are_the_last_one():
    assert "## [Unreleased]\n" in CHANGES and RELEASED[0] == max(RELEASED, key=lambda v: [*map(int, v.split("."))])
    assert yaml.safe_load(read("CITATION.cff"))["version"] == RELEASED[0]
    assert yaml.safe_load(read("recipe/recipe.yaml"))["context"]["version"] == RELEASED[0]


def test_the_recipe_has_the_dependencies_of_the_project():
    wanted = {}
    for one in map(Requirement, PROJECT["dependencies"]):
        for number, name in enumerate(CONDA.get(one.name, (one.name,))):
            wanted[name] = set() if name == "h5py" else {str(part) for part in one.specifier}
            assert number == 0 or name in {"python-gmsh", "h5py"}
    recipe = yaml.safe_load(read("recipe/recipe.yaml"))
    pairs = (re.match(r"(\S+) ?(.*)", one).groups() for one in recipe["requirements"]["run"])
    found = {name: {*filter(None, limits.split(","))} for name, limits in pairs}
    assert found.pop("python") == {">=${{ python_min }}"} and found == wanted
    least = yaml.safe_load(read("recipe/variants.yaml"))["python_min"]
    assert PROJECT["requires-python"] == f">={least[0]}"
    scripts = [f"{name} = {home}" for name, home in PROJECT["scripts"].items()]
    assert recipe["build"]["python"]["entry_points"] == scripts


def test_hooks_are_what_make_lint_runs():
    hooks = yaml.safe_load(read(".pre-commit-config.yaml"))["repos"][0]["hooks"]
    lint = re.search(r"(?m)^lint:.*\n((?:\t.*\n)+)", read("Makefile"))[1]
    for hook in hooks:
        assert hook["entry"].removeprefix(".venv/bin/python -m ") in lint and hook["language"] == "system"
    assert len(hooks) == len(lint.splitlines())


@pytest.mark.parametrize("path", sorted((ROOT / ".github" / "ISSUE_TEMPLATE").glob("[!c]*.yml")), ids=lambda p: p.stem)
def test_issue_forms_ask_for_something(path):
    form = yaml.safe_load(path.read_text(encoding="utf-8"))
    assert form["name"] and form["description"] and form["body"]
    ids = [one["id"] for one in form["body"]]
    assert len({*ids}) == len(ids) and all(one["attributes"]["label"] for one in form["body"])


@pytest.mark.parametrize("name", ["CHANGELOG.md", "CONTRIBUTING.md", "CODE_OF_CONDUCT.md"])
def test_files_and_commands_that_the_pages_name_exist(name):
    text, folders = read(name), "tests|scripts|docs|recipe|femgear"
    for path in re.findall(rf"\b(?:{folders}|CITATION|CHANGELOG|LICENSE)(?:/[\w./]+\w)?(?:\.\w+)?", text):
        place = ROOT / path.removesuffix(".__version__").rstrip(".")
        module = ROOT / path.replace(".", "/")
        found = place.exists() or module.is_dir() or module.with_suffix(".py").is_file()
        assert found or "NAME" in path, path
    for target in re.findall(r"`make ([a-z-]+)", text):
        assert re.search(rf"(?m)^{target}:", read("Makefile")), target
    for link in re.findall(r"\]\(((?!https?:)[^)]+)\)", text):
        assert (ROOT / link).exists(), link


def test_the_paper_is_short_and_cites_what_it_lists():
    _, head, text = read("paper/paper.md").split("---\n", 2)
    assert len(text.split()) <= 1000 and yaml.safe_load(head)["bibliography"] == "paper.bib"
    keys = re.findall(r"@\w+\{(\w+),", read("paper/paper.bib"))
    assert {*re.findall(r"@(\w+)", text)} == {*keys} and len({*keys}) == len(keys)


def test_publications_of_the_paper_are_cited_by_the_theory():
    theory = read("docs/theory.md")
    for entry in re.findall(r"@\w+\{\w+,\n(.*?)\n\}", read("paper/paper.bib"), re.DOTALL):
        author = re.search(r"author\s+= \{(?:.* and )?([\w]+),", entry)[1]
        year = re.search(r"year\s+= \{(\d+)\}", entry)[1]
        assert re.search(rf"{author}[^.]*?(?:\.[^.]*?){{0,8}}{year}", theory), (author, year)


@pytest.mark.parametrize(
    ("row", "figure"),
    [
        (r"NAFEMS LE1, elliptic membrane: stress yy at D \[MPa\]\"?,92\.7,.*,passes", "92.7 MPa"),
        (r"27/40, 70 N/mm, pitch point: approach \[um\]\"?,.*\+0\.027 %", "0.027 %"),
        (r"sun-planet, 64 positions: secant stiffness, largest difference\"?,0,0\.0064,", "0.64 %"),
        (r"sun-planet, 64 positions: tangent stiffness, largest difference\"?,0,0\.0078,", "0.78 %"),
        (r"ring of 40 teeth, 1 kN on the flank: largest compression in the root.*\+1\.4 %", "1.4 %"),
        (r"3100 rpm, 5th mesh harmonic: lobes a carrier revolution\"?,6,6,0,exact,", "537/543 with six"),
    ],
)
def test_figures_of_the_paper_are_those_of_the_validation(row, figure):
    assert figure in read("paper/paper.md") and re.search(row, read("docs/validation.csv"))
