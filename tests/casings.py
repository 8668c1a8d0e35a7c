"""Casings of the small gearbox, and the same gearbox of rigid bodies written out as matrices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from small_gearbox import pair_tables

from femgear.case.dependencies import Steps
from femgear.trains.gearbox.deflection import Deflection, solve_deflection
from femgear.trains.gearbox.response import GearboxResponse, solve_gearbox_response
from femgear.trains.live import Answer
from femgear.trains.reading import read_case

FEET = {
    "left front": (-80, -100, 0),
    "left rear": (-80, -100, 95),
    "right front": (180, -100, 0),
    "right": (180, -90, 95),
}
"""Places of the feet [mm]."""
TENSOR = np.array([[0.6, -0.01, 0.02], [-0.01, 0.8, -0.03], [0.02, -0.03, 1.1]])
MASS, CENTRE = 40.0, np.array([0.05, 0.01, 0.04])
STIFFNESS = (1.1e8, 2.3e8, 0.7e8)
RPM = np.pi / 30.0


def casing_tables(stiffness: Any = STIFFNESS) -> dict[str, Any]:
    """Tables of a casing on four feet; their stiffness [N/m], or a word."""
    values = [stiffness] * 3 if isinstance(stiffness, str) else [f"{value!r} N/m" for value in stiffness]
    feet = [
        {"name": name, "position": [f"{value / 1e3!r} m" for value in place], "stiffness": list(values)}
        for name, place in FEET.items()
    ]
    return {
        "mass": f"{MASS!r} kg",
        "inertia": [f"{value!r} kg m^2" for value in np.diag(TENSOR).tolist()],
        "products": [f"{-float(TENSOR[i, j])!r} kg m^2" for i, j in ((0, 1), (0, 2), (1, 2))],
        "centre": [f"{value!r} m" for value in CENTRE.tolist()],
        "foot": feet,
    }


def rigid_tables() -> dict[str, Any]:
    """Tables of a pair of rigid bodies on bearings of four stiffnesses in the casing, spur teeth of one slice."""
    bearing = {"radial": "2e8 N/m", "axial": "1e8 N/m", "tilt": "3e4 N m/rad"}
    return {
        "model": "gearbox",
        "title": "two rigid gears in a casing",
        "shaft": [{"name": "input"}, {"name": "output", "axis": ["90 mm", "0 mm"]}],
        "mass": [
            {"shaft": "input", "mass": "3 kg", "inertia": "4e-3 kg m^2", "transverse_inertia": "5e-3 kg m^2"},
            {"shaft": "output", "mass": "6 kg", "inertia": "9e-3 kg m^2", "transverse_inertia": "8e-3 kg m^2"},
        ],
        "bearing": [
            {"name": name, "shaft": shaft, "position": place} | bearing
            for name, shaft, place in (
                ("A", "input", "-40 mm"),
                ("B", "input", "40 mm"),
                ("C", "output", "-40 mm"),
                ("D", "output", "40 mm"),
            )
        ],
        "pair": [
            {
                "name": "stage",
                "shafts": ["input", "output"],
                "gears": {"teeth": [24, 36], "module": "3 mm"},
                "mesh": {"stiffness": "4e8 N/m"},
            }
        ],
        "casing": casing_tables(),
        "operation": {
            "output": ["output"],
            "load_case": [{"torque": {"input": "100 N m"}, "speed": {"input": "1000 rpm"}}],
        },
    }


def _at(offset) -> np.ndarray:
    """Displacement of a point by shift and turn of its body: u + theta x r."""
    x, y, z = offset
    cross = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
    return np.block([[np.eye(3), cross], [np.zeros((3, 3)), np.eye(3)]])


@dataclass(frozen=True)
class Path:
    """A node that springs along x, y, z (and about them) join to the rigid body of a file.

    ``role`` and ``name`` of the node, its ``place`` (3,) [m], ``stiffness`` (3,) or (6,), and its ``mass`` [kg].
    """

    role: str
    name: str
    place: tuple[float, ...]
    stiffness: tuple[float, ...]
    mass: float = 0.05


def body_matrices_of(paths: Sequence[Path]) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and mass of a rigid body, six coordinates at `CENTRE`, and the nodes that hang on it."""
    sizes = [len(path.stiffness) for path in paths]
    count, at = 6 + sum(sizes), 6
    stiffness, mass = np.zeros((count, count)), np.zeros((count, count))
    mass[:3, :3], mass[3:6, 3:6] = MASS * np.eye(3), TENSOR
    for path, size in zip(paths, sizes, strict=True):
        rows = np.zeros((size, count))
        rows[:, :6] = -_at(np.array(path.place) - CENTRE)[:size]
        rows[:, at : at + size] = np.eye(size)
        stiffness += rows.T @ np.diag(path.stiffness) @ rows
        own = np.arange(at, at + size)
        mass[own, own] = path.mass * np.array([1.0, 1.0, 1.0, 1e-4, 1e-4, 1e-4])[:size]
        at += size
    return stiffness, mass


