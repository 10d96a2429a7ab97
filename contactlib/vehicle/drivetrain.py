"""A wheelset with motor, shaft, brake, axle, and two wheels that may differ.

The kernel has the equations of motion and their integrator (fmu/kernel/drivetrain_lanes.inc).
"""

from __future__ import annotations

import math
from dataclasses import KW_ONLY, dataclass, replace
from functools import cached_property
from typing import Annotated, Any, Literal

import numpy as np

from contactlib import kernel
from contactlib.base.quantities import Parameters, Quantity, checks_call
from contactlib.vehicle.track import Values
from contactlib.vehicle.wheelset import GEAR_RATIO, ROTOR_INERTIA, Wheelset

LAG = Quantity("s", at_least=0.0, at_most=10.0, usual=(0.0, 1.0))  # of a motor
RESPONSE = Quantity("s", above=0.0, at_most=10.0, usual=(0.01, 5.0))  # of a brake
PRESSURE = Quantity("Pa", above=0.0, usual=(1e4, 2e6))  # in a brake cylinder
BRAKING = Quantity("N.m", above=0.0, usual=(10.0, 3e5))  # torque of one axle's brake
STIFFNESS = Quantity("N.m/rad", above=0.0, usual=(1e3, 1e10))
RIM_SPEED = Quantity("m/s", at_least=0.0, usual=(0.0, 170.0))
BUILT_UP = math.log(20.0)  # time to 95 % / time constant of a first-order lag
PAD_FRICTION = Quantity("1", above=0.0, usual=(0.05, 5.0))  # friction of pads
PAD_PRESSURE = Quantity("Pa", at_least=0.0, usual=(0.0, 2e6))  # in a table
DAMPING = Quantity("N.m.s/rad", at_least=0.0, usual=(0.0, 1e7))


@dataclass(frozen=True, kw_only=True)
class Axle(Parameters):
    """Axle that twists between its two wheels.

    Parameters
    ----------
    stiffness : float
        k, torque per angle between the wheels [N.m/rad].
    damping : float, optional
        d, torque per rate of that angle [N.m.s/rad].
    drive_share : float, optional
        Fraction of the drive torque that acts on the left wheel [1]. Default: 0.5, a drive in the
        middle.
    """

    stiffness: Annotated[float, STIFFNESS]
    damping: Annotated[float, DAMPING] = 0.0
    drive_share: Annotated[float, Quantity("1", at_least=0.0, at_most=1.0)] = 0.5


