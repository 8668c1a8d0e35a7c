"""What must hold between the entries of a case file of a planetary set.

`cross_check` lists what no entry shows alone. Of published and measured lines `check_published` refuses those whose
speed or harmonic the case does not compute, `without_uncomputed` takes them out.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from itertools import accumulate, pairwise
from typing import Any

import numpy as np

from femgear.case.flank_sections import CarrierErrors, GearErrors
from femgear.case.load_spectrum import check_load_spectrum
from femgear.case.planetary import Case
from femgear.case.quantities import ANGLE, LENGTH, SPEED
from femgear.case.sections import ROUNDING, face_width, gear_material
from femgear.case.tooth_measures import check_allowances, shift_open
from femgear.errors import CaseError
from femgear.findings import Finding, remark
from femgear.gears.modifications import LARGEST_DEVIATION

_CODE = "E-PUBLISHED"
"""Of refusals of published and measured lines."""
LEAST_TORQUE = 1e-6
"""Smallest torque that is told from none [N m]."""
VALIDATED_HELIX = math.radians(30.0)
"""Largest helix angle at which teeth in three dimensions confirm the stiffness [rad]."""


def cross_check(case: Case, more: Iterable[CaseError] = ()) -> list[CaseError]:
    """List the refusals of entries that do not go together; `more` are those of the train."""
    if missing := list(check_face_widths(case)):
        return missing
    checks = (
        _check_operation,
        _check_set,
        _check_supports,
        _check_ends,
        _check_numbers,
        _check_deviations,
        check_materials,
        check_allowances,
    )
    problems = [problem for check in checks for problem in check(case)] + list(more)
    return problems or list(check_published(case))


def check_materials(case: Any) -> Iterator[CaseError]:
    """Refuse treatments of gears without a hardness, and hardnesses that ISO 6336-5 does not have; each once."""
    keys = set[str | None]()
    for name in case.gear_names:
        try:
            gear_material(case, name)
        except CaseError as error:
            if error.key not in keys:
                keys.add(error.key)
                yield error


def check_face_widths(case: Any) -> Iterator[CaseError]:
    """Refuse gears without a face width, and different ones of meshes where contact takes one width.

    Slices over the width, and back flanks beside the drive flanks, take meshes of one common face width.
    """
    try:
        widths = [face_width(case, name) for name in case.gear_names]
    except CaseError as error:
        yield error
        return
    common = [min(pair) for pair in pairwise(widths)]
    least = min(common)
    if max(common) == least:
        return
    helical_slices = getattr(getattr(case, "helical", None), "slices", 1)
    for key, given in (
        ("static.slices", case.static.slices > 1),
        ("static.back_flanks", case.static.back_flanks),
        ("helical.slices", helical_slices > 1),
    ):
        if given:
            shown = [LENGTH.show(width) for width in common]
            yield CaseError(
                f"sun and planets have {shown[0]} of their faces in common, planets and ring {shown[1]}",
                code="E-CHOICE",
                key=key,
                limit="meshes of one common face width",
                remedy=f'give planet.face_width = "{LENGTH.show(least)}", or leave {key} out',
            )


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
    yield from check_speeds(case)
    yield from check_torque(operation.torque)
    yield from check_load_cases(case)
    if not case.rigid and operation.fixed == "ring" and ring.foundation_tangential == 0.0:
        yield CaseError(
            "the ring is the fixed member but nothing keeps it from turning",
            code="E-MECHANISM",
            key="ring.foundation_tangential",
            value="0 N/m^3",
            limit="above 0 N/m^3",
            remedy="give a tangential foundation, or hold another member",
        )


def steep_helix(key: str, helix_angle: float) -> Iterator[Finding]:
    """Warn of a helix angle [rad] at which nothing confirms the stiffness of the teeth."""
    if abs(helix_angle) > VALIDATED_HELIX * (1.0 + 1e-9):
        text = (
            f"a helix angle of {ANGLE.show(helix_angle)}: the stiffness of helical teeth is validated up to "
            f"{ANGLE.show(VALIDATED_HELIX)} alone (docs/validation.md, rows helix)"
        )
        yield Finding("W-HELIX", key, text)


def check_speeds(case: Any) -> Iterator[CaseError]:
    """Refuse operating speeds given twice, and a run-up that ends where it begins or before."""
    speeds = case.operation.speeds
    if len(set(speeds)) < len(speeds):
        yield CaseError("a speed is given twice", code="E-DUPLICATE", key="operation.speeds", remedy="keep one of them")
    start, to = runup_range(case)
    if case.runup.count and not start < to:
        name, value = ("from", start) if case.runup.to is None else ("to", to)
        yield CaseError(
            "the run-up ends where it begins, or before",
            code="E-RANGE",
            key=f"runup.{name}",
            value=SPEED.show(value),
            limit=f"below {SPEED.show(to)}" if name == "from" else f"above {SPEED.show(start)}",
            remedy="give runup.from below runup.to; defaults are around operation.speeds",
        )


def check_load_cases(case: Any) -> Iterator[CaseError]:
    """Refuse load cases of the life of a set or a pair, see `check_load_spectrum`, and torques next to none."""
    yield from check_load_spectrum(case)
    for number, load_case in enumerate(case.operation.load_case):
        yield from check_torque(load_case.torque, f"operation.load_case[{number}].torque")


def check_torque(torque: float, key: str = "operation.torque") -> Iterator[CaseError]:
    """Refuse a torque [N m] that is neither none nor enough to be told from none; ``key`` is its entry."""
    if 0.0 < abs(torque) < LEAST_TORQUE:
        yield CaseError(
            "the torque is too small to be told from none",
            code="E-RANGE",
            key=key,
            value=f"{torque:g} N m",
            limit=f"0 N m, or at least {LEAST_TORQUE:g} N m of either sign",
        )


def runup_range(case: Any) -> tuple[float, float]:
    """Find the first and the last speed of the run-up [rad/s], as the case gives them or by default."""
    speeds, section = case.operation.speeds, case.runup
    return section.start or min(0.8 * min(speeds), 0.25 * max(speeds)), section.to or 1.25 * max(speeds)


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
    if case.set.centre_distance is None and shift_open(case.sun) and shift_open(case.ring):
        yield CaseError(
            "neither the centre distance nor a profile shift of sun or ring is given",
            code="E-KEY-MISSING",
            key="set.centre_distance",
            remedy="give set.centre_distance, sun.profile_shift or ring.profile_shift; the rest is found",
        )


def _check_supports(case: Case):
    for name in ("sun", "carrier"):
        section = getattr(case, name)
        if section.support_stiffness is not None and section.support_shaft:
            yield CaseError(
                f"the support of the {name} is given twice",
                code="E-DUPLICATE",
                key=f"{name}.support_stiffness",
                limit="one of support_stiffness and support_shaft",
                remedy='write support_stiffness = "5e7 N/m" or the like, "0 N/m" for a member that floats',
            )


def _check_ends(case: Case):
    """Ends at which torque passes: given with what depends on them, and with nothing else."""
    for name, other in (("sun", "torsion_diameter"), ("carrier", "wind_up_stiffness")):
        section = getattr(case, name)
        alone = section.torque_end is None
        # the root diameter stands for that of torsion
        if alone != (getattr(section, other) is None) and (alone or name == "carrier"):
            key = f"{name}.{'torque_end' if alone else other}"
            yield CaseError(
                f"{name}.torque_end and {name}.{other} belong together",
                code="E-KEY-MISSING",
                key=key,
                limit='torque_end = "front" (z < 0) or "back" (z > 0)',
                remedy="give both, or none of them",
            )


def _check_numbers(case: Case):
    dynamics, harmonics, response = case.dynamics, case.mesh_harmonics, case.response_harmonics
    rigid = case.rigid
    # the record of rigid bodies is that of the static positions
    if rigid and harmonics is not None and case.static.positions <= 2 * harmonics:
        yield CaseError(
            f"{case.static.positions} positions cannot carry {harmonics} mesh harmonics",
            code="E-RANGE",
            key="static.positions",
            value=case.static.positions,
            limit=f"more than 2 x {harmonics}",
        )
    if harmonics is not None and response is not None and response < 2 * harmonics:
        yield CaseError(
            "the response needs twice the harmonics of the mesh: the product of both reaches that far",
            code="E-RANGE",
            key="dynamics.response_harmonics",
            value=response,
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
            code="E-SYMMETRY",
            key="housing.points",
            value=case.housing.points,
            limit=f"a multiple of {planets}",
            remedy=f"write {planets * -(-max(points, 54) // planets)}, or leave housing.form out",
        )


def _check_deviations(case: Case):
    """What no entry shows alone: amounts against the module, numbers of teeth and planets."""
    yield from _check_planets(case)
    yield from check_gear_deviations(case, _amounts(case))


def check_gear_deviations(case: Any, more: Iterable[tuple[str, float]] = ()) -> Iterator[CaseError]:
    """Refuse pitch deviations and amounts that cannot be, of all gears; and `more` by key [m]."""
    most = LARGEST_DEVIATION * case.module
    for name in case.gear_names:
        gear = getattr(case, name)
        tables = [] if gear.errors is None else [(f"{name}.errors", gear.errors)]
        if name == "planet":
            tables += [(f"planet.individual[{i}]", planet) for i, planet in enumerate(gear.individual)]
        for key, table in tables:
            yield from _check_pitch(key, table, gear.teeth, most)
    for key, value in (*_gear_amounts(case), *more):
        if abs(value) > most:
            yield CaseError(
                f"a deviation of {value * 1e6:.6g} um is not plausible",
                code="E-RANGE",
                key=key,
                value=f"{value * 1e6:.6g} um",
                limit=f"{LARGEST_DEVIATION} modules, {most * 1e6:.6g} um",
                remedy="check the unit",
            )


def _check_planets(case: Case):
    for key, tables in (
        ("planet.individual", case.planet.individual),
        ("planet.misalignment", case.planet.misalignment),
        ("set.pin_errors", case.set.pin_errors),
    ):
        seen = set()
        for i, table in enumerate(tables):
            if table.planet > case.set.planets:
                yield CaseError(
                    f"there is no planet {table.planet}",
                    code="E-RANGE",
                    key=f"{key}[{i}].planet",
                    value=table.planet,
                    limit=f"1 to {case.set.planets}",
                )
            if table.planet in seen:
                yield CaseError(
                    f"planet {table.planet} is given twice",
                    code="E-DUPLICATE",
                    key=f"{key}[{i}].planet",
                    remedy="keep one of the tables",
                )
            seen.add(table.planet)


def _check_pitch(key: str, table: GearErrors, teeth: int, most: float):
    for name in ("pitch", "cumulative_pitch"):
        values = getattr(table, name)
        if values is not None and len(values) != teeth:
            yield CaseError(
                f"{len(values)} pitch deviations for {teeth} teeth",
                code="E-COUNT",
                key=f"{key}.{name}",
                limit=f"{teeth} deviations",
            )
    total = math.fsum(table.pitch or ())
    if abs(total) > ROUNDING * teeth:
        yield CaseError(
            f"the pitch deviations add up to {total * 1e6:.6g} um; around the gear they must add up to zero",
            code="E-RANGE",
            key=f"{key}.pitch",
            limit=f"{ROUNDING * teeth * 1e6:.6g} um from rounding",
            remedy="subtract their mean, or give cumulative_pitch",
        )
    elif table.pitch:
        yield from _check_cumulative(f"{key}.pitch", table.pitch, most)


def _check_cumulative(key: str, pitch: tuple[float, ...], most: float):
    """Single pitches, each of them plausible, may still carry a tooth far away."""
    mean = math.fsum(pitch) / len(pitch)
    cumulative = list(accumulate(value - mean for value in pitch[1:]))
    largest = _largest(tuple(cumulative))
    if abs(largest) > most:
        yield CaseError(
            f"the single pitch deviations add up to {largest * 1e6:.6g} um at tooth {cumulative.index(largest) + 1}",
            code="E-RANGE",
            key=key,
            limit=f"cumulative deviations of at most {LARGEST_DEVIATION} modules, {most * 1e6:.6g} um",
            remedy="check signs, order and unit of the list; it holds deviations from tooth to tooth",
        )


def _gear_amounts(case: Case):
    """Keys and values [m] of the deviations of all gears."""
    for name in case.gear_names:
        gear = getattr(case, name)
        for i, modification in enumerate(gear.modifications):
            for entry in ("amount", "deviations"):
                yield f"{name}.modifications[{i}].{entry}", _largest(getattr(modification, entry))
        yield from _error_amounts(f"{name}.errors", gear.errors)


def _amounts(case: Case):
    """Keys and values [m] of what only planetary sets have."""
    for i, planet in enumerate(case.planet.individual):
        yield from _error_amounts(f"planet.individual[{i}]", planet)
    yield from _error_amounts("carrier.errors", case.carrier.errors)
    if case.ring.errors is not None and case.ring.errors.ovality is not None:
        yield "ring.errors.ovality", case.ring.errors.ovality.amplitude
    width = max(face_width(case, name) for name in case.gear_names)
    for name in ("sun", "carrier"):
        if (askew := getattr(case, name).misalignment) is not None:
            yield f"{name}.misalignment", width * _largest((askew.x, askew.y))
    for i, askew in enumerate(case.planet.misalignment):
        yield f"planet.misalignment[{i}]", width * _largest((askew.radial, askew.tangential))
    for i, pin in enumerate(case.set.pin_errors):
        yield f"set.pin_errors[{i}].radial", pin.radial
        yield f"set.pin_errors[{i}].tangential", pin.tangential


def _error_amounts(key: str, table: CarrierErrors | None):
    for name in ("pitch", "cumulative_pitch", "thickness_reduction", "runout_amplitude"):
        yield f"{key}.{name}", _largest(getattr(table, name, None))


def _largest(value: float | tuple[float, ...] | None) -> float:
    """The value, or of several the one that is largest in size; 0 for none."""
    values = value if isinstance(value, tuple) else (value or 0.0,)
    return max(values, key=abs, default=0.0)


def check_published(case: Case) -> Iterator[CaseError]:
    """Refuse published and measured lines that nothing could be compared with."""
    speeds = np.array(case.operation.speeds)
    for kind in ("published", "measured"):
        for i, entry in enumerate(getattr(case.housing, kind)):
            if not np.isclose(speeds, entry.speed, rtol=1e-9, atol=0.0).any():
                yield CaseError(
                    "this speed is not computed",
                    code=_CODE,
                    key=f"housing.{kind}[{i}].speed",
                    value=SPEED.show(entry.speed),
                    limit=_speeds(case),
                    remedy=f"add it to operation.speeds, or leave the {kind} lines out",
                )
    for i, entry in enumerate(case.housing.published):
        computed = case.response_harmonics
        if computed is not None and entry.harmonic > computed:
            yield CaseError(
                "this mesh harmonic is not computed",
                code=_CODE,
                key=f"housing.published[{i}].harmonic",
                value=entry.harmonic,
                limit=f"1 to {computed}, the harmonics of the response",
                remedy="raise dynamics.response_harmonics, or leave the published lines out",
            )


def _speeds(case: Case) -> str:
    shown = [SPEED.show(speed) for speed in case.operation.speeds[:6]]
    more = len(case.operation.speeds) - len(shown)
    return ", ".join(shown) + (f" and {more} more" if more else "")


def without_uncomputed(data: dict, error: CaseError) -> Finding | None:
    """Take those published and measured lines out of a case's tables to which alone the error of its check objects.

    Says what was left out; None where the error is about other things too.
    """
    problems = getattr(error, "problems", ())
    if not problems or any(problem.code != _CODE for problem in problems):
        return None
    places = {tuple(problem.key.removeprefix("housing.").split("]")[0].split("[")) for problem in problems}
    housing, left_out = data["housing"], []
    for kind in sorted({kind for kind, _ in places}):
        count, entries = sum(kind == other for other, _ in places), housing[kind]
        left_out.append(f"{count} of {len(entries)} entries housing.{kind}")
        housing[kind] = [entry for i, entry in enumerate(entries) if (kind, str(i)) not in places]
    return remark(f"{' and '.join(left_out)} are left out: their speed or harmonic is not computed")
