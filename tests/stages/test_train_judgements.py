"""Judgements of pairs and sets, from the files of a run."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from femgear.findings import DOUBT, Finding
from femgear.stages.judgements import HEAT, QUIET, SMOOTH, STRONG, SURE
from femgear.stages.strength import rate_case
from femgear.stages.train_judgements import BY_ALL_STAGES, judge_teeth, set_judgements
from femgear.trains.reading import read_case, with_values

CASES = Path(__file__).parents[2] / "cases"


class Files(dict):
    """A run of a case with the files of some stages."""

    def __init__(self, case, **data):
        super().__init__(data)
        self.case, self.findings, self.stages = case, (), tuple(data)
        self.manifest = SimpleNamespace(complete=True)
        self.__dict__.update(data)


@pytest.fixture(scope="module")
def static():
    meshes = ["sun-planet 1", "sun-planet 2", "planet 1-ring", "planet 2-ring"]
    error = 1e-6 * np.array([1.0, 1.5, 0.25, 0.25])
    return xr.Dataset({"ste_peak_to_peak": ("mesh", error)}, {"mesh": meshes, "planet": [1, 2]})


def test_the_error_of_either_kind_of_mesh_is_the_largest(static):
    case = read_case(CASES / "planetary_27_40_108.toml")
    strength, smooth = judge_teeth(Files(case, static=static), None)
    assert (strength.question, strength.state) == (STRONG, "absent")
    assert (smooth.question, smooth.answer) == (
        SMOOTH,
        "at rest: transmission error 1.5 and 0.25 µm (sun-planet, planet-ring)",
    )
    assert (smooth.state, smooth.limit) == ("absent", BY_ALL_STAGES)  # this run has no motion
    still = case.model_copy(update={"operation": case.operation.model_copy(update={"speeds": ()})})
    *_, smooth = judge_teeth(Files(still, static=static), None)
    assert (smooth.state, smooth.limit) == ("absent", "operation.speeds gives it")
    *_, in_housing = judge_teeth(Files(case, static=static), None, np.array([1.092, 1.065]))
    assert (
        ", dynamic factor K_v 1.09 and 1.06 (" in in_housing.answer
        or ", dynamic factor K_v 1.09 and 1.07 (" in in_housing.answer
    )


def test_a_pair_with_limits_is_rated_and_has_no_level():
    limits = {"material.root_stress_limit": "430 MPa", "material.contact_stress_limit": "1500 MPa"}
    case = with_values(read_case(CASES / "spur_pair.toml"), {**limits, "strength.required_flank_safety": 3.0})
    judged = {judgement.question: judgement for judgement in set_judgements(Files(case))}
    assert list(judged) == [STRONG, SMOOTH, QUIET, SURE] and HEAT not in judged
    assert judged[STRONG].state == "bad" and "S_H at least 3" in judged[STRONG].limit
    assert judged[QUIET].state == "absent" and "femgear casing" in judged[QUIET].limit
    enough = with_values(case, {"strength.required_flank_safety": 0.1})
    strong = next(set_judgements(Files(enough)))
    assert strong.state == "good" and strong.limit.endswith("K_v, K_Hβ, K_Hα taken as 1")


def test_a_pair_without_limits_says_why_it_is_not_rated_and_that_it_runs_smoothly():
    calm = {"drive_contact": ("speed", [1.0]), "stable": ("speed", [1]), "dynamic_factor": ("speed", [1.1])}
    run_up = xr.Dataset({"dynamic_factor": ("speed", [1.02, 1.31, 1.2])}, {"speed": [500.0, 1000.0, 1500.0]})
    case = with_values(read_case(CASES / "spur_pair.toml"), {"material.treatment": None, "material.hardness": None})
    run = Files(case, dynamics=xr.Dataset(calm), runup=run_up)
    run.dynamics["mesh"] = ("mesh", ["gear 1-gear 2"])
    run.findings = case.notices
    judged = {judgement.question: judgement for judgement in set_judgements(run)}
    assert judged[STRONG].sentence == "Its strength is not rated: the case gives no treatment of its gears"
    assert judged[SMOOTH].sentence.startswith("It runs smoothly: teeth stay in contact, motions are stable")
    assert judged[QUIET].sentence == "In the run-up its mesh force reaches 1.31 times its mean (at 1,000 rpm)"
    assert judged[SMOOTH].answer.endswith("dynamic factor K_v 1.10 at 1,500 rpm")
    # masses are left out of the case: what vibrates with them says so
    assert "; rests on estimated masses" in judged[SMOOTH].limit and "estimated masses" in judged[SURE].limit


def test_the_factors_taken_as_one_are_those_of_the_safeties_that_are_shown():
    """Over the life all factors but K_Hbeta are known; under the load of the run nothing tells any."""
    limits = {"material.root_stress_limit": "430 MPa", "material.contact_stress_limit": "1500 MPa"}
    case = with_values(read_case(CASES / "spur_pair.toml"), limits)
    over_life = {f"{kind}_spectrum_safety": (kind, [1.1, 1.05]) for kind in ("root", "flank")}
    gears = {"root": ["gear 1", "gear 2"], "flank": ["gear 1", "gear 2"]}
    life = xr.Dataset(over_life, gears, {"iso_missing": "face"})
    strong = next(set_judgements(Files(case, life=life)))
    assert "over the life" in strong.answer and strong.limit.endswith("; K_Hβ taken as 1")
    life["flank_spectrum_safety"].values[:] = 9.0
    strong = next(set_judgements(Files(case, life=life)))
    assert strong.answer.count("over the life") == 1 and strong.limit.endswith("; K_v, K_Hβ, K_Hα taken as 1")


def test_safeties_are_doubted_by_responses_at_speeds_of_operation_alone():
    """A branch goes beyond them: K_v is not of it."""
    limits = {"material.root_stress_limit": "430 MPa", "material.contact_stress_limit": "1500 MPa"}
    run = Files(with_values(read_case(CASES / "nrel_pgb.toml"), limits))
    for stage, words in (("branch", ""), ("response", "With a doubt s"), ("dynamics", "With a doubt s")):
        run.findings = [Finding("W-TAIL", "", "it ends short", severity=DOUBT, stage=stage)]
        strong = next(judge_teeth(run, rate_case(run.case)))
        assert ("doubt: too few harmonics" in strong.limit) == bool(words)
        assert strong.sentence.startswith(words or "Strong enough")


def test_the_error_of_helical_meshes_is_that_of_the_slices(static):
    """static.nc has the spur gears of the transverse section, whose error nobody hears."""
    case = read_case(CASES / "helical_30_20_70.toml")
    curve = 1e-6 * np.array([[4.0, 4.25], [4.0, 4.125], [3.0, 3.0625], [3.0, 3.0]])
    modes = xr.Dataset({"helical_ste": (("mesh", "position"), curve)}, {"mesh": static["mesh"]})
    runs = {"static": static, "modes": modes}, {"static": static}
    answers = [list(judge_teeth(Files(case, **data), None))[-1].answer for data in runs]
    assert answers == ["at rest: transmission error 0.25 and 0.0625 µm (sun-planet, planet-ring)", "no motion"]
