"""As-built gearboxes: samples against the cases that they are, percentiles, correlations, going on, files."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import spearmanr
from script_runs import run_femgear
from small_gearbox import pair_tables

from femgear.case import text as case_text
from femgear.case.dependencies import Steps
from femgear.errors import CaseError
from femgear.study.entry_samples import EntryRequest, describe_entry_samples, entry_samples_into, sample_entries
from femgear.study.entry_tolerances import read_entry_tolerances
from femgear.study.objectives import named_quantity
from femgear.trains.live import Answer
from femgear.trains.reading import read_case, with_values

pytestmark = pytest.mark.usefixtures("pictures_undrawn", "coarse_states")

TOLERANCES = """
[[tolerance]]
key = "bearing[0].position"
distribution = "uniform"
limit = "2 mm"

[[tolerance]]
key = "operation.load_case[0].torque.motor"
distribution = "normal"
sigma = "0.1 %"
"""


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("entries")
    (folder / "box.toml").write_text(case_text.write(pair_tables()), encoding="utf-8")
    (folder / "tolerances.toml").write_text(TOLERANCES, encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def box(files):
    return read_case(files / "box.toml")


@pytest.fixture(scope="module")
def drawn(files, box):
    entries, _ = read_entry_tolerances(files / "tolerances.toml", box)
    quantities = [named_quantity(words, case=box) for words in ("bearing force B", "mesh force")]
    return sample_entries(box, entries, quantities, count=24, seed=3), entries


def test_a_sample_is_the_run_of_its_case(box, drawn):
    samples, _ = drawn
    case = with_values(box, dict(zip(samples.keys, samples.points[7], strict=True)))
    state = Answer(case, Steps()).deflection.contents()
    expected = [state["radial_force"].values[0, 1], state["mesh_force"].values[0, 0]]
    assert samples.values[7] == pytest.approx(expected, rel=1e-12)
    assert samples.worst == samples.values[:, 0].argmax()


def test_the_tolerance_that_makes_it_is_named(drawn):
    samples, entries = drawn
    correlation = samples.correlation()
    for q in range(2):
        for k in range(2):
            expected = spearmanr(samples.values[:, q], samples.drawn[:, k]).statistic
            assert correlation[q, k] == pytest.approx(expected, abs=1e-12)
    # the nearer the other bearing the less is left for this one; the mesh force follows the torque alone
    assert correlation[0, 0] < -0.99 and correlation[1, 1] > 0.99
    # what changes by rounding alone is made by none
    still = samples.values * [0.0, 1e-12] + 1.0
    assert (replace(samples, values=still).correlation() == 0.0).all()
    distribution, made = describe_entry_samples(samples, entries)
    assert made.rows[0][1].startswith("bearing[0].position (-") and len(distribution.rows) == 2
    assert [float(cell) for cell in distribution.rows[1][4:]] == pytest.approx(
        np.percentile(samples.values[:, 1], [5, 50, 95]), rel=1e-4
    )


def test_files_and_going_on(files, box, tmp_path):
    asked = EntryRequest(["bearing force B"], count=3, seed=3)
    blocks, names = entry_samples_into(box, tmp_path / "out", files / "tolerances.toml", asked)
    assert {*names} <= {path.name for path in (tmp_path / "out").iterdir()} and len(blocks) == 1
    lines = (tmp_path / "out" / "samples.jsonl").read_text().count("\n")
    entry_samples_into(box, tmp_path / "out", files / "tolerances.toml", replace(asked, count=4))
    assert (tmp_path / "out" / "samples.jsonl").read_text().count("\n") == lines + 1
    with open(tmp_path / "out" / "samples.csv", newline="", encoding="utf-8") as stream:
        rows = [*csv.DictReader(stream)]
    worst = max(rows, key=lambda row: float(row["bearing force B [N]"]))
    assert read_case(tmp_path / "out" / "worst.toml").bearing[0].position == pytest.approx(
        float(worst["bearing[0].position"].removesuffix(" mm")) * 1e-3
    )
    _, (name,) = entry_samples_into(box, tmp_path / "one", files / "tolerances.toml", replace(asked, index=2))
    position = read_case(tmp_path / "one" / name).bearing[0].position
    assert f"{1e3 * position:.9g} mm" == rows[2]["bearing[0].position"]


def test_no_samples_are_none(box, drawn):
    with pytest.raises(CaseError, match="E-RANGE"):
        sample_entries(box, drawn[1], drawn[0].quantities, count=0)


def test_options_of_sets_are_refused(files, tmp_path):
    words = ["samples", files / "box.toml", "--tolerances", files / "tolerances.toml", "-o", tmp_path / "out"]
    done = run_femgear(*words, "--positions", "16", folder=tmp_path)
    assert done.returncode == 2 and "--positions" in done.stderr and not (tmp_path / "out").exists()
