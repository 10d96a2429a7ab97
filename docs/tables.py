"""Tables of the reference pages, written from the code's declarations.

Between ``<!-- keys contact -->`` and ``<!-- end -->`` a page has the table of that name, so that a
code host shows it too. Name, unit, limits and default come from the declaration, the meaning from
the docstring of the class or function that declares.

    python docs/tables.py    # writes all of them anew

The tests fail for a page whose tables are not those of the code.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import MISSING, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from fmpy import read_model_description
from numpydoc.docscrape import NumpyDocString

import contactlib as cl
from contactlib.base.quantities import Limits, Parameter, Quantity, declared
from contactlib.base.units import UNITS
from contactlib.base.writing import write_whole
from contactlib.files.model import RUN
from contactlib.files.reading import shipped_files
from contactlib.files.scenario import CONTINUOUS, KINDS
from contactlib.files.scenario import SECTIONS as OF_SCENARIO
from contactlib.files.sections import LAWS, VEHICLE_SECTIONS, Keys
from contactlib.runs.signals import (
    OF_BRAKES,
    OF_PADS,
    OF_SAND,
    OF_SHAFTS,
    OF_TRACKS,
    SIDES,
    SIGNALS,
    of_contacts,
)
from contactlib.runs.sweep.axes import WAYS, AxisKeys
from contactlib.runs.sweep.loading import KEYS as OF_SWEEP
from contactlib.runs.sweep.sampling import ANY, draw

GUIDE = Path(__file__).parent

SECTIONS: dict[str, Keys] = {
    **VEHICLE_SECTIONS,
    "model run": RUN,
    **OF_SCENARIO,
    **KINDS,
    "sweep": OF_SWEEP,
    "sampling": declared(draw),
    "axis": {
        key: replace(one, default=None if one.needed else one.default)
        for source in (*reversed(WAYS[False]), *reversed(WAYS[True]), AxisKeys)
        for key, one in declared(source).items()
    },
}


# ---- declarations ---------------------------------------------------------------------------


def meanings(documented: Any) -> dict[str, str]:
    """Meaning of every parameter and attribute that a numpydoc docstring describes."""
    parsed = NumpyDocString(inspect.getdoc(documented) or "")
    return {
        name.strip(): " ".join(line.strip() for line in one.desc)
        for one in (*parsed["Parameters"], *parsed["Attributes"])
        for name in one.name.split(",")
    }


def limits_in_words(limits: Limits) -> str:
    """Bounds as a reader writes them."""
    words = str(limits).replace("finite", "").replace(" and ", ", ").removeprefix(", ")
    return words.replace(">=", "\u2265").replace("<=", "\u2264").replace(" ", "\u00a0")


def usual_in_words(quantity: Quantity) -> str:
    """Usual range, beyond which a file's value is warned of."""
    if quantity.usual is None:
        return ""
    return "{:g} to {:g}".format(*quantity.usual).replace(" ", "\u00a0")


def units_in_words(unit: str) -> str:
    """The unit and those that a file may name."""
    words = ", ".join([unit, *UNITS.get(unit, {})])
    return words.replace(" ", "\u00a0") if len(words) < 10 else words


def default_in_words(default: object) -> str:
    """Default of a key."""
    if default is MISSING:
        return "required"
    if default in (None, ()):
        return ""
    return f"{default:g}" if isinstance(default, float) else str(default).lower()


def key_rows(section: str) -> list[tuple[str, str, str, str, str, str]]:
    """Key, unit, limits, usual range, default and meaning of all keys; parts may be empty."""
    designed = section in cl.CONTROLLERS
    rows = []
    for key, one in SECTIONS[section].items():
        quantity, limits = one.quantity, ", ".join(map(str, one.choices)).lower()
        unit = "" if one.choices else "text"
        if quantity is not None:
            whole = "whole" if quantity.whole else "" if quantity is ANY else None
            unit = units_in_words(quantity.unit) if whole is None else whole
            limits = limits_in_words(quantity)
        rows.append(
            (
                key,
                f"list of {unit or 'numbers'}" if one.many else unit,
                limits,
                "" if quantity is None else usual_in_words(quantity),
                "designed" if one.needed and designed else default_in_words(one.default),
                tidy(meaning_of(one)),
            )
        )
    return rows


