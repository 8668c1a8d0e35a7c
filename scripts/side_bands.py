#!/usr/bin/env python3
"""Which side bands does the spacing of the planets make? The array factor, a measured spectrum over it."""

from __future__ import annotations

import csv
import math
import re
import sys
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter
from script_tools import REFERENCE_CASE, print_table, ready_folder, run_script, say_files, write_csv

from femgear.case.quantities import SPEED, to_si
from femgear.errors import CaseError
from femgear.findings import percent
from femgear.housing.orders import (
    FOREIGN,
    NORMAL,
    UNEQUAL,
    array_factor,
    classify_lines,
    find_lines,
    spacing_symmetry,
)
from femgear.measured.heard_set import HeardSet, heard_set
from femgear.measured.lines import chance
from femgear.measured.universal_functions import FREQUENCY, ORDER, read_universal_functions
from femgear.measured.verdict import draw_side_bands
from femgear.report.style import save_figure

PICTURE, FACTORS, LINES = "side_bands.png", "array_factor.csv", "lines.csv"
HEADER = ("order", "level [dB]", "whole order", "array factor", "verdict", "why")
SHOWN = 40  # lines of the table
FINEST = 0.02  # orders that a record of 50 turns of the carrier tells apart, halved
KNOWN = {
    0: "general",
    2: "auto spectrum",
    12: "spectrum",
}  # function types of dataset 58 that hold amplitudes
HERTZ = {"Hz": 1.0, "kHz": 1e3}
REMEDY = "name the columns order or frequency [Hz], and amplitude [m/s^2] or level [dB]"


@dataclass(frozen=True)
class Measured:
    """A spectrum: abscissa (n,), ascending, whether it is a frequency [Hz], amplitudes (n,), what it is."""

    abscissa: np.ndarray
    hertz: bool
    amplitude: np.ndarray
    name: str


def main(
    case: Path | None = None,
    /,
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = Path("out/side_bands"),
    ring: int | None = None,
    sun: int | None = None,
    planet: int | None = None,
    angle: Annotated[tuple[float, ...], Parameter(negative="", allow_leading_hyphen=True)] = (),
    spectrum: Path | None = None,
    channel: str | None = None,
    speed: str | None = None,
    threshold: float = -30.0,
    tolerance: float | None = None,
    harmonics: int = 3,
    half_width: int = 12,
) -> None:
    """Draw the planet array factor around mesh harmonics, and judge every line of a measured spectrum.

    Parameters
    ----------
    case
        TOML case file of a planetary set whose ring stands still; the reference set when left out.
    output
        Folder of the results.
    ring, sun, planet
        Teeth of a set without case file; turns of sun and planet are named where their teeth are given.
    angle
        Angles of its planets [deg], once for every planet.
    spectrum
        Of a sensor on the housing: CSV with the columns order or frequency [Hz], and amplitude or level [dB];
        or a universal file (.uff, .unv), dataset 58, of amplitudes.
    channel
        Column or dataset (ID line 1) of the file, where it has several.
    speed
        Speed with its unit at which a spectrum over frequency was measured: of the input of the case, with
        --ring of the carrier.
    threshold
        Level over the strongest line from which on lines are looked at [dB]; what a Hann window leaves beside
        a line stays 31 dB below it.
    tolerance
        Distance of orders that count as one: half the step of the spectrum, 0.02 or more, when left out.
    harmonics
        Mesh harmonics drawn.
    half_width
        Carrier orders drawn on either side of each.
    """
    gear_set, ratio = _gear_set(case, ring, sun, planet, angle)
    if not (1 <= harmonics <= 12 and 1 <= half_width <= 60 and -200 <= threshold < 0):
        raise CaseError(
            "no such picture",
            code="E-RANGE",
            value=(harmonics, half_width, threshold),
            limit="1 to 12 harmonics, 1 to 60 orders on either side, a threshold of -200 dB up to below 0",
        )
    rows, order, level, verdicts = [], np.zeros(0), np.zeros(0), ()
    if spectrum is not None:
        measured = _read(spectrum, channel)
        order = _orders(measured, speed, ratio, spectrum)
        amplitude, step = measured.amplitude, float(np.median(np.diff(order)))
        finest = max(0.5 * step, FINEST) if step < 0.5 else FINEST
        within = _checked_tolerance(finest if tolerance is None else tolerance, step)
        lines = find_lines(order, amplitude, threshold=threshold)
        order, level = order[lines], 20 * np.log10(amplitude[lines] / amplitude[lines].max(initial=0.0))
        verdicts = classify_lines(order.tolist(), gear_set.angles, gear_set.teeth, tolerance=within)
        rows = [
            (float(o), float(v), verdict.nearest, verdict.factor, verdict.verdict, verdict.reason)
            for o, v, verdict in zip(order, level, verdicts)
        ]
    elif any(option is not None for option in (speed, channel, tolerance)):
        message, remedy = "speed, channel and tolerance belong to a spectrum", "give --spectrum FILE"
        raise CaseError(message, code="E-CHOICE", key="--spectrum", remedy=remedy)
    files = (PICTURE, FACTORS, LINES) if spectrum else (PICTURE, FACTORS)
    folder = ready_folder(output, files)
    _print_set(gear_set)
    _write_factors(folder / FACTORS, gear_set, harmonics, half_width)
    if spectrum is not None:
        write_csv(folder / LINES, HEADER, rows)
        _print_lines(measured.name, rows, threshold, within, gear_set, {verdict.part for verdict in verdicts})
    lines_of = {word: [(row[0], row[1]) for row in rows if row[4] == word] for word in (NORMAL, UNEQUAL, FOREIGN)}
    drawn = {"threshold": threshold, "harmonics": range(1, harmonics + 1), "half_width": half_width}
    save_figure(draw_side_bands(gear_set, lines_of if rows else {}, **drawn), folder / PICTURE)
    say_files(folder, files)


