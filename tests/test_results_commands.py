"""`femgear report` and `femgear export`: they replace what is their own and unchanged, and nothing else."""

import os
import shlex
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import synthetic_results
import xarray as xr
from edited_manifests import finish

from femgear import cli
from femgear.errors import StorageError
from femgear.report import style
from femgear.stages import static_figures as figures
from femgear.storage.files import checksum, write_dataset, write_text
from femgear.storage.results import (
    prepare_output,
    read_manifest,
    record,
    run_folder,
    write_csv_tables,
)
from femgear.trains.reading import read_case, with_values

pytestmark = pytest.mark.usefixtures("pictures_undrawn", "coarse_states")

CASE = Path(__file__).parents[1] / "cases" / "planetary_27_40_108.toml"


def write_run(folder, *, stages=("static", "modes")):
    """Synthetic results with one picture."""
    case = read_case(CASE)
    write_text(case.source, folder / "case.toml")
    for stage in stages:
        write_dataset(getattr(synthetic_results, stage)(), folder / f"{stage}.nc")
    style.save_figure(figures.load_sharing(synthetic_results.static()), folder / "load_sharing.png")
    names = ["case.toml", *(f"{stage}.nc" for stage in stages), "load_sharing.png"]
    finish(folder, names, timings={"static": 1.25}, convergence={})


@pytest.fixture
def out(tmp_path):
    folder = prepare_output(tmp_path / "out")
    write_run(folder)
    return folder


def contents(folder):
    """Every file below a folder."""
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


@pytest.fixture
def refused(capsys):
    """Calls femgear, which must refuse and change nothing below the folder."""

    def call(folder, *arguments, code="E-OUTPUT"):
        before = contents(folder)
        assert cli.main([*map(str, arguments)]) == 4
        said = capsys.readouterr().err
        assert f"[{code}]" in said and "remedy" in said
        assert contents(folder) == before
        return said

    return call


# --- report ----------------------------------------------------------------------------------------


def test_a_report_is_written_again_and_belongs_to_the_results(out):
    assert cli.main(["report", str(out)]) == 0
    first, manifest = contents(out), read_manifest(out)
    assert manifest.files["report.html"] == checksum(out / "report.html")
    assert cli.main(["report", str(out)]) == 0
    assert contents(out) == first and not any(name.startswith(".") for name in first)


def test_a_foreign_or_changed_report_is_not_replaced(out, refused):
    (out / "report.html").write_text("mine")
    assert "report.html" in refused(out, "report", out)
    (out / "report.html").unlink()
    assert cli.main(["report", str(out)]) == 0
    (out / "report.html").write_text("mine")
    said = refused(out, "report", out)
    assert "report.html changed" in said and "move" in said


def test_a_report_that_a_killed_run_left_unlisted_is_taken_over(out):
    manifest = (out / "manifest.json").read_bytes()
    assert cli.main(["report", str(out)]) == 0
    first = contents(out)
    (out / "manifest.json").write_bytes(manifest)
    assert cli.main(["report", str(out)]) == 0
    assert contents(out) == first


@pytest.mark.parametrize("name", ["load_sharing.png", "static.nc", "modes.nc", "case.toml"])
def test_a_changed_file_is_not_accepted_by_a_new_report(out, refused, name):
    (out / name).write_bytes((out / name).read_bytes() + b" ")
    before = read_manifest(out)
    said = refused(out, "report", out, code="E-RESULTS-CHANGED" if name == "case.toml" else "E-OUTPUT")
    assert name in said and read_manifest(out) == before


def test_a_picture_that_was_removed_is_named_by_the_report(out):
    (out / "load_sharing.png").unlink()
    assert cli.main(["report", str(out)]) == 0
    assert "load_sharing.png is missing" in (out / "report.html").read_text(encoding="utf-8")


def test_pictures_that_a_report_adds_replace_nothing_foreign(tmp_path, refused):
    out = prepare_output(tmp_path / "out")
    write_run(out)
    (out / "load_sharing.png").unlink()
    names = ["case.toml", "static.nc"]
    finish(out, names, timings={}, convergence={})
    (out / "load_sharing.png").write_bytes(b"mine")
    assert "load_sharing.png" in refused(out, "report", out)
    (out / "load_sharing.png").unlink()
    assert cli.main(["report", str(out)]) == 0
    files = read_manifest(out).files
    assert files.keys() > {*names, "load_sharing.png", "report.html"}
    assert all(checksum(out / name) == digest for name, digest in files.items())


