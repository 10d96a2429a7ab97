"""What a person finds inside an FMU: its page, its table in plain numbers, its licence.

The page is put together from the fragments in ``assets/``: text and equations stand there, numbers
come from the model through the kernel. It is XHTML that every browser reads as HTML5, needs no
script and loads nothing from elsewhere.
"""

from __future__ import annotations

from html import escape
from importlib import metadata

import numpy as np

from contactlib import kernel
from contactlib.export import page_sections as section
from contactlib.export.description import Description
from contactlib.export.page_sections import ASSETS, asset, fragment
from contactlib.files import PACKAGE
from contactlib.table import CreepForceTable

TITLES = {
    "force_element": "Creep force element",
    "wheelset": "Wheelset with creep force",
    "wheelset_body": "Wheelset without contact",
}


def index_page(description: Description) -> bytes:
    """documentation/index.html of an FMU: one page in ASCII."""
    model, kind, variables = description.model, description.kind, description.variables
    relaxed = description.relaxed
    table, contact = model.wheelset.element.table, description.has_contact
    sections = {
        "What it is": fragment(f"about_{kind}.html") + section.facts(model, kind),
        "Signs": fragment("signs.html", sketch=asset("sketch.svg")),
        "The law": section.law(model) if contact else "",
        "Equations": section.equations(table, kind, relaxed),
        "Variables": section.variable_tables(variables),
        "Coupling": section.coupling(model.wheelset, kind, variables, relaxed),
        "Loading it": section.tools(kind, variables),
        "Limits and validation": asset("limits.html") if contact else "",
        "Licence and versions": _licence(table),
    }
    shown = {heading: text for heading, text in sections.items() if text}
    anchors = {heading: heading.lower().replace(" ", "-") for heading in shown}
    page = fragment(
        "page.html",
        title=TITLES[kind],
        model_name=escape(model.name),
        source=escape(model.source),
        version=version(),
        token=escape(kernel.token()),
        style=asset("page.css"),
        icon=asset("icon.svg"),
        contents="\n".join(f'<li><a href="#{anchors[h]}">{h}</a></li>' for h in shown),
        sections="\n".join(
            f'<section id="{anchors[h]}">\n<h2>{h}</h2>\n{text}\n</section>'
            for h, text in shown.items()
        ),
    )
    return page.encode("ascii", "xmlcharrefreplace")


def readable_table(table: CreepForceTable) -> bytes:
    """The law as comma-separated values for human eyes: traction ratio and slope on a plain grid.

    A law without k_hat leaves that column empty.
    """
    far = np.geomspace(1e-3, 1e3, 121)
    x = np.unique([float(f"{v:.4g}") for v in (0.0, *far, *np.linspace(0.3, 2.0, 86))])
    rows = ["normalized_creepage,k_hat,traction_ratio,slope"]
    for k_hat in [0.0] if table.one_axis else np.linspace(0.0, table.k_max, 21):
        label = "" if table.one_axis else f"{k_hat:.9g}"
        values = zip(x, table.traction_ratio(x, k_hat), table.slope(x, k_hat), strict=True)
        rows += [f"{v:.9g},{label},{ratio:.9g},{slope:.9g}" for v, ratio, slope in values]
    return "\n".join([*rows, ""]).encode("ascii")


def licence_text() -> bytes:
    """The project's licence, from a checkout or from an installed package.

    Raises
    ------
    FileNotFoundError
        If the installed package has lost it.
    """
    if (PACKAGE.parent / "pyproject.toml").is_file():
        return (PACKAGE.parent / "LICENSE").read_bytes()
    for file in metadata.files("contactlib") or ():
        if file.name == "LICENSE":
            return file.read_binary()
    raise FileNotFoundError("contactlib is installed without its LICENSE")


def icon() -> bytes:
    """Picture of the FMU, a PNG."""
    return (ASSETS / "icon.png").read_bytes()


def version() -> str:
    """Version of the installed package, or a word for a checkout that was never installed."""
    try:
        return metadata.version("contactlib")
    except metadata.PackageNotFoundError:
        return "unreleased"


def _licence(table: CreepForceTable) -> str:
    cells = " by ".join(str(n) for n in table.cells)
    size = f", {cells} cells" if any(table.cells) else ""
    return (
        f"<p>contactlib {version()}; library <code>{escape(kernel.token())}</code>; table of "
        f"<code>{escape(table.law)}</code>{size}.</p>\n"
        f"<pre>{escape(licence_text().decode())}</pre>"
    )
