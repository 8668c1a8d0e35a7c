"""Runs that are interrupted go on from their stages; many speeds are solved and written some at a time."""

import json
import re
from functools import cache
from pathlib import Path
from shutil import copytree, disk_usage

import numpy as np
import pytest
import xarray as xr
from casings import casing_tables
from edited_manifests import edit_manifest
from small_gearbox import pair_tables

from femgear.errors import CaseError, ConvergenceError, StorageError
from femgear.findings import as_data
from femgear.report import page as report_page
from femgear.run import dynamic_model, mesh_stiffness, run_case, solve, stiffness_table
from femgear.storage import files
from femgear.storage.files import append_dataset, checksum, read_dataset, read_result, write_result
from femgear.storage.results import read_manifest, run_folder
from femgear.trains.elastic import stages as elastic
from femgear.trains.gearbox import stage_structure
from femgear.trains.helical import stages as helical
from femgear.trains.reading import read_case, with_values

SPEEDS = [f"{speed} rpm" for speed in range(1000, 3000, 150)]
CASES = Path(__file__).parents[1] / "cases"
pytestmark = pytest.mark.usefixtures("coarse_states", "pictures_undrawn")
QUICK = {
    "planetary_27_40_108": {
        "static.positions": 14,
        "static.flank_elements": 6,
        "static.stresses": False,
        "operation.speeds": ["2000 rpm", "3100 rpm"],
        "housing.published": None,
    },
    "own_chain": {
        "transient.settle": "0.05 s",
        "transient.duration": "0.2 s",
        "transient.rate": "20 kHz",
    },
    "four_stage_reducer": {"runup.count": 3},
    "helical_30_20_70": {
        "static.positions": 12,
        "static.flank_elements": 6,
        "operation.speeds": ["900 rpm", "9000 rpm"],
    },
    "nrel_pgb": {"planar.branch": {"from": "36 Hz", "to": "36.5 Hz", "harmonics": 3}},
    "gear_pair": {
        "response.from": 1.1,
        "response.to": 1.0,
        "response.harmonics": 4,
        "chaos": None,
        "sweep": {"ranges": [{"from": 0.6, "to": 1.0, "count": 3}], "steps": 60, "most_periods": 60},
    },
}


def quick(name):
    return with_values(read_case(CASES / f"{name}.toml"), QUICK[name])


def run(case, folder, *, stop="", only=None, force=False):
    """Run a case without pictures, interrupted as a stage begins; give the stages that were computed."""
    begun = []

    def progress(stage, done, total):
        if stage == stop:
            raise KeyboardInterrupt
        if done == 0 and stage not in begun:
            begun.append(stage)

    with run_folder(folder, case=case.source, force=force) as place:
        run_case(case, place, only=only, pictures=False, progress=progress)
    return begun


def test_numbers_are_told_before_anything_is_drawn(tmp_path, monkeypatch):
    case, seen = quick("own_chain"), list[list[str]]()

    def drawn(folder, *_, **__):
        seen.append(sorted(path.name for path in folder.glob("report.html")))
        return []

    def computed(results):
        seen.append([*results])
        assert not {*tmp_path.glob("*.png"), *tmp_path.glob("report.html")}

    monkeypatch.setattr(report_page, "write_pictures", drawn)
    with run_folder(tmp_path, case=case.source) as place:
        run_case(case, place, computed=computed)
    assert seen == [["deflection", "modes", "dynamics", "transient", "spectrum"], ["report.html"]]


def test_a_verdict_comes_before_the_files_of_a_short_run(tmp_path):
    case, there = quick("own_chain"), list[list[str]]()

    def computed(results):
        there.append(sorted(path.name for path in tmp_path.glob("*.nc")))
        assert float(results.dynamics["mean_force"].max()) > 0.0

    with run_folder(tmp_path, case=case.source) as place:
        run_case(case, place, pictures=False, computed=computed)
    written = read_manifest(tmp_path)
    assert there == [[]] and written.complete
    assert {f"{name}.nc" for name in written.timings} <= written.files.keys()


def test_two_stages_at_once_are_those_one_after_the_other(tmp_path, monkeypatch):
    case = with_values(quick("planetary_27_40_108"), {"static.stresses": True})

    def stages(folder):
        begun = run(case, tmp_path / folder, only="modes")
        return [name for name in begun if name in ("static", "stress", "modes")]

    assert stages("together") == ["static", "modes", "stress"]  # modes here, stresses in a copy of this process

    def fail(stage, done, total):
        if stage == "modes" and done:
            raise ConvergenceError("no modes", code="E-RESONANCE")

    with pytest.raises(ConvergenceError), run_folder(tmp_path / "out", case=case.source) as place:
        run_case(case, place, only="modes", pictures=False, progress=fail)
    monkeypatch.setattr("femgear.run.second_core", lambda: False)
    assert stages("alone") == ["static", "stress", "modes"]
    together, alone, before = (contents(tmp_path / name) for name in ("together", "alone", "out"))
    assert together == alone and before == {name: alone[name] for name in ("static.nc", "stress.nc")}


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.glob("*.nc")}


