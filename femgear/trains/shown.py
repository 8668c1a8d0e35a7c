"""What scripts and notebooks show of results: figures, tables, answers of page one.

They take results wherever these are: of `femgear.solve` and handles in memory, of a run in its folder.
"""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from femgear.errors import CaseError
from femgear.findings import once
from femgear.remembered import remembered
from femgear.report.style import Drawings
from femgear.stages.protocol import Drawn, Stage, Train
from femgear.storage.contents import as_dataset
from femgear.storage.results import Manifest, Results
from femgear.trains.reading import read_case
from femgear.trains.registry import train_of

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.figure import Figure

    from femgear.findings import Finding
    from femgear.stages.judgements import Judgement

_STORED = 8
"""Stages whose contents are kept: those of one run, which are asked for after each of them."""


class Shown(Mapping[str, Any]):
    """Results by stage of a ``case`` that show themselves: those of `femgear.solve`, and answers of `femgear.live`."""

    case: Any

    def plot(self, name: str) -> Figure:
        """Draw a figure of the results, of an answer with no more stages than it takes.

        Parameters
        ----------
        name : str
            Of `figures`, such as ``"static_transmission_error"``.

        Raises
        ------
        CaseError
            E-CHOICE: there is no such figure.
        """
        train = train_of(self.case)
        by_stage = {stage: [*of_stage.captions] for stage, of_stage in train.figures.items() if stage in self}
        stage = next((stage for stage, names in by_stage.items() if any(map(name.startswith, names))), "")
        computed = {needed: self[needed] for needed in self._up_to(train, stage)}
        drawn = _drawings(results_in_memory(self.case, computed), computed)
        if name not in drawn:
            limit = ", ".join(drawn or (name for names in by_stage.values() for name in names))
            raise CaseError("there is no such figure", code="E-CHOICE", key="name", value=name, limit=limit)
        return drawn[name]

    def _up_to(self, train: Train, name: str) -> list[str]:
        """Stages that one is computed of, itself the last."""
        stage = train.stage(name)
        before = () if stage is None else stage.before(self.case)
        earlier_stages = [earlier for needed in before for earlier in self._up_to(train, needed)]
        return [*dict.fromkeys(earlier_stages), *([name] if stage is not None and name in self else [])]


class Summary:
    """What page one of a report says, as text.

    Parameters
    ----------
    sentence : str
    judgements : tuple of Judgement
        Answers to the questions of page one.
    """

    def __init__(self, sentence: str, judgements: tuple[Judgement, ...]) -> None:
        self.sentence, self.judgements = sentence, judgements

    def __repr__(self) -> str:
        lines = (f"{judgement.question} {judgement.words}: {judgement.answer}" for judgement in self.judgements)
        return "\n".join([self.sentence, *lines])

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{escape(judgement.question)}</td><td>{escape(judgement.words)}</td><td>{escape(judgement.answer)}</td></tr>"
            for judgement in self.judgements
        )
        return f"<p><b>{escape(self.sentence)}</b></p><table>{rows}</table>"


def results_in_memory(case: Any, computed: Mapping[str, Any], folder: Path = Path()) -> Results:
    """Collect computed stages as the results of a run that came to its end.

    Parameters
    ----------
    case : Case
    computed : mapping of str to StageResult
        By stage.
    folder : path, optional
        Where they would be.
    """
    train = train_of(case)
    stored = {name: _stored(train.stage(name), result) for name, result in computed.items()}
    contents = {name: data for name, (data, _) in stored.items()}
    everything = once([*_case_findings(case), *(finding for _, findings in stored.values() for finding in findings)])
    manifest = Manifest(complete=True, files={f"{name}.nc": "" for name in contents}, findings=everything)
    return Results(folder, manifest, read_case).with_known({"case": case} | contents)


@remembered(latest=_STORED)
def _stored(stage: Stage | None, result: Any) -> tuple[xr.Dataset, tuple[Finding, ...]]:
    """Contents of the file of a stage, and what they say against themselves."""
    data = as_dataset(result.contents())
    return data, () if stage is None else stage.findings(data)


@remembered(latest=1)
def _case_findings(case: Any) -> tuple[Finding, ...]:
    """What a case says against itself."""
    return tuple(train_of(case).case_warnings(case))


def _as_results(source: Any) -> tuple[Results, Mapping[str, Any]]:
    """Results of whatever holds them, and the objects that a solution in memory has beside its tables."""
    if isinstance(source, Results):
        return source, {}
    case = getattr(source, "case", None)
    if case is None or not isinstance(source, Mapping):
        limit = "what femgear.solve, femgear.live or femgear.open_results gave"
        raise CaseError(f"these are no results but {type(source).__name__}", code="E-TYPE", limit=limit)
    computed = {name: source[name] for name in source}
    return results_in_memory(case, computed), computed


def figures(source: Shown | Results) -> Mapping[str, Figure]:
    """Give the figures of results by name, as a report shows them; each is drawn when it is asked for.

    Parameters
    ----------
    source : Solution, Answer or Results
        What `femgear.solve`, `femgear.live` or `femgear.open_results` gave.

    Returns
    -------
    mapping of str to Figure
        Matplotlib figures: ``figures(solution)["static_transmission_error"].savefig("ste.png")``.

    Raises
    ------
    CaseError
        E-TYPE: these are no results.
    """
    return _drawings(*_as_results(source))


def _drawings(results: Results, computed: Mapping[str, Any]) -> Mapping[str, Figure]:
    """Figures of results by name, each drawn when it is asked for; see `figures`."""
    train, data = train_of(results.case), {name: results[name] for name in results.stages}
    drawn = Drawn(results.case, data, computed)
    of_stages = [train.figures[name].draw(drawn) for name in (*data, "") if name in train.figures]
    return Drawings({name: (lambda shown=shown, name=name: shown[name]) for shown in of_stages for name in shown})


def tables(source: Shown | Results) -> dict[str, pd.DataFrame]:
    """Give the tables that are printed of results, by their titles.

    Parameters
    ----------
    source : Solution, Answer or Results
        What `femgear.solve`, `femgear.live` or `femgear.open_results` gave.

    Returns
    -------
    dict of str to DataFrame
        Texts as they are printed, with units in the header; numbers stand in ``dataset()`` of the results.

    Raises
    ------
    CaseError
        E-TYPE: these are no results.
    """
    import pandas as pd

    results, _ = _as_results(source)
    train = train_of(results.case)
    blocks = [*train.verdict(results), *train.describe_stages(results).values()]
    filled = [block for block in blocks if block.rows]
    return {block.title: pd.DataFrame(list(block.rows), columns=list(block.header) or None) for block in filled}


def summary(source: Shown | Results) -> Summary:
    """Answer the questions of page one of a report: is it strong, quiet, cool, and can the numbers be relied on.

    Parameters
    ----------
    source : Solution, Answer or Results
        What `femgear.solve`, `femgear.live` or `femgear.open_results` gave.

    Returns
    -------
    Summary
        Prints as text, and shows itself in notebooks.

    Raises
    ------
    CaseError
        E-TYPE: these are no results.
    """
    results, _ = _as_results(source)
    train = train_of(results.case)
    sentence, judgements = train.summary(results)
    return Summary(f"{train.duty(results.case)} {sentence}".strip(), judgements)
