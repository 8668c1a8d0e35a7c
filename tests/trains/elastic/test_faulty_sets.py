"""Faults of teeth through all stages: lines at a fixed sensor lie where the turns of the faulty gear put them."""

import math

import numpy as np
import pytest

from femgear.run import solve
from femgear.trains.reading import parse_case, with_values

SET = """
format = 1
title = "{sun}/{planet}/{ring}"
set = {{ planets = {planets}, face_width = "20 mm"{angles} }}
material = {{ youngs_modulus = "206 GPa", poisson_ratio = 0.3, density = "7850 kg/m^3" }}
operation = {{ input = "sun", fixed = "ring", torque = "30 N m", speeds = ["900 rpm"] }}
static = {{ flank_elements = 4, positions = 8, stresses = false }}
dynamics = {{ damping_ratio = 0.05, mesh_harmonics = 2, response_harmonics = 4 }}
sun = {{ teeth = {sun}, module = "2 mm", pressure_angle = "20 deg", profile_shift = 0.0, bore_radius = "8 mm"{of_sun} }}
planet = {{ teeth = {planet}, bore_radius = "8 mm", bearing_stiffness = "3e8 N/m"{of_planet} }}
ring = {{ teeth = {ring}, outer_radius = "{outer} mm", {foundation} }}
housing = {{ sensor_angle = "10 deg"{bolts} }}
"""
WORN = ', fault = [{{ kind = "wear", tooth = 2, flank = "{flank}", depth = "6 um" }}]'
NONE = {"of_sun": "", "of_planet": ""}
FOUNDATION = 'foundation_radial = "1e10 N/m^3", foundation_tangential = "1e10 N/m^3"'
BOLT = '{ angle = "20 deg", radial_stiffness = "2e8 N/m", tangential_stiffness = "1e8 N/m" }'


def lines_of(teeth, planets, of, *, bolted=False, angles=""):
    """Orders of the carrier and amplitudes over the largest, at a sensor of a set with a worn tooth."""
    sun, planet, ring = teeth
    text = SET.format(
        sun=sun,
        planet=planet,
        ring=ring,
        planets=planets,
        angles=f", planet_angles = [{angles}]" if angles else "",
        outer=ring + 8,
        foundation=FOUNDATION,
        of_sun=WORN.format(flank="left") if of == "sun" else "",
        of_planet=WORN.format(flank="sun side") if of == "planet" else "",
        bolts=f", nodal_diameters = 2, support = [{BOLT}]" if bolted else "",
    )
    data = solve(parse_case(text, name="set"))["housing"].dataset()
    lines = np.abs(data["lines_real"].values + 1j * data["lines_imag"].values)[0]
    return data["order"].values, lines / lines.max()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("teeth", "planets", "of", "bolted"),
    [
        ((16, 16, 48), 4, "sun", False),
        ((18, 18, 54), 3, "sun", False),
        ((18, 18, 54), 3, "sun", True),
        ((18, 21, 60), 3, "planet", False),
        ((15, 15, 45), 5, "sun", False),
    ],
)
def test_lines_of_a_fault_lie_at_whole_multiples_of_its_step(teeth, planets, of, bolted):
    """``L = N q + m S``, S the turns of the sun; of one planet q is any whole number and S = z_r/z_p."""
    order, lines = lines_of(teeth, planets, of, bolted=bolted)
    sun, planet, ring = teeth
    step = math.gcd(planets * sun, sun + ring) / sun if of == "sun" else math.gcd(planet, ring) / planet
    number = order / step
    off = np.abs(number - np.rint(number)) > 1e-6
    assert lines[off].max(initial=0.0) < 1e-6
    there = np.rint(number[lines > 1e-5]).astype(int)
    assert np.gcd.reduce(there) == 1


@pytest.mark.slow
def test_planets_at_unequal_angles_are_heard_at_every_turn_of_the_carrier():
    """``L = q + m S`` with any whole q: of 18/18/54 all whole orders."""
    order, lines = lines_of((18, 18, 54), 3, "sun", angles='"0 deg", "120 deg", "245 deg"')
    assert lines[np.abs(order - np.rint(order)) > 1e-6].max(initial=0.0) < 1e-6
    assert np.gcd.reduce(np.rint(order[lines > 1e-5]).astype(int)) == 1


@pytest.mark.slow
def test_a_crack_without_depth_and_a_list_without_faults_change_not_one_bit():
    text = SET.format(
        sun=18, planet=18, ring=54, planets=3, angles="", outer=62, foundation=FOUNDATION, bolts="", **NONE
    )
    whole = parse_case(text, name="set")
    crack = {"kind": "crack", "tooth": 2, "flank": "left", "depth": "0 mm"}
    healthy, *others = (
        solve(with_values(whole, change), only="static")["static"].dataset()
        for change in ({}, {"sun.fault": []}, {"sun.fault": [crack]})
    )
    for data in others:
        assert data.identical(healthy)
