"""Materials of gears whose teeth have none: those of their shafts, or of the gearbox."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from femgear.findings import Finding

USUAL_MATERIAL = {"youngs_modulus": "206 GPa", "poisson_ratio": 0.3, "density": "7850 kg/m^3"}
"""Steel, where neither gears nor shafts nor the gearbox have a material."""
_GEARS = {"pair": ("gear_1", "gear_2"), "planetary": ("sun", "ring")}


def with_materials(data: Any) -> Any:
    """Copy the tables of a gearbox with a material for all teeth that have none; other data stay as they are.

    Gears on a shaft with a material of its own take that, others that of the gearbox; planets stand on no shaft.
    """
    if not isinstance(data, dict):
        return data
    tables = dict(data)
    for kind in _GEARS:
        stages = data.get(kind)
        if isinstance(stages, list | tuple) and any(_lacking(stage) for stage in stages):
            tables[kind] = [_filled(data, kind, stage) if _lacking(stage) else stage for stage in stages]
    return tables


def _lacking(stage: Any) -> bool:
    teeth = stage.get("teeth") if isinstance(stage, dict) else None
    return isinstance(teeth, dict) and "material" not in teeth


def _filled(data: dict, kind: str, stage: dict) -> dict:
    teeth = dict(stage["teeth"])
    teeth["material"] = USUAL_MATERIAL | _table(data.get("material"))
    for gear, shaft in zip(_GEARS[kind], _shafts(kind, stage), strict=True):
        section = teeth.get(gear)
        if (made := _of_shaft(data, shaft)) and isinstance(section, dict):
            teeth[gear] = section | {"material": made | _table(section.get("material"))}
    return stage | {"teeth": teeth}


def _shafts(kind: str, stage: dict) -> list[Any]:
    """Names of the shafts of two gears, or of sun and ring; None of what is not named."""
    if kind == "planetary":
        return [stage.get(name) for name in _GEARS[kind]]
    names = stage.get("shafts")
    return list(names) if isinstance(names, list | tuple) and len(names) == 2 else [None, None]


def _of_shaft(data: dict, name: Any) -> dict[str, Any]:
    """Material of a shaft of its own; empty where it has none."""
    shafts = data.get("shaft")
    for shaft in shafts if isinstance(shafts, list | tuple) else ():
        if isinstance(shaft, dict) and name is not None and shaft.get("name") == name:
            return _table(shaft.get("material"))
    return {}


def _table(value: Any) -> dict[str, Any]:
    return dict(value) if isinstance(value, dict) else {}


def material_notices(data: dict, case: Any) -> Iterator[Finding]:
    """Say which teeth took the material of shafts or of the gearbox (W-ESTIMATED)."""
    for kind in _GEARS:
        for number, stage in enumerate(data.get(kind, ())):
            if not _lacking(stage):
                continue
            made = USUAL_MATERIAL | _table(data.get("material"))
            whose = "that of the gearbox" if "material" in data else "steel"
            text = f"the teeth have no material: {whose} is taken, {made['youngs_modulus']}"
            of_shafts = {shaft: _of_shaft(data, shaft) for shaft in _shafts(kind, stage)}
            of_shafts = {
                shaft: material["youngs_modulus"]
                for shaft, material in of_shafts.items()
                if "youngs_modulus" in material
            }
            if of_shafts:
                text += f", of gears on {', '.join(f'{shaft} {modulus}' for shaft, modulus in of_shafts.items())}"
            yield Finding(
                "W-ESTIMATED",
                f"{kind}[{number}].teeth.material",
                text,
                remedy="give it with the teeth",
                concerns="materials",
            )
