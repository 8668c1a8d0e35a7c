"""Two-way response against one linear system of all harmonics (`validation.reference.two_way_direct`)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femgear.housing.two_way.response import MeshPaths, solve_two_way
from femgear.housing.two_way.structure import supported_ring
from femgear.solvers.linear.modal import modal_damping, undamped_modes
from femgear.stages.static import solve_static
from femgear.trains.elastic import stages as elastic
from femgear.trains.elastic.fixed_housing import HousingModel
from femgear.trains.reading import with_values
from validation.cases import reference_case
from validation.fixed_housing import (
    EQUAL,
    FEET,
    excitation,
    feet,
    gears,
    joined,
    rigid_modes,
    shaken,
    thin_ring,
)
from validation.reference.two_way_direct import direct_damped_forces, direct_forces, farthest_apart
from validation.rows import Row, at_most

_DIRECT, _GATE = "one linear system", 1e-9
_CARRIER = 27 / (27 + 108) * 2 * np.pi / 60
"""Speed of the carrier of the reference set over that of its sun, [rad/s] over rpm."""


def _row(words: str, apart: float) -> Row:
    return at_most("one system", _DIRECT, f"{words}: mesh forces over the largest that fluctuates", _GATE, apart)


def small_sets() -> tuple[Row, ...]:
    """Three planets on a thin ring on irregular feet: one planet, all of them, errors that turn, and damping."""
    rows, speeds = list[Row](), np.array([20.0, 60.0])
    for sense in (1, -1):
        words = "forwards" if sense > 0 else "backwards"
        for symmetry in (3, 1):
            paths = MeshPaths(97, EQUAL, 0.1, symmetry)
            drive, structure = excitation(paths, sense), feet(4)
            modes = rigid_modes(paths, drive)
            for coupled in (4, 2):
                options = {"harmonics": (2, 4), "coupled_diameters": coupled, "tolerance": 1e-13}
                response = solve_two_way(modes, drive, structure, paths, sense * speeds, **options)
                apart = 0.0
                for i, speed in enumerate(sense * speeds):
                    direct = direct_forces(
                        modes, drive, structure, paths, float(speed), harmonics=(2, 4), coupled=coupled
                    )
                    apart = max(apart, farthest_apart(response, i, *direct))
                unknown = "one planet for all" if symmetry > 1 else "every planet"
                rows.append(_row(f"four feet, {words}, {unknown}, n up to {coupled} of 4 coupled", apart))
    paths = MeshPaths(97, EQUAL, 0.1, 1)
    drive, structure = shaken(paths, 3), feet(3)
    modes = rigid_modes(paths, drive)
    response = solve_two_way(modes, drive, structure, paths, [40.0], harmonics=(2, 3), tolerance=1e-13)
    direct = direct_forces(modes, drive, structure, paths, 40.0, harmonics=(2, 3), coupled=3)
    rows.append(_row("four feet, errors that turn over three mesh periods", farthest_apart(response, 0, *direct)))
    return (*rows, *_damped())


def _damped() -> tuple[Row, ...]:
    """Modal damping of gears and ring as a whole, which the feet do not change."""
    rows, paths, ring = list[Row](), MeshPaths(37, EQUAL, 0.1, 1), thin_ring(2, foundation=2e10)
    structure = supported_ring(ring, FEET, max_diameter=2, max_frequency=1e6, damping_ratio=0.03)
    for sense in (1, -1):
        drive = excitation(paths, sense)
        mean = drive.stiffness.mean(axis=1)
        matrix = modal_damping(joined(paths, ring, 2), mean, 0.04)
        modes = undamped_modes(gears(EQUAL), mean, damping_ratio=0.04)
        options = {"harmonics": (2, 6), "tolerance": 1e-13}
        response = solve_two_way(modes, drive, structure, paths, [20.0 * sense], damping=matrix, **options)
        direct = direct_damped_forces(modes, drive, structure, paths, 20.0 * sense, matrix, harmonics=(2, 6))
        words = f"four feet, damping of gears and ring as a whole, {'forwards' if sense > 0 else 'backwards'}"
        rows.append(_row(words, farthest_apart(response, 0, *direct)))
    return tuple(rows)


def _support(angle: float) -> dict[str, str]:
    stiffness = {"radial_stiffness": "4e8 N/m", "tangential_stiffness": "4e8 N/m"}
    return stiffness | {"angle": f"{angle} deg", "width": "12 mm", "mass": "20 g"}


_SUPPORTS = {"six bolts": range(15, 375, 60), "four uneven feet": (35, 145, 215, 325)}


def reference_set() -> tuple[Row, ...]:
    """The reference set on bolts and on feet: six harmonics of the excitation, twelve of the response.

    Gears and structure have the modal damping of their own; three unequal planets have four and six harmonics.
    """
    rows = list[Row]()
    for words, angles in _SUPPORTS.items():
        entries = {"housing.form": "exact", "housing.support": [_support(angle) for angle in angles]}
        for rpm in (250, 1000, 3100) if words == "six bolts" else (3100,):
            rows.append(_row(f"reference set, {words}, {rpm} rpm, harmonics 6 and 12", _apart(entries, rpm, (6, 12))))
    pin = {"set.pin_errors": [{"planet": 2, "tangential": "3 um"}]}
    apart = _apart(entries | pin, 3100, (4, 6))
    rows.append(_row("reference set, four uneven feet, a pin 3 um off, 3100 rpm, harmonics 4 and 6", apart))
    return tuple(rows)


def _apart(entries, rpm: float, harmonics: tuple[int, int]) -> float:
    case = with_values(reference_case(), entries)
    modes = elastic.solve_modes(case, solve_static(case))
    there = HousingModel(case, modes, 1.0).in_housing()
    ratio = case.dynamics.damping_ratio
    gears_alone = replace(there.gears, damping_ratio=np.full_like(there.gears.damping_ratio, ratio))
    set_in = gears_alone, there.excitation, there.structure, there.paths
    options = {"harmonics": harmonics, "coupled_diameters": there.coupled, "tolerance": 1e-12}
    response = solve_two_way(*set_in, [_CARRIER * rpm], **options)
    direct = direct_forces(*set_in, _CARRIER * rpm, harmonics=harmonics, coupled=there.coupled)
    return farthest_apart(response, 0, *direct)
