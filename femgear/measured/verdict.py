"""The command ``femgear measured``: a recording of a gear set, and what every line of its spectrum says."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.errors import CaseError
from femgear.findings import Finding, percent, tell
from femgear.housing.orders import OrderSpectrum, array_factor, spacing_symmetry
from femgear.measured.averages import carrier_average, gear_average
from femgear.measured.channels import choose_channel
from femgear.measured.heard_set import HeardSet, heard_set
from femgear.measured.lines import (
    VERDICTS,
    MeasuredLine,
    chance,
    judge_lines,
    level_uncertainty,
    order_tolerance,
    sharpened_lines,
)
from femgear.measured.recordings import channel_in_si, read_by_turns, read_recording
from femgear.measured.requests import FurtherFiles, LineSearch, Recording
from femgear.measured.spectra import frequency_response, power_density, windowed_spectrum
from femgear.measured.turns import AngleSignal
from femgear.measured.wrong_turns import MeshLines, lines_near_mesh
from femgear.report.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    SKY,
    VERMILION,
    label,
    legend_below,
    new_figure,
    save_figure,
)
from femgear.report.tables import Block
from femgear.storage.files import own_files, write_csv

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SHOWN = 40
"""Lines of the printed table."""
_LINES, _SPECTRUM, _FIGURE = "lines.csv", "order_spectrum.csv", "lines.png"
_DEEPER = (0.0, -20.0, -40.0, -60.0, -80.0)
"""Levels by which lines from elsewhere may be stronger than all of the set [dB]."""
_FEW = 3
"""Lines from which on a set without a normal one is doubted."""
_MAINS = (50.0, 60.0)
"""Frequencies of the mains [Hz]."""
_HALF_WIDTH = 12
_HARMONICS = 3


@dataclass(frozen=True)
class MeasuredVerdict:
    """What a recording says about a set.

    Parameters
    ----------
    gear_set : HeardSet
        The set.
    signal : AngleSignal
        Over the angle of the carrier.
    spectrum : OrderSpectrum
        Through a Hann window.
    lines : tuple of MeasuredLine
        Ascending.
    tolerance : float
        Distance of orders that count as one.
    """

    gear_set: HeardSet
    signal: AngleSignal
    spectrum: OrderSpectrum
    lines: tuple[MeasuredLine, ...]
    tolerance: float


def measured_verdict(
    case: Any, path: str | os.PathLike, recording: Recording, search: LineSearch | None = None
) -> MeasuredVerdict:
    """Compute the order spectrum of a recording of a case, or of a set, and give every line its verdict.

    CaseError: a case or a recording that cannot be used; see `heard_set`, `read_by_turns` and `order_tolerance`.
    """
    gear_set, search = case if isinstance(case, HeardSet) else heard_set(case), search or LineSearch()
    signal = read_by_turns(path, recording, gear_set)
    tolerance = order_tolerance(signal.turns, search.tolerance)
    spectrum = windowed_spectrum(signal)
    lines = _judged_lines(spectrum, signal, search.threshold, gear_set, tolerance)
    # a line from elsewhere counts no more than the strongest of the set
    order, height = np.array([(line.order, 10.0 ** (min(line.level, 0.0) / 20.0)) for line in lines]).reshape(-1, 2).T
    highest = float(spectrum.order[-1])
    healthy = len(lines) < _FEW or any(line.verdict == VERDICTS[0] for line in lines)
    mesh = lines_near_mesh(gear_set, order, height, tolerance, highest)
    _tell_wrong_turns(mesh, recording, highest, healthy=healthy)
    return MeasuredVerdict(gear_set, signal, spectrum, lines, tolerance)


def _judged_lines(
    spectrum: OrderSpectrum, signal: AngleSignal, threshold: float, gear_set: HeardSet, tolerance: float
) -> tuple[MeasuredLine, ...]:
    """Judge lines from a threshold [dB] on, which counts from the strongest line that the set can make.

    A strong line from elsewhere would else hide those of the set. Where none is found, it counts from the strongest.
    """
    judged = []
    for deeper in _DEEPER:
        order, height = sharpened_lines(spectrum, threshold + deeper)
        wrong = level_uncertainty(spectrum, order, height, time_error=signal.time_error, speed=signal.speed)
        judged.append(judge_lines(order, height, wrong, gear_set.angles, gear_set.teeth, tolerance))
        above = max((line.level for line in judged[-1]), default=0.0)
        if above <= -deeper and any(line.verdict != VERDICTS[-1] for line in judged[-1]):
            return tuple(line for line in judged[-1] if line.level >= threshold)
    return judged[0]


def _tell_wrong_turns(mesh: MeshLines, recording: Recording, highest: float, *, healthy: bool) -> None:
    """Say where lines do not lie at places of the set, and which factor of the speed would bring them there.

    ``healthy`` is whether any lies where a healthy set has one, or there are few lines.
    """
    if mesh.fits and mesh.factor == 1.0 and healthy:
        return
    words = f"lines up to order {highest:.4g} lie as they would without this set"
    if mesh.fits and not healthy:
        words = "no line lies where a healthy set has lines, and those of a faulty one are among them"
    if mesh.factor != 1.0:
        words = f"lines lie far better at orders of the set if the carrier made {mesh.factor:.4g} times as many turns: "
        words += f"{percent(mesh.share_then)} of them near mesh harmonics, not {percent(mesh.share)}"
    key = "--speed" if recording.pulses is None else "--pulses"
    ways = "the speed of the input" if recording.pulses is None else "--pulses-of and --per-turn"
    tell(Finding("W-UNSTEADY", key, words, remedy=f"check {ways}, and that the recording is one of this set"))


def measured_into(
    case: Any,
    path: str | os.PathLike,
    recording: Recording,
    search: LineSearch,
    output: Path | None,
    further: FurtherFiles | None = None,
) -> tuple[MeasuredVerdict, list[Block], list[str]]:
    """Judge the lines of a recording, and write them, the spectrum, a figure and more into a folder if there is one.

    Returns the verdict, the tables to print and the names of the files.
    """
    verdict, further = measured_verdict(case, path, recording, search), further or FurtherFiles()
    names = []
    if output is not None:
        tables = dict(_further_tables(verdict, path, recording, further))
        names = [_LINES, _SPECTRUM, _FIGURE, *tables]
        own_files(output, names)
        _write(verdict, search, output)
        for name, (header, columns) in tables.items():
            write_csv(output / name, header, zip(*(column.tolist() for column in columns), strict=True))
    elif further != FurtherFiles():
        message, remedy = "files are asked for, and no folder is named", "name one by -o"
        raise CaseError(message, code="E-ARGUMENTS", key="--output", remedy=remedy)
    return verdict, list(describe_verdict(verdict, search)), names


def _further_tables(
    verdict: MeasuredVerdict, path: str | os.PathLike, recording: Recording, further: FurtherFiles
) -> Iterator[tuple[str, tuple[tuple[str, ...], tuple[np.ndarray, ...]]]]:
    """Averages, density and frequency response: names of the files, headers and columns."""
    signal, unit = verdict.signal, verdict.signal.unit or "1"
    for name in further.average:
        gear, _, number = name.partition(" ")
        if gear == "carrier":
            values, axis, parts = carrier_average(signal), "turns of the carrier", signal.per_turn
        else:
            values = gear_average(signal, verdict.gear_set, gear, planet=int(number or 1))
            axis, parts = f"teeth of the {gear}", signal.per_turn // verdict.gear_set.ring
        columns = np.arange(len(values)) / parts, values
        yield f"average_{name.replace(' ', '_')}.csv", ((axis, f"average [{unit}]"), columns)
    if not further.density and further.force is None:
        return
    channels = read_recording(path, recording)
    channel = channel_in_si(choose_channel(channels, recording.channel or signal.name), recording.unit)
    if further.density:
        yield "density.csv", (("frequency [Hz]", f"density [({unit})^2/Hz]"), power_density(channel))
    if further.force is not None:
        force = choose_channel(channels, further.force, "--force")
        frequency, response, coherence = frequency_response(channel, force)
        header = ("frequency [Hz]", f"response [{unit} a {force.unit or '1'}]", "phase [deg]", "coherence")
        columns = (frequency, np.abs(response), np.degrees(np.angle(response)), coherence)
        yield "frequency_response.csv", (header, columns)


def describe_verdict(verdict: MeasuredVerdict, search: LineSearch) -> Iterator[Block]:
    """Tabulate the recording and its lines."""
    signal, gear_set = verdict.signal, verdict.gear_set
    symmetry = spacing_symmetry(gear_set.angles)
    unit = f" [{signal.unit}]" if signal.unit else ""
    rows = (
        ("signal", f"{signal.name}{unit}"),
        ("whole turns of the carrier", f"{signal.turns}"),
        ("mean speed of the carrier", f"{signal.speed * 60:.6g} rpm"),
        ("step of the orders", f"{1 / signal.turns:.4g}, up to order {verdict.spectrum.order[-1]:.5g}"),
        ("orders of a healthy set", f"multiples of {symmetry}" if symmetry > 1 else "all whole ones"),
    )
    yield Block("Recording", rows=rows)
    strongest = sorted(sorted(verdict.lines, key=lambda line: -line.level)[:_SHOWN], key=lambda line: line.order)
    table = tuple(
        (f"{line.order:.2f}", f"{line.level:.1f}", f"{line.uncertainty:.2g}", line.verdict, line.place.reason)
        for line in strongest
    )
    title = f"{len(verdict.lines)} lines above {search.threshold:g} dB, out of the noise"
    title += f", the strongest {_SHOWN}" if len(verdict.lines) > _SHOWN else ""
    heading = ("carrier order", "level [dB]", "± [dB]", "verdict", "why")
    yield Block(title, heading if table else (), table, tuple(_notes(verdict)))


def _notes(verdict: MeasuredVerdict) -> Iterator[str]:
    above = max((line.level for line in verdict.lines), default=0.0)
    if above > 0.0:
        yield f"levels are over the strongest line that the set can make; one from elsewhere is {above:.1f} dB above it"
    yield from _hum_notes(verdict)
    counts = {word: [line for line in verdict.lines if line.verdict == word] for word in VERDICTS}
    yield ", ".join(f"{len(lines)} {word}" for word, lines in counts.items() if lines) or "no line stands out"
    for word, lines in list(counts.items())[1:]:
        if lines:
            top = max(lines, key=lambda line: line.level)
            yield f"{word}: strongest {top.level:.1f} dB at order {top.order:.2f}"
    yield "a fault of a tooth of the ring makes no new places: it shows in the heights of normal lines alone"
    heard_parts = {line.place.part for line in verdict.lines if line.place.part}
    gear_set = verdict.gear_set
    likely = chance(verdict.tolerance, gear_set.teeth, spacing_symmetry(gear_set.angles), heard_parts)
    yield f"an order without meaning fits turns of sun or planet by chance in {percent(likely)} of cases at most"


def _hum_notes(verdict: MeasuredVerdict) -> Iterator[str]:
    """Say that the strongest line that is not normal lies at a frequency of the mains."""
    suspects = [line for line in verdict.lines if line.verdict != VERDICTS[0]]
    if not suspects:
        return
    line = max(suspects, key=lambda line: line.level)
    hertz = line.order * verdict.signal.speed
    for mains in _MAINS:
        multiple = round(hertz / mains)
        off = abs(hertz - multiple * mains)
        if multiple in (1, 2) and off <= max(0.5 * verdict.signal.speed / verdict.signal.turns, 1e-3 * hertz):
            yield f"the line at order {line.order:.2f} is at {hertz:.2f} Hz, where hum of the mains would be"


def _words_on_place(line: MeasuredLine) -> tuple[object, ...]:
    return line.place.nearest, line.place.factor, line.verdict, line.place.reason


def _write(verdict: MeasuredVerdict, search: LineSearch, folder: Path) -> None:
    """Write lines, spectrum and figure."""
    unit = f" [{verdict.signal.unit}]" if verdict.signal.unit else ""
    header = (
        "order",
        f"amplitude{unit}",
        "level [dB]",
        "uncertainty [dB]",
        "whole order",
        "array factor",
        "verdict",
        "why",
    )
    rows = (
        (line.order, line.amplitude, line.level, line.uncertainty, *_words_on_place(line)) for line in verdict.lines
    )
    write_csv(folder / _LINES, header, rows)
    spectrum = zip(verdict.spectrum.order.tolist(), verdict.spectrum.amplitude.tolist())
    write_csv(folder / _SPECTRUM, ("order", f"amplitude{unit}"), spectrum)
    by_verdict = {
        word: [(line.order, line.level) for line in verdict.lines if line.verdict == word] for word in VERDICTS
    }
    drawn = {"threshold": search.threshold, "harmonics": _loud_harmonics(verdict), "half_width": _HALF_WIDTH}
    save_figure(draw_side_bands(verdict.gear_set, by_verdict, **drawn), folder / _FIGURE)


def _loud_harmonics(verdict: MeasuredVerdict) -> list[int]:
    """Choose the mesh harmonics with the most power in the lines around them, ascending; the first of a silent one."""
    ring = verdict.gear_set.ring
    highest = max(int((verdict.spectrum.order[-1] - _HALF_WIDTH) // ring), 1)
    power = np.zeros(highest + 1)
    for line in verdict.lines:
        harmonic = round(line.order / ring)
        if 1 <= harmonic <= highest and abs(line.order - harmonic * ring) <= _HALF_WIDTH:
            power[harmonic] += line.amplitude**2
    loudest = np.argsort(-power[1:], kind="stable")[: min(_HARMONICS, highest)] + 1
    return sorted(loudest.tolist())


def draw_side_bands(
    gear_set: HeardSet,
    lines: Mapping[str, Sequence[tuple[float, float]]],
    *,
    threshold: float,
    harmonics: Sequence[int],
    half_width: int,
) -> Figure:
    """Draw the array factor as bars, forbidden orders crossed, and levels of measured lines over it.

    Parameters
    ----------
    gear_set : HeardSet
        The set.
    lines : mapping of str to sequence of (float, float)
        Orders and levels [dB over the strongest line] by their verdict.
    threshold : float
        Least level [dB].
    harmonics : sequence of int
        Mesh harmonics drawn, ascending.
    half_width : int
        Carrier orders on either side of each.
    """
    figure, axes = new_figure(rows=len(harmonics), width=9.5, height=1.6 + 2.5 * len(harmonics))
    symmetry = spacing_symmetry(gear_set.angles)
    marks = (("o", BLUE), ("s", VERMILION), ("D", VERMILION), ("v", GREEN), ("^", BLACK))
    styles = dict(zip(lines, marks[: len(lines) - 1] + marks[-1:], strict=True)) if lines else {}
    for h, ax in zip(harmonics, axes, strict=True):
        centre = h * gear_set.ring
        whole = np.arange(max(centre - half_width, 1), centre + half_width + 1)
        ax.bar(whole, array_factor(gear_set.angles, whole), width=0.8, color=SKY, alpha=0.5, label="array factor")
        no = whole[whole % symmetry != 0]
        ax.plot(no, np.full(len(no), 0.03), "x", color=GREY, label="forbidden by the symmetry", clip_on=False)
        ax.set_ylim(0, 1.12)
        ax.set_xlim(centre - half_width - 0.8, centre + half_width + 0.8)
        title = f"mesh harmonic {h} (order {centre})"
        label(ax, "carrier order [1]" if h == harmonics[-1] else "", "array factor [1]", title)
        if not any(lines.values()):
            continue
        over, bottom = ax.twinx(), min(10 * math.floor(threshold / 10), -20)
        over.set_ylim(bottom, -0.12 * bottom)
        over.grid(False)
        over.spines["top"].set_visible(False)
        label(over, y="level [dB re\nstrongest line]")
        for verdict, (mark, colour) in styles.items():
            drawn = [pair for pair in lines[verdict] if abs(pair[0] - centre) <= half_width + 0.5]
            if drawn:
                order, level = np.array(drawn).T
                over.vlines(order, bottom, level, color=colour, linewidth=1.5)
                over.plot(order, level, mark, color=colour, markersize=6, label=f"measured: {verdict}")
    legend_below(figure, columns=3)
    return figure
