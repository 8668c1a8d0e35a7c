"""Casings from files: all formats hold the same one, closed forms, and everything that is refused."""

import shutil
import tracemalloc
import zipfile

import numpy as np
import pytest
import pyuff
from casing import NU, RHO, Casing, E, assembled, card, parts_of_surface, punch, write_casing
from pyNastran.op4.op4 import OP4
from scipy.sparse.linalg import eigsh

from femgear.errors import CaseError
from femgear.exchange.casing_files import mean_compliance, missing_compliance, output_names, read_casing
from femgear.exchange.nastran_matrices import dmig_matrices
from femgear.fe.elasticity import Material
from femgear.housing.two_way.response import MeshPaths, structure_lines
from validation.fixed_housing import EQUAL, solved
from validation.reference.annulus import annulus_frequencies

pytestmark = pytest.mark.usefixtures("coarse_states")

PRESSURE = np.radians(20.0)
KNOWN = {"direction": (np.sin(PRESSURE), -np.cos(PRESSURE)), "pitch_radius": 0.081, "damping_ratio": 0.02}
TINY = Casing(size=0.02, points=16, modes=8)
N = np.arange(-4, 5)
R, K0, M0, POINTS = 0.081, 2e7, 0.1, 8


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("casing")
    write_casing(TINY, path)
    return path


def read(folder, name, nodes="nodes.csv", **changes):
    known = {**KNOWN, "max_diameter": 4, "nodes": folder / nodes if nodes else None} | changes
    return read_casing(folder / name, **known)


def transfer(one, hertz):
    """Receptance from the path to itself, then to the sensors, coefficient by coefficient."""
    omega = 2 * np.pi * hertz
    q = 1 / (one.natural_frequency**2 - omega**2 + 2j * one.damping_ratio * one.natural_frequency * omega)
    held = (one.residual, one.sensor_residual)
    return [(s.T * q) @ one.ring_shape.conj() + r for s, r in zip((one.ring_shape, one.sensor_shape), held)]


@pytest.mark.parametrize(
    ("name", "nodes"),
    [("casing.pch", "nodes.csv"), ("casing.op4", "nodes.csv"), ("casing.uff", "nodes_held.csv")],
)
def test_formats_hold_the_same_casing(folder, name, nodes):
    """The gate is 1e-6 of the largest entry, at rest and below half of the highest mode."""
    arrays, other = read(folder, "casing.npz", None), read(folder, name, nodes)
    highest = arrays.natural_frequency[-1] / (2 * np.pi)
    for hertz in (0.0, 150.0, 800.0, 2500.0, 7000.0, 0.2 * highest, 0.49 * highest):
        for one, two in zip(transfer(arrays, hertz), transfer(other, hertz)):
            assert np.abs(one - two[: len(one)]).max() < 1e-6 * np.abs(one).max()


def test_a_set_runs_in_the_same_casing(folder):
    """Mesh forces and lines at the sensors of the small set of the validation; the gate is 1e-6."""
    paths, speeds = MeshPaths(97, EQUAL, 0.1, 3), np.array([8.0, 60.0])
    found = []
    for name in ("casing.npz", "casing.pch", "casing.uff"):
        one = read(folder, name, "nodes_held.csv" if name.endswith("uff") else "nodes.csv")
        one = one.combined(np.eye(one.sensor_shape.shape[1])[:, :2])
        response = solved(paths, one, speeds)
        found.append((response.force, structure_lines(one, response)[1]))
    for other in found[1:]:
        for a, b in zip(found[0], other):
            assert np.abs(a - b).max() < 1e-6 * np.abs(a).max()


def test_free_annulus_is_that_of_plane_stress():
    """Solid elements of the example against zeros of the Bessel determinant; the gate is 2 %."""
    casing = Casing(size=0.014, housed=False)
    basis, K, M = assembled(casing)
    shift = (2 * np.pi * 200.0) ** 2
    square, shape = eigsh(K, 24, M, sigma=-shift)
    axial = basis.get_dofs(elements=True).all("u^3")
    plane = (shape[axial] * (M @ shape)[axial]).sum(axis=0) < 0.2  # kinetic energy along the axis
    found = np.sqrt(np.abs(square[plane])) / (2 * np.pi)
    steel = Material(E, NU, RHO)
    exact = annulus_frequencies(casing.bore, casing.outer, steel, nodal_diameters=[2, 3])[:, 0]
    np.testing.assert_allclose(found[found > 50.0][:4], np.repeat(exact, 2), rtol=0.02)


