"""Places of the bodies in space, and how they move."""

import numpy as np
import pytest
from published.wind_turbine_drivetrain import PRINTED, wind_turbine_drivetrain

from femgear.trains.drivetrain.mode_pictures import beam_shape, drivetrain_layout, layout_motion, shaft_centre_lines
from femgear.trains.drivetrain.model import drivetrain_model
from femgear.trains.drivetrain.parts import BearingSection, BodySection, Drivetrain, ShaftSection

TRAIN = wind_turbine_drivetrain()
MODEL, LAYOUT = drivetrain_model(TRAIN), drivetrain_layout(TRAIN)


def place(name):
    return LAYOUT.centre[LAYOUT.names.index(name)]


def test_axes_stand_a_centre_distance_apart():
    assert np.hypot(*(place("gear 2") - place("gear 1"))[:2]) == pytest.approx(0.290 + 0.095)
    assert np.hypot(*(place("gear 3") - place("gear 2"))[:2]) == pytest.approx(0.185 + 0.080)
    assert np.linalg.norm(place("planet 2") - place("carrier")) == pytest.approx(PRINTED.carrier_radius)
    assert place("carrier")[2] - place("rotor")[2] == pytest.approx(2.0)
    assert len(LAYOUT.names) == len(TRAIN.bodies) + 3 and len(LAYOUT.shafts) == 3


def test_spin_turns_every_body_about_its_own_axis():
    move, turn = layout_motion(MODEL, LAYOUT, MODEL.rigid)
    fixed = [LAYOUT.names.index(body.name) for body in TRAIN.bodies]
    assert np.abs(move[fixed]).max() < 1e-12
    assert turn[LAYOUT.names.index("generator")] == pytest.approx([0.0, 0.0, MODEL.ratio["generator"]])
    # pins move with the carrier; at the pitch points planets and sun have one speed
    for p in (1, 2, 3):
        at = LAYOUT.names.index(f"planet {p}")
        arm = LAYOUT.centre[at] - place("carrier")
        assert move[at] == pytest.approx(np.cross([0.0, 0.0, 1.0], arm), abs=1e-12)
        unit = arm / np.linalg.norm(arm)
        planet = move[at] + np.cross(turn[at], -PRINTED.planet_radius * unit)
        sun = np.cross([0.0, 0.0, MODEL.ratio["sun"]], PRINTED.sun_radius * unit)
        assert planet == pytest.approx(sun, abs=1e-12)
        ring = move[at] + np.cross(turn[at], PRINTED.planet_radius * unit)
        assert np.abs(ring).max() < 1e-12


def test_tilting_carrier_takes_the_planets_along():
    shape = np.zeros(len(MODEL.rigid))
    shape[MODEL.index("carrier: tilt x")] = 1.0
    move, turn = layout_motion(MODEL, LAYOUT, shape)
    for p in (1, 2, 3):
        at = LAYOUT.names.index(f"planet {p}")
        arm = LAYOUT.centre[at] - place("carrier")
        assert move[at] == pytest.approx([0.0, 0.0, arm[1]]) and turn[at, 0] == 1.0


DIAMETER, LENGTH, ELEMENTS = 0.07, 0.6, 3


def shaft_of(**options):
    """Two bodies on a shaft, and its layout."""
    train = Drivetrain(
        (
            BodySection.in_si(name="a", mass=1.0, inertia=1.0, transverse_inertia=1.0),
            BodySection.in_si(name="b", mass=1.0, inertia=1.0, transverse_inertia=1.0),
        ),
        shafts=(ShaftSection.in_si(between=("a", "b"), length=LENGTH, **options),),
        bearings=tuple(BearingSection.in_si(body=name, radial=1e8, tilt=1e6) for name in "ab"),
    )
    return drivetrain_model(train), drivetrain_layout(train)


