"""What page one answers about pairs and planetary sets, from the files that their stages write."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from femgear.case.load_spectrum import required_life
from femgear.case.quantities import RPM
from femgear.stages.judgements import (
    SMOOTH,
    Judgement,
    Least,
    NotRated,
    judge_faults,
    judge_heat,
    judge_lives,
    judge_noise,
    judge_numbers,
    judge_smoothness,
    judge_strength,
    least_of,
    least_over_life,
    lives_of_bearings,
    lives_of_teeth,
    stresses_text,
    unrated_gears,
    without_life,
)
from femgear.stages.static_results import peak_to_peak
from femgear.stages.strength import OF_ROOTS, Rating
from femgear.stages.strength_results import (
    OF_RESPONSE,
    RATED_RESPONSES,
    SYMBOLS,
    computed_dynamic_factor,
    kind_names,
    missing_of_all,
    rate_results,
    taken_as_one,
)
from femgear.stages.stress_reasons import largest_pressure
from femgear.stages.tooth_faults import fault_effects, fault_words

_TO_A_HOUSING = "femgear casing CASE makes a gearbox of it, in a casing with sensors"
"""What gives a pair or a set of rigid bodies a level."""
_NO_METHOD = NotRated("ISO 6336 has no safety of these teeth", "the verdict in numbers says why")
_RESPONSES = "dynamics", "response", "runup", "branch"
"""Stages with motion."""
BY_ALL_STAGES = "a run of all stages computes it; where it has no such stage a gearbox has (femgear gearbox CASE)"
"""What gives a motion to a case with speeds."""


def set_judgements(results: Any) -> Iterator[Judgement]:
    """Judge a pair or a set of rigid bodies, which has no housing."""
    rated = rate_results(results)
    for judgement in judge_teeth(results, None if rated is None else rated[0]):
        # nothing louder is said of a set without a level
        smooth = judgement.question == SMOOTH and judgement.state == "good" and not judgement.sentence
        words = judgement.limit or judgement.answer
        yield replace(judgement, sentence=f"It runs smoothly: {words}") if smooth else judgement
    yield judge_noise(
        "no level: this kind of case has no housing", _largest_force(results), open_words=_TO_A_HOUSING, computed=False
    )
    yield judge_numbers(results.findings, results.manifest.complete)


def _largest_force(results: Any) -> str:
    """Write how far mesh forces of the run-up reach over their mean, and at which speed; empty without a run-up."""
    if "runup" not in results.stages or "dynamic_factor" not in results.runup:
        return ""
    factors = results.runup["dynamic_factor"].values
    factors = factors.reshape(len(factors), -1).max(axis=1)
    at = int(factors.argmax())
    end = ", its end" if at in (0, len(factors) - 1) else ""
    where = f"at {results.runup['speed'].values[at]:,.4g} rpm{end}"
    return f"In the run-up its mesh force reaches {factors[at]:.2f} times its mean ({where})"


def judge_teeth(results: Any, rating: Rating | None, dynamic: np.ndarray | None = None) -> Iterator[Judgement]:
    """Judge strength, lives, heat and smoothness of a pair or a set.

    Parameters
    ----------
    results : Results
    rating : Rating or None
        Of its teeth; None where the case asks for no safeties.
    dynamic : (kinds,) array, optional
        K_v of the kinds of mesh, by default those of dynamics.nc.
    """
    case, stages, findings = results.case, results.stages, results.findings
    yield from _judge_faults(results)
    root, flank = (None, None) if rating is None else least_of(rating)
    if "life" in stages:
        root, flank = (least_over_life(results.life, *least) for least in (("root", root), ("flank", flank)))
    shown = [least for least in (root, flank) if least is not None]
    yield judge_strength(
        root,
        flank,
        case.strength,
        _stresses(results),
        [f for f in findings if f.code not in OF_RESPONSE or f.stage in ("", *RATED_RESPONSES)],
        (*OF_ROOTS, *(() if all(least.over_life for least in shown) else OF_RESPONSE)),
        taken_as_one(_missing_factors(results, rating, shown)),
        NotRated() if rating is None else _NO_METHOD,
        () if rating is None else unrated_gears(rating),
    )
    if "life" in stages:
        parts = (*lives_of_teeth(results.life), *lives_of_bearings(results.life))
        unknown = without_life(results.life, case.gear_names)
        yield from judge_lives(parts, required_life(case.operation), findings, unknown)
    yield from judge_heat(results)
    remedy = BY_ALL_STAGES if case.operation.speeds else "operation.speeds gives it"
    yield judge_smoothness(_motion(results, dynamic), results, _RESPONSES, remedy)


def _judge_faults(results: Any) -> Iterator[Judgement]:
    """Say which teeth of a case are faulty, and what that does; nothing of whole teeth."""
    faults = fault_words(results.case)
    if faults:
        effects = "; ".join(fault_effects(results)) or "nothing is known: this run has no stage that shows it"
        yield judge_faults(faults, effects)


def _missing_factors(results: Any, rating: Rating | None, shown: Sequence[Least]) -> list[str]:
    """List the load factors that nothing told of the safeties shown: of the run's load, and of all load cases."""
    of_load = rating if not all(least.over_life for least in shown) else None
    missing = {*missing_of_all([of_load])}
    if any(least.over_life for least in shown):
        missing |= {*str(results.life.attrs.get("iso_missing", "")).split()}
    return [name for name in SYMBOLS if name in missing]


