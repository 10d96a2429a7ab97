"""Tables of the guide that Sphinx generates from the code's declarations.

A directive in a page becomes a table: ``{keys}`` of a section of a file, ``{outcomes}`` of a sweep,
``{variables}`` of an FMU; ``{names}`` becomes the docstrings of Python names. Name, unit, limits
and default come from the declaration, the meaning from the docstring of the class or function that
declares. A key without a meaning and a public name that no page has are warnings.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import MISSING, replace
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType
from typing import Any

from docutils import nodes
from docutils.utils.math import latex2mathml
from fmpy import read_model_description
from numpydoc.docscrape import NumpyDocString
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective

import contactlib as cl
import contactlib.figures
from contactlib.base.quantities import Limits, Parameter, Quantity, declared
from contactlib.base.units import UNITS
from contactlib.files.model import RUN
from contactlib.files.reading import shipped_files
from contactlib.files.scenario import CONTINUOUS, KINDS
from contactlib.files.scenario import SECTIONS as OF_SCENARIO
from contactlib.files.sections import LAWS, VEHICLE_SECTIONS, Keys
from contactlib.runs.sweep.axes import WAYS, AxisKeys
from contactlib.runs.sweep.loading import KEYS as OF_SWEEP
from contactlib.runs.sweep.sampling import ANY, draw

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
MODULES = ("stability", "torsion", "control_systems", "traction", "figures")
LOGGER = logging.getLogger(__name__)


# ---- docstrings -----------------------------------------------------------------------------


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
    for source in one.said_by:
        for documented in getattr(source, "__mro__", (source,)):
            known = meanings(documented)
            if one.name in known:
                return known[one.name]
    return ""


# ---- directives -----------------------------------------------------------------------------


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Markdown of a table; a column that is empty throughout is left out."""
    cells = [list(row) for row in rows]
    kept = [i for i in range(len(head)) if any(row[i] for row in cells)]
    lines = [[head[i] for i in kept], ["---"] * len(kept)]
    lines += [[row[i].replace("|", r"\|") for i in kept] for row in cells]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


class Generated(SphinxDirective):
    """A directive whose content follows from the code."""

    has_content = True
    optional_arguments = 1
    final_argument_whitespace = True

    def run(self) -> list[nodes.Node]:
        """Parse what `text` gives, at each build: the code may have changed."""
        self.env.note_reread()
        return self.parse_text_to_nodes(self.text(), allow_section_headings=True)

    def text(self) -> str:
        """Markdown."""
        raise NotImplementedError

    def keys(self, section: str) -> str:
        """Table of a section's keys."""
        rows: list[tuple[str, ...]] = []
        known: dict[str, str] = {}
        for key, *columns, meaning in key_rows(section):
            place = self.get_location()
            if not meaning:
                LOGGER.warning("no docstring says what %s.%s means", section, key, location=place)
            elif meaning in known:
                both = known[meaning], key
                LOGGER.warning("%s: %s and %s have one meaning", section, *both, location=place)
            known[meaning] = key
            rows.append((f"`{key}`", *columns, meaning))
        return table(("key", "unit", "limits", "usual", "default", "meaning"), rows)


class KeysOfSection(Generated):
    """Keys of a section of a file."""

    def text(self) -> str:
        """Markdown of the table."""
        return self.keys(self.arguments[0])


class Controllers(Generated):
    """Every kind of controller with its keys."""

    def text(self) -> str:
        """Markdown of a heading, a sentence and a table for each kind."""
        parts = []
        continuous = zip(CONTINUOUS, (cl.TorqueControl, cl.CreepControl), strict=True)
        for kind, controller in (*cl.CONTROLLERS.items(), *continuous):
            summary = (inspect.getdoc(controller) or "").splitlines()[0]
            keys = self.keys(kind) if KINDS[kind] else ""
            parts.append(f'### kind = "{kind}"\n\n{summary}\n\n{keys}'.rstrip())
        return "\n\n".join(parts)


def tidy(meaning: str) -> str:
    """A docstring's words in a table, where the unit has a column and code is Markdown's."""
    words = re.sub(r" ?\[[^\]]{1,24}\](_|(?=[.:;,]|$))", "", meaning).strip(" .")
    return re.sub(r"``([^`]+)``", r"`\1`", f"{words}." if words else "")


class Laws(Generated):
    """Kinds of law that a model file can name."""

    def text(self) -> str:
        """Markdown of the table."""
        rows = [
            (f"`{kind}`", ", ".join(f"`{key}`" for key in law.keys), law.meaning)
            for kind, law in LAWS.items()
        ]
        return table(("kind", "takes", "meaning"), rows)


class Shipped(Generated):
    """Names of the shipped files of a kind, as a part of a sentence."""

    def text(self) -> str:
        """Markdown of a sentence."""
        *names, last = (f"`{name}`" for name in shipped_files()[self.arguments[0]])
        return f"Shipped are {', '.join(names)} and {last}."


class Outcomes(Generated):
    """Numbers that a sweep reports."""

    def text(self) -> str:
        """Markdown of the table."""
        known: Mapping[str, Any] = cl.ANALYSES if self.arguments[0] == "analysis" else cl.OUTCOMES
        return table(
            ("outcome", "unit", "meaning"),
            [(f"`{name}`", one.unit, one.description) for name, one in known.items()],
        )


