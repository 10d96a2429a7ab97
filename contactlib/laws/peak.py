"""What every law says of its maximum."""

from __future__ import annotations

from typing import NamedTuple


class Peak(NamedTuple):
    """The largest traction ratio and the normalized creepage where it stands."""

    normalized_creepage: float
    traction_ratio: float
