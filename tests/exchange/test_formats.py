"""Files for other programs, read back by the libraries that other programs use."""

import gc
import re
import struct
import sys
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.io import loadmat, wavfile

from femgear import cli, open_results, run
from femgear.errors import StorageError
from femgear.exchange import formats
from femgear.exchange.formats import (
    Shapes,
    Signal,
    Spectrum,
    write_functions,
    write_matlab,
    write_modes,
    write_wav,
    write_workbook,
)
from femgear.exchange.sampling import Sampling
from femgear.housing.sound import run_up_signal, sampled_signal, stored_sound
from femgear.storage.files import own_files
from femgear.storage.results import dataset, tables_of
from femgear.trains.elastic.results import run_up_lines, sensor_signals
from femgear.trains.reading import read_case, to_toml, with_values

pytestmark = pytest.mark.usefixtures("pictures_undrawn", "coarse_states")

CASE = Path(__file__).parents[2] / "cases" / "planetary_27_40_108.toml"
QUICK = {
    "static.positions": 8,
    "static.flank_elements": 6,
    "static.stresses": False,
    "dynamics.mesh_harmonics": 3,
    "runup.count": 4,
    "housing.published": [],
    "housing.microphone": {"distance": "0.5 m", "angle": "30 deg"},
}


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    """Results of a short run of the reference set, and all that it exports."""
    folder = tmp_path_factory.mktemp("run")
    (folder / "case.toml").write_text(to_toml(with_values(read_case(CASE), QUICK)), encoding="utf-8")
    assert cli.main(["run", str(folder / "case.toml"), "-o", str(folder / "out"), "--no-pictures"]) == 0
    options = ["--xlsx", "--mat", "--wav", "--uff", "--quality", "--duration", "2.4", "--run-up", "0.5"]
    options += ["--pressure-scale", "0.5", "--acceleration-scale", "1"]
    assert cli.main(["export", str(folder / "out"), *options]) == 0
    return folder / "out"


@pytest.fixture
def results(out):
    return open_results(out)


def uff(path):
    import pyuff

    file = pyuff.UFF(str(path))
    found = file.read_sets()
    return found if isinstance(found, list) else [found]


# --- WAV -------------------------------------------------------------------------------------------


def test_wav_keeps_numbers_and_states_its_full_scale(tmp_path):
    values = np.array([0.0, 1.5, -30.0, 2.25])
    write_wav(Signal("microphone", "Pa", 48_000, values), tmp_path / "a.wav", full_scale=20.0)
    rate, samples = wavfile.read(tmp_path / "a.wav")
    assert rate == 48_000 and samples.dtype == np.float32
    assert samples == pytest.approx(values / 20.0, rel=1e-7)  # -1.5 is not clipped
    content = (tmp_path / "a.wav").read_bytes()
    assert struct.unpack_from("<I", content, 4)[0] == len(content) - 8
    assert content[:4] == b"RIFF" and b"INFOICMT" in content and b"1.0 = 20 Pa" in content


def test_wav_files_of_a_run_are_its_lines(out, results):
    """Both sensors at both speeds: whole turns of 2.4 s, r.m.s. that of the lines below half the rate."""
    for s, speed in enumerate(("250", "3100")):
        one = results.housing.isel(speed=s)
        lines, pressure = stored_sound(one)
        for name, values, scale in (
            ("accelerometer", lines.acceleration, 1.0),
            ("microphone", pressure, 0.5),
        ):
            rate, samples = wavfile.read(out / "exported" / f"{name}_{speed}_rpm.wav")
            turns = len(samples) / rate * float(lines.base_speed) / (2 * np.pi)
            assert rate == 48_000 and turns == pytest.approx(round(turns), abs=1e-4)
            expected = np.sqrt(0.5 * (np.abs(values[lines.order > 0]) ** 2).sum())
            # 32-bit floats
            assert scale * np.sqrt(np.mean(samples.astype(float) ** 2)) == pytest.approx(expected, rel=1e-6)


