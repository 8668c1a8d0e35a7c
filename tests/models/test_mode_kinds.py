"""Kinds of modes against the theorems of Lin and Parker (J. Vib. Acoust. 121, 1999) for a rigid ring."""

import numpy as np
import pytest

from femgear.models.kinds import mode_kinds


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
        K += spring(5e8 * soft, **{
            "sun__x": np.cos(on_sun), "sun__y": np.sin(on_sun), "sun__rotation": rs,
            f"{p}__x": -np.cos(on_sun), f"{p}__y": -np.sin(on_sun), f"{p}__rotation": rp,
        })  # fmt: skip
        K += spring(7e8, **{
            f"{p}__x": np.cos(on_ring), f"{p}__y": np.sin(on_ring), f"{p}__rotation": -rp
        })  # fmt: skip
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
