"""Shafts that float in the play of their bearings, and planets beyond the play of their teeth.

A bearing with clearance holds what its loaded elements hold, one of a single axial sense what thrust presses into it.
Where neither load nor weight nor preload presses a shaft into its bearings, nothing holds it there, and its modes are
rigid ones. Meshes count with their whole stiffness.

Springs of meshes press on one side. Errors that take planets off a mesh by more than its play press the other side.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from femgear.findings import Finding, percent
from femgear.trains.gearbox.case_file import PairSection, named_load_case
from femgear.trains.gearbox.casing import called
from femgear.trains.gearbox.deflection import LEVERS, Deflection, laws_of, spread_rows
from femgear.trains.gearbox.model import StageModel
from femgear.trains.gearbox.nonlinear import normal_backlash
from femgear.trains.gearbox.planet_branches import running_sets
from femgear.trains.gearbox.planet_errors import error_gaps

if TYPE_CHECKING:
    import xarray as xr

# Eigenvalue over the largest one below which a motion has no stiffness, and motions that are none over the largest.
_FREE, _STILL = 1e-10, 1e-3
# Mesh force over the largest one of its set up to which it is none.
_NONE = 1e-9
_WAYS = {"across": (0, 1), "along z": (2,), "against tilting": (3, 4)}
_MOST_NAMED = 12


def slack_bearings(state: Deflection) -> np.ndarray:
    """Find the motions of bearings that they hold under load and leave free at this state.

    Returns
    -------
    (b, 6) bool array
        By bearing and motion of the inner ring against the outer one; a bearing counts where its shaft moves freely.
    """
    slack = np.zeros((len(state.states), 6), bool)
    laws = laws_of(state.model, state.model.estimate)
    if not any(_yields(law.held, state.bearing_stiffness[number]) for number, law, _ in laws):
        return slack
    free = unheld_motions(state)
    for number, law, springs in laws:
        moved = np.abs(spread_rows(springs, state.model.assembly) @ free) * np.array(LEVERS)[:, None]
        slack[number] = (law.held > 0.0) & (moved.max(axis=1, initial=0.0) > _STILL)
    return slack


def _yields(held: np.ndarray, stiffness: np.ndarray) -> bool:
    """Whether a bearing lacks stiffness in motions that it holds under load."""
    ways = np.flatnonzero(held[:3] > 0.0)
    values = np.linalg.eigvalsh(stiffness[np.ix_(ways, ways)])
    return bool(values[0] <= _FREE * max(values[-1], 1.0))


def unheld_motions(state: Deflection) -> np.ndarray:
    """Find the motions that nothing holds at a loaded state, but for the rotations that are given.

    Returns
    -------
    (6n, f) array
        Motions of all stations, each of a size of 1 m, or of 20 rad.
    """
    assembly, model = state.model.assembly, state.model
    held = assembly.held.copy()
    held[model.turns] = True
    T = replace(assembly, held=held).motions
    tangent = assembly.stiffness + (assembly.columns * assembly.slice_stiffness) @ assembly.columns.T
    for number, law, springs in laws_of(model, model.estimate):
        rows = spread_rows(springs, assembly)
        tangent = tangent + rows.T @ law.share(state.bearing_stiffness[number]) @ rows
    reduced = T.T @ tangent @ T
    size = np.sqrt(np.abs(np.diag(reduced)))
    size[size == 0.0] = size.max(initial=1.0)
    values, vectors = np.linalg.eigh(reduced / np.outer(size, size))
    free = T @ (vectors[:, values < _FREE * values.max(initial=0.0)] / size[:, None])
    levers = np.tile(LEVERS, len(assembly.names))
    return free / np.abs(free * levers[:, None]).max(axis=0, initial=0.0)


def play_findings(data: xr.Dataset) -> Iterator[Finding]:
    """Name bearings that carry nothing and hold nothing, with what is free in them (W-PLAY).

    ``data`` is that of deflection.nc; every load case has a finding of its own.
    """
    for number, name in enumerate(data["load_case"].values):
        slack = data["slack"].values[number] > 0
        loose = np.flatnonzero(slack.any(axis=1))
        if not len(loose):
            continue
        names = [str(data["bearing"].values[place]) for place in loose]
        ways = [words for words, places in _WAYS.items() if slack[:, places].any()]
        more = f" and {len(names) - _MOST_NAMED} more" if len(names) > _MOST_NAMED else ""
        text = (
            f"bearing{'s' * (len(names) > 1)} {', '.join(names[:_MOST_NAMED])}{more}: nothing presses the shaft into "
            f"the play, which leaves it free {' and '.join(ways)} in {named_load_case(str(name))}; modes of "
            "that are at 0 Hz"
        )
        remedy = "give weight ([gravity]), preload or less clearance, or a load that presses"
        yield Finding("W-PLAY", "bearing", text, remedy=remedy)


def loose_notes(data: xr.Dataset) -> Iterator[str]:
    """Say what bearings with play carry in a motion, over all stages of it; ``data`` is that of balance.nc."""
    largest, lowest = data["bearing_largest"].values.max(axis=0), data["bearing_lowest"].values.min(axis=0)
    for name, high, low, loose in zip(
        data["bearing"].values, largest, lowest, data["bearing_loose"].values.max(axis=0), strict=True
    ):
        force = f"{low:.5g} N to {high:.5g} N" if high else "nothing"
        yield f"{called('bearing', name)} carries {force}" + (
            f", {percent(loose, 1)} of the time nothing" if 0.0 < loose < 1.0 else ""
        )


def beyond_play(state: Deflection) -> np.ndarray:
    """Find how far errors take branches of planets that carry nothing beyond the play of their teeth [m].

    The flanks of such a branch stand apart, and its planets turn freely between both flanks: with the mesh forces F of
    the other branches, in balance on all its planets, the way left is the sum of F times opening less play, over the
    largest F. Above zero its teeth would press on their back flanks, which no force of the state knows.

    Returns
    -------
    (stages,) array
        Of the pairs of such branches, negative within their play; NaN of all others, and where play is not known.
    """
    model, force, beyond = state.model, state.mesh_force, np.full(len(state.model.stages), np.nan)
    places = {stage.name: place for place, stage in enumerate(model.stages)}
    gap = error_gaps(model) - model.assembly.columns.T @ state.motion
    opening = np.array([gap[part].mean() for part in model.assembly.slices])
    for running in running_sets(model.case):
        pairs = np.array([[places[name] for name in names] for names in running.kinds])
        meshes = np.array([stage.meshes[0] for stage in model.stages])[pairs]
        play = np.array([[_play_of_teeth(model.stages[place]) for place in row] for row in pairs])
        idle = (force[meshes] <= _NONE * force[meshes].max()).all(axis=0)
        if not idle.any() or idle.all() or np.isnan(play).any():
            continue
        of_others = force[meshes][:, ~idle].mean(axis=1)
        for branch in np.flatnonzero(idle):
            beyond[pairs[:, branch]] = of_others @ (opening[meshes] - play)[:, branch] / of_others.max()
    return beyond


def _play_of_teeth(stage: StageModel) -> float:
    """Play of the mesh of a pair along its normal [m]; NaN where it is not known."""
    section = stage.section
    assert isinstance(section, PairSection)
    has_play = section.teeth is not None or (section.mesh is not None and section.mesh.backlash is not None)
    return float(normal_backlash(stage)[0]) if has_play else math.nan
