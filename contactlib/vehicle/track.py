"""Piecewise linear profiles, and the track: factors on friction and on the slope."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from contactlib.base.quantities import (
    FINITE,
    POSITIVE,
    FloatArray,
    Quantity,
    checked,
    checked_number,
    checks_call,
    shown,
)
from contactlib.kernel import NativeTrack

Values = tuple[float, ...]
TIME = Quantity("s", at_least=0.0)  # of a breakpoint


@dataclass(frozen=True)
class Profile:
    """Piecewise linear function of time or distance, by breakpoints; constant beyond its ends.

    A place given twice is a jump: the first value applies up to it, the second from it on.

    Parameters
    ----------
    at : sequence of float
        Times [s] or distances [m], increasing; each may occur twice.
    value : sequence of float
        One value for each place.

    Examples
    --------
    >>> pulse = Profile((1.0, 1.0, 2.0, 2.0), (0.0, 5.0, 5.0, 0.0))
    >>> pulse([0.5, 1.0, 1.5, 2.0]).tolist()
    [0.0, 5.0, 5.0, 0.0]
    >>> pulse.on(1.0, 2.0)  # the ends as seen from inside
    (5.0, 5.0)
    """

    at: Values
    value: Values

    def __post_init__(self) -> None:
        at, value = checked("at", self.at, FINITE), checked("value", self.value, FINITE)
        if at.ndim != 1 or at.size == 0 or at.shape != value.shape:
            raise ValueError(
                f"at has {at.size} and value {value.size} entries: both must be sequences of "
                "the same length, at least 1"
            )
        places = tuple(at.tolist())  # for few places plain numbers are faster
        falls = any(b < a for a, b in pairwise(places))
        if falls or any(a == b for a, b in zip(places, places[2:], strict=False)):
            raise ValueError(
                f"at = {shown(self.at)} must be increasing, with each place at most twice"
            )
        object.__setattr__(self, "at", places)
        object.__setattr__(self, "value", tuple(value.tolist()))

    @classmethod
    def of(cls, value: float | Profile) -> Profile:
        """`value` itself if it is a profile, else a constant."""
        return value if isinstance(value, Profile) else cls((0.0,), (value,))

    def __call__(self, at: ArrayLike) -> FloatArray:
        """Values at any places; at a jump the value from it on."""
        return np.asarray(np.interp(checked("at", at, FINITE, copy=False), self.at, self.value))

    def on(self, start: float, end: float) -> tuple[float, float]:
        """Values at `start` and `end` as seen between them; no breakpoint may lie between."""
        start = checked_number("start", start, FINITE)
        middle = 0.5 * start + 0.5 * checked_number("end", end, FINITE)
        at_start, at_middle = float(self(start)), float(self(middle))
        return at_start, 2.0 * at_middle - at_start


def profile_of(**lists: Values) -> Profile:
    """Profile from two lists, of places and of values there; errors name the lists."""
    (places, at), (values, value) = lists.items()
    if len(at) != len(value):
        raise ValueError(
            f"{places} has {len(at)} and {values} {len(value)} entries: both must have as many"
        )
    try:
        return Profile(at, value)
    except ValueError as error:
        raise ValueError(f"{places}{str(error).removeprefix('at')}") from None


LISTS = ("friction", "friction_left", "friction_right", "slope")  # over distance
UNCHANGED = Profile((0.0,), (1.0,))
FACTOR = Quantity("1", above=0.0, usual=(0.01, 10.0))


@dataclass(frozen=True, kw_only=True)
class Track:
    """Factors on both friction coefficients and on the initial slope of the creep force.

    Parameters
    ----------
    friction_left : Profile, optional
        Factor under the left wheel over distance [m] [1].
    friction_right : Profile, optional
        Factor under the right wheel over distance [m] [1]. Default: as on the left.
    friction_over_time : Profile, optional
        Further factor for both wheels over time [s], for sand or rain [1].
    slope : Profile, optional
        Factor on the initial slope of the creep force under both wheels over distance [m] [1]. A
        wet rail has 0.29 times the slope of a dry one [1]_. The saturation creepage is divided by
        it, and k_hat does not change. This is an assumption, as for the slope reduction of the
        force element: a third-body layer shears, and does not change the weakening of friction.

    Raises
    ------
    ValueError
        If a factor is not above zero.

    References
    ----------
    .. [1] O. Polach, "Creep forces in simulations of traction vehicles running on adhesion limit",
       Wear 258, 2005: the reduction factors k_A + k_S are 1.00 + 0.40 on dry and 0.30 + 0.10 on
       wet rail.

    Examples
    --------
    >>> patch = Track(friction_left=Profile((50.0, 50.0, 150.0, 150.0), (1.0, 0.5, 0.5, 1.0)))
    >>> patch.friction_scale([0.0, 60.0], 0.0).tolist()
    [[1.0, 1.0], [0.5, 0.5]]
    """

    friction_left: Profile = UNCHANGED
    friction_right: Profile | None = None
    friction_over_time: Profile = UNCHANGED
    slope: Profile = UNCHANGED

    def __post_init__(self) -> None:
        checked("Track.friction_left", self.friction_left.value, POSITIVE)
        checked("Track.friction_over_time", self.friction_over_time.value, POSITIVE)
        if self.friction_right is not None:
            checked("Track.friction_right", self.friction_right.value, POSITIVE)
        checked("Track.slope", self.slope.value, POSITIVE)

    @classmethod
    @checks_call
    def from_breakpoints(
        cls,
        *,
        distance: Annotated[Values, Quantity("m")] = (),
        friction: Annotated[Values, FACTOR] = (),
        friction_left: Annotated[Values, FACTOR] = (),
        friction_right: Annotated[Values, FACTOR] = (),
        time: Annotated[Values, TIME] = (),
        friction_over_time: Annotated[Values, FACTOR] = (),
        slope: Annotated[Values, Quantity("1", above=0.0, usual=(0.02, 10.0))] = (),
    ) -> Track:
        """Make the track from lists of places and of factors, which are the fields of the class.

        Parameters
        ----------
        distance : tuple of float, optional
            Breakpoints along the track, from where the run starts [m].
        friction : tuple of float, optional
            Factor on friction at these, under both wheels [1].
        time : tuple of float, optional
            Breakpoints of the factor over time [s].

        Raises
        ------
        ValueError
            If a value is out of range, a list lacks its places, or their lengths differ.
        """
        lists = dict(zip(LISTS, (friction, friction_left, friction_right, slope), strict=True))
        along = {key: values for key, values in lists.items() if values}
        together = tuple(key for key in along if key != "slope") in ((), LISTS[:1], LISTS[1:3])
        if not together or bool(distance) != bool(along):
            given = [*(["distance"] if distance else []), *along]
            raise ValueError(
                "distance must go with slope, friction, or friction_left and friction_right; "
                f"given are {' and '.join(given)}"
            )
        factors = {
            "friction_left" if key == "friction" else key: profile_of(
                distance=distance, **{key: values}
            )
            for key, values in along.items()
        }
        over_time = {"time": time, "friction_over_time": friction_over_time}
        given = [key for key, values in over_time.items() if values]
        if len(given) == 1:
            raise ValueError(f"{given[0]} is given alone: time and friction_over_time go together")
        if given:
            factors["friction_over_time"] = profile_of(**over_time)
        return cls(**factors)

    @property
    def lowest(self) -> tuple[float, float]:
        """Smallest factor on friction, of either wheel and any time, and on the slope."""
        return self._extreme(min)

    @property
    def highest(self) -> tuple[float, float]:
        """Largest factors, as in `lowest`."""
        return self._extreme(max)

    def _extreme(self, choose: Callable[[Iterable[float]], float]) -> tuple[float, float]:
        sides = self.friction_left, self.friction_right or self.friction_left
        friction = choose(choose(side.value) for side in sides)
        return friction * choose(self.friction_over_time.value), choose(self.slope.value)

    def friction_scale(self, distance: ArrayLike, time: float) -> FloatArray:
        """Factors under the left and the right wheel.

        Parameters
        ----------
        distance : array_like
            Distance of each of n wheelsets, shape (n,) or () [m].
        time : float
            Time [s].

        Returns
        -------
        ndarray
            Factors [1], shape (n, 2) or (2,).
        """
        distance = checked("distance", distance, FINITE, copy=False)
        time = checked_number("time", time, FINITE)
        left = self.friction_left(distance)
        right = left if self.friction_right is None else self.friction_right(distance)
        return np.asarray(np.stack([left, right], axis=-1) * self.friction_over_time(time))

    @cached_property
    def native(self) -> NativeTrack:
        """The profiles for the kernel."""
        sides = self.friction_left, self.friction_right or self.friction_left
        profiles = (*sides, self.friction_over_time, self.slope)
        left, right, over_time, slope = ((profile.at, profile.value) for profile in profiles)
        return left, right, over_time, slope
