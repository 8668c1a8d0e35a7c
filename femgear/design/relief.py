"""Transmission error over torque for several reliefs (Harris map), and the relief for one torque.

S. L. Harris, "Dynamic loads on the teeth of spur gears", Proc. IMechE 172 (1958): a relief takes off the tips
what the teeth bend under one torque, and the transmission error is then nearly constant under that torque.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from femgear.contact.assembly import mesh_pairs
from femgear.contact.mirrored import walk_either_flank
from femgear.contact.supports import RIGID, Supports
from femgear.errors import CaseError
from femgear.gears.deviations import SetDeviations, common_period, no_deviations
from femgear.gears.modifications import FlankForm, TipRelief
from femgear.threads import one_blas_thread

if TYPE_CHECKING:
    from femgear.contact.assembly import Bodies
    from femgear.gears import PlanetarySet

LARGEST_LENGTH = 1.3
"""Longest relief in lengths of two-pair contact; longer ones reach the pitch point of common sets."""


@dataclass(frozen=True, eq=False)
class HarrisMap:
    """Transmission error over torque.

    Parameters
    ----------
    torques : (T,) array
        Torque on the sun [N m].
    peak_to_peak : (variants, 2, T) array
        Of the transmission error of the sun-planet and the planet-ring meshes, the largest of each kind [m].
    overall : (variants, T) array
        Of the transmission error from sun to ring [m].
    residual : float
        Largest residual of all contact problems.
    """

    torques: np.ndarray
    peak_to_peak: np.ndarray
    overall: np.ndarray
    residual: float


@dataclass(frozen=True, eq=False)
class ReliefGrid:
    """Transmission error peak to peak of the sun-planet meshes over two parameters of the tip relief.

    Parameters
    ----------
    amounts : (A,) array
        [m]
    lengths : (L,) array
        In lengths of two-pair contact, see `relief_starts`.
    torques : (T,) array
        On the sun [N m].
    peak_to_peak : (T, A, L) array
        [m]
    unmodified : (T,) array
        Without the relief [m].
    """

    amounts: np.ndarray
    lengths: np.ndarray
    torques: np.ndarray
    peak_to_peak: np.ndarray
    unmodified: np.ndarray

    @property
    def ratio(self) -> np.ndarray:
        """Peak to peak over that without relief, (T, A, L)."""
        return self.peak_to_peak / self.unmodified[:, None, None]


def relief_starts(planetary_set: PlanetarySet, *, length: float = 1.0) -> tuple[float, float]:
    """Roll lengths on sun and planet where a tip relief of their mesh starts [m].

    Parameters
    ----------
    planetary_set : PlanetarySet
    length : float
        Along the path of contact, in lengths ``(epsilon - 1) p_b`` of two-pair contact at either end: 1
        starts at the ends of single-pair contact.

    Returns
    -------
    sun, planet : float

    Raises
    ------
    CaseError
        E-RANGE: a length outside 0.05 to 1.3.
    """
    if not 0.05 <= length <= LARGEST_LENGTH:
        raise CaseError(
            f"a relief of {length} lengths of two-pair contact is not plausible",
            code="E-RANGE",
            value=length,
            limit=f"0.05 to {LARGEST_LENGTH}",
        )
    pair = mesh_pairs(planetary_set)[0]
    begin, end = pair.path
    along = length * (end - begin - planetary_set.sun.base_pitch)
    return float(pair.pitch_roll_1 + end - along), float(pair.pitch_roll_2 - begin - along)


def with_tip_relief(
    deviations: SetDeviations | None,
    planetary_set: PlanetarySet,
    *,
    amount: float,
    length: float = 1.0,
    power: float = 1.0,
    back: bool = False,
) -> SetDeviations:
    """Deviations with one more tip relief, on the sun and on the flanks of the planets that touch it.

    Parameters
    ----------
    deviations : SetDeviations, optional
        None for ideal gears.
    planetary_set : PlanetarySet
    amount : float
        At the tips of sun and planet [m].
    length : float
        See `relief_starts`.
    power : float
        1 linear, 2 parabolic.
    back : bool
        The flanks of the planets that touch the sun under a negative torque.
    """
    found = no_deviations(planetary_set) if deviations is None else deviations
    if amount == 0:
        return found
    sun, planet = relief_starts(planetary_set, length=length)
    side = "planet_ring_side" if back else "planet_sun_side"
    new = {"sun": TipRelief(amount, sun, power=power), side: TipRelief(amount, planet, power=power)}
    forms = {n: FlankForm((*getattr(found, n).modifications, relief)) for n, relief in new.items()}
    return replace(found, **forms)


@one_blas_thread()
def harris_map(
    planetary_set: PlanetarySet,
    bodies: Bodies,
    *,
    torques,
    deviations: Sequence[SetDeviations | None],
    positions: int = 32,
    contact: str = "profile",
    supports: Supports = RIGID,
    progress: Callable[[int, int], None] | None = None,
) -> HarrisMap:
    """Transmission error peak to peak over torque for a list of deviations.

    Parameters
    ----------
    planetary_set : PlanetarySet
    bodies : Bodies
        Flank compliances; they serve all mesh cycles.
    torques : sequence of float
        On the sun [N m], not zero.
    deviations : sequence of SetDeviations or None
        One a curve; the record spans the common period of each.
    positions : int
        In one mesh period.
    contact, supports
        See `contact.cycle.walk_mesh_cycle`.
    progress : callable, optional
        Called with (mesh cycles done, mesh cycles).

    Returns
    -------
    HarrisMap

    Raises
    ------
    CaseError
        E-TORQUE: a torque of zero, or none.
    ContactError
    """
    torques = np.array(torques, float)
    if not len(torques) or not (np.isfinite(torques).all() and torques.all()):
        raise CaseError("every torque of the map must differ from zero", code="E-TORQUE", value=torques)
    N = planetary_set.n_planets
    peaks = np.zeros((len(deviations), 2, len(torques)))
    overall, residual = np.zeros((len(deviations), len(torques))), 0.0
    for v, variant in enumerate(deviations):
        periods = 1 if variant is None else common_period(variant, planetary_set)[0]
        for t, torque in enumerate(torques):
            cycle = walk_either_flank(
                planetary_set,
                bodies,
                sun_torque=float(torque),
                positions=positions,
                contact=contact,
                deviations=variant,
                supports=supports,
                periods=periods,
            )
            peak = np.ptp(cycle.deflection, axis=1)
            peaks[v, :, t] = peak[:N].max(), peak[N:].max()
            overall[v, t] = np.ptp(cycle.sun_arc)
            residual = max(residual, float(cycle.residual.max()))
            if progress is not None:
                progress(v * len(torques) + t + 1, peaks[:, 0].size)
    return HarrisMap(torques, peaks, overall, residual)


@one_blas_thread()
def relief_grid(
    planetary_set: PlanetarySet,
    bodies: Bodies,
    *,
    amounts,
    lengths,
    torques,
    deviations: SetDeviations | None = None,
    power: float = 1.0,
    positions: int = 32,
    contact: str = "profile",
    supports: Supports = RIGID,
    progress: Callable[[int, int], None] | None = None,
) -> ReliefGrid:
    """Transmission error of the sun-planet meshes over amount and length of their tip relief.

    Parameters
    ----------
    amounts : (A,) sequence
        [m]
    lengths : (L,) sequence
        In lengths of two-pair contact.
    torques : (T,) sequence
        On the sun [N m], of one sign.
    planetary_set, bodies, deviations, power, positions, contact, supports, progress
        As for `with_tip_relief` and `harris_map`.

    Returns
    -------
    ReliefGrid
    """
    amounts, lengths, torques = (np.array(a, float) for a in (amounts, lengths, torques))
    back = loads_back(torques)
    variants = [deviations]
    variants += [
        with_tip_relief(deviations, planetary_set, amount=a, length=length, power=power, back=back)
        for a in amounts
        for length in lengths
    ]
    found = harris_map(
        planetary_set,
        bodies,
        torques=torques,
        deviations=variants,
        positions=positions,
        contact=contact,
        supports=supports,
        progress=progress,
    ).peak_to_peak[:, 0]
    peaks = found[1:].T.reshape(len(torques), len(amounts), len(lengths))
    return ReliefGrid(amounts, lengths, torques, peaks, found[0])


def loads_back(torques: np.ndarray) -> bool:
    """Whether torques are negative; E-TORQUE (CaseError) where their signs differ."""
    if (torques > 0).any() and (torques < 0).any():
        raise CaseError("torques of both signs load different flanks", code="E-TORQUE", value=torques)
    return bool((torques < 0).any())
