"""Carriers by closed forms: bars held at one and at both ends, webs and tubes between cheeks, what is refused."""

import math

import numpy as np
import pytest
from small_gearbox import planetary_tables

from femgear.errors import CaseError
from femgear.fe.beam import RoundSection, beam_element, rigid_link
from femgear.trains.gearbox.carrier import compliance_springs, pin_axes, pin_compliance, torque_end, wind_up_stiffness
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.modes import solve_gearbox_modes
from femgear.trains.reading import read_case

PINS = {"diameter": "20 mm", "length": "18 mm"}
WEBS = {"web_outer_diameter": "90 mm", "web_inner_diameter": "70 mm"}
ANGLES = 2.0 * math.pi / 3.0 * np.arange(3)
G = 2.06e11 / 2.6
SECTION = RoundSection(0.02)


def stage_of(**entries):
    case = read_case(planetary_tables(**entries))
    return case, case.planetary[0]


def in_axes(compliance, psi, number):
    """Block (6, 6) of a pin in its own axes."""
    turned = np.kron(np.eye(2), pin_axes(psi))
    part = slice(6 * number, 6 * number + 6)
    return turned @ compliance[part, part] @ turned.T


def test_a_pin_in_one_cheek_is_a_cantilever():
    case, stage = stage_of(pins=PINS | {"cheeks": 1})
    own = in_axes(pin_compliance(case, stage, ANGLES), ANGLES[1], 1)
    L, EI = 0.018, SECTION.bending_stiffness
    assert own[0, 0] == pytest.approx(L**3 / (3.0 * EI) + L / SECTION.shear_stiffness, rel=1e-9)
    assert own[1, 1] == pytest.approx(own[0, 0], rel=1e-9)
    assert own[3, 3] == pytest.approx(L / EI, rel=1e-9)
    # the cheek lies at z > 0: a force around the axis tilts the free end about the radius, further out at z < 0
    assert own[3, 1] == pytest.approx(L**2 / (2.0 * EI), rel=1e-9)
    assert own[2, 2] == pytest.approx(L / (2.06e11 * SECTION.area), rel=1e-9)
    other = stage_of(pins=PINS | {"cheeks": 1}, carrier_body={"torque_end": "front"})
    turned = in_axes(pin_compliance(*other, ANGLES), ANGLES[1], 1)
    assert turned[3, 1] == pytest.approx(-own[3, 1], rel=1e-9)


def test_a_pin_in_two_cheeks_is_clamped_at_both_ends():
    case, stage = stage_of(pins=PINS)
    compliance = pin_compliance(case, stage, ANGLES)
    own = in_axes(compliance, ANGLES[2], 2)
    L, EI, shear = 0.018, SECTION.bending_stiffness, 0.018 / SECTION.shear_stiffness
    assert own[0, 0] == pytest.approx(L**3 / (24.0 * EI) + 0.5 * shear, rel=1e-9)
    # a half under half of the moment, its end at the planet held against moving
    tilt = L / EI - (L**2 / (2.0 * EI)) ** 2 / (L**3 / (3.0 * EI) + shear)
    assert own[4, 4] == pytest.approx(0.5 * tilt, rel=1e-9)
    assert np.abs(own[:3, 3:]).max() < 1e-9 * own[4, 4]
    # pins in rigid cheeks know nothing of one another
    assert np.abs(compliance[:6, 6:]).max() == 0.0


