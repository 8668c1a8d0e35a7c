"""Run-up of the reference set: the numbers of the other stages at their speeds, resonances, peaks."""

from pathlib import Path

import numpy as np
import pytest
from steels import NO_STEELS

from femgear.case.gear_set import planetary_set
from femgear.case.quantities import RPM
from femgear.errors import CaseError
from femgear.findings import Finding, as_text, findings_in, once
from femgear.housing.orders import order_level
from femgear.report.explorer import explorer
from femgear.report.style import excited_to
from femgear.report.tables import Marks, describe_response
from femgear.report.waterfall import campbell_diagram, draw_order_cuts, runup_levels, waterfall
from femgear.solvers.linear.resonances import unresolved
from femgear.stages.protocol import Drawn
from femgear.stages.static import solve_static, solve_stress
from femgear.stages.static_results import describe_stress
from femgear.storage.results import Manifest, Results
from femgear.system.fourier import fluctuation, sample
from femgear.trains.elastic.checks import runup_ends
from femgear.trains.elastic.results import describe_housing, level_changes, level_doubts, verdict
from femgear.trains.elastic.runup import describe_runup, loudest, runup_warnings
from femgear.trains.elastic.stages import ELASTIC, solve_dynamics, solve_housing, solve_modes, solve_runup
from femgear.trains.reading import parse_case, read_case, to_toml, with_value, with_values
from femgear.trains.registry import check_case, stages_of

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def case():
    changes = {"static.flank_elements": 8, "runup.from": "900 rpm", "runup.to": "3500 rpm", "runup.count": 60}
    return with_values(read_case(ROOT / "cases" / "planetary_27_40_108.toml"), changes | NO_STEELS)


@pytest.fixture(scope="module")
def static(case):
    return solve_static(case)


@pytest.fixture(scope="module")
def modes(case, static):
    return solve_modes(case, static)


@pytest.fixture(scope="module")
def found(case, modes):
    return solve_runup(case, modes)


@pytest.fixture(scope="module")
def data(found):
    return found.dataset()


def test_at_its_speeds_it_is_the_dynamics_and_the_housing(case, static, modes, found):
    chosen = [0, 20, len(found.input_speed) - 1, int(np.argmin(np.abs(found.input_speed / RPM - 3100.0)))]
    speeds = [f"{float(found.input_speed[i])!r} rad/s" for i in chosen]
    same = with_values(case, {"operation.speeds": speeds, "housing.published": None})
    dynamics = solve_dynamics(same, static, modes)
    level = order_level(solve_housing(same, dynamics).exact)
    assert found.response.level[chosen] == pytest.approx(level, rel=1e-9)
    assert found.excitation_limit[chosen] == pytest.approx(dynamics.excitation_limit, rel=1e-12)
    force = dynamics.response.force
    peak = sample(force, 4 * force.shape[-1]).max(axis=-1)
    for kind, own in enumerate((slice(3), slice(3, 6))):
        assert found.response.force_rms[chosen, kind] == pytest.approx(fluctuation(force)[:, own].max(axis=1), rel=1e-9)
        # instants of another number of harmonics
        assert found.response.force_peak[chosen, kind] == pytest.approx(peak[:, own].max(axis=1), rel=1e-3)
    assert np.isclose(found.input_speed / RPM, 3100.0).any()


def test_level_is_the_root_mean_square_of_the_lines(found, data):
    lines = data["lines_real"].values + 1j * data["lines_imag"].values
    assert np.sqrt(0.5 * (np.abs(lines) ** 2).sum(axis=1)) == pytest.approx(data["level"].values, rel=1e-5)
    # three planets in phase: multiples of three alone
    assert not (found.response.order % 3).any()


