"""Shares of the time of a load spectrum, and load cases of the life of a stage."""

from types import SimpleNamespace
from typing import Any

import pytest

from femgear.case.quantities import RPM
from femgear.exchange.unit_spectrum import load_case_shares, share_time, spectrum_tables


def unit(count: int) -> Any:
    """A unit of so many load cases, which keeps what is remarked on it."""
    model = SimpleNamespace(load_cases=[{}] * count, texts=[])
    model.remark = lambda key, text, **rest: model.texts.append(text)
    return model


def test_shares_are_fractions_or_durations():
    def cases(name, *values, unit="h"):
        return [{"1": {name: (str(value), unit)}, "10": {"rotational_speed": ("500", "1 / min")}} for value in values]

    assert load_case_shares(cases("load_duration_fraction", 20, 80, unit="%")) == pytest.approx([0.2, 0.8])
    assert load_case_shares(cases("load_duration", 500, 1500)) == pytest.approx([0.25, 0.75])
    mixed = [*cases("load_duration", 1), *cases("load_duration", 180, unit="min")]
    assert load_case_shares(mixed) == pytest.approx([0.25, 0.75])
    # fractions come first; durations of some load cases say no share
    both = cases("load_duration", 500, 1500)
    both[0]["1"]["load_duration_fraction"] = ("10", "%")
    assert load_case_shares(both) == [pytest.approx(0.1), None]
    assert load_case_shares([*cases("load_duration", 5), {}]) == [None, None]
    assert load_case_shares(cases("load_duration", 0, 30, 10)) == [0.0, 0.75, 0.25]


@pytest.mark.parametrize(
    "given, shares", [([0.2, 0.8], [0.2, 0.8]), ([0.3, 0.5], [0.375, 0.625]), ([0.4, None], [0.4, 0.6]), ([3.0], [1.0])]
)
def test_shares_become_the_running_time(given, shares):
    tables = [{} if share is None else {"share": share} for share in given]
    model = unit(len(given))
    share_time(tables, model)
    assert [table["share"] for table in tables] == pytest.approx(shares)
    assert bool(model.texts) == (given != shares)


def test_a_stage_has_the_load_cases_that_turn_and_load_it():
    model = unit(4)
    torques, speeds = (30.0, None, -90.0, 10.0), (543 * RPM, RPM, 3456 * RPM, 0.0)
    first, second = spectrum_tables(model, torques, speeds, (0.1, 0.2, 0.3, 0.4))
    assert first == {"name": "load case 1", "torque": "30 N m", "speed": "543 rpm", "share": 0.25}
    assert second["torque"] == "-90 N m" and second["share"] == 0.75 and len(model.texts) == 3
    assert spectrum_tables(unit(1), (30.0,), (RPM,), (1.0,)) == []
    # speeds of one torque are those of operation.speeds
    assert spectrum_tables(unit(2), (30.0, 30.0), (RPM, 2.0 * RPM), (None, None)) == []
    assert len(spectrum_tables(unit(2), (30.0, 40.0), (RPM, RPM), (None, None))) == 2
    assert spectrum_tables(unit(2), (30.0, None), (RPM, RPM), (0.5, 0.5)) == []
