"""Lines over several bases as packed whole numbers: sums and mirror images of orders become those of codes.

A set of lines is the ascending array of the codes that are not negative; the mean has the code zero, and the
mirror image of a line the negative code.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.errors import CaseError
from femgear.models.drivetrain import DrivetrainModel

_BITS, _TURN_BITS = 62, 7


@dataclass(frozen=True)
class LineCodes:
    """Places of the orders in the bits of a code.

    Parameters
    ----------
    width : (n_bases,) int array
        Bits of every base.
    """

    width: np.ndarray

    @property
    def stride(self) -> np.ndarray:
        """(n_bases,) codes of the first harmonics."""
        return np.left_shift(np.int64(1), np.append(0, np.cumsum(self.width[:-1])).astype(np.int64))

    @property
    def largest(self) -> np.ndarray:
        """(n_bases,) orders that a line may have; two shifts of this size more still fit."""
        return 2 ** (self.width - 3)

    def of(self, orders) -> np.ndarray:
        """Ascending codes of lines (L, n_bases), of a line and its mirror image the one not negative."""
        return np.unique(np.abs(np.asarray(orders, np.int64) @ self.stride))

    def orders(self, codes) -> np.ndarray:
        """(L, n_bases) int array."""
        left, orders = np.asarray(codes, np.int64), []
        for width in self.width[:-1].tolist():
            half = 1 << (width - 1)
            orders.append(((left + half) & ((1 << width) - 1)) - half)
            left = (left - orders[-1]) >> width
        return np.stack([*orders, left], axis=1)

    def admitted(self, codes) -> np.ndarray:
        """Whether the orders are small enough for a line (L,)."""
        return np.all(np.abs(self.orders(codes)) <= self.largest, axis=1)


def line_codes(model: DrivetrainModel) -> LineCodes:
    """Codes for the bases of a drivetrain.

    Raises
    ------
    CaseError
        More bases, or terms of the mesh stiffness, than fit in 62 bits (E-LINES).
    """
    n, planets = len(model.bases), len(model.geometry.even)
    turn = (np.arange(n) < 2 * planets) & (np.arange(n) % 2 == 0)
    width = np.where(turn, _TURN_BITS, 0)
    meshes = int(np.count_nonzero(~turn))
    each = (_BITS - int(width.sum())) // max(meshes, 1)
    codes = LineCodes(np.where(turn, _TURN_BITS, min(each, 31)).astype(np.int64))
    terms, fits = model.stiffness.shape[1] - 1, 2 ** max(each - 3, 0)
    if terms > fits:
        raise CaseError(
            f"{terms} terms of the mesh stiffness on {n} base frequencies", code="E-LINES",
            limit=f"{fits} terms with so many stages", remedy="take fewer terms",
        )  # fmt: skip
    return codes


def mirrored(values: np.ndarray) -> np.ndarray:
    """Lines (L, ...) with their mirror images before them (2 L - 1, ...)."""
    return np.concatenate([values[:0:-1].conj(), values])


def mirrored_codes(codes: np.ndarray) -> np.ndarray:
    """Codes (2 L - 1,), ascending."""
    return np.concatenate([-codes[:0:-1], codes])


def places(codes: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Where the wanted codes stand among ascending ones, -1 for those that do not."""
    at = np.minimum(np.searchsorted(codes, wanted), len(codes) - 1)
    return np.where(codes[at] == wanted, at, -1)


def beside(codes: np.ndarray, turn: int) -> np.ndarray:
    """The lines and those one turn above and below; a turn of zero adds none."""
    if not turn:
        return codes
    both = mirrored_codes(codes)
    wider = np.unique(np.concatenate([both - turn, both, both + turn]))
    return wider[wider >= 0]
