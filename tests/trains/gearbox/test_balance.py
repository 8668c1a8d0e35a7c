"""Teeth that part in a gearbox: balance of torques, the same motion by time integration, what the file says."""

import copy
from dataclasses import replace

import numpy as np
import pytest
from casings import casing_tables
from planet_gearboxes import in_casing, known_set, parting_set, planet_shaft, simple_set, stepped_set
from small_gearbox import loose_pair_tables, pair_tables, planetary_tables

from femgear.errors import CaseError
from femgear.run import solve
from femgear.solvers.periodic.harmonic_balance import displacements, solve_harmonic_balance
from femgear.solvers.time.transient import solve_transient
from femgear.system.system import MeshExcitation
from femgear.trains.gearbox.balance import (
    GearboxBalanceResult,
    StageBalance,
    balance_line_origin,
    balance_tables,
    check_balance,
    describe_balance,
    forces_of_bearings,
    forces_of_flanks,
    held_together,
    solve_balance,
)
from femgear.trains.gearbox.case_file import GearboxCase
from femgear.trains.gearbox.deflection import Deflection, solve_deflection
from femgear.trains.gearbox.excitation import excitation_of
from femgear.trains.gearbox.nonlinear import nonlinear_gearbox
from femgear.trains.gearbox.results import DeflectionResult
from femgear.trains.gearbox.silence import idle_entries, why_no_balance, why_silent
from femgear.trains.gearbox.stages import solve_box_balance, solve_deflections
from femgear.trains.gearbox_of_case import gearbox_of_case
from femgear.trains.reading import read_case, with_value
from femgear.trains.registry import check_case

pytestmark = pytest.mark.usefixtures("coarse_states")


def heavy_set(torque: str, **balance) -> Deflection:
    """Plane set with play and tooth pairs that come and go, under its weight."""
    mesh = {"stiffness": "3e8 N/m", "contact_ratio": 1.6, "backlash": "20 um"}
    tables = planetary_tables(sun_mesh=mesh, ring_mesh=mesh)
    tables["planetary"][0]["planet"]["bearing"] = {"radial": "3e8 N/m"}
    tables["operation"]["load_case"][0]["torque"] = {"sun": torque}
    tables |= {"motions": "plane", "gravity": {}, "balance": {"harmonics": 3, "side_bands": 3} | balance}
    return solve_deflection(read_case(tables))


def shaken(found: Deflection, amplitude: float) -> MeshExcitation:
    """Excitation of the stage at few positions, with a transmission error of one line [m]."""
    drive = excitation_of(found, found.model.stages[0])
    few = {name: getattr(drive, name)[:, ::64] for name in ("stiffness", "deflection", "force")}
    count = few["deflection"].shape[1]
    few["deflection"] = few["deflection"] + amplitude * np.cos(2.0 * np.pi * np.arange(count) / count)
    return replace(drive, **few)


def test_mesh_forces_of_planets_under_load_are_those_of_the_torque():
    found = heavy_set("100 N m", side_bands=1)
    (stage,) = solve_balance(found)
    assert stage.solution.converged and (stage.drive > 0.0).all() and not stage.back.any()
    radius = found.model.stages[0].sizes.base_radii[0]
    sums = stage.drive.mean(axis=(0, 1)).reshape(2, 3).sum(axis=1)
    assert sums == pytest.approx([100.0 / radius] * 2, rel=1e-8)
    # the weight loads planets unequally as they go round
    assert np.ptp(stage.drive.mean(axis=1)[:, 0]) > 1.0


def in_a_casing(**gravity) -> tuple[GearboxCase, DeflectionResult]:
    """Case and loaded state of a plane set whose carrier has play in a casing on uneven feet, with a sensor."""
    mesh = {"stiffness": "3e8 N/m", "contact_ratio": 1.6}
    tables = planetary_tables(sun_mesh=mesh, ring_mesh=mesh) | {"casing": casing_tables(), "motions": "plane"}
    tables["planetary"][0]["planet"]["bearing"] = {"radial": "3e8 N/m"}
    tables["bearing"][1] |= {"radial": "1e7 N/m"}
    tables["bearing"].append({"name": "loose", "shaft": "carrier", "radial": "5e8 N/m", "clearance": "10 um"})
    tables["sensor"] = [{"name": "top", "position": ["0.1 m", "0.2 m", "0 m"], "direction": [0, 1, 0]}]
    tables["balance"] = {"harmonics": 2, "side_bands": 4}
    case = read_case(tables | gravity)
    return case, solve_deflections(case)


