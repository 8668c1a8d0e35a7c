"""Derivatives of transmission error and load sharing with respect to anything that separates flanks.

While the touching cells A stay the same, the contact problem is linear,

    gap_A + H_AA p_A - G_A q = 0,    G_A^T p_A = load,    G_A = J B

with J (cells, meshes) telling the mesh of every cell and B the approach of the meshes per motion. Hence

    Z = H_AA^-1 J,    K = J^T Z,    S = B^T K B,    v = Z^T d gap
    d q = S^-1 B^T v,    d F = -(I - K B S^-1 B^T) v       (F = J^T p, the mesh forces)

One factorisation of H_AA gives the gradients of all motions and mesh forces with respect to the separation of
every cell (the adjoint of a linear system: M. B. Giles, N. A. Pierce, Flow, Turbulence and Combustion 65,
2000, 393-415). The chain rule goes on through the separations, which cost no contact solution.

What these derivatives are not: cells change sides at the rims of the contacts, where pressures vanish, so
over a finite step the exact function bends away from them. Extremes over positions and planets have kinks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import cho_solve

from femgear.contact.active_set import factor
from femgear.contact.assembly import contact_candidates
from femgear.contact.flank_pairs import mesh_pairs, separation, tooth_steps
from femgear.contact.omitted_pairs import needed_nearest
from femgear.contact.solve import solve_contact
from femgear.contact.supports import moving_members
from femgear.contact.windows import ROUGH_STIFFNESS, cell_centres, cycle_positions, in_windows, mesh_windows
from femgear.errors import CaseError
from femgear.gears.deviations import (
    SetDeviations,
    body_separation,
    mirrored_deviations,
    no_deviations,
    profile_separation,
    tooth_separation,
)
from femgear.stages.protocol import one_blas_thread
from femgear.study.relief import DesignBasis

if TYPE_CHECKING:
    from femgear.gears.planetary import PlanetarySet


@dataclass(frozen=True, eq=False)
class _TouchingCells:
    """All M loaded cells of the record, position after position, in the numbering of the solved set.

    Parameters
    ----------
    at, mesh : (M,) int arrays
        Number of the position and of the mesh.
    roll_1, roll_2 : (M,) arrays
        Roll lengths on gear 1 and gear 2 [m].
    tooth_1, tooth_2 : (M,) int arrays
        Tooth numbers on gear 1 and gear 2.
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
    touching : _TouchingCells
        Loaded cells, with what each carries per unit approach.
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
    touching: _TouchingCells
    arc_response: np.ndarray
    deflection_response: np.ndarray
    force_response: np.ndarray
    residual: float

    @property
    def share(self) -> np.ndarray:
        """Shares in the sun's torque, (N, P)."""
        return self.force[: self.original.n_planets] / self.load


def _original_rows(order) -> np.ndarray:
    """Meshes of the solved set in the order of the original, (2N,)."""
    back = np.argsort(order)
    return np.concatenate([back, back + len(back)])


@one_blas_thread()
def linearise(basis: DesignBasis, *, sun_torque: float, periods: int = 1, only=None, between=()) -> LinearContact:
    """Solve the contact of all drive flanks, and what it answers to small separations [m] of any cell.

    CaseError: E-TORQUE: no torque; E-RANGE: no such position; E-SUPPORT: bearings with clearance; E-SLICES:
    slices over the width. ContactError: as `contact.cycle.walk_mesh_cycle`.

    Parameters
    ----------
    sun_torque, periods
        As for `contact.cycle.walk_mesh_cycle`; the torque is not zero.
    only : sequence of int, optional
        Numbers of the positions wanted; all of the record when left out.
    between : sequence of float, optional
        Further positions of the record, which are counted in [mesh periods].
    """
    if basis.over:
        raise CaseError(
            "derivatives are those of the plane contact",
            code="E-SLICES",
            key="static.slices",
            value=basis.over["slices"],
            limit="1",
            remedy='take differences of mesh cycles, as pin_differences and searches by method "global" do',
        )
    solved, order = basis.loaded(sun_torque)
    record = np.sort(np.append(cycle_positions(basis.positions, periods=periods), between))
    chosen = np.arange(len(record)) if only is None else np.atleast_1d(np.asarray(only, int))
    if not len(chosen) or chosen.min() < 0 or chosen.max() >= len(record):
        raise CaseError("no such position", code="E-RANGE", value=only, limit=f"0 to {len(record) - 1}")
    position, numbers = record, chosen
    if sun_torque < 0:
        # the mirror image turns the other way and ends at position zero
        position, numbers = -position[::-1], len(position) - 1 - chosen
    load = abs(sun_torque) / solved.gears.sun.base_radius
    setup, answers = _solve(solved, load, position, numbers)
    rows = _original_rows(order)
    stacked = {name: np.stack([answer[name] for answer in answers]) for name in answers[0] if name != "cells"}
    return LinearContact(
        original=basis.gears,
        solved=solved.gears,
        order=order,
        load=load,
        position=record[chosen],
        solved_position=position[numbers],
        sun_arc=stacked["sun_arc"],
        deflection=stacked["deflection"].T[rows],
        force=stacked["force"].T[rows],
        touching=_touching(solved.gears, setup, numbers, [answer["cells"] for answer in answers]),
        arc_response=stacked["arc_response"],
        deflection_response=stacked["deflection_response"],
        force_response=stacked["force_response"],
        residual=float(stacked["residual"].max()),
    )


