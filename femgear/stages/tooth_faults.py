"""Faults of teeth in words: where they are, what they do, what the model leaves out, and where their lines lie."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.fault_sections import FaultSection, keyed_faults
from femgear.case.gear_set import planetary_set, set_deviations
from femgear.contact.flank_pairs import RIGHT, acting_flanks
from femgear.contact.repeated_positions import on_faulty_tooth
from femgear.contact.windows import pair_paths
from femgear.findings import FAULT, Finding, percent
from femgear.gears.deviations import rotational_symmetry
from femgear.gears.faults import BrokenTip, Crack, MissingTooth, Spall, ToothFault
from femgear.gears.pair import BRANCH
from femgear.report.tables import Block, tabulate
from femgear.stages.wear import POINTS, MeshingTeeth, wear_entries, worn_flanks

if TYPE_CHECKING:
    from femgear.gears.pair import GearSet

_LEFT_OUT = {
    MissingTooth: "the body keeps its compliance: the teeth beside the gap have the rim of a whole gear",
    BrokenTip: "the tooth that is left keeps the compliance of a whole one",
    Spall: "a pit that only separates flanks leaves out that the tooth has lost material, some per cent of the "
    "transmission error",
    Crack: "faces of the crack touch without friction, the crack does not grow, and stresses in the root of its tooth "
    "are those of a whole one",
}
"""What the model of every kind of fault leaves out."""
_SHOWS = 0.02
"""Change of a transmission error or of a share by a fault from which on it is told, over its usual value."""
_HEARD = 1e-4
"""Line that a fault makes new, from which on it is told, over the largest line."""
_TOLD_WIDTH = 0.02
"""Difference between the width of a spall and that of its slices, relative, from which on it is told."""


def fault_findings(case: Any) -> Iterator[Finding]:
    """List what is left out of the faults of a case, and those that nothing shows."""
    gears, back = planetary_set(case), case.torque_on_first_gear() < 0.0
    yield from left_out_of_faults(case)
    for key, fault in keyed_faults(case, gears):
        if fault.flank is not None and fault.flank not in _carrying(gears, fault, back=back):
            looked = ", and back flanks are not looked at" if not case.static.back_flanks else ""
            text = f"this flank carries nothing under this torque{looked}"
            yield Finding("W-FAULT", key, text, remedy="give the fault to the other flank, or turn the torque round")
    yield from _unseen(case, gears)
    yield from _in_whole_slices(case, gears)
    yield from _out_of_mesh(case, gears)


def _out_of_mesh(case: Any, gears: GearSet) -> Iterator[Finding]:
    """Teeth so many of which are missing that at times no planet has teeth in all its meshes."""
    missing = [fault for fault in set_deviations(case).faults if isinstance(fault, MissingTooth)]
    for number in sorted({fault.gear for fault in missing}):
        gear, faults = gears.gears[number], [fault for fault in missing if fault.gear == number]
        turns = np.arange(gear.teeth)
        _, tooth = pair_paths(gears, np.zeros(1), both_flanks=False)
        left = ~np.any([on_faulty_tooth(gears, fault, tooth, turns) for fault in faults], axis=0)
        meshes = left.any(axis=2)
        carried = np.all([meshes[rows] for rows in gears.kind_rows], axis=0).any(axis=0)
        if not carried.all():
            share = f"{percent((~carried).mean())} of the mesh periods"
            text = f"{len(faults)} missing teeth: in {share} nothing carries the torque"
            remedy = "leave teeth that mesh in turn with one planet or another"
            yield Finding("W-FAULT", f"{gear.name}.fault", text, severity=FAULT, remedy=remedy)


def _in_whole_slices(case: Any, gears: GearSet) -> Iterator[Finding]:
    """Spalls over a part of the face width that whole slices make wider or narrower than they are."""
    count, width = case.static.slices, min(gears.mesh_widths)
    for key, fault in keyed_faults(case, gears):
        if not isinstance(fault, Spall) or not fault.across or count < 2:
            continue
        given, covered = width * (fault.across[1] - fault.across[0]), int(fault.in_slices(count).sum())
        if abs(covered * width / count - given) > _TOLD_WIDTH * given:
            text = (
                f"{1e3 * given:.4g} mm of the width count as {covered} of {count} slices, "
                f"{1e3 * covered * width / count:.4g} mm"
            )
            yield Finding("W-FAULT", f"{key}.width", text, remedy="give a width of whole slices, or more slices")


def left_out_of_faults(case: Any) -> Iterator[Finding]:
    """List what the model leaves out of the faults of a case."""
    kinds: dict[type, list[str]] = {}
    for key, fault in keyed_faults(case, planetary_set(case)):
        kinds.setdefault(type(fault), []).append(key)
    for kind, keys in kinds.items():
        several = f"{len(keys)} faults, up to {keys[-1]}: " if len(keys) > 1 else ""
        if kind in _LEFT_OUT:
            text, remedy = several + _LEFT_OUT[kind], "take sizes with that margin; orders and places are exact"
            yield Finding("W-FAULT", keys[0], text, remedy=remedy)
        if kind in (Spall, BrokenTip):
            text = (
                f"{several}the flank has a sharp edge, where pressure has no limit: the largest one is that of the grid"
            )
            yield Finding("W-EDGE", keys[0], text, remedy="look at pressures away from the faulty tooth")


def _carrying(gears: GearSet, fault: ToothFault, *, back: bool) -> set[int]:
    """Flanks of the faulty gear that carry."""
    sides = {side for number, acting in acting_flanks(gears) if number == fault.gear for *_, side in acting}
    return {RIGHT - side for side in sides} if back else sides


def sun_fault_step(gears: GearSet) -> float:
    """Find the carrier orders of whose multiples a fault of a sun tooth makes lines, with equal planets.

    A planet that is ahead by ``2 pi n/N`` meets the faulty tooth ``n/N`` turns of the sun against the carrier later.
    Of what a sensor beside the ring hears of a planet with carrier order q, and with the order m of the sun's turns,
    all planets together leave what differs in q - m by a multiple of N: lines are ``N q + m (z_s + z_r)/z_s`` with
    whole q and m, that is multiples of ``N gcd((z_s + z_r)/N, z_s)/z_s``. Of whole sets it is P. D. McFadden and
    J. D. Smith, Proc. Inst. Mech. Eng. C 199, 1985, 65-70.
    """
    sun, ring, N = gears.gears[0].teeth, gears.gears[-1].teeth, gears.n_planets
    return N * math.gcd((sun + ring) // N, sun) / sun


def _unseen(case: Any, gears: GearSet) -> Iterator[Finding]:
    """Faults whose lines all lie where a whole set has lines."""
    equal = len(gears.gears) > 2 and gears.n_planets > 1 and gears.rotations == gears.n_planets
    if not equal:
        return
    N, faults = gears.n_planets, set_deviations(case).faults
    of_sun = any(fault.gear == 0 and fault.tooth is not None for fault in faults)
    if of_sun and sun_fault_step(gears) % N == 0:
        text = (
            f"all lines of a faulty sun tooth lie at multiples of {N} carrier orders, where equal planets have theirs"
        )
        yield Finding("W-FAULT", "sun.fault", text, remedy="look at their levels: no line is new")
    if any(fault.gear > BRANCH and fault.tooth is not None for fault in faults):
        text = f"a faulty tooth of the ring makes no new lines: all lie at multiples of {N} carrier orders"
        yield Finding("W-FAULT", "ring.fault", text, remedy="look at their levels: no line is new")


def fault_frequencies(gears: GearSet, mesh_frequency: float) -> dict[str, float]:
    """Compute how often a faulty tooth of every gear meets a mate [Hz], by the names of the gears.

    Of sun and ring with any of the planets, of a planet with one flank. The mesh frequency is in Hz.
    """
    gears_of_planets = {number for number in range(len(gears.gears)) if gears.repeated[number]}
    return {
        gear.name: mesh_frequency / gear.teeth * (1 if number in gears_of_planets else gears.n_planets)
        for number, gear in enumerate(gears.gears)
    }


def describe_faults(case: Any, mesh_frequency: float | None) -> Iterator[Block]:
    """Tabulate the faults of a case, and how often their teeth meet mates at a mesh frequency [Hz], if any is known."""
    gears = planetary_set(case)
    faults = [*keyed_faults(case, gears)]
    if not faults:
        return
    often = {} if mesh_frequency is None else fault_frequencies(gears, mesh_frequency)
    names = {(body.gear, body.copy): body.name for body in gears.bodies}
    sections = {
        f"{gear.name}.fault[{i}]": section
        for gear in gears.gears
        for i, section in enumerate(getattr(case, gear.name).fault)
    }
    columns = {
        "fault": lambda item: sections[item[0]].kind,
        "gear": lambda item: names[item[1].gear, item[1].copy],
        "tooth": lambda item: "all" if item[1].tooth is None else str(item[1].tooth),
        "flank": lambda item: sections[item[0]].flank or "both",
        "meets a mate [Hz]": lambda item: (
            f"{often[gears.gears[item[1].gear].name]:.4f}" if often and item[1].tooth is not None else "-"
        ),
    }
    notes = tuple(f"{text}: drawings have the tooth whole" for text in undrawn_faults(case))
    yield replace(tabulate("Faults of teeth", faults, columns), notes=notes)


def fault_words(case: Any) -> list[str]:
    """Name the faults of a case by gear, tooth, kind and size: ``"planet 1, tooth 3: crack of 1.5 mm"``."""
    gears = planetary_set(case)
    names = {(body.gear, body.copy): body.name.replace("_", " ") for body in gears.bodies}
    return [
        f"{names[fault.gear, fault.copy]}, "
        f"{'all teeth' if fault.tooth is None else f'tooth {fault.tooth}'}: {_size_words(_section(case, key))}"
        for key, fault in keyed_faults(case, gears)
    ]


def _section(case: Any, key: str) -> FaultSection:
    """Section of a fault by its entry, such as ``planet.fault[0]``."""
    gear, _, number = key.partition(".fault[")
    return getattr(case, gear).fault[int(number.rstrip("]"))]


def _size_words(section: FaultSection) -> str:
    """Write the kind of a fault with its size."""
    depth, length = section.depth or 0.0, section.length or 0.0
    match section.kind:
        case "crack":
            return f"crack of {1e3 * depth:.4g} mm"
        case "broken corner":
            return f"tip broken off by {1e3 * length:.4g} mm"
        case "spall":
            wide = "" if section.width is None else f"{1e3 * section.width:.4g} mm wide, "
            return f"pit of {1e3 * length:.4g} mm, {wide}{1e6 * depth:.4g} µm deep"
        case "wear":
            return f"worn by {1e6 * max((depth, *(section.depths or ()))):.4g} µm"
        case _:
            return "missing"


def fault_effects(results: Any) -> Iterator[str]:
    """Tell what the faults of a run do: to the transmission error, to the load sharing, and to the lines of a sensor.

    Mesh periods in which a faulty tooth carries are told from the others by the median of all: a fault of one tooth
    acts in few of them.
    """
    periods = int(results.static.attrs["mesh_periods"]) if "static" in results.stages else 1
    if periods > 1:
        yield _error_effect(results.static, periods)
        if results.static.sizes.get("planet", 1) > 1:
            yield _share_effect(results.static)
    if "housing" in results.stages:
        yield from _line_effect(results)


def _error_effect(static: Any, periods: int) -> str:
    """Compare the transmission error over the record with that of the usual mesh period, where one rises most."""
    ste = static["ste"].values
    of_periods = np.ptp(ste.reshape(len(ste), periods, -1), axis=2)
    usual, worst = np.median(of_periods, axis=1), of_periods.max(axis=1)
    mesh = int((worst - usual).argmax())
    if worst[mesh] < (1.0 + _SHOWS) * usual[mesh]:
        return f"no mesh period has {percent(_SHOWS)} more transmission error than the others"
    # that of the verdict, with the peaks between positions where they are known
    whole = static.get("ste_peak_to_peak", static["ste"].max("position") - static["ste"].min("position"))
    return f"transmission error {1e6 * float(whole[mesh]):.3g} in place of {1e6 * usual[mesh]:.3g} µm"


def _share_effect(static: Any) -> str:
    """Compare the share of the planet whose load changes most with what it carries else."""
    share = static["load_share"].values
    usual = np.median(share, axis=1)
    planet, position = np.unravel_index(int(np.abs(share - usual[:, None]).argmax()), share.shape)
    if abs(share[planet, position] - usual[planet]) < _SHOWS * usual[planet]:
        return "planets share the load as without it"
    name = f"planet {static['planet'].values[planet]}"
    return f"{name} carries {percent(share[planet, position], 1)} in place of {percent(usual[planet], 1)} of the torque"


def _line_effect(results: Any) -> Iterator[str]:
    """Tell the largest line that equal whole planets have not, at the fastest speed; nothing of unequal planets."""
    gears, housing = planetary_set(results.case), results.housing
    N = gears.n_planets
    if N < 2 or rotational_symmetry(replace(set_deviations(results.case), faults=()), gears) != N:
        return
    fastest = int(np.abs(housing["speed"].values).argmax())
    order, carrier = housing["order"].values, abs(float(housing["carrier_speed"].values[fastest]))
    size = np.hypot(housing["lines_real"].values[fastest], housing["lines_imag"].values[fastest]) * order**2
    new = np.where(np.abs(order / N - np.round(order / N)) > 1e-6, size, 0.0)
    line = int(new.argmax())
    if not new[line] > _HEARD * size.max():
        yield "no line at the sensor is new"
        return
    below = 20.0 * math.log10(size.max() / new[line])
    hertz = order[line] * carrier / (2.0 * math.pi)
    under = "the largest of all" if below < 0.05 else f"{below:.0f} dB below the largest"
    yield f"new lines, at {hertz:,.0f} Hz {under}"


def undrawn_faults(case: Any) -> Iterator[str]:
    """Name the faults of a case that no drawing shows: all but teeth that are missing or broken off at their tips."""
    for key, fault in keyed_faults(case, planetary_set(case)):
        if not isinstance(fault, MissingTooth | BrokenTip):
            yield f"{key} ({type(fault).__name__.lower()})"


def archard_wear(
    case: Any, static: Any, *, hours: float, coefficient: float, mesh_frequency: float, points: int = POINTS
) -> dict[str, list[dict[str, object]]]:
    """Compute what the loaded flanks of all gears lose in some hours by Archard's law, as entries of the case.

    Loads are those of the flanks that the case has: many hours are taken in steps, each with the entries of the one
    before, as `femgear.study.wear` and the command ``femgear wear`` do. The law is that of
    `femgear.stages.wear.worn_flanks`.

    Parameters
    ----------
    case : Case or PairCase
        A set or a pair under a torque.
    static : StaticResult
        Its contact, from `femgear.stages.static.solve_static`.
    hours : float
        Of running [h].
    coefficient : float
        Wear coefficient k [m^2/N]; some 1e-18 to 1e-16 of lubricated steel.
    mesh_frequency : float
        [Hz]
    points : int
        Of every curve.

    Returns
    -------
    dict
        Lists of faults of the kind "wear" by keys as "sun.fault", for `femgear.with_values`.

    Raises
    ------
    CaseError
        E-NO-LOAD: no torque.
    """
    teeth = MeshingTeeth("", static, mesh_frequency)
    return wear_entries(worn_flanks(teeth, hours=hours, coefficient=coefficient, points=points))
