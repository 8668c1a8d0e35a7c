"""docs/rexs.md and the section on new cases in docs/case_file.md print what femgear writes."""

import re
import tomllib
from pathlib import Path

import pytest
from rexs_stage import Gearbox, ParallelUnit

from femgear import cli

pytestmark = pytest.mark.usefixtures("coarse_states")

DOCS = Path(__file__).parents[2] / "docs"


def blocks(page: str, language: str = "toml") -> list[str]:
    text = (DOCS / page).read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def tables(text: str) -> list[str]:
    return [part.strip() for part in re.split(r"\n(?=\[)", text)]


def coarsen(case: Path) -> None:
    """Give the teeth of a gearbox few positions and elements, and its contact few slices."""
    text = case.read_text(encoding="utf-8")
    few = "[pair.teeth.static]\npositions = 8\nflank_elements = 6\nstresses = false\n\n"
    coarse = text.replace("[pair.teeth.rack]", f"{few}[pair.teeth.rack]")
    assert coarse.count(few) == text.count("[[pair]]") == 2
    case.write_text(f'{coarse}\n[deflection]\nslices = 3\n\n[dynamics]\nup_to = "1 kHz"\n', encoding="utf-8")


def test_the_case_of_the_example(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Gearbox(addendum=None).write(Path("stage.rexs"))
    commands = [line.split()[1:] for line in blocks("rexs.md", "sh")[0].splitlines()]
    for command in commands[:2]:
        assert cli.main(command) == 0
    written = Path("case.toml").read_text(encoding="utf-8")
    printed = tables(blocks("rexs.md")[0])
    assert len(printed) == 5 and set(printed) <= set(tables(written))
    assert "17" in capsys.readouterr().out
    assert cli.main([*blocks("rexs.md", "sh")[2].split()[1:], "--force"]) == 0


def test_a_unit_becomes_the_gearbox_of_the_page(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    ParallelUnit().write(Path("unit.rexs"))
    commands = [line.split()[1:] for line in blocks("rexs.md", "sh")[1].splitlines()]
    assert len(commands) == 3
    for command in commands[:2]:
        assert cli.main(command) == 0
    assert "Power flow" in capsys.readouterr().out
    coarsen(Path("box.toml"))
    assert cli.main([*commands[2], "--no-pictures", "--only", "deflection"]) == 0
    assert "K_Hβ" in capsys.readouterr().out


def test_a_unit_with_the_casing_of_the_page_has_a_sound(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ParallelUnit().write(Path("unit.rexs"))
    (commands,) = [block.splitlines() for block in blocks("rexs.md", "sh") if "--wav" in block]
    imported, casing, run, export = (line.split("#")[0].split()[1:] for line in commands)
    assert cli.main(imported) == 0
    coarsen(Path("unit.toml"))
    assert cli.main(casing) == 0
    case = Path("unit_in_casing.toml")
    text, count = re.subn(r"(?m)^count = \d+", "count = 2", case.read_text(encoding="utf-8"))
    assert count == 1
    case.write_text(text, encoding="utf-8")
    assert cli.main([*run, "--no-pictures"]) == 0
    assert cli.main([*export, "--duration", "0.1", "--run-up", "0.2"]) == 0
    names = {path.name for path in Path("out/unit/exported").glob("*.wav")}
    assert len(names) == 6
    assert "sensor_top_run_up.wav" in names


def test_attributes_of_the_page_are_those_that_are_read():
    page, folder = (DOCS / "rexs.md").read_text(encoding="utf-8"), DOCS.parent / "femgear" / "exchange"
    files = (
        folder / f"{name}.py" for name in ("planetary_stage", "unit_spectrum", "flank_modifications", "gear_strength")
    )
    code = "".join(one.read_text(encoding="utf-8") for one in files)
    named = re.findall(r"`(\w+)`", "".join(line for line in page.splitlines() if line.startswith("| ")))
    assert len(named) > 20 and not [name for name in named if f'"{name}"' not in code]


def test_the_new_case_of_the_page(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (command,) = [line for one in blocks("case_file.md", "sh") for line in one.splitlines() if "--teeth" in line]
    words = re.findall(r'"([^"]*)"|(\S+)', command)
    assert cli.main([quoted or plain for quoted, plain in words][1:]) == 0
    written = Path("case.toml").read_text(encoding="utf-8")
    printed = next(one for one in blocks("case_file.md") if "# estimated" in one)
    assert printed.strip() in tables(written) and tomllib.loads(printed)["sun"]["teeth"] == 24


def test_a_gearbox_is_written_as_the_page_says(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ParallelUnit().write(Path("unit.rexs"))
    assert cli.main(["import", "unit.rexs", "-o", "box.toml"]) == 0
    (command,) = [block for block in blocks("rexs.md", "sh") if block.startswith("femgear rexs box.toml")]
    assert cli.main(command.split()[1:]) == 0
    assert cli.main(["import", "back.rexs", "-o", "again.toml"]) == 0
    assert len(tomllib.loads(Path("again.toml").read_text(encoding="utf-8"))["pair"]) == 2
