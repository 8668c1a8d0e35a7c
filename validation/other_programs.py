"""Models for other programs: units run by FMPy, and matrices, beside what femgear itself computes.

A unit integrates the motion in time, from rest, until the start is forgotten. Its C code shares with the reference the
modes and the tables over the angle, and no line of the solvers. FMPy loads, runs and reads it as any unit.
"""

from __future__ import annotations

import importlib.util
import shutil
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from femgear.exchange.dynamic_model import DynamicModel
from femgear.exchange.fmu import write_fmu
from femgear.run import dynamic_model, solve
from femgear.solvers.linear.state_space import state_space
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.system.fourier import sample
from femgear.trains.elastic.outputs import lines_of_field, mesh_and_ring_outputs
from femgear.trains.gearbox.nonlinear import nonlinear_gearbox
from femgear.trains.gearbox.transient import all_excitations
from femgear.trains.reading import read_case, with_values
from femgear.trains.registry import train_of
from validation.rows import Row, at_most, information

GATE = 1e-6
"""Of the difference over the largest value of the period."""
INSTANTS, RESPONSE = 64, 80
"""Instants of the period that are compared, and harmonics of the reference."""
SPECTRAL = "Spectral solver with the same harmonics of the excitation."
BALANCE = "Harmonic balance with play, 120 harmonics."
BOTH_FREQUENCIES = "Harmonic balance of the whole gearbox with both mesh frequencies, without modes."
CASES = Path(__file__).parents[1] / "cases"
_START_FORGOTTEN = 20.0
"""Decay of the slowest mode until the compared period, as exponent."""
_PAIR = {"static.positions": 16, "static.stresses": False, "set.backlash": "0.1 mm", "dynamics.damping_ratio": 0.02}
_PAIR |= {"dynamics.mesh_harmonics": 6, "dynamics.response_harmonics": 120, "runup.count": 0}
_PAIR |= {"operation.speeds": ["7400 rpm", "7700 rpm", "8500 rpm"]}
_OF_PAIR = ["deflection_of_gear_1_gear_2", "force_of_gear_1_gear_2"]
_HELICAL = {"helical.slices": 5, "operation.speeds": ["2500 rpm"], "sun.support_stiffness": "1e7 N/m"}
_SET = {"dynamics.damping_ratio": 0.1, "static.stresses": False, "housing.published": None}


_TWO_STAGES = {
    "model": "gearbox",
    "title": "two pairs in series",
    "motions": "rotation",
    "shaft": [
        {"name": name, "axis": [f"{place} mm", "0 mm"], "part": [{"length": "90 mm", "outer_diameter": f"{size} mm"}]}
        for name, place, size in (("input", 0, 30), ("middle", 90, 40), ("output", 190, 50))
    ],
    "pair": [
        {
            "name": name,
            "shafts": shafts,
            "positions": [place, place],
            "gears": {"teeth": teeth, "module": module, "face_width": "20 mm"},
            "mesh": {"stiffness": stiffness, "contact_ratio": ratio},
        }
        for name, shafts, place, teeth, module, stiffness, ratio in (
            ("first", ["input", "middle"], "30 mm", [24, 36], "3 mm", "4e8 N/m", 1.6),
            ("second", ["middle", "output"], "60 mm", [20, 30], "4 mm", "5e8 N/m", 1.7),
        )
    ],
    "load": [
        {"name": "motor", "shaft": "input", "position": "0 mm"},
        {"name": "brake", "shaft": "output", "position": "90 mm"},
    ],
    "modes": {"damping_ratio": 0.05, "up_to": "1e6 Hz"},
    "operation": {
        "output": ["brake"],
        "load_case": [{"torque": {"motor": "100 N m"}, "speed": {"input": "3000 rpm"}}],
    },
}
_ORDERS = 24
"""Multiples of both mesh frequencies together, at most."""

_MISSING = (
    information("FMU", "FMPy.", "units: not computed", None, float("nan"), note="needs the library fmpy, and cc"),
)


def _installed() -> bool:
    """Whether units can be made and run here."""
    return importlib.util.find_spec("fmpy") is not None and shutil.which("cc") is not None


def _case(name: str, changes: dict) -> tuple[Any, Any, DynamicModel]:
    case = with_values(read_case(CASES / f"{name}.toml"), changes)
    solution = solve(case, "modes")
    make = train_of(case).dynamic_model
    assert make is not None
    return case, solution["modes"], make(case, solution)


