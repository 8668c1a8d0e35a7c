"""Drivetrain cases: speeds of the run, steps and records they ask for, sizes of springs and inertias."""

import math
import re
from pathlib import Path

import pytest

from femgear.case import text as case_text
from femgear.errors import CaseError
from femgear.trains.drivetrain.checks import check_drivetrain, check_spectrum, record_rate
from femgear.trains.drivetrain.model import case_model
from femgear.trains.drivetrain.stages import DRIVETRAIN
from femgear.trains.reading import parse_case, read_case, to_toml, with_value

CASES = Path(__file__).parents[3] / "cases"


def refused_model(case):
    with pytest.raises(CaseError) as info:
        check_drivetrain(case)
    return info.value


def warnings_of(case, *codes):
    """Those of the codes that the case is warned of, and the text."""
    notes = " ".join(DRIVETRAIN.describe_case(case)[-1].notes)
    return {code for code in codes if code in notes}, notes


def test_slow_steps_and_records_are_said(own):
    slow = with_value(with_value(own, "simulation.rate", "10 kHz"), "simulation.record", "1 kHz")
    for case, wanted in ((own, set()), (slow, {"W-RATE", "W-RECORD"})):
        assert warnings_of(case, "W-RATE", "W-RECORD", "W-SPEED")[0] == wanted


def driven(own, torque, **simulation):
    case = with_value(own, "operation.torque", [{"body": "motor", "torque": torque}])
    return with_value(case, "simulation", {"duration": "2 s", **simulation})


def test_the_fastest_speed_counts(own):
    """60 N m on 2.2 kg m^2, from 1480 to 2000 rpm in 2 s; steps and records are just enough at 1480 rpm."""
    case = driven(own, "60 N m", rate="18 kHz", record="1500 Hz")
    found, notes = warnings_of(case, "W-RATE", "W-RECORD", "W-SPEED")
    assert found == {"W-RATE", "W-RECORD"} and "the fastest" in notes
    still = with_value(case, "operation.torque", None)
    assert warnings_of(still, "steps a period", "W-RECORD", "W-SPEED")[0] == set()
    fast = re.search(r"(\d+\.?\d*) Hz at (\d+\.?\d*) rpm", notes)
    rpm = 1480.0 + 60.0 / case_model(case).inertia * 2.0 * 30.0 / math.pi
    assert float(fast[2]) == pytest.approx(rpm, rel=1e-4) and float(fast[1]) == pytest.approx(23 * rpm / 60, rel=1e-3)


def test_speeds_that_run_away_are_said(own):
    for torque, words in (
        ("300 N m", "from 1480 to"),
        ("-60 N m", "from 1480 to"),
        ("-300 N m", "turn it back"),
    ):
        found, notes = warnings_of(driven(own, torque, rate="100 kHz", record="10 kHz"), "W-SPEED")
        assert (found == {"W-SPEED"}) == (torque != "-60 N m") and (words in notes) == bool(found)


def test_steps_that_lower_the_modes_of_the_mesh_are_said(own):
    """The motor's chain: 35 steps a mesh period, but a mode of the mesh at two and a half times that line."""
    found, notes = warnings_of(with_value(own, "simulation.rate", "20 kHz"), "W-RATE", "steps a period")
    assert found == {"W-RATE"}
    hertz, percent = (float(re.search(text, notes)[1]) for text in (r"mode of (\S+) Hz", r"by (\S+)%;"))
    assert 1400.0 < hertz < 1450.0 and percent == pytest.approx(100.0 * (math.pi * hertz / 20e3) ** 2 / 3, rel=0.05)
    fast = re.search(r"; (\S+) Hz lowers it by 1%, (\S+) Hz by 0.1%", notes)
    assert float(fast[2]) / float(fast[1]) == pytest.approx(math.sqrt(10.0), rel=0.01)
    for rate, said in ((float(fast[1]) * 0.98, {"W-RATE"}), (float(fast[1]) * 1.01, set())):
        case = with_value(with_value(own, "simulation.record", None), "simulation.rate", f"{rate:g} Hz")
        assert warnings_of(case, "W-RATE")[0] == said


