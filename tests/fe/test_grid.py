"""Grids: mirror images, rotated copies, Jacobian bounds, files."""

import numpy as np
import pytest

from femgear.errors import GridError, StorageError
from femgear.fe.grid import (
    Grid,
    check_grid,
    copy_nodes,
    jacobian_bounds,
    mirror,
    ordered_nodes,
    read_grid,
    rotated_copies,
    write_grid,
)
from femgear.fe.meshing import Outline, mesh_outline
from validation.reference.plane_elasticity import quality

COUNT = 9
ANGLE = np.pi / COUNT


def arc(radius, start, end, k):
    t = np.linspace(start, end, 2 * k + 1)
    return radius * np.stack([np.cos(t), np.sin(t)], axis=1)


def line(p, q, k):
    t = np.linspace(0, 1, 2 * k + 1)[:, None]
    return (1 - t) * np.array(p) + t * np.array(q)


def half_annulus_sector(inner=1.0, outer=2.0, middle=1.5):
    end = np.array([np.cos(ANGLE), np.sin(ANGLE)])
    return Outline(
        curves=(
            (
                "symmetry",
                np.vstack([line((inner, 0), (middle, 0), 3)[:-1], line((middle, 0), (outer, 0), 3)]),
            ),
            ("tip", arc(outer, 0, ANGLE, 4)),
            ("cut", np.vstack([line(outer * end, middle * end, 3)[:-1], line(middle * end, inner * end, 3)])),
            ("rim", arc(inner, ANGLE, 0, 3)),
        ),
        interfaces=(("tooth_base", arc(middle, 0, ANGLE, 3)),),
        regions=(("tooth", (1.75, 0.1)), ("body", (1.25, 0.1))),
    )


@pytest.fixture(scope="module")
def half():
    return mesh_outline(half_annulus_sector())


def area(grid, elements=None):
    """Area by the divergence theorem along curved element edges would need their ends: sum determinants."""
    t = grid.triangles if elements is None else grid.triangles[elements]
    s, w = np.polynomial.legendre.leggauss(3)
    total = 0.0
    for a, b, m in ((0, 1, 3), (1, 2, 4), (2, 0, 5)):
        pa, pb, pm = (grid.points[t[:, i]] for i in (a, b, m))
        for si, wi in zip(s, w):
            x = 0.5 * si * (si - 1) * pa + 0.5 * si * (si + 1) * pb + (1 - si**2) * pm
            d = (si - 0.5) * pa + (si + 0.5) * pb - 2 * si * pm
            total += 0.5 * wi * np.sum(x[:, 0] * d[:, 1] - x[:, 1] * d[:, 0])
    return total


def test_all_outline_points_are_nodes(half):
    outline = half_annulus_sector()
    for name, points in outline.curves + outline.interfaces:
        assert np.array_equal(half.points[ordered_nodes(half, name)], points)


def test_regions_are_the_two_sides_of_the_interface(half):
    centre = half.points[half.triangles[:, :3]].mean(axis=1)
    outside = np.hypot(*centre.T) > 1.5
    assert np.array_equal(np.flatnonzero(outside), np.sort(half.regions["tooth"]))
    assert np.array_equal(np.flatnonzero(~outside), np.sort(half.regions["body"]))


def test_mirror_names_orientation_and_area(half):
    whole = mirror(half)
    check_grid(whole)
    assert area(whole) == pytest.approx(2 * area(half), rel=1e-13)
    assert "symmetry" not in whole.boundaries
    assert whole.n_nodes == 2 * half.n_nodes - len(ordered_nodes(half, "symmetry"))
    right, left = ordered_nodes(whole, "cut_right"), ordered_nodes(whole, "cut_left")
    assert np.array_equal(whole.points[right][::-1] * [1, -1], whole.points[left])
    tip, rim = whole.points[ordered_nodes(whole, "tip")], whole.points[ordered_nodes(whole, "rim")]
    assert np.all(np.diff(np.arctan2(tip[:, 1], tip[:, 0])) > 0)
    assert np.all(np.diff(np.arctan2(rim[:, 1], rim[:, 0])) < 0)
    assert len(tip) == 17 and len(rim) == 13


def test_boundaries_have_the_body_on_the_left(half):
    whole = mirror(half)
    corners = whole.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    directed = {tuple(edge) for edge in corners.tolist()}
    for name in ("tip_left", "tip_right", "rim", "cut_left", "cut_right"):
        assert all((a, b) in directed for a, b, _ in whole.boundaries[name].tolist())


