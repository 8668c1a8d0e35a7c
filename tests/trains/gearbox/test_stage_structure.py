"""A stage in the structure of all the rest, against the whole gearbox with its planets where they stand.

Where the carrier stands still and stiffnesses are constant the response is that of the linear gearbox to harmonic
forces at the meshes: every row, wave and spring of the stage is in it.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from casings import casing_tables
from random_gearboxes import random_gearbox
from small_gearbox import pair_tables, planetary_tables, set_on_shafts

from femgear.case.dependencies import Steps
from femgear.housing.two_way.running_planets import solve_running
from femgear.system.system import MeshExcitation
from femgear.trains.gearbox.deflection import Deflection, solve_deflection
from femgear.trains.gearbox.excitation import excitation_of
from femgear.trains.gearbox.model import StageModel
from femgear.trains.gearbox.modes import linear_system, solve_gearbox_modes
from femgear.trains.gearbox.stage_structure import (
    equal_planets,
    in_time,
    running_stage,
    stage_excitation,
    structure_without,
)
from femgear.trains.reading import read_case

pytestmark = pytest.mark.usefixtures("coarse_states")

POSITIONS = 32


def synthetic(found: Deflection, stage: StageModel) -> MeshExcitation:
    """Excitation of constant stiffness, planets one after the other as their places have it."""
    contacts = found.model.assembly.contacts
    count = max(len(stage.planets), 1)
    theta = 2.0 * np.pi * np.arange(POSITIONS) / POSITIONS
    arrays = np.zeros((3, len(stage.meshes), POSITIONS))
    for number, mesh in enumerate(stage.meshes):
        psi = stage.angles[number % count] if stage.planets else 0.0
        at = theta + (stage.sizes.teeth[-1] * psi if stage.planets else 0.0)
        arrays[0, number] = contacts[mesh].stiffness.sum()
        arrays[1, number] = 1e-6 * (1.0 + number // count) * np.cos(at + 0.4) + 2e-7 * np.cos(3.0 * at)
        arrays[2, number] = 1000.0
    return MeshExcitation(*arrays, np.zeros(len(stage.meshes)))


def whole_answer(found: Deflection, stage: StageModel, excitation: MeshExcitation, omega: float, harmonic: int):
    """Motions (6n,) of the linear gearbox at a harmonic, two-sided, by the deflections of the meshes."""
    assembly, system, stiffness = linear_system(found)
    loss = 1.0 + 2j * found.model.case.modes.damping_ratio
    lines = np.fft.fft(excitation.deflection, axis=1)[:, harmonic] / POSITIONS
    force = np.zeros(len(stiffness), complex)
    for number, mesh in enumerate(stage.meshes):
        part = assembly.slices[mesh]
        # forces as the leader has them: the stiffness of the excitation has no loss
        force[part] = -stiffness[part] * lines[number]
    dynamic = (system.K + (system.W * stiffness) @ system.W.T) * loss - omega**2 * system.M
    return assembly.motions @ np.linalg.solve(dynamic, -system.W @ force)


def apart(found: Deflection, stage: StageModel) -> float:
    """Largest difference of all motions of shafts and casing, over the largest one."""
    found = replace(found, slice_force=np.zeros_like(found.slice_force))
    structured = running_stage(found, stage, synthetic(found, stage))
    running, motion = structured.running, structured.motion
    running = replace(running, gyroscopic=np.zeros_like(running.gyroscopic))
    omega, worst = 2.0 * math.pi * 700.0, 0.0
    response = solve_running(running, omega, 0.0, harmonics=(3, 3), tolerance=1e-13)
    gone = [6 * planet + way for planet in stage.planets for way in range(6)]
    for harmonic in (1, 3):
        met = motion @ response.modal[harmonic].sum(axis=0)
        wanted = whole_answer(found, stage, running.excitation, harmonic * omega, harmonic)
        size = np.abs(wanted).max()
        wanted[gone] = 0.0
        worst = max(worst, np.abs(met - wanted).max() / size)
    return worst


@pytest.mark.parametrize(
    "seed",
    [
        pytest.param(seed, marks=pytest.mark.slow if seed in (1, 2, 3, 5, 6, 7, 9, 10, 12, 13) else ())
        for seed in range(16)
    ],
)
def test_a_stage_at_rest_moves_the_gearbox_as_forces_at_its_meshes_do(seed):
    found = solve_deflection(read_case(random_gearbox(seed, 3)))
    for stage in found.model.stages:
        assert apart(found, stage) < 1e-8, stage.name


@pytest.mark.parametrize("motions", ["plane", "rotation"])
def test_motions_that_do_not_take_place_are_left_out(motions):
    found = solve_deflection(read_case(set_on_shafts() | {"motions": motions, "deflection": {"contact": False}}))
    assert apart(found, found.model.stages[0]) < 1e-8
    kinds = solve_gearbox_modes(found).modes.kind
    # carrier and planets go round
    assert kinds.count("rigid") == 1


def test_pins_and_carriers_that_give_way_are_in_it():
    tables = set_on_shafts() | {"deflection": {"contact": False}}
    stage = tables["planetary"][0]
    stage["pins"] = {"diameter": "12 mm", "length": "14 mm", "cheeks": 2}
    stage["carrier_body"] = {"wind_up_stiffness": "2e5 N m/rad"}
    found = solve_deflection(read_case(tables))
    assert apart(found, found.model.stages[0]) < 1e-8


def test_a_casing_whose_centre_lies_beside_the_axis_carries_the_ring():
    found = solve_deflection(read_case(planetary_tables() | {"casing": casing_tables()}))
    assert apart(found, found.model.stages[0]) < 1e-8


def test_the_structure_has_no_planets_and_no_meshes_of_the_stage():
    found = solve_deflection(read_case(set_on_shafts() | {"deflection": {"contact": False}}))
    stage = found.model.stages[0]
    rest, system, stiffness = structure_without(found, stage)
    whole = linear_system(found)[1]
    assert len(whole.dofs) - len(system.dofs) >= 3
    assert not rest.contacts
    assert not len(stiffness)
    assert not any("planet" in name for name in system.dofs)


def test_planets_whose_slices_are_pressed_unequally_count_with_their_mean():
    found = solve_deflection(read_case(set_on_shafts() | {"deflection": {"contact": False}}))
    stage, (assembly, _, stiffness) = found.model.stages[0], linear_system(found)
    first = assembly.slices[stage.meshes[0]]
    stiffness[first.start] = 0.0
    mean = equal_planets(assembly, stage.meshes, len(stage.planets), stiffness)
    assert mean[first.start] == pytest.approx(2.0 / 3.0 * stiffness[first.start + 1], rel=1e-12)
    of_planets = [mean[assembly.slices[mesh]] for mesh in stage.meshes[:3]]
    assert all(np.array_equal(values, of_planets[0]) for values in of_planets)
    assert mean.sum() == pytest.approx(stiffness.sum(), rel=1e-12)


@pytest.mark.parametrize(("planets", "symmetry"), [(3, 3), (4, 1)])
def test_planets_that_do_not_assemble_are_none_like_another(planets, symmetry):
    """19 and 56 teeth have room for three planets at equal angles, four miss by half a tooth."""
    mesh = {"stiffness": "3e8 N/m", "contact_ratio": 1.6}
    tables = planetary_tables(sun_mesh=mesh, ring_mesh=mesh)
    tables["planetary"][0]["gears"] |= {"teeth": [19, 17, 56], "planets": planets}
    found = solve_deflection(read_case(tables))
    stage = found.model.stages[0]
    drive = excitation_of(found, stage)
    excitation, paths, _ = in_time(found.model, stage, drive)
    assert paths.symmetry == symmetry
    # the mean of planets out of phase would excite nothing
    assert excitation.stiffness.std(axis=1) == pytest.approx(drive.stiffness.std(axis=1), rel=1e-6)


@pytest.mark.slow
def test_excitation_has_the_mean_of_the_contact_along_the_normal():
    tables = pair_tables(teeth=True)
    tables["pair"][0]["teeth"]["set"]["helix_angle"] = "12 deg"
    tables["shaft"][1]["axis"] = [f"{90.0 / math.cos(math.radians(12.0))} mm", "0 mm"]
    steps = Steps()
    found = solve_deflection(read_case(tables), steps=steps)
    contact = found.contacts["stage"]
    excitation = stage_excitation(contact, steps=steps)
    assert excitation.stiffness.mean() == pytest.approx(contact.stiffness[0], rel=5e-3)
    assert excitation.force.mean() == pytest.approx(contact.normal_force[0], rel=1e-6)
    assert stage_excitation(contact, steps=steps) is excitation
    running = running_stage(found, found.model.stages[0], excitation).running
    # gear 1 turns counter-clockwise in this load case
    assert np.array_equal(running.excitation.deflection, excitation.deflection)


def test_gears_that_turn_the_other_way_round_meet_their_flanks_in_reverse():
    tables = pair_tables()
    forward = solve_deflection(read_case(tables))
    tables["operation"]["load_case"][0]["speed"] = {"input": "-1000 rpm"}
    backward = solve_deflection(read_case(tables))
    stages = [found.model.stages[0] for found in (forward, backward)]
    excitation = synthetic(forward, stages[0])
    there, back = (
        running_stage(found, stage, excitation).running.excitation.deflection
        for found, stage in zip((forward, backward), stages, strict=True)
    )
    assert np.array_equal(back, np.roll(there[:, ::-1], 1, axis=1))