def _gear_set(case, ring, sun, planet, angle) -> tuple[HeardSet, float]:
    """The set of a case or of teeth and angles, and the speed of its carrier over that of ``--speed``."""
    from femgear.trains.reading import read_case

    if ring is None and (sun or planet or angle):
        message, remedy = "teeth and angles belong to a set without case file", "give --ring as well"
        raise CaseError(message, code="E-CHOICE", key="--ring", remedy=remedy)
    if ring is not None:
        if case is not None or not angle:
            message, limit = "a set without case file", "no CASE; --ring with an --angle for every planet"
            raise CaseError(message, code="E-CHOICE", key="--ring", value=ring, limit=limit)
        teeth = [count for count in (ring, sun, planet) if count is not None]
        apart = np.diff(np.sort(np.mod(angle, 360.0))) if np.isfinite(angle).all() else [0.0]
        if not all(5 <= count <= 2000 for count in teeth) or min(apart, default=1.0) < 0.1:
            raise CaseError(
                "teeth or angles of a set",
                code="E-RANGE",
                value=(*teeth, *angle),
                limit="5 to 2000 teeth, planets at different finite angles",
            )
        return HeardSet(ring, sun, planet, np.radians(angle)), 1.0
    gear_set = heard_set(read_case(case or REFERENCE_CASE))
    return gear_set, gear_set.carrier_per_turn[gear_set.input]


def _read(path: Path, channel: str | None) -> Measured:
    """The spectrum of a file, checked."""
    kind = path.suffix.lower()
    spectrum_read = _read_universal(path, channel) if kind in (".uff", ".unv") else _read_csv(path, channel)
    if not spectrum_read.amplitude[spectrum_read.abscissa > 0].max(initial=0.0) > 0:
        message, limit = "the spectrum is silent", "one amplitude above zero or more, not at rest"
        raise CaseError(message, code="E-FILE", file=str(path), limit=limit)
    return spectrum_read


