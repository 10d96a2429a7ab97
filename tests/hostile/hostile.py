"""What a caller may hand over in place of a good number, and what must come of it.

A `Call` says how one public function, class or method is called well. `check` replaces one of its
arguments by a hostile value and holds that

- either the answer is right: no nan, infinite only where the call says so,
- or a ValueError (or a ConvergenceError) of one line names argument, value and limit,

and that nothing warns and no input array is changed. `check_layout` holds that an answer depends
on the numbers alone: not on type, order or strides of the array that brings them.
"""

from __future__ import annotations

import copy
import dataclasses
import inspect
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from decimal import Decimal
from fractions import Fraction
from functools import cached_property
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

import contactlib as cl
from contactlib.base.quantities import shown

SUBMODULES = ("control_systems", "stability", "torsion", "traction")
LIMIT = re.compile(r"must|need|out of range|is not|are not|no |not |too |only ")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Call:
    """A good call of something public.

    Parameters
    ----------
    name : str
        What is called, as "CarterGriffith.slope"; after a space what sets it apart from another
        call of the same, as "CarterGriffith.slope elliptic".
    make : callable
        Makes the function and its good keyword arguments, afresh for each use. Good arrays are one
        dimensional and have at least four numbers.
    arrays : tuple of str
        Arguments that may be arrays of any shape.
    rows : tuple of str
        Arguments that must be sequences of one length.
    numbers : tuple of str
        Arguments that must be one number.
    optional : tuple of str
        Those of them that may be None.
    infinite : bool
        Whether an answer may be infinite.
    unbounded : tuple of str
        Arguments that may be infinite themselves.
    nan : bool
        Whether an answer may have nan, which then stands for "none".
    says : mapping of str to str
        Name under which an error reports an argument, if it is not the argument's.
    raises : tuple of types
        Documented exceptions other than ValueError.
    slow : bool
        Whether one call takes more than about 50 ms: then extremes wait for the long run.
    long : bool
        Whether one call takes seconds: then only what is refused at once is tried.
    """

    name: str
    make: Callable[[], tuple[Callable[..., Any], dict[str, Any]]]
    arrays: tuple[str, ...] = ()
    rows: tuple[str, ...] = ()
    numbers: tuple[str, ...] = ()
    optional: tuple[str, ...] = ()
    infinite: bool = False
    unbounded: tuple[str, ...] = ()
    nan: bool = False
    says: Mapping[str, str] = dataclasses.field(default_factory=dict)
    raises: tuple[type[Exception], ...] = (cl.ConvergenceError,)
    slow: bool = False
    long: bool = False

    @property
    def covers(self) -> str:
        """What is called."""
        return self.name.split(" ")[0]

    @property
    def arguments(self) -> tuple[str, ...]:
        """All that are numbers."""
        return (*self.arrays, *self.rows, *self.numbers)


# What is no number, by a name for the test.
NO_NUMBER: dict[str, object] = {
    "nan": float("nan"),
    "inf": float("inf"),
    "-inf": float("-inf"),
    "True": True,
    "text": "1.0",
    "bytes": b"1",
    "None": None,
    "complex": 1.0 + 0.0j,
    "object": object(),
    "dict": {"a": 1.0},
    "set": {1.0},
    "Decimal": Decimal(1),
    "date": np.datetime64("2000-01-01"),
    "numpy True": np.True_,
    "numpy nan": np.float32("nan"),
    "array of nan": np.array([1.0, np.nan]),
    "large array of nan": np.full((60, 60), np.nan),
    "array of complex": np.array([1.0 + 1.0j]),
    "array of objects": np.array([1.0, None], dtype=object),
    "array of text": np.array(["a", "b"]),
    "array of bool": np.array([True, False]),
    "structured": np.zeros(2, dtype=[("a", "f8")]),
    "ragged": [[1.0], [1.0, 2.0]],
    "beyond floats": 10**400,
}

# Numbers at the ends of what floats hold.
EXTREMES: dict[str, object] = {
    "0": 0.0,
    "-0": -0.0,
    "int": 1,
    "smallest": 5e-324,
    "-smallest": -5e-324,
    "tiny": 1e-300,
    "small": 1e-30,
    "-small": -1e-30,
    "eps": 2.0**-52,
    "large": 1e30,
    "-large": -1e30,
    "huge": 1e308,
    "-huge": -1e308,
    "-1": -1.0,
    "int64": 2**53 + 1,
    "large int": 10**30,
    "float16": np.float16(0.3),
    "float32": np.float32(0.3),
    "longdouble": np.longdouble("0.3"),
    "largest longdouble": np.finfo(np.longdouble).max,
    "fraction": Fraction(1, 3),
    "0-d": np.array(0.3),
    "one": np.array([0.3]),
    "empty": np.array([]),
    "empty list": [],
    "empty 2-d": np.empty((0, 3)),
    "empty of integers": np.array([], dtype=np.int64),
    "two": [0.3, 0.4],
    "2-d": np.array([[0.3, 0.4], [0.5, 0.6]]),
}


