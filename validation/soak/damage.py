"""Damaged files: results, manifests, cases as run, journals, grids. The numbers are the same, or refused.

Every file is read in a process of its own, so that a crash of a reader is seen and counted.
"""

from __future__ import annotations

import contextlib
import faulthandler
import hashlib
import json
import os
import pickle
import random
import re
import resource
import select
import shutil
import signal
import sys
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from unittest import mock

import numpy as np
from edited_manifests import edit_manifest

from femgear.case.gear_set import planetary_set
from femgear.errors import FemgearError
from femgear.fe.meshing import mesh_outline
from femgear.gears.tooth import half_sector
from femgear.storage.files import checksum, read_dataset
from femgear.study.objectives import named_quantity
from femgear.study.sweep import sweep
from femgear.trains.reading import open_results, parse_case
from validation.soak.programs import case_texts, start, undisturbed, workspace
from validation.soak.trials import Outcome, place_in_package

PIECE = 300
# seconds after which a reader counts as hanging, memory that it may have [bytes]
_LIMIT = 30.0
_MEMORY = 4_000_000_000
_TARGETS = ("results",) * 4 + ("own checksums", "swapped files", "swapped files") + ("journal",) * 4 + ("grid",)


def trial(number: int, folder: Path) -> Outcome:
    """Damage one kind of file, read it in a process of its own, compare."""
    turn, kind = divmod(number, len(_TARGETS))
    rng = random.Random(f"damage {number}")
    place = folder / "damaged"
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir()
    target = _TARGETS[kind]
    if target == "grid" and turn % 5:
        target = "journal"  # grids are made anew, which takes a second
    words, read, expected = _MAKERS[target](rng, place, folder)
    said, values = in_process(read)
    failure = ""
    if said == "read" and target == "own checksums":
        said = "read, with its own checksum"
    elif said == "read":
        failure = _difference(values, expected)
        said = "other numbers" if failure else "the same numbers"
    elif not said.startswith("refused"):
        failure = str(values)
    if failure:
        failure = f"{target}, {words}: {failure}"
    elif target == "results" and turn % 10 == 0:
        failure = _program_refuses(rng, place, folder, words)
    return Outcome(f"{target}: {said}", failure)


def in_process(read: Callable[[], object]) -> tuple[str, object]:
    """Call a function in a forked process: ("read", value), ("refused CODE", ""), or how it went wrong."""
    source, sink = os.pipe()
    pid = os.fork()
    if pid == 0:
        os.close(source)
        try:
            with warnings.catch_warnings(), open(os.devnull, "w") as nothing:
                warnings.simplefilter("ignore")
                faulthandler.disable()
                os.dup2(nothing.fileno(), 2)
                resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
                answer = _called(read)
            data = pickle.dumps(answer)
            while data:
                data = data[os.write(sink, data) :]
        finally:
            os._exit(0)
    os.close(sink)
    data = b""
    with open(source, "rb", buffering=0) as stream:
        while select.select([stream], [], [], _LIMIT)[0]:
            more = stream.read(1 << 20)
            if not more:
                break
            data += more
        else:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)
            return "hangs", f"the reader did not end within {_LIMIT:g} s"
    code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    if code or not data:
        return "crashed", f"the reader ended with {code}"
    return pickle.loads(data)


def _called(read: Callable[[], object]) -> tuple[str, object]:
    try:
        return "read", read()
    except FemgearError as error:
        str(error).encode()
        return f"refused {error.code}", ""
    except BaseException as error:
        return "traceback", f"{type(error).__name__}: {str(error)[:200]} ({place_in_package(error)})"


def _difference(read_values: object, expected: object) -> str:
    """Name what was read and differs, or was not read though nothing was refused."""
    if not isinstance(read_values, dict) or not isinstance(expected, dict):
        return "" if read_values == expected else "the numbers differ"
    wrong = [key for key in expected if key not in read_values or read_values[key] != expected[key]]
    wrong += [key for key in read_values if key not in expected]
    return f"differ or missing without a word: {', '.join(wrong)}" if wrong else ""


def _program_refuses(rng, place: Path, folder: Path, words: str) -> str:
    """What is wrong with ``femgear export`` or ``femgear report`` of the damaged folder."""
    program = workspace(folder / "program")
    command = ("export", place, "--csv", "-o", program / "csv") if rng.random() < 0.7 else ("report", place)
    ended = start(command, program).wait()
    if ended.crash or ended.code not in (0, 2, 4) or len(ended.messages) != bool(ended.code):
        return f"{words}: femgear {command[0]} ended with {ended.code}: {ended.err[-400:]}"
    return ""


