"""Life of the roots and flanks of a case over its load cases, ISO 6336-6.

The contact of every load case is solved: sharing of the planets and K_Hbeta depend on the load, and no stress is scaled
from one load case to another. K_v and K_Halpha are those of part 1 at the speed of the load case, where the case gives
a flank tolerance class; a computed K_v belongs to the operating speeds, not to load cases.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.dependencies import Steps, check_entries, compliance_entries, static_entries
from femgear.case.gear_set import planetary_set
from femgear.case.load_spectrum import (
    has_rated_bearings,
    load_case_names,
    required_life,
    running_shares,
    without_line,
)
from femgear.contact.mesh_cycle import MeshCycle
from femgear.errors import LESS_TORQUE, FemgearError
from femgear.gears.kinematics import speeds
from femgear.gears.pair import BRANCH
from femgear.report.tables import Block
from femgear.stages.life_results import describe_damage, describe_life, life_findings
from femgear.stages.planet_bearings import (
    PlanetBearings,
    describe_planet_bearings,
    planet_bearing_findings,
    planet_bearing_variables,
    planet_bearings,
)
from femgear.stages.protocol import Progress, Stage, StageResult, one_blas_thread, silent
from femgear.stages.static import solve_static
from femgear.stages.static_results import StaticResult
from femgear.stages.strength import rate_case
from femgear.stages.strength_results import missing_of_all
from femgear.stages.tooth_spectra import (
    RatedLoad,
    RatedSpectrum,
    rated_spectra,
    tooth_life_coordinates,
    tooth_life_variables,
)
from femgear.storage.contents import Contents

if TYPE_CHECKING:
    from femgear.findings import Finding

_NO_LIVES = "no load case loads teeth that ISO 6336 covers"


@dataclass(frozen=True, eq=False)
class LifeResult(StageResult):
    """Lives of the teeth of a set or a pair over its load cases.

    Parameters
    ----------
    names : tuple of str
        Of the load cases.
    loads : tuple of RatedLoad
        Their ratings.
    speed : (c,) array
        Speeds of the input [rad/s].
    spectra : tuple of RatedSpectrum
        Of all roots and flanks that have a line of life.
    required : float or None
        Life that the case asks for [h].
    residuals : (c,) array
        Largest violation of contact conditions and equilibrium, relative, NaN without load.
    bearings : PlanetBearings or None
        Those of the planets, where they have a rating.
    """

    names: tuple[str, ...]
    loads: tuple[RatedLoad, ...]
    speed: np.ndarray
    spectra: tuple[RatedSpectrum, ...]
    required: float | None
    residuals: np.ndarray = field(default_factory=lambda: np.zeros(0))
    bearings: PlanetBearings | None = None

    @property
    def residual(self) -> float:
        """Largest violation of contact conditions and equilibrium of all load cases."""
        return float(np.nanmax(self.residuals, initial=0.0))

    @property
    def message(self) -> str:
        """How lives were found."""
        return "contact of every load case; damages add (ISO 6336-6)"

    @staticmethod
    def warnings(data: Any) -> Iterable[Finding]:
        """List what life.nc says against itself."""
        return (*life_findings(data), *planet_bearing_findings(data))

    def contents(self) -> Contents:
        """Collect the contents of life.nc."""
        kinds = len(next((load.rating.factors.face for load in self.loads if load.rating is not None), ()))
        factors = {
            name: [
                np.full(kinds, np.nan) if load.rating is None else getattr(load.rating.factors, name)
                for load in self.loads
            ]
            for name in ("sharing", "face", "dynamic")
        }
        at, of_kind = "load_case", "load_case kind"
        variables = {
            "share": (at, [load.share for load in self.loads], "1", "share of the running time"),
            "torque": (at, [load.torque for load in self.loads], "N m", "torque on the sun or gear 1"),
            "speed": (at, self.speed * 30.0 / math.pi, "rpm", "speed of the input"),
            "mesh_frequency": (at, [abs(load.mesh_frequency) for load in self.loads], "Hz", "mesh frequency"),
            "planet_load_factor": (of_kind, factors["sharing"], "1", "K_gamma of the contact; NaN without load"),
            "face_load_factor": (of_kind, factors["face"], "1", "K_Hbeta of the contact, or 1; NaN without load"),
            "iso_dynamic_factor": (of_kind, factors["dynamic"], "1", "K_v of part 1, or 1; NaN without load"),
            **tooth_life_variables(self.spectra, self.required),
        }
        coords: dict[str, Any] = {"load_case": ((at,), list(self.names), "1", "load case")}
        coords["kind"] = (("kind",), np.arange(1, kinds + 1), "1", "number of the kind of mesh")
        attrs: dict[str, Any] = {"title": "life of the teeth over load cases"}
        attrs |= {} if self.required is None else {"required_hours": self.required}
        attrs["iso_missing"] = " ".join(missing_of_all(load.rating for load in self.loads))
        lives, planets = planet_bearing_variables([self.bearings] if self.bearings else [])
        return Contents(variables | lives, coords | tooth_life_coordinates(self.spectra) | planets, attrs)


def static_load_factors(static: StaticResult) -> dict[str, np.ndarray | None]:
    """Find K_gamma and K_Hbeta (k,) of all kinds of mesh of a static solution; None of what it has not.

    K_gamma is the largest mean share of a planet over the equal one.
    """
    gears, cycle = static.planetary_set, static.cycle
    kinds, planets = len(gears.kinds), gears.n_planets
    share = float(cycle.load_share.mean(axis=1).max()) * planets
    face = cycle.face_load_factor
    return {
        "sharing": np.full(kinds, share) if planets > 1 else None,
        "face": None if face is None else face.reshape(kinds, -1).max(axis=1),
    }


@one_blas_thread()
def solve_life(
    case: Any,
    static: StaticResult,
    *,
    contact: Callable[..., StaticResult] = solve_static,
    cache: Path | None = None,
    progress: Progress = silent,
    steps: Steps | None = None,
) -> LifeResult:
    """Solve for the lives of all roots and flanks over the load cases of a case.

    Parameters
    ----------
    case : case of a set or a pair
        With load cases.
    static : StaticResult
        Its static solution, whose grids and compliances are those of all load cases.
    contact : callable
        The train's `solve_static`.
    cache, progress, steps
        As for it.

    Raises
    ------
    FemgearError
        A load that the contact cannot carry, with the load case.
    """
    check_entries(static, StaticResult, static_entries(case), "static solution")
    steps, load_cases = steps or Steps(), case.operation.load_case
    steps.keep("flank compliances", compliance_entries(case), (static.sectors, static.bodies))
    names, shares = load_case_names(load_cases), running_shares(load_cases)
    loads, residuals, cycles = list[RatedLoad](), list[float](), list[MeshCycle | None]()
    for number, (load_case, share) in enumerate(zip(load_cases, shares.tolist(), strict=True)):
        progress("life", float(number), float(len(load_cases)))
        loaded = with_torque(case, load_case.torque)
        torque, frequency = float(loaded.torque_on_first_gear()), mesh_frequency_at(case, load_case.speed)
        rating, residual, cycle = None, math.nan, None
        if load_case.torque != 0.0:
            same = load_case.torque == case.operation.torque
            state = static if same else _state(loaded, number, names[number], contact, cache, steps)
            computed: dict[str, Any] = static_load_factors(state)
            rating = rate_case(loaded, torque=torque, frequencies=(frequency,), **computed)
            residual, cycle = state.residual, state.cycle
        cycles.append(cycle)
        loads.append(RatedLoad(rating, torque, frequency, share))
        residuals.append(residual)
    spectra = rated_spectra(case, loads)
    speed = np.array([load_case.speed for load_case in load_cases])
    required = required_life(case.operation)
    bearings = planet_bearings(
        case,
        planetary_set(case),
        cycles,
        carrier_speed=[carrier_speed_at(case, load_case.speed) for load_case in load_cases],
        mesh_frequency=[load.mesh_frequency for load in loads],
        shares=shares,
    )
    return LifeResult(tuple(names), tuple(loads), speed, spectra, required, np.array(residuals), bearings)


def with_torque(case: Any, torque: float) -> Any:
    """Give a case another torque of its operation [N m], without stresses of its own."""
    operation = case.operation.model_copy(update={"torque": torque})
    static = case.static.model_copy(update={"stresses": False})
    return case.model_copy(update={"operation": operation, "static": static})


def _state(
    loaded: Any, number: int, name: str, contact: Callable[..., StaticResult], cache: Path | None, steps: Steps
) -> StaticResult:
    """Static solution of a load case; a refusal of its torque names the load case."""
    try:
        return contact(loaded, cache=cache, steps=steps)
    except FemgearError as error:
        entry = f"operation.load_case[{number}].torque"
        if error.key == "operation.torque":
            error.key = entry
            error.file = loaded.location(error.key)
        error.remedies = tuple(f"reduce {entry}" if text == LESS_TORQUE else text for text in error.remedies)
        error.message = f"{name} with {loaded.operation.torque:.6g} N m: {error.message}"
        raise


def mesh_frequency_at(case: Any, speed: float) -> float:
    """Compute the mesh frequency of a case [Hz] at a speed of its input [rad/s]."""
    gears, operation = planetary_set(case), case.operation
    if not gears.repeated[BRANCH]:
        return speed * gears.gears[0].teeth / (2.0 * math.pi)
    return abs(speeds(gears, input=operation.input, fixed=operation.fixed, speed=speed).mesh_frequency)


def carrier_speed_at(case: Any, speed: float) -> float:
    """Compute the speed of the carrier of a case at a speed of its input [rad/s]; zero of a pair."""
    gears, operation = planetary_set(case), case.operation
    if not gears.repeated[BRANCH]:
        return 0.0
    return speeds(gears, input=operation.input, fixed=operation.fixed, speed=speed).carrier


def no_load_cases(case: Any) -> str:
    """Say why a case has no stage of lives; empty where it has."""
    if not case.operation.load_case:
        return "operation gives no load cases"
    if len(without_line(case)) < len(case.gear_names) or has_rated_bearings(case):
        return ""
    return "no material has a treatment"


LIFE = Stage(
    name="life",
    title="Life",
    solve=solve_life,
    takes=("static",),
    options=("cache", "progress", "steps"),
    verdict=lambda result: {"load_cases": len(result.loads), "roots_and_flanks": len(result.spectra)},
    describe=lambda results: next(describe_life(results.life), Block("Life of the teeth", notes=(_NO_LIVES,))),
    tables=lambda results: (*describe_damage(results.life), *describe_planet_bearings(results.life)),
    warnings=LifeResult.warnings,
    unavailable=no_load_cases,
)
