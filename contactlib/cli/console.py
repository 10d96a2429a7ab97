"""Output of the commands on a terminal: lines, progress bars, and a line for each mistake."""

from __future__ import annotations

import _thread
import io
import re
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, NoReturn, TypeVar

import click
from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from contactlib.base.text import printable, printable_line
from contactlib.base.units import in_si
from contactlib.cli.leaving import INTERRUPTED, leave

Loaded = TypeVar("Loaded")


def print_line(text: str) -> None:
    """Print a text on stdout."""
    click.echo(printable(text))


def complain(text: str) -> None:
    """Print one line on stderr."""
    click.echo(printable_line(text), err=True)


def in_unit(unit: str) -> Callable[[click.Context, click.Parameter, str | None], float | None]:
    """Callback of an option that is a number in an SI unit, or names another unit."""

    def number(_context: click.Context, option: click.Parameter, text: str | None) -> float | None:
        try:
            return None if text is None else in_si(text, unit, bare=True)
        except ValueError as error:
            raise ValueError(f"{option.opts[0]} = {text!r} {error}") from None

    return number


class Whole(click.IntRange):
    """A whole number in ASCII digits; Python's int also takes 1_0 and the digits of any script."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Fail with click's own message if the text is not a whole number in ASCII digits."""
        if isinstance(value, str) and not re.fullmatch("[+-]?[0-9]+", value.strip()):
            self.fail(f"{value!r} is not a valid integer.", param, ctx)
        return super().convert(value, param, ctx)


