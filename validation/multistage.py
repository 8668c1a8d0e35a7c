"""Planetary stages in series: ratios, modes of stages that know of each other and of stages that do not."""

from __future__ import annotations

import math
import tomllib
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np
from gearbox_equivalents import set_parts
from published.multistage_example import CASES, PUBLISHED_FREQUENCIES, four_stage_case, published_case
from published.planetary_sets import lin_parker_set

from femgear.housing.two_way.running_planets import RunningResponse, solve_running
from femgear.run import solve
from femgear.solvers.linear.modal import viscous_damping
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.solvers.periodic.solution import PeriodicSolution
from femgear.stages.lumped_set import gear_set_modes
from femgear.system.force_laws import GearMeshes
from femgear.system.fourier import FourierSeries, distinct_lines, harmonics_of, orders_of, sample
from femgear.system.rigid_bodies import PlanarBody, PlanarSet
from femgear.system.system import MechanicalSystem, MeshExcitation, NonlinearSystem
from femgear.system.turning_meshes import TurningMeshes
from femgear.trains.gearbox.deflection import Deflection, solve_deflection
from femgear.trains.gearbox.excitation import excitation_of, mesh_phases
from femgear.trains.gearbox.model import StageModel
from femgear.trains.gearbox.modes import GearboxModes, linear_system
from femgear.trains.gearbox.nonlinear import nonlinear_gearbox
from femgear.trains.gearbox.power import gearbox_flow
from femgear.trains.gearbox.response import mesh_rows, solve_gearbox_response
from femgear.trains.gearbox.stage_structure import running_stage
from femgear.trains.reading import read_case, with_values
from validation.reference.multistage_train import complex_numbers, stored
from validation.rows import Row, at_most, counted, information, within

STRUCTURE = "Kiracofe and Parker, J. Vib. Acoust. 129, 2007: structure of the modes"
FORMER = "femgear 224a9b2b, multistage"
NO_LOSS = 1e-9
"""Damping ratio at which losses are too small to see off resonance."""


def modes_of(case) -> GearboxModes:
    """Modes of a gearbox case."""
    return solve(case, only="modes")["modes"].gearbox_modes


def ratios() -> tuple[Row, ...]:
    """Speeds and torques of the four-stage example against exact fractions."""
    case, exact = four_stage_case(), Fraction(1)
    for stage in case.planetary:
        exact *= 1 + Fraction(stage.gears.teeth[2], stage.gears.teeth[0])
    flow, state = gearbox_flow(case), solve_deflection(case)
    speed, torque = case.load_case.speed["stage 1 sun"], case.load_case.torque["stage 1 sun"]
    source, output = "product of 1 + z_r / z_s, exact", flow.port_torque["stage 4 carrier"]
    mesh = case.planetary[-1].gears.teeth[2] * speed / float(exact) / (2.0 * math.pi)
    last = state.model.stages[-1]
    sun, _, ring = last.sizes.base_radii
    lumped = -state.mesh_force[list(last.meshes)].sum() / 2.0 * (sun + ring)
    ratio = flow.speed["stage 1 sun"] / flow.speed["stage 4 carrier"]
    return (
        within("MS", source, "four stages: ratio of the speeds", float(exact), ratio, 1e-12),
        within("MS", source, "output torque [N m]", -torque * float(exact), output, 1e-12),
        within("MS", "z_r w_c / (2 pi)", "mesh of stage 4 [Hz]", mesh, flow.mesh_frequency["stage 4"], 1e-12),
        within(
            "MS",
            "power balance",
            "power at the output [W]",
            -torque * speed,
            output * flow.speed["stage 4 carrier"],
            1e-12,
        ),
        at_most(
            "MS",
            "radii belong to teeth",
            "output torque of the lumped sets, relative difference",
            1e-12,
            abs(lumped / output - 1.0),
        ),
    )


