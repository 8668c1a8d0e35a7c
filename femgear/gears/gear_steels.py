"""Strength of gear materials by treatment, quality grade and surface hardness, ISO 6336-5:2016, and their life factors.

The allowable stress numbers sigma_Hlim and sigma_Flim are straight lines over the hardness, ``A x + B`` in N/mm^2,
within the limits that the standard gives; of hardened surfaces they are constant. Hardness is Brinell (HBW) of steels
that are normalised and of irons, Vickers (HV) of all others. The root limit of case hardened steel of grade MQ is that
of the lowest core hardness, 425 N/mm^2; with 25 HRC and a Jominy hardness of 28 HRC at 12 mm it is 461, with 30 HRC
500.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from femgear.errors import GeometryError

Grade = Literal["ML", "MQ", "ME"]
"""Quality grade of ISO 6336-5."""
Treatment = Literal[
    "normalised steel",
    "cast steel",
    "malleable iron",
    "nodular iron",
    "grey iron",
    "through hardened carbon steel",
    "through hardened alloy steel",
    "through hardened cast carbon steel",
    "through hardened cast alloy steel",
    "case hardened steel",
    "flame hardened steel",
    "nitrided steel",
    "nitrided through hardening steel",
    "nitrocarburised steel",
]
"""Material with its treatment, in the order of ISO 6336-5, table 1."""


@dataclass(frozen=True)
class LimitLine:
    """Line of a limit over the hardness.

    Parameters
    ----------
    slope, level : float
        A and B of the limit ``A x + B`` [N/mm^2].
    low, high : float
        Hardness between which it holds.
    """

    slope: float
    level: float
    low: float
    high: float

    def at(self, hardness: float) -> float:
        """Compute the limit [Pa] at a hardness."""
        return 1e6 * (self.slope * hardness + self.level)


@dataclass(frozen=True)
class LifeLine:
    """Life factor over load cycles: constant up to a first number, lines between the others in logarithms.

    Parameters
    ----------
    cycles : tuple of float
        Numbers of load cycles.
    factors : tuple of float
        Z_NT or Y_NT there.
    """

    cycles: tuple[float, ...]
    factors: tuple[float, ...]

    def at(self, cycles: float) -> float:
        """Compute the life factor at a number of load cycles; beyond the last it stays."""
        if cycles <= self.cycles[0]:
            return self.factors[0]
        for (start, from_factor), (end, to_factor) in zip(self._points[:-1], self._points[1:], strict=True):
            if cycles <= end:
                share = math.log(cycles / start) / math.log(end / start)
                return from_factor * (to_factor / from_factor) ** share
        return self.factors[-1]

    def cycles_at(self, ratio: np.ndarray) -> np.ndarray:
        """Compute the load cycles (...) that stresses stand, given as ratios (...) to those of long life.

        None above the first factor, which is the static strength; any number of them, infinite, below the last.
        """
        stress = np.asarray(ratio, float)
        with np.errstate(divide="ignore"):
            logarithm = np.interp(-np.log(stress), -np.log(self.factors), np.log(self.cycles))
        inside = np.where(stress > self.factors[0], 0.0, np.exp(logarithm))
        return np.where(stress < self.factors[-1], np.inf, inside)

    @property
    def slope(self) -> float:
        """Exponent p of the first line, along which ``sigma^p N`` is constant."""
        (start, first), (end, second) = self._points[:2]
        return math.log(end / start) / math.log(first / second)

    @property
    def _points(self) -> tuple[tuple[float, float], ...]:
        return tuple(zip(self.cycles, self.factors, strict=True))


@dataclass(frozen=True)
class GearSteel:
    """Limits and life factors of a treatment.

    Parameters
    ----------
    contact, root : mapping of grade to LimitLine
        sigma_Hlim and sigma_Flim.
    contact_life, root_life : LifeLine
        Z_NT without any pitting, and Y_NT.
    hardness : str
        ``"HBW"`` or ``"HV"``.
    """

    contact: dict[str, LimitLine]
    root: dict[str, LimitLine]
    contact_life: LifeLine
    root_life: LifeLine
    hardness: str


_FLANKS = LifeLine((1e5, 5e7, 1e10), (1.6, 1.0, 0.85))
_SOFT_FLANKS = LifeLine((1e5, 2e6, 1e10), (1.3, 1.0, 0.85))
_CARBURISED_FLANKS = LifeLine((1e5, 2e6, 1e10), (1.1, 1.0, 0.85))
_ROOTS = LifeLine((1e4, 3e6, 1e10), (2.5, 1.0, 0.85))
_HARD_ROOTS = LifeLine((1e3, 3e6, 1e10), (2.5, 1.0, 0.85))
_SOFT_ROOTS = LifeLine((1e3, 3e6, 1e10), (1.6, 1.0, 0.85))
_CARBURISED_ROOTS = LifeLine((1e3, 3e6, 1e10), (1.1, 1.0, 0.85))
LIMITED_PITTING = LifeLine((6e5, 1e7, 1e9, 1e10), (1.6, 1.3, 1.0, 0.85))
"""Z_NT of steels and perlitic irons whose flanks may pit to a limited extent."""


def _grades(low, middle, high=None) -> dict[str, LimitLine]:
    """Lines of ML, MQ and ME; of two the first is that of ML and MQ."""
    lines = (low, low, middle) if high is None else (low, middle, high)
    return {grade: LimitLine(*line) for grade, line in zip(("ML", "MQ", "ME"), lines, strict=True)}


GEAR_STEELS: dict[str, GearSteel] = {
    "normalised steel": GearSteel(
        _grades((1.000, 190, 110, 210), (1.520, 250, 110, 210)),
        _grades((0.455, 69, 110, 210), (0.386, 147, 110, 210)),
        _FLANKS,
        _ROOTS,
        "HBW",
    ),
    "cast steel": GearSteel(
        _grades((0.986, 131, 140, 210), (1.143, 237, 140, 210)),
        _grades((0.313, 62, 140, 210), (0.254, 137, 140, 210)),
        _FLANKS,
        _ROOTS,
        "HBW",
    ),
    "malleable iron": GearSteel(
        _grades((1.371, 143, 135, 250), (1.333, 267, 175, 250)),
        _grades((0.345, 77, 135, 250), (0.403, 128, 175, 250)),
        _FLANKS,
        _ROOTS,
        "HBW",
    ),
    "nodular iron": GearSteel(
        _grades((1.434, 211, 175, 300), (1.500, 250, 200, 300)),
        _grades((0.350, 119, 175, 300), (0.380, 134, 200, 300)),
        _FLANKS,
        _ROOTS,
        "HBW",
    ),
    "grey iron": GearSteel(
        _grades((1.033, 132, 150, 240), (1.465, 122, 175, 275)),
        _grades((0.256, 8, 150, 240), (0.200, 53, 175, 275)),
        _SOFT_FLANKS,
        _SOFT_ROOTS,
        "HBW",
    ),
    "through hardened carbon steel": GearSteel(
        _grades((0.963, 283, 135, 210), (0.925, 360, 135, 210), (0.838, 432, 135, 210)),
        _grades((0.250, 108, 115, 215), (0.240, 163, 115, 215), (0.283, 202, 115, 215)),
        _FLANKS,
        _ROOTS,
        "HV",
    ),
    "through hardened alloy steel": GearSteel(
        _grades((1.313, 188, 200, 360), (1.313, 373, 200, 360), (2.213, 260, 200, 390)),
        _grades((0.423, 104, 200, 360), (0.425, 187, 200, 360), (0.358, 231, 200, 390)),
        _FLANKS,
        _ROOTS,
        "HV",
    ),
    "through hardened cast carbon steel": GearSteel(
        _grades((0.831, 300, 130, 215), (0.951, 345, 130, 215)),
        _grades((0.224, 117, 130, 215), (0.286, 167, 130, 215)),
        _FLANKS,
        _ROOTS,
        "HV",
    ),
    "through hardened cast alloy steel": GearSteel(
        _grades((1.276, 298, 200, 360), (1.350, 356, 200, 360)),
        _grades((0.364, 161, 200, 360), (0.356, 186, 200, 360)),
        _FLANKS,
        _ROOTS,
        "HV",
    ),
    "case hardened steel": GearSteel(
        _grades((0.0, 1300, 600, 800), (0.0, 1500, 660, 800), (0.0, 1650, 660, 800)),
        _grades((0.0, 312, 600, 800), (0.0, 425, 660, 800), (0.0, 525, 660, 800)),
        _FLANKS,
        _HARD_ROOTS,
        "HV",
    ),
    "flame hardened steel": GearSteel(
        _grades((0.740, 602, 485, 615), (0.541, 882, 500, 615), (0.505, 1013, 500, 615)),
        _grades((0.305, 76, 485, 615), (0.138, 290, 500, 570), (0.271, 237, 500, 615)),
        _FLANKS,
        _HARD_ROOTS,
        "HV",
    ),
    "nitrided steel": GearSteel(
        _grades((0.0, 1125, 650, 900), (0.0, 1250, 650, 900), (0.0, 1450, 650, 900)),
        _grades((0.0, 270, 650, 900), (0.0, 420, 650, 900), (0.0, 468, 650, 900)),
        _SOFT_FLANKS,
        _SOFT_ROOTS,
        "HV",
    ),
    "nitrided through hardening steel": GearSteel(
        _grades((0.0, 788, 450, 650), (0.0, 998, 450, 650), (0.0, 1217, 450, 650)),
        _grades((0.0, 258, 450, 650), (0.0, 363, 450, 650), (0.0, 432, 450, 650)),
        _SOFT_FLANKS,
        _SOFT_ROOTS,
        "HV",
    ),
    "nitrocarburised steel": GearSteel(
        _grades((0.0, 650, 300, 650), (1.167, 425, 300, 450), (1.167, 425, 300, 450)),
        _grades((0.0, 224, 300, 650), (0.653, 94, 300, 450), (0.653, 94, 300, 450)),
        _CARBURISED_FLANKS,
        _CARBURISED_ROOTS,
        "HV",
    ),
}
"""Numbers of ISO 6336-5:2016, table 1; roots of flame hardened steel of grade MQ have 369 N/mm^2 above 570 HV,
nitrocarburised steel of MQ and ME above 450 HV its value there."""
_CONSTANT_ABOVE = {
    ("flame hardened steel", "MQ", "root"): 615.0,
    ("nitrocarburised steel", "MQ", "root"): 650.0,
    ("nitrocarburised steel", "ME", "root"): 650.0,
    ("nitrocarburised steel", "MQ", "contact"): 650.0,
    ("nitrocarburised steel", "ME", "contact"): 650.0,
}
"""Hardness up to which the limit at the end of its line goes on."""


def stress_limit(treatment: Treatment, grade: Grade, hardness: float, kind: Literal["contact", "root"]) -> float:
    """Compute sigma_Hlim (``"contact"``) or sigma_Flim (``"root"``) of a material [Pa].

    Raises
    ------
    GeometryError
        A hardness that ISO 6336-5 has no limit for (E-ISO6336).
    """
    steel = GEAR_STEELS[treatment]
    line: LimitLine = (steel.contact if kind == "contact" else steel.root)[grade]
    high: float = _CONSTANT_ABOVE.get((treatment, grade, kind), line.high)
    if not line.low <= hardness <= high:
        raise GeometryError(
            f"ISO 6336-5 has no {'sigma_Hlim' if kind == 'contact' else 'sigma_Flim'} of {treatment} {grade} of "
            f"{hardness:g} {steel.hardness}",
            code="E-ISO6336",
            value=hardness,
            limit=f"{line.low:g} .. {high:g} {steel.hardness}",
            remedy="give another hardness, or the limits themselves",
        )
    if treatment == "flame hardened steel" and grade == "MQ" and kind == "root" and hardness > line.high:
        return 369e6
    return line.at(min(hardness, line.high))
