"""Elastic rings in a gearbox: the modes of the reference set on its foundation."""

import numpy as np
import pytest
from gearbox_equivalents import elastic_set_tables

from femgear.errors import CaseError
from femgear.run import solve
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.modes import solve_gearbox_modes
from femgear.trains.reading import read_case, with_values

FEW = {"static.positions": 16, "static.flank_elements": 8, "static.stresses": False, "dynamics.up_to": "4 kHz"}


@pytest.fixture(scope="module")
def both():
    tables = elastic_set_tables("cases/planetary_27_40_108.toml")
    teeth = tables["planetary"][0]["teeth"]
    for key, value in FEW.items():
        section, entry = key.split(".")
        teeth.setdefault(section, {})[entry] = value
    case = read_case(tables | {"modes": {"up_to": "200 kHz"}})
    reference = solve(with_values(read_case("cases/planetary_27_40_108.toml"), FEW), only="modes")["modes"]
    return reference, solve_gearbox_modes(solve_deflection(case))


def test_modes_are_those_of_the_set_on_its_foundation(both):
    reference, found = both
    expected = np.sort(reference.modes.frequency)
    ours = np.sort(found.modes.frequency)[: len(expected)]
    assert found.motion.shape[1] >= len(expected)
    # rounding: a part in 1e15 of the square of the highest natural frequency
    rounding = 1e-15 * found.modes.frequency.max() ** 2 / np.maximum(expected, 1.0) ** 2
    elastic = expected > 1.0
    assert rounding[expected > 1e3].max() < 1e-9
    assert (np.abs(ours / np.where(elastic, expected, 1.0) - 1.0)[elastic] < np.maximum(1e-9, rounding[elastic])).all()


def test_the_ring_has_its_share_of_the_energies(both):
    _, found = both
    assert "ring of set" in found.members and "ring of set" in found.parts
    elastic = found.modes.frequency > 0.0
    assert found.kinetic.sum(axis=0) == pytest.approx(np.ones(len(elastic)), rel=1e-9)
    assert found.strain.sum(axis=0)[elastic] == pytest.approx(np.ones(elastic.sum()), rel=1e-6)
    assert "ring" in found.modes.kind


def test_a_ring_without_a_grid_is_refused():
    tables = elastic_set_tables("cases/planetary_27_40_108.toml")
    tables["shaft"].append({"name": "ring"})
    tables["planetary"][0]["ring"] = "ring"
    with pytest.raises(CaseError, match="elastic_ring"):
        read_case(tables)
