"""What the pipeline of a planar case refuses before it computes."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from femgear.case import Case, set_deviations
from femgear.errors import CaseError

if TYPE_CHECKING:
    from femgear.gears import PlanetarySet


def check_planar_case(case: Case, gears: PlanetarySet) -> None:
    """Refuse what the planar model cannot represent, before anything is computed.

    Raises
    ------
    CaseError
        E-BACKLASH: back flanks without play. E-PERIODS: a static record of several mesh periods.
    """
    from femgear.gears.deviations import common_period

    planar = case.planar
    play = min(gears.backlash_sun_planet, gears.backlash_planet_ring)
    # play of a rounding error is none
    if planar.back_flanks and planar.line_backlash is None and play < 1e-9:
        raise CaseError(
            f"back flanks need play, and the gears have {max(play, 0.0) * 1e6:.3g} um",
            code="E-BACKLASH",
            key="planar.back_flanks",
            value="true",
            limit="play above 0 in every mesh",
            remedy="give planar.line_backlash or set.backlash, or write planar.back_flanks = false",
            file=case.location("planar.back_flanks"),
        )
    if planar.mesh_stiffness is not None:
        return
    periods, _ = common_period(set_deviations(case), gears, limit=sys.maxsize)
    if periods > 1:
        raise CaseError(
            f"the errors of this set span {periods} mesh periods; the planar model takes one",
            code="E-PERIODS",
            key="operation.speeds",
            limit="errors that repeat with every tooth",
            remedy="run with --only static, or leave pitch errors and runouts out",
        )
