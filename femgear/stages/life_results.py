"""Tables, rows of a verdict and findings on the lives of teeth over load cases, the same of all trains."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from femgear.findings import Finding, percent
from femgear.report.tables import Block, Marks, merged_names, tabulate
from femgear.stages.key_figures import HOURS, NUMBER, KeyFigure, Stored
from femgear.stages.strength import OF_ROOTS, OF_TEETH

SYMBOLS = {"root": "S_F", "flank": "S_H"}
"""Safeties by what they are of."""
_DOUBTS = {"root": OF_ROOTS, "flank": OF_TEETH}
_OF_LIFE = {kind: ("W-LIFE", "W-STRENGTH", *doubts) for kind, doubts in _DOUBTS.items()}
LIFE_FIGURES = tuple(
    KeyFigure(f"{kind} life", HOURS, "life", Stored(f"{kind}_life", pick="smallest"), _OF_LIFE[kind], whole=True)
    for kind in SYMBOLS
)
SPECTRUM_FIGURES = tuple(
    KeyFigure(
        f"{symbol} over life",
        NUMBER,
        "life",
        Stored(f"{kind}_spectrum_safety", pick="smallest"),
        _OF_LIFE[kind],
        whole=True,
    )
    for kind, symbol in SYMBOLS.items()
)
"""Of cases that ask for a life."""
PLANET_BEARING_FIGURE = KeyFigure(
    "planet bearing life", HOURS, "life", Stored("planet_bearing_life", pick="smallest"), ("W-LIFE",), whole=True
)
_NO_DAMAGE = "all stresses lie below those of 1e10 load cycles"
_MOST = 40  # rows of load cases in a table


def life_findings(data: Any) -> Iterator[Finding]:
    """List teeth that fail at once (W-STRENGTH) or too soon (W-LIFE), and roots bent both ways (W-REVERSAL)."""
    yield from _bent_both_ways(data)
    for kind in SYMBOLS:
        if f"{kind}_damage" not in data:
            continue
        damage, names = data[f"{kind}_damage"].values, data[kind].values
        lives = data[f"{kind}_life"].values
        if broken := [number for number in range(len(names)) if lives[number] == 0.0]:
            others = f"; so do: {', '.join(str(names[number]) for number in broken[1:5])}" if len(broken) > 1 else ""
            text = f"the {kind} of {names[broken[0]]} {_most_damage(data, kind, broken[0])}{others}"
            remedy = "less torque in that load case, a wider face, a larger module, or another treatment"
            yield Finding("W-STRENGTH", "operation.load_case", text, remedy=remedy)
        # beyond the static strength no life is what fails
        damage = np.where(lives == 0.0, np.nan, damage)
        failing = [str(names[number]) for number in np.argsort(-damage) if damage[number] > 1.0]
        if failing:
            most, load_case = float(np.nanmax(damage)), _most_damage(data, kind, int(np.nanargmax(damage)))
            text = f"the damage of the {kind} of {failing[0]} is {_number(most)} over the life asked for, {load_case}"
            others = f"; beyond 1 too: {', '.join(failing[1:5])}" if len(failing) > 1 else ""
            remedy = "less torque or time in that load case, a wider face, a larger module, or another treatment"
            yield Finding("W-LIFE", "operation.load_case", text + others, remedy=remedy, limit="at most 1")


def _bent_both_ways(data: Any) -> Iterator[Finding]:
    """Tell the roots that load cases of both directions bend both ways, and the load cases that do (W-REVERSAL)."""
    if "root_reversed" not in data or not data["root_reversed"].values.any():
        return
    back, factor = data["root_reversed"].values.astype(bool), data["root_reversal_factor"].values
    roots = merged_names(str(name) for name in data["root"].values[factor != 1.0])
    cases = data["load_case"].values[back.any(axis=1)].tolist()
    shown = ", ".join(map(str, cases[:3])) + (f" and {len(cases) - 3} more" if len(cases) > 3 else "")
    text = f"roots of {roots} are bent back in {shown}: they have Y_M {factor.min():g} in all load cases"
    remedy = "give the factor of your load spectrum, or leave load cases out that reverse no load"
    yield Finding("W-REVERSAL", "strength.reversal_factor", text, remedy=remedy)


def life_rows(data: Any, marks: Marks, of: tuple[str, ...] = ("life",)) -> Iterator[tuple[str, str]]:
    """Write rows of a verdict: what fails first and when, and the smallest safeties over the life asked for.

    Parameters
    ----------
    data : dataset
        With the variables of `tooth_life_variables`.
    marks : Marks
        Of the findings of the run.
    of : tuple of str
        Stage whose findings count.
    """
    kinds = [kind for kind in SYMBOLS if f"{kind}_life" in data]
    if not kinds:
        return
    shortest = min(kinds, key=lambda kind: float(data[f"{kind}_life"].values.min()))
    lives = data[f"{shortest}_life"].values
    at = first_to_fail(data, shortest)
    if math.isinf(lives[at]):
        yield "shortest life of the teeth, ISO 6336-6", f"{marks('none fails', *OF_ROOTS)}: {_NO_DAMAGE}"
    else:
        hours = f"{hours_text(lives[at])} h"
        if lives[at] == 0.0:
            hours = marks(hours, "W-STRENGTH", of=of)
        elif data[f"{shortest}_damage"].values[at] > 1.0:
            hours = marks(hours, "W-LIFE", of=of)
        hours = marks(hours, *_DOUBTS[shortest])
        what = f"{shortest} of {data[shortest].values[at]}"
        yield "shortest life of the teeth, ISO 6336-6", f"{hours}, {what}: {_most_damage(data, shortest, at)}"
    for kind in kinds:
        safety = data[f"{kind}_spectrum_safety"].values
        if np.isnan(safety).all():
            continue
        at = int(np.nanargmin(safety))
        life, damage = float(data[f"{kind}_life"].values[at]), float(data[f"{kind}_damage"].values[at])
        text = f"{safety[at]:.2f}"
        text = marks(text, "W-STRENGTH" if life == 0.0 else "W-LIFE", of=of) if damage > 1.0 else text
        text = marks(text, *_DOUBTS[kind])
        cause = _most_damage(data, kind, at)
        if life > 0.0:
            cause = f"damage {_number(damage)}{f', {cause}' if math.isfinite(life) else ''}"
        yield f"smallest {SYMBOLS[kind]} over the life asked for", f"{text}, {kind} of {data[kind].values[at]}: {cause}"


def _share_text(share: float, life: float) -> str:
    """Write the share of a load case in a damage; of what fails at once, whether it does in this load case."""
    if life > 0.0:
        return percent(share, 2)
    return "fails at once" if share > 0.0 else "-"


def first_to_fail(data: Any, kind: str) -> int:
    """Find the number of the root or flank with the shortest life; of equal ones that with the largest stress.

    ``data`` has the variables of `tooth_life_variables`, ``kind`` is "root" or "flank".
    """
    lives = data[f"{kind}_life"].values
    return int(np.lexsort((-data[f"{kind}_stress_ratio"].values.max(axis=0), lives))[0])


def _most_damage(data: Any, kind: str, number: int) -> str:
    """Say which load case makes most of the damage of a root or flank, or in which ones it fails at once."""
    share = data[f"{kind}_damage_share"].values[:, number]
    at = int(share.argmax())
    if data[f"{kind}_life"].values[number] == 0.0:
        beyond = [str(name) for name, part in zip(data["load_case"].values, share, strict=True) if part > 0.0]
        more = f" and {len(beyond) - 3} more" if len(beyond) > 3 else ""
        return f"fails at once in {', '.join(beyond[:3])}{more}: beyond the static strength"
    return f"{percent(share[at])} of the damage in {data['load_case'].values[at]}"


def hours_text(hours: float) -> str:
    """Write a life [h]."""
    return "no damage" if math.isinf(hours) else "0" if hours == 0.0 else f"{hours:.4g}"


def _number(value: float) -> str:
    return "-" if math.isnan(value) else "beyond the static strength" if math.isinf(value) else f"{value:.3g}"


def describe_life(data: Any, name: str = "") -> Iterator[Block]:
    """Tabulate the lives of all roots and flanks, and the shares of load cases in the damage."""
    rows = [(kind, number) for kind in SYMBOLS if f"{kind}_life" in data for number in range(len(data[kind].values))]
    if not rows:
        return

    def value(end: str, form):
        return lambda row: form(float(data[f"{row[0]}_{end}"].values[row[1]]))

    columns = {
        "": lambda row: f"{row[0]} of {data[row[0]].values[row[1]]}",
        "life [h]": value("life", hours_text),
        "damage": value("damage", _number),
        "safety": value("spectrum_safety", lambda number: "-" if math.isnan(number) else f"{number:.3f}"),
        "T_eq [N m]": value("equivalent_torque", lambda number: f"{number:.5g}"),
        "cycles/h": lambda row: f"{data[f'{row[0]}_load_cycles'].values[:, row[1]].sum():.4g}",
        "most damage": lambda row: (
            _most_damage(data, *row) if data[f"{row[0]}_damage_share"].values[:, row[1]].any() else "-"
        ),
    }
    if "root_reversed" in data and data["root_reversed"].values.any():
        factor = data["root_reversal_factor"].values
        columns["Y_M, reversed"] = lambda row: f"{factor[row[1]]:g}" if row[0] == "root" else "-"
    notes = [
        "damage and safety are those over the life asked for (operation.required_hours, or all hours)",
        "T_eq: equivalent torque on the sun or gear 1; K_v of part 1 at the speed of each load case, or 1",
    ]
    yield tabulate(f"Life of the teeth{name}", rows, columns, notes)


def describe_damage(data: Any) -> Iterator[Block]:
    """Tabulate load cases with their largest stresses and their shares in the damage of what fails first."""
    kinds = [kind for kind in SYMBOLS if f"{kind}_life" in data]
    count = data.sizes["load_case"]
    if not kinds or count < 2:
        return
    first = {kind: first_to_fail(data, kind) for kind in kinds}
    columns = {
        "load case": lambda i: str(data["load_case"].values[i]),
        "share": lambda i: f"{float(data['share'].values[i]):.4g}",
    }
    for kind, at in first.items():
        columns[f"largest stress over long life, {kind}s"] = lambda i, kind=kind: (
            f"{data[f'{kind}_stress_ratio'].values[i].max():.3f}"
        )
        columns[f"damage of the {kind} of {data[kind].values[at]}"] = lambda i, kind=kind, at=at: _share_text(
            float(data[f"{kind}_damage_share"].values[i, at]), float(data[f"{kind}_life"].values[at])
        )
    left = (f"the first {_MOST} of {count}",) if count > _MOST else ()
    yield tabulate("Damage by load case", range(min(count, _MOST)), columns, left)
