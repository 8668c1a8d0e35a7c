"""Thrust and tilting moments: the rule against the helical model's own mesh directions and pins."""

import numpy as np
import pytest
from phase_patterns import mesh_loads

from femgear.gears.phasing import mesh_phasing, phasing_table
from femgear.gears.planetary import equal_planet_angles, feasible_angles
from femgear.stages.lumped_set import gear_set_modes
from femgear.system.mesh_directions import gear_set_system, mesh_directions, pin_directions
from femgear.system.rigid_bodies import HelicalBody, HelicalSupport
from femgear.trains.helical.model import HelicalSet

HARMONICS = np.arange(1, 7)
KIND = {"rotational": "rotational-axial", "translational": "translational-tilting", "planet": "planet"}
SPACINGS = (
    (29, 70, 3, ()),
    (30, 70, 4, ()),
    (29, 71, 4, ()),
    (32, 68, 4, ()),
    (29, 71, 5, ()),
    (32, 70, 6, ()),
    (31, 70, 3, (0, 7, 0)),
    (30, 72, 4, (0, 8, 0, 8)),
    (30, 71, 5, (0, 4, -3, 2, 6)),
    (29, 72, 6, (0, 6, 3, 0, 6, 3)),
)
IDS = [f"{s}-{r}, {n}{', unequal' if o else ''}" for s, r, n, o in SPACINGS]


def helical(psi, *, alpha=(0.37, 0.35), contact_points="pitch_point"):
    support = HelicalSupport(radial=2e7, axial=5e7, tilt=2e4, torsional=3e4)
    sun, ring, carrier = (HelicalBody(m, j, 0.6 * j, support) for m, j in ((0.4, 2e-4), (2.3, 8e-3), (5.0, 9e-3)))
    return HelicalSet(
        sun=sun,
        ring=ring,
        carrier=carrier,
        planet=HelicalBody(0.6, 1.5e-4, 1e-4),
        sun_radius=0.039,
        planet_radius=0.026,
        ring_radius=0.091,
        centre_distance=0.07,
        planet_angles=psi,
        pressure_angle_sun_planet=alpha[0],
        pressure_angle_planet_ring=alpha[1],
        base_helix_angle=0.3,
        stiffness_sun_planet=4e8,
        stiffness_planet_ring=5e8,
        planet_bearing=HelicalSupport(radial=1e8, axial=2e8, tilt=1e4),
        contact_points=contact_points,
    )


def arranged(sun, ring, planets, offsets, **options):
    wanted = np.array(equal_planet_angles(planets)) + (np.radians(offsets) if offsets else 0.0)
    psi = np.array(feasible_angles(sun + ring, tuple(wanted)))
    return psi, mesh_phasing(sun, ring, psi, **options)


def resultants(load):
    """Torque, lateral force, thrust and tilting moment of loads on x, y, z, tilt x, tilt y, u."""
    x, y, z, a, b, u = np.moveaxis(load, -1, 0)
    return np.stack([np.abs(u), _senses(x, y), np.abs(z), _senses(a, b)], axis=-1)


def _senses(x, y):
    return np.maximum(np.abs(x + 1j * y), np.abs(x - 1j * y))


@pytest.mark.parametrize("contact_points", ["pitch_point", "base_circles"])
@pytest.mark.parametrize("convention", ["rotation", "printed"])
@pytest.mark.parametrize(("sun", "ring", "planets", "offsets"), SPACINGS, ids=IDS)
def test_resultants_on_central_members(sun, ring, planets, offsets, convention, contact_points):
    psi, phasing = arranged(sun, ring, planets, offsets, convention=convention, lag=0.3)
    data = helical(psi, contact_points=contact_points)
    directions = mesh_directions(data)
    loads = mesh_loads(directions, phasing, HARMONICS)
    table = phasing_table(phasing, HARMONICS)
    for family, first in enumerate((12, 6)):
        # of one planet alone: everything adds up
        alone = resultants(directions[first : first + 6, family * planets].astype(complex))
        assert np.all(alone > 0)
        found = resultants(loads[:, family, first : first + 6]) / (planets * alone)
        assert found == pytest.approx(table.members[:, family], abs=1e-12), ("sun", "ring")[family]
    share = []
    for family in (0, 1):
        alone = resultants(pin_loads(data, directions[:, [family * planets]].T.astype(complex)))[0]
        share.append(resultants(pin_loads(data, loads[:, family])) / (planets * alone))
    rule = table.members[:, 2]
    assert np.maximum(*share) == pytest.approx(rule, abs=1e-12)


def pin_loads(data, loads):
    """What pins that hold the planets hand on to the carrier, (H, 6); they turn freely about their axes."""
    pins, n = pin_directions(data), np.arange(data.n_planets)
    # rows of planet n move with its own columns only
    own = pins[18:].reshape(-1, 6, data.n_planets, 6)[n, :, n]
    held = np.linalg.solve(own, loads[:, 18:].reshape(len(loads), -1, 6, 1))[..., 0]
    held[..., 5] = 0.0
    return np.einsum("gna,hna->hg", pins[:6], held)


@pytest.mark.parametrize("lag", [0.0, 0.5, 0.3])
@pytest.mark.parametrize("convention", ["rotation", "printed"])
def test_resultants_on_planets(convention, lag):
    """Both meshes of a planet with equal forces at pitch points, equal pressure angles."""
    psi, phasing = arranged(29, 71, 4, (), convention=convention, lag=lag)
    data = helical(psi, alpha=(0.36, 0.36))
    loads = mesh_loads(mesh_directions(data), phasing, HARMONICS).sum(axis=1)[:, 18:].reshape(-1, 4, 6)
    rows = [5, 1, 0, 2, 4]
    alone = np.abs(mesh_directions(data)[18:24, 0])[rows]
    table = phasing_table(phasing, HARMONICS).planets
    assert np.abs(loads[..., 3]).max() < 1e-12  # tilt about the radial axis, in which both pitch points lie
    assert np.abs(loads[..., rows]) / (2 * alone) == pytest.approx(table, abs=1e-12)


@pytest.mark.parametrize(("sun", "ring", "planets", "offsets"), SPACINGS[:6], ids=IDS[:6])
def test_harmonics_excite_one_kind_of_mode(sun, ring, planets, offsets):
    """Modal forces of unit mesh errors leak less than 1e-9 into the other kinds."""
    psi, phasing = arranged(sun, ring, planets, offsets, lag=0.5)
    data = helical(psi)
    modes = gear_set_modes(data)
    kind = np.array(modes.kind)
    k = data.mesh_stiffness[:, None]
    force = np.abs(mesh_loads(modes.shape.T @ (gear_set_system(data).W * k.T), phasing, HARMONICS)).max(axis=1)
    table = phasing_table(phasing, HARMONICS)
    for row, excited in zip(force, table.excited):
        (name,) = excited
        own = np.isin(kind, (KIND[name], "rigid") if name == "rotational" else (KIND[name],))
        assert row[own].max() > 1e-3 * force.max()
        assert row[~own].max() < 1e-9 * row[own].max()
