"""Four-stage planetary reducers as cases: an example whose numbers are femgear's own, and a published table.

`cases/four_stage_reducer.toml` is a drive of 55 kW at 1500 1/min with the ratio 538.6; it reproduces no
published train. `cases/published_four_stages.toml` is Table 2 of "Optimized design of dynamic characteristics
of planetary gear train" as printed; `published_case` reads it with what the paper leaves open as arguments.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

from femgear.trains.gearbox.case_file import CASING, GearboxCase
from femgear.trains.reading import read_case, with_values

CASES = Path(__file__).resolve().parents[2] / "cases"
PUBLISHED_FREQUENCIES = (204.483, 1321.636)
"""Lowest and highest natural frequency that the paper of the table prints [Hz]; it has none at zero."""


def four_stage_case(*, lateral: bool = True) -> GearboxCase:
    """The example: sun 1 drives, each carrier turns the next sun, all rings are fixed.

    Parameters
    ----------
    lateral : bool
        The shafts between the stages carry the suns, too; otherwise they only twist, and the suns behind the
        first float in their meshes.
    """
    case = read_case(CASES / "four_stage_reducer.toml")
    shafts = [n for n, coupling in enumerate(case.coupling) if CASING not in coupling.between]
    return case if lateral else with_values(case, {f"coupling[{n}].radial": "0 N/m" for n in shafts})


def published_case(*, planets: int, stiffness_unit: float = 1e3, held: bool = False) -> GearboxCase:
    """The published table in torsion, its four stages joined rigidly.

    The paper prints neither number of planets, pressure angles, supports nor couplings. Torsion asks for the
    fewest of them: with rings at rest and equal pressure angles it depends on base radii, inertias, planet
    masses and mesh stiffnesses, and on the circle of the planets' centres, taken as ``(r_s + r_p) / cos 20
    deg``. The printed carrier radius cannot be that circle: in stage 4 it is less than ``r_s + r_p``.

    Parameters
    ----------
    planets : int
        In every stage, at equal angles.
    stiffness_unit : float
        Of the printed mesh stiffnesses [N/m]: 1e3 for the N/mm that stands there.
    held : bool
        The last carrier cannot turn, which leaves no mode at zero.
    """
    case = read_case(CASES / "published_four_stages.toml")
    values: dict[str, object] = {}
    for n, stage in enumerate(case.planetary):
        values[f"planetary[{n}].gears.planets"] = planets
        for mesh in ("sun_mesh", "ring_mesh"):
            printed = getattr(stage, mesh).stiffness / 1e3
            values[f"planetary[{n}].{mesh}.stiffness"] = f"{printed * stiffness_unit!r} N/m"
    if held:
        rings = tomllib.loads(case.source)["coupling"]
        last = {"between": ["stage 4 carrier", CASING], "torsion": "rigid", "transmits": False}
        values["coupling"] = [*rings, last]
    return with_values(case, values)
