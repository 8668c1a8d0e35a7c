"""Journeys of CONTRIBUTING.md: what a maintainer touches for a change, walked as he would."""

import io
import json
import re
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Literal, get_args

import numpy as np
import pytest
from pydantic import create_model

from femgear import cli, findings
from femgear.case.flank_sections import ModificationSection
from femgear.case.sections import DynamicsSection, HousingSection, RunupSection, StaticSection
from femgear.case.teeth import flank_form
from femgear.commands import program, terminal
from femgear.gears.gear import Gear
from femgear.gears.modifications import LeadModification, Modification, lead_deviation
from femgear.trains import registry
from femgear.trains.reading import open_results, parse_case

pytestmark = pytest.mark.usefixtures("pictures_undrawn")

ROOT = Path(__file__).parents[1]
CASE = """model = "oscillator"
title = "A mass on a spring"

[oscillator]
mass = "2 kg"
stiffness = "0.8 N/um"
"""
# the train of tests/oscillator with one variable, one finding and one question more
TRAIN = """from dataclasses import replace

from oscillator.section import FILE
from oscillator.stages import OSCILLATOR, ModesResult

from femgear.findings import Finding
from femgear.stages.judgements import Judgement
from femgear.storage.results import dataset


class Modes(ModesResult):
    def dataset(self):
        more = {"period": ((), 1.0 / self.frequency, "s", "time of one oscillation")}
        return super().dataset().merge(dataset(more, {}, {}))

    @staticmethod
    def warnings(data):
        yield Finding("W-SLOW", "oscillator.mass", f"a period of {float(data['period']):.3g} s", remedy="less mass")


def judgements(results):
    period = float(results.modes["period"])
    yield Judgement("Does it swing fast?", "good", f"{period:.3g} s", sentence=f"it swings in {period:.3g} s")


modes, receptance = OSCILLATOR.stages
modes = replace(modes, solve=lambda case: Modes(modes_of(case).frequency), warnings=Modes.warnings)
modes_of = OSCILLATOR.stages[0].solve
TRAIN = replace(OSCILLATOR, stages=(modes, receptance), judgements=judgements)
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Folder and prints of a run of that train, whose finding has its line in the catalogue."""
    place, out, err = tmp_path_factory.mktemp("swings"), io.StringIO(), io.StringIO()
    (place / "case.toml").write_text(CASE, encoding="utf-8")
    (place / "changed_oscillator.py").write_text(TRAIN, encoding="utf-8")
    package = place / "swings-1.0.dist-info"
    package.mkdir()
    (package / "METADATA").write_text("Metadata-Version: 2.1\nName: swings\nVersion: 1.0\n", "utf-8")
    (package / "entry_points.txt").write_text("[femgear.trains]\noscillator = changed_oscillator\n", "utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(place))
        patch.setitem(
            findings.CATALOGUE,
            "W-SLOW",
            findings.Meaning(findings.DOUBT, "The mass swings slowly.", "it swings slowly", "Make it lighter."),
        )
        registry._installed.cache_clear()
        with redirect_stdout(out), redirect_stderr(err):
            assert cli.main(["run", str(place / "case.toml"), "-o", str(place / "out")]) == 0
        yield place / "out", SimpleNamespace(out=out.getvalue(), err=err.getvalue())
    registry._installed.cache_clear()


def test_an_output_variable_is_one_entry(run):
    """Of a stage's contents: file, unit, table of the export follow."""
    folder, _ = run
    period = open_results(folder).modes["period"]
    assert period.attrs["units"] == "s" and float(period) == pytest.approx(2 * np.pi / np.sqrt(4e5))
    assert cli.main(["export", str(folder), "--csv"]) == 0
    assert re.search(r"(?m)^period,0\.0099\d*,s$", (folder / "exported" / "modes.csv").read_text(encoding="utf-8"))


def test_a_finding_is_raised_and_has_one_line_of_the_catalogue(run, capsys):
    """Standard error, manifest, file, page and ``femgear explain`` follow."""
    folder, printed = run
    assert "[W-SLOW] oscillator.mass: a period of 0.00993 s" in printed.err
    manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    assert [finding["code"] for finding in manifest["findings"]] == ["W-SLOW"]
    assert "W-SLOW" in open_results(folder).modes.attrs["findings"]
    assert "doubt of modes: [W-SLOW]" in (folder / "report.html").read_text(encoding="utf-8")
    assert cli.main(["explain", "W-SLOW"]) == 0 and "Make it lighter." in capsys.readouterr().out


def test_a_question_of_page_one_is_one_judgement(run, capsys):
    """Terminal, page and data follow."""
    folder, printed = run
    assert "Does it swing fast?" in printed.out and "It swings in 0.00993 s." in printed.out
    assert "Does it swing fast?" in (folder / "report.html").read_text(encoding="utf-8")
    assert cli.main(["report", str(folder), "--json"]) == 0
    (judgement,) = json.loads(capsys.readouterr().out)["judgements"]
    assert judgement["question"] == "Does it swing fast?" and judgement["state"] == "good"


def test_a_command_is_one_function(capsys):
    """Options and help follow from its signature and docstring, refusals from what it raises."""

    @program.app.command
    def weigh(case: Path, /, *, density: program.Whole = 7800) -> int:
        """Print the weight of a case.

        Parameters
        ----------
        density
            Of the material in kg/m^3.
        """
        terminal.say(f"{case} of {density} kg/m^3")
        return 0

    try:
        assert cli.main(["weigh", "--help"]) == 0 and "Of the material in kg/m^3." in capsys.readouterr().out
        assert cli.main(["weigh", "a.toml", "--density", "2700"]) == 0
        assert capsys.readouterr().out == "a.toml of 2700 kg/m^3\n"
        assert cli.main(["weigh", "a.toml", "--density", "2.7"]) == 2 and "no whole number" in capsys.readouterr().err
    finally:
        del program.app["weigh"]


def test_a_modification_of_flanks_is_one_class_and_one_line_of_the_section(monkeypatch):
    """Reading, checks of its entries and what it takes off follow from its fields."""
    monkeypatch.setattr(Modification, "kinds", dict(Modification.kinds))

    @dataclass(frozen=True)
    class HollowLead(LeadModification, kind="lead hollow"):
        """Material taken off in the middle of the width."""

        amount: float

        def removed_over(self, width, place, height):
            return self.amount * (1.0 - (2.0 * place / width) ** 2)

    kinds = Literal[(*get_args(ModificationSection.model_fields["kind"].annotation), "lead hollow")]
    section = create_model("Wider", __base__=ModificationSection, kind=(kinds, ...))
    given = section.model_validate({"kind": "lead hollow", "amount": "4 um"})
    gear = Gear(27, 1.5e-3, np.radians(20.0), 0.4, 0.025, 9e-3, name="sun")
    form = flank_form(SimpleNamespace(sun=SimpleNamespace(modifications=(given,)), profile_files={}), gear)
    assert form.lead == (HollowLead(4e-6),)
    removed = lead_deviation(form, gear.face_width, np.array([-0.5, 0.0, 0.25]) * gear.face_width)
    assert removed == pytest.approx([0.0, 4e-6, 3e-6], abs=1e-20)
    with pytest.raises(ValueError, match="lead hollow has no length"):
        section.model_validate({"kind": "lead hollow", "amount": "4 um", "length": "1 mm"})


SECTIONS = {"static": StaticSection, "dynamics": DynamicsSection, "housing": HousingSection, "runup": RunupSection}


def printed_defaults(heading: str) -> dict[str, str]:
    """Default of every key in the table of docs/case_file.md below a heading."""
    text = (ROOT / "docs" / "case_file.md").read_text(encoding="utf-8")
    part = re.search(rf"(?ms)^## {heading}\b.*?(?=^## |\Z)", text).group()
    rows = [[cell.strip() for cell in row.strip("|").split("|")] for row in re.findall(r"(?m)^\|.*\|$", part)]
    return {key: cells[-1] for (*cells,) in rows for key in re.findall(r"`(\w+)`", cells[0])}


def test_a_default_stands_in_its_section_alone():
    """The page prints it; a case without the entry has it."""
    compared = 0
    for heading, section in SECTIONS.items():
        printed = printed_defaults(heading)
        for name, entry in section.model_fields.items():
            if isinstance(entry.default, bool | int | float | str) and printed.get(name, "").strip('`"'):
                shown = printed[name].strip('`"')
                plain = re.fullmatch(r"[\w.+-]+", shown)
                if plain:
                    expected = entry.default
                    same = (
                        shown == str(expected).lower() if isinstance(expected, bool | str) else float(shown) == expected
                    )
                    assert same, f"{heading}.{name}: the page has {shown}, the section {expected}"
                    compared += 1
    assert compared > 12
    case = parse_case(
        (ROOT / "cases" / "planetary_27_40_108.toml").read_text(encoding="utf-8").replace("positions = 64", "")
    )
    assert case.static.positions == StaticSection.model_fields["positions"].default


def journeys() -> list[list[str]]:
    """Rows of the table of CONTRIBUTING.md."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    table = re.search(r"(?ms)^## Journeys$.*?^\|---[-|]*$\n(.*?)\n\n", text).group(1)
    return [[cell.strip() for cell in row.strip("|").split("|")] for row in table.splitlines()]


@pytest.mark.parametrize("row", journeys(), ids=lambda row: row[0])
def test_every_journey_names_the_test_that_walks_it(row):
    *_, walked = row
    tests = re.findall(r"`(tests/[\w/]+\.py)::(\w+)`", walked)
    assert tests or re.search(r"commit `[0-9a-f]{8}`", walked)
    for place, name in tests:
        assert re.search(rf"(?m)^def {name}\(", (ROOT / place).read_text(encoding="utf-8")), walked