def test_samples_beyond_the_full_scale_are_warned_of(out, tmp_path, capsys):
    options = ["export", str(out), "--wav", "--duration", "0.1", "--run-up", "0.5", "-o", str(tmp_path / "a")]
    assert cli.main([*options, "--pressure-scale", "1e-3", "--acceleration-scale", "1e5"]) == 0
    said = capsys.readouterr().err
    assert said.count("W-CLIPPING") == 1 and "raise --pressure-scale" in said
    assert cli.main([*options, "--pressure-scale", "1e3", "--acceleration-scale", "1e5"]) == 0
    assert "W-CLIPPING" not in capsys.readouterr().err
    # no scale is named: one for all files, which nothing exceeds
    assert cli.main(options) == 0 and "W-CLIPPING" not in capsys.readouterr().err
    for sensor in ("microphone", "accelerometer"):
        files, scales, peaks = list((tmp_path / "a").glob(f"{sensor}*.wav")), set(), []
        for path in files:
            scales.add(re.search(rb"1.0 = (\S+) ", path.read_bytes())[1])
            peaks.append(np.abs(wavfile.read(path)[1]).max())
        assert len(files) >= 2 and len(scales) == 1 and 0.05 < max(peaks) < 1.0


def test_what_a_rate_leaves_out_is_told_with_its_size(out, results, tmp_path, capsys):
    options = ["export", str(out), "--wav", "--duration", "0.1", "--run-up", "0.5", "-o", str(tmp_path / "a")]
    assert cli.main([*options, "--rate", "2000"]) == 0
    said = [line for line in capsys.readouterr().err.splitlines() if "m/s^2 r.m.s." in line]
    lines = run_up_lines(results.runup, results.housing.attrs)[0]  # it has the loudest speed
    power = 0.5 * np.abs(lines.acceleration) ** 2
    lost, level = np.sqrt(max(zip((power * (lines.frequency >= 1000.0)).sum(axis=1), power.sum(axis=1))))
    assert len(said) == 1 and "[W-RATE] lines at 1000 Hz and above are left out" in said[0]
    left = 10 * np.log10(1 - (lost / level) ** 2)
    assert f"up to {lost:.3g} m/s^2 r.m.s. of {level:.3g}, {left:+.2g} dB of the level" in said[0]
    assert cli.main(options) == 0 and "W-RATE" not in capsys.readouterr().err
    assert cli.main([*options, "--rate", "1"]) == 2
    assert "--rate: no such sampling" in capsys.readouterr().err


def test_progress_counts_the_signals(results, tmp_path):
    told = []
    own_files(tmp_path / "a", ())
    options = Sampling(duration=0.1, run_up=0.1)
    names = run.export_results(results, tmp_path / "a", ["wav"], options, progress=lambda *one: told.append(one))
    assert told == [("sound", done, len(names)) for done in range(len(names) + 1)]


def test_signals_of_several_formats_are_sampled_once_and_are_those_of_each(results, tmp_path, monkeypatch):
    options, times = Sampling(duration=0.1, run_up=0.1), []

    def counted(*given, **named):
        times.append(given[2])
        return sampled_signal(*given, **named)

    monkeypatch.setattr("femgear.trains.elastic.results.sampled_signal", counted)
    together, apart = tmp_path / "together", tmp_path / "apart"
    own_files(together, ())
    own_files(apart, ())
    names = run.export_results(results, together, ["wav", "uff"], options)
    steady = sum(name.endswith("_rpm.wav") for name in names)
    assert len(times) == steady > 0
    for form in ("wav", "uff"):
        run.export_results(results, apart, [form], options)
    assert len(times) == 3 * steady
    assert all((together / name).read_bytes() == (apart / name).read_bytes() for name in names)


def test_a_universal_file_is_written_without_reading_it_again(tmp_path, monkeypatch):
    """The library looks for the data sets of its file after every one that it adds."""
    pyuff = pytest.importorskip("pyuff")
    read, refresh = [], pyuff.UFF.refresh

    def counted(file):
        path = Path(file._filename)
        read.append(path.stat().st_size if path.exists() else 0)
        return refresh(file)

    monkeypatch.setattr(pyuff.UFF, "refresh", counted)
    signals = [Signal(f"housing {number}", "m/s^2", 51_200, np.ones(1000)) for number in range(20)]
    write_functions(signals, [], tmp_path / "a.uff")
    assert max(read) < 3 * (tmp_path / "a.uff").stat().st_size / len(signals)


