"""What a lumped planetary set does in a periodic solution: orbits, forces, contact of its flanks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from femgear.models.planar import CENTRAL, PlanarSet, column_groups, free_motions, pin_directions
from femgear.models.planar_bearing import MemberBearing, closed_springs
from femgear.solvers.branches import Branch, frequency_response_curve
from femgear.solvers.continuation import StepOptions
from femgear.solvers.elements import GearMeshes
from femgear.solvers.harmonic_balance import displacements
from femgear.solvers.hill import FloquetVerdict, floquet_verdicts
from femgear.solvers.lines import line_tail
from femgear.solvers.nonlinear import NonlinearSystem, element_forces
from femgear.solvers.periodic import PeriodicSolution
from femgear.solvers.receptance import Reduction, reduce_problem

TAIL_LIMIT = 0.05
"""Share of the amplitude in the upper half of the lines beyond which what they add up to is wrong."""
# limit points closer than this, relative to the frequency, are one: corners of contact split them
_SAME_FOLD = 2e-3
# deflection [m] that counts as much as the whole range of frequencies along a branch
_SCALE = 2e-3
# instants of a period; with two base frequencies of either phase
_SAMPLES = 2880
_GRID = (256, 48)
# relative errors of the monodromy matrices, and solutions judged together
_COARSE, _FINE, _BATCH = 1e-3, 1e-6, 32
# fluctuation of a force, relative to its mean, below which there is none: residual of the equations
_STILL = 1e-6
# what a curve holds of every point
_ALONG = ("points", "parameter", "tangent", "iterations", "error")


@dataclass(frozen=True, eq=False)
class PlanarModel:
    """A lumped set ready to be solved, and where its elements act.

    Parameters
    ----------
    data : PlanarSet
    problem : NonlinearSystem
    back_flanks : bool
        The back flanks have columns of their own.
    planet_clearance : bool
        The planet bearings are elements.
    bearing : MemberBearing, optional
        On the last two columns.
    """

    data: PlanarSet
    problem: NonlinearSystem
    back_flanks: bool = False
    planet_clearance: bool = False
    bearing: MemberBearing | None = None

    @cached_property
    def springs(self) -> np.ndarray:
        """Springs (n_columns,) [N/m] near which the set works."""
        return closed_springs(self.problem, self.data, self.bearing)

    @cached_property
    def reduction(self) -> Reduction:
        """Reduction with these springs."""
        return reduce_problem(self.problem, reference=self.springs)

    @property
    def groups(self) -> dict[str, np.ndarray]:
        """Places of the columns, see `column_groups`; the carrier bearing as ``carrier bearing``."""
        bearings = ("planets",) if self.planet_clearance else ()
        groups = column_groups(self.data, back_flanks=self.back_flanks, bearings=bearings)
        if self.bearing is not None:
            count = self.problem.system.W.shape[1]
            groups["carrier bearing"] = np.array([[count - 2, count - 1]])
        return groups


@dataclass(frozen=True)
class MotionLines:
    """Lines of a solution, and the share of the time in which flanks touch.

    Parameters
    ----------
    member : (3, 2, L) complex array
        x and y of carrier, ring and sun in the carrier frame [m].
    mesh_force, back_force : (2N, L) complex arrays
        Along the line of action of the drive flanks, and of the back flanks [N].
    planet_bearing : (N, 2, L) complex array
        Force of the pin on the planet, radially outwards and tangentially [N].
    carrier_bearing : (2, L) complex array
        x and y of the force of the carrier bearing on the carrier [N]; zero without one.
    drive_contact, back_contact : (2N,) arrays
    motion : float
        Farthest that the centre of carrier, ring or sun moves from its place [m].
    approach : float
        Largest deflection of a mesh [m].
    force_tail : float
        Share of the fluctuating force in the upper half of the lines, of the kind of mesh, sun-planet or
        planet-ring with both flanks, that has more of it; see `femgear.solvers.lines.line_tail`.
    """

    member: np.ndarray
    mesh_force: np.ndarray
    back_force: np.ndarray
    planet_bearing: np.ndarray
    carrier_bearing: np.ndarray
    drive_contact: np.ndarray
    back_contact: np.ndarray
    motion: float
    approach: float
    force_tail: float


def weight_curve(
    problem: NonlinearSystem,
    limits: tuple[float, float],
    *,
    reduction: Reduction,
    harmonics: int = 9,
    stability: bool = False,
    radius: bool = False,
    largest: float = 0.1,
    max_points: int = 600,
) -> Branch:
    """Periodic responses over the frequency of the weight in the carrier frame.

    Parameters
    ----------
    problem : NonlinearSystem
        With the weight as the only base frequency.
    limits : (first, last)
        [Hz]
    reduction : Reduction
        With back flanks open, as `PlanarModel.reduction`.
    harmonics, stability, radius
        As for `frequency_response_curve`.
    largest : float
        Longest step, see `StepOptions`.
    max_points : int
    """
    return frequency_response_curve(
        problem,
        (2.0 * np.pi * limits[0], 2.0 * np.pi * limits[1]),
        harmonics=harmonics,
        stability=stability,
        radius=radius,
        tolerance=1e-5,
        samples=max(1024, 128 * harmonics),
        reduction=reduction,
        scale=_SCALE,
        options=StepOptions(largest=largest, max_points=max_points),
    )


def judged_branch(
    problem: NonlinearSystem, branch: Branch, *, progress: Callable[[int, int], None] | None = None
) -> Branch:
    """A branch with Floquet verdicts: coarse first, fine where that is open or near the unit circle.

    Parameters
    ----------
    problem : NonlinearSystem
    branch : Branch
        Followed without stability.
    progress : callable, optional
        Called with (done, total).
    """
    solutions = branch.solutions
    found = []
    for first in range(0, len(solutions), _BATCH):
        part = solutions[first : first + _BATCH]
        verdicts = list(floquet_verdicts(problem, part, tolerance=_COARSE))
        close = [i for i, verdict in enumerate(verdicts) if _open(verdict)]
        fine = floquet_verdicts(problem, [part[i] for i in close], tolerance=_FINE) if close else ()
        for i, verdict in zip(close, fine):
            verdicts[i] = verdict
        found += verdicts
        if progress is not None:
            progress(len(found), len(solutions))
    judged = tuple(replace(solution, verdict=verdict) for solution, verdict in zip(solutions, found))
    return replace(branch, solutions=judged, stability=True)


def _open(verdict: FloquetVerdict) -> bool:
    if verdict.stable is None or not len(verdict.multipliers):
        return verdict.stable is None
    return abs(abs(verdict.multipliers[0]) - 1.0) < 100.0 * verdict.error + _COARSE


def member_rows(data: PlanarSet, member: str) -> np.ndarray:
    """Rows (2, n) that give x and y of the carrier, ring or sun; zero where its axis is held."""
    first = 3 * CENTRAL.index(member)
    return free_motions(data)[first : first + 2]


def motion_lines(model: PlanarModel, solution: PeriodicSolution) -> MotionLines:
    """Lines of all that is looked at in a solution."""
    data, groups, N = model.data, model.groups, model.data.n_planets
    pins = (free_motions(data).T @ pin_directions(data).reshape(-1, 2 * N)).T
    rows = np.vstack([*(member_rows(data, name) for name in CENTRAL), pins])
    x = displacements(model.problem, solution, rows, reduction=model.reduction)
    if model.planet_clearance:
        pin_force = -solution.force[groups["planets"]]
    else:
        pin_force = -data.planet_bearing[:, None, None] * x[6:].reshape(N, 2, -1)
    back = np.zeros((2 * N, x.shape[1]), complex)
    if model.back_flanks:
        back = solution.force[groups["back flanks"]]
    bearing = np.zeros((2, x.shape[1]), complex)
    if model.bearing is not None:
        bearing = -solution.force[groups["carrier bearing"][0]]
    member, mesh = x[:6].reshape(3, 2, -1), solution.force[groups["meshes"]]
    wave = np.exp(1j * (_phases(solution.orders) @ solution.orders.T))
    path = (member @ wave.T).real
    deflection = (wave @ solution.deflection[groups["meshes"]].T).real
    kinds = (np.vstack([mesh[part], back[part]]) for part in (slice(0, N), slice(N, 2 * N)))
    return MotionLines(
        member,
        mesh,
        back,
        pin_force,
        bearing,
        *flank_contact(model.problem, solution, N),
        motion=float(np.hypot(path[:, 0], path[:, 1]).max()),
        approach=float(deflection.max()),
        force_tail=max(line_tail(forces, solution.orders, rounding=_STILL) for forces in kinds),
    )


def flank_forces(model: PlanarModel, solution: PeriodicSolution, theta) -> tuple[np.ndarray, np.ndarray]:
    """Forces (n, 2N) [N] of drive flanks and of back flanks on lines of their own, from the element laws.

    The deflections are those of the solution. Its force lines, cut at the last one, would ring beside a short
    contact; the law of a one-sided contact does not.

    Parameters
    ----------
    model : PlanarModel
    solution : PeriodicSolution
    theta : (n, n_bases) array
        Phases of the base frequencies [rad].
    """
    x = (np.exp(1j * (theta @ solution.orders.T)) @ solution.deflection.T).real
    force, groups = element_forces(model.problem, x, theta)[0], model.groups
    drive = force[:, groups["meshes"]]
    return drive, force[:, groups["back flanks"]] if model.back_flanks else np.zeros_like(drive)


def cut_branch(branch: Branch, count: int, message: str) -> Branch:
    """The first points of a branch, which then did not reach an end of its range."""
    known = branch.curve
    curve = replace(
        known,
        **{name: getattr(known, name)[:count] for name in _ALONG},
        **{name: getattr(known, name)[getattr(known, name) < count] for name in ("folds", "branch_points")},
        closed=False,
        complete=False,
        message=message,
    )
    return replace(
        branch, parameter=branch.parameter[:count], solutions=branch.solutions[:count], curve=curve
    )


def flank_contact(
    problem: NonlinearSystem, solution: PeriodicSolution, n_planets: int
) -> tuple[np.ndarray, np.ndarray]:
    """Shares of the time (2N,) in which drive flanks, and back flanks, of every mesh touch.

    Parameters
    ----------
    problem : NonlinearSystem
    solution : PeriodicSolution
    n_planets : int
    """
    share = column_contact(problem, solution)
    meshes = slice(0, 2 * n_planets)
    if share.shape[1] >= 4 * n_planets and np.isfinite(share[0, 2 * n_planets : 4 * n_planets]).all():
        return share[0, meshes], share[0, 2 * n_planets : 4 * n_planets]
    return share[0, meshes], share[1, meshes]


def column_contact(problem: NonlinearSystem, solution: PeriodicSolution) -> np.ndarray:
    """Share of the time (2, n_columns) in which the flanks of every column press, and pull.

    Columns without a mesh are nan. A mesh with play on one line of action pulls where its back flanks touch.
    A smoothed contact counts as closed beyond half its force scale, the force at the corner itself.
    """
    theta = _phases(solution.orders)
    x = (np.exp(1j * (theta @ solution.orders.T)) @ solution.deflection.T).real
    force = element_forces(problem, x, theta)[0]
    out = np.full((2, x.shape[1]), np.nan)
    for element in problem.elements:
        if isinstance(element, GearMeshes):
            place = element.columns[:, 0]
            least = 0.5 * element.smoothing * element.stiffness.mean
            out[0, place] = (force[:, place] > least).mean(axis=0)
            out[1, place] = (force[:, place] < -least).mean(axis=0)
    return out


def _phases(orders: np.ndarray) -> np.ndarray:
    """Instants (n, bases) [rad] that fill the phases evenly; one phase of a base that no line has."""
    used = np.any(orders != 0, axis=0)
    counts = np.where(used, _GRID[: len(used)] if used.sum() > 1 else _SAMPLES, 1)
    axes = [2.0 * np.pi * np.arange(count) / count for count in counts]
    return np.stack([axis.ravel() for axis in np.meshgrid(*axes, indexing="ij")], axis=1)


def shown_points(rms: np.ndarray, back: np.ndarray, stable: np.ndarray) -> list[tuple[int, str]]:
    """Points of a branch that are drawn over the phase, in order, and what they are; the last one is the top.

    Parameters
    ----------
    rms : (p,) array
        Amplitude along the branch.
    back : (p,) array
        Share of the cycle in which back flanks touch.
    stable : (p,) int array
        1 where known to be stable, 0 where known not to be, -1 where not known.
    """
    sure = stable == 1
    top, words = int(np.argmax(rms)), "largest response"
    if sure.any():
        top, words = int(np.argmax(np.where(sure, rms, -1.0))), "largest stable response"
    points = [(0, "start")] if top else []
    if back[top] > 0.0:
        free = np.flatnonzero(back[:top] == 0.0)
        points += [(int(free[-1]), "before back flanks touch")] if len(free) and free[-1] else []
    return [*points, (top, words)]


def fluctuation(lines: np.ndarray) -> np.ndarray:
    """Root mean square about the mean of lines (..., L), mean first."""
    return np.sqrt(0.5 * (np.abs(lines[..., 1:]) ** 2).sum(axis=-1))


def stacked(found: Sequence[MotionLines]) -> dict[str, np.ndarray]:
    """The lines of several solutions by name, the solutions along the first axis."""
    return {name: np.array([getattr(one, name) for one in found]) for name in MotionLines.__annotations__}


def merged_folds(frequency: np.ndarray, fold: np.ndarray) -> np.ndarray:
    """Points of the limit points of a branch, neighbours at one frequency as one: the outermost of them.

    Parameters
    ----------
    frequency : (p,) array
        Along the branch.
    fold : (p,) bool array
    """
    groups: list[list[int]] = []
    for point in np.flatnonzero(fold):
        if groups and abs(frequency[point] / frequency[groups[-1][0]] - 1.0) < _SAME_FOLD:
            groups[-1].append(int(point))
        else:
            groups.append([int(point)])
    # the branch runs towards a fold: the outermost point lies farthest in that sense
    sense = [1.0 if frequency[group[0]] >= frequency[max(group[0] - 1, 0)] else -1.0 for group in groups]
    return np.array([max(group, key=lambda i: s * frequency[i]) for group, s in zip(groups, sense)], int)
