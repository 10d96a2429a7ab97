"""Points of a law: its maximum, and where its second derivative is not continuous."""

from __future__ import annotations

from typing import NamedTuple


class Peak(NamedTuple):
    """The largest traction ratio and the normalized creepage where it stands."""

    normalized_creepage: float
    traction_ratio: float


class Corner(NamedTuple):
    """A creepage x* below which a law has parts like (x* - x)**power, also times ln(x* - x)."""

    normalized_creepage: float
    power: float