def meaning_of(one: Parameter) -> str:
    """Description of a parameter in the first docstring that has one, also of the class's bases."""
    for source in one.described_by:
        for documented in getattr(source, "__mro__", (source,)):
            known = meanings(documented)
            if one.name in known:
                return known[one.name]
    return ""


def tidy(meaning: str) -> str:
    """A docstring's words in a table, where the unit has a column and code is Markdown's."""
    words = re.sub(r" ?\[[^\]]{1,24}\](_|(?=[.:;,]|$))", "", meaning).strip(" .")
    return re.sub(r"``([^`]+)``", r"`\1`", f"{words}." if words else "")


# ---- tables ---------------------------------------------------------------------------------


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Markdown of a table; a column that is empty throughout is left out."""
    cells = [list(row) for row in rows]
    kept = [i for i in range(len(head)) if any(row[i] for row in cells)]
    lines = [[head[i] for i in kept], ["---"] * len(kept)]
    lines += [[row[i].replace("|", r"\|") for i in kept] for row in cells]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def keys(section: str) -> str:
    """Keys of a section of a file.

    Raises
    ------
    ValueError
        If no docstring gives the meaning of a key, or two keys have the same.
    """
    rows: list[tuple[str, ...]] = []
    known: dict[str, str] = {}
    for key, *columns, meaning in key_rows(section):
        if not meaning:
            raise ValueError(f"no docstring gives the meaning of {section}.{key}")
        if meaning in known:
            raise ValueError(f"{section}: {known[meaning]} and {key} have one meaning")
        known[meaning] = key
        rows.append((f"`{key}`", *columns, meaning))
    return table(("key", "unit", "limits", "usual", "default", "meaning"), rows)


def controllers() -> str:
    """Heading, sentence and table of every kind of controller."""
    parts = []
    for kind, controller in {**cl.CONTROLLERS, **CONTINUOUS}.items():
        summary = (inspect.getdoc(controller) or "").splitlines()[0]
        of_kind = keys(kind) if KINDS[kind] else ""
        parts.append(f'### kind = "{kind}"\n\n{summary}\n\n{of_kind}'.rstrip())
    return "\n\n".join(parts)


def laws() -> str:
    """Kinds of law that a model file can name."""
    rows = [
        (f"`{kind}`", ", ".join(f"`{key}`" for key in law.keys), law.meaning)
        for kind, law in LAWS.items()
    ]
    return table(("kind", "keys", "meaning"), rows)


def shipped(kind: str) -> str:
    """Sentence with the names of the shipped files of a kind."""
    *names, last = (f"`{name}`" for name in shipped_files()[kind])
    return f"Shipped are {', '.join(names)} and {last}."


def outcomes(of: str) -> str:
    """Numbers that a sweep reports."""
    known: Mapping[str, Any] = cl.runs.ANALYSES if of == "analysis" else cl.runs.OUTCOMES
    rows = [(f"`{name}`", one.unit, one.description) for name, one in known.items()]
    return table(("outcome", "unit", "meaning"), rows)


def signals(of: str) -> str:
    """Signals of every run, or those of the contact."""
    of_runs = SIGNALS | OF_SHAFTS | OF_BRAKES | OF_PADS | OF_SAND | OF_TRACKS
    known = of_contacts() if of == "contacts" else of_runs
    both = "".join(f", `_{side}`" for side in SIDES)
    rows = [
        (f"`{name}`{both if one.sides else ''}", one.unit, one.description)
        for name, one in known.items()
    ]
    return table(("signal", "unit", "meaning"), rows)


CAUSALITIES: dict[str, Callable[[Any], bool]] = {
    "Inputs": lambda v: v.causality == "input",
    "Outputs": lambda v: v.causality == "output",
    "Parameters, tunable during a run": lambda v: (
        v.causality == "parameter" and v.variability == "tunable"
    ),
    "Parameters, fixed during a run": lambda v: (
        v.causality == "parameter" and v.variability != "tunable"
    ),
    "Inner variables": lambda v: v.causality == "local",
}


def variable_row(v: Any) -> tuple[str, ...]:
    """Name, unit, limits, start of the roller rig, and meaning of an FMU's variable."""
    low, high = (None if bound is None else float(bound) for bound in (v.min, v.max))
    limits = Limits(
        at_least=-float("inf") if low is None else low,
        at_most=float("inf") if high is None else high,
    )
    start = "" if v.start is None else str(v.start).split()[0]
    start = start if v.type == "Boolean" or not start else f"{float(start):.4g}"
    unit = v.unit or (v.type if v.type != "Real" else "1")
    return f"`{v.name}`", unit, limits_in_words(limits), start, v.description or ""


