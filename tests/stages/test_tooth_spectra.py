"""Spectra of roots and flanks: which load case loads what, how often, and by how much."""

import math
from pathlib import Path

import numpy as np
import pytest

from femgear.gears.gear_steels import GEAR_STEELS
from femgear.gears.iso6336_life import equivalent_torque
from femgear.stages.strength import rate_case
from femgear.stages.tooth_spectra import RatedLoad, rated_spectra, tooth_life_coordinates, tooth_life_variables
from femgear.trains.reading import read_case, with_values

CASES = Path(__file__).parents[2] / "cases"
STEEL = {"material.treatment": "case hardened steel", "material.hardness": 720}


@pytest.fixture(scope="module")
def planetary():
    return with_values(read_case(CASES / "planetary_27_40_108.toml"), STEEL)


def spectra_of(case, *loads, **strength):
    """Spectra by kind and name of loads of torque, mesh frequency and share."""
    case = with_values(case, {f"strength.{name}": value for name, value in strength.items()})
    rated = [RatedLoad(rate_case(case, torque=torque) if torque else None, torque, *rest) for torque, *rest in loads]
    return {(spectrum.kind, spectrum.name): spectrum for spectrum in rated_spectra(case, rated)}


def test_teeth_meet_as_often_as_they_turn_against_the_carrier(planetary):
    """Mesh frequency over teeth; sun and ring meet three planets, a planet's flank each of them once."""
    spectra = spectra_of(planetary, (50.0, 540.0, 1.0))
    hour = {name: 3600.0 * 540.0 / teeth for name, teeth in (("sun", 27 / 3), ("ring", 108 / 3), ("planet", 40))}
    for (_, name), rated in spectra.items():
        assert rated.spectrum.cycles == pytest.approx([hour[name.partition(",")[0]]], rel=1e-12)
    names = ["sun", "planet, sun side", "planet, ring side", "ring"]
    assert list(spectra) == [(kind, name) for kind in ("root", "flank") for name in names]


def test_stresses_are_the_safeties_of_the_load_case(planetary):
    flanks = rate_case(planetary, torque=50.0).flanks
    spectra = spectra_of(planetary, (50.0, 540.0, 1.0))
    for flank in flanks:
        assert spectra["root", flank.name].spectrum.ratio == pytest.approx([1.0 / flank.root_safety], rel=1e-12)
        assert spectra["flank", flank.name].spectrum.ratio == pytest.approx([1.0 / flank.contact_safety], rel=1e-12)


def test_a_reversed_load_case_loads_the_other_flanks_and_the_same_roots(planetary):
    """Flanks of a planet change their mates; roots of sun and ring alternate by the given Y_M."""
    spectra = spectra_of(planetary, (50.0, 540.0, 0.6), (-80.0, 540.0, 0.4), reversal_factor=0.8)
    forward, back = (rate_case(planetary, torque=torque).flanks for torque in (50.0, 80.0))
    ratio = {name: rated.spectrum.ratio for name, rated in spectra.items()}
    assert ratio["flank", "planet, sun side"] == pytest.approx(
        [1.0 / forward[1].contact_safety, 1.0 / back[2].contact_safety]
    )
    assert ratio["flank", "planet, ring side"] == pytest.approx(
        [1.0 / forward[2].contact_safety, 1.0 / back[1].contact_safety]
    )
    assert ratio["flank", "sun"] == pytest.approx([1.0 / forward[0].contact_safety, 0.0])
    assert ratio["flank", "sun, back flank"] == pytest.approx([0.0, 1.0 / back[0].contact_safety])
    assert spectra["flank", "ring, back flank"].torque.tolist() == [0.0, -80.0]
    for place, name, factor in ((0, "sun", 0.8), (1, "planet, sun side", 1.0), (3, "ring", 0.8)):
        expected = [1.0 / flanks[place].root_safety / factor for flanks in (forward, back)]
        assert ratio["root", name] == pytest.approx(expected, rel=1e-12)
    cycles = spectra["root", "sun"].spectrum.cycles
    assert cycles == pytest.approx(3600.0 * 540.0 / 9.0 * np.array([0.6, 0.4]))


