"""Sectors joined to whole bodies against one solution of the whole grid and the twisted annulus."""

import numpy as np
import pytest

from femgear.errors import GridError
from femgear.fe.elasticity import Material, stiffness
from femgear.fe.grid import Grid, copy_nodes, rotated_copies
from validation.reference.plane_elasticity import checked_solve, edge_load
from validation.reference.substructure import chain, closed_compliance, condensed_sector
from validation.support_stiffness import annulus_sector

STEEL = Material(206e9, 0.3, 7850.0)
COUNT, WIDTH = 7, 0.02


def turns(count):
    angle = 2 * np.pi * np.arange(count) / count
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]).transpose(2, 0, 1)


@pytest.fixture(scope="module")
def sector():
    """Sector of an annulus whose inner circle is the rim, and its stiffness."""
    grid = annulus_sector(0.03, 0.05, COUNT, across=3, along=3)
    names = {"bore": "rim", "rim": "outside"}
    boundaries = {names.get(name, name): edges for name, edges in grid.boundaries.items()}
    grid = Grid(grid.points, grid.triangles, boundaries, grid.regions)
    return grid, stiffness(grid, STEEL, thickness=WIDTH)


def random_loads(grid, seed, inside):
    rng = np.random.default_rng(seed)
    loads = np.zeros((2 * grid.n_nodes, 2))
    nodes = np.setdiff1d(np.arange(grid.n_nodes), np.unique(grid.boundaries["rim"]))
    if inside:
        nodes = np.setdiff1d(nodes, [np.unique(grid.boundaries[n]) for n in ("cut_left", "cut_right")])
    chosen = rng.choice(nodes, 4, replace=False)
    loads[2 * chosen], loads[2 * chosen + 1] = rng.normal(size=(4, 2)), rng.normal(size=(4, 2))
    return loads


def whole_load(grid, loads, sector):
    """Load columns of one sector on the whole body."""
    nodes = copy_nodes(grid, COUNT)
    total = np.zeros((nodes.max() + 1, 2, loads.shape[1]))
    turned = np.einsum("ij,njm->nim", turns(COUNT)[sector], loads.reshape(-1, 2, loads.shape[1]))
    np.add.at(total, nodes[sector], turned)
    return total.reshape(-1, loads.shape[1])


@pytest.mark.parametrize("inside", [True, False])
def test_unlike_loads_on_two_neighbours_as_on_the_whole_grid(sector, inside):
    grid, K = sector
    options = {"count": COUNT, "thickness": WIDTH}
    first, second = (random_loads(grid, seed, inside) for seed in (1, 2))
    parts = [condensed_sector(grid, K, loads, **options) for loads in (first, second)]
    plain = condensed_sector(grid, K, np.zeros((2 * grid.n_nodes, 0)), **options)
    H = closed_compliance([*parts, chain(plain, COUNT - 2)])
    body = rotated_copies(grid, COUNT)
    load = np.hstack([whole_load(grid, first, 0), whole_load(grid, second, 1)])
    rim = np.unique(body.boundaries["rim"])
    fixed = np.concatenate([2 * rim, 2 * rim + 1])
    u = checked_solve(body, stiffness(body, STEEL, thickness=WIDTH), load, fixed=fixed)
    np.testing.assert_allclose(H, load.T @ u, rtol=0, atol=1e-10 * np.abs(H).max())


def test_sliding_rim_as_a_constrained_solution_of_the_whole_grid(sector):
    grid, K = sector
    options = {"count": COUNT, "thickness": WIDTH, "rim": "sliding"}
    loads = random_loads(grid, 3, True)
    part = condensed_sector(grid, K, loads, **options)
    plain = condensed_sector(grid, K, np.zeros((2 * grid.n_nodes, 0)), **options)
    H = closed_compliance([part, chain(plain, COUNT - 1)], rim="sliding")
    body = rotated_copies(grid, COUNT)
    whole, load = stiffness(body, STEEL, thickness=WIDTH).toarray(), whole_load(grid, loads, 0)
    rim = np.unique(body.boundaries["rim"])
    radial = np.zeros((len(whole), len(rim)))
    radial[2 * rim, range(len(rim))], radial[2 * rim + 1, range(len(rim))] = body.points[rim].T
    around = edge_load(body, "rim", lambda x, n: np.stack([-x[..., 1], x[..., 0]], axis=-1))
    scale = np.abs(whole).max()
    ties = np.column_stack([radial / np.abs(radial).max(), around / np.abs(around).max()]) * scale
    zero = np.zeros((ties.shape[1],) * 2)
    system = np.block([[whole, ties], [ties.T, zero]])
    u = np.linalg.solve(system, np.vstack([load, np.zeros((len(zero), 2))]))[: len(whole)]
    np.testing.assert_allclose(H, load.T @ u, rtol=0, atol=1e-9 * np.abs(H).max())


def test_mean_rotation_of_a_twisted_annulus():
    inner, outer, count = 0.03, 0.05, 12
    grid = annulus_sector(inner, outer, count, across=6, along=4)
    boundaries = dict(grid.boundaries) | {"rim": grid.boundaries["bore"], "outside": grid.boundaries["rim"]}
    grid = Grid(grid.points, grid.triangles, boundaries, grid.regions)
    load = edge_load(grid, "outside", lambda x, n: np.stack([-x[..., 1], x[..., 0]], axis=-1), thickness=WIDTH)
    moment = count * (grid.points[:, 0] @ load[1::2] - grid.points[:, 1] @ load[::2])
    K = stiffness(grid, STEEL, thickness=WIDTH)
    part = condensed_sector(grid, K, load[:, None] / moment, count=count, thickness=WIDTH, rim="sliding")
    H = closed_compliance([part] * count, rim="sliding")
    # u = M r / (4 pi mu t) (1/ri^2 - 1/r^2), Timoshenko and Goodier, section 33
    exact = (1 / inner**2 - 1 / outer**2) / (4 * np.pi * STEEL.shear_modulus * WIDTH)
    assert H.sum() == pytest.approx(exact, rel=1e-4)


def test_unknown_rim_is_refused(sector):
    grid, K = sector
    with pytest.raises(GridError, match="E-GRID-RIM") as error:
        condensed_sector(grid, K, np.zeros((2 * grid.n_nodes, 0)), count=COUNT, thickness=1.0, rim="loose")
    assert error.value.code == "E-GRID-RIM"
