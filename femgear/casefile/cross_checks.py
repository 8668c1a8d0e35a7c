"""What must hold between the entries of a case file."""

from __future__ import annotations

from femgear.casefile.deviations import check_deviation_sections
from femgear.casefile.helical import check_helical
from femgear.casefile.planar import check_planar
from femgear.casefile.published import check_published
from femgear.casefile.sections import Case
from femgear.errors import CaseError

LEAST_TORQUE = 1e-6


def cross_check(case: Case) -> list[CaseError]:
    """What no entry shows alone."""
    problems = [problem for check in _CHECKS for problem in check(case)]
    return problems or list(check_published(case))


def _check_operation(case: Case):
    operation, ring = case.operation, case.ring
    if operation.input == operation.fixed:
        yield CaseError(
            f"the {operation.input} cannot be both driven and held",
            code="E-MECHANISM",
            key="operation.fixed",
            value=operation.fixed,
            limit="one member driven, another held, the third is the output",
            remedy="drive the sun and hold the ring, or name two other members",
        )
    if len(set(operation.speeds)) < len(operation.speeds):
        yield CaseError("a speed is given twice", code="E-DUPLICATE", key="operation.speeds")
    if 0.0 < abs(operation.torque) < LEAST_TORQUE:
        yield CaseError(
            "the torque is too small to be told from none",
            code="E-RANGE",
            key="operation.torque",
            value=f"{operation.torque:g} N m",
            limit=f"0 N m, or at least {LEAST_TORQUE:g} N m of either sign",
        )
    elastic = case.planar is None and case.helical is None
    if elastic and operation.fixed == "ring" and ring.foundation_tangential == 0.0:
        yield CaseError(
            "the ring is the fixed member but nothing keeps it from turning",
            code="E-MECHANISM",
            key="ring.foundation_tangential",
            value="0 N/m^3",
            limit="above 0 N/m^3",
            remedy="give a tangential foundation, or hold another member",
        )


def _check_set(case: Case):
    angles, count = case.set.planet_angles, case.set.planets
    if angles is not None and len(angles) != count:
        yield CaseError(
            f"{len(angles)} angles for {count} planets",
            code="E-COUNT",
            key="set.planet_angles",
            value=len(angles),
            limit=f"{count} angles",
            remedy="give one angle a planet, or leave planet_angles out for equal spacing",
        )
    if (
        case.set.centre_distance is None
        and case.sun.profile_shift is None
        and case.ring.profile_shift is None
    ):
        yield CaseError(
            "neither the centre distance nor a profile shift of sun or ring is given",
            code="E-KEY-MISSING",
            key="set.centre_distance",
            remedy="give set.centre_distance, sun.profile_shift or ring.profile_shift; the rest is found",
        )


def _check_supports(case: Case):
    for name in ("sun", "carrier"):
        section = getattr(case, name)
        if (section.support_stiffness is None) == (not section.support_shaft):
            both = section.support_stiffness is not None
            how = "twice" if both else "neither as stiffness nor as shaft"
            yield CaseError(
                f"the support of the {name} is given {how}",
                code="E-DUPLICATE" if both else "E-KEY-MISSING",
                key=f"{name}.support_stiffness",
                limit="one of support_stiffness and support_shaft",
                remedy='write support_stiffness = "5e7 N/m" or the like, "0 N/m" for a member that floats',
            )


def _check_numbers(case: Case):
    dynamics, harmonics = case.dynamics, case.mesh_harmonics
    rigid = case.planar is not None or case.helical is not None
    # the record of rigid bodies is that of the static positions
    if rigid and case.static.positions <= 2 * harmonics:
        yield CaseError(
            f"{case.static.positions} positions cannot carry {harmonics} mesh harmonics",
            code="E-RANGE",
            key="static.positions",
            value=case.static.positions,
            limit=f"more than 2 x {harmonics}",
        )
    if harmonics is not None and case.response_harmonics < 2 * harmonics:
        yield CaseError(
            "the response needs twice the harmonics of the mesh: the product of both reaches that far",
            code="E-RANGE",
            key="dynamics.response_harmonics",
            value=case.response_harmonics,
            limit=f"{2 * harmonics} or more",
        )
    if dynamics.up_to is not None and (rigid or dynamics.mesh_harmonics is not None):
        yield CaseError(
            "the reach of the excitation is given twice"
            if dynamics.mesh_harmonics is not None
            else "rigid bodies are excited by mesh harmonics, not up to a frequency",
            code="E-RANGE",
            key="dynamics.up_to",
            value=f"{dynamics.up_to:g} Hz",
            limit="one of up_to and mesh_harmonics; rigid bodies have mesh_harmonics alone",
            remedy="leave dynamics.up_to out" if rigid else "leave out one of the two",
        )
    if harmonics is None and dynamics.response_harmonics is not None:
        yield CaseError(
            "the harmonics of the response follow from the reach of the excitation",
            code="E-RANGE",
            key="dynamics.response_harmonics",
            value=dynamics.response_harmonics,
            limit="together with dynamics.mesh_harmonics",
            remedy="give dynamics.mesh_harmonics too, or leave dynamics.response_harmonics out",
        )
    planets, points = case.set.planets, case.housing.points
    if case.housing.form == "linear" and case.set.planet_angles is None and case.housing.points % planets:
        yield CaseError(
            f"{case.housing.points} points break the symmetry of {planets} equally spaced planets: the "
            "interpolation between them makes carrier orders that cannot exist",
            code="E-POINTS",
            key="housing.points",
            value=case.housing.points,
            limit=f"a multiple of {planets}",
            remedy=f"write {planets * -(-max(points, 54) // planets)}, or leave housing.form out",
        )


_CHECKS = (
    _check_operation,
    _check_set,
    _check_supports,
    _check_numbers,
    check_deviation_sections,
    check_planar,
    check_helical,
)
