"""The casing of scripts/e_axle_casing.py: tied, reduced and free as it should be, and that of the shipped case."""

from dataclasses import astuple
from pathlib import Path

import numpy as np
import pytest
from e_axle_casing import (
    FEET,
    RING,
    SENSORS,
    Box,
    assembled,
    draw_casing,
    factor,
    free_frequencies,
    interface_of,
    main,
    reduced,
)
from scipy.linalg import eigh
from scipy.sparse import csc_matrix, diags
from scipy.sparse.linalg import LinearOperator, eigsh

from femgear.errors import CaseError
from femgear.exchange.superelement import free_body_problems, read_superelement
from femgear.fe.beam import rigid_link
from femgear.trains.gearbox.casing import casing_seats
from femgear.trains.gearbox.casing_file import elastic_casing
from femgear.trains.reading import read_case

CASES = Path(__file__).parents[2] / "cases"
SHIPPED = CASES / "casings" / "e_axle.npz"
HIGHEST = 8000.0


@pytest.fixture(scope="module")
def full():
    """Coarse casing: basis, stiffness, mass, nodes, columns of their mean motions."""
    basis, K, M = assembled(Box(size=0.02))
    return basis, K, M, *interface_of(basis)


@pytest.fixture(scope="module")
def small(full):
    """Its stiffness and mass on nodes and inner modes."""
    _, K, M, nodes, columns = full
    feet = np.concatenate([[node.role.startswith("foot")] * len(node.dofs) for node in nodes])
    return reduced(K, M, columns, feet, HIGHEST)


@pytest.fixture(scope="module")
def shipped():
    return read_superelement(SHIPPED, SHIPPED.with_suffix(".csv"))


@pytest.mark.slow
def test_means_of_a_rigid_motion_are_those_of_the_nodes(full):
    basis, _, _, nodes, columns = full
    points = np.hstack([basis.doflocs[:, basis.nodal_dofs[0]], basis.doflocs[:, basis.edge_dofs[0]]])
    dofs = np.hstack([basis.nodal_dofs, basis.edge_dofs])
    motion = np.zeros((basis.N, 6))
    for place, three in zip(points.T, dofs.T, strict=True):
        motion[three] = rigid_link(place)[:3]
    expected = np.vstack([rigid_link(node.place)[: len(node.dofs)] for node in nodes])
    assert columns.T @ motion == pytest.approx(expected, abs=1e-12)


@pytest.mark.slow
def test_on_springs_it_yields_and_vibrates_as_all_elements_do(full, small):
    """Springs at seats and feet are no part of the reduction: they couple static shapes with free modes."""
    _, K, M, nodes, columns = full
    stiffness, mass = small
    springs = np.concatenate([[1e8, 2e8, 5e7, 5e4, 5e4, 0.0][: len(node.dofs)] for node in nodes])
    sensors = np.concatenate([[node.role.startswith("sensor")] * len(node.dofs) for node in nodes])
    springs[sensors] = 0.0
    tied = csc_matrix(columns)
    lu = factor(K + tied @ diags(springs) @ tied.T)
    count = len(springs)
    stiffness = stiffness + np.diag(np.append(springs, np.zeros(len(stiffness) - count)))
    load = np.random.default_rng(1).standard_normal(count) * np.where(springs > 1e6, 1.0, 0.02)
    expected = columns.T @ lu.solve(columns @ load)
    ours = np.linalg.solve(stiffness, np.append(load, np.zeros(len(stiffness) - count)))[:count]
    assert ours == pytest.approx(expected, rel=1e-6, abs=1e-7 * np.abs(expected).max())
    inverse = LinearOperator(K.shape, lu.solve, dtype=float)
    square = eigsh(K + tied @ diags(springs) @ tied.T, 20, M, sigma=0.0, OPinv=inverse, v0=np.ones(K.shape[0]))[0]
    expected = np.sqrt(np.sort(square)) / (2.0 * np.pi)
    ours = np.sqrt(eigh(stiffness, mass, eigvals_only=True)[:20]) / (2.0 * np.pi)
    below = expected < 0.5 * HIGHEST
    assert below.sum() >= 8
    assert ours[below] == pytest.approx(expected[below], rel=1e-3)
    assert (ours > expected * (1.0 - 1e-7)).all()


def test_the_shipped_file_is_that_of_the_script(shipped):
    assert tuple(np.load(SHIPPED)["sizes"]) == astuple(Box())
    assert SHIPPED.stat().st_size < 400_000
    assert list(free_body_problems(shipped)) == []
    assert {*shipped.of_role("foot")} == {*FEET} and {*shipped.of_role("sensor")} == {*SENSORS}


def test_its_seats_are_those_of_the_case(shipped):
    places = casing_seats(read_case(str(CASES / "e_axle.toml")))
    assert {*shipped.of_role("seat")} == {*places} and RING in places
    for name, node in shipped.of_role("seat").items():
        assert shipped.place[node.number] == pytest.approx(places[name], abs=1e-12)


@pytest.mark.slow
def test_coarse_elements_are_near_the_shipped_file(small, shipped):
    coarse = np.sqrt(eigh(*small, eigvals_only=True)[6:10]) / (2.0 * np.pi)
    assert coarse == pytest.approx(free_frequencies(shipped)[:4], rel=0.05)


def test_the_case_takes_it():
    element, body = elastic_casing(read_case(str(CASES / "e_axle_in_a_casing.toml")))
    assert body.rigid_mass[0, 0] == pytest.approx(3.2206, rel=1e-3)
    # seats of the pair lie between centre and rotor
    assert body.centre == pytest.approx([6.01e-3, -8.80e-3, 91.45e-3], abs=1e-4)
    assert len(element.nodes) == 14


@pytest.mark.slow
def test_the_picture_shows_all_that_is_tied(full, tmp_path):
    from PIL import Image

    basis, _, _, nodes, _ = full
    draw_casing(basis.mesh, nodes, tmp_path / "casing.png")
    with Image.open(tmp_path / "casing.png") as picture:
        pixels = np.asarray(picture.convert("RGB")).reshape(-1, 3).astype(int)
    for colour in ((0x00, 0x72, 0xB2), (0xE6, 0x9F, 0x00), (0x00, 0x9E, 0x73)):
        assert (np.abs(pixels - colour).max(axis=1) < 60).sum() > 200


def test_sizes_out_of_range_are_refused(tmp_path):
    with pytest.raises(CaseError, match="sizes of the casing"):
        main(output=tmp_path, size=1.0)
