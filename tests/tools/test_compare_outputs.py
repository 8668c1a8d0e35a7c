"""validation/tools/compare_outputs.py: finds what differs between two folders of outputs, and nothing else."""

import importlib.util
import json
import shutil
import sys
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

PATH = Path(__file__).parents[2] / "validation" / "tools" / "compare_outputs.py"
TABLE = """
Static

  mesh            k mean [N/um]
 ───────────────────────────────
  sun-planet 1          497.847

Time

  stage       [s]
 ─────────────────
  static     2.35
  pictures  18.37

results: results
"""
MANIFEST = {
    "complete": True,
    "files": {"static.nc": "0" * 64},
    "timings": {"static": 2.345310505999805},
    "convergence": {"residual": 6.5e-16},
    "versions": {"femgear": "0.1.0"},
    "checksum": "0" * 64,
}


@pytest.fixture(scope="module")
def tool():
    spec = importlib.util.spec_from_file_location("compare_outputs", PATH)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def write(folder, *, stiffness=497.8, units="N/m", table=TABLE, manifest=MANIFEST, share="0.333333333"):
    """What a run may leave."""
    folder.mkdir()
    values = stiffness * (1 + 0.1 * np.arange(12.0).reshape(3, 4))
    data = xr.Dataset({"stiffness": (("mesh", "position"), values, {"units": units})})
    data = data.assign_coords(mesh=["a", "b", "c"], position=("position", np.arange(4.0), {"units": "1"}))
    data.to_netcdf(folder / "static.nc", engine="h5netcdf")
    (folder / "command_1.stdout.txt").write_text(table, encoding="utf-8")
    (folder / "manifest.json").write_text(json.dumps(manifest, indent=1) + "\n", encoding="utf-8")
    (folder / "shares.csv").write_text(f"planet,share [1]\n1,{share}\n2,nan\n", encoding="utf-8")
    return folder


@pytest.fixture
def compared(tool, tmp_path):
    """Compares a folder with one that is written in another way."""

    def compare(**changes):
        base, new = write(tmp_path / "base"), write(tmp_path / "new", **changes)
        return tool.compare_folders(base, new, tolerance=1e-12)

    return compare


def test_equal_folders(compared):
    tally = compared()
    assert tally.files == 4 and tally.variables == 3 + 1 + 2  # with the dimensions and two columns
    assert tally.within == 0 and tally.different == [] and tally.identical > 10


@pytest.mark.parametrize(("relative", "within", "different"), [(1e-10, 0, 1), (2e-13, 1, 0)])
def test_changed_values_are_found(compared, relative, within, different):
    tally = compared(stiffness=497.8 * (1 + relative))
    assert (tally.within, len(tally.different)) == (within, different)
    if different:
        ((size, where),) = tally.different
        assert size == pytest.approx(relative, rel=1e-3) and where == "static.nc, stiffness"


def test_one_changed_value_is_measured_by_the_largest_of_its_variable(tool):
    base = np.array([1e6, 1.0, np.nan])
    new = np.array([1e6, 1.0 + 1e-4, np.nan])
    assert tool.array_size(base, new) == pytest.approx(1e-10, rel=1e-6)
    assert tool.array_size(base, base.copy()) is None
    assert tool.array_size(np.array([0.0]), np.array([-0.0])) == 0.0  # not the same bits
    for other in (
        base[:2],
        base.astype(np.float32),
        np.array([1e6, np.nan, 1.0]),
        np.array([1e6, 1.0, np.inf]),
    ):
        assert tool.array_size(base, other) == np.inf


def test_a_changed_attribute_is_found(compared):
    tally = compared(units="N/mm")
    assert tally.different == [(np.inf, "static.nc, stiffness@units")]


def test_a_changed_number_in_a_terminal_table_is_found(compared):
    tally = compared(table=TABLE.replace("497.847", "497.848"))
    ((size, where),) = tally.different
    assert size == pytest.approx(0.001 / 497.848) and "command_1.stdout.txt, line 6" in where


def test_a_line_more_is_one_difference(compared):
    tally = compared(table=TABLE.replace("Static\n", "Static\nwarning: new\n"))
    assert len(tally.different) == 1 and "'warning: new'" in tally.different[0][1]


