"""Carriers from files: reduction of beams, all formats alike, units, and what is refused with what to change."""

from pathlib import Path

import numpy as np
import pytest
from carrier_bodies import SECTION, beam_carrier, without_tilts, written
from scipy.linalg import eigh

from femgear.errors import CaseError
from femgear.exchange.carrier_files import read_carrier
from femgear.fe.beam import rigid_link


def read(folder, arrays):
    return read_carrier(Path(written(folder, arrays)))


@pytest.mark.parametrize("elements", [1, 3])
def test_the_compliance_is_that_of_the_whole_body(tmp_path, elements):
    arrays = beam_carrier(elements=elements)
    body = read(tmp_path, arrays)
    held = np.arange(6, len(arrays["mass"]))
    whole = np.linalg.inv(arrays["stiffness"][np.ix_(held, held)])[:18, :18]
    assert np.abs(body.compliance - whole).max() < 1e-9 * np.abs(whole).max()
    assert body.pins == pytest.approx(arrays["position"][1:])
    assert body.compliance.shape == (18, 18) and body.mass.shape == (24, 24)


def test_with_all_inner_modes_frequencies_are_those_of_the_whole_body(tmp_path):
    arrays = beam_carrier(elements=2)
    body = read(tmp_path, arrays)
    arms = body.pins - body.seat
    B = np.hstack([-np.vstack([rigid_link(arm) for arm in arms]), np.eye(18)])
    count = len(body.frequency)
    assert count == len(arrays["mass"]) - 24
    K, M = np.zeros((24 + count,) * 2), np.eye(24 + count)
    K[:24, :24] = B.T @ np.linalg.inv(body.compliance) @ B
    K[24:, 24:] = np.diag(body.frequency**2)
    M[:24, :24], M[:24, 24:], M[24:, :24] = body.mass, body.coupling, body.coupling.T
    expected = eigh(arrays["stiffness"], arrays["mass"], eigvals_only=True)[6:]
    assert eigh(K, M, eigvals_only=True)[6:] == pytest.approx(expected, rel=1e-9)


def test_rigid_motions_have_mass_and_inertia_of_the_parts(tmp_path):
    body = read(tmp_path, beam_carrier(elements=2))
    rigid = np.vstack([np.eye(6), *(rigid_link(pin - body.seat) for pin in body.pins)])
    pins = 3 * SECTION.density * SECTION.area * 0.036
    assert (rigid.T @ body.mass @ rigid)[0, 0] == pytest.approx(3.0 + pins, rel=1e-9)
    polar = 2 * 2e-3 + pins * 0.04**2 + 3 * SECTION.density * 2.0 * SECTION.second_moment * 0.036
    assert (rigid.T @ body.mass @ rigid)[5, 5] == pytest.approx(polar, rel=1e-9)


def test_pins_of_three_components_move_alike(tmp_path):
    whole = read(tmp_path, beam_carrier()).compliance
    few = read(tmp_path, without_tilts(beam_carrier()))
    kept = [6 * n + c for n in range(3) for c in range(3)]
    assert np.abs(few.compliance - whole[np.ix_(kept, kept)]).max() < 1e-9 * np.abs(few.compliance).max()
    assert few.mass.shape == (15, 15)


def test_units_of_millimetres_and_tonnes(tmp_path):
    arrays, expected = beam_carrier(elements=2), read(tmp_path, beam_carrier(elements=2))
    # a metre has 1000 mm, 1 N/m is 1e-3 N/mm, 1 N m/rad is 1000 N mm/rad
    size = np.ones(len(arrays["mass"]))
    size[:24] = np.tile(np.repeat([1.0, 1e3], 3), 4)
    other = {name: 1e-3 * arrays[name] * np.outer(size, size) for name in ("stiffness", "mass")}
    path = written(tmp_path, arrays | other | {"position": 1e3 * arrays["position"]}, "mm.npz")
    found = read_carrier(Path(path), units="mm-t-s")
    assert found.pins == pytest.approx(expected.pins, rel=1e-12)
    assert np.abs(found.compliance - expected.compliance).max() < 1e-9 * np.abs(expected.compliance).max()
    assert np.abs(found.mass - expected.mass).max() < 1e-9 * np.abs(expected.mass).max()
    assert found.frequency == pytest.approx(expected.frequency, rel=1e-9)


TABLE = "node,role,x,y,z,dofs\n"


def table_of(folder, arrays, places=True):
    rows = [
        f"{n},{role},{','.join(repr(float(x)) for x in place) if places else ',,'},{dofs}"
        for n, (role, place, dofs) in enumerate(zip(arrays["role"], arrays["position"], arrays["dofs"], strict=True), 1)
    ]
    path = folder / "carrier.csv"
    path.write_text(TABLE + "\n".join(rows) + "\n", encoding="utf-8")
    return path


