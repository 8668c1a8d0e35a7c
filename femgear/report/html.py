"""One self-contained HTML page of a run: tables, figures, warnings, provenance.

Where every picture of a run stands in the report, and what is said under it.
"""

from __future__ import annotations

import base64
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from femgear.report.summary import case_warnings, describe, describe_results, result_warnings
from femgear.report.tables import Block
from femgear.storage.files import checksum, storage_errors, write_text
from femgear.storage.results import Results, open_results
from femgear.trains.planar.results import published_modes

if TYPE_CHECKING:
    from femgear.case.sections import Case
    from femgear.trains.drivetrain.section import DrivetrainCase

# stem of a file, its section, its caption; {} stands for what follows the stem
CAPTIONS = (
    (
        "static_transmission_error",
        "Static",
        "Static transmission error over one mesh period: every mesh along its line of action, and from "
        "sun to ring. Sun and planets held at their bores, ring at its outer surface.",
    ),
    (
        "mesh_stiffness",
        "Static",
        "Mesh stiffness over one mesh period: tangent dF/dδ of the loaded mesh (thick) and secant F/δ "
        "(thin).",
    ),
    (
        "load_sharing",
        "Static",
        "Share of every planet in the torque of the sun.",
    ),
    (
        "tooth_loads",
        "Static",
        "Load of one tooth pair from its first to its last contact.",
    ),
    (
        "profile_deviations",
        "Static",
        "Deviations of the loaded flanks from the involute over the roll angle, positive with more material.",
    ),
    (
        "pitch_deviations",
        "Static",
        "Cumulative pitch deviations of the loaded flanks over the tooth number.",
    ),
    (
        "deformed_set",
        "Static",
        "Deformed set under the static load, magnified; at rest in grey.",
    ),
    (
        "contact_pressure",
        "Stresses",
        "Contact pressure of one tooth pair on its way through the mesh: largest value beside the nominal "
        "stress of ISO 6336-2, and distribution along the common tangent. At the ends tip corners touch.",
    ),
    (
        "load_spectrum",
        "Stresses",
        "Load spectrum of a tooth: share of the time under load in every load class, and the largest loads "
        "of its load cycles.",
    ),
    (
        "root_stress",
        "Stresses",
        "Stress in the roots of one tooth on its way through the mesh, beside the nominal stress of "
        "ISO 6336-3.",
    ),
    (
        "root_profile",
        "Stresses",
        "Stress along the roots of the tooth when its tension is largest; dotted the section of ISO 6336-3, "
        "where the tangent stands at 30° (internal gears 60°) to the centreline of the tooth.",
    ),
    (
        "planet_bending",
        "Stresses",
        "Roots of a planet's tooth while the planet turns once against the carrier: the sun bends it one "
        "way, the ring the other.",
    ),
    (
        "mode_shapes",
        "Modes",
        "Mode shapes with mean mesh stiffness: bodies with a mark of their rotation, and the outer "
        "surface of the ring; at rest in grey.",
    ),
    (
        "spatial_mode_shapes",
        "Modes",
        "Mode shapes of the helical set with mean mesh stiffness, from the front and, below, from the side, "
        "where bodies tilt and move along the axis. Motions of the side view are drawn at the scale of the "
        "front view times the factor given. At rest in grey.",
    ),
    (
        "mesh_phasing",
        "Modes",
        "Phases of sun and ring meshes at every planet for the first harmonics of the mesh frequency, and "
        "what is left of equal mesh forces on sun and ring: what cancels excites no mode of that kind.",
    ),
    (
        "helical_mesh_stiffness",
        "Static",
        "Stiffness and static transmission error of the meshes of planet 1 along the transverse line of "
        "action, centres fixed: of the helical meshes (solid), and of the spur gears of the transverse "
        "section (dotted) that the slices come from.",
    ),
    (
        "natural_frequencies",
        "Modes",
        "Natural frequencies over the nodal diameters of the ring.",
    ),
    (
        "ring_mode",
        "Modes",
        "A mode of the toothed ring on its foundation, on the finite-element grid.",
    ),
    (
        "dynamic_transmission_error",
        "Dynamics",
        "Dynamic transmission error over one mesh period (thick) beside the static one of the set on its "
        "supports, both without their mean. The thin static curve has the harmonics of the excitation alone: "
        "what rings in both curves "
        "is the cut series, not vibration. Pale: the whole static curve.",
    ),
    (
        "dynamic_spectrum",
        "Dynamics",
        "Harmonics of the dynamic transmission error, down to five decades below the largest.",
    ),
    (
        "speed_sweep",
        "Dynamics",
        "Fluctuation of the transmission error over the speed, and the verdicts on the solution: the "
        "fixed point contracts below 1, the motion is stable up to 1.",
    ),
    (
        "mesh_force_spectra",
        "Dynamics",
        "Mesh forces of planet 1 along the tooth normals over the frequency of each harmonic, h times the "
        "mesh frequency. Marks along the axis are natural frequencies by the phasing of the mode: a harmonic "
        "meets modes of its own phasing.",
    ),
    (
        "ring_static_deflection",
        "Dynamics",
        "Mean radial deflection of the ring's outer surface, which turns with the carrier.",
    ),
    (
        "operating_deflection",
        "Dynamics",
        "Operating deflection of the ring, without its mean, during one revolution of the carrier. Every "
        "frame is a true instant; the meshes appear slowed down as under a stroboscope.",
    ),
    (
        "housing_signal",
        "Housing",
        "Acceleration at the fixed sensor during one carrier revolution: all orders with the largest and the "
        "smallest value within a mesh period, and the band around a mesh harmonic with its envelope and "
        "lobes ({}).",
    ),
    (
        "order_spectrum",
        "Housing",
        "Carrier orders at the fixed sensor ({}): a wave of n nodal diameters at mesh harmonic h is heard"
        " at order h z − n, z the teeth of the ring, when the carrier turns counter-clockwise.",
    ),
    (
        "modulation",
        "Housing",
        "Envelope around a mesh harmonic over the angle of the carrier ({}).",
    ),
    (
        "stiffness_series",
        "Modes",
        "Mesh stiffness over the mesh period as the model takes it: a Fourier series, and the rectangular "
        "wave of the number of tooth pairs in contact that it stands for.",
    ),
    (
        "campbell",
        "Modes",
        "Natural frequencies over the speed of the first body, with gyroscopic terms and mean mesh "
        "stiffness, and the mesh frequencies.",
    ),
    (
        "drivetrain_mode",
        "Modes",
        "Mode shape of the drivetrain ({}), by the number in the table, where the free spin is the first; "
        "magnified, at rest in grey. The rays show how far each wheel turns. Shafts are drawn as bent "
        "beams between the places that the model knows. The drawing is a scheme: bodies without "
        "gears have a radius that is not theirs.",
    ),
    (
        "transient_speeds",
        "Transient",
        "Speed of the first and of the last body, low-passed to the rate of the records. Where the records "
        "are denser than the pixels, the band of their values is drawn.",
    ),
    (
        "transient_deviations",
        "Transient",
        "Rotation of the bodies less that of the free spin, which is the motion of the rigid chain under the "
        "same torques; low-passed to the rate of the records. Bands: least to largest record.",
    ),
    (
        "transient_forces",
        "Transient",
        "Mesh forces along the lines of action, low-passed to the rate of the records: peaks that are "
        "shorter are higher than here, the least and the largest force of all steps stand in the table. "
        "Bands: least to largest record.",
    ),
    (
        "mesh_force_spectrum",
        "Spectrum",
        "Amplitude spectra of mesh forces after the start: segments under Hann's window that overlap by "
        "half, root of the mean square, peak values. Dotted: mesh frequencies and their second and third "
        "harmonics at the mean speed. Where the speed changes, which the title tells, lines smear over "
        "frequency; over orders they do not.",
    ),
    (
        "side_bands",
        "Spectrum",
        "Mesh force around a mesh line over orders of the first body, in one segment ({}); a change of the "
        "speed does not smear them. Dotted: distances of the carrier's turn, or of the mesh line of the "
        "planetary stage.",
    ),
    (
        "weight_response",
        "Response to the weight",
        "Displacement of carrier, ring and sun over the frequency of the weight in the carrier frame, r.m.s. "
        "about the mean. Circles: limit points, those that corners of the tooth contact split drawn as one.",
    ),
    (
        "carrier_orbit",
        "Response to the weight",
        "Path of the carrier's centre in the carrier frame during one turn of the weight against it, at the "
        "responses that the legend names.",
    ),
    (
        "planet_bearing_forces",
        "Response to the weight",
        "Force between every planet and its pin during one turn of the weight against the carrier, at the "
        "response that the title names.",
    ),
    (
        "wedged_teeth",
        "Response to the weight",
        "Forces of both flanks of the meshes of planet 1 during one turn of the weight, at the response that "
        "the title names. Where both flanks of a mesh carry at once its teeth are wedged.",
    ),
    (
        "tooth_contact",
        "Response to the weight",
        "State of both flanks of the meshes of planet 1 over the frequency of the weight: 1 in contact all "
        "the time, 0 never.",
    ),
    (
        "response_orbit",
        "Weight and mesh frequency",
        "Paths of the centres of carrier, ring and sun in the carrier frame during one turn of the "
        "carrier ({}).",
    ),
    (
        "response_bearing_forces",
        "Weight and mesh frequency",
        "Force between every planet and its pin during one turn of the carrier ({}).",
    ),
    (
        "response_mesh_forces",
        "Weight and mesh frequency",
        "Mesh forces of planet 1 during one turn of the carrier ({}), and during six mesh periods where the "
        "mesh stiffness varies. They are drawn from their lines.",
    ),
    (
        "response_spectrum",
        "Weight and mesh frequency",
        "Lines of a mesh force and of the carrier's displacement ({}): multiples of the weight's frequency, "
        "and of the mesh frequency with their side bands where the mesh stiffness varies.",
    ),
    (
        "contact_over_speed",
        "Weight and mesh frequency",
        "State of both flanks of the meshes of planet 1 over the speed: 1 in contact all the time, 0 never.",
    ),
)
SECTIONS = (
    "Static",
    "Stresses",
    "Modes",
    "Dynamics",
    "Housing",
    "Response to the weight",
    "Weight and mesh frequency",
    "Transient",
    "Spectrum",
    "Other pictures",
)


