"""The explorer page in a headless Chromium that is cut off from everything.

    with explorer_page(width=1440, height=900) as page:
        page.call("async (part) => (await contactlib.ready).app[part]", "kickSize")

The browser runs as long as a page is open: a module that opens many keeps one in a fixture.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
from outside_tools import missing, module

from contactlib.base.quantities import FloatArray
from contactlib.export.explorer import write_explorer

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, ConsoleMessage, Page, Request, Route

ARGUMENTS = (
    "--no-sandbox",  # which root cannot have, and this page does not need
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
LONG_OPEN = 600e3  # more than any opening takes [ms]


class Found(SimpleNamespace):
    """What a script found; of a run its events, and the rows of its history by column."""

    def __getitem__(self, name: str) -> FloatArray:
        return np.array(self.rows[name])

    @property
    def names(self) -> list[str]:
        """Names of the events."""
        return [event["name"] for event in self.events]

    def first(self, name: str) -> dict[str, Any]:
        """First event of a name."""
        return next(event for event in self.events if event["name"] == name)


class ExplorerPage:
    """A page of the explorer, and what went wrong on it.

    Attributes
    ----------
    page : Page
        Playwright's.
    errors : list of str
        Messages of the console and of the script, and requests that were refused.
    """

    def __init__(self, context: BrowserContext, address: str) -> None:
        self.errors: list[str] = []
        self._address = address.partition("#")[0]
        context.set_offline(True)
        context.route("**/*", self._refuse_others)
        self.page: Page = context.new_page()
        self.page.on("console", self._note)
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.goto(address)
        self.page.evaluate("() => contactlib.ready.then(() => null)")

    def call(self, function: str, *arguments: object) -> Any:
        """Result of a JavaScript function of these arguments, once its promise is settled."""
        return self.page.evaluate(f"(list) => ({function})(...list)", list(arguments))

    def _refuse_others(self, route: Route, request: Request) -> None:
        if request.url.partition("#")[0] == self._address:
            route.continue_()
        else:
            self.errors.append(f"the page requested {request.url}")
            route.abort()

    def _note(self, message: ConsoleMessage) -> None:
        if message.type in ("error", "warning"):
            self.errors.append(message.text)


_running: list[Browser] = []
_folder = tempfile.TemporaryDirectory()


@cache
def written_page() -> Path:
    """The page as the command writes it, once for all tests."""
    return write_explorer(Path(_folder.name) / "explorer.html")


@contextmanager
def _browser() -> Iterator[Browser]:
    """Chromium, which runs as long as the first page is open."""
    if _running:
        yield _running[0]
        return
    program = os.environ.get("CONTACTLIB_CHROMIUM") or shutil.which("chromium")
    playwright = module("playwright.sync_api")
    if program is None:
        missing("chromium is not installed, and CONTACTLIB_CHROMIUM does not name it")
    with playwright.sync_playwright() as driver:
        _running.append(driver.chromium.launch(executable_path=program, args=[*ARGUMENTS]))
        try:
            yield _running[0]
        finally:
            _running.pop().close()


@contextmanager
def explorer_page(
    width: int = 1440,
    height: int = 900,
    path: Path | None = None,
    fragment: str = "",
    clock_stands: bool = False,
    **context: Any,
) -> Iterator[ExplorerPage]:
    """The page, ready; leaving it without an exception asserts that nothing went wrong on it.

    `fragment` is what stands behind the address's ``#``. With `clock_stands` the page's clock goes
    on, and frames are drawn, only when Playwright's ``page.clock`` moves. Further options are
    those of its ``new_context``, such as ``color_scheme`` or ``has_touch``.
    """
    address = (path or written_page()).resolve().as_uri() + (f"#{fragment}" if fragment else "")
    size = {"width": width, "height": height}
    with _browser() as browser, browser.new_context(viewport=size, **context) as private:  # type: ignore[arg-type]
        if clock_stands:
            private.clock.install(time=0)
        page = ExplorerPage(private, address)
        if clock_stands:
            page.page.clock.pause_at(LONG_OPEN)
        yield page
        assert page.errors == []
