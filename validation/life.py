"""Lives over load cases: equivalent torques, load cycles, damage and safeties of spectra."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from femgear.case.dependencies import Steps
from femgear.case.quantities import RPM
from femgear.exchange.rexs import read_model
from femgear.gears.gear_steels import GEAR_STEELS, LifeLine
from femgear.gears.iso6336_life import ToothSpectrum, equivalent_torque, miner_damage, spectrum_safety
from femgear.stages.life import LifeResult, mesh_frequency_at, solve_life
from femgear.stages.static import solve_static
from femgear.stages.strength import rate_case
from femgear.stages.tooth_spectra import RatedLoad, RatedSpectrum, rated_spectra
from femgear.trains.gearbox.stages import solve_deflections
from femgear.trains.imports import case_drafts
from femgear.trains.reading import read_case
from validation.rows import Row, at_most, printed, within

ROUNDED = 1e-12
THREE = "torques 200, 150, 80 with shares 1, 9, 90 %, by hand"
STAGE_1 = "KISSsoft report, NREL 5 MW gearbox, planetary stage 1"
CASES = Path(__file__).resolve().parents[1] / "cases"
FILE = Path(__file__).parent / "reference" / "two_stage_gearbox.rexs"
UNIT = "load spectrum of the REXS file of an industrial gearbox (BearinxSimulationSuite/REXSapi), Miner's sum by hand"
STEEL: dict[str, Any] = {"treatment": "case hardened steel", "hardness": 720}
HOURS = 20000.0


def three_torques() -> tuple[Row, ...]:
    """Equivalent torques of three, by the slopes of bearings and of flanks."""
    return tuple(
        printed("torques", THREE, f"p {name}: equivalent over largest torque", reference, ours)
        for name, exponent, reference in (
            ("3", 3.0, "0.472620"),
            ("10/3", 10.0 / 3.0, "0.480575"),
            ("6.61", 6.61, "0.574189"),
            ("13.22", 13.22, "0.715709"),
        )
        for ours in (equivalent_torque([200.0, 150.0, 80.0], [1.0, 9.0, 90.0], exponent) / 200.0,)
    )


def cycles_of_a_set() -> tuple[Row, ...]:
    """Load cycles of 20 years at 12.1 rpm of the carrier, from the spectra of a set of 19/17/56 teeth."""
    tables = _tables("planetary_27_40_108", torque="50 N m", speed="12.1 rpm")
    tables = {name: tables[name] for name in ("format", "title", "material", "strength", "operation")}
    tables["set"] = {"planets": 3, "centre_distance": "863 mm", "face_width": "491 mm"}
    tables["rack"] = {"root_radius": 0.38}
    for name, teeth, shift, tip, root, rim in (
        ("sun", 19, 0.6170, 978.808, 798.030, {"bore_radius": "241.165 mm"}),
        ("planet", 17, 0.8021, 905.470, 724.692, {"bore_radius": "204.495 mm"}),
        ("ring", 56, 0.5013, 2475.118, 2677.618, {"outer_radius": "1497.12 mm", "cutter_teeth": 36}),
    ):
        tables[name] = {"teeth": teeth, "profile_shift": shift, **rim}
        tables[name] |= {"tip_diameter": f"{tip} mm", "root_diameter": f"{root} mm"}
    tables["sun"] |= {"module": "45 mm", "pressure_angle": "20 deg"}
    tables["ring"]["rack"] = {"root_radius": 0.30}
    tables["operation"] |= {"input": "carrier", "fixed": "ring", "speeds": ["12.1 rpm"]}
    case = read_case(tables)
    frequency = mesh_frequency_at(case, 12.1 * RPM)
    spectra = rated_spectra(case, [RatedLoad(rate_case(case), 50.0, frequency, 1.0)])
    cycles = {rated.name: 20 * 8760.0 * float(rated.spectrum.cycles.sum()) for rated in spectra if rated.kind == "root"}
    return tuple(
        printed("stage 1", STAGE_1, f"{name}: load cycles in 20 years, 1e6", reference, 1e-6 * cycles[flank])
        for name, flank, reference in (
            ("sun", "sun", "1124.7"),
            ("planet", "planet, sun side", "419.0"),
            ("ring", "ring", "381.6"),
        )
    )


def damage_by_hand(ratio: Sequence[float] | np.ndarray, cycles: Sequence[float] | np.ndarray, line: LifeLine) -> float:
    """Compute Miner's sum from the points of a line, one load case after the other."""
    total = 0.0
    points = list(zip(line.cycles, line.factors, strict=True))
    for stress, number in zip(ratio, cycles, strict=True):
        for (start, first), (end, second) in pairwise(points):
            if second <= stress <= first:
                slope = math.log(end / start) / math.log(first / second)
                total += number / (start * (first / stress) ** slope)
                break
    return total


