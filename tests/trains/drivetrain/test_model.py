"""The drivetrain against its torsional counterpart, the planar set, closed forms and other integrators."""

import math
from dataclasses import replace

import numpy as np
import pytest
from drivetrain_references import planetary_stage, torsional_matrices
from published.wind_turbine_drivetrain import (
    PRINTED,
    RADII_TEETH,
    line_teeth,
    ratio_of_radii,
    wind_turbine_drivetrain,
)
from scipy.linalg import eigh

from femgear.errors import CaseError
from femgear.solvers.linear.modal import undamped_modes
from femgear.system.fourier import FourierSeries
from femgear.system.mesh_directions import gear_set_system
from femgear.trains.drivetrain.kinematics import planar_of
from femgear.trains.drivetrain.model import (
    drivetrain_model,
    rectangular_series,
    torsional_model,
)
from femgear.trains.drivetrain.parts import (
    BearingSection,
    BodySection,
    Drivetrain,
    MeshSection,
    ShaftSection,
)
from femgear.trains.drivetrain.simulation import Records, march_drivetrain

TRAIN = wind_turbine_drivetrain()
SHORT_CUT = ShaftSection.in_si(between=("rotor", "generator"), length=3.0, bending=1e6, torsion=1e6)


def test_36_coordinates_by_body():
    model = drivetrain_model(TRAIN)
    count = {}
    for name in model.system.dofs:
        body = name.split(":")[0]
        body = "planets" if body.startswith("planet ") else body
        count[body] = count.get(body, 0) + 1
    assert count == {
        "rotor": 5,
        "carrier": 5,
        "planets": 3,
        "sun": 5,
        "gear 1": 5,
        "gear 2": 3,
        "gear 3": 5,
        "generator": 5,
    }
    # one free spin, and it strains nothing
    modes = undamped_modes(model.still, model.mean_stiffness)
    assert np.count_nonzero(modes.frequency < 1e-6) == 1
    assert np.abs(model.geometry.basic.T @ model.rigid).max() < 1e-12


def test_speeds_and_ratio():
    model = drivetrain_model(TRAIN)
    assert ratio_of_radii() == pytest.approx((1 + 430 / 110) * (290 / 95) * (185 / 80), rel=1e-14)
    assert round(ratio_of_radii(), 3) == PRINTED.ratio
    assert model.ratio["generator"] == pytest.approx(ratio_of_radii(), rel=1e-12)
    assert model.ratio["gear 2"] == pytest.approx(-(1 + 430 / 110) * 290 / 95, rel=1e-12)
    # planets turn backwards: r_p (p - c) = -r_r c
    planet = model.rigid[model.index("planet 2: rotation")]
    assert planet == pytest.approx(1.0 - 430 / 160, rel=1e-12)


def test_teeth_and_mesh_lines():
    teeth = line_teeth()
    assert teeth.assembles and RADII_TEETH.assembles
    assert np.abs(teeth.mismatch()).max() < 0.005
    assert teeth.ratio == pytest.approx(PRINTED.ratio, rel=0.005)
    # radii of one module within each stage, rounded as the paper prints them
    for module, numbers, radii in (
        (2 * 430 / 184, (184, 47), (430, 110)),
        (4.5, (128, 42), (290, 95)),
        (4.3, (86, 37), (185, 80)),
    ):
        assert all(abs(0.5 * module * z - r) < 2.5 for z, r in zip(numbers, radii))
    assert RADII_TEETH.ratio == pytest.approx(PRINTED.ratio, rel=1e-5)
    model = drivetrain_model(TRAIN)
    hertz = model.frequencies(PRINTED.speed) / (2 * np.pi)
    assert hertz == pytest.approx([0.1, *teeth.lines()], rel=1e-12)


