"""What flanks yield beside the load: half plane, Hertz's half width, and the wedge at the tip of a tooth.

Flamant's solution (K. L. Johnson, Contact Mechanics, 1985, section 2.2): a line load ``P`` [N/m] at the
origin of the surface moves a point at distance ``x`` along the surface and depth ``z`` into the body by

    w(x, z) = P / (4 pi mu) [-4 (1 - nu) ln r + 2 z^2 / r^2],    r^2 = x^2 + z^2

up to a rigid motion; here the constant is the one of this formula with ``r`` in metres. Only differences
of two displacements mean anything, and in these the constant drops out.

Near a tip corner the tooth is a wedge between flank and tip land, not a half plane: the nearer the corner,
the more it yields, by a logarithm that neither elements nor interpolation between stations can follow. The
wedge under a normal line load on one face is solved by Mellin's transform in the distance from the apex
(C. J. Tranter, Q. J. Mech. Appl. Math. 1, 1948), that is by powers ``r^lambda`` along
``Re lambda = 1/2`` (M. L. Williams, J. Appl. Mech. 19, 1952; J. R. Barber, Elasticity, ch. 11). The half
plane, itself a wedge of 180 degrees, is subtracted in the transform; what is left is smooth under the load.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from femgear.fe.elasticity import Material
from femgear.gears.gear import Gear

_REAL_PART = 0.5
"""Real part of the powers: between the resultant force (0) and the rotation (1)."""
_STEP, _LAST = 0.1, 10.0
"""Of the trapezoidal rule along the line, whose integrand decays faster than ``exp(-2 omega)``."""


def surface_displacement(x, half_width, shear_modulus, poisson_ratio):
    """Compute the displacement of the surface into the body under a cell of uniform pressure.

    Mean of Flamant's ``w(x - s, 0)`` over ``|s| <= half_width`` (Johnson, section 2.5, uniform pressure).

    Parameters
    ----------
    x, half_width : arrays that broadcast
        Distance from the middle of the cell and half width of the cell [m].
    shear_modulus, poisson_ratio : float
        [Pa], [1].

    Returns
    -------
    array
        Displacement [m] per unit line load [N/m] on the cell, with the datum of this module.
    """
    x = np.asarray(x, float)
    mean_log = (_x_log(x + half_width) - _x_log(x - half_width)) / (2 * half_width) - 1.0
    return -(1 - poisson_ratio) / (np.pi * shear_modulus) * mean_log


def depth_displacement(x, depth, shear_modulus, poisson_ratio):
    """Compute the displacement, in the direction of the load, of a point at `depth` under the surface.

    Flamant's ``w(x, depth)`` for a line load on the surface, with the units and the datum of
    `surface_displacement`.

    Parameters
    ----------
    x, depth : arrays that broadcast
        Distance along the surface between the load and the foot of the point, and depth [m].
    shear_modulus, poisson_ratio : float
        [Pa], [1].
    """
    r2 = np.square(np.asarray(x, float)) + depth**2
    return (-2 * (1 - poisson_ratio) * np.log(r2) + 2 * depth**2 / r2) / (4 * np.pi * shear_modulus)


def hertz_half_width(line_load: float, radius: float, modulus: float) -> float:
    """Compute the half width [m] of Hertz's line contact, ``sqrt(4 P R / (pi E*))`` (Johnson, eq. 4.43).

    Line load ``P`` [N/m], relative radius of curvature ``R`` [m], contact modulus ``E*`` [Pa],
    ``1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2``.
    """
    return float(np.sqrt(4 * line_load * radius / (np.pi * modulus)))


@dataclass(frozen=True)
class TipCorner:
    """A wedge less the half plane: normal displacement of one face per unit line load normal to it.

    Parameters
    ----------
    arc : float
        Arc length of the corner along the flank, from the base circle [m].
    angle : float
        Of the wedge, between flank and tip land [rad].
    shear_modulus, poisson_ratio : float
        [Pa], plane strain.
    logarithm, bump : float
        Factors of `surface` [m per N/m].
    """

    arc: float
    angle: float
    shear_modulus: float
    poisson_ratio: float
    logarithm: float
    bump: float

    def surface(self, x, y):
        """Displacement at distance `x` from the corner by a load at distance `y` (arrays, [m]).

        ``-L ln(x + y) + 4 B x y / (x + y)^2``: exact where the distances are equal or very different, within
        0.006 of the half plane's factor ``(1 - nu) / (pi mu)`` in between.
        """
        both = x + y
        return 4 * self.bump * x * y / (both * both) - self.logarithm * np.log(both)

    def depth(self, x, depth, y):
        """Displacement at `depth` below the face point `x` by a load at distance `y` > 0 (arrays, [m])."""
        r, theta = np.hypot(x, depth) / y, np.arctan2(depth, x)
        excess = _excess(self.angle, r, theta, self.poisson_ratio) / self.shear_modulus
        # the apex is the datum of the transform; infinity is that of reciprocal displacements
        return excess - self.logarithm * np.log(y)


def tip_corner(gear: Gear, material: Material) -> TipCorner:
    """Find the wedge at the tip corner of a gear's flank: 90 degrees and the pressure angle at the tip."""
    angle = 0.5 * math.pi + math.acos(min(gear.base_radius / gear.tip_radius, 1.0))
    nu, mu = material.poisson_ratio, material.shear_modulus
    logarithm = (1 - nu) / (math.pi * mu) * apex_excess(angle)
    equal = float(_excess(angle, 1.0, 0.0, nu)) / mu
    arc = gear.tip_roll**2 / (2 * gear.base_radius)
    return TipCorner(arc, angle, mu, nu, logarithm, equal + logarithm * math.log(2.0))


