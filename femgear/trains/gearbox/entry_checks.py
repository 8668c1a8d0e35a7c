"""What entries of a gearbox case are refused for that the rest of the file makes wrong: bodies without mass, couplings.

A shaft without parts is one rigid body: its mass is that of [[mass]], of teeth that are given, of a carrier from a
file, or of what is rigidly tied to it. Without any, its motions have no inertia and the modes no solution.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from femgear.case.quantities import LENGTH, SPEED
from femgear.errors import CaseError
from femgear.trains.gearbox.case_file import CASING, BoxCouplingSection, GearboxCase
from femgear.trains.gearbox.geometry import DISTANCE_TOLERANCE


def massless_bodies(case: GearboxCase) -> Iterator[CaseError]:
    """Refuse shafts that are one rigid body without mass, and that nothing with mass is rigidly tied to."""
    moving = {
        *(mass.shaft for mass in case.mass),
        *(name for stage in case.pair if stage.teeth is not None for name in stage.shafts),
        *_with_mass_of_sets(case),
        *(name for coupling in case.coupling if _rigid(coupling, case.motions) for name in coupling.between),
        *_held_fast(case),
    }
    for number, shaft in enumerate(case.shaft):
        if not shaft.part and shaft.name not in moving:
            yield CaseError(
                f"shaft {shaft.name} is one rigid body without mass",
                code="E-KEY-MISSING",
                key=f"shaft[{number}].part",
                value=f"no part, no [[mass]] on {shaft.name}, no gear whose teeth are given",
                limit="a shaft with parts, or with the mass of something that sits on it",
                remedy=f'give [[mass]] with shaft = "{shaft.name}", mass and inertia, or part',
            )


def check_shafts_have_mass(case: GearboxCase) -> None:
    """Refuse shafts with parts of no density (E-MASS): deflection needs none, motion does."""
    for number, shaft in enumerate(case.shaft):
        if shaft.part and case.material_of(shaft).density == 0.0:
            raise CaseError(
                f"shaft {shaft.name} has no mass, and so no motion",
                code="E-MASS",
                key="material.density" if shaft.material is None else f"shaft[{number}].material.density",
                value="0 kg/m^3",
                limit="above 0; deflection alone needs none (--only deflection)",
                remedy="give the density, steel has 7850 kg/m^3",
            )


def _with_mass_of_sets(case: GearboxCase) -> Iterator[str]:
    """Shafts with the mass of sun, carrier or ring of teeth, of a carrier from a file, or of planets on stiff pins."""
    for stage in case.planetary:
        if stage.teeth is not None:
            yield from (stage.sun, stage.carrier, stage.ring)
        bearing = stage.planet.bearing
        stiff = bearing is None or all(map(math.isinf, (bearing.radial, bearing.axial, bearing.tilt)))
        if stage.superelement is not None or (stiff and stage.pins is None):
            yield stage.carrier


def _rigid(coupling: BoxCouplingSection, motions: str) -> bool:
    """Whether a coupling leaves no motion between both shafts."""
    across = (coupling.radial,) if motions == "plane" else (coupling.radial, coupling.axial, coupling.bending)
    return all(map(math.isinf, (coupling.torsion, *(across if motions != "rotation" else ()))))


def _held_fast(case: GearboxCase) -> Iterator[str]:
    """Shafts that do not turn, and that nothing or a rigid bearing lets move: they need no mass."""
    rigid = {bearing.shaft for bearing in case.bearing if bearing.radial is not None and math.isinf(bearing.radial)}
    for name in case.operation.fixed:
        if case.motions == "rotation" or name in rigid:
            yield name


def coupling_problems(case: GearboxCase) -> Iterator[CaseError]:
    """Refuse couplings of a shaft with itself, and of shafts whose axes lie apart where these may move."""
    axes = {shaft.name: shaft.axis for shaft in case.shaft}
    for number, coupling in enumerate(case.coupling):
        first, second = coupling.between
        named = f"coupling {coupling.name or number + 1}"
        if first == second:
            yield CaseError(
                f"{named} joins a shaft with itself",
                code="E-CHOICE",
                key=f"coupling[{number}].between",
                value=first,
                limit=f"two shafts, or a shaft and the {CASING}",
                remedy="name the other shaft, or leave the coupling out",
            )
        elif case.motions != "rotation" and {first, second} <= axes.keys():
            apart = math.dist(axes[first], axes[second])
            if apart > DISTANCE_TOLERANCE:
                yield CaseError(
                    f"{named} joins shafts whose axes lie apart",
                    code="E-CENTRE-DISTANCE",
                    key=f"coupling[{number}].between",
                    value=f"axes of {first} and {second} {LENGTH.show(apart)} apart",
                    limit="one axis",
                    remedy="correct shaft.axis, or join the shafts by a [[pair]] of gears",
                )


def run_up_problems(case: GearboxCase) -> Iterator[CaseError]:
    """Refuse a run-up of several speeds that are one."""
    start, stop, count = case.runup.start, case.runup.to, case.runup.count
    if start is not None and stop is not None and start == stop and count > 1:
        yield CaseError(
            "the run-up ends at the speed that it begins with",
            code="E-RANGE",
            key="runup.to",
            value=f"{SPEED.show(stop)}, {count} times",
            limit=f"another speed than from, {SPEED.show(start)}",
            remedy="correct from or to, or write count = 1",
        )
