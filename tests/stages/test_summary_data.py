"""What --json prints: data that its schemas describe, of a run and of a case."""

import json
from pathlib import Path

import pytest

from femgear.cli import main
from femgear.errors import CaseError
from femgear.run import run_case
from femgear.stages.summary_data import CHECK_SCHEMA, SCHEMA, check_data, run_data
from femgear.storage.results import run_folder
from femgear.trains.reading import open_results, read_case, to_toml, with_values
from femgear.trains.registry import train_of

CASES = Path(__file__).parents[2] / "cases"
QUICK = {
    "static.positions": 8,
    "material.treatment": "case hardened steel",
    "material.hardness": 700,
    "operation.load_case": [{"name": "run", "torque": "100 N m", "speed": "1500 rpm", "share": 1.0}],
    "operation.required_hours": 1000,
}


def mismatches(data, schema, place="data"):
    """Where data is not what a schema of objects, arrays, texts, numbers and constants says."""
    kinds = {"object": dict, "array": list, "string": str, "boolean": bool, "number": (int, float), "null": type(None)}
    named = schema.get("type", [])
    names = [named] if isinstance(named, str) else named
    if names and not any(isinstance(data, kinds[name]) for name in names):
        return [f"{place} is no {names}"]
    if ("const" in schema and data != schema["const"]) or ("enum" in schema and data not in schema["enum"]):
        return [f"{place} is {data}"]
    if isinstance(data, dict):
        wrong = [f"{place} has {name} or lacks it" for name in data.keys() ^ schema["properties"].keys()]
        inner = schema["properties"].items()
        return wrong + [text for name, part in inner if name in data for text in mismatches(data[name], part, name)]
    if isinstance(data, list):
        return [text for item in data for text in mismatches(item, schema["items"], place)]
    return []


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run") / "out"
    case = with_values(read_case(CASES / "spur_pair.toml"), QUICK)
    with run_folder(folder) as place:
        run_case(case, place, only="life", pictures=False)
    return open_results(folder)


def test_data_of_a_run_are_those_of_its_schema(results):
    data = run_data(train_of(results.case), results)
    assert mismatches(data, SCHEMA) == [] and json.loads(json.dumps(data, allow_nan=False)) == data
    assert data["kind"] == "pair" and "life" in data["stages"] and data["complete"]
    assert {judgement["question"] for judgement in data["judgements"]} >= {
        "Is it strong enough?",
        "How long does it live?",
    }
    assert data["sentence"].startswith(("Strong enough", "Not strong enough"))
    figures = {figure["name"]: figure for figure in data["key_figures"]}
    assert figures and all(figure["value"] is None or figure["value"] >= 0.0 for figure in figures.values())


def test_a_report_prints_the_data_of_its_folder(results, capsys):
    assert main(["report", str(results.folder), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == run_data(train_of(results.case), results)
    assert not (results.folder / "report.html").exists()


def test_data_of_a_case_have_its_refusal(tmp_path, capsys):
    case = read_case(CASES / "spur_pair.toml")
    accepted = check_data(train_of(case), case, None)
    assert mismatches(accepted, CHECK_SCHEMA) == [] and accepted["accepted"]
    refused = check_data(train_of(case), case, CaseError("no", code="E-TORQUE", key="operation.torque"))
    assert mismatches(refused, CHECK_SCHEMA) == [] and not refused["accepted"] and "E-TORQUE" in refused["refusal"]
    (tmp_path / "case.toml").write_text(to_toml(with_values(case, {"operation.torque": "0 N m"})), encoding="utf-8")
    code = main(["check", str(tmp_path / "case.toml"), "--json"])
    printed = json.loads(capsys.readouterr().out)
    assert mismatches(printed, CHECK_SCHEMA) == [] and printed["accepted"] == (code == 0)
    (tmp_path / "case.toml").write_text("model = 'pair'\nteeth = 3\n", encoding="utf-8")
    assert main(["check", str(tmp_path / "case.toml"), "--json"]) == 2
    printed = json.loads(capsys.readouterr().out)
    assert mismatches(printed, CHECK_SCHEMA) == [] and not printed["accepted"] and "case.toml" in printed["refusal"]
