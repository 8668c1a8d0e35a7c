"""Runs of the reference case that write synthetic results, and a narrow terminal, for tests of commands."""

import importlib.util
from pathlib import Path

from edited_manifests import finish
from rich.console import Console

from femgear.storage.files import write_dataset, write_text
from femgear.trains.reading import open_results, parse_case, with_value

CASE = Path(__file__).parents[1] / "cases" / "planetary_27_40_108.toml"
TEXT = CASE.read_text(encoding="utf-8")
STAGES = ("static", "stress", "modes", "runup", "dynamics", "housing")


def synthetic():
    spec = importlib.util.spec_from_file_location("synthetic", Path(__file__).with_name("synthetic_results.py"))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def edited(*changes: tuple[str, object]) -> str:
    """Text of the reference case with some entries changed; None leaves an entry out."""
    case = parse_case(TEXT)
    for key, value in changes:
        case = with_value(case, key, value)
    return case.source


def fake_run(case, out, *, only=None, pictures=True, progress=None, computed=None):
    """Write synthetic results as the pipeline would."""
    data = synthetic()
    names = ["case.toml"]
    write_text(case.source, out / "case.toml")
    for step, stage in enumerate(STAGES):
        progress(stage, step + 1, len(STAGES))
        dataset = getattr(data, stage)()
        for name in dataset.coords:
            dataset[name].attrs.setdefault("units", "1")
            dataset[name].attrs.setdefault("long_name", str(name))
        write_dataset(dataset, out / f"{stage}.nc")
        names.append(f"{stage}.nc")
        if stage == only:
            break
    finish(out, names, timings={"static": 0.25}, convergence={})
    computed(open_results(out))


def interrupted_run(*_, **__):
    raise KeyboardInterrupt


class Narrow(Console):
    """A terminal of 80 columns."""

    def __init__(self, **options):
        super().__init__(width=80, force_terminal=True, **options)
