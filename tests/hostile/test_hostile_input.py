"""Every public call with hostile input: a right answer, or a ValueError that names what is wrong.

With CONTACTLIB_EXAMPLES above 1 the extremes of slow calls are tried too.
"""

from __future__ import annotations

from functools import partial
from itertools import product

import calls_contact
import calls_dynamics
import numpy as np
import pytest
from hostile import (
    EXTREMES,
    NO_NUMBER,
    ROW_LAYOUTS,
    Call,
    answer_to,
    check,
    check_layout,
    check_refused,
    good_row,
    hold_all,
    layouts,
    leaves,
    public,
)
from hypothesis import HealthCheck, example, given
from hypothesis import strategies as st
from strategies import EXAMPLES, examples

CALLS = [*calls_contact.CALLS, *calls_dynamics.CALLS]
EXEMPT = {**calls_contact.EXEMPT, **calls_dynamics.EXEMPT}
SOME = 7  # every how manieth layout a slow call is tried with in the quick run
NAMES = [call.name for call in CALLS]
EACH = pytest.mark.parametrize("call", CALLS, ids=NAMES)


# Odd points of a measured curve are warned of.
pytestmark = [
    pytest.mark.filterwarnings("ignore::contactlib.InputWarning"),
    pytest.mark.filterwarnings("ignore::contactlib.AspectWarning"),
]


def test_everything_public_is_called_or_exempt_for_a_reason() -> None:
    called = {call.covers for call in CALLS}
    assert set(public()) - called - set(EXEMPT) == set()
    assert set(EXEMPT) - set(public()) == set(), "exempt, but not there"
    assert called & set(EXEMPT) == set()
    assert all(EXEMPT.values())


def test_names_of_calls_are_unique() -> None:
    assert len(set(NAMES)) == len(NAMES)


@EACH
def test_good_call_has_an_answer(call: Call) -> None:
    assert set(call.arguments) <= set(call.make()[1])
    if call.long:
        pytest.skip("takes seconds, and other tests")
    answer = answer_to(call)
    assert not isinstance(answer, Exception), answer
    for path, array in leaves(answer):
        assert call.nan or not np.isnan(array).any(), path


@EACH
def test_what_is_no_number_is_refused(call: Call) -> None:
    hold_all(partial(check_refused, call), product(call.arguments, NO_NUMBER))


@pytest.mark.slow
@EACH
def test_extreme_numbers(call: Call) -> None:
    if call.long or (call.slow and EXAMPLES <= 1):
        pytest.skip("slow: see the module's text")
    hold_all(partial(check, call), product(call.arguments, EXTREMES.values()))


@pytest.mark.slow
@EACH
@examples(5, list(HealthCheck))
@given(value=st.floats(allow_nan=False, allow_infinity=False))
@example(value=1.5)
def test_any_number(call: Call, value: float) -> None:
    if not call.long and (EXAMPLES > 1 or not call.slow):
        for argument in call.arguments:
            check(call, argument, [value] * 4 if argument in call.rows else value)


@pytest.mark.slow
@EACH
def test_layout_of_an_array_does_not_count(call: Call) -> None:
    if call.long:
        pytest.skip("takes seconds")
    for argument in (*call.arrays, *call.rows):
        given = list(layouts(good_row(call, argument)))
        if call.slow and EXAMPLES <= 1:
            given = given[::SOME]
        row = argument in call.rows
        same = [(name, value) for name, value in given if not row or name in ROW_LAYOUTS]
        other = [(value,) for name, value in given if row and name not in ROW_LAYOUTS]
        hold_all(partial(check_layout, call, argument), same)
        hold_all(partial(check, call, argument), other)
