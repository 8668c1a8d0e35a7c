"""Periodic response of a set with an elastic ring, and how far up its excitation reaches.

Mesh stiffness jumps where tooth pairs begin and cease to carry: its harmonics fall like one over their order,
while the acceleration of the housing grows towards the modes in which meshes are the springs. A fixed number
of mesh harmonics ends below those modes at low speed. The excitation therefore ends at a frequency, the same
at all speeds, and the level of the housing is computed again with twice that frequency.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from femgear.case.case import planetary_set
from femgear.case.sections import Case
from femgear.gears.kinematics import Speeds
from femgear.housing.orders import order_level
from femgear.housing.sensor import SensorLines, fixed_sensor_lines
from femgear.solvers.linear.modal import output_load, output_response, residual_output
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.system.system import Response
from femgear.trains.elastic.checks import HIGHEST_RESPONSE, NOTICEABLE, checked_speeds
from femgear.trains.elastic.model import RADIAL, TANGENTIAL, ring_field
from femgear.trains.elastic.results import ModesResult

_LOWEST = 20e3
"""The excitation reaches the end of hearing at least [Hz]."""
_ABOVE_MESHES = 1.4
"""And this many times the highest natural frequency of the rigid gears on their meshes."""
_STEP = 2500.0
"""In whole steps, so that variants of one set are excited alike [Hz]."""
HARMONICS = 512
"""The record of the static state carries this many harmonics: the jumps are 2^-13 of a period wide. Slower
speeds are excited less far, and `_level_share` tells what they lose."""
MEMORY = 1.5e9
"""Largest size of the lines and signals of a run [bytes]."""


@dataclass(frozen=True)
class FrequencyLimit:
    """Harmonics of excitation and response, int, and highest excitation frequency [Hz], all (n_speeds,)."""

    excitation: np.ndarray
    response: np.ndarray
    frequency: np.ndarray

    def options(self, case: Case) -> dict[str, Any]:
        """What `solve_spectral` takes beside modes, excitation and frequencies."""
        return {
            "excitation_harmonics": self.excitation,
            "response_harmonics": self.response,
            "tolerance": case.dynamics.tolerance,
        }

    def at(self, speeds: np.ndarray) -> FrequencyLimit:
        """The same at some of the speeds, by their numbers."""
        return FrequencyLimit(self.excitation[speeds], self.response[speeds], self.frequency[speeds])


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
    lowest = _STEP * math.ceil(max(_LOWEST, _ABOVE_MESHES * mesh_mode, 3 * mesh_frequency) / _STEP)
    given = max((case.dynamics.mesh_harmonics or 0) * mesh_frequency, case.dynamics.up_to or 0.0)
    return max(min(lowest, 0.5 * HIGHEST_RESPONSE), given)


def limited(case: Case, mesh_frequency, up_to: float, *, given: int | None = None) -> FrequencyLimit:
    """Harmonics up to a frequency, or a given number of them.

    Parameters
    ----------
    case : Case
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
        size = len(frequency) * (144 * case.ring.teeth + 8000 + 96 * planetary_set(case).n_planets)
        most = min(HARMONICS, max(int(MEMORY / size), 18))
        excitation = np.clip(np.floor(up_to / frequency * (1 + 1e-12)), 1, most).astype(int)
    else:
        excitation = np.full(len(frequency), given)
    # products with the low harmonics of the stiffness reach beyond the excitation
    beyond = excitation + 2 * np.minimum(excitation, 6)
    response = np.maximum(case.dynamics.response_harmonics or beyond, excitation)
    return FrequencyLimit(excitation, response, excitation * frequency)


