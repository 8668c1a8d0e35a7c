"""Power and force balances of the response of gearboxes, formed over mesh period and turn of the carrier.

Mesh period theta and turn phi of the carrier count as two angles of their own: fields of ``exp(i (h theta + b phi))``
are sampled on both, products are formed there, and what the solver does with side bands is not used.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from casings import CENTRE, MASS, casing_tables, pair_in_a_casing
from running_twin import TURN, running, twin
from small_gearbox import planetary_tables

from femgear.housing.two_way.running_planets import RunningResponse, RunningStage, solve_running
from femgear.system.system import mesh_harmonics
from femgear.trains.gearbox.deflection import Deflection, solve_deflection
from femgear.trains.gearbox.response import output_rows
from femgear.trains.gearbox.stage_structure import running_stage, stage_excitation
from femgear.trains.reading import read_case
from validation.gearbox_response import synthetic_excitation
from validation.rows import Row, at_most, information

BALANCE = "balance over mesh period and turn"


@dataclass(frozen=True)
class Grid:
    """Samples of mesh period and turn of the carrier.

    Parameters
    ----------
    periods, turns : int
        Numbers of samples.
    mesh_frequency, speed : float
        Rates of both angles [rad/s].
    """

    periods: int
    turns: int
    mesh_frequency: float
    speed: float

    def field(self, lines: np.ndarray, *, derivative: bool = False) -> np.ndarray:
        """Real fields (.., periods, turns) of two-sided lines (.., Q + 1, B), B odd, or their rates of time."""
        bands = np.arange(lines.shape[-1]) - lines.shape[-1] // 2
        harmonics = np.arange(lines.shape[-2])
        weight = np.where(harmonics > 0, 2.0, 1.0)[:, None]
        if derivative:
            weight = weight * 1j * (harmonics[:, None] * self.mesh_frequency + bands * self.speed)
        spectrum = np.zeros((*lines.shape[:-2], self.periods, self.turns), complex)
        spectrum[..., harmonics[:, None], bands % self.turns] = weight * lines
        return np.fft.ifft2(spectrum, norm="forward").real

    @property
    def turn(self) -> np.ndarray:
        """Angles (turns,) of the carrier [rad]."""
        return 2.0 * np.pi * np.arange(self.turns) / self.turns

    def signal(self, harmonics: np.ndarray) -> np.ndarray:
        """Signals (J, periods, 1) of the mesh period by their one-sided harmonics (J, H + 1)."""
        theta = 2.0 * np.pi * np.arange(self.periods) / self.periods
        return np.real(harmonics @ np.exp(1j * np.outer(np.arange(harmonics.shape[1]), theta)))[..., None]


def grid_of(response: RunningResponse) -> Grid:
    """Grid that resolves products of three fields of a response."""
    lines, bands = response.force.shape[2:]
    return Grid(6 * lines, 4 * bands + 16, response.mesh_frequency, response.carrier_speed)


def powers(stage: RunningStage, response: RunningResponse, harmonics: int) -> dict[str, float]:
    """Mean powers [W]: of the excitation, lost in springs and in the structure, and taken by the drive of the carrier.

    Of a stage whose planets are all alike, the first one of which is solved.
    """
    grid, count, kinds = grid_of(response), stage.paths.symmetry, stage.kinds
    assert len(response.force) == 1
    force, approach = response.force[0], response.approach
    k, s, F = (grid.signal(lines[::count]) for lines in mesh_harmonics(stage.excitation, harmonics))
    mean = stage.excitation.stiffness.reshape(kinds, -1).mean(axis=1)[:, None, None]
    s, F = (signal - signal.mean(axis=1, keepdims=True) for signal in (s, F))
    pressed = F - k * s + (k - mean) * grid.field(approach)
    rates = grid.field(approach, derivative=True)
    excitation = -count * float((pressed * rates).mean(axis=(1, 2)).sum())
    # what damps: rate of the deflection times the part of the force in phase with it, line by line
    lines, bands = force.shape[1:]
    weight = np.where(np.arange(lines) > 0, 2.0, 1.0)[:, None]
    omega = np.arange(lines)[:, None] * response.mesh_frequency + (np.arange(bands) - bands // 2) * grid.speed
    compliance = np.moveaxis(stage.compliance(omega), -1, 0)
    stiffness = 1.0 / np.where(compliance == 0.0, 1.0, compliance)
    deflection = np.concatenate([approach, compliance[kinds:] * force[kinds:]])
    springs = count * float((weight * omega * stiffness.imag * np.abs(deflection) ** 2).sum())
    damping = 2.0 * stage.damping_ratio * stage.natural_frequency
    rate = response.frequency[..., None]
    loss = stage.structure_loss * stage.natural_frequency**2 * np.abs(rate) + damping * rate**2
    structure = float((weight[..., None] * loss * np.abs(response.modal) ** 2).sum())
    # the carrier turns the contact points past the structure
    modal = np.moveaxis(response.modal, 2, 0)
    past = np.zeros((len(force), grid.periods, grid.turns))
    for n, row in zip(stage.waves, np.moveaxis(stage.shape, 1, 0), strict=True):
        wave = np.exp(1j * n * (stage.paths.planet_angles[0] + stage.sense * grid.turn))
        moved = np.tensordot(row, grid.field(modal), axes=(1, 0))
        past += np.real(1j * n * stage.sense * grid.speed * wave * moved)
    drive = -count * float((grid.field(force) * past).mean(axis=(1, 2)).sum())
    return {"excitation": excitation, "springs": springs, "structure": structure, "drive": drive}


def input_and_losses() -> tuple[Row, ...]:
    """Power that the teeth put in, and where it goes, of running planets and of a stage in a casing."""
    rows = list[Row]()
    system = twin(3, 13)
    state = planets_in_a_casing()
    box = running_stage(state, state.model.stages[0], synthetic_excitation(state, state.model.stages[0])).running
    nominal = 2.0 * np.pi * state.model.flow.mesh_frequency["set"], abs(state.model.flow.speed["carrier"])
    lossy = replace(running(system), structure_loss=0.04, loss=np.full(4, 0.03))
    stages = {"planets on uneven supports": (lossy, 13 * TURN, TURN), "planetary stage in a casing": (box, *nominal)}
    for name, (stage, mesh, carrier) in stages.items():
        largest = 0.0
        for factor in (0.4, 1.0, 2.3):
            options = {"harmonics": (2, 10), "side_bands": 6, "tolerance": 1e-13}
            power = powers(stage, solve_running(stage, factor * mesh, factor * carrier, **options), 2)
            losses = power["springs"] + power["structure"]
            largest = max(largest, power["drive"] / losses, key=abs)
            apart = (power["excitation"] - losses - power["drive"]) / losses
            text = f"input less losses and power of the carrier's drive, over losses, {factor:g} of the speed"
            rows.append(at_most(name, BALANCE, text, 1e-9, apart))
        text = "power from the excitation into the drive of the carrier, over losses, largest"
        rows.append(information(name, BALANCE, text, None, largest))
    return tuple(rows)


def planets_in_a_casing() -> Deflection:
    """Planetary stage of rigid bodies whose ring is in a casing on uneven feet, with sensors at its centre."""
    tables = planetary_tables() | {"deflection": {"slices": 1}, "casing": casing_tables()}
    centre = [f"{value!r} m" for value in CENTRE.tolist()]
    tables["sensor"] = [{"name": way, "position": centre, "direction": way} for way in "xyz"]
    return solve_deflection(read_case(tables))


def casing_forces() -> tuple[Row, ...]:
    """Inertia of the casing, and forces of feet, bearings and ring on it, at every line."""
    rows = list[Row]()
    text = "inertia less forces of {} on the casing, over the largest, {:g} of the speed"
    pair, set_ = pair_in_a_casing(), planets_in_a_casing()
    stages = pair.model.stages[0], set_.model.stages[0]
    drives = stage_excitation(pair.contacts["stage"]), synthetic_excitation(set_, stages[1])
    for state, stage, drive in zip((pair, set_), stages, drives, strict=True):
        name, what = f"{'planetary stage' if stage.planets else 'pair'} in a casing", "feet and bearings"
        what = "feet, bearings and ring" if stage.planets else what
        for factor in (0.4, 1.0, 2.3):
            rows.append(at_most(name, "balance", text.format(what, factor), 1e-9, out_of_balance(state, drive, factor)))
    return tuple(rows)


def out_of_balance(state: Deflection, drive, factor: float) -> float:
    """Largest force that is left on the casing, over the largest one on it, at a multiple of the speed."""
    stage, outputs = state.model.stages[0], output_rows(state)
    structured = running_stage(state, stage, drive)
    single, motion = structured.running, structured.motion
    mesh = 2.0 * np.pi * state.model.flow.mesh_frequency[stage.name] * factor
    carrier = abs(state.model.flow.speed[stage.section.carrier]) * factor if stage.planets else 0.0
    bands = 6 if stage.planets else 0
    response = solve_running(single, mesh, carrier, harmonics=(3, 8), side_bands=bands, tolerance=1e-13)
    grid = grid_of(response)
    place, bearings, feet = (np.moveaxis(response.modal @ (rows @ motion).T, 2, 0) for rows in outputs)
    inertia = -MASS * response.frequency**2 * place
    # rows with a loss factor are those of frequencies above zero
    middle = len(response.band) // 2
    for lines in (bearings, feet):
        lines[:, 0, :middle] = lines[:, 0, :middle:-1].conj()
    on_casing = sum(feet.reshape(-1, 3, *inertia.shape[1:])) - sum(bearings.reshape(-1, 3, *inertia.shape[1:]))
    forces = grid.field(on_casing)
    if stage.planets:
        forces = forces + ring_force(state, single, response, grid)
    left = grid.field(inertia) - forces
    return float(np.abs(left).max() / np.abs(forces).max())


def ring_force(state: Deflection, stage: RunningStage, response: RunningResponse, grid: Grid) -> np.ndarray:
    """Force (3, periods, turns) of all ring meshes along x, y, z [N], every planet where the first one was before."""
    box = state.model.stages[0]
    count, angles = len(box.planets), np.asarray(box.angles)
    normal = state.model.assembly.contacts[box.meshes[count]].normals[1]
    lines, bands = response.force.shape[2:]
    total = np.zeros((3, grid.periods, grid.turns))
    for psi in angles - angles[0]:
        order = stage.paths.z_ring * np.arange(lines)[:, None] + np.arange(bands) - bands // 2
        force = grid.field(response.force[0, 1] * np.exp(1j * stage.sense * order * psi))
        phi = psi + stage.sense * grid.turn
        total[0] += (np.cos(phi) * normal[0] - np.sin(phi) * normal[1]) * force
        total[1] += (np.sin(phi) * normal[0] + np.cos(phi) * normal[1]) * force
        total[2] += normal[2] * force
    return total
