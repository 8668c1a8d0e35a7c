"""One self-contained HTML page of a run: tables, figures, warnings, provenance."""

from __future__ import annotations

import base64
import os
from dataclasses import dataclass
from html import escape
from pathlib import Path

import numpy as np

from femgear.files import checksum, storage_errors, write_text
from femgear.report_captions import SECTIONS, caption_of, comparisons, doubts
from femgear.storage import Results, open_results
from femgear.summary import Block, describe, describe_results
from femgear.summary_planar import published_modes
from femgear.summary_warnings import case_warnings, result_warnings

_LARGEST_PICTURE = 8_000_000  # bytes
_KINDS = {".png": "image/png", ".gif": "image/gif"}
_FEW = 4
_FIRST, _STRONGEST = 6, 4  # bands of the housing that are listed

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


@dataclass(frozen=True)
class Picture:
    """A picture of the page: its section, caption, kind (``"image/png"``) and bytes."""

    section: str
    caption: str
    kind: str
    data: bytes


def write_report(folder: str | os.PathLike) -> Path:
    """Write ``report.html`` from what a results folder holds.

    Parameters
    ----------
    folder : path-like
        Folder that a run wrote; the pictures that its manifest names are embedded.

    Returns
    -------
    Path
        The page: one file that loads nothing else. The same results give the same bytes.

    Raises
    ------
    StorageError
        When the folder holds no results, files were changed since the run, or the page cannot be written.
    """
    results = open_results(folder)
    path = Path(folder) / "report.html"
    write_text(page(results), path)
    return path


def page(results: Results) -> str:
    """The page as text; see `write_report`."""
    case = results.case
    pictures, skipped = _pictures(results)
    title, *geometry = describe(case)
    warnings = [*case_warnings(case), *result_warnings(results), *skipped]
    numbers = {block.title: block for block in describe_results(results)}
    head = "".join(
        (
            f"<h1>{escape(title.title)}</h1>\n",
            f'<p class="lead">{escape(_lead(results))}</p>\n',
            _contents(numbers, pictures),
            _warnings(warnings),
            '<h2 id="gears">Gears and operation</h2>\n',
            "".join(_table(block) for block in geometry if block.title != "Warnings"),
        )
    )
    body = "".join(_section(name, numbers, pictures, results) for name in SECTIONS)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; img-src data:; '
        "style-src 'unsafe-inline'\">\n"
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title.title)}</title>\n<style>{_STYLE}</style>\n</head>\n<body>\n"
        f"{head}{body}{_provenance(results, numbers)}</body>\n</html>\n"
    )


def _lead(results: Results) -> str:
    stages = ", ".join(results.stages) or "nothing"
    state = "" if results.manifest.complete else "; the run did not come to its end"
    return f"femgear {results.manifest.versions.get('femgear', '')}: {stages}{state}"


def _contents(numbers, pictures) -> str:
    shown = [name for name in SECTIONS if name in numbers or any(p.section == name for p in pictures)]
    links = [("gears", "Gears"), *((_anchor(name), name) for name in shown), ("provenance", "Provenance")]
    return "<nav>" + " ".join(f'<a href="#{key}">{escape(text)}</a>' for key, text in links) + "</nav>\n"


def _anchor(name: str) -> str:
    return name.lower().replace(" ", "-")


def _warnings(warnings) -> str:
    if not warnings:
        return ""
    return '<ul class="warnings">\n' + "".join(f"<li>{escape(text)}</li>\n" for text in warnings) + "</ul>\n"


def _section(name: str, numbers, pictures, results: Results) -> str:
    blocks = [numbers[name]] if name in numbers else []
    if name == "Housing" and "housing" in results.stages:
        blocks.append(_bands(results))
    if name == "Modes" and "modes" in results.stages:
        blocks += [block for block in (published_modes(results.case, results.modes),) if block is not None]
    figures = [picture for picture in pictures if picture.section == name]
    if not blocks and not figures:
        return ""
    tables = "".join(_table(block, heading=i > 0) for i, block in enumerate(blocks))
    return f'<h2 id="{_anchor(name)}">{escape(name)}</h2>\n' + tables + "".join(map(_figure, figures))


def _table(block: Block, *, heading: bool = True) -> str:
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


