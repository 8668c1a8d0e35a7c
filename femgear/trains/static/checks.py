"""Refusals and warnings of static results: displacements that are not small, doubtful solutions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femgear.errors import ContactError

if TYPE_CHECKING:
    from femgear.contact.cycle import MeshCycle


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
