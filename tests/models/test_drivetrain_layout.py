"""Places of the bodies in space, and how they move."""

import numpy as np
import pytest

from femgear.models.drivetrain import drivetrain_model
from femgear.models.drivetrain_layout import drivetrain_layout, layout_motion
from femgear.models.wind_turbine_drivetrain import PRINTED, wind_turbine_drivetrain

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
