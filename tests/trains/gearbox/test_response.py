"""Response of a gearbox: lines and their origin, balance of the casing, levels, what stages do to one another."""

from dataclasses import replace

import numpy as np
import pytest
from casings import MASS, RPM, pair_in_a_casing, response
from small_gearbox import pair_tables

from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.response import (
    accelerations,
    level,
    mesh_rows,
    output_rows,
    reference_shaft,
    solve_gearbox_response,
)
from femgear.trains.reading import read_case

pytestmark = pytest.mark.usefixtures("coarse_states")


def test_lines_are_multiples_of_the_mesh_frequency():
    found = response()
    (stage,) = found.stages
    assert reference_shaft(found.deflection.model) == "input"
    assert stage.order == pytest.approx(24.0 * stage.harmonic)
    assert list(stage.harmonics) == [7, 3]
    assert not stage.side_band.any()
    # nothing is heard beyond the harmonics of a speed
    assert not stage.motion[1][:, stage.harmonic > 3].any()
    assert np.abs(stage.motion[1][0, stage.harmonic <= 3]).min() > 0.0


def test_teeth_that_repeat_after_several_mesh_periods_have_lines_between_harmonics(monkeypatch):
    """The same two mesh periods as one record have the same lines where they were, and none between."""
    from femgear.trains.gearbox import response as module

    once, excitation_of = response(), module.excitation_of

    def twice(*arguments, **options):
        drive = excitation_of(*arguments, **options)
        names = ("stiffness", "deflection", "force")
        return replace(drive, periods=2, **{name: np.tile(getattr(drive, name), 2) for name in names})

    monkeypatch.setattr(module, "excitation_of", twice)
    again = solve_gearbox_response(once.deflection, once.speed)
    (single,), (double,) = once.stages, again.stages
    assert double.order == pytest.approx(24.0 * double.harmonic)
    whole = double.harmonic % 1.0 == 0.0
    assert double.harmonic[whole].tolist() == single.harmonic.tolist()
    sizes = accelerations(again, 3)["stage"], accelerations(once, 3)["stage"]
    largest = np.abs(sizes[1]).max()
    assert np.abs(sizes[0][..., whole] - sizes[1]).max() < 1e-9 * largest
    assert np.abs(sizes[0][..., ~whole]).max(initial=0.0) < 1e-9 * largest


def test_the_casing_moves_as_feet_and_bearings_push_it():
    found = response()
    (stage,) = found.stages
    sensors, bearings, feet = (rows.shape[0] for rows in output_rows(found.deflection))
    assert (sensors, bearings, feet) == (3, 12, 12)
    omega = stage.order * found.speed[:, None]
    inertia = -MASS * omega[:, None] ** 2 * stage.motion[:, :3]
    on_shafts = stage.motion[:, 3:15].reshape(2, 4, 3, -1).sum(axis=1)
    on_casing = stage.motion[:, 15:].reshape(2, 4, 3, -1).sum(axis=1)
    left = inertia - (on_casing - on_shafts)
    assert np.abs(left).max() < 1e-9 * np.abs(on_shafts).max()


def test_forces_stay_near_their_mean_and_slow_gears_near_statics():
    found = response()
    (stage,) = found.stages
    mean = stage.force[..., 0]
    assert (stage.force[..., 2] < mean).all() and (mean < stage.force[..., 1]).all()
    assert mean[0, 0] == pytest.approx(found.deflection.contacts["stage"].normal_force[0], rel=1e-6)
    slow = solve_gearbox_response(pair_in_a_casing(), [5.0 * RPM])
    record = slow.stages[0]
    assert record.dynamic_force[0, 0] < 1e-3 * mean[0, 0]


def test_levels_add_lines_of_one_order_with_their_phase():
    found = response()
    moved = accelerations(found, 3)
    stage = found.stages[0]
    assert moved["stage"] == pytest.approx(-((stage.order * found.speed[:, None])[:, None] ** 2) * stage.motion[:, :3])
    alone = np.sqrt(0.5 * (np.abs(moved["stage"]) ** 2).sum(axis=2))
    assert level(found, moved) == pytest.approx(alone)
    twice = replace(found, stages=(stage, replace(stage, name="again")))
    lines = {"stage": moved["stage"], "again": -moved["stage"]}
    assert np.abs(level(twice, lines)).max() < 1e-12 * alone.max()
    other = replace(found, stages=(stage, replace(stage, name="again", order=stage.order * 1.01)))
    assert level(other, lines) == pytest.approx(np.sqrt(2.0) * alone)


def test_what_the_stiffness_of_a_stage_does_on_the_motion_of_another_is_told():
    found = response()
    stage = found.stages[0]
    assert np.isnan(stage.approach).all()
    model = replace(found.deflection.model, stages=tuple(replace(found.deflection.model.stages[0]) for _ in range(2)))
    moved = replace(stage, approach=np.full((2, 1), 3e-8), spread=np.array([2e7]), dynamic_force=np.full((2, 1), 6.0))
    moved = replace(moved, varying=())  # as of other meshes
    both = replace(found, deflection=replace(found.deflection, model=model), stages=(moved, moved))
    cross = both.cross_excitation
    # over the force by both stages, which are equally strong here
    assert cross[:, 0, 1] == pytest.approx(np.sqrt([0.005, 0.005]))
    assert not cross[:, 0, 0].any()
    together = replace(moved, varying=(0,))
    assert not replace(both, stages=(together, together)).cross_excitation.any()


def test_rows_of_other_meshes_are_their_approach():
    found = pair_in_a_casing()
    stage = found.model.stages[0]
    assert not mesh_rows(found.model, stage.meshes).any()
    other = mesh_rows(found.model, ())
    assert other[0] == pytest.approx(found.model.assembly.columns.mean(axis=1))


def test_stages_without_teeth_excite_nothing():
    found = solve_deflection(read_case(pair_tables()))
    silent = solve_gearbox_response(found, [1000.0 * RPM])
    assert silent.missing == ("stage",)
    assert not silent.stages
