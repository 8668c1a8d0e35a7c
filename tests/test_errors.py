"""Words of refusals: they name the entry that is wrong, and say what is allowed or what to do."""

import re
from pathlib import Path

import numpy as np
import pytest

import femgear
from femgear import cli
from femgear.errors import CaseError, ContactError, FemgearError
from femgear.study.sweep import parse_over
from femgear.trains.reading import parse_case, read_case, with_value, with_values

CASES = Path(__file__).parents[1] / "cases"
TEXT = (CASES / "planetary_27_40_108.toml").read_text(encoding="utf-8")


def refused(text: str) -> CaseError:
    with pytest.raises(CaseError) as caught:
        parse_case(text, name="set.toml")
    return caught.value


def edited(old: str, new: str) -> str:
    assert old in TEXT
    return TEXT.replace(old, new, 1)


SPEEDS = re.search(r"^speeds = .*$", TEXT, re.MULTILINE)[0]
WORDS = {
    # the defect: text, code, key, parts of the message
    "a range of speeds without its ends": (
        edited(SPEEDS, "speeds = {count = 3}"),
        ("E-KEY-MISSING", "operation.speeds", "'count'", "from, to and count", '{from = "250 rpm"'),
    ),
    "a range of speeds that does not move": (
        edited(SPEEDS, 'speeds = {from = "5 rpm", to = "5 rpm", count = 3}'),
        ("E-DUPLICATE", "operation.speeds", "keep one of them"),
    ),
    "a newer format": (
        edited("format = 1", "format = 99"),
        ("E-FORMAT", "format", "set.toml:8: ", "up to 1", "update femgear"),
    ),
    "a tolerance that no solution reaches": (
        edited("tolerance = 1e-6", "tolerance = 1e-13"),
        ("E-RANGE", "dynamics.tolerance", "from 1e-12 to 0.01"),
    ),
    "an older format": (edited("format = 1", "format = 0"), ("E-RANGE", "format", "allowed: 1")),
    "a truth value for teeth": (
        edited("teeth = 27", "teeth = true"),
        ("E-TYPE", "sun.teeth", "not true or false", "found:   true", "5 to 5000"),
    ),
    "external teeth with the sign of internal ones": (
        edited("teeth = 27", "teeth = -27"),
        ("E-RANGE", "sun.teeth", "found:   -27", "did you mean 27?"),
    ),
    "no planets": (edited("planets = 3", "planets = 0"), ("E-RANGE", "set.planets", "usual: 3 to 6")),
    "a member in capitals": (
        edited('input = "sun"', 'input = "Sun"'),
        ("E-CHOICE", "operation.input", "found:   'Sun'", "did you mean 'sun'?"),
    ),
    "a kind of modification misspelt": (
        edited("teeth = 27", 'teeth = 27\nmodifications = [{kind = "tip releif", amount = "5 um"}]'),
        ("E-CHOICE", "sun.modifications[0].kind", "did you mean 'tip relief'?"),
    ),
    "millimetres of pin errors": (
        edited("[set]", '[[set.pin_errors]]\nplanet = 1\ntangential = "5 mm"\n\n[set]'),
        ("E-RANGE", "set.pin_errors[0].tangential", "found:   '5000 um'", "check the unit"),
    ),
    "a text for a list of tables": (
        edited("teeth = 27", 'teeth = 27\nmodifications = "none"'),
        ("E-TYPE", "sun.modifications", "[[sun.modifications]]"),
    ),
    "a list of numbers for a quantity": (
        edited('"51 mm"', "[51]"),
        ("E-TYPE", "set.centre_distance", "not a list", 'write it as in "1 mm"'),
    ),
    "an empty key": (TEXT + '\n[carrier.errors]\n"" = 3\n', ("E-KEY-UNKNOWN", 'carrier.errors.""', "runout")),
    "a quantity without quotation marks": (
        edited('"51 mm"', "51 mm"),
        ("E-TOML", None, "line 13", 'stand in quotation marks, as in "2 mm"'),
    ),
    "a table of a list with single brackets": (
        TEXT + "\n[bearing]\na = 1\n[bearing]\na = 2\n",
        ("E-TOML", "bearing", "[[bearing]]"),
    ),
    "a model of another kind": ("model = 3\n", ("E-TYPE", "model", "gear_pair, pair, gearbox")),
    "a number in place of a table in a list": (
        'model = "multistage"\ntitle = "x"\nstage = [1]\n',
        ("E-TYPE", "stage[0]", "write the section [[stage]]"),
    ),
    "an empty file": ("", ("E-KEY-MISSING", None, "add it: a text")),
}


