"""Refusals of a helical case before anything is computed: supports that are missing, torques too large."""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.case import set_deviations
from femgear.errors import CaseError, ConvergenceError
from femgear.trains.helical.section import HelicalCase
from femgear.trains.helical.virtual_gears import helical_data, line_load, torque_of, virtual_gears

if TYPE_CHECKING:
    from femgear.gears.planetary import PlanetarySet
    from femgear.trains.helical.model import HelicalSet

# any stiffness shows whether something takes up the load [N/m, N m/rad]
_TRIAL = 1e8
_AXES = {"axial_stiffness": "axial", "tilt_stiffness": "tilt"}
# c' of steel teeth [N/m^2] and Young's modulus of steel [Pa] (ISO 6336-1, method B); what teeth give way by
# before nothing is left of their contact [modules]
_TOOTH, _STEEL, _MOST = 14e9, 206e9, 0.25


def check_helical_case(case: HelicalCase, gears: PlanetarySet) -> None:
    """Refuse what the helical model cannot represent, before anything is computed.

    Raises
    ------
    CaseError
        E-MECHANISM: torque, thrust or tilting moments that nothing takes up. E-RANGE: stiffnesses too far
        apart, a torque that no teeth carry. E-PERIODS: a static record of several mesh
        periods. E-HELICAL-SECTION: virtual gears that cannot be made.
    """
    from femgear.gears.deviations import common_period

    _check_supports(case, gears)
    if case.helical.mesh_stiffness is not None:
        return
    _check_torque(case, gears)
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


def _check_torque(case: HelicalCase, gears: PlanetarySet) -> None:
    """A load under which teeth would give way by a large part of their height has no static solution."""
    stiffness = _TOOTH * case.material.youngs_modulus / _STEEL
    share = line_load(case, gears) / (stiffness * gears.sun.module)
    if share > _MOST:
        raise CaseError(
            f"a tooth pair would give way by {share:.3g} modules under this torque",
            code="E-RANGE",
            key="operation.torque",
            value=f"{case.operation.torque:.6g} N m",
            limit=f"{abs(case.operation.torque) * _MOST / share:.3g} N m, by {_MOST} modules, for this set",
            remedy="check the unit of the torque, or give the teeth a wider face or a larger module",
            file=case.location("operation.torque"),
        )


def _check_supports(case: HelicalCase, gears: PlanetarySet) -> None:
    """The thrust of helical teeth needs axial supports and its moments tilt supports."""
    data = helical_data(case, gears, np.full(2 * gears.n_planets, _TRIAL))
    try:
        balanced = _balanced(case, data)
    except ConvergenceError as error:
        if error.code != "E-RIGID-MODE":
            raise
        raise CaseError(
            "the stiffest supports are too stiff beside the softest: rounding hides the soft ones",
            code="E-RANGE",
            key="helical",
            limit="tilt and torsional stiffnesses over the radius squared within 1e17 N/m",
            remedy="lower the largest axial_stiffness, tilt_stiffness or torsional_stiffness",
            file=case.location("helical"),
        ) from None
    if not balanced:
        _refuse_loose(case, data)


def _balanced(case: HelicalCase, data: HelicalSet) -> bool:
    """Whether supports take up what the torque asks of them."""
    from femgear.solvers.linear.modal import solve_modes
    from femgear.system.assembler import gear_set_system

    try:
        solve_modes(gear_set_system(data, torque=torque_of(case)), data.column_stiffness)
    except CaseError as error:
        if error.code != "E-LOAD-BALANCE":
            raise
        return False
    return True


def _refuse_loose(case: HelicalCase, data: HelicalSet) -> None:
    """Name the supports of zero stiffness that would each take up what nothing takes up."""
    free = [
        (body, entry)
        for body in ("sun", "ring", "carrier", "planet")
        for entry in _AXES
        if getattr(getattr(case.helical, body), entry) == 0.0
    ]
    cures = [one for one in free if _balanced(case, _supported(data, *one))] or free
    names = [f"helical.{body}.{entry}" for body, entry in cures]
    what = {"axial_stiffness": "thrust", "tilt_stiffness": "tilting moments"}
    lost = " or the ".join(dict.fromkeys(what[entry] for _, entry in cures)) or "torque"
    raise CaseError(
        f"nothing takes up the {lost} of the helical teeth",
        code="E-MECHANISM",
        key=names[0] if names else "helical",
        value="0" if names else None,
        limit=f"above 0: {' or '.join(names)}" if names else "supports of sun, ring and carrier above 0",
        remedy="give axial_stiffness, tilt_stiffness and support_stiffness",
        file=case.location(names[0] if names else "helical"),
    )


def _supported(data: HelicalSet, body: str, entry: str) -> HelicalSet:
    """The same set with one support that was missing."""
    change = {_AXES[entry]: _TRIAL}
    if body == "planet":
        return replace(data, planet_bearing=replace(data.planet_bearing, **change))
    one = getattr(data, body)
    return replace(data, **{body: replace(one, support=replace(one.support, **change))})
