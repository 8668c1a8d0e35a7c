"""Drivetrains: reductions of the chain, balances, printed numbers."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from typing import Any

import numpy as np
from published.wind_turbine_drivetrain import (
    PRINTED,
    RADII_TEETH,
    line_teeth,
    ratio_of_radii,
    wind_turbine_drivetrain,
)
from two_wheels import RADII, STIFFNESS, TEETH, two_wheels

from femgear.solvers.periodic.harmonic_balance import displacements, solve_harmonic_balance
from femgear.solvers.periodic.solution import PeriodicSolution
from femgear.solvers.time.flank_motion import MarchedRun, Records, march_flanks
from femgear.solvers.time.free_turn import TorqueHistory
from femgear.solvers.time.transient import solve_transient
from femgear.system.fourier import harmonics_of
from femgear.trains.gearbox.balance import held_together, lines_together, loaded_lines
from femgear.trains.gearbox.case_file import GearboxCase
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.excitation import pair_count_excitation
from femgear.trains.gearbox.geometry import set_sizes
from femgear.trains.gearbox.model import gearbox_model
from femgear.trains.gearbox.modes import solve_gearbox_modes
from femgear.trains.gearbox.spectrum import solve_box_spectrum
from femgear.trains.gearbox.transient import (
    ALL_MOTIONS,
    TORSIONAL,
    GearboxInTime,
    GearboxMotion,
    gearbox_in_time,
    integrate,
    torsional_state,
)
from femgear.trains.gearbox.transient_checks import run_outline
from femgear.trains.gearbox.transient_results import TransientResult
from femgear.trains.reading import read_case, with_values
from validation.reference.drivetrain_train import numbers
from validation.rows import Row, at_most, counted, information, printed, within

PAPER = "Dynamic analysis of the wind turbine drivetrain considering shaft bending effect"
FORMER = "train of drivetrains of femgear 6c03cc6f"


def kinematics() -> tuple[Row, ...]:
    """Ratio and mesh lines of the paper."""
    rows = [printed("speeds", PAPER, "speed ratio from the radii", "34.654", ratio_of_radii())]
    teeth = line_teeth()
    note = "no check: tooth numbers are not printed, and these whole numbers were fitted to the lines"
    for name, value, ours in zip(("planetary", "gear 1-2", "gear 2-3"), PRINTED.lines, teeth.lines()):
        rows.append(information("speeds", PAPER, f"mesh line {name} [Hz]", value, ours, note=note))
    for name, value, ours in zip(("planetary", "gear 1-2", "gear 2-3"), PRINTED.lines, RADII_TEETH.lines()):
        text = f"mesh line {name}, module 5 mm, which divides every radius [Hz]"
        rows.append(information("speeds", PAPER, text, value, ours))
    return tuple(rows)


def shifted_planets() -> tuple[Row, ...]:
    """A planet that profile shifts give two teeth fewer than (z_r - z_s)/2, by Willis and ISO 21771."""
    mesh = {"stiffness": "1e10 N/m", "contact_ratio": 1.2}
    tables = wind_turbine_drivetrain()
    tables["planetary"] = [
        {
            "carrier": "carrier",
            "sun": "sun",
            "ring_teeth": 56,
            "sun_teeth": 19,
            "planet_teeth": 17,
            "module": "45 mm",
            "planet_mass": "1611 kg",
            "planet_inertia": "174.9 kg m^2",
            "sun_mesh": mesh,
            "ring_mesh": mesh,
        }
    ]
    case = read_case(tables)
    flow = gearbox_model(case).flow
    carrier, sun, planet = flow.speed["carrier"], flow.speed["sun"], flow.planet_speed["carrier-sun"]
    base, ours = 17 * 22.5 * math.cos(math.radians(20.0)), 1e3 * set_sizes(case.planetary[0]).base_radii[1]
    name = "shifted planets"
    relative = (planet - carrier) / (sun - carrier)
    return (
        within(name, "Willis", "19/17/56: sun over carrier", 75.0 / 19.0, sun / carrier, 1e-9),
        within(name, "Willis", "planet over sun in the carrier's frame", -19.0 / 17.0, relative, 1e-9),
        within(name, "ISO 21771", "base radius of the planet [mm]", base, ours, 1e-9),
    )


def shaft_joints() -> tuple[Row, ...]:
    """Printed stiffnesses of shafts beside the joint of two rigid links that stores the energy of a beam."""
    rows = []
    springs = (PRINTED.low_speed, PRINTED.intermediate, PRINTED.high_speed)
    for name, (bending, torsion) in zip(("low-speed", "intermediate", "high-speed"), springs):
        for words, halves in (("both halves of the joint", 2), ("one joint", 1)):
            text = f"{name} shaft, bending over torsion; slender round steel shaft, energy of {words}"
            slender = 0.75 * halves * 1.3
            rows.append(information("shaft", PAPER, text, bending / torsion, slender, note="docs/drivetrain.md"))
    return tuple(rows)


def base_line() -> tuple[Row, ...]:
    """Lowest elastic mode beside the base lines of the paper's Fig. 5."""
    case, rows = read_case(wind_turbine_drivetrain()), []
    held = case.model_copy(update={"motions": "rotation"})
    for words, value, variant in (("shafts that bend", 2.5, case), ("torsional", 2.0, held)):
        ours = solve_gearbox_modes(solve_deflection(variant)).modes.frequency[1]
        rows.append(information("modes", f"{PAPER}, Fig. 5", f"base line, {words} [Hz]", value, ours))
    lower = rows[0].ours / rows[1].ours
    text = "lowest mode with shafts that bend over that with held axes: above one"
    source = "Rayleigh: constraints raise natural frequencies"
    rows.append(at_most("modes", source, text, 0.0, max(lower - 1.0, 0.0)))
    return tuple(rows)


