"""Results of a helical case as xarray datasets: modes.nc, dynamics.nc."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

    from femgear.analysis_helical import HelicalDynamicsResult, HelicalModesResult

RPM = np.pi / 30.0
MEMBERS = ("carrier", "ring", "sun")
AXES = ("x", "y", "z", "tilt x", "tilt y", "rotation")
FOURIER = "x(t) = Re sum_h X_h exp(i h omega t)"


def _variable(dims, values, units, long_name):
    return dims, np.asarray(values), {"units": units, "long_name": long_name}


def helical_modes_dataset(result: HelicalModesResult) -> xr.Dataset:
    """Contents of modes.nc of a helical case: six motions of all bodies, no elastic ring."""
    import xarray as xr

    modes, data = result.modes, result.data
    shape, dofs = _in_space(result)
    meshes = (2 * data.n_planets, data.slices)
    deflection = modes.mesh_deflection.reshape(*meshes, -1).mean(axis=1)
    variables = {
        "frequency": (("mode",), modes.frequency, "Hz", "undamped natural frequency"),
        "damping_ratio": (("mode",), modes.damping_ratio, "1", "fraction of critical damping"),
        "kind": (("mode",), list(modes.kind), "1", "kind of mode"),
        "phasing": (("mode",), list(result.phasing), "1", "phasing of the planets in the mode"),
        "nodal_diameter": (("mode",), modes.nodal_diameter, "1", "nodal diameter: -1, the ring is rigid"),
        "shape": (("dof", "mode"), shape, "kg^-1/2", "mass-normalised mode shape"),
        "mesh_stiffness": (
            ("mesh",), modes.mesh_stiffness.reshape(meshes).sum(axis=1), "N/m",
            "mean mesh stiffness along the tooth normals",
        ),
        "mesh_deflection": (
            ("mesh", "mode"), deflection, "kg^-1/2", "mesh deflection of the mode along the tooth normals",
        ),
    }  # fmt: skip
    coords = _coordinates(result) | {
        "mode": _variable(("mode",), np.arange(len(modes.frequency)), "1", "mode"),
        "dof": _variable(("dof",), dofs, "1", "degree of freedom"),
    }
    if result.whole is not None:
        along, whole = np.cos(data.base_helix_angle), result.whole
        where = ("mesh", "position")
        variables["helical_stiffness"] = (
            where, whole.stiffness * along**2, "N/m", "mesh stiffness along the transverse line of action",
        )  # fmt: skip
        variables["helical_ste"] = (
            where, whole.deflection / along, "m",
            "static transmission error along the transverse line of action, centres fixed",
        )  # fmt: skip
        position = np.arange(whole.stiffness.shape[1]) / whole.stiffness.shape[1]
        coords["position"] = _variable(("position",), position, "1", "position in mesh periods")
    return xr.Dataset(
        {name: _variable(*entry) for name, entry in variables.items()},
        coords=coords,
        attrs={"title": "modes of the helical set at standstill", "unknowns": len(modes.shape)}
        | _attributes(result),
    )


def helical_dynamics_dataset(result: HelicalDynamicsResult) -> xr.Dataset:
    """Contents of dynamics.nc of a helical case."""
    import xarray as xr

    response, stability, basis = result.response, result.stability, result.modes
    speed, lines = ("speed",), ("speed", "mesh", "harmonic")
    data = basis.data
    whole = (len(response.mesh_frequency), 2 * data.n_planets, data.slices, -1)
    force, deflection = response.force.reshape(whole), response.deflection.reshape(whole)
    variables = {
        "mesh_frequency": (speed, response.mesh_frequency, "Hz", "mesh frequency"),
        "carrier_speed": (speed, [s.carrier for s in result.speeds], "rad/s", "speed of the carrier"),
        "converged": (speed, response.converged, "1", "whether the solution satisfies its tolerance"),
        "iterations": (speed, response.iterations, "1", "iterations of the fixed point"),
        "residual": (speed, response.residual, "1", "relative residual of the harmonic equations"),
        "spectral_radius": (speed, response.spectral_radius, "1", "spectral radius of the fixed point"),
        "tail": (speed, response.tail, "1", "share of the amplitude in the upper half of the harmonics"),
        "method": (speed, list(response.method), "1", "method of solution"),
        "floquet_multiplier": (speed, np.abs(stability.multiplier), "1", "largest Floquet multiplier"),
        "stable": (speed, stability.stable, "1", "whether no perturbation grows"),
    }
    pin, support = result.loads["pin"], result.loads["support"]
    along = np.cos(data.base_helix_angle)
    on_planet, on_member = (
        ("speed", "planet", "direction", "harmonic"),
        ("speed", "member", "axis", "harmonic"),
    )
    for name, dims, values, units, words in (
        (
            "dte", lines, deflection.mean(axis=2) / along, "m",
            "dynamic transmission error along the transverse line of action at mid-face",
        ),
        ("mesh_force", lines, force.sum(axis=2), "N", "dynamic mesh force along the tooth normals"),
        (
            "mesh_deflection", lines, deflection.mean(axis=2), "m",
            "deflection of the mesh spring along the tooth normals at mid-face",
        ),
        (
            "slice_force", ("speed", "mesh", "slice", "harmonic"), force, "N",
            "dynamic force of a slice along the tooth normals",
        ),
        ("pin_force", on_planet, pin[:, :, :3], "N", "force of the pin on the planet"),
        ("pin_moment", on_planet, pin[:, :, 3:], "N m", "moment of the pin on the planet"),
        ("support_force", on_member, support[:, :, :3], "N", "force of the support on the member"),
        ("support_moment", on_member, support[:, :, 3:], "N m", "moment of the support on the member"),
    ):  # fmt: skip
        variables[f"{name}_real"] = (dims, values.real, units, f"{words}, real part")
        variables[f"{name}_imag"] = (dims, values.imag, units, f"{words}, imaginary part")
    return xr.Dataset(
        {name: _variable(*entry) for name, entry in variables.items()},
        coords=_coordinates(basis) | _lines(result),
        attrs={
            "title": "periodic response of the helical set by the spectral method",
            "message": response.message,
            "ring_teeth": basis.planetary_set.ring.teeth,
            "fourier_convention": FOURIER,
        }
        | _attributes(basis),
    )


def _lines(result: HelicalDynamicsResult) -> dict[str, tuple]:
    data, harmonics = result.modes.data, np.arange(result.response.force.shape[-1])
    planets = np.arange(1, data.n_planets + 1)
    axes, directions = ["x", "y", "z"], ["radial", "tangential", "axial"]
    return {
        "speed": _variable(("speed",), result.input_speed / RPM, "rpm", "speed of the input"),
        "harmonic": _variable(("harmonic",), harmonics, "1", "harmonic of the mesh frequency"),
        "slice": _variable(("slice",), data.slice_heights, "m", "height of the slice above mid-face"),
        "planet": _variable(("planet",), planets, "1", "planet"),
        "direction": _variable(("direction",), directions, "1", "direction at the planet"),
        "member": _variable(("member",), list(MEMBERS), "1", "member"),
        "axis": _variable(("axis",), axes, "1", "axis of the frame of the carrier"),
    }


def _coordinates(result: HelicalModesResult) -> dict[str, tuple]:
    return {"mesh": _variable(("mesh",), list(result.planetary_set.mesh_names), "1", "gear mesh")}


def _attributes(result: HelicalModesResult) -> dict:
    data, section = result.data, result.section
    given = {
        "model": "helical",
        "planet_angles": np.asarray(data.planet_angles),
        "base_helix_angle": data.base_helix_angle,
        "face_width": data.face_width,
    }
    if section is not None:
        given |= {"virtual_teeth": np.array(section.teeth), "section_factor": section.factor}
    return given


def _in_space(result: HelicalModesResult) -> tuple[np.ndarray, list[str]]:
    """Shapes as motions of every body along and about x, y and z, held ones included."""
    from femgear.models.helical import free_motions
    from femgear.models.planar_data import member_radius

    data, N = result.data, result.data.n_planets
    full = (free_motions(data) @ result.modes.shape).reshape(N + 3, 6, -1).copy()
    cosine, sine = np.cos(data.planet_angles)[:, None], np.sin(data.planet_angles)[:, None]
    for first in (0, 3):
        one, two = full[3:, first].copy(), full[3:, first + 1].copy()
        full[3:, first], full[3:, first + 1] = one * cosine - two * sine, one * sine + two * cosine
    radii = np.array([member_radius(data, name) for name in MEMBERS] + [data.planet_radius] * N)
    full[:, 3:] /= radii[:, None, None]
    bodies = [*MEMBERS, *(f"planet {n + 1}" for n in range(N))]
    return full.reshape(6 * (N + 3), -1), [f"{body}: {axis}" for body in bodies for axis in AXES]
