"""Runs of vehicles: the plant of their axles, which share speed, body and rails; and results."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from contactlib import kernel
from contactlib.base.elementwise import Numbers
from contactlib.base.lazy import optional_library
from contactlib.base.quantities import FloatArray, ReadOnly
from contactlib.base.units import STANDARD_GRAVITY
from contactlib.files.scenario import Scenario
from contactlib.runs.plant import Runs, Timing
from contactlib.runs.result import Result
from contactlib.runs.signals import OF_VEHICLES, SIGNALS, WORKS, units
from contactlib.traction.interface import Measurement, TractionController
from contactlib.vehicle.track import RailState
from contactlib.vehicle.vehicle import MAX_AXLES, Vehicle

if TYPE_CHECKING:
    from xarray import Dataset

SETTLING = 6  # times that the first state is found, each with the loads of the last one's forces
VEHICLE_UNITS = units(SIGNALS, OF_VEHICLES)
SHARED = ("speed", "acceleration")  # signals that all axles have in common
TOTALS = (
    "creep_force",
    "available_force",
    "drive_torque",
    *WORKS,
    "stored_energy",
    "energy_defect",
)


def axles_of(scenario: Scenario) -> list[Scenario]:
    """The scenario of each axle of a vehicle, as a wheelset that is driven and braked."""
    vehicle = scenario.vehicle
    if vehicle is None:
        raise ValueError("scenario.vehicle = None has no axles: run_scenario runs one wheelset")
    designed = {name: scenario.any_controller(name) for name in scenario.controllers}
    return [replace(scenario, vehicle=None, controllers=designed)] * vehicle.axles


class VehicleRuns(Runs):
    """Runs of vehicles of equally many axles: of all their axles side by side.

    Parameters
    ----------
    scenarios : sequence of Scenario
        One for each vehicle.
    control, timing, index, tolerance
        As for `Runs`, with the controller of all axles; the index is that of each vehicle.
    """

    _units = VEHICLE_UNITS

    def __init__(
        self,
        scenarios: Sequence[Scenario],
        control: TractionController,
        timing: Timing,
        *,
        index: Sequence[int],
        tolerance: float,
    ) -> None:
        self._vehicles = [scenario.vehicle for scenario in scenarios if scenario.vehicle]
        self.axles = self._vehicles[0].axles
        self._behind = np.concatenate([vehicle.position for vehicle in self._vehicles])
        self._numbers = np.tile(np.arange(1, self.axles + 1), len(self._vehicles))
        self._with_brake = np.repeat(
            [scenario.drivetrain.brake is not None for scenario in scenarios], self.axles
        )
        lists = [(one.driven, one.braked) for one in self._vehicles]
        self._driven, self._braked = (  # factors on demands of traction and of braking
            np.concatenate([np.isin(numbers, some) if some else numbers > 0 for some in given])
            for numbers in [self._numbers[: self.axles]]
            for given in zip(*lists, strict=True)
        )
        super().__init__(
            [axle for scenario in scenarios for axle in axles_of(scenario)],
            control,
            timing,
            index=[MAX_AXLES * i + axle for i in index for axle in range(self.axles)],
            tolerance=tolerance,
        )

    def _measured(self, demand: FloatArray) -> Measurement[Any]:
        """Read the sensors; a trial axle has no demand, and each axle's controller sees all."""
        seen = super()._measured(demand)
        self._measured_speed = seen.vehicle_speed
        speeds = np.repeat(seen.wheel_speed.reshape(-1, self.axles), self.axles, axis=0)
        return seen._replace(
            demand=np.where(self._reader.free, 0.0, seen.demand),
            wheel_speeds=tuple(speeds.T),
            axle=self._numbers,
        )

    def _possible(self, demand: FloatArray, speed: FloatArray) -> Numbers:
        """The demand, but only of traction or braking where an axle has but one of both."""
        brakes = np.where(self._with_brake, demand < 0.0, demand * speed < 0.0)
        return super()._possible(demand * np.where(brakes, self._braked, self._driven), speed)

    def _native(self) -> kernel.NativeFleet:
        tracks = (track.native for track in self.tracks)
        members = [t.member(track) for t, track in zip(self.trains, tracks, strict=True)]
        return kernel.NativeFleet(members, self.axles)

    @property
    def _loads_change(self) -> bool:
        return True

    def _begin(self, index: Sequence[int]) -> None:
        """Find the first state under the loads of its own forces."""
        self.measured_speed = np.zeros(self._inputs.shape)
        self._measured_speed = self.measured_speed[0]
        lags = np.repeat([vehicle.load_lag for vehicle in self._vehicles], self.axles)
        steps = np.divide(self._timing.step, lags, out=np.full(lags.size, np.inf), where=lags > 0.0)
        self._follow, self._halfway = -np.expm1(-steps), -np.expm1(-0.5 * steps)
        self._at_rest, self._by_terms = self._statics()
        self._load = self._target = self._before = self._at_rest.ravel()
        for _ in range(SETTLING):
            super()._begin(index)
            self._find_forces(0)
            self._load = self._target = self._before = self._half_loads(0)
        distance = np.reshape(self._states["distance"], (-1, self.axles))
        cleaning = next((track for track in self.tracks if track.cleaning > 0.0), self.tracks[0])
        self._rails = RailState(cleaning, distance)  # for its works, which no friction enters

    def _connect(self) -> None:
        super()._connect()
        forces, by_axle = self._forces, (-1, self.axles)
        self._terms = np.empty((forces.size // self.axles, 5, self.axles))
        names = "drive_torque", "creep_force_left", "creep_force_right", "speed_rate"
        self._found = [forces[name].reshape(by_axle) for name in names]
        self._turns = [self._states[f"omega_{side}"].reshape(by_axle) for side in ("left", "right")]

    def _statics(self) -> tuple[FloatArray, FloatArray]:
        """Half of the loads at rest [N], and their derivatives by the terms of `_half_loads`.

        Shapes (vehicles, axles) and (vehicles, axles, 5 axles).
        """
        static, derivatives = [], []
        for vehicle, train in zip(self._vehicles, self.trains[:: self.axles], strict=True):
            body = train.wheelset
            at_rest, by_force, by_acceleration, by_turning = vehicle.statics(body.radius)
            by_torque = by_turning / body.inertia  # d omega/dt = (T - r Q - damping omega)/I
            mean = np.repeat(by_acceleration[:, np.newaxis] / self.axles, self.axles, axis=1)
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

    def _advance(self, place: int, row: int, step: float) -> None:
        inputs = self._inputs[place]
        self.measured_speed[place] = self._measured_speed
        change = 1.5 * self._target - 0.5 * self._before - self._load
        inputs["load_left"] = inputs["load_right"] = self._load + self._halfway * change
        super()._advance(place, row, step)
        if step > 0.0:
            self._load = self._load + self._follow * change
            self._before, self._target = self._target, self._half_loads(place)

    def _after_step(self, place: int) -> None:
        """Find the forces, and how far each wheel's rail is clean: by other axles too."""
        self._find_forces(place)
        if not self._cleaning.any():
            return
        own = self._cleaning_work()
        others = self._rails.slide(self._states["distance"], own)
        self._clean_by(own + others.reshape(own.shape))


@dataclass(frozen=True, eq=False)
class VehicleResult:
    """Time series of a run of a vehicle.

    Attributes
    ----------
    axles : tuple of Result
        Signals of each axle, the first one at the front.
    vehicle : Vehicle
        The vehicle.
    """

    axles: tuple[Result, ...]
    vehicle: Vehicle

    @property
    def time(self) -> FloatArray:
        """Times of the rows [s]."""
        return self.axles[0].time

    @property
    def units(self) -> Mapping[str, str]:
        """Units of the signals."""
        return self.axles[0].units

    def __getitem__(self, name: str) -> FloatArray:
        """A signal of all axles, shape (rows, n)."""
        return np.stack([axle[name] for axle in self.axles], axis=-1)

    def total(self, name: str) -> FloatArray:
        """Sum of a force, torque, work or energy over the axles."""
        if name not in TOTALS:
            raise KeyError(f"no total of {name!r}: there are {', '.join(TOTALS)}")
        return np.asarray(self[name].sum(axis=-1))

    @property
    def totals(self) -> Mapping[str, FloatArray]:
        """All totals, and the speed, by name."""
        sums = {name: self.total(name) for name in TOTALS if name in self.units}
        return ReadOnly({"speed": self.axles[0]["speed"], **sums})

    def to_csv(self, path: str | os.PathLike[str]) -> Path:
        """Write all signals as `Result.to_csv` does, a column for each axle: `creep_force_1 [N]`.

        Speed and acceleration are the vehicle's and have one column.
        """
        signals = {name: self.axles[0][name] for name in SHARED}
        units = {name: self.units[name] for name in SHARED}
        for name, unit in self.units.items():
            if name not in SHARED:
                named = {f"{name}_{i}": axle[name] for i, axle in enumerate(self.axles, start=1)}
                signals, units = signals | named, units | dict.fromkeys(named, unit)
        return Result(self.time, signals, units).to_csv(path)

    def to_xarray(self) -> Dataset:
        """Convert to an `xarray.Dataset` over time and axle, whose numbers start at 1."""
        xarray = optional_library("xarray")
        numbers = xarray.Variable("axle", np.arange(1, len(self.axles) + 1))
        parts = [axle.to_xarray() for axle in self.axles]
        made: Dataset = xarray.concat(parts, dim=numbers, coords="minimal").transpose(
            "time", "axle"
        )
        return made
