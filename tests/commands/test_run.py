"""femgear/commands/run.py: cases are checked, computed and reported, folders are guarded."""

import re
from pathlib import Path

import numpy as np
import pytest
from command_stand_ins import CASE, STAGES, TEXT, edited

from femgear import cli
from femgear.trains.reading import open_results, read_case, to_toml, with_values

pytestmark = pytest.mark.usefixtures("pictures_undrawn")


def standard(sun: int, planet: int, ring: int, planets: int = 3) -> str:
    """Text of an unshifted set of module 1.5 mm with small bores."""
    changes = {
        "teeth = 27": f"teeth = {sun}",
        "teeth = 40": f"teeth = {planet}",
        "teeth = 108": f"teeth = {ring}",
        "profile_shift = 0.52681": "profile_shift = 0.0",
        '"51 mm"': f'"{0.75 * (sun + planet)} mm"',
        "planets = 3": f"planets = {planets}",
        '"9 mm"': '"3 mm"',
        '"18 mm"': '"3 mm"',
        "cutter_teeth = 30": "",
    }
    text = re.sub(r"(?m)^tip_diameter.*\n", "", TEXT)
    for old, new in changes.items():
        text = text.replace(old, new)
    return text


def test_check_prints_the_published_numbers_of_the_reference_set(check):
    code, out, err = check(TEXT)
    assert code == 0 and err == ""
    for number in ("22.1995", "20.0000", "1.5507", "1.9301", "90.0000", "1116.0000", "400 N m", "microphone 1 m from"):
        assert number in out
    assert "-0.00" not in out


def test_check_of_many_speeds_shows_some(check):
    ends = {"from": "1 rpm", "to": "1000 rpm"}
    code, out, _ = check(edited(("operation.speeds", ends | {"count": 1000})))
    _, of_two, _ = check(edited(("operation.speeds", ends | {"count": 2})))
    assert code == 0 and "1000 speeds" in out and len(out.splitlines()) < len(of_two.splitlines()) + 10


def test_check_finds_the_shifts_that_are_left_out(check):
    code, out, _ = check(TEXT.replace("profile_shift = 0.52681\n", ""))
    assert code == 0 and "0.52681" in out


def test_check_finds_the_centre_distance_that_is_left_out(check):
    text = TEXT.replace('centre_distance = "51 mm"', "").replace("profile_shift = 0.52681\n", "")
    code, out, _ = check(text)
    assert code == 0 and "centre distance 51 mm" in out


def test_check_echoes_negative_ring_teeth(check):  # bad input 32
    code, out, _ = check(edited(("ring.teeth", -108)))
    assert code == 0 and "108 teeth" in out and "ISO 21771" in out


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("operation.torque", "0 N m"), "no tooth touches"),  # 24
        (("operation.torque", "-100 N m"), "the other flanks"),  # 25
        (("sun.tip_diameter", "45.6 mm"), "W-CLEARANCE"),  # 40
        (("sun.tip_diameter", None), "W-TIP"),
        (("rack.root_radius", 0.3), "W-FILLET"),  # 36
        (("set.backlash", "1 mm"), "W-TIP-THIN"),  # 35
        (("set.planets", 1), "W-PLANETS"),  # 47
        (("set.pin_errors", [{"planet": 1, "tangential": "20 um"}]), "W-WEDGING"),  # 50
        (("housing", {"form": "linear", "points": 9}), "W-POINTS"),
        # 100 N m (1 + 108/27) on the brake
        (("brake.coupling_stiffness", "0.4 kN m/rad"), "turn the coupling by 71.62 deg"),
    ],
)
def test_check_warns(check, change, words):
    code, out, err = check(edited(change))
    # without torque it can be looked at, and not be run
    assert code == (2 if "[E-NO-LOAD]" in err else 0) and words in out


def test_check_flags_undercut_with_the_shift_that_avoids_it(check):  # bad input 33
    text = standard(14, 40, 94).replace("teeth = 94", 'teeth = 94\ntip_diameter = "138.6 mm"')
    code, out, _ = check(text)
    # x_min = h - rho (1 - sin(alpha)) - z sin^2(alpha)/2 = 1.25 - 0.1645 - 0.8188
    assert code == 0 and "W-UNDERCUT" in out and "x >= 0.2667" in out


LONG_TIP = '= 72\ntip_diameter = "105 mm"'


