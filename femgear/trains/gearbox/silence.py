"""Why a gearbox has no response, and which entries have no effect then.

Only stages whose teeth are computed excite a gearbox, and only while it turns. Sensors are left with the modes.
"""

from __future__ import annotations

from collections.abc import Iterator

from femgear.findings import Finding
from femgear.trains.gearbox.case_file import GearboxCase
from femgear.trains.gearbox.power import gearbox_flow


def why_silent(case: GearboxCase) -> str:
    """Tell why a case has no response, empty where it has one."""
    if not any(stage.teeth for stage in (*case.pair, *case.planetary)):
        return "no stage has computed teeth that excite it"
    if not case.deflection.contact:
        return "deflection.contact = false leaves the teeth, which excite it, out"
    flow = gearbox_flow(case)
    first = flow.independent[0] if flow.independent else case.shaft[0].name
    return "" if flow.speed[first] else "nothing turns"


def idle_entries(case: GearboxCase) -> Iterator[Finding]:
    """Tell sensors and a run-up of a gearbox that has no response (W-UNUSED)."""
    if not (case.sensor or case.runup.count) or not (why := why_silent(case)):
        return
    remedies = {
        "no": "give the teeth of a stage",
        "deflection.contact": "leave deflection.contact out",
        "nothing": "give a speed that is not zero in the load case of operation.first",
    }
    remedy = remedies[why.split()[0]]
    if case.sensor:
        text = f"the gearbox has no response that sensors could feel, modes at them are all: {why}"
        yield Finding("W-UNUSED", "sensor", text, remedy=remedy)
    if case.runup.count:
        text = f"the run-up has no effect, since the gearbox has no response: {why}"
        yield Finding("W-UNUSED", "runup", text, remedy=remedy)
