"""What the train "multistage" computed, which solved planetary stages in series until its cases became gearboxes.

The numbers beside this module are of femgear 224a9b2b: modes of `cases/published_four_stages.toml` and
`cases/four_stage_reducer.toml`, loaded states of both at 350 N m, responses of the latter without losses. Lines stand
for meshes with planet 1, sun and ring, stage by stage.
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np


@cache
def stored() -> dict[str, Any]:
    """Read all numbers by what they are."""
    return json.loads((Path(__file__).parent / "multistage_train.json").read_text(encoding="utf-8"))


def complex_numbers(entry: dict[str, Any]) -> np.ndarray:
    """Array of complex numbers from their parts and shape."""
    return (np.array(entry["real"]) + 1j * np.array(entry["imag"])).reshape(entry["shape"])
