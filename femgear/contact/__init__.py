"""Contact: gears as elastic bodies, the contact problem of a planetary set, and its mesh cycle."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from femgear.contact.assembly import (
        ContactProblem,
        MeshWindows,
        assemble_contact,
        in_windows,
        mesh_windows,
    )
    from femgear.contact.bodies import Bodies, Sectors, make_bodies, make_sectors
    from femgear.contact.cycle import CycleOptions, MeshCycle, loaded_image, walk_mesh_cycle
    from femgear.contact.loaded_period import LoadedPeriod, loaded_period
    from femgear.contact.root_stress import RootStresses, root_ranges, root_stress_cycle
    from femgear.contact.solve import ContactState, solve_contact
    from femgear.contact.supports import RIGID, Supports, moving_members
    from femgear.contact.tooth_loads import deformed_set, load_spectrum, loaded_teeth
    from femgear.gears.planetary import mirrored_set

__all__ = [
    "RIGID",
    "Bodies",
    "ContactProblem",
    "ContactState",
    "CycleOptions",
    "LoadedPeriod",
    "MeshCycle",
    "MeshWindows",
    "RootStresses",
    "Sectors",
    "Supports",
    "assemble_contact",
    "deformed_set",
    "in_windows",
    "load_spectrum",
    "loaded_image",
    "loaded_period",
    "loaded_teeth",
    "make_bodies",
    "make_sectors",
    "mesh_windows",
    "mirrored_set",
    "moving_members",
    "root_ranges",
    "root_stress_cycle",
    "solve_contact",
    "walk_mesh_cycle",
]

_MODULES = "solve supports flank_pairs bodies assembly cycle tooth_loads root_stress loaded_period".split()


def __getattr__(name: str) -> object:
    """Public names are imported when they are first asked for, from the first module that has them."""
    for module in _MODULES if name in __all__ else ():
        found = import_module(f"femgear.contact.{module}")
        if hasattr(found, name):
            return getattr(found, name)
    raise AttributeError(f"module 'femgear.contact' has no attribute {name!r}")
