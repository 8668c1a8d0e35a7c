"""Gearboxes for other programs: units move as harmonic balance of the whole gearbox, and the spectral solver, say."""

import shutil
from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
import pytest
from casings import pair_in_a_casing
from planet_gearboxes import stepped_set
from small_gearbox import loose_pair_tables, pair_tables, planetary_tables

from femgear.errors import CaseError
from femgear.exchange.dynamic_model import mesh_tables
from femgear.exchange.fmu import write_fmu
from femgear.run import dynamic_model, solve
from femgear.solvers.linear.state_space import state_space
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.trains.gearbox.dynamic_model import gearbox_dynamic_model
from femgear.trains.gearbox.nonlinear import nonlinear_gearbox
from femgear.trains.gearbox.transient import all_excitations
from femgear.trains.reading import read_case

pytestmark = pytest.mark.usefixtures("coarse_states")

needs_compiler = pytest.mark.skipif(not shutil.which("cc"), reason="no C compiler")
HARMONICS, LINES, INSTANTS = 3, 24, 65


@cache
def two_stages():
    """Two pairs one after the other, of rotations alone, whose meshes wave with their contact ratios; all modes."""
    tables = pair_tables() | {"motions": "rotation", "modes": {"damping_ratio": 0.05, "up_to": "1e6 Hz"}}
    end = {"name": "end", "axis": ["190 mm", "0 mm"], "part": [{"length": "90 mm", "outer_diameter": "50 mm"}]}
    tables["shaft"].append(end)
    tables["pair"][0]["mesh"]["contact_ratio"] = 1.6
    gears = {"teeth": [20, 30], "module": "4 mm", "face_width": "25 mm"}
    mesh = {"stiffness": "5e8 N/m", "contact_ratio": 1.7}
    second = {"name": "second", "shafts": ["output", "end"], "positions": ["60 mm", "60 mm"]}
    tables["pair"].append(second | {"gears": gears, "mesh": mesh})
    tables["load"][1] = {"name": "brake", "shaft": "end", "position": "90 mm"}
    tables["operation"]["load_case"][0]["speed"] = {"input": "3000 rpm"}
    case = read_case(tables)
    return case, dynamic_model(case)


def run(path, model, names):
    """The last mesh periods of a run that has forgotten its start."""
    fmpy = pytest.importorskip("fmpy")
    decay = (model.modal.omega * model.modal.damping_ratio)[model.modal.omega > 0.0].min()
    step = 1.0 / (32.0 * model.mesh_rate * model.speed)
    count = int(22.0 / decay / step) + INSTANTS
    rows = fmpy.simulate_fmu(str(path), stop_time=count * step, output_interval=step, step_size=step, output=names)
    return rows[-INSTANTS:]


@needs_compiler
def test_two_stages_excite_at_once_as_harmonic_balance_says(tmp_path):
    """Both meshes vary, each with its own frequency; the balance is that of the whole gearbox, without modes."""
    case, model = two_stages()
    found = solve(case, "deflection")["deflection"].of(case).state
    known = {"separates": False, "back_flanks": False, "gyroscopic": False, "turning": False}
    box = nonlinear_gearbox(found, all_excitations(found), harmonics=HARMONICS, **known)
    lines = [line for line in product(range(-LINES, LINES + 1), repeat=2) if line >= (0, 0)]
    orders = np.array([line for line in lines if abs(line[0]) + abs(line[1]) <= LINES])
    orders = orders[np.argsort(orders.any(axis=1), kind="stable")]
    solution = solve_harmonic_balance(box.problem, box.frequency, orders=orders, stability=False, radius=False)
    assert solution.converged
    write_fmu(model, tmp_path / "box.fmu", harmonics=HARMONICS)
    rows = run(tmp_path / "box.fmu", model, ["deflection_of_stage", "deflection_of_second"])
    wave = np.exp(1j * np.outer(orders @ box.frequency, rows["time"]))
    for name, row in zip(("deflection_of_stage", "deflection_of_second"), solution.deflection, strict=True):
        expected = np.real(row @ wave)
        assert np.ptp(expected) > 0.1 * np.abs(expected).max()
        assert np.abs(rows[name] - expected).max() <= 1e-6 * np.abs(expected).max(), name


