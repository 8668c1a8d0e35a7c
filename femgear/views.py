"""What scripts and notebooks show of results: figures, tables, answers of page one, curves of the mesh stiffness.

They take results wherever these are: of `femgear.solve` and handles in memory, of a run in its folder.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.errors import CaseError
from femgear.findings import once
from femgear.report.style import Drawings
from femgear.run import no_stiffness_curves
from femgear.stages.protocol import Drawn
from femgear.storage.contents import as_dataset
from femgear.storage.results import Manifest, Results
from femgear.trains.live import Live
from femgear.trains.reading import read_case
from femgear.trains.registry import train_of

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.figure import Figure

    from femgear.run import Solution
    from femgear.stages.judgements import Judgement
    from femgear.trains.live import Answer


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
    contents = {name: as_dataset(result.contents()) for name, result in computed.items()}
    findings = {"": train.case_warnings(case)}
    for name, data in contents.items():
        stage = train.stage(name)
        if stage is not None:
            findings[name] = stage.findings(data)
    everything = once(finding for of_stage in findings.values() for finding in of_stage)
    manifest = Manifest(complete=True, files={f"{name}.nc": "" for name in contents}, findings=everything)
    return Results(folder, manifest, read_case).with_known({"case": case} | contents)


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


def figures(source: Solution | Answer | Results) -> Mapping[str, Figure]:
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
    results, computed = _as_results(source)
    train, data = train_of(results.case), {name: results[name] for name in results.stages}
    drawn = Drawn(results.case, data, computed)
    of_stages = [train.figures[name].draw(drawn) for name in (*data, "") if name in train.figures]
    return Drawings({name: (lambda shown=shown, name=name: shown[name]) for shown in of_stages for name in shown})


def tables(source: Solution | Answer | Results) -> dict[str, pd.DataFrame]:
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


def summary(source: Solution | Answer | Results) -> Summary:
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
    return Summary(*train_of(results.case).summary(results))


def mesh_stiffness(case: Any, torques: Sequence[float] | None = None) -> xr.DataArray:
    """Compute the mesh stiffness k(theta) of all meshes of a set or a pair, at several torques.

    Parameters
    ----------
    case : Case, or what `femgear.read_case` takes
    torques : sequence of float, optional
        On the input [N m]; by default that of the case.

    Returns
    -------
    DataArray
        ``(torque, mesh, position)`` [N/m], over the position in mesh periods.

    Raises
    ------
    CaseError
        E-STAGE: a kind of case that has no mesh stiffness over the position; torques that cannot be.
    """
    import xarray as xr

    handle = Live(case)
    stage, name, _ = train_of(handle.case).stiffness_curves
    if stage not in handle.answer or not hasattr(handle.case.operation, "torque"):
        raise no_stiffness_curves(stage)
    given = [float(handle.case.operation.torque)] if torques is None else [float(torque) for torque in torques]
    curves = []
    for torque in given:
        data = handle.change({"operation.torque": f"{torque!r} N m"})[stage].dataset()
        if name not in data:
            raise no_stiffness_curves(stage)
        curves.append(data[name])
    joined: Any = xr.concat(curves, "torque", combine_attrs="override")
    words = {"units": "N m", "long_name": "torque of the input"}
    return joined.assign_coords(torque=("torque", np.array(given), words))
