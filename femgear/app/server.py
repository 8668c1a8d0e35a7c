"""The server of the app: a page for this machine alone, behind a token, with what it shows beside its own widgets."""

from __future__ import annotations

import secrets
import socket
import webbrowser
from collections.abc import Awaitable, Callable, MutableMapping
from html import escape
from http.cookies import SimpleCookie
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs

import uvicorn
from fastapi import FastAPI
from fastapi.responses import FileResponse, HTMLResponse, Response
from nicegui import ui

from femgear.app.form import page_in_window
from femgear.app.session import Session
from femgear.app.window import Window
from femgear.assistant import place_in
from femgear.errors import CaseError

HOST = "127.0.0.1"
_COOKIE = "femgear"
_WEB = Path(__file__).parent / "web"
_SHOWN = {".html", ".wav", ".png", ".csv"}
"""Files of results that the browser may read."""
_Scope = MutableMapping[str, Any]


class Guard:
    """Lets in who has the token, over a name of this machine; nobody else, whatever page they have open.

    Parameters
    ----------
    app : ASGI application
    token : str
        In the address with which the window is opened, and then in a cookie of this site.
    hosts : set of str
        Names and ports by which the browser may call this machine.
    """

    def __init__(self, app: Callable[..., Awaitable[None]], token: str, hosts: set[str]) -> None:
        self._app, self._token, self._hosts = app, token, hosts

    async def __call__(self, scope: _Scope, receive: Any, send: Any) -> None:
        """Pass a request on, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = {name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]}
        origin = headers.get("origin")
        known_host = headers.get("host") in self._hosts and (origin is None or origin.split("//")[-1] in self._hosts)
        cookie = SimpleCookie(headers.get("cookie", "")).get(_COOKIE)
        given = parse_qs(scope.get("query_string", b"").decode("latin-1")).get("token", [""])[0]
        if known_host and cookie is not None and secrets.compare_digest(cookie.value, self._token):
            await self._app(scope, receive, send)
        elif known_host and scope["type"] == "http" and secrets.compare_digest(given, self._token):
            value = f"{_COOKIE}={self._token}; HttpOnly; SameSite=Strict; Path=/"
            await _respond(send, 303, b"", [(b"location", b"/"), (b"set-cookie", value.encode())])
        elif scope["type"] == "websocket":
            await receive()
            await send({"type": "websocket.close", "code": 4403})
        else:
            text = b"Open the address that femgear app has printed: it holds the key to this window."
            await _respond(send, 403, text, [])


async def _respond(send: Any, status: int, text: bytes, headers: list[tuple[bytes, bytes]]) -> None:
    start = {"type": "http.response.start", "status": status, "headers": [(b"content-type", b"text/plain"), *headers]}
    await send(start)
    await send({"type": "http.response.body", "body": text})


def answers_page() -> str:
    """Make the page within the window on which answers appear; it draws what is sent to it."""
    from femgear.report.page import POINTER, document, part_of

    caption = "Gears, shafts, bearings, sensors (red) and feet (black)."
    part = f'<template id="part">{part_of("solid").format(escape(caption), POINTER)}</template>\n'
    style = f"<style>{(_WEB / 'live.css').read_text('utf-8')}</style>\n"
    main = f"{style}{part}{(_WEB / 'live.html').read_text('utf-8')}"
    script = (_WEB / "live.js").read_text("utf-8")
    return document("Answers", main, {"charts": {}, "space": None}, script=script)


def make_app(folder: Path, cache: Path | None) -> FastAPI:
    """Make the application of a folder of case files, without its guard.

    Parameters
    ----------
    folder : path
        Of case files and results: nothing outside is read or written.
    cache : path, optional
        Folder of generated grids.
    """
    application = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    page = answers_page()
    sessions = list[Session]()

    @application.get("/answers", response_class=HTMLResponse)
    def answers() -> str:
        return page

    @application.get("/results/{name:path}", response_model=None)
    def results(name: str) -> Response:
        path = place_in(folder, name)
        if path.suffix not in _SHOWN or not path.is_file():
            raise CaseError("there is no such file", code="E-FILE", key="name", value=name[:100])
        if path.suffix == ".html":
            return HTMLResponse(page_in_window(path.read_text("utf-8")))
        return FileResponse(path)

    @application.exception_handler(CaseError)
    def refused(request: Any, error: CaseError) -> HTMLResponse:
        return HTMLResponse(f"<pre>{escape(str(error))}</pre>", status_code=404)

    async def window() -> None:
        await Window(folder, cache, sessions).build()

    settings: Any = {"title": "femgear", "language": "en-US", "dark": None, "show_welcome_message": False}
    ui.run_with(application, root=window, reconnect_timeout=30.0, **settings)
    return application


def serve(folder: Path, cache: Path | None, *, port: int = 0, browser: bool = True) -> None:
    """Serve the app of a folder until it is interrupted, and print the address to open.

    Parameters
    ----------
    folder : path
    cache : path, optional
        Folder of generated grids.
    port : int
        Of this machine; 0 takes a free one.
    browser : bool
        Whether a browser is opened.
    """
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    listening.bind((HOST, port))
    listening.listen()
    port = listening.getsockname()[1]
    token = secrets.token_urlsafe(24)
    address = f"http://{HOST}:{port}/?token={token}"
    hosts = {f"{name}:{port}" for name in (HOST, "localhost")}
    guarded = Guard(make_app(folder.resolve(), cache), token, hosts)
    print(f"femgear app: {address}", flush=True)
    print("It serves this machine alone. End it with Ctrl-C; what was edited stays.", flush=True)
    if browser:
        webbrowser.open(address)
    server = uvicorn.Server(uvicorn.Config(guarded, log_level="warning", lifespan="on"))
    server.run(sockets=[listening])
