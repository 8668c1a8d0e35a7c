"""Vibration of a pair: closed forms, the pair of the impacts, integration in time, energy, units."""

import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.io import wavfile

from femgear import cli, open_results
from femgear.errors import CaseError, ConvergenceError
from femgear.stages.static import solve_static
from femgear.trains.pair import stages
from femgear.trains.pair.stages import solve_pair_dynamics, solve_pair_modes, solve_pair_runup
from femgear.trains.reading import read_case, to_toml, with_values
from femgear.trains.registry import stages_of

pytestmark = pytest.mark.usefixtures("pictures_undrawn", "coarse_states")

CASE = Path(__file__).parents[3] / "cases" / "spur_pair.toml"
PLAIN = {
    "static.positions": 16,
    "static.stresses": False,
    "set.backlash": "0.1 mm",
    "operation.speeds": ["1500 rpm", "7700 rpm", "15150 rpm"],
    "runup.count": 60,
}
BEARINGS = {"gear_1.bearing_stiffness": "8e8 N/m", "gear_2.bearing_stiffness": "1e9 N/m"}


def pair_case(**changes):
    return with_values(read_case(CASE), {**PLAIN, **changes})


@cache
def solved(*changes):
    case = pair_case(**{k: list(v) if isinstance(v, tuple) else v for k, v in changes})
    modes = solve_pair_modes(case, solve_static(case))
    return case, modes, solve_pair_dynamics(case, modes)


@cache
def run_up():
    return solve_pair_runup(*solved()[:2])


@cache
def gears():
    return solved()[1].gears


@pytest.mark.parametrize("changes", [(), tuple(BEARINGS.items())], ids=["held", "bearings"])
def test_the_mean_mesh_force_carries_the_torque_at_every_speed(changes):
    case, modes, dynamics = solved(*changes)
    force = case.operation.torque / gears().gear_1.base_radius
    np.testing.assert_allclose(dynamics.motion.force[:, 0, 0], force, rtol=1e-7)
    # and the bearings what the mesh exerts on the gears, both along the line of action at rest
    mean = np.real(dynamics.motion.bearing[..., 0])
    np.testing.assert_allclose(mean[:, 1], force * np.tile(modes.model.normal, (3, 1)), rtol=1e-6)
    np.testing.assert_allclose(mean[:, 0], -mean[:, 1], rtol=1e-6)


HELICAL = (
    ("set.helix_angle", "20 deg"),
    ("set.centre_distance", "97 mm"),
    ("static.slices", 9),
    ("gear_1.tip_diameter", None),
    ("gear_2.tip_diameter", None),
)
CROWNED = (("static.slices", 9), ("gear_1.modifications", [{"kind": "lead crowning", "amount": "10 um"}]))


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    [(), HELICAL, CROWNED],
    ids=["spur", "helical", "crowned"],
)
def test_slow_gears_follow_the_static_solution(changes):
    case = pair_case(**dict(changes), **{"operation.speeds": ["30 rpm"], "static.positions": 64})
    static = solve_static(case)
    dynamics = solve_pair_dynamics(case, solve_pair_modes(case, static)).dataset()
    error = static.cycle.deflection[0]
    assert dynamics.dte_real.isel(harmonic=0).item() == pytest.approx(error.mean(), rel=5e-3)
    assert dynamics.dte_rms.item() == pytest.approx(error.std(), rel=5e-3)


def test_the_sign_of_the_torque_turns_time_around_at_rest_and_not_the_modes():
    (_, one, _), (_, two, _) = (solved(("operation.torque", t), *BEARINGS.items()) for t in ("200 N m", "-200 N m"))
    np.testing.assert_allclose(two.modes.frequency[1:], one.modes.frequency[1:], rtol=1e-6)
    np.testing.assert_allclose(two.model.normal, one.model.normal * [1.0, -1.0], rtol=1e-12)
    assert (two.model.system.load == -one.model.system.load).all()


