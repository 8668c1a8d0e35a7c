"""Case files mutated from a seed: they are read and described, or refused; nothing else, and soon."""

from __future__ import annotations

import itertools
import random
import re
import shutil
import warnings
from functools import cache
from pathlib import Path

from femgear.errors import FemgearError
from femgear.trains.reading import read_case
from femgear.trains.registry import check_case, train_of
from validation.soak.trials import Outcome, TooSlow, metered, place_in_package

PIECE = 1000
SECONDS, MEGABYTES = 1.0, 500.0
"""Limits of one mutant."""
# CPU time after which a mutant is stopped [s]
_STOP = 5.0
CASES = Path(__file__).resolve().parents[2] / "cases"
# cases that are described soon, by the turns of which the tests take one
_SOON = {"gear_pair_light.toml": 1, "published_four_stages.toml": 1, "gear_pair.toml": 5}
_SOON |= {"modulation_paper.toml": 5}

_NUMBER = re.compile(r"(?<![\w.])[-+]?\d[\d_]*(?:\.\d+)?(?:[eE][-+]?\d+)?")
_STRING = re.compile(r'"[^"\n]*"')
_VALUE = re.compile(r"(?<== )[^\n#]+")
_KEY = re.compile(r"^[\w.]+(?= =)|(?<=\[)[\w.]+(?=\])", re.MULTILINE)
_NUMBERS = (
    *"0 -1 1 -0.0 nan inf -inf 1e308 -1e308 1e-320 1e400 007 0x1f 1_0 1__0 .5 5. +3 1e 0.1e-1_0 2.5".split(),
    *"1000000 100001 0b1 true 1979-05-27T07:32:00Z 07:32:00 ³ １２ 1,5 1/2 1e3e3".split(),
    "9" * 20,
    "9" * 5000,
)
_UNITS = (
    *"mm m um µm μm inch deg rad ° kg g N kN N*m Nm GPa Pa rpm Hz 1/s rad/s % mm/mm mm^1e9".split(),
    *"mm**9999999 m^-1^-1 (mm mm) 2**10**10**10 N/m K degC dB Å ﬁ [] mm; mm·m² __import__ 1j nan m/0".split(),
    *("", "  ", "mm mm", "N m", "kg m^2", "N m/rad", "lbf ft", "1 mm", "mm\t", "lambda: 0", "inf mm"),
    *("a" * 3000, "(" * 400, "-" * 400, "1" * 400 + " mm"),
)
_TEXTS = (
    *r'"" "\u0000" "\ud800" """ "\ "../../../etc/passwd" "/dev/zero" "/dev/stdin" "." "\u202e"'.split(),
    *r'"\u001b[31m" [] {} [[]] {a=1} [1,"a",2.5] true [true] [nan] 1 -1.5 "=cmd()" "rigid" "elastic"'.split(),
    *('["1 mm", "2 kg"]', '"' + "x" * 70000 + '"', "{ from = 1, to = 2, count = 3 }", "'" * 3, '"sun"'),
    *('{ from = "1 rpm", to = "9 rpm", count = 100000 }', '{ from = "1 rpm", to = "9 rpm", count = 10 }'),
)
_SIGNS = (
    *"\\ \" ' = [ ] { } # , . - ` % é ß 漢 🦷".split(),
    *("\x00", "\ufeff", "\u2028", "\u0085", "\r", "\r\n", "\x1b", "\u202e", "\u200b", "\u0301", "\t", "\x7f"),
    *("\n", "\v", "\f", "\ud800", "\U0010ffff"),
)
_NAMES = (*"sun x \"\" 'a.b' a.b.c ring.teeth model format ä __class__ 0 -".split(), "", "a" * 5000)
_FILLINGS = (
    *("# comment\n", "\n", " ", "x", '"', "[", "1", "a.", "\\", "é", "{", "1, ", "= ", '"1 mm", ', "a = [\n"),
    *("a = 1\n", "'" * 3 + "\n", '"""\n', "[a]\n", "[[a]]\n", "[[sun.modifications]]\n", "[[body]]\n"),
    *("[[stage]]\n", "[[shaft]]\n"),
)