def test_spectra_are_refused_where_they_are_asked_for(own):
    short = with_value(own, "simulation", {"duration": "10 ms", "rate": "50 kHz"})
    brake = driven(own, "-300 N m", rate="100 kHz", record="10 kHz")
    fine = with_value(own, "simulation.resolution", "0.01 Hz")
    for case, code, key in (
        (short, "E-RANGE", "simulation.duration"),
        (fine, "E-RANGE", "simulation.resolution"),
        (brake, "E-SPECTRUM", "operation.torque"),
    ):
        model = check_drivetrain(case)
        with pytest.raises(CaseError) as caught:
            check_spectrum(case, model)
        assert (caught.value.code, caught.value.key) == (code, key)
        assert case is not short or "64 records" in caught.value.limit
        found, notes = warnings_of(case, "W-SPECTRUM")
        assert found and key in notes.split("[W-SPECTRUM]")[1]
    check_spectrum(own, check_drivetrain(own))
    assert not warnings_of(own, "W-SPECTRUM")[0]


def test_steps_that_cannot_follow_are_refused(own):
    error = refused_model(driven(own, "6 kN m"))
    assert error.code == "E-RATE" and error.key == "operation.torque" and "balance" in error.remedy
    assert error.limit.startswith("4 steps") and "rpm of motor" in error.message
    slow = with_value(with_value(own, "simulation.record", None), "simulation.rate", "2 kHz")
    error = refused_model(slow)
    assert (error.code, error.key) == ("E-RATE", "simulation.rate")
    assert float(error.limit.split(":")[1].split()[0]) == pytest.approx(4 * 567.333, rel=1e-4)
    assert check_drivetrain(with_value(slow, "simulation.rate", "2.3 kHz"))


def test_default_records_keep_three_mesh_harmonics(own, paper):
    case = with_value(own, "simulation.record", None)
    rate = record_rate(case, case_model(case))
    # 50 kHz over 11; over 12 it would end at 1667 Hz, below 1702 Hz
    assert rate == pytest.approx(50e3 / 11) and 0.4 * rate > 3 * 567.34 > 0.4 * 50e3 / 12
    assert record_rate(paper, case_model(paper)) == pytest.approx(1250.0)
    assert record_rate(own, case_model(own)) == 5e3


def test_sizes_alone_are_no_mechanism(own):
    """An inertia of 1e-9 kg m^2 and a shaft of 70 m are computed; what rounding would hide is called so."""
    assert check_drivetrain(with_value(own, "body[1].inertia", "1e-9 kg m^2"))
    tiny = refused_model(with_value(own, "body[1].inertia", "1e-12 kg m^2"))
    assert tiny.code == "E-STIFFNESS" and tiny.key == "body[1]" and "pinion" in tiny.remedy
    data = case_text.parse(to_toml(own), "")
    for length, fits in (("70 m", True), ("1 km", False)):
        shafts = [data["shaft"][0], data["shaft"][1] | {"length": length}]
        case = parse_case(case_text.write(data | {"shaft": shafts}))
        if fits:
            assert check_drivetrain(case)
        else:
            error = refused_model(case)
            assert error.code == "E-STIFFNESS" and "wheel-fan" in error.remedy


@pytest.mark.parametrize("body", [0, 1])
def test_one_soft_bearing_is_named(body):
    """The mesh alone holds a gear without its bearing, along one line; nothing else is slow."""
    text = """
        model = "drivetrain"
        title = "two gears"
        body = [{name = "a", inertia = "0.25 kg m^2", mass = "210 kg", tilts = false},
                {name = "b", inertia = "18 kg m^2", mass = "160 kg", tilts = false}]
        bearing = [{body = "a", radial = "2e8 N/m"}, {body = "b", radial = "1e8 N/m"}]
        operation = {speed = "1480 rpm"}
        simulation = {duration = "1 s"}
        [[parallel]]
        between = ["a", "b"]
        teeth = [23, 71]
        module = "3 mm"
        mesh = {stiffness = "3e8 N/m", contact_ratio = 1.68}
    """
    assert check_drivetrain(parse_case(text))
    error = refused_model(with_value(parse_case(text), f"bearing[{body}].radial", "1e-3 N/m"))
    assert (error.code, error.key, error.value) == ("E-STIFFNESS", f"bearing[{body}].radial", "0.001 N/m")
    hertz = math.sqrt(1e-3 / (210.0, 160.0)[body]) / (2.0 * math.pi)
    assert f"{'ab'[body]} on its bearings alone has {hertz:.3g} Hz" in error.message


