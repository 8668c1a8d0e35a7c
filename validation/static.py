"""Static solution of the reference set: equilibrium, stiffness, discretisation, a general solver, gaps."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from femgear.contact.assembly import assemble_contact
from femgear.contact.bodies import make_bodies, make_sectors
from femgear.contact.cycle import CycleOptions, walk_mesh_cycle
from femgear.contact.solve import solve_contact
from femgear.contact.windows import mesh_windows
from femgear.gears.iso6336_stiffness import mesh_stiffness_method_b
from validation.cases import reference_material, reference_static
from validation.reference.closed_form import share_load
from validation.reference.tangent import mesh_tangent_matrix
from validation.rows import Row, at_most, counted, information, within

POSITIONS = 64
MESHES = (("sun-planet", 0), ("planet-ring", 3))


@cache
def _setup(positions: int, nearest: float):
    """Contact windows of the reference set with room for uneven sharing."""
    static = reference_static()
    share = static.sun_torque / static.planetary_set.sun.base_radius
    return mesh_windows(
        static.planetary_set,
        static.bodies,
        share=share,
        positions=positions,
        cells=36,
        nearest=nearest,
        contact="profile",
    )


def _problem(position, gaps, *, positions=POSITIONS, nearest=30e-6):
    """Contact problem of the reference set at one position, and its load."""
    static = reference_static()
    setup = _setup(positions, nearest)
    load = np.append(np.zeros(3), static.sun_torque / static.planetary_set.sun.base_radius)
    problem = assemble_contact(setup, static.bodies, position)
    shift = np.append(np.asarray(gaps, float), np.zeros(3))
    return replace(problem, gap=problem.gap + shift[problem.mesh]), load


def equilibrium() -> tuple[Row, ...]:
    """Balance of every body and the contact conditions at 64 positions."""
    planets = sun = work = separation = 0.0
    lowest = np.inf
    for position in range(POSITIONS):
        problem, load = _problem(position, np.zeros(3))
        state = solve_contact(problem.H, problem.gap, problem.G, load)
        force = np.bincount(problem.mesh, weights=state.loads, minlength=6)
        planets = max(planets, np.abs(force[:3] - force[3:]).max() / load[3])
        sun = max(sun, abs(force[:3].sum() / load[3] - 1))
        work = max(work, np.abs(state.loads * state.gaps).max())
        gaps = problem.gap + problem.H @ state.loads - problem.G @ state.motions
        separation = max(separation, np.abs(gaps - state.gaps).max() / np.abs(state.motions).max())
        lowest = min(lowest, state.loads.min(), state.gaps.min())
    cycle = reference_static().cycle
    share = np.abs(cycle.load_share - 1 / 3).max()
    name = f"{POSITIONS} positions: "
    return (
        at_most("static", "equilibrium", name + "force imbalance of a planet over the load", 1e-9, planets),
        at_most("static", "equilibrium", name + "sum of the sun's mesh forces over the load, less 1", 1e-9, sun),
        at_most("static", "definition", name + "largest load times separation [N m]", 0.0, work),
        at_most("static", "definition", name + "most negative load or separation", 0.0, min(lowest, 0.0)),
        at_most("static", "definition", name + "separation against H p - G q over motion", 1e-9, separation),
        at_most("static", "symmetry", name + "identical planets, share less 1/3", 1e-9, share),
    )


def iso_stiffness() -> tuple[Row, ...]:
    """E1: mean mesh stiffness against ISO 6336-1, method B."""
    static = reference_static()
    s, cycle = static.planetary_set, static.cycle
    rows = []
    for (name, mesh), first, two, ratio in (
        (MESHES[0], s.sun, s.planet, s.contact_ratio_sun_planet),
        (MESHES[1], s.planet, s.ring, s.contact_ratio_planet_ring),
    ):
        teeth = np.inf if two.internal else two.teeth
        shifts = first.profile_shift, two.profile_shift
        standard = mesh_stiffness_method_b(first.teeth, teeth, *shifts, contact_ratio=ratio, dedendum=1.25)[1]
        width = 1e9 * s.sun.face_width
        for kind, stiffness in (("tangent", cycle.stiffness), ("secant", cycle.secant_stiffness)):
            ours = stiffness[mesh].mean() / width
            quantity = f"c_gamma {name}, mean {kind} stiffness [N/(mm um)]"
            if kind == "tangent":
                rows.append(within("E1", "ISO 6336-1 method B", quantity, standard * 1e-9, ours, 0.15))
            else:
                rows.append(information("E1", "ISO 6336-1 method B", quantity, standard * 1e-9, ours))
    return tuple(rows)


def _figures(cycle):
    """Mean tangent stiffness [N/m] and peak-to-peak transmission error [m] of both kinds of mesh."""
    return cycle.stiffness.mean(axis=1)[[0, 3]], np.ptp(cycle.deflection, axis=1)[[0, 3]]


def _changes(label: str, cycle) -> tuple[Row, ...]:
    base, varied = _figures(reference_static().cycle), _figures(cycle)
    rows = []
    for kind, gate, before, after in zip(
        ("mean mesh stiffness [N/um]", "transmission error, peak to peak [um]"), (0.01, 0.03), base, varied
    ):
        scale = 1e-6 if gate == 0.01 else 1e6
        for (name, _), reference, value in zip(MESHES, before, after, strict=True):
            quantity = f"{label}: {name}, {kind}"
            rows.append(
                within("convergence", "the case as it stands", quantity, reference * scale, value * scale, gate)
            )
    return tuple(rows)


def _walk(bodies, **options):
    static = reference_static()
    return walk_mesh_cycle(static.planetary_set, bodies, sun_torque=static.sun_torque, **options)


def numerical_parameters() -> tuple[Row, ...]:
    """Joining depth, positions and pressure cells varied, the grids kept."""
    static = reference_static()
    material, module = reference_material(), static.planetary_set.sun.module
    rows = []
    for factor in (1 / 3, 0.7, 1.3, 3.0):
        bodies = make_bodies(static.sectors, material, depth=factor * 0.25 * module)
        rows.extend(_changes(f"half-plane depth times {factor:.2g}", _walk(bodies)))
    rows.extend(_changes("positions doubled", _walk(static.bodies, positions=2 * POSITIONS)))
    rows.extend(_changes("pressure cells doubled", _walk(static.bodies, options=CycleOptions(cells=72))))
    return tuple(rows)


def element_size() -> tuple[Row, ...]:
    """Element size doubled and halved on the flank, halved everywhere."""
    static = reference_static()
    rows = []
    for label, options in (
        ("flank elements doubled", {"flank_elements": 12}),
        ("flank elements halved", {"flank_elements": 48}),
        ("flank elements quartered, all others halved", {"flank_elements": 48, "refine": 2.0}),
    ):
        sectors = make_sectors(static.planetary_set, reference_material(), **options)
        rows.extend(_changes(label, _walk(make_bodies(sectors, reference_material()))))
    return tuple(rows)


def _by_daqp(problem, load) -> np.ndarray:
    """Loads of the quadratic program ``min p'Hp/2 + gap'p, p >= 0, G'p = load`` by daqp."""
    import daqp

    n, m = problem.G.shape
    unit, mean = np.abs(load).max(), np.trace(problem.H) / n
    upper, lower = np.r_[np.full(n, 1e30), load / unit], np.r_[np.zeros(n), load / unit]
    sense = np.r_[np.zeros(n), np.full(m, 5)].astype(np.int32)
    cost, arms = np.ascontiguousarray(problem.H / mean), np.ascontiguousarray(problem.G.T)
    gap = problem.gap / mean / unit
    loads, _, flag, _ = daqp.solve(cost, gap, arms, upper, lower, sense, primal_tol=1e-12, dual_tol=1e-12)
    return loads * unit if flag == 1 else np.full(n, np.nan)


