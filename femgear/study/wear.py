"""Wear of the flanks of a case over hours of running, in steps: loads follow the flanks that are left.

Every step solves the contact with the wear of the steps before. Half of the steps show how far that has converged. The
case that is written is the text of the user's file with the worn flanks as entries.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from femgear.case import text as case_text
from femgear.case.dependencies import Steps
from femgear.case.fault_sections import MOST_DEPTH
from femgear.case.quantities import SPEED, to_si
from femgear.errors import CaseError
from femgear.findings import percent
from femgear.report.tables import Block, tabulate
from femgear.stages.protocol import Progress, one_blas_thread, silent
from femgear.stages.wear import MeshingTeeth, WornFlank, wear_entries, with_more_wear, worn_flanks
from femgear.study.faults import all_faults
from femgear.trains.reading import parse_case, to_toml, with_values
from femgear.trains.registry import check_case, train_of

MOST_STEPS = 1000
_HOURS, _COEFFICIENT = (1e-6, 1e9), (1e-24, 1e-9)
"""Ranges of hours [h] and of the wear coefficient [m^2/N]."""
_COARSE = 0.05
"""Change by half the steps over the deepest wear above which more steps are advised."""
_Flanks = dict[tuple[str, int, str], WornFlank]


@dataclass(frozen=True)
class WearRequest:
    """What running wears the flanks.

    Parameters
    ----------
    hours : float
        [h]
    coefficient : float
        Of Archard's law [m^2/N].
    steps : int
        In which the hours are taken.
    speed : str, optional
        Of the input, with its unit; by default the first of the case.
    """

    hours: float
    coefficient: float
    steps: int = 4
    speed: str | None = None


@dataclass(frozen=True, eq=False)
class WornCase:
    """A case whose flanks are worn, and how far the steps have converged.

    Parameters
    ----------
    case : Case
        With the entries of the wear.
    flanks : tuple of WornFlank
        What they have lost.
    half : tuple of WornFlank
        The same in half as many steps; empty of one step.
    """

    case: Any
    flanks: tuple[WornFlank, ...]
    half: tuple[WornFlank, ...]

    def change(self, flank: WornFlank) -> float:
        """Largest change of the depth of a flank by half the steps, over the deepest wear; NaN of one step."""
        coarse = next((other for other in self.half if other.place == flank.place), None)
        if coarse is None:
            return float("nan")
        return float(np.abs(flank.depth - coarse.depth).max() / max(flank.depth.max(), 1e-30))


@one_blas_thread()
def wear_of_case(
    case: Any, request: WearRequest, *, cache: Path | None = None, progress: Progress = silent
) -> WornCase:
    """Compute what the flanks of a case lose, and the case with these flanks.

    ``cache`` is the folder of generated grids. CaseError: everything that is wrong with the request; a kind of case
    without contact of its teeth (E-MODEL) or without load (E-NO-LOAD), and what its stages cannot represent.
    """
    speed = _checked(case, request)
    check_case(case)
    meshing_teeth = train_of(case).meshing_teeth
    assert meshing_teeth is not None  # others are refused
    halves = request.steps // 2
    steps, done, total = Steps(), 0, request.steps + max(halves - 1, 0)

    def contact(worn: Any) -> Sequence[MeshingTeeth]:
        nonlocal done
        progress("wear", done, total)
        teeth = meshing_teeth(worn, speed, cache=cache, steps=steps)
        done += 1
        progress("wear", done, total)
        return teeth

    first = contact(case)
    flanks, half = (_worn(case, request, count, first, contact) for count in (request.steps, halves))
    worn = with_wear(case, flanks.values())
    check_case(worn)
    return WornCase(worn, tuple(flanks.values()), tuple(half.values()))


def _worn(case: Any, request: WearRequest, count: int, first: Sequence[MeshingTeeth], contact: Any) -> _Flanks:
    """Take the hours in so many steps, from the contact of the case as it is; none without steps."""
    flanks: _Flanks = {}
    for step in range(count):
        loaded = first if step == 0 else contact(with_wear(case, flanks.values()))
        for teeth in loaded:
            for flank in worn_flanks(teeth, hours=request.hours / count, coefficient=request.coefficient):
                before = flanks.get(flank.place)
                flanks[flank.place] = flank if before is None else with_more_wear(before, flank.depth)
        _refuse_worn_through(case, flanks)
    return flanks


def _refuse_worn_through(case: Any, flanks: _Flanks) -> None:
    """Refuse (CaseError, E-RANGE) hours after which a flank has lost more than a tooth has."""
    deepest = max(float(flank.depth.max()) for flank in flanks.values())
    if deepest > MOST_DEPTH:
        raise CaseError(
            "so many hours wear the teeth away",
            code="E-RANGE",
            key="--hours",
            value=f"{1e3 * deepest:.3g} mm off a flank",
            limit=f"{1e3 * MOST_DEPTH:g} mm",
            remedy="fewer hours, or a smaller --coefficient",
        )


def _checked(case: Any, request: WearRequest) -> float | None:
    """Refuse what cannot be computed, all at once; give the speed of the input [rad/s], if one is given."""
    speed = None
    with all_faults() as part:
        with part():
            if train_of(case).meshing_teeth is None:
                message = f"{train_of(case).words} has no contact of its teeth under load, so nothing wears"
                limit = "planetary sets, pairs and gearboxes whose teeth are given"
                remedy = "femgear new planetary, pair or gearbox writes a case with teeth"
                raise CaseError(message, code="E-MODEL", key="model", limit=limit, remedy=remedy)
        for option, value, (low, high), unit in (
            ("--hours", request.hours, _HOURS, "h"),
            ("--coefficient", request.coefficient, _COEFFICIENT, "m^2/N"),
            ("--steps", request.steps, (1, MOST_STEPS), ""),
        ):
            with part(option):
                if not low <= value <= high:
                    limit = f"{low:g} to {high:g} {unit}".rstrip()
                    remedy = "1e-18 to 1e-16 m^2/N of lubricated steel" if option == "--coefficient" else None
                    raise CaseError("out of range", code="E-RANGE", value=value, limit=limit, remedy=remedy)
        if request.speed is not None:
            with part("--speed"):
                speed = to_si(request.speed, SPEED)
                if not speed:
                    message, remedy = "gears that stand still do not wear", 'a speed, as in --speed "3000 rpm"'
                    raise CaseError(message, code="E-RANGE", value=request.speed, limit="not 0", remedy=remedy)
    return speed


def with_wear(case: Any, flanks: Any) -> Any:
    """Add worn flanks to the faults of a case."""
    return with_values(case, _all_faults(case, wear_entries(flanks)))


def _all_faults(case: Any, entries: Mapping[str, list[dict[str, object]]]) -> dict[str, object]:
    """Faults that the case has, and those of the entries after them, by key."""
    tables = case_text.parse(case.source, case.name)
    return {key: [*_inside(tables, key), *added] for key, added in entries.items()}


def _inside(tables: Any, key: str) -> list[Any]:
    """List of tables at a key such as "pair[0].teeth.gear_1.fault"; empty where there is none."""
    for part in key.replace("[", ".").replace("]", "").split("."):
        tables = tables[int(part)] if isinstance(tables, list) else tables.get(part, {})
    return tables or []


def worn_text(path: Path, output: Path, worn: WornCase) -> tuple[str, bool]:
    """Write the text of a worn case: that of its file with the entries put in, and whether its comments are kept.

    They are not where tables stand within braces, or in other files from which the output could not be read.
    """
    text = case_text.read_text(path)
    for key, added in wear_entries(worn.flanks).items():
        text = _with_tables(text, key, added)
    try:
        same = parse_case(text, name=str(output)).model_dump() == worn.case.model_dump()
    except CaseError:
        same = False
    return (text, True) if same else (to_toml(worn.case), False)


def _with_tables(text: str, key: str, added: Sequence[Mapping[str, object]]) -> str:
    """Put tables of a list behind all that a file has of the table above it, or of the member of a list above it."""
    lines, above = text.rstrip("\n").split("\n"), key.partition(".")[0]
    numbered = case_text.keys_with_lines(text)
    headers = [(header, line) for header, line in numbered if lines[line - 1].lstrip()[:1] == "["]
    inside = [line for header, line in headers if header == above or header.startswith((f"{above}.", f"{above}["))]
    after = [line for _, line in headers if inside and line > max(inside)]
    end = min(after, default=len(lines) + 1) - 1
    # comments right above the next table belong to that
    while end and (not lines[end - 1].strip() or (after and lines[end - 1].lstrip().startswith("#"))):
        end -= 1
    name = "".join(part.partition("[")[0] + "." for part in key.split(".")).rstrip(".")
    tables = [line for table in added for line in ("", f"[[{name}]]", *_lines_of(table))]
    rest = lines[end:]
    return "\n".join([*lines[:end], *tables, *([""] if rest and rest[0].strip() else []), *rest]) + "\n"


def _lines_of(table: Mapping[str, object]) -> Iterator[str]:
    """Lines of a table whose values are texts, numbers or lists of texts."""
    yield from case_text.write(dict(table)).strip().split("\n")


def describe_wear(worn: WornCase, request: WearRequest) -> Block:
    """Tabulate how deep flanks are worn, where, and how half of the steps change that."""
    groups = dict[tuple[str, str], list[WornFlank]]()
    for flank in worn.flanks:
        groups.setdefault((flank.key, flank.flank), []).append(flank)
    deepest = [max(flanks, key=lambda flank: flank.depth.max()) for flanks in groups.values()]
    columns = {
        "gear": lambda flank: flank.key.removesuffix(".fault") + (f" {flank.planet}" if flank.planet else ""),
        "flank": lambda flank: flank.flank,
        "deepest [um]": lambda flank: f"{1e6 * flank.depth.max():.4g}",
        "at diameter [mm]": lambda flank: f"{2e3 * flank.radius[flank.depth.argmax()]:.5g}",
        "half the steps": lambda flank: percent(worn.change(flank), 2) if worn.half else "-",
    }
    steps = f"{request.steps} step{'s' * (request.steps > 1)}"
    notes = [f"{request.hours:g} h with k = {request.coefficient:g} m^2/N in {steps}; of planets the deepest"]
    if not worn.half:
        notes.append("ONE STEP: loads do not follow the wear, and nothing shows how far that matters; use --steps 4")
    elif (change := max(map(worn.change, deepest))) > _COARSE:
        notes.append(
            f"NOT CONVERGED: half the steps change depths by {percent(change, 1)} of the deepest; use more --steps"
        )
    else:
        notes.append(f"half the steps change no depth by more than {percent(change, 2)} of the deepest of its flank")
    return tabulate("Wear of the flanks", deepest, columns, notes)
