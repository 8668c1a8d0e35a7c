"""Sections ``lubricant`` and ``losses`` of a case file: the oil, and how its friction is found.

They are the same for pairs, planetary sets and gearboxes. What they lack for the friction that is asked for is refused,
with the entry that would give it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, StrictBool, model_validator

from femgear.case.quantities import (
    CELSIUS,
    DENSITY,
    LENGTH,
    LINE_LOAD,
    VELOCITY,
    VISCOSITY,
    Count,
    Number,
    Quantity,
    Section,
    Temperature,
    Values,
    printable_line,
)
from femgear.errors import CaseError
from femgear.findings import Finding
from femgear.gears.friction import LUBRICANT_FACTORS
from femgear.system.bearing_life import oil_viscosity

Viscosity = Annotated[float, Quantity(VISCOSITY, 0.5e-6, 0.1)]
OilTemperature = Annotated[float, Temperature(-50.0, 250.0)]
_Share = Annotated[float, Number(0.0, 10.0, open_low=True)]
_Coefficient = Annotated[float, Number(0.0, 0.5, open_low=True)]
_Load = Annotated[float, Quantity(LINE_LOAD, 0.0, 1e8)]
_Velocity = Annotated[float, Quantity(VELOCITY, 0.0, 1e3)]
OIL_RANGE = {"mineral": (-10.0, 150.0)}
"""Temperatures [degC] between which the viscosity of an oil is taken from those at 40 and 100 by kind.

