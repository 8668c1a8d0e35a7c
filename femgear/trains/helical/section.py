"""The section of a case file that makes the teeth helical, and what it goes with."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from femgear.case.checks import steep_helix
from femgear.case.planetary import RigidCase
from femgear.case.quantities import ANGLE, STIFFNESS, TORSION, Count, Quantity, Section
from femgear.case.sections import LARGEST_HELIX, LEFT_OUT, Inertia, Mass, MeshStiffnessSection
from femgear.case.text import CaseFile
from femgear.errors import CaseError
from femgear.findings import Finding
from femgear.stages.lumped_set import (
    entries_with_verb,
    entries_without_effect,
    flank_entries,
    rigid_refusals,
    unheld_member,
)

_MOST_SLICES = 30
# measured with 8 meshes of 10 to 30 slices: the time of one speed grows with the square of the columns
_SECONDS = 2.4e-6
# time that is worth a notice [s]
_LONG = 60.0

# stiffer supports are lost in the rounding of those that mesh springs feel
Stiffness = Annotated[float, Quantity(STIFFNESS, 0.0, 1e14)]
Turning = Annotated[float, Quantity(TORSION, 0.0, 1e13)]


class HelicalBodySection(Section):
    """What sun, carrier and planets need beyond mass, polar inertia and radial support to move in space."""

    diametral_inertia: Inertia = LEFT_OUT
    axial_stiffness: Stiffness = LEFT_OUT
    tilt_stiffness: Turning = LEFT_OUT
    torsional_stiffness: Turning | None = None


class HelicalRingSection(HelicalBodySection):
    """The ring as a rigid body on its support in the housing."""

    mass: Mass = LEFT_OUT
    inertia: Inertia = LEFT_OUT
    support_stiffness: Stiffness = LEFT_OUT


class HelicalSection(Section):
    """Helical teeth on rigid bodies that move in space: sun, ring, carrier and planets.

    With this section module, pressure angle, racks and profile shifts are those of the normal section, and a
    run solves the set of Kahraman in place of the elastic ring.
    """

    helix_angle: Annotated[float, Quantity(ANGLE, 0.0, LARGEST_HELIX)]
    hand: Literal["right", "left"] = "right"
    slices: Annotated[int, Count(1, _MOST_SLICES)] = 1
    contact_points: Literal["pitch_point", "base_circles"] = "pitch_point"
    section: Literal["normal", "transverse"] = "normal"
    mesh_stiffness: MeshStiffnessSection | None = None
    sun: HelicalBodySection = Field(default_factory=HelicalBodySection)
    ring: HelicalRingSection = Field(default_factory=HelicalRingSection)
    carrier: HelicalBodySection = Field(default_factory=HelicalBodySection)
    planet: HelicalBodySection = Field(default_factory=HelicalBodySection)

    @property
    def signed_helix_angle(self) -> float:
        """Of the sun, positive for a right-handed one [rad]."""
        return self.helix_angle if self.hand == "right" else -self.helix_angle


def helical_notices(data: dict, helix_angle: float) -> Iterator[Finding]:
    """List what deserves a look in a helical case, by the tables of its checked file and its helix [rad]."""
    unused = entries_without_effect(data, lives="mesh_stiffness" not in data["helical"])
    static = data.get("static", {})
    without = ("back_flanks",) if static.get("slices", 0) > 1 else ("stresses", "back_flanks")
    unused += [f"static.{key}" for key in without if key in static]
    if data["planet"].get("bearing_clearance"):
        unused.append("planet.bearing_clearance")
    if unused:
        yield Finding("W-UNUSED", "", f"{entries_with_verb(unused)} no effect in this helical case")
    if data["helical"].get("contact_points") == "base_circles":
        yield Finding(
            "W-CONTACT-POINTS",
            "helical.contact_points",
            'with "base_circles" the mesh forces on both gears do not act on one line, so '
            "that the set is not in equilibrium: pin and support moments are wrong, for 30/20/70 teeth "
            'those of the pins by 13 % (usual: "pitch_point"; frequencies differ by 0.1 %)',
        )
    if "mesh_stiffness" in data["helical"]:
        given = [name for name in ("static", "dynamics") if name in data]
        if "section" in data["helical"]:
            given.append("helical.section")
        given += flank_entries(data)
        if given:
            yield Finding(
                "W-UNUSED",
                "",
                f"{entries_with_verb(given)} no effect while helical.mesh_stiffness is given: it leaves nothing that "
                "excites, and modes are all that is computed",
            )
    else:
        yield from steep_helix("helical.helix_angle", helix_angle)
        yield from _slow_notice(data)


def _slow_notice(data: dict) -> Iterator[Finding]:
    """What many slices cost."""
    slices, angles = data["helical"].get("slices", 1), data["set"].get("planet_angles")
    planets = data["set"]["planets"] if angles is None else len(angles)
    given = data["operation"]["speeds"]
    speeds = given["count"] if isinstance(given, dict) else len(given)
    seconds = _SECONDS * speeds * (2 * planets * slices) ** 2
    time = f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.0f} h"
    if slices > 1 and seconds > _LONG:
        yield Finding(
            "W-SLICES",
            "helical.slices",
            f"{slices} slices of {2 * planets} meshes at {speeds} speeds take "
            f"dynamics about {time} (usual: 8 slices or fewer)",
        )


class HelicalCase(RigidCase):
    """A planetary gear set of rigid bodies with helical gears, which move in space."""

    train: ClassVar[str] = "helical"
    helical: HelicalSection

    @property
    def helix_angle(self) -> float:
        """At the reference cylinder, positive of a right-handed sun [rad]."""
        return self.helical.signed_helix_angle


def check_helical(case: HelicalCase) -> Iterator[CaseError]:
    """Refuse what a helical section does not go with."""
    helical = case.helical
    if helical.helix_angle == 0.0:
        yield CaseError(
            "without a helix the teeth are spur teeth",
            code="E-RANGE",
            key="helical.helix_angle",
            value="0 deg",
            limit=f"above 0 deg up to {ANGLE.show(LARGEST_HELIX)}",
            remedy="leave the section helical out",
        )
    if case.set.helix_angle:
        yield CaseError(
            "the section helical has the helix angle",
            code="E-RANGE",
            key="set.helix_angle",
            value=ANGLE.show(case.set.helix_angle),
            remedy="leave set.helix_angle out",
        )
    if case.static.slices > 1 and helical.slices > 1:
        yield CaseError(
            "the contact over the width gives the stiffness of whole meshes",
            code="E-SLICES",
            key="helical.slices",
            value=helical.slices,
            remedy="leave helical.slices or static.slices out",
        )
    yield from rigid_refusals(case, "helical", without_torque=", so there is no mesh stiffness")
    fixed = case.operation.fixed
    if getattr(helical, fixed).torsional_stiffness == 0.0:
        yield unheld_member(
            case,
            f"helical.{fixed}.torsional_stiffness",
            "leave the entry out to hold the member, or hold another one",
        )


FILE = CaseFile(HelicalCase, check_helical, lambda tables, case: helical_notices(tables, case.helical.helix_angle))
