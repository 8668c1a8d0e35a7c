"""Functional mock-up units: run by FMPy they move as the spectral solver and harmonic balance say."""

import shutil
import subprocess
import zipfile
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from chain_model import (
    DAMPING,
    HARMONICS,
    POSITIONS,
    RADII,
    TORQUE,
    chain_excitation,
    chain_model,
    chain_modes,
    chain_system,
    rubbing_chain,
)

from femgear.errors import CaseError
from femgear.exchange.fmu import identifier, unit_variables, write_fmu
from femgear.findings import FindingWarning
from femgear.solvers.linear.modal import modal_damping
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.system.fourier import sample
from femgear.system.system import NonlinearSystem, gear_meshes

pytestmark = pytest.mark.usefixtures("coarse_states")

needs_compiler = pytest.mark.skipif(not shutil.which("cc"), reason="no C compiler")
POINTS = 32
DEFLECTION, FORCE = "deflection_of_gear_1_gear_2", "force_of_gear_1_gear_2"


def run(path, model, outputs, *, periods=None, **start):
    """The last mesh period of a run that has forgotten its start."""
    fmpy = pytest.importorskip("fmpy")
    hertz = model.mesh_rate * start.get("speed", model.speed)
    decay = (model.modal.omega * model.modal.damping_ratio)[model.modal.omega > 0.0].min()
    periods = periods or int(20.0 * hertz / decay) + 1
    step = 1.0 / (hertz * POINTS)
    rows = fmpy.simulate_fmu(
        str(path), stop_time=periods / hertz, output_interval=step, step_size=step, start_values=start, output=outputs
    )
    return rows[-POINTS - 1 : -1]


@needs_compiler
@pytest.mark.parametrize(("speed", "version"), [(150.0, 2), (420.0, 2), (150.0, 3)])
def test_a_linear_train_moves_as_the_spectral_solver_says(tmp_path, speed, version):
    excitation = chain_excitation()
    model, modes = chain_model(excitation), chain_modes(chain_system(), excitation)
    write_fmu(model, tmp_path / "chain.fmu", harmonics=HARMONICS, version=version)
    rows = run(tmp_path / "chain.fmu", model, [DEFLECTION, FORCE, "motor_rotation_rate"], speed=speed)
    hertz = [model.mesh_rate * speed]
    response = solve_spectral(modes, excitation, hertz, excitation_harmonics=HARMONICS, response_harmonics=60)
    for name, lines in ((DEFLECTION, response.deflection[0, 0]), (FORCE, response.force[0, 0])):
        expected = sample(lines, 4 * POINTS)[::4]
        assert np.abs(rows[name] - expected).max() <= 1e-6 * np.abs(expected).max(), name
    assert rows["motor_rotation_rate"].mean() == pytest.approx(speed, rel=1e-6)


@needs_compiler
def test_friction_of_the_tables_acts(tmp_path):
    model, modes = rubbing_chain()
    write_fmu(model, tmp_path / "chain.fmu", harmonics=HARMONICS)
    rows = run(tmp_path / "chain.fmu", model, [DEFLECTION])
    hertz = [model.mesh_rate * model.speed]
    response = solve_spectral(modes, model.excitation, hertz, excitation_harmonics=HARMONICS, response_harmonics=60)
    expected = sample(response.deflection[0, 0], 4 * POINTS)[::4]
    assert np.abs(rows[DEFLECTION] - expected).max() <= 1e-6 * np.abs(expected).max()
    assert "friction_force_of_gear_1_gear_2" not in {variable.name for variable in unit_variables(model)}