def test_twice_the_size_under_eight_times_the_torque_at_half_the_speed():
    """Similar pairs of one material: stiffness and lengths times 2, frequencies a half, forces times 4."""
    sizes = {"set.module": 6, "set.face_width": 40, "set.centre_distance": 183, "gear_1.bore_radius": 30}
    sizes |= {"gear_2.bore_radius": 50, "set.backlash": 0.2}
    sizes |= {"gear_1.tip_diameter": 159.6, "gear_2.tip_diameter": 230.7572}
    large = {k: f"{v} mm" for k, v in sizes.items()}
    speeds = ("750 rpm", "3850 rpm", "7575 rpm")
    reach = "10 kHz"
    one = solved(("dynamics.up_to", "20 kHz"))[2]
    two = solved(
        *large.items(), ("operation.torque", "1600 N m"), ("operation.speeds", speeds), ("dynamics.up_to", reach)
    )[2]
    np.testing.assert_allclose(two.motion.dte, 2.0 * one.motion.dte, atol=1e-5 * abs(one.motion.dte).max())
    np.testing.assert_allclose(two.motion.peak, 4.0 * one.motion.peak, rtol=1e-5)


def test_the_branch_of_the_run_up_passes_through_the_operating_points():
    _, modes, dynamics = solved()
    data, expected = run_up().dataset(), dynamics.dataset().dte_rms[2].item()
    assert data.attrs["complete"] and data.attrs["separated"] and (data.branch_drive_contact < 1.0).any()
    turns = np.diff(np.sign(np.diff(data.branch_speed))) != 0
    assert turns.sum() == 2 and not data.branch_stable.all()
    speed, size = data.branch_speed.values, data.branch_dte_rms.values
    # straight lines between the points of the branch, where they pass the speed
    (passes,) = np.nonzero((speed[:-1] - 15150.0) * (speed[1:] - 15150.0) <= 0.0)
    there = [
        np.interp(0.0, (speed[i : i + 2] - 15150.0) * np.sign(speed[i + 1] - speed[i]), size[i : i + 2]) for i in passes
    ]
    assert min(there, key=lambda rms: abs(rms - expected)) == pytest.approx(expected, rel=0.01)
    strongest = data.resonance_alone.values.argmax()
    assert data.frequency[strongest] == pytest.approx(modes.modes.frequency[1])


def peaks(runup, dynamics):
    data = runup.dataset()
    return [data.dte_rms.max(), data.branch_dte_rms.max(), *dynamics.dataset().dte_rms.values]


@pytest.mark.slow
@pytest.mark.parametrize(
    "finer",
    [{"_LEAST": 32, "_ON_BRANCH": (32, 56)}, {"_STEPS": replace(stages._STEPS, largest=0.025)}],
    ids=["harmonics", "steps"],
)
def test_twice_the_harmonics_and_half_the_steps_leave_the_largest_amplitude(finer, monkeypatch):
    """Within 1 %: of the run-up with flanks held together, of the branch, and of the operating speeds."""
    case, modes, dynamics = solved()
    known = peaks(run_up(), dynamics)
    for name, value in finer.items():
        monkeypatch.setattr(stages, name, value)
    found = peaks(solve_pair_runup(case, modes), solve_pair_dynamics(case, modes))
    np.testing.assert_allclose(found, known, rtol=0.01)


