"""The planetary set of the dynamic benchmarks: 18 coordinates, k(t), backlash, contact loss; longer ones."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femgear.system.fourier import harmonics_of
from femgear.system.system import NonlinearSystem

PHASES = np.array([0.0, 1 / 3, 2 / 3, 0.15, 0.15 + 1 / 3, 0.15 + 2 / 3])
FLUCTUATION = 0.15 * np.array([1.0, 0.3, 0.15])
"""Harmonics 1 to 3 of the mesh stiffness over its mean."""
MESH_FREQUENCY = 7000.0
"""[Hz], near two resonances: the meshes with the ring lose contact."""
OMEGA = 2.0 * np.pi * MESH_FREQUENCY
LINES = 24
"""Harmonics that are compared."""


def mesh_stiffness():
    """k(t) of the six meshes in sequential phase."""
    from published.planetary_sets import lin_parker_set

    from femgear.stages.lumped_set import phased_series

    return phased_series(FLUCTUATION, FLUCTUATION, PHASES, mean=lin_parker_set(3).mesh_stiffness)


def planet_train(damping: float) -> NonlinearSystem:
    """Example set of Lin and Parker (1999) with three planets, 300 N m and 20 um of backlash."""
    from published.planetary_sets import lin_parker_set

    from femgear.stages.lumped_set import gear_set_problem
    from femgear.system.mesh_directions import mesh_elements
    from femgear.system.rigid_bodies import PlanarTorque

    data = lin_parker_set(3)
    meshes = mesh_elements(data, stiffness=mesh_stiffness(), backlash=20e-6)
    return gear_set_problem(data, meshes=meshes, torque=PlanarTorque(300.0), damping=damping)


def two_base_train(damping: float) -> NonlinearSystem:
    """The same set with its weight, which turns with the carrier: carrier first, mesh second frequency."""
    from published.planetary_sets import lin_parker_set

    from femgear.stages.lumped_set import Gravity, gear_set_problem
    from femgear.system.mesh_directions import mesh_elements
    from femgear.system.rigid_bodies import PlanarTorque

    data, stiffness = lin_parker_set(3), replace(mesh_stiffness(), orders=(0, 1))
    meshes = mesh_elements(data, stiffness=stiffness, backlash=20e-6)
    return gear_set_problem(
        data, meshes=meshes, torque=PlanarTorque(300.0), damping=damping, gravity=Gravity(orders=(1, 0))
    )


def with_chains(problem: NonlinearSystem, links: int, *, damping: float, share=0.1, lowest=15e3) -> NonlinearSystem:
    """The set with a chain of equal links on every coordinate: ``1 + links`` times the coordinates.

    Parameters
    ----------
    share : float
        Part of each mass that moves into its chain.
    lowest : float
        Lowest frequency of a chain whose body stands still [Hz].
    """
    from femgear.solvers.linear.modal import modal_damping
    from femgear.system.system import MechanicalSystem

    s, n = problem.system, len(problem.system.M)
    m, size = share * np.diag(s.M) / max(links, 1), n * (1 + links)
    # chain held at one end: w_1 = 2 sqrt(k / m) sin(pi / (4 links + 2))
    k = m * (np.pi * lowest / np.sin(np.pi / (4 * links + 2))) ** 2
    M, K = np.zeros((size, size)), np.zeros((size, size))
    M[:n, :n], K[:n, :n] = s.M - links * np.diag(m), s.K
    places = np.column_stack([np.arange(n), n + np.arange(n * links).reshape(n, links)])
    for left, right in zip(places.T[:-1], places.T[1:]):
        M[right, right] = m
        K[left, left] += k
        K[right, right] += k
        K[left, right] = K[right, left] = -k
    more = size - n
    system = MechanicalSystem(
        M=M,
        C=np.zeros((size, size)),
        K=K,
        W=np.vstack([s.W, np.zeros((more, s.W.shape[1]))]),
        load=np.append(s.load, np.zeros(more)),
        dofs=(),
    )
    system = replace(system, C=modal_damping(system, problem.reference, damping))
    return NonlinearSystem(system, problem.elements)


def static_start(problem: NonlinearSystem) -> tuple[np.ndarray, np.ndarray]:
    """Rest at the static deflection with mean mesh stiffness."""
    s = problem.system
    rest = np.linalg.lstsq(s.K + (s.W * problem.reference) @ s.W.T, s.load, rcond=1e-12)[0]
    return rest, np.zeros(len(rest))


def state_at_zero(problem: NonlinearSystem, solution) -> tuple[np.ndarray, np.ndarray]:
    """Displacement and velocity of a periodic solution at time zero."""
    from femgear.solvers.periodic.harmonic_balance import displacements

    lines = displacements(problem, solution)
    return lines.sum(axis=1).real, (1j * solution.line_frequency * lines).sum(axis=1).real


@dataclass(frozen=True)
class Target:
    """Lines (n_columns, LINES + 1) [m] of the settled motion, which all routes are measured by."""

    lines: np.ndarray

    def error(self, lines) -> float:
        """Largest difference of the lines over the largest fluctuating one; lines left out count as zero."""
        full = np.zeros_like(self.lines)
        count = min(lines.shape[1], full.shape[1])
        full[:, :count] = lines[:, :count]
        return float(np.abs(full - self.lines).max() / np.abs(self.lines[:, 1:]).max())


def shot(problem: NonlinearSystem) -> Target:
    """Reference: shooting, adaptive integration that stops at every contact change, tolerance 1e-11."""
    from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
    from femgear.solvers.periodic.shooting import solve_shooting

    near = solve_harmonic_balance(problem, OMEGA, harmonics=8)
    found = solve_shooting(problem, OMEGA, start=state_at_zero(problem, near), harmonics=LINES)
    assert found.solution.converged and found.stable
    return Target(found.solution.deflection)


def settle_by_steps(problem, target: Target, tolerance: float, *, steps: int, most: int, method: str):
    """Fixed steps from the static state until the lines change less than the tolerance and are that exact.

    The error is known here and stops the integration as early as possible, which no user could do.

    Returns
    -------
    error : float
    periods : int
    """
    from femgear.solvers.time.stroboscopic import stroboscopic_map

    period = stroboscopic_map(problem, OMEGA, steps=steps, method=method)
    state, g = period.enter(static_start(problem))
    count, before, error, periods = min(LINES, (steps - 1) // 2), None, np.inf, 0
    while periods < most:
        periods += 1
        block = period.run(state, g)
        state, g = block.states[-1], block.excess[-1]
        lines = harmonics_of(period.columns(block)[:-1].T, count)
        error = target.error(lines)
        if error <= tolerance and before is not None:
            change = np.abs(lines - before).max() / np.abs(lines[:, 1:]).max()
            if change <= tolerance:
                break
        before = lines
    return error, periods


def settle_adaptively(problem, target: Target, *, method: str, tolerance: float, periods: int):
    """Error of the lines, and change from period to period, after so many periods in one integration."""
    from femgear.solvers.time.transient import solve_transient

    samples = 128
    last = (periods - 2 + np.arange(2 * samples) / samples) / MESH_FREQUENCY
    run = solve_transient(
        problem, OMEGA, np.append(0.0, last), start=static_start(problem), method=method, tolerance=tolerance
    )
    before, lines = (harmonics_of(part.T, LINES) for part in np.split(run.deflection[1:], 2))
    return target.error(lines), float(np.abs(lines - before).max() / np.abs(lines[:, 1:]).max())
