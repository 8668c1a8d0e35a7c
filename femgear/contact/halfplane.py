"""Local line contact on a plane-strain half plane: influence functions and Hertz's closed forms.

Flamant's solution (K. L. Johnson, Contact Mechanics, 1985, section 2.2): a line load ``P`` [N/m] at the
origin of the surface moves a point at distance ``x`` along the surface and depth ``z`` into the body by

    w(x, z) = P / (4 pi mu) [-4 (1 - nu) ln r + 2 z^2 / r^2],    r^2 = x^2 + z^2

up to a rigid motion; here the constant is the one of this formula with ``r`` in metres. Only differences
of two displacements mean anything, and in these the constant drops out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.errors import ContactError


def surface_displacement(x, half_width, shear_modulus, poisson_ratio):
    """Displacement of the surface into the body under a cell of uniform pressure.

    Mean of Flamant's ``w(x - s, 0)`` over ``|s| <= half_width`` (Johnson, section 2.5, uniform pressure).

    Parameters
    ----------
    x : array of any shape
        Distance from the middle of the cell [m].
    half_width : float
        Half width of the cell [m].
    shear_modulus : float
        [Pa].
    poisson_ratio : float

    Returns
    -------
    array, shape of `x`
        Displacement [m] per unit line load [N/m] on the cell, with the datum of this module.

    Raises
    ------
    ContactError
        For a half width or shear modulus that is not positive, or Poisson's ratio outside (-1, 1/2).
    """
    x = np.asarray(x, float)
    _check(half_width, None, shear_modulus, poisson_ratio)
    ends = (x + half_width, x - half_width)
    mean_log = (_x_log(ends[0]) - _x_log(ends[1])) / (2 * half_width) - 1.0
    return -(1 - poisson_ratio) / (np.pi * shear_modulus) * mean_log


def depth_displacement(x, depth, shear_modulus, poisson_ratio):
    """Displacement, in the direction of the load, of a point at `depth` under the surface.

    Flamant's ``w(x, depth)`` for a line load on the surface, with the datum of `surface_displacement`.

    Parameters
    ----------
    x : array of any shape
        Distance along the surface between the load and the foot of the point [m].
    depth : float
        [m].
    shear_modulus : float
        [Pa].
    poisson_ratio : float

    Returns
    -------
    array, shape of `x`
        Displacement [m] per unit line load [N/m].

    Raises
    ------
    ContactError
        As `surface_displacement`, and for a depth that is not positive.
    """
    _check(None, depth, shear_modulus, poisson_ratio)
    r2 = np.square(np.asarray(x, float)) + depth**2
    return (-2 * (1 - poisson_ratio) * np.log(r2) + 2 * depth**2 / r2) / (4 * np.pi * shear_modulus)


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

    Raises
    ------
    ContactError
        As `depth_displacement`.
    """
    _check(None, depth, shear_modulus, poisson_ratio)
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

    Raises
    ------
    ContactError
        For a half width, depth or shear modulus that is not positive, or Poisson's ratio outside (-1, 1/2).
    """
    x = np.asarray(x, float)
    _check(half_width, depth, shear_modulus, poisson_ratio)
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

    Raises
    ------
    ContactError
        When an argument is not positive.
    """
    _positive(half_width, "half width")
    _positive(datum, "datum")
    _positive(contact_modulus, "contact modulus")
    x = np.asarray(x, float) / datum
    h = half_width / datum
    mean_log = (_x_log(x + h) - _x_log(x - h)) / (2 * h) - 1.0
    return -2.0 / (np.pi * contact_modulus) * mean_log


def contact_modulus(youngs_modulus_1, poisson_ratio_1, youngs_modulus_2, poisson_ratio_2):
    """``E*`` of two bodies in plane strain, ``1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2`` [Pa].

    Johnson, Contact Mechanics, eq. 4.1 and appendix 3.

    Raises
    ------
    ContactError
        For a modulus that is not positive or Poisson's ratio outside (-1, 1/2).
    """
    for modulus, ratio in ((youngs_modulus_1, poisson_ratio_1), (youngs_modulus_2, poisson_ratio_2)):
        _check(None, None, modulus, ratio)
    return 1.0 / ((1 - poisson_ratio_1**2) / youngs_modulus_1 + (1 - poisson_ratio_2**2) / youngs_modulus_2)


def relative_radius(radius_1, radius_2):
    """Relative radius of curvature [m], ``1/R = 1/R_1 + 1/R_2``; a hollow surface has a negative radius.

    Raises
    ------
    ContactError
        When the surfaces are conformal or the hollow one is the more curved: no line contact.
    """
    for radius in (radius_1, radius_2):
        _positive(abs(radius), "magnitude of a radius")
    curvature = 1.0 / radius_1 + 1.0 / radius_2
    if curvature <= 0:
        raise ContactError(
            f"surfaces of radii {radius_1} and {radius_2} m do not make a line contact",
            code="E-HALFPLANE",
            value=curvature,
            limit="1/R1 + 1/R2 > 0; a hollow surface has a negative radius",
        )
    return 1.0 / curvature


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

    Raises
    ------
    ContactError
        For a negative load, or a radius or modulus that is not positive.
    """
    _positive(radius, "relative radius")
    _positive(modulus, "contact modulus")
    if not 0 <= line_load < np.inf:
        _refuse("the line load [N/m]", line_load, "zero or above, finite")
    half_width = float(np.sqrt(4 * line_load * radius / (np.pi * modulus)))
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

    Raises
    ------
    ContactError
        For a half width, depth or modulus that is not positive, or Poisson's ratio outside (-1, 1/2).
    """
    _check(half_width, depth, youngs_modulus, poisson_ratio)
    factor = 2 * line_load * (1 - poisson_ratio**2) / (np.pi * youngs_modulus)
    return float(factor * (np.log(2 * depth / half_width) - poisson_ratio / (2 * (1 - poisson_ratio))))


def _x_log(t):
    """``t ln|t|``, continued by zero."""
    return t * np.log(np.where(t == 0, 1.0, np.abs(t)))


def _t_log1p(t, depth):
    """``t ln(1 + depth^2 / t^2)``, continued by zero."""
    safe = np.where(t == 0, 1.0, t)
    return np.where(t == 0, 0.0, t * np.log1p((depth / safe) ** 2))


def _check(half_width, depth, modulus, poisson_ratio):
    for value, name in ((half_width, "half width"), (depth, "depth"), (modulus, "elastic modulus")):
        if value is not None:
            _positive(value, name)
    if not -1 < poisson_ratio < 0.5:
        _refuse("Poisson's ratio", poisson_ratio, "-1 < nu < 0.5")


def _positive(value, name):
    if not np.all((np.asarray(value) > 0) & np.isfinite(value)):
        _refuse(f"the {name}", value, "positive and finite")


def _refuse(what, value, limit):
    raise ContactError(f"{what} is {value}", code="E-HALFPLANE", value=value, limit=limit)
