"""What commands show on a terminal: progress, tables, lines, findings and data."""

from __future__ import annotations

import contextlib
import functools
import os
import sys
import textwrap
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from femgear.errors import printable

SILENCE = 10.0
"""Longest time without a line where standard error is a file or a pipe [s]."""
_SCREEN, _LAST_WORDS, _LEAST_ROWS = 45, 3, (6, 1)
"""Lines of a run on a terminal, those of them that say where its results are, and rows left of the longest table: with
notes, and without."""
_MOST_WARNINGS, _WARNING_LINES = 3, 2
"""Warnings of a case, and of its results, that a run shows on a terminal, and lines of each."""


class Progress:
    """Bars on the terminal, or a line every 10 s where standard error is a file or a pipe; called by the stages.

    Bars go when what they show is done: what was found stands on the terminal alone.
    """

    def __enter__(self):
        from rich.console import Console

        self._console = Console(stderr=True, markup=False, highlight=False)
        self._done, self._now, self._start = dict[str, tuple[float, float]](), "", time.monotonic()
        self._first = dict[str, tuple[float, float]]()
        self._ended, self._bars, self._tasks = threading.Event(), None, {}
        if self._console.is_terminal:
            self._draw_bars()
        else:
            threading.Thread(target=self._tell_time, daemon=True).start()
        return self

    def __exit__(self, *_):
        self._ended.set()
        if self._bars is not None:
            self._bars.stop()

    def __call__(self, stage: str, done: float = 0.0, total: float = 1.0) -> None:
        """Say that ``done`` of ``total`` steps of a stage are done."""
        self._first.setdefault(stage, (time.monotonic(), done))
        self._done[stage], self._now = (done, total), stage
        if self._bars is not None:
            if stage not in self._tasks:
                self._tasks[stage] = self._bars.add_task(stage, total=total)
            self._bars.update(self._tasks[stage], completed=done, total=total)

    @contextlib.contextmanager
    def aside(self) -> Iterator[None]:
        """Leave the terminal to others in this context."""
        if self._bars is not None:
            self._bars.stop()
        yield
        if self._bars is not None:
            self._draw_bars()

    def _draw_bars(self) -> None:
        """Begin with new bars."""
        from rich import progress

        self._tasks = {}
        self._bars = progress.Progress(
            progress.TextColumn("{task.description}", markup=False),
            progress.BarColumn(),
            progress.TextColumn("{task.percentage:>3.0f} %", style="progress.percentage"),
            progress.MofNCompleteColumn(),
            progress.TimeElapsedColumn(),
            progress.TimeRemainingColumn(),
            console=self._console,
            transient=True,
        )
        self._bars.start()

    def _tell_time(self) -> None:
        """Print how far the stage has come as often as a reader would begin to wonder."""
        while not self._ended.wait(SILENCE):
            self._console.print(self._time_words())

    def _time_words(self) -> str:
        """Say what the stage is, how far it has come, how long the command runs, and how long the stage will."""
        now, (done, total) = time.monotonic(), self._done.get(self._now, (0.0, 1.0))
        share = f", {done:.5g} of {total:.5g}" if total > 1.0 else ""
        text = f"{self._now or 'working'}{share}, {now - self._start:.0f} s"
        begun, at_first = self._first.get(self._now, (self._start, 0.0))
        # what was done before the first call, of a command that goes on, tells nothing of the pace
        if total > done > at_first and total > 1.0:
            text += f", about {(now - begun) * (total - done) / (done - at_first):.0f} s left"
        return text


def says_when_long(words: str) -> Callable[[Callable[..., int]], Callable[..., int]]:
    """Make a command without stages say what it does, as often as a reader would begin to wonder."""

    def decorate(command: Callable[..., int]) -> Callable[..., int]:
        @functools.wraps(command)
        def telling(*arguments: Any, **named: Any) -> int:
            ended, start = threading.Event(), time.monotonic()

            def tell() -> None:
                while not ended.wait(SILENCE):
                    print(f"{words}, {time.monotonic() - start:.0f} s", file=sys.stderr, flush=True)

            threading.Thread(target=tell, daemon=True).start()
            try:
                return command(*arguments, **named)
            finally:
                ended.set()

        return telling

    return decorate


def print_blocks(blocks) -> None:
    """Print blocks of `femgear.report.page` as tables on standard output."""
    sys.stdout.write(_as_text(blocks))


def print_briefly(blocks, warned: int = 0) -> None:
    """Print blocks in the lines of a screen that so many lines of warnings leave; the first block stays whole.

    Of the longest of the others the last rows go first, but for `_LEAST_ROWS`, then its last notes, then more rows.
    """
    from dataclasses import replace

    from femgear.report.tables import merged

    blocks, room = [replace(block, rows=tuple(merged(block.rows))) for block in blocks], _SCREEN - _LAST_WORDS - warned
    longest = max(range(len(blocks) > 1, len(blocks)), key=lambda number: len(blocks[number].rows))
    whole = blocks[longest]
    rows, notes = list(whole.rows), list(whole.notes)
    least, fewest = _LEAST_ROWS
    while (text := _as_text(blocks)).count("\n") > room and (len(rows) > fewest or notes):
        (notes if notes and len(rows) <= least else rows).pop()
        left = len(whole.rows) - len(rows), len(whole.notes) - len(notes)
        texts = [f"{left[0]} more"] * bool(left[0]) + [f"{left[1]} note{'s' * (left[1] > 1)}"] * bool(left[1])
        more = f"{' and '.join(texts)} by --verbose"
        blocks[longest] = replace(whole, rows=tuple(rows), notes=(more, *notes))
    sys.stdout.write(text)


