#!/usr/bin/env python3
"""Run all cases and scripts with two checkouts, and compare all that they write and print.

For changes of the code that change no result. Before the first one, compute and keep the outputs of its base;
then, as often as wanted, run the changed code and compare (the outputs of the base are not computed again)::

    python validation/tools/compare_outputs.py --base-ref main --output out/compare --base-only
    python validation/tools/compare_outputs.py --base-ref main --output out/compare [--only nrel_pga drivetrain.py]

Every case is checked and run by the command line, every script with the arguments of ``SCRIPTS``; each with
the code of its own checkout and a folder of grids of its own, so that the grids are compared, too. Numbers of
NetCDF, VTK and grid files may differ by the tolerance times the largest magnitude of their variable, printed
ones by the tolerance times themselves; all else must be equal, but for what ``MASKS`` lists. Pictures must
exist; whether their pixels are equal is information. Exit status 1: something differs, is missing or failed.
"""

from __future__ import annotations

import argparse
import csv
import hashlib
import io
import json
import math
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager, nullcontext
from dataclasses import asdict, dataclass, field
from difflib import SequenceMatcher
from functools import cache
from importlib import metadata
from itertools import zip_longest
from pathlib import Path

import numpy as np

CLI = ("-m", "femgear.cli")
# "tree" is a link to the checkout, beside the folder in which a case or script runs
REFERENCE = "../tree/cases/planetary_27_40_108.toml"
TIP = "planet.tip_diameter=62.2 mm..63.4 mm +- 0.1 mm"
COARSE = ("--positions", "8", "--flank-elements", "8")
# arguments of every command of a script; a script that is not listed runs once, without arguments
SCRIPTS = {
    "drivetrain.py": (("--balanced",), ("../tree/cases/own_chain.toml", "--duration", "0.2 s")),
    "gravity_wedging.py": (
        (),
        ("--backlash", "482 um", "--harmonics", "3", "--no-stability", "--sweep", "2", "--steps", "200"),
    ),
    "housing_modulation.py": ((), ("--speed", "3100 rpm", "--harmonic", "5")),
    "readme_images.py": (("docs", "--only", "published_four_stages"),),
}
OTHERS = {
    "schema": ((*CLI, "schema"), (*CLI, "schema", "--model", "gearbox")),
    "optimise": (
        (*CLI, "optimise", REFERENCE, *COARSE, "--of", "ste overall", "-o", "results_1"),
        (
            *(*CLI, "optimise", REFERENCE, "--vary", TIP, "--goal", "contact ratio sun-planet", "-o", "results_2"),
            *("--second", "tip thickness planet", "--of", "contact ratio planet-ring", "--no-check"),
            *("--max-designs", "60"),
        ),
    ),
    "relief": ((*CLI, "relief", REFERENCE, "-o", "results"),),
    "harris": ((*CLI, "harris", REFERENCE, "-o", "results"),),
    "sweep": ((*CLI, "sweep", REFERENCE, "--over", "operation.torque=50 N m,100 N m", "-o", "results"),),
    "validate": (("../tree/validation", "--quick", "-o", "validation.md"),),
}
PICTURES, DATA = (".png",), (".vtu", ".vtp", ".msh")
VERSION_ATTRIBUTES = {"femgear_version"}
TIMED_OUT = -999
WORST = 10


@dataclass(frozen=True)
class Mask:
    """Replaces ``part`` by ``by`` wherever it occurs within ``where``."""

    where: str
    part: str
    by: str


