"""The rule for cancelled resultants and excited modes, against models that know nothing of it."""

import numpy as np
import pytest
from phase_patterns import cyclic_shares, mesh_loads

from femgear.gears.phasing import mesh_phasing, phase_factors, phasing_table
from femgear.gears.planetary import equal_planet_angles, feasible_angles
from femgear.stages.lumped_set import gear_set_modes
from femgear.system.mesh_directions import gear_set_system, mesh_directions, pin_directions
from femgear.system.mode_kinds import gear_set_motions, phase_basis, phase_shares
from femgear.system.rigid_bodies import PlanarBody, PlanarSet
from validation.reference.frequency_response import mesh_error_response

ALPHA = np.radians(21.0), np.radians(20.0)
HARMONICS = np.arange(1, 8)
# teeth, planets, offsets of the planets from equal spacing [deg]
SPACINGS = (
    (29, 70, 3, ()),
    (27, 69, 3, ()),
    (31, 71, 3, ()),
    (30, 70, 4, ()),
    (28, 68, 4, ()),
    (29, 71, 4, ()),
    (31, 69, 4, ()),
    (29, 71, 5, ()),
    (32, 73, 5, ()),
    (31, 71, 6, ()),
    (32, 70, 6, ()),
    (33, 69, 6, ()),
    (27, 108, 4, (0, 3, -2, 5)),
    (30, 72, 4, (0, 8, 0, 8)),
    (31, 70, 3, (0, 7, 0)),
    (30, 71, 5, (0, 4, -3, 2, 6)),
    (29, 72, 6, (0, 6, 3, 0, 6, 3)),
)
IDS = [f"{s}-{r}, {n}{', unequal' if o else ''}" for s, r, n, o in SPACINGS]


def angles(sun, ring, planets, offsets=()):
    wanted = np.array(equal_planet_angles(planets))
    wanted = wanted + np.radians(offsets) if offsets else wanted
    return np.array(feasible_angles(sun + ring, tuple(wanted)))


def lumped(psi, **changes):
    data = dict(
        sun=PlanarBody(0.4, 2e-4, support=2e7),
        ring=PlanarBody(2.35, 4e-3, support=4e8, torsional_support=1e6),
        carrier=PlanarBody(5.43, 8e-3, support=1e8),
        planet=PlanarBody(0.66, 1.5e-4),
        sun_radius=0.039,
        planet_radius=0.026,
        ring_radius=0.091,
        centre_distance=0.07,
        planet_angles=psi,
        pressure_angle_sun_planet=ALPHA[0],
        pressure_angle_planet_ring=ALPHA[1],
        stiffness_sun_planet=5e8,
        stiffness_planet_ring=6e8,
        planet_bearing=3e8,
    )
    return PlanarSet(**(data | changes))


def senses(x, y):
    """Larger of the two circular parts of a force that has complex x and y."""
    return np.maximum(np.abs(x + 1j * y), np.abs(x - 1j * y))


@pytest.mark.parametrize("flank", [1, -1])
@pytest.mark.parametrize("convention", ["rotation", "printed"])
@pytest.mark.parametrize(("sun", "ring", "planets", "offsets"), SPACINGS, ids=IDS)
def test_planar_resultants_are_those_of_the_rule(sun, ring, planets, offsets, convention, flank):
    psi = angles(sun, ring, planets, offsets)
    phasing = mesh_phasing(sun, ring, psi, flank=flank, convention=convention, lag=0.2)
    assert phasing.equally_spaced == (offsets == ())
    data = lumped(psi)
    loads = mesh_loads(mesh_directions(data, flank), phasing, HARMONICS) / planets
    table = phasing_table(phasing, HARMONICS)
    for family, first in ((0, 6), (1, 3)):
        x, y, u = np.moveaxis(loads[:, family, first : first + 3], -1, 0)
        assert np.abs(u) == pytest.approx(table.members[:, family, 0], abs=1e-12)
        assert senses(x, y) == pytest.approx(table.members[:, family, 1], abs=1e-12)
    # what pins that hold the planets hand on to the carrier
    pins = pin_directions(data)
    forces = np.einsum("gna,hfg->hfna", pins[9:], loads[..., 9:])
    x, y, u = np.moveaxis(np.einsum("gna,hfna->hfg", pins[:3], forces), -1, 0)
    rule = table.members[:, 2]
    assert (np.abs(u) / np.cos(ALPHA)).max(axis=1) == pytest.approx(rule[:, 0], abs=1e-12)
    assert senses(x, y).max(axis=1) == pytest.approx(rule[:, 1], abs=1e-12)


