"""Contact of the teeth of a stage under the load, the misalignment and the displacements that the gearbox gives it.

Of the tilts of both gears of a mesh the contact takes the slope of the approach along the width, at the pitch point.
Of helical teeth the part of it that grows along the path of contact is left out: at a place ``s`` from the pitch point
it is ``s tan(beta_b)`` over the place along the width of what is taken.
"""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from femgear.case import text as case_text
from femgear.case.dependencies import Steps
from femgear.case.gear_set import planetary_set, set_deviations
from femgear.errors import LESS_TORQUE, ContactError, FemgearError
from femgear.gears.deviations import SetDeviations, body_separation, misaligned_approach, no_deviations
from femgear.gears.pair import GearSet
from femgear.gears.profile import base_helix_angle
from femgear.stages.static import solve_static
from femgear.stages.static_results import StaticResult
from femgear.trains.gearbox.case_file import BoxPlanetarySection, GearboxCase, PairSection, stage_case_of

# Separations of planets' meshes that differ by less are rounding [m].
_ALIKE = 1e-12


@dataclass(frozen=True)
class StageContact:
    """Contact of the teeth of a stage over one mesh period.

    Parameters
    ----------
    result : StaticResult
        Transmission error, load sharing and mesh stiffness.
    stiffness : (M,) array
        Mean stiffness of every mesh along the tooth normals [N/m]; of one that carries nothing the largest of its kind.
    normal_force : (M,) array
        Mean force of every mesh along its normal [N].
    shares : (M, S) array
        Mean load of equal slices of the width over that of the whole mesh [1].
    approach : (M,) array
        Mean approach of the flanks of every mesh by all motions of their gears along the normal [m], of a mesh that
        carries nothing that at which it begins to.
    case : case of a set or a pair
        Tables of the teeth with their load.
    deviations : SetDeviations
        Of the teeth, with the misalignment and the displacements that the gearbox gives them.
    """

    result: StaticResult
    stiffness: np.ndarray
    normal_force: np.ndarray
    shares: np.ndarray
    approach: np.ndarray
    case: Any
    deviations: SetDeviations

    @property
    def face_load_factor(self) -> np.ndarray:
        """K_Hbeta (M,) of every mesh; 1 without slices."""
        factor = self.result.cycle.face_load_factor
        return np.ones(len(self.stiffness)) if factor is None else factor

    def shares_at(self, mesh: int, count: int) -> np.ndarray:
        """Shares (count,) of the load of a mesh in so many equal slices."""
        of_mesh = self.shares[mesh]
        if count == len(of_mesh):
            return of_mesh
        edges = np.linspace(0.0, 1.0, count + 1)
        sums = np.interp(edges, np.linspace(0.0, 1.0, len(of_mesh) + 1), np.append(0.0, np.cumsum(of_mesh)))
        return np.diff(sums)


