"""Elastic carriers: what the pins of the planets give way by, with the carrier held at its seat on the shaft.

By closed forms the cheeks are rigid plates. The pins are bars that are clamped in them, Timoshenko beams with
the planet in the middle of the span; held in one cheek they are cantilevers, which also slope under a force. The
cheek on the shaft stands still. The other one turns about the axis against the webs, or the tube, between them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from femgear.case.quantities import LENGTH
from femgear.errors import CaseError
from femgear.fe.beam import RoundSection, beam_element, rigid_link
from femgear.system.assembly import StationSprings
from femgear.trains.gearbox.case_file import CASING, BoxPlanetarySection, GearboxCase
from femgear.trains.gearbox.geometry import set_sizes

SHEAR_OF_WEB = 5.0 / 6.0
"""Shear coefficient of the rectangular section of a web."""
_RIGID = 1e-12  # of the largest compliance: a direction in which nothing gives way
_ALIKE = 1e-9  # ends of a shaft that differ by less are equally long [m]
_RIGID_AT_ALL = 1e-15  # [m/N], as springs that a case can give


def carrier_problems(stage: BoxPlanetarySection, key: str) -> Iterator[CaseError]:
    """List what the entries of an elastic carrier contradict, of the stage at a key."""
    body, pins = stage.carrier_body, stage.pins
    if body is None or body.superelement is not None:
        return
    where, webs = f"{key}.carrier_body", body.given("web_outer_diameter", "web_inner_diameter")
    webs += ["web_share"] if "web_share" in body.model_fields_set else []
    winding = [*body.given("wind_up_stiffness"), *webs]
    if winding and (pins is None or pins.cheeks != 2):
        yield CaseError(
            "cheeks wind up against one another where pins are held in both",
            code="E-KEY-MISSING",
            key=f"{key}.pins",
            value=None if pins is None else "cheeks = 1",
            limit="pins with cheeks = 2",
            remedy='give pins = { diameter = "16 mm", length = "14 mm" }, or leave '
            f"{', '.join(winding)} of carrier_body out",
        )
    if len(winding) > len(webs) > 0:
        yield CaseError(
            "the wind-up of the carrier is given twice",
            code="E-CHOICE",
            key=f"{where}.{webs[0]}",
            limit="wind_up_stiffness, or the diameters of the webs",
            remedy=f"leave wind_up_stiffness or {', '.join(webs)} out",
        )
    outer, inner = body.web_outer_diameter, body.web_inner_diameter
    if webs and (outer is None or inner is None):
        missing = "web_outer_diameter" if outer is None else "web_inner_diameter"
        yield CaseError(
            "the webs of the carrier lack a diameter",
            code="E-KEY-MISSING",
            key=f"{where}.{missing}",
            limit="web_outer_diameter and web_inner_diameter",
            remedy="give both, of the circles that the webs reach to",
        )
    elif outer is not None and inner is not None and not inner < outer:
        yield CaseError(
            "the webs of the carrier have no thickness",
            code="E-RANGE",
            key=f"{where}.web_inner_diameter",
            value=LENGTH.show(inner),
            limit=f"below {LENGTH.show(outer)}",
            remedy="correct the diameters of the webs",
        )


def torque_end(case: GearboxCase, stage: BoxPlanetarySection) -> int:
    """Tell the side of the cheek that sits on the shaft, -1 at z < 0 of the planets, 1 at z > 0.

    As ``carrier_body.torque_end`` says; without it the side of the longer end of the carrier's shaft, z > 0 where both
    are equally long and of a shaft that is one rigid body.
    """
    if stage.carrier_body is not None and stage.carrier_body.torque_end is not None:
        return {"front": -1, "back": 1}[stage.carrier_body.torque_end]
    if stage.carrier == CASING:
        return 1
    shaft, position = case.shaft_named(stage.carrier), stage.carrier_position or 0.0
    # rounding of a position does not choose the side
    return 1 if shaft.length - position >= position - _ALIKE or not shaft.part else -1


def wind_up_stiffness(case: GearboxCase, stage: BoxPlanetarySection) -> float:
    """Compute the torsional stiffness between the cheeks of a carrier without its pins [N m/rad].

    As given, infinite without webs, ``G J/L`` of a closed tube. Webs between the planets, one at each gap, are
    bars that both cheeks clamp: ``N r^2/(L^3/(12 E I) + L/(kappa G A))`` at their mean radius r, of arc length b
    and thickness t with ``I = t b^3/12`` and kappa 5/6 (S. Timoshenko, Strength of Materials, part I).
    """
    body, pins = stage.carrier_body, stage.pins
    if body is None or pins is None:
        return math.inf
    if body.wind_up_stiffness is not None:
        return body.wind_up_stiffness
    if body.web_outer_diameter is None or body.web_inner_diameter is None:
        return math.inf
    outer, inner, span = body.web_outer_diameter, body.web_inner_diameter, 2.0 * pins.length
    young = case.material.youngs_modulus
    shear = young / (2.0 * (1.0 + case.material.poisson_ratio))
    if body.web_share == 1.0:
        return shear * math.pi / 32.0 * (outer**4 - inner**4) / span
    webs = len(set_sizes(stage).planet_angles)
    thickness, radius = 0.5 * (outer - inner), 0.25 * (outer + inner)
    arc = 2.0 * math.pi * body.web_share * radius / webs
    bending = span**3 / (young * thickness * arc**3)
    return webs * radius**2 / (bending + span / (SHEAR_OF_WEB * shear * thickness * arc))


def pin_compliance(case: GearboxCase, stage: BoxPlanetarySection, angles: Sequence[float]) -> np.ndarray:
    """Compute the compliance (6N, 6N) of the middles of all pins by closed forms, the carrier held at its shaft.

    Along and about x, y, z, of forces [m/N, rad/N] and moments [m/(N m), rad/(N m)] on one pin after the other.

    Parameters
    ----------
    angles : (N,) floats
        Of the pins around the axis [rad].
    """
    pins, count, near = stage.pins, len(angles), torque_end(case, stage)
    assert pins is not None
    material = case.material
    section = RoundSection(pins.diameter, pins.bore, material.youngs_modulus, material.poisson_ratio)
    element = beam_element(section, pins.length)[1]
    # stations of the element from low to high z: the pin's middle, and its end in the cheek
    middle, end = (slice(0, 6), slice(6, 12)) if near > 0 else (slice(6, 12), slice(0, 6))
    at_middle = element[middle, middle].copy()
    if pins.cheeks == 2:
        at_middle += element[end, end]
    stiffness = np.kron(np.eye(count), at_middle)
    wind_up = wind_up_stiffness(case, stage)
    if pins.cheeks == 2 and math.isfinite(wind_up):
        # the far half of the pin lies the other way round
        turned, radius = np.zeros((6 * count, 1)), set_sizes(stage).centre_distance
        far = wind_up
        for number, psi in enumerate(angles):
            along = rigid_link((radius * math.cos(psi), radius * math.sin(psi), 0.0))[:, 5]
            turned[6 * number : 6 * number + 6, 0] = element[end, middle] @ along
            far += along @ element[middle, middle] @ along
        stiffness = stiffness - turned @ turned.T / far
    compliance = np.linalg.inv(stiffness)
    return 0.5 * (compliance + compliance.T)


def pin_axes(psi: float) -> np.ndarray:
    """Axes (3, 3) of a pin at an angle [rad]: rows radially outwards, around the axis of the carrier, along it."""
    return np.array([[math.cos(psi), math.sin(psi), 0.0], [-math.sin(psi), math.cos(psi), 0.0], [0.0, 0.0, 1.0]])


def planet_springs(
    stage: BoxPlanetarySection,
    holders: Sequence[int],
    planets: Sequence[int],
    offsets: Sequence[np.ndarray],
    axes: Sequence[np.ndarray],
    bearing: np.ndarray,
    compliance: np.ndarray,
) -> StationSprings:
    """Make the springs between a carrier and all its planets: pins with their bearings in series.

    Parameters
    ----------
    stage : BoxPlanetarySection
        The set.
    holders, planets : (N,) sequences of int
        Stations that hold the pins, such as N times that of the carrier, and of the planets.
    offsets : N (3,) arrays
        From the holders to the pins [m].
    axes : N (3, 3) arrays
        Of the bearings, see `pin_axes`.
    bearing : (6,) array
        Stiffness of a bearing along its axes and about them [N/m, N m/rad]; those of zero hold nothing.
    compliance : (6N, 6N) array
        Of the pins along and about x, y, z.
    """
    count, used = len(offsets), np.flatnonzero(bearing > 0.0)
    stations = (*dict.fromkeys(holders), *planets)
    rows, turned = np.zeros((6 * count, 6 * len(stations))), np.zeros((6 * count, 6 * count))
    for number, (offset, along) in enumerate(zip(offsets, axes, strict=True)):
        part = slice(6 * number, 6 * number + 6)
        turned[part, part] = np.kron(np.eye(2), along)
        first, second = (6 * stations.index(end) for end in (holders[number], planets[number]))
        rows[part, first : first + 6] = -turned[part, part] @ rigid_link(offset)
        rows[part, second : second + 6] = turned[part, part]
    kept = (6 * np.arange(count)[:, None] + used).ravel()
    whole = turned @ compliance @ turned.T + np.diag(np.tile(1.0 / np.where(bearing > 0.0, bearing, 1.0), count))
    lever = set_sizes(stage).centre_distance
    return compliance_springs(f"pins of {stage.name}", stations, rows[kept], whole[np.ix_(kept, kept)], lever)


def compliance_springs(
    name: str, stations: tuple[int, ...], rows: np.ndarray, compliance: np.ndarray, lever: float
) -> StationSprings:
    """Make the springs between stations whose deflections have a compliance, along its principal directions.

    Directions in which nothing gives way are conditions.

    Parameters
    ----------
    name : str
        For messages and results.
    stations : tuple of int
        Of the k stations.
    rows : (r, 6k) array
        Deflections per unit of the motions, first three displacements, then rotations, of one point after the
        other: rotations are those rows without a displacement [1].
    compliance : (r, r) array
        Of these deflections.
    lever : float
        Length by which rotations are compared with displacements [m].
    """
    displacements = np.abs(rows.reshape(len(rows), -1, 6)[:, :, :3]).max(axis=(1, 2)) > 0.0
    size = np.where(displacements, 1.0, lever)
    values, vectors = np.linalg.eigh(compliance * np.outer(size, size))
    rigid = values <= max(_RIGID * values[-1], _RIGID_AT_ALL)
    stiffness = np.where(rigid, np.inf, 1.0 / np.where(rigid, 1.0, values))
    return StationSprings(name, stations, (vectors * size[:, None]).T @ rows, stiffness)
