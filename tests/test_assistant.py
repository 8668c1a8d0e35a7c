"""The server for assistants, called by the client of its library: tools, answers, and what stays closed."""

import asyncio
import contextlib
import io
import json
import subprocess
import sys
import threading
import time
from importlib.util import find_spec
from pathlib import Path

import pytest

from femgear import assistant
from femgear.assistant import MOST_TEXT, SKILL, check_text, command, make_server, place_in
from femgear.cli import main
from femgear.errors import CaseError
from femgear.trains.drafts import KINDS
from femgear.trains.reading import read_case, with_values

# the library is loaded where a test needs it: by one of the workers of pytest
pytestmark = [
    pytest.mark.usefixtures("pictures_undrawn", "coarse_states"),
    pytest.mark.skipif(find_spec("mcp") is None, reason='pip install "femgear[assistant]"'),
]
CASE = Path(__file__).parents[1] / "cases" / "spur_pair.toml"
TOOLS = ["list_files", "read_case", "write_case", "new", "check", "run", "results", "compare", "explain"]


@pytest.fixture
def commands_run_here(monkeypatch):
    """Commands of the server run within the test: to start their processes takes longer than they do.

    `test_commands_have_exit_code_data_and_messages` has the processes.
    """

    def run_here(command, folder):
        assert command[:3] == [sys.executable, "-m", "femgear"]
        printed, messages = io.StringIO(), io.StringIO()
        with contextlib.chdir(folder), contextlib.redirect_stdout(printed), contextlib.redirect_stderr(messages):
            code = main(command[3:])
        return subprocess.CompletedProcess(command, code, printed.getvalue(), messages.getvalue())

    monkeypatch.setattr(assistant, "_run_until_cancelled", run_here)


def asked(server, *calls):
    """Texts and error flags of calls of tools, by the client of the library."""
    from mcp import Client

    async def talk():
        async with Client(server) as client:
            tools = [tool.name for tool in (await client.list_tools()).tools]
            answers = [await client.call_tool(name, arguments) for name, arguments in calls]
            return tools, [("".join(part.text for part in answer.content), bool(answer.is_error)) for answer in answers]

    return asyncio.run(talk())


def test_a_case_goes_from_new_to_its_answers(tmp_path, commands_run_here):
    server = make_server(tmp_path)
    few = {"static.positions": 8, "static.flank_elements": 6, "static.stresses": False}
    text = with_values(read_case(CASE), few).source
    tools, answers = asked(
        server,
        ("write_case", {"name": "pair.toml", "text": text}),
        ("list_files", {}),
        ("check", {"name": "pair.toml"}),
        ("run", {"name": "pair.toml", "results": "out", "only": "static"}),
        ("results", {"folder_name": "out"}),
        ("explain", {"code": "W-PULL"}),
        ("read_case", {"name": "pair.toml"}),
    )
    assert tools == TOOLS and not any(error for _, error in answers)
    _, listed, checked, ran, told, explained, read = (answer for answer, _ in answers)
    assert "pair.toml" in listed and json.loads(checked)["data"]["accepted"] and read == text
    done = json.loads(ran)
    assert done["exit_code"] == 0 and done["data"]["stages"] == ["static"] and done["data"]["kind"] == "pair"
    assert json.loads(told)["data"]["judgements"] == done["data"]["judgements"]
    assert "Meshes pull" in explained


def test_what_lies_outside_stays_closed(tmp_path, commands_run_here):
    inside = tmp_path / "inside"
    inside.mkdir()
    (tmp_path / "secret.toml").write_text("model = 1", encoding="utf-8")
    (inside / "link.toml").symlink_to(tmp_path / "secret.toml")
    names = "../secret.toml", "/etc/passwd", "a/../../secret.toml", "link.toml", "", "x" * 200, "-o", "a\\..\\b", "\x00"
    for name in names:
        with pytest.raises(CaseError):
            place_in(inside, name)
    _, answers = asked(
        make_server(inside),
        ("read_case", {"name": "../secret.toml"}),
        ("write_case", {"name": "../new.toml", "text": "a = 1"}),
        ("write_case", {"name": "case.txt", "text": "a = 1"}),
        ("write_case", {"name": "case.toml", "text": 'a = "' + "x" * 10_000_000 + '"'}),
        ("run", {"name": "../secret.toml", "results": "out"}),
        ("results", {"folder_name": "/"}),
        ("new", {"kind": "--help", "name": "own.toml"}),
        ("explain", {"code": "-o"}),
    )
    assert all(error for _, error in answers)
    wanted = ["E-FILE"] * 6 + ["E-ARGUMENTS"] * 2
    assert all(f"[{code}]" in answer for code, (answer, _) in zip(wanted, answers, strict=True))
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["inside", "link.toml", "secret.toml"]


