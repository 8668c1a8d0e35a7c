"""Torque series in CSV files: what is read, and what is refused with its line."""

from pathlib import Path

import pytest

from femgear.errors import CaseError
from femgear.trains.gearbox.transient_case import read_torques
from femgear.trains.reading import parse_case, read_case

OWN = Path(__file__).parents[2] / "cases" / "own_chain.toml"


@pytest.mark.parametrize(
    ("text", "code", "words"),
    [
        ("time [s],torque [N m]\n0,1\n1,nan\n", "E-FILE", "not a finite number"),
        ("time [s],torque [N m]\n0,1\n2,1\n1,1\n", "E-FILE", "do not ascend"),
        ("time [s],torque [N m]\n0,1\n0,2\n", "E-FILE", "do not ascend"),
        ("time [s],torque [kg]\n0,1\n", "E-FILE", "not a unit of torque"),
        ("time [m],torque [N m]\n0,1\n", "E-FILE", "not a unit of time"),
        ("time,torque\n0,1\n", "E-FILE", "no known name"),
        ("time [s],torque [N m]\n0,1,2\n", "E-FILE", "3 entries"),
        ("time [s],torque [N m]\n0,one\n", "E-FILE", "not a finite number"),
        ("time [s],time [s]\n0,1\n", "E-FILE", "columns are time"),
        ("time [s],torque [N m]\n", "E-FILE", "no points"),
        (None, "E-FILE", "cannot open"),
    ],
)
def test_wrong_torque_files(tmp_path, text, code, words):
    case = OWN.read_text(encoding="utf-8")
    (tmp_path / "case.toml").write_text(case, encoding="utf-8")
    if text is not None:
        (tmp_path / "own_chain_motor.csv").write_text(text, encoding="utf-8")
    with pytest.raises(CaseError, match=words) as info:
        read_case(tmp_path / "case.toml")
    assert info.value.code == code and info.value.key == "operation.torque[0].file"
    assert "own_chain_motor.csv" in info.value.file


@pytest.mark.parametrize(
    ("text", "line", "words", "remedy"),
    [
        ("time [s],torque [N m]\n0,1\n0,5,10,2\n", 3, "4 entries", "decimal commas need semicolons"),
        ("time [s],torque [N m]\n0,5;10,2\n", 2, "3 entries", "divide the heading by a semicolon"),
        ('time [s],torque [N m]\n"0,5","10,2"\n', 2, "not a finite number", "decimal commas need semicolons"),
        ("torque [N m];time [s]\n1.5;0\n1,5;1\n", 2, "commas and points", "throughout"),
        ("time [N m];torque [s]\n0;1\n", 1, "not a unit of time", "seem to be swapped"),
        ("time [s];torque [N]\n0;1\n", 1, "not a unit of torque", "names two columns"),
        ("Zeit [s];torque [N m]\n0;1\n", 1, "no known name", "names two columns"),
        (
            "# rig\n\ntime [s];torque [N m]\n0;1\n1;2e9\n",
            5,
            "2e\\+09 N m is not plausible",
            "check the number",
        ),
        ("time [h];torque [N m]\n0;1\n300;1\n", 3, "a time of 1.08e", "unit of the column time"),
        ("time [s];torque [N m]\n-1;1\n0;1\n", 2, "a time of -1 s", "unit of the column time"),
        ("time [s];torque [N m]\n2;1\n\n1;1\n", 4, "do not ascend", "sort the lines"),
        ("time [s];torque [N m]\n1;1\n1.00000000000001;1\n", 3, "do not ascend", "sort the lines"),
        ("time [s];torque [N m]\n0;1_0\n", 2, "not a finite number", "write numbers such as"),
        ("time [s];torque [N m]\n0\n", 2, "1 entry", "a time and a torque"),
    ],
)
def test_csv_mistakes_name_their_line_and_a_remedy(tmp_path, text, line, words, remedy):
    (tmp_path / "case.toml").write_text(OWN.read_text(encoding="utf-8"), encoding="utf-8")
    (tmp_path / "own_chain_motor.csv").write_text(text, encoding="utf-8")
    with pytest.raises(CaseError, match=words) as info:
        read_case(tmp_path / "case.toml")
    assert info.value.code == "E-FILE" and info.value.file.endswith(f"own_chain_motor.csv:{line}")
    assert remedy in info.value.remedy


def test_files_that_are_none_have_a_remedy_that_fits(tmp_path):
    (tmp_path / "case.toml").write_text(OWN.read_text(encoding="utf-8"), encoding="utf-8")
    (tmp_path / "own_chain_motor.csv").mkdir()
    with pytest.raises(CaseError, match="E-FILE") as info:
        read_case(tmp_path / "case.toml")
    assert "two columns" in info.value.remedy and "TOML" not in info.value.remedy


def test_columns_in_any_order_with_decimal_commas_and_quotation_marks(tmp_path):
    path = tmp_path / "torque.csv"
    for text in (
        "torque [N m];time [s]\n10,25;0\n-3,5e2;0,5\n",
        'time [s]\ttorque [kN m]\r\n"0"\t"0,01025"\r\n0,5\t-0,35\r\n',
        '"time (ms)", "torque (N m)"\n0, 10.25\n500, -350\n',
    ):
        path.write_text(text, encoding="utf-8")
        assert read_torques(path) == {"times": [0.0, 0.5], "torques": pytest.approx([10.25, -350.0])}


def test_torque_files_carry_their_units(tmp_path):
    path = tmp_path / "torque.csv"
    path.write_text("# gusts\ntorque [kN m];time [min]\n15;0\n16,5;1\n", encoding="utf-8")
    assert read_torques(path) == {"times": [0.0, 60.0], "torques": [15e3, pytest.approx(16.5e3)]}
    text = OWN.read_text(encoding="utf-8").replace("own_chain_motor.csv", "../torque.csv")
    with pytest.raises(CaseError, match="in the folder of the case"):
        parse_case(text, name=str(tmp_path / "case.toml"))