def test_forces_on_the_feet(folder):
    """At rest they balance the load; at a frequency they are those of the matrices, solved directly."""
    one = read(folder, "casing.op4", damping_ratio=0.0)
    names = output_names(folder / "nodes.csv")
    assert names == (
        "top",
        "flange",
        *(f"foot {side} {axis}" for side in ("left", "right") for axis in "xyz"),
    )
    at, load = 0.7, np.array([[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]]) @ KNOWN["direction"]
    spread = np.exp(-1j * N * at)
    rest = np.real(transfer(one, 0.0)[1] @ spread)[2:].reshape(2, 3).sum(axis=0)
    np.testing.assert_allclose(rest, [*load, 0.0], atol=1e-4)
    # the same load of nine circumferential waves, on the points
    K, M = (matrix[1] for matrix in OP4(debug=False).read_op4(str(folder / "casing.op4")).values())
    angle, feet = np.load(folder / "casing.npz")["ring_angle"], np.arange(38, 44)
    free, dynamic = np.setdiff1d(np.arange(len(K)), feet), K - (2 * np.pi * 700.0) ** 2 * M
    wave = np.real(np.linalg.pinv(np.exp(1j * np.outer(angle, N))).conj().T @ spread)
    force = np.zeros(len(K))
    radial, tangential = (wave * part for part in KNOWN["direction"])
    force[:32:2] = radial * np.cos(angle) - tangential * np.sin(angle)
    force[1:32:2] = radial * np.sin(angle) + tangential * np.cos(angle)
    moved = np.linalg.solve(dynamic[np.ix_(free, free)], force[free])
    expected = -dynamic[np.ix_(feet, free)] @ moved
    found = np.real(transfer(one, 700.0)[1] @ spread)
    np.testing.assert_allclose(found[2:], expected, rtol=1e-8, atol=1e-8 * abs(expected).max())
    np.testing.assert_allclose(found[:2], moved[[34, 35]], rtol=1e-8)


@pytest.mark.parametrize(
    ("name", "nodes"),
    [("casing.op4", "nodes.csv"), ("casing.uff", "nodes_held.csv"), ("casing.npz", "nodes_held.csv")],
)
def test_modes_beyond_a_frequency_are_static(folder, name, nodes):
    every, few = read(folder, name, nodes), read(folder, name, nodes, max_frequency=6e3)
    assert len(few.natural_frequency) < 0.5 * len(every.natural_frequency)
    for one, two in zip(transfer(every, 0.0), transfer(few, 0.0)):
        np.testing.assert_allclose(two, one, atol=1e-12 * np.abs(one).max())
    assert missing_compliance(few, 1 / mean_compliance(every)) == ()


def ring(path, *, points=None, K=None, M=None, numbers=None, rows=None, cards=None):
    """Eight points on springs: every format of them in a folder, changed where it is asked for."""
    angle = 2 * np.pi * np.arange(POINTS) / POINTS
    place = around(angle) if points is None else points
    stiffness, mass = K0 * np.eye(2 * POINTS) if K is None else K, M0 * np.eye(2 * POINTS) if M is None else M
    OP4(debug=False).write_op4(str(path / "ring.op4"), {"KAAX": (1, stiffness), "MAAX": (1, mass)}, is_binary=False)
    if np.isfinite(stiffness).all() and not np.iscomplexobj(stiffness) and stiffness.shape == mass.shape == (16, 16):
        text = punch(stiffness, mass, [("ring", "12", x) for x in place])
        (path / "ring.pch").write_text(cards(text) if cards else text)
    lines = [f"{n},ring,{x[0]!r},{x[1]!r},{x[2]!r},,12" for n, x in enumerate(place.tolist(), 1)]
    header = "node,role,x,y,z,direction,dofs"
    (path / "nodes.csv").write_text("\n".join(rows([header, *lines]) if rows else [header, *lines]) + "\n")
    return path


