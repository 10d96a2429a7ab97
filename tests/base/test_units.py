"""Units in any spelling, and what is refused with a reason."""

from __future__ import annotations

import math

import pytest

from contactlib.base.units import STANDARD_GRAVITY, UNITS, in_si, unit_value

SAME = {
    ("N.m", 24e3): (
        "24 kN.m",
        "24 kNm",
        "24 kN m",
        "24 kN*m",
        "24kN\u00b7m",
        "24000 Nm",
        "2.4e4 N m",
    ),
    ("N.m.s/rad", 50.0): ("50 N.m.s/rad", "50 Nms/rad", "50 N m s / rad", "0.05 kNms/rad"),
    ("N.s", 2.0): ("2 N.s", "2Ns", "2 N s", "0.002 kNs"),
    ("kg.m2", 250.0): (
        "250 kg.m2",
        "250 kgm2",
        "250 kg m^2",
        "250 kg*m**2",
        "250 kg m\u00b2",
        "0.25 tm2",
    ),
    ("Pa", 210e9): ("210 GPa", "210e3 MPa", "210e3 N/mm2", "210e3 N/mm^2", "210 kN / mm\u00b2"),
    ("m", 1.5e-6): ("1.5 um", "1.5 \u00b5m", "1.5\u03bcm", "1.5e-4 cm", "1.5e-3 mm", "1.5\u00a0um"),
    ("m/s", 20.0): ("72 km/h", "72kph", "72 kmh", "20 m/s", "20 m / s", "20 m/sec"),
    ("kg", 142.5e3): ("142.5 t", "142.5 tonnes", "142.5t"),
    ("1", 0.015): (
        "1.5 %",
        "1.5%",
        "1.5 percent",
        "1.5 per cent",
        "0.015 -",
        "0.015 1",
        "15 per mille",
        "15 permille",
        "15 \u2030",
    ),
    ("N", 4.4482216152605): ("1 lbf",),
    ("1/s", 0.5): ("0.5 1/s", "30 1/min"),
    ("rad/s", 10.0 * math.pi): ("300 rpm", "300 1/min", "300 min^-1", "300 min\u207b\u00b9"),
    ("K", 600.0): ("600 K", "600 delta_degC", "1080 delta_degF"),
    ("1/(N.m)", 1e-3): ("0.001 1/(N.m)", "1 1/(kN m)", "1 1/(kNm)"),
}


@pytest.mark.parametrize(("si", "value"), SAME)
def test_a_unit_has_many_spellings(si: str, value: float) -> None:
    for text in SAME[si, value]:
        assert in_si(text, si) == pytest.approx(value, rel=1e-15), text


def test_every_listed_unit_is_known_by_its_name() -> None:
    for si, units in UNITS.items():
        assert unit_value(si, si) == 1.0
        for unit, value in units.items():
            assert unit_value(unit, si) == value


@pytest.mark.parametrize(
    ("text", "si", "message"),
    [
        ("5 kN", "m", "must be a number in m, or a number and one of: m, km, mi, cm, mm, um"),
        ("5", "m", 'has no unit: write "5 m", or 5 without quotation marks'),
        ("5 mm 3", "m", "must be a number in m"),
        ("mm 5", "m", "does not begin with a number"),
        ("1_ mm", "m", "does not begin with a number"),
        ("5_0_0 mm", "m", "does not begin with a number"),
        ("\u0665 mm", "m", "does not begin with a number"),  # five, in Arabic
        ("\uff15 mm", "m", "does not begin with a number"),  # five, as wide as a letter
        ("1,5 mm", "m", "has a decimal comma"),
        ("1 kNm", "N.m/rad", "must be a number in N.m/rad"),
        ("9**9**9 m", "m", "must be a number in m"),
        ("600 degC", "K", 'is a temperature; .* rise above ambient: "580 K" if ambient is 20 degC'),
        ("600 \u00b0C", "K", 'is a temperature; .* rise above ambient: "580 K"'),
        ("600 C", "K", 'is a temperature; .* rise above ambient: "580 K"'),
    ],
)
def test_what_is_no_quantity_is_refused(text: str, si: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        in_si(text, si)


def test_a_mass_for_a_load_gets_its_weight() -> None:
    with pytest.raises(ValueError, match=r'is a mass; its weight is "220\.6 kN"') as caught:
        in_si("22.5 t", "N")
    hint = str(caught.value).split('"')[1]
    assert in_si(hint, "N") == pytest.approx(22.5e3 * STANDARD_GRAVITY, rel=5e-4)