GEOMETRY = [
    # bad input, text, code, words of the message
    (34, edited(("sun.tip_diameter", "48 mm")), "E-POINTED", "pointed"),
    (36, edited(("rack.root_radius", 0.6)), "E-ROOT-RADIUS", "<= 0.3900 modules"),
    (36, edited(("rack.root_radius", 0.38), ("ring.tip_diameter", "158.8 mm")), "E-FILLET", "planet's root"),
    (37, edited(("sun.profile_shift", -0.5), ("sun.tip_diameter", None)), "E-CONTACT-RATIO", "ratio 0.8283"),
    (
        38,
        standard(36, 18, 72).replace("= 72", LONG_TIP),
        "E-INTERFERENCE",
        "0.3849 mm",
    ),
    (40, edited(("sun.tip_diameter", "46 mm")), "E-CLEARANCE", "-0.1250 mm"),
    (41, edited(("planet.bore_radius", "30 mm")), "E-RIM", "planet.bore_radius"),
    (41, edited(("ring.outer_radius", "80 mm")), "E-RIM", "ring.outer_radius"),
    (42, edited(("set.centre_distance", "40 mm")), "E-CENTRE-DISTANCE", "47.2196 mm"),
    (43, edited(("set.centre_distance", "50.5 mm")), "E-BACKLASH", "overlap"),
    (44, standard(27, 36, 99, planets=4), "E-ASSEMBLY", "91.428571"),
    (45, standard(20, 30, 80, planets=5), "E-NEIGHBOURS", "at most 4"),
    (46, edited(("ring.teeth", 108), ("set.centre_distance", "50.25 mm")), "E-BACKLASH", "overlap"),
    (47, edited(("set.planets", 1000)), "E-NEIGHBOURS", "found:   1000"),
    (48, edited(("set.planet_angles", ["0 deg", "120 deg", "120 deg"])), "E-RANGE", "equal"),
    (48, edited(("set.planet_angles", ["0 deg", "240 deg", "120 deg"])), "E-RANGE", "ascending"),
    (48, edited(("set.planet_angles", ["0 deg", "121 deg", "240 deg"])), "E-ASSEMBLY", "120.000000"),
]


@pytest.mark.parametrize(("number", "text", "code", "words"), GEOMETRY)
def test_gears_that_cannot_be_are_refused_with_numbers(check, number, text, code, words):
    status, out, err = check(text)
    assert status == 2, f"bad input {number}"
    assert f"[{code}]" in err and "case.toml" in err
    assert words in err and "allowed:" in err and "remedy:" in err
    assert out == "" and "Traceback" not in err


def test_refusals_name_what_the_file_gives_and_keys_that_exist(check):
    _, _, err = check(TEXT.replace('"51 mm"', '"50.9 mm"'))
    assert "set.backlash" in err and "thickness allowance" not in err
    _, _, err = check(TEXT.replace("planets = 3", "planets = 4"))
    assert "set.planets" in err and "found:   4\n" in err
    angles = 'planet_angles = ["0 deg", "121 deg", "240 deg"]\nplanets = 3'
    _, _, err = check(TEXT.replace("planets = 3", angles, 1))
    assert "found:   '0, 121, 240 deg'" in err
    # a shift that was left out is not what the user should change
    for distance, code in (("53 mm", "E-POINTED"), ("56 mm", "E-SHIFT")):
        long = "54 mm" if code == "E-POINTED" else "45 mm"
        text = TEXT.replace("profile_shift = 0.52681\n", "").replace("45.08043 mm", long)
        text = text.replace('"51 mm"', f'"{distance}"')
        _, _, err = check(text.replace("profile_shift = 0.0         # positive", "# positive"))
        assert code in err and ": set.centre_distance: " in err and f"found:   '{distance}'" in err
        assert "closes the set" in err and "not in mm" not in err


