"""Shafts, the stages that tie their speeds, what is held and what couplings join: the equations of a power flow."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property

from femgear.gears.exact_linear import ExactSolution, Row, solve_exactly

EXTERNAL, INTERNAL = -1, 1
"""Sense of rotation of gear 2 over that of gear 1, seen from the carrier."""


@dataclass(frozen=True)
class StageGears:
    """Gears of a stage and their meshes, by what they are: "sun", "planet", "ring", "gear 1".

    Parameters
    ----------
    teeth : mapping
        Numbers of teeth, as far as the ratios need them.
    shafts : mapping
        Shaft of every central gear, and of the "carrier" of planets; None is the casing.
    meshes : tuple of (str, str, int)
        Gear 1, gear 2 and `EXTERNAL` or `INTERNAL`; the first one of a chain is central.
    bodies : tuple of (str, str)
        Planet gears that are one body.
    """

    teeth: Mapping[str, int]
    shafts: Mapping[str, str | None]
    meshes: tuple[tuple[str, str, int], ...]
    bodies: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class SpeedCondition:
    """A tie between speeds: the sum of weight times speed over shafts is zero.

    Parameters
    ----------
    name : str
        Of the stage, in messages and results.
    weights : mapping
        Weight [1] by shaft. Times one unknown [N m] they are the torques that the stage puts on the shafts.
    gears : StageGears, optional
        For `femgear.gears.stage_frequencies`.
    """

    name: str
    weights: Mapping[str, Fraction]
    gears: StageGears | None = field(default=None, compare=False)


@dataclass(frozen=True, eq=False)
class ShaftGraph:
    """Shafts, the ``conditions`` on their speeds, those that are ``held`` and those that couplings join rigidly.

    Joined ``shafts`` are one group; groups and stages have numbers, which are the columns of the equations.
    ``joined`` are groups of names, which may overlap.
    """

    shafts: tuple[str, ...]
    conditions: tuple[SpeedCondition, ...]
    held: tuple[str, ...] = ()
    joined: tuple[tuple[str, ...], ...] = ()

    @cached_property
    def group(self) -> dict[str, int]:
        """Number of the group of every shaft."""
        merged = connected_sets([*((shaft,) for shaft in self.shafts), *self.joined])
        return {shaft: number for number, shafts in enumerate(merged) for shaft in self.shafts if shaft in shafts}

    @cached_property
    def rows(self) -> list[Row]:
        """Weights of every stage by groups, zeros left out."""
        rows: list[Row] = []
        for condition in self.conditions:
            row: Row = {}
            for shaft, weight in condition.weights.items():
                row[self.group[shaft]] = row.get(self.group[shaft], Fraction(0)) + weight
            rows.append({group: weight for group, weight in row.items() if weight})
        return rows

    @cached_property
    def standing(self) -> frozenset[int]:
        """Groups with a shaft that is held."""
        return frozenset(self.group[shaft] for shaft in self.held)

    @cached_property
    def count(self) -> int:
        """Number of groups."""
        return len(set(self.group.values()))

    @cached_property
    def parts(self) -> list[tuple[int, ...]]:
        """Numbers of the stages of every part of the graph: stages that hang together by groups."""
        marked = [{("stage", number), *row} for number, row in enumerate(self.rows)]
        return sorted(
            tuple(sorted(element[1] for element in part if isinstance(element, tuple)))
            for part in connected_sets(marked)
        )

    def names(self, groups: Collection[int]) -> list[str]:
        """List the shafts of groups."""
        return [shaft for shaft in self.shafts if self.group[shaft] in groups]

    def speeds(self, given: Sequence[str] = ()) -> ExactSolution:
        """Solve for the speeds of all groups in terms of those of shafts whose speed is given."""
        columns = [group for group in dict.fromkeys(self.group[shaft] for shaft in given) if group not in self.standing]
        unknown = [group for group in range(self.count) if group not in self.standing and group not in columns]
        return solve_exactly(self.rows, unknown, columns)

    def torques(
        self, given: Sequence[str], unknown: Sequence[str], stages: Sequence[int] | None = None
    ) -> ExactSolution:
        """Solve the balance of all groups for the stages and for unknown torques, in terms of given ones.

        Columns are the numbers of the stages, then places of `unknown` and of `given`, both shafts on which
        external torques act. Of some ``stages`` the balance is that of their groups alone.
        """
        count, groups = len(self.conditions), range(self.count)
        stages = range(count) if stages is None else stages
        if len(stages) < count:
            groups = sorted({group for stage in stages for group in self.rows[stage]})
        balance: dict[int, Row] = {group: {} for group in groups}
        for stage in stages:
            for group, weight in self.rows[stage].items():
                balance[group][stage] = weight
        outside = {count + place: shaft for place, shaft in enumerate((*unknown, *given))}
        for column, shaft in outside.items():
            if self.group[shaft] in balance:
                balance[self.group[shaft]][column] = Fraction(1)
        inside = [column for column, shaft in outside.items() if self.group[shaft] in balance]
        first_given = count + len(unknown)
        wanted = [*stages, *(column for column in inside if column < first_given)]
        return solve_exactly([*balance.values()], wanted, [column for column in inside if column >= first_given])


def connected_sets(sets: Iterable[Iterable]) -> list[set]:
    """Unite sets that share elements, in the order of their first ones."""
    merged: list[set] = []
    for elements in map(set, sets):
        touched = [part for part in merged if part & elements]
        if touched:
            touched[0].update(elements, *touched[1:])
            merged = [part for part in merged if not any(part is other for other in touched[1:])]
        else:
            merged.append(elements)
    return merged
