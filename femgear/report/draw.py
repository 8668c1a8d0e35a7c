"""All pictures and fields of a run: figures as PNG, grids as VTU, the turning carrier as GIF."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

    from femgear.case.sections import Case
    from femgear.gears.deviations import SetDeviations
    from femgear.gears.planetary import PlanetarySet
    from femgear.trains.elastic.results import DynamicsResult
    from femgear.trains.protocol import Progress
    from femgear.trains.static.results import StaticResult

# pictures need no converged stresses: a sector of some thousand nodes keeps the files small
PICTURE_FLANK_ELEMENTS = 6
PICTURE_REFINE = 0.35


def write_figures(
    folder: Path,
    gears: PlanetarySet,
    data: dict[str, xr.Dataset],
    *,
    deviations: SetDeviations | None = None,
) -> list[str]:
    """Figures of the stages in `data`, by stage name.

    Parameters
    ----------
    folder : path
    gears : PlanetarySet
    data : dict of str to Dataset
        Contents of the stages' files by stage, as far as computed; see `FIGURES`.
    deviations : SetDeviations, optional
        Profiles and pitches are charted where there are any.

    Returns
    -------
    list of str
        Names of the files.
    """
    from femgear.report import style

    figures = {}
    for stage, draw in FIGURES.items():
        if stage in data:
            figures |= draw(data, gears)
    if deviations is not None:
        figures |= _deviation_figures(deviations, gears)
    for name, figure in figures.items():
        style.save_figure(figure, folder / f"{name}.png")
    return [f"{name}.png" for name in figures]


def _static_figures(data: dict[str, xr.Dataset], gears: PlanetarySet) -> dict:
    from femgear.trains.static import figures as static_figures

    static = data["static"]
    return {
        "static_transmission_error": static_figures.static_transmission_error(static),
        "mesh_stiffness": static_figures.mesh_stiffness(static, face_width=gears.sun.face_width),
        "load_sharing": static_figures.load_sharing(static),
        "tooth_loads": static_figures.tooth_loads(static),
    }


def _modes_figures(data: dict[str, xr.Dataset], gears: PlanetarySet) -> dict:
    from femgear.trains.elastic import figures as elastic_figures

    modes = data["modes"]
    if modes.attrs.get("model") == "helical":
        from femgear.trains.helical.figures import helical_modes_figures

        return helical_modes_figures(modes, gears, data.get("static"))
    figures = {"mode_shapes": elastic_figures.mode_shapes(modes, gears)}
    # a rigid ring has no nodal diameters
    if "ring_shape_real" in modes:
        figures["natural_frequencies"] = elastic_figures.natural_frequencies(modes)
    return figures


def _dynamics_figures(data: dict[str, xr.Dataset], gears: PlanetarySet) -> dict:
    from femgear.trains.elastic import figures as elastic_figures

    dynamics, static = data["dynamics"], data.get("static")
    figures = {"dynamic_spectrum": elastic_figures.transmission_error_spectrum(dynamics)}
    if dynamics.attrs.get("model") == "helical":
        from femgear.trains.helical.figures import mesh_force_figure, transmission_errors

        # static.nc holds the spur gears of the transverse section
        figures["dynamic_transmission_error"] = transmission_errors(dynamics, data["modes"])
        figures["mesh_force_spectra"] = mesh_force_figure(dynamics, data["modes"])
    else:
        figures["dynamic_transmission_error"] = elastic_figures.transmission_error_period(
            dynamics, _on_supports(data.get("modes"), static)
        )
        figures["ring_static_deflection"] = elastic_figures.ring_mean_deflection(dynamics, gears)
    if dynamics.sizes["speed"] > 3:
        figures["speed_sweep"] = elastic_figures.speed_sweep(dynamics)
    return figures


def _on_supports(modes: xr.Dataset | None, static: xr.Dataset | None) -> xr.Dataset | None:
    """Static transmission errors that the dynamics start from, else those of static.nc."""
    if modes is None or "supported_ste" not in modes:
        return static
    return modes[["supported_ste"]].rename(supported_ste="ste", supported_position="position")


def _housing_figures(data: dict[str, xr.Dataset], gears: PlanetarySet) -> dict:
    from femgear.trains.elastic import figures as elastic_figures

    figures, housing, teeth = {}, data["housing"], gears.ring.teeth
    for s in shown_speeds(housing):
        name = f"{round(float(housing['speed'][s]))}_rpm"
        figures[f"housing_signal_{name}"] = elastic_figures.housing_signal(
            housing, speed_index=s, ring_teeth=teeth
        )
        figures[f"order_spectrum_{name}"] = elastic_figures.order_spectrum(
            housing, speed_index=s, ring_teeth=teeth
        )
        figures[f"modulation_{name}"] = elastic_figures.modulation_polar(
            housing, speed_index=s, ring_teeth=teeth
        )
    return figures


def _branch_figures(data: dict[str, xr.Dataset], gears: PlanetarySet) -> dict:
    from femgear.trains.planar import figures as planar_figures

    return planar_figures.branch_figures(data["branch"])


def _response_figures(data: dict[str, xr.Dataset], gears: PlanetarySet) -> dict:
    from femgear.trains.planar import figures as planar_figures

    response, figures = data["response"], {}
    for s in shown_speeds(response):
        name = f"{round(float(response['speed'][s]))}_rpm"
        figures |= {
            f"{key}_{name}": figure for key, figure in planar_figures.response_figures(response, s).items()
        }
    if response.sizes["speed"] > 1:
        figures["contact_over_speed"] = planar_figures.contact_over_speed(response)
    return figures


def _deviation_figures(deviations: SetDeviations, gears: PlanetarySet) -> dict:
    """Charts of profiles and pitches; none of a kind that the set does not have."""
    from femgear.trains.static import figures as static_figures

    figures = {}
    if static_figures.has_profiles(deviations, gears):
        figures["profile_deviations"] = static_figures.profile_chart(deviations, gears)
    if static_figures.has_pitches(deviations):
        figures["pitch_deviations"] = static_figures.pitch_chart(deviations, gears)
    return figures


def _stress_figures(data: dict[str, xr.Dataset], gears: PlanetarySet) -> dict:
    """Figures of stress.nc; distributions and turns are not in records of several mesh periods."""
    from femgear.trains.static import figures as static_figures

    stress = data["stress"]
    figures = {
        "root_stress": static_figures.root_stress_history(stress),
        "root_profile": static_figures.root_stress_profile(stress),
        "load_spectrum": static_figures.load_spectrum(stress),
    }
    if "pressure_distribution" in stress:
        figures["contact_pressure"] = static_figures.contact_pressure(stress)
    if "planet_root_stress" in stress:
        figures["planet_bending"] = static_figures.planet_bending(stress)
    return figures


FIGURES = {
    "static": _static_figures,
    "stress": _stress_figures,
    "modes": _modes_figures,
    "dynamics": _dynamics_figures,
    "housing": _housing_figures,
    "branch": _branch_figures,
    "response": _response_figures,
}


def shown_speeds(data: xr.Dataset) -> list[int]:
    """Indices of the speeds that get pictures of their own: all of a few, else first, middle and last."""
    n = data.sizes["speed"]
    return list(range(n)) if n <= 3 else [0, n // 2, n - 1]


def write_deformed_set(folder: Path, case: Case, static: StaticResult, *, cache: Path | None) -> list[str]:
    """The whole set deformed by the static loads of position zero, as VTU and picture."""
    from femgear.contact.bodies import deformed_set, make_sectors
    from femgear.contact.cycle import walk_mesh_cycle
    from femgear.contact.sides import mirrored_set
    from femgear.fe.elasticity import Material
    from femgear.fe.grid import copy_nodes, rotated_copies
    from femgear.report.scene import assemble_set, deformed_picture, placed, write_vtu

    gears, cycle, side = static.planetary_set, static.cycle, 1.0
    if static.sun_torque < 0:
        gears, side = mirrored_set(gears)[0], -1.0
        cycle = walk_mesh_cycle(
            gears, static.bodies, sun_torque=-static.sun_torque, positions=1, contact=case.static.contact
        )
    material = Material(case.material.youngs_modulus, case.material.poisson_ratio, case.material.density)
    sectors = make_sectors(
        gears, material, flank_elements=PICTURE_FLANK_ELEMENTS, refine=PICTURE_REFINE, cache=cache
    )
    bodies = []
    for body in deformed_set(gears, sectors, cycle):
        sector = getattr(sectors, body.kind)
        count = sector.gear.teeth
        numbers, whole = copy_nodes(sector.grid, count), rotated_copies(sector.grid, count)
        displacement = np.zeros((len(whole.points), 2))
        for k in range(count):
            angle = 2 * np.pi * k / count
            turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            displacement[numbers[k]] = body.displacement[k] @ turn.T
        bodies.append(
            placed(whole, name=body.name, centre=body.centre, angle=body.angle, displacement=displacement)
        )
    if side < 0:
        bodies = [_reflected(body) for body in bodies]
    grid = assemble_set(bodies)
    write_vtu(grid, folder / "deformed_set.vtu")
    title = "static deflection, position 0"
    deformed_picture(grid, folder / "deformed_set.png", title=title)
    return ["deformed_set.vtu", "deformed_set.png"]


def _reflected(body):
    """A body seen from behind: y reversed, and the triangles turned round with it."""
    flip = np.array([1.0, -1.0])
    return replace(
        body,
        points=body.points * flip,
        displacement=body.displacement * flip,
        triangles=body.triangles[:, [0, 2, 1, 5, 4, 3]],
    )


def write_ring_modes(folder: Path, case: Case, static: StaticResult, *, cache: Path | None) -> list[str]:
    """Modes of the toothed ring on its foundation for 0 to 6 nodal diameters, as VTU and picture."""
    from femgear.contact.bodies import active_flank_load, make_sectors
    from femgear.fe.elasticity import Material, foundation, mass
    from femgear.fe.reduction import cyclic_modes, sector_basis
    from femgear.report.scene import deformed_picture, ring_modes_grid, write_vtu

    gears = static.planetary_set
    material = Material(case.material.youngs_modulus, case.material.poisson_ratio, case.material.density)
    sector = make_sectors(
        gears, material, flank_elements=PICTURE_FLANK_ELEMENTS, refine=PICTURE_REFINE, cache=cache
    ).ring
    width = gears.ring.face_width
    support = foundation(
        sector.grid, "rim", case.ring.foundation_radial, case.ring.foundation_tangential, thickness=width
    )
    load = active_flank_load(sector.grid, gears, 1.0)
    basis = sector_basis(
        sector.grid,
        sector.stiffness + support,
        mass(sector.grid, material, width),
        count=gears.ring.teeth,
        loads=load,
    )
    modes = cyclic_modes(
        basis,
        count=gears.ring.teeth,
        nodal_diameters=range(7),
        loads=load,
        outputs=load,
        max_frequency=0.0,
        static_correction=False,
    )
    grid = ring_modes_grid(sector.grid, modes, range(len(modes.frequency)))
    write_vtu(grid, folder / "ring_modes.vtu")
    shown = int(np.flatnonzero(modes.nodal_diameter == 3)[0])
    field = next(name for name in grid.point_data if name.startswith(f"mode {shown},"))
    deformed_picture(
        grid,
        folder / "ring_mode.png",
        field=field,
        title=f"toothed ring, {field}",
        colour_label="relative displacement",
        colour_factor=1.0,
    )
    return ["ring_modes.vtu", "ring_mode.png"]


def write_animation(folder: Path, case: Case, static: StaticResult, dynamics: DynamicsResult) -> list[str]:
    """The ring's operating deflection while the carrier turns, at the last speed."""
    from femgear.report.scene import animate_operating_deflection

    last = dynamics.speeds[-1]
    rpm = case.operation.speeds[-1] * 30 / np.pi
    animate_operating_deflection(
        folder / "operating_deflection.gif",
        static.planetary_set,
        radial=dynamics.ring_radial[-1],
        tangential=dynamics.ring_tangential[-1],
        sensor_angle=case.housing.sensor_angle,
        clockwise=last.carrier < 0,
        title=f"{case.operation.input} at {rpm:.0f} rpm",
    )
    return ["operating_deflection.gif"]


