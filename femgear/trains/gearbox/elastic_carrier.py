"""Elastic carriers from files in a gearbox: their pins in statics, their inner modes beside the planets.

The carrier does not move in its own frame, and stands at one angle with its planets. Between the seat on the shaft
and the pins it has the compliance C_c of its superelement: springs of the deflections B of the pins against the
shaft, ``B C_c^-1 B^T``, in which rigid motions carry nothing whatever the digits of the file. Its mass and its inner
modes are those of Craig and Bampton (`femgear.exchange.carrier_files`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import block_diag

from femgear.case.quantities import LENGTH
from femgear.errors import CaseError
from femgear.fe.beam import rigid_link
from femgear.system.assembly import GROUND, Assembly, StationSprings, with_modal_body
from femgear.system.system import MechanicalSystem
from femgear.trains.gearbox.carrier import compliance_springs, pin_axes
from femgear.trains.gearbox.case_file import BoxPlanetarySection, SuperelementSection
from femgear.trains.gearbox.geometry import StageSizes

if TYPE_CHECKING:
    from femgear.exchange.carrier_files import CarrierBody

_SUPERELEMENT = ("pins", "compliance", "mass", "frequency", "coupling")
_OFF_CIRCLE = 0.01  # distance of a pin from its place over the centre distance, and angle [rad], at most


@dataclass(frozen=True)
class ElasticCarrier:
    """A carrier from a file in the gearbox, at k = N + 1 stations: of its shaft, then of its N pins.

    Parameters
    ----------
    name : str
        ``"carrier of SET"``.
    stations : (k,) tuple of int
        Their numbers.
    springs : tuple of StationSprings
        Between them, with the compliance of the pins.
    mass, gyroscopic : (6k, 6k) arrays
        Mass matrix of their motions, and gyroscopic matrix of the whole carrier at its speed [kg, kg m, kg m^2].
    frequency : (m,) array
        Natural angular frequencies of its inner modes, all stations held [rad/s].
    coupling : (6k, m) array
        Mass between the motions of the stations and the inner modes, of unit modal mass [kg^1/2, kg^1/2 m].
    """

    name: str
    stations: tuple[int, ...]
    springs: tuple[StationSprings, ...]
    mass: np.ndarray
    gyroscopic: np.ndarray
    frequency: np.ndarray
    coupling: np.ndarray

    def below(self, highest: float) -> ElasticCarrier:
        """Keep the inner modes up to a frequency [Hz]; the springs have the whole compliance all the same."""
        kept = self.frequency <= 2.0 * math.pi * highest
        return replace(self, frequency=self.frequency[kept], coupling=self.coupling[:, kept])

    def on_all_motions(self, count: int) -> np.ndarray:
        """Mass (count, m) between all motions of a gearbox and the inner modes."""
        spread = np.zeros((count, len(self.frequency)))
        for number, station in enumerate(self.stations):
            if station != GROUND:
                spread[6 * station : 6 * station + 6] += self.coupling[6 * number : 6 * number + 6]
        return spread


def elastic_carrier(
    stage: BoxPlanetarySection,
    stations: tuple[int, ...],
    offsets: Sequence[np.ndarray],
    angles: Sequence[float],
    speed: float,
) -> ElasticCarrier:
    """Put the carrier of a file into the gearbox, turned so that its pins stand where the planets do.

    Pins without rotations of their own stay upright on the shaft.

    Parameters
    ----------
    stage : BoxPlanetarySection
        The set; its carrier was read from a file.
    stations : (N + 1,) tuple of int
        Of the shaft, then of the pins.
    offsets : N (3,) arrays
        From the station of the shaft to the pins [m].
    angles : (N,) floats
        Of the planets [rad].
    speed : float
        Of the carrier [rad/s].
    """
    body, name = _unpacked(stage.superelement), f"carrier of {stage.name}"
    count = len(offsets)
    components = len(body.compliance) // count
    way = body.pins[0] - body.seat
    turn = pin_axes(angles[0] - math.atan2(way[1], way[0])).T
    of_pins = np.kron(np.eye(count), np.kron(np.eye(components // 3), turn))
    turned = np.asarray(block_diag(np.kron(np.eye(2), turn), of_pins))
    rows, link = np.zeros((components * count, 6 * count + 6)), np.zeros((components * count + 6, 6 * count + 6))
    link[:6, :6] = rigid_link(offsets[0] - turn @ way)
    for number, offset in enumerate(offsets):
        part, of_pin = components * number + np.arange(components), 6 * number + 6 + np.arange(6)
        rows[part, :6] = -rigid_link(offset)[:components]
        rows[np.ix_(part, of_pin)] = np.eye(6)[:components]
        link[np.ix_(part + 6, of_pin)] = np.eye(6)[:components]
    lever = float(np.hypot(way[0], way[1]))
    springs = [compliance_springs(name, stations, rows, of_pins @ body.compliance @ of_pins.T, lever)]
    if components == 3:
        upright = np.hstack([np.zeros((3, 3)), -np.eye(3), np.zeros((3, 3)), np.eye(3)])
        springs += [StationSprings(name, (stations[0], pin), upright, np.full(3, np.inf)) for pin in stations[1:]]
    mass = turned @ body.mass @ turned.T
    rigid = np.vstack([np.eye(6), *(rigid_link(pin - body.seat)[:components] for pin in body.pins)])
    polar = float((rigid.T @ body.mass @ rigid)[5, 5])
    gyroscopic = np.zeros((6 * count + 6,) * 2)
    gyroscopic[3, 4], gyroscopic[4, 3] = polar * speed, -polar * speed
    return ElasticCarrier(
        name,
        stations,
        tuple(springs),
        link.T @ mass @ link,
        gyroscopic,
        body.frequency,
        link.T @ turned @ body.coupling,
    )


def pin_flexibility(stage: BoxPlanetarySection, angles: Sequence[float]) -> np.ndarray:
    """Compute the compliance (6N, 6N) of all pins of a carrier from a file, along and about x, y, z, its shaft held.

    [m/N, rad/N, rad/(N m)]; pins without rotations of their own have none.

    Parameters
    ----------
    stage : BoxPlanetarySection
        The set; its carrier was read from a file.
    angles : (N,) floats
        Of the planets [rad].
    """
    body, count = _unpacked(stage.superelement), len(angles)
    components = len(body.compliance) // count
    way = body.pins[0] - body.seat
    turn = pin_axes(angles[0] - math.atan2(way[1], way[0])).T
    turned = np.kron(np.eye(count), np.kron(np.eye(components // 3), turn))
    flexibility = np.zeros((count, 6, count, 6))
    whole = (turned @ body.compliance @ turned.T).reshape(count, components, count, components)
    flexibility[:, :components, :, :components] = whole
    return flexibility.reshape(6 * count, 6 * count)


def with_carriers(system: MechanicalSystem, assembly: Assembly, carriers: Sequence[ElasticCarrier]) -> MechanicalSystem:
    """Join the inner modes of carriers to a system, whose first coordinates are the free motions of the assembly."""
    free = assembly.motions.shape[1]
    for carrier in carriers:
        size, count = len(system.dofs), len(carrier.frequency)
        names = [f"{carrier.name}: mode {i + 1}" for i in range(count)]
        system = with_modal_body(system, carrier.frequency**2, np.zeros((count, system.W.shape[1])), names)
        mass = np.array(system.M)
        mass[:free, size:] = assembly.motions.T @ carrier.on_all_motions(assembly.count)
        mass[size:, :free] = mass[:free, size:].T
        system = replace(system, M=mass)
    return system


def _unpacked(section: SuperelementSection | None) -> CarrierBody:
    """Arrays of a carrier that was read from a file."""
    from femgear.exchange.carrier_files import CarrierBody

    assert section is not None
    pins = np.reshape(section.pins, (-1, 3))
    compliance, mass = (_symmetric(triangle) for triangle in (section.compliance, section.mass))
    frequency = np.array(section.frequency)
    coupling = np.reshape(section.coupling, (len(mass), len(frequency)))
    return CarrierBody(np.array(section.seat), pins, compliance, mass, frequency, coupling)


def _symmetric(triangle: Sequence[float]) -> np.ndarray:
    """Symmetric matrix (n, n) of its lower triangle, row by row."""
    size = math.isqrt(2 * len(triangle))
    matrix = np.zeros((size, size))
    matrix[np.tril_indices(size)] = triangle
    return matrix + np.tril(matrix, -1).T


def superelement_problems(stage: BoxPlanetarySection, sizes: StageSizes, key: str) -> Iterator[CaseError]:
    """List why a carrier from a file does not fit its set."""
    body, section, where = stage.carrier_body, stage.superelement, f"{key}.carrier_body.file"
    if body is None or section is None:
        return
    forms = body.given("wind_up_stiffness", "web_outer_diameter", "web_inner_diameter")
    if forms:
        yield CaseError(
            "a carrier from a file winds up by itself",
            code="E-CHOICE",
            key=f"{key}.carrier_body.{forms[0]}",
            limit="file, or closed forms",
            remedy=f"leave file or {', '.join(forms)} out",
        )
    planets, lengths = len(sizes.planet_angles), {name: len(getattr(section, name)) for name in _SUPERELEMENT}
    size = [6 + count * planets for count in (3, 6)]
    shapes = [
        (n - 6) * (n - 5) // 2 == lengths["compliance"]
        and n * (n + 1) // 2 == lengths["mass"]
        and n * lengths["frequency"] == lengths["coupling"]
        for n in size
    ]
    if lengths["pins"] != 3 * planets or not any(shapes):
        yield CaseError(
            f"the carrier of the file has other pins than those of {planets} planets",
            code="E-COUNT",
            key=where,
            value=f"{lengths['pins'] / 3:g} pins",
            limit=f"{planets} pins, of 3 or 6 components",
            remedy="name the seats pin 1 and so on in the table of nodes, one for every planet",
        )
        return
    arms = np.reshape(section.pins, (-1, 3)) - np.array(section.seat)
    yield from _misplaced_pins(arms, np.array(sizes.planet_angles), sizes.centre_distance, where)


def _misplaced_pins(arms: np.ndarray, angles: np.ndarray, radius: float, where: str) -> Iterator[CaseError]:
    """Pins (N, 3), from the seat [m], that are not where the planets are."""
    out = np.hypot(arms[:, 0], arms[:, 1])
    times = float(np.median(out)) / radius
    if 300.0 < max(times, 1.0 / (times + 1e-9)) < 3000.0:
        yield CaseError(
            f"the pins lie at {times:.4g} times the centre distance: lengths of the file look like "
            f"{'mm' if times > 1 else 'm'}",
            code="E-UNITS",
            key=where,
            limit='units = "SI" or "mm-t-s"',
            remedy="give carrier_body.units of the file",
        )
        return
    off = np.hypot(out - radius, arms[:, 2] - arms[0, 2])
    if off.max() > _OFF_CIRCLE * radius:
        worst = int(off.argmax())
        yield CaseError(
            "pins of the carrier miss their circle around the seat on the shaft",
            code="E-RANGE",
            key=where,
            value=f"pin {worst + 1} at {LENGTH.show(float(out[worst]))} from the axis, z "
            f"{LENGTH.show(float(arms[worst, 2] - arms[0, 2]))} from pin 1",
            limit=f"{LENGTH.show(radius)}, the centre distance, in one plane",
            remedy="put the seats into the middles of the planets, and that of the shaft on the axis, which is z",
        )
        return
    around = np.arctan2(arms[:, 1], arms[:, 0])
    apart = np.angle(np.exp(1j * ((around - around[0]) - (angles - angles[0]))))
    if np.abs(apart).max() > _OFF_CIRCLE:
        worst = int(np.abs(apart).argmax())
        yield CaseError(
            "pins of the carrier stand at other angles than the planets",
            code="E-RANGE",
            key=where,
            value=f"pin {worst + 1}, {math.degrees(around[worst] - around[0]) % 360.0:.5g} deg from pin 1",
            limit=f"{math.degrees(angles[worst] - angles[0]) % 360.0:.5g} deg",
            remedy="name the pins in the order of the planets, counter-clockwise about z",
        )
