"""In which stage of a gearbox a mode lives, and how its planets move: all alike, as a wave, or against one another.

With equal planets at equal angles the classes of one planetary set survive where several are joined on one axis:
rotational and translational modes reach over all of them, a planet mode stays in one and has the frequency that it has
there alone (D. R. Kiracofe and R. G. Parker, J. Vib. Acoust. 129, 2007, 1-16).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femgear.system.mode_kinds import SetMotions, class_energies, named_kinds
from femgear.trains.gearbox.carrier import pin_axes
from femgear.trains.gearbox.case_file import CASING, BoxPlanetarySection
from femgear.trains.gearbox.model import GearboxModel, StageModel, member_of_stations

_ROTATIONAL, _TRANSLATIONAL = (2, 5), (0, 1, 3, 4)
"""Motions of bodies on the axis by class: along it and about it; across it and tilts."""


@dataclass(frozen=True)
class StageMotions:
    """What stages and their planets have in the modes of a gearbox.

    Parameters
    ----------
    energy : (S, m) array
        Share of every stage in the kinetic energy: its planets, and the shafts of its gears; of a shaft with gears of
        several stages an equal part.
    kinds : tuple of str
        ``rigid``; ``rotational``, ``translational`` or ``planet`` where 99 % of the kinetic energy of the whole gearbox
        are of that class: shafts turn or move along their axes, and planets move alike; shafts move across and tilt,
        and planets as a wave around the axis; planets alone move, in no such pattern. Else ``mixed``; all empty
        without a planetary stage.
    """

    energy: np.ndarray
    kinds: tuple[str, ...]


def stage_motions(model: GearboxModel, motion: np.ndarray, moved: np.ndarray, frequency: np.ndarray) -> StageMotions:
    """Find the shares of the stages in modes, and the kinds of these by their planets.

    Parameters
    ----------
    model : GearboxModel
    motion, moved : (6n, m) arrays
        Motions of all stations in the modes, and their momenta by unit of time [kg^-1/2], [kg^1/2].
    frequency : (m,) array
        Zero of rigid modes [Hz].
    """
    owner = np.array(member_of_stations(model))
    energy = (motion * moved).reshape(len(owner), 6, -1)
    total = np.maximum(energy.sum(axis=(0, 1)), np.finfo(float).tiny)
    shafts = {stage.name: _shafts(stage) for stage in model.stages}
    shared = [name for names in shafts.values() for name in names]
    share = np.zeros((len(model.stages), motion.shape[1]))
    for row, stage in zip(share, model.stages, strict=True):
        row += energy[list(stage.planets)].sum(axis=(0, 1))
        for name in shafts[stage.name]:
            row += energy[owner == name].sum(axis=(0, 1)) / shared.count(name)
    sets = [stage for stage in model.stages if stage.planets]
    if not sets:
        return StageMotions(share / total, ("",) * motion.shape[1])
    on_axis = energy[np.isin(owner, [shaft.name for shaft in model.case.shaft])].sum(axis=0)
    classes = np.zeros((3, motion.shape[1]))
    classes[0], classes[1] = on_axis[list(_ROTATIONAL)].sum(axis=0), on_axis[list(_TRANSLATIONAL)].sum(axis=0)
    classes += np.sum([class_energies(_planet_motions(model, stage, motion)) for stage in sets], axis=0)
    return StageMotions(share / total, named_kinds(classes / total, frequency))


def _shafts(stage: StageModel) -> set[str]:
    """Names of the shafts of a stage."""
    section = stage.section
    planetary = isinstance(section, BoxPlanetarySection)
    names = (section.sun, section.carrier, section.ring) if planetary else section.shafts
    return {*names} - {CASING}


def _planet_motions(model: GearboxModel, stage: StageModel, motion: np.ndarray) -> SetMotions:
    """Motions of the planets of a stage along their radial and tangential axes and z, and about these."""
    of_stations, mass = motion.reshape(-1, 6, motion.shape[1]), np.diag(model.assembly.mass).reshape(-1, 6)
    local = [
        np.kron(np.eye(2), pin_axes(psi)) @ of_stations[planet]
        for planet, psi in zip(stage.planets, stage.angles, strict=True)
    ]
    central = np.zeros((0, 3, motion.shape[1]))
    planets = list(stage.planets)
    return SetMotions(central, np.zeros((0, 3)), np.array(local), mass[planets], np.asarray(stage.angles))
