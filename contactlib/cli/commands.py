"""The command ``contactlib`` and its subcommands."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from contactlib.cli.console import (
    ConsoleReporter,
    Group,
    Pace,
    complain,
    drawing_options,
    in_unit,
    say,
    with_progress,
)

if TYPE_CHECKING:
    from contactlib.files.model import Model

EXAMPLE = "roller_rig.toml"


def _load(name: str) -> Model:
    from contactlib.files.model import load_model

    model = with_progress(lambda progress: load_model(name, progress=progress))
    if note := model.wheelset.element.table.note:
        say(note)
    return model


def _output_option(default: str, text: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    return click.option(
        "-o",
        "--output",
        type=click.Path(path_type=Path),
        default=default,
        show_default=True,
        help=text,
    )


@click.group(cls=Group, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="contactlib", prog_name="contactlib")
def main() -> None:
    """Creep force element for vehicle dynamics: from the creep law to a running FMU.

    MODEL is a TOML file or the name of a shipped one: a model, or for `simulate` also a scenario.
    SWEEP is the TOML file of a sweep or the name of a shipped one.
    """


@main.command()
@_output_option("contactlib-demo", "Folder for figures, FMU, CSV files, page and summary.json.")
def demo(output: Path) -> None:
    """Show table, run-away, creep control, FMU and explorer."""
    from contactlib.cli.demo import run_demo

    summary = run_demo(output, ConsoleReporter())
    pictures = ", ".join(sorted(p.name for p in output.glob("*.png")))
    say(f"\nThe pictures are in {output}: {pictures}")
    say(f"All numbers above are in {summary}; the FMU is {output / 'CreepForceElement.fmu'}")
    say(f"To try it live, open {output / 'explorer.html'} in a browser")
    say("Next: contactlib simulate dry_wet_dry.toml --compare; contactlib figures --stability")


@main.command()
@click.argument("model")
@click.option("--control", help="Name of a controller in the file. Default: the first.")
@click.option(
    "--controller",
    metavar="FILE.py:NAME",
    help="Run FILE.py, and a scenario under the controller of your own that it calls NAME, a class "
    "or an object.",
)
@click.option("--compare", is_flag=True, help="Run all controllers and compare them.")
@click.option(
    "--seed", type=click.IntRange(0), help="Seed of the sensor noise. Default: the file's."
)
@drawing_options
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="Folder for metrics, time series and figures. Default: contactlib-NAME, for NAME.toml.",
)
def simulate(
    model: str,
    control: str | None,
    controller: str | None,
    compare: bool,
    seed: int | None,
    output: Path | None,
    formats: tuple[str, ...],
) -> None:
    """Run MODEL, a scenario or a model, and write a report.

    The controllers of a model are its two runs, torque and creep.
    """
    from contactlib.cli.report import write_report
    from contactlib.runs.study import open_study

    if compare and control is not None:
        raise ValueError(f"--control {control} cannot be combined with --compare, which runs all")
    if controller is not None and control is not None:
        raise ValueError("--control cannot be combined with --controller; --compare runs all")
    own = {}
    if controller is not None:
        from contactlib.cli.own_controller import load_controller

        control, found = load_controller(controller)
        own = {control: found}
    study = with_progress(
        lambda progress: open_study(model, seed=seed, controllers=own, progress=progress)
    )
    runs = study.chosen(control, every=compare)
    folder = output or Path(f"contactlib-{Path(model).stem}")
    write_report(study, runs, folder, ConsoleReporter(), formats)
    say(f"Metrics, time series and figures are in {folder}")


@main.command()
@click.argument("model")
@_output_option(
    "creep_table.bin",
    "File: .csv, .mat, .npz or .nc for a table of the creep force, .bin for the kernel's table.",
)
@click.option("--load", help="Loads, as 50kN,100kN, or a range, as 50kN:150kN. Default: nominal.")
@click.option("--speed", help="Speeds likewise, as 5,20 or '18 km/h:72 km/h'. Default: 10 m/s.")
@click.option("--friction-scale", help="Factors on friction likewise, as 0.5:1. Default: 1.")
@click.option("--largest-creepage", callback=in_unit("1"), help="End of the creepages. Default: 1.")
@click.option(
    "--error",
    type=float,
    help="Largest error of interpolation over the largest force. Default: 1e-3, cubic 1e-5.",
)
@click.option("--interpolation", type=click.Choice(["linear", "cubic"]), help="Default: linear.")
@click.option(
    "--rebuild", is_flag=True, help="For .bin: solve the law instead of reading its shipped table."
)
def table(model: str, output: Path, rebuild: bool, **options: Any) -> None:
    """Write the creep force of MODEL as a table, or the table of its law.

    The points of the first are chosen so that interpolation between them keeps the error, which
    the file states.
    """
    from contactlib.cli.new_files import write_table

    write_table(partial(_load, model), output, rebuild, options)


class _KindOrFile(click.Choice[str]):
    """One of the choices, or the name of the file to write."""

    def convert(self, value: Any, *context: Any) -> Any:
        return value if str(value).endswith(".toml") else super().convert(value, *context)


@main.command()
@click.argument("kind", type=_KindOrFile(["model", "force", "scenario", "sweep"]), default="model")
@click.option("--list", "shipped", is_flag=True, help="List the shipped files instead.")
@click.option("--overwrite", is_flag=True, help="Replace a file that is there.")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="File. Default: my_KIND.toml."
)
def new(kind: str, shipped: bool, overwrite: bool, output: Path | None) -> None:
    """Write a commented file to start from, ready to run.

    KIND is model (a wheelset and two runs, the default), force (only a wheel's creep force, for an
    FMU or a table), scenario or sweep; a name such as my_wheelset.toml writes a model there.
    """
    from contactlib.cli.new_files import say_shipped, write_template

    if kind.endswith(".toml"):
        if output is not None:
            raise ValueError(f"new: give one file to write, not {kind} and {output}")
        kind, output = "model", Path(kind)
    if shipped:
        say_shipped()
    else:
        write_template(kind, output, overwrite)


@main.command()
@click.argument("model")
@click.option(
    "--kind",
    type=click.Choice(["force_element", "wheelset", "wheelset_body", "creep_forces"]),
    help="Creep force for given velocities (default), wheelset with its creep force, wheelset "
    "without it, or forces and spin moment for given ellipse, load and creepages.",
)
@click.option(
    "--fmi", type=click.Choice(["2", "3"]), default="2", show_default=True, help="FMI version."
)
@click.option(
    "--platforms",
    help="Comma-separated, such as x86_64-linux,x86_64-windows, or all. Default: this machine's. "
    "What the installation lacks is compiled once, which takes up to some minutes and needs pip "
    "install 'contactlib[platforms]'.",
)
@click.option(
    "--relaxation-length",
    callback=in_unit("m"),
    help="Let the force lag the creepage by this distance [m].",
)
@click.option("--implicit", is_flag=True, help="Let the element solve its slip over each step.")
@click.option(
    "--parallel-exchange", is_flag=True, help="Both sides of the coupling step in parallel."
)
@click.option("--author", help="Author of the exported model.")
@click.option("--version", help="Version of the exported model.")
@click.option(
    "--ssp",
    is_flag=True,
    help="Export an SSP package instead: force element and wheelset, coupled, with parameters.",
)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="File. Default: CreepForceElement.fmu, Wheelset.fmu, WheelsetBody.fmu, CreepForces.fmu or "
    "CreepForceSystem.ssp.",
)
def fmu(
    model: str,
    kind: str | None,
    fmi: str,
    platforms: str | None,
    relaxation_length: float | None,
    implicit: bool,
    parallel_exchange: bool,
    author: str | None,
    version: str | None,
    ssp: bool,
    output: Path | None,
) -> None:
    """Export MODEL as an FMU, or as an SSP package.

    The FMU supports model exchange and co-simulation.
    """
    from contactlib.export import MODEL_NAMES, SYSTEM_NAME, export_fmu, export_ssp
    from contactlib.export.platforms import to_compile

    names = None if platforms is None else [p.strip() for p in platforms.split(",")]
    if missing := to_compile(names):
        ConsoleReporter().line(f"Compiling for {', '.join(missing)}: minutes, the first time only")
    common: dict[str, Any] = {
        "fmi_version": int(fmi),
        "platforms": names,
        "relaxation_length": relaxation_length,
        "author": author,
        "version": version,
    }
    if ssp:
        chosen = {"kind": kind, "implicit": implicit, "parallel-exchange": parallel_exchange}
        given = [f"--{name}" for name, value in chosen.items() if value]
        if given:
            raise ValueError(f"--ssp cannot be combined with {', '.join(given)}")
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
    say(str(written))


@main.command()
@click.argument("model")
@_output_option("contactlib-kernel", "Folder for contactlib.c, contactlib.h and example.c.")
def kernel(model: str, output: Path) -> None:
    """Write the creep force of MODEL as C source, for programs that import no FMUs.

    The file holds table and parameters. It is C99 and C++, reads no file and allocates nothing.
    """
    from contactlib.export.kernel_source import export_kernel

    say(f"{export_kernel(_load(model), output)}: contactlib.c, contactlib.h and example.c")


@main.command()
@click.argument("sweep")
@click.option(
    "--workers",
    type=click.IntRange(1),
    help="Number of threads or processes. Default: one per processor.",
)
@click.option(
    "--processes",
    is_flag=True,
    help="Use processes instead of threads; faster for the analysis, which is in Python.",
)
@click.option("--cluster", metavar="ADDRESS", help="Dask scheduler, such as tcp://10.0.0.1:8786.")
@click.option(
    "--chunk", type=click.IntRange(1), help="Runs per chunk, the most that a kill can lose."
)
@click.option("--restart", is_flag=True, help="Discard previous results in OUTPUT and start again.")
@click.option("--controller", hidden=True)
@click.option("--no-maps", is_flag=True, help="Do not draw maps.")
@drawing_options
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="Folder for the NetCDF file and the maps. Default: contactlib-NAME, for NAME.toml.",
)
def sweep(
    sweep: str,
    workers: int | None,
    processes: bool,
    cluster: str | None,
    chunk: int | None,
    restart: bool,
    controller: str | None,
    no_maps: bool,
    output: Path | None,
    formats: tuple[str, ...],
) -> None:
    """Run SWEEP, a scenario over many values of its parameters.

    If it is stopped or killed at any time, the same command continues from there. SWEEP is a TOML
    file or the name of a shipped one, which contactlib --help lists.
    """
    from contactlib.runs import sweep as sweeps

    if controller is not None:
        raise ValueError(
            "--controller: own controllers are run by contactlib.ensemble(sweep, controllers={...})"
        )
    if cluster is not None and (processes or workers is not None):
        raise ValueError("--cluster cannot be combined with --processes or --workers")
    loaded = with_progress(lambda progress: sweeps.load_sweep(sweep, progress=progress))
    folder = output or Path(f"contactlib-{loaded.stem}")
    count = workers or sweeps.default_workers()
    if cluster is not None:
        opened = sweeps.cluster_workers(cluster)
    else:
        opened = (sweeps.process_workers if processes else sweeps.thread_workers)(count)
    reporter, pace = ConsoleReporter(), Pace()
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
                f"Stopped. Finished chunks are kept in {folder}; the same command continues"
            )
            raise
        if pace.part > 0.0 and loaded.simulated_time > 0.0:
            rate = pace.part * loaded.simulated_time / pace.elapsed
            reporter.line(f"{pace.elapsed:.1f} s, {rate:.0f} simulated s per s")
    for line in sweeps.report(loaded, found):
        reporter.line(line)
    all_failed = bool((found["failed"] == 1).all())
    if not (no_maps or all_failed):
        from contactlib.figures import draw_maps

        with reporter.step("Drawing the maps"):
            draw_maps(found, folder, formats)
    beside = "" if no_maps or all_failed else ", and maps beside it"
    reporter.line(f"The results are in {sweeps.results_path(loaded, folder)}{beside}")
    if all_failed:
        complain("contactlib: all runs failed")
        click.get_current_context().exit(1)


@main.command()
@click.argument("scenario")
@click.argument("controllers", metavar="[CONTROLLER]...", nargs=-1)
@click.option(
    "--also",
    multiple=True,
    metavar="SCENARIO",
    help="Search settings that suit this scenario as well; can be given several times.",
)
@click.option(
    "--trials", default=600, show_default=True, help="Settings to try for each controller."
)
@click.option("--seeds", default=1, show_default=True, help="Sequences of noise for each sensor.")
@drawing_options
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="Folder for settings, table and figure. Default: contactlib-tune-NAME, for NAME.toml.",
)
def tune(
    scenario: str,
    controllers: tuple[str, ...],
    also: tuple[str, ...],
    trials: int,
    seeds: int,
    output: Path | None,
    formats: tuple[str, ...],
) -> None:
    """Search settings of traction controllers, with the same budget for each, and compare them.

    Default: all controllers of SCENARIO that have settings. Every trial runs with the sensors of
    the file, and with sensors that err as the controller does not know. The settings found go into
    settings.toml, as sections of a scenario file; errors.csv has the force that every controller
    uses with them while friction limits.
    """
    from contactlib.cli.report import write_tuning
    from contactlib.files.scenario import load_scenario

    loaded = with_progress(lambda progress: [load_scenario(one) for one in (scenario, *also)])
    folder = output or Path(f"contactlib-tune-{Path(scenario).stem}")
    write_tuning(loaded, controllers, folder, ConsoleReporter(), formats, trials, seeds)
    say(f"Settings, table and figure are in {folder}")


@main.command()
@click.option(
    "--paper", is_flag=True, help="Draw figures 1 to 6 of the paper, and the contact patch."
)
@click.option(
    "--stability",
    "model",
    metavar="[MODEL]",
    is_flag=False,
    flag_value=EXAMPLE,
    help=f"Stability figures of the wheelset of MODEL. Default: {EXAMPLE}.",
)
@drawing_options
@_output_option("contactlib-figures", "Folder for the figures.")
def figures(paper: bool, model: str | None, output: Path, formats: tuple[str, ...]) -> None:
    """Draw the laws or a wheelset's stability.

    A figure that cannot be drawn gives a line and exit status 1, after all others are drawn.
    """
    from contactlib.figures import CONTACT_PATCH, PAPER_FIGURES, STABILITY_FIGURES, save_pictures
    from contactlib.stability import find_fold

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
        find_fold(loaded.wheelset, speed=loaded.initial_speed)  # without which there is nothing
        for name, figure_of in STABILITY_FIGURES.items():
            wanted[f"stability_{name}"] = partial(figure_of.draw, *given), figure_of.title
    output.mkdir(parents=True, exist_ok=True)
    failed = False
    for name, (draw, title) in wanted.items():
        try:
            figure = draw()
        except (ValueError, RuntimeError) as error:
            failed = True
            complain(f"contactlib: no {name}: {error}")
            continue
        first, *others = save_pictures(figure, output, name, formats)
        say(f"{', '.join([str(first), *(path.name for path in others)])}: {title}")
    if failed:
        click.get_current_context().exit(1)


@main.command()
@click.argument("model", required=False)
@click.option("--open/--no-open", "shown", default=True, help="Open the page in the browser.")
@_output_option("contactlib-explorer.html", "HTML file.")
def explore(model: str | None, shown: bool, output: Path) -> None:
    """Write a page that runs the kernel live, and open it.

    The page is one file that works offline in any browser. It starts with MODEL, whose law must
    be Carter-Griffith's. Default: the roller rig.
    """
    from contactlib.export.explorer import open_in_browser, write_explorer

    written = write_explorer(output, model)
    if shown and not open_in_browser(written):
        say("No browser could be opened here; open the file in any browser.")
    say(f"The page is {written}")
