"""The command line: exit codes, messages, and that it never shows a traceback."""

import contextlib
import errno
import importlib.util
import json
import os
import re
import signal
import subprocess
import sys
import time
from dataclasses import replace
from functools import partial
from importlib.metadata import version
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from edited_manifests import finish

import femgear
from femgear import cli
from femgear import run as run_module
from femgear.errors import ConvergenceError
from femgear.storage.files import write_dataset, write_text
from femgear.trains.elastic.stages import ELASTIC
from femgear.trains.reading import open_results, parse_case, read_case, to_toml, with_value, with_values

pytestmark = pytest.mark.usefixtures("pictures_undrawn")

CASE = Path(__file__).parents[1] / "cases" / "planetary_27_40_108.toml"
TEXT = CASE.read_text(encoding="utf-8")
STAGES = ("static", "stress", "modes", "runup", "dynamics", "housing")


def synthetic():
    spec = importlib.util.spec_from_file_location("synthetic", Path(__file__).with_name("synthetic_results.py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def edited(*changes: tuple[str, object]) -> str:
    """Text of the reference case with some entries changed; None leaves an entry out."""
    case = parse_case(TEXT)
    for key, value in changes:
        case = with_value(case, key, value)
    return case.source


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


@pytest.fixture
def check(tmp_path, capsys):
    """Run ``femgear check`` on a text; gives exit code, standard output and standard error."""

    def run(text: str, *options: str):
        path = tmp_path / "case.toml"
        path.write_text(text, encoding="utf-8")
        code = cli.main(["check", str(path), *options])
        printed = capsys.readouterr()
        return code, printed.out, printed.err

    return run


# --- check -----------------------------------------------------------------------------------------


def test_check_prints_the_published_numbers_of_the_reference_set(check):
    code, out, err = check(TEXT)
    assert code == 0 and err == ""
    for number in ("22.1995", "20.0000", "1.5507", "1.9301", "90.0000", "1116.0000", "400 N m", "none"):
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


# --- the program as started by a shell --------------------------------------------------------------


def test_the_installed_program(tmp_path):
    program = Path(sys.executable).with_name("femgear")

    def started(*arguments):
        return subprocess.run([program, *arguments], capture_output=True, text=True, timeout=60, check=False)

    run = started("--help")
    assert run.returncode == 0
    for command in ("check", "run", "report", "sweep", "schema"):
        assert command in run.stdout
    run = subprocess.run([program, "check", "absent.toml"], capture_output=True, text=True, timeout=60, check=False)
    assert run.returncode == 2 and "E-FILE" in run.stderr and run.stdout == ""


@pytest.mark.parametrize(
    "arguments",
    [["chek"], ["run"], ["compare", "x", "y"], ["run", "x.toml", "-o", "y", "--only", "all"], ["check"]],
)
def test_wrong_arguments(arguments, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main(arguments) == 2
    err = capsys.readouterr().err
    assert "[E-ARGUMENTS]" in err and "--help" in err


def test_options_that_new_has_not_are_entries_of_the_file(capsys):
    assert cli.main(["new", "planetary", "--backlash", "51 um"]) == 2
    assert "remedy:  femgear new --help; other entries are written into the file" in capsys.readouterr().err


@pytest.mark.parametrize("given", [["--teeth", "27.5", "40", "108"], ["--planets", "3.5"]])
def test_numbers_that_are_not_whole_are_refused_and_not_rounded(given, tmp_path, capsys):
    assert cli.main(["new", "planetary", *given, "-o", str(tmp_path / "a.toml")]) == 2
    assert "is no whole number" in capsys.readouterr().err and not (tmp_path / "a.toml").exists()


def test_new_refuses_a_centre_distance_at_which_nothing_closes(tmp_path, capsys):
    given = ["--centre-distance", "51 mm", "-o", str(tmp_path / "a.toml")]
    assert cli.main(["new", "planetary", *given]) == 2
    assert "--centre-distance: no profile shifts close" in capsys.readouterr().err


def test_a_gearbox_gets_a_casing_and_a_set_is_told_how_to(tmp_path, capsys):
    box = tmp_path / "box.toml"
    assert cli.main(["new", "gearbox", "-o", str(box)]) == 0
    assert cli.main(["casing", str(box)]) == 0
    assert "W-ESTIMATED" in capsys.readouterr().err
    case = read_case(tmp_path / "box_in_casing.toml")
    assert len(case.casing.foot) == 4 and len(case.sensor) == 3 and case.runup.count
    assert cli.main(["casing", str(CASE), "-o", str(tmp_path / "set.toml")]) == 2
    assert "femgear gearbox" in capsys.readouterr().err


def test_an_argument_that_is_missing_is_named(capsys):
    cli.main(["compare", "x", "y"])
    assert "--output is required" in capsys.readouterr().err
    cli.main(["run", "x.toml", "-o"])
    assert "-o requires an argument" in capsys.readouterr().err


def test_the_app_says_what_it_needs(tmp_path, capsys, monkeypatch):
    assert cli.main(["app", str(tmp_path / "none"), "--no-browser"]) == 2
    assert "there is no such folder" in capsys.readouterr().err
    monkeypatch.delitem(sys.modules, "femgear.app.server", raising=False)
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    assert cli.main(["app", str(tmp_path), "--no-browser"]) != 0
    err = capsys.readouterr().err
    assert "[E-LIBRARY]" in err and 'pip install "femgear[app]"' in err


def test_no_arguments_and_version(capsys):
    assert cli.main([]) == 0
    assert "Usage" in capsys.readouterr().out
    assert cli.main(["--version"]) == 0
    assert capsys.readouterr().out.strip() == version("femgear") == femgear.__version__


def test_schema_is_json(capsys):
    assert cli.main(["schema"]) == 0
    assert "properties" in json.loads(capsys.readouterr().out)


# --- run -------------------------------------------------------------------------------------------


def fake_run(case, out, *, only=None, pictures=True, progress=None, computed=None):
    """Write synthetic results as the pipeline would."""
    data = synthetic()
    names = ["case.toml"]
    write_text(case.source, out / "case.toml")
    for step, stage in enumerate(STAGES):
        progress(stage, step + 1, len(STAGES))
        dataset = getattr(data, stage)()
        for name in dataset.coords:
            dataset[name].attrs.setdefault("units", "1")
            dataset[name].attrs.setdefault("long_name", str(name))
        write_dataset(dataset, out / f"{stage}.nc")
        names.append(f"{stage}.nc")
        if stage == only:
            break
    finish(out, names, timings={"static": 0.25}, convergence={})
    computed(open_results(out))


@pytest.fixture
def pipeline(monkeypatch):
    def use(function):
        monkeypatch.setattr(run_module, "run_case", function, raising=False)

    use(fake_run)
    return use


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
    assert len(printed.splitlines()) <= 40 and "Is it strong enough?" in printed and "Verdict" in printed
    assert "Its strength is not rated." in " ".join(printed.split()) and "Dynamics" not in printed
    assert f"tables:  femgear report {out} --verbose" in printed
    assert cli.main(["report", str(out), "--verbose"]) == 0
    assert "Dynamics" in capsys.readouterr().out
    assert cli.main(["run", str(CASE), "-o", str(tmp_path / "only"), "--only", "static"]) == 0
    assert "STE mean" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("code", "words"),
    (("W-PULL", "Severity: doubt"), ("[e-mass]", "A refusal"), ("W-LIFE", "Severity: fault")),
)
def test_a_code_is_explained(capsys, code, words):
    assert cli.main(["explain", code]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith(code.strip("[]").upper() + ": ") and words in printed


def test_a_code_that_is_none_is_refused_with_those_that_are_near(capsys):
    assert cli.main(["explain", "W-PUL"]) == 2
    assert "W-PULL" in capsys.readouterr().err


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


def test_force_keeps_the_old_results_until_the_new_ones_are_there(tmp_path, capsys, pipeline):
    out = tmp_path / "out"
    assert cli.main(["run", str(CASE), "-o", str(out), "--only", "static"]) == 0
    for function, code in ((_diverge, 3), (_interrupt, 130), (_fill, 4)):
        pipeline(function)
        assert cli.main(["run", str(CASE), "-o", str(out), "--force"]) == code
        assert open_results(out).stages == ("static",) and len(list(out.iterdir())) == 3
    pipeline(fake_run)
    assert cli.main(["run", str(CASE), "-o", str(out), "--force"]) == 0
    assert open_results(out).stages == STAGES
    assert f"results: {out}\n" in capsys.readouterr().out


def test_two_runs_on_one_folder(tmp_path, capsys, pipeline):
    def second(case, out, **options):
        assert cli.main(["run", str(CASE), "-o", str(tmp_path / "out"), "--force"]) == 4
        fake_run(case, out, **options)

    pipeline(second)
    assert cli.main(["run", str(CASE), "-o", str(tmp_path / "out"), "--only", "static"]) == 0
    assert "E-LOCKED" in capsys.readouterr().err


def test_an_interrupted_run_says_how_far_it_came(tmp_path, capsys, monkeypatch):
    data = synthetic()

    def solve(name):
        if name == "dynamics":
            raise KeyboardInterrupt
        dataset = getattr(data, name)()
        for name in dataset.coords:
            dataset[name].attrs |= {"units": "1", "long_name": str(name)}
        return SimpleNamespace(dataset=lambda: dataset)

    stages = tuple(
        replace(one, solve=lambda *_, name=one.name, **__: solve(name), parts=None, verdict=lambda _: {})
        for one in ELASTIC.stages
    )
    monkeypatch.setattr("femgear.run.write_result", lambda result, path, **_: path.write_bytes(b""))
    monkeypatch.setattr("femgear.trains.elastic.stages.ELASTIC", replace(ELASTIC, stages=stages))
    out = tmp_path / "out"
    assert cli.main(["run", str(CASE), "-o", str(out)]) == 130
    assert cli.main(["report", str(out)]) == 4
    err = capsys.readouterr().err
    assert "the run was interrupted after: static, stress, modes" in err
    assert f"femgear run {out / 'case.toml'} -o {out}" in err
    with pytest.warns(UserWarning, match="interrupted after: static, stress, modes"):
        results = open_results(out)
    assert results.static.sizes["planet"] == 3 and results.case.title == "Planetary set 27/40/108"


def _started(program="import sys; from femgear.cli import main; sys.exit(main())", *words, **options):
    return subprocess.run(
        [sys.executable, "-c", program, *words], capture_output=True, text=True, check=False, **options
    )


@pytest.mark.parametrize(
    ("failure", "code", "said"),
    [
        ("raise KeyboardInterrupt", 130, "interrupted\n"),
        ("raise ImportError('libx.so: no such file')", 5, "[E-LIBRARY] ImportError: libx.so: no such file\n"),
        ("raise MemoryError", 5, "[E-LIBRARY] MemoryError: \n"),
    ],
)
def test_failures_while_the_program_is_loaded(tmp_path, failure, code, said):
    (tmp_path / "cyclopts.py").write_text(f"{failure}\n")
    done = _started(env=os.environ | {"PYTHONPATH": str(tmp_path)})
    remedy = f"  remedy:  {cli._LOADING}\n" if code == 5 else ""
    assert done.returncode == code and done.stderr == said + remedy


@pytest.mark.parametrize("limit", ["RLIMIT_AS", "RLIMIT_DATA"])
def test_a_process_that_may_use_too_little_memory_does_not_begin(limit):
    resource = pytest.importorskip("resource")
    number = getattr(resource, limit)
    done = _started(preexec_fn=lambda: resource.setrlimit(number, (200_000_000, resource.RLIM_INFINITY)))
    assert done.returncode == 3 and "[E-MEMORY]" in done.stderr and "found:   200 MB" in done.stderr
    assert "ulimit" in done.stderr and "Traceback" not in done.stderr


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_when_the_command_has_ended_change_nothing(number):
    program = (
        "import atexit, os, sys; from femgear.cli import main;"
        f"atexit.register(os.kill, os.getpid(), {int(number)}); sys.exit(main())"
    )
    done = _started(program, "--version")
    assert done.returncode == 0 and not done.stderr


def test_an_interrupt_while_the_last_words_are_shown_changes_nothing(monkeypatch, capsys):
    flush = cli._Stream.flush
    monkeypatch.setattr(cli._Stream, "flush", lambda self: os.kill(os.getpid(), signal.SIGINT) or flush(self))
    monkeypatch.setattr(cli, "_called", lambda *_: print("said") or 0)
    assert cli.main(["--version"]) == 0
    assert capsys.readouterr().out == "said\n" and signal.getsignal(signal.SIGINT) == signal.default_int_handler


def test_an_interrupt_of_which_compiled_code_makes_an_error_is_one(tmp_path, capsys, pipeline):
    """Extensions clear what was raised beneath them, and raise what they know."""
    out = tmp_path / "out"

    def changed(*_, number=signal.SIGINT, **__):
        with contextlib.suppress(KeyboardInterrupt):
            os.kill(os.getpid(), number)
            time.sleep(1.0)
        raise ValueError("Invalid bounding box")

    for number in (signal.SIGINT, signal.SIGTERM):
        pipeline(partial(changed, number=number))
        assert cli.main(["run", str(CASE), "-o", str(out)]) == 130
        said = f"interrupted; the same command goes on from what {out} holds"
        assert capsys.readouterr().err.splitlines()[-1] == said
    # without an interrupt it is a defect
    pipeline(partial(changed, number=0))
    with pytest.raises(ValueError, match="bounding box"):
        cli.main(["run", str(CASE), "-o", str(out)])
    assert signal.getsignal(signal.SIGINT) == signal.default_int_handler


def test_an_interrupt_behind_the_results_says_that_they_are_complete(tmp_path, capsys, pipeline, monkeypatch):
    out = tmp_path / "out"
    monkeypatch.setattr(cli, "_print", _interrupt)
    assert cli.main(["run", str(CASE), "-o", str(out)]) == 130
    assert capsys.readouterr().err.splitlines()[-1] == f"interrupted; the results in {out} are complete"
    pipeline(_interrupt)
    assert cli.main(["run", str(CASE), "-o", str(out), "--force"]) == 130
    said = f"interrupted; the same command goes on from what {out} holds"
    assert capsys.readouterr().err.splitlines()[-1] == said


def _diverge(*_, **__):
    raise ConvergenceError("no solution at 1 rpm", code="E-CONVERGENCE")


def _interrupt(*_, **__):
    raise KeyboardInterrupt


def _terminate(*_, **__):
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(10)


def _exhaust(*_, **__):
    np.empty(2**50)


def _crowd(*_, **__):
    raise RuntimeError("can't start new thread")


def _differ(*_, **__):
    np.linalg.cholesky(-np.eye(2))


def _lack(*_, **__):
    raise ImportError("No module named 'h5py'")


def _fill(*_, **__):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "static.nc")


@pytest.mark.parametrize(
    ("function", "code", "words"),
    [
        (_diverge, 3, "no solution"),
        (_exhaust, 3, "E-MEMORY"),
        (_crowd, 3, "E-MEMORY"),
        (_differ, 3, "E-SOLVE"),
        (_lack, 5, "E-LIBRARY"),
        (_interrupt, 130, "interrupted"),
        (_terminate, 130, "interrupted"),
        (_fill, 4, "E-DISK-FULL"),
    ],
)
def test_exit_codes(tmp_path, capsys, pipeline, function, code, words):
    pipeline(function)
    assert cli.main(["run", str(CASE), "-o", str(tmp_path / "out")]) == code
    printed = capsys.readouterr()
    assert words in printed.err and "Traceback" not in printed.err
    # what an interrupted run leaves behind does not stand in the way of the next
    pipeline(fake_run)
    assert cli.main(["run", str(CASE), "-o", str(tmp_path / "out"), "--only", "static"]) == 0


def test_report_of_no_results(tmp_path, capsys):
    assert cli.main(["report", str(tmp_path / "absent")]) == 4
    assert "E-RESULTS-MISSING" in capsys.readouterr().err


def test_export_writes_every_number_with_its_unit(tmp_path, capsys, pipeline):
    import pandas as pd

    out = tmp_path / "out"
    assert cli.main(["run", str(CASE), "-o", str(out), "--no-pictures"]) == 0
    assert cli.main(["export", str(out)]) == 2
    assert "--csv" in capsys.readouterr().err
    assert cli.main(["export", str(out), "--csv"]) == 0
    printed, results, tables = capsys.readouterr().out, open_results(out), {}
    assert "modes_dof_mode.csv" in printed
    for stage in STAGES:
        for name, one in results[stage].data_vars.items():
            path = out / "exported" / ("_".join((stage, *one.dims)) + ".csv")
            if not one.size:  # a heading alone tells nothing
                assert not path.exists()
                continue
            if path not in tables:
                tables[path] = pd.read_csv(path, keep_default_na=False, na_values=[""])
            table = tables[path]
            column = name if one.dtype.kind in "OUSb" else f"{name} [{one.attrs['units']}]"
            if one.dims:
                stored = table[column].to_numpy()
                if one.dtype.kind in "OUSb":
                    assert list(stored) == list(one.values.ravel())
                else:
                    np.testing.assert_allclose(stored, one.values.ravel(), rtol=1e-14)
                place = [table.columns.get_loc(c) for c in table.columns if c.split(" [")[0] in one.dims]
                assert place == list(range(len(one.dims)))
            else:
                assert table.set_index("name").value[name] == str(one.item())
    assert cli.main(["run", str(CASE), "-o", str(out), "--no-pictures", "--force", "--only", "static"]) == 0
    # tables of other results
    assert not (out / "exported").exists()


def test_python_runs_the_package_as_the_program():
    done = subprocess.run([sys.executable, "-m", "femgear", "--version"], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout.strip()) == (0, femgear.__version__)
    refused = [sys.executable, "-m", "femgear", "check", "absent.toml"]
    assert subprocess.run(refused, capture_output=True, timeout=60).returncode == 2


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


def test_an_interrupt_that_python_drops_comes_once_more(tmp_path, capsys, pipeline):
    class Cleared:
        def __del__(self):
            raise KeyboardInterrupt

    def interrupted(*_, **__):
        Cleared()
        for _ in range(500):
            time.sleep(0.01)

    pipeline(interrupted)
    start = time.monotonic()
    assert cli.main(["run", str(CASE), "-o", str(tmp_path / "out")]) == 130
    assert time.monotonic() - start < 4.0 and "ignored" not in capsys.readouterr().err


def test_a_new_case_is_written_once_and_can_be_checked(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    numbers = ["--teeth", "24", "30", "84", "--module", "3 mm", "--torque", "120 Nm"]
    assert cli.main(["new", "planetary", *numbers]) == 0
    out = capsys.readouterr().out
    assert "written: planetary.toml" in out and "next:    femgear run planetary.toml" in out
    assert "Assumed: --planets 3 --face-width" in out and "--teeth" not in out
    case = read_case("planetary.toml")
    assert case.module == 3e-3 and case.operation.torque == 120.0 and case.ring.teeth == 84
    assert cli.main(["check", "planetary.toml"]) == 0
    before = Path("planetary.toml").read_bytes()
    assert cli.main(["new", "planetary"]) == 2
    err = capsys.readouterr().err
    assert "E-OUTPUT" in err and "planetary.toml" in err and "--force" in err
    assert Path("planetary.toml").read_bytes() == before
    assert cli.main(["new", "pair", "-o", "planetary.toml", "--force"]) == 0
    assert read_case("planetary.toml").model == "pair"
    assert cli.main(["new", "bevel", "-o", "b.toml"]) == 2 and not Path("b.toml").exists()
    assert cli.main(["new", "planetary", "--torque", "-70 N m", "-o", "c.toml"]) == 0
    assert read_case("c.toml").operation.torque == -70.0
    assert "drivetrain" in capsys.readouterr().err


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


def test_rexs_in_and_out(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["rexs", str(CASE), "-o", "stage.rexs"]) == 0
    assert cli.main(["import", "stage.rexs", "-o", "back.toml"]) == 0
    out = capsys.readouterr().out
    assert "written: back.toml" in out and "assumed: 8" in out and "not used" in out
    assert read_case("back.toml").operation == read_case(CASE).operation
    assert cli.main(["rexs", str(CASE), "-o", "stage.rexs"]) == 2
    assert cli.main(["import", "stage.rexs", "-o", "back.toml", "--force", "--stage", "99"]) == 2
    assert "--stage" in capsys.readouterr().err
    assert cli.main(["rexs", str(CASE.with_name("spur_pair.toml")), "-o", "pair.rexs"]) == 2
    assert "E-MODEL" in capsys.readouterr().err and not Path("pair.rexs").exists()


@pytest.mark.parametrize("name", ["a\nb.toml", "con.toml", "a:b.toml", "x" * 98 + ".toml"])
def test_files_are_written_under_names_that_run_takes(tmp_path, capsys, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["rexs", str(CASE), "-o", "stage.rexs"]) == 0
    for command in (["import", "stage.rexs", "-o", name], ["new", "pair", "-o", name]):
        assert cli.main(command) == 2
        said = capsys.readouterr().err
        assert "E-CHOICE" in said and "--output" in said
    assert [path.name for path in tmp_path.iterdir()] == ["stage.rexs"]


@pytest.mark.parametrize("columns", ["", "0", "1", "02"])
def test_terminals_without_columns_have_a_help(columns, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", columns)
    assert cli.main(["new", "--help"]) == 0
    assert "--teeth STR" in capsys.readouterr().out
