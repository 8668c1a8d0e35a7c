#!/usr/bin/env python3
"""Mutation testing of the core: change one expression of a module, and see whether a test notices.

A seed draws mutants of every module, a third of them changed signs. A map of which test runs which line is
made once and kept; each mutant meets the tests that run its line, those of its own folder first, within a
budget of CPU time. Nothing in the tree is changed: the module is compiled in memory, in a forked process with
temporary folders of its own. A campaign that was stopped goes on where it was; survivors are tried again as
soon as the tests of their folder change. ::

    python validation/tools/mutation.py --modules fe system/fourier.py --count 20 --report out/mutants/report.md

Mutants known to change nothing stand with their reason in ``equivalent_mutants.txt`` beside this file. Why no
published tool does this: mutmut leaves no choice of operators and copies the tree, cosmic-ray writes the
mutant into the file and starts a process for it, mutatest is not kept up.
"""

from __future__ import annotations

import argparse
import ast
import contextlib
import gc
import hashlib
import importlib.abc
import importlib.machinery
import importlib.util
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from mutants import CORE, ROOT, Mutant, drawn, modules, mutants, mutated

EQUIVALENT = Path(__file__).with_name("equivalent_mutants.txt")
# imported before the first fork, so that no mutant pays for them
LIBRARIES = (
    "numpy scipy.linalg scipy.sparse.linalg scipy.optimize scipy.integrate scipy.interpolate scipy.signal "
    "scipy.special scipy.spatial scipy.stats scipy.ndimage scipy.fft scipy.io pydantic pint xarray h5netcdf "
    "h5py pandas matplotlib.pyplot skfem meshio gmsh daqp cyclopts rich.console threadpoolctl hypothesis "
    "imageio pyvista pytest _pytest.assertion.rewrite coverage"
).split()
MEMORY = 8 << 30
# tests that killed most mutants of a module come first, so many of them
PROVEN = 6
# seconds that any test may take, beside five times what it took; of a mutant by the clock on the wall
PATIENCE, WALL_LIMIT = 10.0, 900.0

# ---------------------------------------------------------------------------------- one forked process


class _Loader(importlib.machinery.SourceFileLoader):
    """Compile a tree, whatever the file holds."""

    def __init__(self, name: str, path: Path, tree: ast.Module):
        super().__init__(name, str(path))
        self.tree = tree

    def get_code(self, fullname):
        return compile(self.tree, self.path, "exec")


class Altered(importlib.abc.MetaPathFinder):
    """Import one module from a changed tree, the others of the package as they are."""

    def __init__(self, path: Path, tree: ast.Module):
        name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        self.name, self.path, self.tree = name.removesuffix(".__init__"), path, tree

    def find_spec(self, name, path=None, target=None):
        if name != self.name:
            return None
        loader = _Loader(name, self.path, self.tree)
        return importlib.util.spec_from_file_location(name, self.path, loader=loader)


class Watch:
    """A plugin of pytest: choose and order tests, stop at the budget, note failures and seconds."""

    def __init__(self, wanted: Sequence[str] | None, limits: dict[str, float], budget: float, context=None):
        self.order = None if wanted is None else {name: i for i, name in enumerate(wanted)}
        self.limits, self.budget, self.context = limits, budget, context
        self.killer, self.failed, self.ran, self.seconds = "", [], 0, defaultdict(float)
        self.start, self.running = cpu_seconds(), Path("running").absolute()

    def pytest_configure(self):
        import hypothesis

        # before the tests are imported, whose settings begin with these
        hypothesis.settings.register_profile("mutants", derandomize=True, database=None, deadline=None)
        hypothesis.settings.load_profile("mutants")

    def pytest_sessionstart(self, session):
        self.session = session

    # fixtures of a whole file reorder after this
    @pytest.hookimpl(tryfirst=True)
    def pytest_collection_modifyitems(self, items):
        if (order := self.order) is not None:
            items[:] = sorted((item for item in items if item.nodeid in order), key=lambda item: order[item.nodeid])

    def pytest_runtest_protocol(self, item):
        if self.order is not None:
            self.running.write_text(item.nodeid)
            # ended by the system, even within compiled code
            signal.setitimer(signal.ITIMER_PROF, PATIENCE + 5.0 * self.limits.get(item.nodeid, self.budget))

    def pytest_runtest_logstart(self, nodeid):
        self._begin = cpu_seconds()
        if self.context:
            self.context(f"{nodeid}|setup")

    @pytest.hookimpl(tryfirst=True)
    def pytest_pyfunc_call(self, pyfuncitem):
        if self.context:
            self.context(f"{pyfuncitem.nodeid}|call")

    def pytest_runtest_logreport(self, report):
        if report.when == "call":
            self.ran += 1
        if report.failed:
            self.failed.append(report.nodeid)
            self.killer = self.killer or report.nodeid

    def pytest_runtest_logfinish(self, nodeid):
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        self.seconds[nodeid] += cpu_seconds() - self._begin
        if self.context:
            self.context("")

    def pytest_collectreport(self, report):
        if report.failed:
            self.failed.append(report.nodeid)
            self.killer = self.killer or f"{report.nodeid} (import)"

    def pytest_runtest_teardown(self):
        if self.order is not None and cpu_seconds() - self.start > self.budget:
            self.session.shouldstop = "the budget is used"