def test_rectangular_stiffness_against_its_closed_form():
    """Contact ratio 1.635, stiffness 1 or 0.65: mean 0.87225 and harmonics of the rectangle."""
    wave = MeshSection.in_si(stiffness=0.87225, contact_ratio=1.635, low_share=0.65)
    assert wave.levels[:2] == pytest.approx((0.65, 1.0), rel=1e-12)
    lines = rectangular_series(wave, 15)
    wanted = (0.87225, 0.2030760713, -0.0835687122, -0.0218390532, 0.0552649850)
    assert np.abs(lines[:5] - wanted).max() < 1e-8
    # the coefficients from the wave itself, by exact integration of every piece
    h = np.arange(1, 16)
    edges = np.array([-0.5, -0.3175, 0.3175, 0.5])
    waves = np.exp(-2j * np.pi * h[:, None] * edges) / (-2j * np.pi * h[:, None])
    integral = 2.0 * (np.diff(waves, axis=1) @ np.array([0.65, 1.0, 0.65]))
    assert np.abs(lines[1:] - integral).max() < 1e-12
    ahead = rectangular_series(wave.changed(phase=0.2), 15)
    assert np.abs(ahead[1:] - lines[1:] * np.exp(2j * np.pi * h * 0.2)).max() < 1e-14


def gibbs_overshoot(wave, harmonics):
    """Largest overshoot of the cut series beyond the upper stiffness, over the jump, on a fine grid."""
    low, high, _ = wave.levels
    phase = np.linspace(0.0, 2.0 * np.pi, 400 * harmonics + 1)[:, None]
    return (FourierSeries(rectangular_series(wave, harmonics)).at(phase).max() - high) / (high - low)


def test_gibbs_overshoot_of_a_long_series():
    """Si(pi) / pi - 1 / 2 of the jump, for a single edge far from the next; J. W. Gibbs, Nature 59, 1899."""
    wave = MeshSection.in_si(stiffness=1.0, contact_ratio=1.5)
    assert gibbs_overshoot(wave, 15) == pytest.approx(0.0895, abs=0.006)
    assert gibbs_overshoot(wave, 101) == pytest.approx(0.08949, abs=5e-4)


def test_held_axes_leave_the_torsional_model():
    model = torsional_model(TRAIN)
    M, K, W, names = torsional_matrices(TRAIN)
    assert model.system.dofs == names
    for ours, wanted in ((model.system.M, M), (model.system.K, K), (model.system.W, W)):
        assert np.abs(ours - wanted).max() <= 1e-12 * np.abs(wanted).max()


def test_stiff_bearings_tend_to_the_torsional_model():
    M, K, W, _ = torsional_matrices(TRAIN)
    errors = []
    for stiff in (1e13, 1e14):
        bearings = tuple(
            BearingSection.in_si(body=b.name, radial=stiff, tilt=stiff if b.tilts else 0.0) for b in TRAIN.bodies
        )
        model = drivetrain_model(replace(TRAIN, bearings=bearings, damping_ratio=0.0))
        k, system = model.mean_stiffness, model.system
        wanted = eigh(K + (W * k) @ W.T, M, eigvals_only=True)[1:]
        # the modes of the bearings lie above the first five of torsion; the lowest suffers from rounding
        ours = eigh(system.K + (system.W * k) @ system.W.T, system.M, eigvals_only=True)[1:6]
        errors.append(np.abs(ours / wanted[:5] - 1.0)[1:].max())
    assert errors[0] < 1e-4 and errors[1] == pytest.approx(0.1 * errors[0], rel=0.1)


def test_one_planetary_stage_is_the_planar_model():
    for bearing, turning in ((math.inf, True), (2e8, False)):
        train = planetary_stage(planet_bearing=bearing)
        model = drivetrain_model(train, turning=turning)
        lumped = planar_of(train, train.planetary[0])
        lumped = replace(
            lumped,
            carrier=replace(lumped.carrier, support=2e8),
            sun=replace(lumped.sun, support=3e7),
        )
        k = model.mean_stiffness
        ours, theirs = (
            undamped_modes(model.still, k),
            undamped_modes(gear_set_system(lumped), lumped.mesh_stiffness),
        )
        assert ours.frequency[1:] == pytest.approx(theirs.frequency[1:], rel=1e-9)
        strain = [np.sort((m.mesh_deflection**2).sum(axis=0))[2:] for m in (ours, theirs)]
        assert strain[0] == pytest.approx(strain[1], rel=1e-8)


