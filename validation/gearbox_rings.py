"""Elastic rings in the response of gearboxes: the set on its foundation, and a casing that moves under its ring."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sparse
from gearbox_equivalents import elastic_set_tables
from scipy.sparse.linalg import eigsh
from scipy.spatial import cKDTree

from femgear.case.gear_set import material_of, planetary_set
from femgear.fe.elasticity import mass
from femgear.fe.grid import Grid
from femgear.housing.two_way.running_planets import ring_lines, solve_running
from femgear.run import solve
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.trains.elastic.outputs import mesh_and_ring_outputs
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.elastic_ring import elastic_ring
from femgear.trains.gearbox.stage_structure import running_stage, structure_without
from femgear.trains.reading import read_case, with_values
from validation.gearbox_response import without_loss
from validation.rows import Row, at_most, within

SET = "cases/planetary_27_40_108.toml"
UP_TO = 20e3
"""Excitation of all speeds [Hz]."""
CENTRE, FEET = (0.01, -0.02), ((-0.15, -0.12, 2e7, 5e7), (0.15, -0.12, 2e7, 9e7))
"""Of the casing: centre of mass, and x, y [m] and stiffnesses [N/m] of its feet."""
MASS, INERTIA = 30.0, 0.6
"""Of the casing, ring included [kg, kg m^2]."""


def on_foundation() -> tuple[Row, ...]:
    """The reference set at full band; the carrier at rest, for the set leaves out the terms of the turning frame."""
    reference = solve(with_values(read_case(SET), {"dynamics.up_to": f"{UP_TO!r} Hz"}), only="modes")["modes"]
    state = solve_deflection(read_case(_tables()))
    stage = state.model.stages[0]
    ring = elastic_ring(state.model, stage)
    running = without_loss(running_stage(state, stage, ring.excitation, [ring]).running)
    modes = undamped_modes(reference.model.system, reference.excitation.stiffness.mean(axis=1), damping_ratio=0.0)
    n_max, rows = reference.max_diameter, list[Row]()
    theta = np.array([0.5 * np.pi, 0.3])
    around = np.exp(1j * np.outer(np.arange(-n_max, n_max + 1), theta))
    for hertz in (320.0, 1500.0, 4100.0):
        excited = int(UP_TO / hertz)
        options = {"excitation_harmonics": excited, "response_harmonics": excited + 12, "method": "direct"}
        wanted = solve_spectral(modes, reference.excitation, np.array([hertz]), **options)
        both = excited, excited + 12
        response = solve_running(running, 2.0 * np.pi * hertz, 0.0, harmonics=both, side_bands=0, tolerance=1e-13)
        forces = wanted.force[0][[0, len(stage.planets)], 1:]
        apart = np.abs(2.0 * response.force[0, :2, 1:, 0] - forces).max() / np.abs(forces).max()
        text = f"mesh forces, excitation to 20 kHz, mesh frequency {hertz:g} Hz, over the largest"
        rows.append(at_most("reference set as a gearbox", "femgear, elastic", text, 1e-8, apart))
        field = mesh_and_ring_outputs(replace(reference, modes=modes), wanted)[1][0, 1:] @ around
        lines = ring_lines(running, response, theta, np.tile([1.0, 0.0], (2, 1))).sum(axis=1)[1:]
        text = f"radial motion of the ring at two places, mesh frequency {hertz:g} Hz, over the largest"
        apart = np.abs(lines - field).max() / np.abs(field).max()
        rows.append(at_most("reference set as a gearbox", "femgear, elastic", text, 1e-8, apart))
    return tuple(rows)


def in_casing() -> tuple[Row, ...]:
    """A casing on feet with an elastic ring: coordinates relative to the casing, and all nodes of the ring in space."""
    tables = _tables()
    tables["casing"] = {
        "mass": f"{MASS!r} kg",
        "centre": [f"{value!r} m" for value in (*CENTRE, 0.0)],
        "inertia": [f"{INERTIA!r} kg m^2"] * 3,
        "foot": [
            {"position": [f"{x!r} m", f"{y!r} m", "0 m"], "stiffness": [f"{kx!r} N/m", f"{ky!r} N/m", "1e9 N/m"]}
            for x, y, kx, ky in FEET
        ],
    }
    for number, bearing in enumerate(tables["bearing"]):
        bearing["name"] = f"B{number}"
    tables["casing"]["stands_still"] = [bearing["name"] for bearing in tables["bearing"]]
    state = solve_deflection(read_case(tables))
    stage = state.model.stages[0]
    ring = elastic_ring(state.model, stage)
    _, system, stiffness = structure_without(state, stage, [ring])
    ours = undamped_modes(system, stiffness, damping_ratio=0.0).frequency
    wanted = _whole_frequencies(12)
    rows = [
        within(
            "ring in a casing on feet",
            "all nodes of the ring",
            f"natural frequency {number} [Hz]",
            float(hertz),
            float(ours[np.abs(ours - hertz).argmin()]),
            1e-4,
        )
        for number, hertz in enumerate(wanted, 1)
    ]
    alone = solve_deflection(read_case(_tables()))
    held = elastic_ring(alone.model, alone.model.stages[0])
    moved = np.abs(np.sqrt(held.stiffness[held.diameter == 1].min()) / (2.0 * np.pi) / wanted - 1.0).min()
    text = "least change of the first frequency of the ring with n = 1 by a casing that moves, relative"
    rows.append(Row("ring in a casing on feet", "all nodes of the ring", text, None, float(moved), None, False))
    return tuple(rows)


def _tables() -> dict:
    """Tables of the set as a gearbox, with an excitation of its ring up to `UP_TO`."""
    tables = elastic_set_tables(SET)
    tables["planetary"][0]["teeth"].setdefault("dynamics", {})["up_to"] = f"{UP_TO!r} Hz"
    return tables


def _whole_frequencies(count: int) -> np.ndarray:
    """Lowest frequencies [Hz] of the casing on its feet with all sectors of the ring on their foundation between."""
    case = read_case(SET)
    reference = solve(case, only="modes")["modes"]
    grid, stiffness = reference.ring.sector
    width = planetary_set(case).ring.face_width
    sector_mass = mass(grid, material_of(case, "ring"), width)
    sectors = reference.ring.modes.count
    places, K, M = _assembled(grid, stiffness, sector_mass, sectors)
    rigid = np.zeros((2 * len(places), 3))
    rigid[0::2, 0] = rigid[1::2, 1] = 1.0
    rigid[:, 2] = np.column_stack([-places[:, 1], places[:, 0]]).ravel()
    # what the foundation does to a rigid motion of the ring is all that its stiffness does
    pull = K @ rigid
    foot, moments = np.zeros((3, 3)), np.array([[1.0, 0.0, -CENTRE[1]], [0.0, 1.0, CENTRE[0]], [0.0, 0.0, 1.0]])
    for x, y, kx, ky in FEET:
        at = np.array([[1.0, 0.0, -y], [0.0, 1.0, x]])
        foot += at.T @ np.diag([kx, ky]) @ at
    base_mass = moments.T @ np.diag([MASS, MASS, INERTIA]) @ moments - rigid.T @ (M @ rigid)
    whole_K = sparse.block_array([[K, -pull], [-pull.T, foot + rigid.T @ pull]], format="csc")
    whole_M = sparse.block_array([[M, None], [None, base_mass]], format="csc")
    values = eigsh(whole_K, k=count, M=whole_M, sigma=-1e5, return_eigenvectors=False)
    return np.sqrt(np.sort(values)) / (2.0 * np.pi)


def _assembled(grid: Grid, stiffness, sector_mass, sectors: int):
    """Places (n, 2) of all nodes of the ring [m], its stiffness [N/m] and mass [kg] in axes at rest."""
    turned, turns = [], []
    for k in range(sectors):
        angle = 2.0 * np.pi * k / sectors
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        turns.append(turn)
        turned.append(grid.points @ turn.T)
    every = np.concatenate(turned)
    # nodes of neighbouring sectors on the cut between them are one
    same = np.arange(len(every))
    for node, other in cKDTree(every).query_pairs(1e-9):
        same[max(node, other)] = min(node, other)
    first, number = np.unique(same, return_inverse=True)
    number = number.reshape(sectors, -1)
    size, parts = 2 * len(first), ([], [])
    for turn, nodes in zip(turns, number, strict=True):
        axes = sparse.kron(np.eye(len(nodes)), turn, format="csr")
        dofs = np.column_stack([2 * nodes, 2 * nodes + 1]).ravel()
        for part, local in zip(parts, (stiffness, sector_mass), strict=True):
            fixed = sparse.coo_array(axes @ local @ axes.T)
            part.append((fixed.data, dofs[fixed.row], dofs[fixed.col]))
    K, M = (
        sparse.coo_array((values, (rows, columns)), shape=(size, size)).tocsc()
        for values, rows, columns in (map(np.concatenate, zip(*part, strict=True)) for part in parts)
    )
    return every[first], K, M