def stage_contact(
    stage: PairSection | BoxPlanetarySection,
    torque: float,
    slopes: np.ndarray,
    *,
    separation: np.ndarray | None = None,
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
    separation : (M,) array, optional
        How far the system takes the flanks of every mesh apart along the normal [m]. What rotations of the gears about
        their axes take up is no matter; the rest is of sets alone, whose planets it loads unequally.
    slices : int
        Least number of slices over the width.
    positions : int, optional
        Most positions over the mesh period; by default those of the teeth.
    steps : Steps, optional
        Compliances that other contacts of the stage have left.
    """
    case = stage_case_of(case_text.write(loaded_tables(stage, torque, slices, positions)))
    cosine = math.cos(base_helix_angle(case.pressure_angle, case.helix_angle or 0.0))
    gears, back = planetary_set(case), torque < 0.0
    # along the normal the force is 1/cos(beta_b) of that in the transverse section, the approach cos(beta_b) of it
    deviations = askew(set_deviations(case), gears, slopes / cosine, back=back)
    apart = unequal_separation(np.zeros(len(slopes)) if separation is None else separation)
    deviations = displaced(deviations, gears, apart / cosine, back=back)
    static = solve_static(case, steps=steps or Steps(), deviations=deviations)
    cycle = static.cycle
    shares = np.ones((len(slopes), 1))
    if cycle.slice_load is not None:
        load = cycle.slice_load.sum(axis=1).mean(axis=-1)
        total = load.sum(axis=1, keepdims=True)
        shares = np.divide(load, total, out=np.full(load.shape, 1.0 / load.shape[1]), where=total > 0.0)
    force = np.abs(cycle.force).mean(axis=1) / cosine
    approach, stiffness = cycle.deflection.mean(axis=1), cycle.stiffness.mean(axis=1) / cosine**2
    for number in np.flatnonzero((force <= 0.0) | (stiffness <= 0.0)):
        kind = number // gears.n_planets * gears.n_planets
        stiffness[number] = stiffness[kind : kind + gears.n_planets].max()
        approach[number] = max(approach[number], _separation(deviations, gears, back=back)[number])
    return StageContact(static, stiffness, force, shares, cosine * approach - apart, case, deviations)


def _separation(deviations: SetDeviations, gears: GearSet, *, back: bool) -> np.ndarray:
    """Mean separation (M,) of the flanks of all meshes by errors of bodies [m], beyond that of the ideal set."""
    turn = np.linspace(0.0, gears.gears[-1].teeth, 4 * gears.gears[-1].teeth, endpoint=False)
    level = body_separation(no_deviations(gears), gears, 0.0, back=back)[:, 0]
    return body_separation(deviations, gears, turn, back=back).mean(axis=1) - level


def given_separation(stage: PairSection | BoxPlanetarySection, torque: float) -> np.ndarray:
    """Compute how far errors of the teeth of a stage take its meshes apart along the normal, (M,) [m]."""
    case = stage_case_of(case_text.write(loaded_tables(stage, torque, 1)))
    cosine = math.cos(base_helix_angle(case.pressure_angle, case.helix_angle or 0.0))
    apart = _separation(set_deviations(case), planetary_set(case), back=torque < 0.0)
    return cosine * unequal_separation(apart)


def unequal_separation(separation: np.ndarray) -> np.ndarray:
    """Leave of separations (M,) of meshes what rotations of the gears do not take up, (M,), none of a pair [m].

    Rotation of a planet takes from its mesh with the sun what it adds to that with the ring, rotation of the sun the
    same of all planets. What is left of both meshes of a planet is half of their sum less the mean of all planets.
    """
    if len(separation) < 2:
        return np.zeros(len(separation))
    both = 0.5 * separation.reshape(2, -1).sum(axis=0)
    left = both - both.mean()
    # equal planets stay equal, and are solved as one
    return np.tile(left if np.abs(left).max() > _ALIKE else np.zeros(len(left)), 2)


def displaced(
    deviations: SetDeviations, gears: GearSet, separation: np.ndarray, *, back: bool = False
) -> SetDeviations:
    """Add the separations (M,) of the flanks of all meshes [m] to deviations of a set, as errors of the pins.

    Both displacements of the axis of a planet give its meshes with sun and ring any separations. With ``back`` they
    are those of the flanks that a negative torque presses.
    """
    if not np.any(separation):
        return deviations
    ideal, count = no_deviations(gears), gears.n_planets
    moved = [replace(ideal, pin_errors=np.tile(way, (count, 1))) for way in np.eye(2)]
    level = body_separation(ideal, gears, 0.0, back=back)[:, 0]
    unit = np.array([body_separation(part, gears, 0.0, back=back)[:, 0] - level for part in moved])
    pins = _of_planets(unit, separation, count)
    return replace(deviations, pin_errors=deviations.pin_errors + pins)


def _of_planets(unit: np.ndarray, wanted: np.ndarray, count: int) -> np.ndarray:
    """Motions (N, 2) of the planets that give their meshes what is wanted (M,); ``unit`` (2, M) is that of each."""
    each, values = unit.reshape(2, -1, count), wanted.reshape(-1, count)
    return np.array([np.linalg.pinv(each[:, :, n].T) @ values[:, n] for n in range(count)])


def askew(deviations: SetDeviations, gears: GearSet, slopes: np.ndarray, *, back: bool = False) -> SetDeviations:
    """Add the slopes (M,) of the approach of all meshes [rad] to deviations, as slopes of the planets' axes.

    Both slopes of the axis of a planet give its meshes with sun and ring any slopes; the only mesh of a pair takes
    the smallest slope of the axis of gear 2. With ``back`` the slopes are those of the flanks that a negative torque
    presses.
    """
    ideal, count = no_deviations(gears), gears.n_planets
    leaning = [replace(ideal, planet_misalignment=np.tile(axis, (count, 1))) for axis in np.eye(2)]
    unit = np.array([misaligned_approach(lean, gears, back=back) for lean in leaning])
    axes = _of_planets(unit, slopes, count)
    return replace(deviations, planet_misalignment=deviations.planet_misalignment + axes)


def locate_contact_error(
    error: FemgearError, case: GearboxCase, stage: PairSection | BoxPlanetarySection, torque: float, width: float
) -> None:
    """Let a refusal of the contact of a stage name the stage, its load, and the entries of the gearbox.

    Torque on gear 1 or the sun [N m], common face width [m].
    """
    kind = "pair" if isinstance(stage, PairSection) else "planetary"
    where = f"{kind}[{[*getattr(case, kind)].index(stage)}].teeth"
    slices = int((stage.teeth or {}).get("static", {}).get("slices", 0))
    if error.key == "operation.torque":
        error.key = "operation.load_case"
    elif error.key == "static.slices" and slices <= case.deflection.slices:
        error.key = "deflection.slices"
    else:
        error.key = f"{where}.{error.key}" if error.key else where
    line = f", {1e-3 * abs(torque) / width:.4g} N m per mm of its width" if width else ""
    error.message = f"stage {stage.name} with {torque:.6g} N m{line}: {error.message}"
    less = "less torque in the load case"
    remedies = [less if remedy == LESS_TORQUE else remedy for remedy in error.remedies]
    if error.code != "E-SLICES" and isinstance(error, ContactError) and less not in remedies:
        remedies = [less, *remedies]
    error.remedies = tuple(remedies)
    error.file = error.file or case.location(error.key)


def loaded_tables(
    stage: PairSection | BoxPlanetarySection, torque: float, slices: int, positions: int | None = None
) -> dict[str, Any]:
    """Make the tables of the teeth of a stage with its load, slices, and at most so many positions.

    What holds the gears is left out: shafts and bearings of the gearbox do.
    """
    tables = {name: table for name, table in copy.deepcopy(stage.teeth or {}).items() if name != "losses"}
    operation, static = tables.setdefault("operation", {}), tables.setdefault("static", {})
    operation["torque"] = f"{torque:.15g} N m"
    if isinstance(stage, BoxPlanetarySection):
        operation["input"], operation["fixed"] = "sun", "ring"
    if slices > 1:
        static["slices"] = max(int(static.get("slices", 0)), slices)
    if positions is not None:
        static["positions"] = min(int(static.get("positions", positions)), positions)
        # so few positions carry no excitation, which is not computed from them
        tables["dynamics"] = {"mesh_harmonics": 1}
    static["stresses"] = False
    static.pop("members", None)
    for gear in ("sun", "planet", "carrier"):
        if isinstance(tables.get(gear), dict):
            tables[gear].pop("tilt_stiffness", None)
    return tables
