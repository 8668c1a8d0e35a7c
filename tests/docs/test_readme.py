"""README and docs: the example runs as printed, links lead somewhere, tables name what there is."""

import contextlib
import io
import re
from pathlib import Path
from pkgutil import resolve_name

import pytest

from femgear.trains.reading import every_section

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = [ROOT / "README.md", ROOT / "meshes" / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
COMMANDS = (ROOT / "docs" / "command_line.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", README, flags=re.MULTILINE | re.DOTALL)


@pytest.fixture(scope="module")
def printed():
    """What the example of the README prints when it is run as it stands, in the root of the repository."""
    (example,) = blocks("python")
    output = io.StringIO()
    with contextlib.chdir(ROOT), contextlib.redirect_stdout(output):
        exec(compile(example, "README.md", "exec"), {"__name__": "__main__"})
    return output.getvalue()


def test_the_example_prints_what_the_readme_says(printed):
    assert blocks("text")[0] == printed


def test_the_example_is_short():
    (example,) = blocks("python")
    assert len([line for line in example.splitlines() if line.strip()]) <= 12


def test_the_readme_is_a_front_page():
    """A screen and a half of text; what is longer stands in docs/."""
    prose = re.sub(r"(?ms)^```.*?^```|<[^>]+>|\]\([^)]*\)", "", README)
    assert len(prose.split()) < 450 and README.count("\n") < 110


def test_what_the_readme_says_of_its_checks():
    """Numbers of the section on verification: no more than the pages have."""
    pages = {
        name: (ROOT / "docs" / f"{name}.md").read_text("utf-8") for name in ("validation", "reliability", "benchmarks")
    }
    claimed = README.split("## How it is verified")[1].split("\n## ")[0]
    rows, changes, trials = (int(one.replace(",", "")) for one in re.findall(r"[Mm]ore than ([\d,]+)", claimed))
    passes = re.findall(r"(\d+) rows: (\d+) passes", pages["validation"])[0][1]
    assert 0 <= int(passes) - rows < 300
    mutants, killed = re.findall(r"has (\d+) mutants\s.*?They killed (\d+),", pages["reliability"], re.DOTALL)[0]
    assert int(killed) > changes and f"{changes} of {mutants} changed expressions" in claimed
    table = re.findall(r"(?m)^\| [A-Z][\w ]+ \| \d+ \| (\d+) \| (\d+) \|", pages["reliability"])
    assert sum(int(one) for one, _ in table) > trials and not sum(int(failures) for _, failures in table)
    whole = re.findall(r"whole computation, grids cached \|  \| (\d+)", pages["benchmarks"])[0]
    assert f"takes {int(whole) / 1e3:.2f} s on two cores" in claimed


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_to_files(page):
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    targets = re.findall(r"\]\(([^)#\s]+)[^)]*\)", text) + re.findall(r'(?:src|href)="([^"]+)"', text)
    missing = [t for t in targets if "://" not in t and not (page.parent / t).exists()]
    assert missing == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_no_page_names_this_machine_or_unfinished_work(page):
    assert not re.search(r"/home/|/tmp/|/work/|/root/|TODO|FIXME", page.read_text(encoding="utf-8"))


def test_pictures_are_small():
    folders = (ROOT / "docs" / name for name in ("images", "front", "_static"))
    sizes = {path: path.stat().st_size for folder in folders for path in folder.rglob("*.*")}
    assert max(sizes.values()) < 300_000 and sum(sizes.values()) < 6e6


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_pages_name_modules_and_files_that_exist(page):
    text = page.read_text(encoding="utf-8")
    for name in set(re.findall(r"(?<![\w/.])femgear(?:\.\w+)+", text)):
        resolve_name(name)
    named = set(re.findall(r"\b(?:femgear|scripts|tests|benchmarks|cases)/[\w/]+(?:\.\w+)?", text))
    assert [name for name in sorted(named) if not (ROOT / name).exists()] == []


def test_docstrings_name_what_exists():
    for path in (ROOT / "femgear").rglob("*.py"):
        for name in set(re.findall(r"`(femgear(?:\.\w+)+)`", path.read_text(encoding="utf-8"))):
            resolve_name(name)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_pages_name_commands_that_exist(page):
    from femgear.cli import program

    text = page.read_text(encoding="utf-8")
    fenced = re.findall(r"^```.*?^```", text, flags=re.MULTILINE | re.DOTALL)
    named = re.findall(r"`femgear ([a-z]+)", text)
    named += re.findall(r"^(?:\S+/)?femgear ([a-z]+)", "\n".join(fenced), flags=re.MULTILINE)
    assert set(named) <= set(program.app)


def test_command_table_names_every_command_and_script():
    from femgear.cli import program

    commands = {name for name in program.app if not name.startswith("-")}
    assert commands >= {"check", "run", "report", "sweep", "schema"}
    assert commands <= set(re.findall(r"`femgear (\w+)", COMMANDS))
    assert "| `python validation " in COMMANDS
    helpers = {"script_tools.py", "drivetrain_figures.py"}
    scripts = {path.name for path in (ROOT / "scripts").glob("*.py")} - helpers
    assert scripts <= set(re.findall(r"scripts/(\w+\.py)", COMMANDS))


def documented(page: str) -> set[str]:
    """Names in the first columns of the tables of a page."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    cells = re.findall(r"^\|([^|]*)\|", text, flags=re.MULTILINE)
    return {name for cell in cells for name in re.findall(r"`([\w.]+)`", cell)}


def case_keys(model) -> set[str]:
    """Names of the keys of a section and of those below it."""
    from pydantic import BaseModel

    found = set()
    pending = [model]
    while pending:
        section = pending.pop()
        for name, field in section.model_fields.items():
            inner = [t for t in _types(field.annotation) if isinstance(t, type) and issubclass(t, BaseModel)]
            pending += inner
            if not inner or section is not every_section():
                found.add(field.alias or name)
    return found


def _types(annotation):
    from typing import get_args

    yield annotation
    for part in get_args(annotation):
        yield from _types(part)


def test_case_file_page_names_every_key():
    text = (ROOT / "docs" / "case_file.md").read_text(encoding="utf-8")
    assert [key for key in sorted(case_keys(every_section())) if f"`{key}`" not in text] == []
    assert documented("case_file.md") <= case_keys(every_section())


def test_case_file_page_has_every_section():
    text = (ROOT / "docs" / "case_file.md").read_text(encoding="utf-8")
    headings = " ".join(re.findall(r"^## (.+)$", text, flags=re.MULTILINE))
    sections = set(every_section().model_fields) - {"format", "title"}
    assert [name for name in sections if not re.search(rf"\b{name}\b", headings)] == []


def test_public_names():
    import femgear

    for name in femgear.__all__:
        assert getattr(femgear, name) is not None
    assert set(femgear.__all__) <= set(dir(femgear))
    with pytest.raises(AttributeError, match="no attribute 'compute'"):
        femgear.compute  # noqa: B018
