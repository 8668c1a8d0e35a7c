"""Lateral springs between frames that turn against one another."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError
from femgear.solvers.series import FourierSeries


@dataclass(frozen=True)
class TurningSprings:
    """Isotropic springs between centres whose coordinates turn against one another.

    With ``z = x + i y``, ``d = z_1 - z_2 exp(i phi)`` in the first frame and phi the angle of the second
    frame seen from the first; the forces are ``k d`` on the first and ``-k d exp(-i phi)`` on the second
    centre, of the energy ``k |d|^2 / 2``.

    Parameters
    ----------
    columns : (g, 4) int array
        x and y of the first, x and y of the second centre.
    stiffness : (g,) array
        [N/m]
    wave : FourierSeries
        ``cos phi`` and ``sin phi``, from `turning_wave`.

    Raises
    ------
    CaseError
        Columns that do not fit (E-SHAPE), stiffnesses out of range (E-COUPLING).
    """

    columns: np.ndarray
    stiffness: np.ndarray
    wave: FourierSeries

    # the law is linear in the deflections: a grid of few samples is exact
    degree = 1

    def __post_init__(self):
        columns = np.atleast_2d(np.array(self.columns))
        stiffness = np.atleast_1d(np.array(self.stiffness, float))
        if columns.shape != (len(stiffness), 4) or not np.issubdtype(columns.dtype, np.integer):
            raise CaseError(
                f"columns {columns.tolist()} for {len(stiffness)} springs", code="E-SHAPE",
                limit="four column numbers of W a spring",
            )  # fmt: skip
        if not np.all(np.isfinite(stiffness)) or np.any(stiffness < 0.0):
            raise CaseError(
                f"lateral stiffnesses {stiffness.tolist()} N/m", code="E-COUPLING", limit="finite, 0 or more"
            )
        for name, value in (("columns", columns), ("stiffness", stiffness)):
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    @property
    def reference(self) -> np.ndarray:
        """Every centre held by its spring, (g, 4) [N/m]."""
        return np.repeat(self.stiffness[:, None], 4, axis=1)

    def evaluate(self, x, theta):
        """Forces (..., g, 4) and tangents (..., g, 4, 4)."""
        c, s = np.moveaxis(self.wave.at(theta), -1, 0)
        # d = D x with x = (x_1, y_1, x_2, y_2)
        D = np.zeros((*c.shape, 2, 4))
        D[..., 0, 0] = D[..., 1, 1] = 1.0
        D[..., 0, 2], D[..., 0, 3] = -c, s
        D[..., 1, 2], D[..., 1, 3] = -s, -c
        square = np.swapaxes(D, -1, -2) @ D
        tangent = self.stiffness[:, None, None] * square[..., None, :, :]
        force = (tangent @ x[..., None])[..., 0]
        return force, np.broadcast_to(tangent, (*force.shape, 4))


def turning_wave(orders: tuple[int, ...], *, phase: float = 0.0) -> FourierSeries:
    """Cosine and sine of ``phi = phase + orders . theta``.

    Parameters
    ----------
    orders : tuple of int
        Multiples of the base frequencies; negative ones for a frame that turns clockwise.
    phase : float
        phi at time zero [rad].
    """
    if not math.isfinite(phase):
        raise CaseError(f"a phase of {phase} rad", code="E-VALUE", key="phase", limit="finite")
    turned = np.exp(1j * phase)
    return FourierSeries(np.array([[0.0, turned], [0.0, -1j * turned]]), orders)
