"""The contact problem of a design at every position, with its linear answer to separations.

`design_basis` holds what all variants of a design share: gears, compliances, supports and deviations.
`linear_positions` solves the contact and factorises it for `femgear.study.sensitivity`, where the method
stands.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.case import planetary_set, set_deviations
from femgear.case.sections import Case
from femgear.contact.assembly import (
    ROUGH_STIFFNESS,
    assemble_contact,
    cell_centres,
    cycle_positions,
    in_windows,
    mesh_windows,
    rotation_approach,
)
from femgear.contact.flank_pairs import loaded_image, mesh_pairs, separation
from femgear.contact.pivoting import factor
from femgear.contact.solve import solve_contact
from femgear.contact.supports import RIGID, Supports, moving_members
from femgear.errors import CaseError
from femgear.gears.kinematics import torques
from femgear.study.relief import relief_starts
from femgear.threads import one_blas_thread

if TYPE_CHECKING:
    from femgear.contact.bodies import Bodies
    from femgear.gears.deviations import SetDeviations
    from femgear.gears.planetary import PlanetarySet


@dataclass(frozen=True, eq=False)
class DesignBasis:
    """Gears, flank compliances, supports as the case's static problem has them, deviations (None: ideal)."""

    gears: PlanetarySet
    bodies: Bodies
    supports: Supports
    deviations: SetDeviations | None


@one_blas_thread()
def design_basis(case: Case, *, cache: Path | None = None) -> DesignBasis:
    """The compliance of a case, computed once for all variants.

    Parameters
    ----------
    case : Case
    cache : path, optional
        Folder of generated grids.

    Raises
    ------
    GeometryError, GridError
    """
    from femgear.contact.bodies import make_bodies, make_sectors
    from femgear.fe.elasticity import Material, foundation

    gears, deviations = planetary_set(case), set_deviations(case)
    material = Material(case.material.youngs_modulus, case.material.poisson_ratio, case.material.density)
    sectors = make_sectors(gears, material, flank_elements=case.static.flank_elements, cache=cache)
    springs = None
    if case.static.members == "elastic":
        grid, ring = sectors.ring.grid, case.ring
        stiffness = ring.foundation_radial, ring.foundation_tangential
        springs = foundation(grid, "rim", *stiffness, thickness=gears.ring.face_width)
    bodies = make_bodies(sectors, material, depth=case.static.depth, ring_foundation=springs)
    return DesignBasis(gears, bodies, static_supports(case), None if deviations.ideal else deviations)


def case_supports(case: Case) -> Supports:
    """Supports of sun, carrier and planets with the stiffnesses and the bearing clearance of the case."""
    return Supports(
        sun=case.sun.support_stiffness,
        carrier=case.carrier.support_stiffness,
        planet=case.planet.bearing_stiffness,
        planet_clearance=case.planet.bearing_clearance,
    )


def static_supports(case: Case) -> Supports:
    """Supports as the static problem of the case has them."""
    return RIGID if case.static.members == "fixed" else case_supports(case)


def sun_torque(case: Case, gears: PlanetarySet, torque: float | None = None) -> float:
    """Torque on the sun [N m] under a torque on the input of the case, by default that of the case.

    Raises
    ------
    CaseError
        E-TORQUE: without torque there is nothing to design for.
    """
    value = case.operation.torque if torque is None else torque
    if value == 0:
        raise CaseError("without torque no tooth bends", code="E-TORQUE", key="operation.torque")
    return torques(gears, member=case.operation.input, torque=value).sun


def relief_snippet(gears: PlanetarySet, *, amount: float, length: float, power: float, back: bool) -> str:
    """Tables of a case file for the tip relief of `relief.with_tip_relief`, to be pasted at its end."""
    side = "ring side" if back else "sun side"
    lines = []
    for gear, start, flank in zip((gears.sun, gears.planet), relief_starts(gears, length=length), ("", side)):
        lines += [f"[[{gear.name}.modifications]]", 'kind = "tip relief"']
        lines += [f'flank = "{flank}"'] if flank else []
        diameter = 2e3 * math.hypot(start, gear.base_radius)
        lines += [f'amount = "{amount * 1e6:.3f} um"', f'start_diameter = "{diameter:.5f} mm"']
        lines += [f"power = {power:g}", ""]
    return "\n".join(lines)


