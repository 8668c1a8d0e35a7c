"""Results on disk: whole or not at all, checked on reading, hostile files refused."""

import csv
import errno
import json
import os
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr
from edited_manifests import finish

import femgear
from femgear.errors import StorageError
from femgear.storage import files
from femgear.storage.files import (
    checksum,
    list_own,
    plain_cell,
    read_dataset,
    write_csv,
    write_dataset,
    write_text,
)
from femgear.storage.results import (
    MANIFEST,
    folder_lock,
    prepare_output,
    read_manifest,
    record,
    run_folder,
    write_csv_tables,
)
from femgear.trains.reading import open_results

CASE = Path(__file__).parents[2] / "cases" / "planetary_27_40_108.toml"
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
    assert back.single.dtype == np.float32 and back.converged.dtype == bool
    assert os.listdir(tmp_path) == ["static.nc"]


def test_a_file_reads_as_one_that_xarray_has_written(tmp_path):
    """Dimensions without coordinate or without length, coordinates beside, texts, truth values, lists."""
    data = dataset().assign_attrs(numbers=[1.0, 2.0], names=["sun", "ring"], count=3)
    data = data.assign(
        plain=(("mesh", "way"), np.arange(12.0).reshape(6, 2), NAMED),
        moved=(("member", "position"), np.zeros((0, 64)), NAMED),
        words=(("way",), ["there", "back"], NAMED),
    ).assign_coords(teeth=("mesh", np.arange(6), NAMED), path=(("mesh", "way"), np.ones((6, 2)), NAMED))
    write_dataset(data, tmp_path / "ours.nc")
    stamp = {"femgear_format": 1, "femgear_version": femgear.__version__}
    data.assign_attrs(stamp).to_netcdf(tmp_path / "theirs.nc", engine="h5netcdf")
    ours, theirs = (read_dataset(tmp_path / f"{name}.nc") for name in ("ours", "theirs"))
    xr.testing.assert_identical(ours, theirs)
    assert [*ours.data_vars, *ours.sizes] == [*theirs.data_vars, *theirs.sizes]
    for name, one in theirs.variables.items():
        assert ours[name].dtype == one.dtype, name
    with xr.open_dataset(tmp_path / "ours.nc", engine="h5netcdf", decode_times=False) as by_xarray:
        xr.testing.assert_identical(ours, by_xarray.load())
        assert [(name, one.dtype) for name, one in by_xarray.variables.items()] == [
            (name, one.dtype) for name, one in ours.variables.items()
        ]
    with h5py.File(tmp_path / "ours.nc") as file:
        assert {scale.name for axis in file["moved"].dims for scale in axis.values()} == {
            "/member",
            "/position",
        }
    write_dataset(ours.drop_attrs(deep=False), tmp_path / "again.nc")
    write_dataset(ours.drop_attrs(deep=False), tmp_path / "once more.nc")
    assert (tmp_path / "again.nc").read_bytes() == (tmp_path / "once more.nc").read_bytes()


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
    assert info.value.code == "E-FORMAT" and "imaginary" in info.value.remedy
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
    with pytest.raises(StorageError, match="1 MB are kept in reserve") as info:
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


def test_a_file_that_ends_within_the_header_of_a_heap_is_damaged(tmp_path):
    """At every byte of the header: nothing is read beyond the end."""
    path = tmp_path / "cut.nc"
    for size in range(5, 17):
        path.write_bytes(b"\x89HDF" + (b"GCOL\x01" + bytes(11))[:size])
        with pytest.raises(StorageError, match="E-STORAGE"):
            read_dataset(path)


def test_a_heap_that_hdf5_would_never_leave_is_refused(tmp_path):
    path = tmp_path / "static.nc"
    write_dataset(dataset(), path)
    content = bytearray(path.read_bytes())
    start = content.index(b"GCOL") + 16
    content[start : start + 16] = bytes(16)
    path.write_bytes(content)
    with pytest.raises(StorageError, match="a heap without end") as info:
        read_dataset(path)
    assert info.value.code == "E-FORMAT"


@pytest.mark.parametrize(
    ("make", "what"),
    [
        (_external_link, "is a link, a group or a named type"),
        (_soft_link, "is a link, a group or a named type"),
        (_external_storage, "keeps its data in other files"),
        (_virtual, "keeps its data in other files"),
        (_bomb, "declares 8e"),
        (_compound, "has the type"),
        (_group_loop, "is a link, a group or a named type"),
    ],
)
def test_hostile_files_are_refused_before_reading(tmp_path, make, what, monkeypatch):
    with h5py.File(tmp_path / "static.nc", "w") as file:
        make(file, tmp_path)
    for name in ("open_dataset", "load_dataset"):
        monkeypatch.delattr(f"xarray.{name}")
    with pytest.raises(StorageError, match=what) as info:
        read_dataset(tmp_path / "static.nc")
    assert info.value.code == "E-FORMAT"


# --- folders ---------------------------------------------------------------------------------------


