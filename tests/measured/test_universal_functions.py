"""femgear.measured.universal_functions: files of pyuff, and of hand, of all types come back, or are refused."""

import itertools
import struct

import numpy as np
import pytest
import pyuff

from femgear.errors import CaseError
from femgear.exchange.formats import Signal, Spectrum, write_functions
from femgear.measured.universal_functions import read_universal_functions, read_universal_signals

X = 2.0 + 0.125 * np.arange(129)
REAL = np.random.default_rng(4).normal(size=129)
COMPLEX = REAL + 1j * REAL[::-1]
COMMON = {"func_type": 1, "id1": "left", "id2": "NONE", "rsp_node": 12, "rsp_dir": 3, "ref_dir": 0, "ref_node": 0}
COMMON |= {"abscissa_spec_data_type": 17, "ordinate_spec_data_type": 12, "orddenom_spec_data_type": 0}
COMMON |= {"z_axis_spec_data_type": 0, "z_axis_value": 0.0}


def by_pyuff(path, data, *, binary, even, double=True, **others):
    single = {} if double else {"ord_data_type": 5 if np.iscomplexobj(data) else 2}
    entries = COMMON | {"data": data, "x": X, "binary": int(binary), "abscissa_spacing": int(even)} | others
    file = pyuff.UFF(str(path))
    file.write_sets(pyuff.prepare_58(**entries) | single, mode="add", force_double=double)
    return path


@pytest.mark.parametrize(
    ("complex_", "binary", "even"), list(itertools.product((False, True), repeat=3)), ids=lambda yes: str(int(yes))
)
def test_all_types_that_pyuff_writes(complex_, binary, even, tmp_path):
    data = COMPLEX if complex_ else REAL
    by_pyuff(tmp_path / "a.uff", data, binary=binary, even=even)
    by_pyuff(tmp_path / "a.uff", 2 * data, binary=binary, even=even, id1="right", ordinate_axis_units_lab="g")
    left, right = read_universal_functions(tmp_path / "a.uff")
    assert (left.name, right.name, left.response, left.kind_name) == ("left", "right", "12:+3", "time response")
    assert np.allclose(left.values, data, rtol=1e-10) and np.allclose(right.values, 2 * data, rtol=1e-10)
    assert np.allclose(left.abscissa, X, rtol=1e-5) and (left.step == 0.125) == even
    assert (left.unit, right.unit, left.abscissa_kind) == ("", "g", 17)


@pytest.mark.parametrize(("complex_", "even"), list(itertools.product((False, True), repeat=2)))
def test_single_precision_as_text(complex_, even, tmp_path):
    data = COMPLEX if complex_ else REAL
    (function,) = read_universal_functions(by_pyuff(tmp_path / "a.uff", data, binary=False, even=even, double=False))
    assert np.allclose(function.values, data, rtol=1e-5) and np.allclose(function.abscissa, X, rtol=1e-5)


HEAD = ["left", "NONE", "NONE", "NONE", "NONE", f"{1:5d}{0:10d}{0:5d}{0:10d} {'NONE':10}{12:10d}{3:4d}"]
HEAD[-1] += f" {'NONE':10}{0:10d}{0:4d}"


def by_hand(kind, values, *, even, order="<", count=None, said=None, floats=2, end=b"    -1\n"):
    """A binary function as other programs write it: single precision, either byte order, an abscissa of 4 bytes."""
    count = len(REAL) if count is None else count
    form = f"{kind:10d}{count:10d}{int(even):10d}{2.0 * even:13.5e}{0.125 * even:13.5e}{0.0:13.5e}"
    axis = [
        f"{spec:10d}{0:5d}{0:5d}{0:5d} {'NONE':20} {unit:20}" for spec, unit in ((17, "s"), (12, "g"), (0, ""), (0, ""))
    ]
    text = "".join(f"{line:<80}\n" for line in [*HEAD, form, *axis]).encode()
    said = len(values) if said is None else said
    first = f"    -1\n    58b{1 if order == '<' else 2:6d}{floats:6d}{11:12d}{said:12d}{0:6d}{0:6d}{0:12d}{0:12d}\n"
    return first.encode() + text + values + end


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("said", [None, 0])
@pytest.mark.parametrize("end", [b"    -1\n", b"\n    -1\n", b"\r\n    -1\r\n", b"    -1"])
@pytest.mark.parametrize("kind", ["single even", "single complex uneven", "double uneven, 4 bytes"])
def test_binary_functions_of_other_programs(order, said, end, kind, tmp_path):
    if kind == "single even":
        number, even, data = 2, True, REAL
        values = struct.pack(f"{order}{len(REAL)}f", *REAL)
    elif kind == "single complex uneven":
        number, even, data = 5, False, COMPLEX
        values = b"".join(struct.pack(f"{order}3f", x, y.real, y.imag) for x, y in zip(X, COMPLEX))
    else:
        number, even, data = 4, False, REAL
        values = b"".join(struct.pack(f"{order}fd", x, y) for x, y in zip(X, REAL))
    block = by_hand(number, values, even=even, order=order, said=said, end=end)
    (tmp_path / "a.unv").write_bytes(block if end == b"    -1" else block + block)
    functions = read_universal_functions(tmp_path / "a.unv")
    assert len(functions) == (1 if end == b"    -1" else 2)
    assert np.allclose(functions[-1].values, data, rtol=1e-6) and np.allclose(functions[-1].abscissa, X)
    assert functions[-1].unit == "g"