def read_ring(path, name="ring.op4", **changes):
    known = {**KNOWN, "max_diameter": 2, "nodes": path / "nodes.csv"} | changes
    return read_casing(path / name, **known)


SMALL = "".join(
    f"DMIG    {name:8}{0:8d}{form:8d}{2:8d}{0:8d}\n"
    + "".join(f"DMIG    {name:8}{g:8d}{c:8d}{'':8}{g:8d}{c:8d}{value:>8}\n" for g in range(1, 9) for c in (1, 2))
    for name, form, value in (("K2", 1, "2.+7"), ("M2", 6, ".1"))
)


@pytest.mark.parametrize("name", ["ring.op4", "ring.pch", "small.pch", "free.pch"])
def test_points_on_springs(name, tmp_path):
    """Each point gives way by 1/k alone: C[n, n'] is 1/(k P) where n - n' is a multiple of the P points."""
    ring(tmp_path)
    (tmp_path / "small.pch").write_text(SMALL)
    free = "DMIG,K,0,6,2,0\nDMIG,M,0,6,2,0\n"
    for letter, value in (("K", "2.D7"), ("M", "1.E-1")):
        free += "".join(f"DMIG,{letter},{g},{c},,{g},{c},{value}\n" for g in range(1, 9) for c in (1, 2))
    (tmp_path / "free.pch").write_text(free)
    one = read_ring(tmp_path, name)
    np.testing.assert_allclose(one.natural_frequency, np.sqrt(K0 / M0), rtol=1e-12)
    np.testing.assert_allclose(transfer(one, 0.0)[0], np.eye(5) / (K0 * POINTS), atol=1e-12 / K0)
    assert mean_compliance(one) == pytest.approx(5 / (K0 * POINTS))


def test_punch_of_an_external_superelement(tmp_path):
    """Cards of others, and nodes in a coordinate system (CP): that of the ring a quarter turn ahead."""
    head = "$ STANDARD PUNCH\nBEGIN SUPER     111\nEXTRN   1       12\nDTI     TUG1    0       66      105\n"
    head += "CORD2R  7               0.      0.      0.      0.      0.      1.\n        0.      1.      0.\n"

    def cards(text):
        for n in range(1, 9):
            text = text.replace(f"GRID*   {n:16d}{'':16}", f"GRID*   {n:16d}{7:16d}")
        return head + text

    ring(tmp_path, cards=cards)
    (tmp_path / "nodes.csv").write_text("node,role\n" + "".join(f"{n},ring\n" for n in range(1, 9)))
    arrays = read_ring(tmp_path, "ring.pch")
    assert mean_compliance(arrays) == pytest.approx(5 / (K0 * POINTS))
    place = dmig_matrices(tmp_path / "ring.pch")[2]
    np.testing.assert_allclose(place[1], [0.0, R, 0.0], atol=1e-12)


def test_units_and_centre(tmp_path):
    """The same ring in mm, t, s, away from the origin, and a node with sensors above its centre."""
    angle, (x, y) = 2 * np.pi * np.arange(8) / 8, (30.0, -7.0)
    place = np.column_stack([x + 81 * np.cos(angle), y + 81 * np.sin(angle), 5 + 0 * angle])
    K, M = 2e4 * np.eye(18), 1e-4 * np.eye(18)
    K[16, 16] = 5e4
    OP4(debug=False).write_op4(str(tmp_path / "a.op4"), {"K": (6, K), "M": (6, M)}, is_binary=False)
    lines = [f"{n},ring,{a},{b},{c},,12" for n, (a, b, c) in enumerate(place.tolist(), 1)]
    lines += [f"9,sensor {way},{x},{y + 50},5,{way},12" for way in ("x", "-tangential", "radial", "tangential")]
    lines += [f",centre,{x},{y},5,,"]
    (tmp_path / "nodes.csv").write_text("node,role,x,y,z,direction,dofs\n" + "\n".join(lines))
    one = read_ring(tmp_path, "a.op4", units="mm-t-s", expected_stiffness=K0 * POINTS / 5 * 3)
    assert mean_compliance(one) == pytest.approx(5 / (K0 * POINTS))
    moved = (one.sensor_shape / one.natural_frequency[:, None] ** 2).T @ one.sensor_shape
    x, y = 1 / 5e7, 1 / K0
    expected = [[x, x, 0, -x], [x, x, 0, -x], [0, 0, y, 0], [-x, -x, 0, x]]
    np.testing.assert_allclose(moved, expected, rtol=1e-12, atol=1e-12 * y)


