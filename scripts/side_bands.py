#!/usr/bin/env python3
"""Which side bands does the spacing of the planets make? The array factor, a measured spectrum over it."""

from __future__ import annotations

import csv
import math
import re
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter
from script_tools import REFERENCE_CASE, print_table, ready_folder, run_script, say_files, write_csv

from femgear.case.quantities import SPEED, to_si
from femgear.errors import CaseError, nvh_library
from femgear.housing.orders import (
    FOREIGN,
    NORMAL,
    UNEQUAL,
    array_factor,
    classify_line,
    find_lines,
    spacing_symmetry,
)

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
class GearSet:
    """Teeth of ring, sun and planet, the latter None where not known, angles of the planets [rad]."""

    ring: int
    sun: int | None
    planet: int | None
    angles: np.ndarray

    @property
    def teeth(self) -> tuple[int, int | None, int | None]:
        """As `classify_line` takes them."""
        return self.ring, self.sun, self.planet


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
    known, ratio = _gear_set(case, ring, sun, planet, angle)
    if not (1 <= harmonics <= 12 and 1 <= half_width <= 60 and -200 <= threshold < 0):
        raise CaseError(
            "no such picture",
            code="E-RANGE",
            value=(harmonics, half_width, threshold),
            limit="1 to 12 harmonics, 1 to 60 orders on either side, a threshold of -200 dB up to below 0",
        )
    rows, order, level, found = [], np.zeros(0), np.zeros(0), []
    if spectrum is not None:
        measured = _read(spectrum, channel)
        order = _orders(measured, speed, ratio, spectrum)
        amplitude, step = measured.amplitude, float(np.median(np.diff(order)))
        own = max(0.5 * step, FINEST) if step < 0.5 else FINEST
        tolerance = _checked_tolerance(own if tolerance is None else tolerance, step)
        lines = find_lines(order, amplitude, threshold=threshold)
        order, level = order[lines], 20 * np.log10(amplitude[lines] / amplitude[lines].max(initial=0.0))
        found = [classify_line(one, known.angles, known.teeth, tolerance=tolerance) for one in order]
        rows = [
            (float(o), float(v), one.nearest, one.factor, one.verdict, one.reason)
            for o, v, one in zip(order, level, found)
        ]
    elif any(one is not None for one in (speed, channel, tolerance)):
        message, remedy = "speed, channel and tolerance belong to a spectrum", "give --spectrum FILE"
        raise CaseError(message, code="E-CHOICE", key="--spectrum", remedy=remedy)
    files = (PICTURE, FACTORS, LINES) if spectrum else (PICTURE, FACTORS)
    folder = ready_folder(output, files)
    _print_set(known)
    _write_factors(folder / FACTORS, known, harmonics, half_width)
    if spectrum is not None:
        write_csv(folder / LINES, HEADER, rows)
        _print_lines(measured.name, rows, threshold, tolerance, known)
    figure = _figure(known, order, level, [one.verdict for one in found], threshold, harmonics, half_width)
    from femgear.report.style import save_figure

    save_figure(figure, folder / PICTURE)
    say_files(folder, files)


def _gear_set(case, ring, sun, planet, angle) -> tuple[GearSet, float]:
    """The set of a case or of teeth and angles, and the speed of its carrier over that of ``--speed``."""
    from femgear.case.gear_set import need_set, planetary_set
    from femgear.stages.lumped_set import member_speeds
    from femgear.trains.reading import read_case

    if ring is None and (sun or planet or angle):
        message, remedy = "teeth and angles belong to a set without case file", "give --ring as well"
        raise CaseError(message, code="E-CHOICE", key="--ring", remedy=remedy)
    if ring is not None:
        if case is not None or not angle:
            message, limit = "a set without case file", "no CASE; --ring with an --angle for every planet"
            raise CaseError(message, code="E-CHOICE", key="--ring", value=ring, limit=limit)
        teeth = [one for one in (ring, sun, planet) if one is not None]
        apart = np.diff(np.sort(np.mod(angle, 360.0))) if np.isfinite(angle).all() else [0.0]
        if not all(5 <= one <= 2000 for one in teeth) or min(apart, default=1.0) < 0.1:
            raise CaseError(
                "teeth or angles of a set",
                code="E-RANGE",
                value=(*teeth, *angle),
                limit="5 to 2000 teeth, planets at different finite angles",
            )
        return GearSet(ring, sun, planet, np.radians(angle)), 1.0
    data = read_case(case or REFERENCE_CASE)
    need_set(data)
    if data.operation.fixed != "ring":
        message, remedy = "orders are those of a set whose ring stands still", "fix the ring"
        raise CaseError(message, code="E-FIXED-MEMBER", key="operation.fixed", limit='"ring"', remedy=remedy)
    gears = planetary_set(data)
    teeth = gears.ring.teeth, gears.sun.teeth, gears.planet.teeth
    return GearSet(*teeth, np.asarray(gears.planet_angles)), abs(member_speeds(data, gears).carrier)