def damage_of_halves() -> tuple[Row, ...]:
    """Damage of load cases in halves, and beside that of lines written point by point."""
    rows, source = [], "the whole"
    ratio, cycles = np.array([1.4, 1.02, 0.9, 0.7]), np.array([2e3, 5e5, 3e8, 1e9])
    for treatment in ("case hardened steel", "through hardened alloy steel", "nitrided steel"):
        steel = GEAR_STEELS[treatment]
        for kind, line in (("roots", steel.root_life), ("flanks", steel.contact_life)):
            stress = np.minimum(ratio, 0.99 * line.factors[0])
            whole = float(miner_damage(stress, cycles, line).sum())
            halves = float(miner_damage(np.repeat(stress, 2), np.repeat(0.5 * cycles, 2), line).sum())
            quantity = f"{kind}: damage of two equal halves"
            rows.append(within(treatment, source, quantity, whole, halves, ROUNDED))
            by_hand = damage_by_hand(stress, cycles, line)
            rows.append(within(treatment, "lines by hand", f"{kind}: damage", by_hand, whole, ROUNDED))
            safety = spectrum_safety(stress, cycles, line)
            left = damage_by_hand(safety * stress, cycles, line) - 1.0
            rows.append(
                at_most(treatment, "lines by hand", f"{kind}: damage less 1 under S times the stresses", 1e-9, left)
            )
    return tuple(rows)


def _tables(name: str, *load_cases: dict[str, Any], **load: str) -> dict[str, Any]:
    """Tables of a shipped case of case hardened steel with load cases."""
    tables = tomllib.loads((CASES / f"{name}.toml").read_text(encoding="utf-8"))
    tables["material"] |= STEEL
    tables["operation"] |= {"load_case": list(load_cases) or [load], "required_hours": HOURS}
    tables["strength"] = {"quality": 6}
    return tables


@lru_cache(maxsize=4)
def _life(name: str, halves: bool) -> LifeResult:
    """Lives of a shipped case under one load case, or in halves of it."""
    nominal = {"spur_pair": ("450 N m", "1500 rpm"), "planetary_27_40_108": ("260 N m", "543 rpm")}[name]
    load = {"torque": nominal[0], "speed": nominal[1]}
    parts = [load | {"name": part, "share": 0.5} for part in ("first", "second")] if halves else [load]
    case = read_case(_tables(name, *parts))
    return solve_life(case, solve_static(case))


def single_runs() -> tuple[Row, ...]:
    """Of one load case: S of the single run times the life factor; halves of it live as long."""
    rows = []
    for name in ("spur_pair", "planetary_27_40_108"):
        whole, halves = _life(name, halves=False), _life(name, halves=True)
        rating = whole.loads[0].rating
        assert rating is not None
        for number, spectrum in enumerate(whole.spectra):
            flank = rating.flanks[number % len(rating.flanks)]
            single = flank.root_safety if spectrum.kind == "root" else flank.contact_safety
            line, cycles = spectrum.spectrum.line, HOURS * float(spectrum.spectrum.cycles.sum())
            what = f"{spectrum.kind} of {spectrum.name}"
            ours = spectrum.spectrum.safety(HOURS)
            rows.append(within(name, "single run", f"{what}: S", single * line.at(cycles), ours, ROUNDED))
            if math.isfinite(hours := spectrum.spectrum.hours):
                of_halves = halves.spectra[number].spectrum.hours
                rows.append(within(name, "whole", f"{what}: life of halves [h]", hours, of_halves, ROUNDED))
    return tuple(rows)


