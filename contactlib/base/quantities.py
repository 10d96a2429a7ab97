"""Declared physical quantities: one declaration checks both Python calls and model files.

A field ``radius: Annotated[float, Quantity("m", above=0.0)]`` of a `Parameters` subclass is
checked when the object is made. The same declaration tells `contactlib.files` the unit that
a model file may use.
"""

from __future__ import annotations

import math
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from functools import cache, cached_property, partial
from numbers import Real
from typing import Annotated, Any, ClassVar, TypeVar, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
Value = TypeVar("Value")


class ReadOnly(Mapping[str, Value]):
    """Mapping that cannot be changed but, unlike Python's own, can be copied and pickled."""

    def __init__(self, given: Mapping[str, Value]) -> None:
        self._given = dict(given)

    def __getitem__(self, name: str) -> Value:
        return self._given[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._given)

    def __len__(self) -> int:
        return len(self._given)

    def __repr__(self) -> str:
        return repr(self._given)


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Open or closed bounds of a number; bounds default to infinity.

    Bounds that depend on another quantity name it in ``given``: its name and value.
    """

    above: float = -math.inf
    at_least: float = -math.inf
    below: float = math.inf
    at_most: float = math.inf
    given: tuple[str, float] | None = None

    def allows(self, value: ArrayLike) -> NDArray[np.bool_]:
        """Elementwise: finite and within the bounds."""
        v = np.asarray(value, dtype=np.float64)
        ok = np.isfinite(v) & (v > self.above) & (v >= self.at_least)
        return np.asarray(ok & (v < self.below) & (v <= self.at_most))

    def allow(self, value: float) -> bool:
        """Whether one number is finite and within the bounds; faster than `allows`."""
        return (
            math.isfinite(value)
            and self.above < value < self.below
            and self.at_least <= value <= self.at_most
        )

    def allow_all(self, array: FloatArray) -> bool:
        """Whether `allows` holds for every element, found from the extremes."""
        if array.size == 0:
            return True
        # Either is nan if any is. The methods of the array would take twice as long for a few.
        least, most = (f.reduce(array, axis=None) for f in (np.minimum, np.maximum))
        return self.allow(float(least)) and self.allow(float(most))

    def __str__(self) -> str:
        signs = ((">", self.above), (">=", self.at_least), ("<", self.below), ("<=", self.at_most))
        bounds = [f"{s} {_digits(b)}" for s, b in signs if math.isfinite(b)]
        at = "" if self.given is None else " at {} = {!r}".format(*self.given)
        return " and ".join(["finite", *bounds]) + at


def _digits(bound: float) -> str:
    """Six digits if exact, else all: a value next to the bound must not look allowed."""
    short = f"{bound:g}"
    return short if float(short) == bound else repr(bound)


@dataclass(frozen=True)
class Quantity(Limits):
    """Unit and limits of a number, for use in ``Annotated``.

    `percent`: it is shown in per cent. `usual`: lowest and highest value that a vehicle or a rig
    has; a file's value beyond them is allowed, and warned of with `doubtful`, the probable mistake.
    """

    unit: str
    percent: bool = field(default=False, kw_only=True)
    usual: tuple[float, float] | None = field(default=None, kw_only=True)
    doubtful: str = field(default="is its unit missing or wrong?", kw_only=True)

    def is_usual(self, value: float) -> bool:
        """Whether a number is in the usual range, if there is one."""
        return self.usual is None or self.usual[0] <= value <= self.usual[1]

    def doubt(self, name: str, value: float) -> str | None:
        """Sentence on a number that is not usual; None for one that is."""
        if self.usual is None or self.is_usual(value):
            return None
        low, high = self.usual
        unit = "" if self.unit == "1" else f" {self.unit}"
        return (
            f"{name} = {value:g}{unit} is implausible: {low:g} to {high:g}{unit} is usual; "
            f"{self.doubtful}"
        )


class InputWarning(UserWarning):
    """A file or a run has a number that no vehicle has, or a file a key that it does not use."""


def warn(text: str) -> None:
    """Warn of an input, at the line outside of the package that led to it."""
    frame, level = sys._getframe(1), 1
    while frame.f_back and frame.f_globals.get("__name__", "").startswith(
        ("contactlib.", "contextlib")
    ):
        frame, level = frame.f_back, level + 1
    warnings.warn(text, InputWarning, stacklevel=level + 1)


FINITE = Limits()
POSITIVE = Limits(above=0.0)
NOT_NEGATIVE = Limits(at_least=0.0)
# Products and quotients of a few such numbers neither overflow nor underflow.
MODERATE = Limits(at_least=-1e50, at_most=1e50)
MODERATE_POSITIVE = Limits(at_least=1e-50, at_most=1e50)
MODERATE_NOT_NEGATIVE = Limits(at_least=0.0, at_most=1e50)


MOST_ROWS = 10_000_000  # of one result: all rows are held in memory


def shown(value: object) -> str:
    """Text of any value for a one-line message."""
    text = " ".join(repr(value).split())
    return text if len(text) <= 80 else f"{text[:77]}..."


def as_number(value: object, kinds: str = "iuf") -> float | None:
    """Return one number of these kinds of numpy's as a float; None for anything else."""
    if type(value) is float:
        return value
    try:
        array: Any = np.asarray(value)
    except ValueError:  # rows of unequal lengths
        return None
    return float(array) if array.ndim == 0 and array.dtype.kind in kinds else None