def stiffness() -> tuple[Row, ...]:
    """Rectangular mesh stiffness, contact ratio 1.635, 1 or 0.65."""
    tables: dict[str, Any] = wind_turbine_drivetrain()
    tables["parallel"][0]["mesh"] = {"stiffness": "872250 N/m", "contact_ratio": 1.635, "low_share": 0.65}
    model = gearbox_model(read_case(tables))
    lines = 1e-6 * harmonics_of(pair_count_excitation(model, model.stages[0]).stiffness[0], 15)
    wanted = [0.87225] + [0.7 / (math.pi * h) * math.sin(math.pi * h * 0.635) for h in range(1, 16)]
    error = np.abs(lines - wanted).max()
    return (at_most("mesh stiffness", "closed form", "rectangular wave, error of 15 harmonics", 1e-9, error),)


def former_modes() -> tuple[Row, ...]:
    """Natural frequencies of the shipped cases beside those of the train that had them before."""
    rows, former = list[Row](), numbers()
    wind = read_case("cases/wind_turbine_drivetrain.toml")
    entries = [(name, read_case(f"cases/{name}.toml"), entry["frequency"]) for name, entry in former["cases"].items()]
    entries.append(("held axes", wind.model_copy(update={"motions": "rotation"}), former["torsional"]))
    for name, case, wanted in entries:
        frequencies, expected = solve_gearbox_modes(solve_deflection(case)).modes.frequency, np.array(wanted)
        rows.append(counted(name, FORMER, "modes", len(expected), len(frequencies)))
        error = np.abs(frequencies - expected).max() / expected.max()
        rows.append(at_most(name, FORMER, "natural frequencies, largest difference over the highest", 1e-9, error))
    return tuple(rows)