def test_equal_planets_in_phase_are_excited_in_rotational_modes_alone(data):
    """Of ring modes those of 0, 3, 6, .. nodal diameters; harmonic 4 lies on mode 15 at 3100 rpm."""
    kinds = {str(kind).removeprefix("ring, ") for kind in data["kind"].values}
    assert kinds == {"rotational"} and not (data["nodal_diameter"].values[data["mode"] > 3] % 3).any()
    own = (data["mode"] == 15) & (data["mesh_harmonic"] == 4)
    assert int(own.sum()) == 1
    assert abs(float(data["distance"][own.values].item())) < 0.5
    assert float(data["operating_speed"][own.values].item()) == pytest.approx(3100.0)
    assert float(data["frequency"][own.values].item()) == pytest.approx(4464.0, rel=5e-3)


def test_the_antisymmetric_ring_mode_has_its_nodes_at_the_meshes(modes, data):
    """A rule of kinds and diameters alone would list this one of the two modes of three diameters."""
    near = np.flatnonzero((modes.modes.nodal_diameter == 3) & (modes.modes.frequency < 5e3))
    kinds = [modes.modes.kind[i] for i in near]
    listed = set(data["mode"].values - 1)
    left_out = [i for i in near if i not in listed]
    assert len(left_out) == 1 and kinds[list(near).index(left_out[0])] == "ring, rotational"
    assert np.abs(modes.modes.mesh_deflection[:, left_out[0]]).max() < 1e-6 * np.abs(modes.modes.mesh_deflection).max()


def test_the_strongest_resonances_are_of_the_size_of_the_level(data):
    alone, level = data["resonance_alone"].values, data["resonance_level"].values
    strongest = np.argsort(-alone)[:10]
    assert (alone[strongest] < 1.5 * level[strongest]).all() and (alone[strongest] > 0.05 * level[strongest]).all()
    block = describe_runup(data)
    assert len(block.rows) == 12 and all(len(row) == len(block.header) for row in block.rows)


def test_meshes_that_pull_are_told_of(data):
    assert list(runup_warnings(data)) == []
    pulling = data.copy(deep=True)
    pulling["lowest_force"][3:6] = [-100.0, -250.0, -50.0]
    (finding,) = runup_warnings(pulling)
    first, last = (float(data["speed"][i]) for i in (3, 5))
    assert finding.code == "W-PULL" and f"from {first:.6g} to {last:.6g} rpm" in str(finding)
    assert "0.25 kN" in str(finding) and "3 of " in str(finding)


def test_a_narrow_peak_between_two_speeds_is_found(case, static):
    """Damping 0.2 %: a peak is 12 rpm wide, the steps are 100 rpm; against steps of 2 rpm around it."""
    light = with_values(
        case,
        {
            "dynamics.damping_ratio": 0.002,
            "dynamics.up_to": "8 kHz",
            "runup.from": "2000 rpm",
            "runup.to": "3000 rpm",
            "runup.count": 11,
        },
    )
    modes = solve_modes(light, static)
    found = solve_runup(light, modes)
    peak = found.input_speed[found.response.level.argmax()] / RPM
    window = {"runup.from": f"{peak - 30} rpm", "runup.to": f"{peak + 30} rpm", "runup.count": 121}
    dense = solve_runup(with_values(light, window), modes)
    assert found.response.level.max() == pytest.approx(dense.response.level.max(), rel=0.05)
    coarse = np.isin(np.round(found.input_speed / RPM, 6), np.linspace(2000, 3000, 11))
    assert found.response.level[coarse].max() < 0.7 * found.response.level.max()