def _sets(folder, path, change):
    """The universal file of the casing with changed datasets."""
    sets = pyuff.UFF(str(folder / "casing.uff")).read_sets()
    pyuff.UFF(str(path)).write_sets([change(one) for one in sets], mode="overwrite")
    return path


def _of_55(**changes):
    return lambda one: one | changes if one["type"] == 55 else one


def test_modal_masses_and_damping(folder, tmp_path):
    def change(one):
        if one["type"] != 55:
            return one
        twice = {f"r{c}": 2 * one[f"r{c}"] for c in (1, 2, 3)}
        return one | twice | {"modal_m": 4.0, "modal_damp_vis": 0.07}

    scaled = _sets(folder, tmp_path / "a.unv", change)
    whole = read(folder, "casing.uff", "nodes_held.csv")
    again = read_casing(scaled, nodes=folder / "nodes_held.csv", max_diameter=4, **KNOWN | {"damping_ratio": None})
    np.testing.assert_allclose(again.damping_ratio, 0.07)
    np.testing.assert_allclose(again.ring_shape, whole.ring_shape, atol=2e-5 * abs(whole.ring_shape).max())


def test_arrays_of_netcdf_and_units(folder, tmp_path):
    import xarray as xr

    with np.load(folder / "casing.npz") as stored:
        arrays = dict(stored)
    tonnes = arrays | {name: arrays[name] * np.sqrt(1e3) for name in ("ring_shape", "sensor_shape")}
    for name, one in (("kg.nc", arrays), ("t.nc", tonnes)):
        data = {key: ([f"{key}{i}" for i in range(np.ndim(v))], v) for key, v in one.items()}
        xr.Dataset(data).to_netcdf(tmp_path / name, engine="h5netcdf")
    known = {**KNOWN, "max_diameter": 4}
    for name, units in (("kg.nc", "SI"), ("t.nc", "mm-t-s")):
        again = read_casing(tmp_path / name, units=units, **known)
        np.testing.assert_allclose(again.ring_shape, read(folder, "casing.npz").ring_shape, rtol=1e-12)


@pytest.mark.parametrize(
    ("factor", "units", "words"),
    [(1e3, "SI", "mm-t-s"), (2e-3, "mm-t-s", "like SI"), (4e6, "SI", "mm-kg-ms")],
)
def test_units_are_told_by_the_stiffness(folder, factor, units, words):
    stiffness = 1 / mean_compliance(read(folder, "casing.npz"))
    read(folder, "casing.npz", expected_stiffness=20 * stiffness)
    expected = stiffness * factor * (1e3 if units == "mm-t-s" else 1.0)
    with pytest.raises(CaseError, match=words) as error:
        read(folder, "casing.npz", units=units, expected_stiffness=expected)
    assert error.value.code == "E-UNITS"


def test_missing_compliance_is_said(folder):
    whole = read(folder, "casing.op4")
    few = read(folder, "casing.op4", max_frequency=1e3)
    bare = type(few)(**{**vars(few), "residual": 0 * few.residual})
    (finding,) = missing_compliance(bare, 1 / mean_compliance(whole))
    part = 1 - mean_compliance(bare) / mean_compliance(whole)
    assert f"{100 * part:.0f} %" in str(finding) and finding.code == "W-RESIDUAL" and "without residual" in str(finding)


def around(angle):
    return R * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])


I16 = np.eye(16)
ONE = np.zeros((16, 16))
ONE[2, 3] = 1.0