@pytest.mark.decisive
def test_order_cuts_are_written_in_the_level_that_is_asked_for(results, tmp_path):
    own_files(tmp_path / "a", ())
    stages, told = len(results.stages), []
    for form, factor in (("m/s^2 rms", 1.0), ("m/s^2 peak", np.sqrt(2)), ("g peak", np.sqrt(2) / 9.80665)):
        told.clear()
        sampling = Sampling(level=form)
        run.export_results(results, tmp_path / "a", ["csv"], sampling, progress=lambda *one: told.append(one))
        assert told == [("csv", done, stages) for done in range(stages + 1)]
        table = pd.read_csv(tmp_path / "a" / "order_cuts.csv")
        assert table["speed [rpm]"].to_numpy() == pytest.approx(results.runup["speed"].values)
        assert table.iloc[:, 1].to_numpy() == pytest.approx(factor * results.runup["level"].values, rel=1e-5)
        assert all(f"{form}" in name for name in table.columns[1:-1])
        change, missed = results.runup["level_change"].values, table.iloc[:, -1].to_numpy()
        looked = np.isfinite(change)
        assert missed[looked] == pytest.approx(change[looked]) and missed.min() > 1.0
        assert table.columns[-1] == "change by a longer excitation [dB]"


def test_a_run_up_is_sampled_from_its_lines(results):
    """From a dataset of the form of runup.nc: accelerations over speeds and orders."""
    speeds, order = np.array([200.0, 400.0, 800.0]), np.array([0, 105, 108, 111])
    rng = np.random.default_rng(2)
    lines = rng.normal(size=(3, 4)) + 1j * rng.normal(size=(3, 4))
    lines[:, 0] = 0.0
    carrier = speeds / 60 * 2 * np.pi / 5
    words = ("m/s^2", "acceleration")
    runup = dataset(
        {
            "lines_real": ("speed order", lines.real, *words),
            "lines_imag": ("speed order", lines.imag, *words),
            "carrier_speed": ("speed", carrier, "rad/s", "speed of the carrier"),
        },
        {"speed": ("speed", speeds, "rpm", "speed"), "order": ("order", order, "1", "carrier order")},
        {},
    )
    files = dict(results.manifest.files) | {"runup.nc": ""}
    object.__setattr__(results.manifest, "files", files)
    results.with_known({"runup": runup})
    *steady, accelerometer, microphone = sensor_signals(results, Sampling(duration=0.1, run_up=1.5))
    assert len(steady) == 4 and all(one.steady for one in steady)
    assert (accelerometer.name, microphone.name) == ("accelerometer_run_up", "microphone_run_up")
    expected = run_up_signal(order, lines, carrier, duration=1.5)
    assert not accelerometer.steady and accelerometer.unit == "m/s^2"
    assert np.abs(accelerometer.values - expected).max() < 1e-9
    assert microphone.unit == "Pa" and microphone.values.shape == expected.shape and microphone.values.any()


# --- universal files -------------------------------------------------------------------------------


def test_functions_come_back_from_a_universal_file(tmp_path):
    rng = np.random.default_rng(0)
    signal = Signal("housing", "m/s^2", 51_200, rng.normal(size=1001))
    lines = Spectrum("air", "Pa", 2.5, rng.normal(size=7) + 1j * rng.normal(size=7))
    write_functions([signal], [lines], tmp_path / "a.uff")
    units, time, spectrum = uff(tmp_path / "a.uff")
    assert units["type"] == 164 and units["units_code"] == 1 and units["length"] == 1.0
    assert time["type"] == spectrum["type"] == 58 and time["func_type"] == 1
    assert time["data"] == pytest.approx(signal.values, rel=1e-11)
    assert np.abs(spectrum["data"] - lines.values).max() < 1e-11
    assert time["x"][1000] == pytest.approx(1000 / 51_200, rel=1e-5)
    assert spectrum["x"] == pytest.approx(2.5 * np.arange(7))
    assert (time["ordinate_spec_data_type"], spectrum["ordinate_spec_data_type"]) == (12, 15)
    assert (time["abscissa_spec_data_type"], spectrum["abscissa_spec_data_type"]) == (17, 18)
    assert time["id1"].strip() == "housing" and "51200" in time["id2"]


