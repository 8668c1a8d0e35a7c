"""Lives over load cases whose contacts are solved: one load case, halves of it, reversed ones, and refusals."""

import copy
import tomllib
from pathlib import Path

import numpy as np
import pytest

from femgear.errors import ContactError
from femgear.run import solve
from femgear.stages.life import LIFE, mesh_frequency_at, no_load_cases, solve_life, static_load_factors, with_torque
from femgear.stages.static import solve_static
from femgear.stages.strength import mesh_frequencies, rate_case
from femgear.trains.reading import read_case, with_values
from femgear.trains.registry import stages_of, train_of

CASES = Path(__file__).parents[2] / "cases"
NOMINAL = {"torque": "200 N m", "speed": "1500 rpm"}


def case_of(*load_cases, name="spur_pair", **sections):
    """A shipped case with a treatment, load cases and further tables."""
    tables = tomllib.loads((CASES / f"{name}.toml").read_text(encoding="utf-8"))
    tables["material"] |= {"treatment": "case hardened steel", "hardness": 720}
    tables["operation"] |= {"load_case": list(load_cases)} | sections.pop("operation", {})
    for section, entries in sections.items():
        tables[section] = copy.deepcopy(tables.get(section, {})) | entries
    return read_case(tables)


def life_of(case):
    return solve_life(case, solve_static(case))


@pytest.fixture(scope="module")
def alone():
    """One load case, that of the operation itself."""
    case = case_of(NOMINAL, strength={"quality": 6}, operation={"required_hours": 20000.0})
    return case, life_of(case)


def test_one_load_case_is_the_single_run(alone):
    """Stresses of the static solution, safeties times the life factors at the load cycles."""
    case, result = alone
    rating = rate_case(case, frequencies=(case.operation.speeds[0] * 24 / (2 * np.pi),))
    for flank, root, spectrum in zip(rating.flanks, result.spectra, result.spectra[2:], strict=False):
        hours, line = 20000.0, root.spectrum.line
        cycles = hours * 60.0 * 1500.0 / (1.0 if flank.name == "gear 1" else 36 / 24)
        assert hours * root.spectrum.cycles[0] == pytest.approx(cycles, rel=1e-12)
        assert root.spectrum.safety(hours) == pytest.approx(line.at(cycles) * flank.root_safety, rel=1e-12)
        factor = spectrum.spectrum.line.at(cycles)
        assert spectrum.spectrum.safety(hours) == pytest.approx(factor * flank.contact_safety, rel=1e-12)


def test_two_equal_halves_do_the_damage_of_the_whole(alone):
    strong = case_of(NOMINAL | {"torque": "450 N m"})
    halves = case_of(*[NOMINAL | {"torque": "450 N m", "hours": 50.0}] * 2)
    whole, parts = life_of(strong), life_of(halves)
    assert parts.required == 100.0 and whole.required is None
    assert any(np.isfinite(rated.spectrum.hours) for rated in whole.spectra)
    for one, two in zip(whole.spectra, parts.spectra, strict=True):
        assert two.spectrum.hours == pytest.approx(one.spectrum.hours, rel=1e-12)


def test_every_load_case_has_its_own_contact():
    """Slices under a lead slope: K_Hbeta falls with the torque, and stresses are not scaled."""
    slope = {"modifications": [{"kind": "lead slope", "amount": "12 um"}]}
    tables = {"gear_1": slope, "static": {"slices": 9, "positions": 16}}
    loads = [NOMINAL | {"torque": f"{torque} N m", "share": 0.5} for torque in (100, 400)]
    result = life_of(case_of(*loads, **tables))
    data = result.dataset()
    face = data["face_load_factor"].values[:, 0]
    assert face[0] > face[1] + 0.1 > 1.1
    ratio = data["root_stress_ratio"].values[:, 0]
    assert ratio[1] / ratio[0] == pytest.approx(4.0 * face[1] / face[0], rel=1e-9)
    assert (
        data["root_damage_share"].dims == ("load_case", "root") and list(data["load_case"].values)[1] == "load case 2"
    )


def test_a_torque_beyond_contact_is_refused_by_its_load_case():
    case = case_of(NOMINAL | {"share": 0.5}, NOMINAL | {"torque": "5e6 N m", "share": 0.5})
    with pytest.raises(ContactError) as caught:
        life_of(case)
    assert caught.value.key == "operation.load_case[1].torque" and caught.value.remedy
    assert caught.value.message.startswith("load case 2 with 5e+06 N m: ")


def test_load_cases_of_a_set_have_sharing_and_speeds_of_the_input():
    """A planet off its place; the input's speed gives the mesh frequency."""
    pins = {"pin_errors": [{"planet": 1, "tangential": "10 um"}]}
    load = {"torque": "60 N m", "speed": "543 rpm"}
    case = case_of(
        load | {"share": 0.5},
        load | {"torque": "-60 N m", "share": 0.5},
        name="planetary_27_40_108",
        set=(tomllib.loads((CASES / "planetary_27_40_108.toml").read_text())["set"] | pins),
    )
    result = life_of(case)
    factors = static_load_factors(solve_static(with_torque(case, 60.0)))
    data = result.dataset()
    assert data["planet_load_factor"].values[0] == pytest.approx(factors["sharing"]) and factors["sharing"][0] > 1.01
    assert data["planet_load_factor"].values[1, 0] != pytest.approx(factors["sharing"][0], rel=1e-3)
    assert mesh_frequency_at(case, case.operation.speeds[0]) == mesh_frequencies(case)[0]
    assert {"sun, back flank", "planet, ring side"} <= {*data["flank"].values}


def test_a_case_without_load_cases_has_no_lives():
    plain = read_case(CASES / "spur_pair.toml")
    assert no_load_cases(plain) and LIFE.unavailable(plain)
    assert not no_load_cases(case_of(NOMINAL))
    idle = life_of(case_of({"torque": "0 N m", "speed": "10 rpm"}))
    assert not idle.spectra and idle.residual == 0.0 and list(idle.findings) == []
    assert with_values(plain, {"operation.torque": "1 N m"}).operation.load_case == ()


@pytest.mark.slow
def test_planar_sets_have_lives_beside_a_given_mesh_stiffness():
    load = {"torque": "10 kN m", "speed": "20 rpm"}
    case = case_of(load, name="nrel_pgb")
    assert {"static", "life"} <= {stage.name for stage in stages_of(case)}
    result = solve(case, only="life")["life"]
    assert {rated.name for rated in result.spectra} >= {"sun", "planet, ring side"}
    assert not any("load_case" in finding.text for finding in train_of(case).case_warnings(case))
