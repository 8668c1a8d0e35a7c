"""Excitation of stages of given mesh stiffness: pairs in contact, phases of planets, force of the power flow."""

import math

import numpy as np
import pytest
from casings import RPM
from small_gearbox import pair_tables, planetary_tables

from femgear.errors import CaseError
from femgear.gears.gear import Gear
from femgear.gears.planetary import close_set
from femgear.system.fourier import harmonics_of
from femgear.trains.gearbox.deflection import Deflection, solve_deflection
from femgear.trains.gearbox.excitation import (
    constant_excitation,
    excitation_of,
    exciting_stages,
    mesh_phases,
    pair_count_wave,
    varies,
)
from femgear.trains.gearbox.response import solve_gearbox_response
from femgear.trains.gearbox.transient import all_excitations
from femgear.trains.reading import read_case

pytestmark = pytest.mark.usefixtures("coarse_states")


def loaded_pair(torque: str = "100 N m", **mesh) -> Deflection:
    """Pair of a given stiffness and contact ratio under a torque."""
    tables = pair_tables()
    tables["pair"][0]["mesh"] |= {"contact_ratio": 1.6} | mesh
    tables["operation"]["load_case"][0]["torque"]["motor"] = torque
    return solve_deflection(read_case(tables))


def loaded_set(**gears) -> Deflection:
    """Planetary set of given stiffnesses and contact ratios."""
    tables = planetary_tables()
    stage = tables["planetary"][0]
    stage["gears"] |= gears
    stage["sun_mesh"]["contact_ratio"], stage["ring_mesh"]["contact_ratio"] = 1.6, 1.8
    return solve_deflection(read_case(tables))


def test_a_given_mesh_has_the_force_of_the_power_flow_and_the_wave_of_its_pairs():
    found = loaded_pair(phase=0.1)
    (stage,) = exciting_stages(found)
    excitation = excitation_of(found, stage)
    force = 100.0 / (0.036 * math.cos(math.radians(20.0)))
    assert excitation.force.mean() == pytest.approx(force, rel=1e-12)
    assert excitation.deflection == pytest.approx(np.full((1, excitation.force.shape[1]), force / 4e8))
    lines = harmonics_of(excitation.stiffness, 5)[0]
    assert lines[1:] / lines[0] == pytest.approx(pair_count_wave(-0.9, 0.7, 5), abs=1e-12)
    # on the other flanks a pair passes its path from the other end
    other = loaded_pair("-100 N m", phase=0.1)
    mirrored = harmonics_of(excitation_of(other, other.model.stages[0]).stiffness, 5)[0]
    assert mirrored == pytest.approx(lines.conj(), abs=1e-6 * 4e8)


def test_flanks_follow_slowly_turning_gears_and_resound_with_fast_ones():
    found = loaded_pair()
    slow, fast = (solve_gearbox_response(found, [speed * RPM]).stages[0] for speed in (5.0, 2000.0))
    mean = slow.force[0, 0, 0]
    assert slow.dynamic_force[0, 0] < 1e-3 * mean < 1e-2 * mean < fast.dynamic_force[0, 0]


@pytest.mark.parametrize("teeth", [(24, 24, 72), (21, 33, 87), (22, 26, 74)])
def test_phases_of_the_meshes_are_those_of_teeth_as_thick_as_their_spaces(teeth):
    # planets 1 and 2 half a turn of the set apart, the third where it assembles beside them
    step = 2.0 * math.pi / (teeth[0] + teeth[2])
    angles = (0.0, step * round(2.1 / step), step * round(4.0 / step))
    rims = (4e-3, 6e-3, 2e-3 * teeth[2])
    gears = [
        Gear(z, 2e-3, math.radians(20.0), 0.0, 20e-3, rim, internal=name == "ring", name=name)
        for name, z, rim in zip(("sun", "planet", "ring"), teeth, rims, strict=True)
    ]
    closed = close_set(*gears, planet_angles=angles)
    given = {"teeth": list(teeth), "planet_angles": [f"{angle!r} rad" for angle in angles], "planets": 3}
    sizes = loaded_set(**given, centre_distance=f"{teeth[0] + teeth[1]} mm").model.stages[0].sizes
    apart = mesh_phases(sizes) - closed.mesh_phases
    assert apart == pytest.approx(np.round(apart), abs=1e-9)


