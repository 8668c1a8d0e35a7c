"""The section of a case file that asks for the set of rigid bodies in their plane, and what it goes with."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import Annotated, ClassVar, Literal

from pydantic import BeforeValidator, Field, StrictBool, model_validator

from femgear.case.planetary import RigidCase, output_member
from femgear.case.quantities import (
    ACCELERATION,
    ANGLE,
    FREQUENCY,
    LENGTH,
    STIFFNESS,
    TORSION,
    Count,
    Quantity,
    Section,
    Title,
    Values,
    printable_line,
)
from femgear.case.sections import LEFT_OUT, DampingRatio, Inertia, Mass, MeshStiffnessSection, Stiffness
from femgear.case.text import CaseFile
from femgear.errors import CaseError
from femgear.findings import Finding
from femgear.stages.lumped_set import (
    Gravity,
    entries_with_verb,
    entries_without_effect,
    flank_entries,
    rigid_refusals,
    unheld_member,
)

# length over which tooth contact sets in [m], of the examples of NREL/CP-5000-55355
_SMOOTHING = 0.3e-6

Frequency = Annotated[float, Quantity(FREQUENCY, 0.01, 1e5)]
Clearance = Annotated[float, Quantity(LENGTH, 0.0, 0.01)]
Torsion = Annotated[float, Quantity(TORSION, 0.0, 1e15)]
Comparison = Annotated[str, BeforeValidator(partial(printable_line, name="comparison", most=600))]

# figures of a planar case that may be compared with published ones
FigureName = Literal[
    "mode_shapes",
    "weight_response",
    "carrier_orbit",
    "planet_bearing_forces",
    "tooth_contact",
    "wedged_teeth",
    "response_orbit",
    "response_bearing_forces",
    "response_mesh_forces",
    "response_spectrum",
    "contact_over_speed",
]


class PlanarRingSection(Section):
    """The ring as a rigid body on its support in the housing."""

    mass: Mass = LEFT_OUT
    inertia: Inertia = LEFT_OUT
    support_stiffness: Annotated[float, Quantity(STIFFNESS, 0.0, 1e15)] = LEFT_OUT


class TorsionSection(Section):
    """Torsional supports of the members; the fixed member is held where it has none."""

    sun: Torsion | None = None
    ring: Torsion | None = None
    carrier: Torsion | None = None


class CarrierBearingSection(Section):
    """A bearing of the carrier beside its support."""

    stiffness: Stiffness
    clearance: Clearance = 0.0
    on: Literal["ring", "housing"] = "housing"


class GravitySection(Section):
    """Weight of all bodies; its direction counts from the x axis when the carrier's phase is zero."""

    acceleration: Annotated[float, Quantity(ACCELERATION, 1e-3, 1e3)] = Gravity.acceleration
    direction: Annotated[float, Quantity(ANGLE, -2 * math.pi, 2 * math.pi)] = Gravity.direction


class BranchSection(Section):
    """Periodic responses to the weight, followed over its frequency in the carrier frame."""

    start: Frequency = Field(alias="from")
    to: Frequency
    harmonics: Annotated[int, Count(1, 60)] = 9
    stability: StrictBool = True
    points: Annotated[int, Count(10, 5000)] = 600


class ResponseSection(Section):
    """Responses to weight and mesh frequency together at the speeds of the operation."""

    carrier_harmonics: Annotated[int, Count(1, 500)] = 3
    side_bands: Annotated[int, Count(0, 100)] = 3


class PlanarPublished(Section):
    """What somebody published: a natural frequency, or a figure and how ours compares with it."""

    kind: Literal["rotational", "translational", "planet"] | None = None
    frequency: Frequency | None = None
    figure: FigureName | None = None
    comparison: Comparison | None = None
    source: Title

    @model_validator(mode="after")
    def _one_of_two(self):
        given = self.given("kind", "frequency", "figure", "comparison")
        if given not in (["kind", "frequency"], ["figure", "comparison"]):
            raise CaseError(
                "a published entry is a frequency with its kind, or a figure with a comparison",
                code="E-CHOICE",
                remedy='write kind = "rotational" and frequency = "69.5 Hz"',
            )
        return self


class PlanarSection(Section):
    """Rigid bodies that move in their plane: sun, ring, carrier and planets.

    With this section a run solves the lumped set of Lin and Parker in place of the elastic ring.
    """

    mesh_stiffness: MeshStiffnessSection | None = None
    line_backlash: Clearance | None = None
    smoothing: Annotated[float, Quantity(LENGTH, 0.0, 1e-3)] = _SMOOTHING
    back_flanks: StrictBool = False
    damping_ratios: Annotated[tuple[DampingRatio, ...], Values(min_length=1, max_length=1000)] | None = None
    gyroscopic: StrictBool = False
    reaction: Literal["supports", "output"] = "output"
    ring: PlanarRingSection = Field(default_factory=PlanarRingSection)
    torsion: TorsionSection = TorsionSection()
    carrier_bearing: CarrierBearingSection | None = None
    gravity: GravitySection | None = None
    branch: BranchSection | None = None
    response: ResponseSection | None = None
    published: Annotated[tuple[PlanarPublished, ...], Field(max_length=100)] = ()