@pytest.mark.parametrize(
    ("changed", "known", "code"),
    [
        ({}, {"units": "inch"}, "E-CHOICE"),
        ({}, {"nodes": None}, "E-KEY-MISSING"),
        ({}, {"damping_ratio": None}, "E-KEY-MISSING"),
        ({}, {"damping_ratio": 1.5}, "E-DAMPING"),
        ({}, {"max_diameter": 3}, "E-COUNT"),
        ({}, {"name": "none.op4"}, "E-FILE"),
        ({}, {"name": "nodes.csv"}, "E-FILE"),
        ({}, {"units": "mm-t-s"}, "E-UNITS"),
        ({}, {"pitch_radius": 81.0}, "E-UNITS"),
        ({}, {"pitch_radius": 0.083}, "E-RANGE"),
        ({"rows": lambda r: ["n,role", *r[1:]]}, {}, "E-KEY-MISSING"),
        ({"rows": lambda r: [*r[:-1], "8,rung,1,2,3,,"]}, {}, "E-CHOICE"),
        ({"rows": lambda r: [*r[:-1], "8,sensor,1,2,3,,"]}, {}, "E-CHOICE"),
        ({"rows": lambda r: [*r[:-1], "8,ring,1,,3,,"]}, {}, "E-CHOICE"),
        ({"rows": lambda r: [*r[:-1], "8,ring,1,nan,3,,"]}, {}, "E-CHOICE"),
        ({"rows": lambda r: [*r, r[-1]]}, {}, "E-DUPLICATE"),
        ({"rows": lambda r: [r[0]]}, {}, "E-COUNT"),
        ({"rows": lambda r: [*r[:-1], "8,ring,,,,,12"]}, {}, "E-KEY-MISSING"),
        ({"rows": lambda r: [*r[:-1], "8,sensor a,0,0,1,z,12"]}, {"max_diameter": 1}, "E-SHAPE"),
        ({"rows": lambda r: [*r, "9,foot a,0,0,1,,123"]}, {}, "E-SHAPE"),
        ({"rows": lambda r: [*r[:-1], "8,foot a,0,0,1,,12"]}, {}, "E-SUPPORT"),
        ({"points": around(np.arange(8) / 4)}, {}, "E-RANGE"),
        ({"points": around(np.array([0, 0, *range(1, 7)]))}, {}, "E-DUPLICATE"),
        ({"points": around(np.arange(8)) + 0.02 * np.outer(np.arange(8) == 3, [0, 0, 1])}, {}, "E-RANGE"),
        ({"K": K0 * (I16 + ONE)}, {}, "E-SYMMETRY"),
        ({"K": K0 * (1 + 0.02j) * I16}, {}, "E-TYPE"),
        ({"M": M0 * np.eye(15)}, {}, "E-SHAPE"),
        ({"M": M0 * np.diag([1.0] * 15 + [-1.0])}, {}, "E-MASS"),
        ({"M": M0 * np.diag([1.0] * 15 + [0.0]), "K": K0 * np.diag([1.0] * 15 + [0.0])}, {}, "E-MECHANISM"),
        ({"K": K0 * np.diag([1.0] * 15 + [0.0])}, {}, "E-MECHANISM"),
        ({"K": K0 * np.diag([1.0] * 15 + [-1.0])}, {}, "E-MECHANISM"),
        ({"cards": lambda t: t.replace("MAAX", "NAAX")}, {"name": "ring.pch"}, "E-COUNT"),
        (
            {"cards": lambda t: t.replace("KAAX", "K1AX") + "DMIG,K2AX,0,6,2,0\nDMIG,K2AX,1,1,,1,1,2.\n"},
            {"name": "ring.pch"},
            "E-COUNT",
        ),
        ({"cards": lambda t: t[:-40]}, {"name": "ring.pch"}, "E-FILE"),
        ({"cards": lambda t: t.replace(f"{1:16d}{'':16}", f"{1:16d}{2:16d}", 1)}, {"name": "ring.pch"}, "E-FILE"),
        (
            {"cards": lambda t: t.replace("*       " + card(0.0), f"*       {card(0.0)}{2:16d}", 1)},
            {"name": "ring.pch"},
            "E-KEY-MISSING",
        ),
    ],
)
def test_refused_matrices(changed, known, code, tmp_path):
    ring(tmp_path, **changed)
    with pytest.raises(CaseError) as error:
        read_ring(tmp_path, **known)
    assert error.value.code == code and error.value.file and error.value.limit


