"""Results on disk: whole or not at all, checked on reading, hostile files refused."""

import errno
import json
import os
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

from femgear import files
from femgear.errors import StorageError
from femgear.storage import (
    MANIFEST,
    Manifest,
    finish,
    open_results,
    prepare_output,
    read_dataset,
    read_manifest,
    verify,
    write_dataset,
    write_manifest,
    write_text,
)

CASE = Path(__file__).parents[1] / "cases" / "planetary_27_40_108.toml"
NAMED = {"units": "1", "long_name": "something"}


def dataset(rows: int = 6) -> xr.Dataset:
    random = np.random.default_rng(1)
    labels = [f"sun-planet {n}" for n in range(1, rows + 1)]
    return xr.Dataset(
        {
            "ste": (("mesh", "position"), random.normal(size=(rows, 64)), {"units": "m", "long_name": "STE"}),
            "single": (("position",), np.linspace(0, 1, 64, dtype=np.float32), NAMED),
            "converged": (("mesh",), np.arange(rows) > 2, NAMED),
            "kind": (("mesh",), np.array(["ring", "sun"] * (rows // 2)), NAMED),
            "iterations": (("mesh",), np.arange(rows), NAMED),
            "total": ((), 1.25, NAMED),
            "gap": (("mesh",), np.full(rows, np.nan), NAMED),
        },
        coords={"mesh": labels, "position": ("position", np.arange(64) / 64, NAMED)},
        attrs={"contact": "profile", "contact_ratio_sun_planet": 1.5507},
    )


def test_round_trip_keeps_every_bit_and_every_attribute(tmp_path):
    data = dataset()
    write_dataset(data, tmp_path / "static.nc")
    back = read_dataset(tmp_path / "static.nc")
    xr.testing.assert_equal(back, data)
    assert back.ste.attrs == {"units": "m", "long_name": "STE"}
    assert back.attrs["contact"] == "profile" and back.attrs["femgear_format"] == 1
    assert back.single.dtype == np.float64 and back.converged.dtype == bool
    assert os.listdir(tmp_path) == ["static.nc"]


def test_others_read_it_with_plain_xarray_and_every_array_has_a_checksum(tmp_path):
    write_dataset(dataset(), tmp_path / "static.nc")
    with xr.open_dataset(tmp_path / "static.nc", engine="h5netcdf") as plain:
        assert plain.sel(mesh="sun-planet 2").ste.shape == (64,)
    with h5py.File(tmp_path / "static.nc") as file:
        for name in ("ste", "single", "converged", "iterations", "gap", "position"):
            assert file[name].fletcher32


def test_complex_numbers_and_missing_units_are_refused(tmp_path):
    bad = dataset().assign(z=(("mesh",), np.ones(6) * 1j, NAMED))
    with pytest.raises(StorageError, match="complex128") as info:
        write_dataset(bad, tmp_path / "x.nc")
    assert info.value.code == "E-SCHEMA" and "imaginary" in info.value.remedy
    bad = dataset()
    del bad.ste.attrs["units"]
    with pytest.raises(StorageError, match="ste lacks units"):
        write_dataset(bad, tmp_path / "x.nc")
    bad = dataset()
    del bad.position.attrs["long_name"]
    with pytest.raises(StorageError, match="position lacks long_name"):
        write_dataset(bad, tmp_path / "x.nc")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EIO])
def test_a_full_or_failing_disk_leaves_the_old_file(tmp_path, monkeypatch, code):
    path = tmp_path / "static.nc"
    write_dataset(dataset(), path)
    before = path.read_bytes()

    def fail(descriptor):
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr(files.os, "fsync", fail)
    with pytest.raises(StorageError) as info:
        write_dataset(dataset(8), path)
    assert info.value.exit_code == 4 and str(path) in str(info.value)
    assert info.value.code == ("E-DISK-FULL" if code == errno.ENOSPC else "E-STORAGE")
    assert path.read_bytes() == before and list(tmp_path.iterdir()) == [path]


def test_too_little_space_is_seen_before_writing(tmp_path, monkeypatch):
    usage = files.shutil.disk_usage(tmp_path)
    monkeypatch.setattr(files.shutil, "disk_usage", lambda path: usage._replace(free=1000))
    with pytest.raises(StorageError, match="left on the disk") as info:
        write_text("x", tmp_path / "a.txt")
    assert info.value.code == "E-DISK-FULL" and not list(tmp_path.iterdir())


def test_an_interrupt_while_writing_leaves_the_old_file(tmp_path, monkeypatch):
    write_text("old", tmp_path / "a.txt")

    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(files.os, "replace", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_text("new", tmp_path / "a.txt")
    assert (tmp_path / "a.txt").read_text() == "old" and len(list(tmp_path.iterdir())) == 1


def test_missing_folder_of_the_file(tmp_path):
    with pytest.raises(StorageError) as info:
        write_text("x", tmp_path / "absent" / "a.txt")
    assert info.value.exit_code == 4


@pytest.mark.parametrize("keep", [0, 3, 100, 5000, -10])
def test_truncated_files(tmp_path, keep):
    path = tmp_path / "static.nc"
    write_dataset(dataset(), path)
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(StorageError):
        read_dataset(path)


def test_one_flipped_bit_is_seen(tmp_path):
    path, data = tmp_path / "static.nc", dataset()
    write_dataset(data, path)
    raw = bytearray(path.read_bytes())
    place = bytes(raw).index(data.ste.values.tobytes())
    raw[place + 100] ^= 1
    path.write_bytes(raw)
    with pytest.raises(StorageError, match="damaged"):
        read_dataset(path)


def test_missing_file_and_other_formats(tmp_path):
    with pytest.raises(StorageError, match="no such file"):
        read_dataset(tmp_path / "static.nc")
    (tmp_path / "text.nc").write_text("hello")
    with pytest.raises(StorageError):
        read_dataset(tmp_path / "text.nc")
    dataset().to_netcdf(tmp_path / "foreign.nc", engine="h5netcdf")
    with pytest.raises(StorageError) as info:
        read_dataset(tmp_path / "foreign.nc")
    assert info.value.code == "E-FORMAT"
    dataset().assign_attrs(femgear_format=99).to_netcdf(tmp_path / "newer.nc", engine="h5netcdf")
    with pytest.raises(StorageError) as info:
        read_dataset(tmp_path / "newer.nc")
    assert info.value.code == "E-FORMAT"


def _external_link(file, folder):
    file["x"] = h5py.ExternalLink(str(folder / "secret.h5"), "/data")


def _soft_link(file, folder):
    file["x"] = h5py.SoftLink("/elsewhere")


def _external_storage(file, folder):
    (folder / "secret.txt").write_text("12345678")
    file.create_dataset("x", shape=(8,), dtype="u1", external=[(str(folder / "secret.txt"), 0, 8)])


def _virtual(file, folder):
    layout = h5py.VirtualLayout(shape=(4,), dtype="f8")
    layout[:] = h5py.VirtualSource(str(folder / "secret.h5"), "data", shape=(4,))
    file.create_virtual_dataset("x", layout)


def _bomb(file, folder):
    file.create_dataset("x", shape=(10**14,), dtype="f8", chunks=(1000,))


def _compound(file, folder):
    file.create_dataset("x", data=np.zeros(3, dtype=[("a", "f8"), ("b", "i4")]))


def _group_loop(file, folder):
    file.create_group("x")["again"] = file["/"]


@pytest.mark.parametrize(
    "make", [_external_link, _soft_link, _external_storage, _virtual, _bomb, _compound, _group_loop]
)
def test_hostile_files_are_refused_before_reading(tmp_path, make):
    with h5py.File(tmp_path / "static.nc", "w") as file:
        make(file, tmp_path)
    with pytest.raises(StorageError) as info:
        read_dataset(tmp_path / "static.nc")
    assert info.value.code == "E-HOSTILE"


# --- folders ---------------------------------------------------------------------------------------


def finished(folder):
    prepare_output(folder)
    write_text("title = 'x'\n", folder / "case.toml")
    write_dataset(dataset(), folder / "static.nc")
    return finish(
        folder, ["case.toml", "static.nc"], timings={"static": 0.5}, convergence={"a": np.float64("nan")}
    )


def test_a_finished_folder_is_opened_and_verified(tmp_path):
    folder = tmp_path / "out"
    finished(folder)
    results = open_results(folder)
    assert results.manifest.complete and results.stages == ("static",)
    assert results.manifest.timings["static"] == 0.5 and "numpy" in results.manifest.versions
    assert json.loads((folder / MANIFEST).read_text())["convergence"] == {"a": None}
    assert results.static.ste.dims == ("mesh", "position")
    assert results.static is results.static
    assert verify(folder) == ()
    with pytest.raises(StorageError, match="did not write"):
        _ = results.modes


def test_a_changed_result_is_not_read(tmp_path):
    folder = tmp_path / "out"
    finished(folder)
    write_dataset(dataset(4), folder / "static.nc")
    assert verify(folder) == ("static.nc",)
    with pytest.raises(StorageError) as info:
        _ = open_results(folder).static
    assert info.value.code == "E-RESULTS-CHANGED"


def test_the_case_as_run_is_read_back(tmp_path):
    folder = prepare_output(tmp_path / "out")
    write_text(CASE.read_text(encoding="utf-8"), folder / "case.toml")
    finish(folder, ["case.toml"], timings={}, convergence={})
    assert open_results(folder).case.ring.teeth == 108


def test_folders_without_results(tmp_path):
    with pytest.raises(StorageError, match="no such results folder"):
        open_results(tmp_path / "absent")
    with pytest.raises(StorageError, match="manifest"):
        open_results(tmp_path)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "3",
        "{}",
        '{"femgear_format": 1}',
        '{"femgear_format": 1, "complete": true, "files": 3}',
        '{"femgear_format": 1, "complete": true, "surprise": 3}',
        '{"femgear_format": 99}',
        '{"femgear_format": true, "complete": true}',
        '{"femgear_format": 1, "complete": true, "files": {"../x": "0"}}',
        '{"femgear_format": 1, "complete": true, "files": {"/etc/passwd": "0"}}',
        '{"femgear_format": 1, "complete": true, "files": {"a/../../x": "0"}}',
        "[" * 100_000,
    ],
)
def test_broken_manifests(tmp_path, text):
    (tmp_path / MANIFEST).write_text(text)
    with pytest.raises(StorageError) as info:
        read_manifest(tmp_path)
    assert info.value.code in ("E-MANIFEST", "E-FORMAT")


