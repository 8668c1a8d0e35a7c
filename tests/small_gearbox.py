"""A gearbox of one pair, or of one planetary set, on two shafts of two bearings each, as tables."""

from __future__ import annotations

import copy
from typing import Any

from femgear.trains.reading import read_case

_TABLES: dict[str, Any] = {
    "model": "gearbox",
    "title": "a pair on two shafts",
    "shaft": [
        {"name": "input", "part": [{"length": "90 mm", "outer_diameter": "30 mm"}]},
        {"name": "output", "axis": ["90 mm", "0 mm"], "part": [{"length": "90 mm", "outer_diameter": "40 mm"}]},
    ],
    "bearing": [
        {"name": "A", "shaft": "input", "position": "5 mm", "radial": "2e8 N/m", "axial": "1e8 N/m"},
        {"name": "B", "shaft": "input", "position": "85 mm", "radial": "2e8 N/m"},
        {"name": "C", "shaft": "output", "position": "5 mm", "radial": "2e8 N/m", "axial": "1e8 N/m"},
        {"name": "D", "shaft": "output", "position": "85 mm", "radial": "2e8 N/m"},
    ],
    "pair": [
        {
            "name": "stage",
            "shafts": ["input", "output"],
            "positions": ["30 mm", "30 mm"],
            "gears": {"teeth": [24, 36], "module": "3 mm", "face_width": "20 mm"},
            "mesh": {"stiffness": "4e8 N/m"},
        }
    ],
    "load": [
        {"name": "motor", "shaft": "input", "position": "0 mm"},
        {"name": "brake", "shaft": "output", "position": "90 mm"},
    ],
    "operation": {
        "output": ["brake"],
        "load_case": [{"torque": {"motor": "100 N m"}, "speed": {"input": "1000 rpm"}}],
    },
}

TEETH: dict[str, Any] = {
    "model": "pair",
    "title": "24/36",
    "set": {"module": "3 mm", "pressure_angle": "20 deg", "face_width": "20 mm"},
    "material": {"youngs_modulus": "206 GPa", "poisson_ratio": 0.3, "density": "7850 kg/m^3"},
    "gear_1": {"teeth": 24, "profile_shift": 0.0, "bore_radius": "15 mm"},
    "gear_2": {"teeth": 36, "profile_shift": 0.0, "bore_radius": "20 mm"},
    "operation": {"torque": "100 N m"},
    "static": {"positions": 16, "flank_elements": 6},
}


def pair_tables(*, teeth: bool = False, helix: str = "0 deg") -> dict[str, Any]:
    """Tables of the gearbox, with the teeth of the pair or with its sizes and stiffness."""
    tables = copy.deepcopy(_TABLES)
    stage = tables["pair"][0]
    if teeth:
        del stage["gears"], stage["mesh"]
        stage["teeth"] = copy.deepcopy(TEETH)
    else:
        stage["gears"]["helix_angle"] = helix
    return tables


def split_pair_tables(second: str = "4e8 N/m", *, position: str = "60 mm", teeth: bool = False) -> dict[str, Any]:
    """Tables of two equal pairs side by side between the same shafts, of which the second has its own stiffness."""
    tables = pair_tables(teeth=teeth)
    pair = copy.deepcopy(tables["pair"][0]) | {"name": "second", "positions": [position, position]}
    if not teeth:
        pair["mesh"] = {"stiffness": second}
    tables["pair"].append(pair)
    return tables


def loose_pair_tables(play: str, *, weight: str = "50 kg") -> dict[str, Any]:
    """Tables of a pair of two rigid bodies in the plane under weight, the second one in a bearing with play."""
    tables = pair_tables() | {"motions": "plane", "gravity": {}}
    tables["shaft"] = [{"name": "input"}, {"name": "output", "axis": ["90 mm", "0 mm"]}]
    tables["pair"][0]["mesh"] |= {"contact_ratio": 1.6}
    del tables["pair"][0]["positions"]
    tables["mass"] = [
        {"shaft": "input", "mass": "30 kg", "inertia": "2e-3 kg m^2"},
        {"shaft": "output", "mass": weight, "inertia": "5e-3 kg m^2"},
    ]
    tables["bearing"] = [
        {"name": "A", "shaft": "input", "radial": "2e8 N/m", "torsional": "1e4 N m/rad"},
        {"name": "C", "shaft": "output", "radial": "2e8 N/m", "clearance": play},
    ]
    tables["load"] = [{"name": "motor", "shaft": "input"}, {"name": "brake", "shaft": "output"}]
    tables["operation"]["load_case"][0]["torque"] = {"motor": "10 N m"}
    return tables


def set_on_shafts(*, slices: int = 9) -> dict[str, Any]:
    """Tables of a helical planetary set with teeth: two shafts of two bearings each, the ring in the casing."""
    teeth = read_case("cases/e_axle.toml").planetary[0].teeth
    tables = pair_tables()
    seats = {"A": ("input", "2 mm"), "B": ("input", "38 mm"), "C": ("output", "2 mm"), "D": ("output", "58 mm")}
    sections = ({"outer_diameter": "24 mm"}, {"outer_diameter": "60 mm", "inner_diameter": "40 mm"})
    for shaft, length, part in zip(tables["shaft"], (40, 60), sections, strict=True):
        shaft |= {"axis": ["0 mm", "0 mm"], "start": f"{-length // 2} mm", "part": [{"length": f"{length} mm"} | part]}
    for bearing in tables["bearing"]:
        bearing["shaft"], bearing["position"] = seats[bearing["name"]]
    tables["load"][1]["position"] = "60 mm"
    del tables["pair"]
    tables["planetary"] = [
        {
            "name": "set",
            "sun": "input",
            "carrier": "output",
            "sun_position": "20 mm",
            "carrier_position": "30 mm",
            "pins": {"diameter": "16 mm", "length": "14 mm"},
            "planet": {"bearing": {"radial": "3e8 N/m"}},
            "teeth": copy.deepcopy(teeth) | {"static": {"positions": 12}},
        }
    ]
    return tables | {"deflection": {"slices": slices}}


def planetary_tables(**entries: Any) -> dict[str, Any]:
    """Tables of a spur set of a sun and a carrier of one rigid body each, with further ``entries`` of the set."""
    return {
        "model": "gearbox",
        "title": "a planetary set",
        "shaft": [{"name": "sun"}, {"name": "carrier"}],
        "mass": [
            {"shaft": "sun", "mass": "2 kg", "inertia": "2e-3 kg m^2"},
            {"shaft": "carrier", "mass": "8 kg", "inertia": "3e-2 kg m^2"},
        ],
        "bearing": [
            {"shaft": "sun", "radial": "1e8 N/m", "axial": "1e8 N/m", "tilt": "1e6 N m/rad"},
            {"shaft": "carrier", "radial": "5e8 N/m", "axial": "5e8 N/m", "tilt": "1e7 N m/rad"},
        ],
        "planetary": [
            {
                "name": "set",
                "sun": "sun",
                "carrier": "carrier",
                "gears": {"teeth": [20, 20, 61], "module": "2 mm", "centre_distance": "40 mm", "face_width": "20 mm"},
                "planet": {"mass": "0.4 kg", "inertia": "1e-4 kg m^2"},
                "sun_mesh": {"stiffness": "3e8 N/m"},
                "ring_mesh": {"stiffness": "3e8 N/m"},
            }
            | copy.deepcopy(entries)
        ],
        "operation": {
            "output": ["carrier"],
            "load_case": [{"torque": {"sun": "100 N m"}, "speed": {"sun": "1000 rpm"}}],
        },
    }
