"""Shafts that bend, shear and twist: Timoshenko beam elements, and two links with a joint of three springs.

Every station has five coordinates, x and y across the axis, the tilts about x and y, and the rotation about
the axis z; there is no axial motion. Stiffness and consistent mass: J. S. Przemieniecki, Theory of Matrix
Structural Analysis (1968), sections 5.6 and 11.3; gyroscopic terms: H. D. Nelson, J. Mech. Des. 102 (1980)
793-803.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError

AXES = ("x", "y", "tilt x", "tilt y", "rotation")


@dataclass(frozen=True)
class ShaftSection:
    """Round section and material.

    Parameters
    ----------
    outer_diameter, inner_diameter : float
        [m]
    young : float
        [Pa]
    poisson : float
    density : float
        [kg/m^3]; zero for a shaft without mass.

    Raises
    ------
    CaseError
        Numbers that no shaft has (E-SHAFT).
    """

    outer_diameter: float
    inner_diameter: float = 0.0
    young: float = 2.06e11
    poisson: float = 0.3
    density: float = 7850.0

    def __post_init__(self):
        numbers = [getattr(self, name) for name in self.__dataclass_fields__]
        if not np.all(np.isfinite(numbers)) or not (
            0.0 <= self.inner_diameter < self.outer_diameter
            and self.young > 0.0
            and 0.0 <= self.poisson < 0.5
            and self.density >= 0.0
        ):
            raise CaseError(
                f"a shaft section {self}", code="E-SHAFT",
                limit="0 <= inner < outer diameter, young > 0, 0 <= poisson < 0.5, density >= 0",
            )  # fmt: skip

    @property
    def area(self) -> float:
        """[m^2]"""
        return 0.25 * math.pi * (self.outer_diameter**2 - self.inner_diameter**2)

    @property
    def second_moment(self) -> float:
        """About a diameter [m^4]; twice as much about the axis."""
        return math.pi / 64.0 * (self.outer_diameter**4 - self.inner_diameter**4)

    @property
    def shear_modulus(self) -> float:
        """[Pa]"""
        return 0.5 * self.young / (1.0 + self.poisson)

    @property
    def shear_coefficient(self) -> float:
        """Of G. R. Cowper, J. Appl. Mech. 33 (1966) 335-340, round and hollow round section."""
        nu, m2 = self.poisson, (self.inner_diameter / self.outer_diameter) ** 2
        both = (1.0 + m2) ** 2
        return 6.0 * (1.0 + nu) * both / ((7.0 + 6.0 * nu) * both + (20.0 + 12.0 * nu) * m2)

    def shear_ratio(self, length: float) -> float:
        """``Phi = 12 E I / (kappa G A l^2)``: deflection by shear over that by bending."""
        shear = self.shear_coefficient * self.shear_modulus * self.area
        return 12.0 * self.young * self.second_moment / (shear * length**2)


@dataclass(frozen=True)
class JointSprings:
    """Springs of the joint in the middle of two rigid links, each half as long as the shaft.

    Parameters
    ----------
    bending : float
        Against the relative tilt of the links [N m/rad], equal about x and y.
    torsion : float
        [N m/rad]
    shear : float
        Against the relative displacement at the joint [N/m]; infinite for the spherical joint.
    """

    bending: float
    torsion: float
    shear: float = math.inf


def joint_springs(section: ShaftSection, length: float) -> JointSprings:
    """Springs of the joint of two links that have the static stiffness matrix of a Timoshenko shaft.

    ``E I / l`` in bending, ``G J / l`` in torsion, and a joint that shears with ``12 E I / ((1 + Phi) l^3)``.

    Parameters
    ----------
    section : ShaftSection
    length : float
        [m]
    """
    _check_length(length)
    bending, phi = section.young * section.second_moment / length, section.shear_ratio(length)
    torsion = 2.0 * section.shear_modulus * section.second_moment / length
    return JointSprings(bending, torsion, 12.0 * bending / ((1.0 + phi) * length**2))


def joint_deflections(length: float) -> np.ndarray:
    """Rows (5, 10) of the joint's deflections: shear along x and y, bend about x and y, twist.

    Each link moves with the station at its end; a tilt about y moves the joint along x, one about x along
    -y.
    """
    half = 0.5 * length
    first, second = np.eye(5), np.eye(5)
    first[0, 3], first[1, 2] = half, -half
    second[0, 3], second[1, 2] = -half, half
    return np.hstack([-first, second])


def beam_element(section: ShaftSection, length: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass, stiffness and gyroscopic matrix (10, 10) of an element between two stations.

    Returns
    -------
    M, K, G
        ``G`` multiplies the speed of rotation [rad/s], positive about z.
    """
    _check_length(length)
    l, phi = length, section.shear_ratio(length)
    springs = joint_springs(section, length)
    rows = joint_deflections(length)
    k = np.array([springs.shear, springs.shear, springs.bending, springs.bending, springs.torsion])
    K = (rows.T * k) @ rows
    moving, turning = _mass_terms(l, phi)
    line, rotary = section.density * section.area * l, section.density * section.second_moment / l
    plane = line / (1.0 + phi) ** 2 * moving + rotary / (1.0 + phi) ** 2 * turning
    # (x, tilt y) and (y, -tilt x) bend alike
    xz, yz, sign = [0, 3, 5, 8], [1, 2, 6, 7], np.array([1.0, -1.0, 1.0, -1.0])
    M, G = np.zeros((10, 10)), np.zeros((10, 10))
    M[np.ix_(xz, xz)] = plane
    M[np.ix_(yz, yz)] = sign[:, None] * plane * sign
    polar = 2.0 * section.density * section.second_moment * l
    M[np.ix_([4, 9], [4, 9])] = polar / 6.0 * np.array([[2.0, 1.0], [1.0, 2.0]])
    # a disc of polar inertia I has I tilt_y' in the row of tilt x and -I tilt_x' in that of tilt y
    block = 2.0 * rotary / (1.0 + phi) ** 2 * turning * sign
    G[np.ix_(xz, yz)] = block
    G[np.ix_(yz, xz)] = -block.T
    return M, K, G


