"""Words of a command line as quantities, limits and variables; tip reliefs of all gears as variables."""

from __future__ import annotations

import re
from collections.abc import Callable

from femgear.case import text as case_text
from femgear.case.case import planetary_set
from femgear.case.sections import Case
from femgear.case.units import LENGTH, to_si
from femgear.errors import CaseError
from femgear.gears.kinematics import torques
from femgear.study import objectives
from femgear.study.objectives import NUMBER, Quantity
from femgear.study.problem import Limit
from femgear.study.variables import Variable
from femgear.trains.reading import with_values

Speeds = tuple[str, str]
"""First and last speed of the input, with their units."""
_LATEST_START = 0.93
"""Of a relief, over the height from the pitch circle to the tip: later ones are chamfers."""
_WORDS: dict[str, Callable[[str | None, Speeds | None], Quantity]] = {
    "ste": lambda torque, _: objectives.transmission_error("largest", torque=torque),
    "ste overall": lambda torque, _: objectives.transmission_error("overall", torque=torque),
    "ste sun-planet": lambda torque, _: objectives.transmission_error("sun-planet", torque=torque),
    "ste planet-ring": lambda torque, _: objectives.transmission_error("planet-ring", torque=torque),
    "mesh force": lambda _, speeds: objectives.mesh_force(*_given(speeds, "mesh force")),
    "peak mesh force": lambda _, speeds: objectives.mesh_force(
        *_given(speeds, "peak mesh force"), part="peak"
    ),
    "housing": lambda _, speeds: objectives.housing_level(*_given(speeds, "housing")),
    "contact ratio sun-planet": lambda *_: objectives.contact_ratio("sun-planet"),
    "contact ratio planet-ring": lambda *_: objectives.contact_ratio("planet-ring"),
    "tip thickness sun": lambda *_: objectives.tip_thickness("sun"),
    "tip thickness planet": lambda *_: objectives.tip_thickness("planet"),
    "tip thickness ring": lambda *_: objectives.tip_thickness("ring"),
    "contact pressure": lambda *_: objectives.contact_pressure(),
    "root stress sun": lambda *_: objectives.root_stress("sun"),
    "root stress planet": lambda *_: objectives.root_stress("planet"),
    "root stress ring": lambda *_: objectives.root_stress("ring"),
}
NAMES = tuple(_WORDS)


def named_quantity(words: str, *, torque: str | None = None, speeds: Speeds | None = None) -> Quantity:
    """Quantity of some words, one of `NAMES`.

    Parameters
    ----------
    words : str
    torque : str, optional
        Of transmission errors, on the input; that of the case when left out.
    speeds : (str, str), optional
        First and last speed of the input, for mesh forces and housing levels.

    Raises
    ------
    CaseError
        E-OBJECTIVE: no such quantity, or no speeds for one that needs them.
    """
    try:
        make = _WORDS[" ".join(words.split()).lower()]
    except KeyError:
        raise CaseError(
            "no such quantity", code="E-OBJECTIVE", key="objective", value=words, limit=", ".join(NAMES)
        ) from None
    return make(torque, speeds)


def _given(speeds: Speeds | None, words: str) -> Speeds:
    """The speeds, refused where they are left out."""
    if speeds is None:
        raise CaseError(
            f"{words} is found over a range of speeds",
            code="E-OBJECTIVE",
            key="speeds",
            remedy='give two speeds of the input, "1000 rpm" and "3500 rpm"',
        )
    return speeds


def parse_limit(text: str, **options) -> Limit:
    """Limit of words such as ``"root stress sun <= 300 MPa"``; options as for `named_quantity`.

    Raises
    ------
    CaseError
        E-LIMIT: no such text; E-OBJECTIVE; E-UNIT.
    """
    match = re.fullmatch(r"\s*(.+?)\s*(<=|>=)\s*(.+?)\s*", text, re.DOTALL)
    if not match:
        example = '"contact ratio sun-planet >= 1.3" or "root stress sun <= 300 MPa"'
        raise CaseError("not a limit", code="E-LIMIT", key="--limit", value=text, limit=example)
    quantity = named_quantity(match[1], **options)
    if quantity.dimension is NUMBER:
        bound = _number(match[3])
        if not isinstance(bound, float):
            raise CaseError("not a number", code="E-LIMIT", key="--limit", value=text)
    else:
        bound = to_si(match[3], quantity.dimension)
    return Limit(quantity, low=bound) if match[2] == ">=" else Limit(quantity, high=bound)


