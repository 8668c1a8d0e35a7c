"""Errors of a set: geometry by hand, a floating sun that follows, one base against several, spectrum."""

from dataclasses import replace

import numpy as np
import pytest
from published.planetary_sets import lin_parker_set
from published.transmission_errors import (
    Eccentricity,
    TransmissionErrors,
    carrier_pins,
    equivalent_damping,
    planar_mesh_dampers,
    series_spectrum,
    with_errors,
)

from femgear.errors import CaseError
from femgear.solvers.periodic.harmonic_balance import displacements, solve_harmonic_balance
from femgear.solvers.time.transient import solve_transient
from femgear.stages.lumped_set import gear_set_problem
from femgear.system.fourier import tooth_lines
from femgear.system.mesh_directions import gear_set_system, mesh_elements
from femgear.system.rigid_bodies import PlanarTorque

DATA = lin_parker_set(3)
TEETH = {"sun": 28, "planet": 36, "ring": 101}


def errors(**parts):
    return TransmissionErrors(data=DATA, teeth=TEETH, **parts)


def test_sun_and_ring_by_hand():
    both = errors(sun=Eccentricity(10e-6, 0.3), ring=Eccentricity(20e-6, -0.7))
    assert both.bases == ("mesh", "sun", "ring")
    theta = np.random.default_rng(0).uniform(0, 9, (6, 3))
    alpha, beta = DATA.pressure_angle_sun_planet, DATA.pressure_angle_planet_ring
    found = both.series.at(theta)
    # the sun turns counter-clockwise in the carrier frame, the ring clockwise
    sun, ring = theta[:, 1:2] + 0.3, -theta[:, 2:3] - 0.7
    np.testing.assert_allclose(found[:, :3], 10e-6 * np.sin(DATA.planet_angles - alpha - sun), atol=1e-18)
    np.testing.assert_allclose(found[:, 3:], 20e-6 * np.sin(DATA.planet_angles + beta - ring), atol=1e-18)


def test_planets_act_on_both_of_their_meshes():
    one = errors(planet=Eccentricity([5e-6, 0.0, 0.0], 0.2))
    theta = np.array([[0.0, 1.1], [0.4, 2.5]])
    found, direction = one.series.at(theta), -theta[:, 1] + 0.2
    shift = np.zeros((2, len(gear_set_system(DATA).M)))
    shift[:, 9], shift[:, 10] = 5e-6 * np.cos(direction), 5e-6 * np.sin(direction)
    # the clockwise planet turns from its direction at phase zero, counter-clockwise from outwards
    np.testing.assert_allclose(found, -shift @ gear_set_system(DATA).W, atol=1e-18)


def test_frequencies_and_spectrum():
    full = errors(
        sun=Eccentricity(10e-6),
        planet=Eccentricity(4e-6),
        ring=Eccentricity(8e-6),
        tooth=tooth_lines([3e-6, 1e-6], [2e-6], np.arange(6) / 6),
    )
    mesh = 28.0 * 36.0 * 101.0
    frequency = full.frequency(mesh)
    np.testing.assert_allclose(frequency, [mesh, 36.0 * 101.0, 28.0 * 101.0, 28.0 * 36.0])
    line, amplitude = series_spectrum(full.series, frequency)
    np.testing.assert_allclose(line, [0.0, 1008.0, 2828.0, 3636.0, mesh, 2.0 * mesh])
    np.testing.assert_allclose(np.abs(amplitude[0]), [0, 0, 4e-6, 10e-6, 3e-6, 1e-6], atol=1e-18)
    np.testing.assert_allclose(np.abs(amplitude[3]), [0, 8e-6, 4e-6, 0, 2e-6, 0], atol=1e-18)
    assert np.angle(amplitude[1, 4]) == pytest.approx(2 * np.pi / 6)


def slow_response(support, amplitude=10e-6):
    """Sun centre and mesh deflections at a crawl, torque on the sun."""
    data = replace(DATA, sun=replace(DATA.sun, support=support))
    eccentric = TransmissionErrors(data=data, teeth=TEETH, sun=Eccentricity(amplitude))
    meshes = mesh_elements(data, separates=False)
    problem = gear_set_problem(data, meshes=meshes, torque=PlanarTorque(300.0), damping=0.02)
    problem = with_errors(problem, eccentric)
    frequency = eccentric.frequency(27.0)
    orders = eccentric.lines(mesh=1)
    found = solve_harmonic_balance(problem, frequency, orders=orders, stability=False)
    place = int(np.flatnonzero(np.all(orders == [0, 1], axis=1))[0])
    return displacements(problem, found)[6:8, place], found.force[:, place]


def test_a_floating_sun_follows_its_own_eccentricity():
    centre, force = slow_response(1e3)
    # x = -E cos, y = -E sin: the teeth stay in the middle and the meshes feel nothing
    np.testing.assert_allclose(centre, [-10e-6, 10e-6j], rtol=1e-4)
    _, held = slow_response(1e12)
    assert np.abs(force).max() < 1e-3 * np.abs(held).min()
    assert np.abs(held[:3]).min() > 90.0


