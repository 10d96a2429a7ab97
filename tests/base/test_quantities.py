"""Checks of numbers: all at once, and each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples

from contactlib.base.quantities import (
    FINITE,
    Limits,
    Parameters,
    Quantity,
    checked,
    checks_call,
    declared,
)
from contactlib.files.sections import VEHICLE_SECTIONS

BOUND = st.sampled_from([-1.0, 0.0, 1.0])


@given(
    values=st.lists(st.floats() | BOUND, max_size=6),
    above=BOUND | st.just(-math.inf),
    at_least=BOUND | st.just(-math.inf),
    below=BOUND | st.just(math.inf),
    at_most=BOUND | st.just(math.inf),
)
@examples(100)
def test_all_are_allowed_if_each_is(
    values: list[float], above: float, at_least: float, below: float, at_most: float
) -> None:
    limits = Limits(above=above, at_least=at_least, below=below, at_most=at_most)
    array = np.array(values, dtype=np.float64)
    assert limits.allow_all(array) == limits.allows(array).all()


def test_what_is_checked_is_copied_unless_only_read() -> None:
    values = np.array([1.0, 2.0])
    assert not np.shares_memory(checked("values", values, FINITE), values)
    assert checked("values", values, FINITE, copy=False) is values


def test_the_first_offender_is_named() -> None:
    with pytest.raises(ValueError, match=r"^values = nan is out of range: must be finite and > 0$"):
        checked("values", [1.0, math.nan, -1.0], Limits(above=0.0))


@dataclass(frozen=True, kw_only=True)
class Rod(Parameters):
    """A class that declares its fields and another way to be made."""

    length: Annotated[float, Quantity("m", above=0.0)]
    end: Literal["free", "fixed"] = "free"

    @classmethod
    @checks_call
    def of_mass(
        cls, *, from_: Annotated[float, Quantity("kg", at_least=1.0)], length: float = 2.0
    ) -> float:
        return from_ / length


def test_what_a_method_does_not_declare_is_as_of_its_class() -> None:
    keys = declared(Rod.of_mass)
    assert list(keys) == ["from", "length"]  # `from` is a word that Python keeps for itself
    assert keys["length"].quantity is Rod.quantities()["length"]
    assert (keys["length"].default, declared(Rod)["length"].needed) == (2.0, True)
    assert Rod.of_mass(from_=3) == 1.5
    with pytest.raises(ValueError, match=r"^from = 0\.5 is out of range: must be finite and >= 1$"):
        Rod.of_mass(from_=0.5)
    with pytest.raises(
        ValueError, match=r"^length = 0\.0 is out of range: must be finite and > 0$"
    ):
        Rod.of_mass(from_=1.0, length=0.0)
    with pytest.raises(ValueError, match=r"^Rod\.end = 'loose' must be one of: free, fixed$"):
        Rod(length=1.0, end="loose")  # type: ignore[arg-type]


def arrays(  # as NumPy 2.4 defines ArrayLike
    *, speed: bool | complex | bytes | str | Sequence[complex | bytes | str] | None = None
) -> None: ...


def texts(*, unit: str | None = None, flag: bool | None = None, path: str | Path = "") -> None: ...


def test_only_a_text_alone_is_a_text() -> None:
    """Neither a path nor what numpy counts among arrays."""
    assert not declared(arrays)
    assert {name: parameter.choices for name, parameter in declared(texts).items()} == {
        "unit": (),
        "flag": (True, False),
    }
    assert "speed" not in VEHICLE_SECTIONS["law"]
