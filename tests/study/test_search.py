"""Searches against closed forms and scans; journals that survive being killed; refusals."""

import json
import math
import subprocess
import sys
import textwrap
import warnings
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from femgear import cli
from femgear.case.gear_set import planetary_set
from femgear.errors import CaseError, ConvergenceError, StorageError
from femgear.findings import Finding, FindingWarning
from femgear.study.designs import Designs, Failure, Journal, evaluations, open_designs
from femgear.study.front import check_second, pareto_front
from femgear.study.objectives import (
    NUMBER,
    StudyQuantity,
    contact_ratio,
    named_quantity,
    tip_thickness,
    transmission_error,
)
from femgear.study.problem import Limit, Problem, Variable
from femgear.study.search import SearchOptions, _linear_program, has_derivatives, minimise, signals
from femgear.study.sweep import describe_sweep, parse_over, sweep, sweep_into
from femgear.trains.live import Live
from femgear.trains.reading import read_case, with_value, with_values

pytestmark = pytest.mark.usefixtures("pictures_undrawn", "coarse_states")

CASE = Path(__file__).resolve().parents[2] / "cases" / "planetary_27_40_108.toml"
# entries without consequences for the gears: numbers from 0 to 1 and masses
X, Y = Variable("dynamics.damping_ratio", 0.05, 0.95), Variable("carrier.mass", "0.1 kg", "3 kg")


@pytest.fixture(scope="module")
def case():
    return read_case(CASE)


def function(name, value):
    """Quantity of the damping ratio and the mass of the carrier [kg]."""
    return StudyQuantity(
        name, NUMBER, "gears", lambda v: float(value(v.case.dynamics.damping_ratio, v.case.carrier.mass))
    )


ROSENBROCK = function("Rosenbrock", lambda x, y: 1.0 + (0.6 - x) ** 2 + 10.0 * (y - x**2 / 0.6**2) ** 2)
X_ALONE = function("x", lambda x, y: x)


@pytest.mark.parametrize("method", ["global", "simplex", "powell"])
def test_searches_find_the_minimum_of_a_curved_valley(case, method):
    found = minimise(
        Problem(case, [X, Y], ROSENBROCK),
        method=method,
        options=SearchOptions(samples=8, generations=6),
        sensitivity=False,
    )
    assert found.after["Rosenbrock"] == pytest.approx(1.0, abs=2e-3)
    np.testing.assert_allclose(found.x, [0.6, 1.0], atol=0.05)
    assert found.gain() == pytest.approx(1 - found.after["Rosenbrock"] / found.before["Rosenbrock"])
    assert found.before["Rosenbrock"] == pytest.approx(1 + 0.55**2 + 10 * (3 - 0.05**2 / 0.36) ** 2)
    assert found.failures == 0 and found.at_bounds == () and len(found.course) <= found.designs


def test_tolerances_cost_what_the_function_says(case):
    bowl = function("bowl", lambda x, y: 2.0 + (x - 0.5) ** 2 + 3.0 * abs(y - 1.0))
    variables = (Variable(X.key, 0.05, 0.95, tolerance="10 %"), Variable(Y.key, "0.1 kg", "3 kg", "200 g"))
    problem = Problem(case, variables, bowl)
    found = minimise(problem, method="simplex", start=[0.45, 1.05])
    x, y = found.x
    first, second = found.tolerances
    assert (first.tolerance, second.tolerance) == (pytest.approx(0.1 * x), pytest.approx(0.2))
    assert first.more["bowl"] == pytest.approx(2 + (1.1 * x - 0.5) ** 2 + 3 * abs(y - 1), abs=1e-8)
    less, more = second.slope("bowl", found.after["bowl"])
    assert less == pytest.approx(3.0, rel=0.05) and more == pytest.approx(3.0, rel=0.05)
    corner = max(first.less["bowl"], first.more["bowl"]) + max(second.less["bowl"], second.more["bowl"])
    assert found.all_off["bowl"] == pytest.approx(corner - found.after["bowl"], abs=1e-6)
    assert "carrier.mass off by 0.2 kg" in found.summary()