def caption_of(stem: str) -> tuple[int, str, str]:
    """Place in the order, section and caption of a picture from its file name."""
    for rank, (prefix, section, caption) in enumerate(CAPTIONS):
        if stem == prefix or stem.startswith(prefix + "_"):
            what = stem[len(prefix) :].strip("_").replace("_", " ")
            return rank, section, caption.replace(" ({})", f" ({what})" if what else "")
    return len(CAPTIONS), "Other pictures", re.sub("[_-]+", " ", stem)


_BY_STABILITY = ("weight_response", "tooth_contact")
_OF_RESPONSE = (
    "response_orbit", "response_bearing_forces", "response_mesh_forces", "response_spectrum",
    "contact_over_speed",
)  # fmt: skip
_OF_SPUR_TEETH = ("static_transmission_error", "mesh_stiffness", "load_sharing", "tooth_loads")


def comparisons(case: Case | DrivetrainCase, stem: str) -> Iterator[str]:
    """What the case file adds to a caption: how to read the picture of this case, and published ones."""
    planar = case.planar
    if stem == "transient_forces":
        yield _contact(case)
    if case.helical is not None and stem in _OF_SPUR_TEETH:
        yield "Transverse spur section: these are spur gears of that section, not yet the helical ones."
    if planar is not None and stem in _BY_STABILITY and planar.branch is not None:
        yield (
            "Drawn through: stable by Floquet's theory; dashed: not stable; dotted: not known."
            if planar.branch.stability
            else "Stability was not computed: everything is drawn through."
        )
    if planar is not None and planar.mesh_stiffness is not None and stem.startswith(_OF_RESPONSE):
        yield "The mesh stiffness of this case is constant: the weight alone varies, at no mesh frequency."
    for entry in case.planar.published if case.planar is not None else ():
        if entry.figure is not None and (stem == entry.figure or stem.startswith(f"{entry.figure}_")):
            yield f"Beside {entry.source}: {entry.comparison}"


