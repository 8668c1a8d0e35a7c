"""Latest answers about objects that do not change."""

import gc
import weakref

import pytest

from femgear.remembered import remembered


class Thing:
    def __init__(self, value):
        self.value = value

    def __eq__(self, other):
        raise AssertionError("compared by all its numbers")

    __hash__ = None  # type: ignore[assignment]


def test_the_same_objects_are_asked_about_once_and_equal_ones_anew():
    asked = []

    @remembered(latest=2)
    def double(one, other):
        asked.append(one.value)
        return 2 * one.value + other.value

    one, other, beside = Thing(1), Thing(2), Thing(1)
    assert [double(one, other), double(one, other), double(beside, other)] == [4, 4, 4]
    assert asked == [1, 1]
    assert double.__name__ == "double"


def test_errors_are_raised_anew_and_old_objects_are_let_go():
    calls = []

    @remembered(latest=1)
    def refuse(thing):
        calls.append(1)
        raise ValueError

    for _ in range(2):
        with pytest.raises(ValueError):
            refuse(calls)
    assert len(calls) == 2

    @remembered(latest=1)
    def value(thing):
        return thing.value

    first = Thing(1)
    gone = weakref.ref(first)
    value(first)
    del first
    value(Thing(2))
    gc.collect()
    assert gone() is None
