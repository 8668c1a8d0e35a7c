"""python validation: verdicts, the page, exit codes, and every row that does not take long."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from femgear.errors import GridError, StorageError
from validation import themes as validation_themes
from validation.__main__ import main
from validation.page import FIELDS, page, read_rows, records, summary, write_page
from validation.rows import at_most, counted, information, printed, within
from validation.run import Theme, run_validation


def validation(*rows, quick=False):
    """Validation of one theme with the given rows."""
    return run_validation((Theme("sample", "Sample", "Introduction.", (lambda: rows,)),), quick=quick)


GOOD = within("A1", "closed form", "length [m]", 2.0, 2.0002, 1e-3)
BAD = within("A2", "closed form", "width [m]", 2.0, 2.1, 1e-3)


@pytest.mark.parametrize(
    ("row", "verdict"),
    [
        (GOOD, "passes"),
        (BAD, "FAILS"),
        (within("x", "s", "q", 2.0, 2.1, 1e-3, explanation="misprint"), "differs"),
        (within("x", "s", "q", 2.0, 2.001, 1e-3, relative=False), "passes"),
        (within("x", "s", "q", 2.0, float("nan"), 1e-3), "FAILS"),
        (printed("x", "s", "q", "1.55", 1.5549), "passes"),
        (printed("x", "s", "q", "1.55", 1.5551), "FAILS"),
        (printed("x", "s", "q", "1.55", 1.5551, digits=2), "passes"),
        (printed("x", "s", "q", "4.5825e-3", 4.58254e-3), "passes"),
        (printed("x", "s", "q", "4.5825e-3", 4.58256e-3), "FAILS"),
        (at_most("x", "s", "q", 1e-9, -2e-9), "FAILS"),
        (at_most("x", "s", "q", 0.0, 0.0), "passes"),
        (counted("x", "s", "q", 6, 6.0), "passes"),
        (counted("x", "s", "q", 6, 5), "FAILS"),
        (information("x", "s", "q", 6.0, 5), "information"),
    ],
)
def test_verdicts(row, verdict):
    assert row.verdict == verdict


def test_error_is_relative_where_the_row_says_so():
    assert GOOD.error == pytest.approx(1e-4)
    assert within("x", "s", "q", -2.0, -2.1, 1.0).error == pytest.approx(-0.05)
    assert within("x", "s", "q", 2.0, 2.1, 1.0, relative=False).error == pytest.approx(0.1)


def written(result) -> str:
    """Page of a validation."""
    introductions = {theme.title: theme.introduction for theme in result.themes}
    return page(records(result), introductions, quick=result.quick)


def test_rows_hold_what_is_computed_and_the_page_says_what_differs():
    differs = within("B|1", "paper", "height [m]", 1.0, 1.5, 0.1, explanation="the paper has a misprint")
    result = validation(GOOD, BAD, differs, at_most("C", "s", "rest", 1e-6, 3e-8))
    assert [tuple(row.values())[1:] for row in records(result)] == [
        ("A1", "length [m]", "2", "2.0002", "+0.01 %", "0.1 %", "passes", "Closed form.", ""),
        ("A2", "width [m]", "2", "2.1", "+5 %", "0.1 %", "FAILS", "Closed form.", ""),
        ("B|1", "height [m]", "1", "1.5", "+50 %", "10 %", "differs", "Paper.", "The paper has a misprint."),
        ("C", "rest", "0", "< 1e-06", "", "<= 1e-06", "passes", "s.", ""),
    ]
    text = written(result)
    assert "4 rows: 2 passes, 1 FAILS, 1 differs." in text
    assert "**Sample, B|1.** The paper has a misprint. Reference: Paper." in text
    assert "* height [m]: 1.5 beside 1 (+50 %, gate 10 %)" in text and "* width [m]: 2.1 beside 2" in text


def test_rows_that_differ_for_one_reason_stand_together():
    rows = [within("x", source, f"q{i}", 1.0, 1.5, 0.1, explanation="why") for i, source in enumerate("aab")]
    text = written(validation(*rows))
    assert text.count("Why.") == 1 and "* q2: 1.5 beside 1 (+50 %, gate 10 %). b." in text


def test_page_has_no_dates_paths_or_machine():
    text = written(validation(GOOD))
    assert text == written(validation(GOOD))
    assert not re.search(r"20\d\d-\d\d-\d\d|/home|/tmp|/work", text)


def test_no_time_that_a_machine_took_is_on_the_page():
    """The modules of the rows have no clock; test modules may."""
    clock = re.compile(r"^\s*(?:import|from) (?:time|timeit|datetime)\b|process_time|perf_counter", re.MULTILINE)
    folder = Path(__file__).parents[2] / "validation"
    modules = [*folder.glob("*.py"), *(folder / "reference").rglob("*.py")]
    assert len(modules) > 30 and clock.search(Path(__file__).with_name("test_three_routes.py").read_text("utf-8"))
    assert [path.name for path in modules if clock.search(path.read_text("utf-8"))] == []
    text = (folder.parent / "docs" / "validation.csv").read_text("utf-8")
    assert not re.search(r"\d (?:ms|s|min|seconds) (?:of (?:one|a) processor|CPU|wall)", text)


def test_quick_page_says_so_and_leaves_slow_parts_out():
    def never():
        raise AssertionError

    theme = Theme("sample", "Sample", "", (lambda: (GOOD,),), (never,))
    assert "Quick validation" in written(run_validation((theme,), quick=True))
    with pytest.raises(AssertionError):
        run_validation((theme,))


def test_a_refusal_becomes_a_failed_row():
    def no_grid():
        raise GridError("no elements", code="E-GRID-EMPTY")

    result = run_validation((Theme("sample", "Sample", "", (no_grid, lambda: (GOOD,))),))
    assert [row.verdict for row in result.rows] == ["FAILS", "passes"]
    assert "no grid could not be computed" in summary(result)
    assert "E-GRID-EMPTY" in written(result)


def test_progress_counts_the_parts():
    seen = []
    theme = Theme("sample", "Sample", "", (lambda: (GOOD,), lambda: (BAD,)))
    run_validation((theme,), progress=lambda *step: seen.append(step))
    assert seen == [("sample", 0, 2), ("sample", 1, 2), ("sample", 2, 2)]


@pytest.mark.parametrize(("row", "code"), [(GOOD, 0), (BAD, 3)])
def test_exit_code_and_page_of_the_command(tmp_path, monkeypatch, capsys, row, code):
    monkeypatch.setattr(validation_themes, "THEMES", (Theme("sample", "Sample", "", (lambda: (row,),)),))
    path = tmp_path / "new" / "validation.md"
    assert main(["-o", str(path)]) == code
    assert read_rows(path.with_suffix(".csv"))[0]["quantity"] == row.quantity
    text = path.read_text(encoding="utf-8")
    assert "1 rows: 1" in text
    path.unlink()
    assert main(["-o", str(path), "--page"]) == 0
    assert path.read_text(encoding="utf-8") == text
    out = capsys.readouterr().out
    assert ("FAILS A2: width [m]" in out) == (code == 3)
    assert "1 rows" in out


def test_one_theme_prints_its_rows_and_writes_no_page(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    themes = tuple(Theme(name, f"The {name}", "", (lambda row=row: (row,),)) for name, row in (("a", GOOD), ("b", BAD)))
    monkeypatch.setattr(validation_themes, "THEMES", themes)
    assert main(["--theme", "a"]) == 0
    out = capsys.readouterr().out
    assert main(["--theme", "the A"]) == 0 and capsys.readouterr().out == out  # by its title too
    assert f"passes {GOOD.case}: {GOOD.quantity}" in out and BAD.quantity not in out
    assert main(["--theme", "b"]) == 3
    assert capsys.readouterr().out.count(f"FAILS {BAD.case}: {BAD.quantity}") == 1
    assert main(["--theme", "c"]) == 2
    assert "allowed: a, b" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_without_options_the_page_of_the_repository_is_written(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    written = []
    monkeypatch.setattr(
        "validation.validate",
        lambda output, *, theme, quick, progress: written.append((output, theme, quick)),
    )
    main([])
    main(["--quick"])
    path = Path(__file__).parents[2] / "docs" / "validation.md"
    assert written == [(path, None, False), (path, None, True)]


def test_quick_leaves_slow_parts_out_on_the_command_line(tmp_path, monkeypatch, capsys):
    theme = Theme("sample", "Sample", "", (lambda: (GOOD,),), (lambda: (BAD,),))
    monkeypatch.setattr(validation_themes, "THEMES", (theme,))
    assert main(["--quick", "-o", str(tmp_path / "quick.md")]) == 0
    assert main(["-o", str(tmp_path / "whole.md")]) == 3
    assert "Quick validation" in (tmp_path / "quick.md").read_text(encoding="utf-8")


def test_the_command_runs_from_any_folder(tmp_path):
    folder = Path(__file__).parents[2] / "validation"
    words = [sys.executable, str(folder), "--help"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=True)
    assert "--theme" in done.stdout


def test_a_theme_that_is_none_is_refused_with_those_that_there_are(capsys):
    assert main(["--theme", "none"]) == 2
    printed = capsys.readouterr().err
    assert "E-THEME" in printed and "geometry" in printed


def test_an_interruption_is_no_traceback(monkeypatch, capsys):
    def interrupted():
        raise KeyboardInterrupt

    monkeypatch.setattr(validation_themes, "THEMES", (Theme("a", "a", "", (interrupted,)),))
    assert main(["--theme", "a"]) == 130
    assert "interrupted" in capsys.readouterr().err


def test_a_page_that_cannot_be_written_leaves_the_old_one(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("old")
    with pytest.raises(StorageError):
        write_page(validation(GOOD), blocked / "validation.md")
    monkeypatch.setattr(validation_themes, "THEMES", (Theme("a", "a", "", (lambda: (GOOD,),)),))
    assert main(["-o", str(blocked / "validation.md")]) == 4
    assert blocked.read_text() == "old"


def test_the_page_in_the_repository_is_that_of_its_rows():
    path = Path(__file__).parents[2] / "docs" / "validation.md"
    rows = read_rows(path.with_suffix(".csv"))
    introductions = {theme.title: theme.introduction for theme in validation_themes.THEMES}
    assert path.read_text(encoding="utf-8") == page(rows, introductions), "run python validation --page"
    assert list(dict.fromkeys(row["theme"] for row in rows)) == list(introductions)
    assert {tuple(row) for row in rows} == {FIELDS}


PARTS = [(theme, part) for theme in validation_themes.THEMES for part in theme.parts]
SLOW = [(theme, part) for theme in validation_themes.THEMES for part in theme.slow_parts]


# parts whose dear checks a test in the named file makes as well; rows of "information" alone cannot fail
ELSEWHERE = {
    "stops": "solvers/continuation/test_branches.py::test_two_masses_with_stops_against_integration_in_time",
    "two_tones": "solvers/periodic/test_harmonic_balance_integration.py::test_two_tones_against_long_integration",
    "turning_carrier": "validation/test_plane_vibration.py::test_changes_with_the_carrier_speed_are_those_of_the_page",
    "energy": "solvers/time/test_transient.py::test_average_acceleration_keeps_the_energy",
    "toothed_ring": "information",
    "passes": "trains/gearbox/test_deflection.py::test_contact_and_system_settle_whatever_they_start_from",
    "loaded_states": "validation/test_gearbox_statics.py::test_teeth_in_a_gearbox_touch_as_alone",
    "elastic_ring": "trains/gearbox/test_elastic_ring.py::test_modes_are_those_of_the_set_on_its_foundation",
    "wind_turbine": "trains/gearbox/test_modes.py"
    "::test_the_wind_turbine_twists_as_its_rotor_and_generator_on_one_spring",
    "time_integration": "solvers/periodic/test_harmonic_balance_integration.py::test_planetary_set_with_backlash",
    "duffing_routes": "validation/test_three_routes.py::test_duffing_against_an_integration_without_femgear",
    "pair_routes": "validation/test_three_routes.py::test_gear_pair_against_an_integration_without_femgear",
    "train_routes": "validation/test_three_routes.py::test_planetary_train_against_an_integration_without_femgear",
    "limit_points": "solvers/continuation/test_branches.py::test_limit_points_of_the_published_example",
    "free_duffing": "solvers/periodic/test_shooting.py::test_free_duffing_against_elliptic_integrals",
    "small_sets": "housing/two_way/test_response.py::test_one_linear_system_of_all_harmonics_gives_the_same_forces",
    "meshed": "trains/gearbox/test_casing.py::test_a_shaft_in_the_casing_is_all_that_matrices_written_out_say",
    "three_motions": "solvers/continuation/test_branches.py::test_stability_changes_at_the_limit_points_only",
    "library": "fe/test_beam.py::test_rows_of_the_validation_pass",
    "turning": "fe/test_beam.py::test_rows_of_the_validation_pass",
    "some_random_problems": "contact/test_solve.py::test_200_random_positions_agree_with_daqp",
}


# each takes half a second or more: `make validate` computes these rows, as it does all
LONG = {
    "drivetrain": {"former_modes", "general_integrator", "former_histories", "base_line"},
    "dynamics": {"fixed_point", "modes_kept", "harmonics_kept"},
    "elasticity": {"thick_cylinder"},
    "face width": {"cantilever_plate"},
    "faults": {"energy_release"},
    "fixed_housing": {"yielding", "axisymmetric"},
    "gearbox": {"beams", "images", "on_feet", "rigid_body", "other_trains", "of_files"},
    "gearbox_nonlinear": {"pairs"},
    "gearbox_planets": {"simple_planets"},
    "gearbox_response": {"on_foundation", "friction_of_stages"},
    "heat": {"whole_run"},
    "housing": {"interpolation"},
    "impacts": {"one_term_balance"},
    "life": {"single_runs"},
    "losses": {"sets", "fzg_gears", "computed_loads"},
    "members": {"rigid_relief", "relief"},
    "modulation": {"linear_interpolation"},
    "multistage": {"published", "response", "former_modes", "former_response", "uncoupled", "structure"},
    "nonlinear vibration": {"dead_zone"},
    "other_programs": {"matrices"},
    "rims": {"sharing_with_a_thin_rim"},
    "ring": {"other_outline"},
    "sound": {"side_bands", "loudness"},
    "static": {"equilibrium"},
    "stress": {"hertz_of_teeth"},
    "support": {"annuli"},
    "time integration": {"order"},
    "two routes": {"same_depth"},
    "vibration": {"annulus"},
    "wind turbine sets": {"linear_peak"},
}


def _marked(theme, part):
    long = part.__name__ in ELSEWHERE or part.__name__ in LONG.get(theme.name, ())
    slow = [pytest.mark.slow] if long else []
    return pytest.param(theme, part, marks=slow)


def _name(value):
    return getattr(value, "name", None) or value.__name__


def _check(theme, part):
    rows = run_validation((Theme(theme.name, theme.title, "", (part,)),)).rows
    assert rows
    assert [row for row in rows if row.verdict == "FAILS"] == []
    assert all(row.source for row in rows)


@pytest.mark.parametrize(("theme", "part"), [_marked(*one) for one in PARTS], ids=_name)
def test_rows_pass(theme, part):
    _check(theme, part)


def test_parts_that_are_left_out_are_checked_elsewhere():
    assert {part.__name__ for _, part in PARTS} >= set(ELSEWHERE)
    assert {(theme.name, part.__name__) for theme, part in PARTS} >= {(name, x) for name in LONG for x in LONG[name]}
    for place in set(ELSEWHERE.values()) - {"information"}:
        file, name = place.split("::")
        assert f"\ndef {name}(" in (Path(__file__).parents[1] / file).read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize(("theme", "part"), SLOW, ids=_name)
def test_slow_rows_pass(theme, part):
    _check(theme, part)
