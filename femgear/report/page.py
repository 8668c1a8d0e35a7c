"""What a run shows: its numbers and warnings in tables, its pictures, and the page that holds everything.

Figures are PNG, grids VTU, the turning carrier is a GIF; the page is one HTML file that loads nothing else.
"""

from __future__ import annotations

import base64
import ctypes
import multiprocessing
import os
import re
import signal
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from femgear.errors import FemgearError, printable
from femgear.report.style import png_bytes
from femgear.report.tables import Block
from femgear.storage.files import checksum, storage_errors, write_bytes

if TYPE_CHECKING:
    from femgear.storage.results import Results
    from femgear.trains.protocol import Drawn, Figures, Progress, Train


_LARGEST_PICTURE = 8_000_000
"""Bytes of a picture on the page."""
_OTHER = "Other pictures"
"""Section of those that no stage describes."""
# what HTML and UTF-8 do not hold, and what reverses the order of the text around it
_CONTROLS = re.compile(r"[\x00-\x08\x0b-\x1f\x7f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
_KINDS = {".png": "image/png", ".gif": "image/gif"}
_STYLE = """
body { font: 16px/1.5 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; color: #1b1b1b; background: #fff;
  max-width: 62rem; margin: 2rem auto; padding: 0 1.2rem; }
h1 { font-size: 1.7rem; margin-bottom: 0.2rem; }
h2 { font-size: 1.25rem; margin-top: 2.4rem; border-bottom: 2px solid #0072b2; padding-bottom: 0.15rem; }
h3 { font-size: 1.05rem; margin: 1.6rem 0 0.4rem; }
p.lead { color: #555; margin-top: 0; }
nav a { margin-right: 1rem; color: #0072b2; }
div.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: 0.86rem; font-variant-numeric: tabular-nums; }
th, td { padding: 0.2rem 0.7rem; border-bottom: 1px solid #ddd; text-align: right; white-space: nowrap; }
th { border-bottom: 2px solid #888; font-weight: 600; }
th:first-child, td:first-child { text-align: left; padding-left: 0; }
p.note { font-size: 0.86rem; color: #444; margin: 0.3rem 0; }
ul.warnings { border-left: 5px solid #d55e00; background: #fdf3ec; margin: 1rem 0;
  padding: 0.6rem 1rem 0.6rem 2rem; }
figure { margin: 1.4rem 0 2rem; }
figure img { max-width: 100%; height: auto; display: block; margin: 0 auto; }
figcaption { font-size: 0.9rem; color: #333; margin-top: 0.4rem; }
pre { font-size: 0.8rem; background: #f5f5f5; padding: 0.8rem; overflow-x: auto; }
@media print { body { max-width: none; margin: 0; font-size: 11pt; } nav { display: none; }
  figure, table { break-inside: avoid; } h2, h3 { break-after: avoid; } pre { white-space: pre-wrap; } }
"""


def write_figures(
    folder: Path, train: Train, drawn: Drawn, beside: Callable[[], object] = lambda: None
) -> list[str]:
    """Write the figures of the stages whose data are there, and of the case; returns the file names.

    They are drawn in two processes where there are two cores, and in this one ``beside()`` comes first.
    """
    import matplotlib.backends.backend_agg  # noqa: F401  before the process is copied

    def pictures(stage: Figures) -> dict[str, bytes]:
        return {f"{name}.png": png_bytes(figure) for name, figure in stage.draw(drawn).items()}

    tasks = [partial(pictures, stage) for stage in _drawn(train, drawn)]
    found = {name: data for part in _shared(tasks, beside) for name, data in part.items()}
    for name, data in found.items():
        write_bytes(data, folder / name)
    return [*found]


def _drawn(train: Train, drawn: Drawn) -> list[Figures]:
    """List the figures of the stages whose data are there, in their order, and of the case."""
    figures, names = train.figures, [*(s.name for s in train.stages if s.name in drawn.data), ""]
    return [figures[name] for name in names if name in figures]


def _shared(tasks: Sequence[Callable[[], Any]], beside: Callable[[], object]) -> list[Any]:
    """Values of up to 256 tasks; a second process begins with the last one, this one after ``beside()``."""
    waiting, numbers = os.pipe()
    os.write(numbers, bytes(reversed(range(len(tasks)))))
    os.close(numbers)
    with open(waiting, "rb", buffering=0) as queue:

        def take() -> dict[int, Any]:
            return {number[0]: tasks[number[0]]() for number in iter(partial(queue.read, 1), b"")}

        with _second_process(take) as others:
            beside()
            found = take() | others()
    return [found[number] for number in range(len(tasks))]


@contextmanager
def _second_process(work: Callable[[], dict]) -> Iterator[Callable[[], dict]]:
    """Do some work in a copy of this process during a block of code, which is given what waits for the value.

    The copy ends with the block, or with this process. Without a second core the value is empty.
    """
    if not second_core():
        yield dict
        return
    context: Any = multiprocessing.get_context("fork")
    mine, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_send, args=(work, theirs, os.getpid()), daemon=True)
    # an interrupt is meant for this process, and waits until the other one can be ended
    before, value = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT, signal.SIGTERM]), dict
    try:
        with suppress(OSError), warnings.catch_warnings(action="ignore", category=DeprecationWarning):
            process.start()
            value = partial(_received, mine)
        theirs.close()
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        yield value
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        if process.pid is not None:
            process.kill()
            process.join()
        mine.close()


