"""The plant: vehicles on their tracks, with drives and sensors, and runs of it under a controller.

At every sample the controller reads the sensors; its torque, within the drive's limits, is held
until the next. The kernel steps every axle from row to row, with the friction of its track and the
load of the row.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from functools import cached_property
from itertools import compress
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contactlib import kernel
from contactlib.base.elementwise import Numbers, maximum, minimum, where
from contactlib.base.quantities import (
    MAX_ROWS,
    POSITIVE,
    FloatArray,
    Limits,
    Parameters,
    Quantity,
    checked,
    checked_number,
    checked_whole,
    shown,
)
from contactlib.base.text import USERS_ERRORS, explained, no_signal
from contactlib.element.force_element import REFERENCE_SPEED, creepage_limits
from contactlib.files.scenario import Scenario
from contactlib.runs.initial_state import start
from contactlib.runs.line import Line, grouped
from contactlib.runs.sand import NO_SANDER, Delayed, Sanders
from contactlib.runs.signals import (
    OF_BRAKES,
    OF_PADS,
    OF_SAND,
    OF_SHAFTS,
    OF_TRACKS,
    SHARED,
    UNITS,
    Block,
    checked_signals,
    of_contacts,
    units,
)
from contactlib.traction import Measurement, SensorReader, TractionController
from contactlib.traction.batching import Copies
from contactlib.traction.interface import STRONGEST, Command
from contactlib.traction.sensors import INDEX
from contactlib.vehicle.available_force import AvailableForce
from contactlib.vehicle.drivetrain import Motor
from contactlib.vehicle.dynamic_load import DynamicLoad
from contactlib.vehicle.track import Profile
from contactlib.vehicle.vehicle import MAX_AXLES

LONGEST_STEP = 5e-3  # default limit of the time between rows [s]
FRACTIONS = 50  # of a sample time that are tried for a step that is common to controllers
BLOCK = 16_384  # rows times runs in a block
AHEAD = 256  # rows whose profiles are evaluated at once
SAMPLE_TIME = Limits(at_least=1e-6, at_most=1e3)  # [s]
TORQUE = Limits(at_least=-STRONGEST, at_most=STRONGEST)
PART = Limits(at_least=0.0, at_most=1.0)
FADING = 1.0  # below a speed limit, over which traction falls to zero [m/s]
STANDING = 1e-200  # speed [m/s] or angular velocity [rad/s] at which power limits no torque
FREE = Profile.of(0.0)  # placeholder for the held speed of a free wheelset
STATIC = Profile.of(1.0)  # factor on the load
TOLERANCE = Quantity("1", at_least=1e-12, at_most=1e-2)


class ManyProfiles:
    """A profile or load over time for each wheelset; equal ones are evaluated once.

    Parameters
    ----------
    profiles : sequence of Profile or DynamicLoad
        One for each wheelset.
    """

    def __init__(self, profiles: Sequence[Profile | DynamicLoad]) -> None:
        self._steady = np.zeros(len(profiles))
        self._moving = []
        for profile, places in grouped(profiles):
            if isinstance(profile, Profile) and len(set(profile.value)) == 1:
                self._steady[places] = profile.value[0]
            else:
                self._moving.append((profile, places))

    def __call__(self, times: FloatArray) -> FloatArray:
        """Values at times [s], shape (times, n)."""
        values = np.empty((times.size, self._steady.size))
        values[:] = self._steady
        for profile, places in self._moving:
            values[:, places] = profile(times)[:, np.newaxis]
        return values


class Drives:
    """Limits of the drives of n wheelsets, which act at the controller's samples.

    Parameters
    ----------
    motors : sequence of Motor
        Motor of each wheelset.
    radius : ndarray
        Rolling radii [m].
    sample_time : float
        Sample time [s].
    braked : sequence of bool, optional
        Wheelsets whose negative torque is that of a brake, which has no limits.
    """

    def __init__(
        self,
        motors: Sequence[Motor],
        radius: FloatArray,
        sample_time: float,
        braked: Sequence[bool] = (),
    ) -> None:
        limits = [(motor.power, motor.torque_rate, motor.trip_speed) for motor in motors]
        numbers = [[math.inf if limit is None else limit for limit in row] for row in limits]
        self._limited = bool(np.isfinite(numbers).any())
        single = len(motors) == 1
        power, rate, trip = numbers[0] if single else np.array(numbers).T
        self._power, self._trip, self._change = power, trip, rate * sample_time
        self._radius = float(radius[0]) if single else radius
        self._tripped: Numbers = False if single else np.zeros(len(motors), dtype=np.bool_)
        self._braked: Numbers = bool(braked[0]) if single and braked else np.array(braked)
        self._has_brakes = any(braked)

    def possible(self, demand: Numbers, speed: Numbers, limit: Numbers | None = None) -> Numbers:
        """Part of the demand [N.m] that power and limit allow at the vehicle's speed [m/s]."""
        limited = demand
        if self._limited:
            limited = _within(demand, self._power * self._radius / maximum(abs(speed), STANDING))
        if limit is not None:
            share = minimum(maximum((limit - abs(speed)) / FADING, 0.0), 1.0)
            limited = where(demand * speed < 0.0, limited, share * limited)
        return self._or_braking(demand, limited)

    def command(
        self, requested: Numbers, last: Numbers, demand: Numbers, omega: Numbers
    ) -> Numbers:
        """Torque that the drive is commanded until the next sample [N.m].

        Parameters
        ----------
        requested, last : ndarray or float
            Torque that the controller requests now, and the one commanded at the last sample [N.m].
        demand : ndarray or float
            The driver's demand [N.m].
        omega : ndarray or float
            Mean angular velocity of the wheels [rad/s].
        """
        if not self._limited:
            return requested + 0.0 * demand
        over = self._radius * abs(omega) >= self._trip
        self._tripped = over | (self._tripped & (demand != 0.0))
        if self._has_brakes:
            last = where(self._braked, maximum(last, 0.0), last)
        held = where(self._tripped, 0.0, requested)
        torque = _within(held, self._power / maximum(abs(omega), STANDING))
        limited = minimum(maximum(torque, last - self._change), last + self._change)
        return self._or_braking(requested, limited)

    def turn(self, demand: Numbers, speed: Numbers) -> Numbers:
        """-1 where the demand of a brake acts forward, against the motion, else 1."""
        if not self._has_brakes:
            return 1.0
        return where(self._braked & (demand < 0.0) & (speed < 0.0), -1.0, 1.0)

    def _or_braking(self, torque: Numbers, limited: Numbers) -> Numbers:
        """Limited torque of a motor, or the whole torque of a brake."""
        if not self._has_brakes:
            return limited
        return where(self._braked & (torque < 0.0), torque, limited)


