"""What the app computes as a whole: runs with their reports, comparisons and imports; in a process."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from femgear.app.worker import Requests
from femgear.exchange.rexs import read_model
from femgear.exchange.sampling import Sampling
from femgear.findings import as_data
from femgear.report.compare import compare_page
from femgear.run import export_results, run_case
from femgear.stages.summary_data import run_data
from femgear.storage.files import list_own, own_files, write_text
from femgear.storage.results import EXPORTED, additions, folder_lock, run_folder
from femgear.trains.imports import case_drafts
from femgear.trains.reading import open_results, parse_case
from femgear.trains.registry import check_case, same_train, train_of

COMPARED = "compare.html"
_LONGEST = 90
"""Letters of the name of a folder."""
_TOLD_EVERY = 0.2
"""Between two words on the progress [s]."""


class Runs:
    """Runs of the cases of a folder.

    Parameters
    ----------
    folder : path
    tell : callable, optional
        Called with ``{"stage", "done", "total"}`` while a run is computed.
    """

    def __init__(self, folder: Path, tell: Callable[[dict[str, Any]], None] = lambda progress: None) -> None:
        self.folder, self._tell, self._last = folder, tell, 0.0

    def run(self, text: str, name: str, output: str, force: bool) -> dict[str, Any]:
        """Compute a case into a folder of results; goes on where an interrupted run of the same case ended.

        Parameters
        ----------
        text, name : str
            Of the case file.
        output : str
            Name of the folder.
        force : bool
            Replace the results that it holds.

        Returns
        -------
        dict
            As of `femgear.stages.summary_data.run_data`.

        Raises
        ------
        FemgearError
            What the command ``femgear run`` refuses.
        """
        case = parse_case(text, name=str(self.folder / name))
        check_case(case)
        with run_folder(self.folder / output, case=case.source, force=force) as place:
            run_case(case, place, progress=self._progress)
        results = open_results(self.folder / output)
        return run_data(train_of(results.case), results)

    def compare(self, *names: str) -> str:
        """Write a page that compares folders of results; returns its name.

        Raises
        ------
        CaseError
            E-CHOICE: cases of several kinds.
        """
        runs = [open_results(self.folder / name) for name in names]
        train = same_train(runs)
        place = self.folder / "_and_".join(names)[:_LONGEST]
        own_files(place, [COMPARED])
        write_text(compare_page(train, *runs), place / COMPARED)
        return f"{place.name}/{COMPARED}"

    def export(self, name: str, formats: Sequence[str]) -> list[str]:
        """Write a run as files that other programs read, into its folder; returns their names.

        Raises
        ------
        FemgearError
            What the command ``femgear export`` refuses.
        """
        folder = self.folder / name
        with folder_lock(folder), additions(folder) as new:
            list_own(new / EXPORTED)
            results = open_results(folder)
            return export_results(results, new / EXPORTED, formats, Sampling(), progress=self._progress)

    def imported(self, path: str, stem: str) -> list[dict[str, Any]]:
        """Read the gearbox, or the stages, of a REXS file: name, text and findings of every case.

        Raises
        ------
        FemgearError
            What the command ``femgear import`` refuses.
        """
        model = read_model(Path(path))
        drafts = case_drafts(model, f"{stem}.toml")
        findings = as_data(model.findings)
        return [
            {"name": f"{stem}{draft.suffix}.toml", "text": draft.text, "findings": findings, "words": draft.words}
            for draft in drafts
        ]

    def _progress(self, stage: str, done: float, total: float) -> None:
        """Tell how far a run has come, now and then."""
        now = time.monotonic()
        if now - self._last > _TOLD_EVERY or done >= total:
            self._last = now
            self._tell({"stage": stage, "done": float(done), "total": float(total)})


def serve_runs(pipe: Connection, folder: Path) -> None:
    """Answer for a folder by the functions of `Runs`; the progress of a run comes before its end."""
    requests = Requests(pipe)
    runs = Runs(folder, tell=requests.tell)
    names = "run", "compare", "export", "imported"
    requests.answer({name: getattr(runs, name) for name in names})
