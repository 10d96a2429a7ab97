"""Loads of the axles of vehicles by statics, with their lag, and the rails that the axles clean."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from contactlib.base.quantities import FloatArray
from contactlib.base.units import STANDARD_GRAVITY
from contactlib.files.scenario import Scenario
from contactlib.vehicle.track import RailState
from contactlib.vehicle.vehicle import Vehicle
from contactlib.vehicle.wheelset import Wheelset


class AxleLoads:
    """Loads of the axles of vehicles of equally many axles, from one step to the next.

    Parameters
    ----------
    scenarios : sequence of Scenario
        One for each vehicle.
    step : float
        Time between rows [s].
    """

    def __init__(self, scenarios: Sequence[Scenario], step: float) -> None:
        self._positions = [scenario.position for scenario in scenarios]
        self._axles = scenarios[0].axles
        vehicles = [scenario.vehicle for scenario in scenarios if scenario.vehicle]
        bodies = [scenario.drivetrain.wheelset for scenario in scenarios]
        self._at_rest, self._by_terms = self._statics(vehicles, bodies)
        lags = np.repeat([vehicle.load_lag for vehicle in vehicles], self._axles)
        steps = np.divide(step, lags, out=np.full(lags.size, np.inf), where=lags > 0.0)
        self._follow, self._halfway = -np.expm1(-steps), -np.expm1(-0.5 * steps)
        # For its works, which no friction enters.
        tracks = [scenario.rails for scenario in scenarios]
        self._cleaning = next((track for track in tracks if track.cleaning > 0.0), tracks[0])

    def connect(self, inputs: Any, states: Any, forces: Any) -> None:
        """Use these records of the kernel: inputs of shape (rows, n), states and outputs (n,)."""
        self._inputs, self._states, by_axle = inputs, states, (-1, self._axles)
        self._terms = np.empty((len(self._positions), 5, self._axles))
        names = "drive_torque", "creep_force_left", "creep_force_right", "speed_rate"
        self._found = [forces[name].reshape(by_axle) for name in names]
        self._turns = [states[f"omega_{side}"].reshape(by_axle) for side in ("left", "right")]

    def begin(self, *, at_rest: bool) -> None:
        """Begin on rails as they are, with the loads at rest or those under the present forces."""
        half = self._at_rest.ravel() if at_rest else self._half_loads(0)
        self._load = self._target = self._before = half
        self._rails = RailState(self._cleaning, -np.array(self._positions))

    def before_step(self, place: int) -> None:
        """Set the loads of the inputs at a place."""
        inputs = self._inputs[place]
        self._change = 1.5 * self._target - 0.5 * self._before - self._load
        inputs["load_left"] = inputs["load_right"] = self._load + self._halfway * self._change

    def after_step(self, place: int, work: FloatArray | None) -> None:
        """Find the next loads, and add what other axles have left to the slip work of each.

        Parameters
        ----------
        place : int
            That of the step's inputs.
        work : ndarray, optional
            Slip work per length of either wheel, shape (n, 2) [J/m]. Default: no rail is cleaned.
        """
        if work is not None:
            work += self._rails.slide(self._states["distance"], work).reshape(work.shape)
        self._load = self._load + self._follow * self._change
        self._before, self._target = self._target, self._half_loads(place)

    def _statics(
        self, vehicles: Sequence[Vehicle], bodies: Sequence[Wheelset]
    ) -> tuple[FloatArray, FloatArray]:
        """Half of the loads at rest [N], and their derivatives by the terms of `_half_loads`.

        Shapes (vehicles, axles) and (vehicles, axles, 5 axles).
        """
        static, derivatives = [], []
        for vehicle, body in zip(vehicles, bodies, strict=True):
            at_rest, by_force, by_acceleration, by_turning = vehicle.statics(body.radius)
            by_torque = by_turning / body.inertia  # d omega/dt = (T - r Q - damping omega)/I
            mean = np.repeat(by_acceleration[:, np.newaxis] / self._axles, self._axles, axis=1)
            by_grade = STANDARD_GRAVITY * mean
            by_omegas = -0.5 * body.damping * by_torque  # their mean counts
            parts = by_torque, by_force - body.radius * by_torque, by_omegas, mean, by_grade
            static.append(0.5 * (at_rest + by_grade.sum(axis=1) * body.resistance.grade))
            derivatives.append(0.5 * np.hstack(parts))
        return np.stack(static), np.stack(derivatives)

    def _half_loads(self, place: int) -> FloatArray:
        """Half of the loads of the axles under the present forces, by statics [N]."""
        terms, (torque, left, right, rate) = self._terms, self._found
        omega_left, omega_right = self._turns
        terms[:, 0] = torque
        np.add(left, right, out=terms[:, 1])
        np.add(omega_left, omega_right, out=terms[:, 2])
        terms[:, 3] = rate
        terms[:, 4] = self._inputs["grade"][place].reshape(rate.shape)
        changes = self._by_terms @ terms.reshape(len(terms), -1, 1)
        return np.asarray(np.maximum(self._at_rest + changes[..., 0], 0.0).ravel())