def test_the_casing_feels_lines_at_multiples_of_the_planets_passing():
    data = solve_box_balance(*in_a_casing(gravity={"acceleration": "100 m/s^2"})).dataset()
    assert data["converged"].item() == 1.0 and 0.0 < data["bearing_largest"].max()
    lines = np.hypot(data["lines_real"], data["lines_imag"]).values[0]
    # three equal planets, wherever they stand, come round thrice a turn
    mesh = int(np.flatnonzero((data["harmonic"] == 1) & (data["turns"][:, 0] == 0))[0])
    order = np.rint(61.0 * data["line_frequency"].values / data["line_frequency"].values[mesh]).astype(int)
    assert lines[order % 3 != 0].max() < 1e-9 * lines.max()
    assert lines[(order % 3 == 0) & (order > 4)].min() > 1e-6 * lines.max()
    assert data["level_of_stage"].item() == pytest.approx(np.sqrt(0.5 * (lines**2).sum()), rel=1e-12)
    assert any(note.startswith("sensor top: ") for note in describe_balance(data).notes)
    (table,) = balance_tables(data)
    assert table.rows[0][1] == f"{lines.max():.4g}" and table.rows[0][2].startswith("set, mesh harmonic ")
    # what weight does thrice a turn, with no mesh in it
    assert any(row[2] == "weight, torque: 3 x carrier of set" for row in table.rows)
    assert balance_line_origin(data, mesh) == "set, mesh harmonic 1"


def two_sets(**balance) -> Deflection:
    """Two plane sets in series under weight, of which the second one alone excites."""
    tables = planetary_tables() | {"motions": "plane", "gravity": {}}
    first, second = tables["planetary"][0], copy.deepcopy(tables["planetary"][0])
    for stage in (first, second):
        stage["planet"]["bearing"] = {"radial": "3e8 N/m"}
        stage["gears"]["teeth"] = [20, 20, 61]
    first |= {"name": "slow", "sun": "carrier", "carrier": "slow carrier"}
    for mesh in ("sun_mesh", "ring_mesh"):
        second[mesh] = {"stiffness": "3e8 N/m", "contact_ratio": 1.6, "backlash": "20 um"}
    tables["planetary"] = [first, second]
    tables["shaft"].append({"name": "slow carrier"})
    tables["mass"].append({"shaft": "slow carrier", "mass": "20 kg", "inertia": "0.2 kg m^2"})
    tables["bearing"].append({"name": "loose", "shaft": "slow carrier", "radial": "5e8 N/m", "clearance": "10 um"})
    tables["operation"]["output"] = ["slow carrier"]
    return solve_deflection(read_case(tables | {"balance": {"harmonics": 1, "side_bands": 1} | balance}))


def test_stages_together_are_those_one_by_one_where_little_couples_them():
    found = two_sets(together=True)
    (alone,), (together, still) = solve_balance(two_sets()), solve_balance(found)
    assert alone.solution.converged and together.solution.converged
    assert (together.name, still.name) == ("set", "slow") and not len(still.harmonic)
    # a line of both carriers, the mean once, no line and its conjugate
    orders = together.solution.orders
    assert len(orders) == 1 + 2 + 5 and not orders[0].any() and not orders[1:, [0]].any(axis=1).all()
    assert len(np.unique(np.vstack([orders, -orders]), axis=0)) == 2 * len(orders) - 1
    mean = alone.drive.mean(axis=(0, 1))
    assert together.drive.mean(axis=(0, 1)) == pytest.approx(mean, rel=1e-3)
    assert together.uneven == pytest.approx(alone.uneven, rel=1e-2)
    # the slow set carries the torque that the other one gives on
    radius = next(stage for stage in found.model.stages if stage.name == "slow").sizes.base_radii[0]
    assert still.drive[..., :3].sum(axis=2).mean() == pytest.approx(100.0 * (1 + 61 / 20) / radius, rel=1e-2)
    # what the other stage excites reaches it
    assert np.ptp(still.drive, axis=1).max() > 1e-4 * still.drive.mean()
    data = GearboxBalanceResult((together, still), together=True).dataset()
    assert data.sizes["mesh"] == 12 and "all carriers turning" in describe_balance(data).notes[0]


