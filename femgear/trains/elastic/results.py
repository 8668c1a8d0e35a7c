from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from femgear.case.dependencies import Entries
from femgear.report.tables import Block
from femgear.storage.dataset import FOURIER, RPM, _mesh_names, complex_entries, dataset, response_entries

if TYPE_CHECKING:
    import xarray as xr

    from femgear.contact.assembly import Bodies
    from femgear.contact.loaded_period import LoadedPeriod
    from femgear.gears.kinematics import Speeds
    from femgear.housing.sensor import HousingSignal, SensorLines
    from femgear.solvers.stability.floquet import Stability
    from femgear.system.system import MeshExcitation, Modes, Response
    from femgear.trains.elastic.model import ElasticSet, RingModel


@dataclass(frozen=True)
class ModesResult:
    """Mechanical system with its elastic ring, its loaded state, and its modal basis.

    Parameters
    ----------
    bodies : tuple of Bodies
        Flank compliances with the ring on its foundation, and with the ring held.
    state : LoadedPeriod
        Static state of the set on its supports, whatever ``static.members`` shows.
    reach : float
        Frequency for whose excitation the basis was made [Hz].
    """

    ring: RingModel
    model: ElasticSet
    excitation: MeshExcitation
    modes: Modes
    max_diameter: int
    bodies: tuple[Bodies, Bodies]
    state: LoadedPeriod
    reach: float
    entries: Entries

    def dataset(self) -> xr.Dataset:
        """Contents of modes.nc."""

        return modes_dataset(self)


@dataclass(frozen=True)
class DynamicsResult:
    """Periodic response at every speed, its stability, and the field on the ring's outer surface.

    ``dte`` (speeds, 2N, H + 1) [m] contains the deflection of the ring; ``ring_radial`` and
    ``ring_tangential`` (speeds, H + 1, 2 n_max + 1) are circumferential components [m]. The excitation ends
    at ``excitation_limit`` (speeds,) [Hz]; ``level_change`` (speeds,) [dB] is what the level of the housing
    changes when it ends at ``compared_to`` [Hz] instead, nan at speeds that were not looked at.
    """

    input_speed: np.ndarray
    speeds: tuple[Speeds, ...]
    response: Response
    stability: Stability
    dte: np.ndarray
    ring_radial: np.ndarray
    ring_tangential: np.ndarray
    mesh_names: tuple[str, ...]
    ring_teeth: int
    excitation_limit: np.ndarray
    level_change: np.ndarray
    compared_to: float
    entries: Entries

    @property
    def warnings(self) -> tuple[str, ...]:
        """What an engineer should not overlook in this result."""
        from femgear.trains.elastic.checks import missing_level

        rpm = self.input_speed * 30.0 / np.pi
        return missing_level(rpm, self.level_change, self.excitation_limit, self.compared_to)

    def dataset(self) -> xr.Dataset:
        """Contents of dynamics.nc."""

        return dynamics_dataset(self)


@dataclass(frozen=True)
class HousingResult:
    """What a fixed sensor on the ring hears.

    ``lines`` are of the case's ``form``, "exact" or "linear" (interpolated over ``points`` points of the
    ring), and ``signal`` is theirs; ``exact`` are the exact ones. The excitation ends at
    ``excitation_limit`` (speeds,) [Hz].
    """

    input_speed: np.ndarray
    lines: SensorLines
    exact: SensorLines
    signal: HousingSignal
    form: str
    points: int
    excitation_limit: np.ndarray

    def dataset(self) -> xr.Dataset:
        """Contents of housing.nc."""

        return housing_dataset(self)


def modes_dataset(result: ModesResult) -> xr.Dataset:
    """Contents of modes.nc."""
    from femgear.trains.elastic.model import RADIAL, TANGENTIAL, ring_field

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
    from femgear.housing.orders import order_level

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


_MANY = 8


