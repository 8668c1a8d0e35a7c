"""Kinds of modes against the theorems of Lin and Parker (J. Vib. Acoust. 121, 1999) for a rigid ring."""

from dataclasses import replace

import numpy as np
import pytest
from published.planetary_sets import lin_parker_set

from femgear.stages.lumped_set import gear_set_modes
from femgear.system.mesh_directions import gear_set_system
from femgear.system.mode_kinds import (
    SetMotions,
    class_energies,
    class_shares,
    fixed_basis,
    mode_kinds,
    phase_basis,
    phase_shares,
    phasing,
    set_motions,
)
from validation.reference.mode_energy import motion_planes, signed_phase_shares


def rigid_ring_set(planets, *, spread=0.0):
    """Spring-mass planetary set with a fixed ring, written down anew: K, M and names."""
    psi = 2 * np.pi * np.arange(planets) / planets
    names = [f"{b}: {a}" for b in ("sun", "carrier") for a in ("x", "y", "rotation")]
    names += [f"planet {n + 1}: {a}" for n in range(planets) for a in ("x", "y", "rotation")]
    rs, rp, arm, ws, wr = 0.019, 0.028, 0.051, np.deg2rad(22.2), np.deg2rad(20.0)
    mass = np.array([0.22, 0.22, 1e-4, 3.0, 3.0, 6e-3] + [0.355, 0.355, 2.2e-4] * planets)
    K = np.zeros((len(names), len(names)))

    def spring(k, **motions):
        row = np.zeros(len(names))
        for name, value in motions.items():
            row[names.index(name.replace("__", ": ").replace("_", " "))] = value
        return k * np.outer(row, row)

    for body, support in (("sun", 5e7), ("carrier", 2e8)):
        K += spring(support, **{f"{body}__x": 1}) + spring(support, **{f"{body}__y": 1})
        K += spring(1e4, **{f"{body}__rotation": 1})
    for n, angle in enumerate(psi):
        p, soft = f"planet_{n + 1}", 1 + spread * n
        on_sun, on_ring = angle + np.pi / 2 - ws, angle - np.pi / 2 + wr
        K += spring(
            5e8 * soft,
            **{
                "sun__x": np.cos(on_sun),
                "sun__y": np.sin(on_sun),
                "sun__rotation": rs,
                f"{p}__x": -np.cos(on_sun),
                f"{p}__y": -np.sin(on_sun),
                f"{p}__rotation": rp,
            },
        )
        K += spring(7e8, **{f"{p}__x": np.cos(on_ring), f"{p}__y": np.sin(on_ring), f"{p}__rotation": -rp})
        K += spring(3e8, **{f"{p}__x": 1, "carrier__x": -1, "carrier__rotation": arm * np.sin(angle)})
        K += spring(3e8, **{f"{p}__y": 1, "carrier__y": -1, "carrier__rotation": -arm * np.cos(angle)})
    return K, mass, tuple(names), psi


def solve(K, mass):
    root = np.sqrt(mass)
    values, vectors = np.linalg.eigh(K / np.outer(root, root))
    return np.sqrt(np.maximum(values, 0)) / (2 * np.pi), vectors / root[:, None]


def kinds_of(K, mass, names, psi):
    """Frequencies, kinds and nodal diameters, with one ring coordinate that nothing moves."""
    frequency, shape = solve(K, mass)
    kinds, diameter = mode_kinds(
        np.vstack([shape, np.zeros(shape.shape[1])]),
        np.append(mass, 1.0),
        names,
        frequency=frequency,
        ring_diameter=np.zeros(1, int),
        ring_slice=slice(len(names), len(names) + 1),
        planet_angles=psi,
    )
    return frequency, kinds, diameter


@pytest.mark.parametrize("planets", [3, 4, 5, 6])
def test_numbers_and_multiplicities_of_lin_and_parker(planets):
    """5 rotational modes, 5 pairs of translational ones, 3 planet modes of multiplicity N - 3."""
    frequency, kinds, diameter = kinds_of(*rigid_ring_set(planets))
    count = {kind: kinds.count(kind) for kind in set(kinds)}
    assert count.get("rotational") == 5
    assert count.get("translational") == 10
    assert count.get("planet", 0) == 3 * (planets - 3)
    assert (diameter == -1).all()
    for kind, multiplicity in (("rotational", 1), ("translational", 2), ("planet", planets - 3)):
        own = np.sort(frequency[[k == kind for k in kinds]])
        groups = np.split(own, np.flatnonzero(np.diff(own) > 1e-6 * own[1:]) + 1) if len(own) else []
        assert {len(group) for group in groups} <= {multiplicity}


