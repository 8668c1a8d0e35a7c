from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from femgear.case.sections import Case

Results = Mapping[str, Any]


@dataclass(frozen=True)
class Stage:
    """One stage of a run.

    Parameters
    ----------
    compute : callable
        ``(case, results, cache, progress) -> result`` from the results of the stages before, by name.
    verdict : callable
        ``(result) -> dict`` for the manifest.
    wanted : callable
        ``(case) -> bool``: whether a run without ``only`` computes it.
    possible : callable
        ``(case) -> str``: why the case cannot have the stage, empty where it can.
    needs : callable
        ``(case) -> tuple of str``: stages that must come before.
    """

    compute: Callable[[Case, Results, Path, Progress | None], Any]
    verdict: Callable[[Any], dict]
    wanted: Callable[[Case], bool] = lambda case: True
    possible: Callable[[Case], str] = lambda case: ""
    needs: Callable[[Case], tuple[str, ...]] = lambda case: ()


@dataclass(frozen=True)
class Kind:
    """Stages of a kind of case in order, its check before a run, and its name in messages."""

    stages: Mapping[str, Stage]
    check: Callable[[Case, Any], None]
    words: str


Progress = Callable[[str, float, float], None]
