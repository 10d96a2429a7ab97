"""The largest creep force of many wheelsets, row by row, each with its own contact and track.

To look for it in every row would take longer than to step the wheelsets. Where friction stays at
one of the levels of its track, the largest force is a smooth function of the speed alone, and of
nothing if friction does not fall with slip speed: so it is looked for at a few speeds of an octave,
and interpolated. It is looked for in every row on ramps of friction, and where the octave's
polynomial has not converged.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise, product
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
        self._octaves = 1 + OCTAVES[1] - OCTAVES[0] if self._falls else 1
        bodies: dict[Any, int] = {}
        cases: dict[tuple[int, float, float], int] = {}  # a body at a level
        levels = {id(track): friction_levels(track) for track in tracks}
        self._bodies: list[Drivetrain] = []
        self._body = np.empty(len(drivetrains), dtype=np.intp)  # of each wheelset
        most = max(map(len, levels.values()))
        self._level = np.full((most, 2, len(drivetrains)), np.nan)
        self._case = np.zeros((most, len(drivetrains)), dtype=np.intp)
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
        body, *factors = np.array(list(cases)).T
        self._of_case = body.astype(np.intp), *factors
        # A column for each octave of each case; nan where its polynomial has not converged.
        columns = len(cases) * self._octaves
        self._powers = np.zeros((NODES if self._falls else 1, columns))
        self._known = np.zeros(columns, dtype=np.bool_)

    def __call__(self, speed: FloatArray, left: FloatArray, right: FloatArray) -> FloatArray:
        """Largest forces [N] at speeds [m/s] and friction factors [1], all of shape (rows, n)."""
        column = np.full(speed.shape, -1)
        for (on_left, on_right), case in zip(self._level, self._case, strict=True):
            np.copyto(column, case * self._octaves, where=(left == on_left) & (right == on_right))
        place = np.zeros((len(speed), 1))
        if self._falls:
            mantissa, exponent = np.frexp(np.abs(speed))
            octave = exponent - OCTAVES[0]
            outside = (octave < 0) | (octave >= self._octaves) | (mantissa == 0.0) | (column < 0)
            column = np.where(outside, -1, column + octave)
            place = 4.0 * mantissa - 3.0
        new = column[~self._known[column] & (column >= 0)]
        if new.size:
            self._learn(np.unique(new))
        # Within some rows few change from one of their polynomials to another.
        found = _horner(self._powers[:, column[0]], place)
        row, member = np.nonzero(column != column[0])
        there = place[row, member if self._falls else 0]
        found[row, member] = _horner(self._powers[:, column[row, member]], there)
        row, member = np.nonzero((column < 0) | np.isnan(found))
        if row.size:
            given = (signal[row, member] for signal in (speed, left, right))
            found[row, member] = self._search(self._body[member], *given)
        return found

    def _learn(self, columns: NDArray[np.intp]) -> None:
        """Polynomials of columns that are new."""
        case, octave = np.divmod(columns, self._octaves)
        nodes = np.ones((1, 1))  # [m/s]; friction that does not fall does not know the speed
        if self._falls:
            nodes = np.ldexp(0.25 * (_PLACES + 3.0)[:, np.newaxis], octave + OCTAVES[0])
        shape = len(self._powers), columns.size
        given = [
            np.broadcast_to(x, shape).ravel() for x in (nodes, *(y[case] for y in self._of_case))
        ]
        speed, body, left, right = given
        values = self._search(body, speed, left, right).reshape(shape)
        powers = values
        if self._falls:
            powers = np.zeros(shape)
            for weights, value in zip(_POWERS.T, values, strict=True):
                powers += weights[:, np.newaxis] * value
            highest = np.abs(powers[-2:]) / 2.0 ** np.array([[NODES - 3], [NODES - 2]])
            powers[:, highest.sum(axis=0) > CONVERGED * values[0]] = np.nan
        self._powers[:, columns], self._known[columns] = powers, True

    def _search(
        self, body: NDArray[np.intp], speed: FloatArray, left: FloatArray, right: FloatArray
    ) -> FloatArray:
        """Largest forces of as many cases, each of a body."""
        used, place = np.unique(body, return_inverse=True)
        trains = [self._bodies[i] for i in used.tolist()]
        elements = [train.wheelset.element for train in trains]
        members = [train.member() for train in trains]
        # The force that the creepage comes to, however slowly.
        members = [m._replace(contact={**m.contact, "relaxation_length": 0.0}) for m in members]
        fleet = kernel.NativeFleet([members[i] for i in place.tolist()])
        radius, load, zeta0, slowest, residual = np.array(
            [
                (
                    element.radius,
                    element.contact.normal_load,
                    element.saturation_creepage,
                    element.minimum_speed,
                    element.friction.slip_rate_residual,
                )
                for element in elements
            ]
        ).T[:, place]
        inputs = np.zeros(speed.size, kernel.drivetrain_dtype("input"))
        states = np.zeros(speed.size, kernel.drivetrain_dtype("state"))
        inputs["load_left"] = inputs["load_right"] = 0.5 * load
        inputs["friction_left"], inputs["friction_right"] = left, right
        states["speed"] = speed

        def force(slip: FloatArray) -> FloatArray:
            states["omega_left"] = states["omega_right"] = (speed + slip) / radius
            out = fleet.evaluate(inputs, states)
            return np.asarray(out["creep_force_left"] + out["creep_force_right"])

        unit = np.maximum(left, right) * zeta0 * np.maximum(np.abs(speed), slowest)
        return largest_force(force, unit, residual)


def _horner(powers: FloatArray, place: FloatArray) -> FloatArray:
    found = np.broadcast_to(powers[-1], np.broadcast_shapes(powers.shape[1:], place.shape)).copy()
    for power in powers[-2::-1]:
        found *= place
        found += power
    return found


def friction_levels(track: Track) -> list[tuple[float, float]]:
    """Pairs of factors under the left and the right wheel where friction does not change [1]."""
    left, right = track.friction_left, track.friction_right
    times = {time for time, _, _ in _levels(track.friction_over_time)}
    pairs = {(value, value) for value, _, _ in _levels(left)}
    if right is not None:
        both = product(_levels(left), _levels(right))
        pairs = {(a, b) for (a, *of_a), (b, *of_b) in both if _overlap(*of_a, *of_b)}
    return sorted({(a * time, b * time) for a, b in pairs for time in times})[:MOST_LEVELS]


def _levels(profile: Profile) -> list[tuple[float, float, float]]:
    """Values of a profile where it is level, from where and to where."""
    at, value = (-math.inf, *profile.at, math.inf), profile.value
    steps = pairwise((value[0], *value, value[-1]))
    return [(a, *ends) for (a, b), ends in zip(steps, pairwise(at), strict=True) if a == b]


def _overlap(start: float, end: float, other_start: float, other_end: float) -> bool:
    return max(start, other_start) < min(end, other_end)