def test_a_different_planet_mixes_the_kinds():
    _, kinds, _ = kinds_of(*rigid_ring_set(4, spread=0.2))
    assert "mixed" in kinds


def test_small_sets_have_no_planet_modes():
    for planets in (1, 2):
        _, kinds, _ = kinds_of(*rigid_ring_set(planets))
        assert len(kinds) == 6 + 3 * planets


def test_ring_modes_take_the_class_of_their_nodal_diameter():
    """Ring coordinates that move alone: n = 0, 3 rotational, 1, 2, 4 translational, for three planets."""
    names = tuple(f"{b}: {a}" for b in ("sun", "carrier") for a in ("x", "y", "rotation"))
    names += tuple(f"planet {n + 1}: {a}" for n in range(3) for a in ("x", "y", "rotation"))
    n = np.array([0, 1, 2, 3, 4])
    shape = np.zeros((len(names) + 5, 5))
    shape[len(names) :] = np.eye(5)
    mass = np.ones(len(shape))
    kinds, diameter = mode_kinds(
        shape,
        mass,
        names,
        frequency=np.arange(1.0, 6.0),
        ring_diameter=n,
        ring_slice=slice(len(names), len(names) + 5),
        planet_angles=2 * np.pi * np.arange(3) / 3,
    )
    turning, moving = "ring, rotational", "ring, translational"
    assert kinds == (turning, moving, moving, turning, moving)
    assert np.array_equal(diameter, n)


def test_a_mode_without_frequency_is_rigid():
    K, mass, names, psi = rigid_ring_set(3)
    frequency, shape = solve(K, mass)
    frequency[0] = 0.0
    kinds, _ = mode_kinds(
        np.vstack([shape, np.zeros(shape.shape[1])]),
        np.append(mass, 1.0),
        names,
        frequency=frequency,
        ring_diameter=np.zeros(1, int),
        ring_slice=slice(len(names), len(names) + 1),
        planet_angles=psi,
    )
    assert kinds[0] == "rigid" and "rigid" not in kinds[1:]


def moved(shape, names, psi, mass=None):
    return set_motions(shape, np.ones(len(names)) if mass is None else mass, names, psi)


