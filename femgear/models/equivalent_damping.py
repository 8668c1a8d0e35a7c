"""Viscous dampers of meshes and supports from damping ratios, spring by spring.

``c = 2 xi sqrt(k m_1 m_2 / (m_1 + m_2))`` for a mesh between two gears and ``c = 2 xi sqrt(k m)`` for a
support: each spring with its own masses alone would be damped by xi (S. S. Rao, Mechanical Vibrations,
section 2.6, critical damping, with the reduced mass of two bodies). In the whole set the ratio of a mode
comes out of all dampers; `femgear.solvers.nonlinear.modal_damping` gives every mode a ratio instead.
"""

from __future__ import annotations

import math

import numpy as np

from femgear.errors import CaseError
from femgear.models.planar import CENTRAL, PlanarSet, free_motions, mesh_directions, pin_directions
from femgear.models.planar_data import body_masses, member_radius
from femgear.solvers.entries import checked_numbers


def mesh_dampers(stiffness, mass_1, mass_2, ratio) -> np.ndarray:
    """``2 xi sqrt(k m_1 m_2 / (m_1 + m_2))`` [N s/m].

    Parameters
    ----------
    stiffness : array
        Mean mesh stiffness [N/m].
    mass_1, mass_2 : arrays
        Of the gears along the line of action, ``I / r_b^2`` for their rotations [kg]; infinite for a gear
        that is held.
    ratio : array

    Raises
    ------
    CaseError
        Negative or undefined values, masses that are not above zero (E-DAMPING).
    """
    given = {"stiffness": stiffness, "mass_1": mass_1, "mass_2": mass_2, "ratio": ratio}
    k, m1, m2, xi = (_numbers(name, value) for name, value in given.items())
    _not_negative("mesh stiffness", k)
    _not_negative("damping ratio", xi)
    if not (np.all(m1 > 0.0) and np.all(m2 > 0.0)):
        raise CaseError("a mesh between gears without mass", code="E-DAMPING", limit="masses above 0 kg")
    flexibility = 1.0 / m1 + 1.0 / m2
    if np.any(flexibility == 0.0):
        raise CaseError(
            "a mesh between two gears that are held", code="E-DAMPING", limit="one finite mass a mesh"
        )
    return 2.0 * xi * np.sqrt(k / flexibility)


def support_dampers(stiffness, mass, ratio) -> np.ndarray:
    """``2 xi sqrt(k m)`` [N s/m]; [N m s] of a torsional stiffness and a polar inertia.

    Raises
    ------
    CaseError
        Negative or undefined values (E-DAMPING).
    """
    given = {"stiffness": stiffness, "mass": mass, "ratio": ratio}
    k, m, xi = (_numbers(name, value) for name, value in given.items())
    for name, value in (("support stiffness", k), ("mass", m), ("damping ratio", xi)):
        _not_negative(name, value)
    return 2.0 * xi * np.sqrt(k * m)


def planar_mesh_dampers(data: PlanarSet, ratio) -> np.ndarray:
    """Dampers (2N,) of the meshes with the masses ``I / r_b^2`` of the gears [N s/m].

    Parameters
    ----------
    data : PlanarSet
    ratio : float or (2N,) array
    """
    if _numbers("mesh_ratio", ratio).shape not in ((), (2 * data.n_planets,)):
        raise CaseError(
            f"mesh damping ratios of shape {np.shape(ratio)}", code="E-DAMPING", key="mesh_ratio",
            limit=f"one, or {2 * data.n_planets}: one a mesh",
        )  # fmt: skip
    turning = body_masses(data)[:, 2]
    held = {name: math.isinf(getattr(data, name).torsional_support) for name in CENTRAL}
    sun, ring = (math.inf if held[n] else turning[CENTRAL.index(n)] for n in ("sun", "ring"))
    central = np.repeat([sun, ring], data.n_planets)
    return mesh_dampers(data.mesh_stiffness, central, turning[-1], ratio)


def equivalent_damping(data: PlanarSet, *, mesh_ratio, support_ratio, flank: int = 1) -> np.ndarray:
    """Damping matrix of a lumped set in the coordinates of `planar_system`, for ``planar_problem(damping=)``.

    Parameters
    ----------
    data : PlanarSet
        Infinite stiffnesses hold their coordinates and have no dampers.
    mesh_ratio : float or (2N,) array
        Of the meshes.
    support_ratio : float
        Of all supports, torsional ones and planet bearings (with the planet's mass) included.
    flank : int
        1, or -1 when the torque loads the other flanks, see `flank_sign`.

    Returns
    -------
    (n, n) array
        ``sum c w w^T`` over the springs' directions w [N s/m].
    """
    if flank not in (1, -1):
        raise CaseError(f"flank {flank}", code="E-DAMPING", key="flank", limit="1 or -1")
    if _numbers("support_ratio", support_ratio).ndim:
        raise CaseError("several support damping ratios", code="E-DAMPING", key="support_ratio", limit="one")
    W = mesh_directions(data, flank)
    C = (W * planar_mesh_dampers(data, mesh_ratio)) @ W.T
    along = np.zeros(len(W))
    for row, name in enumerate(CENTRAL):
        body, radius = getattr(data, name), member_radius(data, name)
        if math.isfinite(body.support):
            along[3 * row : 3 * row + 2] = support_dampers(body.support, body.mass, support_ratio)
        if math.isfinite(body.torsional_support):
            turning = support_dampers(body.torsional_support, body.inertia, support_ratio)
            along[3 * row + 2] = turning / radius**2
    C += np.diag(along)
    finite = np.where(np.isfinite(data.planet_bearing), data.planet_bearing, 0.0)
    pins = pin_directions(data)
    dampers = support_dampers(finite, data.planet.mass, support_ratio)
    C += np.einsum("ina,n,jna->ij", pins, dampers, pins)
    T = free_motions(data)
    return T.T @ C @ T


def _numbers(name: str, value) -> np.ndarray:
    return checked_numbers(value, name, code="E-DAMPING", unit="")


def _not_negative(name: str, value: np.ndarray) -> None:
    if not (np.all(np.isfinite(value)) and np.all(value >= 0.0)):
        raise CaseError(f"{name} {value.tolist()}", code="E-DAMPING", limit="finite, 0 or more")