@needs_compiler
def test_flanks_part_as_harmonic_balance_says(tmp_path):
    """In resonance with the mesh, where the linear motion would pull."""
    excitation = chain_excitation(0.3, error=4e-6, backlash=1e-4)
    model, system = chain_model(excitation, separates=True), chain_system()
    modes = chain_modes(system, excitation)
    speed = modes.frequency[-1] / model.mesh_rate
    damped = replace(system, C=modal_damping(system, modes.mesh_stiffness, DAMPING))
    problem = NonlinearSystem(damped, (gear_meshes(excitation, harmonics=HARMONICS),))
    base = 2.0 * np.pi * model.mesh_rate * speed
    solution = solve_harmonic_balance(problem, base, harmonics=120, radius=False)
    assert solution.converged
    write_fmu(model, tmp_path / "chain.fmu", harmonics=HARMONICS)
    rows = run(tmp_path / "chain.fmu", model, [DEFLECTION, FORCE], speed=speed)
    assert rows[FORCE].min() == 0.0
    expected = sample(solution.deflection[0], 8 * POINTS)[::8]
    assert np.abs(rows[DEFLECTION] - expected).max() <= 1e-5 * np.abs(expected).max()


@needs_compiler
def test_torques_out_of_balance_accelerate_the_whole(tmp_path):
    model = chain_model()
    write_fmu(model, tmp_path / "chain.fmu", harmonics=HARMONICS)
    ratio = RADII[0] / RADII[1]
    inertia = (np.diag(chain_system().M) * np.array([1.0, 1.0, ratio, ratio]) ** 2).sum()
    names = ["motor_rotation_rate", "load_rotation_rate", "motor_rotation", "mesh_phase"]
    rows = run(tmp_path / "chain.fmu", model, names, periods=200, torque_on_motor=TORQUE + 5.0)
    end = rows["time"][-1]
    faster = model.speed + 5.0 / inertia * end
    assert rows["motor_rotation_rate"][-1] == pytest.approx(faster, rel=1e-3)
    assert rows["load_rotation_rate"][-1] == pytest.approx(-ratio * faster, rel=1e-3)
    assert rows["mesh_phase"][-1] == pytest.approx(model.mesh_rate * rows["motor_rotation"][-1], rel=1e-4)