def test_a_limit_of_the_gears_is_met_exactly(case):
    """The thinnest tip that a limit allows, over the planet's shift, against the root of the geometry."""
    from dataclasses import replace

    from scipy.optimize import brentq

    from femgear.gears.gear import tooth_thickness

    open_tips = {"sun.tip_diameter": None, "planet.tip_diameter": None}
    free = with_values(case, {"sun.profile_shift": None, "ring.profile_shift": None, **open_tips})
    shift, limit = Variable("planet.profile_shift", -0.05, 0.25), Limit(tip_thickness("planet"), low=0.74)
    thin = StudyQuantity("thinness", NUMBER, "gears", lambda v: tip_thickness("planet").compute(v) ** 2)
    found = minimise(
        Problem(free, [shift], thin, limits=[limit]),
        method="simplex",
        start=[0.0],
        sensitivity=False,
    )
    planet = planetary_set(free).planet

    def excess(x):
        gear = replace(planet, profile_shift=x)
        return float(tooth_thickness(gear, gear.tip_radius)) / gear.module - 0.74

    edge = brentq(excess, 0.0, 0.25, xtol=1e-9)
    assert found.after[limit.quantity.name] >= 0.74
    assert 0.1 < edge < 0.24 and found.x[0] == pytest.approx(edge, abs=1e-3)
    assert np.isnan(found.course).any()


def test_the_linear_program_is_chebyshevs():
    """The straight line nearest to t^3: T_3/4 is what is left, peak to peak 1/2 (P. L. Chebyshev)."""
    t = np.cos(np.pi * np.arange(61) / 60)
    move, left = _linear_program((t**3)[None], -t[None, None], np.zeros(1), -np.ones(1), np.ones(1), 1.0)
    assert move[0] == pytest.approx(0.75, abs=1e-9) and left == pytest.approx(0.5, abs=1e-9)
    # a box of a tenth of the range of 2 is not left
    move, left = _linear_program((t**3)[None], -t[None, None], np.zeros(1), -np.ones(1), np.ones(1), 0.1)
    assert move[0] == pytest.approx(0.2) and left == pytest.approx(np.ptp(t**3 - 0.2 * t))


@pytest.fixture(scope="module")
def grids(tmp_path_factory):
    return tmp_path_factory.mktemp("grids")


@pytest.fixture(scope="module")
def relief_problem(case):
    """One amount for the tips of sun and planets, starting at single-pair contact; coarse."""
    from femgear.study.relief import relief_starts

    gears = planetary_set(case)
    starts = relief_starts(gears, length=1.0)
    places = [f"{2e3 * math.hypot(s, g.base_radius):.9g} mm" for s, g in zip(starts, (gears.sun, gears.planet))]
    tables = [{"kind": "tip relief", "amount": "0 um", "start_diameter": place} for place in places]
    tables[1]["flank"] = "sun side"
    coarse = with_values(
        case,
        {
            "static.flank_elements": 4,
            "static.positions": 14,
            "static.stresses": False,
            "sun.modifications": tables[:1],
            "planet.modifications": tables[1:],
        },
    )
    keys = ("sun.modifications[0].amount", "planet.modifications[0].amount")
    return Problem(coarse, [Variable(keys, "0 um", "12 um", "1 um")], transmission_error("sun-planet"))


@pytest.mark.slow
def test_descents_find_the_relief_that_a_scan_finds(relief_problem, grids, tmp_path):
    """Against whole contact problems of `harris_map`, which knows nothing of variants and journals."""
    from femgear.study.relief import design_basis, harris_map, with_tip_relief

    few = SearchOptions(samples=1, starts=1)
    options = {"options": few, "journal": tmp_path / "journal.jsonl", "cache": grids}
    found = minimise(relief_problem, **options)
    assert found.method == "minimax" and found.converged
    basis = design_basis(relief_problem.case, cache=grids)
    amounts = found.x[0] * 1e-6 + np.linspace(-0.5e-6, 0.5e-6, 3)
    variants = [None, *(with_tip_relief(None, basis.gears, amount=a) for a in amounts)]
    scan = harris_map(replace(basis, positions=14), torques=[100.0], deviations=variants)
    peaks, name = scan.peak_to_peak[:, 0, 0], relief_problem.objective.name
    # a relief of no amount still divides the windows of the contact
    assert found.before[name] == pytest.approx(peaks[0], rel=1e-3)
    assert found.after[name] == pytest.approx(peaks[2], rel=1e-5)
    assert found.after[name] <= peaks.min() * (1 + 1e-6)
    off = found.tolerances[0]
    slopes = np.diff(peaks[1:])
    # the peak to peak is convex in the amount as long as the same cells touch, nearly so beyond
    assert off.less[name] > found.after[name] < off.more[name] and slopes[0] < 0 < slopes[1]
    assert found.gain() > 0.6
    again = minimise(relief_problem, **options)
    assert again.computed == 0 and again.after == found.after and again.designs == found.designs


