"""Coefficients of friction of the teeth of a case, and the friction that acts on its gears where the case asks for it.

`friction_coefficient` follows the section ``losses``: a number, a table or a formula. With ``losses.excites`` the same
coefficient makes the flanks rub in the contact (`femgear.contact.flank_friction`), `acting_friction`: that of the first
operating speed and of equal loads on all planets, one for every kind of mesh.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.lubrication import LubricantSection, oil_at
from femgear.case.quantities import RPM
from femgear.errors import CaseError
from femgear.findings import Finding, percent
from femgear.gears.friction import FRICTION_LAWS, PathSpeeds, path_speeds, table_friction
from femgear.gears.kinematics import speeds
from femgear.gears.profile import base_helix_angle

if TYPE_CHECKING:
    from femgear.gears.pair import GearPair, GearSet

NOTICEABLE_CHANGE = 0.05
"""Share by which a coefficient may differ at other speeds without a word."""


def friction_coefficient(
    case: Any, pair: GearPair, force: np.ndarray, mesh_frequency: float, base_helix: float
) -> np.ndarray:
    """Compute the coefficient of friction of meshes of one kind by the section ``losses`` of a case.

    Parameters
    ----------
    force : (m,) array
        Mean force along the line of action of every mesh [N].
    mesh_frequency : float
        [Hz]
    base_helix : float
        [rad]

    Returns
    -------
    (m,) array
        [1]
    """
    losses, line_load = case.losses, np.abs(force) / pair.face_width
    if losses.friction == "constant":
        return np.full(len(force), losses.coefficient)
    at_pitch = path_speeds(pair, 0.0, mesh_frequency, base_helix)
    if losses.friction == "table":
        pitch_speed = 2.0 * math.pi * mesh_frequency / pair.gear_1.teeth * pair.gear_1.base_radius
        grid = losses.table
        return table_friction(
            line_load,
            pitch_speed / math.cos(pair.working_pressure_angle),
            loads=grid.line_loads,
            speeds=grid.speeds,
            coefficients=grid.coefficients,
        )
    if not mesh_frequency:
        return np.zeros(len(force))
    return law_friction(case, losses.friction, pair, line_load, at_pitch)


def law_friction(case: Any, name: str, pair: GearPair, line_load: np.ndarray, at_pitch: PathSpeeds) -> np.ndarray:
    """Compute the coefficient of friction of a formula of `FRICTION_LAWS` with the oil and roughness of a case.

    Parameters
    ----------
    line_load : (...) array
        Force at the base circle over face width [N/m]; ISO/TS 6336-20 has that at the pitch circle.
    at_pitch : PathSpeeds
        At the pitch point.

    Returns
    -------
    (...) array
        [1]
    """
    oil: LubricantSection = case.lubricant
    load = line_load * math.cos(pair.working_pressure_angle) if name == "iso" else line_load
    return FRICTION_LAWS[name](
        load,
        float(at_pitch.sum_speed),
        float(at_pitch.radius),
        viscosity=oil_at(case),
        roughness=case.losses.roughness,
        lubricant=oil.factor,
    )


def shaft_turning(case: Any, gears: Any, speed: float) -> tuple[dict[str, float], float]:
    """Compute speeds of all shafts [rad/s], and the mesh frequency [Hz], at a speed of the input [rad/s]."""
    if gears.members:
        of_set = speeds(gears, input=case.operation.input, fixed=case.operation.fixed, speed=speed)
        return {"sun": of_set.sun, "carrier": of_set.carrier, "ring": of_set.ring}, of_set.mesh_frequency
    first, second = (gear.name.replace("_", " ") for gear in gears.gears)
    ratio = gears.senses[1] * gears.gears[0].teeth / gears.gears[1].teeth
    return {first: speed, second: ratio * speed}, abs(speed) * gears.gears[0].teeth / (2.0 * math.pi)


def friction_acts(case: Any) -> bool:
    """Tell whether the friction of the teeth acts on the gears of a case: ``losses.excites``."""
    return getattr(case, "losses", None) is not None and case.losses.excites


def acting_friction(case: Any, gears: GearSet) -> tuple[float, ...] | None:
    """Compute the coefficients of friction that act, of every kind of mesh; None where none do.

    Over the force in the transverse section, and negative where the last gear drives in the frame of the carrier: see
    `femgear.contact.flank_friction.window_friction`. CaseError: as `refuse_friction`.
    """
    if not friction_acts(case):
        return None
    refuse_friction(case)
    return _friction_at(case, gears, case.operation.speeds[0])


def friction_findings(case: Any, gears: GearSet) -> Iterator[Finding]:
    """Tell where friction that acts has another coefficient at other operating speeds (W-FRICTION)."""
    if not friction_acts(case) or not case.torque_on_first_gear():
        return
    speeds_of_operation = np.array(case.operation.speeds)
    coefficients = np.abs([_friction_at(case, gears, speed) for speed in speeds_of_operation])
    change = coefficients / coefficients[0] - 1.0
    at, kind = np.unravel_index(int(np.abs(change).argmax()), change.shape)
    if abs(change[at, kind]) > NOTICEABLE_CHANGE:
        first, other = (f"{speed / RPM:.5g} rpm" for speed in speeds_of_operation[[0, at]])
        text = (
            f"friction acts at all speeds with the coefficient {coefficients[0, kind]:.3g} of {first}; at {other} it "
            f"would be {coefficients[at, kind]:.3g}, {percent(change[at, kind], signed=True)}"
        )
        remedy = "put the speed that matters first, or compute speeds by themselves"
        yield Finding(
            "W-FRICTION", "losses.friction", text, remedy=remedy, limit=f"within {percent(NOTICEABLE_CHANGE)}"
        )


def _friction_at(case: Any, gears: GearSet, speed: float) -> tuple[float, ...]:
    """Coefficients of every kind of mesh at a speed of the input [rad/s], as of `acting_friction`."""
    turning, frequency = shaft_turning(case, gears, speed)
    first = turning["sun"] - turning["carrier"] if gears.members else next(iter(turning.values()))
    torque = case.torque_on_first_gear()
    base = abs(base_helix_angle(case.pressure_angle, case.helix_angle or 0.0))
    return rubbing_coefficients(case, gears, torque, frequency, base, drives=torque * first >= 0.0)


def rubbing_coefficients(
    rules: Any, gears: GearSet, torque: float, mesh_frequency: float, base_helix: float, *, drives: bool
) -> tuple[float, ...]:
    """Compute the coefficients of friction of every kind of mesh, as of `acting_friction`, by equal loads on planets.

    Parameters
    ----------
    rules : case
        With the sections ``losses`` and ``lubricant``.
    torque : float
        On gear 1, or the sun [N m].
    mesh_frequency : float
        [Hz]
    base_helix : float
        [rad]
    drives : bool
        Whether gear 1, or the sun against the carrier, drives.
    """
    force = np.array([abs(torque) / gears.gears[0].base_radius / gears.n_planets])
    every = (friction_coefficient(rules, pair, force, mesh_frequency, base_helix)[0] for pair in gears.kinds)
    return tuple((1.0 if drives else -1.0) * float(coefficient) / math.cos(base_helix) for coefficient in every)


_WITHOUT_FRICTION = (
    ("static", "back_flanks", "back flanks know no friction"),
    *((body, "tilt_stiffness", "members that tilt know no friction") for body in ("sun", "planet", "carrier")),
    *((body, "torque_end", "members that twist know no friction") for body in ("sun", "carrier")),
)
"""Entries with which friction cannot act."""


def refuse_friction(case: Any) -> None:
    """Refuse friction that acts where the contact has no way to take it (CaseError, E-FRICTION)."""
    for section, name, message in _WITHOUT_FRICTION:
        if section in type(case).model_fields and getattr(getattr(case, section), name, None) not in (None, False, ()):
            raise _no_friction(case, f"{section}.{name}", message)


def no_acting_friction(case: Any, message: str, otherwise: str = "") -> None:
    """Refuse friction that acts in a case whose dynamics have no place for it (CaseError, E-FRICTION)."""
    if friction_acts(case):
        raise _no_friction(case, "losses.excites", message, otherwise)


def _no_friction(case: Any, key: str, message: str, otherwise: str = "") -> CaseError:
    remedy = "leave losses.excites out" + ("" if key == "losses.excites" else f", or {key}")
    remedy += f", or {otherwise}" if otherwise else ""
    return CaseError(message, code="E-FRICTION", key=key, file=case.location(key), remedy=remedy)