def second_core() -> bool:
    """Tell whether a copy of this process would have a core of its own."""
    return sys.platform == "linux" and len(os.sched_getaffinity(0)) > 1


def _send(work: Callable[[], Any], connection: Any, parent: int) -> None:
    """Send the value of some work, or its error, and warnings; end with the parent, whose locks it has."""
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
    if os.getppid() != parent:
        return
    with warnings.catch_warnings(record=True) as said:
        try:
            found = work()
        except Exception as error:
            found = error
    connection.send((found, [(str(one.message), one.category, one.filename, one.lineno) for one in said]))


def _received(connection: Any) -> dict:
    """Receive what `_send` sends: value or error, and warnings."""
    try:
        found, said = connection.recv()
    except EOFError:
        remedy = "give it more memory, or run with --no-pictures"
        raise FemgearError("the process that draws was ended", code="E-WORKER", remedy=remedy) from None
    for one in said:
        warnings.warn_explicit(*one)
    if isinstance(found, BaseException):
        raise found
    return found


def write_pictures(folder: Path, train: Train, drawn: Drawn, *, progress: Progress) -> list[str]:
    """Write everything that a run shows; returns the names of the files.

    ``train`` is that of the case, ``progress`` is called with (stage, done, total).
    """
    others, names = [write for stage in _drawn(train, drawn) for write in stage.write], []
    steps = 1 + len(others)

    def write_others() -> None:
        for done, write in enumerate(others):
            progress("pictures", done, steps)
            names.extend(write(drawn, folder))
        progress("pictures", len(others), steps)

    figures = write_figures(folder, train, drawn, write_others)
    progress("pictures", steps, steps)
    return figures + names


@dataclass(frozen=True)
class _Picture:
    """A picture of the page: its section, caption, kind (``"image/png"``) and bytes."""

    section: str
    caption: str
    kind: str
    data: bytes


def page(train: Train, results: Results) -> str:
    """Make the page of a run as HTML text: tables, warnings, pictures, provenance.

    The pictures that its manifest names are embedded; the page loads nothing else. The same results give the
    same text. StorageError: files were changed since the run.
    """
    case = results.case
    pictures, skipped = _pictures(train, results)
    warnings = [*train.case_warnings(case), *train.result_warnings(results), *skipped]
    numbers = {block.title: block for block in train.describe_results(results)}
    sections = [*(stage.title for stage in train.stages), _OTHER]
    head = "".join(
        (
            f"<h1>{escape(case.title)}</h1>\n",
            f'<p class="lead">{escape(_lead(results))}</p>\n',
            "".join(map(_table, train.verdict(results))),
            _contents(sections, numbers, pictures),
            _warnings(warnings),
            '<h2 id="gears">Gears and operation</h2>\n',
            "".join(map(_table, train.describe(case))),
        )
    )
    body = "".join(_section(name, numbers, pictures, train, results) for name in sections)
    text = (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; img-src data:; '
        "style-src 'unsafe-inline'\">\n"
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(case.title)}</title>\n<style>{_STYLE}</style>\n</head>\n<body>\n"
        f"{head}{body}{_provenance(results, numbers)}</body>\n</html>\n"
    )
    return _CONTROLS.sub(lambda found: printable(found[0]), text)


def _lead(results: Results) -> str:
    """Tell version, stages, and whether the run came to its end."""
    stages = ", ".join(results.stages) or "nothing"
    state = "" if results.manifest.complete else "; the run did not come to its end"
    return f"femgear {results.manifest.versions.get('femgear', '')}: {stages}{state}"


