"""All pictures and fields of a run: figures as PNG, grids as VTU, the turning carrier as GIF."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from femgear.report.style import save_figure

if TYPE_CHECKING:
    from femgear.trains.protocol import Drawn, Figures, Progress, Train


def write_figures(folder: Path, train: Train, drawn: Drawn) -> list[str]:
    """Write the figures of the stages whose data are there, and of the case; returns the file names."""
    figures = {}
    for stage in _drawn(train, drawn):
        figures |= stage.draw(drawn)
    for name, figure in figures.items():
        save_figure(figure, folder / f"{name}.png")
    return [f"{name}.png" for name in figures]


def _drawn(train: Train, drawn: Drawn) -> list[Figures]:
    """List the figures of the stages whose data are there, in their order, and of the case."""
    names = [*(stage.name for stage in train.stages if stage.name in drawn.data), ""]
    return [train.figures[name] for name in names if name in train.figures]


def write_pictures(
    folder: Path, train: Train, drawn: Drawn, *, progress: Progress | None = None
) -> list[str]:
    """Write everything that a run shows; returns the names of the files.

    Parameters
    ----------
    folder : path
    train : Train
        Of the case.
    drawn : Drawn
    progress : callable, optional
        Called with (stage, done, total).
    """
    written = [w for stage in _drawn(train, drawn) for w in stage.write]
    steps = [
        lambda: write_figures(folder, train, drawn), *(lambda w=w: w(drawn, folder) for w in written),
    ]  # fmt: skip
    names = []
    for done, step in enumerate(steps):
        if progress is not None:
            progress("pictures", done, len(steps))
        names += step()
    if progress is not None:
        progress("pictures", len(steps), len(steps))
    return names
