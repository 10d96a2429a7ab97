"""Units in common spellings, and their values in SI units.

pint, tried for this, reads "24 kNm" as a textile unit, "1,5 %" as 0.15 and never returns from
"9**9**9 m", so this module defines the units that the files need.
"""

from __future__ import annotations

import math
import re

STANDARD_GRAVITY = 9.80665  # m/s2
AMBIENT = 20.0  # degC, in messages
# Value of each further unit in the SI unit of a quantity.
UNITS = {
    "1": {"%": 1e-2, "permille": 1e-3},
    "m": {"km": 1e3, "mi": 1609.344, "cm": 1e-2, "mm": 1e-3, "um": 1e-6},
    "s": {"ms": 1e-3, "min": 60.0, "h": 3600.0},
    "1/s": {"1/min": 1.0 / 60.0},
    "rad/s": {"1/min": 2.0 * math.pi / 60.0, "rpm": 2.0 * math.pi / 60.0},
    "kg": {"t": 1e3},
    "kg.m2": {"t.m2": 1e3},
    "N": {"kN": 1e3, "MN": 1e6, "lbf": 4.4482216152605},
    "W": {"kW": 1e3, "MW": 1e6},
    "Pa": {"kPa": 1e3, "bar": 1e5, "MPa": 1e6, "GPa": 1e9, "N/mm2": 1e6, "kN/mm2": 1e9},
    "m/Pa": {"um/MPa": 1e-12, "um/GPa": 1e-15, "m3/N": 1.0, "mm3/N": 1e-9},
    "W.s0.5/(m2.K)": {"J/(m2.K.s0.5)": 1.0},
    "m/s": {"km/h": 1.0 / 3.6, "mph": 0.44704},
    "s/m": {"h/km": 3.6},
    "N.m": {"kN.m": 1e3, "MN.m": 1e6},
    "N.s": {"kN.s": 1e3},
    "N/m": {"kN/m": 1e3, "N/mm": 1e3, "kN/mm": 1e6, "MN/m": 1e6},
    "N.s/m": {"kN.s/m": 1e3},
    "N.m/s": {"kN.m/s": 1e3},
    "N.m/rad": {"kN.m/rad": 1e3, "MN.m/rad": 1e6},
    "N.m.s/rad": {"kN.m.s/rad": 1e3},
    "1/(N.m)": {"1/(kN.m)": 1e-3},
    "K": {"delta_degC": 1.0, "delta_degF": 5.0 / 9.0},  # of a rise, not of a temperature
}
# Substitutions of other spellings by those above, in this order. Python and the explorer page use
# the same regular expressions.
SPELLINGS = (
    (r"[\u00b5\u03bc]", "u"),
    (r"\u00b2", "2"),
    (r"\*\*|\^", ""),
    (r"\s*/\s*", "/"),
    (r"\s*[*\u00b7\u22c5]\s*|\s+", "."),  # a product
    (r"(?<=N)(?=ms?\b|s\b)", "."),  # kNm, Nms, Ns
    (r"(?<=N\.m)(?=s\b)", "."),
    (r"(?<=kg)(?=m2)|(?<=\bt)(?=m2)", "."),
    (r"^(?:kph|kmh|kmph|km/hr)$", "km/h"),
    (r"\bsec\b", "s"),
    (r"^tonnes?$", "t"),
    (r"^(?:percent|per\.cent)$", "%"),
    (r"^(?:\u2030|per\.?mill?e?|promille|mm/m)$", "permille"),
    (r"^miles?$", "mi"),
    (r"^min(?:-1|\u207b\u00b9)$", "1/min"),
    (r"^(?:\u00b0\.?|deg\.)?C(?:elsius)?$", "degC"),
    (r"^-?$", "1"),
)
NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?(?![0-9_])")


def unit_value(unit: str, si: str) -> float | None:
    """Value of a unit, in any spelling, in the SI unit `si`; None if it is no such unit.

    Examples
    --------
    >>> unit_value("kN m", "N.m"), unit_value("mm", "N.m")
    (1000.0, None)
    """
    known = {si: 1.0, **UNITS.get(si, {})}
    plain = unit.strip()
    for pattern, replacement in SPELLINGS:
        if plain not in known and len(plain) < 100:  # quadratic in the number of spaces
            plain = re.sub(pattern, replacement, plain)
    return known.get(plain)


def not_in(unit: str, si: str) -> str:
    """End of a message on a unit of another dimension than `si`: a remedy, and the known units."""
    remedy = ""
    if si == "1" and unit_value(unit, "m/s") is not None:
        remedy = "divide a slip velocity by the running speed; "
    elif si == "1" and unit_value(unit, "N") is not None:
        remedy = "divide by the load, with load = its value in N under which it was measured; "
    known = ", ".join([si, *UNITS.get(si, {})])
    return f"is in {unit!r}, which is not a unit in {si}: {remedy}known are {known}"


def in_si(text: str, si: str, *, bare: bool = False) -> float:
    """Value of a text such as ``"24 kNm"`` in the SI unit `si`, which it may leave out if `bare`.

    Raises
    ------
    ValueError
        If the text is not a number and a unit of the same dimension; the message is the end of a
        sentence that begins with the text.

    Examples
    --------
    >>> in_si("24 kNm", "N.m"), in_si("1.5%", "1")
    (24000.0, 0.015)
    """
    text = text.strip()
    match = NUMBER.match(text)
    if match is None:
        raise ValueError("does not begin with a number")
    number = float(match[0])
    unit = text[match.end() :]
    if bare and not unit:
        return number
    if not unit and si != "1":
        raise ValueError(f'has no unit: write "{text} {si}", or {text} without quotation marks')
    if unit.startswith(","):
        raise ValueError("has a decimal comma: use a decimal point")
    value = unit_value(unit, si) if unit else None
    if value is not None:
        return number * value
    mass = unit_value(unit, "kg") if unit and si == "N" else None
    if mass is not None:
        weight = number * mass * STANDARD_GRAVITY / 1e3
        raise ValueError(f'is a mass; its weight is "{weight:.4g} kN"')
    if si == "K" and unit_value(unit, "degC"):
        rise = f'"{number - AMBIENT:g} K" if ambient is {AMBIENT:g} degC'
        raise ValueError(f"is a temperature; give the rise above ambient: {rise}")
    known = ", ".join([si, *UNITS.get(si, {})])
    raise ValueError(f"must be a number in {si}, or a number and one of: {known}")
