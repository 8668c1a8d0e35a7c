"""Meshing outlines: exact boundaries, cache, processes, and every outline that must be refused."""

import errno
import os
import subprocess
import sys
import tempfile
import threading
import warnings

import numpy as np
import pytest

from femgear.errors import GridError
from femgear.fe import grid as fe_grid
from femgear.fe import meshing
from femgear.fe.meshing import Outline, check_outline, estimate_elements, mesh_outline, mesh_outlines
from validation.reference.plane_elasticity import quality


@pytest.fixture
def in_this_process():
    """The cache is what is tested, whoever makes its grids."""


@pytest.fixture(autouse=True)
def a_process_for_every_grid(request, monkeypatch):
    if "in_this_process" not in request.fixturenames:
        monkeypatch.setattr(meshing, "subprocess", subprocess)


def polygon(corners, *, name="edge", divide=1):
    """Closed polygon as one curve per side."""
    corners = np.asarray(corners, dtype=float)
    t = np.linspace(0, 1, 2 * divide + 1)[:, None]
    sides = [(1 - t) * a + t * b for a, b in zip(corners, np.roll(corners, -1, axis=0))]
    return Outline(tuple((f"{name}{i}", side) for i, side in enumerate(sides)))


SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]


def refusal(outline):
    with pytest.raises(GridError) as error:
        mesh_outline(outline)
    return error.value


def test_square_grid():
    grid = mesh_outline(polygon(SQUARE, divide=6))
    a, b, c = (grid.points[grid.triangles[:, i]] for i in range(3))
    det = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    assert det.min() > 0 and 0.5 * det.sum() == pytest.approx(1.0, rel=1e-13)
    assert grid.regions["body"].size == len(grid.triangles)
    assert quality(grid).min() > 0.6
    vertices, edges, faces = len(np.unique(grid.triangles[:, :3])), grid.n_nodes, len(grid.triangles)
    assert vertices - (edges - vertices) + faces == 1  # Euler: every edge has exactly one mid-side node


def test_same_outline_same_grid_at_any_scale_and_place():
    outline = polygon(SQUARE, divide=5)
    moved = Outline(tuple((name, 1e-3 * points + [0.5, -0.3]) for name, points in outline.curves))
    one, again, small = mesh_outline(outline), mesh_outline(outline), mesh_outline(moved)
    assert np.array_equal(one.points, again.points) and np.array_equal(one.triangles, again.triangles)
    assert np.array_equal(one.triangles, small.triangles)
    assert np.allclose((small.points - [0.5, -0.3]) * 1e3, one.points, rtol=0, atol=1e-9)


def test_several_outlines_in_order():
    outlines = [polygon(np.array(SQUARE) * k, divide=3) for k in (1.0, 2.0, 3.0)]
    grids = mesh_outlines(outlines)
    assert [grid.points.max() for grid in grids] == [1.0, 2.0, 3.0]


def test_any_thread_may_mesh():  # bad input 58
    result = []
    thread = threading.Thread(target=lambda: result.append(mesh_outline(polygon(SQUARE, divide=2))))
    thread.start()
    thread.join()
    assert result[0].n_nodes > 8


