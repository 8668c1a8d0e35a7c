"""Superelements: formats and units hold one structure, a rigid body splits off, what is none is refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from casing import punch
from casings import CENTRE, MASS, TENSOR, body_matrices_of, casing_paths, write_casing_file
from pyNastran.op4.op4 import OP4
from scipy.linalg import eigh

from femgear.errors import CaseError
from femgear.exchange.casing_files import read_casing
from femgear.exchange.superelement import free_body_problems, modal_body, read_superelement

SEAT, FOOT = (3e8, 3e8, 5e8, 7e4, 7e4, 9e4), (4e8, 6e8, 2e8)
PATHS = casing_paths(SEAT, FOOT)
LARGEST = 1e-9


def apart(found, expected) -> float:
    return float(np.abs(found - expected).max() / np.abs(expected).max())


def written(folder: Path, matrices=None, **options):
    write_casing_file(folder, PATHS, matrices)
    return read_superelement(folder / "casing.npz", folder / "nodes.csv", **options)


@pytest.fixture(scope="module")
def body(tmp_path_factory):
    return written(tmp_path_factory.mktemp("casing"))


def test_arrays_come_as_they_are(body):
    stiffness, mass = body_matrices_of(PATHS)
    assert (body.stiffness == stiffness).all()
    assert (body.mass == mass).all()
    assert list(body.of_role("foot")) == ["left front", "left rear", "right front", "right"]
    assert body.components(body.of_role("foot")["right"]) == (1, 2, 3)
    assert body.place[1] == pytest.approx(CENTRE)
    assert body.size == pytest.approx(0.26)


def test_millimetres_and_tonnes_are_metres_and_kilograms(tmp_path, body):
    stiffness, mass = body_matrices_of(PATHS)
    length = np.ones(len(mass))
    length[[at for (_, component), at in body.row.items() if component > 3]] = 1e3
    scaled = [1e-3 * np.outer(length, length) * matrix for matrix in (stiffness, mass)]
    write_casing_file(tmp_path, PATHS, scaled)
    lines = [line.split(",") for line in (tmp_path / "nodes.csv").read_text().splitlines()]
    rows = [[*row[:2], *(repr(1e3 * float(x)) for x in row[2:5]), row[5]] for row in lines[1:]]
    (tmp_path / "nodes.csv").write_text("\n".join(",".join(row) for row in [lines[0], *rows]))
    other = read_superelement(tmp_path / "casing.npz", tmp_path / "nodes.csv", units="mm-t-s")
    assert apart(other.stiffness, body.stiffness) <= LARGEST
    assert apart(other.mass, body.mass) <= LARGEST
    assert other.place[3] == pytest.approx(body.place[3])


@pytest.mark.parametrize("kind", ["op4", "pch", "nc"])
def test_other_formats_hold_the_same_structure(tmp_path, body, kind):
    import xarray as xr

    write_casing_file(tmp_path, PATHS)
    path = tmp_path / f"casing.{kind}"
    matrices = {"KAAX": body.stiffness, "MAAX": body.mass}
    if kind == "op4":
        OP4(debug=False).write_op4(str(path), {name: (6, m) for name, m in matrices.items()}, is_binary=False)
    elif kind == "nc":
        xr.Dataset({"stiffness": (("i", "j"), body.stiffness), "mass": (("i", "j"), body.mass)}).to_netcdf(path)
    else:
        nodes = [("", node.dofs, body.place[node.number]) for node in body.nodes]
        path.write_text(punch(body.stiffness, body.mass, nodes))
    other = read_superelement(path, tmp_path / "nodes.csv")
    at = [other.row[label] for label in body.row]
    own = [*body.row.values()]
    assert apart(other.stiffness[np.ix_(at, at)], body.stiffness[np.ix_(own, own)]) <= 1e-8
    assert apart(other.mass[np.ix_(at, at)], body.mass[np.ix_(own, own)]) <= 1e-8


def test_the_rigid_body_is_that_of_all_masses(body):
    interface = [node.number for node in body.nodes if node.role != "sensor"]
    found = modal_body(body, interface)
    masses = np.array([MASS, *(path.mass for path in PATHS)])
    places = np.array([CENTRE, *(path.place for path in PATHS)])
    centre = masses @ places / masses.sum()
    assert found.centre == pytest.approx(centre, rel=1e-12)
    away = places - centre
    tensor = TENSOR + 4 * 0.05e-4 * np.eye(3)
    tensor = tensor + (masses * (away**2).sum(axis=1)).sum() * np.eye(3) - (away.T * masses) @ away
    expected = masses.sum() * np.eye(6)
    expected[3:, 3:] = tensor
    assert found.rigid_mass == pytest.approx(expected, abs=1e-9)


def test_elastic_motions_with_the_rigid_ones_have_all_modes_of_the_structure(body):
    interface = [node.number for node in body.nodes if node.role != "sensor"]
    found = modal_body(body, interface)
    square = eigh(np.diag(found.stiffness), found.mass, eigvals_only=True)
    assert apart(square, eigh(body.stiffness, body.mass, eigvals_only=True)[6:]) <= LARGEST


def test_a_reduced_structure_is_the_whole_one_at_rest(tmp_path, body):
    """Static shapes and two modes in place of the body's own coordinates; the interface gives way as before."""
    stiffness, mass = body.stiffness, body.mass
    inner, outer = np.arange(6), np.arange(6, len(stiffness))
    shapes = np.zeros((len(stiffness), len(outer) + 2))
    shapes[outer, np.arange(len(outer))] = 1.0
    shapes[inner, : len(outer)] = -np.linalg.solve(stiffness[:6, :6], stiffness[:6, 6:])
    shapes[inner, len(outer) :] = eigh(stiffness[:6, :6], mass[:6, :6])[1][:, :2]
    paths = [path for path in PATHS]
    write_casing_file(tmp_path, paths, [shapes.T @ m @ shapes for m in (stiffness, mass)])
    lines = (tmp_path / "nodes.csv").read_text().splitlines()
    (tmp_path / "nodes.csv").write_text("\n".join([lines[0], *lines[2:]]))
    reduced = read_superelement(tmp_path / "casing.npz", tmp_path / "nodes.csv")
    assert not list(free_body_problems(reduced))
    interface = [node.number for node in reduced.nodes]
    one, two = modal_body(body, interface), modal_body(reduced, interface, max_frequency=10.0)
    assert len(two.stiffness) == len(outer) - 6
    # forces without resultant: rigid motions of both are another
    numbers = interface[:4]
    load = [np.vstack([m.shape[number] for number in numbers]) for m in (one, two)]
    rigid = np.vstack([body.rigid_motions(CENTRE)[[body.row[n, c] for c in range(1, 7)]] for n in numbers])
    free = np.linalg.svd(rigid.T)[2][6:]
    give = [free @ (m / k.stiffness) @ m.T @ free.T for m, k in zip(load, (one, two), strict=True)]
    assert apart(give[1], give[0]) <= LARGEST


