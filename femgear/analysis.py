"""The pipeline: static -> modes -> dynamics -> housing. Read this first.

Each stage takes the case and what came before, and returns a frozen result whose ``dataset()`` is what
goes to disk.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from femgear.analysis_checks import (
    check_dynamic_case,
    check_motions,
    check_rim_speed,
    highest_frequency,
    max_nodal_diameter,
    static_warnings,
)
from femgear.case import Case, planetary_set, set_deviations
from femgear.threads import one_blas_thread

if TYPE_CHECKING:
    import xarray as xr

    from femgear.contact.assembly import Bodies
    from femgear.contact.bodies import Sectors
    from femgear.contact.cycle import MeshCycle
    from femgear.gears import PlanetarySet, Speeds
    from femgear.housing import HousingSignal, SensorLines
    from femgear.models.elastic import ElasticSet
    from femgear.models.ring import RingModel
    from femgear.solvers.floquet import Stability
    from femgear.system import MeshExcitation, Modes, Response

Progress = Callable[[str, float, float], None]


@dataclass(frozen=True)
class StaticResult:
    """Static transmission error, load sharing and mesh stiffness of all meshes."""

    planetary_set: PlanetarySet
    sectors: Sectors
    bodies: Bodies
    cycle: MeshCycle
    sun_torque: float
    period_message: str = ""

    @property
    def warnings(self) -> tuple[str, ...]:
        """What an engineer should not overlook in this result."""
        return static_warnings(self.cycle, self.planetary_set.sun.module)

    def dataset(self) -> xr.Dataset:
        """Contents of static.nc."""
        from femgear.datasets import static_dataset

        return static_dataset(self)


@dataclass(frozen=True)
class ModesResult:
    """Mechanical system with its elastic ring, and its modal basis."""

    ring: RingModel
    model: ElasticSet
    excitation: MeshExcitation
    modes: Modes
    max_diameter: int

    def dataset(self) -> xr.Dataset:
        """Contents of modes.nc."""
        from femgear.datasets import modes_dataset

        return modes_dataset(self)


@dataclass(frozen=True)
class DynamicsResult:
    """Periodic response at every speed, its stability, and the field on the ring's outer surface.

    ``dte`` (speeds, 2N, H + 1) [m] contains the deflection of the ring; ``ring_radial`` and
    ``ring_tangential`` (speeds, H + 1, 2 n_max + 1) are circumferential components [m].
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

    def dataset(self) -> xr.Dataset:
        """Contents of dynamics.nc."""
        from femgear.datasets import dynamics_dataset

        return dynamics_dataset(self)


@dataclass(frozen=True)
class HousingResult:
    """What a fixed sensor on the ring hears: linear interpolation over P points, and exact lines."""

    input_speed: np.ndarray
    linear: SensorLines
    exact: SensorLines
    signal: HousingSignal
    points: int

    def dataset(self) -> xr.Dataset:
        """Contents of housing.nc."""
        from femgear.datasets import housing_dataset

        return housing_dataset(self)


@one_blas_thread()
def solve_static(case: Case, *, cache: Path | None = None, progress: Progress | None = None) -> StaticResult:
    """Static transmission error, load sharing and mesh stiffness over one mesh period.

    Parameters
    ----------
    case : Case
    cache : path, optional
        Folder of generated grids.
    progress : callable, optional
        Called with (stage, done, total).

    Raises
    ------
    GeometryError, GridError, ContactError
    """
    from femgear.contact.bodies import make_bodies, make_sectors
    from femgear.contact.mirrored import walk_either_flank
    from femgear.fe.elasticity import Material
    from femgear.gears import torques
    from femgear.gears.deviations import common_period

    gears, deviations = planetary_set(case), set_deviations(case)
    material = Material(case.material.youngs_modulus, case.material.poisson_ratio, case.material.density)
    sectors = make_sectors(gears, material, flank_elements=case.static.flank_elements, cache=cache)
    foundation = _ring_foundation(case, sectors.ring) if case.static.members == "elastic" else None
    bodies = make_bodies(sectors, material, depth=case.static.depth, ring_foundation=foundation)
    sun_torque = torques(gears, member=case.operation.input, torque=case.operation.torque).sun
    periods, period_message = common_period(deviations, gears, limit=case.static.longest_record)
    cycle = walk_either_flank(
        gears,
        bodies,
        sun_torque=sun_torque,
        positions=case.static.positions,
        contact=case.static.contact,
        # thickness errors separate the back flanks alone
        deviations=None if deviations.ideal and not case.static.back_flanks else deviations,
        supports=_supports(case),
        periods=periods,
        both_flanks=case.static.back_flanks,
        pressures=case.static.stresses and periods == 1,
        progress=None if progress is None else lambda done, total: progress("contact", done, total),
    )
    check_motions(cycle, gears.sun.module)
    return StaticResult(gears, sectors, bodies, cycle, sun_torque, period_message)


