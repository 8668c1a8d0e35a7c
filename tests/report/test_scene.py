"""Scenes: grids against closed forms, the turning carrier against the kinematics, files whole or absent."""

import importlib.util
import warnings
from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest
from matplotlib.path import Path as Polygon

from femgear.errors import CaseError, FemgearError, StorageError
from femgear.gears.gear import half_thickness_angle
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
    return scene.Body(name, points, triangles, displacement)


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


@pytest.mark.parametrize(("teeth", "wished"), [(108, 48), (108, 36), (60, 30), (31, 31), (97, 24)])
def test_stroboscope_shows_the_mesh_in_slow_motion(teeth, wished):
    count = scene.strobe_frames(teeth, wished)
    assert 0.7 * wished <= count <= 1.3 * wished
    apparent = teeth % count
    assert apparent > 0, "the meshes would stand still"
    assert count / apparent >= 5, "too fast to see"


def field_of(h, n, value, *, turn=1.0):
    radial = np.zeros((7, 9), complex)
    radial[h, 4 + n] = value
    return scene._Field(radial, 0 * radial, turn, 108)


@pytest.mark.parametrize("turn", [1.0, -1.0])
@pytest.mark.parametrize(("h", "n"), [(1, 3), (2, -4), (5, 0), (3, 2)])
def test_a_fixed_point_hears_order_h_z_minus_n(h, n, turn):
    """Issue of the modulation paper: component (h, n) is heard at carrier order h z_ring - n (turn +1)."""
    samples = 2048
    carrier = turn * 2 * np.pi * np.arange(samples) / samples
    field = field_of(h, n, 1e-6, turn=turn)
    heard = field.at(np.array([0.3]), carrier)[0][:, 0]
    amplitude = np.abs(np.fft.rfft(heard)) * 2 / samples
    order = abs(h * 108 - turn * n)
    assert np.argmax(amplitude) == order
    assert amplitude[round(order)] == pytest.approx(1e-6)


def test_field_is_the_double_sum():
    rng = np.random.default_rng(4)
    radial, tangential = rng.normal(size=(2, 4, 7)) + 1j * rng.normal(size=(2, 4, 7))
    field = scene._Field(radial, tangential, 1.0, 36)
    phi_world, carrier = 1.1, 0.7
    for component, got in zip((radial, tangential), field.at(np.array([phi_world]), np.array([0.2, carrier]))):
        expected = sum(
            (component[h, n + 3] * np.exp(1j * (n * (phi_world - carrier) + h * 36 * carrier))).real
            for h in range(1, 4)
            for n in range(-3, 4)
        )
        assert got[1, 0] == pytest.approx(expected, rel=1e-12)


@pytest.fixture(scope="module")
def gears():
    return reference_set()


def test_drawn_teeth_are_the_exact_ones(gears):
    """Tip and root circles, and between them involute flanks of the right thickness."""
    for gear in (gears.sun, gears.planet, gears.ring):
        outline = scene.gear_outline(gear)
        radius, angle = np.abs(outline), np.angle(outline)
        ends = sorted((gear.tip_radius, gear.root_radius))
        assert [radius.min(), radius.max()] == pytest.approx(ends, rel=1e-9)
        # half the tooth's angle at every radius of the involute, on the first tooth
        first = np.abs(angle) < np.pi / gear.teeth * (1.0 - 1e-9)
        low, high = sorted((gear.tip_radius, gear.form_radius))
        flank = first & (radius > low * (1 + 1e-9)) & (radius < high * (1 - 1e-9))
        assert np.count_nonzero(flank) >= 8
        half = half_thickness_angle(gear, radius[flank])
        assert np.abs(angle[flank]) == pytest.approx(np.abs(half), abs=1e-9)
        assert np.all(np.diff(np.unwrap(angle)) > -1e-3 * np.pi / gear.teeth)


@pytest.mark.parametrize("carrier", [0.0, 0.123, 2.9])
def test_drawn_teeth_mesh_and_do_not_cross(gears, carrier):
    (sun, sun_turn), *planets = scene._places(gears, carrier)
    ring = scene._ring_corners(gears)[:, 0]

    def inside(points, polygon):
        return Polygon(np.column_stack([polygon.real, polygon.imag])).contains_points(
            np.column_stack([points.real, points.imag]), radius=0.0
        )

    sun = sun + scene.gear_outline(gears.sun) * np.exp(1j * sun_turn)
    assert len(planets) == 3
    for n, (centre, turn) in enumerate(planets):
        at = gears.planet_angles[n] + carrier
        assert centre == pytest.approx(gears.centre_distance * np.exp(1j * at), rel=1e-12)
        planet = centre + scene.gear_outline(gears.planet) * np.exp(1j * turn)
        # smaller by 10 um, less than a hundredth of a module: chords between points cut into round flanks
        shrunk = centre + (planet - centre) * (1.0 - 10e-6 / gears.planet.tip_radius)
        smaller = sun * (1.0 - 10e-6 / gears.sun.tip_radius)
        assert not inside(smaller, shrunk).any() and not inside(shrunk, smaller).any()
        assert inside(shrunk, ring * (1.0 + 10e-6 / gears.ring.tip_radius)).all()
        # teeth reach into each other's gaps
        assert np.abs(planet).min() < gears.sun.tip_radius and np.abs(planet).max() > gears.ring.tip_radius


def test_animation_is_a_small_gif(gears, tmp_path):
    field = synthetic.ring_field()[1]
    path = tmp_path / "turning.gif"
    count = scene.animate_operating_deflection(
        path, gears, radial=field, tangential=0.3j * field, frames=12, size=240, title="x"
    )
    images = iio.imread(path)
    assert images.shape == (count, 240, 240, 3)
    assert path.stat().st_size < 3_000_000 * count / 48
    assert all(np.any(images[k] != images[k + 1]) for k in range(count - 1))
    assert [entry.name for entry in tmp_path.iterdir()] == ["turning.gif"]


def test_animation_of_nothing_stands_still(gears, tmp_path):
    """Zero displacement is drawn as such, not divided by."""
    path = tmp_path / "rest.gif"
    scene.animate_operating_deflection(
        path, gears, radial=np.zeros((3, 5)), tangential=np.zeros((3, 5)), frames=4, size=120
    )
    assert path.stat().st_size > 0
