"""The two published wind turbine sets as lumped models, with the readings of their damaged tables.

Y. Guo, J. Keller and R. G. Parker, Dynamic analysis of wind turbine planetary gears using an extended
harmonic balance approach, NREL/CP-5000-55355 (2012); Eur. J. Mech. A/Solids 47, 2014, 45-57. Set A (PG-A) is
the 750 kW set 21/39/99, set B (PG-B) the 550 kW set 16/26/68. Inertias are read as ``I / r^2`` and base
radii with the working pressure angle 24.6 degrees. docs/nrel.md says what each reading reproduces.
cases/nrel_pga.toml and cases/nrel_pgb.toml hold the same sets as case files.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from femgear.errors import CaseError
from femgear.solvers.linear.receptance import Reduction, reduce_problem
from femgear.stages.lumped_set import (
    Bearings,
    Gravity,
    MemberBearing,
    gear_set_problem,
    phased_series,
    working_springs,
)
from femgear.system.mesh_directions import mesh_elements
from femgear.system.rigid_bodies import PlanarBody, PlanarSet, PlanarTorque
from femgear.system.system import NonlinearSystem

# printed data of the nonlinear examples: torques on the carrier [N m], speeds [rpm], play [m]
TORQUE_A, SPEED_A, BEARING_A = 322_610.0, 22.2, 3.2e9
TORQUE_B, SPEED_B, BACKLASH_B = 180_000.0, 30.0, 482e-6
# damping ratios of the first natural frequencies of set B; further modes take the last one
DAMPING_B = (0.0548, 0.0526, 0.0743, 0.0519)
DAMPING_A = 0.05
# teeth of sun and ring of set B
TEETH_B = (16, 68)
# length over which tooth contact sets in [m]
SMOOTHING = 0.3e-6
_ANGLE = math.radians(24.6)


def wind_turbine_a(*, reduced_inertia: bool = True, pressure_angle: float = _ANGLE) -> PlanarSet:
    """Set A: 750 kW, 21/39/99, carrier torque 322 610 N m at 22.2 rpm.

    Parameters
    ----------
    reduced_inertia : bool
        The printed inertias are ``I / r^2`` [kg]; False takes them as polar inertias [kg m^2].
    pressure_angle : float
        Working pressure angle [rad], which the paper does not print legibly.

    Returns
    -------
    PlanarSet
        As printed: ring support 102e6, carrier support 5e9 N/m. The carrier bearing is not in it, see
        `bearing_problem_a`.
    """
    data = _set(
        0.5 * np.array([0.2156, 0.4004, 1.0164]),
        0.308,
        pressure_angle,
        (181.6, 2633.0, 759.9, 104.0),
        (3.2, 144.2, 59.1, 3.2),
        supports=(100.0, 102e6, 5e9),
        torsional=(45.8e6, 57.4e6),
        meshes=(16.9e9, 19.2e9),
        planet_bearing=6.8e9,
    )
    if reduced_inertia:
        return data
    inertias = {"sun": 3.2, "ring": 144.2, "carrier": 59.1, "planet": 3.2}
    return replace(data, **{name: replace(getattr(data, name), inertia=I) for name, I in inertias.items()})


def wind_turbine_b(*, as_printed: bool = False) -> PlanarSet:
    """Set B: 550 kW, 16/26/68, module 14 mm, carrier torque 180 000 N m at 30 rpm.

    Parameters
    ----------
    as_printed : bool
        Ring support 126e6 and carrier support 4e9 N/m, torsional supports as printed. By default ring and
        carrier supports are exchanged and ``k_u = 4 k_theta / r_b^2``: only so do the natural frequencies
        of the paper come out.
    """
    supports = (100.0, 126e6, 4e9) if as_printed else (100.0, 4e9, 126e6)
    factor = 1.0 if as_printed else 4.0
    return _set(
        0.5 * 14e-3 * np.array([16.0, 26.0, 68.0]),
        0.294,
        _ANGLE,
        (51.0, 4000.0, 1330.0, 114.0),
        (61.1, 2484.0, 314.7, 51.9),
        supports=supports,
        torsional=(factor * 3e6, factor * 24.4e6),
        meshes=(3.95e9, 5.29e9),
        planet_bearing=5.3e9,
    )


def gravity_problem_b(
    *,
    backlash: float = BACKLASH_B,
    smoothing: float = SMOOTHING,
    driven: bool = True,
    own_lines: bool = True,
    torque: float = TORQUE_B,
) -> NonlinearSystem:
    """Set B under its weight; the base frequency is that of the weight in the carrier frame.

    Parameters
    ----------
    backlash : float
        Total play along the line of action [m].
    smoothing : float
        [m]
    driven : bool
        The torque acts in the sense in which the carrier turns, as in a turbine. False turns the weight the
        other way, as for a carrier that is the output.
    own_lines : bool
        Back flanks on their own lines of action, so that teeth can wedge; else on those of the drive flanks.
    torque : float
        On the carrier [N m]; the torsional supports of sun and ring carry it.
    """
    data = wind_turbine_b()
    return gear_set_problem(
        data,
        meshes=mesh_elements(data, backlash=backlash, smoothing=smoothing),
        back_flanks=own_lines,
        torque=PlanarTorque(torque, "carrier", output=None),
        gravity=Gravity(orders=(1,) if driven else (-1,)),
        damping=DAMPING_B,
    )


def extended_problem_b(
    *, fluctuation: tuple[float, ...] = (0.1, 0.05, 0.03), torque: float = TORQUE_B
) -> NonlinearSystem:
    """Set B under weight and mesh stiffness k(t) together: base frequencies carrier and mesh, 1 to 68.

    Teeth separate and have no back side. The paper prints no legible k(t): the harmonics are assumed.

    Parameters
    ----------
    fluctuation : tuple of float
        Harmonics of every mesh stiffness over its mean, in phase at mesh phase zero. The phases of the meshes
        are those of equally spaced planets, ``z_s psi_n / 2 pi`` and ``z_r psi_n / 2 pi`` (Parker and Lin,
        J. Mech. Des. 126, 2004); sun and ring meshes of planet 1 are taken in phase.
    torque : float
        On the carrier [N m].
    """
    data = wind_turbine_b()
    phases = np.concatenate([(z * np.arange(3) / 3.0) % 1.0 for z in TEETH_B])
    stiffness = phased_series(fluctuation, fluctuation, phases, mean=data.mesh_stiffness, orders=(0, 1))
    return gear_set_problem(
        data,
        meshes=mesh_elements(data, stiffness=stiffness, smoothing=SMOOTHING),
        torque=PlanarTorque(torque, "carrier", output=None),
        gravity=Gravity(orders=(1, 0)),
        damping=DAMPING_B,
    )


def bearing_problem_a(
    clearance: float | None,
    *,
    backlash: float | None = None,
    smoothing: float = SMOOTHING,
    data: PlanarSet | None = None,
) -> NonlinearSystem:
    """Set A under its weight, with the carrier bearing between carrier and ring.

    Its two columns are the last ones: carrier less ring, x and y. Damping is that of the closed bearing.

    Parameters
    ----------
    clearance : float or None
        Radial clearance of the carrier bearing [m]; None takes the bearing away.
    backlash : float, optional
        Total play along the line of action [m], with back flanks on their own lines; without it teeth only
        separate.
    smoothing : float
        Of the tooth contact [m].
    data : PlanarSet, optional
        Another reading of the set.
    """
    data = wind_turbine_a() if data is None else data
    back = backlash is not None
    return gear_set_problem(
        data,
        meshes=mesh_elements(data, backlash=backlash, smoothing=smoothing if back else 0.0),
        back_flanks=back,
        torque=PlanarTorque(TORQUE_A, "carrier", output=None),
        bearings=Bearings(members=(MemberBearing(BEARING_A, clearance, "carrier", "ring"),)),
        gravity=Gravity(orders=(1,)),
        damping=DAMPING_A,
    )


def drive_reduction(problem: NonlinearSystem) -> Reduction:
    """Reduction whose reference springs leave the back flanks open.

    The elements' own reference counts them as closed, far from where the train works.
    """
    return reduce_problem(problem, reference=working_springs(problem))


def _set(radii, distance, angle, masses, reduced, *, supports, torsional, meshes, planet_bearing) -> PlanarSet:
    """Three equal planets; pitch radii [m] of sun, planet, ring; bodies sun, ring, carrier, planet."""
    if not 0.0 < angle < 0.5 * math.pi:
        raise CaseError(f"a pressure angle of {angle} rad", code="E-RANGE", limit="between 0 and pi/2")
    sun, planet, ring = (float(r) * math.cos(angle) for r in radii)
    inertias = [i * r**2 for i, r in zip(reduced, (sun, ring, distance, planet))]
    return PlanarSet(
        sun=PlanarBody(masses[0], inertias[0], supports[0], torsional[0]),
        ring=PlanarBody(masses[1], inertias[1], supports[1], torsional[1]),
        carrier=PlanarBody(masses[2], inertias[2], supports[2]),
        planet=PlanarBody(masses[3], inertias[3]),
        sun_radius=sun,
        ring_radius=ring,
        planet_radius=planet,
        centre_distance=distance,
        planet_angles=2.0 * np.pi * np.arange(3) / 3,
        pressure_angle_sun_planet=angle,
        pressure_angle_planet_ring=angle,
        stiffness_sun_planet=meshes[0],
        stiffness_planet_ring=meshes[1],
        planet_bearing=planet_bearing,
    )