@pytest.mark.slow
def test_derivatives_are_differences(relief_problem, grids):
    assert has_derivatives(relief_problem)
    with evaluations(relief_problem, cache=grids) as run:
        value, slopes = signals(run, [3.0])
        cycles = [run.designs.answer(relief_problem.point([a])).static.cycle for a in (2.99, 3.0, 3.01)]
    # the linearisation has the positions between as well, where the extremes lie
    common = np.isin(np.sort(np.append(cycles[1].position, cycles[1].between.position)), cycles[1].position)
    np.testing.assert_allclose(value[:, common], cycles[1].deflection[:3], rtol=1e-9)
    assert np.ptp(value, axis=1).max() == pytest.approx(cycles[1].peak_to_peak()[:3].max(), rel=1e-9)
    differences = (cycles[2].deflection[:3] - cycles[0].deflection[:3]) / 0.02
    np.testing.assert_allclose(slopes[0][:, common], differences, atol=2e-3 * np.abs(differences).max())


def test_what_has_no_derivatives(case, relief_problem):
    from dataclasses import replace

    from femgear.study.objectives import mesh_force

    force = mesh_force("1000 rpm", "2000 rpm")
    assert not has_derivatives(replace(relief_problem, objective=force))
    shift = Problem(case, [Variable("sun.profile_shift", 0.5, 0.6)], transmission_error())
    assert not has_derivatives(shift)
    sided = with_value(relief_problem.case, "static.back_flanks", True)
    assert not has_derivatives(replace(relief_problem, case=sided))
    with pytest.raises(CaseError, match="no derivatives"):
        minimise(shift, method="minimax")


KILLED = """
    import os, sys
    from pathlib import Path
    sys.path.insert(0, {tests!r})
    from test_search import CASE, ROSENBROCK, X, Y
    from femgear import read_case
    from femgear.study import Problem, SearchOptions, minimise

    def progress(stage, done, total):
        if done == 9:
            os.kill(os.getpid(), 9)

    options = SearchOptions(samples=8, generations=2)
    problem = Problem(read_case(CASE), [X, Y], ROSENBROCK)
    minimise(problem, method="global", options=options, sensitivity=False,
             journal={journal!r}, progress=progress)
"""


@pytest.mark.slow
def test_a_killed_search_goes_on_and_repeats_nothing(case, tmp_path):
    journal = tmp_path / "journal.jsonl"
    code = textwrap.dedent(KILLED).format(tests=str(Path(__file__).parent), journal=str(journal))
    killed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert killed.returncode == -9, killed.stderr
    assert len(journal.read_bytes().splitlines()) == 1 + 9
    # the last line half written
    journal.write_bytes(journal.read_bytes()[:-20])
    extent = SearchOptions(samples=8, generations=2)
    options = {"method": "global", "options": extent, "sensitivity": False}
    problem = Problem(case, [X, Y], ROSENBROCK)
    found, alone = minimise(problem, journal=journal, **options), minimise(problem, **options)
    assert found.computed == alone.computed - 8
    assert found.after == alone.after and found.course == alone.course and found.designs == alone.designs
    keys = [json.loads(line)["key"] for line in journal.read_bytes().splitlines()[1:]]
    assert len(keys) == len(set(keys)) == found.designs


def test_designs_that_cannot_be_computed_are_not_asked_again(case, tmp_path):
    """Sun shifts that do not close on the centre distance."""
    keys, point = [("sun.profile_shift",)], (0.9,)
    for computed in (1, 0):
        with open_designs(case, keys, journal=tmp_path / "j.jsonl") as designs:
            with pytest.raises(Failure) as failure:
                designs.values(point, [contact_ratio("sun-planet")])
            assert designs.computed == computed
            assert failure.value.error["code"].startswith("E-") and failure.value.error["message"]
            assert [place for place, _ in designs.failures] == [point]