MASKS = {
    "run times, terminal": Mask(r"(?m)^Time\n(?:[ ─].*\n|\n(?= ))+", r"\s+|─+|\d+\.\d+", " "),
    "run times, manifest": Mask(r'"timings": \{[^}]*\}', r"[\d.e+-]+(?=[,\n])", "0"),
    "run times, report": Mask(r"(?s)<caption>Time</caption>.*?</table>", r"<td>[\d.]+</td>", "<td></td>"),
    "run times, journal": Mask(r'"seconds": [\d.e+-]+', r"[\d.e+-]+$", "0"),
    "run times, search": Mask(r"computed now \([\d.e+-]+ s each\)", r"\([\d.e+-]+", "("),
    "run times, pin errors": Mask(r"(?:curves|samples)\s+\d+\.\d\d\s+s\b", r"\d+\.\d\d", ""),
    "versions, manifest": Mask(r'"versions": \{[^}]*\}', r': "[^"]*"', ': ""'),
    "versions, report": Mask(r"(?s)<h3>Versions</h3>.*?</table>", r"<td>[\w.+]*\d</td>", "<td></td>"),
    "checksums, journal": Mask(r', "checksum": "[0-9a-f]{16}"\}', r'"[0-9a-f]{16}"', '""'),
    # of files that are compared themselves
    "checksums, list": Mask(r"(?m)^[0-9a-f]{64}  \S+$", r"^[0-9a-f]{64}", ""),
    "version, journal": Mask(r'"femgear": "[\w.+]+"', r"[\w.+]+(?=\"$)", ""),
    # of files that are compared themselves, and that hold run times
    "checksums, manifest": Mask(r'"files": \{[^}]*\}', r"\b[0-9a-f]{64}\b", ""),
    "checksum of the manifest": Mask(r'(?m)^ "checksum": "[0-9a-f]{64}"$', r"[0-9a-f]{64}", ""),
    "checksums, report": Mask(r"(?s)<h3>Files</h3>.*?</table>", r"\b[0-9a-f]{64}\b", ""),
    "pictures, report": Mask(r'src="data:[^"]*"', r"base64,[^\"]*", ""),
    "place of a warning in the code": Mask(r"\(\w*Warning, [^()]*:\d+\)", r", .*:\d+", ""),
}
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


@dataclass(frozen=True)
class Side:
    """A checkout, what it is, and where its outputs are."""

    name: str
    tree: Path
    folder: Path
    commit: str


@dataclass(frozen=True)
class Run:
    """How the commands of a case or script ended; written last, so that what has none was interrupted."""

    commit: str
    libraries: str
    commands: list[list[str]]
    paths: list[str]
    codes: list[int]
    seconds: float
    sizes: dict[str, int]


@dataclass
class Tally:
    """What a comparison found; an item is a variable, an attribute, a column, an entry or a line."""

    tolerance: float
    files: int = 0
    variables: int = 0
    identical: int = 0
    within: int = 0
    different: list[tuple[float, str]] = field(default_factory=list)
    pictures: int = 0
    equal_pictures: int = 0

    def add(self, where: str, size: float | None) -> None:
        """Count an item by the size of its difference, None where there is none."""
        if size is None:
            self.identical += 1
        elif size <= self.tolerance:
            self.within += 1
        else:
            self.different.append((size, where))


def text_size(base: str | None, new: str | None) -> float | None:
    """Largest relative difference of the numbers in two texts, infinite where more differs than numbers."""
    if base == new:
        return None
    if base is None or new is None or NUMBER.split(base) != NUMBER.split(new):
        return math.inf
    pairs = [(float(x), float(y)) for x, y in zip(NUMBER.findall(base), NUMBER.findall(new)) if x != y]
    return max((abs(x - y) / max(abs(x), abs(y)) for x, y in pairs if x != y), default=math.inf)


def array_size(base: np.ndarray, new: np.ndarray) -> float | None:
    """Largest difference of two arrays over the largest magnitude; None where they are equal bit for bit."""
    base, new = np.asarray(base), np.asarray(new)
    if base.dtype != new.dtype or base.shape != new.shape:
        return math.inf
    if base.dtype.kind not in "fciub":
        return None if np.array_equal(base, new) else math.inf
    if base.tobytes() == new.tobytes():
        return None
    finite = np.isfinite(base)
    if not np.array_equal(base[~finite], new[~finite], equal_nan=True):
        return math.inf
    kind = complex if base.dtype.kind == "c" else float
    base, new = base[finite].astype(kind), new[finite].astype(kind)
    scale = max(np.abs(base).max(initial=0.0), np.abs(new).max(initial=0.0)) or 1.0
    return float(np.nan_to_num(np.abs(new - base), nan=math.inf).max(initial=0.0) / scale)


