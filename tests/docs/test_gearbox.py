"""What docs/gearbox.md shows of casings is what is read."""

import csv
import json
import re
import tomllib
from io import StringIO
from pathlib import Path

import pytest
from small_gearbox import pair_tables

from femgear.app.fields import help_of
from femgear.exchange.node_tables import read_nodes
from femgear.exchange.superelement import SUPERELEMENT_ROLES
from femgear.trains.gearbox.case_file import BoxBearingSection, BoxCasingSection, embed_stages
from femgear.trains.gearbox.deflection import solve_deflection
from femgear.trains.gearbox.sensors import sensor_rows
from femgear.trains.gearbox.stages import solve_deflections
from femgear.trains.reading import read_case
from validation.tools import form_help, gearbox_keys

PAGE = (Path(__file__).parents[2] / "docs" / "gearbox.md").read_text(encoding="utf-8")
CASING = PAGE[PAGE.index("## The casing") : PAGE.index("## What comes out")]
BLOCKS = [tomllib.loads(block) for block in re.findall(r"```toml\n(.*?)```", CASING, re.S)]


def test_the_rigid_casing_of_the_page_stands_on_more_such_feet():
    tables = pair_tables() | BLOCKS[0] | BLOCKS[2]
    (foot,) = tables["casing"]["foot"]
    for number, (x, z) in enumerate(((-80, 95), (180, 0), (180, 95))):
        more = {"name": f"foot {number}", "position": [f"{x} mm", "-100 mm", f"{z} mm"]}
        tables["casing"]["foot"].append(foot | more)
    found = solve_deflection(read_case(tables))
    # torques of 100 and 150 N m turn the box the same way round
    assert found.foot_force.sum(axis=0) == pytest.approx([0.0, 0.0, 0.0], abs=1e-6)
    assert len(found.foot_force) == 4
    (row,) = sensor_rows(found.model)
    assert row.any()


def test_the_elastic_casing_of_the_page_has_entries_and_roles_that_there_are(tmp_path):
    table = BLOCKS[1]["casing"]
    assert BoxCasingSection.model_validate(table).foot_names == ("left front",)
    text = re.search(r"```text\n(node,role.*?)```", CASING, re.S)
    assert text is not None
    assert next(csv.reader(StringIO(text[1])))[:2] == ["node", "role"]
    (tmp_path / "nodes.csv").write_text(text[1])
    assert [node.role for node in read_nodes(tmp_path / "nodes.csv", SUPERELEMENT_ROLES)] == ["seat", "seat", "foot"]


def test_the_table_of_keys_is_that_of_the_sections():
    assert gearbox_keys.page_with_tables(PAGE) == PAGE, "run python validation/tools/gearbox_keys.py"
    bearing = PAGE.split("**`[[bearing]]`**")[1].split("\n**")[0]
    rows = dict(re.findall(r"^\| `(\w+)` \| .* \| (.*) \|$", bearing, flags=re.M))
    assert rows.keys() == BoxBearingSection.model_fields.keys()
    assert rows["shaft"] == "needed" and rows["inner_osculation"] == "0.52" and rows["estimated"] == "`false`"


def test_every_key_has_a_meaning_that_the_form_of_the_app_shows():
    meanings = gearbox_keys.meanings_on(PAGE)
    assert len(meanings) == len(re.findall(r"(?m)^\| `\w+` \|", gearbox_keys.tables(meanings)))
    assert [key for key, meaning in meanings.items() if not meaning] == []
    assert help_of("bearing[0].preload") == meanings["bearing", "preload"]
    assert help_of("planetary[1].planet.bearing.tilt") == meanings["planetary.planet.bearing", "tilt"]
    # an entry that a set has too keeps the words of docs/case_file.md
    assert help_of("operation.load_case[0].share") == "of the running time; all shares add up to 1 within 0.001, " + (
        "and are divided by their sum. Default: 1"
    )


def test_the_help_of_the_form_is_that_of_the_pages():
    texts = json.loads(form_help.TARGET.read_text("utf-8"))
    written = dict(form_help.help_texts(form_help.SOURCE.read_text("utf-8")))
    written |= dict(form_help.gearbox_texts(PAGE, written))
    assert texts.keys() == written.keys(), "run python validation/tools/form_help.py"


@pytest.mark.slow
def test_lives_of_the_axle_are_those_of_the_page():
    tables = tomllib.loads((Path(__file__).parents[2] / "cases" / "e_axle.toml").read_text(encoding="utf-8"))
    embed_stages(tables, "cases/e_axle.toml")
    for stage in (*tables["pair"], *tables["planetary"]):
        steel = {"treatment": "case hardened steel", "hardness": 720, "root_stress_limit": "461 MPa"}
        stage["teeth"]["material"] |= steel
    tables["strength"], tables["operation"]["required_hours"] = {"quality": 6}, 8000
    data = solve_deflections(read_case(tables)).dataset()
    safeties = [data[f"{kind}_spectrum_safety"].values.min() for kind in ("root", "flank")]
    numbers = re.search(
        r"smallest S_F over\s+the load cases is ([\d.]+).*?smallest S_H is\s+([\d.]+).*?L10r = (\d+) h", PAGE, re.S
    )
    assert numbers and [f"{value:.2f}" for value in safeties] == [*numbers.groups()[:2]]
    assert f"{data['spectrum_reference_life'].values.min():.0f}" == numbers[3]
    assert not data["root_damage"].any() and not data["flank_damage"].any()