@dataclass(frozen=True, kw_only=True)
class Motor(Parameters):
    """Motor, its converter and its shaft: how the drive torque follows the controller, its limits.

    The limits act at the controller's samples, on the mean angular velocity omega of the wheels,
    and the torque is held in between: first the trip, then the power, then the rate. So a torque
    that falls at the largest rate may for a while be more than the power allows.

    The wheelset's inertia J contains the rotor's, I = i^2 I_m at the gear ratio i. With
    `rotor_inertia` and `shaft_stiffness` both are two masses. The torque T, the shaft's k and d,
    its twist phi and the rotor's speed omega_m are seen from the axle:

        I domega_m/dt = T - T_s,    dphi/dt = omega_m - omega,    T_s = k phi + d dphi/dt.

    The axle, of J - I, gets T_s in place of T; on an elastic one omega is the mean of its wheels'
    that `Axle.drive_share` weighs. The limits remain those by the speed of the wheels.

    Parameters
    ----------
    lag : float, optional
        Time constant with which the drive torque follows its command [s]. Default: 0, no lag.
    power : float, optional
        Largest power P at the axle [W]: the torque is at most P/|omega|, and the demand of the
        controllers at most P r/|V|, by the vehicle's speed V. Default: no limit.
    torque_rate : float, optional
        Largest rate at which the drive changes its torque, up or down [N.m/s]. Default: no limit.
    trip_speed : float, optional
        Rim speed r |omega| at which the over-speed protection trips [m/s]: the drive then gives no
        torque until the wheels are slower and the driver's demand is zero. Default: no protection.
    rotor_inertia : float, optional
        Moment of inertia I_m of the rotor about its own shaft, which `shaft_stiffness` joins to
        the axle [kg.m2]. The wheelset's inertia contains it. Default: a rigid shaft.
    gear_ratio : float, optional
        Speed of that rotor / speed of the axle [1]. Default: 1.
    shaft_stiffness : float, optional
        k of the shaft between rotor and axle, torque at the axle per angle of the axle [N.m/rad].
    shaft_damping : float, optional
        d of that shaft, torque at the axle per rate of that angle [N.m.s/rad]. Default: 0.

    Raises
    ------
    ValueError
        If a value is out of range, or only a part of a shaft's is given.
    """

    lag: Annotated[float, LAG] = 0.0
    power: Annotated[float | None, Quantity("W", above=0.0, usual=(100.0, 1e7))] = None
    torque_rate: Annotated[float | None, Quantity("N.m/s", above=0.0, usual=(10.0, 1e8))] = None
    trip_speed: Annotated[float | None, Quantity("m/s", above=0.0, usual=(0.5, 300.0))] = None
    rotor_inertia: Annotated[float | None, ROTOR_INERTIA] = None
    gear_ratio: Annotated[float, GEAR_RATIO] = 1.0
    shaft_stiffness: Annotated[float | None, STIFFNESS] = None
    shaft_damping: Annotated[float, DAMPING] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        kind = type(self)
        shaft = ("rotor_inertia", "gear_ratio", "shaft_stiffness", "shaft_damping")
        given = [name for name in shaft if getattr(self, name) != getattr(kind, name)]
        if given and (self.rotor_inertia is None or self.shaft_stiffness is None):
            raise ValueError(
                f"{given[0]} = {getattr(self, given[0])!r} is for a rotor on an elastic shaft, "
                "which needs both rotor_inertia and shaft_stiffness; a rigid one needs neither"
            )

    @property
    def inertia_at_axle(self) -> float:
        """i^2 I_m of the rotor on its shaft [kg.m2]; 0 if the shaft is rigid."""
        return 0.0 if self.rotor_inertia is None else self.gear_ratio**2 * self.rotor_inertia


