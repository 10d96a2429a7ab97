"""Sections of model files (contact, friction, law, wheelset and runs) and of scenario files.

Each class declares the keys of a section with unit and limits; `build` makes the object.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Annotated, NamedTuple

from contactlib.base.quantities import Parameters, Quantity
from contactlib.contact.friction import (
    EFFUSIVITY,
    SOFTENING_TEMPERATURE,
    STEEL_EFFUSIVITY,
    Friction,
)
from contactlib.contact.hertz import THEORIES, Contact, EllipticContact, LineContact, Material
from contactlib.contact.kalker import POISSON_RATIO
from contactlib.contact.law_tables import Shape, carter_griffith_table, cohesive_table
from contactlib.contact.laws.measured import MeasuredCurve
from contactlib.contact.laws.polach import Polach
from contactlib.contact.scales import friction_with_k_hat, saturation_creepage
from contactlib.contact.table import CreepForceTable
from contactlib.files.reading import doubt, file_beside, in_file, one_of
from contactlib.vehicle.continuous_control import CreepControl, TorqueControl
from contactlib.vehicle.drivetrain import RELAXATION_LENGTH
from contactlib.vehicle.track import Profile, Track, profile_of


class LawKind(NamedTuple):
    """Kind of law: meaning, keys that it needs, keys that change its table, and optional keys."""

    meaning: str
    keys: tuple[str, ...] = ()
    table_keys: tuple[str, ...] = ()
    optional_keys: tuple[str, ...] = ()


POLACH_KEYS = ("adhesion_reduction", "slip_reduction")
LAWS = {
    "carter_griffith": LawKind("Limit of a short weakening zone. Its table is shipped."),
    "cohesive": LawKind(
        "The law without that limit. Its table is built, in some 8 s, when a file is first read.",
        table_keys=("friction.static", "friction.kinetic"),
    ),
    "polach": LawKind(
        "Polach's law of 2005, in longitudinal creepage; for an elliptic contact, which gives "
        "Kalker's coefficient.",
        keys=POLACH_KEYS,
        table_keys=tuple(f"law.{key}" for key in POLACH_KEYS),
    ),
    "measured": LawKind(
        "A curve through measured points, as it was measured at the contact's nominal load. It "
        "replaces `[friction]`, and `saturation_creepage` and `slope_reduction` in `[wheelset]`.",
        keys=("file",),
        optional_keys=("load_exponent", "columns", "creepage_unit", "load"),
    ),
}
LONGEST = 1e6  # duration of a run [s]
NORMAL_LOAD = Quantity("N", above=0.0, usual=(500.0, 1e6))
SPEED = Quantity("m/s", at_least=-500.0, at_most=500.0, usual=(-170.0, 170.0))
Values = tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class ContactSection(Parameters):
    """``[contact]``: contact of two bodies of one material under its nominal load.

    A line contact takes `semi_width` and `radius`; an elliptic contact takes either the relative
    radii or the semi-axes, in the rolling direction x and across it, and a `theory`:
    ``"half_space"`` (default) or ``"strips"``.
    """

    semi_width: Annotated[float | None, Quantity("m", above=0.0, usual=(1e-5, 0.1))] = None
    radius: Annotated[float | None, Quantity("m", above=0.0, usual=(0.005, 5.0))] = None
    radius_x: Annotated[float | None, Quantity("m", above=0.0, usual=(0.005, 5.0))] = None
    radius_y: Annotated[float | None, Quantity("m", above=0.0, usual=(0.005, 1e3))] = None
    semi_axis_x: Annotated[float | None, Quantity("m", above=0.0, usual=(1e-5, 0.1))] = None
    semi_axis_y: Annotated[float | None, Quantity("m", above=0.0, usual=(1e-5, 0.1))] = None
    normal_load: Annotated[float, NORMAL_LOAD]
    youngs_modulus: Annotated[float, Quantity("Pa", above=0.0, usual=(1e6, 1e12))]
    poisson_ratio: Annotated[float, POISSON_RATIO]
    theory: str | None = None

    def build(self) -> Contact:
        """Build the contact."""
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
        others = {key: getattr(self, key) for key in (*given, "poisson_ratio")}
        if given[0] != "semi_width":
            others["theory"] = self.theory or THEORIES[0]
        elif self.theory is not None:
            raise ValueError(f"theory = {self.theory!r} is for an ellipse, not for a line contact")
        contact = makers[given](
            normal_load=self.normal_load,
            contact_modulus=material.contact_modulus_with(material),
            **others,
        )
        if given == ("semi_axis_x", "semi_axis_y"):
            for key in ("radius_x", "radius_y"):
                radius, quantity = getattr(contact, key), self.quantities()[key]
                if quantity.usual and not quantity.is_usual(radius):
                    low, high = quantity.usual
                    doubt(
                        "contact.semi_axis_x",
                        f"contact: with the normal load of {self.normal_load:g} N and Young's "
                        f"modulus, the semi-axes are those of a relative {key} of {radius:.4g} m: "
                        f"{low:g} to {high:g} m is usual",
                    )
        return contact


@dataclass(frozen=True, kw_only=True)
class FrictionSection(Parameters):
    """``[friction]``: give one of `weakening_length` and `k_hat`."""

    static: Annotated[float, Quantity("1", above=0.0, usual=(0.005, 2.0))]
    kinetic: Annotated[float, Quantity("1", above=0.0, usual=(0.005, 2.0))]
    weakening_length: Annotated[float | None, Quantity("m", at_least=0.0, usual=(0.0, 1e-3))] = None
    k_hat: Annotated[float | None, Quantity("1", at_least=0.0, at_most=2.0)] = None
    slip_rate_residual: Annotated[float, Quantity("1", above=0.0, at_most=1.0)] = 1.0
    slip_rate_decay: Annotated[float, Quantity("s/m", at_least=0.0, usual=(0.0, 10.0))] = 0.0
    softening_temperature: Annotated[
        float,
        replace(
            SOFTENING_TEMPERATURE,
            usual=(0.0, 1480.0),
            doubtful="it is a rise above ambient, and steel melts at 1480 K above",
        ),
    ] = 0.0
    thermal_effusivity: Annotated[float, replace(EFFUSIVITY, usual=(1e3, 4e4))] = STEEL_EFFUSIVITY

    def build(self, contact: Contact) -> Friction:
        """Build the friction, with the weakening length given or from `k_hat`."""
        one_of(self, "weakening_length", "k_hat")
        lengths = ("weakening_length", "k_hat")
        values = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in lengths}
        if self.weakening_length is not None:
            return Friction(weakening_length=self.weakening_length, **values)
        return friction_with_k_hat(contact, k_hat=self.k_hat or 0.0, **values)


@dataclass(frozen=True, kw_only=True)
class LawSection(Parameters):
    """``[law]``: law of the creep force. Default: Carter and Griffith's.

    `file` lies in the folder of the model or below, or is a shipped one. The creepage axis of a
    measured curve stretches like the load to `load_exponent`. Default: as Hertz's zeta0 does.
    """

    kind: str = "carter_griffith"
    adhesion_reduction: Annotated[float | None, Quantity("1", above=0.0, at_most=1.0)] = None
    slip_reduction: Annotated[float | None, Quantity("1", above=0.0, at_most=1.0)] = None
    file: str | None = None
    load_exponent: Annotated[float | None, Quantity("1", at_least=0.0, at_most=1.0)] = None
    columns: tuple[str | int, ...] = ()
    creepage_unit: str | None = None
    load: Annotated[float | None, NORMAL_LOAD] = None

    def check_keys(self) -> None:
        """Refuse an unknown kind, and keys that the kind would ignore."""
        if self.kind not in LAWS:
            raise ValueError(f"kind = {self.kind!r} must be one of: {', '.join(LAWS)}")
        wanted, optional = LAWS[self.kind].keys, LAWS[self.kind].optional_keys
        given = [f.name for f in fields(self)[1:] if getattr(self, f.name) not in (None, ())]
        if [name for name in given if name not in optional] != list(wanted):
            what = f"the keys {', '.join((*wanted, *optional))}" if wanted else "no other key"
            raise ValueError(f"kind = {self.kind!r} takes {what}, not {given}")

    def measured(self, folder: Path) -> CreepForceTable:
        """Build the table of the measured curve; `folder` is the folder of the model file."""
        name = self.file or ""
        with in_file(f"file {name}"):
            path = file_beside("file", name, folder, "the model")
        try:
            curve = MeasuredCurve.from_csv(
                path,
                columns=self.columns or None,
                creepage_unit=self.creepage_unit,
                load=self.load,
            )
        except ValueError as error:
            place = str(error).removeprefix(f"{path}: ")
            raise ValueError(f"file = {name!r}: {place}") from None
        try:
            return CreepForceTable.from_law(curve)
        except ValueError:
            raise ValueError(
                f"file = {name!r}: the curve is too abrupt for a table: {curve.summary}"
            ) from None

    def build(
        self,
        contact: Contact,
        friction: Friction,
        progress: Callable[[float], object],
    ) -> CreepForceTable:
        """Build the table of a law that is not measured."""
        shape: Shape = "elliptic" if isinstance(contact, EllipticContact) else "line"
        if self.kind == "polach":
            if shape == "line":
                raise ValueError(
                    "kind = 'polach' is the law of an ellipse: [contact] needs "
                    "radius_x and radius_y, or semi_axis_x and semi_axis_y"
                )
            values = {key: getattr(self, key) for key in POLACH_KEYS}
            return CreepForceTable.from_law(Polach(**values))
        if self.kind == "cohesive":
            return cohesive_table(shape, friction.ratio, friction.weakening, progress)
        return carter_griffith_table(shape)


@dataclass(frozen=True, kw_only=True)
class WheelsetSection(Parameters):
    """``[wheelset]``: give at most one of `saturation_creepage` and `slope_reduction`.

    Only `radius` is needed for the creep force of a wheel; runs and analyses also need `inertia`
    and `wheels`, the number of wheels that each carry the contact's `normal_load`. `rotor_inertia`
    and `gear_ratio` go together: `inertia` is then that of the wheelset without the rotor.
    """

    radius: Annotated[float, Quantity("m", above=0.0, usual=(0.01, 2.0))]
    inertia: Annotated[float | None, Quantity("kg.m2", above=0.0, usual=(1e-4, 2e4))] = None
    rotor_inertia: Annotated[
        float | None, Quantity("kg.m2", above=0.0, at_most=1e6, usual=(1e-6, 200.0))
    ] = None
    gear_ratio: Annotated[
        float | None, Quantity("1", above=0.0, at_most=1e3, usual=(0.5, 20.0))
    ] = None
    wheels: Annotated[
        float | None, Quantity("1", at_least=1.0, at_most=1000.0, usual=(1.0, 100.0))
    ] = None
    mass: Annotated[float | None, Quantity("kg", above=0.0, usual=(200.0, 3e6))] = None
    damping: Annotated[float, Quantity("N.m.s/rad", at_least=0.0, usual=(0.0, 1e5))] = 0.0
    saturation_creepage: Annotated[
        float | None, Quantity("1", above=0.0, percent=True, usual=(1e-4, 0.3))
    ] = None
    slope_reduction: Annotated[float | None, Quantity("1", above=0.0, at_most=1.0)] = None
    minimum_speed: Annotated[float, Quantity("m/s", above=0.0, usual=(1e-4, 5.0))] = 0.1

    def whole_inertia(self) -> float | None:
        """Moment of inertia about the axle, with the rotor's at the gear ratio [kg.m2]."""
        rotor, ratio = self.rotor_inertia, self.gear_ratio
        if (rotor is None) != (ratio is None):
            given = "rotor_inertia" if ratio is None else "gear_ratio"
            raise ValueError(f"rotor_inertia and gear_ratio go together; given is {given}")
        if self.inertia is None or rotor is None or ratio is None:
            return self.inertia
        return self.inertia + ratio * ratio * rotor

    def reduction(self, contact: Contact, friction: Friction) -> float:
        """Slope reduction as given, or from the saturation creepage."""
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


