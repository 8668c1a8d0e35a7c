"""Pictures of a drivetrain run: figures of all stages, and the lowest elastic modes in space."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

    from femgear.analysis import Progress
    from femgear.casefile.drivetrain import DrivetrainCase
    from femgear.models.drivetrain import DrivetrainModel


def write_drivetrain_pictures(
    folder: Path, case: DrivetrainCase, data: dict[str, xr.Dataset], *, progress: Progress | None = None
) -> list[str]:
    """Figures of the stages in `data`, by stage name; returns the names of the files.

    Parameters
    ----------
    folder : path
    case : DrivetrainCase
    data : dict of str to Dataset
        Contents of the stages' files.
    progress : callable, optional
        Called with ("pictures", done, total).
    """
    from femgear.models.drivetrain_case import case_model
    from femgear.plots import drivetrain_results as plots
    from femgear.plots import save_figure

    model, figures, names = case_model(case), {}, []
    if "modes" in data and len(model.meshes):
        figures["stiffness_series"] = plots.stiffness_figure(model)
    if "modes" in data:
        figures["campbell"] = plots.campbell_figure(data["modes"])
        names += mode_pictures(folder, model, data["modes"], case.simulation.modes)
    if progress is not None:
        progress("pictures", 1, 2)
    if "transient" in data:
        figures |= plots.transient_figures(data["transient"])
    if "spectrum" in data:
        figures |= plots.spectrum_figures(data["spectrum"], data.get("transient"))
    for name, figure in figures.items():
        save_figure(figure, folder / f"{name}.png")
    if progress is not None:
        progress("pictures", 2, 2)
    return [*(f"{name}.png" for name in figures), *names]


def mode_pictures(folder: Path, model: DrivetrainModel, modes: xr.Dataset, count: int) -> list[str]:
    """The lowest elastic modes as PNG files; returns their names.

    Modes have the numbers of the table: the free spin, which is not drawn, is the first.
    """
    from femgear.models.drivetrain_layout import drivetrain_layout, layout_motion, shaft_lines
    from femgear.scene.drivetrain import ModeView, drivetrain_pictures

    layout = drivetrain_layout(model.train)
    wheels = [(w.centre, w.radius, w.width, w.body) for w in layout.wheels]
    kinds, hertz = modes["kind"].values.astype(str), modes["frequency"].values
    names, views = [], []
    for mode in np.flatnonzero(kinds != "rigid")[:count].tolist():
        shape = modes["shape"].values[:, mode]
        title = f"mode {mode + 1}: {hertz[mode]:.2f} Hz, {kinds[mode]}"
        names.append(f"drivetrain_mode_{mode + 1}.png")
        moved = layout_motion(model, layout, shape)
        views.append(ModeView(folder / names[-1], title, *moved, shaft_lines(model, layout, shape)))
    if views:
        drivetrain_pictures(views, wheels=wheels, centres=layout.centre, names=layout.names)
    return names
