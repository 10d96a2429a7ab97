"""Declared physical quantities: one declaration checks both Python calls and model files.

A field ``radius: Annotated[float, Quantity("m", above=0.0)]`` of a `Parameters` subclass is
checked when the object is made. Files, sweeps, the explorer and the guide read the same
declaration, by `declared`.
"""

from __future__ import annotations

import inspect
import math
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields, replace
from functools import cache, cached_property, partial, wraps
from types import MappingProxyType, MethodType, NoneType, UnionType
from typing import (
    Annotated,
    Any,
    Literal,
    TypeVar,
    Union,
    cast,
    get_args,
    get_origin,
    get_type_hints,
)

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
        smallest, largest = (f.reduce(array, axis=None) for f in (np.minimum, np.maximum))
        return self.allow(float(smallest)) and self.allow(float(largest))

    def __str__(self) -> str:
        signs = ((">", self.above), (">=", self.at_least), ("<", self.below), ("<=", self.at_most))
        bounds = [f"{s} {_digits(b)}" for s, b in signs if math.isfinite(b)]
        at = "" if self.given is None else " at {} = {!r}".format(*self.given)
        return " and ".join(["finite", *bounds]) + at


def _digits(bound: float) -> str:
    """Six digits if exact, else all: a value next to the bound must not look allowed."""
    short = f"{bound:g}"
    return short if float(short) == bound else repr(bound).removesuffix(".0")


@dataclass(frozen=True)
class Quantity(Limits):
    """Unit and limits of a number, for use in ``Annotated``.

    `percent`: reports show it in per cent. `whole`: it has no fraction. `usual`: minimum and
    maximum value of real vehicles and rigs; a file's value beyond them is allowed, but causes a
    warning with `hint`, the probable mistake, which errors of files name too.
    """

    unit: str
    percent: bool = field(default=False, kw_only=True)
    whole: bool = field(default=False, kw_only=True)
    usual: tuple[float, float] | None = field(default=None, kw_only=True)
    hint: str = field(default="", kw_only=True)

    def is_usual(self, value: float) -> bool:
        """Whether a number is in the usual range, if there is one."""
        return self.usual is None or self.usual[0] <= value <= self.usual[1]

    def is_plain(self, array: FloatArray) -> bool:
        """Whether every element is allowed and usual, of a quantity that need not be whole."""
        low, high = self.usual or (-math.inf, math.inf)
        usual = Limits(at_least=low, at_most=high)
        return not self.whole and self.allow_all(array) and usual.allow_all(array)

    def warning(self, name: str, value: float) -> str | None:
        """Sentence on a number that is not usual; None if it is usual."""
        if self.usual is None or self.is_usual(value):
            return None
        low, high = self.usual
        unit = "" if self.unit == "1" else f" {self.unit}"
        return (
            f"{name} = {value:g}{unit} is implausible: {low:g} to {high:g}{unit} is usual; "
            f"{self.hint or 'is its unit missing or wrong?'}"
        )


SEED = Quantity("1", at_least=0.0, at_most=2.0**53, whole=True)  # of random numbers


class InputWarning(UserWarning):
    """A file or run has an implausible number, or a file has a key that it does not use."""


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


MAX_ROWS = 10_000_000  # of one result: all rows are held in memory


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


def checked_row(name: str, value: ArrayLike, limits: Limits) -> tuple[float, ...]:
    """Return one row of numbers within limits, or raise a ValueError that names it."""
    if isinstance(value, tuple) and all(type(v) is float and limits.allow(v) for v in value):
        return value
    numbers = checked(name, value, limits)
    if numbers.ndim != 1:
        raise ValueError(f"{name} = {shown(value)} must be one row of numbers")
    return tuple(numbers.tolist())


