"""Kinds of the lumped set's modes: structure at equal spacing, honesty at unequal spacing."""

from dataclasses import replace

import numpy as np
import pytest
from published.planetary_sets import lin_parker_set
from published.wind_turbine import wind_turbine_b

from femgear.errors import CaseError
from femgear.stages.lumped_set import gear_set_modes
from femgear.system.mode_kinds import class_shares, gear_set_kinds
from validation.planar import by_kind, torsional

# the matrices of Lin and Parker (1999) set up elsewhere and solved in double precision [Hz]
PLANET = (1808.18088204, 5963.76002161, 6981.70516704)
PRECISE = {
    3: (
        (1475.7472, 1930.3466, 2658.3244, 7462.8034, 11775.2658),
        (743.1639, 1102.4193, 1896.0199, 2276.3801, 6986.2982, 9647.9132),
        (),
    ),
    4: (
        (1536.5355, 1970.5924, 2625.6502, 7773.5513, 13071.1102),
        (727.2673, 1091.1635, 1892.8176, 2342.5035, 7189.9454, 10437.5618),
        PLANET,
    ),
    5: (
        (1567.3977, 2006.0785, 2614.7957, 8065.3899, 14253.0924),
        (710.0452, 1072.0124, 1888.0771, 2425.2954, 7382.3799, 11172.3087),
        PLANET,
    ),
}


@pytest.mark.parametrize("planets", [2, 3, 4, 5, 6, 7])
def test_structure_of_equally_spaced_planets(planets):
    """Lin and Parker (1999): 6 single, 6 double, 3 (N - 3)-fold; with two planets 9 are left of the 12."""
    modes = gear_set_modes(lin_parker_set(planets))
    kinds = list(modes.kind)
    assert kinds.count("rigid") == 1 and modes.kind[0] == "rigid"
    if planets == 2:
        assert kinds.count("rotational") == 5 and kinds.count("translational") == 9
        return
    assert kinds.count("rotational") == 5 and kinds.count("translational") == 12
    assert kinds.count("planet") == 3 * (planets - 3)
    found = by_kind(modes)
    assert found["translational"][::2] == pytest.approx(found["translational"][1::2], rel=1e-10)
    if planets > 4:
        groups = found["planet"].reshape(3, planets - 3)
        assert groups == pytest.approx(np.repeat(groups[:, :1], planets - 3, axis=1), rel=1e-10)


@pytest.mark.parametrize("planets", [3, 4, 5])
def test_frequencies_of_lin_and_parker(planets):
    found = by_kind(gear_set_modes(lin_parker_set(planets)))
    times = (1, 2, max(planets - 3, 1))
    for kind, step, expected in zip(("rotational", "translational", "planet"), times, PRECISE[planets]):
        assert found[kind][::step] == pytest.approx(expected, rel=1e-7)


def test_planet_modes_do_not_depend_on_the_number_of_planets():
    """Central members rest, so a planet mode is that of one planet between springs: 3 x 3 by hand."""
    data = lin_parker_set(6)
    a, k, kp = data.pressure_angle_sun_planet, 5e8, 1e8
    rows = np.array([[-np.sin(a), -np.cos(a), 1.0], [np.sin(a), -np.cos(a), -1.0]])
    stiffness = k * rows.T @ rows + np.diag([kp, kp, 0.0])
    mass = np.array([0.66, 0.66, 0.61])
    root = np.sqrt(np.linalg.eigvalsh(stiffness / np.sqrt(np.outer(mass, mass)))) / (2 * np.pi)
    assert by_kind(gear_set_modes(data))["planet"][::3] == pytest.approx(root, rel=1e-11)


def test_kinds_do_not_depend_on_the_x_axis():
    data = lin_parker_set(4)
    turned = replace(data, planet_angles=data.planet_angles + 0.4)
    assert gear_set_modes(turned).kind == gear_set_modes(data).kind


def test_unequal_spacing_mixes_all_but_the_planet_modes():
    """With the planets' motion free of 1, cos psi and sin psi the central members rest at any angles."""
    data = replace(lin_parker_set(4), planet_angles=np.deg2rad([0.0, 60.0, 150.0, 250.0]))
    modes = gear_set_modes(data)
    found = by_kind(modes)
    assert len(found["mixed"]) > 9
    assert found["planet"] == pytest.approx(by_kind(gear_set_modes(lin_parker_set(4)))["planet"], rel=1e-10)
    # what is still called by a class has that class's motion of the central members
    energy = np.array(modes.shape) ** 2
    central = energy[:9].reshape(3, 3, -1).sum(axis=0)
    named = np.array(modes.kind)
    assert np.all(central[2, named == "translational"] < 0.02 * energy[:, named == "translational"].sum(axis=0))
    assert np.all(central[:, named == "planet"] < 1e-12)


def test_opposite_planets_keep_rotational_and_translational_modes():
    """J. Lin and R. G. Parker, J. Sound Vib. 233, 2000: diametrically opposed planets keep the structure."""
    data = replace(lin_parker_set(4), planet_angles=np.deg2rad([0.0, 75.0, 180.0, 255.0]))
    modes = gear_set_modes(data)
    kinds = list(modes.kind)
    assert (kinds.count("rotational"), kinds.count("translational"), kinds.count("planet")) == (5, 12, 3)
    # the translational modes are no longer double
    pairs = by_kind(modes)["translational"]
    assert np.abs(pairs[1::2] / pairs[::2] - 1.0).max() > 1e-3


def test_a_nearly_equal_set_keeps_its_kinds_only_while_they_are_true():
    angles = lin_parker_set(3).planet_angles
    for degrees, kept in ((0.01, True), (12.0, False)):
        data = replace(lin_parker_set(3), planet_angles=angles + np.deg2rad([0.0, degrees, 0.0]))
        assert ("mixed" not in gear_set_modes(data).kind) == kept


def test_shares_are_those_of_constructed_motions():
    data = lin_parker_set(5)
    psi, shape = data.planet_angles, np.zeros((24, 4))
    shape[2, 0] = shape[8, 0] = 1.0
    shape[9::3, 0] = 0.5
    shape[0, 1] = 1.0
    shape[10::3, 1] = np.cos(psi)
    shape[11::3, 2] = np.cos(2 * psi)
    # one part of carrier rotation, three of planets that move in class 2
    shape[2, 3] = np.sqrt(1.0 / 6.29)
    shape[9::3, 3] = np.sin(2 * psi) * np.sqrt(3.0 / (0.66 * (np.sin(2 * psi) ** 2).sum()))
    expected = [[1, 0, 0, 0.25], [0, 1, 0, 0], [0, 0, 1, 0.75]]
    assert class_shares(data, shape) == pytest.approx(np.array(expected), abs=1e-12)
    kinds = gear_set_kinds(data, shape, frequency=np.ones(4))
    assert kinds == ("rotational", "translational", "planet", "mixed")


def test_wind_turbine_set():
    """Lowest modes computed independently: 40.761 and 156.869 double, 69.563 and 302.710 Hz single."""
    found = by_kind(gear_set_modes(wind_turbine_b()))
    assert found["translational"][:4] == pytest.approx([40.761] * 2 + [156.869] * 2, rel=1e-5)
    assert found["rotational"][:2] == pytest.approx([69.563, 302.710], rel=1e-5)


def test_torsional_limit():
    assert all(row.verdict == "passes" for row in torsional())


def test_shapes_of_another_set_are_refused():
    with pytest.raises(CaseError, match="E-SHAPE"):
        class_shares(lin_parker_set(3), np.eye(21))
