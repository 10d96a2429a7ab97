"""The largest creep force that a contact can transmit, also for many wheelsets row by row.

A search in every row would take longer than stepping the wheelsets. While friction and slope stay
at one of the levels of their track, the largest force is a smooth function of speed and load, and
does not depend on the speed if friction does not fall with slip speed. So it is searched at a few
speeds and loads of an octave and interpolated. Only on ramps of friction or slope, and where the
octave's polynomial has not converged, it is searched in every row.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike, NDArray

from contactlib import kernel
from contactlib.base.quantities import FloatArray, checked, common_shape
from contactlib.element.force_element import ForceElement
from contactlib.vehicle.drivetrain import Drivetrain
from contactlib.vehicle.track import Profile, Track

# Speed at which the force is that of standstill to 1e-9 [m/s]; at less, a search would not end.
SLOWEST = 1e-6
NODES = 10  # speeds in an octave
OCTAVES = (-4, 9)  # of the speed, lowest and highest: from 2**(e - 1) up to 2**e [m/s]
LOAD_OCTAVES = (-3, 2)  # likewise, of the load over the nominal one times
CENTRE = 0.7  # so that a load near the nominal one stays in one octave
CONVERGED = 1e-8  # of the force: limit of the last two terms of its Chebyshev series
MAX_LEVELS = 32  # of a track; further levels count as ramps

_PLACES = chebyshev.chebpts1(NODES)  # of the nodes in the octave, -1 to 1
_POWERS = np.linalg.inv(np.vander(_PLACES, increasing=True))  # from values to coefficients


def available_force(
    element: ForceElement,
    *,
    speed: ArrayLike,
    axle_load: ArrayLike | None = None,
    friction_scale: ArrayLike = 1.0,
    other_friction_scale: ArrayLike | None = None,
) -> FloatArray:
    """Largest |creep force| over all creepages at given speeds [N]; arguments broadcast.

    If friction falls with slip speed, the peak is lower at higher vehicle speed, where its creepage
    means more slip speed. The peak is the same in braking and driving, unless friction falls with
    temperature: then it is higher in driving by less than 1e-3, as a faster rim carries more heat
    away, and the result is that of driving.

    Parameters
    ----------
    element : ForceElement
        The contact.
    speed : array_like
        Forward velocity [m/s].
    axle_load : array_like, optional
        Load of the contact [N]. Default: its nominal load.
    friction_scale : array_like, optional
        Factor on both friction coefficients [1]. Default: 1.
    other_friction_scale : array_like, optional
        Friction scale of the other wheel, if the element is the contact of a whole wheelset [1].
        Each wheel has half of the load and both have the same creepage, so at most one of them is
        at its own peak. Default: `friction_scale`.

    Returns
    -------
    ndarray
        Forces of the common shape of the arguments; the relative error is 1e-9, and 1e-8 for a law
        that rises forever.

    Raises
    ------
    ValueError
        If a value is not finite or out of range, such as a negative load.

    Examples
    --------
    >>> import contactlib as cl
    >>> locomotive = cl.load_model("locomotive.toml").wheelset.element
    >>> (available_force(locomotive, speed=[5.0, 20.0], friction_scale=[1.0, 0.5]) / 1e3).round(2)
    array([52.98, 28.96])
    """
    limits = kernel.force_input_limits()
    given = {
        "speed": speed,
        "axle_load": element.axle_load if axle_load is None else axle_load,
        "friction_scale": friction_scale,
    }
    arrays = {name: checked(name, value, limits[name]) for name, value in given.items()}
    other = friction_scale if other_friction_scale is None else other_friction_scale
    arrays["other_friction_scale"] = checked(
        "other_friction_scale", other, limits["friction_scale"]
    )
    shape = common_shape(arrays)
    if not element.friction.falls_with_slip_speed:
        arrays["speed"] = np.ones(())  # the result does not depend on it
    arrays["speed"] = np.maximum(np.abs(arrays["speed"]), SLOWEST)
    rows = np.stack([np.broadcast_to(array, shape) for array in arrays.values()], axis=-1)
    cases, place = np.unique(rows.reshape(-1, 4), axis=0, return_inverse=True)
    return np.asarray(_largest(element, cases)[place].reshape(rows.shape[:-1]))


def _largest(element: ForceElement, cases: FloatArray) -> FloatArray:
    """Largest force of each case, a row (speed, load, friction scales of the two wheels)."""
    return np.array(
        [
            kernel.NativeCurve(
                element.native, None, speed=speed, normal_load=[load] * 2, friction_scale=scales
            ).peak()[1]
            for speed, load, *scales in cases.tolist()
        ]
    )


class AvailableForce:
    """Interpolates the largest force of each wheelset, with common polynomials for equal ones.

    Results are right to 1e-8 and do not depend on the other wheelsets.

    Parameters
    ----------
    drivetrains : sequence of Drivetrain
        One for each wheelset; friction must fall with slip speed for all of them or for none.
    tracks : sequence of Track
        One for each wheelset.
    loaded : bool, optional
        Whether loads differ from the nominal ones. Default: they do not.
    """

    def __init__(
        self, drivetrains: Sequence[Drivetrain], tracks: Sequence[Track], *, loaded: bool = False
    ) -> None:
        self._falls = drivetrains[0].wheelset.element.friction.falls_with_slip_speed
        self._loaded = loaded
        # Octaves of the speed times octaves of the load; a variable that does not count has one.
        self._octaves = _count(OCTAVES) if self._falls else 1
        self._load_octaves = _count(LOAD_OCTAVES) if loaded else 1
        bodies: dict[Any, int] = {}
        cases: dict[tuple[int, float, float, float], int] = {}  # a body at a level
        levels = {id(track): track_levels(track) for track in tracks}
        self._bodies: list[Drivetrain] = []
        self._body = np.empty(len(drivetrains), dtype=np.intp)  # of each wheelset
        count = max(map(len, levels.values()))
        self._level = np.full((count, 3, len(drivetrains)), np.nan)
        self._case = np.zeros((count, len(drivetrains)), dtype=np.intp)
        for i, (train, track) in enumerate(zip(drivetrains, tracks, strict=True)):
            element = train.wheelset.element
            key = id(element.table), *element.parameters.values()
            if key not in bodies:
                bodies[key] = len(bodies)
                self._bodies.append(train)
            self._body[i] = bodies[key]
            for j, level in enumerate(levels[id(track)]):
                self._level[j, :, i] = level
                self._case[j, i] = cases.setdefault((bodies[key], *level), len(cases))
        self._fleet = kernel.NativeFleet([body.member() for body in self._bodies])
        self._nominal = np.array([body.wheelset.element.axle_load for body in self._bodies])
        self._of_case = np.array(list(cases))
        # One column for each octave of each case; nan if its polynomial has not converged.
        columns = len(cases) * self._octaves * self._load_octaves
        nodes = NODES if loaded else 1, NODES if self._falls else 1
        self._powers = np.zeros((*nodes, columns))  # of the load, of the speed
        self._known = np.zeros(columns, dtype=np.bool_)

    def __call__(
        self,
        speed: FloatArray,
        left: FloatArray,
        right: FloatArray,
        slope: FloatArray,
        load: FloatArray,
    ) -> FloatArray:
        """Largest forces [N], of shape (rows, n) as all arguments.

        These are speeds [m/s], factors on friction under either wheel and on the slope [1], and
        loads of both wheels together [N].
        """
        speed, column = np.maximum(np.abs(speed), SLOWEST), np.full(speed.shape, -1)
        for (on_left, on_right, on_slope), case in zip(self._level, self._case, strict=True):
            on = (left == on_left) & (right == on_right) & (slope == on_slope)
            np.copyto(column, case, where=on)
        place, load_place = np.zeros((len(speed), 1)), np.zeros((1, 1))
        if self._falls:
            column, place = _in_octaves(column, speed, OCTAVES)
        if self._loaded:
            part = CENTRE * (load / self._nominal[self._body])
            column, load_place = _in_octaves(column, part, LOAD_OCTAVES)
        new = column[~self._known[column] & (column >= 0)]
        if new.size:
            self._learn(np.unique(new))
        # Most wheelsets keep the polynomial of the first row.
        powers = self._powers[:, :, np.newaxis, column[0]]
        forces = _horner(_horner(powers, load_place), place)
        row, member = np.nonzero(column != column[0])
        there = [np.broadcast_to(x, speed.shape)[row, member] for x in (load_place, place)]
        powers = _horner(self._powers[:, :, column[row, member]], there[0])
        forces[row, member] = _horner(powers, there[1])
        # By wheelset, as a search begins at the one before.
        member, row = np.nonzero(((column < 0) | np.isnan(forces)).T)
        if row.size:
            given = (signal[row, member] for signal in (speed, left, right, slope, load))
            forces[row, member] = self._search(self._body[member], *given)
        return forces

    def _learn(self, columns: NDArray[np.intp]) -> None:
        """Fit the polynomials of new columns."""
        rest, load_octave = np.divmod(columns, self._load_octaves)
        case, octave = np.divmod(rest, self._octaves)
        body = self._of_case[case, 0].astype(np.intp)
        # Without an influence of the speed, any [m/s].
        speed = _nodes(octave, OCTAVES) if self._falls else np.ones((1, 1))
        part = _nodes(load_octave, LOAD_OCTAVES) / CENTRE if self._loaded else np.ones((1, 1))
        load = (self._nominal[body] * part)[:, np.newaxis]
        shape = *self._powers.shape[:2], columns.size
        given = [
            np.broadcast_to(x, shape).ravel() for x in (speed, *self._of_case[case, 1:].T, load)
        ]
        values = self._search(np.broadcast_to(body, shape).ravel(), *given).reshape(shape)
        by_load, bad = _fit(values)
        _, also_bad = _fit(values.swapaxes(0, 1))
        powers = _fit(by_load.swapaxes(0, 1))[0].swapaxes(0, 1)
        powers[:, :, bad.any(axis=0) | also_bad.any(axis=0)] = np.nan
        self._powers[:, :, columns], self._known[columns] = powers, True

    def _search(
        self,
        body: NDArray[np.intp],
        speed: FloatArray,
        left: FloatArray,
        right: FloatArray,
        slope: FloatArray,
        load: FloatArray,
    ) -> FloatArray:
        """Largest forces for arrays of bodies, and of what `__call__` takes."""
        inputs = np.zeros(speed.size, kernel.drivetrain_dtype("input"))
        inputs["load_left"] = inputs["load_right"] = 0.5 * load
        inputs["friction_left"], inputs["friction_right"] = left, right
        inputs["slope"] = slope
        return self._fleet.peak(inputs, speed, body)


def _count(octaves: tuple[int, int]) -> int:
    return 1 + octaves[1] - octaves[0]


def _nodes(octave: NDArray[np.intp], octaves: tuple[int, int]) -> FloatArray:
    """Values at the nodes of octaves that are counted from the lowest, shape (nodes, n)."""
    return np.ldexp(0.25 * (_PLACES + 3.0)[:, np.newaxis], octave + octaves[0])


def _in_octaves(
    column: NDArray[np.intp], value: FloatArray, octaves: tuple[int, int]
) -> tuple[NDArray[np.intp], FloatArray]:
    """Split columns into one for each octave, -1 outside; and places in the octave, -1 to 1."""
    mantissa, exponent = np.frexp(value)
    octave, count = exponent - octaves[0], _count(octaves)
    outside = (octave < 0) | (octave >= count) | (mantissa == 0.0) | (column < 0)
    return np.where(outside, -1, column * count + octave), 4.0 * mantissa - 3.0


def _fit(values: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Polynomials along the first axis through values at nodes, and which have not converged."""
    if len(values) == 1:
        return values, np.zeros(values.shape[1:], dtype=np.bool_)
    powers = np.zeros(values.shape)
    for weights, value in zip(_POWERS.T, values, strict=True):
        powers += weights.reshape(-1, *[1] * value.ndim) * value
    highest = np.abs(powers[-2]) / 2.0 ** (NODES - 3) + np.abs(powers[-1]) / 2.0 ** (NODES - 2)
    return powers, highest > CONVERGED * values[0]


