"""Wear over hours in steps: what converges, what is written, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from femgear.case import text as case_text
from femgear.cli import main
from femgear.errors import CaseError
from femgear.stages.wear import wear_entries
from femgear.study.wear import WearRequest, describe_wear, wear_of_case, with_wear, worn_text
from femgear.trains.gearbox_of_case import gearbox_of_case
from femgear.trains.reading import parse_case, read_case, with_values

CASES = Path(__file__).parents[2] / "cases"
COARSE = {"static.flank_elements": 4, "static.positions": 16, "static.stresses": False, "static.peaks": False}


@pytest.fixture(scope="module")
def pair():
    return with_values(read_case(CASES / "spur_pair.toml"), COARSE)


@pytest.fixture(scope="module")
def worn(pair):
    return wear_of_case(pair, WearRequest(200.0, 1e-18, steps=4))


def test_where_one_pair_carries_steps_change_nothing_and_elsewhere_they_converge(pair, worn):
    """The load of a tooth that carries alone is that of the torque, however worn it is."""
    coarse, finer = (wear_of_case(pair, WearRequest(200.0, 1e-18, steps=steps)) for steps in (1, 8))
    for flank, once, often in zip(worn.flanks, coarse.flanks, finer.flanks, strict=True):
        alone = np.abs(flank.depth / np.maximum(once.depth, 1e-30) - 1.0) < 1e-9
        assert alone.sum() >= 5
        change = [np.abs(other.depth - often.depth).max() for other in (once, flank)]
        assert change[1] < 0.5 * change[0]
        # half the steps say how large the rest is, to a factor
        left = change[1] / flank.depth.max()
        assert 0.3 * left < worn.change(flank) < 10.0 * left
    assert not coarse.half and np.isnan(coarse.change(coarse.flanks[0]))


def test_worn_flanks_are_faults_of_the_case_beside_those_that_it_has(pair, worn):
    before = [{"kind": "wear", "flank": "left", "depth": "3 um"}]
    again = with_wear(with_values(pair, {"gear_1.fault": before}), worn.flanks)
    assert [len(section.depths or ()) for section in again.gear_1.fault] == [0, 41]
    assert again.gear_1.fault[0].depth == pytest.approx(3e-6)
    assert [fault.kind for fault in worn.case.gear_2.fault] == ["wear"]
    for flank, section in zip(worn.flanks, (worn.case.gear_1.fault[0], worn.case.gear_2.fault[0]), strict=True):
        assert section.depths == pytest.approx(flank.depth, rel=1e-6, abs=1e-15)


def test_the_table_says_how_deep_and_how_far_it_has_converged(worn):
    block = describe_wear(worn, WearRequest(200.0, 1e-18, steps=4))
    assert [row[:2] for row in block.rows] == [("gear_1", "left"), ("gear_2", "left")]
    deepest = worn.flanks[0].depth.max()
    assert block.rows[0][2] == f"{1e6 * deepest:.4g}" and block.rows[0][4].endswith("%")
    assert "200 h with k = 1e-18 m^2/N in 4 steps" in block.notes[0]
    assert "half the steps change" in block.notes[1]


def test_the_command_keeps_the_text_of_the_file(tmp_path, capsys):
    text = case_text.read_text(CASES / "spur_pair.toml")
    case, output = tmp_path / "pair.toml", tmp_path / "worn.toml"
    case.write_text(text.replace("positions = 64", "positions = 16\nflank_elements = 4  # coarse"), encoding="utf-8")
    arguments = ["wear", str(case), "--hours", "50", "--coefficient", "1e-18", "--steps", "2", "-o", str(output)]
    assert main(arguments) == 0
    assert "Wear of the flanks" in capsys.readouterr().out
    written = output.read_text(encoding="utf-8")
    assert set(case.read_text(encoding="utf-8").split("\n")) <= set(written.split("\n")) and "# coarse" in written
    assert [fault.kind for fault in read_case(output).gear_1.fault] == ["wear"]
    assert main(arguments) == 2 and "E-OUTPUT" in capsys.readouterr().err
    assert main([*arguments, "--force"]) == 0


def test_tables_within_braces_are_written_anew(tmp_path, pair, worn):
    braces = tmp_path / "braces.toml"
    braces.write_text(case_text.write({**case_text.parse(pair.source, "pair")}), encoding="utf-8")
    assert worn_text(braces, tmp_path / "worn.toml", worn)[1]
    inline = braces.read_text(encoding="utf-8").replace("[gear_1]\n", "[gear_1]\nfault = []\n")
    braces.write_text(inline, encoding="utf-8")
    text, kept = worn_text(braces, tmp_path / "worn.toml", worn)
    assert not kept and parse_case(text).gear_1.fault == worn.case.gear_1.fault


def test_stages_of_a_gearbox_wear_as_their_pair_does(pair, worn):
    box = parse_case(case_text.write(gearbox_of_case(pair).tables), name="box")
    in_box = wear_of_case(box, WearRequest(200.0, 1e-18, steps=1))
    assert set(wear_entries(in_box.flanks)) == {f"pair[0].teeth.{gear}.fault" for gear in ("gear_1", "gear_2")}
    alone = wear_of_case(pair, WearRequest(200.0, 1e-18, steps=1))
    for flank, stage in zip(alone.flanks, in_box.flanks, strict=True):
        assert stage.depth == pytest.approx(flank.depth, abs=0.02 * flank.depth.max())
    with pytest.raises(CaseError, match="speeds of its load case"):
        wear_of_case(box, WearRequest(200.0, 1e-18, steps=1, speed="100 rpm"))


@pytest.mark.parametrize(
    ("request_", "keys"),
    [
        (WearRequest(-1.0, 1e-18), {"--hours"}),
        (WearRequest(1.0, 1.0, steps=0, speed="0 rpm"), {"--coefficient", "--steps", "--speed"}),
        (WearRequest(1.0, 1e-18, speed="5 mm"), {"--speed"}),
        (WearRequest(1e9, 1e-12, steps=1), {"--hours"}),
    ],
)
def test_what_cannot_be_asked_is_refused_at_once(pair, request_, keys):
    with pytest.raises(CaseError) as refused:
        wear_of_case(pair, request_)
    assert {problem.key for problem in refused.value.problems} == keys


@pytest.mark.parametrize("name", ["nrel_pga", "gear_pair"])
def test_cases_without_contact_of_teeth_are_refused_with_reason(name):
    with pytest.raises(CaseError, match="nothing wears") as refused:
        wear_of_case(read_case(CASES / f"{name}.toml"), WearRequest(1.0, 1e-18))
    assert refused.value.code == "E-MODEL" and refused.value.limit
