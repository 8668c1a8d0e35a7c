"""A whole REXS gear unit of shafts and stages as the tables of a gearbox.

Places of gears on their shafts are their middles, in format 1.0 their left faces. What the file has no word of and
what results hang on is told first.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from femgear.case.estimates import SUPPORT_SHARE, USUAL_STIFFNESS
from femgear.case.quantities import ACCELERATION, ANGLE, LENGTH, SPEED, STIFFNESS, to_si
from femgear.errors import CaseError
from femgear.exchange.gear_strength import common_strength
from femgear.exchange.gear_unit import gears_of, plain_ids, shaft_of, stage_components
from femgear.exchange.planetary_stage import is_bearing, with_unit
from femgear.exchange.rexs import Component, Model
from femgear.exchange.unit_bearings import BearingReader, coupling_table, engaged
from femgear.exchange.unit_lubrication import temperature_rise, thermal_expansion, unit_lubrication
from femgear.exchange.unit_operation import OperationReader, shaft_groups
from femgear.exchange.unit_shafts import (
    TOLERANCE,
    NoGearbox,
    Piece,
    Way,
    file_pieces,
    file_places,
    joined_pieces,
    material_table,
    misses,
    stage_way,
    walked_places,
)
from femgear.findings import NOTE

CASING = "casing"
SEATS = "seats"
"""Key of findings on places of gears and bearings that the file does not have."""
_ANGLE_KEY = "rotating_angle_around_neg_u_axis"
# Names of parts that a case can have.
_NAME = re.compile(r"(?=.{1,40}$)[A-Za-z][A-Za-z0-9_.-]*( [A-Za-z0-9_.-]+)*")
_PARTS = ("assembly", "ordered_assembly")
_SIDES = ("inner_part", "outer_part")
_SUPPORT = "support of "
_OF_GEARBOX = "dynamics", "runup", "strength"
"""Sections that the gearbox has in place of its stages."""
_SUPPORTS = ("bearing_stiffness", "support_stiffness")
# Parts beyond the end of a shaft by more make it longer, sections longer than this one [m].
_EDGE, _SHORTEST = 1e-9, 1e-5


def gearbox_tables(
    model: Model,
    stages: Mapping[str, dict[str, object]],
    load_case: int | None = None,
    *,
    refused: Mapping[str, str] | None = None,
) -> tuple[dict[str, Any], dict[str, str]]:
    """Make the tables of a gearbox, with remarks by key on what is assumed.

    Parameters
    ----------
    model : Model
        The unit.
    stages : mapping of str to dict
        Tables of the case of every stage by its id.
    load_case : int, optional
        Number of the load case that contact, modes and pictures are of; by default the first.
    refused : mapping of str to str, optional
        Bearings by their names in the case that get a stiffness of usual size in place of what the file has, and why.

    Raises
    ------
    NoGearbox
        The unit has other stages, gears without shafts, no speed or torque, or axes that are not parallel.
    """
    components = stage_components(model)
    if not components or any(stage.id not in stages for stage in components):
        raise NoGearbox("a stage of the unit became no case")
    unit = _Unit(model, components, stages, refused or {})
    tables: dict[str, Any] = {"format": 1, "model": "gearbox", "title": _title(model, components)}
    operation, added = unit.operation(load_case)
    tables["shaft"] = [unit.shaft_table(shaft) for shaft in unit.shafts]
    tables["bearing"] = unit.bearing_tables()
    tables["coupling"] = unit.coupling_tables()
    tables["pair"] = [unit.pair(stage) for stage in components if stage.type == "cylindrical_stage"]
    tables["planetary"] = [unit.planetary(stage) for stage in components if stage.type == "planetary_stage"]
    tables["load"] = unit.load_tables(added)
    tables["operation"] = operation
    if (weight := _gravity(model)) is not None:
        tables["gravity"] = weight
    of_stages: list[Any] = [stages[stage.id].get("strength", {}) for stage in components]
    if strength := common_strength(model, of_stages):
        tables["strength"] = strength
    if oil := unit.lubrication.table():
        tables["lubricant"] = oil
    casings = (part for part in model.components.values() if part.type == "gear_casing")
    if rise := next((rise_of_part for part in casings if (rise_of_part := temperature_rise(model, part))), None):
        tables["thermal"] = {"casing_rise": f"{rise:.6g} K"}
    for entry, why in unit.unseated.items():
        text, remedy = f"{entry}: {why}: taken as 0 mm", "give it in the gear unit, or the position in the case"
        model.remark(SEATS, text, remedy=remedy)
    return {key: value for key, value in tables.items() if value != []}, unit.remarks


def has_whole_shafts(tables: Mapping[str, Any]) -> bool:
    """Whether all shafts of a gearbox have sections and bearings of the file."""
    held = {bearing["shaft"] for bearing in tables.get("bearing", ()) if not bearing["name"].startswith(_SUPPORT)}
    return all("part" in shaft and shaft["name"] in held for shaft in tables["shaft"])


def _title(model: Model, stages) -> str:
    teeth = []
    for stage in stages:
        gears = gears_of(model, stage)
        if not gears:
            meshes = model.related("assembly", "part", assembly=stage.id)
            gears = list({gear.id: gear for mesh in meshes for gear in gears_of(model, mesh)}.values())
        numbers = dict.fromkeys(f"{abs(model.number(gear, 'number_of_teeth') or 0.0):g}" for gear in gears)
        teeth.append("/".join(numbers))
    return f"Gear unit of {len(stages)} stage{'s' * (len(stages) > 1)}, {', '.join(teeth)}"


def _gravity(model: Model) -> dict[str, Any] | None:
    """Table of the weight, where the unit says that it counts."""
    for part in model.components.values():
        if part.type == "gear_unit" and "true" in (
            model.text(part, "EIGENGEWICHT"),
            model.text(part, "account_for_gravity"),
        ):
            along = [model.number(part, f"direction_vector_gravity_{way}") or 0.0 for way in "vwu"]
            size = model.number(part, "gravitational_acceleration", ACCELERATION)
            table: dict[str, Any] = {"acceleration": with_unit(size, ACCELERATION)} if size else {}
            if not any(along):
                model.remark("gravity", "the file does not tell where its weight acts: along -y", severity=NOTE)
                return table
            return table | {"direction": [component / math.hypot(*along) for component in along]}
    return None


class _Unit:
    """Shafts, bearings, loads and stages of a unit, and where they are."""

    def __init__(
        self,
        model: Model,
        stages: Sequence[Component],
        tables: Mapping[str, dict[str, Any]],
        refused: Mapping[str, str],
    ):
        self.model, self.stages, self.teeth, self.refused = model, stages, tables, refused
        self.unseated: dict[str, str] = {}
        self.remarks: dict[str, str] = {}
        self.names = _part_names(model)
        self.couplings = [
            part for part in model.components.values() if part.type.endswith("coupling") and engaged(model, part)
        ]
        self.members: dict[str, dict[str, tuple[Component | None, str | None]]] = {}
        self.components: dict[str, list[Component]] = {}
        self.main: dict[str, str] = {}
        for stage in stages:
            self.members[stage.id] = dict(self._stage_members(stage))
        self._add_struts()
        self._add_coupled()
        self.shafts = [part.id for part in model.components.values() if part.id in self.components]
        self.gears = {
            gear.id for members in self.members.values() for gear, _ in members.values() if gear is not None
        } | {gear.id for stage in stages for gear in self._planets(stage)}
        self.bearings = [
            (part, *sides)
            for part in model.components.values()
            if _is_whole(part) and (sides := self._sides(part)) is not None
        ]
        self.loads = [
            (part, shaft)
            for shaft in self.shafts
            for component in self.components[shaft]
            for part in model.related(_PARTS, "part", assembly=component.id)
            if part.type == "external_load"
        ]
        self.lubrication = unit_lubrication(model)
        self.zero = self._zeros()
        self.pieces = {shaft: self._pieces(shaft) for shaft in self.shafts}

    # which shafts there are

    def _stage_members(self, stage: Component) -> Iterator[tuple[str, tuple[Component | None, str | None]]]:
        """Gears of a stage with their shafts by what they are; the shaft is None in the casing."""
        model = self.model
        if stage.type == "cylindrical_stage":
            for name, gear in zip(("gear_1", "gear_2"), gears_of(model, stage), strict=True):
                yield name, (gear, self._shaft(gear))
            return
        gears = {gear.id: gear for _, pair in self._meshes(stage) for gear in pair}
        planets = {gear.id for gear in self._planets(stage)}
        ring = next(gear for gear in gears.values() if gear.type == "ring_gear")
        sun = next(gear for gear in gears.values() if gear.id not in planets and gear.id != ring.id)
        yield "sun", (sun, self._shaft(sun))
        carriers = model.related("planet_carrier_shaft", "shaft", planetary_stage=stage.id)
        if not carriers or any(carrier.type != "shaft" for carrier in carriers):
            raise NoGearbox(f"the carrier of {stage} has no shaft")
        self.components.setdefault(carriers[0].id, list(carriers))
        self.main |= {carrier.id: carriers[0].id for carrier in carriers}
        yield "carrier", (None, carriers[0].id)
        shaft = shaft_of(model, ring)
        yield "ring", (ring, None if shaft is None or self._stands(stage, shaft) else self._shaft(ring))

    def _meshes(self, stage: Component) -> list[tuple[Component, list[Component]]]:
        meshes = self.model.related("assembly", "part", assembly=stage.id)
        return [(mesh, pair) for mesh in meshes if len(pair := gears_of(self.model, mesh)) == 2]

    def _planets(self, stage: Component) -> list[Component]:
        """Planets of a planetary stage; none of another one."""
        planets = {gear.id: gear for _, pair in self._meshes(stage) if pair[1].type == "ring_gear" for gear in pair[:1]}
        return list(planets.values())

    def _shaft(self, gear: Component) -> str:
        shaft = shaft_of(self.model, gear)
        if shaft is None:
            raise NoGearbox(f"{gear} has no shaft: no relation of the type assembly has it as part of one")
        self.components.setdefault(shaft.id, [shaft])
        return self.main.setdefault(shaft.id, shaft.id)

    def _stands(self, stage: Component, shaft: Component) -> bool:
        """Whether the shaft of a ring stands in the casing: held by a coupling, or by nothing else in its stage."""
        held = [coupling for coupling in self.couplings if self._ends(coupling) == {shaft.id, None}]
        if held:
            return not any(
                value != "rigid" for coupling in held for value in coupling_table(self.model, coupling).values()
            )
        loaded = any(part.type == "external_load" for part in self.model.related(_PARTS, "part", assembly=shaft.id))
        fixed = self.teeth[stage.id].get("operation", {}).get("fixed")
        if fixed != "ring" or loaded or self.model.number(shaft, "rotational_speed", SPEED):
            return False
        self.model.remark(f"{stage.id}: ring", f"nothing holds or loads the ring of {stage}: it stands in the casing")
        return True

    def _ends(self, joint: Component) -> set[str | None]:
        """Ids of the shafts that a joint joins, with None for the casing; other parts are left out."""
        sides = [
            component
            for role in ("inner_part", "outer_part")
            for component in self.model.related("side", role, assembly=joint.id)[:1]
        ]
        return {
            None if side.type == "gear_casing" else side.id for side in sides if side.type in ("gear_casing", "shaft")
        }

    def _inside(self) -> set[str]:
        """Ids of the shafts and pins of planets, which are no shafts of the gearbox."""
        return {
            component.id
            for stage in self.stages
            for kind in ("planet_shaft", "planet_pin")
            for component in self.model.related(kind, "shaft", planetary_stage=stage.id)
        }

    def _add_struts(self) -> None:
        """Count shafts that several couplings join with the parts of one carrier, and nothing else, to it."""
        inside = self._inside()
        for members in self.members.values():
            carrier = members.get("carrier", (None, None))[1]
            joined: dict[str, int] = {}
            for ends in map(self._ends, self.couplings):
                if carrier is not None and {self.main.get(end or "") for end in ends} == {carrier, None}:
                    for end in ends - self.main.keys() - inside - {None}:
                        joined[end or ""] = joined.get(end or "", 0) + 1
            for end, count in joined.items():
                if count > 1 and carrier is not None and self._carries(end):
                    self.components[carrier].append(self.model.components[end])
                    self.main[end] = carrier

    def _add_coupled(self) -> None:
        """Add shafts that couplings join with those of stages, where anything is on them."""
        inside = self._inside()
        grown = True
        while grown:
            grown = False
            for joint in self.couplings:
                ends = {end for end in self._ends(joint) if end is not None and end not in inside}
                new = [end for end in ends if end not in self.main]
                if len(ends) == 2 and len(new) == 1 and self._carries(new[0]):
                    self.components[new[0]] = [self.model.components[new[0]]]
                    self.main[new[0]], grown = new[0], True

    def _carries(self, shaft: str) -> bool:
        """Whether a shaft has sections with sizes, or loads."""
        parts = self.model.related(_PARTS, "part", assembly=shaft)
        return any(part.type == "external_load" or self.model.number(part, "length", LENGTH) for part in parts)

    def _sides(self, part: Component) -> tuple[Component, str, Component | None, bool] | None:
        """Shaft of a bearing with its id, shaft around it if any, and whether the first is its outer part.

        None of bearings that hold no shaft of the gearbox, or one against a part that is not in it.
        """
        inner, outer = (
            next(iter(self.model.related("side", role, assembly=part.id)), None)
            for role in ("inner_part", "outer_part")
        )
        inside = [component is not None and component.id in self.main for component in (inner, outer)]
        other = outer if inside[0] else inner
        if not any(inside) or (not all(inside) and other is not None and other.type == "shaft"):
            return None
        if all(inside):
            assert inner is not None and outer is not None
            return inner, self.main[inner.id], outer, False
        shaft = inner if inside[0] else outer
        assert shaft is not None
        return shaft, self.main[shaft.id], None, inside[1]

    # where they lie

    def at(self, part: Component, key: str = "u_coordinate_on_shaft") -> float:
        """Place of a part on its shaft [m], of a gear its middle."""
        place = self._place(part, key)
        if part.id in self.gears and self.model.version.startswith("1.0"):
            place += 0.5 * (self.model.number(part, "face_width", LENGTH) or 0.0)
        return place

    def _place(self, part: Component, key: str) -> float:
        """Place of a part as the file has it [m], else zero; of gears and bearings that is kept to be told."""
        try:
            place, why = self.model.number(part, key, LENGTH), "the attribute is missing"
        except CaseError as error:
            place, why = None, f"{error.value}: {error.message}"
        if place is None and (part.id in self.gears or _is_whole(part)):
            self.unseated[f"{part}, {key}"] = why
        return place or 0.0

    def _zeros(self) -> dict[str, tuple[float, float, float]]:
        """Axis and zero (x, y, z) of the shafts of the file [m]: their coordinates, else from stage to stage."""
        parts = [component for shaft in self.shafts for component in self.components[shaft]]
        ways = list(self._stage_ways())
        places = file_places(self.model, parts)
        if places is not None and (off := misses(places, ways)) <= TOLERANCE:
            return places
        if places is not None:
            text = f"coordinates of shafts miss the centre distances by up to {1e6 * off:.3g} um: not taken"
            self.model.remark("shaft", text, remedy="shafts lie by centre distances and angles of the stages")
        ways += self._joint_ways()
        return walked_places([part.id for part in parts], ways)

    def _stage_ways(self) -> Iterator[Way]:
        for stage in self.stages:
            members = self.members[stage.id]
            if stage.type == "cylindrical_stage":
                (first, first_shaft), (second, other) = members["gear_1"], members["gear_2"]
                assert first is not None and second is not None and first_shaft is not None and other is not None
                angle = self.model.number(stage, _ANGLE_KEY, ANGLE) or 0.0
                # the angle leads from gear 1 of the file, which may be the internal one, that is gear 2 here
                if second in self.model.related("stage", "gear_1", stage=stage.id):
                    angle += math.pi
                yield first_shaft, other, stage_way(self._distance(stage), angle, self.at(first) - self.at(second))
                continue
            sun, shaft = members["sun"]
            ring, around = members["ring"]
            assert sun is not None and ring is not None and shaft is not None
            # the middle of the planets lies at the zero of the carrier where nothing else tells it
            for first_shaft in self.components[str(members["carrier"][1])]:
                yield shaft, first_shaft.id, (0.0, 0.0, self.at(sun))
            if around is not None:
                yield shaft, around, (0.0, 0.0, self.at(sun) - self.at(ring))

    def _distance(self, stage: Component) -> float:
        given = self.teeth[stage.id]["set"].get("centre_distance")
        distance = self.model.number(stage, "center_distance", LENGTH) if given is None else to_si(given, LENGTH)
        if distance is None:
            raise NoGearbox(f"{stage} has no centre distance")
        return distance

    def _joint_ways(self) -> Iterator[Way]:
        """Ways along bearings and couplings between two shafts."""
        keys = ("u_coordinate_on_shaft_inner_side", "u_coordinate_on_shaft_outer_side")
        for joint in [*(bearing[0] for bearing in self.bearings), *self.couplings]:
            sides = [
                next(iter(self.model.related("side", r, assembly=joint.id)), None) for r in ("inner_part", "outer_part")
            ]
            if all(side is not None and side.id in self.main for side in sides):
                inner, outer = (side.id for side in sides if side is not None)
                yield inner, outer, (0.0, 0.0, self.at(joint, keys[0]) - self.at(joint, keys[1]))

    def height(self, part: Component, shaft: Component, key: str = "u_coordinate_on_shaft") -> float:
        """Place of a part of a shaft of the file along z [m]."""
        return self.zero[shaft.id][2] + self.at(part, key)

    def gear_height(self, gear: Component) -> float:
        """Middle of a gear along z [m]; of a ring in the casing by its own coordinate."""
        shaft = shaft_of(self.model, gear)
        assert shaft is not None
        return self.height(gear, shaft)

    def _pieces(self, shaft: str) -> list[Piece]:
        """Sections of a shaft, with what carriers have beside, as far as its parts reach."""
        pieces = [
            p
            for component in self.components[shaft]
            for p in file_pieces(self.model, component, self.zero[component.id][2])
        ]
        if not pieces:
            text = f"shaft {shaft} has no sections: it is one rigid body"
            self.model.remark(f"shaft {shaft}", text, remedy="give it parts: what it bends misaligns teeth")
            return []
        for stage in self.stages:
            if self.members[stage.id].get("carrier", (None, None))[1] == shaft:
                pieces += self._carrier_body(stage, pieces)
        pieces, gaps = joined_pieces(pieces)
        if gaps:
            text = f"sections of shaft {shaft} leave gaps of {1e3 * gaps:.4g} mm: they are closed"
            self.model.remark(f"shaft {shaft}", text)
        reach = [height for height in self._heights(shaft)]
        low, high = min([*reach, pieces[0].start]), max([*reach, pieces[-1].end])
        longer = max(pieces[0].start - low, high - pieces[-1].end)
        if longer > _EDGE:
            text = f"shaft {shaft} is made {1e3 * longer:.4g} mm longer, up to the last part on it"
            self.model.remark(f"shaft {shaft}", text, remedy="correct the place of the part, or the sections")
        if pieces[0].start - low > _EDGE:
            pieces.insert(0, _extension(pieces[0], low, pieces[0].start))
        if high - pieces[-1].end > _EDGE:
            pieces.append(_extension(pieces[-1], pieces[-1].end, high))
        return pieces

    def _heights(self, shaft: str) -> Iterator[float]:
        """Places along z of all that sits on a shaft [m]."""
        for members in self.members.values():
            for gear, owner in members.values():
                if owner == shaft and gear is not None:
                    yield self.gear_height(gear)
        for stage in self.stages:
            if self.members[stage.id].get("carrier", (None, None))[1] == shaft:
                yield self.planet_height(stage)
        for part, component, owner, outer, turned in self.bearings:
            if owner == shaft:
                yield self.height(part, component, _side(turned))
            if outer is not None and self.main[outer.id] == shaft:
                yield self.height(part, outer, _side(True))
        for part, owner in self.loads:
            if owner == shaft:
                yield self.load_height(part)

    def load_height(self, part: Component) -> float:
        """Place of a load along z [m]."""
        shaft = shaft_of(self.model, part)
        assert shaft is not None
        return self.height(part, shaft)

    def planet_height(self, stage: Component) -> float:
        """Middle of the planets of a stage along z [m]: that of the sun."""
        sun = self.members[stage.id]["sun"][0]
        assert sun is not None
        return self.gear_height(sun)

    def _carrier_parts(self, stage: Component, kind: str) -> list[Component]:
        return [
            component for component in self.model.related(_PARTS, "part", assembly=stage.id) if component.type == kind
        ]

    def _side_plates(self, stage: Component) -> list[Piece]:
        """Side plates of a carrier from left to right, where the file has their sizes and places."""
        model, plates = self.model, []
        for carrier in self._carrier_parts(stage, "planet_carrier"):
            for carrier_part in self._carrier_parts(carrier, "side_plate"):
                length, outer = (
                    model.number(carrier_part, "length", LENGTH),
                    model.number(carrier_part, "outer_diameter", LENGTH),
                )
                place = model.vector(carrier_part, "support_vector", LENGTH)
                if length and outer and place:
                    bore = model.number(carrier_part, "inner_diameter", LENGTH) or 0.0
                    plates.append(Piece(place[0], place[0] + length, (outer, outer), (bore, bore)))
        return sorted(plates, key=lambda plate: plate.start)

    def _carrier_body(self, stage: Component, pieces: Sequence[Piece]) -> list[Piece]:
        """Side plates of a carrier, and a tube in place of the struts between them where its shafts have none."""
        plates = self._side_plates(stage)
        if len(plates) == 2 and not any(
            piece.start < plates[1].start and piece.end > plates[0].end for piece in pieces
        ):
            carriers = self._carrier_parts(stage, "planet_carrier")
            bores = [self.model.number(carrier, "strut_inner_diameter", LENGTH) for carrier in carriers]
            outer = min(plate.outer[0] for plate in plates)
            bore = next((given for given in bores if given), 0.5 * outer)
            plates.insert(1, Piece(plates[0].end, plates[1].start, (outer, outer), (bore, bore)))
            text = f"the struts of the carrier of {stage} are taken as a tube: stiffer and heavier than they are"
            self.model.remark(f"{stage.id}: carrier", text, severity=NOTE)
        return plates

    # tables

    def name(self, part: Component | str) -> str:
        """Name of a part in the case: its own where that is a name that nothing else has, else kind and id."""
        component = self.model.components[part] if isinstance(part, str) else part
        return self.names[component.id]

    def start(self, shaft: str) -> float:
        """Left end of a shaft along z [m]; of a rigid body the middle of its first part."""
        if self.pieces[shaft]:
            return self.pieces[shaft][0].start
        return next(self._heights(shaft), self.zero[shaft][2])

    def position(self, shaft: str, height: float) -> str:
        """Place on a shaft as a case has it."""
        return with_unit(height - self.start(shaft), LENGTH)

    def shaft_table(self, shaft: str) -> dict[str, Any]:
        x, y, _ = self.zero[shaft]
        table: dict[str, Any] = {"name": self.name(shaft), "axis": [_length(x), _length(y)]}
        table["start"] = _length(self.start(shaft))
        if pieces := [piece.table for piece in self.pieces[shaft] if piece.end - piece.start > _SHORTEST]:
            table["part"] = pieces
        material = material_table(self.model, self.model.components[shaft])
        if rise := temperature_rise(self.model, self.model.components[shaft]):
            table["temperature_rise"] = f"{rise:.6g} K"
            if (expansion := thermal_expansion(self.model, self.model.components[shaft])) is not None:
                material["thermal_expansion"] = f"{expansion:.6g} 1/K"
        return table | ({"material": material} if material else {})

    def bearing_tables(self) -> list[dict[str, Any]]:
        """Tables of all bearings, and of those that shafts without any need."""
        reader, rows = BearingReader(self.model, self.remarks), []
        for part, component, shaft, outer, turned in self.bearings:
            table: dict[str, Any] = {"name": self.name(part), "shaft": self.name(shaft)}
            table["position"] = self.position(shaft, self.height(part, component, _side(turned)))
            if outer is not None:
                around = self.main[outer.id]
                table["outer_shaft"] = self.name(around)
                table["outer_position"] = self.position(around, self.height(part, outer, _side(True)))
            row = self._bearing(reader, part, f"bearing[{len(rows)}]", self._usual(shaft), turned)
            if not {"radial", "axial", "tilt", "kind"} & row.keys():
                reader.tell(part, "holds nothing in the file: left out", severity=NOTE)
                continue
            rows.append(table | row | self._oil(part, row, component, outer, f"bearing[{len(rows)}]"))
        for part in self.model.components.values():
            if _is_whole(part) and not any(self.model.related("side", r, assembly=part.id) for r in _SIDES):
                reader.tell(
                    part,
                    "no relation of the type side joins it with a shaft: left out",
                    "give inner_part and outer_part",
                )
        reader.finish()
        for shaft in self.shafts:
            self._hold(shaft, rows)
        return rows

    def _bearing(self, reader: BearingReader, part: Component, key: str, usual: float, turned: bool) -> dict[str, Any]:
        """Table of a bearing, or of what stands in its place where it cannot be taken."""
        why = self.refused.get(self.name(part))
        if why is None:
            try:
                return reader.table(part, key, usual, turned=turned)
            except CaseError as error:
                why = (
                    " ".join(str(text) for text in (error.key, error.value) if text is not None) + f": {error.message}"
                )
        return reader.stand_in(part, usual, why, turned=turned)

    def _oil(self, part: Component, table: Mapping[str, object], inner: Component, outer: Component | None, key: str):
        """Lubrication of a rolling bearing; nothing, and told, where its numbers cannot be read."""
        if "kind" not in table:
            return {}
        try:
            pitch = to_si(table["pitch_diameter"], LENGTH)
            shafts = [inner.id, *([] if outer is None else [outer.id])]
            entries = self.lubrication.entries(part, table, pitch, shafts)
        except CaseError as error:
            where = f"{error.key} " if error.key else ""
            self.model.remark("bearing", f"{part}: {where}{error.message}: its lubrication is not taken")
            return {}
        if "viscosity_ratio" in entries:
            self.remarks[f"{key}.viscosity_ratio"] = "least of all load cases, of the oil at its temperature"
        return entries

    def _hold(self, shaft: str, rows: list[dict[str, Any]]) -> None:
        """Hold a shaft without bearings, and tilts of one that is a rigid body in bearings at one place."""
        name = self.name(shaft)
        rows_there = [row for row in rows if name in (row["shaft"], row.get("outer_shaft"))]
        coupled = any(shaft in self._ends(joint) for joint in self.couplings)
        if not rows_there and not coupled:
            usual = with_unit(self._usual(shaft), STIFFNESS)
            height = next(self._heights(shaft), self.start(shaft))
            table = {"name": f"{_SUPPORT}{name}", "shaft": name, "position": self.position(shaft, height)}
            rows.append(table | {"radial": usual, "axial": usual, "estimated": True})
            self.remarks[f"bearing[{len(rows) - 1}].radial"] = "assumed: the shaft has no bearing"
            text = f"{name} has no bearing: one of {usual} is assumed at its gear"
            self.model.remark("bearing", text, remedy="give its bearings")
        places = {row["position" if row["shaft"] == name else "outer_position"] for row in rows_there}
        if not self.pieces[shaft] and len(places) < 2:
            for row in (rows_there or rows[-1:])[:1]:
                if "kind" not in row:
                    row["tilt"] = "rigid"
                    text = f"{name} is a rigid body that one bearing holds: it is kept upright"
                    self.model.remark("bearing", text, remedy="give the places of its bearings, and its parts")

    def _usual(self, shaft: str) -> float:
        """Estimated stiffness of a bearing [N/m], from the widest gear of its shaft, else of the unit."""
        widths = {
            carrier: self.model.number(gear, "face_width", LENGTH) or 0.0
            for members in self.members.values()
            for gear, carrier in members.values()
            if gear is not None and carrier is not None
        }
        width = widths.get(shaft) or max(widths.values(), default=0.0) or 0.02
        for members in self.members.values():
            for gear, carrying in members.values():
                if gear is not None and carrying == shaft:
                    width = max(width, self.model.number(gear, "face_width", LENGTH) or 0.0)
        return float(f"{SUPPORT_SHARE * USUAL_STIFFNESS * width:.3g}")

    def coupling_tables(self) -> list[dict[str, Any]]:
        """Tables of the couplings between shafts of the gearbox, or of one and the casing."""
        rows = []
        for joint in self.couplings:
            ends = self._joined(joint)
            if ends is None:
                continue
            table: dict[str, Any] = {"name": self.name(joint)}
            table["between"] = [CASING if end is None else self.name(self.main[end.id]) for end in ends]
            heights = [
                None if end is None else self.height(joint, end, _side(number == 1)) for number, end in enumerate(ends)
            ]
            table["positions"] = [
                _length(0.0) if end is None or height is None else self.position(self.main[end.id], height)
                for end, height in zip(ends, heights, strict=True)
            ]
            rows.append(table | coupling_table(self.model, joint))
        return rows

    def _joined(self, joint: Component) -> list[Component | None] | None:
        """Both ends of a coupling, None for the casing; None altogether where it joins no two of them."""
        sides = [
            next(iter(self.model.related("side", role, assembly=joint.id)), None)
            for role in ("inner_part", "outer_part")
        ]
        ends: list[Component | None] = []
        for side in sides:
            if side is None or not (side.type == "gear_casing" or side.id in self.main):
                return None
            ends.append(None if side.type == "gear_casing" else side)
        shafts = {self.main[end.id] for end in ends if end is not None}
        return ends if shafts and (None in ends or len(shafts) == 2) else None

    def pair(self, stage: Component) -> dict[str, Any]:
        """Table of a cylindrical stage."""
        table: dict[str, Any] = {"name": self.name(stage), "shafts": [], "positions": []}
        for gear, shaft in self.members[stage.id].values():
            assert gear is not None and shaft is not None
            table["shafts"].append(self.name(shaft))
            table["positions"].append(self.position(shaft, self.gear_height(gear)))
        return table | {"teeth": self._teeth(stage)}

    def _teeth(self, stage: Component) -> dict[str, Any]:
        """Tables of the teeth of a stage, without its supports and load cases, which the gearbox has."""
        tables = {key: value for key, value in self.teeth[stage.id].items() if key not in _OF_GEARBOX}
        for name in ("gear_1", "gear_2", "sun", "carrier", "ring"):
            if name in tables:
                tables[name] = {key: value for key, value in tables[name].items() if key not in _SUPPORTS}
        operation = {key: value for key, value in tables["operation"].items() if key != "load_case"}
        return {key: value for key, value in (tables | {"operation": operation}).items() if value != {}}

    def planetary(self, stage: Component) -> dict[str, Any]:
        """Table of a planetary stage."""
        members, table = self.members[stage.id], dict[str, Any]()
        table["name"] = self.name(stage)
        for name, (_, shaft) in members.items():
            table[name] = CASING if shaft is None else self.name(shaft)
        for name, (gear, shaft) in members.items():
            if shaft is not None:
                height = self.planet_height(stage) if gear is None else self.gear_height(gear)
                table[f"{name}_position"] = self.position(shaft, height)
        turned = [
            self.model.number(mesh, _ANGLE_KEY, ANGLE)
            for mesh, pair in self._meshes(stage)
            if pair[1].type != "ring_gear"
        ]
        teeth = self._teeth(stage)
        if turned and turned[0] is not None:
            table["angle"] = with_unit((0.5 * math.pi - turned[0]) % math.tau, ANGLE)
            angles_given = [angle for angle in turned if angle is not None]
            if "planet_angles" in teeth["set"] and len(angles_given) == len(turned):
                # around -u they count the other way than around z
                angles = sorted((turned[0] - angle) % math.tau for angle in angles_given)
                teeth["set"] = teeth["set"] | {"planet_angles": [with_unit(angle, ANGLE) for angle in angles]}
        if pins := self._pins(stage):
            table["pins"] = pins
        if self._side_plates(stage):
            # its mass is that of the parts of its shaft
            teeth["carrier"] = {"mass": "0.001 kg", "inertia": "1e-6 kg m^2"}
        return table | {"teeth": teeth}

    def _pins(self, stage: Component) -> dict[str, Any]:
        """Pins of the planets, where the file has their sections and the couplings that hold them."""
        pins = self.model.related("planet_pin", "shaft", planetary_stage=stage.id)
        if not pins:
            return {}
        sections = file_pieces(self.model, pins[0], 0.0)
        joints = [coupling for coupling in self.couplings if pins[0].id in self._ends(coupling)]
        places = sorted(self.at(joint, "u_coordinate_on_shaft_inner_side") for joint in joints)
        if not sections or len(places) != 2:
            return {}
        held = [self.model.number(joint, "length", LENGTH) or 0.0 for joint in joints]
        free = places[1] - places[0] - 0.5 * sum(held)
        outer, inner = sections[0].outer[0], sections[0].inner[0]
        table: dict[str, Any] = {"diameter": with_unit(outer, LENGTH), "length": with_unit(0.5 * free, LENGTH)}
        return table | ({"bore": with_unit(inner, LENGTH)} if inner else {}) if free > 0.0 else {}

    def load_tables(self, added: Mapping[str, str]) -> list[dict[str, Any]]:
        """Tables of the loads of the file, and of those that it lacks at the right ends of shafts."""
        rows = [
            {
                "name": self.name(part),
                "shaft": self.name(shaft),
                "position": self.position(shaft, self.load_height(part)),
            }
            for part, shaft in self.loads
        ]
        for name, shaft in added.items():
            end = self.pieces[shaft][-1].end if self.pieces[shaft] else self.start(shaft)
            rows.append({"name": name, "shaft": self.name(shaft), "position": self.position(shaft, end)})
        return rows

    def operation(self, wanted: int | None) -> tuple[dict[str, Any], dict[str, str]]:
        """Table of load cases, and shafts of loads that the file lacks by their names."""
        stages = [[shaft for _, shaft in member.values()] for member in self.members.values()]
        ends = [pair for joint in self.couplings if (pair := self._joined(joint)) is not None]
        shafts = [[self.main[end.id] for end in pair if end is not None] for pair in ends]
        joints, held = ([shaft for shaft in shafts if len(shaft) == count] for count in (2, 1))
        groups = shaft_groups(self.shafts, stages, joints, [shaft for (shaft,) in held])
        reader = OperationReader(
            self.model,
            groups,
            self.components,
            {self.name(part): (part, shaft) for part, shaft in self.loads},
            {shaft: self.name(shaft) for shaft in self.shafts},
        )
        return reader.tables(wanted)


def _part_names(model: Model) -> dict[str, str]:
    """Names of all parts in a case: their own where a case can have it and no other part has, else kind and id."""
    kinds = {"shaft": "shaft", "external_load": "load"}
    parts = [
        part
        for part in model.components.values()
        if part.type in kinds or part.type.endswith(("coupling", "_stage")) or _is_whole(part)
    ]
    plain, count = plain_ids([part.id for part in model.components.values()]), Counter(part.name for part in parts)
    names_given = {
        part.id: part.name
        for part in parts
        if count[part.name] == 1 and part.name != CASING and _NAME.fullmatch(part.name)
    }
    names = {}
    for part in parts:
        word = "bearing" if _is_whole(part) else "coupling" if part.type.endswith("coupling") else "stage"
        names[part.id] = f"{kinds.get(part.type, word)} {plain[part.id]}"
    made = {name for id, name in names.items() if id not in names_given}
    return names | {id: name for id, name in names_given.items() if name not in made}


def _is_whole(part: Component) -> bool:
    """Whether a part is a bearing, and none of its rows."""
    return is_bearing(part) and part.type != "rolling_bearing_row"


def _side(outer: bool) -> str:
    return f"u_coordinate_on_shaft_{'outer' if outer else 'inner'}_side"


def _length(value: float) -> str:
    """Length as a case has it; what is nothing but rounding is zero."""
    return with_unit(0.0 if abs(value) < 1e-12 else value, LENGTH)


def _extension(piece: Piece, start: float, end: float) -> Piece:
    outer, inner = piece.at(piece.start if end <= piece.start + _EDGE else piece.end)
    return Piece(start, end, (outer, outer), (inner, inner))
