"""Torques over time: constant, or a series (of a CSV file: `femgear.casefile.torque_series`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError


@dataclass(frozen=True)
class TorqueHistory:
    """Torque on one body, linear between the instants and constant outside them.

    Parameters
    ----------
    body : str
    times : (m,) array
        Ascending [s].
    values : (m,) array
        [N m], positive about z.
    """

    body: str
    times: np.ndarray
    values: np.ndarray

    def __post_init__(self):
        times, values = (
            np.atleast_1d(np.array(self.times, float)),
            np.atleast_1d(np.array(self.values, float)),
        )
        fits = times.ndim == 1 and times.shape == values.shape and len(times) > 0
        if not fits or not np.all(np.isfinite([times, values])) or np.any(np.diff(times) <= 0.0):
            raise CaseError(
                f"the torque history of {self.body} has {times.size} instants and {values.size} values",
                code="E-TORQUE", limit="as many finite values as ascending instants, one or more",
            )  # fmt: skip
        for name, array in (("times", times), ("values", values)):
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def at(self, times) -> np.ndarray:
        """Torque [N m] at any instants [s]."""
        return np.interp(times, self.times, self.values)


def constant_torques(torques: dict[str, float]) -> tuple[TorqueHistory, ...]:
    """Histories of constant torques on bodies [N m]."""
    return tuple(TorqueHistory(body, [0.0], [value]) for body, value in torques.items())
