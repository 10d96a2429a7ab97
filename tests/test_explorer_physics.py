"""The explorer page's analysis against Python's: fold, S-curve, gains, clearing."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import pytest
from explorer_page import ExplorerPage, open_page
from explorer_vehicle import random_wheelset, vehicle_of

import contactlib as cl
from contactlib.stability import (
    clearing,
    creep_control_gain,
    creepage_pole,
    delay_limit,
    find_fold,
    proportional_window,
    quasi_steady_slope,
    quasi_steady_torque,
    s_curve,
    steady_states,
)

SURVEYED = 60


class Case(NamedTuple):
    """A wheelset somewhere."""

    wheelset: cl.Wheelset
    speed: float
    normal_load: float
    friction_scale: float = 1.0

    @property
    def inputs(self) -> dict[str, float]:
        return self._asdict() | {"wheelset": None}