@pytest.mark.usefixtures("in_this_process")
def test_cache_is_used_and_damaged_files_are_made_again(tmp_path, monkeypatch):
    outline = polygon(SQUARE, divide=4)
    first = mesh_outline(outline, cache=tmp_path / "meshes")
    (file,) = (tmp_path / "meshes").iterdir()
    whole = file.read_bytes()

    def made_again(damaged):
        file.write_bytes(damaged)
        with pytest.warns(UserWarning, match=f"the grid is made again: {file} is not a readable grid"):
            found = mesh_outline(outline, cache=tmp_path / "meshes")
        assert np.array_equal(found.points, first.points) and file.read_bytes() == whole

    made_again(whole[: len(whole) // 2])
    # a coordinate of the boundary that was changed in the file
    place = whole.index(np.float64(0.25).tobytes())
    made_again(whole[:place] + np.float64(0.26).tobytes() + whole[place + 8 :])
    # a node inside that was moved by little: no check of the geometry can tell
    inside = next(p for p in first.points if 0 < p.min() and p.max() < 1 and p[0] not in (0.25, 0.5, 0.75))
    place = whole.index(inside[0].tobytes())
    made_again(whole[:place] + np.float64(inside[0] + 1e-3).tobytes() + whole[place + 8 :])
    # a file without checksum
    made_again(whole[: whole.rindex(b"$Comments")])
    monkeypatch.setattr(meshing, "_run_gmsh", None)
    third = mesh_outline(outline, cache=tmp_path / "meshes")
    assert np.array_equal(first.points, third.points) and np.array_equal(first.triangles, third.triangles)


def sealed(path, grid):
    """A file that read_grid accepts."""
    path.unlink()
    fe_grid.write_grid(path, grid)


def _truncated(path, grid, elsewhere):
    path.write_bytes(path.read_bytes()[:1000])


def _empty(path, grid, elsewhere):
    path.write_bytes(b"")


def _link(path, grid, elsewhere):
    path.rename(elsewhere)
    path.symlink_to(elsewhere)


def _pipe(path, grid, elsewhere):
    path.unlink()
    os.mkfifo(path)


def _sparse(path, grid, elsewhere):
    with open(path, "r+b") as stream:
        stream.truncate(10**12)


def _of_another_outline(path, grid, elsewhere):
    sealed(path, mesh_outline(polygon(2.0 * np.array(SQUARE), divide=4)))


def _moved_corner(path, grid, elsewhere):
    points = grid.points.copy()
    points[0] += 1e-9
    sealed(path, fe_grid.Grid(points, grid.triangles, grid.boundaries, grid.regions))


def _moved_middle(path, grid, elsewhere):
    points = grid.points.copy()
    points[-1] += 1e-9
    sealed(path, fe_grid.Grid(points, grid.triangles, grid.boundaries, grid.regions))


def _not_a_number(path, grid, elsewhere):
    points = grid.points.copy()
    points[16] = np.nan
    sealed(path, fe_grid.Grid(points, grid.triangles, grid.boundaries, grid.regions))


def _wrong_node(path, grid, elsewhere):
    triangles = grid.triangles.copy()
    triangles[0, 0] = 10**6
    sealed(path, fe_grid.Grid(grid.points, triangles, grid.boundaries, grid.regions))


def _inverted(path, grid, elsewhere):
    triangles = grid.triangles.copy()
    triangles[0] = triangles[0][[0, 2, 1, 5, 4, 3]]
    sealed(path, fe_grid.Grid(grid.points, triangles, grid.boundaries, grid.regions))


def _exchanged_boundaries(path, grid, elsewhere):
    names = list(grid.boundaries)
    boundaries = dict(zip(names, [grid.boundaries[name] for name in names[::-1]], strict=True))
    sealed(path, fe_grid.Grid(grid.points, grid.triangles, boundaries, grid.regions))


def _no_region(path, grid, elsewhere):
    sealed(path, fe_grid.Grid(grid.points, grid.triangles, grid.boundaries, {}))


def _no_triangle(path, grid, elsewhere):
    sealed(path, fe_grid.Grid(grid.points, np.zeros((0, 6), int), grid.boundaries, {"body": np.zeros(0, int)}))


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize(
    "damage",
    [
        _truncated,
        _empty,
        _link,
        _pipe,
        _sparse,
        _of_another_outline,
        _moved_corner,
        _moved_middle,
        _not_a_number,
        _wrong_node,
        _inverted,
        _exchanged_boundaries,
        _no_region,
        _no_triangle,
    ],
)
def test_a_grid_in_the_cache_that_is_not_that_of_the_outline_is_said_and_made_again(tmp_path, damage):
    outline, cache = polygon(SQUARE, divide=4), tmp_path / "meshes"
    first = mesh_outline(outline, cache=cache)
    (file,) = cache.iterdir()
    whole = file.read_bytes()
    damage(file, first, tmp_path / "elsewhere")
    with pytest.warns(UserWarning, match="the grid is made again: ") as said:
        again = mesh_outline(outline, cache=cache)
    assert len(said) == 1 and str(file) in str(said[0].message)
    assert np.array_equal(first.points, again.points) and np.array_equal(first.triangles, again.triangles)
    assert not file.is_symlink() and file.read_bytes() == whole and list(cache.iterdir()) == [file]
    assert not (tmp_path / "elsewhere").exists() or (tmp_path / "elsewhere").read_bytes() == whole
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert np.array_equal(mesh_outline(outline, cache=cache).points, first.points)


@pytest.mark.usefixtures("in_this_process")
def test_a_grid_is_written_through_no_link_and_what_dead_processes_left_is_removed(tmp_path, monkeypatch):
    outline, elsewhere = polygon(SQUARE, divide=2), tmp_path / "elsewhere"
    elsewhere.write_text("mine")
    mesh_outline(outline, cache=tmp_path / "meshes")
    (file,) = (tmp_path / "meshes").iterdir()
    file.unlink()
    left = [f".{file.stem}.4711-140737.msh", f".{file.stem}.0123456789abcdef.tmp.msh"]
    for name in [*left, "notes.txt", ".other.msh"]:
        (tmp_path / "meshes" / name).write_text("half")
    mesh_outline(outline, cache=tmp_path / "meshes")
    assert {path.name for path in (tmp_path / "meshes").iterdir()} == {file.name, "notes.txt", ".other.msh"}
    file.unlink()
    monkeypatch.setattr(fe_grid.secrets, "token_hex", lambda n: "0" * 2 * n)
    (tmp_path / "meshes" / f".{file.stem}.{'0' * 16}.tmp.msh").symlink_to(elsewhere)
    with pytest.warns(UserWarning, match="File exists"):
        mesh_outline(outline, cache=tmp_path / "meshes")
    assert elsewhere.read_text() == "mine"


def test_threads_that_make_the_same_grid_all_have_it(tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        grids = mesh_outlines([polygon(SQUARE, divide=3)] * 6, cache=tmp_path)
    assert len({grid.points.tobytes() for grid in grids}) == 1 and len(list(tmp_path.iterdir())) == 1


def test_gmsh_leaves_nothing_in_the_folder_of_temporary_files(tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path / "absent"))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "absent"))
    assert mesh_outline(polygon(SQUARE)).n_nodes > 8
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("in_this_process")
def test_a_cache_that_cannot_be_written_is_done_without(tmp_path, monkeypatch):
    outline = polygon(SQUARE, divide=4)
    (tmp_path / "file").write_text("")
    for cache in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.warns(UserWarning, match="not kept") as warned:
            assert mesh_outline(outline, cache=cache).n_nodes > 8
        assert str(cache) in str(warned[0].message)

    # as of the system, and as of NumPy
    for error in (OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)), OSError("9 requested and 3 written")):

        def full(*_, error=error):
            raise error

        monkeypatch.setattr(fe_grid.os, "replace", full)
        with pytest.warns(UserWarning, match="No space left|9 requested"):
            mesh_outline(outline, cache=tmp_path / "meshes")
        assert list((tmp_path / "meshes").iterdir()) == []


