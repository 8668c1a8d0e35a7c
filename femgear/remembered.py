"""Answers about objects that do not change, kept as long as they are asked for again and again."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, wraps
from typing import Any, TypeVar

Answer = TypeVar("Answer")


class _Itself:
    """An object that equals itself alone: cases and results compare by all their numbers, or not at all."""

    __slots__ = ("object",)

    def __init__(self, thing: Any):
        self.object = thing

    def __hash__(self) -> int:
        return id(self.object)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Itself) and self.object is other.object


def remembered(latest: int) -> Callable[[Callable[..., Answer]], Callable[..., Answer]]:
    """Make a function of frozen objects keep its latest answers; what it raises is not kept.

    Arguments are told apart by identity, so that equal ones that were made anew are asked about anew; the
    objects live as long as the answer about them is among the ``latest``.
    """

    def decorate(function: Callable[..., Answer]) -> Callable[..., Answer]:
        @lru_cache(maxsize=latest)
        def answer(*things: _Itself) -> Answer:
            return function(*(thing.object for thing in things))

        @wraps(function)
        def asked(*things: object) -> Answer:
            return answer(*map(_Itself, things))

        return asked

    return decorate
