"""Contact of the teeth of a stage under the load and the misalignment that the gearbox gives it."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from femgear.case import text as case_text
from femgear.case.dependencies import Steps
from femgear.case.gear_set import planetary_set, set_deviations
from femgear.gears.deviations import SetDeviations, misaligned_approach, no_deviations
from femgear.gears.pair import GearSet
from femgear.gears.profile import base_helix_angle
from femgear.stages.static import solve_static
from femgear.stages.static_results import StaticResult
from femgear.trains.gearbox.case_file import BoxPlanetarySection, PairSection, stage_case_of


@dataclass(frozen=True)
class StageContact:
    """Contact of the teeth of a stage over one mesh period.

    Parameters
    ----------
    result : StaticResult
        Transmission error, load sharing and mesh stiffness.
    stiffness : (M,) array
        Mean stiffness of every mesh along the tooth normals [N/m].
    normal_force : (M,) array
        Mean force of every mesh along its normal [N].
    shares : (M, S) array
        Mean load of equal slices of the width over that of the whole mesh [1].
    """

    result: StaticResult
    stiffness: np.ndarray
    normal_force: np.ndarray
    shares: np.ndarray

    @property
    def face_load_factor(self) -> np.ndarray:
        """K_Hbeta (M,) of every mesh; 1 without slices."""
        factor = self.result.cycle.face_load_factor
        return np.ones(len(self.stiffness)) if factor is None else factor

    def shares_at(self, mesh: int, count: int) -> np.ndarray:
        """Shares (count,) of the load of a mesh in so many equal slices."""
        own = self.shares[mesh]
        if count == len(own):
            return own
        edges = np.linspace(0.0, 1.0, count + 1)
        sums = np.interp(edges, np.linspace(0.0, 1.0, len(own) + 1), np.append(0.0, np.cumsum(own)))
        return np.diff(sums)


def stage_contact(
    stage: PairSection | BoxPlanetarySection,
    torque: float,
    slopes: np.ndarray,
    *,
    slices: int,
    positions: int | None = None,
    steps: Steps | None = None,
) -> StageContact:
    """Solve the contact of the teeth of a stage.

    Parameters
    ----------
    stage : PairSection or BoxPlanetarySection
        With the tables of its teeth.
    torque : float
        On gear 1, or the sun [N m]; positive where it pushes counter-clockwise.
    slopes : (M,) array
        Slope of the approach of the flanks of every mesh along its width [rad], closer at z > 0 positive; along the
        normal.
    slices : int
        Least number of slices over the width.
    positions : int, optional
        Most positions over the mesh period; by default those of the teeth.
    steps : Steps, optional
        Compliances that other contacts of the stage have left.
    """
    case = stage_case_of(case_text.write(loaded_tables(stage, torque, slices, positions)))
    cosine = math.cos(base_helix_angle(case.pressure_angle, case.helix_angle or 0.0))
    # along the normal the force is 1/cos(beta_b) of that in the transverse section, the approach cos(beta_b) of it
    deviations = askew(set_deviations(case), planetary_set(case), slopes / cosine, back=torque < 0.0)
    found = solve_static(case, steps=steps or Steps(), deviations=deviations)
    cycle = found.cycle
    shares = np.ones((len(slopes), 1))
    if cycle.slice_load is not None:
        load = cycle.slice_load.sum(axis=1).mean(axis=-1)
        shares = load / load.sum(axis=1, keepdims=True)
    force = np.abs(cycle.force).mean(axis=1) / cosine
    return StageContact(found, cycle.stiffness.mean(axis=1) / cosine**2, force, shares)


def askew(deviations: SetDeviations, gears: GearSet, slopes: np.ndarray, *, back: bool = False) -> SetDeviations:
    """Add the slopes (M,) of the approach of all meshes [rad] to deviations, as slopes of the planets' axes.

    Both slopes of the axis of a planet give its meshes with sun and ring any slopes; the only mesh of a pair takes
    the smallest slope of the axis of gear 2. With ``back`` the slopes are those of the flanks that a negative torque
    presses.
    """
    ideal, count = no_deviations(gears), gears.n_planets
    leaning = [replace(ideal, planet_misalignment=np.tile(axis, (count, 1))) for axis in np.eye(2)]
    unit = np.array([misaligned_approach(one, gears, back=back) for one in leaning])
    per_planet = unit.reshape(2, -1, count), slopes.reshape(-1, count)
    axes = np.array([np.linalg.pinv(per_planet[0][:, :, n].T) @ per_planet[1][:, n] for n in range(count)])
    return replace(deviations, planet_misalignment=deviations.planet_misalignment + axes)


def loaded_tables(
    stage: PairSection | BoxPlanetarySection, torque: float, slices: int, positions: int | None = None
) -> dict[str, Any]:
    """Make the tables of the teeth of a stage with its load, slices, and at most so many positions."""
    tables = copy.deepcopy(stage.teeth or {})
    operation, static = tables.setdefault("operation", {}), tables.setdefault("static", {})
    operation["torque"] = f"{torque:.15g} N m"
    if isinstance(stage, BoxPlanetarySection):
        operation["input"], operation["fixed"] = "sun", "ring"
    if slices > 1:
        static["slices"] = max(int(static.get("slices", 0)), slices)
    if positions is not None:
        static["positions"] = min(int(static.get("positions", positions)), positions)
    static["stresses"] = False
    return tables
