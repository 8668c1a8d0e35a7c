"""Tooth numbers for a ratio: the smallest that assemble, transmission errors of the best, and the front of both."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from femgear.case import text as case_text
from femgear.case.quantities import LENGTH, STRESS, TORQUE, to_si
from femgear.errors import CaseError, FemgearError
from femgear.gears.tooth_search import KINDS, SizedTeeth, ToothDemand, search_teeth
from femgear.report.style import save_figure
from femgear.report.tables import Block
from femgear.stages.protocol import Progress, one_blas_thread, silent
from femgear.stages.static import solve_static
from femgear.storage.files import own_files, write_csv, write_text
from femgear.study.faults import all_faults
from femgear.study.figures import size_and_error
from femgear.study.teeth_request import TeethStrength, WantedTeeth
from femgear.trains.drafts import new_case
from femgear.trains.reading import parse_case

_TABLE, _FIGURE = "teeth.csv", "teeth.png"
_DRAFTED = {"stepped": ("ring",), "double": ("ring",), "ravigneaux": ("sun", "carrier")}
"""Kinds whose cases are gearboxes, with the members that stand in these."""
_MESHES = {"pair": 1, "double": 3, "ravigneaux": 4}
"""Meshes of a branch, where these are not two."""
_SHOWN = 12
"""Rows of the smallest teeth that are printed."""


@dataclass(frozen=True)
class ComputedTeeth:
    """Teeth with the transmission error of their case.

    Parameters
    ----------
    choice : SizedTeeth
        Teeth and size.
    case : str
        Text of their case file.
    errors : tuple of float
        Peak to peak of the static transmission error, on the base circle of sun or gear 1 [m]; of a gearbox that of
        every mesh alone, on the base circle of its first gear.
    """

    choice: SizedTeeth
    case: str
    errors: tuple[float, ...]

    @property
    def error(self) -> float:
        """Largest of the errors [m]."""
        return max(self.errors)


@one_blas_thread()
def teeth_into(
    folder: Path,
    ratio: float,
    wanted: WantedTeeth,
    strength: TeethStrength,
    *,
    cache: Path | None = None,
    progress: Progress = silent,
) -> tuple[list[Block], list[str]]:
    """Search teeth; write the table of all, the cases of the best and a figure, and give tables and names of files.

    CaseError, GeometryError: a demand that no teeth meet. StorageError: files of others (E-OUTPUT).

    Parameters
    ----------
    folder : path
        Of the files.
    ratio : float
        As of `femgear.gears.tooth_search.ToothDemand`.
    wanted : WantedTeeth
        Gears, and how finely the best of them are computed.
    strength : TeethStrength
        What decides their size, with units.
    cache : path, optional
        Folder of generated grids.
    progress : callable
        Called with (stage, done, total).
    """
    demand = tooth_demand(ratio, wanted, strength)
    own_files(folder, (_TABLE, _FIGURE, f"{demand.kind}_*.toml"))
    sized, beyond = search_teeth(demand, progress=lambda done, total: progress("teeth", done, total))
    write_csv(folder / _TABLE, _header(demand), map(_record, sized))
    names, blocks = [_TABLE], [_described(demand, sized, beyond)]
    if demand.stands not in _DRAFTED.get(demand.kind, (demand.stands,)):
        return blocks, names
    computed, refused = _computed(demand, best_of_every_phasing(sized, wanted.best), wanted, cache, progress)
    for teeth in computed:
        names.append(f"{_label(teeth.choice, '_')}.toml")
        write_text(teeth.case, folder / names[-1])
    if computed:
        front = front_of(computed)
        figure = size_and_error(
            [1e6 * teeth.choice.volume for teeth in computed],
            [1e6 * teeth.error for teeth in computed],
            [_label(teeth.choice, "/").partition("_")[2] for teeth in computed],
            left=[teeth.choice.left[0] if teeth.choice.left else "" for teeth in computed],
            front=front,
        )
        save_figure(figure, folder / _FIGURE)
        blocks.append(_described_errors(demand, computed, front, refused))
        names.append(_FIGURE)
    return blocks, names


def best_of_every_phasing(sized: Sequence[SizedTeeth], count: int) -> list[SizedTeeth]:
    """Choose so many teeth: the smallest of every phasing, hunting or not, then the smallest of the others.

    Else all would be neighbours of the smallest.
    """
    first: dict[object, SizedTeeth] = {}
    for teeth in sized:
        first.setdefault((teeth.planets, teeth.left, teeth.hunting), teeth)
    order = [*first.values(), *(teeth for teeth in sized if teeth not in first.values())]
    return sorted(order[:count], key=lambda teeth: teeth.volume)


def front_of(computed: Sequence[ComputedTeeth]) -> list[int]:
    """Find the places of teeth than which none is smaller and has less error, by size."""
    order = sorted(range(len(computed)), key=lambda n: (computed[n].choice.volume, computed[n].error))
    front, least = [], math.inf
    for place in order:
        if computed[place].error < least:
            front.append(place)
            least = computed[place].error
    return front


def tooth_demand(ratio: float, wanted: WantedTeeth, strength: TeethStrength) -> ToothDemand:
    """Read the quantities of what is wanted."""
    planets, values = list[int](), dict[str, Any](vars(strength))
    with all_faults() as part:
        for text in wanted.planets:
            with part("--planets"):
                planets += _counts(text)
        for name, dimension in (("torque", TORQUE), ("contact_limit", STRESS), ("root_limit", STRESS)):
            with part(f"--{name.replace('_', '-')}"):
                values[name] = to_si(values[name], dimension)
        for key, value, low, high in (
            ("--best", wanted.best, 1, 200),
            ("--positions", wanted.positions, 8, 512),
            ("--flank-elements", wanted.flank_elements, 4, 64),
        ):
            with part(key):
                if not low <= value <= high:
                    raise CaseError("out of range", code="E-RANGE", key=key, value=value, limit=f"{low} to {high}")
    searched = {"kind": wanted.kind, "tolerance": wanted.tolerance, "fixed": wanted.fixed, "most": wanted.most}
    return ToothDemand(ratio=ratio, planets=tuple(sorted(set(planets))), **searched, **values)


def _counts(text: str) -> range:
    """Numbers of planets of "3" or "3..5"."""
    first, dots, last = text.partition("..")
    if not first.isdecimal() or not (last if dots else "1").isdecimal() or max(len(first), len(last)) > 3:
        remedy = "write --planets 4, or --planets 3..5 for all from 3 to 5"
        raise CaseError("no numbers of planets", code="E-TYPE", key="--planets", value=text, remedy=remedy)
    counts = range(int(first), int(last if dots else first) + 1)
    if not counts:
        remedy = f"write --planets {last}..{first}"
        raise CaseError("numbers that fall", code="E-RANGE", key="--planets", value=text, limit="3..5", remedy=remedy)
    return counts


def _computed(
    demand: ToothDemand, teeth: Sequence[SizedTeeth], wanted: WantedTeeth, cache: Path | None, progress: Progress
) -> tuple[list[ComputedTeeth], list[str]]:
    """Static transmission errors on a coarse grid, and why teeth have none that ISO 6336 rates."""
    computed, refused = list[ComputedTeeth](), list[str]()
    for number, choice in enumerate(teeth):
        progress("transmission error", number, len(teeth))
        try:
            text = case_of(demand, choice)
            errors = tuple(_error(tables, wanted, cache) for tables in _meshing(choice, text))
        except FemgearError as error:
            refused.append(f"{_label(choice, '/').partition('_')[2]} has none: {error.message} ({error.code})")
            continue
        computed.append(ComputedTeeth(choice, text, errors))
    progress("transmission error", len(teeth), len(teeth))
    return computed, refused


def _meshing(choice: SizedTeeth, text: str) -> Iterator[dict[str, Any]]:
    """Tables of the cases whose transmission errors count: of a gearbox every pair of a branch, with its torque."""
    tables = case_text.parse(text, "")
    if choice.kind not in _DRAFTED:
        yield tables
        return
    for pair, torque in zip(tables["pair"], choice.torques, strict=False):
        if torque:
            yield pair["teeth"] | {"operation": {"torque": f"{torque!r} N m"}}


def _error(tables: dict[str, Any], wanted: WantedTeeth, cache: Path | None) -> float:
    """Static transmission error of a case on a coarse grid, peak to peak on the base circle of its first gear [m]."""
    grid = {"positions": wanted.positions, "flank_elements": wanted.flank_elements, "stresses": False}
    case = parse_case(case_text.write(tables | {"static": tables.get("static", {}) | grid}))
    return float(solve_static(case, cache=cache).cycle.peak_to_peak("sun_arc"))


def case_of(demand: ToothDemand, choice: SizedTeeth) -> str:
    """Write the case file of teeth of their size, with the torque that was asked for on sun or gear 1."""
    of_set = choice.kind != "pair"
    text = new_case(
        choice.kind,
        teeth=choice.teeth,
        module=f"{math.ceil(1e6 * choice.modules[0]) / 1e3:.10g} mm",
        torque=f"{demand.torque:.10g} N m",
        planets=choice.planets if of_set else None,
        face_width=LENGTH.show(math.ceil(1e4 * max(choice.widths)) / 1e4),
    )
    if choice.kind in _DRAFTED:
        return text.replace('fixed = ["large sun"]', 'fixed = ["carrier"]') if demand.stands == "carrier" else text
    if not of_set or demand.stands == "ring":
        return text
    text = text.replace('fixed = "ring"', f'fixed = "{demand.stands}"')
    if demand.stands == "sun":
        on_ring = demand.torque * choice.teeth[-1] / choice.teeth[0]
        text = text.replace('input = "sun"', 'input = "ring"')
        text = text.replace(f'torque = "{demand.torque:.10g} N m"', f'torque = "{on_ring:.10g} N m"')
    return text


def _label(choice: SizedTeeth, between: str) -> str:
    """Kind, teeth and number of planets: "planetary_27/40/108 x3", or joined for names of files."""
    teeth = between.join(map(str, choice.teeth))
    if choice.kind == "pair":
        return f"pair_{teeth}"
    return f"{choice.kind}_{teeth}{f' ×{choice.planets}' if between == '/' else f'_{choice.planets}'}"


def _header(demand: ToothDemand) -> tuple[str, ...]:
    meshes = ("module [m]", "second module [m]", "face width [m]", "second face width [m]")
    return (
        *(f"{name} teeth" for name in KINDS[demand.kind]),
        "planets",
        "ratio [1]",
        *(meshes if demand.kind == "stepped" else meshes[::2]),
        "diameter [m]",
        "volume [m^3]",
        "size decided by",
        *(f"contact ratio {number}" for number in range(1, _MESHES.get(demand.kind, 2) + 1)),
        "left of the first harmonic",
        "hunting teeth",
        "warned of",
    )


def _record(choice: SizedTeeth) -> tuple[object, ...]:
    return (
        *choice.teeth,
        choice.planets,
        choice.ratio,
        *choice.modules,
        *choice.widths,
        choice.diameter,
        choice.volume,
        choice.decides,
        *choice.contact_ratio,
        " and ".join(dict.fromkeys(choice.left)) or "-",
        "yes" if choice.hunting else "no",
        " ".join(choice.lacks),
    )


def _cells(choice: SizedTeeth) -> tuple[str, ...]:
    return (
        "/".join(map(str, choice.teeth)),
        str(choice.planets) if choice.kind != "pair" else "-",
        f"{choice.ratio:.4f}",
        " ".join(f"{1e3 * module:.3f}" for module in choice.modules),
        " ".join(f"{1e3 * width:.1f}" for width in choice.widths),
        f"{1e3 * choice.diameter:.1f}",
        f"{1e6 * choice.volume:.1f}",
        " and ".join(dict.fromkeys(choice.left)) or "-",
        "yes" if choice.hunting else "no",
    )


_COLUMNS = (
    "teeth",
    "planets",
    "ratio",
    "module [mm]",
    "width [mm]",
    "diameter [mm]",
    "volume [cm^3]",
    "first harmonic leaves",
    "hunting",
)
_BESIDE_ERRORS = ("teeth", "planets", "ratio", "volume [cm^3]", "first harmonic leaves", "hunting")


def _described(demand: ToothDemand, sized: Sequence[SizedTeeth], beyond: int) -> Block:
    """The smallest teeth, and how many further from the ratio were not sized."""
    rows = tuple((*_cells(choice), choice.decides) for choice in sized[:_SHOWN])
    notes = [
        f"{len(sized)} sets of teeth close and assemble; sizes for {demand.torque:g} N m on "
        f"{'gear 1' if demand.kind == 'pair' else 'the sun'}, S_H {demand.contact_safety:g} and S_F "
        f"{demand.root_safety:g} with K = {demand.load_factor:g} (ISO 6336, long life)"
    ]
    if beyond:
        notes.append(
            f"{beyond} more that assemble are further from the ratio and were not sized: raise --most for them"
        )
    if demand.kind in _DRAFTED:
        notes.append("gears without shift; cases have the larger face width for all gears")
        if demand.stands not in _DRAFTED[demand.kind]:
            notes.append(f"no cases and no transmission errors: drafts have a standing {_DRAFTED[demand.kind][0]}")
    return Block(f"Smallest {demand.kind} teeth", (*_COLUMNS, "decided by"), rows, tuple(notes))


def _described_errors(
    demand: ToothDemand, computed: Sequence[ComputedTeeth], front: Sequence[int], refused: Sequence[str]
) -> Block:
    """Transmission errors of the teeth that were computed, and which could not be."""
    rows = tuple(
        (
            *(cell for cell, column in zip(_cells(teeth.choice), _COLUMNS, strict=True) if column in _BESIDE_ERRORS),
            " ".join(f"{1e6 * error:.3f}" for error in teeth.errors),
            "*" if place in front else "",
        )
        for place, teeth in enumerate(computed)
    )
    where = {"pair": "gear 1", "planetary": "the sun"}.get(demand.kind, "the first gear, mesh by mesh")
    note = f"STE: static transmission error peak to peak of unmodified teeth, as an arc on the base circle of {where}"
    notes = (note, "front: none is smaller with less", *refused)
    return Block("Transmission error", (*_BESIDE_ERRORS, "STE p-p [µm]", "front"), rows, notes)
