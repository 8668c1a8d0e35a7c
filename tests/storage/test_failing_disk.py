"""Disks that fail while HDF5 or VTK write, interrupts meanwhile, and processes that are killed."""

import errno
import io
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from edited_manifests import finish

from femgear.errors import StorageError
from femgear.storage import files
from femgear.storage.files import read_dataset, write_dataset, write_text
from femgear.storage.results import MANIFEST, folder_lock, read_manifest, record, run_folder

NAMED = {"units": "1", "long_name": "something"}
LIMITED = """
import gc, resource, sys
from pathlib import Path
import numpy as np
import xarray as xr
from femgear.errors import StorageError
from femgear.report.scene import write_vtu
from femgear.storage.files import append_dataset, replaced_file, write_bytes, write_dataset


def parts(path):
    with replaced_file(path) as new:
        for _ in range(3):
            append_dataset(data, new, "x")


folder = Path(sys.argv[1])
random = np.random.default_rng(1)
named = {"units": "1", "long_name": "something"}
numbers = ("x", "y"), random.normal(size=(300, 100)), named
data = xr.Dataset({"a": numbers, "b": ("x", ["text"] * 300, named)})
import pyvista as pv
grid = pv.ImageData(dimensions=(20, 20, 20)).cast_to_unstructured_grid()
grid["u"] = random.normal(size=grid.n_points)
writers = {
    "static.nc": lambda path: write_dataset(data, path),
    "set.vtu": lambda path: write_vtu(grid, path),
    "parts.nc": parts,
    "a.png": lambda path: write_bytes(bytes(200_000), path),
}
for limit in map(int, sys.argv[2:]):
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
    for name, write in writers.items():
        try:
            write(folder / name)
            print(name, "written")
        except StorageError as error:
            print(name, error.code, error.exit_code, "ulimit" in error.remedy)
    gc.collect()
print("came to its end")
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no limit of the size of files")
def test_a_limit_of_the_size_of_files_is_said_and_does_not_end_the_process(tmp_path):
    limits = [0, 100, 1_000, 7_000, 20_000, 40_000, 48_000]
    command = [sys.executable, "-c", LIMITED, str(tmp_path), *map(str, limits)]
    run = subprocess.run(command, capture_output=True, text=True, timeout=120)
    *lines, last = run.stdout.splitlines()
    assert run.returncode == 0 and last == "came to its end", run.stderr
    assert "Traceback" not in run.stderr and "Exception ignored" not in run.stderr
    assert len(lines) == 4 * len(limits) and all(line.endswith("E-STORAGE 4 True") for line in lines), lines
    assert list(tmp_path.iterdir()) == []


def large(rows: int = 400) -> xr.Dataset:
    return xr.Dataset({"a": (("x", "y"), np.random.default_rng(1).normal(size=(rows, 100)), NAMED)})


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EIO, errno.EDQUOT])
@pytest.mark.parametrize("call", [1, 2, 5, 12])
def test_a_disk_that_fails_at_any_call_of_hdf5(tmp_path, monkeypatch, code, call):
    count = []

    class Failing(files._Disk):
        def write(self, data):
            count.append(1)
            if len(count) >= call:
                self.failure = self.failure or OSError(code, os.strerror(code))
            return super().write(data)

    monkeypatch.setattr(files, "_Disk", Failing)
    with pytest.raises(StorageError) as info:
        write_dataset(large(), tmp_path / "static.nc")
    assert info.value.code == ("E-STORAGE" if code == errno.EIO else "E-DISK-FULL") and len(count) >= call
    assert list(tmp_path.iterdir()) == []


def test_what_hdf5_cannot_do_is_a_storage_error(tmp_path, monkeypatch):
    def fail(*_):
        raise RuntimeError("Unspecified error in H5Pset_cache (return value <0)")

    monkeypatch.setattr(files, "_to_netcdf", lambda _, path: files.write_hdf5(path, fail))
    with pytest.raises(StorageError, match="H5Pset_cache") as info:
        write_dataset(xr.Dataset(), tmp_path / "a.nc")
    assert info.value.remedy == "see that disk and memory suffice" and not list(tmp_path.iterdir())


def test_bytes_that_are_written_in_pieces_are_all_there(tmp_path):
    class Pieces(io.FileIO):
        def write(self, data):
            return super().write(memoryview(data)[:1000])

    files._Disk.__bases__ = (Pieces,)
    try:
        write_dataset(large(), tmp_path / "static.nc")
    finally:
        files._Disk.__bases__ = (io.FileIO,)
    xr.testing.assert_equal(read_dataset(tmp_path / "static.nc").drop_attrs(), large().drop_attrs())


@pytest.mark.parametrize("call", [1, 2, 3, 5, 8, 12])
def test_an_interrupt_at_any_call_of_hdf5_is_not_lost(tmp_path, monkeypatch, call):
    write_dataset(large(3), tmp_path / "static.nc")
    before, count = (tmp_path / "static.nc").read_bytes(), []

    class Interrupted(files._Disk):
        def write(self, data):
            count.append(1)
            if len(count) == call:
                os.kill(os.getpid(), signal.SIGINT)
            return super().write(data)

    monkeypatch.setattr(files, "_Disk", Interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_dataset(large(), tmp_path / "static.nc")
    assert len(count) > call
    assert (tmp_path / "static.nc").read_bytes() == before and len(list(tmp_path.iterdir())) == 1


def test_an_interrupt_while_a_file_is_read_reaches_no_library(tmp_path, monkeypatch):
    """Only the main thread is interrupted, and it waits for what reads."""
    write_dataset(large(3), tmp_path / "static.nc")
    walk, ended = files._hostility, []

    def interrupted(path):
        time.sleep(0.05)  # until the main thread waits
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.05)
        ended.append(walk(path))
        return ended[-1]

    monkeypatch.setattr(files, "_hostility", interrupted)
    with pytest.raises(KeyboardInterrupt):
        read_dataset(tmp_path / "static.nc")
    assert len(ended) == 1 and not ended[0]


def kill(*_):
    os.kill(os.getpid(), signal.SIGKILL)


def run_and_die(where, folder, force):
    """Write a run into a folder as another process does, which is killed at some place."""

    class Killed(files._Disk):
        def write(self, data):
            if where == "write":
                kill()
            return super().write(data)

    files._Disk = Killed
    with run_folder(folder, force=force == "force") as working:
        write_text("new", working / "case.toml")
        write_dataset(xr.Dataset({"a": ("x", np.arange(9.0), NAMED)}), working / "static.nc")
        if where == "picture":
            write_text("png", working / "picture.png")
            kill()
        record(working, ["case.toml", "static.nc"], timings={}, convergence={}, complete=True)
        last = {"publish": "static.nc", "manifest": MANIFEST}.get(where)
        replace, remove = os.replace, os.unlink
        os.replace = lambda a, b: kill() if Path(b).name == last else replace(a, b)
        if where == "clear":
            os.unlink = lambda a: kill() if Path(a).name == ".written" else remove(a)
        if where == "clear folder":
            os.rmdir = kill


def killed(work, *arguments):
    """How a process ends that does some work: minus the number of the signal."""
    child = os.fork()
    if child:
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    try:
        work(*arguments)
    finally:
        os._exit(0)


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
@pytest.mark.parametrize(
    ("where", "force"),
    [(where, "force") for where in ("write", "picture", "publish", "manifest", "clear", "clear folder")]
    + [("write", "new"), ("picture", "new")],
)
def test_a_killed_run_leaves_nothing_that_the_next_does_not_remove(tmp_path, where, force):
    folder = tmp_path / "out"
    if force == "force":
        with run_folder(folder) as working:
            write_text("old", working / "case.toml")
            finish(working, ["case.toml"], timings={}, convergence={})
    assert killed(run_and_die, where, folder, force) == -signal.SIGKILL
    assert read_manifest(folder).complete == (force == "force")
    published = where in ("publish", "manifest", "clear", "clear folder")
    with folder_lock(folder):
        if published:
            assert (folder / "case.toml").read_text() == "new" and read_manifest(folder).complete
        elif force == "force":
            assert (folder / "case.toml").read_text() == "old"
    with run_folder(folder, force=read_manifest(folder).complete) as working:
        write_text("last", working / "case.toml")
        finish(working, ["case.toml"], timings={}, convergence={})
    assert {path.name for path in folder.iterdir()} <= {"case.toml", MANIFEST, "static.nc", "picture.png"}
    assert (folder / "case.toml").read_text() == "last"
    assert not any(path.name.startswith(".") for path in folder.iterdir())