def test_what_gives_way_nowhere_is_rigid(tmp_path):
    paths = casing_paths([1e18] * 6, [1e18] * 3)
    write_casing_file(tmp_path, paths)
    body = read_superelement(tmp_path / "casing.npz", tmp_path / "nodes.csv")
    found = modal_body(body, [node.number for node in body.nodes if node.role != "sensor"], max_frequency=1e6)
    assert np.isinf(found.stiffness).all()


def codes(body) -> list[str]:
    return [one.code for one in free_body_problems(body)]


def changed(folder, change):
    matrices = [matrix.copy() for matrix in body_matrices_of(PATHS)]
    change(*matrices)
    return written(folder, matrices)


def _held(stiffness, mass):
    stiffness[np.arange(6), np.arange(6)] += 1e8


def _cut(stiffness, mass):
    free = replace(PATHS[0], stiffness=(0.0,) * 6)
    stiffness[:] = body_matrices_of([free, *PATHS[1:]])[0]


def _lost(stiffness, mass):
    stiffness[7, 7] = -stiffness[7, 7]


def _soft(stiffness, mass):
    stiffness[0, 0] += 1e6


def _light(stiffness, mass):
    mass[9:12, 9:12] = 0.0


@pytest.mark.parametrize(
    ("change", "code"),
    [(_held, "E-SUPPORT"), (_soft, "E-SUPPORT"), (_cut, "E-MECHANISM"), (_lost, "E-MECHANISM"), (_light, "E-MASS")],
)
def test_what_is_no_free_elastic_body_is_refused(tmp_path, change, code):
    assert codes(changed(tmp_path, change)) == [code]


def test_a_node_off_its_place_makes_turns_carry_stiffness(tmp_path):
    write_casing_file(tmp_path, PATHS)
    text = (tmp_path / "nodes.csv").read_text().replace("seat A,0.0,0.0,-0.04", "seat A,0.0,0.02,-0.04")
    (tmp_path / "nodes.csv").write_text(text)
    (problem,) = free_body_problems(read_superelement(tmp_path / "casing.npz", tmp_path / "nodes.csv"))
    assert problem.code == "E-SUPPORT"
    assert "about" in problem.message


