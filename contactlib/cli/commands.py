"""The command ``contactlib``: its subcommands that run something; the others are in `exports`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from contactlib.cli.console import (
    ConsoleReporter,
    Group,
    Pace,
    Whole,
    complain,
    drawing_options,
    in_unit,
    output_option,
    print_line,
    with_progress,
)
from contactlib.cli.exports import EXPORTS

if TYPE_CHECKING:
    from xarray import Dataset

    from contactlib.runs.sweep import Sweep


@click.group(cls=Group, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="contactlib-rail", prog_name="contactlib")
def main() -> None:
    """Creep force element for vehicle dynamics: from the creep law to a running FMU.

    MODEL, SCENARIO and SWEEP are TOML files or the names of shipped ones.
    """


for command in EXPORTS:
    main.add_command(command)


@main.command()
@output_option("contactlib-demo", "Folder for figures, FMU, CSV files, page and summary.json.")
def demo(output: Path) -> None:
    """Show table, slip-away, creep control, FMU and explorer."""
    from contactlib.cli.demo import run_demo

    summary = run_demo(output, ConsoleReporter())
    pictures = ", ".join(sorted(p.name for p in output.glob("*.png")))
    print_line(f"\nThe pictures are in {output}: {pictures}")
    print_line(f"All numbers above are in {summary}; the FMU is {output / 'CreepForceElement.fmu'}")
    print_line(f"To try it live, open {output / 'explorer.html'} in a browser")
    print_line(
        "Next: contactlib simulate dry_wet_dry.toml --compare; contactlib figures --stability"
    )


@main.command()
@click.argument("scenario")
@click.option("--control", help="Name of a controller in the file. Default: the first.")
@click.option(
    "--controller",
    metavar="FILE.py:NAME",
    help="Run FILE.py, and the scenario under the controller of your own that it calls NAME, a "
    "class or an object.",
)
@click.option("--compare", is_flag=True, help="Run all controllers and compare them.")
@click.option("--seed", type=Whole(0), help="Seed of the sensor noise. Default: the file's.")
@click.option(
    "--over",
    type=click.Choice(["time", "distance"]),
    default="time",
    show_default=True,
    help="Axis of the figures.",
)
@click.option(
    "--diagram",
    is_flag=True,
    help="Draw each run on one page of A4 as well; a scenario with a brake needs no option.",
)
@click.option(
    "--slip-limits",
    nargs=2,
    metavar="LOW HIGH",
    callback=lambda c, option, ends: [in_unit("m/s")(c, option, end) for end in ends or ()],
    help="Band of slip speeds in that diagram, such as 0 30km/h. Default: none.",
)
@click.option("--animate", is_flag=True, help="Write the runs as an animation as well, a GIF.")
@drawing_options
@click.option(
    "--signal",
    "signals",
    metavar="NAME",
    multiple=True,
    help="More columns of the time series, such as k_hat or contact_temperature_left. Repeatable.",
)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="Folder for metrics, time series and figures. Default: contactlib-NAME, for NAME.toml.",
)
def simulate(
    scenario: str,
    control: str | None,
    controller: str | None,
    compare: bool,
    seed: int | None,
    over: str,
    diagram: bool,
    slip_limits: list[float],
    animate: bool,
    signals: tuple[str, ...],
    output: Path | None,
    formats: tuple[str, ...],
) -> None:
    """Run SCENARIO under one of its controllers, or all, and write a report."""
    from contactlib.base.quantities import checked_number
    from contactlib.cli.own_controller import load_controller, with_controllers
    from contactlib.cli.report import write_report
    from contactlib.figures.diagram import SLIPS
    from contactlib.files.scenario import load_scenario

    for slip in slip_limits:
        checked_number("--slip-limits", slip, SLIPS)
    if compare and control is not None:
        raise ValueError(f"--control {control} cannot be combined with --compare, which runs all")
    if controller is not None and control is not None:
        raise ValueError("--control cannot be combined with --controller; --compare runs all")
    added = {}
    if controller is not None:
        control, loaded_controller = load_controller(controller)
        added = {control: loaded_controller}
    loaded = with_progress(lambda progress: load_scenario(scenario, progress=progress))
    if seed is not None:
        loaded = replace(loaded, sensors=replace(loaded.sensors, seed=float(seed)))
    loaded = with_controllers(scenario, loaded, added)
    names = list(loaded.controllers)
    if control is not None and control not in names:
        raise ValueError(f"control = {control!r} must be one of: {', '.join(names)}")
    names = names if compare else [control or names[0]]
    folder = output or Path(f"contactlib-{Path(scenario).stem}")
    drawn = diagram or slip_limits or loaded.drivetrain.brake is not None
    page = {"file": Path(scenario).name, "slip_limits": slip_limits} if drawn else None
    write_report(loaded, names, folder, ConsoleReporter(), formats, over, signals, page, animate)
    print_line(f"Metrics, time series and figures are in {folder}")


def _running_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Options of commands that run a sweep."""
    for option in (
        click.option("--restart", is_flag=True, help="Discard previous results in OUTPUT."),
        click.option(
            "--chunk", type=Whole(1), help="Runs per chunk; a kill loses unfinished chunks only."
        ),
        click.option(
            "--cluster", metavar="ADDRESS", help="Dask scheduler, such as tcp://10.0.0.1:8786."
        ),
        click.option(
            "--processes",
            is_flag=True,
            help="Use processes instead of threads; faster for the analysis, which is in Python.",
        ),
        click.option(
            "--workers",
            type=Whole(1),
            help="Number of threads or processes. Default: one per processor.",
        ),
    ):
        command = option(command)
    return command


