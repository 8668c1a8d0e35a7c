"""A structure fixed in space: where it comes from, what it refuses, and the set that runs around in it."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from femgear.errors import CaseError
from femgear.housing.two_way.response import MeshPaths, planet_groups, solve_two_way
from femgear.housing.two_way.structure import FixedStructure, Support, from_arrays, supported_ring
from femgear.solvers.linear.modal import undamped_modes
from validation import fixed_housing
from validation.fixed_housing import DIRECTION, EQUAL, FEET, PAIR, WIDTH, R, feet, gears, thin_ring

KNOWN: Any = {"max_diameter": 4, "max_frequency": 6e3, "damping_ratio": 0.03}


def compliance(one: FixedStructure) -> np.ndarray:
    """Static, from the path to itself and to the sensors."""
    shape = (one.ring_shape / one.natural_frequency[:, None] ** 2).conj()
    both = one.ring_shape.T @ shape + one.residual, one.sensor_shape.T @ shape + one.sensor_residual
    return np.concatenate(both)


def test_support_all_around_is_a_foundation():
    around = Support(0.4, 2e10 * WIDTH * 2 * np.pi * R, 0.0, width=2 * np.pi)
    one = supported_ring(thin_ring(12, lowest=1), (around,), **KNOWN)
    other = supported_ring(thin_ring(12, lowest=1, foundation=2e10), (), **KNOWN)
    np.testing.assert_allclose(one.natural_frequency, other.natural_frequency, rtol=1e-9)
    np.testing.assert_allclose(compliance(one), compliance(other), atol=1e-9 * abs(compliance(other)).max())


@pytest.mark.parametrize("phi", [0.4, 2.9])
def test_supports_carry_the_load(phi):
    """Equilibrium: what the feet give the ground is the force on the ring and its moment."""
    held = [Support(angle, 3e7, 2e7) for angle in (0.3, 1.9, 3.3, 5.0)]
    angle, way = np.repeat([one.angle for one in held], 2), np.tile([0.0, np.pi / 2], 4)
    one = supported_ring(thin_ring(20), held, **KNOWN, sensor_angles=angle, sensor_directions=way)
    moved = compliance(one)[-8:] @ np.exp(-1j * np.arange(-4, 5) * phi)
    force = np.real(moved) * np.tile([3e7, 2e7], 4)
    net = (force * np.exp(1j * (angle + way))).sum()
    assert net == pytest.approx(complex(*DIRECTION) * np.exp(1j * phi), rel=1e-9)
    assert force[1::2].sum() == pytest.approx(DIRECTION[1], rel=1e-9)


def test_sensors_over_a_width_take_the_mean():
    fine = {"sensor_angles": 0.7 + 0.5 * ((np.arange(400) + 0.5) / 400 - 0.5), "sensor_directions": 1.1}
    points, mean = (
        supported_ring(thin_ring(20), FEET, **KNOWN, **known).sensor_shape
        for known in (fine, {"sensor_angles": [0.7], "sensor_directions": 1.1, "sensor_widths": 0.5})
    )
    np.testing.assert_allclose(points.mean(axis=1), mean[:, 0], atol=1e-4 * abs(mean).max())


def _sampled(structure: FixedStructure, angle):
    n = np.arange(-structure.max_diameter, structure.max_diameter + 1)
    waves = np.exp(1j * np.outer(angle, n))
    shape = np.real(structure.ring_shape @ waves.T)
    across = np.random.default_rng(0).normal(size=shape.shape)
    vector = shape[..., None] * DIRECTION + across[..., None] * (DIRECTION[1], -DIRECTION[0])
    return {
        "natural_frequency": structure.natural_frequency,
        "damping_ratio": 0.03,
        "ring_angle": angle,
        "ring_shape": vector,
        "sensor_shape": structure.sensor_shape,
        "ring_compliance": np.real(waves @ structure.residual @ waves.conj().T),
        "sensor_compliance": np.real(structure.sensor_residual @ waves.conj().T),
    }


@pytest.mark.parametrize("even", [True, False])
def test_arrays_give_the_structure_again(even, tmp_path):
    structure, rng = feet(4), np.random.default_rng(3)
    angle = 2 * np.pi * (np.arange(40) + (0.0 if even else rng.uniform(-0.4, 0.4, 40))) / 40
    np.savez(tmp_path / "casing.npz", **_sampled(structure, rng.permutation(angle)))
    again = from_arrays(np.load(tmp_path / "casing.npz"), direction=DIRECTION, max_diameter=4)
    assert structure.sensor_area is again.sensor_area is None
    # arrays know no waves of the ring alone, nor which sectors are equal
    for name, value in vars(structure).items():
        if value is None or name.startswith(("wave", "sectors")):
            continue
        np.testing.assert_allclose(getattr(again, name), value, rtol=1e-9, atol=1e-9 * abs(value).max())


def test_missing_modes_are_their_static_part():
    """All modes without residual, and few with it, agree where the frequency is low."""
    few = feet(4)
    every = supported_ring(thin_ring(20), FEET, **KNOWN | {"max_frequency": 1e6}, sensor_angles=(0.3, 2.0))
    assert len(few.natural_frequency) < len(every.natural_frequency)
    np.testing.assert_allclose(compliance(few), compliance(every), atol=1e-12 * abs(few.residual).max())


def _without(name):
    return lambda arrays: {key: value for key, value in arrays.items() if key != name}


@pytest.mark.parametrize(
    ("changed", "code"),
    [
        (_without("ring_angle"), "E-KEY-MISSING"),
        (lambda a: a | {"ring_angle": a["ring_angle"][:15]}, "E-COUNT"),
        (lambda a: a | {"ring_angle": a["ring_angle"] / 3}, "E-RANGE"),
        (lambda a: a | {"ring_shape": a["ring_shape"][:, :39]}, "E-SHAPE"),
        (lambda a: a | {"natural_frequency": -a["natural_frequency"]}, "E-MECHANISM"),
        (lambda a: a | {"natural_frequency": a["natural_frequency"][:-1]}, "E-SHAPE"),
        (lambda a: a | {"sensor_shape": a["sensor_shape"] * np.nan}, "E-FINITE"),
        (lambda a: a | {"damping_ratio": 1.2}, "E-DAMPING"),
    ],
)
def test_refused_arrays(changed, code):
    arrays = _sampled(feet(4), 2 * np.pi * np.arange(40) / 40)
    with pytest.raises(CaseError) as error:
        from_arrays(changed(arrays), direction=DIRECTION, max_diameter=4)
    assert error.value.code == code


def test_refused_structures():
    structure = feet(4)
    for refused, code in (
        (lambda: replace(structure, ring_shape=structure.ring_shape * 1j), "E-SYMMETRY"),
        (lambda: replace(structure, residual=structure.residual * 1j), "E-SYMMETRY"),
        (lambda: supported_ring(thin_ring(8), (Support(0.0, 1e7, 0.0),), **KNOWN), "E-MECHANISM"),
        (lambda: Support(0.0, -1.0, 0.0), "E-SUPPORT"),
    ):
        with pytest.raises(CaseError) as error:
            refused()
        assert error.value.code == code


@pytest.mark.parametrize(
    ("paths", "speeds", "code"),
    [
        (MeshPaths(24, EQUAL), [5.0], "E-RANGE"),
        (MeshPaths(97, EQUAL), [5.0, -5.0], "E-SPEED"),
        (MeshPaths(97, EQUAL[:2]), [5.0], "E-SHAPE"),
        (MeshPaths(97, (0.0, 2.0, 4.0), 0.0, 3), [5.0], "E-SYMMETRY"),
        (MeshPaths(98, EQUAL, 0.0, 3), [5.0], "E-SYMMETRY"),
    ],
)
def test_refused_sets(paths, speeds, code):
    drive = fixed_housing.excitation(MeshPaths(97, EQUAL))
    modes = undamped_modes(gears(EQUAL), drive.stiffness.mean(axis=1), damping_ratio=0.04)
    with pytest.raises(CaseError) as error:
        solve_two_way(modes, drive, feet(4), paths, speeds, harmonics=(2, 4))
    assert error.value.code == code


def test_groups_of_planets():
    leaders, group, turn = planet_groups(PAIR.planet_angles, 2)
    assert (leaders.tolist(), group.tolist(), turn.tolist()) == ([0, 1], [0, 1, 0, 1], [0, 0, 1, 1])