def side_by_side(data: PlanarSet) -> dict[str, Any]:
    """Tables of a gearbox that is two sets which know nothing of each other."""
    radii = np.array([data.sun_radius, data.planet_radius, data.ring_radius])
    teeth = np.rint(1000 * radii / radii[0]).astype(int).tolist()
    tables: dict[str, Any] = {"model": "gearbox", "title": "two sets", "motions": "plane"}
    names = ("first", "second")
    for name in names:
        for kind, entries in set_parts(data, teeth, name=name).items():
            tables.setdefault(kind, []).extend(entries)
    suns = [f"{name} sun" for name in names]
    rings = [f"{name} ring" for name in names]
    tables["operation"] = {
        "output": [*rings, *(f"{name} carrier" for name in names)],
        "load_case": [{"torque": dict.fromkeys(suns, "0 N m"), "speed": dict.fromkeys([*suns, *rings], "0 rpm")}],
    }
    return tables | {"modes": {"up_to": "1 MHz"}}


def uncoupled() -> tuple[Row, ...]:
    """Two identical stages side by side: every mode twice."""
    rows = []
    for planets in (3, 4, 5):
        data = lin_parker_set(planets)
        modes, single = modes_of(read_case(side_by_side(data))), gear_set_modes(data)
        elastic = single.frequency > 0.0
        error = np.abs(np.sort(modes.modes.frequency)[2:] / np.repeat(single.frequency[elastic], 2) - 1.0).max()
        name = f"two uncoupled stages of {planets} planets: "
        rows.append(at_most("MS", "modes of one stage", name + "largest relative difference", 1e-10, error))
        same_kinds = Counter(modes.stages.kinds) == {kind: 2 * n for kind, n in Counter(single.kind).items()}
        rows.append(counted("MS", "modes of one stage", name + "every kind twice", 1, int(same_kinds)))
    return tuple(rows)


def planets_of(stage: StageModel, stiffness: tuple[float, float]) -> PlanarSet:
    """Planets and meshes of a stage as a set of rigid bodies, whose members do not count."""
    sizes, section = stage.sizes, stage.section
    body = PlanarBody(1.0, 1.0, 1e9, 1e9)
    return PlanarSet(
        sun=body,
        ring=body,
        carrier=body,
        planet=PlanarBody(section.planet.mass, section.planet.inertia),
        planet_bearing=section.planet.bearing.radial,
        stiffness_sun_planet=stiffness[0],
        stiffness_planet_ring=stiffness[1],
        sun_radius=sizes.base_radii[0],
        planet_radius=sizes.base_radii[1],
        ring_radius=sizes.base_radii[2],
        centre_distance=sizes.centre_distance,
        planet_angles=sizes.planet_angles,
        pressure_angle_sun_planet=sizes.pressure_angles[0],
        pressure_angle_planet_ring=sizes.pressure_angles[1],
    )


def structure() -> tuple[Row, ...]:
    """Kinds of the modes of the coupled four-stage example."""
    modes = modes_of(four_stage_case())
    kinds = Counter(modes.stages.kinds)
    rotational, name = kinds["rotational"] + kinds["rigid"], "four stages: "
    rows = [
        counted("MS", STRUCTURE, name + "rotational modes, one rigid", 24, rotational),
        counted("MS", STRUCTURE, name + "translational modes", 48, kinds["translational"]),
        counted("MS", STRUCTURE, name + "planet modes, 3 (N - 3) a stage", 6, kinds["planet"]),
    ]
    planet, main = np.array(modes.stages.kinds) == "planet", modes.stages.energy.argmax(axis=0) + 1
    for number in (3, 4):
        stage = modes.deflection.model.stages[number - 1]
        meshes = stage.section.sun_mesh.stiffness, stage.section.ring_mesh.stiffness
        alone = gear_set_modes(planets_of(stage, meshes))
        planet_frequencies = alone.frequency[np.array(alone.kind) == "planet"]
        error = np.abs(modes.modes.frequency[planet & (main == number)] / planet_frequencies - 1.0).max()
        name = f"planet modes of stage {number}, coupled and alone: relative difference"
        rows.append(at_most("MS", STRUCTURE, name, 1e-9, error))
    return tuple(rows)


