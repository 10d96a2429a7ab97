"""Sections of a model file that say what touches: contact, friction, law, and wheelset."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated

from contactlib.element import friction_with_k_hat, saturation_creepage
from contactlib.friction import Friction
from contactlib.hertz import Contact, EllipticContact, LineContact, Material
from contactlib.law_tables import Shape, carter_griffith_table, cohesive_table
from contactlib.laws import MeasuredCurve, Polach
from contactlib.parameters import Parameters, Quantity
from contactlib.scenario.beside import file_beside
from contactlib.scenario.reading import in_file, one_of
from contactlib.table import CreepForceTable


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
        one_of(self, "weakening_length", "k_hat")
        values = {
            key: getattr(self, key)
            for key in ("static", "kinetic", "slip_rate_residual", "slip_rate_decay")
        }
        if self.weakening_length is not None:
            return Friction(weakening_length=self.weakening_length, **values)
        return friction_with_k_hat(contact, k_hat=self.k_hat or 0.0, **values)


@dataclass(frozen=True, kw_only=True)
class LawSection(Parameters):
    """``[law]``: which law gives the creep force; Carter-Griffith's if left out.

    `file` lies beside the model or below its folder, or is a shipped one.
    """

    kind: str = "carter_griffith"
    adhesion_reduction: Annotated[float | None, Quantity("1", above=0.0, at_most=1.0)] = None
    slip_reduction: Annotated[float | None, Quantity("1", above=0.0, at_most=1.0)] = None
    kalker_coefficient: Annotated[float | None, Quantity("1", above=0.0)] = None
    file: str | None = None

    def check_keys(self) -> None:
        """Refuse a kind that is not known, and other keys than it takes: they would do nothing."""
        wanted = LAWS.get(self.kind)
        if wanted is None:
            raise ValueError(f"kind = {self.kind!r} must be one of: {', '.join(LAWS)}")
        given = [f.name for f in fields(self)[1:] if getattr(self, f.name) is not None]
        if given != list(wanted):
            what = f"the keys {', '.join(wanted)}" if wanted else "no other key"
            raise ValueError(f"kind = {self.kind!r} takes {what}, not {given}")

    def build(
        self,
        contact: Contact,
        friction: Friction,
        poisson_ratio: float,
        folder: Path,
        progress: Callable[[float], object],
    ) -> CreepForceTable:
        """The law's table; `folder` is where the file is that has this section."""
        shape: Shape = "elliptic" if isinstance(contact, EllipticContact) else "line"
        if self.kind == "cohesive":
            return cohesive_table(shape, friction.ratio, friction.weakening, progress)
        if self.kind == "polach":
            values = {name: getattr(self, name) for name in LAWS[self.kind]}
            return CreepForceTable.from_law(Polach(**values, poisson_ratio=poisson_ratio))
        if self.file is not None:
            with in_file(f"file {self.file}"):
                path = file_beside("file", self.file, folder, "the model")
            curve = MeasuredCurve.from_csv(path, kinetic=friction.kinetic)
            return CreepForceTable.from_law(curve)
        return carter_griffith_table(shape)


# Keys that each kind of law needs.
LAWS: dict[str, tuple[str, ...]] = {
    "carter_griffith": (),
    "cohesive": (),
    "polach": ("adhesion_reduction", "slip_reduction", "kalker_coefficient"),
    "measured": ("file",),
}
# Keys that the table of each kind is made from.
TABLE_KEYS: dict[str, tuple[str, ...]] = {
    "carter_griffith": (),
    "cohesive": ("friction.static", "friction.kinetic"),
    "polach": (*(f"law.{key}" for key in LAWS["polach"]), "contact.poisson_ratio"),
    "measured": ("friction.kinetic",),
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
        one_of(self, "saturation_creepage", "slope_reduction")
        clean = saturation_creepage(contact, friction)
        if self.saturation_creepage < clean * (1.0 - 1e-12):
            raise ValueError(
                f"saturation_creepage = {self.saturation_creepage!r} is out of range: must be >= "
                f"{clean:.6g}, that of clean surfaces"
            )
        return min(1.0, clean / self.saturation_creepage)
