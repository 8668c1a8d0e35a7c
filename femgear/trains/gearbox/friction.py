"""Friction of the teeth that acts in a gearbox: its coefficients, and what the teeth of an elastic ring know of it.

Section ``losses`` of the gearbox decides, with ``excites``. Friction is in the loaded period of the teeth that excites
the response, and a source there; the deflection of shafts and casing, whose mean loads it changes by its share of some
per cent, is that without.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from femgear.case import text as case_text
from femgear.case.gear_set import planetary_set
from femgear.case.quantities import RPM
from femgear.case.tooth_friction import NOTICEABLE_CHANGE, friction_acts, rubbing_coefficients
from femgear.errors import CaseError
from femgear.findings import Finding, percent
from femgear.gears.pair import GearSet
from femgear.trains.gearbox.case_file import CASING, BoxPlanetarySection, GearboxCase, PairSection, teeth_of
from femgear.trains.gearbox.model import GearboxModel, StageModel, gearbox_model, reference_shaft

_LEFT_OUT = ("seal", "bearings", "torque_shares", "speed_shares")
"""Entries of the section ``losses`` that say nothing of the teeth."""


def friction_excites(case: GearboxCase) -> bool:
    """Tell whether friction acts on teeth of a gearbox: where contacts of stages are computed."""
    stages = (*case.pair, *case.planetary)
    return friction_acts(case) and case.deflection.contact and any(stage.teeth for stage in stages)


def first_speed(model: GearboxModel, section: PairSection | BoxPlanetarySection) -> float:
    """Find the speed of gear 1, or of the sun, against the carrier [rad/s]."""
    speed = {CASING: 0.0, **model.flow.speed}
    first = section.shafts[0] if isinstance(section, PairSection) else section.sun
    return speed[first] - speed[section.carrier or CASING]


def stage_friction(
    model: GearboxModel, stage: StageModel, gears: GearSet, speed_share: float = 1.0
) -> tuple[float, ...] | None:
    """Compute the coefficients of friction of a stage at a share of the speeds of the load case; None where none acts.

    Of every kind of mesh, over the force in the transverse section, and negative where the last gear drives: see
    `femgear.contact.flank_friction.window_friction`.
    """
    if not friction_acts(model.case):
        return None
    torque = -model.flow.first_torque(stage.section)
    frequency = speed_share * abs(model.flow.mesh_frequency[stage.name])
    if not torque or not frequency:
        return None
    drives = torque * first_speed(model, stage.section) > 0.0
    return rubbing_coefficients(model.case, gears, torque, frequency, abs(stage.sizes.base_helix), drives=drives)


def rubbing_tables(model: GearboxModel, stage: StageModel, tables: dict[str, Any]) -> dict[str, Any]:
    """Give the tables of the teeth of a set with an elastic ring the friction and the mesh frequency of the gearbox.

    CaseError: a sun that turns clockwise against its carrier (E-FRICTION).
    """
    if not friction_acts(model.case):
        return tables
    turns, section = first_speed(model, stage.section), stage.section
    assert isinstance(section, BoxPlanetarySection)
    if turns < 0.0:
        key = f"planetary[{model.case.planetary.index(section)}].elastic_ring"
        raise CaseError(
            f"friction on an elastic ring needs a sun of {stage.name} that turns counter-clockwise against its carrier",
            code="E-FRICTION",
            key=key,
            file=model.case.location(key),
            remedy="turn all torques and speeds of the load case round, or leave losses.excites out",
        )
    if not turns:
        return tables
    given = case_text.parse(model.case.source, "")
    losses = {key: value for key, value in given["losses"].items() if key not in _LEFT_OUT}
    sun, _, ring = stage.sizes.teeth
    # with the ring fixed the sun turns so much faster than against its carrier
    return {
        **tables,
        "losses": losses | {"bearings": False},
        **({"lubricant": given["lubricant"]} if "lubricant" in given else {}),
        "operation": tables["operation"] | {"speeds": [f"{turns * (1.0 + sun / ring) / RPM:.15g} rpm"]},
    }


def box_friction_findings(case: GearboxCase) -> Iterator[Finding]:
    """Tell friction that has another coefficient at speeds of the run-up (W-FRICTION), or acts nowhere (W-UNUSED)."""
    if not friction_acts(case):
        return
    for entry, there, of in (
        ("balance", case.balance.harmonics and any(stage.teeth for stage in case.planetary), " of planetary stages"),
        ("transient", case.transient is not None, ""),
    ):
        if there:
            text = f"has no effect in [{entry}]{of}: friction acts there in the response and its run-up alone"
            yield Finding("W-UNUSED", "losses.excites", text)
    if not friction_excites(case):
        text = "has no effect: no stage has teeth whose contact is computed"
        yield Finding("W-UNUSED", "losses.excites", text, remedy="give teeth of a stage, or leave it out")
        return
    model = gearbox_model(case)
    nominal = abs(model.flow.speed[reference_shaft(model)])
    if case.runup.count and nominal:
        ends = case.runup.start or 0.25 * nominal, case.runup.to or 1.25 * nominal
        yield from _at_other_speeds(model, {end: end / nominal for end in ends})


def _at_other_speeds(model: GearboxModel, shares: dict[float, float]) -> Iterator[Finding]:
    """Tell the stage whose coefficient of friction changes most to speeds [rad/s], shares of that of the load case."""
    largest = None
    for stage in model.stages:
        if (teeth := teeth_of(stage.section)) is None or not model.flow.touches(stage.section):
            continue
        gears = planetary_set(teeth)
        nominal = stage_friction(model, stage, gears)
        for speed, share in shares.items() if nominal else ():
            for there, here in zip(stage_friction(model, stage, gears, share) or (), nominal or (), strict=False):
                change = abs(there / here) - 1.0
                if largest is None or abs(change) > abs(largest[0]):
                    largest = change, stage.name, speed, abs(here), abs(there)
    if largest is None or abs(largest[0]) <= NOTICEABLE_CHANGE:
        return
    change, name, speed, here, there = largest
    text = (
        f"friction acts at all speeds with the coefficient of the load case, {here:.3g} at {name}; "
        f"at {speed / RPM:.5g} rpm of {reference_shaft(model)} it would be {there:.3g}, {percent(change, signed=True)}"
    )
    remedy = "compute other speeds as load cases of their own"
    yield Finding("W-FRICTION", "losses.friction", text, remedy=remedy, limit=f"within {percent(NOTICEABLE_CHANGE)}")
