"""Sphinx extension: docstrings of public names, and mathematics without a network.

``{names}`` in a page becomes the docstrings of Python names. A public name that no page has is a
warning.
"""

from __future__ import annotations

import inspect
from itertools import pairwise
from operator import attrgetter
from types import ModuleType
from typing import Any

from docutils import nodes
from docutils.utils.math import latex2mathml
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective

import contactlib as cl
import contactlib.rl
import contactlib.stability.control_systems
import contactlib.stability.torsion

ROOMS = [name for name in dir(cl) if isinstance(getattr(cl, name), ModuleType)]
MODULES = [*ROOMS, "rl", "stability.torsion", "stability.control_systems"]
LOGGER = logging.getLogger(__name__)


# ---- names ----------------------------------------------------------------------------------


class Names(SphinxDirective):
    """Docstrings of public names: those of the content, and all that the argument's module has.

    Data, which have no docstring, are a line ``name: what it is``.
    """

    has_content = True
    optional_arguments = 1
    final_argument_whitespace = True

    def run(self) -> list[nodes.Node]:
        """Parse what `text` gives, at each build: the code may have changed."""
        self.env.note_reread()
        return self.parse_text_to_nodes(self.text(), allow_section_headings=True)

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
            there = names_of(self.arguments[0])
            names = [*(n for n in there if n not in names), *names]
        self.env.__dict__.setdefault("guide_names", set()).update(names)
        parts = [documented_name(name, typed.get(name)) for name in names]
        return "```{eval-rst}\n" + "\n".join(parts) + "\n```"


def documented_name(name: str, typed: str | None) -> str:
    """Directive for a public name."""
    if typed is not None:
        return f".. py:data:: contactlib.{name}\n\n   {typed}\n"
    value = attrgetter(name)(cl)
    if inspect.ismodule(value):
        return f".. automodule:: {value.__name__}\n"
    if inspect.isclass(value):
        return f".. autoclass:: contactlib.{name}\n   :members:\n"
    return f".. autofunction:: contactlib.{name}\n"


def public_names() -> set[str]:
    """Every name that the reference must have; what is on top is not repeated for a subpackage."""
    return {*(set(dir(cl)) - set(ROOMS)), *(name for room in MODULES for name in names_of(room))}


def names_of(module: str) -> list[str]:
    """Public names of a module, each as its user writes it: without the room where it is on top."""
    names = attrgetter(module)(cl).__all__
    return [name if name in dir(cl) else f"{module}.{name}" for name in names]


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
    app.add_directive("names", Names)
    app.add_html_math_renderer("mathml", (visit_math, None), (visit_displayed, None))
    app.connect("env-check-consistency", check_names)
    app.connect("autodoc-process-docstring", prepare, priority=400)  # before numpydoc
    app.connect("warn-missing-reference", is_word)
    app.connect("autodoc-skip-member", skip_fields)
    return {"parallel_read_safe": False}