def test_default_ends_and_refusals(case):
    default = with_value(case, "runup", None)
    assert np.array(runup_ends(default)) / RPM == pytest.approx([200.0, 3875.0])
    one = with_values(default, {"operation.speeds": ["3100 rpm"], "housing.published": None})
    assert np.array(runup_ends(one)) / RPM == pytest.approx([775.0, 3875.0])
    with pytest.raises(CaseError, match="ends where it begins") as error:
        with_values(case, {"runup.from": "3500 rpm"})
    assert error.value.key == "runup.to" and error.value.limit == "above 3500 rpm"
    text = to_toml(with_value(case, "runup", None)) + '\n[runup]\nfrom = "4000 rpm"\n'
    with pytest.raises(CaseError) as error:
        parse_case(text, name="a.toml")
    line = 1 + text[: text.index('from = "4000 rpm"')].count("\n")
    assert error.value.key == "runup.from" and error.value.file == f"a.toml:{line}"
    assert error.value.value == "4000 rpm" and error.value.limit == "below 3875 rpm" and error.value.remedy
    with pytest.raises(CaseError) as error:
        check_case(with_values(case, {"runup.to": "300000 rpm"}))
    assert error.value.key == "runup.to" and error.value.code == "E-RANGE"


def test_a_count_of_zero_leaves_it_out(case):
    off = with_value(case, "runup.count", 0)
    assert [stage.name for stage in stages_of(off)][-1] == "housing"
    with pytest.raises(CaseError, match=r"runup.count is 0"):
        stages_of(off, "runup")


def test_peaks_between_the_speeds_are_counted():
    speeds, resonance, heard = np.array([90.0, 100.0, 110.0]), np.array([95.0, 100.0, 105.0]), np.ones(3)
    # half the half width of the peaks: 5 % of 0.5 times 95 is 2.4, the next speed is 5 away
    assert unresolved(speeds, resonance, heard, np.full(3, 0.05)) == 2
    assert unresolved(speeds, resonance, heard, np.full(3, 0.12)) == 0
    assert unresolved(speeds, resonance, np.array([1.0, 1.0, 0.01]), np.full(3, 0.05)) == 1
    assert unresolved(speeds, resonance, heard, np.zeros(3)) == 0


LIMITS = {"material.root_stress_limit": "430 MPa", "material.contact_stress_limit": "1500 MPa"}


@pytest.fixture(scope="module")
def files(case, static, modes, found):
    """Contents of the files of a run with limits, which decide no stage."""
    strong = with_values(case, LIMITS)
    dynamics = solve_dynamics(strong, static, modes)
    return {
        "static": static.dataset(),
        "stress": solve_stress(strong, static).dataset(),
        "modes": modes.dataset(),
        "dynamics": dynamics.dataset(),
        "housing": solve_housing(strong, dynamics).dataset(),
        "runup": found.dataset(),
    }


def results_of(case, files) -> Results:
    names = Manifest(complete=True, files={f"{name}.nc": "" for name in files})
    results = Results(Path(), names, lambda path: case).with_known(files)
    vars(results)["case"] = case
    return results


def told_of(case, files) -> tuple[dict[str, str], str]:
    """Rows and notes of the first table of the verdict."""
    first = next(verdict(results_of(with_values(case, LIMITS), files)))
    return dict(first.rows), " | ".join(first.notes)