@dataclass(frozen=True, kw_only=True)
class Brake(Parameters):
    """Friction brake of the axle, such as a pneumatic one with its dump valve.

    Negative torque goes to the brake and positive torque to the motor, whose limits do not apply to
    the brake. Each wheel has half of the brake torque, which, in proportion to the pressure in
    the brake cylinder, follows its command after a dead time by a first-order lag. It acts against
    the rotation of either wheel, whatever its direction.

    The pads of a wheel that stands hold it with the torque that it takes, up to the brake's. They
    give by up to 0.1 mm at the rim before they slide, and their holders damp them, so a vehicle
    that stops swings back once, by about a millimetre per second; both are chosen. With d the part
    of that way, which is 1 where the pads slide forward, the torque on the wheel is

        T (d + (1 - d**2)/2 u/u_0),    dd/dt = (u - |u| d)/(0.1 mm),

    by the rim's speed u, with u/u_0 between -1 and 1 and u_0 = 5 mm/s. Contacts with memory stick
    too, so a braked vehicle holds on a grade. Without memory they creep: runs warn of that.

    Demanded and commanded torques, `torque` and T are those at the pads' nominal friction. The
    pads' friction over the nominal one, by the rim speed r |omega| and the pressure, multiplies T
    at either wheel. Its lists are the columns of a table with one row for each pair of a speed and
    a pressure, in any order; it is bilinear between these, and constant beyond.

    Parameters
    ----------
    fill_time : float
        Time constant with which the brake torque rises to its command: the filling time, to 95 %,
        is three times as long [s].
    vent_time : float
        Time constant with which the brake torque falls to its command, likewise [s].
    delay : float, optional
        Dead time from the command to the change of the torque, rounded to whole samples [s].
        Default: 0.
    pressure : float, optional
        Pressure in the brake cylinder at which the axle's brake has `torque` [Pa]. With both, runs
        have the signal `cylinder_pressure`, and a demand may be a pressure. Default: not known.
    torque : float, optional
        Torque of the axle's brake at `pressure` and nominal friction of its pads [N.m].
    pad_speed : tuple of float, optional
        Rim speeds in the table of the pads' friction, which are the vehicle's while wheels roll:
        sliding speeds on a disc times the wheel's radius over the disc's [m/s]. Default: any.
    pad_pressure : tuple of float, optional
        Pressures in the brake cylinder in that table, for which `pressure` and `torque` are needed
        [Pa]. Default: any.
    pad_friction : tuple of float, optional
        Friction of the pads over the nominal one in that table [1]. Default: 1.
    pad_scale : float, optional
        Factor on the pads' friction, such as that of wet discs; 1 / nominal friction if
        `pad_friction` is a coefficient [1].

    Raises
    ------
    ValueError
        If a value is out of range, one of pressure and torque is given without the other, or the
        lists of the pads are no table.
    """

    fill_time: Annotated[float, RESPONSE]
    vent_time: Annotated[float, RESPONSE]
    delay: Annotated[float, LAG] = 0.0
    pressure: Annotated[float | None, PRESSURE] = None
    torque: Annotated[float | None, BRAKING] = None
    pad_speed: Annotated[Values, RIM_SPEED] = ()
    pad_pressure: Annotated[Values, PAD_PRESSURE] = ()
    pad_friction: Annotated[Values, PAD_FRICTION] = ()
    pad_scale: Annotated[float, PAD_FRICTION] = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.pressure is None) != (self.torque is None):
            raise ValueError(
                f"pressure = {self.pressure!r} and torque = {self.torque!r}: give both or neither"
            )
        if self.pad_pressure and self.pressure is None:
            raise ValueError("pad_pressure needs pressure, and torque at that pressure")
        speeds, pressures, rows = self.pad_speed, self.pad_pressure, len(self.pad_friction)
        if {len(speeds), len(pressures)} - {0, rows}:
            raise ValueError(
                f"pad_friction has {rows}, pad_speed {len(speeds)} and pad_pressure "
                f"{len(pressures)} entries: lists that are given must have as many as pad_friction"
            )
        pairs = self._pad_rows
        count = math.prod(len(set(axis)) for axis in zip(*pairs, strict=True))
        if rows and not len(pairs) == rows == count:
            raise ValueError(
                f"pad_friction has {rows} entries: must have {count}, one for each pair of a "
                "pad_speed and a pad_pressure"
            )

    @property
    def _pad_rows(self) -> dict[tuple[float, float], float]:
        """Friction of the pads by speed and pressure, without their factor.

        To 12 digits, as 30 m/s and 108 km/h are one speed.
        """
        friction = self.pad_friction or (1.0,)
        lists = (axis or (0.0,) * len(friction) for axis in (self.pad_speed, self.pad_pressure))
        axes = ([float(f"{number:.12g}") for number in axis] for axis in lists)
        return dict(zip(zip(*axes, strict=True), friction, strict=True))

    @cached_property
    def pads(self) -> kernel.NativePads | None:
        """The table of the pads' friction for the kernel; None if it is always nominal."""
        pairs, friction = zip(*sorted(self._pad_rows.items()), strict=True)
        scaled = self.pad_scale * np.array(friction)
        if (scaled == 1.0).all():
            return None
        speed, pressure = (np.unique(axis) for axis in zip(*pairs, strict=True))
        torque = pressure / self.pressure_per_torque if self.pad_pressure else pressure
        return kernel.NativePads(speed, torque, scaled.reshape(speed.size, pressure.size))

    @property
    def pressure_per_torque(self) -> float:
        """Pressure in the cylinder over torque [Pa/(N.m)]; nan if it is not known."""
        return self.pressure / self.torque if self.pressure and self.torque else math.nan

    @classmethod
    @checks_call
    def from_times(
        cls,
        *,
        fill_time: Annotated[float | None, RESPONSE] = None,
        build_up_time: Annotated[float | None, replace(RESPONSE, at_most=30.0)] = None,
        vent_time: Annotated[float, RESPONSE],
        **others: Any,
    ) -> Brake:
        """Make the brake from its filling or build-up time; the others are its fields.

        Parameters
        ----------
        fill_time : float, optional
            Time constant with which the brake torque rises to its command [s].
        build_up_time : float, optional
            Time in which it rises to 95 % of its command, in place of `fill_time` [s].
        vent_time : float
            Time constant with which the brake torque falls to its command [s].

        Raises
        ------
        ValueError
            As for the class, or unless one of both times is given.

        Examples
        --------
        >>> round(Brake.from_times(build_up_time=4.0, vent_time=1.0).fill_time, 3)
        1.335
        """
        if (fill_time is None) == (build_up_time is None):
            raise ValueError(
                f"fill_time = {fill_time!r} and build_up_time = {build_up_time!r}: give one of them"
            )
        filling = fill_time or (build_up_time or 0.0) / BUILT_UP
        return cls(fill_time=filling, vent_time=vent_time, **others)


