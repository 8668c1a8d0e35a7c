"""Hertz's line contact in closed form, and influence functions of plane-strain half planes.

Flamant's solution with the datum of `femgear.contact.local_compliance`; Johnson is K. L. Johnson, Contact
Mechanics, 1985.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import xlogy

from femgear.contact.local_compliance import hertz_half_width


def point_surface_relative_to_depth(x, depth, shear_modulus, poisson_ratio):
    """Approach of a surface point to the point at `depth` below it, for a line load at distance `x`.

    ``w(x, 0) - w(x, depth)`` of Flamant's solution; infinite at ``x = 0``.

    Parameters
    ----------
    x : array of any shape
        Distance between the load and the surface point [m].
    depth : float
        [m].
    shear_modulus : float
        [Pa].
    poisson_ratio : float

    Returns
    -------
    array, shape of `x`
        Approach [m] per unit line load [N/m].
    """
    x2 = np.square(np.asarray(x, float))
    with np.errstate(divide="ignore"):
        logarithm = np.log1p(depth**2 / x2)
    near = 2 * (1 - poisson_ratio) * logarithm - 2 * depth**2 / (x2 + depth**2)
    return near / (4 * np.pi * shear_modulus)


def surface_relative_to_depth(x, half_width, depth, shear_modulus, poisson_ratio):
    """Approach of a surface point to the point at `depth` below it, under a cell of uniform pressure.

    The mean of `point_surface_relative_to_depth` over the cell. Its antiderivative is elementary,

        4 pi mu F(t) = 2 (1 - nu) t ln(1 + d^2 / t^2) + (2 - 4 nu) d arctan(t / d),

    and the approach is ``[F(x + h) - F(x - h)] / (2 h)``.

    Parameters
    ----------
    x : array of any shape
        Distance from the middle of the cell [m].
    half_width : float
        Half width ``h`` of the cell [m].
    depth : float
        Depth ``d`` of the reference point [m].
    shear_modulus : float
        [Pa].
    poisson_ratio : float

    Returns
    -------
    array, shape of `x`
        Approach [m] per unit line load [N/m] on the cell.
    """
    x = np.asarray(x, float)
    logarithms = _t_log1p(x + half_width, depth) - _t_log1p(x - half_width, depth)
    # difference of two arctangents in one step: no cancellation far from the cell
    angle = np.arctan2(2 * half_width * depth, depth**2 + x**2 - half_width**2)
    total = 2 * (1 - poisson_ratio) * logarithms + (2 - 4 * poisson_ratio) * depth * angle
    return total / (2 * half_width * 4 * np.pi * shear_modulus)


def cell_influence(x, half_width, datum, contact_modulus):
    """Approach of two half planes at distance `x` from a cell of uniform pressure, relative to a far datum.

    ``-2 / (pi E*)`` times the mean of ``ln(|x - s| / D)`` over the cell (Johnson, eq. 2.24b with its
    constant put at a distance ``D`` that is large against the contact).

    Parameters
    ----------
    x : array of any shape
        Distance from the middle of the cell [m].
    half_width : float
        Half width of the cell [m].
    datum : float
        Distance ``D`` of the surface points that count as fixed [m].
    contact_modulus : float
        ``E*`` of both bodies [Pa]; see `contact_modulus`.

    Returns
    -------
    array, shape of `x`
        Approach [m] per unit line load [N/m] on the cell.
    """
    x = np.asarray(x, float) / datum
    h = half_width / datum
    mean_log = (xlogy(x + h, np.abs(x + h)) - xlogy(x - h, np.abs(x - h))) / (2 * h) - 1.0
    return -2.0 / (np.pi * contact_modulus) * mean_log


def contact_modulus(youngs_modulus_1, poisson_ratio_1, youngs_modulus_2, poisson_ratio_2):
    """``E*`` of two bodies in plane strain, ``1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2`` [Pa].

    Johnson, Contact Mechanics, eq. 4.1 and appendix 3.
    """
    return 1.0 / ((1 - poisson_ratio_1**2) / youngs_modulus_1 + (1 - poisson_ratio_2**2) / youngs_modulus_2)


def relative_radius(radius_1, radius_2):
    """Relative radius of curvature [m], ``1/R = 1/R_1 + 1/R_2``; a hollow surface has a negative radius."""
    return 1.0 / (1.0 / radius_1 + 1.0 / radius_2)


@dataclass(frozen=True)
class HertzLine:
    """Hertz's line contact.

    Parameters
    ----------
    line_load : float
        ``P`` [N/m].
    radius : float
        Relative radius of curvature ``R`` [m].
    modulus : float
        Contact modulus ``E*`` [Pa].
    half_width : float
        ``a = sqrt(4 P R / (pi E*))`` [m].
    peak_pressure : float
        ``p_0 = 2 P / (pi a)`` [Pa]; zero without load.
    """

    line_load: float
    radius: float
    modulus: float
    half_width: float
    peak_pressure: float

    def pressure(self, x):
        """Pressure [Pa] at distance `x` [m] from the middle, ``p_0 sqrt(1 - x^2/a^2)``."""
        x = np.asarray(x, float)
        if self.half_width == 0:
            return np.zeros_like(x)
        return self.peak_pressure * np.sqrt(np.maximum(1 - (x / self.half_width) ** 2, 0.0))

    def approach(self, datum):
        """Approach [m] of the bodies relative to surface points at distance `datum` [m] from the middle.

        ``P / (pi E*) [2 ln(2 D / a) + 1]`` for ``D`` much larger than ``a`` (Johnson, section 5.6).
        """
        if self.half_width == 0:
            return 0.0
        return self.line_load / (np.pi * self.modulus) * (2 * np.log(2 * datum / self.half_width) + 1)

    def max_shear(self):
        """Largest shear stress under the surface [Pa] and its depth [m].

        On the axis ``tau = p_0 (zeta - zeta^2 / sqrt(1 + zeta^2))``, ``zeta = z/a`` (Johnson, eq. 4.46);
        its maximum lies at ``zeta^2 = (sqrt(5) - 1) / 2``.
        """
        zeta_squared = (np.sqrt(5.0) - 1) / 2
        zeta = np.sqrt(zeta_squared)
        tau = zeta - zeta_squared / np.sqrt(1 + zeta_squared)
        return float(self.peak_pressure * tau), float(self.half_width * zeta)


def hertz_line(line_load, radius, modulus):
    """Hertz's line contact of two bodies (Johnson, eqs. 4.43 to 4.45).

    Parameters
    ----------
    line_load : float
        Load per unit width [N/m], not negative.
    radius : float
        Relative radius of curvature [m]; see `relative_radius`.
    modulus : float
        Contact modulus ``E*`` [Pa]; see `contact_modulus`.

    Returns
    -------
    HertzLine
    """
    half_width = hertz_half_width(line_load, radius, modulus) if line_load else 0.0
    peak = float(2 * line_load / (np.pi * half_width)) if half_width else 0.0
    return HertzLine(float(line_load), float(radius), float(modulus), half_width, peak)


def weber_banaschek(line_load, half_width, depth, youngs_modulus, poisson_ratio):
    """Approach of the middle of a Hertzian contact to the point at `depth` below it, one body.

    ``2 P (1 - nu^2) / (pi E) [ln(2 d / a) - nu / (2 (1 - nu))]`` for ``d`` much larger than ``a``
    (C. Weber, K. Banaschek, Formaenderung und Profilruecknahme bei gerad- und schraegverzahnten Raedern,
    1953).

    Parameters
    ----------
    line_load : float
        ``P`` [N/m].
    half_width : float
        Half width of the contact ``a`` [m].
    depth : float
        ``d`` [m].
    youngs_modulus : float
        [Pa].
    poisson_ratio : float

    Returns
    -------
    float
        Approach [m].
    """
    factor = 2 * line_load * (1 - poisson_ratio**2) / (np.pi * youngs_modulus)
    return float(factor * (np.log(2 * depth / half_width) - poisson_ratio / (2 * (1 - poisson_ratio))))


def _t_log1p(t, depth):
    """``t ln(1 + depth^2 / t^2)``, continued by zero."""
    safe = np.where(t == 0, 1.0, t)
    return np.where(t == 0, 0.0, t * np.log1p((depth / safe) ** 2))