def test_shafts_turn_as_their_teeth_do_and_every_mesh_has_its_own_frequency():
    _, model = two_stages()
    names = [port.name for port in model.modal.outputs]
    ratio = dict(zip(names, model.ratios, strict=True))
    assert [ratio[f"{shaft}: rotation"] for shaft in ("input", "output", "end")] == pytest.approx([1, -24 / 36, 4 / 9])
    assert model.mesh_ratio == pytest.approx([1.0, (24 / 36) * 20 / 24])
    assert model.mesh_rate == pytest.approx(24 / (2.0 * np.pi))
    torques = {port.name: port.nominal for port in model.modal.inputs}
    assert torques == pytest.approx({"torque on motor": 100.0, "torque on brake": -225.0})
    # what turns as a whole is no transmission error
    assert ratio["transmission error of stage"] == pytest.approx(0.0, abs=1e-12)


@needs_compiler
def test_a_sensor_on_the_casing_is_moved_and_accelerated(tmp_path):
    """Beside the transfer function of the matrices, at a constant stiffness of the teeth and a single line."""
    found = pair_in_a_casing()
    case = found.model.case
    model = gearbox_dynamic_model(case, {"deflection": _Loaded(found)})
    excitation = model.excitation
    mean = excitation.stiffness.mean(axis=1, keepdims=True)
    theta = 2.0 * np.pi * np.arange(excitation.stiffness.shape[1]) / excitation.stiffness.shape[1]
    wave = excitation.force.mean(axis=1, keepdims=True) + 0.0 * theta
    error = excitation.deflection.mean(axis=1, keepdims=True) + 1e-6 * np.cos(theta)
    plain = replace(excitation, stiffness=mean + 0.0 * theta, force=wave, deflection=error)
    modal = replace(model.modal, damping_ratio=np.full(len(model.modal.omega), 0.3))
    model = replace(model, excitation=plain, modal=modal)
    write_fmu(model, tmp_path / "box.fmu", harmonics=8)  # a finer table of the one line
    names = [port.name for port in model.modal.outputs if port.accelerates]
    name = names[0]
    rows = run(tmp_path / "box.fmu", model, [name, f"{name}_acceleration"])
    space, omega = state_space(modal), 2.0 * np.pi * model.mesh_rate * model.speed
    receptance = space.C @ np.linalg.solve(1j * omega * np.eye(len(space.A)) - space.A, space.B) + space.D
    turn = np.exp(1j * omega * rows["time"])
    for output in (name, f"{name} acceleration"):
        expected = np.real(1e-6 * receptance[space.outputs.index(output), 0] * turn)
        found_row = rows[output.replace(" ", "_")]
        assert np.abs(found_row - found_row.mean() - expected + expected.mean()).max() <= 1e-6 * np.abs(expected).max()


class _Loaded:
    """Loaded states of a case, of which one was solved."""

    def __init__(self, state):
        self.state = state

    def of(self, case):
        return self


def test_planets_that_run_around_have_a_model_of_rotations_alone():
    tables = planetary_tables()
    with pytest.raises(CaseError, match="the planets of set run around") as refused:
        dynamic_model(read_case(tables))
    assert refused.value.code == "E-MODEL" and 'motions = "rotation"' in refused.value.remedy
    model = dynamic_model(read_case(tables | {"motions": "rotation"}))
    ratio = dict(zip((port.name for port in model.modal.outputs), model.ratios, strict=True))
    assert ratio["carrier: rotation"] == pytest.approx(20 / 81)
    assert len(model.modal.meshes) == 6 and model.mesh_rate == pytest.approx(20 * (1 - 20 / 81) / (2.0 * np.pi))


def test_what_has_no_linear_model_is_refused():
    with pytest.raises(CaseError, match="changes with the play"):
        dynamic_model(read_case(loose_pair_tables("50 um")))


def test_tables_have_the_period_of_every_mesh():
    _, model = two_stages()
    tables = mesh_tables(model, HARMONICS)
    assert tables.stiffness.shape[0] == 2
    assert tables.stiffness.mean(axis=1) == pytest.approx([4e8, 5e8])


def test_planets_that_are_shafts_are_refused_with_what_else_there_is():
    with pytest.raises(CaseError, match="are shafts on a carrier") as refused:
        dynamic_model(read_case(stepped_set(motions="rotation")))
    assert "pair.carrier" in str(refused.value) and "transient" in str(refused.value)
