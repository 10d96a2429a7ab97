"""Most probable motion behind a log: states, friction under each axle, and constants.

Unknown are the angular velocity of each axle, the speed of the vehicle and the logarithm of the
friction factor under each axle in every row, and constants: the logarithms of the wheels' radii
over the nominal one, and of the torque over the one in the log. A row follows from the one before
by the equations of motion up to a noise. The angular velocity makes exponential steps whose noise
is added after them, so the density of a row has no determinant, as that of an implicit step has.
The friction walks at random over the way, with steps of Student's distribution: most are small,
some are jumps. Gauss-Newton finds the most probable values. Its normal matrix is banded, with a
border for the constants.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, NamedTuple

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded

from contactlib.base.quantities import FloatArray, Parameters, Quantity
from contactlib.base.units import STANDARD_GRAVITY
from contactlib.files.scenario import Scenario
from contactlib.vehicle.wheelset import Wheelset, davis

DEGREES = 3.0  # of freedom of Student's distribution
LOWEST, HIGHEST = -5.0, 2.0  # logarithms of the friction factor that are possible
DIFFERENCE = 1e-5  # for derivatives [m/s], and as a share of friction
SUBSTEPS = 2  # from row to row
ITERATIONS, ENOUGH = 60, 1e-3  # of Gauss-Newton; fall of the cost that ends it
SPREAD = Quantity("1", above=0.0, at_most=1.0)
NOISE = Quantity("m/s", above=0.0, at_most=10.0)


@dataclass(frozen=True, kw_only=True)
class LogErrors(Parameters):
    """Standard deviations of what a log shows, of the model, and of what is known before.

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
    radius : float, optional
        Spread of each wheel's radius over the nominal one [1].
    torque : float, optional
        Spread of the torque over that in the log, which is the same at all axles [1].

    Raises
    ------
    ValueError
        If a value is out of range.
    """

    wheel_speed: Annotated[float, NOISE] = 0.01
    vehicle_speed: Annotated[float, NOISE] = 0.02
    wheel_motion: Annotated[float, NOISE] = 1.5
    vehicle_motion: Annotated[float, NOISE] = 0.005
    friction_change: Annotated[float, SPREAD] = 0.07
    friction: Annotated[float, SPREAD] = 0.7
    radius: Annotated[float, SPREAD] = 0.005
    torque: Annotated[float, SPREAD] = 0.02


def force_of(
    body: Wheelset,
    torque: FloatArray,
    omega: FloatArray,
    rate: FloatArray,
    constants: FloatArray | None = None,
) -> FloatArray:
    """Creep force that a torque leaves, (T - J domega/dt - b omega)/r [N], (n, axles).

    The constants are the logarithms of the radii over the nominal one and of the torque over that
    of the log. Default: zero.
    """
    radius, gain = np.array(body.radius), 1.0
    if constants is not None:
        radius, gain = body.radius * np.exp(constants[:-1]), np.exp(constants[-1])
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
    """Creep forces [N], and their derivatives by angular velocity, speed and log friction."""

    value: FloatArray
    by_omega: FloatArray
    by_speed: FloatArray
    by_friction: FloatArray


class Steps(NamedTuple):
    """Angular velocities at the end of each interval, and their derivatives."""

    end: FloatArray
    by_omega: FloatArray
    by_speed: FloatArray
    by_next_speed: FloatArray
    by_friction: FloatArray
    by_radius: FloatArray
    by_torque: FloatArray


class Blocks(NamedTuple):
    """Normal matrix in blocks of rows and constants, and the gradient of the cost."""

    diagonal: FloatArray
    beside: FloatArray
    border: FloatArray
    corner: FloatArray
    gradient: FloatArray
    slope: FloatArray


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

    Attributes
    ----------
    states : ndarray, shape (n, 2 axles + 1)
        Angular velocities, speed and logarithms of friction.
    constants : ndarray, shape (axles + 1,)
        Logarithms of the radii over the nominal one and of the torque over that of the log.
    cost : float
        Negative logarithm of their probability density, up to a constant.
    """

    def __init__(self, scenario: Scenario, rows: Rows, errors: LogErrors) -> None:
        body = scenario.drivetrain.wheelset
        if body.mass is None:
            raise ValueError("scenario: a roller rig holds its speed; a log needs a free vehicle")
        self.body, self.rows, self.errors = body, rows, errors
        self.count, self.axles = rows.omega.shape
        self.mass = body.mass * self.axles
        self.step_size = float(rows.time[1] - rows.time[0])
        way = np.maximum(np.abs(np.diff(rows.distance)), 0.01)
        self._walk = errors.friction_change * np.sqrt(way)[:, np.newaxis]
        known = np.column_stack([rows.omega, rows.speed])
        each = [body.radius / errors.wheel_speed] * self.axles + [1.0 / errors.vehicle_speed]
        self._weight = np.where(np.isnan(known), 0.0, each)
        self._known = np.nan_to_num(known)
        self._spread = np.array([errors.radius] * self.axles + [errors.torque])

    def forces(
        self, omega: FloatArray, speed: FloatArray, friction: FloatArray, load: FloatArray
    ) -> Forces:
        """Creep forces of axles; arguments broadcast."""
        o, v, m, p = np.broadcast_arrays(omega, speed, friction, load)
        scale = np.exp(np.clip(m, LOWEST, HIGHEST))
        turned, moved = DIFFERENCE / self.body.radius, DIFFERENCE
        f, by_omega, by_speed, by_friction = self.body.element.force(
            omega=np.stack([o, o + turned, o, o]),
            speed=np.stack([v, v, v + moved, v]),
            axle_load=np.stack([p] * 4),
            friction_scale=np.stack([scale, scale, scale, scale * (1.0 + DIFFERENCE)]),
        )
        return Forces(
            f, (by_omega - f) / turned, (by_speed - f) / moved, (by_friction - f) / DIFFERENCE
        )

    def _steps(self, states: FloatArray, constants: FloatArray) -> Steps:
        """Angular velocities after each interval, by exponential steps."""
        a, body, h = self.axles, self.body, self.step_size / SUBSTEPS
        y, v, m = states[:-1, :a], states[:, a : a + 1], states[:-1, a + 1 :]
        ratio, gain = np.exp(constants[:a]), np.exp(constants[a])
        radius, torque, load = body.radius * ratio, self.rows.torque, self.rows.load[:-1]
        by_omega, zero = np.ones_like(y), np.zeros_like(y)
        by_speed, by_next, by_friction, by_radius, by_torque = zero, zero, zero, zero, zero
        for i in range(SUBSTEPS):
            part = (i + 0.5) / SUBSTEPS
            speed = (1.0 - part) * v[:-1] + part * v[1:]
            drive = gain * ((1.0 - part) * torque[:-1] + part * torque[1:])
            f = self.forces(y * ratio, speed, m, load)
            decay = h * (radius * ratio * f.by_omega + body.damping) / body.inertia
            decay = np.clip(decay, -3.0, 50.0)
            small = np.abs(decay) < 1e-6
            share = np.where(small, 1.0, -np.expm1(-decay) / np.where(small, 1.0, decay))
            k, left = h / body.inertia * share, np.exp(-decay)
            by_omega = left * by_omega
            by_speed = left * by_speed - k * radius * f.by_speed * (1.0 - part)
            by_next = left * by_next - k * radius * f.by_speed * part
            by_friction = left * by_friction - k * radius * f.by_friction
            by_radius = left * by_radius - k * radius * (f.value + f.by_omega * y * ratio)
            by_torque = left * by_torque + k * drive
            y = y + k * (drive - radius * f.value - body.damping * y)
        return Steps(y, by_omega, by_speed, by_next, by_friction, by_radius, by_torque)

    def _changes(self, states: FloatArray) -> FloatArray:
        """Changes of the logarithms of friction, over their scale."""
        return np.asarray(np.diff(states[:, self.axles + 1 :], axis=0) / self._walk)

    def resistance(self, speed: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Force against the vehicle [N], and its derivative."""
        own = self.body.resistance
        force, slope = davis(own, speed)
        weight = self.mass * STANDARD_GRAVITY * (self.rows.grade + own.grade)
        return self.axles * force + weight, self.axles * slope

    def _residuals(
        self, states: FloatArray, constants: FloatArray
    ) -> tuple[FloatArray, Steps, Forces]:
        """Residuals of motion, shape (n - 1, axles + 1), and of what they are made."""
        a, h = self.axles, self.step_size
        steps, v = self._steps(states, constants), states[:, a]
        forces = self.forces(
            states[:, :a] * np.exp(constants[:a]),
            v[:, np.newaxis],
            states[:, a + 1 :],
            self.rows.load,
        )
        net = forces.value.sum(axis=1) - self.resistance(v)[0]
        made = np.empty((self.count - 1, a + 1))
        made[:, :a] = (states[1:, :a] - steps.end) / self._wheel_noise
        made[:, a] = np.diff(v) - 0.5 * h / self.mass * (net[1:] + net[:-1])
        made[:, a] /= self._vehicle_noise
        return made, steps, forces

    @cached_property
    def _wheel_noise(self) -> float:
        return float(self.errors.wheel_motion / self.body.radius * np.sqrt(self.step_size))

    @cached_property
    def _vehicle_noise(self) -> float:
        return float(self.errors.vehicle_motion * np.sqrt(self.step_size))

    def _cost(self, states: FloatArray, constants: FloatArray) -> float:
        """Negative logarithm of the probability density, up to a constant."""
        a = self.axles
        squares = [
            self._residuals(states, constants)[0],
            self._weight * (states[:, : a + 1] - self._known),
            states[0, a + 1 :] / self.errors.friction,
            constants / self._spread,
        ]
        walk = np.log1p(self._changes(states) ** 2 / DEGREES).sum()
        return float(0.5 * sum(np.sum(part**2) for part in squares) + 0.5 * (DEGREES + 1.0) * walk)

    def _blocks(self, states: FloatArray, constants: FloatArray) -> Blocks:
        """Normal matrix and gradient; a step of the walk weighs as its size tells."""
        a, n, h = self.axles, self.count, self.step_size
        motion, steps, forces = self._residuals(states, constants)
        changes = self._changes(states)
        root = np.sqrt((DEGREES + 1.0) / (DEGREES + changes**2))
        residuals = np.hstack([motion, root * changes])
        size = 2 * a + 1
        now, then = np.zeros((n - 1, size, size)), np.zeros((n - 1, size, size))
        by_constants = np.zeros((n - 1, size, a + 1))
        i, noise = np.arange(a), self._wheel_noise
        now[:, i, i], now[:, i, a] = -steps.by_omega / noise, -steps.by_speed / noise
        now[:, i, a + 1 + i] = -steps.by_friction / noise
        then[:, i, i], then[:, i, a] = 1.0 / noise, -steps.by_next_speed / noise
        by_constants[:, i, i] = -steps.by_radius / noise
        by_constants[:, i, a] = -steps.by_torque / noise
        ratio, k = np.exp(constants[:a]), 0.5 * h / self.mass / self._vehicle_noise
        resisting = self.resistance(states[:, a])[1]
        for block, rows, sign in ((now, slice(None, -1), -1.0), (then, slice(1, None), 1.0)):
            block[:, a, :a] = -k * (forces.by_omega * ratio)[rows]
            along = (forces.by_speed.sum(axis=1) - resisting)[rows]
            block[:, a, a] = sign / self._vehicle_noise - k * along
            block[:, a, a + 1 :] = -k * forces.by_friction[rows]
            by_constants[:, a, :a] -= k * (forces.by_omega * states[:, :a] * ratio)[rows]
            block[:, a + 1 + i, a + 1 + i] = sign * root / self._walk
        now_t, then_t = now.transpose(0, 2, 1), then.transpose(0, 2, 1)
        diagonal, border = np.zeros((n, size, size)), np.zeros((n, size, a + 1))
        gradient = np.zeros((n, size))
        for rows, block in ((slice(None, -1), now_t), (slice(1, None), then_t)):
            diagonal[rows] += block @ block.transpose(0, 2, 1)
            border[rows] += block @ by_constants
            gradient[rows] += (block @ residuals[..., np.newaxis])[..., 0]
        corner = np.einsum("nri,nrj->ij", by_constants, by_constants)
        slope = np.einsum("nri,nr->i", by_constants, residuals) + constants / self._spread**2
        j = np.arange(a + 1)
        diagonal[:, j, j] += self._weight**2
        gradient[:, : a + 1] += self._weight**2 * (states[:, : a + 1] - self._known)
        j = np.arange(a + 1, size)
        diagonal[0, j, j] += self.errors.friction**-2
        gradient[0, a + 1 :] += states[0, a + 1 :] / self.errors.friction**2
        return Blocks(
            diagonal, now_t @ then, border, corner + np.diag(self._spread**-2), gradient, slope
        )

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
        damping, cost = 1e-3, self._cost(states, constants)
        for self.iterations in range(1, ITERATIONS + 1):
            blocks = self._blocks(states, constants)
            border = blocks.border.reshape(-1, self.axles + 1)
            right = np.column_stack([border, blocks.gradient.ravel()])
            for _ in range(12):
                factor = self._factor(blocks, damping)
                solved = cho_solve_banded((factor, True), right, check_finite=False)
                inner, change = solved[:, :-1], solved[:, -1]
                corner = blocks.corner + damping * np.diag(np.diag(blocks.corner))
                step = -np.linalg.solve(corner - border.T @ inner, blocks.slope - border.T @ change)
                there = states - (change + inner @ step).reshape(states.shape)
                friction = there[:, self.axles + 1 :]
                np.clip(friction, LOWEST, HIGHEST, out=friction)
                new = self._cost(there, constants + step)
                if new < cost + 1e-9:
                    break
                damping *= 5.0
            else:
                break
            states, constants, fell, cost = there, constants + step, cost - new, new
            damping = max(damping / 5.0, 1e-9)
            if fell < ENOUGH:
                break
        self.states, self.constants, self.cost = states, constants, cost

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance of the constants."""
        blocks = self._blocks(self.states, self.constants)
        border = blocks.border.reshape(-1, self.axles + 1)
        inner = cho_solve_banded((self._factor(blocks, 0.0), True), border, check_finite=False)
        return np.asarray(np.linalg.inv(blocks.corner - border.T @ inner))

    @property
    def innovations(self) -> FloatArray:
        """Measured less found angular velocities and speed, over their errors; shape as those."""
        a = self.axles
        wrong = self._weight * (self._known - self.states[:, : a + 1])
        return np.asarray(np.where(self._weight > 0.0, wrong, np.nan))
