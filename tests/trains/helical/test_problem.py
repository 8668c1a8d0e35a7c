"""Helical sets with mesh stiffness that changes: the planar set, two solvers, slices that part."""

import math
from dataclasses import replace

import numpy as np
import pytest
from phase_patterns import phased_errors
from published.planetary_sets import cases, kahraman_set, lin_parker_set

from femgear.errors import CaseError
from femgear.solvers.linear.modal import undamped_modes
from femgear.solvers.linear.receptance import modal_error_response
from femgear.solvers.periodic.harmonic_balance import solve_harmonic_balance
from femgear.solvers.periodic.shooting import solve_shooting
from femgear.solvers.periodic.spectral import solve_spectral
from femgear.stages.lumped_set import gear_set_modes, gear_set_problem, phased_series
from femgear.system.mesh_directions import mesh_elements
from femgear.system.rigid_bodies import HelicalBody, HelicalSupport, PlanarTorque
from femgear.system.system import MeshExcitation, element_forces
from femgear.trains.helical.model import HelicalSet, helical_excitation
from validation.routes import state_of

TORQUE = PlanarTorque(300.0)
PHASES = -np.array([0.0, 1 / 3, 2 / 3, 0.15, 0.15 + 1 / 3, 0.15 + 2 / 3])
WAVE = np.array([0.25, 0.075, 0.0375])


def without_helix(planar) -> HelicalSet:
    """The planar set with supports in all directions."""

    def body(name):
        one = getattr(planar, name)
        support = HelicalSupport(one.support, 1e8, 1e5, one.torsional_support)
        if name == "planet":
            support = HelicalSupport()
        return HelicalBody(one.mass, one.inertia, 0.6 * one.inertia, support)

    names = ("sun_radius", "ring_radius", "planet_radius", "centre_distance", "planet_angles")
    names += ("stiffness_sun_planet", "stiffness_planet_ring")
    names += ("pressure_angle_sun_planet", "pressure_angle_planet_ring")
    return HelicalSet(
        **{name: body(name) for name in ("sun", "ring", "carrier", "planet")},
        **{name: getattr(planar, name) for name in names},
        base_helix_angle=0.0,
        planet_bearing=HelicalSupport(planar.planet_bearing, 1e8, 1e5),
    )


def both_problems(backlash):
    planar = lin_parker_set(3)
    data = without_helix(planar)
    stiffness = phased_series(WAVE, WAVE, PHASES, mean=planar.mesh_stiffness)
    options = {"stiffness": stiffness, "backlash": backlash}
    return (
        gear_set_problem(planar, meshes=mesh_elements(planar, **options), torque=TORQUE, damping=0.05),
        gear_set_problem(data, meshes=mesh_elements(data, **options), torque=TORQUE, damping=0.05),
    )


@pytest.mark.parametrize("hertz", [3000.0, 7400.0])
def test_without_helix_the_train_with_contact_loss_is_the_planar_one(hertz):
    """7400 Hz: the meshes with the ring part."""
    lines = [
        solve_harmonic_balance(p, 2 * math.pi * hertz, harmonics=6, samples=256, stability=False, tolerance=1e-12)
        for p in both_problems(20e-6)
    ]
    assert all(found.converged for found in lines)
    size = np.abs(lines[0].deflection[:, 1:]).max()
    assert np.abs(lines[1].deflection - lines[0].deflection).max() < 1e-9 * size


def test_without_helix_phased_errors_do_the_same():
    planar = lin_parker_set(3)
    data, error = without_helix(planar), phased_errors(1e-6 * WAVE, PHASES)
    hertz = np.linspace(100.0, 9000.0, 60)
    flat = modal_error_response(gear_set_modes(planar, damping_ratio=0.05), hertz, error)
    system = gear_set_problem(data, torque=TORQUE).system
    modes = gear_set_modes(data, system=system, damping_ratio=0.05)
    space = modal_error_response(modes, hertz, error)
    assert np.abs(space.force - flat.force).max() < 1e-9 * np.abs(flat.force).max()