def _run_sweep(
    loaded: Sweep,
    folder: Path,
    files: Sequence[str] = (),
    *,
    workers: int | None,
    processes: bool,
    cluster: str | None,
    chunk: int | None,
    restart: bool,
) -> Dataset:
    """Run a sweep to a folder with progress, and write its CSV file; return the results."""
    from contactlib.runs import sweep as sweeps

    if cluster is not None and (processes or workers is not None):
        raise ValueError("--cluster cannot be combined with --processes or --workers")
    count, reporter, pace = workers or sweeps.default_workers(), ConsoleReporter(), Pace()
    if cluster is not None:
        opened = sweeps.cluster_workers(cluster, reporter.line, files)
    else:
        opened = (sweeps.process_workers if processes else sweeps.thread_workers)(count)
    with opened as pool:
        reporter.line(f"{loaded.name}: {loaded.summary}; {pool.count} workers")
        try:
            with reporter.countdown("Running", pace) as progress:
                results = sweeps.ensemble(
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
    sweeps.write_table(results, sweeps.results_path(loaded, folder).with_suffix(".csv"))
    return results


@main.command()
@click.argument("sweep")
@_running_options
@click.option(
    "--controller",
    metavar="FILE.py:NAME",
    help="Run FILE.py, and as well the controller of your own that it calls NAME, a class or an "
    "object. Workers of a cluster get FILE.py.",
)
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
    controller: str | None,
    no_maps: bool,
    output: Path | None,
    formats: tuple[str, ...],
    **options: Any,
) -> None:
    """Run SWEEP, a scenario over many values of its parameters.

    If it is stopped or killed at any time, the same command continues from there. SWEEP is a TOML
    file or the name of a shipped one, which contactlib --help lists.
    """
    from contactlib.cli.own_controller import load_controller
    from contactlib.runs import sweep as sweeps

    added = {} if controller is None else dict([load_controller(controller)])
    files = [] if controller is None else [controller.rpartition(":")[0]]
    loaded = with_progress(lambda progress: sweeps.load_sweep(sweep, progress=progress))
    if taken := set(added) & set(loaded.plan.controllers):
        raise ValueError(f"{sweep} has a controller {min(taken)} itself: take another name")
    loaded = sweeps.with_own(loaded, added, {})
    folder, reporter = output or Path(f"contactlib-{loaded.stem}"), ConsoleReporter()
    results = _run_sweep(loaded, folder, files, **options)
    for line in sweeps.report(loaded, results):
        reporter.line(line)
    path = sweeps.results_path(loaded, folder)
    all_failed = bool((results["failed"] == 1).all())
    if not (no_maps or all_failed):
        from contactlib.figures import draw_maps

        with reporter.step("Drawing the maps"):
            draw_maps(results, folder, formats)
    maps = "" if no_maps or all_failed else ", and maps beside them"
    reporter.line(f"The results are in {path} and {path.stem}.csv{maps}")
    if all_failed:
        complain("contactlib: all runs failed")
        click.get_current_context().exit(1)