def test_not_coaxial(check):  # bad input 46: 27 + 2 x 40 is not 108, and no shift makes up for it
    text = TEXT.replace('centre_distance = "51 mm"', "").replace("0.52681", "0.0")
    status, _, err = check(text)
    assert status == 2 and "E-COAXIAL" in err and "50.25" in err and "51.0" in err


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty"),
        ("a = [", "E-TOML"),
        (TEXT.replace("module", "modul"), "module?"),
        (TEXT.replace("planets = 3", "planets = 0"), "set.planets"),  # 47
        (TEXT.replace('fixed = "ring"', 'fixed = "sun"'), "E-MECHANISM"),  # 49
        (TEXT + "\n[set.pins]\nradial_error = '1 mm'\n", "set.pins"),  # 50: there is nothing silently ignored
    ],
)
def test_bad_files_end_with_exit_code_2(check, text, words):
    status, out, err = check(text)
    assert status == 2 and words in err and out == "" and "Traceback" not in err


@pytest.mark.parametrize(
    ("old", "new", "words", "unsaid"),
    [
        ('tip_diameter = "63 mm"', 'tip_diameter = "frei"', 'or "free"', "factor"),
        ("tolerance = 1e-6", 'tolerance = 1e-6\nup_to = "1e12 Hz"', "E-RANGE", "factor"),
    ],
)
def test_refusals_name_words_that_are_allowed_and_guess_no_absurd_unit(check, old, new, words, unsaid):
    code, _, err = check(TEXT.replace(old, new))
    assert code == 2 and words in err and unsaid not in err


def test_check_refuses_what_a_run_would_refuse(check):
    swapped = with_values(read_case(CASE), {"operation.input": "ring", "operation.fixed": "sun"})
    code, out, err = check(to_toml(swapped))
    assert code == 2 and "contact ratio" in out and re.search(r"\[E-FIXED-MEMBER\] \S*case.toml:\d+: ", err)
    refused, works = "(modes, runup, dynamics, housing)", "it takes --only static or stress:"
    assert f"femgear run without --only refuses this case {refused}; {works}" in err
    assert check(to_toml(swapped), "--only", "static")[::2] == (0, "")
    assert check(to_toml(swapped), "--only", "modes")[0] == 2
    assert check(to_toml(swapped) + "\n[planar]\n")[0] == 0
    assert check(TEXT)[::2] == (0, "")