def parse_variable(text: str) -> Variable:
    """Variable of ``KEY=LOW..HIGH`` or ``KEY=LOW..HIGH +- TOLERANCE``.

    Raises
    ------
    CaseError
        E-VARIABLE, E-UNIT.
    """
    match = re.fullmatch(r"\s*([^=\s]+)\s*=\s*(.+?)\s*\.\.\s*(.+?)\s*(?:\+-\s*(.+?)\s*)?", text, re.DOTALL)
    if not match:
        raise CaseError(
            "not a design variable",
            code="E-VARIABLE",
            key="--vary",
            value=text,
            limit="KEY=LOW..HIGH or KEY=LOW..HIGH +- TOLERANCE",
            remedy='--vary "sun.modifications[0].amount=0 um..15 um +- 1 um"',
        )
    key, low, high, tolerance = match.groups()
    low, high = (_number(value) for value in (low, high))
    return Variable(key, low, high, tolerance=_number(tolerance) if tolerance else None)


def _number(text: str) -> str | float:
    """A number without unit as a number."""
    try:
        return float(text)
    except ValueError:
        return text


def tip_reliefs(
    case: Case, *, largest: str | None = None, tolerance: str = "1 um", places: str = "0.1 mm"
) -> tuple[Case, tuple[Variable, ...]]:
    """The case with one more linear tip relief on every loaded flank; amounts and starts are the variables.

    Sun and ring have one each, planets one for the flank that touches the sun and one for that which touches
    the ring. The amounts are zero, so that the case computes as before. Starts lie between the pitch circle
    and near the tip.

    Parameters
    ----------
    case : Case
        Its modifications stay.
    largest : str, optional
        Largest amount, with its unit; a hundredth of the module when left out.
    tolerance, places : str
        Tolerances of amounts and of diameters.

    Raises
    ------
    CaseError
        E-RANGE: a largest amount that is not over 0 and at most 0.2 modules.
    """
    gears = planetary_set(case)
    most = 0.01 * case.sun.module if largest is None else to_si(largest, LENGTH)
    if not 0 < most <= 0.2 * case.sun.module:
        limit = f"over 0 to 0.2 modules, {0.2e6 * case.sun.module:.6g} um"
        raise CaseError("not a plausible relief", code="E-RANGE", key="largest", value=largest, limit=limit)
    back = torques(gears, member=case.operation.input, torque=case.operation.torque).sun < 0
    sides = ("ring side", "sun side") if back else ("sun side", "ring side")
    sun, planet, ring = gears.sun, gears.planet, gears.ring
    ratio = gears.centre_distance / (sun.teeth + planet.teeth)
    inner = gears.centre_distance / (ring.teeth - planet.teeth)
    # pitch radii of both meshes
    flanks = (
        (sun, "", ratio * sun.teeth),
        (planet, sides[0], ratio * planet.teeth),
        (planet, sides[1], inner * planet.teeth),
        (ring, "", inner * ring.teeth),
    )
    variables: list[Variable] = []
    for gear, side, pitch in flanks:
        number = len(getattr(case, gear.name).modifications)
        first, last = pitch, pitch + _LATEST_START * (gear.tip_radius - pitch)
        low, high = (f"{2e3 * radius:.6g} mm" for radius in sorted((first, last)))
        table = {"kind": "tip relief", "amount": "0 um", "start_diameter": f"{1e3 * (first + last):.6g} mm"}
        table |= {"flank": side} if side else {}
        case = with_values(case, {f"{gear.name}.modifications": [*_tables(case, gear.name), table]})
        key = f"{gear.name}.modifications[{number}]"
        variables += [
            Variable(f"{key}.amount", "0 um", f"{1e6 * most:.6g} um", tolerance=tolerance),
            Variable(f"{key}.start_diameter", low, high, tolerance=places),
        ]
    return case, tuple(variables)


def _tables(case: Case, gear: str) -> list:
    """Modifications of a gear as its file holds them."""
    return case_text.parse(case.source, case.name)[gear].get("modifications", [])
