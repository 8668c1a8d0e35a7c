"""Lines of the settled motion: search, remainder, limits; integration, Mathieu's equation as references."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from published.wind_turbine_drivetrain import PRINTED, paper_torques, wind_turbine_drivetrain
from scipy.optimize import brentq
from scipy.special import mathieu_a

from femgear.errors import CaseError, ConvergenceError
from femgear.solvers.linear.modal import solve_modes
from femgear.trains.drivetrain.data import ChainBody, Drivetrain, MeshWave, ParallelStage, constant_torques
from femgear.trains.drivetrain.model import balanced_torque, drivetrain_model, torsional_model
from femgear.trains.drivetrain.multitone import (
    LineCodes,
    beside,
    drivetrain_lines,
    line_codes,
    mirrored_codes,
    settled_motion,
)
from femgear.trains.drivetrain.setup import case_model
from femgear.trains.drivetrain.time import march_drivetrain
from femgear.trains.reading import read_case

TRAIN = wind_turbine_drivetrain()


def two_stages(*, terms, damping=0.08, speed=3.8, **wave):
    """The parallel stages alone, in torsion; speed of gear 1 [rad/s]."""
    bodies = tuple(b for b in TRAIN.bodies if b.name in ("gear 1", "gear 2", "gear 3"))
    parallel = tuple(replace(p, mesh=replace(p.mesh, **wave)) for p in TRAIN.parallel)
    model = torsional_model(Drivetrain(bodies, parallel=parallel, damping_ratio=damping), harmonics=terms)
    return model, balanced_torque(model, "gear 1", 3000.0, "gear 3"), speed


def integrated(model, torques, speed, found, *, duration, rate):
    """Time and forces of a run from the state of the lines, the second half."""
    q = found.displacement.sum(axis=1).real
    v = (1j * found.line_frequency * found.displacement).sum(axis=1).real
    run = march_drivetrain(
        model, constant_torques(torques), duration=duration, step=1.0 / rate, every=round(rate / 20e3),
        speed=speed, start=(q, v), outputs=(),
    )  # fmt: skip
    late = run.time >= 0.5 * duration
    return run.time[late], run.force[late]


def rms(force, reference):
    return (force - reference).std(axis=0) / reference.std(axis=0)


def test_search_against_integration():
    """Two steps and Richardson's extrapolation take the error of average acceleration away."""
    model, torques, speed = two_stages(terms=4)
    found = settled_motion(model, torques, speed=speed, tolerance=3e-4)
    assert found.converged and found.remainder.max() < 3e-4
    time, coarse = integrated(model, torques, speed, found, duration=0.2, rate=80e3)
    fine = integrated(model, torques, speed, found, duration=0.2, rate=160e3)[1]
    assert rms(found.at(time)[1], fine + (fine - coarse) / 3.0).max() < 1e-3


def test_turbine_in_torsion_against_integration():
    """All 15 terms, with the stiff mesh near 2.2 kHz that a lattice made by hand misses."""
    model = torsional_model(TRAIN)
    torques, speed = paper_torques(balanced=True), PRINTED.speed
    found = settled_motion(model, torques, speed=speed)
    time, force = integrated(model, torques, speed, found, duration=0.2, rate=160e3)
    error = rms(found.at(time)[1], force)
    assert found.converged and error.max() < 0.015
    by_hand = drivetrain_lines(model, harmonics=30, bands=0)
    assert settled_motion(model, torques, speed=speed, orders=by_hand).remainder.max() > 0.2


def test_stiff_meshes_that_hardly_alternate_against_integration():
    """The motion gives way to the varying stiffness by many lines; the forces need few."""
    case = read_case(Path(__file__).parents[2] / "cases" / "grc_like_drivetrain.toml")
    model, speed = case_model(case), case.operation.speed
    torques = balanced_torque(model, "rotor", 300e3, "generator")
    found = settled_motion(model, torques, speed=speed)
    time, force = integrated(model, torques, speed, found, duration=0.2, rate=100e3)
    # most of the planets' alternating force has the period of the carrier's turn, longer than this run
    alternating = np.sqrt(0.5 * (np.abs(found.force[:, 1:]) ** 2).sum(axis=1))
    error = np.sqrt(((found.at(time)[1] - force) ** 2).mean(axis=0)) / alternating
    assert found.converged and len(found.orders) < 600
    assert error.max() < 0.015


def test_stiffness_without_a_series_of_its_compliance_is_refused():
    stages = tuple(replace(p, mesh=replace(p.mesh, low_share=1e-6)) for p in TRAIN.parallel)
    bodies = tuple(b for b in TRAIN.bodies if b.name in ("gear 1", "gear 2", "gear 3"))
    model = torsional_model(Drivetrain(bodies, parallel=stages, damping_ratio=0.05), harmonics=5)
    with pytest.raises(CaseError) as error:
        settled_motion(model, balanced_torque(model, "gear 1", 3000.0, "gear 3"), speed=3.8)
    assert error.value.code == "E-STIFFNESS" and "gear 1-gear 2" in str(error.value)