def test_the_verdict_states_factors_stresses_and_what_they_assume(case, files, found):
    """K_v and safeties against the numbers that they come from; the run-up after the operating points."""
    strong = with_values(case, LIMITS)
    check_case(strong)
    first, rated, points, near = verdict(results_of(strong, files))
    assert rated.title == "Strength, ISO 6336:2019" and len(rated.rows) == 4
    told, notes = dict(first.rows), " | ".join(first.notes)
    assert "S_F = 2 sigma_Flim Y_M/(sigma_F0 K_gamma K_v): sigma_Flim = 430 MPa of ISO 6336-5" in notes
    assert "S_H = sigma_Hlim/(Z sigma_H0 sqrt(K_gamma K_v)): sigma_Hlim = 1500 MPa of ISO 6336-5" in notes
    assert "Y_M = 0.7 for planets" in notes and "not computed" not in notes
    assert first.notes[0] == "teeth and pins without errors"
    assert "static.members" not in notes and "at one instant" not in notes + " ".join(told)
    at_3100 = np.argmin(np.abs(found.input_speed / RPM - 3100.0))
    sun, ring = found.response.dynamic_factor[at_3100]
    assert told["largest dynamic factor K_v, at operating speeds"] == f"sun-planet {sun:.3f}, planet-ring {ring:.3f}"
    assert told["planet load factor K_gamma, mean over all positions"] == "sun-planet 1.000, planet-ring 1.000"
    nominal = files["stress"]["iso_root_stress"].values[0, 1]
    safety = 2 * 0.7 * 430e6 / (nominal * sun)
    assert f"planet, sun side {safety:.2f}" in told["safety S_F, ISO 6336-3:2019"]
    contact = files["stress"]["iso_contact_stress"].values[0]
    s = planetary_set(strong)
    # M_1 and M_2 of ISO 6336-2: curvatures at the inner points of single contact
    tips = [np.sqrt((gear.tip_radius / gear.base_radius) ** 2 - 1) for gear in (s.sun, s.planet)]
    step = 2 * np.pi / np.array([s.sun.teeth, s.planet.teeth])
    ratio = s.contact_ratio_sun_planet
    inner = (tips[0] - step[0]) * (tips[1] - (ratio - 1) * step[1])
    outer = (tips[1] - step[1]) * (tips[0] - (ratio - 1) * step[0])
    single = max(1.0, np.tan(s.working_pressure_angle_sun_planet) / np.sqrt(min(inner, outer)))
    assert single > 1.002
    assert f"sun-planet {1500e6 / (single * contact * np.sqrt(sun)):.2f}" in told["safety S_H, ISO 6336-2:2019"]
    assert points.rows[1][3] == f"{float(files['housing']['level'][1]):.4g}"
    heard = points.header.index("microphone [dB(A) re 20 µPa]"), points.header.index("sound power [dB(A) re 1 pW]")
    for column, name in zip(heard, ("pressure_level", "power_level")):
        assert points.rows[1][column] == f"{float(files['housing'][name][1]):.1f}"
    assert any("1e+10 N/m³ radial" in note and "damping ratio 0.05" in note for note in points.notes)
    assert ("3100", "15", "4") in {(row[0], row[2], row[5]) for row in near.rows}


def test_safeties_of_static_runs_have_no_dynamic_factors(case, files):
    alone = {name: files[name] for name in ("static", "stress")}
    told, notes = told_of(case, alone)
    safety = 2 * 430e6 / files["stress"]["iso_root_stress"].values[0, 0]
    assert told["safety S_F, ISO 6336-3:2019"].startswith(f"sun {safety:.2f},")
    assert "Y_M/(sigma_F0 K_gamma):" in notes and "(Z sigma_H0 sqrt(K_gamma)):" in notes
    assert "K_v (a response, or operation.speeds with strength.quality)" in notes


def test_safeties_need_no_stresses(case, files):
    """A run that ends with the contact or the lives has safeties with the factors that it has."""
    strong = with_values(case, LIMITS)
    first, rated = verdict(results_of(strong, {"static": files["static"]}))
    assert {"safety S_F, ISO 6336-3:2019", "safety S_H, ISO 6336-2:2019"} <= dict(first.rows).keys()
    assert "taken as 1" in " ".join(first.notes) and rated.title == "Strength, ISO 6336:2019"
    assert len([*verdict(results_of(case, {"static": files["static"]}))]) == 1