def waves(data, phases, depth, count=64):
    """Tangent record of constant force: k(tau + phi), loaded by 500 N along every normal."""
    tau = np.arange(count) / count + np.asarray(phases)[:, None]
    k = data.mesh_stiffness[:, None] * (1 + depth * np.cos(2 * np.pi * tau) + 0.3 * depth * np.sin(4 * np.pi * tau))
    force = np.full_like(k, 500.0)
    return MeshExcitation(k, force / k, force, np.zeros(len(k)))


def test_spectral_iteration_and_harmonic_balance_agree_on_a_helical_set():
    data = kahraman_set(contact_points="pitch_point", slices=2, face_width=0.03)
    record = helical_excitation(waves(data, cases()["F"].phases, 0.3), 0.7, slices=2)
    around = 500.0 * math.cos(data.base_helix_angle)
    torque = PlanarTorque(4 * around * data.sun_radius)
    meshes = mesh_elements(data, stiffness=record, harmonics=2, separates=False)
    problem = gear_set_problem(data, meshes=meshes, torque=torque, damping=0.05)
    modes = undamped_modes(
        replace(problem.system, C=np.zeros_like(problem.system.C)), data.column_stiffness, damping_ratio=0.05
    )
    hertz = 5000.0
    one = solve_spectral(
        modes, record, hertz, excitation_harmonics=2, response_harmonics=6, method="direct", tolerance=1e-12
    )
    two = solve_harmonic_balance(problem, 2 * math.pi * hertz, harmonics=6, samples=64, stability=False)
    assert two.converged and one.converged.all()
    size = np.abs(two.deflection[:, 1:]).max()
    assert np.abs(one.deflection[0] - two.deflection).max() < 1e-7 * size


def test_parting_teeth_by_shooting_and_harmonic_balance():
    """Planets that follow the tilts and heights of their pins leave out motions too quick to integrate."""
    stiff = HelicalSupport(1e8, math.inf, math.inf)
    data = kahraman_set(contact_points="pitch_point", planet_bearing=stiff)
    record = waves(data, cases()["C"].phases, 0.25)
    torque = PlanarTorque(4 * 500.0 * math.cos(data.base_helix_angle) * data.sun_radius)
    meshes = mesh_elements(data, stiffness=record, harmonics=2, backlash=1e-4)
    problem = gear_set_problem(data, meshes=meshes, torque=torque, damping=0.05)
    omega = 2 * math.pi * 9840.0
    balance = solve_harmonic_balance(problem, omega, harmonics=12, samples=1024, stability=False)
    assert balance.converged
    phase = 2 * np.pi * np.arange(400) / 400
    force = element_forces(problem, balance.at(phase / omega), phase[:, None])[0]
    assert 0.2 < (force == 0.0).mean() < 0.4
    options = {"integration": 1e-8, "tolerance": 1e-6, "samples": 512}
    shot = solve_shooting(problem, omega, start=state_of(problem, balance), harmonics=12, **options).solution
    size = np.abs(balance.deflection[:, 1:]).max()
    assert shot.converged and np.abs(shot.deflection - balance.deflection).max() < 1e-4 * size


def test_constant_meshes_and_given_damping():
    data = kahraman_set()
    problem = gear_set_problem(data, torque=TORQUE, damping=np.diag(np.arange(42.0)))
    assert problem.system.C[41, 41] == 41.0
    assert problem.reference == pytest.approx(data.column_stiffness)
    assert not gear_set_problem(data).system.C.any()


def test_what_does_not_fit_is_refused():
    data = kahraman_set()
    record = waves(data, np.zeros(8), 0.1)
    with pytest.raises(CaseError, match="E-HARMONICS"):
        mesh_elements(data, stiffness=record)
    with pytest.raises(CaseError, match="E-SHAPE"):
        gear_set_problem(data, damping=np.eye(3))
    with pytest.raises(CaseError, match="E-SHAPE"):
        gear_set_problem(replace(data, slices=2, face_width=0.1), meshes=mesh_elements(data))
    with pytest.raises(CaseError, match="E-LOAD-BALANCE"):
        gear_set_problem(data, torque=PlanarTorque(10.0, output=None))
