"""Strength of the gears of a REXS unit: treatment and hardness, tolerance class, application factor; what is estimated.

A file that has neither limits nor a treatment of a gear may have the tensile strength of its material. The gear then is
estimated as through hardened alloy steel of the hardness that goes with that strength, and says so.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from femgear.case.quantities import STRESS
from femgear.exchange.rexs import Component, Model
from femgear.findings import NOTE
from femgear.gears.gear_steels import GEAR_STEELS

TREATMENTS = {
    "black_malleable_cast_iron": "malleable iron",
    "case_hardened_wrought_steel": "case hardened steel",
    "flame_or_induction_hardened_steel": "flame hardened steel",
    "grey_cast_iron": "grey iron",
    "nitrided_steel": "nitrided steel",
    "nitrided_through_hardened_steel": "nitrided through hardening steel",
    "nitrocaburized_wrought_steel": "nitrocarburised steel",
    "nodular_cast_iron_perlitic_or_bainitic_structure": "nodular iron",
    "normalized_cast_steel": "cast steel",
    "normalized_wrought_low_carbon_steel": "normalised steel",
    "through_hardened_cast_steel": "through hardened cast alloy steel",
    "through_hardened_wrought_steel": "through hardened alloy steel",
}
"""Treatments by the values of ``heat_treated_material_type_iso_6336_2006`` and ``_2019``."""
_TREATED = "heat_treated_material_type_iso_6336_2019", "heat_treated_material_type_iso_6336_2006"
_HARDNESS = {"HV": "surface_hardness_vickers", "HBW": "surface_hardness_brinell"}
_CLASS = "global_tolerance_class_iso_1328_2013"
_FACTORS = "application_factor_iso_6336_2019", "application_factor_iso_6336_2006"
_ESTIMATED = "through hardened alloy steel"
_STRENGTH = 1e6 * np.array(
    [640, 675, 705, 740, 770, 800, 835, 865, 900, 930, 965, 995, 1030, 1060, 1095, 1125, 1155], float
)
_VICKERS = np.arange(200.0, 361.0, 10.0)
"""Tensile strength [Pa] and hardness HV of unalloyed and low alloy steels, ISO 18265:2013, table A.1."""


def vickers_hardness(tensile_strength: float) -> float | None:
    """Convert a tensile strength [Pa] to HV by ISO 18265; None beyond 200 to 360 HV."""
    if not _STRENGTH[0] <= tensile_strength <= _STRENGTH[-1]:
        return None
    return float(np.round(np.interp(tensile_strength, _STRENGTH, _VICKERS)))


def treatment_of(model: Model, material: Component) -> dict[str, Any]:
    """Read the treatment of a material with its hardness; empty where the file has not both."""
    treatment = next(
        (TREATMENTS[text] for name in _TREATED if (text := model.text(material, name)) in TREATMENTS), None
    )
    if treatment is None:
        return {}
    text = model.text(material, _HARDNESS[GEAR_STEELS[treatment].hardness])
    hardness = None if text is None else float(text)
    line = GEAR_STEELS[treatment].contact["MQ"]
    if hardness is None or not line.low <= hardness <= line.high:
        what = "no surface hardness" if hardness is None else f"a surface hardness of {hardness:g}"
        limit = f"{treatment} has {line.low:g} to {line.high:g} {GEAR_STEELS[treatment].hardness} in ISO 6336-5"
        model.remark("material.hardness", f"{material} has {what}: {limit}", remedy="give treatment and hardness")
        return {}
    return {"treatment": treatment, "hardness": hardness}


def written_treatment(material: Any, tell: Callable[[str], None]) -> dict[str, tuple[str, str]]:
    """Write treatment and hardness of a material as attributes of REXS, and tell what it has no form for."""
    if material.treatment is None:
        return {}
    kind = next((kind for kind, treatment in TREATMENTS.items() if treatment == material.treatment), None)
    if kind is None:
        tell(f"REXS has no {material.treatment}: left out, the limits of now come back")
        return {}
    if material.grade != "MQ":
        tell(f"REXS has no grade of a material: {material.grade} comes back as MQ, with the limits that it has now")
    unit = GEAR_STEELS[material.treatment].hardness
    return {_TREATED[0]: (kind, "none"), _HARDNESS[unit]: (f"{material.hardness:.15g}", "none")}


def written_strength(strength: Any) -> dict[str, tuple[str, str]]:
    """Write the tolerance class of gears and the application factor of meshes as attributes of REXS."""
    written = {} if strength.quality is None else {_CLASS: (str(strength.quality), "none")}
    factor = strength.application_factor
    return written if factor == 1.0 else written | {_FACTORS[0]: (f"{factor:.15g}", "none")}


def estimated_treatment(model: Model, gear: str, part: Component, material: Component) -> dict[str, Any]:
    """Estimate treatment and hardness of a gear by the tensile strength of its material; empty where it has none."""
    strength = model.number(material, "tensile_strength", STRESS)
    hardness = None if strength is None else vickers_hardness(strength)
    if strength is None or hardness is None:
        return {}
    text = (
        f"{part} has neither treatment nor limits: {_ESTIMATED} of {hardness:g} HV is assumed, by the tensile strength "
        f"of {1e-6 * strength:g} N/mm^2; safeties and lives rest on it"
    )
    model.remark(f"{gear}.material.treatment", text, remedy="give treatment, grade and hardness, or the limits")
    return {"treatment": _ESTIMATED, "hardness": hardness, "estimated": True}


def add_treatments(
    model: Model,
    tables: dict[str, Any],
    gears: Mapping[str, Component],
    made: Mapping[str, Sequence[Component]],
) -> None:
    """Give every gear of a stage its treatment, that of the file or an estimate.

    Parameters
    ----------
    model : Model
        The unit.
    tables : dict
        Of a stage, with the sections of its gears.
    gears : mapping of str to Component
        By their names in the case.
    made : mapping of str to sequence of Component
        Materials of the gears.
    """
    treatments: dict[str, dict[str, Any]] = {}
    for name, part in gears.items():
        if not made[name]:
            continue
        limits = {**tables["material"], **tables[name].get("material", {})}
        treatments[name] = treatment_of(model, made[name][0])
        if not treatments[name] and not {"root_stress_limit", "contact_stress_limit"} & limits.keys():
            treatments[name] = estimated_treatment(model, name, part, made[name][0])
    common = next(iter(treatments.values()), {})
    if len(treatments) == len(gears) and all(treatment == common for treatment in treatments.values()):
        tables["material"] |= common
        return
    for name, treatment in treatments.items():
        if treatment:
            tables[name]["material"] = tables[name].get("material", {}) | treatment


def strength_table(model: Model, stages: Sequence[Component], gears: Sequence[Component]) -> dict[str, Any]:
    """Read the application factor of stages and the tolerance class of their gears, of several the least favourable.

    Notes tell which of them the file has not.
    """
    factors = [factor for stage in stages for name in _FACTORS if (factor := model.number(stage, name)) is not None]
    classes = [text for gear in gears if (text := model.text(gear, _CLASS))]
    quality = [int(text) for text in classes if text.isdigit()]
    table, missing = dict[str, Any](), list[str]()
    for key, values, usual in (
        ("application_factor", factors, "no application factor, K_A = 1"),
        ("quality", quality, "no tolerance class, without K_v, K_Halpha and K_Falpha of ISO 6336-1"),
    ):
        if not values:
            missing.append(usual)
            continue
        table[key] = max(values)
        if len({*values}) > 1:
            model.remark(f"strength.{key}", f"the largest of {', '.join(map(str, sorted({*values})))} is taken")
    if missing:
        remedy = "give strength.application_factor and strength.quality"
        text = f"the file has {'; '.join(missing)}: safeties and lives are so much better"
        model.remark("strength", text, remedy=remedy, severity=NOTE)
    return table


def common_strength(model: Model, tables: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Make the section ``strength`` of a gearbox of those of its stages, of several the least favourable entries."""
    common: dict[str, Any] = {}
    for table in tables:
        for key, value in table.items():
            if common.setdefault(key, value) != value:
                text = f"stages have {common[key]} and {value}: the larger one is taken for all"
                model.remark(f"strength.{key}", text)
                common[key] = max(common[key], value)
    return common
