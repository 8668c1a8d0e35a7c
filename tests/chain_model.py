"""A motor, a gear, its mate and a load with one mesh, as a model for other programs: shared by tests of its formats."""

from dataclasses import replace

import numpy as np

from femgear.exchange.dynamic_model import DynamicModel
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.linear.state_space import Port, modal_model
from femgear.system.system import MechanicalSystem, MeshExcitation, Modes

POSITIONS, HARMONICS, TORQUE, DAMPING = 256, 4, 60.0, 0.1
RADII, INERTIAS = np.array([0.04, 0.06]), np.array([0.02, 2e-3, 6e-3, 0.05])


def chain_system(sources: np.ndarray | None = None) -> MechanicalSystem:
    """Rotations of motor, gear 1, gear 2 and load [rad], couplings between them, the mesh as column."""
    K = np.zeros((4, 4))
    for first, stiffness in ((0, 3e5), (2, 6e5)):
        K[first : first + 2, first : first + 2] += stiffness * np.array([[1.0, -1.0], [-1.0, 1.0]])
    W = np.array([[0.0], [RADII[0]], [RADII[1]], [0.0]])
    load = np.array([TORQUE, 0.0, 0.0, TORQUE * RADII[1] / RADII[0]])
    names = ("motor: rotation", "gear 1: rotation", "gear 2: rotation", "load: rotation")
    return MechanicalSystem(np.diag(INERTIAS), np.zeros((4, 4)), K, W, load, names, sources=sources)


def chain_excitation(depth: float = 0.2, *, error: float = 1e-6, backlash: float = 0.0) -> MeshExcitation:
    """Stiffness of a mesh that waves in a few harmonics, with the transmission error of flanks that are not exact."""
    theta = 2.0 * np.pi * np.arange(POSITIONS) / POSITIONS
    k = 3e8 * (1.0 + depth * (np.cos(theta) + 0.4 * np.sin(2.0 * theta) - 0.2 * np.cos(4.0 * theta)))
    force = np.full(POSITIONS, TORQUE / RADII[0])
    deflection = 6e-6 + error * (np.cos(theta - 0.5) + 0.4 * np.sin(3.0 * theta))
    return MeshExcitation(k[None], deflection[None], force[None], np.array([backlash]))


def chain_modes(system: MechanicalSystem, excitation: MeshExcitation, count: int | None = None) -> Modes:
    """Modes with the mean mesh stiffness."""
    return undamped_modes(system, excitation.stiffness.mean(axis=1), damping_ratio=DAMPING, count=count)


def chain_model(
    excitation: MeshExcitation | None = None, *, separates: bool = False, count: int | None = None
) -> DynamicModel:
    """Make the model, with torques on motor and load, in so many modes of four."""
    system, excitation = chain_system(), chain_excitation() if excitation is None else excitation
    unit = np.eye(4)
    modes = chain_modes(system, excitation, count)
    outputs = [Port(name, "rad", row) for name, row in zip(system.dofs, unit, strict=True)]
    inputs = [Port(f"torque on {('motor', 'load')[i > 0]}", "N m", unit[i], float(system.load[i])) for i in (0, 3)]
    modal = modal_model(system, modes, meshes=["gear 1-gear 2"], inputs=inputs, outputs=outputs)
    return DynamicModel("a chain", modal, excitation, 150.0, 20.0 / (2.0 * np.pi), 0, separates)


def rubbing_chain() -> tuple[DynamicModel, Modes]:
    """The chain with friction on its mesh: a force along the flanks, a moment, and what the load takes of both."""
    sources = np.zeros((4, 3))
    sources[1:3, 0], sources[1:3, 1], sources[3, 2] = (0.01, -0.02), (1.0, -0.5), 1.0
    system, plain = chain_system(sources), chain_excitation()
    theta = 2.0 * np.pi * np.arange(POSITIONS) / POSITIONS
    acting = np.stack([50.0 * np.sin(theta), 0.3 * np.cos(theta), 0.0 * theta])
    modes, excitation = chain_modes(system, plain), replace(plain, source=acting)
    model = chain_model(excitation)
    inputs = model.modal.inputs
    outputs = model.modal.outputs
    modal = modal_model(system, modes, meshes=model.modal.meshes, inputs=inputs, outputs=outputs)
    return replace(model, modal=modal), modes