def _bands(results: Results) -> Block:
    """Dominant lines and lobes around every mesh harmonic of the excitation, at a few speeds."""
    from femgear.housing.orders import analyse_band, order_spectrum

    housing, case = results.housing, results.case
    teeth = int(housing.attrs["ring_teeth"])
    rows, threshold = [], 0.0
    count = housing.sizes["speed"]
    for s in sorted({round(i) for i in np.linspace(0, count - 1, min(count, _FEW))}):
        spectrum = order_spectrum(housing["acceleration"].values[s])
        windowed = _hanning_spectrum(results, s)
        rpm = float(housing["speed"][s])
        for h in _shown_harmonics(spectrum, teeth, case.dynamics.mesh_harmonics):
            found = analyse_band(spectrum, teeth, h, count=3)
            threshold = found.lobes.threshold
            lines = [_line(line, h * teeth) for line in found.lines[:2]] + ["-", "-"]
            third = f"{found.lines[2].level:.1f}" if len(found.lines) > 2 else "-"
            hanning = "-" if windowed is None else str(len(analyse_band(windowed, teeth, h).lobes.position))
            lobes = str(len(found.lobes.position))
            published = _published(case, rpm, h)
            rows.append((f"{rpm:.6g}", str(h), str(h * teeth), *lines[:2], third, lobes, hanning, published))
    header = (
        "speed [rpm]",
        "harmonic",
        "order",
        "strongest line [m/s²]",
        "second line [m/s²]",
        "third [dB]",
        "lobes",
        "Hanning lobes",
        "published",
    )
    notes = [
        f"lobes of the envelope a carrier revolution that stand out by {threshold:.0%} of its largest value; "
        "third: level of the third line below the strongest; Hanning lobes: of the classical model, in which "
        "each planet is heard through a Hanning window while it passes the sensor",
        *dict.fromkeys(f"published: {entry.source}" for entry in case.housing.published),
    ]
    if not case.housing.published:
        header, rows = header[:-1], [row[:-1] for row in rows]
    return Block("Around the mesh harmonics", header, tuple(rows), tuple(notes))


def _shown_harmonics(spectrum, teeth: int, given: int | None) -> list[int]:
    """All mesh harmonics of the excitation; of those up to a frequency the first and the strongest ones."""
    highest = int((spectrum.order[-1] - teeth // 2) // teeth)
    if given is not None:
        return list(range(1, min(given, highest) + 1))
    bands = np.abs(spectrum.order[None] / teeth - np.arange(1, highest + 1)[:, None]) <= 0.5
    strongest = np.where(bands, spectrum.amplitude[None], 0.0).max(axis=1).argsort()[::-1][:_STRONGEST] + 1
    return sorted({*range(1, min(_FIRST, highest) + 1), *strongest.tolist()})


def _hanning_spectrum(results: Results, speed: int):
    """Order spectrum of the Hanning-window model with the planet-ring forces of the dynamic solution."""
    from femgear.case import planetary_set
    from femgear.housing import fixed_sensor_lines, fixed_sensor_signal, hanning_model, order_spectrum

    if "dynamics" not in results.stages:
        return None
    data = results.dynamics
    ring = [str(name).endswith("ring") for name in data["mesh"].values]
    force = (data["mesh_force_real"] + 1j * data["mesh_force_imag"]).values[speed][ring]
    teeth = int(results.housing.attrs["ring_teeth"])
    field = hanning_model(force, planetary_set(results.case).planet_angles)
    lines = fixed_sensor_lines(
        field,
        teeth,
        2 * np.pi * float(data["mesh_frequency"][speed]) / teeth,
        float(results.housing.attrs["sensor_angle"]),
    )
    return order_spectrum(fixed_sensor_signal(lines).acceleration)


def _published(case, rpm: float, harmonic: int) -> str:
    """What the case file says was published for a speed and mesh harmonic."""
    for entry in case.housing.published:
        if entry.harmonic == harmonic and np.isclose(entry.speed * 30 / np.pi, rpm):
            lobes = "" if entry.lobes is None else f"; {entry.lobes} lobes"
            return f"{', '.join(map(str, entry.orders))}{lobes}"
    return "-"


def _line(line, centre: int) -> str:
    order = round(line.order)
    offset = f" = {centre} {'+' if order > centre else '−'} {abs(order - centre)}" if order != centre else ""
    return f"{order}{offset}: {line.amplitude:.3g}"


def _pictures(results: Results) -> tuple[list[Picture], list[str]]:
    """Pictures that the manifest names, in the order of the captions, and remarks on those left out."""
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
        rank, section, caption = caption_of(path.stem)
        added = *comparisons(results.case, path.stem), *doubts(results, path.stem)
        caption = " ".join((caption, *added))
        found.append((rank, Picture(section, caption, kind, data)))
    found.sort(key=lambda item: item[0])
    return [picture for _, picture in found], skipped


def _figure(picture: Picture) -> str:
    data = base64.b64encode(picture.data).decode("ascii")
    caption = escape(picture.caption)
    return (
        f'<figure>\n<img alt="{caption}" src="data:{picture.kind};base64,{data}">\n'
        f"<figcaption>{caption}</figcaption>\n</figure>\n"
    )


def _provenance(results: Results, numbers) -> str:
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