def test_the_verdict_says_what_shares_belong_to(case, files):
    """Static results with fixed centres beside factors on supports, and shares of an instant beside means."""
    share = np.array([0.0, 0.5, 0.5])[:, None] + 0.0 * files["static"]["load_share"]
    share = share.transpose("planet", "position")
    unequal = files["static"].assign(load_share=share, largest_load_share=share.max("position"))
    one_off = files | {"static": unequal}
    rows, notes = told_of(case, one_off)
    assert {"largest root stress, gear axes fixed", "transmission error, peak to peak, gear axes fixed"} < {*rows}
    assert "largest root stress, static" in told_of(case, files)[0]
    assert "on supports and bearings; static stresses and load shares (static.members): gear axes fixed" in notes
    assert (
        "largest share 1.500 of the equal one as a mean over all positions, 1.500 at one position: there the" in notes
    )
    assert rows["largest share of a planet at one position, gear axes fixed"] == "1.500 of the equal one (50.00 %)"
    assert notes.count("K_gamma = ") == 0
    force = files["modes"]["supported_force"].values.copy()
    force[0, :5] *= 1.9
    turning = files | {"modes": files["modes"].assign(supported_force=(("mesh", "supported_position"), force))}
    rows = told_of(case, turning)[0]
    assert rows["planet load factor K_gamma, mean over all positions"] == "sun-planet 1.000, planet-ring 1.000"
    # 1.9 of 1.9 + 1 + 1
    most = 3 * 1.9 / 3.9
    assert rows["largest share at one instant, at rest"] == f"sun-planet {most:.3f}, planet-ring 1.000"


def test_the_verdict_says_that_teeth_have_no_errors(case, files):
    relief = {"kind": "tip relief", "amount": "4 um", "start_diameter": "43 mm"}
    relieved = with_value(case, "sun.modifications", [relief])
    assert told_of(relieved, files)[1].startswith("teeth and pins without errors")
    off = with_value(case, "set.pin_errors", [{"planet": 1, "tangential": "5 um"}])
    assert "without errors" not in told_of(off, files)[1]


def test_the_verdict_says_where_the_run_up_ends(case, files):
    """At an end of its range the level may be higher beyond it."""
    runup, housing = files["runup"].copy(deep=True), files["housing"].copy(deep=True)
    runup["level"][-1] = 999.0
    runup["excitation_limit"] = 6 * runup["mesh_frequency"]
    housing["excitation_limit"] = 12 * files["dynamics"]["mesh_frequency"]
    runup.attrs["method"] = "supports"
    rows, notes = told_of(case, files | {"runup": runup, "housing": housing})
    assert rows["largest level of the run-up"] == "999 m/s² at 3,500 rpm, the end of its range"
    assert "in the housing that stands still" in describe_runup(runup).notes[-1] and "mesh harmonics" not in notes
    fast = 12 * 1116.0 / 1e3
    points = list(verdict(results_of(case, files | {"runup": runup, "housing": housing})))[1]
    assert f"excitation up to 1.08 to {fast:.4g} kHz" in points.notes[-2] and "of the ring alone" in points.notes[-1]
    assert "equivalent radiated power" not in " ".join(points.notes)
    housing.attrs["method"] = "casing"
    points = list(verdict(results_of(case, files | {"housing": housing})))[1]
    assert any(note.startswith("microphone: by equivalent radiated power") for note in points.notes)
    runup["level"][20] = 1999.0
    assert loudest(runup, Marks(())) == f"1999 m/s² at {float(runup['speed'][20]):,.4g} rpm"


THREE = {"dynamics.mesh_harmonics": 3, "runup.count": 12}


@pytest.fixture(scope="module")
def short_files(case, static, modes, files):
    """Contents of the files of a run with three mesh harmonics, with the findings of each."""
    few = with_values(case, THREE)
    dynamics = solve_dynamics(few, static, modes)
    found = {
        "dynamics": dynamics,
        "housing": solve_housing(few, dynamics),
        "runup": solve_runup(few, modes),
    }
    data = {name: result.dataset() for name, result in found.items()}
    for name, result in found.items():
        data[name].attrs["findings"] = as_text(once(result.findings, name))
    return {name: files[name] for name in ("static", "stress", "modes")} | data


def with_findings(case, files) -> Results:
    """Results with the findings that their files have."""
    findings = tuple(one for data in files.values() for one in findings_in(data.attrs))
    names = Manifest(complete=True, files={f"{name}.nc": "" for name in files}, findings=findings)
    results = Results(Path(), names, lambda path: case).with_known(files)
    vars(results)["case"] = case
    return results