def test_searches_pass_over_what_cannot_be_computed(case):
    case = with_values(case, {"sun.tip_diameter": None})
    problem = Problem(case, [Variable("sun.profile_shift", 0.1, 0.9)], contact_ratio("sun-planet"))
    found = minimise(problem, method="simplex", start=[0.52681], sensitivity=False)
    assert found.failures > 0 and found.at_bounds == ("sun.profile_shift",)
    assert found.values == {"sun.profile_shift": 0.1}
    impossible = Problem(case, [X], ROSENBROCK, limits=[Limit(contact_ratio("sun-planet"), low=3.0)])
    with pytest.raises(ConvergenceError, match=r"(?s)none of .* lies within the limits.*>= 3"):
        minimise(impossible, method="simplex")


def test_a_search_ends_after_so_many_designs(case):
    seven = SearchOptions(max_designs=7)
    found = minimise(Problem(case, [X, Y], ROSENBROCK), method="global", options=seven, sensitivity=False)
    assert found.designs == 7 and not found.converged and "7 designs" in found.message
    assert found.after["Rosenbrock"] == min(found.course)


def test_sweep_of_all_combinations(case, tmp_path):
    over = {"dynamics.damping_ratio": [0.1, 0.2], "carrier.mass": ["1 kg", "2 kg", "3 kg"]}
    product = function("product", lambda x, y: x * y)
    found = sweep(case, over, [product, contact_ratio("sun-planet")], journal=tmp_path / "s.jsonl")
    np.testing.assert_allclose(found.values[:, 0], np.outer([0.1, 0.2], [1, 2, 3]).ravel())
    assert found.points[1] == (0.1, "2 kg") and found.computed == 6
    assert found.header[:3] == ("dynamics.damping_ratio", "carrier.mass", "product [1]")
    over["carrier.mass"].append("4 kg")
    wider = sweep(case, over, [product], journal=tmp_path / "s.jsonl")
    assert wider.computed == 2 and len(list(wider.records())) == 8
    bad = sweep(case, {"sun.profile_shift": [0.52681, 0.9]}, [contact_ratio("sun-planet")])
    assert bad.errors[0] == "" and bad.errors[1].startswith("[E-") and np.isnan(bad.values[1, 0])


def early(answer):
    """A finding of designs with little damping."""
    yield Finding("W-LOAD", "", "a note is no doubt")
    if answer.case.dynamics.damping_ratio < 0.55:
        yield Finding("W-EXCITATION", "dynamics", "ends early")


def test_an_optimum_tells_its_findings_and_a_front_those_of_its_designs(case, tmp_path):
    """Once each, of the design that is returned, from memory as from the journal."""
    first = replace(function("one", lambda x, y: (x - 0.3) ** 2), findings=early)
    second = function("two", lambda x, y: (x - 0.9) ** 2)
    options = {"method": "simplex", "start": [0.4, 1.0], "journal": tmp_path / "j", "sensitivity": False}
    for _ in range(2):
        with pytest.warns(FindingWarning) as told:
            found = minimise(Problem(case, [X, Y], first), **options)
        assert found.findings == (Finding("W-EXCITATION", "dynamics", "ends early"),)
        assert [one.message.args[0] for one in told] == [*found.findings]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        silent = SearchOptions(telling=False)
        assert minimise(Problem(case, [X, Y], first), options=silent, **options).findings == ()
        assert minimise(Problem(case, [X, Y], second), **options | {"journal": None}).findings == ()
    with pytest.warns(FindingWarning, match="designs of the front") as told:
        front = pareto_front(Problem(case, [X], first), second, options=SearchOptions(samples=6))
    doubtful = [len(findings) for findings in front.findings]
    assert len(told) == 1 and doubtful == [int(x < 0.55) for x in front.x[:, 0]]
    assert str(told[0].message).find(f"{sum(doubtful)} of {len(doubtful)} designs") > 0


def test_an_optimum_of_the_teeth_has_the_findings_of_its_contact(case):
    """Ten times the torque presses more than any steel carries, whatever the objective is."""
    pressed = with_values(case, {"operation.torque": "8000 N m", "static.positions": 8, "static.flank_elements": 6})
    problem = Problem(pressed, [X], transmission_error("overall"))
    with pytest.warns(FindingWarning):
        found = minimise(problem, method="simplex", options=SearchOptions(max_designs=3), sensitivity=False)
    assert "W-PRESSURE" in {one.code for one in found.findings}