def test_refused_calls_say_what_is_needed_and_leave_nothing(tmp_path, commands_run_here):
    _, answers = asked(
        make_server(tmp_path),
        ("run", {}),
        ("check", {"name": 3}),
        ("run", {"name": "absent.toml", "results": "out"}),
        ("compare", {"first": "a", "second": "b", "output": "compared"}),
    )
    assert "[E-ARGUMENTS] run: " in answers[0][0] and "name is missing, results is missing" in answers[0][0]
    assert "texts: name, results, only (may be missing)" in answers[0][0] and "pydantic" not in answers[0][0]
    assert "name is no text" in answers[1][0] and "[E-FILE] name: " in answers[2][0]
    assert all(error for _, error in answers) and "no such results folder" in answers[3][0]
    assert not [*tmp_path.iterdir()]


def test_what_is_listed_can_be_read(tmp_path, commands_run_here):
    """Links that lead out of the folder, and names that no tool takes, are not listed."""
    folder = tmp_path / "inside"
    folder.mkdir()
    for place in (tmp_path, folder):
        (place / "results").mkdir()
        (place / "results" / "manifest.json").write_text("{}", encoding="utf-8")
        (place / "case.toml").write_text("format = 1", encoding="utf-8")
    (folder / "out.toml").symlink_to(tmp_path / "case.toml")
    (folder / "out").symlink_to(tmp_path / "results")
    (folder / "gone.toml").symlink_to(folder / "absent.toml")
    (folder / "ä.toml").write_text("format = 1", encoding="utf-8")
    (folder / ".case.toml").write_text("format = 1", encoding="utf-8")
    (folder / "same.toml").symlink_to("case.toml")
    _, ((listed, error),) = asked(make_server(folder), ("list_files", {}))
    names = "case.toml", "results", "same.toml"
    assert not error and listed == "".join(names)
    _, answers = asked(make_server(folder), *(("read_case", {"name": name}) for name in (names[0], names[2])))
    assert [(text, error) for text, error in answers] == [("format = 1", False)] * 2


def test_refusals_of_new_and_explain_are_refusals_of_the_tool(tmp_path, commands_run_here):
    """They name what the tool has: no option of the command line."""
    (tmp_path / "own.toml").write_text("format = 1", encoding="utf-8")
    _, answers = asked(
        make_server(tmp_path),
        ("new", {"kind": "pair", "name": "own.toml"}),
        ("new", {"kind": "nonsense", "name": "other.toml"}),
        ("new", {"kind": "pair", "name": "other"}),
        ("explain", {"code": "W-PULLL"}),
        ("results", {"folder_name": "absent"}),
    )
    assert all(error for _, error in answers)
    words = "write_case replaces", "planetary, pair", "end in .toml", "W-PULL or", "no such results folder"
    assert all(word in text for word, (text, _) in zip(words, answers, strict=True))
    assert not any("--" in text or " -o" in text for text, _ in answers)
    assert (tmp_path / "own.toml").read_text(encoding="utf-8") == "format = 1" and len([*tmp_path.iterdir()]) == 1


def test_the_kinds_of_new_are_those_of_the_command(tmp_path):
    tools = asyncio.run(make_server(tmp_path).list_tools())
    (told,) = (tool.description for tool in tools if tool.name == "new")
    assert told.endswith(f"Kinds: {', '.join(KINDS)}.")
    text = SKILL.read_text(encoding="utf-8")
    assert all(f"`{kind}`" in text for kind in KINDS)


