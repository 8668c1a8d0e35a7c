"""Mesh stiffness from torque and rotation: whole gears in contact, one turned against the other.

A torque on the rim of gear 1 turns it against gear 2, whose rim is held; the mean rotation of the rim times
the base radius is the approach on the line of action. (Optimized design of dynamic characteristics of
planetary gear train, Eqs. 5 to 9, with K = (T/r_b)/(r_b theta).) All tooth pairs that come near take part.

Nothing but outlines, grids and the assembly of elements is shared with the compliance route: the bodies are
put together sector by sector (`substructure`), the flanks meet as they are meshed
(`flank_mortar`), and elements that resolve the width of the contact take the place of the half plane.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from femgear.errors import ContactError
from femgear.gears.gear import half_thickness_angle
from femgear.stages.protocol import one_blas_thread
from validation.reference.flank_mortar import PlacedFlank, flank_contact, smallest_separation
from validation.reference.graded_teeth import Side, flank_curve, graded_sector
from validation.reference.hertz import contact_modulus, hertz_line, relative_radius
from validation.reference.torque_balance import balanced_loads

if TYPE_CHECKING:
    from femgear.fe.elasticity import Material
    from femgear.gears.gear import Gear
    from validation.reference.substructure import Substructure

SPREAD = 1.35
"""Half of the finely divided stretch of flank, in half widths of the contact under the whole load."""
CORNER_REACH = 2.0
"""Of a contact towards a tip corner, which then is divided finely too, in the same half widths."""
ROUGH_STIFFNESS = 10e9
"""Of a mesh per face width, to choose the tooth pairs that may touch [N/m^2]."""
INCREMENT = 0.02
"""Of the torque, for the tangent."""


@dataclass(frozen=True)
class GearPair:
    """Two gears in mesh, gear 1 driving counter-clockwise at the origin; gear 2 may be internal.

    Parameters
    ----------
    gear_1, gear_2 : Gear
    centre_distance, pressure_angle : float
        Working values [m], [rad].
    material : Material
    state_1, state_2 : str or mapping of region to str
        Plane states, see `femgear.fe.elasticity.stiffness`.
    """

    gear_1: Gear
    gear_2: Gear
    centre_distance: float
    pressure_angle: float
    material: Material
    state_1: object = "plane strain"
    state_2: object = "plane strain"

    def placed(self, zeta: float) -> tuple[tuple[float, tuple[float, float]], ...]:
        """Angle of the tooth and centre of both gears for a pair at a path coordinate [m]."""
        result = []
        for gear, way in ((self.gear_1, 1.0), (self.gear_2, -1.0)):
            half = float(half_thickness_angle(gear, gear.base_radius / math.cos(self.pressure_angle)))
            if gear.internal:  # its right flank meets the left one of gear 1, and it turns the same way
                result.append((half + zeta / gear.base_radius, (-self.centre_distance, 0.0)))
            elif way < 0:
                result.append((math.pi - half - zeta / gear.base_radius, (self.centre_distance, 0.0)))
            else:
                result.append((zeta / gear.base_radius - half, (0.0, 0.0)))
        return tuple(result)


@dataclass(frozen=True)
class TorqueRotation:
    """Mesh stiffness at positions of the mesh cycle.

    Parameters
    ----------
    fraction : (P,) array
        Path coordinate of one tooth pair in base pitches, the pitch point being zero.
    force : float
        Torque over the base radius of gear 1 [N].
    deflection : (P,) array
        Mean rotation of the rim of gear 1 times its base radius [m].
    tangent : (P,) array
        From a small increment of the torque [N/m].
    pair_force : tuple of P dicts
        Force of every loaded tooth pair by its number [N].
    unknowns : (P,) int array
        Degrees of freedom of both whole gears.
    residual : float
        Largest violation of the contact conditions, relative to the deflection or the force.
    """

    fraction: np.ndarray
    force: float
    deflection: np.ndarray
    tangent: np.ndarray
    pair_force: tuple[dict[int, float], ...]
    unknowns: np.ndarray
    residual: float

    @property
    def secant(self) -> np.ndarray:
        """Force over deflection (P,) [N/m]."""
        return self.force / self.deflection


@one_blas_thread()
def torque_rotation(
    pair: GearPair,
    torque: float,
    fractions,
    *,
    rim: str = "held",
    edges: int | None = 12,
    refine: float = 1.0,
    flank_elements: int = 24,
) -> TorqueRotation:
    """Torque and rotation of gear 1 at positions of the mesh cycle.

    Parameters
    ----------
    pair : GearPair
    torque : float
        On gear 1 [N m], positive.
    fractions : (P,) array
        Path coordinate of tooth pair 0 in base pitches; all pairs are looked for, so that whole numbers may
        be added.
    rim : {"held", "sliding"}
        Of gear 1: rigid, turning as a whole; or held radially with the torque as uniform tangential forces
        on its nodes, whose mean rotation counts. The rim of gear 2 is held.
    edges : int, optional
        Element edges on one Hertzian half width; None leaves the flanks divided evenly, so that the contact
        is not resolved.
    refine : float
        Divides all other element sizes.
    flank_elements : int
        Element edges along a flank that is divided evenly.

    Raises
    ------
    ContactError
        No torque, no contact, or a contact that runs out of the finely divided flank.
    GridError
    """
    from femgear.fe.meshing import mesh_outlines

    if not torque > 0:
        raise ContactError(f"a torque of {torque} N m", code="E-TORQUE", limit="above 0 N m")
    fractions = np.atleast_1d(np.asarray(fractions, float))
    force = torque / pair.gear_1.base_radius
    nearest = 4.0 * force / (ROUGH_STIFFNESS * pair.gear_1.face_width)
    options = _Division(edges, refine, flank_elements, force, nearest)
    gears = tuple(_whole_gear(pair, k, options, rim if k == 0 else "held") for k in (0, 1))
    plans = [_near_pairs(pair, fraction, options) for fraction in fractions]
    outlines = [sector for plan in plans for gear_plan in plan for sector in gear_plan.sectors]
    grids = iter(mesh_outlines(outlines))
    meshed_plans = []
    for plan in plans:
        meshed = [replace(gear_plan, grids=(next(grids), next(grids))) for gear_plan in plan]
        meshed_plans.append(_one_position(pair, gears, meshed, options))
    deflection, tangent, shares, unknowns, residual = zip(*meshed_plans, strict=True)
    return TorqueRotation(
        fractions,
        options.force,
        np.array(deflection),
        np.array(tangent),
        shares,
        np.array(unknowns),
        max(residual),
    )


@dataclass(frozen=True)
class _Division:
    """How flanks are divided, the mesh force [N], and how near tooth pairs must come to take part [m]."""

    edges: int | None
    refine: float
    flank_elements: int
    force: float
    nearest: float


@dataclass(frozen=True)
class _PairPlan:
    """A tooth pair that may touch: outlines of both sectors, angles and centres of both teeth, grids."""

    number: int
    sectors: tuple
    places: tuple
    slave: int
    middle: np.ndarray
    half_width: float
    grids: tuple = ()


def _near_pairs(pair: GearPair, fraction: float, options: _Division) -> list[_PairPlan]:
    """Tooth pairs that come near at a position, finely divided where they do."""
    gears, pitch = (pair.gear_1, pair.gear_2), pair.gear_1.base_pitch
    evenly = [flank_curve(gear, _side(k, gear), refine=4.0) for k, gear in enumerate(gears)]
    plans = []
    for number in np.arange(-3, 4) - round(fraction):
        zeta = (fraction + number) * pitch
        places = pair.placed(zeta)
        flanks = [PlacedFlank(c, a, np.array(m)) for c, (a, m) in zip(evenly, places, strict=True)]
        # beyond the pitch point the tip of gear 1 ends the contact, before it that of gear 2
        slave = 0 if zeta >= 0 else 1
        gap, edge = smallest_separation(flanks[slave], flanks[1 - slave])
        if not gap < options.nearest:
            continue
        middle = flanks[slave].placed[2 * edge + 1]
        rolls = [_roll(gear, middle - place[1]) for gear, place in zip(gears, places, strict=True)]
        a = _half_width(pair, rolls, options.force)
        end = _tip(flanks[slave], gears[slave])
        corners = (None, None)
        if np.hypot(*(middle - end)) < CORNER_REACH * a:
            corners = [_roll(gear, end - place[1]) for gear, place in zip(gears, places, strict=True)]
        sectors = tuple(
            graded_sector(
                gear,
                _side(k, gear),
                roll,
                a,
                edges=options.edges,
                refine=options.refine,
                flank_elements=options.flank_elements,
                corner=corner,
            )
            for k, (gear, roll, corner) in enumerate(zip(gears, rolls, corners, strict=True))
        )
        plans.append(_PairPlan(int(number), sectors, places, slave, middle, a))
    if not plans:
        raise ContactError("no tooth pair comes near", code="E-CONTACT", remedy="check the centre distance")
    return plans


def _tip(flank, gear) -> np.ndarray:
    """Tip corner of a placed flank [m]."""
    radius = np.hypot(*flank.points[[0, -1]].T)
    return flank.placed[[0, -1][int(np.abs(radius - gear.tip_radius).argmin())]]


def _side(k, gear) -> Side:
    return "right" if gear.internal else "left"


def _roll(gear, from_centre) -> float:
    """Roll length of a point [m], within the flank."""
    roll = math.sqrt(max(float(from_centre @ from_centre) - gear.base_radius**2, 0.0))
    low, high = sorted((gear.form_roll, gear.tip_roll))
    return min(max(roll, low), high)


def _half_width(pair, rolls, force) -> float:
    """Hertzian half width under the whole mesh force [m]; for the division of the flanks alone."""
    material = pair.material
    E, nu = material.youngs_modulus, material.poisson_ratio
    radius = relative_radius(rolls[0], -rolls[1] if pair.gear_2.internal else rolls[1])
    return hertz_line(force / pair.gear_1.face_width, radius, contact_modulus(E, nu, E, nu)).half_width


@dataclass(frozen=True)
class _WholeGear:
    """One gear: the sector that all teeth without contact share, condensed, and chains of it by length."""

    gear: Gear
    state: object
    material: Material
    sector: Substructure
    nodes: int
    rim: str
    chains: dict[int, Substructure] = field(default_factory=dict)


def _compliance(whole: _WholeGear, loaded) -> tuple[np.ndarray, int]:
    """Compliance between the loads of teeth that follow each other counter-clockwise, and unknowns.

    Parameters
    ----------
    whole : _WholeGear
    loaded : list of (grid, loads (2n, m))
    """
    from femgear.fe.elasticity import stiffness
    from validation.reference.substructure import chain, closed_compliance, condensed_sector

    width, teeth = whole.gear.face_width, whole.gear.teeth
    parts = [
        condensed_sector(
            grid,
            stiffness(grid, whole.material, state=whole.state, thickness=width),
            loads,
            count=teeth,
            thickness=width,
            rim=whole.rim,
        )
        for grid, loads in loaded
    ]
    rest = teeth - len(parts)
    if rest not in whole.chains:
        whole.chains[rest] = chain(whole.sector, rest)
    # cuts are counted twice: a small share
    unknowns = 2 * (rest * whole.nodes + sum(grid.n_nodes for grid, _ in loaded))
    return closed_compliance([*parts, whole.chains[rest]], rim=whole.rim), unknowns


def _whole_gear(pair: GearPair, k: int, options: _Division, rim: str) -> _WholeGear:
    """Mesh and condense the sector that all teeth without contact share."""
    from femgear.fe.elasticity import stiffness
    from femgear.fe.grid import mirror
    from femgear.fe.meshing import mesh_outline
    from femgear.gears.tooth import half_sector
    from validation.reference.substructure import condensed_sector

    gear, state = ((pair.gear_1, pair.state_1), (pair.gear_2, pair.state_2))[k]
    half = half_sector(gear, refine=options.refine, flank_elements=options.flank_elements)
    grid, width = mirror(mesh_outline(half)), gear.face_width
    K = stiffness(grid, pair.material, state=state, thickness=width)
    none = np.zeros((2 * grid.n_nodes, 0))
    sector = condensed_sector(grid, K, none, count=gear.teeth, thickness=width, rim=rim)
    return _WholeGear(gear, state, pair.material, sector, grid.n_nodes, rim)


def _one_position(pair, gears, plans, options):
    """Deflection, tangent, forces of the pairs, unknowns and residual at one position."""
    contacts, loaded = [], ([], [])
    for plan in plans:
        contact, loads = _pair_contact(pair, plan)
        contacts.append(contact)
        for k in (0, 1):
            loaded[k].append((plan.grids[k], loads[k]))
    sizes = [len(contact.gap) for contact in contacts]
    H, unknowns = np.zeros((sum(sizes),) * 2), 0
    for k, gear in enumerate(gears):
        # teeth of gear 2 follow each other clockwise where those of gear 1 do counter-clockwise
        backwards = k == 1 and not gear.gear.internal
        order = list(range(len(plans)))[:: -1 if backwards else 1]
        C, count = _compliance(gear, [loaded[k][i] for i in order])
        ends = np.cumsum([0, *sizes])
        place = np.concatenate([np.arange(ends[i], ends[i + 1]) for i in order])
        H[np.ix_(place, place)] += C
        unknowns += count
    gap = np.concatenate([contact.gap for contact in contacts])
    arm = np.concatenate([contact.arm for contact in contacts])
    states = [balanced_loads(H, gap, arm, (1 + step) * options.force) for step in (-INCREMENT, 0, INCREMENT)]
    loads, deflection, residual = states[1]
    tangent = 2 * INCREMENT * options.force / (states[2][1] - states[0][1])
    of_pair = np.split(loads, np.cumsum(sizes)[:-1])
    _check_windows(plans, contacts, of_pair, deflection, options)
    shares = {plan.number: float(part.sum()) for plan, part in zip(plans, of_pair, strict=True) if part.any()}
    return deflection, tangent, shares, unknowns, residual


def _pair_contact(pair, plan):
    """Contact terms of one pair and the loads (2n, m) on both of its sectors."""
    from femgear.fe.grid import ordered_nodes

    nodes = [ordered_nodes(grid, "contact") for grid in plan.grids]
    flanks = [
        PlacedFlank(grid.points[node], angle, np.array(centre))
        for grid, node, (angle, centre) in zip(plan.grids, nodes, plan.places, strict=True)
    ]
    slave, master = plan.slave, 1 - plan.slave
    middles = flanks[slave].placed[1::2]
    near = np.flatnonzero(np.hypot(*(middles - plan.middle).T) < SPREAD * plan.half_width)
    if not len(near):  # elements wider than the contact
        near = np.array([np.hypot(*(middles - plan.middle).T).argmin()])
    near = max(near[0] - 2, 0), min(near[-1] + 2, len(middles) - 1)
    contact = flank_contact(flanks[slave], flanks[master], near, drives=slave == 0, base_radius=pair.gear_1.base_radius)
    loads = [None, None]
    for k, nodal in ((slave, contact.slave_load), (master, contact.master_load)):
        whole = np.zeros((2 * plan.grids[k].n_nodes, nodal.shape[2]))
        whole[2 * nodes[k]], whole[2 * nodes[k] + 1] = nodal[:, 0], nodal[:, 1]
        loads[k] = whole
    return contact, loads


def _check_windows(plans, contacts, of_pair, deflection, options):
    """Refuse contacts that run out of the edges that may touch, and pairs that were left out too early."""
    for plan, contact, part in zip(plans, contacts, of_pair, strict=True):
        if any(inside and load > 0 for inside, load in zip(contact.goes_on, part[[0, -1]], strict=True)):
            raise ContactError(
                f"the contact of tooth pair {plan.number} runs out of the edges that may touch",
                code="E-CONTACT",
                remedy="divide the flanks more finely",
            )
    if deflection > options.nearest:
        raise ContactError(
            f"a deflection of {1e6 * deflection:.3g} um, tooth pairs were looked for within "
            f"{1e6 * options.nearest:.3g} um",
            code="E-CONTACT",
            remedy="reduce the torque",
        )