def test_contact_loss_and_its_notice(own):
    assert not own.simulation.contact_loss
    case = with_value(own, "simulation.contact_loss", True)
    assert case.simulation.contact_loss and case.notices == ()
    open_back = with_value(case, "parallel[0].mesh.backlash", None)
    (notice,) = open_back.notices
    assert "[W-BACKLASH] parallel[0].mesh" in str(notice) and "back flank" in notice.text


def test_chains_too_large_for_dense_matrices_are_refused():
    n = 17
    text = case_text.write(
        {
            "model": "drivetrain",
            "title": "long",
            "body": [{"name": f"b{i}", "inertia": "1 kg m^2", "mass": "1 kg", "tilts": False} for i in range(n)],
            "shaft": [
                {"between": [f"b{i}", f"b{i + 1}"], "length": "1 m", "outer_diameter": "9 cm", "elements": 20}
                for i in range(n - 1)
            ],
            "operation": {"speed": "1 rpm"},
            "simulation": {"duration": "1 s"},
        }
    )
    with pytest.raises(CaseError, match="1605 coordinates are too many") as info:
        parse_case(text)
    assert info.value.key == "shaft[0].elements"


def test_stiffness_that_the_series_makes_negative_is_refused(own, paper):
    """Gibbs' overshoot is about 9 % of the jump: a low stiffness of 1e-3 of the high one turns negative."""
    for share in (0.02, 1e-3):
        error = refused_model(with_value(own, "parallel[0].mesh.low_share", share))
        assert (error.code, error.key) == ("E-STIFFNESS", "parallel[0].mesh.low_share")
    least = float(re.search(r"falls to (\S+) N/m", error.message)[1])
    # mean 3e8 over 0.68 of the period high: 3e8 / 0.68 the jump, less than a tenth of it below zero
    assert -0.12 < least / (3e8 / 0.68) < -0.07
    assert check_drivetrain(with_value(own, "parallel[0].mesh.low_share", 0.2))
    mesh = {"stiffness": "0.73e8 N/m", "contact_ratio": 1.9, "low_share": 1e-3}
    assert refused_model(with_value(paper, "planetary[0].ring_mesh", mesh)).key == "planetary[0].ring_mesh.low_share"


def test_teeth_of_planets_are_compared():
    case = read_case(CASES / "grc_like_drivetrain.toml")
    for teeth, fits in ((39, True), (37, True), (42, False), (5000, False)):
        if fits:
            assert with_value(case, "planetary[0].planet_teeth", teeth)
            continue
        with pytest.raises(CaseError, match="E-TEETH") as info:
            with_value(case, "planetary[0].planet_teeth", teeth)
        assert "39" in info.value.limit


def test_rigid_springs_are_called_so(own):
    case = with_value(with_value(own, "shaft[0].bending", "rigid"), "bearing[0].radial", "rigid")
    blocks = {block.title: block for block in DRIVETRAIN.describe_case(case)}
    assert blocks["Shafts"].rows[0][2] == "rigid" and blocks["Bodies"].rows[0][4] == "rigid"


def test_record_rates_of_the_page(paper):
    page = (CASES.parent / "docs" / "drivetrain.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"^```toml\n(.*?)^```", page, flags=re.MULTILINE | re.DOTALL)
    case = parse_case(example)
    rates = [record_rate(one, case_model(one)) for one in (case, paper)]
    said = re.search(r"(\d+) kHz in the example, (\d+) Hz in `wind_turbine_drivetrain.toml`", " ".join(page.split()))
    assert rates == pytest.approx([1e3 * float(said[1]), float(said[2])])


def test_a_shaft_without_gears():
    text = """
        model = "drivetrain"
        title = "one disc"
        body = [{name = "a", inertia = "1 kg m^2", mass = "10 kg", tilts = false}]
        bearing = [{body = "a", radial = "1e8 N/m"}]
        operation = {speed = "100 rpm", torque = [{body = "a", torque = "30 N m"}]}
        simulation = {duration = "1 s", contact_loss = true}
    """
    case = parse_case(text)
    assert record_rate(case, check_drivetrain(case)) == 1e3
    found, notes = warnings_of(case, "W-SPEED", "W-BACKLASH", "W-RATE", "W-RECORD")
    # 30 N m on 1 kg m^2 for a second
    assert found == {"W-SPEED", "W-BACKLASH"} and f"to {100.0 + 900.0 / math.pi:.6g} rpm" in notes