@pytest.mark.usefixtures("in_this_process")
def test_the_sealed_file_is_read_by_others(tmp_path):
    import meshio

    grid = mesh_outline(polygon(SQUARE, divide=4), cache=tmp_path)
    (file,) = tmp_path.iterdir()
    assert len(meshio.read(file).get_cells_type("triangle6")) == len(grid.triangles)


def fake_gmsh(folder, monkeypatch, text):
    (folder / "gmsh.py").write_text(text)
    monkeypatch.setenv("PYTHONPATH", str(folder) + os.pathsep + os.environ.get("PYTHONPATH", ""))


def test_generator_that_does_not_return_is_killed(tmp_path, monkeypatch):
    fake_gmsh(tmp_path, monkeypatch, "import time\ntime.sleep(60)\n")
    monkeypatch.setattr(meshing, "TIME_LIMIT", 0.8)
    error = refusal(polygon(SQUARE))
    assert error.code == "E-GRID-GMSH" and "0.8 s" in str(error)


def test_missing_system_library_names_its_package(tmp_path, monkeypatch):
    text = "raise OSError('libGLU.so.1: cannot open shared object file: No such file or directory')"
    fake_gmsh(tmp_path, monkeypatch, text)
    error = refusal(polygon(SQUARE))
    assert error.code == "E-GRID-GMSH" and "apt-get install libglu1-mesa" in str(error)


def test_generator_errors_are_passed_on(tmp_path, monkeypatch):
    fake_gmsh(tmp_path, monkeypatch, "def initialize(*a, **k): pass\ndef finalize(): pass\noption = model = None\n")
    error = refusal(polygon(SQUARE))
    assert error.code == "E-GRID-GMSH"


def test_self_crossing_outline():  # bad input 52
    error = refusal(polygon([(0, 0), (1, 1), (1, 0), (0, 1.5)]))
    assert error.code == "E-GRID" and "edge0" in str(error) and "edge2" in str(error)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_points_that_are_not_numbers(value):  # bad input 53
    corners = np.array(SQUARE, dtype=float)
    corners[2, 0] = value
    with np.errstate(invalid="ignore"):
        outline = polygon(corners)
    error = refusal(outline)
    assert error.code == "E-GRID" and "finite" in str(error)


def test_points_that_coincide():  # bad input 54
    error = refusal(polygon([(0, 0), (1, 0), (1, 1e-13), (1, 1), (0, 1)]))
    assert error.code == "E-GRID" and "1.000e-13 m apart" in str(error)