def attribute_sizes(name: str, base: dict, new: dict) -> Iterator[tuple[str, float | None]]:
    """Size of the difference of every attribute."""
    for key in sorted({*base, *new} - VERSION_ATTRIBUTES):
        if isinstance(base.get(key), str) and isinstance(new.get(key), str):
            yield f"{name}@{key}", text_size(base[key], new[key])
        else:
            yield f"{name}@{key}", array_size(base[key], new[key]) if key in base and key in new else math.inf


def netcdf_sizes(base: Path, new: Path) -> Iterator[tuple[str, float | None]]:
    """Size of the difference of every variable, coordinate and attribute."""
    import xarray as xr

    options = {"engine": "h5netcdf", "decode_cf": False}
    with xr.open_dataset(base, **options) as base_data, xr.open_dataset(new, **options) as other:
        yield "dimensions", None if dict(base_data.sizes) == dict(other.sizes) else math.inf
        yield from attribute_sizes("", base_data.attrs, other.attrs)
        for name in {**base_data.variables, **other.variables}:
            if name not in base_data.variables or name not in other.variables:
                yield name, math.inf
                continue
            u, v = base_data.variables[name], other.variables[name]
            yield name, array_size(u.values, v.values) if u.dims == v.dims else math.inf
            yield from attribute_sizes(name, u.attrs, v.attrs)


def grid_sizes(base: Path, new: Path) -> Iterator[tuple[str, float | None]]:
    """Size of the difference of points, cells and data of a grid."""
    import pyvista as pv

    texts = []
    for grid in (pv.read(base), pv.read(new)):
        names = ("points", "cells", "celltypes", "faces", "lines", "verts")
        arrays = {name: getattr(grid, name) for name in names if hasattr(grid, name)}
        for kind in ("point_data", "cell_data", "field_data"):
            arrays |= {f"{kind} {name}": array for name, array in getattr(grid, kind).items()}
        texts.append(arrays)
    base_text, other = texts
    for name in {**base_text, **other}:
        yield name, array_size(base_text[name], other[name]) if name in base_text and name in other else math.inf


def table_sizes(base: str, new: str) -> Iterator[tuple[str, float | None]]:
    """Size of the largest difference in every column of a CSV file."""
    base_columns, other = (list(zip_longest(*csv.reader(io.StringIO(text)))) for text in (base, new))
    for number, columns in enumerate(zip_longest(base_columns, other, fillvalue=())):
        cells = [text_size(*pair) for pair in zip_longest(*columns)]
        differing = [size for size in cells if size is not None]
        yield f"column {number + 1}, {(columns[0] or columns[1])[0]}", max(differing, default=None)


def line_sizes(base: str, new: str) -> Iterator[tuple[str, float | None]]:
    """Size of the difference of every line, lines that are new or gone put aside."""
    base_lines, other = base.splitlines(), new.splitlines()
    for _, i, j, k, l in SequenceMatcher(None, base_lines, other, autojunk=False).get_opcodes():
        for number, pair in enumerate(zip_longest(base_lines[i:j], other[k:l]), i + 1):
            yield f"line {number}: {pair[0]!r:.150} became {pair[1]!r:.150}", text_size(*pair)


def masked(path: Path, paths: list[str]) -> str:
    """Text of a file without what differs from run to run."""
    text = path.read_text(encoding="utf-8")
    for place in sorted(paths, key=len, reverse=True):  # one may begin like the other
        text = text.replace(place, f"<path {paths.index(place)}>")
    for mask in MASKS.values():
        text = re.sub(mask.where, lambda match, mask=mask: re.sub(mask.part, mask.by, match[0]), text)
    return text


def same_pixels(base: Path, new: Path) -> bool:
    """Whether all frames of two pictures are equal."""
    from PIL import Image, ImageSequence

    with Image.open(base) as base_image, Image.open(new) as other:
        frames = [[np.asarray(f.convert("RGBA")) for f in ImageSequence.Iterator(i)] for i in (base_image, other)]
    return len(frames[0]) == len(frames[1]) and all(map(np.array_equal, *frames))


