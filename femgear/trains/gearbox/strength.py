"""Strength of the teeth of all stages of a gearbox after ISO 6336, in every load case.

Torques are those of the power flow, K_gamma and K_Hbeta those of the contact with the misalignment that the gearbox
gives it. The edition is that of the stage's teeth where they have a section ``strength``, else that of the gearbox. In
deflection.nc K_v is that of part 1, or 1; the verdict puts that of the response in its place.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from femgear.case import text as case_text
from femgear.case.sections import StrengthSection
from femgear.report.tables import Block, Marks, tabulate
from femgear.stages.judgements import unrated_gears
from femgear.stages.strength import OF_ROOTS, OF_TEETH, Rating, rate_case, rating_wanted
from femgear.stages.strength_results import factor_names, kind_names, missing_notes, missing_of_all
from femgear.trains.gearbox.case_file import BoxPlanetarySection, GearboxCase, PairSection, of_stage, stage_case_of
from femgear.trains.gearbox.contact import StageContact, loaded_tables
from femgear.trains.gearbox.deflection import Deflection
from femgear.trains.gearbox.power import BoxFlow
from femgear.trains.gearbox.shared_gears import bent_both_ways, shared_gears

_SAFETIES = {"iso_root_safety": "S_F", "iso_contact_safety": "S_H"}
_STRESSES = {"S_F": "sigma_F0", "S_H": "Z sigma_H0"}
_WORDS = {
    "iso_root_stress": ("Pa", "nominal root stress sigma_F0 under the mean load of a planet, ISO 6336-3"),
    "iso_contact_stress": ("Pa", "nominal contact stress sigma_H0 times Z_B or Z_D, ISO 6336-2"),
    "iso_root_safety": ("1", "safety S_F with the load factors of the static load; NaN without a limit"),
    "iso_contact_safety": ("1", "safety S_H with the load factors of the static load; NaN without a limit"),
}
"""Variables over load case, mesh and gear: unit and text."""


def rated_stage(case: GearboxCase, name: str, contact: StageContact, mesh_frequency: float) -> Rating | None:
    """Rate the teeth of a stage under a load case; None where nothing asks for safeties.

    Parameters
    ----------
    case : GearboxCase
        With the section ``strength`` of stages that have none of their own.
    name : str
        Of the stage, before the names of its flanks.
    contact : StageContact
        With K_gamma and K_Hbeta.
    mesh_frequency : float
        [Hz]
    """
    teeth = contact.case
    if not (rating_wanted(teeth) or "strength" in case.model_fields_set):
        return None
    kinds = len(kind_names(contact.result.planetary_set.mesh_names))
    force, face = (values.reshape(kinds, -1) for values in (contact.normal_force, contact.face_load_factor))
    mean = force.mean(axis=1)
    sharing = np.divide(force.max(axis=1), mean, out=np.ones(kinds), where=mean > 0.0)
    return rate_case(
        teeth,
        torque=contact.result.sun_torque,
        sharing=sharing if force.shape[1] > 1 else None,
        face=face.max(axis=1) if contact.result.cycle.face_load_factor is not None else None,
        frequencies=(abs(mesh_frequency),) if mesh_frequency else (),
        strength=strength_of_stage(case, teeth),
    )


def strength_of_stage(case: GearboxCase, teeth: Any) -> StrengthSection:
    """Find the section ``strength`` of the teeth of a stage: its own, else that of the gearbox."""
    return teeth.strength if "strength" in teeth.model_fields_set else case.strength


def _rated_teeth(case: GearboxCase, stage: PairSection | BoxPlanetarySection, flow: BoxFlow) -> Rating | None:
    """Rate the teeth of a stage whose contact is not computed, with equal shares and K_Hbeta 1."""
    torque, frequency = -flow.first_torque(stage), abs(flow.mesh_frequency[stage.name])
    teeth = stage_case_of(case_text.write(loaded_tables(stage, torque, 0)))
    if not (rating_wanted(teeth) or "strength" in case.model_fields_set):
        return None
    return rate_case(
        teeth,
        torque=torque,
        frequencies=(frequency,) if frequency else (),
        strength=strength_of_stage(case, teeth),
    )


def rated_stages(state: Deflection) -> dict[str, Rating]:
    """Rate all stages of a loaded state that have teeth and ask for safeties, by their names.

    Without ``deflection.contact`` the torque alone rates them.
    """
    case, flow = state.model.case, state.model.flow
    ratings = {
        name: rated_stage(case, name, contact, flow.mesh_frequency[name]) for name, contact in state.contacts.items()
    }
    for stage in state.model.stages:
        if stage.name not in ratings and flow.touches(stage.section):
            ratings[stage.name] = _rated_teeth(case, stage.section, flow)
    rated = {name: rating for name, rating in ratings.items() if rating is not None}
    return bent_both_ways(rated, shared_gears(case), flow)


def strength_contents(states: Sequence[Deflection]) -> tuple[dict[str, tuple], dict[str, tuple], dict[str, Any]]:
    """Collect variables, coordinates and attributes of deflection.nc; all empty where no stage is rated."""
    ratings = [rated_stages(state) for state in states]
    if not any(ratings):
        return {}, {}, {}
    model = states[0].model
    count = len(model.assembly.contacts)
    values = {name: np.full((len(states), count, 2), np.nan) for name in _WORDS}
    dynamic, flanks = np.ones((len(states), count)), [["", ""] for _ in range(count)]
    places = np.full((count, 2), -1)
    for number, of_state in enumerate(ratings):
        for place, stage in enumerate(model.stages):
            for mesh, gear, flank, factor in _places(stage, of_state.get(stage.name)):
                flanks[mesh][gear], dynamic[number, mesh] = of_stage(flank.name, stage.name), factor
                places[mesh] = place, flank.kind
                values["iso_root_stress"][number, mesh, gear] = flank.root_stress
                values["iso_contact_stress"][number, mesh, gear] = flank.contact_stress
                values["iso_root_safety"][number, mesh, gear] = flank.root_safety
                values["iso_contact_safety"][number, mesh, gear] = flank.contact_safety
    variables: dict[str, tuple] = {
        name: ("load_case mesh gear", values[name], *words) for name, words in _WORDS.items()
    }
    variables["iso_dynamic_factor"] = ("load_case mesh", dynamic, "1", "K_v of part 1 in these safeties, or 1")
    text = "number of the stage and of the kind of mesh; -1 of meshes that are not rated"
    variables["iso_place"] = ("mesh numbering", places, "1", text)
    variables["iso_flank"] = ("mesh gear", flanks, "1", "stage and flank")
    coords = {
        "gear": (("gear",), ["first", "second"], "1", "gear of the mesh"),
        "numbering": (("numbering",), ["stage", "kind"], "1", "what is numbered"),
    }
    first = next(filter(None, ratings))
    notes = [f"{name}: {note}" for name, rating in first.items() for note in _notes(rating)]
    for gear in shared_gears(model.case):
        if any({*gear.pushes(state.model.flow)} >= {1, -1} for state in states):
            notes.append(f"Y_M = 0.7 of {gear.name}, whose mates bend its teeth both ways")
    editions = ", ".join(dict.fromkeys(str(rating.nominal.edition) for rating in first.values()))
    attrs = {
        "iso_edition": editions,
        "iso_notes": " | ".join(notes),
        "iso_missing": " ".join(missing_of_all(rating for of_state in ratings for rating in of_state.values())),
        "iso_unrated": " | ".join(_unrated(states, ratings)),
    }
    return variables, coords, attrs


def _unrated(states: Sequence[Deflection], ratings: Sequence[Mapping[str, Rating]]) -> Iterator[str]:
    """Name the stages that carry in a load case and have no safety, and gears of others that lack one."""
    for stage in states[0].model.stages:
        if not any(state.model.flow.carries(stage.section) for state in states):
            continue
        rating = next((of_state[stage.name] for of_state in ratings if stage.name in of_state), None)
        gears = unrated_gears(rating) if rating is not None else []
        if rating is None or len({flank.gear for flank in rating.flanks}) == len(gears):
            yield stage.name
        else:
            yield from (of_stage(gear, stage.name) for gear in gears)


def _places(stage: Any, rating: Rating | None) -> Iterator[tuple[int, int, Any, float]]:
    """Mesh, gear, flank and K_v of part 1 of every flank of a stage."""
    if rating is None:
        return
    kinds = len(rating.standard)
    for number, flank in enumerate(rating.flanks):
        meshes = np.array(stage.meshes).reshape(kinds, -1)[flank.kind]
        for mesh in meshes.tolist():
            yield mesh, number % 2, flank, float(rating.factors.dynamic[flank.kind])


def _notes(rating: Rating) -> Iterator[str]:
    """Load factors that the safeties have, and what is missing."""
    yield f"load factors {' '.join(factor_names(rating.factors)) or 'none'}"
    yield from missing_notes(rating)


def describe_strength(data: Any, load_case: int, name: str) -> tuple[Block, ...]:
    """Tabulate stresses and safeties of all flanks in a load case of deflection.nc; nothing where none is rated."""
    if "iso_flank" not in data:
        return ()
    at = data.isel(load_case=load_case)
    rows = dict[str, tuple[int, int]]()
    for mesh, names in enumerate(data["iso_flank"].values):
        for gear, flank in enumerate(names):
            if flank:
                rows.setdefault(str(flank), (mesh, gear))

    def number(name: str, form: str, factor: float = 1.0):
        def text(flank: str) -> str:
            value = factor * float(at[name].values[rows[flank]])
            return f"{value:{form}}" if math.isfinite(value) else "-"

        return text

    columns = {
        "flank": lambda flank: flank,
        "sigma_F0 [MPa]": number("iso_root_stress", ".2f", 1e-6),
        "S_F": number("iso_root_safety", ".2f"),
        "Z sigma_H0 [MPa]": number("iso_contact_stress", ".2f", 1e-6),
        "S_H": number("iso_contact_safety", ".2f"),
    }
    notes = [note for note in str(data.attrs["iso_notes"]).split(" | ") if note]
    return (tabulate(f"Strength{name}, ISO 6336:{data.attrs['iso_edition']}", rows, columns, notes),)


def flank_of_shafts(flank: str, pairs: Sequence[PairSection]) -> str:
    """Name the gear of a pair by the shafts after which the pair is named; others as they are."""
    for pair in pairs:
        first, second = pair.shafts
        if pair.name == f"{first}-{second}":
            flank = flank.replace(f"gear 1 of {pair.name}", f"{first} in mesh with {second}")
            flank = flank.replace(f"gear 2 of {pair.name}", f"{second} in mesh with {first}")
    return flank


def smallest_safeties(
    data: Any, response: Any, marks: Marks, pairs: Sequence[PairSection] = ()
) -> Iterator[tuple[str, str]]:
    """Write rows of the smallest S_F and S_H over all load cases, with K_v of the response where there is one.

    Parameters
    ----------
    data : dataset
        deflection.nc.
    response : dataset or None
        dynamics.nc, whose load case is the chosen one.
    marks : Marks
        Of the findings of the run.
    pairs : sequence of PairSection
        Of the case, whose shafts name gears.
    """
    for name, symbol in _SAFETIES.items():
        least = least_safety(data, response, symbol)
        if least is None:
            continue
        value, (case, mesh, gear) = least
        cases = data["load_case"].values
        stress = name.replace("_safety", "_stress")
        cause = f"{_STRESSES[symbol]} {1e-6 * float(data[stress].values[case, mesh, gear]):.1f} MPa"
        where = f", {cases[case]}" if len(cases) > 1 else ""
        text = marks(f"{value:.2f}", *(OF_ROOTS if symbol == "S_F" else OF_TEETH), of=("deflection",))
        edition, flank = data.attrs["iso_edition"], flank_of_shafts(str(data["iso_flank"].values[mesh, gear]), pairs)
        yield f"smallest safety {symbol}, ISO 6336:{edition}", f"{text}, {flank}{where}: {cause}"


def least_safety(data: Any, response: Any, symbol: str) -> tuple[float, tuple[int, int, int]] | None:
    """Find the smallest S_F or S_H over all load cases, and its load case, mesh and gear; None without any.

    Parameters
    ----------
    data : dataset
        deflection.nc.
    response : dataset or None
        dynamics.nc, whose K_v stands for that of part 1 in its load case.
    symbol : {"S_F", "S_H"}
    """
    if "iso_flank" not in data:
        return None
    ratio = np.ones(data["iso_dynamic_factor"].shape)
    if response is not None:
        chosen = int(data.attrs["load_case"])
        computed = _computed_factors(data, response)
        ratio[chosen] = np.where(np.isfinite(computed), data["iso_dynamic_factor"].values[chosen] / computed, 1.0)
    name = next(name for name, of in _SAFETIES.items() if of == symbol)
    values = data[name].values * (ratio if symbol == "S_F" else np.sqrt(ratio))[..., None]
    if not np.isfinite(values).any():
        return None
    case, mesh, gear = map(int, np.unravel_index(int(np.nanargmin(values)), values.shape))
    return float(values[case, mesh, gear]), (case, mesh, gear)


def _computed_factors(data: Any, response: Any) -> np.ndarray:
    """K_v (M,) of the response for every mesh of deflection.nc; NaN of stages that it has not."""
    factor = response["dynamic_factor"].max("speed").values
    rows = {str(name): row for row, name in enumerate(response["stage"].values)}
    # files without it have every stage excite alone
    alone = "stage_of_mesh" not in response
    exciting = {} if alone else dict(zip(response["mesh"].values, response["stage_of_mesh"].values, strict=True))
    computed = np.full(data.sizes["mesh"], np.nan)
    for mesh, (stage, kind) in enumerate(data["iso_place"].values.tolist()):
        name = str(exciting.get(data["mesh"].values[mesh], data["stage"].values[stage]))
        if stage >= 0 and name in rows:
            computed[mesh] = factor[rows[name], kind]
    return computed
