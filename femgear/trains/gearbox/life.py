"""Lives of the bearings of a gearbox in every load case, and over all of them.

Shares of load cases are those of the running time, and lives hours of it. Damages add (A. Palmgren, M. A. Miner):
1/L = sum q_i / L_i in hours, with the share q_i and the life L_i of load case i. Of L10 that is the life under the
equivalent load P = (sum q_i n_i P_i^p / sum q_i n_i)^(1/p) of ISO 281.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.findings import Finding, percent
from femgear.report.tables import Block, Marks, tabulate
from femgear.system.bearing_life import (
    basic_rating_life,
    life_exponent,
    life_factor,
    reference_load,
    reference_rating_life,
)
from femgear.trains.gearbox.case_file import CASING
from femgear.trains.gearbox.deflection import Deflection
from femgear.trains.gearbox.geometry import rolling_bearing

if TYPE_CHECKING:
    import xarray as xr

KINDS = {"rating_life": "L10 of ISO 281", "reference_life": "L10r of ISO/TS 16281", "modified_life": "a_ISO L10r"}
"""Lives of a bearing by their names in deflection.nc."""
_MOST_CASES = 40  # rows of load cases in a table


@dataclass(frozen=True)
class SpectrumLives:
    """Lives of all bearings over the load cases.

    Parameters
    ----------
    hours : (b, 3) array
        Of the kinds `KINDS` [h]; NaN where entries are missing, infinite without load.
    damage : (c, b) array
        Share of every load case in the damage by L10r, or by L10 where there is none [1]; NaN without both.
    load : (b,) array
        Equivalent load of ISO 281 over all load cases [N].
    """

    hours: np.ndarray
    damage: np.ndarray
    load: np.ndarray


def bearing_lives(deflection: Deflection) -> np.ndarray:
    """Compute the lives (b, 3) of all bearings in hours at one load case: L10, L10r, and a_ISO L10r.

    NaN without geometry and dynamic rating, of the last also without fatigue limit, viscosity ratio and
    contamination; infinite without load or at rest.
    """
    lives = np.full((len(deflection.states), 3), np.nan)
    for number, (section, state) in enumerate(zip(deflection.model.case.bearing, deflection.states, strict=True)):
        if state is None or (rating := section.dynamic_rating) is None:
            continue
        force, turns = deflection.bearing_force[number], turning_speed(deflection, number)
        hours = 1e6 / 3600.0 / turns if turns else math.inf
        basic = basic_rating_life(state.bearing, math.hypot(force[0], force[1]), abs(float(force[2])), rating)
        reference = reference_rating_life(state, rating)
        lives[number, :2] = basic * hours, reference * hours
        viscosity, contamination, limit = section.viscosity_ratio, section.contamination, section.fatigue_limit
        if viscosity is not None and contamination is not None and limit is not None:
            load = reference_load(state.bearing, reference, rating)
            factor = life_factor(state.bearing, viscosity, contamination, limit / load if load else math.inf)
            lives[number, 2] = factor * reference * hours
    return lives


def turning_speed(state: Deflection, number: int) -> float:
    """Speed of the rings of a bearing relative to each other [turns/s]."""
    section, speed = state.model.case.bearing[number], state.model.flow.speed
    return abs(speed[section.shaft] - speed[section.outer_shaft or CASING]) / (2.0 * math.pi)


def added_damage(hours: np.ndarray, shares: Sequence[float] | np.ndarray) -> np.ndarray:
    """Compute the lives over load cases (c, ...) [h] with their shares of the time (c,): ``1/L = sum q_i / L_i``."""
    damage = np.tensordot(np.asarray(shares, float), 1.0 / np.asarray(hours, float), axes=1)
    with np.errstate(divide="ignore"):
        return 1.0 / damage


def spectrum_lives(states: Sequence[Deflection], shares: Sequence[float] | np.ndarray) -> SpectrumLives:
    """Compute the lives of all bearings over load cases with their shares (load cases,) of the time."""
    q, case = np.asarray(shares, float), states[0].model.case
    lives = np.array([bearing_lives(state) for state in states]).reshape(len(states), -1, 3)
    hours = added_damage(lives, q)
    deciding = np.where(np.isfinite(lives[..., 1]) | np.isinf(lives[..., 1]), lives[..., 1], lives[..., 0])
    damage = q[:, None] / deciding
    total = damage.sum(axis=0)
    damage = np.where(total > 0.0, np.divide(damage, total, out=np.zeros_like(damage), where=total > 0.0), damage)
    load = np.full(len(case.bearing), np.nan)
    for number, section in enumerate(case.bearing):
        if section.kind is None or section.dynamic_rating is None:
            continue
        turns = float(q @ [turning_speed(state, number) for state in states])
        millions = hours[number, 0] * 3600.0 * turns / 1e6
        exponent = life_exponent(rolling_bearing(section))
        load[number] = 0.0 if math.isinf(hours[number, 0]) else section.dynamic_rating * millions ** (-1.0 / exponent)
    return SpectrumLives(hours, damage, load)


def life_variables(states: Sequence[Deflection], shares: Sequence[float] | np.ndarray) -> dict[str, tuple]:
    """Make the variables of deflection.nc on the lives of bearings; shares (n_cases,) of the time [1]."""
    lives = np.array([bearing_lives(state) for state in states]).reshape(len(states), -1, 3)
    over = spectrum_lives(states, shares)
    at, every = "load_case bearing", "over all load cases"
    return {
        "rating_life": (at, lives[..., 0], "h", "L10 of ISO 281 at the speed of the load case"),
        "reference_life": (at, lives[..., 1], "h", "L10r of ISO/TS 16281"),
        "modified_life": (at, lives[..., 2], "h", "a_ISO L10r of ISO 281; NaN without lubrication and C_u"),
        "spectrum_rating_life": ("bearing", over.hours[:, 0], "h", f"L10 {every}, by their shares of the time"),
        "spectrum_reference_life": ("bearing", over.hours[:, 1], "h", f"L10r {every}"),
        "spectrum_modified_life": ("bearing", over.hours[:, 2], "h", f"a_ISO L10r {every}"),
        "equivalent_load": ("bearing", over.load, "N", f"equivalent dynamic load of ISO 281 {every}"),
        "damage_share": (at, over.damage, "1", "share of the load case in the damage of the bearing"),
    }


def life_text(hours: Any, how: str = ".4g") -> str:
    """Write a life [h]."""
    value = float(hours)
    return "-" if math.isnan(value) else "no load" if math.isinf(value) else format(value, how)


def shortest_life(data: xr.Dataset, marks: Marks | None = None) -> Iterator[tuple[str, str]]:
    """Rows of a verdict: the bearings that fail first over all load cases, and which load case damages them most."""
    cases = [str(case) for case in data["load_case"].values]
    for name, words in (("reference_life", "L10r"), ("modified_life", "a_ISO L10r")):
        life = data[f"spectrum_{name}"].values
        if not np.isfinite(life).any():
            continue
        at = int(np.nanargmin(life))
        hours = f"{life_text(life[at])} h"
        short = life[at] < float(data.attrs.get("required_hours", 0.0))
        hours = marks(hours, "W-LIFE", of=("deflection",)) if marks is not None and short else hours
        text = f"{hours}, {data['bearing'].values[at]}"
        if len(cases) > 1:
            damage = np.nan_to_num(data["damage_share"].values[:, at])
            text += f", over all load cases; {percent(damage.max())} of the damage in {cases[int(damage.argmax())]}"
        yield f"shortest bearing life {words}", text


def bearing_life_findings(data: Any) -> Iterator[Finding]:
    """List bearings whose life over all load cases ends before the one that the case asks for (W-LIFE).

    By a_ISO L10r where there is one, else by L10r.
    """
    if "required_hours" not in data.attrs or "spectrum_reference_life" not in data:
        return
    required, modified = float(data.attrs["required_hours"]), data["spectrum_modified_life"].values
    life = np.where(np.isnan(modified), data["spectrum_reference_life"].values, modified)
    short = [number for number in np.argsort(life) if life[number] < required]
    if short:
        shown = ", ".join(f"{data['bearing'].values[number]} {life_text(life[number])} h" for number in short[:5])
        text = f"bearings live shorter than the {required:g} h asked for, at 90 % reliability: {shown}"
        remedy = "larger bearings, or less torque or time in the load case that damages them most"
        yield Finding("W-LIFE", "operation.required_hours", text, remedy=remedy)


def describe_load_cases(data: xr.Dataset) -> Iterator[Block]:
    """Tabulate load cases with what decides in each, and bearings over all load cases; nothing of one load case."""
    count = data.sizes["load_case"]
    if count < 2:
        return
    names, meshes, bearings = ([str(n) for n in data[dim].values] for dim in ("load_case", "mesh", "bearing"))

    def worst(name: str, number: int, labels: list[str], how: str, factor: float = 1.0, least: bool = False) -> str:
        values = factor * data[name].values[number]
        sizes = -values if least else np.abs(values)
        if not np.isfinite(values).any():
            return "-"
        at = int(np.where(np.isfinite(values), sizes, -np.inf).argmax())
        return f"{values[at]:{how}} {labels[at]}"

    columns = {
        "load case": lambda i: names[i],
        "share": lambda i: f"{float(data['share'].values[i]):.4g}",
        "largest K_Hbeta": lambda i: worst("face_load_factor", i, meshes, ".3f"),
        "largest misalignment [um]": lambda i: worst("mesh_misalignment", i, meshes, "+.2f", 1e6),
        "shortest L10r [h]": lambda i: worst("reference_life", i, bearings, ".4g", least=True),
    }
    left = (f"the first {_MOST_CASES} of {count}; all in deflection.nc",) if count > _MOST_CASES else ()
    yield tabulate("Load cases", range(min(count, _MOST_CASES)), columns, left)
    if not np.isfinite(data["equivalent_load"].values).any():
        return
    lives = {f"{words} [h]": name for name, words in zip(KINDS, ("L10", "L10r", "a_ISO L10r"), strict=True)}

    def most(i: int) -> str:
        damage = data["damage_share"].values[:, i]
        return f"{names[int(damage.argmax())]} ({percent(damage.max())})" if np.isfinite(damage).all() else "-"

    columns = {
        "bearing": lambda i: bearings[i],
        "equivalent load [N]": lambda i: life_text(data["equivalent_load"].values[i], ".5g"),
        **{
            words: lambda i, name=name: life_text(data[f"spectrum_{name}"].values[i])
            for words, name in lives.items()
            if np.isfinite(data[f"spectrum_{name}"].values).any()
        },
        "most damage": most,
    }
    yield tabulate("Bearings over all load cases", range(len(bearings)), columns)