def test_doubtful_numbers_of_a_sweep_have_the_codes_of_their_findings(case, tmp_path, capsys):
    """In table, file and journal, from memory as from the journal; told once, with how many cases."""

    def doubts(answer):
        yield Finding("W-LOAD", "", "a note is no doubt")
        if answer.case.dynamics.damping_ratio < 0.15:
            yield Finding("W-EXCITATION", "", "ends early")

    doubtful = replace(function("doubtful", lambda x, y: x), findings=doubts)
    over, journal = {"dynamics.damping_ratio": [0.1, 0.12, 0.2]}, tmp_path / "s.jsonl"
    # values that were kept without a look at what concerns them
    with open_designs(case, [("dynamics.damping_ratio",)], journal=journal) as designs:
        assert designs.values((0.1,), [doubtful]) == {"doubtful": 0.1}
    for computed in (3, 0):
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            found = sweep(case, over, [doubtful, X_ALONE], journal=journal)
        assert found.computed == computed
        assert [row[-2] for row in found.records()] == ["W-EXCITATION", "W-EXCITATION", ""]
        assert found.header[-2:] == ("findings", "error")
        (text,) = (str(one.message.args[0]) for one in told)
        assert text.startswith("[W-EXCITATION] 2 of 3 cases (column findings), doubtful: the excitation ends")
    block = describe_sweep(found)
    assert block.header[-1] == "findings"
    assert [row[-1] for row in block.rows] == ["W-EXCITATION", "W-EXCITATION", "-"]
    with warnings.catch_warnings(action="error"):
        assert describe_sweep(sweep(case, over, [X_ALONE])).header[-1] == "x [1]"


@pytest.mark.slow
def test_forces_and_levels_over_speeds_tell_where_their_excitation_ends_short(case):
    """Three mesh harmonics, against none given; whatever finds the response."""
    coarse = {"static.flank_elements": 6, "static.positions": 16}
    speeds = {"speeds": ("900 rpm", "1500 rpm")}
    quantities = [replace_speeds(named_quantity(name, **speeds)) for name in ("mesh force", "housing")]
    few = Live(with_values(case, coarse | {"dynamics.mesh_harmonics": 3})).answer
    assert [quantity.doubts(few) for quantity in quantities] == [["W-EXCITATION"], ["W-EXCITATION"]]
    enough = few.of(with_values(few.case, {"dynamics.mesh_harmonics": None, "dynamics.damping_ratio": 0}))
    assert all("W-DAMPING" in quantity.doubts(enough) for quantity in quantities)


def replace_speeds(quantity):
    """The quantity at three speeds, so that it takes less time."""
    compute, findings = quantity.compute, quantity.findings
    at = (*compute.args[0][:2], 3)
    return replace(
        quantity,
        compute=partial(compute.func, at, *compute.args[1:]),
        findings=partial(findings.func, at),
    )