def layouts(good: NDArray[np.float64]) -> Iterator[tuple[str, Any]]:
    """The numbers of a row in other types, orders, strides and shapes, by name.

    Narrower types change the numbers: what counts is what they hold.
    """
    n = good.size // 2
    yield "list", good.tolist()
    yield "tuple", tuple(good.tolist())
    yield "reversed", good[::-1]
    yield "every second", np.repeat(good, 2)[::2]
    yield "big-endian", good.astype(">f8")
    frozen = good.copy()
    frozen.flags.writeable = False
    yield "read-only", frozen
    unaligned = np.frombuffer(b"\0" + good.tobytes(), np.uint8)[1:].view(np.float64)
    yield "unaligned", unaligned
    for kind in ("float32", "float16", "longdouble"):
        with np.errstate(over="ignore"):
            yield kind, good.astype(kind)
    for kind in ("int8", "int32", "int64", "uint8", "uint64"):
        yield kind, np.clip(np.ceil(np.abs(good)), 0, 100).astype(kind)
    yield "broadcast", np.broadcast_to(good[:1], good.shape)
    record = np.zeros(good.size, dtype=[("a", "i1"), ("b", "f8")])
    record["b"] = good
    yield "record field", record["b"]
    pair = good[: 2 * n].reshape(2, n)
    yield "2-d", pair
    yield "lists of lists", pair.tolist()
    yield "Fortran", np.asfortranarray(pair)
    yield "transposed", pair.T
    yield "4-d", pair.reshape(1, 2, 1, n)
    yield "4-d, negative strides", pair.reshape(1, 2, 1, n)[::-1, ::-1, :, ::-1]
    yield "broadcast 3-d", np.broadcast_to(pair, (3, 2, n))
    yield "0-d", np.array(good[0])
    yield "one", good[:1]
    yield "empty", good[:0]
    yield "empty 3-d", np.empty((2, 0, 3))


ROW_LAYOUTS = frozenset(
    {"list", "tuple", "reversed", "every second", "big-endian", "read-only", "unaligned"}
    | {"float32", "float16", "longdouble", "record field"}
)  # that keep a row what it is


def leaves(answer: object, path: str = "answer") -> Iterator[tuple[str, NDArray[Any]]]:
    """Every number of an answer: of arrays, records, mappings, sequences and dataclasses."""
    if isinstance(answer, np.ndarray) and answer.dtype.names:
        for name in answer.dtype.names:
            yield from leaves(answer[name], f"{path}[{name!r}]")
    elif isinstance(answer, bool | int | float | complex | np.ndarray | np.generic):
        array = np.asarray(answer)
        if array.dtype.kind == "c":
            yield f"{path}.real", array.real
            yield f"{path}.imag", array.imag
        elif array.dtype.kind in "biuf":
            yield path, array
    elif hasattr(answer, "data_vars") or hasattr(answer, "dims"):  # of xarray
        variables = getattr(answer, "data_vars", {"values": answer})
        for name in variables:
            yield from leaves(np.asarray(variables[name]), f"{path}.{name}")
    elif isinstance(answer, Mapping):
        for key in answer:
            yield from leaves(answer[key], f"{path}[{key!r}]")
    elif isinstance(answer, list | tuple):
        for i, part in enumerate(answer):
            yield from leaves(part, f"{path}[{i}]")
    elif dataclasses.is_dataclass(answer):
        for field in dataclasses.fields(answer):
            yield from leaves(getattr(answer, field.name, None), f"{path}.{field.name}")


def _kept(arguments: Mapping[str, Any]) -> dict[str, tuple[str, bytes]]:
    return {
        name: (str(value.dtype), value.tobytes())
        for name, value in arguments.items()
        if isinstance(value, np.ndarray)
    }


def answer_to(call: Call, **hostile: object) -> Any:
    """Answer of the good call with some arguments replaced, or the error it is refused with."""
    function, arguments = call.make()
    arguments = arguments | copy.copy(hostile)
    before = _kept(arguments)
    try:
        answer = function(**arguments)  # a warning is an error here, as in every test
    except Exception as error:
        if not isinstance(error, (ValueError, *call.raises)):
            raise
        answer = error
    assert _kept(arguments) == before, f"{call.name} changes its input"
    return answer


