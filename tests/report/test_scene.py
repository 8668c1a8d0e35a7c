"""Scenes: grids against closed forms, the turning carrier against the kinematics, files whole or absent."""

import importlib.util
import warnings
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest

from femgear.errors import CaseError, FemgearError, StorageError
from femgear.report import scene
from validation.planetary import reference_set

_HERE = Path(__file__).parents[1]
_SPEC = importlib.util.spec_from_file_location("synthetic_results", _HERE / "synthetic_results.py")
synthetic = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(synthetic)


@pytest.fixture(autouse=True)
def deprecations_are_errors():
    pv = scene.load_pyvista()
    with warnings.catch_warnings():
        warnings.simplefilter("error", pv.PyVistaDeprecationWarning)
        yield


def square(name="square", corner=(0.0, 0.0), displacement=None):
    """Unit square of two six-node triangles."""
    points = np.array([(x, y) for y in (0.0, 0.5, 1.0) for x in (0.0, 0.5, 1.0)]) + corner
    triangles = np.array([[0, 2, 8, 1, 5, 4], [0, 8, 6, 4, 7, 3]])
    return scene.DrawnBody(name, points, triangles, displacement)


def test_set_of_bodies():
    u = np.tile([1e-6, -2e-6], (9, 1))
    grid = scene.assemble_set([square("sun"), square("ring", (3.0, 0.0), u)])
    assert grid.n_points == 18 and grid.n_cells == 4
    assert grid.field_data["sun"] == [0] and grid.field_data["ring"] == [1]
    np.testing.assert_array_equal(grid.cell_data["body"], [0, 0, 1, 1])
    np.testing.assert_allclose(grid.point_data["displacement"][9:, :2], u, rtol=1e-6)
    assert not grid.point_data["displacement"][:9].any()
    # VTK integrates its own quadratic triangles
    assert grid.compute_cell_sizes(length=False, volume=False)["Area"].sum() == pytest.approx(2.0)


def test_placing_turns_then_moves():
    grid = type("Grid", (), {"points": np.array([[2.0, 0.0]]), "triangles": np.zeros((1, 6), int)})
    body = scene.placed(grid, name="planet", centre=(10.0, 0.0), angle=np.pi / 2, displacement=np.array([[1.0, 0.0]]))
    np.testing.assert_allclose(body.points, [[10.0, 2.0]], atol=1e-15)
    np.testing.assert_allclose(body.displacement, [[0.0, 1.0]], atol=1e-15)


@pytest.mark.parametrize("n", [0, 1, 3])
def test_field_of_the_sectors_is_a_wave_around_the_circle(n):
    """A radial displacement cos(n phi) in every sector keeps its direction in the whole body."""
    count = 12
    numbers = np.arange(count)[:, None]
    phi = 2 * np.pi * np.arange(count) / count
    field = scene.whole_field(np.stack([np.cos(n * phi), 0 * phi], axis=-1)[:, None], numbers)
    expected = np.cos(n * phi)[:, None] * np.column_stack([np.cos(phi), np.sin(phi)])
    np.testing.assert_allclose(field, expected, atol=1e-14)


def test_vtu_keeps_nodes_and_displacement(tmp_path):
    import meshio

    u = np.arange(18.0).reshape(9, 2)
    scene.write_vtu(scene.assemble_set([square(displacement=u)]), tmp_path / "set.vtu")
    read = meshio.read(tmp_path / "set.vtu")
    assert [block.type for block in read.cells] == ["triangle6"]
    np.testing.assert_array_equal(read.cells[0].data, square().triangles)
    np.testing.assert_allclose(read.point_data["displacement"][:, :2], u)
    assert [path.name for path in tmp_path.iterdir()] == ["set.vtu"]


def test_vtu_needs_its_suffix_and_its_folder(tmp_path):
    grid = scene.assemble_set([square()])
    with pytest.raises(CaseError, match="VTU"):
        scene.write_vtu(grid, tmp_path / "set.stl")
    with pytest.raises(StorageError):
        scene.write_vtu(grid, tmp_path / "missing" / "set.vtu")


def test_picture_of_a_deformed_grid(tmp_path):
    u = np.zeros((9, 2))
    u[8] = 2e-6, 0.0
    grid = scene.assemble_set([square(displacement=u)])
    scale = scene.deformed_picture(grid, tmp_path / "set.png", title="square")
    assert scale == pytest.approx(0.03 / 2e-6)
    image = iio.imread(tmp_path / "set.png")
    assert len(np.unique(image.reshape(-1, image.shape[2]), axis=0)) > 50
    assert (image[:3] == 255).all()  # white border


@pytest.mark.skipif(scene.sys.platform != "linux", reason="only Linux tells limit and use")
def test_too_little_memory_is_said_before_vtk_ends_the_process(monkeypatch):
    monkeypatch.delitem(scene.sys.modules, "pyvista", raising=False)
    monkeypatch.setattr("resource.getrlimit", lambda _: (1_400_000_000, -1))
    with pytest.raises(FemgearError, match="may use") as caught:
        scene.load_pyvista()
    assert caught.value.code == "E-MEMORY" and "--no-pictures" in caught.value.remedy


def test_missing_opengl_library_is_named(monkeypatch):
    monkeypatch.setattr(scene.sys, "platform", "linux")

    def missing(name):
        raise OSError(f"{name}: cannot open shared object file")

    monkeypatch.setattr(scene.ctypes, "CDLL", missing)
    with pytest.raises(FemgearError, match=r"libEGL\.so\.1") as caught:
        scene.load_pyvista()
    assert caught.value.code == "E-SYSTEM-LIBRARY"
    assert "apt-get install" in caught.value.remedy and "libegl1" in caught.value.remedy


@pytest.fixture(scope="module")
def gears():
    return reference_set()