def finished(folder):
    prepare_output(folder)
    write_text("title = 'x'\n", folder / "case.toml")
    write_dataset(dataset(), folder / "static.nc")
    return finish(folder, ["case.toml", "static.nc"], timings={"static": 0.5}, convergence={"a": np.float64("nan")})


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
    assert info.value.code in ("E-FORMAT", "E-FORMAT")


def test_other_peoples_files_are_never_touched(tmp_path):
    folder = tmp_path / "thesis"
    folder.mkdir()
    (folder / "chapter.txt").write_text("years of work")
    for force in (False, True):
        with pytest.raises(StorageError) as info, run_folder(folder, force=force):
            pass
        assert info.value.code == "E-OUTPUT" and info.value.exit_code == 4
    assert [path.name for path in folder.iterdir()] == ["chapter.txt"]
    with pytest.raises(StorageError, match="not a folder"):
        prepare_output(folder / "chapter.txt")


def verify(folder):
    """Files of the manifest that are missing or changed."""
    files = read_manifest(folder).files
    there = {path.relative_to(folder).as_posix() for path in folder.rglob("*")}
    return tuple(n for n, digest in files.items() if n not in there or checksum(folder / n) != digest)


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def write_case(folder, text="new"):
    """Results that are a case file only."""
    write_text(text, folder / "case.toml")
    return finish(folder, ["case.toml"], timings={}, convergence={})


def test_complete_results_are_replaced_only_when_asked_and_added_files_stay(tmp_path):
    folder = tmp_path / "out"
    finished(folder)
    (folder / "notes.txt").write_text("mine")
    with pytest.raises(StorageError, match="holds results") as info, run_folder(folder):
        pass
    assert "--force" in info.value.remedy and open_results(folder).stages == ("static",)
    with run_folder(folder, force=True) as working:
        write_case(working)
        # until the new results are complete the old ones can be read
        assert working != folder and open_results(folder).static.sizes["position"] == 64
    assert names(folder) == ["case.toml", MANIFEST, "notes.txt"]
    assert (folder / "case.toml").read_text() == "new" and verify(folder) == ()


def test_results_that_somebody_changed_are_not_replaced(tmp_path):
    folder = tmp_path / "out"
    finished(folder)
    (folder / "case.toml").write_text("changed by hand")
    with pytest.raises(StorageError, match=r"case\.toml changed") as info, run_folder(folder, force=True):
        pass
    assert info.value.code == "E-OUTPUT" and (folder / "case.toml").read_text() == "changed by hand"
    (folder / "case.toml").unlink()  # what was deleted cannot be lost
    with run_folder(folder, force=True) as working:
        write_case(working)
    assert names(folder) == ["case.toml", MANIFEST]


@pytest.mark.parametrize("error", [KeyboardInterrupt, StorageError("x"), OSError(errno.EIO, "x")])
def test_a_run_that_fails_leaves_the_results_it_should_replace(tmp_path, error):
    folder = tmp_path / "out"
    finished(folder)
    before = read_manifest(folder)
    with (
        pytest.raises(error if isinstance(error, type) else type(error)),
        run_folder(folder, force=True) as new,
    ):
        write_text("new", new / "case.toml")
        record(new, ["case.toml"], timings={}, convergence={})
        raise error
    assert read_manifest(folder) == before and verify(folder) == ()
    assert names(folder) == ["case.toml", MANIFEST, "static.nc"]


def test_results_are_replaced_as_a_whole_even_if_the_process_is_killed_in_between(tmp_path, monkeypatch):
    folder = tmp_path / "out"
    finished(folder)
    replace, calls = os.replace, []

    def killed(source, target):
        if Path(target) == folder / "b.txt":
            calls.append(source)
            raise KeyboardInterrupt
        replace(source, target)

    with pytest.raises(KeyboardInterrupt), run_folder(folder, force=True) as working:
        for name in ("case.toml", "b.txt"):
            write_text("new", working / name)
        finish(working, ["case.toml", "b.txt"], timings={}, convergence={})
        monkeypatch.setattr(os, "replace", killed)
    assert calls and not (folder / "b.txt").exists()
    monkeypatch.undo()
    with pytest.raises(StorageError, match="holds results"), run_folder(folder):
        pass
    assert names(folder) == ["b.txt", "case.toml", MANIFEST] and verify(folder) == ()


def test_what_a_killed_run_left_is_cleared_by_the_next(tmp_path):
    folder = tmp_path / "out"
    finished(folder)
    list_own(folder / ".running")
    write_text("half", folder / ".running" / "static.nc")
    with run_folder(folder, force=True) as working:
        assert names(working) == [".written", MANIFEST]
        write_case(working)
    assert names(folder) == ["case.toml", MANIFEST]


def test_an_interrupted_run_may_be_repeated(tmp_path):
    with pytest.raises(KeyboardInterrupt), run_folder(tmp_path / "out") as folder:
        (folder / "static.nc").write_bytes(b"half")
        raise KeyboardInterrupt
    with run_folder(tmp_path / "out") as again:
        assert again == folder


