"""The picture of page one that README.md shows, from `make demo`; needs Chromium and `.[browser]`."""

import shutil
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
_WIDTH, _COLOURS = 880, 96
HEIGHT = 900
"""Of the screen [px]."""
OPTIONS = ("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")


def draw(report: Path, picture: Path) -> None:
    """Write the first screen of a report as a picture of few colours."""
    from PIL import Image
    from playwright.sync_api import sync_playwright

    chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))))
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=OPTIONS)
        tab = browser.new_page(viewport={"width": 1400, "height": HEIGHT}, device_scale_factor=2)
        tab.goto(report.as_uri())
        # the set in space is drawn after the page has loaded
        tab.wait_for_timeout(3000)
        # what follows page one is not cut through
        front = tab.locator(".front").bounding_box() or {"y": 0.0, "height": HEIGHT}
        end = min(HEIGHT, front["y"] + front["height"] + 10.0)
        tab.screenshot(path=picture, clip={"x": 0.0, "y": 0.0, "width": 1400.0, "height": end})
        browser.close()
    with Image.open(picture) as large:
        small = large.convert("RGB").resize((_WIDTH, large.height * _WIDTH // large.width), Image.Resampling.LANCZOS)
    few = small.quantize(_COLOURS, Image.Quantize.MAXCOVERAGE, kmeans=2, dither=Image.Dither.NONE)
    few.save(picture, optimize=True)


if __name__ == "__main__":
    draw(ROOT / "out" / "demo" / "report.html", ROOT / "docs" / "front" / "report.png")
