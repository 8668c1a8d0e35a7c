"""femgear teeth: what it writes, that sizes and errors are those of its cases, and what it refuses."""

import csv
import itertools
from dataclasses import replace

import numpy as np
import pytest
from script_runs import run_femgear

from femgear.gears.iso6336 import contact_safety, root_safety
from femgear.gears.tooth_search import ToothDemand, size_of
from femgear.stages.static import solve_static
from femgear.stages.strength import case_stresses
from femgear.study.teeth import ComputedTeeth, best_of_every_phasing, case_of, front_of
from femgear.trains.gearbox.power import gearbox_flow
from femgear.trains.gearbox.results import gearbox_warnings
from femgear.trains.reading import parse_case, read_case, with_values

pytestmark = pytest.mark.usefixtures("coarse_states")

QUICK = ("--tolerance", "0.004", "--best", "1", "--positions", "8", "--flank-elements", "6")
SET = ToothDemand(5.0)


def rows(path):
    with open(path, newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def test_the_best_are_listed_solved_and_drawn(tmp_path):
    done = run_femgear("teeth", "--ratio", "5", "--planets", "3..4", *QUICK, "-o", "out", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "Smallest planetary teeth" in done.stdout and "STE" in done.stdout
    listed = rows(tmp_path / "out" / "teeth.csv")
    volumes = [float(row["volume [m^3]"]) for row in listed]
    assert len(listed) > 20 and volumes == sorted(volumes)
    assert {row["planets"] for row in listed} == {"3", "4"}
    (case,) = (tmp_path / "out").glob("planetary_*.toml")
    assert (tmp_path / "out" / "teeth.png").stat().st_size > 5000
    changed = {"static.positions": 8, "static.flank_elements": 6, "static.stresses": False}
    error = solve_static(with_values(read_case(case), changed)).cycle.peak_to_peak("sun_arc")
    assert f"{1e6 * float(error):.3f}" in done.stdout


@pytest.mark.parametrize(
    ("kind", "ratio", "tolerance", "output"),
    [
        ("stepped", 9.0, "0.0005", "carrier"),
        pytest.param("double", 2.5, "0.001", "carrier", marks=pytest.mark.slow),
        pytest.param("ravigneaux", 22 / 15, "0.001", "ring", marks=pytest.mark.slow),
    ],
)
def test_sets_of_any_planets_have_sizes_errors_and_cases(kind, ratio, tolerance, output, tmp_path):
    quick = ("--best", "1", "--positions", "8", "--flank-elements", "6")
    arguments = ("--ratio", f"{ratio!r}", "--kind", kind, "--tolerance", tolerance, *quick, "-o", "out")
    done = run_femgear("teeth", *arguments, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "larger face width" in done.stdout and "mesh by mesh" in " ".join(done.stdout.split())
    assert len(rows(tmp_path / "out" / "teeth.csv")) > 5
    (case,) = (tmp_path / "out").glob(f"{kind}_*.toml")
    read = read_case(case)
    flow = gearbox_flow(read)
    driven = read.operation.load_case[0].speed
    assert [*driven] == ["small sun" if kind == "ravigneaux" else "sun"]
    assert abs(flow.speed[next(iter(driven))] / flow.speed[output]) == pytest.approx(ratio, rel=float(tolerance))
    assert not [finding for finding in gearbox_warnings(read) if finding.code != "W-MATERIAL"]


@pytest.mark.parametrize(
    ("demand", "teeth"),
    [
        (ToothDemand(10.5, kind="stepped"), (24, 57, 27, 108)),
        (ToothDemand(2.5, kind="double"), (24, 18, 20, 84)),
        (ToothDemand(22 / 15, kind="ravigneaux"), (30, 36, 18, 18, 72)),
        (ToothDemand(2.4, kind="ravigneaux", fixed="carrier"), (30, 36, 18, 18, 72)),
    ],
)
def test_torques_of_a_size_are_those_of_the_power_flow_of_its_case(demand, teeth):
    choice = size_of(demand, teeth, 3)
    case = parse_case(case_of(demand, choice))
    flow = gearbox_flow(case)
    torques = [abs(flow.first_torque(stage)) for stage in case.pair[: len(choice.torques)]]
    assert torques == pytest.approx(choice.torques, rel=1e-9, abs=1e-9)


def test_a_member_that_no_draft_holds_gives_sizes_alone(tmp_path):
    arguments = ("--ratio", "8", "--kind", "stepped", "--fixed", "carrier", "--tolerance", "0.0005", "-o", "out")
    done = run_femgear("teeth", *arguments, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "no cases" in done.stdout and [path.name for path in (tmp_path / "out").glob("*.toml")] == []


@pytest.mark.parametrize(
    ("demand", "teeth", "planets"), [(SET, (27, 40, 108), 3), (ToothDemand(1.5, kind="pair"), (24, 36), 1)]
)
def test_the_case_of_a_size_has_the_safety_that_was_asked_for(demand, teeth, planets):
    choice = size_of(demand, teeth, planets)
    case = parse_case(case_of(demand, choice))
    nominal = case_stresses(case, demand.torque)
    roots = [
        root_safety(
            demand.root_limit, stress, demand.load_factor, reversed_bending=teeth[1] == 40 and (kind, j) in BENT
        )
        for kind, stresses in enumerate(nominal.root)
        for j, stress in enumerate(stresses)
    ]
    flanks = [
        contact_safety(demand.contact_limit, stress * max(factors), demand.load_factor)
        for stress, factors in zip(nominal.contact, nominal.single_pair, strict=True)
    ]
    margins = min(roots) / demand.root_safety, (min(flanks) / demand.contact_safety) ** 2
    # modules and widths are rounded up, backlash and free tips of the case change contact ratios a little
    assert min(margins) == pytest.approx(1.0, abs=0.03)
    assert ("root" in choice.decides) == (margins[0] < margins[1])


BENT = {(0, 1), (1, 0)}
"""Places of the planet in both kinds of mesh."""


@pytest.mark.parametrize(("fixed", "ratio"), [("carrier", 4.0), ("sun", 1.25)])
def test_the_case_holds_the_member_that_was_asked_for(fixed, ratio):
    demand = replace(SET, ratio=ratio, fixed=fixed)
    case = parse_case(case_of(demand, size_of(demand, (27, 40, 108), 3)))
    assert case.operation.fixed == fixed
    assert case.torque_on_first_gear() == pytest.approx(demand.torque)


def test_the_smallest_of_every_phasing_are_chosen_first():
    demand = ToothDemand(4.0, planets=(4,))
    sizes = [size_of(demand, teeth, 4) for teeth in ((32, 32, 96), (28, 28, 84), (36, 36, 108), (30, 30, 90))]
    sizes.sort(key=lambda choice: choice.volume)
    picked = best_of_every_phasing(sizes, 2)
    assert {choice.left[0] for choice in picked} == {"torque", "nothing"}
    assert [choice.volume for choice in best_of_every_phasing(sizes, 9)] == [choice.volume for choice in sizes]


def test_none_is_smaller_with_less_error_than_the_front():
    draw = np.random.default_rng(4)
    choice = size_of(SET, (27, 40, 108), 3)
    sets = [
        ComputedTeeth(replace(choice, volume=v), "", (0.5 * e, e)) for v, e in draw.uniform(1.0, 2.0, (40, 2)).tolist()
    ]
    front = front_of(sets)
    for place, teeth in enumerate(sets):
        beaten = any(o.choice.volume <= teeth.choice.volume and o.error < teeth.error for o in sets if o is not teeth)
        assert (place in front) == (not beaten)


def test_words_that_are_no_numbers_are_refused_together(tmp_path):
    arguments = ("--ratio", "5", "--planets", "many", "--torque", "12 mm", "--best", "0", "-o", "out")
    done = run_femgear("teeth", *arguments, folder=tmp_path)
    assert done.returncode == 2
    assert all(word in done.stderr for word in ("--planets", "--torque", "--best"))
    assert not (tmp_path / "out").exists()


def test_numbers_of_planets_that_fall_are_refused(tmp_path):
    done = run_femgear("teeth", "--ratio", "5", "--planets", "5..3", "-o", "out", folder=tmp_path)
    assert done.returncode == 2 and "--planets 3..5" in done.stderr


def test_the_picture_names_the_front_alone():
    from femgear.study.figures import size_and_error

    figure = size_and_error(
        [1.0, 2.0, 3.0], [3.0, 1.0, 2.0], ["a", "b", "c"], left=["torque", "nothing", ""], front=[0, 1]
    )
    (ax,) = figure.axes
    assert [text.get_text() for text in ax.texts] == ["a", "b"]
    near = size_and_error([1.0, 1.05, 2.0], [2.0, 1.99, 1.9], ["a", "b", "c"], left=[""] * 3, front=[0, 1, 2])
    near.canvas.draw()
    boxes = [text.get_window_extent() for text in near.axes[0].texts]
    assert not any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2))
    assert ax.get_legend_handles_labels()[1] == ["leaves torque", "leaves nothing", "pairs"]
