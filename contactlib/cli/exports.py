"""Commands that write a model in another form, as files of any kind, and files to start from."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from contactlib.cli.console import (
    ConsoleReporter,
    Whole,
    complain,
    drawing_options,
    in_unit,
    output_option,
    print_line,
    with_progress,
)

if TYPE_CHECKING:
    from contactlib.files.model import Model

EXAMPLE = "roller_rig.toml"


def _load(name: str) -> Model:
    from contactlib.files.model import load_model

    model = with_progress(lambda progress: load_model(name, progress=progress))
    if note := model.wheelset.element.table.note:
        print_line(note)
    return model


@click.command()
@click.argument("model")
@output_option(
    "creep_table.bin",
    "File: .csv, .mat or .nc for a table of the creep force, .bin for the kernel's table.",
)
@click.option("--load", help="Loads, as 50kN,100kN, or a range, as 50kN:150kN. Default: nominal.")
@click.option("--speed", help="Speeds likewise, as 5,20 or '18 km/h:72 km/h'. Default: 10 m/s.")
@click.option("--friction-scale", help="Factors on friction likewise, as 0.5:1. Default: 1.")
@click.option("--largest-creepage", callback=in_unit("1"), help="End of the creepages. Default: 1.")
@click.option(
    "--error",
    callback=in_unit("1"),
    help="Largest error of interpolation over the largest force. Default: 1e-3.",
)
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


class _Version(click.Choice[str]):
    """One of the choices, also written with its zero, as 2.0."""

    def convert(self, value: Any, *context: Any) -> Any:
        return super().convert(str(value).removesuffix(".0"), *context)


@click.command()
@click.argument("kind", type=_KindOrFile(["model", "force", "scenario", "sweep"]), default="model")
@click.option("--list", "shipped", is_flag=True, help="List the shipped files instead.")
@click.option("--overwrite", is_flag=True, help="Replace a file that is there.")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="File. Default: my_KIND.toml."
)
def new(kind: str, shipped: bool, overwrite: bool, output: Path | None) -> None:
    """Write a commented file to start from, ready to run.

    KIND is model (a wheelset, the default), force (only a wheel's creep force, for an
    FMU or a table), scenario or sweep; a name such as my_wheelset.toml writes a model there, and
    that of a shipped file a copy of it.
    """
    from contactlib.cli.new_files import list_shipped, write_template

    if shipped:
        list_shipped()
    else:
        write_template(kind, output, overwrite)


@click.command()
@click.argument("model")
@click.option(
    "--kind",
    type=click.Choice(["force_element", "wheelset", "wheelset_body", "creep_forces", "vehicle"]),
    help="Creep force for given velocities (default), wheelset with its creep force, wheelset "
    "without it, forces and spin moment for given ellipse, load and creepages, or the vehicle of a "
    "scenario (its default).",
)
@click.option(
    "--fmi",
    type=_Version(["2", "3"]),
    default="2",
    show_default=True,
    help="FMI version; 2.0 and 3.0 mean the same.",
)
@click.option(
    "--platforms",
    help="Comma-separated, such as x86_64-linux,x86_64-windows, or all. Default: this machine's. "
    "What the installation lacks is compiled once, which takes up to some minutes and needs pip "
    "install 'contactlib-rail[platforms]'.",
)
@click.option("--implicit", is_flag=True, help="Let the element solve its slip over each step.")
@click.option(
    "--parallel-exchange", is_flag=True, help="Both sides of the coupling step in parallel."
)
@click.option(
    "--no-booleans",
    is_flag=True,
    help="Make truth values real numbers, 0 or 1, for tools that read every output as one.",
)
@click.option(
    "--brake-pressure",
    is_flag=True,
    help="Give a vehicle the pressures in its brake cylinders as inputs, for tools that simulate "
    "the pneumatics, in place of commanded torques.",
)
@click.option(
    "--wheels",
    type=Whole(1),
    default=1,
    help="Number of wheels, or of wheelsets, that one FMU steps side by side. Default: 1.",
)
@click.option(
    "--per-wheel",
    help="Comma-separated parameters that each wheel has for itself, such as static_friction. "
    "Default: they have all in common.",
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
    help="File. Default: CreepForceElement.fmu, Wheelset.fmu, WheelsetBody.fmu, CreepForces.fmu, "
    "Vehicle.fmu or CreepForceSystem.ssp.",
)
def fmu(
    model: str,
    kind: str | None,
    fmi: str,
    platforms: str | None,
    implicit: bool,
    parallel_exchange: bool,
    no_booleans: bool,
    brake_pressure: bool,
    wheels: int,
    per_wheel: str | None,
    author: str | None,
    version: str | None,
    ssp: bool,
    output: Path | None,
) -> None:
    """Export MODEL as an FMU, or as an SSP package.

    The FMU supports model exchange and co-simulation. Of a scenario with a vehicle it contains the
    vehicle with its rails, for controllers outside.
    """
    from contactlib.export import export_fmu, export_ssp
    from contactlib.export.description import ASSUMED_INVERSE_MASS, MODEL_NAMES, Description
    from contactlib.export.package import longest_step
    from contactlib.export.platforms import to_compile
    from contactlib.export.ssp import SYSTEM_NAME
    from contactlib.files.model import Missing, Model

    names = None if platforms is None else [p.strip() for p in platforms.split(",")]
    if missing := to_compile(names):
        ConsoleReporter().line(f"Compiling for {', '.join(missing)}: minutes, the first time only")
    common: dict[str, Any] = {
        "fmi_version": int(fmi),
        "platforms": names,
        "author": author,
        "version": version,
    }
    if ssp:
        chosen = {
            "kind": kind,
            "implicit": implicit,
            "parallel-exchange": parallel_exchange,
            "no-booleans": no_booleans,
            "brake-pressure": brake_pressure,
            "wheels": wheels > 1,
            "per-wheel": per_wheel,
        }
        given = [f"--{name}" for name, value in chosen.items() if value]
        if given:
            raise ValueError(f"--ssp cannot be combined with {', '.join(given)}")
        written = export_ssp(_load(model), output or f"{SYSTEM_NAME}.ssp", **common)
    else:
        from contactlib.files.reading import loading, model_path, parse
        from contactlib.files.scenario import load_scenario

        with loading(model):
            of_vehicle = kind in (None, "vehicle") and "demand" in parse(model_path(model))
        kind = kind or ("vehicle" if of_vehicle else "force_element")
        loaded = load_scenario(model) if of_vehicle else _load(model)
        written = export_fmu(
            loaded,
            output or f"{MODEL_NAMES[kind]}.fmu",
            kind=kind,
            implicit=implicit,
            parallel_exchange=parallel_exchange,
            booleans=not no_booleans,
            brake_pressure=brake_pressure,
            wheels=wheels,
            per_wheel=[] if per_wheel is None else [name.strip() for name in per_wheel.split(",")],
            **common,
        )
        if isinstance(loaded, Model) and kind == "force_element" and not implicit:
            steps = [
                1e3 * longest_step(Description(loaded, kind, parallel_exchange=parallel))
                for parallel in (False, True)
            ]
            assumed = ""
            if isinstance(loaded.wheelset, Missing):
                assumed = f" (for {ASSUMED_INVERSE_MASS:g} 1/kg, assumed as there is no inertia)"
            print_line(
                f"Largest stable step at {loaded.initial_speed:g} m/s: {steps[0]:.2g} ms if both "
                f"sides step in turn, {steps[1]:.2g} ms if they step at once{assumed}; with "
                "--implicit, any"
            )
    print_line(str(written))


@click.command()
@click.argument("model")
@output_option("contactlib-kernel", "Folder for contactlib.c and its header.")
def kernel(model: str, output: Path) -> None:
    """Write the creep force of MODEL as C source, for programs that import no FMUs.

    The file holds table and parameters. It is C99 and C++, reads no file and allocates nothing.
    Beside it are examples in C and C# that call it.
    """
    from contactlib.export.kernel_source import export_kernel

    folder = export_kernel(_load(model), output)
    print_line(f"{folder}: {', '.join(sorted(path.name for path in folder.iterdir()))}")


@click.command()
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
@output_option("contactlib-figures", "Folder for the figures.")
def figures(paper: bool, model: str | None, output: Path, formats: tuple[str, ...]) -> None:
    """Draw the laws or a wheelset's stability, with a CSV file of each figure's lines.

    A figure that cannot be drawn gives a line and exit status 1, after all others are drawn.
    """
    from contactlib.figures import CONTACT_PATCH, PAPER_FIGURES, STABILITY_FIGURES, save_pictures

    if not paper and model is None:
        raise ValueError("figures: pass --paper or --stability, or both")
    chosen: dict[str, tuple[Callable[[], Any], str]] = {}
    if paper:
        named = {f"paper_figure_{number}": figure for number, figure in PAPER_FIGURES.items()}
        for name, figure in {**named, "contact_patch": CONTACT_PATCH}.items():
            chosen[name] = figure.draw, figure.title
    if model is not None:
        loaded = _load(model)
        given = loaded.wheelset, loaded.initial_speed
        for name, figure_of in STABILITY_FIGURES.items():
            chosen[f"stability_{name}"] = partial(figure_of.draw, *given), figure_of.title
    output.mkdir(parents=True, exist_ok=True)
    failed = False
    for name, (draw, title) in chosen.items():
        try:
            figure = draw()
        except (ValueError, RuntimeError) as error:
            failed = True
            complain(f"contactlib: no {name}: {error}")
            continue
        data = () if "csv" in formats else ("csv",)
        first, *others = save_pictures(figure, output, name, (*formats, *data))
        print_line(f"{', '.join([str(first), *(path.name for path in others)])}: {title}")
    if failed:
        click.get_current_context().exit(1)


@click.command()
@click.argument("model", required=False)
@click.option("--open/--no-open", "shown", default=True, help="Open the page in the browser.")
@output_option("contactlib-explorer.html", "HTML file.")
def explore(model: str | None, shown: bool, output: Path) -> None:
    """Write a page that runs the kernel live, and open it.

    The page is one file that works offline in any browser of 2023 or later. It starts with MODEL,
    whose law must be Carter-Griffith's. Default: the roller rig.
    """
    from contactlib.export.explorer import open_in_browser, write_explorer

    written = write_explorer(output, model)
    if shown and not open_in_browser(written):
        print_line("No browser could be opened here; open the file in any browser.")
    print_line(f"The page is {written}")


@click.command()
@click.argument("files", nargs=-1)
def conditions(files: tuple[str, ...]) -> None:
    """List the rails that `condition` in a model or scenario file can name, or those of FILES.

    Each is a published parameter set. Below its name are the keys that it gives, the source with
    its table or figure, vehicle and speed, what was fitted, and the largest deviation of the
    traction coefficient from the source.
    """
    from contactlib.files.rail_conditions import condition_names, load_condition
    from contactlib.files.sections import VEHICLE_SECTIONS

    for key in files or condition_names():
        rail = load_condition(key)
        print_line(f"{rail.key}: {rail.name}")
        values = [
            f"{name} = {value:g} {getattr(VEHICLE_SECTIONS[section][name].quantity, 'unit', '')}"
            for section in ("friction", "wheelset")
            for name, value in getattr(rail, section).items()
        ]
        print_line(f"  {', '.join(value.removesuffix(' 1') for value in values)}")
        missing = [key for key in ("static", "kinetic") if key not in rail.friction]
        if not {"k_hat", "weakening_length"} & {*rail.friction}:
            missing.append("k_hat or weakening_length")
        if missing:
            print_line(f"  to be given beside it in a model: {', '.join(missing)}")
        if rail.law:
            reductions = ", ".join(f"{name} = {value:g}" for name, value in rail.law.items())
            print_line(f"  with law.kind = 'polach': {reductions} in place of the layer")
        print_line(f"  source: {rail.source}")
        print_line(f"  numbers in: {rail.table}")
        print_line(f"  read in: {rail.read_in}")
        print_line(f"  vehicle: {rail.vehicle}; speed: {rail.speed}")
        print_line(f"  fitted: {rail.fitted}")
        if rail.comparison:
            print_line(f"  largest deviation: {rail.compared.deviation:g}")


EXPORTS = (table, new, fmu, kernel, figures, explore, conditions)