def test_a_sweep_writes_a_table_and_a_figure(case, tmp_path):
    import csv

    of = ["contact ratio sun-planet", "tip thickness planet"]
    free = with_values(case, {"sun.profile_shift": None, "ring.profile_shift": None})
    over = ["set.centre_distance=51 mm,51.05 mm", "planet.profile_shift=0..0.1/3"]
    found, names = sweep_into(free, tmp_path / "out", over=over, of=of)
    with open(tmp_path / "out" / "sweep.csv", newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 6 and rows[4]["planet.profile_shift"] == "0.05"
    for row, point in zip(rows, found.points):
        gears = planetary_set(with_values(free, dict(zip(found.keys, point))))
        assert float(row["contact ratio, sun-planet [1]"]) == pytest.approx(gears.contact_ratio_sun_planet)
    assert (tmp_path / "out" / "sweep.png").read_bytes().startswith(b"\x89PNG") and len(names) == 3
    again, _ = sweep_into(free, tmp_path / "out", over=over, of=of)
    assert again.computed == 0
    with pytest.raises(CaseError, match="given twice"):
        sweep_into(case, tmp_path / "two", over=[over[0], over[0]])
    with pytest.raises(CaseError, match="no such quantity"):
        sweep_into(case, tmp_path / "two", over=over, of=["noise"])
    with pytest.raises(CaseError, match="not a unit of length"):
        sweep_into(case, tmp_path / "two", over=["set.centre_distance=51 s"], of=of)
    assert not (tmp_path / "two").exists()


def test_values_of_a_sweep_may_be_lists(case, tmp_path):
    even, uneven = ([f"{a} deg" for a in angles] for angles in ((0, 120, 240), (0, 120, 230)))
    quantity = named_quantity("tip thickness sun")
    found = sweep(case, {"set.planet_angles": [even, uneven]}, [quantity])
    assert found.points == ((even,), (uneven,)) and not found.errors[0]
    with pytest.raises(CaseError, match="given twice"):
        sweep(case, {"set.planet_angles": [even, list(even)]}, [quantity])


def test_sweeps_on_the_command_line():
    assert parse_over("operation.torque=50 N m, 100 N m") == ("operation.torque", ["50 N m", "100 N m"])
    assert parse_over("sun.modifications[0].amount=0 um..12 um/4")[1] == ["0 um", "4 um", "8 um", "12 um"]
    assert parse_over("sun.teeth=27,28") == ("sun.teeth", [27, 28])
    assert parse_over("static.back_flanks=true,false")[1] == [True, False]
    assert parse_over("dynamics.damping_ratio=0.1..0.2/3")[1] == [0.1, 0.15, 0.2]
    for text in ("operation.torque", "=3", "sun.teeth=27,,28", "sun.profile_shift=0..1/1"):
        with pytest.raises(CaseError, match="not a key with values"):
            parse_over(text)


def test_journals_of_other_searches_are_refused(case, tmp_path):
    path = tmp_path / "journal.jsonl"
    with open_designs(case, [("carrier.mass",)], journal=path) as designs:
        designs.values((), [contact_ratio("sun-planet")])
        with (
            pytest.raises(StorageError, match="E-LOCKED"),
            open_designs(case, [("carrier.mass",)], journal=path),
        ):
            pass
    with pytest.raises(StorageError, match="other design variables"):
        open_designs(case, [("sun.mass",)], journal=path).__enter__()
    with pytest.raises(StorageError, match="another case"):
        open_designs(with_value(case, "carrier.mass", "2 kg"), [("carrier.mass",)], journal=path).__enter__()
    good = path.read_bytes()
    for notes in ("some notes\n", "some notes", "[]\nhalf a line"):
        path.write_text(notes)
        with pytest.raises(StorageError, match="not usable as a journal"):
            open_designs(case, [("carrier.mass",)], journal=path).__enter__()
        assert path.read_text() == notes
    # killed while the header was written
    path.write_bytes(good[:25])
    with open_designs(case, [("carrier.mass",)], journal=path):
        pass
    assert path.read_bytes() == good.splitlines(keepends=True)[0]


def test_results_that_are_no_numbers_are_failures(case):
    bad = function("bad", lambda x, y: math.nan)
    designs = Designs(case, [("carrier.mass",)], Journal(), cache=None, progress=None)
    with pytest.raises(Failure, match="not finite"):
        designs.values(("1 kg",), [bad])


@pytest.mark.parametrize(
    ("make", "code", "words"),
    [
        (lambda c: Variable("sun.profile_shift", 1.0, 0.5), "E-VARIABLE", "sun.profile_shift"),
        (lambda c: Variable("sun.profile_shift", 1.0, 0.5), "E-VARIABLE", 'write "0.5..1.0"'),
        (lambda c: Variable("sun.profile_shift", 0.5, 0.5), "E-VARIABLE", "equal"),
        (lambda c: sweep(c, {"sun.mass": ["1 kg", "1 kg"]}, [ROSENBROCK]), "E-DUPLICATE", "given twice"),
        (lambda c: named_quantity("housing", speeds=("100", "200 rpm")), "E-UNIT", "speeds: "),
        (lambda c: named_quantity("housing", speeds=("2 rpm", "1 rpm")), "E-OBJECTIVE", "lower speed first"),
        (lambda c: check_second(Problem(c, [X], ROSENBROCK), ROSENBROCK), "E-OBJECTIVE", "two objectives"),
        (lambda c: Variable("sun.mass", "1 kg", "2 mm"), "E-UNIT", "sun.mass"),
        (lambda c: Variable("sun.mass", "1 kg", 2.0), "E-UNIT", "sun.mass"),
        (lambda c: Variable("sun.mass", "heavy", "2 kg"), "E-VARIABLE", "sun.mass"),
        (lambda c: Variable("sun.teeth", 20.5, 30, integer=True), "E-VARIABLE", "whole numbers"),
        (lambda c: Variable("sun.mass", "1 kg", "2 kg", "-1 kg"), "E-VARIABLE", "tolerance"),
        (lambda c: Problem(c, [], ROSENBROCK), "E-VARIABLE", "needs a design variable"),
        (lambda c: Problem(c, [X, X], ROSENBROCK), "E-VARIABLE", "given twice"),
        (lambda c: Problem(c, [Variable("sun.masss", "1 kg", "2 kg")], ROSENBROCK), "E-KEY-UNKNOWN", "masss"),
        (lambda c: Problem(c, [Variable("sun.mass", "1 mm", "2 mm")], ROSENBROCK), "E-UNIT", "sun.mass"),
        (lambda c: Limit(ROSENBROCK), "E-OBJECTIVE", "Rosenbrock"),
        (lambda c: minimise(Problem(c, [X], ROSENBROCK), method="magic"), "E-CHOICE", "magic"),
        (lambda c: minimise(Problem(c, [X], ROSENBROCK), start=[2.0]), "E-START", "0.05 to 0.95"),
        (lambda c: SearchOptions(max_designs=1), "E-RANGE", "max_designs"),
        (lambda c: SearchOptions(starts=0), "E-RANGE", "starts"),
        (lambda c: pareto_front(Problem(c, [X], ROSENBROCK), X_ALONE, points=1), "E-RANGE", "points"),
        (lambda c: sweep(c, {}, [ROSENBROCK]), "E-VARIABLE", "0 cases"),
        (lambda c: sweep(c, {"sun.mass": ["1 mm"]}, [ROSENBROCK]), "E-UNIT", "sun.mass"),
        (lambda c: sweep(c, {"title": ["a", "b"]}, [ROSENBROCK]), "E-VARIABLE", "title"),
        (lambda c: Variable("sun.mass", 0.0, "2 kg"), "E-UNIT", "0.0 kg..2 kg"),
        (
            lambda c: Problem(c, [Variable("sun.modifications[9].amount", "0 um", "2 um")], ROSENBROCK),
            "E-TYPE",
            "",
        ),
        (
            lambda c: sweep(
                with_values(c, {"operation.torque": "0 N m"}),
                {"sun.mass": ["1 kg"]},
                [replace(ROSENBROCK, stage="static")],
            ),
            "E-NO-LOAD",
            "torque",
        ),
    ],
)
def test_refusals(case, make, code, words):
    with pytest.raises(CaseError) as refused:
        make(case)
    assert code in str(refused.value) and words in str(refused.value)


def test_thousands_of_cases_say_how_long_they_take(case, tmp_path, capsys):
    quick = function("x", lambda x, y: x)
    over = {"dynamics.damping_ratio": [0.01 * n for n in range(1, 9)], "carrier.mass": ["1 kg"]}
    said = pytest.warns(UserWarning, match="W-SWEEP. 5 more cases of about")
    with pytest.MonkeyPatch.context() as patch, said:
        patch.setattr(sys.modules["femgear.study.sweep"], "_MANY", 8)
        sweep(case, over, [quick])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sweep(case, over, [quick])
    # the command line prints warnings, nothing else does
    assert capsys.readouterr().err == ""
    arguments = [
        "sweep",
        str(CASE),
        "--over",
        "carrier.mass=1 kg..2 kg/8",
        "--of",
        "contact ratio sun-planet",
    ]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys.modules["femgear.study.sweep"], "_MANY", 8)
        assert cli.main([*arguments, "-o", str(tmp_path)]) == 0
    assert "warning: [W-SWEEP] 5 more cases of about" in capsys.readouterr().err


def test_whole_numbers(case):
    teeth = Variable("housing.points", 40, 60, integer=True)
    parabola = StudyQuantity("parabola", NUMBER, "gears", lambda v: 1.0 + (v.case.housing.points - 47) ** 2)
    options = SearchOptions(samples=6, generations=8)
    found = minimise(Problem(case, [teeth], parabola), method="global", options=options)
    assert found.values == {"housing.points": 47} and found.after["parabola"] == 1.0
    assert found.tolerances[0].tolerance == 1.0 and found.tolerances[0].more["parabola"] == 2.0
    with pytest.raises(CaseError, match="E-CHOICE"):
        minimise(Problem(case, [teeth], parabola), method="simplex")
