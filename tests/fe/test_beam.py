"""Beams of shafts against closed forms, exact transfer matrices and a rotor-dynamics library."""

import math

import numpy as np
import pytest

from femgear.errors import CaseError, GeometryError
from femgear.fe import beam
from femgear.fe.beam import (
    AXES,
    RoundSection,
    ShaftPart,
    beam_element,
    beam_shaft,
    body_matrices,
    growth_load,
    joint_deflections,
    part_element,
    rigid_link,
)
from validation import shafts
from validation.shafts import BEARINGS, COUNT, DISCS, LENGTH, SECTION, divided
from validation.timoshenko import (
    Disc,
    Support,
    free_bending,
    natural_frequencies,
    shaft_system,
    simply_supported,
    whirl_frequencies,
)

ROWS = (
    shafts.statics,
    shafts.cones,
    shafts.rigid_motions,
    shafts.along_and_about,
    shafts.default_elements,
    shafts.turning,
    shafts.library,
)
BOTH = (ShaftPart(0.1, 0.03), ShaftPart(0.2, 0.05, 0.01, 0.03, 0.0))


@pytest.mark.slow
@pytest.mark.parametrize("rows", ROWS, ids=lambda rows: rows.__name__)
def test_rows_of_the_validation_pass(rows):
    assert {row.quantity: row.verdict for row in rows() if row.verdict != "passes"} == {}


@pytest.mark.parametrize(
    "rows", [shafts.turning, pytest.param(shafts.library, marks=pytest.mark.slow), shafts.rigid_motions]
)
def test_wrong_sign_of_the_distributed_gyroscopic_terms_fails(rows, monkeypatch):
    right = beam._gyroscopic
    monkeypatch.setattr(beam, "_gyroscopic", lambda tilting: -right(tilting))
    assert any(row.verdict == "FAILS" for row in rows())


def test_rigid_motions_of_an_element_have_the_exact_mass():
    M, K, G = beam_element(SECTION, LENGTH)
    # about its middle: the stations are half a length away
    motions = np.vstack([rigid_link((0.0, 0.0, z)) for z in (-0.5 * LENGTH, 0.5 * LENGTH)])
    mass = SECTION.density * SECTION.area * LENGTH
    polar = 2.0 * SECTION.density * SECTION.second_moment * LENGTH
    inertia, momentum = body_matrices(mass, polar, mass * LENGTH**2 / 12.0 + 0.5 * polar)
    np.testing.assert_allclose(motions.T @ M @ motions, inertia, rtol=1e-13, atol=1e-13)
    # a rigid shaft has the angular momentum of a disc: 2 rho I L
    np.testing.assert_allclose(motions.T @ G @ motions, momentum, rtol=1e-13, atol=1e-15)
    assert np.abs(K @ motions).max() < 1e-15 * np.abs(K).max()
    assert np.array_equal(G, -G.T)


def test_conical_element_without_taper_is_the_uniform_one():
    part = ShaftPart(0.3, 0.1, 0.04)
    conical = beam._conical_element(part, 0.05, 0.2)
    for ours, wanted in zip(conical, part_element(part, 0.05, 0.2), strict=True):
        np.testing.assert_allclose(ours, wanted, rtol=0, atol=1e-13 * np.abs(wanted).max())


def test_frequencies_of_a_cone_against_many_short_cylinders():
    part, count = ShaftPart(0.3, 0.08, 0.02, 0.05, 0.03), 128
    cone = shaft_system(beam_shaft([part], longest_element=0.3 / 64))
    sections = [part.section((i + 0.5) / count) for i in range(count)]
    cylinders = [ShaftPart(0.3 / count, one.outer_diameter, one.inner_diameter) for one in sections]
    stairs = shaft_system(beam_shaft(cylinders, longest_element=1.0))
    ours, wanted = (natural_frequencies(system)[6:14] for system in (cone, stairs))
    np.testing.assert_allclose(ours, wanted, rtol=1e-3)