def moved(model, layout, deflection, slope):
    """Line of the shaft with stations on a deflection x(z) and y(z) = -2 x(z): shares, displacements."""
    shape = np.zeros(len(model.rigid))
    stations = {"a": 0.0, "b": LENGTH}
    stations |= {f"shaft a-b {i}": i * LENGTH / ELEMENTS for i in range(1, ELEMENTS)}
    for name, z in stations.items():
        if f"{name}: x" in model.system.dofs:
            values = {
                "x": deflection(z),
                "tilt y": slope(z),
                "y": -2.0 * deflection(z),
                "tilt x": 2.0 * slope(z),
            }
            for axis, value in values.items():
                shape[model.index(f"{name}: {axis}")] = value
    ((rest, across),) = shaft_centre_lines(model, layout, shape)
    assert not across[:, 2].any() and np.allclose(across[:, 1], -2.0 * across[:, 0])
    return rest[:, 2] - layout.centre[0, 2], across[:, 0]


@pytest.mark.parametrize("shear_ratio", [0.0, 0.7])
def test_beam_between_stations_is_a_cantilever(shear_ratio):
    """Tip force: w = F z^2 (3 l - z) / (6 E I) + F z / (kappa G A), turned by F z (2 l - z) / (2 E I)."""
    l, bending = 0.4, 3.0
    shear = 12.0 * bending / (shear_ratio * l**2) if shear_ratio else np.inf
    z = np.linspace(0.0, l, 11)
    w = z**2 * (3.0 * l - z) / (6.0 * bending) + z / shear
    tip = np.array([0.0, 0.0, w[-1], l**2 / (2.0 * bending)])
    assert beam_shape(z / l, l, shear_ratio) @ tip == pytest.approx(w, rel=1e-12)


def test_beams_bend_through_their_stations():
    model, layout = shaft_of(outer_diameter=DIAMETER, elements=ELEMENTS)
    # pure bending: a parabola, which a joint in the middle does not have
    z, x = moved(model, layout, lambda z: 0.5 * z**2, lambda z: z)
    assert len(z) > 4 * ELEMENTS and z[-1] == pytest.approx(LENGTH)
    assert x == pytest.approx(0.5 * z**2, abs=1e-14)
    z, x = moved(model, layout, lambda z: 0.2 + 3.0 * z, lambda z: 3.0)
    assert x == pytest.approx(0.2 + 3.0 * z)


@pytest.mark.parametrize(
    "options",
    [
        {"outer_diameter": DIAMETER},
        {"bending": 2e5, "torsion": 1e5, "shear_ratio": 0.7},
        {"bending": 2e5, "torsion": 1e5, "shear": np.inf},
        {"bending": 2e5, "torsion": 1e5, "shear": 1e4},
        {"bending": np.inf, "torsion": 1e5, "shear": 1e8},
    ],
)
def test_joints_are_drawn_as_the_beams_that_they_stand_for(options):
    """Pure bending is a parabola, a rigid motion a straight line, and no shaft has a kink."""
    model, layout = shaft_of(**options)
    if np.inf not in options.values():  # rigid springs leave the second end fewer coordinates
        z, x = moved(model, layout, lambda z: 0.5 * z**2, lambda z: z)
        assert x == pytest.approx(0.5 * z**2, abs=1e-14)
        z, x = moved(model, layout, lambda z: 0.2 + 3.0 * z, lambda z: 3.0)
        assert len(z) > 8 and x == pytest.approx(0.2 + 3.0 * z)
    # any motion of the ends: slopes along the shaft change little by little
    shape = np.random.default_rng(5).standard_normal(len(model.rigid))
    ((rest, across),) = shaft_centre_lines(model, layout, shape, points=64)
    slope = np.diff(across[:, :2], axis=0) / np.diff(rest[:, 2])[:, None]
    assert np.isfinite(slope).all()
    assert np.abs(np.diff(slope, axis=0)).max() < 0.1 * np.abs(slope).max()


def test_joint_with_shear_follows_the_loaded_cantilever():
    """Tip force on a joint of this Phi: the drawn line is the Timoshenko cantilever, not two links."""
    l, phi = LENGTH, 0.7
    model, layout = shaft_of(bending=2e5, torsion=1e5, shear_ratio=phi)
    EI = 2e5 * l
    shear = 12.0 * EI / (phi * l**2)

    def deflection(z):
        return z**2 * (3.0 * l - z) / (6.0 * EI) + z / shear

    z, x = moved(model, layout, deflection, lambda z: z * (2.0 * l - z) / (2.0 * EI))
    assert x == pytest.approx(deflection(z), rel=1e-9, abs=1e-18)
