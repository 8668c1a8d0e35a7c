"""What rotations, mirrors and repetition make of a mesh cycle, whose arrays have the axes of a table.

A set that is turned by a planet's place, or seen from behind, goes through states that are known. Its record is that of
the other one with meshes, planets, tooth pairs and positions renumbered, and with what counts the other way round.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from femgear.contact.mesh_cycle import MeshCycle
from femgear.gears.pair import GearSet

PRESSURES = ("pressure", "pressure_offset", "pressure_centre")
"""What there is where pressures are kept."""
_OVER_MESHES = ("deflection", "force", "back_force", "stiffness", "max_pressure", "edge_contact")
PRESSED = ("pressed_path", "pressed_load")
"""Place and load of the pair that is pressed most."""
FRICTION = ("friction_force", "friction_moment")
"""What there is of meshes whose flanks rub."""
SLICED = ("slice_load", "slice_pressure", "mesh_misalignment", "lead_offset")
"""What there is of meshes in slices over the width."""
AXES = {
    "mt": (*_OVER_MESHES, *PRESSED, "held_stiffness", "mesh_misalignment", "lead_offset", *FRICTION),
    "mst": ("tooth_load", "path", "back_tooth_load", "back_path", "pressure_centre"),
    "gms": ("tooth", "back_tooth"),
    "t": ("sun_arc", "residual", "iterations"),
    "nt": ("open_planets",),
    "mmt": ("held_compliance",),
    "msct": ("pressure",),
    "mc": ("pressure_offset",),
    "mswt": ("slice_load", "slice_pressure"),
}
"""Axes of the arrays of a cycle: gear, mesh, planet n, tooth pair (slot), cell, slice w, position t."""
BETWEEN = ("position", "deflection", "stiffness", "sun_arc", "load_share", "max_pressure", *PRESSED)
"""What is kept at the positions between."""
_ODD = ("path", "back_path", "pressed_path", "tooth", "back_tooth", "pressure_offset", "pressure_centre")
"""What counts the other way round in the mirror image."""


def seen_from_front(cycle: MeshCycle, planetary_set: GearSet, order) -> MeshCycle:
    """Turn results of the mirror image into the order of planets and positions of the original.

    Planet ``order[i]`` (N,) of the original is planet i of the image, see `femgear.contact.cycle.loaded_image`.
    """
    planet, angle = np.argsort(order), planetary_set.planet_angles[0]
    index_of: dict[str, Any] = {"m": planetary_set.moved_meshes(planet), "n": planet}
    index_of["g"] = np.arange(2)
    index_of["w"] = slice(None)
    mirrored = {}
    for name, axes in ((name, axes) for axes, names in AXES.items() for name in names):
        values = getattr(cycle, name)
        if values is None:
            continue
        for number, axis in enumerate(axes):
            # the pair that comes first along the path leaves first when the rotation is seen from behind
            place = index_of[axis] if axis in index_of else slice(None, None, -1)
            values = values[(slice(None),) * number + (place,)]
        mirrored[name] = -values if name in _ODD else values
    if cycle.between is not None:
        between, mesh = cycle.between, index_of["m"]
        mirrored["between"] = replace(
            between,
            position=0.0 - between.position[::-1],
            deflection=between.deflection[mesh, ::-1],
            stiffness=between.stiffness[mesh, ::-1],
            sun_arc=between.sun_arc[::-1],
            load_share=between.load_share[planet, ::-1],
            max_pressure=between.max_pressure[mesh, ::-1],
            pressed_path=-between.pressed_path[mesh, ::-1],
            pressed_load=between.pressed_load[mesh, ::-1],
            looked=between.looked[planet],
            records=tuple(seen_from_front(record, planetary_set, order) for record in between.records),
        )
    mirrored["member_motion"] = _in_mirror(cycle.member_names, cycle.member_motion, planet, angle)
    if cycle.member_tilt is not None:
        mirrored["member_tilt"] = _in_mirror(cycle.tilt_names, cycle.member_tilt, planet, angle)
    return replace(
        cycle,
        position=0.0 - cycle.position[::-1],
        bearing_force=np.einsum("ij,njp->nip", _reflection(angle), cycle.bearing_force)[planet][:, :, ::-1],
        **mirrored,
    )


def _in_mirror(names: Sequence[str], values: np.ndarray, planet: np.ndarray, angle: float) -> np.ndarray:
    """Vectors of members (m, P), and what turns them last, of the mirror image in the original's order."""
    vectors, turned = mapped_members(names, values, planet, _reflection(angle))
    return np.concatenate([vectors, -turned])[:, ::-1]


def mapped_members(
    names: Sequence[str], values: np.ndarray, planet: np.ndarray, matrix: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Map the vectors of members, named in pairs of x and y, by a matrix, and give what follows them.

    Of ``values`` (m, P) the first 2v rows are vectors. The ``matrix`` is (2, 2). With ``planet`` (N,) the planet
    ``planet[i]`` of the values is planet i of the vectors that come out, (2v, P). Other rows come out as (m - 2v, P).
    """
    pairs = [name for name in names if name.endswith((": x", ": y"))][::2]
    vectors, rest = np.split(values, [2 * len(pairs)])
    turned_vectors = np.einsum("ij,mjp->mip", matrix, vectors.reshape(-1, 2, vectors.shape[1]))
    planets = [i for i, name in enumerate(pairs) if name.startswith("planet")]
    if planets:
        turned_vectors[planets] = turned_vectors[planets][planet]
    return turned_vectors.reshape(vectors.shape), rest


def rotation_matrix(angle: float) -> np.ndarray:
    """Make the rotation (2, 2) by an angle [rad]."""
    return np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])


def _reflection(angle: float) -> np.ndarray:
    """Reflection (2, 2) in the line at an angle [rad]."""
    return rotation_matrix(2.0 * angle) * np.array([1.0, -1.0])


def repeated_record(record: MeshCycle, empty: MeshCycle, again: np.ndarray) -> MeshCycle:
    """Fill the record of all positions of an empty one from those (P,) of a record whose states they repeat."""
    over_positions = (name for axes, names in AXES.items() if axes[-1] == "t" for name in names)
    names = (*over_positions, "bearing_force", "member_motion", "member_tilt")
    values = {name: values[..., again] for name in names if (values := getattr(record, name)) is not None}
    return replace(record, position=empty.position, **values)


def same_pairs(path: np.ndarray, mesh: np.ndarray, later: int, pitch: float) -> np.ndarray:
    """Find the slots (M, T) of meshes (M,) that hold the pairs of all meshes so many positions later.

    By paths (M, T, P) [m] and the base pitch [m]; T where there is no such slot.
    """
    count = path.shape[1]
    apart = (path[:, :1, later] - path[mesh, :1, 0]) / pitch
    if count > 1:
        apart *= np.sign(path[mesh, 1:2, 0] - path[mesh, :1, 0])
    slot = np.arange(count) + np.rint(apart).astype(int)
    return np.where((slot >= 0) & (slot < count), slot, count)


def in_slots(values: np.ndarray, slot: np.ndarray) -> np.ndarray:
    """Take values (M, T, ...) of the same shape from the slots (M, T), zero where the slot is T."""
    padded = np.concatenate([values, np.zeros_like(values[:, :1])], axis=1)
    return padded[np.arange(len(values))[:, None], slot]