@dataclass(frozen=True, kw_only=True)
class TorqueSection(Parameters):
    """``[torque_control]``: breakpoints of the drive torque."""

    time: Annotated[tuple[float, ...], Quantity("s", at_least=0.0)]
    torque: Annotated[tuple[float, ...], Quantity("N.m", usual=(-3e5, 3e5))]

    def build(self) -> TorqueControl:
        """Build the controller."""
        return TorqueControl(profile_of(self, "time", "torque"))


@dataclass(frozen=True, kw_only=True)
class CreepSection(Parameters):
    """``[creep_control]``: breakpoints of the creepage, gains and torque limits."""

    time: Annotated[tuple[float, ...], Quantity("s", at_least=0.0)]
    creepage: Annotated[
        tuple[float, ...], Quantity("1", above=-1.0, percent=True, usual=(-1.0, 1.0))
    ]
    proportional_gain: Annotated[float, Quantity("N.m", above=0.0, usual=(1.0, 1e8))]
    integral_gain: Annotated[float, Quantity("N.m/s", at_least=0.0, usual=(0.0, 1e10))]
    torque_min: Annotated[float, Quantity("N.m", usual=(-3e5, 3e5))]
    torque_max: Annotated[float, Quantity("N.m", usual=(-3e5, 3e5))]

    def build(self) -> CreepControl:
        """Build the controller."""
        return CreepControl(
            reference=profile_of(self, "time", "creepage"),
            proportional_gain=self.proportional_gain,
            integral_gain=self.integral_gain,
            torque_min=self.torque_min,
            torque_max=self.torque_max,
        )


