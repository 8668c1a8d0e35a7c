"""Commands that explain, and those that serve the app and assistants."""

from __future__ import annotations

from pathlib import Path

from femgear.commands.program import app
from femgear.commands.terminal import say
from femgear.errors import CaseError, nvh_library


@app.command
def explain(code: str, /) -> int:
    """Say what the code of a refusal or a warning means, as in "femgear explain W-PULL".

    Parameters
    ----------
    code
        The code, as messages have it in square brackets.
    """
    from difflib import get_close_matches

    from femgear.errors import CODES
    from femgear.findings import CATALOGUE, DOUBT, FAULT, NOTE

    severities = {
        NOTE: "worth knowing",
        DOUBT: "a number may be wrong, and is marked where it stands",
        FAULT: "nothing real carries that",
    }
    name = code.strip().strip("[]").upper()
    if name in CATALOGUE:
        meaning = CATALOGUE[name]
        say(f"{name}, {meaning.words}: {meaning.sentence}")
        say(f"A warning, which ends nothing. Severity: {meaning.severity}, {severities[meaning.severity]}.")
        say(f"What to do: {meaning.advice}")
        say("The warning of a run has its numbers, and names the entry of the case file that it concerns.")
    elif name in CODES:
        say(f"{name}: {CODES[name]}")
        say("A refusal: nothing was computed. Its message has entry, value, limit and remedy.")
    else:
        near = get_close_matches(name, [*CODES, *CATALOGUE], n=3)
        raise CaseError(
            "there is no such code",
            code="E-ARGUMENTS",
            key="code",
            value=code,
            limit="the codes of docs/errors.md",
            remedy=f"meant is perhaps {' or '.join(near)}" if near else "take it from the message, as W-PULL",
        )
    return 0


@app.command
def schema(*, model: str | None = None) -> int:
    """Print the JSON schema of the case file, for editors.

    Parameters
    ----------
    model
        Of the case files that name this model.
    """
    import json

    from femgear.trains.reading import case_schema

    print(json.dumps(case_schema(model), indent=1))
    return 0


@app.command
def skill() -> int:
    """Print a text that teaches an assistant how to write case files and how to read results."""
    from femgear.assistant import SKILL

    print(SKILL.read_text(encoding="utf-8"), end="")
    return 0


@app.command
def mcp(folder: Path = Path(), /) -> int:
    """Serve assistants by the Model Context Protocol on standard input and output, inside of one folder.

    Parameters
    ----------
    folder
        Folder of the case files and results that the assistant may read and write.
    """
    from femgear.assistant import make_server

    if not folder.is_dir():
        raise CaseError("there is no such folder", code="E-FILE", key="folder", value=str(folder), limit="a folder")
    make_server(folder.resolve()).run()
    return 0


@app.command(name="app")
def open_app(folder: Path = Path(), /, *, port: int = 0, browser: bool = True) -> int:
    """Open the app: a window in the browser with form, sliders, answers while you drag, runs and their reports.

    It serves only this machine, and reads and writes only case files and results of one folder.

    Parameters
    ----------
    folder
        Folder of case files and results.
    port
        Port of this machine. Default: a free one.
    browser
        Open the window in the browser; without it only the address is printed.
    """
    from femgear.run import grid_cache

    if not folder.is_dir():
        raise CaseError("there is no such folder", code="E-FILE", key="folder", value=str(folder), limit="a folder")
    with nvh_library("the app", "app"):
        from femgear.app.server import serve
    serve(folder.resolve(), grid_cache(), port=port, browser=browser)
    return 0