@pytest.mark.parametrize("defect", WORDS)
def test_words_of_refusals(defect):
    text, (code, key, *parts) = WORDS[defect]
    error = refused(text)
    assert (error.code, error.key) == (code, key)
    for part in parts:
        assert part in str(error)


def test_a_date_beside_a_series_of_a_file_is_named():
    """The points of files are written into the text of the case once its entries are known to be right."""
    text = (CASES / "own_chain.toml").read_text(encoding="utf-8").replace('name = "motor"', "name = 1979-05-27", 1)
    with pytest.raises(CaseError) as caught:
        parse_case(text, name=str(CASES / "own_chain.toml"))
    assert ("E-TYPE", "body[0].name") in [(one.code, one.key) for one in caught.value.problems]


def test_a_stage_is_refused_in_the_words_of_python_and_of_the_command_line(capsys, tmp_path):
    case = read_case(CASES / "planetary_27_40_108.toml")
    with pytest.raises(CaseError, match="no stage branch") as caught:
        femgear.solve(case, only="branch")
    assert caught.value.key == "only"
    command = ["run", case.name, "-o", str(tmp_path / "out"), "--only", "branch"]
    assert cli.main(command) == 2 and "[E-STAGE] --only: no stage branch" in capsys.readouterr().err
    with pytest.raises(CaseError, match="a case is needed, not a NoneType"):
        femgear.solve(None)


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"operation.torque": "1e7 N m"}, "operation.torque"),
        ({"static.members": "elastic", "planet.bearing_stiffness": "1e3 N/m"}, "planet.bearing_stiffness"),
    ],
)
def test_motions_that_are_too_large_name_their_entry_with_its_line(changes, key):
    coarse = {"static.flank_elements": 4, "static.positions": 8, "static.stresses": False}
    case = with_values(read_case(CASES / "planetary_27_40_108.toml"), coarse | changes)
    with pytest.raises(ContactError, match="small displacements") as caught:
        femgear.solve(case, only="static")
    assert (caught.value.code, caught.value.key) == ("E-MOTION", key)
    assert caught.value.limit and caught.value.remedy and caught.value.file


@pytest.mark.usefixtures("coarse_states")
def test_meshes_that_never_carry_are_refused_before_the_modes():
    """A pin circle 300 um off its centre leaves the load to one planet: no linear dynamic model."""
    coarse = {"static.flank_elements": 4, "static.positions": 8, "static.stresses": False}
    changes = {"carrier.errors": {"runout_amplitude": "300 um", "runout_phase": "10 deg"}}
    case = with_values(read_case(CASES / "planetary_27_40_108.toml"), coarse | changes)
    with pytest.raises(ContactError, match="cannot represent loss of contact") as caught:
        femgear.solve(case, only="modes")
    assert (caught.value.code, caught.value.key) == ("E-CONTACT-OPEN", "operation.torque")


def test_a_branch_without_a_start_names_its_entry(monkeypatch):
    from femgear.errors import ConvergenceError
    from femgear.stages.protocol import blaming_start

    case = read_case(CASES / "gear_pair.toml")
    for code, key in (("E-START", "response.from"), ("E-SOLVE", None)):
        with pytest.raises(ConvergenceError) as caught, blaming_start(case, "response.from"):
            raise ConvergenceError("no solution", code=code)
        assert caught.value.key == key and bool(caught.value.file) == bool(key)


def test_a_sweep_over_whole_numbers():
    """Teeth are whole numbers; ranges of other numbers stay as they are."""
    key, values = parse_over("sun.teeth=27..30/4")
    assert key == "sun.teeth" and values == [27, 28, 29, 30] and {type(one) for one in values} == {int}
    assert parse_over("sun.profile_shift=0..1/3")[1] == [0.0, 0.5, 1.0]
    for count in ("1", "1000000", "9" * 18):
        with pytest.raises(FemgearError, match="not a key with values") as caught:
            parse_over(f"sun.teeth=27..30/{count}")
        assert "2 to 100000" in caught.value.limit


def test_values_of_other_kinds_are_named():
    case = read_case(CASES / "planetary_27_40_108.toml")
    assert with_value(case, "sun.teeth", np.int64(27)) == case
    with pytest.raises(CaseError, match="no TOML form") as caught:
        with_value(case, "sun.teeth", 1j)
    assert caught.value.limit.startswith("texts, numbers")
