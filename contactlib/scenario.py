"""Model files: TOML in, validated and frozen parameters out.

Numbers are in SI units; a string such as ``"5 mm"`` names its unit, which must measure the same
thing. An unknown key, a missing key, a wrong type or a value out of range is a `ModelError` of one
line that names file, key, value and limit.
"""

from __future__ import annotations

import difflib
import os
import tomllib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_origin, get_type_hints

from contactlib.controllers import CreepControl, TorqueControl
from contactlib.element import ForceElement, friction_with_k_hat, saturation_creepage
from contactlib.files import package_folder
from contactlib.friction import Friction
from contactlib.hertz import Contact, EllipticContact, LineContact, Material
from contactlib.law_tables import Shape, carter_griffith_table, cohesive_table
from contactlib.laws import MeasuredCurve, Polach
from contactlib.parameters import Parameters, Quantity
from contactlib.profile import Profile
from contactlib.table import CreepForceTable
from contactlib.wheelset import Resistance, Wheelset

# How many SI units one of each unit is, by the SI unit of the quantity.
UNITS = {
    "1": {"%": 1e-2},
    "m": {"km": 1e3, "mm": 1e-3, "um": 1e-6},
    "s": {"ms": 1e-3, "min": 60.0},
    "kg": {"t": 1e3},
    "N": {"kN": 1e3, "MN": 1e6},
    "Pa": {"kPa": 1e3, "MPa": 1e6, "GPa": 1e9},
    "m/s": {"km/h": 1.0 / 3.6},
    "s/m": {"h/km": 3.6},
    "N.m": {"kN.m": 1e3},
    "N.m/s": {"kN.m/s": 1e3},
}


class ModelError(ValueError):
    """A model file that cannot be used; one line says where and why."""


@dataclass(frozen=True, kw_only=True)
class ContactSection(Parameters):
    """``[contact]``: a contact under its nominal load, of two bodies of one material.

    A line contact has `semi_width` and `radius`; an elliptic one has either the relative radii or
    the semi-axes, in the rolling direction x and across it.
    """

    semi_width: Annotated[float | None, Quantity("m", above=0.0)] = None
    radius: Annotated[float | None, Quantity("m", above=0.0)] = None
    radius_x: Annotated[float | None, Quantity("m", above=0.0)] = None
    radius_y: Annotated[float | None, Quantity("m", above=0.0)] = None
    semi_axis_x: Annotated[float | None, Quantity("m", above=0.0)] = None
    semi_axis_y: Annotated[float | None, Quantity("m", above=0.0)] = None
    normal_load: Annotated[float, Quantity("N", above=0.0)]
    youngs_modulus: Annotated[float, Quantity("Pa", above=0.0)]
    poisson_ratio: Annotated[float, Quantity("1", at_least=0.0, at_most=0.5)]

    def build(self) -> Contact:
        """The contact."""
        makers: dict[tuple[str, ...], Callable[..., Contact]] = {
            ("semi_width", "radius"): LineContact.from_semi_width,
            ("radius_x", "radius_y"): EllipticContact,
            ("semi_axis_x", "semi_axis_y"): EllipticContact.from_semi_axes,
        }
        keys = [key for pair in makers for key in pair]
        given = tuple(key for key in keys if getattr(self, key) is not None)
        if given not in makers:
            pairs = ", or ".join(" and ".join(pair) for pair in makers)
            raise ValueError(
                f"{pairs}: give exactly one of these pairs, not {' and '.join(given) or 'nothing'}"
            )
        material = Material(youngs_modulus=self.youngs_modulus, poisson_ratio=self.poisson_ratio)
        return makers[given](
            normal_load=self.normal_load,
            contact_modulus=material.contact_modulus_with(material),
            **{key: getattr(self, key) for key in given},
        )