def cpu_seconds() -> float:
    """Seconds of a processor that this process and its children have used."""
    used = os.times()
    return used.user + used.system + used.children_user + used.children_system


def preload() -> None:
    """Import the libraries, so that forked processes have them."""
    for name in LIBRARIES:
        with contextlib.suppress(ImportError):
            importlib.import_module(name)
    gc.collect()
    gc.freeze()


def forked(work, folder: Path) -> int:
    """Process number of a fork that does `work(folder)`, alone in it, and writes there what that returns."""
    folder.mkdir(parents=True)
    child = os.fork()
    if child:
        return child
    code = 70
    try:
        os.setsid()
        _settle(folder)
        result = work(folder)
        (folder / "result.json").write_text(json.dumps(result))
        code = 0
    except BaseException as error:
        # the parent reads it, whatever it was
        (folder / "error.txt").write_text(f"{type(error).__name__}: {error}")
    finally:
        os._exit(code)


def _settle(folder: Path) -> None:
    """Give a forked process its own folders, limits and output."""
    sys.dont_write_bytecode = True
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    for name, below in (("TMPDIR", "tmp"), ("HOME", "home"), ("XDG_CACHE_HOME", "cache")):
        os.environ[name] = str(folder / below)
        (folder / below).mkdir()
    tempfile.tempdir = None
    os.environ |= {"FEMGEAR_MESHES": str(folder / "meshes"), "PYTHONDONTWRITEBYTECODE": "1"}
    os.environ["HYPOTHESIS_STORAGE_DIRECTORY"] = str(folder / "hypothesis")
    (folder / "cwd").mkdir()
    os.chdir(folder / "cwd")
    # grids of the repository, and cases that tests name relative to it
    for source, copy in ((ROOT / "meshes", folder / "meshes"), (ROOT / "cases", Path("cases"))):
        if source.exists():
            shutil.copytree(source, copy)
    output = os.open(folder / "output.txt", os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    os.dup2(output, 1)
    os.dup2(output, 2)


def _pytest(folder: Path, files: Sequence[str], watch: Watch, *options: str) -> int:
    fixed = f"-q -p no:cacheprovider -p no:xdist -p no:pytest_cov --benchmark-disable --rootdir={ROOT} -c"
    options = (*fixed.split(), str(ROOT / "pyproject.toml"), f"--basetemp={folder / 'pytest'}", *options)
    return int(pytest.main([*options, *(str(ROOT / name) for name in files)], plugins=[watch]))


# ------------------------------------------------------------------------------ which test runs which line


def _digest(*paths: Path) -> str:
    total = hashlib.sha256()
    for path in paths:
        total.update(path.read_bytes())
    return total.hexdigest()[:16]


class LineMap:
    """Which tests run a line of the package, and how many seconds they take; one file of data a test file."""

    def __init__(self, folder: Path, tests: Sequence[str]):
        self.folder = folder
        self.package = _digest(*sorted((ROOT / "femgear").rglob("*.py")))
        paths = (path for name in tests for path in sorted((ROOT / name).rglob("test_*.py")) or [ROOT / name])
        self.files = list(dict.fromkeys(str(path.relative_to(ROOT)) for path in paths))
        self.digests = {name: _digest(ROOT / name) for name in self.files}
        self.seconds: dict[str, float] = {}
        self._lines: dict[str, dict[int, list[str]]] = {}

    def path(self, name: str) -> Path:
        return self.folder / f"{name.replace('/', '.')}-{self.package}-{self.digests[name]}.coverage"

    def make(self, jobs: int, folder: Path) -> None:
        """Run the test files that are not mapped yet, each in a forked process."""
        self.folder.mkdir(parents=True, exist_ok=True)
        missing = [name for name in self.files if not self.path(name).with_suffix(".json").exists()]
        work = [(name, lambda place, name=name: self._one(name, place)) for name in missing]
        for name, result, _ in run_all(work, jobs, folder):
            if "result" not in result:
                raise SystemExit(f"mapping {name} failed: {result}")
            for old in self.folder.glob(f"{name.replace('/', '.')}-*"):
                if not old.name.startswith(self.path(name).stem):
                    old.unlink()
            self.path(name).with_suffix(".json").write_text(json.dumps(result["result"]))
            failed = result["result"]["failed"]
            print(f"mapped {name}" + (f": FAILED {', '.join(failed)}" if failed else ""), flush=True)

    def _one(self, name: str, folder: Path) -> dict:
        import coverage

        cover = coverage.Coverage(
            data_file=str(self.path(name)), include=[str(ROOT / "femgear" / "*")], config_file=False
        )
        cover.start()
        watch = Watch(None, {}, 0.0, cover.switch_context)
        _pytest(folder, [name], watch)
        cover.stop()
        cover.save()
        return {"seconds": watch.seconds, "failed": watch.failed}

    def load(self) -> None:
        """Read seconds of all tests; a test that failed while it was mapped kills nothing."""
        for name in self.files:
            entry = json.loads(self.path(name).with_suffix(".json").read_text())
            self.seconds |= {test: time for test, time in entry["seconds"].items() if test not in entry["failed"]}

    def covering(self, module: str, lines: tuple[int, int]) -> list[str]:
        """Tests that run a line of a module: in their call, in a fixture of their file or in its import."""
        if module not in self._lines:
            self._lines[module] = self._read(ROOT / "femgear" / module)
        table = self._lines[module]
        names = {name for line in range(lines[0], lines[1] + 1) for name in table.get(line, ())}
        tests = {name.removesuffix("|call") for name in names if name.endswith("|call")}
        shared = {name.split("::")[0] for name in names if not name.endswith("|call")}
        tests |= {name for name in self.seconds if name.split("::")[0] in shared}
        return sorted(tests & self.seconds.keys())

    def _read(self, path: Path) -> dict[int, list[str]]:
        import coverage

        table = defaultdict(list)
        for name in self.files:
            data = coverage.CoverageData(str(self.path(name)))
            data.read()
            for line, contexts in data.contexts_by_lineno(str(path)).items():
                table[line] += [context or f"{name}::" for context in contexts]
        return table

    def planned(
        self, module: str, covering: Sequence[str], budget: float, killers: Counter[str]
    ) -> Iterator[list[str]]:
        """Tests in the order in which a mutant meets them, a file at a time: its fixtures are made once.

        Of those that run the line first the ones that killed most in this module; then those of its folder
        and those elsewhere, as far as half of the budget and the whole of it go; then the others of the same
        files, which may share what was computed once.
        """
        mirror, stem = "tests/" + str(Path(module).parent) + "/", Path(module).stem
        near = [test for test in covering if test.startswith(mirror)]
        likeliest = [test for test, _ in killers.most_common() if test in covering][:PROVEN]
        yield self._ordered(self._within(likeliest, 0.3 * budget), stem)
        first = self._within(near, 0.5 * budget)
        yield self._ordered(first, stem)
        yield self._ordered(self._within(set(covering) - set(near), budget), stem)
        files = {test.split("::")[0] for test in near}
        others = [test for test in self.seconds if test.split("::")[0] in files]
        yield self._ordered(sorted(set(others) - set(first)), stem)

    def _within(self, tests, budget: float) -> list[str]:
        """Tests of the fewest seconds, one of each function before the others with other parameters."""
        seen, ranked = set(), []
        for test in sorted(tests, key=lambda test: (self.seconds[test], test)):
            name = test.split("[")[0]
            ranked.append((name in seen, self.seconds[test], test))
            seen.add(name)
        killed = []
        for _, seconds, test in sorted(ranked):
            budget -= seconds
            if budget < 0 and killed:
                break
            killed.append(test)
        return killed

    def _ordered(self, tests: Sequence[str], stem: str) -> list[str]:
        files = defaultdict(list)
        for test in sorted(tests, key=lambda test: (self.seconds[test], test)):
            files[test.split("::")[0]].append(test)
        cost = {name: sum(self.seconds[test] for test in covering_tests) for name, covering_tests in files.items()}
        names = sorted(files, key=lambda name: (stem not in name, cost[name]))
        return [test for name in names for test in files[name]]


# ------------------------------------------------------------------------------------------- the campaign


def run_all(work, jobs: int, folder: Path) -> Iterator[tuple[Any, dict, float]]:
    """Do the work in forked processes, `jobs` at a time: what it was, its result, the CPU seconds used."""
    running, pending = {}, list(reversed(list(work)))
    try:
        while pending or running:
            while pending and len(running) < jobs:
                what, task = pending.pop()
                place = folder / f"{len(pending)}"
                running[forked(task, place)] = (what, place, time.monotonic())
            for child in list(running):
                what, place, begin = running[child]
                ended, status, usage = os.wait4(child, os.WNOHANG)
                late = time.monotonic() - begin > WALL_LIMIT
                if ended or late:
                    del running[child]
                    _end_group(child)
                    if not ended:
                        _, status, usage = os.wait4(child, 0)
                    yield what, _outcome(place, status, late), usage.ru_utime + usage.ru_stime
                    shutil.rmtree(place, ignore_errors=True)
            time.sleep(0.02)
    finally:
        for child in running:
            _end_group(child)
            os.waitpid(child, 0)


def _end_group(child: int) -> None:
    """End what a forked process started: it has a session of its own."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)


def _outcome(place: Path, status: int, late: bool) -> dict:
    if late or (os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGPROF):
        running = place / "cwd" / "running"
        return {"timeout": running.read_text() if running.exists() else ""}
    if (place / "result.json").exists():
        return {"result": json.loads((place / "result.json").read_text())}
    error = place / "error.txt"
    return {"crash": error.read_text() if error.exists() else f"status {status}"}


def meet(
    mutant: Mutant,
    lines: LineMap,
    covering: Sequence[str],
    budget: float,
    killers: Counter[str],
    folder: Path,
) -> dict:
    """Run one mutant in this process against its tests."""
    path = ROOT / "femgear" / mutant.module
    sys.meta_path.insert(0, Altered(path, mutated(path.read_text(encoding="utf-8"), mutant.number)))
    start, ran = cpu_seconds(), 0
    for tests in lines.planned(mutant.module, covering, budget, killers):
        left = budget - (cpu_seconds() - start)
        if tests and left > 0:
            watch = Watch(tests, lines.seconds, left)
            files = list(dict.fromkeys(test.split("::")[0] for test in tests))
            _pytest(folder, files, watch, "-x")
            ran += watch.ran
            if watch.killer:
                return {"killer": watch.killer, "ran": ran}
    return {"killer": "", "ran": ran}


class Campaign:
    """Results of mutants by the digest of their file, one line of JSON each: the last one counts."""

    def __init__(self, path: Path, lines: LineMap, reasons: dict):
        self.path, self.lines, self.outcomes, self.reasons = path, lines, {}, reasons
        self.killers: dict[str, Counter[str]] = defaultdict(Counter)
        if path.exists():
            for line in path.read_text(encoding="utf-8").splitlines():
                # a campaign that was stopped may have left half a line
                with contextlib.suppress(ValueError, KeyError):
                    entry = json.loads(line)
                    self.outcomes[entry["file"], entry["number"]] = entry
                    self.killers[entry["place"].split(":")[0]].update([entry.get("killer", "")])

    def state(self, mutant: Mutant, covering: Sequence[str]) -> str:
        """Digest of the tests in the mutant's folder that run its line: new ones try a survivor again."""
        mirror = "tests/" + str(Path(mutant.module).parent) + "/"
        files = sorted({test.split("::")[0] for test in covering})
        text = " ".join(self.lines.digests[name] for name in files if name.startswith(mirror))
        return hashlib.sha256(f"{text} {len(covering)}".encode()).hexdigest()[:16]

    def run(self, chosen: Sequence[Mutant], jobs: int, budget: float, folder: Path) -> dict[Mutant, dict]:
        """Meet mutants without a result, and those that survived fewer or older tests for no known reason."""
        files = {mutant.module: _digest(ROOT / "femgear" / mutant.module) for mutant in chosen}
        results, work = {}, []
        for mutant in chosen:
            covering = self.lines.covering(mutant.module, mutant.lines)
            key = {"file": files[mutant.module], "number": mutant.number, "tests": self.state(mutant, covering)}
            key |= {"covering": len(covering), "budget": budget}
            outcome = self.outcomes.get((key["file"], key["number"]))
            same = outcome and outcome["tests"] == key["tests"] and outcome.get("budget", 0.0) >= budget
            settled = outcome and (outcome["outcome"] != "survived" or same)
            if settled or (outcome and mutant.name in self.reasons):
                results[mutant] = outcome
            elif not covering:
                results[mutant] = key | {"outcome": "survived", "ran": 0, "seconds": 0.0}
            else:

                def task(place, mutant=mutant, covering=covering):
                    return meet(mutant, self.lines, covering, budget, self.killers[mutant.module], place)

                work.append(((mutant, key), task))
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with self.path.open("a", encoding="utf-8") as stream:
            for (mutant, key), result, seconds in run_all(work, jobs, folder):
                entry = key | _verdict(result) | {"seconds": round(seconds, 2)}
                entry |= {"place": mutant.place, "kind": mutant.kind, "change": mutant.change}
                results[mutant] = entry
                self.killers[mutant.module].update([entry.get("killer", "")])
                stream.write(json.dumps(entry) + "\n")
                stream.flush()
                by = entry.get("killer", f"{entry['ran']} of {entry['covering']} tests")
                print(
                    f"{mutant.place} {mutant.kind}: {mutant.change}: {entry['outcome']} ({by}) {seconds:.1f} s",
                    flush=True,
                )
        return {mutant: results[mutant] for mutant in chosen}


def _verdict(result: dict) -> dict:
    if "timeout" in result:
        return {"outcome": "timeout", "ran": 0, "killer": f"time limit: {result['timeout']}"}
    if "crash" in result:
        return {"outcome": "killed", "ran": 0, "killer": f"crash: {result['crash']}"}
    record = result["result"]
    if record["killer"]:
        return {"outcome": "killed", **record}
    return {"outcome": "survived", "ran": record["ran"]}


# --------------------------------------------------------------------------------------------- the report


def equivalents(path: Path = EQUIVALENT) -> dict[tuple[str, str, str, str], str]:
    """Reasons of the mutants that change nothing, by module, function, expression and replacement."""
    reasons = {}
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        if line.strip() and not line.startswith("#"):
            words = [word.strip() for word in line.split(" ;; ")]
            if len(words) != 5:
                raise SystemExit(f"{path.name}:{number}: module ;; function ;; before ;; after ;; reason")
            reasons[tuple(words[:4])] = words[4]
    return reasons


def _commit() -> str:
    """Name the commit of the tree, empty outside of git."""
    words = ("git", "rev-parse", "--short", "HEAD")
    return subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False).stdout.strip()