def test_points_that_miss_the_ring_are_named(tmp_path):
    ring(tmp_path, rows=lambda r: [one.replace(",ring,-0.081,", ",ring,-0.085,") for one in r])
    with pytest.raises(CaseError, match=r"1 of 8 points miss the ring") as error:
        read_ring(tmp_path)
    assert error.value.value == "node 5, 4 mm off"


@pytest.mark.parametrize(
    ("change", "nodes", "code"),
    [
        (_of_55(modal_m=0.0), "nodes_held.csv", "E-MASS"),
        (_of_55(modal_damp_vis=0.0), "nodes_held.csv", "E-KEY-MISSING"),
        (_of_55(freq=-3.0), "nodes_held.csv", "E-MECHANISM"),
        (_of_55(analysis_type=3, eig=1 + 2j, r1=np.ones(18) + 1j), "nodes_held.csv", "E-TYPE"),
        (lambda one: one | {"length": 1000.0} if one["type"] == 164 else one, "nodes_held.csv", "E-UNITS"),
        (lambda one: one, "nodes.csv", "E-SUPPORT"),
    ],
)
def test_refused_modes(folder, change, nodes, code, tmp_path):
    path = _sets(folder, tmp_path / "a.uff", change)
    with pytest.raises(CaseError) as error:
        read_casing(path, nodes=folder / nodes, max_diameter=4, **KNOWN | {"damping_ratio": None})
    assert (error.value.code, error.value.file) == (code, str(path)) and error.value.limit


@pytest.mark.parametrize("kind", ["npz", "nc", "pch", "op4", "uff"])
@pytest.mark.parametrize("content", [b"", b"no casing\n" * 9, b"\x00\xff\x13" * 999])
def test_damaged_files(kind, content, folder, tmp_path):
    path = tmp_path / f"a.{kind}"
    path.write_bytes(content)
    with pytest.raises(CaseError) as error:
        read_casing(path, nodes=folder / "nodes_held.csv", max_diameter=4, **KNOWN)
    assert error.value.file == str(path)


def test_universal_file_that_breaks_off(folder, tmp_path):
    whole, path = (folder / "casing.uff").read_text(encoding="utf-8"), tmp_path / "a.uff"
    path.write_text(whole[: int(0.4 * len(whole))], encoding="utf-8")
    with pytest.raises(CaseError, match="breaks off") as error:
        read_casing(path, nodes=folder / "nodes_held.csv", max_diameter=4, **KNOWN)
    assert error.value.code == "E-FILE"


@pytest.mark.parametrize(
    ("change", "code", "key"),
    [
        (lambda a: {"ring_shape": a["ring_shape"] * (1 + 0.1j)}, "E-TYPE", "arrays"),
        (lambda a: {"ring_angle": np.degrees(a["ring_angle"])}, "E-UNITS", "ring_angle"),
        (
            lambda a: {"ring_angle": np.append(a["ring_angle"][1] - 2 * np.pi, a["ring_angle"][1:])},
            "E-DUPLICATE",
            "ring_angle",
        ),
        (lambda a: {"ring_shape": 0 * a["ring_shape"]}, "E-COUNT", "ring_shape"),
        (lambda a: {"sensor_shape": np.float64(1.0)}, "E-SHAPE", "sensor_shape"),
        (lambda a: {"natural_frequency": 1e-200 * a["natural_frequency"]}, "E-RANGE", "natural_frequency"),
        (
            lambda a: {"ring_angle": np.where(np.arange(len(a["ring_angle"])) == 3, np.nan, a["ring_angle"])},
            "E-FINITE",
            "ring_angle",
        ),
        (lambda a: {"ring_shape": 1e200 * a["ring_shape"]}, "E-FINITE", "ring_shape"),
        (lambda a: {"sensor_shape": np.array([["top"]])}, "E-TYPE", "arrays"),
        (
            lambda a: {name: a[name][:0] for name in ("natural_frequency", "ring_shape", "sensor_shape")},
            "E-COUNT",
            "ring_shape",
        ),
    ],
)
def test_refused_arrays(change, code, key, folder, tmp_path):
    with np.load(folder / "casing.npz") as stored:
        arrays = dict(stored)
    np.savez(tmp_path / "a.npz", **arrays | change(arrays))
    with pytest.raises(CaseError) as error:
        read_casing(tmp_path / "a.npz", max_diameter=4, expected_stiffness=1e8, **KNOWN)
    assert (error.value.code, error.value.key) == (code, key) and error.value.limit


