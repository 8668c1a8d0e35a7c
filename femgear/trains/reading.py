"""Case files and results of every train: reading, changing entries, the schema of the file.

`femgear.case` holds the sections of a planetary set and their checks. Here the registry decides which train
reads a file: one that claims it with a case file of its own, one whose section the file has, or the train of
sets without such a section.
"""

from __future__ import annotations

import copy
import os
import re
from collections.abc import Callable, Mapping
from functools import cache
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError, create_model

from femgear.case import text as case_text
from femgear.case.checks import cross_check, without_uncomputed
from femgear.case.csv_columns import embed_checksum, embed_measured_lines, embed_profiles
from femgear.case.estimates import with_estimates
from femgear.case.gear_set import check_shafts
from femgear.case.messages import added_material, combine, no_such, notices, translate
from femgear.case.planetary import Case
from femgear.case.sections import FORMAT
from femgear.case.text import described, text_with_points
from femgear.errors import CaseError
from femgear.findings import Finding
from femgear.moved import former_keywords
from femgear.storage.results import Results, results_of
from femgear.trains import registry

if TYPE_CHECKING:
    import xarray as xr

_MOST_UNREAD = 20
"""Files of a case that are refused at once."""
_MOST_JUDGED = 100
"""Entries that are refused beside which the others are judged, too."""
_MOST_LEVELS = 4
"""Tables around a refused entry that are left out to judge the others."""
_REXS = (".rexs", ".rexsj", ".rexsz")


def read_case(source: str | os.PathLike | Mapping[str, Any]) -> Any:
    """Read the case of a TOML file: a planetary set, or what its ``model`` names, as ``"gearbox"``.

    Parameters
    ----------
    source : path-like, str or mapping
        A regular UTF-8 file of at most 1 MB. A text of several lines is the TOML text itself, a mapping its
        tables, ``{"set": {"planets": 3, "face_width": "25 mm"}, ...}``.

    Returns
    -------
    Case
        Of its train: checked, frozen, in SI units and radians.

    Raises
    ------
    CaseError
        Everything that is wrong with the file, at once; ``problems`` holds one `CaseError` for each.
    """
    if isinstance(source, Mapping):
        return parse_case(case_text.write(dict(source)), numbered=False)
    if isinstance(source, str) and "\n" in source:
        return parse_case(source)
    if not isinstance(source, str | os.PathLike):
        limit = "the path of a case file, its text or its tables"
        raise CaseError(f"a case is read from no {type(source).__name__}", code="E-TYPE", limit=limit)
    if os.path.splitext(name := os.fsdecode(source))[1].lower() in _REXS:
        remedy = f"femgear import {name} writes cases of its gears"
        raise CaseError("a REXS file is no case", code="E-FILE", file=name, limit="a TOML file", remedy=remedy)
    return parse_case(case_text.read_text(source), name=name)


def parse_case(text: str, *, name: str = "", numbered: bool = True) -> Any:
    """Read the case of a TOML text; see `read_case`.

    Messages give the name of the file and, of a ``numbered`` text, which is the user's, its lines.
    """
    data, lines = case_text.parse(text, name), text if numbered else ""
    former: tuple[Finding, ...] = ()
    if isinstance(model := data.get("model"), str) and model in registry.FORMER:
        data, former = _of_former_train(data, model, lines, name)
        text, lines = case_text.write(data), ""
    try:
        train = _train_of_file(data)
    except CaseError as error:
        raise combine([error], lines, name) from None
    file, of_set = train.file, train.key != "model"
    files, unread = _embedded_files(_embed_of_set if of_set else file.embed, data, name)
    case_text.check_tree(data, name)
    try:
        case = file.model.model_validate(data)
    except ValidationError as error:
        keys = every_section() if of_set else file.model
        # tables whose files cannot be read have no points
        tables = {(problem.key or "").rpartition(".")[0] for problem in unread}
        problems = [problem for problem in translate(error, keys) if problem.key not in tables]
        many = error.error_count() > _MOST_JUDGED
        problems += [] if unread or many else _beside_refused(file, data, error)
        raise combine([*unread, *problems], lines, name, error.error_count()) from None
    if unread:
        raise combine(unread, lines, name)
    if files:
        text = text_with_points(data, name)
    try:
        problems = [*(cross_check(case, file.cross_check(case)) if of_set else file.cross_check(case))]
    except CaseError as error:
        problems = [error]
    if problems:
        raise combine(problems, lines, name)
    case_notices = (*former, *file.notices(data, case))
    case_notices = (*notices(data, case), *case_notices, *added_material(case)) if of_set else case_notices
    case.read_from(text, lines, name, notices=case_notices, profile_files=files)
    if hasattr(case, "gear_names"):
        if of_set:
            check_shafts(case)
        case, estimated = with_estimates(case)
        case._notices += estimated
    return case