def former_histories() -> tuple[Row, ...]:
    """Histories in time beside those of the former train, from the first step on."""
    rows = list[Row]()
    for name, wanted in numbers()["histories"].items():
        case, time = changed(wanted), np.array(wanted["time"])
        rate = case.transient.rate
        transient = case.transient.model_copy(update={"duration": time[-1]})
        case = case.model_copy(update={"transient": transient})
        every = round(time[1] * rate)
        former = gearbox_in_time(solve_deflection(case), transient, mean_damping=False)
        motion = integrate(former, every=every, lowpass=False)
        columns = [motion.shafts.index(body) for body in wanted["bodies"]]
        moved = np.array(wanted["motion"])
        apart = np.abs(motion.run.motion[:, columns] - moved).max() / np.abs(moved).max()
        rows.append(at_most(name, FORMER, "rotations over time, largest difference over the largest", 1e-9, apart))
    return tuple(rows)


def changed(wanted: dict[str, Any]) -> Any:
    """Case of a stored history: a shipped one, of the wind turbine with sizes in the ratios of its teeth."""
    parts = {"transient.contact_loss": wanted["parts"]}
    if not wanted["changes"]:
        return with_values(read_case(f"cases/{wanted['case']}.toml"), parts)
    tables: dict[str, Any] = wind_turbine_drivetrain()
    tables["planetary"][0]["planet_teeth"] = wanted["changes"]["planetary[0].planet_teeth"]
    for number in range(2):
        tables["parallel"][number]["radii"] = wanted["changes"][f"parallel[{number}].radii"]
    return with_values(read_case(tables), parts)


def former_spectra() -> tuple[Row, ...]:
    """Named lines of the mesh forces over the whole run beside those of the former train."""
    rows = list[Row]()
    for name, entry in numbers()["cases"].items():
        if (wanted := entry.get("spectrum")) is None:
            continue
        case = read_case(f"cases/{name}.toml")
        spectrum = solve_box_spectrum(case, former_motions(case))
        meshes = [mesh.replace("carrier-sun ", "") for mesh in spectrum.transient.first.run.meshes]
        columns = [meshes.index(mesh.replace(" of carrier", "")) for mesh in wanted["meshes"]]
        orders = np.array([line.order for line in spectrum.lines])
        lines = [int(np.abs(orders - order).argmin()) for order in wanted["order"]]
        amplitude = np.nan_to_num(next(iter(spectrum.amplitudes.values()))[lines][:, columns])
        error = np.abs(amplitude - wanted["amplitude"]).max() / np.max(wanted["amplitude"])
        rows.append(at_most(name, FORMER, "amplitudes of lines, largest difference over the largest", 1e-8, error))
    return tuple(rows)


def former_motions(case: GearboxCase) -> TransientResult:
    """Motions of a case damped as the former train was: by modes with the planets where they stand at the start."""
    state, motions = solve_deflection(case), {}
    for variant in (ALL_MOTIONS, TORSIONAL) if case.transient.torsional else (ALL_MOTIONS,):
        chosen_state = state if variant == ALL_MOTIONS else torsional_state(state)
        former = gearbox_in_time(chosen_state, case.transient, mean_damping=False)
        motions[variant] = integrate(former, every=run_outline(case).every)
    return TransientResult(motions, 0.0)


def general_integrator() -> tuple[Row, ...]:
    """The wind turbine with flanks that part, at constant speed, by the integrator of any nonlinear system."""
    case = read_case(wind_turbine_drivetrain())
    duration, rate = 0.05, 1e4
    entries = {"duration": duration, "rate": rate, "contact_loss": True, "start": "zero"}
    transient = case.transient.model_copy(update=entries | {"torque": ()})
    case = case.model_copy(update={"transient": transient})
    model = gearbox_in_time(solve_deflection(case), transient)
    motion = integrate(model, lowpass=False)
    times, problem = motion.run.time, model.box.problem
    options = {"method": "average acceleration", "step": 1.0 / rate, "tolerance": 1e-12}
    other = solve_transient(problem, model.box.frequency, times, **options)
    rotations = np.array([model.rotation(shaft) for shaft in motion.shafts])
    spin = rotations @ model.spun.spin
    wanted = other.displacement @ rotations.T
    # deviations have no part of the common rotation
    turned = other.displacement @ model.spun.carried / model.spun.inertia
    wanted -= turned[:, None] * spin
    apart = np.abs(motion.run.motion - wanted).max() / np.abs(wanted).max()
    assert motion.run.lost.max() > 0.01
    text = "rotations over 0.05 s with flanks that part, largest difference over the largest"
    return (at_most("integration", "femgear.solvers.time.transient", text, 1e-4, apart),)