def test_other_peoples_files_are_never_touched(tmp_path):
    folder = tmp_path / "thesis"
    folder.mkdir()
    (folder / "chapter.txt").write_text("years of work")
    for force in (False, True):
        with pytest.raises(StorageError) as info:
            prepare_output(folder, force=force)
        assert info.value.code == "E-OUTPUT" and info.value.exit_code == 4
    assert [path.name for path in folder.iterdir()] == ["chapter.txt"]
    with pytest.raises(StorageError, match="not a folder"):
        prepare_output(folder / "chapter.txt")


def test_complete_results_are_replaced_only_when_asked_and_added_files_stay(tmp_path):
    folder = tmp_path / "out"
    finished(folder)
    (folder / "notes.txt").write_text("mine")
    with pytest.raises(StorageError, match="holds results") as info:
        prepare_output(folder)
    assert "--force" in info.value.remedy
    (folder / "case.toml").write_text("changed by hand")
    prepare_output(folder, force=True)
    assert sorted(path.name for path in folder.iterdir()) == ["case.toml", MANIFEST, "notes.txt"]
    assert not read_manifest(folder).complete


def test_an_interrupted_run_may_be_repeated(tmp_path):
    folder = prepare_output(tmp_path / "out")
    (folder / "static.nc").write_bytes(b"half")
    assert prepare_output(folder) == folder


@pytest.mark.parametrize("name", ["a:b", "NUL", "con.txt", "x" * 101, "dot.", "new\nline", "..."])
def test_unsafe_names(tmp_path, name):
    with pytest.raises(StorageError) as info:
        prepare_output(tmp_path / name)
    assert info.value.code == "E-NAME" and not list(tmp_path.iterdir())


def test_a_manifest_cannot_be_changed_in_memory(tmp_path):
    manifest = Manifest(complete=True, files={"a": "0"})
    with pytest.raises(TypeError):
        manifest.files["b"] = "1"
    write_manifest(tmp_path, manifest)
    assert read_manifest(tmp_path) == manifest