def soft_shaft() -> tuple[Row, ...]:
    """Two stages on a soft shaft: two inertias on a spring."""
    tables = first_stages(2)
    for bearing in tables["bearing"]:
        bearing["radial"] = "rigid"
    tables["bearing"].append({"shaft": "stage 2 sun", "radial": "rigid"})
    for stage in tables["planetary"]:
        stage["planet"]["bearing"]["radial"] = "rigid"
    for coupling in tables["coupling"]:
        held = "casing" in coupling["between"]
        coupling |= {"radial": "rigid", "torsion": "rigid"} if held else {"radial": "0 N/m", "torsion": "1 N m/rad"}
    case = read_case(tables)
    first, second = (_reflected(case, n) for n in (0, 1))
    # the second stage is felt at its sun
    teeth = case.planetary[1].gears.teeth
    second /= (1.0 + teeth[2] / teeth[0]) ** 2
    exact = math.sqrt(1.0 / first + 1.0 / second) / (2.0 * math.pi)
    ours = np.sort(modes_of(case).modes.frequency)[1]
    source = "sqrt(k / J_1 + k / J_2), inertias by Willis"
    return (within("MS", source, "two torsional stages on a soft shaft [Hz]", exact, ours, 1e-6),)


def first_stages(count: int) -> dict[str, Any]:
    """Tables of the first stages of the example alone."""
    tables = tomllib.loads((CASES / "four_stage_reducer.toml").read_text(encoding="utf-8"))
    kept = tuple(f"stage {n + 1}" for n in range(count))
    for kind, key in (("shaft", "name"), ("planetary", "name"), ("mass", "shaft"), ("bearing", "shaft")):
        tables[kind] = [entry for entry in tables[kind] if entry[key].startswith(kept)]
    tables["coupling"] = [
        entry for entry in tables["coupling"] if all(end.startswith((*kept, "casing")) for end in entry["between"])
    ]
    tables["operation"]["output"] = [f"{kept[-1]} carrier"]
    return tables


def _reflected(case, number: int) -> float:
    """Inertia of a stage with a fixed ring, felt at its carrier [kg m^2]."""
    stage = case.planetary[number]
    zs, zp, zr = stage.gears.teeth
    sun, planet = 1.0 + zr / zs, 1.0 - zr / zp
    inertia = {mass.shaft: mass.inertia for mass in case.mass}
    distance = 0.5 * stage.gears.module * (zs + zp)
    planets = stage.planet.mass * distance**2 + stage.planet.inertia * planet**2
    return inertia[stage.carrier] + inertia[stage.sun] * sun**2 + stage.gears.planets * planets


@dataclass(frozen=True)
class Excited:
    """A stage of the example that excites it.

    Parameters
    ----------
    state : Deflection
        Loaded state.
    stage : StageModel
    excitation : MeshExcitation
    """

    state: Deflection
    stage: StageModel
    excitation: MeshExcitation

    @property
    def mesh(self) -> float:
        """Mesh frequency at the speed of operation [rad/s]."""
        return 2.0 * math.pi * self.state.model.flow.mesh_frequency[self.stage.name]

    @property
    def carrier(self) -> float:
        """Speed of the carrier there [rad/s]."""
        return abs(self.state.model.flow.speed[self.stage.section.carrier])

    def response(self, factor: float, carrier: float, harmonics: tuple[int, int]) -> tuple[RunningResponse, np.ndarray]:
        """Response at a factor of the speed of operation, and forces (Q + 1, S, M) of all but its own meshes."""
        structured = running_stage(self.state, self.stage, self.excitation)
        options = {"harmonics": harmonics, "side_bands": 4 if carrier else 0, "tolerance": 1e-13}
        response = solve_running(structured.running, factor * self.mesh, carrier, **options)
        approach = mesh_rows(self.state.model, self.stage.meshes) @ structured.motion
        loss = 1.0 + 2j * self.state.model.case.modes.damping_ratio
        return response, loss * response.lines(approach.T) * mesh_stiffness(self.state)

    def lines(self, factor: float, carrier: float, harmonics: tuple[int, int]) -> np.ndarray:
        """Lines (meshes, Q + 1) of the meshes with planet 1 at the mesh harmonics, sun and ring, stage by stage."""
        response, others = self.response(factor, carrier, harmonics)
        middle = list(response.band).index(0)
        first = first_meshes(self.state)
        mixed = others[:, middle].T[first].copy()
        at, planets = first.index(self.stage.meshes[0]), response.force.shape[3] // 2
        mixed[at : at + 2] = 2.0 * response.force[0, :2, :, planets]
        return mixed


def mesh_stiffness(state: Deflection) -> np.ndarray:
    """Mean stiffness of all meshes [N/m]."""
    return np.array([contact.stiffness.sum() for contact in state.model.assembly.contacts])