def casing_paths(seats: Any, feet: Any, names=("A", "B", "C", "D")) -> list[Path]:
    """Nodes of the bearings of `rigid_tables` and of four feet, with the stiffness of their springs."""
    places = {"A": (0.0, 0.0, -0.04), "B": (0.0, 0.0, 0.04), "C": (0.09, 0.0, -0.04), "D": (0.09, 0.0, 0.04)}
    found = [Path("seat", name, places[name], tuple(seats)) for name in names]
    return [*found, *(Path("foot", name, tuple(v / 1e3 for v in place), tuple(feet)) for name, place in FEET.items())]


def write_casing_file(folder: FilePath, paths: Sequence[Path], matrices=None) -> dict[str, Any]:
    """Write casing.npz and nodes.csv into a folder; tables of the casing without feet."""
    stiffness, mass = matrices or body_matrices_of(paths)
    np.savez(folder / "casing.npz", stiffness=stiffness, mass=mass)
    rows = ["node,role,x,y,z,dofs", f"1,sensor body,{','.join(map(repr, CENTRE.tolist()))},123456"]
    for number, path in enumerate(paths, 2):
        dofs = "123456"[: len(path.stiffness)]
        rows.append(f"{number},{path.role} {path.name},{','.join(map(repr, path.place))},{dofs}")
    (folder / "nodes.csv").write_text("\n".join(rows))
    return {"file": "casing.npz", "nodes": "nodes.csv"}


def rigid_matrices() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass and stiffness (18, 18) of `rigid_tables` and its load (18,): input, output, casing, six motions each."""
    centres = np.array([[0.0, 0.0, 0.0], [0.09, 0.0, 0.0], CENTRE])
    mass = np.zeros((18, 18))
    for body, (m, polar, transverse) in enumerate(((3.0, 4e-3, 5e-3), (6.0, 9e-3, 8e-3))):
        mass[6 * body : 6 * body + 6, 6 * body : 6 * body + 6] = np.diag([m, m, m, transverse, transverse, polar])
    mass[12:15, 12:15], mass[15:, 15:] = MASS * np.eye(3), TENSOR
    stiffness = np.zeros((18, 18))

    def motion(body: int, place) -> np.ndarray:
        row = np.zeros((6, 18))
        row[:, 6 * body : 6 * body + 6] = _at(np.asarray(place) - centres[body])
        return row

    for body in (0, 1):
        for z in (-0.04, 0.04):
            place = centres[body] + [0.0, 0.0, z]
            apart = motion(body, place) - motion(2, place)
            stiffness += apart.T @ np.diag([2e8, 2e8, 1e8, 3e4, 3e4, 0.0]) @ apart
    for place in FEET.values():
        foot = motion(2, np.array(place) / 1e3)[:3]
        stiffness += foot.T @ np.diag(STIFFNESS) @ foot
    # the input turns counter-clockwise and pushes the output at the pitch point
    alpha = np.radians(20.0)
    normal = np.array([np.sin(alpha), np.cos(alpha), 0.0])
    pitch = np.array([0.036, 0.0, 0.0])
    approach = normal @ (motion(0, pitch) - motion(1, pitch))[:3]
    stiffness += 4e8 * np.outer(approach, approach)
    load = np.zeros(18)
    load[5], load[11] = 100.0, 150.0
    return mass, stiffness, load


@cache
def pair_in_a_casing() -> Deflection:
    """Loaded state of a pair with teeth in a casing on feet, with sensors at its centre along all axes."""
    tables = pair_tables(teeth=True) | {"casing": casing_tables(), "dynamics": {"up_to": "3 kHz"}}
    centre = [f"{value!r} m" for value in CENTRE.tolist()]
    tables["sensor"] = [{"name": way, "position": centre, "direction": way} for way in "xyz"]
    return solve_deflection(read_case(tables), steps=Steps())


@cache
def response() -> GearboxResponse:
    """Response of that pair at two speeds."""
    return solve_gearbox_response(pair_in_a_casing(), [1000.0 * RPM, 2500.0 * RPM])


@cache
def answer_in_a_casing(*, stresses: bool = False) -> Answer:
    """Answer of the pair with teeth in a casing on feet, with a sensor and a run-up of two speeds."""
    tables = pair_tables(teeth=True) | {"casing": casing_tables(), "dynamics": {"up_to": "2 kHz"}}
    tables["deflection"] = {"slices": 5}
    tables["pair"][0]["teeth"]["static"] |= {"stresses": stresses}
    tables["sensor"] = [{"name": "top", "position": ["90 mm", "80 mm", "40 mm"], "direction": "y"}]
    tables["runup"] = {"from": "900 rpm", "to": "1100 rpm", "count": 2}
    return Answer(read_case(tables), Steps())