@one_blas_thread()
def solve_modes(case: Case, static: StaticResult) -> ModesResult:
    """Modal basis of the set with its elastic ring and mean mesh stiffnesses.

    Raises
    ------
    CaseError
        Without torque, or when the ring, which is the housing of this model, is not the fixed member.
    """
    from femgear.contact.bodies import active_flank_load
    from femgear.fe.elasticity import Material, mass
    from femgear.models.elastic import elastic_set, mesh_excitation, ring_mesh_compliance
    from femgear.models.ring import ring_model
    from femgear.solvers.modal import solve_modes as modal_basis

    gears, sector, cycle = static.planetary_set, static.sectors.ring, static.cycle
    check_dynamic_case(case, gears)
    side = 1.0 if static.sun_torque >= 0 else -1.0
    material = Material(case.material.youngs_modulus, case.material.poisson_ratio, case.material.density)
    top = highest_frequency(case, gears)
    diameter = max_nodal_diameter(case)
    thickness = gears.ring.face_width
    ring = ring_model(
        gears,
        sector.grid,
        sector.stiffness,
        mass(sector.grid, material, thickness),
        _ring_foundation(case, sector),
        active_flank_load(sector.grid, gears, side),
        max_diameter=diameter,
        max_frequency=top,
        side=side,
        static_on_foundation=case.static.members == "elastic",
    )
    compliance = ring_mesh_compliance(
        ring.held_compliance, np.arange(diameter + 1), gears.ring.teeth, gears.planet_angles
    )
    excitation = mesh_excitation(
        cycle.stiffness, cycle.deflection, cycle.force, compliance, backlash=_backlash(gears)
    )
    model = elastic_set(
        gears, ring, **_bodies_of(case), sun_torque=static.sun_torque, driven=case.operation.input
    )
    modes = modal_basis(
        model.system,
        excitation.stiffness.mean(axis=1),
        damping_ratio=case.dynamics.damping_ratio,
        max_frequency=top,
    )
    return ModesResult(ring, model, excitation, _named(modes, model), diameter)


@one_blas_thread()
def solve_dynamics(
    case: Case, static: StaticResult, modes: ModesResult, *, progress: Progress | None = None
) -> DynamicsResult:
    """Periodic response at the case's speeds by the spectral method, with a Floquet verdict at each.

    Raises
    ------
    CaseError
        A carrier that runs around the ring faster than its waves (E-CRITICAL-SPEED).
    ConvergenceError
    """
    from femgear.gears import speeds
    from femgear.solvers.floquet import stability as floquet_verdict
    from femgear.solvers.spectral import solve_spectral

    gears, basis = static.planetary_set, modes.modes
    all_speeds = tuple(
        speeds(gears, input=case.operation.input, fixed="ring", speed=s) for s in case.operation.speeds
    )
    check_rim_speed(modes.ring.modes, [s.carrier for s in all_speeds])
    frequency = np.array([s.mesh_frequency for s in all_speeds])
    response = solve_spectral(
        basis,
        modes.excitation,
        frequency,
        excitation_harmonics=case.dynamics.mesh_harmonics,
        response_harmonics=case.response_harmonics,
        tolerance=case.dynamics.tolerance,
    )
    if progress is not None:
        progress("dynamics", 1, 2)
    stability = floquet_verdict(
        basis, modes.excitation, frequency, excitation_harmonics=case.dynamics.mesh_harmonics
    )
    if progress is not None:
        progress("dynamics", 2, 2)
    dte, field = _outputs(modes, response)
    return DynamicsResult(
        input_speed=np.array(case.operation.speeds),
        speeds=all_speeds,
        response=response,
        stability=stability,
        dte=dte,
        ring_radial=field[0],
        ring_tangential=field[1],
        mesh_names=gears.mesh_names,
        ring_teeth=gears.ring.teeth,
    )


