"""Variables and limits of a search: reliefs on the loaded flanks, words of the command line, refusals."""

import pytest
from casings import casing_tables
from small_gearbox import pair_tables
from study.test_designs import CASE, SPEEDS

from femgear.case.quantities import FREQUENCY
from femgear.errors import CaseError
from femgear.study.objectives import (
    StudyQuantity,
    mesh_force,
    named_quantity,
    natural_frequency,
    root_stress,
    transmission_error,
)
from femgear.study.problem import parse_limit, parse_variable, tip_reliefs
from femgear.trains.reading import read_case, with_values


@pytest.fixture(scope="module")
def coarse(coarse_states):
    """The reference set with reliefs of no amount, coarse."""
    case, _ = tip_reliefs(read_case(CASE))
    return with_values(case, {"static.flank_elements": 4, "static.positions": 14, "static.stresses": False})


def test_reliefs_are_on_the_loaded_flanks(coarse):
    case, variables = tip_reliefs(coarse)
    assert len(case.sun.modifications) == 2 and len(case.planet.modifications) == 4
    assert [v.name for v in variables][:2] == [
        "sun.modifications[1].amount",
        "sun.modifications[1].start_diameter",
    ]
    assert variables[0].bounds == (0.0, pytest.approx(1e4 * case.sun.module))
    reverse, _ = tip_reliefs(with_values(read_case(CASE), {"operation.torque": "-100 N m"}))
    assert [one.flank for one in reverse.planet.modifications] == ["ring side", "sun side"]


def test_words_of_the_command_line():
    assert named_quantity("STE  sun-planet").name == transmission_error("sun-planet").name
    assert transmission_error(torque="50 N m").torque == 50.0
    assert named_quantity("natural frequency  11").name == natural_frequency(11).name
    limit = parse_limit("root stress sun <= 300 MPa")
    assert limit.high == 300e6 and limit.violation(330e6) == pytest.approx(0.1)
    assert parse_limit("contact ratio planet-ring >= 1.3").low == 1.3
    variable = parse_variable("sun.modifications[0].start_diameter = 43 mm..44 mm +- 50 um")
    assert variable.bounds == (43.0, 44.0) and variable.tolerance_at(43.5) == pytest.approx(0.05)
    assert parse_variable("sun.profile_shift=-0.1..0.3").bounds == (-0.1, 0.3)
    together = parse_variable("sun.modifications[0].amount, planet.modifications[0].amount=0 um..5 um")
    assert together.keys == ("sun.modifications[0].amount", "planet.modifications[0].amount")


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: named_quantity("noise"), "no such quantity"),
        (lambda: named_quantity("natural frequency 0"), "no mode"),
        (lambda: StudyQuantity("mine", FREQUENCY, "fe", float), "no such stage"),
        (lambda: named_quantity("mesh force"), "range of speeds"),
        (lambda: transmission_error(torque="0 N m"), "no tooth bends"),
        (lambda: transmission_error(torque="5 mm"), "not a unit of torque"),
        (lambda: mesh_force("3500 rpm", "1000 rpm"), "not a range of speeds"),
        (lambda: mesh_force(*SPEEDS, part="mean"), "no such part"),
        (lambda: transmission_error("ring"), "no such mesh"),
        (lambda: root_stress("carrier"), "no such gear"),
        (lambda: parse_limit("root stress sun = 3 MPa"), "not a limit"),
        (lambda: parse_limit("root stress sun <= 3 um"), "not a unit of stress"),
        (lambda: parse_limit("contact ratio sun-planet >= much"), "not a number"),
        (lambda: parse_variable("sun.profile_shift"), "not a design variable"),
        (lambda: parse_variable("sun.profile_shift=1..0"), "wrong order"),
    ],
)
def test_refusals(call, message):
    with pytest.raises(CaseError, match=message):
        call()


def test_limits_of_a_gearbox_have_units_of_its_key_figures():
    tables = pair_tables(teeth=True)
    tables["bearing"][0] = {"name": "A", "shaft": "input", "position": "5 mm", "kind": "ball", "rolling_elements": 9}
    tables["bearing"][0] |= {"element_diameter": "9.5 mm", "pitch_diameter": "46 mm", "dynamic_rating": "19.5 kN"}
    tables |= {"casing": casing_tables(), "sensor": [{"name": "top", "position": ["0 mm"] * 3, "direction": "y"}]}
    case = read_case(tables)
    limits = {"level dB top <= 140 dB": 140.0, "K_Hbeta stage <= 1.2": 1.2, "STE <= 2 um": 2e-6}
    for text, bound in limits.items():
        assert parse_limit(text, case=case).high == pytest.approx(bound)
    assert parse_limit("bearing life >= 7200 s", case=case).low == pytest.approx(2.0)
    assert parse_limit("bearing life a >= 20000 h", case=case).low == 20000.0
    with pytest.raises(CaseError, match="E-UNIT"):
        parse_limit("bearing life >= 20 mm", case=case)