@pytest.mark.parametrize(("end", "sense"), [("front", -1.0), ("back", 1.0)])
def test_even_pin_forces_wind_up_the_webs_with_the_pins_beside_them(end, sense):
    case, stage = stage_of(pins=PINS, carrier_body={"wind_up_stiffness": "1e6 N m/rad", "torque_end": end})
    compliance, a, span = pin_compliance(case, stage, ANGLES), 0.04, 0.036
    around = np.concatenate([np.append(pin_axes(psi)[1], np.zeros(3)) for psi in ANGLES])
    moved = compliance @ around
    EI = SECTION.bending_stiffness
    phi = SECTION.shear_ratio(span)
    parallel = 12.0 * EI / ((1.0 + phi) * span**3)
    wind_up = 1e6 + 3.0 * (a**2 * parallel + 2.0 * G * SECTION.second_moment / span)
    angle = 3.0 * 0.5 * a / wind_up
    alone = pin_compliance(*stage_of(pins=PINS), ANGLES)[1, 1]
    assert around[:6] @ moved[:6] == pytest.approx(alone + 0.5 * a * angle, rel=1e-9)
    # the far end is moved by a psi: a shear force V tilts the middle section of a clamped bar by V l^2/(8 E I)
    slope = pin_axes(ANGLES[0])[0] @ moved[3:6]
    assert slope == pytest.approx(sense * parallel * a * angle * span**2 / (8.0 * EI), rel=1e-9)


def test_a_tube_twists_by_its_length_over_its_rigidity():
    case, stage = stage_of(pins=PINS, carrier_body=WEBS)
    polar = math.pi / 32.0 * (0.09**4 - 0.07**4)
    assert wind_up_stiffness(case, stage) == pytest.approx(G * polar / 0.036, rel=1e-12)


def test_webs_are_bars_between_the_cheeks():
    case, stage = stage_of(pins=PINS, carrier_body=WEBS | {"web_share": 0.3})
    # a beam of the same area and second moment, and of the shear coefficient 5/6
    arc = 2.0 * math.pi * 0.3 * 0.04 / 3
    I, A, L, r = 0.01 * arc**3 / 12.0, 0.01 * arc, 0.036, 0.04
    each = 12.0 * 2.06e11 * I / L**3 / (1.0 + 12.0 * 2.06e11 * I / (5.0 / 6.0 * G * A * L**2))
    assert wind_up_stiffness(case, stage) == pytest.approx(3.0 * r**2 * each, rel=1e-12)
    assert math.isinf(wind_up_stiffness(*stage_of(pins=PINS)))


def test_pins_and_webs_are_the_beams_of_an_assembly_of_their_own():
    case, stage = stage_of(pins=PINS, carrier_body={"wind_up_stiffness": "3e5 N m/rad"})
    half = beam_element(SECTION, 0.018)[1]
    # motions: rotation of the far cheek, then six of every pin; the near cheek stands
    total = np.zeros((19, 19))
    total[0, 0] = 3e5
    for number, psi in enumerate(ANGLES):
        own = slice(1 + 6 * number, 7 + 6 * number)
        far = np.zeros((6, 19))
        far[:, 0] = rigid_link((0.04 * math.cos(psi), 0.04 * math.sin(psi), 0.0))[:, 5]
        pin = np.eye(19)[own]
        for ends in ((far, pin), (pin, np.zeros((6, 19)))):
            rows = np.vstack(ends)
            total += rows.T @ half @ rows
    expected = np.linalg.inv(total)[1:, 1:]
    found = pin_compliance(case, stage, ANGLES)
    assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()


def test_the_cheek_on_the_shaft_is_that_at_its_longer_end():
    tables = planetary_tables(pins=PINS, carrier_position="10 mm")
    del tables["mass"][1]
    seat = tables["bearing"].pop()
    tables["bearing"] += [seat | {"position": place} for place in ("30 mm", "60 mm")]
    tables["shaft"][1] |= {"start": "-10 mm", "part": [{"length": "80 mm", "outer_diameter": "40 mm"}]}
    tables["load"] = [{"name": "carrier", "shaft": "carrier", "position": "0 mm"}]
    case = read_case(tables)
    assert torque_end(case, case.planetary[0]) == 1
    tables["planetary"][0]["carrier_position"] = "70 mm"
    tables["shaft"][1]["start"] = "-70 mm"
    case = read_case(tables)
    assert torque_end(case, case.planetary[0]) == -1
    assert torque_end(*stage_of(pins=PINS)) == 1


