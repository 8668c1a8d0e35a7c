"""Film of the oil between teeth over their roughness: the risk of micropitting (ISO/TS 6336-22:2018).

``lambda_GF,Y = h_Y / R_a`` at every point of contact: with pressures of a contact analysis that is method A. The film
is that of D. Dowson and G. R. Higginson with the sliding parameter S_GF, which lowers it where the contact is hotter
than the teeth. SI units, temperatures in kelvins.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

PRESSURE_VISCOSITY = {
    "mineral": (2.657e-8, 0.1348),
    "PAO": (1.466e-8, 0.0507),
    "polyglycol": (1.392e-8, 0.1572),
    "water-soluble polyglycol": (1.392e-8, 0.1572),
}
"""Factor [m^2/N] and power of the dynamic viscosity at 38 degrees Celsius [Pa s] in the pressure-viscosity coefficient
there."""
AT_38 = 311.15
"""38 degrees Celsius [K]."""


@dataclass(frozen=True)
class OilState:
    """An oil at a temperature.

    Parameters
    ----------
    viscosity : float or array
        Dynamic [Pa s].
    pressure_coefficient : float or array
        alpha, of the growth of the viscosity with pressure [m^2/N].
    """

    viscosity: Any
    pressure_coefficient: Any


def kinematic_viscosity(at_40: float, at_100: float, temperature: Any) -> np.ndarray:
    """Compute kinematic viscosities (...) [m^2/s] at temperatures (...) [K] from those at 40 and 100 degrees Celsius.

    ``lg lg (nu + 0.7) = A - B lg T`` [mm^2/s, K] (ASTM D341).
    """
    kelvin = np.asarray(temperature, float)
    low, high = (math.log10(math.log10(1e6 * value + 0.7)) for value in (at_40, at_100))
    slope = (high - low) / (math.log10(373.15) - math.log10(313.15))
    return 1e-6 * (10.0 ** (10.0 ** (low + slope * (np.log10(kelvin) - math.log10(313.15)))) - 0.7)


def oil_density(at_15: float, temperature: Any) -> Any:
    """Compute the density [kg/m^3] at a temperature [K]: ``rho_15 (1 - 0.7 (T - 289) / rho_15)``."""
    return at_15 - 0.7 * (np.asarray(temperature, float) - 289.0)


def oil_state(at_40: float, at_100: float, density_15: float, kind: str, temperature: Any) -> OilState:
    """Compute viscosity and pressure-viscosity coefficient of an oil at temperatures [K].

    ``alpha = alpha_38 (1 + 516 (1/T - 1/311))``; parameters as of `kinematic_viscosity` and `oil_density`, with a kind
    of `PRESSURE_VISCOSITY`.
    """
    kelvin = np.asarray(temperature, float)
    scale, power = PRESSURE_VISCOSITY[kind]
    cold = float(kinematic_viscosity(at_40, at_100, AT_38)) * float(oil_density(density_15, AT_38))
    coefficient = scale * cold**power * (1.0 + 516.0 * (1.0 / kelvin - 1.0 / 311.0))
    return OilState(kinematic_viscosity(at_40, at_100, kelvin) * oil_density(density_15, kelvin), coefficient)


def film_thickness(
    radius: Any, modulus: float, sum_speed: Any, pressure: Any, bodies: OilState, contact: OilState
) -> np.ndarray:
    """Compute the film thickness h_Y (...) [m], of the shape that all arrays broadcast to.

    ``h = 1600 rho G_M^0.6 U^0.7 W^-0.13 S_GF^0.22`` in um and mm, with ``G_M = alpha E_r``, ``U = eta v_sum / (2 E_r
    rho)``, ``W = 2 pi p^2 / E_r^2`` and ``S_GF = alpha_B eta_B / (alpha_M eta_M)``.

    Parameters
    ----------
    radius : float or (...) array
        Radius of relative curvature in the normal section [m].
    modulus : float
        E_r [Pa].
    sum_speed : float or (...) array
        Sum of the speeds of both surfaces [m/s].
    pressure : float or (...) array
        Largest pressure of the contact [Pa].
    bodies, contact : OilState
        At the temperature of the teeth, and at that of the contact.
    """
    radius, pressure = np.asarray(radius, float), np.asarray(pressure, float)
    material = bodies.pressure_coefficient * modulus
    speed = bodies.viscosity * np.asarray(sum_speed, float) / (2.0 * modulus * radius)
    load = 2.0 * math.pi * (pressure / modulus) ** 2
    hotter = (contact.pressure_coefficient * contact.viscosity) / (bodies.pressure_coefficient * bodies.viscosity)
    with np.errstate(divide="ignore"):
        return 1e-6 * 1600.0 * (1e3 * radius) * material**0.6 * speed**0.7 * load**-0.13 * hotter**0.22