@pytest.mark.parametrize(
    "name", [*list(QUICK)[:1], *(pytest.param(name, marks=pytest.mark.slow) for name in list(QUICK)[1:])]
)
def test_an_interrupted_run_goes_on_from_its_stages_to_the_same_bits(name, tmp_path, monkeypatch):
    """Of stages one after the other: what is computed beside another one is lost with it."""
    monkeypatch.setattr("femgear.run.second_core", lambda: False)
    case = quick(name)
    begun = run(case, tmp_path / "whole")
    # steps of a stage, such as grids, are told by names of their own
    stages = [name for name in begun if name in read_manifest(tmp_path / "whole").timings]
    with pytest.raises(KeyboardInterrupt):
        run(case, tmp_path / "out", stop=stages[-1])
    left = read_manifest(tmp_path / "out")
    assert not left.complete and sorted(left.timings) == sorted(stages[:-1])
    with pytest.warns(UserWarning, match=f"{', '.join(left.timings)}: as the run that was interrupted"):
        assert run(case, tmp_path / "out") == stages[-1:]
    assert contents(tmp_path / "out") == contents(tmp_path / "whole")
    again, whole = (read_manifest(tmp_path / name) for name in ("out", "whole"))
    assert as_data(again.findings) == as_data(whole.findings) and again.convergence == whole.convergence
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == sorted(
        path.name for path in (tmp_path / "whole").iterdir()
    )


@pytest.fixture
def interrupted(tmp_path):
    """A folder with the first stages of a run that was interrupted, and its case."""
    case = quick("own_chain")
    with pytest.raises(KeyboardInterrupt):
        run(case, tmp_path / "out", stop="transient")
    return tmp_path / "out", case


def test_another_case_is_kept_out_of_an_interrupted_run(interrupted):
    folder, case = interrupted
    other = with_values(case, {"title": "another one"})
    with pytest.raises(StorageError, match="interrupted run of another case") as info:
        run(other, folder)
    assert info.value.code == "E-OUTPUT" and "--force" in info.value.remedy
    assert run(other, folder, force=True) == ["deflection", "modes", "dynamics", "transient", "spectrum"]
    assert read_manifest(folder).complete


def test_a_run_that_replaces_results_goes_on_too(interrupted):
    folder, case = interrupted
    with pytest.warns(UserWarning, match="deflection, modes, dynamics: as the run"):
        run(case, folder)
    before = contents(folder)
    with pytest.raises(KeyboardInterrupt):
        run(case, folder, stop="transient", force=True)
    assert read_manifest(folder).complete and contents(folder) == before
    with pytest.warns(UserWarning, match="deflection, modes, dynamics: as the run"):
        assert run(case, folder, force=True) == ["transient", "spectrum"]
    assert contents(folder) == before and not (folder / ".running").exists()


@pytest.mark.parametrize("damage", ["fingerprint", "bytes", "missing"])
def test_stages_that_do_not_fit_are_computed_again(interrupted, damage):
    folder, case = interrupted
    kept = folder / ".stages" / "modes.npz"
    if damage == "missing":
        kept.unlink()
    else:
        result = read_result(kept, fingerprint=fingerprint_of(kept))
        write_result(result, kept, fingerprint="0" * 64)
        if damage == "bytes":
            kept.write_bytes(kept.read_bytes()[:-40])
        listed = {**read_manifest(folder).files, ".stages/modes.npz": checksum(kept)}
        edit_manifest(folder, files=listed)
    assert run(case, folder) == ["modes", "dynamics", "transient", "spectrum"]


def test_a_file_of_the_user_among_the_kept_stages_is_refused_and_stays(interrupted):
    folder, case = interrupted
    photo = folder / ".stages" / "photo.png"
    photo.write_text("mine")
    with (
        pytest.raises(StorageError) as info,
        pytest.warns(UserWarning, match="deflection, modes, dynamics: as the run"),
    ):
        run(case, folder)
    assert info.value.file == str(photo) and photo.read_text() == "mine"
    assert not read_manifest(folder).complete
    photo.rename(folder.parent / "photo.png")
    with pytest.warns(UserWarning, match="deflection, modes, dynamics: as the run"):
        assert run(case, folder) == ["transient", "spectrum"]
    assert not photo.parent.exists()