def write_pictures(
    folder: Path,
    case: Case,
    results: Mapping[str, Any],
    *,
    data: dict[str, xr.Dataset],
    cache: Path | None,
    progress: Progress | None = None,
) -> list[str]:
    """Everything that a run shows; returns the names of the files.

    Parameters
    ----------
    folder : path
    case : Case
    results : mapping of str to result
        By stage, as far as computed.
    data : dict of str to Dataset
        Their datasets.
    cache : path, optional
        Folder of generated grids.
    progress : callable, optional
        Called with (stage, done, total).
    """
    from femgear.case.case import planetary_set, set_deviations
    from femgear.trains.drivetrain.section import DrivetrainCase

    if isinstance(case, DrivetrainCase):
        from femgear.trains.drivetrain.figures import write_drivetrain_pictures

        return write_drivetrain_pictures(folder, case, data, progress=progress)
    gears, static = planetary_set(case), results.get("static")
    steps = [lambda: write_figures(folder, gears, data, deviations=set_deviations(case))]
    # static of a helical case holds spur gears that nobody makes
    if static is not None and case.helical is None and static.cycle.force.any():
        steps.append(lambda: write_deformed_set(folder, case, static, cache=cache))
    elastic = case.planar is None and case.helical is None
    if elastic and "modes" in results:
        steps.append(lambda: write_ring_modes(folder, case, static, cache=cache))
    if elastic and "dynamics" in results:
        steps.append(lambda: write_animation(folder, case, static, results["dynamics"]))
    names = []
    for done, step in enumerate(steps):
        if progress is not None:
            progress("pictures", done, len(steps))
        names += step()
    if progress is not None:
        progress("pictures", len(steps), len(steps))
    return names
