"""What the train "drivetrain" computed, which integrated chains of bodies until its cases became gearboxes.

The numbers beside this module are of femgear 6c03cc6f: of the three shipped cases natural frequencies and, but for the
wind turbine, amplitudes of all named lines of the whole run; of the wind turbine with frozen mesh directions motions
and forces under torque and weight, and frequencies with held axes; histories of rotations and mesh forces, that of the
wind turbine with radii in the ratios of its teeth.
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any


@cache
def numbers() -> dict[str, Any]:
    """Read all numbers by what they are."""
    return json.loads((Path(__file__).parent / "drivetrain_train.json").read_text(encoding="utf-8"))
