"""Sphinx settings of the documentation; `make docs` builds it into out/docs/html."""

import ast
import builtins
import csv
import html
import inspect
import os
import re
import sys
from pathlib import Path
from pkgutil import resolve_name

os.environ.setdefault("MPLBACKEND", "agg")
DOCS = Path(__file__).resolve().parent
ROOT = DOCS.parent
sys.path.insert(0, str(ROOT))

import mathjax  # noqa: E402  of the package django-static-mathjax, which needs no Django
from docutils import nodes  # noqa: E402
from sphinx import addnodes  # noqa: E402
from sphinx.util.docutils import SphinxDirective  # noqa: E402
from sphinx_gallery.scrapers import matplotlib_scraper  # noqa: E402

import femgear  # noqa: E402

project = "femgear"
author = "the femgear developers"
copyright = author
version = release = femgear.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
    "sphinx_design",
]
exclude_patterns = ["_build", "_templates"]
templates_path = ["_templates"]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
highlight_language = "none"
# options such as --force keep their two hyphens
smartquotes_action = "qe"

myst_enable_extensions = ["attrs_block", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 4
# programs may be shown cut short; annotations have short names, and two classes are called Block
suppress_warnings = ["misc.highlighting_failure", "config.cache", "ref.python"]

# single backquotes in docstrings are names; those of femgear become links below
default_role = "literal"
autosummary_generate = True
autosummary_ignore_module_all = False
autodoc_default_options = {
    "members": True,
    "member-order": "bysource",
    "exclude-members": "model_config, model_post_init",
}
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
python_maximum_signature_line_length = 88
napoleon_google_docstring = False
# shapes such as (meshes, positions) are no names to link
napoleon_use_param = napoleon_use_rtype = False
napoleon_use_ivar = True


def shown_figures(block: tuple, block_vars: dict, gallery_conf: dict) -> str:
    """Take the figures of an example where it shows them: a cell may draw on what an earlier one began."""
    return matplotlib_scraper(block, block_vars, gallery_conf) if "plt.show()" in block[1] else ""


# scripts that draw: one page and one thumbnail each
EXAMPLES = ROOT / "scripts" / "examples"


def name_script(gallery_conf: dict, name: str, when: str) -> None:
    """Let an example know its own path, by which it finds the cases; the gallery does not tell it."""
    builtins.__dict__["__file__"] = str(EXAMPLES / name)


if any(EXAMPLES.glob("*.py")):
    extensions.append("sphinx_gallery.gen_gallery")
    sphinx_gallery_conf = {
        "examples_dirs": str(EXAMPLES),
        "gallery_dirs": "_generated/examples",
        "filename_pattern": r"\.py$",
        "image_scrapers": (shown_figures,),
        "reset_modules": ("matplotlib", name_script),
        "within_subsection_order": "FileNameSortKey",
        "download_all_examples": False,
        "write_computation_times": False,
        "show_memory": False,
        "show_signature": False,
        "min_reported_time": 1e6,
        "abort_on_example_error": True,
        "matplotlib_animations": False,
    }

html_theme = "furo"
html_title = "femgear"
# one file that draws formulas without asking a network for fonts
MATHJAX = Path(mathjax.__file__).parent / "static" / "mathjax" / "es5" / "tex-svg.js"
mathjax_path = MATHJAX.name
html_static_path = ["_static", str(MATHJAX)]
html_css_files = ["site.css"]
html_js_files = ["validation.js"]
html_favicon = html_logo = "_static/femgear.svg"
html_show_sourcelink = False
html_copy_source = False
html_show_copyright = False
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#0b5e8a", "color-brand-content": "#0b5e8a"},
    "dark_css_variables": {"color-brand-primary": "#6cc0ee", "color-brand-content": "#6cc0ee"},
}


class ValidationRows(SphinxDirective):
    """Table of docs/validation.csv, with a filter by words, theme and verdict."""

    def run(self) -> list[nodes.Node]:
        """Make the table as HTML: 1,750 rows of nodes would take minutes."""
        path = DOCS / "validation.csv"
        self.env.note_dependency(str(path))
        with path.open(encoding="utf-8", newline="") as file:
            names, *rows = ([*row[1:-1], row[0]] for row in csv.reader(file))  # the theme last, reasons above in prose
        head = "".join(f"<th>{name}</th>" for name in names)
        body = "\n".join(f"<tr>{''.join(f'<td>{html.escape(cell)}</td>' for cell in row)}</tr>" for row in rows)
        choices = "".join(_choice(name, [row[names.index(name)] for row in rows]) for name in ("theme", "verdict"))
        text = (
            f'<p class="filter"><input id="validation-words" type="search" placeholder="words" aria-label="words">'
            f'{choices}<output id="validation-count"></output></p>\n<div class="table-wrapper">'
            f'<table class="docutils" id="validation-rows"><thead><tr>{head}</tr></thead>\n'
            f"<tbody>{body}</tbody></table></div>"
        )
        return [nodes.raw("", text, format="html")]


class Fields(SphinxDirective):
    """Table of the fields of a dataclass: names, shape and meaning, as its docstring has them."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Make the table from the section Parameters of the docstring."""
        text = inspect.cleandoc(resolve_name(self.arguments[0]).__doc__).split("Parameters\n----------\n")[1]
        entries = re.findall(r"(?m)^(\w[\w, ]*?) : (.+)\n((?:    .*\n?|\n(?=    ))*)", text)
        lines = ["| fields | shape | meaning |", "|---|---|---|"]
        for names, shape, meaning in entries:
            cells = ", ".join(f"`{name}`" for name in names.split(", ")), shape, meaning
            lines.append("| " + " | ".join(" ".join(cell.replace("|", "\\|").split()) for cell in cells) + " |")
        return self.parse_text_to_nodes("\n".join(lines))


