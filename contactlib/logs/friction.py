"""Friction along the rails behind a log, by forward-backward sums over a grid of it.

Where a wheel uses little of its friction its motion gives a lower bound only, and friction may have
jumped. No normal distribution around the most probable values shows either; probabilities on a grid
do. All axles run on the same rails: each tells of a place when it gets there. What the axles in
front have cleaned is taken back, if the scenario's slip cleans rails.
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded
from scipy.sparse import csr_array

from contactlib.base.quantities import FloatArray
from contactlib.logs.motion import DEGREES, LogErrors, Motion, Rows, force_of
from contactlib.vehicle.track import Track

Parts: TypeAlias = "csr_array[np.float64, tuple[int, int]]"

BLOCK = 0.05  # over which means are taken [s]
GRID = np.linspace(-3.5, 1.3, 241)  # logarithms of the friction factor
NODES = GRID[::4]  # at which the law is evaluated; forces between them are linear
BETWEEN = np.maximum(1.0 - np.abs(GRID - NODES[:, np.newaxis]) / (NODES[1] - NODES[0]), 0.0)
TAILS = 8.0  # degrees of freedom of the distribution of a force
SAME_RAILS = 100.0  # mean way on rails of one kind [m]
OF_FORCE = 0.005  # standard deviation of a law's force, over that force: see `ForceElement`
SLIDING = 0.3  # rim speed below which a wheel may be locked: its brake may hold it [m/s]


class Means(NamedTuple):
    """Means over blocks of time, shape (blocks, axles), and the blocks' times, shape (blocks,)."""

    time: FloatArray
    omega: FloatArray
    speed: FloatArray
    load: FloatArray
    place: FloatArray
    known: FloatArray  # part of the rows that have the angular velocity

    @property
    def length(self) -> float:
        """Time from block to block [s]."""
        return float(self.time[1] - self.time[0])

    @property
    def rate(self) -> FloatArray:
        """Angular accelerations [rad/s2]."""
        return np.gradient(self.omega, self.length, axis=0)


def block_size(rows: Rows) -> int:
    """Number of rows in a block."""
    return max(1, round(BLOCK / float(rows.time[1] - rows.time[0])))


