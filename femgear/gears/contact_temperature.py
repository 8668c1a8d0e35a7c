"""Contact temperatures of teeth: flash temperature, bulk temperature, scuffing (ISO/TS 6336-20:2017).

The contact temperature is that of the bodies of the teeth plus the flash temperature, the rise of the surface while it
passes the contact. Scuffing begins where it reaches the scuffing temperature, which the FZG test of the oil gives.
Everything is in SI units, temperatures in kelvins unless degrees Celsius are named.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from femgear.gears.pair import GearPair

STEEL_CONTACT = 13.8e3
"""Thermal contact coefficient B_M of martensitic steel, ``sqrt(lambda rho c)`` [W s^0.5/(m^2 K)]."""
BLOK = 1.11
"""Factor of H. Blok's flash temperature of a band with Hertzian pressure, see `flash_temperature`."""
SUPPLY = {"splash": 1.2, "spray": 1.0, "submerged": 0.2}
"""X_S by how the oil comes to the teeth."""


def reduced_modulus(first: tuple[float, float], second: tuple[float, float]) -> float:
    """Compute ``E_r = 2 / ((1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2)`` [Pa] from Young's moduli and Poisson's ratios."""
    return 2.0 / sum((1.0 - ratio**2) / modulus for modulus, ratio in (first, second))


def hertz_pressure(line_load: Any, radius: Any, modulus: float) -> Any:
    """Compute the largest pressure of a line contact [Pa] (Hertz, 1882): ``sqrt(w E_r / (2 pi rho))``.

    Parameters
    ----------
    line_load, radius : float or (...) array
        Normal load over the length of the line [N/m], and radius of relative curvature [m].
    modulus : float
        E_r of `reduced_modulus` [Pa].
    """
    return np.sqrt(np.asarray(line_load, float) * modulus / (2.0 * math.pi * np.asarray(radius, float)))


def contact_half_width(line_load: Any, radius: Any, modulus: float) -> Any:
    """Compute the half width of a line contact [m] (Hertz): ``sqrt(8 w rho / (pi E_r))``; parameters as above."""
    return np.sqrt(8.0 * np.asarray(line_load, float) * np.asarray(radius, float) / (math.pi * modulus))


def flash_temperature(
    friction: Any,
    line_load: Any,
    half_width: Any,
    rolling_1: Any,
    rolling_2: Any,
    coefficients: tuple[float, float] = (STEEL_CONTACT, STEEL_CONTACT),
) -> Any:
    """Compute the flash temperature [K] (H. Blok, 1937; ISO/TS 6336-20:2017, eq. 1).

    ``1.11 mu w |v_1 - v_2| / (sqrt(2 b_H) (B_1 sqrt(v_1) + B_2 sqrt(v_2)))``: the largest rise of the surface in a band
    2 b_H wide with the frictional heat of a Hertzian pressure, which both surfaces pass fast. The heat is shared so
    that both have one temperature. Zero without load.

    Parameters
    ----------
    friction : float or (...) array
        Coefficient of friction; the arrays broadcast.
    line_load, half_width : float or (...) array
        [N/m], [m]
    rolling_1, rolling_2 : float or (...) array
        Speeds of both surfaces [m/s].
    coefficients : tuple of float
        Thermal contact coefficients of gear 1 and gear 2 [W s^0.5/(m^2 K)].
    """
    v_1, v_2 = np.abs(np.asarray(rolling_1, float)), np.abs(np.asarray(rolling_2, float))
    width = np.sqrt(2.0 * np.asarray(half_width, float))
    carried = coefficients[0] * np.sqrt(v_1) + coefficients[1] * np.sqrt(v_2)
    heat = BLOK * np.asarray(friction) * np.asarray(line_load, float) * np.abs(v_1 - v_2)
    shape = np.broadcast_shapes(np.shape(heat), np.shape(width), np.shape(carried))
    bottom = np.broadcast_to(width * carried, shape)
    return np.divide(np.broadcast_to(heat, shape), bottom, out=np.zeros(shape), where=bottom > 0.0)


