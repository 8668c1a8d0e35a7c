"""What is asked of the wind turbine sets: branches over the weight's frequency, orbits, contact states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from published.wind_turbine import SMOOTHING, bearing_problem_a, drive_reduction, wind_turbine_b

from femgear.solvers.continuation.branches import Branch
from femgear.solvers.periodic.harmonic_balance import displacements, solve_harmonic_balance
from femgear.solvers.periodic.solution import PeriodicSolution
from femgear.solvers.time.stroboscopic import SweepResponse, stroboscopic_map
from femgear.system.mesh_directions import free_motions, pin_directions
from femgear.system.rigid_bodies import CENTRAL
from femgear.system.system import NonlinearSystem
from femgear.trains.planar.model import column_contact, fluctuation, weight_curve


@dataclass(frozen=True)
class WedgingMap:
    """Contact over the weight's frequency and the clearance of the carrier bearing of set A.

    Parameters
    ----------
    frequency : (f,) array
        [Hz]
    clearance : (c,) array
        [m]
    drive, back : (f, c, 2N) arrays
        Share of the cycle in which the flanks touch, sun-planet meshes first; nan where not converged.
    """

    frequency: np.ndarray
    clearance: np.ndarray
    drive: np.ndarray
    back: np.ndarray


def weight_branch(
    problem: NonlinearSystem,
    limits: tuple[float, float],
    *,
    harmonics: int = 9,
    stability: bool = False,
    largest: float = 0.1,
    max_points: int = 600,
) -> Branch:
    """Periodic responses over the frequency of the weight.

    Parameters
    ----------
    problem : NonlinearSystem
        From `published.wind_turbine`.
    limits : (first, last)
        [Hz]
    harmonics, stability
        As for `frequency_response_curve`.
    largest : float
        Longest step, see `StepOptions`.
    max_points : int
    """
    return weight_curve(
        problem,
        limits,
        reduction=drive_reduction(problem),
        harmonics=harmonics,
        stability=stability,
        largest=largest,
        max_points=max_points,
    )


def member_lines(problem: NonlinearSystem, solutions: Sequence[PeriodicSolution], member: str) -> np.ndarray:
    """Lines (p, 2, L) [m] of x and y of the carrier, ring or sun in the carrier frame."""
    reduction, outputs = drive_reduction(problem), np.zeros((2, len(problem.system.M)))
    first = 3 * CENTRAL.index(member)
    outputs[[0, 1], [first, first + 1]] = 1.0
    return np.array([displacements(problem, solution, outputs, reduction=reduction) for solution in solutions])


def member_rms(problem: NonlinearSystem, solutions: Sequence[PeriodicSolution], member: str) -> np.ndarray:
    """Root mean square (p, 2) [m] of x and y about their mean."""
    return fluctuation(member_lines(problem, solutions, member))


def sweep_rms(problem: NonlinearSystem, sweep: SweepResponse, *, steps: int, member="carrier") -> np.ndarray:
    """Root mean square (f,) [m] of x of a member over the last period of every frequency of a sweep."""
    out, row = [], 3 * CENTRAL.index(member)
    for omega, *state in zip(sweep.frequency, sweep.displacement, sweep.velocity):
        period = stroboscopic_map(problem, omega, steps=steps)
        block = period.run(*period.enter(state))
        out.append(period.motion(block, np.arange(len(block.states) - 1))[0][:, row].std())
    return np.array(out)


def resonance(branch: Branch, amplitude: np.ndarray) -> tuple[float, float]:
    """Frequency [Hz] and size of the largest amplitude, by a parabola through the three highest points."""
    hertz, top = branch.parameter / (2.0 * np.pi), int(np.argmax(amplitude))
    if not 0 < top < len(hertz) - 1:
        return float(hertz[top]), float(amplitude[top])
    near = slice(top - 1, top + 2)
    a, b, c = np.polyfit(hertz[near] - hertz[top], amplitude[near], 2)
    return float(hertz[top] - 0.5 * b / a), float(c - 0.25 * b * b / a)


def contact_shares(problem: NonlinearSystem, solution: PeriodicSolution) -> np.ndarray:
    """Share of the cycle (n_columns,) in which the flanks of every column touch; nan without a mesh.

    A smoothed contact counts as closed beyond half its force scale, the force at the corner itself.
    """
    return column_contact(problem, solution)[0]


def bearing_history(problem: NonlinearSystem, solution: PeriodicSolution, phase) -> np.ndarray:
    """Forces (N, 2, n) [N] on the planets of set B by their bearings, radially outwards and tangentially.

    Parameters
    ----------
    problem, solution
    phase : (n,) array
        Of the base frequency [rad].
    """
    data = wind_turbine_b()
    columns = free_motions(data).T @ pin_directions(data).reshape(-1, 2 * data.n_planets)
    reduction = drive_reduction(problem)
    lines = displacements(problem, solution, columns.T, reduction=reduction)
    x = (lines @ np.exp(1j * solution.orders[:, :1] * np.asarray(phase))).real
    return -data.planet_bearing[:, None, None] * x.reshape(data.n_planets, 2, -1)


def wedging_map(
    frequency: Sequence[float],
    clearance: Sequence[float],
    *,
    backlash: float,
    harmonics: int = 7,
    smoothing: float = SMOOTHING,
) -> WedgingMap:
    """Contact of drive and back flanks of set A, each row from the solution at the clearance before.

    Parameters
    ----------
    frequency : (f,) sequence
        Of the weight [Hz].
    clearance : (c,) sequence
        Of the carrier bearing [m], ascending.
    backlash : float
        Total play along the line of action [m].
    harmonics : int
    smoothing : float
        [m]
    """
    states = np.full((len(frequency), len(clearance), 2, 6), np.nan)
    for i, hertz in enumerate(frequency):
        start = None
        for j, play in enumerate(clearance):
            problem = bearing_problem_a(play, backlash=backlash, smoothing=smoothing)
            solution = solve_harmonic_balance(
                problem,
                2.0 * np.pi * hertz,
                harmonics=harmonics,
                samples=512,
                start=start,
                reduction=drive_reduction(problem),
                stability=False,
            )
            start = solution if solution.converged else None
            if solution.converged:
                states[i, j] = contact_shares(problem, solution)[:12].reshape(2, 6)
    return WedgingMap(np.array(frequency), np.array(clearance), states[:, :, 0], states[:, :, 1])


def wedging_onset(contact: WedgingMap) -> np.ndarray:
    """Smallest clearance (f,) [m] at which a back flank touches; nan where none does."""
    touching = contact.back.max(axis=2) > 0.0
    first = touching.argmax(axis=1)
    return np.where(touching.any(axis=1), contact.clearance[first], np.nan)
