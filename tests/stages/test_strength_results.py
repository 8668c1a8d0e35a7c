"""Rows, notes and tables of safeties."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from steels import NO_STEELS

from femgear.stages.strength import rate_case
from femgear.stages.strength_results import (
    computed_dynamic_factor,
    factor_of_two_frequencies,
    kind_names,
    missing_factors,
    safety_notes,
    safety_rows,
    sharing_of_two_frequencies,
    smallest_safety,
    strength_block,
    strength_verdict,
    taken_as_one,
)
from femgear.trains.reading import read_case, with_values

CASES = Path(__file__).parents[2] / "cases"
LIMITS = {"material.root_stress_limit": "430 MPa", "material.contact_stress_limit": "1500 MPa"}
KINDS = ["sun-planet", "planet-ring"]


@pytest.fixture(scope="module")
def pair():
    case = read_case(CASES / "spur_pair.toml")
    return with_values(case, {"material.treatment": None, "material.hardness": None})


@pytest.fixture(scope="module")
def planetary():
    return with_values(read_case(CASES / "planetary_27_40_108.toml"), NO_STEELS)


def test_the_smallest_safety_stands_with_its_cause(planetary):
    weak = with_values(planetary, {**LIMITS, "ring.material.contact_stress_limit": "300 MPa"})
    rating = rate_case(weak)
    rows = dict(safety_rows(rating, KINDS))
    least = min(flank.contact_safety for flank in rating.flanks)
    assert rows["smallest safety"].startswith(f"S_H {least:.2f}, flank of the ring: Z sigma_H0")
    one_limit = dict(safety_rows(rate_case(with_values(planetary, LIMITS)), KINDS))
    assert [text.split()[0] for text in one_limit["safety S_H, ISO 6336-2:2019"].split(", ")] == KINDS
    assert not list(safety_rows(rate_case(planetary), KINDS)) and not smallest_safety(rate_case(planetary).flanks)


def test_what_is_missing_is_named_by_its_entry(planetary):
    def notes(changes) -> str:
        return " | ".join(safety_notes(rate_case(with_values(planetary, changes))))

    assert notes({}).startswith("give material.root_stress_limit and material.contact_stress_limit, or")
    some = notes({"sun.material.contact_stress_limit": "1500 MPa", "material.root_stress_limit": "430 MPa"})
    assert "give planet.material.contact_stress_limit, ring.material.contact_stress_limit to get" in some
    assert "K_Hβ (a static solution with static.slices = 25)" in some and "strength.quality" in some
    assert "strength.quality" not in notes({**LIMITS, "strength.quality": 6})


def test_the_table_has_a_row_a_flank_and_the_factors_of_every_mesh(planetary):
    rating = rate_case(with_values(planetary, {**LIMITS, "strength.quality": 6, "strength.edition": 2006}))
    block = strength_block(rating, KINDS)
    assert block.title == "Strength, ISO 6336:2006"
    assert [row[0] for row in block.rows] == [flank.name for flank in rating.flanks]
    assert block.rows[0][1] == f"{1e-6 * rating.nominal.root[0, 0]:.2f}"
    assert [note.partition(":")[0] for note in block.notes[:2]] == KINDS
    assert f"K_v {rating.standard[0].dynamic.factor:.3f} (method B" in block.notes[0]


def test_a_verdict_takes_computed_factors_where_there_are_any(pair):
    """K_Hbeta of static.nc and K_v of dynamics.nc; nothing where the case asks for no safety."""
    static = xr.Dataset(
        {"load_share": (("planet", "position"), np.ones((1, 4))), "face_load_factor": ("mesh", [1.3])},
        coords={"mesh": ["gear 1-gear 2"]},
    )
    dynamics = xr.Dataset({"dynamic_factor": ("speed", [1.1, 1.4])})
    results = SimpleNamespace(case=with_values(pair, LIMITS), static=static, dynamics=dynamics, findings=())
    results.stages = ("static", "dynamics")
    verdict, table = strength_verdict(results)
    rating = rate_case(results.case, dynamic=np.array([1.4]), face=np.array([1.3]))
    assert dict(verdict.rows)["safety S_F, ISO 6336-3:2019"].startswith(f"gear 1 {rating.flanks[0].root_safety:.2f}")
    assert "K_v 1.400 (computed), K_Hβ 1.300 (computed)" in table.notes[0]
    assert not list(strength_verdict(SimpleNamespace(case=pair, stages=("static",), findings=())))


@pytest.mark.parametrize(
    ("name", "given"),
    [
        ("nrel_pgb.toml", {}),
        (
            "helical_30_20_70.toml",
            {"helical.mesh_stiffness.sun_planet": "4e8 N/m", "helical.mesh_stiffness.planet_ring": "5e8 N/m"},
        ),
    ],
)
def test_sets_whose_mesh_stiffness_is_given_are_rated_by_teeth_and_torque(name, given):
    case = with_values(read_case(Path("cases") / name), {**LIMITS, **given})
    assert not any("root_stress_limit" in str(finding) for finding in case.notices)
    verdict, table = strength_verdict(SimpleNamespace(case=case, stages=("modes",), findings=()))
    rating = rate_case(case)
    rows = dict(verdict.rows)
    assert rows["safety S_F, ISO 6336-3:2019"].startswith(f"sun {rating.flanks[0].root_safety:.2f}")
    assert "smallest safety" in rows and len(table.rows) == 4
    (missing,) = [note for note in verdict.notes if note.startswith("taken as 1")]
    assert all(symbol in missing for symbol in ("K_γ (", "K_v (", "K_Hβ (strength.quality)", "K_Hα"))
    # a flank tolerance class gives K_Hbeta by method C: nothing else can
    rated = rate_case(with_values(case, {"strength.quality": 6}))
    assert rated.factors.face == pytest.approx([of_kind.face for of_kind in rated.standard])
    assert (rated.factors.face > 1.0).all() and "method C" in rated.factors.sources["face"]
    assert not any("K_Hβ (" in note for note in safety_notes(rated) if note.startswith("taken as 1"))


def test_teeth_with_a_contact_keep_its_face_load_factor(pair):
    """Method C stands beside it, for information."""
    classed = with_values(pair, {**LIMITS, "strength.quality": 6})
    rated = rate_case(classed)
    assert rated.factors.face == pytest.approx([1.0]) and rated.standard[0].face > 1.0
    computed = rate_case(classed, face=np.array([1.2]))
    assert computed.factors.face == pytest.approx([1.2]) and computed.standard[0].face == rated.standard[0].face
    (block,) = [strength_block(rated, ["gear 1-gear 2"])]
    assert f"K_Hβ {rated.standard[0].face:.3f} (method C" in " ".join(block.notes)


def test_what_is_missing_for_a_safety_is_named_by_its_key(pair):
    """By [strength] alone: limits; with one of them the other."""
    (asked, _) = strength_verdict(
        SimpleNamespace(case=with_values(pair, {"strength.edition": 2019}), stages=(), findings=())
    )
    assert any("material.root_stress_limit and material.contact_stress_limit" in note for note in asked.notes)
    halved = with_values(pair, {"gear_1.material.root_stress_limit": "430 MPa"})
    (half, _) = strength_verdict(SimpleNamespace(case=halved, stages=(), findings=()))
    keys = next(note for note in half.notes if note.startswith("give "))
    assert "gear_2.material.root_stress_limit" in keys and "material.contact_stress_limit" in keys


def test_sharing_of_two_frequencies_is_that_of_mean_forces():
    orders = {"carrier_order": ("line", [0, 1]), "mesh_order": ("line", [0, 0])}
    real = np.zeros((2, 4, 2))
    real[..., 0], real[..., 1] = 10.0, 5.0
    real[1, 0, 0], real[1, 1, 0] = 12.0, 8.0
    lines = ("speed", "mesh", "line")
    data = xr.Dataset({"mesh_force_real": (lines, real), "mesh_force_imag": (lines, 0.0 * real)}, coords=orders)
    assert sharing_of_two_frequencies(data, 2) == pytest.approx([1.2, 1.0])


def test_factors_that_nothing_told_are_named(pair, planetary):
    plain = rate_case(with_values(pair, LIMITS)).factors
    assert taken_as_one(missing_factors(plain, planets=False)) == "K_v, K_Hβ, K_Hα taken as 1"
    classed = rate_case(with_values(planetary, {**LIMITS, "strength.quality": 6}), face=np.ones(2)).factors
    assert taken_as_one(missing_factors(classed, planets=True)) == "K_γ taken as 1"
    assert not taken_as_one([])


def test_the_factor_of_two_frequencies_is_the_largest_force_at_any_phases_over_the_mean():
    """10 + 2 cos(carrier) + 3 sin(mesh) is 15 at most; the second mesh has 11 at the second speed."""
    orders = {"carrier_order": ("line", [0, 1, 0, 1]), "mesh_order": ("line", [0, 0, 1, 1])}
    real = np.zeros((2, 2, 4))
    real[:, :, 0], imaginary = 10.0, np.zeros((2, 2, 4))
    real[0, 0, 1:], imaginary[0, 0, 2] = [2.0, 0.0, 0.0], -3.0
    real[1, 1, 1] = 1.0
    lines = ("speed", "mesh", "line")
    data = xr.Dataset({"mesh_force_real": (lines, real), "mesh_force_imag": (lines, imaginary)}, coords=orders)
    assert factor_of_two_frequencies(data, 2) == pytest.approx([1.5, 1.1], rel=1e-12)


def test_dynamic_factor_of_harmonics_is_the_largest_over_the_mean():
    """10 + 4 cos + 1 cos 2: 1.5; the second kind rests."""
    force = np.zeros((1, 4, 3))
    force[0, :2] = [10.0, 4.0, 1.0]
    force[0, 2:, 0] = 5.0
    lines = ("speed", "mesh", "harmonic")
    data = xr.Dataset({"mesh_force_real": (lines, force), "mesh_force_imag": (lines, 0.0 * force)})
    assert computed_dynamic_factor(data, 2) == pytest.approx([1.5, 1.0])
    assert kind_names(["sun-planet 1", "sun-planet 2", "planet-ring 1"]) == KINDS