@dataclass(frozen=True, eq=False)
class TouchingCells:
    """All M loaded cells of the record, position after position, in the numbering of the solved set.

    Parameters
    ----------
    at : (M,) int array
        Which of the positions.
    mesh : (M,) int array
    roll_1, roll_2 : (M,) arrays
        Roll lengths on gear 1 and gear 2 [m].
    tooth_1, tooth_2 : (M,) int arrays
        Tooth numbers.
    weight : (M, 2N) array
        ``Z = H_AA^-1 J``: load of the cell per unit approach of every mesh [N/m].
    """

    at: np.ndarray
    mesh: np.ndarray
    roll_1: np.ndarray
    roll_2: np.ndarray
    tooth_1: np.ndarray
    tooth_2: np.ndarray
    weight: np.ndarray


@dataclass(frozen=True, eq=False)
class LinearContact:
    """Solution at P positions, and its linear answer to separations.

    Parameters
    ----------
    original, solved : PlanetarySet
        The set, and its mirror image where the torque is negative.
    order : (N,) int array
        Solved planet ``i`` is original planet ``order[i]``.
    load : float
        Sum of the sun-planet mesh forces [N].
    position : (P,) array
        In mesh periods.
    solved_position : (P,) array
        The same in the solved set.
    sun_arc : (P,) array
        Transmission error from sun to ring [m].
    deflection, force : (2N, P) arrays
        Of every mesh, in the original order [m], [N].
    touching : TouchingCells
    arc_response : (P, 2N) array
        Of the transmission error to ``v = Z^T d gap`` [m/N].
    deflection_response, force_response : (P, 2N, 2N) arrays
        Of all meshes of the solved set [m/N], [1].
    residual : float
        Largest of the contact problems.
    """

    original: PlanetarySet
    solved: PlanetarySet
    order: np.ndarray
    load: float
    position: np.ndarray
    solved_position: np.ndarray
    sun_arc: np.ndarray
    deflection: np.ndarray
    force: np.ndarray
    touching: TouchingCells
    arc_response: np.ndarray
    deflection_response: np.ndarray
    force_response: np.ndarray
    residual: float

    @property
    def mirrored(self) -> bool:
        """Whether the mirror image was solved."""
        return self.solved is not self.original

    @property
    def mesh_rows(self) -> np.ndarray:
        """Meshes of the solved set in the order of the original, (2N,)."""
        return original_rows(self.order)

    @property
    def share(self) -> np.ndarray:
        """Shares in the sun's torque, (N, P)."""
        return self.force[: self.original.n_planets] / self.load


def original_rows(order) -> np.ndarray:
    """Meshes of the solved set in the order of the original, (2N,)."""
    back = np.argsort(order)
    return np.concatenate([back, back + len(back)])


def linear_positions(original, bodies, sun_torque, chosen, record, deviations, supports) -> LinearContact:
    """Solve and linearise the chosen positions; `record` holds options of `mesh_windows`.

    Raises
    ------
    ContactError
        As `contact.cycle.walk_mesh_cycle`.
    """
    solved, order, deviations = loaded_image(original, sun_torque, deviations)
    position = cycle_positions(record["positions"], periods=record["periods"])
    numbers = chosen
    if sun_torque < 0:
        # the mirror image turns the other way and ends at position zero
        position, numbers = -position[::-1], len(position) - 1 - chosen
    load = abs(sun_torque) / solved.sun.base_radius
    members = moving_members(solved, supports)
    options = {"contact": record["contact"], "cells": record["cells"], "deviations": deviations}
    setup, answers = _solve(solved, bodies, load, numbers, members, options | {"positions": position})
    rows = original_rows(order)
    stacked = {name: np.stack([answer[name] for answer in answers]) for name in answers[0] if name != "cells"}
    return LinearContact(
        original=original,
        solved=solved,
        order=order,
        load=load,
        position=chosen / record["positions"],
        solved_position=position[numbers],
        sun_arc=stacked["sun_arc"],
        deflection=stacked["deflection"].T[rows],
        force=stacked["force"].T[rows],
        touching=_touching(solved, bodies, setup, numbers, [answer["cells"] for answer in answers]),
        arc_response=stacked["arc_response"],
        deflection_response=stacked["deflection_response"],
        force_response=stacked["force_response"],
        residual=float(stacked["residual"].max()),
    )


