"""Hostile numbers: to the validators in every form; and each public argument reaches a validator.

Either the answer is right - no nan, infinite only where that is known - or a ValueError of one line
names argument, value and limit.
"""

from __future__ import annotations

import dataclasses
import inspect
import math
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from functools import partial
from typing import Annotated, Any

import numpy as np
import pytest
from numpy.typing import NDArray
from public_calls import (
    EXEMPT,
    INFINITE,
    NOT_A_NUMBER,
    NUMBERS,
    arguments,
    numbers_of,
    public,
    receiver,
)

from contactlib.base import quantities
from contactlib.base.quantities import (
    MODERATE,
    Limits,
    Parameters,
    Quantity,
    checked,
    checked_number,
    checked_whole,
    declared,
    records,
    shown,
)

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

GOOD_ROW = np.array([-2.0, -0.4, 0.0, 0.3, 1.0, 1.6])

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
        raised = error
    text = str(raised)
    assert re.search(r"\bx = .* must be (a whole number|finite and >= -1e\+50)", text), text
    assert text.isprintable()
    return raised


@pytest.mark.parametrize("validator", VALIDATORS)
@pytest.mark.parametrize("name", NO_NUMBER)
def test_a_validator_refuses_what_is_no_number(validator: str, name: str) -> None:
    value = NO_NUMBER[name]
    answer = outcome(validator, value)
    assert isinstance(answer, ValueError), shown(answer)
    if isinstance(value, float | str | None | complex | bool):
        assert repr(value) in str(answer)


@pytest.mark.parametrize("validator", VALIDATORS)
def test_a_validator_takes_the_number_that_is_meant_or_refuses_it(validator: str) -> None:
    for value in [*EXTREMES, *layouts(GOOD_ROW)]:
        answer = outcome(validator, value)
        if isinstance(answer, ValueError):
            array = np.asarray(value)  # of objects, if no type of numpy's holds the number
            fine = (array.ndim == 0 or validator in OF_ARRAYS) and array.dtype.kind in "iuf"
            if fine and validator == "checked_whole":
                fine = bool((array == np.round(array)).all())
            assert not (fine and MODERATE.allows(array).all()), shown(value)
        else:
            expected = np.asarray(value, dtype=np.float64)
            np.testing.assert_array_equal(answer, expected, strict=validator in OF_ARRAYS)
            signs = validator == "checked_whole" or np.signbit(answer) == np.signbit(expected)
            assert np.all(signs)


def public_parameters() -> Iterator[tuple[type[Parameters], str, Quantity]]:
    for kind in public().values():
        if isinstance(kind, type) and issubclass(kind, Parameters):
            of_class: Any = kind
            for key, parameter in declared(of_class).items():
                if parameter.quantity and not parameter.many:
                    yield kind, key, parameter.quantity


@pytest.mark.parametrize(("kind", "key", "quantity"), list(public_parameters()))
def test_a_declared_limit_holds(kind: type[Parameters], key: str, quantity: Quantity) -> None:
    bounds = [quantity.above, quantity.below, math.nextafter(quantity.at_least, -math.inf)]
    bounds.append(math.nextafter(quantity.at_most, math.inf))
    of_class: Any = kind
    for value in bounds:
        with pytest.raises(ValueError, match=rf"^{kind.__name__}\.{key} = ") as raised:
            declared(of_class)[key].checked(f"{kind.__name__}.{key}", value)
        assert f" = {value!r} " in str(raised.value)
        assert str(raised.value).endswith(f"must be {quantity}")


# ---- everything public ----------------------------------------------------------------------


