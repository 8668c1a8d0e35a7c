"""Case files of what a REXS file holds: of every stage, and of the chain that parallel stages make."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from femgear.case import text as case_text
from femgear.errors import CaseError, FemgearError
from femgear.exchange.cylindrical_stage import pair_tables
from femgear.exchange.gear_unit import stage_components, stage_in_words
from femgear.exchange.planetary_stage import case_tables, named
from femgear.exchange.rexs import Component, Model
from femgear.exchange.shaft_chain import NoChain, chain_tables
from femgear.findings import NOTE
from femgear.trains.drafts import draft_text

_READ = ("planetary_stage", "cylindrical_stage")


@dataclass(frozen=True)
class CaseDraft:
    """Text of a case, with what stands behind the name of the file, and what it is in words."""

    suffix: str
    text: str
    words: str


def case_drafts(
    model: Model, stem: str, *, stage: str | None = None, load_case: int | None = None
) -> list[CaseDraft]:
    """Write the cases of the stages of a REXS file; `Model.findings` holds what they have not.

    Of one stage there is one case. Of several each has its own, called by its id; the one without is the
    drivetrain of parallel stages, whose meshes have the stiffness of these, or the planetary stage where
    there is one.

    Parameters
    ----------
    stem : str
        Of the names of the files, for the drivetrain to name those of its stages.
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
    planetary = [one for one in stages if one.type == "planetary_stage"]
    if stage is not None:
        chosen = [one for one in stages if one.id == stage]
        if not chosen:
            raise CaseError(
                "no such stage", code="E-CHOICE", key="--stage", value=stage, file=model.name,
                limit=", ".join(stage_in_words(model, one) for one in stages[:20]) or "none in the file",
                remedy="choose one by its id",
            )  # fmt: skip
        left = [stage_in_words(model, one) for one in stages if one.id != stage]
        if left:
            model.remark("--stage", f"stages that are not taken: {_listed(left)}", first=True)
        stages = chosen
    if not [one for one in stages if one.type in _READ] or stages == planetary == stages[:1]:
        # a file without a stage is refused as one without a planetary stage
        return [CaseDraft("", _text(model, *case_tables(model, stage, load_case), stage), "the stage")]
    found: dict[str, tuple[dict, dict]] = {}
    texts: dict[str, str] = {}
    refusals: list[FemgearError] = []
    for one in stages:
        try:
            found[one.id] = _stage_tables(model, one, load_case)
            texts[one.id] = _text(model, *found[one.id], one.id)
        except FemgearError as error:
            if error.key == "--load-case" or len(stages) == 1:
                raise
            refusals.append(error)
            found.pop(one.id, None)
            model.remark(one.id, f"{stage_in_words(model, one)} is not taken: {error.message}", first=True)
    if not texts:
        raise refusals[0]
    return list(_drafts(model, stem, stages, found, texts, load_case))


def _stage_tables(model: Model, stage: Component, load_case: int | None) -> tuple[dict, dict]:
    if stage.type == "planetary_stage":
        return case_tables(model, stage.id, load_case)
    if stage.type != "cylindrical_stage":
        model.refuse(f"femgear has no {stage.type.replace('_', ' ')}", str(stage), limit=" or ".join(_READ))
    return pair_tables(model, stage, load_case)


def _text(model: Model, tables: dict, remarks: dict, stage: str | None) -> str:
    head = [f"Written by femgear import (REXS {model.version}). What is assumed says so."]
    with named(model, stage):
        return draft_text(tables, remarks, word="assumed", head=head)


def _drafts(model: Model, stem: str, stages, found, texts, load_case: int | None) -> Iterator[CaseDraft]:
    """The case without an id in its name, then those of the stages."""
    if len(stages) == 1:
        yield CaseDraft("", texts[stages[0].id], stage_in_words(model, stages[0]))
        return
    planetary = [one for one in stages if one.type == "planetary_stage" and one.id in texts]
    try:
        files = {id: f"{stem}_{id}.toml" for id in texts}
        pairs = {id: tables for id, (tables, _) in found.items() if tables.get("model") == "pair"}
        tables, remarks = chain_tables(model, pairs, files, load_case)
        head = [f"Written by femgear import (REXS {model.version}). What is assumed says so."]
        lines = [f"# {one}" for one in head]
        yield CaseDraft("", "\n".join([*lines, case_text.write(tables, remarks)]), "drivetrain of all stages")
    except NoChain as error:
        whole = f"no drivetrain of all stages is written: {error}"
        model.remark(
            "", f"{whole}; each stage is a case of its own", severity=NOTE if not planetary else "doubt"
        )
        if len(planetary) == 1:
            yield CaseDraft("", texts[planetary[0].id], stage_in_words(model, planetary[0]))
    for one in stages:
        if one.id in texts and not (one in planetary and len(planetary) == 1):
            yield CaseDraft(f"_{one.id}", texts[one.id], stage_in_words(model, one))


def _listed(words: list[str]) -> str:
    return "; ".join(words[:20]) + " ..." * (len(words) > 20)