def path_load_sharing(pair: GearPair, path: Any, overlap: float = 0.0, base_helix: float = 0.0) -> np.ndarray:
    """Compute the load sharing factor X_Gamma over the path [1] (ISO/TS 6336-20, unmodified profiles).

    Spur teeth: from 1/3 at the first contact up to 2/3, 1 in single contact, from 2/3 down to 1/3 at the last one. Wide
    helical teeth, with an overlap ratio of 0.8 and more: 1/eps_alpha with the buttressing factor at both ends. Zero
    beyond the path; with contact ratios outside of 1 to 2 the load goes on all pairs alike. Helical teeth with less
    overlap are taken as spur ones.

    Parameters
    ----------
    path : (...) array
        Places on the line of action from the pitch point [m].
    overlap : float
        Overlap ratio [1].
    base_helix : float
        [rad]
    """
    zeta, (start, end), pitch = np.asarray(path, float), pair.path, pair.base_pitch
    ratio = pair.contact_ratio
    inside = (zeta >= start - 1e-12) & (zeta <= end + 1e-12)
    if overlap >= 0.8:
        length = pair.gear_1.base_radius * math.tan(pair.working_pressure_angle)
        reach = 0.2 * math.sin(base_helix) * length
        most = 1.3 if overlap >= 1.0 else 1.0 + 0.3 * overlap
        edge = np.maximum(1.0 - (zeta - start) / reach, 1.0 - (end - zeta) / reach)
        return np.where(inside, (1.0 + (most - 1.0) * np.clip(edge, 0.0, 1.0)) / ratio, 0.0)
    if not 1.0 <= ratio < 2.0:
        return np.where(inside, 1.0 / ratio, 0.0)
    first, last = end - pitch, start + pitch
    rising = (1.0 + (zeta - start) / (first - start)) / 3.0
    falling = (1.0 + (end - zeta) / (end - last)) / 3.0
    share = np.where(zeta < first, rising, np.where(zeta > last, falling, 1.0))
    return np.where(inside, share, 0.0)


def mean_over_path(path: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Compute the mean (...) of values (..., n) over path coordinates (n,) [m], by trapezoids."""
    return np.trapezoid(values, path, axis=-1) / (path[-1] - path[0])


def bulk_temperature_of_flash(oil: float, mean_flash: Any, *, supply: float, meshes: float = 1.0) -> Any:
    """Compute the bulk temperature from the oil's (ISO/TS 6336-20): ``theta_oil + 0.47 X_S X_mp theta_flm``.

    Parameters
    ----------
    oil : float
        Temperature of the oil [K or degrees Celsius], as the result.
    mean_flash : float or (...) array
        Mean of the flash temperature over the path [K].
    supply : float
        X_S, see `SUPPLY`.
    meshes : float
        Meshes that a gear has; ``X_mp = (1 + n_p) / 2``.
    """
    return oil + 0.47 * supply * 0.5 * (1.0 + meshes) * np.asarray(mean_flash)


def bulk_temperature_of_losses(oil: float, loss: Any, centre_distance: float, width: float, *, supply: float) -> Any:
    """Compute the bulk temperature from the loss of a mesh (ISO/TS 6336-22:2018).

    ``theta_oil + 7400 (P mu H_V / (a b))^0.72 X_S / (1.2 X_Ca)`` in kW and mm, with the tip relief factor X_Ca = 1, on
    the safe side.

    Parameters
    ----------
    loss : float or (...) array
        ``P mu H_V`` of the mesh [W].
    centre_distance, width : float
        [m]
    """
    per_area = 1e-3 * np.asarray(loss, float) / (1e6 * centre_distance * width)
    return oil + 7400.0 * per_area**0.72 * supply / 1.2


def scuffing_temperature(load_stage: float, lubricant: float, structure: float = 1.0) -> float:
    """Compute the scuffing temperature [degrees Celsius] from the FZG test A/8.3/90 (ISO/TS 6336-20).

    ``80 + (0.85 + 1.4 X_W) X_L S_FZG^2``

    Parameters
    ----------
    load_stage : float
        S_FZG: the stage at which the oil fails.
    lubricant : float
        X_L with the power -0.05 of the viscosity at the temperature of the oil [mPa s].
    structure : float
        X_W of the gears: 1 of case-hardened steel.
    """
    return 80.0 + (0.85 + 1.4 * structure) * lubricant * load_stage**2


def scuffing_safety(scuffing: Any, highest: Any, oil: Any) -> Any:
    """Compute ``S_B = (theta_S - theta_oil) / (theta_B,max - theta_oil)``, all temperatures in one unit."""
    return (np.asarray(scuffing) - oil) / (np.asarray(highest) - oil)
