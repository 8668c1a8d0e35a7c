"""What the pipeline refuses before it computes, and what it warns of afterwards."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import numpy as np

from femgear.case import Case, set_deviations
from femgear.case_floating import check_floating
from femgear.errors import CaseError, ContactError
from femgear.frequency_limit import HIGHEST_RESPONSE

if TYPE_CHECKING:
    from femgear.contact.cycle import MeshCycle
    from femgear.fe.reduction import CyclicModes
    from femgear.gears import PlanetarySet


def max_nodal_diameter(case: Case) -> int:
    """Largest nodal diameter of the ring model; beyond half the teeth there are none."""
    from femgear.models.ring import MAX_DIAMETER

    return max(min(MAX_DIAMETER, case.ring.teeth // 2 - 1), 2)


def fastest_mesh_frequency(case: Case, gears: PlanetarySet) -> float:
    """Mesh frequency of the fastest speed [Hz].

    Raises
    ------
    CaseError
        When the response reaches beyond what a plane model of the ring means anything for.
    """
    from femgear.gears import speeds

    fastest = speeds(gears, input=case.operation.input, fixed="ring", speed=max(case.operation.speeds))
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
            code="E-FREQUENCY",
            key="operation.speeds",
            value=f"{max(case.operation.speeds) * 30 / np.pi:.6g} rpm",
            limit=f"up to {HIGHEST_RESPONSE:.3g} Hz, {allowed * 30 / np.pi:.4g} rpm here",
            remedy="leave the highest speeds out, or fewer dynamics.response_harmonics",
        )
    return fastest.mesh_frequency


def check_dynamic_case(case: Case, gears: PlanetarySet) -> None:
    """Refuse what modes, dynamics and housing cannot represent, before anything is computed.

    Raises
    ------
    CaseError
        The ring is not the fixed member, there is no torque, the errors span several mesh periods, or the
        response reaches beyond `HIGHEST_RESPONSE`.
    """
    from femgear.gears.deviations import common_period

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
    # whatever the longest record: one period cut out of many is no period
    periods, _ = common_period(set_deviations(case), gears, limit=sys.maxsize)
    if periods > 1:
        raise CaseError(
            f"the errors of this set span {periods} mesh periods; modes, dynamics and housing take one",
            code="E-PERIODS",
            key="operation.speeds",
            limit="errors that repeat with every tooth",
            remedy="run with --only static, or leave pitch errors and runouts out",
        )
    fastest_mesh_frequency(case, gears)


def check_reach(case: Case, reach: float, mesh_frequency: float) -> None:
    """Refuse a modal basis that was made for slower excitation.

    Parameters
    ----------
    case : Case
    reach : float
        Frequency up to which the basis carries excitation [Hz].
    mesh_frequency : float
        Of the fastest speed [Hz].

    Raises
    ------
    CaseError
        E-OTHER-CASE.
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

    Parameters
    ----------
    ring_modes : CyclicModes
    carrier_speeds : sequence of float
        [rad/s]

    Raises
    ------
    CaseError
        E-CRITICAL-SPEED: a carrier at or above the lowest ``2 pi f_n / n``.
    """
    wave = ring_modes.nodal_diameter > 0
    critical = 2.0 * np.pi * ring_modes.frequency[wave] / ring_modes.nodal_diameter[wave]
    lowest, fastest = int(np.argmin(critical)), float(np.max(np.abs(carrier_speeds)))
    if fastest >= critical[lowest]:
        rpm = 30.0 / np.pi
        raise CaseError(
            f"the carrier turns at {fastest * rpm:.6g} rpm, faster than the wave of "
            f"{ring_modes.nodal_diameter[wave][lowest]} nodal diameters around the ring",
            code="E-CRITICAL-SPEED",
            key="operation.speeds",
            value=f"{fastest * rpm:.6g} rpm of the carrier",
            limit=f"below {critical[lowest] * rpm:.6g} rpm of the carrier",
            remedy="leave the highest speeds out, or stiffen the ring or its foundation",
        )


def check_motions(cycle: MeshCycle, module: float) -> None:
    """Refuse a static result in which the gears have moved too far for small displacements.

    Raises
    ------
    ContactError
        E-MOTION: flanks that approach by more than half a module, members that move by more than two.
    """
    for name, motion, modules, remedy in (
        ("the flanks approach", cycle.deflection, 0.5, "reduce operation.torque or the errors"),
        (
            "a member moves",
            cycle.member_motion,
            2.0,
            "stiffen the supports and bearings, reduce the clearance or operation.torque",
        ),
    ):
        largest = float(np.abs(motion).max(initial=0.0))
        if largest > modules * module:
            raise ContactError(
                f"{name} by {largest * 1e3:.4g} mm: the model is one of small displacements",
                code="E-MOTION",
                value=f"{largest * 1e3:.4g} mm",
                limit=f"{modules:g} modules, {modules * module * 1e3:.4g} mm",
                remedy=remedy,
            )


def _deflection_warning(cycle: MeshCycle, moved: float) -> str:
    """Approach of the flanks beyond 5 % of the module: of teeth and bodies, or of moving members as well."""
    sun, ring = (np.abs(half).max() * 1e6 for half in np.split(cycle.deflection, 2))
    if not cycle.member_names:
        return (
            f"[W-DEFLECTION] the teeth deflect by {max(sun, ring):.0f} um, more than 5 % of the module: "
            "small displacements no longer hold"
        )
    return (
        f"[W-DEFLECTION] the flanks approach by {sun:.0f} um between sun and planets and by {ring:.0f} um "
        "between planets and ring, more than 5 % of the module: small displacements no longer hold. This is "
        "not the deflection of the teeth alone: it contains the motion of the members, up to "
        f"{moved * 1e6:.0f} um, and between planets and ring that of the ring on its foundation; "
        'static.members = "fixed" shows the teeth'
    )


def static_warnings(cycle: MeshCycle, module: float) -> tuple[str, ...]:
    """What is wrong with a static result in an engineer's eyes, in sentences."""
    found = []
    if cycle.max_pressure.max(initial=0.0) > 4e9:
        found.append(
            f"[W-PRESSURE] the contact pressure reaches {cycle.max_pressure.max() * 1e-6:.0f} MPa: no steel "
            "carries that, and the model stays elastic"
        )
    moved = np.abs(cycle.member_motion).max(initial=0.0)
    if np.abs(cycle.deflection).max(initial=0.0) > 0.05 * module:
        found.append(_deflection_warning(cycle, moved))
    if moved > 0.05 * module:
        found.append(
            f"[W-MOTION] a member moves by {moved * 1e6:.0f} um, more than 5 % of the module: contact points "
            "and arms are those of the unmoved set"
        )
    edges = (cycle.force > 0) & (cycle.max_pressure <= 0)
    if edges.any():
        found.append(
            "[W-EDGE] at some positions every contact of a mesh lies at the end of a flank: its pressure has "
            "no limit and is not given"
        )
    if cycle.open_planets.any() and cycle.force.any():
        planets = ", ".join(str(n + 1) for n in np.flatnonzero(cycle.open_planets.any(axis=1)))
        found.append(f"[W-OPEN] planet {planets} carries nothing at some positions")
    if cycle.wedged.any():
        found.append("[W-WEDGED] some meshes are loaded on both flanks at once")
    if ((cycle.back_force > 0) & ~cycle.wedged).any():
        found.append(
            "[W-BACK] some meshes carry on their back flanks alone: planets work against one another"
        )
    return tuple(found)
