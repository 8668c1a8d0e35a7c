"""What decides about a gearbox: its teeth and bearings over all load cases, and what is heard of it, by whom.

A number that a doubt or a fault of its stage concerns has a mark, which a note explains.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from femgear.findings import percent
from femgear.report.tables import Block, Marks, doubtful_excitation, merged_names
from femgear.stages.duty import force_words
from femgear.stages.friction_source import friction_rows
from femgear.stages.heat_results import heat_rows
from femgear.stages.key_figures import REFERENCE_ACCELERATION
from femgear.stages.life_results import life_rows
from femgear.stages.losses_results import efficiency_rows
from femgear.stages.planet_bearings import planet_bearing_rows
from femgear.trains.gearbox.casing_results import largest_foot_force
from femgear.trains.gearbox.life import shortest_life
from femgear.trains.gearbox.mode_words import MESH_LINES, near_mode, nearest_mesh_words
from femgear.trains.gearbox.response_results import OF_BOX_RESPONSE, SENSORS_JUDGED, line_origin, main_way
from femgear.trains.gearbox.strength import smallest_safeties
from femgear.trains.gearbox.stress import box_reason_rows

_ROUNDING = 1e-9
"""Share of the mesh forces under which the force of a bearing is rounding: planets balance one another."""
_ALIGNED = 1e-9
"""Misalignment [m] below which teeth are in line: no flank is ground to that, and stiff shafts have none."""
_SHARES_NAMED = 4
"""Different shares of torque that are named one by one; of more of them the smallest and the largest one."""
_OF_TEETH = "W-PASSES", "W-DEFLECTION", "W-STIFFNESS", "W-FACE-LOAD", "W-OPEN"
_OF_BEARINGS = "W-PASSES", "W-DEFLECTION", "W-STIFFNESS", "W-BEARING", "W-PLAY"


def gearbox_verdict(results: Any) -> Iterator[Block]:
    """Tabulate what decides: misalignment, K_Hbeta, bearings, levels with their main line, modes near it."""
    rows, marks = list[tuple[str, str]](), Marks(results.findings)
    if "deflection" in results.stages:
        rows += _worst_of_deflection(results.deflection, marks)
        response = results.dynamics if "dynamics" in results.stages else None
        rows += smallest_safeties(results.deflection, response, marks, results.case.pair)
        rows += box_reason_rows(results.stress) if "stress" in results.stages else ()
        rows += life_rows(results.deflection, marks, of=("deflection",))
        rows += planet_bearing_rows(results.deflection, marks, of=("deflection",))
        rows += efficiency_rows(results, marks)
        rows += heat_rows(results, marks)
    modes = results.modes if "modes" in results.stages else None
    if modes is not None:
        rows += _nearest_mode(modes)
    if "dynamics" in results.stages:
        rows += _heard(results.dynamics, modes, marks)
        rows += friction_rows(results, marks)
    if "runup" in results.stages:
        rows += _over_speeds(results.runup, marks)
    if rows:
        yield Block("Verdict", rows=tuple(rows), notes=marks.notes)


def _worst_of_deflection(data: Any, marks: Marks) -> Iterator[tuple[str, str]]:
    cases, meshes, bearings = (data[name].values for name in ("load_case", "mesh", "bearing"))

    def where(place, names) -> str:
        case = f", {cases[place[0]]}" if len(cases) > 1 else ""
        return f"{names[place[1]]}{case}"

    def of_teeth(text: str) -> str:
        return marks(text, *_OF_TEETH, of=("deflection",))

    if len(meshes):
        misaligned = data["mesh_misalignment"].values
        at = np.unravel_index(int(np.abs(misaligned).argmax()), misaligned.shape)
        if abs(misaligned[at]) >= _ALIGNED:
            text = of_teeth(f"{1e6 * misaligned[at]:+.3g} µm")
            yield "largest misalignment over the width", f"{text}, {where(at, meshes)}"
        factor = data["face_load_factor"].values
        if np.isfinite(factor).any():
            at = np.unravel_index(int(np.nanargmax(factor)), factor.shape)
            least = f"; of all meshes from {np.nanmin(factor):.3f}" if np.isfinite(factor).sum() > 1 else ""
            yield "largest face load factor K_Hβ", f"{of_teeth(f'{factor[at]:.3f}')}, {where(at, meshes)}{least}"
    sharing = data["planet_load_factor"].values
    if np.isfinite(sharing).any():
        at = np.unravel_index(int(np.nanargmax(sharing)), sharing.shape)
        text = of_teeth(f"{sharing[at]:.3f}")
        yield "largest planet load factor K_γ", f"{text}, {where(at, data['stage'].values)}"
    if "torque_share" in data:
        share = data["torque_share"].values
        at = int(np.nanargmax(share.max(axis=1, where=np.isfinite(share), initial=0.0)))
        stages = dict[str, list[str]]()
        for name, value in zip(data["stage"].values, share[at], strict=True):
            if np.isfinite(value):
                stages.setdefault(percent(value, 1), []).append(str(name))
        parts = [f"{merged_names(names)} {value}" for value, names in stages.items()]
        if len(parts) > _SHARES_NAMED:
            low, high = (order(share[at][np.isfinite(share[at])]) for order in (np.min, np.max))
            ends = zip(("from", "to"), (percent(low, 1), percent(high, 1)), strict=True)
            parts = [" ".join(f"{end} {value} ({merged_names(stages[value])})" for end, value in ends)]
        case = f", {cases[at]}" if len(cases) > 1 else ""
        yield "torque of stages side by side", f"{of_teeth(', '.join(parts))}{case}"
    if len(bearings):
        force = np.hypot(data["radial_force"].values, data["axial_force"].values)
        at = np.unravel_index(int(force.argmax()), force.shape)
        if force[at] > _ROUNDING * np.nanmax(data["mesh_force"].values, initial=0.0):
            text = marks(force_words(float(force[at])), *_OF_BEARINGS, of=("deflection",))
            yield "largest bearing force", f"{text}, {where(at, bearings)}"
        yield from shortest_life(data, marks)
    yield from largest_foot_force(data)


def _nearest_mode(data: Any) -> Iterator[tuple[str, str]]:
    """The mode that a mesh line comes nearest at the speed of operation."""
    if text := nearest_mesh_words(data):
        yield f"mesh line up to harmonic {MESH_LINES} nearest to a mode", text


def level_text(level: float) -> str:
    """Write a level with its decibels re 1 µm/s²."""
    if not level > 0.0:
        return "silent"
    return f"{level:.4g} m/s² ({20.0 * math.log10(level / REFERENCE_ACCELERATION):.1f} dB re 1 µm/s²)"


def _level_codes(data: Any, speed: int, sensor: int) -> tuple[str, ...]:
    """Codes of the findings that concern the level of a sensor at a speed, by their numbers."""
    missing = ("W-EXCITATION",) if data.attrs["missing"] else ()
    change = float(data["level_change"].values[speed, sensor]) if "level_change" in data else math.nan
    return *missing, *(() if math.isnan(change) else doubtful_excitation(change)), *OF_BOX_RESPONSE


def _judged(data: Any) -> list[int]:
    """Numbers of the sensors in the verdict, the loudest first."""
    return np.argsort(-data["level"].values.max(axis=0), kind="stable")[:SENSORS_JUDGED].tolist()


def _heard(data: Any, modes: Any, marks: Marks) -> Iterator[tuple[str, str]]:
    """Rows of the response at the speed of the load case: levels, main lines, ways, and forces of the meshes."""
    speed = float(data["speed"].values[0])
    for sensor in _judged(data) if "level" in data else ():
        name, whole = data["sensor"].values[sensor], float(data["level"].values[0, sensor])
        text = marks(level_text(whole), *_level_codes(data, 0, sensor), of=("dynamics",))
        yield f"level at {name}", f"{text} at {speed:,.5g} rpm"
        if whole > 0.0 and "lines_real" in data:
            yield f"main line at {name}", _main_line(data, sensor, whole, modes)
        if whole > 0.0 and "path_share" in data:
            yield f"most of it at {name} comes by", main_way(data, sensor)
    yield from _forces(data, "largest mesh force over its mean", marks, "dynamics")


def _main_line(data: Any, sensor: int, whole: float, modes: Any) -> str:
    """Write the largest line at a sensor with its origin, its share, and the mode that is nearest."""
    size = np.hypot(data["lines_real"].values[0, sensor], data["lines_imag"].values[0, sensor])
    line = int(size.argmax())
    hertz = float(data["order"].values[line]) * float(data["speed"].values[0]) / 60.0
    text = f"{hertz:,.1f} Hz, {line_origin(data, line)}: {percent(0.5 * (size[line] / whole) ** 2)} of the power"
    mode = "" if modes is None else near_mode(modes, hertz)
    return f"{text}; {mode}" if mode else text


def _forces(data: Any, name: str, marks: Marks, stage: str) -> Iterator[tuple[str, str]]:
    factor = data["dynamic_factor"].values
    if not np.isfinite(factor).any():
        return
    speed, number, _ = np.unravel_index(int(np.nanargmax(factor)), factor.shape)
    text = marks(f"{np.nanmax(factor):.3f}", "W-EXCITATION", *OF_BOX_RESPONSE, of=(stage,))
    yield name, f"{text}, {data['stage'].values[number]} at {float(data['speed'].values[speed]):,.5g} rpm"


def _over_speeds(data: Any, marks: Marks) -> Iterator[tuple[str, str]]:
    """Rows of the run-up: where it is loudest, and its largest mesh force."""
    for sensor in _judged(data) if "level" in data else ():
        level = data["level"].values[:, sensor]
        at = int(level.argmax())
        parts = data["level_of_stage"].values[at, sensor]
        text = marks(level_text(float(level[at])), *_level_codes(data, at, sensor), of=("runup",))
        speed, stage = float(data["speed"].values[at]), data["stage"].values[int(parts.argmax())]
        yield f"loudest of the run-up at {data['sensor'].values[sensor]}", f"{text} at {speed:,.5g} rpm, by {stage}"
    yield from _forces(data, "largest mesh force over its mean, run-up", marks, "runup")
