"""What a run shows: its numbers and warnings in tables, its pictures, and the page that holds everything.

Figures are PNG, grids VTU, the turning carrier is a GIF; the page is one HTML file that loads nothing else.
"""

from __future__ import annotations

import base64
import hashlib
import io
import json
import os
import re
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from html import escape
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from femgear.errors import printable
from femgear.findings import Finding, by_severity, counted, remark
from femgear.report.charts import chart
from femgear.report.explorer import DRAWN, EXPLORER
from femgear.report.solid import SOLID
from femgear.report.space import SPACE
from femgear.report.style import png_bytes
from femgear.report.tables import Block
from femgear.second_process import shared
from femgear.storage.disk_errors import storage_errors
from femgear.storage.files import checksum, write_bytes, write_text

if TYPE_CHECKING:
    from femgear.stages.judgements import Judgement
    from femgear.stages.protocol import Drawn, Figures, Progress, Train
    from femgear.storage.results import Results


_Call = Callable[[], object]
_LARGEST_PICTURE = 8_000_000
"""Bytes of a picture on the page."""
_OTHER = "Other pictures"
"""Section of those that no stage describes."""
# what HTML and UTF-8 do not hold, and what reverses the order of the text around it
_CONTROLS = re.compile(r"[\x00-\x08\x0b-\x1f\x7f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
_KINDS = {".png": "image/png"}
_WEB = Path(__file__).parent / "web"
"""Style sheet, scripts, and the libraries that they draw with."""
_CHARTS = "charts.json"
"""File of what the charts of the page show."""
_DATA = {_CHARTS: "charts", SOLID: "solid", SPACE: "space", EXPLORER: "runup"}
"""Files of a run that the scripts of its page draw, and their names there."""
_WORDS_ROOM = 2200
"""Characters of the longest card and of the sentence, which is four cards wide, over the width of all, from which on
gears and charts below are drawn smaller."""
_CAPTION = 100
"""Most characters of a note on the gears that stands below them on page one."""
POINTER = "The pointer names parts. "
"""What is said of parts in space on a screen."""
_BODIES = {"gear": "gears", "shaft": "shafts", "bearing": "bearings"}
_BODIES |= {"sensor": "sensors (red)", "foot": "feet (black)"}
"""Words of the kinds of `femgear.report.space.SpaceBody`."""
_PARTS = {
    "solid": ("three.min.js", "view.js", "solid.js"),
    "space": ("three.min.js", "view.js", "space.js"),
    "runup": ("explorer.js",),
}
"""Scripts of the parts of the page that have a place of their own."""
_LATER = '<script type="text/plain" class="later">'
"""Beginning of a script that `later.js` runs."""


def write_figures(
    folder: Path, train: Train, drawn: Drawn, beside: _Call = lambda: None, tell_others: _Call = lambda: None
) -> list[str]:
    """Write the figures of the stages whose data are there, and of the case; returns the file names.

    They are drawn in two processes where there are two cores, and in this one ``beside()`` comes first;
    ``told()`` is called after every part that this one draws. What their charts on the page show is written
    with them.
    """
    import matplotlib.backends.backend_agg  # noqa: F401  before the process is copied

    def pictures(stage: Figures) -> dict[str, tuple[bytes, Any]]:
        drawings = {name: (png_bytes(figure), chart(figure)) for name, figure in stage.draw(drawn).items()}
        tell_others()  # to nobody from a second process
        return drawings

    tasks = [partial(pictures, stage) for stage in _drawn(train, drawn)]
    drawings = {name: both for part in shared(tasks, beside) for name, both in part.items()}
    if not drawings:
        return []
    for name, (data, _) in drawings.items():
        write_bytes(data, folder / f"{name}.png")
    charts = {name: value for name, (_, value) in drawings.items() if value is not None}
    write_text(json.dumps(charts, allow_nan=False, separators=(",", ":")), folder / _CHARTS)
    return [*(f"{name}.png" for name in drawings), _CHARTS]


def _drawn(train: Train, drawn: Drawn) -> list[Figures]:
    """List the figures of the stages whose data are there, in their order, and of the case."""
    figures, names = train.figures, [*(s.name for s in train.stages if s.name in drawn.data), ""]
    return [figures[name] for name in names if name in figures]


def write_pictures(folder: Path, train: Train, drawn: Drawn, *, progress: Progress) -> list[str]:
    """Write everything that a run shows; returns the names of the files.

    ``train`` is that of the case, ``progress`` is called with (stage, done, total).
    """
    stages, names, done, here = _drawn(train, drawn), [], count(1), os.getpid()
    others = [write for stage in stages for write in stage.write]
    steps = len(stages) + len(others)

    def count_picture() -> None:
        if os.getpid() == here:
            progress("pictures", next(done), steps)

    def write_others() -> None:
        progress("pictures", 0, steps)
        for write in others:
            names.extend(write(drawn, folder))
            count_picture()

    figures = write_figures(folder, train, drawn, write_others, count_picture)
    progress("pictures", steps, steps)
    return figures + names


@dataclass(frozen=True)
class _Picture:
    """A picture of the page: ``name`` of its file without suffix, ``section`` that it stands in, and ``caption``.

    ``kind`` is its media type, ``"image/png"``, and ``data`` are its bytes.
    """

    name: str
    section: str
    caption: str
    kind: str
    data: bytes


def page(train: Train, results: Results, *, static: bool = False) -> str:
    """Make the page of a run as HTML text: tables, warnings, charts, pictures, provenance.

    Everything that it shows is in the page, which loads nothing else. The same results give the same text.

    Parameters
    ----------
    train : Train
        Of the case of the results.
    results : Results
    static : bool
        Pictures instead of charts, and no scripts: for paper, and where scripts are not allowed.

    Raises
    ------
    StorageError
        Files were changed since the run.
    """
    case = results.case
    pictures, skipped = _pictures(train, results)
    data = {} if static else shown_data(results)
    if "runup" in data:
        pictures = [picture for picture in pictures if picture.name not in DRAWN]
        data["charts"] = {name: value for name, value in data.get("charts", {}).items() if name not in DRAWN}
    warnings = [*by_severity(results.findings), *skipped]
    numbers = {block.title: block for block in train.describe_results(results)} | train.describe_stages(results)
    sections = [*(stage.title for stage in train.stages), _OTHER]
    notice = f'<p class="warn"><a href="#warnings">Warnings: {counted(warnings)}</a></p>\n' if warnings else ""
    unfolded = not data  # without scripts nothing opens what is folded away for paper
    charts = data.get("charts", {})
    gears, verdict = train.describe(case), tuple(train.verdict(results))
    head = "".join(
        (
            f"<h1>{escape(case.title)}</h1>\n",
            _contents(sections, numbers, pictures),
            _front(train, results, charts, _caption(gears, data)),
            notice,
            folded("verdict", "Verdict in numbers", "".join(map(table, verdict)), True) if verdict else "",
            folded("gears", "Gears and operation", "".join(map(table, gears)), unfolded),
        )
    )
    parts = {stage.title: part_of(stage.name) for stage in train.stages if stage.name in {*data} & {*_PARTS}}
    body = "".join(
        _section(name, numbers, pictures, charts, train, results, parts.get(name, ""), unfolded) for name in sections
    )
    main = f"{head}{body}{_trust(results, numbers, warnings, unfolded)}"
    return document(case.title, main, {"charts": charts} | data if data else None)


def document(title: str, main: str, data: dict[str, Any] | None, *, script: str = "") -> str:
    """Make an HTML file of its title, its contents and what scripts draw, none where it is None, and a script more."""
    scripts = "" if data is None else _scripts(data, script)
    main, title = (_CONTROLS.sub(lambda match: printable(match[0]), text) for text in (main, escape(title)))
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{_policy(scripts)}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{title}</title>\n<style>{(_WEB / 'page.css').read_text('utf-8')}</style>\n</head>\n<body>\n"
        f"<main>\n{main}</main>\n{scripts}</body>\n</html>\n"
    )