def _against_daqp(count: int) -> tuple[Row, ...]:
    rng = np.random.default_rng(27)
    worst, sets, idle = 0.0, 0, 0
    for trial in range(count):
        # every fourth problem has a planet so far away that it carries nothing
        gaps = 10 ** rng.uniform(-8, -5, 3)
        if trial % 4 == 0:
            gaps[trial // 4 % 3] = 25e-6
        problem, load = _problem(int(rng.integers(POSITIONS)), gaps)
        state = solve_contact(problem.H, problem.gap, problem.G, load)
        oracle = _by_daqp(problem, load)
        worst = max(worst, np.abs(state.loads - oracle).max() / state.loads.max())
        sets += int(np.array_equal(state.active, oracle > 1e-9 * oracle.max()))
        force = np.bincount(problem.mesh, weights=state.loads, minlength=6)
        idle += int((force[:3] == 0).any())
    name = f"{count} random positions and planet gaps: "
    return (
        at_most("daqp", "daqp, a general active-set solver", name + "largest load difference", 1e-9, worst),
        counted("daqp", "daqp", name + "problems with the same active cells", count, sets),
        information("daqp", "definition", name + "problems with a planet that carries nothing", None, idle),
    )


def some_random_problems() -> tuple[Row, ...]:
    """The active set against daqp, a few problems."""
    return _against_daqp(12)


def random_problems() -> tuple[Row, ...]:
    """The active set against daqp, 200 problems."""
    return _against_daqp(200)


def planet_gaps() -> tuple[Row, ...]:
    """A gap on one planet, with the closed form of springs in series and parallel."""
    rows = []
    source = "Delta = (F + sum c/s)/sum 1/s, F_n = (Delta - c_n)/s_n"
    for gap in (1e-6, 3e-6):
        for position in (0, 24, 48):
            problem, load = _problem(position, [gap, 0.0, 0.0])
            # the closed form has no compliance between meshes
            H = problem.H * (problem.mesh[:, None] == problem.mesh)
            state = solve_contact(H, problem.gap, problem.G, load)
            a = np.diag(mesh_tangent_matrix(H, state.active, problem.mesh, 6))
            b = np.array([_preload(H, problem, state.active, j) for j in range(6)])
            expected = share_load(a[:3], a[3:], b[:3], b[3:], load[3]).force / load[3]
            ours = np.bincount(problem.mesh, weights=state.loads, minlength=6)[:3] / load[3]
            name = f"gap of {1e6 * gap:g} um on planet 1, position {position}/64: its share"
            rows.append(within("sharing", source, name, expected[0], ours[0], 1e-9))
            coupled = solve_contact(problem.H, problem.gap, problem.G, load)
            share = coupled.loads[problem.mesh == 0].sum() / load[3]
            note = "with the compliance that the meshes share through sun and planets"
            quantity = name + ", bodies coupled"
            rows.append(information("sharing", source, quantity, expected[0], share, note=note))
    return tuple(rows)


def _preload(H, problem, active, mesh) -> float:
    """``1' H_AA^-1 e`` of one mesh: what its separations take away from its force [N]."""
    cells = np.flatnonzero(active & (problem.mesh == mesh))
    return float(np.linalg.solve(H[np.ix_(cells, cells)], problem.gap[cells]).sum())