_OF_BRANCH = ("weight_response", "carrier_orbit", "planet_bearing_forces", "wedged_teeth", "tooth_contact")
# figures that show displacements alone, without forces or contact
_OF_MOTION = ("weight_response", "carrier_orbit", "response_orbit")


def doubts(results: Results, stem: str) -> Iterator[str]:
    """What the results of a planar case say against a picture, for its caption."""
    from femgear.trains.planar.model import TAIL_LIMIT

    stage = "branch" if stem in _OF_BRANCH else "response" if stem.startswith(_OF_RESPONSE) else None
    if stage is None or results.case.planar is None or stage not in results.stages:
        return
    data = results.stage(stage)
    motion, force = (float(data[name].max()) for name in ("tail", "force_tail"))
    tail = motion if stem.startswith(_OF_MOTION) else max(motion, force)
    if tail > TAIL_LIMIT:
        yield (
            f"Marked where more than {TAIL_LIMIT:.0%} of the amplitude lies in the upper half of the "
            f"harmonics (up to {tail:.2g}): shapes and peaks there are not to be trusted (W-TAIL)."
        )


def _contact(case: DrivetrainCase) -> str:
    """What a force without its usual sign means."""
    if case.simulation.contact_loss:
        return "Zero: the teeth are apart; negative: their back flanks touch."
    return "Negative: the mesh is linear and pulls; real teeth would part."


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
    from femgear.case.case import planetary_set
    from femgear.housing.orders import order_spectrum
    from femgear.housing.sensor import fixed_sensor_lines, fixed_sensor_signal, hanning_model

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
