"""Mesh stiffness in proportion to the number of tooth pairs in contact."""

from __future__ import annotations

import numpy as np

from femgear.errors import CaseError


def pair_count_wave(start: float, end: float, harmonics: int, *, overlap: float = 0.0) -> np.ndarray:
    """Compute the harmonics of a mesh stiffness in proportion to the length of contact of its tooth pairs.

    A pair touches from ``start`` s to ``end`` e of its path, so that at ``Re sum k_h exp(2 pi i h tau)``
    ``k_h / k_0 = (exp(-2 pi i h s) - exp(-2 pi i h e)) / (pi i h (e - s)) sinc(h overlap)`` with ``sinc(x) = sin(pi
    x) / (pi x)``: a rectangular wave of spur gears (Parker and Lin, J. Mech. Des. 126, 2004, 68-76), the sum of the
    contact lines of helical ones (Maatar and Velex, J. Mech. Des. 118, 1996, 586-589).

    CaseError: a path that ends before it starts (E-RANGE).

    Parameters
    ----------
    start, end : float
        In transverse base pitches from the pitch point, which a pair passes at tau = 0, in the middle of the width.
    harmonics : int
        Number H of harmonics of the mesh frequency.
    overlap : float
        Overlap ratio of helical teeth [1].

    Returns
    -------
    (H,) complex array
        Harmonics 1 to H over the mean stiffness [1].
    """
    if not start < end:
        raise CaseError("the path of contact ends before it starts", code="E-RANGE", limit=f"end above {start:g}")
    h = np.arange(1, harmonics + 1)
    wave = (np.exp(-2j * np.pi * h * start) - np.exp(-2j * np.pi * h * end)) / (1j * np.pi * h * (end - start))
    return wave * np.sinc(h * overlap)
