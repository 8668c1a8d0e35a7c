"""REXS files: components with attributes and units, and relations between them.

REXS is FVA's open exchange format of gear units (versions 1.0 to 2.0, www.rexs.info): XML in ``.rexs``, JSON
in ``.rexsj``, either of them zipped in ``.rexsz``. What a file holds is told by its first bytes; one
that is named a zip must be one. Files are not trusted: document types and entities are refused before XML is
parsed, sizes are limited before and while a zip is unpacked and before XML or JSON is parsed, ids and
relations must fit each other.
"""

from __future__ import annotations

import io
import json
import math
import os
import re
import zipfile
import zlib
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from functools import cached_property
from graphlib import CycleError, TopologicalSorter
from typing import NoReturn
from xml.etree import ElementTree

from femgear.case.quantities import Dimension, to_si
from femgear.case.text import decoded, read_bytes
from femgear.errors import CaseError
from femgear.findings import DOUBT, SEVERITIES, Finding

MOST_BYTES = 20_000_000
"""Of a file, and of what a zip holds; those of whole gear units have some hundred kilobytes."""
MOST_CASES = 1000
"""Of load cases."""
MOST_ELEMENTS = 500_000
"""Tags of an XML text, tables of a JSON text; those of whole gear units have some ten thousand."""
MOST_ENTRIES = 1000
"""Of an array that is kept."""
_ENCODINGS = {
    "utf-8": "utf-8-sig",
    "us-ascii": "ascii",
    "iso-8859-1": "latin-1",
    "iso-8859-15": "iso8859-15",
    "windows-1252": "cp1252",
    "utf-16": "utf-16",
    "utf-16le": "utf-16-le",
    "utf-16be": "utf-16-be",
}
"""Codecs of the encodings that are read, by their names in XML."""
_DECLARED = re.compile(rb"<\?xml\s[^>]{0,200}?\bencoding\s*=\s*[\"']([A-Za-z0-9._-]{1,40})[\"']")
_VERSIONS = re.compile(r"(1\.[0-7]|2\.0)(\.\d+)?")
_EXPORT = "export the gear unit again, or name another file"
_BOOLEANS = {"true": "1", "false": "0"}
_PLAIN = ("none", "-", "1", "")
"""Units of numbers without dimension."""


@dataclass(frozen=True)
class Component:
    """A component of a gear unit, such as a gear or a shaft.

    ``id``, ``type`` and ``name`` are those of the file. ``attributes`` are texts with their unit,
    ``{"face_width": ("50.0", "mm")}``: the unit is None where the file gives none; ``vectors`` are the arrays of
    numbers in the same way, matrices are left out.
    """

    id: str
    type: str
    name: str
    attributes: Mapping[str, tuple[str, str | None]]
    vectors: Mapping[str, tuple[tuple[float, ...], str | None]] = field(default_factory=dict)

    def __str__(self) -> str:
        return f"{self.type} {self.id}"


@dataclass(frozen=True)
class Relation:
    """A relation of a ``type`` between components: ``refs`` are pairs of role and component id."""

    type: str
    refs: tuple[tuple[str, str], ...]

    def of(self, role: str) -> list[str]:
        """List the ids in a role."""
        return [id for of_role, id in self.refs if of_role == role]