def excitation_limit(
    case: Case, modes: ModesResult, all_speeds: tuple[Speeds, ...]
) -> tuple[FrequencyLimit, np.ndarray, float]:
    """How far the excitation reaches, what the level changes beyond [dB], and the limit compared with [Hz].

    Where the case sets no limit it is doubled once where that changes the level by 1 dB or more. The changes
    (n_speeds,) are nan at speeds that were not looked at.
    """
    frequency = np.array([s.mesh_frequency for s in all_speeds])
    carrier = np.array([s.carrier for s in all_speeds])
    given, up_to = case.dynamics.mesh_harmonics, case.dynamics.up_to or modes.reach
    automatic = given is None and case.dynamics.up_to is None
    some = checked_speeds(len(frequency))
    limit = limited(case, frequency, up_to, given=given)
    while True:
        beyond = max(2.0 * (up_to if given is None else float(limit.frequency.max())), modes.reach)
        further = limited(case, frequency[some], beyond)
        level, wider_level = (
            order_level(_sensor_lines(case, modes, frequency[some], carrier[some], one))
            for one in (limit.at(some), further)
        )
        change = np.full(len(frequency), np.nan)
        change[some] = 20.0 * np.log10(wider_level / level)
        reached = further.frequency > beyond - frequency[some]
        doubted = np.abs(change[some][reached]).max(initial=0.0) >= NOTICEABLE
        if not (automatic and doubted) or up_to > modes.reach:
            break
        up_to, limit = beyond, limited(case, frequency, beyond)
    slow = frequency * HARMONICS < beyond - frequency
    if slow.any():
        share = _level_share(case, modes, limit.frequency[slow], beyond, np.sign(carrier[0]))
        change[slow] = -20.0 * np.log10(np.maximum(share, 1e-10))
    return limit, change, beyond


def _level_share(case: Case, modes: ModesResult, frequency, beyond: float, sense: float) -> np.ndarray:
    """Level up to frequencies (n,) over that up to another one, of the slowest speed that reaches it [Hz].

    Harmonics of a stiffness that jumps fall as one over their order, so that lines of a slower speed are
    weaker and closer by the same factor: the share of the level below a frequency depends little on the
    speed (within 1 dB from 250 to 60 rpm of the reference set).
    """
    fast = np.array([beyond / HARMONICS * (1.0 + 1e-9)])
    carrier = sense * 2.0 * np.pi * fast / case.ring.teeth
    lines = _sensor_lines(case, modes, fast, carrier, limited(case, fast, beyond))
    power = np.cumsum(np.abs(lines.acceleration[0]) ** 2)
    place = np.searchsorted(lines.frequency[0], frequency, side="right") - 1
    return np.sqrt(power[place] / power[-1])


def _sensor_lines(
    case: Case, modes: ModesResult, frequency: np.ndarray, carrier: np.ndarray, limit: FrequencyLimit
) -> SensorLines:
    """Lines of the fixed sensor at mesh frequencies [Hz] with their speeds of the carrier [rad/s]."""
    response = solve_spectral(modes.modes, modes.excitation, frequency, **limit.options(case))
    field = mesh_and_ring_outputs(modes, response)[1][0]
    return fixed_sensor_lines(field, case.ring.teeth, carrier, case.housing.sensor_angle)


def mesh_and_ring_outputs(
    result: ModesResult, response: Response
) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Dynamic transmission error of every mesh, and radial and tangential field of the ring.

    Parameters
    ----------
    result : ModesResult
    response : Response
        At S speeds, H harmonics.

    Returns
    -------
    (S, 2N, H + 1) complex array
        [m]
    two (S, H + 1, 2 n_max + 1) complex arrays
        Of the outer surface, see `femgear.trains.elastic.model.ring_field` [m].
    """
    model, basis = result.model, result.modes
    ring_rows = np.eye(len(model.system.M))[model.ring_slice]
    outputs = np.vstack([model.rigid_directions.T, ring_rows])
    values = output_response(
        basis,
        response,
        outputs @ basis.shape,
        residual=residual_output(model.system, basis, outputs),
        load=output_load(model.system, basis, outputs),
    )
    n_meshes = model.rigid_directions.shape[1]
    coordinates = np.swapaxes(values[:, n_meshes:], 1, 2)
    radial, tangential = (
        ring_field(model, result.ring.modes, coordinates, output, result.max_diameter)
        for output in (RADIAL, TANGENTIAL)
    )
    return values[:, :n_meshes], (radial, tangential)