def test_modes_come_back_from_a_universal_file(tmp_path):
    rng = np.random.default_rng(1)
    shapes = Shapes(rng.normal(size=(5, 3)), np.array([10.0, 2e3]), np.array([0.05, 0.01]), rng.normal(size=(2, 5, 3)))
    write_modes(shapes, tmp_path / "a.uff")
    units, nodes, *modes = uff(tmp_path / "a.uff")
    assert units["type"] == 164 and nodes["type"] == 15 and [one["type"] for one in modes] == [55, 55]
    assert np.stack([nodes[axis] for axis in "xyz"], axis=-1) == pytest.approx(shapes.points, abs=1e-5)
    for number, one in enumerate(modes):
        assert one["mode_n"] == number + 1 and one["modal_m"] == 1.0
        assert one["freq"] == pytest.approx(shapes.frequency[number], rel=1e-5)
        assert one["modal_damp_vis"] == pytest.approx(shapes.damping_ratio[number], rel=1e-5)
        found = np.stack([one[axis] for axis in ("r1", "r2", "r3")], axis=-1)
        assert found == pytest.approx(shapes.shape[number], rel=1e-5)


def test_universal_files_of_a_run(out, results):
    sets = uff(out / "exported" / "signals.uff")[1:]
    times, spectra = ([one for one in sets if one["func_type"] == kind] for kind in (1, 0))
    assert len(times) == len(spectra) == 4
    _, pressure = stored_sound(results.housing.isel(speed=1))
    heard = next(one for one in spectra if one["id1"].startswith("microphone_3100_rpm"))
    order = results.housing["order"].values[: len(pressure)]
    assert np.abs(heard["data"][order] - pressure).max() < 1e-11 * np.abs(pressure).max()
    _, nodes, *modes = uff(out / "exported" / "modes.uff")
    data = results.modes
    assert len(modes) == data.sizes["mode"]
    assert np.hypot(nodes["x"], nodes["y"]) == pytest.approx(results.case.ring.outer_radius, rel=1e-5)
    # the radial motion at a node is the sum of the circumferential components there
    angle, n = np.arctan2(nodes["y"], nodes["x"]), data["circumferential"].values
    for number in (5, 12):
        component = data["ring_shape_real"].values[number] + 1j * data["ring_shape_imag"].values[number]
        radial = (np.exp(1j * np.outer(angle, n)) @ component).real
        found = modes[number]["r1"] * np.cos(angle) + modes[number]["r2"] * np.sin(angle)
        assert np.abs(found - radial).max() < 1e-4 * np.abs(radial).max()


def test_a_full_disk_is_told_whatever_the_library_makes_of_it(tmp_path, monkeypatch):
    import pyuff

    def full(*_, **__):
        try:
            raise OSError(28, "No space left on device")
        except OSError:
            raise Exception("Error writing data-set #58")  # noqa: B904

    monkeypatch.setattr(pyuff.UFF, "write_sets", full)
    with pytest.raises(StorageError) as caught:
        write_functions([Signal("a", "Pa", 1, np.zeros(3))], [], tmp_path / "a.uff")
    assert caught.value.code == "E-DISK-FULL" and list(tmp_path.iterdir()) == []


# --- tables ----------------------------------------------------------------------------------------


def test_sheets_hold_the_tables(out, results):
    from openpyxl import load_workbook

    book = load_workbook(out / "exported" / "results.xlsx", read_only=True)
    tables = [table for stage in results for table in tables_of(results[stage], stage)]
    assert book.sheetnames == [name[:31] for name, _ in tables]
    for name, frame in tables:
        if frame.size > 20_000:
            continue
        rows = list(book[name[:31]].iter_rows(values_only=True))
        assert list(rows[0]) == [str(column) for column in frame.columns]
        for row, expected in zip(rows[1:], frame.itertuples(index=False), strict=True):
            for found, value in zip(row, expected, strict=True):
                same = isinstance(value, int) or (isinstance(value, float) and np.isfinite(value))
                # sixteen digits of a number
                if same:
                    assert abs(found - value) <= 1e-15 * abs(value)
                else:
                    assert found == str(value) or (found is None and value == "")


