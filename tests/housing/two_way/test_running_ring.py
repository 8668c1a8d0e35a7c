"""An elastic ring under planets that run around in it, against its modes as cosines and sines of the structure."""

from dataclasses import replace

import numpy as np
import pytest
from running_twin import TURN, running, twin

from femgear.housing.two_way import running_ring
from femgear.housing.two_way.carrier_orders import CarrierOrders, MeshPaths
from femgear.housing.two_way.running_planets import RING, ring_lines, solve_running
from femgear.housing.two_way.running_ring import RunningRing

FREQUENCY = 2.0 * np.pi * np.array([900.0, 640.0, 730.0, 2100.0, 1250.0])
DIAMETER = np.array([0, 1, 2, 2, 3])
LOSS = 0.04


def ring() -> RunningRing:
    generator = np.random.default_rng(3)
    approach, radial, around = generator.normal(size=(3, 5)) + 1j * generator.normal(size=(3, 5))
    values = np.array([approach, radial, around])
    values[:, DIAMETER == 0] = values[:, DIAMETER == 0].real
    return RunningRing(FREQUENCY, DIAMETER, values[0], values[1:].T, LOSS)


def as_modes(stage, elastic: RunningRing):
    """Stage whose structure has the ring as real modes, and its surface (coordinates, 2) at angle theta by waves."""
    top = int(elastic.diameter.max())
    own = stage.shape.shape[1] // 2
    columns, surfaces, frequencies = [], [], []
    for frequency, n, a, b in zip(elastic.natural_frequency, elastic.diameter, elastic.approach, elastic.surface):
        for part in (1.0,) if n == 0 else (np.sqrt(0.5), -1j * np.sqrt(0.5)):
            column, surface = np.zeros(2 * top + 1, complex), np.zeros((2 * top + 1, 2), complex)
            column[top + n], surface[top + n] = part * a, part * b
            column[top - n], surface[top - n] = np.conj(part * a), np.conj(part * b)
            columns.append(column)
            surfaces.append(surface)
            frequencies.append(frequency)
    shape = np.zeros((stage.shape.shape[0], 2 * top + 1, stage.shape.shape[2] + len(columns)), complex)
    shape[:, top - own : top + own + 1, : stage.shape.shape[2]] = stage.shape
    shape[RING, :, stage.shape.shape[2] :] = np.array(columns).T
    whole = replace(
        stage,
        natural_frequency=np.append(stage.natural_frequency, frequencies),
        damping_ratio=np.append(stage.damping_ratio, np.zeros(len(columns))),
        shape=shape,
        structure_loss=LOSS,
    )
    return whole, np.array(surfaces)


SETS = [(3, 40, 1, 3), (3, 41, -1, 3), (5, 42, 1, 5), (4, 41, 1, 2), (3, 40, 1, 1)]


@pytest.mark.parametrize(("count", "teeth", "sense", "symmetry"), SETS)
def test_waves_are_those_of_a_structure_with_the_same_modes(count, teeth, sense, symmetry):
    angles = np.array([0.0, 1.4, np.pi, np.pi + 1.4]) if symmetry == 2 else None
    stage, elastic = running(twin(count, teeth, sense, angles=angles), symmetry=symmetry), ring()
    whole, surfaces = as_modes(stage, elastic)
    known = {"harmonics": (2, 3), "side_bands": 5, "tolerance": 1e-13}
    wanted = solve_running(whole, teeth * TURN, TURN, **known)
    alone = replace(stage, structure_loss=LOSS, ring=elastic)
    response = solve_running(alone, teeth * TURN, TURN, **known)
    size = np.abs(wanted.force).max()
    assert np.abs(response.force - wanted.force).max() < 1e-10 * size
    rigid = solve_running(replace(stage, structure_loss=LOSS), teeth * TURN, TURN, **known)
    assert np.abs(rigid.force - wanted.force).max() > 1e-2 * size
    # fixed places hear every wave at its own order
    theta, directions = np.array([0.3, 2.0]), np.array([[1.0, 0.0], [0.6, 0.8]])
    heard = ring_lines(alone, response, theta, directions)
    n = np.arange(surfaces.shape[1]) - surfaces.shape[1] // 2
    at_places = np.einsum("cnd,kd,nk->ck", surfaces, directions, np.exp(1j * np.outer(n, theta))).real
    coordinates = slice(stage.shape.shape[2], None)
    expected = wanted.lines(np.eye(whole.shape.shape[2])[:, coordinates]) @ at_places
    common = np.isin(wanted.band, response.band), np.isin(response.band, wanted.band)
    assert np.abs(heard[:, common[1]] - expected[:, common[0]]).max() < 1e-10 * np.abs(expected).max()
    assert np.abs(expected).max() > 0.0


@pytest.mark.parametrize("sense", [1, -1])
def test_planets_in_a_pattern_cancel_in_all_waves_but_some(sense):
    """What planet j makes of a wave n is that of the first one times a phase, by the head of `carrier_orders`."""
    places = 2.0 * np.pi * np.arange(3) / 3
    paths = MeshPaths(41, tuple(places), symmetry=3)
    orders = CarrierOrders(paths, lines=2, max_diameter=3, side_bands=4, sense=sense, patterns=3)
    elastic, blocks = ring(), np.arange(9)
    whole = (orders.base + orders.pattern)[:, None] + orders.bands
    waves = elastic.waves[0]
    phases = np.exp(1j * (sense * whole[..., None, None] - waves[:, None]) * places)
    met = running_ring._met(elastic, orders, blocks, orders.bands)
    assert np.array_equal(met, np.abs(phases.sum(axis=-1)) > 1.0)