@dataclass(frozen=True, kw_only=True)
class Sanding(Parameters):
    """Sand in front of axles, which acts where it lies: under them and all axles behind.

    Its effect multiplies the track's factors, as in lists over distance. Sand is laid at the places
    of the sanded axles from one row of a run to the next, at nodes 0.1 m apart, while the size of
    the vehicle's speed is between `above` and `below`.

    Parameters
    ----------
    friction : float
        Factor on friction where sand lies [1].
    slope : float, optional
        Factor on the initial slope of the creep force there [1].
    by : str, optional
        ``"speed"`` if it is laid at all speeds between the limits, ``"controller"`` if only as far
        as the controllers command it, by a `contactlib.traction.Command`.
    below : float, optional
        Speed above which no sand is laid [m/s]. Default: none.
    above : float, optional
        Speed below which no sand is laid [m/s]. Default: 0.
    axles : tuple of float, optional
        Numbers of the axles that have sanders, from 1. Default: all.
    delay : float, optional
        Dead time from command or speed to the sand on the rail, in whole samples [s].
    rate : float, optional
        Sand that one axle lays [kg/s]. Default: 0, not known.
    """

    friction: Annotated[float, Quantity("1", above=0.0, usual=(0.5, 10.0))]
    slope: Annotated[float, Quantity("1", above=0.0, usual=(0.05, 10.0))] = 1.0
    by: Literal["speed", "controller"] = "speed"
    below: Annotated[float | None, Quantity("m/s", above=0.0, usual=(0.5, 170.0))] = None
    above: Annotated[float, Quantity("m/s", at_least=0.0, usual=(0.0, 100.0))] = 0.0
    axles: Annotated[tuple[float, ...], Quantity("1", whole=True, at_least=1, at_most=8)] = ()
    delay: Annotated[float, LAG] = 0.0
    rate: Annotated[float, Quantity("kg/s", at_least=0.0, usual=(0.0, 0.1))] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.below is not None and not self.above < self.below:
            raise ValueError(f"above = {self.above!r} must be < below = {self.below!r}")