@pytest.mark.parametrize(("sun", "ring", "planets", "offsets"), SPACINGS, ids=IDS)
def test_thrust_and_tilting_moments_by_hand(sun, ring, planets, offsets):
    """Contact points and normals of helical teeth in space, forces and moments by vector products."""
    psi = angles(sun, ring, planets, offsets)
    phasing = mesh_phasing(sun, ring, psi, lag=0.5)
    table = phasing_table(phasing, HARMONICS)
    factor = phase_factors(phasing, HARMONICS).reshape(-1, 2, planets) / planets
    for family, (alpha, helix, radius) in enumerate(zip(ALPHA, (0.3, -0.3), (0.04, 0.09))):
        tangential = -np.cos(alpha) if family else np.cos(alpha)
        local = np.array([np.sin(alpha), tangential, np.tan(helix)])
        radial = np.stack([np.cos(psi), np.sin(psi), 0 * psi])
        around = np.stack([-np.sin(psi), np.cos(psi), 0 * psi])
        force = local[0] * radial + local[1] * around + local[2] * np.array([[0], [0], [1.0]])
        # off the pitch point and off the middle of the face
        point = radius * radial + 0.004 * around + np.array([[0], [0], [0.01]])
        moment = np.cross(point, force, axis=0)
        total = np.einsum("an,hn->ah", np.vstack([force, moment]), factor[:, family])
        arm = abs((moment[0] + 1j * moment[1])[0])
        assert np.abs(total[2]) / abs(local[2]) == pytest.approx(table.members[:, family, 2], abs=1e-12)
        assert senses(total[3], total[4]) / arm == pytest.approx(table.members[:, family, 3], abs=1e-12)
        assert np.abs(total[5]) / abs(moment[2, 0]) == pytest.approx(table.members[:, family, 0], abs=1e-12)


@pytest.mark.parametrize(("sun", "ring", "planets", "offsets"), SPACINGS, ids=IDS)
def test_harmonics_excite_the_kinds_that_the_rule_names(sun, ring, planets, offsets):
    """Modal forces of unit mesh forces, by kind of mode as found from the shapes."""
    psi = angles(sun, ring, planets, offsets)
    data = lumped(psi)
    phasing = mesh_phasing(sun, ring, psi, lag=0.3)
    table = phasing_table(phasing, HARMONICS)
    modes = gear_set_modes(data)
    kind = np.array(modes.kind)
    factor = phase_factors(phasing, HARMONICS).reshape(-1, 2, planets)
    directions = gear_set_system(data).W.reshape(-1, 2, planets)
    force = np.abs(np.einsum("gm,gfn,hfn->hfm", modes.shape, directions, factor)).max(axis=1)
    size = np.linalg.norm(np.einsum("gm,gfn->fnm", modes.shape, directions), axis=(0, 1))
    force = force / np.where(size > 1e-9 * size.max(), size, np.inf)
    if planets > 3:
        assert np.array_equal(
            np.any(force[:, kind == "planet"] > 1e-9, axis=1), ["planet" in row for row in table.excited]
        )
    else:
        assert not any("planet" in row for row in table.excited)
    central = np.isin(kind, ("rotational", "translational", "mixed", "rigid"))
    assert np.array_equal(
        np.any(force[:, central] > 1e-9, axis=1),
        [set(row) > {"planet"} or row[0] != "planet" for row in table.excited],
    )
    if table.separate:
        for name, kinds in (("rotational", ("rotational", "rigid")), ("translational", ("translational",))):
            assert np.array_equal(
                np.any(force[:, np.isin(kind, kinds)] > 1e-9, axis=1), [name in row for row in table.excited]
            )


@pytest.mark.parametrize("planets", [6, 7, 8])
def test_planet_modes_are_excited_by_cyclic_harmonic(planets):
    """Of many planet modes those answer whose planets move as exp(i j psi), j = min(k, N - k)."""
    sun = 3 * planets + 2
    ring = 9 * planets - 2
    phasing = mesh_phasing(sun, ring, equal_planet_angles(planets))
    data = lumped(np.array(equal_planet_angles(planets)))
    modes = gear_set_modes(data)
    motions = gear_set_motions(data, modes.shape)
    shape = modes.shape @ phase_basis(motions, modes.frequency)
    share = phase_shares(gear_set_motions(data, shape))
    number = np.array([np.nanargmax(column) for column in share.T])
    directions = gear_set_system(data).W.reshape(-1, 2, planets)
    force = np.abs(
        np.einsum("gm,gfn,hfn->hfm", shape, directions, phase_factors(phasing, HARMONICS).reshape(-1, 2, planets))
    ).max(axis=1)
    expected = cyclic_shares(phasing, HARMONICS)
    assert np.count_nonzero(expected, axis=1) == pytest.approx(1)
    for j in range(planets // 2 + 1):
        answered = np.any(force[:, number == j] > 1e-9 * force.max(), axis=1)
        assert np.array_equal(answered, expected[:, j] > 0.5)


def mesh_forces(phasing, psi):
    """Amplitudes of the mesh forces (2, N) of the first harmonic, by direct solution."""
    data = lumped(psi)
    error = phase_factors(phasing, [1]).T * 1e-6
    answer = mesh_error_response(
        gear_set_system(data), [700.0], error, mesh_stiffness=data.mesh_stiffness, damping_ratio=0.03
    )
    return np.abs(answer.force[0, 0]).reshape(2, -1)


@pytest.mark.parametrize("sun", [29, 31])
def test_opposite_planets_pair_with_the_printed_phases(sun):
    """Kahraman (1994), cases E and F: p1 with p3, p2 with p4; with phases of turning teeth all are equal."""
    psi = np.array(equal_planet_angles(4))
    found = {
        convention: mesh_forces(mesh_phasing(sun, 100 - sun, psi, convention=convention), psi)
        for convention in ("rotation", "printed")
    }
    assert np.ptp(found["rotation"], axis=1) == pytest.approx(0, abs=1e-9 * found["rotation"].max())
    printed = found["printed"]
    assert printed[:, 2:] == pytest.approx(printed[:, :2], rel=1e-9)
    assert np.abs(printed[:, 0] / printed[:, 1] - 1).max() > 0.02