@dataclass(frozen=True, kw_only=True)
class RunSection(Parameters):
    """``[run]``: initial state of both runs of a model."""

    initial_speed: Annotated[float, Quantity("m/s", above=0.0, usual=(0.0, 170.0))] = 10.0


@dataclass(frozen=True, kw_only=True)
class RelaxationSection(Parameters):
    """``[contact_relaxation]``: distance over which the creep force follows the creepage."""

    length: Annotated[float, RELAXATION_LENGTH] = 0.0


@dataclass(frozen=True, kw_only=True)
class ScenarioRunSection(Parameters):
    """``[run]``: speeds and duration of a scenario.

    `initial_speed` is omitted if the speed is held. Controllers are designed at `design_speed`;
    default: the initial speed.
    """

    duration: Annotated[float, Quantity("s", above=0.0, at_most=LONGEST)]
    initial_speed: Annotated[float | None, SPEED] = None
    design_speed: Annotated[float | None, SPEED] = None


@dataclass(frozen=True, kw_only=True)
class DemandSection(Parameters):
    """``[demand]``: breakpoints of the driver's torque demand."""

    time: Annotated[Values, Quantity("s", at_least=0.0)]
    torque: Annotated[Values, Quantity("N.m", usual=(-3e5, 3e5))]

    def build(self) -> Profile:
        """Build the demand over time."""
        return profile_of(self, "time", "torque")