def _read(path: Path, channel: str | None) -> Measured:
    """The spectrum of a file, checked."""
    kind = path.suffix.lower()
    found = _read_universal(path, channel) if kind in (".uff", ".unv") else _read_csv(path, channel)
    if not found.amplitude[found.abscissa > 0].max(initial=0.0) > 0:
        message, limit = "the spectrum is silent", "one amplitude above zero or more, not at rest"
        raise CaseError(message, code="E-FILE", file=str(path), limit=limit)
    return found


def _read_csv(path: Path, channel: str | None) -> Measured:
    from femgear.case.text import read_text

    lines = [(i, one) for i, one in enumerate(read_text(path).splitlines(), 1) if one.strip()]
    # spreadsheets write "sep=;" above the heading of files with decimal commas
    lines = [(i, one) for i, one in lines if not one.lstrip().lower().startswith(("#", "sep="))]

    def problem(message: str, line: int, value=None, limit=None, remedy: str = REMEDY) -> CaseError:
        where = {"file": f"{path}:{line}", "value": value, "limit": limit, "remedy": remedy}
        return CaseError(message, code="E-FILE", **where)

    if len(lines) < 3:
        raise problem(f"{max(len(lines) - 1, 0)} lines of a spectrum", 1, limit="a heading and two lines or more")
    divider = next((mark for mark in ";\t" if mark in lines[0][1]), ",")
    (first, heading), *table = [(i, next(csv.reader([one], delimiter=divider))) for i, one in lines]
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
            pair = [float(one.replace(",", ".") if divider != "," else one) for one in texts]
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
    with nvh_library("universal files"):
        import pyuff

    def problem(message: str, **words) -> CaseError:
        return CaseError(message, code="E-FILE", file=str(path), **words)

    try:
        sets = pyuff.UFF(str(path)).read_sets() if path.is_file() else None
    except Exception as error:
        raise problem(f"no universal file that can be read: {str(error)[:200]}") from error
    if sets is None:
        raise problem("no such file", limit="a CSV or universal file (.uff, .unv)")
    numbered = enumerate(sets if isinstance(sets, list) else [sets], 1)
    every = [(i, str(one.get("id1", "")).strip(), one) for i, one in numbered if one.get("type") == 58]
    found = every = [item for item in every if channel in (None, item[1])] or every
    if len(every) > 1:  # a signal may have the name of its spectrum
        found = [item for item in every if item[2]["func_type"] in KNOWN]
    if len(found) != 1:
        listed = "; ".join(f"{name} (dataset {i}, type {one['func_type']})" for i, name, one in found or every)
        raise problem(
            f"{len(found)} spectra in the file",
            value=listed[:600] or None,
            limit="one dataset 58 of a spectrum",
            remedy="choose one by --channel and its ID line 1",
        )
    ((number, name, one),) = found
    where, y = f"dataset {number}: {name}", np.asarray(one["data"])
    if one["func_type"] not in KNOWN:
        raise problem(
            "a function that is no spectrum of amplitudes",
            value=f"{where}, type {one['func_type']}",
            limit=", ".join(f"{number} ({word})" for number, word in KNOWN.items()),
            remedy="export the amplitude spectrum of one sensor",
        )
    if one["func_type"] == 2 and np.iscomplexobj(y):
        raise problem("an auto spectrum with complex values", value=where, limit="real numbers")
    kind = one.get("abscissa_spec_data_type")
    if kind not in (18, 20):
        limit, remedy = "18 (frequency) or 20 (order)", "export the spectrum over frequency or order"
        raise problem("abscissa of another kind", value=f"{where}, type {kind}", limit=limit, remedy=remedy)
    x, unit = np.asarray(one["x"], float), str(one.get("abscissa_axis_units_lab", "")).strip()
    if kind == 18 and unit not in ("", "NONE", *HERTZ):
        raise problem("a unit of frequency that is none", value=f"{where}: {unit}", limit=" or ".join(HERTZ))
    # six digits of the step would move high orders; femgear tells it in full
    told = str(one.get("id2", "")).partition("step [Hz]: ")[2]
    x = float(told) * np.arange(len(y)) if told else x * HERTZ.get(unit, 1.0)
    # an auto spectrum has the squares of the amplitudes (universal file, dataset 58, record 6)
    y = np.sqrt(np.maximum(np.real(y), 0.0)) if one["func_type"] == 2 else np.abs(y)
    if len(x) < 2 or not (np.isfinite(x).all() and np.isfinite(y).all() and (np.diff(x) > 0).all()):
        limit = "two lines or more, finite, over an abscissa that ascends"
        raise problem("no spectrum", value=where, limit=limit)
    return Measured(x, kind == 18, y, f"{path.name}: {name}")


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