def test_a_run_up_judges_the_speeds_whose_excitation_ends_short(found, short_files):
    """Three harmonics reach 3.8 kHz at most; by hand: the level with excitation up to the meshes' modes."""
    runup = short_files["runup"]
    change, speed = runup["level_change"].values, runup["speed"].values
    looked = np.flatnonzero(np.isfinite(change))
    full = found.dataset()
    assert runup.attrs["compared_to"] == pytest.approx(full["excitation_limit"].values.max(), rel=0.05)
    assert {0, len(speed) - 1, int(runup["level"].values.argmax())} <= {*looked.tolist()}
    there = [i for i in looked if np.isclose(full["speed"].values, speed[i]).any()]
    assert len(there) >= 3
    for i in there:
        level = float(full["level"][np.abs(full["speed"].values - speed[i]).argmin()])
        assert change[i] == pytest.approx(20.0 * np.log10(level / float(runup["level"][i])), abs=0.1)
    (finding,) = findings_in(runup.attrs)
    assert finding.code == "W-EXCITATION" and finding.stage == "runup"
    assert finding.text.startswith("run-up: at 900 rpm the excitation ends at 972 Hz")
    assert "W-EXCITATION" not in [one.code for one in runup_warnings(full)]


def test_slow_speeds_of_a_run_up_are_judged_as_operating_speeds_are(case, static, modes):
    """At 60 rpm the record's 512 harmonics end below the modes of the meshes, whoever asks for that speed."""
    slow = {"runup.from": "50 rpm", "runup.to": "60 rpm", "runup.count": 2, "dynamics.damping_ratio": 0.05}
    runup = solve_runup(with_values(case, slow), modes)
    (finding,) = (one for one in runup.findings if one.code == "W-EXCITATION")
    assert finding.text.startswith("run-up: at 50 rpm the excitation ends at 9216 Hz")
    operating = with_values(case, {"operation.speeds": ["60 rpm", "250 rpm"], "housing.published": None})
    assert runup.level_change[-1] == pytest.approx(solve_dynamics(operating, static, modes).level_change[0])


def test_numbers_whose_excitation_ends_short_are_marked_where_they_stand(case, short_files):
    """Level as bound; factors, sound and lines by a dagger; in verdict, tables of run-up and housing."""
    results = with_findings(with_values(case, THREE), short_files)
    first, points, _ = verdict(results)
    rows = dict(first.rows)
    assert rows["largest level of the run-up"].startswith("> ")
    for name in (
        "largest dynamic factor K_v, at operating speeds",
        "largest dynamic factor K_v of the run-up",
    ):
        assert rows[name].count("†") == 2, rows[name]
    assert sum("W-EXCITATION, doubt" in note for note in first.notes) == 1
    bare = [cell for row in points.rows for cell in row[1:] if not cell.startswith("> ") and "†" not in cell]
    assert bare == [] and len(points.header) == 6
    runup = describe_runup(short_files["runup"])
    level, factor = runup.header.index("level [m/s²]"), runup.header.index("K_v")
    assert all(row[level].startswith("> ") and row[factor].endswith("†") for row in runup.rows)
    assert "largest level > " in " ".join(runup.notes)
    housing = describe_housing(results.housing, level_changes(results), results.findings, level_doubts(results))
    assert all(row[2].startswith("> ") and row[3][-1] == row[4][-1] == "†" for row in housing.rows)


