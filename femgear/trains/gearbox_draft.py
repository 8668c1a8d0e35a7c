"""Draft of a gearbox case: the teeth of a pair on two shafts, four bearings, a motor and a load.

All sizes beyond the teeth follow from the face width and from the torque, and every entry says how.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from femgear.case import text as case_text
from femgear.case.estimates import estimated_mesh_stiffness
from femgear.case.gear_set import planetary_set
from femgear.case.quantities import LENGTH, STIFFNESS
from femgear.trains.reading import parse_case

SHAFT_STRESS = 25e6
"""Torsional stress for which shafts are sized [Pa]."""
FACE_WIDTHS, GEAR_AT = 4.0, 1.5
"""Length of the shafts, and position of the gears, over the face width; bearings are half of it from the ends."""
# Of a bearing over the mesh stiffness, as the supports of other new cases.
_BEARING = 0.2
_NAMES = "input", "output"


def pair_in_gearbox(pair: Mapping[str, Any], notes: dict[str, str]) -> dict[str, Any]:
    """Make the tables of a gearbox of those of a pair, whose remarks move with its entries.

    Parameters
    ----------
    pair : mapping
        Tables of a new pair, with torque and speeds.
    notes : dict of str to str
        Remarks by dotted key; changed.

    Raises
    ------
    CaseError, GeometryError
        Tables that make no pair.
    """
    case = parse_case(case_text.write(dict(pair)))
    gears: Any = planetary_set(case)
    width, distance = gears.mesh_widths[0], gears.centre_distance
    ratio = gears.gear_2.teeth / gears.gear_1.teeth
    speed = pair["operation"]["speeds"][0]
    teeth = {key: value for key, value in pair.items() if key not in ("format", "operation")}
    for key in [*notes]:
        notes[f"pair[0].teeth.{key}"] = notes.pop(key)
    diameters = []
    for number, (name, torque) in enumerate(zip(("gear_1", "gear_2"), (1.0, ratio), strict=True)):
        bore = 2.0 * (getattr(case, name).bore_radius or math.inf)
        diameter = min(_shaft_diameter(torque * case.operation.torque), bore)
        diameters.append(LENGTH.show(diameter))
        teeth[name] = teeth[name] | {"bore_radius": LENGTH.show(0.5 * diameter)}
        notes[f"pair[0].teeth.{name}.bore_radius"] = "estimated: the gear is solid down to its shaft"
        how = "the bore of a usual rim" if diameter == bore else f"{1e-6 * SHAFT_STRESS:g} N/mm^2 of torsional stress"
        notes[f"shaft[{number}].part[0].outer_diameter"] = f"estimated: {how}"
        notes[f"shaft[{number}].part[0].length"] = f"estimated: {FACE_WIDTHS:g} face widths"
    notes["pair[0].positions"] = f"estimated: {GEAR_AT:g} face widths"
    torque_key = "operation.load_case[0].torque.motor"
    if "pair[0].teeth.operation.torque" in notes:
        notes[torque_key] = notes.pop("pair[0].teeth.operation.torque")
    return {
        "format": 1,
        "model": "gearbox",
        "title": pair["title"],
        "shaft": [
            _shaft(name, axis, FACE_WIDTHS * width, diameter)
            for name, axis, diameter in zip(_NAMES, (0.0, distance), diameters, strict=True)
        ],
        "bearing": _bearings(case, width, notes),
        "pair": [
            {
                "name": "stage",
                "shafts": list(_NAMES),
                "positions": [LENGTH.show(GEAR_AT * width)] * 2,
                "teeth": teeth | {"operation": {"torque": pair["operation"]["torque"]}},
            }
        ],
        "load": [
            {"name": "motor", "shaft": "input", "position": "0 mm"},
            {"name": "load", "shaft": "output", "position": LENGTH.show(FACE_WIDTHS * width)},
        ],
        "operation": {
            "output": ["load"],
            "load_case": [
                {
                    "name": "nominal",
                    "torque": {"motor": pair["operation"]["torque"]},
                    "speed": {"input": speed},
                }
            ],
        },
    }


def _shaft_diameter(torque: float) -> float:
    """Diameter of a solid shaft with `SHAFT_STRESS` under a torque [N m], in whole tenths of a millimetre [m]."""
    diameter = (16.0 * abs(torque) / (math.pi * SHAFT_STRESS)) ** (1.0 / 3.0)
    return max(round(diameter, 4), 1e-3)


def _shaft(name: str, axis: float, length: float, diameter: str) -> dict[str, Any]:
    """Table of a cylindrical shaft parallel to z."""
    part = {"length": LENGTH.show(length), "outer_diameter": diameter}
    return {"name": name, "axis": [_exact(axis), "0 mm"], "part": [part]}


def _exact(length: float) -> str:
    """Length [m] as text in mm, to the picometre: axes stand at the centre distance of their teeth."""
    return f"{round(1e3 * length, 9):.13g} mm"


def _bearings(case: Any, width: float, notes: dict[str, str]) -> list[dict[str, Any]]:
    """Tables of two bearings for each shaft, of which the left one takes thrust."""
    modulus = case.material.youngs_modulus
    stiffness = STIFFNESS.show(float(f"{_BEARING * estimated_mesh_stiffness(modulus, modulus, width):.3g}"))
    bearings: list[dict[str, Any]] = []
    for shaft, (left, right) in zip(_NAMES, ("AB", "CD"), strict=True):
        for name, place in ((left, 0.5), (right, FACE_WIDTHS - 0.5)):
            bearing = {"name": name, "shaft": shaft, "position": LENGTH.show(place * width), "radial": stiffness}
            if name == left:
                bearing["axial"] = stiffness
                notes[f"bearing[{len(bearings)}].axial"] = "this one takes thrust both ways"
            notes[f"bearing[{len(bearings)}].radial"] = f"estimated: {_BEARING:g} of 20 N/(mm um) times the face width"
            notes[f"bearing[{len(bearings)}].estimated"] = "results show what half and twice of it make"
            bearings.append(bearing | {"estimated": True})
    return bearings
