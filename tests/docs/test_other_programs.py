"""The page on models for other programs: what its examples print, the layouts that it states, its commands."""

import re

import numpy as np
import pytest
from chain_model import chain_model, rubbing_chain
from page_examples import ROOT, read_page, run_examples

from femgear.exchange.dynamic_model import ENDINGS, HARMONICS, write_state_space
from femgear.exchange.fmu import TOLERANCE, unit_variables

TEXT, EXAMPLES, PRINTED = read_page("other_programs.md")


@pytest.fixture
def beside_cases(tmp_path, monkeypatch):
    (tmp_path / "cases").symlink_to(ROOT / "cases")
    monkeypatch.chdir(tmp_path)


@pytest.mark.usefixtures("beside_cases")
def test_examples_print_what_the_page_says(tmp_path):
    assert run_examples("other_programs.md", EXAMPLES) == PRINTED
    # what the page says that programs which interpolate want
    angle = np.loadtxt(tmp_path / "k.csv", delimiter=",", skiprows=1)[:, 0]
    assert angle[0] == 0.0 and angle[-1] == pytest.approx(2.0 * np.pi / 24, rel=1e-8)


def test_the_page_names_all_arrays_of_a_state_space(tmp_path):
    write_state_space(rubbing_chain()[0], tmp_path / "chain.npz", harmonics=2)
    rows = re.findall(r"(?m)^\| (`.*?) \|.*\|.*\|$", TEXT.split("## State space")[1].split("## FMU")[0])
    named = {name for row in rows for name in re.findall(r"`(\w+)`", row)} - {"_unit"}
    units = {f"{name}_unit" for name in ("state", "input", "output")}
    assert named | units == {*np.load(tmp_path / "chain.npz").files}


def test_the_page_names_the_variables_of_a_unit():
    rows = re.findall(r"(?m)^\| (`.*?) \|.*\|.*\|$", TEXT.split("## FMU")[1].split("## Stiffness")[0])
    patterns = [name.replace("...", ".*") for row in rows for name in re.findall(r"`([\w.]+)`", row)]
    for variable in unit_variables(chain_model()):
        assert any(re.fullmatch(pattern, variable.name) for pattern in patterns), variable.name
    assert f"by default {TOLERANCE:g}".replace("e-0", "e-") in TEXT and f"the default is {HARMONICS}." in TEXT


def test_the_page_names_all_endings():
    for option, endings in ENDINGS.items():
        (row,) = re.findall(rf"(?m)^\| `{option}` \|(.*?)\|", TEXT)
        assert re.findall(r"`(\.\w+)`", row) == [*endings]
