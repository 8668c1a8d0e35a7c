"""Case files of what a REXS file holds: the gearbox of all stages, or every stage by itself."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from femgear.case import text as case_text
from femgear.case.gear_set import need_set, planetary_set
from femgear.case.teeth import flank_form
from femgear.errors import CaseError, FemgearError, GeometryError
from femgear.exchange.cylindrical_stage import pair_tables
from femgear.exchange.gear_unit import UnitFlow, case_flows, plain_ids, stage_components, stage_in_words
from femgear.exchange.gearbox_unit import SEATS, gearbox_tables, has_whole_shafts
from femgear.exchange.planetary_stage import case_tables, named, stage_model
from femgear.exchange.rexs import Component, Model
from femgear.exchange.unit_model import unit_model
from femgear.exchange.unit_shafts import NoGearbox
from femgear.trains.drafts import draft_text
from femgear.trains.reading import parse_case
from femgear.trains.registry import train_of

_READ = ("planetary_stage", "cylindrical_stage")
_NUMBERS = (("found", "value"), ("allowed", "limit"))
MOST_STAGES = 40
"""Of a file from which all are taken."""


@dataclass(frozen=True)
class CaseDraft:
    """Case made from a gear unit, ready to be written.

    ``text`` is that of the case file, ``suffix`` what stands behind the stem of its name, ``words`` say what it is a
    case of.
    """

    suffix: str
    text: str
    words: str


def case_drafts(model: Model, name: str, *, stage: str | None = None, load_case: int | None = None) -> list[CaseDraft]:
    """Write the cases of the stages of a REXS file; `Model.findings` holds what they have not.

    Stages on shafts are one gearbox. Where they make none, or the shafts of an only stage have no sections, each stage
    has its own case, called by its id, and the one without is the planetary stage where there is one.

    Parameters
    ----------
    name : str
        Of the file, such as "case.toml", for the gearbox to name those of its stages.
    stage : str, optional
        Id of the only stage to take.
    load_case : int, optional
        Number of the load case, see `femgear.exchange.planetary_stage.case_tables`.

    Raises
    ------
    CaseError, GeometryError
        What a stage is refused for, where it is the only one; E-CHOICE: no such stage.
    """
    stages = stage_components(model)
    if stage is not None:
        chosen = [component for component in stages if component.id == stage]
        if not chosen:
            raise CaseError(
                "no such stage",
                code="E-CHOICE",
                key="--stage",
                value=stage,
                file=model.name,
                limit=", ".join(stage_in_words(model, component) for component in stages[:20]) or "none in the file",
                remedy="choose one by its id",
            )
        left = [stage_in_words(model, component) for component in stages if component.id != stage]
        if left:
            model.remark("--stage", f"stages that are not taken: {_listed(left)}", first=True)
        stages = chosen
    model.chosen_case(load_case)
    if not [component for component in stages if component.type in _READ]:
        # a file without a stage is refused as one without a planetary stage
        return [CaseDraft("", _text(model, *case_tables(model, stage, load_case), stage), "the stage")]
    if len(stages) > MOST_STAGES:
        limit = f"at most {MOST_STAGES}, or one by --stage"
        model.refuse(f"{len(stages)} stages are too many", "components", "name one by --stage", limit)
    tables_of: dict[str, tuple[dict, dict]] = {}
    texts: dict[str, str] = {}
    refusals: list[FemgearError] = []
    flows = case_flows(model, load_case)
    for component in stages:
        try:
            tables = _stage_tables(model, component, load_case, flows)
            texts[component.id] = _text(model, *tables, component.id)
            tables_of[component.id] = tables
        except FemgearError as error:
            if len(stages) == 1:
                raise
            refusals.append(error)
            # with the attribute of the file that stands in the way
            why = " ".join(str(part) for part in (error.key, error.value) if part is not None)
            text = f"{stage_in_words(model, component)} is not taken: {f'{why}: ' if why else ''}{error.message}"
            model.remark(component.id, text, remedy=error.remedy or "", first=True)
    if not texts:
        raise refusals[0]
    return list(_drafts(model, stages, tables_of, texts, load_case, alone=stage is not None))


def _stage_tables(
    model: Model, stage: Component, load_case: int | None, flows: Sequence[UnitFlow]
) -> tuple[dict, dict]:
    if stage.type == "planetary_stage":
        return case_tables(model, stage.id, load_case)
    if stage.type != "cylindrical_stage":
        model.refuse(f"femgear has no {stage.type.replace('_', ' ')}", str(stage), limit=" or ".join(_READ))
    return pair_tables(model, stage, load_case, flows)


def _text(model: Model, tables: dict, remarks: dict, stage: str | None) -> str:
    """Text of a case; what of modifications lies beside a flank is left out, with a finding."""
    head = [f"Written by femgear import (REXS {model.version}). What is assumed says so."]
    with named(model, stage):
        while True:
            text = draft_text(tables, remarks, word="assumed", head=head)
            case = parse_case(text)
            try:
                for gear in planetary_set(case).gears:
                    for side in ("sun side", "ring side"):
                        flank_form(case, gear, side)
            except GeometryError as error:
                left_out = _shortened(tables, error.key or "")
                if not left_out:
                    raise
                text_left_out = f"{error.message} ({error.value}; {error.limit}): {left_out}"
                model.remark((error.key or "").partition("[")[0], text_left_out)
            else:
                return text


def _shortened(tables: dict, key: str) -> str:
    """Leave out the ends of a modification that may be left out, else all of it; what was done, in words."""
    place = re.fullmatch(r"(\w+)\.modifications\[(\d+)\]", key)
    if place is None:
        return ""
    parts, number = tables[place[1]]["modifications"], int(place[2])
    relief = parts[number]["kind"].endswith("relief")
    ends = [name for name in parts[number] if name.startswith("end_" if relief else ("start_", "end_"))]
    for name in ends:
        del parts[number][name]
    if not ends:
        return f"the {parts.pop(number)['kind']} is not taken"
    return f"the {parts[number]['kind']} is taken to the end of the flank"


def _drafts(model: Model, stages, tables_of, texts, load_case: int | None, *, alone: bool) -> Iterator[CaseDraft]:
    """The case without an id in its name, then those of the stages."""
    planetary = [stage for stage in stages if stage.type == "planetary_stage" and stage.id in texts]
    suffixes = {id: f"_{plain}" for id, plain in plain_ids(texts).items()}
    before = list(model.findings)
    if not alone:
        try:
            text = _gearbox_text(model, tables_of, load_case)
            yield CaseDraft("", text, f"gearbox of {'all stages' if len(stages) > 1 else 'the unit'}")
            return
        except NoGearbox as error:
            model.findings[:] = before + [finding for finding in model.findings if finding.key == SEATS]
            if len(stages) > 1:
                whole = f"no gearbox of all stages is written: {error}"
                model.remark("", f"{whole}; each stage is a case of its own")
    if len(stages) == 1:
        yield CaseDraft("", texts[stages[0].id], stage_in_words(model, stages[0]))
        return
    if len(planetary) == 1:
        yield CaseDraft("", texts[planetary[0].id], stage_in_words(model, planetary[0]))
    for stage in stages:
        if stage.id in texts and not (stage in planetary and len(planetary) == 1):
            yield CaseDraft(suffixes[stage.id], texts[stage.id], stage_in_words(model, stage))


# Keys of findings on supports of single stages and on their load cases, which are those of the gearbox.
_OF_STAGES = re.compile(r"(gear_\d|sun|carrier|ring)\.(bearing|support)_stiffness|(^|: )operation")


def _gearbox_text(model: Model, stages: dict[str, tuple[dict, dict]], load_case: int | None) -> str:
    """Text of the gearbox; NoGearbox where it makes no case, or of a single stage without whole shafts."""
    findings = [finding for finding in model.findings if not _OF_STAGES.search(finding.key)]
    teeth, refused = {id: tables_there for id, (tables_there, _) in stages.items()}, dict[str, str]()
    while True:
        model.findings[:] = findings
        tables, remarks = gearbox_tables(model, teeth, load_case, refused=refused)
        if len(stages) == 1 and not has_whole_shafts(tables):
            raise NoGearbox("the shafts of the only stage have no sections or no bearings")
        try:
            case = parse_case(case_text.write(tables))
            train_of(case).describe_case(case)
            break
        except FemgearError as error:
            wrong = _refused_bearings(tables, error)
            if not wrong or wrong.keys() & refused.keys():
                first = next(iter(error.problems), error)
                more = "".join(f", {word} {value}" for word, name in _NUMBERS if (value := getattr(first, name)))
                raise NoGearbox(f"{first.key}: {first.message}{more}") from error
            refused |= wrong
    for kind, wanted in (("pair", "cylindrical_stage"), ("planetary", "planetary_stage")):
        ids = [stage_component.id for stage_component in stage_components(model) if stage_component.type == wanted]
        for number, id in enumerate(ids):
            remarks |= {f"{kind}[{number}].teeth.{key}": text for key, text in stages[id][1].items()}
    head = f"# Written by femgear import (REXS {model.version}). What is assumed says so."
    return "\n".join([head, case_text.write(tables, remarks)])


def _refused_bearings(tables: dict, error: FemgearError) -> dict[str, str]:
    """Bearings that a case refuses, by their names, and why."""
    refused: dict[str, str] = {}
    for problem in error.problems:
        if place := re.match(r"bearing\[(\d+)\]\.(\w+)$", problem.key or ""):
            value = "" if problem.value is None else f" {problem.value}"
            limit = f", allowed: {problem.limit}" if problem.limit else ""
            refused.setdefault(tables["bearing"][int(place[1])]["name"], f"{place[2]}{value}: {problem.message}{limit}")
    return refused


def _listed(words: list[str]) -> str:
    return "; ".join(words[:20]) + " ..." * (len(words) > 20)


def rexs_model(case: Any, name: str) -> Model:
    """Write a planetary set or a gearbox as a REXS model; `Model.findings` holds what REXS has no form for.

    CaseError: E-MODEL: neither of them. E-KEY-MISSING: a stage of a gearbox without teeth.
    """
    if case.train != "gearbox":
        need_set(case)
        return stage_model(case, name)
    stages = [stage for stage in (*case.pair, *case.planetary) if stage.teeth is not None]
    teeth = {stage.name: parse_case(case_text.write(stage.teeth), numbered=False) for stage in stages}
    return unit_model(case, teeth, name)
