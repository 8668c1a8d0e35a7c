"""Elastic rims: a ring of one module under the root, and the planet between its two meshes.

The contact solution knows a gear by the compliance of its flanks, made from one sector. Here the same tooth
loads act on the whole gear in one finite-element grid (`validation.whole_gear`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from femgear.contact.bodies import (
    RING_STATE,
    TEETH_STATE,
    FlankCompliance,
    Sector,
    flank_stations,
    make_sectors,
    station_weights,
)
from femgear.contact.flank_pairs import LEFT, RIGHT
from femgear.contact.local_compliance import surface_displacement
from femgear.fe.compliance import mirror_nodes
from validation.cases import reference_case, reference_material
from validation.rows import Row, at_most, information
from validation.whole_gear import (
    Held,
    ToothLoads,
    bump_shares,
    by_cubic_elements,
    by_same_grid,
    by_sector,
    loads_of,
)

if TYPE_CHECKING:
    from femgear.fe.elasticity import Material
    from femgear.stages.static_results import StaticResult

POSITION = 4
PIN_ERROR = "5 um"
SOURCE = "all teeth in one grid, cubic elements"


@dataclass(frozen=True)
class Comparison:
    """One gear by its sector and as a whole; errors are relative to the largest displacement.

    Parameters
    ----------
    same_grid : float
        Largest difference of the field between the sector and all sectors in one grid, same elements.
    field : float
        The same between the sector and cubic elements on another grid, at all nodes that they share.
    rim : float
        Of these the nodes of the rim that is not the toothed one.
    flanks : float
        Largest difference of the normal displacement along chosen flanks between the compliance that the
        contact solution uses and cubic elements.
    largest, opposite : float
        Largest displacement of the whole gear and normal displacement of the chosen flanks [m].
    """

    same_grid: float
    field: float
    rim: float
    flanks: float
    largest: float
    opposite: float


@cache
def static_with(*, thin: bool) -> StaticResult:
    """The reference set with elastic members, a pin error and a rim of one module, or its own rim."""
    from femgear.case.gear_set import planetary_set
    from femgear.stages.static import solve_static
    from femgear.trains.reading import with_value

    case = reference_case()
    ring = planetary_set(case).ring
    pins = [{"planet": 1, "tangential": PIN_ERROR}]
    changes = [("static.members", "elastic"), ("static.positions", 16), ("set.pin_errors", pins)]
    if thin:
        changes.append(("ring.outer_radius", f"{1e3 * (ring.root_radius + ring.module):.9f} mm"))
    for key, value in changes:
        case = with_value(case, key, value)
    return solve_static(case)


def contact_displacement(
    flank: FlankCompliance, gear, material: Material, loads: ToothLoads, tooth: int, side: int, rolls
) -> np.ndarray:
    """Normal displacement into one flank [m] as the contact solution has it, at roll lengths (n,) [m].

    The regular compliance of the body, and under its own load the half plane at the surface.
    """
    n, total = len(flank.roll), np.zeros(len(rolls))
    where, weight = station_weights(rolls, flank.roll)
    for at, on, roll, force in zip(loads.tooth, loads.side, loads.roll, loads.force, strict=True):
        arcs, shares, half = bump_shares(gear, roll)
        index, part = station_weights(np.sqrt(2 * gear.base_radius * arcs), flank.roll)
        column = np.zeros(2 * n)
        np.add.at(column, index + on * n, part * (force * shares)[:, None])
        stations = flank.regular[(tooth - at) % gear.teeth] @ column
        total += (weight * stations[where + side * n]).sum(axis=1)
        if (tooth - at) % gear.teeth == 0 and on == side:
            distance = 0.5 * np.square(rolls)[:, None] / gear.base_radius - arcs
            local = surface_displacement(distance, half, material.shear_modulus, material.poisson_ratio)
            away = np.abs(0.5 * np.square(rolls) / gear.base_radius - flank.corner.arc)[:, None]
            local += flank.corner.surface(away, np.abs(arcs - flank.corner.arc))
            total += local @ (force * shares) / gear.face_width
    return total


def compare(
    sector: Sector, flank: FlankCompliance, other: Sector, material: Material, loads, held: Held, seen
) -> Comparison:
    """Sector and whole gear under the same loads.

    Parameters
    ----------
    sector : Sector
        As the contact solution uses it.
    flank : FlankCompliance
        Of that sector.
    other : Sector
        Another grid of the same gear, for the whole gear.
    material : Material
    loads : ToothLoads
    held : Held
    seen : tuple of (sequence of int, int)
        Teeth and side of the flanks that are looked at.
    """
    from scipy.spatial import cKDTree

    gear = sector.gear
    state = RING_STATE if gear.internal else TEETH_STATE
    field, same = by_sector(sector, loads, held), by_same_grid(other, loads, held, material, state)
    regions = state if gear.internal else dict.fromkeys(RING_STATE, state)
    whole = by_cubic_elements(other.grid, gear, loads, held, material, regions)
    largest = np.abs(whole[:, ~np.isnan(whole[0, :, 0])]).max()
    distance, node = cKDTree(sector.grid.points).query(other.grid.points)
    shared = np.flatnonzero((distance < 1e-9) & ~np.isnan(whole[0, :, 0]))
    error = np.abs(field[:, node[shared]] - whole[:, shared]).max(axis=(0, 2)) / largest
    on_rim = np.isin(shared, other.grid.boundaries["rim"])
    flanks = [_seen_flank(flank, other, material, loads, whole, tooth, seen[1]) for tooth in seen[0]]
    ours, theirs = np.transpose(flanks, (1, 0, 2))
    return Comparison(
        same_grid=float(np.abs(same - by_sector(other, loads, held)).max() / np.abs(same).max()),
        field=float(error.max()),
        rim=float(error[on_rim].max()),
        flanks=float(np.abs(ours - theirs).max() / np.abs(theirs).max()),
        largest=float(largest),
        opposite=float(np.abs(theirs).max()),
    )


def _seen_flank(flank, other: Sector, material, loads, whole, tooth, side):
    """Normal displacement along one flank: of the contact solution, of the whole gear."""
    gear, stations = other.gear, flank_stations(other.grid, other.gear)
    nodes, normals = stations.nodes, stations.normals
    if side == RIGHT:
        nodes, normals = mirror_nodes(other.grid)[nodes], normals * [1.0, -1.0]
    angle = tooth * gear.pitch_angle
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    theirs = ((normals @ turn.T) * whole[tooth % gear.teeth, nodes]).sum(axis=1)
    return contact_displacement(flank, gear, material, loads, tooth, side, stations.roll), theirs


@cache
def ring_comparison(*, flank_elements: int = 8, refine: float = 0.5) -> Comparison:
    """All loads of the thin ring of `static_with` at one position; the sizes are those of the whole gear."""
    static = static_with(thin=True)
    gears, section = static.planetary_set, reference_case().ring
    N, material = gears.n_planets, reference_material()
    loads = loads_of(gears, static.cycle, POSITION, [(N + n, 1, LEFT) for n in range(N)])
    other = make_sectors(gears, material, flank_elements=flank_elements, refine=refine).ring
    held = Held(section.foundation_radial, section.foundation_tangential)
    seen = loads.tooth, LEFT
    return compare(static.sectors.ring, static.bodies.ring, other, material, loads, held, seen)


@cache
def planet_comparison(*, flank_elements: int = 8, refine: float = 0.5) -> Comparison:
    """Sun-side loads of planet 1, seen on the flanks that meet the ring."""
    static = static_with(thin=True)
    gears, material = static.planetary_set, reference_material()
    N, cycle = gears.n_planets, static.cycle
    loads = loads_of(gears, cycle, POSITION, [(0, 1, LEFT)])
    seen = loads_of(gears, cycle, POSITION, [(N, 0, RIGHT)]).tooth, RIGHT
    other = make_sectors(gears, material, flank_elements=flank_elements, refine=refine).planet
    return compare(static.sectors.planet, static.bodies.planet, other, material, loads, Held(), seen)


def thin_ring() -> tuple[Row, ...]:
    """The field of the thin ring and the flanks at its meshes."""
    comparison = ring_comparison()
    name = "rim of one module, all tooth loads of the ring: "
    same = "all 108 sectors in one sparse solution, same elements"
    return (
        at_most("rim", same, name + "displacement, relative", 1e-9, comparison.same_grid),
        at_most("rim", SOURCE, name + "displacement of flanks, tips and rim, relative", 0.01, comparison.field),
        at_most("rim", SOURCE, name + "displacement of the outer surface, relative", 0.01, comparison.rim),
        at_most("rim", SOURCE, name + "loaded flanks in the contact solution, relative", 0.01, comparison.flanks),
        information("rim", "definition", name + "largest displacement [um]", None, 1e6 * comparison.largest),
    )


def planet_between_its_meshes() -> tuple[Row, ...]:
    """A planet loaded by the sun, seen where it meets the ring."""
    comparison = planet_comparison()
    name = "planet loaded by the sun alone: "
    same = "all 40 sectors in one sparse solution, same elements"
    seen = name + "flanks that meet the ring, in the contact solution, relative"
    return (
        at_most("rim", same, name + "displacement, relative", 1e-9, comparison.same_grid),
        at_most("rim", SOURCE, name + "displacement of flanks and tips, relative", 0.01, comparison.field),
        at_most("rim", SOURCE, seen, 0.01, comparison.flanks),
        information(
            "rim", "definition", name + "flanks that meet the ring move by [nm]", None, 1e9 * comparison.opposite
        ),
    )


def sharing_with_a_thin_rim() -> tuple[Row, ...]:
    """Load sharing with a pin error, rim of one module and rim of the reference set."""
    thin, thick = (static_with(thin=rim).cycle.load_share[0].mean() for rim in (True, False))
    name = f"pin 1 behind by {PIN_ERROR}, elastic members: share of planet 1"
    note = "reference: rim of 17.1 mm; femgear: rim of one module"
    uneven = (1 / 3 - thin) / (1 / 3 - thick)
    return (
        information("rim", "the same set with its thick rim", name, thick, thin, note=note),
        at_most("rim", "a softer path evens out", name + ", less 1/3, thin rim over thick rim", 1.0, uneven),
    )
