"""Friction torque of rolling bearings (A. Palmgren, Grundlagen der Wälzlagertechnik, 1964; T. A. Harris and M. N.
Kotzalas, Essential Concepts of Bearing Technology, 2006, chapter 10).

``M = M_0 + M_1``. The part of the lubricant is ``M_0 = 1e-7 f_0 (nu n)^(2/3) d_m^3``, from ``nu n = 2000`` mm^2/s rpm
on, below it ``160e-7 f_0 d_m^3``, in N mm, with the viscosity nu [mm^2/s], the speed n [rpm] and the pitch diameter d_m
[mm]. The part of the load is ``M_1 = f_1 P_1 d_m``. Friction at ribs and drag in a deep bath are left out.

A radial shaft seal takes ``P = 7.69e-6 d^2 n`` [W, mm, rpm] (ISO/TR 14179-2), whatever its oil: a torque.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from femgear.errors import CaseError

Kind = Literal["ball", "cylindrical", "needle", "tapered", "spherical"]
OIL_BATH = {"ball": 2.0, "angular": 3.3, "cylindrical": 3.0, "needle": 12.0, "tapered": 6.0, "spherical": 5.0}
"""f_0 of kinds of bearing in an oil bath, means of the ranges of Harris and Kotzalas; "angular": with a contact
angle."""
LOAD = {"cylindrical": 3e-4, "needle": 1e-3, "tapered": 4e-4, "spherical": 4.5e-4}
"""f_1 of roller bearings, means of their ranges."""
BALL_LOAD = {"ball": (5e-4, 0.55), "angular": (1e-3, 0.33)}
"""z and y in ``f_1 = z (P_0/C_0)^y`` of ball bearings; P_0 is the equivalent static load."""
SEAL_POWER = 7.69e-6
"""Power of a radial shaft seal over diameter squared and speed [W/(mm^2 rpm)], ISO/TR 14179-2."""
_RADIAL = math.radians(1.0)
_LEAST_PRODUCT = 2000.0  # mm^2/s rpm


def seal_torque(diameter: float) -> float:
    """Compute the friction torque of a radial shaft seal [N m] of a diameter [m]."""
    return SEAL_POWER * (1e3 * diameter) ** 2 * 30.0 / math.pi


def friction_kind(kind: Kind, contact_angle: float) -> str:
    """Name the kind of bearing by whose factors friction goes: balls with a contact angle [rad] are "angular"."""
    return "angular" if kind == "ball" and abs(contact_angle) > _RADIAL else kind


def lubricant_torque(factor: float, pitch_diameter: float, speed: float, viscosity: float) -> float:
    """Compute M_0 [N m].

    Parameters
    ----------
    factor : float
        f_0.
    pitch_diameter : float
        [m]
    speed : float
        Of the rings against each other [rad/s].
    viscosity : float
        Kinematic [m^2/s].
    """
    if not speed:
        return 0.0
    product = 1e6 * viscosity * abs(speed) * 30.0 / math.pi
    return 1e-10 * factor * max(product, _LEAST_PRODUCT) ** (2.0 / 3.0) * (1e3 * pitch_diameter) ** 3


def friction_load(kind: Kind, contact_angle: float, radial: float, axial: float) -> float:
    """Compute P_1 [N], the load that decides M_1, from radial and axial force [N].

    Ball bearings ``max(0.9 F_a cot(alpha) - 0.1 F_r, F_r)``, without a contact angle ``max(3 F_a - 0.1 F_r, F_r)``;
    roller bearings ``max(0.8 F_a cot(alpha), F_r)``, without a contact angle F_r.
    """
    thrust, angle = abs(axial), abs(contact_angle)
    if kind == "ball":
        share = 0.9 / math.tan(angle) if angle > _RADIAL else 3.0
        return max(share * thrust - 0.1 * radial, radial)
    return max(0.8 * thrust / math.tan(angle), radial) if angle > _RADIAL else radial


def load_factor(kind: Kind, contact_angle: float, radial: float, axial: float, static_rating: float | None) -> float:
    """Compute f_1.

    Parameters
    ----------
    radial, axial : float
        Forces [N]; the equivalent static load of ball bearings is ``max(F_r, 0.6 F_r + 0.5 F_a)``, of those with a
        contact angle ``max(F_r, 0.5 F_r + 0.3 F_a)`` (ISO 76).
    static_rating : float or None
        C_0 [N], which ball bearings need.

    Raises
    ------
    CaseError
        E-KEY-MISSING: a ball bearing without C_0.
    """
    name = friction_kind(kind, contact_angle)
    if name not in BALL_LOAD:
        return LOAD[name]
    if static_rating is None:
        raise CaseError(
            "the friction of a ball bearing goes by its static rating, which is missing",
            code="E-KEY-MISSING",
            key="static_rating",
            remedy='give static_rating = "20 kN"',
        )
    scale, power = BALL_LOAD[name]
    share, thrust = (0.6, 0.5) if name == "ball" else (0.5, 0.3)
    equivalent = max(radial, share * radial + thrust * abs(axial))
    return scale * float(np.power(equivalent / static_rating, power))


@dataclass(frozen=True)
class FrictionFactors:
    """f_1 and f_0 of a bearing.

    Parameters
    ----------
    load, lubricant : float
        f_1 and f_0.
    """

    load: float
    lubricant: float

    def torque(self, load: float, pitch_diameter: float, speed: float, viscosity: float | None) -> float:
        """Compute M_0 + M_1 [N m], M_1 alone without a viscosity.

        Parameters
        ----------
        load : float
            P_1 [N].
        pitch_diameter, speed, viscosity
            As for `lubricant_torque`.
        """
        torque = self.load * load * pitch_diameter
        if viscosity is None:
            return torque
        return torque + lubricant_torque(self.lubricant, pitch_diameter, speed, viscosity)
