"""Results of a planar case as xarray datasets: modes.nc, branch.nc, response.nc."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femgear.datasets import RPM, complex_entries, dataset

if TYPE_CHECKING:
    import xarray as xr

    from femgear.analysis_planar import BranchResult, PlanarModesResult, PlanarResponseResult
    from femgear.models.planar_data import RigidSet
    from femgear.solvers.branches import Branch
    from femgear.solvers.verdict import FloquetVerdict

MEMBERS = ("carrier", "ring", "sun")
FOURIER = "x(t) = Re sum_l (x_real + i x_imag)_l exp(i (order_l . theta(t)))"


# instants of a turn of the weight at which forces are stored
PHASES = 721


def planar_modes_dataset(result: PlanarModesResult) -> xr.Dataset:
    """Contents of modes.nc of a planar case: axes and rotations of all bodies, no elastic ring."""
    from femgear.models.planar import free_motions

    modes, gears = result.modes, result.planetary_set
    shape, dofs = in_space(result.data, free_motions(result.data) @ modes.shape, ("x", "y", "rotation"))
    n = 2 * gears.n_planets
    variables = {
        "frequency": (("mode",), modes.frequency, "Hz", "undamped natural frequency"),
        "damping_ratio": (("mode",), modes.damping_ratio, "1", "fraction of critical damping"),
        "kind": (("mode",), list(modes.kind), "1", "kind of mode"),
        "nodal_diameter": (("mode",), modes.nodal_diameter, "1", "nodal diameter: -1, the ring is rigid"),
        "shape": (("dof", "mode"), shape, "kg^-1/2", "mass-normalised mode shape"),
        "mesh_stiffness": (("mesh",), modes.mesh_stiffness[:n], "N/m", "mean mesh stiffness"),
        "mesh_deflection": (
            ("mesh", "mode"), modes.mesh_deflection[:n], "kg^-1/2", "mesh deflection of the mode",
        ),
    }  # fmt: skip
    return dataset(
        variables,
        coords={
            "mode": (("mode",), np.arange(len(modes.frequency)), "1", "mode"),
            "dof": (("dof",), dofs, "1", "degree of freedom"),
            "mesh": (("mesh",), list(gears.mesh_names), "1", "gear mesh"),
        },
        attrs={
            "title": "modes of the planar set at standstill, bearings closed, back flanks open",
            "unknowns": len(modes.shape),
            "planet_angles": np.asarray(gears.planet_angles),
        },
    )


def in_space(data: RigidSet, motions: np.ndarray, axes: tuple[str, ...]) -> tuple[np.ndarray, list[str]]:
    """Motions of every body along and about x, y (and z) with their names, held ones included.

    Parameters
    ----------
    data : RigidSet
    motions : (n, m) array
        In all coordinates: two in the plane and ``u``; or three translations, two tilts and ``u``.
    axes : tuple of str
        Names of the motions of a body.
    """
    from femgear.models.planar_data import member_radius

    N = data.n_planets
    full = motions.reshape(N + 3, len(axes), -1).copy()
    cosine, sine = np.cos(data.planet_angles)[:, None], np.sin(data.planet_angles)[:, None]
    for first in range(0, len(axes), 3):
        radial, tangential = full[3:, first].copy(), full[3:, first + 1].copy()
        full[3:, first] = radial * cosine - tangential * sine
        full[3:, first + 1] = radial * sine + tangential * cosine
    radii = np.array([member_radius(data, name) for name in MEMBERS] + [data.planet_radius] * N)
    full[:, -(len(axes) // 2) :] /= radii[:, None, None]
    bodies = [*MEMBERS, *(f"planet {n + 1}" for n in range(N))]
    return full.reshape(len(motions), -1), [f"{body}: {axis}" for body in bodies for axis in axes]


def branch_dataset(result: BranchResult) -> xr.Dataset:
    """Contents of branch.nc."""
    branch, point = result.branch, ("point",)
    hertz = branch.parameter / (2.0 * np.pi)
    known = len(branch.verdicts) > 0
    folds, crossings = np.zeros((2, len(hertz)), bool)
    folds[branch.folds], crossings[branch.branch_points] = True, True
    carrier = result.sense * branch.parameter
    stable = np.array([_state(one) for one in branch.verdicts] if known else [-1] * len(hertz))
    variables = {
        "weight_frequency": (point, hertz, "Hz", "frequency of the weight in the carrier frame"),
        "carrier_speed": (point, carrier, "rad/s", "speed of the carrier, counter-clockwise positive"),
        "fold": (point, folds, "1", "whether the point is a limit point"),
        "branch_point": (point, crossings, "1", "whether another branch crosses"),
        "tail": (point, branch.tail, "1", "share of the amplitude in the upper half of the harmonics"),
        "spectral_radius": (point, branch.spectral_radius, "1", "spectral radius of the fixed point"),
        "residual": (point, branch.residual, "1", "relative residual of the harmonic equations"),
        "converged": (point, branch.converged, "1", "whether the solution satisfies its tolerance"),
    }  # fmt: skip
    variables |= _stability(branch, stable) | _flank_forces(result, stable)
    variables |= _motions(result.lines, "point", "harmonic")
    coords = _coordinates(result.planetary_set) | {
        "point": (point, np.arange(len(hertz)), "1", "point along the branch"),
        "harmonic": (("harmonic",), branch.orders[:, 0], "1", "harmonic of the weight's frequency"),
        "phase": (("phase",), np.linspace(0.0, 2.0 * np.pi, PHASES), "rad", "phase of the weight"),
    }
    data = dataset(
        variables,
        coords=coords,
        attrs={
            "title": "periodic responses to the weight",
            "message": result.ending,
            "complete": int(branch.complete),
            "stability": "Floquet multipliers" if known else "not computed",
            "fourier_convention": FOURIER,
        },
    )
    data["stable"].attrs |= {"flag_values": [1, 0, -1], "flag_meanings": "stable not_stable not_known"}
    return data


def _stability(branch: Branch, stable: np.ndarray) -> dict[str, tuple]:
    """Verdicts of all points; open ones where stability was not asked for."""
    point, known, count = ("point",), len(branch.verdicts) > 0, len(stable)
    nothing, unsaid = np.full(count, np.nan), [""] * count
    return {
        "stable": (point, stable, "1", "stability: 1 stable, 0 not stable, -1 not known"),
        "stability_note": (
            point, [_reason(one) for one in branch.verdicts] if known else unsaid, "1",
            "why stability is not known",
        ),
        "largest_multiplier": (
            point, branch.largest_multiplier if known else nothing, "1", "largest Floquet multiplier",
        ),
        "multiplier_distance": (
            point, [_nearest(verdict) for verdict in branch.verdicts] if known else nothing, "1",
            "distance of the nearest Floquet multiplier from 1, which is zero at a limit point of the motion",
        ),
        "loss": (point, list(branch.loss) if known else unsaid, "1", "how stability is lost"),
    }  # fmt: skip


def _state(verdict: FloquetVerdict) -> int:
    return -1 if verdict.stable is None else int(verdict.stable)


def _reason(verdict: FloquetVerdict) -> str:
    return verdict.message if verdict.stable is None else ""


def _flank_forces(result: BranchResult, stable: np.ndarray) -> dict[str, tuple]:
    """Forces in time at the points that are drawn, from the laws of the contacts."""
    from femgear.models.planar_response import flank_forces, fluctuation, shown_points

    rms = np.array([fluctuation(one.member[0, 0]) for one in result.lines])
    back = np.array([one.back_contact.max() for one in result.lines])
    points = shown_points(rms, back, stable)
    theta = np.linspace(0.0, 2.0 * np.pi, PHASES)[:, None]
    forces = [flank_forces(result.model, result.branch.solutions[point], theta) for point, _ in points]
    drive, behind = (np.array([one[side].T for one in forces]) for side in (0, 1))
    shown, dims = ("shown",), ("shown", "mesh", "phase")
    return {
        "shown_point": (shown, [point for point, _ in points], "1", "point whose forces are given in time"),
        "shown_as": (shown, [words for _, words in points], "1", "what the point is"),
        "drive_force": (dims, drive, "N", "force of the drive flanks in time, from the law of the contact"),
        "flank_force": (dims, behind, "N", "force of back flanks on their own line in time, from its law"),
    }


def _nearest(verdict: FloquetVerdict) -> float:
    return (
        float(np.abs(verdict.multipliers - 1.0).min(initial=np.inf)) if len(verdict.multipliers) else np.nan
    )


def response_dataset(result: PlanarResponseResult) -> xr.Dataset:
    """Contents of response.nc."""
    found, speed = result.solutions, ("speed",)
    mesh = [one.mesh_frequency for one in result.speeds]
    variables = {
        "carrier_speed": (
            speed, [one.carrier for one in result.speeds], "rad/s",
            "speed of the carrier, counter-clockwise positive",
        ),
        "mesh_frequency": (speed, mesh, "Hz", "mesh frequency"),
        "frequency": (
            ("speed", "line"), [one.line_frequency / (2 * np.pi) for one in found], "Hz",
            "frequency of the line in the carrier frame",
        ),
        "converged": (
            speed, [one.converged for one in found], "1", "whether the solution satisfies its tolerance",
        ),
        "iterations": (speed, [one.iterations for one in found], "1", "iterations of Newton's method"),
        "residual": (
            speed, [one.residual for one in found], "1", "relative residual of the harmonic equations",
        ),
        "tail": (
            speed, [one.tail for one in found], "1", "share of the amplitude in the upper half of the lines",
        ),
        "spectral_radius": (
            speed, [one.spectral_radius for one in found], "1", "spectral radius of the fixed point",
        ),
    }  # fmt: skip
    variables |= _motions(result.lines, "speed", "line")
    orders, line = found[0].orders, ("line",)
    coords = _coordinates(result.planetary_set) | {
        "speed": (speed, result.input_speed / RPM, "rpm", "speed of the input"),
        "carrier_order": (line, orders[:, 0], "1", "multiple of the carrier's frequency"),
        "mesh_order": (line, orders[:, 1], "1", "multiple of the mesh frequency"),
    }
    return dataset(
        variables,
        coords=coords,
        attrs={
            "title": "responses to weight and mesh frequency together",
            "message": " ".join(dict.fromkeys(one.message for one in found)),
            "mesh_lines": int(np.any(orders[:, 1] != 0)),
            "fourier_convention": FOURIER,
        },
    )


def _motions(lines, along: str, line: str) -> dict[str, tuple]:
    """Displacements, forces and contact of all solutions."""
    from femgear.models.planar_response import fluctuation, stacked

    found, out = stacked(lines), {}
    member, mesh = (along, "member", "axis"), (along, "mesh")
    out["force_tail"] = (
        (along,), found["force_tail"], "1",
        "share of the fluctuating force in the upper half of the lines, of the kind of mesh with more of it",
    )  # fmt: skip
    out["motion"] = ((along,), found["motion"], "m", "farthest that a member's centre moves from its place")
    out["rms"] = (member, fluctuation(found["member"]), "m", "displacement about its mean, r.m.s.")
    out |= complex_entries((
        ("displacement", (*member, line), found["member"], "m", "displacement in the carrier frame"),
        (
            "mesh_force", (*mesh, line), found["mesh_force"], "N",
            "mesh force along the line of the drive flanks",
        ),
        ("back_force", (*mesh, line), found["back_force"], "N", "force of the back flanks on their own line"),
        (
            "planet_bearing_force", (along, "planet", "direction", line), found["planet_bearing"], "N",
            "force of the pin on the planet",
        ),
        (
            "carrier_bearing_force", (along, "axis", line), found["carrier_bearing"], "N",
            "force of the carrier bearing on the carrier",
        ),
    ))  # fmt: skip
    for side in ("drive", "back"):
        words = f"share of the time in which the {side} flanks touch: 1 in contact, 0 not"
        out[f"{side}_contact"] = (mesh, found[f"{side}_contact"], "1", words)
    return out


def _coordinates(gears) -> dict[str, tuple]:
    numbers = np.arange(1, gears.n_planets + 1)
    return {
        "mesh": (("mesh",), list(gears.mesh_names), "1", "gear mesh"),
        "planet": (("planet",), numbers, "1", "planet"),
        "member": (("member",), list(MEMBERS), "1", "member"),
        "axis": (("axis",), ["x", "y"], "1", "axis of the frame of the carrier"),
        "direction": (("direction",), ["radial", "tangential"], "1", "direction at the planet"),
    }
