"""A visitor who uses the explorer page's controls, and whose time passes on request."""

from __future__ import annotations

import re
from decimal import Decimal
from typing import Any

from explorer_page import ExplorerPage, Found

# Some simulated time in short pieces, at most until something happens.
GO_ON = """async (duration, until, piece) => {
  const { app } = await contactlib.ready;
  const events = [];
  let lowest = app.run.now.creepage, highest = lowest;
  for (let left = duration; left > 1e-9 && !events.some(({ name }) => name === until);) {
    const passed = Math.min(piece, left);
    events.push(...app.advance(passed));
    left -= passed;
    lowest = Math.min(lowest, app.run.now.creepage);
    highest = Math.max(highest, app.run.now.creepage);
  }
  return { events, lowest, highest, ...app.run.now };
}"""

STALE = "async () => { (await contactlib.ready).app.advance(0); }"
PAUSE = "async () => { const { app } = await contactlib.ready; if (app.playing) app.play(false); }"
# Until observers have been called for all that has another size.
RESIZED = "() => new Promise((done) => new ResizeObserver(() => done()).observe(document.body))"
SELDOM = 400  # longer than between any two updates of the page [ms]
FRAME = 20  # longer than a frame [ms]


class Visitor:
    """Uses a page whose clock stands."""

    def __init__(self, opened: ExplorerPage) -> None:
        self.opened = opened
        self.page = opened.page
        self.call = opened.call

    # ---- actions

    def choose(self, model: str) -> None:
        """Begin again with a shipped model."""
        self.page.get_by_role("combobox", name="Model", exact=True).select_option(model)

    def press(self, button: str) -> None:
        self.page.get_by_role("button", name=button, exact=True).click()

    def check(self, radio: str) -> None:
        self.page.get_by_role("radio", name=radio, exact=True).check(force=True)

    def enter(self, **values: float) -> None:
        """Type numbers into fields, in the units that stand beside them."""
        for name, value in values.items():
            field = self.page.locator(f"#{name.replace('_', '-')}-field")
            field.fill(repr(float(value)))
            field.press("Enter")

    # ---- time

    def simulate(self, duration: float, until: str | None = None, piece: float = 0.01) -> Found:
        """Let simulated time pass [s], at most until an event; nothing is drawn.

        Returns events, lowest and highest creepage, and the row at the end.
        """
        return Found(**self.call(GO_ON, duration, until, piece))

    def wait(self, duration: int = FRAME) -> None:
        """Let the page's clock pass [ms]: a frame is drawn, and what is due is done."""
        self.page.clock.fast_forward(duration)

    def look(self) -> None:
        """Pause, and have everything drawn as it is now."""
        self.call(PAUSE)
        self.wait(SELDOM)
        self.call(STALE)
        self.wait()
        self.call(RESIZED)
        self.wait()  # charts whose size has changed meanwhile are drawn again

    # ---- what the page shows

    def text(self, place: str) -> str:
        return self.page.locator(f"#{place}").inner_text()

    def toast(self) -> str:
        """The message at the page's foot, when there is one."""
        self.page.locator("#toast:not(:empty)").wait_for()
        return self.text("toast")

    def numbers(self) -> dict[str, str]:
        """The numbers above the charts by their labels, with their units."""
        cells = self.page.locator("#numbers > div").all_inner_texts()
        return dict(cell.split("\n", 1) for cell in cells)

    def settings(self) -> dict[str, Any]:
        return dict(self.call("async () => (await contactlib.ready).app.settings"))

    def state(self, name: str) -> Any:
        """A property of the app, such as ``run.time``."""
        return self.call(
            "async (name) => name.split('.').reduce((o, k) => o[k], (await contactlib.ready).app)",
            name,
        )


def assert_shows(text: str, value: float) -> None:
    """The text begins with this number, rounded to the digits shown."""
    match = re.match(r"\u2212?[0-9.]+(e\u2212?[0-9]+)?", text)
    assert match, text
    number = Decimal(match[0].replace("\u2212", "-"))
    exponent = number.as_tuple().exponent
    assert isinstance(exponent, int)
    assert len(number.as_tuple().digits) >= 3, text
    half = 0.5 * 10.0**exponent
    assert abs(float(number) - value) <= half * (1.0 + 1e-6), (text, value)