def _solve(solved: DesignBasis, load: float, position: np.ndarray, numbers):
    """Windows wide enough, and the answers of all positions in them."""
    gears, bodies, N = solved.gears, solved.bodies, solved.gears.n_planets
    members = moving_members(gears, solved.supports)
    right = np.zeros(N + 1 + int(members.free.sum()))
    right[N] = load

    def attempt(share: float, nearest: float):
        setup = mesh_windows(
            gears,
            bodies,
            share=share,
            nearest=nearest,
            positions=position,
            contact=solved.contact,
            cells=36,
            deviations=solved.deviations,
        )
        answers, overflow, outside, previous = [], False, False, None
        for p in numbers:
            candidates = contact_candidates(setup, bodies, [p], members)
            problem = candidates.problem(0)
            start = None if previous is None else problem.warm_start(*previous)
            state = solve_contact(problem.compliance, problem.gap, problem.G, right, start=start)
            previous = (problem, state.active)
            answers.append(_answer(problem, state, setup.gears.rotation_approach, members))
            overflow |= problem.touches_window_end(state.active, setup)
            force = np.zeros((1, len(candidates.mesh)))
            np.add.at(force[0], candidates.candidate[0].nonzero()[0], state.loads)
            missed = needed_nearest(candidates, answers[-1]["deflection"][:, None], force)
            outside |= solved.contact == "profile" and bool(missed.any())
        return (setup, answers), share * (4.0 if overflow else 1.0), nearest * (2.0 if outside else 1.0)

    return in_windows(attempt, load / N, 3.0 * load / (N * ROUGH_STIFFNESS * min(gears.mesh_widths)))


def _answer(problem, state, turns: np.ndarray, members) -> dict:
    """Solution of one position and its linear answer to separations of the touching cells."""
    N, active = problem.n_planets, np.flatnonzero(state.active)
    of_mesh = problem.mesh[active, None] == np.arange(2 * N)
    lower = factor(problem.compliance[np.ix_(active, active)])
    Z = cho_solve((lower, True), of_mesh.astype(float))
    K = of_mesh.T @ Z
    B = np.hstack([turns, members.approach[:, members.free]])
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


