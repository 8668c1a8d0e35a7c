"""Pictures of page one: of `make demo` for README.md, of a gearbox for docs/report.md; need Chromium and `.[browser]`.

The gearbox is run by `femgear run cases/e_axle_in_a_casing.toml -o out/e_axle`.
"""

import shutil
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
OPTIONS = ("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")


def draw(report: Path, picture: Path) -> None:
    """Write the first screen of a report as a picture of few colours."""
    from PIL import Image
    from playwright.sync_api import sync_playwright

    chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))))
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=OPTIONS)
        tab = browser.new_page(viewport={"width": 1400, "height": 900}, device_scale_factor=2)
        tab.goto(report.as_uri())
        # the set in space is drawn after the page has loaded
        tab.wait_for_timeout(3000)
        tab.screenshot(path=picture)
        browser.close()
    with Image.open(picture) as large:
        small = large.convert("RGB").resize((large.width // 2, large.height // 2), Image.Resampling.LANCZOS)
    small.quantize(256).save(picture, optimize=True)


if __name__ == "__main__":
    draw(ROOT / "out" / "demo" / "report.html", ROOT / "docs" / "front" / "report.png")
    draw(ROOT / "out" / "e_axle" / "report.html", ROOT / "docs" / "front" / "gearbox.png")
