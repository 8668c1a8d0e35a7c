"""The Harris map of a case: transmission error peak to peak over torque for several tip reliefs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from femgear.case.gear_set import planetary_set
from femgear.case.planetary import Case
from femgear.case.quantities import LENGTH, TORQUE, to_si
from femgear.errors import CaseError
from femgear.gears.modifications import LARGEST_DEVIATION
from femgear.report.style import family, save_figure
from femgear.report.tables import Block
from femgear.stages.protocol import Progress, one_blas_thread, silent
from femgear.storage.files import own_files, resumable, write_csv
from femgear.study.designs import open_journal
from femgear.study.faults import all_faults
from femgear.study.figures import harris_curves
from femgear.study.problem import Shape
from femgear.study.relief import (
    HarrisMap,
    design_basis,
    harris_map,
    is_cycle,
    loads_back,
    relief_name,
    relief_starts,
    sun_torque,
    with_tip_relief,
)
from femgear.trains.reading import with_value

POWERS = {"linear": 1.0, "parabolic": 2.0}
"""Power of a relief over its length, by its shape."""
_TABLE, _FIGURE, _JOURNAL = "harris_map.csv", "harris_map.png", "harris.jsonl"


@dataclass(frozen=True)
class HarrisRequest:
    """What a Harris map shows.

    Parameters
    ----------
    reliefs : sequence of str
        Amounts of the tip relief of sun and planets, with their units.
    length : float
        Of the reliefs, in lengths of two-pair contact.
    shape : {"linear", "parabolic"}
        Of the reliefs.
    torques : sequence of str
        Of the input, with their units; by default 11 from a tenth to twice that of the case.
    positions : int, optional
        In one mesh period; by default those of the case.
    """

    reliefs: Sequence[str] = ("0 um", "2 um", "4 um", "6 um", "8 um")
    length: float = 1.0
    shape: Shape = "parabolic"
    torques: Sequence[str] = ()
    positions: int | None = None


@one_blas_thread()
def harris_into(
    case: Case, folder: Path, request: HarrisRequest, *, cache: Path | None = None, progress: Progress = silent
) -> tuple[list[Block], list[str]]:
    """Compute a Harris map, or what is left of it; write table, figure and journal, and give tables and names.

    ``cache`` is the folder of generated grids. CaseError: everything that is wrong with the request.
    StorageError: files of others (E-OUTPUT, E-JOURNAL).
    """
    case, amounts, inputs, on_sun = _checked(case, request)
    own_files(folder, (_TABLE, _FIGURE))
    with resumable(folder), open_journal(folder / _JOURNAL, case, {}, is_cycle) as journal:
        progress("compliance", 0, 1)
        basis = design_basis(case, cache=cache)
        progress("compliance", 1, 1)
        power = POWERS[request.shape]
        relief: dict[str, Any] = {"length": request.length, "power": power, "back": loads_back(on_sun)}
        harris = harris_map(
            basis,
            torques=on_sun,
            deviations=[with_tip_relief(basis.deviations, basis.gears, amount=a, **relief) for a in amounts],
            progress=progress,
            journal=journal,
            names=[relief_name(amount, request.length, power) for amount in amounts],
        )
        kinds = tuple(dict.fromkeys(map(family, basis.gears.mesh_names)))
        columns = [f"{kind} STE peak to peak [m]" for kind in (*kinds, "sun-ring")[: 2 * len(kinds) - 1]]
        write_csv(folder / _TABLE, ("relief [m]", "torque [N m]", *columns), _records(amounts, inputs, harris))
        names = [f"relief {1e6 * amount:g} µm" for amount in amounts]
        curves = harris_curves(inputs, harris.peak_to_peak, names, design=case.operation.torque, kinds=kinds)
        save_figure(curves, folder / _FIGURE)
    return [_described(amounts, inputs, harris, kinds[0])], [_TABLE, _FIGURE, _JOURNAL]


def checked_amount(text: str, option: str, module: float, *, least: float = 0.0) -> float:
    """Read the amount of a relief [m] of an option; refused (CaseError) outside ``least`` to 0.2 modules."""
    amount, most = to_si(text, LENGTH), LARGEST_DEVIATION * module
    if not least <= amount <= most:
        raise CaseError(
            "not a plausible relief",
            code="E-RANGE",
            key=option,
            value=text,
            limit=f"{1e6 * least:.6g} to {1e6 * most:.6g} um ({LARGEST_DEVIATION} modules)",
            remedy="give what the teeth deflect under load, some micrometres",
        )
    return amount


def with_positions(case: Case, positions: int | None) -> Case:
    """Set the positions of a mesh period in a case (E-RANGE of ``--positions``); None leaves those it has."""
    if positions is None:
        return case
    try:
        return with_value(case, "static.positions", positions)
    except CaseError as error:
        error.key, error.file, error.remedy = "--positions", None, "64 positions are what most cases take"
        raise


def _checked(case: Case, request: HarrisRequest) -> tuple[Case, list[float], np.ndarray, np.ndarray]:
    """Case with the positions asked for, amounts [m], torques on the input (T,) and on the sun (T,) [N m]."""
    gears = planetary_set(case)
    amounts, given = list[float](), list[float]()
    with all_faults() as part:
        with part("--positions"):
            case = with_positions(case, request.positions)
        for text in request.reliefs:
            with part("--relief"):
                amounts.append(checked_amount(text, "--relief", case.module))
        with part("--relief"):
            if len(set(amounts)) < len(amounts):
                raise CaseError("a relief is given twice", code="E-DUPLICATE", remedy="give every amount once")
        with part("--length"):
            relief_starts(gears, length=request.length)
        for text in request.torques:
            with part("--torque"):
                given.append(to_si(text, TORQUE))
                sun_torque(case, gears, given[-1])
        with part("--torque"):
            loads_back(np.array(given))
            if not request.torques:
                sun_torque(case, gears)
    # a torque given twice is one point of the curves
    shares = np.append(0.1, np.linspace(0.2, 2.0, 10))
    inputs = np.array([*dict.fromkeys(given)] or case.operation.torque * shares)
    return case, amounts, inputs, np.array([sun_torque(case, gears, float(value)) for value in inputs])


def _records(amounts: Sequence[float], inputs: np.ndarray, harris: HarrisMap) -> Iterator[tuple[float, ...]]:
    """Rows of the table in SI units; of a pair alone without the error over both kinds of mesh."""
    several = harris.peak_to_peak.shape[1] > 1
    for v, amount in enumerate(amounts):
        for t, torque in enumerate(inputs):
            overall = [float(harris.overall[v, t])] if several else []
            yield float(amount), float(torque), *map(float, harris.peak_to_peak[v, :, t]), *overall


def _described(amounts: Sequence[float], inputs: np.ndarray, harris: HarrisMap, kind: str) -> Block:
    """Tabulate where every relief has its least transmission error; of one torque, that under it."""
    title = f"Transmission error of the {kind} meshes, peak to peak"
    curves = harris.peak_to_peak[:, 0] * 1e6
    names, first = [f"{1e6 * amount:g}" for amount in amounts], f"at {inputs[0]:g} N m"
    note = (f"largest residual of all contact problems: {harris.residual:.1e}",)
    if len(inputs) == 1:  # no torque is the best of one
        rows = tuple((name, f"{curve[0]:.3f}") for name, curve in zip(names, curves, strict=True))
        return Block(title, ("relief [um]", f"STE p-p {first} [um]"), rows, note)
    rows = tuple(
        (name, f"{inputs[curve.argmin()]:g}", *(f"{value:.3f}" for value in (curve.min(), curve[0], curve[-1])))
        for name, curve in zip(names, curves, strict=True)
    )
    header = ("relief [um]", "least at [N m]", "STE p-p there [um]", first, f"at {inputs[-1]:g} N m")
    return Block(title, header, rows, note)
