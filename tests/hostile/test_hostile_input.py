"""Hostile numbers, to the validators in every form and to every public argument once.

Either the answer is right - no nan, infinite only where that is known - or a ValueError of one line
names argument, value and limit. Nothing warns, no input array is changed, and an answer depends on
the numbers alone: not on type, order or strides of the array that brings them.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from functools import cached_property
from itertools import product
from typing import Annotated, Any

import good_calls
import numpy as np
import pytest
from good_calls import EXEMPT, INFINITE, NOT_A_NUMBER, REPORTED_AS, Call, public
from numpy.typing import NDArray

from contactlib.base.quantities import (
    MODERATE,
    Parameters,
    Quantity,
    checked,
    checked_number,
    checked_whole,
    declared,
    records,
    shown,
)
from contactlib.laws import ConvergenceError

# Odd points of a measured curve are warned of.
pytestmark = [
    pytest.mark.filterwarnings("ignore::contactlib.InputWarning"),
    pytest.mark.filterwarnings("ignore::contactlib.element.AspectWarning"),
]

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
    "tuple of nan": (1.0, float("nan")),
    "largest longdouble": np.finfo(np.longdouble).max,
}

# Numbers at the ends of what floats hold, and of other types and shapes.
EXTREMES: list[Any] = [
    *(s * v for v in (0.0, 5e-324, 1e-300, 1e-30, 2.0**-52, 1.0, 1e30, 1e308) for s in (1, -1)),
    *(1, 2**53 + 1, 10**30, 10**400, 0.7318, 2.5, -41.5),
    *(np.float16(0.3), np.float32(0.3), np.longdouble("0.3"), Fraction(1, 3)),
    *(np.array(0.3), np.array([0.3]), np.array([]), [], np.empty((0, 3))),
    *(np.array([], dtype=np.int64), [0.3, 0.4], np.array([[0.3, 0.4], [0.5, 0.6]])),
]


def layouts(good: NDArray[np.float64]) -> Iterator[Any]:
    """The numbers of a row in other types, orders, strides and shapes.

    Narrower types change the numbers: what counts is what they hold.
    """
    n = good.size // 2
    frozen, record = good.copy(), np.zeros(good.size, dtype=[("a", "i1"), ("b", "f8")])
    frozen.flags.writeable = False
    record["b"] = good
    yield from (good.tolist(), tuple(good.tolist()), good[::-1], np.repeat(good, 2)[::2], frozen)
    yield from (good.astype(">f8"), record["b"], np.broadcast_to(good[:1], good.shape))
    yield np.frombuffer(b"\0" + good.tobytes(), np.uint8)[1:].view(np.float64)  # unaligned
    with np.errstate(over="ignore"):
        yield from [good.astype(kind) for kind in ("float32", "float16", "longdouble")]
    for kind in ("int8", "int32", "int64", "uint8", "uint64"):
        yield np.clip(np.ceil(np.abs(good)), 0, 100).astype(kind)
    pair = good[: 2 * n].reshape(2, n)
    yield from (pair, pair.tolist(), np.asfortranarray(pair), pair.T)
    yield from (pair.reshape(1, 2, 1, n), pair.reshape(1, 2, 1, n)[::-1, ::-1, :, ::-1])
    yield from (np.broadcast_to(pair, (3, 2, n)), np.array(good[0]), good[:1])
    yield from (good[:0], np.empty((2, 0, 3)))


CALLS = list(good_calls.calls())
EACH = pytest.mark.parametrize("call", CALLS, ids=[call.name for call in CALLS])


# ---- what must come of it -------------------------------------------------------------------


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


def leaves(answer: object, path: str = "answer") -> Iterator[tuple[str, NDArray[Any]]]:
    """Every number of an answer: of arrays, records, mappings, sequences and dataclasses."""
    parts: Iterable[tuple[Any, Any]] = ()
    if isinstance(answer, np.ndarray) and answer.dtype.names:
        parts = ((name, answer[name]) for name in answer.dtype.names)
    elif isinstance(answer, bool | int | float | complex | np.ndarray | np.generic):
        array = np.asarray(answer)
        if array.dtype.kind == "c":
            parts = (("real", array.real), ("imag", array.imag))
        elif array.dtype.kind in "biuf":
            yield path, array
    elif hasattr(answer, "data_vars"):  # of xarray
        parts = ((name, np.asarray(values)) for name, values in answer.data_vars.items())
    elif hasattr(answer, "dims"):
        parts = (("values", np.asarray(answer)),)
    elif isinstance(answer, Mapping):
        parts = answer.items()
    elif isinstance(answer, list | tuple):
        parts = enumerate(answer)
    elif dataclasses.is_dataclass(answer):
        parts = ((f.name, getattr(answer, f.name, None)) for f in dataclasses.fields(answer))
    for name, part in parts:
        yield from leaves(part, f"{path}.{name}")


def properties(answer: object) -> list[object]:
    """Public properties of an object that are numbers."""
    kind: Any = type(answer)
    if not isinstance(answer, Parameters):
        return []
    names = [n for n in dir(kind) if not n.startswith("_") and is_property(getattr(kind, n))]
    return [value for name in names if isinstance(value := getattr(answer, name), float | tuple)]


def is_property(member: object) -> bool:
    return isinstance(member, property | cached_property)


def answer_to(call: Call, **hostile: object) -> Any:
    """Answer of the good call with some arguments replaced, or the error it is refused with."""
    arguments = call.good() | hostile
    arrays = [value for value in arguments.values() if isinstance(value, np.ndarray)]
    before = [(str(array.dtype), array.tobytes()) for array in arrays]
    try:
        answer = call(**arguments)  # a warning is an error here, as in every test
        answer = (answer, *properties(answer))
    except (ValueError, ConvergenceError) as error:
        answer = error
    after = [(str(array.dtype), array.tobytes()) for array in arrays]
    assert after == before, f"{call.name} changes its input"
    return answer


def check_error(call: Call, argument: str, value: object, error: Exception) -> None:
    """One line that names argument and limit, and the value if that is one number."""
    message = str(error)
    where = f"{call.name}({argument}={shown(value)}): {message!r}"
    assert message.isprintable(), where
    assert 0 < len(message) < 1000, where
    if isinstance(error, ValueError):
        word = REPORTED_AS.get((call.covers, argument), argument)
        assert re.search(rf"(?<![a-zA-Z])({word})(?![a-zA-Z])", message), where
        assert re.search(
            "must|need|only one|missing|out of range|is not|are not|no |not |too |only ", message
        ), where


def check_refused(call: Call, argument: str, value: object) -> None:
    answer = answer_to(call, **{argument: value})
    where = f"{call.name}({argument}={shown(value)})"
    assert isinstance(answer, ValueError), f"{where}: {shown(answer)}"
    check_error(call, argument, value, answer)
    assert isinstance(value, np.ndarray) or repr(value) in str(answer), f"{where}: {answer!s}"


def check(call: Call, argument: str, value: object) -> None:
    answer = answer_to(call, **{argument: value})
    if isinstance(answer, Exception):
        check_error(call, argument, value, answer)
        return
    for path, array in leaves(answer):
        where = f"{call.name}({argument}={shown(value)}): {path}"
        assert call.covers in NOT_A_NUMBER or not np.isnan(array).any(), where
        assert call.covers in INFINITE or not np.isinf(array).any(), where


def check_layout(call: Call, argument: str, value: Any) -> None:
    """The answer is that to a plain array of the same numbers, to the last bit."""
    plain = np.array(value, dtype=np.float64, order="C")
    expected, found = (answer_to(call, **{argument: given}) for given in (plain, value))
    where = f"{call.name}({argument}={shown(value)})"
    if isinstance(expected, Exception):
        assert isinstance(found, type(expected)), where
        check_error(call, argument, value, found)
        return
    assert not isinstance(found, Exception), f"{where}: {shown(found)}"
    pairs = list(zip(leaves(expected), leaves(found), strict=True))
    assert pairs, f"{where} has no numbers in its answer"
    for (path, one), (_, other) in pairs:
        # of equal zeros the signs count too
        same = (one.dtype, one.shape, one.tobytes()) == (other.dtype, other.shape, other.tobytes())
        assert same, f"{where}: {path}"


# ---- validators -----------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Declared(Parameters):
    """A class of declared quantities."""

    x: Annotated[float, Quantity("m", at_least=-1e50, at_most=1e50)]


VALIDATORS: dict[str, Callable[[Any], Any]] = {
    "checked": lambda x: checked("x", x, MODERATE),
    "only read": lambda x: checked("x", x, MODERATE, copy=False),
    "checked_number": lambda x: checked_number("x", x, MODERATE),
    "checked_whole": lambda x: checked_whole("x", x, MODERATE),
    "records": lambda x: records(np.dtype([("x", "f8")]), {"x": x}, {"x": MODERATE})["x"],
    "Parameters": lambda x: Declared(x=x).x,
}
OF_ARRAYS = ("checked", "only read", "records")


def outcome(validator: str, value: object) -> Any:
    try:
        return VALIDATORS[validator](value)
    except ValueError as error:
        found = error
    assert re.search(r"\bx = .* must be (a whole number|finite and >= -1e\+50)", str(found)), found
    assert str(found).isprintable()
    return found


@pytest.mark.parametrize("validator", VALIDATORS)
@pytest.mark.parametrize("name", NO_NUMBER)
def test_a_validator_refuses_what_is_no_number(validator: str, name: str) -> None:
    value = NO_NUMBER[name]
    found = outcome(validator, value)
    assert isinstance(found, ValueError), shown(found)
    if isinstance(value, float | str | None | complex | bool):
        assert repr(value) in str(found)


@pytest.mark.parametrize("validator", VALIDATORS)
def test_a_validator_takes_the_number_that_is_meant_or_refuses_it(validator: str) -> None:
    for value in [*EXTREMES, *layouts(good_calls.X)]:
        found = outcome(validator, value)
        if isinstance(found, ValueError):
            array = np.asarray(value)  # of objects, if no type of numpy's holds the number
            fine = (array.ndim == 0 or validator in OF_ARRAYS) and array.dtype.kind in "iuf"
            if fine and validator == "checked_whole":
                fine = bool((array == np.round(array)).all())
            assert not (fine and MODERATE.allows(array).all()), shown(value)
        else:
            expected = np.asarray(value, dtype=np.float64)
            np.testing.assert_array_equal(found, expected, strict=validator in OF_ARRAYS)
            signs = validator == "checked_whole" or np.signbit(found) == np.signbit(expected)
            assert np.all(signs)


DECLARED = [
    (call, key, quantity)
    for call in CALLS
    if isinstance(kind := public()[call.covers], type) and issubclass(kind, Parameters)
    for key, one in declared(public()[call.covers]).items()
    if (quantity := one.quantity) and not one.many and call.name == call.covers
]


@pytest.mark.parametrize(("call", "key", "quantity"), DECLARED)
def test_a_declared_limit_holds(call: Call, key: str, quantity: Quantity) -> None:
    bounds = [quantity.above, quantity.below, math.nextafter(quantity.at_least, -math.inf)]
    bounds.append(math.nextafter(quantity.at_most, math.inf))
    for value in bounds:
        answer = answer_to(call, **{key: value})
        assert isinstance(answer, ValueError), value
        assert f"{call.name}.{key} = {value!r}" in str(answer)
        assert str(answer).endswith(f"must be {quantity}")


# ---- everything public ----------------------------------------------------------------------


def test_everything_public_is_called_or_exempt_for_a_reason() -> None:
    assert {call.covers for call in CALLS} == set(public()) - set(EXEMPT)
    assert set(EXEMPT) <= set(public()), "exempt, but not there"
    assert all(EXEMPT.values())
    assert len({call.name for call in CALLS}) == len(CALLS)


@EACH
def test_good_call_has_an_answer(call: Call) -> None:
    answer = answer_to(call)
    assert not isinstance(answer, Exception), answer
    for path, array in leaves(answer):
        assert call.covers in NOT_A_NUMBER or not np.isnan(array).any(), path


@EACH
def test_every_number_is_checked(call: Call) -> None:
    def cases() -> Iterator[tuple[Call, str, object]]:
        for argument in call.numbers:
            given = call.good().get(argument)
            if isinstance(given, np.ndarray):
                bad = given.astype(float)
                bad[1 % bad.size] = np.nan
                yield from ((call, argument, bad), (call, argument, given.astype(str)))
            elif argument in call.arrays or not isinstance(given, tuple):
                yield from ((call, argument, math.nan), (call, argument, "1.0"))
            if argument not in call.optional:
                yield call, argument, None

    hold_all(check_refused, cases())


@EACH
def test_layout_of_an_array_does_not_count(call: Call) -> None:
    for argument in call.arrays & set(call.numbers):
        good = call.arguments.get(argument)
        if not isinstance(good, np.ndarray):
            continue
        odd: list[Any] = [np.repeat(good.astype(">f8"), 2)[::2]]
        if not call.takes_rows(argument):
            odd += [good.astype(">f4").reshape(2, -1).T[::-1], good.tolist()]
            odd += [np.array(good[0]), good[:0], np.empty((2, 0, 3))]
        hold_all(check_layout, ((call, argument, value) for value in odd))


@pytest.mark.slow
@EACH
def test_extreme_numbers(call: Call) -> None:
    # python-control's arithmetic overflows at large gains.
    numbers = [name for name in call.numbers if name != "gains"]
    # Other types and layouts are a matter of the validators, which each argument has.
    extremes = [value for value in EXTREMES if isinstance(value, float)]
    for name in numbers:
        values = [*extremes, None] if name in call.optional else extremes
        hold_all(check, product([call], [name], values))