def test_sound_of_a_pair_is_that_of_its_lines(tmp_path):
    changes = {"operation.speeds": ["1500 rpm"], "runup.count": 4, "dynamics.up_to": "4 kHz"}
    folder = tmp_path / "case.toml"
    folder.write_text(to_toml(pair_case(**changes)), encoding="utf-8")
    assert cli.main(["run", str(folder), "-o", str(tmp_path / "out"), "--no-pictures"]) == 0
    options = ["--wav", "--duration", "0.5", "--run-up", "0.3", "--force-scale", "1"]
    assert cli.main(["export", str(tmp_path / "out"), *options]) == 0
    found, data = tmp_path / "out" / "exported", open_results(tmp_path / "out").dynamics
    names = ["bearing_force_gear_1", "bearing_force_gear_2", "transmission_error"]
    known = [f"{name}_{end}.wav" for name in names for end in ("1500_rpm", "run_up")]
    assert sorted(one.name for one in found.iterdir()) == known
    rate, force = wavfile.read(found / "bearing_force_gear_2_1500_rpm.wav")
    assert force.std() == pytest.approx(data.bearing_rms[0, 1].item(), rel=1e-3)
    assert b"1.0 = 1 N" in (found / "bearing_force_gear_2_1500_rpm.wav").read_bytes()
    _, error = wavfile.read(found / "transmission_error_1500_rpm.wav")
    scale = float(re.search(rb"1\.0 = (\S+) m/s\^2", (found / "transmission_error_1500_rpm.wav").read_bytes())[1])
    harmonic = np.arange(data.sizes["harmonic"])
    dte = np.hypot(data.dte_real, data.dte_imag).values[0, 0]
    rms = np.sqrt(0.5 * ((2.0 * np.pi * 600.0 * harmonic) ** 4 * dte**2).sum())
    assert scale * error.std() == pytest.approx(rms, rel=1e-3) and abs(error).max() <= 1.0
    line = 2.0 * np.abs(np.exp(-2j * np.pi * 600.0 / rate * np.arange(len(error))) @ error) / len(error)
    assert scale * line == pytest.approx((2.0 * np.pi * 600.0) ** 2 * dte[1], rel=1e-3)
    assert cli.main(["export", str(tmp_path / "out"), "--uff"]) == 2


@pytest.mark.parametrize(
    ("changes", "only", "words"),
    [
        ({"operation.torque": "0 N m"}, "modes", "without torque"),
        ({"operation.speeds": None}, "dynamics", "no speed"),
        ({"gear_1.errors": {"runout_amplitude": "5 um"}}, "dynamics", "24 mesh periods"),
        ({"runup.count": 0}, "runup", "leaves it out"),
    ],
)
def test_stages_that_a_case_cannot_have(changes, only, words):
    with pytest.raises(CaseError, match=words) as found:
        stages_of(pair_case(**changes), only)
    assert found.value.code == "E-STAGE"


@pytest.mark.parametrize(
    ("changes", "code", "key"),
    [
        ({"gear_1.mass": "-1 kg"}, "E-RANGE", "gear_1.mass"),
        ({"gear_2.bearing_stiffness": "5 N"}, "E-UNIT", "gear_2.bearing_stiffness"),
        ({"motor.inertia": "1 kg m^2"}, "E-KEY-MISSING", "motor.coupling_stiffness"),
        ({"operation.speeds": ["10 rpm", "10 rpm"]}, "E-DUPLICATE", "operation.speeds"),
        ({"runup.to": "1 rpm"}, "E-RANGE", "runup.to"),
    ],
)
def test_refusals_name_the_entries(changes, code, key):
    with pytest.raises(CaseError) as found:
        pair_case(**changes)
    problems = getattr(found.value, "problems", ()) or (found.value,)
    assert (code, key) in [(one.code, one.key) for one in problems]


@pytest.mark.parametrize(("ratio", "key"), [(0.0, "dynamics.damping_ratio"), (0.01, "operation.speeds")])
def test_a_motion_that_is_not_found_names_what_to_change(monkeypatch, ratio, key):
    failed = SimpleNamespace(converged=False, message="", residual=1.0)
    monkeypatch.setattr(stages, "solve_harmonic_balance", lambda *_, **__: failed)
    problem: Any = None
    with pytest.raises(ConvergenceError) as found:
        stages._with_play(problem, 100.0, np.zeros((1, 2)), pair_case(**{"dynamics.damping_ratio": ratio}))
    assert found.value.key == key