def test_matrices_of_a_steep_cone():
    M, K, G = part_element(ShaftPart(0.3, 0.02, 0.0, 0.15, 0.1), 0.0, 0.3)
    assert np.linalg.eigvalsh(M).min() > 0.0
    for matrix, turned in ((M, M.T), (K, K.T), (G, -G.T)):
        np.testing.assert_allclose(matrix, turned, rtol=0, atol=1e-12 * np.abs(matrix).max())


def test_steepest_cone_is_still_exact():
    """100 times thinner at its end: the closed form of the solid cone."""
    part = ShaftPart(0.5, 0.1, end_outer_diameter=0.001)
    shaft = beam_shaft([part], longest_element=math.inf)
    tip = shafts.displacements(shaft, [(0, AXES)], {(-1, "z"): 1.0})[-1, 2]
    assert tip == pytest.approx(4.0 * 0.5 / (math.pi * part.young * 0.1 * 0.001), rel=1e-9)
    tip = shafts.displacements(shaft, [(0, AXES)], {(-1, "tilt x"): 1.0})[-1, 3]
    wanted = 64.0 / (math.pi * part.young) * (0.001**-3 - 0.1**-3) / (3.0 * 0.099 / 0.5)
    assert tip == pytest.approx(wanted, rel=1e-9)


def test_stations_at_ends_steps_and_places():
    parts = (ShaftPart(0.1, 0.03), ShaftPart(0.2, 0.05))
    shaft = beam_shaft(parts, (0.25, 0.0, 0.1 + 4e-10, 0.25 + 5e-10, 0.3), longest_element=1.0)
    np.testing.assert_allclose(shaft.stations, [0.0, 0.1, 0.25, 0.3], rtol=1e-8)
    assert [shaft.index_of(place) for place in (0.0, 0.1 + 4e-10, 0.25, 0.25 + 5e-10, 0.3)] == [0, 1, 2, 2, 3]
    assert shaft.mass.shape == shaft.stiffness.shape == shaft.gyroscopic.shape == (24, 24)
    assert np.diff(beam_shaft(parts, (0.25,), longest_element=0.03).stations).max() <= 0.03 * (1.0 + 1e-9)
    assert np.diff(beam_shaft(parts).stations).max() <= 0.3 / 16 * (1.0 + 1e-9)


def test_statics_do_not_depend_on_the_elements():
    held, load = [(0, AXES)], {(-1, "y"): 1.0, (-1, "tilt x"): 0.2, (-1, "rotation"): 3.0}
    coarse, fine = (
        shafts.displacements(beam_shaft(BOTH, longest_element=longest), held, load)[-1] for longest in (1.0, 0.01)
    )
    np.testing.assert_allclose(coarse, fine, rtol=1e-9, atol=1e-20)


def test_shaft_turned_end_for_end_is_the_same():
    turned = beam_shaft((ShaftPart(0.2, 0.03, 0.0, 0.05, 0.01), ShaftPart(0.1, 0.03)), longest_element=0.02)
    shaft = beam_shaft(BOTH, longest_element=0.02)
    count = len(shaft.stations)
    # half a turn about x reverses y, z, the tilt about y and the rotation, and the speed with it
    T = np.kron(np.eye(count)[::-1], np.diag([1.0, -1.0, -1.0, 1.0, -1.0, -1.0]))
    pairs = ((turned.mass, shaft.mass), (turned.stiffness, shaft.stiffness), (turned.gyroscopic, -shaft.gyroscopic))
    for ours, wanted in pairs:
        np.testing.assert_allclose(T @ ours @ T, wanted, rtol=0, atol=1e-12 * np.abs(wanted).max())


def test_motion_of_a_linked_point_is_that_of_a_rigid_body():
    offset, turn = np.array([0.1, -0.2, 0.3]), np.array([1e-3, 2e-3, -3e-3])
    moved = rigid_link(offset) @ np.array([1.0, 2.0, 3.0, *turn])
    np.testing.assert_allclose(moved, [*(np.array([1.0, 2.0, 3.0]) + np.cross(turn, offset)), *turn], rtol=1e-14)
    # a tilt about y moves a point ahead along x
    assert rigid_link((0.0, 0.0, 0.5))[0, 4] == 0.5


