"""scripts/side_bands.py: known lines of synthetic spectra, and files that are refused."""

import csv
from pathlib import Path

import numpy as np
import pytest
import pyuff
from script_runs import run_script

from femgear.exchange.formats import Signal, Spectrum, write_functions
from femgear.housing.orders import FOREIGN, NORMAL, UNEQUAL

ROOT = Path(__file__).resolve().parents[2]
SET = ["--ring", 70, "--sun", 30, "--planet", 20]
SET += [word for angle in (0, 86.4, 180, 266.4) for word in ("--angle", angle)]
# order and amplitude of what is in the record, in steps of 0.02, and what it is
KNOWN = {
    66.0: (0.6, NORMAL),
    70.0: (1.0, NORMAL),
    71.0: (0.2, UNEQUAL),
    73.34: (0.15, UNEQUAL),
    77.5: (0.2, UNEQUAL),
    66.18: (0.12, FOREIGN),
    140.0: (0.4, NORMAL),
    143.0: (0.1, UNEQUAL),
}


def run(folder, *arguments):
    return run_script("side_bands.py", *arguments, "-o", folder / "out", folder=folder)


def table(path):
    with open(path, newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def record():
    """Orders and amplitudes of a record of 50 turns through a Hann window, with noise at -60 dB."""
    order = np.arange(0.0, 160.0, 0.02)
    value = 1e-3 * np.abs(np.random.default_rng(1).normal(size=order.size))
    for at, (amplitude, _) in KNOWN.items():
        d = (order - at) / 0.02
        value += amplitude * np.abs(np.sinc(d) + 0.5 * np.sinc(d - 1) + 0.5 * np.sinc(d + 1))
    return order, value


def write(path, heading, columns, divider=","):
    rows = [divider.join(f"{one:.9g}" for one in row) for row in zip(*columns)]
    path.write_text("\n".join([heading, *rows]) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize("kind", ["order", "frequency", "level", "comma"])
def test_known_lines_of_a_spectrum(kind, tmp_path):
    order, value = record()
    speed = []
    if kind == "frequency":
        heading, columns, speed = (
            "Frequency [kHz];Hum [Pa]",
            (order * 10e-3, 3 * value),
            ["--speed", "600 rpm"],
        )
    elif kind == "level":
        heading, columns = "frequency [Hz];level [dB]", (order * 10.0, 20 * np.log10(value))
        speed = ["--speed=-600 rpm"]
    else:
        heading, columns = "order, acceleration [m/s^2]", (order, value)
    path = write(tmp_path / "a.csv", heading, columns, ";" if ";" in heading else ",")
    if kind == "comma":
        text = path.read_text().replace(",", ";").replace(".", ",")
        path.write_text("# decimal commas\n\n" + text)
    done = run(tmp_path, *SET, "--spectrum", path, *speed, "--harmonics", 2)
    assert done.returncode == 0, done.stderr
    found = {round(float(row["order"]), 2): row for row in table(tmp_path / "out" / "lines.csv")}
    assert {order: row["verdict"] for order, row in found.items()} == {
        order: verdict for order, (_, verdict) in sorted(KNOWN.items())
    }
    for order, (amplitude, _) in KNOWN.items():
        # the strongest one is 1; the foreign line stands in the skirt of its neighbour
        assert float(found[order]["level [dB]"]) == pytest.approx(20 * np.log10(amplitude), abs=0.3)
    assert found[73.34]["why"] == "70 + 1 turn of the sun" and found[70.0]["array factor"].startswith("0.809")
    assert "3 normal, 4 needs unequal turning parts, 1 not from this stage" in done.stdout


def test_factor_of_a_case_without_a_spectrum(tmp_path):
    done = run(tmp_path, "--harmonics", 1, "--half-width", 4)
    assert done.returncode == 0 and "only multiples of 3" in done.stdout
    rows = table(tmp_path / "out" / "array_factor.csv")
    found = {int(row["carrier order"]): (round(float(row["array factor"]), 9), row["symmetry"]) for row in rows}
    assert found == {o: (1.0, "") if o % 3 == 0 else (0.0, "forbidden") for o in range(104, 113)}
    assert (tmp_path / "out" / "side_bands.png").stat().st_size > 5000


def test_universal_file_that_femgear_exports(tmp_path):
    """The step of a universal file has six digits: order 108 x 6 stays where it is."""
    values = np.zeros(700, complex)
    values[[0, 645, 648, 649]] = 5.0, 1.0j, -0.5, 0.1
    step = 1234.56789 / 60 / 5
    spectra = [Spectrum(name, "m/s^2", step, values) for name in ("near", "far")]
    write_functions([Signal("near", "m/s^2", 1000, np.ones(9))], spectra, tmp_path / "a.uff")
    known = ["--spectrum", tmp_path / "a.uff", "--speed", "1234.56789 rpm"]
    refused = run(tmp_path, *known)
    assert refused.returncode == 2 and "2 spectra" in refused.stderr and "far (dataset 4" in refused.stderr
    done = run(tmp_path, *known, "--channel", "near")
    assert done.returncode == 0, done.stderr
    rows = table(tmp_path / "out" / "lines.csv")
    assert [(float(row["order"]), row["verdict"]) for row in rows] == [
        (pytest.approx(645, abs=1e-5), NORMAL),
        (pytest.approx(648, abs=1e-5), NORMAL),
        (pytest.approx(649, abs=1e-5), UNEQUAL),
    ]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("order,level [dB]\n1,2\n", "1 lines"),
        ("a,b\n1,2\n2,3\n", "a.csv:1: no column of orders"),
        ("order,frequency [Hz],amplitude\n1,2,3\n2,3,4\n", "or both"),
        ("order\n1\n2\n", "0 columns of amplitudes"),
        ("order,a,b\n1,2,3\n2,3,4\n", "choose one by --channel"),
        ("order [Hz],a\n1,2\n2,3\n", "a unit of order that is none"),
        ("frequency,a\n1,2\n2,3\n", "a unit of frequency that is none"),
        ("frequency [rpm],a\n1,2\n2,3\n", "Hz or kHz"),
        ("frequency [Hz],a\n1,2\n2,3\n", "--speed"),
        ("order,a\n1,2\n2,nan\n3,3\n", "a.csv:3: no finite numbers"),
        ("order,a\n1,2\n2,inf\n3,3\n", "a.csv:3: no finite numbers"),
        ("order,a\n1,2\n2,x\n3,3\n", "a.csv:3: no finite numbers"),
        ("order,a\n1,2\n2,3,4\n3,3\n", "a.csv:3: no finite numbers"),
        ("order,a\n1,2\n2,-3\n3,3\n", "a.csv:3: a negative"),
        ("order,a\n1,2\n3,3\n2,3\n", "a.csv:4: orders or frequencies do not ascend"),
        ("order,a\n1,2\n1,3\n2,3\n", "keep one line of every order"),
        ("order,a\n0,2\n1,0\n2,0\n", "silent"),
        ("order,a\n", "0 lines"),
    ],
)
def test_refused_tables(text, words, tmp_path):
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    done = run(tmp_path, *SET, "--spectrum", tmp_path / "a.csv")
    assert done.returncode == 2 and words in done.stderr and not (tmp_path / "out").exists(), done.stderr


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"func_type": 1}, "no spectrum of amplitudes"),
        ({"func_type": 4}, "0 (general), 2 (auto spectrum), 12 (spectrum)"),
        ({"func_type": 2, "data": np.array([1.0, 2.0, 3j])}, "auto spectrum with complex values"),
        ({"abscissa_spec_data_type": 17, "abscissa_axis_units_lab": "s"}, "abscissa of another kind"),
        ({"abscissa_axis_units_lab": "rpm"}, "a unit of frequency"),
        ({"data": np.array([1.0, 7.0, 2.0])}, "finite"),
    ],
)
def test_refused_universal_files(changes, words, tmp_path):
    known = {"func_type": 0, "abscissa_spec_data_type": 18, "abscissa_axis_units_lab": "Hz", "id1": "a"}
    known |= {
        "x": np.arange(3.0),
        "data": np.array([1.0, 2.0, 3.0]),
        "rsp_dir": 0,
        "ref_node": 0,
        "ref_dir": 0,
    }
    known |= {
        "rsp_node": 1,
        "binary": 0,
        "abscissa_spacing": 1,
        "z_axis_value": 0.0,
        "ordinate_axis_units_lab": "",
    }
    known |= {f"{one}_spec_data_type": 0 for one in ("orddenom", "z_axis", "ordinate")}
    pyuff.UFF(str(tmp_path / "a.uff")).write_sets(pyuff.prepare_58(**known | changes), mode="overwrite")
    text = (tmp_path / "a.uff").read_text()  # the library writes no number that is not finite
    (tmp_path / "a.uff").write_text(text.replace("7.00000000000e+00", f"{'nan':>17}"))
    done = run(tmp_path, *SET, "--spectrum", tmp_path / "a.uff", "--speed", "60 rpm")
    assert done.returncode == 2 and words in done.stderr and "a.uff" in done.stderr, done.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([ROOT / "cases/planetary_27_40_108.toml", "--ring", 70], "no CASE"),
        (["--ring", 70], "--angle for every planet"),
        (["--sun", 30], "give --ring as well"),
        (["--ring", 3, "--angle", 0], "5 to 2000 teeth"),
        (["--ring", 70, "--angle", 0, "--angle", 360], "different finite angles"),
        (["--harmonics", 0], "1 to 12 harmonics"),
        (["--threshold", 3], "a threshold of"),
        (["--speed", "60 rpm"], "give --spectrum"),
        ([*SET, "--spectrum", "none.csv"], "none.csv"),
        ([*SET, "--spectrum", "none.uff"], "cannot open the file"),
        ([ROOT / "cases/spur_pair.toml"], "E-"),
    ],
)
def test_refused_arguments(arguments, words, tmp_path):
    done = run(tmp_path, *arguments)
    assert done.returncode == 2 and words in done.stderr, done.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--tolerance", 0.001], "half the step or more"),
        (["--tolerance", 0], "half the step or more"),
        (["--tolerance", 0.3], "below 0.25"),
        (["--speed", "60 rpm"], "with no other"),
    ],
)
def test_refused_with_a_spectrum(arguments, words, tmp_path):
    path = write(tmp_path / "a.csv", "order,a", record())
    done = run(tmp_path, *SET, "--spectrum", path, *arguments)
    assert done.returncode == 2 and words in done.stderr, done.stderr
