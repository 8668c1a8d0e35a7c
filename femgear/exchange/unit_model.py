"""A gearbox case as a REXS model of version 1.4: shafts, bearings, couplings, stages, loads and load cases.

The axes u, v, w of the unit are z, x, y of the case. A stage turns from w towards v by its angle around -u.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from femgear.case.gear_set import planetary_set
from femgear.case.load_spectrum import running_shares
from femgear.case.quantities import SPEED
from femgear.errors import CaseError
from femgear.exchange.gear_strength import written_strength
from femgear.exchange.planetary_stage import ModelWriter, add_gear, add_planets, rexs_attribute
from femgear.exchange.rexs import Model
from femgear.exchange.unit_spectrum import load_duration, tell_life_left_out
from femgear.findings import NOTE

_CASING = "casing"
_RIGID, _RIGID_TILT = 1e20, 1e17
"""Stiffnesses of what is rigid, as other programs write them [N/m, N m/rad]."""
_TYPES = {
    "ball": "radial_grooved_ball_bearing",
    "cylindrical": "radial_roller_bearing",
    "needle": "radial_needle_roller_bearing",
    "tapered": "radial_tapered_roller_bearing",
    "spherical": "radial_spherical_roller_bearing",
}
_YES, _NO = ("true", "none"), ("false", "none")
Attributes = dict[str, tuple[str, str]]


def unit_model(case: Any, teeth: Mapping[str, Any], name: str) -> Model:
    """Write a gearbox case as a REXS model.

    `Model.findings` holds what REXS has no form for.

    Parameters
    ----------
    case : GearboxCase
        The gearbox.
    teeth : mapping of str to Case or PairCase
        Cases of the teeth of its stages by their names.
    name : str
        Of the file, for messages.

    Raises
    ------
    CaseError
        E-KEY-MISSING: a stage without teeth.
    """
    writer = _UnitWriter(case, teeth, name)
    for shaft in case.shaft:
        writer.shaft(shaft)
    for number, bearing in enumerate(case.bearing):
        writer.bearing(bearing, number)
    for number, coupling in enumerate(case.coupling):
        writer.coupling(coupling, number)
    for number, stage in enumerate(case.pair):
        if stage.carrier is not None:
            raise CaseError(
                "pairs on a carrier are no stages of REXS",
                code="E-REXS",
                key=f"pair[{number}].carrier",
                value=stage.carrier,
                limit="pairs without a carrier, and [[planetary]] sets",
                remedy="write the sets of this gearbox as [[planetary]], where they are sun, planets and ring",
            )
        writer.pair(stage, f"pair[{number}]")
    for number, stage in enumerate(case.planetary):
        writer.planetary(stage, f"planetary[{number}]")
    loads = {load.name: writer.load(load) for load in case.load}
    for body in (shaft for shaft in case.shaft if not shaft.part):
        if (
            any(body.name in load_case.torque for load_case in case.operation.load_case)
            or body.name in case.operation.output
        ):
            loads[body.name] = writer.add_on(body.name, "external_load", f"load of {body.name}", None)
    for shaft in case.operation.fixed:
        joint = writer.w.add("coupling", f"{shaft} held")
        writer.w.relate("side", assembly=joint, inner_part=writer.shafts[shaft], outer_part=writer.casing)
    writer.left_out()
    shares = running_shares(case.operation.load_case).tolist()
    cases = tuple(
        writer.load_case(load_case, loads, share)
        for load_case, share in zip(case.operation.load_case, shares, strict=True)
    )
    return replace(writer.model, relations=tuple(writer.w.relations), load_cases=cases)


def _stiffness(value: float | None, unit: str) -> tuple[str, str] | None:
    """Stiffness of a case in a unit of REXS; none of zero."""
    if not value:
        return None
    rigid = _RIGID if unit == "N / m" else _RIGID_TILT
    return rexs_attribute(min(value, rigid), unit)


class _UnitWriter:
    """Components and relations of a unit, shaft after shaft."""

    def __init__(self, case: Any, teeth: Mapping[str, Any], name: str):
        self.case, self.teeth, self.w = case, teeth, ModelWriter()
        gravity, a = case.gravity, rexs_attribute
        weight: dict[str, tuple[str, str] | None] = {"account_for_gravity": _NO}
        if gravity is not None:
            weight = {
                "account_for_gravity": _YES,
                "gravitational_acceleration": a(gravity.acceleration, "m / s^2"),
                **{f"direction_vector_gravity_{way}": a(gravity.direction[i]) for way, i in zip("uvw", (2, 0, 1))},
            }
        self.unit, self.casing = self.w.add("gear_unit", case.title, **weight), self.w.add("gear_casing", _CASING)
        self.w.relate("assembly", assembly=self.unit, part=self.casing)
        self.model = Model(name, "1.4", self.w.components, (), ())
        self.shafts: dict[str, str] = {}
        self.made: dict[tuple[float, ...], str] = {}

    def set(self, id: str, **attributes: tuple[str, str] | None) -> None:
        """Give a component more attributes."""
        part = self.w.components[id]
        given = {key: value for key, value in attributes.items() if value is not None}
        self.w.components[id] = replace(part, attributes={**part.attributes, **given})

    def put_at(self, id: str, place: tuple[float, ...]) -> None:
        """Give a component its place (u, v, w) in the unit [m], and axes along those of the unit."""
        vectors = {
            "u_axis_vector": ((1.0, 0.0, 0.0), "mm"),
            "w_axis_vector": ((0.0, 0.0, 1.0), "mm"),
            "support_vector": (tuple(float(f"{1e3 * coordinate:.12g}") for coordinate in place), "mm"),
        }
        reference = {"reference_component_for_position": (self.unit, "none")}
        part = self.w.components[id]
        self.w.components[id] = replace(part, attributes={**part.attributes, **reference}, vectors=vectors)

    def add_on(self, shaft: str, type: str, name: str, position: float | None, **more: tuple[str, str] | None) -> str:
        """Add a part of a shaft at a position [m]; its id."""
        id = self.w.add(type, name, u_coordinate_on_shaft=rexs_attribute(position or 0.0, "mm"), **more)
        self.w.relate("assembly", assembly=self.shafts[shaft], part=id)
        return id

    def shaft(self, shaft: Any) -> None:
        """Add a shaft with its sections and its material."""
        a = rexs_attribute
        self.shafts[shaft.name] = id = self.w.add("shaft", shaft.name)
        self.put_at(id, (shaft.start, *shaft.axis))
        self.w.relate("assembly", assembly=self.unit, part=id)
        for place, part in zip(shaft.places, shaft.part, strict=False):
            self.add_on(
                shaft.name,
                "shaft_section",
                "",
                place,
                length=a(part.length, "mm"),
                outer_diameter_begin=a(part.outer_diameter, "mm"),
                outer_diameter_end=a(part.end_outer_diameter or part.outer_diameter, "mm"),
                inner_diameter_begin=a(part.inner_diameter, "mm"),
                inner_diameter_end=a(part.bore_at_end, "mm"),
            )
        material = self.case.material_of(shaft)
        values = material.youngs_modulus, material.poisson_ratio, material.density
        if values not in self.made:
            self.made[values] = self.w.add(
                "material",
                elastic_modulus=a(material.youngs_modulus, "N / mm^2"),
                density=a(material.density, "kg / dm^3"),
                poisson_ratio=a(material.poisson_ratio),
            )
        self.w.relate("reference", origin=id, referenced=self.made[values])

    def bearing(self, bearing: Any, number: int) -> None:
        """Add a bearing by its stiffness or its geometry."""
        a = rexs_attribute
        where = bearing.position or 0.0
        outer = bearing.outer_position
        absorbed = bearing.axial_sense or ("both_directions" if self._takes_thrust(bearing) else "no_direction")
        more = {
            "u_coordinate_on_shaft_inner_side": a(where, "mm"),
            "u_coordinate_on_shaft_outer_side": a(where if outer is None else outer, "mm"),
            "axial_force_absorption": (absorbed, "none"),
            "radial_force_absorption": _YES if bearing.kind or bearing.radial else _NO,
            "dynamic_capacity": a(bearing.dynamic_rating, "kN"),
            "static_capacity": a(bearing.static_rating, "kN"),
            "fatigue_limit_load": a(bearing.fatigue_limit, "kN"),
        }
        name = bearing.name or f"bearing {number + 1}"
        if bearing.kind is None:
            id = self.w.add(
                "concept_bearing",
                name,
                radial_stiffness=_stiffness(bearing.radial, "N / m"),
                axial_stiffness=_stiffness(bearing.axial, "N / m"),
                bending_stiffness=_stiffness(bearing.tilt, "N mm / rad"),
                **more,
            )
        else:
            id = self._rolling(bearing, name, more)
        sides = {"inner_part": self.shafts[bearing.shaft]}
        sides["outer_part"] = self.casing if bearing.outer_shaft is None else self.shafts[bearing.outer_shaft]
        self.w.relate("side", assembly=id, **sides)

    @staticmethod
    def _takes_thrust(bearing: Any) -> bool:
        return bool(bearing.axial) if bearing.kind is None else bearing.kind not in ("cylindrical", "needle")

    def _rolling(self, bearing: Any, name: str, more: Mapping[str, tuple[str, str] | None]) -> str:
        """Add a rolling bearing with its rows, each of one element that stands for all; its id."""
        a, size = rexs_attribute, bearing.element_diameter
        id = self.w.add(
            "rolling_bearing_with_detailed_geometry",
            name,
            bearing_type=(_TYPES[bearing.kind], "none"),
            number_of_bearing_rows=a(bearing.rows),
            distance_between_bearing_rows=a(bearing.row_distance, "mm"),
            radial_bearing_clearance=a(bearing.clearance, "mum"),
            preload_distance=a(bearing.preload, "mum"),
            **more,
        )
        ball = bearing.kind == "ball"
        for _ in range(bearing.rows):
            row = self.w.add(
                "rolling_bearing_row",
                number_of_rolling_elements=a(bearing.rolling_elements),
                pitch_diameter=a(bearing.pitch_diameter, "mm"),
                pressure_angle=a(bearing.contact_angle, "deg"),
                raceway_radius_of_inner_ring=a(bearing.inner_osculation * size, "mm") if ball else None,
                raceway_radius_of_outer_ring=a(bearing.outer_osculation * size, "mm") if ball else None,
            )
            element = self.w.add(
                "rolling_element",
                diameter_of_rolling_element=a(size, "mm"),
                length_of_rolling_element=a(bearing.effective_length, "mm"),
            )
            self.w.relate("assembly", assembly=id, part=row)
            self.w.relate("assembly", assembly=row, part=element)
        return id

    def coupling(self, coupling: Any, number: int) -> None:
        """Add a coupling between two shafts, or between a shaft and the casing."""
        places = coupling.positions or (None, None)
        stiffness = {
            "rotational_stiffness": _stiffness(coupling.torsion, "N mm / rad"),
            "bending_stiffness": _stiffness(coupling.bending, "N mm / rad"),
            "radial_stiffness": _stiffness(coupling.radial, "N / m"),
            "axial_stiffness": _stiffness(coupling.axial, "N / m"),
        }
        first, second = coupling.between
        inner, outer = (0, 1) if first != _CASING else (1, 0)
        id = self.w.add(
            "coupling",
            coupling.name or f"coupling {number + 1}",
            u_coordinate_on_shaft_inner_side=rexs_attribute(places[inner] or 0.0, "mm"),
            u_coordinate_on_shaft_outer_side=rexs_attribute(places[outer] or 0.0, "mm"),
            **stiffness,
        )
        ids = [self.shafts.get(name, self.casing) for name in (first, second)]
        self.w.relate("side", assembly=id, inner_part=ids[inner], outer_part=ids[outer])
        if not coupling.transmits:
            self.model.remark(f"coupling[{number}].transmits", "REXS has no springs between shafts that turn apart")

    def _teeth(self, stage: Any, key: str) -> Any:
        if stage.name not in self.teeth:
            raise CaseError(
                "REXS holds teeth, not sizes and stiffnesses",
                code="E-KEY-MISSING",
                key=f"{key}.teeth",
                remedy="give the stage the tables of its teeth",
            )
        # teeth of a gearbox are rated as the gearbox says
        return self.teeth[stage.name].model_copy(update={"strength": self.case.strength})

    def pair(self, stage: Any, key: str) -> None:
        """Add two gears and the stage that they make."""
        case, places = self._teeth(stage, key), stage.positions or (0.0, 0.0)
        gears: Any = planetary_set(case)
        ids = [
            add_gear(self.w, case, f"{stage.name} {gear.name}", gear, self.model, self.shafts[shaft], place or 0.0)[0]
            for gear, shaft, place in zip(gears.gears, stage.shafts, places, strict=True)
        ]
        if gears.gear_2.internal:
            text = (
                f"REXS has no outer diameter of the internal gear of {stage.name}: it comes back as that of its shaft"
            )
            self.model.remark(f"{key}.teeth", text)
        first, second = (self.case.shaft_named(shaft).axis for shaft in stage.shafts)
        angle = math.atan2(second[0] - first[0], second[1] - first[1])
        id = self.w.add(
            "cylindrical_stage",
            stage.name,
            center_distance=rexs_attribute(gears.centre_distance, "mm"),
            rotating_angle_around_neg_u_axis=rexs_attribute(angle % math.tau, "deg"),
            application_factor_iso_6336_2019=written_strength(self.case.strength).get(
                "application_factor_iso_6336_2019"
            ),
        )
        self.w.relate("assembly", assembly=self.unit, part=id)
        self.w.relate("stage", stage=id, gear_1=ids[0], gear_2=ids[1])

    def planetary(self, stage: Any, key: str) -> None:
        """Add sun, ring, planets on their pins, and their meshes."""
        case = self._teeth(stage, key)
        gears: Any = planetary_set(case)
        id, carrier = self.w.add("planetary_stage", stage.name), self.w.add("planet_carrier", f"{stage.name} carrier")
        self.w.relate("assembly", assembly=self.unit, part=id)
        self.w.relate("assembly", assembly=id, part=carrier)
        central = []
        for gear in (gears.sun, gears.ring):
            shaft, place = getattr(stage, gear.name), getattr(stage, f"{gear.name}_position")
            on = self.shafts.get(shaft)
            made, on = add_gear(self.w, case, f"{stage.name} {gear.name}", gear, self.model, on, place or 0.0)
            central.append(made)
            self.w.relate("central_shaft", planetary_stage=id, shaft=on)
            if shaft == _CASING:
                held = self.w.add("coupling", f"{stage.name} {gear.name} held")
                self.w.relate("side", assembly=held, inner_part=on, outer_part=self.casing)
        if stage.carrier in self.shafts:
            self.w.relate("planet_carrier_shaft", planetary_stage=id, shaft=self.shafts[stage.carrier])
        psi = gears.planet_angles
        turned = [0.5 * math.pi - (stage.angle + angle - psi[0]) for angle in psi]
        given, radial = stage.planet.bearing, getattr(case.planet, "bearing_stiffness", None)
        bearing = {
            "radial_stiffness": _stiffness(given.radial if given else radial, "N / m"),
            "axial_stiffness": _stiffness(given.axial if given else math.inf, "N / m"),
            "bending_stiffness": _stiffness(given.tilt if given else math.inf, "N mm / rad"),
        }
        add_planets(self.w, case, self.model, id, (central[0], central[1]), turned, bearing)
        if stage.pins is not None:
            self._pins(stage, id, key)

    def _pins(self, stage: Any, id: str, key: str) -> None:
        """Give the pins of a set held in two cheeks their sections, and couplings with the carrier at both ends."""
        pins, a = stage.pins, rexs_attribute
        if stage.carrier_body is not None:
            self.model.remark(f"{key}.carrier_body", "REXS has no elastic carrier: left out")
        carrier = self.shafts.get(stage.carrier)
        if pins.cheeks != 2 or carrier is None:
            self.model.remark(f"{key}.pins", "pins that one cheek holds are left out: they come back rigid")
            return
        shafts = [
            shaft
            for rel in self.w.relations
            if rel.type == "planet_pin"
            for shaft in rel.of("shaft")
            if id in rel.of("planetary_stage")
        ]
        for pin in shafts:
            section = self.w.add(
                "shaft_section",
                "",
                u_coordinate_on_shaft=a(0.0, "mm"),
                length=a(2.0 * pins.length, "mm"),
                **{f"outer_diameter_{end}": a(pins.diameter, "mm") for end in ("begin", "end")},
                **{f"inner_diameter_{end}": a(pins.bore, "mm") for end in ("begin", "end")},
            )
            self.w.relate("assembly", assembly=pin, part=section)
            middle = stage.carrier_position or 0.0
            for side in (0.0, 2.0 * pins.length):
                places = {"inner": side, "outer": middle + side - pins.length}
                joint = self.w.add(
                    "coupling",
                    "",
                    **{f"u_coordinate_on_shaft_{end}_side": a(place, "mm") for end, place in places.items()},
                )
                self.w.relate("side", assembly=joint, inner_part=pin, outer_part=carrier)

    def load(self, load: Any) -> str:
        """Add the place of a load; its id."""
        turns = load.name in self.case.operation.output or any(
            load.name in load_case.torque for load_case in self.case.operation.load_case
        )
        return self.add_on(
            load.shaft, "external_load", load.name, load.position, transmits_torque=_YES if turns else _NO
        )

    def load_case(self, given: Any, loads: Mapping[str, str], share: float) -> dict[str, Attributes]:
        """Write torques, forces, speeds and share of the running time, or hours, of a load case."""
        values_of: dict[str, Attributes] = {self.unit: self._put(**load_duration(given, share))}
        for shaft, speed in given.speed.items():
            values_of[self.shafts[shaft]] = {"rotational_speed": (f"{speed / SPEED.scale:.15g}", "1 / min")}
        fixed = {load.name: load for load in self.case.load}
        for name, id in loads.items():
            always = fixed.get(name)
            force, moment = (given.force.get(name), given.tilting_moment.get(name))
            forces = [sum(pair) for pair in zip(always.force if always else (0.0,) * 3, force or (0.0,) * 3)]
            moments = [sum(pair) for pair in zip(always.tilting_moment if always else (0.0,) * 2, moment or (0.0,) * 2)]
            values = {}
            if name in given.torque:
                values["torque_around_u_axis"] = (given.torque[name], "N m")
            values |= {f"force_{way}_direction": (newtons, "N") for way, newtons in zip("vwu", forces) if newtons}
            values |= {
                f"torque_around_{way}_axis": (newton_metres, "N m")
                for way, newton_metres in zip("vw", moments)
                if newton_metres
            }
            if values:
                values_of[id] = self._put(**values)
        return values_of

    @staticmethod
    def _put(**values: tuple[float, str]) -> Attributes:
        attributes = {key: rexs_attribute(value, unit) for key, (value, unit) in values.items()}
        return {key: value for key, value in attributes.items() if value is not None}

    def left_out(self) -> None:
        """Tell what of the case REXS has no form for."""
        case, tell = self.case, self.model.remark
        tell_life_left_out(case.operation, tell)
        for number, section in enumerate(case.mass):
            text = f"REXS has no mass such as {section.name or section.shaft}: left out, modes change"
            tell(f"mass[{number}]", text, remedy="give it again after import")
        if case.casing is not None:
            text = "REXS has no feet of a casing: left out, the casing comes back as one that stands still"
            tell("casing", text, remedy="give it again after import")
        estimated = [number for number, bearing in enumerate(case.bearing) if bearing.estimated]
        if estimated:
            text = f"{len(estimated)} bearings are estimated, which REXS cannot say: they come back as given"
            tell(f"bearing[{estimated[0]}].estimated", text, severity=NOTE)
        warm = [f"shaft[{number}]" for number, shaft in enumerate(case.shaft) if shaft.temperature_rise]
        warm += ["thermal"] if case.thermal.casing_rise else []
        if warm:
            tell(warm[0], f"temperatures of {', '.join(warm[:6])} are left out", remedy="give them again after import")
        for number, section in enumerate(case.bearing):
            if section.gapped:
                text = "REXS has no clearance of a bearing that is given by its stiffness: left out"
                tell(f"bearing[{number}].clearance", text, remedy="give it again after import")
            if section.torsional:
                tell(f"bearing[{number}].torsional", "REXS has no stiffness of a bearing against rotation: left out")
            if section.viscosity_ratio is not None or section.contamination is not None:
                tell(f"bearing[{number}].viscosity_ratio", "lubrication of bearings is left out", severity=NOTE)
