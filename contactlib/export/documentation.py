"""What a person finds inside an FMU: its page, its table in plain numbers, its licence.

The page is put together from the fragments in ``assets/``: text and equations stand there, numbers
come from the model through the kernel. It is XHTML that every browser reads as HTML5, needs no
script and loads nothing from elsewhere.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from importlib import metadata
from string import Template
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from contactlib import kernel
from contactlib.element import ForceElement
from contactlib.export.curve_svg import curve_svg, sample_curve
from contactlib.files import PACKAGE
from contactlib.table import CreepForceTable
from contactlib.wheelset import Wheelset

if TYPE_CHECKING:
    from contactlib.scenario import Model

ASSETS = PACKAGE / "export" / "assets"
TITLES = {
    "force_element": "Creep force element",
    "wheelset": "Wheelset with creep force",
    "wheelset_body": "Wheelset without contact",
}
EXAMPLE_FILES = {
    "force_element": "CreepForceElement.fmu",
    "wheelset": "Wheelset.fmu",
    "wheelset_body": "WheelsetBody.fmu",
}
GROUPS = {
    "input": "Inputs",
    "output": "Outputs",
    "parameter": "Parameters, fixed during a run",
    "tunable parameter": "Parameters, tunable during a run",
    "local": "Inner variables",
    "independent": "Independent variable",
}
UNLIMITED = 1e300  # what the kernel's list of variables calls no limit
HERE = '<span class="tag here">this FMU</span>'
SPEEDS = (0.0, 1.0, 10.0, 50.0)  # of the table of stable steps [m/s]


class DescribedVariable(Protocol):
    """What the page needs of a variable of the FMU; a limit or a start may be missing."""

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def causality(self) -> str: ...  # noqa: D102
    @property
    def variability(self) -> str: ...  # noqa: D102
    @property
    def unit(self) -> str: ...  # noqa: D102
    @property
    def minimum(self) -> float | None: ...  # noqa: D102
    @property
    def maximum(self) -> float | None: ...  # noqa: D102
    @property
    def start(self) -> float | bool | None: ...  # noqa: D102
    @property
    def description(self) -> str: ...  # noqa: D102


def index_page(
    model: Model, kind: str, variables: Sequence[DescribedVariable], *, relaxed: bool = False
) -> bytes:
    """documentation/index.html of an FMU.

    Parameters
    ----------
    model : Model
        What was exported.
    kind : {"force_element", "wheelset", "wheelset_body"}
        As what.
    variables : sequence of DescribedVariable
        All variables of the FMU, in its order.
    relaxed : bool, optional
        Whether the creep force has a relaxation state.

    Returns
    -------
    bytes
        One page in ASCII.

    Raises
    ------
    ValueError
        If `kind` is unknown.
    """
    if kind not in TITLES:
        raise ValueError(f"kind = {kind!r} must be one of: {', '.join(TITLES)}")
    element, contact = model.wheelset.element, kind != "wheelset_body"
    sigma = next((v.start for v in variables if v.name == "relaxation_length"), None)
    steps = _step_table(model.wheelset, kind, float(sigma) if relaxed and sigma else None)
    coupling = _fragment(
        f"coupling_{kind}.html",
        step_table=steps,
        held_here="" if relaxed else HERE,
        relaxed_here=HERE if relaxed else '<span class="tag">another export</span>',
    )
    sections = {
        "What it is": _fragment(f"about_{kind}.html") + _facts(model, kind),
        "Signs": _fragment("signs.html", sketch=_asset("sketch.svg")),
        "The law": _law(element, model.initial_speed) if contact else "",
        "Equations": _equations(element.table, kind, relaxed),
        "Variables": _variables(variables),
        "Coupling": coupling,
        "Loading it": _tools(kind, variables),
        "Limits and validation": _asset("limits.html") if contact else "",
        "Licence and versions": _licence(element.table),
    }
    shown = {heading: text for heading, text in sections.items() if text}
    anchors = {heading: heading.lower().replace(" ", "-") for heading in shown}
    page = _fragment(
        "page.html",
        title=TITLES[kind],
        model_name=escape(model.name),
        source=escape(model.source),
        version=version(),
        token=escape(kernel.token()),
        style=_asset("page.css"),
        icon=_asset("icon.svg"),
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


def _asset(name: str) -> str:
    return (ASSETS / name).read_text(encoding="ascii")


def _fragment(name: str, **values: str) -> str:
    return Template(_asset(name)).substitute(values)


# ---- sections -------------------------------------------------------------------------------


def _facts(model: Model, kind: str) -> str:
    wheelset, element = model.wheelset, model.wheelset.element
    contact, friction = element.contact, element.friction
    facts = {"wheel radius": f"{element.radius:.5g} m"}
    if kind != "wheelset_body":
        facts |= {
            "nominal load": f"{contact.normal_load / 1e3:.5g} kN",
            "contact semi-width": f"{contact.semi_width * 1e3:.4g} mm",
            "peak pressure": f"{contact.peak_pressure / 1e6:.4g} MPa",
            "friction, static and kinetic": f"{friction.static:.4g}, {friction.kinetic:.4g}",
            "weakening length": f"{friction.weakening_length * 1e6:.4g} &#181;m",
            "k_hat": f"{element.k_hat:.4g}",
            "saturation creepage": f"{100 * element.saturation_creepage:.4g} %",
        }
    mass = "speed is held" if wheelset.mass is None else f"{wheelset.mass / 1e3:.5g} t"
    facts |= {
        "inertia about the axle": f"{wheelset.inertia:.5g} kg&#183;m&#178;",
        "mass moved": mass,
        "effective inverse mass": f"{_inverse_mass(wheelset):.4g} 1/kg",
    }
    rows = "\n".join(f"<div><dt>{name}</dt><dd>{value}</dd></div>" for name, value in facts.items())
    return f'<dl class="facts">\n{rows}\n</dl>'


def _law(element: ForceElement, initial_speed: float) -> str:
    table, speed = element.table, max(initial_speed, element.minimum_speed)
    curve = sample_curve(element, speed=speed)
    shape = "solid up to the peak, dashed where the force falls with creepage"
    if curve.peak is None:
        shape = "without a peak: the force does not fall with creepage"
    k_range = "one curve, no k_hat" if table.one_axis else f"k_hat from 0 to {table.k_max:g}"
    facts = {
        "law": f"<code>{escape(table.law)}</code>",
        "range of the table": f"{k_range}; any creepage",
        "largest error of Q/(f<sub>d</sub> P)": f"{table.max_error:.2g}",
        "largest error of its slope": f"{table.max_slope_error:.2g}",
        "points compared": f"{table.certificate_points}",
    }
    rows = "\n".join(
        f'<tr><th scope="row">{name}</th><td>{value}</td></tr>' for name, value in facts.items()
    )
    return (
        f"<figure>\n{curve_svg(curve, kinetic_friction=element.friction.kinetic)}\n"
        f"<figcaption>Computed by the library in this FMU at the nominal load and {speed:g} m/s; "
        f"{shape}.</figcaption>\n</figure>\n"
        "<p>The law is tabulated once; the table is in <code>resources/</code>, and once more as "
        "readable numbers in <code>resources/creep_table.csv</code>. When it was made it was held "
        "against the law itself, at points that are not its nodes:</p>\n"
        '<div class="table"><table>\n<caption>Certificate of the table</caption>\n'
        f"<tbody>\n{rows}\n</tbody>\n</table></div>"
    )


def _equations(table: CreepForceTable, kind: str, relaxed: bool) -> str:
    names = []
    if kind != "wheelset_body":
        shape = table.options.get("contact", "other")
        law = shape if table.law.startswith("CarterGriffith") else "other"
        names += ["contact", law] + (["relaxation"] if relaxed else [])
    if kind != "force_element":
        names.append("motion")
    return "".join(_asset(f"equations_{name}.html") for name in names)


def _variables(variables: Sequence[DescribedVariable]) -> str:
    groups: dict[str, list[DescribedVariable]] = {name: [] for name in GROUPS}
    for v in variables:
        tunable = "tunable " if v.variability == "tunable" else ""
        groups.setdefault(tunable + v.causality, []).append(v)
    heads = ("name", "unit", "limits", "start", "meaning")
    return "\n".join(
        _table(GROUPS.get(name, name), heads, map(_cells, members), "variables")
        for name, members in groups.items()
        if members
    )


def _cells(v: DescribedVariable) -> list[str]:
    low, high = (
        "" if limit is None or abs(limit) >= UNLIMITED else f"{limit:.6g}"
        for limit in (v.minimum, v.maximum)
    )
    between = f"{low} &#8230; {high}" if low and high else (low and f"&#8805; {low}")
    limits = "" if v.unit == "Boolean" else between or (high and f"&#8804; {high}")
    if v.start is None:
        start = ""
    else:
        start = str(v.start).lower() if isinstance(v.start, bool) else f"{v.start:.6g}"
    name = f"<code>{escape(v.name)}</code>"
    return [name, escape(v.unit), limits, start, escape(v.description)]


def _table(caption: str, heads: Sequence[str], rows: Iterable[Sequence[str]], kind: str) -> str:
    head = "".join(f'<th scope="col">{h}</th>' for h in heads)
    body = "\n".join(
        f'<tr><th scope="row">{first}</th>{"".join(f"<td>{cell}</td>" for cell in rest)}</tr>'
        for first, *rest in rows
    )
    return (
        f'<div class="table"><table class="{kind}">\n<caption>{caption}</caption>\n'
        f"<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody>\n</table></div>"
    )


def _rounded(value: float) -> str:
    """Three digits, thousands apart."""
    return f"{float(f'{value:.3g}'):,.9g}".replace(",", "&#8239;")


def _inverse_mass(wheelset: Wheelset) -> float:
    """What resists slip: r**2/J + 1/M, without the latter if the speed is held [1/kg]."""
    by_mass = 0.0 if wheelset.mass is None else 1.0 / wheelset.mass
    return wheelset.radius**2 / wheelset.inertia + by_mass


def _step_table(wheelset: Wheelset, kind: str, relaxation_length: float | None) -> str:
    """Slip pole and longest stable steps of this model at creepage zero, for some speeds."""
    element = wheelset.element
    speeds = np.array(SPEEDS)
    record: Any = element.evaluate(omega=speeds / wheelset.radius, speed=speeds)
    poles = record["force_gradient"] * _inverse_mass(wheelset)
    sequential = 2.0 / poles
    if relaxation_length is not None:
        by_length = 2.0 * np.sqrt(relaxation_length / (poles[-1] * speeds[-1]))
        sequential = np.maximum(sequential, by_length)
    heads = ["speed in m/s", "slip pole in 1/s"]
    columns = [speeds, poles]
    if kind == "wheelset":
        heads.append("its time constant in ms")
        columns.append(1e3 / poles)
    else:
        heads += ["longest step in ms, sequential", "parallel"]
        columns += [1e3 * sequential, 1e3 / poles]
    rows = ([_rounded(value) for value in row] for row in zip(*columns, strict=True))
    caption = "This model at its nominal load and creepage zero, where the pole is largest"
    return _table(caption, heads, rows, "steps")


def _tools(kind: str, variables: Sequence[DescribedVariable]) -> str:
    inputs = [v for v in variables if v.causality == "input"]
    outputs = [v.name for v in variables if v.causality == "output"][:3]
    first = [float(v.start or 0.0) for v in inputs]
    last = [round(1.03 * first[0], 6), *first[1:]]
    return _fragment(
        "tools.html",
        connection=_asset(f"connection_{kind}.html"),
        file=EXAMPLE_FILES[kind],
        names=", ".join(f'"{v.name}"' for v in inputs),
        first=", ".join(map(repr, first)),
        last=", ".join(map(repr, last)),
        ramped=inputs[0].name,
        end=repr(last[0]),
        outputs="[" + ", ".join(f'"{name}"' for name in outputs) + "]",
        output=outputs[0],
    )


def _licence(table: CreepForceTable) -> str:
    cells = " by ".join(str(n) for n in table.cells)
    size = f", {cells} cells" if any(table.cells) else ""
    return (
        f"<p>contactlib {version()}; library <code>{escape(kernel.token())}</code>; table of "
        f"<code>{escape(table.law)}</code>{size}.</p>\n"
        f"<pre>{escape(licence_text().decode())}</pre>"
    )
