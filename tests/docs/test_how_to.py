"""How-to pages, FAQ and Python page: programs print what the pages say, sentences can be read."""

import contextlib
import dataclasses
import io
import re
import shlex
import subprocess
import sys
import tomllib
from importlib.metadata import EntryPoint, EntryPoints
from types import SimpleNamespace

import numpy as np
import pytest
from page_examples import ROOT, read_page, run_examples

from femgear import cli, open_results, read_case, solve, with_values
from femgear.trains import registry

pytestmark = pytest.mark.usefixtures("pictures_undrawn")

SLOW_PAGES = [pytest.param(name, marks=pytest.mark.slow) for name in ("silent_without_load", "faults")]
PAGES = ("pin_errors", "faq", "api", "live", "notebook", *SLOW_PAGES)
TUTORIAL = ("drawing_to_ste",)
HOW_TO = (
    "how_to",
    "silent_without_load",
    "which_part_makes_the_noise",
    "choosing_teeth",
    "optimise",
    "side_bands",
    "faults",
    "pin_errors",
    "misaligned",
    "crowning",
    "bolts",
    "casings",
    "run_up_sound",
    "samples",
    "live",
    "notebook",
    "cluster",
    "plugin",
    "faq",
)


@pytest.fixture(autouse=True)
def in_the_repository(monkeypatch):
    monkeypatch.chdir(ROOT)


def commands(text: str) -> list[list[str]]:
    """Commands of femgear on a page, without the name of the program."""
    blocks = re.findall(r"(?ms)^```sh\n(.*?)^```", text)
    return [shlex.split(line)[1:] for line in "".join(blocks).splitlines() if line.startswith("femgear ")]


@pytest.mark.parametrize("name", PAGES)
def test_examples_print_what_the_page_says(name):
    _, examples, printed = read_page(f"{name}.md")
    assert examples and "".join(run_examples(f"{name}.md", examples)) == "".join(printed)


@pytest.mark.slow
def test_relief_lowers_the_level_by_less_than_the_error():
    """The last paragraph of silent_without_load.md: a fifth of the error, less than 2 dB of the level."""
    names = {"__name__": "__main__"}
    _, (example,), _ = read_page("silent_without_load.md")
    exec(compile(example.split("print(")[0], "silent_without_load.md", "exec"), names)
    one_speed = {
        "operation.speeds": ["3100 rpm"],
        "runup.count": 0,
        "static.stresses": False,
        "housing.published": [],
    }
    levels, errors = [], []
    for entries in ({}, names["relieved"]):
        found = solve(with_values(names["case"], entries | one_speed))
        ste = found["static"].dataset()["ste"].sel(mesh="sun-planet 1")
        errors.append(float(ste.max() - ste.min()))
        levels.append(float(found["housing"].dataset()["level"][0]))
    assert 0.15 < errors[1] / errors[0] < 0.22
    assert 10 ** (-2 / 20) < levels[1] / levels[0] < 1


@pytest.mark.slow
def test_sound_of_a_run_up(tmp_path, monkeypatch, capsys):
    text, examples, printed = read_page("run_up_sound.md")
    run, export = commands(text)
    case = str(ROOT / run[1])
    monkeypatch.chdir(tmp_path)
    assert cli.main([run[0], case, *run[2:]]) == 0 and cli.main(export) == 0
    files = {path.name for path in (tmp_path / "out" / "run_up" / "exported").glob("*.wav")}
    assert len(files) == 6 and {"microphone_run_up.wav", "accelerometer_run_up.wav"} <= files
    assert run_examples("run_up_sound.md", examples) == printed
    assert open_results("out/run_up").stages


def test_options_of_the_sound_are_those_of_the_page():
    text, _, _ = read_page("run_up_sound.md")
    for option, default in re.findall(r"^\| `--([\w-]+)` \| ([\d]+)", text, flags=re.MULTILINE):
        from femgear.exchange.sampling import Sampling

        assert getattr(Sampling(), option.replace("-", "_")) == float(default)


def test_programs_that_read_results(tmp_path):
    """docs/results.md: orders, signals and loudness of the sensor of a run."""
    _, examples, _ = read_page("results.md")
    entries = {
        "operation.speeds": ["250 rpm"],
        "runup.count": 0,
        "static.positions": 8,
        "static.flank_elements": 6,
        "static.stresses": False,
        "dynamics.mesh_harmonics": 3,
        "housing.published": [],
    }
    case = with_values(read_case(ROOT / "cases" / "planetary_27_40_108.toml"), entries)
    names = {"results": SimpleNamespace(housing=solve(case)["housing"].dataset())}
    exec(examples[0], names)
    assert names["signal"].acceleration.std() == pytest.approx(float(names["results"].housing["level"][0]), rel=1e-3)
    pytest.importorskip("mosqito")
    exec(examples[1].replace("10.0", "0.5"), names)
    assert names["sound"].shape[0] / 48000 == pytest.approx(0.5, abs=2 * np.pi / names["speed"])


@pytest.mark.slow
def test_a_sweep_by_two_processes(tmp_path):
    """docs/cluster.md: the transmission error grows with the torque; the program for Slurm is one."""
    _, (example, jobqueue), _ = read_page("cluster.md")
    compile(jobqueue, "cluster.md", "exec")
    (tmp_path / "sweep.py").write_text(example, encoding="utf-8")
    command = [sys.executable, str(tmp_path / "sweep.py")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=True)
    low, high = map(float, re.findall(r"[\d.e-]+", done.stdout))
    assert 1.9 < high / low < 2.1