def test_binary_data_that_look_like_an_end(tmp_path):
    values = b"\n    -1\n" * 129  # 8 bytes each
    (tmp_path / "a.uff").write_bytes(by_hand(4, values, even=True) + by_hand(4, values, even=True))
    first, second = read_universal_functions(tmp_path / "a.uff")
    assert np.array_equal(first.values, np.frombuffer(values, "<f8")) and np.array_equal(first.values, second.values)


def test_numbers_that_touch_one_another_and_fortran_exponents(tmp_path):
    numbers = -np.arange(1.0, 130.0) * 1e-120
    rows = ["".join(f"{x:20.12e}".replace("e", "D") for x in numbers[k : k + 4]) for k in range(0, 129, 4)]
    text = by_hand(4, b"", even=True, end=b"").decode().replace("58b", "58 ").splitlines()
    text[1] = f"{58:6d}"
    (tmp_path / "a.uff").write_text("\n".join([*text, *rows, "    -1"]) + "\n")
    (function,) = read_universal_functions(tmp_path / "a.uff")
    assert np.allclose(function.values, numbers, rtol=1e-12)


def test_signals_of_femgear_have_their_rate_in_full(tmp_path):
    signals = [Signal(name, "m/s^2", 51200, REAL) for name in ("near", "far")]
    write_functions(signals, [Spectrum("near", "m/s^2", 0.1, COMPLEX)], tmp_path / "a.uff")
    near, far = read_universal_signals(tmp_path / "a.uff")
    assert (near.name, far.name, near.unit, near.rate) == ("near", "far", "m/s^2", 51200.0)
    assert np.allclose(near.values, REAL)


def test_channels_of_one_name_are_told_apart_by_their_place(tmp_path):
    for node in (1, 2):
        by_pyuff(tmp_path / "a.uff", REAL, binary=True, even=True, rsp_node=node)
    assert [channel.name for channel in read_universal_signals(tmp_path / "a.uff")] == ["left 1:+3", "left 2:+3"]


BEGUN = b"    -1\n    58\n"
GOOD = by_hand(4, REAL.astype("<f8").tobytes(), even=True)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"hello\n" * 20, "no dataset begins by -1"),
        (b"    -1\n   151\nabc\n    -1\n", "no dataset 58"),
        (b"    -1\n   151\nabc\n", "it does not end by -1"),
        (b"    -1\nabc\n", "a dataset without a number"),
        (GOOD[:900], "missing or too long"),
        (GOOD[:1200], "broken off"),
        (GOOD.replace(b"\n", b"\r\n"), r"of another length than is said|broken off"),
        (GOOD.replace(b"    58b     1     2", b"    58b     1     1"), "of another kind"),
        (GOOD.replace(b"         4       129", b"         7       129"), "no known type"),
        (GOOD.replace(b"         4       129", b"         4 999999999"), "broken off"),
        (GOOD.replace(b"1.25000e-01", b"0.00000e+00"), "without a step"),
        pytest.param(
            lambda: b"    -1\n    58\n" + b"x" * 20_000_000 + b"\n    -1\n", "missing or too long", id="data11"
        ),
        pytest.param(lambda: b"    -1\n    58\n" + b"x" * 20_000_000, "does not end by -1", id="data12"),
    ],
)
def test_hostile_files_are_refused_with_what_to_do(data, words, tmp_path):
    # long ones are made where they are needed, not at every collection
    (tmp_path / "a.uff").write_bytes(data() if callable(data) else data)
    with pytest.raises(CaseError, match=words) as refused:
        read_universal_functions(tmp_path / "a.uff")
    assert refused.value.code == "E-FILE" and refused.value.remedy and "a.uff" in str(refused.value)


def test_text_that_is_broken_off_and_files_without_signals(tmp_path):
    path = by_pyuff(tmp_path / "a.uff", REAL, binary=False, even=True)
    lines = path.read_text().splitlines()
    path.write_text("\n".join(lines[:20] + lines[-1:]) + "\n")
    with pytest.raises(CaseError, match="values of a function are missing"):
        read_universal_signals(path)
    by_pyuff(tmp_path / "b.uff", COMPLEX, binary=False, even=True, func_type=4, abscissa_spec_data_type=18)
    with pytest.raises(CaseError, match="no time signals"):
        read_universal_signals(tmp_path / "b.uff")
