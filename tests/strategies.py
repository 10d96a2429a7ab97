"""Random numbers for property tests.

With the environment variable CONTACTLIB_EXAMPLES=10 every property is tried with ten times as many.
"""

from __future__ import annotations

import math
import os
from collections.abc import Collection

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

EXAMPLES = float(os.environ.get("CONTACTLIB_EXAMPLES", "1"))


def examples(count: int, ignored: Collection[HealthCheck] = ()) -> settings:
    """Settings under which a property is tried with `count` numbers, the same in every run."""
    return settings(
        max_examples=max(1, int(count * EXAMPLES)),
        derandomize=True,
        deadline=None,
        database=None,
        suppress_health_check=ignored,
    )


def number(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high)


def magnitude(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers evenly spread over their decades."""
    return number(math.log(low), math.log(high)).map(math.exp)