@dataclass(frozen=True, kw_only=True)
class FrictionSection(Parameters):
    """``[friction]``: give one of `weakening_length` and `k_hat`."""

    static: Annotated[float, Quantity("1", above=0.0)]
    kinetic: Annotated[float, Quantity("1", above=0.0)]
    weakening_length: Annotated[float | None, Quantity("m", at_least=0.0)] = None
    k_hat: Annotated[float | None, Quantity("1", at_least=0.0, at_most=2.0)] = None
    slip_rate_residual: Annotated[float, Quantity("1", above=0.0, at_most=1.0)] = 1.0
    slip_rate_decay: Annotated[float, Quantity("s/m", at_least=0.0)] = 0.0

    def build(self, contact: Contact) -> Friction:
        """The friction, whose weakening length may follow from `k_hat`."""
        _one_of(self, "weakening_length", "k_hat")
        values = {
            key: getattr(self, key)
            for key in ("static", "kinetic", "slip_rate_residual", "slip_rate_decay")
        }
        if self.weakening_length is not None:
            return Friction(weakening_length=self.weakening_length, **values)
        return friction_with_k_hat(contact, k_hat=self.k_hat or 0.0, **values)


@dataclass(frozen=True, kw_only=True)
class LawSection(Parameters):
    """``[law]``: which law gives the creep force; Carter-Griffith's if left out."""

    kind: str = "carter_griffith"
    adhesion_reduction: Annotated[float | None, Quantity("1", above=0.0, at_most=1.0)] = None
    slip_reduction: Annotated[float | None, Quantity("1", above=0.0, at_most=1.0)] = None
    kalker_coefficient: Annotated[float | None, Quantity("1", above=0.0)] = None
    file: str | None = None

    def build(
        self,
        contact: Contact,
        friction: Friction,
        poisson_ratio: float,
        progress: Callable[[float], object],
    ) -> CreepForceTable:
        """The law's table."""
        shape: Shape = "elliptic" if isinstance(contact, EllipticContact) else "line"
        wanted = LAWS.get(self.kind)
        if wanted is None:
            raise ValueError(f"kind = {self.kind!r} must be one of: {', '.join(LAWS)}")
        given = [f.name for f in fields(self)[1:] if getattr(self, f.name) is not None]
        if given != list(wanted):
            what = f"the keys {', '.join(wanted)}" if wanted else "no other key"
            raise ValueError(f"kind = {self.kind!r} takes {what}, not {given}")
        if self.kind == "cohesive":
            return cohesive_table(shape, friction.ratio, friction.weakening, progress)
        if self.kind == "polach":
            values = {name: getattr(self, name) for name in wanted}
            return CreepForceTable.from_law(Polach(**values, poisson_ratio=poisson_ratio))
        if self.file is not None:
            curve = MeasuredCurve.from_csv(model_path(self.file), kinetic=friction.kinetic)
            return CreepForceTable.from_law(curve)
        return carter_griffith_table(shape)


# Keys that each kind of law needs.
LAWS: dict[str, tuple[str, ...]] = {
    "carter_griffith": (),
    "cohesive": (),
    "polach": ("adhesion_reduction", "slip_reduction", "kalker_coefficient"),
    "measured": ("file",),
}


@dataclass(frozen=True, kw_only=True)
class WheelsetSection(Parameters):
    """``[wheelset]``: give at most one of `saturation_creepage` and `slope_reduction`."""

    radius: Annotated[float, Quantity("m", above=0.0)]
    inertia: Annotated[float, Quantity("kg.m2", above=0.0)]
    mass: Annotated[float | None, Quantity("kg", above=0.0)] = None
    damping: Annotated[float, Quantity("N.m.s/rad", at_least=0.0)] = 0.0
    saturation_creepage: Annotated[float | None, Quantity("1", above=0.0)] = None
    slope_reduction: Annotated[float | None, Quantity("1", above=0.0, at_most=1.0)] = None
    minimum_speed: Annotated[float, Quantity("m/s", above=0.0)] = 0.1

    def reduction(self, contact: Contact, friction: Friction) -> float:
        """Slope reduction, which may follow from the saturation creepage."""
        if self.saturation_creepage is None:
            return 1.0 if self.slope_reduction is None else self.slope_reduction
        _one_of(self, "saturation_creepage", "slope_reduction")
        clean = saturation_creepage(contact, friction)
        if self.saturation_creepage < clean * (1.0 - 1e-12):
            raise ValueError(
                f"saturation_creepage = {self.saturation_creepage!r} is out of range: must be >= "
                f"{clean:.6g}, that of clean surfaces"
            )
        return min(1.0, clean / self.saturation_creepage)