def _stresses(results: Any) -> str:
    """Write the largest stresses of a run, empty where there are none."""
    if "stress" not in results.stages:
        return ""
    return stresses_text(results.stress["root_worst"].values, largest_pressure(results.stress))


def _motion(results: Any, dynamic: np.ndarray | None) -> str:
    """Write transmission errors and dynamic factors of a run by kind of mesh."""
    parts, kinds = [], []
    errors = _transmission_error(results)
    if errors is not None:
        names, error = errors
        kinds = kind_names([str(name) for name in names])
        of_kinds = 1e6 * error.reshape(len(kinds), -1).max(axis=1)
        parts.append(f"transmission error {_joined(of_kinds, '.3g')} µm")
    if dynamic is None and "dynamics" in results.stages:
        kinds = kind_names(results.dynamics["mesh"].values)
        dynamic = computed_dynamic_factor(results.dynamics, len(kinds))
    if dynamic is not None:
        parts.append(f"dynamic factor K_v {_joined(dynamic, '.2f')}{_at_one_speed(results, kinds)}")
    text = ", ".join(parts)
    return f"{text} ({', '.join(kinds)})" if " and " in text and kinds else text


def _at_one_speed(results: Any, kinds: Sequence[str]) -> str:
    """Write the speed of operation of a pair that has one alone: ``" at 1,500 rpm"``, which the run-up goes beyond."""
    speeds = results.case.operation.speeds
    return f" at {speeds[0] / RPM:,.4g} rpm" if len(speeds) == len(kinds) == 1 else ""


def _transmission_error(results: Any) -> tuple[np.ndarray, np.ndarray] | None:
    """Peak to peak of the transmission error of every mesh [m], with the names of the meshes; None where there is none.

    Of helical sets it is that of modes.nc: static.nc has the spur gears of their transverse section.
    """
    if "modes" in results.stages and "helical_ste" in results.modes:
        return results.modes["mesh"].values, np.ptp(results.modes["helical_ste"].values, axis=-1)
    if "static" not in results.stages or getattr(results.case, "helical", None) is not None:
        return None
    return results.static["mesh"].values, peak_to_peak(results.static, "ste")


def _joined(values: Iterable[float], form: str) -> str:
    """Write the values of the kinds of mesh, one where all are equal."""
    texts = [f"{value:{form}}" for value in values]
    return texts[0] if len(set(texts)) == 1 else " and ".join(texts)
