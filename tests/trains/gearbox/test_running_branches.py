"""Planets that are shafts run around: as those of a planetary stage, lines by symmetry, one planet as all of them."""

from dataclasses import replace

import numpy as np
import pytest
from planet_gearboxes import (
    COUNTED,
    bending_set,
    in_casing,
    known_set,
    lines_apart,
    lines_of,
    outer_lines,
    planet_shaft,
    responded,
    simple_set,
    stepped_set,
)

from femgear.housing.two_way.running_planets import solve_excitations, solve_running
from femgear.system.system import MeshExcitation
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.excitation import pair_count_excitation
from femgear.trains.gearbox.planet_branches import running_sets
from femgear.trains.gearbox.planet_shafts import pair_phases, standing_planets
from femgear.trains.gearbox.response_results import GearboxResponseResult
from femgear.trains.gearbox.running_branches import branch_kinds, branch_stage, kinds_together
from femgear.trains.gearbox.sensors import sensor_rows
from femgear.trains.gearbox.stage_structure import running_stage
from femgear.trains.reading import read_case

pytestmark = pytest.mark.usefixtures("coarse_states")


@pytest.mark.parametrize(
    ("fixed", "torque", "motions", "planets"),
    [
        ("ring", 100.0, "space", 3),
        ("ring", -80.0, "plane", 4),
        ("carrier", 100.0, "plane", 3),
        ("sun", 90.0, "plane", 3),
    ],
)
def test_simple_planets_run_around_as_those_of_a_planetary_stage(fixed, torque, motions, planets):
    """Sensors on an uneven casing, bearings and feet, with k(t) of 30 % of all meshes."""
    tables = {"fixed": fixed, "torque": torque, "motions": motions, "planets": planets}
    own, known = (outer_lines(make, **tables) for make in (simple_set, known_set))
    assert np.abs(known[1][:2]).max() > 1e-12
    assert lines_apart(own, known) < 1e-9
    assert len(own[0]) > 4 or fixed == "carrier" or planets == 4  # side bands beside four harmonics


