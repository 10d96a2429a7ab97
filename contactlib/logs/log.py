"""Logs of runs: torques and speeds over time, from a run or from a CSV file of a trial."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import lfilter, lfilter_zi

from contactlib.base.csv_columns import (
    csv_numbers,
    csv_rows,
    decoded,
    name_and_unit,
    preamble_of,
    unit_factor,
    units_below,
)
from contactlib.base.quantities import (
    MAX_ROWS,
    POSITIVE,
    FloatArray,
    Limits,
    checked,
    checked_number,
    warn,
)
from contactlib.base.text import known_names, printable_line
from contactlib.base.units import STANDARD_GRAVITY
from contactlib.base.writing import read_small
from contactlib.files.scenario import Scenario
from contactlib.logs.doubts import LITTLE, OF_TRAIN, SLOWEST, doubts, smooth
from contactlib.logs.friction import SLIDING, filled
from contactlib.logs.motion import Rows, force_of
from contactlib.runs.result import Result
from contactlib.vehicle.track import Profile

TORQUES = ("drive_torque", "motor_torque", "brake_torque", "cylinder_pressure")
OF_AXLES = dict(zip(TORQUES, ("N.m", "N.m", "N.m", "Pa"), strict=True)) | {
    "omega": "rad/s",
    "wheel_speed": "m/s",
}
OF_VEHICLE = {"time": "s", "speed": "m/s", "distance_1": "m"}
MAX_LOG_BYTES = 50_000_000  # 1.5 hours of four axles at 100 Hz, read in some ten seconds
NUMBERS = Limits(at_least=-1e10, at_most=1e10)  # in SI units; times may count from 1970
GAP = 3.0  # spacings without a number that are a gap
OF_WHEELS = 0.1  # window in which their motion is a straight line [s]


@dataclass(frozen=True, eq=False, kw_only=True)
class Log:
    """Torques and speeds of a vehicle's axles, or of a wheelset, over time.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Strictly increasing times of the rows [s].
    drive_torque : ndarray, shape (n, axles)
        Torque on each axle, of motor and brake together, negative in braking [N.m].
    omega : ndarray, shape (n, axles)
        Angular velocity of each axle, nan where it is not known [rad/s].
    speed : ndarray, shape (n,), optional
        Speed of the vehicle, nan where it is not known [m/s].
    distance : ndarray, shape (n,), optional
        Way of the first axle, 0 where the track of the scenario begins [m].

    Raises
    ------
    ValueError
        If the shapes differ, there are fewer than three rows, a number is out of range, the times
        are not strictly increasing, an axle has no torque, or no column has a speed.
    """

    time: FloatArray
    drive_torque: FloatArray
    omega: FloatArray
    speed: FloatArray | None = None
    distance: FloatArray | None = None

    def __post_init__(self) -> None:
        n = np.size(self.time)
        axles = np.shape(self.omega)[-1:]
        if n < 3:
            raise ValueError(f"Log.time has {n} rows: must be >= 3")
        for name in ("time", "drive_torque", "omega", "speed", "distance"):
            if getattr(self, name) is None:
                continue
            values = np.array(getattr(self, name), dtype=np.float64)
            shape = (n, *axles) if name in ("drive_torque", "omega") else (n,)
            if values.shape != shape:
                raise ValueError(f"Log.{name} has the shape {values.shape}: must be {shape}")
            checked(f"Log.{name}", values[~np.isnan(values)] if name != "time" else values, NUMBERS)
            values.flags.writeable = False
            object.__setattr__(self, name, values)
        _check_order(self.time, "row", range(1, n + 1))
        for name, values in self.columns():
            if name.startswith("drive_torque") and np.isnan(values).all():
                raise ValueError(f"Log.{name} has no number")
        if np.isnan(self.omega).all() and (self.speed is None or np.isnan(self.speed).all()):
            raise ValueError("Log: neither omega nor speed has a number")

    @classmethod
    def of(cls, result: Result) -> Log:
        """The log of a run, with the true numbers.

        Examples
        --------
        >>> from contactlib import load_scenario, run_scenario
        >>> result = run_scenario(load_scenario("torque_step.toml"), "open_loop")
        >>> Log.of(result).omega.shape == (result.time.size, 1)
        True
        """
        return cls(
            time=result.time,
            drive_torque=result["drive_torque"].reshape(-1, result.axles),
            omega=result["omega"].reshape(-1, result.axles),
            speed=result["speed"],
            distance=result.axle(1).signals.get("distance"),
        )

    def columns(self) -> Iterator[tuple[str, FloatArray]]:
        """Each column but the time, with its name in a file."""
        for name, table in (("drive_torque", self.drive_torque), ("omega", self.omega)):
            yield from ((f"{name}_{k}", values) for k, values in enumerate(table.T, start=1))
        for name, values in (("speed", self.speed), ("distance_1", self.distance)):
            if values is not None:
                yield name, values

    def rows(self, scenario: Scenario, period: float = 0.01) -> Rows:
        """Evenly spaced rows, with loads, distance and grades, of the part in which it runs.

        Parameters
        ----------
        scenario : Scenario
            The vehicle of the log, and its track.
        period : float, optional
            Shortest time from row to row [s]. Default: that of the log, but at least 10 ms.

        Returns
        -------
        Rows
            From the first to the last row whose speed is above 1 m/s and the minimum speed of the
            contact. Speeds are nan in gaps longer than three rows, and an axle's also in those of
            its torque. Loads are those of statics under the forces that the torques leave.

        Raises
        ------
        ValueError
            If the number of axles is not that of the scenario, the log has too many rows, runs
            backward or does not run.

        Warns
        -----
        InputWarning
            If a column seems to have another unit, sign, scale or clock, to be quantised coarsely,
            or never changes.
        """
        if (axles := self.omega.shape[1]) != scenario.axles:
            raise ValueError(f"the log has {axles} axles, and the scenario {scenario.axles}")
        period = checked_number("period", period, POSITIVE)
        step = max(float(np.median(np.diff(self.time))), period)
        size = int((self.time[-1] - self.time[0]) / step + 1e-6) + 1
        if not 3 <= size <= MAX_ROWS:
            raise ValueError(
                f"the log, from {self.time[0]:g} to {self.time[-1]:g} s, has {size} rows of "
                f"{step:g} s: must be 3 to {MAX_ROWS}"
            )
        time = self.time[0] + step * np.arange(size)
        omega = np.stack([self._means(column, time, step) for column in self.omega.T], axis=1)
        torque = np.empty_like(omega)
        for k, given in enumerate(self.drive_torque.T):
            known = np.isfinite(given)
            torque[:, k] = np.interp(time, self.time[known], given[known])
            omega[np.isnan(self._means(given, time, step)), k] = np.nan  # tells nothing alone
        speed, way = (
            np.full(size, np.nan) if given is None else self._means(given, time, step)
            for given in (self.speed, self.distance)
        )
        body, vehicle, limit = scenario.drivetrain.wheelset, scenario.vehicle, np.inf
        turning = filled(omega)
        if np.isfinite(speed).any():
            moved = smooth(filled(speed[:, np.newaxis])[:, 0], step, OF_WHEELS)
        else:
            rims = body.radius * turning[:, np.isfinite(omega).any(axis=0)]
            moved = _least_slipping(smooth(rims, step, OF_WHEELS), torque, scenario)
            limit = scenario.sensors.acceleration_limit or limit
        if (backward := np.flatnonzero(moved < -SLOWEST)).size:
            raise ValueError(
                f"the log runs backward, at {moved[backward[0]]:.3g} m/s after "
                f"{time[backward[0]]:g} s: turn the scenario's vehicle and track round, and change "
                "the signs of speeds and torques"
            )
        runs = np.flatnonzero(moved > max(SLOWEST, body.element.minimum_speed))
        if runs.size < 3:
            raise ValueError(f"speed: the log never runs faster than {SLOWEST:g} m/s")
        if np.isnan(way).all():
            way = np.concatenate([[0.0], np.cumsum(0.5 * step * (moved[1:] + moved[:-1]))])
        way = filled(way[:, np.newaxis])[:, 0]
        grade = under = scenario.track.grade(way[:, np.newaxis] - scenario.position).mean(axis=1)
        rate = smooth(turning, step, OF_WHEELS, derivative=1)
        force = force_of(body, torque, turning, rate)
        load = np.full_like(omega, scenario.static_load)
        if vehicle is not None:
            gain = np.clip(smooth(moved, step, OF_TRAIN, derivative=1), -limit, limit)
            uphill = STANDARD_GRAVITY * (under + body.resistance.grade)
            target = vehicle.loads(
                force, acceleration=gain + uphill, radius=body.radius, omega_rate=rate
            )
            load = _lagging(target, step, vehicle.load_lag)
            last, tail = vehicle.position[-1], vehicle.length
            if tail is not None and tail > last:  # the train is behind the axles
                towed = vehicle.train_mass / vehicle.mass
                grade = under + towed * (scenario.track.grade.mean_behind(way, last, tail) - under)
        cut = slice(runs[0], runs[-1] + 1)
        rows = Rows(*(part[cut] for part in (time, speed, torque, omega, load, way, grade)))
        ran = (self.time >= rows.time[0]) & (self.time <= rows.time[-1])
        columns = {name: values[ran & np.isfinite(values)] for name, values in self.columns()}
        for doubt in doubts(scenario, rows, columns, force[cut], moved[cut]):
            warn(doubt)
        return rows

    def _means(self, values: FloatArray, time: FloatArray, step: float) -> FloatArray:
        """Means over each row, or the numbers there if the log has no more; nan in gaps."""
        known = np.isfinite(values)
        if not known.any():
            return np.full(time.size, np.nan)
        at = self.time[known]
        line = Profile(tuple(at), tuple(values[known]))
        several = step > 1.5 * np.median(np.diff(self.time))
        made = line.mean_behind(time + 0.5 * step, 0.0, step) if several else line(time)
        stamps = np.concatenate([[-np.inf], at, [np.inf]])
        after = np.searchsorted(stamps[:-1], time)
        before, beyond = time - stamps[after - 1], stamps[after] - time
        lost = before + beyond > (GAP + 0.01) * step
        return np.where(lost & (np.minimum(before, beyond) > 0.5 * step), np.nan, made)


def _least_slipping(rims: FloatArray, torque: FloatArray, scenario: Scenario) -> FloatArray:
    """Speed of the wheel that slips least: slowest in traction, fastest in braking."""
    small = LITTLE * scenario.drivetrain.wheelset.radius * scenario.static_load * scenario.axles
    total, mean = torque.sum(axis=1), rims.mean(axis=1)
    slowest, fastest = rims.min(axis=1), rims.max(axis=1)
    return np.asarray(np.where(total > small, slowest, np.where(total < -small, fastest, mean)))


def _lagging(target: FloatArray, step: float, lag: float) -> FloatArray:
    """What follows a target, that is linear from row to row, with a lag; steady at first."""
    if lag == 0.0:
        return target
    left = np.exp(-step / lag)
    now = 1.0 - (1.0 - left) * lag / step
    b, a = [now, 1.0 - left - now], [1.0, -left]
    return np.asarray(lfilter(b, a, target, axis=0, zi=lfilter_zi(b, a) * target[:1])[0])


def _check_order(time: FloatArray, kind: str, numbers: Sequence[int]) -> None:
    """Refuse times that are not strictly increasing, by the number of their row or line."""
    for place in np.flatnonzero(np.diff(time) <= 0.0)[:1] + 1:
        raise ValueError(
            f"{kind} {numbers[place]}: time = {time[place]:.10g} s must be > "
            f"{time[place - 1]:.10g} s, that of the {kind} before"
        )


def read_log(
    path: str | os.PathLike[str], scenario: Scenario, columns: Mapping[str, str] | None = None
) -> Log:
    """Read the log of a run from a CSV file.

    The file is written as for `TractionData.from_csv`. Its columns are those of `Result.to_csv`:
    time, speed, distance_1, and drive_torque_1, omega_1 and so on for each axle, of one axle also
    without the number. In place of omega_1 it may have wheel_speed_1, by the nominal radius; in
    place of drive_torque_1 motor_torque_1 and brake_torque_1, which is positive and acts against
    the rotation, or cylinder_pressure_1, if `[brake]` of the scenario has pressure and torque. Only
    time, the torques of axles with a motor or brake, and one speed are needed; `estimate_rails`
    needs that of the vehicle. Numbers without a unit are in SI units; a blank cell is not known.

    Parameters
    ----------
    path : path
        The file.
    scenario : Scenario
        The vehicle of the log.
    columns : mapping, optional
        Headers of the file by these names, as ``{"omega_1": "n_WSP1 [1/min]"}``; the unit may be
        given here alone.

    Raises
    ------
    ValueError
        If the file has another content; the message is one line that names file, line and column.
    OSError
        If the file cannot be read.
    """
    try:
        text = decoded(read_small(Path(path), MAX_LOG_BYTES))
        return _read(text, scenario, columns or {})
    except ValueError as error:
        raise ValueError(f"{os.fspath(path)}: {printable_line(str(error))}") from None


def _read(text: str, scenario: Scenario, columns: Mapping[str, str]) -> Log:
    """The log in a file."""
    axles = scenario.axles
    of_axles = {f"{n}_{k}": si for n, si in OF_AXLES.items() for k in range(1, axles + 1)}
    known = OF_VEHICLE | of_axles

    def numbered(name: str) -> str:
        first = f"{name}_1"
        return first if first in known and (axles == 1 or name == "distance") else name

    columns = {numbered(name): header for name, header in columns.items()}
    for name in columns:
        if name not in known:
            raise ValueError(f"columns: no column is {name!r}; {known_names(name, known)}")
    if preamble := preamble_of(text, [name_and_unit(columns.get("time", "time"))[0]]):
        raise ValueError(preamble)
    lines = list(csv_rows(text))
    line, head = lines[0] if lines else (1, [])
    names = [name_and_unit(cell)[0] for cell in head]
    for name in names:
        kind, _, number = name.rpartition("_")
        if kind in OF_AXLES and number.isdecimal() and name not in known:
            raise ValueError(f"line {line}: {name}, but the scenario has {axles} axles")
    places, units = dict[str, int](), dict[str, str]()
    for name in known:
        header = columns.get(name, name)
        bare, unit = name_and_unit(header)
        given = zip(head, names, strict=True)
        at = [i for i, (cell, one) in enumerate(given) if header in (cell, one) or bare == cell]
        if name not in columns:
            at = [i for i, one in enumerate(names) if numbered(one) == name]
        if len(at) > 1 or (name in columns and not at):
            raise ValueError(f"line {line}: {len(at)} columns {header!r} in {', '.join(head)}")
        if at:
            places[name], units[name] = at[0], name_and_unit(head[at[0]])[1] or unit
    if "time" not in places:
        raise ValueError(f"line {line}: no column 'time'; columns are {', '.join(names)}")
    body, at = lines[1:], list(places.values())
    if body and (below := units_below(body[0][1], at, known.values())):
        units = {name: new or units[name] for name, new in zip(places, below, strict=True)}
        body = body[1:]
    if not body:
        raise ValueError(f"line {line}: no data after the columns' names")
    table = csv_numbers(body, len(head), at, [head[i] for i in at], blank="nan")
    values: dict[str, FloatArray] = {}
    for name, column in zip(places, table.T, strict=True):
        values[name] = si = unit_factor(line, name, units[name], known[name]) * column
        for place in np.flatnonzero(~NUMBERS.allows(si) & ((name == "time") | ~np.isnan(si)))[:1]:
            number, cell = body[place][0], head[places[name]]
            wrong = f"{cell} = {column[place]} is out of range"
            raise ValueError(f"line {number}: {wrong}: must be {NUMBERS} in {known[name]}")
    numbers = [number for number, _ in body]
    _check_order(values["time"], "line", numbers)
    omega, torque, radius = [], [], scenario.drivetrain.wheelset.radius
    for k in range(1, axles + 1):
        rim = values.get(f"wheel_speed_{k}", np.full(len(body), np.nan))
        omega.append(values.get(f"omega_{k}", rim / radius))
        torque.append(_torque(values, k, omega[-1], scenario, numbers))
    return Log(
        time=values["time"],
        drive_torque=np.stack(torque, axis=1),
        omega=np.stack(omega, axis=1),
        speed=values.get("speed"),
        distance=values.get("distance_1"),
    )


def _torque(
    values: Mapping[str, FloatArray],
    axle: int,
    omega: FloatArray,
    scenario: Scenario,
    lines: Sequence[int],
) -> FloatArray:
    """Torque on an axle, of motor and brake together [N.m]."""
    drive, motor, braking, pressure = (values.get(f"{name}_{axle}") for name in TORQUES)
    body, brake = scenario.drivetrain.wheelset, scenario.drivetrain.brake
    if drive is not None:
        return drive
    if braking is None and pressure is not None:
        if brake is None or brake.pressure is None:
            raise ValueError(
                "cylinder_pressure needs brake.pressure and brake.torque in the scenario"
            )
        if brake.pads is not None:
            raise ValueError(
                "cylinder_pressure gives no torque where the pads' friction changes: give "
                "brake_torque, or leave out the pads in the scenario"
            )
        braking = pressure / brake.pressure_per_torque
    if motor is None and braking is None and scenario.shares_of_demand[:, axle - 1].any():
        needed = ", ".join(f"{name}_{axle}" for name in TORQUES)
        raise ValueError(f"axle {axle} of {scenario.axles} has no torque: give one of {needed}")
    motor, braking = (np.zeros_like(omega) if t is None else t for t in (motor, braking))
    for place in np.flatnonzero(braking < -LITTLE * body.radius * scenario.static_load)[:1]:
        raise ValueError(  # it is more than an offset
            f"line {lines[place]}: the brake of axle {axle} has {braking[place]:.4g} N.m: must be "
            ">= 0, as it acts against the rotation; drive_torque has a sign"
        )
    backward = np.where(body.radius * omega < -SLIDING, -1.0, 1.0)
    return np.asarray(motor - backward * np.where(braking < 0.0, 0.0, braking))