class Mark:
    """Stands for a number that no validator has seen: nothing can be done with it."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __repr__(self) -> str:
        return f"Mark({self.name})"

    def _use(self, *others: object) -> Any:
        raise AssertionError(f"{self.name} is used before it is checked")

    __float__ = __int__ = __index__ = __bool__ = __abs__ = __neg__ = __len__ = __iter__ = _use
    __lt__ = __le__ = __gt__ = __ge__ = __getitem__ = __array__ = _use
    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = __rtruediv__ = _use


class AllChecked(Exception):  # noqa: N818
    """All marks have reached a validator."""


class Validators:
    """The package's validators: they put a good number in place of a mark and note its limits."""

    NAMES = ("checked", "checked_number", "checked_whole", "checked_row")

    def __init__(self, function: str, patch: pytest.MonkeyPatch) -> None:
        self.function, self.awaited = function, set[str]()
        self.limits: dict[str, Limits] = {}
        for name in self.NAMES:
            original = getattr(quantities, name)
            check = partial(self._check, original)
            for module in list(sys.modules.values()):
                if module.__name__.startswith("contactlib.") and vars(module).get(name) is original:
                    patch.setattr(module, name, check)

    def _check(
        self, original: Callable[..., Any], name: str, value: Any, limits: Limits, **options: Any
    ) -> Any:
        mark = value[0] if isinstance(value, tuple) and len(value) == 1 else value
        if isinstance(mark, Mark):
            assert mark.name in re.findall(r"\w+", name), f"{mark.name} is reported as {name}"
            self.limits[mark.name] = limits
            if self.awaited <= set(self.limits):
                raise AllChecked
            value = good_number(self.function, mark.name, limits)
            if original is quantities.checked_row:
                value = (value,)
        return original(name, value, limits, **options)


def good_number(function: str, name: str, limits: Limits) -> Any:
    usual = [v for v in (1.0, 10.0, 1e3, 0.5, 0.1, 1e-3, 1e-6, 0.0) if limits.allow(v)]
    return NUMBERS.get(f"{function} {name}", NUMBERS.get(name, usual[0]))


def limits_of(name: str, patch: pytest.MonkeyPatch) -> dict[str, Limits]:
    """Limits of each number that a public function takes, which all reach a validator unused."""
    function = public()[name]
    validators = Validators(name, patch)
    receivers, numbers = receiver(name, function), numbers_of(function)
    failures = []
    for together in (numbers, *([number] for number in numbers)):
        validators.awaited = set(together) - set(validators.limits)
        if not validators.awaited:
            continue
        marks = {number: Mark(number) for number in together}
        others = {
            n: NUMBERS.get(f"{name} {n}", NUMBERS.get(n, 1.0))
            for n in required(function)
            if n not in marks
        }
        given = {key: value for key, value in (others | marks).items() if value is not None}
        try:
            function(*receivers, **arguments(name, function, **given))
            failures.append(f"{together} were not checked")
        except AllChecked:
            continue
        except Exception as error:
            if len(together) == 1 and f"{together[0]} = Mark(" in str(error):  # refused as it is
                validators.limits[together[0]] = Limits()
            failures.append(f"{type(error).__name__}: {error}")
    patch.undo()
    assert set(validators.limits) == set(numbers), "\n".join(failures)
    return validators.limits


def required(function: Any) -> list[str]:
    parameters = inspect.signature(function).parameters
    return [
        n
        for n in numbers_of(function)
        if n in parameters and parameters[n].default is inspect.Parameter.empty
    ]


CALLED = sorted(set(public()) - set(EXEMPT))