def _outputs(result: ModesResult, response: Response):
    """Dynamic transmission error of every mesh, and radial and tangential field of the ring."""
    from femgear.models.elastic import ring_field
    from femgear.models.ring import RADIAL, TANGENTIAL
    from femgear.solvers.modal import output_load, output_response, residual_output

    model, basis = result.model, result.modes
    ring_rows = np.eye(len(model.system.M))[model.ring_slice]
    outputs = np.vstack([model.rigid_directions.T, ring_rows])
    values = output_response(
        basis,
        response,
        outputs @ basis.shape,
        residual=residual_output(model.system, basis, outputs),
        load=output_load(model.system, basis, outputs),
    )
    n_meshes = model.rigid_directions.shape[1]
    coordinates = np.swapaxes(values[:, n_meshes:], 1, 2)
    field = [
        ring_field(model, result.ring.modes, coordinates, output, result.max_diameter)
        for output in (RADIAL, TANGENTIAL)
    ]
    return values[:, :n_meshes], field


@one_blas_thread()
def solve_housing(case: Case, dynamics: DynamicsResult) -> HousingResult:
    """Signal and carrier orders of a sensor fixed on the ring while the carrier turns past it.

    The static deflection (harmonic zero) is carried exactly in both forms: its images, where the teeth of
    the ring are a multiple of the number of points, would fall on the mesh orders.
    """
    from dataclasses import replace

    from femgear.housing import fixed_sensor_lines, fixed_sensor_signal, heaviside_linear_lines

    carrier = np.array([s.carrier for s in dynamics.speeds])
    arguments = (dynamics.ring_teeth, carrier, case.housing.sensor_angle)
    static = np.zeros_like(dynamics.ring_radial)
    static[:, 0] = dynamics.ring_radial[:, 0]
    moving = heaviside_linear_lines(dynamics.ring_radial - static, *arguments, points=case.housing.points)
    still = fixed_sensor_lines(static, *arguments)
    linear = replace(moving, displacement=moving.displacement + still.displacement)
    return HousingResult(
        input_speed=np.array(case.operation.speeds),
        linear=linear,
        exact=fixed_sensor_lines(dynamics.ring_radial, *arguments),
        signal=fixed_sensor_signal(linear),
        points=case.housing.points,
    )


def _ring_foundation(case: Case, sector):
    """Elastic foundation of one sector of the ring [N/m]."""
    from femgear.fe.elasticity import foundation

    ring, width = case.ring, sector.gear.face_width
    return foundation(sector.grid, "rim", ring.foundation_radial, ring.foundation_tangential, thickness=width)


def _supports(case: Case):
    """Supports of the static problem: rigid, or those of the case's bodies."""
    from femgear.contact.supports import RIGID, Supports

    if case.static.members == "fixed":
        return RIGID
    return Supports(
        sun=case.sun.support_stiffness,
        carrier=case.carrier.support_stiffness,
        planet=case.planet.bearing_stiffness,
        planet_clearance=case.planet.bearing_clearance,
    )


def _backlash(gears: PlanetarySet) -> np.ndarray:
    n = gears.n_planets
    return np.repeat([gears.backlash_sun_planet, gears.backlash_planet_ring], n)


def _bodies_of(case: Case) -> dict:
    """Rigid bodies and shafts of the case as the elastic model takes them."""
    from femgear.models.elastic import BodyData, ShaftData

    def shaft(section):
        return None if section is None else ShaftData(section.inertia, section.coupling_stiffness)

    return {
        "sun": BodyData(case.sun.mass, case.sun.inertia, case.sun.support_stiffness),
        "carrier": BodyData(case.carrier.mass, case.carrier.inertia, case.carrier.support_stiffness),
        "planet": BodyData(case.planet.mass, case.planet.inertia, case.planet.bearing_stiffness),
        "motor": shaft(case.motor),
        "brake": shaft(case.brake),
    }


def _named(modes: Modes, model: ElasticSet) -> Modes:
    """The modes with their kinds and nodal diameters."""
    from dataclasses import replace

    from femgear.models.kinds import mode_kinds

    kinds, diameters = mode_kinds(
        modes.shape,
        np.diag(model.system.M),
        model.system.dofs,
        frequency=modes.frequency,
        ring_diameter=model.ring_diameter,
        ring_slice=model.ring_slice,
        planet_angles=model.planet_angles,
    )
    return replace(modes, kind=kinds, nodal_diameter=diameters)
