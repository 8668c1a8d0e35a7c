"""Four-stage planetary reducers as cases: an example whose numbers are femgear's own, and a published table.

`cases/four_stage_reducer.toml` is a drive of 55 kW at 1500 1/min with the ratio 538.6; it reproduces no
published train. `cases/published_four_stages.toml` is Table 2 of "Optimized design of dynamic characteristics
of planetary gear train" as printed; `published_case` reads it with what the paper leaves open as arguments.
"""

from __future__ import annotations

from pathlib import Path

from femgear.trains.multistage.case_file import MultistageCase, multistage_of
from femgear.trains.multistage.model import MultistageSet
from femgear.trains.reading import read_case, with_values

CASES = Path(__file__).resolve().parents[2] / "cases"
PUBLISHED_FREQUENCIES = (204.483, 1321.636)
"""Lowest and highest natural frequency that the paper of the table prints [Hz]; it has none at zero."""


def four_stage_case(*, lateral: bool = True) -> MultistageCase:
    """The example: sun 1 drives, each carrier turns the next sun, all rings are fixed.

    Parameters
    ----------
    lateral : bool
        The shafts between the stages carry the suns, too; otherwise they only twist, and the suns behind the
        first float in their meshes.
    """
    case = read_case(CASES / "four_stage_reducer.toml")
    loose = {f"coupling[{n}].lateral": "0 N/m" for n in range(len(case.coupling))}
    return case if lateral else with_values(case, loose)


def four_stage_train(*, lateral: bool = True) -> MultistageSet:
    """The train of `four_stage_case`."""
    return multistage_of(four_stage_case(lateral=lateral))


def published_case(*, planets: int, stiffness_unit: float = 1e3, held: bool = False) -> MultistageCase:
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
    case, values = read_case(CASES / "published_four_stages.toml"), {}
    for n, stage in enumerate(case.stage):
        values[f"stage[{n}].planets"] = planets
        for name, printed in stage.radii.mesh_stiffness:
            values[f"stage[{n}].radii.mesh_stiffness.{name}"] = f"{printed / 1e3 * stiffness_unit!r} N/m"
    if held:
        values["stage[3].carrier.torsional_stiffness"] = "rigid"
    return with_values(case, values)


def published_train(**reading) -> MultistageSet:
    """The train of `published_case`."""
    return multistage_of(published_case(**reading))
