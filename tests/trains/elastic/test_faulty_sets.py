"""Faults of teeth through all stages: lines at a fixed sensor lie where the turns of the faulty gear put them."""

import pytest

from femgear.run import solve
from femgear.trains.reading import with_values
from validation.fault_orders import OF_GEARBOXES, OF_SETS, FaultySet, orders_of_pair, orders_of_sets, orders_of_stages


@pytest.mark.slow
@pytest.mark.parametrize("faulty", OF_SETS, ids=lambda faulty: faulty.words)
def test_lines_of_a_fault_lie_at_whole_multiples_of_its_step(faulty):
    """``L = g q + m (z_s + z_r)/z_s`` of the sun, ``q + m z_r/z_p`` of one planet, ``g q`` of the ring."""
    assert {row.verdict for row in orders_of_sets((faulty,))} == {"passes"}


@pytest.mark.slow
@pytest.mark.parametrize("faulty", OF_GEARBOXES, ids=lambda faulty: faulty.words)
def test_a_stage_of_a_gearbox_has_the_lines_of_the_set(faulty):
    assert {row.verdict for row in orders_of_stages((faulty,))} == {"passes"}


@pytest.mark.slow
def test_a_pair_as_a_gearbox_has_lines_at_all_turns_of_the_faulty_gear():
    assert {row.verdict for row in orders_of_pair()} == {"passes"}


@pytest.mark.slow
def test_faults_without_depth_and_a_list_without_faults_change_not_one_bit():
    case = FaultySet((16, 16, 48), 4, "sun").case
    crack = {"kind": "crack", "tooth": 2, "flank": "left", "depth": "0 mm"}
    spall = {"kind": "spall", "tooth": 2, "flank": "left", "diameter": "32 mm", "length": "0.5 mm", "depth": "0 um"}
    worn = {"kind": "wear", "tooth": 5, "flank": "left", "diameters": ["31 mm", "33 mm"], "depths": ["0 um", "0 um"]}
    nothing, without_depth = ([], [crack, spall, worn, worn | {"tooth": 2}])
    case = with_values(case, {"sun.fault": nothing})
    healthy, *others = (
        solve(with_values(case, {"sun.fault": faults}), only="static")["static"].dataset()
        for faults in (nothing, nothing, without_depth)
    )
    for data in others:
        assert data.identical(healthy)
