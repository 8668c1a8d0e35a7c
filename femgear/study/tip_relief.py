"""The tip relief of sun and planets with the least transmission error at one torque, as a case file."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from femgear.case import text as case_text
from femgear.case.gear_set import planetary_set, set_deviations
from femgear.case.planetary import Case
from femgear.case.quantities import TORQUE, to_si
from femgear.contact.supports import RIGID
from femgear.errors import CaseError
from femgear.findings import percent
from femgear.gears.planetary import PlanetarySet
from femgear.report.style import family, save_figure
from femgear.report.tables import Block
from femgear.stages.protocol import Progress, one_blas_thread, silent
from femgear.storage.files import own_files, resumable, write_csv, write_text
from femgear.study.designs import Journal, open_journal
from femgear.study.faults import all_faults
from femgear.study.figures import relief_contours
from femgear.study.harris import POWERS, checked_amount, with_positions
from femgear.study.problem import Shape
from femgear.study.relief import (
    AMOUNT_STEP,
    LENGTH_STEP,
    DesignBasis,
    HarrisMap,
    ReliefGrid,
    ReliefOptimum,
    design_basis,
    harris_map,
    is_cycle,
    loads_back,
    longest_relief,
    optimise_relief,
    relief_grid,
    relief_starts,
    sun_torque,
)
from femgear.trains.reading import to_toml, with_value, with_values

_SHORTEST, _LONGEST = 0.4, 1.2
"""Range of lengths searched, in lengths of two-pair contact; parabolas, which begin gently, reach half the path."""
_TABLE, _FIGURE, _CASE, _JOURNAL = "tip_relief.csv", "tip_relief.png", "relief.toml", "relief.jsonl"
_HEADER = ("torque [N m]", "relief [m]", "length [two-pair contact]", "STE peak to peak [m]", "over unmodified [1]")


@dataclass(frozen=True)
class ReliefRequest:
    """What relief is searched.

    Parameters
    ----------
    torque : str, optional
        Of the input, with its unit; by default that of the case.
    also : sequence of str
        Further torques of maps; by default half and one and a half times the first.
    largest : str, optional
        Largest amount, with its unit; by default twice the mean deflection of the sun-planet meshes.
    shape : {"linear", "parabolic"}
        Of the relief.
    points : int
        Of the grid along amount and length.
    positions : int, optional
        In one mesh period; by default those of the case.
    """

    torque: str | None = None
    also: Sequence[str] = ()
    largest: str | None = None
    shape: Shape = "parabolic"
    points: int = 7
    positions: int | None = None


@one_blas_thread()
def relief_into(
    case: Case, folder: Path, request: ReliefRequest, *, cache: Path | None = None, progress: Progress = silent
) -> tuple[list[Block], list[str]]:
    """Search the relief, or go on; write map, figure, case file and journal, and give tables and names.

    The numbers of the relief are those of the case that is written, at the positions and with the record that
    ``femgear run`` has. ``cache`` is the folder of generated grids. CaseError: everything that is wrong with
    the request. StorageError: files of others (E-OUTPUT, E-JOURNAL).
    """
    case, inputs, on_sun, top = _checked(case, request)
    target = sun_torque(case, planetary_set(case))
    own_files(folder, (_TABLE, _FIGURE, _CASE))
    with resumable(folder), open_journal(folder / _JOURNAL, case, {}, is_cycle) as journal:
        progress("compliance", 0, 1)
        basis = design_basis(case, cache=cache)
        progress("compliance", 1, 1)
        top = 2.0 * _mean_deflection(basis, target) if top is None else top
        amounts = top * np.arange(1, request.points + 1) / request.points
        grid, best = _searched(basis, amounts, on_sun, target, request.shape, progress, journal)
        relief = {"amount": best.amount, "length": best.length, "shape": request.shape, "back": target < 0}
        relieved, tables = with_relief_tables(case, basis.gears, **relief)
        of_cases = [basis.deviations, set_deviations(relieved)]
        runs = harris_map(basis, torques=[target], deviations=of_cases)
        progress("optimum", 1, 1)
        write_csv(folder / _TABLE, _HEADER, _records(inputs, grid))
        figure = relief_contours(
            grid.amounts,
            grid.lengths,
            grid.ratio,
            inputs,
            optimum=(best.amount, best.length),
            design=case.operation.torque,
        )
        save_figure(figure, folder / _FIGURE)
        write_text(to_toml(relieved), folder / _CASE)
    names = list(dict.fromkeys(map(family, basis.gears.mesh_names)))
    added = any(getattr(case, gear.name).modifications for gear in basis.gears.gears[:2])
    optimum = _described_optimum(case, best, grid, runs, names, added=added)
    blocks = [_described_grid(inputs, grid, names[0]), optimum]
    return [*blocks, Block(f"Of {_CASE}", notes=tuple(tables.splitlines()))], [_TABLE, _FIGURE, _CASE, _JOURNAL]


def _checked(case: Case, request: ReliefRequest) -> tuple[Case, np.ndarray, np.ndarray, float | None]:
    """Case under the torque and with the positions asked for, torques on input and sun (T,), largest amount."""
    gears, top, others = planetary_set(case), None, list[float]()
    with all_faults() as part:
        with part("--points"):
            if not 3 <= request.points <= 100:
                raise CaseError(
                    "out of range",
                    code="E-RANGE",
                    value=request.points,
                    limit="3 to 100",
                    remedy="7 points cost 49 mesh cycles a torque",
                )
        with part("--positions"):
            case = with_positions(case, request.positions)
        if request.torque is not None:
            with part("--torque"):
                sun_torque(case, gears, to_si(request.torque, TORQUE))
                case = with_value(case, "operation.torque", request.torque)
        with part("--torque"):
            sun_torque(case, gears)
        for text in request.also:
            with part("--also"):
                others.append(to_si(text, TORQUE))
                sun_torque(case, gears, others[-1])
        if request.largest is not None:
            with part("--largest"):
                top = checked_amount(request.largest, "--largest", case.module, least=1e-8)
        with part("--also"):
            loads_back(np.array([case.operation.torque, *others]))
        with part():
            relief_starts(gears, length=_SHORTEST)
    design = case.operation.torque
    inputs = np.unique([design, *(others or [0.5 * design, 1.5 * design])])
    return case, inputs, np.array([sun_torque(case, gears, float(value)) for value in inputs]), top


def _mean_deflection(basis: DesignBasis, torque: float) -> float:
    """Mean deflection of the sun-planet meshes of ideal gears on fixed axes [m]."""
    few = replace(basis, supports=RIGID, deviations=None, both_flanks=False, positions=8)
    return float(few.walk(torque).deflection[: basis.gears.n_planets].mean())


def _searched(
    basis: DesignBasis,
    amounts: np.ndarray,
    on_sun: np.ndarray,
    target: float,
    shape: Shape,
    progress: Progress,
    journal: Journal,
) -> tuple[ReliefGrid, ReliefOptimum]:
    """The grid, and the optimum at the target torque."""
    power = POWERS[shape]
    half = 0.5 * longest_relief(basis.gears)
    lengths = np.linspace(_SHORTEST, max(half, _LONGEST) if shape == "parabolic" else _LONGEST, len(amounts))
    grid = relief_grid(
        basis, amounts=amounts, lengths=lengths, torques=on_sun, power=power, progress=progress, journal=journal
    )
    progress("optimum", 0, 1)
    return grid, optimise_relief(basis, grid, torque=target, power=power, journal=journal)


def with_relief_tables(
    case: Case, gears: PlanetarySet, *, amount: float, length: float, shape: Shape, back: bool
) -> tuple[Case, str]:
    """Add a tip relief of sun and planets to a case file; its tables as text, amounts to a nanometre.

    Amount [m], length and ``back`` are those of `femgear.study.relief.with_tip_relief`.
    """
    given, values, lines = case_text.parse(case.source, case.name), dict[str, object](), list[str]()
    flanks = {}, {"flank": "ring side" if back else "sun side"}
    starts = relief_starts(gears, length=length)
    for gear, start, flank in zip(gears.gears[:2], starts, flanks, strict=True):
        flank = flank if gear.name == "planet" else {}
        diameter = 2e3 * math.hypot(start, gear.base_radius)
        table = {"kind": "tip relief", **flank, "amount": f"{1e6 * amount:.3f} um"}
        table |= {"start_diameter": f"{diameter:.5f} mm", "shape": shape}
        values[f"{gear.name}.modifications"] = [*given[gear.name].get("modifications", []), table]
        lines += [f"[[{gear.name}.modifications]]", *(f'{key} = "{value}"' for key, value in table.items()), ""]
    return with_values(case, values), "\n".join(lines[:-1]) + "\n"


def _records(inputs: np.ndarray, grid: ReliefGrid) -> Iterator[tuple[float, ...]]:
    """Rows of the table of the map, in SI units."""
    for (t, a, b), peak in np.ndenumerate(grid.peak_to_peak):
        place = float(inputs[t]), float(grid.amounts[a]), float(grid.lengths[b])
        yield (*place, float(peak), float(grid.ratio[t, a, b]))


def _described_grid(inputs: np.ndarray, grid: ReliefGrid, mesh: str) -> Block:
    """Tabulate the best point of the grid at every torque."""
    rows = []
    for t, torque in enumerate(inputs):
        a, b = np.unravel_index(grid.peak_to_peak[t].argmin(), grid.peak_to_peak[t].shape)
        numbers = (grid.unmodified[t] * 1e6, grid.peak_to_peak[t, a, b] * 1e6)
        place = f"{grid.amounts[a] * 1e6:.2f}", f"{grid.lengths[b]:.3f}"
        rows.append((f"{torque:g}", *place, *(f"{x:.4f}" for x in numbers), percent(grid.ratio[t, a, b], 1)))
    header = ("torque [N m]", "relief [um]", "length [1]", "before, p-p [um]", "STE p-p [um]", "over before")
    return Block(f"Best points of the grid, {mesh} meshes", header, tuple(rows))


def _described_optimum(
    case: Case, best: ReliefOptimum, grid: ReliefGrid, runs: HarrisMap, names: Sequence[str], *, added: bool
) -> Block:
    """Tabulate the transmission errors of the case and of that with the relief, and say how sure it is."""
    pairs = list(zip(names, runs.peak_to_peak[..., 0].T, strict=True))
    pairs += [("sun to ring", runs.overall[:, 0])] if len(names) > 1 else []
    rows = tuple(
        (name, f"{1e6 * before:.4f}", f"{1e6 * after:.4f}", percent(after / before, 1))
        for name, (before, after) in pairs
    )
    notes = [
        f"{best.amount * 1e6:.3f} um over {best.length:.3f} lengths of two-pair contact, {best.evaluations} mesh "
        f"cycles{f'; the search looks at the {names[0]} meshes alone' if len(names) > 1 else ''}"
    ]
    if added:
        notes.append("ADDED TO THE CASE: its gears have modifications of their own, to which this relief comes")
    header = ("mesh", "before, p-p [um]", "with relief, p-p [um]", "over before")
    title = f"Optimum at {case.operation.torque:g} N m: transmission errors as femgear run {_CASE} finds them"
    return Block(title, header, rows, (*notes, *_judged(best, grid)))


def _judged(best: ReliefOptimum, grid: ReliefGrid) -> Iterator[str]:
    """Write the slopes on either side of the optimum, and whether it is a minimum."""
    for name, slopes, step, words, number, unit in (
        ("amount", best.amount_slopes, AMOUNT_STEP, ("less", "more"), 1.0, "um per um"),
        ("length", best.length_slopes, LENGTH_STEP, ("shorter", "longer"), 1e3, "um per mm"),
    ):
        parts = [
            f"end of the range searched to {word}" if np.isnan(slope) else f"{number * slope:+.3f} {unit} {word}"
            for slope, word in zip(slopes, words, strict=True)
        ]
        yield f"slopes of the STE peak to peak over the {name}, within {step * 1e6:g} um: {', '.join(parts)}"
    if not best.minimum:
        yield "NOT A MINIMUM: the search ended where a neighbour still lies lower; use more --points"
    elif best.at_end:
        ends = f"up to {grid.amounts[-1] * 1e6:.3f} um, lengths {grid.lengths[0]:g} to {grid.lengths[-1]:g}"
        yield f"NOT A MINIMUM: {' and '.join(best.at_end)} at an end of the range searched ({ends})"