def _horner(powers: FloatArray, place: FloatArray) -> FloatArray:
    value = np.broadcast_to(powers[-1], np.broadcast_shapes(powers.shape[1:], place.shape)).copy()
    for power in powers[-2::-1]:
        value *= place
        value += power
    return value


def track_levels(track: Track) -> list[tuple[float, float, float]]:
    """Constant factors on friction under the left and the right wheel and on the slope [1]."""
    if track.peaks is not None:  # the speed changes the factors
        return [(1.0, 1.0, 1.0)]
    left, right = _levels(track.friction_left), track.friction_right
    sides = (
        [(v + v, start, end) for v, start, end in left]
        if right is None
        else _both(left, _levels(right))
    )
    levels = {values for values, _, _ in _both(sides, _levels(track.slope))}
    times = {value for (value,), _, _ in _levels(track.friction_over_time)}
    return sorted({(a * time, b * time, slope) for a, b, slope in levels for time in times})[
        :MAX_LEVELS
    ]


Stretch = tuple[tuple[float, ...], float, float]  # values that hold from a start to an end


def _levels(profile: Profile) -> list[Stretch]:
    """Level stretches of a profile."""
    at, value = (-math.inf, *profile.at, math.inf), profile.value
    steps = pairwise((value[0], *value, value[-1]))
    return [((a,), *ends) for (a, b), ends in zip(steps, pairwise(at), strict=True) if a == b]


def _both(first: list[Stretch], second: list[Stretch]) -> list[Stretch]:
    """Stretches on which both hold their values; both lists are in the order of the track."""
    pieces, i, j = [], 0, 0
    while i < len(first) and j < len(second):
        (a, s, e), (b, t, f) = first[i], second[j]
        if max(s, t) < min(e, f):
            pieces.append(((*a, *b), max(s, t), min(e, f)))
        i, j = (i + 1, j) if e < f else (i, j + 1)
    return pieces
