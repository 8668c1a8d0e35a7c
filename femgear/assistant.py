"""femgear for assistants: a server of the Model Context Protocol on standard input and output, and what teaches it.

Every tool is a command of the command line in a process of its own, in one folder: names of files stay in it, texts
have a largest size, and case files may not name files outside.
"""

from __future__ import annotations

import asyncio
import json
import re
import subprocess
import sys
import threading
import time
import tomllib
from collections.abc import Callable
from contextvars import ContextVar
from functools import wraps
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from femgear.errors import CaseError, FemgearError, nvh_library
from femgear.storage import files
from femgear.trains.drafts import KINDS

if TYPE_CHECKING:
    from mcp.server.mcpserver import MCPServer
SKILL = Path(__file__).with_name("skill.md")
"""What `femgear skill` prints."""
MOST_TEXT = 200_000
"""Longest text of a case file, and of an answer [characters]."""
MOST_FILES = 200
"""Files and folders that are listed."""
LONGEST_RUN = 3600.0
"""Longest time of a command [s]."""
_ENDS_WITHIN = 30.0
"""Time that a command has to end by itself once its call is cancelled [s]."""
_LOOKED_EVERY = 0.2
"""Between two looks whether a call was cancelled [s]."""
_CANCELLED = ContextVar[threading.Event | None]("cancelled", default=None)
"""Set when the call of a tool has ended, whose command ends with it."""
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 ._-]{0,99}(/[A-Za-z0-9][A-Za-z0-9 ._-]{0,99}){0,4}")
_OUTSIDE = re.compile(r"^(/|~|\\|[A-Za-z]:[\\/])|(^|[\\/])\.\.([\\/]|$)")
"""Texts that name a place outside of the folder."""


class CommandRefused(Exception):
    """A command refused what a tool asked of it, in its own words."""


def place_in(folder: Path, name: str) -> Path:
    """Find a file or folder by its name in a folder.

    Raises
    ------
    CaseError
        E-FILE: a name that leads out of the folder, or is none.
    """
    if not _is_at_hand(folder, name):
        raise CaseError(
            "only files of one folder are at hand",
            code="E-FILE",
            key="name",
            value=name[:100],
            limit="letters, digits, blanks and . _ - in each part, inside of the folder",
        )
    return (folder / name).resolve()


def _is_at_hand(folder: Path, name: str) -> bool:
    """Whether a name of a folder is one that tools take: no link that leads out of it."""
    return bool(_NAME.fullmatch(name)) and (folder / name).resolve().is_relative_to(folder.resolve())


def _word(text: str) -> str:
    """Refuse what is no word, as an option of a command would be (CaseError, E-ARGUMENTS)."""
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_-]{0,60}", text):
        raise CaseError("a word is needed", code="E-ARGUMENTS", value=text[:60], limit="letters, digits, _ and -")
    return text


def check_text(text: str) -> None:
    """Refuse the text of a case file that is too long, no TOML, or names files outside of its folder.

    Raises
    ------
    CaseError
        E-TOML; E-FILE: too long, or files outside.
    """
    _whole(text)
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise CaseError(f"the text is no TOML: {error}", code="E-TOML") from error
    for path, value in _texts(tables):
        if _OUTSIDE.search(value):
            remedy = "copy the file into the folder and give its name"
            raise CaseError("files outside are not at hand", code="E-FILE", key=path, value=value[:100], remedy=remedy)


def _whole(text: str) -> str:
    """Refuse a text that is too long for a case file (CaseError, E-FILE)."""
    if len(text) > MOST_TEXT:
        limit = f"up to {MOST_TEXT} characters"
        raise CaseError("the case file is too long", code="E-FILE", value=f"{len(text)} characters", limit=limit)
    return text


