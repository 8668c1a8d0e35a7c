"""docs/losses.md: its examples print what it says, its table is that of the shipped axle."""

import re

import pytest
from page_examples import read_page, run_examples

from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.losses import loss_point
from femgear.trains.reading import read_case

PAGE, EXAMPLES, PRINTED = read_page("losses.md")


def test_examples_print_what_the_page_says():
    assert run_examples("losses.md", EXAMPLES) == PRINTED and len(PRINTED) == 3


@pytest.mark.slow
def test_the_table_of_the_axle_is_computed():
    case = read_case("cases/e_axle.toml")
    point = loss_point(solve_deflection(case), case.load_case)
    sun, ring = (point.mesh_loss["second stage"][part].sum() for part in (slice(3), slice(3, 6)))
    losses = point.mesh_loss["first stage"].sum(), sun, ring, sum(point.bearing_loss.values()), point.flow.loss
    rows = re.findall(r"^\| [\w ,-]+ \| (\d+) \| (\d+) % \|$", PAGE, re.MULTILINE)
    assert [int(watts) for watts, _ in rows] == [round(loss) for loss in losses]
    assert [int(share) for _, share in rows] == [round(100.0 * loss / point.flow.loss) for loss in losses]
    assert f"{100.0 * point.flow.efficiency:.2f} % there" in PAGE
