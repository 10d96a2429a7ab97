"""Profiles by breakpoints or in steps, and the track: factors on friction and slope, and grades."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from contactlib.base.quantities import (
    FINITE,
    NOT_NEGATIVE,
    POSITIVE,
    SEED,
    FloatArray,
    Limits,
    Parameters,
    Quantity,
    checked,
    checked_number,
    checks_call,
    common_shape,
    shown,
)
from contactlib.kernel import NativePeaks, NativeTrack

Values = tuple[float, ...]
Unit = Literal["factor", "coefficient", "adhesion"]  # of friction over distance
TIME = Quantity("s", at_least=0.0)  # of a breakpoint
KEEPING = Limits(at_least=1e-6, at_most=1e3)  # deceleration that keeps limits of speed [m/s2]
SQUARED = Limits(at_least=-1e6, at_most=1e6)  # speeds [m/s]
ALONG = Limits(at_least=-1e12, at_most=1e12)  # places [m], or times from 1970 [s]


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

    @classmethod
    def steps(cls, at: ArrayLike, value: ArrayLike) -> Profile:
        """Profile of sections: each value holds from its place to the next.

        Of a place given twice the second value holds. The first is that of either side, as where
        another list of the same table jumps.

        Examples
        --------
        >>> Profile.steps((0.0, 500.0), (11.0, 30.0))([-1.0, 499.0, 500.0]).tolist()
        [11.0, 11.0, 30.0]
        """
        rows = cls(at, value)  # type: ignore[arg-type]
        before, points = rows.value[0], list[tuple[float, float]]()
        last = dict(zip(rows.at, rows.value, strict=True))
        for i, (place, given) in enumerate(zip(rows.at, rows.value, strict=True)):
            if given not in (before, last[place]):
                raise ValueError(
                    f"at = {place!r} has the values {given!r} and {last[place]!r}, and that of the "
                    f"section before is {before!r}: in steps each value holds to the next place"
                )
            if rows.at[i + 1 : i + 2] != (place,):
                points += [(place, before)] * (given != before) + [(place, given)]
                before = given
        return cls(*zip(*points, strict=True))

    def __call__(self, at: ArrayLike) -> FloatArray:
        """Values at any places; at a jump the value from it on."""
        return np.asarray(np.interp(checked("at", at, FINITE, copy=False), self.at, self.value))

    def on(self, start: float, end: float) -> tuple[float, float]:
        """Values at `start` and `end` as seen between them; no breakpoint may lie between."""
        start = checked_number("start", start, FINITE)
        middle = 0.5 * start + 0.5 * checked_number("end", end, FINITE)
        at_start, at_middle = float(self(start)), float(self(middle))
        return at_start, 2.0 * at_middle - at_start

    def held_behind(self, length: float) -> Profile:
        """Steps in which each value also holds for a length behind it, where others are higher.

        That is how a speed limit holds for a train: until its tail has passed.

        Examples
        --------
        >>> limit = Profile.steps((500.0, 900.0), (10.0, 20.0))
        >>> limit.held_behind(200.0)([1000.0, 1200.0]).tolist()
        [10.0, 20.0]
        """
        length = checked_number("length", length, NOT_NEGATIVE)
        ends = np.unique(np.concatenate([self.at, np.add(self.at, length)]))
        middles = np.concatenate([[ends[0] - 1.0], 0.5 * (ends[1:] + ends[:-1]), [ends[-1] + 1.0]])
        sections = np.array((self.value[0], *self.value))  # before each place, and after the last
        first = np.searchsorted(self.at, middles - length, side="right")
        last = np.searchsorted(self.at, middles, side="right") + 1
        lowest = [sections[i:j].min() for i, j in zip(first, last, strict=True)]
        return Profile(np.repeat(ends, 2), np.repeat(lowest, 2)[1:-1])  # type: ignore[arg-type]

    def kept_by(self, deceleration: float) -> Profile:
        """Square of the highest speed [m2/s2] from which a deceleration [m/s2] keeps steps ahead.

        By v^2 = v_limit^2 + 2 a s, which is linear in the distance s before a lower limit.

        Raises
        ------
        ValueError
            If the deceleration is out of range, or the profile does not change in steps alone.

        Examples
        --------
        >>> limit = Profile.steps((0.0, 100.0), (20.0, 10.0))
        >>> limit.kept_by(2.0)([20.0, 25.0, 75.0, 100.0]).tolist()
        [400.0, 400.0, 200.0, 100.0]
        """
        slope = 2.0 * checked_number("deceleration", deceleration, KEEPING)
        checked("value", self.value, SQUARED)
        points = list(zip(self.at, self.value, strict=True))
        if any(a != b and u != v for (a, u), (b, v) in pairwise(points)):
            raise ValueError(f"value = {shown(self.value)} must change in steps: use Profile.steps")
        after = self.value[-1] ** 2  # behind a jump, from the last one on
        jumps = [(place, before) for (place, before), (b, _) in pairwise(points) if place == b]
        made = [] if jumps else [(self.at[-1], after)]
        sections = zip([-np.inf, *(place for place, _ in jumps)], jumps, strict=False)
        for left, (place, limit) in reversed(list(sections)):
            top, end = limit**2, min(limit**2, after)
            made += [(place, after), (place, end)][after == end :]
            begin = max(place - (top - end) / slope, left)  # of the braking
            after = end + slope * (place - begin)
            made += [(begin, after)] * (left < begin < place)
        return Profile(*zip(*reversed(made), strict=True))

    def mirrored(self) -> Profile:
        """The profile as it is met in the other direction, over the negative of its places."""
        return Profile(tuple(-place for place in self.at[::-1]), self.value[::-1])

    def mean_behind(self, at: ArrayLike, near: ArrayLike, far: float) -> FloatArray:
        """Mean of the values between `far` and `near` behind some places.

        Raises
        ------
        ValueError
            If a number is out of range, or `far` is also `near`.

        Examples
        --------
        >>> Profile((0.0, 0.0), (0.0, 0.02)).mean_behind([0.0, 50.0, 100.0, 200.0], 0.0, 100.0)
        array([0.  , 0.01, 0.02, 0.02])
        """
        places, values = np.array(self.at), np.array(self.value)
        middles = 0.5 * (values[1:] + values[:-1])
        areas = np.concatenate([[0.0], np.cumsum(middles * np.diff(places))])

        def area(end: FloatArray) -> FloatArray:
            """Integral from the first place on."""
            i = np.clip(np.searchsorted(places, end, side="right") - 1, 0, places.size - 1)
            return np.asarray(areas[i] + 0.5 * (values[i] + self(end)) * (end - places[i]))

        end = checked("at", at, ALONG, copy=False)
        first = checked("near", near, ALONG, copy=False)
        last = checked_number("far", far, ALONG)
        common_shape({"at": end, "near": first})
        if (first == last).any():
            raise ValueError(f"far = {last!r} must differ from near")
        return np.asarray((area(end - first) - area(end - last)) / (last - first))

    def times(self, other: Profile) -> Profile:
        """Product with a profile without jumps, exact at the places of both and linear between.

        Examples
        --------
        >>> Profile((1.0, 1.0), (2.0, 3.0)).times(Profile((0.0, 2.0), (1.0, 3.0)))
        Profile(at=(0.0, 1.0, 1.0, 2.0), value=(2.0, 4.0, 6.0, 9.0))
        """
        more = np.setdiff1d(other.at, self.at)
        at = np.concatenate([self.at, more])
        value = np.concatenate([self.value, self(more)]) * other(at)
        order = np.argsort(at, kind="stable")
        return Profile(at[order], value[order])  # type: ignore[arg-type]

    def over_distance(self, survey: Survey) -> Profile:
        """The profile over the distance of a run, from one over the places of a survey."""
        if (survey.start, survey.sign) == (0.0, 1.0):
            return self
        turn = slice(None, None, int(survey.sign))
        at = tuple(survey.sign * (place - survey.start) for place in self.at)
        return Profile(at[turn], self.value[turn])


class Survey(NamedTuple):
    """How the places of breakpoints are counted: the start of the run and its direction."""

    start: float = 0.0  # place where the run starts [m]
    sign: float = 1.0  # -1 if places decrease in the direction of travel
    map: str | None = None  # name of the file, of a map

    def places(self, low: float, high: float) -> str:
        """Places of two distances of a run, for messages."""
        ends = sorted(self.start + self.sign * distance for distance in (low, high))
        return f"{ends[0]:.6g} to {ends[1]:.6g} m"


def profile_of(make: Callable[[Values, Values], Profile] = Profile, /, **lists: Values) -> Profile:
    """Profile from two lists, of places and of values there; errors name the lists."""
    (places, at), (values, value) = lists.items()
    if len(at) != len(value):
        raise ValueError(
            f"{places} has {len(at)} and {values} {len(value)} entries: both must have as many"
        )
    try:
        return make(at, value)
    except ValueError as error:
        raise ValueError(f"{places}{str(error).removeprefix('at')}") from None


def _scaled(profile: Profile, factor: float) -> Profile:
    return Profile(profile.at, tuple(factor * value for value in profile.value))


RAILS = ("friction", "friction_left", "friction_right", "slope")  # lists over distance
LISTS = (*RAILS, "grade", "speed_limit")  # all lists over distance
UNCHANGED, LEVEL = Profile((0.0,), (1.0,)), Profile((0.0,), (0.0,))
FACTOR = Quantity("1", above=0.0, usual=(0.01, 10.0))
GRADIENT = "is it a gradient? that is grade, and slope a factor on the creep force's initial slope"
GRADE = Quantity("1", at_least=-0.5, at_most=0.5, usual=(-0.1, 0.1))
LIMIT = Quantity("m/s", above=0.0, usual=(1.0, 170.0))
CLEANING = Quantity("m/J", at_least=0.0, usual=(0.0, 1.0))
AT_END = 0.1  # distance beyond the end of a map that is no departure from it [m]
OFF_MAP = "the run, from"  # a doubt begins so
# A run may end before its breakpoints. If it lacks more than ten times its length and 100 m, or a
# kilometre, places are probably counted from elsewhere.
FAR, FARTHEST = (10.0, 100.0), 1000.0  # [1, m], [m]


NODES = 10  # of the variation in one correlation length, which keep 98 % of its deviation
BLOCK = 400  # nodes that are drawn together: what lies before them matters by exp(-40)
MAX_NODES = 2_000_000


@dataclass(frozen=True, kw_only=True)
class Variation(Parameters):
    """Random factor on friction along a track, the same under both wheels.

    Its logarithm is a stationary Gaussian process over the place: places that are d apart have the
    correlation exp(-d / correlation_length), the Ornstein-Uhlenbeck process. It is drawn at nodes a
    tenth of that length apart, with linear interpolation between, and a node's value depends on the
    seed and its place alone, as `distance` counts: runs of any length, start and direction meet the
    same rails.

    Parameters
    ----------
    standard_deviation : float
        Standard deviation of the logarithm of the factor at one place: about that of the factor,
        over its mean, if it is small [1].
    correlation_length : float
        Distance over which the correlation falls to 1/e [m].
    median : float, optional
        Median of the factor, for the level of friction on the whole line [1]. Default: 1.
    seed : float, optional
        Seed of the random numbers, a whole number. Default: 0.

    Examples
    --------
    >>> field = Variation(standard_deviation=0.2, correlation_length=50.0, seed=1.0)
    >>> long, short = field.profile(-100.0, 2000.0), field.profile(300.0, 400.0)
    >>> bool((long([320.0, 380.0]) == short([320.0, 380.0])).all())
    True
    """

    standard_deviation: Annotated[float, Quantity("1", at_least=0.0, at_most=3.0, usual=(0.0, 1.0))]
    correlation_length: Annotated[float, Quantity("m", above=0.0, usual=(1.0, 1e4))]
    median: Annotated[float, FACTOR] = 1.0
    seed: Annotated[float, SEED] = 0.0

    def profile(self, low: float, high: float) -> Profile:
        """The factor from one place to another [m].

        Raises
        ------
        ValueError
            If a place is not finite, or there are too many nodes between them.
        """
        spacing = self.correlation_length / NODES
        low, high = checked_number("low", low, FINITE), checked_number("high", high, FINITE)
        if not (high - low) / spacing < MAX_NODES:
            raise ValueError(
                f"correlation_length = {self.correlation_length!r} is out of range: must be > "
                f"{(high - low) * NODES / MAX_NODES:.4g}, as a run may be {high - low:.4g} m long"
            )
        first, last = math.floor(low / spacing), math.ceil(high / spacing)
        blocks = range(first // BLOCK - 1, last // BLOCK + 1)
        # Sensors draw from these keys too, at other counters.
        keys = (np.array([int(self.seed), block % 2**64], np.uint64) for block in blocks)
        streams = (np.random.Philox(key=key, counter=[0, 0, 0, 1]) for key in keys)
        drawn = np.array([np.random.Generator(one).standard_normal(BLOCK) for one in streams])
        # x_k = rho x_(k-1) + sqrt(1 - rho^2) n_k, from zero at the start of the block before
        rho, pairs = math.exp(-1.0 / NODES), np.hstack([drawn[:-1], drawn[1:]])
        weights = rho ** -np.arange(2.0 * BLOCK)
        process = np.cumsum(math.sqrt(1.0 - rho**2) * weights * pairs, axis=1) / weights
        skipped = first % BLOCK
        kept = process[:, BLOCK:].ravel()[skipped : skipped + last - first + 1]
        factor = self.median * np.exp(self.standard_deviation * kept)
        return Profile(spacing * np.arange(first, last + 1), factor)  # type: ignore[arg-type]


@dataclass(frozen=True, kw_only=True)
class Track:
    """Factors on both friction coefficients and on the initial slope of the creep force; grades.

    Parameters
    ----------
    friction_left : Profile, optional
        Factor under the left wheel over distance [m] [1].
    friction_right : Profile, optional
        Factor under the right wheel over distance [m] [1]. Default: as on the left.
    friction_over_time : Profile, optional
        Further factor for both wheels over time [s], for sand or rain [1].
    varied : Profile, optional
        Further factor for both wheels over distance [m], without jumps, such as a `Variation` [1].
    slope : Profile, optional
        Factor on the initial slope of the creep force under both wheels over distance [m] [1]. A
        wet rail has 0.29 times the slope of a dry one [1]_. The saturation creepage is divided by
        it, and k_hat does not change. This is an assumption, as for the slope reduction of the
        force element: a third-body layer shears, and does not change the weakening of friction.
    grade : Profile, optional
        Rise over distance [m], positive uphill in the direction of travel, which is added to the
        vehicle's own grade [1]. Default: 0. Each axle meets the grade of its own place.
    speed_limit : Profile, optional
        Speed over distance [m] from which the driver demands no traction [m/s]: the demand falls
        linearly to zero over the last 1 m/s below the lowest one under any axle. Braking remains;
        a `Driver` brakes for lower limits and downhill. Default: none.
    cleaning : float, optional
        Inverse of the slip work per length of one rail for 63 % of the recovery of friction [m/J]:
        1e-3 if a wheel that pulls 20 kN at a creepage of 5 %, 1 kJ/m, recovers so much. Default: 0,
        slip does not clean the rails.
    recovered : float, optional
        Factor on friction that much slip work leaves [1]. Default: 1.
    unit : str
        ``"coefficient"`` if the friction over distance is given by kinetic friction coefficients of
        the rails: `in_factors` then gives the track in factors, which runs use. ``"adhesion"`` if
        it is the largest traction coefficient of a wheel there, at its speed and load:
        `contactlib.files.Scenario.rails_at` gives the factors at a speed.
    peaks : NativePeaks, optional
        Factors that give a contact these coefficients, which runs compute.
    survey : Survey
        How messages count places along the track.

    Raises
    ------
    ValueError
        If a factor is not above zero, `cleaning` is below zero, or a grade or speed limit is out of
        range.

    Notes
    -----
    Slip that dissipates the work W per length of one rail raises the factor s on friction to

        s + (recovered - s) (1 - exp(-cleaning W)),    s < recovered,

    the form of Meli, Ridolfi & Rindi [2]_; Voltr & Lata [3]_ measured such transitions. In runs of
    single wheelsets W is the work of either wheel itself on the metre of its own rail that it is
    on: its slip power over the vehicle's speed. As in their model it has no memory, so a wheel
    that stops sliding finds the friction of rails that nobody has cleaned. The axles of a vehicle
    add what those in front have done there, which the rails keep at nodes 0.1 m apart.

    References
    ----------
    .. [1] O. Polach, "Creep forces in simulations of traction vehicles running on adhesion limit",
       Wear 258, 2005: the reduction factors k_A + k_S are 1.00 + 0.40 on dry and 0.30 + 0.10 on
       wet rail.
    .. [2] E. Meli, A. Ridolfi, A. Rindi, "An innovative degraded adhesion model for railway
       vehicles", Meccanica 49 (2014) 919-937.
    .. [3] P. Voltr, M. Lata, "Transient wheel-rail adhesion characteristics under the cleaning
       effect of sliding", Vehicle System Dynamics 53 (2015) 605-618.

    Examples
    --------
    >>> patch = Track(friction_left=Profile((50.0, 50.0, 150.0, 150.0), (1.0, 0.5, 0.5, 1.0)))
    >>> patch.friction_scale([0.0, 60.0], 0.0).tolist()
    [[1.0, 1.0], [0.5, 0.5]]
    """

    friction_left: Profile = UNCHANGED
    friction_right: Profile | None = None
    friction_over_time: Profile = UNCHANGED
    varied: Profile = UNCHANGED
    slope: Profile = UNCHANGED
    grade: Profile = LEVEL
    speed_limit: Profile | None = None
    cleaning: float = 0.0
    recovered: float = 1.0
    unit: Unit = "factor"
    peaks: NativePeaks | None = field(default=None, repr=False, compare=False)
    survey: Survey = field(default=Survey(), compare=False)

    def __post_init__(self) -> None:
        checked("Track.friction_left", self.friction_left.value, POSITIVE)
        checked("Track.friction_over_time", self.friction_over_time.value, POSITIVE)
        checked("Track.varied", self.varied.value, POSITIVE)
        if self.friction_right is not None:
            checked("Track.friction_right", self.friction_right.value, POSITIVE)
        checked("Track.slope", self.slope.value, POSITIVE)
        checked("Track.grade", self.grade.value, GRADE)
        if self.speed_limit is not None:
            checked("Track.speed_limit", self.speed_limit.value, POSITIVE)
        for name, limits in (("cleaning", CLEANING), ("recovered", FACTOR)):
            number = checked_number(f"Track.{name}", getattr(self, name), limits)
            object.__setattr__(self, name, number)

    @classmethod
    @checks_call
    def from_breakpoints(
        cls,
        *,
        map: str | None = None,  # noqa: A002 (the key of a file)
        distance: Annotated[Values, Quantity("m")] = (),
        friction: Annotated[Values, FACTOR] = (),
        friction_left: Annotated[Values, FACTOR] = (),
        friction_right: Annotated[Values, FACTOR] = (),
        time: Annotated[Values, TIME] = (),
        friction_over_time: Annotated[Values, FACTOR] = (),
        slope: Annotated[Values, Quantity("1", above=0.0, usual=(0.05, 10.0), hint=GRADIENT)] = (),
        grade: Annotated[Values, GRADE] = (),
        speed_limit: Annotated[Values, LIMIT] = (),
        cleaning: Annotated[float, CLEANING] = 0.0,
        recovered: Annotated[float, FACTOR] = 1.0,
        start: Annotated[float, Quantity("m", at_least=-1e9, at_most=1e9)] = 0.0,
        direction: Literal["increasing", "decreasing"] = "increasing",
        unit: Unit = "factor",
        between: Literal["linear", "steps"] = "linear",
    ) -> Track:
        """Make the track from lists of places and of values, which are the fields of the class.

        Only a scenario file reads a `map`; here it names the map in messages.

        Parameters
        ----------
        map : str, optional
            CSV file of a map of the track, in place of `distance` and the lists over it. It lies
            beside the scenario or below its folder, or is a shipped one.
        distance : tuple of float, optional
            Breakpoints along the track [m].
        friction : tuple of float, optional
            Factor on friction at these, under both wheels [1].
        start : float, optional
            Place, as `distance` counts, where the run starts [m].
        direction : str, optional
            Whether `distance` increases or decreases in the direction of travel. If it decreases,
            the left wheel runs on the right rail of the lists, and a grade that rises with
            `distance` is a descent.
        unit : str, optional
            Whether friction, friction_left and friction_right are factors; kinetic friction
            coefficients of the rails, which are divided by that of the wheelset's file; or
            ``"adhesion"``: the largest traction coefficient in steady rolling that a wheel finds
            there at its speed and load, to 1 % from 0.1 to 100 m/s. The friction that gives it
            changes with the speed as friction falls with slip speed and temperature. Factors over
            time, and what cleaning adds, apply to that friction.
        between : str, optional
            How friction, slope and grade change: ``"linear"`` between the places of `distance`, or
            in ``"steps"``, as in a list of sections: each value holds from its place to the next
            greater one. A speed limit always does.
        time : tuple of float, optional
            Breakpoints of the factor over time [s].

        Raises
        ------
        ValueError
            If a value is out of range, a list lacks its places, or their lengths differ.
        """
        given_lists = friction, friction_left, friction_right, slope, grade, speed_limit
        lists = dict(zip(LISTS, given_lists, strict=True))
        along = {key: values for key, values in lists.items() if values}
        survey = Survey(start, 1.0 if direction == "increasing" else -1.0, map)
        together = tuple(key for key in along if key in RAILS[:3]) in ((), RAILS[:1], RAILS[1:3])
        if not together or bool(distance) != bool(along):
            given = [*(["distance"] if distance else []), *along]
            raise ValueError(
                "distance must go with slope, grade, speed_limit, friction, or friction_left "
                f"and friction_right; given are {' and '.join(given)}"
            )
        factors: dict[str, Any] = {
            "friction_left" if key == "friction" else key: profile_of(
                Profile.steps if between == "steps" or key == "speed_limit" else Profile,
                distance=distance,
                **{key: values},
            )
            for key, values in along.items()
        }
        factors = {key: profile.over_distance(survey) for key, profile in factors.items()}
        if "friction_right" in factors and survey.sign < 0.0:
            sides = factors["friction_left"], factors["friction_right"]
            factors["friction_right"], factors["friction_left"] = sides
        if "grade" in factors:
            factors["grade"] = _scaled(factors["grade"], survey.sign)
        over_time = {"time": time, "friction_over_time": friction_over_time}
        given = [key for key, values in over_time.items() if values]
        if len(given) == 1:
            raise ValueError(f"{given[0]} is given alone: time and friction_over_time go together")
        if given:
            factors["friction_over_time"] = profile_of(**over_time)
        return cls(**factors, cleaning=cleaning, recovered=recovered, unit=unit, survey=survey)

    @property
    def uniform(self) -> Track:
        """The track with its grades and speed limits, on the friction of the wheelset's file."""
        return Track(grade=self.grade, speed_limit=self.speed_limit, survey=self.survey)

    def in_factors(self, kinetic: float) -> Track:
        """The track in factors, for a vehicle of a kinetic friction coefficient [1]."""
        kinetic = checked_number("kinetic", kinetic, POSITIVE)
        if self.unit != "coefficient":
            self.sides  # noqa: B018 (refuses others)
            return self
        right = self.friction_right
        return replace(
            self,
            unit="factor",
            friction_left=_scaled(self.friction_left, 1.0 / kinetic),
            friction_right=None if right is None else _scaled(right, 1.0 / kinetic),
        )

    @cached_property
    def sides(self) -> tuple[Profile, Profile]:
        """Factor under the left and under the right wheel.

        Raises
        ------
        ValueError
            If the track is given otherwise: see `in_factors`.
        """
        if self.unit != "factor":
            gives = "in_factors" if self.unit == "coefficient" else "Scenario.rails_at"
            raise ValueError(
                f"Track.unit = {self.unit!r} must be 'factor' here: {gives} gives such a track"
            )
        return self.given

    @property
    def given(self) -> tuple[Profile, Profile]:
        """Friction under the left and the right wheel in the track's unit, with its variation."""
        left, right = self.friction_left, self.friction_right
        if self.varied != UNCHANGED:
            left, right = left.times(self.varied), right and right.times(self.varied)
        return left, right or left

    def warning(self, low: float, high: float) -> str | None:
        """Sentence on a run that leaves its map, or is nowhere near its breakpoints; else None.

        Parameters
        ----------
        low, high : float
            Smallest and largest distance of the run from its start [m].

        Raises
        ------
        ValueError
            If one is not finite.
        """
        low, high = checked_number("low", low, FINITE), checked_number("high", high, FINITE)
        rails = self.friction_left, self.friction_right, self.slope
        along = *rails, self.grade, self.speed_limit
        varying = [profile for profile in along if profile and len(set(profile.value)) > 1]
        if not varying:
            return None
        first, last = min(p.at[0] for p in varying), max(p.at[-1] for p in varying)
        survey, gap = self.survey, max(first - high, low - last)
        where = f"{OFF_MAP} {survey.places(low, high)}"
        cure = "track.start is the place where a run starts, track.direction that of travel"
        if survey.map is not None:
            covers = f"the map {survey.map}, which covers {survey.places(first, last)}"
            if gap > 0.0:
                return f"{where}, never meets {covers}: the value at its end holds; {cure}"
            if low < first - AT_END or high > last + AT_END:
                return f"{where}, leaves {covers}: the values at its ends hold beyond; {cure}"
            return None
        back = low < -AT_END and high < AT_END and first > -AT_END
        away = back or (high > AT_END and low > -AT_END and last < -AT_END)
        if away or gap > min(FAR[0] * (high - low) + FAR[1], FARTHEST):
            here = survey.places(first, last)
            return f"{where}, never meets the values of track.distance, {here}; {cure}"
        return None

    @property
    def lowest(self) -> tuple[float, float]:
        """Smallest factor on friction, of either wheel and any time, and on the slope."""
        return self._extreme(min)

    @property
    def highest(self) -> tuple[float, float]:
        """Largest factors, as in `lowest`."""
        return self._extreme(max)

    def _extreme(self, choose: Callable[[Iterable[float]], float]) -> tuple[float, float]:
        friction = choose(choose(side.value) for side in self.sides)
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
        left, right = (side(distance) for side in self.sides)
        return np.asarray(np.stack([left, right], axis=-1) * self.friction_over_time(time))

    def cleaned(self, friction_scale: ArrayLike, work: ArrayLike) -> FloatArray:
        """Factors on friction after slip work on the rails.

        Parameters
        ----------
        friction_scale : array_like
            Factors before [1].
        work : array_like
            Slip work per length of one rail [J/m].
        """
        scale = checked("friction_scale", friction_scale, POSITIVE, copy=False)
        work = checked("work", work, NOT_NEGATIVE, copy=False)
        common_shape({"friction_scale": scale, "work": work})
        gain = np.maximum(self.recovered - scale, 0.0)
        return np.asarray(scale - gain * np.expm1(-self.cleaning * work))

    @cached_property
    def native(self) -> NativeTrack:
        """The profiles for the kernel."""
        sides = self.sides if self.peaks is None else self.given
        profiles = (*sides, self.friction_over_time, self.slope, self.grade)
        return NativeTrack(tuple((p.at, p.value) for p in profiles), self.peaks)