def apex_excess(angle: float) -> float:
    """Logarithmic displacement of the loaded apex of a wedge over that of a half plane, less one.

    From the radial stresses of a force at the apex along the bisector and across it (Timoshenko and
    Goodier, Theory of Elasticity, sections 38 and 39); the force is normal to one face.
    """
    along, across = math.sin(0.5 * angle) ** 2, math.cos(0.5 * angle) ** 2
    return math.pi * (along / (angle + math.sin(angle)) + across / (angle - math.sin(angle))) - 1.0


def _excess(angle, r, theta, poisson_ratio):
    """Displacement in the direction of a unit load at distance 1 times the shear modulus, apex at rest.

    Wedge less half plane, at polar coordinates (r, theta) from the apex, theta from the loaded face.
    """
    omega = np.arange(0.0, _LAST + 0.5 * _STEP, _STEP)
    power = _REAL_PART + 1j * omega
    weight = np.where(omega == 0, 0.5, 1.0) * _STEP / math.pi
    kappa = 3 - 4 * poisson_ratio
    A, B, C, D = (_stress_function(angle, power) - _stress_function(math.pi, power)) * weight
    sine, cosine = (power + 1) * A + kappa * C, (power + 1) * B + kappa * D
    shape = np.broadcast(r, theta).shape
    r, theta = np.broadcast_to(np.log(r), shape).ravel(), np.broadcast_to(theta, shape).ravel()
    forward = np.exp(power[:, None] * (r + 1j * theta))
    backward = np.exp(power[:, None] * (r - 1j * theta))
    total = (-0.5j * sine - 0.5 * cosine) @ forward + (0.5j * sine - 0.5 * cosine) @ backward
    turn = np.exp(-2j * theta)
    total += turn * ((power * (-0.5j * C - 0.5 * D)) @ forward)
    total += turn.conj() * ((power * (0.5j * C - 0.5 * D)) @ backward)
    return (0.5 * total.real).reshape(shape)


def _stress_function(angle, power):
    """Factors (4, n) of Airy's function ``r^(p + 1) f(theta)`` for a unit pressure at r = 1 on theta = 0.

    ``f = A cos (p+1) theta + B sin (p+1) theta + C cos (p-1) theta + D sin (p-1) theta``; the radial stress
    is left out of account, ``p (p+1) f`` is the normal and ``-p f'`` the shear stress on a face.
    """
    up, down = power + 1, power - 1
    matrix, right = np.zeros((len(power), 4, 4), complex), np.zeros((len(power), 4, 1), complex)
    matrix[:, 0, 0] = matrix[:, 0, 2] = 1.0
    matrix[:, 1, 1], matrix[:, 1, 3] = up, down
    cosines, sines = (np.stack([f(up * angle), f(down * angle)]) for f in (np.cos, np.sin))
    matrix[:, 2, 0::2], matrix[:, 2, 1::2] = cosines.T, sines.T
    matrix[:, 3, 0::2] = (-np.stack([up, down]) * sines).T
    matrix[:, 3, 1::2] = (np.stack([up, down]) * cosines).T
    matrix[:, 2:] /= np.exp(power.imag * angle)[:, None, None]
    right[:, 0, 0] = -1.0 / (power * up)
    return np.linalg.solve(matrix, right)[..., 0].T


def _x_log(t):
    """``t ln|t|``, continued by zero."""
    return t * np.log(np.where(t == 0, 1.0, np.abs(t)))