def _modes(data: xr.Dataset) -> Block:
    shown = min(data.sizes["mode"], 16)
    rows = tuple(
        (
            str(i + 1),
            f"{float(data.frequency[i]):.2f}",
            str(data.kind.values[i]),
            _diameter(int(data.nodal_diameter[i])),
        )
        for i in range(shown)
    )
    notes = (
        f"{data.sizes['mode']} modes up to {float(data.frequency.max()):.0f} Hz, the first {shown} shown",
    )
    return Block("Modes", ("mode", "frequency [Hz]", "kind", "nodal diameters"), rows, notes)


def _diameter(number: int) -> str:
    return "-" if number < 0 else str(number)


def _dynamics(data: xr.Dataset) -> Block:
    dte = np.hypot(data.dte_real.values, data.dte_imag.values)  # speed, mesh, harmonic
    rms = np.sqrt(0.5 * (dte[:, :, 1:] ** 2).sum(axis=2)).max(axis=1)
    largest = np.abs(data.floquet_multiplier.values)
    stable = data.stable.values.astype(bool) if "stable" in data else largest < 1.0
    # helical cases are excited by a number of harmonics
    reach = [()] * data.sizes["speed"]
    if "excitation_limit" in data:
        reach = [(f"{value / 1e3:.2f}",) for value in data.excitation_limit.values]
    rows = tuple(
        (
            f"{float(data.speed[i]):.2f}",
            f"{float(data.mesh_frequency[i]):.2f}",
            *reach[i],
            f"{rms[i] * 1e6:.4f}",
            str(data.method.values[i]),
            str(int(data.iterations[i])),
            f"{float(data.spectral_radius[i]):.4f}",
            f"{largest[i]:.4f}",
            "yes" if bool(data.converged[i]) else "NO",
        )
        for i in _chosen(data.sizes["speed"])
    )
    header = (
        "speed [rpm]",
        "mesh [Hz]",
        *(("excited up to [kHz]",) if reach[0] else ()),
        "DTE rms [um]",
        "method",
        "iterations",
        "radius",
        "Floquet",
        "converged",
    )
    notes = (
        "DTE rms: the largest of all meshes, without its mean; iterations, radius: of the fixed point,",
        "which contracts below 1; Floquet: largest multiplier, stable up to 1 (exactly 1 without damping)",
        f"{int(data.converged.sum())} of {len(stable)} speeds converged, {int(stable.sum())} stable",
    )
    if "level_change" in data:
        change = np.abs(data.level_change.values)
        notes += (
            f"level of the housing with excitation up to {data.attrs['compared_to'] / 1e3:.4g} kHz: "
            f"{np.nanmax(change):.2g} dB away at most, at {int(np.isfinite(change).sum())} speeds looked at",
        )
    return Block("Dynamics", header, rows, notes)


def _housing(data: xr.Dataset) -> Block:
    rows = []
    for i in _chosen(data.sizes["speed"]):
        one = data.isel(speed=i)
        amplitude = one.order_amplitude.values
        largest = np.argsort(-amplitude, kind="stable")[:5]
        lines = ", ".join(f"{round(float(one.order[j]))} ({amplitude[j]:.3g})" for j in largest)
        limit = f"{float(one.excitation_limit) / 1e3:.2f}"
        rows.append((f"{float(one.speed):.2f}", limit, f"{float(one.level):.4g}", lines))
    header = (
        "speed [rpm]",
        "excited up to [kHz]",
        "rms [m/s^2]",
        "largest lines: carrier order (amplitude [m/s^2])",
    )
    form = data.attrs["form"]
    note = f"form of the signal: {form}" + (f", {data.attrs['points']} points" if form == "linear" else "")
    return Block("Housing", header, tuple(rows), (note,))


def _chosen(count: int) -> Iterator[int]:
    """All indices of a short list, the first and last of a long one."""
    return (i for i in range(count) if count <= _MANY or i < _MANY // 2 or i >= count - _MANY // 2)