@dataclass(frozen=True)
class Model:
    """What a REXS file holds.

    Parameters
    ----------
    name : str
        Of the file, for messages.
    version : str
        Of the format, such as ``"1.7"``.
    components : mapping of str to Component
        By id.
    relations : tuple of Relation
        Which components belong together, and in which roles.
    load_cases : tuple of mapping
        Attributes by component id that a load case of the first load spectrum gives.
    used : set of (str, str)
        Types of components and attributes that were asked for.
    findings : list of Finding
        What a case that was made of the file does not have, or has otherwise (W-REXS), doubts first.
    """

    name: str
    version: str
    components: Mapping[str, Component]
    relations: tuple[Relation, ...]
    load_cases: tuple[Mapping[str, Mapping[str, tuple[str, str | None]]], ...] = ()
    used: set[tuple[str, str]] = field(default_factory=set)
    findings: list[Finding] = field(default_factory=list)

    def remark(self, key: str, text: str, *, remedy: str = "", severity: str = DOUBT, first: bool = False) -> None:
        """Keep a finding on what a case does not have, or has otherwise; the same one once."""
        finding = Finding("W-REXS", key, text, remedy=remedy, severity=severity)
        if finding not in self.findings:
            self.findings.insert(0 if first else len(self.findings), finding)
            self.findings.sort(key=lambda remark_told: -SEVERITIES.index(remark_told.severity))

    def chosen_case(self, wanted: int | None) -> tuple[int, Mapping[str, Mapping[str, tuple[str, str | None]]]]:
        """Find number, from 1, and attributes of a load case, by default of the first, if there are any.

        CaseError: no such load case (E-CHOICE).
        """
        number, count = 1 if wanted is None else wanted, len(self.load_cases)
        if wanted is not None and not 1 <= number <= count:
            raise CaseError(
                "there is no such load case",
                code="E-CHOICE",
                key="--load-case",
                value=wanted,
                file=self.name,
                limit=f"1 to {count}" if count else "a file with load cases",
                remedy="leave it out, or name one of the file",
            )
        return number, self.load_cases[number - 1] if count else {}

    def case_in_words(self, number: int, speed: float, torque: float | None) -> str:
        """Tell number, speed [rad/s], torque [N m] and share of a load case."""
        shares = (load_case.get("load_duration_fraction") for load_case in self.load_cases[number - 1].values())
        share = next((f", {value} {unit or ''}".rstrip() for value, unit in filter(None, shares)), "")
        load = "no torque" if torque is None else f"{torque:.6g} N m"
        return f"{number}: {speed * 30.0 / math.pi:.6g} rpm, {load}{share}"

    def related(self, kinds: str | tuple[str, ...], to: str, **role: str) -> list[Component]:
        """List the components in the role `to` of relations that have an id in another role."""
        (has,) = role.items()
        of = [kinds] if isinstance(kinds, str) else kinds
        ids = (id for kind in of for relation in self._relations_of.get((kind, *has), ()) for id in relation.of(to))
        return [self.components[id] for id in dict.fromkeys(ids)]

    @cached_property
    def _relations_of(self) -> dict[tuple[str, str, str], list[Relation]]:
        """Relations by type, role and id."""
        relations: dict[tuple[str, str, str], list[Relation]] = {}
        for relation in self.relations:
            for role, id in relation.refs:
                relations.setdefault((relation.type, role, id), []).append(relation)
        return relations

    def text(self, component: Component, attribute: str) -> str | None:
        """Value of an attribute as text, None where it is not given."""
        self.used.add((component.type, attribute))
        return component.attributes.get(attribute, ("", None))[0].strip() or None

    def number(self, component: Component, attribute: str, dimension: Dimension | None = None):
        """Read an attribute in SI units, None where it is not given; without a dimension a plain number.

        CaseError with file, component and attribute: no number, no unit or one of another kind (E-UNIT).
        """
        if (text := self.text(component, attribute)) is None:
            return None
        unit, key = component.attributes[attribute][1], f"{component}, {attribute}"
        try:
            if dimension is not None:
                return to_si(f"{text} {unit or ''}", dimension)
            number = float(text)
        except CaseError as error:
            error.key, error.file = key, self.name
            raise
        except ValueError:
            number = math.nan
        if not math.isfinite(number) or (unit or "") not in _PLAIN:
            raise CaseError(
                "a plain number is needed",
                code="E-UNIT",
                key=key,
                value=f"{text} {unit or ''}",
                limit='a finite number with the unit "none"',
                remedy=_EXPORT,
                file=self.name,
            )
        return number

    def vector(self, component: Component, attribute: str, dimension: Dimension | None = None):
        """Read an array in SI units, None where it is not given; without a dimension plain numbers.

        CaseError with file, component and attribute: no unit or one of another kind (E-UNIT).
        """
        values, unit = component.vectors.get(attribute, (None, None))
        if values is None or dimension is None:
            return values
        try:
            return tuple(to_si(f"{value!r} {unit or ''}", dimension) for value in values)
        except CaseError as error:
            error.key, error.file = f"{component}, {attribute}", self.name
            raise

    def refuse(self, message: str, key: str, remedy: str = _EXPORT, limit: str | None = None) -> NoReturn:
        """Refuse what the file says of a component (E-REXS)."""
        raise CaseError(message, code="E-REXS", key=key, file=self.name, limit=limit, remedy=remedy)

    def unused(self) -> Iterator[str]:
        """Tell, by type of component, how many there are and which of their attributes nobody asked for."""
        types: dict[str, list[Component]] = {}
        for component in self.components.values():
            types.setdefault(component.type, []).append(component)
        for kind, members in sorted(types.items()):
            names = dict.fromkeys(name for member in members for name in member.attributes)
            left = [name for name in names if (kind, name) not in self.used]
            if left:
                yield f"{kind} ({len(members)}): {', '.join(left)}"