def test_dampers_act_on_the_rate_less_the_error():
    # a floating body: coordinates of the axis and of the teeth differ by the eccentricity alone
    both = errors(tooth=tooth_lines([4e-6, 0.0], [2e-6, 1e-6], np.arange(6) / 7))
    dampers = planar_mesh_dampers(DATA, 0.04)
    C = equivalent_damping(DATA, mesh_ratio=0.04, support_ratio=0.03)
    meshes = mesh_elements(DATA, separates=False)
    plain = gear_set_problem(DATA, meshes=meshes, torque=PlanarTorque(300.0), damping=C)
    omega = 2 * np.pi * 1500.0
    problem = with_errors(plain, both, dampers=dampers, mesh_frequency=omega)
    found = solve_harmonic_balance(problem, omega, harmonics=3, stability=False)
    lines = displacements(problem, found)
    for h in (1, 2):
        e = both.tooth[:, h - 1]
        W, k = plain.system.W, DATA.mesh_stiffness
        dynamic = plain.system.K + (W * k) @ W.T - (h * omega) ** 2 * plain.system.M + 1j * h * omega * C
        expected = np.linalg.solve(dynamic, W @ ((k + 1j * h * omega * dampers) * e))
        np.testing.assert_allclose(lines[:, h], expected, atol=1e-9 * np.abs(expected).max())


def test_two_bases_against_integration():
    # few teeth, so that both repeat soon, but no two lines coincide; light torque, so that teeth part
    eccentric = TransmissionErrors(
        data=DATA,
        teeth={"sun": 7, "planet": 9, "ring": 25},
        sun=Eccentricity(9e-6),
        tooth=tooth_lines([2e-6], [1e-6], np.arange(6) / 3),
    )
    meshes = mesh_elements(DATA, backlash=40e-6)
    problem = gear_set_problem(DATA, meshes=meshes, torque=PlanarTorque(12.0), damping=0.08)
    problem, frequency = with_errors(problem, eccentric), eccentric.frequency(2 * np.pi * 2200.0)
    orders = eccentric.lines(mesh=6, member=3, bands=3)
    found = solve_harmonic_balance(problem, frequency, orders=orders, stability=False)
    period = 2.0 * np.pi / frequency[1]
    times = np.concatenate([[0.0], 12 * period + np.linspace(0.0, period, 60, endpoint=False)])
    run = solve_transient(problem, frequency, times, step=period / 700)
    expected, x = found.at(times[1:]), run.deflection[1:]
    assert (run.force[1:].min(axis=0) <= 0.0).any(), "teeth part"
    assert np.abs(x - expected).max() < 0.02 * np.ptp(x, axis=0).max()


def test_carrier_eccentricity_stands_still_in_its_frame():
    pins = carrier_pins(DATA, 7e-6, 0.5)
    angle = DATA.planet_angles
    x = pins[:, 0] * np.cos(angle) - pins[:, 1] * np.sin(angle)
    y = pins[:, 0] * np.sin(angle) + pins[:, 1] * np.cos(angle)
    np.testing.assert_allclose(x, 7e-6 * np.cos(0.5))
    np.testing.assert_allclose(y, 7e-6 * np.sin(0.5))


@pytest.mark.parametrize(
    "parts, code",
    [
        ({"sun": Eccentricity(-1e-6)}, "E-RANGE"),
        ({"sun": Eccentricity([1e-6, 2e-6])}, "E-RANGE"),
        ({"planet": Eccentricity([1e-6, 2e-6])}, "E-RANGE"),
        ({"tooth": np.zeros((5, 2))}, "E-SHAPE"),
        ({"flank": 0}, "E-RANGE"),
        ({"sun": 1e-5}, "E-RANGE"),
        ({"sun": Eccentricity("much")}, "E-RANGE"),
    ],
)
def test_wrong_errors_are_refused(parts, code):
    with pytest.raises(CaseError) as caught:
        errors(**parts)
    assert caught.value.code == code


@pytest.mark.parametrize(
    "teeth, code",
    [((12, 99, 7), "E-TEETH"), ((28.5, 36, 101), "E-RANGE"), ((28, 36, 110), "E-TEETH")],
)
def test_teeth_of_another_set_are_refused(teeth, code):
    with pytest.raises(CaseError) as caught:
        TransmissionErrors(data=DATA, teeth=dict(zip(("sun", "planet", "ring"), teeth)))
    assert caught.value.code == code


@pytest.mark.parametrize("phases", [np.zeros(5), [], [0.0, np.nan], ["a", "b"]])
def test_phases_that_are_no_pairs_are_refused(phases):
    with pytest.raises(CaseError, match="E-SHAPE"):
        tooth_lines([1e-6], [1e-6], phases)


def test_problems_that_cannot_take_errors_are_refused():
    meshes = mesh_elements(DATA, backlash=40e-6)
    wedging = gear_set_problem(DATA, meshes=meshes, torque=PlanarTorque(60.0), back_flanks=True)
    with pytest.raises(CaseError, match="E-RANGE"):
        with_errors(wedging, errors(sun=Eccentricity(1e-6)))
    plain = gear_set_problem(DATA, meshes=meshes, torque=PlanarTorque(60.0))
    with pytest.raises(CaseError, match="E-RANGE"):
        with_errors(plain, errors(sun=Eccentricity(1e-6)), dampers=np.ones(6))
