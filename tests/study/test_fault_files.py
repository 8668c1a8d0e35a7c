"""Data sets in folders: labels, going on, one record alone."""

import csv
from pathlib import Path

import numpy as np
import pytest
from scipy.io import wavfile

from femgear.errors import ContactError, StorageError
from femgear.run import grid_cache
from femgear.storage.files import read_dataset
from femgear.study import fault_files, fault_records
from femgear.study.fault_files import fault_records_into
from femgear.study.fault_request import FaultRequest, FurtherRecords
from femgear.trains.reading import read_case, with_values

pytestmark = pytest.mark.usefixtures("coarse_states")

CASES = Path(__file__).parents[2] / "cases"
REQUEST = {"kinds": ("healthy,wear",), "each": 2, "seed": 7, "duration": "0.05 s", "gears": ("ring",)}


@pytest.fixture(scope="module")
def case():
    coarse = {"static.flank_elements": 8, "static.positions": 8, "dynamics.up_to": "2 kHz"}
    return with_values(read_case(CASES / "planetary_27_40_108.toml"), coarse)


def write(case, folder, count=4, **further):
    request = FaultRequest(count=count, **REQUEST)
    return fault_records_into(case, folder, request, further=FurtherRecords(**further), cache=grid_cache())


@pytest.fixture(scope="module")
def folder(case, tmp_path_factory):
    made = tmp_path_factory.mktemp("set")
    write(case, made, count=3, wav=True, csv=True)
    return made


def test_every_record_has_its_labels(folder):
    with open(folder / "labels.csv", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert [row["record"] for row in rows] == ["0", "1", "2"]
    assert [row["kind"] for row in rows] == ["healthy", "healthy", "wear"]
    assert rows[2]["gear"] == "ring"
    data = read_dataset(folder / rows[2]["file"])
    assert data.attrs["kind"] == "wear"
    assert float(rows[2]["size [m]"]) == data.attrs["size"] > 0.0
    level = np.sqrt(np.mean(data["signal"].values[0].astype(float) ** 2))
    assert float(rows[2]["level [m/s^2]"]) == pytest.approx(level, rel=1e-6)


def test_lines_follow_one_another(folder):
    data = read_dataset(folder / "machine_00001.nc")
    counts = data["line_count"].values
    assert counts.sum() == data.sizes["line"]
    order = data["line_order"].values[: counts[0]]
    assert (np.diff(order) > 0.0).all()
    assert set(np.round(order % 3, 6)) == {0.0}


def test_wav_and_table_are_the_record(folder):
    data = read_dataset(folder / "machine_00000.nc")
    rate, samples = wavfile.read(folder / "record_000001.wav")
    assert rate == 25600
    assert np.array_equal(samples, data["signal"].values[1])
    table = np.loadtxt(folder / "record_000001.csv", delimiter=",", skiprows=1)
    assert table[:, 1] == pytest.approx(samples, rel=1e-6)
    assert not (folder / "record_000003.wav").exists()


def test_one_record_alone_has_the_same_bits(case, folder, tmp_path):
    _, names = write(case, tmp_path, index=3)
    assert names == ["record_000003.nc", "record_000003.toml"]
    alone, among = read_dataset(tmp_path / names[0]), read_dataset(folder / "machine_00001.nc")
    assert np.array_equal(alone["signal"].values[0], among["signal"].values[1])
    assert len(read_case(tmp_path / names[1]).operation.speeds) == 1


def test_what_is_there_is_not_computed_again(case, folder, monkeypatch):
    def never(*_):
        raise AssertionError

    monkeypatch.setattr(fault_files, "solve_machine", never)
    (block,), _ = write(case, folder, count=3)
    assert block.notes == ("3 records of 2 machines",)


def test_records_of_another_request_are_refused(case, folder):
    with pytest.raises(StorageError) as caught:
        fault_records_into(case, folder, FaultRequest(count=3, **REQUEST | {"seed": 8}), cache=grid_cache())
    assert caught.value.code == "E-OUTPUT"


def test_records_that_cannot_be_computed_are_told(case, tmp_path, monkeypatch):
    solved = fault_records.solved_lines

    def opened(drawn, **shared):
        if "machine" not in drawn.title:
            return solved(drawn, **shared)
        raise ContactError("planet 1 carries nothing", code="E-CONTACT-OPEN")

    monkeypatch.setattr(fault_records, "solved_lines", opened)
    (block,), _ = write(case, tmp_path, count=1)
    assert "1 records cannot be computed: [E-CONTACT-OPEN]" in block.notes[1]
    assert np.isnan(read_dataset(tmp_path / "machine_00000.nc")["signal"].values).all()
