"""A whole REXS gear unit of shafts and cylindrical stages as the tables of a gearbox case.

Shafts lie where the centre distances and angles of the stages put them, with z along the u axis of the file; along
it the middles of two gears in mesh face each other. Places of gears on their shafts are their middles, in format 1.0
their left faces. What the file has no word of and what results hang on is told first.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from femgear.case.estimates import SUPPORT_SHARE, USUAL_STIFFNESS
from femgear.case.quantities import (
    ANGLE,
    DENSITY,
    LENGTH,
    MODULUS,
    SPEED,
    STIFFNESS,
    TORQUE,
    TORSION,
    Dimension,
    to_si,
)
from femgear.exchange.gear_unit import POWER, gears_of, plain_ids, shaft_of, stage_components, unit_flow, with_load_case
from femgear.exchange.planetary_stage import is_bearing, with_unit
from femgear.exchange.rexs import Component, Model
from femgear.findings import DOUBT

FORCE = Dimension("a force", "N", "N", 1.0)
_ANGLE_KEY = "rotating_angle_around_neg_u_axis"
_SOFT, _STIFF_TILT = 1e15, 1e11
"""Stiffnesses that are rigid [N/m, N m/rad]."""
_SAME = 1e-7
_THRUST = {"both_directions": (1, -1), "positive": (1,), "negative": (-1,), "no_direction": ()}
# Of bearings whose bore and outer diameter alone are known: diameters of the elements over (D - d), and how much of the
# pitch circle they fill.
_BALL, _BALL_FILL, _ROLLER, _ROLLER_FILL = 0.305, 0.62, 0.25, 0.82


def gearbox_tables(
    model: Model, pairs: Mapping[str, dict[str, Any]], load_case: int | None = None
) -> tuple[dict[str, Any], dict[str, str]]:
    """Make the tables of a gearbox, with remarks by key on what is assumed.

    Parameters
    ----------
    model : Model
        The unit.
    pairs : mapping of str to dict
        Tables of the pair case of every stage by its id.
    load_case : int, optional
        Number of the load case that contact, modes and pictures are of; by default the first.

    Raises
    ------
    NoGearbox
        The unit has other stages, shafts without sections, or no speed or torque.
    """
    stages = stage_components(model)
    if not stages or any(stage.id not in pairs for stage in stages):
        raise NoGearbox("a gearbox is written of units whose stages are all pairs that became cases")
    unit = _Unit(model, stages, pairs)
    tables: dict[str, Any] = {"format": 1, "model": "gearbox", "title": _title(model, stages)}
    tables["shaft"] = [unit.shaft(shaft) for shaft in unit.shafts]
    tables["bearing"] = [unit.bearing(part, number) for number, part in enumerate(unit.bearings)]
    tables["pair"] = [unit.pair(stage, number) for number, stage in enumerate(stages)]
    tables["load"] = [unit.load(part) for part in unit.loads]
    tables["operation"] = unit.operation(load_case)
    tables["load"] += [] if unit.extra is None else [unit.extra]
    weighs = any(
        model.text(part, "EIGENGEWICHT") == "true" for part in model.components.values() if part.type == "gear_unit"
    )
    if weighs:
        tables["gravity"] = {}
    return tables, unit.remarks


def _title(model: Model, stages) -> str:
    teeth = []
    for stage in stages:
        numbers = [abs(model.number(gear, "number_of_teeth") or 0.0) for gear in gears_of(model, stage)]
        teeth.append("/".join(f"{number:g}" for number in numbers))
    return f"Gear unit of {len(stages)} stages, {', '.join(teeth)}"


class NoGearbox(Exception):
    """Why a unit makes no gearbox, in words."""


class _Unit:
    """Shafts, bearings, loads and stages of a unit, and where they are."""

    def __init__(self, model: Model, stages: list[Component], pairs: Mapping[str, dict[str, Any]]):
        self.model, self.stages, self.pairs = model, stages, pairs
        self.remarks: dict[str, str] = {}
        self.gears = {gear.id: (gear, stage) for stage in stages for gear in gears_of(model, stage)}
        self.on = {id: shaft for id, (gear, _) in self.gears.items() if (shaft := shaft_of(model, gear)) is not None}
        if len(self.on) != len(self.gears):
            raise NoGearbox("a gear has no shaft")
        used = {shaft.id for shaft in self.on.values()}
        self.shafts = [part for part in model.components.values() if part.type == "shaft" and part.id in used]
        self.first: dict[str, float] = {}
        self.extra: dict[str, Any] | None = None
        names = plain_ids([part.id for part in model.components.values()])
        self.name = {id: f"{_WORDS.get(model.components[id].type, 'bearing')} {plain}" for id, plain in names.items()}
        self.parts = {
            shaft.id: model.related(("assembly", "ordered_assembly"), "part", assembly=shaft.id)
            for shaft in self.shafts
        }
        self.bearings = [
            part
            for part in model.components.values()
            if is_bearing(part) and part.type != "rolling_bearing_row" and self._sides(part)[0] is not None
        ]
        self.loads = [part for shaft in self.shafts for part in self.parts[shaft.id] if part.type == "external_load"]
        self.place = self._places()

    def _sides(self, part: Component) -> tuple[Component | None, Component | None]:
        """Shaft inside and shaft outside a bearing; None is the casing, or a part that is not taken."""
        inner, outer = (
            next(iter(self.model.related("side", role, assembly=part.id)), None)
            for role in ("inner_part", "outer_part")
        )
        known = {shaft.id for shaft in self.shafts}
        return (inner if inner is not None and inner.id in known else None), (
            outer if outer is not None and outer.id in known else None
        )

    def at(self, part: Component, key: str = "u_coordinate_on_shaft") -> float:
        """Place of a part on its shaft [m], of a gear its middle."""
        place = self.model.number(part, key, LENGTH) or 0.0
        if part.id in self.gears and self.model.version.startswith("1.0"):
            place += 0.5 * (self.model.number(part, "face_width", LENGTH) or 0.0)
        return place

    def _places(self) -> dict[str, tuple[float, float, float]]:
        """Axis and left end (x, y, z) of every shaft [m], the first one at the origin."""
        place = {self.shafts[0].id: (0.0, 0.0, 0.0)}
        ways: list[tuple[str, str, tuple[float, float, float]]] = []
        for stage in self.stages:
            first, second = gears_of(self.model, stage)
            pair = self.pairs[stage.id]
            distance = to_si(pair["set"]["centre_distance"], LENGTH) if "centre_distance" in pair["set"] else None
            if distance is None:
                distance = self.model.number(stage, "center_distance", LENGTH)
            if distance is None:
                raise NoGearbox(f"{stage} has no centre distance")
            angle = -(self.model.number(stage, _ANGLE_KEY, ANGLE) or 0.0)
            # the table of the pair may have both gears the other way round
            along = self.at(first) - self.at(second)
            way = (distance * math.cos(angle), distance * math.sin(angle), along)
            ways.append((self.on[first.id].id, self.on[second.id].id, way))
        for part in self.bearings:
            inner, outer = self._sides(part)
            if inner is not None and outer is not None:
                keys = ("u_coordinate_on_shaft_inner_side", "u_coordinate_on_shaft_outer_side")
                along = self.at(part, keys[0]) - self.at(part, keys[1])
                ways.append((inner.id, outer.id, (0.0, 0.0, along)))
        for _ in self.shafts:
            for first, second, way in ways:
                if first in place and second not in place:
                    place[second] = tuple(a + b for a, b in zip(place[first], way))  # type: ignore[assignment]
                elif second in place and first not in place:
                    place[first] = tuple(a - b for a, b in zip(place[second], way))  # type: ignore[assignment]
        if len(place) < len(self.shafts):
            raise NoGearbox("stages do not join all shafts")
        return place

    def shaft(self, shaft: Component) -> dict[str, Any]:
        sections = sorted(
            (part for part in self.parts[shaft.id] if part.type == "shaft_section"),
            key=lambda part: self.model.number(part, "u_coordinate_on_shaft", LENGTH) or 0.0,
        )
        if not sections:
            raise NoGearbox(f"{shaft} has no sections")
        x, y, z = self.place[shaft.id]
        first = self.model.number(sections[0], "u_coordinate_on_shaft", LENGTH) or 0.0
        self.first[shaft.id] = first
        table: dict[str, Any] = {"name": self.name[shaft.id], "axis": [with_unit(x, LENGTH), with_unit(y, LENGTH)]}
        table["start"] = with_unit(z + first, LENGTH)
        table["part"] = [self._section(part) for part in sections]
        for made in self.model.related("reference", "referenced", origin=shaft.id)[:1]:
            modulus = self.model.number(made, "elastic_modulus", MODULUS)
            density = self.model.number(made, "density", DENSITY)
            ratio = self.model.number(made, "poisson_ratio")
            values = {"youngs_modulus": modulus and with_unit(modulus, MODULUS), "poisson_ratio": ratio}
            values["density"] = density and with_unit(density, DENSITY)
            table["material"] = {key: value for key, value in values.items() if value is not None}
        return table

    def _section(self, part: Component) -> dict[str, Any]:
        keys = ("length", "outer_diameter_begin", "outer_diameter_end", "inner_diameter_begin", "inner_diameter_end")
        length, begin, end, inner, inside = (self.model.number(part, key, LENGTH) for key in keys)
        if not length or not begin:
            self.model.refuse("a section without length and diameter", str(part))
        table = {"length": with_unit(length, LENGTH), "outer_diameter": with_unit(begin, LENGTH)}
        if inner:
            table["inner_diameter"] = with_unit(inner, LENGTH)
        if end and abs(end - begin) > _SAME:
            table["end_outer_diameter"] = with_unit(end, LENGTH)
        if inside is not None and abs(inside - (inner or 0.0)) > _SAME:
            table["end_inner_diameter"] = with_unit(inside, LENGTH)
        return table

    def _on_shaft(self, part: Component, shaft: Component, key: str = "u_coordinate_on_shaft") -> str:
        return with_unit(self.at(part, key) - self.first[shaft.id], LENGTH)

    def bearing(self, part: Component, number: int) -> dict[str, Any]:
        inner, outer = self._sides(part)
        assert inner is not None
        table: dict[str, Any] = {"name": self.name[part.id], "shaft": self.name[inner.id]}
        table["position"] = self._on_shaft(part, inner, "u_coordinate_on_shaft_inner_side")
        if outer is not None:
            table["outer_shaft"] = self.name[outer.id]
            table["outer_position"] = self._on_shaft(part, outer, "u_coordinate_on_shaft_outer_side")
        key, model = f"bearing[{number}]", self.model
        radial = model.number(part, "radial_stiffness", STIFFNESS)
        tilt = model.number(part, "bending_stiffness", TORSION)
        axial = model.number(part, "axial_stiffness", STIFFNESS)
        senses = _THRUST.get(model.text(part, "axial_force_absorption") or "both_directions", (1, -1))
        bore, outside = (model.number(part, name, LENGTH) for name in ("inner_diameter", "outer_diameter"))
        kind = model.text(part, "bearing_type") or ""
        if (not radial or radial > _SOFT) and bore and outside and ("ball" in kind or "roller" in kind):
            table |= self._assumed(part, key, bore, outside, ball="ball" in kind)
            if senses and "ball" not in kind:
                table |= {"kind": "ball"} | self._assumed(part, key, bore, outside, ball=True)
            table |= self._ratings(part)
            table["estimated"] = True
            what = "rigid in the file" if radial else "without a stiffness in the file"
            text = f"{part} is {what}: {table['kind']} of assumed size from {1e3 * bore:g} and {1e3 * outside:g} mm"
            remedy = "misalignment rests on it: give the numbers of its catalogue"
            model.remark(key, text, remedy=remedy, severity=DOUBT)
            return table
        if radial and radial <= _SOFT:
            table["radial"] = with_unit(radial, STIFFNESS)
        elif (model.text(part, "radial_force_absorption") or "true") == "true":
            table["radial"] = with_unit(self._usual(inner), STIFFNESS)
            table["estimated"] = True
            self.remarks[f"{key}.radial"] = "assumed: the file has none"
            text = f"{part} has neither stiffness nor sizes: its stiffness is assumed"
            model.remark(key, text, remedy="misalignment rests on it: give stiffness or sizes", severity=DOUBT)
        if senses:
            stiff = axial if axial and axial <= _SOFT else self._usual(inner)
            table["axial"] = with_unit(stiff, STIFFNESS)
            if len(senses) == 1:
                table["axial_sense"] = "positive" if senses[0] > 0 else "negative"
        if tilt and tilt > _STIFF_TILT:
            table["tilt"] = "rigid"
            text = f"{part} holds the shaft upright with {tilt:.3g} N m/rad: taken as rigid, it decides misalignment"
            model.remark(f"{key}.tilt", text, remedy="leave tilt out where the bearing gives way", severity=DOUBT)
        elif tilt:
            table["tilt"] = with_unit(tilt, TORSION)
        return table

    def _usual(self, shaft: Component) -> float:
        """Estimated stiffness of a bearing [N/m], from the widest gear of its shaft."""
        widths = [
            self.model.number(gear, "face_width", LENGTH) or 0.0
            for id, (gear, _) in self.gears.items()
            if self.on[id].id == shaft.id
        ]
        return float(f"{SUPPORT_SHARE * USUAL_STIFFNESS * max(widths):.3g}")

    def _assumed(self, part: Component, key: str, bore: float, outside: float, *, ball: bool) -> dict[str, Any]:
        """Elements of a bearing of which bore and outer diameter are known [m]."""
        share, fill = (_BALL, _BALL_FILL) if ball else (_ROLLER, _ROLLER_FILL)
        size, pitch = share * (outside - bore), 0.5 * (outside + bore)
        count = max(6, math.floor(fill * math.pi * pitch / size))
        table: dict[str, Any] = {"kind": "ball" if ball else "cylindrical", "rolling_elements": count}
        table |= {"element_diameter": with_unit(size, LENGTH), "pitch_diameter": with_unit(pitch, LENGTH)}
        for name in ("rolling_elements", "element_diameter"):
            self.remarks[f"{key}.{name}"] = "assumed from bore and outer diameter"
        if not ball:
            width = self.model.number(part, "width", LENGTH) or size
            table["effective_length"] = with_unit(min(0.6 * width, 1.2 * size), LENGTH)
            self.remarks[f"{key}.effective_length"] = "assumed"
        return table

    def _ratings(self, part: Component) -> dict[str, Any]:
        names = {"dynamic_rating": "dynamic_capacity", "static_rating": "static_capacity"}
        names["fatigue_limit"] = "fatigue_limit_load"
        found = {key: self.model.number(part, name, FORCE) for key, name in names.items()}
        return {key: with_unit(value, FORCE) for key, value in found.items() if value}

    def pair(self, stage: Component, number: int) -> dict[str, Any]:
        gears = gears_of(self.model, stage)
        shafts = [self.on[gear.id] for gear in gears]
        table: dict[str, Any] = {"name": f"stage {plain_ids([stage.id])[stage.id]}"}
        table["shafts"] = [self.name[shaft.id] for shaft in shafts]
        table["positions"] = [self._on_shaft(gear, shaft) for gear, shaft in zip(gears, shafts, strict=True)]
        teeth = {key: value for key, value in self.pairs[stage.id].items() if key not in ("dynamics", "runup")}
        for name in ("gear_1", "gear_2"):
            own = dict(teeth[name])
            own.pop("bearing_stiffness", None)
            teeth[name] = own
        table["teeth"] = teeth
        return table

    def load(self, part: Component) -> dict[str, Any]:
        shaft = next(shaft for shaft in self.shafts if part in self.parts[shaft.id])
        position = self._on_shaft(part, shaft)
        return {"name": self.name[part.id], "shaft": self.name[shaft.id], "position": position}

    def operation(self, wanted: int | None) -> dict[str, Any]:
        """Torques, forces and speeds of all load cases."""
        number, _ = self.model.chosen_case(wanted)
        cases = self.model.load_cases or ({},)
        found: list[dict[str, Any]] = []
        output, self.extra = self._output(cases[0], unit_flow(self.model, cases[0]))
        for place, given in enumerate(cases):
            flow = unit_flow(self.model, given)
            torque, force, moment = {}, {}, {}
            for part in self.loads:
                load = with_load_case(part, given)
                value = self._torque(part, given, flow)
                if value and self.name[part.id] != output:
                    torque[self.name[part.id]] = with_unit(value, TORQUE)
                forces = [self.model.number(load, f"force_{way}_direction", FORCE) or 0.0 for way in "vwu"]
                if any(forces):
                    force[self.name[part.id]] = [with_unit(one, FORCE) for one in forces]
                moments = [self.model.number(load, f"torque_around_{way}_axis", TORQUE) or 0.0 for way in "vw"]
                if any(moments):
                    moment[self.name[part.id]] = [with_unit(one, TORQUE) for one in moments]
            table: dict[str, Any] = {
                "name": f"load case {place + 1}",
                "torque": torque,
                "speed": self._speed(flow, given),
            }
            table |= {key: value for key, value in (("force", force), ("tilting_moment", moment)) if value}
            if (share := self._share(given)) is not None:
                table["share"] = share
            if not torque or not table["speed"]:
                raise NoGearbox(f"load case {place + 1} has no torque or no speed")
            found.append(table)
        return {"output": [output], "first": number, "load_case": found}

    def _torque(self, part: Component, given, flow) -> float | None:
        """Torque of a load [N m], from its power where that is what the file says."""
        load = with_load_case(part, given)
        torque = self.model.number(load, "torque_around_u_axis", TORQUE)
        power = self.model.number(load, "power", POWER)
        shaft = next(shaft for shaft in self.shafts if part in self.parts[shaft.id])
        speed = flow.speed.get(shaft.id)
        return power / speed if power is not None and speed and not torque else torque

    def _output(self, given, flow) -> tuple[str, dict[str, Any] | None]:
        """Name of the load that takes the power, and its table where the file has none.

        It is the load that says no torque, else one at the end of a shaft of one gear without a load, else the last.
        """
        said = {part.id: self._torque(part, given, flow) for part in self.loads}
        if not any(said.values()):
            raise NoGearbox("no load gives a torque")
        transmits = {part.id: (self.model.text(part, "transmits_torque") or "true") == "true" for part in self.loads}
        silent = [id for id, torque in said.items() if not torque and transmits[id]]
        if silent:
            return self.name[silent[-1]], None
        loaded = {shaft.id for shaft in self.shafts for part in self.loads if part in self.parts[shaft.id]}
        for shaft in self.shafts:
            if shaft.id not in loaded and [one.id for one in self.on.values()].count(shaft.id) == 1:
                length = sum(to_si(part["length"], LENGTH) for part in self.shaft(shaft)["part"])
                table = {"name": "output", "shaft": self.name[shaft.id], "position": with_unit(length, LENGTH)}
                self.model.remark("load", f"the file has no load on {shaft}: its right end takes the power")
                return "output", table
        return self.name[self.loads[-1].id], None

    def _speed(self, flow, given) -> dict[str, str]:
        """Speed of the shaft that says it, else of the first one that is known."""
        for shaft in self.shafts:
            if (speed := self.model.number(with_load_case(shaft, given), "rotational_speed", SPEED)) is not None:
                return {self.name[shaft.id]: with_unit(speed, SPEED)}
        known = next((shaft for shaft in self.shafts if flow.speed.get(shaft.id)), None)
        return {} if known is None else {self.name[known.id]: with_unit(flow.speed[known.id], SPEED)}

    def _share(self, given) -> float | None:
        for attributes in given.values():
            value, unit = attributes.get("load_duration_fraction", (None, None))
            if value is not None:
                return float(f"{float(value) * (0.01 if unit == '%' else 1.0):.12g}")
        return None


_WORDS = {"shaft": "shaft", "external_load": "load", "cylindrical_gear": "gear"}
