"""Tables of safeties after ISO 6336, the same for all trains: rows of a verdict, and a table of all flanks.

Where a safety is asked for and something is missing, notes name the entry of the case file that would give it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.gear_set import planetary_set
from femgear.report.response import some_at_a_time, stored_harmonics
from femgear.report.style import family
from femgear.report.tables import Block, Marks, tabulate
from femgear.stages.friction_source import friction_rows
from femgear.stages.heat_results import heat_rows
from femgear.stages.life_results import life_rows
from femgear.stages.losses_results import efficiency_rows
from femgear.stages.planet_bearings import planet_bearing_rows
from femgear.stages.strength import OF_ROOTS, OF_TEETH, MeshLoadFactors, RatedFlank, Rating, rate_case, rating_wanted
from femgear.stages.stress_reasons import reason_row
from femgear.system.fourier import sample

if TYPE_CHECKING:
    import xarray as xr

    from femgear.storage.results import Results

SYMBOLS = {"sharing": "K_gamma", "dynamic": "K_v", "face": "K_Hβ", "transverse": "K_Hα"}
"""Symbols of the load factors by the names of their arrays."""
OF_RESPONSE = "W-PULL", "W-TAIL", "W-SEPARATION"
"""Codes of the findings that concern safeties with the K_v of a response."""
RATED_RESPONSES = "dynamics", "housing", "response"
"""Stages with speeds of operation, which K_v of safeties is of."""
_GIVEN_BY = {
    "sharing": "K_γ (a response, or of rigid bodies a static solution)",
    "dynamic": "K_v (a response, or operation.speeds with strength.quality)",
    "face": "K_Hβ (a static solution with static.slices = 25)",
    "transverse": "K_Hα and K_Fα (strength.quality)",
}
"""Load factors that may be missing, with the entries that give them."""


def strength_verdict(results: Results) -> Iterator[Block]:
    """Tabulate safeties and efficiency of a pair or a set of rigid bodies, where the case asks for them.

    Among them stands which stresses of finite elements differ from nominal ones, and why, where there are such.

    Safeties need teeth and a torque alone: K_gamma and K_Hbeta are those of the static solution, K_v that of the
    response, as far as they were computed.
    """
    marks, stages = Marks(results.findings), results.stages
    reasons = list(reason_row(results.stress)) if "stress" in stages else []
    rows = [*reasons, *friction_rows(results, marks), *_lives(results, marks)]
    rows += [*efficiency_rows(results, marks), *heat_rows(results, marks)]
    rated = rate_results(results)
    if rated is None:
        if rows:
            yield Block("Verdict", rows=tuple(rows), notes=marks.notes)
        return
    rating, kinds = rated
    rows = [
        (name, marks(marks(text, *doubts_of(f"{name} {text}")), *OF_RESPONSE, of=RATED_RESPONSES))
        for name, text in safety_rows(rating, kinds)
    ] + rows
    yield Block("Verdict", rows=tuple(rows), notes=(*safety_notes(rating), *marks.notes))
    yield strength_block(rating, kinds)


def rate_results(results: Results) -> tuple[Rating, list[str]] | None:
    """Rate the teeth of a run with the load factors that it has; None where the case asks for no safeties.

    Beside the rating stand the names of its kinds of mesh.
    """
    if not rating_wanted(results.case):
        return None
    stages = results.stages
    kinds, dynamic = kind_names(planetary_set(results.case).mesh_names), None
    sharing, face = computed_load_factors(results.static, kinds) if "static" in stages else (None, None)
    if "dynamics" in stages:
        dynamic = computed_dynamic_factor(results.dynamics, len(kinds))
    elif "response" in stages:
        dynamic = factor_of_two_frequencies(results.response, len(kinds))
        sharing = sharing_of_two_frequencies(results.response, len(kinds)) if sharing is None else sharing
    return rate_case(results.case, sharing=sharing, dynamic=dynamic, face=face), kinds


def computed_load_factors(static: xr.Dataset, kinds: Sequence[str]) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Find K_gamma and K_Hbeta (kinds,) of static.nc; None of one planet, and without slices."""
    planets, face = static.sizes["planet"], None
    if "face_load_factor" in static:
        face = _largest_of_kinds(static["face_load_factor"].values, kinds)
    if planets == 1:
        return None, face
    share = static["load_share"].mean("position").values.max() * planets
    return np.full(len(kinds), share), face


