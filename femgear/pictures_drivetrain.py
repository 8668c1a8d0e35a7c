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
        figures |= plots.spectrum_figures(data["spectrum"])
    for name, figure in figures.items():
        save_figure(figure, folder / f"{name}.png")
    if progress is not None:
        progress("pictures", 2, 2)
    return [*(f"{name}.png" for name in figures), *names]


def mode_pictures(folder: Path, model: DrivetrainModel, modes: xr.Dataset, count: int) -> list[str]:
    """The lowest elastic modes as PNG files; returns their names."""
    from femgear.models.drivetrain_layout import drivetrain_layout, layout_motion
    from femgear.scene.drivetrain import drivetrain_picture

    layout = drivetrain_layout(model.train)
    wheels = [(w.centre, w.radius, w.width, w.body) for w in layout.wheels]
    elastic = np.flatnonzero(modes["kind"].values.astype(str) != "rigid")[:count]
    names = []
    for number, mode in enumerate(elastic, 1):
        move, turn = layout_motion(model, layout, modes["shape"].values[:, mode])
        name = f"drivetrain_mode_{number}.png"
        hertz, kind = float(modes["frequency"][mode]), str(modes["kind"].values[mode])
        drivetrain_picture(
            folder / name, wheels=wheels, centres=layout.centre, shafts=layout.shafts, move=move, turn=turn,
            names=layout.names, title=f"mode {number}: {hertz:.2f} Hz, {kind}",
        )  # fmt: skip
        names.append(name)
    return names
