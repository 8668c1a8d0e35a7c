"""Gears that mesh in two stages or more, as idlers do: one body at one place, whose flanks and roots see all its mates.

Two pairs have a gear in common where each has one of the same number of teeth on the same shaft at the same place. A
mate presses the flank towards which its force turns the gear: a gear that passes a torque on is pressed on opposite
flanks, and its roots bend both ways in every turn (Y_M, ISO 6336-3, annex B); one that shares a torque out among two
mates is pressed on the same flank by both. Damages of all mates add (ISO 6336-6): of a flank those of the meshes that
press it, of the root those of all cycles. A turn with loads on both sides has one alternating cycle for two meshes, of
the larger stress.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from femgear.gears.iso6336_life import ToothSpectrum, life_line
from femgear.stages.strength import RatedFlank, Rating
from femgear.stages.tooth_spectra import RatedSpectrum
from femgear.trains.gearbox.case_file import CASING, GearboxCase, teeth_of
from femgear.trains.gearbox.geometry import DISTANCE_TOLERANCE

if TYPE_CHECKING:
    from femgear.case.sections import StrengthSection
    from femgear.trains.gearbox.power import BoxFlow

_HOUR = 3600.0


@dataclass(frozen=True)
class SharedGear:
    """A gear with several mates.

    Parameters
    ----------
    shaft : str
        That it sits on.
    teeth : int
        Their number.
    places : tuple of (str, int)
        Names of its stages, and whether it is gear 1 (0) or gear 2 (1) of each.
    """

    shaft: str
    teeth: int
    places: tuple[tuple[str, int], ...]

    @property
    def name(self) -> str:
        """Name in tables, by its shaft and stages."""
        return f"{self.shaft} gear ({', '.join(stage for stage, _ in self.places)})"

    def pushes(self, flow: BoxFlow) -> tuple[int, ...]:
        """Find for every mate the sign of the torque that its teeth put on the gear, 0 without load."""
        largest = max(abs(torque) for torques in flow.stage_torque.values() for torque in torques.values())
        torques = [flow.stage_torque[stage][self.shaft] for stage, _ in self.places]
        return tuple(int(np.sign(torque)) if abs(torque) > 1e-9 * largest else 0 for torque in torques)


def shared_gears(case: GearboxCase) -> tuple[SharedGear, ...]:
    """Find the gears of pairs with teeth that have more than one mate."""
    listed = list[tuple[str, float, int, list[tuple[str, int]]]]()
    for stage in case.pair:
        teeth = teeth_of(stage)
        if teeth is None or stage.positions is None:
            continue
        for number, (shaft, place) in enumerate(zip(stage.shafts, stage.positions, strict=True)):
            count = (teeth.gear_1, teeth.gear_2)[number].teeth
            if shaft == CASING:
                continue
            for other, position, others_count, places in listed:
                if (other, others_count) == (shaft, count) and abs(position - place) <= DISTANCE_TOLERANCE:
                    places.append((stage.name, number))
                    break
            else:
                listed.append((shaft, place, count, [(stage.name, number)]))
    return tuple(SharedGear(shaft, count, tuple(places)) for shaft, _, count, places in listed if len(places) > 1)


def bent_both_ways(ratings: Mapping[str, Rating], gears: Sequence[SharedGear], flow: BoxFlow) -> dict[str, Rating]:
    """Mark in the ratings of stages the roots of gears whose mates bend them both ways in a load case."""
    ratings = dict(ratings)
    for gear in gears:
        if {*gear.pushes(flow)} >= {1, -1}:
            for stage, number in gear.places:
                if stage in ratings:
                    flanks = list(ratings[stage].flanks)
                    flanks[number] = replace(flanks[number], reversed_bending=True)
                    ratings[stage] = replace(ratings[stage], flanks=tuple(flanks))
    return ratings


@dataclass(frozen=True)
class GearLoads:
    """What all mates of a gear do to it in the load cases; c load cases, m mates.

    Parameters
    ----------
    gear : SharedGear
        The gear.
    flanks : list of list of RatedFlank or None
        Ratings by load case and mate, None without load.
    push : (c, m) array
        Signs as of `SharedGear.pushes`.
    cycles : (c, m) array
        Load cycles an hour of all load cases.
    torque : (c,) array
        On gear 1 of its first stage [N m].
    """

    gear: SharedGear
    flanks: list[list[RatedFlank | None]]
    push: np.ndarray
    cycles: np.ndarray
    torque: np.ndarray


def gear_loads(
    gear: SharedGear,
    flows: Sequence[BoxFlow],
    ratings: Sequence[Mapping[str, Rating]],
    shares: Sequence[float] | np.ndarray,
    torque: np.ndarray,
) -> GearLoads:
    """Collect the loads of a gear from flows and ratings of all load cases.

    These have shares (n_cases,) of the time [1] and a torque (n_cases,) on gear 1 of its first stage [N m].
    """
    push = np.array([gear.pushes(flow) for flow in flows])
    flanks = [
        [
            rating[stage].flanks[number] if stage in rating and sign else None
            for (stage, number), sign in zip(gear.places, signs, strict=True)
        ]
        for rating, signs in zip(ratings, push, strict=True)
    ]
    frequency = np.array([[abs(flow.mesh_frequency[stage]) for stage, _ in gear.places] for flow in flows])
    cycles = _HOUR * frequency * np.asarray(shares)[:, None] / gear.teeth
    return GearLoads(gear, flanks, push, cycles, torque)


def shared_spectra(loads: GearLoads, treatment: str, strength: StrengthSection) -> list[RatedSpectrum]:
    """Collect the spectra of the root and of the flanks of a gear with several mates.

    The first flank is the one that the first load case presses most; without a limit there is no spectrum.
    """
    spectra = list[RatedSpectrum]()
    root = _ratios(loads, "root")
    if root is not None:
        ratio = _alternating(root, loads.push, strength.reversal_factor)
        cycles = np.where(ratio > 0.0, loads.cycles.max(axis=1, keepdims=True), 0.0)
        spectrum = ToothSpectrum(ratio, cycles, life_line(treatment, "root"))
        reversal = strength.reversal_factor if _reversed_by_load_cases(loads.push) else 1.0
        spectra.append(RatedSpectrum(loads.gear.name, "root", spectrum, loads.torque, reversal))
    flank = _ratios(loads, "contact")
    if flank is None:
        return spectra
    line = life_line(treatment, "flank", pitting=strength.pitting == "limited")
    first = loads.push.ravel()[np.flatnonzero(loads.push)[0]]
    for side, words in ((first, ""), (-first, ", back flank")):
        ratio = np.where(loads.push == side, flank, 0.0)
        if ratio.any():
            cycles = np.where(ratio > 0.0, loads.cycles, 0.0)
            loaded = np.where(ratio.any(axis=1), loads.torque, 0.0)
            spectra.append(RatedSpectrum(loads.gear.name + words, "flank", ToothSpectrum(ratio, cycles, line), loaded))
    return spectra


def _ratios(loads: GearLoads, kind: str) -> np.ndarray | None:
    """Stresses over those of long life (c, m), 0 without load; None where a limit is missing or nothing is loaded."""
    ratio = np.zeros(loads.push.shape)
    for case, flanks in enumerate(loads.flanks):
        for mate, flank in enumerate(flanks):
            if flank is not None:
                ratio[case, mate] = 1.0 / getattr(flank, f"{kind}_safety")
    return ratio if np.isfinite(ratio).all() and ratio.any() else None


def _alternating(ratio: np.ndarray, push: np.ndarray, reversal_factor: float) -> np.ndarray:
    """Stress ratios (c, m) of the cycles of the root, largest first and as many as it has in a turn.

    Of a turn with loads on both sides the ratings have Y_M; one of a load case on one side alone has the reversal
    factor where other load cases press the other side.
    """
    kept = np.zeros(ratio.shape)
    reversal = reversal_factor if _reversed_by_load_cases(push) else 1.0
    for case, signs in enumerate(push):
        forwards, backwards = int((signs > 0).sum()), int((signs < 0).sum())
        count = max(forwards, backwards)
        kept[case, :count] = np.sort(ratio[case])[::-1][:count]
        if not (forwards and backwards):
            kept[case] /= reversal
    return kept


def _reversed_by_load_cases(push: np.ndarray) -> bool:
    """Whether load cases press both sides, and one of them a single side."""
    forwards, backwards = (push > 0).any(axis=1), (push < 0).any(axis=1)
    return bool(forwards.any() and backwards.any() and (forwards != backwards).any())