def _print_set(known: GearSet) -> None:
    g, angles = spacing_symmetry(known.angles), ", ".join(f"{math.degrees(one):.5g}" for one in known.angles)
    rule = f"alike, they make multiples of {g} alone" if g > 1 else "no order is forbidden"
    print(f"{known.ring} ring teeth, planets at {angles} deg: {rule}")


def _write_factors(path: Path, known: GearSet, harmonics: int, half_width: int) -> None:
    g, rows = spacing_symmetry(known.angles), []
    for h in range(1, harmonics + 1):
        orders = np.arange(max(h * known.ring - half_width, 1), h * known.ring + half_width + 1)
        for order, factor in zip(orders.tolist(), array_factor(known.angles, orders).tolist()):
            rows.append((h, order, factor, "forbidden" if order % g else ""))
    write_csv(path, ("mesh harmonic", "carrier order", "array factor", "symmetry"), rows)


def _print_lines(name: str, rows, threshold: float, tolerance: float, known: GearSet) -> None:
    strongest = sorted(sorted(rows, key=lambda row: -row[1])[:SHOWN])
    shown = [(f"{o:.7g}", f"{v:.1f}", f"{n}", f"{f:.3f}", *words) for o, v, n, f, *words in strongest]
    title = f"{name}: {len(rows)} lines above {threshold:g} dB, orders within {tolerance:.3g} count as one"
    print_table(title + (f", the strongest {SHOWN}" if len(rows) > SHOWN else ""), HEADER, shown)
    counts = ((word, sum(row[4] == word for row in rows)) for word in (NORMAL, UNEQUAL, FOREIGN))
    print(", ".join(f"{count} {word}" for word, count in counts))
    parts = sum(one is not None for one in known.teeth[1:])
    if parts:
        chance = 1 - (1 - 2 * tolerance) ** (4 * parts)
        print(f"an order without meaning fits turns of sun or planet by chance in {chance:.0%} of cases at most")


def _figure(known: GearSet, order, level, verdicts, threshold: float, harmonics: int, half_width: int):
    """Array factor as bars, forbidden orders crossed, levels of measured lines over it."""
    from femgear.report.style import BLACK, BLUE, GREY, SKY, VERMILION, label, legend_below, new_figure

    figure, axes = new_figure(rows=harmonics, width=9.5, height=1.6 + 2.5 * harmonics)
    g, marks = (
        spacing_symmetry(known.angles),
        {NORMAL: ("o", BLUE), UNEQUAL: ("s", VERMILION), FOREIGN: ("^", BLACK)},
    )
    for h, ax in enumerate(axes, 1):
        centre = h * known.ring
        whole = np.arange(max(centre - half_width, 1), centre + half_width + 1)
        ax.bar(whole, array_factor(known.angles, whole), width=0.8, color=SKY, alpha=0.5, label="array factor")
        no = whole[whole % g != 0]
        ax.plot(no, np.full(len(no), 0.03), "x", color=GREY, label="forbidden by the symmetry", clip_on=False)
        ax.set_ylim(0, 1.12)
        ax.set_xlim(centre - half_width - 0.8, centre + half_width + 0.8)
        title = f"mesh harmonic {h} (order {centre})"
        label(ax, "carrier order [1]" if h == harmonics else "", "array factor [1]", title)
        if not len(order):
            continue
        over, bottom = ax.twinx(), min(10 * math.floor(threshold / 10), -20)
        over.set_ylim(bottom, -0.12 * bottom)
        over.grid(False)
        over.spines["top"].set_visible(False)
        label(over, y="level [dB re\nstrongest line]")
        for verdict, (mark, colour) in marks.items():
            own = np.array([one == verdict for one in verdicts])
            own &= np.abs(order - centre) <= half_width + 0.5
            if own.any():
                over.vlines(order[own], bottom, level[own], color=colour, linewidth=1.5)
                over.plot(order[own], level[own], mark, color=colour, markersize=6, label=f"measured: {verdict}")
    legend_below(figure, columns=3)
    return figure


if __name__ == "__main__":
    sys.exit(run_script(main))