def last_period(model: DynamicModel, speed: float, harmonics: int, names: list[str]) -> Any:
    """Run the unit of a model by FMPy at a speed [rad/s] until its start is forgotten; the last mesh period."""
    import fmpy

    hertz = model.mesh_rate * speed
    decay = (model.modal.omega * model.modal.damping_ratio)[model.modal.omega > 0.0].min()
    periods, step = int(_START_FORGOTTEN * hertz / decay) + 5, 1.0 / (hertz * INSTANTS)
    with TemporaryDirectory() as folder:
        path = Path(folder, "train.fmu")
        write_fmu(model, path, harmonics=harmonics)
        options = {"output_interval": step, "step_size": step, "start_values": {"speed": speed}, "output": names}
        return fmpy.simulate_fmu(str(path), stop_time=periods / hertz, **options)[-INSTANTS - 1 : -1]


def _apart(computed: np.ndarray, lines: np.ndarray) -> float:
    """Largest difference from lines (H + 1,) over the largest value of the period."""
    expected = sample(lines, 8 * INSTANTS)[::8]
    return float(np.abs(computed - expected).max() / np.abs(expected).max())


def pairs() -> tuple[Row, ...]:
    """A pair whose flanks stay in contact, and part."""
    if not _installed():
        return _MISSING
    case, modes, model = _case("spur_pair", _PAIR)
    motion, rows = solve(case, "dynamics")["dynamics"].motion, list[Row]()
    names = _OF_PAIR
    for number, speed in enumerate(case.operation.speeds):
        period = last_period(model, speed, 6, names)
        parted = motion.lowest[number] <= 0.0
        lines = [motion.deflection[number, 0]]
        if not parted:
            hertz = [model.mesh_rate * speed]
            options = {"excitation_harmonics": 6, "response_harmonics": RESPONSE, "tolerance": 1e-12}
            response = solve_spectral(modes.modes, modes.excitation, hertz, **options)
            lines = [response.deflection[0, 0], response.force[0, 0]]
        which = f"pair at {speed * 30 / np.pi:.0f} rpm, flanks {'part' if parted else 'in contact'}"
        for word, name, line in zip(("deflection", "force"), names, lines, strict=False):
            text = f"{word} of the mesh by the FMU, largest difference [1]"
            rows.append(at_most(which, BALANCE if parted else SPECTRAL, text, GATE, _apart(period[name], line)))
    return tuple(rows)


def rubbing() -> tuple[Row, ...]:
    """A pair with friction on its flanks, flanks in contact."""
    if not _installed():
        return _MISSING
    acts = {"losses": {"friction": "constant", "coefficient": 0.06, "excites": True}, "dynamics.damping_ratio": 0.05}
    _, modes, model = _case("spur_pair", _PAIR | acts | {"operation.speeds": ["2865 rpm"]})
    options = {"excitation_harmonics": 6, "response_harmonics": RESPONSE, "tolerance": 1e-12}
    response = solve_spectral(modes.modes, modes.excitation, [model.mesh_rate * model.speed], **options)
    period, rows = last_period(model, model.speed, 6, _OF_PAIR), list[Row]()
    for word, name in zip(("deflection", "force"), _OF_PAIR, strict=True):
        text = f"{word} of the mesh by the FMU, largest difference [1]"
        apart = _apart(period[name], getattr(response, word)[0, 0])
        rows.append(at_most("pair with friction, mu 0.06, at 2865 rpm", SPECTRAL, text, GATE, apart))
    return tuple(rows)


def sets() -> tuple[Row, ...]:
    """A helical set in slices, and the set with its elastic ring and the sensor on it."""
    if not _installed():
        return _MISSING
    rows = list[Row]()
    options = {"response_harmonics": RESPONSE, "tolerance": 1e-12}
    _, modes, model = _case("helical_30_20_70", _HELICAL)
    names = [f"{word}_of_planet_2_ring_slice_3" for word in ("deflection", "force")]
    place = [*model.modal.meshes].index("planet 2-ring, slice 3")
    period = last_period(model, model.speed, 6, names)
    hertz = [model.mesh_rate * model.speed]
    response = solve_spectral(modes.modes, modes.excitation, hertz, excitation_harmonics=6, **options)
    for word, name in zip(("deflection", "force"), names, strict=True):
        text = f"{word} of a slice by the FMU, largest difference [1]"
        line = getattr(response, word)[0, place]
        rows.append(at_most("30/20/70, five slices", SPECTRAL, text, GATE, _apart(period[name], line)))
    case, modes, model = _case("planetary_27_40_108", _SET)
    names = ["deflection_of_sun_planet_1", "force_of_planet_1_ring", "transmission_error_of_sun_planet_1", "sensor"]
    period = last_period(model, model.speed, 10, names)
    hertz = [model.mesh_rate * model.speed]
    response = solve_spectral(modes.modes, modes.excitation, hertz, excitation_harmonics=10, **options)
    error, field = mesh_and_ring_outputs(modes, response)
    lines = (response.deflection[0, 0], response.force[0, 3], error[0, 0])
    words = ("deflection of a mesh", "force of a mesh", "dynamic transmission error")
    for name, line, word in zip(names, lines, words, strict=False):
        text = f"{word} by the FMU, largest difference [1]"
        rows.append(at_most("27/40/108", SPECTRAL, text, GATE, _apart(period[name], line)))
    assert model.sensor is not None
    sensor_lines = lines_of_field(case, modes, field, np.array([model.speed * model.sensor.carrier]))
    turning = np.outer(period["time"], sensor_lines.order * sensor_lines.base_speed[0])
    expected = np.real(np.exp(1j * turning) @ sensor_lines.displacement[0])
    apart = float(np.abs(period["sensor"] - expected).max() / np.abs(expected).max())
    text = "displacement at the sensor by the FMU, largest difference [1]"
    rows.append(at_most("27/40/108", "Lines of the fixed sensor.", text, GATE, apart))
    return tuple(rows)