def test_arrays_of_other_names_are_not_unpacked(folder, tmp_path, monkeypatch):
    """200 MB of zeros that nobody named, a fifth of a megabyte on disk; and named ones beyond the limit."""
    path, size = tmp_path / "a.npz", 200_000_000
    shutil.copy(folder / "casing.npz", path)
    header = f"{{'descr': '|u1', 'fortran_order': False, 'shape': ({size},), }}".ljust(117) + "\n"
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive:
        head = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header.encode()
        archive.writestr("more.npy", head + bytes(size))
    tracemalloc.start()
    read(folder, path)
    assert tracemalloc.get_traced_memory()[1] < 50e6
    tracemalloc.stop()
    monkeypatch.setattr("femgear.exchange.casing_files._MOST_BYTES", 10_000)
    with pytest.raises(CaseError) as error:
        read(folder, path)
    assert error.value.code == "E-MEMORY" and error.value.file == str(path)


def test_reduced_matrices_by_the_names_of_nastran(tmp_path):
    """KAA and MAA among other names of EXTSEOUT: sqrt(4e7/0.1)/(2 pi) = 3183.1 Hz."""
    angle = 2 * np.pi * np.arange(8) / 8
    matrices = {"K4XX": np.eye(1), "KAA": 4e7 * I16, "KASMX": np.eye(1), "MAA": 0.1 * I16, "MASMX": np.eye(1)}
    OP4(debug=False).write_op4(
        str(tmp_path / "a.op4"), {name: (6, one) for name, one in matrices.items()}, is_binary=False
    )
    lines = [f"{n},ring,{x},{y},{z},12" for n, (x, y, z) in enumerate(around(angle).tolist(), 1)]
    (tmp_path / "nodes.csv").write_text("node,role,x,y,z,dofs\n" + "\n".join([*lines, "1,sensor top,,,,12"]))
    one = read_ring(tmp_path, "a.op4")
    np.testing.assert_allclose(one.natural_frequency / (2 * np.pi), 3183.0989, rtol=1e-6)


def test_modes_of_dataset_2414(folder, tmp_path):
    """The casing's modes as analysis data, with a binary dataset of another measurement before them."""

    def change(one):
        if one["type"] != 55:
            return one
        motion = np.column_stack([one[f"r{c}"] for c in (1, 2, 3)])
        return {
            "type": 2414,
            "analysis_dataset_label": 1,
            "analysis_dataset_name": "mode",
            "dataset_location": 1,
            **{f"id{i}": "NONE" for i in range(1, 6)},
            "model_type": 1,
            "analysis_type": 2,
            "data_characteristic": 2,
            "result_type": 8,
            "data_type": 4,
            "number_of_data_values_for_the_data_component": 3,
            "record12_field2": one["freq"],
            "record12_field4": one["modal_m"],
            "node_nums": one["node_nums"],
            "data_at_node": list(motion),
        }

    path = _sets(folder, tmp_path / "a.unv", change)
    binary = b"    58b     1     2          11          24     0     0           0           0\n"
    text = b"NONE\n" * 11
    head = b"    -1\n" + binary + text + b"    -1\n" * 3 + b"abc" + b"\n    -1\n"
    path.write_bytes(head + path.read_bytes())
    whole, again = read(folder, "casing.uff", "nodes_held.csv"), read(folder, path, "nodes_held.csv")
    np.testing.assert_allclose(again.natural_frequency, whole.natural_frequency, rtol=1e-5)
    np.testing.assert_allclose(again.ring_shape, whole.ring_shape, atol=2e-5 * abs(whole.ring_shape).max())
    nothing, sets = tmp_path / "b.unv", pyuff.UFF(str(folder / "casing.uff")).read_sets()
    pyuff.UFF(str(nothing)).write_sets([one for one in sets if one["type"] != 55], mode="overwrite")
    with pytest.raises(CaseError, match="holds no modes") as error:
        read(folder, nothing, "nodes_held.csv")
    assert error.value.code == "E-COUNT"


