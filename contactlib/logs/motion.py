"""Most probable motion behind a log: states, friction under each axle, and constants.

Unknown are the angular velocity of each axle, the speed of the vehicle and the logarithm of the
friction factor under each axle in every row, and those constants that `LogPriors` does not take as
known. A row follows from the one before by the equations of motion up to a noise. The angular
velocity makes exponential steps whose noise is added after them, so the density of a row has no
determinant, as that of an implicit step has. The friction walks at random over the way, with steps
of Student's distribution: most are small, some are jumps. Gauss-Newton finds the most probable
values. Its normal matrix is banded, with a border for the constants.

A larger radius means more creepage, at which the same forces need a friction that varies less. The
most probable values lack the smaller volume of such frictions, so that their radii are too large in
traction and too small in braking, the more so the tighter the walk. It is therefore looser here
than that of `contactlib.logs.friction`; one that is looser still would leave noise in the speeds.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, NamedTuple, TypeAlias

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded

from contactlib.base.quantities import FloatArray, Parameters, Quantity
from contactlib.base.units import STANDARD_GRAVITY
from contactlib.element.force_element import ForceElement
from contactlib.files.scenario import Scenario
from contactlib.vehicle.wheelset import Wheelset, davis

DEGREES = 3.0  # of freedom of Student's distribution
LOOSE = 2.0  # scale of the walk behind the motion, over that of the friction
LOWEST, HIGHEST = -5.0, 2.0  # logarithms of the friction factor that are possible
MEDIAN_OF_NORMAL = 0.6745  # of the magnitude, over the standard deviation
DIFFERENCE = 1e-5  # for derivatives [m/s], and as a share of friction
SUBSTEPS = 2  # from row to row
ITERATIONS, ENOUGH = 60, 1e-3  # of Gauss-Newton; fall of the cost that ends it
SPREAD = Quantity("1", above=0.0, at_most=1.0)
NOISE = Quantity("m/s", above=0.0, at_most=10.0)
PRIOR = Quantity("1", at_least=0.0, at_most=1.0)
COMMON = ("torque", "mass", "delay", "slope", "decay")  # constants after the radii
TORQUE, MASS, DELAY, SLOPE, DECAY = range(-len(COMMON), 0)  # their places


@dataclass(frozen=True, kw_only=True)
class LogErrors(Parameters):
    """Standard deviations of what a log shows, of the model, and of friction along the way.

    Parameters
    ----------
    wheel_speed : float, optional
        Error of each rim speed [m/s].
    vehicle_speed : float, optional
        Error of each vehicle speed [m/s].
    wheel_motion : float, optional
        Error of the wheels' equation of motion, as a rim speed after one second [m/s]. Smaller
        values let the fast motion of the wheels decide the radii.
    vehicle_motion : float, optional
        Error of the vehicle's equation of motion, as a speed after one second [m/s].
    friction_change : float, optional
        Scale of the changes of the logarithm of friction over one metre [1].
    friction : float, optional
        Spread of the logarithm of the friction factor, before the log is known [1].

    Raises
    ------
    ValueError
        If a value is out of range.
    """

    wheel_speed: Annotated[float, NOISE] = 0.01
    vehicle_speed: Annotated[float, NOISE] = 0.02
    wheel_motion: Annotated[float, NOISE] = 0.5
    vehicle_motion: Annotated[float, NOISE] = 0.005
    friction_change: Annotated[float, SPREAD] = 0.07
    friction: Annotated[float, SPREAD] = 0.7


@dataclass(frozen=True, kw_only=True)
class LogPriors(Parameters):
    """Standard deviations of constants before the log is known; 0 of what is known exactly.

    Parameters
    ----------
    radius : float, optional
        Each wheel's radius over the nominal one [1].
    torque : float, optional
        Torque over that in the log, which is the same at all axles [1].
    mass : float, optional
        Mass that the axles move over the scenario's [1]. Their loads stay.
    delay : float, optional
        Time by which the log shows torques later than speeds [s].
    slope : float, optional
        Initial slope of the creep force over the scenario's, the `slope` of a track [1].
    decay : float, optional
        Fall of friction with slip speed over the scenario's, its `slip_rate_decay` [1].

    Raises
    ------
    ValueError
        If a value is out of range.

    Notes
    -----
    All but the delay are factors: what is known is a normal distribution of their logarithm.
    """

    radius: Annotated[float, PRIOR] = 0.005
    torque: Annotated[float, PRIOR] = 0.02
    mass: Annotated[float, PRIOR] = 0.0
    delay: Annotated[float, Quantity("s", at_least=0.0, at_most=1.0)] = 0.0
    slope: Annotated[float, PRIOR] = 0.0
    decay: Annotated[float, PRIOR] = 0.0

    def by_name(self, axles: int) -> dict[str, float]:
        """Standard deviation of each constant: ``radius_1`` ..., then the common ones."""
        radii = {f"radius_{i}": self.radius for i in range(1, axles + 1)}
        return radii | {name: getattr(self, name) for name in COMMON}


def force_of(
    body: Wheelset,
    torque: FloatArray,
    omega: FloatArray,
    rate: FloatArray,
    constants: FloatArray | None = None,
) -> FloatArray:
    """Creep force that a torque leaves, (T - J domega/dt - b omega)/r [N], (n, axles).

    The constants are those of `Motion`. Default: zero. The torque has no delay.
    """
    radius, gain = np.array(body.radius), 1.0
    if constants is not None:
        radius, gain = body.radius * np.exp(constants[:TORQUE]), np.exp(constants[TORQUE])
    return np.asarray((gain * torque - body.inertia * rate - body.damping * omega) / radius)


class Rows(NamedTuple):
    """Evenly spaced rows of a log, in the direction of travel.

    Attributes
    ----------
    time, speed : ndarray, shape (n,)
        Time [s], and speed of the vehicle [m/s], nan where it is not known.
    torque, omega, load : ndarray, shape (n, axles)
        Torque on each axle [N.m], its angular velocity [rad/s], nan where not known, and load [N].
    distance, grade : ndarray, shape (n,)
        Way of the first axle [m], and mean rise over it under the vehicle [1].
    """

    time: FloatArray
    speed: FloatArray
    torque: FloatArray
    omega: FloatArray
    load: FloatArray
    distance: FloatArray
    grade: FloatArray


class Forces(NamedTuple):
    """Creep forces [N] and derivatives; `by_law`: by the logarithms of slope and decay."""

    value: FloatArray
    by_omega: FloatArray
    by_speed: FloatArray
    by_friction: FloatArray
    by_law: FloatArray


class Steps(NamedTuple):
    """Angular velocities at the end of each interval, and their derivatives.

    Those by constants are by the axle's radius and the common ones.
    """

    end: FloatArray
    by_omega: FloatArray
    by_speed: FloatArray
    by_next_speed: FloatArray
    by_friction: FloatArray
    by_constants: FloatArray


Residuals: TypeAlias = tuple[FloatArray, Steps, Forces]


class Blocks(NamedTuple):
    """Normal matrix in blocks of rows and unknown constants, and the gradient of the cost."""

    diagonal: FloatArray
    beside: FloatArray
    border: FloatArray
    corner: FloatArray
    gradient: FloatArray
    slope: FloatArray


def _with_law(element: ForceElement, constants: FloatArray) -> ForceElement:
    """A contact with other slope and fall of friction with slip speed."""
    slope, decay = np.exp(constants[SLOPE:])
    friction = element.friction
    friction = replace(friction, slip_rate_decay=float(decay * friction.slip_rate_decay))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the element has warned of its ranges
        reduction = float(slope * element.slope_reduction)
        return replace(element, slope_reduction=reduction, friction=friction)


class Motion:
    """Motion of a scenario's vehicle behind the rows of a log.

    Parameters
    ----------
    scenario : Scenario
        Its vehicle, or wheelset, is that of the log.
    rows : Rows
        The log.
    errors : LogErrors
        What is known of its errors.
    priors : LogPriors
        What is known of the constants.

    Attributes
    ----------
    states : ndarray, shape (n, 2 axles + 1)
        Angular velocities, speed and logarithms of friction.
    constants : ndarray, shape (axles + 5,)
        As in `LogPriors.by_name`: logarithms of factors, and the delay [s].
    unknown : ndarray of int
        Places of those that are not known exactly.
    cost : float
        Negative logarithm of their probability density, up to a constant.
    """

    def __init__(
        self, scenario: Scenario, rows: Rows, errors: LogErrors, priors: LogPriors
    ) -> None:
        body, slopes = scenario.drivetrain.wheelset, set(scenario.track.slope.value)
        if body.mass is None:
            raise ValueError("scenario: a roller rig holds its speed; a log needs a free vehicle")
        if np.isnan(rows.speed).all():
            raise ValueError(
                "speed: the log has no vehicle speed, without which the wheels' slip is not known"
            )
        if len(slopes) > 1:
            low, high = min(slopes), max(slopes)
            raise ValueError(f"track.slope changes from {low:g} to {high:g}: must be constant")
        friction = body.element.friction
        if priors.decay and (friction.softens_with_heat or not friction.falls_with_slip_speed):
            raise ValueError(
                f"LogPriors.decay = {priors.decay:g} must be 0: the scenario's friction has no "
                "slip_rate_decay"
            )
        self.body, self.rows, self.errors = body.with_slope(slopes.pop()), rows, errors
        self.count, self.axles = rows.omega.shape
        self.mass = body.mass * self.axles
        self.step_size = float(rows.time[1] - rows.time[0])
        way = np.maximum(np.abs(np.diff(rows.distance)), 0.01)
        self._walk = LOOSE * errors.friction_change * np.sqrt(way)[:, np.newaxis]
        known = np.column_stack([rows.omega, rows.speed])
        each = [body.radius / errors.wheel_speed] * self.axles + [1.0 / errors.vehicle_speed]
        self._weight = np.where(np.isnan(known), 0.0, each)
        self._known = np.nan_to_num(known)
        self.spread = np.array(list(priors.by_name(self.axles).values()))
        self.unknown = np.flatnonzero(self.spread)

    def element(self, constants: FloatArray) -> ForceElement:
        """The contact with its slope and its fall of friction with slip speed."""
        known = not self.spread[SLOPE:].any()
        return self.body.element if known else _with_law(self.body.element, constants)

    def found_in(self, scenario: Scenario) -> Scenario:
        """The scenario with the contact that was found."""
        if not self.spread[SLOPE:].any():
            return scenario
        body = scenario.drivetrain.wheelset
        found = replace(body, element=_with_law(body.element, self.constants))
        return replace(scenario, drivetrain=replace(scenario.drivetrain, wheelset=found))

    def forces(
        self,
        omega: FloatArray,
        speed: FloatArray,
        friction: FloatArray,
        load: FloatArray,
        constants: FloatArray,
    ) -> Forces:
        """Creep forces of axles; the first four arguments broadcast."""
        o, v, m, p = np.broadcast_arrays(omega, speed, friction, load)
        scale = np.exp(np.clip(m, LOWEST, HIGHEST))
        turned, moved = DIFFERENCE / self.body.radius, DIFFERENCE
        f, by_omega, by_speed, by_friction = self.element(constants).force(
            omega=np.stack([o, o + turned, o, o]),
            speed=np.stack([v, v, v + moved, v]),
            axle_load=np.stack([p] * 4),
            friction_scale=np.stack([scale, scale, scale, scale * (1.0 + DIFFERENCE)]),
        )
        by_law = np.zeros((constants[SLOPE:].size, *f.shape))
        for i in (SLOPE, DECAY):
            if self.spread[i]:
                other = constants.copy()
                other[i] += DIFFERENCE
                changed = self.element(other).force(
                    omega=o, speed=v, axle_load=p, friction_scale=scale
                )
                by_law[i] = (changed - f) / DIFFERENCE
        return Forces(
            f,
            (by_omega - f) / turned,
            (by_speed - f) / moved,
            (by_friction - f) / DIFFERENCE,
            by_law,
        )

    def torque(self, constants: FloatArray, part: float = 0.0) -> tuple[FloatArray, FloatArray]:
        """Torques without delay at a part of each row's interval [N.m], and their rates."""
        given = self.rows.torque
        at = np.arange(self.count) + part + constants[DELAY] / self.step_size
        at = np.clip(at, 0.0, self.count - 1.0)
        before = np.minimum(at.astype(int), self.count - 2)
        rise = given[before + 1] - given[before]
        return given[before] + (at - before)[:, np.newaxis] * rise, rise / self.step_size

    def _steps(self, states: FloatArray, constants: FloatArray) -> Steps:
        """Angular velocities after each interval, by exponential steps.

        They are exact where force and torque change evenly with time and angular velocity: held
        speeds would make stiff wheels lag behind a vehicle that brakes, like a larger torque.
        """
        a, body, h = self.axles, self.body, self.step_size / SUBSTEPS
        y, v, m = states[:-1, :a], states[:, a : a + 1], states[:-1, a + 1 :]
        ratio, gain = np.exp(constants[:a]), np.exp(constants[TORQUE])
        radius, load = body.radius * ratio, self.rows.load[:-1]
        by_omega, zero = np.ones_like(y), np.zeros_like(y)
        by_speed, by_next, by_friction = zero, zero, zero
        by_constants = np.zeros((1 + len(COMMON), *y.shape))
        for i in range(SUBSTEPS):
            part = (i + 0.5) / SUBSTEPS
            speed = (1.0 - part) * v[:-1] + part * v[1:]
            drive, rise = (gain * one[:-1] for one in self.torque(constants, part))
            f = self.forces(y * ratio, speed, m, load, constants)
            decay = h * (radius * ratio * f.by_omega + body.damping) / body.inertia
            decay = np.clip(decay, -3.0, 50.0)
            small = np.abs(decay) < 1e-6
            divided = np.where(small, 1.0, decay)
            share = np.where(small, 1.0, -np.expm1(-decay) / divided)
            after = np.where(small, 0.0, (1.0 - share) / divided - 0.5 * share)
            k, left = h / body.inertia * share, np.exp(-decay)
            k_rate, drag = h**2 / body.inertia * after, radius * f.by_speed
            by_omega = left * by_omega
            by_speed = left * by_speed - drag * (k * (1.0 - part) - k_rate / self.step_size)
            by_next = left * by_next - drag * (k * part + k_rate / self.step_size)
            by_friction = left * by_friction - k * radius * f.by_friction
            by_radius = -radius * (f.value + f.by_omega * y * ratio)
            pull = np.stack([by_radius, drive, zero, rise, *(-radius * f.by_law)])
            by_constants = left * by_constants + k * pull
            by_constants[1] += k_rate * rise
            y = y + k * (drive - radius * f.value - body.damping * y)
            y += k_rate * (rise - drag * (v[1:] - v[:-1]) / self.step_size)
        return Steps(y, by_omega, by_speed, by_next, by_friction, by_constants)

    def _changes(self, states: FloatArray) -> FloatArray:
        """Changes of the logarithms of friction, over their scale."""
        return np.asarray(np.diff(states[:, self.axles + 1 :], axis=0) / self._walk)

    def acceleration(
        self, force: FloatArray, speed: FloatArray, constants: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Of the vehicle by the sum of its creep forces [m/s2], and that without its weight."""
        resisting = self.axles * davis(self.body.resistance, speed)[0]
        pulled = (force - resisting) / (self.mass * np.exp(constants[MASS]))
        return pulled - STANDARD_GRAVITY * (self.rows.grade + self.body.resistance.grade), pulled

    def _residuals(self, states: FloatArray, constants: FloatArray) -> Residuals:
        """Residuals of motion, shape (n - 1, axles + 1), and of what they are made."""
        a, h = self.axles, self.step_size
        steps, v = self._steps(states, constants), states[:, a]
        forces = self.forces(
            states[:, :a] * np.exp(constants[:a]),
            v[:, np.newaxis],
            states[:, a + 1 :],
            self.rows.load,
            constants,
        )
        total = (forces.value + self._taken_by_noise(states, constants, forces.value)).sum(axis=1)
        gain = self.acceleration(total, v, constants)[0]
        made = np.empty((self.count - 1, a + 1))
        made[:, :a] = (states[1:, :a] - steps.end) / self._wheel_noise
        made[:, a] = np.diff(v) - 0.5 * h * (gain[1:] + gain[:-1])
        made[:, a] /= self._vehicle_noise
        return made, steps, forces

    @cached_property
    def _noise(self) -> FloatArray:
        """Noise of each angular velocity [rad/s]: what is assumed, or less if the log has less.

        White noise has second differences of six times its variance; those of the motion itself
        are smaller in most rows.
        """
        second = np.abs(np.diff(self.rows.omega, 2, axis=0))
        known = np.where(np.isfinite(second), second, 0.0)
        seen = np.median(known, axis=0) / (MEDIAN_OF_NORMAL * np.sqrt(6.0))
        return np.asarray(np.minimum(seen, self.errors.wheel_speed / self.body.radius))

    def _taken_by_noise(
        self, states: FloatArray, constants: FloatArray, force: FloatArray
    ) -> FloatArray:
        """What noise of the wheel speeds takes from the mean force, which is curved [N].

        The states follow the measured speeds with most of their noise. Without this the curve's
        peak seems lower than it is, and friction and torque come out 1 % too large.
        """
        a = self.axles
        noise = np.where(self._weight[:, :a] > 0.0, self._noise, 0.0)
        turning = states[:, :a] * np.exp(constants[:a])
        around = self.element(constants).force(
            omega=np.stack([turning - noise, turning + noise]),
            speed=states[:, a : a + 1],
            axle_load=self.rows.load,
            friction_scale=np.exp(np.clip(states[:, a + 1 :], LOWEST, HIGHEST)),
        )
        return np.asarray(force - around.mean(axis=0))

    @cached_property
    def _wheel_noise(self) -> float:
        return float(self.errors.wheel_motion / self.body.radius * np.sqrt(self.step_size))

    @cached_property
    def _vehicle_noise(self) -> float:
        return float(self.errors.vehicle_motion * np.sqrt(self.step_size))

    def _cost(self, states: FloatArray, constants: FloatArray, parts: Residuals) -> float:
        """Negative logarithm of the probability density, up to a constant."""
        a = self.axles
        squares = [
            parts[0],
            self._weight * (states[:, : a + 1] - self._known),
            states[0, a + 1 :] / self.errors.friction,
            constants[self.unknown] / self.spread[self.unknown],
        ]
        walk = np.log1p(self._changes(states) ** 2 / DEGREES).sum()
        return float(0.5 * sum(np.sum(part**2) for part in squares) + 0.5 * (DEGREES + 1.0) * walk)

    def _blocks(self, states: FloatArray, constants: FloatArray, parts: Residuals) -> Blocks:
        """Normal matrix and gradient; a step of the walk weighs as its size tells."""
        a, n, h = self.axles, self.count, self.step_size
        motion, steps, forces = parts
        changes = self._changes(states)
        root = np.sqrt((DEGREES + 1.0) / (DEGREES + changes**2))
        residuals = np.hstack([motion, root * changes])
        size = 2 * a + 1
        now, then = np.zeros((n - 1, size, size)), np.zeros((n - 1, size, size))
        by_constants = np.zeros((n - 1, size, constants.size))
        i, noise = np.arange(a), self._wheel_noise
        now[:, i, i], now[:, i, a] = -steps.by_omega / noise, -steps.by_speed / noise
        now[:, i, a + 1 + i] = -steps.by_friction / noise
        then[:, i, i], then[:, i, a] = 1.0 / noise, -steps.by_next_speed / noise
        by_constants[:, i, i] = -steps.by_constants[0] / noise
        by_constants[:, :a, a:] = -np.moveaxis(steps.by_constants[1:], 0, -1) / noise
        ratio, v = np.exp(constants[:a]), states[:, a]
        pulled = self.acceleration(forces.value.sum(axis=1), v, constants)[1]
        k = 0.5 * h / self._vehicle_noise
        per_force = k / (self.mass * np.exp(constants[MASS]))
        resisting = a * davis(self.body.resistance, v)[1]
        for block, rows, sign in ((now, slice(None, -1), -1.0), (then, slice(1, None), 1.0)):
            block[:, a, :a] = -per_force * (forces.by_omega * ratio)[rows]
            along = (forces.by_speed.sum(axis=1) - resisting)[rows]
            block[:, a, a] = sign / self._vehicle_noise - per_force * along
            block[:, a, a + 1 :] = -per_force * forces.by_friction[rows]
            by_constants[:, a, :a] -= per_force * (forces.by_omega * states[:, :a] * ratio)[rows]
            by_constants[:, a, MASS] += k * pulled[rows]
            by_constants[:, a, SLOPE:] -= per_force * forces.by_law.sum(axis=-1).T[rows]
            block[:, a + 1 + i, a + 1 + i] = sign * root / self._walk
        by_constants = by_constants[..., self.unknown]
        now_t, then_t = now.transpose(0, 2, 1), then.transpose(0, 2, 1)
        diagonal, border = np.zeros((n, size, size)), np.zeros((n, size, self.unknown.size))
        gradient = np.zeros((n, size))
        for rows, block in ((slice(None, -1), now_t), (slice(1, None), then_t)):
            diagonal[rows] += block @ block.transpose(0, 2, 1)
            border[rows] += block @ by_constants
            gradient[rows] += (block @ residuals[..., np.newaxis])[..., 0]
        corner = np.einsum("nri,nrj->ij", by_constants, by_constants)
        weights = self.spread[self.unknown] ** -2
        slope = np.einsum("nri,nr->i", by_constants, residuals) + weights * constants[self.unknown]
        j = np.arange(a + 1)
        diagonal[:, j, j] += self._weight**2
        gradient[:, : a + 1] += self._weight**2 * (states[:, : a + 1] - self._known)
        j = np.arange(a + 1, size)
        diagonal[0, j, j] += self.errors.friction**-2
        gradient[0, a + 1 :] += states[0, a + 1 :] / self.errors.friction**2
        return Blocks(diagonal, now_t @ then, border, corner + np.diag(weights), gradient, slope)

    def _factor(self, blocks: Blocks, damping: float) -> FloatArray:
        """Cholesky factor of the rows' part of the normal matrix, in bands."""
        n, size, _ = blocks.diagonal.shape
        bands = np.zeros((2 * size, n, size))
        for column in range(size):
            for row in range(column, size):
                bands[row - column, :, column] = blocks.diagonal[:, row, column]
            for row in range(size):
                bands[size + row - column, :-1, column] = blocks.beside[:, column, row]
        bands[0] *= 1.0 + damping
        flat = bands.reshape(2 * size, -1)
        return np.asarray(cholesky_banded(flat, lower=True, overwrite_ab=True, check_finite=False))

    def solve(self, states: FloatArray, constants: FloatArray) -> None:
        """Find the most probable states and constants from a start, by damped Gauss-Newton."""
        parts = self._residuals(states, constants)
        damping, cost = 1e-3, self._cost(states, constants, parts)
        for self.iterations in range(1, ITERATIONS + 1):
            blocks = self._blocks(states, constants, parts)
            border = blocks.border.reshape(blocks.gradient.size, self.unknown.size)
            right = np.column_stack([border, blocks.gradient.ravel()])
            for _ in range(12):
                factor = self._factor(blocks, damping)
                solved = cho_solve_banded((factor, True), right, check_finite=False)
                inner, change = solved[:, :-1], solved[:, -1]
                corner = blocks.corner + damping * np.diag(np.diag(blocks.corner))
                changed = constants.copy()
                step = -np.linalg.solve(corner - border.T @ inner, blocks.slope - border.T @ change)
                there = states - (change + inner @ step).reshape(states.shape)
                friction = there[:, self.axles + 1 :]
                np.clip(friction, LOWEST, HIGHEST, out=friction)
                changed[self.unknown] += step
                tried = self._residuals(there, changed)
                new = self._cost(there, changed, tried)
                if new < cost + 1e-9:
                    break
                damping *= 5.0
            else:
                break
            states, constants, parts, fell, cost = there, changed, tried, cost - new, new
            damping = max(damping / 5.0, 1e-9)
            if fell < ENOUGH:
                break
        self.states, self.constants, self.cost = states, constants, cost

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance of the constants; 0 of those that are known."""
        parts = self._residuals(self.states, self.constants)
        blocks = self._blocks(self.states, self.constants, parts)
        border = blocks.border.reshape(blocks.gradient.size, self.unknown.size)
        inner = cho_solve_banded((self._factor(blocks, 0.0), True), border, check_finite=False)
        found = np.zeros((self.spread.size, self.spread.size))
        found[np.ix_(self.unknown, self.unknown)] = np.linalg.inv(blocks.corner - border.T @ inner)
        return found

    @property
    def innovations(self) -> FloatArray:
        """Measured less found angular velocities and speed, over their errors; shape as those."""
        a = self.axles
        wrong = self._weight * (self._known - self.states[:, : a + 1])
        return np.asarray(np.where(self._weight > 0.0, wrong, np.nan))