def test_a_level_by_forces_of_one_way_has_the_mark_of_the_other(short_files):
    """Both have the same excitation."""
    level = short_files["housing"]["level"]
    both = short_files["housing"].assign(
        one_way_level=("speed", 0.5 * level.values),
        one_way_difference=("speed", [6.02, 6.02]),
        turn_multiplier=("speed", [0.5, 0.5]),
    )
    block = describe_housing(both, np.array([20.0, 0.1]), [Finding("W-EXCITATION", "", "ends early")])
    column = block.header.index("one way [m/s^2]")
    short, whole = (row[column] for row in block.rows)
    assert short.startswith("> ") and short.endswith(" (+6.0 dB)")
    assert whole == f"{0.5 * float(level[1]):.4g} (+6.0 dB)"


@pytest.mark.parametrize(
    ("code", "changed"),
    [
        ("W-PULL", {}),
        ("W-UNSTABLE", {"stable": [1, 0]}),
        ("W-CONVERGENCE", {"converged": [1, 0]}),
        ("W-DAMPING", {}),
        ("W-POINTS", {}),
    ],
)
def test_doubts_of_the_response_are_marked_at_their_speeds(case, files, code, changed):
    """The second speed alone pulls, is unstable or did not converge; what the case draws concerns all."""
    stage = "" if code in ("W-DAMPING", "W-POINTS") else "dynamics"
    dynamics = files["dynamics"].copy(deep=True)
    for name, values in changed.items():
        dynamics[name] = ("speed", np.array(values, bool))
    if code == "W-PULL":
        dynamics["mesh_force_real"][1, :, 1] -= 3.0 * dynamics["mesh_force_real"][1, :, 0]
    finding = as_text([Finding(code, "", "for this test", stage=stage)])
    dynamics.attrs["findings"] = finding
    results = with_findings(case, files | {"dynamics": dynamics})
    first, points, _ = verdict(results)
    level = points.header.index("level [m/s²]")
    marked = ["†" in row[level] for row in points.rows]
    assert marked == ([True, True] if stage == "" else [False, True])
    factor = dict(first.rows)["largest dynamic factor K_v, at operating speeds"]
    assert ("†" in factor) == (code != "W-POINTS") == ("†" in points.rows[1][1] + points.rows[1][2])
    heard = points.header.index("microphone [dB(A) re 20 µPa]")
    assert ("†" in points.rows[1][heard]) == (code != "W-POINTS")
    if code != "W-POINTS":
        dte = describe_response(dynamics)
        column = dte.header.index("DTE rms [um]")
        assert ["†" in row[column] for row in dte.rows] == marked
    # what the dynamics doubt says nothing of the run-up
    assert ("†" in dict(first.rows)["largest level of the run-up"]) == (code == "W-DAMPING")


def test_pressures_at_the_end_of_a_flank_are_marked_in_verdict_and_stresses(case, files):
    static = files["static"].copy(deep=True)
    static.attrs["findings"] = as_text([Finding("W-EDGE", "", "at the end of a flank", stage="static")])
    results = with_findings(case, files | {"static": static})
    (pressure,) = (text for name, text in next(verdict(results)).rows if "contact pressure" in name)
    assert pressure.count("†") == 2
    block = describe_stress(results.stress, results.findings)
    assert all(("†" in row[1]) == row[0].startswith("contact") for row in block.rows)


def test_the_file_of_the_housing_carries_what_concerns_its_numbers():
    """Of dynamics.nc and the case; not what the run-up says of its own speeds."""
    found = {
        "": (Finding("W-DAMPING", "", "none"), Finding("W-BEARING", "", "linear")),
        "runup": (Finding("W-EXCITATION", "", "run-up: ends early", stage="runup"),),
        "dynamics": (Finding("W-EXCITATION", "", "ends early", stage="dynamics"),),
        "housing": (Finding("W-RESIDUAL", "", "missing", stage="housing"),),
    }
    carried = stage_of("housing").carried(found)
    assert [(one.code, one.stage) for one in carried] == [
        ("W-RESIDUAL", "housing"),
        ("W-DAMPING", ""),
        ("W-EXCITATION", "dynamics"),
    ]
    assert [one.code for one in stage_of("runup").carried(found)] == ["W-EXCITATION", "W-DAMPING"]