def test_text_is_no_formula(tmp_path):
    from openpyxl import load_workbook

    texts = ["=1+1", "+1", "-1", "@SUM(A1)", "=cmd|' /C calc'!A0", "a\x1bb", "plain"]
    frame = pd.DataFrame({"=head": texts, "value [m]": [1.5, np.nan, np.inf, 3.0, 4.0, 5.0, 6.0]})
    write_workbook([("a", frame)], tmp_path / "a.xlsx")
    sheet = load_workbook(tmp_path / "a.xlsx")["a"]
    cells = [cell for row in sheet.iter_rows() for cell in row]
    assert {cell.data_type for cell in cells} == {"s", "n"}
    assert [row[0].value for row in sheet.iter_rows()] == [
        "=head",
        *(t.replace("\x1b", "\\x1b") for t in texts),
    ]
    assert [row[1].value for row in sheet.iter_rows()][1:4] == [1.5, "nan", "inf"]


def test_sheets_have_names_of_their_own_and_a_last_row(tmp_path, monkeypatch):
    from openpyxl import load_workbook

    frame, long = pd.DataFrame({"a": [1]}), "x" * 40
    write_workbook([(long, frame), (long.upper(), frame), (long + "y", frame)], tmp_path / "a.xlsx")
    assert load_workbook(tmp_path / "a.xlsx").sheetnames == ["x" * 31, "X" * 29 + "~2", "x" * 29 + "~3"]
    monkeypatch.setattr(formats, "_ROWS", 3)
    tables = [("a", frame), ("b", pd.DataFrame({"a": [1, 2, 3]}))]
    assert write_workbook(tables, tmp_path / "b.xlsx") == ["b (3 rows)"]
    assert load_workbook(tmp_path / "b.xlsx").sheetnames == ["a"]


def test_a_sheet_takes_little_longer_than_to_write_its_numbers(tmp_path):
    """A pair has 3.8 million cells: at the 15 us of a cell that a library took, its export lasted a minute."""
    from openpyxl import load_workbook

    count, rng = 16_000, np.random.default_rng(0)
    frame = pd.DataFrame(
        {"gear": np.resize(["gear_1", "<&>"], count), "n": np.arange(count), "x": rng.normal(size=count)}
    )
    start = time.process_time()
    write_workbook([("a", frame)], tmp_path / "a.xlsx")
    workbook_seconds, start = time.process_time() - start, time.process_time()
    frame.to_csv(tmp_path / "a.csv")
    assert workbook_seconds < 5.0 * (time.process_time() - start)
    rows = list(load_workbook(tmp_path / "a.xlsx", read_only=True)["a"].iter_rows(values_only=True))
    assert rows == [tuple(frame.columns), *frame.itertuples(index=False, name=None)]


def test_an_interrupted_workbook_leaves_no_file_and_no_words_of_a_library(tmp_path, monkeypatch):
    def stop(value):
        raise KeyboardInterrupt

    gc.freeze()  # what libraries hold need not be walked for what the workbook leaves
    ignored, frame = [], pd.DataFrame({"a": [1.0, np.nan, 3.0]})
    monkeypatch.setattr(sys, "unraisablehook", ignored.append)
    monkeypatch.setattr(formats, "_sheet_cell", stop)
    with pytest.raises(KeyboardInterrupt):
        write_workbook([("a", frame)], tmp_path / "a.xlsx")
    gc.collect()
    assert [str(failure.exc_value) for failure in ignored] == [] and list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("columns", "last"), [(26, "Z"), (27, "AA"), (52, "AZ"), (703, "AAA")])
def test_cells_stand_in_their_columns(tmp_path, columns, last):
    from openpyxl import load_workbook

    write_workbook([("a", pd.DataFrame([[True, *range(1, columns)]]))], tmp_path / "a.xlsx")
    sheet = load_workbook(tmp_path / "a.xlsx")["a"]
    assert sheet[f"{last}2"].value == columns - 1 and sheet["A2"].value is True and sheet.max_column == columns