def _read_csv(path: Path, channel: str | None) -> Measured:
    from femgear.case.text import read_text

    lines = [(i, row_text) for i, row_text in enumerate(read_text(path).splitlines(), 1) if row_text.strip()]
    # spreadsheets write "sep=;" above the heading of files with decimal commas
    lines = [(i, row_text) for i, row_text in lines if not row_text.lstrip().lower().startswith(("#", "sep="))]

    def problem(message: str, line: int, value=None, limit=None, remedy: str = REMEDY) -> CaseError:
        where = {"file": f"{path}:{line}", "value": value, "limit": limit, "remedy": remedy}
        return CaseError(message, code="E-FILE", **where)

    if len(lines) < 3:
        raise problem(f"{max(len(lines) - 1, 0)} lines of a spectrum", 1, limit="a heading and two lines or more")
    divider = next((mark for mark in ";\t" if mark in lines[0][1]), ",")
    (first, heading), *table = [(i, next(csv.reader([row_text], delimiter=divider))) for i, row_text in lines]
    names = [[*re.split(r"[\[(]", cell.strip(), maxsplit=1), ""] for cell in heading]
    names = [(name.strip().lower(), unit.rstrip(")] ").strip()) for name, unit, *_ in names]
    title = ", ".join(heading)
    axis = [i for i, (name, _) in enumerate(names) if name in ("order", "carrier order", "frequency")]
    if len(axis) != 1:
        raise problem("no column of orders or of frequencies, or both", first, title, "one of them")
    others = [i for i in range(len(names)) if i != axis[0]]
    chosen = [i for i in others if channel in (None, heading[i].strip(), names[i][0])]
    if len(chosen) != 1:
        remedy = "choose one by --channel" if len(others) > 1 else REMEDY
        raise problem(f"{len(chosen)} columns of amplitudes", first, title, "one", remedy)
    (name, unit), hertz = names[axis[0]], names[axis[0]][0] == "frequency"
    if unit not in (HERTZ if hertz else ("", "1")):
        limit = " or ".join(HERTZ) if hertz else "order without a unit"
        raise problem(f"a unit of {name} that is none", first, heading[axis[0]], limit)
    level, values = names[chosen[0]][1].startswith("dB"), list[tuple[float, float]]()
    for i, cells in table:
        try:
            texts = [cells[axis[0]], cells[chosen[0]]]
            pair = [float(text.replace(",", ".") if divider != "," else text) for text in texts]
        except (ValueError, IndexError):
            pair = [math.nan]
        if len(cells) != len(names) or not all(map(math.isfinite, pair)):
            remedy = "write numbers with decimal points, or decimal commas between semicolons"
            raise problem("no finite numbers", i, divider.join(cells), f"{len(names)} of them", remedy)
        if pair[0] < 0 or (not level and pair[1] < 0):
            raise problem("a negative order, frequency or amplitude", i, divider.join(cells), "0 or more")
        if values and pair[0] <= values[-1][0]:
            remedy = "sort the lines, and keep one line of every order"
            raise problem("orders or frequencies do not ascend", i, cells[axis[0]], remedy=remedy)
        values.append((pair[0], pair[1]))
    x, y = np.array(values).T
    amplitude = 10 ** (y / 20) if level else y
    return Measured(x * (HERTZ[unit] if hertz else 1.0), hertz, amplitude, f"{path.name}: {heading[chosen[0]]}")


def _read_universal(path: Path, channel: str | None) -> Measured:
    """Dataset 58; of complex lines, which femgear exports, the modulus counts."""

    def problem(message: str, **words) -> CaseError:
        return CaseError(message, code="E-FILE", file=str(path), **words)

    every = read_universal_functions(path)
    every = [function for function in every if channel in (None, function.name)] or every
    spectra = every
    if len(every) > 1:  # a signal may have the name of its spectrum
        spectra = [function for function in every if function.kind in KNOWN]
    if len(spectra) != 1:
        listed = "; ".join(
            f"{dataset.name} (dataset {dataset.number}, type {dataset.kind})" for dataset in spectra or every
        )
        raise problem(
            f"{len(spectra)} spectra in the file",
            value=listed[:600] or None,
            limit="one dataset 58 of a spectrum",
            remedy="choose one by --channel and its ID line 1",
        )
    (function,) = spectra
    where, x, y = f"dataset {function.number}: {function.name}", function.abscissa, function.values
    if function.kind not in KNOWN:
        raise problem(
            "a function that is no spectrum of amplitudes",
            value=f"{where}, type {function.kind}",
            limit=", ".join(f"{number} ({word})" for number, word in KNOWN.items()),
            remedy="export the amplitude spectrum of one sensor",
        )
    if function.kind == 2 and np.iscomplexobj(y):
        raise problem("an auto spectrum with complex values", value=where, limit="real numbers")
    if function.abscissa_kind not in (FREQUENCY, ORDER):
        limit, remedy = "18 (frequency) or 20 (order)", "export the spectrum over frequency or order"
        value = f"{where}, type {function.abscissa_kind}"
        raise problem("abscissa of another kind", value=value, limit=limit, remedy=remedy)
    unit, hertz = function.abscissa_unit, function.abscissa_kind == FREQUENCY
    if hertz and unit not in ("", *HERTZ):
        raise problem("a unit of frequency that is none", value=f"{where}: {unit}", limit=" or ".join(HERTZ))
    # six digits of the step would move high orders; femgear tells it in full
    step = function.run.partition("step [Hz]: ")[2]
    x = float(step) * np.arange(len(y)) if step else x * HERTZ.get(unit, 1.0)
    # an auto spectrum has the squares of the amplitudes (universal file, dataset 58, record 6)
    y = np.sqrt(np.maximum(np.real(y), 0.0)) if function.kind == 2 else np.abs(y)
    if len(x) < 2 or not (np.isfinite(x).all() and np.isfinite(y).all() and (np.diff(x) > 0).all()):
        limit = "two lines or more, finite, over an abscissa that ascends"
        raise problem("no spectrum", value=where, limit=limit)
    return Measured(x, hertz, y, f"{path.name}: {function.name}")


