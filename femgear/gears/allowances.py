"""Allowances of the tooth thickness by name, the system of gear fits of DIN 3967.

A name such as ``"cd 25"`` or ``"25cd"`` has an allowance series, a to h, and a tolerance series, 21 to 30. The upper
allowance A_sne is that of the allowance series, the lower one ``A_sni = A_sne - T_sn`` lies by the tolerance below it;
both depend on the reference diameter alone. They hold for the thickness on the reference circle in the normal section.

Series e to h leave little or no play: they are for gears whose play comes from the centre distance. Names say nothing
of the flanks, whose tolerances are those of ISO 1328-1 (`femgear.gears.tolerances`).
"""

from __future__ import annotations

import re
from bisect import bisect_left

from femgear.errors import GeometryError

ALLOWANCE_SERIES = ("a", "ab", "b", "bc", "c", "cd", "d", "e", "f", "g", "h")
"""From the widest fit to that without an allowance."""
TOLERANCE_SERIES = tuple(range(21, 31))
"""From the narrowest tolerance on."""
LARGEST_DIAMETERS = (10.0, 50.0, 125.0, 280.0, 560.0, 1000.0, 1600.0, 2500.0, 4000.0, 6300.0, 10000.0)
"""Reference diameters up to which a row of both tables holds [mm]."""
_UPPER = (
    (100, 85, 70, 58, 48, 40, 33, 22, 10, 5, 0),
    (135, 110, 95, 75, 65, 54, 44, 30, 14, 7, 0),
    (180, 150, 125, 105, 85, 70, 60, 40, 19, 9, 0),
    (250, 200, 170, 140, 115, 95, 80, 56, 26, 12, 0),
    (330, 280, 230, 190, 155, 130, 110, 75, 35, 17, 0),
    (450, 370, 310, 260, 210, 175, 145, 100, 48, 22, 0),
    (600, 500, 420, 340, 290, 240, 200, 135, 64, 30, 0),
    (820, 680, 560, 460, 390, 320, 270, 180, 85, 41, 0),
    (1100, 920, 760, 620, 520, 430, 360, 250, 115, 56, 0),
    (1500, 1250, 1020, 840, 700, 580, 480, 330, 155, 75, 0),
    (2000, 1650, 1350, 1150, 940, 780, 640, 450, 210, 100, 0),
)
"""``-A_sne`` by diameter and `ALLOWANCE_SERIES` [um], DIN 3967:1978, table 1."""
_TOLERANCES = (
    (3, 5, 8, 12, 20, 30, 50, 80, 130, 200),
    (5, 8, 12, 20, 30, 50, 80, 130, 200, 300),
    (6, 10, 16, 25, 40, 60, 100, 160, 250, 400),
    (8, 12, 20, 30, 50, 80, 130, 200, 300, 500),
    (10, 16, 25, 40, 60, 100, 160, 250, 400, 600),
    (12, 20, 30, 50, 80, 130, 200, 300, 500, 800),
    (16, 25, 40, 60, 100, 160, 250, 400, 600, 1000),
    (20, 30, 50, 80, 130, 200, 300, 500, 800, 1300),
    (25, 40, 60, 100, 160, 250, 400, 600, 1000, 1600),
    (30, 50, 80, 130, 200, 300, 500, 800, 1300, 2000),
    (40, 60, 100, 160, 250, 400, 600, 1000, 1600, 2400),
)
"""T_sn by diameter and `TOLERANCE_SERIES` [um], DIN 3967:1978, table 2."""
_NAME = re.compile(r"\s*(?:(\d{2})\s*([a-h]{1,2})|([a-h]{1,2})\s*(\d{2}))\s*")


def fit_series(name: str) -> tuple[str, int]:
    """Read allowance series and tolerance series of a name, such as ``"cd 25"`` or ``"25cd"``.

    Raises
    ------
    GeometryError
        No such series (E-CHOICE).
    """
    match = _NAME.fullmatch(name)
    allowance, tolerance = (match[2] or match[3], int(match[1] or match[4])) if match else ("", 0)
    if allowance not in ALLOWANCE_SERIES or tolerance not in TOLERANCE_SERIES:
        raise GeometryError(
            "no allowances of DIN 3967",
            code="E-CHOICE",
            value=name,
            limit=f"series {', '.join(ALLOWANCE_SERIES)} with {TOLERANCE_SERIES[0]} to {TOLERANCE_SERIES[-1]}",
            remedy='write "cd 25", or both allowances as ["-70 um", "-110 um"]',
        )
    return allowance, tolerance


def thickness_allowances(name: str, reference_diameter: float) -> tuple[float, float]:
    """Find the upper and the lower allowance of the tooth thickness [m] of a name.

    Parameters
    ----------
    name : str
        As for `fit_series`.
    reference_diameter : float
        [m]

    Raises
    ------
    GeometryError
        No such series (E-CHOICE), or a diameter beyond the tables (E-RANGE).
    """
    allowance, tolerance = fit_series(name)
    row = bisect_left(LARGEST_DIAMETERS, round(1e3 * reference_diameter, 9))
    if row == len(LARGEST_DIAMETERS):
        raise GeometryError(
            f"DIN 3967 has no allowances for a reference diameter of {1e3 * reference_diameter:.6g} mm",
            code="E-RANGE",
            value=name,
            limit=f"up to {LARGEST_DIAMETERS[-1]:g} mm",
            remedy='give both allowances as ["-2000 um", "-2600 um"]',
        )
    upper = -_UPPER[row][ALLOWANCE_SERIES.index(allowance)]
    return 1e-6 * upper, 1e-6 * (upper - _TOLERANCES[row][TOLERANCE_SERIES.index(tolerance)])