def output_option(default: str, text: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Option `--output` with a default."""
    return click.option(
        "-o",
        "--output",
        type=click.Path(path_type=Path),
        default=default,
        show_default=True,
        help=text,
    )


def drawing_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of figures to a command, which receives `formats` as an argument."""

    def formats(_context: click.Context, _option: object, listed: str) -> tuple[str, ...]:
        from contactlib.figures.files import file_formats

        return file_formats(listed, "--format")

    def without_captions(context: click.Context, _option: object, chosen: bool) -> None:
        from contactlib.figures import captions

        context.with_resource(captions(not chosen))

    def sized(context: click.Context, _option: object, size: str | None) -> None:
        from contactlib.figures import page_size

        context.with_resource(page_size(size))

    for add in (
        click.option(
            "--size",
            expose_value=False,
            callback=sized,
            help="Size of each figure: 16:9 or 4:3, a slide, or inches such as 13.33x7.5. Default: "
            "as large as its texts need.",
        ),
        click.option(
            "--no-caption",
            is_flag=True,
            expose_value=False,
            callback=without_captions,
            help="Draw figures without captions.",
        ),
        click.option(
            "--format",
            "formats",
            default="png,svg",
            show_default=True,
            callback=formats,
            help="Formats of the figures, with commas: any that matplotlib writes, such as pdf.",
        ),
    ):
        command = add(command)
    return command


class Group(click.Group):
    """Commands whose users' errors become lines on stderr, one for each, and exit status 2."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the shipped files below the commands; only this help text has to read them."""
        from contactlib.files.reading import shipped_files

        with formatter.section("Shipped files"):
            formatter.write_dl(
                [(kind, ", ".join(names)) for kind, names in shipped_files().items()]
            )

    def invoke(self, ctx: click.Context) -> Any:
        """Run a command."""

        def show(message: Warning | str, *_: object, **__: object) -> None:
            complain(f"warning: {message}")

        for stream in (sys.stdout, sys.stderr):
            # A terminal that lacks a character of a name shows its code.
            if isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(errors="backslashreplace")
        try:
            with warnings.catch_warnings(), _interruptible():
                warnings.showwarning = show
                return super().invoke(ctx)
        except (click.exceptions.Exit, click.exceptions.Abort):  # click's own RuntimeErrors
            raise
        except click.UsageError as error:
            error.ctx = None  # without the lines on usage: a mistake is one line
            raise
        except (ValueError, OSError, RuntimeError, ImportError) as error:
            if isinstance(error, BrokenPipeError) and error.filename is None:
                raise  # the reader has gone, as behind "| head": click ends quietly
            for line in getattr(error, "lines", [str(error)]):
                complain(f"contactlib: {line}")
            ctx.exit(2)


@contextmanager
def _interruptible() -> Iterator[None]:
    """Let Ctrl-C, and SIGTERM as sent by a batch system, interrupt runs, which then clean up.

    The command ends with one line and the exit status of a shell, also where the interrupt became
    another error on its way, as in an import.
    """
    if threading.current_thread() is not threading.main_thread():  # only that receives signals
        yield
        return
    received: list[int] = []
    ours = {signal.SIGINT: (leave, signal.default_int_handler), signal.SIGTERM: (signal.SIG_DFL,)}
    # A handler that the caller has set stays.
    before = {n: h for n, known in ours.items() if (h := signal.getsignal(n)) in known}
    unraisable, uncaught = sys.unraisablehook, sys.excepthook

    def interrupt(number: int, _frame: object) -> NoReturn:
        received.append(number)
        raise KeyboardInterrupt

    def again(lost: Any) -> None:
        if lost.exc_type is not KeyboardInterrupt:
            unraisable(lost)
        else:  # it came in a callback, which can only report it
            threading.Timer(0.01, _thread.interrupt_main).start()

    def show(kind: type[BaseException], *rest: Any) -> None:
        if kind is not KeyboardInterrupt:  # some callbacks print it before they report it
            uncaught(kind, *rest)

    sys.unraisablehook, sys.excepthook = again, show
    for number in before:
        signal.signal(number, interrupt)
    try:
        yield
    except BaseException:
        if not received:
            raise
        complain("contactlib: interrupted")
        raise click.exceptions.Exit(INTERRUPTED + received[0]) from None
    finally:
        sys.unraisablehook, sys.excepthook = unraisable, uncaught
        for number, handler in before.items():
            signal.signal(number, handler)


class Pace:
    """Speed of a long step, measured from its first report of progress."""

    def __init__(self) -> None:
        self._start, self._before, self._shown = time.monotonic(), -1.0, -1
        self.part = 0.0  # fraction done since the first report

    @property
    def elapsed(self) -> float:
        """Time since the first report [s]."""
        return time.monotonic() - self._start

    def line(self, part: float) -> str | None:
        """Text to show for a report, at the first one and at each tenth; else None."""
        if self._before < 0.0:
            self._start, self._before = time.monotonic(), part
            return f"{part:.0%} was done before" if part > 0.0 else None
        self.part = part - self._before
        tenth = int(10.0 * part)
        if tenth == self._shown or self.part <= 0.0:
            return None
        self._shown = tenth
        left = self.elapsed * (1.0 - part) / self.part
        return f"{part:.0%} done, about {left:.0f} s left" if part < 1.0 else "done"


class ConsoleReporter:
    """Progress bars on a terminal, plain lines elsewhere."""

    def __init__(self) -> None:
        self._console = Console(highlight=False, emoji=False, soft_wrap=True)

    @contextmanager
    def step(self, title: str) -> Iterator[Callable[[float], object]]:
        """A step that takes time; yields a function to call with the fraction done."""
        if not self._console.is_terminal:
            self.line(f"... {title}")
            yield lambda part: None
            return
        with self._bar(TimeElapsedColumn()) as bar:
            task = bar.add_task(printable(title), total=None)
            yield lambda part: bar.update(task, total=1.0, completed=part)

    @contextmanager
    def countdown(self, title: str, pace: Pace) -> Iterator[Callable[[float], object]]:
        """A long step, with the time left in its bar, or a line at each tenth."""
        if not self._console.is_terminal:

            def show(part: float) -> None:
                line = pace.line(part)
                if line is not None:
                    self.line(f"... {title}: {line}")

            yield show
            return
        times = (TimeElapsedColumn(), TextColumn("left:"), TimeRemainingColumn())
        with self._bar(*times) as bar:
            task = bar.add_task(printable(title), total=1.0)

            def move(part: float) -> None:
                pace.line(part)
                bar.update(task, completed=part)

            yield move

    def heading(self, text: str) -> None:
        """Begin a part of a report."""
        self._console.print(f"\n{printable(text)}", style="bold", markup=False)

    def line(self, text: str) -> None:
        """Show a line."""
        self._console.print(printable(text), markup=False)

    def _bar(self, *times: ProgressColumn) -> Progress:
        title = TextColumn("{task.description}", markup=False)
        columns = (title, BarColumn(), TaskProgressColumn(), *times)
        return Progress(*columns, console=self._console, transient=True)


def with_progress(load: Callable[[Callable[[float], object]], Loaded]) -> Loaded:
    """Read a file, and show progress if the table of its law has to be built."""
    with ExitStack() as stack:
        bar: list[Callable[[float], object]] = []

        def progress(part: float) -> None:
            if not bar:
                step = ConsoleReporter().countdown("Building the table of the law", Pace())
                bar.append(stack.enter_context(step))
                bar[0](0.0)
            bar[0](part)

        return load(progress)
