"""What the command line prints: any encoding, closed and full streams, names with control characters."""

import contextlib
import importlib
import io
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
import script_tools

from femgear import cli
from femgear import run as run_module
from femgear.commands import terminal
from femgear.errors import CaseError, StorageError
from femgear.findings import Finding
from femgear.report.tables import Block
from femgear.storage.files import checked_name
from femgear.trains.reading import open_results, read_case

pytestmark = pytest.mark.usefixtures("pictures_undrawn")

CASE = Path(__file__).parents[1] / "cases" / "planetary_27_40_108.toml"
TEXT = CASE.read_text(encoding="utf-8")
TITLE = "Prüfstand 3: Ω ≈ 2 µm ½"
HOSTILE = "a\x1b[31m\n\u202eb\udcff"
ESCAPED = r"a\x1b[31m\n\u202eb\udcff"


@pytest.fixture
def titled(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(TEXT.replace("Planetary set 27/40/108", TITLE), encoding="utf-8")
    return path


def printed_in(encoding: str, monkeypatch, command) -> tuple[int, str, str]:
    """Exit code and what a command writes to standard output and error of an encoding."""
    streams = [io.TextIOWrapper(io.BytesIO(), encoding=encoding) for _ in range(2)]
    with monkeypatch.context() as patch:
        patch.setattr(sys, "stdout", streams[0])
        patch.setattr(sys, "stderr", streams[1])
        code = command()
    return code, *(stream.buffer.getvalue().decode(encoding) for stream in streams)


def _nothing(*_, progress, **__):
    progress("static ±", 1, 1)
    found = SimpleNamespace(
        points=(), computed=0, errors=(), keys=("sun.teeth",), quantities=(), values=(), codes=lambda _: ""
    )
    return found, ["±.csv"]


@pytest.mark.parametrize(
    ("encoding", "title"),
    [
        ("ascii", r"Pr\xfcfstand 3: \u03a9 \u2248 2 \xb5m \xbd"),
        ("latin-1", r"Prüfstand 3: \u03a9 \u2248 2 µm ½"),
        ("utf-8", TITLE),
    ],
)
def test_what_an_encoding_lacks_is_escaped(titled, tmp_path, monkeypatch, encoding, title):
    monkeypatch.setattr(importlib.import_module("femgear.study.sweep"), "sweep_into", _nothing)
    monkeypatch.setattr(run_module, "report_again", lambda folder, **_: None)
    code, out, err = printed_in(encoding, monkeypatch, lambda: cli.main(["check", str(titled)]))
    assert (code, err) == (0, "") and title in out
    assert ("─" in out) == (encoding == "utf-8")  # borders of tables are not escaped but drawn otherwise
    for command in (
        ["sweep", str(titled), "-o", str(tmp_path / "Ω"), "--over", "sun.teeth=27"],
        ["report", str(tmp_path / "Ω")],
    ):
        code, out, _ = printed_in(encoding, monkeypatch, lambda command=command: cli.main(command))
        assert code == 0 and ("Ω" if encoding == "utf-8" else r"\u03a9") in out
    code, out, err = printed_in(encoding, monkeypatch, lambda: cli.main(["check", "Ω.toml"]))
    assert code == 2 and out == "" and "E-FILE" in err and ("Ω" in err) == (encoding == "utf-8")
    assert printed_in(encoding, monkeypatch, lambda: cli.main(["schema"]))[0] == 0

    def script():
        script_tools.print_table("Ω", ["½"], [["ζ"]])

    code, out, _ = printed_in(encoding, monkeypatch, lambda: script_tools.run_script(script, arguments=[]))
    assert code == 0 and ("ζ" if encoding == "utf-8" else r"\u03b6") in out


def started(*arguments, shell: str = "") -> subprocess.CompletedProcess:
    """Run the program by a shell that redirects its streams; `code` is its exit code."""
    line = f'("$@"; echo "code $?" >&3) 3>&2 {shell}'
    return subprocess.run(
        ["bash", "-c", line, "bash", sys.executable, "-m", "femgear.cli", *arguments],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


FULL = r"\[E-DISK-FULL\] standard output: (?s:.*)remedy:  free some space where it goes, or send it elsewhere\n"


@pytest.mark.parametrize(
    ("redirected", "arguments", "code", "words"),
    [
        (">&-", ["schema"], 0, ""),
        (">&- 2>&-", ["check", "absent.toml"], 2, ""),
        (">/dev/full", ["schema"], 4, FULL),
        (">/dev/full", ["check", "absent.toml"], 2, "E-FILE"),
        ("2>/dev/full", ["check", "absent.toml"], 2, ""),
        ("| true", ["schema"], 0, ""),
        pytest.param("| true", ["--help"], 0, "", marks=pytest.mark.slow),
        ("2>&1 | true", ["check", "absent.toml"], 2, ""),
    ],
)
def test_streams_that_cannot_be_written(redirected, arguments, code, words):
    """A reader that has gone is no failure; a full disk is, unless the program has one of its own."""
    run = started(*arguments, shell=redirected)
    assert f"code {code}\n" in run.stderr and re.search(words, run.stderr)
    assert not any(word in run.stderr for word in ("Traceback", "Exception ignored", "Error:"))


def test_a_full_standard_error_does_not_stop_a_run(monkeypatch):
    class Full(io.StringIO):
        def write(self, text):
            raise OSError(28, "No space left on device")

    done = []

    def work():
        with terminal.Progress() as progress:
            progress("static", 0, 1)
            done.append("computed")

    monkeypatch.setattr(sys, "stderr", Full())
    assert script_tools.run_script(work, arguments=[]) == 0 and done == ["computed"]


# --- control characters ------------------------------------------------------------------------------


def test_names_with_control_characters_are_escaped(tmp_path, capsys):
    folder = tmp_path / HOSTILE
    folder.mkdir()
    path = folder / "case.toml"
    path.write_text(TEXT.replace("teeth = 27", 'teeth = 27\n"k\\u001b\\u202e" = "v\\u001b"'), encoding="utf-8")
    assert cli.main(["check", str(path)]) == 2
    err = capsys.readouterr().err
    assert len(err.splitlines()) == 2 and "\x1b" not in err and "\u202e" not in err
    assert f"{ESCAPED}/case.toml:" in err and r"sun.k\x1b\u202e: unknown key" in err
    assert cli.main(["check", HOSTILE]) == 2
    assert capsys.readouterr().err.startswith(f"[E-FILE] {ESCAPED}: ")
    assert cli.main(["run", str(CASE), "-o", HOSTILE]) == 4
    err = capsys.readouterr().err
    assert f"found:   '{ESCAPED}'" in err and "\x1b" not in err


def test_every_part_of_a_message_is_one_line_without_control_characters():
    error = CaseError(HOSTILE, code="E-CASE", key=HOSTILE, value=[HOSTILE], limit=HOSTILE, remedy=HOSTILE, file=HOSTILE)
    assert len(str(error).splitlines()) == 4 and str(error).count(ESCAPED) == 6
    assert str(Finding("W-TIP", HOSTILE, HOSTILE, remedy=HOSTILE)).count(ESCAPED) == 3


def test_tables_show_control_characters_as_escapes(capsys):
    terminal.print_blocks([Block(HOSTILE, ("a", "b"), ((HOSTILE, "1"),), (HOSTILE,))])
    out = capsys.readouterr().out
    assert out.count(ESCAPED) == 3 and "\x1b" not in out


def test_a_case_in_a_folder_with_an_unusual_blank_finds_its_profile(tmp_path):
    folder = tmp_path / "a\u00a0b"
    folder.mkdir()
    (folder / "p.csv").write_text("diameter [mm],deviation [um]\n40,0\n44,0\n", encoding="utf-8")
    measured = '\n[[sun.modifications]]\nkind = "measured profile"\nfile = "p.csv"\n'
    (folder / "case.toml").write_text(TEXT + measured, encoding="utf-8")
    assert read_case(folder / "case.toml").profile_files == {"sun.modifications[0]": "p.csv"}


# --- names of folders ----------------------------------------------------------------------------------

NAMES = ("Prüfstand 3", "歯車 1", "दाँत", "run_3-b (new)", "a.b", "ä" * 100, "condor", "com10x")
WRONG_NAMES = (
    "",
    "a\x1b",
    "a\nb",
    "a/b",
    "a\\b",
    "a:b",
    "a*",
    "a?",
    'a"b',
    "<a",
    "a>",
    "a|b",
    ".a",
    "a.",
    " a",
    "a ",
    "..",
    "con",
    "NUL.txt",
    "Com1",
    "lpt²",
    "nul .txt",
    "a" * 101,
    "歯" * 81,
    "u\u0308",
    "a\u202eb",
    "\udcff",
    "a\u00a0b",
)


def test_folders_have_names_that_every_file_system_takes(tmp_path):
    for name in NAMES:
        assert checked_name(name) == name
        (tmp_path / name).mkdir()
    for name in WRONG_NAMES:
        with pytest.raises(StorageError) as caught:
            checked_name(name)
        assert caught.value.code == "E-CHOICE" and caught.value.limit and caught.value.remedy


def test_links_that_lead_nowhere_are_no_folders(tmp_path, capsys):
    for name, target in (("loop", "loop"), ("dangling", "absent")):
        (tmp_path / name).symlink_to(tmp_path / target)
        assert cli.main(["run", str(CASE), "-o", str(tmp_path / name)]) == 4
        err = capsys.readouterr().err
        assert "[E-STORAGE]" in err and "remedy:" in err


def test_a_run_into_a_folder_with_umlaut_and_blank(tmp_path, capsys):
    out = tmp_path / "Prüfstand 3"
    case = Path(__file__).parents[1] / "cases" / "four_stage_reducer.toml"
    assert cli.main(["run", str(case), "-o", str(out), "--only", "modes", "--no-pictures"]) == 0
    assert f"results: {out}\n" in capsys.readouterr().out and open_results(out).stages == ("deflection", "modes")


def test_an_interrupt_while_a_script_loads_its_libraries_is_told_as_such(monkeypatch, capsys):
    """The limit of BLAS threads is what a script loads first."""

    @contextlib.contextmanager
    def interrupted():
        raise KeyboardInterrupt
        yield

    def script(*, wide: bool = False) -> None:
        """Compute nothing."""

    monkeypatch.setattr("femgear.stages.protocol.one_blas_thread", interrupted)
    assert script_tools.run_script(script, arguments=["--wide"]) == 130
    assert capsys.readouterr().err == "interrupted\n"
