"""A wheelset with what moves it: motor, axle, and two wheels that may differ.

The equations of motion and their integrator are the kernel's (fmu/drivetrain.c).
"""

from __future__ import annotations

import math
from dataclasses import KW_ONLY, dataclass
from functools import cached_property
from typing import Annotated

from contactlib import kernel
from contactlib.parameters import Parameters, Quantity
from contactlib.wheelset import Wheelset

LARGEST_LAG = 10.0  # of a motor [s]


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
        Part of the drive torque that acts on the left wheel [1]; half if the drive sits in the
        middle.
    """

    stiffness: Annotated[float, Quantity("N.m/rad", above=0.0)]
    damping: Annotated[float, Quantity("N.m.s/rad", at_least=0.0)] = 0.0
    drive_share: Annotated[float, Quantity("1", at_least=0.0, at_most=1.0)] = 0.5


@dataclass(frozen=True, eq=False)
class Drivetrain(Parameters):
    """Wheelset, axle and motor. Each wheel has half of the inertia and, at first, of the load.

    Parameters
    ----------
    wheelset : Wheelset
        Contact of both wheels together, body, resistance.
    axle : Axle, optional
        Elastic axle; a rigid one if left out.
    motor_lag : float, optional
        Time constant with which the drive torque follows its command [s]; none if zero.
    relaxation_length : float, optional
        Way over which the creep force follows the creepage [m]; none if zero.
    """

    wheelset: Wheelset
    _: KW_ONLY
    axle: Axle | None = None
    motor_lag: Annotated[float, Quantity("s", at_least=0.0, at_most=LARGEST_LAG)] = 0.0
    relaxation_length: Annotated[float, Quantity("m", at_least=0.0)] = 0.0

    @property
    def torsional_frequency(self) -> float:
        """Angular frequency of the wheels against each other, undamped [rad/s]; rigid: infinite."""
        if self.axle is None:
            return math.inf
        return math.sqrt(4.0 * self.axle.stiffness / self.wheelset.inertia)

    @property
    def torsional_damping_ratio(self) -> float:
        """D of that vibration without creep forces [1]; zero for a rigid axle.

        2 D omega_t = (2 d + b/2)/(J/2) with the wheelset's drive damping b and inertia J, half of
        either on each wheel.
        """
        if self.axle is None:
            return 0.0
        rate = (4.0 * self.axle.damping + self.wheelset.damping) / self.wheelset.inertia
        return 0.5 * rate / self.torsional_frequency

    @cached_property
    def _parameters(self) -> tuple[dict[str, float], dict[str, float]]:
        """Parameters of the kernel's contact and drivetrain, by name, in SI units."""
        axle = self.axle
        contact = {
            **self.wheelset.element.parameters,
            "relaxation_length": self.relaxation_length,
        }
        drivetrain = {
            "axle_stiffness": 0.0 if axle is None else axle.stiffness,
            "axle_damping": 0.0 if axle is None else axle.damping,
            "drive_share": 0.5 if axle is None else axle.drive_share,
            "motor_lag": self.motor_lag,
        }
        return contact, drivetrain

    @property
    def kind(self) -> tuple[int, bool, bool, bool]:
        """What drivetrains must have in common to be stepped side by side: table and states."""
        table = self.wheelset.element.table.native
        return id(table), self.axle is not None, self.motor_lag > 0.0, self.relaxation_length > 0.0

    def member(self, track: kernel.NativeTrack | None = None) -> kernel.NativeMember:
        """Return it as one of a `contactlib.kernel.NativeFleet`, on a track."""
        contact, drivetrain = self._parameters
        wheelset = self.wheelset
        table = wheelset.element.table.native
        return kernel.NativeMember(table, contact, drivetrain, wheelset.parameters, track)

    @cached_property
    def native(self) -> kernel.NativeFleet:
        """The equations of motion of this one, under the friction that the inputs say."""
        return kernel.NativeFleet([self.member()])