def fingerprint_of(path):
    with np.load(path) as file:
        return json.loads(file["arr_0"].tobytes())["fingerprint"]


@pytest.mark.parametrize("module", ["builtins", "os", "subprocess", "femgear.run"])
def test_a_result_names_classes_of_femgear_alone(tmp_path, module):
    tree = ["own", 0, module, "list" if module == "builtins" else "Popen", ["dict", 1]]
    text = json.dumps({"fingerprint": "", "result": tree})
    np.savez(tmp_path / "a.npz", np.frombuffer(text.encode(), np.uint8))
    with pytest.raises(StorageError, match="no result of this case"):
        read_result(tmp_path / "a.npz", fingerprint="")


def test_a_function_is_no_result(tmp_path):
    with pytest.raises(TypeError, match="function"):
        write_result({"f": lambda: 0}, tmp_path / "a.npz", fingerprint="")
    assert not (tmp_path / "a.npz").exists()


@pytest.mark.parametrize("axes", [(0, 1, 2), (2, 1, 0), (1, 2, 0), (0, 2, 1)])
def test_results_keep_the_order_of_axes_in_memory(axes, tmp_path):
    """Products of arrays in another order round differently: a run that goes on would have other bits."""
    whole = np.arange(60.0).reshape(3, 4, 5).transpose(axes)
    for value in (whole, whole[:, :2]):
        write_result(value, tmp_path / "a.npz", fingerprint="f")
        found = read_result(tmp_path / "a.npz", fingerprint="f")
        assert np.array_equal(found, value)
        assert np.array_equal(np.argsort(found.strides), np.argsort(value.strides))


def test_results_keep_types_identity_and_what_may_be_written(tmp_path):
    shared = np.arange(4.0)
    shared.setflags(write=False)
    value = {
        "twice": (shared, [shared]),
        "set": {1, 2},
        "frozen": frozenset({"a"}),
        "slice": slice(1, None, 2),
        "nan": float("nan"),
        "number": np.float32(0.1),
        "complex": 1 + 2j,
        3: None,
        "big": 10**30,
    }
    write_result(value, tmp_path / "a.npz", fingerprint="f")
    found = read_result(tmp_path / "a.npz", fingerprint="f")
    array = found["twice"][0]
    assert array is found["twice"][1][0] and not array.flags.writeable and array.tolist() == [0, 1, 2, 3]
    for name in ("set", "frozen", "slice", "number", "complex", 3, "big"):
        assert found[name] == value[name] and type(found[name]) is type(value[name])
    assert np.isnan(found["nan"])


@pytest.fixture(scope="module")
def many_speeds(tmp_path_factory):
    """Of a name: its case at many speeds, a run of it interrupted before its dynamics, and that run whole."""

    @cache
    def of(name):
        case, folder = with_values(quick(name), {"operation.speeds": SPEEDS}), tmp_path_factory.mktemp(name)
        with pytest.raises(KeyboardInterrupt):
            run(case, folder / "begun", stop="dynamics")
        return case, folder / "begun", gone_on(case, folder / "begun", folder / "whole")

    return of


def gone_on(case, begun, folder):
    """A copy of a run that was interrupted, ended."""
    copytree(begun, folder)
    with pytest.warns(UserWarning, match="as the run that was interrupted"):
        run(case, folder)
    return folder


@pytest.mark.parametrize(
    ("name", "parts", "option", "limit"),
    [
        ("planetary_27_40_108", elastic.dynamics_parts, "memory", 4e7),
        pytest.param("helical_30_20_70", helical.helical_dynamics_parts, "most", 5, marks=pytest.mark.slow),
    ],
)
def test_speeds_in_parts_are_those_solved_together(name, parts, option, limit, many_speeds, tmp_path, monkeypatch):
    case, begun, whole = many_speeds(name)
    monkeypatch.setitem(parts.__kwdefaults__, option, limit)
    ways = whole, gone_on(case, begun, tmp_path / "parts")
    for stage in set(read_manifest(whole).timings) & {"dynamics", "housing"}:
        same(*(read_dataset(way / f"{stage}.nc") for way in ways))
    verdict, other = (read_manifest(way).convergence["dynamics"] for way in ways)
    assert verdict.pop("residual") == pytest.approx(other.pop("residual"), rel=1e-3)
    assert verdict == other and verdict["message"].startswith(f"{len(SPEEDS)} speeds: ")