def described(model: cl.Model | cl.Scenario, kind: str = "force_element") -> list[Any]:
    """Variables of an FMU of a kind; those of a vehicle's axles as arrays."""
    version = 3 if kind == "vehicle" else 2
    with TemporaryDirectory() as folder:
        path = cl.export_fmu(model, Path(folder) / "it.fmu", kind=kind, fmi_version=version)
        found: list[Any] = read_model_description(str(path)).modelVariables
        return found


def variables(kind: str) -> str:
    """Variables of an FMU of a kind."""
    model: cl.Model | cl.Scenario = cl.load_model("locomotive.toml")
    if kind == "vehicle":
        model = cl.load_scenario("coach_braking.toml")
    found, parts = described(model, kind), []
    for title, chosen in CAUSALITIES.items():
        rows = [variable_row(v) for v in found if chosen(v)]
        if rows:
            head = ("variable", "unit", "limits", "start", "meaning")
            parts.append(f"**{title}**\n\n{table(head, rows)}")
    return "\n\n".join(parts)


ADDED: dict[str, dict[str, Any]] = {  # keys of an element or its friction
    "memory": {"memory": True},
    "heat": {"softening_temperature": 900.0},
    "layer": {"slope_reduction": 1.0, "layer_compliance": 2e-13},
    "slip-rate fall": {"slip_rate_residual": 0.5, "slip_rate_decay": 0.6},
}


def added(what: str) -> str:
    """Variables that a feature adds to the FMU of a kind: its name after the kind's."""
    kind, _, feature = what.partition(" ")
    model = cl.load_model("locomotive.toml")
    element, keys = model.wheelset.element, ADDED[feature]
    of_friction = {key: value for key, value in keys.items() if hasattr(element.friction, key)}
    others = {key: value for key, value in keys.items() if key not in of_friction}
    element = replace(element, friction=replace(element.friction, **of_friction), **others)
    changed = replace(model, wheelset=replace(model.wheelset, element=element))
    plain = {v.name for v in described(model, kind)}
    rows = []
    for v in described(changed, kind):
        role = f"{v.variability} parameter" if v.causality == "parameter" else v.causality
        name, *columns = variable_row(v)
        if v.name not in plain:
            rows.append((name, role, *columns))
    return table(("variable", "role", "unit", "limits", "start", "meaning"), rows)


# ---- pages ----------------------------------------------------------------------------------

TABLES: Mapping[str, Callable[..., str]] = {
    one.__name__: one
    for one in (added, controllers, keys, laws, outcomes, shipped, signals, variables)
}
PLACE = re.compile(r"<!-- (\w+) ?([^>]*?) -->\n.*?<!-- end -->", re.DOTALL)


def filled(text: str) -> str:
    """A page with all of its tables written anew."""

    def write(place: re.Match[str]) -> str:
        name, argument = place.groups()
        made = TABLES[name](*[argument] if argument else [])
        return f"<!-- {name}{' ' * bool(argument)}{argument} -->\n\n{made}\n\n<!-- end -->"

    return PLACE.sub(write, text)


def pages() -> Iterator[Path]:
    """Pages that have such tables."""
    for path in sorted(GUIDE.rglob("*.md")):
        if PLACE.search(path.read_text(encoding="utf-8")):
            yield path


if __name__ == "__main__":
    for page in pages():
        write_whole(page, filled(page.read_text(encoding="utf-8")).encode())
