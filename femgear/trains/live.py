"""A case that answers again after every change: results by stage, of which all that can be is kept.

`Answer` holds the stages of one case, each computed when it is first asked for; `Live` changes the case and
gives the next answer. What decides a result stands in `femgear.case.dependencies` alone: a stage whose
entries a change leaves as they are is the one that was computed, to the last digit.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from femgear.case.dependencies import Steps, compliance_entries
from femgear.case.planetary import Case
from femgear.errors import CaseError
from femgear.stages.protocol import Progress, Stage, one_blas_thread, silent
from femgear.trains.reading import read_case, with_values
from femgear.trains.registry import check_case, stages_of, train_of
from femgear.trains.shown import Shown


class Answer(Shown):
    """Results of the stages of one case, each computed when it is first asked for.

    ``answer.static`` and ``answer["static"]`` are what `femgear.solve` gives by that name; the mapping has
    the stages that a whole run computes, and gives any other that the case can have. ``dataset()`` of a
    result makes its tables. FemgearError: where a stage cannot be computed, as in `femgear.solve`.

    Parameters
    ----------
    case : Case
        Of any train.
    steps : Steps
        What answers share: results by stage, and the parts of them that cases have in common.
    cache : path, optional
        Folder of generated grids.
    """

    def __init__(self, case: Any, steps: Steps, *, cache: Path | None = None, progress: Progress = silent) -> None:
        self.case, self.steps, self.cache, self._progress = case, steps, cache, progress
        # results of this case stay, whatever other answers leave behind
        self._results: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        if name not in self._results:
            self._results[name] = self._of_stage(stages_of(self.case, name)[-1])
        return self._results[name]

    def __getattr__(self, name: str) -> Any:
        # copies and pickles ask before there is a case
        if name.startswith("_") or "case" not in vars(self) or train_of(self.case).stage(name) is None:
            raise AttributeError(f"{type(self).__name__} has no {name}")
        return self[name]

    def __contains__(self, name: object) -> bool:
        return name in self._known()

    def __iter__(self) -> Iterator[str]:
        return iter(self._known())

    def __len__(self) -> int:
        return len(self._known())

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self]

    def __repr__(self) -> str:
        return f"<Answer: {', '.join(self)}; computed: {', '.join(self._results) or 'nothing yet'}>"

    def of(self, case: Any) -> Answer:
        """Give the answer of another case, which shares all steps with this one."""
        # grids of teeth that are tried would fill the folder
        comparable = isinstance(case, Case) and isinstance(self.case, Case)
        same = not comparable or compliance_entries(case) == compliance_entries(self.case)
        cache = self.cache if same else None
        return Answer(case, self.steps, cache=cache, progress=self._progress)

    def keep(self) -> None:
        """Keep the results of this answer as the latest ones, whatever others came after it."""
        for name, result in self._results.items():
            self.steps.keep(name, stages_of(self.case, name)[-1].decided_by(self.case), result)

    def unknown(self) -> dict[str, bool]:
        """Tell of every stage of a whole run whether it has yet to be computed: none is kept."""
        return {
            name: name not in self._results and self.steps.kept(name, stage.decided_by(self.case)) is None
            for name, stage in self._known().items()
        }

    def _known(self) -> dict[str, Stage]:
        """Stages that a whole run of the case computes, by name."""
        return {stage.name: stage for stage in stages_of(self.case)}

    @one_blas_thread()
    def _of_stage(self, stage: Stage) -> Any:
        """The result of a stage: as it was kept, or computed now from those that it takes."""
        entries, before = stage.decided_by(self.case), stage.before(self.case)
        if (kept := self.steps.kept(stage.name, entries)) is not None:
            return kept
        taken = [self[name] if name in before else None for name in stage.takes]
        options_known = {"cache": self.cache, "progress": self._progress, "steps": self.steps}
        options = {name: options_known[name] for name in stage.options}
        return self.steps.keep(stage.name, entries, stage.solve(self.case, *taken, **options))


class Live:
    """A case that is changed entry by entry, and answers after every change.

    Parameters
    ----------
    case : Case, or what `femgear.read_case` takes
        Of any train; what is kept of a stage beside whole results is told by its ``steps``.
    cache : path, optional
        Folder of generated grids; those of other teeth than the case's own are not left there.
    progress : callable, optional
        Called with (stage, done, total).

    Attributes
    ----------
    answer : Answer
        Of the case as it stands after all changes.
    changed : dict of str to bool
        Whether the last change concerns each stage of a whole run, which is then computed when it is asked
        for; where it does not, the result is the one that was kept.
    """

    def __init__(self, case: Any, *, cache: Path | None = None, progress: Progress = silent) -> None:
        case = case if hasattr(case, "train") else read_case(case)
        check_case(case)
        self._first = self.answer = Answer(case, Steps(), cache=cache, progress=progress)
        self.changed = self.answer.unknown()

    def __repr__(self) -> str:
        return f"<Live: {self.case!r}>"

    @property
    def case(self) -> Any:
        """The case as it stands after all changes."""
        return self.answer.case

    def change(self, values: Mapping[str, object]) -> Answer:
        """Change entries of the case, and give its answer; all later changes go on from there.

        Parameters
        ----------
        values : mapping of str to object
            By dotted keys, as the case file would hold them: ``{"operation.torque": "90 N m"}``, see
            `femgear.with_values`; None takes an entry out.

        Raises
        ------
        CaseError, GeometryError
            Everything that the case file would be refused for; the case stays as it was then.
        """
        if not isinstance(values, Mapping):
            raise CaseError(
                f"entries are changed by a mapping, not by {type(values).__name__}",
                code="E-TYPE",
                limit="keys and values as of the case file",
                remedy='as in change({"operation.torque": "90 N m"})',
            )
        changed = with_values(self.case, values)
        check_case(changed)
        # of the first one, whose grids are kept on disk
        return self.back_to(self._first.of(changed))

    def back_to(self, answer: Answer) -> Answer:
        """Go back to an earlier answer: later changes go on from its case and its results."""
        answer.keep()
        self.answer, self.changed = answer, answer.unknown()
        return answer