def _scripts(data: dict[str, object], script: str) -> str:
    """Data and scripts of a page that can be read off and turned, which run once its words are seen."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"), sort_keys=True)
    packed = base64.b64encode(zlib.compress(text.encode(), 9)).decode("ascii")
    parts = [name for part, names in _PARTS.items() if any(key.startswith(part) for key in data) for name in names]
    files = ("plotly-cartesian.min.js", "charts.js", *parts)
    texts = [*((_WEB / name).read_text("utf-8") for name in files), *([script] if script else [])]
    scripts = "".join(f"{_LATER}{text}</script>\n" for text in texts)
    scripts += f"<script>{(_WEB / 'later.js').read_text('utf-8')}</script>\n"
    return (
        '<noscript><p class="note">Charts need scripts, which are in this file: femgear report --static '
        "writes a page without any.</p></noscript>\n"
        f'<script type="text/plain" id="data">{packed}</script>\n{scripts}'
    )


def _policy(scripts: str) -> str:
    """Allow the page its own scripts, by their checksums, and nothing from anywhere."""
    texts = re.findall(rf"(?:<script>|{_LATER})(.*?)</script>", scripts, re.DOTALL)
    digests = [base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in texts]
    allowed = " ".join(f"'sha256-{digest}'" for digest in digests) or "'none'"
    return (
        f"default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; script-src {allowed}; "
        "base-uri 'none'; form-action 'none'"
    )


def _contents(sections, numbers, pictures) -> str:
    """Link to the sections that there are."""
    shown = [name for name in sections if name in numbers or any(p.section == name for p in pictures)]
    links = [("gears", "Gears"), *((_anchor(name), name) for name in shown), ("trust", "Trust")]
    return "<nav>" + " ".join(f'<a href="#{key}">{escape(text)}</a>' for key, text in links) + "</nav>\n"


def _anchor(name: str) -> str:
    """Name a section in links."""
    return name.lower().replace(" ", "-")


def _front(train: Train, results: Results, charts, caption: tuple[str, str] | None) -> str:
    """Make page one: what the train does, a sentence, a card for every question, the gears in space and two charts.

    The gears are drawn in space where there is a caption of them.
    """
    sentence, judgements = train.summary(results)
    texts = {"duty": train.duty(results.case), "sentence": sentence}
    text = "".join(f'<p class="{kind}">{escape(words)}</p>\n' for kind, words in texts.items() if words)
    cards = "".join(map(_card, judgements))
    shown = "".join(front_chart(*place) for place in _front_places(train, charts))
    solid = "" if caption is None else part_of("solid").format(*map(escape, caption))
    charts_beside = f'<div class="charts">\n{shown}</div>\n' if shown else ""
    both = " both" * bool(solid and shown)
    below = f'<div class="top{both}">\n{solid}{charts_beside}</div>\n' if solid or shown else ""
    columns = 3 if len(judgements) == 6 else min(len(judgements), 5)
    on_paper = 2 if len(judgements) < 5 else 3
    style = f"--columns: {columns}; --paper-columns: {on_paper}"
    listed_cards = f'<ul class="cards" style="{style}">\n{cards}</ul>\n' if cards else ""
    longest = max((len(judgement.answer) + len(judgement.limit) for judgement in judgements), default=0)
    many = " many" * (columns < len(judgements) or longest * columns + 4 * len(sentence) > _WORDS_ROOM)
    return f'<section class="front{many}" aria-label="Page one">\n{text}{listed_cards}{below}</section>\n'


def _caption(gears: Sequence[Block], data) -> tuple[str, str] | None:
    """Say what is seen of the gears in space, and what the pointer does beside; None where nothing was drawn."""
    if "solid" in data:
        notes = [note for note in gears[0].notes[:2] if len(note) <= _CAPTION]
        return ". ".join([*filter(None, ["; ".join(notes)]), "Blue: paths of contact, on the lines of action."]), ""
    if "space" not in data:
        return None
    kinds = {body["kind"] for body in data["space"]["bodies"]}
    words = [words for kind, words in _BODIES.items() if kind in kinds]
    box = "; the pale box stands for the casing, whose shape the case does not have, and moves as its seats do"
    box *= "casing" in data["space"]
    return f"{' and '.join(', '.join(words).rsplit(', ', 1)).capitalize()}{box}.", POINTER


def _front_places(train: Train, charts) -> list[tuple[str, int]]:
    """Choose the charts of page one: the first two that there are."""
    places = []
    for stem, panel in train.front:
        name = next((name for name in charts if name == stem or name.startswith(stem + "_")), None)
        if name in charts and panel < len(charts[name]["panels"]):
            places.append((name, panel))
    return places[:2]


def _card(judgement: Judgement) -> str:
    """Write the card of a question: its state in colour, sign and word, the answer, and what limits it."""
    limit = f'<p class="limit">{escape(judgement.limit)}</p>' if judgement.limit else ""
    return (
        f'<li class="card {judgement.state}"><p class="question">{escape(judgement.question)} '
        f"<b>{escape(judgement.words)}</b></p>"
        f'<p class="answer">{escape(judgement.answer)}</p>{limit}</li>\n'
    )


def front_chart(name: str, panel: int) -> str:
    """Place of one panel of a chart on page one."""
    words = escape(name.replace("_", " "))
    place = f'data-chart="{escape(name)}" data-panel="{panel}"'
    return f'<div class="chart" role="group" aria-label="{words}" {place}></div>\n'


def folded(key: str, title: str, content: str, shown: bool) -> str:
    """Fold a section away under its title; paper, and pages without scripts, show it."""
    return f'<details id="{key}"{" open" * shown}>\n<summary><h2>{escape(title)}</h2></summary>\n{content}</details>\n'


def part_of(name: str) -> str:
    """Read the place of what scripts draw of a whole set or run."""
    return (_WEB / f"{name}.html").read_text("utf-8")


def _section(
    name: str, numbers, pictures, charts, train: Train, results: Results, part: str = "", static: bool = False
) -> str:
    """Show tables and pictures of a stage, folded away under its title; nothing without any."""
    blocks = [numbers[name]] if name in numbers else []
    for stage in train.stages:
        if stage.title == name and stage.name in results.stages:
            blocks += stage.tables(results)
    figures = [picture for picture in pictures if picture.section == name]
    if not blocks and not figures:
        return ""
    tables = "".join(table(block, heading=i > 0) for i, block in enumerate(blocks))
    content = part + tables + "".join(_figure(figure, charts) for figure in figures)
    return folded(_anchor(name), name, content, static)


def table(block: Block, *, heading: bool = True) -> str:
    """Write a table with its notes as HTML."""
    title = f"<h3>{escape(block.title)}</h3>\n" if heading and not block.rows else ""
    header = "".join(f'<th scope="col">{escape(text)}</th>' if text else "<td></td>" for text in block.header)
    rows = "".join(f"<tr>{_cells(row)}</tr>\n" for row in block.rows)
    whole = ""
    if header or rows:
        caption = f"<caption>{escape(block.title)}</caption>\n"
        head = f"<thead><tr>{header}</tr></thead>\n" if header else ""
        body = f"{caption}{head}<tbody>\n{rows}</tbody>"
        whole = f'<div class="wide" tabindex="0"><table>\n{body}\n</table></div>\n'
    notes = "".join(f'<p class="note">{escape(note)}</p>\n' for note in block.notes)
    return title + whole + notes


def _cells(row) -> str:
    """Cells of a row; the first one names it."""
    first, *others = map(escape, row)
    name = f'<th scope="row">{first}</th>' if first else "<td></td>"
    return name + "".join(f"<td>{cell}</td>" for cell in others)


def chart_figure(name: str, caption: str) -> str:
    """Place of a chart, with its caption."""
    text = escape(caption)
    return (
        f'<figure>\n<div class="chart" role="group" aria-label="{text}" data-chart="{escape(name)}"></div>\n'
        f"<figcaption>{text}</figcaption>\n</figure>\n"
    )


def _figure(picture: _Picture, charts) -> str:
    """Embed a chart, or the picture where there is none, with its caption."""
    caption = escape(picture.caption)
    if picture.name in charts:
        return chart_figure(picture.name, picture.caption)
    data = base64.b64encode(_lean(picture)).decode("ascii")
    return (
        f'<figure>\n<img alt="{caption}" src="data:{picture.kind};base64,{data}">\n'
        f"<figcaption>{caption}</figcaption>\n</figure>\n"
    )


def _lean(picture: _Picture) -> bytes:
    """Picture in 256 colours, a third as large; those of few colours stay as they are to the eye."""
    if picture.kind != "image/png":
        return picture.data
    from PIL import Image

    stream = io.BytesIO()
    with Image.open(io.BytesIO(picture.data)) as image:
        reduced = image.convert("RGB").quantize(256, Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    reduced.save(stream, "PNG", optimize=True)
    return min(stream.getvalue(), picture.data, key=len)


def shown_data(results: Results) -> dict[str, Any]:
    """Read what scripts draw of a run, by the name they know it by; nothing of files that were changed."""
    contents = {key: _own_bytes(results, name) for name, key in _DATA.items()}
    return {key: json.loads(data) for key, data in contents.items() if data is not None}


def _own_bytes(results: Results, name: str) -> bytes | None:
    """Read a file of a run; None where it is missing or was changed since."""
    path = results.folder / name
    digest = results.manifest.files.get(name)
    if digest is None or not path.is_file() or path.is_symlink() or checksum(path) != digest:
        return None
    with storage_errors(path):
        return path.read_bytes()


def _pictures(train: Train, results: Results) -> tuple[list[_Picture], list[Finding]]:
    """Read the pictures that the manifest names, in the order of the captions, and what was left out."""
    pictures, skipped = [], []
    for name in results.manifest.files:
        kind = _KINDS.get(Path(name).suffix)
        if kind is None and name not in _DATA:
            continue
        data = _own_bytes(results, name)
        if data is None:
            skipped.append(remark(f"{name} is missing or was changed since the run, and is not shown"))
        elif kind is not None and len(data) > _LARGEST_PICTURE:
            skipped.append(remark(f"{name} is too large for this page ({len(data) / 1e6:.1f} MB)"))
        elif kind is not None:
            stem = Path(name).stem
            rank, section, caption = caption_of(train, stem)
            caption = " ".join((caption, *train.remarks(results, stem)))
            pictures.append((rank, _Picture(stem, section, caption, kind, data)))
    pictures.sort(key=lambda item: item[0])
    return [picture for _, picture in pictures], skipped


def caption_of(train: Train, stem: str) -> tuple[int, str, str]:
    """Find place in the order, section and caption of a picture from its file name."""
    captions = [
        (stage.title, *captioned)
        for stage in train.stages
        if stage.name in train.figures
        for captioned in train.figures[stage.name].captions.items()
    ]
    for rank, (section, prefix, caption) in enumerate(captions):
        if stem == prefix or stem.startswith(prefix + "_"):
            what = stem[len(prefix) :].strip("_").replace("_", " ")
            return rank, section, caption.replace(" ({})", f" ({what})" if what else "")
    return len(captions), _OTHER, re.sub("[_-]+", " ", stem)


def _said(finding: Finding) -> str:
    """Write a finding with its severity and its stage."""
    return f"{finding.severity}{f' of {finding.stage}' if finding.stage else ''}: {finding}"


def _value(value: Any) -> str:
    """Write what a solver says of its result; a dash for nothing."""
    if isinstance(value, list):
        return ", ".join(map(str, value)) or "none"
    if value is None or value != value:  # not a number, which the manifest stores as nothing
        return "-"
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def _trust(results: Results, numbers, warnings: Sequence[Finding], static: bool) -> str:
    """Show warnings, what the solvers say of their results, time, versions, checksums, the case as run."""
    manifest = results.manifest
    items = "".join(f'<li class="{warning.severity}">{escape(_said(warning))}</li>\n' for warning in warnings)
    items = f'<ul class="warnings">\n{items}</ul>\n' if items else '<p class="note">none</p>\n'
    said = tuple(
        (stage, name.replace("_", " "), _value(value))
        for stage, verdict in manifest.convergence.items()
        for name, value in (verdict or {}).items()
    )
    versions = Block("Versions", ("", "version"), tuple(manifest.versions.items()))
    files = tuple((name, digest) for name, digest in manifest.files.items() if name != "report.html")
    blocks = [Block("Solvers", ("stage", "", "value"), said)] if said else []
    blocks += [numbers["Time"]] if "Time" in numbers else []
    tables = "".join(map(table, [*blocks, versions, Block("Files", ("file", "SHA-256"), files)]))
    content = (
        f'<h3 id="warnings">Warnings</h3>\n{items}{tables}'
        f'<h3>Case as run</h3>\n<pre tabindex="0">{escape(results.case.source)}</pre>\n'
    )
    return folded("trust", "Trust: warnings, residuals, checksums, case", content, static)