def read_model(path: str | os.PathLike) -> Model:
    """Read a REXS file of any form and of versions 1.0 to 2.0.

    CaseError: E-FILE: unreadable, too long, no XML, JSON or zip, or with entities. E-FILE-ENC: an encoding
    that is not read, or other bytes than the file declares; without a declaration it is UTF-8.
    E-FORMAT: another version. E-REXS: ids missing or unknown, anything given twice, parts of each other.
    """
    name = os.fsdecode(path)
    data = read_bytes(path, MOST_BYTES, "name a REXS file: .rexs, .rexsj or .rexsz")
    zipped = data[:2] == b"PK" or name.lower().endswith((".rexsz", ".zip"))
    text = _text(_unzipped(data, name) if zipped else data, name)
    in_json = text.lstrip()[:1] == "{"
    if (count := text.count("{" if in_json else "<")) > MOST_ELEMENTS:
        what = "tables" if in_json else "tags"
        message, limit = f"{count} {what} are too many", f"{MOST_ELEMENTS} {what}"
        raise _broken(message, name, "export one gear unit", limit=limit)
    return _model((_from_json if in_json else _from_xml)(text, name), name)


def _text(data: bytes, name: str) -> str:
    """Decode a file as its byte-order mark or its declaration says (XML 1.0, appendix F), else as UTF-8."""
    wide = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16", b"<\0": "utf-16le", b"\0<": "utf-16be"}
    declared = _DECLARED.match(data.removeprefix(b"\xef\xbb\xbf"))
    encoding = wide.get(data[:2]) or (declared[1].decode().lower() if declared else "utf-8")
    if encoding == "utf-8":
        return decoded(data, name)
    # a declaration that can be read byte by byte stands in no text of two bytes a character
    fits = (data[:2] in wide) == encoding.startswith("utf-16")
    try:
        text = data.decode(_ENCODINGS[encoding]) if fits else None
    except (KeyError, UnicodeError):
        text = None
    if text is None:
        what = "does not fit the bytes of the file" if encoding in _ENCODINGS else "is not read"
        raise CaseError(
            f"the encoding {encoding} {what}",
            code="E-FILE-ENC",
            file=name,
            limit=", ".join(_ENCODINGS),
            remedy="save the file as UTF-8, with the declaration",
        )
    return text.removeprefix("\ufeff")


def _broken(message: str, name: str, remedy: str = _EXPORT, limit: str | None = None) -> CaseError:
    return CaseError(message, code="E-FILE", file=name, limit=limit, remedy=remedy)