@cache
def originals() -> tuple[tuple[str, str], ...]:
    """Names and texts of all case files of the repository."""
    return tuple((path.name, path.read_text(encoding="utf-8")) for path in sorted(CASES.glob("*.toml")))


def short(count: int) -> list[int]:
    """Numbers of mutants for the tests: of the cases that are described soonest, none of a megabyte."""
    numbers = []
    for number in itertools.count():
        turn, case = divmod(number, len(originals()))
        large = turn % len(MUTATIONS) == len(MUTATIONS) - 1
        every = _SOON.get(originals()[case][0])
        if every and turn % every == 0 and not large:
            numbers.append(number)
        if len(numbers) == count:
            return numbers
    raise AssertionError


def trial(number: int, folder: Path) -> Outcome:
    """Read, check and describe the mutant with a number."""
    _warm(folder, number % len(originals()))
    path = folder / "mutant.toml"
    path.write_bytes(mutant(number))
    failure = ""
    try:
        with metered(_STOP) as meter, warnings.catch_warnings(record=True):
            warnings.simplefilter("always")
            said = _described(path)
    except TooSlow:
        said, failure = "stopped", f"does not end within {_STOP:g} s of CPU time"
    except Exception as error:
        last = place_in_package(error)
        said, failure = "traceback", f"{type(error).__name__}: {str(error)[:200]} ({last})"
    if not failure and meter.seconds > SECONDS:
        failure = f"{meter.seconds:.1f} s of CPU time, {said}"
    if not failure and meter.megabytes > MEGABYTES:
        failure = f"{meter.megabytes:.0f} MB, {said}"
    return Outcome(said, failure, seconds=meter.seconds, megabytes=meter.megabytes)


def _described(path: Path) -> str:
    """Read and describe a case as ``femgear check`` does, and say in a word how it ended."""
    try:
        case = read_case(path)
        train = train_of(case)
        train.describe_case(case)
        list(map(str, train.case_warnings(case)))
    except FemgearError as error:
        str(error).encode()
        return f"refused {error.code}"
    try:
        check_case(case)
    except FemgearError as error:
        str(error).encode()
        return "described, run refused"
    return "described"


@cache
def _warm(folder: Path, case: int) -> None:
    """Read a case once: what is loaded then is no memory or time of a mutant."""
    for table in CASES.glob("*.csv"):
        shutil.copy(table, folder / table.name)
    name, text = originals()[case]
    (folder / name).write_text(text, encoding="utf-8")
    _described(folder / name)


def mutant(number: int) -> bytes:
    """Make the bytes of a mutant: a case file and a mutation by turns, further mutations at random."""
    rng = random.Random(f"case text {number}")
    turn, case = divmod(number, len(originals()))
    turn, kind = divmod(turn, len(MUTATIONS))
    text = MUTATIONS[kind](originals()[case][1], rng, turn)
    for _ in range(rng.choice((0, 0, 0, 1, 2))):
        text = rng.choice(MUTATIONS[:-1])(text, rng, rng.randrange(10**6))
    data = text.encode("utf-8", "surrogatepass")
    if rng.random() < 0.03 and data:
        broken = bytearray(data)
        for _ in range(rng.randint(1, 3)):
            broken[rng.randrange(len(broken))] = rng.randrange(256)
        data = bytes(broken)
    return data


def _replaced(text: str, rng: random.Random, pattern: re.Pattern, make) -> str:
    """Text with one match of a pattern, drawn at random, replaced by ``make(match)``."""
    matches = list(pattern.finditer(text))
    if not matches:
        return text
    match = rng.choice(matches)
    return text[: match.start()] + make(match) + text[match.end() :]


