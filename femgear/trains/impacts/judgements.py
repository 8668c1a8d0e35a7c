"""What page one answers about a gear pair with play: where its teeth part, and how far they move."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from femgear.case.sections import StrengthSection
from femgear.stages.duty import ShaftEnd, duty_sentence, in_digits
from femgear.stages.judgements import SMOOTH, Judgement, NotRated, judge_noise, judge_numbers, judge_strength

_WITH_TEETH = "femgear new pair writes a case with tooth shapes"
"""What gives a pair with play what its kind of case has not."""


def impact_duty(case: Any) -> str:
    """Write what a gear pair with play does: its torques, and its backlash."""
    torque, (first, second) = case.operation.torque, case.gears.teeth
    ends = ShaftEnd("gear 1", torque, ()), ShaftEnd("gear 2", -torque * second / first, ())
    return duty_sentence(ends, f"{first} and {second} teeth, backlash {1e6 * case.mesh.backlash:.4g} µm")


def impact_judgements(results: Any) -> Iterator[Judgement]:
    """Judge a gear pair with play."""
    without = NotRated("the case gives no tooth shapes", f"{_WITH_TEETH}: give it treatment and hardness")
    yield judge_strength(None, None, StrengthSection(), without=without)
    if "response" in results.stages:
        data = results.response
        largest = float(data["amplitude"].max())
        answer = f"largest amplitude {1e6 * largest * float(data.attrs['half_backlash']):.3g} µm"
        answer += f", {largest:.3g} half backlashes"
        parted = np.flatnonzero(data["free_share"].values > 0.0)
        if len(parted):
            ratios = data["ratio"].values[parted]
            natural = float(data.attrs["natural_frequency"])
            rpm = 60.0 * natural / results.case.gears.teeth[0] * np.array([ratios.min(), ratios.max()])
            where = (
                f"teeth part between {ratios.min():.3g} and {ratios.max():.3g} of the natural frequency of "
                f"{natural:,.0f} Hz, {in_digits(rpm[0])} to {in_digits(rpm[1])} rpm of gear 1"
            )
            both = bool((data["back_share"].values > 0.0).any())
            yield Judgement(SMOOTH, "look", answer, where, f"{where}{', and strike the back flanks' if both else ''}")
        else:
            yield Judgement(SMOOTH, "good", answer, "teeth stay in contact at all speeds", "Teeth stay in contact")
    no_level, remedy = (
        "no level: this kind of case has no housing",
        f"{_WITH_TEETH}, which femgear casing puts in a casing",
    )
    yield judge_noise(no_level, "", open_words=remedy, computed=False)
    yield judge_numbers(results.findings, results.manifest.complete)