@pytest.mark.parametrize("name", CALLED)
def test_every_number_reaches_a_validator(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    limits_of(name, monkeypatch)


def test_what_is_exempt_is_public() -> None:
    assert set(EXEMPT) <= set(public())


def answer_to(name: str, **given: Any) -> Any:
    """Answer to a call, or the error by which it is refused."""
    function = public()[name]
    try:
        return function(*receiver(name, function), **arguments(name, function, **given))
    except (ValueError, RuntimeError) as error:  # also of an integrator that gives up
        return error


# Entrances to the kernel, which takes contiguous arrays of doubles.
ENTRANCES: dict[str, dict[str, float]] = {
    "CreepForceTable.evaluate": {"normalized_creepage": 0.8, "k_hat": 0.3, "layer_ratio": 0.1},
    "CreepForces.evaluate": {"semi_axis_x": 6e-3, "semi_axis_y": 5e-3, "normal_load": 1e5,
                             "creepage_x": -2e-3, "creepage_y": 1e-3, "spin": 0.4},
    "ForceElement.evaluate": {"omega": 20.2, "speed": 10.0, "axle_load": 1e5,
                              "friction_scale": 0.9, "lateral_velocity": 0.02},
    "ForceElement.force": {"omega": 20.2, "speed": 10.0, "axle_load": 1e5},
    "ForceElement.at_creepage": {"creepage": 0.01, "axle_load": 1e5},
    "ThermalContact.traction_coefficient": {"creepage": 0.01, "speed": 10.0},
    "CreepCurve.torque": {"creepage": 0.01},
    "CreepCurve.pole": {"creepage": 0.01},
    "poles": {"creepage": 0.01, "speed": 10.0},
    "available_force": {"speed": 10.0, "axle_load": 1e5},
    "Track.friction_scale": {"distance": 0.2},
    "DynamicLoad.__call__": {"time": 0.4},
}  # fmt: skip


@pytest.mark.parametrize("name", ENTRANCES)
def test_layout_of_an_array_does_not_count(name: str) -> None:
    # Nor does its type; and no array is changed.
    values = {n: v * np.linspace(0.7, 1.2, 12) for n, v in ENTRANCES[name].items()}
    fixed = {n: 10.0 for n in required(public()[name]) if n not in values}
    whole = {n: row.astype(">f4").reshape(3, 4) for n, row in values.items()}
    odd = {n: np.asfortranarray(array)[::-1, ::2] for n, array in whole.items()}
    before = [array.tobytes() for array in odd.values()]
    plain = {n: np.array(array, dtype=np.float64, order="C") for n, array in odd.items()}
    listed = {n: array.tolist() for n, array in odd.items()}
    expected, *others = (
        list(leaves(answer_to(name, **fixed, **given))) for given in (plain, odd, listed)
    )
    assert expected
    for answers in others:
        for (path, a), (_, b) in zip(expected, answers, strict=True):
            assert (a.dtype, a.shape, a.tobytes()) == (b.dtype, b.shape, b.tobytes()), path
    assert [array.tobytes() for array in odd.values()] == before


# Many simulations, files, what takes either of two pairs of rows or a profile in steps, and
# python-control's arithmetic, which overflows at large gains.
NO_EXTREMES = {
    "Profile.kept_by",
    "sampled_loop",
    "DynamicLoad",
    "benchmark",
    "benchmark_scenarios",
    "sensor_errors",
    "tune",
    "export_fmu",
    "export_ssp",
}


@pytest.mark.slow
@pytest.mark.parametrize("name", [n for n in CALLED if n not in NO_EXTREMES])
def test_extreme_numbers(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    limits = limits_of(name, monkeypatch)
    needed = {
        *required(public()[name]),
        *(limits.keys() & {"speed", "radius", "duration", "fill_time"}),
    }
    good = {n: good_number(name, n, limits[n]) for n in needed}
    good = {n: value for n, value in good.items() if value is not None}
    answer = answer_to(name, **good)
    assert not isinstance(answer, Exception), answer
    for argument, allowed in limits.items():
        ends = [allowed.at_least, allowed.at_most, allowed.above, allowed.below]
        extremes = [v for v in EXTREMES if isinstance(v, float)]
        for value in {*extremes, *(end for end in ends if math.isfinite(end))}:
            answer = answer_to(name, **{**good, argument: value})
            where = f"{name}({argument}={value!r})"
            if isinstance(answer, Exception):
                assert str(answer).isprintable(), where
                assert 0 < len(str(answer)) < 1000, where
                continue
            for path, array in leaves(answer):
                assert name in NOT_A_NUMBER or not np.isnan(array).any(), f"{where}: {path}"
                assert name in INFINITE or not np.isinf(array).any(), f"{where}: {path}"