def test_an_interrupted_run_can_be_read_as_far_as_it_came(tmp_path):
    folder = prepare_output(tmp_path / "out")
    write_dataset(dataset(), folder / "static.nc")
    record(folder, ["static.nc"], timings={"static": 1.0}, convergence={})
    with pytest.warns(UserWarning, match="interrupted after: static"):
        results = open_results(folder)
    assert results.static.sizes["mesh"] == 6
    with pytest.raises(StorageError, match="interrupted after: static") as info:
        _ = results.modes
    assert info.value.code == "E-RESULTS-INCOMPLETE" and f"-o {folder}" in info.value.remedy
    with pytest.raises(StorageError, match="interrupted after: static"):
        open_results(folder, partial=False)
    (folder / "static.nc").write_bytes(b"mine")
    with pytest.raises(StorageError, match=r"static\.nc changed"):
        prepare_output(folder)


def test_two_runs_cannot_write_into_one_folder(tmp_path):
    folder = tmp_path / "out"
    with run_folder(folder) as working:
        with pytest.raises(StorageError) as info, run_folder(folder, force=True):
            pass
        assert info.value.code == "E-LOCKED" and info.value.exit_code == 4 and "wait" in info.value.remedy
        write_case(working)
        assert open_results(folder).manifest.complete
    assert names(folder) == ["case.toml", MANIFEST]
    with folder_lock(folder), pytest.raises(StorageError, match="another run"), folder_lock(folder):
        pass


def test_the_lock_of_a_killed_process_is_free(tmp_path):
    code = (
        "import os, sys\nfrom femgear.storage.files import exclusive_lock\n"
        "with exclusive_lock(sys.argv[1]):\n    print('held', flush=True)\n    sys.stdin.read()\n"
    )
    command = [sys.executable, "-c", code, str(tmp_path / ".lock")]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout.readline() == b"held\n"
        with pytest.raises(StorageError) as info, folder_lock(tmp_path):
            pass
        assert info.value.code == "E-LOCKED"
        process.kill()
        process.wait()
    assert names(tmp_path) == [".lock"]
    with folder_lock(tmp_path):
        pass
    assert names(tmp_path) == []


@pytest.mark.parametrize("name", ["a:b", "NUL", "con.txt", "x" * 101, "dot.", "new\nline", "..."])
def test_unsafe_names(tmp_path, name):
    with pytest.raises(StorageError) as info:
        prepare_output(tmp_path / name)
    assert info.value.code == "E-CHOICE" and not list(tmp_path.iterdir())


def test_a_manifest_cannot_be_changed_in_memory(tmp_path):
    write_text("x", tmp_path / "a")
    manifest = finish(tmp_path, ["a"], timings={}, convergence={})
    with pytest.raises(TypeError):
        manifest.files["b"] = "1"
    assert read_manifest(tmp_path) == manifest


def test_results_and_cases_show_themselves_in_a_line(tmp_path):
    folder = prepare_output(tmp_path / "out")
    write_text(CASE.read_text(encoding="utf-8"), folder / "case.toml")
    write_dataset(dataset(), folder / "static.nc")
    finish(folder, ["case.toml", "static.nc"], timings={"static": 0.5}, convergence={})
    results = open_results(folder)
    assert repr(results) == f"<Results in {folder}: static; complete>"
    assert list(results) == ["static"] and len(results) == 1 and "modes" not in results
    assert "<td>static</td>" in results._repr_html_() and "0.50 s" in results._repr_html_()
    case = results.case
    assert repr(case) == f"<Case {case.title!r} of {folder / 'case.toml'}>"
    assert case.title in case._repr_html_() and "centre_distance" in case._repr_html_()


TEXTS = ["=cmd", "@sum", "+1+1", "-2+3+cmd|' /C calc'!A0", "-a", "'=cmd", "\t=1", "-3.2 kN/m|x"]
PLAIN = ["-z", "-x", "+y", "-radial", "-3", "-.5", "-1e-3", "-12 N m", "-3 µm", "-inf", "-", "a-b", "it's", "'quoted'"]


def test_text_of_a_table_is_no_formula(tmp_path):
    rows = [[text, -1.5] for text in (*TEXTS, *PLAIN)]
    write_csv(tmp_path / "a.csv", ["=head", "level [dB]"], rows)
    with open(tmp_path / "a.csv", newline="") as stream:
        cells = [row[0] for row in csv.reader(stream)]
    assert cells[1 + len(TEXTS) :] == PLAIN
    assert [cell[:1] for cell in cells[: 1 + len(TEXTS)]] == ["'"] * (1 + len(TEXTS))
    assert [plain_cell(cell) for cell in cells] == ["=head", *TEXTS, *PLAIN]
    data = xr.Dataset({"name": ("m", ["=1", "b"]), "x": ("m", [-1.0, 2.0])}, attrs={"title": "-a", "n": -3})
    names = write_csv_tables(data, tmp_path, "s")
    written = "".join((tmp_path / name).read_text() for name in names)
    assert "title,'-a," in written and "n,-3," in written and "0,'=1,-1.0" in written