def reversed_set() -> tuple[Row, ...]:
    """Flanks of planets under torques of both signs: what sun and ring press on the same flank adds."""
    case = read_case(_tables("planetary_27_40_108", torque="60 N m", speed="543 rpm"))
    shares = 0.7, 0.3
    loads = [
        RatedLoad(rate_case(case, torque=torque), torque, 540.0, share)
        for torque, share in zip((420.0, -380.0), shares, strict=True)
    ]
    spectra = {(rated.kind, rated.name): rated for rated in rated_spectra(case, loads)}
    line, each = GEAR_STEELS["case hardened steel"], 3600.0 * 540.0 / 40.0
    rows = []
    for name, forward, back in (("planet, sun side", 1, 2), ("planet, ring side", 2, 1)):
        flanks = [
            load.rating.flanks[number] for load, number in zip(loads, (forward, back), strict=True) if load.rating
        ]
        ratio = [1.0 / flank.contact_safety for flank in flanks]
        by_hand = damage_by_hand(ratio, [each * share for share in shares], line.contact_life)
        ours = float(spectra["flank", name].spectrum.damage.sum())
        rows.append(within("reversed", "sum of both mates by hand", f"{name}: damage an hour", by_hand, ours, ROUNDED))
    sun = spectra["root", "sun"].spectrum
    ratio = [1.0 / (load.rating.flanks[0].root_safety * 0.7) for load in loads if load.rating]
    by_hand = damage_by_hand(ratio, [3600.0 * 540.0 / 9.0 * share for share in shares], line.root_life)
    quantity = "sun: damage of its roots an hour, Y_M 0.7"
    rows.append(within("reversed", "sum of both by hand", quantity, by_hand, float(sun.damage.sum()), ROUNDED))
    return tuple(rows)


def _unit_tables() -> dict[str, Any]:
    """Tables of the gearbox of the file as they are imported, for the life that is asked for."""
    (draft,) = case_drafts(read_model(FILE), "two_stages.toml")
    tables = tomllib.loads(draft.text)
    for bearing in tables["bearing"]:
        bearing.pop("estimated", None)
    tables["deflection"] = {"slices": 7}
    tables["operation"]["required_hours"] = HOURS
    return tables


def _solved_unit(tables: dict[str, Any], steps: Steps) -> tuple[Any, Any, tuple[RatedSpectrum, ...]]:
    """Case, deflection.nc and spectra of a gearbox."""
    from femgear.trains.gearbox.tooth_life import stage_spectra

    case = read_case(tables)
    result = solve_deflections(case, steps=steps)
    return case, result.contents(), stage_spectra(result.states)


@lru_cache(maxsize=1)
def _unit() -> tuple[Any, Any, tuple[RatedSpectrum, ...]]:
    """The gearbox of case hardened steel, with an application factor under which it wears."""
    tables = _unit_tables()
    for stage in tables["pair"]:
        stage["teeth"]["material"] |= STEEL | {"estimated": False}
    tables["strength"] = {"quality": 6, "application_factor": 3.5}
    return _solved_unit(tables, Steps())


def spectrum_of_a_file() -> tuple[Row, ...]:
    """Gearbox of two stages with four load cases: torques, speeds and shares of its file, and what follows by hand."""
    case, data, spectra = _unit()
    torque, share = np.array([567.0, 345.0, 456.0, 789.0]), np.array([0.2, 0.3, 0.35, 0.15])
    speed = np.array([543.0, 3456.0, 1234.0, 789.0])
    rows, hours = [], HOURS * 60.0 * share * speed
    for kind, exponent in (("root", math.log(3e3) / math.log(2.5)), ("flank", 0.5 * math.log(500.0) / math.log(1.6))):
        reference = ((hours @ torque**exponent) / hours.sum()) ** (1.0 / exponent)
        ours = float(data[f"{kind}_equivalent_torque"].values[0])
        quantity = f"{kind} of gear 1, first stage: equivalent torque [N m]"
        rows.append(within("two stages", UNIT, quantity, reference, ours, 1e-9))
    return (*rows, *_safeties(case, data, spectra, hours, "two stages", "K_A 3.5, 720 HV"))


