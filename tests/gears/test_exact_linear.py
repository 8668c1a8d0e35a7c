"""Linear equations in fractions against determinants and hand calculation."""

from fractions import Fraction
from itertools import permutations
from random import Random

import pytest

from femgear.gears.exact_linear import reduce_rows, solve_exactly, whole_echelon


def determinant(matrix):
    """Sum over all permutations (Leibniz)."""
    total, size = 0, len(matrix)
    for order in permutations(range(size)):
        sign = 1
        for i in range(size):
            sign *= (-1) ** sum(order[j] > order[i] for j in range(i))
        product = sign
        for row, column in zip(matrix, order, strict=True):
            product *= row[column]
        total += product
    return total


@pytest.mark.parametrize("seed", range(20))
def test_square_systems_agree_with_the_rule_of_cramer(seed):
    random = Random(seed)
    size = random.randint(1, 4)
    matrix = [[Fraction(random.randint(-5, 5)) for _ in range(size)] for _ in range(size)]
    right = [Fraction(random.randint(-5, 5)) for _ in range(size)]
    whole = determinant(matrix)
    rows = [{**dict(enumerate(row)), size: -value} for row, value in zip(matrix, right, strict=True)]
    solution = solve_exactly(rows, range(size), [size])
    if whole == 0:
        assert solution.open
        return
    assert not solution.open and not solution.relations
    for column in range(size):
        replaced = [[*row[:column], value, *row[column + 1 :]] for row, value in zip(matrix, right, strict=True)]
        assert solution.ratio[column].get(size, 0) == determinant(replaced) / whole


def test_what_is_open_is_told_from_what_is_determined():
    # x0 + x1 = 0 leaves both open; x2 = 3 x4 is determined; x3 stands in no equation
    solution = solve_exactly([{0: Fraction(1), 1: Fraction(1)}, {2: Fraction(1), 4: Fraction(-3)}], [0, 1, 2, 3], [4])
    assert solution.ratio == {2: {4: 3}}
    assert solution.open == {0: (1,), 1: (), 3: ()} and solution.parameters == (1, 3)


def test_given_quantities_meet_relations():
    # x0 = g1 and 2 x0 = g2: the last of the given ones is told by the others
    solution = solve_exactly([{0: Fraction(1), 1: Fraction(-1)}, {0: Fraction(2), 2: Fraction(-1)}], [0], [1, 2])
    assert solution.relations == ({2: 1, 1: -2},)


def test_columns_that_nobody_names_are_zero():
    assert solve_exactly([{0: Fraction(1), 7: Fraction(5)}], [0]).ratio == {0: {}}


def test_equations_that_repeat_others_vanish():
    rows = [{0: Fraction(1), 1: Fraction(2)}, {0: Fraction(1, 3), 1: Fraction(2, 3)}]
    assert reduce_rows(rows, [0]) == ({0: {0: 1, 1: 2}}, [])


@pytest.mark.parametrize("seed", range(20))
def test_whole_operations_leave_an_echelon_and_can_be_undone(seed):
    random = Random(seed)
    rows = [[random.randint(-9, 9) for _ in range(3)] for _ in range(random.randint(1, 5))]
    echelon, factors = whole_echelon(rows)
    product = [[sum(f * row[j] for f, row in zip(some, rows, strict=True)) for j in range(3)] for some in factors]
    assert product == echelon
    assert abs(determinant(factors)) == 1
    first = [next((n for n, value in enumerate(row) if value), 3 + i) for i, row in enumerate(echelon)]
    assert first == sorted(set(first))
