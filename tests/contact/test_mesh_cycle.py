"""What follows from the records of a mesh cycle, by records that are written down."""

from dataclasses import fields, replace

import numpy as np
import pytest

from femgear.contact.mesh_cycle import Between, MeshCycle


def cycle(**values) -> MeshCycle:
    """A pair over four positions, of which nothing is filled but what is given."""
    given = {field.name: np.zeros((1, 4)) for field in fields(MeshCycle) if field.type == "np.ndarray"}
    given |= {"position": np.arange(4) / 4, "member_names": (), "periods": 1, "contact": "profile"}
    given |= {"unknowns": 1, "message": "", "open_planets": np.zeros((1, 4), bool)}
    return MeshCycle(**{**given, **values})


def between(**values) -> Between:
    """One position more, a quarter of the way to the second one."""
    given = {name: np.zeros((1, 1)) for name in ("deflection", "stiffness", "load_share", "max_pressure")}
    given |= {"pressed_path": np.zeros((1, 1)), "pressed_load": np.zeros((1, 1)), "sun_arc": np.zeros(1)}
    given |= {"position": np.array([0.0625]), "looked": np.array([True]), "records": (), "doubt": 0.0}
    return Between(**{**given, **values})


def test_extremes_are_those_of_all_positions():
    record = cycle(deflection=np.array([[1.0, 3.0, 2.0, 2.0]]))
    assert record.peak_to_peak() == pytest.approx([2.0])
    record = replace(record, between=between(deflection=np.array([[5.0]])))
    low, high = record.extremes("deflection")
    assert (
        low == pytest.approx([1.0]) and high == pytest.approx([5.0]) and record.peak_to_peak() == pytest.approx([4.0])
    )


def test_extremes_of_planets_in_the_same_states_are_shared():
    """The positions between enclose those of one planet; the others go through the same, later."""
    values = np.array([[1.0, 2.0], [2.0, 1.0], [4.0, 4.0], [4.0, 4.0]])
    record = cycle(deflection=values, open_planets=np.zeros((2, 2), bool), alike=2)
    later = between(deflection=np.array([[3.0], [0.0], [4.0], [4.0]]), load_share=np.array([[0.7], [0.3]]))
    low, high = replace(record, between=later).extremes("deflection")
    assert low == pytest.approx([0.0, 0.0, 4.0, 4.0]) and high == pytest.approx([3.0, 3.0, 4.0, 4.0])


def test_the_mean_is_that_of_straight_lines_through_all_positions():
    """4 where the curve is 4 at all positions; a peak of 12 between two of them adds its triangle."""
    record = cycle(stiffness=np.full((1, 4), 4.0))
    assert record.mean() == pytest.approx([4.0])
    record = replace(record, between=between(stiffness=np.array([[12.0]])))
    # height 8 over the quarter of a period between its neighbours
    assert record.mean() == pytest.approx([4.0 + 0.5 * 8.0 * 0.25])


def test_shares_add_up_to_one_and_are_none_without_torque():
    force = np.array([[3.0, 0.0], [1.0, 0.0], [3.0, 0.0], [1.0, 0.0]])
    record = cycle(force=force, back_force=0.0 * force, open_planets=np.zeros((2, 2), bool))
    assert record.load_share == pytest.approx(np.array([[0.75, 0.0], [0.25, 0.0]]))
    wedged = replace(record, back_force=np.array([[1.0, 1.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]]))
    assert wedged.wedged.tolist() == [[True, False], [False, False], [False, False], [False, False]]
    # teeth that are wedged without torque: what is left of their forces is rounding, and has no shares
    rounding = replace(record, force=np.full((4, 2), 1.0 + 1e-12), back_force=np.ones((4, 2)))
    assert not rounding.load_share.any()


def test_secant_stiffness_is_zero_where_nothing_is_carried():
    record = cycle(force=np.array([[6.0, 0.0, 6.0, 6.0]]), deflection=np.array([[2.0, 1.0, 0.0, 3.0]]))
    assert record.secant_stiffness == pytest.approx(np.array([[3.0, 0.0, 0.0, 2.0]]))


def test_face_load_factor_is_the_largest_load_over_its_mean():
    """Of the tooth pair that has it: 50 slices, of which the mean over two is the largest."""
    load = np.ones((1, 2, 50, 1))
    load[0, 1, :, 0] = 2.0
    load[0, 1, -2:, 0] = 8.0
    record = cycle(slice_load=load, tooth_load=load.mean(axis=2), position=np.zeros(1))
    assert record.face_load_factor == pytest.approx([8.0 / load[0, 1].mean()])
    assert cycle().face_load_factor is None