def _as_text(blocks) -> str:
    """Write blocks of `femgear.report.page` as tables, as wide as the terminal or COLUMNS, else in 120 columns."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    from femgear.report.tables import merged

    console = Console(markup=False, highlight=False, emoji=False)
    if not console.is_terminal and not os.environ.get("COLUMNS", "").isdigit():
        console.width = 120
    with console.capture() as captured:
        for block in blocks:
            console.print(f"\n{printable(block.title)}")
            rows = [[printable(cell) for cell in row] for row in merged(block.rows)]
            for columns in _fitting(block.header, rows, console.width) if rows else ():
                table = Table(box=box.SIMPLE_HEAD if block.header else None, show_header=bool(block.header))
                for index, name, least in columns:
                    side = "right" if index and block.header else "left"
                    # numbers stay whole, texts break between words
                    whole = not any(" " in row[index] for row in rows)
                    table.add_column(name, justify=side, overflow="fold", no_wrap=whole, min_width=least)
                for row in rows:
                    table.add_row(*(row[index] for index, *_ in columns))
                console.print(table)
            for note in block.notes:
                console.print(f"  {printable(note)}")
    return captured.get()


def _fitting(header: Sequence[str], rows: Sequence[Sequence[str]], width: int) -> list[list[tuple[int, str, int]]]:
    """Split columns so that no number breaks in a width, the first one repeated; places, names, least widths.

    Names break between words where that makes the table narrower.
    """
    names = list(header) or [""] * len(rows[0])
    cells = [max(len(row[i]) for row in rows) for i in range(len(names))]
    natural = sum(max(len(name), cell) + 3 for name, cell in zip(names, cells))
    if natural > width:
        names = [_broken(name, cell) for name, cell in zip(names, cells)]
    least = [
        max(map(len, [*name.split("\n"), *(word for row in rows for word in row[i].split())]), default=0)
        for i, name in enumerate(names)
    ]
    parts, used = [[0]], least[0]
    for i in range(1, len(names)):
        if used + least[i] + 3 * (len(parts[-1]) + 1) >= width and len(parts[-1]) > 1:
            parts.append([0])
            used = least[0]
        parts[-1].append(i)
        used += least[i]
    return [[(i, names[i], least[i]) for i in part] for part in parts]


def _broken(name: str, width: int) -> str:
    """Break a name between words to lines of a width, or of its longest word."""
    return "\n".join(textwrap.wrap(name, max([width, *map(len, name.split())]), break_on_hyphens=False))


def say(text: str) -> None:
    """Print a line on standard output, in characters that it can show."""
    print(printable(text))


def print_data(data: object) -> None:
    """Print data as JSON on standard output."""
    import json

    print(json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False))


def warning_lines(findings: Iterable, *, whole: bool = False) -> tuple[str, ...]:
    """Write findings as warnings: all in full, on a terminal the most severe ones in few lines.

    Parameters
    ----------
    findings : findings, or texts of what other libraries warn of
    whole : bool
        Whether they are wanted in full on a terminal too.
    """
    findings = tuple(findings)
    texts = tuple(f"warning: {printable(str(finding))}" for finding in findings)
    if whole:
        return texts
    from rich.console import Console

    from femgear.findings import by_severity

    console = Console(stderr=True)
    if not console.is_terminal:
        return texts
    shown, others = by_severity(findings)[:_MOST_WARNINGS], by_severity(findings)[_MOST_WARNINGS:]
    lines = list[str]()
    for finding in shown:
        text = f"warning: {printable(str(finding))}"
        lines += textwrap.wrap(text, console.width, max_lines=_WARNING_LINES, placeholder=" ...")
    if others:
        codes = ", ".join(dict.fromkeys(finding.code for finding in others if finding.code))
        more = f"warning: {len(others)} more{f' ({codes})' if codes else ''}, in full by --verbose and on the page"
        lines += textwrap.wrap(more, console.width, max_lines=1, placeholder=" ...")
    return tuple(lines)


def print_warnings(lines: Iterable[str]) -> None:
    """Print lines of warnings on standard error."""
    for line in lines:
        print(line, file=sys.stderr)


def room_of_warnings(lines: Sequence[str]) -> int:
    """Count the lines that warnings take of what is read: none where they go elsewhere than standard output."""
    from rich.console import Console

    return len(lines) if Console(stderr=True).is_terminal or _one_stream() else 0


def _one_stream() -> bool:
    """Whether standard output and standard error are one file or pipe."""
    try:
        return os.path.sameopenfile(sys.stdout.fileno(), sys.stderr.fileno())
    except (OSError, ValueError):
        return False
