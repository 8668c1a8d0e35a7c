"""Small systems with meshes, as fixtures of the tests of systems and solvers."""

import numpy as np
import pytest

from femgear.system.system import MechanicalSystem, MeshExcitation


@pytest.fixture
def geared_chain():
    """Inertias 1, 2, 3, 4 on supports with a mesh 1-2 and a mesh 3-4, shaft 2-3: two coupled meshes."""
    M = np.diag([1.0, 1.5, 0.8, 2.0])
    K = np.diag([0.05, 0.0, 0.0, 0.2])
    K[np.ix_([1, 2], [1, 2])] += 0.6 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    W = np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 1.0]])
    load = np.array([1.0, 0.2, -0.3, 0.4])
    return MechanicalSystem(M, np.zeros((4, 4)), K, W, load, ("a", "b", "c", "d"))


@pytest.fixture
def chain_excitation(geared_chain):
    """A function: excitation of the chain at its static states, stiffness fluctuating by a given share."""

    def build(depth, positions=64, phase=0.3):
        tau = 2 * np.pi * np.arange(positions) / positions
        wave = np.cos(tau) + 0.4 * np.sin(2 * tau) - 0.2 * np.cos(3 * tau)
        other = np.cos(tau - 2 * np.pi * phase) + 0.3 * np.cos(2 * tau)
        stiffness = np.array([1.0 + depth * wave, 1.4 * (1.0 + depth * other)])
        state = [
            np.linalg.solve(geared_chain.K + (geared_chain.W * k) @ geared_chain.W.T, geared_chain.load)
            for k in stiffness.T
        ]
        deflection = geared_chain.W.T @ np.array(state).T
        return MeshExcitation(stiffness, deflection, stiffness * deflection, np.zeros(2))

    return build


@pytest.fixture
def planet_set():
    """A function: N identical planets between a sun and a ring on supports, in rotational coordinates."""

    def build(n=3):
        size = 6 + 3 * n
        M, K, W = np.ones(size), np.zeros((size, size)), np.zeros((size, 2 * n))
        M[:6] = 1.2, 1.2, 0.8, 3.0, 3.0, 2.0
        K[range(6), range(6)] = 0.2, 0.2, 0.02, 5.0, 5.0, 4.0
        for p in range(n):
            psi, first = 2 * np.pi * p / n, 6 + 3 * p
            radial = np.array([np.cos(psi), np.sin(psi)])
            tangent = np.array([-radial[1], radial[0]])
            sun, ring = 0.9 * tangent - 0.4 * radial, 0.94 * tangent + 0.34 * radial
            M[first : first + 3] = 0.5, 0.5, 0.3
            K[range(first, first + 2), range(first, first + 2)] += 3.0
            W[0:2, p], W[2, p] = sun, 1.0
            W[first : first + 2, p], W[first + 2, p] = -sun, 1.0
            W[first : first + 2, n + p], W[first + 2, n + p] = ring, -1.0
            W[3:5, n + p], W[5, n + p] = -ring, -1.0
        load = np.zeros(size)
        load[2] = 1.0
        return MechanicalSystem(np.diag(M), np.zeros((size, size)), K, W, load, ())

    return build


@pytest.fixture
def planet_excitation():
    """A function: meshes of identical planets, each later by its phase (fractions of 48 positions)."""

    def build(phases, depth=0.15, positions=48):
        n = len(phases) // 2
        tau = np.arange(positions) / positions
        rows = []
        for j, phase in enumerate(phases):
            t = 2 * np.pi * (tau - phase)
            wave = np.cos(t) + 0.3 * np.sin(2 * t) if j < n else 0.8 * np.sin(t) - 0.2 * np.cos(3 * t)
            rows.append((1.3 if j < n else 1.0) * (1.0 + depth * wave))
        stiffness = np.array(rows)
        force = np.full_like(stiffness, 1.0 / n)
        return MeshExcitation(stiffness, force / stiffness, force, np.zeros(2 * n))

    return build