def check_error(call: Call, argument: str, error: Exception, value: object) -> None:
    """One line that names argument and limit, and the value if that is one number."""
    message = str(error)
    where = f"{call.name}({argument}={shown(value)}): {message!r}"
    assert message, where
    assert "\n" not in message, where
    assert len(message) < 1000, where
    if isinstance(error, ValueError):
        word = call.says.get(argument, argument)
        assert re.search(rf"(?<![a-zA-Z]){word}(?![a-zA-Z])", message), where
        assert LIMIT.search(message), where


def check(call: Call, argument: str, value: object) -> Any:
    """Hold what the module's text says of one hostile value; return the answer."""
    answer = answer_to(call, **{argument: value})
    if isinstance(answer, Exception):
        check_error(call, argument, answer, value)
        return answer
    for path, array in leaves(answer):
        where = f"{call.name}({argument}={shown(value)}): {path}"
        assert call.nan or not np.isnan(array).any(), where
        assert call.infinite or not np.isinf(array).any(), where
    return answer


def check_refused(call: Call, argument: str, name: str) -> None:
    """Hold that what is no number is refused, and that the message names it."""
    value = NO_NUMBER[name]
    if value is None and argument in call.optional:
        return
    if argument in call.unbounded and name in ("inf", "-inf"):
        check(call, argument, value)
        return
    answer = answer_to(call, **{argument: value})
    where = f"{call.name}({argument}={shown(value)})"
    assert isinstance(answer, ValueError), f"{where}: {shown(answer)}"
    check_error(call, argument, answer, value)
    if isinstance(value, float | str | None | complex | bool):
        assert repr(value) in str(answer), f"{where}: {answer!s}"


def good_row(call: Call, argument: str) -> NDArray[np.float64]:
    """The good numbers of an array argument."""
    good = np.array(call.make()[1][argument], dtype=np.float64)
    assert good.ndim == 1, f"{call.name}: {argument} must be a row of at least 4 numbers"
    assert good.size >= 4, f"{call.name}: {argument} must be a row of at least 4 numbers"
    return good


def check_layout(call: Call, argument: str, name: str, value: Any) -> None:
    """Hold that the answer is that to a plain array of the same numbers, to the last bit."""
    plain = np.array(value, dtype=np.float64, order="C")
    expected, found = (answer_to(call, **{argument: given}) for given in (plain, value))
    where = f"{call.name}({argument}: {name})"
    if isinstance(expected, Exception):
        assert isinstance(found, type(expected)), where
        check_error(call, argument, found, value)
        return
    assert not isinstance(found, Exception), f"{where}: {shown(found)}"
    pairs = list(zip(leaves(expected), leaves(found), strict=True))
    assert pairs, f"{where} has no numbers in its answer"
    for (path, one), (_, other) in pairs:
        assert one.shape == other.shape, f"{where}: {path}"
        assert one.dtype == other.dtype, f"{where}: {path}"
        # of equal zeros the signs count too
        assert np.array_equal(one, other, equal_nan=True), f"{where}: {path}"
        assert np.array_equal(np.signbit(one), np.signbit(other)), f"{where}: {path}"


def hold_all(check: Callable[..., object], cases: Iterable[tuple[Any, ...]]) -> None:
    """Call `check` with every case and report all that fail, not the first alone."""
    failed = []
    for case in cases:
        try:
            check(*case)
        except Exception as error:
            what = str(error).split("\nassert ")[0]
            if not isinstance(error, AssertionError):
                what = f"{shown(case)}: {type(error).__name__}: {what}"
            failed.append(what)
    assert not failed, "\n".join(failed)


def public() -> dict[str, object]:
    """Everything public that can be called, by name: functions, classes, and their methods."""
    modules: dict[str, ModuleType] = {"": cl, **{f"{n}.": getattr(cl, n) for n in SUBMODULES}}
    found: dict[str, object] = {}
    for prefix, module in modules.items():
        for name in dir(cl) if module is cl else module.__all__:
            value = getattr(module, name)
            if callable(value) and not any(value is other for other in found.values()):
                found[prefix + name] = value
    for name, value in list(found.items()):
        if inspect.isclass(value) and not issubclass(value, BaseException | tuple):
            for method, attribute in inspect.getmembers(value):
                named = method == "__call__" or not method.startswith("_")
                of_base = getattr(attribute, "__qualname__", "").startswith("Parameters.")
                routine = inspect.isroutine(attribute) and not isinstance(
                    attribute, cached_property
                )
                if named and routine and not of_base:
                    found[f"{name}.{method}"] = attribute
    return found