def balances() -> tuple[Row, ...]:
    """Energy and momentum over one second; the minute is in `minute`."""
    return _balances(1.0)


def minute() -> tuple[Row, ...]:
    """Energy and momentum over 60 s of 20 000 steps a second."""
    return _balances(60.0)


def paper_motion(duration: float, **entries: Any) -> GearboxMotion:
    """Motion of the chain of the paper over a duration [s], thinned out."""
    return integrate(paper_in_time(duration, **entries), every=200, lowpass=False)


def paper_in_time(duration: float, **entries: Any) -> GearboxInTime:
    """Make the chain of the paper ready for a duration [s]."""
    case = read_case(wind_turbine_drivetrain())
    transient = case.transient.model_copy(update={"duration": duration} | entries)
    case = case.model_copy(update={"transient": transient})
    return gearbox_in_time(solve_deflection(case), transient)


def _balances(duration: float) -> tuple[Row, ...]:
    run = paper_motion(duration).run
    text = f"36 dof, {duration:g} s in steps of 50 µs:"
    return (
        at_most("balances", "theory", f"{text} energy", 1e-6, run.energy_balance.error),
        at_most("balances", "theory", f"{text} angular momentum", 1e-6, run.momentum),
        at_most("balances", "theory", f"{text} rotation in the deviations [rad]", 1e-9, run.drift),
    )


def torques() -> tuple[Row, ...]:
    """Torque that holds the speed: that of the printed radii, by which torques balance."""
    ours = -paper_in_time(1.0).torques[-1].values[0] / PRINTED.generator_share
    wanted = PRINTED.torque / ((1 + 43 / 11) * (29 / 9.5) * (18.5 / 8))
    return (within("torques", "kinematics", "generator torque that holds the speed [N m]", wanted, ours, 1e-9),)


def growth() -> tuple[Row, ...]:
    """Free motion in the middle of the principal instability: Mathieu's equation."""
    from scipy.integrate import solve_ivp

    wheels = two_wheels(harmonics=1)
    natural, share = wheels.natural, abs(wheels.wave[1]) / STIFFNESS

    def rate(t, y):
        return [y[2], y[3], *(-(1.0 + share * math.cos(2.0 * t)) * y[:2])]

    path = solve_ivp(rate, (0.0, math.pi), [1.0, 0.0, 0.0, 1.0], method="DOP853", rtol=1e-11, atol=1e-12)
    largest = np.abs(np.linalg.eigvals(path.y[:, -1].reshape(2, 2))).max()
    wanted = math.log(largest) / math.pi * natural
    period = math.pi / natural
    options = {"duration": 150 * period, "step": period / 200, "speed": 2.0 * natural / TEETH, "start": "zero"}
    run = march_flanks(wheels.spun, **options)
    text = "free motion of one mesh at twice its natural frequency, 200 steps a period: growth [1/s]"
    return (within("growth", "Mathieu's equation by DOP853", text, wanted, run.growth, 1e-3),)


