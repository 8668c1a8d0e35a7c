"""What deflection.nc has of a casing that moves: forces of its feet, its motion, its seats; tables and verdict."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from femgear.fe.beam import rigid_link
from femgear.report.tables import Block, tabulate
from femgear.stages.duty import force_words
from femgear.trains.gearbox.case_file import GearboxCase
from femgear.trains.gearbox.casing import CasingModel, bearing_name
from femgear.trains.gearbox.deflection import Deflection

if TYPE_CHECKING:
    import xarray as xr


def casing_variables(every: Sequence[Deflection]) -> dict[str, tuple]:
    """Collect the variables of the casing of all load cases; none where it stands still."""
    model = every[0].model
    casing = model.casing
    if casing is None:
        return {}
    station = slice(6 * casing.station, 6 * casing.station + 6)
    seats = [seat_motions(model.case, casing, state.motion) for state in every]
    return {
        "foot_force": (
            "load_case foot axis",
            [state.foot_force for state in every],
            "N",
            "force of the foot on the casing",
        ),
        "foot_place": ("foot axis", casing.foot_places, "m", "place of the foot"),
        "casing_motion": (
            "load_case motion",
            [state.motion[station] for state in every],
            "m",
            "motion of the casing as a whole, at its centre of mass: x, y, z (m), tilts and rotation (rad)",
        ),
        "seat_displacement": (
            "load_case bearing axis",
            seats,
            "m",
            "motion of the casing at the bearing; NaN of bearings that are not in it",
        ),
    }


def seat_motions(case: GearboxCase, casing: CasingModel, motion: np.ndarray) -> np.ndarray:
    """Compute the motions (b, 3) of the casing at all bearings in it [m]; NaN at others, 0 in what stands still.

    ``motion`` (6n,) are the motions of all stations [m], [rad].
    """
    motions = np.full((len(case.bearing), 3), np.nan)
    motion = motion.reshape(-1, 6)
    for number, bearing in enumerate(case.bearing):
        name = bearing_name(bearing, number)
        if bearing.outer_shaft is None:
            link = rigid_link(casing.seats[name] - casing.centre)
            station = casing.seat_stations.get(name)
            of_seat = link @ motion[casing.station] if station is None else motion[station]
            motions[number] = 0.0 if name in casing.standing else of_seat[:3]
    return motions


def casing_coordinates(state: Deflection) -> dict[str, tuple]:
    """Collect the names of the feet, by their dimension."""
    casing = state.model.casing
    return {} if casing is None else {"foot": (("foot",), list(casing.foot_names), "1", "foot of the casing")}


def describe_feet(data: xr.Dataset, at: int, name: str) -> Iterator[Block]:
    """Tabulate the forces of the feet in a load case, whose ``name`` the title has."""
    if "foot_force" not in data:
        return
    force, motion = data["foot_force"].values[at], data["casing_motion"].values[at]
    columns: dict[str, Any] = {"foot": lambda i: str(data["foot"].values[i])}
    for way, axis in enumerate("xyz"):
        columns[f"{axis} [N]"] = lambda i, way=way: f"{float(force[i, way]):+.5g}"
    shift, turn = (", ".join(f"{value:+.3g}" for value in part) for part in np.split(1e6 * motion, 2))
    note = f"on the casing, which moves by {shift} um and turns by {turn} urad along and about x, y, z"
    yield tabulate(f"Feet{name}", range(len(force)), columns, (note,))


def largest_foot_force(data: Any) -> Iterator[tuple[str, str]]:
    """Say for the verdict which foot carries most in all load cases."""
    if "foot_force" not in data:
        return
    cases, feet = data["load_case"].values, data["foot"].values
    size = np.linalg.norm(data["foot_force"].values, axis=2)
    case, foot = np.unravel_index(int(size.argmax()), size.shape)
    where = f"foot {feet[foot]}" + (f", {cases[case]}" if len(cases) > 1 else "")
    yield "largest foot force", f"{force_words(float(size[case, foot]))}, {where}"


def seat_curve(load_case: xr.Dataset, way: int) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Find places (n,) along z [mm], motions (n,) along x or y [um] of casing and shaft at bearings, of a load case.

    Bearings between shafts, as of planets, have no seat in the casing.
    """
    if "seat_displacement" not in load_case:
        return None
    casing, shaft = (1e6 * load_case[name].values[:, way] for name in ("seat_displacement", "bearing_displacement"))
    seated = np.isfinite(casing)
    return 1e3 * load_case["bearing_place"].values[seated, 2], casing[seated], shaft[seated]
