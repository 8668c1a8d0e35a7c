"""Matrices in files of Nastran: those of a beam that Nastran itself reduced, and entries of small files."""

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh

from femgear.errors import CaseError
from femgear.exchange.nastran_matrices import dmig_matrices, op4_matrices
from femgear.exchange.node_tables import Node

DMIG = "DMIG,K,0,6,2,0\nDMIG,K,7,1,,7,1,2.D7\nDMIG,K,7,1,,9,3,-1.D7\nDMIG,K,9,3,,9,3,3.D7\n"


def test_eigenvalues_that_nastran_printed():
    """A beam by MSC Nastran 2013: PARAM,EXTOUT,matrixpch, and the table of its .f06 (MIT, see the file)."""
    (K, M), row, _ = dmig_matrices(Path(__file__).with_name("nastran_beam.pch"))
    assert sorted(row) == [(n, c) for n in range(1, 6) for c in (3, 4)]
    printed = "1.764385E+04 1.800475E+04 6.542455E+05 6.645972E+05 7.545368E+06 7.580662E+06 6.257528E+07"
    found = eigh(K.real, M.real, eigvals_only=True)[2:]
    assert [f"{one:.6E}" for one in found] == [*printed.split(), "6.263273E+07"]


def test_entries_stand_at_node_and_component_and_symmetric_ones_twice(tmp_path):
    path = tmp_path / "two.pch"
    path.write_text(DMIG + "DMIG,M,0,6,2,0\nDMIG,M,7,1,,7,1,0.5\nDMIG,M,9,3,,9,3,0.25\n")
    (stiffness, mass), row, place = dmig_matrices(path)
    assert row == {(7, 1): 0, (9, 3): 1} and place == {}
    assert stiffness.real.tolist() == [[2e7, -1e7], [-1e7, 3e7]] and not stiffness.imag.any()
    assert np.diag(mass.real).tolist() == [0.5, 0.25]


def test_a_file_without_mass_says_what_is_looked_for(tmp_path):
    (tmp_path / "one.pch").write_text(DMIG)
    with pytest.raises(CaseError, match="one stiffness and one mass") as error:
        dmig_matrices(tmp_path / "one.pch")
    assert error.value.code == "E-COUNT" and error.value.value == "K" and "MAAX" in error.value.limit


SYSTEM = {"A": (1.0, -2.0, 0.5), "B": (1.3, -1.6, 2.0), "C": (3.0, -1.0, 0.2)}
"""Origin of a coordinate system, a point on its third axis, one in its plane 1-3."""
PLACE = (2.0, 1.0, 1.5)


def place_of(kind, numbers):
    """Place of the coordinates of a system: x, y, z, or r, azimuth, z, or r, polar angle, azimuth."""
    origin, third, plane = (np.array(SYSTEM[point]) for point in "ABC")
    z = (third - origin) / np.linalg.norm(third - origin)
    y = np.cross(z, plane - origin)
    y /= np.linalg.norm(y)
    a, b, c = numbers
    if kind == "R":
        local = (a, b, c)
    elif kind == "C":
        local = (a * np.cos(b), a * np.sin(b), c)
    else:
        local = (a * np.sin(b) * np.cos(c), a * np.sin(b) * np.sin(c), a * np.cos(b))
    return origin + np.array([np.cross(y, z), y, z]).T @ local


def axes_at(kind, place):
    """Directions (3, 3) in which a point moves as one of its coordinates grows: differences of places."""
    from scipy.optimize import fsolve

    numbers = fsolve(lambda x: place_of(kind, x) - place, (1.5, 0.9, 0.8), xtol=1e-14)
    ways = [place_of(kind, numbers + step) - place_of(kind, numbers - step) for step in 1e-6 * np.eye(3)]
    axes = np.array([way / np.linalg.norm(way) for way in ways])
    assert np.linalg.norm(place_of(kind, numbers) - place) < 1e-9
    return axes * np.sign(numbers[0]) if kind == "R" else axes


