"""Tip reliefs of all gears as design variables."""

from __future__ import annotations

from femgear.case import Case, planetary_set, with_values
from femgear.casefile.units import LENGTH, to_si
from femgear.errors import CaseError
from femgear.optimisation.variables import Variable

_LATEST_START = 0.93
"""Of the height from the pitch circle to the tip: later ones are chamfers."""


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
    from femgear.gears import torques

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
    from femgear.casefile import tomlfile

    return tomlfile.parse(case.source, case.name)[gear].get("modifications", [])