def first_meshes(state: Deflection) -> list[int]:
    """Meshes of planet 1 with sun and ring of every stage."""
    return [mesh for stage in state.model.stages for mesh in (stage.meshes[0], stage.meshes[len(stage.planets)])]


def loaded(*, lateral: bool = True, damping: float = 0.03) -> Deflection:
    """Loaded state of the example."""
    return solve_deflection(with_values(four_stage_case(lateral=lateral), {"modes.damping_ratio": damping}))


def with_errors(state: Deflection, number: int) -> Excited:
    """A stage of constant stiffness with the transmission errors of its loaded meshes, three harmonics."""
    stage = state.model.stages[number - 1]
    first = complex_numbers(stored()["errors"][str(number)])
    count, planets = 48 * len(stage.planets), len(stage.planets)
    ahead = mesh_phases(stage.sizes)
    ahead = ahead - ahead[[0] * planets + [planets] * planets]
    lines = np.repeat(first, planets, axis=0) * np.exp(2j * np.pi * np.outer(ahead, [1, 2, 3]))
    deflection = sample(np.column_stack([np.zeros(2 * planets), lines]), count)
    stiffness = np.broadcast_to(mesh_stiffness(state)[list(stage.meshes)][:, None], deflection.shape)
    force = np.full(deflection.shape, state.mesh_force[stage.meshes[0]])
    return Excited(state, stage, MeshExcitation(stiffness, deflection, force, np.zeros(2 * planets)))


def with_pairs(state: Deflection, number: int, harmonics: int = 3) -> Excited:
    """A stage with so many harmonics of its stiffness by the number of tooth pairs."""
    stage = state.model.stages[number - 1]
    whole = excitation_of(state, stage)
    cut = {
        name: sample(harmonics_of(getattr(whole, name), harmonics), whole.force.shape[1])
        for name in ("stiffness", "force")
    }
    return Excited(state, stage, replace(whole, **cut))


def direct_lines(excited: Excited, factor: float) -> np.ndarray:
    """Lines (meshes, 3) by errors of one stage from the whole linear gearbox, planets where they stand."""
    state, count = excited.state, excited.excitation.force.shape[1]
    _, system, stiffness = linear_system(state)
    loss = 1.0 + 2j * state.model.case.modes.damping_ratio
    errors = np.zeros((len(stiffness), 3), complex)
    errors[list(excited.stage.meshes)] = 2.0 / count * np.fft.fft(excited.excitation.deflection, axis=1)[:, 1:4]
    whole = loss * (system.K + (system.W * stiffness) @ system.W.T)
    lines = np.zeros_like(errors)
    for h in (1, 2, 3):
        dynamic = whole - (h * factor * excited.mesh) ** 2 * system.M
        motion = np.linalg.solve(dynamic, system.W @ (stiffness * errors[:, h - 1]))
        # as the stage has them: the stiffness before an error has no loss
        lines[:, h - 1] = stiffness * (loss * (system.W.T @ motion) - errors[:, h - 1])
    return lines[first_meshes(state)]


def response() -> tuple[Row, ...]:
    """Every stage in the structure of the rest, by transmission errors."""
    rows, state, soft = [], loaded(), loaded(lateral=False)
    for number in (1, 2, 3, 4):
        stage = with_errors(state, number)
        worst = dict.fromkeys(("direct", "soft"), 0.0)
        for factor in np.linspace(0.3, 1.2, 5).tolist():
            lines, direct = stage.lines(factor, 0.0, (3, 3))[:, 1:], direct_lines(stage, factor)
            without = with_errors(soft, number).lines(factor, 0.0, (3, 3))[:, 1:]
            size = np.abs(direct).max()
            worst["direct"] = max(worst["direct"], np.abs(lines - direct).max() / size)
            worst["soft"] = max(worst["soft"], np.abs(lines - without).max() / size)
        name = f"mesh forces by transmission errors of stage {number}: "
        rows.append(at_most("MS", "direct solution", name + "in its structure, difference", 1e-9, worst["direct"]))
        source = "no harmonic in the class of translations"
        rows.append(at_most("MS", source, name + "without lateral couplings, difference", 1e-9, worst["soft"]))
    return tuple(rows)