def test_body_off_its_station():
    mass, gyroscopic = body_matrices(3.0, 0.4, 0.2, 0.1)
    wanted = np.diag([3.0, 3.0, 3.0, 0.23, 0.23, 0.4])
    # the centre moves with the tilts, along x by that about y and along -y by that about x
    wanted[0, 4] = wanted[4, 0] = 0.3
    wanted[1, 3] = wanted[3, 1] = -0.3
    np.testing.assert_allclose(mass, wanted, rtol=1e-14)
    # Omega I_p tilt_y' is felt about x
    assert (gyroscopic[3, 4], gyroscopic[4, 3]) == (0.4, -0.4)
    assert np.count_nonzero(gyroscopic) == 2


@pytest.mark.parametrize(
    "make",
    [
        lambda: ShaftPart(0.0, 0.1),
        lambda: ShaftPart(0.1, 0.1, 0.1),
        lambda: ShaftPart(0.1, 0.1, 0.02, end_outer_diameter=0.02),
        lambda: ShaftPart(0.1, 0.1, end_inner_diameter=0.1),
        lambda: ShaftPart(math.nan, 0.1),
        lambda: ShaftPart(0.1, 0.1, end_outer_diameter=math.inf),
        lambda: ShaftPart(0.1, 0.1, end_outer_diameter=0.0009),
        lambda: ShaftPart(0.1, 0.1, 0.0, 0.1, 0.0995),
        lambda: ShaftPart(0.1, 0.1, young=0.0),
        lambda: ShaftPart(0.1, 0.1, poisson=0.51),
        lambda: ShaftPart(0.1, 0.1, density=-1.0),
        lambda: beam_shaft([]),
        lambda: beam_shaft([ShaftPart(0.1, 0.02), ShaftPart(0.1, 0.05, 0.03)]),
        lambda: beam_shaft([ShaftPart(0.1, 0.05, end_outer_diameter=0.02), ShaftPart(0.1, 0.05, 0.03)]),
        lambda: beam_shaft(BOTH, (0.31,)),
        lambda: beam_shaft(BOTH, (-1e-6,)),
        lambda: beam_shaft(BOTH, (math.nan,)),
        lambda: beam_shaft(BOTH, longest_element=0.0),
        lambda: beam_shaft(BOTH, (0.15,)).index_of(0.1500001),
        lambda: beam_shaft(BOTH).index_of(math.nan),
    ],
)
def test_parts_and_places_that_no_shaft_has_are_refused(make):
    with pytest.raises(GeometryError) as error:
        make()
    assert error.value.code == "E-SHAFT"
    assert error.value.limit


@pytest.mark.parametrize(("discs", "top"), [((), 2500.0), (DISCS, 2150.0)])
def test_free_shaft_against_the_characteristic_equation(discs, top):
    places = [(d.station / COUNT * LENGTH, d) for d in discs]
    wanted = np.array(free_bending(SECTION, LENGTH, 100.0, top, discs=places))
    assert len(wanted) >= 3
    errors = []
    for factor in (2, 4):
        stations = tuple(Disc(d.station * factor, d.mass, d.polar, d.transverse) for d in discs)
        ours = natural_frequencies(shaft_system(divided(COUNT * factor), discs=stations))
        errors.append([np.min(np.abs(ours / one - 1.0)) for one in wanted])
    errors = np.array(errors)
    assert np.all(errors[1] < 1e-3)
    # second order in the length of the elements
    np.testing.assert_allclose(errors[0] / errors[1], 4.0, rtol=0.1)


def test_simply_supported_shaft_against_its_closed_form():
    count = 96
    ours = natural_frequencies(shaft_system(divided(count), supports=(Support(0, math.inf), Support(count, math.inf))))
    for number in (1, 2, 3):
        wanted = simply_supported(SECTION, LENGTH, number)
        assert np.min(np.abs(ours / wanted - 1.0)) < 2e-4


# damped natural frequencies [Hz] by ross-rotordynamics 2.3.0 (Petrobras, UFRJ): the same 24 elements, steel
# of 206 GPa, 0.3 and 7850 kg/m^3, discs and bearings of the validation; 0 and 1000 rad/s.
# Axial modes are not in the lists.
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