def _texts(value: Any, path: str = "") -> list[tuple[str, str]]:
    """Texts of all entries with their paths."""
    if isinstance(value, str):
        return [(path, value)]
    if isinstance(value, dict):
        return [pair for key, part in value.items() for pair in _texts(part, f"{path}.{key}".lstrip("."))]
    if isinstance(value, list):
        return [pair for number, part in enumerate(value) for pair in _texts(part, f"{path}[{number}]")]
    return []


def _new_case_path(folder: Path, name: str) -> Path:
    """Find the place of a case file that a tool writes (CaseError, E-FILE)."""
    path = place_in(folder, name)
    if path.suffix != ".toml" or path.parent != folder.resolve():
        raise CaseError("case files stand in the folder and end in .toml", code="E-FILE", key="name", value=name[:100])
    return path


def _run_until_cancelled(arguments: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a process to its end, or to that of the call of the tool; TimeoutExpired after `LONGEST_RUN`."""
    pipes: Any = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    cancelled = _CANCELLED.get()
    with subprocess.Popen(arguments, cwd=folder, text=True, errors="replace", **pipes) as process:
        end, asked_to_end = time.monotonic() + LONGEST_RUN, False
        while True:
            try:
                printed, messages = process.communicate(timeout=_LOOKED_EVERY)
                return subprocess.CompletedProcess(arguments, process.returncode, printed, messages)
            except subprocess.TimeoutExpired:
                if time.monotonic() > end:
                    process.kill()
                    raise
                if cancelled is not None and cancelled.is_set() and not asked_to_end:
                    process.terminate()  # once: it ends as by Ctrl-C, and files stay whole
                    end, asked_to_end = min(end, time.monotonic() + _ENDS_WITHIN), True


def command(folder: Path, *arguments: str) -> dict[str, Any]:
    """Run a command of femgear in a folder: exit code, what it printed, as data where that is JSON, and messages."""
    try:
        done = _run_until_cancelled([sys.executable, "-m", "femgear", *arguments], folder)
    except subprocess.TimeoutExpired:
        return {"exit_code": 124, "data": None, "messages": f"stopped after {LONGEST_RUN:g} s"}
    try:
        data = json.loads(done.stdout)
    except json.JSONDecodeError:
        data = done.stdout[:MOST_TEXT]
    return {"exit_code": done.returncode, "data": data, "messages": done.stderr[-MOST_TEXT:]}


def _answered(folder: Path, *arguments: str) -> dict[str, Any]:
    """Run a command as `command` does; a refusal that leaves no data is one of the tool (CommandRefused)."""
    done = command(folder, *arguments)
    if done["exit_code"] and not isinstance(done["data"], dict):
        raise CommandRefused(done["messages"].strip() or f"the command ended with exit code {done['exit_code']}")
    return done


def make_server(folder: Path) -> MCPServer:
    """Make the server of a folder, with the tools list, read, write, new, check, run, results, compare and explain.

    Raises
    ------
    FemgearError
        E-LIBRARY: the package mcp is not installed.
    """
    with nvh_library("tools for assistants", "assistant"):
        from mcp.server.mcpserver import MCPServer
        from mcp.server.mcpserver.exceptions import ToolError

    def with_refusals(tool: Callable[..., Any]) -> Callable[..., Any]:
        """Tell refusals in their own words, which other exceptions are not."""

        @wraps(tool)
        async def refusing(*arguments: Any, **named: Any) -> Any:
            cancelled = threading.Event()
            _CANCELLED.set(cancelled)
            try:
                return await asyncio.to_thread(tool, *arguments, **named)
            except (FemgearError, OSError, UnicodeError, CommandRefused) as error:
                raise ToolError(str(error)) from error
            finally:
                cancelled.set()

        return refusing

    tools = {tool.__name__: tool for tool in _tools(folder)}

    class Server(MCPServer):
        """Tells of arguments that do not fit a tool as commands tell of theirs."""

        async def call_tool(self, name: str, arguments: dict[str, Any], context: Any = None) -> Any:
            try:
                return await super().call_tool(name, arguments, context)
            except ToolError as error:
                if isinstance(error.__cause__, ValidationError):
                    raise ToolError(str(_other_arguments(tools[name], error.__cause__))) from error
                raise

    server = Server("femgear", instructions=SKILL.read_text(encoding="utf-8"), log_level="WARNING")
    for tool in tools.values():
        server.tool()(with_refusals(tool))
    return server


def _other_arguments(tool: Callable[..., Any], error: ValidationError) -> CaseError:
    """Make the refusal of arguments of a tool, all of which are texts."""
    wrong = [f"{part['loc'][0]} is {'missing' if part['type'] == 'missing' else 'no text'}" for part in error.errors()]
    named = signature(tool).parameters.values()
    texts = [entry.name if entry.default is entry.empty else f"{entry.name} (may be missing)" for entry in named]
    return CaseError(
        "the arguments do not fit the tool",
        code="E-ARGUMENTS",
        key=tool.__name__,
        value=", ".join(wrong),
        limit=f"texts: {', '.join(texts)}",
    )


def _tools(folder: Path) -> list[Callable[..., Any]]:
    """Tools of the server, whose docstrings tell an assistant what they are for."""

    def text_of(name: str) -> str:
        path = place_in(folder, name)
        if path.suffix != ".toml" or not path.is_file():
            raise CaseError(
                "there is no such case file", code="E-FILE", key="name", value=name, limit="a name of list_files"
            )
        return path.read_text(encoding="utf-8")

    def list_files() -> list[str]:
        """List case files and folders of results."""
        names = sorted(path.name for path in folder.iterdir())
        places = [(name, place_in(folder, name)) for name in names if _is_at_hand(folder, name)]
        listed = [
            name
            for name, path in places
            if (path.suffix == ".toml" and path.is_file()) or (path / "manifest.json").is_file()
        ]
        return listed[:MOST_FILES]

    def read_case(name: str) -> str:
        """Read a case file, TOML text."""
        return _whole(text_of(name))

    def write_case(name: str, text: str) -> str:
        """Write or replace a case file, whose name ends in .toml; check it afterwards."""
        path = _new_case_path(folder, name)
        check_text(text)
        files.write_text(text, path)
        return f"written: {name}"

    def new(kind: str, name: str) -> dict[str, Any]:
        """Write a commented case of a kind; edit and check it."""
        if _new_case_path(folder, name).exists():
            remedy = "take another name; write_case replaces a file"
            raise CaseError("the file is there already", code="E-OUTPUT", key="name", value=name, remedy=remedy)
        return _answered(folder, "new", _word(kind), "-o", name)

    new.__doc__ = f"{new.__doc__} Kinds: {', '.join(KINDS)}."

    def check(name: str) -> dict[str, Any]:
        """Check a case: what it is, its warnings, and why a run would refuse it. Takes a second."""
        check_text(text_of(name))
        return command(folder, "check", name, "--json")

    def run(name: str, results: str, only: str = "") -> dict[str, Any]:
        """Compute a case into a folder of results; only: one stage and what it needs. Seconds to minutes."""
        check_text(text_of(name))
        place_in(folder, results)
        stage = ("--only", _word(only)) if only else ()
        return _answered(folder, "run", name, "-o", results, "--json", "--force", *stage)

    def results(folder_name: str) -> dict[str, Any]:
        """Tell what decides about a finished run: answers with limits, findings, key figures, files."""
        place_in(folder, folder_name)
        return _answered(folder, "report", folder_name, "--json")

    def compare(first: str, second: str, output: str) -> dict[str, Any]:
        """Compare two folders of results; writes compare.html into a folder."""
        for name in (first, second, output):
            place_in(folder, name)
        return _answered(folder, "compare", first, second, "-o", output)

    def explain(code: str) -> dict[str, Any]:
        """Say what a code of a refusal (E-...) or a warning (W-...) means."""
        return _answered(folder, "explain", _word(code))

    return [list_files, read_case, write_case, new, check, run, results, compare, explain]
