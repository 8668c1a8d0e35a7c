"""Refusals of a planar case, before anything is computed and of what was found."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.linear.modal import solve_modes
from femgear.storage.dataset import RPM
from femgear.trains.gear_set import mode_ratios
from femgear.trains.planar.model import planar_ratios
from femgear.trains.planar.section import PlanarCase
from femgear.trains.rigid import check_one_period

if TYPE_CHECKING:
    from femgear.gears.planetary import PlanetarySet
    from femgear.solvers.continuation.branches import Branch
    from femgear.solvers.periodic.solution import PeriodicSolution
    from femgear.trains.planar.model import MotionLines, PlanarModel
    from femgear.trains.planar.section import BranchSection

# largest motion of a member and largest deflection of a mesh [modules], as in the static stage
_MODULES = {"motion": 2.0, "approach": 0.5}
# distance of a line from an undamped natural frequency, relative to it, at which the response has no bound
_ON_RESONANCE = 1e-3
# what a curve holds of every point
_ALONG = ("points", "parameter", "tangent", "iterations", "error")


def check_planar_case(case: PlanarCase, gears: PlanetarySet) -> None:
    """Refuse what the planar model cannot represent, before anything is computed.

    Raises
    ------
    CaseError
        E-BACKLASH: back flanks without play. E-PERIODS: a static record of several mesh periods.
    """
    planar = case.planar
    play = min(gears.backlash_sun_planet, gears.backlash_planet_ring)
    # play of a rounding error is none
    if planar.back_flanks and planar.line_backlash is None and play < 1e-9:
        raise CaseError(
            f"back flanks need play, and the gears have {max(play, 0.0) * 1e6:.3g} um",
            code="E-BACKLASH",
            key="planar.back_flanks",
            value="true",
            limit="play above 0 in every mesh",
            remedy="give planar.line_backlash or set.backlash, or write planar.back_flanks = false",
            file=case.location("planar.back_flanks"),
        )
    if planar.mesh_stiffness is None:
        check_one_period(case, gears, "the planar model takes")


def check_smoothing(case: PlanarCase, gears: PlanetarySet, model: PlanarModel) -> None:
    """Refuse contact that sets in over a length which is none of contact.

    The smoothed law carries ``k s^2 / 4 b`` through a gap b, and its force at a compression d is wrong by
    ``(s / 2 d)^2`` of it.

    Raises
    ------
    CaseError
        E-RANGE: a smoothing length above half the play or above the mean compression.
    """
    smoothing, limits = case.planar.smoothing, {}
    play = case.planar.line_backlash
    play = min(gears.backlash_sun_planet, gears.backlash_planet_ring) if play is None else play
    # play of a rounding error is none
    if play > 1e-9:
        limits["half the play"] = 0.5 * play
    if (compression := mean_compression(model)) > 0.0:
        limits["the mean compression of a mesh, force / stiffness"] = compression
    for words, limit in limits.items():
        if smoothing > limit:
            raise CaseError(
                f"contact sets in over {smoothing * 1e6:.4g} um, more than {words}: teeth would carry across "
                "their play",
                code="E-RANGE",
                key="planar.smoothing",
                value=f"{smoothing * 1e6:.6g} um",
                limit=f"{limit * 1e6:.4g} um or less",
                remedy="leave it out: 0.3 um",
                file=case.location("planar.smoothing"),
            )


def mean_compression(model: PlanarModel) -> float:
    """Compute the least compression [m] of a mesh under the mean load, force / stiffness, flanks closed."""
    system, count = model.problem.system, 2 * model.data.n_planets
    K = system.K + (system.W * model.springs) @ system.W.T
    # free turning of the whole set has no stiffness, and the load none of it
    moved = np.linalg.lstsq(K, system.load, rcond=1e-14)[0]
    return float(np.abs(system.W[:, :count].T @ moved).min())


def check_damping(case: PlanarCase, model: PlanarModel, spans: Iterable[tuple[float, float, str]]) -> None:
    """Refuse natural frequencies without damping where something excites them.

    Parameters
    ----------
    case : Case
    model : PlanarModel
    spans : iterable of (lowest [Hz], highest [Hz], text)
        Frequencies that are excited, and how, as in "planar.branch crosses it".

    Raises
    ------
    CaseError
        E-RESONANCE.
    """
    ratios = planar_ratios(case)
    if np.min(ratios) > 0.0:
        return
    system = model.problem.system
    plain = replace(system, C=np.zeros_like(system.C), gyroscopic=None)
    hertz = solve_modes(plain, model.springs).frequency
    bare = hertz[(hertz > 0.0) & (mode_ratios(hertz, ratios) == 0.0)]
    key = "planar.damping_ratios" if case.planar.damping_ratios else "dynamics.damping_ratio"
    for lowest, highest, words in spans:
        met = bare[(bare >= lowest) & (bare <= highest)]
        if len(met):
            raise CaseError(
                f"the natural frequency {met[0]:.6g} Hz has no damping and {words}: "
                "the response has no bound there",
                code="E-RESONANCE",
                key=key,
                value="0",
                limit="above 0 at a resonance",
                remedy="give the mode some damping, or move the range or the speed",
                file=case.location(key),
            )


def excited_spans(frequency: np.ndarray, orders: np.ndarray) -> Iterator[tuple[float, float, str]]:
    """Make the spans of `check_damping` around the lines of the weight and of the mesh harmonics.

    Parameters
    ----------
    frequency : (2,) array
        Of carrier and mesh [rad/s].
    orders : (L, 2) int array
    """
    pure = (orders[:, 0] == 0) | ((np.abs(orders[:, 0]) == 1) & (orders[:, 1] == 0))
    for line in np.abs(orders[pure] @ frequency) / (2.0 * np.pi):
        words = f"the line at {line:.6g} Hz is on it"
        yield line / (1.0 + _ON_RESONANCE), line / (1.0 - _ON_RESONANCE), words


def bounded_branch(
    branch: Branch, lines: Iterable[MotionLines], gears: PlanetarySet
) -> tuple[Branch, tuple[MotionLines, ...]]:
    """Cut a branch at the last point that converged with small displacements, and compute its motions.

    Parameters
    ----------
    branch : Branch
    lines : iterable of MotionLines
        One a point; taken as far as the branch is good.
    gears : PlanetarySet

    Raises
    ------
    ConvergenceError
        Not even the first two points are good (E-MOTION, E-CONVERGENCE).
    """
    good: list[MotionLines] = []
    for solution, one in zip(branch.solutions, lines):
        hertz = f"{solution.frequency[0] / (2.0 * np.pi):.6g} Hz"
        words = _too_far(one, gears) if solution.converged else f"no solution: {solution.message}"
        if words:
            if len(good) < 2:
                raise _moved_too_far(f"at {hertz} of the weight", words, solution.converged)
            ending = f"stopped before {hertz}, where {words}" if solution.converged else f"{words} at {hertz}"
            return _cut(branch, len(good), ending), tuple(good)
        good.append(one)
    return branch, tuple(good)


def _cut(branch: Branch, count: int, message: str) -> Branch:
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
    return replace(branch, solutions=branch.solutions[:count], curve=curve)


def check_response_motions(
    speeds: Sequence[float],
    solutions: Sequence[PeriodicSolution],
    lines: Sequence[MotionLines],
    gears: PlanetarySet,
) -> None:
    """Refuse speeds without a solution, and displacements that are not small.

    Raises
    ------
    ConvergenceError
        E-CONVERGENCE, E-MOTION.
    """
    lost = [i for i, one in enumerate(solutions) if not one.converged]
    if lost:
        listed = ", ".join(f"{speeds[i] / RPM:.6g}" for i in lost[:8]) + (", ..." if len(lost) > 8 else "")
        raise ConvergenceError(
            f"no response at {len(lost)} of {len(speeds)} speeds: {listed} rpm; {solutions[lost[0]].message}",
            code="E-CONVERGENCE",
            key="operation.speeds",
            value=f"relative residual {solutions[lost[0]].residual:.2e}",
            remedy="leave these speeds out, change planar.response.carrier_harmonics, or raise the damping",
        )
    for speed, one in zip(speeds, lines):
        if words := _too_far(one, gears):
            raise _moved_too_far(f"at {speed / RPM:.6g} rpm", words, True)


def _too_far(one: MotionLines, gears: PlanetarySet) -> str:
    """Why displacements are not small; empty where they are."""
    module = gears.sun.module
    for name, words in (("motion", "a member moves"), ("approach", "the flanks of a mesh approach")):
        value, limit = getattr(one, name), _MODULES[name] * module
        if not value <= limit:
            allowed = f"{limit * 1e3:.4g} mm ({_MODULES[name]:g} modules)"
            return f"{words} by {value * 1e3:.4g} mm, more than {allowed}"
    return ""


def _moved_too_far(where: str, words: str, converged: bool) -> ConvergenceError:
    if not converged:
        return ConvergenceError(f"{where}: {words}", code="E-CONVERGENCE", key="planar.branch.from")
    return ConvergenceError(
        f"{where} {words}: the model is one of small displacements",
        code="E-MOTION",
        remedy="raise the damping, stiffen the supports, or leave the resonance out",
    )


def end_of_branch(branch: Branch, wanted: BranchSection) -> str:
    """Tell how a branch ended, in frequencies [Hz] and entries of the case file."""
    hertz, count = branch.parameter[-1] / (2.0 * np.pi), len(branch.parameter)
    if branch.complete:
        side = "start" if abs(hertz - wanted.start) < abs(hertz - wanted.to) else "end"
        return f"it came to the {side} of its range, {hertz:.6g} Hz"
    if count >= wanted.points:
        return (
            f"NOT COMPLETE: it ended at {hertz:.6g} Hz after {count} points, before {wanted.to:.6g} Hz: "
            "raise planar.branch.points"
        )
    return f"NOT COMPLETE: it ended at {hertz:.6g} Hz, before {wanted.to:.6g} Hz: {branch.message}"