def test_case_files_may_not_name_files_outside():
    for text in ('file = "/etc/passwd"', '[a]\nb = ["../x.op2"]', 'c = "C:\\\\x"', 'd = "~/x"', 'e = "a/../../b"'):
        with pytest.raises(CaseError, match="outside"):
            check_text(text)
    check_text('title = "1/2 of a set"\nfile = "casing.npz"')
    with pytest.raises(CaseError, match="too long"):
        check_text("#" * (MOST_TEXT + 1))
    with pytest.raises(CaseError, match="no TOML"):
        check_text("a = ")


def test_commands_have_exit_code_data_and_messages(tmp_path):
    done = command(tmp_path, "check", "absent.toml", "--json")
    assert done["exit_code"] == 2 and not done["data"]["accepted"] and "E-FILE" in done["data"]["refusal"]
    assert "Meshes pull" in command(tmp_path, "explain", "W-PULL")["data"]


@pytest.mark.slow
def test_the_server_talks_on_standard_input_and_output(tmp_path):
    from mcp import StdioServerParameters

    server = StdioServerParameters(command=sys.executable, args=["-m", "femgear", "mcp", str(tmp_path)])
    tools, ((answer, error),) = asked(server, ("new", {"kind": "pair", "name": "own.toml"}))
    assert tools == TOOLS and not error and json.loads(answer)["exit_code"] == 0 and (tmp_path / "own.toml").exists()


def test_the_skill_names_tools_that_there_are(capsys):
    assert main(["skill"]) == 0
    text = capsys.readouterr().out
    assert text == SKILL.read_text(encoding="utf-8")
    assert all(f"`{name}`" in text for name in ("new", "read_case", "write_case", "check", "run", "compare", "explain"))
    assert main(["mcp", "no/such/folder"]) == 2


def test_a_case_file_that_is_too_long_is_not_read_in_part(tmp_path):
    (tmp_path / "long.toml").write_text(f'title = "{"x" * MOST_TEXT}"')
    _, ((answer, error),) = asked(make_server(tmp_path), ("read_case", {"name": "long.toml"}))
    assert error and "the case file is too long" in answer and len(answer) < 300


def test_a_cancelled_call_ends_its_process(tmp_path, monkeypatch):
    """A process that would take a minute, whose end is waited for."""
    from mcp import Client

    monkeypatch.setattr(assistant, "LONGEST_RUN", 60.0)
    ended, begun, real = threading.Event(), threading.Event(), assistant._run_until_cancelled

    def sleep(_, folder):
        begun.set()
        done = real([sys.executable, "-c", "import time; time.sleep(60)"], folder)
        if done.returncode != 0:
            ended.set()
        return done

    monkeypatch.setattr(assistant, "_run_until_cancelled", sleep)

    async def cancel():
        async with Client(make_server(tmp_path)) as client:
            call = asyncio.create_task(client.call_tool("explain", {"code": "E-UNIT"}))
            assert await asyncio.to_thread(begun.wait, 30)
            call.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await call
            return await asyncio.to_thread(ended.wait, 30)

    assert asyncio.run(cancel())


def test_a_command_that_does_not_end_when_it_is_asked_to_is_killed(tmp_path, monkeypatch):
    cancelled, place = threading.Event(), tmp_path / "begun"
    monkeypatch.setattr(assistant, "_ENDS_WITHIN", 0.5)
    deaf = "import pathlib, signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN)"
    begin = f"pathlib.Path({str(place)!r}).touch()"

    def cancel_when_begun():
        while not place.exists():
            time.sleep(0.05)
        cancelled.set()

    token = assistant._CANCELLED.set(cancelled)
    try:
        threading.Thread(target=cancel_when_begun, daemon=True).start()
        with pytest.raises(subprocess.TimeoutExpired):
            assistant._run_until_cancelled([sys.executable, "-c", f"{deaf}; {begin}; time.sleep(60)"], tmp_path)
    finally:
        assistant._CANCELLED.reset(token)
