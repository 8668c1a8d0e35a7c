"""Numbers of samples in a file: blocks in any order, what was half written, columns."""

import numpy as np
import pytest
import xarray as xr

from femgear.errors import StorageError
from femgear.findings import as_text
from femgear.study import sample_results
from femgear.study.sample_results import QUANTILES, SHOWN, open_columns

pytestmark = pytest.mark.usefixtures("pictures_undrawn", "coarse_states")

WIDTHS = {"error": 0, "share": 3}


def numbers(first, end):
    sample = np.arange(first, end, dtype=float)
    return {"error": 1e-6 * sample, "share": sample[:, None] + [0.0, 0.1, 0.2]}


def test_blocks_come_back_whatever_their_order(tmp_path, monkeypatch):
    monkeypatch.setattr(sample_results, "_ROWS", 7)
    path = tmp_path / "part"
    with open_columns(path, WIDTHS) as columns:
        late, early = columns.write(10, numbers(10, 25)), columns.write(0, numbers(0, 10))
        assert columns.holds(10, 25, late) and columns.holds(0, 10, early) and not columns.holds(0, 10, late)
    with open_columns(path, WIDTHS) as columns:
        assert columns.holds(10, 25, late)
        for name, values in numbers(0, 25).items():
            np.testing.assert_array_equal(columns.column(name, 25), values)
        assert [first for first, _ in columns.blocks(25)] == [0, 7, 14, 21]
        np.testing.assert_array_equal(columns.rows(12, 13)["share"], [[12.0, 12.1, 12.2]])


def test_what_is_damaged_or_missing_is_not_held(tmp_path):
    path = tmp_path / "part"
    with open_columns(path, WIDTHS) as columns:
        checksum = columns.write(0, numbers(0, 10))
    data = bytearray(path.read_bytes())
    data[100] ^= 1
    for damaged in (bytes(data), bytes(data[:-1]), b""):
        path.write_bytes(damaged)
        with open_columns(path, WIDTHS) as columns:
            assert not columns.holds(0, 10, checksum)
    path.unlink()
    path.mkdir()
    with pytest.raises(StorageError, match="no regular file"), open_columns(path, WIDTHS):
        pass


def test_numbers_whose_peaks_the_positions_miss_are_marked():
    """9 % of the transmission error of a sample lies between; 1 % of the others, within what docs promise."""
    data = xr.Dataset(
        {"share_that_opens": 0.0},
        {"check": [3, 8], "quantile": list(QUANTILES)},
        {"worst": 8, "largest": 8, "positions": 18, "equidistant": 16, "turn": 108, "samples": 9, "seed": 1}
        | {"method": "spring"},
    )
    for name in SHOWN:
        more = 1.1 if name == "transmission_error" else 1.01
        data[f"{name}_quantile"] = ("quantile", np.linspace(1.0, 2.0, len(QUANTILES)))
        data[f"{name}_largest"], data[f"{name}_error"] = 2.0, 0.0
        data[f"{name}_exact"], data[f"{name}_between"] = ("check", [1.0, 2.0]), ("check", [1.0, 2.0 * more])
    missed = sample_results._missed_peaks(data)
    (finding,) = sample_results._findings_of_peaks(data, missed)
    assert finding.code == "W-POSITIONS" and "miss up to 9 % of the transmission error" in finding.text
    ideal = dict.fromkeys(SHOWN, np.ones(1))
    bare = sample_results._described(data, ideal, ())[0]
    assert "†" not in str(bare.rows)
    data.attrs["findings"] = as_text([finding])
    block = sample_results._described(data, ideal, ())[0]
    marked = {row[0]: [cell.endswith("†") for cell in row[1:]] for row in block.rows}
    first, *others = marked.values()
    assert first == [False] + [True] * (len(QUANTILES) + 1) and not any(map(any, others))
    assert block.notes[-1].startswith("† W-POSITIONS, doubt")
