"""From pydantic's validation errors to femgear's, with the nearest valid key and the line of the file."""

from __future__ import annotations

import difflib

from pydantic import BaseModel, ValidationError

from femgear.casefile import tomlfile
from femgear.casefile.fields import described
from femgear.errors import CaseError


def translate(error: ValidationError, model: type[BaseModel], prefix: str = "") -> list[CaseError]:
    """One `CaseError` for each mistake that pydantic found.

    Parameters
    ----------
    error : ValidationError
    model : type
        The model that was validated; its field names are the valid keys.
    prefix : str
        Dotted key of the table that was validated.

    Returns
    -------
    list of CaseError
        With code, key, value, limit and remedy.
    """
    problems = []
    for item in error.errors(include_url=False):
        key = _dotted(item["loc"], prefix)
        nested = item.get("ctx", {}).get("error")
        if isinstance(nested, ValidationError):
            problems += translate(nested, model, key)
        else:
            problems.append(_problem(item, key, model))
    return problems


def combine(problems: list[CaseError], text: str, name: str) -> CaseError:
    """One error that lists all; its ``problems`` holds them one by one.

    Parameters
    ----------
    problems : list of CaseError
        At least one.
    text : str
        The file, for line numbers; empty where the text is not the user's.
    name : str
        Its name.
    """
    for problem in problems:
        line = tomlfile.line_of(text, problem.key) if problem.key and name else None
        problem.file = f"{name}:{line}" if line else name
    if len(problems) == 1:
        combined = problems[0]
    else:
        listed = "\n".join(str(problem) for problem in problems)
        combined = CaseError(f"{len(problems)} problems\n{listed}", file=name)
        combined.code = problems[0].code if len({p.code for p in problems}) == 1 else "E-CASE"
    combined.problems = tuple(problems)
    return combined


def _problem(item: dict, key: str, model: type[BaseModel]) -> CaseError:
    kind, context, value = item["type"], item.get("ctx", {}), item.get("input")
    if kind.startswith("E-"):
        return CaseError(
            context["message"],
            code=kind,
            key=key,
            value=context["found"],
            limit=context["limit"],
            remedy=context["remedy"],
        )
    if kind == "missing":
        section = _section(model, item["loc"])
        remedy = f"add it: {_description(model, item['loc'])}".removesuffix(": ")
        if section is not None:
            needed = [name for name, field in section.model_fields.items() if field.is_required()]
            remedy = f"add the section with {', '.join(needed)}"
        return CaseError("missing", code="E-KEY-MISSING", key=key, remedy=remedy)
    if kind == "extra_forbidden":
        return _unknown_key(item["loc"], key, model)
    if kind == "literal_error":
        return CaseError(
            "not one of the choices", code="E-CHOICE", key=key, value=value, limit=context["expected"]
        )
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        message = f"a table is needed, not {described(value)}"
        section = f"[[{key.partition('[')[0]}]]" if key.endswith("]") else f"[{key}]"
        return CaseError(message, code="E-TYPE", key=key, value=value, remedy=f"write the section {section}")
    if kind in ("tuple_type", "list_type"):
        return CaseError(f"a list is needed, not {described(value)}", code="E-TYPE", key=key, value=value)
    if kind in ("bool_type", "string_type"):
        wanted = "true or false" if kind == "bool_type" else "a text"
        message = f"{wanted} is needed, not {described(value)}"
        return CaseError(message, code="E-TYPE", key=key, value=value)
    if kind == "too_long":
        message = f"{context['actual_length']} entries are too many"
        return CaseError(message, code="E-RANGE", key=key, limit=f"at most {context['max_length']}")
    if kind == "too_short":
        message = f"{context['actual_length']} entries are too few"
        return CaseError(message, code="E-RANGE", key=key, limit=f"{context['min_length']} or more")
    return CaseError(f"not what is needed here: {item['msg'].lower()}", key=key, value=value)


def _unknown_key(location: tuple, key: str, model: type[BaseModel]) -> CaseError:
    """Refusal of a key that nobody reads, with where it may belong."""
    parent = _section(model, location[:-1])
    valid = _keys(parent) if parent else []
    last = str(location[-1])
    near = difflib.get_close_matches(last, valid, n=1, cutoff=0.6)
    homes = [name for name in model.model_fields if last in _keys(_section(model, (name,)))]
    if near:
        remedy = f"did you mean {near[0]}?"
    elif homes:
        remedy = f"{last} belongs in [{'] or ['.join(homes)}]"
    else:
        remedy = None
    return CaseError(
        "unknown key", code="E-KEY-UNKNOWN", key=key, limit=", ".join(valid) or None, remedy=remedy
    )


def _description(model: type[BaseModel], location: tuple) -> str:
    """What the schema says about the entry."""
    section = _section(model, location[:-1]) or model
    schema = section.model_json_schema()["properties"].get(str(location[-1]), {})
    choices = " or ".join(str(choice) for choice in schema.get("enum", ()))
    return schema.get("description") or choices or schema.get("type", "")


def _keys(section: type[BaseModel] | None) -> list[str]:
    return [field.alias or name for name, field in section.model_fields.items()] if section else []


def _section(model: type[BaseModel], location: tuple) -> type[BaseModel] | None:
    """Model of the table at ``location``, None where that is no table."""
    current: type[BaseModel] | None = model
    for part in location:
        if isinstance(part, int):
            continue
        field = current.model_fields.get(str(part)) if current else None
        candidates = (field.annotation, *getattr(field.annotation, "__args__", ())) if field else ()
        current = next((c for c in candidates if isinstance(c, type) and issubclass(c, BaseModel)), None)
    return current


def _dotted(location: tuple, prefix: str) -> str:
    key = prefix
    for part in location:
        if isinstance(part, int):
            key += f"[{part}]"
        else:
            key += ("." if key else "") + tomlfile.printable(part)
    return key