def test_search_against_a_lattice_that_is_complete():
    model, torques, speed = two_stages(terms=3)
    lines = drivetrain_lines(model, harmonics=40, mixed=20)
    whole = settled_motion(model, torques, speed=speed, orders=lines)
    found = settled_motion(model, torques, speed=speed, tolerance=1e-4)
    times = np.linspace(0.0, 0.5, 3000)
    assert whole.remainder.max() < 1e-4 and whole.rounds == 1
    assert rms(found.at(times)[1], whole.at(times)[1]).max() < 2e-4
    assert len(found.orders) < len(lines)


def test_one_varying_mesh_needs_its_harmonics_alone():
    stages = tuple(
        replace(p, mesh=replace(p.mesh, contact_ratio=ratio)) for p, ratio in zip(TRAIN.parallel, (1.78, 2.0))
    )
    bodies = tuple(b for b in TRAIN.bodies if b.name in ("gear 1", "gear 2", "gear 3"))
    model = torsional_model(Drivetrain(bodies, parallel=stages, damping_ratio=0.05), harmonics=5)
    torques = balanced_torque(model, "gear 1", 3000.0, "gear 3")
    found = settled_motion(model, torques, speed=3.8, tolerance=1e-5)
    assert not found.orders[:, 1].any()
    orders = np.arange(80)[:, None] * [1, 0]
    whole = settled_motion(model, torques, speed=3.8, orders=orders)
    times = np.linspace(0.0, 0.1, 2000)
    assert rms(found.at(times)[1], whole.at(times)[1]).max() < 2e-5


@pytest.mark.parametrize("tolerance", [0.1, 0.02, 3e-3])
def test_remainder_tells_the_error(tolerance):
    model, torques, speed = two_stages(terms=8, damping=0.03)
    exact = settled_motion(model, torques, speed=speed, tolerance=1e-5)
    found = settled_motion(model, torques, speed=speed, tolerance=tolerance)
    times = np.linspace(0.0, 1.0, 8000)
    error = rms(found.at(times)[1], exact.at(times)[1])
    assert found.remainder.max() <= tolerance and found.feedback.max() <= 3.0 * tolerance
    bound = np.hypot(found.remainder, found.feedback).max()
    assert 0.2 * bound < error.max() < 1.5 * bound


def test_turning_directions_are_searched_too():
    """A planetary stage: bands of the turn are found, and more lines do not change the forces."""
    bodies = tuple(b for b in TRAIN.bodies if b.name in ("carrier", "sun"))
    held = tuple(b for b in TRAIN.bearings if b.body in ("carrier", "sun"))
    stage = replace(TRAIN.planetary[0], sun_mesh=replace(TRAIN.planetary[0].sun_mesh, phase=0.2))
    bodies = tuple(replace(b, tilts=False) for b in bodies)
    train = Drivetrain(bodies, planetary=(stage,), bearings=held, damping_ratio=0.05)
    model = drivetrain_model(train, harmonics=3)
    torques = balanced_torque(model, "carrier", 15000.0, "sun")
    found = settled_motion(model, torques, speed=1.0, tolerance=1e-4)
    lines = drivetrain_lines(model, harmonics=20, bands=5)
    whole = settled_motion(model, torques, speed=1.0, orders=lines)
    times = np.linspace(0.0, 2.0 * np.pi, 4000)
    assert np.abs(found.orders[:, 0]).max() >= 1
    assert rms(found.at(times)[1], whole.at(times)[1]).max() < 2e-4


def test_too_few_lines_are_told():
    model, torques, speed = two_stages(terms=8, damping=0.03)
    found = settled_motion(model, torques, speed=speed, tolerance=1e-3, max_lines=30)
    assert len(found.orders) == 30 and not found.converged and found.remainder.max() > 1e-3
    assert "max_lines is 30" in found.message and "gear" in found.message


def test_torques_on_the_other_flank_are_told():
    model, torques, speed = two_stages(terms=3)
    against = {body: -torque for body, torque in torques.items()}
    messages = [settled_motion(model, one, speed=speed).message for one in (torques, against)]
    assert "pull" not in messages[0] and "gear 1-gear 2, gear 2-gear 3 pull in the mean" in messages[1]


def test_mirror_images_of_given_lines():
    model, torques, speed = two_stages(terms=3)
    lines = drivetrain_lines(model, harmonics=6, mixed=3)
    found = settled_motion(model, torques, speed=speed, orders=lines)
    turned = settled_motion(
        model, torques, speed=speed, orders=lines * np.where(np.arange(len(lines)) % 2, -1, 1)[:, None]
    )
    times = np.linspace(0.0, 0.1, 50)
    assert np.allclose(found.at(times)[1], turned.at(times)[1], rtol=1e-9)
    assert np.allclose(found.motion[:, 1], turned.motion[:, 1].conj(), rtol=1e-8, atol=1e-16)


