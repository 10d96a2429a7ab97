"""The readable parts of an FMU: its page, its table as plain numbers, its licence.

Text and equations of the page are fragments in ``assets/``; its numbers come from the model through
the kernel. The page is XHTML that every browser reads as HTML5, and needs no script and no other
file.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from importlib import metadata
from string import Template

import numpy as np

from contactlib import kernel
from contactlib.base.text import version
from contactlib.base.writing import PACKAGE
from contactlib.element.force_element import ForceElement
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
}
GROUPS = {
    "input": "Inputs",
    "output": "Outputs",
    "parameter": "Parameters, fixed during a run",
    "tunable parameter": "Parameters, tunable during a run",
    "local": "Internal variables",
    "independent": "Independent variable",
}
HERE = '<span class="tag here">this FMU</span>'
ELSEWHERE = '<span class="tag">another export</span>'
PARAMETER = '<span class="tag">a parameter</span>'
SPEEDS = (0.0, 1.0, 10.0, 50.0)  # rows of the table of stable steps [m/s]


def asset(name: str) -> str:
    """Text of a static file."""
    return (ASSETS / name).read_text(encoding="ascii")


def fragment(name: str, **values: str) -> str:
    """Text of a static file, with its placeholders replaced."""
    return Template(asset(name)).substitute(values)


def signs(description: Description) -> str:
    """Directions and signs of the FMU's variables."""
    if description.pair is not None:
        return asset("signs_creep_forces.html")
    lateral_spin = asset("signs_lateral.html") if description.has_contact else ""
    lateral_spin += asset("signs_spin.html") if description.spins else ""
    return fragment("signs.html", sketch=asset("sketch.svg"), lateral_spin=lateral_spin)


def _is_measured(table: CreepForceTable) -> bool:
    return table.law.startswith("MeasuredCurve")


def facts(description: Description) -> str:
    """The main numbers of the model."""
    wheelset, element = description.model.wheelset, description.element
    contact, friction = element.contact, element.friction
    if description.pair is not None:
        pair = description.pair
        shown = {
            "friction, static and kinetic": f"{friction.static:.4g}, {friction.kinetic:.4g}",
            "weakening length": f"{pair.friction.weakening_length * 1e6:.4g} &#181;m",
            "shear modulus": f"{pair.shear_modulus / 1e9:.4g} GPa",
            "Poisson's ratio": f"{pair.poisson_ratio:g}",
        }
        if pair.layer_compliance > 0.0:
            shown["layer compliance"] = f"{pair.layer_compliance * 1e12:.4g} &#181;m/MPa"
        return _facts(shown)
    shown = {"wheel radius": f"{element.radius:.5g} m"}
    if description.has_contact:
        shown |= {
            "contact of": description.carriers,
            "nominal load": f"{element.normal_load / 1e3:.5g} kN",
        }
        if _is_measured(element.table):
            shown["law"] = "measured curve"
        else:
            shown |= {
                "friction, static and kinetic": f"{friction.static:.4g}, {friction.kinetic:.4g}",
                "saturation creepage": f"{100 * element.saturation_creepage:.4g} %",
            }
        if not element.table.one_axis:
            shown |= {
                "contact semi-width": f"{contact.semi_width * 1e3:.4g} mm",
                "peak pressure": f"{contact.peak_pressure / 1e6:.4g} MPa",
                "weakening length": f"{friction.weakening_length * 1e6:.4g} &#181;m",
                "k_hat": f"{element.k_hat:.4g}",
            }
        if element.layer_compliance > 0.0:
            shown["layer ratio"] = f"{element.layer_ratio:.4g}"
    if not isinstance(wheelset, Missing):
        mass = "none, speed is held" if wheelset.mass is None else f"{wheelset.mass / 1e3:.5g} t"
        shown |= {
            "wheels of the wheelset": f"{wheelset.element.wheels:g}",
            "inertia about the axle": f"{wheelset.inertia:.5g} kg&#183;m&#178;",
            "mass moved": mass,
        }
    assumed = ", assumed: the model has no inertia" if isinstance(wheelset, Missing) else ""
    shown["effective inverse mass"] = f"{description.effective_inverse_mass:.4g} 1/kg{assumed}"
    return _facts(shown)


