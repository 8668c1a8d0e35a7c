"""What page one answers about a gearbox: does it hold, how long, does it run smoothly, how loud, how sure is that.

A `Judgement` is one question with its answer, a colour, and the limit that the colour rests on. Each train lists its
own with the functions of this module; the page shows them as cards, and joins their sentences to one text.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter
from typing import Any, Literal

import numpy as np

from femgear.case.quantities import RPM
from femgear.case.sections import StrengthSection
from femgear.findings import CATALOGUE, DOUBT, FAULT, NOTE, Finding, counted, in_words, percent
from femgear.report.tables import Block, merged_names
from femgear.stages.life_results import SYMBOLS, first_to_fail, hours_text
from femgear.stages.strength import OF_ROOTS, OF_TEETH, RatedFlank, Rating, gear_words

State = Literal["good", "look", "bad", "open", "absent"]
_WORDS: dict[State, str] = {
    "good": "✓ holds",
    "look": "▲ look",
    "bad": "✕ fails",
    "open": "○ no limit",
    "absent": "○ not computed",
}
"""What the colour of a card says, for those who see no colours."""
FAULTY, STRONG, LIFE, HEAT, SMOOTH, QUIET, SURE = (
    "What does the fault do?",
    "Is it strong enough?",
    "How long does it live?",
    "Does it stay cool?",
    "Does it run smoothly?",
    "How loud is it?",
    "Can the numbers be relied on?",
)
"""The questions, in the order of the cards."""

_RAISED = 0.5
"""Change of a level by a longer excitation from which on the higher one is compared with the limit too [dB]."""
MOST_FAULTS = 3
"""Faults that page one names."""
MOST_DOUBTS = 4
"""Doubts that the card of the numbers names."""
_AGAINST = {"S_F": "against breakage", "S_H": "against pitting"}
"""What safeties are against."""
_BEYOND = "W-PRESSURE", "W-STRENGTH"
"""Codes of the findings that no steel carries the load."""


@dataclass(frozen=True)
class Judgement:
    """One question about a gearbox with its answer.

    Parameters
    ----------
    question : str
    state : {"good", "look", "bad", "open", "absent"}
        Holds; deserves a look; fails; no limit to judge by; not computed.
    answer : str
        In figures.
    limit : str
        What the state rests on, or which entry of the case would give a limit, or the number.
    sentence : str
        The answer as a part of a text, empty where it needs no words.
    """

    question: str
    state: State
    answer: str
    limit: str = ""
    sentence: str = ""

    @property
    def words(self) -> str:
        """What the state means: a sign and a word."""
        return _WORDS[self.state]


@dataclass(frozen=True)
class Least:
    """The smallest of some safeties.

    Parameters
    ----------
    value : float
        S_F or S_H.
    where : str
        Root or flank that it is of.
    over_life : bool
        Whether it is one over the life asked for, with the load factors of all load cases.
    """

    value: float
    where: str
    over_life: bool = False


@dataclass(frozen=True)
class NotRated:
    """Why a train has no safeties.

    Parameters
    ----------
    reason : str
        What is missing.
    remedy : str
        What gives safeties.
    """

    reason: str = "the case gives no treatment of its gears"
    remedy: str = "give material.treatment and material.hardness for safeties"


def joined_sentence(judgements: Iterable[Judgement]) -> str:
    """Join the sentences of judgements to one text; empty where none has a sentence."""
    sentences = [judgement.sentence for judgement in judgements if judgement.sentence]
    return "".join(f"{text[0].upper()}{text[1:]}. " for text in sentences).rstrip()


def describe_judgements(sentence: str, judgements: Sequence[Judgement]) -> tuple[Block, ...]:
    """Tabulate judgements for the terminal under a sentence; nothing without any."""
    if not judgements:
        return ()
    rows = tuple(
        (judgement.words, f"{judgement.question} {': '.join(filter(None, (judgement.answer, judgement.limit)))}")
        for judgement in judgements
    )
    return (Block(sentence or "Summary", rows=rows),)


def least_of(rating: Rating) -> tuple[Least | None, Least | None]:
    """Find the smallest S_F and S_H of a rating; None where no material has the limit."""

    def least(values: Sequence[float], part: str) -> Least | None:
        flanks: list[tuple[float, RatedFlank]] = [
            (value, flank) for value, flank in zip(values, rating.flanks, strict=True) if math.isfinite(value)
        ]
        if not flanks:
            return None
        value, flank = min(flanks, key=lambda pair: pair[0])
        return Least(value, f"{part} of {flank.words}")

    roots, contacts = ([flank.root_safety for flank in rating.flanks], [f.contact_safety for f in rating.flanks])
    return least(roots, "root"), least(contacts, "flank")


def least_over_life(data: Any, kind: str, of_load: Least | None) -> Least | None:
    """Choose the smaller of a safety under the load and of those over the life asked for.

    Parameters
    ----------
    data : dataset
        With the variables of lives, as far as there are any.
    kind : {"root", "flank"}
    of_load : Least or None
        Under the load of the run.
    """
    name = f"{kind}_spectrum_safety"
    if name not in data or not np.isfinite(data[name].values).any():
        return of_load
    at = int(np.nanargmin(data[name].values))
    where = f"{kind} of {data[kind].values[at]}, over the life asked for"
    over_life = Least(float(data[name].values[at]), where, over_life=True)
    return over_life if of_load is None or over_life.value < of_load.value else of_load


def unrated_gears(rating: Rating) -> list[str]:
    """Name the gears that lack both safeties, or one of them: ``"gear 2"``, ``"S_F of gear 2"``.

    A safety is missing without a limit of the material and outside the range of the method, not without a load.
    """
    gears = dict[str, set[str]]()
    for flank in rating.flanks:
        lacking = gears.setdefault(gear_words(flank.gear), set())
        lacking |= {"S_F"} if flank.root_limit is None or math.isnan(flank.root_stress) else set()
        lacking |= {"S_H"} if flank.contact_limit is None or math.isnan(flank.contact_stress) else set()
    return [
        gear if len(lacking) == 2 else f"{next(iter(lacking))} of {gear}" for gear, lacking in gears.items() if lacking
    ]


def judge_faults(faults: Sequence[str], effects: str) -> Judgement:
    """Name faulty teeth, the first of many, and say what that does."""
    answer = ", ".join(faults[:MOST_FAULTS])
    answer += f" and {len(faults) - MOST_FAULTS} more" if len(faults) > MOST_FAULTS else ""
    return Judgement(FAULTY, "look", answer, effects, f"Faulty: {answer}")


def _not_rated(parts: Sequence[str]) -> str:
    """Say of gears, stages or safeties that they are not rated; empty of none."""
    return f"{_and(parts)} {'is' if len(parts) == 1 else 'are'} not rated" if parts else ""


def _and(names: Sequence[str]) -> str:
    return " and ".join(merged_names(names).rsplit(", ", 1))


def _raised(findings: Iterable[Finding], codes: Sequence[str]) -> list[str]:
    """List those of some codes that doubts and faults were raised with."""
    raised = {finding.code for finding in findings if finding.severity != NOTE}
    return [code for code in dict.fromkeys(codes) if code in raised]


def _doubts(findings: Iterable[Finding], codes: Sequence[str]) -> str:
    """Name the doubts and faults with some codes; empty of none."""
    return doubt_words([CATALOGUE[code].words for code in _raised(findings, codes)])


def doubt_words(doubts: Sequence[str]) -> str:
    """List doubts in words, with marks where these have some; empty of none."""
    return f"doubt{'s' * (len(doubts) > 1)}: {', '.join(doubts)}" if doubts else ""


def stresses_text(root: np.ndarray, pressure: np.ndarray) -> str:
    """Write the largest of root stresses (...) and contact pressures (...) [Pa]."""
    return f"root {1e-6 * float(np.nanmax(root)):,.0f} MPa, pressure {1e-6 * float(np.nanmax(pressure)):,.0f} MPa"


def judge_strength(
    root: Least | None,
    flank: Least | None,
    limits: StrengthSection,
    stresses: str = "",
    findings: Iterable[Finding] = (),
    doubts: Sequence[str] = (),
    open_factors: str = "",
    without: NotRated = NotRated(),
    unrated: Sequence[str] = (),
) -> Judgement:
    """Judge safeties against those that the case asks for.

    Parameters
    ----------
    root, flank : Least or None
        Smallest S_F and S_H; None where no material has a limit.
    limits : StrengthSection
        With the safeties asked for.
    stresses : str
        Largest stresses in words, for the answer where there are no safeties.
    findings : iterable of Finding
        Of the run: what no steel carries fails, whatever limits there are.
    doubts : sequence of str
        Codes of the findings that concern the safeties.
    open_factors : str
        Load factors that were taken as 1, in words.
    without : NotRated
        Why there are no safeties, where there are none.
    unrated : sequence of str
        Gears or stages that carry and have no safety.
    """
    findings = list(findings)
    beyond = _raised(findings, _BEYOND)
    if any(finding.code == "W-EDGE" and ".fault[" in finding.key for finding in findings):
        # the pressure at the sharp edge of a pit or a broken tooth is that of the grid
        beyond, doubts = [code for code in beyond if code != "W-PRESSURE"], (*doubts, "W-EDGE")
    rated = [
        (symbol, least, required)
        for symbol, least, required in (
            ("S_F", root, limits.required_root_safety),
            ("S_H", flank, limits.required_flank_safety),
        )
        if least is not None
    ]
    if beyond:
        answer = ", ".join(f"{symbol} {least.value:.2f} ({least.where})" for symbol, least, _ in rated) or stresses
        words = ", ".join(CATALOGUE[code].words for code in beyond)
        return Judgement(STRONG, "bad", answer, "; ".join(map(in_words, beyond)), f"Not strong enough: {words}")
    if not rated:
        sentence = f"Its strength is not rated: {without.reason}"
        limit = "; ".join(filter(None, (without.remedy, _doubts(findings, doubts))))
        return Judgement(STRONG, "open" if stresses else "absent", stresses or "not rated", limit, sentence)
    low = [(symbol, least, required) for symbol, least, required in rated if not least.value >= required]
    answer = ", ".join(f"{symbol} {least.value:.2f} ({least.where})" for symbol, least, _ in rated)
    in_sentence = ", ".join(
        f"{symbol} {least.value:.2f} {_AGAINST[symbol]} ({least.where})" for symbol, least, _ in rated
    )
    margin = _load_margin(rated)
    limit = f"{_asked_for(rated, limits)}, ISO 6336:{limits.edition}"
    limit += f", reached at {margin:.2g} times the load" if math.isfinite(margin) else ""
    whole = [] if len(rated) == 2 else ["S_H" if rated[0][0] == "S_F" else "S_F"]
    missing = _not_rated([*whole, *(part for part in unrated if not part.startswith(tuple(whole)))])
    reasons = _doubts(findings, doubts)
    limit = "; ".join(filter(None, (limit, open_factors, missing, reasons)))
    if low:
        failing = " and ".join(
            f"{symbol} {least.value:.2f} of {required:g} needed {_AGAINST[symbol]} ({least.where})"
            for symbol, least, required in low
        )
        part = f", only for {margin:.2g} times the load" if math.isfinite(margin) else ""
        return Judgement(STRONG, "bad", answer, limit, f"Not strong enough{part}: {failing}")
    faulty = "W-FAULT" in doubts and bool(_raised(findings, ("W-FAULT",)))
    doubted = "With doubts strong" if ", " in reasons else "With a doubt strong" if reasons else "Strong"
    begin = "But for the faulty teeth strong enough" if faulty else f"{doubted} enough"
    if missing:
        rated_words = f"{begin} as far as it is rated, for {margin:.2g} times the load: {in_sentence}; {missing}"
        return Judgement(STRONG, "look", answer, limit, rated_words)
    sentence = f"{begin} for {margin:.2g} times the load: {in_sentence}"
    return Judgement(STRONG, "look" if reasons else "good", answer, limit, sentence)


def _asked_for(rated: Sequence[tuple[str, Least, float]], limits: StrengthSection) -> str:
    """Write the safeties that are asked for, and that it is femgear that asks where the case does not."""
    if limits.model_fields_set & {"required_root_safety", "required_flank_safety"}:
        return " and ".join(f"{symbol} at least {required:g}" for symbol, _, required in rated)
    return f"{' and '.join(symbol for symbol, *_ in rated)} at least 1, as the case asks for no other"


def _load_margin(rated: Sequence[tuple[str, Least, float]]) -> float:
    """Find how many times the load brings the first safety down to the one asked for, with the same load factors.

    The root stress grows with the load and contact pressure with its square root (ISO 6336-2 and -3): the margin is
    the smaller of S_F and S_H^2, each over what is asked for.
    """
    return min((least.value / required) ** (2.0 if symbol == "S_H" else 1.0) for symbol, least, required in rated)


def judge_lives(
    parts: Iterable[tuple[str, float, str]],
    required: float | None,
    findings: Iterable[Finding] = (),
    unrated: Sequence[str] = (),
) -> Iterator[Judgement]:
    """Judge lives against the one that the case asks for; nothing where none was computed.

    Parameters
    ----------
    parts : iterable of (str, float, str)
        What lives, its shortest life [h], and where: ``("teeth", 31000.0, "root of the sun")``.
    required : float, optional
        Life asked for [h].
    findings : iterable of Finding
        Of the run; doubts of load factors and materials concern lives too.
    unrated : sequence of str
        Gears or stages that carry and have no life.
    """
    lives = [(name, hours, where) for name, hours, where in parts if not math.isnan(hours)]
    if not lives:
        return
    answer = ", ".join(f"{name} {_hours(hours)}" for name, hours, _ in lives)
    _, shortest, where = min(lives, key=lambda life: life[1])
    words = f"{where} fails first"
    if math.isinf(shortest):
        kinds = dict.fromkeys("teeth" if name == "teeth" else "bearings" for name, *_ in lives)
        sentence = f"Its {' and '.join(kinds)} last without end under these loads"
    else:
        wanted = f" of the {required:,.0f} h asked for" if required is not None else ""
        sentence = f"It lives {_hours(shortest)}{wanted} ({words})"
    missing = f"the life of {_and(unrated)} is not known" if unrated else ""
    sentence += f"; {missing}" if missing else ""
    reasons = _doubts(findings, OF_ROOTS if any(name == "teeth" for name, *_ in lives) else OF_TEETH)
    limit = "operation.required_hours gives a limit" if required is None else f"at least {required:,.0f} h"
    state: State = "look" if missing or reasons else "good"
    if required is None or shortest < required:
        state = "open" if required is None else "bad"
    yield Judgement(LIFE, state, answer, "; ".join(filter(None, (limit, missing, reasons))), sentence)


def _hours(hours: float) -> str:
    """Write a life with its unit: whole hours with separators of thousands."""
    if math.isinf(hours):
        return "last without end"
    return f"{hours:,.0f} h" if hours >= 100.0 else f"{hours_text(hours)} h"


def lives_of_teeth(data: Any) -> Iterator[tuple[str, float, str]]:
    """Name the shortest life of roots and flanks of a file with lives [h]."""
    kinds = [kind for kind in ("root", "flank") if f"{kind}_life" in data]
    if not kinds:
        return
    kind = min(kinds, key=lambda kind: float(data[f"{kind}_life"].values.min()))
    lives, at = data[f"{kind}_life"].values, first_to_fail(data, kind)
    yield "teeth", float(lives[at]), f"the {kind} of {data[kind].values[at]}"


def without_life(data: Any, gears: Sequence[str]) -> list[str]:
    """List the gears whose roots or flanks have no life in a file with lives; ``gears`` are sections of the case."""
    titles = [{str(title).partition(",")[0] for title in data[kind].values} if kind in data else {} for kind in SYMBOLS]
    return [gear_words(gear) for gear in gears if not all(gear.replace("_", " ") in named for named in titles)]


def lives_of_bearings(data: Any) -> Iterator[tuple[str, float, str]]:
    """Name the shortest lives of bearings of shafts and of planets in a file with lives [h]."""
    if "spectrum_reference_life" in data:
        modified, reference = data["spectrum_modified_life"].values, data["spectrum_reference_life"].values
        life = np.where(np.isnan(modified), reference, modified)
        if np.isfinite(life).any():
            at = int(np.nanargmin(life))
            yield "bearings", float(life[at]), f"bearing {data['bearing'].values[at]}"
    if "planet_bearing_life" in data:
        life = data["planet_bearing_life"].values
        at = int(life.argmin())
        yield "planets' bearings", float(life[at]), f"the bearing of {data['planet_bearing'].values[at]}"


def figures_in_cases(figures: Iterable[tuple[str, str]]) -> str:
    """Write figures with their load cases, each in brackets; once where one follows another, empty where none is."""
    groups = [(case, ", ".join(text for text, _ in group)) for case, group in groupby(figures, key=itemgetter(1))]
    return ", ".join(f"{texts} ({case})" if case else texts for case, texts in groups)


def _load_case_of(data: Any, number: int) -> str:
    """Name a load case of a file with several; empty where there is one, or speeds in their place."""
    several = "load_case" in data.coords and data.sizes["load_case"] > 1
    return str(data["load_case"].values[number]) if several else ""


def judge_heat(results: Any) -> Iterator[Judgement]:
    """Judge scuffing and film, with the efficiency; nothing where no losses were computed."""
    if "losses" not in results.stages:
        return
    values = np.asarray(results.losses["efficiency"].values, float)
    loss = np.asarray(results.losses["loss"].values, float)
    unknown = str(results.losses.attrs.get("unknown", ""))
    figures = list[tuple[str, str]]()
    if unknown:
        figures.append(("efficiency not known", ""))
        sentence = f"Nothing tells what the meshes of {unknown} lose"
    elif np.isfinite(values).any():
        at = int(np.nanargmax(loss))
        lost = f"{loss[at]:,.0f} W", _load_case_of(results.losses, at)
        figures.append((f"efficiency {100.0 * values[at]:.2f} %, losses {lost[0]}", lost[1]))
        sentence = f"It loses {figures_in_cases([lost])}"
    else:
        return
    limits, below = list[tuple[str, str]](), list[tuple[str, str]]()
    if "heat" in results.stages:
        for name, words in (("scuffing_safety", "S_B"), ("film_safety", "S_lambda")):
            safety = np.asarray(results.heat[name].values, float)
            if np.isfinite(safety).any():
                at = int(np.unravel_index(int(np.nanargmin(safety)), safety.shape)[0])
                limits.append((f"{words} {np.nanmin(safety):.2f}", _load_case_of(results.heat, at)))
                if not np.nanmin(safety) >= 1.0:
                    below.append(limits[-1])
        contact = np.asarray(results.heat["highest_temperature"].values, float)
        at = int(np.unravel_index(int(np.nanargmax(contact)), contact.shape)[0])
        figures.append((f"contact {np.nanmax(contact):.0f} °C", _load_case_of(results.heat, at)))
    answer = figures_in_cases([*figures, *limits])
    if below:
        yield Judgement(HEAT, "bad", answer, "at least 1", f"{sentence} and its oil fails: {figures_in_cases(below)}")
    elif limits:
        yield Judgement(HEAT, "good", answer, "at least 1, ISO/TS 6336-20 and -22", sentence)
    else:
        remedy = f"give the teeth of {unknown}" if unknown else "lubricant.fzg_stage gives a limit"
        yield Judgement(HEAT, "open", answer, remedy, sentence)


def judge_smoothness(answer: str, results: Any, stages: Sequence[str], remedy: str) -> Judgement:
    """Judge the run by what speaks against it: teeth that part or press on both flanks, motions that are not stable.

    So do planets that carry nothing at some positions, and mesh forces of which too few harmonics were taken.

    Parameters
    ----------
    answer : str
        Transmission error and dynamic factors, in figures; empty where none is known.
    results : Results
    stages : sequence of str
        Stages that the train has with motion; where a run has none of them nothing is judged.
    remedy : str
        What gives the run a motion.
    """
    present = [stage for stage in stages if stage in results.stages]
    if not present:
        return Judgement(SMOOTH, "absent", f"at rest: {answer}" if answer else "no motion", remedy)
    against, passed, beyond = _against(results, present)
    of_motion = [finding for finding in results.findings if not finding.key.startswith("housing")]
    rests_on = f"; {words}" if (words := estimates_words(of_motion)) else ""
    if against or passed:
        begin = "at some speeds " if _several_speeds(results, present) else ""
        sentences = [f"{begin}{' and '.join(against)}", *passed] if against else passed
        return _smoothness("look", answer, f"{', '.join((*against, *passed))}{rests_on}", _sentences(sentences))
    away = {"branch"} if "response" in present else set()
    if any(f.code == "W-TAIL" and f.severity == DOUBT and f.stage not in away for f in results.findings):
        return _smoothness("look", answer, f"{_FEW_HARMONICS}{rests_on}")
    if any(finding.code == "W-OPEN" for finding in results.findings):
        return _smoothness("look", answer, f"a planet carries nothing at some positions{rests_on}")
    judged = any("stable" in results[stage] for stage in present if not (beyond and stage in _SPEEDS_OF))
    words = "teeth stay in contact, motions are stable" if judged else "teeth stay in contact"
    if not beyond:
        return _smoothness("good", answer, f"{words}{rests_on}")
    remarks = [f"in operation {words}", *beyond]
    return _smoothness("good", answer, f"{'; '.join(remarks)}{rests_on}", _sentences(remarks))


def estimates_words(findings: Iterable[Finding]) -> str:
    """Say which values that vibration rests on are estimated; empty of none."""
    estimated = (finding.concerns for finding in findings if finding.code == "W-ESTIMATED")
    kinds = dict.fromkeys(filter(None, estimated))
    return f"rests on estimated {_and(list(kinds))}" if kinds else ""


def _smoothness(state: State, answer: str, words: str, sentence: str = "") -> Judgement:
    """Judge the run in figures and words, or in words alone."""
    return Judgement(SMOOTH, state, answer or words, words if answer else "", sentence)


def _sentences(texts: Sequence[str]) -> str:
    """Join sentences without the full stop of the last one, the first in lower case."""
    return ". ".join(text if i == 0 else f"{text[0].upper()}{text[1:]}" for i, text in enumerate(texts))


def _several_speeds(results: Any, stages: Sequence[str]) -> bool:
    """Tell whether a run has more speeds of operation than one, or of a branch or a run-up where it has no others."""
    operating = [stage for stage in stages if stage not in _SPEEDS_OF] or stages
    return any(results[stage].sizes.get(axis, 1) > 1 for stage in operating for axis in ("speed", "point"))


def _against(results: Any, stages: Sequence[str]) -> tuple[list[str], list[str], list[str]]:
    """List what speaks against a smooth run in findings and results.

    Returns
    -------
    against : list of str
        At speeds of operation, or at speeds that nothing tells.
    passed, beyond : lists of str
        On a branch or a run-up up to the highest speed of operation and beyond it, with the range of speeds.
    """
    doubted = [finding for finding in results.findings if finding.severity != NOTE]
    against, passed, beyond = dict[str, None](), list[str](), list[str]()
    ordered = sorted(stages, key=lambda stage: stage in _SPEEDS_OF)
    for stage in ordered:
        data, axis = results[stage], _SPEEDS_OF.get(stage, "")
        located = axis in data
        of_all = stage == ordered[0]  # findings of the case and of stages without motion count once
        codes = {f.code for f in doubted if f.stage == stage or (of_all and f.stage not in (*stages, *_SPEEDS_OF))}
        troubles = dict(_troubles(data, codes, data[axis].dims[0] if located else ""))
        highest = _highest_speed(results, axis)
        if not located or not math.isfinite(highest):
            where = "in the motion in time " if stage == "transient" else ""
            against |= dict.fromkeys(f"{where}{words}" for words in troubles if words not in against)
            continue
        outside = np.abs(data[axis].values) > highest * (1.0 + 1e-9)
        for part, texts in ((~outside, passed), (outside, beyond)):
            new = {words: at & part for words, at in troubles.items() if words not in against and (at & part).any()}
            if new:
                doubt = f" ({doubt_words([CATALOGUE['W-TAIL'].words])})" if "W-TAIL" in codes else ""
                texts.append(f"{_span(data, stage, np.logical_or.reduce([*new.values()]))} {' and '.join(new)}{doubt}")
    return list(against), passed, beyond


def _troubles(data: Any, codes: set[str], axis: str) -> Iterator[tuple[str, np.ndarray]]:
    """Name what a stage has against a smooth run, and where along an axis; everywhere if only a finding tells."""

    def where(name: str, wrong: Callable[[Any], Any]) -> np.ndarray:
        if name not in data:
            return np.zeros(data.sizes.get(axis, 1), bool)
        at = wrong(data[name])
        return np.atleast_1d(at.any([of_axis for of_axis in at.dims if of_axis != axis]).values)

    parted = where("drive_contact", lambda share: share < 1.0)
    if codes & {"W-PULL", "W-SEPARATION"} and not parted.any():
        pulled = where("lowest_force", lambda force: force < 0.0)
        parted = pulled if pulled.any() else ~parted
    unstable = where("stable", lambda stable: stable == 0)
    if codes & {"W-UNSTABLE", "W-GROWTH"} and not unstable.any():
        unstable = ~unstable
    back = where("back_contact", lambda share: share > 0.0)
    for words, at in (
        ("teeth part", parted),
        ("teeth press on their back flanks", back),
        ("motions are not stable", unstable),
    ):
        if at.any():
            yield words, at


def _highest_speed(results: Any, name: str) -> float:
    """Find the highest speed of operation in the unit of a variable; infinite where no stage has it."""
    of_stages = [results[stage] for stage in ("dynamics", "response") if stage in results.stages]
    speeds = [float(np.abs(data[name].values).max()) for data in of_stages if name in data]
    return max(speeds, default=math.inf)


def _span(data: Any, stage: str, at: np.ndarray) -> str:
    """Write the range of the marked points (n,) of a branch or a run-up."""

    def between(values: np.ndarray, form: str) -> str:
        ends = dict.fromkeys(f"{value:{form}}" for value in (values[at].min(), values[at].max()))
        return " to ".join(ends)

    if stage == "branch":
        hertz = between(data["weight_frequency"].values, ",.3g")
        speeds = between(np.abs(data["carrier_speed"].values) / RPM, ",.4g")
        text = f"{hertz} Hz of the weight ({speeds} rpm of the carrier)"
    else:
        text = f"{between(np.abs(data['speed'].values), ',.4g')} rpm of the run-up"
    return f"{'from' if ' to ' in text else 'at'} {text}"


_SPEEDS_OF = {"branch": "carrier_speed", "runup": "speed"}
"""Stages that go beyond the speeds of operation, and their variables of these speeds."""
_FEW_HARMONICS = "mesh forces may change: too few harmonics or side bands were taken"
"""Of a run whose forces a longer excitation would change."""
VOICES = (("a relaxed", 54.0), ("a normal", 60.0), ("a raised", 66.0), ("a loud", 72.0), ("a very loud", 78.0))
"""Voices and their sound pressure levels 1 m before the mouth [dB(A)], the vocal efforts of ISO 9921:2003, annex A."""
_STEP_OF_VOICES = 6.0
"""From one voice to the next [dB]."""
CLEAR = "no resonance makes the level at a speed of operation"
"""Of a level whose resonances were looked at."""
MAKES_LEVEL = 0.5
"""Share of the level from which on one resonance makes it."""
NEAR_RESONANCE = 10.0
"""Distance up to which a resonance counts at a speed of operation [%]."""


def voice_words(level: float) -> str:
    """Compare a sound pressure level [dB(A)] with the voice that is as loud, by `VOICES`; beyond them with the last."""
    (quietest, lowest), (loudest, highest) = VOICES[0], VOICES[-1]
    if level < lowest - 0.5 * _STEP_OF_VOICES:
        return f"quieter than {quietest} voice 1 m away"
    if level > highest + 0.5 * _STEP_OF_VOICES:
        return f"louder than {loudest} voice 1 m away"
    voice, _ = min(VOICES, key=lambda of_voice: abs(level - of_voice[1]))
    return f"as loud as {voice} voice 1 m away"


@dataclass(frozen=True)
class LevelMargin:
    """Where a level comes nearest to its limit, or is farthest beyond it.

    Parameters
    ----------
    decibels : float
        Level over limit; negative where it holds.
    speed : float
        [rpm]
    place : str
        Sensor or microphone, and by which excitation where it is not that of the case.
    """

    decibels: float
    speed: float
    place: str

    @property
    def words(self) -> str:
        """The margin in words."""
        side = "over" if self.decibels > 0.0 else "below"
        return f"{abs(self.decibels):.1f} dB {side} the limit of the case at {self.place}, {self.speed:,.4g} rpm"


def margins_of_levels(
    speed: np.ndarray, decibels: np.ndarray, place: str, change: np.ndarray | float = np.nan
) -> Iterator[LevelMargin]:
    """Find the worst of levels (n,) over their limits [dB] at speeds (n,) [rpm], and the worst that may be higher.

    ``change`` (n,) [dB] is what a longer excitation makes of the levels, NaN where it is not known.
    """
    at = int(np.argmax(decibels))
    yield LevelMargin(float(decibels[at]), float(speed[at]), place)
    change = np.nan_to_num(np.broadcast_to(change, decibels.shape), posinf=0.0, neginf=0.0)
    raised = np.where(change > _RAISED, decibels + change, -np.inf)
    at = int(np.argmax(raised))
    if np.isfinite(raised[at]):
        yield LevelMargin(float(raised[at]), float(speed[at]), f"{place} with a longer excitation")


def resonance_of_line(line: str, hertz: float, modes: np.ndarray, share: float) -> str:
    """Write the resonance that makes the level by its main line; empty where none does.

    Parameters
    ----------
    line : str
        The main line at the speed of operation, with its frequency.
    hertz : float
        Its frequency [Hz].
    modes : (m,) array
        Natural frequencies [Hz]; those at zero are no resonances.
    share : float
        Share of the line in the power of the level, the square of that in the level.
    """
    distance = np.where(modes > 0.0, 100.0 * (hertz / np.where(modes > 0.0, modes, 1.0) - 1.0), np.inf)
    if not distance.size or share < MAKES_LEVEL**2:
        return ""
    mode = int(np.abs(distance).argmin())
    if abs(distance[mode]) > NEAR_RESONANCE:
        return ""
    side = "below" if distance[mode] < 0.0 else "above"
    apart = f"{abs(distance[mode]):.1f} % {side} mode {mode + 1} at {modes[mode]:,.0f} Hz"
    return f"{line}, {apart}, makes {percent(share)} of the power"


def judge_noise(
    answer: str,
    sentence: str,
    resonance: str = "",
    open_words: str = "",
    margins: Sequence[LevelMargin] = (),
    doubts: str = "",
    rests_on: str = "",
    *,
    computed: bool = True,
) -> Judgement:
    """Judge how loud it is: by the limits of the case, else by resonances at speeds of operation.

    Parameters
    ----------
    answer : str
        Levels, in figures.
    sentence : str
        Where it is loudest, and by what.
    resonance : str
        The resonance that makes the level at a speed of operation, empty where there is none.
    open_words : str
        What to say where there is neither a limit nor a resonance: which entry gives a limit.
    margins : sequence of LevelMargin
        Of the levels that have a limit.
    doubts : str
        Doubts of the levels, in words: such levels deserve a look, below a limit and without one.
    rests_on : str
        What they rest on that is estimated, in words.
    computed : bool
        Whether there is a level; ``open_words`` say what gives one where there is none.
    """

    def doubted(*limit: str) -> str:
        return "; ".join(filter(None, (*limit, doubts, rests_on)))

    if not computed:
        return Judgement(QUIET, "absent", answer, open_words, sentence)
    if margins:
        worst = max(margins, key=lambda margin: margin.decibels)
        if worst.decibels > 0.0:
            return Judgement(QUIET, "bad", answer, doubted(worst.words), f"{sentence}. Too loud: {worst.words}")
        state: State = "look" if resonance or doubts else "good"
        return Judgement(QUIET, state, answer, doubted(resonance, worst.words), sentence)
    return Judgement(
        QUIET, "look" if resonance or doubts else "open", answer, doubted(resonance or open_words), sentence
    )


def no_limit_words(entry: str, resonances_known: bool) -> str:
    """Say that a level has no limit, which entry gives one, and that no resonance makes it where they are known."""
    clear = f"{CLEAR}; " if resonances_known else ""
    return f"{clear}no limit: give {entry}"


def _doubts_by_code(doubts: Sequence[Finding]) -> str:
    """Name doubts by their codes, with how many have the same: ``"too few harmonics (W-TAIL) twice"``."""
    numbers = Counter(finding.code for finding in doubts if finding.code)
    times = {1: "", 2: " twice"}
    words = [f"{in_words(code)}{times.get(number, f' {number} times')}" for code, number in numbers.items()]
    more = f" and {len(words) - MOST_DOUBTS} more" if len(words) > MOST_DOUBTS else ""
    return f"{', '.join(words[:MOST_DOUBTS])}{more}"


def judge_numbers(findings: Sequence[Finding], complete: bool) -> Judgement:
    """Judge the numbers by the doubts of the run, and whether it ended.

    Faults are of the gears, not of numbers, but those whose code is else a doubt: numbers far beyond their model.
    """
    doubts = [finding for finding in findings if finding.severity == DOUBT]
    beyond = [f for f in findings if f.severity == FAULT and f.code and CATALOGUE[f.code].severity == DOUBT]
    if not complete:
        return Judgement(SURE, "bad", "the run did not come to its end", "", "The run did not come to its end")
    if beyond:
        words = ", ".join(map(in_words, dict.fromkeys(finding.code for finding in beyond)))
        return Judgement(SURE, "bad", "numbers are far beyond their model", words, f"Numbers hold nothing: {words}")
    if doubts:
        limit = "; ".join(filter(None, (_doubts_by_code(doubts), estimates_words(findings))))
        return Judgement(SURE, "look", counted(doubts), limit)
    limit = "; ".join(filter(None, ("solutions converged, samples resolve them", estimates_words(findings))))
    return Judgement(SURE, "good", "no doubt was raised", limit)
