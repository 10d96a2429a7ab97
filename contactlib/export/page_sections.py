"""Sections of the page in an FMU: numbers of the model set into the fragments in ``assets/``."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from string import Template
from typing import TYPE_CHECKING, Any

import numpy as np

from contactlib.export.curve_svg import curve_svg, sample_curve
from contactlib.export.description import MODEL_NAMES, Variable
from contactlib.files import PACKAGE
from contactlib.table import CreepForceTable
from contactlib.wheelset import Wheelset

if TYPE_CHECKING:
    from contactlib.scenario import Model

ASSETS = PACKAGE / "export" / "assets"
GROUPS = {
    "input": "Inputs",
    "output": "Outputs",
    "parameter": "Parameters, fixed during a run",
    "tunable parameter": "Parameters, tunable during a run",
    "local": "Inner variables",
    "independent": "Independent variable",
}
HERE = '<span class="tag here">this FMU</span>'
ELSEWHERE = '<span class="tag">another export</span>'
PARAMETER = '<span class="tag">a parameter</span>'
SPEEDS = (0.0, 1.0, 10.0, 50.0)  # of the table of stable steps [m/s]


def asset(name: str) -> str:
    """Text of a static file."""
    return (ASSETS / name).read_text(encoding="ascii")


def fragment(name: str, **values: str) -> str:
    """Text of a static file, its placeholders replaced."""
    return Template(asset(name)).substitute(values)


def facts(model: Model, kind: str) -> str:
    """The numbers that make this model what it is."""
    wheelset, element = model.wheelset, model.wheelset.element
    contact, friction = element.contact, element.friction
    shown = {"wheel radius": f"{element.radius:.5g} m"}
    if kind != "wheelset_body":
        shown |= {
            "nominal load": f"{contact.normal_load / 1e3:.5g} kN",
            "contact semi-width": f"{contact.semi_width * 1e3:.4g} mm",
            "peak pressure": f"{contact.peak_pressure / 1e6:.4g} MPa",
            "friction, static and kinetic": f"{friction.static:.4g}, {friction.kinetic:.4g}",
            "weakening length": f"{friction.weakening_length * 1e6:.4g} &#181;m",
            "k_hat": f"{element.k_hat:.4g}",
            "saturation creepage": f"{100 * element.saturation_creepage:.4g} %",
        }
    mass = "speed is held" if wheelset.mass is None else f"{wheelset.mass / 1e3:.5g} t"
    shown |= {
        "inertia about the axle": f"{wheelset.inertia:.5g} kg&#183;m&#178;",
        "mass moved": mass,
        "effective inverse mass": f"{wheelset.effective_inverse_mass:.4g} 1/kg",
    }
    rows = "\n".join(f"<div><dt>{name}</dt><dd>{value}</dd></div>" for name, value in shown.items())
    return f'<dl class="facts">\n{rows}\n</dl>'


def law(model: Model) -> str:
    """The curve of this model's element, and the certificate of its table."""
    element, table = model.wheelset.element, model.wheelset.element.table
    speed = max(model.initial_speed, element.minimum_speed)
    curve = sample_curve(element, speed=speed)
    shape = "solid up to the peak, dashed where the force falls with creepage"
    if curve.peak is None:
        shape = "without a peak: the force does not fall with creepage"
    k_range = "one curve, no k_hat" if table.one_axis else f"k_hat from 0 to {table.k_max:g}"
    certificate = {
        "law": f"<code>{escape(table.law)}</code>",
        "range of the table": f"{k_range}; any creepage",
        "largest error of Q/(f<sub>d</sub> P)": f"{table.max_error:.2g}",
        "largest error of its slope": f"{table.max_slope_error:.2g}",
        "points compared": f"{table.certificate_points}",
    }
    rows = "\n".join(
        f'<tr><th scope="row">{name}</th><td>{value}</td></tr>'
        for name, value in certificate.items()
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


def equations(table: CreepForceTable, kind: str, relaxed: bool) -> str:
    """The equations that this FMU solves."""
    names = []
    if kind != "wheelset_body":
        shape = table.options.get("contact", "other")
        names.append("contact")
        names.append(shape if table.law.startswith("CarterGriffith") else "other")
        if relaxed:
            names.append("relaxation")
    if kind != "force_element":
        names.append("motion")
    return "".join(asset(f"equations_{name}.html") for name in names)


def variable_tables(variables: Sequence[Variable]) -> str:
    """Every variable with unit, limits, start and meaning, by causality."""
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
    low, high = ("" if limit is None else f"{limit:.6g}" for limit in (v.minimum, v.maximum))
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
    if np.isinf(value):
        return "&#8734;"
    return f"{float(f'{value:.3g}'):,.9g}".replace(",", "&#8239;")


def coupling(wheelset: Wheelset, kind: str, variables: Sequence[Variable], relaxed: bool) -> str:
    """Which communication step is stable, and the ways around a short one."""
    starts = {v.name: v.start for v in variables}
    implicit = bool(starts.get("implicit"))
    length = starts.get("relaxation_length") if relaxed and kind == "force_element" else None
    return fragment(
        f"coupling_{kind}.html",
        step_table=_step_table(wheelset, kind, float(length) if length else None),
        held_here=ELSEWHERE if relaxed else PARAMETER if implicit else HERE,
        implicit_here=HERE if implicit else PARAMETER,
        relaxed_here=HERE if relaxed else ELSEWHERE,
    )


def _step_table(wheelset: Wheelset, kind: str, relaxation_length: float | None) -> str:
    """Slip pole and longest stable steps of this model at creepage zero, for some speeds."""
    element = wheelset.element
    speeds = np.array(SPEEDS)
    record: Any = element.evaluate(omega=speeds / wheelset.radius, speed=speeds)
    poles = record["force_gradient"] * wheelset.effective_inverse_mass
    sequential = 2.0 / poles
    if relaxation_length is not None:  # and no regularised speed
        stiffness = poles[-1] * speeds[-1]
        with np.errstate(divide="ignore"):
            poles = stiffness / speeds
        sequential = np.maximum(2.0 / poles, 2.0 * np.sqrt(relaxation_length / stiffness))
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


def tools(kind: str, variables: Sequence[Variable]) -> str:
    """How to load and connect it."""
    inputs = [v for v in variables if v.causality == "input"]
    outputs = [v.name for v in variables if v.causality == "output"][:3]
    first = [float(v.start or 0.0) for v in inputs]
    last = [round(1.03 * first[0], 6), *first[1:]]
    return fragment(
        "tools.html",
        connection=asset(f"connection_{kind}.html"),
        file=f"{MODEL_NAMES[kind]}.fmu",
        names=", ".join(f'"{v.name}"' for v in inputs),
        first=", ".join(map(repr, first)),
        last=", ".join(map(repr, last)),
        ramped=inputs[0].name,
        end=repr(last[0]),
        outputs="[" + ", ".join(f'"{name}"' for name in outputs) + "]",
        output=outputs[0],
    )
