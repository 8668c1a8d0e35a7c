"""femgear.measured.csv_signals: what programs of measurement write comes back, or is refused with its line."""

import numpy as np
import pytest
from recorded_signals import write_columns

from femgear.errors import CaseError
from femgear.measured.csv_signals import read_csv_signals

TIME = np.arange(300) / 1000.0
VALUES = np.random.default_rng(1).normal(size=(2, 300)).round(6)


def read(path, **options):
    channels = read_csv_signals(path, **options)
    return [(one.name, one.unit) for one in channels], np.array([one.values for one in channels]), channels[0].rate


@pytest.mark.parametrize("separator", [";", "\t", ",", " ", "  "])
@pytest.mark.parametrize("comma", [False, True])
def test_any_separator_and_decimal_mark(separator, comma, tmp_path):
    if separator == "," and comma:
        pytest.skip("refused")
    heading = separator.join(["time[s]", "acc[g]", "tacho[V]"]) + "\n"
    path = write_columns(tmp_path / "a.csv", heading, (TIME, *VALUES), separator=separator, comma=comma)
    names, values, rate = read(path)
    assert names == [("acc", "g"), ("tacho", "V")]
    assert np.array_equal(values, VALUES) and rate == pytest.approx(1000.0)


@pytest.mark.parametrize(
    ("heading", "names"),
    [
        ("", [("column 2", ""), ("column 3", "")]),
        ("Time;Acc left;Tacho\n", [("Acc left", ""), ("Tacho", "")]),
        ("Time;Acc left;Tacho\ns;m/s²;V\n", [("Acc left", "m/s²"), ("Tacho", "V")]),
        ("Operator;Smith\nRate:\n\nt (s);acc (g);n (V)\n", [("acc", "g"), ("n", "V")]),
        ("# t [s];acc;n\n", [("acc", ""), ("n", "")]),
        ("sep=;\nZeit [ms];acc;n\n", [("acc", ""), ("n", "")]),
    ],
)
def test_headings(heading, names, tmp_path):
    time = 1e3 * TIME if "ms" in heading else TIME
    found, values, rate = read(write_columns(tmp_path / "a.txt", heading, (time, *VALUES)))
    assert found == names and np.array_equal(values, VALUES) and rate == pytest.approx(1000.0)


@pytest.mark.parametrize("encoding", ["latin-1", "utf-16", "utf-16-le", "utf-16-be", "utf-8-sig"])
def test_encodings_of_programs(encoding, tmp_path):
    text = write_columns(tmp_path / "a.csv", "Zeit [s];Beschl. [m/s²]\n", (TIME, VALUES[0]), comma=True).read_text()
    (tmp_path / "a.csv").write_bytes(text.replace("\n", "\r\n").encode(encoding))
    names, values, _ = read(tmp_path / "a.csv")
    assert names == [("Beschl.", "m/s²")] and np.array_equal(values[0], VALUES[0])


def test_one_column_and_separators_at_the_end_of_lines(tmp_path):
    path = write_columns(tmp_path / "a.csv", "acc\n", (VALUES[0],), comma=True)
    assert np.array_equal(read(path, rate=2e3)[1][0], VALUES[0])
    (tmp_path / "b.csv").write_text("".join(f"{x};{y};\n" for x, y in VALUES.T))
    assert np.array_equal(read(tmp_path / "b.csv", rate=2e3)[1], VALUES)


def broken(text):
    return lambda path: path.write_text(text, encoding="utf-8")


ROWS = "".join(f"{t:.4f};{x:.6f}\n" for t, x in zip(TIME, VALUES[0]))
HALF_WITH_COMMAS = [line.replace(".", ",") if k % 2 else line for k, line in enumerate(ROWS.splitlines(True))]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a\n" * 200, "no samples"),
        ("x" * 2_000_000, "no samples"),
        ("t;a\n" + ROWS[:-4] + "\n1", "a.csv:302"),
        ("t;a\n" + ROWS + "0.3;x\n", "a.csv:302"),
        ("t;a\n" + ROWS + "0.3;\n", "a.csv:302"),
        ("t;a\n" + ROWS.replace("0.1000;", "0,1000;"), "a.csv:102"),
        ("t;a\n" + ROWS.replace("0.0100;", "0,0100;"), "a.csv:12: a line that is not made"),
        ("t;a\n" + ROWS.replace("0.0100;", ";"), "a.csv:12: a line that is not made"),
        ("t;a\n" + "".join(HALF_WITH_COMMAS), "cannot be told apart"),
        ("".join(f"{abs(x):.3f}\n".replace(".", ",") for x in VALUES[0]), "may be separators or decimal marks"),
        ("t;a\n" + "\n".join(ROWS.splitlines()[:20]), "20 samples"),
        ("a;b\n" + "".join(f"{x};{y}\n" for x, y in VALUES.T), "how many samples a second"),
        ("time [s];a\n" + "".join(ROWS.splitlines(True)[:100] + ROWS.splitlines(True)[110:]), "not even"),
        ("\0\1\2" * 100, "bytes that no text has"),
        ("", "the file is empty"),
        ("time,a\n" + ROWS.replace(".", ",").replace(";", ","), "decimal commas, and commas between the columns"),
        (ROWS.replace(".", ",").replace(";", ","), "decimal commas, and commas between the columns"),
        ("t,a\n" + ROWS.replace(".", ",").replace(";", ",").replace("0,0010", "0"), "commas between the columns"),
    ],
)
def test_hostile_files_are_refused_with_what_to_do(text, words, tmp_path):
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    with pytest.raises(CaseError, match=words) as refused:
        read_csv_signals(tmp_path / "a.csv")
    assert refused.value.code == "E-FILE" and refused.value.remedy and "a.csv" in str(refused.value)


def test_a_missing_file(tmp_path):
    with pytest.raises(CaseError, match="cannot open the file"):
        read_csv_signals(tmp_path / "none.csv")


def test_a_sample_that_is_nan_is_kept_for_the_check_of_its_channel(tmp_path):
    (tmp_path / "a.csv").write_text("t;a\n" + ROWS.replace(ROWS.splitlines()[9], "0.0090;nan"))
    (channel,) = read_csv_signals(tmp_path / "a.csv")
    assert np.isnan(channel.values[9]) and np.isfinite(channel.values).sum() == 299