def same(whole, parts):
    """Numbers to rounding as docs/results.md has it, of the size of their variable; texts and units."""
    page = (CASES.parent / "docs" / "results.md").read_text(encoding="utf-8")
    assert "within 1e-12 of the largest of a variable, residuals within 1e-7" in " ".join(page.split())
    texts = ({name: str(value) for name, value in one.attrs.items()} for one in (whole, parts))
    assert next(texts) == next(texts) and whole.sizes == parts.sizes and [*whole] == [*parts]
    for name, expected in whole.variables.items():
        found = parts[name]
        assert found.attrs == expected.attrs and found.dtype == expected.dtype, name
        if expected.dtype.kind == "f" and "phase" not in str(name):
            size = (1e-7 if name == "residual" else 1e-12) * np.nanmax(np.abs(expected.values))
            np.testing.assert_allclose(found.values, expected.values, rtol=0.0, atol=size, err_msg=name)
        elif expected.dtype.kind != "f":
            assert (found.values == expected.values).all(), name


def test_a_full_disk_is_met_after_the_first_part(tmp_path, monkeypatch):
    case = with_values(quick("helical_30_20_70"), {"operation.speeds": SPEEDS})
    monkeypatch.setitem(helical.helical_dynamics_parts.__kwdefaults__, "most", 5)

    def progress(stage, done, total):
        # room for two of the three parts
        left = disk_usage(tmp_path)._replace(free=1_150_000)
        if stage == "dynamics":
            monkeypatch.setattr(files.shutil, "disk_usage", lambda path: left)

    with pytest.raises(StorageError) as info, run_folder(tmp_path / "out") as place:
        run_case(case, place, pictures=False, progress=progress)
    assert info.value.code == "E-DISK-FULL" and info.value.file.endswith("dynamics.nc")
    assert not [path for path in (tmp_path / "out").rglob("*") if "tmp" in path.name]


def test_a_large_file_is_read_where_it_is_asked_for(tmp_path, monkeypatch):
    attrs = {"units": "m", "long_name": "x"}
    path = tmp_path / "a.nc"
    path.touch()
    for i in range(3):
        speed = ("speed", [10.0 * i, 10.0 * i + 1], {"units": "rpm", "long_name": "speed"})
        variables = {
            "x": (("speed", "k"), np.full((2, 5), float(i)), attrs),
            "stable": ("speed", [True, i > 0], {"units": "1", "long_name": "verdict"}),
            "method": ("speed", ["direct", f"part {i}"], {"units": "1", "long_name": "method"}),
            "k2": ("k", np.arange(5.0), attrs),
        }
        append_dataset(xr.Dataset(variables, {"speed": speed}, {"message": f"{i}"}), path, "speed")
    whole = read_dataset(path)
    assert whole.attrs["message"] == "2" and whole["method"].values[-1] == "part 2"
    assert whole["speed"].values.tolist() == [0, 1, 10, 11, 20, 21] and whole["stable"].dtype == bool
    monkeypatch.setattr(files, "_LARGE", 100)
    found = read_dataset(path)
    assert not found["x"].variable._in_memory and whole["x"].variable._in_memory
    assert found["x"].isel(speed=-1).values.tolist() == [2.0] * 5
    assert not found["x"].variable._in_memory and found.equals(whole)


def test_parts_of_different_lengths_are_filled_up_with_zeros(tmp_path):
    """What does not extend over the speed is that of the latest part; tables are compressed."""
    path, attrs = tmp_path / "x.nc", {"units": "1", "long_name": "values"}
    path.touch()
    for i, size in enumerate((3, 5, 2)):
        values = np.arange(1.0, size + 1).astype(np.float32)
        data = xr.Dataset(
            {"x": (("speed", "k"), np.tile(values, (2, 1)), attrs), "last": ("k", values, attrs)},
            {"speed": ("speed", [2.0 * i, 2.0 * i + 1], attrs), "k": ("k", np.arange(size), attrs)},
        )
        append_dataset(data, path, "speed")
    found = read_dataset(path)
    assert found["k"].values.tolist() == [0, 1, 2, 3, 4] and found["x"].dtype == np.float32
    expected = [[1, 2, 3, 0, 0]] * 2 + [[1, 2, 3, 4, 5]] * 2 + [[1, 2, 0, 0, 0]] * 2
    assert found["x"].values.tolist() == expected and found["last"].values.tolist() == [1, 2, 0, 0, 0]