def _unzipped(data: bytes, name: str) -> bytes:
    """Only REXS file in a zip; unpacked as far as it may be long, whatever its header says."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            inside = [file for file in archive.infolist() if file.filename.lower().endswith((".rexs", ".rexsj"))]
            if len(inside) != 1:
                raise _broken(f"the zip holds {len(inside)} REXS files", name, limit="one of them")
            with archive.open(inside[0]) as stream:
                unpacked = stream.read(MOST_BYTES + 1)
    except (zipfile.BadZipFile, zlib.error, RuntimeError, NotImplementedError, EOFError, OSError) as error:
        raise _broken(f"the zip cannot be unpacked: {error}", name) from error
    if len(unpacked) > MOST_BYTES:
        raise _broken("what the zip holds is too long", name, limit=f"{MOST_BYTES} bytes")
    return unpacked


def _from_json(text: str, name: str) -> dict:
    try:
        model = json.loads(text, object_pairs_hook=lambda pairs: _table(pairs, name))["model"]
    except CaseError:
        raise
    except (ValueError, RecursionError, KeyError, TypeError) as error:
        raise _broken(f"no REXS model in JSON: {type(error).__name__}: {error}", name) from error
    cases = [case for part in _dicts(model, "load_spectrum") for case in _dicts(part, "load_cases")]
    for component in (entry for part in (model, *cases) for entry in _dicts(part, "components")):
        for attribute in _dicts(component, "attributes"):
            values = (attribute[key] for key in attribute if key not in ("id", "unit"))
            attribute["value"] = next((value for value in values if isinstance(value, str | int | float)), None)
            attribute["vector"] = next((value for key, value in attribute.items() if isinstance(value, list)), None)
    return model if isinstance(model, dict) else {}


def _table(pairs: list[tuple[str, object]], name: str) -> dict:
    """Table of JSON, no key of which is given twice."""
    if len(table := dict(pairs)) < len(pairs):
        _need_once([key for key, _ in pairs], f"{table['id']}, " if "id" in table else "", name)
    return table


def _need_once(ids: list[str], where: str, name: str) -> None:
    """Refuse ids of which one is given twice (E-REXS)."""
    for id, count in Counter(ids).most_common(1):
        if count > 1:
            raise CaseError("it is given twice", code="E-REXS", key=where + id, file=name, remedy=_EXPORT)


def _from_xml(text: str, name: str) -> dict:
    """Tables as in JSON of an XML text, in which document types and entities are refused unparsed."""
    if re.search(r"<!\s*(DOCTYPE|ENTITY)", text, re.IGNORECASE):
        raise _broken("document types and entities are refused", name, "remove them: REXS has none")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise _broken(f"neither XML nor JSON nor a zip: {error}", name) from error
    if _tag(root) != "model":
        raise _broken(f"no REXS file: its root is {_tag(root)!a}", name, limit="model")
    return {
        **root.attrib,
        "components": [_xml_component(component) for component in _below(root, "components", "component")],
        "relations": [
            {**relation.attrib, "refs": [dict(ref.attrib) for ref in relation]}
            for relation in _below(root, "relations", "relation")
        ],
        "load_spectrum": [{"load_cases": _xml_cases(part)} for part in root if _tag(part) == "load_spectrum"],
    }


def _xml_cases(spectrum: ElementTree.Element) -> list[dict]:
    cases = (part for part in spectrum if _tag(part) == "load_case")
    return [{"components": [_xml_component(component) for component in case]} for case in cases]


def _tag(element: ElementTree.Element) -> str:
    return element.tag.rpartition("}")[2]


def _below(root: ElementTree.Element, group: str, tag: str) -> list[ElementTree.Element]:
    return [element for table in root if _tag(table) == group for element in table if _tag(element) == tag]


def _xml_component(element: ElementTree.Element) -> dict:
    attributes = []
    for attribute in element:
        arrays = [array for array in attribute if _tag(array) == "array"]
        vector = [entry.text for entry in arrays[0]] if arrays else None
        attributes.append({**attribute.attrib, "value": None if len(attribute) else attribute.text, "vector": vector})
    return {**element.attrib, "attributes": attributes}


def _dicts(table: object, key: str) -> list[dict]:
    """Tables in a list of a table, empty where there is none."""
    entries = table.get(key) if isinstance(table, dict) else None
    return [entry for entry in entries if isinstance(entry, dict)] if isinstance(entries, list) else []


def _model(data: dict, name: str) -> Model:
    """Model of the tables of a file; refuses another version, ids and relations that do not fit."""
    version = str(data.get("version"))
    if not _VERSIONS.fullmatch(version):
        raise CaseError(
            "this version of REXS is not read",
            code="E-FORMAT",
            key="version",
            value=version,
            file=name,
            limit="1.0 to 1.7 and 2.0",
            remedy="export the gear unit in one of these versions",
        )
    components: dict[str, Component] = {}
    model = Model(name, version, components, tuple(_relations(data)), _load_cases(data, name))
    for component in _dicts(data, "components"):
        id, kind = str(component.get("id", "")), str(component.get("type", ""))
        if not id or not kind or id in components:
            wrong = "is given twice" if id in components else f"has no {'type' if id else 'id'}"
            model.refuse(f"the component {str(component.get('name', '')) or kind!a} {wrong}", f"component {id}")
        attributes = _attributes(component, f"{kind} {id}", name)
        components[id] = Component(id, kind, str(component.get("name", "")), attributes, _vectors(component))
    for relation in model.relations:
        for role, id in relation.refs:
            if id not in components:
                key, limit = f"relation {relation.type}, {role}", "ids of components of the file"
                model.refuse(f"there is no component {id!a}", key, limit=limit)
    _refuse_loops(model)
    return model


def _relations(data: dict) -> Iterator[Relation]:
    for relation in _dicts(data, "relations"):
        refs = ((str(ref.get("role", "")), str(ref.get("id", ""))) for ref in _dicts(relation, "refs"))
        yield Relation(str(relation.get("type", "")), tuple(refs))


def _attributes(table: dict, component: str, name: str) -> dict[str, tuple[str, str | None]]:
    """Values and units of a component; JSON has true and numbers, XML texts."""
    values_of, attributes = {}, _dicts(table, "attributes")
    _need_once([str(attribute.get("id", "")) for attribute in attributes], f"{component}, ", name)
    for attribute in attributes:
        value, unit = attribute.get("value"), attribute.get("unit")
        if value is not None:
            text = str(value).lower() if isinstance(value, bool) else str(value)
            values_of[str(attribute.get("id", ""))] = text, None if unit is None else str(unit)
    return values_of


def _vectors(table: dict) -> dict[str, tuple[tuple[float, ...], str | None]]:
    """Arrays of finite numbers of a component, true as 1; what else stands in an array is left out."""
    values_of = {}
    for attribute in _dicts(table, "attributes"):
        try:
            values = tuple(
                float(_BOOLEANS.get(text := str(entry).lower().strip(), text)) for entry in attribute["vector"]
            )
        except (KeyError, TypeError, ValueError):
            continue
        if len(values) <= MOST_ENTRIES and all(map(math.isfinite, values)):
            unit = attribute.get("unit")
            values_of[str(attribute.get("id", ""))] = values, None if unit is None else str(unit)
    return values_of


def _load_cases(data: dict, name: str) -> tuple[dict, ...]:
    """Attributes by component id of every load case of the first load spectrum."""
    cases = [c for spectrum in _dicts(data, "load_spectrum")[:1] for c in _dicts(spectrum, "load_cases")]
    if len(cases) > MOST_CASES:
        message, limit = f"{len(cases)} load cases are too many", f"{MOST_CASES} load cases"
        raise _broken(message, name, "export fewer", limit=limit)
    cases_read = []
    for case in cases:
        where, members = f"load case {len(cases_read) + 1}, component ", _dicts(case, "components")
        _need_once([str(member.get("id")) for member in members], where, name)
        cases_read.append({(id := str(member.get("id"))): _attributes(member, where + id, name) for member in members})
    return tuple(cases_read)


def _refuse_loops(model: Model) -> None:
    """Refuse assemblies of which one is part of itself."""
    parts: dict[str, set[str]] = {}
    for relation in model.relations:
        if relation.type in ("assembly", "ordered_assembly"):
            for whole in relation.of("assembly"):
                parts.setdefault(whole, set()).update(relation.of("part"))
    try:
        TopologicalSorter(parts).prepare()
    except CycleError as error:
        loop = " in ".join(map(str, error.args[1][:6]))
        model.refuse(f"components are parts of each other: {loop}", "relation assembly", limit="no loops")


def model_text(model: Model, program: str, version: str) -> str:
    """Write a model as REXS in XML; `program` and its `version` are those of the writer."""
    root = ElementTree.Element(
        "model",
        applicationId=program,
        applicationVersion=version,
        version=model.version,
        date=datetime.now().astimezone().isoformat(timespec="seconds"),
    )
    relations = ElementTree.SubElement(root, "relations")
    for number, relation in enumerate(model.relations, start=1):
        parent = ElementTree.SubElement(relations, "relation", id=str(number), type=relation.type, order="1")
        for role, id in relation.refs:
            ElementTree.SubElement(parent, "ref", id=id, role=role, hint=model.components[id].type)
    components = ElementTree.SubElement(root, "components")
    for component in model.components.values():
        _write_component(
            components, component.id, component.attributes, component.vectors, type=component.type, name=component.name
        )
    if model.load_cases:
        spectrum = ElementTree.SubElement(root, "load_spectrum", id="1")
        for number, case in enumerate(model.load_cases, start=1):
            parent = ElementTree.SubElement(spectrum, "load_case", id=str(number))
            for id, attributes in case.items():
                _write_component(parent, id, attributes, type=model.components[id].type)
    ElementTree.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ElementTree.tostring(root, encoding="unicode")}\n'


def _write_component(
    parent: ElementTree.Element, id: str, attributes: Mapping, vectors: Mapping | None = None, **more: str
) -> None:
    component = ElementTree.SubElement(parent, "component", {"id": id, **more})
    for name, (value, unit) in attributes.items():
        ElementTree.SubElement(component, "attribute", id=name, unit=unit or "none").text = value
    for name, (values, unit) in (vectors or {}).items():
        array = ElementTree.SubElement(
            ElementTree.SubElement(component, "attribute", id=name, unit=unit or "none"), "array"
        )
        for value in values:
            ElementTree.SubElement(array, "c").text = repr(value)
