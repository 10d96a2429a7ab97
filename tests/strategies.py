"""Random numbers and wheelsets for property tests.

With the environment variable CONTACTLIB_EXAMPLES=10 every property is tried with ten times as many.
"""

from __future__ import annotations

import math
import os
from collections.abc import Collection
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

import contactlib as cl

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


@cache
def tables() -> list[cl.CreepForceTable]:
    laws = (cl.CarterGriffith, cl.Polach(adhesion_reduction=0.9, slip_reduction=0.4))
    return [cl.CreepForceTable.from_law(law) for law in laws]


def random_wheelset(body: cl.Wheelset, rng: np.random.Generator) -> cl.Wheelset:
    """A wheelset of either law, with any kind of friction, with or without mass and damping."""
    kinetic = rng.uniform(0.05, 0.4)
    fall: dict[str, Any] = [
        {},
        {
            "slip_rate_residual": rng.uniform(0.2, 0.9),
            "slip_rate_decay": 10.0 ** rng.uniform(-2.0, 2.0),
        },
        {"softening_temperature": rng.uniform(300.0, 1200.0)},
    ][rng.integers(3)]
    friction = cl.friction_with_k_hat(
        body.element.contact,
        k_hat=rng.uniform(0.02, 0.6),
        static=kinetic * rng.uniform(1.1, 2.5),
        kinetic=kinetic,
    )
    element = replace(
        body.element,
        table=tables()[rng.integers(2)],
        friction=replace(friction, **fall),
        slope_reduction=rng.uniform(0.1, 1.0),
    )
    damping = float(rng.choice([0.0, 5.0, 50.0, 500.0]))
    mass = [None, 22.5e3][rng.integers(2)]
    return replace(body, element=element, damping=damping, mass=mass)
