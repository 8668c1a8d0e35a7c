"""Gearboxes whose teeth part: pair and planar set by their own trains, the response, and time integration."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from casings import casing_tables
from gearbox_equivalents import pair_of_rigid_gears_tables, set_tables
from scipy.integrate import solve_ivp
from small_gearbox import loose_pair_tables, planetary_tables

from femgear.case.gear_set import planetary_set
from femgear.housing.two_way.running_planets import solve_running
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.periodic.harmonic_balance import displacements, solve_harmonic_balance
from femgear.solvers.periodic.solution import PeriodicSolution
from femgear.solvers.time.transient import solve_transient
from femgear.stages.lumped_set import Bearings, Gravity, MemberBearing, gear_set_problem
from femgear.stages.static import solve_static
from femgear.system.assembly import Assembly
from femgear.system.fourier import side_bands
from femgear.system.mesh_directions import mesh_elements
from femgear.system.rigid_bodies import PlanarBody, PlanarSet, PlanarTorque
from femgear.system.system import MechanicalSystem, MeshExcitation, NonlinearSystem
from femgear.trains.gearbox.balance import forces_of_bearings, loaded_lines
from femgear.trains.gearbox.deflection import Deflection, solve_deflection
from femgear.trains.gearbox.excitation import excitation_of
from femgear.trains.gearbox.nonlinear import NonlinearGearbox, nonlinear_gearbox
from femgear.trains.gearbox.stage_structure import running_stage
from femgear.trains.gearbox.turning_planets import TurningPlanets, centrifugal_pull, planets_of_stage, wave_generator
from femgear.trains.pair.model import pair_excitation, pair_model, separating_pair
from femgear.trains.reading import read_case, with_values
from validation.gearbox_in_time import ANGLE, helical_stage
from validation.gearbox_response import synthetic_excitation, without_loss
from validation.rows import Row, at_most

PAIR = "train of a pair, femgear.trains.pair.model"
PLANAR = "planar set, femgear.stages.lumped_set"
RESPONSE = "response, femgear.housing.two_way.running_planets"
IN_TIME = "DOP853, all bodies in axes at rest"
TEETH = (19, 20, 59)
"""Of sun, planets and ring; three planets in phase."""
RATIO = 0.04
"""Damping of the planar set."""


def pairs() -> tuple[Row, ...]:
    """Two gears whose teeth part, and on held axes meet behind, by harmonic balance."""
    rows = list[Row]()
    springs = {"gear_1.bearing_stiffness": "1e8 N/m", "gear_2.bearing_stiffness": "3e8 N/m"}
    for name, changes, play, share in (
        ("pair on bearings, teeth part", springs, np.inf, 0.5),
        ("pair on held axes, both flanks", {}, 2e-6, 0.95),
    ):
        case = with_values(read_case("cases/spur_pair.toml"), changes)
        drive = replace(pair_excitation(case, solve_static(case), None), backlash=np.array([play]))
        mean, ratio = drive.stiffness.mean(axis=1), case.dynamics.damping_ratio
        model = pair_model(case, planetary_set(case))
        modes = undamped_modes(model.system, mean, damping_ratio=ratio)
        state = solve_deflection(read_case(pair_of_rigid_gears_tables(case, float(mean[0]))))
        box = nonlinear_gearbox(state, {"pair": drive}, harmonics=8, damping_ratio=ratio)
        omega, options = 2.0 * np.pi * share * modes.frequency.max(), {"harmonics": 24, "stability": False}
        wanted = solve_harmonic_balance(separating_pair(model, modes, drive, 8), omega, **options).force[0]
        lines = solve_harmonic_balance(box.problem, omega, **options).force
        deflection = lines[0] - (lines[1] if len(lines) > 1 else 0.0)
        apart = np.abs(deflection - wanted).max() / np.abs(wanted).max()
        rows.append(at_most(name, PAIR, "lines of the mesh force, largest difference over the largest", 1e-9, apart))
    return tuple(rows)


def rigid_set(*, held: float = 0.0) -> PlanarSet:
    """Planar set on isotropic supports, its carrier held against rotation [N/m at its radius]."""
    alpha, module = np.radians(20.0), 4e-3
    sun, planet, ring = (0.5 * module * z * np.cos(alpha) for z in TEETH)
    distance = 0.5 * module * (TEETH[0] + TEETH[1])
    return PlanarSet(
        sun=PlanarBody(2.0, 1.5 * sun**2, support=1e7),
        ring=PlanarBody(9.0, 9.0 * ring**2, support=3e8, torsional_support=4e8 * ring**2),
        carrier=PlanarBody(12.0, 8.0 * distance**2, support=2e8, torsional_support=held),
        planet=PlanarBody(1.7, 1.1 * planet**2),
        sun_radius=sun,
        planet_radius=planet,
        ring_radius=ring,
        centre_distance=distance,
        planet_angles=2.0 * np.pi * np.arange(3) / 3,
        pressure_angle_sun_planet=alpha,
        pressure_angle_planet_ring=alpha,
        stiffness_sun_planet=4e8,
        stiffness_planet_ring=6e8,
        planet_bearing=2e8,
    )


def wave_of_stiffness(data: PlanarSet, backlash: float) -> MeshExcitation:
    """Excitation of all meshes by stiffness and deflection, without forces."""
    positions = 2.0 * np.pi * np.arange(64) / 64
    at = positions + np.tile(TEETH[2] * np.asarray(data.planet_angles), 2)[:, None]
    kind = np.repeat([0.0, 1.0], 3)[:, None]
    mean = data.column_stiffness[:, None]
    stiffness = mean * (1.0 + (0.2 - 0.05 * kind) * np.cos(at) + 0.05 * np.sin(2.0 * at))
    deflection = 2e-6 * (1.0 + kind) * np.cos(at + 0.4)
    return MeshExcitation(stiffness, deflection, 0.0 * stiffness, np.full(6, backlash))


def flank_forces(problem: NonlinearSystem, solution: PeriodicSolution, times: np.ndarray) -> np.ndarray:
    """Forces (instants, flanks) of drive flanks, then of back flanks, of the first elements of a system [N]."""
    theta, x = times[:, None] * solution.frequency, solution.at(times)
    differences = list[np.ndarray]()
    for element in problem.elements[:2]:
        force = element.evaluate(x[:, element.columns], theta)[0]
        if hasattr(element, "forces"):
            force = element.forces(x[:, element.columns], theta)[..., None]
        differences.append(force[..., 0])
    return np.hstack(differences)


def without_pull(state: Deflection, box: NonlinearGearbox) -> MechanicalSystem:
    """System without the pull of the pins on turning planets."""
    assembly = planets_of(state)
    pull = centrifugal_pull(assembly, turning(state), assembly.mass)
    system = box.problem.system
    return replace(system, K=system.K - box.motion.T @ pull @ box.motion)


def turning(state: Deflection) -> TurningPlanets:
    """Planets of the first stage, which go round."""
    planets = planets_of_stage(state.model, state.model.stages[0])
    assert planets is not None
    return planets


def planets_of(state: Deflection) -> Assembly:
    """Assembly with the inertias of the planets alone."""
    model = state.model
    of_planets = tuple(inertia for inertia in model.assembly.inertias if inertia.stations[0] in model.stages[0].planets)
    return replace(model.assembly, inertias=of_planets)


def planar_sets() -> tuple[Row, ...]:
    """A rigid set in its plane under torque and weight: teeth part and wedge, and planets that turn."""
    rows = list[Row]()
    mesh, torque, weight = 2.0 * np.pi * 1300.0, 100.0, 30.0
    for name, turn in (("carrier at rest, teeth part and wedge", 0.0), ("turning planets, weight", 20.0)):
        data, parts = rigid_set(held=1e6 if turn else 0.0), turn == 0.0
        drive = wave_of_stiffness(data, 6e-6 if parts else np.inf)
        tables = set_tables(data, TEETH) | {"gravity": {"acceleration": f"{weight} m/s^2"}}
        speed = {"set carrier": f"{turn!r} rad/s"} | ({"set sun": "9 rad/s"} if parts else {"set ring": "0 rpm"})
        tables["operation"]["load_case"] = [{"torque": {"set sun": f"{torque} N m"}, "speed": speed}]
        state = solve_deflection(read_case(tables))
        ratio = RATIO if parts else 0.0
        box = nonlinear_gearbox(state, {"set": drive}, harmonics=4, damping_ratio=ratio, separates=parts)
        flank_options = {"separates": parts, "backlash": drive.backlash, "harmonics": 4, "orders": (0, 1)}
        wanted = gear_set_problem(
            data,
            meshes=mesh_elements(data, stiffness=drive, **flank_options),
            back_flanks=parts,
            torque=PlanarTorque(torque, "sun", "carrier"),
            gravity=Gravity(weight, -0.5 * np.pi, None if parts else (1, 0)),
            carrier_speed=turn,
            damping=ratio or None,
        )
        bands = 0 if parts else 6
        orders, options = side_bands(bands, 10, bands), {"stability": False, "radius": False, "tolerance": 1e-12}
        samples = (1, 2048) if parts else None
        reference = solve_harmonic_balance(wanted, [turn or 1.0, mesh], orders=orders, samples=samples, **options)
        problem = replace(box.problem, system=without_pull(state, box) if turn else box.problem.system)
        orders, samples = (orders[:, 1:], 2048) if parts else (orders, None)
        frequency = [mesh] if parts else [turn, mesh]
        solution = solve_harmonic_balance(problem, frequency, orders=orders, samples=samples, **options)
        times = np.linspace(0.0, 2.0 * np.pi / (turn or 0.2 * mesh), 701)
        forces = flank_forces(wanted, reference, times), flank_forces(problem, solution, times)
        apart = np.abs(forces[0] - forces[1]).max() / np.abs(forces[0]).max()
        text = "forces of all flanks over time, largest difference over the largest"
        rows.append(at_most(f"planar set, {name}", PLANAR, text, 1e-9, apart))
    return tuple(rows)


def apart_from_response(state: Deflection) -> float:
    """Largest difference of the lines of all motions but those of planets from the response, over the largest."""
    stage = state.model.stages[0]
    drive = synthetic_excitation(state, stage)
    structured = running_stage(state, stage, drive)
    options = {"harmonics": 2, "damping_ratio": 0.0, "separates": False, "gyroscopic": False}
    box = nonlinear_gearbox(state, {stage.name: drive}, **options)
    # the response is about the mean state
    mean = box.stages[0].excitation.force.mean(axis=1) @ box.stages[0].drive.fixed
    problem = replace(box.problem, system=replace(without_pull(state, box), load=mean))
    turn, mesh = box.frequency
    orders = side_bands(6, 3, 6)
    solution = solve_harmonic_balance(problem, box.frequency, orders=orders, stability=False, radius=False)
    lines = displacements(problem, solution, box.motion)
    response = solve_running(
        without_loss(structured.running), mesh, turn, harmonics=(2, 3), side_bands=6, tolerance=1e-13
    )
    wanted = response.lines(structured.motion.T)
    inside = np.flatnonzero((np.abs(orders[:, 0]) <= 4) & orders.any(axis=1))
    places = [wanted[orders[l, 1], np.flatnonzero(response.band == orders[l, 0])[0]] for l in inside]
    kept = np.setdiff1d(np.arange(len(lines)), [6 * planet + way for planet in stage.planets for way in range(6)])
    wanted = np.array(places).T[kept]
    return float(np.abs(lines[kept][:, inside] - wanted).max() / np.abs(wanted).max())


def linear_meshes() -> tuple[Row, ...]:
    """Balance with meshes that never part, and the response of the gearbox to the same stage."""
    text = "lines of sun, carrier and casing, largest difference over the largest"
    rows = list[Row]()
    for name, back in (("helical stage in a casing", False), ("helical stage in a casing, backwards", True)):
        rows.append(at_most(name, RESPONSE, text, 1e-8, apart_from_response(helical_stage(ANGLE, back=back))))
    return tuple(rows)


def heavy_set(angle: float, speed: float, *, back: bool = False) -> Deflection:
    """Plane set in a casing on uneven feet under a weight that wedges its teeth, at an angle of its carrier [rad]."""
    tables: dict[str, Any] = planetary_tables() | {"deflection": {"slices": 1}, "casing": casing_tables()}
    tables |= {"motions": "plane", "gravity": {"acceleration": "1000 m/s^2"}}
    tables["planetary"][0] |= {"angle": f"{angle!r} rad"}
    tables["planetary"][0]["planet"] |= {"bearing": {"radial": "2e8 N/m"}}
    torque = "-100 N m" if back else "100 N m"
    tables["operation"]["load_case"] = [{"torque": {"sun": torque}, "speed": {"sun": f"{speed!r} rad/s"}}]
    for bearing in tables["bearing"]:
        bearing["torsional"] = "2e5 N m/rad"
    return solve_deflection(read_case(tables))


def _approaches(angle: float, speed: float, *, back: bool = False) -> np.ndarray:
    """Rows of meshes, then of finite springs of the pins, with the carrier turned."""
    assembly = heavy_set(ANGLE + angle, speed, back=back).model.assembly
    rows = [assembly.columns.T]
    for springs in assembly.springs:
        if springs.name.startswith("pins"):
            whole = np.zeros((len(springs.rows), assembly.count))
            for number, station in enumerate(springs.stations):
                whole[:, 6 * station : 6 * station + 6] += springs.rows[:, 6 * number : 6 * number + 6]
            rows.append(whole[np.isfinite(springs.stiffness)])
    return np.vstack(rows)


def turned_approaches(speed: float, *, back: bool = False):
    """Approaches as a function of the turn of the carrier, from three angles."""
    a, b, c = (_approaches(angle, speed, back=back) for angle in (0.0, 0.5 * np.pi, np.pi))
    mean = 0.5 * (a + c)
    return lambda turn: mean + np.cos(turn) * 0.5 * (a - c) + np.sin(turn) * (b - mean)


def apart_at_rest(speed: float, turns: float = 0.04) -> tuple[float, float, float]:
    """Difference from the motion in axes at rest over the motion, and shares of time: drive apart, back in touch."""
    deflected = heavy_set(ANGLE, speed)
    stage, assembly = deflected.model.stages[0], deflected.model.assembly
    drive = synthetic_excitation(deflected, stage)
    changes = {"force": 0.0 * drive.force, "deflection": 3.0 * drive.deflection, "backlash": np.full(6, 4e-6)}
    drive = replace(drive, **changes)
    box = nonlinear_gearbox(deflected, {stage.name: drive}, harmonics=2, damping_ratio=0.0)
    T, turn = box.motion, deflected.model.flow.speed["carrier"]
    system = without_pull(deflected, box)
    at = [assembly.motion_names.index(name) for name in system.dofs]
    planets = np.array(["planet" in name for name in system.dofs])
    damping = 150.0 * np.where(planets[:, None] | planets, 0.0, system.M)
    problem = replace(box.problem, system=replace(system, C=system.C + damping))
    start = np.linalg.lstsq(T, deflected.motion, rcond=None)[0]
    times = np.linspace(0.0, turns * 2.0 * np.pi / abs(turn), 200)
    options = {"start": (start, 0.0 * start), "method": "DOP853", "tolerance": 1e-10}
    motion = solve_transient(problem, box.frequency, times, **options)
    held, other = turned_approaches(speed), turned_approaches(speed, back=True)
    pins = [spring for spring in assembly.springs if spring.name.startswith("pins")]
    springs = np.concatenate([pin.stiffness[np.isfinite(pin.stiffness)] for pin in pins])
    rest = replace(assembly, springs=tuple(spring for spring in assembly.springs if spring not in pins))
    M, K, load = assembly.mass[np.ix_(at, at)], rest.stiffness[np.ix_(at, at)], deflected.model.load[at]
    inverse, excitation = np.linalg.inv(M), box.stages[0].excitation
    series = [np.fft.rfft(getattr(excitation, name), axis=1)[:, :3] for name in ("stiffness", "deflection")]
    omega, positions = box.frequency[1], excitation.stiffness.shape[1]

    def rate(time: float, state: np.ndarray) -> np.ndarray:
        q, v = np.split(state, 2)
        phase = np.exp(1j * np.arange(1, 3) * omega * time)
        k, gap = ((lines[:, 0].real + 2.0 * (lines[:, 1:] @ phase).real) / positions for lines in series)
        rows, behind = held(turn * time)[:, at], other(turn * time)[:6, at]
        front = np.maximum(k * (rows[:6] @ q - gap), 0.0)
        back = np.maximum(k * (behind @ q + gap - 4e-6), 0.0)
        force = load - K @ q - damping @ v - rows[:6].T @ front - behind.T @ back
        return np.concatenate([v, inverse @ (force - rows[6:].T @ (springs * (rows[6:] @ q)))])

    whole = T @ start
    begin = np.concatenate([whole[at], turn * (wave_generator(turning(deflected), assembly.count) @ whole)[at]])
    twin = solve_ivp(rate, (0.0, times[-1]), begin, method="DOP853", t_eval=times, rtol=1e-10, atol=1e-16)
    wanted, reached = twin.y[: len(at)][~planets], (T @ motion.displacement.T)[at][~planets]
    apart = np.abs(reached - wanted).max() / np.abs(wanted - wanted[:, :1]).max()
    theta = times[:, None] * box.frequency
    shares = []
    for element in box.flanks[0]:
        assert element is not None
        force = element.forces(motion.deflection[:, element.columns], theta)  # type: ignore[attr-defined]
        shares.append(float((force > 0.0).mean()))
    return float(apart), 1.0 - shares[0], shares[1]


def turning_in_time() -> tuple[Row, ...]:
    """Turning planets in an uneven casing, teeth that part and wedge, in time and in axes at rest."""
    rows = list[Row]()
    text = "motions of sun, carrier and casing, largest difference over the largest motion"
    for name, speed in (("turning planets, teeth part and wedge", 400.0), ("the same, backwards", -400.0)):
        apart, parted, behind = apart_at_rest(speed)
        assert parted > 0.0 and behind > 0.0
        rows.append(at_most(name, IN_TIME, text, 1e-6, apart))
    return tuple(rows)


def loose_carrier() -> tuple[Row, ...]:
    """A rigid set under torque and weight whose carrier rolls in the play of a bearing, with planets that turn."""
    data = rigid_set(held=1e6)
    data = replace(data, carrier=replace(data.carrier, support=2e7))
    stiffness, play, turn, mesh, weight = 3e8, 4e-6, 20.0, 2.0 * np.pi * 1300.0, 30.0
    drive = wave_of_stiffness(data, np.inf)
    tables = set_tables(data, TEETH) | {"gravity": {"acceleration": f"{weight} m/s^2"}}
    tables["bearing"].append(
        {"name": "loose", "shaft": "set carrier", "radial": f"{stiffness} N/m", "clearance": f"{2.0 * play} m"}
    )
    speed = {"set carrier": f"{turn} rad/s", "set ring": "0 rpm"}
    tables["operation"]["load_case"] = [{"torque": {"set sun": "100 N m"}, "speed": speed}]
    state = solve_deflection(read_case(tables))
    box = nonlinear_gearbox(state, {"set": drive}, harmonics=4, damping_ratio=0.0, separates=False)
    flank_options = {"separates": False, "backlash": drive.backlash, "harmonics": 4, "orders": (0, 1)}
    wanted = gear_set_problem(
        data,
        meshes=mesh_elements(data, stiffness=drive, **flank_options),
        torque=PlanarTorque(100.0, "sun", "carrier"),
        gravity=Gravity(weight, -0.5 * np.pi, (1, 0)),
        carrier_speed=turn,
        bearings=Bearings(None, (MemberBearing(stiffness, play, "carrier"),)),
    )
    orders = side_bands(10, 6, 10)
    options: dict[str, Any] = {"orders": orders, "stability": False, "radius": False, "samples": (128, 64)}
    problem = replace(box.problem, system=without_pull(state, box))
    start = loaded_lines(box, len(orders))
    ours = solve_harmonic_balance(problem, [turn, mesh], start=start, tolerance=1e-12, **options)
    reference = solve_harmonic_balance(wanted, [turn, mesh], tolerance=1e-12, **options)
    times = np.linspace(0.0, 2.0 * np.pi / turn, 701)
    meshes = [
        flank_forces(replace(of_problem, elements=of_problem.elements[:1]), solution, times)
        for of_problem, solution in ((problem, ours), (wanted, reference))
    ]
    apart = np.abs(meshes[0] - meshes[1]).max() / np.abs(meshes[1]).max()
    # the planar set moves in axes that turn with its carrier
    place, turned = ours.at(times)[:, -2:], reference.at(times)[:, -2:]
    there, expected = place @ [1.0, 1.0j], turned @ [1.0, 1.0j] * np.exp(1j * turn * times)
    assert np.abs(there).min() < play < np.abs(there).max()
    rolled = np.abs(there - expected).max() / np.abs(expected).max()
    name = "planar set, its carrier in a bearing with play, weight"
    return (
        at_most(name, PLANAR, "forces of all flanks over time, largest difference over the largest", 1e-6, apart),
        at_most(name, PLANAR, "motion in the bearing over time, largest difference over the largest", 1e-6, rolled),
    )


def loose_pair() -> tuple[Row, ...]:
    """Two rigid gears under weight, one in a bearing that carries nothing for half of the time."""
    state = solve_deflection(read_case(loose_pair_tables("20 um", weight="28 kg")))
    drive = excitation_of(state, state.model.stages[0])
    error = 5e-6 * np.cos(2.0 * np.pi * np.arange(drive.deflection.shape[1]) / drive.deflection.shape[1])
    drive = replace(drive, deflection=drive.deflection + error)
    box = nonlinear_gearbox(state, {"stage": drive}, harmonics=2, damping_ratio=0.05, separates=False)
    omega, harmonics = 2.0 * np.pi * 250.0, 64
    options = {"harmonics": harmonics, "samples": 8192, "stability": False, "radius": False}
    solution = solve_harmonic_balance(box.problem, omega, **options)
    loose = float((forces_of_bearings(box, solution) == 0.0).mean())
    assert 0.4 < loose < 0.6
    lines, order = displacements(box.problem, solution), np.arange(harmonics + 1)
    start = lines.sum(axis=1).real, (1j * omega * order * lines).sum(axis=1).real
    times = np.linspace(0.0, 4.0 * np.pi / omega, 65)
    motion = solve_transient(box.problem, omega, times, start=start, method="DOP853", tolerance=1e-11)
    wanted = motion.deflection
    apart = np.abs(solution.at(times) - wanted).max(axis=0) / np.ptp(wanted, axis=0)
    text = "motions of mesh and bearing over two periods, largest difference over the range"
    name = "pair in a bearing with play, without load for half of the time"
    return (at_most(name, "DOP853", text, 1e-6, float(apart.max())),)