@pytest.mark.parametrize(
    ("options", "wanted"),
    [
        ({}, ROSS_FREE),
        ({"discs": DISCS}, ROSS_DISCS),
        ({"discs": DISCS, "supports": BEARINGS}, ROSS_BEARINGS),
    ],
)
def test_against_the_rotor_dynamics_library(options, wanted):
    ours = natural_frequencies(shaft_system(divided(COUNT), **options))
    assert max(np.min(np.abs(ours / one - 1.0)) for one in wanted) < 2e-6


def test_whirl_against_the_rotor_dynamics_library():
    ours = whirl_frequencies(shaft_system(divided(COUNT), discs=DISCS, supports=BEARINGS), 1000.0)[:, 0]
    assert max(np.min(np.abs(ours / wanted - 1.0)) for wanted in ROSS_TURNING) < 2e-6


def test_two_links_are_the_static_beam():
    """Tip of a cantilever under a force and a moment, and a simple span: Timoshenko's deflections."""
    length = 0.4
    K = beam_element(SECTION, length)[1][6:, 6:]
    bend, phi = SECTION.young * SECTION.second_moment, SECTION.shear_ratio(length)
    tip = np.linalg.solve(K, np.eye(6)[0])
    assert tip[0] == pytest.approx(length**3 / (3.0 * bend) * (1.0 + 0.25 * phi), rel=1e-12)
    assert tip[4] == pytest.approx(length**2 / (2.0 * bend), rel=1e-12)
    moment = np.linalg.solve(K, np.eye(6)[4])
    assert moment[4] == pytest.approx(length / bend, rel=1e-12)


def test_joint_does_not_see_rigid_motions():
    rows = joint_deflections(0.7)
    motions = np.vstack([np.eye(6), rigid_link((0.0, 0.0, 0.7))])
    assert np.abs(rows @ motions).max() < 1e-15
    assert np.linalg.matrix_rank(rows) == 6


@pytest.mark.parametrize(
    "make",
    [
        lambda: RoundSection(0.0),
        lambda: RoundSection(0.1, 0.1),
        lambda: RoundSection(math.nan),
        lambda: shaft_system(divided(COUNT), discs=(Disc(25, 1.0, 1.0, 1.0),)),
    ],
)
def test_shafts_that_cannot_be_are_refused(make):
    with pytest.raises(CaseError, match="E-SHAFT"):
        make()


def test_joint_of_two_halves_stores_the_energy_of_the_beam_under_an_end_load():
    """2 (F L / 2)^2 / (2 k) with k = (3 E I / 2 L) / (1 + Phi / 4), against 24 elements."""
    system = shaft_system(divided(COUNT), supports=(Support(0, math.inf, math.inf),))
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


def test_growth_moves_the_stations_of_a_free_shaft_apart_and_loads_nothing_else():
    parts = [ShaftPart(0.05, 0.03), ShaftPart(0.04, 0.05, end_outer_diameter=0.03), ShaftPart(0.06, 0.03, 0.01)]
    shaft = beam_shaft(parts, [0.07])
    load = growth_load(shaft, 4.6e-4).reshape(-1, 6)
    assert load.sum(axis=0) == pytest.approx(np.zeros(6), abs=1e-6 * np.abs(load).max())
    held = np.ones(load.size, bool)
    held[:6] = False
    motion = np.zeros(load.size)
    motion[held] = np.linalg.solve(shaft.stiffness[np.ix_(held, held)], load.ravel()[held])
    assert motion.reshape(-1, 6)[:, 2] == pytest.approx(4.6e-4 * np.asarray(shaft.stations), rel=1e-9)
    # held at both ends it presses with E A growth, of a bar of one section
    bar = beam_shaft([ShaftPart(0.1, 0.03)], [])
    assert growth_load(bar, 1e-3).reshape(-1, 6)[[0, -1], 2] == pytest.approx(
        2.06e11 * 0.25 * math.pi * 0.03**2 * 1e-3 * np.array([-1.0, 1.0])
    )