@needs_compiler
def test_a_state_is_taken_and_given_back(tmp_path):
    fmpy = pytest.importorskip("fmpy")
    from fmpy.fmi2 import FMU2Slave

    write_fmu(chain_model(), tmp_path / "chain.fmu", harmonics=HARMONICS)
    description = fmpy.read_model_description(str(tmp_path / "chain.fmu"))
    folder = fmpy.extract(str(tmp_path / "chain.fmu"), str(tmp_path / "unit"))
    identity = description.coSimulation.modelIdentifier
    unit = FMU2Slave(guid=description.guid, unzipDirectory=folder, modelIdentifier=identity, instanceName="chain")
    references = {variable.name: variable.valueReference for variable in description.modelVariables}
    unit.instantiate()
    unit.setupExperiment(startTime=0.0)
    unit.enterInitializationMode()
    unit.setReal([references["start_phase"]], [0.25])
    (turned,) = unit.getReal([references[DEFLECTION]])
    assert turned == pytest.approx(chain_excitation().deflection[0, POSITIONS // 4], rel=1e-9)
    unit.setReal([references["start_phase"]], [0.0])
    unit.exitInitializationMode()
    # at rest under its torque the mesh has the force and the deflection of its tables
    force, deflection = unit.getReal([references[FORCE], references[DEFLECTION]])
    assert force == pytest.approx(TORQUE / RADII[0], rel=1e-9)
    assert deflection == pytest.approx(chain_excitation().deflection[0, 0], rel=1e-9)
    found = []
    kept = unit.getFMUState()
    for _ in range(2):
        unit.doStep(0.0, 1e-3)
        found.append(unit.getReal([references[FORCE], references["motor_rotation"]]))
        unit.setFMUState(kept)
    unit.freeFMUState(kept)
    assert found[0] == found[1] != [force, 0.0]
    with pytest.raises(Exception, match="fmi2SetReal"):
        unit.setReal([references["tolerance"]], [-1.0])
    unit.terminate()
    unit.freeInstance()


@needs_compiler
def test_the_description_is_valid_and_the_source_without_warnings(tmp_path):
    model = chain_model()
    write_fmu(model, tmp_path / "chain.fmu", harmonics=2)
    with zipfile.ZipFile(tmp_path / "chain.fmu") as unit:
        description = ElementTree.fromstring(unit.read("modelDescription.xml"))
        source = unit.read("sources/femgear_model.c")
    names = [one.get("name") for one in description.iter("ScalarVariable")]
    assert names[:6] == ["damping_factor", "start_phase", "tolerance", "speed", "torque_on_motor", "torque_on_load"]
    assert names == [variable.name for variable in unit_variables(model)] and len({*names}) == len(names)
    (tmp_path / "model.c").write_bytes(source)
    flags = ["-std=c99", "-Wall", "-Wextra", "-Wno-unused-parameter", "-fsyntax-only"]
    said = subprocess.run(["cc", *flags, tmp_path / "model.c"], capture_output=True, text=True, check=True)
    assert said.stderr == ""
    validation = pytest.importorskip("fmpy.validation")
    assert validation.validate_fmu(str(tmp_path / "chain.fmu")) == []


@needs_compiler
def test_a_unit_for_fmi_3_is_valid_and_keeps_its_state(tmp_path):
    fmpy = pytest.importorskip("fmpy")
    from fmpy.fmi3 import FMU3Slave
    from fmpy.validation import validate_fmu

    path = tmp_path / "chain.fmu"
    write_fmu(chain_model(), path, harmonics=HARMONICS, version=3)
    assert validate_fmu(str(path)) == []
    description, folder = fmpy.read_model_description(str(path)), fmpy.extract(str(path), str(tmp_path / "unit"))
    assert description.fmiVersion == "3.0"
    names = [variable.name for variable in description.modelVariables]
    assert names == [*(variable.name for variable in unit_variables(chain_model())), "time"]
    references = {variable.name: variable.valueReference for variable in description.modelVariables}
    identity = description.coSimulation.modelIdentifier
    unit = FMU3Slave(guid=description.guid, unzipDirectory=folder, modelIdentifier=identity, instanceName="chain")
    assert unit.fmi3GetVersion() == b"3.0"
    unit.instantiate()
    unit.enterInitializationMode(startTime=2.0)
    unit.exitInitializationMode()
    wanted = [references[name] for name in (FORCE, "motor_rotation", "time")]
    first, kept, states = unit.getFloat64(wanted), unit.getFMUState(), []
    assert first[0] == pytest.approx(TORQUE / RADII[0], rel=1e-9) and first[2] == 2.0
    for _ in range(2):
        assert unit.doStep(2.0, 1e-3) == (False, False, False, 2.0 + 1e-3)
        states.append(unit.getFloat64(wanted))
        unit.setFMUState(kept)
    unit.freeFMUState(kept)
    assert states[0] == states[1] != first
    with pytest.raises(Exception, match="fmi3SetFloat64"):
        unit.setFloat64([references["tolerance"]], [-1.0])
    with pytest.raises(Exception, match="fmi3GetInt32"):
        unit.getInt32([0])
    unit.terminate()
    unit.freeInstance()
    flags = ["-std=c99", "-Wall", "-Wextra", "-Wno-unused-parameter", "-fsyntax-only"]
    source = Path(folder, "sources", "femgear_model.c")
    assert subprocess.run(["cc", *flags, source], capture_output=True, text=True, check=True).stderr == ""
    with pytest.raises(CaseError) as refused:
        write_fmu(chain_model(), tmp_path / "other.fmu", version=1)
    assert (refused.value.code, refused.value.value) == ("E-CHOICE", 1)


def test_without_a_compiler_the_unit_has_its_source(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.warns(FindingWarning, match="W-COMPILER"):
        write_fmu(chain_model(), tmp_path / "chain.fmu", harmonics=2)
    with zipfile.ZipFile(tmp_path / "chain.fmu") as unit:
        assert {*unit.namelist()} == {"modelDescription.xml", "sources/femgear_model.c"}


def test_names_are_plain_and_other_endings_refused(tmp_path):
    assert identifier("force of planet 1-ring, slice 2") == "force_of_planet_1_ring_slice_2"
    with pytest.raises(CaseError, match="no such format"):
        write_fmu(chain_model(), tmp_path / "chain.zip")