def _of_former_train(data: dict, model: str, lines: str, name: str) -> tuple[dict, tuple[Finding, ...]]:
    """Tables of today that say what those of a train do that is no more, and what is to be said of it."""
    section, tables_of, *embed = (resolve_name(place) for place in registry.FORMER[model])
    for put_in in embed:
        _, unread = _embedded_files(put_in, data, name)
        if unread:
            raise combine(unread, lines, name)
    case_text.check_tree(data, name)
    try:
        tables, unlike = tables_of(section.model_validate(data))
        text = f"the file of the former model {model} is read as a {tables['model']}, whose entries have other names"
        remedy = "femgear gearbox FILE writes it with the entries of today, which all other warnings name"
        return tables, (Finding("W-FORMER", "model", text, remedy=remedy), *unlike)
    except ValidationError as error:
        raise combine(translate(error, section), lines, name, error.error_count()) from None
    except CaseError as error:
        problems = [problem for problem in error.problems if isinstance(problem, CaseError)]
        raise combine(problems, lines, name) from None


def _beside_refused(file: case_text.CaseFile, data: dict, error: ValidationError) -> list[CaseError]:
    """What can be judged of the other entries of a case some of whose entries are refused."""
    tables, touched = copy.deepcopy(data), list[str]()
    for _ in range(_MOST_LEVELS):
        details = error.errors(include_url=False)
        inside = {detail["loc"][:length] for detail in details for length in range(len(detail["loc"]))}
        for detail in details:
            if detail["type"] == "too_short" and detail["loc"] in inside:
                continue  # for the refused ones of its entries
            # a list of values is left out with a wrong one, a table with an entry that is missing
            path = list(detail["loc"][:-1] if detail["type"] == "missing" else detail["loc"])
            while path and isinstance(path[-1], int):
                path.pop()
            if len(path) < 2 or not _left_out(tables, path):
                return []
            touched.append(case_text.dotted(tuple(path[:2] if isinstance(path[1], int) else path[:-1])))
        try:
            case = file.model.model_validate(tables)
        except ValidationError as further:
            error = further
            continue
        try:
            return [*file.beside_refused(case, touched)]
        except CaseError as refused:
            return [refused]
    return []


def _left_out(tables: Any, path: list[str | int]) -> bool:
    """Leave an entry out of tables; whether it is not there then."""
    for part in path[:-1]:
        if isinstance(tables, dict) and part in tables:
            tables = tables[part]
        elif isinstance(tables, list) and isinstance(part, int) and part < len(tables):
            tables = tables[part]
        else:
            return False
    if isinstance(tables, dict):
        tables.pop(path[-1], None)
    return isinstance(tables, dict)


def _embed_of_set(data: dict, name: str) -> dict[str, str]:
    """Files of a planetary set: points of profiles, measured lines, checksums of a casing are put into the tables."""
    return embed_profiles(data, name) | embed_measured_lines(data, name) | embed_checksum(data, name)


def _embedded_files(embed: Callable, data: dict, name: str) -> tuple[dict[str, str], list[CaseError]]:
    """Files whose points are put into the tables of a case, and the refusals of others."""
    unread: dict[str | None, CaseError] = {}
    while True:
        try:
            return embed(data, name), list(unread.values())
        except CaseError as error:
            # a refused file is not read again
            if error.key in unread or len(unread) == _MOST_UNREAD:
                raise
            unread[error.key] = error


@former_keywords(known="datasets")
def open_results(
    folder: str | os.PathLike, *, partial: bool = True, datasets: Mapping[str, xr.Dataset] | None = None
) -> Results:
    """Open the results of a run; of an interrupted one those stages that are complete, with a warning.

    Parameters
    ----------
    folder : path-like
        That a run wrote.
    partial : bool
        Accept the results of an interrupted run.
    datasets : mapping of str to Dataset, optional
        Contents of files that need not be read, by stage.

    Returns
    -------
    Results
        ``results.modes`` or ``results["modes"]`` is the dataset of a stage.

    Raises
    ------
    StorageError
        No folder, no manifest, a broken one or one of a newer femgear. ``E-RESULTS-INCOMPLETE``: an
        interrupted run and not ``partial``.
    """
    return results_of(folder, read_case, partial=partial).with_known(datasets or {})


