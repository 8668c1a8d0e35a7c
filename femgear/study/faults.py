"""All that is wrong with a command at once: refusals of its parts are collected and raised as one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager

from femgear.case.messages import combine
from femgear.errors import CaseError

_Part = Callable[..., AbstractContextManager[None]]


@contextmanager
def all_faults() -> Iterator[_Part]:
    """Give blocks ``part(option)``, whose refusals (CaseError) are raised together when this one ends.

    A refusal of a quantity names the option, as ``"--goal"``, where it says nothing but that it is one.
    """
    problems: list[CaseError] = []

    @contextmanager
    def part(option: str = "") -> Iterator[None]:
        try:
            yield
        except CaseError as error:
            if option and error.key in (None, "objective", "speeds"):
                error.key = option if error.key != "speeds" else "--speeds"
            problems.extend(problem for problem in error.problems if isinstance(problem, CaseError))

    yield part
    distinct = {str(problem): problem for problem in problems}
    if distinct:
        raise combine([*distinct.values()], "", "")