def test_op4_and_dmig_hold_the_same_carrier(tmp_path):
    op4 = pytest.importorskip("pyNastran.op4.op4")
    from casing import punch

    arrays = beam_carrier(elements=2)
    expected, nodes = read(tmp_path, arrays), table_of(tmp_path, arrays)
    K, M = arrays["stiffness"], arrays["mass"]
    op4.OP4(debug=False).write_op4(str(tmp_path / "a.op4"), {"K": (6, K), "M": (6, M)}, is_binary=False)
    listed = [(role, dofs, place) for role, dofs, place in zip(arrays["role"], arrays["dofs"], arrays["position"])]
    (tmp_path / "a.pch").write_text(punch(K, M, listed), encoding="utf-8")
    for name, places in (("a.op4", True), ("a.pch", False)):
        found = read_carrier(tmp_path / name, nodes=table_of(tmp_path, arrays, places))
        assert np.abs(found.compliance - expected.compliance).max() < 1e-7 * np.abs(expected.compliance).max()
        assert found.frequency == pytest.approx(expected.frequency, rel=1e-6)
    with pytest.raises(CaseError, match="where shaft and pins are"):
        read_carrier(tmp_path / "a.op4")
    nodes.write_text(TABLE + "1,ring,0,0,0,123456\n", encoding="utf-8")
    with pytest.raises(CaseError, match="role shaft or pin NAME"):
        read_carrier(tmp_path / "a.op4", nodes=nodes)


def changed(name, change):
    arrays = beam_carrier()
    arrays[name] = change(arrays[name].copy())
    return arrays


def entry(place, value):
    def change(array):
        array[place] = value
        return array

    return change


def held_at(row):
    def change(stiffness):
        stiffness[row, row] += 1e9
        return stiffness

    return change


def with_a_loose_pin():
    """A carrier of two pins, and a third one of its own."""
    arrays = beam_carrier(angles=(0.0, 2.0))
    for name, own in (("stiffness", 0.0), ("mass", 1.0)):
        matrix = np.insert(np.insert(arrays[name], [18] * 6, 0.0, axis=0), [18] * 6, 0.0, axis=1)
        matrix[range(18, 24), range(18, 24)] = own
        arrays[name] = matrix
    more = {"role": "pin 3", "dofs": "123456", "position": (-0.02, 0.0, 0.0)}
    return arrays | {name: np.append(arrays[name], [value], axis=0) for name, value in more.items()}


@pytest.mark.parametrize(
    ("arrays", "code", "key"),
    [
        (changed("stiffness", entry((0, 7), 1e9)), "E-SYMMETRY", "file"),
        (changed("stiffness", held_at(7)), "E-SUPPORT", "stiffness"),
        (changed("position", lambda x: x + 0.02 * np.eye(4)[:, 1:]), "E-SUPPORT", "stiffness"),
        (changed("position", lambda x: x[:3]), "E-SHAPE", "position"),
        (changed("stiffness", lambda k: k[:20, :20]), "E-SHAPE", "dofs"),
        (changed("stiffness", lambda k: 1j * k), "E-TYPE", "file"),
        (changed("stiffness", lambda k: 0.0 * k), "E-TYPE", "file"),
        (changed("stiffness", lambda k: np.diag([0.0, *[1.0] * 24])), "E-SUPPORT", "stiffness"),
        (changed("mass", lambda m: 0.0 * m), "E-TYPE", "file"),
        (changed("mass", lambda m: -m), "E-MASS", "mass"),
        (with_a_loose_pin(), "E-MECHANISM", "stiffness"),
        (changed("role", entry(1, "pin 4")), "E-COUNT", "nodes"),
        (changed("role", entry(0, "pin 5")), "E-COUNT", "nodes"),
        (changed("dofs", entry(2, "123")), "E-SHAPE", "nodes"),
        ({"stiffness": np.eye(3)}, "E-KEY-MISSING", "mass"),
    ],
)
def test_bad_files_are_refused_with_what_to_change(tmp_path, arrays, code, key):
    with pytest.raises(CaseError) as raised:
        read(tmp_path, arrays)
    assert (raised.value.code, raised.value.key) == (code, key)
    assert raised.value.file.endswith("carrier.npz")
    assert raised.value.remedy


def test_other_files_are_refused(tmp_path):
    with pytest.raises(CaseError) as raised:
        read_carrier(tmp_path / "none.npz")
    assert raised.value.code == "E-FILE"
    (tmp_path / "modes.uff").write_text("", encoding="utf-8")
    with pytest.raises(CaseError, match="do not say where"):
        read_carrier(tmp_path / "modes.uff")
    (tmp_path / "text.npz").write_text("no archive", encoding="utf-8")
    with pytest.raises(CaseError) as raised:
        read_carrier(tmp_path / "text.npz")
    assert raised.value.code == "E-FILE"