@main.command()
@click.argument("file")
@click.option(
    "--draws",
    type=Whole(1),
    default=100,
    show_default=True,
    help="Draws at each stop, for the catalogue of a scenario.",
)
@click.option(
    "--repeat",
    type=Whole(0),
    metavar="RUN",
    help="Run only this one of the stops again, and write the report of contactlib simulate.",
)
@_running_options
@drawing_options
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="Folder for all files. Default: contactlib-NAME, for NAME.toml.",
)
def stops(
    file: str,
    draws: int,
    repeat: int | None,
    output: Path | None,
    formats: tuple[str, ...],
    **options: Any,
) -> None:
    """Stop a vehicle many times, for distances with their spread.

    FILE is a scenario that brakes: a catalogue of sixteen stops, at four speeds on four rails, is
    written to OUTPUT as a sweep, NAME_stops.toml, and run with draws of friction, pads, load,
    wheels and sensors. Or it is such a sweep, with speeds, rails and ranges of your own. The
    summary has quantiles of the stopping distances with their confidence intervals. If it is
    stopped or killed at any time, the same command continues from there.
    """
    from contactlib.files.reading import file_kind
    from contactlib.runs import stops as of_stops
    from contactlib.runs import sweep as sweeps

    folder, reporter = output or Path(f"contactlib-{Path(file).stem}"), ConsoleReporter()
    path: str | Path = file
    if file_kind(file) != "sweep":
        path = of_stops.write_stops(file, folder, draws)
    loaded = with_progress(lambda progress: sweeps.load_sweep(path, progress=progress))
    of_stops.check_stops(loaded)
    if repeat is not None:
        from contactlib.cli.report import write_report

        if repeat >= loaded.runs:
            raise ValueError(f"--repeat {repeat} is out of range: must be < {loaded.runs}")
        one = loaded.scenario_of(repeat)
        reporter.line(f"Run {repeat}: {loaded.describe(repeat)}")
        settings, names = loaded.plan.settings_of(repeat, one), list(loaded.plan.controllers)
        folder /= f"run{repeat}"
        page = {"file": f"{Path(path).name}, run {repeat}"}
        write_report(one, names, folder, reporter, formats, diagram=page, settings=settings)
        reporter.line(f"Metrics, time series and figures are in {folder}")
        return
    results = _run_sweep(loaded, folder, **options)
    found = list(of_stops.stops_of(loaded, results))
    reporter.line(of_stops.write_summary(folder, loaded, found))
    from contactlib.figures import save_pictures, stopping_distances

    with reporter.step("Drawing"):
        figure, name = stopping_distances(loaded, found), f"{loaded.stem}.distances"
        save_pictures(figure, folder, name, formats)
    reporter.line(
        f"The summary is in {folder / loaded.stem}.summary.txt, each stop in {loaded.stem}.csv, a "
        f"figure beside it. One stop again, with all signals: contactlib stops {path} --repeat N, "
        "where N is in the column run"
    )


def _split(option: str, text: str, kind: str) -> tuple[str, str]:
    """Name and value that an option gives as one text."""
    name, sign, value = text.partition("=")
    if not sign:
        raise ValueError(f"{option} {text} must be NAME={kind}")
    return name.strip(), value