def checked(name: str, value: ArrayLike, limits: Limits, *, copy: bool = True) -> FloatArray:
    """Return `value` as a float64 array of the same shape, or raise.

    With ``copy=False`` the result may be `value` itself, for callers that only read it.

    Raises
    ------
    ValueError
        If `value` is not real numbers or any of them breaks `limits`; the message names the
        argument, the first offending value and the limits.
    """
    given: object = value
    if isinstance(given, float) and limits.allow(given):  # fast path
        return np.array(given, dtype=np.float64)
    try:
        raw = np.asarray(value)
        numbers = raw.dtype.kind in "iuf"
    except ValueError:  # rows of unequal lengths
        numbers = False
    if not numbers:
        raise ValueError(f"{name} = {shown(value)} is not a number; it must be {limits}")
    if raw.dtype != np.float64 or copy:
        with np.errstate(over="ignore"):  # a number of a wider type may overflow
            raw = raw.astype(np.float64)
    array: FloatArray = raw
    if not limits.allow_all(array):
        bad = array[~limits.allows(array)]
        raise ValueError(f"{name} = {float(bad.flat[0])!r} is out of range: must be {limits}")
    return array


def checked_number(name: str, value: ArrayLike, limits: Limits) -> float:
    """Return `value` as one float, or raise as `checked` does."""
    given: object = value
    if isinstance(given, float) and limits.allow(given):  # fast path
        return float(given)
    number = checked(name, value, limits)
    if number.ndim:
        raise ValueError(f"{name} = {shown(value)} is not one number; it must be {limits}")
    return float(number)


def checked_whole(name: str, value: float, limits: Limits) -> int:
    """Return a whole number within limits, or raise a ValueError that names it."""
    number = checked_number(name, value, limits)
    if number != int(number):
        raise ValueError(f"{name} = {value!r} must be a whole number")
    return value if isinstance(value, int) else int(number)


