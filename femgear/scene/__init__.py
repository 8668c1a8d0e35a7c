"""PyVista scenes: the whole set and the ring's modes as VTK grids, pictures of them, an animation."""

from femgear.scene.animation import animate_operating_deflection, strobe_frames
from femgear.scene.drawing import deformed_picture
from femgear.scene.grids import (
    Body,
    assemble_set,
    cyclic_field,
    placed,
    polar_curve,
    ring_modes_grid,
    write_vtu,
)
from femgear.scene.library import load_pyvista

__all__ = [
    "Body",
    "animate_operating_deflection",
    "assemble_set",
    "cyclic_field",
    "deformed_picture",
    "load_pyvista",
    "placed",
    "polar_curve",
    "ring_modes_grid",
    "strobe_frames",
    "write_vtu",
]
