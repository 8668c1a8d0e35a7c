"""Film docs/front/app.webp, half a minute of the app on the reference set, with Chromium::

python validation/tools/app_film.py
"""

from __future__ import annotations

import io
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import sync_playwright

ROOT = Path(__file__).parents[2]
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
OPTIONS = ("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
WAIT = 240_000
SIZE, SHOWN = (1500, 1000), (900, 600)
"""Of the window and of the film [pixels]."""
STEP, REST = 400, 2600
"""How long a picture of something that moves, and of something to read, is shown [ms]."""
QUALITY = 30
"""Of WebP."""
PIN = '\n[[set.pin_errors]]\nplanet = 1\ntangential = "4 um"\n'
RELIEF = '\n[[sun.modifications]]\nkind = "tip relief"\nstart_diameter = "43 mm"\namount = "4 um"\n'


@dataclass
class Film:
    """Pictures of a tab of a browser, and how long each is shown.

    Parameters
    ----------
    tab : Page
        Of Playwright, with the app.
    pictures : list of Image
    durations : list of int
        [ms]
    """

    tab: Any
    pictures: list[Image.Image] = field(default_factory=list)
    durations: list[int] = field(default_factory=list)

    def shoot(self, duration: int) -> None:
        """Take a picture that is shown for so long [ms]."""
        picture = Image.open(io.BytesIO(self.tab.screenshot())).convert("RGB")
        self.pictures.append(picture.resize(SHOWN, Image.Resampling.LANCZOS))
        self.durations.append(duration)

    def answered(self) -> None:
        """Wait for the whole answer, and show it."""
        state = self.tab.frame_locator("iframe.answers").locator("#state", has_text=re.compile("^computed"))
        state.wait_for(timeout=WAIT)
        self.tab.wait_for_timeout(500)
        self.shoot(REST)

    def drag(self, key: str, places: tuple[float, ...]) -> None:
        """Drag a slider to shares of its length, with a picture at each, then wait for the answer."""
        box = self.tab.locator(f'[data-slider="{key}"]').bounding_box()
        y = box["y"] + 0.5 * box["height"]
        thumb = self.tab.locator(f'[data-slider="{key}"] .q-slider__thumb').bounding_box()
        self.tab.mouse.move(thumb["x"] + 0.5 * thumb["width"], y)
        self.tab.mouse.down()
        for place in places:
            self.tab.mouse.move(box["x"] + place * box["width"], y, steps=4)
            self.tab.wait_for_timeout(900)
            self.shoot(STEP)
        self.tab.mouse.up()
        self.answered()

    def write(self, path: Path) -> None:
        """Write the film as WebP."""
        self.pictures[0].save(
            path,
            save_all=True,
            append_images=self.pictures[1:],
            duration=self.durations,
            loop=0,
            quality=QUALITY,
            method=4,
            minimize_size=True,
        )


def play(film: Film) -> None:
    """Drag what decides strength and noise, type what cannot be, and take it back."""
    tab = film.tab
    tab.set_default_timeout(WAIT)
    film.answered()
    film.drag("operation.torque", (0.55, 0.6, 0.65, 0.7, 0.6, 0.5))
    film.drag("set.pin_errors[0].tangential", (0.55, 0.65, 0.75, 0.85, 0.6, 0.3, 0.0))
    film.drag("operation.speeds[1]", (0.55, 0.6, 0.65, 0.7))
    film.drag("sun.modifications[0].amount", (0.6, 0.75, 0.9))
    tab.locator(".q-item__label", has_text=re.compile("^operation$")).click()
    tab.wait_for_timeout(600)
    film.shoot(STEP)
    torque = tab.locator('[data-key="operation.torque"] input, input[data-key="operation.torque"]').first
    torque.fill("100 mm")
    torque.press("Tab")
    tab.wait_for_timeout(1500)
    film.shoot(REST)
    tab.get_by_role("button", name="Undo", exact=True).click()
    film.answered()
    tab.locator(".q-tab__label", has_text=re.compile("^Text$")).click()
    tab.wait_for_timeout(800)
    film.shoot(REST)


def filmed(act: Callable[[Film], None]) -> Film:
    """Start the app on the reference set with an error of a pin and a relief, and film what is done there."""
    text = (ROOT / "cases" / "planetary_27_40_108.toml").read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as place:
        # no published lines: speeds are dragged
        text = text[: text.index("# What the paper reports")] + PIN + RELIEF
        Path(place, "planetary_set.toml").write_text(text, encoding="utf-8")
        command = [sys.executable, "-m", "femgear", "app", place, "--no-browser"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server, sync_playwright() as playwright:
            assert server.stdout is not None
            address = re.search(r"http\S+", server.stdout.readline())
            assert address is not None
            try:
                browser = playwright.chromium.launch(executable_path=CHROMIUM, args=list(OPTIONS))
                width, height = SIZE
                tab = browser.new_page(viewport={"width": width, "height": height}, reduced_motion="reduce")
                tab.goto(address[0])
                film = Film(tab)
                act(film)
                browser.close()
            finally:
                server.terminate()
    return film


if __name__ == "__main__":
    filmed(play).write(ROOT / "docs" / "front" / "app.webp")
