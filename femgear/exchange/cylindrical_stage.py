"""Two gears of a REXS file as the tables of a pair case.

What a planetary stage and two gears have in common is read by `femgear.exchange.planetary_stage`, to which
gear 1 is the sun and gear 2 a planet, or the ring where it is internal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from femgear.case.estimates import usual_torque
from femgear.case.quantities import LENGTH, SPEED, TORQUE, to_si
from femgear.exchange.gear_unit import UnitFlow, shaft_of, turning
from femgear.exchange.planetary_stage import (
    add_bearings,
    add_modifications,
    bearings_between,
    gear_tables,
    pair_stage,
    speeds_of_cases,
    with_unit,
)
from femgear.exchange.rexs import Component, Model
from femgear.exchange.unit_spectrum import load_case_shares, spectrum_tables

_NAMES = {"sun": "gear_1", "planet": "gear_2", "ring": "gear_2"}


def pair_tables(
    model: Model, mesh: Component, load_case: int | None, flows: Sequence[UnitFlow]
) -> tuple[dict[str, Any], dict[str, str]]:
    """Read two gears as tables of a pair case, with remarks by key on what is assumed.

    Torque and speeds follow from the power ``flows`` through the unit, see
    `femgear.exchange.gear_unit.case_flows`; load cases are taken as by
    `femgear.exchange.planetary_stage.case_tables`.

    CaseError: E-CHOICE: no such load case. E-REXS, E-UNIT.
    """
    stage, remarks, before = pair_stage(model, mesh), dict[str, str](), len(model.findings)
    findings_before = list(model.findings)
    read = gear_tables(stage, remarks)
    for name in stage.gears:
        bearings = bearings_between(model, stage.shafts[name], "inner_part", "gear_casing")
        add_bearings(stage, read, remarks, name, "bearing_stiffness", bearings)
    if "profile_shift" not in read["sun"] and "centre_distance" not in read["set"]:
        read["sun"]["profile_shift"], remarks["sun.profile_shift"] = 0.0, "assumed"
    elif "profile_shift" not in read["sun"]:
        remarks["set.centre_distance"] = "assumed: no play at this distance, hence the profile shift of gear 1"
    operation = _operation(model, mesh, read, remarks, load_case, flows)
    forwards = to_si(operation["torque"], TORQUE) > 0.0
    add_modifications(stage, read, remarks, dict.fromkeys(stage.gears, forwards))
    if before < len(model.findings):
        model.findings[:] = [
            finding if finding in findings_before else replace(finding, key=_renamed(f"{mesh.id}: {finding.key}"))
            for finding in model.findings
        ]
    title = f"{mesh.name or 'stage'}, {' and '.join(gear.name or str(gear) for (gear,) in stage.gears.values())}"
    tables: dict[str, Any] = {"format": 1, "model": "pair"}
    tables["title"] = "".join(c for c in title if c.isprintable())[:200]
    shared = {key: read["sun"].pop(key) for key in ("module", "pressure_angle")}
    tables |= {key: value for key, value in read.items() if key not in _NAMES}
    tables["set"] = {**shared, **read["set"]}
    tables |= {_NAMES[name]: read[name] for name in stage.gears} | {"operation": operation}
    return tables, {_renamed(key): text for key, text in remarks.items()}


def _renamed(key: str) -> str:
    """Key of a pair case for that of a planetary one."""
    where, _, rest = key.rpartition(": ")
    section, dot, last = rest.partition(".")
    name = "set" if rest in ("sun.module", "sun.pressure_angle") else _NAMES.get(section, section)
    return f"{where}: {name}{dot}{last}" if where else f"{name}{dot}{last}"


def _operation(
    model: Model,
    mesh: Component,
    read: dict[str, Any],
    remarks: dict[str, str],
    wanted: int | None,
    flows: Sequence[UnitFlow],
) -> dict[str, Any]:
    """Torque on gear 1, positive where it drives in its sense of rotation, and its speeds."""
    number, _ = model.chosen_case(wanted)
    gear = pair_stage(model, mesh).gears["sun"][0]
    shaft = shaft_of(model, gear)
    torques, speeds = [], []
    for flow in flows:
        speed = flow.speed.get(shaft.id, 0.0) if shaft else 0.0
        by_mesh = flow.torque.get(mesh.id)
        torques.append(None if not by_mesh else -by_mesh * turning(speed))
        speeds.append(abs(speed))
    torque = torques[0]
    if torque is None:
        width, module = to_si(read["set"]["face_width"], LENGTH), to_si(read["sun"]["module"], LENGTH)
        teeth = [read[name]["teeth"] for name in read if name in _NAMES]
        torque = float(f"{usual_torque(teeth[0], teeth[1], module, width):.3g}")
        remarks["operation.torque"] = "assumed: K factor of 1 N/mm^2"
        model.remark("operation.torque", "the file does not determine the torque: that of a K factor is taken")
    shares = load_case_shares(model.load_cases)
    taken = speeds_of_cases(model, number, torques, speeds, shares, alone=wanted is not None)
    remarks |= {} if taken else {"operation.speeds": "assumed"}
    texts = dict.fromkeys(with_unit(taken_speed, SPEED) for taken_speed in taken or [1000.0 * SPEED.scale])
    spectrum = spectrum_tables(model, torques[1:], speeds[1:], shares)
    return {"torque": with_unit(torque, TORQUE), "speeds": [*texts]} | ({"load_case": spectrum} if spectrum else {})