def _orders(measured: Measured, speed: str | None, ratio: float, path: Path) -> np.ndarray:
    """Carrier orders of a spectrum."""
    if measured.hertz != (speed is not None):
        limit = "--speed with a spectrum over frequency, and with no other"
        message, value = "the speed of a spectrum", "over frequency" if measured.hertz else "over orders"
        raise CaseError(message, code="E-SPEED", key="--speed", value=value, file=str(path), limit=limit)
    if speed is None:
        return measured.abscissa
    carrier = abs(to_si(speed, SPEED)) * ratio / (2 * np.pi)
    if carrier == 0:
        raise CaseError("at rest nothing is heard", code="E-SPEED", key="--speed", value=speed, limit="not zero")
    print(f"carrier: {60 * carrier:.6g} rpm, one order is {carrier:.6g} Hz")
    return measured.abscissa / carrier


def _checked_tolerance(tolerance: float, step: float) -> float:
    if not (0 < tolerance < 0.25 and (step >= 0.5 or tolerance >= 0.499 * step)):
        raise CaseError(
            "the tolerance of orders does not fit the spectrum",
            code="E-RANGE",
            key="--tolerance",
            value=f"{tolerance:g}, step {step:.3g} orders",
            limit="half the step or more, below 0.25",
            remedy="measure over more turns of the carrier: as many as one over the step",
        )
    return tolerance


def _print_set(gear_set: HeardSet) -> None:
    g, angles = spacing_symmetry(gear_set.angles), ", ".join(f"{math.degrees(angle):.5g}" for angle in gear_set.angles)
    rule = f"planets that are alike make only multiples of {g}" if g > 1 else "no order is forbidden"
    print(f"{gear_set.ring} ring teeth, planets at {angles} deg: {rule}")


def _write_factors(path: Path, gear_set: HeardSet, harmonics: int, half_width: int) -> None:
    g, rows = spacing_symmetry(gear_set.angles), []
    for h in range(1, harmonics + 1):
        orders = np.arange(max(h * gear_set.ring - half_width, 1), h * gear_set.ring + half_width + 1)
        for order, factor in zip(orders.tolist(), array_factor(gear_set.angles, orders).tolist()):
            rows.append((h, order, factor, "forbidden" if order % g else ""))
    write_csv(path, ("mesh harmonic", "carrier order", "array factor", "symmetry"), rows)


def _print_lines(
    name: str, rows, threshold: float, tolerance: float, gear_set: HeardSet, heard_parts: Collection[str]
) -> None:
    strongest = sorted(sorted(rows, key=lambda row: -row[1])[:SHOWN])
    shown = [(f"{o:.7g}", f"{v:.1f}", f"{n}", f"{f:.3f}", *words) for o, v, n, f, *words in strongest]
    title = f"{name}: {len(rows)} lines above {threshold:g} dB, orders within {tolerance:.3g} count as one"
    print_table(title + (f", the strongest {SHOWN}" if len(rows) > SHOWN else ""), HEADER, shown)
    counts = ((word, sum(row[4] == word for row in rows)) for word in (NORMAL, UNEQUAL, FOREIGN))
    print(", ".join(f"{count} {word}" for word, count in counts))
    if any(gear_set.teeth[1:]):
        likely = chance(tolerance, gear_set.teeth, spacing_symmetry(gear_set.angles), heard_parts)
        print(f"an order without meaning fits turns of sun or planet by chance in {percent(likely)} of cases at most")


if __name__ == "__main__":
    sys.exit(run_script(main))
