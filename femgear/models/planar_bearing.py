"""A bearing between carrier and ring, or carrier and housing, added to a lumped planetary set."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from femgear.errors import CaseError
from femgear.models.planar import CENTRAL, PlanarSet, free_motions
from femgear.solvers.elements import GearMeshes, RadialBearings
from femgear.solvers.modal import solve_modes
from femgear.solvers.nonlinear import NonlinearSystem, modal_damping

# natural frequencies closer than this, relative to the frequency, count as one
_SAME = 1e-3


@dataclass(frozen=True)
class MemberBearing:
    """A radial bearing between two central members, or between one and the housing.

    Parameters
    ----------
    stiffness : float
        [N/m]
    clearance : float or None
        Radial, from the centred position [m]; None leaves the columns without a bearing.
    inner, outer : str
        ``"carrier"``, ``"ring"`` or ``"sun"``; ``outer`` also ``"housing"``.
    """

    stiffness: float
    clearance: float | None = 0.0
    inner: str = "carrier"
    outer: str = "housing"

    def __post_init__(self):
        if self.inner not in CENTRAL or self.outer not in (*CENTRAL, "housing") or self.inner == self.outer:
            raise CaseError(
                f"a bearing between {self.inner!r} and {self.outer!r}", code="E-BEARING",
                limit="two of carrier, ring, sun, or one of them and the housing",
            )  # fmt: skip


def with_bearing(problem: NonlinearSystem, data: PlanarSet, bearing: MemberBearing) -> NonlinearSystem:
    """The set with one more bearing, on the two last columns: x and y of the inner less the outer member.

    Parameters
    ----------
    problem : NonlinearSystem
        From `femgear.models.planar_problem.planar_problem`.
    data : PlanarSet
    bearing : MemberBearing

    Returns
    -------
    NonlinearSystem
        Its damping is that of ``problem``; see `damping_matrix` for that of the closed bearing.
    """
    columns = np.zeros((3 * (data.n_planets + 3), 2))
    for name, sign in ((bearing.inner, 1.0), (bearing.outer, -1.0)):
        if name in CENTRAL:
            first = 3 * CENTRAL.index(name)
            columns[[first, first + 1], [0, 1]] = sign
    count = problem.system.W.shape[1]
    W = np.hstack([problem.system.W, free_motions(data).T @ columns])
    elements = problem.elements
    if bearing.clearance is not None:
        place = np.array([[count, count + 1]])
        elements += (RadialBearings(place, bearing.stiffness, bearing.clearance),)
    return replace(problem, system=replace(problem.system, W=W), elements=elements)


def closed_springs(
    problem: NonlinearSystem, data: PlanarSet, bearing: MemberBearing | None = None
) -> np.ndarray:
    """Springs (n_columns,) [N/m] near which the set works: bearings closed, back flanks open.

    The elements' own reference counts back flanks as closed, far from where the set works.

    Parameters
    ----------
    problem : NonlinearSystem
    data : PlanarSet
    bearing : MemberBearing, optional
        On the last two columns; closed whatever its clearance.
    """
    reference = open_back_flanks(problem, data.n_planets)
    if bearing is not None:
        reference[-2:] = bearing.stiffness
    return reference


def open_back_flanks(problem: NonlinearSystem, n_planets: int) -> np.ndarray:
    """Reference springs (n_columns,) [N/m] of the elements, without those of the columns of back flanks."""
    reference, meshes = problem.reference, 2 * n_planets
    for element in problem.elements[1:]:
        if isinstance(element, GearMeshes) and element.columns[0, 0] == meshes:
            reference[meshes : 2 * meshes] = 0.0
    return reference


def damping_matrix(
    problem: NonlinearSystem, springs: np.ndarray, ratios: float | Sequence[float]
) -> np.ndarray:
    """Viscous damping ``C`` (n, n) of modal ratios, for the modes at standstill with given springs.

    Parameters
    ----------
    problem : NonlinearSystem
        At standstill.
    springs : (n_columns,) array
        Such as `closed_springs` [N/m].
    ratios : float or sequence of float
        Of all modes; a sequence gives one a natural frequency (a pair of modes has one), ascending, the last
        one for the rest. Motions at frequency zero have none and do not count.
    """
    bare = replace(problem.system, C=np.zeros_like(problem.system.C))
    frequency = solve_modes(bare, springs).frequency
    return modal_damping(bare, springs, mode_ratios(frequency, ratios))


def mode_ratios(frequency: np.ndarray, ratios: float | Sequence[float]) -> np.ndarray:
    """Damping ratio (m,) of every mode from one a natural frequency; see `damping_matrix`."""
    given = np.atleast_1d(np.asarray(ratios, float))
    moving = frequency > 0.0
    steps = np.diff(frequency[moving], prepend=0.0) > _SAME * frequency[moving]
    number = np.clip(np.cumsum(steps) - 1, 0, len(given) - 1)
    out = np.zeros(len(frequency))
    out[moving] = given[number]
    return out
