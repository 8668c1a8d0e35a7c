"""What is known of an integration before it: speeds, records, steps; what is refused and warned of."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from small_gearbox import pair_tables

from femgear.errors import CaseError
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.transient import gearbox_in_time
from femgear.trains.gearbox.transient_checks import (
    check_spectrum,
    check_transient,
    default_record_every,
    frequency_shift,
    run_outline,
    shift_rate,
    slow_steps,
    transient_notices,
    why_no_motion,
)
from femgear.trains.reading import read_case, with_values

CASES = Path(__file__).parents[3] / "cases"


@pytest.fixture(scope="module")
def own():
    return read_case(CASES / "own_chain.toml")


def warned(case, *codes):
    """Those of the codes that the case is warned of, and the text."""
    findings = list(transient_notices(case))
    return {one.code for one in findings} & {*codes}, " ".join(f"{one.key} {one.text}" for one in findings)


def driven(own, torque, **entries):
    torques = [{"load": "motor", "torque": torque}, {"load": "fan", "torque": "0 N m"}]
    return with_values(own, {"transient": {"duration": "2 s", "torque": torques, **entries}})


@pytest.mark.parametrize("name", ["wind_turbine_drivetrain", "grc_like_drivetrain", "own_chain"])
def test_the_inertia_of_the_rigid_chain_is_that_of_its_free_rotation(name):
    case = read_case(CASES / f"{name}.toml")
    model, outline = gearbox_in_time(solve_deflection(case), case.transient), run_outline(case)
    speed = model.speed
    late = outline.speeds.last - speed
    assert outline.shaft == model.shaft and abs(late) >= 0.0
    inertia = model.spun.inertia
    power = sum(model.port_ratio[one.body] * one.mean(case.transient.duration) for one in model.torques)
    # radii of the wind turbine differ from its teeth by half a per cent
    wanted = power * case.transient.duration / inertia
    assert late == pytest.approx(wanted, rel=0.02, abs=1e-3 * abs(speed))


def test_shipped_cases_leave_nothing_to_say(own):
    assert warned(own, "W-RATE", "W-RECORD", "W-SPEED", "W-SPECTRUM", "W-DAMPING")[0] == set()
    slow = with_values(own, {"transient.rate": "10 kHz", "transient.record": "1 kHz"})
    assert warned(slow, "W-RATE", "W-RECORD")[0] == {"W-RATE", "W-RECORD"}
    assert warned(with_values(own, {"modes.damping_ratio": 0.0}), "W-DAMPING")[0] == {"W-DAMPING"}


def test_the_fastest_speed_counts(own):
    """60 N m on 2.2 kg m^2, from 1480 to 2000 rpm in 2 s; steps and records are just enough at 1480 rpm."""
    case = driven(own, "60 N m", rate="18 kHz", record="1500 Hz")
    found, text = warned(case, "W-RATE", "W-RECORD", "W-SPEED")
    assert found == {"W-RATE", "W-RECORD"} and "the fastest" in text
    assert warned(driven(own, "0 N m", rate="18 kHz", record="1500 Hz"), "W-RATE", "W-RECORD")[0] == set()
    fast = re.search(r"(\d+\.?\d*) Hz at (\d+\.?\d*) rpm", text)
    inertia = gearbox_in_time(solve_deflection(own), own.transient).spun.inertia
    rpm = 1480.0 + 60.0 / inertia * 2.0 * 30.0 / math.pi
    assert float(fast[2]) == pytest.approx(rpm, rel=1e-4) and float(fast[1]) == pytest.approx(23 * rpm / 60, rel=1e-3)


def test_speeds_that_run_away_are_said(own):
    for torque, words in (("300 N m", "from 1480 to"), ("-60 N m", ""), ("-300 N m", "turn it back")):
        found, text = warned(driven(own, torque, rate="100 kHz", record="10 kHz"), "W-SPEED")
        assert (found == {"W-SPEED"}) == bool(words) and words in text


def test_spectra_are_refused_where_they_are_asked_for(own):
    short = with_values(own, {"transient": {"duration": "10 ms", "rate": "50 kHz"}})
    brake = driven(own, "-300 N m", rate="100 kHz", record="10 kHz")
    fine = with_values(own, {"transient.resolution": "0.01 Hz"})
    for case, code, key in (
        (short, "E-RANGE", "transient.duration"),
        (fine, "E-RANGE", "transient.resolution"),
        (brake, "E-SPECTRUM", "transient.torque"),
    ):
        check_transient(case)
        with pytest.raises(CaseError) as caught:
            check_spectrum(case)
        assert (caught.value.code, caught.value.key) == (code, key)
        found, text = warned(case, "W-SPECTRUM")
        assert found and key in text
    check_spectrum(own)


def test_steps_that_cannot_follow_are_refused(own):
    with pytest.raises(CaseError) as caught:
        check_transient(driven(own, "6 kN m"))
    assert (caught.value.code, caught.value.key) == ("E-RATE", "transient.torque")
    slow = with_values(own, {"transient.record": None, "transient.rate": "2 kHz"})
    with pytest.raises(CaseError) as caught:
        check_transient(slow)
    assert (caught.value.code, caught.value.key) == ("E-RATE", "transient.rate")
    assert float(caught.value.limit.split(":")[1].split()[0]) == pytest.approx(4 * 567.333, rel=1e-4)
    check_transient(with_values(slow, {"transient.rate": "2.3 kHz"}))


def test_default_records_keep_three_mesh_harmonics(own):
    rate = run_outline(with_values(own, {"transient.record": None})).record_rate
    # 50 kHz over 11; over 12 it would end at 1667 Hz, below 1702 Hz
    assert rate == pytest.approx(50e3 / 11) and 0.4 * rate > 3 * 567.34 > 0.4 * 50e3 / 12
    assert run_outline(read_case(CASES / "wind_turbine_drivetrain.toml")).record_rate == pytest.approx(1250.0)
    assert run_outline(own).record_rate == 5e3


@pytest.mark.parametrize("rate", [900.0, 20e3, 1e6])
@pytest.mark.parametrize("highest", [0.0, 130.0, 4000.0])
def test_records_keep_the_third_harmonic(rate, highest):
    every = default_record_every(rate, highest)
    # the next whole number would be too slow
    for record, enough in ((rate / every, True), (rate / (every + 1), False)):
        keeps = record >= 1000.0 * (1.0 - 1e-9) and 0.4 * record >= 3.0 * highest
        assert keeps == enough or (enough and every == 1)


@pytest.mark.parametrize("steps", [200.0, 4.0])
def test_shift_is_that_of_the_trapezoidal_rule(steps):
    """Eigenvalues of one step of x'' = -omega^2 x, in matrices written down here."""
    omega, h = 2.0 * np.pi, 1.0 / steps
    rate = np.array([[0.0, 1.0], [-(omega**2), 0.0]])
    step = np.linalg.solve(np.eye(2) - 0.5 * h * rate, np.eye(2) + 0.5 * h * rate)
    turned = np.abs(np.angle(np.linalg.eigvals(step))).max() / h
    assert frequency_shift(1.0, steps) == pytest.approx(1.0 - turned / omega, rel=1e-9)


def test_steps_that_lower_a_mode_are_said_with_the_rates_that_do_not():
    assert 0.98 * 1e-2 < frequency_shift(1500.0, shift_rate(1500.0, 1e-2)) <= 1e-2
    (finding,) = slow_steps(1425.0, 20e3)
    assert finding.code == "W-RATE" and "1.6" in finding.text
    fast = float(re.search(r"(\S+) Hz lowers it by 1 %", finding.remedy)[1])
    assert [*slow_steps(1425.0, 0.98 * fast)] and not [*slow_steps(1425.0, 1.01 * fast)]


def test_nothing_moves_without_a_speed():
    tables = pair_tables() | {"transient": {"duration": "1 s"}}
    tables["operation"]["load_case"][0]["speed"] = {"input": "0 rpm"}
    case = read_case(tables)
    assert why_no_motion(case) and why_no_motion(read_case(pair_tables()))
    assert [one.code for one in transient_notices(case)] == ["W-UNUSED"]
    check_transient(case)
    check_spectrum(case)


def test_teeth_that_part_without_backlash_are_told(own):
    parts = with_values(own, {"transient.contact_loss": True})
    assert warned(parts, "W-BACKLASH")[0] == set()
    bare = with_values(parts, {"pair[0].mesh.backlash": None})
    found, text = warned(bare, "W-BACKLASH")
    assert found and "pair[0].mesh" in text