def test_copies_close_the_circle(half):
    sector = mirror(half)
    whole = rotated_copies(sector, COUNT)
    check_grid(whole)
    assert area(whole) == pytest.approx(np.pi * 3, rel=1e-6)
    assert area(whole) == pytest.approx(COUNT * area(sector), rel=1e-13)
    ring = ordered_nodes(whole, "tip")
    assert ring[0] == ring[-1] and len(np.unique(ring)) == COUNT * 16
    numbers = copy_nodes(sector, COUNT)
    assert np.array_equal(np.unique(numbers), np.arange(whole.n_nodes))
    for k in range(COUNT):
        c, s = np.cos(2 * ANGLE * k), np.sin(2 * ANGLE * k)
        assert np.abs(sector.points @ [[c, s], [-s, c]] - whole.points[numbers[k]]).max() < 1e-14
    assert len(whole.regions["tooth"]) == COUNT * len(sector.regions["tooth"])
    edges = np.sort(whole.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    uses = np.unique(edges, axis=0, return_counts=True)[1]
    on_rim_and_tip = COUNT * (8 + 6)
    assert np.count_nonzero(uses == 1) == on_rim_and_tip and uses.max() == 2


def test_jacobian_bounds_of_a_straight_and_a_bulged_triangle():
    straight = np.array([[0, 0], [2, 0], [0, 3], [1, 0], [1, 1.5], [0, 1.5]], dtype=float)
    grid = Grid(straight, [[0, 1, 2, 3, 4, 5]])
    np.testing.assert_allclose(jacobian_bounds(grid), 6.0, rtol=1e-14)
    # x = 2 xi, y = 3 eta + 4 b xi (1 - xi - eta): the determinant is 2 (3 - 4 b xi), between 6 - 8 b and 6
    bulged = straight.copy()
    bulged[3, 1] = 0.5
    np.testing.assert_allclose(jacobian_bounds(Grid(bulged, [[0, 1, 2, 3, 4, 5]])), [[6 - 8 * 0.5, 6.0]], rtol=1e-13)


def test_quality_of_the_equilateral_triangle_is_one():
    p = np.array([[0, 0], [1, 0], [0.5, np.sqrt(0.75)]])
    grid = Grid(np.vstack([p, 0.5 * (p + np.roll(p, -1, axis=0))]), [[0, 1, 2, 3, 4, 5]])
    assert quality(grid)[0] == pytest.approx(1.0, rel=1e-14)


@pytest.mark.parametrize("how", ["swapped corners", "mid-side node too far"])
def test_inverted_elements_are_refused(half, how):  # bad input 60
    points, triangles = half.points.copy(), half.triangles.copy()
    if how == "swapped corners":
        triangles[3] = triangles[3][[0, 2, 1, 5, 4, 3]]
    else:
        a, b, m = half.boundaries["tip"][0]
        points[m] -= 3.0 * np.array([1.0, 0.0]) * np.hypot(*(points[b] - points[a]))
    with pytest.raises(GridError) as error:
        check_grid(Grid(points, triangles))
    assert error.value.code == "E-GRID"
    assert "inverted or folded" in str(error.value) and "m^2" in str(error.value)


def test_file_round_trip_is_exact(half, tmp_path):
    grid = mirror(half)
    write_grid(tmp_path / "sector.msh", grid)
    back = read_grid(tmp_path / "sector.msh")
    assert np.array_equal(back.points, grid.points) and np.array_equal(back.triangles, grid.triangles)
    assert back.boundaries.keys() == grid.boundaries.keys() and back.regions.keys() == grid.regions.keys()
    for name, edges in grid.boundaries.items():
        assert np.array_equal(back.boundaries[name], edges)
    for name, elements in grid.regions.items():
        assert np.array_equal(back.regions[name], np.sort(elements))
    assert [p.name for p in tmp_path.iterdir()] == ["sector.msh"]


def test_files_say_the_same_to_meshio(half, tmp_path):
    import meshio

    path = tmp_path / "a.msh"
    write_grid(path, half)
    found, read = meshio.read(path, file_format="gmsh"), read_grid(path)
    np.testing.assert_array_equal(found.points[:, :2], read.points)
    np.testing.assert_array_equal(found.get_cells_type("triangle6"), read.triangles)
    edges, tags = found.get_cells_type("line3"), found.get_cell_data("gmsh:physical", "line3")
    regions = found.get_cell_data("gmsh:physical", "triangle6")
    assert found.field_data.keys() == {*read.boundaries, *read.regions}
    for name, one in read.boundaries.items():
        np.testing.assert_array_equal(edges[tags == found.field_data[name][0]], one)
    for name, one in read.regions.items():
        np.testing.assert_array_equal(np.flatnonzero(regions == found.field_data[name][0]), one)


def test_unreadable_and_unwritable_files(half, tmp_path):
    (tmp_path / "bad.msh").write_bytes(b"$MeshFormat\n2.2 1 8\n")
    for name in ("bad.msh", "missing.msh"):
        with pytest.raises(StorageError) as error:
            read_grid(tmp_path / name)
        assert error.value.code == "E-GRID-FILE"
    with pytest.raises(StorageError):
        write_grid(tmp_path / "no" / "folder.msh", half)
