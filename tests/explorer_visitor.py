"""Someone who uses the explorer page by its controls, and to whom time passes as it is asked to."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import replace
from decimal import Decimal
from typing import Any, NamedTuple

from explorer_page import ExplorerPage

import contactlib as cl
from contactlib.element import friction_with_k_hat
from contactlib.law_tables import carter_griffith_table

# Some simulated time in short pieces, at most until something happens.
GO_ON = """async (duration, until, piece) => {
  const { app } = await contactlib.ready;
  const events = [];
  let lowest = app.run.creepage, highest = lowest;
  for (let left = duration; left > 1e-9 && !events.some(({ name }) => name === until);) {
    const passed = Math.min(piece, left);
    events.push(...app.advance(passed));
    left -= passed;
    lowest = Math.min(lowest, app.run.creepage);
    highest = Math.max(highest, app.run.creepage);
  }
  const { time, creepage, speed, driveTorque } = app.run;
  return { events, lowest, highest, time, creepage, speed, driveTorque };
}"""

STALE = "async () => { (await contactlib.ready).app.advance(0); }"
PAUSE = "async () => { const { app } = await contactlib.ready; if (app.playing) app.play(false); }"
SELDOM = 400  # between two looks of the page at what it looks at least often, and more [ms]
FRAME = 20  # and more than one [ms]


class Passed(NamedTuple):
    """What happened in some simulated time, and where it ended."""

    events: list[dict[str, Any]]
    lowest: float
    highest: float
    time: float
    creepage: float
    speed: float
    driveTorque: float  # noqa: N815

    @property
    def names(self) -> list[str]:
        return [event["name"] for event in self.events]

    def first(self, name: str) -> dict[str, Any]:
        return next(event for event in self.events if event["name"] == name)


class Visitor:
    """Uses a page whose clock stands."""

    def __init__(self, opened: ExplorerPage) -> None:
        self.opened = opened
        self.page = opened.page
        self.call = opened.call

    # ---- what he does

    def choose(self, model: str) -> None:
        """Begin anew with a shipped model."""
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

    def simulate(self, duration: float, until: str | None = None, piece: float = 0.01) -> Passed:
        """Let simulated time pass [s], at most until an event; nothing is drawn."""
        return Passed(**self.call(GO_ON, duration, until, piece))

    def wait(self, duration: int = FRAME) -> None:
        """Let the page's clock pass [ms]: a frame is drawn, and what is due by then is done."""
        self.page.clock.fast_forward(duration)

    def look(self) -> None:
        """Pause, and have everything drawn as it is now."""
        self.call(PAUSE)
        self.wait(SELDOM)
        self.call(STALE)
        self.wait()

    # ---- what he sees

    def text(self, place: str) -> str:
        return self.page.locator(f"#{place}").inner_text()

    def toast(self) -> str:
        """The message at the page's foot, when there is one."""
        self.page.locator("#toast:not(:empty)").wait_for()
        return self.text("toast")

    def numbers(self) -> dict[str, str]:
        """The numbers beside the picture by their labels, with their units."""
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
    """A number stands there, to the last of its digits."""
    found = re.match(r"\u2212?[0-9.]+(e\u2212?[0-9]+)?", text)
    assert found, text
    number = Decimal(found[0].replace("\u2212", "-"))
    exponent = number.as_tuple().exponent
    assert isinstance(exponent, int)
    assert len(number.as_tuple().digits) >= 3, text
    half = 0.5 * 10.0**exponent
    assert abs(float(number) - value) <= half * (1.0 + 1e-6), (text, value)


def changed(wheelset: cl.Wheelset, changes: Mapping[str, float], ellipse: bool) -> cl.Wheelset:
    """A wheelset of a line contact after entries by a visitor; an ellipse keeps a, p0 and P."""
    element = wheelset.element
    contact, friction = element.contact, element.friction
    left: dict[str, Any] = dict(changes)
    kinetic = left.pop("kinetic", friction.kinetic)
    ratio = left.pop("ratio", friction.static / friction.kinetic)
    changed_friction = friction_with_k_hat(
        contact,
        k_hat=left.pop("k_hat", element.k_hat),
        static=ratio * kinetic,
        kinetic=kinetic,
        slip_rate_residual=left.pop("residual", friction.slip_rate_residual),
        slip_rate_decay=left.pop("decay", friction.slip_rate_decay),
    )
    load, a, p0 = contact.normal_load, contact.semi_width, contact.peak_pressure
    if ellipse:
        contact = cl.EllipticContact.from_semi_axes(
            semi_axis_x=a,
            semi_axis_y=1.5 * load / (math.pi * a * p0),
            normal_load=load,
            contact_modulus=contact.contact_modulus,
        )
    slope = left.pop("slope", element.slope_reduction)
    table = carter_griffith_table("elliptic" if ellipse else "line")
    new = replace(
        element, contact=contact, friction=changed_friction, table=table, slope_reduction=slope
    )
    return replace(wheelset, element=new, **left)
