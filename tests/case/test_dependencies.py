"""Which steps notice which entries."""

import pytest
from case.test_sections import CASES

from femgear.case.dependencies import (
    box_entries,
    compliance_entries,
    dynamic_entries,
    fingerprint,
    modal_entries,
    ring_entries,
    static_entries,
    stress_entries,
)
from femgear.trains.reading import read_case, with_value


@pytest.fixture(scope="module")
def case():
    return read_case(CASES / "planetary_27_40_108.toml")


KINDS = (static_entries, compliance_entries, ring_entries, modal_entries, dynamic_entries)


@pytest.mark.parametrize(
    "key, value, changes",
    [
        ("ring.material.youngs_modulus", "110 GPa", (True,) * 5),
        ("planet.material.poisson_ratio", 0.28, (True,) * 5),
        ("ring.material.density", "7100 kg/m^3", (False, True, True, True, True)),
        ("sun.face_width", "26 mm", (True,) * 5),
        ("ring.material.root_stress_limit", "306 MPa", (False,) * 5),
    ],
)
def test_steps_notice_what_they_depend_on(case, key, value, changes):
    other = with_value(case, key, value)
    assert tuple(fingerprint(kind(case)) != fingerprint(kind(other)) for kind in KINDS) == changes


def test_the_edition_of_the_standard_decides_nominal_stresses_alone(case):
    other = with_value(case, "strength.edition", 2006)
    assert stress_entries(other) != stress_entries(case)
    assert static_entries(other) == static_entries(case) and modal_entries(other) == modal_entries(case)


@pytest.mark.parametrize("stage", ["modes", "dynamics", "runup"])
def test_a_limit_of_a_sensor_computes_nothing_again(stage):
    plain = read_case(CASES / "five_megawatt_chain.toml")
    limited = with_value(plain, "sensor[0].level_limit", "30 m/s^2")
    assert box_entries(stage, limited) == box_entries(stage, plain)
    assert box_entries(stage, with_value(plain, "gravity", {"direction": [1.0, 0.0, 0.0]})) != box_entries(stage, plain)