def follows(scenario: Scenario) -> bool:
    """Whether loads or rails depend on the motion, so that they change within a row."""
    rails = scenario.rails
    return scenario.axles > 1 or rails.cleaning > 0.0 or rails.peaks is not None


def _native_vehicles(scenarios: Sequence[Scenario]) -> kernel.NativeVehicles | None:
    """What the kernel needs of vehicles; None of wheelsets whose rails are given."""
    axles = scenarios[0].axles
    if not any(map(follows, scenarios)):
        return None
    given = [
        kernel.NativeVehicle(
            vars(one.vehicle) if axles > 1 else None, one.rails.cleaning, one.rails.recovered
        )
        for one in scenarios
    ]
    return kernel.NativeVehicles(given, axles)


def _numbers(values: FloatArray) -> Numbers:
    """The number of one wheelset, or the array of many."""
    return values.item() if values.size == 1 else values


def _within(torque: Numbers, limit: Numbers) -> Numbers:
    return minimum(maximum(torque, -limit), limit)


class Timing(NamedTuple):
    """Rows and samples of a run.

    Attributes
    ----------
    step : float
        Time between rows [s].
    per_sample : int
        Rows from one sample of the controller to the next.
    rows : int
        Number of rows, to the last whole step of the duration.
    """

    step: float
    per_sample: int
    rows: int

    def times(self, first: int, count: int) -> FloatArray:
        """Times of rows [s]."""
        return self.step * np.arange(first, first + count, dtype=np.float64)


def default_step(scenario: Scenario, longest: float = LONGEST_STEP) -> float:
    """Longest time between rows if none is given [s].

    It is `longest`, or less: a twentieth of the period in which an elastic axle and a shaft swing,
    a tenth of the shortest period in the dynamic load.
    """
    load, vibrations = scenario.dynamic_load, scenario.drivetrain.vibrations
    if load is not None and load.highest_frequency > 0.0:
        longest = min(longest, 0.1 / load.highest_frequency)
    if vibrations:  # coupled ones are about this fast
        longest = min(longest, 2.0 * math.pi / math.hypot(*vibrations) / 20.0)
    return longest