@dataclass(frozen=True, kw_only=True)
class HeldSpeedSection(Parameters):
    """``[held_speed]``: breakpoints of the speed that a roller rig holds."""

    time: Annotated[Values, Quantity("s", at_least=0.0)]
    speed: Annotated[Values, SPEED]

    def build(self) -> Profile:
        """Build the speed over time."""
        return profile_of(self, "time", "speed")


@dataclass(frozen=True, kw_only=True)
class TrackSection(Parameters):
    """``[track]``: factors on friction by distance and time, and on the creep force's slope."""

    distance: Annotated[Values, Quantity("m")] = ()
    friction: Annotated[Values, Quantity("1", above=0.0, usual=(0.01, 10.0))] = ()
    friction_left: Annotated[Values, Quantity("1", above=0.0, usual=(0.01, 10.0))] = ()
    friction_right: Annotated[Values, Quantity("1", above=0.0, usual=(0.01, 10.0))] = ()
    time: Annotated[Values, Quantity("s", at_least=0.0)] = ()
    friction_over_time: Annotated[Values, Quantity("1", above=0.0, usual=(0.01, 10.0))] = ()
    slope: Annotated[Values, Quantity("1", above=0.0, usual=(0.02, 10.0))] = ()

    def build(self) -> Track:
        """Build the track."""
        allowed: dict[tuple[str, ...], dict[str, str]] = {
            (): {},
            ("friction",): {"friction_left": "friction"},
            ("friction_left", "friction_right"): {
                "friction_left": "friction_left",
                "friction_right": "friction_right",
            },
        }
        friction = self._given("friction", "friction_left", "friction_right")
        if friction not in allowed or bool(self.distance) != bool(friction or self.slope):
            over_distance = *self._given("distance"), *friction, *self._given("slope")
            raise ValueError(
                "distance goes with slope, friction, or friction_left and friction_right; "
                f"given are {' and '.join(over_distance)}"
            )
        over_time = self._given("time", "friction_over_time")
        if len(over_time) == 1:
            raise ValueError(f"time and friction_over_time go together; given is {over_time[0]}")
        names = allowed[friction] | ({"slope": "slope"} if self.slope else {})
        factors = {name: profile_of(self, "distance", key) for name, key in names.items()}
        if over_time:
            factors["friction_over_time"] = profile_of(self, *over_time)
        return Track(**factors)

    def _given(self, *keys: str) -> tuple[str, ...]:
        return tuple(key for key in keys if getattr(self, key))