def test_turning_directions_against_the_carrier_frame():
    """A free vibration in the fixed frame, with meshes that turn, is that of the set in the carrier's frame.

    The frame adds ``2 Omega`` gyroscopic and ``Omega^2`` centripetal terms (Lin and Parker), and the
    planets' pins turn.
    """
    speed = 40.0
    train = planetary_stage()
    model = drivetrain_model(train, harmonics=0)
    lumped = planar_of(train, train.planetary[0])
    lumped = replace(lumped, carrier=replace(lumped.carrier, support=2e8), sun=replace(lumped.sun, support=3e7))
    system = gear_set_system(lumped, carrier_speed=speed)
    # x, y of carrier and sun, then rotations: u = r theta
    start = np.zeros(len(model.rigid))
    start[model.index("sun: x")] = 1e-5
    times = np.linspace(0.0, 0.05, 101)
    run = march_drivetrain(
        model,
        (),
        duration=0.05,
        step=2.5e-6,
        records=Records(200),
        speed=speed,
        start=(start, 0.0 * start),
        outputs=("sun: x", "sun: y", "carrier: x"),
    )
    from scipy.linalg import expm

    n = len(system.M)
    total = system.K + (system.W * lumped.mesh_stiffness) @ system.W.T
    A = np.zeros((2 * n, 2 * n))
    A[:n, n:] = np.eye(n)
    A[n:, :n] = -np.linalg.solve(system.M, total)
    A[n:, n:] = -np.linalg.solve(system.M, speed * system.gyroscopic)
    y = np.zeros(2 * n)
    at = system.dofs.index("sun: x")
    # at rest in the fixed frame: x' = -Omega z cross x in the turning one
    y[at], y[n + at + 1] = 1e-5, -speed * 1e-5
    states = np.array([expm(A * t) @ y for t in times])
    cosine, sine = np.cos(speed * times), np.sin(speed * times)
    sun_x = cosine * states[:, at] - sine * states[:, at + 1]
    sun_y = sine * states[:, at] + cosine * states[:, at + 1]
    error = np.abs(run.motion[:, :2] - np.stack([sun_x, sun_y], axis=1)).max()
    assert np.ptp(run.motion[:, 0]) > 1e-5
    assert error < 2e-4 * 1e-5


def test_beam_shafts_tend_to_the_joint_of_springs():
    section = {"outer_diameter": 0.16, "inner_diameter": 0.05, "density": 0.0}
    ends = (
        BodySection.in_si(name="one", mass=40.0, inertia=0.5, transverse_inertia=0.3),
        BodySection.in_si(name="two", mass=60.0, inertia=0.9, transverse_inertia=0.5),
    )
    bearings = (
        BearingSection.in_si(body="one", radial=1e7, tilt=1e5),
        BearingSection.in_si(body="two", radial=2e7, tilt=1e5),
    )
    joint = drivetrain_model(
        Drivetrain(ends, (ShaftSection.in_si(between=("one", "two"), length=0.6, **section),), (), (), bearings)
    )
    beam = drivetrain_model(
        Drivetrain(
            ends,
            (ShaftSection.in_si(between=("one", "two"), length=0.6, elements=1, **section),),
            (),
            (),
            bearings,
        )
    )
    assert np.abs(joint.system.K - beam.system.K).max() < 1e-9 * np.abs(joint.system.K).max()
    heavy = section | {"density": 7850.0}
    train = Drivetrain(
        ends,
        (ShaftSection.in_si(between=("one", "two"), length=0.6, elements=8, **heavy),),
        (),
        (),
        bearings,
    )
    K = drivetrain_model(train).system.K
    assert len(K) == 10 + 35 and np.abs(K - K.T).max() == 0.0