def test_check_refuses_housings_that_a_run_would_refuse_with_file_and_line(check, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    none = 'radial_stiffness = "0 N/m"\ntangential_stiffness = "0 N/m"'
    idle = TEXT + f'\n[[housing.support]]\nangle = "0 deg"\n{none}\n'
    code, _, err = check(idle)
    line = idle.splitlines().index("[[housing.support]]") + 1
    assert code == 2 and "[E-SUPPORT]" in err and f"case.toml:{line}: housing.support[0]: " in err
    angle = np.linspace(0.0, 6.0, 40)
    arrays = {"natural_frequency": [2e3], "damping_ratio": 0.02, "ring_shape": np.ones((1, 40, 2))}
    arrays |= {"sensor_shape": np.ones((1, 2)), "ring_angle": np.where(angle > 5.0, np.nan, angle)}
    np.savez(tmp_path / "casing.npz", **arrays)
    code, _, err = check(TEXT + '\n[housing.structure]\nfile = "casing.npz"\ndamping_ratio = 0.02\n')
    assert code == 2 and "[E-FINITE]" in err and "casing.npz: housing.structure.file: ring_angle" in err


def test_neighbouring_tooth_numbers_are_printed_on_request(capsys):
    assert cli.main(["check", str(CASE)]) == 0
    assert "Neighbouring" not in capsys.readouterr().out
    assert cli.main(["check", str(CASE), "--neighbours"]) == 0
    assert "Neighbouring tooth numbers" in capsys.readouterr().out


def test_run_writes_and_sums_up(tmp_path, capsys, pipeline):
    out = tmp_path / "out"
    assert cli.main(["run", str(CASE), "-o", str(out), "--verbose"]) == 0
    printed = capsys.readouterr()
    for title in ("Static", "Stresses", "Modes", "Dynamics", "Housing", "Time", "load share"):
        assert title in printed.out
    assert "static" in printed.err
    assert open_results(out).stages == STAGES
    assert (out / "case.toml").read_text(encoding="utf-8") == TEXT


def test_run_prints_answers_and_verdict_in_45_lines_and_the_report_all_tables(tmp_path, capsys, monkeypatch, pipeline):
    monkeypatch.setenv("COLUMNS", "80")
    out = tmp_path / "out"
    assert cli.main(["run", str(CASE), "-o", str(out)]) == 0
    printed = capsys.readouterr().out
    assert len(printed.splitlines()) <= 45 and "Is it strong enough?" in printed and "Verdict" in printed
    assert max(len(line) for line in printed.splitlines() if str(out) not in line) <= 80
    words = " ".join(printed.split())
    assert re.search(r"Strong enough for [\d.]+ times the load: S_F", words) and "Dynamics" not in printed
    assert f"tables:  femgear report {out} --verbose" in printed
    assert cli.main(["report", str(out), "--verbose"]) == 0
    assert "Dynamics" in capsys.readouterr().out
    monkeypatch.delenv("COLUMNS")
    assert cli.main(["run", str(CASE), "-o", str(tmp_path / "only"), "--only", "static", "--no-pictures"]) == 0
    assert "STE mean" in capsys.readouterr().out


def test_run_prints_its_warnings_before_it_computes(tmp_path, capsys, pipeline):
    path = tmp_path / "case.toml"
    changes = (("sun.tip_diameter", "45.6 mm"), ("housing", {"form": "linear", "points": 9}))
    path.write_text(edited(*changes), encoding="utf-8")
    assert cli.main(["run", str(path), "-o", str(tmp_path / "out")]) == 0
    printed = capsys.readouterr()
    lines = printed.err.splitlines()
    assert [line.split("]")[0] for line in lines[:2]] == ["warning: [W-CLEARANCE", "warning: [W-POINTS"]
    assert "W-" not in "".join(lines[2:]) + printed.out and "static" in lines
    assert cli.main(["run", str(CASE), "-o", str(tmp_path / "clean")]) == 0
    assert "warning:" not in capsys.readouterr().err


def test_run_of_one_stage(tmp_path, capsys, pipeline):
    out = tmp_path / "out"
    assert cli.main(["run", str(CASE), "--output", str(out), "--only", "static", "--no-pictures"]) == 0
    assert open_results(out).stages == ("static",)
    assert "Dynamics" not in capsys.readouterr().out


def test_run_again_needs_force(tmp_path, capsys, pipeline):
    out = tmp_path / "out"
    assert cli.main(["run", str(CASE), "-o", str(out), "--only", "static"]) == 0
    assert cli.main(["run", str(CASE), "-o", str(out), "--only", "static"]) == 4
    assert "--force" in capsys.readouterr().err
    assert cli.main(["run", str(CASE), "-o", str(out), "--only", "static", "--force"]) == 0


def test_run_into_somebody_elses_folder(tmp_path, capsys, pipeline):
    (tmp_path / "mine.txt").write_text("mine")
    assert cli.main(["run", str(CASE), "-o", str(tmp_path), "--force"]) == 4
    assert "E-OUTPUT" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_a_bad_case_makes_no_folder(tmp_path, capsys, pipeline):
    path = tmp_path / "bad.toml"
    path.write_text(edited(("set.planets", 5)))
    assert cli.main(["run", str(path), "-o", str(tmp_path / "out")]) == 2
    assert "E-NEIGHBOURS" in capsys.readouterr().err and not (tmp_path / "out").exists()


def test_run_takes_the_only_case_and_a_folder_beside_it(tmp_path, capsys, monkeypatch, pipeline):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["run"]) == 2 and "an empty folder" in capsys.readouterr().err
    Path("notes.txt").touch()
    Path("pyproject.toml").touch()
    assert cli.main(["run"]) == 2 and "notes.txt, pyproject.toml" in capsys.readouterr().err
    Path("own set.toml").write_text(TEXT, encoding="utf-8")
    assert cli.main(["run"]) == 0 and "results: own set_results" in capsys.readouterr().out
    assert open_results("own set_results").stages == STAGES
    assert cli.main(["run"]) == 4 and "--force" in capsys.readouterr().err
    assert cli.main(["run", "--force"]) == 0
    Path("other.toml").touch()
    capsys.readouterr()
    assert cli.main(["run"]) == 2 and "other.toml, own set.toml" in capsys.readouterr().err
    monkeypatch.chdir("/")
    assert cli.main(["run", str(tmp_path / "own set.toml"), "--only", "static", "--force"]) == 0
    assert open_results(tmp_path / "own set_results").stages == STAGES[:1]


def test_report_of_no_results(tmp_path, capsys):
    assert cli.main(["report", str(tmp_path / "absent")]) == 4
    assert "E-RESULTS-MISSING" in capsys.readouterr().err
