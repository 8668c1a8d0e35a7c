"""docs/which_part_makes_the_noise.md: its figures are those of its cases."""

from pathlib import Path

import numpy as np
import pytest

from femgear.case.dependencies import Steps
from femgear.trains.gearbox.response_results import response_tables
from femgear.trains.gearbox.signals import ORDER_HEADER, gearbox_order_tables
from femgear.trains.gearbox.verdict import gearbox_verdict
from femgear.trains.live import Answer
from femgear.trains.reading import read_case, with_values

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "which_part_makes_the_noise.md").read_text(encoding="utf-8")
pytestmark = pytest.mark.slow


class Stored(dict):
    """Contents of files by stage, as results have them."""

    case = read_case(ROOT / "cases" / "e_axle_in_a_casing.toml")
    findings = ()
    stages = property(lambda self: tuple(self))
    __getattr__ = dict.__getitem__


@pytest.fixture(scope="module")
def answer():
    return Answer(read_case(ROOT / "cases" / "e_axle_in_a_casing.toml"), Steps())


@pytest.fixture(scope="module")
def results(answer):
    return Stored({name: answer[name].dataset() for name in ("deflection", "modes", "dynamics")})


def rows(first: str) -> list[list[str]]:
    """Cells of the table on the page whose heading begins so, below it."""
    table = PAGE[PAGE.index(f"| {first} |") :].split("\n\n")[0].splitlines()[2:]
    return [[cell.strip().replace("−", "-") for cell in line.strip("|").split("|")] for line in table]


def test_the_verdict_of_the_page(results):
    (block,) = gearbox_verdict(results)
    printed = PAGE[PAGE.index("```text\n") :].split("```")[1]
    for name, text in block.rows:
        if name.endswith((" at top", " at side")):
            assert text in printed.replace("†", ""), name


def test_lines_stages_and_paths(results):
    ((_, header, table),) = gearbox_order_tables(results)
    side = [dict(zip(header, row, strict=True)) for row in table if row[0] == "side"]
    assert header is ORDER_HEADER
    for cells, line in zip(rows("frequency [Hz]"), side, strict=False):
        assert float(cells[0]) == pytest.approx(line["frequency [Hz]"], abs=0.5) and cells[2] == line["stage"]
        assert float(cells[4]) == pytest.approx(line["amplitude [m/s^2]"], abs=0.006)
        assert cells[5] == f"{line['share of the power [1]']:.0%}".replace("%", " %")
        assert float(cells[6]) == pytest.approx(line["nearest mode [Hz]"], abs=0.5)
    levels, *_ = (block for block in response_tables(results.dynamics) if block.title.startswith("Levels"))
    assert [list(row) for row in rows("sensor")] == [list(row) for row in levels.rows]
    share = {str(p): v for p, v in zip(results.dynamics["path"].values, results.dynamics["path_share"].values[0])}
    for name, *cells in rows("path")[:4]:
        assert [int(cell.removesuffix(" %")) for cell in cells] == np.rint(100.0 * share[name]).tolist()


def test_crowning_of_the_page(answer):
    teeth = answer.case.pair[0].teeth["gear_1"]
    crowned = teeth | {"modifications": [{"kind": "profile crowning", "amount": "6 um"}]}
    there = answer.of(with_values(answer.case, {"pair[0].teeth.gear_1": crowned}))
    level = dict(zip(("top", "side", "front"), there.dynamics.contents()["level"].values[0], strict=True))
    printed = rows("crowning")[-1]
    assert printed[0] == "6 µm" and [float(cell) for cell in printed[2:]] == pytest.approx([*level.values()], abs=0.06)