def test_rigid_joints_leave_fewer_coordinates():
    shafts = tuple(s.changed(bending=math.inf, torsion=math.inf, shear=math.inf) for s in TRAIN.shafts)
    rigid = drivetrain_model(replace(TRAIN, shafts=shafts, damping_ratio=0.0))
    assert len(rigid.rigid) == 36 - 15
    stiff = tuple(s.changed(bending=1e11, torsion=1e11, shear=1e12) for s in TRAIN.shafts)
    near = drivetrain_model(replace(TRAIN, shafts=stiff, damping_ratio=0.0))
    ours, wanted = (undamped_modes(m.still, m.mean_stiffness).frequency[1:13] for m in (rigid, near))
    assert ours == pytest.approx(wanted, rel=5e-3)


def test_spherical_joint_of_the_paper_ties_displacements_only():
    shafts = tuple(s.changed(shear=math.inf) for s in TRAIN.shafts)
    assert len(drivetrain_model(replace(TRAIN, shafts=shafts)).rigid) == 36 - 6


def test_tilted_and_helical_mesh_by_virtual_work():
    """Force and moments of a mesh from its point and normal: power balance of every rigid motion."""
    stage = TRAIN.parallel[0].changed(helix_angle=0.3, direction=0.7, offsets=(0.05, -0.02))
    model = drivetrain_model(replace(TRAIN, parallel=(stage, TRAIN.parallel[1]), damping_ratio=0.0))
    w = model.system.W[:, model.meshes.index("gear 1-gear 2")]
    part = {a: w[model.index(f"gear 1: {a}")] for a in ("x", "y", "tilt x", "tilt y", "rotation")}
    lean = math.tan(0.3) * math.cos(stage.pressure_angle)
    normal = np.array([part["x"], part["y"], lean / math.hypot(1.0, lean)])
    assert np.linalg.norm(normal) == pytest.approx(1.0, rel=1e-12)
    arm = np.array([0.29 * math.cos(0.7), 0.29 * math.sin(0.7), 0.05])
    assert [part["tilt x"], part["tilt y"], part["rotation"]] == pytest.approx(np.cross(arm, normal), abs=1e-12)
    # radial share: sin of the pressure angle, towards the second gear
    assert normal @ np.append(arm[:2] / 0.29, 0.0) * math.hypot(1.0, lean) == pytest.approx(
        math.sin(stage.pressure_angle), rel=1e-12
    )


@pytest.mark.parametrize(
    ("make", "code"),
    [
        (lambda: drivetrain_model(replace(TRAIN, shafts=TRAIN.shafts[1:])), "E-DRIVETRAIN"),
        (lambda: drivetrain_model(planetary_stage(planet_angles=(0.0, 2.0, 4.0))), "E-TURNING"),
        (lambda: drivetrain_model(planetary_stage(planet_bearing=1e8)), "E-TURNING"),
        (lambda: drivetrain_model(replace(TRAIN, shafts=(*TRAIN.shafts, SHORT_CUT))), "E-DRIVETRAIN"),
        (lambda: march_drivetrain(drivetrain_model(TRAIN), (), duration=1.0, step=2.0, speed=0.6), "E-RANGE"),
    ],
)
def test_refusals(make, code):
    with pytest.raises(CaseError, match=code):
        make()


def test_parts_made_in_python_have_all_their_entries_and_no_others():
    assert TRAIN.bodies[0].changed(mass=1.0).mass == 1.0 and TRAIN.bodies[0].mass > 1.0
    with pytest.raises(TypeError, match="missing or unknown inertia, weight"):
        BodySection.in_si(name="a", mass=1.0, weight=9.8)
