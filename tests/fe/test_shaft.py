"""Timoshenko shafts against closed forms, an exact transfer matrix and a rotor-dynamics library."""

import math

import numpy as np
import pytest
from scipy.linalg import eigh, eigvals

from femgear.errors import CaseError
from femgear.fe.shaft import RoundSection, beam_element, joint_deflections
from validation.timoshenko import Disc, Support, free_bending, shaft_system, simply_supported

SECTION = RoundSection(0.1, 0.02)
LENGTH, COUNT = 1.0, 24
DISCS = (Disc(6, 20.0, 0.18, 0.10), Disc(16, 35.0, 0.50, 0.30))


def shaft(count=COUNT, **options):
    return shaft_system([SECTION] * count, [LENGTH / count] * count, **options)


def natural(system):
    """[Hz], ascending."""
    return np.sqrt(np.abs(eigh(system.K, system.M, eigvals_only=True))) / (2.0 * np.pi)


def test_rigid_motions_have_the_exact_mass():
    M, K, G = beam_element(SECTION, LENGTH)
    mass = SECTION.density * SECTION.area * LENGTH
    move, turn = np.zeros(10), np.zeros(10)
    move[[0, 5]] = 1.0
    turn[[3, 8]], turn[0], turn[5] = 1.0, -0.5 * LENGTH, 0.5 * LENGTH
    inertia = mass * LENGTH**2 / 12.0 + SECTION.density * SECTION.second_moment * LENGTH
    assert move @ M @ move == pytest.approx(mass, rel=1e-13)
    assert turn @ M @ turn == pytest.approx(inertia, rel=1e-13)
    assert np.abs(K @ np.stack([move, turn], axis=1)).max() < 1e-6
    about_x = np.zeros(10)
    about_x[[2, 7]], about_x[1], about_x[6] = 1.0, 0.5 * LENGTH, -0.5 * LENGTH
    # a rigid shaft has the angular momentum of a disc
    polar = 2.0 * SECTION.density * SECTION.second_moment * LENGTH
    assert about_x @ G @ turn == pytest.approx(polar, rel=1e-13)
    assert np.array_equal(G, -G.T)


@pytest.mark.parametrize(("discs", "top"), [((), 2500.0), (DISCS, 2150.0)])
def test_free_shaft_against_the_characteristic_equation(discs, top):
    places = [(d.station / COUNT * LENGTH, d) for d in discs]
    wanted = np.array(free_bending(SECTION, LENGTH, 100.0, top, discs=places))
    assert len(wanted) >= 3
    errors = []
    for factor in (2, 4):
        stations = tuple(Disc(d.station * factor, d.mass, d.polar, d.transverse) for d in discs)
        ours = natural(shaft(COUNT * factor, discs=stations))
        errors.append([np.min(np.abs(ours / one - 1.0)) for one in wanted])
    errors = np.array(errors)
    assert np.all(errors[1] < 1e-3)
    # second order in the length of the elements
    np.testing.assert_allclose(errors[0] / errors[1], 4.0, rtol=0.1)


def test_simply_supported_shaft_against_its_closed_form():
    count = 96
    ours = natural(shaft(count, supports=(Support(0, math.inf), Support(count, math.inf))))
    for number in (1, 2, 3):
        wanted = simply_supported(SECTION, LENGTH, number)
        assert np.min(np.abs(ours / wanted - 1.0)) < 2e-4


def test_torsion_of_a_free_shaft():
    """``f_n = n / (2 l) sqrt(G / rho)``."""
    ours = natural(shaft(96))
    wanted = math.sqrt(SECTION.shear_modulus / SECTION.density) / (2.0 * LENGTH)
    assert np.min(np.abs(ours / wanted - 1.0)) < 1e-4


# damped natural frequencies [Hz] by ross-rotordynamics 2.3.0 (Petrobras, UFRJ): the same 24 elements, steel
# of 206 GPa, 0.3 and 7850 kg/m^3, discs as above; bearings of 5e7 and 8e7 N/m at the ends; 0 and 1000 rad/s.
# Its axial modes, which femgear leaves out, are not in the lists.
ROSS_FREE = (452.333793, 1189.288296, 1589.615652, 2195.991369, 3186.042934, 3393.854392)
ROSS_DISCS = (377.474134, 562.711177, 835.190445, 1324.163334, 2108.046811)
ROSS_BEARINGS = (106.033701, 275.141073, 562.711176, 575.650784, 947.624003, 1380.710501)
ROSS_TURNING = (
    104.871976,
    107.138874,
    269.019913,
    280.980129,
    539.582438,
    562.711177,
    611.726325,
    931.268824,
    963.704651,
)
BEARINGS = (Support(0, 5e7), Support(COUNT, 8e7))


@pytest.mark.parametrize(
    ("options", "wanted"),
    [
        ({}, ROSS_FREE),
        ({"discs": DISCS}, ROSS_DISCS),
        ({"discs": DISCS, "supports": BEARINGS}, ROSS_BEARINGS),
    ],
)
def test_against_the_rotor_dynamics_library(options, wanted):
    ours = natural(shaft(**options))
    assert max(np.min(np.abs(ours / one - 1.0)) for one in wanted) < 2e-6


