"""The largest creep force of many wheelsets, row by row, each with its own contact and track.

To look for it in every row would take longer than to step the wheelsets. Where friction stays at
one of the levels of its track, the largest force is a smooth function of the speed alone, and of
nothing if friction does not fall with slip speed: so it is looked for at a few speeds of an octave,
and interpolated. It is looked for in every row on ramps of friction, and where the octave's
polynomial has not converged.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from contactlib import kernel
from contactlib.drivetrain import Drivetrain
from contactlib.parameters import FloatArray
from contactlib.peak_force import largest_force
from contactlib.profile import Profile
from contactlib.track import Track

NODES = 10  # speeds of an octave
OCTAVES = (-4, 9)  # lowest and highest: from 2**(e - 1) up to 2**e [m/s]
CONVERGED = 3e-9  # of the force, what the last two terms of its Chebyshev series are below
MOST_LEVELS = 32  # of friction; those beyond it count as ramps

_PLACES = chebyshev.chebpts1(NODES)  # of the nodes in the octave, -1 to 1
_POWERS = np.linalg.inv(np.vander(_PLACES, increasing=True))  # from values to coefficients


class AvailableForce:
    """Interpolates the largest force of each wheelset; what many share is worked out once.

    Results are right to 1e-8, and do not depend on the other wheelsets.

    Parameters
    ----------
    drivetrains : sequence of Drivetrain
        One for each wheelset, which all fall with slip speed or do not.
    tracks : sequence of Track
        One for each.
    """

    def __init__(self, drivetrains: Sequence[Drivetrain], tracks: Sequence[Track]) -> None:
        self._falls = drivetrains[0].wheelset.element.friction.falls_with_slip_speed
        kinds: dict[Any, int] = {}
        self._kind = np.empty(len(drivetrains), dtype=np.intp)  # of each wheelset
        self._bodies: list[Drivetrain] = []  # one of each kind
        levels: list[list[tuple[float, float]]] = []
        seen: dict[int, list[tuple[float, float]]] = {}
        for i, (body, track) in enumerate(zip(drivetrains, tracks, strict=True)):
            if id(track) not in seen:
                seen[id(track)] = friction_levels(track)
            found = seen[id(track)]
            element = body.wheelset.element
            key = (id(element.table), *element.parameters.values(), *found)
            if key not in kinds:
                kinds[key] = len(kinds)
                self._bodies.append(body)
                levels.append(found)
            self._kind[i] = kinds[key]
        self._levels = np.full((max(map(len, levels)), 2, len(levels)), np.nan)
        for kind, found in enumerate(levels):
            self._levels[: len(found), :, kind] = found
        octaves = 1 + OCTAVES[1] - OCTAVES[0] if self._falls else 1
        self._powers = np.zeros((NODES if self._falls else 1, octaves, *self._levels.shape[::2]))
        self._known = np.zeros((octaves, len(levels)), dtype=np.bool_)

    def __call__(self, speed: FloatArray, left: FloatArray, right: FloatArray) -> FloatArray:
        """Largest forces [N] at speeds [m/s] and friction factors [1], all of shape (rows, n)."""
        level = np.full(speed.shape, -1)
        for i, (on_left, on_right) in enumerate(self._levels[:, :, self._kind]):
            level[(left == on_left) & (right == on_right)] = i
        octave, place = np.zeros(speed.shape, dtype=np.intp), np.zeros((len(speed), 1))
        if self._falls:
            mantissa, exponent = np.frexp(np.abs(speed))
            octave = exponent - OCTAVES[0]
            outside = (octave < 0) | (octave > OCTAVES[1] - OCTAVES[0]) | (speed == 0.0)
            octave[outside], level[outside] = 0, -1
            place = 4.0 * mantissa - 3.0
        self._learn(octave, level)
        # Few change from one of their polynomials to another within some rows.
        found = _horner(self._powers[:, octave[0], level[0], self._kind], place)
        row, member = np.nonzero((octave != octave[0]) | (level != level[0]))
        at = octave[row, member], level[row, member], self._kind[member]
        there = place[row, member if self._falls else 0]
        found[row, member] = _horner(self._powers[:, *at], there)
        row, member = np.nonzero((level < 0) | np.isnan(found))
        if row.size:
            factors = left[row, member], right[row, member]
            found[row, member] = self._search(self._kind[member], speed[row, member], *factors)
        return found

    def _learn(self, octave: NDArray[np.intp], level: NDArray[np.intp]) -> None:
        """Polynomials of the kinds and octaves that are new."""
        for i in range(int(octave.min()), int(octave.max()) + 1):
            here = ((octave == i) & (level >= 0)).any(axis=0)
            new = np.unique(self._kind[here & ~self._known[i, self._kind]])
            if new.size:
                self._known[i, new] = True
                self._powers[:, i, :, new] = self._polynomial(i, new).transpose(2, 0, 1)

    def _polynomial(self, octave: int, kinds: NDArray[np.intp]) -> FloatArray:
        """Coefficients of the largest force, shape (powers, levels, kinds)."""
        levels = self._levels[:, :, kinds]
        shape = len(self._powers), *levels.shape[::2]
        # A level that a kind does not have is as good as its first.
        left, right = np.where(np.isnan(levels), levels[:1], levels).transpose(1, 0, 2)
        speed = np.ones(1)  # such a contact does not know it
        if self._falls:
            speed = np.ldexp(0.25 * (_PLACES + 3.0), octave + OCTAVES[0])
        given = [np.broadcast_to(x, shape) for x in (speed[:, np.newaxis, np.newaxis], left, right)]
        every = np.broadcast_to(kinds, shape)
        values = self._search(every.ravel(), *(x.ravel() for x in given)).reshape(shape)
        if not self._falls:
            return values
        powers = np.zeros(shape)
        for weights, value in zip(_POWERS.T, values, strict=True):
            powers += weights[:, np.newaxis, np.newaxis] * value
        rest = np.abs(powers[-1]) / 2.0 ** (NODES - 2) + np.abs(powers[-2]) / 2.0 ** (NODES - 3)
        powers[:, rest > CONVERGED * values[0]] = np.nan
        return powers

    def _search(
        self, kinds: NDArray[np.intp], speed: FloatArray, left: FloatArray, right: FloatArray
    ) -> FloatArray:
        """Largest forces of as many cases, each of a kind."""
        used, place = np.unique(kinds, return_inverse=True)
        elements = [self._bodies[kind].wheelset.element for kind in used.tolist()]
        members = [self._bodies[kind].member() for kind in used.tolist()]
        # The force that the creepage comes to, however slowly.
        members = [m._replace(contact={**m.contact, "relaxation_length": 0.0}) for m in members]
        fleet = kernel.NativeFleet([members[i] for i in place.tolist()])
        inputs = np.zeros(speed.size, kernel.drivetrain_dtype("input"))
        states = np.zeros(speed.size, kernel.drivetrain_dtype("state"))
        load = np.array([0.5 * element.contact.normal_load for element in elements])[place]
        inputs["load_left"] = inputs["load_right"] = load
        inputs["friction_left"], inputs["friction_right"] = left, right
        states["speed"] = speed
        radius = np.array([element.radius for element in elements])[place]

        def force(slip: FloatArray) -> FloatArray:
            states["omega_left"] = states["omega_right"] = (speed + slip) / radius
            out = fleet.evaluate(inputs, states)
            return np.asarray(out["creep_force_left"] + out["creep_force_right"])

        zeta0 = np.array([element.saturation_creepage for element in elements])[place]
        slowest = np.array([element.minimum_speed for element in elements])[place]
        residual = np.array([element.friction.slip_rate_residual for element in elements])[place]
        unit = np.maximum(left, right) * zeta0 * np.maximum(np.abs(speed), slowest)
        return largest_force(force, unit, residual)


def _horner(powers: FloatArray, place: FloatArray) -> FloatArray:
    found: FloatArray = powers[-1] * np.ones_like(place)
    for power in powers[-2::-1]:
        found = found * place + power
    return found


def friction_levels(track: Track) -> list[tuple[float, float]]:
    """Pairs of factors under the left and the right wheel where friction does not change [1]."""
    left, right = track.friction_left, track.friction_right or track.friction_left
    times = {value for (value,) in _level((track.friction_over_time,))}
    pairs = {(a * t, b * t) for a, b in _level((left, right)) for t in times}
    return sorted(pairs)[:MOST_LEVELS]


def _level(profiles: Sequence[Profile]) -> set[tuple[float, ...]]:
    """Values of profiles wherever all of them are level."""
    corners = sorted({place for profile in profiles for place in profile.at})
    ends = [[profile.on(a, b) for profile in profiles] for a, b in pairwise(corners)]
    inside = {tuple(a for a, _ in end) for end in ends if all(a == b for a, b in end)}
    first, last = (tuple(profile.value[i] for profile in profiles) for i in (0, -1))
    return inside | {first, last}
