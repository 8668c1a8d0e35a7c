"""A pair of gears on rigid shafts: two rotations and one mesh.

A. Kahraman and R. Singh, Non-linear dynamics of a spur gear pair, J. Sound Vib. 142 (1990) 49-75, Eqs. (1) to
(4): the deflection along the line of action is ``x = r_1 theta_1 - r_2 theta_2``, and with the mass
``m_e = I_1 I_2 / (r_1^2 I_2 + r_2^2 I_1)`` it obeys ``m_e x'' + c x' + f(x, t) = T_1 / r_1``.
"""

from __future__ import annotations

import numpy as np

from femgear.errors import CaseError
from femgear.solvers.entries import checked_numbers
from femgear.system import MechanicalSystem


def gear_pair(
    inertia: tuple[float, float],
    base_radius: tuple[float, float],
    *,
    torque: float = 0.0,
    mesh_damping: float = 0.0,
) -> MechanicalSystem:
    """Driving gear 1 and driven gear 2; give it one `GearMeshes` on column 0.

    The rotation of both gears in their ratio is free; the torque on gear 2 balances that on gear 1.

    Parameters
    ----------
    inertia : (2,) sequence
        Polar moments of inertia [kg m^2].
    base_radius : (2,) sequence
        [m]
    torque : float
        On gear 1 [N m]; positive presses the drive flanks together.
    mesh_damping : float
        Viscous damping along the line of action [N s/m]. It acts on ``x'``; where the mesh has a deflection
        (transmission error) the publication lets it act on the motion beyond that.

    Returns
    -------
    MechanicalSystem
        Rotations ``theta_1``, ``theta_2`` [rad], opposite senses positive, and the column of the mesh.

    Raises
    ------
    CaseError
        Inertias or radii that are not positive, a damping that is negative, numbers that are not finite.
    """
    inertia, radius = (
        checked_numbers(pair, name, code="E-GEAR-PAIR", unit=unit).copy()
        for pair, name, unit in ((inertia, "inertia", "kg m^2"), (base_radius, "base_radius", "m"))
    )
    torque = checked_numbers(torque, "torque", code="E-GEAR-PAIR", unit="N m").item()
    mesh_damping = checked_numbers(mesh_damping, "mesh_damping", code="E-GEAR-PAIR", unit="N s/m").item()
    for name, pair, unit in (("inertia", inertia, "kg m^2"), ("base_radius", radius, "m")):
        if pair.shape != (2,) or not np.all(np.isfinite(pair)) or np.any(pair <= 0.0):
            raise CaseError(
                f"{name} of a gear pair: {pair.tolist()} {unit}", code="E-GEAR-PAIR", key=name,
                limit="two positive numbers",
            )  # fmt: skip
    if not np.isfinite(torque):
        raise CaseError(f"a torque of {torque} N m", code="E-GEAR-PAIR", key="torque", limit="finite")
    if not (np.isfinite(mesh_damping) and mesh_damping >= 0.0):
        raise CaseError(
            f"a mesh damping of {mesh_damping} N s/m",
            code="E-GEAR-PAIR",
            key="mesh_damping",
            limit="0 or more",
        )
    column = np.array([[radius[0]], [-radius[1]]])
    return MechanicalSystem(
        M=np.diag(inertia), C=mesh_damping * (column @ column.T), K=np.zeros((2, 2)), W=column,
        load=torque / radius[0] * column[:, 0], dofs=("theta_1", "theta_2"),
    )  # fmt: skip


def equivalent_mass(inertia: tuple[float, float], base_radius: tuple[float, float]) -> float:
    """Mass ``m_e`` [kg] that moves along the line of action; ``sqrt(k / m_e)`` is the natural frequency."""
    (one, other), (first, second) = inertia, base_radius
    return one * other / (first**2 * other + second**2 * one)