def block_means(rows: Rows, values: FloatArray) -> FloatArray:
    """Means over blocks of the values in the rows, (n, ...)."""
    each = block_size(rows)
    count = -(-len(values) // each)
    last = np.minimum(np.arange(count * each), len(values) - 1)
    return np.asarray(values[last].reshape(count, each, -1).mean(axis=1))


def means(rows: Rows, omega: FloatArray, speed: FloatArray, behind: FloatArray) -> Means:
    """Means of a log over blocks, with the angular velocities and the speed that are found."""
    return Means(
        time=block_means(rows, rows.time)[:, 0],
        omega=block_means(rows, omega),
        speed=block_means(rows, speed),
        load=block_means(rows, rows.load),
        place=block_means(rows, rows.distance) - behind,
        known=block_means(rows, np.isfinite(rows.omega)),
    )


def walk(errors: LogErrors, way: float) -> FloatArray:
    """Probabilities of the grid's values after a way [m], shape (from, to).

    Friction walks, or is on other rails altogether, as on average every `SAME_RAILS` metres.
    """
    jump = (GRID[:, np.newaxis] - GRID) / (errors.friction_change * np.sqrt(way))
    density = (1.0 + jump**2 / DEGREES) ** (-0.5 * (DEGREES + 1.0))
    other = level(errors)
    new = -np.expm1(-way / SAME_RAILS)
    return np.asarray((1.0 - new) * density / density.sum(axis=1, keepdims=True) + new * other)


def level(errors: LogErrors) -> FloatArray:
    """Probabilities of the grid's values where nothing is known."""
    density = np.exp(-0.5 * (GRID / errors.friction) ** 2)
    return np.asarray(density / density.sum())


def creep_forces(motion: Motion, at: Means, constants: FloatArray) -> FloatArray:
    """Creep force of each axle that its torque leaves [N], shape (blocks, axles)."""
    torque = block_means(motion.rows, motion.torque(constants)[0])
    return force_of(motion.body, torque, at.omega, at.rate, constants)


def on_grid(at: Means, constants: FloatArray) -> dict[str, FloatArray]:
    """Arguments of the contact at each friction of the nodes."""
    omega = at.omega * np.exp(constants[: at.omega.shape[1]])
    return {
        "omega": omega[..., np.newaxis],
        "speed": at.speed[..., np.newaxis],
        "load": at.load[..., np.newaxis],
        "friction": NODES,
    }


def force_errors(
    motion: Motion, at: Means, constants: FloatArray, radius_error: float = 0.0
) -> FloatArray:
    """Standard deviations of the forces at each friction [N], shape (blocks, axles, grid)."""
    body, errors, length = motion.body, motion.errors, at.length
    forces = motion.forces(**on_grid(at, constants), constants=constants)
    each = max(1.0, length / motion.step_size)
    # The speed's error is common to all axles and many blocks: together they add nothing.
    steps = errors.vehicle_speed * np.sqrt(motion.step_size)
    lasts, speed_error = 2.0 * steps / errors.vehicle_motion, np.sqrt(steps * errors.vehicle_motion)
    common = speed_error * np.sqrt(motion.axles * max(1.0, lasts / length))
    own = errors.wheel_speed / np.sqrt(each)
    turned = np.sqrt(own**2 + common**2 + (radius_error * at.speed) ** 2)
    by_speed = forces.by_omega * (turned / body.radius)[..., np.newaxis]
    noise = errors.wheel_speed / np.sqrt(2.0 * each) / length * body.inertia / body.radius**2
    # A rate is that of two blocks, not that of a block in which it changes by more than its noise.
    turning = np.zeros_like(at.rate)
    bend = np.abs(np.diff(at.rate, 2, axis=0)) * body.inertia / body.radius
    turning[1:-1] = 0.5 * np.maximum(bend - 2.0 * np.sqrt(5.0) * noise, 0.0)
    law = np.hypot(OF_FORCE * forces.value, by_speed)
    return np.asarray(np.hypot(np.hypot(noise, turning)[..., np.newaxis], law) @ BETWEEN)


def likelihoods(motion: Motion, at: Means, constants: FloatArray, unsure: FloatArray) -> FloatArray:
    """Logarithms of the probabilities of the forces at each friction: (blocks, axles, grid).

    The force of an axle is its torque less what turns it; the law gives that of each friction, with
    the standard deviation `unsure`.
    """
    given = creep_forces(motion, at, constants)[..., np.newaxis]
    there = on_grid(at, constants)
    forces = motion.element(constants).force(
        omega=there["omega"],
        speed=there["speed"],
        axle_load=there["load"],
        friction_scale=np.exp(NODES),
    )
    wrong = (given - forces @ BETWEEN) / unsure
    found = -0.5 * (TAILS + 1.0) * np.log1p(wrong**2 / TAILS)
    turns = np.abs(at.omega) * motion.body.radius > SLIDING
    tells = turns & (at.known > 0.5)
    return np.asarray(np.where(tells[..., np.newaxis], found, 0.0))


def free_speed(motion: Motion) -> FloatArray:
    """Speed by its sensor and by the torques, without the law, so that no friction is assumed."""
    rows, errors, a, known = motion.rows, motion.errors, motion.axles, motion.constants
    h, omega = motion.step_size, motion.states[:, :a]
    turning = np.gradient(omega, h, axis=0)
    force = force_of(motion.body, motion.torque(known)[0], omega, turning, known)
    rate = motion.acceleration(force.sum(axis=1), motion.states[:, a], known)[0]
    gained = 0.5 * h * (rate[1:] + rate[:-1])
    moves, sees = 1.0 / (errors.vehicle_motion**2 * h), errors.vehicle_speed**-2
    seen = np.isfinite(rows.speed)
    bands = np.zeros((2, motion.count))
    bands[0] = sees * seen
    bands[0, 1:] += moves
    bands[0, :-1] += moves
    bands[1, :-1] = -moves
    right = sees * np.where(seen, rows.speed, 0.0)
    right[1:] += moves * gained
    right[:-1] -= moves * gained
    return np.asarray(solveh_banded(bands, right, lower=True))


def first_guess(motion: Motion, behind: FloatArray) -> tuple[FloatArray, FloatArray]:
    """States and constants from which to search the most probable ones.

    Where little friction is used the creepage hardly depends on friction, which shows the radii.
    Dynamic programming then finds the most probable friction on the grid, axle by axle.
    """
    rows, body, errors, a = motion.rows, motion.body, motion.errors, motion.axles
    constants = np.zeros(motion.spread.size)
    omega, speed = filled(rows.omega), filled(rows.speed[:, np.newaxis])[:, 0]
    at = means(rows, omega, speed, behind)
    given = creep_forces(motion, at, constants)
    slips = np.linspace(-0.01, 0.01, 201)
    moving = np.maximum(np.abs(at.speed), body.element.minimum_speed)[..., np.newaxis]
    load = at.load[..., np.newaxis]
    omega_at = (1.0 + slips) * moving / body.radius
    steady = body.element.force(omega=omega_at, speed=moving, axle_load=load)
    creepage = slips[np.abs(steady - given[..., np.newaxis]).argmin(axis=-1)]
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.log(np.abs((1.0 + creepage) * at.speed / (at.omega * body.radius)))
    use = np.abs(given) / at.load
    free = (use <= np.maximum(np.quantile(use, 0.1, axis=0), 0.01)) & np.isfinite(ratio)
    sizes = np.linspace(-3.0, 3.0, 121)[:, np.newaxis, np.newaxis]
    choice = sizes * motion.spread[:a]
    width = 0.001 + np.hypot(errors.wheel_speed, errors.vehicle_speed) / np.maximum(
        np.abs(at.speed), 0.1
    )
    near = np.exp(-0.5 * ((np.where(free, ratio, np.inf) - choice) / width) ** 2) / width
    known = near.sum(axis=1) * np.exp(-0.5 * sizes[:, 0] ** 2)
    constants[:a] = choice[known.argmax(axis=0), 0, np.arange(a)]
    unsure = force_errors(motion, at, constants, radius_error=0.1 * float(motion.spread[0]))
    found = likelihoods(motion, at, constants, unsure)[..., ::4]
    way = np.maximum(np.abs(np.diff(at.place[:, 0])), 0.01)
    step = np.log(walk(errors, float(way.mean()))[::4, ::4])
    best = np.zeros(found.shape, dtype=np.uint8)
    total = found[0] - 0.5 * (NODES / errors.friction) ** 2
    for j in range(1, len(found)):
        every = total[..., np.newaxis] + step
        best[j] = every.argmax(axis=-2)
        total = every.max(axis=-2) + found[j]
    axles, k = np.arange(a), total.argmax(axis=-1)
    chosen = np.empty(at.omega.shape)
    for j in range(len(found) - 1, -1, -1):
        chosen[j] = NODES[k]
        k = best[j, axles, k]
    friction = np.repeat(chosen, block_size(rows), axis=0)[: motion.count]
    return np.column_stack([omega, speed, friction]), constants


def filled(values: FloatArray) -> FloatArray:
    """Columns whose nan are interpolated."""
    made = values.copy()
    places = np.arange(len(values))
    for column in made.T:
        known = np.isfinite(column)
        column[:] = np.interp(places, places[known], column[known]) if known.any() else 0.0
    return made


class Rails:
    """Sections of the rails that the axles of a log have met.

    Parameters
    ----------
    at : Means
        Motion of the axles.
    errors : LogErrors
        How friction changes.
    spacing : float
        Length of the sections [m].
    """

    def __init__(self, at: Means, errors: LogErrors, spacing: float) -> None:
        low, high = float(at.place.min()), float(at.place.max())
        count = max(2, int(np.ceil((high - low) / spacing)))
        self.edges = low + spacing * np.arange(count + 1)
        self.place = 0.5 * (self.edges[1:] + self.edges[:-1])
        self._step, self._first = walk(errors, spacing), level(errors)
        ends = np.vstack([at.place, 2.0 * at.place[-1] - at.place[-2]])
        self._parts = [self._sections(ends[:, axle]) for axle in range(at.place.shape[1])]

    def _sections(self, ends: FloatArray) -> Parts:
        """Which part of a block's way each section is, shape (sections, blocks)."""
        low, high = np.minimum(ends[:-1], ends[1:]), np.maximum(ends[:-1], ends[1:])
        last = self.place.size - 1
        first = np.clip(np.searchsorted(self.edges, low, side="right") - 1, 0, last)
        until = np.clip(np.searchsorted(self.edges, high, side="left") - 1, first, last)
        counts = until - first + 1
        blocks = np.repeat(np.arange(low.size), counts)
        starts = np.repeat(np.cumsum(counts) - counts, counts)
        sections = np.repeat(first, counts) + np.arange(blocks.size) - starts
        over = np.minimum(high[blocks], self.edges[sections + 1])
        over = over - np.maximum(low[blocks], self.edges[sections])
        way = np.maximum(high - low, 1e-9)[blocks]
        part = np.where(counts[blocks] == 1, 1.0, np.maximum(over, 0.0) / way)
        return csr_array((part, (sections, blocks)), shape=(last + 1, low.size))

    def mean_of(self, values: FloatArray, axle: int) -> FloatArray:
        """Means over the way in each section of an axle's values (blocks,); 0 where it was not."""
        parts = self._parts[axle]
        return np.asarray(parts @ values / np.maximum(parts.sum(axis=1), 1e-9))

    def collected(self, likelihood: FloatArray) -> FloatArray:
        """Sums of the likelihoods (blocks, axles, grid) of each axle in each section."""
        each = [np.asarray(part @ likelihood[:, i]) for i, part in enumerate(self._parts)]
        return np.stack(each, axis=1)

    def ahead(self, likelihood: FloatArray) -> FloatArray:
        """Probabilities in each section by what is before it and there, (n, ..., grid)."""
        found: FloatArray = np.exp(likelihood - likelihood.max(axis=-1, keepdims=True))
        now: FloatArray = self._first
        for j, like in enumerate(found):
            now = (now @ self._step if j else now) * like
            found[j] = now = now / now.sum(axis=-1, keepdims=True)
        return found

    def evidence(self, likelihood: FloatArray) -> FloatArray:
        """Logarithms of the probabilities of what is met in each section, given that before it."""
        before: FloatArray = self.ahead(likelihood)[:-1] @ self._step
        expected = np.concatenate([np.broadcast_to(self._first, (1, *before.shape[1:])), before])
        top = likelihood.max(axis=-1)
        met = expected * np.exp(likelihood - top[..., np.newaxis])
        return np.asarray(top + np.log(met.sum(axis=-1)))

    def smoothed(self, ahead: FloatArray) -> FloatArray:
        """Probabilities in each section by all of them, from those `ahead`: the backward pass."""
        found, expected = ahead.copy(), np.maximum(ahead @ self._step, 1e-300)
        back = np.ascontiguousarray(self._step.T)
        for j in range(len(found) - 2, -1, -1):
            found[j] *= (found[j + 1] / expected[j]) @ back
        return np.asarray(found / found.sum(axis=-1, keepdims=True))

    def drawn(self, ahead: FloatArray, rng: np.random.Generator) -> FloatArray:
        """A draw of the logarithms in all sections, from their probabilities `ahead` (n, grid)."""
        chances, draw = rng.random(len(ahead)), np.empty(len(ahead))
        weights = ahead[-1]
        for j in range(len(ahead) - 1, -1, -1):
            total = np.cumsum(weights)
            k = min(int(np.searchsorted(total, chances[j] * total[-1])), GRID.size - 1)
            draw[j] = GRID[k]
            if j:
                weights = ahead[j - 1] * self._step[:, k]
        return draw


def slip_works(motion: Motion, at: Means, rails: Rails) -> FloatArray:
    """Slip work per length of one rail up to and with each axle [J/m], shape (blocks, axles).

    As in runs: that of the axles in front in the same place, and the axle's own.
    """
    a, body = motion.axles, motion.body
    force = creep_forces(motion, at, motion.constants)
    slip = at.omega * body.radius * np.exp(motion.constants[:a]) - at.speed
    pace = np.maximum(np.abs(at.speed), body.element.minimum_speed)
    own = 0.5 * np.maximum(force * slip, 0.0) / pace
    done, works = np.zeros(rails.place.size), np.empty_like(own)
    order = range(a) if at.place[-1, 0] >= at.place[0, 0] else range(a - 1, -1, -1)
    for axle in order:
        works[:, axle] = own[:, axle] + np.interp(at.place[:, axle], rails.place, done)
        done += rails.mean_of(own[:, axle], axle)
    return works


def cleaned_places(track: Track, work: FloatArray) -> tuple[NDArray[np.intp], FloatArray]:
    """Where on the grid the friction is that slip has cleaned, from each before.

    Parameters
    ----------
    track : Track
        Its cleaning and recovered factor.
    work : ndarray, shape (blocks, axles)
        Slip work per length of one rail that has been done there [J/m].

    Returns
    -------
    tuple of ndarray, shape (blocks, axles, grid)
        The value below, and the part of the way to the next.
    """
    factor, done = np.broadcast_arrays(np.exp(GRID), work[..., np.newaxis])
    met = (np.log(track.cleaned(factor, done)) - GRID[0]) / (GRID[1] - GRID[0])
    low = np.clip(met.astype(int), 0, GRID.size - 2)
    return low, np.clip(met - low, 0.0, 1.0)


def cleaned_before(
    places: tuple[NDArray[np.intp], FloatArray], likelihood: FloatArray
) -> FloatArray:
    """Likelihoods of the friction before slip cleaned the rails, from those of what was met."""
    low, part = places
    below, above = (np.take_along_axis(likelihood, low + i, axis=-1) for i in (0, 1))
    return np.asarray((1.0 - part) * below + part * above)