def test_clockwise_outline():  # bad input 55
    assert refusal(polygon(SQUARE[::-1])).code == "E-GRID"


@pytest.mark.parametrize(
    "corners",
    [
        [(0, 0), (1, 0), (0.5, 0)],
        [(0, 0), (1, 0), (1, 1), (1, 0.5), (0.5, 0.5)],
        [(0, 0), (1, 0), (1, 1), (0.5, 0), (0, 1)],
        [(0, 0), (0, 0), (0, 0)],
    ],
    ids=["zero area", "slit", "corner on a side", "one point"],
)
def test_slits_and_zero_area(corners):  # bad input 56
    assert refusal(polygon(corners)).code in ("E-GRID", "E-GRID")


def test_thin_sliver_is_a_slit():
    assert refusal(polygon([(0, 0), (1, 0), (1, 4e-9), (0, 4e-9)])).code in (
        "E-GRID",
        "E-GRID",
    )
    assert refusal(polygon([(0, 0), (1, 0), (0.5, 1.9e-9)])).code in ("E-GRID", "E-GRID")


def test_element_count_is_estimated_before_meshing(monkeypatch):  # bad input 57
    monkeypatch.setattr(meshing, "_run_gmsh", None)
    error = refusal(polygon(SQUARE, divide=400))
    assert error.code == "E-GRID" and "elements" in str(error) and "at most 200000" in str(error)
    error = refusal(polygon(SQUARE, divide=2000))
    assert error.code == "E-GRID" and "8000 segments" in str(error)


@pytest.mark.parametrize("divide", [4, 8, 25])
def test_estimate_is_within_a_factor_two(divide):
    outline = polygon(SQUARE, divide=divide)
    count = len(mesh_outline(outline).triangles)
    assert 0.5 < estimate_elements(check_outline(outline)) / count < 2.0


def split_square(points, regions=(("lower", (0.5, 0.1)), ("upper", (0.5, 0.9)))):
    return Outline(polygon(SQUARE, divide=4).curves, (("interface", np.asarray(points, dtype=float)),), regions)


def straight(p, q, k=4):
    t = np.linspace(0, 1, 2 * k + 1)[:, None]
    return (1 - t) * np.array(p) + t * np.array(q)


@pytest.mark.parametrize("ends", [((0, 0.5), (1, 0.5)), ((1, 0.5), (0, 0.5))])
def test_interface_divides_the_body(ends):
    grid = mesh_outline(split_square(straight(*ends)))
    centre = grid.points[grid.triangles[:, :3]].mean(axis=1)
    assert (centre[grid.regions["lower"], 1] < 0.5).all() and (centre[grid.regions["upper"], 1] > 0.5).all()
    assert len(grid.boundaries["interface"]) == 4


@pytest.mark.parametrize(
    "points, code",
    [
        (straight((0, 0.5), (0.7, 0.6)), "E-GRID"),
        (straight((0, 0.5), (1, 0.55)), "E-GRID"),
        (straight((0.3, 0.5), (0.6, 0.5)), "E-GRID"),
        (straight((0, 0.5), (1, 0.5))[[0, 1, 2, 3, 8]], "E-GRID"),
        (
            np.vstack([straight((0, 0.5), (0.5, 1.5), 1)[:-1], straight((0.5, 1.5), (1, 0.5), 1)]),
            "E-GRID",
        ),
    ],
    ids=["dangling", "off a corner", "floating", "folded back", "outside"],
)
def test_interfaces_that_do_not_divide(points, code):
    if code == "E-GRID" and len(points) == 5 and points[2, 1] == 0.5:
        points = np.array([(0, 0.5), (0.4, 0.5), (0.8, 0.5), (0.6, 0.5), (0.4, 0.5), (0.7, 0.5), (1, 0.5)])
    assert refusal(split_square(points)).code == code


@pytest.mark.parametrize(
    "regions",
    [
        (),
        (("lower", (0.5, 0.1)),),
        (("lower", (0.5, 0.1)), ("upper", (0.5, 1.9))),
        (("lower", (0.5, 0.1)), ("upper", (0.5, 0.2))),
    ],
    ids=["none", "one missing", "outside", "same part"],
)
def test_regions_must_name_every_part_once(regions):
    assert refusal(split_square(straight((0, 0.5), (1, 0.5)), regions)).code == "E-GRID"


def test_heavy_libraries_are_imported_late():
    heavy = "{'gmsh', 'skfem', 'meshio', 'matplotlib', 'pyvista'}"
    code = f"import sys, femgear.fe.meshing, femgear.fe.elasticity; print(sorted({heavy} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