@main.command()
@click.argument("log", type=click.Path(path_type=Path))
@click.argument("scenario")
@click.option(
    "--column",
    "columns",
    metavar="NAME=HEADER",
    multiple=True,
    help="Header in LOG of a column such as omega_1, drive_torque_2 or speed. Repeatable.",
)
@click.option(
    "--prior",
    "priors",
    metavar="NAME=VALUE",
    multiple=True,
    help="Standard deviation of radius, torque, mass, delay, slope or decay before LOG is known, 0 "
    "if known exactly, as mass=10% or delay=20ms. Repeatable. Default: radius=0.5%, torque=2%.",
)
@click.option(
    "--control",
    help="Controller of SCENARIO for the run on these rails. Default: the first.",
)
@click.option(
    "--draws",
    type=Whole(4, 1000),
    default=32,
    show_default=True,
    help="Maps to draw that are as probable as the log makes them.",
)
@drawing_options
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="Folder for rails.csv, track.csv, constants.csv, rails.txt and figure. "
    "Default: contactlib-rails-LOG.",
)
def rails(
    log: Path,
    scenario: str,
    columns: tuple[str, ...],
    priors: tuple[str, ...],
    control: str | None,
    draws: int,
    output: Path | None,
    formats: tuple[str, ...],
) -> None:
    """Estimate friction along the rails from LOG, a CSV file of a run, and SCENARIO, its vehicle.

    The columns of LOG are those of a run's own time series: time [s], drive_torque_1 [N.m],
    omega_1 [rad/s], speed [m/s] and others. track.csv is a map for [track] of a scenario.
    """
    from contactlib.base.text import known_names
    from contactlib.base.units import in_si
    from contactlib.files.scenario import load_scenario
    from contactlib.logs import LogPriors, estimate_rails, read_log

    named = dict(_split("--column", column, "HEADER") for column in columns)
    spreads, quantities = dict[str, float](), LogPriors.quantities()
    for prior in priors:
        name, value = _split("--prior", prior, "VALUE")
        if name not in quantities:
            raise ValueError(f"--prior: no constant is {name!r}; {known_names(name, quantities)}")
        try:
            spreads[name] = in_si(value, quantities[name].unit, bare=True)
        except ValueError as error:
            raise ValueError(f"--prior {name} = {value!r} {error}") from None
    known = LogPriors(**spreads)
    loaded = with_progress(lambda progress: load_scenario(scenario, progress=progress))
    if control is not None:
        loaded.controller(control)  # refuses a name that is not known
    read = read_log(log, loaded, named)
    folder, reporter = output or Path(f"contactlib-rails-{log.stem}"), ConsoleReporter()
    with reporter.countdown("Estimating", Pace()) as progress:
        estimate = estimate_rails(read, loaded, priors=known, draws=draws, progress=progress)
    estimate.write(folder)
    with reporter.step("Running the scenario on these rails, and drawing"):
        from contactlib.figures import rails_from_log, save_pictures

        replayed = estimate.replayed(control)
        title = f"{loaded.name}: friction behind {log.name}"
        caption = (
            "Kinetic friction coefficient; band: 90 %. Grey: the log gives a lower bound at most. "
            "Slip speeds: orange in the log, blue in the run on these rails."
        )
        figure = rails_from_log(estimate, replayed, title=title, caption=caption)
        save_pictures(figure, folder, "rails", formats)
    for line in estimate.summary().splitlines():
        reporter.line(line)
    reporter.line(f"Friction is in {folder / 'rails.csv'}, a map of it in {folder / 'track.csv'}")