def test_complex_arrays_without_imaginary_part_and_areas_in_mm(folder, tmp_path):
    with np.load(folder / "surface.npz") as stored:
        arrays = dict(stored)
    tonnes = {name: arrays[name] * np.sqrt(1e3) for name in ("ring_shape", "sensor_shape")}
    tonnes |= {"sensor_area": 1e6 * arrays["sensor_area"], "damping_ratio": arrays["damping_ratio"] + 0j}
    np.savez(tmp_path / "a.npz", **arrays | tonnes)
    known = {**KNOWN, "max_diameter": 4}
    one, other = (
        read_casing(tmp_path / "a.npz", units="mm-t-s", **known),
        read_casing(folder / "surface.npz", **known),
    )
    assert one.sensor_area is not None and other.sensor_area is not None
    np.testing.assert_allclose(one.sensor_area, other.sensor_area, rtol=1e-12)
    np.testing.assert_allclose(one.sensor_shape, other.sensor_shape, rtol=1e-12)


def test_parts_of_the_surface(folder):
    """The outer surface is closed but for the bore and the lower faces of the feet (divergence theorem)."""
    basis = assembled(TINY)[0]
    across, area = parts_of_surface(TINY, basis)
    flows = []
    for axis in range(3):
        moved = np.zeros(basis.N)
        moved[basis.get_dofs(elements=True).all(f"u^{axis + 1}")] = 1.0
        assert np.abs(across.T @ moved).max() <= 1.0 + 1e-9
        flows.append(area @ (across.T @ moved))
    np.testing.assert_allclose(flows, [0.0, 2 * TINY.foot * TINY.width, 0.0], atol=1e-12)
    with np.load(folder / "surface.npz") as stored:
        area, shape = stored["sensor_area"], stored["sensor_shape"]
    assert (area[:2] == 0).all() and (area[2:] > 0).all() and shape.shape[1] == len(area)


def test_coordinates_without_mass_are_those_of_vanishing_mass(tmp_path):
    """Points of the ring on springs to masses on springs to the ground, against masses of 1e-9 kg on them."""
    angle = 2 * np.pi * np.arange(8) / 8
    K = np.kron([[1.0, -1.0], [-1.0, 3.0]], K0 * I16)
    lines = [f"{n},ring,{x},{y},{z},12" for n, (x, y, z) in enumerate(around(angle).tolist(), 1)]
    lines.append("1,sensor top,,,,12")
    (tmp_path / "nodes.csv").write_text("node,role,x,y,z,dofs\n" + "\n".join(lines))
    known = []
    for name, mass in (("none", 0.0), ("little", 1e-9)):
        M = np.kron(np.diag([0.0, 1.0]), M0 * I16) + np.kron(np.diag([1.0, 0.0]), mass * I16)
        path = tmp_path / f"{name}.op4"
        OP4(debug=False).write_op4(str(path), {"K": (6, K), "M": (6, M)}, is_binary=False)
        known.append(read_ring(tmp_path, path.name, damping_ratio=0.0))
    none, little = known
    assert len(none.natural_frequency) == 16 and len(little.natural_frequency) == 32
    np.testing.assert_allclose(mean_compliance(none), mean_compliance(little), rtol=1e-9)
    for hertz in (0.0, 700.0, 4000.0):
        for a, b in zip(transfer(none, hertz), transfer(little, hertz)):
            np.testing.assert_allclose(a, b, atol=1e-6 * np.abs(b).max())
