"""What page one answers about a set with an elastic ring: its teeth, and how loud it is by which line and mode."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from femgear.case.level_limits import limit_at
from femgear.findings import CATALOGUE, percent
from femgear.report.tables import Marks, is_bound, level_change_at
from femgear.stages.assumptions import most_decisive
from femgear.stages.judgements import (
    MAKES_LEVEL,
    NEAR_RESONANCE,
    Judgement,
    LevelMargin,
    doubt_words,
    estimates_words,
    judge_noise,
    judge_numbers,
    margins_of_levels,
    no_limit_words,
    resonance_of_line,
    voice_words,
)
from femgear.stages.train_judgements import judge_teeth
from femgear.trains.elastic.results import known_factors, level_changes, level_doubts, marked_level, rate_set
from femgear.trains.elastic.runup import loudest

_STANDS_OUT = 0.1
"""Share of the power of all lines from which on the largest one stands out of them."""


def set_with_ring_judgements(results: Any) -> Iterator[Judgement]:
    """Judge a planetary set with an elastic ring."""
    yield from judge_teeth(results, rate_set(results), known_factors(results).get("K_v"))
    if "housing" in results.stages:
        yield _noise(results)
    yield judge_numbers(results.findings, results.manifest.complete)


def _noise(results: Any) -> Judgement:
    """Judge the level at the loudest speed of operation, with its main line and the resonance that makes it.

    Lines of housing.nc are displacements.
    """
    housing = results.housing
    level, speeds = housing["level"].values, housing["speed"].values
    at = int(level.argmax())
    speed = float(speeds[at])
    at_microphone, compared, limit_entry = "", "", "housing.level_limit"
    if "pressure_level" in housing:
        sound = float(housing["pressure_level"][at])
        at_microphone = f" ({sound:.1f} dB(A) at the microphone)"
        compared = f", {voice_words(sound)}"
        limit_entry = "housing.microphone.level_limit"
    marks = Marks(results.findings)
    level_words = marked_level(results, at, marks, level_doubts(results, [at]).get(at, ()), digits=3)
    size_words = f"{level_words} m/s² r.m.s.{at_microphone}"
    answer = f"{size_words} at {speed:,.4g} rpm"
    carrier = abs(float(housing["carrier_speed"].values[at]))
    orders = housing["order"].values
    size = np.hypot(housing["lines_real"].values[at], housing["lines_imag"].values[at]) * (orders * carrier) ** 2
    line = int(size.argmax())
    order = float(orders[line])
    hertz = order * carrier / (2.0 * np.pi)
    share = 0.5 * (size[line] / level[at]) ** 2 if level[at] > 0.0 else 0.0
    origin = _origin(round(order), results.case.ring.teeth) or f"{order:g} per carrier turn"
    line_words = f"{origin} at {hertz:,.0f} Hz"
    resonance, cause = "", ""
    if "runup" in results.stages:
        resonance, cause = _resonance(results, speed, carrier * results.case.ring.teeth / (2.0 * np.pi))
    elif "modes" in results.stages:
        resonance = resonance_of_line(line_words, hertz, results.modes["frequency"].values, share)
    if not cause:
        place = ", ".join(filter(None, (origin, _nearest_mode(results, hertz))))
        which = "its" if share >= _STANDS_OUT else "no line stands out, the"
        cause = f"{which} largest line, {hertz:,.0f} Hz ({place}), makes {percent(share)} of the power"
    sentence = f"At {speed:,.4g} rpm the housing has {_bound_in_words(size_words)}{compared}: {cause}"
    if decisive := most_decisive(results):
        sentence += f", with half and twice of what is assumed: {decisive}"
    margins, levels = tuple(_margins(results)), [size_words]
    if "runup" in results.stages:
        levels.append(loudest(results.runup, marks, digits=3))
        sentence += f". Largest of the run-up: {_bound_in_words(levels[-1])}"
    # a bound has no mark: it is one itself
    doubts = [*([CATALOGUE["W-EXCITATION"].words] if any(map(is_bound, levels)) else []), *marks.words]
    rests_on = estimates_words(results.findings)
    resonances_known = "runup" in results.stages or "modes" in results.stages
    open_words = no_limit_words(limit_entry, resonances_known)
    return judge_noise(answer, sentence, resonance, open_words, margins, doubt_words(doubts), rests_on)


def _bound_in_words(level: str) -> str:
    """Write a level of which only a bound is known as one: "more than 9 m/s²"."""
    return f"more than {level[2:]}" if is_bound(level) else level


def _margins(results: Any) -> Iterator[LevelMargin]:
    """Compare levels of operation and of the run-up with the limits of sensor and microphone."""
    limits = results.case.housing
    for stage in ("housing", "runup"):
        if limits.level_limit and stage in results.stages:
            speed, level = results[stage]["speed"].values, results[stage]["level"].values
            over = np.maximum(level, np.finfo(float).tiny) / limit_at(limits.level_limit, speed)
            change = level_changes(results) if stage == "housing" else level_change_at(results.runup, speed)
            yield from margins_of_levels(speed, 20.0 * np.log10(over), "the sensor", change)
    if limits.microphone.level_limit and "pressure_level" in results.housing:
        speed, level = results.housing["speed"].values, results.housing["pressure_level"].values
        yield from margins_of_levels(speed, level - limit_at(limits.microphone.level_limit, speed), "the microphone")


def _origin(order: int, teeth: int) -> str:
    """Write an order of the carrier as mesh harmonic, of which it makes one a tooth of the ring, with its side band."""
    harmonic = round(order / teeth)
    beside = order - harmonic * teeth
    if not harmonic:
        return ""
    return f"mesh harmonic {harmonic}{f', side band {beside:+d}' if beside else ''}"


def _nearest_mode(results: Any, hertz: float) -> str:
    """Write the mode nearest to a frequency, empty without modes or where none is as near as a resonance is."""
    if "modes" not in results.stages:
        return ""
    frequency = results.modes["frequency"].values
    mode = int(np.abs(frequency - hertz).argmin())
    if 100.0 * abs(frequency[mode] - hertz) > NEAR_RESONANCE * frequency[mode]:
        return ""
    return f"near mode {mode + 1}: {results.modes['kind'].values[mode]}"


def _resonance(results: Any, loudest_speed: float, mesh_frequency: float) -> tuple[str, str]:
    """Write the resonance that makes most of a level of operation, and the same as the cause in the sentence.

    It is of all lines of a mesh harmonic: its share may be more than that of the largest line, of another harmonic.
    That of the loudest speed of operation [rpm], with its mesh frequency [Hz], goes before all others, and is alone
    the cause there.

    Returns
    -------
    tuple of str
        Of the card and of the sentence; the first is empty where no resonance makes half of a level, the second where
        none does at the loudest speed.
    """
    runup = results.runup
    if "operating_alone" not in runup:
        return "", ""
    alone, distance = runup["operating_alone"].values, runup["distance"].values
    speeds = runup["operating_speed"].values
    level = np.interp(speeds, runup["speed"].values, runup["level"].values)
    makes = np.where((np.abs(distance) <= NEAR_RESONANCE) & (alone >= MAKES_LEVEL * level), alone / level, 0.0)
    if not makes.any():
        return "", ""
    at_loudest = np.where(np.isclose(speeds, loudest_speed), makes, 0.0)
    at = int((at_loudest if at_loudest.any() else makes).argmax())
    mode, harmonic = int(runup["mode"].values[at]), int(runup["mesh_harmonic"].values[at])
    speed, share = float(speeds[at]), float(makes[at]) ** 2
    part = f"{percent(share)} of the power" if share < 1.0 else "as loud as all lines together"
    power = f"makes {part}" if share < 1.0 else f"alone is {part}"
    meeting = f"mesh harmonic {harmonic} meets mode {mode} at {speed * (1.0 + 0.01 * distance[at]):,.4g} rpm"
    card = f"{meeting}: {part}"
    card += "" if np.isclose(speed, loudest_speed) else f" at {speed:,.4g} rpm"  # the level beside it is of that speed
    if not at_loudest.any():
        return card, ""
    kind = f" ({results.modes['kind'].values[mode - 1]})" if "modes" in results.stages else ""
    hertz = f"{harmonic * mesh_frequency:,.0f} Hz"
    return card, f"mesh harmonic {harmonic} at {hertz} excites mode {mode}{kind}, which {power}"
