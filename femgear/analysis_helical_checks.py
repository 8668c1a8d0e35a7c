"""What the pipeline of a helical case refuses before it computes."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import numpy as np

from femgear.analysis_helical_data import helical_data, torque_of
from femgear.analysis_helical_section import virtual_gears
from femgear.case import Case, set_deviations
from femgear.errors import CaseError

if TYPE_CHECKING:
    from femgear.gears import PlanetarySet

# any stiffness shows whether something takes up the load [N/m]
_TRIAL = 1e8


def check_helical_case(case: Case, gears: PlanetarySet) -> None:
    """Refuse what the helical model cannot represent, before anything is computed.

    Raises
    ------
    CaseError
        E-MECHANISM: torque or thrust that nothing takes up. E-PERIODS: a static record of several mesh
        periods. E-HELICAL-SECTION: virtual gears that cannot be made.
    """
    from femgear.gears.deviations import common_period

    _check_supports(case, gears)
    if case.helical.mesh_stiffness is not None:
        return
    periods, _ = common_period(set_deviations(case), gears, limit=sys.maxsize)
    if periods > 1:
        raise CaseError(
            f"the errors of this set span {periods} mesh periods; the helical model takes one",
            code="E-PERIODS",
            key="operation.speeds",
            limit="errors that repeat with every tooth",
            remedy="run with --only static, or leave pitch errors and runouts out",
        )
    if case.helical.section == "normal":
        virtual_gears(case, gears)


def _check_supports(case: Case, gears: PlanetarySet) -> None:
    """The thrust of helical teeth needs axial supports, the torque of the output none."""
    from femgear.models.helical import helical_system
    from femgear.solvers.modal import solve_modes

    data = helical_data(case, gears, np.full(2 * gears.n_planets, _TRIAL))
    try:
        solve_modes(helical_system(data, torque=torque_of(case)), data.column_stiffness)
    except CaseError as error:
        if error.code != "E-LOAD-BALANCE":
            raise
        raise CaseError(
            f"nothing takes up the torque or the thrust of the helical teeth: {error.message}",
            code="E-MECHANISM",
            key="helical",
            limit="axial_stiffness above 0 N/m of sun, ring and planets, or of members that mesh with them",
            remedy="give axial_stiffness, tilt_stiffness and support_stiffness",
            file=case.location("helical"),
        ) from None
