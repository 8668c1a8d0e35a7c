"""Train "pair": two gears on a centre distance from their teeth, static contact and stresses.

Stages, files and pictures are those of the static solution of a planetary set, with one mesh; beside the
mesh stiffness of the finite elements stands that of ISO 6336-1, method B.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from femgear.case.gear_set import planetary_set
from femgear.case.quantities import RPM
from femgear.errors import Finding, GeometryError
from femgear.gears.checks import check_meshes
from femgear.gears.iso6336 import pair_mesh_stiffness
from femgear.report.tables import Block, chosen, tabulate
from femgear.trains.pair.case_file import PairCase
from femgear.trains.protocol import Figures, Train
from femgear.trains.static.figures import FIGURES
from femgear.trains.static.results import (
    describe_gears,
    describe_meshes,
    describe_static,
    load_warnings,
)
from femgear.trains.static.stages import STATIC, STRESS

if TYPE_CHECKING:
    from femgear.storage.results import Results

_CAPTIONS = {
    "static_transmission_error": (
        "Static transmission error over one mesh period along the line of action: gear 1 against gear 2, "
        "which is held."
    ),
    "deformed_set": (
        "Deformed pair under the static load at position 0, whole and at the pitch point; at rest in grey. "
        "The teeth that carry bend; what is pale hardly moves."
    ),
}


def iso_stiffness(case: PairCase) -> tuple[float, float]:
    """Compute c' and c_gamma_alpha of ISO 6336-1, method B, of a case [N/m^2].

    Both are NaN where the profile shifts are outside the range of the method; they hold for steel and solid
    discs, see `femgear.gears.iso6336.mesh_stiffness_method_b`.
    """
    try:
        return pair_mesh_stiffness(planetary_set(case).kinds[0], case.helix_angle or 0.0)
    except GeometryError:
        return math.nan, math.nan


def _describe_case(case: PairCase) -> tuple[Block, ...]:
    """Tabulate geometry and operation of a pair."""
    gears, operation = planetary_set(case), case.operation
    ratio = gears.senses[1] * case.gear_1.teeth / case.gear_2.teeth
    columns = {
        "gear 1 [rpm]": lambda speed: f"{speed / RPM:.4f}",
        "gear 2 [rpm]": lambda speed: f"{ratio * speed / RPM:.4f}",
        "mesh frequency [Hz]": lambda speed: f"{speed * case.gear_1.teeth / (2.0 * math.pi):.4f}",
    }
    shown = [operation.speeds[i] for i in chosen(len(operation.speeds))]
    notes = [f"torque on gear 1 {operation.torque:.6g} N m, on gear 2 {-operation.torque / ratio:.6g} N m"]
    return describe_gears(gears), describe_meshes(gears), tabulate("Operation", shown, columns, notes)


def _describe_static(results: Results) -> Block:
    """Tabulate static.nc, with the stiffness per face width beside that of the standard."""
    case, data = results.case, results.static
    block = describe_static(data, case.module)
    single, mean = (1e-9 * value for value in iso_stiffness(case))
    found = 1e-9 * float(data.mesh_stiffness.mean()) / case.set.face_width
    words = f"mean k over face width {found:.3f} N/(mm um); ISO 6336-1, method B: "
    standard = f"c' = {single:.3f}, c_gamma_alpha = {mean:.3f} N/(mm um)"
    return replace(block, notes=(*block.notes, words + (standard if mean > 0 else "out of range")))


def _warnings(case: PairCase) -> Iterator[Finding]:
    """List what is allowed but deserves a look."""
    yield from (*check_meshes(planetary_set(case)), *case.notices)
    yield from load_warnings(case)


PAIR = Train(
    name="pair",
    words="a pair",
    stages=(replace(STATIC, describe=_describe_static), STRESS),
    describe=_describe_case,
    warnings=_warnings,
    figures={
        name: Figures({**figures.captions, **_CAPTIONS}, figures.draw, figures.write)
        if name == "static"
        else figures
        for name, figures in FIGURES.items()
    },
)