@pytest.mark.parametrize("searched", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_search_over_reliefs(searched, tmp_path):
    """docs/optimise.md: the problem is one; the search of a coarse case, that of the page takes minutes."""
    _, (example,), _ = read_page("optimise.md")
    problem, search = example.split("print(")
    names = {"__name__": "__main__"}
    exec(problem, names)
    assert len(names["variables"]) == 8 and names["problem"].case == names["case"]
    if searched:
        coarse = with_values(names["case"], {"static.positions": 8, "static.flank_elements": 12})
        names["problem"] = dataclasses.replace(names["problem"], case=coarse, also=())
        output = io.StringIO()
        with contextlib.redirect_stdout(output):
            exec("print(" + search.replace("out/reliefs.jsonl", str(tmp_path / "reliefs.jsonl")), names)
        assert all(one.keys[0] in output.getvalue() for one in names["variables"])


def test_a_train_of_your_own(tmp_path, monkeypatch, capsys):
    text, (module, program), (printed,) = read_page("plugin.md")
    case, package = re.findall(r"(?ms)^```toml\n(.*?)^```", text)
    (tmp_path / "two_discs.py").write_text(module, encoding="utf-8")
    (tmp_path / "discs.toml").write_text(case, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(registry, "TRAINS", registry.TRAINS)
    exec(compile(program, "my_femgear.py", "exec"), {"__name__": "my_femgear"})
    lines = re.findall(r"(?m)^python my_femgear.py (.*)$", text)
    said = []
    for line in lines:
        capsys.readouterr()
        assert cli.main(shlex.split(line)) == 0
        said.append(capsys.readouterr().out)
    assert printed in re.sub(r" +\n", "\n", said[1]) and '"Discs"' in said[2]
    assert {path.name for path in (tmp_path / "out" / "discs").iterdir()} >= set(
        re.findall(r"`([\w.]+)`", re.findall(r"(?s)The run writes (.*?), and prints", text)[0])
    )
    results = open_results("out/discs")
    # J1 = J2/3: sqrt(4 k/(3 J1)) / 2 pi
    assert float(results.modes["frequency"]) == pytest.approx((4 * 15e3 / 0.06) ** 0.5 / (2 * np.pi))
    assert cli.main(["check", "discs.toml"]) == 0
    (tmp_path / "discs.toml").write_text(case.replace("kN m/rad", "kN m"), encoding="utf-8")
    assert cli.main(["check", "discs.toml"]) == 2
    assert "discs.toml:7" in capsys.readouterr().err
    sys.modules.pop("two_discs", None)
    # the package of the page, as installed
    ((group, entries),) = tomllib.loads(package)["project"]["entry-points"].items()
    (name, module) = next(iter(entries.items()))
    (entry,) = EntryPoints([EntryPoint(name, module, group)]).select(group="femgear.trains")
    monkeypatch.setattr(registry, "TRAINS", registry.TRAINS[1:])
    monkeypatch.setattr("importlib.metadata.entry_points", lambda group: [entry])
    registry._installed.cache_clear()
    (tmp_path / "discs.toml").write_text(case, encoding="utf-8")
    assert cli.main(["check", "discs.toml"]) == 0
    registry._installed.cache_clear()
    sys.modules.pop("two_discs", None)


def sentences(text: str) -> list[int]:
    """Words of every sentence of a page; tables, programs, headings and captions are none."""
    text = re.sub(r"(?ms)^```.*?^```", "", text)
    text = re.sub(r"(?m)^(#|\s*\||!|<|:::| {4}).*$", "\n", text)
    found = []
    for paragraph in re.split(r"\n\s*\n|\n(?=[*-] )", text):
        for sentence in re.split(r"(?<=[.:?!;])\s+(?=[^\W\d_a-z]|[`\[*])", " ".join(paragraph.split())):
            words = [word for word in sentence.split() if re.search(r"\w", word)]
            found += [len(words)] if words else []
    return found


@pytest.mark.parametrize("name", (*TUTORIAL, *HOW_TO))
def test_sentences_are_short(name):
    """25 words in the mean, of the pages that one reads from top to bottom."""
    counts = sentences(read_page(f"{name}.md")[0])
    assert sum(counts) <= 25 * len(counts), f"{sum(counts) / len(counts):.1f} words in a sentence"


def test_hardly_a_sentence_is_long():
    """More than 25 words in less than one of two hundred, over all pages that are written by hand."""
    made = {"errors", "gallery", "validation", "reliability"}
    pages = [page for page in sorted((ROOT / "docs").glob("*.md")) if page.stem not in made]
    counts = [count for page in pages for count in sentences(page.read_text(encoding="utf-8"))]
    assert len(counts) > 3000 and sum(count > 25 for count in counts) < len(counts) / 200


def test_every_page_with_programs_is_run():
    folder = ROOT / "docs"
    pages = {path.name for path in folder.glob("*.md") if "\n```python\n" in path.read_text(encoding="utf-8")}
    tests = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob("test_*.py"))
    own = {getattr(one, "values", (one,))[0] for one in PAGES}
    assert pages == set(re.findall(r'read_page\("(\w+\.md)"\)', tests)) | {f"{name}.md" for name in own}
