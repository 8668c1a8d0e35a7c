"""Where the excitation of the elastic set ends, and what the level of the housing loses by that.

Mesh stiffness jumps where tooth pairs begin and cease to carry: its harmonics fall like one over their order,
while the acceleration of the housing grows towards the modes in which meshes are the springs. A fixed number
of mesh harmonics ends below those modes at low speed. The excitation therefore ends at a frequency, the same
at all speeds, and the level of the housing is computed again with twice that frequency.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.errors import ConvergenceError
from femgear.housing.orders import order_level
from femgear.housing.sensor import SensorLines
from femgear.report.style import NOTICEABLE
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.trains.elastic.checks import HIGHEST_RESPONSE
from femgear.trains.elastic.outputs import sensor_lines

if TYPE_CHECKING:
    from femgear.case.planetary import Case
    from femgear.trains.elastic.results import ModesResult

_LOWEST = 20e3
"""The excitation reaches the end of hearing at least [Hz]."""
_ABOVE_MESHES = 1.4
"""And this many times the highest natural frequency of the rigid gears on their meshes."""
_STEP = 2500.0
"""In whole steps, so that variants of one set are excited alike [Hz]."""
HARMONICS = 512
"""The record of the static state carries this many harmonics: the jumps are 2^-13 of a period wide. Slower
speeds are excited less far, and `lost_level` tells what they lose."""
MODES_ABOVE = 4.0
"""The modal basis reaches this many times the excitation: the excitation may be doubled once, and modes up to
twice a frequency carry the response there."""


@dataclass(frozen=True)
class FrequencyLimit:
    """Where excitation and response end at every speed.

    ``excitation`` and ``response`` (n_speeds,) are the numbers of harmonics, ``frequency`` (n_speeds,) is the highest
    of the excitation [Hz].
    """

    excitation: np.ndarray
    response: np.ndarray
    frequency: np.ndarray

    def at(self, numbers) -> FrequencyLimit:
        """Limits at the speeds number ``numbers`` alone."""
        return FrequencyLimit(self.excitation[numbers], self.response[numbers], self.frequency[numbers])

    def options(self, case: Case, numbers: Any = slice(None)) -> dict[str, Any]:
        """What `solve_spectral` takes at some of the speeds beside modes, excitation and frequencies."""
        kept = {"excitation_harmonics": self.excitation[numbers], "response_harmonics": self.response[numbers]}
        return {**kept, "tolerance": case.dynamics.tolerance}


def highest_excitation(case: Case, mesh_mode: float, mesh_frequency: float) -> float:
    """Choose the frequency to which the excitation reaches unless the case says less [Hz].

    From the highest natural frequency of the rigid gears on their meshes, and the mesh frequency of the
    fastest speed [Hz].
    """
    lowest = _STEP * math.ceil(max(_LOWEST, _ABOVE_MESHES * mesh_mode, 3 * mesh_frequency) / _STEP)
    given = max((case.dynamics.mesh_harmonics or 0) * mesh_frequency, case.dynamics.up_to or 0.0)
    return max(min(lowest, 0.5 * HIGHEST_RESPONSE), given)


def limited(case: Case, mesh_frequency, up_to: float, *, given: int | None = None) -> FrequencyLimit:
    """Count the harmonics (n_speeds,) up to a frequency, or take a given number of them.

    Mesh frequencies (n_speeds,) and limit are in Hz; the number is that of the excitation at all speeds.
    """
    frequency = np.asarray(mesh_frequency, float)
    if given is None:
        excitation = np.clip(np.floor(up_to / frequency * (1 + 1e-12)), 1, HARMONICS).astype(int)
    else:
        excitation = np.full(len(frequency), given)
    # products with the low harmonics of the stiffness reach beyond the excitation
    beyond = excitation + 2 * np.minimum(excitation, 6)
    response = np.maximum(case.dynamics.response_harmonics or beyond, excitation)
    return FrequencyLimit(excitation, response, excitation * frequency)


Heard = Callable[[np.ndarray, np.ndarray, FrequencyLimit], SensorLines]
"""Lines of the sensor that has the level, by mesh frequencies (n_speeds,) [Hz], speeds of the carrier [rad/s]
and limits of the excitation at these."""


def lines_on_foundation(
    case: Case, modes: ModesResult, frequency: np.ndarray, carrier: np.ndarray, limit: FrequencyLimit
) -> SensorLines:
    """Compute lines of the sensor of a ring on its foundation, see `Heard`.

    At mesh frequencies (n,) [Hz] and speeds (n,) of the carrier [rad/s].
    """
    response = solve_spectral(modes.modes, modes.excitation, frequency, **limit.options(case), radius=False)
    return sensor_lines(case, modes, response, carrier)


def first_limit(case: Case, modes: ModesResult, frequency: np.ndarray) -> FrequencyLimit:
    """Choose the limit (n_speeds,) of the excitation before levels are compared; frequencies in Hz."""
    return limited(case, frequency, case.dynamics.up_to or modes.reach, given=case.dynamics.mesh_harmonics)


def excitation_end(
    case: Case,
    modes: ModesResult,
    lines_at: Heard,
    frequency: np.ndarray,
    carrier: np.ndarray,
    level: np.ndarray | None = None,
) -> tuple[float, float, np.ndarray]:
    """Choose where the excitation ends, from some speeds, so that the level has converged if it may.

    Frequency [Hz], that to which the level was compared [Hz], and its changes (n_speeds,) at the speeds [dB], nan where
    the equations with more excitation are nearly singular. ``frequency`` (n_speeds,) is that of the meshes [Hz],
    ``carrier`` (n_speeds,) the speed of the carrier [rad/s], ``level`` (n_speeds,) that with `first_limit`.
    """
    given, up_to = case.dynamics.mesh_harmonics, case.dynamics.up_to or modes.reach
    limit = first_limit(case, modes, frequency)
    if level is None:
        level = order_level(lines_at(frequency, carrier, limit))
    while True:
        beyond = max(2.0 * (up_to if given is None else float(limit.frequency.max())), modes.reach)
        limit = limited(case, frequency, beyond)
        try:
            wider = order_level(lines_at(frequency, carrier, limit))
        except ConvergenceError:
            return up_to, beyond, np.full(len(frequency), np.nan)
        change = 20.0 * np.log10(wider / level)
        reached = limit.frequency > beyond - frequency
        short = np.abs(change[reached]).max(initial=0.0) >= NOTICEABLE
        if not short or given is not None or up_to != modes.reach or case.dynamics.up_to is not None:
            return up_to, beyond, change
        up_to, level = beyond, wider  # once: the modal basis carries no more


def lost_level(case: Case, lines_at: Heard, frequency, beyond: float, sense: float) -> np.ndarray:
    """What the level loses that ends at frequencies (n,) instead of beyond, of the slowest speed [Hz] [dB].

    Harmonics of a stiffness that jumps fall as one over their order, so that lines of a slower speed are
    weaker and closer by the same factor: the share of the level below a frequency depends little on the
    speed (within 1 dB from 250 to 60 rpm of the reference set).
    """
    fast = np.array([beyond / HARMONICS * (1.0 + 1e-9)])
    lines = lines_at(fast, sense * 2.0 * np.pi * fast / case.ring.teeth, limited(case, fast, beyond))
    power = np.cumsum(np.abs(lines.acceleration[0]) ** 2)
    place = np.searchsorted(lines.frequency[0], frequency, side="right") - 1
    return -20.0 * np.log10(np.maximum(np.sqrt(power[place] / power[-1]), 1e-10))