def checked_samples(
    limits: Limits, *, apart: float = math.ulp(0.0), **given: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Return two rows of one length, of which the first begins with 0 and rises, or raise.

    Its values are at least `apart`. A ValueError names the rows as the keywords do.
    """
    (first, x), (second, y) = ((name, checked(name, row, limits)) for name, row in given.items())
    if x.ndim != 1 or x.shape != y.shape or x.size < 2:
        raise ValueError(
            f"{first} has the shape {x.shape} and {second} {y.shape}: they must be two rows of one "
            "length, at least 2"
        )
    if x[0] != 0.0 or np.any(np.diff(x) < apart):
        raise ValueError(f"{first} = {shown(x.tolist())} must begin with 0 and rise")
    return x, y


def checked_rows(duration: float, interval: float | None) -> tuple[float, float]:
    """Duration of a response and the interval of its rows [s]; default: a thousandth of it."""
    duration = checked_number("duration", duration, Limits(at_least=1e-9))
    interval = duration / 1000.0 if interval is None else interval
    interval = checked_number("output_interval", interval, POSITIVE)
    if duration / interval > MOST_ROWS:
        raise ValueError(
            f"output_interval = {interval!r} is out of range: must be >= duration / {MOST_ROWS} "
            f"with duration = {duration!r}"
        )
    return duration, interval


def derived(
    name: str,
    compute: Callable[[], float],
    given: Mapping[str, float],
    limits: Limits = POSITIVE,
) -> float:
    """Compute a number from others, or raise a ValueError that names them.

    Inputs that are each within their limits may still overflow or underflow together.
    """
    try:
        value = float(compute())
    except (ArithmeticError, ValueError):  # such as a division by zero
        value = math.nan
    if not limits.allow(value):
        causes = ", ".join(f"{key} = {number!r}" for key, number in given.items())
        raise ValueError(f"{name} = {value!r} is out of range: must be {limits}; given {causes}")
    return value


def common_shape(arrays: Mapping[str, FloatArray]) -> tuple[int, ...]:
    """Return the shape to which arrays broadcast, or raise a ValueError that names them."""
    try:
        return np.broadcast_shapes(*(array.shape for array in arrays.values()))
    except ValueError:
        shapes = ", ".join(f"{name} has {array.shape}" for name, array in arrays.items())
        raise ValueError(f"the shapes must broadcast together: {shapes}") from None


def records(
    dtype: np.dtype[np.void], given: Mapping[str, ArrayLike], limits: Mapping[str, Limits]
) -> NDArray[np.void]:
    """Structured array of checked values, broadcast; fields that are not given are zero.

    Raises
    ------
    ValueError
        If a value is out of its limits, or the shapes do not broadcast.
    """
    arrays = {n: checked(n, value, limits[n], copy=False) for n, value in given.items()}
    found = np.zeros(common_shape(arrays), dtype=dtype)
    for name, array in arrays.items():
        found[name] = array
    return found


@cache
def cached_names(kind: Any) -> frozenset[str]:
    """Names of a class's cached properties."""
    members = [item for base in kind.__mro__ for item in vars(base).items()]
    return frozenset(name for name, member in members if isinstance(member, cached_property))


class Parameters:
    """Base of the frozen, keyword-only dataclasses: checks every declared quantity."""

    _quantities: ClassVar[Mapping[str, Quantity]]
    _list_names: ClassVar[frozenset[str]]
    _declared_fields: ClassVar[tuple[tuple[str, Quantity, bool], ...]]

    @classmethod
    def quantities(cls) -> Mapping[str, Quantity]:
        """Unit and limits of every field that is a physical quantity, by field name."""
        if "_quantities" not in cls.__dict__:
            hints = get_type_hints(cls, include_extras=True).items()
            annotated = [(name, hint) for name, hint in hints if get_origin(hint) is Annotated]
            cls._quantities = {
                name: part
                for name, hint in annotated
                for part in get_args(hint)
                if isinstance(part, Quantity)
            }
        return cls._quantities

    @classmethod
    def list_names(cls) -> frozenset[str]:
        """Names of the fields that are lists of numbers."""
        if "_list_names" not in cls.__dict__:
            hints = get_type_hints(cls).items()
            cls._list_names = frozenset(name for name, hint in hints if get_origin(hint) is tuple)
        return cls._list_names

    @classmethod
    def _declared(cls) -> tuple[tuple[str, Quantity, bool], ...]:
        """Name, quantity, and whether it may be None, of the fields that are quantities."""
        if "_declared_fields" not in cls.__dict__:
            quantities = cls.quantities()
            cls._declared_fields = tuple(
                (field.name, quantities[field.name], field.default is None)
                for field in fields(cls)  # type: ignore[arg-type]
                if field.name in quantities
            )
        return cls._declared_fields

    def _check_derived(self, *names: str, limits: Limits = POSITIVE) -> None:
        """Refuse fields for which any of the named properties is out of range."""
        given = {key: getattr(self, key) for key, _, _ in self._declared()}
        for name in names:
            derived(f"{type(self).__name__}.{name}", partial(getattr, self, name), given, limits)

    def __getstate__(self) -> dict[str, Any]:
        """What a copy or a pickle keeps: not what is derived, such as structs of the kernel."""
        kind: Any = type(self)
        left_out = cached_names(kind)
        return {name: value for name, value in vars(self).items() if name not in left_out}

    def __post_init__(self) -> None:
        for key, limits, optional in self._declared():
            value: Any = getattr(self, key)
            if value is None and optional:
                continue
            if type(value) is float and limits.allow(value):  # fast path
                continue
            name = f"{type(self).__name__}.{key}"
            if isinstance(value, tuple) and key in self.list_names():
                if not all(type(v) is float and limits.allow(v) for v in value):
                    checked(name, value, limits)
                continue
            if isinstance(value, bool) or not isinstance(value, Real):
                raise ValueError(f"{name} = {shown(value)} is not a number; it must be {limits}")
            try:
                number = float(value)
            except OverflowError:  # a long integer
                raise ValueError(
                    f"{name} = {shown(value)} is out of range: must be {limits}"
                ) from None
            if not limits.allow(number):
                checked(name, number, limits)  # raises
            object.__setattr__(self, key, number)