# --- what is damaged ---------------------------------------------------------------------------------------


def _results(rng, place, folder):
    source = undisturbed("run", folder).folder / "out"
    shutil.copytree(source, place, dirs_exist_ok=True)
    path = rng.choice(sorted(path for path in place.iterdir() if path.is_file()))
    words = f"{path.name} {damage_file(path, rng)}"
    return words, lambda: numbers(place), _expected(source)


def _own_checksums(rng, place, folder):
    """A damaged file that the manifest calls right: nothing guards its numbers, but nothing crashes."""
    words, read, expected = _results(rng, place, folder)

    def read_without_manifest():
        manifest = place / "manifest.json"
        with contextlib.suppress(OSError, ValueError, FemgearError, TypeError, KeyError, AttributeError):
            # it may be a pipe or a device now, which never ends
            table = json.loads(manifest.read_bytes() if manifest.is_file() else b"")
            edit_manifest(place, files={name: checksum(place / name) for name in table["files"]})
        for path in place.glob("*.nc"):
            try:
                read_dataset(path)
            except FemgearError:
                continue
        return read()

    return words, read_without_manifest, expected


def _swapped(rng, place, folder):
    """Files of another run, or two files of the run with their names exchanged."""
    source, other = (undisturbed(name, folder).folder / "out" for name in ("run", "old"))
    shutil.copytree(source, place, dirs_exist_ok=True)
    names = sorted(path.name for path in place.iterdir())
    a, b = rng.sample(names, 2)
    if rng.random() < 0.5:
        (place / a).rename(place / "between")
        (place / b).rename(place / a)
        (place / "between").rename(place / b)
        words = f"{a} and {b} exchanged"
    else:
        shutil.copy(other / a, place / a)
        words = f"{a} of another run"
    return words, lambda: numbers(place), _expected(source)


def _journal(rng, place, folder):
    path = place / "sweep.jsonl"
    shutil.copy(_sweep_journal(folder)[0], path)
    words = f"journal {damage_file(path, rng, table=True)}"
    return words, lambda: _swept(path), _sweep_journal(folder)[1]


def _grid(rng, place, folder):
    intact, expected = _grid_cache(folder)
    shutil.copytree(intact, place / "grids")
    (path,) = (place / "grids").glob("*.msh")
    words = f"grid {damage_file(path, rng)}"
    return words, lambda: _meshed(place / "grids"), expected


_MAKERS = {
    "results": _results,
    "own checksums": _own_checksums,
    "swapped files": _swapped,
    "journal": _journal,
    "grid": _grid,
}


# --- what is read ------------------------------------------------------------------------------------------


def numbers(folder: Path) -> dict[str, str]:
    """Read a results folder: a hash of every stage, of the case, of the manifest without its times."""
    results = open_results(folder)
    values = {"case": repr(results.case.model_dump()), "convergence": repr(dict(results.manifest.convergence))}
    values["complete"] = repr(results.manifest.complete)
    for stage in results.stages:
        digest = hashlib.sha256()
        for name, variable in sorted(results[stage].variables.items()):
            digest.update(f"{name} {variable.dims} {variable.attrs} {variable.dtype}".encode())
            text = variable.dtype.kind in "OUS"
            digest.update(repr(variable.values.tolist()).encode() if text else variable.values.tobytes())
        values[stage] = digest.hexdigest()
    return values


@cache
def _expected(folder: Path) -> dict[str, str]:
    return numbers(folder)


def _swept(path: Path) -> list:
    """Values and errors of a sweep of the gears with a journal."""
    case = parse_case(case_texts()["shifts"])
    over = {"planet.profile_shift": [0.0, 0.05, 0.1, 0.15, 2.5], "operation.torque": ["50 N m", "100 N m"]}
    quantities = [named_quantity(name) for name in ("contact ratio sun-planet", "tip thickness planet")]
    table = sweep(case, over, quantities, journal=path)
    return [table.values.tobytes(), table.errors]


@cache
def _sweep_journal(folder: Path) -> tuple[Path, list]:
    path = folder / "journal" / "sweep.jsonl"
    path.unlink(missing_ok=True)
    with mock.patch("time.perf_counter", return_value=0.0):
        return path, _swept(path)


