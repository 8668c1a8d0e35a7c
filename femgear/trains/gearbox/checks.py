"""What a gearbox case is refused for before anything is computed: names, seats, sizes, loads."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from femgear.case.fault_sections import no_faults
from femgear.case.gear_set import set_deviations
from femgear.case.load_spectrum import check_running_shares
from femgear.case.messages import no_such
from femgear.case.quantities import LENGTH
from femgear.case.text import CaseFile
from femgear.errors import CaseError, FemgearError, refused_at
from femgear.trains.gearbox.carrier import carrier_problems
from femgear.trains.gearbox.case_file import (
    CASING,
    BoxBearingSection,
    BoxPlanetarySection,
    BoxShaftSection,
    GearboxCase,
    PairSection,
    embed_stages,
    teeth_of,
)
from femgear.trains.gearbox.casing_checks import check_casing
from femgear.trains.gearbox.elastic_carrier import superelement_problems
from femgear.trains.gearbox.entry_checks import coupling_problems, massless_bodies, run_up_problems
from femgear.trains.gearbox.geometry import (
    DISTANCE_TOLERANCE,
    StageSizes,
    carriers,
    facing_gears,
    pair_sizes,
    rolling_bearing,
    set_sizes,
)
from femgear.trains.gearbox.holding import floating_shafts, loose_fits, tilting_shafts, untaken_thrust
from femgear.trains.gearbox.materials import material_notices
from femgear.trains.gearbox.planet_branches import misplaced_branches
from femgear.trains.gearbox.planet_errors import planet_error_problems
from femgear.trains.gearbox.planet_shafts import carrier_entries, unclosed_chains
from femgear.trains.gearbox.power import gearbox_flow
from femgear.trains.gearbox.tooth_life import pitting_problems
from femgear.trains.gearbox.transient_case import transient_problems

# Entries that speeds and torques hang on.
_OF_THE_FLOW = ("pair", "planetary", "coupling", "operation", "load")
_OR_BODY = ", or a shaft that is one rigid body"
_NO_CONTACT = "without contact no flank is looked at, and so no fault of a tooth"
"""What a torque may act on beside a load."""
_ROLLER = ("rolling_elements", "element_diameter", "pitch_diameter")
_SPRINGS = ("radial", "axial", "tilt", "torsional")
# Positions on a shaft that are off it by less are on it [m].
_EDGE = 1e-9


def check_gearbox_entries(case: GearboxCase) -> list[CaseError]:
    """List what no entry of a gearbox case shows alone: all that can be judged beside wrong names and sizes."""
    named = [*_names(case), *_references(case)]
    stages, loads = [*_stages(case)], [*_loads(case)]
    problems = [*named, *_seats(case), *_bearings(case), *_shaft_parts(case), *stages, *loads, *_weight(case)]
    problems += [*coupling_problems(case), *run_up_problems(case)]
    problems += transient_problems(case.transient, port_names(case))
    problems += [] if named else [*planet_error_problems(case)]
    problems += [] if named else check_casing(case)
    problems += [] if stages else pitting_problems(case, (*case.pair, *case.planetary))
    # what has no mass turns and is held as what has
    return [*problems, *([] if named else massless_bodies(case)), *_held(case, problems)]


def _beside_refused(case: GearboxCase, tables: Sequence[str]) -> Iterator[CaseError]:
    """Judge a case without its refused entries, which are in these tables: names, and places of others."""
    yield from (*_names(case), *_references(case))
    if any(key.startswith("shaft") for key in tables):
        return  # places are those on shafts
    for problem in (*_seats(case), *_bearings(case), *_shaft_parts(case), *_stages(case), *coupling_problems(case)):
        if not any(f"{problem.key}.".startswith((f"{key}.", f"{key}[")) for key in tables):
            yield problem


def _held(case: GearboxCase, problems: Sequence[CaseError]) -> Iterator[CaseError]:
    """What holds and drives all shafts, where the entries that it hangs on are sound."""
    keys = [problem.key or "" for problem in problems if not _misplaced(problem)]
    judged = {
        kind: [
            i
            for i in range(len(getattr(case, kind)))
            if not any(key == f"{kind}[{i}]" or key.startswith(f"{kind}[{i}].") for key in keys)
        ]
        for kind in ("pair", "planetary")
    }
    yield from loose_fits(case, [case.pair[i] for i in judged["pair"]])
    floating = [*floating_shafts(case, judged=judged)]
    yield from floating
    tilting = [*tilting_shafts(case)] if not any(key.startswith("bearing") for key in keys) else []
    yield from tilting
    if any(key.startswith(_OF_THE_FLOW) or (key.startswith("shaft") and key.endswith("].name")) for key in keys):
        return
    refused: set[str] = set()
    for number, load_case in enumerate(case.operation.load_case):
        try:
            flow = gearbox_flow(case, load_case)
        except FemgearError as error:
            yield from (problem for problem in error.problems if problem.message not in refused)  # type: ignore[misc]
            refused |= {problem.message for problem in error.problems}
            continue
        if not floating and not any(key.startswith(("bearing", "shaft")) for key in keys):
            thrusts = [problem for problem in untaken_thrust(case, flow, number) if problem.key not in refused]
            # of many load cases the first one
            refused |= {str(problem.key) for problem in thrusts}
            yield from thrusts
        if number == 0 and not any(key.startswith("shaft") for key in keys):
            unclosed = [*unclosed_chains(case, flow)]
            yield from [*misplaced_branches(case)] or unclosed


def _misplaced(problem: CaseError) -> bool:
    """Whether a gear or bearing is only at a wrong place: its stage turns as it would at the right one."""
    ends = ("position", "positions", "shafts", "_position")
    return problem.code in ("E-CENTRE-DISTANCE", "E-RANGE") and (problem.key or "").endswith(ends)


def _weight(case: GearboxCase) -> Iterator[CaseError]:
    """A direction that is one."""
    if case.gravity is not None and not any(case.gravity.direction):
        yield CaseError(
            "the weight has no direction",
            code="E-RANGE",
            key="gravity.direction",
            value=list(case.gravity.direction),
            limit="a vector that is not zero",
            remedy="write direction = [0.0, -1.0, 0.0]",
        )


def _names(case: GearboxCase) -> Iterator[CaseError]:
    """One name, one part: of shafts, of loads and bearings, of stages."""
    kinds = {
        "shaft": [(f"shaft[{i}]", shaft.name) for i, shaft in enumerate(case.shaft)],
        "load, bearing and mass": [
            (f"{kind}[{i}]", section.name)
            for kind in ("load", "bearing", "mass")
            for i, section in enumerate(getattr(case, kind))
            if section.name is not None
        ],
        "stage": [
            (f"{kind}[{i}]", section.name)
            for kind in ("pair", "planetary")
            for i, section in enumerate(getattr(case, kind))
        ],
        "load case": [
            (f"operation.load_case[{i}]", load_case.name) for i, load_case in enumerate(case.operation.load_case)
        ],
    }
    for kind, entries in kinds.items():
        earlier: dict[str, str] = {CASING: ""} if kind == "shaft" else {}
        for key, name in entries:
            if name in earlier:
                whose = f"that of {earlier[name]} already" if earlier[name] else "the word for the casing"
                yield CaseError(
                    f"the name is {whose}",
                    code="E-DUPLICATE",
                    key=f"{key}.name",
                    value=name,
                    remedy=f"give every {kind} a name of its own",
                )
            earlier.setdefault(name, key)


def _references(case: GearboxCase) -> Iterator[CaseError]:
    """Names of shafts and loads that there are."""
    shafts = [shaft.name for shaft in case.shaft]
    used: list[tuple[str, str]] = []
    for kind in ("mass", "bearing", "load"):
        used += [(f"{kind}[{i}].shaft", section.shaft) for i, section in enumerate(getattr(case, kind))]
    for i, bearing in enumerate(case.bearing):
        used += [(f"bearing[{i}].outer_shaft", bearing.outer_shaft)] if bearing.outer_shaft is not None else []
    used += [(f"coupling[{i}].between", name) for i, coupling in enumerate(case.coupling) for name in coupling.between]
    used += [(f"pair[{i}].shafts", name) for i, pair in enumerate(case.pair) for name in pair.shafts]
    used += [(f"pair[{i}].carrier", pair.carrier) for i, pair in enumerate(case.pair) if pair.carrier is not None]
    for i, stage in enumerate(case.planetary):
        used += [(f"planetary[{i}].{member}", getattr(stage, member)) for member in ("sun", "carrier", "ring")]
    used += [("operation.fixed", name) for name in case.operation.fixed]
    casing_allowed = ("pair", "planetary", "coupling")
    for key, name in used:
        on_carrier = key.startswith("pair") and key.endswith(".carrier")
        if name == CASING and key.startswith(casing_allowed) and not on_carrier:
            continue
        yield from _unknown(key, name, shafts, "[[shaft]]")
    ports = [*port_names(case)]
    for key, name in [("operation.output", name) for name in case.operation.output]:
        yield from _unknown(key, name, ports, "[[load]]", _OR_BODY)
    for i, load_case in enumerate(case.operation.load_case):
        for name in load_case.torque:
            yield from _unknown(f"operation.load_case[{i}].torque", name, ports, "[[load]]", _OR_BODY)
        for name in load_case.speed:
            yield from _unknown(f"operation.load_case[{i}].speed", name, shafts, "[[shaft]]")


def port_names(case: GearboxCase) -> list[str]:
    """List what torques may act on: loads, and shafts that are one rigid body."""
    return [load.name for load in case.load] + [shaft.name for shaft in case.shaft if not shaft.part]


def _unknown(key: str, name: str, names: list[str], table: str, others: str = "") -> Iterator[CaseError]:
    if name not in names:
        limit = ", ".join([*dict.fromkeys(names)][:20]) or f"none: the case has no {table}"
        yield no_such("part", key, name, names, f"name a {table}{others}", limit=limit)


def _known(case: GearboxCase, *names: str) -> bool:
    """Whether all of the names are those of shafts, or of the casing."""
    return {*names} <= {CASING, *(shaft.name for shaft in case.shaft)}


def _seats(case: GearboxCase) -> Iterator[CaseError]:
    """Positions that lie on their shafts, given where the shaft is more than one rigid body."""
    for key, shaft, position in _all_seats(case):
        if shaft == CASING or not _known(case, shaft):
            continue
        section = case.shaft_named(shaft)
        if position is None and section.part:
            yield CaseError(
                f"the place on the shaft {shaft} is needed",
                code="E-KEY-MISSING",
                key=key,
                limit=f"0 mm to {LENGTH.show(section.length)} from its left end",
            )
        elif position is not None and section.part and not -_EDGE <= position <= section.length + _EDGE:
            yield CaseError(
                f"the place is off the shaft {shaft}",
                code="E-RANGE",
                key=key,
                value=LENGTH.show(position),
                limit=f"0 mm to {LENGTH.show(section.length)} from its left end",
                remedy="correct the position, or lengthen the shaft",
            )


def _all_seats(case: GearboxCase) -> Iterator[tuple[str, str, float | None]]:
    """Key, shaft and position of every place on a shaft."""
    for kind in ("mass", "bearing", "load"):
        for i, section in enumerate(getattr(case, kind)):
            yield f"{kind}[{i}].position", section.shaft, section.position
    for i, bearing in enumerate(case.bearing):
        if bearing.outer_shaft is not None:
            yield f"bearing[{i}].outer_position", bearing.outer_shaft, bearing.outer_position
    for kind, shafts in (("coupling", "between"), ("pair", "shafts")):
        for i, section in enumerate(getattr(case, kind)):
            for shaft, position in zip(getattr(section, shafts), section.positions or (None, None), strict=True):
                yield f"{kind}[{i}].positions", shaft, position
    for i, stage in enumerate(case.planetary):
        for member in ("sun", "carrier", "ring"):
            key = "carrier_body.file" if member == "carrier" and stage.superelement else f"{member}_position"
            yield f"planetary[{i}].{key}", getattr(stage, member), stage.member_position(member)


def _bearings(case: GearboxCase) -> Iterator[CaseError]:
    """Stiffnesses or geometry, one of them and whole; rings at one place."""
    for i, bearing in enumerate(case.bearing):
        key = f"bearing[{i}]"
        springs = bearing.given(*_SPRINGS)
        if bearing.kind is None and not any(bearing.stiffness) and not bearing.axial and not bearing.gapped:
            yield CaseError(
                "the bearing holds nothing",
                code="E-KEY-MISSING",
                key=f"{key}.{springs[0] if springs else 'radial'}",
                limit="one of radial, axial, tilt above 0, or a kind with its geometry",
                remedy='give radial = "2e8 N/m" (see the page on bearing stiffness), or kind = "ball"',
            )
        elif bearing.kind is not None and springs:
            yield CaseError(
                "the stiffness of the bearing is given twice",
                code="E-CHOICE",
                key=f"{key}.{springs[0]}",
                limit="stiffnesses, or kind with the geometry",
                remedy=f"leave {', '.join(springs)} or kind out",
            )
        elif bearing.kind is not None:
            wrong = list(_geometry(bearing, key))
            yield from wrong or _refused(bearing, key)
        elif bearing.axial_sense == "none":
            yield CaseError(
                "springs that take no thrust have no axial stiffness",
                code="E-CHOICE",
                key=f"{key}.axial_sense",
                value="none",
                limit="positive or negative, of a kind also none",
                remedy="leave axial and axial_sense out",
            )
        if bearing.kind is None and bearing.clearance:
            yield from _play(bearing, key)
        if bearing.outer_shaft is not None and _known(case, bearing.shaft, bearing.outer_shaft):
            yield from _ring_places(case, bearing, key)


def _play(bearing: BoxBearingSection, key: str) -> Iterator[CaseError]:
    """Refuse play that no ring of springs can have."""
    if bearing.clearance < 0.0:
        yield CaseError(
            "springs have no tight fit",
            code="E-BEARING",
            key=f"{key}.clearance",
            value=LENGTH.show(bearing.clearance),
            limit="0 or more of a bearing that is given by its stiffness",
            remedy="leave it out, or give a kind with its geometry",
        )
    elif not bearing.radial or math.isinf(bearing.radial):
        yield CaseError(
            "play needs a radial stiffness beyond it",
            code="E-BEARING",
            key=f"{key}.radial",
            value="rigid" if bearing.radial else "none",
            limit="above 0 N/m and not rigid, of a bearing with clearance",
            remedy='give radial = "2e8 N/m", or leave the clearance out',
        )


def _geometry(bearing: BoxBearingSection, key: str) -> Iterator[CaseError]:
    needed = (*_ROLLER, *(() if bearing.kind == "ball" else ("effective_length",)))
    for name in needed:
        if getattr(bearing, name) is None:
            yield CaseError(
                f"a {bearing.kind} bearing needs it",
                code="E-KEY-MISSING",
                key=f"{key}.{name}",
                limit=", ".join(needed),
                remedy="give it from the catalogue, or stiffnesses in place of kind",
            )
    d, D = bearing.element_diameter, bearing.pitch_diameter
    if d is not None and D is not None and bearing.rolling_elements is not None:
        most = math.pi / math.asin(min(1.0, d / D)) if d < D else 0.0
        if bearing.rolling_elements > most + 1e-9:
            yield CaseError(
                "so many rolling elements do not fit on the pitch circle",
                code="E-RANGE",
                key=f"{key}.rolling_elements",
                value=bearing.rolling_elements,
                limit=f"at most {math.floor(most)} of {LENGTH.show(d)} on {LENGTH.show(D)}",
            )


def _refused(bearing: BoxBearingSection, key: str) -> Iterator[CaseError]:
    """Numbers that no bearing can have."""
    names = {"balls": "rolling_elements", "rollers": "rolling_elements", "axial_preload": "preload"}
    names |= dict.fromkeys(("ball_diameter", "roller_diameter"), "element_diameter")
    try:
        rolling_bearing(bearing)
    except CaseError as error:
        entry = names.get(error.key or "", error.key or "kind")
        if entry == "clearance" and isinstance(error.value, float):
            error.message, error.value = "the clearance is too large for the grooves", LENGTH.show(error.value)
            error.remedy = error.remedy or 'give the radial clearance of the catalogue in its unit, as in "20 um"'
        yield refused_at(error, f"{key}.{entry}")


def _ring_places(case: GearboxCase, bearing: BoxBearingSection, key: str) -> Iterator[CaseError]:
    if bearing.outer_shaft == bearing.shaft:
        yield CaseError(
            "both rings sit on one shaft",
            code="E-CHOICE",
            key=f"{key}.outer_shaft",
            value=bearing.shaft,
            limit="another shaft, or none for the casing",
        )
        return
    first, second = case.shaft_named(bearing.shaft), case.shaft_named(bearing.outer_shaft or "")
    places = (first.start + (bearing.position or 0.0), second.start + (bearing.outer_position or 0.0))
    on_pin = carriers(case).get(bearing.shaft) == bearing.outer_shaft
    apart = 0.0 if on_pin else math.dist(first.axis, second.axis)
    if apart > DISTANCE_TOLERANCE or abs(places[0] - places[1]) > DISTANCE_TOLERANCE:
        yield CaseError(
            "inner and outer ring of the bearing lie at two places",
            code="E-RANGE",
            key=f"{key}.outer_position",
            value=f"z = {LENGTH.show(places[0])} and {LENGTH.show(places[1])}, axes "
            f"{LENGTH.show(math.dist(first.axis, second.axis))} apart",
            limit="one place on one axis",
            remedy=_one_place(bearing, first, second, places[0], apart),
        )


def _one_place(
    bearing: BoxBearingSection, inner: BoxShaftSection, outer: BoxShaftSection, z: float, apart: float
) -> str:
    """What puts both rings of a bearing at one place: z [m] of its inner ring, where the outer shaft reaches it."""
    if apart > DISTANCE_TOLERANCE:
        return f"bearings join shafts on one axis: give {bearing.outer_shaft} the axis of {bearing.shaft}"
    end = outer.start + outer.length
    if outer.part and not outer.start <= z <= end:
        both = max(inner.start, outer.start), min(inner.start + inner.length, end)
        if both[0] > both[1]:
            return f"{bearing.shaft} and {bearing.outer_shaft} are nowhere beside one another: change their start"
        inside, around = (LENGTH.show(both[0] - shaft.start) for shaft in (inner, outer))
        return f'at z = {LENGTH.show(both[0])} both are: position = "{inside}", outer_position = "{around}"'
    return f'give outer_position = "{LENGTH.show(z - outer.start)}"'


def _shaft_parts(case: GearboxCase) -> Iterator[CaseError]:
    """Bores below outer diameters; neighbours that touch."""
    for i, shaft in enumerate(case.shaft):
        for j, part in enumerate(shaft.part):
            ends = (
                (part.outer_diameter, part.inner_diameter, "inner_diameter"),
                (
                    part.end_outer_diameter or part.outer_diameter,
                    part.bore_at_end,
                    "end_inner_diameter",
                ),
            )
            for outer, inner, name in ends:
                if not inner < outer:
                    yield CaseError(
                        "the bore is as large as the shaft",
                        code="E-RANGE",
                        key=f"shaft[{i}].part[{j}].{name}",
                        value=LENGTH.show(inner),
                        limit=f"below {LENGTH.show(outer)}",
                    )
                    break
        for j in range(1, len(shaft.part)):
            before, part = shaft.part[j - 1], shaft.part[j]
            bore = max(before.bore_at_end, part.inner_diameter)
            if not bore < min(before.end_outer_diameter or before.outer_diameter, part.outer_diameter):
                yield CaseError(
                    "the part does not touch the one before it",
                    code="E-SHAFT",
                    key=f"shaft[{i}].part[{j}].outer_diameter",
                    value=LENGTH.show(part.outer_diameter),
                    limit=f"above {LENGTH.show(bore)}, the larger bore of both",
                )


def _stages(case: GearboxCase) -> Iterator[CaseError]:
    for kind in ("pair", "planetary"):
        for i, stage in enumerate(getattr(case, kind)):
            key = f"{kind}[{i}]"
            if problem := _given_once(stage, key):
                yield problem
                continue
            members = stage.shafts if isinstance(stage, PairSection) else (stage.sun, stage.carrier, stage.ring)
            if not _known(case, *members):
                continue
            try:
                pair = isinstance(stage, PairSection)
                yield from _pair(case, stage, key) if pair else _planetary(case, stage, key)
                if stage.teeth is not None:
                    teeth = teeth_of(stage)
                    if not case.deflection.contact:
                        no_faults(teeth, _NO_CONTACT, "leave deflection.contact out")
                    set_deviations(teeth)
            except FemgearError as error:
                where = f"{key}.{'teeth' if stage.teeth is not None else 'gears'}"
                yield from (
                    refused_at(problem, f"{where}.{problem.key}" if problem.key else where)
                    for problem in error.problems
                )


def _given_once(stage: PairSection | BoxPlanetarySection, key: str) -> CaseError | None:
    """Teeth, or sizes with stiffnesses."""
    meshes = ("mesh",) if isinstance(stage, PairSection) else ("sun_mesh", "ring_mesh")
    given = stage.given("gears", *meshes)
    if stage.teeth is None and given != ["gears", *meshes]:
        missing = next(name for name in ("gears", *meshes) if name not in given)
        return CaseError(
            "the teeth of the stage are missing",
            code="E-KEY-MISSING",
            key=f"{key}.{missing if given else 'teeth'}",
            limit=f"teeth, or gears with {' and '.join(meshes)}",
            remedy='teeth = "stage.toml" names the case of a pair or a planetary set',
        )
    if stage.teeth is not None and given:
        return CaseError(
            "the teeth of the stage are given twice",
            code="E-CHOICE",
            key=f"{key}.{given[0]}",
            limit=f"teeth, or gears with {' and '.join(meshes)}",
            remedy=f"leave teeth or {', '.join(given)} out",
        )
    return None


def _pair(case: GearboxCase, stage: PairSection, key: str) -> Iterator[CaseError]:
    teeth = teeth_of(stage)
    if teeth is not None and teeth.train != "pair":
        yield _wrong_train(teeth, key, "pair")
        return
    if stage.shafts[0] == stage.shafts[1] or CASING in stage.shafts:
        yield CaseError(
            "the gears of a pair sit on two shafts",
            code="E-CHOICE",
            key=f"{key}.shafts",
            value=" and ".join(stage.shafts),
            limit="two shafts",
            remedy="give a gear that stands still a [[shaft]], and name that in operation.fixed",
        )
        return
    sizes, (first, second) = pair_sizes(stage), (case.shaft_named(name) for name in stage.shafts)
    distance = math.dist(first.axis, second.axis)
    yield from _distance(distance, sizes, f"{key}.shafts", "the axes of the two shafts")
    yield from carrier_entries(case, stage, key)
    yield from _mid_planes(case, stage, key)


def _planetary(case: GearboxCase, stage: BoxPlanetarySection, key: str) -> Iterator[CaseError]:
    teeth = teeth_of(stage)
    if teeth is not None and teeth.train not in ("elastic", "planar", "helical"):
        yield _wrong_train(teeth, key, "planetary set")
        return
    if stage.elastic_ring and (stage.ring != CASING or teeth is None or teeth.train != "elastic"):
        yield CaseError(
            "the ring has no grid to be elastic with",
            code="E-CHOICE",
            key=f"{key}.elastic_ring",
            value=True,
            limit='ring = "casing", and the teeth of a planetary set with an elastic ring',
            remedy="give such teeth, or leave elastic_ring out",
        )
        return
    members = [getattr(stage, name) for name in ("sun", "carrier", "ring")]
    if len(set(members)) < 3:
        twice = next(name for name in members if members.count(name) > 1)
        yield CaseError(
            "two members of a set on one shaft lock it",
            code="E-CHOICE",
            key=f"{key}.sun",
            value=twice,
            limit="three shafts, or two and the casing",
        )
        return
    sizes = set_sizes(stage)
    if stage.gears and stage.gears.given("planets") and stage.gears.planets != len(sizes.planet_angles):
        yield CaseError(
            "planets and planet_angles say different numbers of planets",
            code="E-COUNT",
            key=f"{key}.gears.planet_angles",
            value=len(sizes.planet_angles),
            limit=f"one angle for each of {stage.gears.planets} planets",
            remedy="give an angle for every planet, or leave planets out",
        )
    yield from (*carrier_problems(stage, key), *superelement_problems(stage, sizes, key))
    shafts = [
        (name, case.shaft_named(getattr(stage, name)))
        for name in ("sun", "carrier", "ring")
        if getattr(stage, name) != CASING
    ]
    for name, shaft in shafts[1:]:
        if math.dist(shaft.axis, shafts[0][1].axis) > DISTANCE_TOLERANCE:
            yield CaseError(
                f"sun and {name} have two axes",
                code="E-CENTRE-DISTANCE",
                key=f"{key}.{name}",
                value=f"{LENGTH.show(math.dist(shaft.axis, shafts[0][1].axis))} apart",
                limit="one axis of sun, carrier and ring",
            )
    yield from _mid_planes(case, stage, key)


def _wrong_train(teeth, key: str, wanted: str) -> CaseError:
    return CaseError(
        f"the teeth are those of another kind of case than a {wanted}",
        code="E-CHOICE",
        key=f"{key}.teeth",
        value=f"a case of the train {teeth.train}",
        limit=f"the case of a {wanted}",
    )


def _distance(distance: float, sizes: StageSizes, key: str, what: str) -> Iterator[CaseError]:
    wanted = sizes.centre_distance
    if abs(distance - wanted) > DISTANCE_TOLERANCE * max(1.0, wanted / 1e-1):
        yield CaseError(
            f"the gears do not reach each other: {what} lie elsewhere",
            code="E-CENTRE-DISTANCE",
            key=key,
            value=f"{LENGTH.show(distance)} apart",
            limit=LENGTH.show(wanted),
            remedy="correct the axes of the shafts, or the centre distance of the teeth",
        )


def _mid_planes(case: GearboxCase, stage: PairSection | BoxPlanetarySection, key: str) -> Iterator[CaseError]:
    """Refuse gears in mesh that have no face width in common."""
    for entry, (first, second), widths in facing_gears(case, stage):
        reach = 0.5 * sum(widths) if all(widths) else DISTANCE_TOLERANCE
        if abs(first - second) >= max(reach, DISTANCE_TOLERANCE):
            yield CaseError(
                "the gears do not face each other along their axes",
                code="E-RANGE",
                key=f"{key}.{entry}",
                value=f"middles at z = {LENGTH.show(first)} and {LENGTH.show(second)}",
                limit=f"less than {LENGTH.show(reach)} apart",
                remedy="correct the positions on the shafts, or shaft.start",
            )


def _loads(case: GearboxCase) -> Iterator[CaseError]:
    """Load cases that say something, outputs on shafts of their own without a torque of their own."""
    outputs = case.operation.output
    yield from _outputs(case)
    for i, load_case in enumerate(case.operation.load_case):
        key = f"operation.load_case[{i}]"
        for name in set(load_case.torque) & set(outputs):
            yield CaseError(
                "the torque of an output follows from the others",
                code="E-CHOICE",
                key=f"{key}.torque",
                value=name,
                limit="loads that are no operation.output",
                remedy="leave it out, here or in operation.output",
            )
    if case.operation.first > len(case.operation.load_case):
        yield CaseError(
            "there is no such load case",
            code="E-RANGE",
            key="operation.first",
            value=case.operation.first,
            limit=f"1 to {len(case.operation.load_case)}",
        )
    yield from check_running_shares(case.operation)


def _outputs(case: GearboxCase) -> Iterator[CaseError]:
    """Outputs, each of which balances torques on a shaft of its own."""
    places = {shaft.name: shaft.name for shaft in case.shaft if not shaft.part}
    places |= {load.name: load.shaft for load in case.load}
    first: dict[str, str] = {}
    for name in case.operation.output:
        if (shaft := places.get(name)) is None:
            continue
        if shaft in first:
            twice = first[shaft] == name
            yield CaseError(
                "the output stands twice"
                if twice
                else f"two outputs on {shaft}: nothing says how they share its torque",
                code="E-DUPLICATE",
                key="operation.output",
                value=name if twice else f"{first[shaft]}, {name}",
                limit="one output on a shaft",
                remedy="leave one out" if twice else f"leave {name} out, and give it its torque in every load case",
            )
        first.setdefault(shaft, name)


FILE = CaseFile(
    GearboxCase,
    check_gearbox_entries,
    claims=lambda tables: (
        "bearings on shafts" if isinstance(tables.get("shaft"), list) and "body" not in tables else ""
    ),
    notices=material_notices,
    embed=embed_stages,
    beside_refused=_beside_refused,
)
