"""Results as xarray datasets: what goes to disk, every variable with its units."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

    from femgear.analysis import DynamicsResult, HousingResult, ModesResult, StaticResult

RPM = np.pi / 30.0
FOURIER = "x(t) = Re sum_h X_h exp(i h omega t)"


def dataset(variables: dict, coords: dict, attrs: dict) -> xr.Dataset:
    """Dataset of entries ``(dims, values, units, long_name)``."""
    import xarray as xr

    def made(entries):
        return {
            name: (dims, np.asarray(values), {"units": units, "long_name": words})
            for name, (dims, values, units, words) in entries.items()
        }

    return xr.Dataset(made(variables), coords=made(coords), attrs=attrs)


def complex_entries(entries) -> dict[str, tuple]:
    """Real and imaginary parts of entries ``(name, dims, values, units, long_name)``."""
    found = {}
    for name, dims, values, units, words in entries:
        found[f"{name}_real"] = (dims, values.real, units, f"{words}, real part")
        found[f"{name}_imag"] = (dims, values.imag, units, f"{words}, imaginary part")
    return found


def response_entries(result: Any) -> dict[str, tuple]:
    """What is known of the periodic response at every speed: frequency, convergence, stability.

    Of any result with a response, its stability and the speeds of the members.
    """
    response, stability, speed = result.response, result.stability, ("speed",)
    return {
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


def static_dataset(result: StaticResult) -> xr.Dataset:
    """Contents of static.nc."""
    cycle, gears = result.cycle, result.planetary_set
    mesh_position = ("mesh", "position")
    teeth = cycle.tooth_load.shape[1]
    variables = {
        "ste": (mesh_position, cycle.deflection, "m", "static transmission error of the mesh"),
        "ste_overall": (
            ("planet", "position"),
            cycle.overall_deflection,
            "m",
            "static transmission error from sun to ring",
        ),
        "mesh_force": (mesh_position, cycle.force, "N", "mesh force along the line of action"),
        "back_force": (mesh_position, cycle.back_force, "N", "force on the back flanks of the mesh"),
        "member_motion": (
            ("member", "position"),
            cycle.member_motion,
            "m",
            "displacement of the axis of a member that moves",
        ),
        "bearing_force": (
            ("planet", "axis", "position"),
            cycle.bearing_force,
            "N",
            "force of the pin on the planet in the frame of the carrier",
        ),
        "mesh_stiffness": (mesh_position, cycle.stiffness, "N/m", "tangent mesh stiffness"),
        "mesh_stiffness_secant": (mesh_position, cycle.secant_stiffness, "N/m", "secant mesh stiffness"),
        "tooth_load": (("mesh", "tooth", "position"), cycle.tooth_load, "N", "load of a tooth pair"),
        "back_tooth_load": (
            ("mesh", "tooth", "position"),
            cycle.back_tooth_load,
            "N",
            "load of a tooth pair on its back flanks",
        ),
        "load_share": (("planet", "position"), cycle.load_share, "1", "share of the planet in the torque"),
        "max_pressure": (
            mesh_position,
            cycle.max_pressure,
            "Pa",
            "largest contact pressure away from flank ends",
        ),
        "edge_contact": (
            mesh_position,
            cycle.edge_contact,
            "1",
            "whether a contact reaches the end of a flank",
        ),
        "residual": (("position",), cycle.residual, "1", "residual of contact conditions and equilibrium"),
        "iterations": (("position",), cycle.iterations, "1", "steps of the active set"),
    }
    return dataset(
        variables,
        coords={
            "mesh": (("mesh",), list(gears.mesh_names), "1", "gear mesh"),
            "position": (("position",), cycle.position, "1", "position in mesh periods"),
            "planet": (("planet",), np.arange(1, gears.n_planets + 1), "1", "planet"),
            "axis": (("axis",), ["x", "y"], "1", "axis of the frame of the carrier"),
            "member": (("member",), list(cycle.member_names), "1", "moving member and direction"),
            "tooth": (("tooth",), np.arange(teeth), "1", "tooth pair in the order of the path"),
        },
        attrs={
            "title": "static transmission error, load sharing and mesh stiffness",
            "contact_ratio_sun_planet": gears.contact_ratio_sun_planet,
            "contact_ratio_planet_ring": gears.contact_ratio_planet_ring,
            "working_pressure_angle_sun_planet": gears.working_pressure_angle_sun_planet,
            "working_pressure_angle_planet_ring": gears.working_pressure_angle_planet_ring,
            "mesh_phases": np.asarray(gears.mesh_phases),
            "planet_angles": np.asarray(gears.planet_angles),
            "centre_distance": gears.centre_distance,
            "face_width": gears.sun.face_width,
            "teeth": np.array([gears.sun.teeth, gears.planet.teeth, gears.ring.teeth]),
            "sun_torque": result.sun_torque,
            "contact": cycle.contact,
            "mesh_periods": cycle.periods,
            "period": result.period_message,
            "pressure_cells": cycle.unknowns,
            "unknowns": np.array(
                [b.unknowns for b in (result.bodies.sun, result.bodies.planet, result.bodies.ring)]
            ),
            "message": cycle.message,
            "warnings": " ".join(result.warnings),
        },
    )


def modes_dataset(result: ModesResult) -> xr.Dataset:
    """Contents of modes.nc."""
    from femgear.models.elastic import ring_field
    from femgear.models.ring import RADIAL, TANGENTIAL

    modes, model, n_max = result.modes, result.model, result.max_diameter
    coordinates = modes.shape[model.ring_slice].T
    variables = {
        "frequency": (("mode",), modes.frequency, "Hz", "undamped natural frequency"),
        "damping_ratio": (("mode",), modes.damping_ratio, "1", "fraction of critical damping"),
        "kind": (("mode",), list(modes.kind), "1", "kind of mode"),
        "nodal_diameter": (("mode",), modes.nodal_diameter, "1", "dominant nodal diameter of the ring"),
        "shape": (("dof", "mode"), modes.shape, "kg^-1/2", "mass-normalised mode shape"),
        "mesh_stiffness": (("mesh",), modes.mesh_stiffness, "N/m", "mean mesh stiffness, ring taken out"),
        "mesh_deflection": (
            ("mesh", "mode"),
            modes.mesh_deflection,
            "kg^-1/2",
            "mesh deflection of the mode",
        ),
    }
    state, record = result.state, ("mesh", "supported_position")
    variables |= {
        "supported_ste": (
            record,
            state.deflection,
            "m",
            "static transmission error of the set on its supports",
        ),
        "supported_force": (record, state.force, "N", "mesh force of the set on its supports"),
        "supported_stiffness": (record, state.stiffness, "N/m", "tangent mesh stiffness on the supports"),
        "flexibility": (
            ("mesh", "other_mesh"),
            model.system.flexibility,
            "m/N",
            "compliance between the meshes through their bodies",
        ),
    }
    for name, output in (("ring_shape", RADIAL), ("ring_tangential_shape", TANGENTIAL)):
        field = ring_field(model, result.ring.modes, coordinates, output, n_max)
        words = f"outer {'radial' if output == RADIAL else 'tangential'} displacement, component exp(i n phi)"
        for part in ("real", "imag"):
            values = getattr(field, part)
            variables[f"{name}_{part}"] = (("mode", "circumferential"), values, "kg^-1/2", words)
    n_meshes, diameters = len(modes.mesh_stiffness), np.arange(-n_max, n_max + 1)
    return dataset(
        variables,
        coords={
            "mode": (("mode",), np.arange(len(modes.frequency)), "1", "mode"),
            "dof": (("dof",), list(modes.dofs), "1", "degree of freedom"),
            "mesh": (("mesh",), _mesh_names(n_meshes // 2), "1", "gear mesh"),
            "other_mesh": (("other_mesh",), _mesh_names(n_meshes // 2), "1", "gear mesh"),
            "supported_position": (
                ("supported_position",),
                state.position,
                "1",
                "position in mesh periods, denser near jumps of the stiffness",
            ),
            "circumferential": (("circumferential",), diameters, "1", "signed nodal diameter n"),
        },
        attrs={
            "title": "modal basis with mean mesh stiffnesses",
            "unknowns": len(model.system.M),
            "planet_angles": model.planet_angles,
            "excitation_reach": result.reach,
        },
    )


def dynamics_dataset(result: DynamicsResult) -> xr.Dataset:
    """Contents of dynamics.nc."""
    response, lines = result.response, ("speed", "mesh", "harmonic")
    field = ("speed", "harmonic", "circumferential")
    n_max, harmonics = result.ring_radial.shape[-1] // 2, np.arange(response.force.shape[-1])
    diameters = np.arange(-n_max, n_max + 1)
    entries = (
        ("dte", lines, result.dte, "m", "dynamic transmission error"),
        ("mesh_force", lines, response.force, "N", "dynamic mesh force"),
        ("mesh_deflection", lines, response.deflection, "m", "deflection of the mesh spring"),
        ("ring", field, result.ring_radial, "m", "outer radial displacement of the ring"),
        ("ring_tangential", field, result.ring_tangential, "m", "outer tangential displacement of the ring"),
    )
    reach = {
        "excitation_limit": (
            ("speed",),
            result.excitation_limit,
            "Hz",
            "highest frequency of the excitation",
        ),
        "level_change": (
            ("speed",),
            result.level_change,
            "dB",
            "change of the housing level with excitation up to the frequency compared_to",
        ),
    }
    return dataset(
        response_entries(result) | reach | complex_entries(entries),
        coords={
            "speed": (("speed",), result.input_speed / RPM, "rpm", "speed of the input"),
            "mesh": (("mesh",), list(result.mesh_names), "1", "gear mesh"),
            "harmonic": (("harmonic",), harmonics, "1", "harmonic of the mesh frequency"),
            "circumferential": (("circumferential",), diameters, "1", "signed nodal diameter n"),
        },
        attrs={
            "title": "periodic response by the spectral method",
            "message": response.message,
            "compared_to": result.compared_to,
            "warnings": " ".join(result.warnings),
            "ring_teeth": result.ring_teeth,
            "fourier_convention": FOURIER,
        },
    )


def housing_dataset(result: HousingResult) -> xr.Dataset:
    """Contents of housing.nc."""
    from femgear.housing import order_level

    signal, speed = result.signal, ("speed",)
    order = ("speed", "order")
    variables = {
        "seconds": (("speed", "time"), signal.seconds, "s", "time"),
        "acceleration": (
            ("speed", "time"),
            signal.acceleration,
            "m/s^2",
            "radial acceleration at the sensor",
        ),
        "displacement": (("speed", "time"), signal.displacement, "m", "radial displacement at the sensor"),
        "order_amplitude": (
            order,
            np.abs(result.lines.acceleration),
            "m/s^2",
            f"acceleration, {result.lines.method}",
        ),
        "order_amplitude_exact": (
            order,
            np.abs(result.exact.acceleration),
            "m/s^2",
            "acceleration, exact lines",
        ),
        "order_phase_exact": (
            order,
            np.angle(result.exact.displacement),
            "rad",
            "displacement phase, exact lines",
        ),
        "excitation_limit": (speed, result.excitation_limit, "Hz", "highest frequency of the excitation"),
        "level": (speed, order_level(result.lines), "m/s^2", "root mean square of the acceleration"),
    }
    return dataset(
        variables,
        coords={
            "speed": (speed, result.input_speed / RPM, "rpm", "speed of the input"),
            "time": (("time",), signal.revolution, "1", "fraction of one carrier revolution"),
            "order": (("order",), result.lines.order, "1", "carrier order"),
        },
        attrs={
            "title": "what a sensor fixed on the housing hears",
            "sensor_angle": result.lines.sensor_angle,
            "form": result.form,
            "points": result.points,
            "ring_teeth": result.lines.z_ring,
        },
    )


def _mesh_names(n: int) -> list[str]:
    return [f"sun-planet {i + 1}" for i in range(n)] + [f"planet {i + 1}-ring" for i in range(n)]