SEQUENTIAL = (25, 56, 28, 109)
"""Planets one third of a mesh period after one another, at both meshes."""
AROUND = {"sun-0..2": 56 * 109 // 28, "0..2-ring": 109}
"""Mesh periods in a turn of the carrier against what stands."""


def excited_set(teeth=SEQUENTIAL):
    tables = stepped_set(teeth=teeth)
    for stage in tables["pair"]:
        stage["mesh"] |= {"contact_ratio": 1.63, "low_share": 0.8}
    return tables


def test_equal_stepped_planets_make_lines_that_their_symmetry_allows():
    """Both base frequencies, of planets that are all solved for: even errors of zero make each one of its own."""
    few, tables = responded(in_casing(excited_set(), harmonics=3)), excited_set()
    planet_shaft(tables, 0)["pin_error"] = {}
    every = responded(in_casing(tables, harmonics=3))
    assert [stage.name for stage in every.stages] == ["0..2-ring", "sun-0..2"]
    for stage, alike in zip(every.stages, few.stages, strict=True):
        off = (stage.harmonic * AROUND[stage.name] + stage.side_band) % 3 != 0
        size = np.abs(stage.motion[0, :2]).max(axis=1)
        assert off.any() and (np.abs(stage.motion[0, :2][:, off]).max(axis=1) < 1e-10 * size).all()
        heard = np.abs(alike.motion[0, :2]).max(axis=0) > 0.0
        assert {1, -1} <= {*alike.side_band[heard].tolist()}
        assert ((alike.harmonic * AROUND[stage.name] + alike.side_band)[heard] % 3 == 0).all()
    assert lines_apart(lines_of(every, slice(None)), lines_of(few, slice(None))) < 1e-8


def test_forces_on_pins_are_those_of_all_planets_alike():
    found = responded(in_casing(excited_set()))
    data = GearboxResponseResult(found, True).dataset()
    names = [str(name) for name in data["bearing"].values]
    pins = [number for number, name in enumerate(names) if name.startswith("pin")]
    force = data["bearing_force_rms"].values[0, pins]
    assert force[:, :2].min() > 0.0
    np.testing.assert_allclose(force, np.broadcast_to(force[0], force.shape), rtol=1e-8, atol=1e-9 * force.max())


def test_what_a_pin_error_changes_is_small_and_there():
    tables = excited_set()
    equal = responded(in_casing(tables))
    planet_shaft(tables, 1)["pin_error"] = {"tangential": "3 um"}
    uneven = responded(in_casing(tables))
    order, amplitude = lines_of(uneven, slice(0, 2))
    known = lines_of(equal, slice(0, 2))
    silent = known[0][np.abs(known[1][0]) < 1e-12 * np.abs(known[1][0]).max()]
    beside = np.abs(amplitude[0, np.isin(order, silent)])
    assert max(beside) > 1e-4 * np.abs(amplitude[0]).max()


@pytest.mark.parametrize("change", ["none", "alone", "unequal"])
def test_planets_that_something_else_holds_stand(change):
    tables = stepped_set()
    if change == "alone":
        tables["bearing"].append({"name": "more", "shaft": "p0", "radial": "1e5 N/m"})
    if change == "unequal":
        tables["bearing"].append({"name": "more", "shaft": "p0", "outer_shaft": "carrier", "radial": "1e5 N/m"})
    case = read_case(tables)
    assert len(running_sets(case)) == (change == "none")
    assert [one.code for one in standing_planets(case)] == ([] if change == "none" else ["W-STANDING"])


def rubbed(found):
    """Excitations of all stages by counts of tooth pairs, with a friction of two harmonics at each."""
    theta = 2.0 * np.pi * np.arange(512) / 512
    listed = {}
    for stage in found.model.stages:
        count = 2 * len(stage.meshes)
        drive = pair_count_excitation(found.model, stage)
        source = np.outer(np.arange(1.0, count + 1.0), 3.0 * np.cos(theta) + np.sin(2.0 * theta))
        whole = {name: getattr(drive, name)[:, :: drive.stiffness.shape[1] // 512][:, :512] for name in RECORDS}
        listed[stage.name] = MeshExcitation(*whole.values(), drive.backlash, source=source)
    return listed


RECORDS = ("stiffness", "deflection", "force")


def test_friction_acts_on_planets_as_on_those_of_a_planetary_stage():
    """All records of both kinds of meshes and of their friction, as the branches take them, in the planetary stage."""
    own, known = (
        solve_deflection(read_case(in_casing(make(teeth=(28, 38, 104), mesh=COUNTED, motions="space"))))
        for make in (simple_set, known_set)
    )
    (running,) = running_sets(own.model.case)
    phases = pair_phases(own.model.case, own.model.flow)
    branches, _ = branch_stage(own, running, 0, rubbed(own), phases)
    assert [names[0] for names in running.kinds] == ["0-ring", "sun-0"]
    (stage,) = known.model.stages
    box = running_stage(known, stage, rubbed(known)[stage.name])
    drive = branches.running.excitation
    # the planetary stage has the sun first
    swapped = {name: np.roll(getattr(drive, name).reshape(2, 3, -1), 1, axis=0).reshape(6, -1) for name in RECORDS}
    assert drive.source is not None
    source = np.roll(drive.source.reshape(2, 2, 3, -1), 1, axis=1).reshape(12, -1)
    paths = replace(box.running.paths, symmetry=branches.running.paths.symmetry)
    drive = MeshExcitation(*swapped.values(), drive.backlash, source=source)
    # damping is that of the mean stiffness
    stiffness = np.append(branches.running.stiffness[[1, 0]], box.running.stiffness[2:])
    set_running = replace(box.running, excitation=drive, paths=paths, stiffness=stiffness)
    mesh = 2.0 * np.pi * own.model.flow.mesh_frequency["sun-0"]
    speed = abs(own.model.flow.speed["carrier"])
    options = {"harmonics": (3, 3), "side_bands": 4, "tolerance": 1e-12}
    rows = sensor_rows(own.model), sensor_rows(known.model)
    heard = [
        solve_running(part, mesh, speed, **options).lines((row @ motion).T)
        for part, row, motion in zip((branches.running, set_running), rows, (branches.motion, box.motion), strict=True)
    ]
    assert np.abs(heard[0] - heard[1]).max() < 1e-9 * np.abs(heard[1]).max()
    still = solve_running(replace(set_running, rubbing=None), mesh, speed, **options).lines((rows[1] @ box.motion).T)
    assert np.abs(heard[1] - still).max() > 1e-6 * np.abs(still).max()


def test_round_planets_that_bend_whirl_both_ways_alone(monkeypatch):
    """Whirls, axial motions and rotations know nothing of one another: as all motions at once."""
    state = solve_deflection(read_case(bending_set(0.3, back=False)))
    excitations = {stage.name: pair_count_excitation(state.model, stage) for stage in state.model.stages}
    phases = pair_phases(state.model.case, state.model.flow)
    (around,) = running_sets(state.model.case)
    stage = branch_stage(state, around, 0, excitations, phases)[0].running
    sizes = sorted(len(motions.mass) for motions in stage.independent_motions)
    assert sizes == [2, 2, 4, 4] and sum(sizes) == len(stage.mass)
    speeds, known = (2000.0, 60.0), {"harmonics": (3, 3), "side_bands": 4, "tolerance": 1e-13}
    alone = solve_running(stage, *speeds, **known)
    monkeypatch.setattr(type(stage), "independent_motions", property(lambda stage: (stage.planet_motions,)))
    whole = solve_running(stage, *speeds, **known)
    np.testing.assert_allclose(alone.modal, whole.modal, rtol=0.0, atol=1e-11 * np.abs(whole.modal).max())
    np.testing.assert_allclose(alone.force, whole.force, rtol=0.0, atol=1e-11 * np.abs(whole.force).max())


def test_kinds_of_one_mesh_frequency_are_solved_at_once_as_each_alone():
    state = solve_deflection(read_case(simple_set(mesh=COUNTED, torque=90.0)))
    excitations = {stage.name: pair_count_excitation(state.model, stage) for stage in state.model.stages}
    phases = pair_phases(state.model.case, state.model.flow)
    (around,) = running_sets(state.model.case)
    assert kinds_together(state.model, around, 1) == [0, 1]
    (together,) = branch_kinds(state, around, [0, 1], excitations, phases)
    speeds, known = (2000.0, 60.0), {"harmonics": (4, 4), "side_bands": 4, "tolerance": 1e-13}
    at_once = solve_excitations([structured.running for structured, _ in together], *speeds, **known)
    for kind, ((_, forces), response) in enumerate(zip(together, at_once, strict=True)):
        structured, own = branch_stage(state, around, kind, excitations, phases)
        alone = solve_running(structured.running, *speeds, **known)
        assert forces.exciting_kinds == own.exciting_kinds
        np.testing.assert_allclose(response.force, alone.force, rtol=0.0, atol=1e-12 * np.abs(alone.force).max())
        np.testing.assert_allclose(response.modal, alone.modal, rtol=0.0, atol=1e-12 * np.abs(alone.modal).max())


def test_kinds_of_other_stiffness_stand_apart():
    """A kind whose record is shorter than that of another one, and so none beside it, has its own mean stiffness."""
    state = solve_deflection(read_case(simple_set(mesh=COUNTED, torque=90.0)))
    excitations = {stage.name: pair_count_excitation(state.model, stage) for stage in state.model.stages}
    for name in [name for name in excitations if name.endswith("ring")]:
        record = excitations[name]
        arrays = {part: 1.1 * getattr(record, part)[:, ::2] for part in ("stiffness", "deflection", "force")}
        excitations[name] = replace(record, **arrays)
    phases = pair_phases(state.model.case, state.model.flow)
    (around,) = running_sets(state.model.case)
    assert [len(group) for group in branch_kinds(state, around, [0, 1], excitations, phases)] == [1, 1]