@pytest.mark.slow
def test_teeth_part_under_a_small_torque_and_the_torque_stays():
    found = heavy_set("0.1 N m", harmonics=2, side_bands=1)
    (stage,) = solve_balance(found)
    result = GearboxBalanceResult((stage,))
    data = result.dataset()
    assert result.converged and result.residual < 1e-9
    assert data["parted_share"].values.max() > 0.05
    radius = found.model.stages[0].sizes.base_radii[0]
    # forces are evaluated between the lines, of which there are few
    assert data["mean_force"].values[:3].sum() == pytest.approx(0.1 / radius, rel=2e-2)
    assert {finding.code for finding in result.warnings(data)} >= {"W-SEPARATION"}
    block = describe_balance(data)
    assert len(block.rows) == 6


def test_unequal_planets_are_refused_before_a_run_where_teeth_may_part():
    mesh = {"stiffness": "3e8 N/m", "contact_ratio": 1.6}
    tables = planetary_tables(sun_mesh=mesh, ring_mesh=mesh)
    tables["planetary"][0]["gears"] |= {"planets": 2, "teeth": [20, 20, 60]}
    check_balance(read_case(tables))
    with pytest.raises(CaseError) as error:
        check_balance(read_case(tables | {"balance": {"harmonics": 1}}))
    assert error.value.code == "E-TURNING" and error.value.key == "planetary[0]"


def test_a_balance_of_meshes_that_nothing_excites_is_told_to_have_no_effect():
    case = read_case(planetary_tables() | {"balance": {"harmonics": 1}})
    assert [(finding.code, finding.key) for finding in idle_entries(case)] == [("W-UNUSED", "balance")]


def test_a_pair_that_parts_is_met_in_time():
    tables = pair_tables() | {"motions": "rotation"}
    tables["pair"][0]["mesh"] |= {"backlash": "40 um", "contact_ratio": 1.6}
    tables["mass"] = [
        {"shaft": "input", "mass": "1 kg", "inertia": "2e-3 kg m^2", "position": "30 mm"},
        {"shaft": "output", "mass": "1 kg", "inertia": "5e-3 kg m^2", "position": "30 mm"},
    ]
    found = solve_deflection(read_case(tables))
    drive = excitation_of(found, found.model.stages[0])
    drive = replace(drive, stiffness=drive.stiffness[:, ::64], deflection=drive.deflection[:, ::64])
    drive = replace(drive, force=drive.force[:, ::64])
    box = nonlinear_gearbox(found, {"stage": drive}, harmonics=4, damping_ratio=0.04)
    linear, omega = held_together(box), 2.0 * np.pi * 1700.0
    options = {"harmonics": 96, "stability": False, "radius": False, "samples": 8192}
    held = solve_harmonic_balance(linear, omega, **options)
    solution = solve_harmonic_balance(box.problem, omega, start=held, **options)
    force, back = forces_of_flanks(box, solution)
    assert solution.converged and 0.02 < (force == 0.0).mean() and back.shape == force.shape
    lines, order = displacements(box.problem, solution), np.arange(97)
    start = lines.sum(axis=1).real, (1j * omega * order * lines).sum(axis=1).real
    times = np.linspace(0.0, 4.0 * np.pi / omega, 65)
    motion = solve_transient(box.problem, omega, times, start=start, method="DOP853", tolerance=1e-10, events=True)
    wanted = solution.at(times)[:, 0]
    assert np.abs(motion.deflection[:, 0] - wanted).max() < 1e-6 * np.ptp(wanted)


def test_a_bearing_that_loses_its_load_is_met_in_time():
    found = solve_deflection(read_case(loose_pair_tables("20 um", weight="28 kg")))
    # weight and mesh nearly balance: little is left for the bearing
    assert np.hypot(*found.bearing_force[1, :2]) < 0.4 * 28.0 * 9.81
    drive, omega, harmonics = shaken(found, 5e-6), 2.0 * np.pi * 250.0, 48
    box = nonlinear_gearbox(found, {"stage": drive}, harmonics=2, damping_ratio=0.05, separates=False)
    options = {"harmonics": harmonics, "samples": 4096, "stability": False, "radius": False}
    solution = solve_harmonic_balance(box.problem, omega, **options)
    force, loose = forces_of_flanks(box, solution)[0], forces_of_bearings(box, solution)
    assert solution.converged and force.min() > 0.0 and 0.4 < (loose == 0.0).mean() < 0.6
    lines, order = displacements(box.problem, solution), np.arange(harmonics + 1)
    start = lines.sum(axis=1).real, (1j * omega * order * lines).sum(axis=1).real
    times = np.linspace(0.0, 4.0 * np.pi / omega, 65)
    motion = solve_transient(box.problem, omega, times, start=start, method="DOP853", tolerance=1e-10)
    wanted = solution.at(times)
    assert (np.abs(motion.deflection - wanted).max(axis=0) < 1e-6 * np.ptp(wanted, axis=0)).all()
    stage = StageBalance("stage", box.stages[0].meshes, solution, force, 0.0 * force, tuple(box.bearings), loose)
    data = GearboxBalanceResult((stage,)).dataset()
    assert data["bearing"].values.tolist() == ["C"] and data["bearing_lowest"].item() == 0.0
    assert data["bearing_loose"].item() == pytest.approx((loose == 0.0).mean())
    assert any("bearing C carries 0 N to" in note for note in describe_balance(data).notes)


