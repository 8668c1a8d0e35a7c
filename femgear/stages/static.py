"""Stages "static" and "stress": what the teeth of a planetary set carry over one mesh period.

"static" solves the FE contact of all meshes for transmission error, load sharing and mesh stiffness; "stress"
finds root stresses, contact pressures, load spectra and nominal stresses of that solution. Both stages,
`STATIC` and `STRESS` at the end, stand in the tables of the trains that compute with FE contact.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear import second_process
from femgear.case.dependencies import (
    Entries,
    Steps,
    check_entries,
    compliance_entries,
    solution_entries,
    static_entries,
    stress_entries,
)
from femgear.case.fault_sections import keyed_faults
from femgear.case.flank_sections import OVER_WIDTH
from femgear.case.gear_set import (
    material_of,
    materials_of,
    planetary_set,
    set_deviations,
    support_stiffness,
)
from femgear.case.planetary import Case
from femgear.case.sections import WIDTH_ENTRIES
from femgear.case.teeth import case_overlap
from femgear.case.tooth_friction import acting_friction
from femgear.contact.bodies import (
    Bodies,
    Sector,
    Sectors,
    flank_widths,
    helical_stiffness,
    make_bodies,
    make_sectors,
)
from femgear.contact.cracked_flanks import cracked_flanks
from femgear.contact.cycle import CycleOptions, cycle_without_load, walk_mesh_cycle
from femgear.contact.face_width import slices_ahead
from femgear.contact.mesh_cycle import MeshCycle
from femgear.contact.root_stress import (
    RootStresses,
    computed_waves,
    observed_root_stress,
    root_ranges,
    root_stress_cycle,
    root_stress_influence,
    root_waves,
)
from femgear.contact.supports import RIGID, UPRIGHT, Supports, WidthSupports, tilting_members
from femgear.contact.tooth_loads import load_spectrum, loaded_teeth
from femgear.contact.width_waves import (
    WidthWaves,
    common_width,
    condensed_waves,
    waves_of_gears,
    with_ring_waves,
)
from femgear.errors import LESS_TORQUE, CaseError, ContactError
from femgear.fe.elasticity import foundation
from femgear.fe.grid import Grid
from femgear.gears.deviations import SetDeviations, common_period
from femgear.gears.faults import Crack, Spall
from femgear.gears.iso6336_root import root_face_width
from femgear.gears.kinematics import speeds
from femgear.gears.pair import GearSet
from femgear.gears.planetary import PlanetarySet
from femgear.gears.profile import base_helix_angle
from femgear.stages.drawing_tables import drawing_attributes
from femgear.stages.protocol import Progress, Stage, counting_on, one_blas_thread, silent
from femgear.stages.static_results import (
    SLICES,
    StaticResult,
    StressResult,
    describe_static,
    describe_stress,
)
from femgear.stages.strength import case_stresses
from femgear.stages.wear import MeshingTeeth, speed_of_wear

if TYPE_CHECKING:
    from femgear.case.teeth import GearCase

# beyond this many mesh periods stresses are kept around the worst tooth only: 64 positions of 256 periods
# would take a quarter of a gigabyte for three planets
WHOLE_RECORD = 16
_PER_OVERLAP = 6
"""Slices of helical teeth in the part of the width in which they turn by a pitch."""
_MORE = 64
"""Positions beside three times those that are wanted, for the sake of slices."""
LARGEST_MOTION, LARGEST_APPROACH = 2.0, 0.5
"""Of a member and of the flanks of a mesh for which displacements count as small [modules]."""


@one_blas_thread()
def solve_static(
    case: Case,
    *,
    cache: Path | None = None,
    progress: Progress = silent,
    steps: Steps | None = None,
    deviations: SetDeviations | None = None,
) -> StaticResult:
    """Solve for static transmission error, load sharing and mesh stiffness over one mesh period.

    With errors that turn the record spans as many mesh periods as they take to repeat.

    Parameters
    ----------
    case : Case
        A planetary set, from `femgear.read_case`.
    cache : path, optional
        Folder of generated grids.
    progress : callable
        Called with (stage, done, total).
    steps : Steps, optional
        Flank compliances of other cases, taken where they are those of this one.
    deviations : SetDeviations, optional
        In place of those of the case, as of a gearbox that misaligns the teeth.

    Returns
    -------
    StaticResult
        ``cycle`` holds transmission error [m], mesh forces [N] and mesh stiffness [N/m], see
        `femgear.contact.mesh_cycle.MeshCycle`.

    Raises
    ------
    GeometryError
        Gears that cannot be made, assembled or run.
    GridError
        Teeth that cannot be meshed.
    ContactError
        A load that the contact cannot carry.
    """
    gears, steps = planetary_set(case), steps or Steps()
    deviations = set_deviations(case) if deviations is None else deviations
    progress("grids", 0.0, 1.0)
    sectors, bodies = known_compliances(case, gears, steps, cache=cache)
    width = over_width(case, gears, cache=cache, steps=steps)
    progress("grids", 1.0, 1.0)
    sun_torque = case.torque_on_first_gear()
    periods, period_message = common_period(deviations, gears, limit=case.static.longest_record)
    options = CycleOptions(
        both_flanks=case.static.back_flanks,
        # pressures of the plane contact are not those of slices
        pressures=case.static.stresses and periods == 1 and case.static.slices < 2,
        peaks=case.static.peaks,
        friction=acting_friction(case, gears),
        progress=counting_on(progress, "contact"),
        **width,
    )
    cycle = walk_mesh_cycle(gears, bodies, options=options, **_walk(case, gears, deviations, periods))
    _check_motions(case, cycle, gears.gears[0].module)
    overlap = _overlap(case, gears) if cycle.helical else 0.0
    base = base_helix_angle(case.pressure_angle, case.helix_angle or 0.0) if overlap else 0.0
    parts = gears, sectors, bodies, cycle, sun_torque, static_entries(case), period_message
    drawing = drawing_attributes(case)
    return StaticResult(*parts, overlap_ratio=overlap, base_helix_angle=base, waves=width.get("waves"), drawing=drawing)


def static_without_load(case: Case, *, cache: Path | None = None, steps: Steps | None = None) -> StaticResult:
    """Make what modes take of a static solution, gears and their flank compliances, without solving any contact.

    ``cycle`` is empty. Arguments are those of `solve_static`.
    """
    gears, steps = planetary_set(case), steps or Steps()
    sectors, bodies = known_compliances(case, gears, steps, cache=cache)
    waves = over_width(case, gears, cache=cache, steps=steps).get("waves")
    cycle = cycle_without_load(gears, np.zeros(1), periods=1, contact=case.static.contact)
    parts = gears, sectors, bodies, cycle, case.torque_on_first_gear(), static_entries(case)
    return StaticResult(*parts, waves=waves)


def _walk(case: Any, gears: GearSet, deviations: SetDeviations, periods: int) -> dict[str, Any]:
    """Collect how the mesh cycle of a case is walked through: load, positions, errors, supports."""
    return {
        "sun_torque": case.torque_on_first_gear(),
        "positions": record_positions(case, gears),
        "contact": case.static.contact,
        # thickness errors separate the back flanks alone
        "deviations": None if deviations.ideal and not case.static.back_flanks else deviations,
        "supports": static_supports(case),
        "periods": periods,
    }


def frictionless_cycle(case: Any, static: StaticResult) -> MeshCycle:
    """Solve the positions of a static solution without the friction that acts in it."""
    gears = static.planetary_set
    options = CycleOptions(**over_width(case, gears, waves=static.waves))
    walk = _walk(case, gears, set_deviations(case), static.cycle.periods)
    return walk_mesh_cycle(gears, static.bodies, options=options, **walk)


def _check_motions(case: Case, cycle: MeshCycle, module: float) -> None:
    """Refuse flanks that approach by half a module, members that move by two: no small displacements."""
    moved = np.abs(cycle.member_motion).max(axis=1, initial=0.0)
    member = cycle.member_names[int(moved.argmax())].split(":")[0] if len(moved) else ""
    support = {"sun": "sun.support_stiffness", "carrier": "carrier.support_stiffness"}
    support["ring"] = "ring.foundation_radial"
    for name, motion, key, modules, remedy in (
        (
            "the flanks approach",
            # an offset of leads is none of the flanks' own
            cycle.deflection - (0.0 if cycle.lead_offset is None else cycle.lead_offset),
            "operation.torque",
            LARGEST_APPROACH,
            (LESS_TORQUE, "smaller errors of the teeth"),
        ),
        (
            f"the {member} moves",
            cycle.member_motion,
            support.get(member, "planet.bearing_stiffness"),
            LARGEST_MOTION,
            ("stiffen the supports and bearings, or reduce the clearance", LESS_TORQUE),
        ),
    ):
        largest = float(np.abs(motion).max(initial=0.0))
        if largest > modules * module:
            raise ContactError(
                f"{name} by {largest * 1e3:.4g} mm: the model is one of small displacements",
                code="E-MOTION",
                key=key,
                file=case.location(key),
                value=f"{largest * 1e3:.4g} mm",
                limit=f"{modules:g} modules, {modules * module * 1e3:.4g} mm",
                remedy=remedy,
            )


def known_compliances(
    case: Case, gears: PlanetarySet, steps: Steps, *, cache: Path | None = None
) -> tuple[Sectors, Bodies]:
    """Take sector grids and flank compliances of a case from what others have left, or make them."""
    entries = compliance_entries(case)
    return steps.kept("flank compliances", entries) or steps.keep(
        "flank compliances", entries, flank_compliances(case, gears, cache=cache, steps=steps)
    )


def flank_compliances(
    case: Case, gears: PlanetarySet, *, cache: Path | None = None, steps: Steps | None = None
) -> tuple[Sectors, Bodies]:
    """Make the sector grids of all gears and their flank compliances, the ring held or on its foundation.

    The gears are those of the case; ``cache`` is the folder of generated grids. What other cases with some of
    the same gears have left is taken from ``steps``.
    """
    steps, materials = steps or Steps(), materials_of(case)
    names = [gear.name for gear in gears.gears]
    entries = [gear_entries(case, gears, number) for number in range(len(names))]
    sectors = make_sectors(
        gears,
        materials,
        flank_elements=case.static.flank_elements,
        cache=cache,
        sectors_kept=[steps.kept(f"sector of the {name}", entry) for name, entry in zip(names, entries)],
    )
    for name, entry, sector in zip(names, entries, sectors.gears, strict=True):
        steps.keep(f"sector of the {name}", entry, sector)
    elastic = case.static.members == "elastic"
    foundation = ring_foundation(case, sectors.ring) if elastic else None
    if elastic:
        entries[-1] = {**entries[-1], **foundation_entries(case)}
    bodies = make_bodies(
        sectors,
        materials,
        depth=case.static.depth,
        ring_foundation=foundation,
        compliances_kept=[steps.kept(f"flanks of the {name}", entry) for name, entry in zip(names, entries)],
    )
    for name, entry, body in zip(names, entries, bodies.gears):
        steps.keep(f"flanks of the {name}", entry, body)
    base, softer = _helical(case, gears)
    bodies = replace(bodies, helical=softer, base_helix_angle=base)
    return sectors, with_cracks(case, gears, sectors, bodies, elastic=elastic, steps=steps, cache=cache)


def with_cracks(
    case: Any,
    gears: GearSet,
    sectors: Sectors,
    bodies: Bodies,
    *,
    elastic: bool,
    steps: Steps,
    cache: Path | None = None,
) -> Bodies:
    """Add what the cracks of a case change to the flanks of its gears, the ring on its foundation if ``elastic``."""
    cracks = [fault for fault in set_deviations(case).faults if isinstance(fault, Crack)]
    for number in sorted({crack.gear for crack in cracks}):
        of_gear = {crack.form: crack for crack in cracks if crack.gear == number}
        sector, entries = sectors.gears[number], {**gear_entries(case, gears, number), "cracks": [*of_gear]}
        support = None
        if sector.gear.internal and elastic:
            entries = {**entries, **foundation_entries(case)}
            support = partial(_foundation_of, case, sector.gear.face_width)
        name = f"cracks of the {sector.gear.name}"
        of_cracks = steps.kept(name, entries) or steps.keep(
            name,
            entries,
            tuple(
                cracked_flanks(
                    sector,
                    materials_of(case)[number],
                    crack,
                    flank_elements=case.static.flank_elements,
                    teeth=flank_widths([gear.face_width for gear in gears.gears])[number],
                    support=support,
                    cache=cache,
                )
                for crack in of_gear.values()
            ),
        )
        bodies = bodies.with_gear(number, replace(bodies.gears[number], cracks=of_cracks))
    return bodies


def _foundation_of(case: Case, width: float, grid: Grid) -> Any:
    """Stiffness of the foundation of the ring on the rim of a grid, a sparse matrix (2n, 2n) [N/m]."""
    return foundation(grid, "rim", case.ring.foundation_radial, case.ring.foundation_tangential, thickness=width)


def gear_entries(case: Any, gears: GearSet, number: int) -> Entries:
    """List all that decides sector and flanks of a gear of a set, whatever the others are."""
    gear = gears.gears[number]
    return {
        "gear": repr(gear),
        "material": repr(materials_of(case)[number]),
        "widths": flank_widths([one_gear.face_width for one_gear in gears.gears])[number],
        "static.flank_elements": case.static.flank_elements,
        "static.depth": case.static.depth,
    }


def foundation_entries(case: Case) -> Entries:
    """List what decides the foundation of the ring."""
    ring = case.ring
    return {"foundation": (ring.foundation_radial, ring.foundation_tangential)}


def _helical(case: Any, gears: GearSet) -> tuple[float, tuple[float, ...]]:
    """Base helix angle [rad], and stiffness of the teeth of every kind of mesh over that of straight ones.

    Plane contact knows no helix.
    """
    base = 0.0
    if case.helix_angle is not None and case.static.slices > 1:
        base = base_helix_angle(case.pressure_angle, case.helix_angle)
    return base, tuple(helical_stiffness(base, internal=pair.gear_2.internal) for pair in gears.kinds)


def check_slices(case: Any, gears: GearSet) -> None:
    """Refuse (CaseError, E-SLICES) what slices over the width cannot do, and leads without slices.

    Slices together with back flanks or with clearance in the bearings of planets, or thinner than a quarter
    of a module.
    """
    static, count, first = case.static, case.static.slices, gears.gears[0]
    where, overlap = {"code": "E-SLICES", "file": case.location("static.slices")}, _overlap(case, gears)
    width = min(gears.mesh_widths)
    least, most = math.ceil(_PER_OVERLAP * abs(overlap)) + 1, int(4 * width / first.module)
    needed, other = max(min(SLICES, most), least), ", or leave static.slices out"
    other = "" if case.set.helix_angle else other
    if case.set.helix_angle and count < max(2, _PER_OVERLAP * abs(overlap)):
        raise CaseError(
            f"helical teeth with an overlap ratio of {abs(overlap):.3g} need slices over the width",
            key="static.slices",
            value=count,
            limit=f"at least {least}",
            remedy=f"give static.slices = {needed}",
            **where,
        )
    _check_width_entries(case, needed, helical=bool(overlap))
    if count < 2:
        for gear in case.gear_names:
            for i, modification in enumerate(getattr(case, gear).modifications):
                if modification.kind in OVER_WIDTH:
                    key = f"{gear}.modifications[{i}]"
                    raise CaseError(
                        f"a {modification.kind} needs slices over the width",
                        code="E-SLICES",
                        key=key,
                        file=case.location(key),
                        remedy=f"give static.slices = {needed}",
                    )
        for key, spall in narrow_spalls(case):
            raise CaseError(
                "a spall over a part of the face width needs slices over the width",
                code="E-SLICES",
                key=f"{key}.width",
                file=case.location(f"{key}.width"),
                limit=f"static.slices of {_fewest_slices(spall)} or more",
                remedy=(f"give static.slices = {max(needed, _fewest_slices(spall))}", "leave its width out"),
            )
        return
    _check_narrow_spalls(case, count, most)
    try:
        tilting_members(gears, width_supports(case, gears), count)
    except ContactError as error:
        error.file = case.location(error.key or "")
        raise
    _check_cracks(case, other)
    if static.back_flanks:
        remedy = f"leave static.back_flanks out{other}"
        raise CaseError("slices have no back flanks", key="static.back_flanks", remedy=remedy, **where)
    if static.members == "elastic" and case.planet.bearing_clearance:
        remedy = f"leave planet.bearing_clearance out{other}"
        raise CaseError("slices know no clearance", key="planet.bearing_clearance", remedy=remedy, **where)
    if width < 0.25 * count * first.module:
        raise CaseError(
            "slices are thinner than a quarter of the module",
            key="static.slices",
            value=count,
            limit=f"at most {most}",
            remedy=f"use at most {most} slices{other}",
            **where,
        )


def narrow_spalls(case: Any) -> list[tuple[str, Spall]]:
    """List the spalls of a case that go over a part of the face width, with their entries."""
    keyed = keyed_faults(case, planetary_set(case))
    return [(key, fault) for key, fault in keyed if isinstance(fault, Spall) and fault.across]


def _fewest_slices(spall: Spall) -> int:
    """Fewest slices of which the middle of one lies in a spall wherever it is."""
    low, high = spall.across or (-0.5, 0.5)
    return max(math.ceil(1.0 / (high - low) - 1e-9), 2)


def _check_narrow_spalls(case: Any, count: int, most: int) -> None:
    """Refuse spalls (CaseError, E-SLICES) in which no middle of a slice lies."""
    for key, spall in narrow_spalls(case):
        if not spall.in_slices(count).any():
            fewest = _fewest_slices(spall)
            remedy = f"give static.slices = {fewest}" if fewest <= most else "give a wider one"
            raise CaseError(
                "the spall is narrower than a slice of the face width, and lies in none",
                code="E-SLICES",
                key=f"{key}.width",
                file=case.location(f"{key}.width"),
                limit=f"over the middle of one of {count} slices; at most {most} slices",
                remedy=remedy,
            )


def _check_cracks(case: Any, other: str) -> None:
    """Refuse cracks (CaseError, E-FAULT) together with slices."""
    for name in case.gear_names:
        for i, fault in enumerate(getattr(case, name).fault):
            if fault.kind == "crack":
                key = f"{name}.fault[{i}]"
                raise CaseError(
                    "slices over the width know no cracks: a crack goes across the whole width of the plane contact",
                    code="E-FAULT",
                    key=key,
                    remedy=f"leave the crack out{other}",
                    file=case.location(key),
                )


def _check_width_entries(case: Case, needed: int, *, helical: bool) -> None:
    """Refuse tilts and twists without slices, and those of helical teeth, which axial motions press too."""
    if case.static.slices > 1 and not helical:
        return
    for name, entries in WIDTH_ENTRIES.items():
        given = vars(getattr(case, name)) if name in type(case).model_fields else dict.fromkeys(entries)
        for key in (f"{name}.{entry}" for entry in entries if given[entry] not in (None, ())):
            raise CaseError(
                "tilts and twists over the face width are those of spur teeth in slices",
                code="E-SLICES",
                key=key,
                file=case.location(key),
                remedy="leave them out, or take a lead slope" if helical else f"give static.slices = {needed}",
            )


def over_width(
    case: Any,
    gears: GearSet,
    *,
    waves: WidthWaves | None = None,
    cache: Path | None = None,
    steps: Steps | None = None,
) -> dict[str, Any]:
    """Compute what bodies yield across the width: options of the mesh cycle, none without slices.

    ``waves`` where they are there already, as `StaticResult.waves`; what other cases with some of the same
    gears have left is taken from ``steps``. CaseError: see `check_slices`.
    """
    check_slices(case, gears)
    count = case.static.slices
    if count < 2:
        return {}
    if waves is None:
        waves = _waves_of_case(case, gears, steps or Steps(), cache)
    options: dict[str, Any] = {"waves": waves, "slices": count, "width_supports": width_supports(case, gears)}
    if (overlap := _overlap(case, gears)) or narrow_spalls(case):
        options["ahead"] = slices_ahead(overlap, count)
    return options


def _waves_of_case(case: Any, gears: GearSet, steps: Steps, cache: Path | None) -> WidthWaves:
    """Condense all gears for waves across the width, and support the ring as the static stage has it."""
    materials, width = materials_of(case), common_width(gears.gears)[0]
    kept: list[tuple[str, Entries]] = []
    for gear, material in zip(gears.gears, materials, strict=True):
        entries = {"gear": repr(gear), "material": repr(material), "width": width}
        kept.append((f"waves of the {gear.name}", {**entries, "static.slices": case.static.slices}))
    sectors_kept = [steps.kept(*entry) for entry in kept]
    # half as fine as in the plane: K_H-beta changes by less than 2e-3
    sectors = make_sectors(
        gears,
        materials,
        flank_elements=6,
        refine=0.5,
        cache=cache,
        sectors_kept=[waves_kept and waves_kept.sector for waves_kept in sectors_kept],
    )
    missing = [number for number, before in enumerate(sectors_kept) if before is None]
    tasks = [
        partial(condensed_waves, sectors.gears[number], materials[number], case.static.slices, width)
        for number in missing
    ]
    for number, condensed in zip(missing, second_process.shared(tasks), strict=True):
        sectors_kept[number] = steps.keep(*kept[number], condensed)
    foundation = ring_foundation(case, sectors.ring) if case.static.members == "elastic" else None
    return waves_of_gears(sectors_kept, foundation, _helical(case, gears)[1])


def loaded_over_width(case: Case, gears: PlanetarySet, waves: WidthWaves | None, steps: Steps) -> dict[str, Any]:
    """Compute the options of `over_width` for the loaded state on all supports, with the ring held beside it.

    ``waves`` are those of the static solution, whose ring is the one or the other.
    """
    options = over_width(case, gears, waves=waves, steps=steps)
    if not options:
        return {}
    set_waves: Any = options["waves"]
    fixed = case.static.members == "fixed"
    entries = {"ring": repr(gears.gears[-1]), "material": repr(materials_of(case)[-1]), "width": set_waves.width}
    entries |= {"static.slices": case.static.slices, **(foundation_entries(case) if fixed else {})}
    rings = steps.kept("waves of the other ring", entries)
    if rings is None:
        other = with_ring_waves(set_waves, ring_foundation(case, set_waves.ring.sector) if fixed else None)
        rings = steps.keep("waves of the other ring", entries, [body.gears[-1] for body in other.bodies])
    bodies = (body.with_gear(-1, ring) for body, ring in zip(set_waves.bodies, rings, strict=True))
    other = replace(set_waves, bodies=tuple(bodies))
    return options | dict(zip(("waves", "held_waves"), (other, set_waves) if fixed else (set_waves, other)))


def record_positions(case: Any, gears: GearSet) -> int:
    """Choose the number of equidistant positions of a mesh period, as many as the case asks for at least.

    They meet all planets alike. Those of helical teeth meet the slices alike, as nearly as whole numbers
    can: three times or more while one slice follows another, where that takes no more than three times the
    positions and `_MORE`, so that `femgear.contact.face_width.over_slices` finds what slices add in coming
    into contact one by one. Slices that follow one another faster than positions add little.
    """
    wanted, slices = case.static.positions, case.static.slices
    if slices > 1 and (overlap := abs(_overlap(case, gears))):
        passed = slices / overlap
        often = 3.0 * passed <= 3.0 * wanted + _MORE
        wanted = round(passed * max(3, math.ceil(wanted / passed)) if often else passed / (passed // wanted))
    return gears.equal_positions(wanted)


def _overlap(case: GearCase, gears: GearSet) -> float:
    """Overlap ratio, positive where gear 1 is right-handed and upper slices run ahead; zero of spur teeth."""
    return math.copysign(case_overlap(case, gears), case.helix_angle or 1.0)


@one_blas_thread()
def solve_stress(case: Case, static: StaticResult, *, progress: Progress = silent) -> StressResult:
    """Find root stresses of every gear in every mesh, their ranges over a turn, load and nominal stresses.

    Parameters
    ----------
    case : Case
        As for `solve_static`.
    static : StaticResult
        Its static solution. It need not have pressures (`MeshCycle.pressure`); where it has, they are part of the
        result.
    progress : callable
        Called with (stage, done, total).

    Returns
    -------
    StressResult
        Stresses in Pa, load classes in N.

    Raises
    ------
    CaseError
        A static solution of another case (E-OTHER-CASE), or none (E-TYPE).
    GridError
        The root of a tooth is not one chain of edges, or a body can move freely.
    """
    check_entries(static, StaticResult, static_entries(case), "static solution")
    gears, cycle, reverse = static.planetary_set, static.cycle, static.sun_torque < 0
    influences = _influences(case, static, progress)
    repeats, _ = common_period(set_deviations(case), gears, limit=sys.maxsize)
    closes = repeats == cycle.periods
    teeth = loaded_teeth(cycle, reverse=reverse)
    between = () if cycle.between is None else cycle.between.records
    loads, *loads_between = (influences.loads(gears, record, reverse=reverse) for record in (cycle, *between))
    ranges = root_ranges(gears, influences, loads, closes=closes, between=loads_between)
    roots, first = _root_cycles(gears, influences, cycle, ranges, reverse)
    return StressResult(
        planetary_set=gears,
        cycle=cycle,
        influences=influences,
        roots=roots,
        first_period=first,
        between=tuple(root_stress_cycle(gears, influences, record, reverse=reverse) for record in between),
        ranges=ranges,
        spectrum=load_spectrum(gears, teeth, closes=closes),
        nominal=case_stresses(case, static.sun_torque),
        sun_torque=static.sun_torque,
        closes=closes,
        relief_kinks=relief_kinks(case),
    )


def relief_kinks(case: Case) -> tuple[bool, ...]:
    """Tell of every kind of mesh whether a relief of its loaded flanks begins with a kink."""
    given, back = set_deviations(case), case.torque_on_first_gear() < 0
    kinds = range(len(planetary_set(case).kinds))
    return tuple(
        any(getattr(law, "power", 2.0) <= 1.0 for form in given.mesh_forms(kind, back) for law in form.profile)
        for kind in kinds
    )


def ring_foundation(case: Case, sector: Sector):
    """Assemble the elastic foundation of one sector of the ring, a sparse matrix (2n, 2n) [N/m]."""
    return _foundation_of(case, sector.gear.face_width, sector.grid)


def static_supports(case: Case) -> Supports:
    """Choose the supports of the static problem: rigid, or those of the bodies of the case."""
    return RIGID if case.static.members == "fixed" else case_supports(case)


def case_supports(case: Case) -> Supports:
    """Make the supports of sun, carrier and planets, with the bearing clearance of the case."""
    return Supports(
        sun=support_stiffness(case, "sun"),
        carrier=support_stiffness(case, "carrier"),
        planet=case.planet.bearing_stiffness,
        planet_clearance=case.planet.bearing_clearance,
    )


def width_supports(case: Any, gears: GearSet) -> WidthSupports:
    """Make what holds the members of a case against tilting and twisting over the face width.

    The sun twists as a tube between its bore and its root circle, or the diameter that the case gives; gears
    of a pair do neither.
    """
    if not gears.members:
        return UPRIGHT
    sun, carrier, rigidity = case.sun, case.carrier, None
    if sun.torque_end is not None:
        outer = sun.torsion_diameter or 2.0 * gears.gears[0].root_radius
        shear = material_of(case, "sun").shear_modulus
        rigidity = shear * np.pi / 32 * (outer**4 - (2.0 * sun.bore_radius) ** 4)
        if rigidity <= 0.0:
            raise CaseError(
                "the sun has no section to twist",
                code="E-RANGE",
                key="sun.torsion_diameter",
                value=f"{outer * 1e3:.6g} mm",
                limit=f"above its bore, {2e3 * sun.bore_radius:.6g} mm",
                file=case.location("sun.torsion_diameter"),
            )
    sign = {"front": -1, "back": 1, None: 1}
    return WidthSupports(
        sun=sun.tilt_stiffness,
        carrier=carrier.tilt_stiffness,
        planet=case.planet.tilt_stiffness,
        wind_up=carrier.wind_up_stiffness,
        wind_up_end=sign[carrier.torque_end],
        sun_rigidity=rigidity,
        sun_end=sign[sun.torque_end],
    )


def mesh_backlash(gears: GearSet) -> np.ndarray:
    """List the normal backlash (2N,) of all meshes [m]."""
    return gears.of_kinds([pair.backlash for pair in gears.kinds])


def _influences(case: Case, static: StaticResult, progress: Progress = silent) -> RootStresses:
    """Find the root influences of the bodies as the static solution holds them, and of waves over the width.

    External gears were observed with their flanks; an internal one, whose contact has two plane states, and
    one that is wider than its mates are solved again. The tooth of the latter is at its root as wide as
    ISO 6336-3 takes it, and stresses of a plane body under given forces go by its width.
    """
    influences, loads, ahead, width = [], static.cycle.slice_load, None, min(static.planetary_set.mesh_widths)
    common = flank_widths([gear_sector.gear.face_width for gear_sector in static.sectors.gears])
    parts = zip(static.sectors.gears, static.bodies.gears, materials_of(case), common, strict=False)
    for i, (sector, body, material, of_flanks) in enumerate(parts):
        progress("stress", i, len(static.sectors.gears) + 1)
        gear, support = sector.gear, None
        if gear.internal:
            support = ring_foundation(case, sector) if case.static.members == "elastic" else None
        if body.root is None:
            influences.append(root_stress_influence(sector.grid, gear, material, foundation=support))
        else:
            influences.append(observed_root_stress(gear, body.root))
        narrower = [
            gear.face_width / root_face_width(gear.face_width, width_of_flank, case.module)
            for width_of_flank in of_flanks
        ]
        if max(narrower) > 1.0:
            loaded = np.repeat(narrower, len(influences[-1].roll))
            influences[-1] = replace(influences[-1], influence=influences[-1].influence * loaded)
        if loads is not None:
            waves = computed_waves(loads.shape[2]) * np.pi / width
            waves = max(narrower) * root_waves(sector.grid, gear, material, waves, foundation=support)
            # helical teeth are weaker than straight ones as they are softer: within 1 %
            weaker = 1.0 / helical_stiffness(static.base_helix_angle, internal=gear.internal)
            influence = influences[-1]
            influences[-1] = replace(influence, influence=weaker * influence.influence, waves=weaker * waves)
    if loads is not None:
        ahead = slices_ahead(static.overlap_ratio, loads.shape[2])
    return RootStresses(tuple(influences), ahead=ahead)


def _root_cycles(gears, influences, cycle: MeshCycle, ranges, reverse):
    """Find the root stress of every gear in every mesh, and the mesh period with which each begins."""
    if cycle.periods <= WHOLE_RECORD:
        roots = root_stress_cycle(gears, influences, cycle, reverse=reverse)
        return roots, np.zeros(len(roots), int)
    each, slots = len(cycle.position) // cycle.periods, cycle.tooth_load.shape[1]
    # one slot more at either end, and a period before and after
    length = min(slots + 4, cycle.periods)
    done, roots, first = {}, [], []
    for number, root_range in enumerate(ranges):
        slot, position = root_range.worst
        start = (position // each - slot - 2) % cycle.periods
        if start not in done:
            part = _excerpt(cycle, start, length)
            done[start] = root_stress_cycle(gears, influences, part, reverse=reverse)
        roots.append(done[start][number])
        first.append(start)
    return tuple(roots), np.array(first)


def _excerpt(cycle: MeshCycle, start: int, length: int) -> MeshCycle:
    """Take the loads of some mesh periods of a cycle; tooth numbers stay those of its first period."""
    each = len(cycle.position) // cycle.periods
    take = (start * each + np.arange(length * each)) % len(cycle.position)
    names = ("tooth_load", "slice_load", "path", "back_tooth_load", "back_path", "back_force")
    values = {name: getattr(cycle, name) for name in names}
    parts = {name: value[..., take] for name, value in values.items() if value is not None}
    return replace(cycle, position=np.arange(len(take)) / each, periods=length, **parts)


def loaded_set(
    case: Any,
    speed: float | None = None,
    *,
    cache: Path | None = None,
    steps: Steps | None = None,
    solve: Callable[..., StaticResult] = solve_static,
) -> tuple[MeshingTeeth, ...]:
    """Solve the contact of the teeth of a set, and find its mesh frequency at a speed of the input [rad/s].

    ``cache`` is the folder of generated grids, ``steps`` are compliances of other cases, ``solve`` solves the contact.
    CaseError: no speed (E-KEY-MISSING).
    """
    gears, operation, driven = planetary_set(case), case.operation, speed_of_wear(case, speed)
    turning = speeds(gears, input=operation.input, fixed=operation.fixed, speed=driven)
    return (MeshingTeeth("", solve(case, cache=cache, steps=steps), turning.mesh_frequency),)


STATIC = Stage(
    name="static",
    title="Static",
    solve=solve_static,
    options=("cache", "progress", "steps"),
    decided_by=solution_entries,
    verdict=lambda result: {"contact": result.cycle.contact},
    describe=lambda results: describe_static(results.static, results.findings),
    warnings=StaticResult.warnings,
    check=lambda case: check_slices(case, planetary_set(case)),
)


STRESS = Stage(
    name="stress",
    title="Stresses",
    solve=solve_stress,
    takes=("static",),
    options=("progress",),
    decided_by=stress_entries,
    verdict=lambda result: {
        "root_points": sum(len(root.arc) for root in result.roots),
        "iso": result.nominal.message,
    },
    describe=lambda results: describe_stress(results.stress, results.findings),
    warnings=StressResult.warnings,
    concerned_by={"": ("W-EDGE", "W-FILLET", "W-KINK"), "static": ("W-EDGE", "W-KINK", "W-PRESSURE")},
    wanted=lambda case: case.static.stresses,
    unavailable=lambda case: (
        "" if case.helix_angle is None or case.static.slices > 1 else "helical teeth need static.slices = 25"
    ),
    case_if_requested=lambda case: case.model_copy(
        update={"static": case.static.model_copy(update={"stresses": True})}
    ),
)