def test_principal_directions_have_the_compliance_and_rigid_ones_are_conditions():
    rows = np.hstack([-np.eye(6), np.eye(6)])
    compliance = np.diag([2e-9, 1e-9, 0.0, 1e-6, 2e-6, 0.0])
    compliance[0, 4] = compliance[4, 0] = 1e-8
    springs = compliance_springs("pin", (0, 1), rows, compliance, 0.04)
    assert np.isinf(springs.stiffness).sum() == 2
    finite = np.isfinite(springs.stiffness)
    stiffness = springs.rows[finite].T * springs.stiffness[finite] @ springs.rows[finite]
    kept = [0, 1, 3, 4]
    assert np.allclose(stiffness[np.ix_(kept, kept)] @ compliance[np.ix_(kept, kept)], np.eye(4), atol=1e-9)


def frequencies(**entries):
    return solve_gearbox_modes(solve_deflection(read_case(planetary_tables(**entries)))).modes.frequency


def test_a_stiff_carrier_is_the_rigid_one():
    body = {"web_outer_diameter": "10 m", "web_inner_diameter": "1 m"}
    assert frequencies(pins={"diameter": "2 m", "length": "10 um"}, carrier_body=body) == pytest.approx(
        frequencies(), rel=1e-9
    )


def test_the_carrier_turned_by_a_planet_pitch_is_itself():
    entries = {"pins": PINS, "carrier_body": WEBS | {"web_share": 0.4}}
    turned = frequencies(**entries, angle=f"{2.0 * math.pi / 3.0!r} rad")
    assert turned == pytest.approx(frequencies(**entries), rel=1e-9, abs=1e-6)


def test_wind_up_tilts_planets_and_keeps_the_balance():
    stiff = solve_deflection(read_case(planetary_tables(pins=PINS)))
    soft = solve_deflection(read_case(planetary_tables(pins=PINS, carrier_body=WEBS | {"web_share": 0.3})))
    assert np.abs(stiff.mesh_slope).max() < 1e-12
    # every planet alike, its sun mesh against its ring mesh
    assert np.ptp(soft.mesh_slope[:3]) < 1e-9 * abs(soft.mesh_slope[0])
    assert abs(soft.mesh_slope[0]) * 0.02 > 1e-7
    assert soft.residual < 1e-9
    assert soft.mesh_force == pytest.approx(stiff.mesh_force, rel=1e-9)
    assert "pins of set" in solve_gearbox_modes(soft).parts


@pytest.mark.parametrize(
    ("entries", "key"),
    [
        ({"carrier_body": WEBS}, "planetary[0].pins"),
        ({"carrier_body": WEBS, "pins": PINS | {"cheeks": 1}}, "planetary[0].pins"),
        (
            {"carrier_body": WEBS | {"wind_up_stiffness": "1e5 N m/rad"}, "pins": PINS},
            "planetary[0].carrier_body.web_outer_diameter",
        ),
        ({"carrier_body": {"web_share": 0.4}, "pins": PINS}, "planetary[0].carrier_body.web_outer_diameter"),
        (
            {"carrier_body": {"web_outer_diameter": "90 mm"}, "pins": PINS},
            "planetary[0].carrier_body.web_inner_diameter",
        ),
        (
            {"carrier_body": WEBS | {"web_inner_diameter": "90 mm"}, "pins": PINS},
            "planetary[0].carrier_body.web_inner_diameter",
        ),
    ],
)
def test_entries_that_contradict_one_another_are_refused(entries, key):
    with pytest.raises(CaseError) as raised:
        read_case(planetary_tables(**entries))
    problems = getattr(raised.value, "problems", None) or (raised.value,)
    assert key in [problem.key for problem in problems]
    assert all(problem.remedy for problem in problems)
