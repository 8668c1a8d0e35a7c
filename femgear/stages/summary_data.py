"""A case and a run as data for machines: answers of page one, findings, key figures; what ``--json`` prints.

`SCHEMA` is the JSON schema of both. Numbers are in SI units beside the text that tables show.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import Any, get_args

from femgear.errors import FemgearError
from femgear.findings import Finding, as_data, by_severity
from femgear.stages.judgements import Judgement, State
from femgear.stages.protocol import Train

VERSION = 1
"""Of the form of the data: it grows when a name goes or changes its meaning."""
_TEXT = {"type": "string"}
_LIST = {"type": "array", "items": _TEXT}


def _object(**properties: Mapping[str, Any]) -> dict[str, Any]:
    return {"type": "object", "properties": properties, "required": list(properties), "additionalProperties": False}


_FINDING = _object(**{field.name: _TEXT for field in fields(Finding)})
_JUDGEMENT = _object(**{field.name: _TEXT for field in fields(Judgement)} | {"state": {"enum": list(get_args(State))}})
_FIGURE = _object(name=_TEXT, value={"type": ["number", "null"]}, unit=_TEXT, shown=_TEXT)
SCHEMA = {
    "$schema": "https://json-schema.org/draft/2020-12/schema",
    "title": "what femgear run --json and femgear report --json print",
    **_object(
        version={"const": VERSION},
        title=_TEXT,
        kind=_TEXT,
        complete={"type": "boolean"},
        stages=_LIST,
        duty=_TEXT,
        sentence=_TEXT,
        judgements={"type": "array", "items": _JUDGEMENT},
        findings={"type": "array", "items": _FINDING},
        key_figures={"type": "array", "items": _FIGURE},
        folder=_TEXT,
        files=_LIST,
    ),
}
"""JSON schema of the data of a run."""
CHECK_SCHEMA = {
    "$schema": "https://json-schema.org/draft/2020-12/schema",
    "title": "what femgear check --json prints",
    **_object(
        version={"const": VERSION},
        title=_TEXT,
        kind=_TEXT,
        accepted={"type": "boolean"},
        refusal=_TEXT,
        findings={"type": "array", "items": _FINDING},
    ),
}
"""JSON schema of the data of a checked case."""


def run_data(train: Train, results: Any) -> dict[str, Any]:
    """Collect what decides about a run, by `SCHEMA`."""
    sentence, judgements = train.summary(results)
    figures = [figure for figure in train.key_figures(results.case) if figure.stage in results.stages]
    values = [figure.read(results[figure.stage]) for figure in figures]
    return {
        "version": VERSION,
        "title": results.case.title,
        "kind": train.name,
        "complete": results.manifest.complete,
        "stages": list(results.stages),
        "duty": train.duty(results.case),
        "sentence": sentence,
        "judgements": [asdict(judgement) for judgement in judgements],
        "findings": as_data(by_severity(results.findings)),
        "key_figures": [
            {
                "name": figure.name,
                "value": value if math.isfinite(value) else None,
                "unit": figure.dimension.si,
                "shown": f"{figure.show(value)} {figure.dimension.shown}".removesuffix(" 1"),
            }
            for figure, value in zip(figures, values, strict=True)
        ],
        "folder": str(results.folder),
        "files": sorted(results.manifest.files),
    }


def check_data(train: Train | None, case: Any, refusal: FemgearError | None) -> dict[str, Any]:
    """Collect what is said of a case before it is run, by `CHECK_SCHEMA`; without train one that cannot be read."""
    return {
        "version": VERSION,
        "title": "" if train is None else case.title,
        "kind": "" if train is None else train.name,
        "accepted": refusal is None,
        "refusal": "" if refusal is None else str(refusal),
        "findings": [] if train is None else as_data(by_severity(train.case_warnings(case))),
    }