def report(results: dict[Mutant, dict], reasons: dict, seed: int) -> tuple[str, bool]:
    """A page of scores by module, survivors and equivalents; and whether the aims are met."""

    def reason(mutant: Mutant) -> str:
        return reasons.get(mutant.name, "")

    def row(name: str, ones: Sequence[Mutant]) -> str:
        same = [mutant for mutant in ones if results[mutant]["outcome"] == "survived" and reason(mutant)]
        real = [mutant for mutant in ones if mutant not in same]
        dead = [mutant for mutant in real if results[mutant]["outcome"] != "survived"]
        late = sum(results[mutant]["outcome"] == "timeout" for mutant in ones)
        signs = [sum(mutant.kind == "sign" for mutant in group) for group in (dead, real)]
        score = f"{100 * len(dead) / len(real):.0f} %" if real else ""
        left = len(real) - len(dead)
        cells = (name, len(ones), len(dead), late, len(same), left, score, f"{signs[0]}/{signs[1]}")
        scores[name] = (len(dead), len(real), signs[0] == signs[1])
        return "| " + " | ".join(map(str, cells)) + " |"

    scores = {}
    by_module = defaultdict(list)
    for mutant in results:
        by_module[mutant.module].append(mutant)
    head = "module | mutants | killed | by time limit | equivalent | survived | score | sign flips killed"
    page = [
        "# Mutants",
        "",
        f"Single expressions of the core are changed, one at a time: commit {_commit()}, seed {seed}.",
        "Score: killed of those that are not equivalent; the time limit kills too.",
        "",
    ]
    page += [f"| {head} |", "|" + "---|" * 8]
    page += [row(name, ones) for name, ones in sorted(by_module.items())]
    page += [row("**all**", list(results)), "", "## Survivors", ""]
    left = [mutant for mutant in results if results[mutant]["outcome"] == "survived" and not reason(mutant)]
    for mutant in sorted(left, key=lambda mutant: (mutant.kind != "sign", mutant.module, mutant.line)):
        entry = results[mutant]
        ran = f"{entry['ran']} tests pass, {entry['covering']} run the line, {entry['seconds']:.0f} s"
        why = ran if entry["covering"] else "no test runs the line"
        page.append(
            f"* {mutant.place} {mutant.kind} in `{mutant.function}`: `{mutant.before}` -> `{mutant.after}`: {why}"
        )
    page += ["" if left else "None.", "## Equivalent", ""]
    for mutant in results:
        if results[mutant]["outcome"] == "survived" and reason(mutant):
            page.append(f"* {mutant.place} `{mutant.before}` -> `{mutant.after}`: {reason(mutant)}")
    spent = [entry["seconds"] for entry in results.values()]
    page += ["", f"{sum(spent) / max(len(spent), 1):.1f} s of CPU time a mutant.", ""]
    dead, real, signs = scores["**all**"]
    return "\n".join(page), dead >= 0.95 * real and signs


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--modules", nargs="+", default=CORE, help="files or folders below femgear/")
    parser.add_argument("--count", type=int, default=15, help="mutants a module")
    parser.add_argument("--kinds", nargs="+", help="only these, such as sign, factor, constant")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2, help="processes at a time")
    parser.add_argument("--budget", type=float, default=20.0, help="CPU seconds of tests a mutant")
    parser.add_argument("--tests", nargs="+", default=["tests"], help="files or folders that may kill")
    parser.add_argument("--work", type=Path, default=ROOT / "out" / "mutants", help="map of lines, results")
    parser.add_argument("--report", type=Path, help="page to write; out/mutants/report.md if not given")
    given = parser.parse_args(arguments)
    chosen = []
    for module in modules(given.modules):
        source = (ROOT / "femgear" / module).read_text(encoding="utf-8")
        drawn_mutants = [mutant for mutant in mutants(module, source) if not given.kinds or mutant.kind in given.kinds]
        chosen += drawn(drawn_mutants, given.count, given.seed)
    sys.path.insert(0, str(ROOT))
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # and end the processes started here
    preload()
    lines = LineMap(given.work / "lines", given.tests)
    with tempfile.TemporaryDirectory(prefix="femgear-mutants-") as folder:
        lines.make(given.jobs, Path(folder) / "map")
        lines.load()
        reasons = equivalents()
        campaign = Campaign(given.work / "results.jsonl", lines, reasons)
        results = campaign.run(chosen, given.jobs, given.budget, Path(folder) / "mutants")
    page, good = report(results, reasons, given.seed)
    path = given.report or given.work / "report.md"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(page, encoding="utf-8")
    print(page)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
