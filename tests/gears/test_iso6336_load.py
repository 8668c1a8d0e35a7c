"""Load factors of ISO 6336-1: limits and joints of its formulas; published values are rows of docs/validation.md."""

import math

import pytest

from femgear.errors import GeometryError
from femgear.gears.iso6336_load import (
    disc_inertia,
    dynamic_factor,
    dynamic_factor_of_speed,
    face_load_factor,
    face_running_in,
    mesh_misalignment_of_tolerances,
    reduced_mass,
    resonance_speed,
    running_in,
    transverse_load_factors,
)
from validation.strength import first_stage

MESH = {
    "line_load": 800e3,
    "stiffness": 14e9,
    "contact_ratio": 1.6,
    "pitch_deviation": 10e-6,
    "profile_deviation": 12e-6,
}


def test_reduced_masses_of_the_published_stage():
    """0.6606 and 2.4597 kg/mm of steel of 7830 kg/m^3; a fixed ring is an endless mass."""
    sun, planet, ring = (disc_inertia(gear, 7830.0) for gear in first_stage().gears)
    assert 1e-3 * reduced_mass(sun / 3, planet) == pytest.approx(0.6606, abs=5e-5)
    assert 1e-3 * reduced_mass(planet) == pytest.approx(2.4597, abs=5e-5)
    assert ring > planet and reduced_mass(planet, ring) < planet
    # n_E1 = 30000/(pi z_1) sqrt(c_gammaalpha/m_red) in 1/min, N/(mm um) and kg/mm
    assert 30.0 / math.pi * resonance_speed(19, 13.426e9, 660.6) == pytest.approx(2266, abs=1)


def test_dynamic_factor_over_the_speed():
    """Ranges meet at 1.15 and 1.5 times the resonance, and the factor begins at 1."""
    at = {ratio: dynamic_factor(resonance_ratio=ratio, **MESH) for ratio in (0.0, 0.4, 0.86, 1.15, 1.1501, 1.4999, 1.5)}
    assert at[0.0].factor == 1.0
    assert [factor.range for factor in at.values()] == [
        "subcritical",
        "subcritical",
        "main resonance",
        "main resonance",
        "intermediate",
        "intermediate",
        "supercritical",
    ]
    assert at[1.1501].factor == pytest.approx(at[1.15].factor, abs=1e-3)
    assert at[1.4999].factor == pytest.approx(at[1.5].factor, abs=1e-3)
    # K = 0.32 B_p + 0.34 B_f + 0.23 B_k, with B_p 0.175, B_f 0.21
    assert at[0.4].factor == pytest.approx(1.0 + 0.4 * (0.32 * 0.175 + 0.34 * 0.21 + 0.23))
    relieved = dynamic_factor(resonance_ratio=0.4, tip_relief=30e-6, **MESH).factor
    assert at[0.4].factor - relieved == pytest.approx(0.4 * 0.23 * 0.525)
    # light loads widen the resonance: N_S = 0.5 + 0.35 sqrt(25/100)
    light = MESH | {"line_load": 25e3}
    assert dynamic_factor(resonance_ratio=0.68, **light).range == "main resonance"
    assert dynamic_factor(resonance_ratio=0.67, **light).range == "subcritical"
    with pytest.raises(GeometryError):
        dynamic_factor(resonance_ratio=0.4, **(MESH | {"contact_ratio": 0.9}))


def test_dynamic_factor_of_class_and_speed():
    """K_1 14.9, K_2 0.0193 of spur teeth of class 6, 13.3 and 0.0087 of helical ones; overlap in between."""
    load = {"grade": 6, "teeth": 20, "speed": 5.0, "ratio": 3.0, "line_load": 200e3}
    turned = math.sqrt(0.9)
    spur = 1.0 + (14.9 / 200.0 + 0.0193) * turned * (2.071 - 0.357 * turned)
    helical = 1.0 + (13.3 / 200.0 + 0.0087) * turned * (2.071 - 0.357 * turned)
    assert dynamic_factor_of_speed(**load) == pytest.approx(spur)
    assert dynamic_factor_of_speed(**load, overlap=1.4) == pytest.approx(helical)
    assert dynamic_factor_of_speed(**load, overlap=0.5) == pytest.approx(0.5 * (spur + helical))
    slow = load | {"speed": 0.5}
    assert dynamic_factor_of_speed(**slow) == pytest.approx(1.0 + (14.9 / 200.0 + 0.0193) * 0.1 * turned * 2.0)
    with pytest.raises(GeometryError) as caught:
        dynamic_factor_of_speed(**(load | {"grade": 2}))
    assert caught.value.code == "E-ISO6336"


