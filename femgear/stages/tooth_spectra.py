"""Spectra of roots and flanks from the ratings of load cases, and what files hold of their lives (ISO 6336-6).

Cycles count by the mesh frequency, which is the speed relative to the carrier: a tooth of a planet meets sun and ring
once each in ``z_p`` meshes, one of the sun or the ring meets all planets. A root takes damage in all load cases,
whichever flank they load: a crack at either side breaks the tooth. Its bending alternates with Y_M = 0.7 of planets
(ISO 6336-3, annex B), and with ``strength.reversal_factor`` of other gears whose load cases load both flanks. A flank
takes damage by the load cases that press it; under a negative torque a planet meets the ring with the flank that met
the sun.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.case.gear_set import planetary_set
from femgear.case.sections import gear_material
from femgear.gears.iso6336_life import ToothSpectrum, equivalent_torque, life_line
from femgear.gears.pair import GearSet
from femgear.stages.strength import RatedFlank, Rating

if TYPE_CHECKING:
    from femgear.case.sections import StrengthSection

KINDS = {"root": "S_F", "flank": "S_H"}
"""Kinds of spectra, with the symbols of their safeties."""
_HOUR = 3600.0
_WORDS = {
    "life": ("", "h", "life of the {} over all load cases until its damage is 1; infinite without any"),
    "damage": ("", "1", "damage of the {} over the life that the case asks for; NaN without"),
    "spectrum_safety": ("", "1", "factor on all stresses of the {} with which that damage is 1; NaN without a life"),
    "equivalent_torque": ("", "N m", "constant torque on the sun or gear 1 with the same damage of the {}"),
    "damage_share": (
        "load_case ",
        "1",
        "share of the load case in the damage of the {}, equal of those it fails in at once",
    ),
    "stress_ratio": ("load_case ", "1", "stress of the {} over its strength for long life; 0 where it has no load"),
    "load_cycles": ("load_case ", "1/h", "load cycles of the {} in an hour of all load cases"),
}
"""Variables of roots and flanks by the ends of their names: dimension before that of the kind, unit and text."""


@dataclass(frozen=True)
class RatedSpectrum:
    """Spectrum of one root or flank.

    Parameters
    ----------
    name : str
        ``"planet, sun side"``, of the flank that a reversed load case loads ``"sun, back flank"``.
    kind : str
        ``"root"`` or ``"flank"``.
    spectrum : ToothSpectrum
        Stresses and load cycles.
    torque : (c,) array
        Torques on the sun or gear 1 of the load cases that load it [N m], zero of others.
    reversal_factor : float
        Y_M of a root that load cases of both directions bend both ways; 1 of others.
    """

    name: str
    kind: str
    spectrum: ToothSpectrum
    torque: np.ndarray
    reversal_factor: float = 1.0

    @property
    def bends_back(self) -> np.ndarray:
        """Load cases (c,) that bend a root with a reversal factor against the first one."""
        sides = np.sign(self.torque)
        return (self.reversal_factor != 1.0) & (sides == -next((side for side in sides if side), 0.0)) & (sides != 0.0)

    @property
    def equivalent_torque(self) -> float:
        """Constant torque on the sun or gear 1 with the same damage over its load cycles [N m] (ISO 6336-6)."""
        exponent = self.spectrum.line.slope * (1.0 if self.kind == "root" else 0.5)
        return equivalent_torque(self.torque, self.spectrum.all_cycles, exponent)


@dataclass(frozen=True)
class RatedLoad:
    """Rating of the teeth of a case in one load case.

    Parameters
    ----------
    rating : Rating or None
        None of a load case that loads no teeth.
    torque : float
        On the sun or gear 1 [N m].
    mesh_frequency : float
        [Hz]
    share : float
        Of the running time.
    """

    rating: Rating | None
    torque: float
    mesh_frequency: float
    share: float


def rated_spectra(
    case: Any, loads: Sequence[RatedLoad], strength: StrengthSection | None = None
) -> tuple[RatedSpectrum, ...]:
    """Collect the spectra of all roots, then of all flanks, whose gears have a limit and a treatment.

    Parameters
    ----------
    case : case of gears
        With the materials.
    loads : sequence of RatedLoad
        Load cases.
    strength : StrengthSection, optional
        In place of the case's.
    """
    given, gears = case.strength if strength is None else strength, planetary_set(case)
    first = next((load.rating for load in loads if load.rating is not None), None)
    if first is None:
        return ()
    rated = [(number, flank) for number, flank in enumerate(first.flanks) if gear_material(case, flank.gear).treatment]
    roots = [_root(case, gears, loads, place, flank, given) for place, flank in rated if flank.root_limit]
    flanks = _flanks(case, gears, loads, [(place, flank) for place, flank in rated if flank.contact_limit], given)
    return (*(root for root in roots if np.isfinite(root.spectrum.ratio).all()), *flanks)


def _root(
    case: Any, gears: GearSet, loads: Sequence[RatedLoad], place: int, flank: RatedFlank, strength: StrengthSection
) -> RatedSpectrum:
    """Spectrum of the root below a flank: load cases of both directions; one without load has no load cycles."""
    torque = np.array([load.torque if load.rating is not None else 0.0 for load in loads])
    ratio = np.array([_ratio(load, place, "root_safety") for load in loads])
    alternating = (torque > 0.0).any() and (torque < 0.0).any() and not flank.reversed_bending
    reversal = strength.reversal_factor if alternating else 1.0
    ratio = ratio / reversal
    line = life_line(str(gear_material(case, flank.gear).treatment), "root")
    cycles = np.where(torque != 0.0, _cycles(gears, case, loads, flank), 0.0)
    return RatedSpectrum(flank.name, "root", ToothSpectrum(ratio, cycles, line), torque, reversal)


def _flanks(
    case: Any,
    gears: GearSet,
    loads: Sequence[RatedLoad],
    rated: Sequence[tuple[int, RatedFlank]],
    strength: StrengthSection,
) -> Iterator[RatedSpectrum]:
    """Spectra of the flanks on either side of the teeth, as far as load cases press them."""
    signs = [int(np.sign(load.torque)) if load.rating is not None else 0 for load in loads]
    forward = next((sign for sign in signs if sign), 1)
    torque = np.array([load.torque for load in loads])
    for side in (forward, -forward):
        for place, flank in rated:
            name = flank.name
            # with the other torque a planet meets its mates with the flanks of each other
            other = next((n for n, mate in rated if mate.gear == flank.gear and mate.kind != flank.kind), None)
            pressing = {side: place} if other is None else {forward: place, -forward: other}
            if other is not None and side != forward:
                continue
            if side != forward:
                name = f"{name}, back flank"
            ratio = np.array(
                [
                    _ratio(load, pressing[sign], "contact_safety") if sign in pressing else 0.0
                    for load, sign in zip(loads, signs, strict=True)
                ]
            )
            if not np.isfinite(ratio).all() or not ratio.any():
                continue
            line = life_line(
                str(gear_material(case, flank.gear).treatment), "flank", pitting=strength.pitting == "limited"
            )
            cycles = np.where(ratio > 0.0, _cycles(gears, case, loads, flank), 0.0)
            loaded = np.where(ratio > 0.0, torque, 0.0)
            yield RatedSpectrum(name, "flank", ToothSpectrum(ratio, cycles, line), loaded)


def _ratio(load: RatedLoad, place: int, safety: str) -> float:
    """Stress over the strength for long life of a flank in a load case; NaN outside the method, 0 without load."""
    if load.rating is None or load.torque == 0.0:
        return 0.0
    return 1.0 / float(getattr(load.rating.flanks[place], safety))


def _cycles(gears: GearSet, case: Any, loads: Sequence[RatedLoad], flank: RatedFlank) -> np.ndarray:
    """Load cycles (c,) of a flank an hour, by the share of every load case."""
    number = case.gear_names.index(flank.gear)
    meshes = 1 if gears.repeated[number] else gears.n_planets
    turns = np.array([abs(load.mesh_frequency) * load.share for load in loads]) / gears.gears[number].teeth
    return _HOUR * meshes * turns


def tooth_life_variables(spectra: Sequence[RatedSpectrum], required: float | None) -> dict[str, tuple]:
    """Collect the variables of a file on the lives of roots and flanks; ``required`` is the life asked for [h]."""
    variables: dict[str, tuple] = {}
    for kind in KINDS:
        of_kind = [rated for rated in spectra if rated.kind == kind]
        hours = np.array([rated.spectrum.hours for rated in of_kind])
        over = math.nan if required is None else required
        values = {
            "life": hours,
            "damage": np.divide(over, hours, out=np.full(len(hours), over * math.inf), where=hours > 0.0),
            "spectrum_safety": [rated.spectrum.safety(over) if required else math.nan for rated in of_kind],
            "equivalent_torque": [rated.equivalent_torque for rated in of_kind],
            "damage_share": _over_load_cases(of_kind, "damage_share"),
            "stress_ratio": _over_load_cases(of_kind, "largest_ratio"),
            "load_cycles": _over_load_cases(of_kind, "all_cycles"),
        }
        if of_kind:
            for name, (before, unit, text) in _WORDS.items():
                variables[f"{kind}_{name}"] = (f"{before}{kind}", values[name], unit, text.format(kind))
    if roots := [rated for rated in spectra if rated.kind == "root"]:
        factor = [rated.reversal_factor for rated in roots]
        back = np.array([rated.bends_back for rated in roots]).T.astype(int)
        words = "Y_M of roots that load cases bend both ways; 1 of others"
        variables["root_reversal_factor"] = "root", factor, "1", words
        text = "1 where the load case bends such a root against the first one"
        variables["root_reversed"] = "load_case root", back, "1", text
    return variables


def _over_load_cases(spectra: Sequence[RatedSpectrum], name: str) -> np.ndarray:
    """Values (c, s) of spectra over their load cases."""
    return np.array([getattr(rated.spectrum, name) for rated in spectra]).T


def tooth_life_coordinates(spectra: Sequence[RatedSpectrum]) -> dict[str, tuple]:
    """Collect the names of roots and flanks."""
    names = {kind: [rated.name for rated in spectra if rated.kind == kind] for kind in KINDS}
    return {kind: ((kind,), named, "1", f"{kind} of a tooth") for kind, named in names.items() if named}