def _facts(shown: dict[str, str]) -> str:
    rows = "\n".join(f"<div><dt>{name}</dt><dd>{value}</dd></div>" for name, value in shown.items())
    return f'<dl class="facts">\n{rows}\n</dl>'


def law(description: Description) -> str:
    """Creep curve of the element, and the certificate of its table."""
    element, table = description.element, description.element.table
    speed = max(description.model.initial_speed, element.minimum_speed)
    curve = sample_curve(element, speed=speed)
    shape = "The line is solid up to the peak, and dashed where the force falls with creepage"
    if curve.peak is None:
        shape = "The curve has no peak: the force does not fall with creepage"
    k_range = "one curve, without k_hat" if table.one_axis else f"k_hat from 0 to {table.k_max:g}"
    ratio, without = "largest error of Q/(f<sub>d</sub> P)", " without one" * table.layered
    certificate = {
        "law": f"<code>{escape(table.law)}</code>",
        "range of the table": f"{k_range}; any creepage{'; any layer' if table.layered else ''}",
        **({f"{ratio} with a layer": f"{table.max_layer_error:.2g}"} if table.layered else {}),
        f"{ratio}{without}": f"{table.max_error:.2g}",
        f"largest error of its slope{without}": f"{table.max_slope_error:.2g}",
        f"points compared{without}": f"{table.certificate_points}",
    }
    at_layer = ", at the layer ratio above" if element.layer_compliance > 0.0 else ""
    level = "kinetic friction"
    note = ""
    if _is_measured(table):
        level = "at the last point"
        if curve.points is not None:
            shape += ". Dots are the measured points; the curve is drawn to the last of them"
        note = f"<p>{escape(table.note)}.</p>\n" if table.note else ""
    return (
        f"{note}<figure>\n{curve_svg(curve, level, element.friction.kinetic)}\n"
        "<figcaption>Computed by the library in this FMU at the nominal load and "
        f"{speed:g} m/s. {shape}.</figcaption>\n</figure>\n"
        "<p>The law is tabulated. The table is in <code>resources/</code>, and as readable numbers "
        f"in <code>resources/creep_table.csv</code>{at_layer}. It was compared with the law at "
        "points that "
        f"are not its nodes:</p>\n{_table('Certificate of the table', (), certificate.items())}"
    )


def equations(element: ForceElement, kind: str, remembers: bool) -> str:
    """The equations that this FMU solves."""
    names, table = [], element.table
    if kind == "creep_forces":
        whole = "elliptic" if table.law.startswith("CarterGriffith") else "other"
        names = ["measured" if _is_measured(table) else whole, "lateral_spin"]
        names += ["layer"] if element.layer_compliance > 0.0 else []
    elif kind != "wheelset_body":
        shape = table.options.get("contact", "other")
        names.append("creepage")
        if _is_measured(table):
            names.append("measured")
        else:
            names += ["contact", shape if table.law.startswith("CarterGriffith") else "other"]
            names += ["half_space"] if shape == "elliptic" else []
            names += ["layer"] if element.layer_compliance > 0.0 else []
            names += ["heat"] if element.friction.softens_with_heat else []
        if remembers:
            names.append("memory")
    if kind.startswith("wheelset"):
        names.append("motion")
    return "".join(asset(f"equations_{name}.html") for name in names)


def variable_tables(variables: Sequence[Variable]) -> str:
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


def _rounded(value: float) -> str:
    """Three significant digits, with a space between thousands."""
    if np.isinf(value):
        return "&#8734;"
    return f"{float(f'{value:.3g}'):,.9g}".replace(",", "&#8239;")


def coupling(description: Description) -> str:
    """The stable communication steps, and the ways to make longer ones stable."""
    implicit, remembers = description.implicit, description.remembers
    if description.pair is not None:
        return asset("coupling_creep_forces.html")
    return fragment(
        f"coupling_{description.kind}.html",
        step_table=_step_table(description),
        held_here=ELSEWHERE if remembers else PARAMETER if implicit else HERE,
        implicit_here=HERE if implicit else PARAMETER,
        memory_here=HERE if remembers else ELSEWHERE,
    )


