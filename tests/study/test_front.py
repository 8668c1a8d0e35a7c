"""Fronts of two objectives: which designs are dominated, hollow fronts, findings."""

import math

import numpy as np
import pytest
from study.test_search import CASE, X, Y, function

from femgear.errors import CaseError
from femgear.study.front import non_dominated, pareto_front
from femgear.study.problem import Problem
from femgear.study.search import SearchOptions
from femgear.trains.reading import read_case


@pytest.fixture(scope="module")
def case():
    return read_case(CASE)


def test_a_hollow_front_is_found(case, tmp_path):
    """C. M. Fonseca, P. J. Fleming, Evol. Comput. 3 (1995): weighted sums end at the ends of this front."""
    scaled = lambda x, y: ((x - 0.05) / 0.9 * 4 - 2, (y - 0.1) / 2.9 * 4 - 2)  # noqa: E731
    r = 1 / math.sqrt(2)
    first, second = (
        function(name, lambda x, y, s=s: 1 - math.exp(-sum((u - s * r) ** 2 for u in scaled(x, y))))
        for name, s in (("one", 1), ("two", -1))
    )
    problem = Problem(case, [X, Y], first)
    options = {"points": 5, "options": SearchOptions(samples=8), "journal": tmp_path / "j"}
    front = pareto_front(problem, second, **options)
    assert front.complete and len(front.values) >= 6
    assert np.all(np.diff(front.values[:, 0]) > 0) and np.all(np.diff(front.values[:, 1]) < 0)
    # on the front both coordinates are equal: f = 1 - exp(-2 (u -+ r)^2)
    u = r - np.sqrt(-0.5 * np.log(1 - front.values[:, 0]))
    exact = 1 - np.exp(-2 * (u + r) ** 2)
    assert np.all(front.values[:, 1] >= exact - 1e-9)
    middle = front.values[front.compromise]
    assert abs(middle - (1 - math.exp(-1))).max() < 0.06
    lines = (tmp_path / "j").read_bytes()
    np.testing.assert_array_equal(pareto_front(problem, second, **options).values, front.values)
    assert (tmp_path / "j").read_bytes() == lines
    with pytest.raises(CaseError, match="two objectives"):
        pareto_front(Problem(case, [X, Y], first), first)


def test_which_rows_are_dominated():
    values = np.array([[1.0, 3.0], [2.0, 2.0], [2.0, 2.5], [3.0, 1.0], [3.0, 3.0], [1.0, 3.0]])
    assert sorted(non_dominated(values)) == [0, 1, 3]
