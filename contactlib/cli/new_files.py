"""Output of the commands `new` and `table`: template files, and tables for other tools."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from contactlib.base.quantities import warn
from contactlib.base.text import fixed_width
from contactlib.base.units import in_si
from contactlib.base.writing import package_folder, write_whole
from contactlib.cli.console import ConsoleReporter, print_line
from contactlib.export.lookup import known_format, lookup_table, write_lookup_table
from contactlib.files.model import Model
from contactlib.files.reading import file_kind, model_path, parse, shipped_files
from contactlib.laws.hertz import WHEEL_LOAD
from contactlib.table.law_tables import build_carter_griffith_table

TEMPLATES = Path(__file__).parents[1] / "files" / "templates"
NEXT = {"force": "fmu", "model": "explore", "scenario": "simulate", "sweep": "sweep"}


def write_template(kind: str, output: Path | None, overwrite: bool) -> None:
    """Write a commented file of a kind or name, and print the next command.

    A name of a shipped file gives a copy of it, any other one a model.

    Raises
    ------
    ValueError
        If the file is there and must not be overwritten, or has two names.
    """
    source, path = TEMPLATES / f"{kind}.toml", output or Path(f"my_{kind}.toml")
    if kind.endswith(".toml"):
        source, path = package_folder("models") / Path(kind).name, output or Path(kind)
        if not source.is_file():
            if output is not None:
                raise ValueError(f"new: give one file to write, not {kind} and {output}")
            source = TEMPLATES / "model.toml"
        kind = file_kind(source)
    if path.exists() and not overwrite:
        raise ValueError(f"{path} already exists: --overwrite replaces it")
    text = source.read_text(encoding="ascii").replace(f"my_{source.name}", path.name)
    write_whole(path, text.encode())
    print_line(f"{path}: to try it, contactlib {NEXT[kind]} {path}")


def list_shipped() -> None:
    """List the shipped files: kind, name and title."""
    rows = [
        (name, kind, str(parse(model_path(name))["name"]))
        for kind, names in shipped_files().items()
        for name in names
    ]
    print_line(fixed_width([(name, f"{kind:8}  {title}") for name, kind, title in rows]))


def write_table(
    load: Callable[[], Model], output: Path, rebuild: bool, options: dict[str, Any]
) -> None:
    """Write the creep force as a table, or the table of the law, in the format of the ending."""
    given = {name: value for name, value in options.items() if value is not None}
    if output.suffix not in ("", ".bin"):
        known_format(output)
        if rebuild:
            raise ValueError(f"--rebuild is for a file that ends in .bin, not {output.suffix}")
        for name, unit in (("load", "N"), ("speed", "m/s"), ("friction_scale", "1")):
            if name in given:
                given[name] = _numbers(f"--{name.replace('_', '-')}", given[name], unit)
        if "load" in given:
            given["axle_load"] = given.pop("load")
        curve = lookup_table(load(), **given)
        sizes = " x ".join(f"{size} {name}" for name, size in curve.sizes.items())
        print_line(
            f"{write_lookup_table(curve, output)}: {sizes}, largest error of "
            f"interpolation found {curve.attrs['largest_error_found']:.2g} of the largest force"
        )
        return
    if given:
        name = next(iter(given)).replace("_", "-")
        raise ValueError(f"--{name} is for a file that ends in .csv, .mat or .nc")
    element = load().wheelset.element
    made = element.table
    if rebuild and made.law.startswith("CarterGriffith"):
        with ConsoleReporter().step("Building the table of the law") as progress:
            made = build_carter_griffith_table(
                made.options["contact"], progress, layers=element.layer_compliance > 0.0
            )
    print_line(
        f"{made.save(output)}: {made.law}, largest error found {made.max_error:.2g} in the "
        f"traction ratio and {made.max_slope_error:.2g} in its slope, at "
        f"{made.certificate_points} points"
    )


def _numbers(option: str, text: str, unit: str) -> float | list[float] | slice:
    """Numbers of an option: one, several, or a range."""
    parts = text.replace(":", ",").split(",")
    try:
        values = [in_si(part, unit, bare=True) for part in parts]
    except ValueError as error:
        raise ValueError(f"{option} = {text!r} {error}") from None
    if option == "--load":
        for warning in filter(None, (WHEEL_LOAD.warning(option, value) for value in values)):
            warn(warning)
    if ":" in text:
        if len(values) != 2 or "," in text:
            raise ValueError(f"{option} = {text!r} must be a range of two numbers, as 0.5:1")
        return slice(*values)
    return values if len(values) > 1 else values[0]
