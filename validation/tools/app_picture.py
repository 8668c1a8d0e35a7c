"""Draw docs/front/app.png, the window of the app on the reference set, with Chromium::

python validation/tools/app_picture.py
"""

from __future__ import annotations

import io
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

ROOT = Path(__file__).parents[2]
WAIT = 240_000
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


def main() -> None:
    """Start the app, wait for the answers, and write the picture."""
    with tempfile.TemporaryDirectory() as place:
        shutil.copy(ROOT / "cases" / "planetary_27_40_108.toml", place)
        command = [sys.executable, "-m", "femgear", "app", place, "--no-browser"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server, sync_playwright() as playwright:
            assert server.stdout is not None
            address = re.search(r"http\S+", server.stdout.readline())
            assert address is not None
            options = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
            browser = playwright.chromium.launch(executable_path=CHROMIUM, args=options)
            tab = browser.new_page(viewport={"width": 1080, "height": 660}, reduced_motion="reduce")
            tab.goto(address[0])
            answers = tab.frame_locator("iframe.answers")
            answers.locator("#state", has_text=re.compile("^computed")).wait_for(timeout=WAIT)
            for name in ("operation",):
                tab.locator(".q-item__label", has_text=re.compile(f"^{name}$")).click()
            tab.wait_for_timeout(3000)
            picture = tab.screenshot()
            browser.close()
            server.terminate()
    image = Image.open(io.BytesIO(picture)).convert("RGB")
    image = image.quantize(24, method=Image.Quantize.MAXCOVERAGE, kmeans=2, dither=Image.Dither.NONE)
    image.save(ROOT / "docs" / "front" / "app.png", optimize=True)


if __name__ == "__main__":
    main()