def one_mesh(damping=0.0):
    """Two bodies, ``x'' + omega_0^2 (1 + e cos(omega t)) x = constant`` for the approach of the flanks."""
    bodies = (ChainBody("motor", 1.0, 0.25, tilts=False), ChainBody("fan", 1.0, 18.0, tilts=False))
    wave = MeshWave(3e8, 1.68)
    stage = ParallelStage("motor", "fan", 0.0345, 0.1065, 23, wave)
    return torsional_model(Drivetrain(bodies, parallel=(stage,), damping_ratio=damping), harmonics=1)


def mathieu_border(model):
    """Speed where the equation has an even solution with the period of the stiffness (region of omega_0)."""
    natural = 2.0 * np.pi * solve_modes(model.still, model.mean_stiffness, damping_ratio=0.0).frequency.max()
    share = abs(model.stiffness[0, 1]) / model.mean_stiffness[0]
    # x'' + (a - 2 q cos 2 s) x = 0 with a = (2 omega_0 / omega)^2 and q = a e / 2
    a = brentq(lambda a: a - mathieu_a(2, 0.5 * a * share), 3.5, 8.0, xtol=1e-15, rtol=1e-15)
    return 2.0 * natural / np.sqrt(a) / model.base_ratio[0]


def test_border_of_a_parametric_resonance_is_singular():
    model = one_mesh()
    torques, speed = balanced_torque(model, "motor", 60.0, "fan"), mathieu_border(one_mesh())
    orders = np.arange(25)[:, None]
    with pytest.raises(ConvergenceError) as error:
        settled_motion(model, torques, speed=speed, orders=orders)
    assert error.value.code == "E-SINGULAR"
    # beside it the amplitude goes with one over the distance
    size = [
        np.abs(settled_motion(model, torques, speed=speed * (1.0 + d), orders=orders).motion[:, 1:]).max()
        for d in (1e-5, 1e-6)
    ]
    assert size[1] / size[0] == pytest.approx(10.0, rel=1e-2)
    assert settled_motion(one_mesh(0.05), torques, speed=speed).converged


@pytest.mark.parametrize(
    "options",
    [{"tolerance": v} for v in (0.0, -1e-3, 1.0, np.nan, np.inf, "1e-3", None, [1e-3])]
    + [{"max_lines": v} for v in (0, -5, np.nan, 1e9, "many")],
)
def test_nonsense_is_refused(options):
    model, torques, speed = two_stages(terms=2)
    with pytest.raises(CaseError) as error:
        settled_motion(model, torques, speed=speed, **options)
    assert error.value.code == "E-RANGE"


def test_orders_beyond_the_codes_are_refused():
    model, torques, speed = two_stages(terms=2)
    with pytest.raises(CaseError) as error:
        settled_motion(model, torques, speed=speed, orders=[[0, 0], [0, 1], [0, 2**30]])
    assert error.value.code == "E-LINES"
    six = replace(line_of_stages(6), gravity=0.0)
    with pytest.raises(CaseError) as error:
        line_codes(torsional_model(line_of_stages(9), harmonics=15))
    assert error.value.code == "E-LINES"
    assert np.all(line_codes(torsional_model(six, harmonics=15)).largest >= 15)


def line_of_stages(count):
    """Gears in a row, each with the next."""
    bodies = tuple(ChainBody(f"gear {n}", 1.0, 1.0, tilts=False) for n in range(count + 1))
    stages = tuple(
        ParallelStage(f"gear {n}", f"gear {n + 1}", 0.1, 0.1, 30, MeshWave(1e8, 1.6)) for n in range(count)
    )
    return Drivetrain(bodies, parallel=stages, damping_ratio=0.05)


def test_codes_of_lines():
    codes = LineCodes(np.array([7, 18, 18, 18]))
    rng = np.random.default_rng(3)
    orders = rng.integers(-16, 17, size=(400, 4)) * [1, 50, 50, 50]
    orders[0] = 0
    packed = orders @ codes.stride
    assert np.array_equal(codes.orders(packed), orders) and np.array_equal(codes.orders(-packed), -orders)
    assert np.array_equal(codes.orders(packed[:200] + packed[200:]), orders[:200] + orders[200:])
    lines = codes.of(orders)
    both = mirrored_codes(lines)
    assert np.all(np.diff(both) > 0) and np.array_equal(both, -both[::-1])
    wider = set(beside(lines, int(codes.stride[0])).tolist())
    assert {abs(c + s) for c in lines.tolist() for s in (-1, 0, 1)} <= wider