def test_load_cases_without_load_count_in_the_time_alone(planetary):
    idle = spectra_of(planetary, (0.0, 540.0, 0.5), (50.0, 540.0, 0.5))
    alone = spectra_of(planetary, (50.0, 540.0, 0.5))
    for name, rated in idle.items():
        assert rated.spectrum.ratio[0] == 0.0
        assert rated.spectrum.hours == alone[name].spectrum.hours
        # no load cycle, of roots or of flanks: the equivalent torque is that of the other
        assert rated.spectrum.cycles[0] == 0.0 and rated.equivalent_torque == pytest.approx(50.0)
    assert not spectra_of(planetary, (0.0, 540.0, 1.0))


def test_gears_without_a_limit_or_a_treatment_have_none():
    pair = with_values(read_case(CASES / "spur_pair.toml"), {"material.treatment": None, "material.hardness": None})
    assert not spectra_of(with_values(pair, {"material.root_stress_limit": "430 MPa"}), (200.0, 600.0, 1.0))
    given = {"gear_2.material.treatment": "nitrided steel", "gear_2.material.root_stress_limit": "400 MPa"}
    mixed = spectra_of(with_values(pair, given | {"gear_2.material.hardness": 700}), (200.0, 600.0, 1.0))
    assert list(mixed) == [("root", "gear 2"), ("flank", "gear 2")]
    assert mixed["root", "gear 2"].spectrum.line is GEAR_STEELS["nitrided steel"].root_life


def test_variables_are_those_of_the_spectra(planetary):
    spectra = tuple(spectra_of(planetary, (400.0, 540.0, 0.25), (100.0, 540.0, 0.75)).values())
    variables, coords = tooth_life_variables(spectra, 1000.0), tooth_life_coordinates(spectra)
    root = spectra[0]
    assert variables["root_damage"][1][0] == pytest.approx(1000.0 / root.spectrum.hours)
    assert variables["root_spectrum_safety"][1][0] == root.spectrum.safety(1000.0)
    assert variables["root_damage_share"][1].shape == (2, len(coords["root"][1]))
    # stresses of roots go with the torque, of flanks with its root
    for rated, factor in ((root, 1.0), (spectra[-1], 0.5)):
        exponent = factor * rated.spectrum.line.slope
        assert rated.equivalent_torque == equivalent_torque([400.0, 100.0], [0.25, 0.75], exponent)
    without = tooth_life_variables(spectra, None)
    assert all(math.isnan(value) for value in without["flank_spectrum_safety"][1])
    assert tooth_life_variables((), None) == {} and tooth_life_coordinates(()) == {}


def test_roots_that_load_cases_bend_both_ways_say_so(planetary):
    """Sun and ring have the reversal factor of the section strength, planets their Y_M under every load."""
    forth, back = (50.0, 540.0, 0.9), (-0.001, 540.0, 0.1)
    spectra = spectra_of(planetary, forth, (0.0, 540.0, 0.0), back)
    factors = {name: rated.reversal_factor for (kind, name), rated in spectra.items() if kind == "root"}
    assert factors == {"sun": 0.7, "planet, sun side": 1.0, "planet, ring side": 1.0, "ring": 0.7}
    assert spectra["root", "sun"].bends_back.tolist() == [False, False, True]
    data = {name: variable[1] for name, variable in tooth_life_variables([*spectra.values()], None).items()}
    assert data["root_reversal_factor"] == [0.7, 1.0, 1.0, 0.7] and data["root_reversed"][2].tolist() == [1, 0, 0, 1]
    same = spectra_of(planetary, forth, (0.001, 540.0, 0.1))
    assert all(rated.reversal_factor == 1.0 and not rated.bends_back.any() for rated in same.values())