def test_coordinates_without_mass_are_condensed_exactly(tmp_path, body):
    """Two more coordinates of no node, without mass, whose stiffness leaves that of the others as it was."""
    rng = np.random.default_rng(3)
    count = len(body.stiffness)
    inner, across = 1e8 * np.array([[2.0, -0.5], [-0.5, 1.0]]), 1e7 * rng.normal(size=(2, count))
    stiffness = np.block([[body.stiffness + across.T @ np.linalg.solve(inner, across), across.T], [across, inner]])
    mass = np.zeros_like(stiffness)
    mass[:count, :count] = body.mass
    other = written(tmp_path, [stiffness, mass])
    assert apart(other.stiffness, body.stiffness) <= 1e-9 and (other.mass == body.mass).all()
    assert other.row == body.row
    loose = stiffness.copy()
    loose[count:], loose[:, count:] = 0.0, 0.0
    with pytest.raises(CaseError, match="without mass are held by nothing") as refused:
        written(tmp_path, [loose, mass])
    assert refused.value.code == "E-MECHANISM"


def test_all_faults_come_at_once(tmp_path):
    write_casing_file(tmp_path, PATHS, [m.copy() for m in body_matrices_of(PATHS)])
    text = (tmp_path / "nodes.csv").read_text().replace("seat B", "seat A")
    (tmp_path / "nodes.csv").write_text(text)
    stored = dict(np.load(tmp_path / "casing.npz"))
    stored["mass"][:3, :3] = 0.0
    np.savez(tmp_path / "casing.npz", **stored)
    found = read_superelement(tmp_path / "casing.npz", tmp_path / "nodes.csv")
    assert codes(found) == ["E-DUPLICATE", "E-MASS"]


def test_a_seat_moves_in_three_directions_or_six(tmp_path):
    write_casing_file(tmp_path, PATHS)
    text = (tmp_path / "nodes.csv").read_text().replace("0.04,123456\n4", "0.04,12345\n4")
    (tmp_path / "nodes.csv").write_text(text)
    found = read_superelement(tmp_path / "casing.npz", tmp_path / "nodes.csv")
    assert "E-SHAPE" in codes(found)


def test_halves_that_differ_come_with_all_else(tmp_path):
    def change(stiffness, mass):
        stiffness[0, 6] *= 1.5
        mass[1, 3] = 0.4

    found = changed(tmp_path, change)
    assert [one.message.split()[1] for one in free_body_problems(found) if one.code == "E-SYMMETRY"] == [
        "stiffness",
        "mass",
    ]


@pytest.mark.parametrize(
    "change", [lambda K, M: M.__setitem__((0, 0), np.nan), lambda K, M: K.__setitem__(slice(None), 0.0)]
)
def test_matrices_that_are_none_are_refused(tmp_path, change):
    with pytest.raises(CaseError) as error:
        changed(tmp_path, change)
    assert error.value.code == "E-TYPE"


def test_complex_matrices_and_huge_archives_are_refused(tmp_path, monkeypatch):
    with pytest.raises(CaseError, match="E-TYPE"):
        written(tmp_path, [(1.0 + 0.1j) * matrix for matrix in body_matrices_of(PATHS)])
    monkeypatch.setattr("femgear.exchange.casing_files._MOST_BYTES", 100)
    with pytest.raises(CaseError, match="E-MEMORY"):
        written(tmp_path)


def test_arrays_of_another_size_and_unknown_files_are_refused(tmp_path):
    with pytest.raises(CaseError, match="E-SHAPE"):
        written(tmp_path, [np.eye(4), np.eye(4)])
    with pytest.raises(CaseError, match="E-FILE"):
        read_superelement(tmp_path / "casing.uff", tmp_path / "nodes.csv")
    (tmp_path / "casing.npz").write_bytes(b"PK")
    with pytest.raises(CaseError, match="E-FILE"):
        read_superelement(tmp_path / "casing.npz", tmp_path / "nodes.csv")


def test_nodes_have_places_and_roles_of_a_superelement(tmp_path):
    write_casing_file(tmp_path, PATHS)
    text = (tmp_path / "nodes.csv").read_text()
    (tmp_path / "nodes.csv").write_text(text.replace("foot right,0.18,-0.09,0.095", "foot right,,,"))
    with pytest.raises(CaseError, match="E-KEY-MISSING"):
        read_superelement(tmp_path / "casing.npz", tmp_path / "nodes.csv")
    (tmp_path / "nodes.csv").write_text(text.replace("foot right,", "ring,"))
    with pytest.raises(CaseError, match="seat NAME, foot NAME or sensor NAME"):
        read_superelement(tmp_path / "casing.npz", tmp_path / "nodes.csv")


def test_results_in_output2_are_refused_with_what_to_write_instead(tmp_path):
    path, nodes = tmp_path / "casing.op2", tmp_path / "nodes.csv"
    path.write_bytes(b"\x04\x00\x00\x00" * 9)
    known = {"nodes": nodes, "direction": (0.9, 0.4), "pitch_radius": 0.08, "max_diameter": 4}
    for read in (lambda: read_superelement(path, nodes), lambda: read_casing(path, **known)):
        with pytest.raises(CaseError, match="OUTPUT2") as caught:
            read()
        assert (caught.value.code, caught.value.file) == ("E-FILE", str(path))
        assert "DMIGPCH" in caught.value.remedy
