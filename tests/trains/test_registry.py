"""Trains of other packages: entry points of the group femgear.trains."""

import re
import subprocess
import sys

import pytest

from femgear import cli, read_case
from femgear.trains import registry

pytestmark = pytest.mark.usefixtures("pictures_undrawn")

TEXT = """model = "oscillator"
title = "A mass on a spring"

[oscillator]
mass = "2 kg"
stiffness = "0.8 N/um"
"""
MODULE = """from oscillator.section import FILE
from oscillator.stages import OSCILLATOR as TRAIN
"""


@pytest.fixture
def install(tmp_path, monkeypatch):
    """Put a package with an entry point where Python finds packages; it has the module `swinging`."""
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "case.toml").write_text(TEXT, encoding="utf-8")

    def installed(text, name="oscillator", package="swings"):
        (tmp_path / "swinging.py").write_text(text, encoding="utf-8")
        info = tmp_path / f"{package}-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n", "utf-8")
        (info / "entry_points.txt").write_text(f"[femgear.trains]\n{name} = swinging\n", "utf-8")
        registry._installed.cache_clear()
        registry._tell_taken.cache_clear()
        return tmp_path / "case.toml"

    yield installed
    registry._installed.cache_clear()
    sys.modules.pop("swinging", None)


def test_a_package_brings_a_train(install, tmp_path, capsys):
    path = install(MODULE)
    assert cli.main(["check", str(path)]) == 0
    assert cli.main(["run", str(path), "-o", str(tmp_path / "out"), "--only", "receptance"]) == 0
    assert "100.658" in capsys.readouterr().out
    assert cli.main(["schema", "--model", "oscillator"]) == 0


def test_it_is_loaded_for_its_own_cases_alone(install, tmp_path, capsys):
    install("raise ImportError('no library\\nof springs')")
    assert read_case("cases/planetary_27_40_108.toml").train == "elastic"
    assert cli.main(["check", "cases/gear_pair.toml"]) == 0
    out = str(tmp_path / "out")
    assert cli.main(["run", "cases/gear_pair.toml", "-o", out, "--only", "static"]) == 2
    assert "E-STAGE" in capsys.readouterr().err and "swinging" not in sys.modules


@pytest.mark.parametrize(
    "text, reason",
    [
        ("raise ImportError('no library\\nof springs')", "ImportError: no library of springs"),
        ("x = 1 / 0", "ZeroDivisionError"),
        ("import sys; sys.exit('no licence')", "SystemExit: no licence"),
        ("FILE = 3", "AttributeError: 'int' object has no attribute 'model'"),
        ("from femgear.trains.pair.case_file import FILE", "swinging:FILE is of pair"),
    ],
)
def test_what_cannot_be_loaded_names_its_package(install, capsys, text, reason):
    assert cli.main(["check", str(install(text))]) == 5
    said = capsys.readouterr().err
    assert "[E-LIBRARY] the train oscillator of the package swings cannot be loaded" in said
    assert reason in said and "update swings or remove it" in said


def test_of_two_of_a_name_the_first_is_taken_and_the_other_told(install, capsys):
    install(MODULE, "pair")
    assert cli.main(["check", "cases/spur_pair.toml"]) == 0
    said = capsys.readouterr().err
    assert "[W-PLUGIN] the package swings has a train pair, and so has femgear" in said
    assert said.count("W-PLUGIN") == 1
    install(MODULE, "oscillator", "pendulums")
    path = install(MODULE, "oscillator", "springs")
    assert cli.main(["check", str(path)]) == 0
    assert re.search(r"train oscillator, and so has (springs|pendulums)", capsys.readouterr().err)


def test_a_package_that_ends_the_program_stops_no_other_train(install, tmp_path, capsys):
    install("import sys; sys.exit(7)")
    assert cli.main(["check", "cases/spur_pair.toml"]) == 0
    assert cli.main(["run", "cases/spur_pair.toml", "-o", str(tmp_path / "out"), "--only", "nowhere"]) == 2
    assert "E-ARGUMENTS" in capsys.readouterr().err


def test_the_help_looks_for_none():
    program = "import sys, femgear.cli as c; c.main(['--help']); print('femgear.trains.registry' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.endswith("False\n")
