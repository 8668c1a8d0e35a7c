"""One catalogue of findings: every code in the source stands in it, and none that nobody raises."""

import re
from pathlib import Path

import pytest

from femgear.findings import CATALOGUE, SEVERITIES, Finding, remark

PACKAGE = Path(__file__).parents[1] / "femgear"


def codes_in_the_source() -> set[str]:
    files = (path for path in PACKAGE.rglob("*.py") if path.name != "findings.py")
    return {code for path in files for code in re.findall(r'"(W-[A-Z0-9-]+)"', path.read_text())}


def test_every_code_stands_in_the_catalogue_and_is_raised():
    assert codes_in_the_source() == set(CATALOGUE)


@pytest.mark.parametrize("code", CATALOGUE)
def test_meanings_are_sentences_and_severities_known(code):
    severity, meaning = CATALOGUE[code]
    assert severity in SEVERITIES
    assert meaning[0].isupper() and meaning.endswith(".")


def test_a_finding_has_the_severity_of_its_code_unless_given():
    assert Finding("W-PRESSURE", "", "too much").severity == "fault"
    assert Finding("W-PRESSURE", "", "too much", severity="doubt").severity == "doubt"
    assert remark("read so").severity == "note"


def test_unknown_codes_and_severities_are_refused():
    with pytest.raises(KeyError, match="W-NOWHERE"):
        Finding("W-NOWHERE", "", "text")
    with pytest.raises(ValueError, match="loud"):
        Finding("W-PULL", "", "text", severity="loud")