def local_punch(path, kind, matrices, components="123456", place=PLACE):
    """Write matrices of node 7 whose displacements are in a system of its own, and of the scalar coordinate 9, 0."""
    points = ",".join(repr(x) for point in "AB" for x in SYSTEM[point])
    lines = [f"CORD2{kind},4,,{points},+\n+," + ",".join(map(repr, SYSTEM["C"]))]
    lines.append("GRID,7,," + ",".join(map(repr, place)) + ",4")
    labels = [(7, int(c)) for c in components] + [(9, 0)]
    for name, matrix in zip("KM", matrices):
        lines.append(f"DMIG,{name},0,6,2,0")
        for j, (node, way) in enumerate(labels):
            for i, (other, across) in enumerate(labels[: j + 1]):
                lines.append(f"DMIG,{name},{node},{way},,{other},{across},{matrix[i, j]:.12E}".replace("E", "D"))
    path.write_text("\n".join(lines) + "\n")
    return path


def symmetric(size, seed):
    values = np.random.default_rng(seed).normal(size=(size, size))
    return values @ values.T + np.eye(size)


@pytest.mark.parametrize("kind", "RCS")
def test_displacements_in_systems_of_their_own_come_in_the_basic_one(kind, tmp_path):
    basic = [symmetric(7, seed) for seed in (1, 2)]
    local = axes_at(kind, np.array(PLACE))
    turn = np.eye(7)
    turn[:3, :3] = turn[3:6, 3:6] = local  # displacements along the axes of the system, of those in the basic one
    path = local_punch(tmp_path / "a.pch", kind, [turn @ matrix @ turn.T for matrix in basic])
    matrices, row, place = dmig_matrices(path)
    assert place[7] == pytest.approx(PLACE)
    at = [row[label] for label in [*((7, c) for c in range(1, 7)), (9, 0)]]
    for matrix, expected in zip(matrices, basic):
        assert np.abs(matrix.real[np.ix_(at, at)] - expected).max() < 1e-6 * np.abs(expected).max()


def test_components_that_are_left_out_must_not_be_turned_into_others(tmp_path):
    path = local_punch(tmp_path / "a.pch", "C", [symmetric(3, seed) for seed in (1, 2)], components="12")
    with pytest.raises(CaseError, match="some are left out") as refused:
        dmig_matrices(path)
    assert refused.value.code == "E-CHOICE" and "node 7, components 1, 2" in str(refused.value)
    # about the third axis of the basic system a cylinder turns the first two among themselves
    upright = path.read_text().replace("1.0,-2.0,0.5,1.3,-1.6,2.0", "0.0,0.0,0.0,0.0,0.0,1.0")
    path.write_text(upright.replace("+,3.0,-1.0,0.2", "+,1.0,0.0,0.0"))
    matrices, row, _ = dmig_matrices(path)
    azimuth = np.arctan2(PLACE[1], PLACE[0])
    turn = np.array([[np.cos(azimuth), np.sin(azimuth)], [-np.sin(azimuth), np.cos(azimuth)]])
    at = [row[7, 1], row[7, 2]]
    assert np.allclose(matrices[0].real[np.ix_(at, at)], turn.T @ symmetric(3, 1)[:2, :2] @ turn, rtol=1e-9)


def op4_text(*names):
    lines = []
    for name in names:
        lines += [f"{2:8d}{2:8d}{6:8d}{2:8d}{name:8}1P,3E23.16"]
        for k in (1, 2):
            lines += [f"{k:8d}{k:8d}{1:8d}", f"{float(k):23.16E}"]
        lines += [f"{3:8d}{1:8d}{1:8d}", f"{1.0:23.16E}"]
    return "\n".join(lines) + "\n"


TABLE = (Node(1, "seat", "A", "radial", "12", None),)


def test_names_of_external_superelements(tmp_path):
    """EXTSEOUT writes K4XX and KASMX beside KAA and MAA."""
    path = tmp_path / "a.op4"
    path.write_text(op4_text("K4XX", "KAA", "KASMX", "MAA"))
    (stiffness, mass), row, _ = op4_matrices(path, TABLE)
    assert np.array_equal(stiffness, np.diag([1.0, 2.0])) and mass.shape == (2, 2) and row == {(1, 1): 0, (1, 2): 1}


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"\x18\0\0\0" + bytes(range(200)), "a binary OUTPUT4"),
        (b"", "the file is empty"),
        (op4_text("KAA", "MAA")[:150].encode(), "it may break off"),
    ],
)
def test_binary_files_are_told_from_files_that_break_off(data, words, tmp_path):
    (tmp_path / "a.op4").write_bytes(data)
    with pytest.raises(CaseError, match=words) as refused:
        op4_matrices(tmp_path / "a.op4", TABLE)
    assert refused.value.code == "E-FILE"