def sharing_of_two_frequencies(response: xr.Dataset, kinds: int) -> np.ndarray:
    """Find K_gamma (kinds,) of response.nc: largest mean force of a mesh over that of all of its kind, at any speed."""
    mean = (response["carrier_order"].values == 0) & (response["mesh_order"].values == 0)
    shares = []
    for i in range(response.sizes["speed"]):
        force = np.real(stored_harmonics(response.isel(speed=i), "mesh_force")[:, mean].sum(axis=1)).reshape(kinds, -1)
        shares.append(force.max(axis=1) / force.mean(axis=1))
    return np.max(shares, axis=0)


def factor_of_two_frequencies(response: xr.Dataset, kinds: int) -> np.ndarray:
    """Find K_v (kinds,) of response.nc, whose lines have multiples of two frequencies.

    The largest force of a mesh at any phases of weight and mesh over its mean, at any speed.
    """
    orders = np.stack([response["carrier_order"].values, response["mesh_order"].values])
    phases = [2.0 * np.pi * np.arange(count) / count for count in (4 * np.abs(orders).max(axis=1) + 8)]
    turned = sum(order[:, None] * phase.ravel() for order, phase in zip(orders, np.meshgrid(*phases), strict=True))
    mean = (orders == 0).all(axis=0)
    factors = []
    for i in range(response.sizes["speed"]):
        force = stored_harmonics(response.isel(speed=i), "mesh_force")
        peak = np.real(force @ np.exp(1j * turned)).max(axis=1)
        factors.append((peak / np.real(force[:, mean].sum(axis=1))).reshape(kinds, -1).max(axis=1))
    return np.max(factors, axis=0)


def _lives(results: Results, marks: Marks) -> Iterator[tuple[str, str]]:
    """Rows of the lives of teeth and planets' bearings over the load cases, where they were computed."""
    if "life" in results.stages:
        yield from life_rows(results.life, marks)
        yield from planet_bearing_rows(results.life, marks)


def computed_dynamic_factor(dynamics: xr.Dataset, kinds: int) -> np.ndarray:
    """Find K_v (kinds,) of dynamics.nc: the largest over the mean force of a mesh, at any speed."""
    if "dynamic_factor" in dynamics:
        return np.full(kinds, float(dynamics["dynamic_factor"].max()))
    return dynamic_factors(dynamics, kinds).max(axis=0)


def dynamic_factors(dynamics: xr.Dataset, kinds: int) -> np.ndarray:
    """Find K_v (n_speeds, kinds) of dynamics.nc: the largest force of a mesh of the kind over its mean."""
    factors = []
    for block in some_at_a_time(dynamics):
        force = stored_harmonics(block, "mesh_force")
        over_mean = sample(force, 4 * force.shape[-1]).max(axis=-1) / np.real(force[..., 0])
        factors.append(over_mean.reshape(len(force), kinds, -1).max(axis=-1))
    return np.concatenate(factors)


def _largest_of_kinds(values: np.ndarray, kinds: Sequence[Any]) -> np.ndarray:
    """Largest value of every kind of mesh, of values in the order of the meshes."""
    return values.reshape(len(kinds), -1).max(axis=1)


