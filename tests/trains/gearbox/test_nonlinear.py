"""A gearbox whose teeth part: against its loaded state, the free turn of the whole, and the trains of validation.

Long comparisons with pair, planar set, response and time integration are in validation.gearbox_nonlinear.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from planet_gearboxes import bending_set
from small_gearbox import TEETH, pair_tables, planetary_tables

from femgear.errors import CaseError
from femgear.solvers.periodic.harmonic_balance import displacements, solve_harmonic_balance
from femgear.system.system import MeshExcitation
from femgear.trains.gearbox.deflection import Deflection, solve_deflection
from femgear.trains.gearbox.excitation import pair_count_excitation
from femgear.trains.gearbox.model import gearbox_model
from femgear.trains.gearbox.nonlinear import nonlinear_gearbox, normal_backlash
from femgear.trains.gearbox.stage_structure import stage_excitation
from femgear.trains.reading import read_case
from validation import gearbox_nonlinear


def constant_excitation(found: Deflection, **changes) -> dict[str, MeshExcitation]:
    """Meshes of all stages with constant stiffness, that of the contacts."""
    drives = {}
    for stage in found.model.stages:
        k = np.array([found.model.assembly.contacts[mesh].stiffness.sum() for mesh in stage.meshes])[:, None]
        k = k * np.ones(8)
        drives[stage.name] = replace(MeshExcitation(k, 0.0 * k, 0.0 * k, np.zeros(len(k))), **changes)
    return drives


def apart_from_loaded_state(found: Deflection, drives: dict[str, MeshExcitation]) -> float:
    """Mean motion beside the loaded state, over the largest motion; both but for the free turn."""
    box = nonlinear_gearbox(found, drives, harmonics=1)
    solution = solve_harmonic_balance(box.problem, box.frequency, harmonics=1, stability=False, radius=False)
    assert solution.converged
    mean = displacements(box.problem, solution, box.motion)[:, 0].real
    values, vectors = np.linalg.eigh(box.problem.system.K + box.problem.system.W @ box.problem.system.W.T)
    free = box.motion @ vectors[:, values < 1e-9 * values[-1]]
    beside = mean - found.motion
    beside -= free @ np.linalg.lstsq(free, beside, rcond=None)[0]
    return float(np.abs(beside).max() / np.abs(found.motion).max())


def test_the_mean_state_is_the_loaded_state_of_springs_on_bending_shafts():
    tables = pair_tables(helix="12 deg") | {"gravity": {}, "deflection": {"slices": 5}}
    found = solve_deflection(read_case(tables))
    # slices that carry nothing would make the slope another one
    assert found.slice_force.min() > 0.0
    assert apart_from_loaded_state(found, constant_excitation(found)) < 1e-9


def test_the_mean_state_is_the_loaded_state_of_computed_teeth():
    found = solve_deflection(read_case(pair_tables(teeth=True) | {"motions": "plane"}))
    drive = {"stage": stage_excitation(found.contacts["stage"])}
    # the mean of k(t) and of the force over k(t) differ from those of the loaded state by the fluctuation
    assert apart_from_loaded_state(found, drive) < 1e-3


def test_teeth_touch_behind_beyond_their_play():
    found = solve_deflection(read_case(pair_tables() | {"motions": "rotation"}))
    drive = constant_excitation(found, backlash=np.array([3e-6]))
    box = nonlinear_gearbox(found, drive, harmonics=1)
    front, back = box.flanks[0]
    assert back is not None
    columns = box.problem.system.W
    approach = columns[np.abs(columns[:, 0]).argmax()]
    for gap, touches in ((2.99e-6, False), (3.01e-6, True)):
        x = -gap / approach[0] * approach
        force = back.evaluate(x[back.columns], np.zeros(1))[0]
        assert (force > 0.0).all() == touches
        assert not front.evaluate(x[front.columns], np.zeros(1))[0].any()


def test_the_play_is_that_of_the_teeth_along_the_normal():
    teeth = pair_tables(teeth=True, helix="0 deg")
    teeth["pair"][0]["teeth"] |= {"set": TEETH["set"] | {"centre_distance": "90.01 mm"}}
    teeth["shaft"][1]["axis"] = ["90.01 mm", "0 mm"]
    model = gearbox_model(read_case(teeth))
    # both flanks of a gap open by the tangent of the pressure angle
    assert normal_backlash(model.stages[0])[0] == pytest.approx(2.0 * 0.01e-3 * math.sin(math.radians(20.0)), rel=2e-3)
    assert normal_backlash(gearbox_model(read_case(pair_tables())).stages[0]).tolist() == [0.0]


def test_two_planets_turn_with_no_carrier():
    gears = {"teeth": [20, 20, 60], "planets": 2, "module": "2 mm", "centre_distance": "40 mm"}
    found = solve_deflection(read_case(planetary_tables(gears=gears)))
    with pytest.raises(CaseError) as error:
        nonlinear_gearbox(found, constant_excitation(found), harmonics=1)
    assert error.value.code == "E-TURNING"


def test_the_response_is_met():
    for row in gearbox_nonlinear.linear_meshes():
        assert row.ours <= row.gate and math.isfinite(row.ours), row.case


def test_meshes_that_are_one_stage_have_the_forces_of_each_alone():
    """Of helical stepped planets that bend and go round, at any motion, time and angle."""
    found = solve_deflection(read_case(bending_set(0.3, back=False)))
    drives = {stage.name: pair_count_excitation(found.model, stage) for stage in found.model.stages}
    kinds = [tuple(name for name in drives if name.startswith(mate)) for mate in ("sun", "ring")]
    each, joined = (nonlinear_gearbox(found, drives, harmonics=2, together=names) for names in ((), kinds))
    assert [stage.name for stage in joined.stages] == ["sun 0..2", "ring 0..2"]
    motion = np.random.default_rng(1).normal(size=(1, len(each.problem.system.M))) * 1e-5
    phase = dict(zip(joined.bases, (0.4, 1.1, 2.3), strict=True))
    forces = []
    for box in (each, joined):
        theta = np.array([[phase[base if base in phase else f"{base.split()[0]} 0 mesh"] for base in box.bases]])
        columns = motion @ box.problem.system.W
        total = np.zeros_like(columns)
        for element in box.problem.elements:
            force = element.evaluate(columns[:, element.columns], theta)[0]
            np.add.at(total[0], element.columns.ravel(), force.reshape(-1))
        forces.append(total @ box.problem.system.W.T)
    np.testing.assert_allclose(forces[1], forces[0], rtol=0.0, atol=1e-10 * np.abs(forces[0]).max())
    np.testing.assert_allclose(joined.problem.system.C, each.problem.system.C, atol=1e-9 * each.problem.system.C.max())