def former_modes() -> tuple[Row, ...]:
    """Modes of the shipped cases beside those of the train that had them before."""
    rows, former = list[Row](), stored()
    for name, key, case in (
        ("four stages", "modes", four_stage_case()),
        ("published table", "published", published_case(planets=3)),
    ):
        modes, expected = modes_of(case), np.array(former[key]["frequency"])
        elastic = expected > 0.0
        error = np.abs(np.sort(modes.modes.frequency)[elastic] / expected[elastic] - 1.0).max()
        rows.append(at_most("MS", FORMER, f"{name}: natural frequencies, largest relative difference", 1e-9, error))
        same = Counter(modes.stages.kinds) == Counter(former[key]["kind"])
        rows.append(counted("MS", FORMER, f"{name}: as many modes of every kind", 1, int(same)))
        if key == "modes":
            apart = np.abs(modes.stages.energy.max(axis=0) - former[key]["share"]).max()
            rows.append(at_most("MS", FORMER, f"{name}: share of a mode's main stage, largest difference", 1e-9, apart))
    return tuple(rows)


def former_response() -> tuple[Row, ...]:
    """Mesh forces of all stages beside those of the former train, without losses."""
    rows, former, state = list[Row](), stored(), loaded(damping=NO_LOSS)
    speeds = np.array(former["error_response"]["speed"]) / state.model.flow.speed["stage 1 sun"]
    for number in (1, 2, 3, 4):
        stage = with_errors(state, number)
        expected = complex_numbers(former["error_response"]["force"][str(number)])
        worst = max(
            np.abs(stage.lines(factor, 0.0, (3, 3))[:, 1:].T - lines).max() / np.abs(lines).max()
            for factor, lines in zip(speeds.tolist(), expected, strict=True)
        )
        name = f"lines by errors of stage {number}, planets standing: largest difference over the largest"
        rows.append(at_most("MS", FORMER, name, 1e-6, worst))
        expected = complex_numbers(former["one_stage"][str(number)])[:, 1:]
        pairs = with_pairs(state, number)
        for text, carrier, gate in (("planets standing", 0.0, 1e-6), ("planets running around", pairs.carrier, 1e-2)):
            lines = pairs.lines(1.0, carrier, (3, 12))[:, 1 : expected.shape[1] + 1]
            name = f"lines by k(t) of stage {number}, {text}: largest difference over the largest"
            note = "the former train let all planets stand" if carrier else ""
            error = np.abs(lines - expected).max() / np.abs(expected).max()
            rows.append(at_most("MS", FORMER, name, gate, error, note=note))
    return tuple(rows)


def turning_frames() -> tuple[Row, ...]:
    """A mesh with an error of its own: how sun 2 feels the centre of carrier 1, which runs around."""
    tables, former = first_stages(2), stored()["turning"]["1e-07"]
    tables["modes"]["damping_ratio"] = 1e-7
    state = solve_deflection(read_case(tables))
    stage, count = state.model.stages[0], 48
    stiffness = np.repeat(mesh_stiffness(state)[list(stage.meshes)][:, None], count, axis=1)
    error = np.zeros((6, count))
    error[0] = 5e-6 * np.cos(2.0 * np.pi * np.arange(count) / count)
    excitation = MeshExcitation(stiffness, error, np.full((6, count), state.mesh_force[0]), np.zeros(6))
    structured = running_stage(state, stage, excitation)
    paths = replace(structured.running.paths, symmetry=1)
    running = replace(structured.running, excitation=excitation, paths=paths)
    excited = Excited(state, stage, excitation)
    approach = mesh_rows(state.model, stage.meshes) @ structured.motion
    rows = list[Row]()
    standing = solve_running(running, excited.mesh, 0.0, harmonics=(1, 1), side_bands=0)
    for kind, mesh, reference in zip((0, 1), ("sun-planet 1", "planet 1-ring"), np.array(former["rest"])[[0, 2]]):
        value = abs(2.0 * standing.force[0, kind, 1, 0])
        rows.append(
            within("MS", FORMER, f"an error of one mesh, standing: {mesh} of stage 1 [N]", reference, value, 1e-6)
        )
    response = solve_running(running, excited.mesh, excited.carrier, harmonics=(1, 1), side_bands=4)
    lines = np.abs(response.lines(approach.T)[1] * mesh_stiffness(state))
    note = "in the frame of carrier 2 these lines lie 0.8 Hz nearer to the mesh frequency"
    for place, text in enumerate(("one turn below", "at the mesh frequency", "one turn above")):
        band = list(response.band).index(place - 1)
        reference = former["turning"][4][place]
        name = f"an error of one mesh, {text}: sun-planet 1 of stage 2 [N]"
        rows.append(within("MS", FORMER, name, reference, lines[band, 6], 2e-2, note=note if place != 1 else ""))
    return tuple(rows)


