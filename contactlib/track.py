"""The track: what friction a wheel finds, by where it is and when."""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from contactlib.parameters import POSITIVE, FloatArray, checked
from contactlib.profile import Profile

NEAR = 1e-9  # closer than that one is there [m, s]
UNCHANGED = Profile((0.0,), (1.0,))


@dataclass(frozen=True, kw_only=True)
class Track:
    """Factors on both friction coefficients, under either wheel of a wheelset.

    Parameters
    ----------
    friction_left : Profile, optional
        Factor under the left wheel over distance [m] [1].
    friction_right : Profile, optional
        The same under the right wheel; as on the left if left out.
    friction_over_time : Profile, optional
        Factor for both wheels over time [s], which multiplies: sand, rain [1].

    Raises
    ------
    ValueError
        If a factor is not above zero.

    Examples
    --------
    >>> patch = Track(friction_left=Profile((50.0, 50.0, 150.0, 150.0), (1.0, 0.5, 0.5, 1.0)))
    >>> patch.friction_scale([0.0, 60.0], 0.0).tolist()
    [[1.0, 1.0], [0.5, 0.5]]
    """

    friction_left: Profile = UNCHANGED
    friction_right: Profile | None = None
    friction_over_time: Profile = UNCHANGED

    def __post_init__(self) -> None:
        checked("Track.friction_left", self.friction_left.value, POSITIVE)
        checked("Track.friction_over_time", self.friction_over_time.value, POSITIVE)
        if self.friction_right is not None:
            checked("Track.friction_right", self.friction_right.value, POSITIVE)

    def friction_scale(self, distance: ArrayLike, time: float) -> FloatArray:
        """Factors under the left and the right wheel.

        Parameters
        ----------
        distance : array_like
            Where each of n wheelsets is, shape (n,) or () [m].
        time : float
            [s].

        Returns
        -------
        ndarray
            Shape (n, 2) or (2,) [1].
        """
        left = self.friction_left(distance)
        right = left if self.friction_right is None else self.friction_right(distance)
        return np.asarray(np.stack([left, right], axis=-1) * self.friction_over_time(time))

    @cached_property
    def _corners(self) -> tuple[list[float], list[float]]:
        """Distances [m] and times [s] at which a profile has a corner or a jump."""
        sides = self.friction_left, self.friction_right or self.friction_left
        places = {place for side in sides for place in side.at}
        return sorted(places), sorted(self.friction_over_time.at)

    def until_change(self, distance: float, speed: float, time: float) -> float:
        """Time until friction has a corner or a jump, at a constant speed [s]; may be infinite."""
        places, times = self._corners
        found = math.inf
        if speed > 0.0:
            i = bisect_right(places, distance + NEAR)
            if i < len(places):
                found = (places[i] - distance) / speed
        elif speed < 0.0:
            i = bisect_left(places, distance - NEAR)
            if i > 0:
                found = (places[i - 1] - distance) / speed
        j = bisect_right(times, time + NEAR)
        return min(found, times[j] - time) if j < len(times) else found
