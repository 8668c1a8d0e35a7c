"""A sweep from the words of a command line to its files."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from femgear.case import Case
from femgear.errors import CaseError
from femgear.files import storage_errors, write_text
from femgear.optimisation.designs import Progress
from femgear.optimisation.names import named_quantity
from femgear.optimisation.sweep import Sweep, check_sweep, parse_over, sweep
from femgear.optimisation.variables import split

JOURNAL, TABLE, FIGURE = "sweep.jsonl", "sweep.csv", "sweep.png"


def sweep_into(
    case: Case,
    folder: Path,
    *,
    over: Sequence[str],
    of: Sequence[str] = ("ste",),
    speeds: tuple[str, str] | None = None,
    cache: Path | None = None,
    progress: Progress | None = None,
) -> tuple[Sweep, list[str]]:
    """Compute a sweep, or what is left of it, and write its table and figure.

    Parameters
    ----------
    case : Case
    folder : path
        Created where it does not exist.
    over : sequence of str
        As `sweep.parse_over` takes them.
    of : sequence of str
        Quantities, see `names.NAMES`.
    speeds : (str, str), optional
        First and last speed of the input, for mesh forces and housing levels.
    cache, progress
        As for `search.minimise`.

    Returns
    -------
    Sweep
    list of str
        Names of the files.

    Raises
    ------
    CaseError
        E-SWEEP, E-OBJECTIVE: what cannot be computed; nothing is written then.
    StorageError
    """
    values = dict(parse_over(text) for text in over)
    if len(values) < len(over):
        raise CaseError("a key is given twice", code="E-SWEEP", key="--over", value=", ".join(over))
    quantities = [named_quantity(words, speeds=speeds) for words in of]
    check_sweep(case, values, quantities)
    with storage_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
    options = {"journal": folder / JOURNAL, "cache": cache, "progress": progress}
    found = sweep(case, values, quantities, **options)
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(found.header)
    for row in found.records():
        writer.writerow(f"{value:.9g}" if isinstance(value, float) else value for value in row)
    write_text(stream.getvalue(), folder / TABLE)
    names = [TABLE, JOURNAL]
    if np.isfinite(found.values).any():
        _draw(found, [len(one) for one in values.values()], folder / FIGURE)
        names.append(FIGURE)
    return found, names


def _draw(found: Sweep, counts: Sequence[int], path: Path) -> None:
    """Curves over the last key, one for every combination of the others, at most twelve of them."""
    from femgear.plots.optimisation import sweep_curves
    from femgear.plots.style import save_figure

    last = counts[-1]
    scale = np.array([quantity.dimension.scale for quantity in found.quantities])
    curves = (found.values / scale).reshape(-1, last, len(scale))
    others = [point[:-1] for point in found.points[::last]]
    names = [
        ", ".join(f"{key} = {value}" for key, value in zip(found.keys, point, strict=False))
        for point in others
    ]
    x, unit = _axis([point[-1] for point in found.points[:last]])
    titles = [f"{q.name} [{q.dimension.shown}]".replace("[um]", "[µm]") for q in found.quantities]
    axis = f"{found.keys[-1]} [{unit}]" if unit else found.keys[-1]
    save_figure(sweep_curves(x, curves[:12], names=names[:12], axis=axis, quantities=titles), path)


def _axis(values: Sequence[object]) -> tuple[Sequence[object], str]:
    """Numbers and their unit where all values are numbers in one unit, else their texts."""
    try:
        parts = [split(value, "value") for value in values]
    except CaseError:
        return [str(value) for value in values], ""
    units = {unit for _, unit in parts}
    if len(units) > 1:
        return [str(value) for value in values], ""
    return [number for number, _ in parts], units.pop()
