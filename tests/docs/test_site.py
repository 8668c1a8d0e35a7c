"""The documentation as a site: every page is in it, links lead to headings, nothing comes from outside."""

import csv
import fnmatch
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.glob("*.md"))


def words(path: Path) -> str:
    """Text of a page without its blocks of code."""
    return re.sub(r"(?ms)^```.*?^```", "", path.read_text(encoding="utf-8"))


def anchors(path: Path) -> set[str]:
    """Anchors of the headings of a page, as GitHub and MyST make them."""
    headings = re.findall(r"(?m)^#+ (.+)$", words(path))
    plain = [re.sub(r"\[([^\]]*)\]\([^)]*\)|[*]", r"\1", heading).lower() for heading in headings]
    return {re.sub(r"[^\w\- ]", "", heading).replace(" ", "-") for heading in plain}


@pytest.mark.parametrize("page", [ROOT / "README.md", *PAGES], ids=lambda page: page.name)
def test_links_lead_to_headings(page):
    missing = []
    for name, anchor in re.findall(r"\]\(([^)#\s]*\.md)?#([^)\s]+)\)", words(page)):
        target = page.parent / name if name else page
        missing += [] if anchor in anchors(target) else [f"{name}#{anchor}"]
    assert missing == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_no_line_is_a_comment(page):
    """MyST leaves out lines that begin with a per cent sign, such as "0.2" and "% of it" on the next line."""
    assert re.findall(r"(?m)^\s*%.*$", words(page)) == []


def test_every_page_is_in_the_index():
    trees = re.findall(r"(?ms)^```\{toctree\}\n(.*?)^```", (DOCS / "index.md").read_text(encoding="utf-8"))
    lines = [line for tree in trees for line in tree.splitlines() if line and not line.startswith(":")]
    named = [re.sub(r".*<(\w+)>", r"\1", line) for line in lines]
    pages = {page.stem for page in PAGES} - {"index"}
    assert [page for page in sorted(pages) if not any(fnmatch.fnmatch(page, one) for one in named)] == []
    patterns = {one for one in named if "*" in one}
    assert set(named) - patterns == {page for page in pages if page in named} and len(named) == len(set(named))


def test_another_page_leads_to_every_page():
    """By a link or a card, beside the list of pages at the left."""
    for page in PAGES:
        others = [ROOT / "README.md", *(other for other in PAGES if other != page)]
        texts = [other.read_text(encoding="utf-8") for other in others]
        linked = [text for text in texts if f"({page.name}" in text or f":link: {page.stem}\n" in text]
        assert linked or page.stem == "index", page.name


@pytest.mark.slow
def test_the_site_builds_without_a_warning(tmp_path):
    """Without running the examples, which have tests of their own; no file of another host is asked for."""
    pytest.importorskip("sphinx", reason="make docs installs it")
    command = [
        sys.executable,
        "-m",
        "sphinx",
        "-b",
        "html",
        "-W",
        "--keep-going",
        "-q",
        "docs",
        str(tmp_path),
    ]
    options = ["-D", "plot_gallery=0"] if any((ROOT / "scripts/examples").glob("*.py")) else []
    done = subprocess.run([*command, *options], cwd=ROOT, capture_output=True, text=True, timeout=900, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    for page in tmp_path.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        loaded = re.findall(r"<(?:script|img|iframe|source)[^>]* src=\"([^\"]+)", text)
        loaded += re.findall(r"<link[^>]* rel=\"(?:stylesheet|preload|icon)\"[^>]* href=\"([^\"]+)", text)
        assert [one for one in loaded if re.match(r"(https?:)?//", one)] == [], page.name
    for sheet in tmp_path.rglob("*.css"):
        assert not re.search(r"url\([\"']?(https?:)?//", sheet.read_text(encoding="utf-8")), sheet.name
    table = (tmp_path / "validation.html").read_text(encoding="utf-8")
    with (DOCS / "validation.csv").open(encoding="utf-8", newline="") as file:
        assert table.count("<tr><td>") == sum(1 for _ in csv.reader(file)) - 1
    formulas = (tmp_path / "two_way.html").read_text(encoding="utf-8")
    assert "tex-svg.js" in formulas and (tmp_path / "_static" / "tex-svg.js").exists()
    index = (tmp_path / "searchindex.js").read_text(encoding="utf-8")
    assert '"validation"' in index and "side band" in index
