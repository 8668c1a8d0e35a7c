"""Stage "heat": temperatures and oil film of the teeth over the path of contact, by the loads of the contact.

At every point of the path of a kind of mesh stands the largest load over width that any tooth pair, any slice and any
planet has there. Pressure, flash temperature (ISO/TS 6336-20) and film thickness (ISO/TS 6336-22, method A) follow from
it with sliding and curvature. Bulk temperatures are those of either standard: from the flash temperatures, and from the
losses of the mesh.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.dependencies import loss_entries
from femgear.case.gear_set import materials_of
from femgear.case.lubrication import LubricantSection, heat_missing, losses_wanted, oil_at
from femgear.case.quantities import CELSIUS
from femgear.case.tooth_friction import friction_coefficient, law_friction, shaft_turning
from femgear.contact.face_width import slices_ahead
from femgear.gears.contact_temperature import (
    SUPPLY,
    bulk_temperature_of_flash,
    bulk_temperature_of_losses,
    contact_half_width,
    flash_temperature,
    hertz_pressure,
    mean_over_path,
    path_load_sharing,
    reduced_modulus,
    scuffing_safety,
    scuffing_temperature,
)
from femgear.gears.friction import PathSpeeds, path_speeds
from femgear.gears.micropitting import film_thickness, oil_state
from femgear.gears.profile import base_helix_angle
from femgear.stages.heat_results import HeatResult, MeshHeat, describe_heat, heat_tables
from femgear.stages.protocol import Stage, one_blas_thread

if TYPE_CHECKING:
    from femgear.contact.mesh_cycle import MeshCycle
    from femgear.gears.pair import GearPair
    from femgear.stages.losses_results import LossesResult
    from femgear.stages.static_results import StaticResult

POINTS = 101
"""Of the path of contact, between its ends."""


def load_over_path(static: StaticResult, kind: int, path: np.ndarray) -> np.ndarray:
    """Find the largest load over face width (n,) [N/m] in the transverse section at points of the path (n,) [m].

    Of all tooth pairs, slices and meshes of a kind; zero where no tooth pair carries.
    """
    cycle, gears = static.cycle, static.planetary_set
    rows, width = gears.kind_rows[kind], gears.kinds[kind].face_width
    sense = -1.0 if static.sun_torque < 0.0 else 1.0
    largest = np.zeros(len(path))
    for record in (cycle, *(() if cycle.between is None else cycle.between.records)):
        place, load = _samples(record, rows, gears.base_pitch, static.overlap_ratio)
        if record is not cycle:
            largest = np.maximum(largest, _nearest(path, sense * place.ravel(), load.ravel() / width))
            continue
        each = len(cycle.position) // cycle.periods
        for period in range(cycle.periods):
            part = slice(period * each, (period + 1) * each)
            for at, values in zip(place[..., part], load[..., part], strict=True):
                for number in range(at.shape[1]):
                    along, over = sense * at[:, number].ravel(), values[:, number].ravel() / width
                    order = np.argsort(along)
                    carried = np.interp(path, along[order], over[order], left=0.0, right=0.0)
                    largest = np.maximum(largest, carried)
    return largest


def _samples(record: MeshCycle, rows: slice, pitch: float, overlap: float) -> tuple[np.ndarray, np.ndarray]:
    """Places and loads (m, T, S, P) of the tooth pairs of some meshes in their slices [m], [N]."""
    if record.slice_load is None:
        return record.path[rows][:, :, None], record.tooth_load[rows][:, :, None]
    load = record.slice_load[rows]
    ahead = pitch * slices_ahead(overlap, load.shape[2])[:, None]
    return np.broadcast_to(record.path[rows][:, :, None] + ahead, load.shape), load


def _nearest(path: np.ndarray, place: np.ndarray, load: np.ndarray) -> np.ndarray:
    """Loads at the points of the path that are nearest to their places."""
    values, step = np.zeros(len(path)), path[1] - path[0]
    number = np.rint((place - path[0]) / step).astype(int)
    inside = (number >= 0) & (number < len(path))
    np.maximum.at(values, number[inside], load[inside])
    return values


def mesh_heat(
    case: Any,
    static: StaticResult,
    kind: int,
    *,
    mesh_frequency: float,
    loss: float,
    rules: Any = None,
) -> MeshHeat:
    """Compute temperatures and oil film of a kind of mesh over its path of contact.

    Parameters
    ----------
    case : case of gears
        Whose teeth they are.
    kind : int
        Number of the kind of mesh.
    mesh_frequency : float
        [Hz]
    loss : float
        Largest loss of a mesh of the kind [W].
    rules : case, optional
        With the sections ``losses``, ``lubricant`` and ``strength``, where these are not those of the case.
    """
    rules = case if rules is None else rules
    gears = static.planetary_set
    pair, oil = gears.kinds[kind], rules.lubricant
    base = abs(base_helix_angle(case.pressure_angle, case.helix_angle or 0.0))
    path = np.linspace(pair.path[0], pair.path[1], POINTS)
    speeds, at_pitch = path_speeds(pair, path, mesh_frequency, base), path_speeds(pair, 0.0, mesh_frequency, base)
    factor = rules.strength.application_factor
    # of helical teeth the normal force and the line of contact are both 1/cos(beta_b) longer
    line_load = factor * load_over_path(static, kind, path)
    rows = gears.kind_rows[kind]
    mean = factor * float((static.cycle.force + static.cycle.back_force)[rows].mean(axis=-1).max()) / pair.face_width
    materials = materials_of(case)
    modulus = reduced_modulus(*((materials[n].youngs_modulus, materials[n].poisson_ratio) for n in gears.mates[kind]))
    pressure = hertz_pressure(line_load, speeds.radius, modulus)
    friction = [_friction(rules, name, pair, mean, at_pitch) for name in ("iso", "niemann")]
    if rules.losses.friction in ("constant", "table"):
        force = np.array([mean * pair.face_width])
        friction = 2 * [float(friction_coefficient(rules, pair, force, mesh_frequency, base)[0])]
    supply, hot = SUPPLY[oil.supply], oil.temperature

    def flash(coefficient: float, load: np.ndarray) -> np.ndarray:
        half = contact_half_width(load, speeds.radius, modulus)
        return flash_temperature(coefficient, load, half, speeds.rolling_1, speeds.rolling_2)

    rise, other_rise = flash(friction[0], line_load), flash(friction[1], line_load)
    shared = flash(friction[0], mean * path_load_sharing(pair, path, abs(static.overlap_ratio), base))
    meshes = max(_meshes_of(gears, kind))
    bulk = float(bulk_temperature_of_flash(hot, mean_over_path(path, rise), supply=supply, meshes=meshes))
    of_losses = float(
        bulk_temperature_of_losses(hot, factor * loss, pair.centre_distance, pair.face_width, supply=supply)
    )
    film = _film(rules, pair, speeds, pressure, modulus, of_losses, other_rise)
    scuffing = _scuffing(rules)
    highest = bulk + float(rise.max())
    return MeshHeat(
        path,
        line_load,
        pressure,
        np.stack(speeds.specific_sliding),
        np.abs(speeds.sliding),
        rise,
        shared,
        film,
        (float(friction[0]), float(friction[1])),
        (bulk, of_losses),
        scuffing,
        float(scuffing_safety(scuffing, highest, hot)) if math.isfinite(scuffing) else math.nan,
        hot,
    )


def _meshes_of(gears: Any, kind: int) -> tuple[int, int]:
    """Meshes that gear 1 and gear 2 of a kind of mesh have in one turn."""
    counts = [0] * len(gears.gears)
    for numbers in gears.mates:
        for number in numbers:
            counts[number] += 1 if gears.repeated[number] else gears.n_planets
    first, second = gears.mates[kind]
    return counts[first], counts[second]


def _friction(rules: Any, name: str, pair: GearPair, line_load: float, at_pitch: PathSpeeds) -> float:
    """Coefficient of friction of a standard."""
    return float(law_friction(rules, name, pair, np.array(line_load), at_pitch))


def _film(rules: Any, pair, speeds: PathSpeeds, pressure, modulus: float, bulk: float, rise) -> np.ndarray:
    """Film thickness over roughness (n,) on the path; NaN where nothing carries, or the oil is not known."""
    oil: LubricantSection = rules.lubricant
    if oil.viscosity_40 is None or oil.viscosity_100 is None:
        return np.full(len(pressure), math.nan)
    oil_data = oil.viscosity_40, oil.viscosity_100, oil.density_at_15, oil.kind
    loaded = np.where(pressure > 0.0, pressure, math.nan)
    bodies, contact = oil_state(*oil_data, bulk), oil_state(*oil_data, bulk + rise)
    film = film_thickness(speeds.radius, modulus, speeds.sum_speed, loaded, bodies, contact)
    return film / rules.losses.roughness


def _scuffing(rules: Any) -> float:
    """Scuffing temperature of the oil [K]; NaN where the case has no load stage."""
    oil: LubricantSection = rules.lubricant
    if oil.fzg_stage is None:
        return math.nan
    lubricant = oil.factor * (1e3 * oil_at(rules)) ** -0.05
    return CELSIUS + scuffing_temperature(oil.fzg_stage, lubricant)


@one_blas_thread()
def solve_heat(case: Any, static: StaticResult, losses: LossesResult) -> HeatResult:
    """Compute temperatures and oil film of all kinds of mesh at all speeds of operation."""
    gears, (name, *_) = static.planetary_set, losses.points[0].stages
    points = []
    for point, speed in zip(losses.points, case.operation.speeds, strict=True):
        _, frequency = shaft_turning(case, gears, speed)
        largest = [float(point.mesh_loss[name][rows].max()) for rows in gears.kind_rows]
        points.append(
            tuple(
                mesh_heat(case, static, kind, mesh_frequency=frequency, loss=loss) for kind, loss in enumerate(largest)
            )
        )
    kinds = tuple(f"{pair.gear_1.name}-{pair.gear_2.name}".replace("_", " ") for pair in gears.kinds)
    return heat_result(case, tuple(points), kinds, "speed", np.array(case.operation.speeds))


def heat_result(
    rules: Any, points: tuple[tuple[MeshHeat, ...], ...], kinds: tuple[str, ...], dim: str, labels: Any
) -> HeatResult:
    """Make the result of a case or a gearbox, with the temperature and the limits of its oil.

    Parameters
    ----------
    rules : case
        With the section ``lubricant``.
    points, kinds, dim, labels
        As of `HeatResult`.
    """
    oil: LubricantSection = rules.lubricant
    permissible = math.nan if oil.permissible_film is None else oil.permissible_film
    return HeatResult(points, kinds, dim, labels, oil.temperature or math.nan, permissible)


def no_heat(case: Any) -> str:
    """Tell why a case of teeth has no temperatures; empty where it has."""
    return heat_missing(case) or ("" if case.operation.speeds else "operation.speeds gives no speed")


HEAT = Stage(
    name="heat",
    title="Temperatures",
    solve=solve_heat,
    takes=("static", "losses"),
    decided_by=loss_entries,
    wanted=lambda case: losses_wanted(case) and not heat_missing(case),
    unavailable=no_heat,
    verdict=lambda result: {"points": len(result.points)},
    describe=lambda results: describe_heat(results.heat),
    tables=lambda results: heat_tables(results.heat),
    warnings=HeatResult.warnings,
)