def _solve(solved, bodies, load, numbers, members, options):
    """Windows wide enough, and the answers of all positions in them."""
    N = solved.n_planets
    right = np.zeros(N + 1 + int(members.free.sum()))
    right[N] = load

    def attempt(share: float, nearest: float):
        setup = mesh_windows(solved, bodies, share=share, nearest=nearest, **options)
        answers, overflow, outside, previous = [], False, False, None
        for p in numbers:
            problem = assemble_contact(setup, bodies, p, members)
            start = None if previous is None else problem.warm_start(*previous)
            state = solve_contact(problem.compliance, problem.gap, problem.G, right, start=start)
            previous = (problem, state.active)
            answers.append(_answer(problem, state, members))
            overflow |= problem.touches_window_end(state.active, setup)
            penetrates = ~setup.near[:, p] & (setup.smallest_gap[:, p] < answers[-1]["deflection"][:, None])
            outside |= options["contact"] == "profile" and bool(penetrates.any())
        return (setup, answers), share * (4.0 if overflow else 1.0), nearest * (2.0 if outside else 1.0)

    return in_windows(attempt, load / N, 3.0 * load / (N * ROUGH_STIFFNESS * solved.sun.face_width))


def _answer(problem, state, members) -> dict:
    """Solution of one position and its linear answer to separations of the touching cells."""
    from scipy.linalg import cho_solve

    N, active = problem.n_planets, np.flatnonzero(state.active)
    of_mesh = problem.mesh[active, None] == np.arange(2 * N)
    lower = factor(problem.compliance[np.ix_(active, active)])
    Z = cho_solve((lower, True), of_mesh.astype(float))
    K = of_mesh.T @ Z
    B = np.hstack([rotation_approach(N), members.approach[:, members.free]])
    # a planet that carries nothing leaves S singular in its own rotation alone
    motion = np.linalg.pinv(B.T @ K @ B, rcond=1e-10, hermitian=True) @ B.T
    force = K @ B @ motion - np.eye(2 * N)
    deflection = B @ motion - members.compliance @ force
    undetermined = (np.abs(B[:, state.open_motions]) > 0).any(axis=1)
    deflection[undetermined] = np.nan
    forces = of_mesh.T @ state.loads[active]
    return {
        "sun_arc": state.motions[N],
        "force": forces,
        "deflection": B @ state.motions - members.compliance @ forces,
        "arc_response": motion[N],
        "deflection_response": deflection,
        "force_response": force,
        "residual": state.residual,
        "cells": (problem.mesh[active], problem.pair[active], problem.cell[active], Z),
    }


def _touching(solved, bodies, setup, numbers, cells) -> TouchingCells:
    """Where all loaded cells lie on their teeth."""
    N = solved.n_planets
    at = np.repeat(np.arange(len(cells)), [len(c[0]) for c in cells])
    mesh, pair, cell, weight = (np.concatenate([c[i] for c in cells]) for i in range(4))
    place = mesh, numbers[at], pair
    turns = setup.turns[numbers[at]]
    # with every mesh period the sun's teeth move on by one, those of planets and ring back
    tooth_1 = setup.tooth[0][mesh, pair] + np.where(mesh < N, -1, 1) * turns
    tooth_2 = setup.tooth[1][mesh, pair] + turns
    roll_1, roll_2 = np.zeros((2, len(mesh)))
    for kind, contact in enumerate(mesh_pairs(solved)):
        rows = mesh // N == kind
        here = tuple(index[rows] for index in place)
        twice = 2.0 * contact.base_radius_1
        cells_in_window = setup.gap.shape[-1]
        place_in_window = cell_centres(cells_in_window)[setup.layout[here], cell[rows]]
        width = setup.cell[mesh[rows]] * cells_in_window
        arc = setup.roll[0][here][:, 0] ** 2 / twice + place_in_window * width
        roll_1[rows] = np.sqrt(twice * arc)
        roll_2[rows] = separation(contact, setup.zeta[here], roll_1[rows])[1]
    return TouchingCells(at, mesh, roll_1, roll_2, tooth_1, tooth_2, weight)
