"""Rows, notes and tables of safeties."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from femgear.stages.strength import rate_case
from femgear.stages.strength_results import (
    computed_dynamic_factor,
    kind_names,
    safety_notes,
    safety_rows,
    smallest_safety,
    strength_block,
    strength_verdict,
)
from femgear.trains.reading import read_case, with_values

CASES = Path(__file__).parents[2] / "cases"
LIMITS = {"material.root_stress_limit": "430 MPa", "material.contact_stress_limit": "1500 MPa"}
KINDS = ["sun-planet", "planet-ring"]


@pytest.fixture(scope="module")
def pair():
    return read_case(CASES / "spur_pair.toml")


@pytest.fixture(scope="module")
def planetary():
    return read_case(CASES / "planetary_27_40_108.toml")


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
    assert "K_Hβ (static.slices = 25)" in some and "strength.quality" in some
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
    assert not list(strength_verdict(SimpleNamespace(case=results.case, stages=(), findings=())))


def test_dynamic_factor_of_harmonics_is_the_largest_over_the_mean():
    """10 + 4 cos + 1 cos 2: 1.5; the second kind rests."""
    force = np.zeros((1, 4, 3))
    force[0, :2] = [10.0, 4.0, 1.0]
    force[0, 2:, 0] = 5.0
    lines = ("speed", "mesh", "harmonic")
    data = xr.Dataset({"mesh_force_real": (lines, force), "mesh_force_imag": (lines, 0.0 * force)})
    assert computed_dynamic_factor(data, 2) == pytest.approx([1.5, 1.0])
    assert kind_names(["sun-planet 1", "sun-planet 2", "planet-ring 1"]) == KINDS
