"""Sections of flanks alone: what belongs together, and what a modification has not."""

from typing import get_args

import pytest

from femgear.case.flank_sections import OVER_WIDTH, GearErrors, ModificationSection
from femgear.errors import CaseError
from femgear.gears.modifications import Modification

RELIEF = {"kind": "tip relief", "amount": "10 um", "start_diameter": "44 mm"}
PROFILE = {"kind": "measured profile", "roll_angles": ["10 deg", "20 deg"], "deviations": ["0 um", "-4 um"]}
LEAD = {"kind": "measured lead", "places": ["-9 mm", "9 mm"], "deviations": ["0 um", "3 um"]}


def refusal(**entries) -> CaseError:
    """The refusal of a modification with these entries."""
    with pytest.raises(ValueError) as error:
        ModificationSection.model_validate(entries)
    (problem,) = error.value.errors()
    return problem["ctx"]["error"]


def test_kinds_are_the_classes_of_modifications():
    kinds = get_args(ModificationSection.model_fields["kind"].annotation)
    assert set(kinds) == Modification.kinds.keys() and set(OVER_WIDTH) < set(kinds)
    assert set(OVER_WIDTH) == {"lead slope", "lead crowning", "end relief", "flank twist", "measured lead"}


@pytest.mark.parametrize("entries", [RELIEF, PROFILE, LEAD, {"kind": "end relief", "amount": "5 um", "length": "3 mm"}])
def test_whole_sections_are_read(entries):
    assert ModificationSection.model_validate(entries).kind == entries["kind"]


@pytest.mark.parametrize(
    ("entries", "code", "words"),
    [
        (RELIEF | {"length": "3 mm"}, "E-MODIFICATION", "tip relief has no length"),
        ({"kind": "lead slope", "amount": "5 um", "shape": "linear"}, "E-MODIFICATION", "lead slope has no shape"),
        ({"kind": "lead slope", "amount": "5 um", "end_diameter": "40 mm"}, "E-MODIFICATION", "has no end_diameter"),
        ({"kind": "profile slope", "amount": "5 um", "power": 2.0}, "E-MODIFICATION", "profile slope has no power"),
        (PROFILE | {"amount": "5 um"}, "E-MODIFICATION", "measured profile has no amount"),
        ({"kind": "tip relief", "amount": "10 um"}, "E-KEY-MISSING", "tip relief: the start is missing"),
        ({"kind": "end relief", "amount": "10 um"}, "E-KEY-MISSING", "end relief: the length is missing"),
        ({"kind": "profile crowning"}, "E-KEY-MISSING", "profile crowning: the amount is missing"),
        (RELIEF | {"start_roll_angle": "20 deg"}, "E-DUPLICATE", "say the same"),
        (RELIEF | {"shape": "linear", "power": 1.0}, "E-DUPLICATE", "say the same"),
        (LEAD | {"places": ["9 mm", "9 mm"]}, "E-RANGE", "neither ascending nor descending"),
        (PROFILE | {"deviations": ["0 um"]}, "E-COUNT", "1 deviations over 2 roll_angles"),
        (PROFILE | {"diameters": ["40 mm", "44 mm"]}, "E-MODIFICATION", "either roll_angles or diameters"),
    ],
)
def test_what_does_not_belong_together_is_refused(entries, code, words):
    error = refusal(**entries)
    assert error.code == code and words in error.message


def test_a_power_is_given_or_that_of_the_shape():
    exponents = [
        ModificationSection.model_validate(RELIEF | more).exponent
        for more in ({}, {"shape": "linear"}, {"shape": "parabolic"}, {"power": 1.5})
    ]
    assert exponents == [1.0, 1.0, 2.0, 1.5]


def test_pitch_errors_are_given_once():
    with pytest.raises(ValueError, match="pitch and cumulative_pitch say the same"):
        GearErrors.model_validate({"pitch": ["1 um", "-1 um"], "cumulative_pitch": ["1 um", "0 um"]})
