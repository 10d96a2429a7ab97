"""The command ``contactlib``."""

from __future__ import annotations

import io
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from contactlib.terminal import harmless, harmless_line

if TYPE_CHECKING:
    from contactlib.scenario import Model


Loaded = TypeVar("Loaded")


def _say(text: str) -> None:
    click.echo(harmless(text))


def _complain(text: str) -> None:
    click.echo(harmless_line(text), err=True)


class _Group(click.Group):
    """Turns what a user can get wrong into one line on stderr and exit status 2."""

    def invoke(self, ctx: click.Context) -> Any:
        def show(message: Warning | str, *_: object, **__: object) -> None:
            _complain(f"warning: {message}")

        for stream in (sys.stdout, sys.stderr):
            # A terminal without a letter of a name shows its code.
            if isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(errors="backslashreplace")
        try:
            with warnings.catch_warnings(), _ended_as_by_ctrl_c():
                warnings.showwarning = show
                return super().invoke(ctx)
        except (click.exceptions.Exit, click.exceptions.Abort):  # RuntimeErrors of click's own
            raise
        except (ValueError, OSError, RuntimeError) as error:
            if isinstance(error, BrokenPipeError) and error.filename is None:
                raise  # nobody reads on, as behind "| head": click ends quietly
            _complain(f"contactlib: {error}")
            ctx.exit(2)


@contextmanager
def _ended_as_by_ctrl_c() -> Iterator[None]:
    """Let what is asked to end (SIGTERM, as by a batch system) clean up and say what is kept."""
    before = signal.getsignal(signal.SIGTERM)
    # Only the main thread hears signals; who set another way to end, or none, keeps it.
    main_thread = threading.current_thread() is threading.main_thread()
    if not main_thread or before is not signal.SIG_DFL:
        yield
        return
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


class _Pace:
    """How fast a long step goes, from the first time that it tells the part done."""

    def __init__(self) -> None:
        self._start, self._before, self._shown = time.monotonic(), -1.0, -1
        self.part = 0.0  # done since then

    @property
    def elapsed(self) -> float:
        """Since the first time [s]."""
        return time.monotonic() - self._start

    def line(self, part: float) -> str | None:
        """What to tell of it, the first time and at each tenth; else None."""
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


class _ConsoleReporter:
    """Progress bars on a terminal, plain lines elsewhere."""

    def __init__(self) -> None:
        self._console = Console(highlight=False, emoji=False, soft_wrap=True)

    @contextmanager
    def step(self, title: str) -> Iterator[Callable[[float], object]]:
        if not self._console.is_terminal:
            self.line(f"... {title}")
            yield lambda part: None
            return
        columns = (
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            TaskProgressColumn(),
        )
        with Progress(*columns, TimeElapsedColumn(), console=self._console, transient=True) as bar:
            task = bar.add_task(harmless(title), total=None)
            yield lambda part: bar.update(task, total=1.0, completed=part)

    @contextmanager
    def countdown(self, title: str, pace: _Pace) -> Iterator[Callable[[float], object]]:
        """A long step: a bar with the time that is left, elsewhere a line at each tenth."""
        if not self._console.is_terminal:

            def show(part: float) -> None:
                line = pace.line(part)
                if line is not None:
                    self.line(f"... {title}: {line}")

            yield show
            return
        columns = (
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            TaskProgressColumn(),
        )
        times = (TimeElapsedColumn(), TextColumn("left:"), TimeRemainingColumn())
        with Progress(*columns, *times, console=self._console, transient=True) as bar:
            task = bar.add_task(harmless(title), total=1.0)

            def move(part: float) -> None:
                pace.line(part)
                bar.update(task, completed=part)

            yield move

    def heading(self, text: str) -> None:
        self._console.print(f"\n{harmless(text)}", style="bold", markup=False)

    def number(self, number: object) -> None:
        self.line(f"  {number}")

    def line(self, text: str) -> None:
        self._console.print(harmless(text), markup=False)