def _contents(sections, numbers, pictures) -> str:
    """Link to the sections that there are."""
    shown = [name for name in sections if name in numbers or any(p.section == name for p in pictures)]
    links = [("gears", "Gears"), *((_anchor(name), name) for name in shown), ("provenance", "Provenance")]
    return "<nav>" + " ".join(f'<a href="#{key}">{escape(text)}</a>' for key, text in links) + "</nav>\n"


def _anchor(name: str) -> str:
    """Name a section in links."""
    return name.lower().replace(" ", "-")


def _warnings(warnings) -> str:
    """List all warnings."""
    if not warnings:
        return ""
    items = "".join(f"<li>{escape(str(warning))}</li>\n" for warning in warnings)
    return '<ul class="warnings">\n' + items + "</ul>\n"


def _section(name: str, numbers, pictures, train: Train, results: Results) -> str:
    """Show tables and pictures of a stage, nothing without any."""
    blocks = [numbers[name]] if name in numbers else []
    for stage in train.stages:
        if stage.title == name and stage.name in results.stages:
            blocks += stage.tables(results)
    figures = [picture for picture in pictures if picture.section == name]
    if not blocks and not figures:
        return ""
    tables = "".join(_table(block, heading=i > 0) for i, block in enumerate(blocks))
    return f'<h2 id="{_anchor(name)}">{escape(name)}</h2>\n' + tables + "".join(map(_figure, figures))


def _table(block: Block, *, heading: bool = True) -> str:
    """Show a table with its notes."""
    title = f"<h3>{escape(block.title)}</h3>\n" if heading else ""
    header = "".join(f"<th>{escape(text)}</th>" for text in block.header)
    rows = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>\n" for row in block.rows
    )
    table = ""
    if header or rows:
        head = f"<thead><tr>{header}</tr></thead>\n" if header else ""
        table = f'<div class="wide"><table>\n{head}<tbody>\n{rows}</tbody>\n</table></div>\n'
    notes = "".join(f'<p class="note">{escape(note)}</p>\n' for note in block.notes)
    return title + table + notes


def _figure(picture: _Picture) -> str:
    """Embed a picture with its caption."""
    data = base64.b64encode(picture.data).decode("ascii")
    caption = escape(picture.caption)
    return (
        f'<figure>\n<img alt="{caption}" src="data:{picture.kind};base64,{data}">\n'
        f"<figcaption>{caption}</figcaption>\n</figure>\n"
    )


def _pictures(train: Train, results: Results) -> tuple[list[_Picture], list[str]]:
    """Read the pictures that the manifest names, in the order of the captions, and what was left out."""
    found, skipped = [], []
    for name, digest in results.manifest.files.items():
        path = results.folder / name
        kind = _KINDS.get(path.suffix)
        if kind is None:
            continue
        if not path.is_file() or path.is_symlink() or checksum(path) != digest:
            skipped.append(f"{name} is missing or was changed since the run, and is not shown")
            continue
        with storage_errors(path):
            data = path.read_bytes()
        if len(data) > _LARGEST_PICTURE:
            skipped.append(f"{name} is too large for this page ({len(data) / 1e6:.1f} MB)")
            continue
        rank, section, caption = caption_of(train, path.stem)
        caption = " ".join((caption, *train.remarks(results, path.stem)))
        found.append((rank, _Picture(section, caption, kind, data)))
    found.sort(key=lambda item: item[0])
    return [picture for _, picture in found], skipped


def caption_of(train: Train, stem: str) -> tuple[int, str, str]:
    """Find place in the order, section and caption of a picture from its file name."""
    captions = [
        (stage.title, *one)
        for stage in train.stages
        if stage.name in train.figures
        for one in train.figures[stage.name].captions.items()
    ]
    for rank, (section, prefix, caption) in enumerate(captions):
        if stem == prefix or stem.startswith(prefix + "_"):
            what = stem[len(prefix) :].strip("_").replace("_", " ")
            return rank, section, caption.replace(" ({})", f" ({what})" if what else "")
    return len(captions), _OTHER, re.sub("[_-]+", " ", stem)


def _provenance(results: Results, numbers) -> str:
    """Show time, versions, checksums, and the case as run."""
    manifest = results.manifest
    versions = Block("Versions", ("", "version"), tuple(manifest.versions.items()))
    files = tuple((name, digest) for name, digest in manifest.files.items() if name != "report.html")
    blocks = [numbers["Time"]] if "Time" in numbers else []
    blocks += [versions, Block("Files", ("file", "SHA-256"), files)]
    tables = "".join(_table(block) for block in blocks)
    return (
        f'<h2 id="provenance">Provenance</h2>\n{tables}<h3>Case as run</h3>\n'
        f"<pre>{escape(results.case.source)}</pre>\n"
    )