def with_value(case: Case, key: str, value: object) -> Case:
    """Change one entry of a case, which is checked again as a whole; see `with_values`.

    Parameters
    ----------
    case : Case
        From `read_case`; it stays as it is.
    key : str
        Dotted key such as ``"operation.torque"``, with a number for one of a list, as in
        ``"sun.modifications[0].amount"`` and ``"shaft[0].axis[1]"``.
    value : object
        As the file would hold it: ``"50 N m"``, 0.3, 27, a list or table of such; None leaves the entry out.
    """
    return with_values(case, {key: value})


def parse_comparable(text: str, *, name: str = "") -> Any:
    """Read the case of a TOML text without the published and measured lines that it does not compute, as `parse_case`.

    ``notices`` of the case says what was left out.
    """
    try:
        return parse_case(text, name=name)
    except CaseError as error:
        data = case_text.parse(text, name)
        if not (notice := without_uncomputed(data, error)):
            raise
        case = parse_case(case_text.write(data), name=name, numbered=False)
        case._notices += (notice,)
        return case


def with_values(case: Case, values: Mapping[str, object]) -> Case:
    """Change several entries of a case, which is checked as a whole after all changes.

    Published lines whose speed or harmonic is not computed any more are left out; ``notices`` says so.

    Parameters
    ----------
    case : Case
        From `read_case`; it stays as it is.
    values : mapping
        Keys and values as of `with_value`, as in
        ``{"operation.input": "carrier", "operation.fixed": "ring"}``.

    Raises
    ------
    CaseError
        As `read_case`; unknown keys are refused with the nearest valid one.
    """
    data, problems = case_text.parse(case.source, case.name), list[CaseError]()
    for key, value in values.items():
        try:
            _change(data, key, value, case.name)
        except CaseError as error:
            problems.append(error)
    if problems:
        raise combine(problems, "", case.name)
    try:
        text = case_text.write(data)
    except CaseError as error:
        error.key, error.file = ", ".join(values), case.name or None
        raise
    case_notices: tuple[Finding, ...] = ()
    try:
        changed = parse_case(text, name=case.name, numbered=False)
    except CaseError as error:
        published = any(key.startswith("housing") for key in values)
        if published or not (notice := without_uncomputed(data, error)):
            raise
        case_notices, text = (notice,), case_text.write(data)
        changed = parse_case(text, name=case.name, numbered=False)
    changed._notices += case_notices
    changed._profile_files = {
        k: file
        for k, file in case.profile_files.items()
        if not any(k.startswith(key) or key.startswith(k) for key in values)
    }
    return changed


def _change(data: dict, key: str, value: object, name: str) -> None:
    """Change one entry of the tables of a case file; None takes it out."""
    if not isinstance(key, str):
        limit = 'keys such as "operation.torque" or "sun.modifications[0].amount"'
        raise CaseError(f"a key is a text, not {described(key)}", code="E-TYPE", value=key, limit=limit)
    parts = re.findall(r"\[\d{1,9}\]|[^.\[\]]+", key) or [key]
    *tables, last = parts
    table: Any = data
    for part, following in zip(tables, parts[1:], strict=True):
        table = _inside(table, part, key, name, wanted=list if following.startswith("[") else dict)
    if last.startswith("[") and _is_value_of(table, int(last[1:-1]), value):
        table[int(last[1:-1])] = value
        return
    if last.startswith("["):
        remedy = "give the whole list, or the key of an entry of one of its tables"
        raise CaseError("a list is changed as a whole", code="E-TYPE", key=key, file=name or None, remedy=remedy)
    if value is None:
        table.pop(last, None)
    else:
        table[last] = value


def _is_value_of(table: Any, number: int, value: object) -> bool:
    """Tell whether a list holds plain values, one of them at a number, and another one can stand there."""
    plain = isinstance(table, list) and not any(isinstance(entry, (dict, list)) for entry in table)
    return plain and number < len(table) and value is not None and not isinstance(value, (dict, list))