def planar_notices(data: dict) -> Iterator[Finding]:
    """List what a planar case gives without effect, by the tables of its checked file."""
    planar = data["planar"]
    keys = ["tolerance"]
    if "response" not in planar:
        keys += ["mesh_harmonics", "response_harmonics"]
    dynamics = [f"dynamics.{key}" for key in keys if key in data.get("dynamics", {})]
    if unused := entries_without_effect(data, dynamics, lives=True):
        yield Finding("W-UNUSED", "", f"{entries_with_verb(unused)} no effect in this planar case")
    solved = "load_case" in data["operation"]  # the contact of lives
    if "mesh_stiffness" in planar and not solved and (unused := _without_static(data)):
        yield Finding("W-UNUSED", "", f"{entries_with_verb(unused)} no effect while planar.mesh_stiffness is given")
    if "response" in planar and "mesh_stiffness" in planar:
        still = "no weight acts" if "gravity" not in planar else ""
        if data["operation"].get("fixed", "ring") == "carrier":
            still = "the weight does not turn against a carrier that stands"
        if still:
            yield Finding(
                "W-EXCITATION",
                "planar.response",
                f"nothing varies in time, every response is static: planar.mesh_stiffness is constant and {still}",
            )
    if data["planet"].get("bearing_clearance") and not {"branch", "response"} & planar.keys():
        text = "has no effect without planar.branch or planar.response"
        yield Finding("W-UNUSED", "planet.bearing_clearance", text)


def _without_static(data: dict) -> list[str]:
    """Entries that act on the static solution alone, which a given mesh stiffness replaces."""
    unused = ["static"] if "static" in data else []
    if "response" in data["planar"]:
        keys = ("mesh_harmonics", "response_harmonics")
        unused += [f"dynamics.{key}" for key in keys if key in data.get("dynamics", {})]
        unused += ["planar.response.side_bands"] if "side_bands" in data["planar"]["response"] else []
    if data["planar"].get("line_backlash") is not None and "backlash" in data["set"]:
        unused.append("set.backlash")
    return unused + flank_entries(data)


class PlanarCase(RigidCase):
    """A planetary gear set of rigid bodies that move in their plane."""

    train: ClassVar[str] = "planar"
    planar: PlanarSection


def check_planar(case: PlanarCase) -> Iterator[CaseError]:
    """Refuse what a planar section does not go with."""
    planar = case.planar
    yield from rigid_refusals(case, "planar", without_torque=": the planar set would rattle in its play")
    if planar.back_flanks and planar.line_backlash == 0.0:
        yield CaseError(
            "back flanks need play",
            code="E-BACKLASH",
            key="planar.line_backlash",
            value="0 mm",
            limit="above 0 mm",
            remedy="give the play, or write planar.back_flanks = false",
        )
    yield from _check_torsion(case)
    yield from _check_branch(case)


def _check_torsion(case: PlanarCase) -> Iterator[CaseError]:
    """The torque must find a way into the housing."""
    planar, operation = case.planar, case.operation
    output = output_member(case)
    if getattr(planar.torsion, operation.fixed) == 0.0:
        yield unheld_member(case, f"planar.torsion.{operation.fixed}", "leave it out: the fixed member is then held")
    if planar.reaction == "supports" and not getattr(planar.torsion, output):
        yield CaseError(
            f"the torque is to be carried by supports, but the {output}, which is the output, turns freely",
            code="E-MECHANISM",
            key=f"planar.torsion.{output}" if getattr(planar.torsion, output) == 0.0 else "planar.reaction",
            value="supports",
            limit=f"planar.torsion.{output} above 0 N m/rad",
            remedy=f'give planar.torsion.{output}, or write reaction = "output"',
        )


def _check_branch(case: PlanarCase) -> Iterator[CaseError]:
    planar, branch = case.planar, case.planar.branch
    if branch is None:
        return
    if not branch.start < branch.to:
        yield CaseError(
            "the range of frequencies ends before it begins",
            code="E-RANGE",
            key="planar.branch.to",
            value=FREQUENCY.show(branch.to),
            limit=f"above {FREQUENCY.show(branch.start)}, where it begins",
        )
    if planar.gravity is None:
        yield CaseError(
            "the branch follows the response to the weight, and there is none",
            code="E-KEY-MISSING",
            key="planar.gravity",
            remedy="add the section planar.gravity, or leave planar.branch out",
        )
    if case.operation.fixed == "carrier":
        yield CaseError(
            "the weight does not turn against a carrier that stands",
            code="E-MECHANISM",
            key="planar.branch",
            value="operation.fixed = carrier",
            limit="a carrier that turns",
            remedy="leave planar.branch out",
        )
    if planar.gyroscopic:
        yield CaseError(
            "the gyroscopic terms would change along the branch, which is not computed",
            code="E-CHOICE",
            key="planar.gyroscopic",
            value="true",
            limit="false with planar.branch",
            remedy="leave one of them out",
        )


FILE = CaseFile(PlanarCase, check_planar, lambda tables, case: planar_notices(tables))
