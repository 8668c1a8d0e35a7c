"""Models of sets of rigid bodies for other programs: torques, rotations and what turns the input."""

from pathlib import Path

import numpy as np
import pytest

from femgear.case.gear_set import planetary_set
from femgear.run import dynamic_model
from femgear.solvers.linear.state_space import state_space
from femgear.stages.lumped_set import member_speeds
from femgear.trains.reading import read_case, with_values

CASES = Path(__file__).parents[2] / "cases"
HELICAL = {"helical.mesh_stiffness": {"sun_planet": "2e8 N/m", "planet_ring": "3e8 N/m"}, "static": None}
PLANAR = {"planar.gravity": None, "planar.branch": None, "planar.response": None, "planar.published": None}
PLANAR |= {"planar.back_flanks": False, "planar.reaction": "output", "planar.torsion.sun": None}


def case_of(name, changes):
    return with_values(read_case(CASES / f"{name}.toml"), changes)


@pytest.mark.parametrize(("name", "changes"), [("helical_30_20_70", HELICAL), ("nrel_pgb", PLANAR)])
def test_torques_rotations_and_frequencies(name, changes):
    case = case_of(name, changes)
    model, turning = dynamic_model(case), member_speeds(case, planetary_set(case))
    space, operation = state_space(model.modal), case.operation
    driven = operation.input
    output = "carrier" if driven == "sun" else "sun"
    assert [port.name for port in model.modal.inputs] == [f"torque on {driven}", f"torque on {output}"]
    ratio = getattr(turning, output) / getattr(turning, driven)
    assert model.modal.nominal == pytest.approx([operation.torque, -operation.torque / ratio], rel=1e-9)
    named = dict(zip([port.name for port in model.modal.outputs], model.ratios, strict=True))
    assert named[f"{driven}: rotation"] == pytest.approx(1.0, rel=1e-9)
    assert named[f"{output}: rotation"] == pytest.approx(ratio, rel=1e-6)
    assert model.modal.outputs[model.driver].name == f"{driven}: rotation"
    poles = np.linalg.eigvals(space.A)
    assert np.sort(np.abs(poles))[-1] == pytest.approx(model.modal.omega[-1], rel=1e-9)
    # at rest under its torques every mesh has the force of its share
    states = np.array(-space.A)
    states[len(states) // 2, 0] += 1.0
    forces = (space.C @ np.linalg.solve(states, space.B @ space.nominal) + space.D @ space.nominal)[
        len(model.modal.meshes) : 2 * len(model.modal.meshes)
    ]
    N, sun = case.set.planets, operation.torque if driven == "sun" else -operation.torque / ratio
    beta = 0.0 if name == "nrel_pgb" else case.helical.helix_angle
    cosine = np.cos(np.arcsin(np.sin(beta) * np.cos(case.sun.pressure_angle)))
    radius = planetary_set(case).sun.base_radius
    assert forces == pytest.approx(np.full(2 * N, abs(sun) / (N * radius * cosine)), rel=1e-3)