def _meshed(folder: Path) -> list[bytes]:
    """The grid of a sun, from a cache."""
    gears = planetary_set(parse_case(case_texts()["set"]))
    grid = mesh_outline(half_sector(gears.sun, flank_elements=5, refine=0.5), cache=folder)
    return [np.ascontiguousarray(array).tobytes() for array in (grid.points, grid.triangles, *grid.boundaries.values())]


@cache
def _grid_cache(folder: Path) -> tuple[Path, list[bytes]]:
    shutil.rmtree(folder / "grid cache", ignore_errors=True)
    return folder / "grid cache", _meshed(folder / "grid cache")


# --- damage ------------------------------------------------------------------------------------------------


def damage_file(path: Path, rng: random.Random, *, table: bool = False) -> str:
    """Damage a file; tell how. With ``table``, or where it is JSON or TOML, mostly within its syntax."""
    if rng.random() < 0.08:
        return _replaced_by(path, rng)
    data = path.read_bytes()
    if (table or path.suffix in (".json", ".toml")) and rng.random() < 0.7:
        words, changed = _edited(data, rng)
    else:
        words, changed = _broken(data, rng)
    path.write_bytes(changed)
    return words


def _replaced_by(path: Path, rng: random.Random) -> str:
    path.unlink()
    match rng.randrange(5):
        case 0:
            return "missing"
        case 1:
            path.mkdir()
            return "replaced by a folder"
        case 2:
            os.mkfifo(path)
            return "replaced by a pipe"
        case 3:
            path.symlink_to("/dev/zero" if sys.platform == "linux" else path.name)
            return "replaced by a link"
        case _:
            path.symlink_to(path.name)
            return "replaced by a link to itself"


def _broken(data: bytes, rng: random.Random) -> tuple[str, bytes]:
    """Bytes that differ."""
    a, size = rng.randrange(len(data)), int(10 ** rng.uniform(0, 4))
    b = min(a + size, len(data))
    match rng.randrange(8):
        case 0:
            return f"bit flipped at {a}", data[:a] + bytes([data[a] ^ 1 << rng.randrange(8)]) + data[a + 1 :]
        case 1:
            return f"byte changed at {a}", data[:a] + rng.randbytes(1) + data[a + 1 :]
        case 2:
            return f"cut at {a}", data[:a]
        case 3:
            return "emptied", b""
        case 4:
            return f"zeros from {a} to {b}", data[:a] + bytes(b - a) + data[b:]
        case 5:
            return f"random from {a} to {b}", data[:a] + rng.randbytes(b - a) + data[b:]
        case 6:
            return f"without {a} to {b}", data[:a] + data[b:]
        case _:
            return f"{a} to {b} twice", data[:b] + data[a:]


def _edited(data: bytes, rng: random.Random) -> tuple[str, bytes]:
    """Text that another hand has edited: numbers, values, names, lines."""
    text = data.decode()
    match rng.randrange(5):
        case 0 | 1:
            pattern = r"\d"
            make = lambda old: str((int(old) + rng.randint(1, 9)) % 10)  # noqa: E731
        case 2:
            pattern = r"-?\d+\.\d+(e-?\d+)?|\d+|true|false|\"[^\"\n]*\"(?!:)"
            values = (
                "NaN",
                "Infinity",
                '"abc"',
                "null",
                "5",
                "[]",
                "{}",
                "1e999",
                "-0.0",
                "true",
                "[" * 5000,
                "9" * 5000,
            )
            make = lambda old: rng.choice(values)  # noqa: E731
        case 3:
            pattern = r"\"\w[^\"\n]*\"(?=:)"
            make = lambda old: rng.choice(('"values"', '"key"', '"x"', '""', '"complete"', '"..\\/x"'))  # noqa: E731
        case _:
            return _other_lines(text, rng)
    matches = list(re.finditer(pattern, text))
    if not matches:
        return _broken(data, rng)
    match_ = rng.choice(matches)
    new = make(match_[0])
    words = f"{match_[0][:40]} at {match_.start()} now {new[:40]}"
    return words, (text[: match_.start()] + new + text[match_.end() :]).encode()


def _other_lines(text: str, rng: random.Random) -> tuple[str, bytes]:
    lines = text.splitlines(keepends=True)
    a, b = rng.randrange(len(lines)), rng.randrange(len(lines))
    match rng.randrange(3):
        case 0:
            lines[a], lines[b] = lines[b], lines[a]
            words = f"lines {a} and {b} exchanged"
        case 1:
            lines.insert(b, lines[a])
            words = f"line {a} again at {b}"
        case _:
            del lines[a]
            words = f"without line {a}"
    return words, "".join(lines).encode()