@dataclass(frozen=True, kw_only=True)
class TorqueSection(Parameters):
    """``[torque_control]``: breakpoints of the drive torque."""

    time: Annotated[tuple[float, ...], Quantity("s", at_least=0.0)]
    torque: Annotated[tuple[float, ...], Quantity("N.m")]

    def build(self) -> TorqueControl:
        """The controller."""
        return TorqueControl(Profile(self.time, self.torque))


@dataclass(frozen=True, kw_only=True)
class CreepSection(Parameters):
    """``[creep_control]``: breakpoints of the creepage, gains and torque limits."""

    time: Annotated[tuple[float, ...], Quantity("s", at_least=0.0)]
    creepage: Annotated[tuple[float, ...], Quantity("1", above=-1.0)]
    proportional_gain: Annotated[float, Quantity("N.m", above=0.0)]
    integral_gain: Annotated[float, Quantity("N.m/s", at_least=0.0)]
    torque_min: Annotated[float, Quantity("N.m")]
    torque_max: Annotated[float, Quantity("N.m")]

    def build(self) -> CreepControl:
        """The controller."""
        return CreepControl(
            reference=Profile(self.time, self.creepage),
            proportional_gain=self.proportional_gain,
            integral_gain=self.integral_gain,
            torque_min=self.torque_min,
            torque_max=self.torque_max,
        )


@dataclass(frozen=True, kw_only=True)
class RunSection(Parameters):
    """``[run]``: what both controls start from."""

    initial_speed: Annotated[float, Quantity("m/s", above=0.0)]


@dataclass(frozen=True, kw_only=True)
class Model:
    """A wheelset and what it is put through.

    Attributes
    ----------
    name, source : str
        What it is, and where its numbers come from.
    wheelset : Wheelset
        Contact, friction, table and body.
    torque_control, creep_control : TorqueControl, CreepControl
        The two runs of the demonstration.
    initial_speed : float
        [m/s].
    """

    name: str
    source: str
    wheelset: Wheelset
    torque_control: TorqueControl
    creep_control: CreepControl
    initial_speed: float


def model_path(name: str | os.PathLike[str]) -> Path:
    """A file of this path or, failing that, a shipped one: ``x.toml`` or ``models/x.toml``."""
    path = Path(name)
    shipped = package_folder("models") / path.name
    meant = path in (Path(path.name), Path("models") / path.name)
    return shipped if meant and not path.exists() and shipped.is_file() else path


def load_model(
    path: str | os.PathLike[str],
    *,
    table: CreepForceTable | None = None,
    progress: Callable[[float], object] = lambda part: None,
) -> Model:
    """Read a model file.

    Parameters
    ----------
    path : path
        A TOML file, or the name of a shipped one such as ``"models/roller_rig.toml"``.
    table : CreepForceTable, optional
        The law; if left out that of the file's ``[law]`` section, or Carter and Griffith's.
    progress : callable
        Is told what part of the law's table has been built, which the cohesive law needs.

    Raises
    ------
    ModelError
        If the file is not a valid model; one line names file, key, value and limit.
    OSError
        If it cannot be read.
    """
    file = model_path(path)
    try:
        data = tomllib.loads(file.read_bytes().decode())
        return _build_model(data, table, progress)
    except ValueError as error:  # TOML, encoding and range errors alike
        raise ModelError(f"{os.fspath(path)}: {error}") from None


