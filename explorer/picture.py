"""Take the README's picture of the explorer page.

python explorer/picture.py models/explorer.png
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import sync_playwright

from contactlib.base.writing import write_whole
from contactlib.export.explorer import write_explorer

# On its way down from the slip-away, shortly before it grips again.
EXPERIMENT = """async () => {
    const { app } = await contactlib.ready;
    document.querySelector("#stories button:nth-child(2)").click();
    const low = () => app.run.now.drive_torque < 0.89 * app.shown.fold.drive_torque;
    while (app.run.now.time < 10 || !low()) app.advance(0.02);
    app.play(false);
}"""


def picture() -> bytes:
    """PNG of the page in the middle of its second experiment."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox"]
        )
        page = browser.new_page(viewport={"width": 1440, "height": 900}, color_scheme="light")
        with tempfile.TemporaryDirectory() as folder:
            page.goto(write_explorer(Path(folder) / "explorer.html").as_uri())
        page.evaluate(EXPERIMENT)
        page.wait_for_timeout(500.0)  # for a frame that draws it
        png = page.screenshot()
        browser.close()
    return png


if __name__ == "__main__":
    print(write_whole(sys.argv[1], picture()))