def safety_rows(rating: Rating, kinds: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Write rows of S_F, S_H and of the smallest safety with its cause; none where no material has a limit.

    ``kinds`` are the names of the kinds of mesh, by which S_H is told where all gears have one limit.
    """
    edition, flanks = rating.nominal.edition, rating.flanks
    if any(flank.root_limit for flank in flanks):
        yield f"safety S_F, ISO 6336-3:{edition}", _of_flanks(flanks, [flank.root_safety for flank in flanks])
    if any(flank.contact_limit for flank in flanks):
        if len({flank.contact_limit for flank in flanks}) == 1 and len(kinds) > 1:
            least = [min(f.contact_safety for f in flanks if f.kind == kind) for kind in range(len(kinds))]
            text = ", ".join(f"{name} {_number(value)}" for name, value in zip(kinds, least, strict=True))
        else:
            text = _of_flanks(flanks, [flank.contact_safety for flank in flanks])
        yield f"safety S_H, ISO 6336-2:{edition}", text
    if smallest := smallest_safety(flanks):
        yield "smallest safety", smallest


def doubts_of(row: str) -> tuple[str, ...]:
    """List the codes of the findings that concern a row of `safety_rows`, by its name and text."""
    return OF_ROOTS if "S_F" in row else OF_TEETH


def smallest_safety(flanks: Sequence[RatedFlank]) -> str:
    """Write the smallest of all safeties and what makes it; empty where there is none."""
    rated = [(flank.root_safety, "S_F", flank) for flank in flanks]
    rated += [(flank.contact_safety, "S_H", flank) for flank in flanks]
    rated = [entry for entry in rated if math.isfinite(entry[0])]
    if not rated:
        return ""
    value, symbol, flank = min(rated, key=lambda entry: entry[0])
    if symbol == "S_F":
        both = "bent both ways, " if flank.reversed_bending else ""
        cause = f"{both}sigma_F0 {1e-6 * flank.root_stress:.1f} MPa, product of K {flank.root_factor:.3f}"
        return f"{symbol} {value:.2f}, root of {flank.words}: {cause}"
    cause = f"Z sigma_H0 {1e-6 * flank.contact_stress:.1f} MPa, product of K {flank.contact_factor:.3f}"
    return f"{symbol} {value:.2f}, flank of {flank.words}: {cause}"


def safety_notes(rating: Rating) -> Iterator[str]:
    """Write formulas, limits and factors of the safeties, and which entries of the case would give what is missing."""
    flanks, factors = rating.flanks, rating.factors
    over = " ".join(factor_names(factors))
    if any(flank.root_limit for flank in flanks):
        limits = _limits({flank.gear: flank.root_limit for flank in flanks})
        planets = "; Y_M = 0.7 for planets (bent both ways)" if any(f.reversed_bending for f in flanks) else ""
        moment = " Y_M" if planets else ""
        yield (
            f"S_F = 2 sigma_Flim{moment}/({f'sigma_F0 {over}'.rstrip()}): sigma_Flim = {limits} of ISO 6336-5 "
            f"(Y_ST = 2), not the permissible sigma_FP{planets}"
        )
    if any(flank.contact_limit for flank in flanks):
        limits = _limits({flank.gear: flank.contact_limit for flank in flanks})
        yield (
            f"S_H = sigma_Hlim/(Z sigma_H0{f' sqrt({over})' * bool(over)}): sigma_Hlim = {limits} of ISO 6336-5, not "
            "the permissible sigma_HP; Z: Z_B or Z_D of the flank"
        )
    if any(flank.root_limit or flank.contact_limit for flank in flanks):
        wide = "; K_Hβ stands for K_Fβ too, on the safe side" if "face" in factors.sources else ""
        transverse = "; roots have K_Fα in the place of K_Hα" if "transverse" in factors.sources else ""
        yield f"long life, every other factor of ISO 6336-2 and -3 is 1{wide}{transverse}"
    yield from missing_notes(rating)


def missing_notes(rating: Rating) -> Iterator[str]:
    """Write which entries of the case would give the limits and load factors that safeties have not."""
    flanks, factors = rating.flanks, rating.factors
    if missing := _missing_limits(flanks):
        yield missing
    if any(flank.root_limit or flank.contact_limit for flank in flanks):
        yield from _missing_factors(factors, planets=any(flank.gear == "planet" for flank in flanks))
    if factors.message:
        yield f"no load factors of part 1: {factors.message}"


def factor_names(factors: MeshLoadFactors) -> list[str]:
    """List the symbols of the load factors that are known."""
    computed = [symbol for name, symbol in SYMBOLS.items() if name in factors.sources]
    return ["K_A", *computed] if factors.application != 1.0 else computed


def _missing_factors(factors: MeshLoadFactors, *, planets: bool) -> Iterator[str]:
    """Say of the load factors that nothing told what would give them; without planets there is no K_gamma."""
    wanted = {name: text for name, text in _GIVEN_BY.items() if planets or name != "sharing"}
    if factors.given_meshes:
        wanted["face"] = "K_Hβ (strength.quality)"
    missing = [wanted[name] for name in missing_factors(factors, planets=planets)]
    if missing:
        yield f"taken as 1, in brackets what gives them: {', '.join(missing)}"


def missing_factors(factors: MeshLoadFactors, *, planets: bool) -> list[str]:
    """List the names of the load factors that nothing told, which are 1; without planets there is no K_gamma."""
    return [name for name in _GIVEN_BY if name not in factors.sources and (planets or name != "sharing")]


def missing_of_all(ratings: Iterable[Rating | None]) -> list[str]:
    """List the names of the load factors that nothing told one or more of some ratings, in the order of `SYMBOLS`."""
    missing = set[str]()
    for rating in filter(None, ratings):
        planets = any(flank.gear == "planet" for flank in rating.flanks)
        missing |= {*missing_factors(rating.factors, planets=planets)}
    return [name for name in SYMBOLS if name in missing]


def taken_as_one(names: Iterable[str]) -> str:
    """Say for an answer that load factors were taken as 1; empty of none."""
    symbols = [SYMBOLS[name].replace("K_gamma", "K_γ") for name in names]
    return f"{', '.join(symbols)} taken as 1" if symbols else ""


def _missing_limits(flanks: Sequence[RatedFlank]) -> str:
    """Name the entries of the limits that are missing; empty where all are there."""
    gears = {flank.gear: flank for flank in flanks}
    lacking = {
        f"{kind}_stress_limit": [name for name, flank in gears.items() if not getattr(flank, f"{kind}_limit")]
        for kind in ("root", "contact")
    }
    if all(len(names) == len(gears) for names in lacking.values()):
        limits = "material.root_stress_limit and material.contact_stress_limit"
        return f"give {limits}, or material.treatment and hardness, to get S_F and S_H"
    keys = [
        f"material.{limit}" if len(names) == len(gears) else f"{name}.material.{limit}"
        for limit, names in lacking.items()
        for name in (names[:1] if len(names) == len(gears) else names)
    ]
    return f"give {', '.join(keys)} to get all safeties" if keys else ""


def strength_block(rating: Rating, kinds: Sequence[str], title: str = "Strength") -> Block:
    """Tabulate stresses, tooth factors and safeties of all flanks, with the load factors of every kind of mesh."""
    columns: dict[str, Callable[[RatedFlank], str]] = {
        "": lambda flank: flank.name,
        "sigma_F0 [MPa]": lambda flank: _number(1e-6 * flank.root_stress, ".2f"),
        "Y_F": lambda flank: "-" if flank.root is None else f"{flank.root.form:.3f}",
        "Y_S": lambda flank: "-" if flank.root is None else f"{flank.root.correction:.3f}",
        "Y_β": lambda flank: "-" if flank.root is None else f"{flank.root.helix:.3f}",
        "S_F": lambda flank: _number(flank.root_safety),
        "sigma_H0 [MPa]": lambda flank: _number(1e-6 * flank.contact_stress / flank.single_pair, ".2f"),
        "Z_B, Z_D": lambda flank: _number(flank.single_pair, ".3f"),
        "S_H": lambda flank: _number(flank.contact_safety),
    }
    notes = [
        f"sigma_F0 of the {flank.name} has Y_B {flank.root.rim:.3f} and Y_DT {flank.root.deep_tooth:.3f}"
        for flank in rating.flanks
        if flank.root is not None and (flank.root.rim > 1.0 or flank.root.deep_tooth < 1.0)
    ]
    notes += [f"{name}: {_factors_of(rating, kind)}" for kind, name in enumerate(kinds)]
    if rating.nominal.message:
        notes.append(f"not by ISO 6336: {rating.nominal.message}")
    return tabulate(f"{title}, ISO 6336:{rating.nominal.edition}", rating.flanks, columns, notes)


def _factors_of(rating: Rating, kind: int) -> str:
    """Write the load factors of a kind of mesh with their sources, those of part 1 beside computed ones."""
    factors, of_part_1 = rating.factors, rating.standard[kind]
    texts = [f"K_A {factors.application:g}"]
    for name, symbol in SYMBOLS.items():
        if name == "sharing" and name not in factors.sources:
            continue
        source = factors.sources.get(name, "taken as 1")
        texts.append(f"{symbol} {float(getattr(factors, name)[kind]):.3f} ({source})")
    if of_part_1 is not None:
        dynamic, by_speed = of_part_1.dynamic, _number(of_part_1.by_speed, ".3f")
        resonance = f"N {dynamic.resonance_ratio:.3f}, {dynamic.range}"
        texts.append(f"K_Fα {of_part_1.root_transverse:.3f}")
        texts.append(f"by part 1 K_v {dynamic.factor:.3f} (method B, {resonance}) and {by_speed} (method C)")
        if not factors.sources.get("face", "").startswith("part 1"):
            texts.append(f"K_Hβ {of_part_1.face:.3f} (method C, shafts and bearings rigid)")
    return ", ".join(texts)


def kind_names(mesh_names: Sequence[str]) -> list[str]:
    """List the names of the kinds of mesh, ``"sun-planet"`` of ``"sun-planet 1"``, in the order of the meshes."""
    return list(dict.fromkeys(family(str(name)) for name in mesh_names))


def _of_flanks(flanks: Sequence[RatedFlank], values: Sequence[float]) -> str:
    return ", ".join(f"{flank.name} {_number(value)}" for flank, value in zip(flanks, values, strict=True))


def _number(value: float, form: str = ".2f") -> str:
    """Write a number, a dash where there is none."""
    return f"{value:{form}}" if math.isfinite(value) else "-"


def _limits(limits: dict[str, float | None]) -> str:
    """Write the limits of the materials [Pa] by gear, one where they are the same for all."""
    if len({*limits.values()}) == 1:
        return f"{1e-6 * (next(iter(limits.values())) or 0.0):g} MPa"
    return ", ".join(
        f"{'none' if limit is None else f'{1e-6 * limit:g} MPa'} ({gear.replace('_', ' ')})"
        for gear, limit in limits.items()
    )
