"""Support stiffness from finite elements: annuli around a rigid core, shafts with a rigid end face."""

from __future__ import annotations

import numpy as np

from femgear.fe.elasticity import Material, stiffness
from femgear.fe.grid import Grid
from femgear.fe.shaft import ShaftStep, shaft_flexibility, timoshenko_flexibility
from femgear.stages.protocol import one_blas_thread
from validation.mapped import mapped_grid, ring_mapping
from validation.reference.support_stiffness import (
    annulus_support_stiffness,
    centre_node_stiffness,
    cyclic_support_stiffness,
)
from validation.rows import Row, information, within

STEEL = Material(206e9, 0.3, 7850.0)
MUSKHELISHVILI = "annulus with a rigid core (potentials of Muskhelishvili)"
TIMOSHENKO = "stepped cantilever, Timoshenko beam with Cowper's shear coefficient"
WIDTH = 25e-3
RADII = ((82.875e-3, 100e-3), (20e-3, 100e-3))
SLENDER = (ShaftStep(0.2, 0.02),)
HOLLOW = (ShaftStep(0.2, 0.02, 0.01),)
STEPPED = (ShaftStep(0.1, 0.03), ShaftStep(0.1, 0.02))


def annulus_sector(inner: float, outer: float, count: int, *, across: int = 8, along: int = 2) -> Grid:
    """One of `count` sectors, the cuts named as those of gears, the circles ``bore`` and ``rim``."""
    angle = 2 * np.pi / count
    grid = mapped_grid(ring_mapping(inner, outer, angle), across, along)
    c, s = np.cos(angle / 2), np.sin(angle / 2)
    names = {"v=0": "cut_right", "v=1": "cut_left", "u=0": "bore", "u=1": "rim"}
    boundaries = {names[name]: edges for name, edges in grid.boundaries.items()}
    return Grid(grid.points @ np.array([[c, -s], [s, c]]), grid.triangles, boundaries, grid.regions)


@one_blas_thread()
def annuli() -> tuple[Row, ...]:
    """A rim with a rigid core, whole and from one sector; the gate is what halving the elements changes."""
    rows = []
    for state in ("plane stress", "plane strain"):
        for inner, outer in RADII:
            exact = annulus_support_stiffness(inner, outer, STEEL, state=state, thickness=WIDTH)
            coarse, fine = (_annulus_stiffness(inner, outer, state, refine) for refine in (1, 2))
            name = f"annulus {1e3 * inner:g}/{1e3 * outer:g} mm, {state}: radial stiffness [N/um], "
            for kind, before, value in zip(("whole", "one sector of 36"), coarse, fine, strict=True):
                gate, note = abs(before / value - 1.0), "gate: change on halving the elements"
                row = within("support", MUSKHELISHVILI, name + kind, 1e-6 * exact, 1e-6 * value, gate, note=note)
                rows.append(row)
    return tuple(rows)


def _annulus_stiffness(inner: float, outer: float, state: str, refine: int) -> tuple[float, float]:
    """Radial stiffness [N/m] of the whole annulus and by one sector."""
    # cells of equal shape from the core outwards
    radius = (outer / inner) ** np.linspace(0.0, 1.0, 12 * refine + 1)
    lines = (radius - 1.0) / (radius[-1] - 1.0)
    grid = mapped_grid(ring_mapping(inner, outer), lines, 60 * refine, closed=True)
    K = stiffness(grid, STEEL, state=state, thickness=WIDTH)
    whole = centre_node_stiffness(grid, K, ("u=0",), ("u=1",))
    sector = annulus_sector(inner, outer, 36, across=16 * refine, along=2 * refine)
    K = stiffness(sector, STEEL, state=state, thickness=WIDTH)
    return whole[0, 0], cyclic_support_stiffness(sector, K, 36, ("bore",), ("rim",))


@one_blas_thread()
def shafts() -> tuple[Row, ...]:
    """Shafts of revolution, held at one end face, the other coupled to a centre node."""
    rows = []
    plain = Material(206e9, 0.0, 7850.0)
    for name, steps, material, gate in (
        ("20 mm, 200 mm long, Poisson's ratio 0", SLENDER, plain, 1e-4),
        ("20/10 mm, 200 mm long, Poisson's ratio 0", HOLLOW, plain, 1e-3),
        ("20 mm, 200 mm long", SLENDER, STEEL, None),
        ("20/10 mm, 200 mm long", HOLLOW, STEEL, None),
    ):
        ours, beam = (1e-6 / find(steps, material)[0, 0] for find in (shaft_flexibility, timoshenko_flexibility))
        quantity = f"shaft {name}: K = F/X [N/um]"
        if gate is None:
            note = "faces that cannot contract stiffen it, which no beam knows: without Poisson's ratio as above"
            rows.append(information("support", TIMOSHENKO, quantity, beam, ours, note=note))
        else:
            rows.append(within("support", TIMOSHENKO, quantity, beam, ours, gate))
    beam, single, two = (
        1e-6 / f[0, 0]
        for f in (
            timoshenko_flexibility(STEPPED, STEEL),
            shaft_flexibility(STEPPED, STEEL),
            shaft_flexibility(STEPPED, STEEL, refine=2.0),
        )
    )
    name = "shaft of 30 and 20 mm, 100 mm each: K = F/X [N/um]"
    note = "the shoulder between the parts yields, which no beam knows"
    return (
        *rows,
        information("support", TIMOSHENKO, name, beam, single, note=note),
        within("support", "elements halved", name, two, single, 5e-3),
    )
