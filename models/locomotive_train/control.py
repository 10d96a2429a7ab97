"""Motors under the shipped traction controllers, one for each axle or one for each bogie."""

from __future__ import annotations

from typing import Any

import numpy as np

import contactlib as cl
from contactlib.base.quantities import FloatArray
from contactlib.runs.plant import Drives
from contactlib.traction import Measurement, stacked

from .vehicle import AXLES


class Torques:
    """The same torque of every motor over time, without control [N.m]."""

    sample_time = np.inf

    def __init__(self, torque: cl.Profile) -> None:
        self._torque, self._time = torque, 0.0

    def sample(self, time: float, omega: FloatArray, speed: float) -> None:
        """See nothing."""

    def step(self, step: float) -> FloatArray:
        """Mean torque of each axle's motor over the next step [N.m]."""
        self._time += step
        return np.full(AXLES, self._torque(self._time - 0.5 * step))


class Motors:
    """Torques of the four motors of a scenario's drive, demand, sensors and controller.

    Parameters
    ----------
    scenario : cl.Scenario
        Its drivetrain's motor, its demand, and its sensors, which differ in their noise.
    controller : str
        Name of one of the scenario's controllers.
    groups : int, optional
        4 for a controller on each axle, 2 for one on each bogie: it sees the faster axle, and both
        motors follow it. Default: 4.
    """

    def __init__(self, scenario: cl.Scenario, controller: str, *, groups: int = AXLES) -> None:
        if groups not in (2, AXLES):
            raise ValueError(f"groups = {groups!r} must be 2 or {AXLES}")
        one: Any = scenario.controller(controller)
        drivetrain = scenario.drivetrain
        self.sample_time, self._radius = float(one.sample_time), drivetrain.wheelset.radius
        self._control, self._demand = stacked([one] * groups), scenario.demand
        self._reader = scenario.sensors.reader(groups, self.sample_time, radius=self._radius)
        self._drives = Drives([drivetrain.motor] * groups, np.array(self._radius), self.sample_time)
        self._lag, self._command = drivetrain.motor.lag, np.zeros(groups)
        self._torque, self._memory = np.zeros(AXLES), None

    def sample(self, time: float, omega: FloatArray, speed: float) -> None:
        """Read the sensors and let the controllers act."""
        turning = omega.reshape(self._command.size, -1).max(axis=1)
        demand = np.full(turning.size, float(self._demand(time)))
        demand = self._drives.possible(demand, np.full(turning.size, speed))
        seen = self._reader.read(self._radius * turning, speed, demand)
        measured = Measurement(demand, *seen, self._command)
        if self._memory is None:
            self._memory = self._control.start(measured, self._command)
        requested, self._memory = self._control.sample(measured, self._memory)
        self._command = self._drives.command(requested, self._command, demand, turning)

    def step(self, step: float) -> FloatArray:
        """Mean torque of each axle's motor over the next step [N.m]."""
        command = np.repeat(self._command, AXLES // self._command.size)
        if self._lag == 0.0:
            return command
        left = -np.expm1(-step / self._lag)
        mean = command + (self._torque - command) * left * self._lag / step
        self._torque = self._torque + (command - self._torque) * left
        return np.asarray(mean)