def test_a_changed_cell_is_found(compared):
    tally = compared(share="0.333333334")
    assert [where for _, where in tally.different] == ["shares.csv, column 2, share [1]"]


def test_run_times_versions_and_checksums_are_masked(compared):
    changed = MANIFEST | {
        "timings": {"static": 11},
        "files": {"static.nc": "f" * 64},
        "versions": {"femgear": "2"},
        "checksum": "f" * 64,
    }
    table = TABLE.replace("2.35", "12.35").replace(" ─────────────────\n", " ──────────────────\n")
    assert compared(table=table, manifest=changed).different == []


def test_other_entries_and_stages_of_a_manifest_are_not_masked(compared):
    changed = MANIFEST | {"timings": {"modes": 2.0}, "convergence": {"residual": 6.6e-16}}
    assert len(compared(manifest=changed).different) == 2


def test_missing_and_damaged_files_are_found(tool, tmp_path):
    base, new = write(tmp_path / "base"), write(tmp_path / "new")
    (new / "shares.csv").rename(new / "sharing.csv")
    (new / "static.nc").write_bytes(b"")
    found = " ".join(where for _, where in tool.compare_folders(base, new, tolerance=1e-12).different)
    assert "shares.csv is missing in the new" in found and "sharing.csv is missing in the base" in found
    assert "static.nc cannot be compared" in found


def test_masks_of_places_and_warnings(tool, tmp_path):
    for name, line in (("base", 12), ("new", 99)):
        text = f"warning: zero (RuntimeWarning, /{name}/femgear/{name}.py:{line})\n/{name}/cases/a.toml\n"
        (tmp_path / name).mkdir()
        (tmp_path / name / "text.txt").write_text(text, encoding="utf-8")
    folders = (tmp_path / "base", tmp_path / "new")
    assert len(tool.compare_folders(*folders, tolerance=0.0).different) == 1
    assert not tool.compare_folders(*folders, tolerance=0.0, paths=(["/base"], ["/new"])).different


@pytest.fixture
def sides(tool, tmp_path):
    """Two sides with one finished job."""
    found = []
    for name in ("base", "new"):
        side = tool.Side(name, tmp_path, tmp_path / name, "0123abcd")
        side.folder.mkdir()
        write(side.folder / "case")
        stamp(tool, side)
        found.append(side)
    return tuple(found)


def stamp(tool, side, **changes):
    sizes = tool.names_of(side.folder / "case")
    run = tool.Run(side.commit, tool.libraries(), [["a"]], ["/x"], [0], 1.0, sizes)
    text = json.dumps(asdict(run) | changes)
    (side.folder / "case.json").write_text(text, encoding="utf-8")


def test_only_finished_runs_of_the_same_commit_are_valid(tool, sides):
    side = sides[0]

    def valid(commands=(("a",),)):
        return tool.is_valid(tool.stored(side, "case"), side, [list(one) for one in commands])

    assert valid() and not valid((("a", "--more"),))
    for changes in ({"commit": "4567"}, {"codes": [3]}, {"libraries": ""}):
        stamp(tool, side, **changes)
        assert not valid()
    stamp(tool, side)
    (side.folder / "case" / "shares.csv").write_text("planet\n")
    assert not valid()
    stamp(tool, side)
    assert valid()
    (side.folder / "case.json").write_text('{"commit": "01')
    assert not valid()


def test_report_says_what_failed_and_what_is_missing(tool, sides, capsys):
    assert tool.report(sides, {"case": [True, True]}, 1e-12)
    assert not tool.report(sides, {"case": [True, False]}, 1e-12)
    assert "MISSING in new" in capsys.readouterr().out
    for side in sides:
        stamp(tool, side, codes=[3])
    assert not tool.report(sides, {"case": [True, True]}, 1e-12)
    assert "FAILED in both checkouts in the same way" in capsys.readouterr().out
    shutil.rmtree(sides[1].folder / "case")
    write(sides[1].folder / "case", stiffness=1.0)
    stamp(tool, sides[1])
    assert not tool.report(sides, {"case": [True, True]}, 1e-12)
    text = capsys.readouterr().out
    assert "3 became 0" in text and "static.nc, stiffness" in text and "same way" not in text
