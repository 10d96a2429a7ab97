"""The readable parts of an FMU: its page, its table as plain numbers, its licence.

Templates in ``assets/`` contain the page's text; its numbers come from the model through the
kernel. The page is XHTML that every browser reads as HTML5, and needs no script and no other file.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from html import escape
from importlib import metadata
from string import Template

import numpy as np

from contactlib import kernel
from contactlib.base.text import version
from contactlib.base.writing import PACKAGE
from contactlib.export.curve_svg import curve_svg, sample_curve
from contactlib.export.description import MODEL_NAMES, Description, Variable
from contactlib.export.units import WEAKENING
from contactlib.files.model import Missing
from contactlib.table.creep_force_table import CreepForceTable

ASSETS = PACKAGE / "export" / "assets"
TITLES = {
    "force_element": "Creep force element",
    "wheelset": "Wheelset with creep force",
    "wheelset_body": "Wheelset without contact",
    "creep_forces": "Creep forces of any ellipse",
    "vehicle": "Vehicle on its rails",
}
GROUPS = {
    "input": "Inputs",
    "output": "Outputs",
    "parameter": "Parameters, fixed during a run",
    "tunable parameter": "Parameters, tunable during a run",
    "local": "Internal variables",
    "independent": "Independent variable",
}
COUPLED = ("force_element", "wheelset_body")  # whose step is limited
SPEEDS = (0.0, 1.0, 10.0, 50.0)  # rows of the table of stable steps [m/s]


def asset(name: str) -> str:
    """Text of a static file."""
    return (ASSETS / name).read_text(encoding="ascii")


def fragment(name: str, **values: str) -> str:
    """Text of a static file, with its placeholders replaced."""
    return Template(asset(name)).substitute(values)


def index_page(description: Description) -> bytes:
    """documentation/index.html of an FMU: one page in ASCII."""
    model, kind, bodies = description.model, description.kind, description.bodies is not None
    given = {"Model version": description.version, "author": description.author}
    memory, implicit = description.remembers, description.implicit
    page = fragment(
        "page.html",
        title=TITLES[kind],
        model_name=escape(model.name),
        source=escape(model.source),
        version=version(),
        token=escape(kernel.token()),
        style=asset("page.css"),
        icon=asset("icon.svg"),
        kind=fragment(
            f"kind_{kind}.html",
            carriers=description.carriers,
            mode="with memory" if memory else "implicit" if implicit else "with a held force",
            step_table=_step_table(description) if kind in COUPLED else "",
            exchange=asset("memory_in_exchange.html") if memory else "",
        ),
        signs=asset("signs_creep_forces.html")
        if bodies
        else fragment("signs.html", sketch=asset("sketch.svg")),
        law="" if kind == "wheelset_body" else _law(description),
        variables=_variable_tables(description.variables),
        **_example(description),
        stated="".join(f"{key} {escape(v)}; " for key, v in given.items() if v is not None),
        law_name=escape(description.element.table.law),
    )
    return page.encode("ascii", "xmlcharrefreplace")


def _law(description: Description) -> str:
    """Section on the law: its curve, the certificate of its table, and its limits."""
    element, table = description.element, description.element.table
    speed = max(description.model.initial_speed, element.minimum_speed)
    curve = sample_curve(element, speed=speed)
    caption = [f"Computed by the library in this FMU at the nominal load and {speed:g} m/s."]
    if curve.peak is None:
        caption.append("The curve has no peak: the force does not fall with creepage.")
    else:
        at, height = curve.creepage[curve.peak], curve.traction_coefficient[curve.peak]
        caption.append(
            f"The peak is {height:.4g} at {100.0 * at:.3g} %. The line is dashed where the force "
            "falls with creepage."
        )
    if curve.points is not None:
        caption.append("Dots are the measured points; the curve is drawn to the last of them.")
    k_hat = "one curve, without k_hat" if table.one_axis else f"k_hat from 0 to {table.k_max:g}"
    ratio, without = "largest error of Q/(f<sub>d</sub> P)", " without one" * table.layered
    rows = {
        "law": f"<code>{escape(table.law)}</code>",
        "range of the table": f"{k_hat}; any creepage{'; any layer' if table.layered else ''}",
        **({f"{ratio} with a layer": f"{table.max_layer_error:.2g}"} if table.layered else {}),
        f"{ratio}{without}": f"{table.max_error:.2g}",
        f"largest error of its slope{without}": f"{table.max_slope_error:.2g}",
        f"points compared with the law{without}": f"{table.certificate_points}",
    }
    limits = ""
    if table.law.startswith("MeasuredCurve"):
        names = [v.name for v in description.variables]
        across = [name for name in ("lateral_velocity", "spin_velocity") if name in names]
        inputs = " and ".join(f"<code>{name}</code>" for name in across)
        limits = fragment("limits_measured.html", inputs=inputs)
    else:
        friction = element.friction
        rows["friction, static and kinetic"] = f"{friction.static:.4g}, {friction.kinetic:.4g}"
        rows["saturation creepage"] = f"{100.0 * element.saturation_creepage:.4g} %"
        rows["k_hat"] = f"{element.k_hat:.4g}"
        if element.layer_compliance > 0.0:
            rows["layer ratio"] = f"{element.layer_ratio:.4g}"
        limits = asset("limits.html") if table.is_limit else ""
    note = f"<p>{escape(table.note)}.</p>\n" if table.note else ""
    return (
        f"<section>\n<h2>The law</h2>\n{note}<figure>\n{curve_svg(curve)}\n"
        f"<figcaption>{' '.join(caption)}</figcaption>\n</figure>\n"
        "<p>The table is in <code>resources/</code>, and as readable numbers in "
        "<code>resources/creep_table.csv</code>.</p>\n"
        f"{_table('The law and its table', (), rows.items())}\n{limits}</section>"
    )


def _variable_tables(variables: Sequence[Variable]) -> str:
    """Every variable with unit, limits, start value and meaning, by causality."""
    groups: dict[str, list[Variable]] = {name: [] for name in GROUPS}
    for v in variables:
        tunable = "tunable " if v.variability == "tunable" else ""
        groups.setdefault(tunable + v.causality, []).append(v)
    heads = ("name", "unit", "limits", "start", "meaning")
    return "\n".join(
        _table(GROUPS.get(name, name), heads, map(_cells, members), "variables")
        for name, members in groups.items()
        if members
    )


def _cells(v: Variable) -> list[str]:
    unit, factor = v.unit, 1.0
    if v.type == WEAKENING and v.type.display is not None:
        unit, factor = v.type.display
    low, high = (
        "" if limit is None else f"{factor * limit:.6g}" for limit in (v.minimum, v.maximum)
    )
    between = f"{low} &#8230; {high}" if low and high else (low and f"&#8805; {low}")
    limits = "" if v.unit == "Boolean" else between or (high and f"&#8804; {high}")
    if v.start is None:
        start = ""
    else:
        start = str(v.start).lower() if isinstance(v.start, bool) else f"{factor * v.start:.6g}"
    name = f"<code>{escape(v.name)}</code>"
    return [name, escape(unit), limits, start, escape(v.description)]


def _table(
    caption: str, heads: Sequence[str], rows: Iterable[Sequence[str]], kind: str = ""
) -> str:
    head = "".join(f'<th scope="col">{h}</th>' for h in heads)
    top = f"<thead><tr>{head}</tr></thead>\n" if heads else ""
    named = f' class="{kind}"' if kind else ""
    body = "\n".join(
        f'<tr><th scope="row">{first}</th>{"".join(f"<td>{cell}</td>" for cell in rest)}</tr>'
        for first, *rest in rows
    )
    return (
        f'<div class="table"><table{named}>\n<caption>{caption}</caption>\n'
        f"{top}<tbody>\n{body}\n</tbody>\n</table></div>"
    )


def _step_table(description: Description) -> str:
    """Longest stable steps of a held force at several speeds, as the kernel computes them."""
    held = replace(description, kind="force_element", implicit=False)
    native = kernel.NativeModel(held.kind, held.native_contact, held.start_values)

    def longest(speed: float, parallel: bool) -> str:
        omega = speed / held.element.radius
        native.set(speed=speed, omega=omega, parallel_exchange=parallel)
        native.evaluate()
        (hint,) = native.get("step_size_hint")  # half of it
        return f"{2e3 * hint:.3g}"

    rows = ([f"{speed:g}", longest(speed, False), longest(speed, True)] for speed in SPEEDS)
    caption = "Longest stable steps of this model at its nominal load, where the wheel sticks"
    if isinstance(description.model.wheelset, Missing):
        caption += "; its effective inverse mass is assumed: steps change inversely with your own"
    return _table(caption, ("speed in m/s", "sequential, in ms", "parallel, in ms"), rows, "steps")


def _example(description: Description) -> dict[str, str]:
    """Values of the example with FMPy: a ramp of one input."""
    inputs = [v for v in description.variables if v.causality == "input"]
    outputs = [v.name for v in description.variables if v.causality == "output"][:3]
    names, first = [v.name for v in inputs], [float(v.start or 0.0) for v in inputs]
    last = first.copy()
    if "creepage_x" in names:
        last[names.index("creepage_x")] = -0.005
    else:
        last[0] = round(1.03 * first[0], 6)
    return {
        "file": f"{MODEL_NAMES[description.kind]}.fmu",
        "names": ", ".join(f'"{name}"' for name in names),
        "first": ", ".join(map(repr, first)),
        "last": ", ".join(map(repr, last)),
        "outputs": "[" + ", ".join(f'"{name}"' for name in outputs) + "]",
        "output": outputs[0],
    }


def readable_table(table: CreepForceTable, layer_ratio: float = 0.0) -> bytes:
    """Traction ratio and slope on a plain grid, as comma-separated values to read and plot.

    For a law without k_hat that column is empty. With a layer all rows have its ratio.
    """
    far = np.geomspace(1e-3, 1e3, 121)
    x = np.unique([float(f"{v:.4g}") for v in (0.0, *far, *np.linspace(0.3, 2.0, 86))])
    layer = f"{layer_ratio:.9g}," if layer_ratio > 0.0 else ""
    rows = [f"normalized_creepage,k_hat,{'layer_ratio,' if layer else ''}traction_ratio,slope"]
    for k_hat in [0.0] if table.one_axis else np.linspace(0.0, table.k_max, 21):
        label = "" if table.one_axis else f"{k_hat:.9g}"
        curves = table.traction_ratio(x, k_hat, layer_ratio), table.slope(x, k_hat, layer_ratio)
        values = zip(x, *curves, strict=True)
        rows += [f"{v:.9g},{label},{layer}{ratio:.9g},{slope:.9g}" for v, ratio, slope in values]
    return "\n".join([*rows, ""]).encode("ascii")


def reference_run_text(description: Description, count: int, step: float) -> bytes:
    """Description of the rows of the reference run, and of the comparison with other tools."""
    states = [v.name for v in description.of_role("state")]
    if description.start_values.get("implicit"):
        outputs = "This element is implicit: from row 1 on its outputs are those of the last step."
        tool = "Their rows equal these."
    elif states:
        outputs = f"The states, {' and '.join(states)}, are those at the end of the step."
        tool = (
            "In their rows the states equal these; other outputs belong to the same states and "
            "to the\ninputs of the row before."
        )
    else:
        outputs = "There are no states."
        tool = "Their row k has the outputs of row k - 1 here: they lag by one row."
    text = fragment(
        "reference_run.txt", count=str(count), step=f"{step:g}", outputs=outputs, tool=tool
    )
    return text.encode("ascii")


def licence_text() -> bytes:
    """The project's licence, from a checkout or from an installed package.

    Raises
    ------
    FileNotFoundError
        If the installed package does not contain it.
    """
    if (PACKAGE.parent / "pyproject.toml").is_file():
        return (PACKAGE.parent / "LICENSE").read_bytes()
    for file in metadata.files("contactlib-rail") or ():
        if file.name == "LICENSE":
            return file.read_binary()
    raise FileNotFoundError("contactlib is installed without its LICENSE")


def icon() -> bytes:
    """Icon of the FMU, a PNG."""
    return (ASSETS / "icon.png").read_bytes()