def test_whirl_against_the_rotor_dynamics_library():
    system = shaft(discs=DISCS, supports=BEARINGS)
    n = len(system.M)
    damping = 1000.0 * system.gyroscopic
    zero, one = np.zeros((n, n)), np.eye(n)
    poles = eigvals(np.block([[zero, one], [-system.K, -damping]]), np.block([[one, zero], [zero, system.M]]))
    ours = np.abs(poles.imag) / (2.0 * np.pi)
    assert max(np.min(np.abs(ours / wanted - 1.0)) for wanted in ROSS_TURNING) < 2e-6


def test_two_links_are_the_static_beam():
    """Tip of a cantilever under a force and a moment, and a simple span: Timoshenko's deflections."""
    length = 0.4
    K = beam_element(SECTION, length)[1][5:, 5:]
    bend, phi = SECTION.young * SECTION.second_moment, SECTION.shear_ratio(length)
    tip = np.linalg.solve(K, np.array([1.0, 0.0, 0.0, 0.0, 0.0]))
    assert tip[0] == pytest.approx(length**3 / (3.0 * bend) * (1.0 + 0.25 * phi), rel=1e-12)
    assert tip[3] == pytest.approx(length**2 / (2.0 * bend), rel=1e-12)
    moment = np.linalg.solve(K, np.array([0.0, 0.0, 0.0, 1.0, 0.0]))
    assert moment[3] == pytest.approx(length / bend, rel=1e-12)


def test_joint_does_not_see_rigid_motions():
    rows = joint_deflections(0.7)
    turn = np.zeros(10)
    turn[[3, 8]], turn[5] = 1.0, 0.7
    assert np.abs(rows @ turn).max() < 1e-15
    assert np.linalg.matrix_rank(rows) == 5


@pytest.mark.parametrize(
    "make",
    [
        lambda: RoundSection(0.0),
        lambda: RoundSection(0.1, 0.1),
        lambda: RoundSection(math.nan),
        lambda: shaft(discs=(Disc(25, 1.0, 1.0, 1.0),)),
    ],
)
def test_shafts_that_cannot_be_are_refused(make):
    with pytest.raises(CaseError, match="E-SHAFT"):
        make()


def test_joint_of_two_halves_stores_the_energy_of_the_beam_under_an_end_load():
    """2 (F L / 2)^2 / (2 k) with k = (3 E I / 2 L) / (1 + Phi / 4), against 24 elements."""
    system = shaft(supports=(Support(0, math.inf, math.inf),))
    plane = [i for i, name in enumerate(system.dofs) if name.endswith((": x", ": tilt y"))]
    force = np.array([float(system.dofs[i] == f"station {COUNT + 1}: x") for i in plane])
    energy = 0.5 * force @ np.linalg.solve(system.K[np.ix_(plane, plane)], force)
    s, bending = SECTION, SECTION.young * SECTION.second_moment
    phi = 12.0 * bending / (s.shear_coefficient * s.shear_modulus * s.area * LENGTH**2)
    spring = 1.5 * bending / LENGTH / (1.0 + phi / 4.0)
    assert 2.0 * (LENGTH / 2.0) ** 2 / (2.0 * spring) == pytest.approx(energy, rel=1e-9)


def test_shafts_of_the_printed_springs_are_those_of_the_page():
    """docs/drivetrain.md: diameter over length by reading of Eqs. 10 and 11, sizes of the first one."""
    import re
    from pathlib import Path

    from published.wind_turbine_drivetrain import PRINTED

    page = (Path(__file__).parents[2] / "docs" / "drivetrain.md").read_text(encoding="utf-8")
    springs = (PRINTED.low_speed, PRINTED.intermediate, PRINTED.high_speed)
    round_shaft = RoundSection(0.1)
    shear = 12.0 * 2.6 / 16.0 / round_shaft.shear_coefficient
    assert shear == pytest.approx(2.20, abs=5e-3)
    readings = {"energy for each half": (1.5, 4), "beams of half": (6.0, 1), "joint in the middle": (3.0, 1)}
    for name, (factor, part) in readings.items():
        row = next(line for line in page.splitlines() if re.match(rf"\| \**{name}", line))
        cells = [float(cell) for cell in row.strip("|").split("|")[2:]]
        assert cells[0] == pytest.approx(1.3 * factor)
        for (bending, torsion), shown in zip(springs, cells[1:], strict=True):
            slender = math.sqrt(part * (1.3 * factor * torsion / bending - 1.0) / shear)
            assert f"{slender:.2f}" == f"{shown:.2f}"
    assert all(0.75 * 1.3 < bending / torsion for bending, torsion in springs)
    sizes = []
    for bending, torsion in springs:
        slender = math.sqrt(4.0 * (1.95 * torsion / bending - 1.0) / shear)
        cubed = torsion / round_shaft.shear_modulus * 32.0 / math.pi / slender
        sizes.append((cubed ** (1 / 3), cubed ** (1 / 3) / slender))
    words = "{}, {} and {} mm diameter and {}, {} and {} m length"
    found = [f"{1e3 * d:.0f}" for d, _ in sizes] + [f"{length:.2f}" for _, length in sizes]
    assert words.format(*found) in " ".join(page.split())