def checked_samples(
    limits: Limits, *, apart: float = math.ulp(0.0), **given: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Return two rows of one length, the first strictly increasing from 0, or raise.

    Its values are at least `apart`. A ValueError names the rows as the keywords do.
    """
    (first, x), (second, y) = ((name, checked(name, row, limits)) for name, row in given.items())
    if x.ndim != 1 or x.shape != y.shape or x.size < 2:
        raise ValueError(
            f"{first} has the shape {x.shape} and {second} {y.shape}: they must be two rows of one "
            "length, at least 2"
        )
    if x[0] != 0.0 or np.any(np.diff(x) < apart):
        raise ValueError(
            f"{first} = {shown(x.tolist())} must begin with 0 and be strictly increasing"
        )
    return x, y


def checked_rows(duration: float, interval: float | None) -> tuple[float, float]:
    """Duration of a response and the interval of its rows [s]; default: a thousandth of it."""
    duration = checked_number("duration", duration, Limits(at_least=1e-9))
    interval = duration / 1000.0 if interval is None else interval
    interval = checked_number("output_interval", interval, POSITIVE)
    if duration / interval > MAX_ROWS:
        raise ValueError(
            f"output_interval = {interval!r} is out of range: must be >= duration / {MAX_ROWS} "
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
    dtype: np.dtype[np.void],
    given: Mapping[str, ArrayLike],
    limits: Mapping[str, Limits],
    fields: Mapping[str, str] = MappingProxyType({}),
) -> NDArray[np.void]:
    """Structured array of checked values, broadcast; fields that are not given are zero.

    `fields` has the fields of those values that have another name.

    Raises
    ------
    ValueError
        If a value is out of its limits, or the shapes do not broadcast.
    """
    arrays = {n: checked(n, value, limits[n], copy=False) for n, value in given.items()}
    structured = np.zeros(common_shape(arrays), dtype=dtype)
    for name, array in arrays.items():
        structured[fields.get(name, name)] = array
    return structured


@cache
def cached_names(kind: Any) -> frozenset[str]:
    """Names of a class's cached properties."""
    members = [item for base in kind.__mro__ for item in vars(base).items()]
    return frozenset(name for name, member in members if isinstance(member, cached_property))


@dataclass(frozen=True)
class Parameter:
    """Declaration of one parameter of a class or function.

    Attributes
    ----------
    name : str
        Its name there.
    quantity : Quantity or None
        Unit and limits; None of a text.
    many : bool
        Whether it is a list.
    choices : tuple
        Allowed values, if not every number or text is allowed.
    default : object
        Default; `dataclasses.MISSING` if it is required.
    described_by : tuple
        Classes and functions whose docstrings describe it; the first description is used.
    """

    name: str
    quantity: Quantity | None
    many: bool
    choices: tuple[Any, ...]
    default: Any
    described_by: tuple[Any, ...]

    @property
    def needed(self) -> bool:
        """Whether there is no default."""
        return self.default is MISSING

    def checked(self, name: str, value: Any) -> Any:
        """Return the value as declared, or raise a ValueError with name, value and limits."""
        if value is None and self.default is None:
            return value
        if self.choices and value not in self.choices:
            known = ", ".join(map(str, self.choices))
            raise ValueError(f"{name} = {shown(value)} must be one of: {known}")
        if self.quantity is None:
            return value
        if self.many:
            return checked_row(name, value, self.quantity)
        check = checked_whole if self.quantity.whole else checked_number
        return float(check(name, value, self.quantity))


@cache
def declared(source: Any) -> Mapping[str, Parameter]:
    """Quantities, texts and lists of them that a class or function declares as its parameters.

    A parameter of a class method that declares no limits has those of the field of that name.
    Python's ``from_`` is the key ``from``.
    """
    hints = get_type_hints(source, include_extras=True)
    inherited: Mapping[str, Parameter] = {}
    described_by = [source]
    if isinstance(source, type):
        defaults = {f.name: f.default for f in fields(source) if f.init}
    else:
        given = inspect.signature(source).parameters.items()
        defaults = {n: MISSING if p.default is p.empty else p.default for n, p in given}
        if isinstance(getattr(source, "__self__", None), type):
            inherited = declared(source.__self__)
            described_by.append(source.__self__)
    parameters = {}
    for name, default in defaults.items():
        of_type, *notes = get_args(hints[name]) if _is(hints[name], Annotated) else (hints[name],)
        quantity = next((note for note in notes if isinstance(note, Quantity)), None)
        types = get_args(of_type) if _is(of_type, Union, UnionType) else (of_type,)
        types = tuple(t for t in types if t is not NoneType)
        many = any(_is(t, tuple, Sequence) and PLAIN.issuperset(get_args(t)) for t in types)
        choices = next((get_args(t) for t in types if _is(t, Literal)), ())
        choices = (True, False) if types == (bool,) else choices
        if quantity or many or choices or types == (str,):  # but not one of ArrayLike's types
            parameters[name] = Parameter(
                name, quantity, many, choices, default, tuple(described_by)
            )
        elif name in inherited:
            parameters[name] = replace(
                inherited[name], default=default, described_by=tuple(described_by)
            )
    return MappingProxyType({name.rstrip("_"): parameter for name, parameter in parameters.items()})


PLAIN = {float, str, str | int, ...}  # allowed elements of a list


def _is(hint: Any, *origins: Any) -> bool:
    return get_origin(hint) in origins


Function = TypeVar("Function", bound=Callable[..., Any])


def checks_call(function: Function) -> Function:
    """Decorate a function so that it checks the keyword parameters that it declares."""

    @wraps(function)
    def checking(*args: Any, **given: Any) -> Any:
        of_class = args and isinstance(args[0], type)
        known = declared(MethodType(checking, args[0]) if of_class else checking)
        for name, parameter in known.items():
            if parameter.name in given:
                given[parameter.name] = parameter.checked(name, given[parameter.name])
        return function(*args, **given)

    return cast(Function, checking)


class Parameters:
    """Base of the frozen, keyword-only dataclasses: checks every declared parameter."""

    @classmethod
    def quantities(cls) -> Mapping[str, Quantity]:
        """Unit and limits of every field that is a physical quantity, by field name."""
        kind: Any = cls
        return {
            name: parameter.quantity
            for name, parameter in declared(kind).items()
            if parameter.quantity
        }

    def _check_derived(self, *names: str, limits: Limits = POSITIVE) -> None:
        """Refuse fields for which any of the named properties is out of range."""
        given = {key: getattr(self, key) for key in self.quantities()}
        for name in names:
            derived(f"{type(self).__name__}.{name}", partial(getattr, self, name), given, limits)

    def __getstate__(self) -> dict[str, Any]:
        """State for copies and pickles, without derived objects such as structs of the kernel."""
        kind: Any = type(self)
        left_out = cached_names(kind)
        return {name: value for name, value in vars(self).items() if name not in left_out}

    def __post_init__(self) -> None:
        kind: Any = type(self)
        for key, parameter in declared(kind).items():
            value = getattr(self, key)
            checked_value = parameter.checked(f"{kind.__name__}.{key}", value)
            if checked_value is not value:
                object.__setattr__(self, key, checked_value)
