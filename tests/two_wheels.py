"""Two wheels on held axes and one mesh, for tests of integration in time: one elastic coordinate, one free rotation."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from femgear.solvers.time.spun_system import BACK, DRIVE, ContactGroup, SpunSystem, spun_system
from femgear.system.force_laws import GearMeshes
from femgear.system.fourier import FourierSeries, constant
from femgear.system.system import MechanicalSystem
from femgear.trains.gearbox.excitation import pair_count_wave

STIFFNESS, TEETH, RADII, INERTIAS = 2e8, 20, (0.05, 0.1), (0.2, 0.9)
"""Mean stiffness of the mesh [N/m], teeth of the first wheel, base radii [m], inertias [kg m^2]."""
CONTACT_RATIO, LOW_SHARE = 1.5, 0.8


@dataclass(frozen=True)
class TwoWheels:
    """The wheels as ``spun``, harmonics of their mesh stiffness ``wave`` [N/m], and ``natural`` frequency [rad/s]."""

    spun: SpunSystem
    wave: np.ndarray
    natural: float


def two_wheels(
    *,
    harmonics: int = 0,
    damping: float = 0.0,
    backlash: float = math.inf,
    gap: np.ndarray | float = 0.0,
    wave: np.ndarray | None = None,
) -> TwoWheels:
    """Make both wheels; ``gap`` are harmonics of the deflection at which the drive flanks touch [m]."""
    column, M = np.array(RADII), np.diag(INERTIAS)
    mass = 1.0 / float(column @ np.linalg.solve(M, column))
    natural = math.sqrt(STIFFNESS / mass)
    share = CONTACT_RATIO - math.floor(CONTACT_RATIO)
    high = STIFFNESS / (LOW_SHARE + (1.0 - LOW_SHARE) * share)
    pairs = pair_count_wave(-0.5 * CONTACT_RATIO, 0.5 * CONTACT_RATIO, harmonics)
    ahead = np.exp(1j * np.pi * np.arange(1, harmonics + 1))
    wave = wave if wave is not None else np.append(STIFFNESS, (1.0 - LOW_SHARE) * high * CONTACT_RATIO * pairs * ahead)
    C = 2.0 * damping * natural * mass * np.outer(column, column)
    W = np.column_stack([column, -column])
    system = MechanicalSystem(M, C, np.zeros((2, 2)), W, np.zeros(2), ("a", "b"))
    series, deflection = FourierSeries(wave[None]), FourierSeries(np.atleast_2d(gap))
    groups = [ContactGroup(GearMeshes(np.array([0]), series, deflection), DRIVE, np.array([0]))]
    if math.isfinite(backlash):
        behind = GearMeshes(np.array([1]), series, constant([backlash]))
        groups.append(ContactGroup(behind, BACK, np.array([0])))
    spun = spun_system(system, groups, ("a-b",), base_ratio=[TEETH], shaft=np.array([1.0, 0.0]))
    return TwoWheels(spun, wave, natural)