def contact_loss() -> tuple[Row, ...]:
    """Free flight and impact of one mesh: a parabola and a sine, three times."""
    wheels = two_wheels()
    w = wheels.natural
    mass, load, speed = STIFFNESS / w**2, 5000.0, 0.1
    rest = load / STIFFNESS
    flight = 2.0 * speed * mass / load
    period = flight + (2.0 * math.pi - 2.0 * math.atan(speed / (w * rest))) / w
    column = wheels.spun.system.W[:, 0]
    start = np.zeros(2), -speed * mass * np.linalg.solve(wheels.spun.system.M, column)
    torques = [(TorqueHistory(name, [0.0], [load * r]), row) for name, r, row in zip("ab", RADII, np.eye(2))]
    options = {"duration": 3.0 * period, "step": period / 800, "speed": 10.0}
    run = march_flanks(wheels.spun, torques, start=start, contact_loss=True, records=Records(), **options)
    t = run.time % period
    touch = rest * (1.0 - np.cos(w * (t - flight))) + speed / w * np.sin(w * (t - flight))
    wanted = np.where(t < flight, -speed * t + 0.5 * load / mass * t**2, touch)
    error = np.abs(run.approach[:, 0] - wanted).max() / np.ptp(wanted)
    text = "flight and impact, 800 steps a period, three periods:"
    return (
        at_most("contact loss", "closed form", f"{text} approach over its range", 1e-4, error),
        at_most("contact loss", "theory", f"{text} energy balance", 1e-9, run.energy_balance.error),
    )


LOOSE = ("carrier 1", "carrier 2 upwind", "carrier 2 downwind", "wheel upwind", "wheel downwind")
"""Bearings of the five-megawatt chain that have play."""
CHAIN_TIME = "harmonic balance, integration in time from its state"


def chain_in_its_play() -> tuple[Row, ...]:
    """Five-megawatt chain under torque and weight, with play: both carriers turn, meshes have constant stiffness."""
    duration, rate = 5.0, 1e3
    model = loose_chain(duration, rate)
    carriers = {"first stage carrier", "second stage carrier"}
    solution = chain_balance(model, {name: 4 for name in carriers}, {})
    run, apart = chain_apart(model, solution)
    # once around: how unequally the planets of a stage are loaded
    names = np.array(run.meshes)
    first = run.force[:, [name.startswith("first stage") for name in names]]
    rows = [at_most("five-megawatt chain", CHAIN_TIME, _largest("mesh forces over a turn"), 1e-4, apart["meshes"])]
    rows.append(at_most("five-megawatt chain", CHAIN_TIME, _largest("bearing forces over a turn"), 1e-4, apart["play"]))
    uneven = first.max() / first.mean()
    tight = loose_chain(duration, rate, play="0 um")
    held = chain_apart(tight, chain_balance(tight, {name: 4 for name in carriers}, {}))[0]
    without = held.force[:, : len(names)][:, [name.startswith("first stage") for name in names]]
    text = "largest force of a planet of the first stage over its mean, play of 0.1 mm; reference: without play"
    rows.append(information("five-megawatt chain", CHAIN_TIME, text, without.max() / without.mean(), uneven))
    return tuple(rows)


def chain_side_bands() -> tuple[Row, ...]:
    """The same with tooth pairs of the second stage that come and go: side bands of both carriers."""
    model = loose_chain(0.02, 6.4e4, contact_ratio=1.6, harmonics=1)
    carriers = {"first stage carrier": 2, "second stage carrier": 2}
    solution = chain_balance(model, carriers, {"second stage mesh": 13})
    apart = chain_apart(model, solution)[1]
    text = _largest("mesh forces over 1.5 mesh periods, second stage excites")
    return (at_most("five-megawatt chain", CHAIN_TIME, text, 1e-4, apart["meshes"]),)


def _largest(what: str) -> str:
    return f"{what}, largest difference over the largest"


def loose_chain(
    duration: float, rate: float, *, play: str = "100 um", contact_ratio: float | None = None, harmonics: int = 1
) -> GearboxInTime:
    """Make the five-megawatt chain with play in its bearings ready for time, its flanks parting, its casing held."""
    tables = chain_tables(play, ())
    del tables["casing"], tables["sensor"]
    if contact_ratio:
        for mesh in ("sun_mesh", "ring_mesh"):
            tables["planetary"][1][mesh]["contact_ratio"] = contact_ratio
    return chain_in_time(tables, duration, rate, harmonics)


