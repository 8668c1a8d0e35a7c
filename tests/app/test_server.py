"""Who is let in, and what the browser may read."""

import asyncio
from importlib.util import find_spec

import pytest

# it is loaded where a test needs it: by one of the workers of pytest
pytestmark = pytest.mark.skipif(find_spec("nicegui") is None, reason="an extra of the package")

HOSTS = {"127.0.0.1:80"}


def answer(kind="http", query="", **headers):
    """What a request with these headers gets: the status, or the code of a closed socket; 0 where it is let in."""
    from femgear.app.server import Guard

    sent = []

    async def inside(scope, receive, send):
        sent.append({"status": 0})

    async def send(message):
        sent.append(message)

    async def receive():
        return {"type": "websocket.connect"}

    scope = {"type": kind, "query_string": query.encode()}
    scope["headers"] = [(name.encode(), value.encode()) for name, value in headers.items()]
    asyncio.run(Guard(inside, "secret", HOSTS)(scope, receive, send))
    return sent[0].get("status", sent[0].get("code")), sent


OWN = {"host": "127.0.0.1:80", "cookie": "femgear=secret; other=1"}


@pytest.mark.parametrize("kind", ("http", "websocket"))
def test_who_has_the_key_is_let_in(kind):
    assert answer(kind, **OWN)[0] == 0
    assert answer(kind, **OWN, origin="http://127.0.0.1:80")[0] == 0
    refused = 403 if kind == "http" else 4403
    for others in (
        {"host": "127.0.0.1:80"},
        OWN | {"cookie": "femgear=secre"},
        OWN | {"cookie": "other=secret"},
        OWN | {"host": "attacker.example"},
        OWN | {"origin": "http://attacker.example"},
        {"cookie": OWN["cookie"]},
    ):
        assert answer(kind, **others)[0] == refused
    assert answer("lifespan")[0] == 0


def test_the_address_gives_the_key_once():
    status, sent = answer(query="token=secret", host="127.0.0.1:80")
    headers = dict(sent[0]["headers"])
    assert status == 303 and headers[b"location"] == b"/" and b"HttpOnly; SameSite=Strict" in headers[b"set-cookie"]
    assert answer(query="token=other", host="127.0.0.1:80")[0] == 403
    assert answer(query="token=secret", host="attacker.example")[0] == 403
    assert answer("websocket", query="token=secret", host="127.0.0.1:80")[0] == 4403


def test_answers_are_drawn_by_scripts_of_the_page_alone():
    from femgear.app.server import answers_page

    page = answers_page()
    policy = page.split('Content-Security-Policy" content="')[1].split('"')[0]
    assert policy.startswith("default-src 'none'") and "unsafe-eval" not in policy and "http" not in policy
    later = page.count('class="later">')
    assert policy.count("sha256-") == page.count("<script>") + later and page.count("<script>") == 1
    assert 'id="cards"' in page
