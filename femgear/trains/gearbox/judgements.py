"""What page one answers about a gearbox: teeth and bearings over all load cases, its run, its loudest sensor."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from femgear.case.level_limits import limit_at
from femgear.case.load_spectrum import required_life
from femgear.findings import percent
from femgear.report.tables import Marks, merged_names
from femgear.stages.duty import in_digits
from femgear.stages.judgements import (
    NEAR_RESONANCE,
    Judgement,
    Least,
    LevelMargin,
    NotRated,
    doubt_words,
    estimates_words,
    figures_in_cases,
    judge_faults,
    judge_heat,
    judge_lives,
    judge_noise,
    judge_numbers,
    judge_smoothness,
    judge_strength,
    least_over_life,
    lives_of_bearings,
    lives_of_teeth,
    margins_of_levels,
    no_limit_words,
    resonance_of_line,
    stresses_text,
)
from femgear.stages.strength import OF_ROOTS
from femgear.stages.strength_results import SYMBOLS, taken_as_one
from femgear.stages.tooth_faults import fault_words
from femgear.trains.gearbox.case_file import PairSection, teeth_of
from femgear.trains.gearbox.mode_words import near_mode, nearest_mesh_words
from femgear.trains.gearbox.response_results import OF_BOX_RESPONSE, line_origin, main_way
from femgear.trains.gearbox.silence import silence_words
from femgear.trains.gearbox.strength import flank_of_shafts, least_safety

_CALM = 1.01
"""Largest mesh force over its mean below which forces do not vary to speak of."""
_UNEVEN = 1.2
"""Largest mesh force over its mean from which on page one tells the mesh line that is nearest to a mode."""
_IDLE = 1e-3
"""Mean force of a mesh over the largest force of all up to which it carries nothing that a ratio would tell about."""
_ACCELERATIONS = ("m/s²", 1.0), ("mm/s²", 1e-3), ("µm/s²", 1e-6)
"""Units of a level, from the largest, with their sizes [m/s^2]."""
_LEAST_DIGITS = 0.1
"""Of a level in the unit that it is written in."""
_RESPONSES = "dynamics", "runup", "balance", "transient"
"""Stages with motion."""
_BY_ALL_STAGES = "a run of all stages computes it"
"""What gives an answer that the case has and this run has not."""


def gearbox_judgements(results: Any) -> Iterator[Judgement]:
    """Judge a gearbox."""
    stages, case, findings = results.stages, results.case, results.findings
    if faults := gearbox_faults(case):
        yield judge_faults(faults, "femgear compare with a run of whole teeth shows what it does")
    if "deflection" in stages:
        yield _strength(results)
        data, unknown = results.deflection, _listed(results.deflection, "without_life")
        parts = (*lives_of_teeth(data), *lives_of_bearings(data))
        yield from judge_lives(parts, required_life(case.operation), findings, unknown)
    yield from judge_heat(results)
    moves = any(stage in stages for stage in _RESPONSES)
    remedy = "" if moves else silence_words(case) or _BY_ALL_STAGES
    yield judge_smoothness(_motion(results), results, _RESPONSES, remedy)
    if "dynamics" in stages and results.dynamics.sizes.get("sensor", 0):
        yield _noise(results)
    else:
        yield _unheard(results)
    yield judge_numbers(findings, results.manifest.complete)


def gearbox_faults(case: Any) -> list[str]:
    """Name the faulty teeth of all stages: ``"stage 1 planet 1, tooth 3: crack of 1.5 mm"``."""
    stages = [(stage.name, teeth_of(stage)) for stage in (*case.pair, *case.planetary)]
    return [f"{name} {words}" for name, teeth in stages if teeth is not None for words in fault_words(teeth)]


def _strength(results: Any) -> Judgement:
    """Judge the smallest safeties over all load cases, and over the life asked for."""
    case, data = results.case, results.deflection
    response = results.dynamics if "dynamics" in results.stages else None
    smallest = {kind: least_safety(data, response, symbol) for kind, symbol in (("root", "S_F"), ("flank", "S_H"))}
    root, flank = (least_over_life(data, kind, _least(safety, data, case.pair)) for kind, safety in smallest.items())
    missing = {*str(data.attrs.get("iso_missing", "")).split()}
    shown = [(least, smallest[kind]) for kind, least in (("root", root), ("flank", flank)) if least is not None]
    chosen = -1 if response is None else int(data.attrs["load_case"])
    if shown and all(not least.over_life and safety and safety[1][0] == chosen for least, safety in shown):
        missing -= {"dynamic"}  # the response is one of the chosen load case
    with_teeth = [stage.name for stage in (*case.pair, *case.planetary) if stage.teeth]
    without = NotRated(
        "the case gives no tooth shapes", f"give the teeth of {_stages_words(case)} with treatment and hardness"
    )
    if with_teeth:
        of_stages = f"the material of the teeth of {merged_names(with_teeth)}"
        without = NotRated("no teeth have a treatment", f"give treatment and hardness in {of_stages}")
    return judge_strength(
        root,
        flank,
        case.strength,
        _stresses(results),
        results.findings,
        OF_ROOTS,
        taken_as_one(name for name in SYMBOLS if name in missing),
        without,
        _listed(data, "iso_unrated"),
    )


def _stages_words(case: Any) -> str:
    """Name the tables of the stages of a gearbox: ``planetary stage 1..4``."""
    tables = {"pair": case.pair, "planetary": case.planetary}
    parts = (f"{key} {merged_names([stage.name for stage in stages])}" for key, stages in tables.items() if stages)
    return " and ".join(parts) or "its stages"


def _listed(data: Any, name: str) -> list[str]:
    """Read the names that an attribute of deflection.nc lists; none of files that have not got it."""
    return [text for text in str(data.attrs.get(name, "")).split(" | ") if text]


def _least(safety: tuple[float, tuple[int, int, int]] | None, data: Any, pairs: Sequence[PairSection]) -> Least | None:
    """Name the flank of the smallest safety, and its load case where there are several."""
    if safety is None:
        return None
    value, (case, mesh, gear) = safety
    where = flank_of_shafts(str(data["iso_flank"].values[mesh, gear]), pairs)
    return Least(value, where if data.sizes["load_case"] == 1 else f"{where}, {data['load_case'].values[case]}")


def _stresses(results: Any) -> str:
    """Write the largest stresses of the teeth in the load case that pictures are of, named where there are several."""
    if "stress" not in results.stages:
        return ""
    largest = (results.stress[name].values for name in ("root_worst", "largest_pressure"))
    return stresses_text(*largest) + _load_case(results)


def _load_case(results: Any) -> str:
    """Name the load case that stresses and response are of, in brackets; empty where there is but one."""
    return f" ({results.case.load_case.name})" if len(results.case.operation.load_case) > 1 else ""


def _motion(results: Any) -> str:
    """Write the largest transmission error and the largest mesh force over its mean, each with its load case."""
    parts, cases = [], results.case.operation.load_case
    if "deflection" in results.stages:
        for name, words, factor, unit in (
            ("transmission_error", "transmission error", 1e6, " µm"),
            ("face_load_factor", "face load factor K_Hβ", 1.0, ""),
        ):
            values = results.deflection[name].values if name in results.deflection else np.array([np.nan])
            if np.isfinite(values).any():
                where = cases[int(np.unravel_index(int(np.nanargmax(values)), values.shape)[0])].name
                parts.append((f"{words} {factor * np.nanmax(values):.3g}{unit}", where))
    if "dynamics" in results.stages:
        factors = results.dynamics["dynamic_factor"].values
        if np.isfinite(factors).any():
            parts.append(
                (f"dynamic factor K_v {np.nanmax(factors):.2f}{_longer(results)}", results.case.load_case.name)
            )
    elif "balance" in results.stages:
        mean, largest = (results.balance[name].values for name in ("mean_force", "largest_force"))
        carries = mean > _IDLE * largest.max()
        if carries.any():
            text = f"largest mesh force {(largest[carries] / mean[carries]).max():.3f} of its mean"
            parts.append((text, results.case.load_case.name))
    return figures_in_cases((text, where if len(cases) > 1 else "") for text, where in parts)


def _longer(results: Any) -> str:
    """Write the largest dynamic factor that a longer excitation gives, where forces change by it; empty else."""
    doubtful = any(finding.code == "W-TAIL" and finding.stage == "dynamics" for finding in results.findings)
    if not doubtful or "longer_dynamic_factor" not in results.dynamics:
        return ""
    factors = results.dynamics["longer_dynamic_factor"].values
    return f" ({np.nanmax(factors):.2f} with more harmonics)" if np.isfinite(factors).any() else ""


def _largest_force(results: Any) -> str:
    """Write where the mesh forces of the run-up, or of the load case, are largest over their means; empty without."""
    stage = next((name for name in ("runup", "dynamics") if name in results.stages), None)
    factors = np.array([]) if stage is None else results[stage]["dynamic_factor"].values
    if not np.isfinite(factors).any():
        return ""
    speed, number, _ = np.unravel_index(int(np.nanargmax(factors)), factors.shape)
    where = f"{results[stage]['stage'].values[number]} at {results[stage]['speed'].values[speed]:,.4g} rpm"
    largest = float(np.nanmax(factors))
    begin = "In the run-up its" if stage == "runup" else "Its"
    if largest < _CALM:
        return f"{begin} mesh forces stay within {percent(_CALM - 1.0)} of their mean"
    near = ""
    if stage == "dynamics" and largest > _UNEVEN and "modes" in results.stages:
        words = nearest_mesh_words(results.modes)
        near = f"; nearest to a mode is the {words}" if words else ""
    return f"{begin} mesh forces reach {largest:.2f} times their mean ({where}){near}"


def _unheard(results: Any) -> Judgement:
    """Say why a gearbox has no level at sensors, and what would give one."""
    case, forces = results.case, _largest_force(results)
    if not case.sensor:
        open_words = "femgear casing CASE gives it a casing with sensors"
        if case.motions == "rotation":
            open_words = f'shafts that rotate alone shake nothing: with bearings and motions = "plane" {open_words}'
        return judge_noise("no sensor in this run", forces, open_words=open_words, computed=False)
    why = silence_words(case) or _BY_ALL_STAGES
    return judge_noise("no level at its sensors", forces, open_words=why, computed=False)


def _noise(results: Any) -> Judgement:
    """Judge the level at the loudest sensor, with its main line and the way the largest part of it comes by."""
    data, modes = results.dynamics, results.modes if "modes" in results.stages else None
    level = data["level"].values[0]
    sensor = int(level.argmax())
    whole, name, speed = float(level[sensor]), data["sensor"].values[sensor], float(data["speed"].values[0])
    marks = Marks(results.findings)
    size_words = _marked(whole, marks, "dynamics") + " r.m.s." * (whole > 0.0)
    answer = f"{size_words} at {name}, {speed:,.4g} rpm{_load_case(results)}"
    if not whole > 0.0:
        return judge_noise(answer, "", open_words="nothing excites it")
    size = np.hypot(data["lines_real"].values[0, sensor], data["lines_imag"].values[0, sensor])
    line = int(size.argmax())
    hertz = float(data["order"].values[line]) * speed / 60.0
    mode = "" if modes is None else near_mode(modes, hertz, 0.01 * NEAR_RESONANCE)
    near = f", near {mode}," if mode else ""
    share, line_words = 0.5 * (size[line] / whole) ** 2, f"{line_origin(data, line)} at {hertz:,.0f} Hz"
    sentence = (
        f"At {speed:,.4g} rpm sensor {name} has {size_words}: {line_words}{near} makes {percent(share)} of the power"
    )
    resonance = "" if modes is None else resonance_of_line(line_words, hertz, modes["frequency"].values, share)
    if "path_share" in data:
        sentence += f"; the largest part comes by {main_way(data, sensor)}"
    if "runup" in results.stages and "level" in results.runup:
        sentence += f". Largest of the run-up: {_loudest_of_run_up(results.runup, marks, name)}"
    open_words = no_limit_words("sensor.level_limit", modes is not None)
    margins = tuple(_margins(results))
    rests_on = estimates_words(results.findings)
    return judge_noise(answer, sentence, resonance, open_words, margins, doubt_words(marks.words), rests_on)


def _marked(level: float, marks: Marks, stage: str) -> str:
    """Write a level of a stage with the marks of its doubts."""
    return marks(_level(level), "W-EXCITATION", *OF_BOX_RESPONSE, of=(stage,))


def _loudest_of_run_up(runup: Any, marks: Marks, level_sensor: str) -> str:
    """Write level and speed where the run-up is loudest, with the sensor where it is not the one that is ``known``."""
    level = runup["level"].values
    at, sensor = np.unravel_index(int(level.argmax()), level.shape)
    name = str(runup["sensor"].values[sensor])
    where = "" if name == level_sensor else f"sensor {name}, "
    return f"{_marked(float(level[at, sensor]), marks, 'runup')} at {where}{runup['speed'].values[at]:,.0f} rpm"


def _margins(results: Any) -> Iterator[LevelMargin]:
    """Compare levels of operation and of the run-up with the limits of the sensors that have one.

    Where a longer excitation makes a level higher that one is compared too.
    """
    limits = {sensor.name: sensor.level_limit for sensor in results.case.sensor if sensor.level_limit}
    for stage in ("dynamics", "runup"):
        if stage not in results.stages or "level" not in results[stage]:
            continue
        speed, names = results[stage]["speed"].values, results[stage]["sensor"].values.tolist()
        # a sensor of a casing from a file that has no node is not heard
        for name, points in ((name, limits[name]) for name in names if name in limits):
            sensor = names.index(name)
            level = results[stage]["level"].values[:, sensor]
            over = 20.0 * np.log10(np.maximum(level, np.finfo(float).tiny) / limit_at(points, speed))
            change = results[stage]["level_change"].values[:, sensor] if "level_change" in results[stage] else np.nan
            yield from margins_of_levels(speed, over, name, change)


def _level(level: float) -> str:
    """Write a level [m/s^2] in the unit of its size."""
    if not level > 0.0:
        return "silence"
    unit, size = next((unit for unit in _ACCELERATIONS if level >= _LEAST_DIGITS * unit[1]), _ACCELERATIONS[-1])
    return f"{in_digits(level / size)} {unit}"
