"""Refusals and warnings of a case with an elastic ring.

Before anything is computed the case is refused where modes, dynamics or housing cannot represent it;
afterwards a warning says what the housing would feel beyond the excitation.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.checks import runup_range
from femgear.case.csv_columns import refuse_other_files
from femgear.case.gear_set import planetary_set, set_deviations
from femgear.case.planetary import Case, check_floating, output_member
from femgear.case.quantities import ANGLE, RPM
from femgear.case.sections import SupportSection
from femgear.case.tooth_friction import no_acting_friction
from femgear.errors import CaseError
from femgear.findings import Finding
from femgear.gears.deviations import common_period
from femgear.gears.kinematics import mesh_normals, torques
from femgear.gears.planetary import mesh_names
from femgear.housing.two_way.structure import FixedStructure, Support
from femgear.report.style import NOTICEABLE
from femgear.report.tables import first_speeds, pulling_meshes, pulls_of, response_warnings
from femgear.solvers.periodic.solution import CIRCLE
from femgear.stages.lumped_set import check_one_period, member_speeds
from femgear.stages.static_results import set_warnings
from femgear.trains.elastic.model import MAX_DIAMETER

if TYPE_CHECKING:
    import xarray as xr

    from femgear.fe.reduction import CyclicModes
    from femgear.gears.planetary import PlanetarySet
    from femgear.system.system import Response

HIGHEST_RESPONSE = 200e3
"""The wavelength of shear in steel there is 16 mm: shorter waves are no matter of plane gear bodies [Hz]."""
_DIAMETERS = 14
"""Nodal diameters of a ring on supports."""
_CHECKED = 12
"""Speeds at which the level is computed again, at most."""
_FAR = 3.0
"""Change of the level by supports or casing that is worth a warning [dB]."""
MOST_WINDING = 1.0
"""Angle between the ends of a coupling that is worth a warning [rad]."""


def check_dynamic_case(case: Case, gears: PlanetarySet) -> None:
    """Refuse what modes, dynamics and housing cannot represent, before anything is computed.

    CaseError: the ring is not the fixed member, there is no torque, the errors span more mesh periods than
    the case allows, or what takes one alone, or the response reaches beyond `HIGHEST_RESPONSE`.
    """
    if case.operation.fixed != "ring":
        raise CaseError(
            "modes, dynamics and housing need a fixed ring: it is the housing of this model",
            code="E-FIXED-MEMBER",
            key="operation.fixed",
            value=case.operation.fixed,
            limit='"ring"',
            remedy="run with --only static, fix the ring, or write the section [planar]: rigid bodies, for "
            "which any member may be the fixed one",
        )
    check_floating(case, gears, dynamic=True)
    if case.operation.torque == 0:
        raise CaseError(
            "without torque no tooth carries load, so there is no mesh stiffness for the dynamic model",
            code="E-NO-LOAD",
            key="operation.torque",
            limit="not zero for modes, dynamics and housing",
            remedy="give a torque, or run with --only static",
        )
    if case.housing.form == "linear":
        takes, remedy = 'housing.form = "linear" takes', 'take the form "exact"'
        check_one_period(case, gears, takes, key="housing.form", remedy=remedy)
    record_periods(case, gears)
    if case.housing.stands_still:
        no_acting_friction(
            case,
            "a housing that stands still has no place for friction along the flanks",
            "write the set as a gearbox, whose [casing] has: femgear gearbox CASE",
        )
    _check_housing_supports(case)
    if case.housing.structure:
        imported_casing(case, gears)
    fastest_mesh_frequency(case, gears)
    if case.runup.count:
        runup_ends(case)


def record_periods(case: Case, gears: PlanetarySet) -> int:
    """Count the mesh periods after which the set repeats with its errors.

    CaseError: more than ``static.longest_record`` (E-PERIODS).
    """
    longest = case.static.longest_record
    periods, cause = common_period(set_deviations(case), gears, limit=sys.maxsize)
    if periods > longest:
        raise CaseError(
            f"modes, dynamics and housing need the whole record: {cause}",
            code="E-PERIODS",
            key="static.longest_record",
            value=longest,
            limit=f"{periods} with these errors",
            remedy="raise it, which takes time and memory in proportion, run with --only static, or leave "
            "the errors of a member out",
        )
    return periods


def no_runup(case: Case) -> str:
    """Say why there is no run-up: it was not asked for, or errors turn; empty where there is one."""
    if not case.runup.count:
        return "runup.count is 0"
    single = common_period(set_deviations(case), planetary_set(case))[0] == 1
    return "" if single else "errors turn with gears, and the run-up takes one mesh period"


def fixed_diameters(case: Case) -> int:
    """Choose the nodal diameters in which a ring on supports and the meshes act both ways.

    CaseError: so many that side bands of neighbouring mesh harmonics overlap (E-RANGE).
    """
    most, given = min((case.ring.teeth - 1) // 6, max_nodal_diameter(case)), case.housing.nodal_diameters
    if given is not None and given > most:
        message, key = "side bands of neighbouring mesh harmonics would overlap", "housing.nodal_diameters"
        raise CaseError(message, code="E-RANGE", key=key, value=given, limit=f"2 to {most}")
    return given or min(_DIAMETERS, most)


def housing_supports(case: Case) -> list[Support]:
    """Make the supports of the ring, those of the case with their widths as angles."""
    radius = case.ring.outer_radius
    return [Support(**support.model_dump() | {"width": support.width / radius}) for support in case.housing.support]


def _acts(support: SupportSection) -> bool:
    return bool(support.radial_stiffness or support.tangential_stiffness or support.mass)


def _check_housing_supports(case: Case) -> None:
    """Refuse supports of the ring that cannot be: idle, two at one place, with the linear form."""
    supports, circle = case.housing.support, 2 * math.pi * case.ring.outer_radius
    idle = next((i for i, support in enumerate(supports) if not _acts(support)), None)
    if idle is not None:
        raise CaseError(
            "a support without stiffness and mass does nothing",
            code="E-SUPPORT",
            key=f"housing.support[{idle}]",
            limit="a stiffness or mass above zero",
            remedy="give one of them, or leave the support out",
        )
    angles = [round(math.remainder(support.angle, 2 * math.pi), 9) for support in supports]
    again = next((i for i, angle in enumerate(angles) if angle in angles[:i]), None)
    if again is not None:
        message, remedy = "two supports stand at this angle", "make one of them, with the sum of both"
        key, value = f"housing.support[{again}].angle", f"{math.degrees(angles[again]):.6g} deg"
        raise CaseError(message, code="E-DUPLICATE", key=key, value=value, remedy=remedy)
    around = sorted(range(len(supports)), key=lambda i: angles[i])
    for i, j in zip(around, around[1:] + around[:1]):
        room = (angles[j] - angles[i]) % (2 * math.pi) / (2 * math.pi) * circle or circle
        wide = 0.5 * (supports[i].width + supports[j].width)
        # angles are compared in nine digits
        if wide > room * (1 + 1e-6):
            message = "supports overlap" if i != j else "a support is longer than the ring is around"
            raise CaseError(
                message,
                code="E-SUPPORT",
                key=f"housing.support[{j}].width",
                value=f"{1e3 * supports[i].width:g} and {1e3 * supports[j].width:g} mm, {1e3 * room:.4g} mm apart",
                limit="half of both widths up to the distance along the circumference",
                remedy="make them narrower, or one of both",
            )
    if case.housing.stands_still and case.housing.form == "linear":
        raise CaseError(
            "the linear form interpolates a field that turns with the carrier; a ring on supports or in a "
            "casing has none",
            code="E-CHOICE",
            key="housing.form",
            value="linear",
            limit='"exact" with housing.support and housing.structure',
        )
    fixed_diameters(case)


def imported_casing(
    case: Case, gears: PlanetarySet, *, max_frequency: float = np.inf, expected_stiffness: float | None = None
) -> tuple[FixedStructure, tuple[str, ...], tuple[str, ...]]:
    """Read the casing of a case, with the names of its sensors and of the forces on its feet.

    Its ring is loaded on the pitch circle, at the angles of the planets, along the line of action of the
    flanks that carry. ``max_frequency`` [Hz] where the case gives none; ``expected_stiffness`` [N/m] as for
    `read_casing`.

    CaseError: as `read_casing`; E-OTHER-CASE: files that are not those that the case was read with.
    """
    section, folder = case.housing.structure, Path(case.name).parent
    assert section is not None
    file, nodes = folder / section.file, None if section.nodes is None else folder / section.nodes
    psi, on_ring = gears.planet_angles[0], mesh_normals(gears, back=case.torque_on_first_gear() < 0)[gears.n_planets]
    turned = np.array([[np.cos(psi), np.sin(psi)], [-np.sin(psi), np.cos(psi)]])
    try:
        refuse_other_files((path for path in (file, nodes) if path), section.file, section.sha256)
        from femgear.exchange.casing_files import named_outputs, read_casing

        structure = read_casing(
            file,
            direction=turned @ on_ring,
            max_diameter=fixed_diameters(case),
            units=section.units,
            pitch_radius=gears.ring.base_radius / math.cos(gears.working_pressure_angle_planet_ring),
            damping_ratio=section.damping_ratio,
            nodes=nodes,
            max_frequency=section.max_frequency or max_frequency,
            expected_stiffness=expected_stiffness,
        )
        return structure, *named_outputs(structure, nodes)
    except CaseError as error:
        of_section = error.key in type(section).model_fields
        error.key, error.file = f"housing.structure.{error.key if of_section else 'file'}", error.file or str(file)
        raise


def check_reach(case: Case, reach: float, mesh_frequency: float) -> None:
    """Refuse (E-OTHER-CASE) a modal basis that carries excitation up to a lower frequency than is needed.

    Its reach and the mesh frequency of the fastest speed are in Hz.
    """
    wanted = case.dynamics.up_to or (case.mesh_harmonics or 3) * mesh_frequency
    if wanted > reach * (1.0 + 1e-9):
        raise CaseError(
            f"the modal basis was made for excitation up to {reach:.4g} Hz, this case has {wanted:.4g} Hz",
            code="E-OTHER-CASE",
            key="operation.speeds" if case.dynamics.up_to is None else "dynamics.up_to",
            limit=f"up to {reach:.4g} Hz",
            remedy="compute the modes of this case",
        )


def check_rim_speed(ring_modes: CyclicModes, carrier_speeds) -> None:
    """Refuse planets that run around the ring as fast as its waves.

    A load that travels around a ring with the angular speed W meets the resonance of a mode of n nodal
    diameters where ``n W = 2 pi f_n`` (S. C. Huang and W. Soedel, J. Sound Vib. 115, 1987, 253-274). The
    model sees the ring from the carrier without the inertia terms of that motion: it holds far below.

    CaseError: a carrier speed [rad/s] at or above the lowest ``2 pi f_n / n`` (E-SPEED).
    """
    (critical, diameters), fastest = slowest_wave(ring_modes), float(np.max(np.abs(carrier_speeds)))
    if fastest >= critical:
        raise CaseError(
            f"the carrier turns at {fastest / RPM:.6g} rpm, faster than the wave of "
            f"{diameters} nodal diameters around the ring",
            code="E-SPEED",
            key="operation.speeds",
            value=f"{fastest / RPM:.6g} rpm of the carrier",
            limit=f"below {critical / RPM:.6g} rpm of the carrier",
            remedy="leave the highest speeds out, or stiffen the ring or its foundation",
        )


def slowest_wave(ring_modes: CyclicModes) -> tuple[float, int]:
    """Find the angular speed of the slowest wave around the ring [rad/s], and its nodal diameters."""
    wave = ring_modes.nodal_diameter > 0
    critical = 2.0 * np.pi * ring_modes.frequency[wave] / ring_modes.nodal_diameter[wave]
    lowest = int(np.argmin(critical))
    return float(critical[lowest]), int(ring_modes.nodal_diameter[wave][lowest])


def runup_ends(case: Case) -> tuple[float, float]:
    """Find the first and the last speed of the run-up [rad/s], see `femgear.case.checks.runup_range`.

    CaseError: the last one is beyond what the model means anything for.
    """
    (start, to), section, gears = runup_range(case), case.runup, planetary_set(case)
    if section.to is not None:
        operation = case.operation.model_copy(update={"speeds": (section.to,)})
        try:
            fastest_mesh_frequency(case.model_copy(update={"operation": operation}), gears)
        except CaseError as error:
            error.key, error.file = "runup.to", case.location("runup.to")
            raise
    return start, to


def case_warnings(case: Case) -> Iterator[Finding]:
    """List what is allowed in a set with an elastic ring but deserves a look."""
    yield from set_warnings(case)
    if case.dynamics.damping_ratio == 0.0 and case.operation.fixed == "ring":
        yield Finding(
            "W-DAMPING",
            "dynamics.damping_ratio",
            "without damping resonances have no limit, and levels depend on how near a line lies to one",
            remedy="0.02 to 0.05 is usual",
        )
    yield from _assumed_for_levels(case)
    yield from _wound_up(case)
    if case.planet.bearing_clearance and case.operation.fixed == "ring":
        yield Finding(
            "W-BEARING",
            "planet.bearing_clearance",
            "the dynamics have linear planet bearings; the clearance "
            'acts in the static results alone, with static.members = "elastic"',
        )
    if case.housing.form == "linear" and case.housing.points <= 2 * MAX_DIAMETER:
        yield Finding(
            "W-POINTS",
            "housing.points",
            f"{case.housing.points} points do not resolve the ring's {MAX_DIAMETER} nodal diameters",
            remedy=f"use more than {2 * MAX_DIAMETER}",
        )


def _assumed_for_levels(case: Case) -> Iterator[Finding]:
    """Say what levels and dB(A) rest on where the case leaves it to defaults (W-ESTIMATED)."""
    if case.operation.fixed != "ring":
        return
    ratio, microphone = case.dynamics.damping_ratio, case.housing.microphone
    if "damping_ratio" not in case.dynamics.model_fields_set:
        yield Finding(
            "W-ESTIMATED",
            "dynamics.damping_ratio",
            f"left out: levels rest on a damping ratio of {ratio:g} for all modes",
            remedy="give it: 0.02 to 0.05 is usual",
            concerns=f"damping ({ratio:g})",
        )
    if "housing" not in case.model_fields_set:
        yield Finding(
            "W-ESTIMATED",
            "housing",
            "left out: the ring on its foundation stands for the housing, with a sensor on its outer surface at "
            f"{ANGLE.show(case.housing.sensor_angle)}",
            remedy="give [housing] with supports or a structure, and the angle of the sensor",
            concerns="housing (the ring alone)",
        )
    if "distance" not in microphone.model_fields_set:
        distance = f"{microphone.distance:g} m"
        yield Finding(
            "W-ESTIMATED",
            "housing.microphone.distance",
            f"left out: dB(A) are those of a microphone {distance} from the outer surface of the ring",
            remedy="give the distance at which it is heard",
            concerns=f"microphone distance ({distance})",
        )


def _wound_up(case: Case) -> Iterator[Finding]:
    """Couplings that the torque turns further than any stands: a slip of units, as a rule."""
    acting = torques(planetary_set(case), member=case.operation.input, torque=case.operation.torque)
    for name, member in (("motor", case.operation.input), ("brake", output_member(case))):
        section = getattr(case, name)
        if section is None:
            continue
        angle = abs(getattr(acting, member)) / section.coupling_stiffness
        if angle > MOST_WINDING:
            yield Finding(
                "W-COUPLING",
                f"{name}.coupling_stiffness",
                f"{section.coupling_stiffness:.4g} N m/rad lets the "
                f"torque turn the coupling by {math.degrees(angle):.4g} deg; couplings stand a few degrees, "
                "elastic ones twenty",
            )


def max_nodal_diameter(case: Case) -> int:
    """Find the largest nodal diameter of the ring model; beyond half the teeth there are none."""
    return max(min(MAX_DIAMETER, case.ring.teeth // 2 - 1), 2)


def fastest_mesh_frequency(case: Case, gears: PlanetarySet) -> float:
    """Compute the mesh frequency of the fastest speed [Hz].

    CaseError: the response reaches beyond what a plane model of the ring means anything for.
    """
    fastest = member_speeds(case, gears, max(case.operation.speeds))
    harmonics = case.response_harmonics or 3
    response = max(harmonics * fastest.mesh_frequency, case.dynamics.up_to or 0.0)
    up_to = case.dynamics.up_to
    if up_to is not None and up_to < fastest.mesh_frequency:
        raise CaseError(
            f"the excitation ends at {up_to:.6g} Hz, below the mesh frequency of the fastest speed: "
            "nothing would excite the set there",
            code="E-RANGE",
            key="dynamics.up_to",
            value=f"{up_to:.6g} Hz",
            limit=f"{fastest.mesh_frequency:.6g} Hz or more",
            remedy="raise it, or leave the highest speeds out",
        )
    if response > HIGHEST_RESPONSE:
        allowed = max(case.operation.speeds) * HIGHEST_RESPONSE / response
        raise CaseError(
            f"{harmonics} harmonics of {fastest.mesh_frequency:.4g} Hz reach {response:.3g} Hz",
            code="E-RANGE",
            key="operation.speeds",
            value=f"{max(case.operation.speeds) / RPM:.6g} rpm",
            limit=f"up to {HIGHEST_RESPONSE:.3g} Hz, {allowed / RPM:.4g} rpm here",
            remedy="leave the highest speeds out, or fewer dynamics.response_harmonics",
        )
    return fastest.mesh_frequency


def checked_speeds(count: int, most: int = _CHECKED) -> np.ndarray:
    """Choose the numbers (n,) of speeds at which the level is computed again: all, or some of many."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(int))


