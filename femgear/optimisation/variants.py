"""Stages of many variants of one case: grids, compliances and the ring are computed once and used again."""

from __future__ import annotations

import json
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear import analysis
from femgear.analysis_checks import check_dynamic_case, check_motions, check_rim_speed
from femgear.case import Case, planetary_set, set_deviations, with_value
from femgear.casefile.units import SPEED
from femgear.dependencies import static_entries
from femgear.errors import CaseError
from femgear.threads import one_blas_thread

if TYPE_CHECKING:
    from femgear.analysis import HousingResult, ModesResult, StaticResult
    from femgear.analysis_stress import StressResult
    from femgear.gears import PlanetarySet
    from femgear.system import Response

Range = tuple[float, float, int]
"""First and last input speed [rad/s] and number of speeds."""

# separations of the flanks, which no grid knows
_FLANKS = {"modifications", "errors", "individual", "pin_errors"}
_SOLUTION = {"positions", "contact", "back_flanks", "stresses", "longest_record"}
_RIGID = {"mass", "inertia", "support_stiffness", "bearing_stiffness", "bearing_clearance"}
_WITHOUT_GRID = {"title", "operation", "dynamics", "housing", "carrier", "motor", "brake", "planar"}


class Shared:
    """What variants share, the latest few of each: flank compliances, and the dynamic model.

    Parameters
    ----------
    cache : path, optional
        Folder of generated grids.
    case : Case
        Only its grids are kept on disk: those of variants of its geometry would fill the folder.
    """

    def __init__(self, case: Case, *, cache: Path | None = None, keep: int = 4):
        self._cache, self._keep = cache, keep
        self._own = grid_key(case)
        self._found: OrderedDict[str, Any] = OrderedDict()

    def take(self, key: str, compute: Callable[[], Any]) -> tuple[Any, bool]:
        """What is kept under a key, else computed now; and whether it is new."""
        new = key not in self._found
        if new:
            self._found[key] = compute()
            if len(self._found) > self._keep:
                self._found.popitem(last=False)
        self._found.move_to_end(key)
        return self._found[key], new

    def grid_folder(self, key: str) -> Path | None:
        return self._cache if key == self._own else None


def grid_key(case: Case) -> str:
    """Text that two cases share when their flanks have the same compliance."""
    return _key(case, _WITHOUT_GRID, _FLANKS | _SOLUTION | _RIGID)


def model_key(case: Case) -> str:
    """Text that two cases share when only deviations of the flanks set their dynamic models apart."""
    return "model " + _key(case, {"title", "housing"}, _FLANKS | _SOLUTION | {"damping_ratio", "tolerance"})


def _key(case: Case, sections: set[str], entries: set[str]) -> str:
    data = case.model_dump()
    kept = {
        name: {k: v for k, v in section.items() if k not in entries} if isinstance(section, dict) else section
        for name, section in data.items()
        if name not in sections
    }
    return json.dumps(kept, sort_keys=True, default=str)


class Variant:
    """The stages of one case, each computed when it is first asked for.

    Parameters
    ----------
    case : Case
    shared : Shared
        Of all variants.
    """

    def __init__(self, case: Case, shared: Shared):
        self.case, self._shared = case, shared
        self._found: dict[tuple, Any] = {}

    def _once(self, *key, compute: Callable[[], Any]):
        if key not in self._found:
            self._found[key] = compute()
        return self._found[key]

    @cached_property
    def gears(self) -> PlanetarySet:
        return planetary_set(self.case)

    def static(self, torque: float | None = None) -> StaticResult:
        """Static solution under a torque on the input [N m], by default that of the case."""
        case = self.case
        if torque is not None and torque != case.operation.torque:
            case = with_value(case, "operation.torque", f"{torque!r} N m")
        return self._once("static", case.operation.torque, compute=lambda: _static(case, self._shared))

    def stress(self) -> StressResult:
        """Root stresses under the torque of the case."""
        from femgear.analysis_stress import solve_stress

        return self._once("stress", compute=lambda: solve_stress(self.case, self.static()))

    def response(self, speeds: Range) -> Response:
        """Periodic response at a range of speeds, without the verdict on its stability."""
        return self._once("response", speeds, compute=lambda: _response(*self._modes(speeds)))

    def housing(self, speeds: Range) -> HousingResult:
        """What the sensor on the ring hears at a range of speeds."""

        def compute():
            case, modes = self._modes(speeds)
            return analysis.solve_housing(case, analysis.solve_dynamics(case, self.static(), modes))

        return self._once("housing", speeds, compute=compute)

    def _modes(self, speeds: Range) -> tuple[Case, ModesResult]:
        case = self._once("speeds", speeds, compute=lambda: at_speeds(self.case, speeds))
        return case, self._once(
            "modes", speeds, compute=lambda: _modal_basis(case, self.static(), self._shared)
        )


