"""How far up the excitation of a periodic response reaches, and what the housing would feel beyond.

Mesh stiffness jumps where tooth pairs begin and cease to carry: its harmonics fall like one over their order,
while the acceleration of the housing grows towards the modes in which meshes are the springs. A fixed number
of mesh harmonics ends below those modes at low speed. The excitation therefore ends at a frequency, the same
at all speeds, and the level of the housing is computed again with twice that frequency.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from femgear.casefile.sections import Case
    from femgear.gears import PlanetarySet

HIGHEST_RESPONSE = 200e3
"""The wavelength of shear in steel there is 16 mm: shorter waves are no matter of plane gear bodies [Hz]."""
LOWEST = 20e3
"""The excitation reaches the end of hearing at least [Hz]."""
ABOVE_MESHES = 1.4
"""And this many times the highest natural frequency of the rigid gears on their meshes."""
STEP = 2500.0
"""In whole steps, so that variants of one set are excited alike [Hz]."""
HARMONICS = 512
"""The record of the static state carries this many harmonics: the jumps are 2^-13 of a period wide. Slower
speeds are excited less far, and `levels_below` tells what they lose."""
MEMORY = 1.5e9
"""Largest size of the lines and signals of a run [bytes]."""
CHECKED = 12
"""Speeds at which the level is computed again, at most."""
NOTICEABLE = 1.0
"""Change of the level that is worth a warning [dB]."""


@dataclass(frozen=True)
class FrequencyLimit:
    """Harmonics of excitation and response at every speed, (n_speeds,) integer arrays.

    Parameters
    ----------
    frequency : (n_speeds,) array
        Highest excitation frequency [Hz].
    """

    excitation: np.ndarray
    response: np.ndarray
    frequency: np.ndarray


def highest_excitation(case: Case, mesh_mode: float, mesh_frequency: float) -> float:
    """Frequency to which the excitation reaches unless the case says less [Hz].

    Parameters
    ----------
    case : Case
    mesh_mode : float
        Highest natural frequency of the rigid gears on their meshes [Hz].
    mesh_frequency : float
        Of the fastest speed [Hz].
    """
    lowest = STEP * math.ceil(max(LOWEST, ABOVE_MESHES * mesh_mode, 3 * mesh_frequency) / STEP)
    given = max((case.dynamics.mesh_harmonics or 0) * mesh_frequency, case.dynamics.up_to or 0.0)
    return max(min(lowest, 0.5 * HIGHEST_RESPONSE), given)


def limited(
    case: Case, gears: PlanetarySet, mesh_frequency, up_to: float, *, given: int | None = None
) -> FrequencyLimit:
    """Harmonics up to a frequency, or a given number of them.

    Parameters
    ----------
    case : Case
    gears : PlanetarySet
    mesh_frequency : (n_speeds,) array
        [Hz]
    up_to : float
        [Hz]; less at the lowest of so many speeds that their lines would fill the memory.
    given : int, optional
        Mesh harmonics of the excitation at all speeds.
    """
    frequency = np.asarray(mesh_frequency, float)
    if given is None:
        # lines of the sensor with their signal, modes, ring field and meshes, a harmonic of all speeds
        size = len(frequency) * (144 * gears.ring.teeth + 8000 + 96 * gears.n_planets)
        most = min(HARMONICS, max(int(MEMORY / size), 18))
        excitation = np.clip(np.floor(up_to / frequency * (1 + 1e-12)), 1, most).astype(int)
    else:
        excitation = np.full(len(frequency), given)
    # products with the low harmonics of the stiffness reach beyond the excitation
    beyond = excitation + 2 * np.minimum(excitation, 6)
    response = np.maximum(case.dynamics.response_harmonics or beyond, excitation)
    return FrequencyLimit(excitation, response, excitation * frequency)


def checked_speeds(count: int) -> np.ndarray:
    """Numbers of the speeds at which the level is computed again: all of a few, the ends of many."""
    return np.unique(np.linspace(0, count - 1, min(count, CHECKED)).round().astype(int))


def levels_below(lines, frequency) -> np.ndarray:
    """Level of the lines of a sensor at one speed up to each of the frequencies, over that of all lines.

    Harmonics of a stiffness that jumps fall as one over their order, so that lines of a slower speed are
    weaker and closer by the same factor: the share of the level below a frequency depends little on the
    speed (within 1 dB from 250 to 60 rpm of the reference set).

    Parameters
    ----------
    lines : SensorLines
        Of one speed.
    frequency : (n,) array
        [Hz]
    """
    power = np.cumsum(np.abs(lines.acceleration) ** 2)
    place = np.searchsorted(lines.frequency, frequency, side="right") - 1
    return np.sqrt(power[place] / power[-1])


def missing_level(rpm, level_change, limit, compared_to: float) -> tuple[str, ...]:
    """Warning where the level of the housing would change by `NOTICEABLE` or more.

    Parameters
    ----------
    rpm, level_change, limit : (n_speeds,) arrays
        Speeds of the input [rpm], change of the level [dB], nan where it was not computed, and highest
        excitation frequencies [Hz].
    compared_to : float
        Frequency to which the excitation reached in the comparison [Hz].
    """
    known = np.where(np.isfinite(level_change), np.abs(level_change), 0.0)
    if known.max(initial=0.0) < NOTICEABLE:
        return ()
    worst = int(known.argmax())
    return (
        f"[W-EXCITATION] at {rpm[worst]:.6g} rpm the excitation ends at {limit[worst]:.4g} Hz; up to "
        f"{compared_to:.4g} Hz the level of the housing changes by {level_change[worst]:+.1f} dB. It does by "
        f"{NOTICEABLE:g} dB or more at {int((known >= NOTICEABLE).sum())} of the "
        f"{int(np.isfinite(level_change).sum())} speeds looked at: raise dynamics.up_to or "
        "dynamics.mesh_harmonics, or leave the slowest speeds out, before levels are compared",
    )