def dynamics_warnings(data: xr.Dataset) -> Iterator[Finding]:
    """List what dynamics.nc says against itself: excitation that ends too early, teeth that would part."""
    if "level_change" in data:
        change, limit = data["level_change"].values, data["excitation_limit"].values
        yield from missing_level(data["speed"].values, change, limit, float(data.attrs["compared_to"]))
    yield from response_warnings(data)


def response_findings(
    case: Case, response: Response, change: np.ndarray, limit: np.ndarray, compared_to: float
) -> Iterator[Finding]:
    """List what a response at the speeds of a case says against itself before its stability is known.

    ``change`` (n_speeds,) [dB], ``limit`` (n_speeds,) and ``compared_to`` [Hz] as for `missing_level`.
    """
    rpm = np.array(case.operation.speeds) / RPM
    yield from missing_level(rpm, change, limit, compared_to)
    yield from pulling_meshes(rpm, mesh_names(response.force.shape[1] // 2), [pulls_of(response.force)])
    if (bad := ~np.asarray(response.converged, bool)).any():
        text = f"the periodic solution did not converge at {first_speeds(rpm[bad])}"
        yield Finding("W-CONVERGENCE", "operation.speeds", text)


def housing_warnings(data: xr.Dataset) -> Iterator[Finding]:
    """List what housing.nc says: what two ways change, instability, missing compliance."""
    if "one_way_difference" in data:
        apart, speeds = data["one_way_difference"].values, data["speed"].values
        size = np.where(np.isfinite(apart), np.abs(apart), 0.0)
        if size.max() > _FAR:
            worst = int(size.argmax())
            text = (
                f"at {speeds[worst]:.6g} rpm the level is {apart[worst]:+.1f} dB from that by the mesh "
                f"forces of the ring without supports or casing, at {(size > _FAR).sum()} of {len(speeds)} "
                f"speeds more than {_FAR:g} dB away: K_gamma and dynamics.nc are without them"
            )
            yield Finding("W-ONE-WAY", "", text)
    if "turn_multiplier" in data and (bad := data["turn_multiplier"].values > 1.0 + CIRCLE).any():
        speeds = first_speeds(data["speed"].values[bad])
        text = f"in the housing that stands still the periodic solution is unstable at {speeds}"
        yield Finding("W-UNSTABLE", "operation.speeds", text)
    if missing := data.attrs.get("missing_compliance"):
        remedy = "export more modes, or residual vectors, or matrices, unless the casing is as stiff as that"
        yield Finding("W-RESIDUAL", "housing.structure.file", missing, remedy=remedy)


def missing_level(rpm, level_change, limit, compared_to: float, *, of: str = "") -> tuple[Finding, ...]:
    """Warn where the level of the housing would change by `NOTICEABLE` or more.

    Parameters
    ----------
    rpm, level_change, limit : (n_speeds,) arrays
        Speeds of the input [rpm], change of the level [dB], nan where it was not computed, and highest
        excitation frequencies [Hz].
    compared_to : float
        Frequency to which the excitation reached in the comparison [Hz].
    of : str
        What the speeds are of, such as ``"run-up: "``.
    """
    change = np.where(np.isfinite(level_change), np.abs(level_change), 0.0)
    if not np.isfinite(level_change).any():
        text = (
            f"{of}the excitation ends at {limit.min():.4g} Hz at the slowest speed; what it loses is "
            f"unknown: equations with excitation up to {compared_to:.4g} Hz are nearly singular"
        )
        return (Finding("W-EXCITATION", "dynamics.damping_ratio", text, remedy="give the set some damping"),)
    if change.max(initial=0.0) < NOTICEABLE:
        return ()
    worst = int(change.argmax())
    text = (
        f"{of}at {rpm[worst]:.6g} rpm the excitation ends at {limit[worst]:.4g} Hz; up to "
        f"{compared_to:.4g} Hz the level of the housing changes by {level_change[worst]:+.1f} dB. It does by "
        f"{NOTICEABLE:g} dB or more at {int((change >= NOTICEABLE).sum())} of the "
        f"{int(np.isfinite(level_change).sum())} speeds looked at: raise dynamics.up_to or "
        "dynamics.mesh_harmonics, or leave the slowest speeds out, before levels are compared"
    )
    return (Finding("W-EXCITATION", "", text),)
