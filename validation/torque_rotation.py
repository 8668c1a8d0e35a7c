"""Two routes to the mesh stiffness: torque and rotation of whole gears against the flank compliance.

The compliance route takes the bodies from one tooth sector by cyclic symmetry, joins them to a half plane at
a depth and solves for pressure cells. The torque-rotation route (`reference.torque_rotation`) joins all
sectors of both gears, resolves the contact with elements and turns one gear against the other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from femgear.contact.assembly import assemble_contact
from femgear.contact.bodies import (
    RING_STATE,
    Bodies,
    flank_load_columns,
    flank_stations,
    joining_depth,
    make_bodies,
    make_sectors,
)
from femgear.contact.solve import solve_contact
from femgear.contact.windows import mesh_windows
from femgear.fe.elasticity import Material
from femgear.gears.gear import Gear
from femgear.gears.planetary import PlanetarySet, close_set, equal_planet_angles
from femgear.gears.profile import BasicRack
from femgear.stages.protocol import one_blas_thread
from validation.planetary import reference_set
from validation.reference.tangent import tangent_stiffness
from validation.reference.torque_rotation import GearPair, TorqueRotation, torque_rotation
from validation.rows import Row, at_most, information, within

STEEL = Material(206e9, 0.3, 7850.0)
POSITIONS = 64  # in one mesh period
SUN_TORQUE = 100.0 / 3.0  # N m, of one of three planets
SUN_PLANET, PLANET_RING = 0, 3
# twelve edges on a Hertzian half width, everything else somewhat coarser than the compliance route has it
DIVISION = {"edges": 12, "refine": 0.6}
INCLINED = "the force at a tip corner is normal to the other flank; femgear has it normal to both"
SOURCE = "torque and rotation of whole gears, contact resolved by elements"


@dataclass(frozen=True)
class PairStiffness:
    """Stiffness of one mesh alone by the compliance route.

    Parameters
    ----------
    fraction : (P,) array
        Path coordinate of one tooth pair in base pitches.
    secant, tangent : (P,) arrays
        [N/m]
    pair_force : tuple of P dicts
        Force of every loaded tooth pair by its number, the pair of `fraction` being 0 [N].
    """

    fraction: np.ndarray
    secant: np.ndarray
    tangent: np.ndarray
    pair_force: tuple[dict[int, float], ...]


@dataclass(frozen=True)
class CornerSet:
    """A set whose teeth bend far past the path of contact, and the force of its planet-ring mesh [N]."""

    gears: PlanetarySet
    material: Material
    force: float


@cache
@one_blas_thread()
def _bodies():
    """Flank compliances of the reference set, and the sectors they come from."""
    sectors = make_sectors(reference_set(), STEEL)
    return make_bodies(sectors, STEEL), sectors


@one_blas_thread()
def by_compliance(mesh: int, positions) -> PairStiffness:
    """One mesh of the reference set alone, the other gears of the set taken away.

    Parameters
    ----------
    mesh : int
        `SUN_PLANET` or `PLANET_RING`.
    positions : sequence of int
        Of 64 in one mesh period.
    """
    s = reference_set()
    return mesh_alone(s, _bodies()[0], SUN_TORQUE / s.sun.base_radius, mesh, positions)


def mesh_alone(
    s: PlanetarySet, bodies: Bodies, force: float, mesh: int, positions, *, cells: int = 36
) -> PairStiffness:
    """One mesh of any set alone under a force [N], in windows of so many cells."""
    setup = mesh_windows(s, bodies, share=force, positions=POSITIONS, cells=cells, nearest=30e-6, contact="profile")
    only = np.zeros_like(setup.near)
    only[mesh] = setup.near[mesh]
    setup, secant, tangent, shares = replace(setup, near=only), [], [], []
    for position in positions:
        problem = assemble_contact(setup, bodies, position)
        state = solve_contact(problem.H, problem.gap, np.ones((len(problem.gap), 1)), [force])
        secant.append(force / state.motions[0])
        body = np.zeros(len(problem.gap), int)
        tangent += tangent_stiffness(problem.H, state, body, problem.pair, problem.cell, 1).tolist()
        loads = np.bincount(problem.pair, weights=state.loads)
        shares.append({int(i): float(loads[i]) for i in np.flatnonzero(loads)})
    return PairStiffness(
        setup.zeta[mesh, list(positions), 0] / s.sun.base_pitch,
        np.array(secant),
        np.array(tangent),
        tuple(shares),
    )


@cache
def by_rotation(mesh: int, positions: tuple[int, ...], rim: str = "held", even: int = 0) -> TorqueRotation:
    """The same mesh by torque and rotation.

    Parameters
    ----------
    mesh, positions
        As for `by_compliance`.
    rim : {"held", "sliding"}
        Of the gear that is turned.
    even : int
        Elements along flanks that are divided evenly, without finer ones at the contact; 0 resolves it.
    """
    s, fraction = reference_set(), by_compliance(mesh, positions).fraction
    if mesh == SUN_PLANET:
        angle = s.working_pressure_angle_sun_planet
        pair, torque = GearPair(s.sun, s.planet, s.centre_distance, angle, STEEL), SUN_TORQUE
    else:
        angle = s.working_pressure_angle_planet_ring
        pair = GearPair(s.planet, s.ring, s.centre_distance, angle, STEEL, state_2=RING_STATE)
        torque = SUN_TORQUE * s.planet.teeth / s.sun.teeth
    # `refine` divides the elements of the flank as well
    coarse = {"edges": None, "flank_elements": round(even / DIVISION["refine"])}
    options = DIVISION | coarse if even else DIVISION
    return torque_rotation(pair, torque, fraction, rim=rim, **options)


def _compared(mesh: int, positions: tuple[int, ...], name: str, shown) -> tuple[Row, ...]:
    """Largest differences over all positions, and the numbers at some of them."""
    ours, other, rows = by_compliance(mesh, positions), by_rotation(mesh, positions), []
    note = f"{other.unknowns.max()} degrees of freedom of both whole gears"
    for kind in ("secant", "tangent"):
        mine, theirs = getattr(ours, kind), getattr(other, kind)
        difference = np.abs(mine / theirs - 1.0)
        place = f"{name}, {len(positions)} positions: {kind} stiffness, "
        rows.append(at_most("pair", SOURCE, place + "largest difference", 0.01, difference.max(), note=note))
        rows.append(information("pair", SOURCE, place + "mean difference", None, difference.mean()))
        for k in shown:
            where = f"{name}, position {positions[k]}/{POSITIONS}: {kind} stiffness [N/um]"
            rows.append(within("pair", SOURCE, where, 1e-6 * theirs[k], 1e-6 * mine[k], 0.01))
    return tuple(rows)


def all_positions() -> tuple[Row, ...]:
    """Sun and planet over one mesh cycle, a tip corner that begins to carry included."""
    return _compared(SUN_PLANET, tuple(range(POSITIONS)), "sun-planet", (0, 16, 24, 28, 44))


def planet_and_ring() -> tuple[Row, ...]:
    """Planet and ring, up to three tooth pairs, both tip corners."""
    positions = (0, 16, 20, 22, 24, 28, 34, 36)
    ours, other = by_compliance(PLANET_RING, positions), by_rotation(PLANET_RING, positions)
    force = SUN_TORQUE / reference_set().sun.base_radius
    swing = [1e6 * float(np.ptp(force / route.secant)) for route in (other, ours)]
    name = f"planet-ring, {len(positions)} positions: transmission error peak to peak [um]"
    return (
        *_compared(PLANET_RING, positions, "planet-ring", (3, 6)),
        within("pair", SOURCE, name, *swing, 0.02, note=INCLINED),
    )


@cache
def corner_set() -> CornerSet:
    """18/27/72, module 4 mm, cast iron: the ring's tip corners begin to carry 1.7 mm before the path."""
    rack = BasicRack(addendum=1.0, dedendum=1.25, root_radius=0.25)

    def gear(teeth, rim, internal=False):
        return Gear(teeth, 4e-3, math.radians(22.5), 0.0, 40e-3, rim, internal=internal, rack=rack)

    gears = close_set(gear(18, 15e-3), gear(27, 30e-3), gear(72, 0.18, True), planet_angles=equal_planet_angles(3))
    return CornerSet(gears, Material(114e9, 0.3, 7200.0), 12027.0)