def _build_model(
    data: dict[str, Any], table: CreepForceTable | None, progress: Callable[[float], object]
) -> Model:
    sections = {
        "contact": ContactSection,
        "friction": FrictionSection,
        "wheelset": WheelsetSection,
        "resistance": Resistance,
        "run": RunSection,
        "torque_control": TorqueSection,
        "creep_control": CreepSection,
    }
    needed = ["name", "source", *sections]
    _check_keys("", data, [*needed, "law"], needed)
    for key in ("name", "source"):
        if not isinstance(data[key], str):
            raise ValueError(f"{key} = {data[key]!r} must be a string")
    contact_section = _read("contact", ContactSection, data)
    friction_section = _read("friction", FrictionSection, data)
    law_section = _read("law", LawSection, {"law": {}, **data})
    body = _read("wheelset", WheelsetSection, data)
    with _named("contact"):
        contact = contact_section.build()
    with _named("friction"):
        friction = friction_section.build(contact)
    with _named("law"):
        if table is None:
            table = law_section.build(contact, friction, contact_section.poisson_ratio, progress)
    with _named("wheelset"):
        element = ForceElement(
            contact,
            friction,
            table=table,
            radius=body.radius,
            slope_reduction=body.reduction(contact, friction),
            minimum_speed=body.minimum_speed,
        )
    torque_section = _read("torque_control", TorqueSection, data)
    creep_section = _read("creep_control", CreepSection, data)
    with _named("torque_control"):
        torque_control = torque_section.build()
    with _named("creep_control"):
        creep_control = creep_section.build()
    return Model(
        name=data["name"],
        source=data["source"],
        wheelset=Wheelset(
            element,
            inertia=body.inertia,
            mass=body.mass,
            damping=body.damping,
            resistance=_read("resistance", Resistance, data),
        ),
        torque_control=torque_control,
        creep_control=creep_control,
        initial_speed=_read("run", RunSection, data).initial_speed,
    )


@contextmanager
def _named(section: str) -> Iterator[None]:
    """Put the section's name before any ValueError from inside."""
    try:
        yield
    except ValueError as error:
        message = str(error)
        name, dot, rest = message.partition(".")
        if dot and name.isidentifier() and name[0].isupper():  # Class.argument: the key
            message = rest
        raise ValueError(f"{section}.{message}") from None


Section = TypeVar("Section", bound=Parameters)


def _read(name: str, section: type[Section], data: Mapping[str, Any]) -> Section:
    table = data[name]
    if not isinstance(table, dict):
        raise ValueError(f"{name} = {table!r} must be a section: [{name}]")
    declared = {f.name: f.default for f in fields(section)}  # type: ignore[arg-type]
    needed = [key for key, default in declared.items() if default is MISSING]
    _check_keys(f"{name}.", table, list(declared), needed)
    quantities, hints = section.quantities(), get_type_hints(section)
    values: dict[str, Any] = {}
    for key, value in table.items():
        where = f"{name}.{key}"
        if key not in quantities:
            if not isinstance(value, str):
                raise ValueError(f"{where} = {value!r} must be a string")
            values[key] = value
        elif get_origin(hints[key]) is tuple:
            if not isinstance(value, list) or not value:
                raise ValueError(f"{where} = {value!r} must be a list of at least one number")
            values[key] = tuple(_number(where, entry, quantities[key]) for entry in value)
        else:
            values[key] = _number(where, value, quantities[key])
    with _named(name):
        return section(**values)


def _check_keys(prefix: str, table: Mapping[str, Any], known: list[str], needed: list[str]) -> None:
    for key in table:
        if key not in known:
            close = difflib.get_close_matches(key, known, 1)
            meant = f"did you mean {close[0]!r}? " if close else ""
            raise ValueError(f"{prefix}{key} is not a known key; {meant}known: {', '.join(known)}")
    for key in needed:
        if key not in table:
            raise ValueError(f"{prefix}{key} is missing")


def _number(where: str, value: object, quantity: Quantity) -> float:
    """A TOML value in SI units, within the limits."""
    number: float
    if isinstance(value, str):
        text, _, unit = value.strip().partition(" ")
        units = {quantity.unit: 1.0, **UNITS.get(quantity.unit, {})}
        if unit not in units:
            raise ValueError(
                f"{where} = {value!r} must be a number in {quantity.unit}, "
                f"or a number and one of: {', '.join(units)}"
            )
        try:
            number = float(text) * units[unit]
        except ValueError:
            raise ValueError(f"{where} = {value!r} does not begin with a number") from None
    elif isinstance(value, (int, float)) and not isinstance(value, bool):
        number = float(value)
    else:
        raise ValueError(f"{where} = {value!r} must be a number in {quantity.unit}")
    if not quantity.allows(number):
        raise ValueError(f"{where} = {value!r} is out of range: must be {quantity}")
    return number


def _one_of(section: Parameters, *keys: str) -> None:
    given = [key for key in keys if getattr(section, key) is not None]
    if len(given) != 1:
        raise ValueError(f"{' and '.join(keys)}: give exactly one of them, not {len(given)}")