@main.command()
@click.argument("scenario")
@click.argument("controllers", metavar="[CONTROLLER]...", nargs=-1)
@click.option(
    "--controller",
    metavar="FILE.py:NAME",
    help="Run FILE.py, and search the controller of your own that it calls NAME, a class or an "
    "object, which declares its settings in search_ranges.",
)
@click.option(
    "--also",
    multiple=True,
    metavar="SCENARIO",
    help="Search settings that suit this scenario as well; can be given several times.",
)
@click.option(
    "--trials",
    type=Whole(60, 1_000_000),
    default=600,
    show_default=True,
    help="Settings to try for each controller, rounded down to a multiple of 30.",
)
@click.option(
    "--seeds",
    type=Whole(1, 10_000),
    default=1,
    show_default=True,
    help="Sequences of noise for each sensor.",
)
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
    controller: str | None,
    also: tuple[str, ...],
    trials: int,
    seeds: int,
    output: Path | None,
    formats: tuple[str, ...],
) -> None:
    """Search settings of traction controllers, with the same budget for each, and compare them.

    Default: all controllers of SCENARIO that declare settings. The search maximises the mean of
    limited utilisation (force used / available force, while friction limits) and adhesion
    utilisation (force used / force that could be transmitted, in the whole run). Every trial runs
    with the sensors of the file, and with sensor errors that the controller cannot correct. As soon
    as a controller is tuned, its settings go into settings.toml, as a section of a scenario file;
    errors.csv has the force that every controller uses with them while friction limits.
    """
    from contactlib.cli.own_controller import load_controller, with_controllers
    from contactlib.cli.report import write_tuning
    from contactlib.files.scenario import load_scenario

    added = {}
    if controller is not None:
        name, loaded_controller = load_controller(controller)
        added, controllers = {name: loaded_controller}, (*controllers, name)
    loaded = with_progress(
        lambda progress: [
            with_controllers(file, load_scenario(file, progress=progress), added)
            for file in (scenario, *also)
        ]
    )
    folder = output or Path(f"contactlib-tune-{Path(scenario).stem}")
    write_tuning(loaded, controllers, folder, ConsoleReporter(), formats, trials, seeds)
    print_line(f"Settings, table and figure are in {folder}")


@main.command()
@click.option(
    "--controller",
    metavar="FILE.py:NAME",
    help="Run FILE.py, and as well the controller of your own that it calls NAME, a class or an "
    "object.",
)
@click.option(
    "--trials",
    type=Whole(0),
    metavar="N",
    help="Number of settings that were tried when your controller was tuned, for the table.",
)
@click.option(
    "--seed",
    type=Whole(0),
    default=1,
    show_default=True,
    metavar="N",
    help="Seed of the tracks.",
)
@click.option("--small", is_flag=True, help="Run the small form: 24 runs for each, not 840.")
@output_option("contactlib-benchmark", "Folder for benchmark.txt, benchmark.csv, benchmark.json.")
def benchmark(
    controller: str | None, trials: int | None, seed: int, small: bool, output: Path
) -> None:
    """Score traction controllers in a benchmark, so that publications can be compared.

    Its version and seed are part of every output: cite them with a score. All controllers run in
    six scenarios, with 14 sensor errors that they cannot correct, 10 times each; every run has
    noise and a track of its own, which the seed draws. The score of a run is the mean of both
    utilisations (see tune), zero if the run fails; that of a controller is the mean
    over its runs, "+-" the standard error of this mean, "spread" the standard deviation of the
    runs, and "minimum" the worst run. Slip work and jerk are means over the runs.
    """
    from contactlib.cli.own_controller import load_controller
    from contactlib.runs import benchmark as run_benchmark

    if trials is not None and controller is None:
        raise ValueError(f"--trials {trials} needs --controller: it is about a controller of yours")
    added = {} if controller is None else dict([load_controller(controller)])
    tried = {} if trials is None else dict.fromkeys(added, trials)
    reporter = ConsoleReporter()
    with reporter.countdown("Running the benchmark", Pace()) as progress:
        scores = run_benchmark(added, trials=tried, seed=seed, small=small, progress=progress)
    print_line(scores.table())
    scores.write(output)
    print_line(f"The scores and every run are in {output}")