@one_blas_thread()
def corner_bodies(*, depth: float | None = None, flank_elements: int = 24) -> Bodies:
    """Flank compliances of `corner_set`; parameters as `static.depth` [m] and `static.flank_elements`."""
    s = corner_set()
    sectors = make_sectors(s.gears, s.material, flank_elements=flank_elements)
    return make_bodies(sectors, s.material, depth=depth)


def corner_by_rotation(positions, *, edges: int = 12, refine: float = 0.7) -> TorqueRotation:
    """The planet-ring mesh of `corner_set` by torque and rotation."""
    s = corner_set()
    gears, angle = s.gears, s.gears.working_pressure_angle_planet_ring
    # with equal numbers of planets and phases, position 0 is a whole number of pitches from the pitch point
    fraction = np.asarray(positions) / POSITIONS - 2.0
    pair = GearPair(gears.planet, gears.ring, gears.centre_distance, angle, s.material, state_2=RING_STATE)
    torque = s.force * gears.planet.base_radius
    return torque_rotation(pair, torque, fraction, edges=edges, refine=refine)


def corner_differences(ours: PairStiffness, other: TorqueRotation, force: float) -> tuple[float, float]:
    """Largest difference of the deflections, relative, and of the loads of tooth pairs, of the mesh force."""
    np.testing.assert_allclose(ours.fraction, other.fraction)
    deflection = np.abs(other.secant / ours.secant - 1.0).max()
    loads = [
        abs(mine.get(i, 0.0) - theirs.get(i, 0.0))
        for mine, theirs in zip(ours.pair_force, other.pair_force, strict=True)
        for i in {*mine, *theirs}
    ]
    return float(deflection), max(loads) / force