def gearboxes() -> tuple[Row, ...]:
    """A gearbox of two pairs whose stiffness varies at once, with all of its modes."""
    if not _installed():
        return _MISSING
    case = read_case(_TWO_STAGES)
    state, model = solve(case, "deflection")["deflection"].of(case).state, dynamic_model(case)
    options = {"separates": False, "back_flanks": False, "gyroscopic": False, "turning": False}
    box = nonlinear_gearbox(state, all_excitations(state), harmonics=3, **options)
    lines = [line for line in product(range(-_ORDERS, _ORDERS + 1), repeat=2) if line >= (0, 0)]
    orders = np.array([line for line in lines if abs(line[0]) + abs(line[1]) <= _ORDERS])
    orders = orders[np.argsort(orders.any(axis=1), kind="stable")]
    balance = solve_harmonic_balance(box.problem, box.frequency, orders=orders, stability=False, radius=False)
    names, rows = ["deflection_of_first", "deflection_of_second"], list[Row]()
    motion = last_period(model, model.speed, 3, names)
    wave = np.exp(1j * np.outer(orders @ box.frequency, motion["time"]))
    for name, line in zip(names, balance.deflection, strict=True):
        expected = np.real(line @ wave)
        apart = float(np.abs(motion[name] - expected).max() / np.abs(expected).max())
        text = f"{name.replace('_', ' ')} by the FMU, largest difference [1]"
        rows.append(at_most("gearbox of two pairs", BOTH_FREQUENCIES, text, GATE, apart))
    return tuple(rows)


def matrices() -> tuple[Row, ...]:
    """Receptance and poles of the matrices of the set with its elastic ring."""
    _, modes, model = _case("planetary_27_40_108", _SET | {"static.positions": 16, "static.flank_elements": 8})
    space, M, basis = state_space(model.modal), len(model.modal.meshes), modes.modes
    poles = np.linalg.eigvals(space.A)
    upper = np.sort(np.abs(poles[poles.imag > 1.0])) / (2.0 * np.pi)
    elastic = basis.frequency[basis.frequency > 0.0]
    largest = float(np.abs(upper / elastic - 1.0).max())
    text = "natural frequencies by the poles of A, largest difference [1]"
    rows = [at_most("27/40/108", "Modes of the run.", text, 1e-9, largest)]
    hertz = np.array([250.0, 1111.0, 5000.0])
    response = solve_spectral(basis, modes.excitation, hertz, excitation_harmonics=4, tolerance=1e-12)
    displacement = response.deflection - response.force / basis.mesh_stiffness[:, None]
    worst = np.zeros(2)
    for s, h in np.ndindex(len(hertz), 4):
        states = 2j * np.pi * hertz[s] * (h + 1) * np.eye(len(space.A)) - space.A
        moved = np.linalg.solve(states, space.B[:, :M] @ displacement[s, :, h + 1])
        outputs = (space.C @ moved + space.D[:, :M] @ displacement[s, :, h + 1])[: 2 * M]
        for part, lines in enumerate((response.deflection, response.force)):
            apart = np.abs(outputs[part * M : (part + 1) * M] - lines[s, :, h + 1]).max() / np.abs(lines[s]).max()
            worst[part] = max(worst[part], float(apart))
    for word, value in zip(("deflections", "forces"), worst, strict=True):
        text = f"{word} of all meshes by A, B, C, D, four harmonics, largest difference [1]"
        rows.append(at_most("27/40/108", "Spectral solver.", text, 1e-9, float(value)))
    return tuple(rows)