def test_the_size_of_many_speeds_is_said_before(many_speeds, monkeypatch):
    case, _, folder = many_speeds("planetary_27_40_108")
    assert not [one for one in elastic.ELASTIC.case_warnings(case) if one.code == "W-SIZE"]
    monkeypatch.setattr(elastic, "_NOTICED", 0.0)
    (found,) = (one for one in elastic.ELASTIC.case_warnings(case) if one.code == "W-SIZE")
    said = re.search(r"14 speeds with up to (\d+) harmonics each fill about (\S+) GB", found.text)
    size = sum((folder / f"{stage}.nc").stat().st_size for stage in ("dynamics", "housing"))
    # whether the excitation is doubled is known with the modes
    # some of a small file is not numbers
    assert 0.8 < 1e9 * float(said[2]) / size < 2.2
    assert int(said[1]) >= read_dataset(folder / "dynamics.nc").sizes["harmonic"] - 1


def test_a_stiffness_table_has_the_period_of_the_first_gear():
    """Of a case, and of results without computing anything."""
    case = with_values(read_case(CASES / "spur_pair.toml"), {"static.positions": 8, "static.stresses": False})
    table = stiffness_table(case)
    assert table.angle == pytest.approx(2.0 * np.pi / 24 * np.arange(9) / 8, rel=1e-12)
    data = solve(case, "static")["static"].dataset()
    assert np.array_equal(table.stiffness[:, :-1], data["mesh_stiffness"].values)
    assert np.array_equal(table.deflection[:, -1], data["ste"].values[:, 0])
    assert table.meshes == ("gear 1-gear 2",)


@pytest.mark.slow
def test_helical_sets_have_the_stiffness_of_their_modes():
    helical_case = quick("helical_30_20_70")
    table = stiffness_table(helical_case)
    data = solve(helical_case, "modes")["modes"].dataset()
    assert np.array_equal(table.stiffness[:, :-1], data["helical_stiffness"].values)


@pytest.mark.parametrize("name", ["gear_pair", "four_stage_reducer"])
def test_kinds_of_cases_without_a_model_for_other_programs_are_refused(name):
    case = quick(name)
    for make, code in ((stiffness_table, "E-STAGE"), (dynamic_model, "E-MODEL")):
        with pytest.raises(CaseError) as refused:
            make(case)
        assert refused.value.code == code


def test_a_model_needs_a_speed():
    case = with_values(read_case(CASES / "spur_pair.toml"), {"operation.speeds": None, "static.positions": 8})
    with pytest.raises(CaseError, match="needs a speed"):
        dynamic_model(case)


def test_mesh_stiffness_over_angle_and_torque():
    case = with_values(read_case(CASES / "spur_pair.toml"), {"static.positions": 8})
    k = mesh_stiffness(case, [50.0, case.operation.torque])
    assert k.dims == ("torque", "mesh", "position")
    assert k.attrs["units"] == "N/m" and k["torque"].attrs["units"] == "N m"
    assert np.array_equal(k.values[1], solve(case, "static")["static"].dataset()["mesh_stiffness"].values)
    assert k.values[0].mean() != k.values[1].mean()
    assert np.array_equal(mesh_stiffness(case).values[0], k.values[1])


@pytest.mark.parametrize("name", ("gear_pair", "four_stage_reducer"))
def test_a_kind_of_case_without_the_curve_is_refused(name):
    with pytest.raises(CaseError, match="no mesh stiffness over the position"):
        mesh_stiffness(CASES / f"{name}.toml")


@pytest.mark.parametrize("writes", [False, True])
def test_stages_of_a_run_share_the_record_of_their_teeth(writes, tmp_path, monkeypatch):
    """Dynamics, the longer excitation that it is compared with, and the run-up excite with the same teeth."""
    tables = pair_tables(teeth=True) | {"casing": casing_tables(), "dynamics": {"up_to": "500 Hz"}}
    tables["sensor"] = [{"name": "top", "position": ["90 mm", "80 mm", "40 mm"], "direction": "y"}]
    tables["runup"] = {"from": "900 rpm", "to": "1100 rpm", "count": 2}
    tables["deflection"] = {"slices": 3}
    tables["pair"][0]["teeth"]["static"] = {"positions": 8, "flank_elements": 6, "stresses": False}
    walks, compute = [], stage_structure.loaded_period

    def counted(*given, **options):
        walks.append(given)
        return compute(*given, **options)

    monkeypatch.setattr(stage_structure, "loaded_period", counted)
    case = read_case(tables)
    if writes:
        with run_folder(tmp_path / "run") as place:
            run_case(case, place, pictures=False)
        stages = set(read_manifest(tmp_path / "run").timings)
    else:
        stages = set(solve(case))
    assert {"dynamics", "runup"} <= stages and len(walks) == 1