def test_matlab_reads_every_number(out, results):
    found = loadmat(out / "exported" / "results.mat", simplify_cells=True)
    for stage in results:
        data, struct_ = results[stage], found[stage]
        for name, one in data.variables.items():
            whole = str(name).removesuffix("_real").removesuffix("_imag")
            values = np.asarray(struct_[whole])
            if whole != name:
                values = values.real if str(name).endswith("_real") else values.imag
            if one.dtype.kind in "OU":
                assert [str(text) for text in np.ravel(values)] == [str(text) for text in one.values.ravel()]
            else:
                assert np.array_equal(values.ravel(), one.values.ravel(), equal_nan=True), name
            assert struct_["units"][whole] == one.attrs.get("units", "1")
    assert found["housing"]["attributes"]["ring_teeth"] == 108
    assert found["housing"]["lines"].dtype == np.complex128 or found["housing"]["lines"].dtype == np.complex64


def test_matlab_refuses_what_its_format_does_not_hold(tmp_path):
    class Huge:
        nbytes = 2**31

    with pytest.raises(StorageError) as caught:
        write_matlab({"modes": Huge()}, tmp_path / "a.mat")  # type: ignore[dict-item]
    assert caught.value.code == "E-RANGE" and not list(tmp_path.iterdir())


# --- the command -----------------------------------------------------------------------------------


def test_quality_of_the_sound(out):

    table = pd.read_csv(out / "exported" / "sound_quality.csv")
    assert list(table["signal"]) == ["microphone_250_rpm", "microphone_3100_rpm"]
    loudness = table["loudness [sone]"]
    # six harmonics of the slow speed end at 540 Hz: nothing is heard of them
    assert loudness[0] == 0.0 and 1.0 < loudness[1] < 1000.0


def test_levels_and_place_of_the_microphone(results):
    housing = results.housing
    assert housing.attrs["microphone_distance"] == 0.5
    assert housing.attrs["microphone_angle"] == pytest.approx(np.pi / 6)
    assert housing.attrs["outer_radius"] == results.case.ring.outer_radius
    for s in range(2):
        lines, pressure = stored_sound(housing.isel(speed=s))
        # unweighted it is louder or within the 1.3 dB that A-weighting adds
        flat = 20 * np.log10(np.sqrt(0.5 * (np.abs(pressure) ** 2).sum()) / 20e-6)
        assert flat - 45 < float(housing["pressure_level"][s]) < flat + 1.3
        bound = float(housing["equivalent_power_level"][s])
        assert bound - 40 < float(housing["power_level"][s]) < bound + 3
        assert lines.order.size == pressure.size


def test_exported_files_belong_to_the_results(out, results):
    exported = {path.name for path in (out / "exported").iterdir() if path.name != ".written"}
    listed = {name.removeprefix("exported/") for name in results.manifest.files if name.startswith("exported/")}
    assert exported == listed and {"results.xlsx", "results.mat", "signals.uff", "modes.uff"} < exported


def test_runs_without_a_sensor_have_no_sound(tmp_path, out, capsys):
    folder = tmp_path / "out"
    assert cli.main(["run", str(out / "case.toml"), "-o", str(folder), "--only", "modes", "--no-pictures"]) == 0
    capsys.readouterr()
    assert cli.main(["export", str(folder), "--wav"]) == 2
    said = capsys.readouterr().err
    assert "E-STAGE" in said and "--wav" in said and not (folder / "exported").exists()
    assert cli.main(["export", str(folder), "--mat"]) == 0


@pytest.mark.parametrize(("option", "library"), [("--uff", "pyuff"), ("--xlsx", "openpyxl"), ("--quality", "mosqito")])
def test_absent_libraries_are_named_with_their_remedy(out, tmp_path, capsys, monkeypatch, option, library):
    monkeypatch.setitem(sys.modules, library, None)
    assert cli.main(["export", str(out), option, "--duration", "0.1", "-o", str(tmp_path / "a")]) == 5
    said = capsys.readouterr().err
    assert "E-LIBRARY" in said and library in said and 'pip install "femgear[nvh]"' in said
    # the other formats are written
    assert cli.main(["export", str(out), "--csv", option, "-o", str(tmp_path / "b")]) == 5
    assert any((tmp_path / "b").glob("*.csv")) and f"not written: {option}" in capsys.readouterr().out