def _touching(solved: PlanetarySet, setup, numbers, cells) -> _TouchingCells:
    """Where all loaded cells lie on their teeth."""
    N = solved.n_planets
    at = np.repeat(np.arange(len(cells)), [len(c[0]) for c in cells])
    mesh, pair, cell, weight = (np.concatenate([c[i] for c in cells]) for i in range(4))
    place = mesh, numbers[at], pair
    turns = setup.turns[numbers[at]]
    tooth_1, tooth_2 = (setup.tooth[gear][mesh, pair] + tooth_steps(solved, mesh, gear) * turns for gear in (0, 1))
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
    return _TouchingCells(at, mesh, roll_1, roll_2, tooth_1, tooth_2, weight)


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Derivatives per unit of one parameter, planets and positions in the order of the linearisation.

    Parameters
    ----------
    sun_arc : (P,) array
        Of the transmission error from sun to ring [m].
    deflection : (2N, P) array
        Of the transmission error of every mesh [m]; NaN for meshes of planets that carry nothing.
    force : (2N, P) array
        Of the mesh forces [N].
    share : (N, P) array
        Of the shares in the sun's torque; they add up to zero.
    """

    sun_arc: np.ndarray
    deflection: np.ndarray
    force: np.ndarray
    share: np.ndarray


def sensitivity(
    linear: LinearContact, variant: Callable[[float], SetDeviations], value: float, *, step: float
) -> Sensitivity:
    """Differentiate transmission errors, mesh forces and shares by one parameter of the deviations.

    CaseError: E-RANGE: a step that is not positive.

    Parameters
    ----------
    linear : LinearContact
        Of the set with the deviations ``variant(value)``.
    variant : callable
        Deviations (of the set as it is, not mirrored) for a value of the parameter.
    step : float
        The separations are differentiated centrally over twice this; exact where they are linear in the
        parameter (amounts, pitch and pin errors).
    """
    if not (np.isfinite(step) and step > 0):
        raise CaseError("a derivative needs a step", code="E-RANGE", value=step, limit="over 0")
    low, high = variant(value - step), variant(value + step)
    if linear.solved is not linear.original:
        low, high = (
            mirrored_deviations(deviations, linear.original, linear.solved, linear.order) for deviations in (low, high)
        )
    change = (_separations(linear, high) - _separations(linear, low)) / (2.0 * step)
    return _sensitivity(linear, change)


def _sensitivity(linear: LinearContact, change: np.ndarray) -> Sensitivity:
    """From the changes of the separations of all touching cells."""
    N, t = linear.solved.n_planets, linear.touching
    pushed = np.zeros((len(linear.position), 2 * N))
    np.add.at(pushed, t.at, t.weight * change[:, None])
    rows = _original_rows(linear.order)
    force = np.einsum("pij,pj->ip", linear.force_response, pushed)[rows]
    return Sensitivity(
        sun_arc=np.einsum("pj,pj->p", linear.arc_response, pushed),
        deflection=np.einsum("pij,pj->ip", linear.deflection_response, pushed)[rows],
        force=force,
        share=force[:N] / linear.load,
    )


def _separations(linear: LinearContact, deviations: SetDeviations) -> np.ndarray:
    """What deviations of the solved set add to the separations of the touching cells, (M,) [m]."""
    s, t, N = linear.solved, linear.touching, linear.solved.n_planets
    total = body_separation(deviations, s, linear.solved_position)[t.mesh, t.at]
    for mesh in range(2 * N):
        rows = t.mesh == mesh
        total[rows] += tooth_separation(deviations, mesh, t.tooth_1[rows], t.tooth_2[rows])
    for kind in (0, 1):
        rows = t.mesh // N == kind
        total[rows] += profile_separation(deviations, s, kind, t.roll_1[rows], t.roll_2[rows])
    return total


def pin_sensitivities(linear: LinearContact) -> np.ndarray:
    """Differentiate all shares by the displacements of the pins, (N shares, N pins, 2, P) [1/m].

    The third index is radial (outwards), tangential (counter-clockwise). Pin errors separate whole meshes,
    so these derivatives hold beside any other deviations.
    """
    ideal, N = no_deviations(linear.original), linear.original.n_planets
    shares = []
    for unit in np.eye(2 * N).reshape(2 * N, N, 2):

        def variant(value: float, unit=unit) -> SetDeviations:
            return replace(ideal, pin_errors=value * unit)

        shares.append(sensitivity(linear, variant, 0.0, step=1e-6).share)
    return np.moveaxis(np.array(shares).reshape(N, 2, N, -1), 2, 0)


def pin_differences(basis: DesignBasis, *, sun_torque: float, position: float, step: float = 0.1e-6) -> np.ndarray:
    """Differentiate all shares by the displacements of the pins, (N shares, N pins, 2) [1/m], by differences.

    As `pin_sensitivities`, at one position [mesh periods], from mesh cycles with pins off by ``step`` [m] either
    way: of every kind of contact that `femgear.contact.cycle.walk_mesh_cycle` solves.
    """
    N, at = basis.gears.n_planets, np.array([position])
    given = no_deviations(basis.gears) if basis.deviations is None else basis.deviations
    slopes = []
    for unit in np.eye(2 * N).reshape(2 * N, N, 2):
        moved = (replace(given, pin_errors=given.pin_errors + sign * step * unit) for sign in (1, -1))
        shares = [
            replace(basis, deviations=deviations, positions=at).walk(sun_torque).load_share[:, 0]
            for deviations in moved
        ]
        slopes.append((shares[0] - shares[1]) / (2.0 * step))
    return np.moveaxis(np.array(slopes).reshape(N, 2, N), 2, 0)