@dataclass(frozen=True, eq=False)
class Drivetrain(Parameters):
    """Wheelset, axle, motor, brake and sand. Each wheel has half of inertia and, first, of load.

    Parameters
    ----------
    wheelset : Wheelset
        Contact of both wheels together, body, resistance.
    axle : Axle, optional
        Elastic axle. Default: a rigid one.
    motor : Motor, optional
        Lag, limits and shaft of the drive. Default: none of them.
    brake : Brake, optional
        Friction brake. Default: negative torque is the motor's, as with an electric brake.
    sanding : Sanding, optional
        Sand on the rails. Default: none.
    """

    wheelset: Wheelset
    _: KW_ONLY
    axle: Axle | None = None
    motor: Motor = Motor()
    brake: Brake | None = None
    sanding: Sanding | None = None

    @property
    def brake_lag(self) -> float:
        """Longest lag of braking behind its command [s]; the motor's, if there is no brake."""
        if self.brake is None:
            return self.motor.lag
        return self.brake.delay + max(self.brake.fill_time, self.brake.vent_time)

    def __post_init__(self) -> None:
        super().__post_init__()
        largest = self.wheelset.inertia / self.motor.gear_ratio**2
        if self.motor.rotor_inertia is not None and not self.motor.rotor_inertia < largest:
            raise ValueError(
                f"motor.rotor_inertia = {self.motor.rotor_inertia!r} is out of range: must be < "
                f"{largest:.6g}, as wheelset.inertia = {self.wheelset.inertia!r} contains it times "
                f"the square of gear_ratio = {self.motor.gear_ratio!r}"
            )

    @cached_property
    def without_rotor(self) -> Wheelset:
        """The wheelset without a rotor that has an elastic shaft."""
        if self.motor.rotor_inertia is None:
            return self.wheelset
        return replace(self.wheelset, inertia=self.wheelset.inertia - self.motor.inertia_at_axle)

    @property
    def shaft_frequency(self) -> float:
        """Undamped angular frequency of the motor against the wheels [rad/s]; rigid: infinite.

        omega_s^2 = k (1/I + 1/(J - I)), on an elastic axle with a drive in the middle too.
        """
        if self.motor.shaft_stiffness is None:
            return math.inf
        inverse = 1.0 / self.motor.inertia_at_axle + 1.0 / self.without_rotor.inertia
        return math.sqrt(self.motor.shaft_stiffness * inverse)

    @property
    def torsional_frequency(self) -> float:
        """Undamped angular frequency of the wheels against each other [rad/s]; rigid: infinite."""
        if self.axle is None:
            return math.inf
        return math.sqrt(4.0 * self.axle.stiffness / self.without_rotor.inertia)

    @property
    def torsional_damping_ratio(self) -> float:
        """D of that vibration without creep forces [1]; zero for a rigid axle.

        2 D omega_t = (2 d + b/2)/(J/2) with the wheelset's drive damping b and inertia J, without
        that of a rotor on an elastic shaft; each wheel has half of both.
        """
        if self.axle is None:
            return 0.0
        wheels = self.without_rotor
        rate = (4.0 * self.axle.damping + wheels.damping) / wheels.inertia
        return 0.5 * rate / self.torsional_frequency

    @property
    def vibrations(self) -> list[float]:
        """Those of the two frequencies that this drivetrain has [rad/s]."""
        return [f for f in (self.torsional_frequency, self.shaft_frequency) if f < math.inf]

    @cached_property
    def _parameters(self) -> tuple[dict[str, float], dict[str, float]]:
        """Parameters of the kernel's contact and drivetrain, by name, in SI units."""
        axle = self.axle
        contact = self.wheelset.element.rolling_parameters
        drivetrain = {
            "axle_stiffness": 0.0 if axle is None else axle.stiffness,
            "axle_damping": 0.0 if axle is None else axle.damping,
            "drive_share": 0.5 if axle is None else axle.drive_share,
            "motor_lag": self.motor.lag,
            "motor_inertia": self.motor.inertia_at_axle,
            "shaft_stiffness": self.motor.shaft_stiffness or 0.0,
            "shaft_damping": self.motor.shaft_damping,
            "brake_fill_time": 0.0 if self.brake is None else self.brake.fill_time,
            "brake_vent_time": 0.0 if self.brake is None else self.brake.vent_time,
            "sand_friction": self.sanding.friction if self.sanding else 1.0,
            "sand_slope": self.sanding.slope if self.sanding else 1.0,
        }
        return contact, drivetrain

    @property
    def kind(self) -> tuple[int, bool, bool, bool, bool, bool]:
        """Table and states, which drivetrains must have in common to be stepped together."""
        element = self.wheelset.element
        elastic, lagging = self.axle is not None, self.motor.lag > 0.0
        braked, shafted = self.brake is not None, self.motor.rotor_inertia is not None
        return id(element.table.native), elastic, lagging, braked, shafted, element.memory

    def member(self, track: kernel.NativeTrack | None = None) -> kernel.NativeMember:
        """Return this drivetrain on a track as a member of a `kernel.NativeFleet`."""
        contact, drivetrain = self._parameters
        body, table = self.without_rotor, self.wheelset.element.table.native
        pads = self.brake.pads if self.brake else None
        return kernel.NativeMember(table, contact, drivetrain, body.parameters, track, pads)

    @cached_property
    def native(self) -> kernel.NativeFleet:
        """The equations of motion of this drivetrain, with the inputs' friction."""
        return kernel.NativeFleet([self.member()])
