"""Every cause of a difference from nominal stresses is told by the numbers that show it, and by them alone."""

import math

import numpy as np
import pytest
import synthetic_results as synthetic

from femgear.fe.elasticity import Material
from femgear.gears.gear import Gear
from femgear.gears.pair import close_pair
from femgear.stages.strength import nominal_stresses
from femgear.stages.stress_reasons import (
    BASE_CIRCLE,
    CONTACT_RATIO,
    DIFFERS,
    RIM,
    TIP_CORNER,
    largest_pressure,
    over_hertz,
    reason_row,
    reason_values,
    stress_reasons,
)


@pytest.fixture
def data():
    """Stresses of a set with thick rims and a contact ratio of 1.6, all 1.5 times the nominal ones."""
    stress = synthetic.stress()
    stress["iso_root_stress"] = stress["root_worst"] / 1.5
    stress["iso_contact_stress"] = ("mesh", largest_pressure(stress) / 1.5)
    stress["relief_kink"] = ("mesh", np.zeros(stress.sizes["mesh"], dtype=int))
    stress["contact_worst_curvature"] = ("mesh", np.ones(stress.sizes["mesh"]))
    stress["contact_worst_margin"] = ("mesh", np.full(stress.sizes["mesh"], 1e-4))
    for name, value in (("contact_ratio", 1.6), ("path_start", -0.7), ("path_end", 0.9)):
        stress[name] = ("mesh", np.full(stress.sizes["mesh"], value))
    for name, value in (("iso_rim_factor", 1.0), ("rim_thickness", 3.0), ("root_worst_path", 0.2)):
        stress[name] = (("mesh", "gear"), np.full((stress.sizes["mesh"], 2), value))
    return stress


def causes(data):
    """Names of all causes by the titles of stresses that differ."""
    return {reason.title: list(reason.causes) for reason in stress_reasons(data)}


ALL = ("contact sun-planet", "root sun", "root planet, sun side")
OTHERS = ("contact planet-ring", "root planet, ring side", "root ring")


def test_without_a_cause_in_the_numbers_none_is_named(data):
    assert causes(data) == {title: [] for title in (*ALL, *OTHERS)}
    (row,) = reason_row(data)
    assert "root sun 1.50 (see Stresses)" in row[1]


def test_factors_of_helical_teeth_are_told_of_files_too(data):
    """What is read from a file is a number of NumPy."""
    data.attrs["iso_contact_helix_factor"] = np.float64(1.02)
    assert all("Z_eps Z_beta" in reason.sentence for reason in stress_reasons(data) if "contact" in reason.title)


def test_stresses_within_the_limit_need_no_reason(data):
    data["iso_root_stress"] = data["root_worst"] / (DIFFERS - 1e-9)
    data["iso_contact_stress"] = ("mesh", largest_pressure(data) * (DIFFERS - 1e-9))
    assert causes(data) == {} and list(reason_row(data)) == []


def test_contact_near_the_base_circle_shows_in_the_relative_curvature(data):
    data["contact_worst_curvature"][: data.sizes["mesh"] // 2] = DIFFERS + 1e-6
    data["contact_start"][:, 0], data["contact_start"][:, 1] = 12e-6, 900e-6
    of_contact = {reason.title: reason for reason in stress_reasons(data)}["contact sun-planet"]
    assert list(of_contact.causes) == [BASE_CIRCLE]
    assert of_contact.causes[BASE_CIRCLE] == "on the sun it begins 0.012 mm above the base circle"
    assert BASE_CIRCLE not in causes(data)["contact planet-ring"]


def test_a_contact_ratio_of_two_is_a_cause_for_flanks_and_roots_of_its_mesh(data):
    data["contact_ratio"][: data.sizes["mesh"] // 2] = 2.0
    named = causes(data)
    assert all(named[title] == [CONTACT_RATIO] for title in ALL)
    assert all(named[title] == [] for title in OTHERS)


def test_a_tip_corner_in_contact_presses_beyond_the_path(data):
    data["contact_worst_margin"][:] = -3e-5
    assert causes(data)["contact sun-planet"] == [TIP_CORNER]
    # a kink of a relief presses as well, and is no corner
    data["relief_kink"][:] = 1
    assert causes(data)["contact sun-planet"] == []


@pytest.mark.parametrize(
    ("path", "gear", "whose"), [(0.95, 0, "its own"), (0.95, 1, "its mate's"), (-0.8, 1, "its own")]
)
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_root_is_stressed_by_a_tip_corner_where_the_worst_load_lies_beyond_the_path(data, path, gear, whose, sense):
    data["root_worst_path"][:, gear] = sense * path
    data.attrs["sun_torque"] = sense * 100.0
    reasons = {reason.title: reason for reason in stress_reasons(data)}
    reason = reasons[("root sun", "root planet, sun side")[gear]]
    assert list(reason.causes) == [TIP_CORNER]
    assert reason.causes[TIP_CORNER].startswith(f"{whose} corner carries")
    assert reasons[("root planet, sun side", "root sun")[gear]].causes == {}


def test_a_thin_rim_is_one_for_which_the_standard_has_a_factor(data):
    data["iso_rim_factor"][:, 0] = 1.2
    named = causes(data)
    assert named["root sun"] == [RIM] and named["root planet, sun side"] == []
    assert named["contact sun-planet"] == []


def test_files_without_the_numbers_tell_factors_alone(data):
    former = data.drop_vars(["contact_ratio", "path_start", "path_end", "iso_rim_factor", "rim_thickness"])
    assert causes(former) == causes(data)


def test_the_numbers_are_those_of_the_gears():
    def gear(teeth: int, rim: float, name: str) -> Gear:
        return Gear(teeth, 3e-3, math.radians(20.0), 0.0, 0.02, rim, name=name)

    pair = close_pair(gear(40, 0.0525, "thin"), gear(52, 0.02, "thick"))
    steel = Material(206e9, 0.3, 7850.0)
    values = reason_values(pair, nominal_stresses(pair, 100.0, steel))
    height, rim = 2.25 * 3.0, 60.0 - 1.25 * 3.0 - 52.5
    assert values["rim_thickness"][0, 0] == pytest.approx(rim / height, rel=1e-9)
    assert values["iso_rim_factor"][0].tolist() == pytest.approx([1.6 * math.log(2.242 * height / rim), 1.0], rel=1e-9)
    assert values["contact_ratio"][0] == pytest.approx(values["path_end"][0] - values["path_start"][0], rel=1e-12)


def test_pressure_over_hertz_is_one_where_load_and_curvature_tell_it(data):
    excess = over_hertz(data)
    hertz = data["iso_contact_stress"].values / data["iso_contact_ratio_factor"].values
    hertz = hertz * np.sqrt(data["contact_worst_load"].values / data.attrs["nominal_load"])
    assert excess == pytest.approx(largest_pressure(data) / hertz, rel=1e-12)
