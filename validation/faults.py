"""Rows of faulty teeth: cracks by energy and one grid, none at all, faults together, wear, and frequencies."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from scipy.linalg import solve
from scipy.sparse import block_diag, coo_array, csc_array, csr_array

from femgear.case.dependencies import Steps
from femgear.contact.assembly import contact_candidates
from femgear.contact.batch import solve_with_cracks
from femgear.contact.bodies import Bodies, Sector, flank_load_columns, flank_stations, make_bodies, make_sectors
from femgear.contact.cracked_flanks import (
    both_flank_loads,
    crack_stiffness,
    cracked_flanks,
    cracked_grids,
    flanks_of_grids,
)
from femgear.contact.cycle import walk_mesh_cycle
from femgear.contact.mesh_cycle import MeshCycle
from femgear.contact.windows import first_windows, mesh_windows
from femgear.fe.compliance import boundary_nodes, node_dofs, symmetric_factor
from femgear.fe.cracks import SplitGrid, WholeSchur, condense_whole, cracked_ring, split_grid
from femgear.fe.elasticity import Material
from femgear.fe.grid import Grid, copy_nodes, shape_functions
from femgear.gears.cracked_tooth import BESIDE, SECTION
from femgear.gears.deviations import no_deviations
from femgear.gears.faults import LEFT, Crack, Spall, Wear
from femgear.gears.gear import Gear
from femgear.gears.kinematics import speeds
from femgear.gears.planetary import close_set, equal_planet_angles
from femgear.stages.static import solve_static
from femgear.stages.tooth_faults import fault_frequencies
from femgear.study.wear import WearRequest, wear_of_case
from femgear.trains.reading import read_case, with_values
from validation.planetary import reference_set
from validation.rows import Row, at_most, counted, printed, within

CASES = Path(__file__).parents[1] / "cases"
STEEL = Material(206e9, 0.3, 7850.0)
ANGLE, DEPTHS, ELEMENTS = math.radians(70.0), (1.0e-3, 1.5e-3), 12
STEP = 0.02
"""Change of the depth to either side, for the derivative of the energy."""
RADII = 0.35, 0.7
"""Of the domains of J, over the depth of the crack."""
# of degree 4, D. A. Dunavant, Int. J. Numer. Meth. Eng. 21, 1985
_A, _B = 0.445948490915965, 0.091576213509771
_POINTS = np.array([[_A, _A], [1 - 2 * _A, _A], [_A, 1 - 2 * _A], [_B, _B], [1 - 2 * _B, _B], [_B, 1 - 2 * _B]])
_WEIGHTS = 0.5 * np.repeat([0.223381589678011, 0.109951743655322], 3)


def crack_of(depth: float, number: int = 0) -> Crack:
    """Crack of tooth 0 of a gear of the reference set, at its left root."""
    return Crack(number, 0, 0, LEFT, None, ANGLE, depth)


@cache
def sector_of(number: int, elements: int = ELEMENTS) -> Sector:
    """Sector of a gear of the reference set."""
    return make_sectors(reference_set(), STEEL, flank_elements=elements).gears[number]


def cut_ring(whole: WholeSchur, cracked: WholeSchur, count: int) -> np.ndarray:
    """Compute the compliance (count L, count L) of a ring with one cracked sector by the matrix of all its cuts [m/N].

    What the update of `femgear.fe.cracks.cracked_ring` must give.
    """
    nb, L = len(whole.stiffness) // 2, whole.load_cut.shape[1]
    matrix, loads = np.zeros((count * nb,) * 2), np.zeros((count * nb, count * L))
    compliance = np.zeros((count * L,) * 2)
    for k in range(count):
        sector = cracked if k == 0 else whole
        rows = np.concatenate([((k - 1) % count) * nb + np.arange(nb), k * nb + np.arange(nb)])
        columns = k * L + np.arange(L)
        matrix[np.ix_(rows, rows)] += sector.stiffness
        loads[np.ix_(rows, columns)] += sector.load_cut
        compliance[np.ix_(columns, columns)] += sector.compliance
    return compliance + loads.T @ solve(matrix, loads, assume_a="pos")


def update_identity() -> tuple[Row, ...]:
    """The compliance of a gear with one cracked sector by its update and by the whole matrix of all cuts."""
    rows = []
    for number, gear in enumerate(reference_set().gears[:2]):
        whole, split = cracked_grids(gear, crack_of(1.2e-3, number), flank_elements=4)
        before, after = (
            condense_whole(grid, crack_stiffness(grid, gear, STEEL, None), both_flank_loads(grid, gear), held="rim")
            for grid in (whole, split.grid)
        )
        ring = cracked_ring(before, before, after, gear.teeth)
        healthy, cracked = (cut_ring(before, sector, gear.teeth) for sector in (before, after))
        basis = ring.basis.reshape(len(healthy), -1)
        missed = np.abs(cracked - healthy - basis @ ring.core @ basis.T).max() / np.abs(healthy).max()
        text = f"{gear.name}, crack of 1.2 mm: all flanks, update - whole matrix, over the largest compliance"
        rows.append(at_most("crack, identity", "block-cyclic matrix of all cuts, solved directly", text, 1e-12, missed))
    return tuple(rows)


def no_crack() -> tuple[Row, ...]:
    """What a grid that is made for a crack, and parts at no node, changes in compliance and contact: not one bit."""
    return *no_crack_of(0), *no_crack_of(1)


def no_crack_of(number: int) -> tuple[Row, ...]:
    """Rows of `no_crack` of one gear."""
    gears, source = reference_set(), "the healthy gear"
    gear, crack, sectors = gears.gears[number], crack_of(1.2e-3, number), make_sectors(gears, STEEL, flank_elements=4)
    whole, _ = cracked_grids(gear, crack, flank_elements=4)
    part_nowhere = split_grid(whole, SECTION, 1, BESIDE[0])
    flanks = flanks_of_grids(sectors.gears[number], STEEL, crack.form, whole, part_nowhere)
    healthy = make_bodies(sectors, STEEL)
    unparted = healthy.with_gear(number, replace(healthy.gears[number], cracks=(flanks,)))
    states = _contact(healthy, ()), _contact(unparted, (crack,))
    differing = sum(int((a != b).sum()) for a, b in zip(*states, strict=True))
    total = sum(part.size for part in states[0])
    words = f"{gear.name}, grid that parts nowhere"
    return (
        at_most(
            "crack, none",
            source,
            f"{words}: change of the compliance between all flanks [m/N]",
            0.0,
            np.abs(flanks.ring.core).max(),
        ),
        counted("crack, none", source, f"{words}, contact: numbers that differ, of {total}", 0, differing),
    )


def _contact(bodies: Bodies, faults: tuple[Crack, ...]) -> tuple[np.ndarray, ...]:
    """Compliance between all windows, loads, gaps and motions of the reference set at four positions under 100 N m."""
    gears, torque = reference_set(), 100.0
    share, nearest = first_windows(gears, bodies, torque)
    deviations = replace(no_deviations(gears), faults=faults)
    setup = mesh_windows(
        gears, bodies, share=share, nearest=nearest, positions=np.arange(4) + np.arange(4) / 4, deviations=deviations
    )
    candidates = contact_candidates(setup, bodies, np.arange(4))
    load = np.zeros(candidates.approach.shape[1])
    load[setup.driver] = torque / gears.sun.base_radius
    candidates, state = solve_with_cracks(candidates, load)
    return candidates.images, state.loads, state.gaps, state.motions


def one_grid() -> tuple[Row, ...]:
    """What a crack changes in the compliance of the whole gear, beside all its teeth in one grid."""
    rows, source = list[Row](), "one grid of all teeth, with the crack and without"
    for number in (0, 1):
        sector, gear = sector_of(number, 6), reference_set().gears[number]
        crack = crack_of(1.5e-3, number)
        grids = cracked_grids(gear, crack, flank_elements=6)
        whole, cracked = (_whole_gear(sector, grid) for grid in (grids[0], grids[1].grid))
        ring = cracked_flanks(sector, STEEL, crack, flank_elements=6).ring
        basis = np.concatenate([ring.basis[-1], ring.basis[0], ring.basis[1]])
        ours, theirs = basis @ ring.core @ basis.T, cracked - whole
        L = ring.basis.shape[1]
        for words, block in (
            ("cracked tooth", (slice(L, 2 * L),) * 2),
            ("tooth before it, loads on the cracked one", (slice(0, L), slice(L, 2 * L))),
        ):
            scale = np.abs(theirs[block]).max()
            text = f"{gear.name}, {words}: change of the compliance, largest error over the largest change"
            rows.append(at_most("crack, one grid", source, text, 0.01, np.abs(ours - theirs)[block].max() / scale))
    return tuple(rows)


def _whole_gear(sector: Sector, first: Grid) -> np.ndarray:
    """Compliance between the flanks of the last, first and second tooth in one grid, with the sector of the first."""
    gear, numbers = sector.gear, copy_nodes(sector.grid, sector.gear.teeth)
    teeth, total = gear.teeth, int(numbers.max()) + 1
    of_first = total + np.arange(first.n_nodes)
    for side in ("left", "right"):
        here, there = (
            nodes[np.argsort(np.hypot(*grid.points[nodes].T))]
            for grid in (first, sector.grid)
            for nodes in (boundary_nodes(grid, f"cut_{side}"),)
        )
        of_first[here] = numbers[0][there]
    parts, size = [], 2 * (total + first.n_nodes)
    for k in range(teeth):
        matrix = crack_stiffness(first, gear, STEEL, None) if k == 0 else sector.stiffness
        number, turn = (of_first, 0.0) if k == 0 else (numbers[k], k * gear.pitch_angle)
        c, s = math.cos(turn), math.sin(turn)
        rotation = block_diag([np.array([[c, -s], [s, c]])] * len(number)).tocsr()
        local = coo_array(rotation @ csr_array(matrix) @ rotation.T)
        dofs = node_dofs(number)
        parts.append((local.data, dofs[local.row], dofs[local.col]))
    data, row, column = (np.concatenate(values) for values in zip(*parts, strict=True))
    K = csc_array(coo_array((data, (row, column)), shape=(size, size)))
    held = [
        of_first[boundary_nodes(first, "rim")],
        *(numbers[k][boundary_nodes(sector.grid, "rim")] for k in range(1, teeth)),
    ]
    loads = np.zeros((size, 0))
    for k in (-1, 0, 1):
        grid, number = (first, of_first) if k == 0 else (sector.grid, numbers[k])
        local, turn = both_flank_loads(grid, gear), k * gear.pitch_angle
        c, s = math.cos(turn), math.sin(turn)
        columns = np.zeros((size, local.shape[1]))
        columns[2 * number], columns[2 * number + 1] = (
            c * local[0::2] - s * local[1::2],
            s * local[0::2] + c * local[1::2],
        )
        loads = np.hstack([loads, columns])
    used = np.setdiff1d(np.unique(row), node_dofs(np.concatenate(held)))
    solution = symmetric_factor(K[used][:, used]).solve(loads[used])
    return loads[used].T @ solution


def energy_release() -> tuple[Row, ...]:
    """Energy release rate of a crack by J in two domains, beside the change of the energy with its length."""
    rows, gear = list[Row](), reference_set().sun
    for depth in DEPTHS:
        energy = [_loaded(gear, (1.0 + step) * depth)[0] for step in (-STEP, STEP)]
        rate = (energy[1] - energy[0]) / (2.0 * STEP * depth) / gear.face_width
        _, split, field = _loaded(gear, depth)
        for radius in RADII:
            text = f"sun, crack of {1e3 * depth:g} mm, domain of {radius:g} times that: J [N/m]"
            source = "change of the elastic energy with the length under a constant load, dU/da"
            rows.append(within("crack, energy", source, text, rate, j_integral(split, field, radius * depth), 0.02))
    return tuple(rows)


def _loaded(gear: Gear, depth: float) -> tuple[float, SplitGrid, np.ndarray]:
    """Energy [J] that a crack adds to a sector, held at cuts and rim, under 1 kN on its flank; grid and displacement.

    The same grid without the crack has what the load itself, which acts on a node, makes of the grid beside it.
    """
    whole, split = cracked_grids(gear, crack_of(depth), flank_elements=ELEMENTS)
    energy, field = 0.0, np.zeros(0)
    for grid, sign in ((whole, -1.0), (split.grid, 1.0)):
        load = 1e3 * flank_load_columns(grid, flank_stations(grid, gear))[:, 3 * ELEMENTS // 4]
        held = np.concatenate([boundary_nodes(grid, name) for name in ("rim", "cut_left", "cut_right")])
        free = np.setdiff1d(np.arange(2 * grid.n_nodes), node_dofs(held))
        K = csc_array(crack_stiffness(grid, gear, STEEL, None))
        field = np.zeros(2 * grid.n_nodes)
        field[free] = symmetric_factor(K[free][:, free]).solve(load[free])
        energy += sign * 0.5 * float(load @ field)
    return energy, split, field


def j_integral(split: SplitGrid, field: np.ndarray, radius: float) -> float:
    """Compute J of a crack without loads on its faces by an integral over a disc about its tip [N/m].

    ``J = int (sigma_ij u_i,1 - W delta_1j) q_,j dA`` with the crack along direction 1 and q falling from one at the tip
    to zero at the radius (F. Z. Li, C. F. Shih, A. Needleman, Eng. Fracture Mech. 21, 1985, 405-421), plane strain.
    """
    grid = split.grid
    along = grid.points[split.tip] - grid.points[split.faces[0, 0]]
    c, s = along / np.hypot(*along)
    turn = np.array([[c, s], [-s, c]])
    points = (grid.points - grid.points[split.tip]) @ turn.T
    moved, distance = field.reshape(-1, 2) @ turn.T, np.hypot(*points.T)
    q = np.clip(1.0 - distance / radius, 0.0, 1.0)
    near = grid.triangles[(distance[grid.triangles] < radius).any(axis=1)]
    _, first, second = shape_functions(*_POINTS.T)
    slopes = np.stack([first, second])
    jacobian = np.einsum("aip,eic->epac", slopes, points[near])
    gradient = np.einsum("epab,bip->epai", np.linalg.inv(jacobian), slopes)
    grad_u = np.einsum("epai,eic->epca", gradient, moved[near])
    grad_q = np.einsum("epai,ei->epa", gradient, q[near])
    strain = 0.5 * (grad_u + grad_u.swapaxes(-1, -2))
    lam, mu = STEEL.lame("plane strain")
    stress = 2.0 * mu * strain + lam * np.trace(strain, axis1=-2, axis2=-1)[..., None, None] * np.eye(2)
    density = 0.5 * (stress * strain).sum(axis=(-1, -2))
    inside = np.einsum("epij,epi,epj->ep", stress, grad_u[..., 0], grad_q) - density * grad_q[..., 0]
    area = np.linalg.det(jacobian) * _WEIGHTS
    return float((inside * area).sum())


def over_one_another() -> tuple[Row, ...]:
    """Contact of a tooth with two pits over one another in worn flanks, beside the same gaps in entries by hand."""
    gears = reference_set()
    bodies = make_bodies(make_sectors(gears, STEEL, flank_elements=6), STEEL)
    shallow = Spall(0, 0, 3, LEFT, low=8.2e-3, high=8.8e-3, depth=2e-6)
    deep = replace(shallow, low=8.5e-3, high=9.2e-3, depth=5e-6)
    even = Wear(0, 0, None, LEFT, roll=(0.0, 1.0), depth=(4e-6, 4e-6))
    rising = Wear(0, 0, 3, LEFT, roll=(8e-3, 9e-3), depth=(0.0, 3e-6))
    by_hand = (
        replace(shallow, high=float(np.nextafter(deep.low, 0.0))),
        deep,
        *(replace(even, tooth=tooth) for tooth in range(gears.sun.teeth) if tooth != 3),
        replace(rising, depth=(4e-6, 7e-6)),
    )
    together, written = (
        walk_mesh_cycle(
            gears,
            bodies,
            sun_torque=100.0,
            positions=4,
            deviations=replace(no_deviations(gears), faults=faults),
            periods=gears.sun.teeth,
        )
        for faults in ((shallow, deep, even, rising), by_hand)
    )
    source = "pits side by side and wear in one entry, the gaps added by hand"
    return tuple(
        at_most(
            "faults together",
            source,
            f"two pits over one another in wear of two entries: {words}, largest difference over the largest",
            1e-9,
            np.abs(getattr(together, name) - getattr(written, name)).max() / np.abs(getattr(written, name)).max(),
        )
        for words, name in (("arc of the sun", "sun_arc"), ("loads of tooth pairs", "tooth_load"))
    )


def spalls_in_slices() -> tuple[Row, ...]:
    """Contact of a pair with a spall in all slices of the width beside one across it, and with ever narrower ones."""
    coarse = {"static.flank_elements": 4, "static.positions": 8, "static.stresses": False, "static.slices": 5}
    case, steps = with_values(read_case(CASES / "spur_pair.toml"), coarse), Steps()
    spall = {"kind": "spall", "tooth": 3, "flank": "left", "diameter": "72.9 mm", "length": "1 mm", "depth": "40 um"}

    def contact(*faults: dict[str, str]) -> MeshCycle:
        return solve_static(with_values(case, {"gear_1.fault": list(faults)}), steps=steps).cycle

    across, in_slices = contact(spall), contact(spall | {"width": "19.9 mm"})
    rows, healthy = list[Row](), float(contact().deflection.max())
    for words, name in (("deflection", "deflection"), ("loads of slices", "slice_load")):
        values, other = getattr(across, name), getattr(in_slices, name)
        text = f"spall of 19.9 of 20 mm in 5 slices: {words}, largest difference over the largest"
        missed = np.abs(values - other).max() / np.abs(values).max()
        rows.append(at_most("spall in slices", "the spall across the width", text, 1e-9, missed))
    effects = [float(across.deflection.max()) - healthy]
    effects += [float(contact(spall | {"width": f"{4 * count} mm"}).deflection.max()) - healthy for count in (3, 1)]
    fading = int(effects[0] > effects[1] > effects[2] > 0.0)
    text = "largest deflection by a spall over 5, 3 and 1 of 5 slices falls (yes 1)"
    return *rows, counted("spall in slices", "none is left of a spall without width", text, 1, fading)


def wear_at_constant_load() -> tuple[Row, ...]:
    """Wear of a pair at places where one tooth carries alone, however worn it is, beside Archard's law in closed form.

    A point with the radius of curvature rho meets its mate once a turn and loses ``k F/b |1 - w' rho'/(w rho)|``, with
    ``rho + rho'`` the length of the line of action between the base circles.
    """
    coarse = {"static.flank_elements": 4, "static.positions": 32, "static.stresses": False, "static.peaks": False}
    case, rows = with_values(read_case(CASES / "spur_pair.toml"), coarse), list[Row]()
    teeth, speed, hours, k = np.array([case.gear_1.teeth, case.gear_2.teeth]), case.operation.speeds[0], 400.0, 1e-18
    base = 0.5 * case.module * teeth * math.cos(case.pressure_angle)
    line = math.sqrt(case.set.centre_distance**2 - base.sum() ** 2)
    pitch = 2.0 * math.pi * base[0] / teeth[0]
    tip = [math.sqrt(tip_radius**2 - rb**2) for tip_radius, rb in zip((39.9e-3, 57.6893e-3), base, strict=True)]
    # where no second pair touches, on the line of action from the base circle of gear 1
    alone = tip[0] - pitch, line - tip[1] + pitch
    for steps in (1, 4):
        for place, flank in enumerate(wear_of_case(case, WearRequest(hours, k, steps)).flanks):
            roll_length = np.sqrt(flank.radius**2 - base[place] ** 2)
            from_first = roll_length if place == 0 else line - roll_length
            inside = np.flatnonzero((from_first > alone[0] + 0.1 * pitch) & (from_first < alone[1] - 0.1 * pitch))
            for number in inside[[0, len(inside) // 2, -1]]:
                ratio = (line - roll_length[number]) / roll_length[number] * teeth[place] / teeth[1 - place]
                turns = speed * teeth[0] / teeth[place] / (2.0 * math.pi) * 3600.0 * hours
                expected = k * case.operation.torque / base[0] / case.set.face_width * abs(1.0 - ratio) * turns
                text = f"gear {place + 1}, diameter of {2e3 * flank.radius[number]:.2f} mm, steps {steps}: depth [um]"
                source = "k F/b |1 - v'/v| times the passages, radii of curvature on the line of action"
                rows.append(within("wear", source, text, 1e6 * expected, 1e6 * float(flank.depth[number]), 1e-6))
    return tuple(rows)


def frequencies() -> tuple[Row, ...]:
    """Characteristic frequencies of a set 17/37/91 with three planets, the sun at 800 rpm and the ring held."""
    teeth = (17, 5e-3, "sun"), (37, 10e-3, "planet"), (91, 52e-3, "ring")
    gears = close_set(
        *(Gear(z, 1e-3, math.radians(20), 0.0, 20e-3, rim, internal=z == 91, name=name) for z, rim, name in teeth),
        planet_angles=equal_planet_angles(3),
        find=("sun", "ring"),
    )
    turning = speeds(gears, input="sun", fixed="ring", speed=800 * math.pi / 30)
    often = fault_frequencies(gears, turning.mesh_frequency)
    source = "closed forms from Willis' equation: carrier z_s f_s / (z_s + z_r)"
    values = (
        ("mesh", "190.99", turning.mesh_frequency),
        ("a tooth of the sun meets a planet", "33.70", often["sun"]),
        ("a tooth of a planet meets the sun", "5.16", often["planet"]),
        ("carrier", "2.099", turning.carrier / (2 * math.pi)),
    )
    return tuple(printed("17/37/91", source, f"{words} [Hz]", text, value) for words, text, value in values)