# --- export ----------------------------------------------------------------------------------------


def test_exported_files_belong_to_the_results(out):
    assert cli.main(["export", str(out), "--csv"]) == 0
    first, files = contents(out), read_manifest(out).files
    exported = {name for name in first if name.startswith("exported/")}
    assert exported and exported == {name for name in files if name.startswith("exported/")}
    assert all(files[name] == checksum(out / name) for name in exported)
    assert cli.main(["export", str(out), "--csv"]) == 0
    assert contents(out) == first


def test_exported_files_go_with_the_results_they_were_made_of(out):
    assert cli.main(["export", str(out), "--csv"]) == 0
    (out / "exported" / "notes.txt").write_text("mine")
    with run_folder(out, force=True) as new:
        write_run(new, stages=("static",))
    assert [path.name for path in (out / "exported").iterdir()] == ["notes.txt"]
    (out / "exported" / "notes.txt").unlink()
    assert cli.main(["export", str(out), "--csv"]) == 0
    assert all(path.name.startswith("static") for path in (out / "exported").iterdir())
    with run_folder(out, force=True) as new:
        write_run(new, stages=("static",))
    assert not (out / "exported").exists()


def test_a_changed_or_foreign_table_is_not_replaced(out, refused):
    (out / "exported").mkdir()
    (out / "exported" / "modes_mode.csv").write_text("mine")
    assert "modes_mode.csv" in refused(out, "export", out, "--csv")
    (out / "exported" / "modes_mode.csv").unlink()
    assert cli.main(["export", str(out), "--csv"]) == 0
    (out / "exported" / "modes_mode.csv").write_text("mine")
    assert "modes_mode.csv" in refused(out, "export", out, "--csv")


def test_tables_in_another_folder_replace_their_own_alone(out, tmp_path, refused):
    other = tmp_path / "tables"
    other.mkdir()
    (other / "notes.txt").write_text("mine")
    before = contents(out)
    assert cli.main(["export", str(out), "--csv", "-o", str(other)]) == 0
    there = contents(other)
    assert contents(out) == before and "modes_mode.csv" in there and there["notes.txt"] == b"mine"
    with run_folder(out, force=True) as new:
        write_run(new, stages=("static",))
        data = synthetic_results.static()
        write_dataset(data.assign(ste=2 * data.ste), new / "static.nc")
        finish(new, ["case.toml", "static.nc"], timings={}, convergence={})
    assert cli.main(["export", str(out), "--csv", "-o", str(other)]) == 0
    assert contents(other)["static_mesh_position.csv"] != there["static_mesh_position.csv"]
    (other / "static_mesh_position.csv").write_text("mine")
    assert "static_mesh_position.csv" in refused(other, "export", out, "--csv", "-o", other)
    results = out / "manifest.json"
    assert "results of a run" in refused(out, "export", out, "--csv", "-o", results.parent)


def test_a_refused_export_leaves_nothing(out, tmp_path, refused):
    other = tmp_path / "tables"
    refused(tmp_path, "export", tmp_path / "absent", "--csv", "-o", other, code="E-RESULTS-MISSING")
    assert not other.exists()
    other.mkdir()
    (other / "static.csv").write_text("mine")
    refused(tmp_path, "export", out, "--csv", "-o", other)
    assert contents(other) == {"static.csv": b"mine"}


def test_an_export_names_its_folder_without_control_characters(out, tmp_path, capsys):
    assert cli.main(["export", str(out), "--csv", "-o", str(tmp_path / "a\x1b[31mb")]) == 0
    said = capsys.readouterr().out
    assert "\x1b" not in said and r"a\x1b[31mb: " in said


def test_the_command_that_is_suggested_can_be_given_to_a_shell(tmp_path, refused):
    out = prepare_output(tmp_path / "my run; 'b'")
    write_text(read_case(CASE).source, out / "case.toml")
    record(out, ["case.toml"], timings={}, convergence={})
    said = refused(tmp_path, "report", out, code="E-RESULTS-INCOMPLETE")
    (command,) = (line.partition("run it again: ")[2] for line in said.splitlines() if "remedy" in line)
    assert shlex.split(command) == ["femgear", "run", str(out / "case.toml"), "-o", str(out)]


