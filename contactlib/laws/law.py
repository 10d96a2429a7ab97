"""Interface of a law for tables and fits."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from numpy.typing import ArrayLike

from contactlib.base.quantities import FloatArray


class Law(Protocol):
    """A law at given parameters, as a table and a fit need it; for a fit it is a dataclass.

    Optional attributes: `tail_decay`, if the law tends to 1 like another power of 1/x than the
    third; `corner`, if its second derivative is not continuous; ``evaluate(x)``, if it computes
    ratio and slope together.
    """

    def traction_ratio(self, normalized_creepage: ArrayLike) -> FloatArray:
        """Traction ratio at normalized creepages."""

    def slope(self, normalized_creepage: ArrayLike) -> FloatArray:
        """Derivative of the traction ratio."""


class Corner(NamedTuple):
    """A creepage x* below which a law has parts like (x* - x)**power, also times ln(x* - x)."""

    normalized_creepage: float
    power: float
