"""Friction of the teeth as a load that excites: from the loaded state to the sources of the mechanical system.

The loaded state holds friction forces and their moments about the pitch points, with the mean loads
(`femgear.contact.flank_friction`). They act on the bodies along `femgear.system.assembly.Assembly.sliding_columns`,
whatever the bodies do: friction does not follow the forces of the motion. Forces of the meshes are those of the same
state, so that a set at rest under both is in equilibrium.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from femgear.contact.mapped_cycle import FRICTION
from femgear.report.tables import Marks, chosen

if TYPE_CHECKING:
    from femgear.contact.loaded_period import LoadedPeriod
    from femgear.storage.results import Results
    from femgear.system.system import MeshExcitation, Modes


def friction_source(state: LoadedPeriod, count: int) -> np.ndarray | None:
    """Loads (2M + 1, count) of the friction of all meshes on the motions, and zeros for what takes its mean.

    Along the columns of `femgear.system.assembly.Assembly.sliding_columns` [N, N m]; None without friction.
    """
    loads = friction_on_meshes(state, count)
    return None if loads is None else np.concatenate([loads, np.zeros((1, count))])


def friction_on_meshes(state: LoadedPeriod, count: int) -> np.ndarray | None:
    """Loads (2M, count) of `friction_source` without what takes its mean."""
    if state.friction_force is None:
        return None
    return -np.concatenate([state.resampled(name, count) for name in FRICTION])


def balanced_source(excitation: MeshExcitation, modes: Modes) -> MeshExcitation:
    """Let the last source take what friction loses of the mean power, which moves the set as a rigid body else."""
    if excitation.source is None or modes.source_load is None:
        return excitation
    rigid, source = modes.source_load[modes.frequency == 0.0], np.array(excitation.source)
    if len(rigid):
        source[-1] = -np.linalg.lstsq(rigid[:, -1:], rigid[:, :-1] @ source[:-1].mean(axis=1), rcond=None)[0]
    return replace(excitation, source=source)


def friction_rows(results: Results, marks: Marks) -> list[tuple[str, str]]:
    """Write what friction adds to a level at some speeds of a run, for the verdict; none where it does not act."""
    if "dynamics" not in results.stages or "friction_change" not in results.dynamics:
        return []
    change = results.dynamics["friction_change"]
    largest = change.max(dim=[dim for dim in change.dims if dim != "speed"])
    shown = [
        f"{marks(f'{float(largest[i]):+.1f} dB', 'W-FRICTION')} at {float(largest.speed[i]):g} rpm"
        for i in chosen(len(largest))
    ]
    return [(str(change.attrs["long_name"]), ", ".join(shown))]
