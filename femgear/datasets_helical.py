"""Results of a helical case as xarray datasets: modes.nc, dynamics.nc."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from femgear.datasets import FOURIER, RPM, complex_entries, dataset, response_entries
from femgear.datasets_planar import MEMBERS, in_space

if TYPE_CHECKING:
    import xarray as xr

    from femgear.analysis_helical import HelicalDynamicsResult, HelicalModesResult

AXES = ("x", "y", "z", "tilt x", "tilt y", "rotation")


def helical_modes_dataset(result: HelicalModesResult) -> xr.Dataset:
    """Contents of modes.nc of a helical case: six motions of all bodies, no elastic ring."""
    from femgear.models.helical import free_motions

    modes, data = result.modes, result.data
    shape, dofs = in_space(data, free_motions(data) @ modes.shape, AXES)
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
        "mode": (("mode",), np.arange(len(modes.frequency)), "1", "mode"),
        "dof": (("dof",), dofs, "1", "degree of freedom"),
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
        coords["position"] = (("position",), position, "1", "position in mesh periods")
    return dataset(
        variables,
        coords=coords,
        attrs={"title": "modes of the helical set at standstill", "unknowns": len(modes.shape)}
        | _attributes(result),
    )


def helical_dynamics_dataset(result: HelicalDynamicsResult) -> xr.Dataset:
    """Contents of dynamics.nc of a helical case."""
    response, basis, lines = result.response, result.modes, ("speed", "mesh", "harmonic")
    data = basis.data
    whole = (len(response.mesh_frequency), 2 * data.n_planets, data.slices, -1)
    force, deflection = response.force.reshape(whole), response.deflection.reshape(whole)
    pin, support = result.loads["pin"], result.loads["support"]
    along = np.cos(data.base_helix_angle)
    on_planet, on_member = (
        ("speed", "planet", "direction", "harmonic"),
        ("speed", "member", "axis", "harmonic"),
    )
    entries = (
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
    )  # fmt: skip
    return dataset(
        response_entries(result) | complex_entries(entries),
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
        "speed": (("speed",), result.input_speed / RPM, "rpm", "speed of the input"),
        "harmonic": (("harmonic",), harmonics, "1", "harmonic of the mesh frequency"),
        "slice": (("slice",), data.slice_heights, "m", "height of the slice above mid-face"),
        "planet": (("planet",), planets, "1", "planet"),
        "direction": (("direction",), directions, "1", "direction at the planet"),
        "member": (("member",), list(MEMBERS), "1", "member"),
        "axis": (("axis",), axes, "1", "axis of the frame of the carrier"),
    }


def _coordinates(result: HelicalModesResult) -> dict[str, tuple]:
    return {"mesh": (("mesh",), list(result.planetary_set.mesh_names), "1", "gear mesh")}


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