def at_speeds(case: Case, speeds: Range) -> Case:
    """The case at equidistant speeds of the input, its published lines left out.

    Raises
    ------
    CaseError
        E-STAGE: a planar or helical case, which has no elastic ring.
    """
    other = [name for name in ("planar", "helical") if getattr(case, name, None) is not None]
    if other:
        raise CaseError(
            "mesh forces over speed and housing levels need a case with an elastic ring",
            code="E-STAGE",
            key=other[0],
            limit="transmission error, contact ratio, tip thickness, contact pressure, root stress",
        )
    first, last, count = speeds
    low, high = (f"{value / SPEED.scale:.12g} rpm" for value in (first, last))
    case = with_value(case, "housing.published", None)
    return with_value(case, "operation.speeds", {"from": low, "to": high, "count": count})


@one_blas_thread()
def _static(case: Case, shared: Shared) -> StaticResult:
    """As `analysis.solve_static`, with the compliances of an earlier variant where they are the same."""
    from femgear.contact.mirrored import walk_either_flank
    from femgear.contact.supports import RIGID
    from femgear.design.basis import case_supports
    from femgear.gears import torques
    from femgear.gears.deviations import common_period

    key = grid_key(case)
    first, new = shared.take(key, lambda: analysis.solve_static(case, cache=shared.grid_folder(key)))
    if new:
        return first
    gears, deviations = planetary_set(case), set_deviations(case)
    sun_torque = torques(gears, member=case.operation.input, torque=case.operation.torque).sun
    periods, message = common_period(deviations, gears, limit=case.static.longest_record)
    cycle = walk_either_flank(
        gears,
        first.bodies,
        sun_torque=sun_torque,
        positions=gears.equal_positions(case.static.positions),
        contact=case.static.contact,
        deviations=None if deviations.ideal and not case.static.back_flanks else deviations,
        supports=RIGID if case.static.members == "fixed" else case_supports(case),
        periods=periods,
        both_flanks=case.static.back_flanks,
    )
    check_motions(cycle, gears.sun.module)
    return replace(
        first,
        planetary_set=gears,
        cycle=cycle,
        sun_torque=sun_torque,
        entries=static_entries(case),
        period_message=message,
    )


@one_blas_thread()
def _modal_basis(case: Case, static: StaticResult, shared: Shared) -> ModesResult:
    """As `analysis.solve_modes`, with ring and bodies of an earlier variant."""
    first, new = shared.take(model_key(case), lambda: analysis.solve_modes(case, static))
    if new:
        return first
    check_dynamic_case(case, planetary_set(case))
    state = analysis.state_on_supports(case, first.bodies, static.sun_torque)
    if analysis.excitation_reach(case, state, static.sun_torque) != first.reach:
        return analysis.solve_modes(case, static)
    return analysis.modal_basis(
        case, first.ring, first.bodies, state, sun_torque=static.sun_torque, reach=first.reach
    )


@one_blas_thread()
def _response(case: Case, modes: ModesResult) -> Response:
    """As `analysis.solve_dynamics` without stability, fields and another look beyond the frequency limit."""
    found = analysis.turning_speeds(case, planetary_set(case))
    check_rim_speed(modes.ring.modes, [s.carrier for s in found])
    frequency = np.array([s.mesh_frequency for s in found])
    return analysis.periodic_response(
        case, modes, frequency, modes.reach, given=case.dynamics.mesh_harmonics
    )[1]