def test_weight_alone_moves_planets_of_a_given_stiffness_as_in_the_planar_set():
    case = with_value(read_case("cases/nrel_pgb.toml"), "planar.response.carrier_harmonics", 2)
    response = solve(case, only="response")["response"].dataset()
    weight = np.hypot(response["mesh_force_real"], response["mesh_force_imag"]).values[0, :, 1]
    # the damping of a gearbox acts on motions of the set with its carrier too, that of the planar set does not
    entries = {"balance": {"harmonics": 1, "side_bands": 2}, "modes": {"damping_ratio": 0.0}}
    box = read_case(gearbox_of_case(case).tables | entries)
    assert not why_no_balance(box) and why_silent(box)
    data = solve(box, only="balance")["balance"].dataset()
    largest = (data["largest_force"] - data["mean_force"]).values
    # at the angles of the carrier that are looked at
    assert largest == pytest.approx(weight, rel=2e-3)
    assert data["mean_force"].values == pytest.approx(response["mesh_force_real"].values[0, :, 0], rel=1e-5)
    still = gearbox_of_case(case).tables
    del still["gravity"]
    assert why_no_balance(read_case(still | {"balance": {"harmonics": 1}}))


@pytest.mark.parametrize("torque", [4.0, pytest.param(-4.0, marks=pytest.mark.slow)])
def test_planets_that_are_shafts_part_as_those_of_a_planetary_stage(torque):
    """All meshes of one frequency excite at once, and go round with the carrier."""
    ((shafts,), (stage,)) = (solve_balance(parting_set(make, torque=torque)) for make in (simple_set, known_set))
    assert shafts.name == "sun-0..2, 0..2-ring" and shafts.solution.converged and stage.solution.converged
    # with the other torque all teeth carry
    assert (stage.drive.min() == 0.0) == (torque > 0.0)
    np.testing.assert_allclose(shafts.drive, stage.drive, rtol=0.0, atol=1e-9 * stage.drive.max())
    apart = np.abs(shafts.acceleration - stage.acceleration).max()
    assert apart < 1e-9 * np.abs(stage.acceleration).max()


def test_a_stepped_set_has_a_balance_of_each_of_its_frequencies():
    tables = stepped_set()
    for stage in tables["pair"]:
        stage["mesh"] |= {"contact_ratio": 1.63, "low_share": 0.8, "backlash": "20 um"}
    found = solve_deflection(read_case(in_casing(tables) | {"balance": {"harmonics": 2, "side_bands": 1}}))
    solved = {stage.name: stage for stage in solve_balance(found)}
    assert list(solved) == ["0..2-ring", "sun-0..2"]
    for stage, static in zip(solved.values(), (found.mesh_force[3:], found.mesh_force[:3]), strict=True):
        assert stage.solution.converged and len(stage.meshes) == 3
        np.testing.assert_allclose(stage.drive.mean(axis=(0, 1)), static, rtol=1e-3)
        np.testing.assert_allclose(stage.uneven, stage.uneven[0], rtol=1e-9)


def test_planets_with_errors_are_refused_where_teeth_part_and_nowhere_else():
    tables = simple_set(mesh={"stiffness": "3e8 N/m", "contact_ratio": 1.6}) | {"balance": {"harmonics": 2}}
    planet_shaft(tables, 1)["pin_error"] = {"tangential": "3 um"}
    case = read_case(tables)
    check_case(case, "deflection")
    with pytest.raises(CaseError) as error:
        check_case(case, "balance")
    assert (error.value.code, error.value.key) == ("E-TURNING", "balance.harmonics")
