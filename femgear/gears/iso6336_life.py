"""Life of gear teeth under loads that change, ISO 6336-6: damage sum, safety of a spectrum, equivalent torque.

Damages of load cases add (A. Palmgren, M. A. Miner): ``U = sum n_i / N_i`` with the load cycles n_i of a load case and
those N_i that its stress stands by the line Z_NT of ISO 6336-2 or Y_NT of ISO 6336-3, table 2 and table 1. Stresses
below the last factor of the line, that of 1e10 cycles, do no damage; one above its first factor, the static strength,
breaks at once. The safety of a spectrum is the factor on all stresses with which the damage is 1.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from femgear.gears.gear_steels import GEAR_STEELS, LIMITED_PITTING, LifeLine

PITTING = (
    "normalised steel",
    "cast steel",
    "malleable iron",
    "nodular iron",
    "through hardened carbon steel",
    "through hardened alloy steel",
    "through hardened cast carbon steel",
    "through hardened cast alloy steel",
    "case hardened steel",
    "flame hardened steel",
)
"""Treatments for which ISO 6336-2 has a line of flanks that may pit to a limited extent."""
_STEPS = 200


@dataclass(frozen=True)
class ToothSpectrum:
    """Stresses of a root or of a flank in all load cases.

    Parameters
    ----------
    ratio : (c,) or (c, m) array
        Stress over the strength for long life, the inverse of the safety S_F or S_H of the load case; 0 where the load
        case does not load it. Of a gear with m mates the stresses by all of them.
    cycles : (c,) or (c, m) array
        Load cycles an hour of the spectrum: those an hour of the load case, times its share.
    line : LifeLine
        Y_NT or Z_NT of the material.
    """

    ratio: np.ndarray
    cycles: np.ndarray
    line: LifeLine

    @property
    def damage(self) -> np.ndarray:
        """Damage (c,) of the load cases in an hour of the spectrum; infinite beyond the static strength."""
        return miner_damage(self.ratio, self.cycles, self.line).reshape(len(self.ratio), -1).sum(axis=1)

    @property
    def largest_ratio(self) -> np.ndarray:
        """Largest stress (c,) of the load cases over the strength for long life."""
        return self.ratio.reshape(len(self.ratio), -1).max(axis=1)

    @property
    def all_cycles(self) -> np.ndarray:
        """Load cycles (c,) an hour of the spectrum by all mates."""
        return self.cycles.reshape(len(self.cycles), -1).sum(axis=1)

    @property
    def hours(self) -> float:
        """Life [h] until the damage is 1; infinite where no load case does any damage."""
        total = float(self.damage.sum())
        return math.inf if total == 0.0 else 1.0 / total

    @property
    def damage_share(self) -> np.ndarray:
        """Share (c,) of every load case in the damage; zero where there is none."""
        damage = self.damage
        beyond = np.isinf(damage)
        if beyond.any():
            damage = beyond.astype(float)
        total = damage.sum()
        return damage / total if total > 0.0 else damage

    def safety(self, hours: float) -> float:
        """Compute the safety of the spectrum over a life [h]; infinite without load."""
        return spectrum_safety(self.ratio, hours * self.cycles, self.line)


def life_line(treatment: str, kind: str, *, pitting: bool = False) -> LifeLine:
    """Find Z_NT (``kind`` "flank") or Y_NT ("root") of a treatment; ``pitting`` allows flanks to pit a little."""
    if kind == "root":
        return GEAR_STEELS[treatment].root_life
    return LIMITED_PITTING if pitting else GEAR_STEELS[treatment].contact_life


def miner_damage(ratio: Sequence[float] | np.ndarray, cycles: Sequence[float] | np.ndarray, line: LifeLine):
    """Compute the damage (c,) that load cases do, ``n_i / N_i`` (ISO 6336-6).

    Parameters
    ----------
    ratio : (c,) array
        Stresses over the strength for long life.
    cycles : (c,) array
        Load cycles n_i.
    line : LifeLine
        Factors over load cycles.

    Returns
    -------
    (c,) array
        Infinite beyond the static strength, zero below the last factor and without load cycles.
    """
    number, stands = np.asarray(cycles, float), line.cycles_at(np.asarray(ratio, float))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(number > 0.0, number / stands, 0.0)


def spectrum_safety(ratio: np.ndarray, cycles: np.ndarray, line: LifeLine) -> float:
    """Compute the factor on all stresses with which the damage is 1 (ISO 6336-6, iterated); infinite without load.

    Of stresses (n,), over those of long life, and their load cycles (n,). Where the damage leaps over 1, at the static
    strength and at that of 1e10 cycles, it is the factor of the leap.
    """
    largest = float(np.max(np.where(np.asarray(cycles) > 0.0, ratio, 0.0), initial=0.0))
    if largest == 0.0:
        return math.inf
    low, high = 0.5 * line.factors[-1] / largest, 2.0 * line.factors[0] / largest
    for _ in range(_STEPS):
        middle = math.sqrt(low * high)
        if not low < middle < high:
            break
        if miner_damage(middle * np.asarray(ratio), cycles, line).sum() <= 1.0:
            low = middle
        else:
            high = middle
    return low


def equivalent_torque(torque: Sequence[float] | np.ndarray, weights: Sequence[float] | np.ndarray, exponent: float):
    """Compute the constant torque that does the damage of several (ISO 6336-6, annex A).

    ``(sum w_i |T_i|^p / sum w_i)^(1/p)``

    Parameters
    ----------
    torque : (c,) array
        Torques T_i, of either sign.
    weights : (c,) array
        Load cycles, or shares of them.
    exponent : float
        p of torques: that of stresses for roots, half of it for flanks, whose stress grows with the root of the torque.
    """
    size, weight = np.abs(np.asarray(torque, float)), np.asarray(weights, float)
    largest = size.max(initial=0.0)
    if largest == 0.0:
        return 0.0
    return float(largest * ((weight @ (size / largest) ** exponent) / weight.sum()) ** (1.0 / exponent))