def test_tables_are_written_through_no_link(out, tmp_path, refused):
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (out / "exported").symlink_to(elsewhere, target_is_directory=True)
    refused(out, "export", out, "--csv")
    assert list(elsewhere.iterdir()) == []


def test_export_needs_the_lock_only_where_it_writes(out, tmp_path, capsys):
    with run_folder(out, force=True):
        assert cli.main(["export", str(out), "--csv"]) == 4
        assert "E-LOCKED" in capsys.readouterr().err
        assert cli.main(["export", str(out), "--csv", "-o", str(tmp_path / "tables")]) == 0


def test_tables_without_a_line_are_left_out_and_attributes_have_units(tmp_path):
    named = {"units": "m", "long_name": "x"}
    data = xr.Dataset(
        {"gap": (("member", "position"), np.zeros((0, 4)), named), "x": ("position", np.zeros(4), named)},
        attrs={
            "title": "words",
            "sun_torque": 30.0,
            "planet_angles": np.array([0.0, 2.0]),
            "teeth": np.array([27]),
            "complete": 1,
            "step": np.float64(1e-5),
        },
    )
    names = write_csv_tables(data, tmp_path, "static")
    assert names == ["static.csv", "static_position.csv"] == sorted(os.listdir(tmp_path))
    units = pd.read_csv(tmp_path / "static.csv", keep_default_na=False).set_index("name").unit
    expected = {"title": "", "sun_torque": "N m", "planet_angles": "rad", "teeth": "1", "complete": "1"}
    assert units.to_dict() == expected | {"step": "s"}


def test_a_table_has_a_safe_name(tmp_path):
    data = xr.Dataset({"x": ("..\\..\\up", [1.0], {"units": "m", "long_name": "x"})})
    with pytest.raises(StorageError) as info:
        write_csv_tables(data, tmp_path, "static")
    assert info.value.code == "E-CHOICE" and list(tmp_path.iterdir()) == []


# --- models for other programs ---------------------------------------------------------------------

SMALL = {"static.positions": 8, "static.stresses": False, "static.flank_elements": 6, "set.backlash": "0.1 mm"}


def small_pair(folder):
    case = with_values(read_case("cases/spur_pair.toml"), SMALL)
    (folder / "pair.toml").write_text(case.source, encoding="utf-8")
    return folder / "pair.toml"


def test_models_are_written_of_a_case_file(tmp_path, capsys):
    case, names = small_pair(tmp_path), ("set.npz", "set.fmu", "k.csv")
    files = [str(tmp_path / name) for name in names]
    options = [word for pair in zip(("--state-space", "--fmu", "--stiffness-table"), files) for word in pair]
    assert cli.main(["export", str(case), *options, "--harmonics", "3"]) == 0
    assert np.load(tmp_path / "set.npz")["stiffness"].shape == (1, 3 * 64)
    assert len((tmp_path / "k.csv").read_text().splitlines()) == 10
    before = {name: (tmp_path / name).read_bytes() for name in names}
    capsys.readouterr()
    assert cli.main(["export", str(case), "--stiffness-table", files[2], "--harmonics", "2"]) == 2
    assert "[E-OUTPUT]" in capsys.readouterr().err
    assert {name: (tmp_path / name).read_bytes() for name in names} == before
    assert cli.main(["export", str(case), "--stiffness-table", files[2], "--force"]) == 0
    assert cli.main(["export", str(case), "--state-space", str(tmp_path / "set.txt")]) == 2
    assert "--state-space" in capsys.readouterr().err and not (tmp_path / "set.txt").exists()


def test_models_are_written_of_a_run_beside_its_numbers(tmp_path, monkeypatch):
    """Curves that the run has are not computed again."""
    case, out = small_pair(tmp_path), tmp_path / "out"
    assert cli.main(["run", str(case), "-o", str(out), "--only", "static", "--no-pictures"]) == 0
    monkeypatch.setattr("femgear.run.solve", None)
    assert cli.main(["export", str(out), "--csv", "--stiffness-table", str(tmp_path / "k.mat")]) == 0
    assert (tmp_path / "k.mat").is_file() and (out / "exported" / "static.csv").is_file()


def test_numbers_are_those_of_a_run(tmp_path, capsys):
    assert cli.main(["export", str(small_pair(tmp_path)), "--csv"]) == 4
    assert "remedy" in capsys.readouterr().err
