"""Key figures of lives and losses: which a case has, and the numbers of their files."""

from pathlib import Path

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.findings import NOTE
from femgear.stages.key_figures import figure_of
from femgear.stages.tooth_figures import PLANET_BEARING_FIGURE, missing_entry, pair_key_figures, tooth_key_figures
from femgear.study.objectives import default_quantities, named_quantity
from femgear.trains.live import Live
from femgear.trains.reading import read_case, with_values

CASES = Path(__file__).parents[2] / "cases"
STEEL = {"material.treatment": "case hardened steel", "material.hardness": 720}
LOADS = [
    {"torque": "900 N m", "speed": "1500 rpm", "hours": 50, "name": "start"},
    {"torque": "200 N m", "speed": "1500 rpm", "hours": 950, "name": "run"},
]
LOSSES = {"losses": {"friction": "constant", "coefficient": 0.05}}


@pytest.fixture(scope="module")
def pair():
    quick = {"static.positions": 16, "static.flank_elements": 6}
    return with_values(read_case(CASES / "spur_pair.toml"), STEEL | LOSSES | quick | {"operation.load_case": LOADS})


def test_figures_of_a_pair_are_those_of_its_files(pair):
    answer = Live(pair).answer
    figures = {figure.name: figure for figure in pair_key_figures(pair)}
    life, losses, static = (answer[stage].contents() for stage in ("life", "losses", "static"))
    assert figures["root life"].read(life) == life["root_life"].values.min()
    assert figures["S_H over life"].read(life) == life["flank_spectrum_safety"].values.min()
    assert figures["losses"].read(losses) == losses["loss"].values.max()
    assert figures["STE"].read(static) == pytest.approx(np.ptp(static["ste"].values, axis=-1).max(), rel=0.02)
    concerned = list(figures["root life"].concerned(answer["life"].findings))
    assert {finding.code for finding in concerned} == {"W-LIFE"} and NOTE not in {one.severity for one in concerned}
    # nothing of temperatures, whose oil is missing
    assert "root life" in default_quantities(pair) and "scuffing safety" not in default_quantities(pair)


def test_what_a_figure_needs_is_named(pair):
    plain = read_case(CASES / "planetary_27_40_108.toml")
    for case, words, needed in (
        (plain, "S_F over life", "operation.required_hours"),
        (plain, "planet bearing life", "planet.dynamic_rating"),
        (plain, "efficiency", "[losses]"),
        (plain, "root life", "load cases"),
        (pair, "film ratio", "lubricant.temperature"),
        (pair, "friction change", "losses.excites"),
    ):
        with pytest.raises(CaseError, match="needs") as refused:
            named_quantity(words, case=case)
        assert refused.value.code == "E-STAGE" and needed in f"{refused.value.message} {refused.value.remedy}"
    rated = with_values(plain, {"planet.dynamic_rating": "20 kN", "operation.load_case": LOADS})
    assert not missing_entry(rated, PLANET_BEARING_FIGURE)
    assert figure_of(tooth_key_figures(rated), "planet bearing life") is PLANET_BEARING_FIGURE