def _with_progress(load: Callable[[Callable[[float], object]], Loaded]) -> Loaded:
    """Read a file; show progress if the table of its law has to be built."""
    with ExitStack() as stack:
        bar: list[Callable[[float], object]] = []

        def progress(part: float) -> None:
            if not bar:
                step = _ConsoleReporter().step("Building the table of the law")
                bar.append(stack.enter_context(step))
            bar[0](part)

        return load(progress)


def _load(name: str) -> Model:
    from contactlib.scenario import load_model

    return _with_progress(lambda progress: load_model(name, progress=progress))


def _output_option(default: str, what: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    return click.option(
        "-o",
        "--output",
        type=click.Path(path_type=Path),
        default=default,
        show_default=True,
        help=what,
    )


@click.group(cls=_Group, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="contactlib", prog_name="contactlib")
def main() -> None:
    """Creep force element for vehicle dynamics: from the law to a running FMU.

    MODEL is a TOML file, or the name of one that is shipped: roller_rig.toml, locomotive.toml, and
    for `simulate` the scenarios dry_wet_dry.toml, torque_step.toml, torque_ramp.toml,
    braking.toml, sanding.toml, speed_sweep.toml, standstill.toml, split_friction.toml,
    torsion.toml. SWEEP likewise: wet_patch_sweep.toml, uncertain_wheelset_sweep.toml,
    friction_and_load_sweep.toml.
    """


@main.command()
@_output_option("contactlib-demo", "Folder for figures, FMU, CSV files, page and summary.json.")
def demo(output: Path) -> None:
    """Show it all: table, run-away, creep control, FMU."""
    from contactlib.demo import run_demo

    summary = run_demo(output, _ConsoleReporter())
    pictures = ", ".join(sorted(p.name for p in output.glob("*.png")))
    _say(f"\nLook at {pictures} in {output}{'/' if output.name else ''}")
    _say(f"Every number above is in {summary}; the FMU is {output / 'CreepForceElement.fmu'}")
    _say(f"See it live: contactlib explore, or open {output / 'explorer.html'} in a browser")
    _say("Go on: contactlib simulate dry_wet_dry.toml --compare; contactlib figures --stability")


@main.command()
@click.argument("model")
@click.option("--control", help="Name of a controller in the file; the first if left out.")
@click.option("--compare", is_flag=True, help="Run all controllers, side by side.")
@click.option(
    "--seed", type=click.IntRange(0), help="Of the sensors' noise; the file's if left out."
)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="Folder for metrics, time series and figures; default: contactlib- and the file's name.",
)
def simulate(
    model: str, control: str | None, compare: bool, seed: int | None, output: Path | None
) -> None:
    """Run MODEL, a scenario or a model, and report what a study reports.

    A model's controllers are torque and creep, its own two runs.
    """
    from contactlib.report import write_report
    from contactlib.study import open_study

    if compare and control is not None:
        raise ValueError(f"--control {control}: --compare runs all controllers")
    study = _with_progress(lambda progress: open_study(model, seed=seed, progress=progress))
    runs = study.chosen(control, every=compare)
    folder = output or Path(f"contactlib-{Path(model).stem}")
    write_report(study, runs, folder, _ConsoleReporter())
    _say(f"Metrics, time series and figures are in {folder}")


@main.command()
@click.argument("model")
@_output_option("creep_table.bin", "Table file.")
@click.option("--rebuild", is_flag=True, help="Solve the law anew instead of reading its table.")
def table(model: str, output: Path, rebuild: bool) -> None:
    """Write the table of the law that MODEL uses."""
    made = _load(model).wheelset.element.table
    if rebuild and made.law.startswith("CarterGriffith"):
        from contactlib.law_tables import build_carter_griffith_table

        with _ConsoleReporter().step("Building the table of the law") as progress:
            made = build_carter_griffith_table(made.options["contact"], progress)
    _say(
        f"{made.save(output)}: {made.law}, largest error found {made.max_error:.2g} of the "
        f"traction ratio and {made.max_slope_error:.2g} of its slope, at "
        f"{made.certificate_points} points"
    )