class Variables(Generated):
    """Variables of an FMU of a kind."""

    def text(self) -> str:
        """Markdown of the tables."""
        with TemporaryDirectory() as folder:
            model = cl.load_model("locomotive.toml")
            path = cl.export_fmu(model, Path(folder) / "it.fmu", kind=self.arguments[0])
            description = read_model_description(str(path))
        parts = []
        for title, chosen in CAUSALITIES.items():
            rows = [variable_row(v) for v in description.modelVariables if chosen(v)]
            if rows:
                head = ("variable", "unit", "limits", "start", "meaning")
                parts.append(f"**{title}**\n\n{table(head, rows)}")
        return "\n\n".join(parts)


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
    start = "" if v.start is None else v.start if v.type == "Boolean" else f"{float(v.start):.4g}"
    unit = v.unit or (v.type if v.type != "Real" else "1")
    return f"`{v.name}`", unit, limits_in_words(limits), start, v.description or ""


class Names(Generated):
    """Docstrings of public names: those of the content, and all that the argument's module has.

    Data, which have no docstring, are a line ``name: what it is``.
    """

    def typed(self) -> dict[str, str]:
        """Meanings in the directive's content."""
        found: dict[str, str] = {}
        key = ""
        for line in self.content:
            name, colon, meaning = line.partition(": ")
            if colon and name.replace(".", "").isidentifier():
                key, line = name, meaning
            found[key] = f"{found.get(key, '')} {line}".strip()
        return found

    def text(self) -> str:
        """Markdown that holds autodoc's directives."""
        typed = self.typed()
        names = [*typed.pop("", "").split(), *typed]
        if self.arguments:
            home = f"contactlib.{self.arguments[0]}"
            there = [n for n in cl.__all__ if f"{cl._HOMES[n]}.".startswith(f"{home}.")]
            names = [*(n for n in there if n not in names), *names]
        self.env.__dict__.setdefault("guide_names", set()).update(names)
        parts = [documented_name(name, typed.get(name)) for name in names]
        return "```{eval-rst}\n" + "\n".join(parts) + "\n```"


def documented_name(name: str, typed: str | None) -> str:
    """Directive for a public name."""
    if typed is not None:
        return f".. py:data:: contactlib.{name}\n\n   {typed}\n"
    value: Any = cl
    for part in name.split("."):
        value = getattr(value, part)
    if inspect.ismodule(value):
        return f".. automodule:: {value.__name__}\n"
    if inspect.isclass(value):
        return f".. autoclass:: contactlib.{name}\n   :members:\n"
    return f".. autofunction:: contactlib.{name}\n"


def public_names() -> set[str]:
    """Every name that the reference must have; what is on top is not repeated for a subpackage."""
    top = {name for name in dir(cl) if not isinstance(getattr(cl, name), ModuleType)}
    known = {id(getattr(cl, name)) for name in top}
    inner = {
        f"{module}.{name}"
        for module in MODULES
        for name in getattr(cl, module).__all__
        if id(getattr(getattr(cl, module), name)) not in known
    }
    return top | inner


def check_names(app: Sphinx, env: BuildEnvironment) -> None:
    """Warn of public names that no page has."""
    for name in sorted(public_names() - env.__dict__.get("guide_names", set())):
        LOGGER.warning("no page of the reference has contactlib.%s", name)


def prepare(app: Sphinx, what: str, name: str, value: Any, options: Any, lines: list[str]) -> None:
    """Set a docstring's indented equations line by line, and take bars as bars."""
    prepared: list[str] = []
    literal = False
    for above, line in pairwise(["", *lines]):
        indented = line.startswith("    ")
        if indented and not literal and not above.strip():
            prepared += ["::", ""]
            literal = True
        elif line.strip() and not indented:
            literal = False
        prepared.append(line if literal or ">>>" in line else line.replace("|", r"\|"))
    lines[:] = prepared


def is_word(app: Sphinx, domain: Any, node: Any) -> bool | None:
    """Let backticks in a docstring be code where they are not a name that the guide has."""
    of_page = str(node.source).endswith(".md") and node["reftarget"].startswith("contactlib")
    return None if of_page else True if domain is not None and domain.name == "py" else None


def skip_fields(
    app: Sphinx, what: str, name: str, value: Any, skip: bool, options: Any
) -> bool | None:
    """Omit members that a class's docstring describes already."""
    text = getattr(value, "__doc__", None) or ""
    return True if text.startswith("Alias for field number") else None


# ---- mathematics ----------------------------------------------------------------------------


def visit_math(translator: Any, node: Any) -> None:
    """MathML within a line."""
    translator.body.append(latex2mathml.tex2mathml(node.astext(), as_block=False))
    raise nodes.SkipNode


def visit_displayed(translator: Any, node: Any) -> None:
    """MathML in lines of its own."""
    translator.body.append(
        f'<div class="math">{latex2mathml.tex2mathml(node.astext(), as_block=True)}</div>'
    )
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Register all of it."""
    for name, kind in (
        ("controllers", Controllers),
        ("keys", KeysOfSection),
        ("laws", Laws),
        ("outcomes", Outcomes),
        ("variables", Variables),
        ("names", Names),
        ("shipped", Shipped),
    ):
        app.add_directive(name, kind)
    app.add_html_math_renderer("mathml", (visit_math, None), (visit_displayed, None))
    app.connect("env-check-consistency", check_names)
    app.connect("autodoc-process-docstring", prepare, priority=400)  # before numpydoc
    app.connect("warn-missing-reference", is_word)
    app.connect("autodoc-skip-member", skip_fields)
    return {"parallel_read_safe": False}