@dataclass(frozen=True)
class AtOnce:
    """The example at rest with k(t) of its stages, three harmonics each, as one system for harmonic balance.

    Parameters
    ----------
    state : Deflection
        Loaded state.
    system : MechanicalSystem
        About that state, all modes with a damping ratio of 0.03.
    """

    state: Deflection
    system: MechanicalSystem

    def solve(self, factor: float, orders: Iterable[np.ndarray], only: int | None = None) -> PeriodicSolution:
        """Lines of all meshes at a factor of the speed of operation; k(t) of one stage ``only``, by its number."""
        elements, stages = [], self.state.model.stages
        for number, stage in enumerate(stages, 1):
            lines = harmonics_of(with_pairs(self.state, number).excitation.stiffness, 3)
            lines[:, 1:] *= only in (None, number)
            series = FourierSeries(lines)
            base = orders_of(number - 1, len(stages), 1)
            series = replace(series, orders=tuple(series.orders[0] * order for order in base))
            elements.append(GearMeshes(np.array(stage.meshes), series, separates=False))
        mesh = [2.0 * math.pi * factor * self.state.model.flow.mesh_frequency[stage.name] for stage in stages]
        problem = NonlinearSystem(self.system, tuple(elements))
        solution = solve_harmonic_balance(problem, np.array(mesh), orders=distinct_lines(orders), stability=False)
        assert solution.converged
        return solution

    def pressed(self, solution: PeriodicSolution, stage: StageModel) -> dict[tuple[int, ...], np.ndarray]:
        """Forces (M,) of the meshes of a stage beyond their mean stiffness, line by line."""
        rows_of_stage = list(stage.meshes)
        beyond = (
            solution.force[rows_of_stage]
            - mesh_stiffness(self.state)[rows_of_stage, None] * solution.deflection[rows_of_stage]
        )
        return {tuple(order.tolist()): beyond[:, line] for line, order in enumerate(solution.orders) if order.any()}


def at_once() -> AtOnce:
    """Assemble the example about its loaded state."""
    state = loaded()
    system, stiffness = linear_system(state)[1:]
    load = state.model.assembly.motions.T @ state.model.load
    still = replace(system, gyroscopic=None, load=load)
    return AtOnce(state, replace(still, C=viscous_damping(still, stiffness, 0.03)))


def balance() -> tuple[Row, ...]:
    """All stages with k(t) at once by harmonic balance, beside the former train and beside stage by stage."""
    rows, example = list[Row](), at_once()
    stages = example.state.model.stages
    note = "structural damping beside that of modes"
    for text, entry in stored()["balance"].items():
        factor = float(text)
        solution = example.solve(factor, [np.array(line) for line in entry["orders"] if any(line)])
        force = solution.force[[stage.meshes[0] for stage in stages]][:, 1:]
        exact = np.sqrt(0.5 * (np.abs(force) ** 2).sum(axis=1))
        response = solve_gearbox_response(example.state, [factor * 50.0 * math.pi])
        one_by_one = np.sqrt((response.mesh_forces[0] ** 2).sum(axis=1))
        for number, (stage, reference) in enumerate(zip(stages, entry["rms"], strict=True)):
            speed, alone = f"{1500 * factor:.0f} rpm", one_by_one[stage.meshes[0]]
            name = f"k(t) of all stages at {speed}: r.m.s. force in sun-planet 1 of {stage.name} [N]"
            rows.append(within("MS", FORMER, name, reference, exact[number], 1e-6))
            name = f"stage by stage at {speed}: the same of {stage.name} [N]"
            rows.append(information("MS", "k(t) of all stages", name, exact[number], alone, note=note))
    return tuple(rows)