def stage_of(name: str):
    stage = ELASTIC.stage(name)
    assert stage is not None
    return stage


def test_pictures_of_a_run_up_say_where_the_excitation_ends_short(files, short_files):
    """Curves are dotted there, and the page tells it at every speed; with the whole excitation neither."""
    whole, short = (runup_levels(one["runup"]) for one in (files, short_files))
    styles = [{line.get_linestyle() for line in figure.axes[0].get_lines()} for figure in (whole, short)]
    assert ":" not in styles[0] and ":" in styles[1] and "-" not in styles[1]
    assert "W-EXCITATION" in short.axes[0].get_title(loc="left") + short.axes[0].get_title()
    for draw in (waterfall, draw_order_cuts):
        assert draw(files["runup"]).get_suptitle() == ""
        assert draw(short_files["runup"]).get_suptitle().endswith("(W-EXCITATION)")
    assert not any(explorer(files["runup"], files["modes"])["short"])
    assert all(explorer(short_files["runup"], short_files["modes"])["short"])
    one = short_files["housing"].isel(speed=[0]).assign(level_change=("speed", [20.0]))
    assert excited_to(one, 0).endswith("kHz alone (W-EXCITATION)")
    assert excited_to(one.assign(level_change=("speed", [0.3])), 0).endswith("kHz")


def test_the_campbell_diagram_holds_what_the_levels_name(files):
    """Every resonance named beside the level has its circle there, and names of modes cover none."""
    named = {text.get_text() for text in runup_levels(files["runup"]).axes[0].texts}
    figure = campbell_diagram(files["runup"], files["modes"])
    (ax,) = figure.axes
    figure.canvas.draw()
    circles = ax.collections[0].get_offsets().data
    shown = {
        f"{mode} × {harmonic}"
        for mode, harmonic, speed, frequency in zip(
            *(files["runup"][name].values for name in ("mode", "mesh_harmonic", "resonance_speed", "frequency"))
        )
        if (np.abs(circles - [speed, 1e-3 * frequency]) < 1e-9).all(axis=1).any()
        and 1e-3 * frequency <= ax.get_ylim()[1]
    }
    assert len(named) > 3 and named <= shown
    boxes = [text.get_window_extent() for text in ax.texts if text.get_text().startswith("mode")]
    places = ax.transData.transform(circles)
    assert boxes and not any(box.contains(*place) for box in boxes for place in places)
    assert not any(box.overlaps(other) for box in boxes for other in boxes if other is not box)


def test_the_verdict_shows_errors_of_tiny_loads(case, files):
    static = files["static"].copy()
    for name in [name for name in static.data_vars if str(name).startswith("ste")]:
        static[name] = static[name] * 1e-5
    told, _ = told_of(case, {"static": static, "stress": files["stress"]})
    said = next(text for name, text in told.items() if name.startswith("transmission error"))
    assert "0.000 µm" not in said and "e-06 µm" in said


def test_the_curve_at_the_right_is_what_the_microphone_hears_at_the_operating_speeds(case, files):
    figure = ELASTIC.figures["runup"].draw(Drawn(case, files))["run_up_levels"]
    speed, heard = next(ax for ax in figure.axes if "dB(A)" in ax.get_ylabel()).get_lines()[0].get_data()
    housing = files["housing"]
    rpm = np.array(case.operation.speeds) / RPM
    inside = (rpm >= speed[0]) & (rpm <= speed[-1])
    expected = housing["pressure_level"].values[inside]
    assert inside.any() and np.interp(rpm[inside], speed, heard) == pytest.approx(expected, abs=0.3)
    alone = ELASTIC.figures["runup"].draw(Drawn(case, {name: files[name] for name in ("runup", "modes")}))
    words = [ax.get_ylabel() for ax in alone["run_up_levels"].axes]
    assert "sensor, A-weighted\n[dB(A) re 1 µm/s²]" in words