class Folders(SphinxDirective):
    """Table of the folders of femgear: their modules, and the first line of their docstring."""

    def run(self) -> list[nodes.Node]:
        """Make the table from the files that there are."""
        lines = ["| folder | what it holds | modules |", "|---|---|---|"]
        for path in sorted((ROOT / "femgear").rglob("__init__.py")):
            modules = ", ".join(f"`{module.stem}`" for module in sorted(path.parent.glob("*.py")) if module != path)
            words = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))).split("\n")[0]
            folder = path.parent.relative_to(ROOT).as_posix()
            lines.append(f"| `{folder}/` | {words.replace('``', '`')} | {modules} |")
        return self.parse_text_to_nodes("\n".join(lines))


def _choice(name: str, values: list[str]) -> str:
    """Menu of the different values, in their order."""
    options = "".join(f"<option>{html.escape(value)}</option>" for value in dict.fromkeys(values))
    return (
        f'<select id="validation-{name}" aria-label="{name}"><option value="">every {name}</option>{options}</select>'
    )


def title_of(name: str) -> str:
    """First heading of a page of docs/."""
    return (DOCS / name).read_text(encoding="utf-8").split("\n", 1)[0].removeprefix("# ")


def read_source(app, docname: str, source: list[str]) -> None:
    """Leave patterns of pages that match none out of the index, and say titles.

    A link whose text is the name of a file, as it is read on a disk, gets the title of the page.
    """
    if docname == "index":
        pattern = re.compile(r"(?m)^([\w/]+\*)\n")
        source[0] = pattern.sub(lambda line: line[0] if any(DOCS.glob(line[1] + ".*")) else "", source[0])
    source[0] = re.sub(r"\[(\w+\.md)\](?=\(\1)", lambda link: f"[{title_of(link[1])}]", source[0])


def widen(app, pagename: str, templatename: str, context: dict, doctree) -> None:
    """Give the wide table of the validation the room of the contents beside the text."""
    if pagename == "validation":
        context["furo_hide_toc"] = True


def read_docstring(app, what: str, name: str, obj, options, lines: list[str]) -> None:
    """Link names of femgear, and let bars be those of absolute values."""
    for number, line in enumerate(lines):
        parts = re.split(r"(``.*?``)", line)
        parts[::2] = (re.sub(r"`(femgear[\w.]+)`", r":py:obj:`\1`", part).replace("|", r"\|") for part in parts[::2])
        lines[number] = "".join(parts)


def keep_colons(app, what: str, name: str, obj, options, lines: list[str]) -> None:
    """Let a colon in the first line about a value stand: napoleon takes what is before it for a type."""
    if what in ("attribute", "data", "property"):
        lines[:0] = ["..", ""]


def name_keys(app, what: str, name: str, obj, options, signature: str, returns: str):
    """Show the keys of a table of the case file, without the windows and units that check them."""
    if what == "class" and (keys := getattr(obj, "model_fields", None)):
        return f"(*, {', '.join(keys)})", None
    return None


def drop_readers(app, domain: str, kind: str, content) -> None:
    """Leave out what a quantity of the case file is an alias of: its reader is no text."""
    for node in [node for node in content.children if node.astext().startswith("alias of Annotated")]:
        content.remove(node)


SYMBOL = re.compile(r"(?<![\w/.])([A-Za-zΑ-ω])_([A-Za-z0-9Α-ω]{1,8})(?!\w)")
VERBATIM = (nodes.literal, nodes.literal_block, nodes.math, nodes.math_block, nodes.raw, addnodes.desc_signature)


def set_subscripts(app, doctree) -> None:
    """Set symbols of the text, such as z_s, with subscripts; names in code stay."""
    for text in list(doctree.findall(nodes.Text)):
        parts, node = SYMBOL.split(str(text)), text.parent
        while node is not None and not isinstance(node, VERBATIM):
            node = node.parent
        if len(parts) > 1 and node is None:
            new = [nodes.Text(parts[0])]
            for letter, index, rest in zip(parts[1::3], parts[2::3], parts[3::3]):
                new += [nodes.Text(letter), nodes.subscript("", index), nodes.Text(rest)]
            text.parent.replace(text, new)


def tidy(app, doctree) -> None:
    """Put a dash for the two hyphens of napoleon, where words follow; leave out the values of long tables."""
    for text in list(doctree.findall(nodes.Text)):
        if " -- " in text and not isinstance(text.parent, nodes.literal | nodes.literal_block):
            last = text.strip() == "--" and text.parent.astext().rstrip().endswith("--")
            text.parent.replace(text, nodes.Text("" if last else text.replace(" -- ", " – ")))
    for value in list(doctree.findall(addnodes.desc_annotation)):
        if value.astext().startswith(" = ") and len(value.astext()) > 300:
            value.parent.remove(value)


def setup(app) -> None:
    """Connect what changes the sources."""
    app.add_directive("validation-rows", ValidationRows)
    app.add_directive("fields", Fields)
    app.add_directive("folders", Folders)
    app.connect("html-page-context", widen, priority=900)
    app.connect("doctree-read", tidy)
    app.connect("doctree-read", set_subscripts)
    app.connect("source-read", read_source)
    app.connect("autodoc-process-docstring", keep_colons, priority=400)
    app.connect("autodoc-process-signature", name_keys)
    app.connect("object-description-transform", drop_readers)
    app.connect("autodoc-process-docstring", read_docstring)