def _step_table(description: Description) -> str:
    """Largest slip pole and longest stable steps, for several speeds."""
    element, kind = description.element, description.kind
    speeds = np.array(SPEEDS)
    gradients = np.array([element.steepest_gradient(speed) for speed in SPEEDS])
    poles = gradients * description.effective_inverse_mass
    sequential = 2.0 / poles
    if description.remembers and kind == "force_element":  # then speed is not regularised
        stiffness = poles[-1] * speeds[-1]
        with np.errstate(divide="ignore"):
            poles = stiffness / speeds
        spring = element.memory_parameters
        stiffest = max(spring["standing_stiffness"], 1.0)
        lag = spring["relaxation_length"] / (stiffest * stiffness)
        sequential = np.maximum(2.0 / poles, 2.0 * np.sqrt(lag))
    heads = ["speed in m/s", "slip pole in 1/s"]
    columns = [speeds, poles]
    if kind == "wheelset":
        heads.append("its time constant in ms")
        columns.append(1e3 / poles)
    else:
        heads += ["longest step in ms, sequential", "parallel"]
        columns += [1e3 * sequential, 1e3 / poles]
    rows = ([_rounded(value) for value in row] for row in zip(*columns, strict=True))
    caption = "This model at its nominal load while the wheel sticks, where the pole is largest"
    if isinstance(description.model.wheelset, Missing):
        caption += "; its effective inverse mass is assumed: steps change inversely with your own"
    return _table(caption, heads, rows, "steps")


def tools(kind: str, variables: Sequence[Variable]) -> str:
    """How to load and connect the FMU."""
    inputs = [v for v in variables if v.causality == "input"]
    outputs = [v.name for v in variables if v.causality == "output"][:3]
    first = [float(v.start or 0.0) for v in inputs]
    names = [v.name for v in inputs]
    place, end = 0, round(1.03 * first[0], 6)
    if "creepage_x" in names:
        place, end = names.index("creepage_x"), -0.005
    last = [*first[:place], end, *first[place + 1 :]]
    return fragment(
        "tools.html",
        connection=asset(f"connection_{kind}.html"),
        file=f"{MODEL_NAMES[kind]}.fmu",
        names=", ".join(f'"{name}"' for name in names),
        first=", ".join(map(repr, first)),
        last=", ".join(map(repr, last)),
        ramped=names[place],
        end=repr(end),
        outputs="[" + ", ".join(f'"{name}"' for name in outputs) + "]",
        output=outputs[0],
    )


def index_page(description: Description) -> bytes:
    """documentation/index.html of an FMU: one page in ASCII."""
    model, kind, variables = description.model, description.kind, description.variables
    table, contact = description.element.table, kind != "wheelset_body"
    across = [v.name for v in variables if v.name in ("lateral_velocity", "spin_velocity")]
    if description.pair is not None:
        limits = asset("limits_creep_forces.html")
    elif _is_measured(table):
        named = " and ".join(f"<code>{name}</code>" for name in across)
        limits = fragment("limits_measured.html", inputs=named)
    else:
        limits = asset("limits.html")
    sections = {
        "What it is": fragment(f"about_{kind}.html", carriers=description.carriers)
        + (asset("about_weakening.html") if description.has_contact and not table.one_axis else "")
        + facts(description),
        "Signs": signs(description),
        "The law": law(description) if contact else "",
        "Equations": equations(description.element, kind, description.remembers),
        "Variables": variable_tables(variables),
        "Coupling": coupling(description),
        "Loading it": tools(kind, variables),
        "Limits and validation": limits if contact else "",
        "Licence and versions": _licence(description),
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
        found = table.traction_ratio(x, k_hat, layer_ratio), table.slope(x, k_hat, layer_ratio)
        values = zip(x, *found, strict=True)
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


def _licence(description: Description) -> str:
    table = description.element.table
    cells = " by ".join(str(n) for n in table.cells)
    size = f", {cells} cells" if any(table.cells) else ""
    given = {"Model version": description.version, "author": description.author}
    stated = "".join(f"{key} {escape(text)}; " for key, text in given.items() if text is not None)
    return (
        f"<p>{stated}contactlib {version()}; library <code>{escape(kernel.token())}</code>; "
        f"table of <code>{escape(table.law)}</code>{size}.</p>\n"
        f"<pre>{escape(licence_text().decode())}</pre>"
    )