def test_transverse_factors_stay_between_one_and_one_pair():
    """A pair that carries all: eps_gamma/(eps_alpha Z_eps^2) and eps_gamma/(0.25 eps_alpha + 0.75)."""
    spur = {"line_load": 500e3, "mesh_stiffness": 20e9, "contact_ratio": 1.6, "overlap": 0.0}
    assert transverse_load_factors(**spur, pitch_deviation=0.0) == (1.0, 1.0)
    assert transverse_load_factors(**spur, pitch_deviation=1e-3) == pytest.approx((1.0 / 0.8, 1.6 / 1.15))
    assert transverse_load_factors(**spur, pitch_deviation=30e-6)[0] == pytest.approx(0.8 * (0.9 + 0.4 * 1.2))
    wide = spur | {"overlap": 1.2}
    factor = 0.9 + 0.4 * math.sqrt(2.0 * 1.8 / 2.8) * 1.2
    assert transverse_load_factors(**wide, pitch_deviation=30e-6)[1] == pytest.approx(factor)


def test_face_load_factor_is_that_of_linear_teeth():
    """Up to 2 the whole width carries, beyond it a triangle that does not reach the end."""
    assert face_load_factor(0.0, 100e3, 11e9) == 1.0
    assert face_load_factor(10e-6, 100e3, 11e9) == pytest.approx(1.55)
    assert face_load_factor(100e-6 / 5.5, 100e3, 11e9) == pytest.approx(2.0)
    assert face_load_factor(60e-6, 100e3, 11.084e9) == pytest.approx(3.647, abs=5e-4)


def test_misalignment_of_tolerances_has_a_least_value():
    """By hand: 1.33 * 0.023 * 200 (20/50)^2 = 0.979 um bent, sqrt(6^2 + 8^2) = 10 um of manufacture."""
    slopes, size = (6e-6, 8e-6), {"width": 20e-3}
    bent = mesh_misalignment_of_tolerances(200e3, slopes, **size, pinion_diameter=50e-3)
    assert bent == pytest.approx(10e-6 + 1.33 * 0.023e-6 * 200.0 * 0.16, rel=1e-12)
    assert mesh_misalignment_of_tolerances(200e3, slopes, **size) == pytest.approx(10e-6)
    # 0.005 um mm/N of the load
    assert mesh_misalignment_of_tolerances(3000e3, slopes, **size) == pytest.approx(15e-6)


def test_running_in_by_material_and_speed():
    """NREL stage 1 prints y_p 2.325 um of f_pb 31 um; surface hardened flanks run in by 3 um at most."""
    hard = {"contact_limit": 1500e6, "speed": 1.6}
    assert running_in(31e-6, "surface hardened", **hard) == pytest.approx(2.325e-6)
    assert running_in(90e-6, "surface hardened", **hard) == 3e-6
    soft = {"contact_limit": 640e6, "speed": 12.0}
    assert running_in(20e-6, "through hardened", **(soft | {"speed": 3.0})) == pytest.approx(5e-6)
    assert running_in(80e-6, "through hardened", **soft) == pytest.approx(10e-6)
    assert running_in(80e-6, "cast iron", **(soft | {"speed": 7.0})) == 22e-6
    assert face_running_in(20e-6, "surface hardened", **hard) == pytest.approx(3e-6)
    assert face_running_in(20e-6, "through hardened", **soft) == pytest.approx(10e-6)
    assert face_running_in(100e-6, "cast iron", **soft) == 22e-6
    assert face_running_in(20e-6, "through hardened", contact_limit=200e6, speed=1.0) == 20e-6