def chain_tables(play: str, exciting: Sequence[str]) -> dict[str, Any]:
    """Tables of the five-megawatt chain with play in its bearings, of which some stages alone excite."""
    with open("cases/five_megawatt_chain.toml", "rb") as file:
        tables = tomllib.load(file)
    for bearing in tables["bearing"]:
        if bearing["name"] in LOOSE:
            bearing["clearance"] = play
    for stage in (*tables["pair"], *tables["planetary"]):
        for mesh in ("mesh", "sun_mesh", "ring_mesh"):
            if mesh in stage and stage["name"] not in exciting:
                del stage[mesh]["contact_ratio"]
    return tables


def chain_in_time(tables: dict[str, Any], duration: float, rate: float, harmonics: int = 1) -> GearboxInTime:
    """Make a chain ready for time, its flanks parting."""
    entries = {"harmonics": harmonics, "contact_loss": True, "duration": f"{duration} s", "rate": f"{rate} Hz"}
    case = read_case(tables | {"transient": entries})
    return gearbox_in_time(solve_deflection(case), case.transient)


def chain_balance(model: GearboxInTime, carriers: dict[str, int], meshes: dict[str, int]) -> PeriodicSolution:
    """Solve for the motion of all stages at once, with lines up to orders of some base frequencies by name."""
    box, highest = model.box, carriers | meshes
    excites = [running_stage.mesh_base for running_stage in box.stages].index(
        box.bases.index(next(iter(meshes or ["second stage mesh"])))
    )
    orders = lines_together(box, excites, max(meshes.values(), default=0), max(carriers.values()))
    samples = tuple(
        max(4 * highest[name], 16) if name in carriers else max(4 * highest[name], 32) if name in meshes else 1
        for name in box.bases
    )
    options: dict[str, Any] = {"orders": orders, "samples": samples, "stability": False, "radius": False}
    held = solve_harmonic_balance(held_together(box), box.frequency, start=loaded_lines(box, len(orders)), **options)
    solution = solve_harmonic_balance(box.problem, box.frequency, start=held, **options)
    assert solution.converged
    return solution


def chain_apart(model: GearboxInTime, solution: PeriodicSolution) -> tuple[MarchedRun, dict[str, float]]:
    """Integrate from the state of a balance on: the run, largest differences of forces over the largest."""
    box = model.box
    run = marched_from(model, solution, model.spun.basic.T)
    x, theta = solution.at(run.time), run.time[:, None] * box.frequency
    meshes = np.hstack(
        [_drive_forces(front, x, theta) for front, _ in box.flanks],
    )
    apart = {"meshes": float((np.abs(meshes - run.force).max(axis=0) / meshes.max(axis=0)).max()), "play": 0.0}
    pressed = []
    for ring in box.bearings.values():
        columns = ring.columns
        forces = [ring.evaluate(motion[:, columns], None)[0][:, 0] for motion in (x, run.motion)]
        pressed.append((np.abs(forces[0] - forces[1]).max(), np.abs(forces[0]).max()))
    if pressed:
        apart["play"] = float(max(force for force, _ in pressed) / max(size for _, size in pressed))
    return run, apart


def marched_from(model: GearboxInTime, solution: PeriodicSolution, outputs: np.ndarray) -> MarchedRun:
    """Integrate from the state of a balance on, with motions (k, n) per unit of the coordinates as outputs."""
    box, spun = model.box, model.spun
    transient = box.deflection.model.case.transient
    assert transient is not None
    lines, omega = displacements(box.problem, solution), solution.line_frequency
    place, velocity = lines.sum(axis=1).real, (1j * omega * lines).sum(axis=1).real
    place = place - spun.spin * (spun.carried @ place) / spun.inertia
    return march_flanks(
        spun,
        [(torque, model.rotation(torque.body)) for torque in model.torques],
        duration=transient.duration,
        step=1.0 / transient.rate,
        speed=model.speed,
        start=(place, velocity),
        outputs=outputs,
        contact_loss=True,
    )


def _drive_forces(element: Any, x: np.ndarray, theta: np.ndarray) -> np.ndarray:
    if hasattr(element, "flank_forces"):
        return np.maximum(element.flank_forces(x[:, element.columns], theta)[1], 0.0)
    return element.forces(x[:, element.columns], theta)
