"""Runs of vehicles: the plant of their axles, which share speed, body and rails; and results."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from contactlib import kernel
from contactlib.base.lazy import optional_library
from contactlib.base.quantities import FloatArray, ReadOnly
from contactlib.base.units import STANDARD_GRAVITY
from contactlib.files.scenario import Scenario
from contactlib.runs.derived_columns import UNITS
from contactlib.runs.plant import Runs, Timing
from contactlib.runs.result import WORKS, Result
from contactlib.traction.interface import TractionController
from contactlib.vehicle.track import Profile, RailState
from contactlib.vehicle.vehicle import MAX_AXLES, Vehicle

if TYPE_CHECKING:
    from xarray import Dataset

SETTLING = 6  # times that the first state is found, each with the loads of the last one's forces
VEHICLE_UNITS = {**UNITS, "brake_torque": "N.m"}
TOTALS = ("creep_force", "available_force", "drive_torque", *WORKS, "stored_energy")


def axles_of(scenario: Scenario) -> list[Scenario]:
    """The scenario of each axle of a vehicle, with the part of the demand that it has."""
    vehicle = scenario.vehicle
    if vehicle is None:
        raise ValueError("scenario.vehicle = None has no axles: run_scenario runs one wheelset")
    designed = {name: scenario.any_controller(name) for name in scenario.controllers}
    return [
        replace(
            scenario,
            vehicle=None,
            demand=demand_of_axle(scenario.demand, vehicle, number),
            controllers=designed,
        )
        for number in range(1, vehicle.axles + 1)
    ]


def demand_of_axle(demand: Profile, vehicle: Vehicle, number: int) -> Profile:
    """The demand [N.m], without its traction or braking where the axle of a number has none."""
    driven = not vehicle.driven or number in vehicle.driven
    braked = not vehicle.braked or number in vehicle.braked
    low, high = 0.0 if not braked else -math.inf, 0.0 if not driven else math.inf
    if low <= min(demand.value) and max(demand.value) <= high:
        return demand
    at, value = list(demand.at), list(demand.value)
    for (t0, a), (t1, b) in pairwise(zip(demand.at, demand.value, strict=True)):
        if a * b < 0.0 and t1 > t0:  # a corner where the demand changes its sign
            at.append(t0 + (t1 - t0) * a / (a - b))
            value.append(0.0)
    order = np.argsort(at, kind="stable")
    return Profile(
        tuple(np.array(at)[order].tolist()),
        tuple(np.clip(np.array(value)[order], low, high).tolist()),
    )


class VehicleRuns(Runs):
    """Runs of vehicles of equally many axles: of all their axles side by side.

    Parameters
    ----------
    scenarios : sequence of Scenario
        One for each vehicle.
    control, timing, index, tolerance
        As for `Runs`, with the controller of all axles; the index is that of each vehicle.
    """

    units = VEHICLE_UNITS

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
        super().__init__(
            [axle for scenario in scenarios for axle in axles_of(scenario)],
            control,
            timing,
            index=[MAX_AXLES * i + axle for i in index for axle in range(self.axles)],
            tolerance=tolerance,
        )

    def _native(self) -> kernel.NativeFleet:
        tracks = (track.native for track in self.tracks)
        members = [t.member(track) for t, track in zip(self.trains, tracks, strict=True)]
        return kernel.NativeFleet(members, self.axles)

    @property
    def _loads_change(self) -> bool:
        return True

    def _begin(self, index: Sequence[int]) -> None:
        """Find the first state under the loads of its own forces."""
        grades = [train.wheelset.resistance.grade for train in self.trains]
        self._weight = STANDARD_GRAVITY * np.array(grades)
        bodies = [train.wheelset for train in self.trains]
        self._damping = np.array([body.damping for body in bodies])
        self._light = 1.0 / np.array([body.inertia for body in bodies])
        lags = np.repeat([vehicle.load_lag for vehicle in self._vehicles], self.axles)
        steps = np.divide(self._timing.step, lags, out=np.full(lags.size, np.inf), where=lags > 0.0)
        self._follow, self._halfway = -np.expm1(-steps), -np.expm1(-0.5 * steps)
        radii = self.radius[:: self.axles].tolist()
        parts = [v.statics(radius) for v, radius in zip(self._vehicles, radii, strict=True)]
        self._statics = [np.stack(part) for part in zip(*parts, strict=True)]
        self._load = self._target = 0.5 * self._statics[0].ravel()
        for _ in range(SETTLING):
            super()._begin(index)
            self._states["distance"] = np.tile(0.0, lags.size) - self._behind()
            forces = self.fleet.evaluate(self._inputs[0], self._states)
            self._load = self._target = 0.5 * self._loads_under(forces)
        distance = np.reshape(self._states["distance"], (-1, self.axles))
        cleaning = next((track for track in self.tracks if track.cleaning > 0.0), self.tracks[0])
        self._rails = RailState(cleaning, distance)  # for its works, which no friction enters

    def _behind(self) -> FloatArray:
        """Distance of each axle behind the first one of its vehicle [m]."""
        return np.concatenate([vehicle.position for vehicle in self._vehicles])

    def _loads_under(self, forces: Any) -> FloatArray:
        """Loads of the axles under the kernel's outputs [N]."""
        static, by_force, by_acceleration, by_turning = self._statics
        force = forces["creep_force_left"] + forces["creep_force_right"]
        omega = 0.5 * (self._states["omega_left"] + self._states["omega_right"])
        turning = (
            forces["drive_torque"] - self.radius * force - self._damping * omega
        ) * self._light
        rate = (forces["speed_rate"] + self._weight).reshape(static.shape).mean(axis=-1)
        load = static + by_acceleration * rate[:, np.newaxis]
        for matrices, values in ((by_force, force), (by_turning, turning)):
            load += (matrices @ values.reshape(*static.shape, 1))[..., 0]
        return np.asarray(np.maximum(load, 0.0).ravel())

    def _advance(self, place: int, row: int, step: float) -> None:
        inputs = self._inputs[place]
        change = self._target - self._load
        inputs["load_left"] = inputs["load_right"] = self._load + self._halfway * change
        super()._advance(place, row, step)
        if step > 0.0:
            self._load = self._load + self._follow * change
            self._target = 0.5 * self._loads_under(self._forces)

    def _after_step(self, inputs: Any) -> None:
        """Find the forces, and how far each wheel's rail is clean: by axles in front too."""
        self._forces = self.fleet.evaluate(inputs, self._states)
        if not self._cleaning.any():
            return
        own, distance = self._cleaning_work(self._forces), self._states["distance"]
        self._rails.slide(distance, own)
        self._clean_by(own + self._rails.work_before(distance).reshape(own.shape))


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

    def to_xarray(self) -> Dataset:
        """Convert to an `xarray.Dataset` over time and axle, whose numbers start at 1."""
        xarray = optional_library("xarray")
        numbers = xarray.Variable("axle", np.arange(1, len(self.axles) + 1))
        parts = [axle.to_xarray() for axle in self.axles]
        made: Dataset = xarray.concat(parts, dim=numbers, coords="minimal").transpose(
            "time", "axle"
        )
        return made
