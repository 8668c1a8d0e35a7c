"""Linear equations in fractions: what they determine, leave open and contradict, without rounding."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

Row = dict[int, Fraction]
"""Coefficients of an equation by the numbers of its columns, none of them zero."""


@dataclass(frozen=True)
class ExactSolution:
    """Unknowns of homogeneous equations in terms of given quantities, all by the numbers of their columns.

    Parameters
    ----------
    ratio : mapping
        Of every determined unknown: its share [1] of each given quantity; an empty one is zero.
    open : mapping
        Of every unknown that is not determined: the other open unknowns in its equation. Those without any are
        parameters: their values decide the rest.
    relations : tuple of mappings
        What the equations demand of the given quantities alone: the sum of coefficient times value is zero. The
        coefficient of the last given one is 1, and every relation has another last one.
    """

    ratio: Mapping[int, Row]
    open: Mapping[int, tuple[int, ...]]
    relations: tuple[Row, ...]

    @property
    def parameters(self) -> tuple[int, ...]:
        """Open unknowns whose values decide the rest."""
        return tuple(column for column, others in self.open.items() if not others)


def reduce_rows(rows: Sequence[Mapping[int, Fraction]], columns: Sequence[int]) -> tuple[dict[int, Row], list[Row]]:
    """Eliminate columns from equations, in their order (Gauss and Jordan).

    Returns
    -------
    pivots : dict
        By columns: the equation that alone holds this column, with the coefficient 1.
    rest : list
        The equations without any of the columns, none of them empty.
    """
    pending = [{column: Fraction(value) for column, value in row.items() if value} for row in rows]
    pivots: dict[int, Row] = {}
    for column in columns:
        place = next((i for i, row in enumerate(pending) if column in row), None)
        if place is None:
            continue
        row = pending.pop(place)
        pivot = {other: value / row[column] for other, value in row.items()}
        for other in (*pending, *pivots.values()):
            _subtract(other, pivot, other.get(column, Fraction(0)))
        pivots[column] = pivot
    return pivots, [row for row in pending if row]


def _subtract(row: Row, pivot: Row, factor: Fraction) -> None:
    """Take a multiple of one equation off another, in place."""
    if not factor:
        return
    for column, value in pivot.items():
        difference = row.pop(column, Fraction(0)) - factor * value
        if difference:
            row[column] = difference


def solve_exactly(
    rows: Sequence[Mapping[int, Fraction]], unknown: Sequence[int], given: Sequence[int] = ()
) -> ExactSolution:
    """Solve homogeneous equations for unknown quantities in terms of given ones.

    Parameters
    ----------
    rows : sequence of mappings
        Coefficients by columns: the sum of coefficient times quantity is zero. Columns that are neither unknown nor
        given are quantities that are zero.
    unknown, given : sequences of int
        Columns. Where several choices are possible the last unknowns are the parameters.
    """
    wanted = {*unknown, *given}
    cut = [{column: value for column, value in row.items() if column in wanted} for row in rows]
    pivots, rest = reduce_rows(cut, unknown)
    determined, ratio, free = set(given), {}, {}
    for column in unknown:
        row = pivots.get(column, {column: Fraction(1)})
        others = tuple(other for other in row if other != column and other not in determined)
        if others or column not in pivots:
            free[column] = others
        else:
            ratio[column] = {other: -value for other, value in row.items() if other != column}
    relations, _ = reduce_rows(rest, [*reversed(given)])
    return ExactSolution(ratio, free, tuple(relations.values()))


def whole_echelon(rows: Sequence[Sequence[int]]) -> tuple[list[list[int]], list[list[int]]]:
    """Bring a matrix of whole numbers to echelon form by whole row operations that can be undone (Euclid).

    Returns
    -------
    echelon, factors : lists of lists of int
        ``echelon = factors @ rows``, rows of zeros last. The factors of these are a basis of all whole sums of the
        rows that vanish.
    """
    count = len(rows)
    echelon = [[int(value) for value in row] for row in rows]
    factors = [[int(i == j) for j in range(count)] for i in range(count)]
    top = 0
    for column in range(len(echelon[0]) if count else 0):
        while True:
            filled = [i for i in range(top, count) if echelon[i][column]]
            if len(filled) < 2:
                break
            pivot = min(filled, key=lambda i: abs(echelon[i][column]))
            for i in (i for i in filled if i != pivot):
                times = echelon[i][column] // echelon[pivot][column]
                for matrix in (echelon, factors):
                    matrix[i] = [value - times * other for value, other in zip(matrix[i], matrix[pivot], strict=True)]
        if filled:
            for matrix in (echelon, factors):
                matrix[top], matrix[filled[0]] = matrix[filled[0]], matrix[top]
            top += 1
    return echelon, factors