def common_step(longest: float, times: Sequence[float]) -> float:
    """Time between rows that is the same under controllers of these sample times [s].

    At most `longest`, it is a whole fraction of every sample time, or of the shortest if
    `FRACTIONS` tries find none.
    """
    smallest = max(1, math.ceil(min(times) / longest * (1.0 - 1e-9)))
    steps = [min(times) / n for n in range(smallest, smallest + FRACTIONS)]
    for step in steps:
        if all(abs(time / step - round(time / step)) < 1e-6 for time in times):
            return step
    return steps[0]


def timing(scenario: Scenario, sample_time: float, step: float | None = None) -> Timing:
    """Timing of a scenario under a controller of a sample time [s].

    Parameters
    ----------
    scenario : Scenario
        Its duration and axle matter.
    sample_time : float
        Time from one sample to the next [s].
    step : float, optional
        Longest time between rows [s]. Default: `default_step`.

    Raises
    ------
    ValueError
        If the step is out of range, or there would be too many rows.
    """
    step = default_step(scenario) if step is None else step
    longest = checked_number("step", step, POSITIVE)
    if sample_time / longest > MAX_ROWS:
        raise ValueError(
            f"step = {longest!r} is out of range: must be >= {sample_time / MAX_ROWS:.6g},"
            f" as the sample time is {sample_time!r}"
        )
    per_sample = max(1, math.ceil(sample_time / longest * (1.0 - 1e-9)))
    length = sample_time / per_sample
    rows = max(2, math.floor(scenario.duration / length * (1.0 + 1e-9)) + 1)
    if rows > MAX_ROWS:
        raise ValueError(
            f"duration = {scenario.duration!r} has {rows} steps of {length:.6g} s: "
            f"at most {MAX_ROWS}, so the step must be longer"
        )
    return Timing(length, per_sample, rows)


def checked_creepage(scenarios: Sequence[Scenario], creepage: float | None) -> float | None:
    """Check a creepage at the start, which each wheelset's angular velocity must allow [1]."""
    if creepage is None:
        return None
    for scenario in scenarios:
        element, speed = scenario.drivetrain.wheelset.element, abs(scenario.initial_speed)
        reachable = creepage_limits(element, max(speed, element.minimum_speed), REFERENCE_SPEED)
        creepage = checked_number("initial_creepage", creepage, reachable)
    return creepage