def _mass_terms(l: float, phi: float) -> tuple[np.ndarray, np.ndarray]:
    """Translation and rotation (4, 4) in one plane, times (1 + Phi)^2, on w and its slope at both ends."""
    a, b = 13 / 35 + 7 * phi / 10 + phi**2 / 3, (11 / 210 + 11 * phi / 120 + phi**2 / 24) * l
    c, d = 9 / 70 + 3 * phi / 10 + phi**2 / 6, (13 / 420 + 3 * phi / 40 + phi**2 / 24) * l
    e, f = (1 / 105 + phi / 60 + phi**2 / 120) * l**2, (1 / 140 + phi / 60 + phi**2 / 120) * l**2
    moving = np.array([[a, b, c, -d], [b, e, d, -f], [c, d, a, -b], [-d, -f, -b, e]])
    g, h = 6 / 5, (1 / 10 - phi / 2) * l
    i, j = (2 / 15 + phi / 6 + phi**2 / 3) * l**2, (1 / 30 + phi / 6 - phi**2 / 6) * l**2
    turning = np.array([[g, h, -g, h], [h, i, -h, -j], [-g, -h, g, -h], [h, -j, -h, i]])
    return moving, turning


def disc_matrices(mass: float, polar: float, transverse: float) -> tuple[np.ndarray, np.ndarray]:
    """Mass (5, 5) and gyroscopic matrix (5, 5) of a rigid disc on its station.

    ``I_t tilt_x'' + I_p Omega tilt_y' = moment``, ``I_t tilt_y'' - I_p Omega tilt_x' = moment``.
    """
    G = np.zeros((5, 5))
    G[2, 3], G[3, 2] = polar, -polar
    return np.diag([mass, mass, transverse, transverse, polar]), G


def _check_length(length: float) -> None:
    if not (math.isfinite(length) and length > 0.0):
        raise CaseError(f"a shaft of {length} m", code="E-SHAFT", key="length", limit="above 0 m")