@main.command()
@click.argument("model")
@click.option(
    "--kind",
    type=click.Choice(["force_element", "wheelset", "wheelset_body"]),
    help="The force for given velocities (default), the wheelset with it, or the wheelset "
    "without it.",
)
@click.option("--fmi", type=click.Choice(["2", "3"]), default="2", show_default=True)
@click.option(
    "--platforms",
    help="Comma-separated, such as x86_64-linux,x86_64-windows, or all; default: this machine.",
)
@click.option("--relaxation-length", type=float, help="Adds the state of a contact that lags [m].")
@click.option("--implicit", is_flag=True, help="Solve the element's own slip over each step.")
@click.option("--parallel-exchange", is_flag=True, help="Both sides of the coupling step at once.")
@click.option(
    "--ssp",
    is_flag=True,
    help="Export an SSP package instead: force element, wheelset and parameters, coupled.",
)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="Default: the kind's name with .fmu, or CreepForceSystem.ssp.",
)
def fmu(
    model: str,
    kind: str | None,
    fmi: str,
    platforms: str | None,
    relaxation_length: float | None,
    implicit: bool,
    parallel_exchange: bool,
    ssp: bool,
    output: Path | None,
) -> None:
    """Export MODEL as an FMU for model exchange and co-simulation, or as a system of two."""
    from contactlib.export import MODEL_NAMES, SYSTEM_NAME, export_fmu, export_ssp

    common: dict[str, Any] = {
        "fmi_version": int(fmi),
        "platforms": None if platforms is None else [p.strip() for p in platforms.split(",")],
        "relaxation_length": relaxation_length,
    }
    if ssp:
        chosen = {"kind": kind, "implicit": implicit, "parallel-exchange": parallel_exchange}
        given = [f"--{name}" for name, value in chosen.items() if value]
        if given:
            raise ValueError(f"--ssp goes without {', '.join(given)}: a system has its own choice")
        written = export_ssp(_load(model), output or f"{SYSTEM_NAME}.ssp", **common)
    else:
        kind = kind or "force_element"
        written = export_fmu(
            _load(model),
            output or f"{MODEL_NAMES[kind]}.fmu",
            kind=kind,
            implicit=implicit,
            parallel_exchange=parallel_exchange,
            **common,
        )
    _say(str(written))


@main.command()
@click.argument("sweep")
@click.option(
    "--workers",
    type=click.IntRange(1),
    help="Threads or processes; default: one for each processor.",
)
@click.option(
    "--processes",
    is_flag=True,
    help="Processes instead of threads: for outcomes of the analysis, which is in Python.",
)
@click.option(
    "--cluster", metavar="ADDRESS", help="Of a Dask scheduler, such as tcp://10.0.0.1:8786."
)
@click.option(
    "--chunk", type=click.IntRange(1), help="Runs in a chunk, which is what a kill can cost."
)
@click.option("--restart", is_flag=True, help="Do away with what OUTPUT has, and start anew.")
@click.option("--no-maps", is_flag=True, help="Draw nothing.")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="Folder for the NetCDF file and the maps; default: contactlib- and the file's name.",
)
def sweep(
    sweep: str,
    workers: int | None,
    processes: bool,
    cluster: str | None,
    chunk: int | None,
    restart: bool,
    no_maps: bool,
    output: Path | None,
) -> None:
    """Run SWEEP, a scenario over many values of its parameters.

    Stopped or killed at any time, the same command goes on where it was. SWEEP is a TOML file, or
    one that is shipped: friction_and_load_sweep.toml, wet_patch_sweep.toml,
    uncertain_wheelset_sweep.toml.
    """
    from contactlib import sweep as sweeps

    if cluster is not None and (processes or workers is not None):
        raise ValueError("--cluster goes without --processes and --workers: it has its own")
    loaded = _with_progress(lambda progress: sweeps.load_sweep(sweep, progress=progress))
    folder = output or Path(f"contactlib-{loaded.stem}")
    count = workers or sweeps.default_workers()
    if cluster is not None:
        opened = sweeps.cluster_workers(cluster)
    else:
        opened = (sweeps.process_workers if processes else sweeps.thread_workers)(count)
    reporter, pace = _ConsoleReporter(), _Pace()
    with opened as pool:
        reporter.line(f"{loaded.name}: {loaded.summary}; {pool.count} workers")
        try:
            with reporter.countdown("Running", pace) as progress:
                found = sweeps.ensemble(
                    loaded,
                    executor=pool,
                    output=folder,
                    chunk=chunk,
                    restart=restart,
                    progress=progress,
                )
        except KeyboardInterrupt:
            reporter.line(
                f"Stopped; what is done is kept in {folder}: the same command goes on from there"
            )
            raise
        if pace.part > 0.0 and loaded.simulated_time > 0.0:
            rate = pace.part * loaded.simulated_time / pace.elapsed
            reporter.line(f"{pace.elapsed:.1f} s, {rate:.0f} simulated s per s")
    for line in sweeps.report(loaded, found):
        reporter.line(line)
    none = bool((found["failed"] == 1).all())
    if not no_maps and not none:
        from contactlib.figures import draw_maps

        with reporter.step("Drawing the maps"):
            draw_maps(found, folder)
    beside = "" if no_maps or none else ", and maps beside it"
    reporter.line(f"The results are in {sweeps.results_path(loaded, folder)}{beside}")
    if none:
        _complain("contactlib: all runs failed")
        click.get_current_context().exit(1)