def compare_file(base: Path, new: Path, name: str, paths: tuple[list[str], list[str]], tally: Tally) -> None:
    """Compare one file by its kind."""
    kind, equal = base.suffix, base.read_bytes() == new.read_bytes()
    if kind in PICTURES:
        tally.pictures += 1
        tally.equal_pictures += equal or same_pixels(base, new)
        return
    if kind == ".nc":
        sizes = netcdf_sizes(base, new)
    elif kind != ".csv" and equal:
        sizes = [("all", None)]
    elif kind in DATA:
        sizes = grid_sizes(base, new)
    else:
        texts = masked(base, paths[0]), masked(new, paths[1])
        sizes = table_sizes(*texts) if kind == ".csv" else line_sizes(*texts)
    for where, size in sizes:
        tally.variables += kind in (".nc", ".csv", *DATA) and "@" not in where
        tally.add(f"{name}, {where}", size)


def names_of(folder: Path) -> dict[str, int]:
    """Size of every file in a folder, by its path inside."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.stat().st_size for path in files}


def compare_folders(base: Path, new: Path, *, tolerance: float, paths: tuple[list[str], list[str]] = ((), ())) -> Tally:
    """Compare all files of two folders; ``paths`` are places of either side that are no difference."""
    tally, base_names, other = Tally(tolerance), names_of(base), names_of(new)
    for name in {**base_names, **other}:
        tally.files += 1
        if name not in base_names or name not in other:
            tally.add(f"{name} is missing in the {'base' if name in other else 'new'} outputs", math.inf)
            continue
        try:
            compare_file(base / name, new / name, name, paths, tally)
        except Exception as error:  # whatever a damaged file makes its reader raise
            tally.add(f"{name} cannot be compared: {type(error).__name__}: {error}", math.inf)
    return tally


def jobs_of(tree: Path) -> dict[str, list[list[str]]]:
    """Commands, as arguments of Python, of every case and script of a checkout, and of a few more."""
    jobs = {name: [list(command) for command in commands] for name, commands in OTHERS.items()}
    for path in sorted((tree / "cases").glob("*.toml")):
        case = f"../tree/cases/{path.name}"
        jobs[path.stem] = [[*CLI, "check", case], [*CLI, "run", case, "-o", "results", "--force"]]
    for path in sorted((tree / "scripts").glob("*.py")):
        if "__main__" in path.read_text(encoding="utf-8"):
            runs = enumerate(SCRIPTS.get(path.name, ((),)), 1)
            commands = [[f"../tree/scripts/{path.name}", *a, "--output", f"results_{n}"] for n, a in runs]
            jobs[path.name] = commands
    return jobs


def environment(side: Side, **more: str) -> dict[str, str]:
    """Variables with which the code of one side runs."""
    one_thread = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    return os.environ | one_thread | {"COLUMNS": "160", "PYTHONPATH": str(side.tree)} | more


@cache
def libraries() -> str:
    """Hash of the versions of Python and of everything that is installed."""
    installed = {f"{package.metadata['Name']} {package.version}" for package in metadata.distributions()}
    return hashlib.sha256("\n".join([sys.version, *sorted(installed)]).encode()).hexdigest()


def stored(side: Side, name: str) -> Run | None:
    """The run that left its outputs, None where it did not come to its end or a file is not of its size."""
    try:
        run = Run(**json.loads((side.folder / f"{name}.json").read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return None
    return run if run.sizes == names_of(side.folder / name) else None


def is_valid(run: Run | None, side: Side, commands: list[list[str]]) -> bool:
    """Whether stored outputs are those of this commit, these commands and libraries, without a failure."""
    if run is None or any(run.codes) or run.commit.endswith("changed"):
        return False
    return (run.commit, run.commands, run.libraries) == (side.commit, commands, libraries())


def compute(side: Side, name: str, commands: list[list[str]], *, time_limit: float) -> Run:
    """Run the commands of one job in an empty folder, with a cache of grids of its own."""
    folder, stamp = side.folder / name, side.folder / f"{name}.json"
    stamp.unlink(missing_ok=True)
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "grids").mkdir(parents=True)
    variables = environment(side, FEMGEAR_MESHES=str(folder / "grids"))
    codes, start = [], time.monotonic()
    for number, command in enumerate(commands, 1):
        outputs = [folder / f"command_{number}.{stream}.txt" for stream in ("stdout", "stderr")]
        with open(outputs[0], "wb") as out, open(outputs[1], "wb") as err:
            options = {"stdin": subprocess.DEVNULL, "stdout": out, "stderr": err, "timeout": time_limit}
            try:
                done = subprocess.run([sys.executable, *command], cwd=folder, env=variables, **options)
                codes.append(done.returncode)
            except subprocess.TimeoutExpired:
                codes.append(TIMED_OUT)
    seconds, paths = time.monotonic() - start, [str(side.folder), str(side.tree)]
    run = Run(side.commit, libraries(), commands, paths, codes, seconds, names_of(folder))
    unfinished = stamp.with_suffix(".unfinished")
    unfinished.write_text(json.dumps(asdict(run), indent=1), encoding="utf-8")
    unfinished.replace(stamp)
    print(f"{side.name:4s}  {name:28s} {seconds:6.1f} s  exit {' '.join(map(str, codes))}", flush=True)
    return run


def compute_all(
    pending: list[tuple[Side, str, list[list[str]]]],
    sides: tuple[Side, Side],
    *,
    workers: int,
    time_limit: float,
) -> None:
    """Run jobs beside one another, the longest ones first as far as their times are known."""

    def known(job: tuple[Side, str, list[list[str]]]) -> float:
        runs = [run for side in sides if (run := stored(side, job[1]))]
        return max((run.seconds for run in runs), default=0.0)

    with ThreadPoolExecutor(workers) as pool:
        ordered = sorted(pending, key=known, reverse=True)
        try:
            futures = [pool.submit(compute, *job, time_limit=time_limit) for job in ordered]
            for future in as_completed(futures):
                future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def git(tree: Path, *arguments: str) -> str:
    """What git prints."""
    done = subprocess.run(["git", "-C", str(tree), *arguments], check=True, capture_output=True, text=True)
    return done.stdout.strip()


@contextmanager
def checkout(reference: str, folder: Path, repository: Path) -> Iterator[Path]:
    """A temporary work tree of a commit."""
    if folder.exists():  # left by a comparison that was killed
        git(repository, "worktree", "remove", "--force", str(folder))
    git(repository, "worktree", "add", "--force", "--detach", str(folder), reference)
    try:
        yield folder
    finally:
        git(repository, "worktree", "remove", "--force", str(folder))


def side_of(name: str, tree: Path, output: Path) -> Side:
    """One side, its folder ready and its code found where it should be."""
    tree, folder = tree.resolve(), output.resolve() / name
    changed = " changed" if git(tree, "status", "--porcelain", "femgear", "cases", "scripts") else ""
    side = Side(name, tree, folder, git(tree, "rev-parse", "HEAD") + changed)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "tree").unlink(missing_ok=True)
    (folder / "tree").symlink_to(tree)
    command = [sys.executable, "-c", "import femgear; print(femgear.__file__)"]
    options = {"cwd": folder, "env": environment(side), "capture_output": True, "text": True}
    printed = subprocess.run(command, check=True, **options).stdout.strip()
    if not Path(printed).is_relative_to(tree):
        raise SystemExit(f"{name}: {printed} was imported, which is not in {tree}")
    return side


def report(sides: tuple[Side, Side], jobs: dict[str, list[bool]], tolerance: float) -> bool:
    """Print a table of all jobs and the worst differences; whether nothing differs and nothing failed.

    ``jobs`` says of every name whether either checkout has it.
    """
    print(f"\nbase {sides[0].commit}, new {sides[1].commit}, tolerance {tolerance:g}")
    heads = ("files", "variables", "identical", "within", "different", "pictures", "seconds", "exit")
    print(f"{'':26s}" + "".join(f"{head:>11s}" for head in heads))
    fine = True
    for name, has in jobs.items():
        base, new = (stored(side, name) if it_has else None for side, it_has in zip(sides, has))
        if base is None or new is None:
            fine = False
            missing = " and ".join(side.name for side, run in zip(sides, (base, new)) if run is None)
            print(f"{name:26s}  MISSING in {missing}")
            continue
        places = (base.paths, new.paths)
        tally = compare_folders(*(side.folder / name for side in sides), tolerance=tolerance, paths=places)
        codes = [" ".join(map(str, run.codes)) for run in (base, new)]
        cells = (
            *(tally.files, tally.variables, tally.identical, tally.within, len(tally.different)),
            f"{tally.equal_pictures} of {tally.pictures}",
            f"{base.seconds:.0f}, {new.seconds:.0f}",
            codes[0] if codes[0] == codes[1] else f"{codes[0]} became {codes[1]}",
        )
        print(f"{name:26s}" + "".join(f"{cell:>11}" for cell in cells))
        failed = any(base.codes + new.codes)
        if failed:
            alike = codes[0] == codes[1] and not tally.different
            print(f"    FAILED{' in both checkouts in the same way' if alike else ''}")
        for size, where in sorted(tally.different, key=lambda difference: -difference[0])[:WORST]:
            print(f"    {size:8.1e}  {where}")
        fine = fine and not tally.different and not failed
    print("pictures: how many have equal pixels, as information; inf: more than numbers differs")
    print("NOTHING DIFFERS" if fine else "DIFFERENCES OR FAILURES")
    return fine


def read_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    base = parser.add_mutually_exclusive_group(required=True)
    base.add_argument("--base", type=Path, help="checkout to compare with")
    base.add_argument("--base-ref", help="commit to compare with, checked out for the time of the comparison")
    here = Path(__file__).resolve().parents[2]
    parser.add_argument("--new", type=Path, default=here, help="changed checkout; that of this script")
    parser.add_argument("--output", type=Path, required=True, help="folder of the outputs, of the base kept")
    parser.add_argument("--only", nargs="+", default=[], metavar="NAME", help="as nrel_pga or campbell.py")
    parser.add_argument("--jobs", type=int, default=2, help="cases and scripts at a time")
    parser.add_argument("--tolerance", type=float, default=1e-12, help="relative difference allowed")
    parser.add_argument("--time-limit", type=float, default=1800.0, help="of one command, in seconds")
    parser.add_argument("--base-only", action="store_true", help="compute and keep the outputs of the base")
    parser.add_argument("--stored", action="store_true", help="compare what is stored, run nothing")
    return parser.parse_args()


def main() -> int:
    given = read_arguments()
    given.output.mkdir(parents=True, exist_ok=True)
    folder = given.output.resolve() / "checkout"
    tree = checkout(given.base_ref, folder, given.new) if given.base_ref else nullcontext(given.base)
    with tree as base_tree:
        sides = side_of("base", base_tree, given.output), side_of("new", given.new, given.output)
        jobs = [jobs_of(side.tree) for side in sides]
        names = [name for name in {**jobs[0], **jobs[1]} if not given.only or name in given.only]
        if unknown := set(given.only) - set(names):
            raise SystemExit(f"no case or script of the name {', '.join(sorted(unknown))}")
        base, new = (
            [(side, name, jobs_of_side[name]) for name in names if name in jobs_of_side]
            for side, jobs_of_side in zip(sides, jobs)
        )

        def invalid() -> list[tuple[Side, str, list[list[str]]]]:
            return [job for job in base if not is_valid(stored(sides[0], job[1]), sides[0], job[2])]

        if not given.stored:
            pending = invalid() + ([] if given.base_only else new)
            compute_all(pending, sides, workers=given.jobs, time_limit=given.time_limit)
        if given.base_only:
            return 1 if invalid() else 0
        both = {name: [name in jobs_of_side for jobs_of_side in jobs] for name in names}
        return 0 if report(sides, both, given.tolerance) else 1


if __name__ == "__main__":
    sys.exit(main())
