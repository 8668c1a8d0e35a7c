"""Planets that are shafts of their own: what carries them around, and how their teeth stand to one another.

Any set of gears around a carrier is made of such planets and of pairs that name the carrier: stepped planets, pairs of
planets in mesh, several suns and rings. Statics, modes and response see them where they stand; both gears of a pair
turn against the carrier.

Pairs that have a gear in common excite with fixed phases. Of a gear of pitch p that meshes at the angles psi_A and
psi_B, with half tooth thicknesses eta and its loaded flanks on the sides f = +-1 of its teeth, the second mesh is ahead
of the first by ``s ((psi_A - psi_B) - (f_A eta_A - f_B eta_B)) / p`` mesh periods where the gear turns in the sense s
against the carrier (as `femgear.gears.planetary.PlanetarySet.mesh_phases`; R. G. Parker and J. Lin, J. Mech. Des. 126,
2004, 365-370). Around a closed chain of gears the sum is whole, or the planets do not assemble.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from femgear.case.gear_set import planetary_set
from femgear.errors import CaseError
from femgear.findings import Finding
from femgear.trains.gearbox.case_file import CASING, GearboxCase, PairSection, teeth_of
from femgear.trains.gearbox.geometry import DISTANCE_TOLERANCE, carriers, pair_sizes
from femgear.trains.gearbox.planet_branches import ASSEMBLY_TOLERANCE, are_unequal, running_sets
from femgear.trains.gearbox.power import BoxFlow, gearbox_flow


@dataclass(frozen=True)
class _MeshingGear:
    """A gear in one of its meshes.

    Parameters
    ----------
    shaft : str
        That it sits on.
    place : float
        Middle of its face width along z [m].
    teeth : int
        Their number.
    angle : float
        Direction from its axis to the pitch point [rad].
    thickness : float
        Half of the thickness of its teeth on the working pitch circle, towards the loaded flank positive [rad].
    sense : float
        In which it turns against the carrier, 1 counter-clockwise; 0 where it stands.
    """

    shaft: str
    place: float
    teeth: int
    angle: float
    thickness: float
    sense: float

    def is_same(self, other: _MeshingGear, *, long: bool) -> bool:
        """Whether both are one gear, or with ``long`` equal ones of a shaft: of a planet as wide as its mates lie."""
        near = long or abs(self.place - other.place) <= DISTANCE_TOLERANCE
        return (self.shaft, self.teeth) == (other.shaft, other.teeth) and near

    def ahead(self, other: _MeshingGear) -> float:
        """Mesh periods by which the mesh of the other one, the same gear, is ahead of this one."""
        turned = (self.angle - other.angle) - (self.thickness - other.thickness)
        return self.sense * turned * self.teeth / (2.0 * math.pi)


def turning_carriers(case: GearboxCase, flow: BoxFlow) -> list[str]:
    """List the carriers of planets that are shafts of their own, as far as they turn."""
    return [name for name in dict.fromkeys(carriers(case).values()) if flow.speed[name]]


def carrier_entries(case: GearboxCase, stage: PairSection, key: str) -> Iterator[CaseError]:
    """Refuse a pair on a carrier that carries none of its gears, or whose planets turn in no bearing of it."""
    if stage.carrier is None:
        return
    if stage.carrier in stage.shafts:
        yield CaseError(
            "the carrier has a gear of the pair",
            code="E-CHOICE",
            key=f"{key}.carrier",
            value=stage.carrier,
            limit="a shaft without a gear of this pair",
            remedy="leave the carrier out of a pair whose axes stand",
        )
        return
    planets = [shaft for shaft in stage.shafts if carriers(case).get(shaft) == stage.carrier]
    if not planets:
        yield CaseError(
            "both gears turn about the axis of the carrier: none is a planet",
            code="E-CHOICE",
            key=f"{key}.carrier",
            value=stage.carrier,
            limit="one gear beside the axis of its carrier",
            remedy="leave the carrier out, or correct the axes",
        )
    for planet in planets:
        if not any(bearing.shaft == planet and bearing.outer_shaft == stage.carrier for bearing in case.bearing):
            yield CaseError(
                f"the planet {planet} turns in no bearing of its carrier",
                code="E-MECHANISM",
                key=f"{key}.carrier",
                value=stage.carrier,
                limit=f'a [[bearing]] with shaft = "{planet}" and outer_shaft = "{stage.carrier}"',
                remedy="give the bearings of the planet on its pin",
            )


def unlike_planets(case: GearboxCase, flow: BoxFlow, key: str, remedy: str) -> Iterator[CaseError]:
    """Refuse planets that are shafts whose masses and springs depend on the angle of their carrier (E-TURNING).

    Of an entry ``key`` that lets teeth part, with what to do.
    """
    sets = {running.branches[0].carrier: running for running in running_sets(case)}
    for carrier in turning_carriers(case, flow):
        running, limit = sets.get(carrier), "equal branches, held by gears and bearings on the carrier alone"
        fault = "differ, or are held by something beside it"
        if running is not None:
            limit = "planets without pin_error, timing_error and clearance"
            numbers = {number for pins in running.pins for number in pins}
            gapped = any(case.bearing[number].gapped for number in numbers)
            fault = "have bearings with play" if gapped else "have errors" if are_unequal(case, running) else ""
        if fault:
            yield CaseError(
                f"planets on {carrier} {fault}: masses and springs depend on the angle of the carrier",
                code="E-TURNING",
                key=key,
                value=carrier,
                limit=limit,
                remedy=remedy,
            )


def unclosed_chains(case: GearboxCase, flow: BoxFlow) -> Iterator[CaseError]:
    """Refuse planets whose teeth miss the gaps around a closed chain of gears, of which sun and ring are a part."""
    walked = [(stage, missed) for stage, missed in _walked(case, flow)[1] if stage.carrier is not None]
    for stage in case.pair:
        missed = max((away for other, away in walked if other is stage), default=0.0)
        if missed > ASSEMBLY_TOLERANCE:
            yield CaseError(
                f"the planets do not assemble: the teeth of {stage.name} miss their gaps by {missed:.3g} pitches",
                code="E-ASSEMBLY",
                key=f"pair[{case.pair.index(stage)}].shafts",
                value=" and ".join(stage.shafts),
                limit="chains of gears that close to a whole number of teeth",
                remedy="move the planets around to angles that fit: see the page on choosing teeth",
            )


def pair_phases(case: GearboxCase, flow: BoxFlow) -> dict[str, float]:
    """Find the phases of all pairs [mesh periods] against the first one of those that have gears in common.

    A pair of teeth touches at the pitch point of a pair when the mesh periods that have passed and its phase make a
    whole number.
    """
    return _walked(case, flow)[0]


def standing_planets(case: GearboxCase) -> Iterator[Finding]:
    """Tell that planets stand at one angle of a carrier that turns (W-STANDING)."""
    if not carriers(case):
        return
    running = {running_set.branches[0].carrier for running_set in running_sets(case)}
    for name in turning_carriers(case, gearbox_flow(case)):
        if name in running:
            continue
        number = next(i for i, stage in enumerate(case.pair) if stage.carrier == name)
        yield Finding(
            "W-STANDING",
            f"pair[{number}].carrier",
            f"{name} turns, and the planets on it vibrate where they stand in the case: lines have no side bands",
            remedy="equal branches without errors that turn, held by gears and bearings on this carrier alone",
        )


def _walked(case: GearboxCase, flow: BoxFlow) -> tuple[dict[str, float], list[tuple[PairSection, float]]]:
    """Phases of all pairs, and by how many pitches those miss that close a chain."""
    meshes = {stage.name: _meshing_gears(stage, case, flow) for stage in case.pair}
    phases: dict[str, float] = {}
    closing = list[tuple[PairSection, float]]()
    for first in case.pair:
        if first.name in phases:
            continue
        phases[first.name], reached = 0.0, [first]
        for stage in reached:
            for other in case.pair:
                if other is stage or other.carrier != stage.carrier:
                    continue
                long = stage.carrier is not None
                shared = [(a, b) for a in meshes[stage.name] for b in meshes[other.name] if a.is_same(b, long=long)]
                for gear, there in shared:
                    phase = phases[stage.name] + gear.ahead(there)
                    if other.name not in phases:
                        phases[other.name] = phase
                        reached.append(other)
                    else:
                        away = phase - phases[other.name]
                        closing.append((other, abs(away - round(away))))
    return {name: phase % 1.0 for name, phase in phases.items()}, closing


def _meshing_gears(stage: PairSection, case: GearboxCase, flow: BoxFlow) -> tuple[_MeshingGear, _MeshingGear]:
    """Both gears of a pair with their pitch points and loaded flanks."""
    sizes, teeth = pair_sizes(stage), teeth_of(stage)
    # of branches that carry nothing, whose torques are rounding, all have the same flanks
    flank = -1.0 if flow.carries(stage) and flow.first_torque(stage) > 0.0 else 1.0
    halves = tuple(0.5 * math.pi / count for count in sizes.teeth)
    if teeth is not None:
        gears: Any = planetary_set(teeth)
        halves = gears.half_angles
    shafts = [case.shaft_named(name) for name in stage.shafts]
    (x, y), (x_2, y_2) = (shaft.axis for shaft in shafts)
    across = math.atan2(y_2 - y, x_2 - x)
    # the pinion touches an internal gear on its far side, seen alike from both axes
    angles = (across + math.pi,) * 2 if sizes.internal else (across, across + math.pi)
    sides = flank, -flank if sizes.internal else flank
    carrier = flow.speed[stage.carrier or CASING]
    return tuple(  # type: ignore[return-value]
        _MeshingGear(
            shaft.name,
            shaft.start + (stage.positions[number] if stage.positions else 0.0),
            sizes.teeth[number],
            angles[number],
            sides[number] * halves[number],
            float((flow.speed[shaft.name] > carrier) - (flow.speed[shaft.name] < carrier)),
        )
        for number, shaft in enumerate(shafts)
    )