ASTM D341 holds while the oil is one liquid, above its cloud point: ISO 12925-1 lets mineral gear oils of VG 220 to 460
pour from -9 degC on, synthetic ones (CKE, CKS, CKT) from below -30. 150 degC is the highest temperature at which
SAE J300 has viscosities measured.
"""
_SYNTHETIC = (-40.0, 150.0)
LEAST_VISCOSITY = 2e-6
"""Down to which ``lg lg (nu + 0.7)`` is straight [m^2/s]; ASTM D341 corrects it below."""
_COOL = 289.0  # K, of the density that ISO/TS 6336-22 begins with
_Grid = Values(min_length=1, max_length=100)


class LubricantSection(Section):
    """The oil: its viscosity at 40 and 100 degrees Celsius, or at the temperature that it has in operation.

    ``temperature`` is that of the oil in operation, ``density`` the one it has there. ``friction_factor`` is X_L, by
    default that of the ``kind``. ``supply`` is how the oil comes to the teeth, ``fzg_stage`` the load stage of the FZG
    test A/8.3/90 at which it fails, ``permissible_film`` the least film over roughness, lambda_GFP.
    """

    kind: Literal["mineral", "PAO", "polyglycol", "water-soluble polyglycol"] = "mineral"
    viscosity_40: Viscosity | None = None
    viscosity_100: Viscosity | None = None
    viscosity: Viscosity | None = None
    temperature: OilTemperature | None = None
    density: Annotated[float, Quantity(DENSITY, 500.0, 2000.0)] = 870.0
    friction_factor: Annotated[float, Number(0.1, 3.0)] | None = None
    supply: Literal["splash", "spray", "submerged"] = "splash"
    fzg_stage: Annotated[int, Count(1, 14)] | None = None
    permissible_film: Annotated[float, Number(0.0, 10.0, open_low=True)] | None = None

    @model_validator(mode="after")
    def _one_viscosity(self):
        cold, hot = self.viscosity_40, self.viscosity_100
        if self.viscosity is not None and (others := self.given("viscosity_40", "viscosity_100")):
            raise CaseError(
                f"viscosity beside {', '.join(others)}: two viscosities in operation",
                code="E-DUPLICATE",
                value=f"{1e6 * self.viscosity:g} mm^2/s",
                remedy="keep viscosity_40 and viscosity_100, or the viscosity in operation alone",
            )
        if cold is not None and hot is not None and not cold > hot:
            raise CaseError(
                "the oil is not thinner at 100 degC than at 40 degC",
                code="E-RANGE",
                key="lubricant.viscosity_100",
                value=f"{1e6 * hot:g} mm^2/s",
                limit=f"below {1e6 * cold:g} mm^2/s",
                remedy="check which of both is at 40 degC",
            )
        return self

    @property
    def factor(self) -> float:
        """X_L: as given, or that of the kind."""
        return LUBRICANT_FACTORS[self.kind] if self.friction_factor is None else self.friction_factor

    @property
    def density_at_15(self) -> float:
        """Density at 15 degrees Celsius [kg/m^3], 0.7 kg/m^3 more for every kelvin that the oil is hotter."""
        return self.density + 0.7 * ((self.temperature or _COOL) - _COOL)


class FrictionTableSection(Section):
    """Coefficients of friction over line load (rows) and pitch line speed (columns), linear between them."""

    line_loads: Annotated[tuple[_Load, ...], _Grid]
    speeds: Annotated[tuple[_Velocity, ...], _Grid]
    coefficients: Annotated[tuple[Annotated[tuple[_Coefficient, ...], _Grid], ...], _Grid]

    @model_validator(mode="after")
    def _is_a_table(self):
        rows, columns = len(self.line_loads), len(self.speeds)
        if len(self.coefficients) != rows or any(len(row) != columns for row in self.coefficients):
            message = "the coefficients of friction do not fit their loads and speeds"
            raise CaseError(message, code="E-COUNT", limit=f"{rows} rows of {columns} numbers")
        for name, grid, dimension in (("line_loads", self.line_loads, LINE_LOAD), ("speeds", self.speeds, VELOCITY)):
            if list(grid) != sorted({*grid}):
                raise CaseError(
                    f"{name} of a table of friction ascend",
                    code="E-RANGE",
                    value=", ".join(map(dimension.show, grid)),
                    limit="each larger than the one before",
                    remedy="sort rows and columns, and keep one of each",
                )
        return self


class SealSection(Section):
    """A radial shaft seal between a shaft and the casing: where its lip runs."""

    shaft: Annotated[str, BeforeValidator(partial(printable_line, name="name", least=1, most=60))]
    diameter: Annotated[float, Quantity(LENGTH, 1e-3, 5.0)]


class LossesSection(Section):
    """How losses are found: the coefficient of friction of the teeth, bearings, and a map over torque and speed.

    ``friction`` names the formula, or says that it is the ``coefficient`` or the ``table``. ``roughness`` is the mean
    R_a of both flanks. A ``seal`` and ``bearings`` lose beside teeth. The map has the ``torque_shares`` and
    ``speed_shares`` of the torque and the speed of operation.
    With ``excites`` the friction of the teeth acts on the gears, at rest and in motion.
    """

    friction: Literal["constant", "schlenk", "niemann", "iso", "table"] = "schlenk"
    coefficient: _Coefficient | None = None
    table: FrictionTableSection | None = None
    roughness: Annotated[float, Quantity(LENGTH, 1e-9, 2e-5)] | None = None
    bearings: StrictBool = True
    excites: StrictBool = False
    seal: Annotated[tuple[SealSection, ...], Field(max_length=100)] = ()
    torque_shares: Annotated[tuple[_Share, ...], Values(max_length=50)] = ()
    speed_shares: Annotated[tuple[_Share, ...], Values(max_length=200)] = ()


def losses_wanted(case: Any) -> bool:
    """Tell whether a case asks for losses: it has a section ``losses``."""
    return case.losses is not None


def oil_at(case: Any, temperature: float | None = None) -> float:
    """Compute the dynamic viscosity of the oil of a case [Pa s] at a temperature [K], by default that of operation.

    CaseError: the viscosity, or the temperature at which it is wanted, is missing (E-KEY-MISSING).
    """
    oil: LubricantSection = case.lubricant or LubricantSection()
    if temperature is None and oil.viscosity is not None:
        return oil.viscosity * oil.density
    if oil.viscosity_40 is None or oil.viscosity_100 is None:
        key = "lubricant.viscosity_100" if oil.viscosity_40 is not None else "lubricant.viscosity_40"
        raise _missing(
            case,
            "the viscosity of the oil is missing",
            key,
            'give lubricant.viscosity_40 = "100 mm^2/s", viscosity_100 and temperature'
            + ("" if temperature is not None else ", or the viscosity in operation alone"),
        )
    hot = oil.temperature if temperature is None else temperature
    if hot is None:
        remedy = 'give lubricant.temperature = "70 degC", that of the oil in operation'
        raise _missing(case, "the temperature of the oil is missing", "lubricant.temperature", remedy)
    return oil_viscosity(oil.viscosity_40, oil.viscosity_100, hot - CELSIUS) * oil.density


def operating_viscosity(case: Any) -> float | None:
    """Find the kinematic viscosity of the oil in operation [m^2/s]; None of a case that does not tell it."""
    oil: LubricantSection | None = case.lubricant
    if oil is None or (oil.viscosity is None and None in (oil.viscosity_40, oil.viscosity_100, oil.temperature)):
        return None
    return oil_at(case) / oil.density


def check_seals(losses: LossesSection, shafts: Sequence[str]) -> Iterator[CaseError]:
    """Refuse seals on shafts that there are not."""
    for number, seal in enumerate(losses.seal):
        if seal.shaft not in shafts:
            yield CaseError(
                "there is no such shaft",
                code="E-CHOICE",
                key=f"losses.seal[{number}].shaft",
                value=seal.shaft,
                limit=", ".join(shafts),
            )


def check_losses(case: Any) -> None:
    """Refuse a section ``losses`` that lacks what its friction needs (CaseError, E-KEY-MISSING)."""
    losses: LossesSection | None = case.losses
    if losses is None:
        return
    needs: dict[str, tuple[str, str]] = {
        "constant": ("coefficient", "give losses.coefficient = 0.05"),
        "table": ("table", "give losses.table with line_loads, speeds and coefficients"),
    }
    name, remedy = needs.get(losses.friction, ("roughness", 'give losses.roughness = "0.4 um", the mean R_a of flanks'))
    if getattr(losses, name) is None:
        raise _missing(case, f'friction = "{losses.friction}" needs its {name}', f"losses.{name}", remedy)
    if losses.friction not in needs:
        oil_at(case)


def heat_missing(case: Any) -> str:
    """Tell what a case with losses lacks for temperatures and oil film of its teeth; empty where it has all."""
    lacks = _heat_lacks(case)
    return "" if lacks is None else f"{lacks[0]} is missing: {lacks[1]}"


def _heat_lacks(case: Any) -> tuple[str, str] | None:
    """Key that temperatures lack, and what would give it."""
    if case.losses is None:
        return "losses", "no section [losses] asks for them"
    oil: LubricantSection = case.lubricant or LubricantSection()
    if oil.temperature is None:
        return "lubricant.temperature", 'give lubricant.temperature = "70 degC"'
    if case.losses.roughness is None:
        return "losses.roughness", 'give losses.roughness = "0.4 um", the mean R_a of flanks'
    if oil.viscosity is None and (oil.viscosity_40 is None or oil.viscosity_100 is None):
        return "lubricant.viscosity_40", 'give lubricant.viscosity_40 = "100 mm^2/s" and viscosity_100'
    return None


def oil_doubts(case: Any) -> Iterator[Finding]:
    """List an oil whose viscosity is extrapolated too far from those at 40 and 100 degrees (W-OIL)."""
    oil: LubricantSection | None = case.lubricant
    if oil is None or oil.temperature is None or oil.viscosity_40 is None or oil.viscosity_100 is None:
        return
    celsius, (low, high) = oil.temperature - CELSIUS, OIL_RANGE.get(oil.kind, _SYNTHETIC)
    viscosity = oil_viscosity(oil.viscosity_40, oil.viscosity_100, celsius)
    if low <= celsius <= high and viscosity >= LEAST_VISCOSITY:
        return
    remedy = "give lubricant.viscosity, that at the temperature of operation, in place of both"
    if oil.permissible_film is not None:
        remedy = "the film needs viscosities at the temperatures of the contact: give another oil or temperature"
    yield Finding(
        "W-OIL",
        "lubricant.temperature",
        f"{1e6 * viscosity:.3g} mm^2/s at {celsius:g} degC is extrapolated from 40 and 100 degC beyond where ASTM D341 "
        "holds",
        remedy=remedy,
        limit=f"{low:g} to {high:g} degC of {oil.kind} oil, and {1e6 * LEAST_VISCOSITY:g} mm^2/s or more",
    )


def check_film(case: Any) -> None:
    """Refuse limits of scuffing or film thickness without what they are compared with (CaseError, E-KEY-MISSING)."""
    oil: LubricantSection | None = case.lubricant
    if oil is None or not oil.given("fzg_stage", "permissible_film"):
        return
    if (lacks := _heat_lacks(case)) is not None:
        limit = oil.given("fzg_stage", "permissible_film")[0]
        raise _missing(case, f"lubricant.{limit} gives no safety without {lacks[0]}", *lacks)
    if oil.permissible_film is not None and (oil.viscosity_40 is None or oil.viscosity_100 is None):
        key = "lubricant.viscosity_40"
        message = "the film goes by the viscosity at the temperature of the contact, which is missing"
        remedy = 'give lubricant.viscosity_40 = "100 mm^2/s" and viscosity_100'
        if oil.viscosity is not None:
            remedy = "give viscosity_40 and viscosity_100 in place of viscosity, or leave permissible_film out"
        raise _missing(case, message, key, remedy)


def _missing(case: Any, message: str, key: str, remedy: str) -> CaseError:
    return CaseError(message, code="E-KEY-MISSING", key=key, file=case.location(key), remedy=remedy)
