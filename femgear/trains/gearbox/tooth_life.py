"""Lives of the teeth of all stages of a gearbox over its load cases, ISO 6336-6.

Ratings are those of the loaded states: torques of the power flow, K_gamma and K_Hbeta of the contact with the
misalignment of each load case. Torques of a stage are those on its sun or gear 1. A gear with several mates, as an
idler, is one gear, see `femgear.trains.gearbox.shared_gears`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from femgear.case.gear_set import planetary_set
from femgear.case.load_spectrum import check_pitting, required_life, running_shares
from femgear.case.sections import gear_material
from femgear.errors import CaseError
from femgear.stages.planet_bearings import PlanetBearings, planet_bearing_variables, planet_bearings
from femgear.stages.strength import Rating
from femgear.stages.tooth_spectra import (
    KINDS,
    RatedLoad,
    RatedSpectrum,
    rated_spectra,
    tooth_life_coordinates,
    tooth_life_variables,
)
from femgear.trains.gearbox.case_file import BoxPlanetarySection, GearboxCase, PairSection, of_stage, teeth_of
from femgear.trains.gearbox.deflection import Deflection
from femgear.trains.gearbox.shared_gears import SharedGear, gear_loads, shared_gears, shared_spectra
from femgear.trains.gearbox.strength import rated_stages, strength_of_stage


def stage_spectra(states: Sequence[Deflection]) -> tuple[RatedSpectrum, ...]:
    """Collect the spectra of all roots and flanks that have a limit and a treatment, stage by stage."""
    case = states[0].model.case
    shares, ratings = running_shares(case.operation.load_case), [rated_stages(state) for state in states]
    shared = shared_gears(case)
    left_out = {(stage, f"gear {number + 1}") for gear in shared for stage, number in gear.places}
    spectra = list[RatedSpectrum]()
    for stage in states[0].model.stages:
        contacts = [state.contacts.get(stage.name) for state in states]
        teeth = next((contact.case for contact in contacts if contact is not None), None)
        if teeth is None:
            continue
        loads = [
            RatedLoad(
                rating.get(stage.name),
                0.0 if contact is None else contact.result.sun_torque,
                state.model.flow.mesh_frequency[stage.name],
                share,
            )
            for state, rating, contact, share in zip(states, ratings, contacts, shares.tolist(), strict=True)
        ]
        for rated in rated_spectra(teeth, loads, strength_of_stage(case, teeth)):
            if (stage.name, rated.name.partition(",")[0]) not in left_out:
                spectra.append(replace(rated, name=of_stage(rated.name, stage.name)))
    for gear in shared:
        spectra += _of_shared_gear(gear, states, ratings, shares)
    return tuple(spectra)


def _of_shared_gear(
    gear: SharedGear, states: Sequence[Deflection], ratings: Sequence[Mapping[str, Rating]], shares: np.ndarray
) -> list[RatedSpectrum]:
    """Spectra of a gear with several mates, with material and rules of its first stage."""
    (name, number), case = gear.places[0], states[0].model.case
    contacts = [state.contacts.get(name) for state in states]
    teeth = next((contact.case for contact in contacts if contact is not None), None)
    if teeth is None or (treatment := gear_material(teeth, teeth.gear_names[number]).treatment) is None:
        return []
    torque = np.array([0.0 if contact is None else contact.result.sun_torque for contact in contacts])
    loads = gear_loads(gear, [state.model.flow for state in states], ratings, shares, torque)
    return shared_spectra(loads, treatment, strength_of_stage(case, teeth))


def stages_without_life(states: Sequence[Deflection], spectra: Sequence[RatedSpectrum]) -> Iterator[str]:
    """Name the stages that carry in a load case and have no life, and gears of others whose root or flank has none."""
    # ", sun side" and ", back flank" end the name of a gear, which may have commas of its own
    titles = [{f"{rated.name}," for rated in spectra if rated.kind == kind} for kind in KINDS]
    shared = {
        (stage, number): gear.name for gear in shared_gears(states[0].model.case) for stage, number in gear.places
    }
    for stage in states[0].model.stages:
        if not any(state.model.flow.carries(stage.section) for state in states):
            continue
        teeth = teeth_of(stage.section)
        gears = {} if teeth is None else {name: name.replace("_", " ") for name in teeth.gear_names}
        named = {
            gear: shared.get((stage.name, number), of_stage(title, stage.name))
            for number, (gear, title) in enumerate(gears.items())
        }
        lacking = [
            gear
            for gear, title in named.items()
            if not all(any(name.startswith(f"{title},") for name in of_kind) for of_kind in titles)
        ]
        if len(lacking) == len(gears):
            yield stage.name
        else:
            yield from (of_stage(gears[gear], stage.name) for gear in lacking)


def tooth_life_contents(states: Sequence[Deflection]) -> tuple[dict[str, tuple], dict[str, tuple], dict[str, Any]]:
    """Collect variables, coordinates and attributes of deflection.nc on the lives of teeth.

    Without variables where no tooth has a line of life; the attribute is the life asked for [h], where there is one.
    """
    spectra, required = stage_spectra(states), required_life(states[0].model.case.operation)
    attrs: dict[str, Any] = {} if required is None else {"required_hours": required}
    attrs["without_life"] = " | ".join(stages_without_life(states, spectra))
    variables, planets = planet_bearing_variables(stage_planet_bearings(states))
    return variables | tooth_life_variables(spectra, required), planets | tooth_life_coordinates(spectra), attrs


def stage_planet_bearings(states: Sequence[Deflection]) -> list[PlanetBearings]:
    """Collect the bearings of the planets of all sets whose teeth give them a rating, by the contact of their teeth."""
    case, sets = states[0].model.case, list[PlanetBearings]()
    for stage in case.planetary:
        contacts = [state.contacts.get(stage.name) for state in states]
        teeth = next((contact.case for contact in contacts if contact is not None), None)
        bearings = teeth and planet_bearings(
            teeth,
            planetary_set(teeth),
            [None if contact is None else contact.result.cycle for contact in contacts],
            carrier_speed=[state.model.flow.speed[stage.carrier] for state in states],
            mesh_frequency=[state.model.flow.mesh_frequency[stage.name] for state in states],
            shares=running_shares(case.operation.load_case),
        )
        if bearings:
            sets.append(replace(bearings, names=tuple(f"{stage.name} {name}" for name in bearings.names)))
    return sets


def pitting_problems(case: GearboxCase, stages: Sequence[PairSection | BoxPlanetarySection]) -> Iterator[CaseError]:
    """Refuse limited pitting of stages whose materials have no such line, by the entry that asks for it."""
    for stage in stages:
        teeth = teeth_of(stage)
        if teeth is None or "strength" in teeth.model_fields_set:
            continue  # the case of the teeth refuses its own
        for problem in check_pitting(teeth.model_copy(update={"strength": case.strength})):
            problem.message = f"stage {stage.name}: {problem.message}"
            yield problem