class Plant:
    """Vehicles of scenarios, stepped from one sample to the next under your own torques.

    `run_scenario` and `run_many` use the same plant. At every sample it returns a measurement; it
    holds your torque, within the limits of the drive, until the next one. `copy.deepcopy` and
    `pickle` give independent plants that continue with the same bits, as for planning.

    Parameters
    ----------
    scenario : Scenario or sequence of Scenario
        One wheelset or vehicle, or n with equally many axles that are stepped side by side. The
        sensors of all have the same delay; all have a dynamic load or none has.
    sample_time : float, optional
        Time from one sample to the next [s]. Default: 10 ms.
    step : float, optional
        Longest time between rows, over which torques and dynamic loads are held [s]; rounded down
        to a whole fraction of the sample time. Default: as for `run_scenario`.
    tolerance : float, optional
        Relative error of each of the integrator's substeps [1].
    initial_creepage : float, optional
        Creepage at the start [1]. Default: steady under the first torque, which is the demand or
        zero, as the scenario's `start` says; zero at standstill.

    Attributes
    ----------
    time : float
        Time of the present sample [s].
    axles : int
        Number of axles of each vehicle.

    Raises
    ------
    ValueError
        If a value is out of range, or no steady state holds a first demand.

    Examples
    --------
    >>> import contactlib as cl
    >>> plant = cl.Plant(cl.load_scenario("dry_wet_dry.toml"))
    >>> measured = plant.reset()
    >>> while plant.time < 10.0:
    ...     slip = measured.wheel_speed - measured.vehicle_speed
    ...     measured = plant.step(measured.demand if slip < 0.2 else 0.1 * measured.demand)
    >>> f"{plant['speed']:.1f} m/s, {plant['creep_work'] / 1e3:.0f} kJ of slip"
    '11.4 m/s, 70 kJ of slip'
    """

    def __init__(
        self,
        scenario: Scenario | Sequence[Scenario],
        *,
        sample_time: float = 0.01,
        step: float | None = None,
        tolerance: float = 1e-7,
        initial_creepage: float | None = None,
    ) -> None:
        self._single = isinstance(scenario, Scenario)
        given = [scenario] if isinstance(scenario, Scenario) else list(scenario)
        for run in given:
            if not isinstance(run, Scenario):
                raise ValueError(
                    f"expected a Scenario, got {shown(run)}: contactlib.load_scenario reads one"
                )
        if not given:
            raise ValueError("scenario = [] is too short: a plant has at least one wheelset")
        if len(counts := {run.axles for run in given}) > 1:
            raise ValueError(
                f"scenarios have {sorted(counts)} axles: what is stepped together must have "
                "equally many"
            )
        sample_time = checked_number("sample_time", sample_time, SAMPLE_TIME)
        self._build(
            given,
            timing(given[0], sample_time, step),
            checked_number("tolerance", tolerance, TOLERANCE),
            checked_creepage(given, initial_creepage),
        )
        self.reset()

    def _build(
        self,
        scenarios: Sequence[Scenario],
        timing: Timing,
        tolerance: float,
        creepage: float | None,
        rows: int = 1,
    ) -> None:
        """Prepare what does not change from run to run, and so many rows of inputs."""
        self._timing, self._tolerance, self._creepage = timing, tolerance, creepage
        self._count, self.axles = len(scenarios), (axles := scenarios[0].axles)
        self._behind = np.concatenate([one.position for one in scenarios])
        self._axle = np.tile(np.arange(1, axles + 1), len(scenarios))
        shares = [one.shares_of_demand for one in scenarios]  # of traction, of braking
        self._driven, self._braked = np.concatenate(shares, axis=1)
        self._vehicles = _native_vehicles(scenarios)
        self._line = Line(scenarios, timing.step * timing.per_sample)
        self._scenarios = scenarios = [one for one in scenarios for _ in range(axles)]
        self.trains = [scenario.drivetrain for scenario in scenarios]
        self.tracks = [scenario.rails for scenario in scenarios]
        self._with_brake = np.array([train.brake is not None for train in self.trains])
        bodies, n = [train.wheelset for train in self.trains], len(scenarios)
        self.fleet = self._native()
        self.radius = np.array([body.radius for body in bodies])
        self._demands = ManyProfiles([scenario.demand for scenario in scenarios])
        self._speeds = ManyProfiles([scenario.held_speed or FREE for scenario in scenarios])
        self._radius = _numbers(self.radius)
        self._inputs = np.zeros((rows, n), kernel.drivetrain_dtype("input"))
        self.measured_speed = np.zeros(self._inputs.shape)  # of the rows of a block [m/s]
        self.sand_rate = np.zeros(self._inputs.shape)  # likewise [kg/s]
        self._slowest = np.array([body.element.minimum_speed for body in bodies])
        self._load = np.array([0.5 * scenario.static_load for scenario in scenarios])
        factors = [scenario.dynamic_load or STATIC for scenario in scenarios]
        self._load_factors = None if set(factors) == {STATIC} else ManyProfiles(factors)

    @property
    def failed(self) -> NDArray[np.bool_]:
        """Whether the integrator of each vehicle gave up, shape (n,); its states are frozen."""
        return self._failed[:: self.axles]

    def _native(self) -> kernel.NativeFleet:
        """The drivetrains on their tracks in the kernel."""
        pairs = zip(self.trains, (track.native for track in self.tracks), strict=True)
        return kernel.NativeFleet([train.member(track) for train, track in pairs], self.axles)

    def _connect(self) -> None:
        """Let the kernel step the states in place."""
        self._commanded = self._inputs["commanded_torque"]
        changed = self._states, self._substeps, self._failed
        self._step_on = self.fleet.stepping(self._inputs, *changed, self._vehicles)

    def __getstate__(self) -> dict[str, Any]:
        """State for copies and pickles, without what belongs to the kernel."""
        left_out = "fleet", "available", "_commanded", "_step_on"
        return {name: value for name, value in vars(self).items() if name not in left_out}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Continue from this state, with the bits of the plant that had it."""
        vars(self).update(state)
        if "fleet" not in state:
            self.fleet = self._native()
        self._connect()

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """An independent plant in the same state; it shares what never changes."""
        constant = *self._scenarios, *self.trains, *self.tracks, self.fleet, self._line
        memo |= {id(part): part for part in constant}
        made = object.__new__(type(self))
        made.__setstate__(deepcopy({**self.__getstate__(), "fleet": self.fleet}, memo))
        return made

    def __copy__(self) -> Self:
        """A deep copy, as a shallow one would step the same states."""
        return deepcopy(self)

    def reset(self, seed: int = 0) -> Measurement[Any]:
        """Begin again and return the first measurement.

        Parameters
        ----------
        seed : int, optional
            Index of the run, or of the first of n runs, among many: with the sensors' own seed it
            gives their noise, as `index` of `run_scenario`.

        Raises
        ------
        ValueError
            If no steady state holds a first demand.
        """
        first = checked_whole("seed", seed, INDEX)
        self._begin(range(first, first + self._count))
        for error in self.refused.values():
            raise error
        return self._given(self._measured(self._ahead(0, 1)[0][0]))

    def step(self, torque: ArrayLike, sand: ArrayLike = 0.0) -> Measurement[Any]:
        """Hold a torque until the next sample, and return what is measured there.

        Parameters
        ----------
        torque : array_like
            Torque [N.m], one for all, one for each of n vehicles or for each of their axles, shape
            (n, axles); of a single vehicle (axles,). The drive commands what its limits allow.
        sand : array_like, optional
            Part of all sand that axles lay, from 0 to 1, likewise.

        Raises
        ------
        ValueError
            If a torque is out of range or there are not as many as vehicles or axles.
        RuntimeError
            If the integrator of a plant of one vehicle gives up.
        """
        self._command(self._of_axles("torque", torque, TORQUE), self._of_axles("sand", sand, PART))
        first, count = self._row, self._timing.per_sample
        demands, held = self._ahead(first, count + 1)
        for i in range(count):
            for name, values in held.items():
                self._inputs[name][0] = values[i]
            self._advance(0, first + i, self._timing.step)
        if self._single and self.failed[0]:
            raise RuntimeError(f"the integrator gave up before {self.time:.6g} s")
        self._row += count
        return self._given(self._measured(demands[count]))

    def _of_axles(self, name: str, given: ArrayLike, limits: Limits) -> Numbers:
        """Checked numbers that are for all, for each vehicle or for each axle."""
        numbers, vehicles, axles = (
            checked(name, given, limits),
            self._shape(shared=True),
            self._shape(),
        )
        if numbers.shape not in ((), vehicles, axles):
            known = " or ".join(map(str, dict.fromkeys([(), vehicles, axles])))
            raise ValueError(f"{name} has the shape {numbers.shape}: must be {known}")
        if self.axles > 1:
            each = numbers[..., np.newaxis] if numbers.shape == vehicles else numbers
            numbers = np.broadcast_to(each, axles).ravel()
        return _numbers(numbers)

    @property
    def units(self) -> Mapping[str, str]:
        """Units of the signals; there is a speed limit if a track has one."""
        shafts = all(train.motor.rotor_inertia is not None for train in self.trains)
        pressures = not np.isnan(self.pressure_per_torque).any()
        sanded = any(train.sanding is not None for train in self.trains)
        present = shafts, pressures, self.padded, sanded, self.has_limits
        more = compress((OF_SHAFTS, OF_BRAKES, OF_PADS, OF_SAND, OF_TRACKS), present)
        return {**UNITS, **units(*more)}

    @cached_property
    def pressure_per_torque(self) -> FloatArray:
        """That of each axle's brake [Pa/(N.m)]; nan if not known."""
        brakes = (train.brake for train in self.trains)
        return np.array([brake.pressure_per_torque if brake else np.nan for brake in brakes])

    @cached_property
    def padded(self) -> bool:
        """Whether the friction of a brake's pads changes."""
        return any(train.brake and train.brake.pads for train in self.trains)

    @property
    def time(self) -> float:
        """Time of the present sample [s]."""
        return self._timing.step * self._row

    def __getitem__(self, name: str) -> Any:
        """Value of a signal of `run_scenario` now: a number, or an array of the shape of `step`."""
        if name not in self.units:
            known = {**self.units, **units(of_contacts())}
            if name not in known:
                raise no_signal(name, known, self)
            checked_signals([name], [train.wheelset.element for train in self.trains])
        values = self.shaped(self.now()[name][0], shared=name in SHARED)
        return values if values.shape else float(values)

    def _shape(self, *, shared: bool = False) -> tuple[int, ...]:
        """Shape of numbers of all axles, or of those that the axles of a vehicle share."""
        vehicles = () if self._single else (self._count,)
        return vehicles if shared or self.axles == 1 else (*vehicles, self.axles)

    def shaped(self, values: FloatArray, *, shared: bool = False) -> FloatArray:
        """New array of numbers of all axles by vehicle and axle, or of those that axles share."""
        return values[:: self.axles if shared else 1].reshape(self._shape(shared=shared)).copy()

    def now(self) -> Block:
        """All signals of `run_scenario` now, each computed on first use: shape (1, n axles)."""
        inputs = self._inputs[:1]
        for given, values in self._ahead(self._row, 1)[1].items():
            inputs[given][0] = values[0]
        self._advance(0, self._row, 0.0)  # sets the friction that is met here
        return Block(
            np.array([self.time]),
            np.full(inputs.shape, self._demand),
            inputs.copy(),
            self._states[np.newaxis].copy(),
            self,
            self._stored,
        )

    @cached_property
    def available(self) -> AvailableForce:
        """Largest creep forces that friction allows."""
        loaded = any(scenario.loads_change for scenario in self._scenarios)
        return AvailableForce(self.trains, self.tracks, loaded=loaded)

    def _begin(self, index: Sequence[int]) -> None:
        """Set the first state, and the sensors' and the drives' memory."""
        n, axles = len(self.trains), self.axles
        if axles > 1:
            index = [MAX_AXLES * i + axle for i in index for axle in range(axles)]
        sample_time = self._timing.step * self._timing.per_sample
        sensors = [one.sensors for one in self._scenarios]
        self._reader = SensorReader(
            sensors, sample_time, index, radius=self.radius, numbers=n == 1, axles=axles
        )
        brakes = [one.brake for one in self.trains]
        braked = [brake is not None for brake in brakes]
        motors = [one.motor for one in self.trains]
        self._drives = Drives(motors, self.radius, sample_time, braked)
        self._inputs["commanded_brake"] = 0.0
        self._brakes: Delayed | None = None
        self._sanders: Sanders | None = None
        sandings = [one.sanding for one in self.trains]
        if any(sandings):
            self._sanders = Sanders(sandings, self._axle, sample_time, -self._behind)
        self._measured_speed: Numbers = 0.0
        self._failed, self._substeps = np.zeros(n, dtype=np.bool_), np.zeros(n)
        self._row, self._stored, self._torque = 0, list[FloatArray](), _numbers(np.zeros(n))
        self._inputs["load_left"] = self._inputs["load_right"] = self._load
        demand, held = self._ahead(0, 1)
        for name, values in held.items():
            self._inputs[name][0] = values[0]
        self._states: Any = np.zeros(n, kernel.drivetrain_dtype("state"))
        self._states["distance"] = -self._behind
        self._demand = self._possible(
            demand[0], np.array([one.initial_speed for one in self._scenarios])
        )
        self._braking: Numbers = 0.0
        self._connect()
        applied = np.array([one.start == "applied" for one in self._scenarios])
        torque = np.where(applied, self._demand, 0.0)
        vehicles = self._vehicles
        if vehicles is not None:
            vehicles.begin(2.0 * self._load)
        for _ in range(1 if vehicles is None else kernel.library().SETTLING):
            self._advance(0, 0, 0.0)  # sets loads and friction at the start
            begin = start(self._scenarios, self.fleet, self._inputs[0], torque, self._creepage)
            self._states[:] = begin.states
            self._states["distance"] = -self._behind
            if vehicles is not None:
                self._commanded[0] = begin.torque
                vehicles.settle(self.fleet, self._inputs[0], self._states)
        self._torque, self.refused = _numbers(begin.torque), begin.refused
        if any(braked):
            delays = [0.0 if brake is None else brake.delay for brake in brakes]
            self._brakes = Delayed(delays, sample_time, np.maximum(-begin.torque, 0.0))
        self.failed[[axle // axles for axle in self.refused]] = True

    def _measured(self, demand: FloatArray) -> Measurement[Any]:
        """Read the sensors; the drive's power limits the demand [N.m]."""
        self._demand = self._possible(demand, self._states["speed"])
        speed = _numbers(self._states["speed"])
        rim = self._radius * self._turning()
        self._turn = self._drives.turn(self._demand, speed)
        acting = self._turn * self._demand
        wheel, vehicle = self._reader.read(rim, speed, acting)
        self._measured_speed, torque = vehicle, self._turn * self._torque
        if self.axles == 1:
            return Measurement(acting, wheel, vehicle, torque, (wheel,))
        demanded = np.where(self._reader.free, 0.0, acting)  # none of an axle on trial
        every = np.repeat(wheel.reshape(-1, self.axles), self.axles, axis=0)
        return Measurement(demanded, wheel, vehicle, torque, tuple(every.T), self._axle)

    def _possible(self, demand: FloatArray, speed: FloatArray) -> Numbers:
        """Part of the demand [N.m] that the drives and the limits of the line allow at a speed."""
        limit = None
        if self.has_limits:
            distance, speeds = self._states["distance"], np.broadcast_to(speed, demand.shape)
            if self._line.has_driver.any():
                demand = self._line.kept(demand, distance, speeds)
            if not self._line.has_driver.all():
                limit = _numbers(self._line.fading(distance))
        if self.axles > 1:
            brakes = np.where(self._with_brake, demand < 0.0, demand * speed < 0.0)
            demand = demand * np.where(brakes, self._braked, self._driven)
        return self._drives.possible(_numbers(demand), _numbers(speed), limit)

    @cached_property
    def has_limits(self) -> bool:
        """Whether a track has a speed limit."""
        return any(track.speed_limit is not None for track in self.tracks)

    def speed_limit(self, distance: FloatArray) -> FloatArray:
        """Speed limits at distances (..., n) of n wheelsets [m/s]: the lowest under each train."""
        return self._line.limit(distance)

    def _turning(self) -> Numbers:
        """Mean angular velocity of the wheels [rad/s]."""
        left, right = self._states["omega_left"], self._states["omega_right"]
        return 0.5 * (_numbers(left) + _numbers(right))

    def _command(self, requested: Numbers, sand: Numbers = 0.0) -> None:
        """Command the drives a torque on the axle until the next sample [N.m], and the sanders."""
        if self._sanders is not None:
            self._sanders.command(sand, self._states["speed"])
        elif np.any(sand):
            raise ValueError(NO_SANDER)
        requested = self._turn * requested
        self._torque = self._drives.command(requested, self._torque, self._demand, self._turning())
        if self._brakes is not None:
            torque = np.full(len(self.trains), self._torque)
            self._braking = self._brakes(np.maximum(-torque, 0.0))

    def _given(self, measured: Measurement[Any]) -> Measurement[Any]:
        """The measurement as new arrays, or as numbers of one wheelset."""
        if not self._shape():
            return measured
        return measured.each(lambda part: np.full(len(self.trains), part).reshape(self._shape()))

    def _advance(self, place: int, row: int, step: float) -> None:
        """Make the step of a row [s] under the inputs at a place."""
        self.measured_speed[place] = self._measured_speed
        self._commanded[place] = self._torque
        if self._line.towing:
            distance, way = self._states["distance"], step * self._states["speed"]
            self._inputs["resistance_force"][place] = self._line.pull(distance, way)
        if self._sanders is not None:
            self._inputs["sand"][place] = self._sanders.meet(self._states["distance"])
            self.sand_rate[place] = self._sanders.rate
        if self._brakes is not None:
            self._inputs["commanded_brake"][place] = self._braking
        self._step_on(place, self._timing.step * row, step, self._tolerance)

    def _ahead(self, first: int, count: int) -> tuple[FloatArray, dict[str, FloatArray]]:
        """Demand [N.m] at the sample of each row, and the inputs that change from row to row."""
        rows = np.arange(first, first + count + 1, dtype=np.float64)
        sampled = rows[:-1] - rows[:-1] % self._timing.per_sample
        speeds = self._speeds(self._timing.step * rows)
        held = {"acceleration": np.diff(speeds, axis=0) / self._timing.step}
        if self._load_factors is not None:
            load = self._load * self._load_factors(self._timing.step * rows[:-1])
            held |= {"load_left": load, "load_right": load}
        return self._demands(self._timing.step * sampled), held


STICKING = 0.99  # part of the way that pads give, below which they do not slide
CREEPING = 1e-9  # speed above which a held vehicle creeps [m/s]


class Runs(Plant):
    """Runs of n scenarios under a controller, row by row.

    Parameters
    ----------
    scenarios : sequence of Scenario
        As for `Plant`; friction falls with slip speed in all of them or in none.
    control : TractionController
        Controller of all axles of all runs, with parameters stacked.
    timing : Timing
        Common rows and samples.
    index : sequence of int
        Index of each run, from which the noise of its axles is drawn.
    tolerance : float
        Relative error of each of the integrator's substeps [1].
    creepage : float, optional
        Creepage at the start [1]. Default: steady under the first demand.

    Attributes
    ----------
    trains : list of Drivetrain
        Drivetrain of each run.
    fleet : NativeFleet
        The drivetrains in the kernel.
    radius : ndarray
        Rolling radii [m].
    refused : dict
        Errors of the axles that could not start, by position.
    """

    def __init__(
        self,
        scenarios: Sequence[Scenario],
        control: TractionController,
        timing: Timing,
        *,
        index: Sequence[int],
        tolerance: float,
        creepage: float | None = None,
    ) -> None:
        self._control, self._memory = control, None
        rows = max(1, BLOCK // (len(scenarios) * scenarios[0].axles))
        self._build(scenarios, timing, tolerance, creepage, rows)
        self._begin(index)

    @property
    def creeping(self) -> list[str]:
        """Sentences on vehicles that creep now although their brakes hold all wheels."""
        states, speed = self._states, np.abs(self._states["speed"])
        held = (states["brake_torque"] > 0.0) & (np.abs(states["pads_left"]) < STICKING)
        held &= (speed > CREEPING) & (speed < self._slowest)
        held &= [not train.wheelset.element.memory for train in self.trains]
        vehicles = held.reshape(-1, self.axles).any(axis=1) & ~self.failed
        return [
            f"at the end the brake holds the wheels and the vehicle creeps at {value:.2g} m/s, as "
            "its contacts have no memory; add memory = true to [contact]"
            for value in speed[:: self.axles][vehicles].tolist()
        ]

    def end(self, which: NDArray[np.bool_]) -> None:
        """Step some vehicles no more, shape (n,)."""
        self._failed |= np.repeat(which, self.axles)

    def blocks(self) -> Iterator[Block]:
        """Yield all rows in blocks; each is valid until the next."""
        inputs, rows = self._inputs, self._timing.rows
        states = np.empty(inputs.shape, self._states.dtype)
        # Views as plain numbers, as numpy copies records field by field.
        kept, now = (each.view(np.float64) for each in (states, self._states))
        for first in range(0, rows, AHEAD):
            demands, held = self._ahead(first, min(AHEAD, rows - first))
            for done in range(0, len(demands), len(inputs)):
                demand = demands[done : done + len(inputs)]
                count = len(demand)
                for name, values in held.items():
                    inputs[name][:count] = values[done : done + count]
                for i in range(count):
                    kept[i] = now
                    row = first + done + i
                    if row % self._timing.per_sample == 0:
                        self._control_at(row, self._measured(demand[i]))
                    demand[i] = self._demand
                    self._advance(i, row, self._timing.step if row < rows - 1 else 0.0)
                failed = self.failed
                failed |= ~np.isfinite(now.reshape(failed.size, -1)).all(axis=1)
                yield Block(
                    self._timing.times(first + done, count),
                    demand,
                    inputs[:count],
                    states[:count],
                    self,
                    self._stored,
                )

    def _control_at(self, row: int, measured: Measurement[FloatArray]) -> None:
        """Command the torque that the controller returns for a measurement."""
        if len(self.trains) == 1 and not isinstance(self._control, (Parameters, Copies)):
            measured = measured.each(lambda part: np.full(1, part))
        if row == 0:
            self._memory = self._called("start", row, measured, measured.torque)
        answer = self._called("sample", row, measured, self._memory)
        shape = self._failed.shape
        command: Any = answer[0] if isinstance(answer, tuple) and len(answer) == 2 else None
        requested, sand = command if isinstance(command, Command) else (command, 0.0)
        if row == 0 and (command is None or np.shape(requested) not in ((), shape)):
            raise ValueError(
                f"{type(self._control).__name__}.sample returned {shown(answer)}: it must "
                f"return the torques, an array of the shape {shape}, and the memory"
            )
        self._memory = answer[1]
        torque = requested if type(requested) is float else _numbers(np.asarray(requested))
        self._command(torque, sand)

    def _called(self, method: str, row: int, *given: Any) -> Any:
        """Answer of a method of the controller at a row."""
        try:
            return getattr(self._control, method)(*given)
        except (ValueError, RuntimeError):  # as from a SampledController, already explained
            raise
        except USERS_ERRORS as error:
            what = f"{type(self._control).__name__}.{method} at {self._timing.step * row:.6g} s"
            raise explained(what, error) from error