def spectrum_as_imported() -> tuple[Row, ...]:
    """The same gearbox with nothing but what its file and the import give: steel by its tensile strength, K_A 1."""
    steps, share = Steps(), np.array([0.2, 0.3, 0.35, 0.15])
    tables = _unit_tables()
    case, data, spectra = _solved_unit(tables, steps)
    material = case.pair[0].teeth["material"]
    hours = HOURS * 60.0 * share * np.array([543.0, 3456.0, 1234.0, 789.0])
    name, note = (
        "two stages as imported",
        f"{material['treatment']}, {material['hardness']:g} HV, as the import estimates",
    )
    rows = list(_safeties(case, data, spectra, hours, name, note))
    whole = {(rated.kind, rated.name): rated.spectrum.damage for rated in spectra}
    load_cases = tables["operation"]["load_case"]
    halves = [{**load_cases[3], "name": name, "share": 0.5 * load_cases[3]["share"]} for name in ("half", "other half")]
    for words, chosen, parts in (
        ("load case 4 in two equal halves over the whole", [*load_cases[:3], *halves], share.size * (1.0,)),
        ("load case 4 alone over its bin", [{**load_cases[3], "share": 1.0}], (0.0, 0.0, 0.0, 1.0 / share[3])),
    ):
        other = _solved_unit({**tables, "operation": {**tables["operation"], "load_case": chosen}}, steps)[2]
        apart = [
            abs(rated.spectrum.damage.sum() / (whole[rated.kind, rated.name] @ parts) - 1.0)
            for rated in other
            if whole[rated.kind, rated.name] @ parts
        ]
        rows.append(
            at_most(name, "the same gearbox", f"damage of {len(apart)} flanks and roots, {words}", ROUNDED, max(apart))
        )
    return tuple(rows)


def _safeties(case, data, spectra, hours: np.ndarray, name: str, note: str) -> Iterator[Row]:
    """Safeties of all roots and flanks over load cases (n,) by hand, in which the first gear turns so often."""
    flanks = data["iso_flank"].values
    for rated in spectra:
        kind, stage = rated.kind, rated.name.partition(" of ")[2]
        mesh, gear = next((m, g) for m, g in np.ndindex(*flanks.shape) if flanks[m, g] == rated.name)
        safety = data["iso_root_safety" if kind == "root" else "iso_contact_safety"].values[:, mesh, gear]
        wheels = case.pair[[pair.name for pair in case.pair].index(stage)].teeth
        first = case.pair[0].teeth
        turns = 1.0 if stage == case.pair[0].name else first["gear_1"]["teeth"] / first["gear_2"]["teeth"]
        turns *= 1.0 if gear == 0 else wheels["gear_1"]["teeth"] / wheels["gear_2"]["teeth"]
        steel = GEAR_STEELS[wheels["material"]["treatment"]]
        line = steel.root_life if kind == "root" else steel.contact_life
        reference = _safety_by_hand(1.0 / safety, hours * turns, line)
        place = [str(name) for name in data[kind].values].index(rated.name)
        ours = float(data[f"{kind}_spectrum_safety"].values[place])
        quantity = f"{kind} of {rated.name}: S over {HOURS:g} h"
        yield within(name, UNIT, quantity, reference, ours, 1e-9, note=note)


def _safety_by_hand(ratio: np.ndarray, cycles: np.ndarray, line: LifeLine) -> float:
    """Find the factor on all stresses with which Miner's sum is 1, by halving."""
    low, high = 0.1 / float(ratio.max()), 10.0 / float(ratio.max())
    for _ in range(200):
        middle = 0.5 * (low + high)
        beyond = middle * float(ratio.max()) > line.factors[0]
        low, high = (low, middle) if beyond or damage_by_hand(middle * ratio, cycles, line) > 1.0 else (middle, high)
    return low


def lives_in_hours() -> tuple[Row, ...]:
    """Hours until the damage is 1, beside those of one stress that does the same on one slope."""
    line, ratio, cycles = (
        GEAR_STEELS["case hardened steel"].root_life,
        np.array([1.6, 1.3, 1.1]),
        np.array([1.0, 20.0, 400.0]),
    )
    mean = ((cycles @ ratio**line.slope) / cycles.sum()) ** (1.0 / line.slope)
    hours = 3e6 * mean**-line.slope / cycles.sum()
    ours = ToothSpectrum(ratio, cycles, line).hours
    return (within("slope", "one stress of the same damage", "life of three stresses [h]", hours, ours, ROUNDED),)
