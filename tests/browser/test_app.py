"""The app in Chromium, with mouse and keyboard."""

import re
import signal
import socket
import subprocess
import sys
import tomllib
import urllib.error
import urllib.request
from pathlib import Path

import pytest

pytest.importorskip("playwright", reason="make test-browser installs it")
pytest.importorskip("nicegui", reason="an extra of the package")
pytestmark = pytest.mark.browser
CASES = Path(__file__).parents[2] / "cases"
WAIT = 60_000
"""Longest wait on a slow machine [ms]."""
HOSTILE = '"><img src=x onerror=window.broken=1> 5\\u202e N m'


def coarse_case() -> str:
    """The reference set on coarse grids, at one speed and without published lines."""
    text = (CASES / "planetary_27_40_108.toml").read_text()
    text = text[: text.index("# What the paper reports")]
    text = text.replace('speeds = ["250 rpm", "3100 rpm"]', 'speeds = ["1000 rpm"]')
    for name, value in {"flank_elements": "4", "positions": "8", "up_to": '"6 kHz"'}.items():
        text = re.sub(rf"^(# )?{name} = .*$", f"{name} = {value}", text, flags=re.MULTILINE)
    return text


class Served:
    """A server of the app in a folder, and its address."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        command = [sys.executable, "-m", "femgear", "app", str(folder), "--no-browser"]
        self.log = folder.with_name(f"{folder.name}.log")
        with open(self.log, "w", encoding="utf-8") as log:
            self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, text=True)
        self.address = re.search(r"http://127\.0\.0\.1:\d+/\?token=\S+", self.process.stdout.readline())[0]

    def end(self, signal_sent: signal.Signals = signal.SIGINT) -> None:
        """End it as a user or as the system does."""
        self.process.send_signal(signal_sent)
        self.process.wait(20)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "set.toml").write_text(coarse_case())
    return tmp_path


@pytest.fixture
def serve():
    """Start servers, which end with the test."""
    servers = []

    def start(place: Path) -> Served:
        servers.append(Served(place))
        return servers[-1]

    yield start
    for server in servers:
        if server.process.poll() is None:
            server.end()


@pytest.fixture
def window(chromium):
    """Open windows of the app; nothing fails in them, and nothing is asked of another machine."""
    contexts, faults = [], []

    def show(server: Served, **options):
        context = chromium.new_context(viewport={"width": 1500, "height": 950}, reduced_motion="reduce", **options)
        contexts.append(context)
        tab = context.new_page()
        tab.set_default_timeout(WAIT)
        tab.on("pageerror", lambda error: faults.append(str(error)))
        tab.on("request", lambda asked: faults.append(asked.url) if not asked.url.startswith(allowed(server)) else None)
        tab.goto(server.address)
        return tab

    yield show
    for context in contexts:
        context.close()
    assert faults == []


def allowed(server: Served) -> tuple[str, ...]:
    place = server.address.split("//")[1].split("/")[0]
    return f"http://{place}/", f"ws://{place}/", "data:", "blob:"


def answers(tab):
    return tab.frame_locator("iframe.answers")


def answer_to(tab, act=None) -> str:
    """Do something, wait for the answer to it, and give the first line of every card."""
    frame = next(frame for frame in tab.frames if frame.url.endswith("/answers")) if act else None
    if act:
        frame.evaluate("document.getElementById('state').textContent = 'waits'")
        act()
    answers(tab).locator("#state", has_text=re.compile("^computed")).wait_for()
    return "\n".join(answers(tab).locator(".card .answer").all_inner_texts())


def unfold(tab, name: str) -> None:
    tab.locator(".q-expansion-item .q-item__label", has_text=re.compile(rf"^{name}( \(\d+\))?$")).first.click()


def field(tab, key: str):
    return tab.locator(f'input[data-key="{key}"], [data-key="{key}"] input').first


def said(tab):
    return tab.locator(".said")


def press(tab, name: str) -> None:
    tab.get_by_role("button", name=name, exact=True).click()


def saved(tab, folder: Path) -> dict:
    press(tab, "Save")
    tab.get_by_text("saved", exact=True).wait_for()
    return tomllib.loads((folder / "set.toml").read_text())


def test_a_field_changes_the_answers_and_the_file_alone(window, serve, folder):
    tab = window(serve(folder))
    before = answer_to(tab)
    unfold(tab, "operation")
    after = answer_to(tab, lambda: field(tab, "operation.torque").fill("150 N m"))
    assert before != after and "transmission error" in after
    assert (folder / "set.toml").read_text() == coarse_case(), "the file changes when it is saved"
    assert saved(tab, folder)["operation"]["torque"] == "150 N m"
    assert (folder / "set.toml").read_text() == coarse_case().replace('torque = "100 N m"', 'torque = "150 N m"')
    answer_to(tab, lambda: press(tab, "Undo"))
    assert saved(tab, folder)["operation"]["torque"] == "100 N m"


@pytest.mark.parametrize("typed", (HOSTILE, "1e999 N m", "[[]]", "100 Nm; rm", "5 mm"))
def test_what_cannot_be_is_refused_beside_its_field(window, serve, folder, typed):
    tab = window(serve(folder))
    answer_to(tab)
    unfold(tab, "operation")
    field(tab, "operation.torque").fill(typed)
    tab.locator(".q-field--error", has_text=re.compile("E-")).first.wait_for()
    assert said(tab).filter(has_text="operation.torque").count() == 1
    assert tab.evaluate("window.broken") is None
    answer_to(tab, lambda: field(tab, "operation.torque").fill("100 N m"))
    assert tab.locator(".q-field--error").count() == 0 and said(tab).filter(has_text="operation.torque").count() == 0


def test_sliders_move_with_mouse_and_keys(window, serve, folder):
    tab = window(serve(folder))
    before = answer_to(tab)
    slider = tab.locator('[data-slider="operation.torque"]')
    box = slider.bounding_box()
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]

    def drag():
        tab.mouse.move(x, y)
        tab.mouse.down()
        for step in range(1, 11):
            tab.mouse.move(x + 0.02 * step * box["width"], y)
            tab.wait_for_timeout(30)
        tab.mouse.up()

    dragged = answer_to(tab, drag)
    assert dragged != before
    torque = saved(tab, folder)["operation"]["torque"]
    assert torque.endswith(" N m") and 125 < float(torque.split()[0]) < 155
    slider = tab.locator('[data-slider="operation.torque"]')
    slider.locator("[tabindex='0']").focus()
    answer_to(tab, lambda: tab.keyboard.press("ArrowLeft"))
    assert float(saved(tab, folder)["operation"]["torque"].split()[0]) < float(torque.split()[0])


def place_of(tab, key: str) -> float:
    return float(tab.locator(f'[data-slider="{key}"]').get_attribute("aria-valuenow"))


def test_field_text_and_slider_are_one_value(window, serve, folder):
    tab = window(serve(folder))
    answer_to(tab)
    unfold(tab, "operation")
    torque, speed = "operation.torque", "operation.speeds[0]"
    field(tab, torque).click()
    tab.keyboard.press("Control+A")
    answer_to(tab, lambda: tab.keyboard.type("150 N m"))
    assert place_of(tab, torque) == 150.0
    # the slider of a speed, by the mouse: fields follow while it is held
    box = tab.locator(f'[data-slider="{speed}"]').bounding_box()
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
    tab.mouse.move(x, y)
    tab.mouse.down()
    for step in range(1, 11):
        tab.mouse.move(x + 0.02 * step * box["width"], y)
        tab.wait_for_timeout(30)
    tab.wait_for_function("() => parseFloat(document.querySelector('[data-key=\"operation.speeds\"]').value) > 1250")
    tab.mouse.move(x - 0.25 * box["width"], y)
    tab.wait_for_function("() => parseFloat(document.querySelector('[data-key=\"operation.speeds\"]').value) < 750")
    answer_to(tab, tab.mouse.up)
    held = place_of(tab, speed)
    assert field(tab, "operation.speeds").input_value() == f"{held:g} rpm" and held < 750
    # the text
    tab.get_by_role("tab", name="Text").click()
    line = tab.locator(".cm-line", has_text="150 N m")
    tab.locator(".cm-content").hover()
    for _ in range(50):  # lines out of sight are not drawn
        if line.count():
            break
        tab.mouse.wheel(0, 300)
        tab.wait_for_timeout(100)
    line.click()
    tab.keyboard.press("Home")
    tab.keyboard.press("Shift+End")
    # before what is left of the comment of the line
    answer_to(tab, lambda: tab.keyboard.type('torque = "250 N m"  # '))
    assert place_of(tab, torque) == 250.0
    tab.get_by_role("tab", name="Form").click()
    assert field(tab, torque).input_value() == "250 N m"
    operation = saved(tab, folder)["operation"]
    assert operation["torque"] == "250 N m" and operation["speeds"] == [f"{held:g} rpm"]


def test_a_list_grows_and_shrinks(window, serve, folder):
    tab = window(serve(folder))
    answer_to(tab)
    unfold(tab, "sun")
    unfold(tab, "modifications")
    press(tab, "Add modifications")
    field(tab, "sun.modifications[0].kind").wait_for()
    tab.locator(".more .q-item__label").last.click()
    field(tab, "sun.modifications[0].amount").fill("8 um")
    answer = answer_to(tab, lambda: field(tab, "sun.modifications[0].start_diameter").fill("43 mm"))
    assert "transmission error" in answer
    assert saved(tab, folder)["sun"]["modifications"][0]["amount"] == "8 um"
    tab.locator('[data-slider="sun.modifications[0].amount"]').wait_for(state="detached")
    tab.get_by_role("button", name="Remove modifications 1").click()
    field(tab, "sun.modifications[0].kind").wait_for(state="detached")
    assert "modifications" not in saved(tab, folder)["sun"]


def test_text_and_form_are_one(window, serve, folder):
    tab = window(serve(folder))
    answer_to(tab)
    tab.get_by_role("tab", name="Text").click()
    editor = tab.locator(".cm-content")
    editor.click()
    tab.keyboard.press("Control+End")
    tab.keyboard.type("\n[strength]\nquality = ")
    said(tab).filter(has_text="E-TOML").wait_for()
    answer_to(tab, lambda: tab.keyboard.type("6\n"))
    tab.get_by_role("tab", name="Form").click()
    unfold(tab, "strength")
    assert field(tab, "strength.quality").input_value() == "6"
    assert saved(tab, folder)["strength"] == {"quality": 6}


def test_a_new_set_is_made_without_a_file(window, serve, tmp_path):
    tab = window(serve(tmp_path))
    tab.get_by_text("New case", exact=True).wait_for()
    tab.get_by_label("Module").fill("2 mm")
    tab.get_by_label("Torque of sun or pinion").fill("200 N m")
    tab.get_by_label("Teeth").fill("17 37 91")
    press(tab, "Begin")
    answers(tab).locator(".card", has_text="S_F").wait_for()
    assert not (tmp_path / "planetary.toml").exists()
    press(tab, "Save")
    tab.get_by_text("saved", exact=True).wait_for()
    tables = tomllib.loads((tmp_path / "planetary.toml").read_text())
    assert tables["sun"]["teeth"] == 17 and tables["material"]["treatment"] == "case hardened steel"
    assert not list(tmp_path.glob(".*.draft"))


def test_all_that_is_wrong_with_a_new_case_stands_beside_its_fields(window, serve, folder):
    tab = window(serve(folder))
    press(tab, "New")
    dialog = tab.get_by_role("dialog")
    wrong = {"Name of the file": "set", "Teeth": "17 x 91", "Module": "2", "Speed of sun or pinion": "fast"}
    for label, text in wrong.items():
        dialog.get_by_label(label, exact=True).fill(text)
    press(tab, "Begin")
    marked = dialog.locator(".q-field--error")
    marked.first.wait_for()
    assert marked.count() == len(wrong) and "--" not in dialog.inner_text()
    tab.wait_for_timeout(7000)
    assert marked.count() == len(wrong), "mistakes stay until they are mended"
    dialog.get_by_label("Module", exact=True).fill("3 mm")
    marked.nth(len(wrong) - 1).wait_for(state="detached")
    for label, text in {"Name of the file": "own", "Teeth": "17 37 91", "Speed of sun or pinion": "900 rpm"}.items():
        dialog.get_by_label(label, exact=True).fill(text)
    answer_to(tab, lambda: press(tab, "Begin"))
    press(tab, "Save")
    tab.get_by_text("saved", exact=True).wait_for()
    assert tomllib.loads((folder / "own.toml").read_text())["operation"]["speeds"] == ["900 rpm"]


def test_a_run_is_computed_shown_and_compared(window, serve, tmp_path):
    folder = tmp_path
    pair = re.sub(r"^positions = .*$", "positions = 8", (CASES / "spur_pair.toml").read_text(), flags=re.MULTILINE)
    (folder / "set.toml").write_text(pair)
    tab = window(serve(folder))
    answer_to(tab)
    for number, face_width in enumerate(("22 mm", "30 mm"), start=1):
        tab.get_by_role("tab", name="Answers").click()
        unfold(tab, "set")
        answer_to(tab, lambda width=face_width: field(tab, "set.face_width").fill(width))
        unfold(tab, "set")
        press(tab, "Run")
        tab.get_by_role("dialog").get_by_role("button", name="Run").click()
        report = tab.frame_locator(f"iframe.report[src='/results/set_{number}/report.html']")
        report.locator(".sentence").wait_for(timeout=3 * WAIT)
        assert (folder / f"set_{number}" / "manifest.json").exists()
    tab.get_by_label("Compared with").click()
    tab.get_by_role("option", name="set_1").click()
    tab.keyboard.press("Escape")
    press(tab, "Compare")
    tab.frame_locator("iframe.report[src*='compare']").locator("table").first.wait_for()
    press(tab, "Export")
    tab.get_by_text("tables, CSV").click()
    tab.get_by_text("in set_2/exported").wait_for()
    assert list((folder / "set_2" / "exported").glob("*.csv"))


def test_a_run_is_cancelled(window, serve, folder):
    server = serve(folder)
    tab = window(server)
    answer_to(tab)
    press(tab, "Run")
    tab.get_by_role("dialog").get_by_role("button", name="Run").click()
    tab.get_by_role("dialog").wait_for(state="hidden")
    press(tab, "Cancel")
    tab.get_by_role("button", name="Cancel", exact=True).wait_for(state="hidden")
    tab.get_by_text("The run was cancelled").wait_for()
    assert server.log.read_text() == "femgear app: the run into set_1 was cancelled\n"
    assert not (folder / "set_1" / "report.html").exists()


def test_it_is_heard(window, serve, folder):
    tab = window(serve(folder))
    answer_to(tab)
    tab.get_by_text("Listen", exact=True).click()
    audio = tab.locator("audio")
    audio.wait_for(state="attached")
    tab.wait_for_function("() => document.querySelector('audio').currentTime > 0.1")
    assert audio.evaluate("(sound) => sound.loop && !sound.paused && sound.duration > 1")


def test_a_pair_becomes_a_gearbox_in_a_casing(window, serve, tmp_path):
    (tmp_path / "set.toml").write_text((CASES / "spur_pair.toml").read_text())
    tab = window(serve(tmp_path))
    field(tab, "title").wait_for()
    for words, name, fold in (
        ("As a gearbox", "set_gearbox", "shaft"),
        ("In a casing", "set_gearbox_in_casing", "sensor"),
    ):
        press(tab, "Gearbox")
        tab.get_by_text(words, exact=True).click()
        tab.locator(".q-expansion-item .q-item__label", has_text=re.compile(rf"^{fold} \(\d\)$")).wait_for()
        press(tab, "Save")
        tab.get_by_text("saved", exact=True).wait_for()
        assert tomllib.loads((tmp_path / f"{name}.toml").read_text())["model"] == "gearbox"
    assert len(tomllib.loads((tmp_path / "set_gearbox_in_casing.toml").read_text())["sensor"]) >= 2


def test_windows_do_not_mix(window, serve, folder):
    (folder / "other.toml").write_text(coarse_case().replace("100 N m", "60 N m"))
    server = serve(folder)
    first, second = window(server), window(server)
    answer_to(first), answer_to(second)
    unfold(first, "operation")
    second.get_by_label("Case").click()
    second.get_by_role("option", name="set.toml").click()
    assert field(first, "operation.torque").input_value() == "60 N m"
    changed = answer_to(first, lambda: field(first, "operation.torque").fill("70 N m"))
    assert answer_to(second) != changed
    unfold(second, "operation")
    assert field(second, "operation.torque").input_value() == "100 N m"


def type_torque(tab, torque: str) -> None:
    """Type a torque with the keyboard."""
    field(tab, "operation.torque").click()
    tab.keyboard.press("Control+A")
    tab.keyboard.type(torque)


def test_windows_of_one_file_know_of_each_other(window, serve, folder):
    server = serve(folder)
    first, second = window(server), window(server)
    for tab in (first, second):
        unfold(tab, "operation")
    type_torque(first, "150 N m")
    told = second.locator(".elsewhere")
    told.get_by_text("open in another window, with changes that are not saved").wait_for()
    assert field(second, "operation.torque").input_value() == "100 N m", "nothing is taken over without a word"
    press(second, "Take these changes")
    told.wait_for(state="hidden")
    assert field(second, "operation.torque").input_value() == "150 N m"
    type_torque(second, "120 N m")
    first.locator(".elsewhere").wait_for()
    press(first, "Keep what is here")
    first.locator(".elsewhere").wait_for(state="hidden")
    assert field(first, "operation.torque").input_value() == "150 N m"
    assert saved(second, folder)["operation"]["torque"] == "120 N m"
    first.get_by_text("was saved or removed by another window").wait_for()
    press(first, "Save")
    first.get_by_text("E-STORAGE").first.wait_for()
    assert tomllib.loads((folder / "set.toml").read_text())["operation"]["torque"] == "120 N m"
    press(first, "Take the saved file")
    first.locator(".elsewhere").wait_for(state="hidden")
    assert field(first, "operation.torque").input_value() == "120 N m"


def test_a_third_window_begins_with_the_saved_file_and_says_so(window, serve, folder):
    server = serve(folder)
    first = window(server)
    unfold(first, "operation")
    type_torque(first, "150 N m")
    first.get_by_text("not saved", exact=True).wait_for()
    second = window(server)
    told = second.locator(".elsewhere")
    told.wait_for()
    unfold(second, "operation")
    assert field(second, "operation.torque").input_value() == "100 N m"
    press(second, "Stay with the saved file")
    told.wait_for(state="hidden")
    # the page that is loaded again is the same window: it goes on with its changes
    first.wait_for_timeout(1000)
    first.reload()
    first.get_by_text("changes that were not saved are back").wait_for()
    unfold(first, "operation")
    assert field(first, "operation.torque").input_value() == "150 N m"
    assert first.locator(".elsewhere").is_hidden()


def test_an_answer_names_what_is_computed_and_for_how_long(window, serve, folder):
    tab = window(serve(folder))
    state, states = answers(tab).locator("#state"), []
    while not (states and states[-1].startswith("computed")):
        text = state.inner_text()
        if text and text not in states:
            states.append(text)
        tab.wait_for_timeout(20)
    steps = [text for text in states if text.startswith("computing: ")]
    assert any("contact" in text for text in steps) and any("modes" in text for text in steps), states
    assert all(text.startswith(("reading", "comput")) for text in states), states


def test_nothing_is_lost_with_the_server(window, serve, folder):
    server = serve(folder)
    tab = window(server)
    answer_to(tab)
    unfold(tab, "operation")
    answer_to(tab, lambda: field(tab, "operation.torque").fill("123 N m"))
    tab.wait_for_timeout(1500)
    server.end(signal.SIGKILL)
    assert (folder / "set.toml").read_text() == coarse_case()
    ended = tab.get_by_role("dialog", name="The app has ended")
    ended.wait_for()
    assert f"femgear app {folder}" in ended.inner_text() and "Nothing is lost" in ended.inner_text()
    (folder / "a_first_one.toml").write_text(coarse_case())
    again = window(serve(folder))
    again.get_by_text("changes that were not saved are back").wait_for()
    press(again, "Back to the file")
    again.get_by_text("saved", exact=True).wait_for()
    press(again, "Undo")
    # the file is that of the form once the undone change is back in it
    again.get_by_text("saved", exact=True).wait_for(state="hidden")
    assert saved(again, folder)["operation"]["torque"] == "123 N m"


def test_what_was_typed_as_the_server_ended_is_kept_or_shown(window, serve, folder):
    """Within the third of a second that a field waits for more keys, too."""
    server = serve(folder)
    tab = window(server)
    answer_to(tab)
    unfold(tab, "operation")
    field(tab, "operation.torque").fill("123 N m")
    server.end(signal.SIGKILL)
    ended = tab.get_by_role("dialog", name="The app has ended")
    ended.wait_for()
    assert "operation.torque: 123 N m" in ended.inner_text()


def test_a_text_too_long_for_a_case_is_not_taken(window, serve, folder):
    """Three million characters, pasted into a field or the text: they would end the connection of the window."""
    tab = window(serve(folder))
    answer_to(tab)
    unfold(tab, "operation")
    before = field(tab, "operation.torque").input_value()
    field(tab, "operation.torque").press("End")
    tab.keyboard.insert_text("7" * 3_000_000)
    tab.locator(".q-field__messages", has_text="3000000 characters were not taken").wait_for()
    assert field(tab, "operation.torque").input_value() == before
    tab.get_by_role("tab", name="Text").click()
    tab.locator(".cm-content").click()
    tab.locator(".cm-content").evaluate(
        """(target) => {
          const clipboardData = new DataTransfer();
          clipboardData.setData("text/plain", "x".repeat(3e6));
          target.dispatchEvent(new ClipboardEvent("paste", { clipboardData, bubbles: true, cancelable: true }));
        }"""
    )
    tab.get_by_role("alert").get_by_text("3000000 characters were not taken").wait_for()
    tab.get_by_text("saved", exact=True).wait_for()
    assert saved(tab, folder) == tomllib.loads(coarse_case())


def test_a_name_that_no_case_can_have_is_refused_beside_it(window, serve, folder):
    tab = window(serve(folder))
    answer_to(tab)
    press(tab, "Save as")
    dialog = tab.get_by_role("dialog")
    for name, words in (("../evil", "only files of one folder are at hand"), ("set", "there is such a file")):
        dialog.get_by_label("Name of the file").fill(name)
        dialog.get_by_role("button", name="Save").click()
        dialog.locator(".q-field__messages", has_text=words).wait_for()
    dialog.get_by_label("Name of the file").fill("other")
    dialog.get_by_role("button", name="Save").click()
    dialog.wait_for(state="detached")
    assert (folder / "other.toml").is_file() and not (folder.parent / "evil.toml").exists()


def test_others_are_not_let_in(serve, folder):
    server = serve(folder)
    place = server.address.split("?")[0]

    def status(address: str, **headers: str) -> int:
        try:
            with urllib.request.urlopen(urllib.request.Request(address, headers=headers)) as answered:
                return answered.status
        except urllib.error.HTTPError as error:
            return error.code

    token = server.address.split("token=")[1]
    assert status(place) == status(place + "answers") == status(place + "results/set_1/report.html") == 403
    assert status(f"{place}?token=x") == 403
    assert status(place, Cookie=f"femgear={token}") == 200
    assert status(place, Cookie=f"femgear={token}", Host="attacker.example") == 403
    assert status(place, Cookie=f"femgear={token}", Origin="https://attacker.example") == 403
    for name in ("../secret.html", "%2e%2e/secret.html", "set.toml", ".set.toml.draft"):
        assert status(f"{place}results/{name}", Cookie=f"femgear={token}") == 404
    port = int(place.split(":")[2].strip("/"))
    with socket.socket() as elsewhere, pytest.raises(OSError):
        elsewhere.connect((socket.gethostbyname(socket.gethostname()), port)) if _own_address() else _refuse()


def _own_address() -> bool:
    return not socket.gethostbyname(socket.gethostname()).startswith("127.")


def _refuse():
    raise OSError


@pytest.mark.parametrize("scheme", ("light", "dark"))
def test_it_is_accessible(window, serve, folder, scheme):
    from axe_playwright_python.sync_playwright import Axe

    tab = window(serve(folder), color_scheme=scheme)
    answer_to(tab)
    unfold(tab, "operation")
    serious = [
        (violation["id"], [node["html"][:200] for node in violation["nodes"]][:3])
        for violation in Axe().run(tab).response["violations"]
        if violation["impact"] in ("serious", "critical")
    ]
    assert serious == [], serious
