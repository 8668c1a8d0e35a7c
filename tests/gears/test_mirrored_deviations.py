"""Deviations of the mirror image: what stands at the back flanks of the set, tooth by tooth."""

import math
from dataclasses import replace

import numpy as np
import pytest
from deviation_sets import ALPHA, UM, make_set

from femgear.contact.flank_pairs import tooth_numbers
from femgear.gears.deviations import (
    Ovality,
    Runout,
    body_separation,
    mirrored_deviations,
    no_deviations,
    tooth_separation,
)
from femgear.gears.kinematics import orientations
from femgear.gears.modifications import FlankForm, ProfileSlope
from femgear.gears.planetary import mirrored_set


def random_deviations(s, seed=3):
    rng, N = np.random.default_rng(seed), s.n_planets
    runouts = [Runout(*(rng.normal(size=2) * [3 * UM, 1.0])) for _ in range(N + 3)]
    return replace(
        no_deviations(s),
        sun_pitch=rng.normal(size=s.sun.teeth) * UM,
        planet_pitch=rng.normal(size=(N, s.planet.teeth)) * UM,
        planet_ring_side_pitch=rng.normal(size=(N, s.planet.teeth)) * UM,
        ring_pitch=rng.normal(size=s.ring.teeth) * UM,
        sun_runout=runouts[0],
        ring_runout=runouts[1],
        carrier_runout=runouts[2],
        planet_runout=tuple(runouts[3:]),
        pin_errors=rng.normal(size=(N, 2)) * 5 * UM,
        ovality=Ovality(2, 4 * UM, 0.6, inextensional=True),
        planet_thickness=rng.uniform(0, 5, N) * UM,
        planet_sun_side=FlankForm((ProfileSlope(3 * UM),)),
    )


@pytest.mark.parametrize(
    "s",
    [make_set((24, 30, 84), 4), make_set((24, 30, 84), 3, backlash=40 * UM), make_set(backlash=20 * UM)],
    ids=["4", "3 with play", "27/40/108"],
)
def test_mirrored_bodies_and_teeth_are_those_at_the_back(s):
    d = random_deviations(s)
    mirrored, order = mirrored_set(s)
    image = mirrored_deviations(d, s, mirrored, order)
    N, p_s = s.n_planets, s.sun.pitch_angle
    start = 2 * (s.planet_angles[0] - orientations(s).sun) / p_s
    mesh = np.concatenate([order, order + N])
    # at mirrored position t the sun stands as at start - t; the play shifts planets and ring a little
    tau = np.linspace(0, 5, 13)
    seen = body_separation(image, mirrored, tau)
    loose = replace(d, planet_thickness=np.zeros(N))
    back = body_separation(loose, s, start - tau, back=True)[mesh]
    half = 0.5 * (d.planet_thickness - d.planet_thickness.min())[order] * math.cos(ALPHA)
    # amplitudes of micrometres turned by play over radius
    assert np.allclose(seen - np.tile(half, 2)[:, None], back, atol=2e-8 if s.backlash_sun_planet > UM else 1e-16)
    # the teeth that meet in the image are the original ones whose back flanks stand there
    index = np.tile(np.arange(-2, 3), (2 * N, 1))
    one, two = tooth_numbers(mirrored, index)
    for j in range(2 * N):
        n = order[j % N]
        psi = s.planet_angles[n]
        for i, k, m in zip(index[j], one[j], two[j]):
            state = orientations(s, start + mirrored.mesh_phases[j] + i)
            gear, angle = (s.sun, state.sun) if j < N else (s.ring, state.ring)
            facing = psi + (np.pi if j < N else 0.0)
            # the right flanks of sun and ring stand at the pitch point: their centres a quarter pitch ahead
            tooth = round((psi - angle) / gear.pitch_angle + 0.25)
            # of the planet the right flank touches the sun, the left flank the ring
            ahead = 0.25 if j < N else -0.25
            of_planet = round((facing - state.planets[n]) / s.planet.pitch_angle + ahead)
            pair = (tooth, of_planet) if j < N else (of_planet, tooth)
            want = tooth_separation(d, mesh[j], *pair, back=True)
            assert tooth_separation(image, j, k, m) == pytest.approx(want, abs=1e-16)


def test_mirroring_twice_gives_the_set_back():
    s = make_set((24, 30, 84), 4)
    d = random_deviations(s)
    mirrored, order = mirrored_set(s)
    again, back = mirrored_set(mirrored)
    twice = mirrored_deviations(mirrored_deviations(d, s, mirrored, order), mirrored, again, back)
    tau = np.linspace(0, 3, 7)
    assert np.allclose(body_separation(twice, s, tau), body_separation(d, s, tau), atol=1e-17)
    for name in ("sun_pitch", "ring_pitch", "planet_pitch"):
        np.testing.assert_allclose(getattr(twice, name), getattr(d, name), rtol=1e-12)
    assert twice.planet_sun_side == d.planet_sun_side
