"""Why a gearbox has no response, and which entries have no effect then.

Stages whose teeth are computed, or that have contact ratios, excite a gearbox, and only while it turns. Sensors are
left with the modes. Where teeth part weight excites too: it turns against the planets of a carrier.
"""

from __future__ import annotations

from collections.abc import Iterator

from femgear.findings import Finding
from femgear.trains.gearbox.case_file import CASING, BoxPlanetarySection, GearboxCase, PairSection
from femgear.trains.gearbox.power import gearbox_flow


def exciting_sections(case: GearboxCase) -> list[PairSection | BoxPlanetarySection]:
    """List the stages that excite a gearbox where they carry: by the contact of their teeth, or by contact ratios."""
    every = (*case.pair, *case.planetary)
    return [stage for stage in every if stage.counts_pairs or (stage.teeth and case.deflection.contact)]


def _silence(case: GearboxCase) -> tuple[str, str]:
    """Why a case has no response, and what to do about it; empty where it has one."""
    every = (*case.pair, *case.planetary)
    stages = [stage for stage in every if stage.teeth or stage.counts_pairs]
    if not stages:
        return "no stage has teeth or contact ratios that excite it", "give teeth or contact_ratio of a stage"
    stages = exciting_sections(case)
    if not stages:
        return "deflection.contact = false leaves the teeth, which excite it, out", "leave deflection.contact out"
    flow, first = gearbox_flow(case), "operation.first"
    if not any(flow.carries(stage) for stage in stages):
        why = "no stage that excites it carries a torque"
        return why, f"give a torque that is not zero in the load case of {first}"
    reference = flow.independent[0] if flow.independent else case.shaft[0].name
    if not flow.speed[reference]:
        return "nothing turns", f"give a speed that is not zero in the load case of {first}"
    if not any(flow.carries(stage) and flow.passes(stage) for stage in stages):
        why = "the stages that carry turn as a block: no teeth pass one another"
        return why, f"give speeds that differ in the load case of {first}"
    return "", ""


def silence_words(case: GearboxCase) -> str:
    """Say why a case has no response and what gives one, empty where it has one."""
    return ": ".join(filter(None, _silence(case)))


def why_silent(case: GearboxCase) -> str:
    """Tell why a case has no response, empty where it has one."""
    return _silence(case)[0]


def weighed_sections(case: GearboxCase) -> list[BoxPlanetarySection]:
    """List the planetary stages of a given stiffness on a carrier that turns, which weight lets rattle.

    Only where no stage excites: beside one they move with it.
    """
    if case.gravity is None or exciting_sections(case):
        return []
    flow = gearbox_flow(case)
    return [
        stage
        for stage in case.planetary
        if None not in (stage.sun_mesh, stage.ring_mesh)
        and stage.carrier != CASING
        and flow.carries(stage)
        and flow.speed[stage.carrier]
    ]


def why_no_balance(case: GearboxCase) -> str:
    """Tell why no teeth of a case are looked at that might part, empty where they are."""
    return "" if weighed_sections(case) else why_silent(case)


def idle_entries(case: GearboxCase) -> Iterator[Finding]:
    """Tell sensors, a run-up and a balance of a gearbox that has no response (W-UNUSED)."""
    if not (case.sensor or case.runup.count or case.balance.harmonics):
        return
    why, remedy = _silence(case)
    weighed = case.balance.harmonics and weighed_sections(case)
    if why and case.sensor and not weighed:
        text = f"the gearbox has no response that sensors could feel, modes at them are all: {why}"
        yield Finding("W-UNUSED", "sensor", text, remedy=remedy)
    if why and case.runup.count:
        text = f"the run-up has no effect, since the gearbox has no response: {why}"
        yield Finding("W-UNUSED", "runup", text, remedy=remedy)
    if why and case.balance.harmonics and not weighed:
        yield Finding("W-UNUSED", "balance", f"no teeth are looked at that might part: {why}", remedy=remedy)
