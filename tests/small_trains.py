"""Trains that tests share: gear pairs."""

import numpy as np

from femgear.system.system import MechanicalSystem
from femgear.trains.impacts.model import ImpactPair


def equivalent_mass(inertia, base_radius):
    """Mass [kg] of two gears that moves along their line of action."""
    (one, other), (first, second) = inertia, base_radius
    return one * other / (first**2 * other + second**2 * one)


def gear_pair(inertia, base_radius, *, torque=0.0, mesh_damping=0.0):
    """Two gears on rigid shafts (Kahraman and Singh 1990); the rotation in their ratio is free."""
    column = np.array([[base_radius[0]], [-base_radius[1]]])
    return MechanicalSystem(
        M=np.diag(inertia),
        C=mesh_damping * (column @ column.T),
        K=np.zeros((2, 2)),
        W=column,
        load=torque / base_radius[0] * column[:, 0],
        dofs=("theta_1", "theta_2"),
    )


def example_pair(damping_ratio):
    """The pair of cases/gear_pair.toml without dimensions."""
    return ImpactPair(damping_ratio=damping_ratio, load=0.9, tooth_error=(0.72,), stiffness=(-0.1,))


def lightly_loaded_pair(damping_ratio=0.05):
    """The pair of cases/gear_pair_light.toml without dimensions."""
    return ImpactPair(damping_ratio=damping_ratio, load=0.1, tooth_error=(0.2,))


def level_crossings(parameter, value, level):
    """Parameters at which a quantity along a curve passes a level, by linear interpolation."""
    parameter, away = np.asarray(parameter, float), np.asarray(value, float) - level
    i = np.flatnonzero(np.signbit(away[:-1]) != np.signbit(away[1:]))
    share = away[i] / (away[i] - away[i + 1])
    return parameter[i] + share * (parameter[i + 1] - parameter[i])