def test_planets_have_the_waves_of_their_phases_and_equal_forces():
    found = loaded_set()
    (stage,) = exciting_stages(found)
    excitation = excitation_of(found, stage)
    lines = harmonics_of(excitation.stiffness, 4)
    h = np.arange(1, 5)
    waves = np.repeat([pair_count_wave(-0.8, 0.8, 4), pair_count_wave(-0.9, 0.9, 4)], 3, axis=0)
    shifted = waves * np.exp(2j * np.pi * h * mesh_phases(stage.sizes)[:, None])
    assert lines[:, 1:] / lines[:, :1] == pytest.approx(shifted, abs=1e-12)
    torque = abs(found.model.flow.first_torque(stage.section))
    assert excitation.force.mean(axis=1) == pytest.approx(np.full(6, torque / (3 * stage.sizes.base_radii[0])))
    response = solve_gearbox_response(found, [1000.0 * RPM])
    assert response.missing == () and response.stages[0].dynamic_force.min() > 0.0


def test_meshes_without_contact_ratio_or_torque_excite_nothing():
    tables = planetary_tables()
    tables["planetary"][0]["sun_mesh"]["contact_ratio"] = 1.6
    found = solve_deflection(read_case(tables))
    assert exciting_stages(found) == []
    assert exciting_stages(loaded_pair("0 N m")) == []


POSITIONS = 20_000


def counted(start: float, end: float, overlap: float = 0.0) -> np.ndarray:
    """Length of contact at equal steps of the period, pairs at all transverse sections counted one by one."""
    tau = (np.arange(POSITIONS) + 0.5) / POSITIONS
    # one where all are alike
    sections = np.unique(overlap * (np.arange(50) - 24.5) / 50.0)
    pairs = np.arange(-5, 6)
    place = tau[:, None, None] + sections[:, None] + pairs
    return ((place > start) & (place < end)).sum(axis=2).mean(axis=1)


@pytest.mark.parametrize(("start", "end", "overlap"), [(-0.9, 0.7, 0.0), (-1.3, 1.9, 0.0), (-0.9, 0.7, 1.37)])
def test_harmonics_are_those_of_pairs_that_are_counted(start, end, overlap):
    length = counted(start, end, overlap)
    assert length.mean() == pytest.approx(end - start, rel=1e-3)
    wanted = harmonics_of(length / length.mean(), 8)[1:] * np.exp(-1j * np.pi * np.arange(1, 9) / POSITIONS)
    assert pair_count_wave(start, end, 8, overlap=overlap) == pytest.approx(wanted, abs=2e-3)


def test_whole_contact_or_overlap_ratios_keep_the_stiffness_constant():
    assert np.abs(pair_count_wave(-0.8, 1.2, 9)).max() < 1e-14
    assert np.abs(pair_count_wave(-0.9, 0.7, 9, overlap=1.0)).max() < 1e-14


def test_a_path_has_a_length():
    with pytest.raises(CaseError, match="ends before"):
        pair_count_wave(0.5, 0.5, 3)


def test_meshes_of_gears_that_stand_excite_nothing_and_vary_where_these_are_brought_to_turn():
    tables = pair_tables()
    tables["pair"][0]["mesh"] |= {"contact_ratio": 1.6}
    tables["operation"]["load_case"][0]["speed"]["input"] = "0 rpm"
    state = solve_deflection(read_case(tables))
    assert not exciting_stages(state)
    (stage,) = state.model.stages
    assert varies(state, stage) and np.ptp(all_excitations(state)[stage.name].stiffness) > 0.0
    assert np.ptp(constant_excitation(state, stage).stiffness) == 0.0