def _inside(table: dict | list, part: str, key: str, name: str, *, wanted: type) -> dict | list:
    """Table or list under a part of a key; tables that are not there yet are made."""
    if isinstance(table, list):
        number = int(part[1:-1])
        entry = table[number] if number < len(table) else None
    else:
        entry = table.setdefault(part, {}) if wanted is dict else table.get(part)
    if not isinstance(entry, (dict, list)) or not isinstance(entry, wanted):
        kind = "table" if wanted is dict else "list"
        raise CaseError(
            f"{part} is not a {kind}",
            code="E-TYPE",
            key=key,
            file=name or None,
            limit='keys such as "operation.torque" or "sun.modifications[0].amount"',
            # entries of a list can only be changed where the file has them
            remedy=None if wanted is dict else f"give the case a table [[{key.split('[')[0]}]] for every entry",
        )
    return entry


def to_toml(case: Case) -> str:
    """Write the TOML text that gives this case when read.

    The text of its file as long as nothing was changed and it names no measured profile; the points of such
    profiles are in the text, so that it needs no other file.
    """
    return case.source


def case_schema(model: str | None = None) -> dict[str, Any]:
    """Make the JSON schema of the case file, for editors; of a planetary set, or of files that name a model.

    Raises
    ------
    CaseError
        E-MODEL: no train reads files of this model.
    """
    if model is None:
        return every_section().model_json_schema()
    files = _own_files()
    if model not in files:
        raise CaseError(
            "there is no such model",
            code="E-MODEL",
            key="--model",
            value=model,
            limit=", ".join(files),
            remedy="planetary sets have no model: leave it out",
        )
    return files[model].file.model.model_json_schema()


@cache
def every_section() -> type[Case]:
    """Make the model of a planetary set with the sections of all trains, for its keys and what they are."""
    fields: dict[str, Any] = {
        section.key: (section.file.model.model_fields[section.key].annotation | None, None) for section in _sections()
    }
    return create_model("Case", __base__=Case, __doc__=Case.__doc__, **fields)


def _train_of_file(data: dict) -> registry.Known:
    """Train that the tables of a file are of."""
    version = data.get("format", FORMAT)
    if type(version) is int and version > FORMAT:
        raise CaseError(
            "the file is written for a newer femgear",
            code="E-FORMAT",
            key="format",
            value=case_text.found(version),
            limit=f"up to {FORMAT}",
            remedy="update femgear",
        )
    if "model" in data:
        files, model = _own_files(), data["model"]
        if not isinstance(model, str) or model not in files:
            raise _unknown_model(model)
        return files[model]
    foreign = data.keys() - {*Case.model_fields, *(section.key for section in _sections())}
    for train in [other for other in registry.TRAINS if other.key == "model"] if foreign else ():
        if what := train.file.claims(data):
            raise CaseError(
                f"a file with {what} needs its model",
                code="E-KEY-MISSING",
                key="model",
                remedy=f'write model = "{train.name}" before the first table',
            )
    return _train_of_set(data)


def _own_files() -> dict[str, registry.Known]:
    """Trains with a case file of their own, by the model that the file names."""
    return {train.name: train for train in registry.trains() if train.key == "model"}


def _sections() -> list[registry.Known]:
    """Trains that a section makes of a planetary set."""
    return [train for train in reversed(registry.TRAINS) if train.key not in ("", "model")]


def _unknown_model(value: object) -> CaseError:
    names = tuple(_own_files())
    if not isinstance(value, str):
        message, limit = f"a text is needed, not {described(value)}", ", ".join(names)
        return CaseError(message, code="E-TYPE", key="model", value=value, limit=limit)
    limit = f"{', '.join(names)}; planetary sets have no entry model"
    return no_such("model", "model", value, names, "leave it out", limit=limit)


def _train_of_set(data: dict) -> registry.Known:
    """Train whose section the tables of a planetary set hold; that without one where they hold none."""
    given = [section for section in _sections() if section.key in data]
    if len(given) > 1:
        sections = [section.key for section in given]
        raise CaseError(
            f"a set is {' or '.join(sections)}",
            code="E-CHOICE",
            key=sections[-1],
            value=" and ".join(sections),
            limit="one of the sections",
            remedy="leave one of them out",
        )
    return given[0] if given else next(train for train in registry.TRAINS if not train.key)