def tip_corners() -> tuple[Row, ...]:
    """Planet and ring where tip corners begin to carry, carry most, and leave."""
    s, positions = corner_set(), (24, 48, 52, 54, 55, 56, 58, 61, 62)
    ours = mesh_alone(s.gears, corner_bodies(), s.force, PLANET_RING, positions)
    other = corner_by_rotation(positions)
    coarse = corner_by_rotation(positions, edges=8, refine=0.5)
    change = np.abs(coarse.deflection / other.deflection - 1.0).max()
    deflection, load = corner_differences(ours, other, s.force)
    name = f"18/27/72, planet-ring, {len(positions)} positions with tip corners: "
    swing = [1e6 * float(np.ptp(d)) for d in (other.deflection, s.force / ours.secant)]
    rows = [
        at_most("pair", "elements 1.5 times as large", name + "resolved, change", 1e-3, change),
        at_most("pair", SOURCE, name + "deflection, largest difference", 5e-3, deflection, note=INCLINED),
        at_most("pair", SOURCE, name + "load of a tooth pair over mesh force, difference", 1e-2, load),
        within("pair", SOURCE, name + "transmission error peak to peak [um]", *swing, 0.02, note=INCLINED),
    ]
    first = positions.index(55)
    for number, place in ((0, "ring tip corner begins"), (2, "planet tip corner leaves")):
        forces = other.pair_force[first][number], ours.pair_force[first][number]
        rows.append(information("pair", SOURCE, f"18/27/72, planet-ring, {place}: force [N]", *forces))
    return tuple(rows)


def other_treatments() -> tuple[Row, ...]:
    """What a contact that is not resolved, and a torque spread over an elastic rim, change."""
    positions, rows = (0, 16, 32), []
    ours = by_compliance(SUN_PLANET, positions)
    for even in (24, 96):
        other = by_rotation(SUN_PLANET, positions, even=even)
        ratio = other.secant / ours.secant - 1.0
        size = reference_set().sun
        length = (size.tip_roll**2 - size.form_roll**2) / (2 * size.base_radius) / even
        note = f"flank elements of {1e6 * length:.0f} um; half width of the contact 60 um"
        name = f"no local treatment, {even} even elements on a flank: secant stiffness of sun-planet, "
        rows.append(
            information(
                "pair",
                "difference to the compliance route",
                name + "largest",
                None,
                ratio[np.abs(ratio).argmax()],
                note=note,
            )
        )
        rows.append(information("pair", "difference to the compliance route", name + "mean", None, ratio.mean()))
    sliding = by_rotation(SUN_PLANET, positions, rim="sliding").secant / ours.secant - 1.0
    name = "torque as tangential forces on the bore of the sun: secant stiffness of sun-planet, mean"
    note = "the bore of the compliance route turns as a rigid circle"
    rows.append(information("pair", "difference to the compliance route", name, None, sliding.mean(), note=note))
    return tuple(rows)


@one_blas_thread()
def depth_compliance() -> float:
    """Largest relative difference of the displacements under the flanks, sectors joined or transformed.

    Loads on the flank nodes of one tooth of the sun, displacements at the joining depths of this tooth and of
    both neighbours.
    """
    from femgear.fe.compliance import condense_sector, directional, interpolation, tooth_compliance
    from validation.reference.substructure import chain, closed_compliance, condensed_sector

    sector = _bodies()[1].sun
    gear, grid, K = sector.gear, sector.grid, sector.stiffness
    stations = flank_stations(grid, gear)
    depth = joining_depth(gear, np.hypot(*stations.points.T), None)[:, None]
    seen = directional(interpolation(grid, stations.points + depth * stations.normals), stations.normals)
    loads, n = flank_load_columns(grid, stations), len(stations.roll)
    options = {"count": gear.teeth, "thickness": gear.face_width}
    loaded = condensed_sector(grid, K, np.hstack([loads, seen]), **options)
    plain = condensed_sector(grid, K, np.zeros((2 * grid.n_nodes, 0)), **options)
    whole = closed_compliance([loaded, loaded, chain(plain, gear.teeth - 2)])
    schur = condense_sector(grid, K, count=gear.teeth, rim="rim", loads=loads, observations=seen).supported()
    cyclic = tooth_compliance(schur)
    same_tooth, next_tooth = whole[n : 2 * n, :n], whole[3 * n : 4 * n, :n]
    size = np.abs(cyclic[0, :n, :n]).max()
    return float(max(np.abs(same_tooth - cyclic[0, :n, :n]).max(), np.abs(next_tooth - cyclic[1, :n, :n]).max()) / size)


def same_depth() -> tuple[Row, ...]:
    """The other way to give both routes one local treatment: displacements at one depth."""
    name = "sun, loads on flank nodes, displacements at the joining depth of two teeth, relative"
    note = "with the same half plane above this depth both routes are one problem"
    source = "27 sectors joined one by one"
    return (at_most("pair", source, name, 1e-9, depth_compliance(), note=note),)
