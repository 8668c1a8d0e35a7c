"""Lubrication and temperatures of a REXS unit: viscosity ratio and cleanliness of bearings, rises of shafts.

The viscosity ratio kappa of a case is one number of a bearing: that of the load case in which it is least, from the oil
of the unit at its temperature, and the speed of the rings.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from femgear.case.quantities import VISCOSITY
from femgear.errors import CaseError
from femgear.exchange.gear_unit import unit_flow, with_load_case
from femgear.exchange.rexs import Component, Model
from femgear.system.bearing_life import VISCOSITY_RATIOS, oil_viscosity, reference_viscosity

_CONTAMINATION = ("contamination_factor_according_to_iso_281_2007", "contamination_factor_according_to_din_26281")
_OIL_TEMPERATURE, _MEAN, _REFERENCE = "temperature_lubricant", "mean_operating_temperature", "reference_temperature"
_THINNEST, _THICKEST = 0.5e-6, 0.1  # kinematic viscosities of oils [m^2/s]
# The same in degrees of either scale.
_PER_KELVIN = {"1e-6 / C": 1e-6, "1e-6 / K": 1e-6, "1 / K": 1.0, "1 / C": 1.0}


@dataclass(frozen=True)
class Lubrication:
    """Oil of a unit in its load cases.

    Parameters
    ----------
    model : Model
        What the file holds.
    viscosities : tuple of float
        Viscosities of the oil at 40 and 100 degrees Celsius [m^2/s]; empty where the file has them not.
    temperatures : tuple of float or None
        Of the oil in every load case [degrees Celsius].
    speeds : tuple of mapping
        Speeds of shafts [rad/s] by their ids in every load case.
    """

    model: Model
    viscosities: tuple[float, ...]
    temperatures: tuple[float | None, ...]
    speeds: tuple[Mapping[str, float], ...]

    def entries(
        self, part: Component, table: Mapping[str, object], pitch: float, shafts: Sequence[str]
    ) -> dict[str, Any]:
        """Entries of a rolling bearing: viscosity ratio and contamination, where the file has what they need.

        ``pitch`` is its pitch diameter [m], ``shafts`` are the ids of the shafts of its rings, one of the casing.
        """
        entries_: dict[str, Any] = {}
        if "kind" not in table:
            return entries_
        values = (self.model.number(part, name) for name in _CONTAMINATION)
        if (clean := next((value for value in values if value is not None), None)) is not None:
            entries_["contamination"] = clean
        if (ratio := self.least_ratio(pitch, shafts)) is not None:
            entries_["viscosity_ratio"] = float(f"{ratio:.4g}")
            if ratio < VISCOSITY_RATIOS[0]:
                text = f"{part}: a viscosity ratio of {ratio:.2g} is below what ISO 281 has: it is left out"
                self.model.remark("bearing", text, remedy="a thicker or a colder oil")
                del entries_["viscosity_ratio"]
        return entries_

    def table(self) -> dict[str, Any]:
        """Make the section ``lubricant`` of a gearbox: viscosities, and the highest temperature of all load cases.

        Empty where the file has them not, or other ones than an oil can have.
        """
        if not self.viscosities or not _THICKEST > self.viscosities[0] > self.viscosities[1] > _THINNEST:
            return {}
        entries = {
            f"viscosity_{at}": f"{value / VISCOSITY.scale:.6g} {VISCOSITY.shown}"
            for at, value in zip((40, 100), self.viscosities, strict=True)
        }
        temperatures = [value for value in self.temperatures if value is not None and -50.0 <= value <= 250.0]
        return entries | ({"temperature": f"{max(temperatures):.6g} degC"} if temperatures else {})

    def least_ratio(self, pitch: float, shafts: Sequence[str]) -> float | None:
        """Least viscosity ratio kappa over the load cases in which rings turn; None where the file has no oil."""
        if not self.viscosities:
            return None
        cool, warm = self.viscosities
        ratios = []
        for temperature, speed in zip(self.temperatures, self.speeds, strict=True):
            first, second = (*(speed.get(id, 0.0) for id in shafts), 0.0)[:2]
            if temperature is not None and first != second:
                needed = reference_viscosity(pitch, abs(first - second))
                ratios.append(oil_viscosity(cool, warm, temperature) / needed)
        return min(ratios, default=None)


def unit_lubrication(model: Model) -> Lubrication:
    """Read the oil of a unit, and its temperatures and the speeds of shafts in all load cases."""
    cases = model.load_cases or ({},)
    oils = [part for part in model.components.values() if part.type == "lubricant"]
    viscosity = [
        model.number(oil, f"viscosity_at_{at}_degree_celsius", VISCOSITY) for oil in oils[:1] for at in (40, 100)
    ]
    casings = [part for part in model.components.values() if part.type == "gear_casing"]
    temperatures = [
        next(
            (
                value
                for casing in casings
                if (value := _celsius(model, with_load_case(casing, given), _OIL_TEMPERATURE))
            ),
            None,
        )
        for given in cases
    ]
    viscosities = tuple(value for value in viscosity if value is not None)
    speeds = tuple(unit_flow(model, given).speed for given in cases)
    return Lubrication(model, viscosities if len(viscosities) == 2 else (), tuple(temperatures), speeds)


def temperature_rise(model: Model, part: Component) -> float | None:
    """Temperature of a shaft or the casing over the one of reference of the unit [K]; None where either is missing."""
    units = [component for component in model.components.values() if component.type == "gear_unit"]
    reference = next((value for unit in units if (value := _celsius(model, unit, _REFERENCE)) is not None), None)
    mean = _celsius(model, part, _MEAN)
    return None if mean is None or reference is None else mean - reference


def thermal_expansion(model: Model, shaft: Component) -> float | None:
    """Coefficient of expansion on heating of the material that a shaft refers to [1/K]."""
    name = "thermal_expansion_coefficient_plus"
    for made in model.related(("reference", "ordered_reference"), "referenced", origin=shaft.id):
        if made.type == "material" and (text := model.text(made, name)) is not None:
            scale = _PER_KELVIN.get(made.attributes[name][1] or "")
            return None if scale is None else scale * float(text)
    return None


def _celsius(model: Model, part: Component, name: str) -> float | None:
    """Temperature of a part [degrees Celsius]; CaseError: no number (E-UNIT)."""
    if (text := model.text(part, name)) is None:
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise CaseError("a temperature is needed", code="E-UNIT", key=f"{part}, {name}", value=text, file=model.name)
    return value - 273.15 if part.attributes[name][1] == "K" else value
