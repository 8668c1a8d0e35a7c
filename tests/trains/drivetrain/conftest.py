"""Shipped drivetrain cases."""

from pathlib import Path

import pytest

from femgear.trains.reading import read_case

CASES = Path(__file__).parents[3] / "cases"


@pytest.fixture(scope="session")
def paper():
    return read_case(CASES / "wind_turbine_drivetrain.toml")


@pytest.fixture(scope="session")
def own():
    return read_case(CASES / "own_chain.toml")
