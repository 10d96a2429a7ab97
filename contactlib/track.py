"""The track: what friction a wheel finds, by where it is and when."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from contactlib.kernel import NativeTrack
from contactlib.parameters import FINITE, POSITIVE, FloatArray, checked, checked_number
from contactlib.profile import Profile

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
        distance = checked("distance", distance, FINITE, copy=False)
        time = checked_number("time", time, FINITE)
        left = self.friction_left(distance)
        right = left if self.friction_right is None else self.friction_right(distance)
        return np.asarray(np.stack([left, right], axis=-1) * self.friction_over_time(time))

    @cached_property
    def native(self) -> NativeTrack:
        """Profiles as the kernel wants them."""
        sides = self.friction_left, self.friction_right or self.friction_left
        profiles = (*sides, self.friction_over_time)
        left, right, over_time = ((profile.at, profile.value) for profile in profiles)
        return left, right, over_time
