"""Two stages whose stiffness fluctuates at once, and what solving them one after the other leaves out."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from small_gearbox import pair_tables

from femgear.case.dependencies import Steps
from femgear.housing.two_way.running_planets import RunningStage, solve_running
from femgear.trains.gearbox.deflection import Deflection, solve_deflection
from femgear.trains.gearbox.modes import linear_system
from femgear.trains.gearbox.response import GearboxResponse, solve_gearbox_response
from femgear.trains.gearbox.stage_structure import running_stage, stage_excitation
from femgear.trains.reading import read_case
from validation.reference.stages_at_once import MeshedStructure, MeshSignals, approaches_at_once, common_lines
from validation.rows import Row, at_most, information

AT_ONCE = "both stages in one linear system, validation.reference.stages_at_once"
SPEEDS = (700.0, 1000.0, 1300.0, 1600.0, 2000.0, 2500.0, 3200.0, 4000.0)
"""Of the input shaft [rpm]."""
MORE_SPEEDS = (500.0, *SPEEDS, 600.0, 900.0, 1100.0, 1400.0, 1750.0, 2250.0, 2750.0, 3500.0, 3750.0, 4500.0, 5000.0)
"""Of the input shaft [rpm], for `any_phase`."""
PHASES = 6
"""Places in the period of the other mesh at which gears may be mounted."""
RPM = math.pi / 30.0
SECOND = {(36, 48): (1, 1), (24, 40): (3, 2), (20, 43): (9, 5)}
"""Teeth of the second pair, and both mesh frequencies over their common one, beside a first pair of 24/36."""


def two_pairs(teeth: tuple[int, int]) -> dict[str, Any]:
    """Tables of a first pair of 24/36 and a second one with its teeth, on three shafts; meshes of one slice."""
    tables = pair_tables(teeth=True)
    last = {"name": "last", "axis": [f"{90.0 + 1.5 * sum(teeth)!r} mm", "0 mm"]}
    tables["shaft"].append(last | {"part": [{"length": "90 mm", "outer_diameter": "45 mm"}]})
    for name, place, axial in (("E", "5 mm", {"axial": "1e8 N/m"}), ("F", "85 mm", {})):
        tables["bearing"].append({"name": name, "shaft": "last", "position": place, "radial": "2e8 N/m"} | axial)
    second = copy.deepcopy(tables["pair"][0])
    second |= {"name": "second", "shafts": ["output", "last"], "positions": ["62 mm", "62 mm"]}
    second["teeth"]["gear_1"] |= {"teeth": teeth[0], "bore_radius": "20 mm"}
    second["teeth"]["gear_2"] |= {"teeth": teeth[1]}
    second["teeth"]["operation"] = {"torque": "150 N m"}
    tables["pair"].append(second)
    tables["load"][1] |= {"shaft": "last"}
    return tables | {"deflection": {"slices": 1}, "dynamics": {"up_to": "6 kHz"}}


def rms(lines: np.ndarray) -> float:
    """R.m.s. value of two-sided lines (L,) without the mean."""
    return float(np.sqrt((np.abs(np.delete(lines, len(lines) // 2)) ** 2).sum()))


@dataclass(frozen=True)
class LeftOut:
    """A stage at a speed, beside both at once.

    Parameters
    ----------
    alone : float
        Difference of its mesh force from `solve_running`, over the largest line, the other mesh with its mean.
    estimate : float
        Force that is left out by `cross_excitation`, over the exact one.
    share : float
        That estimate over the r.m.s. of the mesh force.
    level : float
        Change of the r.m.s. of the mesh force, of both stages one after the other, by solving them at once.
    """

    alone: float
    estimate: float
    share: float
    level: float


@dataclass(frozen=True)
class TwoStages:
    """Two pairs, each as a stage in its structure and both as a whole.

    Parameters
    ----------
    state : Deflection
        Loaded state.
    response : GearboxResponse
        At the speeds.
    stages : tuple of RunningStage
        The pairs.
    structure : MeshedStructure
        Of both.
    multiples : tuple of int
        Mesh frequencies over their common one.
    """

    state: Deflection
    response: GearboxResponse
    stages: tuple[RunningStage, ...]
    structure: MeshedStructure
    multiples: tuple[int, int]

    def base(self, i: int) -> float:
        """Common mesh frequency at a speed by its number [rad/s]."""
        flow = self.state.model.flow
        ratio = self.response.speed[i] / abs(flow.speed[self.response.reference])
        return 2.0 * math.pi * flow.mesh_frequency["stage"] * ratio / self.multiples[0]

    def signals(self, i: int) -> MeshSignals:
        """Lines of both meshes with as many harmonics as the response has at a speed."""
        counts = [int(stage.harmonics[i]) for stage in self.response.stages]
        highest = max(count * multiple for count, multiple in zip(counts, self.multiples, strict=True))
        lines = []
        for name in ("stiffness", "deflection", "force"):
            records = [getattr(stage.excitation, name) for stage in self.stages]
            parts = zip(records, counts, self.multiples, strict=True)
            lines.append(np.vstack([common_lines(*part, highest) for part in parts]))
        return MeshSignals(*lines)

    def mesh_forces(self, signals: MeshSignals, i: int) -> tuple[np.ndarray, np.ndarray]:
        """Two-sided lines (2, L) of the mesh forces, and of what they are beyond the mean stiffness."""
        approach, pressed = approaches_at_once(self.structure, signals, self.base(i))
        middle = approach.shape[1] // 2
        loss = 1.0 + 1j * self.structure.loss * np.sign(np.arange(-middle, middle + 1))
        return pressed + signals.stiffness[:, [middle]].real * loss * approach, pressed


def solve_two_stages(teeth: tuple[int, int], speeds: Sequence[float] = SPEEDS) -> TwoStages:
    """Solve a first pair of 24/36 and a second one with its teeth at speeds of the input shaft [rpm]."""
    steps = Steps()
    state = solve_deflection(read_case(two_pairs(teeth)), steps=steps)
    stages = [
        running_stage(state, stage, stage_excitation(state.contacts[stage.name], steps=steps)).running
        for stage in state.model.stages
    ]
    response = solve_gearbox_response(state, RPM * np.array(speeds), steps=steps)
    system, loss = linear_system(state)[1], 2.0 * state.model.case.modes.damping_ratio
    structure = MeshedStructure(system.M, system.K, system.W, loss)
    return TwoStages(state, response, tuple(stages), structure, SECOND[teeth])


def left_out(pairs: TwoStages, i: int) -> Iterator[LeftOut]:
    """What either stage leaves out at a speed by its number."""
    signals, response = pairs.signals(i), pairs.response
    at_once, pressed = pairs.mesh_forces(signals, i)
    single = [pairs.mesh_forces(signals.without([1 - a]), i) for a in (0, 1)]
    one_by_one = single[0][0] + single[1][0]
    for a in (0, 1):
        exact = rms(pressed[a] - single[a][1][a])
        share = float(response.cross_excitation[i, a, 1 - a])
        estimate = float(share * response.dynamic_forces[i, a, 0] / exact)
        level = rms(at_once[a]) / rms(one_by_one[a]) - 1.0
        yield LeftOut(apart_alone(pairs, a, i), estimate, share, level)


def apart_alone(pairs: TwoStages, a: int, i: int) -> float:
    """Difference of the mesh force of a stage alone from `solve_running`, over its largest line."""
    signals = pairs.signals(i).without([1 - a])
    middle = signals.stiffness.shape[1] // 2
    mean = signals.stiffness.copy()
    mean[1 - a, middle] = linear_system(pairs.state)[2][1 - a]
    wanted = pairs.mesh_forces(replace(signals, stiffness=mean), i)[0][a, middle:]
    multiple = pairs.multiples[a]
    options = {"harmonics": (int(pairs.response.stages[a].harmonics[i]), middle // multiple), "tolerance": 1e-13}
    force = solve_running(pairs.stages[a], multiple * pairs.base(i), 0.0, side_bands=0, **options).force[0, 0, :, 0]
    coefficients = np.zeros(middle + 1, complex)
    coefficients[: multiple * len(force) : multiple] = force
    return float(np.abs(coefficients - wanted)[1:].max() / np.abs(force[1:]).max())


def two_stages() -> tuple[Row, ...]:
    """The estimate of what the stiffness of a stage does on the motion by another one, beside both at once."""
    rows = list[Row]()
    for teeth, multiples in SECOND.items():
        name = f"24/36 and {teeth[0]}/{teeth[1]}, mesh frequencies {multiples[0]}:{multiples[1]}"
        pairs = solve_two_stages(teeth)
        cases = [case for i in range(len(SPEEDS)) for case in left_out(pairs, i)]
        text = "a stage alone: lines of its mesh force, largest difference over the largest"
        rows.append(at_most(name, AT_ONCE, text, 1e-9, max(case.alone for case in cases)))
        text = "force left out, estimate over exact, binary logarithm, largest of 8 speeds and both stages"
        rows.append(at_most(name, AT_ONCE, text, 1.0, max((math.log2(case.estimate) for case in cases), key=abs)))
        text = "estimate over r.m.s. of the mesh force, largest"
        rows.append(information(name, AT_ONCE, text, None, max(case.share for case in cases)))
        text = "change of the r.m.s. of the mesh force, both at once beside one after the other, largest"
        rows.append(information(name, AT_ONCE, text, None, max((case.level for case in cases), key=abs)))
    return tuple(rows)


def mounted_ahead(signals: MeshSignals, share: float) -> MeshSignals:
    """Let the second mesh run ahead by a share of the common period."""
    middle = signals.stiffness.shape[1] // 2
    ahead = np.exp(2j * math.pi * share * np.arange(-middle, middle + 1))
    turned = [
        np.vstack([lines[0], ahead * lines[1]]) for lines in (signals.stiffness, signals.deflection, signals.force)
    ]
    return MeshSignals(*turned)


def estimates_of_phases(pairs: TwoStages, i: int, a: int) -> tuple[float, np.ndarray]:
    """Estimate of what stage a leaves out at a speed by its number [N], and what it is for all phases (PHASES,) [N]."""
    exact = []
    for number in range(PHASES):
        signals = mounted_ahead(pairs.signals(i), number / PHASES / math.prod(pairs.multiples))
        pressed, alone = (pairs.mesh_forces(left, i)[1][a] for left in (signals, signals.without([1 - a])))
        exact.append(rms(pressed - alone))
    share = float(pairs.response.cross_excitation[i, a, 1 - a])
    return share * pairs.response.dynamic_forces[i, a, 0], np.array(exact)


def any_phase() -> tuple[Row, ...]:
    """The estimate beside what is left out for gears that are mounted anyhow: r.m.s. over all phases of the meshes."""
    rows = list[Row]()
    for teeth, multiples in [*SECOND.items()][:2]:
        name = f"24/36 and {teeth[0]}/{teeth[1]}, mesh frequencies {multiples[0]}:{multiples[1]}"
        pairs = solve_two_stages(teeth, MORE_SPEEDS)
        estimates = [estimates_of_phases(pairs, i, a) for i in range(len(MORE_SPEEDS)) for a in (0, 1)]
        every = [math.log2(estimate / rms_over(exact)) for estimate, exact in estimates]
        text = f"force left out, estimate over exact, binary logarithm, r.m.s. over phases, largest of {len(every)}"
        rows.append(at_most(name, AT_ONCE, text, 1.0, max(every, key=abs)))
        text = f"the same for one phase, lowest of {PHASES * len(every)}"
        rows.append(
            information(
                name, AT_ONCE, text, None, min(math.log2(estimated / most.max()) for estimated, most in estimates)
            )
        )
    return tuple(rows)


def rms_over(values: np.ndarray) -> float:
    """R.m.s. of values (n,)."""
    return float(np.sqrt((values**2).mean()))