@main.command()
@click.argument("path", metavar="FMU", type=click.Path(path_type=Path))
@click.option(
    "--load",
    is_flag=True,
    help="Also load the library for this machine and make an instance. This runs the FMU's code, "
    "with all your rights: leave it out for one that you would not run.",
)
def check(path: Path, load: bool) -> None:
    """Check any FMU: archive, description, libraries.

    Prints one line for each problem, and exits with status 1 if there is one. Nothing of the FMU
    runs unless you ask for it with --load.
    """
    from contactlib.checker import examine_fmu

    problems, checked = examine_fmu(path, load=load)
    for problem in problems:
        _say(problem)
    if problems:
        click.get_current_context().exit(1)
    _say(f"{path}: no problem found ({checked})")


@main.command()
@click.option("--paper", is_flag=True, help="Figures 1 to 6 of the paper, and the contact patch.")
@click.option(
    "--stability",
    "model",
    metavar="[MODEL]",
    is_flag=False,
    flag_value="roller_rig.toml",
    help="Why the wheelset of MODEL runs away, and what holds it; roller_rig.toml if left out.",
)
@_output_option("contactlib-figures", "Folder for the figures.")
def figures(paper: bool, model: str | None, output: Path) -> None:
    """Draw figures of the laws, or of a wheelset's stability, as PNG and SVG."""
    from contactlib.figures import CONTACT_PATCH, PAPER_FIGURES, STABILITY_FIGURES, save_pictures

    if not paper and model is None:
        raise ValueError("figures: pass --paper or --stability, or both")
    wanted: dict[str, tuple[Callable[[], Any], str]] = {}
    if paper:
        named = {f"paper_figure_{number}": figure for number, figure in PAPER_FIGURES.items()}
        for name, figure in {**named, "contact_patch": CONTACT_PATCH}.items():
            wanted[name] = figure.draw, figure.title
    if model is not None:
        loaded = _load(model)
        given = loaded.wheelset, loaded.initial_speed
        for name, of_wheelset in STABILITY_FIGURES.items():
            wanted[f"stability_{name}"] = partial(of_wheelset.draw, *given), of_wheelset.title
    output.mkdir(parents=True, exist_ok=True)
    for name, (draw, title) in wanted.items():
        drawn = draw()
        paths = save_pictures(drawn, output, name)
        _say(f"{paths[0]}, {paths[1].name}: {title}")


@main.command()
@click.argument("model", required=False)
@click.option("--open/--no-open", "shown", default=True, help="Show it in the browser.")
@_output_option("contactlib-explorer.html", "HTML file.")
def explore(model: str | None, shown: bool, output: Path) -> None:
    """Write a page that runs the kernel live, and open it.

    It is one file that works offline, in any browser. It starts with MODEL, whose law must be
    Carter and Griffith's, or with the roller rig if that is left out.
    """
    from contactlib.explorer import open_in_browser, write_explorer

    written = write_explorer(output, model)
    if shown and not open_in_browser(written):
        _say("No browser could be opened here: open the file in any.")
    _say(f"The page is {written}")


if __name__ == "__main__":
    sys.exit(main())
