"""Bearings and couplings of a REXS unit as tables of a gearbox.

A bearing keeps its stiffness, or the geometry of its rolling elements. Files have few of both: many bearings are
rigid there. Where bore and outer diameter are known they get elements of usual size, else a stiffness of usual size;
such bearings are ``estimated``, and told, since the misalignment of teeth rests on them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from femgear.case.quantities import ANGLE, LENGTH, STIFFNESS, TORSION, Dimension
from femgear.exchange.planetary_stage import with_unit
from femgear.exchange.rexs import Component, Model
from femgear.findings import DOUBT, NOTE

FORCE = Dimension("a force", "N", "N", 1.0)
SOFT, STIFF_TILT = 1e15, 1e11
"""Stiffnesses from which on a bearing is rigid [N/m, N m/rad]."""
SENSES = {
    "both_directions": "both",
    "both": "both",
    "positive": "positive",
    "negative": "negative",
    "no_direction": "none",
    "none": "none",
}
"""What thrust on its inner part a bearing takes, by the words of files: those of other words take both."""
_OPPOSITE = {"positive": "negative", "negative": "positive"}
# Of bearings whose bore and outer diameter alone are known: diameters of the elements over (D - d), and how much of the
# pitch circle they fill.
_BALL, _BALL_FILL, _ROLLER, _ROLLER_FILL, _NEEDLE = 0.305, 0.62, 0.25, 0.82, 0.4
# Usual contact angles of tapered and of angular contact ball bearings.
_TAPERED, _ANGULAR = math.radians(14.0), math.radians(40.0)
_CLEARANCES = ("operating_radial_bearing_clearance", "radial_bearing_clearance", "radial_clearance", "radial_backlash")
_RATINGS = {
    "dynamic_rating": ("radial_dynamic_load_rating", "dynamic_capacity"),
    "static_rating": ("radial_static_load_rating", "static_capacity"),
    "fatigue_limit": ("fatigue_limit_load",),
}


def kind_of(text: str) -> str | None:
    """Kind of rolling bearing of a case by the word of a file; None of others."""
    kinds = {"needle": "needle", "taper": "tapered", "spherical": "spherical", "ball": "ball", "roller": "cylindrical"}
    return next((kind for word, kind in kinds.items() if word in text), None)


@dataclass
class BearingReader:
    """Reader of the bearings of a unit, which gathers what is to be told of several at once.

    Parameters
    ----------
    model : Model
        What the file holds.
    remarks : dict of str
        What is assumed, by key of the case.
    bearings_by_remark : dict of list
        Ids of bearings by the text, the remedy and the severity of a remark on them.
    """

    model: Model
    remarks: dict[str, str]
    bearings_by_remark: dict[tuple[str, str, str], list[str]] = field(default_factory=dict)

    def tell(self, part: Component, what: str, remedy: str = "", severity: str = DOUBT) -> None:
        """Keep what is to be told of a bearing; one finding tells it of all."""
        self.bearings_by_remark.setdefault((what, remedy, severity), []).append(part.id)

    def finish(self) -> None:
        """Make the findings of all bearings."""
        for (what, remedy, severity), ids in self.bearings_by_remark.items():
            several = len(ids) > 1
            name = f"bearing{'s' * several} {', '.join(ids)}"
            self.model.remark("bearing", f"{name}: {what}", remedy=remedy, severity=severity)

    def table(self, part: Component, key: str, usual: float, *, turned: bool = False) -> dict[str, Any]:
        """Table of a bearing without its places; ``turned`` where the shaft is its outer part.

        ``usual`` is the stiffness to take where the file has nothing [N/m].
        """
        model = self.model
        sense = SENSES.get(model.text(part, "axial_force_absorption") or "", "both")
        sense = _OPPOSITE.get(sense, sense) if turned else sense
        for name in ("misalignment_in_v_direction", "misalignment_in_w_direction"):
            if model.number(part, name, LENGTH):
                self.tell(part, "offset in the file, which is not taken", "they change misalignment")
        exact = self._elements(part)
        if exact:
            return exact | self._limits(part, exact["kind"], sense)
        radial = model.number(part, "radial_stiffness", STIFFNESS)
        if not radial or radial >= SOFT:
            bore, outside = (model.number(part, name, LENGTH) for name in ("inner_diameter", "outer_diameter"))
            kind = kind_of(model.text(part, "bearing_type") or "")
            if bore and outside and outside > bore and kind is not None:
                return self._assumed(part, key, kind, (bore, outside), sense, rigid=bool(radial))
        return self._springs(part, key, radial, sense, usual)

    def stand_in(self, part: Component, usual: float, why: str, *, turned: bool = False) -> dict[str, Any]:
        """Table of a bearing that cannot be taken: a usual stiffness [N/m], ``estimated``, told before all else."""
        guess, sense = (
            with_unit(usual, STIFFNESS),
            SENSES.get(self.model.text(part, "axial_force_absorption") or "", "both"),
        )
        text = f"{part} is not taken: {why}; a bearing of {guess} stands in its place"
        remedy = "correct it in the file, or give its stiffness, or kind with the geometry, in the case"
        self.model.remark("bearing", text, remedy=remedy, first=True)
        table: dict[str, Any] = {"radial": guess, "estimated": True}
        if sense != "none":
            table["axial"] = guess
        sense = _OPPOSITE.get(sense, sense) if turned else sense
        return table | ({"axial_sense": sense} if sense in _OPPOSITE else {})

    def _springs(self, part: Component, key: str, radial: float | None, sense: str, usual: float) -> dict[str, Any]:
        model, table = self.model, dict[str, Any]()
        tilt, axial = (
            model.number(part, f"{name}_stiffness", of) for name, of in (("bending", TORSION), ("axial", STIFFNESS))
        )
        takes_radial = (model.text(part, "radial_force_absorption") or "true") == "true"
        guess = with_unit(usual, STIFFNESS)
        if radial:
            table["radial"] = "rigid" if radial >= SOFT else with_unit(radial, STIFFNESS)
        elif takes_radial:
            table |= {"radial": guess, "estimated": True}
            self.remarks[f"{key}.radial"] = "assumed: the file has none"
            what = f"neither stiffness nor sizes in the file: {guess} assumed"
            self.tell(part, what, "misalignment rests on it: give stiffness, or kind with its geometry")
        if radial and radial >= SOFT:
            what = "rigid in the file, and taken so; real ones are softer, and misalign more"
            self.tell(part, what, "give their stiffness, or kind with the geometry")
        if sense != "none":
            table["axial"] = with_unit(axial, STIFFNESS) if axial and axial < SOFT else "rigid" if axial else guess
            if sense != "both":
                table["axial_sense"] = sense
            if not axial:
                self.remarks[f"{key}.axial"] = "assumed: the file has none"
        if tilt and tilt >= STIFF_TILT:
            table["tilt"] = "rigid"
            what = f"{tilt:.3g} N m/rad against tilt in the file: taken as rigid, which decides misalignment"
            self.tell(part, what, "leave tilt out where the bearing gives way")
        elif tilt:
            table["tilt"] = with_unit(tilt, TORSION)
        return table

    def _row(self, part: Component) -> list[Component]:
        """The rows of a bearing, and the first rolling element of its first row."""
        kinds = ("assembly", "ordered_assembly")
        rows = [
            component
            for component in self.model.related(kinds, "part", assembly=part.id)
            if component.type == "rolling_bearing_row"
        ]
        elements = [component for row in rows[:1] for component in self.model.related(kinds, "part", assembly=row.id)]
        return [*rows, *[element for element in elements if element.type == "rolling_element"][:1]]

    def _elements(self, part: Component) -> dict[str, Any]:
        """Kind and rolling elements of a bearing whose file has them; empty otherwise."""
        model, parts = self.model, [*self._row(part), part]
        rows = [component for component in parts if component.type == "rolling_bearing_row"]

        def first(name: str, of: Dimension | None = None) -> float | None:
            return next(
                (value for component in parts if (value := model.number(component, name, of)) is not None), None
            )

        kind = kind_of(model.text(part, "bearing_type") or "")
        count, size = first("number_of_rolling_elements"), first("diameter_of_rolling_element", LENGTH)
        pitch = first("pitch_diameter", LENGTH) or first("reference_diameter_rolling_bearing", LENGTH)
        length = first("length_of_rolling_element", LENGTH)
        if kind is None or not count or not size or not pitch or (kind != "ball" and not length):
            return {}
        table: dict[str, Any] = {"kind": kind, "rolling_elements": round(count)}
        table |= {"element_diameter": with_unit(size, LENGTH), "pitch_diameter": with_unit(pitch, LENGTH)}
        if kind != "ball":
            table["effective_length"] = with_unit(length or 0.0, LENGTH)
        else:
            for end in ("inner", "outer"):
                if radius := first(f"raceway_radius_of_{end}_ring", LENGTH):
                    table[f"{end}_osculation"] = float(f"{radius / size:.12g}")
        if angle := first("pressure_angle", ANGLE):
            table["contact_angle"] = with_unit(angle, ANGLE)
        if len(rows) == 2:
            table["rows"] = 2
            table["row_distance"] = with_unit(first("distance_between_bearing_rows", LENGTH) or 0.0, LENGTH)
        return table

    def _limits(self, part: Component, kind: str, sense: str) -> dict[str, Any]:
        """What thrust a bearing takes, its clearance, preload and ratings."""
        model, table = self.model, dict[str, Any]()
        if sense != "both" and kind not in ("cylindrical", "needle"):
            table["axial_sense"] = sense
        plays = (model.number(part, name, LENGTH) for name in _CLEARANCES)
        if clearance := next((given for given in plays if given is not None), 0.0):
            table["clearance"] = with_unit(clearance, LENGTH)
        if preload := model.number(part, "preload_distance", LENGTH):
            table["preload"] = with_unit(preload, LENGTH)
        for key, names in _RATINGS.items():
            values = (model.number(part, name, FORCE) for name in names)
            if value := next((number for number in values if number), None):
                table[key] = with_unit(value, FORCE)
        return table

    def _assumed(
        self, part: Component, key: str, kind: str, rings: tuple[float, float], sense: str, *, rigid: bool
    ) -> dict[str, Any]:
        """Table of a bearing of which kind, bore and outer diameter are known [m]."""
        bore, outside = rings
        thrust = sense != "none"
        if kind == "cylindrical" and thrust:
            # its flanges are stiff, and no case has them: balls take radial force and thrust
            what = "thrust taken by flanges, which no case has: ball bearing in its place"
            self.tell(part, what, severity=NOTE)
            kind = "ball"
        share, fill = (_BALL, _BALL_FILL) if kind == "ball" else (_ROLLER, _ROLLER_FILL)
        size, pitch = (_NEEDLE if kind == "needle" else share) * (outside - bore), 0.5 * (outside + bore)
        count = max(6, math.floor(fill * math.pi * pitch / size))
        table: dict[str, Any] = {"kind": kind, "rolling_elements": count}
        table |= {"element_diameter": with_unit(size, LENGTH), "pitch_diameter": with_unit(pitch, LENGTH)}
        for name in ("rolling_elements", "element_diameter"):
            self.remarks[f"{key}.{name}"] = "assumed from bore and outer diameter"
        if kind != "ball":
            width = self.model.number(part, "width", LENGTH) or size
            longest = 0.8 * width if kind == "needle" else min(0.6 * width, 1.2 * size)
            table["effective_length"] = with_unit(longest, LENGTH)
            self.remarks[f"{key}.effective_length"] = "assumed"
        angular = "angular" in (self.model.text(part, "bearing_type") or "")
        if sense in _OPPOSITE and (kind == "tapered" or (kind == "ball" and angular)):
            angle = _TAPERED if kind == "tapered" else _ANGULAR
            table["contact_angle"] = with_unit(angle if sense == "positive" else -angle, ANGLE)
            self.remarks[f"{key}.contact_angle"], sense = "assumed", "both"
        what = "rigid in the file" if rigid else "no stiffness in the file"
        text = f"{what}: elements of assumed size from bore and outer diameter"
        self.tell(part, text, "misalignment rests on it: give the numbers of their catalogue")
        return table | self._limits(part, kind, sense) | {"estimated": True}


def coupling_table(model: Model, part: Component) -> dict[str, Any]:
    """Stiffnesses of a coupling; without any it turns both sides as one and gives way otherwise."""
    names: Mapping[str, tuple[str, Dimension, float]] = {
        "torsion": ("rotational_stiffness", TORSION, STIFF_TILT),
        "bending": ("bending_stiffness", TORSION, STIFF_TILT),
        "radial": ("radial_stiffness", STIFFNESS, SOFT),
        "axial": ("axial_stiffness", STIFFNESS, SOFT),
    }
    table: dict[str, Any] = {}
    for key, (name, of, most) in names.items():
        if value := model.number(part, name, of):
            table[key] = "rigid" if value >= most else with_unit(value, of)
    return table


def engaged(model: Model, part: Component) -> bool:
    """Whether a coupling joins: a switchable one that is said not to, in the first gear of the unit, does not."""
    states = model.vector(part, "is_engaged")
    text = model.text(part, "is_engaged")
    return text != "false" if states is None else bool(states[:1] and states[0])
