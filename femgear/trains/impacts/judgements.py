"""What page one answers about a gear pair with play: where its teeth part, and how far they move."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from femgear.stages.judgements import SMOOTH, Judgement, judge_numbers


def impact_judgements(results: Any) -> Iterator[Judgement]:
    """Judge a gear pair with play."""
    if "response" in results.stages:
        data = results.response
        largest = float(data["amplitude"].max())
        answer = f"largest amplitude {largest:.3g} half backlashes"
        parted = np.flatnonzero(data["free_share"].values > 0.0)
        if len(parted):
            ratios = data["ratio"].values[parted]
            where = f"teeth part between {ratios.min():.3g} and {ratios.max():.3g} of the natural frequency"
            both = bool((data["back_share"].values > 0.0).any())
            yield Judgement(SMOOTH, "look", answer, where, f"{where}{', and strike the back flanks' if both else ''}")
        else:
            yield Judgement(SMOOTH, "good", answer, "teeth stay in contact at all speeds", "Teeth stay in contact")
    yield judge_numbers(results.findings, results.manifest.complete)
