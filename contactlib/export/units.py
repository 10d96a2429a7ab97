"""Units, display units and types of the variables, for both versions of the standard."""

from __future__ import annotations

import math
from typing import NamedTuple


class Display(NamedTuple):
    """Display unit: displayed value = factor * value in the SI unit."""

    name: str
    factor: float


class Unit(NamedTuple):
    """Exponents of the SI base units, and customary display units, the usual one first."""

    base: dict[str, int] | None  # None: FMI has no fractional exponents
    displays: tuple[Display, ...] = ()


UNITS: dict[str, Unit] = {
    "1": Unit({}, (Display("%", 100.0),)),
    "s": Unit({"s": 1}, (Display("ms", 1e3),)),
    "m": Unit({"m": 1}, (Display("mm", 1e3), Display("um", 1e6))),
    "N": Unit({"kg": 1, "m": 1, "s": -2}, (Display("kN", 1e-3),)),
    "N/s": Unit({"kg": 1, "m": 1, "s": -3}, (Display("kN/s", 1e-3),)),
    "Pa": Unit({"kg": 1, "m": -1, "s": -2}, (Display("MPa", 1e-6),)),
    "m/Pa": Unit({"kg": -1, "m": 2, "s": 2}, (Display("um/MPa", 1e12),)),
    "m/s": Unit({"m": 1, "s": -1}, (Display("km/h", 3.6),)),
    "s/m": Unit({"m": -1, "s": 1}),
    "m/s2": Unit({"m": 1, "s": -2}),
    "1/s": Unit({"s": -1}),
    "1/m": Unit({"m": -1}),
    "rad/s": Unit({"rad": 1, "s": -1}, (Display("rpm", 30.0 / math.pi),)),
    "rad/s2": Unit({"rad": 1, "s": -2}),
    "N.m": Unit({"kg": 1, "m": 2, "s": -2}, (Display("kN.m", 1e-3),)),
    "N.s/m": Unit({"kg": 1, "s": -1}),
    "N.s2/m2": Unit({"kg": 1, "m": -1}),
    "N.m.s/rad": Unit({"kg": 1, "m": 2, "s": -1, "rad": -1}),
    "kg.m2": Unit({"kg": 1, "m": 2}),
    "N.m/Pa": Unit({"m": 3}, (Display("kN.m/MPa", 1e3),)),
    "N.m/s": Unit({"kg": 1, "m": 2, "s": -3}, (Display("kN.m/s", 1e-3),)),
    "kg": Unit({"kg": 1}, (Display("t", 1e-3),)),
    "1/kg": Unit({"kg": -1}),
    "K": Unit({"K": 1}),
    "W.s0.5/(m2.K)": Unit(None),
}


class Type(NamedTuple):
    """A physical type: its unit, and the index of the display unit that tools show; none if -1."""

    name: str
    unit: str
    shown_in: int = 0

    @property
    def display(self) -> Display | None:
        """Display unit, if there is one."""
        displays = UNITS[self.unit].displays
        return displays[self.shown_in] if 0 <= self.shown_in < len(displays) else None


# Types by unit; for unit 1 the variable's name decides.
TYPES = {
    kind.unit: kind
    for kind in (
        Type("Time", "s", shown_in=-1),
        Type("Length", "m"),
        Type("Force", "N"),
        Type("ForceRate", "N/s"),
        Type("Pressure", "Pa"),
        Type("ShearCompliance", "m/Pa"),
        Type("Velocity", "m/s"),
        Type("InverseVelocity", "s/m"),
        Type("Acceleration", "m/s2"),
        Type("Rate", "1/s"),
        Type("Spin", "1/m"),
        Type("AngularVelocity", "rad/s"),
        Type("AngularAcceleration", "rad/s2"),
        Type("Torque", "N.m"),
        Type("ForcePerVelocity", "N.s/m"),
        Type("ForcePerVelocitySquared", "N.s2/m2"),
        Type("RotationalDamping", "N.m.s/rad"),
        Type("MomentOfInertia", "kg.m2"),
        Type("TorquePerPressure", "N.m/Pa"),
        Type("TorqueRate", "N.m/s"),
        Type("Mass", "kg"),
        Type("InverseMass", "1/kg"),
        Type("TemperatureRise", "K", shown_in=-1),
        Type("ThermalEffusivity", "W.s0.5/(m2.K)", shown_in=-1),
    )
}
NUMBER = Type("Number", "1", shown_in=-1)
CREEPAGE = Type("Creepage", "1")
WEAKENING = Type("WeakeningLength", "m", shown_in=1)
CREEPAGES = (
    "creepage",
    "saturation_creepage",
    "creepage_x",
    "creepage_y",
)


def type_of(name: str, unit: str) -> Type:
    """Type of a variable."""
    if unit == "1":
        return CREEPAGE if name in CREEPAGES else NUMBER
    return WEAKENING if name == "weakening_length" else TYPES[unit]