@pytest.mark.parametrize("planets", [3, 4, 5, 6])
def test_phase_shares_are_the_discrete_fourier_transform(planets):
    """Random motions in x and y, transformed by hand in local axes."""
    names = tuple(f"planet {n + 1}: {a}" for n in range(planets) for a in ("x", "y", "rotation"))
    psi = 0.3 + 2 * np.pi * np.arange(planets) / planets
    draw = np.random.default_rng(planets)
    shape = draw.normal(size=(3 * planets, 4)) + 1j * draw.normal(size=(3 * planets, 4))
    motion = shape.reshape(planets, 3, 4)
    local = np.exp(-1j * psi)[:, None] * (motion[:, 0].real + 1j * motion[:, 1].real)
    other = np.exp(-1j * psi)[:, None] * (motion[:, 0].imag + 1j * motion[:, 1].imag)
    axes = (local.real + 1j * other.real, local.imag + 1j * other.imag, motion[:, 2])
    energy = np.array(
        [
            sum(abs(sum(a[n] * np.exp(-2j * np.pi * j * n / planets) for n in range(planets))) ** 2 for a in axes)
            for j in range(planets)
        ]
    )
    energy /= energy.sum(axis=0)
    motions = moved(shape, names, psi)
    assert signed_phase_shares(motions) == pytest.approx(energy, abs=1e-12)
    folded = [energy[j] + (energy[planets - j] if 0 < j < planets - j else 0.0) for j in range(planets // 2 + 1)]
    assert phase_shares(motions) == pytest.approx(np.array(folded), abs=1e-12)


def test_travelling_motions_are_told_apart_by_sign():
    psi = 2 * np.pi * np.arange(5) / 5
    names = tuple(f"planet {n + 1}: u" for n in range(5))
    shape = np.column_stack([np.exp(1j * psi), np.exp(-1j * psi), np.cos(2 * psi)])
    expected = np.zeros((5, 3))
    expected[1, 0] = expected[4, 1] = 1.0
    expected[2, 2] = expected[3, 2] = 0.5
    assert signed_phase_shares(moved(shape, names, psi)) == pytest.approx(expected, abs=1e-12)
    assert phasing(moved(shape.real, names, psi)) == ("sequentially phased 1",) * 2 + ("sequentially phased 2",)


@pytest.mark.parametrize("planets", [3, 4, 5, 6, 7])
def test_phasing_goes_with_the_kind(planets):
    """Kahraman (1994): rotational in phase, translational sequential; planet modes the other harmonics."""
    K, mass, names, psi = rigid_ring_set(planets)
    frequency, shape = solve(K, mass)
    _, kinds, _ = kinds_of(K, mass, names, psi)
    shape = shape @ phase_basis(moved(shape, names, psi, mass), frequency)
    assert np.abs(shape.T @ (mass[:, None] * shape) - np.eye(len(mass))).max() < 1e-9
    assert np.abs(K @ shape - mass[:, None] * shape * (2 * np.pi * frequency) ** 2).max() < 1e-7 * np.abs(K).max()
    found = phasing(moved(shape, names, psi, mass))
    for kind, phase in zip(kinds, found):
        if kind == "rotational":
            assert phase == "in phase"
        elif kind == "translational":
            assert phase == "sequentially phased 1"
        else:
            assert phase == "counter-phased" or int(phase[-1]) >= 2
    counter = found.count("counter-phased")
    assert counter == (3 if planets % 2 == 0 else 0)
    assert "mixed" not in found
    twice = [found.count(f"sequentially phased {j}") for j in range(2, (planets + 1) // 2)]
    assert twice == [6] * len(twice)


def test_unequal_planets_have_honest_phase_shares():
    """Shares are what the patterns of a harmonic explain."""
    psi = np.deg2rad([0.0, 60.0, 150.0, 250.0])
    names = tuple(f"planet {n + 1}: radial" for n in range(4))
    shape = np.column_stack([np.ones(4), np.cos(psi), np.random.default_rng(1).normal(size=4)])
    motions = moved(shape, names, psi)
    share = phase_shares(motions)
    for j in range(3):
        basis = np.column_stack([np.cos(j * psi), np.sin(j * psi)][: 2 if j else 1])
        rest = shape - basis @ np.linalg.lstsq(basis, shape, rcond=None)[0]
        assert share[j] == pytest.approx(1 - (rest**2).sum(axis=0) / (shape**2).sum(axis=0), abs=1e-12)
    assert share[0, 0] == pytest.approx(1.0) and share[1, 1] == pytest.approx(1.0)
    assert phasing(motions)[2] == "mixed"


def test_planets_at_rest_have_no_phasing():
    names = ("sun: x", "planet 1: u", "planet 2: u", "planet 3: u")
    motions = moved(np.array([[1.0], [0.0], [0.0], [0.0]]), names, 2 * np.pi * np.arange(3) / 3)
    assert phasing(motions) == ("at rest",)
    assert np.all(np.isnan(phase_shares(motions)))


def test_names_of_both_models_give_the_same_classes():
    """The lumped set in x, y of the planets instead of radial and tangential."""
    data = lin_parker_set(5)
    system, shape = gear_set_system(data), gear_set_modes(data).shape
    names, turned = list(system.dofs), np.array(shape)
    for n, angle in enumerate(data.planet_angles):
        rows = [names.index(f"planet {n + 1}: {a}") for a in ("radial", "tangential")]
        c, s = np.cos(angle), np.sin(angle)
        turned[rows] = np.array([[c, -s], [s, c]]) @ shape[rows]
        for row, axis in zip(rows, "xy"):
            names[row] = f"planet {n + 1}: {axis}"
    energies = class_energies(set_motions(turned, np.diag(system.M), names, data.planet_angles))
    # mass-normalised shapes: energies are shares
    assert energies == pytest.approx(class_shares(data, shape), abs=1e-12)


def test_energies_of_whirling_motions_are_those_of_both_parts():
    """A sun that whirls, x = 1 and y = i, has twice the energy of x = 1; squares without moduli cancel."""
    names = ("sun: x", "sun: y", "sun: u", *(f"planet {n + 1}: u" for n in range(3)))
    psi, mass = 2 * np.pi * np.arange(3) / 3, np.array([2.0, 2.0, 5.0, 3.0, 3.0, 3.0])
    shape = np.array([[1.0, 0.0], [1j, 0.0], [0.0, 1j], [0.0, 1j], [0.0, 1j], [0.0, 1j]])
    whirl = set_motions(shape, mass, names, psi)
    assert class_energies(whirl) == pytest.approx(np.array([[0, 5 + 9], [4, 0], [0, 0]]), abs=1e-12)
    # planets that hardly move beside a sun that whirls are at rest
    faint = set_motions(np.array([[1.0], [1j], [0.0], [1e-7], [1e-7], [1e-7]]), mass, names, psi)
    assert phasing(faint) == ("at rest",)
    data = lin_parker_set(4)
    real, other = gear_set_modes(data).shape[:, 3:8], gear_set_modes(data).shape[:, 8:13]
    # modes of unit energy a part: the shares are the mean of both
    mean = 0.5 * (class_shares(data, real) + class_shares(data, other))
    assert class_shares(data, real + 1j * other) == pytest.approx(mean, abs=1e-12)


def test_planes_of_motion():
    dofs = ("sun: x", "sun: u", "sun: y", "ring: x", "planet 1: radial", "planet 1: tangential")
    assert motion_planes(dofs).tolist() == [[0, 2], [4, 5]]


@pytest.mark.parametrize("size", [1.0, 1e-3])
def test_planets_that_move_by_rounding_alone_rest(size):
    """A mode of the sun: what is left of the planets is 1e-9 of it, without a phasing."""
    N = 3
    motions = SetMotions(
        central=size * np.array([[[1.0], [0.0], [0.0]]]),
        central_mass=np.ones((1, 3)),
        planets=1e-9 * size * np.array([[1.0], [0.3], [-0.2]])[None] * np.ones((N, 1, 1)),
        planet_mass=np.ones((N, 3)),
        planet_angles=2 * np.pi * np.arange(N) / N,
    )
    assert np.all(np.isnan(phase_shares(motions)))
    assert phasing(motions) == ("at rest",)


def test_a_motion_that_two_harmonics_explain_is_mixed():
    """At unequal spacing three planets all alike are a combination of 1, cos psi and sin psi in many ways."""
    psi = np.array([0.0, 1.5, 4.0])
    wave = np.cos(psi) + 0.4
    motions = SetMotions(
        central=np.zeros((1, 3, 1)),
        central_mass=np.ones((1, 3)),
        planets=np.array([wave, 0.0 * wave, 0.0 * wave]).T[:, :, None],
        planet_mass=np.ones((3, 3)),
        planet_angles=psi,
    )
    one, cosine = np.ones(3) / np.sqrt(3.0), np.column_stack([np.cos(psi), np.sin(psi)])
    alike = (one @ wave) ** 2 / (wave @ wave)
    turning = wave @ cosine @ np.linalg.solve(cosine.T @ cosine, cosine.T @ wave) / (wave @ wave)
    assert phase_shares(motions)[:, 0] == pytest.approx([alike, turning], rel=1e-12)
    assert alike + turning > 1.01
    pure = replace(motions, planets=(motions.planets - 0.4 * (motions.planets != 0.0)))
    assert phase_shares(pure)[1, 0] == pytest.approx(1.0, rel=1e-12) and phase_shares(pure)[0, 0] > 0.01
    assert phasing(pure) == ("mixed",)


def test_modes_have_one_sign_and_one_place_in_their_space():
    """Whatever basis of each space a library hands out, the modes that come back are the same."""
    rng = np.random.default_rng(3)
    values = np.array([0.0, 0.0, 1.0, 2.0, 2.0 * (1 + 1e-12), 2.0 * (1 - 1e-12), 5.0])
    vectors = np.linalg.qr(rng.normal(size=(9, 7)))[0]
    found = fixed_basis(values, vectors)
    assert found.T @ found == pytest.approx(np.eye(7), abs=1e-14)
    for group in ([0, 1], [2], [3, 4, 5], [6]):
        turned, n = vectors.copy(), len(group)
        turned[:, group] = vectors[:, group] @ np.linalg.qr(rng.normal(size=(n, n)))[0]
        assert fixed_basis(values, turned) == pytest.approx(found, abs=1e-13)
        # still the same space, and the coordinate that moves most in it moves in the first mode alone
        space = vectors[:, group] @ vectors[:, group].T
        assert found[:, group] @ found[:, group].T == pytest.approx(space, abs=1e-13)
        row = np.diag(space).argmax()
        assert found[row, group[0]] == pytest.approx(np.sqrt(space[row, row]))
        assert found[row, group[1:]] == pytest.approx(0.0, abs=1e-13)


def test_equal_entries_are_told_apart_by_their_number():
    """Rounding decides which of two equal entries is the larger one; the first is positive nevertheless."""
    for rounding in (-1e-12, 1e-12):
        for sign in (-1.0, 1.0):
            mode = sign * np.array([[0.6], [-0.6 * (1 + rounding)], [0.53]])
            assert fixed_basis([4.0], mode)[0] == pytest.approx(0.6)