def balance_running() -> tuple[Row, ...]:
    """The same with planets that run around: all stages as elements of the nonlinear gearbox, flanks held together."""
    rows, state, entry = list[Row](), loaded(), stored()["balance"]["1.0"]
    stages = state.model.stages
    excitations = {stage.name: with_pairs(state, number).excitation for number, stage in enumerate(stages, 1)}
    box = nonlinear_gearbox(state, excitations, harmonics=3, separates=False, mean_damping=False)
    meshes = [box.bases.index(f"{stage.name} mesh") for stage in stages]
    orders = np.zeros((len(entry["orders"]), len(box.bases)), int)
    orders[:, meshes] = entry["orders"]
    # products of three harmonics by three; equal planets load no shaft across, whose waves carriers would turn
    phases = np.ones(len(box.bases), int)
    phases[meshes] = 10
    options = {"orders": distinct_lines(orders[orders.any(axis=1)]), "samples": tuple(phases.tolist())}
    solution = solve_harmonic_balance(box.problem, box.frequency, stability=False, **options)
    assert solution.converged
    theta = 2.0 * np.pi * np.indices(phases).reshape(len(phases), -1).T / phases
    wave = np.exp(1j * theta @ solution.orders.T)
    moved = np.real(wave @ solution.deflection.T)
    for stage, (flanks, _), reference in zip(stages, box.flanks, entry["rms"], strict=True):
        assert isinstance(flanks, TurningMeshes)
        force = flanks.forces(moved[:, flanks.columns], theta)[:, 0]
        lines = 2.0 * wave[:, 1:].conj().T @ force / len(force)
        value = float(np.sqrt(0.5 * (np.abs(lines) ** 2).sum()))
        name = f"k(t) of all stages, planets running around: r.m.s. force in sun-planet 1 of {stage.name} [N]"
        rows.append(within("MS", FORMER, name, reference, value, 1e-2, note="there planets stand"))
    return tuple(rows)


def left_out() -> tuple[Row, ...]:
    """What W-CROSS says of every stage, beside k(t) of all of them at once with sums and differences of their lines."""
    rows, example, unit = list[Row](), at_once(), np.eye(4, dtype=int)
    single = [[h * base for h in (1, 2, 3)] for base in unit]
    orders = [order for orders_of_stage in single for order in orders_of_stage]
    orders += [
        first + sign * second
        for a, orders_of_stage in enumerate(single)
        for other in single[:a]
        for first in orders_of_stage
        for second in other
        for sign in (-1, 1)
    ]
    for factor in (0.7, 1.0):
        whole = example.solve(factor, orders)
        response = solve_gearbox_response(example.state, [factor * 50.0 * math.pi])
        shares = np.sqrt((response.cross_excitation[0] ** 2).sum(axis=1))
        for number, stage in enumerate(example.state.model.stages):
            alone = example.pressed(example.solve(factor, single[number], number + 1), stage)
            lines = [force - alone.get(order, 0.0) for order, force in example.pressed(whole, stage).items()]
            exact = np.sqrt(0.5 * (np.abs(lines) ** 2).sum(axis=0)).reshape(2, -1).max(axis=1)
            share = float((exact / response.dynamic_forces[0, number]).max())
            name = f"force left out of {stage.name} at {1500 * factor:.0f} rpm, estimate over exact, binary logarithm"
            rows.append(at_most("MS", "k(t) of all stages", name, 1.0, math.log2(shares[number] / share)))
    return tuple(rows)


def published() -> tuple[Row, ...]:
    """Published four-stage table in torsion, free at both ends: stiffnesses as printed and a thousandth."""
    rows, source = [], "Optimized design of dynamic characteristics of planetary gear train"
    note = "number of planets, supports and shafts are not printed; docs/multistage.md has all readings"
    for unit, factor in (("N/mm as printed", 1e3), ("N/m", 1.0)):
        for planets in (3, 4):
            case = published_case(planets=planets, stiffness_unit=factor)
            elastic = np.sort(modes_of(case).modes.frequency)[1:]
            name = f"published table, {unit}, {planets} planets, rigid shafts: "
            for text, reference, value in zip(
                ("lowest", "highest"), PUBLISHED_FREQUENCIES, (elastic[0], elastic[-1]), strict=True
            ):
                words = f"{name}{text} elastic mode [Hz]"
                rows.append(information("MS", source, words, reference, value, note=note))
    return tuple(rows)