def _number(text, rng, turn):
    def other(match):
        if rng.random() < 0.5:
            return rng.choice(_NUMBERS)
        try:
            scaled = float(match[0]) * rng.choice((-1, 0.1, 0.5, 0.9, 1.1, 2, 10, 1e3, 1e-3, 1e6, 1e-6, 1e12))
        except ValueError:
            return "1"
        return str(int(scaled)) if match[0].isdigit() and abs(scaled) < 1e15 else repr(scaled)

    return _replaced(text, rng, _NUMBER, other)


def _unit(text, rng, turn):
    def other(match):
        parts = match[0].strip('"').split(" ", 1)
        return f'"{parts[0]} {rng.choice(_UNITS)}"' if rng.random() < 0.8 else f'"{rng.choice(_UNITS)}"'

    return _replaced(text, rng, _STRING, other)


def _value(text, rng, turn):
    return _replaced(text, rng, _VALUE, lambda match: rng.choice(_TEXTS + _NUMBERS))


def _sign(text, rng, turn):
    place = rng.randint(0, len(text))
    return text[:place] + rng.choice(_SIGNS) * rng.choice((1, 1, 1, 2, 3, 50)) + text[place:]


def _delete(text, rng, turn):
    place = rng.randint(0, len(text))
    return text[:place] + text[place + rng.choice((1, 1, 2, 5, 20, 200)) :]


def _cut_file(text, rng, turn):
    """Every place of the file in turn: the stride is prime."""
    return text[: turn * 7919 % (len(text) + 1)]


def _cut_line(text, rng, turn):
    """Every place of the file in turn as well, without the rest of its line."""
    place = turn * 7919 % (len(text) + 1)
    end = text.find("\n", place)
    return text[:place] + ("" if end < 0 else text[end:])


def _lines(text, rng, turn):
    """Lines or whole blocks that are missing, twice there or in another order."""
    mark = rng.choice(("\n", "\n", "\n\n"))
    lines = text.split(mark)
    a, b = rng.randrange(len(lines)), rng.randrange(len(lines))
    match rng.randrange(4):
        case 0:
            lines[a], lines[b] = lines[b], lines[a]
        case 1:
            lines.insert(b, lines[a])
        case 2:
            del lines[a]
        case _:
            lines[a:a] = [lines[a]] * rng.choice((2, 10, 300))
    return mark.join(lines)


def _key(text, rng, turn):
    def other(match):
        part = match[0][: rng.randint(0, len(match[0]))]
        return rng.choice((*_NAMES, part + "x", part + "_", part))

    return _replaced(text, rng, _KEY, other)


def _splice(text, rng, turn):
    """Beginning of the one file, end of another."""
    _, other = rng.choice(originals())
    return text[: rng.randint(0, len(text))] + other[rng.randint(0, len(other)) :]


def _nest(text, rng, turn):
    depth = rng.choice((2, 31, 32, 33, 200, 2000, 20_000))
    match rng.randrange(4):
        case 0:
            return _replaced(text, rng, _VALUE, lambda match: "[" * depth + match[0] + "]" * depth)
        case 1:
            return _replaced(text, rng, _VALUE, lambda match: "{a = " * depth + "1" + "}" * depth)
        case 2:
            return f"{text}\n{'.'.join('a' * depth)} = 1\n"
        case _:
            return f"{text}\n[{'.'.join('a' * depth)}]\n" + "[[a]]\n" * rng.choice((0, depth))


def _large(text, rng, turn):
    """Texts at the limit of a megabyte or far beyond it; seldom, as they take long."""
    if rng.random() < 0.8:
        return _lines(text, rng, turn)
    size = rng.choice((900_000, 990_000, 999_000, 10_000_000))
    unit = rng.choice(_FILLINGS)
    filling = unit * ((size - len(text.encode())) // len(unit.encode()))
    place = rng.choice((0, text.find("= ") + 2, text.find("\n[") + 1, len(text)))
    return text[:place] + filling + text[place:]


MUTATIONS = (
    *(_number, _number, _unit, _value, _sign, _delete, _cut_file, _cut_line, _lines, _lines, _key, _splice),
    *(_nest, _large),
)
